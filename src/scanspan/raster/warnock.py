"""Warnock's algorithm: subdivide the screen until a window is simple enough to be drawn at once.

A window is a rectangle of samples. Every triangle is surrounding (it covers all samples of the window), contained (its box lies
inside), intersecting, or disjoint; a child has to look only at what was not disjoint from its parent. What lies behind a
surrounding triangle everywhere in the window is dropped. A window is drawn when one triangle is left or when it is small, and
split into halves across and down otherwise.

Coverage is decided by the integers of the setup, at the corner samples of a window, where affine functions have their extremes.
Depth only ever drops a triangle, and only when it is behind by more than a margin; what is left goes through the common writer.
So the picture is that of every other algorithm, bit for bit.

When to choose it: few large triangles in many layers, of which most are hidden. Fine meshes pay for the lists. Each triangle
is set up once and kept (184 bytes); the lists of all windows that are open at a time take at most a word for each triangle and
level, because the list of a child is part of its parent's and siblings use the same storage one after the other.

Source: Warnock 1969; the lectures' "recursive subdivision of the screen"; Greene 1996 for windows of samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.counters import EDGE_EVALUATIONS, SUBDIVISIONS
from scanspan.raster.half_space import STRIDE, is_outside, scan_row
from scanspan.raster.order import HILBERT, Window
from scanspan.raster.setup import FLOATS, INTEGERS, bound_sample, depth_at, keep_sample, keep_setup, kept_setup, set_up
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_pair, write_sample_tally, write_span
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

DISJOINT, SURROUNDING, CONTAINED, INTERSECTING = range(4)

SMALL = np.int64(32)  # samples along a side of a window that is not split; 16 is half as slow again, 64 about as fast
# The order of a window's quarters (x + 2 y), and the way in which each is divided in turn, for each order of algorithms.py.
PLAIN, TO_AND_FRO = [[0, 1, 2, 3], [0, 0, 0, 0]], [[0, 1, 3, 2], [0, 0, 0, 0]]
QUARTERS = np.array([[PLAIN] * 4, [TO_AND_FRO] * 4, [PLAIN] * 4, [PLAIN] * 4, HILBERT.tolist()], np.int64)

# What is hidden: nothing; what is behind a surrounding plane; what is behind all depths of it, where these are held to a range.
HIDES_NOTHING, HIDES_BEHIND, HIDES_BELOW = range(3)

# How far behind is behind. Depth is rounded to float32 before it is compared, which moves it by less than 2^-24 of itself, and
# float64 adds less than 2^-50 of the terms it is a sum of. Where float32 runs out of range, at either end, nothing is dropped.
MARGIN = 2.0**-22
SMALLEST = 2.0**-126
LARGEST = 2.0**126


@helper_kernel
def overlap(window: Window, t: TriangleSetup) -> Window:
    """Return the part of a window that a triangle's box covers; it may be empty."""
    return Window(
        max(window.x_start, t.x_start), min(window.x_end, t.x_end), max(window.y_start, t.y_start), min(window.y_end, t.y_end)
    )


@helper_kernel
def edge_extremes(
    f: Integer, a: Integer, b: Integer, i: Integer, j: Integer, i_last: Integer, j_last: Integer
) -> tuple[Integer, Integer]:
    """Return the least and the greatest value of an edge over samples i to i_last and j to j_last, both included."""
    least = f + min(a * i, a * i_last) + min(b * j, b * j_last)
    greatest = f + max(a * i, a * i_last) + max(b * j, b * j_last)
    return least, greatest


@helper_kernel
def relate(window: Window, t: TriangleSetup) -> int:
    """Return how a triangle lies to a window: DISJOINT, SURROUNDING, CONTAINED or INTERSECTING, decided in integers."""
    part = overlap(window, t)
    if part.x_start >= part.x_end or part.y_start >= part.y_end:
        return DISJOINT
    is_whole = (
        (part.x_start == window.x_start)
        & (part.x_end == window.x_end)
        & (part.y_start == window.y_start)
        & (part.y_end == window.y_end)
    )
    is_box = (part.x_start == t.x_start) & (part.x_end == t.x_end) & (part.y_start == t.y_start) & (part.y_end == t.y_end)
    if is_box and not is_whole:
        return CONTAINED

    # Ask each edge about the corner samples of the part: none of them inside means disjoint, all of them surrounding.
    i, j = part.x_start - t.x_start, part.y_start - t.y_start
    i_last, j_last = part.x_end - 1 - t.x_start, part.y_end - 1 - t.y_start
    least0, greatest0 = edge_extremes(t.f0, t.a0, t.b0, i, j, i_last, j_last)
    least1, greatest1 = edge_extremes(t.f1, t.a1, t.b1, i, j, i_last, j_last)
    least2, greatest2 = edge_extremes(t.f2, t.a2, t.b2, i, j, i_last, j_last)
    if (greatest0 | greatest1 | greatest2) < 0:
        return DISJOINT
    is_cut = (t.cut_low > -np.inf) | (t.cut_high < np.inf)
    return SURROUNDING if is_whole and not is_cut and (least0 | least1 | least2) >= 0 else INTERSECTING


@helper_kernel
def depth_terms(t: TriangleSetup, x: Integer, y: Integer) -> tuple[float, float]:
    """Return the depth of a triangle's plane at the sample of pixel (x, y), and the sum of the sizes of its terms."""
    i, j = x - t.x_start, y - t.y_start
    g1 = t.g1 + i * t.g1_x + j * t.g1_y
    g2 = t.g2 + i * t.g2_x + j * t.g2_y
    return depth_at(t, g1, g2), abs(t.depth) + (abs(np.float64(g1) * t.slope1) + abs(np.float64(g2) * t.slope2))


@helper_kernel
def is_in_front(s: TriangleSetup, t: TriangleSetup, x: Integer, y: Integer) -> bool:
    """Say whether the plane of s lies in front of that of t by more than the margin at the sample of pixel (x, y)."""
    depth, size = depth_terms(s, x, y)
    other_depth, other_size = depth_terms(t, x, y)
    return (depth - other_depth > MARGIN * (size + other_size) + SMALLEST) & (size < LARGEST)


@helper_kernel
def is_hidden(window: Window, t: TriangleSetup, s: TriangleSetup) -> bool:
    """Say whether triangle s, which surrounds a window, hides t everywhere in it.

    The gap between two planes is affine and the sizes of the terms are convex, so a gap that exceeds the margin at the four
    corners of the part where t can be does so at every sample between them.
    """
    part = overlap(window, t)
    x_last, y_last = part.x_end - 1, part.y_end - 1
    return (
        is_in_front(s, t, part.x_start, part.y_start)
        & is_in_front(s, t, x_last, part.y_start)
        & is_in_front(s, t, part.x_start, y_last)
        & is_in_front(s, t, x_last, y_last)
    )


@helper_kernel
def held_depth(t: TriangleSetup, x: Integer, y: Integer) -> tuple[float, float]:
    """Return the depth of a triangle at the sample of pixel (x, y), held to its range, and the sum of the terms' sizes."""
    depth, size = depth_terms(t, x, y)
    return min(max(depth, t.depth_low), t.depth_high), size


@helper_kernel
def is_below(window: Window, t: TriangleSetup, s: TriangleSetup) -> bool:
    """Say whether all depths of triangle t in a window are behind all those of s, which surrounds it.

    Depths that are held to a range are not affine, but still extreme at corners.
    """
    part = overlap(window, t)
    least, greatest, largest = np.inf, -np.inf, 0.0
    for k in range(4):
        x = part.x_start if k & 1 else part.x_end - 1
        y = part.y_start if k & 2 else part.y_end - 1
        depth, size = held_depth(s, x, y)
        other_depth, other_size = held_depth(t, x, y)
        least, greatest, largest = min(least, depth), max(greatest, other_depth), max(largest, size + other_size)
    return (least - greatest > MARGIN * largest + SMALLEST) & (largest < LARGEST)


@inline_kernel
def fill_window(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, window: Window,
    t: TriangleSetup, n: int,
) -> None:  # fmt: skip
    """Write every sample of a window that triangle n surrounds."""
    i, j = window.x_start - t.x_start, window.y_start - t.y_start
    g1, g2 = t.g1 + i * t.g1_x + j * t.g1_y, t.g2 + i * t.g2_x + j * t.g2_y
    for y in range(window.y_start, window.y_end):
        write_span(write_sample, bound, target[y, window.x_start : window.x_end], t, g1, g2, n)
        g1, g2 = g1 + t.g1_y, g2 + t.g2_y


@inline_kernel
def scan_window(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, window: Window,
    t: TriangleSetup, n: int,
) -> Integer:  # fmt: skip
    """Write the samples of a window that triangle n covers, and return how many edge values that took at most.

    In a wide window, rows are entered and left in strides.
    """
    part = overlap(window, t)
    i, j = part.x_start - t.x_start, part.y_start - t.y_start
    width = part.x_end - part.x_start
    f0, f1, f2 = t.f0 + i * t.a0 + j * t.b0, t.f1 + i * t.a1 + j * t.b1, t.f2 + i * t.a2 + j * t.b2
    g1, g2 = t.g1 + i * t.g1_x + j * t.g1_y, t.g2 + i * t.g2_x + j * t.g2_y
    for y in range(part.y_start, part.y_end):
        i, end = np.int64(0), width
        if width > STRIDE:
            while i < width and is_outside(f0, t.a0, f1, t.a1, f2, t.a2, i, i + STRIDE - 1):
                i += STRIDE
            end = i
            while end < width and not is_outside(f0, t.a0, f1, t.a1, f2, t.a2, end, end + STRIDE - 1):
                end += STRIDE
        scan_row(
            write_sample, bound, target[y, part.x_start + i : part.x_start + min(end, width)], t,
            f0 + i * t.a0, f1 + i * t.a1, f2 + i * t.a2, g1 + i * t.g1_x, g2 + i * t.g2_x, n,
        )  # fmt: skip
        f0, f1, f2, g1, g2 = f0 + t.b0, f1 + t.b1, f2 + t.b2, g1 + t.g1_y, g2 + t.g2_y
    return 3 * max(width, np.int64(0)) * max(part.y_end - part.y_start, np.int64(0))


@helper_kernel
def count_levels(sampling: Sampling) -> int:
    """Return how many windows lie above one another: the whole one, and one for each halving of its longer side."""
    side = max(sampling.x_end - sampling.x_start, sampling.y_end - sampling.y_start)
    levels = 1
    while side > SMALL:
        side = (side + 1) >> 1
        levels += 1
    return levels


@helper_kernel
def push_children(
    windows: Int64Array, count: int, window: Window, start: int, end: int, way: Integer, quarters: Int64Array
) -> int:
    """Push the two or four halves of a window, each with the window's list, the first to be seen last; return the new count.

    Shapes  quarters: (ways, 2, 4), a row of QUARTERS.
    """
    x_middle = (window.x_start + window.x_end) >> 1 if window.x_end - window.x_start > SMALL else window.x_end
    y_middle = (window.y_start + window.y_end) >> 1 if window.y_end - window.y_start > SMALL else window.y_end
    for k in range(3, -1, -1):
        quarter = quarters[way, 0, k]
        is_right, is_lower = (quarter & 1) != 0, quarter > 1
        x_start, x_end = (x_middle, window.x_end) if is_right else (window.x_start, x_middle)
        y_start, y_end = (y_middle, window.y_end) if is_lower else (window.y_start, y_middle)
        if x_start < x_end and y_start < y_end:
            windows[count, 0], windows[count, 1], windows[count, 2], windows[count, 3] = x_start, x_end, y_start, y_end
            windows[count, 4], windows[count, 5], windows[count, 6] = start, end, quarters[way, 1, k]
            count += 1
    return count


@inline_kernel
def warnock(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], hides: int,
    target: Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Write every sample of triangles first to last that may be seen; all that are covered where nothing hides anything.

    Shapes  target: (H, W, ...), opened a row at a time; counters: (COUNTERS,), added to; triangles: ScreenTriangles. hides: one
            of HIDES_NOTHING, HIDES_BEHIND, HIDES_BELOW.
    Units   pixels and sub-pixels, see TriangleSetup.
    Rule    sampling.rule, folded into the edge constants by the setup; windows are divided in sampling.order.
    Needs   the rectangle of sampling lies within the target.
    Cost    O(visible edge length log(side) list length) windows; O(triangles log(side)) words.
    Source  Warnock 1969.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = np.empty((last - first, INTEGERS), np.int64), np.empty((last - first, FLOATS))
    numbers = np.empty(last - first, np.int64)
    kept = 0
    for n in range(first, last):
        t = set_up(xy, depths, corners, inner, outline, triangles.integers, triangles.floats, n, sampling)
        if t.y_start < t.y_end:
            keep_setup(integers, floats, kept, t)
            numbers[kept] = n
            kept += 1

    # Begin with one window and all triangles. Depth first, at most three siblings wait on each level.
    levels = count_levels(sampling)
    lists = np.empty(kept * (levels + 1), np.int64)
    lists[:kept] = np.arange(kept)
    windows = np.empty((3 * levels + 1, 7), np.int64)
    windows[0, 0], windows[0, 1], windows[0, 2], windows[0, 3] = (
        sampling.x_start,
        sampling.x_end,
        sampling.y_start,
        sampling.y_end,
    )
    windows[0, 4], windows[0, 5], windows[0, 6] = 0, kept, 0
    count = 1
    quarters, evaluations = QUARTERS[sampling.order], np.int64(0)
    while count > 0:
        count -= 1
        window, way = Window(windows[count, 0], windows[count, 1], windows[count, 2], windows[count, 3]), windows[count, 6]

        # List what is not disjoint, behind the parent's list, and note the surrounding triangle that is nearest in the middle.
        start = end = windows[count, 5]
        evaluations += 6 * (start - windows[count, 4])
        nearest, nearest_depth = np.int64(-1), -np.inf
        for place in range(windows[count, 4], start):
            k = lists[place]
            t = kept_setup(integers, floats, k)
            relation = relate(window, t)
            if relation != DISJOINT:
                lists[end] = k
                end += 1
            if relation == SURROUNDING:
                depth, _ = depth_terms(t, (window.x_start + window.x_end) >> 1, (window.y_start + window.y_end) >> 1)
                if depth > nearest_depth:
                    nearest, nearest_depth = k, depth

        # Drop what that one hides.
        if hides != HIDES_NOTHING and nearest >= 0 and end - start > 1:
            surrounder = kept_setup(integers, floats, nearest)
            listed, end = end, start
            for place in range(start, listed):
                k = lists[place]
                t = kept_setup(integers, floats, k)
                if not (is_hidden(window, t, surrounder) if hides == HIDES_BEHIND else is_below(window, t, surrounder)):
                    lists[end] = k
                    end += 1

        # Draw a simple or a small window, split any other.
        is_small = (window.x_end - window.x_start <= SMALL) & (window.y_end - window.y_start <= SMALL)
        if end - start > 1 and not is_small:
            count = push_children(windows, count, window, start, end, way, quarters)
            counters[SUBDIVISIONS] += 1
            continue
        for place in range(start, end):
            k = lists[place]
            t = kept_setup(integers, floats, k)
            if relate(window, t) == SURROUNDING:
                fill_window(write_sample, bound, target, window, t, numbers[k])
            else:
                evaluations += scan_window(write_sample, bound, target, window, t, numbers[k])
    counters[EDGE_EVALUATIONS] += evaluations


@kernel
def warnock_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W) keys."""
    warnock(write_sample_key, keep_sample, HIDES_BEHIND, target, counters, triangles, first, last, sampling)


@kernel
def warnock_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W, 2) pairs."""
    warnock(write_sample_pair, keep_sample, HIDES_BEHIND, target, counters, triangles, first, last, sampling)


@kernel
def warnock_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W) hits."""
    warnock(write_sample_hit, keep_sample, HIDES_NOTHING, target, counters, triangles, first, last, sampling)


@kernel
def warnock_pixels_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock, for whole pixels, into (H, W) keys."""
    warnock(write_sample_key, bound_sample, HIDES_BELOW, target, counters, triangles, first, last, sampling)


@kernel
def warnock_pixels_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock, for whole pixels, into (H, W, 2) pairs."""
    warnock(write_sample_pair, bound_sample, HIDES_BELOW, target, counters, triangles, first, last, sampling)


@kernel
def warnock_pixels_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock, for whole pixels, into (H, W, 4) tallies."""
    warnock(write_sample_tally, bound_sample, HIDES_BELOW, target, counters, triangles, first, last, sampling)


@kernel
def warnock_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W, 4) tallies."""
    warnock(write_sample_tally, keep_sample, HIDES_BEHIND, target, counters, triangles, first, last, sampling)
