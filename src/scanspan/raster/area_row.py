"""A row of an area sweep: who bounds the inside where, and what that leaves.

First all edges are stepped to the lower border of the row. Columns in which an edge begins, ends or crosses another are marked
as busy. An edge that keeps out of them is next to the same edges all through the row: it leaves what it covers at once. The
others are taken in runs. A run that only crosses itself leaves nothing where all of it is within the inside or the outside,
whatever the order, and two that cross change places once; all else is swept from event to event (area_settle.py).

A level edge joins corners far apart, between which windings change: the columns between corners whose edges do not balance are
busy too.

Source: Bentley and Ottmann 1979.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area_edges import (
    AREA_BITS,
    DOWN,
    LENGTH_BITS,
    ONE,
    PIXEL,
    X0,
    X1,
    Y0,
    Y1,
    X,
    corner_length,
    leave_area,
    leave_columns,
    leave_piece,
    start_edge,
    step_to,
)  # fmt: skip
from scanspan.raster.area_events import put_event
from scanspan.raster.area_pieces import (
    BOTTOM,
    CORNERS,
    EDGE,
    GONE,
    IS_FENCE,
    LISTED,
    NO_COLUMN,
    SIDE,
    SINCE,
    STATE,
    TOP,
    WINDING,
    X_BOTTOM,
    X_TOP,
    AreaSweep,
    crosses,
    cut_piece,
    find_crossing,
    is_inside,
    leave_until,
    list_edges,
    mark_columns,
    next_busy,
    set_piece,
)  # fmt: skip
from scanspan.raster.area_settle import sweep_events, turn_piece
from scanspan.records import Int64Array, Integer


@bare_helper
def note_corner(corners: Int64Array, count: Integer, x: Integer, y: Integer, change: Integer) -> Integer:
    """Note by how much the windings right of a corner change at its height; return how many corners there are.

    Shapes  corners: (CORNERS, 3); one more is counted than fit.
    """
    k = np.int64(0)
    while k < min(count, CORNERS) and (corners[k, 0] != x or corners[k, 1] != y):
        k += 1
    if k == CORNERS:
        return CORNERS + 1
    if k == count:
        corners[k, 0], corners[k, 1], corners[k, 2] = x, y, 0
        count += 1
    corners[k, 2] += change
    return count


@bare_helper
def mark_levels(sweep: AreaSweep, count: Integer) -> None:
    """Mark the columns between corners that a level edge may join, for windings change all along it."""
    corners, busy, side = sweep.corners, sweep.busy, np.int64(sweep.sums.shape[0] - 2) << LENGTH_BITS
    zero = np.int64(0)
    low: Integer = zero if count > CORNERS else side
    high: Integer = side if count > CORNERS else zero
    for k in range(min(count, CORNERS)):
        if corners[k, 2] != 0:
            x = min(max(corner_length(corners[k, 0]), zero), side)
            low, high = min(low, x), max(high, x)
    if low <= high:
        mark_columns(busy, low, high)
        mark_columns(sweep.cornered, low, high)


@bare_helper
def begin_row(sweep: AreaSweep, count: Integer, following: Integer, total: Integer, upper: Integer) -> tuple[bool, Integer]:
    """Step the edges of a row to its lower border, and mark the columns in which something happens.

    Returns whether nothing does, and the first edge that begins below the row.
    """
    edges, order, spans, busy, corners = sweep.edges, sweep.order, sweep.spans, sweep.busy, sweep.corners
    lower, side = upper + PIXEL, np.int64(sweep.sums.shape[0] - 2) << LENGTH_BITS
    zero, is_quiet, foremost, leader = np.int64(0), True, np.int64(0), np.int64(0)
    noted: Integer = np.int64(0)
    for p in range(count):
        e = order[p]
        x_top = edges[e, X]
        x_bottom = step_to(edges, e, lower)
        happens = bool(edges[e, Y1] < lower)
        if happens:
            noted = note_corner(corners, noted, edges[e, X1], edges[e, Y1], -edges[e, DOWN])
        spans[p, 2], spans[p, 3] = x_top, x_bottom
        if min(x_top, x_bottom) < 0 or max(x_top, x_bottom) > side:
            happens = happens or not (max(x_top, x_bottom) <= 0 or min(x_top, x_bottom) >= side)
            x_top, x_bottom = min(max(x_top, zero), side), min(max(x_bottom, zero), side)
        spans[p, 0], spans[p, 1] = x_top, x_bottom
        if happens:
            mark_columns(busy, x_top, x_bottom)
            mark_columns(sweep.cornered, x_top, x_bottom)
            is_quiet = False
        if x_bottom < foremost:
            # It crosses at least the edge that comes furthest to the right.
            low, high = min(spans[leader, 0], x_top, x_bottom), max(spans[leader, 0], foremost, x_top)
            mark_columns(busy, low, high)
            is_quiet = False
        else:
            foremost, leader = x_bottom, np.int64(p)

    # Look at those that begin within the row.
    while following < total and edges[following, Y0] < lower:
        e = following
        start_edge(edges, e, upper)
        x_top = edges[e, X]
        x_bottom = step_to(edges, e, lower)
        spans[count, 0], spans[count, 1] = x_top, x_bottom
        mark_columns(busy, min(max(x_top, zero), side), min(max(x_bottom, zero), side))
        mark_columns(sweep.cornered, min(max(x_top, zero), side), min(max(x_bottom, zero), side))
        noted = note_corner(corners, noted, edges[e, X0], edges[e, Y0], edges[e, DOWN])
        if edges[e, Y1] < lower:
            noted = note_corner(corners, noted, edges[e, X1], edges[e, Y1], -edges[e, DOWN])
        is_quiet, count, following = False, count + 1, following + 1
    mark_levels(sweep, noted)
    return is_quiet, following


@bare_helper
def fill_piece(sweep: AreaSweep, p: Integer, place: Integer, winding: Integer, side: Integer, is_fence: Integer) -> None:
    """Let an edge of the list be a piece."""
    pieces, spans, e = sweep.pieces, sweep.spans, sweep.order[place]
    pieces[p, TOP], pieces[p, BOTTOM], pieces[p, X_TOP], pieces[p, X_BOTTOM] = 0, ONE, spans[place, 0], spans[place, 1]
    pieces[p, EDGE], pieces[p, SINCE], pieces[p, WINDING], pieces[p, STATE] = e, 0, winding, LISTED
    pieces[p, SIDE], pieces[p, IS_FENCE] = side, is_fence


@bare_kernel
def join_fence(sweep: AreaSweep, joined: Integer, joined_until: Integer, place: Integer, winding: Integer) -> Integer:
    """Let an edge to which nothing happens stand left of those that are swept, unless it is one; return how many there are."""
    if place < 0 or joined_until >= place:
        return joined
    fill_piece(sweep, joined, place, winding - sweep.edges[sweep.order[place], DOWN], np.int64(0), np.int64(1))
    return joined + 1


@bare_kernel
def join_edges(
    sweep: AreaSweep, first: Integer, last: Integer, joined: Integer, used: Integer, row: Integer, winding: Integer,
    fill_rule: int,
) -> Integer:  # fmt: skip
    """Let edges of the list be pieces that are swept, with their events; return how many pieces there are with those cut."""
    edges, pieces, events, spans = sweep.edges, sweep.pieces, sweep.events, sweep.spans
    upper, side = row << AREA_BITS, np.int64(sweep.sums.shape[0] - 2) << LENGTH_BITS
    for place in range(first, last):
        e, p = sweep.order[place], joined + place - first
        turn = np.int64(is_inside(fill_rule, winding + edges[e, DOWN])) - np.int64(is_inside(fill_rule, winding))
        fill_piece(sweep, p, place, winding, turn, np.int64(0))
        if edges[e, Y1] < upper + PIXEL:
            pieces[p, BOTTOM] = (edges[e, Y1] - upper) << (LENGTH_BITS - AREA_BITS)
        if min(spans[place, 2], spans[place, 3]) < 0 or max(spans[place, 2], spans[place, 3]) > side:
            begun = used
            pieces[p, X_TOP], pieces[p, X_BOTTOM] = spans[place, 2], spans[place, 3]
            used = cut_piece(sweep, p, used, row)
            pieces[p, WINDING], pieces[p, STATE], pieces[p, SIDE] = winding, LISTED, turn
            for q in range(begun, used):
                put_event(events, 2 * q, pieces[q, TOP])
        if pieces[p, BOTTOM] < ONE:
            put_event(events, 2 * p, pieces[p, BOTTOM])
        if p > 0 and crosses(pieces, p - 1, p):
            put_event(events, 2 * p - 1, find_crossing(pieces, p - 1, p))
        winding += edges[e, DOWN]
    return used


@bare_kernel
def join_later(sweep: AreaSweep, count: Integer, first: Integer, last: Integer, used: Integer, row: Integer) -> Integer:
    """Let edges wait that begin within the row, with their events; return how many pieces there are then.

    Shapes  their places are in the spans behind those of the list, which has `count`.
    """
    edges, spans, pieces = sweep.edges, sweep.spans, sweep.pieces
    upper, side = row << AREA_BITS, np.int64(sweep.sums.shape[0] - 2) << LENGTH_BITS
    for e in range(first, last):
        p, place = used, count + e - first
        used += 1
        top = (edges[e, Y0] - upper) << (LENGTH_BITS - AREA_BITS)
        bottom = (edges[e, Y1] - upper) << (LENGTH_BITS - AREA_BITS) if edges[e, Y1] < upper + PIXEL else ONE
        set_piece(pieces, p, e, top, bottom, spans[place, 0], spans[place, 1])
        if min(spans[place, 0], spans[place, 1]) < 0 or max(spans[place, 0], spans[place, 1]) > side:
            used = cut_piece(sweep, p, used, row)
        for q in range(p, used):
            put_event(sweep.events, 2 * q, pieces[q, TOP])
    return used


@bare_kernel
def find_run(
    sweep: AreaSweep, first: Integer, count: Integer, behind: Integer, ahead: Integer
) -> tuple[Integer, bool, Integer, Integer]:
    """Find how far a run of edges in busy columns goes on in the list.

    Returns where it ends, whether anything begins or ends in its columns, and the busy columns before and behind that place.
    """
    spans, last, start, until = sweep.spans, first, NO_COLUMN, np.int64(0)
    while last < count:
        low = min(spans[last, 0], spans[last, 1]) >> LENGTH_BITS
        high = max(spans[last, 0], spans[last, 1]) >> LENGTH_BITS
        is_apart = low <= ahead
        while ahead <= high:
            behind, ahead = ahead, next_busy(sweep.busy, ahead + 1)
        if is_apart and low > behind:
            break
        start, until, last = min(start, low), max(until, high), last + 1
    return last, bool(next_busy(sweep.cornered, start) <= until), behind, ahead


@bare_kernel
def leave_crossing(
    sweep: AreaSweep, place: Integer, count: Integer, p: Integer, row: Integer, winding: Integer, fill_rule: int
) -> bool:
    """Leave edges of the list that cross each other and nothing else, if that needs no events; say whether it was done.

    It does not need them where all are within the inside or the outside, in whatever order, and where they are two.
    """
    edges, order, pieces = sweep.edges, sweep.order, sweep.pieces
    low = high = winding
    for k in range(place, place + count):
        if edges[order[k], DOWN] > 0:
            high += 1
        else:
            low -= 1
    inside = is_inside(fill_rule, winding)
    changes, w = False, low
    while w <= high and not changes:
        changes, w = is_inside(fill_rule, w) != inside, w + 1
    if not changes:
        return True
    if count != 2:
        return False

    # Let the two change places where they cross.
    e, f = order[place], order[place + 1]
    middle, other, end = winding + edges[e, DOWN], winding + edges[f, DOWN], winding + edges[e, DOWN] + edges[f, DOWN]
    is_within, is_other, is_end = is_inside(fill_rule, middle), is_inside(fill_rule, other), is_inside(fill_rule, end)
    fill_piece(sweep, p, place, winding, np.int64(is_within) - np.int64(inside), np.int64(0))
    fill_piece(sweep, p + 1, place + 1, middle, np.int64(is_end) - np.int64(is_within), np.int64(0))
    if crosses(pieces, p, p + 1):
        y = max(find_crossing(pieces, p, p + 1), np.int64(0))
        turn_piece(sweep, p, y, row, np.int64(is_end) - np.int64(is_other))
        turn_piece(sweep, p + 1, y, row, np.int64(is_other) - np.int64(inside))
    leave_until(sweep, p, ONE, row)
    leave_until(sweep, p + 1, ONE, row)
    return True


@bare_kernel
def sweep_row(
    sweep: AreaSweep, count: Integer, following: Integer, total: Integer, row: Integer, fill_rule: int
) -> tuple[Integer, Integer]:
    """Leave what a polygon covers of one row in the sums; return the list's length and the first edge that is not in it.

    Cost    O(n) for n edges in a quiet row, O((n + k) log n) with k events.
    """
    edges, order, spans, pieces, busy = sweep.edges, sweep.order, sweep.spans, sweep.pieces, sweep.busy
    sums, moments, blocks, has_moments = sweep.sums, sweep.moments, sweep.blocks, sweep.moments.shape[1] > 0
    upper, zero = row << AREA_BITS, np.int64(0)
    count, following = list_edges(sweep, count, following, total, upper)
    is_quiet, below = begin_row(sweep, count, following, total, upper)

    # Leave the edges that stand where nothing happens; the others are pieces to be swept, with one to the left of them.
    was_inside, used = False, count
    p: Integer = zero
    winding: Integer = zero
    joined: Integer = zero
    joined_until: Integer = np.int64(-1)
    behind: Integer = np.int64(-1)
    ahead: Integer = NO_COLUMN
    if not is_quiet:
        ahead = next_busy(busy, zero)
    while p < count:
        e, x_top, x_bottom = order[p], spans[p, 0], spans[p, 1]
        low, high = min(x_top, x_bottom) >> LENGTH_BITS, max(x_top, x_bottom) >> LENGTH_BITS
        if ahead <= high or low <= behind:
            if ahead < low:
                joined, joined_until = join_fence(sweep, joined, joined_until, p - 1, winding), p - 1
            while ahead <= high:
                behind, ahead = ahead, next_busy(busy, ahead + 1)
            if low <= behind:
                first = p
                p, has_corner, behind, ahead = find_run(sweep, first, count, behind, ahead)
                if has_corner or not leave_crossing(sweep, first, p - first, joined, row, winding, fill_rule):
                    joined = join_fence(sweep, joined, joined_until, first - 1, winding)
                    used = join_edges(sweep, first, p, joined, used, row, winding, fill_rule)
                    joined, joined_until = joined + p - first, p - 1
                for k in range(first, p):
                    winding += edges[order[k], DOWN]
                was_inside = is_inside(fill_rule, winding)
                continue
        winding += edges[e, DOWN]
        p += 1
        inside = is_inside(fill_rule, winding)
        if inside != was_inside:
            turn = np.int64(inside) - np.int64(was_inside)
            was_inside = inside
            if has_moments:
                leave_piece(sums, moments, blocks, edges, e, row, zero, ONE, x_top, x_bottom, turn)
            else:
                leave_columns(leave_area, sums, moments, blocks, edges, e, row, zero, ONE, x_top, x_bottom, turn)
    if is_quiet:
        return count, following
    if ahead < NO_COLUMN:
        joined = join_fence(sweep, joined, joined_until, count - 1, winding)
    used = join_later(sweep, count, following, below, used, row)

    # Sweep, and leave what is left.
    sweep_events(sweep, joined, row, fill_rule)
    for k in range(joined):
        if pieces[k, STATE] != GONE:
            leave_until(sweep, k, pieces[k, BOTTOM], row)
    for q in range(count, used):
        if pieces[q, STATE] != GONE:
            leave_until(sweep, q, pieces[q, BOTTOM], row)
    busy[:] = 0
    sweep.cornered[:] = 0
    return count, following
