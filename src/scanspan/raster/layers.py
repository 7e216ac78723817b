"""Large triangles into keys, without what is hidden: a block of the picture remembers the least of its keys.

A block is 32 samples across and 8 down. Before a triangle is scanned there, the depth of its plane at the nearest corner of the
block, made a little nearer still for what rounding may do, is compared with the least key; where it is not larger, nothing of
the triangle can be seen in all of the block. Blocks that are left follow each other along a row, so rows stay long and are
scanned with vector instructions. What was drawn is read once more for the new least key, while it is in the cache.

Where a row enters and leaves the triangle is found by three divisions, rounded so that the samples between are a few too many
and never too few; the sign test decides about each.

Source: N. Greene, M. Kass and G. Miller, Hierarchical Z-Buffer Visibility, 1993.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.raster.write import pack_key, write_sample_key
from scanspan.records import Float64Array, Int64Array, Integer

COLUMN_BITS, ROW_BITS = np.int64(5), np.int64(3)
BLOCK_COLUMNS, BLOCK_ROWS = np.int64(32), np.int64(8)  # samples
MARGIN = 2.0**-40  # of the terms of a depth: far above what rounding makes of it, far below what float32 can tell apart
LARGEST_KEY = np.int64(0x7FFFFFFFFFFFFFFF)


@helper_kernel
def first_inside(f: float, a: float, i: float) -> float:
    """Return the first sample of a row, from i on, that an edge may include: at 0 it is f, and changes by a."""
    return max(i, np.floor(-f / (a if a > 0.0 else 1.0))) if a > 0.0 else i


@helper_kernel
def end_inside(f: float, a: float, i: float) -> float:
    """Return the sample of a row, at most i, before which all lie that an edge includes."""
    return min(i, np.floor(f / (-a if a < 0.0 else 1.0)) + 1.0) if a < 0.0 else i


@kernel
def draw_run(
    target: Int64Array, equation: Float64Array, x: Integer, y: Integer, n: Integer, row_start: Integer, row_end: Integer,
    start: Integer, end: Integer, spans: Int64Array,
) -> None:  # fmt: skip
    """Scan what the spans of some rows have between two columns.

    Shapes  equation: (EQUATIONS,) of blocks.py, at sample (x, y); spans: (BLOCK_ROWS, 2), the first and the end of each row.
    """
    a0, a1, a2 = equation[3], equation[4], equation[5]
    depth, slope1, slope2 = equation[9], equation[10], equation[11]
    for j in range(row_start, row_end):
        first, last = max(spans[j - row_start, 0], start), min(spans[j - row_start, 1], end)
        if first >= last:
            continue
        right, down = np.float64(first - x), np.float64(j - y)
        f0 = equation[0] + (down * equation[6] + right * a0)
        f1 = equation[1] + (down * equation[7] + right * a1)
        f2 = equation[2] + (down * equation[8] + right * a2)
        row = target[j, first:last]
        for i in range(row.shape[0]):
            right = np.float64(i)
            e0, e1, e2 = f0 + right * a0, f1 + right * a1, f2 + right * a2
            inside = (e0 >= 0.0) & (e1 >= 0.0) & (e2 >= 0.0)
            write_sample_key(row, i, inside, depth + (e1 * slope1 + e2 * slope2), n)


@kernel
def find_low(target: Int64Array, column: Integer, row_start: Integer, row_end: Integer) -> Integer:
    """Return the least key of some rows of the block that begins at a column."""
    low: Integer = LARGEST_KEY
    for j in range(row_start, row_end):
        row = target[j, column : min(column + BLOCK_COLUMNS, target.shape[1])]
        for i in range(row.shape[0]):
            low = min(low, row[i])
    return low


@kernel
def draw_layer(
    target: Int64Array, lows: Int64Array, equation: Float64Array, x: Integer, y: Integer, columns: Integer, rows: Integer,
    n: Integer, y_start: Integer, y_end: Integer,
) -> None:  # fmt: skip
    """Draw a triangle into keys, but for the blocks in which all of it is hidden.

    Shapes  target: (H, W) keys; lows: a key of each block, none above the least that it has in rows y_start to y_end;
            equation: (EQUATIONS,) of blocks.py, at sample (x, y), the first of a box of so many columns and rows.
    """
    spans = np.empty((BLOCK_ROWS, 2), np.int64)
    f0, f1, f2, a0, a1, a2 = equation[0], equation[1], equation[2], equation[3], equation[4], equation[5]
    b0, b1, b2, depth, slope1, slope2 = equation[6], equation[7], equation[8], equation[9], equation[10], equation[11]
    rises_right, rises_down = a1 * slope1 + a2 * slope2 > 0.0, b1 * slope1 + b2 * slope2 > 0.0
    row = y if f0 > -np.inf else y + rows
    while row < y + rows:
        block_row = row >> ROW_BITS
        row_end = min((block_row + 1) << ROW_BITS, y + rows)

        # Find the span of each of these rows, and how far they reach together.
        low, high = x + columns, x
        for j in range(row, row_end):
            down = np.float64(j - y)
            g0, g1, g2 = f0 + down * b0, f1 + down * b1, f2 + down * b2
            first = first_inside(g0, a0, first_inside(g1, a1, first_inside(g2, a2, 0.0)))
            last = end_inside(g0, a0, end_inside(g1, a1, end_inside(g2, a2, np.float64(columns))))
            spans[j - row, 0] = x + np.int64(min(first, np.float64(columns)))
            spans[j - row, 1] = x + np.int64(max(last, 0.0))
            if spans[j - row, 0] < spans[j - row, 1]:
                low, high = min(low, spans[j - row, 0]), max(high, spans[j - row, 1])

        # Go from block to block, and draw each run of those that are not hidden when it ends.
        corner = np.float64((row_end - 1 if rises_down else row) - y)
        g1, g2 = f1 + corner * b1, f2 + corner * b2
        block, end = low >> COLUMN_BITS, ((high - 1) >> COLUMN_BITS) + 1
        start = block
        while block <= end and low < high:
            is_hidden = block == end
            if not is_hidden:
                corner = np.float64((block << COLUMN_BITS) + (BLOCK_COLUMNS - 1 if rises_right else 0) - x)
                term1, term2 = (g1 + corner * a1) * slope1, (g2 + corner * a2) * slope2
                nearest = depth + (term1 + term2)
                nearest += MARGIN * (abs(depth) + (abs(term1) + abs(term2)))
                is_hidden = pack_key(nearest, np.int64(0)) <= lows[block_row, block]
            if is_hidden and start < block:
                draw_run(
                    target, equation, x, y, n, row, row_end, start << COLUMN_BITS, block << COLUMN_BITS, spans
                )  # fmt: skip
                kept_start, kept_end = max(block_row << ROW_BITS, y_start), min((block_row + 1) << ROW_BITS, y_end)
                for drawn in range(start, block):
                    lows[block_row, drawn] = find_low(target, drawn << COLUMN_BITS, kept_start, kept_end)
            block += 1
            if is_hidden:
                start = block
        row = row_end
