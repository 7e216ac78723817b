"""Half-space straight from corners to pixels, in order, by the size of the triangle.

Where what is drawn is known beforehand, a sample is one sign test, and most of a triangle's time is what goes on around it.
Where an image is cut into bands of rows, each band looks at all triangles. Those that reach into it are listed first, some
hundred at a time, without a branch that the processor would have to guess; and set up in lanes, 64 at a time, into rows of
numbers that stay in the cache (lanes.py). After that there are three ways, and all look at the same exact edge values:

rows   A box of up to 8 samples across, which is one vector, and 16 down is drawn as so many rows, listed beforehand one after
       the other through all small boxes: how many a triangle has is nothing that the processor has to guess.
boxes  One of up to 64 samples across is tested whole, each row rounded up to whole vectors, so that there is no rest. A lane
       outside of the box is outside of the triangle. The writer must leave such lanes alone: they may lie in the next row.
spans  In a wider one, and where the image cuts a box off on the right, the ends of all rows are worked out first, row by row
       in vectors too: a quotient in float64 is right to less than half a sample, and one exact edge value tells on which side
       of it the edge lies. Between its ends a row is filled without a test. Where samples take long, because they are tested
       by depth, all that are not small are drawn so.

docs/decisions/0014-small-triangles.md and 0022-lanes.md have the measurements.

Source: Pineda 1988; M. Abrash 2009, Rasterization on Larrabee, for a path of their own for small triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from scanspan.geometry.fixed_point import to_grid
from scanspan.jit import bare_helper, bare_part, inline_kernel
from scanspan.raster.lanes import (
    ACROSS,
    BLOCK,
    DOWN,
    EDGE,
    LEFT,
    PADDED,
    RIGHT,
    ROWS,
    TOP,
    VECTOR,
    WHOLE,
    fetch_corners,
    find_boxes,
    set_up_lanes,
    whole_vectors,
)
from scanspan.raster.setup import set_up_edges
from scanspan.records import Array, Float64Array, Int64Array, Integer, Sampling, UInt8Array

WIDE = np.int64(64)  # samples across, beyond which spans are faster
LISTED = 512  # triangles that are looked at together; their corners are still in the cache when they are drawn
SMALL_ROWS = np.int64(16)  # of a box that is drawn row by row
ROW_SHIFT = np.int64(8)
ROW = np.int64(1) << ROW_SHIFT
FLOATS, CODES = 22, 9  # rows of numbers and of codes for each triangle of a block, as lanes.py and gouraud.py have them
ZERO, ONE = np.int64(0), np.int64(1)


class Room(NamedTuple):
    """What scan_flat works in."""

    starts: Int64Array  # (H,), or more
    ends: Int64Array
    listed: Int64Array  # (LISTED,)
    rows: Int64Array  # (BLOCK SMALL_ROWS + SMALL_ROWS,)
    whole: Int64Array  # (WHOLE BLOCK,)
    floats: Float64Array  # (FLOATS BLOCK,)
    codes: UInt8Array  # (CODES BLOCK,)
    vector: Int64Array  # (1,) VECTOR, which the compiler is not to know


def make_room(height: int) -> Room:
    """Return what scan_flat works in for so many rows of an image; kernels paste it in."""
    return Room(
        np.empty(height, np.int64), np.empty(height, np.int64), np.empty(LISTED, np.int64),
        np.empty((BLOCK + 1) * SMALL_ROWS, np.int64), np.zeros(WHOLE * BLOCK, np.int64), np.zeros(FLOATS * BLOCK),
        np.zeros(CODES * BLOCK, np.uint8), np.full(1, VECTOR),
    )  # fmt: skip


make_room_within = inline_kernel(make_room)


@bare_helper
def cut_row(start: Integer, end: Integer, value: Integer, a: Integer, inverse: float, limit: float) -> tuple[Integer, Integer]:
    """Return the span start to end of a row cut to what lies on the inner side of an edge.

    Rule    value + a i >= 0, exactly: within the limit, at most 2^18, float64 rounds the quotient to a sample that is the
            wanted one or its neighbour, and the edge value there tells which.
    """
    i = np.int64(np.rint(min(max(np.float64(value) * inverse, -1.0), limit)))
    is_inside = value + a * i >= 0
    first, last = i + np.int64(not is_inside), i + np.int64(is_inside)
    stays: Integer = end if (a > 0) | (value >= 0) else ZERO
    return max(start, first) if a > 0 else start, min(end, last if a < 0 else stays)


@bare_part
def cut_rows(
    starts: Int64Array, ends: Int64Array, rows: Integer, width: Integer, f0: Integer, f1: Integer, f2: Integer, a0: Integer,
    a1: Integer, a2: Integer, b0: Integer, b1: Integer, b2: Integer,
) -> None:  # fmt: skip
    """Find the first sample of each row of a box that is inside of three edges, and the one after the last.

    Shapes  starts, ends: (rows or more,), written; f0 to b2: see TriangleSetup.
    Units   width: samples across.
    """
    limit = np.float64(width)
    inverse0 = -1.0 / np.float64(a0 if a0 != 0 else ONE)
    inverse1 = -1.0 / np.float64(a1 if a1 != 0 else ONE)
    inverse2 = -1.0 / np.float64(a2 if a2 != 0 else ONE)
    for j in range(rows):
        start, end = cut_row(ZERO, width, f0 + b0 * j, a0, inverse0, limit)
        start, end = cut_row(start, end, f1 + b1 * j, a1, inverse1, limit)
        starts[j], ends[j] = cut_row(start, end, f2 + b2 * j, a2, inverse2, limit)


@bare_part
def list_near(vertices: Array, first: int, last: int, above: float, below: float, listed: Int64Array) -> Integer:
    """List the triangles among first to last that are not all above or below some rows, and return how many there are."""
    count = ZERO
    for n in range(first, last):
        p_y, q_y, r_y = vertices[n, 0, 1], vertices[n, 1, 1], vertices[n, 2, 1]
        listed[np.uint64(count)] = n
        count += np.int64((max(p_y, q_y, r_y) >= above) & (min(p_y, q_y, r_y) <= below))
    return count


@bare_helper
def set_up_far(
    vertices: Array, listed: Int64Array, start: Integer, count: Integer, whole: Int64Array, scale: float, sampling: Sampling,
) -> None:  # fmt: skip
    """Set up by itself each triangle of a block that is not near, or whose edges an off-screen point decides about."""
    lowest = ZERO
    for k in range(count):
        lowest = min(lowest, whole[ROWS * BLOCK + k])
    for k in range(count if lowest < 0 else ZERO):
        if whole[ROWS * BLOCK + k] >= 0:
            continue
        n = listed[start + k]
        is_cut, x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2 = set_up_edges(
            to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale), to_grid(vertices[n, 1, 0], scale),
            to_grid(vertices[n, 1, 1], scale), to_grid(vertices[n, 2, 0], scale), to_grid(vertices[n, 2, 1], scale), sampling,
        )  # fmt: skip
        across = x_end - x_start
        whole[LEFT * BLOCK + k], whole[TOP * BLOCK + k] = x_start, y_start
        whole[ACROSS * BLOCK + k], whole[ROWS * BLOCK + k] = across, max(y_end - y_start, ZERO)
        whole[PADDED * BLOCK + k] = ZERO if is_cut or across > WIDE else whole_vectors(across)
        whole[EDGE * BLOCK + k], whole[(EDGE + 1) * BLOCK + k], whole[(EDGE + 2) * BLOCK + k] = f0, f1, f2
        whole[RIGHT * BLOCK + k], whole[(RIGHT + 1) * BLOCK + k], whole[(RIGHT + 2) * BLOCK + k] = a0, a1, a2
        whole[DOWN * BLOCK + k], whole[(DOWN + 1) * BLOCK + k], whole[(DOWN + 2) * BLOCK + k] = b0, b1, b2


@bare_part
def set_up_block(
    vertices: Array, listed: Int64Array, start: Integer, count: Integer, floats: Float64Array, whole: Int64Array,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Set up some triangles of a list, whose depths have been fetched if they have any."""
    scale, many = np.float64(np.int64(1) << sampling.subpixel_bits), whole_vectors(count)
    fetch_corners(vertices, listed, start, count, floats)
    find_boxes(floats, whole, many, sampling, scale, np.float64(WIDE))
    set_up_lanes(floats, whole, many, np.float64(sampling.cull), np.int64(sampling.rule), scale)
    set_up_far(vertices, listed, start, count, whole, scale, sampling)


@bare_part
def list_rows(whole: Int64Array, count: Integer, rows: Int64Array) -> Integer:
    """List the rows of small boxes one by one, and of larger ones only that they are there; return how many entries that are.

    Shapes  rows: as in Room, written: k + ROW j for row j of triangle k, and -1 - k for a triangle as a whole.
    """
    listed = ZERO
    for k in range(count):
        down = whole[ROWS * BLOCK + k]
        is_small = (whole[PADDED * BLOCK + k] == VECTOR) & (down <= SMALL_ROWS)
        for j in range(SMALL_ROWS):
            rows[np.uint64(listed + j)] = k + j * ROW
        rows[np.uint64(listed)] = k if is_small else -1 - k
        listed += down if is_small else min(down, ONE)
    return listed


@inline_kernel
def draw_box(
    start_value: Callable[..., Any], write_value: Callable[..., None], is_dear: bool, target: Any, width: Integer, values: Any,
    n: Integer, k: Integer, room: Room, top: int, length: Integer,
) -> None:  # fmt: skip
    """Write the value of triangle n, which is k in its block, to all samples that it covers; see scan_flat."""
    whole = room.whole
    f0, f1, f2 = whole[EDGE * BLOCK + k], whole[(EDGE + 1) * BLOCK + k], whole[(EDGE + 2) * BLOCK + k]
    a0, a1, a2 = whole[RIGHT * BLOCK + k], whole[(RIGHT + 1) * BLOCK + k], whole[(RIGHT + 2) * BLOCK + k]
    b0, b1, b2 = whole[DOWN * BLOCK + k], whole[(DOWN + 1) * BLOCK + k], whole[(DOWN + 2) * BLOCK + k]
    rows, across, padded = whole[ROWS * BLOCK + k], whole[ACROSS * BLOCK + k], whole[PADDED * BLOCK + k]
    start, value = (whole[TOP * BLOCK + k] - top) * width + whole[LEFT * BLOCK + k], start_value(values, n, room.floats, k)

    # Test all samples of a narrow box, some beyond its right side included.
    if padded > 0 and not is_dear:
        for j in range(rows):
            for i in range(padded):
                e1, e2 = f1 + i * a1, f2 + i * a2
                write_value(target, np.uint64(start + i), ((f0 + i * a0) | e1 | e2) >= 0, value, i, j, e1, e2)
            f0, f1, f2, start = f0 + b0, f1 + b1, f2 + b2, start + width
        return

    # Work out where each row begins and ends, and fill it; or go through it vector by vector, which leaves no rest.
    cut_rows(room.starts, room.ends, rows, across, f0, f1, f2, a0, a1, a2, b0, b1, b2)
    for j in range(rows):
        left, end = room.starts[j], room.ends[j]
        if is_dear:
            for x in range(left, end, VECTOR):
                d1, d2 = f1 + x * a1, f2 + x * a2
                for i in range(length):
                    write_value(target, np.uint64(start + x + i), i < end - x, value, x + i, j, d1 + i * a1, d2 + i * a2)
        else:
            for i in range(end - left):
                e1, e2 = f1 + (left + i) * a1, f2 + (left + i) * a2
                write_value(target, np.uint64(start + left + i), True, value, left + i, j, e1, e2)
        f1, f2, start = f1 + b1, f2 + b2, start + width


@inline_kernel
def scan_flat(
    fetch_values: Callable[..., None], set_up_values: Callable[..., None], start_value: Callable[..., Any],
    write_value: Callable[..., None], is_dear: bool, target: Any, width: Integer, vertices: Array, values: Any, room: Room,
    top: int, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Write the values of triangles first to last to all samples that they cover, in order.

    Shapes  target: (H width,), or more of them, as write_value takes it; vertices: (N, 3, 2); values: (N, ...), as fetch_values
            and start_value take them; room: from make_room; top: the row of the image that is the first of target; is_dear:
            whether a vector of samples takes so long that it is worth finding out where rows begin and end.
    Units   vertices in pixels, within 2^24 of 0.
    Rule    sampling.rule, folded into the edge constants by the setup; samples decide.
    Needs   the rectangle of sampling lies within the target; write_value writes nothing where a sample is not inside.
    Cost    O(box) in whole vectors up to WIDE samples across; beyond it O(covered samples), and a few instructions a row.
    """
    scale = np.float64(np.int64(1) << sampling.subpixel_bits)
    above, below = np.float64(sampling.y_start - 1), np.float64(sampling.y_end + 1)
    listed, rows, whole, floats, codes = room.listed, room.rows, room.whole, room.floats, room.codes

    # This is VECTOR. If the compiler knew, it would write out loops of that length sample by sample; but it has to know that it
    # is no more, to make one vector of them.
    length = room.vector[0] & VECTOR
    for block in range(first, last, LISTED):
        near = list_near(vertices, block, min(block + LISTED, last), above, below, listed)
        for m in range(ZERO, near, BLOCK):
            # Set up a block of triangles.
            count = min(near - m, np.int64(BLOCK))
            fetch_values(values, listed, m, count, floats, codes)
            set_up_block(vertices, listed, m, count, floats, whole, sampling)
            set_up_values(floats, codes, whole_vectors(count), scale)

            # Draw them row by row, and as a whole those that are not small.
            for e in range(list_rows(whole, count, rows)):
                entry = rows[e]
                if entry < 0:
                    draw_box(
                        start_value, write_value, is_dear, target, width, values, listed[m - 1 - entry], -1 - entry, room, top,
                        length,
                    )  # fmt: skip
                    continue
                k, j = entry & (ROW - 1), entry >> ROW_SHIFT
                start = (whole[TOP * BLOCK + k] + (j - top)) * width + whole[LEFT * BLOCK + k]
                value = start_value(values, listed[m + k], floats, k)
                a0, a1, a2 = whole[RIGHT * BLOCK + k], whole[(RIGHT + 1) * BLOCK + k], whole[(RIGHT + 2) * BLOCK + k]
                f0 = whole[EDGE * BLOCK + k] + j * whole[DOWN * BLOCK + k]
                f1 = whole[(EDGE + 1) * BLOCK + k] + j * whole[(DOWN + 1) * BLOCK + k]
                f2 = whole[(EDGE + 2) * BLOCK + k] + j * whole[(DOWN + 2) * BLOCK + k]

                for i in range(length):
                    e1, e2 = f1 + i * a1, f2 + i * a2
                    write_value(target, np.uint64(start + i), ((f0 + i * a0) | e1 | e2) >= 0, value, i, j, e1, e2)
