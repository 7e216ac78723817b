"""Experiments with the program of S4 in 12 fractional bits: where it overflows, crashes and turns triangles over.

Source: S4, lines 272-304, 415-451, 481-493 and 529-682.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np

from scanspan.lectures import edge_faults, exercise, fixed_point, fixed_point_faults
from scanspan.lectures.compare import shipped_hits
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    SKY,
    WHITE,
    Axis,
    chart,
    gridded,
    painted,
    panel,
    shaded,
    with_outlines,
)
from scanspan.lectures.fixed_point_faults import THIN, ends_in_a_crash
from scanspan.lectures.raster import Raster, vertices
from scanspan.raster.edge import edge_start
from scanspan.raster.setup import pixels_between, set_up_triangle
from scanspan.shade.interpolate import blend

RED_GREEN_BLUE = edge_faults.RED_GREEN_BLUE


def overflow() -> Result:
    """Draw triangles over half of larger and larger rasters in 12-bit fixed point, and in the library."""
    rows: list[Row] = []
    for width, height in ((640, 480), (800, 600), (724, 724), (725, 725), (1024, 512), (1024, 768)):
        found = fixed_point_faults.demonstrate_overflow(width, height)
        rows.append(
            (f"{width} x {height}", found.wrong_pixels, found.pixels, found.largest, found.exact, found.shipped_wrong_pixels)
        )
    for n in (362, 363, 511):
        square = fixed_point_faults.demonstrate_area_wrap(n)
        rows.append(
            (f"sum of C, -{n} to {n}", square.wrong_pixels, n * n, square.area, square.exact, square.shipped_wrong_pixels)
        )
    points = [(0, 0), (1024, 0), (0, 768)]
    raster = Raster(1024, 768)
    fixed_point.FixedFlatTriangle(*vertices(points)).draw(raster)
    shipped = shipped_hits([points], (1024, 768), "inclusive")
    panels = [
        panel(name, painted(hits[::4, ::4] > 0, [WHITE, color]))
        for name, hits, color in (
            ("1024 x 768 in 12 bits, every fourth pixel", raster.hits, ORANGE),
            ("this library", shipped, BLUE),
        )
    ]
    wrong = (raster.hits > 0) != (shipped > 0)
    panels.append(panel("wrong", painted(wrong[::4, ::4], [(244, 246, 249), RED])))
    headings = ("raster", "wrong pixels", "of", "largest C, or sum, as kept", "as it had to be", "the library's wrong pixels")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def index_six() -> Result:
    """Set up triangles without width, and upright slivers of more and more width."""
    upright, slivers, double = (
        fixed_point_faults.demonstrate_index_crash(),
        fixed_point_faults.demonstrate_sliver_crash(),
        edge_faults.demonstrate_index_crash(),
    )
    rows: list[Row] = [
        ("(48.8, 77.4), (48.8, 74.9), (48.8, 24.1) in 12 bits", upright.crashes, upright.triangles, upright.shipped_pixels),
        ("slivers up to 2/4096 px wide, in 12 bits", slivers.crashes, slivers.triangles, slivers.shipped_pixels),
        ("no width, one decimal, in double", double.crashes, double.triangles, double.shipped_pixels),
    ]
    rng, widths, shares, raster = np.random.default_rng(61), (0.5, 1, 1.5, 2, 3, 4, 6), [], Raster(100, 100)
    for width in widths:
        x = (
            rng.uniform(0, 100, (200, 1))
            + width / 4096 * np.array([0, 0.5, 1])[rng.permuted(np.tile(np.arange(3), (200, 1)), axis=1)]
        )
        triangles = np.stack([x, rng.uniform(0, 100, (200, 3))], axis=2)
        crashes = sum(ends_in_a_crash(points, raster) for points in triangles)
        shares.append(100 * crashes / 200)
        rows.append((f"exactly {width:g}/4096 px wide", crashes, 200, int(shipped_hits(triangles, (100, 100)).sum())))
    shown = chart(
        [("crashes", widths, shares)], Axis("width of upright slivers in 1/4096 pixel"), Axis("set-ups that crash, percent")
    )
    rows.append((upright.message, "", "", ""))
    headings = ("triangles", "crashes", "of", "pixels that the library draws")
    return Result(
        Table(headings, tuple(rows)), (panel("All three B are 0, count as positive, and row 6 is asked for.", shown),)
    )


def constant_channel() -> Result:
    """Draw thin opaque triangles in 12 bits, and look at their alpha."""
    cases = {
        "1 px long": ((828.0, 700.0), (828.91, 700.42), (828.57, 700.35)),
        "10 px long": THIN,
        "100 px long": ((478.0, 234.0), (558.39, 293.48), (499.47, 249.9)),
        "a thick one": ((10.0, 10.0), (50.0, 12.0), (20.0, 60.0)),
    }
    rows: list[Row] = []
    panels, size = [], (1024, 768)
    for name, points in cases.items():
        found = fixed_point_faults.demonstrate_constant_channel(points)
        rows.append((f"{name}: worst error of alpha, of {found.drawn} drawn", found.worst_error, found.shipped_worst_error))

        # Show alpha around the pixel that is worst.
        raster = Raster(*size)
        fixed_point.FixedSmoothTriangle(*vertices(points, RED_GREEN_BLUE)).draw(raster)
        off = np.where(raster.covered, 255 - raster.rgba[..., 3].astype(np.int64), -1)
        row, column = divmod(int(off.argmax()), size[0])
        y, x = max(row - 5, 0), max(column - 7, 0)
        near = off[y : y + 12, x : x + 15]
        shown = np.where(near[..., None] < 0, 255, shaded(np.maximum(near, 0), 0, 210, [(198, 219, 239), RED])).astype(np.uint8)
        outline = np.array(points) + 0.5 - (x, y)
        caption = f"{name}: alpha {255 - found.worst_error} where 255 is right"
        panels.append(panel(caption, with_outlines(gridded(shown, 14), [outline], 14, GREY, 1.2)))
    held, thick = fixed_point_faults.demonstrate_gradient(), fixed_point_faults.demonstrate_gradient(600.0, 0.3)
    rows.append(
        ("0 to 255 across 0.25 px at a distance of 600: C of the plane, times 4096", held.coefficient, round(held.exact))
    )
    rows.append(("across 0.3 px", thick.coefficient, round(thick.exact)))
    return Result(
        Table(("triangle, alpha 255 at all corners", "in 12 bits", "right, or this library's"), tuple(rows)), tuple(panels)
    )


def small_triangles() -> Result:
    """Find the sense of small triangles in 12 bits."""
    rows, sizes, lost, turned = list[Row](), (0.01, 0.02, 0.05, 0.1, 0.3, 1.0), [], []
    for size in sizes:
        found = fixed_point_faults.demonstrate_small_triangles(size, count=2000)
        rows.append((f"{size:g} px", found.turned, found.dropped, found.triangles))
        turned.append(100 * found.turned / found.triangles)
        lost.append(100 * found.dropped / found.triangles)
    shown = chart(
        [("taken for having no area", sizes, lost), ("turned over", sizes, turned)],
        Axis("size of the triangle in pixels", is_log=True),
        Axis("percent"),
    )
    headings = ("triangles of", "turned over", "taken for having no area", "of")
    return Result(Table(headings, tuple(rows)), (panel("Small triangles far from the origin, in 12 fractional bits", shown),))


def bounding_box() -> Result:
    """Look up the corners of bounding boxes by the signs of A and B, for all orders of three, and compare."""
    rows: list[Row] = []
    for order in permutations((0, 1, 2)):
        points = [(float(2 + 9 * order[k]), float(3 + 8 * order[2 - k])) for k in range(3)]
        steps = exercise.box_steps(points)
        rows.append(
            (
                "x: " + " ".join(f"{x:g}" for x, _ in points), f"{steps.x_code:03b}", steps.x_corners[0], steps.x_corners[1],
                steps.box == exercise.plain_box(points),
            )
        )  # fmt: skip
    cast = edge_faults.demonstrate_box_cast()
    rows.append(
        ("triangle left of the raster: last column as cast, as floor", "", cast.as_cast, cast.as_floor, cast.drawn == 0)
    )
    points, k = [(6.0, 5.0), (32.5, 10.25), (13.75, 26.5)], 9
    inside = shipped_hits([points], (38, 30), "inclusive")
    box = exercise.box_steps(points).box
    state = np.zeros((30, 38), np.int64)
    state[int(box[2]) : int(box[3] + 1) + 1, int(box[0]) : int(box[1] + 1) + 1] = 1
    shown = gridded(painted(state + (inside > 0), [WHITE, (253, 224, 180), SKY]), k)
    shown = with_outlines(shown, [np.array(points) + 0.5], k)
    headings = (
        "corners",
        "code: B >= 0 of the edges 2, 1, 0",
        "corner with the least",
        "with the greatest",
        "box as by comparing",
    )
    return Result(Table(headings, tuple(rows)), (panel("The box that is searched, and what is drawn", shown),))


EXPERIMENTS = (
    Experiment(
        "overflow", "S4", "272-304", "EdgeEquation Object",
        "Twelve bits on a larger screen",
        "C is a product of two coordinates times 4096, and Java's cast holds it at 2^31 - 1. Up to 724 x 724 nothing "
        "happens; at 1024 x 768 more than a quarter of the pixels are wrong. The sum of three C wraps around already at "
        "363.",
        overflow, (29, 34), edge_start, "limit = np.int64(1)", slips=(11,),
    ),
    Experiment(
        "small-triangles", "S4", "415-433", "Triangle Set-up",
        "Small triangles in twelve bits",
        "The area is a sum of numbers that were cut off one by one. A triangle of a fiftieth of a pixel is turned over in"
        " one case of six and lost in half of them, though it may well cover a sample.",
        small_triangles, (34,), set_up_triangle, "sign = halves_sign",
    ),
    Experiment(
        "index-six", "S4", "436-443", "Triangle Set-up",
        "The crash: sort[6]",
        "A triangle without width has B = 0 for all its edges; where rounding leaves it an area, all three count as "
        "positive and row 6 of a table of six is asked for. Slivers that do have a width end there as well, where cutting"
        " off leaves none.",
        index_six, (35,), set_up_triangle, "if sign == 0 or sign", slips=(9,),
    ),
    Experiment(
        "bounding-box", "S4", "481-493", "Exercise 2",
        "The bounding box by signs",
        "The exercise answered: B >= 0 says that x rises along an edge, three such bits say in which order the corners "
        "lie, and a table holds the least and the greatest for each of the six orders. For A it is the same with the "
        "columns changed.",
        bounding_box, (32, 33, 41), pixels_between, "max(first_sample(low", slips=(25,),
    ),
    Experiment(
        "constant-channel", "S4", "573-588", "Computing Plane Equations",
        "A constant that is not constant",
        "Alpha is 255 at all three corners. The cut-off A, B and C of three edges do not add up to 0, 0 and the area, so "
        "the plane through three equal values is not level. The library adds differences from one corner, and a constant "
        "has none.",
        constant_channel, (59,), blend, "return u0 +", slips=(10,),
    ),
)  # fmt: skip
