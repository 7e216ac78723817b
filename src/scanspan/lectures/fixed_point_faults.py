"""What goes wrong in 12-bit fixed point, in numbers, beside the algorithm of this library that does not have the fault.

Each function draws the same shape twice, by the lecture's program (`fixed_point`) and by `scanspan.count` or
`scanspan.rasterize`, and returns what differs. Where a number comes from random shapes, the shapes are the same in every run.

Source: S4, lines 272-682; the limits follow from 2^31 = 4096 * 524,288.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.lectures.compare import shipped_channel, shipped_hits
from scanspan.lectures.fixed_point import FixedEdgeEqn, FixedFlatTriangle, FixedSmoothTriangle, java_int, wrap
from scanspan.lectures.raster import Color, Raster, Vertex, vertices
from scanspan.records import Float64Array

RED_GREEN_BLUE = [(255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255)]
MAX_PRODUCT = 524_288  # pixels squared: x0 y1 - x1 y0 must stay below it


class Overflow(NamedTuple):
    """A triangle over half of a raster, in fixed point and by this library."""

    wrong_pixels: int  # drawn and not covered, or covered and not drawn
    pixels: int
    largest: int  # of the three C, held at 2^31 - 1
    exact: int  # what it had to be
    shipped_wrong_pixels: int


def demonstrate_overflow(width: int = 1024, height: int = 768) -> Overflow:
    """Draw the triangle (0, 0), (width, 0), (0, height): its long edge has C = width height, times 4096.

    >>> demonstrate_overflow().wrong_pixels
    218964
    """
    points = [(0, 0), (width, 0), (0, height)]
    raster = Raster(width, height)
    triangle = FixedFlatTriangle(*vertices(points))
    triangle.draw(raster)

    # Decide by the definition: on this triangle a sample is inside where x / width + y / height <= 1.
    inside = np.add.outer(np.arange(height) * width, np.arange(width) * height) <= width * height
    shipped = shipped_hits([points], (width, height), "inclusive") > 0
    wrong = int((raster.covered != inside).sum())
    largest, exact = max(edge.C for edge in triangle.edge), width * height * 4096
    return Overflow(wrong, width * height, largest, exact, int((shipped != inside).sum()))


class AreaWrap(NamedTuple):
    """A triangle from corner to corner of the square from -n to n."""

    area: int  # the program's sum of C, before it is made positive
    exact: int
    wrong_pixels: int
    shipped_wrong_pixels: int


def fixed_area(points: ArrayLike) -> int:
    """Return the sum of the three C of a triangle, as S4 adds them in its line 424."""
    v = vertices(points)
    return wrap(sum(FixedEdgeEqn(a, b).C for a, b in pairwise([*v, v[0]])))


def demonstrate_area_wrap(n: int = 511) -> AreaWrap:
    """Draw (-n, -n), (n, -n), (n, n): no C is too large up to 511, but their sum is, beyond 362: the triangle turns over."""
    points = [(-n, -n), (n, -n), (n, n)]
    raster = Raster(n, n)
    FixedFlatTriangle(*vertices(points)).draw(raster)
    inside = np.greater_equal(*np.meshgrid(np.arange(n), np.arange(n)))
    shipped = shipped_hits([points], (n, n), "inclusive") > 0
    wrong, shipped_wrong = int((raster.covered != inside).sum()), int((shipped != inside).sum())
    return AreaWrap(fixed_area(points), 4 * n * n * 4096, wrong, shipped_wrong)


class MissedVertices(NamedTuple):
    """How far lines pass from the vertices that made them, in pixels."""

    median: float
    worst: float
    snapped_worst: float  # with the vertices on the grid of 1/4096 first, and C formed from them


def demonstrate_missed_vertices(length: float = 1.0, extent: float = 700.0, count: int = 4000) -> MissedVertices:
    """Measure random edges of one length anywhere up to `extent`: each coefficient is cut off without regard to the others."""
    rng = np.random.default_rng(1)
    starts, angles = rng.uniform(0, extent, (count, 2)), rng.uniform(0, 2 * np.pi, count)
    ends = starts + length * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ends_of = np.stack([starts, ends], axis=1).astype(np.float32).astype(np.float64)
    missed = [line_offset(*vertices(pair)) for pair in ends_of]

    # Snap first and derive after: then the line passes through its vertices, exactly.
    snapped = np.rint(ends_of * 4096).astype(np.int64)
    (x0, y0), (x1, y1) = snapped[:, 0].T, snapped[:, 1].T
    a, b, c = y0 - y1, x1 - x0, x0 * y1 - x1 * y0
    rest = np.maximum(np.abs(a * x0 + b * y0 + c), np.abs(a * x1 + b * y1 + c))
    return MissedVertices(float(np.median(missed)), max(missed), float(rest.max()))


def line_offset(v0: Vertex, v1: Vertex) -> float:
    """Return how far the line of a FixedEdgeEqn passes from the farther one of its own vertices, in pixels."""
    edge = FixedEdgeEqn(v0, v1)
    length = float(np.hypot(edge.A, edge.B))
    return max(abs(edge.A * v.x + edge.B * v.y + edge.C) / length for v in (v0, v1)) if length > 0 else float("inf")


class SmallTriangles(NamedTuple):
    """What becomes of small triangles."""

    turned: int  # the sign of the area is wrong
    dropped: int  # the area is 0
    triangles: int


def demonstrate_small_triangles(size: float = 0.02, extent: float = 700.0, count: int = 5000) -> SmallTriangles:
    """Find the sense of random triangles in boxes of `size` pixels: of 0.02 px, one in six is turned and half are lost."""
    rng = np.random.default_rng(2)
    corners = rng.uniform(0, extent, (count, 1, 2)) + rng.uniform(0, size, (count, 3, 2))
    corners = corners.astype(np.float32).astype(np.float64)
    sides = np.diff(corners, axis=1)  # exact in float64, and so are the products
    exact = np.sign(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    found = np.sign([fixed_area(points) for points in corners])
    return SmallTriangles(int((found * exact < 0).sum()), int(((found == 0) & (exact != 0)).sum()), count)


def ends_in_a_crash(points: ArrayLike, raster: Raster) -> bool:
    """Say whether the lecture's set-up of a triangle ends outside of its sort table."""
    try:
        FixedFlatTriangle(*vertices(points)).triangle_setup(raster)
    except IndexError:
        return True
    return False


class Crash(NamedTuple):
    """Triangles that look outside of the sort table."""

    crashes: int
    triangles: int
    message: str  # of the first, as a program would die with
    shipped_pixels: int  # what this library draws of them in all


VERTICAL = ((48.8, 77.4), (48.8, 74.9), (48.8, 24.1))  # the area is 0, and comes out as 1/4096


def demonstrate_index_crash(points: Sequence[Sequence[float]] = VERTICAL) -> Crash:
    """Set up a triangle of no width: rounding makes its area 1, all three B are 0 and count as positive; row 6 is asked for.

    >>> demonstrate_index_crash().message
    'sort[6] for x: the table has rows 0 to 5'
    """
    shipped = int(shipped_hits([points], (100, 100)).sum())
    try:
        FixedFlatTriangle(*vertices(points)).triangle_setup(Raster(100, 100))
    except IndexError as fault:
        return Crash(1, 1, str(fault), shipped)
    return Crash(0, 1, "", shipped)


def demonstrate_sliver_crash(count: int = 2000) -> Crash:
    """Set up upright slivers that do have a width, of up to 2/4096 of a pixel: most end in the same crash."""
    rng = np.random.default_rng(3)
    raster, slivers = Raster(100, 100), upright_slivers(rng, count)
    crashes = sum(ends_in_a_crash(points, raster) for points in slivers)
    return Crash(crashes, count, "sort[6] for x: the table has rows 0 to 5", int(shipped_hits(slivers, (100, 100)).sum()))


def upright_slivers(rng: np.random.Generator, count: int) -> Float64Array:
    """Return triangles (count, 3, 2) up to 100 pixels high and up to 2/4096 of a pixel wide, none without area."""
    width = rng.uniform(0, 2 / 4096, (count, 1))
    x = rng.uniform(0, 100, (count, 1)) + width * rng.uniform(0, 1, (count, 3))
    slivers: Float64Array = np.stack([x, rng.uniform(0, 100, (count, 3))], axis=2)
    return slivers


class ConstantChannel(NamedTuple):
    """A channel that is 255 at all three corners, over the pixels that are drawn."""

    worst_error: int  # levels
    drawn: int
    shipped_worst_error: float


THIN = ((830.0, 700.0), (837.82, 706.23), (834.14, 703.33))  # ten pixels long, 0.02 px thick


def demonstrate_constant_channel(
    points: Sequence[Sequence[float]] = THIN,
    size: tuple[int, int] = (1024, 768),
    colors: Sequence[Color] = tuple(RED_GREEN_BLUE),
) -> ConstantChannel:
    """Draw a thin triangle ten pixels long, in three colours and everywhere opaque, and look at its alpha.

    The cut-off A, B and C of the three edges do not add up to 0, 0 and the area, so the plane through three equal values is
    not level.
    """
    raster = Raster(*size)
    FixedSmoothTriangle(*vertices(points, colors)).draw(raster)
    alpha = raster.rgba[..., 3][raster.covered]
    shipped = shipped_channel(points, [255.0] * 3, size)
    level = shipped[shipped_channel(points, [1.0] * 3, size) > 0]
    off = 255 - alpha.astype(np.int64)
    return ConstantChannel(int(off.max(initial=0)), int(alpha.size), float(np.abs(level - 255.0).max(initial=0.0)))


class Gradient(NamedTuple):
    """The plane of a channel that runs from 0 to 255 across a sliver far from the origin."""

    coefficient: int  # Cp, in 1/4096
    exact: float  # what it had to be
    is_held: bool  # at the end of 32 bits


def demonstrate_gradient(distance: float = 600.0, thickness: float = 0.25) -> Gradient:
    """Run a channel across a level sliver: extrapolated to the origin it reaches 255 distance / thickness, and 524,288 is held.

    So a sliver must be thicker than distance / 2056.
    """
    y = distance
    points = [(0.0, y), (8.0, y), (0.0, y + thickness)]
    triangle = FixedSmoothTriangle(*vertices(points, [(0, 0, 0, 255), (0, 0, 0, 255), (255, 255, 255, 255)]))
    triangle.triangle_setup(Raster(16, 1024))
    triangle.x_min = triangle.y_min = 0
    found = triangle.plane_eqn(0, 0, 255).start - 2048
    exact = -255.0 * distance / thickness * 4096
    return Gradient(found, exact, found == java_int(-1e30))
