"""Areas of polygons with very many edges in a row, a narrow window of columns at a time.

The sweep of area.py compares the pieces of a row with each other, which is dear where thousands stand side by side, as in the
stroke of a noisy curve. But what lies left of a window matters in it only by how often it winds, and that is the same sum of
edges going down and up at any place. Most of it cancels: what has gone by leaves nothing. What is left goes down the window's
side.

Price: a pass over the edges for each window. The width of windows comes from the whole polygon, so the bits are the same for
any bands of rows.
"""

from __future__ import annotations

import numpy as np

from scanspan.raster.area import AREA_BITS, DOWN, X0, X1, Y0, Y1, area_kernel
from scanspan.records import Float64Array, Int64Array

PIECES = 16  # in a row of a window, as a goal
NARROWEST = 4  # pixels


def window_width(edges: Int64Array, height: int, width: int) -> int:
    """Return how many columns a window should have, from the edges of a whole polygon: (N, EDGE_COLUMNS)."""
    top, bottom = np.maximum(edges[:, Y0], 0), np.minimum(edges[:, Y1], height << int(AREA_BITS))
    rows = (bottom - top) / float(1 << int(AREA_BITS))
    spread = max(float(bottom.max() - top.min()) / float(1 << int(AREA_BITS)), 1.0)
    return max(NARROWEST, min(width, int(width * PIECES * spread / max(float(rows.sum()), 1.0))))


def merge_left(edges: Int64Array, left: int) -> Int64Array:
    """Return edges that go down a place and wind as often as edges that lie left of it."""
    heights, where = np.unique(np.concatenate([edges[:, Y0], edges[:, Y1]]), return_inverse=True)
    turns = np.zeros(len(heights), np.int64)
    np.add.at(turns, where, np.concatenate([edges[:, DOWN], -edges[:, DOWN]]))
    bends = turns != 0
    winding = np.cumsum(turns[bends])[:-1]
    repeats = np.abs(winding)
    top, bottom = (np.repeat(y, repeats) for y in (heights[bends][:-1], heights[bends][1:]))
    side = np.full(len(top), left, np.int64)
    return np.stack([side, top, side, bottom, np.repeat(np.sign(winding), repeats)], axis=1)


def cover_by_windows(edges: Int64Array, fill_rule: int, window: int, cover: Float64Array) -> None:
    """Write how much of each pixel a polygon covers, as area_kernel does.

    Parameters
    ----------
    edges : (N, EDGE_COLUMNS), those that meet the rows of `cover`.
    window : columns.
    cover : (H, W).
    """
    width = cover.shape[1]
    if window >= width:
        area_kernel(edges, fill_rule, cover)
        return
    lowest, highest = np.minimum(edges[:, X0], edges[:, X1]), np.maximum(edges[:, X0], edges[:, X1])
    for first in range(0, width, window):
        last = min(first + window, width)
        left, right = first << int(AREA_BITS), last << int(AREA_BITS)
        gone = highest <= left
        met = np.concatenate([edges[~gone & (lowest < right)], merge_left(edges[gone], left)])
        met[:, [X0, X1]] -= left
        part = np.empty((cover.shape[0], last - first))
        area_kernel(np.ascontiguousarray(met[np.argsort(met[:, Y0], kind="stable")]), fill_rule, part)
        cover[:, first:last] = part
