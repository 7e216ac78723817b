"""Polygons to trapezoids: what every algorithm can draw, with the polygon's own edges left and right, uncut.

A trapezoid is a left and a right edge of a polygon, restricted to rows of samples. Every algorithm draws what is bounded by at
most three lines, so all of them can draw polygons that are concave, cross themselves or have holes, and with the same bits.
Points where edges cross are not on the sub-pixel grid and are never computed: a row knows in which order its edges stand, and
where that changes, one trapezoid ends and another begins. Neighbours share an edge's own line, so nothing is lost or hit twice.

The sweep is that of active_edges.py, for one polygon at a time: an edge table in buckets by first row, an active edge list in
order of x, and the verbs insert, scan, step and sort. Scanning pairs the edges of a row by the fill rule. The pair of the row
above is looked up at its left edge, and its trapezoid becomes a row longer. Where only pixels are wanted, and no lines,
crossings.py finds the same spans some ten times as fast.

Rule: top-left. An edge crosses the rows from its upper end, included, to its lower end, excluded; a sample on an edge lies to
the right of it. Price: O(edges in a row) for every row, though only the rows in which the order changes could matter.

Source: the lectures' scan-line polygon fill; Foley, van Dam, Feiner and Hughes 1990, section 3.6, for even-odd and non-zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.geometry.fill_rule import EVEN_ODD as EVEN_ODD
from scanspan.geometry.fill_rule import NON_ZERO as NON_ZERO
from scanspan.geometry.fill_rule import is_filled as is_filled
from scanspan.geometry.fixed_point import product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.active_edges import sort_by_x
from scanspan.raster.edge import edge_start
from scanspan.raster.edge_walk import start_crossing, step_crossing
from scanspan.raster.setup import first_sample
from scanspan.records import Int32Array, Int64Array, Integer, Sampling

# Columns of EdgeTable.edges: those of start_crossing, counted from the rectangle's left side; a and b of the edge value, which
# grows to the right; first row, row after the last; 1 where the ring goes down, else -1; both ends.
CROSSING, REST, STEP, STEP_REST, A, B, ROW, ROW_END, WINDING, UPPER_X, UPPER_Y, LOWER_X, LOWER_Y = range(13)

# The pair whose left edge it is: its right edge, the last row in which they were a pair, and their trapezoid.
RIGHT, PAIRED, TRAPEZOID = range(13, 16)
EDGE_COLUMNS = 16  # 128 bytes, two lines of the cache

NONE = np.int64(-1)
CAPACITY = 16  # trapezoids that there is room for at first


class EdgeTable(NamedTuple):
    """The edges of one polygon, and their numbers in buckets by the row in which they start."""

    edges: Int64Array  # (N, EDGE_COLUMNS)
    numbers: Int64Array  # (N,)
    starts: Int64Array  # (rows + 2,) bucket j of numbers is starts[j] to starts[j + 1]; bucket 0 is the polygon's first row


class ActiveList(NamedTuple):
    """The active edge list: numbers of the edges that cross the present row."""

    order: Int64Array  # (N,) by x
    x: Int64Array  # (N,) of an edge: the first column whose sample is on it or right of it, held to the rectangle
    starting: Int64Array  # (2, N) edges that start in a row, and room to sort them


class Trapezoids(NamedTuple):
    """What has been cut, with room for more."""

    owner: Int32Array  # (C,) polygons
    lines: Int64Array  # (C, 2, 4) left and right line: a, b, q_x, q_y
    limits: Int64Array  # (C, 4) samples at the ends: x_low, x_high, y_low, y_high


@helper_kernel
def edge_rows(xy: Int64Array, v: Integer, w: Integer, sampling: Sampling) -> tuple[Integer, Integer, Integer, Integer]:
    """Return the upper and the lower of two points, and the rows of the rectangle that the edge between them crosses.

    From the first of them to the one after the last. A level edge crosses none.
    """
    goes_down = xy[v, 1] < xy[w, 1]
    upper = v if goes_down else w
    lower = w if goes_down else v
    row = max(first_sample(xy[upper, 1], sampling.sample_y, sampling.subpixel_bits), sampling.y_start)
    row_end = min(first_sample(xy[lower, 1], sampling.sample_y, sampling.subpixel_bits), sampling.y_end)
    return upper, lower, row, row_end


@helper_kernel
def edge_line(
    xy: Int64Array, upper: Integer, lower: Integer, x_start: Integer, row: Integer, sampling: Sampling
) -> tuple[Integer, Integer, Integer]:
    """Return (a, b, f) of the edge from an upper to a lower point: its value at a sample, exactly, and how that steps.

    At the sample of column x_start in a row the value is f; it grows by a > 0 to the right, and by b from row to row.
    """
    s = sampling.subpixel_bits
    a, b = xy[lower, 1] - xy[upper, 1], xy[upper, 0] - xy[lower, 0]
    x, y = (np.int64(x_start) << s) + sampling.sample_x, (row << s) + sampling.sample_y
    high, low = product_halves(a, b, x - xy[lower, 0], y - xy[lower, 1])
    return a, b, edge_start(high, low, np.int64(0), s)


@helper_kernel
def gather_edges(
    table: EdgeTable, count: Integer, xy: Int64Array, first: Integer, last: Integer, sampling: Sampling
) -> Integer:  # fmt: skip
    """Add the edges of one ring, points first to last, that cross a row; return how many edges there are now."""
    edges = table.edges
    for v in range(first, last):
        w = v + 1 if v + 1 < last else first
        upper, lower, row, row_end = edge_rows(xy, v, w, sampling)
        if row >= row_end:
            continue
        a, b, f = edge_line(xy, upper, lower, sampling.x_start, row, sampling)
        crossing, rest, step, step_rest = start_crossing(f, a, b)

        # Fill its record; it is the left edge of no pair yet.
        edges[count, CROSSING], edges[count, REST] = crossing, rest
        edges[count, STEP], edges[count, STEP_REST], edges[count, A], edges[count, B] = step, step_rest, a, b
        edges[count, ROW], edges[count, ROW_END], edges[count, WINDING] = row, row_end, 1 if upper == v else -1
        edges[count, UPPER_X], edges[count, UPPER_Y] = xy[upper, 0], xy[upper, 1]
        edges[count, LOWER_X], edges[count, LOWER_Y] = xy[lower, 0], xy[lower, 1]
        edges[count, RIGHT], edges[count, PAIRED], edges[count, TRAPEZOID] = NONE, NONE, NONE
        count += 1
    return count


@helper_kernel
def sort_into_rows(table: EdgeTable, count: Integer) -> tuple[Integer, Integer]:
    """Put the edges into buckets by first row, a counting sort; return the first row and the row after the last."""
    edges, numbers, starts = table.edges, table.numbers, table.starts
    row, row_end = edges[0, ROW], edges[0, ROW_END]
    for e in range(1, count):
        row, row_end = min(row, edges[e, ROW]), max(row_end, edges[e, ROW_END])

    # Count how many start in every row, and add up; one place further on, so that filling the buckets moves it there.
    rows = row_end - row
    starts[: rows + 2] = 0
    for e in range(count):
        starts[edges[e, ROW] - row + 2] += 1
    for j in range(rows):
        starts[j + 2] += starts[j + 1]

    # Fill the buckets.
    for e in range(count):
        j = edges[e, ROW] - row
        numbers[starts[j + 1]] = e
        starts[j + 1] += 1
    return row, row_end


@helper_kernel
def crossing_below(edges: Int64Array, e: Integer, rows: Integer) -> Integer:
    """Return where an edge crosses the row so many rows below the present one."""
    a: Integer = edges[e, A]
    f: Integer = edges[e, REST] - a * edges[e, CROSSING] + rows * edges[e, B]
    return -(f // a)


@helper_kernel
def stands_right(edges: Int64Array, x: Int64Array, e: Integer, other: Integer, y: Integer) -> bool:
    """Say whether an edge stands right of another in row y.

    Those that cross the row at one column, as all do that start at one corner, stand as in the last row that both cross. That
    decides no sample. It spares pairs of a single row.
    """
    if x[e] != x[other]:
        return bool(x[e] > x[other])
    rows = min(edges[e, ROW_END], edges[other, ROW_END]) - 1 - y
    return bool(crossing_below(edges, e, rows) > crossing_below(edges, other, rows))


@helper_kernel
def sort_starting(table: EdgeTable, active: ActiveList, started: Integer, y: Integer) -> int:
    """Sort the edges that start in a row, by merging; return which row of `starting` they are in."""
    edges, x, starting = table.edges, active.x, active.starting
    side, width = 0, 1
    while width < started:
        for low in range(0, started, 2 * width):
            middle, high = min(low + width, started), min(low + 2 * width, started)
            i, j = low, middle
            for k in range(low, high):
                from_left = i < middle
                if from_left and j < high:
                    from_left = not stands_right(edges, x, starting[side, i], starting[side, j], y)
                starting[1 - side, k] = starting[side, i if from_left else j]
                i, j = (i + 1, j) if from_left else (i, j + 1)
        side, width = 1 - side, 2 * width
    return side


@helper_kernel
def insert_edges(table: EdgeTable, active: ActiveList, count: Integer, bucket: Integer, y: Integer, width: Integer) -> Integer:
    """Insert the edges that start in row y, and return the list's new length.

    Cost    O(edges in the row + k log k) for k that start.
    """
    edges, order, x, starting = table.edges, active.order, active.x, active.starting
    first: Integer = table.starts[bucket]
    started: Integer = table.starts[bucket + 1] - first
    if started == 0:
        return count
    for k in range(started):
        e = table.numbers[first + k]
        starting[0, k] = e
        x[e] = min(max(edges[e, CROSSING], np.int64(0)), width)
    side = sort_starting(table, active, started, y)

    # Merge them into the list from its end.
    i, j = count - 1, started - 1
    while j >= 0:
        e = starting[side, j]
        if i >= 0 and stands_right(edges, x, order[i], e, y):
            order[i + j + 1] = order[i]
            i -= 1
        else:
            order[i + j + 1] = e
            j -= 1
    return count + started


@helper_kernel
def grow(trapezoids: Trapezoids, total: Integer) -> Trapezoids:
    """Return a copy with room for twice as many."""
    capacity = 2 * total
    owner, lines = np.empty(capacity, np.int32), np.empty((capacity, 2, 4), np.int64)
    limits = np.empty((capacity, 4), np.int64)
    for n in range(total):
        owner[n] = trapezoids.owner[n]
        for k in range(4):
            limits[n, k] = trapezoids.limits[n, k]
            lines[n, 0, k], lines[n, 1, k] = trapezoids.lines[n, 0, k], trapezoids.lines[n, 1, k]
    return Trapezoids(owner, lines, limits)


@helper_kernel
def write_lines(lines: Int64Array, edges: Int64Array, left: Integer, right: Integer) -> None:
    """Write the lines of two edges so that their values are positive between them.

    The left edge goes up, q is its lower end; the right edge goes down, q is its upper end.
    """
    lines[0, 0], lines[0, 1] = edges[left, A], edges[left, B]
    lines[0, 2], lines[0, 3] = edges[left, LOWER_X], edges[left, LOWER_Y]
    lines[1, 0], lines[1, 1] = -edges[right, A], -edges[right, B]
    lines[1, 2], lines[1, 3] = edges[right, UPPER_X], edges[right, UPPER_Y]


@helper_kernel
def bound_span(
    trapezoids: Trapezoids, total: Integer, owner: Integer, edges: Int64Array, x: Int64Array, left: Integer, right: Integer,
    y: Integer, sampling: Sampling,
) -> tuple[Trapezoids, Integer]:  # fmt: skip
    """Add the span between two edges in row y to their trapezoid, or begin one; return the trapezoids and how many.

    A pair stays a pair through rows in which its span holds no sample, but no trapezoid begins or ends with such a row.
    """
    if edges[left, RIGHT] != right or edges[left, PAIRED] != y - 1:
        edges[left, RIGHT], edges[left, TRAPEZOID] = right, NONE
    edges[left, PAIRED] = y
    start, end = x[left], x[right]
    if start >= end:
        return trapezoids, total

    # Find the samples at the ends of the span.
    s = sampling.subpixel_bits
    low = ((sampling.x_start + start) << s) + sampling.sample_x
    high = ((sampling.x_start + end - 1) << s) + sampling.sample_x
    row = (np.int64(y) << s) + sampling.sample_y

    # Make the trapezoid a row longer.
    n = edges[left, TRAPEZOID]
    if n != NONE:
        limits = trapezoids.limits[n]
        limits[0], limits[1], limits[3] = min(limits[0], low), max(limits[1], high), row
        return trapezoids, total

    # Begin a new one.
    if total == trapezoids.owner.shape[0]:
        trapezoids = grow(trapezoids, total)
    limits = trapezoids.limits[total]
    limits[0], limits[1], limits[2], limits[3] = low, high, row, row
    trapezoids.owner[total] = owner
    write_lines(trapezoids.lines[total], edges, left, right)
    edges[left, TRAPEZOID] = total
    return trapezoids, total + 1


@helper_kernel
def scan_row(
    trapezoids: Trapezoids, total: Integer, owner: Integer, table: EdgeTable, active: ActiveList, count: Integer, y: Integer,
    fill_rule: int, sampling: Sampling,
) -> tuple[Trapezoids, Integer]:  # fmt: skip
    """Walk along row y from edge to edge, and bound a span wherever the polygon's inside ends.

    Rule    is_filled, asked behind every edge.
    """
    edges, order, x = table.edges, active.order, active.x
    winding, left, is_inside = np.int64(0), NONE, False
    for k in range(count):
        e = order[k]
        was_inside = is_inside
        winding += edges[e, WINDING]
        is_inside = is_filled(fill_rule, k + 1, winding)
        if is_inside and not was_inside:
            left = e
        elif was_inside and not is_inside:
            trapezoids, total = bound_span(trapezoids, total, owner, edges, x, left, e, y, sampling)
    return trapezoids, total


@helper_kernel
def step_edges(table: EdgeTable, active: ActiveList, count: Integer, y: Integer, width: Integer) -> Integer:
    """Step all edges to row y and take out those that have ended; return the list's new length."""
    edges, order, x = table.edges, active.order, active.x
    kept: Integer = 0
    for k in range(count):
        e = order[k]
        if y >= edges[e, ROW_END]:
            continue
        order[kept] = e
        kept += 1
        crossing, rest = step_crossing(edges[e, CROSSING], edges[e, REST], edges[e, STEP], edges[e, STEP_REST], edges[e, A])
        edges[e, CROSSING], edges[e, REST] = crossing, rest
        x[e] = min(max(crossing, np.int64(0)), width)
    return kept


@kernel
def cut_trapezoids(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int, sampling: Sampling
) -> tuple[Int32Array, Int64Array, Int64Array]:
    """Cut polygons into trapezoids that hold their samples, each sample once; return owner, lines and limits.

    Shapes  xy: (V, 2); ring_starts: (R + 1,) rows of xy, a ring is closed from its last point to its first; polygon_rings:
            (P + 1,) rings. Of the result, K trapezoids by polygon: owner (K,) the polygon; lines (K, 2, 4) the left line, whose
            a is above 0, and the right one, as (a, b, q_x, q_y) with a (x - q_x) + b (y - q_y) above 0 between them; limits
            (K, 4) the first and last samples x_low, x_high, y_low, y_high, both included, within the rectangle.
    Units   sub-pixels; sampling's rectangle in pixels.
    Rule    top-left, whatever sampling.rule: a sample on the left line is in, one on the right line is out. fill_rule: one
            of the five above.
    Needs   coordinates within 2^24 px; the rectangle is part of an image.
    Cost    O(edges log edges + crossings + edges in a row, summed over rows). Memory: the largest polygon and the trapezoids.
    Source  the lectures' scan-line polygon fill.
    """
    # Make room for the largest polygon.
    polygons, most = polygon_rings.shape[0] - 1, np.int64(0)
    for p in range(polygons):
        most = max(most, np.int64(ring_starts[polygon_rings[p + 1]]) - np.int64(ring_starts[polygon_rings[p]]))
    rows: Integer = max(np.int64(sampling.y_end) - sampling.y_start, np.int64(0))
    width = max(np.int64(sampling.x_end) - sampling.x_start, np.int64(0))
    table = EdgeTable(np.empty((most, EDGE_COLUMNS), np.int64), np.empty(most, np.int64), np.empty(rows + 2, np.int64))
    active = ActiveList(np.empty(most, np.int64), np.empty(most, np.int64), np.empty((2, most), np.int64))
    trapezoids = Trapezoids(
        np.empty(CAPACITY, np.int32), np.empty((CAPACITY, 2, 4), np.int64), np.empty((CAPACITY, 4), np.int64)
    )  # fmt: skip
    total: Integer = np.int64(0)
    for p in range(polygons):
        # Build the polygon's edge table.
        edge_count: Integer = np.int64(0)
        for r in range(polygon_rings[p], polygon_rings[p + 1]):
            first, last = np.int64(ring_starts[r]), np.int64(ring_starts[r + 1])
            edge_count = gather_edges(table, edge_count, xy, first, last, sampling)
        if edge_count == 0:
            continue
        row, row_end = sort_into_rows(table, edge_count)

        # Sweep down its rows.
        count: Integer = np.int64(0)
        for y in range(row, row_end):
            count = insert_edges(table, active, count, y - row, y, width)
            trapezoids, total = scan_row(trapezoids, total, p, table, active, count, y, fill_rule, sampling)
            count = step_edges(table, active, count, y + 1, width)
            sort_by_x(active.order, active.x, count)
    return trapezoids.owner[:total].copy(), trapezoids.lines[:total].copy(), trapezoids.limits[:total].copy()
