"""The pieces of a row of an area sweep: the edges that cross it, in order, and what each is cut to.

The list of edges is kept up from row to row; which of several edges that meet in one point comes first is decided by their
slopes, then by their numbers: by nothing that depends on the rows before, so that bands of rows give the same bits. A piece is
an edge within the row and between the image's sides; outside it goes down along the side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area_convex import BOX
from scanspan.raster.area_edges import (
    BLOCK_BITS,
    BLOCK_MASK,
    EDGE_COLUMNS,
    LENGTH_BITS,
    X0,
    X1,
    Y0,
    Y1,
    X,
    leave_piece,
    start_edge,
    y_at,
)
from scanspan.raster.area_events import Events, make_events
from scanspan.raster.polygon import is_filled
from scanspan.records import Int64Array, Integer

# Columns of a piece: what is left of an edge in a row between the image's sides, from TOP to BOTTOM below the row's upper
# border. SIDE is 1 for a left border of the inside, -1 for a right one, since SINCE; WINDING is that left of it. BEFORE and
# AFTER are its neighbours in the list; STATE says whether it is in there, and what has to be looked at again.
TOP, BOTTOM, X_TOP, X_BOTTOM, EDGE, SIDE, SINCE, WINDING, BEFORE, AFTER, STATE, IS_FENCE = range(12)
PIECE_COLUMNS = 12
WAITING, LISTED, GONE = range(3)
LOOK, TURNED = 4, 8  # bits of STATE: its neighbours have changed, its winding has
CORNERS = 32  # within a row that are looked at one by one
NO_COLUMN = np.int64(1 << 40)
UNSET = np.int64(-(1 << 40))


class AreaSweep(NamedTuple):
    """The edges of a polygon, the list of those in a row, and room to sweep it."""

    edges: Int64Array  # (N, EDGE_COLUMNS)
    order: Int64Array  # (N,) edges from left to right
    spans: Int64Array  # (N, 4) where they are at the upper and the lower border of the row, within the image and anywhere
    busy: Int64Array  # (B,) the columns of a row in which something happens, a bit each
    cornered: Int64Array  # (B,) those in which edges begin, end, or go beyond the image
    corners: Int64Array  # (CORNERS, 3) of a row: x, y, and by how much they change the windings to their right
    pieces: Int64Array  # (P, PIECE_COLUMNS) those at the row's upper border first; the last two are the ends of the list
    looked: Int64Array  # (2, P) pieces whose neighbours or windings have changed at a height
    started: Int64Array  # (2, N) edges that begin, and room to sort them
    places: Int64Array  # (P,) pieces from left to right, to search in
    events: Events
    sums: Int64Array  # (W + 2,) of a row
    moments: Int64Array  # (3, W + 2) of a row, or (3, 0) where none are kept
    blocks: Int64Array  # (B,) where they are not 0
    box: Int64Array  # (BOX,) sums of the rows of a convex polygon
    extents: Int64Array  # (BOX, 2) the columns of each in which something was left


def make_sweep(most: int, width: int, has_moments: bool = False) -> AreaSweep:
    """Return room for polygons of so many edges in rows of so many pixels, with or without moments."""
    count = 3 * most + 2  # an edge may go along one side of the image, through it, and along the other
    return AreaSweep(
        edges=np.empty((most, EDGE_COLUMNS), np.int64),
        order=np.empty(most, np.int64),
        spans=np.empty((most, 4), np.int64),
        busy=np.zeros(((width + 1) >> int(BLOCK_BITS)) + 1, np.int64),
        cornered=np.zeros(((width + 1) >> int(BLOCK_BITS)) + 1, np.int64),
        corners=np.empty((CORNERS, 3), np.int64),
        pieces=np.empty((count, PIECE_COLUMNS), np.int64),
        looked=np.empty((2, count), np.int64),
        started=np.empty((2, most), np.int64),
        places=np.empty(count, np.int64),
        events=make_events(2 * count),
        sums=np.zeros(width + 2, np.int64),
        moments=np.zeros((3, width + 2 if has_moments else 0), np.int64),
        blocks=np.zeros(((width + 1) >> int(BLOCK_BITS)) + 1, np.int64),
        box=np.zeros(BOX, np.int64),
        extents=np.full((BOX // 2, 2), (BOX, -1), np.int64),
    )


@bare_helper
def stands_left(edges: Int64Array, e: Integer, f: Integer) -> bool:
    """Say whether an edge stands left of another at the upper border of a row: by place, then by slope, then by number."""
    if edges[e, X] != edges[f, X]:
        return bool(edges[e, X] < edges[f, X])
    slope = np.float64(edges[e, X1] - edges[e, X0]) / np.float64(edges[e, Y1] - edges[e, Y0])
    other = np.float64(edges[f, X1] - edges[f, X0]) / np.float64(edges[f, Y1] - edges[f, Y0])
    return bool(slope < other or (slope == other and e < f))


@bare_kernel
def insert_edges(sweep: AreaSweep, count: Integer, first: Integer, last: Integer, upper: Integer) -> Integer:
    """Insert the edges first to last, but for those that have ended, into a list of so many; return how many there are then.

    Cost    O(list + k log k) for k edges: they are sorted by merging, then merged into the list from its end.
    """
    edges, order = sweep.edges, sweep.order
    room, started = sweep.started, 0
    for e in range(first, last):
        if edges[e, Y1] > upper:
            start_edge(edges, e, upper)
            room[0, started] = e
            started += 1
    side, width = 0, 1
    while width < started:
        for low in range(0, started, 2 * width):
            middle, high = min(low + width, started), min(low + 2 * width, started)
            i, j = low, middle
            for k in range(low, high):
                from_left = bool(i < middle)
                if from_left and j < high:
                    from_left = not stands_left(edges, room[side, j], room[side, i])
                room[1 - side, k] = room[side, i if from_left else j]
                i, j = (i + 1, j) if from_left else (i, j + 1)
        side, width = 1 - side, 2 * width

    # Merge them into the list.
    m, j = count - 1, started - 1
    while j >= 0:
        if m >= 0 and stands_left(edges, room[side, j], order[m]):
            order[m + j + 1] = order[m]
            m -= 1
        else:
            order[m + j + 1] = room[side, j]
            j -= 1
    return count + started


@bare_helper
def list_edges(sweep: AreaSweep, count: Integer, following: Integer, total: Integer, upper: Integer) -> tuple[Integer, Integer]:
    """Take out what has ended above a row, put in what begins at its upper border, and put all into order.

    Returns the list's length, and the first edge that begins further down.
    """
    edges, order = sweep.edges, sweep.order
    kept: Integer = np.int64(0)
    for k in range(count):
        e = order[k]
        if edges[e, Y1] > upper:
            # Lines that meet at the border may still stand as they did above it.
            m = kept
            while m > 0 and edges[order[m - 1], X] >= edges[e, X] and stands_left(edges, e, order[m - 1]):
                order[m] = order[m - 1]
                m -= 1
            order[m] = e
            kept += 1
    first = following
    while following < total and edges[following, Y0] <= upper:
        following += 1
    if following > first:
        kept = insert_edges(sweep, kept, first, following, upper)
    return kept, following


@bare_helper
def set_piece(
    pieces: Int64Array, p: Integer, e: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer
) -> None:
    """Fill a piece that is in no list yet."""
    pieces[p, TOP], pieces[p, BOTTOM], pieces[p, X_TOP], pieces[p, X_BOTTOM] = top, bottom, x_top, x_bottom
    pieces[p, EDGE], pieces[p, SIDE], pieces[p, SINCE], pieces[p, WINDING], pieces[p, STATE] = e, 0, top, UNSET, WAITING
    pieces[p, IS_FENCE] = 0


@bare_kernel
def cut_piece(sweep: AreaSweep, p: Integer, count: Integer, row: Integer) -> Integer:
    """Cut a piece that reaches beyond a side of the image: out there it goes down along that side. Return the new count.

    The part that begins first stays piece p; the others come behind all pieces and wait.
    """
    edges, pieces = sweep.edges, sweep.pieces
    e, top, bottom = pieces[p, EDGE], pieces[p, TOP], pieces[p, BOTTOM]
    x_top, x_bottom, upper = pieces[p, X_TOP], pieces[p, X_BOTTOM], row << LENGTH_BITS
    width = np.int64(sweep.sums.shape[0] - 2)
    side, zero = width << LENGTH_BITS, np.int64(0)
    low, high = min(max(x_top, zero), side), min(max(x_bottom, zero), side)
    if low == high and (max(x_top, x_bottom) <= 0 or min(x_top, x_bottom) >= side):
        set_piece(pieces, p, e, top, bottom, low, high)
        return count

    # Find the heights at which it comes in and goes out.
    enters = leaves = top
    if low != x_top:
        enters = min(max(y_at(edges, e, zero if x_top < 0 else width) - upper, top), bottom)
    leaves = bottom
    if high != x_bottom:
        leaves = min(max(y_at(edges, e, zero if x_bottom < 0 else width) - upper, enters), bottom)

    # Keep the parts that have a height.
    part = p
    if enters > top:
        set_piece(pieces, part, e, top, enters, low, low)
        part, count = count, count + 1
    if leaves > enters:
        set_piece(pieces, part, e, enters, leaves, low, high)
        part, count = count, count + 1
    if bottom > leaves:
        set_piece(pieces, part, e, leaves, bottom, high, high)
        part, count = count, count + 1
    return count - 1


@bare_helper
def mark_columns(busy: Int64Array, x_top: Integer, x_bottom: Integer) -> None:
    """Mark the columns between two places as busy."""
    low, high = min(x_top, x_bottom) >> LENGTH_BITS, max(x_top, x_bottom) >> LENGTH_BITS
    for b in range(low >> BLOCK_BITS, (high >> BLOCK_BITS) + 1):
        first, last = max(low - (b << BLOCK_BITS), np.int64(0)), min(high - (b << BLOCK_BITS), BLOCK_MASK)
        busy[b] |= (np.int64(2) << last) - (np.int64(1) << first)


@bare_helper
def next_busy(busy: Int64Array, column: Integer) -> Integer:
    """Return the first busy column from one on, or one that is beyond all."""
    b = column >> BLOCK_BITS
    if b >= busy.shape[0]:
        return NO_COLUMN
    bits, column = busy[b] >> (column & BLOCK_MASK), column
    while bits == 0:
        b += 1
        if b >= busy.shape[0]:
            return NO_COLUMN
        bits, column = busy[b], b << BLOCK_BITS
    while bits & 1 == 0:
        bits, column = bits >> 1, column + 1
    return column


@bare_helper
def x_of(pieces: Int64Array, p: Integer, y: Integer) -> Integer:
    """Return where a piece is at a height in its row: exactly at its ends, between them in float64."""
    top, bottom, x_top, x_bottom = pieces[p, TOP], pieces[p, BOTTOM], pieces[p, X_TOP], pieces[p, X_BOTTOM]
    if y <= top:
        return np.int64(x_top)
    if y >= bottom:
        return np.int64(x_bottom)
    share = np.float64(y - top) / np.float64(bottom - top)
    return np.int64(x_top + np.int64(np.rint(share * np.float64(x_bottom - x_top))))


@bare_helper
def is_inside(fill_rule: int, winding: Integer) -> bool:
    """Say whether a place is inside by its winding; how many edges were passed is as odd as that."""
    return is_filled(fill_rule, winding & 1, winding)


@bare_helper
def leave_until(sweep: AreaSweep, p: Integer, y: Integer, row: Integer) -> None:
    """Leave what a piece covers down to a height, since it became the side that it is."""
    pieces = sweep.pieces
    since, side = pieces[p, SINCE], pieces[p, SIDE]
    if side != 0 and y > since:
        above, below = x_of(pieces, p, since), x_of(pieces, p, y)
        leave_piece(sweep.sums, sweep.moments, sweep.blocks, sweep.edges, pieces[p, EDGE], row, since, y, above, below, side)
    pieces[p, SINCE] = y


@bare_helper
def crosses(pieces: Int64Array, p: Integer, q: Integer) -> bool:
    """Say whether a piece crosses another that stands right of it, before either ends."""
    end = min(pieces[p, BOTTOM], pieces[q, BOTTOM])
    return bool(x_of(pieces, p, end) > x_of(pieces, q, end))


@bare_helper
def find_crossing(pieces: Int64Array, p: Integer, q: Integer) -> Integer:
    """Return the height at which two pieces cross: the same, whenever it is asked for.

    Needs   that they cross.
    """
    top, end = max(pieces[p, TOP], pieces[q, TOP]), min(pieces[p, BOTTOM], pieces[q, BOTTOM])
    ahead = np.float64(max(x_of(pieces, q, top) - x_of(pieces, p, top), np.int64(0)))
    behind = np.float64(x_of(pieces, p, end) - x_of(pieces, q, end))
    return np.int64(min(top + np.int64(np.rint(np.float64(end - top) * (ahead / (ahead + behind)))), end))
