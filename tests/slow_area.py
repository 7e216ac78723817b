"""Exact areas the slow way: every piece of a row compared with every other, every length divided anew. The oracle of the sweep.

It leaves what the sweep of raster/area.py leaves, wherever no edges cross, to the bit.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import HALF_BITS, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.polygon import is_filled
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer

AREA_BITS = np.int64(16)  # sub-pixel bits of corners
LENGTH_BITS = np.int64(44)
DIGIT_BITS = np.int64(14)  # half of what lengths have more than corners
ONE = np.int64(1 << 44)
UNIT = 2.0**52  # areas in a pixel
FARTHEST = np.int64(1 << 62)  # 2^18 px

# Columns of the lists of edges and of the pieces of a row. An edge goes down from X0, Y0; a piece is what is left of it in a
# row between the image's sides, from TOP to BOTTOM below the row's upper border. SIDE is 1 for a left border, -1 for a right.
X0, Y0, X1, Y1, DOWN = range(5)
TOP, BOTTOM, X_TOP, X_BOTTOM, EDGE, SIDE, SINCE = range(7)
EDGE_COLUMNS, PIECE_COLUMNS = 5, 7


@helper_kernel
def length_of(high: Integer, low: Integer, divisor: Integer) -> Integer:
    """Return a product in halves, divided, as a length: rounded down, and held at 2^18 px on either side.

    Needs   0 < divisor < 2^42; the product is in squares of corners' units.
    """
    upper = high // divisor
    if upper >= (np.int64(1) << 14) or upper < -(np.int64(1) << 14):
        return FARTHEST if upper > 0 else -FARTHEST
    lower = ((high - upper * divisor) << HALF_BITS) + low
    part = lower // divisor
    rest, length = lower - part * divisor, (upper << HALF_BITS) + part
    for _ in range(2):
        rest = rest << DIGIT_BITS
        digit = rest // divisor
        rest, length = rest - digit * divisor, (length << DIGIT_BITS) + digit
    return length


@helper_kernel
def x_at(edges: Int64Array, e: Integer, y: Integer) -> Integer:
    """Return where an edge crosses a height, as a length; y as corners are."""
    across, down = edges[e, X1] - edges[e, X0], edges[e, Y1] - edges[e, Y0]
    high, low = product_halves(edges[e, X0], across, down, y - edges[e, Y0])
    return length_of(high, low, down)


@helper_kernel
def y_at(edges: Int64Array, e: Integer, column: Integer, row: Integer) -> Integer:
    """Return how far below the upper border of a row an edge crosses the left border of a column, as a length."""
    across, down = edges[e, X1] - edges[e, X0], edges[e, Y1] - edges[e, Y0]
    sign, size = (np.int64(1), across) if across > 0 else (np.int64(-1), -across)
    high, low = product_halves(edges[e, Y0] - (row << AREA_BITS), sign * down, size, (column << AREA_BITS) - edges[e, X0])
    return length_of(high, low, size)


@helper_kernel
def push_piece(
    pieces: Int64Array, count: int, e: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer
) -> int:
    """Push a piece, unless it has no height, and return the new count."""
    if bottom <= top:
        return count
    pieces[count, TOP], pieces[count, BOTTOM], pieces[count, X_TOP], pieces[count, X_BOTTOM] = top, bottom, x_top, x_bottom
    pieces[count, EDGE], pieces[count, SIDE], pieces[count, SINCE] = e, 0, top
    return count + 1


@helper_kernel
def cut_row(edges: Int64Array, e: Integer, row: Integer, width: Integer, pieces: Int64Array, count: int) -> int:
    """Push what an edge has in a row: left of the image it goes down that side, right of it, it is left out."""
    upper = row << AREA_BITS
    y0, y1 = max(edges[e, Y0], upper), min(edges[e, Y1], upper + (np.int64(1) << AREA_BITS))
    shift = LENGTH_BITS - AREA_BITS
    top, bottom = (y0 - upper) << shift, (y1 - upper) << shift
    x_top, x_bottom, side = x_at(edges, e, y0), x_at(edges, e, y1), width << LENGTH_BITS
    zero = np.int64(0)
    if max(x_top, x_bottom) <= 0:
        return push_piece(pieces, count, e, top, bottom, zero, zero)
    if min(x_top, x_bottom) >= side:
        return count

    # Cut where it crosses a side of the image.
    if x_top < 0 or x_bottom < 0:
        y = min(max(y_at(edges, e, zero, row), top), bottom)
        if x_top < 0:
            count = push_piece(pieces, count, e, top, y, zero, zero)
            top, x_top = y, zero
        else:
            count = push_piece(pieces, count, e, y, bottom, zero, zero)
            bottom, x_bottom = y, zero
    if x_top > side or x_bottom > side:
        y = min(max(y_at(edges, e, width, row), top), bottom)
        if x_top > side:
            top, x_top = y, side
        else:
            bottom, x_bottom = y, side
    return push_piece(pieces, count, e, top, bottom, x_top, x_bottom)


@helper_kernel
def leave_trapezoid(
    sums: Int64Array, column: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer, sign: Integer
) -> None:
    """Add what a piece covers of one column, and of all further right, to the row's sums.

    Shapes  sums: (W + 2,), areas; their running sum is the coverage.
    """
    height = bottom - top
    offset = np.float64(x_top + x_bottom - 2 * (column << LENGTH_BITS)) * (0.5 / np.float64(ONE))
    left_out = np.int64(np.rint(np.float64(height) * offset * (UNIT / np.float64(ONE))))
    whole = height << 8
    sums[column] += sign * (whole - left_out)
    sums[column + 1] += sign * left_out


@helper_kernel
def leave_piece(
    sums: Int64Array, edges: Int64Array, e: Integer, row: Integer, top: Integer, bottom: Integer, x_top: Integer,
    x_bottom: Integer, sign: Integer,
) -> None:  # fmt: skip
    """Go along a piece from column to column and leave in each what it covers."""
    first, last = x_top >> LENGTH_BITS, x_bottom >> LENGTH_BITS
    step = np.int64(1 if last > first else -1)
    y, x, column = top, x_top, first
    while column != last:
        border = column + 1 if step > 0 else column
        next_y = min(max(y_at(edges, e, border, row), y), bottom)
        leave_trapezoid(sums, column, y, next_y, x, border << LENGTH_BITS, sign)
        y, x, column = next_y, border << LENGTH_BITS, column + step
    leave_trapezoid(sums, column, y, bottom, x, x_bottom, sign)


@helper_kernel
def x_of(pieces: Int64Array, p: Integer, y: Integer) -> Integer:
    """Return where a piece is at a height in its row: exactly at its ends, between them in float64."""
    top, bottom, x_top, x_bottom = pieces[p, TOP], pieces[p, BOTTOM], pieces[p, X_TOP], pieces[p, X_BOTTOM]
    if y <= top:
        return np.int64(x_top)
    if y >= bottom:
        return np.int64(x_bottom)
    share = np.float64(y - top) / np.float64(bottom - top)
    return np.int64(x_top + np.int64(np.rint(share * np.float64(x_bottom - x_top))))


@helper_kernel
def turn_piece(
    sums: Int64Array, edges: Int64Array, pieces: Int64Array, p: Integer, row: Integer, y: Integer, side: int
) -> None:
    """Let a piece be another side from a height on; leave what it was before."""
    if pieces[p, SIDE] != side:
        since = pieces[p, SINCE]
        if pieces[p, SIDE] != 0 and y > since:
            leave_piece(
                sums, edges, pieces[p, EDGE], row, since, y, x_of(pieces, p, since), x_of(pieces, p, y), pieces[p, SIDE]
            )
        pieces[p, SIDE], pieces[p, SINCE] = side, y


@helper_kernel
def order_slab(
    pieces: Int64Array, count: int, upper: Integer, lower: Integer, order: Int64Array, x: Int64Array
) -> tuple[int, Integer]:
    """Order the pieces that go from one height to another by where they begin; return how many, and where two first cross.

    Shapes  order: (count,), x: (2, count), written: where each is above and below.
    """
    listed = 0
    for p in range(count):
        if pieces[p, TOP] <= upper and pieces[p, BOTTOM] >= lower:
            above, below = x_of(pieces, p, upper), x_of(pieces, p, lower)
            m = listed
            while m > 0 and (x[0, m - 1] > above or (x[0, m - 1] == above and x[1, m - 1] > below)):
                order[m], x[0, m], x[1, m] = order[m - 1], x[0, m - 1], x[1, m - 1]
                m -= 1
            order[m], x[0, m], x[1, m] = p, above, below
            listed += 1

    # The first crossing is one of neighbours.
    first = lower
    for m in range(1, listed):
        if x[1, m - 1] > x[1, m]:
            ahead, behind = np.float64(x[0, m] - x[0, m - 1]), np.float64(x[1, m - 1] - x[1, m])
            crossing = upper + np.int64(np.rint(np.float64(lower - upper) * (ahead / (ahead + behind))))
            first = min(first, max(crossing, upper + 1))
    return listed, first


@helper_kernel
def list_heights(pieces: Int64Array, count: int, heights: Int64Array) -> int:
    """Write the heights at which pieces begin or end, ordered and each once, and return how many there are."""
    listed = 0
    for k in range(2 * count):
        height = pieces[k >> 1, TOP] if k & 1 == 0 else pieces[k >> 1, BOTTOM]
        m = listed
        while m > 0 and heights[m - 1] > height:
            m -= 1
        if m > 0 and heights[m - 1] == height:
            continue
        for q in range(listed, m, -1):
            heights[q] = heights[q - 1]
        heights[m] = height
        listed += 1
    return listed


@helper_kernel
def scan_row(
    sums: Int64Array, edges: Int64Array, pieces: Int64Array, count: int, row: Integer, fill_rule: int, heights: Int64Array,
    order: Int64Array, x: Int64Array,
) -> None:  # fmt: skip
    """Sweep down a row from height to height, and leave what bounds the inside.

    Shapes  heights: (2 count,), order: (count,), x: (2, count), room to work in.
    """
    marks = list_heights(pieces, count, heights)
    for k in range(1, marks):
        upper = heights[k - 1]
        while upper < heights[k]:
            listed, lower = order_slab(pieces, count, upper, heights[k], order, x)
            winding, is_inside = np.int64(0), False
            for m in range(listed):
                p, was_inside = order[m], is_inside
                winding += edges[pieces[p, EDGE], DOWN]
                is_inside = is_filled(fill_rule, np.int64(m + 1), winding)
                turn_piece(sums, edges, pieces, p, row, upper, int(is_inside) - int(was_inside))
            upper = lower
        for p in range(count):
            if pieces[p, BOTTOM] == heights[k]:
                turn_piece(sums, edges, pieces, p, row, heights[k], 0)


def gather_edges(xy: Int64Array, ring_starts: Int32Array, height: int) -> Int64Array:
    """Return the edges that go up or down within some rows, each from its upper end, ordered by it: (N, EDGE_COLUMNS)."""
    after = np.arange(1, len(xy) + 1)
    after[ring_starts[1:] - 1] = ring_starts[:-1]
    goes_down = (xy[after, 1] > xy[:, 1])[:, None]
    upper, lower = np.where(goes_down, xy, xy[after]), np.where(goes_down, xy[after], xy)
    edges = np.concatenate([upper, lower, np.where(goes_down, 1, -1)], axis=1)
    within = (edges[:, Y0] < edges[:, Y1]) & (edges[:, Y1] > 0) & (edges[:, Y0] < height << int(AREA_BITS))
    kept = edges[within]
    return np.ascontiguousarray(kept[np.argsort(kept[:, Y0], kind="stable")], np.int64)


@kernel
def area_kernel(edges: Int64Array, fill_rule: int, out: Float64Array) -> None:
    """Write how much of each pixel a polygon covers.

    Shapes  edges: (N, EDGE_COLUMNS), from gather_edges; out: (H, W) float64, 0 to 1 but for 2^-40.
    Units   corners in sub-pixels of AREA_BITS bits.
    Rule    fill_rule, one of polygon.py.
    Needs   corners within 2^24 px, sides within 2^18 px.
    Cost    O(pixels + pixels along the edges), and in each row O(pieces squared) comparisons.
    Source  font-rs and stb_truetype for the running sum.
    """
    height, width = out.shape
    total, listed, following = edges.shape[0], 0, 0
    active, sums = np.empty(total, np.int64), np.zeros(width + 2, np.int64)
    pieces, heights = np.empty((2 * total, PIECE_COLUMNS), np.int64), np.empty(4 * total, np.int64)
    order, x = np.empty(2 * total, np.int64), np.empty((2, 2 * total), np.int64)
    for row in range(height):
        # Insert the edges that start, and take out those that have ended.
        while following < total and edges[following, Y0] >> AREA_BITS <= row:
            active[listed] = following
            listed += 1
            following += 1
        kept, count = 0, 0
        for k in range(listed):
            e = active[k]
            if edges[e, Y1] > np.int64(row) << AREA_BITS:
                active[kept] = e
                kept += 1
                count = cut_row(edges, e, np.int64(row), np.int64(width), pieces, count)
        listed = kept

        # Leave what they cover, and add it up along the row.
        if count == 0:
            for i in range(width):
                out[row, i] = 0.0
            continue
        for i in range(width + 2):
            sums[i] = 0
        scan_row(sums, edges, pieces, count, np.int64(row), fill_rule, heights, order, x)
        cover = np.int64(0)
        for i in range(width):
            cover += sums[i]
            out[row, i] = np.float64(cover) / UNIT
