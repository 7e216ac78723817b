"""The edge table and the active edge list: what crosses the present row of samples, ordered by x, kept up from row to row.

The edge table holds the triangles in buckets, one for each row, by the row in which they start. The active edge list holds the
edges that cross the present row, ordered by where they cross it. Four verbs work on it: insert the edges that start, scan the
row (scanline.py, span_list.py), step the edges to the next row, sort them again.

A triangle has two edges in the list, a left and a right one, or none. At its breakpoint the lower short edge takes the place
of the upper one. Crossings are those of edge walking, ceilings stepped by an exact DDA, and they are held to the picture: so
spans are half-open and own what every other algorithm owns, and what edges do left and right of the picture costs no sorting.

Triangles are set up when they start, and their records are used again when they end: the list's memory is that of the fullest
row. Price: a triangle is looked at twice, and every edge is moved about in every row that it crosses.

Source: the lectures; counting sort for the buckets, insertion sort for the list.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.jit import helper_kernel
from scanspan.raster.counters import EDGE_EVALUATIONS, INSERTIONS, SWAPS
from scanspan.raster.edge_walk import start_crossing, step_crossing
from scanspan.raster.setup import first_sample, set_up
from scanspan.records import Float64Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

# Columns of ActiveEdges.edges: those of start_crossing, the row at which the lower edge takes over, the row after the last.
CROSSING, REST, STEP, STEP_REST, A, TURN, Y_END = range(7)
EDGE_COLUMNS = 8  # 64 bytes, a line of the cache

# Columns of ActiveEdges.slots. At column x the integers of depth are G1 + x G1_X and G2 + x G2_X; in row y, G1 is
# BASE1 + y G1_Y and G2 is BASE2 + y G2_Y.
NUMBER, LOWER_F, LOWER_A, LOWER_B, G1, G1_X, G1_Y, BASE1, G2, G2_X, G2_Y, BASE2 = range(12)
SLOT_COLUMNS = 12

OUT = np.int64(-1)  # the flag of a triangle that the walk along a row is not inside of
NEVER = np.int64(1 << 40)  # a row that no image has


class Edge(NamedTuple):
    """An edge in its triangle's first row: where it bounds the span there, and what ActiveEdges keeps of it."""

    x: Integer
    crossing: Integer
    rest: Integer
    step: Integer
    step_rest: Integer
    a: Integer
    turn: Integer


class EdgeTable(NamedTuple):
    """The triangles of a sweep in buckets by the row in which they start."""

    starts: Int64Array  # (rows + 1,) bucket j of triangles is starts[j] to starts[j + 1]
    triangles: Int64Array  # (N,) numbers
    most: Integer  # triangles that cross one row, at most


class ActiveEdges(NamedTuple):
    """The active edge list, and the records of the triangles in it: slot k has the left edge 2k and the right edge 2k + 1."""

    order: Int64Array  # (2C,) the list: edges ordered by x
    x: Int64Array  # (2C,) of an edge: the first column that is right of it, held to the rectangle
    edges: Int64Array  # (2C, EDGE_COLUMNS)
    slots: Int64Array  # (C, SLOT_COLUMNS)
    planes: Float64Array  # (C, 3) depth and its two slopes
    inside: Int64Array  # (C,) slots of the spans that the walk along a row is in
    place: Int64Array  # (C,) of a slot: where it stands among those, or OUT; the lectures' flag
    free: Int64Array  # (C,) from half the list's length on: slots that hold no triangle
    starting: Int64Array  # (2, 2C) edges that start in a row, as they come and by x
    buckets: Int64Array  # (columns + 1,)


@helper_kernel
def build_edge_table(triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> EdgeTable:
    """Return the triangles first to last in buckets by first row: a counting sort, without comparisons."""
    xy, corners, outline, limits = triangles.xy, triangles.corners, triangles.outline, triangles.limits
    s, sample_y, y_start, y_end = sampling.subpixel_bits, sampling.sample_y, sampling.y_start, sampling.y_end
    rows, count = max(y_end - y_start, 0), max(last - first, 0)
    starts, ends = np.zeros(rows + 2, np.int64), np.zeros(rows + 1, np.int64)
    row, numbers = np.empty(count, np.int64), np.empty(count, np.int64)

    # Find the first row of each triangle, and count how many start and how many have ended in every row.
    for n in range(first, last):
        p_y, q_y, r_y = xy[corners[n, 0], 1], xy[corners[n, 1], 1], xy[corners[n, 2], 1]
        top, bottom = min(p_y, q_y, r_y), max(p_y, q_y, r_y)
        if outline[n] >= 0:
            top, bottom = limits[outline[n], 2], limits[outline[n], 3]
        start = max(first_sample(top, sample_y, s), y_start)
        end = min(((bottom - sample_y) >> s) + 1, y_end)
        row[n - first] = start - y_start if start < end else OUT
        if start < end:
            starts[start - y_start + 2] += 1
            ends[end - y_start] += 1

    # Add up where each bucket begins; one place further on, so that filling the buckets moves it there.
    active = most = np.int64(0)
    for j in range(rows):
        active += starts[j + 2] - ends[j]
        most = max(most, active)
        starts[j + 2] += starts[j + 1]

    # Fill the buckets.
    for k in range(count):
        j = row[k]
        if j >= 0:
            numbers[starts[j + 1]] = first + k
            starts[j + 1] += 1
    return EdgeTable(starts, numbers, most)


@helper_kernel
def make_active_edges(most: Integer, sampling: Sampling) -> ActiveEdges:
    """Return an empty list with room for so many triangles at once."""
    return ActiveEdges(
        np.empty(2 * most, np.int64), np.empty(2 * most, np.int64), np.empty((2 * most, EDGE_COLUMNS), np.int64),
        np.empty((most, SLOT_COLUMNS), np.int64), np.empty((most, 3), np.float64),
        np.empty(most, np.int64), np.full(most, OUT), np.arange(most), np.empty((2, 2 * most), np.int64),
        np.empty(max(sampling.x_end - sampling.x_start, 0) + 2, np.int64),
    )  # fmt: skip


@helper_kernel
def start_edge(
    f: Integer, a: Integer, b: Integer, lower_f: Integer, lower_a: Integer, lower_b: Integer,
    y: Integer, turn: Integer, is_left: bool,
) -> Edge:  # fmt: skip
    """Return the edge f + a x of a triangle in its first row y, where f steps by b; at row turn the lower edge takes its place.

    In the row of the turn both bound the span, as the corner is a point of both.
    """
    crossing, rest, step, step_rest = start_crossing(f, a, b)
    x = crossing
    if y == turn:
        a = lower_a
        crossing, rest, step, step_rest = start_crossing(lower_f, lower_a, lower_b)
        x = max(x, crossing) if is_left else min(x, crossing)
    return Edge(x, crossing, rest, step, step_rest, a, turn)


@helper_kernel
def start_triangle(t: TriangleSetup, turn: Integer) -> tuple[Edge, Edge, Integer, Integer, Integer]:
    """Return the left and the right edge of a triangle in its first row, and the numbers f, a, b of the lower short edge.

    They count from column 0. A right edge is one whose outside begins, so f + a x becomes -1 - f - a x.

    Rule    a first row on a level edge that does not own it is empty.
    """
    y = t.y_start
    lower_f, lower_a, lower_b = t.f0 - t.x_start * t.a0 + (turn - y) * t.b0, t.a0, t.b0
    if t.a0 < 0:
        lower_f, lower_a, lower_b = -lower_f - 1, -lower_a, -lower_b
    left_turn = turn if t.a0 > 0 else NEVER
    left = start_edge(t.f1 - t.x_start * t.a1, t.a1, t.b1, lower_f, lower_a, lower_b, y, left_turn, True)

    # Take the lower edge at once where the upper one is level.
    right_turn = turn if t.a0 < 0 and t.a2 < 0 else NEVER
    right_f, right_a, right_b = t.x_start * t.a2 - t.f2 - 1, -t.a2, -t.b2
    if t.a2 == 0:
        right_f, right_a, right_b = lower_f, lower_a, lower_b
    right = start_edge(right_f, right_a, right_b, lower_f, lower_a, lower_b, y, right_turn, False)
    x = left.x if t.a2 == 0 and t.f2 < 0 else right.x
    return (
        left,
        Edge(x, right.crossing, right.rest, right.step, right.step_rest, right.a, right.turn),
        lower_f,
        lower_a,
        lower_b,
    )


@helper_kernel
def start_triangles(
    active: ActiveEdges, count: int, y: int, table: EdgeTable, triangles: ScreenTriangles, sampling: Sampling
) -> int:
    """Set up the triangles that start in a row, and return how many edges that makes.

    Rule    a last row on a level edge that does not own it is left out.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = triangles.integers, triangles.floats
    x, edges, slots, planes = active.x, active.edges, active.slots, active.planes
    free, starting, numbers = active.free, active.starting, table.triangles
    s, sample_y, low, high = sampling.subpixel_bits, sampling.sample_y, sampling.x_start, sampling.x_end
    started = 0
    for k in range(table.starts[y - sampling.y_start], table.starts[y - sampling.y_start + 1]):
        n = numbers[k]
        t = set_up(xy, depths, corners, inner, outline, integers, floats, n, sampling)
        y_end = t.y_end
        if t.a0 == 0 and t.f0 + (y_end - 1 - y) * t.b0 < 0:
            y_end -= 1
        if y >= y_end:
            continue

        # Find its edges; the lower short one begins in the first row that is not above the breakpoint.
        p_y, q_y, r_y = xy[corners[n, 0], 1], xy[corners[n, 1], 1], xy[corners[n, 2], 1]
        middle = p_y + q_y + r_y - min(p_y, q_y, r_y) - max(p_y, q_y, r_y)
        turn = max(first_sample(middle, sample_y, s), t.y_start)
        left, right, lower_f, lower_a, lower_b = start_triangle(t, turn)

        # Fill the records of a slot that is free.
        v = free[(count + started) >> 1]
        e, f = 2 * v, 2 * v + 1
        x[e], x[f] = min(max(left.x, low), high), min(max(right.x, low), high)
        edges[e, CROSSING], edges[f, CROSSING] = left.crossing, right.crossing
        edges[e, REST], edges[f, REST] = left.rest, right.rest
        edges[e, STEP], edges[f, STEP] = left.step, right.step
        edges[e, STEP_REST], edges[f, STEP_REST] = left.step_rest, right.step_rest
        edges[e, A], edges[f, A] = left.a, right.a
        edges[e, TURN], edges[f, TURN] = left.turn, right.turn
        edges[e, Y_END], edges[f, Y_END] = y_end, y_end
        slots[v, NUMBER], slots[v, LOWER_F], slots[v, LOWER_A], slots[v, LOWER_B] = n, lower_f, lower_a, lower_b
        slots[v, G1_X], slots[v, G1_Y], slots[v, BASE1] = t.g1_x, t.g1_y, t.g1 - t.x_start * t.g1_x - y * t.g1_y
        slots[v, G2_X], slots[v, G2_Y], slots[v, BASE2] = t.g2_x, t.g2_y, t.g2 - t.x_start * t.g2_x - y * t.g2_y
        planes[v, 0], planes[v, 1], planes[v, 2] = t.depth, t.slope1, t.slope2
        starting[0, started], starting[0, started + 1] = e, f
        started += 2
    return started


@helper_kernel
def insert_edges(
    active: ActiveEdges, count: int, y: int, table: EdgeTable, triangles: ScreenTriangles, sampling: Sampling,
    counters: Int64Array,
) -> int:  # fmt: skip
    """Insert the edges that start in a row, and return the list's new length.

    Cost    O(edges in the row), and O(columns) where edges start: they are ordered by counting, then merged into the list.
    """
    started = start_triangles(active, count, y, table, triangles, sampling)
    if started == 0:
        return count
    order, x, buckets, starting = active.order, active.x, active.buckets, active.starting
    counters[INSERTIONS] += started

    # Order them by x: count how many there are at each column, add up, and put each into its place.
    low, columns = sampling.x_start, buckets.shape[0]
    buckets[:] = 0
    for k in range(started):
        buckets[x[starting[0, k]] - low + 1] += 1
    for i in range(1, columns):
        buckets[i] += buckets[i - 1]
    for k in range(started):
        e = starting[0, k]
        starting[1, buckets[x[e] - low]] = e
        buckets[x[e] - low] += 1

    # Merge them into the list from its end.
    k, m = count - 1, started - 1
    while m >= 0:
        e = starting[1, m]
        if k >= 0 and x[order[k]] > x[e]:
            order[k + m + 1] = order[k]
            k -= 1
        else:
            order[k + m + 1] = e
            m -= 1
    return count + started


@helper_kernel
def step_edges(active: ActiveEdges, count: int, y: int, sampling: Sampling, counters: Int64Array) -> int:
    """Step all edges to row y and take out those of triangles that have ended; return the list's new length."""
    order, x, edges, slots, free = active.order, active.x, active.edges, active.slots, active.free
    low, high = sampling.x_start, sampling.x_end
    kept, used = 0, count >> 1
    counters[EDGE_EVALUATIONS] += count
    for k in range(count):
        e = order[k]
        is_left = (e & 1) == 0
        if y >= edges[e, Y_END]:
            # Give the slot back, once for both edges.
            if is_left:
                used -= 1
                free[used] = e >> 1
            continue
        order[kept] = e
        kept += 1

        # Step the crossing; at the breakpoint start the lower edge.
        crossing, rest = step_crossing(edges[e, CROSSING], edges[e, REST], edges[e, STEP], edges[e, STEP_REST], edges[e, A])
        place = crossing
        if y == edges[e, TURN]:
            a = slots[e >> 1, LOWER_A]
            crossing, rest, step, step_rest = start_crossing(slots[e >> 1, LOWER_F], a, slots[e >> 1, LOWER_B])
            place = max(place, crossing) if is_left else min(place, crossing)
            edges[e, STEP], edges[e, STEP_REST], edges[e, A] = step, step_rest, a
        edges[e, CROSSING], edges[e, REST] = crossing, rest
        x[e] = min(max(place, low), high)
    return kept


@helper_kernel
def sort_by_x(order: Int64Array, x: Int64Array, count: Integer) -> int:
    """Sort edges that are nearly in order by x, by insertion; those at one column stay as they stand. Return the swaps."""
    swaps = 0
    for k in range(1, count):
        e = order[k]
        m = k
        while m > 0 and x[order[m - 1]] > x[e]:
            order[m] = order[m - 1]
            m -= 1
        order[m] = e
        swaps += k - m
    return swaps


@helper_kernel
def sort_edges(active: ActiveEdges, count: int, counters: Int64Array) -> None:
    """Sort the list again; an edge moves only past those that it crossed.

    Cost    O(edges + crossings). Two lines cross once, so no two are swapped twice in a sweep.
    """
    counters[SWAPS] += sort_by_x(active.order, active.x, count)
