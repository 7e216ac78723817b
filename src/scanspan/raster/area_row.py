"""A row of an area sweep: who bounds the inside where, and what that leaves.

Most rows are quiet: nothing begins, ends or crosses within them. The others are swept from event to event. An event changes the
neighbours of a few pieces; from those on, windings are carried to the right until they are what they were, and sides follow
windings. So what no event touches leaves what it would in a quiet row, to the bit. Two pieces cross at a height that depends on
those two alone, and change places at most once: where they end decides.

Source: Bentley and Ottmann 1979.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area_edges import (
    AREA_BITS, DOWN, LENGTH_BITS, ONE, PIXEL, X0, X1, Y0, Y1, X, corner_length, leave_area, leave_columns, leave_piece, start_edge, step_to
)
from scanspan.raster.area_events import drop_event, put_event
from scanspan.raster.area_pieces import (
    AFTER,
    BEFORE,
    BOTTOM,
    CORNERS,
    EDGE,
    GONE,
    IS_FENCE,
    LISTED,
    LOOK,
    NO_COLUMN,
    SIDE,
    SINCE,
    STATE,
    TOP,
    TURNED,
    UNSET,
    WAITING,
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
    x_of,
)  # fmt: skip
from scanspan.records import Int64Array, Integer


@bare_helper
def look_at(sweep: AreaSweep, looked: Integer, p: Integer) -> Integer:
    """Note that the neighbours of a piece have changed; return how many are noted."""
    if sweep.pieces[p, STATE] == LISTED:
        sweep.pieces[p, STATE] = LISTED | LOOK
        sweep.looked[0, looked] = p
        return looked + 1
    return looked


@bare_kernel
def find_place(sweep: AreaSweep, p: Integer, y: Integer, listed: Integer) -> Integer:
    """Return the piece in the list left of which a piece that begins at a height belongs.

    Shapes  listed: how many pieces the index has; it may be a few events behind.
    """
    pieces, places = sweep.pieces, sweep.places
    low, high, x = np.int64(0), listed, pieces[p, X_TOP]
    while low < high:
        middle = (low + high) >> 1
        if x_of(pieces, places[middle], y) < x:
            low = middle + 1
        else:
            high = middle

    # Go on from the nearest one that is still in the list.
    head, tail = pieces.shape[0] - 2, pieces.shape[0] - 1
    low -= 1
    while low >= 0 and pieces[places[low], STATE] & LISTED == 0:
        low -= 1
    q = pieces[places[low], AFTER] if low >= 0 else pieces[head, AFTER]
    slope = np.float64(pieces[p, X_BOTTOM] - x) / np.float64(pieces[p, BOTTOM] - y)
    while q != tail and not is_left_of(pieces, p, x, slope, q, y):
        q = pieces[q, AFTER]
    while pieces[q, BEFORE] != head and is_left_of(pieces, p, x, slope, pieces[q, BEFORE], y):
        q = pieces[q, BEFORE]
    return np.int64(q)


@bare_helper
def is_left_of(pieces: Int64Array, p: Integer, x: Integer, slope: float, q: Integer, y: Integer) -> bool:
    """Say whether a piece that begins at (x, y) belongs left of another: by place, then by slope, then by its edge's number."""
    other = x_of(pieces, q, y)
    if other != x:
        return bool(x < other)
    steep = np.float64(pieces[q, X_BOTTOM] - pieces[q, X_TOP]) / np.float64(pieces[q, BOTTOM] - pieces[q, TOP])
    return bool(slope < steep or (slope == steep and pieces[p, EDGE] < pieces[q, EDGE]))


@bare_helper
def link(pieces: Int64Array, p: Integer, q: Integer) -> None:
    """Let two pieces be neighbours."""
    pieces[p, AFTER], pieces[q, BEFORE] = q, p


@bare_kernel
def index_pieces(sweep: AreaSweep) -> Integer:
    """List all pieces from left to right, to search among them; return how many there are."""
    pieces, places = sweep.pieces, sweep.places
    head, tail, listed = pieces.shape[0] - 2, pieces.shape[0] - 1, np.int64(0)
    p = pieces[head, AFTER]
    while p != tail:
        places[listed] = p
        listed += 1
        p = pieces[p, AFTER]
    return listed


@bare_helper
def meet_event(sweep: AreaSweep, slot: Integer, y: Integer, row: Integer, listed: Integer, looked: Integer) -> Integer:
    """Let a piece begin, end, or change places with the next; return how many pieces have to be looked at again."""
    pieces, events, p = sweep.pieces, sweep.events, slot >> 1
    if slot & 1 == 1:
        q, before = pieces[p, AFTER], pieces[p, BEFORE]
        after = pieces[q, AFTER]
        link(pieces, before, q)
        link(pieces, q, p)
        link(pieces, p, after)
        drop_event(events, 2 * before + 1)
        drop_event(events, 2 * q + 1)
        looked = look_at(sweep, looked, q)
        return look_at(sweep, look_at(sweep, looked, p), after)
    if pieces[p, STATE] == WAITING:
        after = find_place(sweep, p, y, listed)
        drop_event(events, 2 * pieces[after, BEFORE] + 1)
        link(pieces, pieces[after, BEFORE], p)
        link(pieces, p, after)
        pieces[p, STATE] = LISTED
        if pieces[p, BOTTOM] < ONE:
            put_event(events, slot, pieces[p, BOTTOM])
        looked = look_at(sweep, looked, p)
        return look_at(sweep, looked, after)
    leave_until(sweep, p, y, row)
    pieces[p, STATE] = GONE
    before, after = pieces[p, BEFORE], pieces[p, AFTER]
    drop_event(events, slot + 1)
    drop_event(events, 2 * before + 1)
    link(pieces, before, after)
    return look_at(sweep, look_at(sweep, looked, before), after)


@bare_helper
def test_pair(sweep: AreaSweep, p: Integer, y: Integer) -> None:
    """Put the crossing of a piece with the next one into the heap, or take it out."""
    pieces, slot = sweep.pieces, 2 * p + 1
    q = pieces[p, AFTER]
    if q != pieces.shape[0] - 1 and crosses(pieces, p, q):
        put_event(sweep.events, slot, max(find_crossing(pieces, p, q), y))
    else:
        drop_event(sweep.events, slot)


@bare_helper
def turn_piece(sweep: AreaSweep, p: Integer, y: Integer, row: Integer, side: Integer) -> None:
    """Let a piece be another side from a height on."""
    if sweep.pieces[p, SIDE] != side:
        leave_until(sweep, p, y, row)
        sweep.pieces[p, SIDE] = side


@bare_kernel
def settle(sweep: AreaSweep, looked: Integer, y: Integer, row: Integer, fill_rule: int) -> None:
    """Bring up to date what events at a height have changed: windings, then sides, then crossings.

    Cost    O(pieces whose neighbours or windings have changed).
    """
    pieces, edges = sweep.pieces, sweep.edges
    head, tail, turned = pieces.shape[0] - 2, pieces.shape[0] - 1, np.int64(0)
    for k in range(looked):
        p = sweep.looked[0, k]
        if pieces[p, STATE] == GONE:
            continue

        # Begin where the winding is known, and go on until it is what it was.
        while pieces[p, BEFORE] != head and pieces[pieces[p, BEFORE], WINDING] == UNSET:
            p = pieces[p, BEFORE]
        before = pieces[p, BEFORE]
        winding = np.int64(0)
        if before != head:
            winding = pieces[before, WINDING] + edges[pieces[before, EDGE], DOWN]
        while p != tail and pieces[p, IS_FENCE] == 0 and pieces[p, WINDING] != winding:
            pieces[p, WINDING] = winding
            if pieces[p, STATE] & TURNED == 0:
                pieces[p, STATE] |= TURNED
                sweep.looked[1, turned] = p
                turned += 1
            winding += edges[pieces[p, EDGE], DOWN]
            p = pieces[p, AFTER]
    for k in range(turned):
        p = sweep.looked[1, k]
        pieces[p, STATE] &= ~TURNED
        winding = pieces[p, WINDING]
        side = np.int64(is_inside(fill_rule, winding + edges[pieces[p, EDGE], DOWN])) - np.int64(is_inside(fill_rule, winding))
        turn_piece(sweep, p, y, row, side)
    for k in range(looked):
        p = sweep.looked[0, k]
        if pieces[p, STATE] != GONE:
            pieces[p, STATE] = LISTED
            test_pair(sweep, p, y)
            if pieces[p, BEFORE] != head and pieces[pieces[p, BEFORE], STATE] & LOOK == 0:
                test_pair(sweep, pieces[p, BEFORE], y)


@bare_kernel
def sweep_events(sweep: AreaSweep, count: Integer, row: Integer, fill_rule: int) -> None:
    """Sweep down a row from event to event.

    Cost    O(count) and, for each event, O(log count).
    """
    pieces, places, events = sweep.pieces, sweep.places, sweep.events
    heap, height = events.heap, events.height
    head, tail = pieces.shape[0] - 2, pieces.shape[0] - 1
    before = np.int64(head)
    for p in range(count):
        places[p] = p
        pieces[p, BEFORE] = before
        pieces[before, AFTER] = p
        before = np.int64(p)
    link(pieces, before, tail)
    pieces[head, STATE] = pieces[tail, STATE] = GONE
    listed: Integer = count
    inserted = np.int64(0)
    while heap[0] > 0:
        y = height[heap[1]]
        looked: Integer = np.int64(0)
        while heap[0] > 0 and height[heap[1]] == y:
            slot = heap[1]
            drop_event(events, slot)
            inserted += 1
            looked = meet_event(sweep, slot, y, row, listed, looked)
        settle(sweep, looked, y, row, fill_rule)
        if 8 * inserted > listed + 64:
            listed, inserted = index_pieces(sweep), np.int64(0)


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
    zero, low, high = np.int64(0), side, np.int64(0)
    if count > CORNERS:
        low, high = high, low
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
    edges, order, spans, pieces, events, busy = sweep.edges, sweep.order, sweep.spans, sweep.pieces, sweep.events, sweep.busy
    sums, moments, blocks, has_moments = sweep.sums, sweep.moments, sweep.blocks, sweep.moments.shape[1] > 0
    upper, zero = row << AREA_BITS, np.int64(0)
    lower, side = upper + PIXEL, np.int64(sweep.sums.shape[0] - 2) << LENGTH_BITS
    count, following = list_edges(sweep, count, following, total, upper)
    is_quiet, below = begin_row(sweep, count, following, total, upper)

    # Leave the edges that stand where nothing happens; the others are pieces to be swept, with one to the left of them.
    winding, was_inside, joined, used, p = zero, False, zero, count, zero
    behind, ahead, joined_until = np.int64(-1), NO_COLUMN, np.int64(-1)
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
                first, last, start, until = p, p + 1, low, high
                after = winding + edges[e, DOWN]
                while last < count:
                    low = min(spans[last, 0], spans[last, 1]) >> LENGTH_BITS
                    high = max(spans[last, 0], spans[last, 1]) >> LENGTH_BITS
                    is_apart = low <= ahead
                    while ahead <= high:
                        behind, ahead = ahead, next_busy(busy, ahead + 1)
                    if is_apart and low > behind:
                        break
                    start, until, after = min(start, low), max(until, high), after + edges[order[last], DOWN]
                    last += 1
                is_done = False
                if next_busy(sweep.cornered, start) > until:
                    is_done = leave_crossing(sweep, first, last - first, joined, row, winding, fill_rule)
                if not is_done:
                    joined = join_fence(sweep, joined, joined_until, first - 1, winding)
                    used = join_edges(sweep, first, last, joined, used, row, winding, fill_rule)
                    joined, joined_until = joined + last - first, last - 1
                winding, p = after, last
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

    # Let those wait that begin within the row.
    for k in range(below - following):
        e, first = following + k, used
        used += 1
        top = (edges[e, Y0] - upper) << (LENGTH_BITS - AREA_BITS)
        bottom = ONE if edges[e, Y1] >= lower else (edges[e, Y1] - upper) << (LENGTH_BITS - AREA_BITS)
        x_top, x_bottom = spans[count + k, 0], spans[count + k, 1]
        set_piece(pieces, first, e, top, bottom, x_top, x_bottom)
        if min(x_top, x_bottom) < 0 or max(x_top, x_bottom) > side:
            used = cut_piece(sweep, first, used, row)
        for q in range(first, used):
            put_event(events, 2 * q, pieces[q, TOP])

    # Sweep, and leave what is left.
    sweep_events(sweep, joined, row, fill_rule)
    for p in range(joined):
        if pieces[p, STATE] != GONE:
            leave_until(sweep, np.int64(p), pieces[p, BOTTOM], row)
    for q in range(count, used):
        if pieces[q, STATE] != GONE:
            leave_until(sweep, q, pieces[q, BOTTOM], row)
    busy[:] = 0
    sweep.cornered[:] = 0
    return count, following
