"""Many small shapes, each covered exactly and handed to a writer at once: what strokes, discs and dashes are painted with.

What an edge covers is that of area.py, to the bit: the same lengths and the same rounding. But a shape here is simple: its
rings wind once round what they hold and do not overlap. So no sweep has to find out what is inside, and each edge is a border
all the way. A shape costs what it touches: row by row, only the pixels between its edges are looked at.

Where an edge crosses a row or a column is a quotient. Edges near the image step it exactly by quotient and remainder, as lines
do; those that are far away, or that the image's sides cut, ask area.py each time.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel
from scanspan.raster.area import (
    AREA_BITS,
    BOTTOM,
    DOWN,
    LENGTH_BITS,
    PIECE_COLUMNS,
    TOP,
    UNIT,
    X0,
    X1,
    X_BOTTOM,
    X_TOP,
    Y0,
    Y1,
    cut_row,
    leave_piece,
    trapezoid_areas,
)  # fmt: skip
from scanspan.records import Array, Float64Array, Int64Array, Integer

# Columns of an edge behind those of area.py. It is at X at a row's upper border, and at NEXT at its lower one, with a REST that
# steps by STEP and STEP_REST. It crosses the left border of the column BORDER at Y; SIZE is how far it goes across.
X, NEXT, REST, STEP, STEP_REST, IS_NEAR, SIZE, BORDER, Y, Y_REST, Y_STEP, Y_STEP_REST = range(5, 17)
COLUMNS = 17
SHIFT = LENGTH_BITS - AREA_BITS
ROW = np.int64(1) << AREA_BITS
NEAR = np.int64(1) << 30  # 2^14 px: products of two such differences fit an int64
NO_BORDER = np.int64(-(1 << 62))


@helper_kernel
def length_and_rest(number: Integer, divisor: Integer) -> tuple[Integer, Integer]:
    """Return a quotient in lengths, rounded down, and what is left.

    Needs   |number| < 2^62, 0 < divisor < 2^32, and a quotient below 2^33.
    """
    upper = number // divisor
    scaled = (number - upper * divisor) << SHIFT
    lower = scaled // divisor
    return (upper << SHIFT) + lower, scaled - lower * divisor


@helper_kernel
def start_edge(edges: Int64Array, e: Integer, row: Integer) -> None:
    """Find where an edge meets the borders of its first row, and how that steps."""
    for k in range(X, COLUMNS):
        edges[e, k] = 0
    edges[e, BORDER] = NO_BORDER
    left, top, bottom = edges[e, X0], edges[e, Y0], edges[e, Y1]
    reach = max(max(left, -left), max(edges[e, X1], -edges[e, X1]), max(top, -top), max(bottom, -bottom))
    edges[e, IS_NEAR], edges[e, SIZE] = 1 if reach <= NEAR else 0, max(edges[e, X1] - left, left - edges[e, X1])
    if reach > NEAR:
        return
    across, down, upper = edges[e, X1] - left, bottom - top, row << AREA_BITS
    lower = upper + ROW
    edges[e, X] = left << SHIFT
    if top < upper:
        edges[e, X] += length_and_rest(across * (upper - top), down)[0]
    if bottom > lower:
        length, edges[e, REST] = length_and_rest(across * (lower - top), down)
        edges[e, NEXT] = (left << SHIFT) + length
    if bottom > lower + ROW:
        edges[e, STEP], edges[e, STEP_REST] = length_and_rest(across << AREA_BITS, down)


@helper_kernel
def start_border(edges: Int64Array, e: Integer, border: Integer) -> None:
    """Find where an edge crosses the left border of a column, and how that steps to the next one."""
    across, down, size = edges[e, X1] - edges[e, X0], edges[e, Y1] - edges[e, Y0], edges[e, SIZE]
    gone = (border << AREA_BITS) - edges[e, X0]
    length, edges[e, Y_REST] = length_and_rest(down * (gone if across > 0 else -gone), size)
    edges[e, BORDER], edges[e, Y] = border, (edges[e, Y0] << SHIFT) + length
    if size > ROW:
        edges[e, Y_STEP], edges[e, Y_STEP_REST] = length_and_rest(down << AREA_BITS, size)


@helper_kernel
def leave_cut(
    sums: Int64Array, edges: Int64Array, e: Integer, row: Integer, width: Integer, pieces: Int64Array
) -> tuple[Integer, Integer]:
    """Leave what is left of an edge in a row between the image's sides; return the first and the last column of it.

    One that is right of the image lets what is left of it go on to the last column.
    """
    count = cut_row(edges, e, row, width, pieces, 0)
    first, last = width, width - 1 if count == 0 else np.int64(-1)
    for p in range(count):
        x_top, x_bottom = pieces[p, X_TOP], pieces[p, X_BOTTOM]
        leave_piece(sums, edges, e, row, pieces[p, TOP], pieces[p, BOTTOM], x_top, x_bottom, edges[e, DOWN])
        first = min(first, x_top >> LENGTH_BITS, x_bottom >> LENGTH_BITS)
        last = max(last, x_top >> LENGTH_BITS, x_bottom >> LENGTH_BITS)
    return first, last


@helper_kernel
def gather_shape(
    edges: Int64Array, xy: Int64Array, ring_starts: Int64Array, first_ring: Integer, last_ring: Integer, y_start: Integer,
    y_end: Integer,
) -> tuple[int, Integer, Integer]:  # fmt: skip
    """List the edges of a shape that go up or down within some rows; return how many, and its first and last row."""
    highest, lowest, count = y_start << AREA_BITS, y_end << AREA_BITS, 0
    top: Integer = lowest
    bottom: Integer = highest
    for ring in range(first_ring, last_ring):
        for v in range(ring_starts[ring], ring_starts[ring + 1]):
            w = v + 1 if v + 1 < ring_starts[ring + 1] else ring_starts[ring]
            upper, lower, turn = (v, w, 1) if xy[v, 1] < xy[w, 1] else (w, v, -1)
            y0, y1 = xy[upper, 1], xy[lower, 1]
            if y0 == y1 or y0 >= lowest or y1 <= highest:
                continue
            edges[count, X0], edges[count, Y0], edges[count, X1], edges[count, Y1] = xy[upper, 0], y0, xy[lower, 0], y1
            edges[count, DOWN] = turn
            start_edge(edges, count, max(y0 >> AREA_BITS, y_start))
            top, bottom, count = min(top, y0), max(bottom, y1), count + 1
    return count, max(top >> AREA_BITS, y_start), min((bottom - 1) >> AREA_BITS, y_end - 1)


@inline_kernel
def draw_shape(
    write_cover: Callable[..., None], flat: Array, width: Integer, edges: Int64Array, count: Integer, first_row: Integer,
    last_row: Integer, pieces: Int64Array, sums: Int64Array, color: Integer, is_linear: int,
) -> None:  # fmt: skip
    """Write one shape, row by row.

    Its arrays are not handed on in the loops, but where an edge is cut: that would count references each time, and cost more
    than all else.
    """
    side = width << LENGTH_BITS
    for row in range(first_row, last_row + 1):
        first: Integer = width
        last: Integer = np.int64(-1)
        upper = row << AREA_BITS
        for e in range(count):
            y0, y1 = edges[e, Y0], edges[e, Y1]
            if y0 >= upper + ROW or y1 <= upper:
                continue
            is_cut, ends_here, sign = edges[e, IS_NEAR] == 0, y1 <= upper + ROW, edges[e, DOWN]
            x_top, x_bottom = edges[e, X], edges[e, NEXT]
            if not is_cut:
                # Step it to the next row.
                if ends_here:
                    x_bottom = edges[e, X1] << SHIFT
                else:
                    rest = edges[e, REST] + edges[e, STEP_REST]
                    carries = np.int64(rest >= y1 - y0)
                    edges[e, X], edges[e, NEXT] = x_bottom, x_bottom + edges[e, STEP] + carries
                    edges[e, REST] = rest - carries * (y1 - y0)
                is_cut = min(x_top, x_bottom) < 0 or max(x_top, x_bottom) > side
            if is_cut:
                low, high = leave_cut(sums, edges, e, row, width, pieces)
                first, last = min(first, low), max(last, high)
                continue

            # Go along it from column to column, as leave_piece of area.py does, and leave in each what it covers.
            y, bottom = max(y0 - upper, np.int64(0)) << SHIFT, min(y1 - upper, ROW) << SHIFT
            column, final, above = x_top >> LENGTH_BITS, x_bottom >> LENGTH_BITS, row << LENGTH_BITS
            first, last = min(first, column, final), max(last, column, final)
            step, x, size = np.int64(1 if final > column else -1), x_top, edges[e, SIZE]
            while column != final:
                border = max(column, column + step)
                if edges[e, BORDER] != border:
                    start_border(edges, e, border)
                next_y = min(max(edges[e, Y] - above, y), bottom)
                here, further = trapezoid_areas(column, y, next_y, x, border << LENGTH_BITS)
                sums[column] += sign * here
                sums[column + 1] += sign * further
                y, x, column = next_y, border << LENGTH_BITS, column + step

                # Step to the next border.
                rest = edges[e, Y_REST] + edges[e, Y_STEP_REST]
                carries = np.int64(rest >= size)
                edges[e, Y] += edges[e, Y_STEP] + carries
                edges[e, Y_REST], edges[e, BORDER] = rest - carries * size, border + step
            here, further = trapezoid_areas(column, y, bottom, x, x_bottom)
            sums[column] += sign * here
            sums[column + 1] += sign * further

        # Add it up along the row.
        covered = np.int64(0)
        for i in range(first, min(last + 1, width)):
            covered += sums[i]
            sums[i] = 0
            cover = np.float64(covered) / UNIT
            if cover > 0.0:
                write_cover(flat, row * width + i, color, np.float32(min(cover, 1.0)), is_linear)
        sums[min(last + 1, width)], sums[width], sums[width + 1] = 0, 0, 0


@inline_kernel
def draw_shapes(
    write_cover: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, xy: Int64Array,
    ring_starts: Int64Array, shape_rings: Int64Array, values: Float64Array, is_linear: int,
) -> None:  # fmt: skip
    """Write how much shapes cover of the pixels in some rows, one shape after the other.

    Shapes  flat: (H W, ...), a target, row after row; xy, ring_starts, shape_rings: as in Shapes of geometry/stroke.py; values:
            (S,) packed colours, handed to the writer with the cover, a float32 above 0 and at most 1.
    Units   xy: sub-pixels of AREA_BITS bits.
    Rule    a ring counts once where it winds counter-clockwise as seen; rings of one shape do not overlap.
    Needs   corners within 2^24 + 2^18 px; y_start to y_end are rows of the target; width below 2^18.
    Cost    O(edges x rows + pixels touched) of each shape.
    """
    most = np.int64(1)
    for shape in range(len(shape_rings) - 1):
        most = max(most, ring_starts[shape_rings[shape + 1]] - ring_starts[shape_rings[shape]])
    edges, pieces = np.empty((most, COLUMNS), np.int64), np.empty((4, PIECE_COLUMNS), np.int64)
    sums = np.zeros(width + 2, np.int64)
    for shape in range(len(shape_rings) - 1):
        color = np.int64(values[shape])
        count, first_row, last_row = gather_shape(
            edges, xy, ring_starts, shape_rings[shape], shape_rings[shape + 1], y_start, y_end
        )
        if count > 0:
            draw_shape(write_cover, flat, width, edges, count, first_row, last_row, pieces, sums, color, is_linear)
