"""Half-space rasterization: three edge equations over the bounding box of each triangle.

Each row starts from the exact edge values at its first sample and steps them by adding. One sign test on e0 | e1 | e2 decides,
as in the lectures. A long row is left once it is outside again, and entered where it may be inside, both in strides of 32
samples, so that what lies between is one plain loop over a slice, which the compiler turns into vector instructions (8 samples
at a time with AVX-512). A test for leaving at every sample would forbid that; docs/decisions/0003-half-space.md has the
measurements.

Source: Pineda 1988; the lectures' "two speed hacks".
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.counters import EDGE_EVALUATIONS
from scanspan.raster.setup import depth_at, keep_sample, set_up
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_layer, write_sample_pair
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

STRIDE = np.int64(32)  # samples; 16 to 64 measure alike
STACK = (80, 5)  # squares that an order has still to visit: three on each of 24 levels, more than a side can be halved


@helper_kernel
def is_outside(
    f0: Integer, a0: Integer, f1: Integer, a1: Integer, f2: Integer, a2: Integer, i: Integer, j: Integer
) -> bool | np.bool_:
    """Say whether samples i to j of a row are all outside, because one edge is negative at both of them."""
    return (
        ((f0 + i * a0) & (f0 + j * a0)) | ((f1 + i * a1) & (f1 + j * a1)) | ((f2 + i * a2) & (f2 + j * a2))
    ) < 0  # fmt: skip


@inline_kernel
def scan_row(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], row: Array, t: TriangleSetup,
    f0: Integer, f1: Integer, f2: Integer, g1: Integer, g2: Integer, n: int,
) -> None:  # fmt: skip
    """Test every sample of a row by the three signs at once, and write those inside.

    Shapes  row: a slice of a target; t: TriangleSetup; f0 to f2, g1, g2: its integers at the row's first sample.
    """
    for i in range(row.shape[0]):
        inside = ((f0 + i * t.a0) | (f1 + i * t.a1) | (f2 + i * t.a2)) >= 0
        inside, depth = bound(t, inside, depth_at(t, g1 + i * t.g1_x, g2 + i * t.g2_x))
        write_sample(row, i, inside, depth, n)


@inline_kernel
def visit_rows(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup, n: int,
    stack: Int64Array,
) -> Integer:  # fmt: skip
    """Scan the samples of a triangle row by row, and return how many edge values that took."""
    f0, f1, f2, g1, g2 = t.f0, t.f1, t.f2, t.g1, t.g2
    x_start, width = t.x_start, t.x_end - t.x_start
    evaluations: Integer = np.int64(0)

    # Scan a narrow box whole. Working out what that takes behind the loop would double the time of small triangles.
    if width <= STRIDE:
        evaluations = 3 * width * (t.y_end - t.y_start)
        for y in range(t.y_start, t.y_end):
            scan_row(write_sample, bound, target[y, x_start : x_start + width], t, f0, f1, f2, g1, g2, n)
            f0, f1, f2, g1, g2 = f0 + t.b0, f1 + t.b1, f2 + t.b2, g1 + t.g1_y, g2 + t.g2_y
        return evaluations

    # In a wide one, find where each row enters the triangle and where it has left it again, and scan what lies between.
    for y in range(t.y_start, t.y_end):
        i = np.int64(0)
        while i < width and is_outside(f0, t.a0, f1, t.a1, f2, t.a2, i, i + STRIDE - 1):
            i += STRIDE
        end = i
        while end < width and not is_outside(f0, t.a0, f1, t.a1, f2, t.a2, end, end + STRIDE - 1):
            end += STRIDE
        scan_row(
            write_sample, bound, target[y, x_start + i : x_start + min(end, width)], t,
            f0 + i * t.a0, f1 + i * t.a1, f2 + i * t.a2, g1 + i * t.g1_x, g2 + i * t.g2_x, n,
        )  # fmt: skip
        f0, f1, f2, g1, g2 = f0 + t.b0, f1 + t.b1, f2 + t.b2, g1 + t.g1_y, g2 + t.g2_y
        evaluations += 6 * (end // STRIDE + 1) + 3 * (min(end, width) - i)
    return evaluations


@inline_kernel
def half_space(
    visit: Callable[..., Integer], write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]],
    target: Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Write every covered sample of triangles first to last, in the order in which `visit` goes through a box.

    Shapes  target: (H, W, ...), opened a row at a time; counters: (COUNTERS,), added to; triangles: ScreenTriangles.
    Units   pixels and sub-pixels, see TriangleSetup.
    Rule    sampling.rule, folded into the edge constants by the setup.
    Needs   the rectangle of sampling lies within the target.
    Cost    O(bounding box) up to a stride's width; beyond it O(covered samples), and a stride at either end of each row.
    Source  Pineda 1988.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = triangles.integers, triangles.floats
    stack = np.empty(STACK, np.int64)
    evaluations: Integer = np.int64(0)
    for n in range(first, last):
        t = set_up(xy, depths, corners, inner, outline, integers, floats, n, sampling)
        evaluations += visit(write_sample, bound, target, t, n, stack)
    counters[EDGE_EVALUATIONS] += evaluations


@kernel
def half_space_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W) keys."""
    half_space(visit_rows, write_sample_key, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def half_space_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W, 2) pairs."""
    half_space(visit_rows, write_sample_pair, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def half_space_layers(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W, 2) layers."""
    half_space(visit_rows, write_sample_layer, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def half_space_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W) hits."""
    half_space(visit_rows, write_sample_hit, keep_sample, target, counters, triangles, first, last, sampling)
