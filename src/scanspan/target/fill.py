"""Fills: the ways to paint a polygon, by name. All take rings on the sub-pixel grid, and none hits a pixel twice.

scanline   spans from an edge table and an active edge list
parity     the lectures' count of edges, at every sample of the box
triangles  the polygon cut into triangles on its own grid, which half-space draws
flood      the lectures' outline, and a flood fill of what it encloses

The first two are the same picture, bit for bit, and the third is wherever no edges cross. A crossing is not on the grid; there
the third bends the edges that cross to a point that is, and differs from the others only at samples within two sub-pixels of
these edges. The fourth owns more: the pixels of its outline, on the border and wherever else the rings go, belong to the shape.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event

import numpy as np

from scanspan.bands import run_bands
from scanspan.geometry.polygon_triangles import flat_triangles
from scanspan.raster.algorithms import SMALL, is_small, run_kernel
from scanspan.raster.seeds import OUTLINE, drawn_runs, fill_regions
from scanspan.raster.segment import DIAMOND_EXIT, RUN_LENGTH
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Sampling
from scanspan.target.paint import PAINTERS, PARITY, SCANLINE, SEGMENTS
from scanspan.target.triangles import paint_flat

Fill = Callable[[str, Array, Int64Array, Int32Array, int, float, Sampling, int], None]


def fill_scanline(
    kind: str, target: Array, xy: Int64Array, starts: Int32Array, rule: int, value: float, sampling: Sampling, threads: int
) -> None:
    """Paint a polygon by an edge table and an active edge list."""
    fill_polygons(
        kind, target, xy, starts, np.array([0, len(starts) - 1], np.int32), rule, np.array([value]), sampling, threads
    )


def fill_polygons(
    kind: str, target: Array, xy: Int64Array, starts: Int32Array, polygon_rings: Int32Array, rule: int, values: Float64Array,
    sampling: Sampling, threads: int,
) -> None:  # fmt: skip
    """Paint polygons in order; values are their packed colours, (P,). Each band of rows sweeps all of them."""
    colors = values.astype(np.int64)

    def fill_band(y_start: int, y_end: int, stop: Event) -> None:
        """Fill the rows of one band."""
        if not stop.is_set():
            rows = sampling._replace(y_start=y_start, y_end=y_end)
            SCANLINE[kind](target, xy, starts, polygon_rings, rule, colors, rows)

    size = target.shape[1], target.shape[0]
    is_little = threads > 1 and len(xy) < SMALL and is_small(xy, size, sampling.subpixel_bits)
    run_bands(fill_band, len(target), 1 if is_little else threads, each=1)


def fill_parity(
    kind: str, target: Array, xy: Int64Array, starts: Int32Array, rule: int, value: float, sampling: Sampling, threads: int
) -> None:
    """Paint a polygon by counting edges."""
    PARITY[kind](target, xy, starts, rule, value, sampling)


def fill_triangles(
    kind: str, target: Array, xy: Int64Array, starts: Int32Array, rule: int, value: float, sampling: Sampling, threads: int
) -> None:
    """Paint a polygon by triangles."""
    cut = flat_triangles(xy, starts, rule, value)
    if kind == "opaque":
        corners = cut.xy[cut.corners] / float(1 << sampling.subpixel_bits)
        word = np.array([int(value)], np.int64).astype(np.int32)
        paint_flat(target, corners, np.repeat(word, len(corners)), sampling, threads)
    else:
        run_kernel(PAINTERS["half-space"][kind], target, cut, sampling, threads)


def fill_flood(
    kind: str, target: Array, xy: Int64Array, starts: Int32Array, rule: int, value: float, sampling: Sampling, threads: int
) -> None:
    """Paint a polygon by its outline and a flood fill."""
    s = sampling.subpixel_bits
    if not len(xy):
        return

    # Take the box of pixels that it reaches, within the image, and count from its corner.
    low, high = xy.min(axis=0) >> s, (xy.max(axis=0) >> s) + 1
    x_start, y_start = max(int(low[0]), 0), max(int(low[1]), 0)
    width, height = min(int(high[0]), target.shape[1]) - x_start, min(int(high[1]), target.shape[0]) - y_start
    if width <= 0 or height <= 0:
        return
    points = xy - (np.array([x_start, y_start]) << s)

    # Draw the outline: each edge where it leaves diamonds, and the pixels of corners, so that nothing leaks there.
    drawn, following = np.zeros((height, width), np.int32), np.arange(1, len(points) + 1)
    following[starts[1:] - 1] = starts[:-1]
    segments = np.concatenate([points, points[following]], axis=1)
    SEGMENTS["opaque"](drawn, segments, np.full(len(segments), float(OUTLINE)), DIAMOND_EXIT, s)
    x, y = (points >> s).T
    is_near = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    drawn[y[is_near], x[is_near]] = OUTLINE

    # Fill what is inside, and paint both.
    fill_regions(drawn, points, starts, rule, sampling.sample_x, sampling.sample_y, s)
    paint_runs(kind, target, drawn_runs(drawn) + np.array([x_start, y_start] * 2), value)


def paint_runs(kind: str, target: Array, runs: Int64Array, value: float) -> None:
    """Paint runs of pixels, (N, 4) as segments x0, y, x1, y, in one colour."""
    SEGMENTS[kind](target, runs, np.full(len(runs), value), RUN_LENGTH, 8)


FILLS: dict[str, Fill] = {
    "scanline": fill_scanline,
    "parity": fill_parity,
    "triangles": fill_triangles,
    "flood": fill_flood,
}
