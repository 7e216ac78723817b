"""Edge walking: step down the left and the right edge of each triangle, and write the span between them.

The corner first in (y, x) is the top; the upper one of the other two is the breakpoint. Above it the long edge faces the upper
short edge, below it the lower one. Where an edge crosses a row of samples is a ceiling division, made once at the edge's first
row; a DDA of quotient and remainder then steps the crossing exactly from row to row, with no slope that could drift. Both ends
are ceilings, so spans are half-open and neighbours neither overlap nor leave a gap; the lecture's ceiling and floor own both.
The edges are those of the setup, with the rule folded in, so every rule holds here too.

When to choose it: few large triangles, whose rows cost a few additions each. The divisions make tiny triangles dear.

Source: the lectures' edge-walking rasterizer; Hecker 1995 for the integer DDA.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.counters import EDGE_EVALUATIONS, SPANS
from scanspan.raster.setup import first_sample, keep_sample, set_up
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_pair, write_sample_tally, write_span
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles


@helper_kernel
def start_crossing(f: Integer, a: Integer, b: Integer) -> tuple[Integer, Integer, Integer, Integer]:
    """Return the first sample i of a row at which f + a i >= 0, and how it steps: (crossing, rest, step, step_rest).

    The rest is f + a crossing, from 0 to below a. From row to row f grows by b.

    Needs   a > 0.
    """
    crossing = -(f // a)
    step = -(b // a)
    return crossing, f + a * crossing, step, b + a * step


@helper_kernel
def step_crossing(crossing: Integer, rest: Integer, step: Integer, step_rest: Integer, a: Integer) -> tuple[Integer, Integer]:
    """Step a crossing and its rest to the next row, exactly."""
    rest = rest + step_rest
    carries = rest >= a
    return crossing + step - np.int64(carries), rest - (a if carries else np.int64(0))


@inline_kernel
def edge_walk(
    write_sample: Callable[..., None], target: Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Write every covered sample of triangles first to last.

    Shapes  target: (H, W, ...), opened a row at a time; counters: (COUNTERS,), added to; triangles: ScreenTriangles.
    Units   pixels and sub-pixels, see TriangleSetup.
    Rule    sampling.rule, folded into the edge constants by the setup.
    Needs   the rectangle of sampling lies within the target.
    Cost    O(rows + covered samples), and six divisions a triangle.
    Source  the lectures; Hecker 1995.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = triangles.integers, triangles.floats
    crossings = spans = np.int64(0)
    for n in range(first, last):
        t = set_up(xy, depths, corners, inner, outline, integers, floats, n, sampling)
        if t.y_start == t.y_end:
            continue

        # Leave out a first or last row that lies on a level edge which does not own it.
        y_start, y_end = t.y_start, t.y_end
        g1, g2 = t.g1, t.g2
        f0, f1, f2 = t.f0, t.f1, t.f2
        if t.a2 == 0 and f2 < 0:
            y_start += 1
            f0, f1, f2, g1, g2 = f0 + t.b0, f1 + t.b1, f2 + t.b2, g1 + t.g1_y, g2 + t.g2_y
        if t.a0 == 0 and t.f0 + (y_end - 1 - t.y_start) * t.b0 < 0:
            y_end -= 1

        # Start the two edges that leave the top corner. A right edge is one whose outside begins: the first sample with f < 0.
        width = t.x_end - t.x_start
        left_a, right_a = t.a1, max(-t.a2, np.int64(1))
        left, left_rest, left_step, left_step_rest = start_crossing(f1, left_a, t.b1)
        right, right_rest, right_step, right_step_rest = start_crossing(-f2 - 1, right_a, -t.b2)
        if t.a2 == 0:
            right, right_step, right_step_rest = width, np.int64(0), np.int64(0)

        # The lower short edge begins at the first row that is not above the breakpoint.
        p_y, q_y, r_y = xy[corners[n, 0], 1], xy[corners[n, 1], 1], xy[corners[n, 2], 1]
        middle = p_y + q_y + r_y - min(p_y, q_y, r_y) - max(p_y, q_y, r_y)
        turn = max(first_sample(middle, sampling.sample_y, sampling.subpixel_bits), y_start)
        crossings += 2 * max(y_end - y_start, np.int64(0)) + 1
        for y in range(y_start, y_end):
            start, end = left, right
            if y == turn and t.a0 > 0:
                left_a = t.a0
                left, left_rest, left_step, left_step_rest = start_crossing(f0 + (y - y_start) * t.b0, left_a, t.b0)
                start = max(start, left)
            elif y == turn and t.a0 < 0:
                right_a = -t.a0
                f = -(f0 + (y - y_start) * t.b0) - 1
                right, right_rest, right_step, right_step_rest = start_crossing(f, right_a, -t.b0)
                end = min(end, right)

            # Write the span between the edges.
            start, end = max(start, np.int64(0)), min(end, width)
            if start < end:
                row = target[y, t.x_start + start : t.x_start + end]
                write_span(write_sample, keep_sample, row, t, g1 + start * t.g1_x, g2 + start * t.g2_x, n)
                spans += 1

            # Step both edges to the next row.
            left, left_rest = step_crossing(left, left_rest, left_step, left_step_rest, left_a)
            right, right_rest = step_crossing(right, right_rest, right_step, right_step_rest, right_a)
            g1, g2 = g1 + t.g1_y, g2 + t.g2_y
    counters[EDGE_EVALUATIONS] += crossings
    counters[SPANS] += spans


@kernel
def edge_walk_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W) keys."""
    edge_walk(write_sample_key, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W, 2) pairs."""
    edge_walk(write_sample_pair, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W) hits."""
    edge_walk(write_sample_hit, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W, 4) tallies."""
    edge_walk(write_sample_tally, target, counters, triangles, first, last, sampling)
