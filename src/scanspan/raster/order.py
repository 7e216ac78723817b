"""Traversal orders: the same samples of a triangle visited row by row, to and fro, in tiles, or along a space-filling curve.

The picture does not depend on the order; what does is how far apart the samples lie that follow each other, and so what stays
in a cache. Tiles and curves go by blocks of 8 x 8 samples. A block is left out if one edge rejects its best corner, and written
without a test if every edge accepts its worst. The curves ask that of whole quarters of the box first, so the empty corners and
the full middle of a large triangle cost little.

Morton's curve visits the four quarters in the order of a Z. Hilbert's turns each quarter so that every step leads to a
neighbour.

When to choose one: to see what order does. Rows are fastest here, because rows are how the target lies in memory.

Source: the lectures on traversal order; Morton 1966; Hilbert 1891; Greene 1996 for rejecting blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.half_space import STACK, half_space, scan_row
from scanspan.raster.setup import depth_at, keep_sample
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_pair, write_span
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

BLOCK = 8  # samples along a side
FIRST_CURVE = 3  # of the orders in algorithms.py

# For each of the four ways that Hilbert's curve may run through a square: the quarters (x + 2 y) in order, and the way in each.
HILBERT = np.array(
    [
        [[0, 2, 3, 1], [1, 0, 0, 3]],
        [[0, 1, 3, 2], [0, 1, 1, 2]],
        [[3, 1, 0, 2], [3, 2, 2, 1]],
        [[3, 2, 0, 1], [2, 3, 3, 0]],
    ],
    np.int64,
)
MORTON = np.array([[[0, 1, 2, 3], [0, 0, 0, 0]]] * 4, np.int64)


class Window(NamedTuple):
    """A rectangle of samples, by their pixels; ranges are half-open."""

    x_start: Integer
    x_end: Integer
    y_start: Integer
    y_end: Integer


@helper_kernel
def is_rejected(t: TriangleSetup, i: Integer, j: Integer, side: Integer) -> bool:
    """Say whether one edge excludes all samples of a square, because it excludes the corner that lies furthest inside it.

    Units   i, j: first sample of the square from the first of the box; side: samples.
    """
    last = side - 1
    f0 = t.f0 + i * t.a0 + j * t.b0 + max(t.a0, np.int64(0)) * last + max(t.b0, np.int64(0)) * last
    f1 = t.f1 + i * t.a1 + j * t.b1 + max(t.a1, np.int64(0)) * last + max(t.b1, np.int64(0)) * last
    f2 = t.f2 + i * t.a2 + j * t.b2 + max(t.a2, np.int64(0)) * last + max(t.b2, np.int64(0)) * last
    return bool((f0 | f1 | f2) < 0)


@helper_kernel
def is_accepted(t: TriangleSetup, i: Integer, j: Integer, side: Integer) -> bool:
    """Say whether all samples of a square are inside, because every edge includes the corner that lies least inside it."""
    last = side - 1
    f0 = t.f0 + i * t.a0 + j * t.b0 + min(t.a0, np.int64(0)) * last + min(t.b0, np.int64(0)) * last
    f1 = t.f1 + i * t.a1 + j * t.b1 + min(t.a1, np.int64(0)) * last + min(t.b1, np.int64(0)) * last
    f2 = t.f2 + i * t.a2 + j * t.b2 + min(t.a2, np.int64(0)) * last + min(t.b2, np.int64(0)) * last
    return bool((f0 | f1 | f2) >= 0)


@kernel
def list_blocks(order: int, columns: Integer, rows: Integer) -> Int64Array:
    """Return the (x, y) of all blocks of a grid, (N, 2), in an order of algorithms.py, by its number there.

    Blocks lie along rows, to and fro in the second order; the last two are curves.
    """
    blocks = np.empty((columns * rows, 2), np.int64)
    if order < FIRST_CURVE:
        for k in range(columns * rows):
            x, y = k % columns, k // columns
            blocks[k, 0], blocks[k, 1] = columns - 1 - x if order == 1 and y & 1 else x, y
        return blocks
    quarters = MORTON if order == FIRST_CURVE else HILBERT
    side = 1
    while side < max(columns, rows):
        side *= 2
    stack = np.empty(STACK, np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3], stack[0, 4] = 0, 0, side, 0, 0
    depth, count = 1, 0
    while depth > 0:
        depth -= 1
        i, j, side, way = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
        if i >= columns or j >= rows:
            continue
        if side == 1:
            blocks[count, 0], blocks[count, 1] = i, j
            count += 1
            continue
        depth = push_quarters(stack, depth, i, j, side, way, quarters, np.int64(0))
    return blocks


@helper_kernel
def push_quarters(
    stack: Int64Array, depth: int, i: Integer, j: Integer, side: Integer, way: Integer, quarters: Int64Array, accepted: Integer
) -> int:
    """Push the quarters of a square, the first on top, and return the stack's new depth; accepted is passed on to them."""
    half = side // 2
    for k in range(3, -1, -1):
        quarter = quarters[way, 0, k]
        stack[depth, 0], stack[depth, 1] = i + (quarter & 1) * half, j + (quarter >> 1) * half
        stack[depth, 2], stack[depth, 3], stack[depth, 4] = half, quarters[way, 1, k], accepted
        depth += 1
    return depth


@inline_kernel
def scan_block(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup,
    i: int, j: int, n: int, accepted: bool,
) -> Integer:  # fmt: skip
    """Scan the samples of one block, row by row, as far as they lie in the box, and return how many edge values that took.

    A block that is accepted needs none.
    """
    x, width = t.x_start + i, min(BLOCK, t.x_end - t.x_start - i)
    height = min(BLOCK, t.y_end - t.y_start - j)
    for k in range(j, j + height):
        row = target[t.y_start + k, x : x + width]
        g1, g2 = t.g1 + i * t.g1_x + k * t.g1_y, t.g2 + i * t.g2_x + k * t.g2_y
        if accepted:
            write_span(write_sample, bound, row, t, g1, g2, n)
        else:
            f0, f1, f2 = t.f0 + i * t.a0 + k * t.b0, t.f1 + i * t.a1 + k * t.b1, t.f2 + i * t.a2 + k * t.b2
            scan_row(write_sample, bound, row, t, f0, f1, f2, g1, g2, n)
    return np.int64(0) if accepted else 3 * width * height


@inline_kernel
def visit_serpentine(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup, n: int,
    stack: Int64Array,
) -> Integer:  # fmt: skip
    """Visit rows to and fro: the odd ones from right to left. Cost: O(bounding box)."""
    width = t.x_end - t.x_start
    for j in range(t.y_end - t.y_start):
        row = target[t.y_start + j, t.x_start : t.x_end]
        f0, f1, f2 = t.f0 + j * t.b0, t.f1 + j * t.b1, t.f2 + j * t.b2
        g1, g2 = t.g1 + j * t.g1_y, t.g2 + j * t.g2_y
        for k in range(width):
            i = width - 1 - k if (t.y_start + j) & 1 else k
            inside = ((f0 + i * t.a0) | (f1 + i * t.a1) | (f2 + i * t.a2)) >= 0
            inside, depth = bound(t, inside, depth_at(t, g1 + i * t.g1_x, g2 + i * t.g2_x))
            write_sample(row, i, inside, depth, n)
    return 3 * width * (t.y_end - t.y_start)


@inline_kernel
def visit_tiles(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup, n: int,
    stack: Int64Array,
) -> Integer:  # fmt: skip
    """Visit blocks row by row; leave out those that an edge rejects, and test no sample of those that all edges accept.

    Cost: O(blocks of the box + samples of blocks that are not rejected).
    """
    evaluations = np.int64(0)
    for j in range(0, t.y_end - t.y_start, BLOCK):
        for i in range(0, t.x_end - t.x_start, BLOCK):
            evaluations += 6
            if not is_rejected(t, i, j, BLOCK):
                accepted = is_accepted(t, i, j, BLOCK)
                evaluations += scan_block(write_sample, bound, target, t, i, j, n, accepted)
    return evaluations


@inline_kernel
def visit_curve(
    quarters: Int64Array, write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array,
    t: TriangleSetup, n: int, stack: Int64Array,
) -> Integer:  # fmt: skip
    """Visit blocks along a space-filling curve, from the quarters of the box down; what is rejected or accepted is so at once.

    Shapes  quarters: (ways, 2, 4), MORTON or HILBERT; stack: as STACK in half_space.py.
    Cost    O(blocks along the edges, times the levels + covered samples).
    """
    width, height = t.x_end - t.x_start, t.y_end - t.y_start
    side = BLOCK
    while side < max(width, height):
        side *= 2

    # Take squares off the stack, and put back the quarters of those that are neither blocks nor rejected, the first on top.
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3], stack[0, 4] = 0, 0, side, 0, 0
    depth = 1 if height > 0 else 0
    evaluations = np.int64(0)
    while depth > 0:
        depth -= 1
        i, j, side, way = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
        if i >= width or j >= height:
            continue
        accepted = stack[depth, 4]
        if accepted == 0:
            evaluations += 6
            if is_rejected(t, i, j, side):
                continue
            accepted = np.int64(is_accepted(t, i, j, side))
        if side == BLOCK:
            evaluations += scan_block(write_sample, bound, target, t, i, j, n, accepted != 0)
            continue
        depth = push_quarters(stack, depth, i, j, side, way, quarters, accepted)
    return evaluations


@inline_kernel
def visit_morton(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup, n: int,
    stack: Int64Array,
) -> Integer:  # fmt: skip
    """Visit blocks along Morton's curve."""
    return visit_curve(MORTON, write_sample, bound, target, t, n, stack)


@inline_kernel
def visit_hilbert(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], target: Array, t: TriangleSetup, n: int,
    stack: Int64Array,
) -> Integer:  # fmt: skip
    """Visit blocks along Hilbert's curve."""
    return visit_curve(HILBERT, write_sample, bound, target, t, n, stack)


@kernel
def serpentine_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine into (H, W) keys."""
    half_space(visit_serpentine, write_sample_key, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def serpentine_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine into (H, W, 2) pairs."""
    half_space(visit_serpentine, write_sample_pair, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def serpentine_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine into (H, W) hits."""
    half_space(visit_serpentine, write_sample_hit, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def tiles_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles into (H, W) keys."""
    half_space(visit_tiles, write_sample_key, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def tiles_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles into (H, W, 2) pairs."""
    half_space(visit_tiles, write_sample_pair, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def tiles_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles into (H, W) hits."""
    half_space(visit_tiles, write_sample_hit, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def morton_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve into (H, W) keys."""
    half_space(visit_morton, write_sample_key, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def morton_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve into (H, W, 2) pairs."""
    half_space(visit_morton, write_sample_pair, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def morton_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve into (H, W) hits."""
    half_space(visit_morton, write_sample_hit, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def hilbert_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve into (H, W) keys."""
    half_space(visit_hilbert, write_sample_key, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def hilbert_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve into (H, W, 2) pairs."""
    half_space(visit_hilbert, write_sample_pair, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def hilbert_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve into (H, W) hits."""
    half_space(visit_hilbert, write_sample_hit, keep_sample, target, counters, triangles, first, last, sampling)
