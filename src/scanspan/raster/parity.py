"""Parity fill: the lectures' test at every sample of a polygon's box, whether a ray to the left meets an odd number of edges.

The plainest of all polygon fills: no table, no list, no order. An edge counts for the rows from its upper end, included, to its
lower end, excluded, so corners count once; and a sample on an edge lies right of it. That is the top-left rule, and so the
picture is the one that trapezoids give (polygon.py), bit for bit. Under another fill rule the signed count decides.

Price: O(box times edges of a row). To see how it is done, or to check what is faster.

Source: the lectures' parity test and its bounding box; Shimrat 1962, Algorithm 112.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.geometry.fill_rule import is_filled
from scanspan.geometry.fixed_point import product_halves
from scanspan.jit import helper_kernel, inline_kernel
from scanspan.raster.edge import edge_start
from scanspan.raster.setup import pixels_between
from scanspan.records import Array, Int32Array, Int64Array, Integer, Sampling


@helper_kernel
def cross_row(
    xy: Int64Array, ring_starts: Int32Array, x: Integer, y: Integer, s: int, f: Int64Array, a: Int64Array, turn: Int64Array
) -> int:
    """Take the edges that cross row y, each turned so that its value grows to the right; return how many.

    Shapes  f, a, turn: (V,), written: the value at x, what it grows by from pixel to pixel, and 1 for an edge that goes down,
            else -1. A sample is right of the edge, or on it, where its value is at least 0.
    """
    edges = 0
    for ring in range(ring_starts.shape[0] - 1):
        first, last = ring_starts[ring], ring_starts[ring + 1]
        for k in range(first, last):
            m = k + 1 if k + 1 < last else first
            q_x, q_y, r_x, r_y = xy[k, 0], xy[k, 1], xy[m, 0], xy[m, 1]
            if q_y <= y < r_y or r_y <= y < q_y:
                sign = np.int64(1 if q_y > r_y else -1)
                high, low = product_halves(sign * (q_y - r_y), sign * (r_x - q_x), x - q_x, y - q_y)
                f[edges], a[edges], turn[edges] = edge_start(high, low, np.int64(0), s), sign * (q_y - r_y), -sign
                edges += 1
    return edges


@inline_kernel
def parity_fill(
    write_sample: Callable[..., None], target: Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int, value: float,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Write every sample inside a polygon.

    Shapes  target: (H, W, ...), opened a row at a time; xy: (V, 2); ring_starts: (R + 1,).
    Units   sub-pixels; value is handed to the writer.
    Needs   coordinates within 2^24 px; the rectangle of sampling lies within the target.
    """
    s, count = sampling.subpixel_bits, xy.shape[0]
    if count == 0:
        return
    low_x = high_x = xy[0, 0]
    low_y = high_y = xy[0, 1]
    for k in range(1, count):
        low_x, high_x = min(low_x, xy[k, 0]), max(high_x, xy[k, 0])
        low_y, high_y = min(low_y, xy[k, 1]), max(high_y, xy[k, 1])
    x_start, x_end = pixels_between(low_x, high_x, sampling.sample_x, sampling, sampling.x_start, sampling.x_end)
    y_start, y_end = pixels_between(low_y, high_y, sampling.sample_y, sampling, sampling.y_start, sampling.y_end)
    if x_start >= x_end:
        return
    f, a, turn = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    for j in range(y_start, y_end):
        x, y = (x_start << s) + sampling.sample_x, (j << s) + sampling.sample_y
        edges = cross_row(xy, ring_starts, x, y, s, f, a, turn)

        # Count at each sample the edges that it is right of.
        row = target[j, x_start:x_end]
        for i in range(row.shape[0]):
            crossings = winding = np.int64(0)
            for k in range(edges):
                if f[k] + i * a[k] >= 0:
                    crossings += 1
                    winding += turn[k]
            write_sample(row, i, is_filled(fill_rule, crossings, winding), value, 0)
