"""Experiments with the programs of S0 and the formulas of S1: what they get right, what they forget, and what drifts.

Source: S0, lines 27-45, 119-170, 261-287 and 431-519; S1, lines 3-60.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from scanspan.errors import InputError
from scanspan.lectures import edge_equations, edge_faults, half_planes
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREEN,
    INK,
    RED,
    WHITE,
    Axis,
    Panel,
    chart,
    enlarged,
    gridded,
    painted,
    panel,
    with_dots,
    with_outlines,
)
from scanspan.lectures.raster import Raster, pack_argb, unpack_argb, vertices
from scanspan.raster.half_space import scan_row
from scanspan.records import Array
from scanspan.shade.interpolate import blend

RED_GREEN_BLUE = edge_faults.RED_GREEN_BLUE


def choose_c() -> Result:
    """Solve for A and B with several C, and find the corners of a triangle from its three lines again."""
    start, end = (Fraction(3), Fraction(1)), (Fraction(7), Fraction(9))
    chosen, rows = half_planes.coefficients(start, end), list[Row]()
    for c in (chosen[2], Fraction(1), Fraction(-10)):
        a, b, _ = half_planes.solved_coefficients(start, end, c)
        rows.append((f"C = {c}", a, b, c, a / chosen[0] == b / chosen[1] == c / chosen[2]))
    through = (Fraction(4), Fraction(6))
    try:
        half_planes.solved_coefficients((Fraction(2), Fraction(3)), through, Fraction(1))
        told = "solved"
    except InputError:
        told = "no inverse"
    rows.append(
        (
            f"edge through the origin, solved: {told}; by the choice",
            *half_planes.coefficients((Fraction(2), Fraction(3)), through),
            True,
        )
    )
    corners = [(Fraction(4), Fraction(5)), (Fraction(28), Fraction(9)), (Fraction(11), Fraction(22))]
    lines = [half_planes.coefficients(corners[k], corners[(k + 1) % 3]) for k in range(3)]
    scaled = [tuple(value * (k + 2) for value in line) for k, line in enumerate(lines)]
    found = [half_planes.vertex_of(scaled[k - 1], scaled[k]) for k in range(3)]  # type: ignore[arg-type]
    rows += [(f"corner {k} from two lines, each scaled", *found[k], "", found[k] == corners[k]) for k in range(3)]
    picture = np.full((26 * 8, 34 * 8, 3), 255, np.uint8)
    for k in range(3):
        (ax, ay), (bx, by) = (tuple(map(float, corners[m % 3])) for m in (k, k + 1))
        far = [(ax + t * (bx - ax), ay + t * (by - ay)) for t in (-3, 4)]
        picture = with_outlines(picture, [far], 8, (RED, BLUE, GREEN)[k], 1.6, closed=False)
    picture = with_dots(picture, [[float(v) for v in corner] for corner in corners], 8, INK, 9)
    headings = ("", "A, or x", "B, or y", "C", "the same line, or corner")
    return Result(Table(headings, tuple(rows)), (panel("Three lines make three corners.", picture),))


def points_jump() -> Result:
    """Draw points that move by half a pixel, rounded to even as in S0, and half up."""
    places = [k / 2 for k in range(12)]
    columns = edge_faults.vertex_points(places)
    rows = [(f"x = {x:g}", column, int(np.floor(x + 0.5))) for x, column in zip(places, columns, strict=True)]
    frames = []
    for found in (columns, [row[2] for row in rows]):
        picture = np.zeros((12, 8), np.int64)
        picture[np.arange(12), found] = 1
        frames.append(gridded(painted(picture, [WHITE, INK]), 14))
    packed = pack_argb((255, 128, 0, 255))
    before = edge_faults.demonstrate_in_place()
    rows.append(("0xffff8000 as a 32-bit number, and its alpha", packed, unpack_argb(packed)[3]))
    rows.append((f"yMin before and after drawing on {before.width} columns", before.before, before.after))
    panels = (panel("half to even: jumps of 0 and 2", frames[0]), panel("half up: steps of 1", frames[1]))
    return Result(Table(("a point at", "column in S0", "half up"), tuple(rows)), panels)


def sign_picture(form: object, start: tuple[float, float], end: tuple[float, float]) -> Array:
    """Return where a form of an edge is positive, blue, and negative, red, y up: (24, 32, 3)."""
    assert callable(form)
    values = np.array([[form(x, 23 - y, start, end) for x in np.arange(32) + 0.5] for y in np.arange(24) - 0.5])
    with np.errstate(invalid="ignore"):
        signs = np.where(np.isnan(values), 0, np.sign(values))
    return painted(signs + 1, [(248, 205, 188), WHITE, (190, 218, 240)])


def slope_forms() -> Result:
    """Ask the slope form and the multiplied form about both sides of edges, of their reverses, and of an upright one."""
    edges = {
        "to the right": ((4.0, 4.0), (28.0, 16.0)),
        "to the left": ((28.0, 16.0), (4.0, 4.0)),
        "upright": ((16.0, 2.0), (16.0, 22.0)),
    }
    rows, panels = list[Row](), list[Panel]()
    for name, (start, end) in edges.items():
        above = (10.0, 20.0)
        values = [
            float(form(*above, start, end))
            for form in (half_planes.slope_form, half_planes.multiplied_form, half_planes.flipped_form)
        ]
        rows.append((f"{name}, at (10, 20)", *values))
        for wording, form in (("slope form", half_planes.slope_form), ("multiplied", half_planes.multiplied_form)):
            picture = enlarged(sign_picture(form, start, end), 6)
            line = [(start[0], 24 - start[1]), (end[0], 24 - end[1])]
            shown = with_dots(with_outlines(picture, [line], 6, INK, 2, closed=False), line[1:], 6, INK, 9)
            panels.append(panel(f"{name}: {wording}; blue is positive, the dot is the end", shown))
    rows.append(
        (
            "upright, on its own line (16, 20)",
            *(
                float(form(16.0, 20.0, *edges["upright"]))
                for form in (half_planes.slope_form, half_planes.multiplied_form, half_planes.flipped_form)
            ),
        )
    )
    rows.append(
        (
            "edge (0, 0) to (1, 0), at (0.5, 0.5)",
            *(
                float(form(0.5, 0.5, (0.0, 0.0), (1.0, 0.0)))
                for form in (half_planes.slope_form, half_planes.multiplied_form, half_planes.flipped_form)
            ),
        )
    )
    turned = half_planes.demonstrate_sign_flip()
    for name, slope, multiplied in zip(("(0, 0) to (4, 2)", "(4, 2) to (0, 0)"), turned.slope, turned.multiplied, strict=True):
        rows.append((f"edge {name}, at (1, 3)", slope, multiplied, -multiplied))
    headings = ("edge and point", "slope form", "multiplied", "with the sign flipped")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def smooth_as_printed() -> Result:
    """Draw a smooth triangle by what S0 prints, by what it prepares, and with the half that S4 adds."""
    printed, half, scale = (
        edge_faults.demonstrate_smooth_as_printed(),
        edge_faults.demonstrate_missing_half(),
        edge_faults.demonstrate_stale_scale(),
    )
    area = edge_faults.demonstrate_area()
    alpha = edge_faults.demonstrate_dropped_alpha()
    rows = (
        ("colours in the triangle, as printed", printed.as_printed),
        ("as meant", printed.as_meant),
        ("as meant with the half: worst difference from the library, levels", printed.worst_against_shipped),
        ("alpha 255 at all corners: pixels below 255 without the half", half.dimmed),
        ("with it", half.dimmed_when_rounded),
        ("of", half.drawn),
        ("the library's", half.shipped_dimmed),
        ("mean error of a channel without the half, levels", half.mean_error),
        ("with it ", half.mean_error_when_rounded),
        ("drawn, moved and drawn again: worst error, levels", scale.worst_error),
        ("made anew", scale.worst_error_if_made_anew),
        ("alpha of the average of 0, 0 and 30, in S0", alpha.float_version),
        ("in S4", alpha.fixed_version),
        ("the variable area of a triangle whose area is 4", area.variable),
        ("planes divided by it are right at the corners", area.plane_exact),
    )
    points, panels = [(2.0, 1.0), (29.0, 5.0), (9.0, 30.0)], []
    for name, draw in (("as printed: the colour was never set", True), ("as meant", False)):
        raster = Raster(32, 32)
        triangle = edge_equations.SmoothTriangle(*vertices(points, RED_GREEN_BLUE))
        (triangle.draw_as_printed if draw else triangle.draw)(raster)
        panels.append(panel(name, np.where(raster.covered[..., None], raster.rgba[..., :3], 255), 6))
    stale, fresh = Raster(33, 33), Raster(33, 33)
    small, large = [(0.0, 0.0), (16.0, 0.0), (0.0, 16.0)], [(0.0, 0.0), (32.0, 0.0), (0.0, 32.0)]
    colors = [(0, 0, 0, 255), (60, 0, 0, 255), (30, 0, 0, 255)]
    moved = edge_equations.SmoothTriangle(*vertices(small, colors))
    moved.draw(Raster(33, 33))
    moved.v = vertices(large, colors)
    moved.draw(stale, rounding=0.5)
    edge_equations.SmoothTriangle(*vertices(large, colors)).draw(fresh, rounding=0.5)
    for name, raster in (("moved and drawn again: divided by the old area", stale), ("made anew", fresh)):
        panels.append(panel(name, np.where(raster.covered[..., None], raster.rgba[..., :3], 255), 6))
    return Result(Table(("", ""), rows), tuple(panels))


def running_sums() -> Result:
    """Walk along rows by additions, towards edges that run through the sample at the end."""
    found = edge_faults.demonstrate_drift()
    rows = (
        ("steps along the row", found.steps),
        ("value at its end, where 0 is right", found.last),
        ("samples lost by the running sum, of 8", found.lost_samples),
        ("by evaluating the equation", found.lost_samples_evaluated),
        ("by the library", found.shipped_lost_samples),
    )
    edge = edge_equations.EdgeEqn(*vertices([(1000.0, 0.0), (0.0, 1.1)]))
    sums = edge_equations.accumulate(edge.evaluate_at(0, 0), edge.A, 1001)
    exact = edge.A * np.arange(1001) + edge.evaluate_at(0, 0)
    places = np.arange(0, 1001, 25)
    shown = chart(
        [("running sum", places, (sums - exact)[places] * 1e13)],
        Axis("steps along the row"),
        Axis("running sum - product, in 1e-13"),
    )
    return Result(Table(("", ""), rows), (panel("Each addition rounds, and the errors add up.", shown),))


EXPERIMENTS = (
    Experiment(
        "three-lines", "S0", "27-45", "Why Triangles?",
        "Three points or three lines",
        "Three lines seem to take nine numbers where three points take six, but each line has a free factor: 9 - 3 = 6. "
        "The same freedom lets C be chosen: as the determinant it saves the division, keeps whole numbers whole, and "
        "works for edges through the origin.",
        choose_c, (7, 24), half_planes.coefficients, "return start[1] - end[1]",
    ),
    Experiment(
        "points-jump", "S0", "119-149", "Example Implementation",
        "Points, and the raster they are drawn on",
        "Math.Round goes to the even neighbour at halves, so a point that moves evenly jumps. And the raster's arrays "
        "have their traps: packed colours are negative numbers, and drawing multiplies the triangle's own yMin.",
        points_jump, (30, 123), unpack_argb, "return packed >> 16", slips=(22,),
    ),
    Experiment(
        "smooth-as-printed", "S0", "431-519", "A Smooth Triangle",
        "The smooth triangle as it is printed",
        "The method that S0 prints under 'Modified Draw' is the flat one again, in a colour that nobody set. With the "
        "planes that the slides before prepare it is smooth; without the half of S4 it is half a level too dark; and it "
        "remembers the area of the triangle that it was.",
        smooth_as_printed, (58, 60, 61), blend, "return u0 +", slips=(1, 4, 23, 24),
    ),
    Experiment(
        "running-sums", "S0", "261-287", "To Draw() method",
        "Sums that drift",
        "The inner loop adds A again and again. In floating point each addition rounds, and after a thousand of them a "
        "value that should be 0 is a little below it; samples on the edge are lost. In whole numbers there is nothing to "
        "drift.",
        running_sums, (36,), scan_row, "inside = ((f0",
    ),
    Experiment(
        "slope-forms", "S1", "3-60", "Computing Edge Equations",
        "Slope form and multiplied form",
        "The slope form divides by 0 on an upright edge, and its sign tells above from below whichever way the edge runs."
        " Multiplied by x_e - x_s it works for upright edges, but its sign turns with the edge, so one cannot take the "
        "other's place.",
        slope_forms, (21, 22, 23), half_planes.multiplied_form, "return (end[1] - start[1])", slips=(19,),
    ),
)  # fmt: skip
