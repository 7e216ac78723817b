"""What goes wrong with edge equations in floating point, in numbers, beside the shipped algorithm that has no such fault.

Each function runs the lecture's program (`edge_equations`) and `scanspan.count` or `scanspan.rasterize` on the same shapes and
returns what differs. Where a number comes from random shapes, the shapes are the same in every run.

Source: S0, lines 193-519; S4, lines 391-409 for the speed hacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from scanspan.lectures.compare import shipped_channel, shipped_hits, shuffled_mesh
from scanspan.lectures.edge_equations import EdgeEqn, FlatTriangle, SmoothTriangle, accumulate, to_int
from scanspan.lectures.fixed_point import FixedFlatTriangle
from scanspan.lectures.raster import Color, Raster, Vertex, vertices

RED_GREEN_BLUE: tuple[Color, Color, Color] = ((255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255))


class SharedEdges(NamedTuple):
    """The samples of a mesh without gap or overlap, by how many triangles drew them."""

    samples: int
    drawn_twice: int  # or more often, with the code's >= 0
    gaps: int  # not drawn at all, with the text's > 0
    shipped_not_once: int  # not exactly once, with the top-left rule


def demonstrate_shared_edges(seed: int = 1, columns: int = 20, rows: int = 15, cell: int = 6) -> SharedEdges:
    """Draw a mesh of whole coordinates, once with edges included and once without."""
    mesh = shuffled_mesh(seed, columns, rows, cell)
    size = columns * cell, rows * cell
    inclusive, exclusive = Raster(*size), Raster(*size)
    for points in mesh:
        FlatTriangle(*vertices(points)).draw(inclusive)
        FlatTriangle(*vertices(points), inclusive=False).draw(exclusive)

    # Leave out the first row and column, which lie on the rim and not between triangles.
    inner = np.s_[1:, 1:]
    shipped = shipped_hits(mesh, size)[inner]
    twice, gaps = (inclusive.hits[inner] > 1).sum(), (exclusive.hits[inner] == 0).sum()
    return SharedEdges(shipped.size, int(twice), int(gaps), int((shipped != 1).sum()))


class UprightCrash(NamedTuple):
    """Triangles of no width, in double precision."""

    crashes: int
    drawn_as_degenerate: int  # found to have no area, as they should
    triangles: int
    shipped_pixels: int


def demonstrate_index_crash(count: int = 4000) -> UprightCrash:
    """Set up random triangles whose corners lie on one upright line, with one decimal: about half end outside of the table."""
    rng = np.random.default_rng(4)
    x, y = rng.integers(0, 1000, (count, 1)) / 10, rng.integers(0, 1000, (count, 3)) / 10
    points, raster = np.stack([np.broadcast_to(x, y.shape), y], axis=2), Raster(100, 100)
    crashes = degenerate = 0
    for corners in points:
        try:
            degenerate += not FlatTriangle(*vertices(corners)).triangle_setup(raster)
        except IndexError:
            crashes += 1
    return UprightCrash(crashes, degenerate, count, int(shipped_hits(points, (100, 100)).sum()))


class SmoothAsPrinted(NamedTuple):
    """How many colours appear in a triangle with three colours at its corners."""

    as_printed: int
    as_meant: int
    worst_against_shipped: float  # levels, of the triangle as meant, with the half added


def demonstrate_smooth_as_printed() -> SmoothAsPrinted:
    """Draw a smooth triangle by the method that S0 prints under that name, and by the one that it prepares."""
    points = [(2.0, 1.0), (29.0, 5.0), (9.0, 30.0)]
    printed, meant, rounded = Raster(32, 32), Raster(32, 32), Raster(32, 32)
    SmoothTriangle(*vertices(points, RED_GREEN_BLUE)).draw_as_printed(printed)
    SmoothTriangle(*vertices(points, RED_GREEN_BLUE)).draw(meant)
    SmoothTriangle(*vertices(points, RED_GREEN_BLUE)).draw(rounded, rounding=0.5)
    shipped = shipped_channel(points, RED_GREEN_BLUE, (32, 32))
    off = np.abs(rounded.rgba - shipped)[rounded.covered].max()
    colors = [len(np.unique(raster.rgba[raster.covered], axis=0)) for raster in (printed, meant)]
    return SmoothAsPrinted(colors[0], colors[1], float(off))


class MissingHalf(NamedTuple):
    """A channel that is 255 at all corners, cut off instead of rounded, and one that runs from 0 to 255."""

    dimmed: int  # pixels in which the constant is 254
    dimmed_when_rounded: int
    drawn: int
    mean_error: float  # levels, of the running channel
    mean_error_when_rounded: float
    shipped_dimmed: int


def demonstrate_missing_half() -> MissingHalf:
    """Draw a triangle without and with the half that S4 adds and S0 forgets."""
    points, size = [(68.0, 15.0), (58.0, 72.0), (3.0, 28.0)], (96, 80)
    plain, rounded = Raster(*size), Raster(*size)
    for raster, half in ((plain, 0.0), (rounded, 0.5)):
        SmoothTriangle(*vertices(points, [(0, 9, 9, 255), (255, 9, 9, 255), (80, 9, 9, 255)])).draw(raster, rounding=half)
    covered = plain.covered
    dimmed = [int((raster.rgba[covered, 3] < 255).sum()) for raster in (plain, rounded)]
    red = shipped_channel(points, [0.0, 255.0, 80.0], size)[covered]
    errors = [float((raster.rgba[covered, 0] - red).mean()) for raster in (plain, rounded)]
    shipped = int((shipped_channel(points, [255.0] * 3, size)[covered] != 255.0).sum())
    return MissingHalf(dimmed[0], dimmed[1], int(covered.sum()), errors[0], errors[1], shipped)


class Drift(NamedTuple):
    """What a row of additions makes of an edge value that is 0 at its end."""

    steps: int
    last: float  # 0 is right
    lost_samples: int  # of those that lie exactly on an edge, by the running sum
    lost_samples_evaluated: int  # the same, by evaluating the equation at the sample
    shipped_lost_samples: int


def demonstrate_drift(width: int = 1000) -> Drift:
    """Walk along rows towards an edge through samples, in steps that no binary number holds: some sums end below 0.

    The triangles are (0, 0), (width, 0), (0, h) / 10 each way; the sample at the end of row 0 lies on two edges.
    """
    lost = lost_evaluated = shipped = 0
    first = 0.0
    heights = range(11, 61, 7)
    for tenths in heights:
        points = [(0.0, 0.0), (float(width), 0.0), (0.0, tenths / 10)]
        raster = Raster(width + 2, 8)
        triangle = FlatTriangle(*vertices(points))
        triangle.draw(raster)
        edge = triangle.edge[1]
        lost += not raster.covered[0, width]
        lost_evaluated += edge.evaluate_at(width, 0) < 0
        shipped += not shipped_hits([points], (width + 2, 8), "inclusive")[0, width]
        first = first or float(accumulate(edge.evaluate_at(0, 0), edge.A, width + 1)[-1])
    return Drift(width, first, int(lost), int(lost_evaluated), int(shipped))


class StaleScale(NamedTuple):
    """The red of a triangle that was drawn, then moved to twice its size, and drawn again."""

    worst_error: float  # levels
    worst_error_if_made_anew: float


def demonstrate_stale_scale() -> StaleScale:
    """Move the corners of a smooth triangle after it was drawn: it goes on dividing by the area that it had."""
    small, large = [(0.0, 0.0), (16.0, 0.0), (0.0, 16.0)], [(0.0, 0.0), (32.0, 0.0), (0.0, 32.0)]
    colors: list[Color] = [(0, 0, 0, 255), (60, 0, 0, 255), (30, 0, 0, 255)]
    triangle, again, fresh = SmoothTriangle(*vertices(small, colors)), Raster(33, 33), Raster(33, 33)
    triangle.draw(Raster(33, 33))
    triangle.v = vertices(large, colors)
    triangle.draw(again, rounding=0.5)
    SmoothTriangle(*vertices(large, colors)).draw(fresh, rounding=0.5)
    red = shipped_channel(large, [0.0, 60.0, 30.0], (33, 33))
    errors = [float(np.abs(raster.rgba[..., 0] - red)[raster.covered].max()) for raster in (again, fresh)]
    return StaleScale(errors[0], errors[1])


class DroppedAlpha(NamedTuple):
    """The alpha of a flat triangle whose corners have 0, 0 and 30."""

    float_version: int  # S0
    fixed_version: int  # S4


def demonstrate_dropped_alpha() -> DroppedAlpha:
    """Average three colours that are nearly transparent: S0 makes them opaque."""
    corners = vertices([(0, 0), (4, 0), (0, 4)], [(9, 9, 9, 0), (9, 9, 9, 0), (9, 9, 9, 30)])
    return DroppedAlpha(FlatTriangle(*corners).color[3], FixedFlatTriangle(*corners).color >> 24 & 255)


class Box(NamedTuple):
    """The last column of the box of a triangle that lies left of the raster."""

    as_cast: int
    as_floor: int
    drawn: int


def demonstrate_box_cast(x_max: float = -1.5) -> Box:
    """Box a triangle with -2 < x < -1 at its right: the cast goes towards zero, and a column is searched in vain."""
    triangle, raster = FlatTriangle(*vertices([(-9.0, 1.0), (x_max, 4.0), (-6.0, 8.0)])), Raster(10, 10)
    triangle.draw(raster)
    return Box(to_int(x_max + 1), int(np.floor(x_max + 1)), int(raster.hits.sum()))


class SpeedHacks(NamedTuple):
    """Samples that were tested, and pixels that differ, with and without leaving rows early."""

    tested_early: int
    tested_all: int
    different_pixels: int


def demonstrate_early_out(points: Sequence[Sequence[float]] = ((0, 0), (200, 40), (10, 150))) -> SpeedHacks:
    """Draw a triangle with and without the early way out of rows: the pixels are the same, the work is not."""
    early, complete = Raster(201, 151), Raster(201, 151)
    FlatTriangle(*vertices(points)).draw(early)
    FlatTriangle(*vertices(points), early_out=False).draw(complete)
    return SpeedHacks(early.tested, complete.tested, int((early.hits != complete.hits).sum()))


class TwiceTheArea(NamedTuple):
    """What the variable `area` holds of a triangle."""

    variable: float
    exact: Fraction
    plane_exact: bool  # whether PlaneEqn, which divides by it, gives back the value of each corner


def demonstrate_area() -> TwiceTheArea:
    """Set up the triangle (0, 0), (4, 0), (0, 2), whose area is 4: `area` is 8, and the planes need just that."""
    triangle = SmoothTriangle(*vertices([(0, 0), (4, 0), (0, 2)], RED_GREEN_BLUE))
    triangle.triangle_setup(Raster(8, 8))
    slope_x, slope_y, start = triangle.plane_eqn(8, 16, 24)
    values = (start, start + 4 * slope_x, start + 2 * slope_y)
    return TwiceTheArea(triangle.area, Fraction(4), values == (8.0, 16.0, 24.0))


class AreaPrecision(NamedTuple):
    """The median relative error of an area in 32-bit floats."""

    sum_of_c: float
    cross_product: float  # of two sides
    wrong_signs: int
    triangles: int


def demonstrate_area_precision(size: float = 1.0, count: int = 3000) -> AreaPrecision:
    """Add up C, each the average of two, in 32-bit floats for random triangles in boxes of `size` pixels at 200 to 1000."""
    rng = np.random.default_rng(5)
    corners = (rng.uniform(200, 1000, (count, 1, 2)) + rng.uniform(0, size, (count, 3, 2))).astype(np.float32)
    after = np.roll(corners, -1, axis=1)
    A, B = corners[..., 1] - after[..., 1], after[..., 0] - corners[..., 0]
    both = corners + after
    C = np.float32(-0.5) * (A * both[..., 0] + B * both[..., 1])
    total = C[:, 0] + C[:, 1] + C[:, 2]
    sides = corners[:, 1:] - corners[:, :1]
    cross = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 1, 0] * sides[:, 0, 1]

    # In float64 the differences and products of these are exact, and one rounding remains.
    wide = corners.astype(np.float64)
    d = wide[:, 1:] - wide[:, :1]
    exact = d[:, 0, 0] * d[:, 1, 1] - d[:, 1, 0] * d[:, 0, 1]
    kept = exact != 0
    errors = [
        float(np.median(np.abs(found[kept] / exact[kept] - 1)))
        for found in (total.astype(np.float64), cross.astype(np.float64))
    ]
    return AreaPrecision(errors[0], errors[1], int((np.sign(total[kept]) != np.sign(exact[kept])).sum()), int(kept.sum()))


class InPlace(NamedTuple):
    """The box's first row as a triangle keeps it, before and after it was drawn on a raster of a width."""

    before: int
    after: int
    width: int


def demonstrate_in_place() -> InPlace:
    """Read yMin after drawing: the method has multiplied the triangle's own field by the width."""
    triangle, raster = FlatTriangle(Vertex(1, 3), Vertex(9, 3.5), Vertex(4, 9)), Raster(12, 12)
    triangle.triangle_setup(raster)
    before = triangle.y_min
    triangle.draw(raster)
    return InPlace(before, triangle.y_min, raster.width)


def vertex_points(places: Sequence[float]) -> list[int]:
    """Return the columns in which points at these x appear; S0, line 143.

    >>> vertex_points([0.5, 1.5, 2.5, 3.5])
    [0, 2, 2, 4]
    """
    columns = []
    for x in places:
        raster = Raster(16, 1)
        Vertex(x, 0.0).draw(raster)
        columns.append(int(raster.covered[0].argmax()))
    return columns


def positive_c(v0: Vertex, v1: Vertex) -> bool:
    """Say whether C is positive, which answers S0's aside in line 354: the origin then lies on the positive side of the edge.

    Put otherwise, the triangle from the origin to the two vertices has the area C / 2, and is counter-clockwise with y up.

    >>> positive_c(Vertex(2, 1), Vertex(1, 2)), positive_c(Vertex(1, 2), Vertex(2, 1))
    (True, False)
    """
    return EdgeEqn(v0, v1).C > 0
