"""Experiments on slivers: what becomes of a triangle thinner than a pixel, and which sampling keeps its light steady.

Source: S2, lines 371-373, whose picture is missing; S1, lines 119-122; S0, lines 16-25.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.canvas import Canvas
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    INK,
    WHITE,
    Axis,
    Panel,
    beside,
    chart,
    enlarged,
    gridded,
    painted,
    panel,
    shaded,
    stacked,
    with_dots,
    with_outlines,
)
from scanspan.masks import coverage
from scanspan.pipeline import count, count_each, rasterize
from scanspan.raster.area import spread_row
from scanspan.raster.half_space import scan_row
from scanspan.records import Array, Float64Array
from scanspan.samples import POSITIONS
from scanspan.target.cover import write_sum

SLIVER = np.array([(5.1, 3.4), (42.2, 10.8), (42.0, 11.3)])
SIZE = (52, 18)
STEPS = 16


def shares(points: Float64Array, size: tuple[int, int], samples: int) -> Float64Array:
    """Return the share of each pixel that a triangle covers: by 1, 4 or 16 samples, or for 0 exactly."""
    if samples == 0:
        exact: Float64Array = coverage(points, size, mode="area")
        return exact
    width, height = size
    clip = np.stack([2 * points[:, 0] / width - 1, 1 - 2 * points[:, 1] / height, np.zeros(3), np.ones(3)], axis=1)
    seen = rasterize(clip, [(0, 1, 2)], size, samples=samples, subpixel_bits=12).primitive >= 0
    return seen.astype(np.float64) if samples == 1 else seen.mean(axis=2)


def pieces_of(drawn: Array) -> int:
    """Return into how many pieces pixels fall that share a side or a corner, by filling them one after the other."""
    height, width = drawn.shape
    canvas, pieces = Canvas(width, height, "white"), 0
    canvas.pixels[drawn] = (0, 0, 0, 255)
    while (left := np.argwhere(canvas.pixels[..., 0] == 0)).size:
        canvas.flood_fill(int(left[0, 1]), int(left[0, 0]), "white", connectivity=8)
        pieces += 1
    return pieces


def longest_gap(drawn: Array) -> int:
    """Return the most columns without a pixel between columns that have some."""
    columns = np.flatnonzero(drawn.any(axis=0))
    return int(np.diff(columns).max(initial=1)) - 1


class Measures(NamedTuple):
    """What a sliver does while it moves by one pixel in sixteenths."""

    mean: float  # of the light, over the area
    spread: float  # standard deviation over mean
    gap: int
    pieces: int  # at the worst
    flicker: float  # light that changes from step to step, over the area


def measure(frames: Float64Array, area: float) -> Measures:
    """Measure frames (T, H, W) of a moving sliver."""
    light = frames.sum(axis=(1, 2))
    flicker = np.abs(np.diff(frames, axis=0)).sum(axis=(1, 2)).mean()
    drawn = frames > 0
    gap, pieces = max(map(longest_gap, drawn)), max(map(pieces_of, drawn))
    return Measures(light.mean() / area, light.std() / light.mean(), gap, pieces, flicker / area)


def moving_slivers() -> Result:
    """Move a sliver down by a pixel in sixteen steps, and draw each step four ways."""
    (ax, ay), (bx, by), (cx, cy) = SLIVER
    area = abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
    ways, rows, panels, lights = (
        {"1 sample": 1, "4 samples": 4, "16 samples": 16, "exact area": 0},
        list[Row](),
        list[Panel](),
        [],
    )
    for name, samples in ways.items():
        frames = np.stack([shares(SLIVER + np.array([0, k / STEPS]), SIZE, samples) for k in range(STEPS)])
        found = measure(frames, area)
        rows.append((name, *found))
        lights.append((name, np.arange(STEPS) / STEPS, frames.sum(axis=(1, 2)) / area))
        film = stacked(*[shaded(frames[k], 0, 1) for k in range(0, STEPS, 4)])
        panels.append(panel(f"{name}: four of sixteen steps", film, 4))
    panels.append(
        panel("Light of the sliver while it moves, over its area", chart(lights, Axis("moved by, in pixels"), Axis("light")))
    )
    headings = ("drawn with", "mean light / area", "std / mean", "longest gap", "most pieces", "flicker")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def parallelogram(triangle: Float64Array) -> Float64Array:
    """Return a triangle and its reflection in the middle of its first side, (2, 3, 2): together a parallelogram."""
    a, b, _ = triangle
    return np.stack([triangle, a + b - triangle])


def sliver_average(cases: int = 299) -> Result:
    """Add up the pixels of triangles over all offsets of a sixteenth of a pixel."""
    rng = np.random.default_rng(21)
    offsets = np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=2).reshape(-1, 1, 1, 2) / 16
    right = alone = tried = 0
    while tried < cases:
        triangle = rng.integers(16, 16 * 9, (3, 2)) / 16
        sides = triangle[1:] - triangle[0]
        twice_area = abs(sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0])
        if twice_area == 0:
            continue

        # Move both into view, and count the pixels of each at all 16 x 16 offsets.
        both = parallelogram(triangle)
        both = both - np.floor(both.min(axis=(0, 1)))
        width, height = (np.ceil(both.max(axis=(0, 1))) + 1).astype(int).tolist()
        hits = count_each((both + offsets).reshape(-1, 3, 2), (width, height), subpixel_bits=4)
        pixels = hits.sum(axis=(1, 2)).reshape(-1, 2).sum(axis=0)
        right += bool(pixels.sum() == 256 * twice_area)
        alone += bool(pixels[0] == 128 * twice_area)
        tried += 1
    numbers = (
        ("parallelograms", cases), ("whose mean number of pixels is their area, exactly", right),
        ("triangles alone for which that is so", alone),
    )  # fmt: skip
    half = np.array([(2.25, 1.5), (8.5, 3.0), (4.0, 7.75)])
    shape = parallelogram(half) + np.array([0.0, 3.5])
    hits = count(shape, (12, 12))
    shown = with_outlines(gridded(painted(hits, [WHITE, (150, 200, 235), INK]), 20), list(shape), 20)
    return Result(
        Table(("", ""), numbers), (panel("A triangle and its reflection: no sample of theirs is owned twice.", shown),)
    )


def sampling_criteria() -> Result:
    """Ask three things of one triangle: how close it is, how much of a pixel it covers, whether the sample is inside."""
    points, size, k = np.array([(2.25, 1.375), (13.625, 4.875), (5.25, 11.75)]), (16, 13), 16
    (ax, ay), (bx, by), (cx, cy) = points
    area = abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
    ways: dict[str, Float64Array] = {
        "sample inside": coverage(points, size).astype(np.float64),
        "any part touched": coverage(points, size, mode="touched").astype(np.float64),
        "share of the square": coverage(points, size, mode="area"),
        "share, tent aperture": coverage(points, size, mode="area", aperture="tent"),
        "share, gaussian aperture": coverage(points, size, mode="area", aperture="gaussian"),
    }  # fmt: skip
    rows = [(name, int((found > 0).sum()), float(found.sum()), float(found.sum()) - area) for name, found in ways.items()]
    thin = Canvas(*size, "white")
    thin.lines([points[[0, 1]], points[[1, 2]], points[[2, 0]]], "black")
    outline = (thin.pixels[..., 0] == 0).astype(np.float64)
    rows.append(
        ("closeness: within half a pixel of its sides", int(outline.sum()), float(outline.sum()), float(outline.sum()) - area)
    )
    ways["closeness: within half a pixel of its sides"] = outline
    panels = [
        panel(name, with_outlines(enlarged(shaded(found, 0, 1, [WHITE, BLUE]), k), [points], k, INK))
        for name, found in ways.items()
    ]
    headings = ("criterion", "pixels above 0", "sum", f"sum - area ({area:.4g})")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def aliasing() -> Result:
    """Draw one triangle with more and more samples a pixel, and compare with the exact shares."""
    points, size, k = np.array([(1.3, 1.2), (22.6, 7.9), (8.2, 20.4)]), (24, 22), 8
    exact = shares(points, size, 0)
    border = (exact > 0) & (exact < 1)
    rows, panels = list[Row](), list[Panel]()
    for samples in (*POSITIONS, 0):
        found = shares(points, size, samples)
        error = np.abs(found - exact)
        rows.append((samples or "exact", float(error.max()), float(error[border].mean()), float(found.sum() - exact.sum())))
        if samples in (1, 4, 16, 0):
            panels.append(panel(f"{samples} a pixel" if samples else "exact share", shaded(found, 0, 1, [WHITE, BLUE]), k))
    panels.append(panel("Where the 1, 4 and 16 samples of a pixel lie", sample_places()))
    headings = ("samples", "worst error of a pixel", "mean error at the border", "error of the area")
    return Result(Table(headings, tuple(rows)), tuple(panels))


def sample_places() -> Array:
    """Return pictures of pixels with their samples as dots."""
    blank = np.full((16, 16, 3), 255, np.uint8)
    grids = [gridded(blank, 8) for _ in range(3)]
    return beside(*[with_dots(g, np.array(POSITIONS[n]), 8, BLUE, 8) for g, n in zip(grids, (1, 4, 16), strict=True)], gap=8)


def display_coordinates() -> Result:
    """Draw one shape at several resolutions, and compare the share of pixels with its exact area."""
    shape = np.array([(0.1, 0.16), (0.93, 0.31), (0.57, 0.52), (0.71, 0.9), (0.22, 0.81), (0.36, 0.45)])
    x, y = shape.T
    area = abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))) / 2
    rows, panels = list[Row](), list[Panel]()
    for side in (8, 16, 32, 64, 128, 256, 512):
        drawn = coverage(shape * side, (side, side))
        moved = [float(coverage(shape * side + k / 16, (side + 1, side + 1)).sum()) / side**2 for k in range(16)]
        rows.append((f"{side} x {side}", int(drawn.sum()), float(drawn.mean()), float(np.abs(np.array(moved) - area).mean())))
        if side <= 128:
            panels.append(panel(f"{side} x {side}", painted(drawn, [(244, 246, 249), BLUE]), max(1, 160 // side)))
    rows.append(("exact", "", area, 0.0))
    return Result(Table(("display", "pixels", "share of the display", "mean error over 16 places"), tuple(rows)), tuple(panels))


def conflation() -> Result:
    """Lay two halves of a white square side by side over black, with a common edge inside of pixels."""
    left, right = [(2, 2), (8.5, 2), (8.5, 10), (2, 10)], [(8.5, 2), (15, 2), (15, 10), (8.5, 10)]
    rows, panels = list[Row](), list[Panel]()
    for name, wording in (("over", "each over what was there"), ("disjoint", "added up, laid over once")):
        for blend in ("srgb", "linear"):
            canvas = Canvas(17, 12, "black", blend=blend)
            canvas.polygons([left, right], "white", antialias=True, overlap=name)
            rows.append((f"{wording}, blended in {blend}", int(canvas.pixels[5, 8, 0]), 255 - int(canvas.pixels[5, 8, 0])))
            if blend == "srgb":
                panels.append(panel(wording, canvas.pixels, 12))
    mesh = Canvas(17, 12, "black")
    mesh.triangles(np.array([(left[0], left[1], left[2]), (left[0], left[2], left[3])]), "white")
    mesh.triangles(np.array([(right[0], right[1], right[2]), (right[0], right[2], right[3])]), "white")
    rows.append(("by samples, without shares", int(mesh.pixels[5, 8, 0]), 255 - int(mesh.pixels[5, 8, 0])))
    leak = max((c * (1 - c), c) for c in np.linspace(0, 1, 101).tolist())
    rows.append(("largest leak c (1 - c), at c = 0.5", 1 - leak[0], leak[0]))
    headings = ("two halves of a white square", "at the common edge", "black that shines through")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "sampling-criteria", "S0", "14-25", "Primitive Rasterization",
        "Three criteria for one triangle",
        "Is the sample inside, how much of the pixel's square or of a softer aperture is covered, how close is the "
        "primitive? Shares add up to the area, whatever the aperture; a count of samples does only on average.",
        sampling_criteria, (1, 2, 3, 4), coverage, "return block.count() if mode == \"area\"",
    ),
    Experiment(
        "display-coordinates", "S2", "93-97", "Scan Conversion",
        "The display gives the scale",
        "The same shape on displays of 8 to 512 pixels. Only in display coordinates are there pixels to fill; the finer "
        "they are, the nearer their number comes to the area.",
        display_coordinates, (5, 6), coverage, "return block.count() if mode == \"area\"",
    ),
    Experiment(
        "moving-slivers", "S2", "371-373", "Triangle Rasterization Issues",
        "Moving slivers",
        "A triangle thinner than half a pixel moves down by one pixel in sixteen steps. With one sample a pixel it breaks into "
        "pieces that crawl and twinkle; with more samples the pieces join and twinkle less, and with exact shares the light "
        "is the same in every step.",
        moving_slivers, (48, 96), spread_row, "cover += sums[x]",
    ),
    Experiment(
        "pixels-on-average", "S2", "376-384", "Triangle Rasterization Issues",
        "As many pixels as area, on average",
        "One triangle has not as many pixels as area, not even on average over all sub-pixel offsets. A triangle together"
        " with its reflection does, exactly: each sample of the parallelogram has one owner. This tests a rule without "
        "any oracle.",
        sliver_average, (47, 48), scan_row, "inside = ((f0",
    ),
    Experiment(
        "aliasing", "S1", "119-122", "These are ALIASING Problems",
        "A continuous shape at a finite resolution",
        "The share of a pixel, asked at 1, 2, 4, 8 and 16 points. The error falls with their number and is gone where the"
        " share is computed instead of sampled.",
        aliasing, (50,), spread_row, "cover += sums[x]",
    ),
    Experiment(
        "conflation", "S0", "24", "Percentage coverage of an aperture",
        "Coverage is not visibility",
        "Two halves of a white square meet in the middle of a pixel. Each covers half of it; laid over black one after "
        "the other they leave a quarter of it black. Where shapes are known not to overlap, their shares are added first.",
        conflation, (3, 96), write_sum, "lower = sums[y - first, x, k + 4]",
    ),
)  # fmt: skip
