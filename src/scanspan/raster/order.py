"""Traversal orders: the same samples of a triangle visited row by row, to and fro, in tiles, or along a space-filling curve.

The picture does not depend on the order; what does is how far apart the samples lie that follow each other, and so what stays
in a cache. Tiles and curves go by blocks of 8 x 8 samples. A block is left out if one edge rejects its best corner; the curves
ask that of whole quarters of the box first, and divide only what is not rejected, so the empty corners of a large triangle cost
little.

Morton's curve visits the four quarters in the order of a Z. Hilbert's turns each quarter so that every step leads to a
neighbour.

When to choose one: to see what order does. Rows are fastest here, because rows are how the target lies in memory.

Source: the lectures on traversal order; Morton 1966; Hilbert 1891; Greene 1996 for rejecting blocks.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.half_space import scan_row
from scanspan.raster.setup import depth_at, set_up_triangle
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_pair
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

BLOCK = 8  # samples along a side
LEVELS = 24  # of quarters: more than a side of 2^18 px can be halved

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
MORTON = np.array([[[0, 1, 2, 3], [0, 0, 0, 0]]], np.int64)


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


@inline_kernel
def scan_block(write_sample: Callable[..., None], target: Array, t: TriangleSetup, i: int, j: int, n: int) -> None:
    """Scan the samples of one block, row by row, as far as they lie in the box."""
    x, width = t.x_start + i, min(BLOCK, t.x_end - t.x_start - i)
    for k in range(j, min(j + BLOCK, t.y_end - t.y_start)):
        scan_row(
            write_sample, target[t.y_start + k, x : x + width], t,
            t.f0 + i * t.a0 + k * t.b0, t.f1 + i * t.a1 + k * t.b1, t.f2 + i * t.a2 + k * t.b2,
            t.g1 + i * t.g1_x + k * t.g1_y, t.g2 + i * t.g2_x + k * t.g2_y, n,
        )  # fmt: skip


@inline_kernel
def serpentine(
    write_sample: Callable[..., None], target: Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Visit rows to and fro: the odd ones from right to left.

    Shapes, units, rule and needs as for half_space. Cost: O(bounding box).
    """
    xy, depths, corners, inner = triangles.xy, triangles.depth, triangles.corners, triangles.inner
    for n in range(first, last):
        p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
        t = set_up_triangle(
            xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1],
            depths[p], depths[q], depths[r], np.int64(inner[n]), sampling,
        )  # fmt: skip
        width = t.x_end - t.x_start
        for j in range(t.y_end - t.y_start):
            row = target[t.y_start + j, t.x_start : t.x_end]
            f0, f1, f2 = t.f0 + j * t.b0, t.f1 + j * t.b1, t.f2 + j * t.b2
            g1, g2 = t.g1 + j * t.g1_y, t.g2 + j * t.g2_y
            for k in range(width):
                i = width - 1 - k if (t.y_start + j) & 1 else k
                inside = ((f0 + i * t.a0) | (f1 + i * t.a1) | (f2 + i * t.a2)) >= 0
                write_sample(row, i, inside, depth_at(t, g1 + i * t.g1_x, g2 + i * t.g2_x), n)


@inline_kernel
def tiles(
    write_sample: Callable[..., None], target: Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Visit blocks row by row, and leave out those that an edge rejects.

    Shapes, units, rule and needs as for half_space. Cost: O(blocks of the box + samples of blocks that are not rejected).
    """
    xy, depths, corners, inner = triangles.xy, triangles.depth, triangles.corners, triangles.inner
    for n in range(first, last):
        p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
        t = set_up_triangle(
            xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1],
            depths[p], depths[q], depths[r], np.int64(inner[n]), sampling,
        )  # fmt: skip
        for j in range(0, t.y_end - t.y_start, BLOCK):
            for i in range(0, t.x_end - t.x_start, BLOCK):
                if not is_rejected(t, i, j, BLOCK):
                    scan_block(write_sample, target, t, i, j, n)


@inline_kernel
def curve(
    write_sample: Callable[..., None], quarters: Int64Array, target: Array, triangles: ScreenTriangles, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Visit blocks along a space-filling curve, from the quarters of the box down, and leave out what an edge rejects.

    Shapes  quarters: (ways, 2, 4), MORTON or HILBERT; the others as for half_space.
    Cost    O(blocks along the edges, times the levels + covered samples).
    """
    xy, depths, corners, inner = triangles.xy, triangles.depth, triangles.corners, triangles.inner
    stack = np.empty((3 * LEVELS + 4, 4), np.int64)
    for n in range(first, last):
        p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
        t = set_up_triangle(
            xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1],
            depths[p], depths[q], depths[r], np.int64(inner[n]), sampling,
        )  # fmt: skip
        width, height = t.x_end - t.x_start, t.y_end - t.y_start
        side = BLOCK
        while side < max(width, height):
            side *= 2

        # Take squares off the stack, and put back the quarters of those that are neither blocks nor rejected, the first on top.
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, side, 0
        depth = 1 if height > 0 else 0
        while depth > 0:
            depth -= 1
            i, j, side, way = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
            if i >= width or j >= height or is_rejected(t, i, j, side):
                continue
            if side == BLOCK:
                scan_block(write_sample, target, t, i, j, n)
                continue
            half = side // 2
            for k in range(4):
                quarter, turned = quarters[way, 0, 3 - k], quarters[way, 1, 3 - k]
                stack[depth, 0], stack[depth, 1] = i + (quarter & 1) * half, j + (quarter >> 1) * half
                stack[depth, 2], stack[depth, 3] = half, turned
                depth += 1


@kernel
def serpentine_keys(target: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Serpentine into (H, W) keys."""
    serpentine(write_sample_key, target, triangles, first, last, sampling)


@kernel
def serpentine_pairs(target: Float64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Serpentine into (H, W, 2) pairs."""
    serpentine(write_sample_pair, target, triangles, first, last, sampling)


@kernel
def serpentine_hits(target: Int32Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Serpentine into (H, W) hits."""
    serpentine(write_sample_hit, target, triangles, first, last, sampling)


@kernel
def tiles_keys(target: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Tiles into (H, W) keys."""
    tiles(write_sample_key, target, triangles, first, last, sampling)


@kernel
def tiles_pairs(target: Float64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Tiles into (H, W, 2) pairs."""
    tiles(write_sample_pair, target, triangles, first, last, sampling)


@kernel
def tiles_hits(target: Int32Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Tiles into (H, W) hits."""
    tiles(write_sample_hit, target, triangles, first, last, sampling)


@kernel
def morton_keys(target: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Morton's curve into (H, W) keys."""
    curve(write_sample_key, MORTON, target, triangles, first, last, sampling)


@kernel
def morton_pairs(target: Float64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Morton's curve into (H, W, 2) pairs."""
    curve(write_sample_pair, MORTON, target, triangles, first, last, sampling)


@kernel
def morton_hits(target: Int32Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Morton's curve into (H, W) hits."""
    curve(write_sample_hit, MORTON, target, triangles, first, last, sampling)


@kernel
def hilbert_keys(target: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Hilbert's curve into (H, W) keys."""
    curve(write_sample_key, HILBERT, target, triangles, first, last, sampling)


@kernel
def hilbert_pairs(target: Float64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Hilbert's curve into (H, W, 2) pairs."""
    curve(write_sample_pair, HILBERT, target, triangles, first, last, sampling)


@kernel
def hilbert_hits(target: Int32Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling) -> None:
    """Hilbert's curve into (H, W) hits."""
    curve(write_sample_hit, HILBERT, target, triangles, first, last, sampling)
