"""Experiments on ownership: which of two neighbours has the pixels between them, and what each rule makes of that.

Source: S1, lines 98-113; S2, lines 375-390; S3, lines 299-354; S4, lines 133-139.
"""

from __future__ import annotations

import numpy as np

from scanspan.canvas import Canvas
from scanspan.geometry.fill_rule import is_filled
from scanspan.lectures import edge_faults, ownership, walking
from scanspan.lectures.compare import shipped_hits, shuffled_mesh
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    GREY,
    INK,
    ORANGE,
    RED,
    WHITE,
    Panel,
    enlarged,
    gridded,
    painted,
    panel,
    with_outlines,
)
from scanspan.masks import coverage
from scanspan.pipeline import count
from scanspan.raster.edge import edge_bias
from scanspan.raster.setup import first_sample
from scanspan.records import Array, Float64Array

PAIR = np.array([[(8.5, 1.5), (8.5, 12.5), (1.5, 6.5)], [(8.5, 1.5), (15.5, 7.5), (8.5, 12.5)]])
HITS = [WHITE, (198, 219, 239), RED, (120, 20, 20)]  # none, once, twice, more
K = 14


def pair_picture(rule: str, order: int, color: tuple[str, str] = ("royalblue", "orange")) -> Array:
    """Draw two triangles that share an edge through samples, in an order, on a canvas."""
    canvas = Canvas(17, 14, "white")
    for number in (order, 1 - order):
        canvas.triangles(PAIR[number : number + 1], color[number], rule=rule)
    pixels: Array = canvas.pixels[..., :3]
    return pixels


def shared_edge_ordering() -> Result:
    """Draw two triangles in both orders, under three rules, opaque and half transparent."""
    rows, panels = list[Row](), list[Panel]()
    wordings = {"inclusive": "both draw it", "exclusive": "neither draws it", "top-left": "left or top"}
    for rule, wording in wordings.items():
        first, second = pair_picture(rule, 0), pair_picture(rule, 1)
        hits = count(PAIR, (17, 14), rule=rule)
        gaps = int((hits[2:12, 8] == 0).sum())
        rows.append((f"{wording} ({rule})", int((first != second).any(axis=2).sum()), int((hits > 1).sum()), gaps))
        for order, picture in ((1, first), (2, second)):
            if rule != "top-left" or order == 1:
                last = "in either order" if rule == "top-left" else "orange last" if order == 1 else "blue last"
                panels.append(panel(f"{wording}, {last}", with_outlines(gridded(picture, K), list(PAIR), K)))
    canvas = Canvas(17, 14, "white")
    canvas.triangles(PAIR, (65, 105, 225, 128), rule="inclusive")
    panels.append(panel("both draw it, half transparent: the edge is painted twice", gridded(canvas.pixels, K)))
    headings = ("rule", "pixels that depend on the order", "drawn twice", "gaps along the edge")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def which_pixels() -> Result:
    """Draw one mesh under every rule of the lectures and of the library."""
    found = ownership.demonstrate_rules()
    rows: list[Row] = [(name, one.samples, one.gaps, one.doubles) for name, one in found.items()]
    program = edge_faults.demonstrate_shared_edges()
    rows.append(("the program of S0, which draws where e >= 0", program.samples, "", program.drawn_twice))
    rows.append(("the same with its text, where e > 0", program.samples, program.gaps, ""))

    # Show a corner of a mesh, with samples at whole coordinates.
    mesh, size, k = shuffled_mesh(1, 5, 4, 6), (31, 25), 8
    panels = []
    for rule in ("draw", "do not draw", "no right or bottom"):
        hits = ownership.rule_hits(mesh, size, rule)
        colors = [ORANGE if rule == "do not draw" else WHITE, *HITS[1:]]
        panels.append(
            panel(
                f"{rule}: blue once, red twice, dark more often, orange never",
                with_outlines(gridded(painted(hits, colors), k), list(mesh + 0.5), k, GREY, 1),
            )
        )
    headings = ("rule", "samples", "gaps", "drawn more than once")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def golden_triangles() -> Result:
    """Draw the three shapes of Direct3D's documentation, whose samples lie at whole coordinates."""
    shapes = {
        "triangle (0, 0), (5, 0), (5, 5)": ([[(0, 0), (5, 0), (5, 5)]], 15),
        "triangle (0, 5), (0, 0), (5, 5)": ([[(0, 5), (0, 0), (5, 5)]], 10),
        "rectangle of both": ([[(0, 0), (5, 0), (5, 5)], [(0, 5), (0, 0), (5, 5)]], 25),
    }
    rows, panels = list[Row](), list[Panel]()
    for name, (triangles, expected) in shapes.items():
        hits = shipped_hits(triangles, (7, 7))
        rows.append((name, int(hits.sum()), expected))
        picture = with_outlines(gridded(painted(hits, HITS), 24), list(np.array(triangles) + 0.5), 24)
        panels.append(panel(name, picture))
    return Result(Table(("shape", "pixels", "in the documentation"), tuple(rows)), tuple(panels))


def ceil_and_floor() -> Result:
    """Walk two triangles that share an upright edge, with both readings of the far end, and with and without the offset."""
    ends, offsets = walking.demonstrate_both_ends(), walking.demonstrate_offsets()
    triangles, size = [[(8, 0), (8, 12), (1, 5)], [(8, 0), (8, 12), (15, 7)]], (17, 14)
    panels = []
    for name, wording in zip(walking.ENDS, ("ceiling to floor", "ceiling to ceiling less one"), strict=True):
        hits = walking.walked_hits(triangles, size, name)
        picture = with_outlines(gridded(painted(hits, HITS), K), [np.array(t) + 0.5 for t in triangles], K)
        panels.append(panel(f"{wording}: blue once, red twice", picture))
    rows = (
        ("pixels drawn twice, ceiling to floor", ends.drawn_twice), ("ceiling to ceiling less one", ends.drawn_twice_half_open),
        ("of these, other than the library's", ends.different_from_shipped),
        ("worst error of a value without the offset, in steps", offsets.without_offset), ("with it", offsets.with_offset),
        ("the library's", offsets.shipped),
    )  # fmt: skip
    return Result(Table(("", ""), rows), tuple(panels))


def shadow_rule() -> Result:
    """Compare the shadow rule of S3, y up, with the top-left rule, y down."""
    found = ownership.demonstrate_mirror()
    size, k = (9, 8), 20
    square = np.array([[(1, 1), (7, 1), (7, 6)], [(1, 1), (7, 6), (1, 6)]], np.float64)
    panels = [
        panel(
            f"{rule}: pixels of a rectangle",
            with_outlines(gridded(painted(shipped_hits(square, size, rule), HITS), k), list(square + 0.5), k),
        )
        for rule in ("top-left", "bottom-left")
    ]
    rows = (
        ("samples of a mesh with another owner under the other rule", found.different),
        ("after the mesh was mirrored in y", found.after_mirroring),
        ("pixels of a 6 x 5 rectangle, top-left", int(shipped_hits(square, size).sum())),
        ("bottom-left", int(shipped_hits(square, size, "bottom-left").sum())),
    )
    return Result(Table(("", ""), rows), tuple(panels))


def star(points: int, turns: int, radius: float, middle: float) -> Float64Array:
    """Return the corners of a star whose line goes `turns` times around."""
    angle = np.arange(points) * 2 * np.pi * turns / points - np.pi / 2
    return np.stack([middle - radius * np.cos(angle), middle + radius * np.sin(angle)], axis=1)


def fill_rules() -> Result:
    """Fill a pentagram, and a square with two squares in it, by the five fill rules."""
    rings = [star(5, 2, 18, 20.3)]
    boxes = [
        [(2, 2), (2, 38), (38, 38), (38, 2)],
        [(8, 8), (8, 32), (32, 32), (32, 8)],
        [(14, 14), (26, 14), (26, 26), (14, 26)],
    ]
    rows, panels = list[Row](), list[Panel]()
    for rule in ("even-odd", "non-zero", "positive", "negative", "abs-geq-two"):
        shown: list[Array] = []
        numbers = []
        for shape in (rings, boxes):
            canvas = Canvas(40, 40, "white")
            canvas.polygon(shape, "royalblue", fill_rule=rule)
            drawn = int((canvas.pixels[..., 0] < 255).sum())
            numbers += [drawn, float(coverage(shape, (40, 40), mode="area", fill_rule=rule).sum())]
            shown.append(with_outlines(enlarged(canvas.pixels[..., :3], 4), shape, 4, INK, 1.2))
        rows.append((rule, *numbers))
        panels += [Panel(rule, shown[0]), Panel(rule, shown[1])]
    headings = ("fill rule", "pentagram, pixels", "area", "three squares, pixels", "area ")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "which-pixels", "S1", "98-113", "Triangle Rasterization Issues",
        "Which pixels are lit, by every rule",
        "A mesh without gap or overlap whose edges run through samples. Drawing pixels on edges draws them twice, not "
        "drawing them leaves gaps. 'Left or top' works if a corner counts as on the right or bottom edge as well; the "
        "off-screen point works if it lies on no edge's line, and (-1, -1) often does.",
        which_pixels, (38, 43, 44, 45, 47), edge_bias, "owns = is_left |", slips=(6, 21),
    ),
    Experiment(
        "shared-edge-ordering", "S2", "375-389", "Triangle Rasterization Issues",
        "Shared edge ordering",
        "Two triangles with an upright edge in common that runs through the middles of pixels. If both draw it, the last "
        "one wins, so the picture depends on the order; if neither does, there is a gap. With a rule each pixel has one "
        "owner.",
        shared_edge_ordering, (44, 49), edge_bias, "return np.int64(0) if owns",
    ),
    Experiment(
        "golden-triangles", "S2", "385-389", "Triangle Rasterization Issues",
        "Left or top, checked against a known answer",
        "Direct3D 9 has the rule of the slide and samples at whole coordinates as the lectures do; its documentation "
        "counts 15, 10 and 25 pixels.",
        golden_triangles, (44,), edge_bias, "is_level & (b > 0)",
    ),
    Experiment(
        "ceil-and-floor", "S4", "133-139", "Fractional Offsets",
        "Ceiling and floor",
        "Ceiling for the leftmost pixel and floor for the rightmost includes both ends of a span, so an upright edge "
        "through samples is drawn by both neighbours. And a value taken from the edge, without the way from there to the "
        "pixel, is off by up to a step.",
        ceil_and_floor, (14, 16), first_sample, "return -((sample", slips=(8,),
    ),
    Experiment(
        "shadow-rule", "S3", "325-334", "Shadow Rule",
        "The shadow rule is top-left upside down",
        "S3 sweeps upwards and S1 and S2 downwards. Not to own edges that are on top or face right, with y up, is to own "
        "left and bottom edges: the other rule in a mirror.",
        shadow_rule, (46,), edge_bias, "owns = is_left | (is_level & (b < 0))", slips=(17,),
    ),
    Experiment(
        "fill-rules", "S3", "338-356", "Extensions",
        "Polygons that cross themselves",
        "In or out is a matter of counting, and of what the count means: odd, not zero, positive, negative, or two and "
        "more. For a pentagram the middle is inside or not, as the rule has it.",
        fill_rules, (97,), is_filled, "return bool(crossings & 1",
    ),
)  # fmt: skip
