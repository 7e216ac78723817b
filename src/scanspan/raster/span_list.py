"""The span-list algorithm: the visible spans of each row, found without any memory of a row.

The sweep is that of scanline.py. Within a row there is the same again, one dimension lower: spans start and end in order of x,
and the active span list holds those that the walk along the row is in. The lectures keep the identity of the nearest. Where no
span starts or ends it can change only where two spans cross in depth. Depth is affine along a row, so a span that is in front
of another at both ends of a run, by more than rounding can turn round, is in front throughout. The run is written as one plain
span, and what starts behind it costs one look. A run that is not certain is halved, down to one sample, decided as everywhere.

When to choose it: large triangles, many deep. On fine meshes the looks cost more than the samples would.

Source: the lectures' active span list; Watkins 1970 for halving runs until one span is in front.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.active_edges import (
    NUMBER,
    OUT,
    ActiveEdges,
)
from scanspan.raster.counters import DEPTH_TESTS, OUT_OF_ORDER, SET_TWICE
from scanspan.raster.scanline import find_nearest_key, find_nearest_pair, flag_triangles, row_setup, sweep
from scanspan.raster.setup import depth_at, keep_sample
from scanspan.raster.write import write_sample_key, write_sample_pair, write_sample_tally, write_span
from scanspan.records import Array, Float64Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

ROUNDING = 2.0**-22  # of the terms of a depth: more than its evaluation and float32 together take from it, which is 2^-24
TINY = 2.0**-140  # what float32 takes from a depth that is nearly 0
FLOAT32_LIMIT = 2.0**127  # from here on depths may round to infinity, all to the same


@helper_kernel
def doubt(t: TriangleSetup, g1: Integer, g2: Integer) -> float:
    """Return a bound on what evaluation and float32 take from a depth; infinite where float32 may overflow."""
    terms = abs(t.depth) + (abs(np.float64(g1) * t.slope1) + abs(np.float64(g2) * t.slope2))
    return terms * ROUNDING + TINY if terms < FLOAT32_LIMIT else np.inf


@helper_kernel
def is_clear(t: TriangleSetup, o: TriangleSetup, first: Integer, last: Integer) -> bool:
    """Say whether span t hides span o for certain from column first to last: at both by more than rounding can turn round."""
    t1, t2, o1, o2 = t.g1 + first * t.g1_x, t.g2 + first * t.g2_x, o.g1 + first * o.g1_x, o.g2 + first * o.g2_x
    at_first, t_doubt, o_doubt = depth_at(t, t1, t2) - depth_at(o, o1, o2), doubt(t, t1, t2), doubt(o, o1, o2)
    t1, t2, o1, o2 = t.g1 + last * t.g1_x, t.g2 + last * t.g2_x, o.g1 + last * o.g1_x, o.g2 + last * o.g2_x
    at_last = depth_at(t, t1, t2) - depth_at(o, o1, o2)
    return min(at_first, at_last) > max(t_doubt, doubt(t, t1, t2)) + max(o_doubt, doubt(o, o1, o2))


@inline_kernel
def write_run(
    write_sample: Callable[..., None], row: Array, slots: Int64Array, planes: Float64Array, v: Integer,
    start: Integer, end: Integer, written: Integer, counters: Int64Array,
) -> Integer:  # fmt: skip
    """Write the span in slot v from column start to end, and return how far the row is written then."""
    t = row_setup(slots, planes, v)
    write_span(write_sample, keep_sample, row[start:end], t, t.g1 + start * t.g1_x, t.g2 + start * t.g2_x, slots[v, NUMBER])
    counters[SET_TWICE] += np.int64(start < written)
    return end


@inline_kernel
def list_spans(
    find_nearest: Callable[..., Integer], write_sample: Callable[..., None], row: Array, active: ActiveEdges, count: int,
    y: int, counters: Int64Array,
) -> None:  # fmt: skip
    """Walk along a row and write the visible spans, one after the other.

    Shapes  row: a row of a target.
    """
    order, x, slots, planes, inside, place = (
        active.order, active.x, active.slots, active.planes, active.inside, active.place,
    )  # fmt: skip
    k, spans, nearest = 0, 0, OUT
    written: Integer = np.int64(0)
    start, sure = np.int64(0), np.int64(0)  # the nearest span is seen from start on, and for certain until sure
    while k < count:
        # Go to the next column at which spans start or end.
        i, m = x[order[k]], k
        k, spans = flag_triangles(order, x, slots, inside, place, k, count, spans, y, counters)
        end = x[order[k]] if k < count else i
        counters[OUT_OF_ORDER] += np.int64(end < i)

        # Keep the nearest span unless one that starts here may hide it.
        while m < k and i < sure:
            e = order[m]
            m += 1
            if (e & 1) == 0 and i < x[e + 1]:
                counters[DEPTH_TESTS] += 1
                last = min(sure, x[e + 1]) - 1
                if not is_clear(row_setup(slots, planes, nearest), row_setup(slots, planes, e >> 1), i, last):
                    sure = i

        # Where that is not certain, write it so far and find the nearest again.
        while sure < end and spans > 0:
            if start < sure:
                written = write_run(write_sample, row, slots, planes, nearest, start, sure, written, counters)
            start = max(i, sure)
            nearest = np.int64(find_nearest(slots, planes, inside, spans, start))
            counters[DEPTH_TESTS] += spans

            # It is seen until it ends, or half as far, and so on, until no other may hide it.
            sure, m = max(x[2 * nearest + 1], start + 1), 0
            t = row_setup(slots, planes, nearest)
            while m < spans and sure > start + 1:
                v = inside[m]
                counters[DEPTH_TESTS] += 1
                if v == nearest or is_clear(t, row_setup(slots, planes, v), start, min(sure, x[2 * v + 1]) - 1):
                    m += 1
                else:
                    sure = start + ((sure - start) >> 1)
    if start < sure:
        written = write_run(write_sample, row, slots, planes, nearest, start, sure, written, counters)


@kernel
def span_list_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Span list into (H, W) keys."""
    sweep(list_spans, find_nearest_key, write_sample_key, target, counters, triangles, first, last, sampling)


@kernel
def span_list_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Span list into (H, W, 2) pairs."""
    sweep(list_spans, find_nearest_pair, write_sample_pair, target, counters, triangles, first, last, sampling)


@kernel
def span_list_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Span list into (H, W, 4) tallies."""
    sweep(list_spans, find_nearest_key, write_sample_tally, target, counters, triangles, first, last, sampling)
