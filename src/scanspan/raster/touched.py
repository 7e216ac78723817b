"""Polygons to the pixels that they touch: the open pixel meets the open inside of the polygon, under any fill rule, exactly.

So a pixel is touched exactly where the area that is covered of it is above 0. What the polygon has without area, a spike or a
bridge that it goes to and fro, touches nothing; nor does a border that only runs along a pixel's side.

A pixel whose centre is inside is touched; that is what spans.py gives. Any other is touched only if an edge goes through it,
and then mostly it is: an edge that no other edge covers has winding numbers on its sides that differ by one, of which one is
odd, and one is not zero. There remain pixels in which edges lie on each other, and the rules that ask for a sign or for two
turns. There the winding on both sides of each edge is asked for behind every point at which it may change: where the edge
begins, enters the pixel or meets another one. Such points are no points of the grid; triple.py tells what lies beside them.

Price: O(pixels along the edges). Where the rare search is needed, O(edges of the polygon) for each of the points that are
looked at, and for k edges in the pixel k squared looks at whether they meet.

Source: supercover lines, for polygons; Shewchuk 1997 for the exact signs.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import HALF_BITS, halves_sign, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.polygon import CAPACITY, EVEN_ODD, NON_ZERO, is_filled
from scanspan.raster.spans import OWNER, ROW, SPAN_COLUMNS, X_END, X_START, push_span
from scanspan.raster.triple import DIGITS, cross_sign, triple_sign
from scanspan.records import Int32Array, Int64Array, Integer, Sampling

# Columns of edges: the end first in (y, x), the other; 1 where the ring goes down, -1 where it goes up, 0 where it is level;
# and the last pixel in which it was looked for.
UPPER_X, UPPER_Y, LOWER_X, LOWER_Y, TURN, MARK = range(6)
EDGE_COLUMNS = 6

# Columns of the list of the edges in pixels: the edge, and the entry before it in its pixel, -1 for none.
EDGE, BEFORE = range(2)
NONE = np.int64(-1)


@helper_kernel
def gather_edges(
    edges: Int64Array, xy: Int64Array, ring_starts: Int32Array, rings_start: int, rings_end: int, low: Integer, high: Integer
) -> int:
    """Write the edges of some rings that reach between two heights, and return how many."""
    count = 0
    for r in range(rings_start, rings_end):
        first, last = np.int64(ring_starts[r]), np.int64(ring_starts[r + 1])
        for v in range(first, last):
            w = v + 1 if v + 1 < last else first
            goes_down = xy[v, 1] < xy[w, 1] or (xy[v, 1] == xy[w, 1] and xy[v, 0] < xy[w, 0])
            upper, lower = (v, w) if goes_down else (w, v)
            is_point = xy[v, 1] == xy[w, 1] and xy[v, 0] == xy[w, 0]
            if is_point or xy[lower, 1] < low or xy[upper, 1] > high:
                continue
            edges[count, UPPER_X], edges[count, UPPER_Y] = xy[upper, 0], xy[upper, 1]
            edges[count, LOWER_X], edges[count, LOWER_Y] = xy[lower, 0], xy[lower, 1]
            turn = 1 if goes_down else -1
            edges[count, TURN], edges[count, MARK] = 0 if xy[v, 1] == xy[w, 1] else turn, NONE
            count += 1
    return count


@helper_kernel
def column_at(edges: Int64Array, e: Integer, y: Integer, s: int) -> tuple[Integer, Integer]:
    """Return the columns where an edge that is not level crosses a height: rounded down and up."""
    across, down = edges[e, LOWER_X] - edges[e, UPPER_X], edges[e, LOWER_Y] - edges[e, UPPER_Y]
    high, low = product_halves(edges[e, UPPER_X], across, down, y - edges[e, UPPER_Y])
    upper = high // down
    lower = ((high - upper * down) << HALF_BITS) + low
    part = lower // down
    x = (upper << HALF_BITS) + part
    column = x >> s
    is_border = lower == part * down and x == column << s
    return column, column + (np.int64(0) if is_border else np.int64(1))


@helper_kernel
def columns_of(edges: Int64Array, e: Integer, row: Integer, s: int) -> tuple[Integer, Integer]:
    """Return the first column, and the one after the last, of the open pixels of a row that an edge goes through.

    Needs   the edge meets the open row.
    """
    if edges[e, UPPER_Y] == edges[e, LOWER_Y]:
        return edges[e, UPPER_X] >> s, -((-edges[e, LOWER_X]) >> s)
    first, first_end = column_at(edges, e, max(edges[e, UPPER_Y], row << s), s)
    last, last_end = column_at(edges, e, min(edges[e, LOWER_Y], (row + 1) << s), s)
    return min(first, last), max(first_end, last_end)


@helper_kernel
def line_of(edges: Int64Array, e: Integer, x: Integer, y: Integer) -> tuple[Integer, Integer, Integer]:
    """Return the line a x + b y + c of an edge, seen from a point of the grid; it is positive right of the edge.

    Needs   the edge meets the pixel that begins at the point, which keeps c below 2^59.
    """
    a, b = edges[e, LOWER_Y] - edges[e, UPPER_Y], edges[e, UPPER_X] - edges[e, LOWER_X]
    high, low = product_halves(a, b, x - edges[e, UPPER_X], y - edges[e, UPPER_Y])
    return a, b, (high << HALF_BITS) + low


@helper_kernel
def may_meet(edges: Int64Array, e: Integer, other: Integer) -> bool:
    """Say whether the boxes of two edges meet."""
    if edges[e, UPPER_Y] > edges[other, LOWER_Y] or edges[other, UPPER_Y] > edges[e, LOWER_Y]:
        return False
    a, b, c, d = edges[e, UPPER_X], edges[e, LOWER_X], edges[other, UPPER_X], edges[other, LOWER_X]
    return bool(min(a, b) <= max(c, d) and min(c, d) <= max(a, b))


@helper_kernel
def side_of(edges: Int64Array, e: Integer, x: Integer, y: Integer) -> Integer:
    """Return on which side of an edge's line a point of the grid lies: 1 right of it, -1 left, 0 on it."""
    a, b = edges[e, LOWER_Y] - edges[e, UPPER_Y], edges[e, UPPER_X] - edges[e, LOWER_X]
    high, low = product_halves(a, b, x - edges[e, UPPER_X], y - edges[e, UPPER_Y])
    return halves_sign(high, low)


@helper_kernel
def is_same_line(edges: Int64Array, e: Integer, other: Integer) -> bool:
    """Say whether two edges lie on one line."""
    if side_of(edges, e, edges[other, UPPER_X], edges[other, UPPER_Y]) != 0:
        return False
    return bool(side_of(edges, e, edges[other, LOWER_X], edges[other, LOWER_Y]) == 0)


@helper_kernel
def push_event(events: Int64Array, listed: int, a: Integer, b: Integer, c: Integer) -> int:
    """Write a line and return how many there are."""
    events[listed, 0], events[listed, 1], events[listed, 2] = a, b, c
    return listed + 1


@helper_kernel
def list_events(
    edges: Int64Array, e: Integer, members: Int64Array, count: int, row: Integer, column: Integer, s: int, events: Int64Array
) -> int:
    """Write lines that cut an edge wherever the winding beside it may change within a pixel, and return how many.

    Shapes  events: (2 count + 5, 3) lines, seen from the pixel's corner: its sides, the lines of the members that meet the
            edge, the ends of those that lie on its line, and its own upper end. That is left out where just one other edge
            meets it there and ends: what is beside them is the same, and has been seen from that one.
    """
    x, y, side, is_level = column << s, row << s, np.int64(1) << s, edges[e, TURN] == 0
    one, zero = np.int64(1), np.int64(0)
    across, down = (one, zero) if is_level else (zero, one)
    upper_x, upper_y, lower_x, lower_y = edges[e, UPPER_X], edges[e, UPPER_Y], edges[e, LOWER_X], edges[e, LOWER_Y]
    listed = push_event(events, 0, one, zero, zero)
    listed = push_event(events, listed, one, zero, -side)
    listed = push_event(events, listed, zero, one, zero)
    listed = push_event(events, listed, zero, one, -side)
    met, ending = 0, 0
    for k in range(count):
        other = members[k]
        if other == e or not may_meet(edges, e, other):
            continue
        begin, end = edges[other, UPPER_X], edges[other, UPPER_Y]
        upper, lower = side_of(edges, e, begin, end), side_of(edges, e, edges[other, LOWER_X], edges[other, LOWER_Y])
        if upper == 0 and lower == 0:
            listed = push_event(events, listed, across, down, across * (x - begin) + down * (y - end))
            begin, end = edges[other, LOWER_X], edges[other, LOWER_Y]
            listed = push_event(events, listed, across, down, across * (x - begin) + down * (y - end))
            continue
        before, behind = side_of(edges, other, upper_x, upper_y), side_of(edges, other, lower_x, lower_y)
        if upper * lower > 0 or before * behind > 0:
            continue
        if before == 0:
            met, ending = met + 1, ending + int(edges[other, LOWER_X] == upper_x and edges[other, LOWER_Y] == upper_y)
        elif behind != 0:
            a, b, c = line_of(edges, other, x, y)
            listed = push_event(events, listed, a, b, c)
    if met != 1 or ending != 1:
        listed = push_event(events, listed, across, down, across * (x - upper_x) + down * (y - upper_y))
    return listed


@helper_kernel
def is_touched_behind(
    edges: Int64Array, total: int, e: Integer, event: Int64Array, row: Integer, column: Integer, mark: Integer, fill_rule: int,
    s: int, digits: Int64Array,
) -> bool:  # fmt: skip
    """Say whether the inside lies on a side of an edge, right behind the point at which another line cuts it.

    Behind is further down, or right where the edge is level. False where that is no longer in the open pixel or on the edge.

    Needs   edges that meet the open pixel carry the mark.
    """
    x, y, side, is_level = column << s, row << s, np.int64(1) << s, edges[e, TURN] == 0
    a, b, c = line_of(edges, e, x, y)
    p, q, r = event[0], event[1], event[2]
    turn = cross_sign(a, b, p, q)
    if turn == 0:
        return False
    across, down, one, zero = -b, a, np.int64(1), np.int64(0)

    # Leave what is not in the pixel, nor on the edge.
    for k in range(4):
        way = (one if k & 1 == 0 else -one) if k < 2 else zero
        fall = (one if k & 1 == 0 else -one) if k >= 2 else zero
        place = turn * triple_sign(a, b, c, p, q, r, way, fall, side if k & 1 else zero, digits)
        if place < 0 or (place == 0 and way * across + fall * down <= 0):
            return False
    way, fall = (one, zero) if is_level else (zero, one)
    upper = way * (x - edges[e, UPPER_X]) + fall * (y - edges[e, UPPER_Y])
    lower = way * (x - edges[e, LOWER_X]) + fall * (y - edges[e, LOWER_Y])
    if turn * triple_sign(a, b, c, p, q, r, way, fall, upper, digits) < 0:
        return False
    if turn * triple_sign(a, b, c, p, q, r, way, fall, lower, digits) >= 0:
        return False

    # Add up the turns of all edges that lie left of the two places beside the edge; where it is level, above it and below it.
    crossings = winding = other_crossings = other_winding = zero
    for h in range(total):
        top, bottom = edges[h, UPPER_Y], edges[h, LOWER_Y]
        if edges[h, TURN] == 0 or top >= y + side or bottom <= y:
            continue
        if is_level:
            here, there = top < edges[e, UPPER_Y] <= bottom, top <= edges[e, UPPER_Y] < bottom
        else:
            here = top <= y or turn * triple_sign(a, b, c, p, q, r, zero, one, y - top, digits) >= 0
            here = here and (bottom >= y + side or turn * triple_sign(a, b, c, p, q, r, zero, one, y - bottom, digits) < 0)
            there = here
        if not (here or there):
            continue

        # An edge that does not meet the pixel is left of it or right of it.
        if edges[h, MARK] == mark:
            u, v, w = line_of(edges, h, x, y)
            place = turn * triple_sign(a, b, c, p, q, r, u, v, w, digits)
            if place == 0:
                place = one if is_level else cross_sign(u, v, -down, across)
            if place < 0:
                continue
            here = here and place > 0
        elif columns_of(edges, h, row, s)[0] > column:
            continue
        crossings, winding = crossings + np.int64(here), winding + np.int64(here) * edges[h, TURN]
        other_crossings, other_winding = other_crossings + np.int64(there), other_winding + np.int64(there) * edges[h, TURN]
    return is_filled(fill_rule, crossings, winding) or is_filled(fill_rule, other_crossings, other_winding)


@kernel
def is_touched(
    edges: Int64Array, total: int, members: Int64Array, count: int, row: Integer, column: Integer, mark: Integer,
    fill_rule: int, s: int, events: Int64Array, digits: Int64Array,
) -> bool:  # fmt: skip
    """Say whether a pixel whose centre is outside, and which some edges go through, holds some of the inside.

    Shapes  members: (count,) the edges that go through.
    """
    # An edge on a line of its own divides odd from even, and zero from not zero.
    if fill_rule in (EVEN_ODD, NON_ZERO):
        for k in range(count):
            is_alone = True
            for m in range(count):
                if m != k and may_meet(edges, members[k], members[m]) and is_same_line(edges, members[k], members[m]):
                    is_alone = False
                    break
            if is_alone:
                return True

    # Else look at both sides of every edge, wherever they may change.
    for k in range(count):
        edges[members[k], MARK] = mark
    for k in range(count):
        listed = list_events(edges, members[k], members, count, row, column, s, events)
        for m in range(listed):
            if is_touched_behind(edges, total, members[k], events[m], row, column, mark, fill_rule, s, digits):
                return True
    return False


@helper_kernel
def grow_rows(rows: Int64Array, needed: Integer) -> Int64Array:
    """Return a copy with room for at least so many rows, and twice as many as there were."""
    larger = np.empty((max(2 * rows.shape[0], needed), rows.shape[1]), np.int64)
    for n in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            larger[n, k] = rows[n, k]
    return larger


@helper_kernel
def list_pixels(
    edges: Int64Array, e: Integer, owner: Integer, stamps: Int32Array, heads: Int32Array, entries: Int64Array,
    pixels: Int64Array, counts: Int64Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Enter an edge into the lists of the pixels that it goes through, but for those whose centre is inside.

    Shapes  stamps, heads: (h, w), of the rectangle; entries, pixels: with room for all; counts: (2,), how many there are.
    """
    s, x_start, y_start = sampling.subpixel_bits, np.int64(sampling.x_start), np.int64(sampling.y_start)
    upper_y, lower_y, is_level = edges[e, UPPER_Y], edges[e, LOWER_Y], edges[e, TURN] == 0
    first, last = max(upper_y >> s, y_start), min(((lower_y - 1) >> s) + 1, np.int64(sampling.y_end))
    upper, upper_end = edges[e, UPPER_X] >> s, -((-edges[e, LOWER_X]) >> s)
    if first < last and not is_level:
        upper, upper_end = column_at(edges, e, max(upper_y, first << s), s)
    for row in range(first, last):
        # Go on from where it crosses the row's upper border to where it crosses the lower one.
        lower, lower_end = upper, upper_end
        if not is_level:
            lower, lower_end = column_at(edges, e, min(lower_y, (np.int64(row) + 1) << s), s)
        start, end = max(min(upper, lower), x_start), min(max(upper_end, lower_end), np.int64(sampling.x_end))
        upper, upper_end = lower, lower_end

        # Enter it into the lists of the pixels between.
        stamp, head = stamps[row - y_start], heads[row - y_start]
        for column in range(start, end):
            i = column - x_start
            if stamp[i] == 2 * owner + 2:
                continue
            if stamp[i] != 2 * owner + 1:
                stamp[i], head[i] = 2 * owner + 1, -1
                pixels[counts[1], 0], pixels[counts[1], 1] = row, column
                counts[1] += 1
            entries[counts[0], EDGE], entries[counts[0], BEFORE] = e, head[i]
            head[i] = counts[0]
            counts[0] += 1


@kernel
def touch_spans(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int, sampling: Sampling, inside: Int32Array
) -> Int32Array:
    """Return the spans of the pixels that polygons touch, (N, SPAN_COLUMNS), by polygon; no two of one overlap.

    Shapes  as for sweep_polygons; inside: (M, SPAN_COLUMNS), what cut_spans has returned for the same.
    Units   sub-pixels; sampling's rectangle in pixels.
    Rule    fill_rule, one of polygon.py.
    Needs   coordinates within 2^24 px; the rectangle is part of an image; below 2^30 polygons.
    Cost    O(pixels along the edges + those within); memory: three numbers for each pixel of the rectangle.
    """
    # Make room for the largest polygon.
    polygons, most, s = polygon_rings.shape[0] - 1, np.int64(0), sampling.subpixel_bits
    for p in range(polygons):
        most = max(most, np.int64(ring_starts[polygon_rings[p + 1]]) - np.int64(ring_starts[polygon_rings[p]]))
    width, height = np.int64(sampling.x_end - sampling.x_start), np.int64(sampling.y_end - sampling.y_start)
    stamps, heads = np.zeros((height, width), np.int32), np.empty((height, width), np.int32)
    edges, digits, counts = np.empty((most, EDGE_COLUMNS), np.int64), np.empty(DIGITS, np.int64), np.empty(2, np.int64)
    entries, pixels = np.empty((CAPACITY, 2), np.int64), np.empty((CAPACITY, 2), np.int64)
    members, events = np.empty(CAPACITY, np.int64), np.empty((2 * CAPACITY + 5, 3), np.int64)
    spans, taken, mark = np.empty((CAPACITY, SPAN_COLUMNS), np.int32), 0, np.int64(0)
    kept: Integer = np.int64(0)
    divides = fill_rule in (EVEN_ODD, NON_ZERO)
    for p in range(polygons):
        # Keep the pixels whose centres are inside.
        while taken < inside.shape[0] and inside[taken, OWNER] == p:
            y, x_start, x_end = inside[taken, ROW], inside[taken, X_START], inside[taken, X_END]
            stamps[y - sampling.y_start, x_start - sampling.x_start : x_end - sampling.x_start] = 2 * p + 2
            spans, kept = push_span(spans, kept, p, y, x_start, x_end)
            taken += 1

        # Find the pixels that its edges go through.
        counts[0] = counts[1] = 0
        low, high = np.int64(sampling.y_start) << s, np.int64(sampling.y_end) << s
        total = gather_edges(edges, xy, ring_starts, polygon_rings[p], polygon_rings[p + 1], low, high)
        for e in range(total):
            across = (max(edges[e, UPPER_X], edges[e, LOWER_X]) >> s) - (min(edges[e, UPPER_X], edges[e, LOWER_X]) >> s)
            down = (edges[e, LOWER_Y] >> s) - (edges[e, UPPER_Y] >> s)
            needed = counts[0] + min(across + 1, width) + min(down + 1, height)
            if needed > entries.shape[0]:
                entries, pixels = grow_rows(entries, needed), grow_rows(pixels, needed)
            list_pixels(edges, e, p, stamps, heads, entries, pixels, counts, sampling)

        # Keep those that hold some of the inside.
        for n in range(counts[1]):
            row, column = pixels[n, 0], pixels[n, 1]
            count, k = 0, np.int64(heads[row - sampling.y_start, column - sampling.x_start])
            is_simple = divides and entries[k, BEFORE] < 0
            while k >= 0 and not is_simple:
                if count == members.shape[0]:
                    members = grow_rows(members.reshape(-1, 1), np.int64(0)).reshape(-1)
                    events = np.empty((2 * members.shape[0] + 5, 3), np.int64)
                members[count] = entries[k, EDGE]
                count, k = count + 1, entries[k, BEFORE]
            mark += 1
            if not is_simple and not is_touched(edges, total, members, count, row, column, mark, fill_rule, s, events, digits):
                continue
            if kept > 0 and spans[kept - 1, OWNER] == p and spans[kept - 1, ROW] == row and spans[kept - 1, X_END] == column:
                spans[kept - 1, X_END] += np.int32(1)
            else:
                spans, kept = push_span(spans, kept, p, row, column, column + 1)
    return spans[:kept].copy()
