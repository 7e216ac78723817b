"""Interpolation: barycentric weights of visible samples, and attributes from them, correct in perspective.

A weight comes from the exact edge value at the sample, E_k / 2A on the screen, and is divided by w before it is normed, so the
sum of the three is the interpolated 1 / w. For a piece of a clipped triangle they are then carried over to the corners of its
source. A triangle that is not clipped (raster/homogeneous_edges.py) has its weights as planes of x and y. An attribute is
u_0 + b_1 (u_1 - u_0) + b_2 (u_2 - u_0): a constant comes out exactly constant.

Source: Heckbert and Moreton 1991; the edge values are the lectures' sub-areas.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.records import Array, Float32Array, Float64Array, Int32Array, Int64Array, Integer, ScreenTriangles, UInt8Array
from scanspan.shade.weights import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    CORNER,
    FIRST,
    FRESH,
    LANES,
    LONG,
    PIXEL,
    RECORD,
    RING,
    ROOM,
    RUN,
    any_odd,
    fetch_block,
    make_records,
    weigh_samples,
)
from scanspan.shade.weights import edge_value as edge_value


@inline_kernel
def clear_block(flat: Array, row: Integer, column: Integer, height: int, width: int, channels: int) -> None:
    """Write 0 to a block of a picture; it is in the cache when what is seen there is written.

    Shapes  flat: (height x width x channels,); row, column: the first of the block.
    """
    row_end: Integer = min(row + BLOCK_ROWS, np.int64(height))
    end: Integer = min(column + BLOCK_COLUMNS, np.int64(width))
    for j in range(row, row_end):
        for k in range(np.uint64((j * width + column) * channels), np.uint64((j * width + end) * channels)):
            flat[k] = 0


@kernel
def barycentric_kernel(
    slots: Int32Array, triangles: ScreenTriangles, sample_x: Integer, sample_y: Integer, subpixel_bits: int, y_start: int,
    out: Float64Array,
) -> None:  # fmt: skip
    """Write the perspective-correct weights of the source triangle's corners at every visible sample, 0 elsewhere.

    Shapes  slots: (h, W) int32, row of triangles.corners or -1; triangles: ScreenTriangles; out: (h, W, 3) float64.
    Units   sample_x, sample_y in sub-pixels from the pixel's corner; y_start: row of the image that slots begin with.
    """
    records, before, seen, weights = make_records(), np.int64(0), slots.reshape(-1), out.reshape(-1)
    lanes, scratch, has_odd = records.lanes, records.scratch, any_odd(triangles.weights, triangles.inner)
    s, x = np.int64(subpixel_bits), np.int64(sample_x)
    y = (np.int64(y_start) << s) + np.int64(sample_y)
    height, width = slots.shape
    for j in range(0, height, BLOCK_ROWS):
        for i in range(0, width, BLOCK_COLUMNS):
            covered, runs, fresh, has_odd = fetch_block(slots, seen, j, i, triangles, has_odd, records, before)
            if covered < BLOCK_ROWS * BLOCK_COLUMNS:
                clear_block(weights, j, i, height, width, 3)
            before += fresh
            is_long = bool(runs * LONG <= covered)
            for start in range(0, covered, LANES):
                count = min(covered - start, LANES)
                weigh_samples(start, count, is_long, triangles, x, y, s, has_odd, records)
                for k in range(count):
                    to = np.uint64(scratch[PIXEL * ROOM + start + k] * 3)
                    weights[to], weights[to + np.uint64(1)] = lanes[k], lanes[LANES + k]
                    weights[to + np.uint64(2)] = lanes[2 * LANES + k]


@kernel
def numbers_kernel(slot: Int32Array, number: Int32Array, out: Int32Array) -> None:
    """Write number[slot], -1 where the slot is -1.

    Shapes  slot: (n,) int32; number: (N,) int32; out: (n,) int32.
    """
    for i in range(slot.shape[0]):
        out[i] = -1 if slot[i] < 0 else number[slot[i]]


@helper_kernel
def blend(u0: float, u1: float, u2: float, b1: float, b2: float) -> float:
    """Return the attribute with values u0, u1, u2 at the corners, for weights b1 and b2 of the last two."""
    return u0 + (b1 * (u1 - u0) + b2 * (u2 - u0))


@helper_kernel
def keep_float(value: float) -> float:
    """Return a value as it is; an array rounds it to its own type."""
    return value


@helper_kernel
def nearest_code(value: float) -> np.uint8:
    """Return a value rounded half up to a code of 8 bits."""
    return np.uint8(min(max(np.floor(value + 0.5), 0.0), 255.0))


@inline_kernel
def write_values(
    fresh: Integer, before: Integer, source: Int32Array, triangles: Int32Array, values: Array, channels: int,
    scratch: Int64Array, kept: Float64Array,
) -> None:  # fmt: skip
    """Keep the values at the corners of the triangles whose records are new.

    Shapes  kept: (RING x channels x 3,), the value at the first corner, and what the others have more.
    """
    # Look up the corners of the triangles that these are pieces of; those of whole ones are there.
    if source.shape[0] > 0:
        for f in range(fresh):
            n = np.uint64(source[np.uint64(scratch[FRESH * ROOM + f])])
            scratch[CORNER * ROOM + f], scratch[(CORNER + 1) * ROOM + f] = triangles[n, 0], triangles[n, 1]
            scratch[(CORNER + 2) * ROOM + f] = triangles[n, 2]
    for f in range(fresh):
        p, q = np.uint64(scratch[CORNER * ROOM + f]), np.uint64(scratch[(CORNER + 1) * ROOM + f])
        r = np.uint64(scratch[(CORNER + 2) * ROOM + f])
        at = np.uint64(((before + f) & (RING - 1)) * (3 * channels))
        for c in range(np.uint64(0), np.uint64(channels)):
            u0 = np.float64(values[p, c])
            kept[at], kept[at + np.uint64(1)] = u0, np.float64(values[q, c]) - u0
            kept[at + np.uint64(2)] = np.float64(values[r, c]) - u0
            at += np.uint64(3)


@inline_kernel
def blend_runs(
    as_stored: Callable[[float], Any], flat: Array, start: Integer, end: Integer, channels: int, scratch: Int64Array,
    kept: Float64Array, lanes: Float64Array,
) -> None:  # fmt: skip
    """Write the values of some samples of a block run by run, one channel after the other.

    Shapes  flat: (H x W x channels,).
    """
    run, last = scratch[RUN * ROOM + start], scratch[RUN * ROOM + end - 1]
    while run <= last:
        first, final = max(scratch[FIRST * ROOM + run], start), min(scratch[FIRST * ROOM + run + 1], end)
        at = np.uint64(scratch[RECORD * ROOM + run] * (3 * channels))
        for c in range(channels):
            u0, more1, more2 = kept[at], kept[at + np.uint64(1)], kept[at + np.uint64(2)]
            at += np.uint64(3)
            for k in range(first, final):
                to, lane = np.uint64(scratch[PIXEL * ROOM + k] * channels + c), k - start
                flat[to] = as_stored(u0 + (lanes[LANES + lane] * more1 + lanes[2 * LANES + lane] * more2))
        run += 1


@inline_kernel
def blend_samples(
    as_stored: Callable[[float], Any], flat: Array, start: Integer, count: Integer, channels: int, scratch: Int64Array,
    kept: Float64Array, lanes: Float64Array,
) -> None:  # fmt: skip
    """Write the values of some samples of a block, one sample after the other."""
    for k in range(count):
        at = np.uint64(scratch[RECORD * ROOM + scratch[RUN * ROOM + start + k]] * (3 * channels))
        to = np.uint64(scratch[PIXEL * ROOM + start + k] * channels)
        b1, b2 = lanes[LANES + k], lanes[2 * LANES + k]
        for c in range(np.uint64(0), np.uint64(channels)):
            here = at + np.uint64(3) * c
            flat[to + c] = as_stored(kept[here] + (b1 * kept[here + np.uint64(1)] + b2 * kept[here + np.uint64(2)]))


@inline_kernel
def interpolate_rows(
    as_stored: Callable[[float], Any], slots: Int32Array, screen: ScreenTriangles, source: Int32Array, sample_x: Integer,
    sample_y: Integer, subpixel_bits: int, y_start: int, triangles: Int32Array, values: Array, out: Array,
) -> None:  # fmt: skip
    """Write the interpolated per-vertex values of every visible sample, 0 elsewhere.

    Shapes  slots: (h, W) int32, what is visible as a row of screen.corners, or -1; source: (N,) int32, the row of triangles for
            each of these, or (0,) where they are the same; triangles: (T, 3) int32; values: (V, k); out: (h, W, k), of the same
            type as values.
    Units   as for barycentric_kernel, whose weights these are, without being kept.
    """
    records, before, seen, flat = make_records(), np.int64(0), slots.reshape(-1), out.reshape(-1)
    lanes, scratch, has_odd = records.lanes, records.scratch, any_odd(screen.weights, screen.inner)
    height, width = slots.shape
    s, x, channels = np.int64(subpixel_bits), np.int64(sample_x), values.shape[1]
    y, kept = (np.int64(y_start) << s) + np.int64(sample_y), np.empty(RING * 3 * channels)
    for j in range(0, height, BLOCK_ROWS):
        for i in range(0, width, BLOCK_COLUMNS):
            covered, runs, fresh, has_odd = fetch_block(slots, seen, j, i, screen, has_odd, records, before)
            if covered < BLOCK_ROWS * BLOCK_COLUMNS:
                clear_block(flat, j, i, height, width, channels)
            is_long = bool(runs * LONG <= covered)
            write_values(fresh, before, source, triangles, values, channels, scratch, kept)
            before += fresh
            for start in range(0, covered, LANES):
                count = min(covered - start, LANES)
                weigh_samples(start, count, is_long, screen, x, y, s, has_odd, records)
                if is_long:
                    blend_runs(as_stored, flat, start, start + count, channels, scratch, kept, lanes)
                elif channels == 3:
                    # The compiler unrolls what it knows the number of, and colours are what is asked for most.
                    blend_samples(as_stored, flat, start, count, 3, scratch, kept, lanes)
                else:
                    blend_samples(as_stored, flat, start, count, channels, scratch, kept, lanes)


@kernel
def interpolate_rows_kernel(
    slots: Int32Array, screen: ScreenTriangles, source: Int32Array, sample_x: Integer, sample_y: Integer, subpixel_bits: int,
    y_start: int, triangles: Int32Array, values: Float64Array, out: Float64Array,
) -> None:  # fmt: skip
    """Interpolate float64 values; see interpolate_rows."""
    interpolate_rows(keep_float, slots, screen, source, sample_x, sample_y, subpixel_bits, y_start, triangles, values, out)


@kernel
def interpolate_float32_rows_kernel(
    slots: Int32Array, screen: ScreenTriangles, source: Int32Array, sample_x: Integer, sample_y: Integer, subpixel_bits: int,
    y_start: int, triangles: Int32Array, values: Float32Array, out: Float32Array,
) -> None:  # fmt: skip
    """Interpolate float32 values in float64, and round once; see interpolate_rows."""
    interpolate_rows(keep_float, slots, screen, source, sample_x, sample_y, subpixel_bits, y_start, triangles, values, out)


@kernel
def interpolate_codes_kernel(
    slots: Int32Array, screen: ScreenTriangles, source: Int32Array, sample_x: Integer, sample_y: Integer, subpixel_bits: int,
    y_start: int, triangles: Int32Array, values: UInt8Array, out: UInt8Array,
) -> None:  # fmt: skip
    """Interpolate codes of 8 bits in float64, and round half up once; see interpolate_rows."""
    interpolate_rows(nearest_code, slots, screen, source, sample_x, sample_y, subpixel_bits, y_start, triangles, values, out)


@kernel
def interpolate_vertices_kernel(
    numbers: Int32Array, barycentric: Float64Array, triangles: Int32Array, values: Float64Array, out: Float64Array
) -> None:
    """Write the interpolated per-vertex values of every visible sample, and leave the others.

    Shapes  numbers: (n,) int32 triangle or -1; barycentric: (n, 3); triangles: (T, 3) int32; values: (V, k) float64;
            out: (n, k).
    """
    for i in range(numbers.shape[0]):
        n = numbers[i]
        if n >= 0:
            p, q, r = triangles[n, 0], triangles[n, 1], triangles[n, 2]
            for k in range(values.shape[1]):
                out[i, k] = blend(values[p, k], values[q, k], values[r, k], barycentric[i, 1], barycentric[i, 2])


@kernel
def interpolate_corners_kernel(numbers: Int32Array, barycentric: Float64Array, values: Float32Array, out: Float32Array) -> None:
    """Write the interpolated per-corner values of every visible sample, and leave the others.

    Shapes  numbers: (n,) int32 triangle or -1; barycentric: (n, 3) float64; values: (T, 3, k) float32; out: (n, k) float32.
    """
    for i in range(numbers.shape[0]):
        n = numbers[i]
        if n >= 0:
            for k in range(values.shape[2]):
                out[i, k] = np.float32(
                    blend(
                        np.float64(values[n, 0, k]), np.float64(values[n, 1, k]), np.float64(values[n, 2, k]),
                        barycentric[i, 1], barycentric[i, 2],
                    )
                )  # fmt: skip
