"""Convex polygons in a sweep of areas: their edges are left one after the other, because none needs to know of the others.

What lies within a convex polygon has a winding of 1, or of -1, and all else has 0. So the direction of an edge says which
border of the inside it is, under every fill rule, and the sweep need not keep edges in order. They leave in the rows of a small
box what they leave in the rows of a sweep, to the bit, because that depends on the edge, the row and the pixel alone.

A polygon counts as convex if it has one ring, turns one way at every corner, lies between the sides of the image and reaches
across less than 2^8 px: then two edges are further apart at any corner than whatever is rounded, so that a sweep would see no
crossing either, and divisions fit into 64 bits.

Price: outlines of many corners pay for a look at each of them, once.

Source: the accumulation buffer of font-rs and stb_truetype, here in integers.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area_edges import (
    AREA_BITS,
    LENGTH_BITS,
    ONE,
    PIXEL,
    SHIFT,
    X0,
    X1,
    Y0,
    Y1,
    divide_near,
    leave_trapezoid,
)  # fmt: skip
from scanspan.records import Int32Array, Int64Array, Integer

REACH = np.int64(1 << 24)  # 2^8 px, in corners' units
BOX = 1 << 14  # sums of a box that are kept at a time


@bare_kernel
def find_convex(xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, width: int, windings: Int64Array) -> None:
    """Find which polygons are convex, and the winding within them.

    Shapes  xy: (V, 2) corners in sub-pixels of AREA_BITS bits; windings: (P,), written: 0 for a polygon that is not convex.
    """
    for n in range(windings.shape[0]):
        windings[n] = 0
        if polygon_rings[n + 1] - polygon_rings[n] != 1:
            continue
        first, last = np.int64(ring_starts[polygon_rings[n]]), np.int64(ring_starts[polygon_rings[n] + 1])
        if last - first < 3:
            continue
        x, y = xy[last - 1, 0], xy[last - 1, 1]
        across, down = x - xy[last - 2, 0], y - xy[last - 2, 1]
        low, high, top, bottom = x, x, y, y
        turn, changes, heading = np.int64(0), np.int64(0), np.int64(0)
        first_heading = np.int64(0)
        is_convex = max(abs(across), abs(down)) < REACH
        for k in range(first, last):
            # Turn from one edge to the next.
            next_x, next_y = xy[k, 0], xy[k, 1]
            next_across, next_down = next_x - x, next_y - y
            low, high, top, bottom = min(low, next_x), max(high, next_x), min(top, next_y), max(bottom, next_y)
            if not is_convex or max(abs(next_across), abs(next_down)) >= REACH:
                is_convex = False
                break
            cross = across * next_down - down * next_across
            if k == first:
                turn = np.int64(1) if cross > 0 else np.int64(-1)
            if cross * turn <= 0:
                is_convex = False
                break

            # Count how often it goes from down to up or back; once round, that is twice.
            if next_down != 0:
                went = np.int64(1) if next_down > 0 else np.int64(-1)
                changes += np.int64(heading == -went)
                first_heading = went if heading == 0 else first_heading
                heading = went
            x, y, across, down = next_x, next_y, next_across, next_down
        changes += np.int64(first_heading == -heading)
        is_within = low >= 0 and high <= np.int64(width) << AREA_BITS and max(high - low, bottom - top) < REACH
        if is_convex and is_within and changes == 2:
            windings[n] = -turn


@bare_helper
def leave_edge(
    sums: Int64Array, extents: Int64Array, edges: Int64Array, e: Integer, left: Integer, row: Integer, row_end: Integer,
    stride: Integer, sign: Integer,
) -> None:  # fmt: skip
    """Leave what an edge covers in the rows of a box.

    Shapes  sums: row by row, `stride` each; extents: (rows, 2), the columns of a row in which something was left.
    """
    upper = max(row << AREA_BITS, edges[e, Y0])
    x0, y0, x1, y1 = edges[e, X0] - (left << AREA_BITS), edges[e, Y0] - upper, edges[e, X1], edges[e, Y1] - upper
    if y1 <= 0:
        return
    x1 -= left << AREA_BITS
    across, down = x1 - x0, y1 - y0
    size, step = (across, np.int64(1)) if across >= 0 else (-across, np.int64(-1))
    goes_right = across >= 0
    enters, leaves = (np.int64(0), ONE) if goes_right else (ONE, np.int64(0))

    # Find where it begins, and in which rows.
    first_row = upper >> AREA_BITS
    last_row = min((edges[e, Y1] + PIXEL - 1) >> AREA_BITS, row_end)
    upper -= first_row << AREA_BITS
    y0, y1 = y0 + upper, y1 + upper
    top, x = upper << SHIFT, x0 << SHIFT
    if y0 < upper:
        x += divide_near(across * (upper - y0), down)[0]
    x_rest: Integer = np.int64(0)
    x_step: Integer = np.int64(0)
    x_step_rest: Integer = np.int64(-1)
    y: Integer = np.int64(0)
    y_rest: Integer = np.int64(0)
    y_step: Integer = np.int64(0)
    y_step_rest: Integer = np.int64(-1)
    is_known = False
    for r in range(first_row - row, last_row - row):
        x_top, bottom = x, ONE
        if y1 <= PIXEL:
            x, bottom = x1 << SHIFT, y1 << SHIFT
        elif x_step_rest >= 0:
            x_rest += x_step_rest
            carries = x_rest >= down
            x_rest -= down if carries else np.int64(0)
            x += x_step + np.int64(carries)
        else:
            x, x_rest = divide_near(across * (PIXEL - y0), down)
            x += x0 << SHIFT
            if y1 > 2 * PIXEL:
                x_step, x_step_rest = divide_near(across << AREA_BITS, down)
        first, last, place = x_top >> LENGTH_BITS, x >> LENGTH_BITS, r * stride
        extents[r, 0] = min(extents[r, 0], first, last)
        extents[r, 1] = max(extents[r, 1], first, last)
        column, x_in = first, x_top - (first << LENGTH_BITS)
        while column != last:
            # Go on to the next border of a column.
            if not is_known:
                border = column + np.int64(goes_right)
                y, y_rest = divide_near(step * down * ((border << AREA_BITS) - x0), size)
                y += y0 << SHIFT
                is_known = True
            next_y = min(max(y, top), bottom)
            leave_trapezoid(sums, place + column, next_y - top, x_in + leaves, sign)
            top, x_in, column = next_y, enters, column + step

            # Step the height.
            if y_step_rest < 0:
                y_step, y_step_rest = divide_near(down << AREA_BITS, size)
            y_rest += y_step_rest
            carries = y_rest >= size
            y_rest -= size if carries else np.int64(0)
            y += y_step + np.int64(carries)
        leave_trapezoid(sums, place + last, bottom - top, x_in + x - (last << LENGTH_BITS), sign)
        top, y0, y1, y = np.int64(0), y0 - PIXEL, y1 - PIXEL, y - ONE
