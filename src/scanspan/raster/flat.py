"""Half-space for triangles that hide by order and not by depth: coverage alone, by the size of the triangle.

Where no depth is asked for, a sample is one sign test, and most of a triangle's time is what goes on around it. So corners are
snapped, and edges set up, in the loop that draws, from the coordinates as they were given: nothing is written down between.
After that there are two ways, and both look at the same exact edge values:

lanes  A box of up to 64 samples across is tested whole, each row rounded up to whole vectors, so that it is one to four vector
       instructions of 16 lanes and no rest. A lane outside of the box is outside of the triangle. The writer must leave such
       lanes alone: they may lie in the next row.
spans  In a wider one, and where the image cuts a box off on the right, the ends of all rows are worked out first, row by row
       in vectors too: a quotient in float64 is right to less than half a sample, and one exact edge value tells on which side
       of it the edge lies. Between its ends a row is filled without a test.

A class of its own for one or two samples gains nothing over lanes; docs/decisions/0014-small-triangles.md has the measurements.

Source: Pineda 1988; M. Abrash 2009, Rasterization on Larrabee, for a path of their own for small triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scanspan.geometry.fixed_point import to_grid
from scanspan.jit import bare_helper, inline_kernel
from scanspan.raster.setup import set_up_edges
from scanspan.records import Array, Int64Array, Integer, Sampling

WIDE = np.int64(64)  # samples across, beyond which spans are faster
ZERO = np.int64(0)


@bare_helper
def cut_rows(ends: Int64Array, rows: Integer, width: Integer, f: Integer, a: Integer, b: Integer) -> None:
    """Cut the spans of some rows to what lies on the inner side of an edge.

    Shapes  ends: (2, rows or more), the first sample of each row and the one after its last; f, a, b: as in TriangleSetup.
    Rule    f + a i + b j >= 0, exactly: within the width, at most 2^18, float64 rounds the quotient to a sample that is
            the wanted one or its neighbour, and the edge value there tells which.
    """
    inverse, limit = -1.0 / np.float64(a if a != 0 else np.int64(1)), np.float64(width)
    for j in range(rows):
        value = f + b * j
        i = np.int64(np.rint(min(max(np.float64(value) * inverse, -1.0), limit)))
        if a > 0:
            ends[0, j] = max(ends[0, j], i + np.int64(value + a * i < 0))
        elif a < 0:
            ends[1, j] = min(ends[1, j], i + np.int64(value + a * i >= 0))
        else:
            ends[1, j] = ends[1, j] if value >= 0 else ZERO


@inline_kernel
def scan_flat(
    start_value: Callable[..., Any], write_value: Callable[..., None], lanes: Integer, target: Array, vertices: Array,
    values: Array, ends: Int64Array, top: int, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Write the values of triangles first to last to all samples that they cover, in order.

    Shapes  target: (H, W), contiguous; vertices: (N, 3, 2); values: (N, ...), what start_value and write_value make of them;
            ends: (2, H), room to work in; top: the row of the image that is the first of target.
    Units   vertices in pixels, within 2^24 of 0; lanes: samples in a vector, a power of 2.
    Rule    sampling.rule, folded into the edge constants by the setup; samples decide.
    Needs   the rectangle of sampling lies within the target; write_value writes nothing where a sample is not inside.
    Cost    O(box) in whole vectors up to WIDE samples across; beyond it O(covered samples), and a few instructions a row.
    """
    scale, width = np.float64(np.int64(1) << sampling.subpixel_bits), np.int64(target.shape[1])
    flat = target.reshape(target.shape[0] * target.shape[1])
    above, below = np.float64(sampling.y_start - 1), np.float64(sampling.y_end + 1)
    for n in range(first, last):
        # Pass over what lies above or below the rows, before anything is snapped.
        p_v, q_v, r_v = vertices[n, 0, 1], vertices[n, 1, 1], vertices[n, 2, 1]
        if max(p_v, q_v, r_v) < above or min(p_v, q_v, r_v) > below:
            continue
        is_cut, x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2, e1, e2, area = set_up_edges(
            to_grid(vertices[n, 0, 0], scale), to_grid(p_v, scale), to_grid(vertices[n, 1, 0], scale), to_grid(q_v, scale),
            to_grid(vertices[n, 2, 0], scale), to_grid(r_v, scale), sampling,
        )  # fmt: skip
        if y_start >= y_end:
            continue
        across, rows, start = x_end - x_start, y_end - y_start, (y_start - top) * width + x_start
        value = start_value(values, n, e1, e2, a1, a2, b1, b2, area, sampling.subpixel_bits)

        # Test all samples of a narrow box, some beyond its right side included.
        if across <= WIDE and not is_cut:
            padded = (across + (lanes - 1)) & -lanes
            for j in range(rows):
                row = flat[start : start + padded]
                for i in range(padded):
                    write_value(row, i, ((f0 + i * a0) | (f1 + i * a1) | (f2 + i * a2)) >= 0, value, i, j)
                f0, f1, f2, start = f0 + b0, f1 + b1, f2 + b2, start + width
            continue

        # Work out where each row of a wide one begins and ends, and fill it.
        for j in range(rows):
            ends[0, j], ends[1, j] = ZERO, across
        cut_rows(ends, rows, across, f0, a0, b0)
        cut_rows(ends, rows, across, f1, a1, b1)
        cut_rows(ends, rows, across, f2, a2, b2)
        for j in range(rows):
            left, right = ends[0, j], ends[1, j]
            row = flat[start + left : start + max(left, right)]
            for i in range(right - left):
                write_value(row, i, True, value, left + i, j)
            start += width
