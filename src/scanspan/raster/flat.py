"""Half-space for triangles that hide by order and not by depth: coverage alone, by the size of the triangle.

Where no depth is asked for, a sample is one sign test, and most of a triangle's time is what goes on around it. So corners are
snapped, and edges set up, in the loop that draws, from the coordinates as they were given: nothing is written down between.
Where an image is cut into bands of rows, each band looks at all triangles. Those that reach into it are listed first, some
hundred at a time, without a branch that the processor would have to guess. After that there are two ways, and both look at the
same exact edge values:

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
LISTED = 512  # triangles that are looked at together; their corners are still in the cache when they are drawn
ZERO, ONE, TWO = np.int64(0), np.int64(1), np.int64(2)


@bare_helper
def cut_rows(starts: Int64Array, ends: Int64Array, rows: Integer, width: Integer, f: Integer, a: Integer, b: Integer) -> None:
    """Cut the spans of some rows to what lies on the inner side of an edge.

    Shapes  starts, ends: (rows or more,), the first sample of each row and the one after its last; f, a, b: see TriangleSetup.
    Rule    f + a i + b j >= 0, exactly: within the width, at most 2^18, float64 rounds the quotient to a sample that is
            the wanted one or its neighbour, and the edge value there tells which.
    """
    inverse, limit = -1.0 / np.float64(a if a != 0 else np.int64(1)), np.float64(width)
    for j in range(rows):
        value = f + b * j
        i = np.int64(np.rint(min(max(np.float64(value) * inverse, -1.0), limit)))
        if a > 0:
            starts[j] = max(starts[j], i + np.int64(value + a * i < 0))
        elif a < 0:
            ends[j] = min(ends[j], i + np.int64(value + a * i >= 0))
        else:
            ends[j] = ends[j] if value >= 0 else ZERO


@inline_kernel
def as_given(vertices: Array, n: Integer, scale: float) -> tuple[Integer, Integer, Integer]:
    """Return the numbers of a triangle's corners in the order in which they are given."""
    return ZERO, ONE, TWO


@inline_kernel
def topmost_first(vertices: Array, n: Integer, scale: float) -> tuple[Integer, Integer, Integer]:
    """Return the numbers of a triangle's corners, the one that comes first in (y, x) on the grid first, as depth wants it."""
    x0, y0 = to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale)
    x1, y1 = to_grid(vertices[n, 1, 0], scale), to_grid(vertices[n, 1, 1], scale)
    x2, y2 = to_grid(vertices[n, 2, 0], scale), to_grid(vertices[n, 2, 1], scale)
    is_second = ((y1 < y0) | ((y1 == y0) & (x1 < x0))) & ((y1 < y2) | ((y1 == y2) & (x1 <= x2)))
    is_third = ((y2 < y0) | ((y2 == y0) & (x2 < x0))) & ((y2 < y1) | ((y2 == y1) & (x2 < x1)))
    k = ONE if is_second else (TWO if is_third else ZERO)
    return k, ZERO if is_third else k + 1, ZERO if is_second else TWO - np.int64(is_third)


@inline_kernel
def one_row(flat: Array, start: Integer, end: Integer) -> Array:
    """Return some pixels of an image, (H W,)."""
    return flat[start:end]


@bare_helper
def list_near(vertices: Array, first: int, last: int, above: float, below: float, listed: Int64Array) -> Integer:
    """List the triangles among first to last that are not all above or below some rows, and return how many there are."""
    count = ZERO
    for n in range(first, last):
        p_y, q_y, r_y = vertices[n, 0, 1], vertices[n, 1, 1], vertices[n, 2, 1]
        listed[np.uint64(count)] = n
        count += np.int64((max(p_y, q_y, r_y) >= above) & (min(p_y, q_y, r_y) <= below))
    return count


@inline_kernel
def scan_flat(
    turn_corners: Callable[..., tuple[Integer, Integer, Integer]], start_value: Callable[..., Any],
    write_value: Callable[..., None], open_row: Callable[..., Any], lanes: Integer, target: Any, width: Integer,
    vertices: Array, values: Any, room: Int64Array, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Write the values of triangles first to last to all samples that they cover, in order.

    Shapes  target: (H width,), or two such arrays, as open_row takes it; vertices: (N, 3, 2); values: (N, ...), as start_value
            takes them; room: (3, n), n at least H and LISTED; top: the row of the image that is the first of target.
    Units   vertices in pixels, within 2^24 of 0; lanes: samples in a vector, a power of 2.
    Rule    sampling.rule, folded into the edge constants by the setup; samples decide.
    Needs   the rectangle of sampling lies within the target; write_value writes nothing where a sample is not inside.
    Cost    O(box) in whole vectors up to WIDE samples across; beyond it O(covered samples), and a few instructions a row.
    """
    scale = np.float64(np.int64(1) << sampling.subpixel_bits)
    above, below = np.float64(sampling.y_start - 1), np.float64(sampling.y_end + 1)
    starts, ends, listed = room[0], room[1], room[2]
    for block in range(first, last, LISTED):
        for m in range(list_near(vertices, block, min(block + LISTED, last), above, below, listed)):
            n = listed[m]
            p, q, r = turn_corners(vertices, n, scale)
            is_cut, x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2, e1, e2, area = set_up_edges(
                to_grid(vertices[n, p, 0], scale), to_grid(vertices[n, p, 1], scale), to_grid(vertices[n, q, 0], scale),
                to_grid(vertices[n, q, 1], scale), to_grid(vertices[n, r, 0], scale), to_grid(vertices[n, r, 1], scale),
                sampling,
            )  # fmt: skip
            if y_start >= y_end:
                continue
            across, rows, start = x_end - x_start, y_end - y_start, (y_start - top) * width + x_start
            value = start_value(values, n, p, q, r, e1, e2, f1, f2, a1, a2, b1, b2, area, sampling.subpixel_bits)

            # Test all samples of a narrow box, some beyond its right side included.
            if across <= WIDE and not is_cut:
                padded = (across + (lanes - 1)) & -lanes
                for j in range(rows):
                    row = open_row(target, start, start + padded)
                    for i in range(padded):
                        write_value(row, i, ((f0 + i * a0) | (f1 + i * a1) | (f2 + i * a2)) >= 0, value, i, j)
                    f0, f1, f2, start = f0 + b0, f1 + b1, f2 + b2, start + width
                continue

            # Work out where each row of a wide one begins and ends, and fill it.
            for j in range(rows):
                starts[j], ends[j] = ZERO, across
            cut_rows(starts, ends, rows, across, f0, a0, b0)
            cut_rows(starts, ends, rows, across, f1, a1, b1)
            cut_rows(starts, ends, rows, across, f2, a2, b2)
            for j in range(rows):
                left, right = starts[j], ends[j]
                row = open_row(target, start + left, start + max(left, right))
                for i in range(right - left):
                    write_value(row, i, True, value, left + i, j)
                start += width
