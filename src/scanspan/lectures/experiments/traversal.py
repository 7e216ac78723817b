"""Experiments on the order in which pixels are visited, and on how much work each way to find them is.

Source: S1, lines 68-94; S0, lines 73-94 and 292-309; S4, lines 391-409.
"""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from scanspan.lectures import edge_equations, edge_faults
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREEN,
    GREY,
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
    shaded,
    with_outlines,
)
from scanspan.lectures.raster import Raster, vertices
from scanspan.pipeline import rasterize
from scanspan.raster.algorithms import ORDERS
from scanspan.raster.half_space import scan_row
from scanspan.raster.order import list_blocks, push_quarters
from scanspan.records import Array, Float64Array, Int64Array

SIDE = 64  # of the square that is visited
TEXTURE = 128
LINE, WAYS, CACHE = 64, 8, 4096  # bytes of a cache line, lines in a set, bytes in all
CLIP_CORNERS = ((-0.9, -0.7), (0.8, -0.9), (0.1, 0.9))


def path_of(order: str, side: int) -> Int64Array:
    """Return the pixels (x, y) of a square in the order in which they are visited, (side^2, 2)."""
    if order == "tiles":
        blocks, inner = list_blocks(0, side // 8, side // 8), list_blocks(0, 8, 8)
        return np.asarray((blocks[:, None] * 8 + inner[None]).reshape(-1, 2))
    return np.asarray(list_blocks(list(ORDERS).index(order), side, side))


def misses(addresses: Int64Array) -> int:
    """Return how many of some addresses in bytes are not in a cache of 4 KiB with 8 ways, where the oldest line goes first."""
    sets: list[OrderedDict[int, None]] = [OrderedDict() for _ in range(CACHE // LINE // WAYS)]
    missed = 0
    for line in (addresses // LINE).tolist():
        kept = sets[line % len(sets)]
        if line in kept:
            kept.move_to_end(line)
            continue
        missed += 1
        kept[line] = None
        if len(kept) > WAYS:
            kept.popitem(last=False)
    return missed


def texel_addresses(path: Int64Array, cosine: float, sine: float) -> Int64Array:
    """Return where in memory the texels lie that pixels show, for a texture of 4 bytes a texel that is turned."""
    x, y = path.T - SIDE / 2
    u = np.floor(cosine * x - sine * y).astype(np.int64) % TEXTURE
    v = np.floor(sine * x + cosine * y).astype(np.int64) % TEXTURE
    return np.asarray(4 * (v * TEXTURE + u))


def traversal_orders() -> Result:
    """Visit a square in five orders, and count what a small cache misses."""
    clip = [(x, y, 0, 1) for x, y in CLIP_CORNERS]
    first = rasterize(clip, [(0, 1, 2)], (96, 96))
    rows, panels = list[Row](), list[Panel]()
    for order in ORDERS:
        path = path_of(order, SIDE)
        steps = np.hypot(*np.diff(path, axis=0).T)
        frame = misses(4 * (path[:, 1] * 1024 + path[:, 0]))
        level, turned, upright = (misses(texel_addresses(path, *turn)) for turn in ((1, 0), (0.8, 0.6), (0, 1)))
        same = np.array_equal(rasterize(clip, [(0, 1, 2)], (96, 96), order=order).primitive, first.primitive)
        rows.append((order, float(steps.mean()), float(steps.max()), frame, level, turned, upright, same))
        picture = np.full((16 * 11, 16 * 11, 3), 255, np.uint8)
        panels.append(panel(order, with_outlines(picture, [path_of(order, 16) + 0.5], 11, BLUE, 1.6, closed=False)))
    headings = (
        "order", "mean step", "longest step", "misses: frame buffer", "texture level", "turned by 37 degrees", "turned by 90",
        "same picture",
    )  # fmt: skip
    return Result(Table(headings, tuple(rows)), tuple(panels))


def mesh_of(cells: int) -> tuple[Float64Array, Int64Array]:
    """Return a square of cells^2 quadrangles in clip coordinates as triangles."""
    line = np.linspace(-0.93, 0.95, cells + 1)
    x, y = np.meshgrid(line, line)
    clip = np.stack([x + 0.03 * y, y - 0.02 * x, np.zeros_like(x), np.ones_like(x)], axis=2).reshape(-1, 4)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1)
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    return clip, np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def walking_and_edges() -> Result:
    """Count the work of several algorithms on one square, cut into few large triangles or into many small ones."""
    names, rows = ("half-space", "edge-walk", "scanline-zrow"), []
    totals: dict[str, list[float]] = {name: [] for name in names}
    sizes = (1, 4, 16, 64)
    for cells in sizes:
        clip, triangles = mesh_of(cells)
        found = {name: rasterize(clip, triangles, (256, 256), algorithm=name) for name in names}
        covered = int((found["half-space"].primitive >= 0).sum())
        same = all(np.array_equal(one.primitive, found["half-space"].primitive) for one in found.values())
        counted = {name: one.counters for name, one in found.items()}
        work = [
            counted["half-space"]["edge_evaluations"], counted["edge-walk"]["spans"], counted["scanline-zrow"]["insertions"],
        ]  # fmt: skip
        rows.append((len(triangles), covered, *work, same))
        for name, value in zip(names, work, strict=True):
            totals[name].append(value)
    counts = [2 * n * n for n in sizes]
    wording = ("edge values evaluated", "spans walked", "edges inserted into the active list")
    shown = chart(
        [(text, counts, totals[name]) for text, name in zip(wording, names, strict=True)],
        Axis("triangles in the same square", is_log=True), Axis("work, each in its own unit", is_log=True),
    )  # fmt: skip
    headings = ("triangles", "pixels", *wording, "same picture")
    return Result(Table(headings, tuple(rows)), (panel("What each algorithm counts, for the same pixels", shown),))


def tested_samples(points: list[tuple[float, float]], size: tuple[int, int], *, early_out: bool) -> Array:
    """Return which samples of a triangle's box the slide's loop tests: 1, and 2 where they are inside."""
    raster = Raster(*size)
    triangle = edge_equations.FlatTriangle(*vertices(points), early_out=early_out)
    triangle.draw(raster)
    tested = np.zeros((size[1], size[0]), np.uint8)
    y_min, y_max = triangle.y_min // size[0], triangle.y_max // size[0]
    for y in range(y_min, y_max + 1):
        columns = np.flatnonzero(raster.covered[y])
        last = columns[-1] + 1 if early_out and len(columns) else triangle.x_max
        tested[y, triangle.x_min : min(last, triangle.x_max) + 1] = 1
    return np.asarray(tested + raster.covered)


def speed_hacks() -> Result:
    """Draw a triangle with and without leaving rows early."""
    found, points, size = edge_faults.demonstrate_early_out(), [(2.0, 2.0), (44.0, 10.0), (8.0, 34.0)], (48, 37)
    panels = [
        panel(wording, gridded(painted(tested_samples(points, size, early_out=early), [WHITE, (244, 214, 160), BLUE]), 7))
        for early, wording in ((False, "every sample of the box is tested"), (True, "each row is left behind its span"))
    ]
    rows = (
        ("samples tested in the whole box", found.tested_all), ("when rows are left early", found.tested_early),
        ("pixels that differ", found.different_pixels),
    )  # fmt: skip
    return Result(Table(("", ""), rows), tuple(panels))


def half_spaces() -> Result:
    """Show the three edge values of a triangle over the raster, and where all are positive."""
    points, size, k = [(6.0, 5.0), (40.0, 12.0), (16.0, 32.0)], (46, 37), 5
    triangle = edge_equations.FlatTriangle(*vertices(points))
    triangle.triangle_setup(Raster(*size))
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    values = np.stack([edge.A * x + edge.B * y + edge.C for edge in triangle.edge])
    outline = np.array(points) + 0.5
    panels: list[Panel] = []
    for number, value in enumerate(values):
        picture = shaded(value, -700, 700, [RED, (252, 232, 222), WHITE, (222, 238, 248), BLUE])
        picture[value == 0] = INK
        panels.append(panel(f"edge {number}: blue is positive", with_outlines(enlarged(picture, k), [outline], k, GREY)))
    inside = (values >= 0).all(axis=0)
    panels.append(panel("all three positive", with_outlines(enlarged(painted(inside, [WHITE, GREEN]), k), [outline], k)))
    seen = rasterize(
        [(2 * (px + 0.5) / size[0] - 1, 1 - 2 * (py + 0.5) / size[1], 0, 1) for px, py in points], [(0, 1, 2)], size,
        rule="inclusive", subpixel_bits=12,
    )  # fmt: skip
    middle = np.mean(points, axis=0)
    rows: list[Row] = [
        (
            f"edge {number}",
            edge.A,
            edge.B,
            edge.C,
            float(edge.evaluate_at(*middle)),
            int((value > 0).sum()),
            int((value == 0).sum()),
        )
        for number, (edge, value) in enumerate(zip(triangle.edge, values, strict=True))
    ]
    sums = np.sum([(edge.A, edge.B, edge.C) for edge in triangle.edge], axis=0).tolist()
    rows.append(
        (
            "all three",
            *sums,
            float(values.sum(axis=0)[0, 0]),
            int((values > 0).all(axis=0).sum()),
            int((inside & (values == 0).any(axis=0)).sum()),
        )
    )
    rows.append(
        (
            "the library's, edges included",
            "",
            "",
            "",
            "",
            int((seen.primitive >= 0).sum()),
            int((inside != (seen.primitive >= 0)).sum()),
        )
    )
    headings = ("", "A", "B", "C", "value in the middle", "samples on the positive side", "on it; the library's: other")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "half-spaces", "S0", "98-113", "Rasterizing Triangles with Edge Equations",
        "Three half-spaces",
        "An edge equation is positive on one side, negative on the other and 0 between them. Turned so that the inside is"
        " positive for all three edges, a pixel is drawn where no value is negative. A and B add up to 0 and C to twice "
        "the area.",
        half_spaces, (19, 20, 28, 36), scan_row, "inside = ((f0",
    ),
    Experiment(
        "speed-hacks", "S4", "391-409", "The Draw Method",
        "Two speed hacks",
        "One sign test does for three values, because the sign of e0 | e1 | e2 is negative where one of them is. And a "
        "triangle is convex, so a row can be left as soon as it was inside and then outside. Both change the work and no "
        "pixel.",
        speed_hacks, (8, 36, 37), scan_row, "inside = ((f0", slips=(5,),
    ),
    Experiment(
        "large-and-small-triangles", "S1", "68-94", "Discussion of Polygon Scan Conversion Algorithms",
        "Few large or many small triangles",
        "The same square in 2 to 8,192 triangles, by three algorithms that show the same picture. Walking edges costs a span "
        "a row and triangle, half-spaces cost edge values for every sample. For large triangles a few spans do; the smaller "
        "the triangles, the more spans there are and the less each of them saves.",
        walking_and_edges, (13, 15, 17, 18), scan_row, "inside = ((f0",
    ),
    Experiment(
        "traversal-orders", "S1", "90-94", "Discussion of Polygon Scan Conversion Algorithms",
        "Tiles and space-filling curves",
        "The same pixels in five orders, through a small cache. A frame buffer lies in rows, and rows miss least; a "
        "texture that is turned on the screen is read across its rows, and there tiles and curves miss a fraction. "
        "Hilbert's curve goes to a neighbour in every step.",
        traversal_orders, (18,), push_quarters, "quarters[way, 0, k]",
    ),
)  # fmt: skip
