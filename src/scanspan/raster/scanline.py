"""Scan-line hidden surfaces: one sweep down the rows, which works with one row at a time.

The active edge list (active_edges.py) holds the edges that cross the present row, ordered by x. Between a triangle's left edge
and its right one lies its span. Which span is seen at a sample, the lectures decide in three ways:

scanline-eval   walk along the row, let the edges flag their triangles in and out, evaluate the depths of all that one is in.
scanline-zrow   render every span into a depth buffer of one row, then put the row into the picture.
span-list       keep the nearest span until another may hide it (span_list.py).

Counting hides nothing: there each span is written as it is found, and the three are the same.

When to choose them: a picture taller than memory, since rows are finished in order; zrow and span-list also for large
triangles. The price is the sorting: fine meshes take three to four times as long as half-space does. Evaluating sample by
sample costs most where many triangles lie behind each other.

Source: the lectures, after Wylie, Romney, Evans and Erdahl 1967 (scanline-eval and scanline-zrow).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.active_edges import (
    BASE1,
    BASE2,
    G1,
    G1_X,
    G1_Y,
    G2,
    G2_X,
    G2_Y,
    NUMBER,
    OUT,
    ActiveEdges,
    build_edge_table,
    insert_edges,
    make_active_edges,
    sort_edges,
    step_edges,
)
from scanspan.raster.counters import DEPTH_TESTS, LEFT_OVER, OUT_OF_ORDER, SET_TWICE, SPANS
from scanspan.raster.setup import depth_at, keep_sample
from scanspan.raster.write import (
    EMPTY_KEY,
    is_nearer,
    pack_key,
    write_sample_hit,
    write_sample_key,
    write_sample_pair,
    write_sample_tally,
    write_span,
)
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup


@helper_kernel
def open_row(slots: Int64Array, v: Integer, y: int) -> None:
    """Set the two integers of a slot's depth to those of row y, exactly."""
    slots[v, G1] = slots[v, BASE1] + y * slots[v, G1_Y]
    slots[v, G2] = slots[v, BASE2] + y * slots[v, G2_Y]


@helper_kernel
def row_setup(slots: Int64Array, planes: Float64Array, v: Integer) -> TriangleSetup:
    """Return what a setup holds of depth along the row that the slot was opened for, from column 0, and nothing else."""
    none = np.int64(0)
    return TriangleSetup(
        none, none, none, none, none, none, none, none, none, none, none, none, none,
        slots[v, G1], slots[v, G1_X], none, slots[v, G2], slots[v, G2_X], none, planes[v, 0], planes[v, 1], planes[v, 2],
        -np.inf, np.inf, -np.inf, np.inf,
    )  # fmt: skip


@inline_kernel
def write_spans(
    find_nearest: Callable[..., Integer], write_sample: Callable[..., None], row: Array, active: ActiveEdges, count: int,
    y: int, counters: Int64Array,
) -> None:  # fmt: skip
    """Write the span of every triangle in the list: from each left edge to the matching right one.

    Shapes  row: a row of a target. find_nearest has no part in it.
    """
    order, x, slots, planes = active.order, active.x, active.slots, active.planes
    spans, last = 0, np.int64(0)
    for k in range(count):
        e = order[k]
        counters[OUT_OF_ORDER] += np.int64(x[e] < last)
        last = x[e]
        if (e & 1) == 0 and last < x[e + 1]:
            v, end = e >> 1, x[e + 1]
            open_row(slots, v, y)
            t = row_setup(slots, planes, v)
            write_span(
                write_sample, keep_sample, row[last:end], t, t.g1 + last * t.g1_x, t.g2 + last * t.g2_x, slots[v, NUMBER]
            )
            spans += 1
    counters[SPANS] += spans


@helper_kernel
def x_range(active: ActiveEdges, count: int) -> tuple[Integer, Integer]:
    """Return the columns from the first edge of the list to the last; they are ordered."""
    return active.x[active.order[0]], active.x[active.order[count - 1]]


@helper_kernel
def find_nearest_key(slots: Int64Array, planes: Float64Array, inside: Int64Array, spans: int, x: Integer) -> Integer:
    """Return the slot of the span that a target of keys shows at column x, of those that the walk along the row is in."""
    nearest: Integer = inside[0]
    largest: Integer = EMPTY_KEY
    for m in range(spans):
        v = inside[m]
        t = row_setup(slots, planes, v)
        key = pack_key(depth_at(t, t.g1 + x * t.g1_x, t.g2 + x * t.g2_x), slots[v, NUMBER])
        nearest = v if key > largest else nearest
        largest = max(largest, key)
    return nearest


@helper_kernel
def find_nearest_pair(slots: Int64Array, planes: Float64Array, inside: Int64Array, spans: int, x: Integer) -> Integer:
    """Return the slot of the span that a target of pairs shows at column x, of those that the walk along the row is in."""
    nearest: Integer = inside[0]
    depth, number = -np.inf, -1
    for m in range(spans):
        v = inside[m]
        t = row_setup(slots, planes, v)
        other, n = depth_at(t, t.g1 + x * t.g1_x, t.g2 + x * t.g2_x), slots[v, NUMBER]
        nearer = is_nearer(other, n, depth, number)
        nearest, depth, number = (v, other, n) if nearer else (nearest, depth, number)
    return nearest


@helper_kernel
def flag_triangles(
    order: Int64Array, x: Int64Array, slots: Int64Array, inside: Int64Array, place: Int64Array,
    k: int, count: int, spans: int, y: int, counters: Int64Array,
) -> tuple[int, int]:  # fmt: skip
    """Let all edges at the column of edge k flag their triangles in or out; return the next k and how many one is in.

    A triangle whose span is empty is never entered.
    """
    start = x[order[k]]
    while k < count and x[order[k]] == start:
        v = order[k] >> 1
        k += 1
        if x[2 * v] >= x[2 * v + 1]:
            continue
        if place[v] == OUT:
            open_row(slots, v, y)
            place[v], inside[spans] = spans, v
            spans += 1
            counters[SPANS] += 1
        else:
            spans -= 1
            moved = inside[spans]
            inside[place[v]], place[moved] = moved, place[v]
            place[v] = OUT
    return k, spans


@inline_kernel
def evaluate_row(
    find_nearest: Callable[..., Integer], write_sample: Callable[..., None], row: Array, active: ActiveEdges, count: int,
    y: int, counters: Int64Array,
) -> None:  # fmt: skip
    """Walk along a row, evaluate at every sample the depths of all spans that it lies in, and write the nearest.

    Shapes  row: a row of a target.
    """
    order, x, slots, planes, inside, place = (
        active.order, active.x, active.slots, active.planes, active.inside, active.place,
    )  # fmt: skip
    k, spans = 0, 0
    written = np.int64(-1)
    while k < count:
        # Go to the next column at which spans start or end.
        start = x[order[k]]
        k, spans = flag_triangles(order, x, slots, inside, place, k, count, spans, y, counters)

        # Evaluate up to the next edge.
        if k == count:
            break
        end = x[order[k]]
        counters[OUT_OF_ORDER] += np.int64(end < start)
        if spans == 0:
            continue
        for i in range(start, end):
            v = find_nearest(slots, planes, inside, spans, i)
            t = row_setup(slots, planes, v)
            write_sample(row, i, True, depth_at(t, t.g1 + i * t.g1_x, t.g2 + i * t.g2_x), slots[v, NUMBER])
        counters[SET_TWICE] += np.int64(start < written)
        counters[DEPTH_TESTS] += spans * (end - start)
        written = end


@inline_kernel
def buffer_row(
    find_nearest: Callable[..., Integer], write_sample: Callable[..., None], row: Array, active: ActiveEdges, count: int,
    y: int, counters: Int64Array,
) -> None:  # fmt: skip
    """Render the spans of a row into a buffer of its own, and write it once.

    Shapes  row: a row of a target. find_nearest has no part in it.
    """
    if count > 0:
        start, end = x_range(active, count)
        buffer = row.copy()
        write_spans(find_nearest, write_sample, buffer, active, count, y, counters)
        row[start:end] = buffer[start:end]


@inline_kernel
def sweep(
    scan: Callable[..., None], find_nearest: Callable[..., Integer], write_sample: Callable[..., None],
    target: Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Go down the rows with an active edge list of triangles first to last, and scan each.

    Shapes  target: (H, W, ...), opened a row at a time; triangles: ScreenTriangles; counters: (COUNTERS,), added to.
            scan(find_nearest, write_sample, row, active, count, y, counters) writes a row: write_spans, evaluate_row,
            buffer_row or list_spans; find_nearest(slots, planes, inside, spans, x) returns a slot.
    Units   pixels and sub-pixels, see TriangleSetup.
    Rule    sampling.rule, folded into the edge constants by the setup.
    Needs   the rectangle of sampling lies within the target.
    Cost    for each row O(its edges + those that start or cross + columns), and what scanning takes: O(covered samples of all
            triangles).
    Source  the lectures.
    """
    table = build_edge_table(triangles, first, last, sampling)
    active, count = make_active_edges(table.most, sampling), 0
    for y in range(sampling.y_start, sampling.y_end):
        count = insert_edges(active, count, y, table, triangles, sampling, counters)
        scan(find_nearest, write_sample, target[y], active, count, y, counters)
        count = step_edges(active, count, y + 1, sampling, counters)
        sort_edges(active, count, counters)
    counters[LEFT_OVER] += count


@kernel
def scanline_eval_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, evaluating, into (H, W) keys."""
    sweep(evaluate_row, find_nearest_key, write_sample_key, target, counters, triangles, first, last, sampling)


@kernel
def scanline_eval_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, evaluating, into (H, W, 2) pairs."""
    sweep(evaluate_row, find_nearest_pair, write_sample_pair, target, counters, triangles, first, last, sampling)


@kernel
def scanline_eval_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, evaluating, into (H, W, 4) tallies."""
    sweep(evaluate_row, find_nearest_key, write_sample_tally, target, counters, triangles, first, last, sampling)


@kernel
def scanline_zrow_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, a depth buffer of one row, into (H, W) keys."""
    sweep(buffer_row, find_nearest_key, write_sample_key, target, counters, triangles, first, last, sampling)


@kernel
def scanline_zrow_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, a depth buffer of one row, into (H, W, 2) pairs."""
    sweep(buffer_row, find_nearest_key, write_sample_pair, target, counters, triangles, first, last, sampling)


@kernel
def scanline_zrow_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines, a depth buffer of one row, into (H, W, 4) tallies."""
    sweep(buffer_row, find_nearest_key, write_sample_tally, target, counters, triangles, first, last, sampling)


@kernel
def scanline_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Scan lines into (H, W) hits."""
    sweep(write_spans, find_nearest_key, write_sample_hit, target, counters, triangles, first, last, sampling)
