"""A row of an area sweep from event to event: where pieces begin, end and cross.

An event changes the neighbours of a few pieces; from those on, windings are carried to the right until they are what they
were, and sides follow windings. So what no event touches leaves what it would in a quiet row, to the bit. Two pieces cross at a
height that depends on those two alone, and change places at most once: where they end decides.

A fence is a piece to which nothing happens. It stands for all that are left of it, which are not listed, and keeps its winding.

Source: Bentley and Ottmann 1979.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area_edges import DOWN, ONE
from scanspan.raster.area_events import drop_event, put_event
from scanspan.raster.area_pieces import (
    AFTER,
    BEFORE,
    BOTTOM,
    EDGE,
    GONE,
    IS_FENCE,
    LISTED,
    LOOK,
    SIDE,
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
    find_crossing,
    is_inside,
    leave_until,
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
