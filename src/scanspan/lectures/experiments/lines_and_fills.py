"""Experiments on lines from pixel to pixel and on filling what they enclose: midpoints, ties, floods and parity.

Source: S2, lines 103-368.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from scanspan.canvas import Canvas
from scanspan.lectures import fills, lines
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    RED,
    SKY,
    WHITE,
    Panel,
    enlarged,
    gridded,
    painted,
    panel,
    with_dots,
    with_outlines,
)
from scanspan.masks import coverage
from scanspan.raster.flood import spread
from scanspan.raster.parity import cross_row
from scanspan.raster.segment import walk_pixels, write_steps
from scanspan.records import Array, Int32Array


def drawn(pixels: list[lines.Pixel], size: tuple[int, int]) -> Array:
    """Return pixels with y up as a picture: (H, W) 0 and 1."""
    found = np.zeros((size[1], size[0]), np.uint8)
    for x, y in pixels:
        found[size[1] - 1 - y, x] = 1
    return found


def line_picture(pixels: Array, ends: tuple[int, int, int, int], k: int, colors: list[tuple[int, int, int]]) -> Array:
    """Return pixels shown large, with the ideal line over them."""
    height = pixels.shape[0]
    x0, y0, x1, y1 = ends
    points = [(x0 + 0.5, height - 0.5 - y0), (x1 + 0.5, height - 0.5 - y1)]
    return with_outlines(gridded(painted(pixels, colors), k), [points], k, INK, 1.4, closed=False)


def midpoint_steps() -> Result:
    """Walk one line by the midpoint algorithm, and show what it knows at each step."""
    ends, size, k = (1, 1, 14, 6), (16, 8), 26
    x0, y0, x1, y1 = ends
    pixels, rows = lines.midpoint(*ends), list[Row]()
    doubled = lines.doubled_start(*ends)
    for (x, y), after in zip(pixels, [*pixels[1:], None], strict=True):
        d = lines.f(Fraction(x + 1), y + Fraction(1, 2), *ends)
        step = "" if after is None else "up" if after[1] > y else "along"
        rows.append((x, y, d, 2 * d, "below the line" if d < 0 else "on it" if d == 0 else "above the line", step))
    mids = np.array([(x + 1.5, size[1] - 1 - y) for x, y in pixels[:-1]])
    picture = with_dots(line_picture(drawn(pixels, size), ends, k, [WHITE, SKY]), mids, k, RED, 7)
    short = 2 * (y0 - y1) + (x1 - x0)
    rows.append(("start", "", "", doubled, f"2 (y0 - y1) + (x1 - x0) = {short}", ""))
    shipped = lines.shipped_pixels(*ends, "midpoint")
    rows.append(("pixels", len(pixels), "", "", f"other than the library's: {len(shipped ^ set(pixels))}", ""))
    headings = ("x", "y", "d = f(x + 1, y + 1/2)", "D = 2 d", "the midpoint is", "step")
    return Result(Table(headings, tuple(rows)), (panel("Red: the midpoints that were asked", picture),))


def line_algorithms() -> Result:
    """Draw all segments of an octant by DDA and midpoint, and some outside of it."""
    ties, drift, literal = lines.demonstrate_ties(), lines.demonstrate_dda_drift(), lines.demonstrate_literal_doubling()
    previous, long = lines.demonstrate_previous_step(), lines.demonstrate_long_form()
    rows: list[Row] = [
        ("segments with 0 <= dy <= dx <= 39", ties.segments), ("midpoint: other than halves rounded down", ties.from_half_down),
        ("midpoint: other than halves rounded up, as Round does", ties.from_half_up),
        ("midpoint: other when drawn from the other end", ties.from_other_end),
        ("midpoint: other than the library's", ties.shipped_midpoint),
        ("the library's symmetric lines: other from the other end", ties.shipped_symmetric_from_other_end),
        ("DDA in 32-bit floats: wrong", drift.wrong), ("DDA of the library: wrong", drift.shipped_wrong),
        ("'2d =' read literally: wrong", literal.wrong_as_printed), ("read as D: wrong", literal.wrong_as_meant),
        ("steps of a line", previous.steps), ("at which d was f(x - 1, y - .5) or f(x - 1, y + .05)", previous.at_printed),
        ("at which d was f(x, y - .5) or f(x, y + .5)", previous.at_mended),
        ("largest term of the long form at 40,000", long.largest_term), ("its sum, and the short form", long.start),
    ]  # fmt: skip
    rows += [(f"DDA, {name}: pixels of {one.needed}", one.drawn) for name, one in lines.demonstrate_other_octants().items()]
    panels, k = [], 22
    ends, size = (0, 0, 8, 4), (9, 5)
    both = drawn(lines.dda(*ends), size) + 2 * drawn(lines.midpoint(*ends), size)
    panels.append(
        panel("ties: only DDA orange, only midpoint blue, both grey", line_picture(both, ends, k, [WHITE, ORANGE, BLUE, GREY]))
    )
    there = drawn(lines.midpoint(*ends), size)
    back = drawn([(8 - x, 4 - y) for x, y in lines.midpoint(*ends)], size)
    panels.append(
        panel(
            "midpoint from either end: only one way coloured",
            line_picture(there + 2 * back, ends, k, [WHITE, BLUE, GREEN, GREY]),
        )
    )
    steep = (0, 0, 2, 6)
    right = np.zeros((7, 3), np.uint8)
    for x, y in lines.shipped_pixels(*steep, "midpoint"):
        right[6 - y, x] = 1
    gaps = drawn(lines.dda(*steep), (3, 7)) + right
    panels.append(
        panel(
            "a steep line by the slide's DDA: pale pixels are missing",
            line_picture(gaps, steep, k, [WHITE, (198, 219, 239), GREY]),
        )
    )
    return Result(Table(("", ""), tuple(rows)), tuple(panels))


def visits(boundary: Array, seed: tuple[int, int]) -> Int32Array:
    """Return how often the recursive fill looks at each pixel."""
    height, width = boundary.shape
    seen: Int32Array = np.zeros((height, width), np.int32)

    class Watched(fills.Flood):
        """A flood that keeps count of the looks."""

        def on_boundary(self, x: int, y: int) -> bool:
            """Count a look at a pixel of the picture."""
            if 0 <= x < width and 0 <= y < height:
                seen[y, x] += 1
            return super().on_boundary(x, y)

    fills.flood_fill_frames(Watched(boundary), *seed)
    return seen


def flood_drawbacks() -> Result:
    """Fill squares by the slide's recursion, count calls and depth, and compare with the library's spans."""
    rows: list[Row] = []
    for side in (10, 30, 100):
        found = fills.demonstrate_recursion(side)
        rows.append(
            (
                f"{side} x {side}",
                found.pixels,
                found.calls_needed,
                4 * found.pixels + 1,
                found.depth_needed,
                found.shipped_looked_at,
            )
        )
    shape, flags, leak = fills.demonstrate_outline(), fills.demonstrate_flags(), fills.demonstrate_leak()
    rows += [
        ("second square, flags not cleared: filled", flags.second_filled, "", "", "", ""),
        ("flags cleared: filled", flags.second_filled_if_cleared, "", "", "", ""),
        ("thin polygon: flooded, with its outline", shape.flooded, "", "", "", ""),
        ("thin polygon: samples inside", shape.sampled, "", "", "", ""),
        ("thin polygon: inside and never reached", shape.unreached, "", "", "", ""),
        ("rhombus over 4 neighbours", leak.over_four, "", "", "", ""), ("over 8: leaks", leak.over_eight, "", "", "", ""),
    ]  # fmt: skip

    # Looks at each pixel, and the thin polygon.
    diamond = fills.outline([(12, 1), (23, 12), (12, 23), (1, 12)], (25, 25))
    seen, k = visits(diamond, (12, 12)), 8
    looks = painted(seen, [WHITE, (222, 235, 247), (158, 202, 225), (66, 146, 198), (8, 48, 107)])
    panels = [panel("Looks at each pixel: white none, dark blue four", gridded(looks, k))]
    thin, size = [(2, 2), (60, 11), (2, 13), (20, 10)], (64, 16)
    edge = fills.outline(thin, size)
    inside = coverage([(x + 0.5, y + 0.5) for x, y in thin], size)
    y, x = (int(k) for k in np.argwhere(inside & ~edge)[0])
    flood = fills.Flood(edge)
    fills.flood_fill_frames(flood, x, y)
    state = np.where(edge, 1, np.where(flood.colored, 2, np.where(inside, 3, 0)))
    panels.append(panel("Outline grey, flooded blue, never reached red", gridded(painted(state, [WHITE, GREY, SKY, RED]), 8)))
    canvas = Canvas(25, 25, "white")
    canvas.pixels[diamond] = (0, 0, 0, 255)
    canvas.flood_fill(12, 12, (86, 180, 233))
    panels.append(panel("The library's fill, by spans", gridded(canvas.pixels, k)))
    headings = ("", "pixels", "calls", "4 N + 1", "depth", "looks of the library's fill")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def parity() -> Result:
    """Fill a star that crosses itself by the parity test, with three readings of 'crosses'."""
    found = fills.demonstrate_parity()
    rows = (
        ("an edge includes both its ends: wrong pixels", found.closed),
        ("half open, two edges between two pixels count once", found.once),
        ("half open, each edge counts", found.half_open),
        ("the library's parity, against its scan lines", found.shipped),
        ("pixels tested", found.tested),
        ("pixels tested in the box", found.tested_in_box),
    )
    points, size, k = [(30.5, 2.5), (42.5, 44.5), (5.5, 17.5), (55.5, 18.5), (17.5, 44.5)], (64, 48), 5
    right, panels = coverage(points, size), []
    for name, crossing, each in (
        ("both ends", "closed", True),
        ("two count once", "half-open", False),
        ("half open, each", "half-open", True),
    ):
        inside = fills.parity_fill(points, size, crossing=crossing, counts_each=each).inside
        shown = painted(inside + 2 * (inside != right), [WHITE, (158, 202, 225), (250, 180, 150), RED])
        panels.append(
            panel(f"{name}: too much in red, too little in pink", with_outlines(enlarged(shown, k), [points], k, GREY, 1))
        )
    return Result(Table(("", ""), rows), tuple(panels))


def four_paths() -> Result:
    """Fill one polygon by scan lines, by parity, as triangles and by flood."""
    points, size, k = [(3, 4), (25, 2), (37, 14), (30, 33), (18, 22), (6, 35)], (40, 38), 5
    exact = coverage(points, size)
    rows, panels = list[Row](), list[Panel]()
    for name in ("scanline", "parity", "triangles", "flood"):
        canvas = Canvas(*size, "white")
        canvas.polygon(points, "black", algorithm=name)
        found = canvas.pixels[..., 0] == 0
        rows.append((name, int(found.sum()), int((found & ~exact).sum()), int((exact & ~found).sum())))
        if name in ("scanline", "flood"):
            shown = painted(found + 2 * (found & ~exact), [WHITE, (158, 202, 225), WHITE, ORANGE])
            panels.append(
                panel(
                    f"{name}: orange has its centre outside",
                    with_outlines(enlarged(shown, k), [points], k, INK, 1.2),
                )
            )
    headings = ("way to fill", "pixels", "whose centres are outside", "inside and not filled")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "line-algorithms", "S2", "103-234", "Basic Line Drawing",
        "DDA and midpoint",
        "Both draw the thinnest line without gaps in one octant, and disagree where the line passes just between two "
        "pixels: Round goes up, d < 0 stays down. Those are also the lines that look different from the other end. "
        "Outside of the octant the slide's loop leaves gaps or draws nothing.",
        line_algorithms, (63, 65, 66, 67), walk_pixels, "tie, whole, twice =", slips=(14,),
    ),
    Experiment(
        "midpoint-steps", "S2", "135-197", "Midpoint Algorithm",
        "One line, midpoint by midpoint",
        "At every column one question: is the point between the two candidates below the line? Its f is known from the "
        "last step by one addition. Doubled, all numbers are whole, and the start is 2 (y0 - y1) + (x1 - x0).",
        midpoint_steps, (64, 65, 66), write_steps, "carries = rest >= whole",
    ),
    Experiment(
        "four-paths", "S2", "266-275", "Problem",
        "One polygon, filled four ways",
        "Scan lines, parity and triangles fill the pixels whose centres are inside. A flood fills the outline as well, so"
        " it can never be the same shape.",
        four_paths, (5, 68, 71), coverage, "return block.count()",
    ),
    Experiment(
        "flood-fill-drawbacks", "S2", "279-324", "Flood Fill Drawbacks",
        "Flood fill and its drawbacks",
        "Each pixel is looked at up to four times, 4 N + 1 calls for N pixels, nested as deep as there are pixels; flags "
        "have to be cleared for every polygon, and where outlines touch, what lies behind is never reached. By spans each"
        " pixel is looked at about twice, and nothing is nested.",
        flood_drawbacks, (69, 70), spread, "counts[LOOKS] += end - start + beside",
    ),
    Experiment(
        "parity-test", "S2", "335-368", "General Polygon Rasterization",
        "Inside or outside: parity",
        "Odd many edges crossed on the way means inside. A scan line through a corner crosses two edges or one, unless "
        "each edge leaves out one end; and two edges between two pixels have to count as two.",
        parity, (72, 73), cross_row, "if q_y <= y < r_y",
    ),
)  # fmt: skip
