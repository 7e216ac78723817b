"""Points: which pixel each lies in, and the writing of them, a block at a time.

Two passes over each block of some thousand points, which stays in the cache. The first turns coordinates into places in the
image: one affine step, a floor and the limits, in selects without a branch, so that the compiler uses vector instructions. The
second writes. Done in one pass, the vector instructions are lost, and a point waits for the one before it: three to four times
slower (docs/decisions/0010-aggregation.md). What lies outside goes to one place more, behind the image, and is forgotten there.

A pixel holds what is from its low border on up to before its high border, in the caller's coordinates. Whether a point lies in
the image at all is decided by comparing it with the bounds, and a product that rounds up to the border of the image is held
back in the last pixel: every point within the bounds is in one pixel, and none without is.

Many threads share the points twice: each takes a part of them and sorts it by bands of the image, keeping their order; then
each takes bands and writes what all parts have for them, in order. So a pixel gets its points in the order in which they came.

Source: the counting sort of radix sort, D. Knuth, The Art of Computer Programming 3, 5.2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import inline_kernel, kernel
from scanspan.records import Array, Float64Array, Int32Array, Int64Array


@kernel
def place_points(
    x: Float64Array, y: Float64Array, x_low: float, x_high: float, y_low: float, y_high: float, x_scale: float, y_scale: float,
    width: int, height: int, is_up: bool, place: Int32Array,
) -> bool:  # fmt: skip
    """Write the place of each point in the image, and say if all are finite.

    A place is row times width plus column; for points outside it is width times height.

    Shapes  x, y: (n,); place: (n,) int32, written.
    Units   x, y, bounds: the caller's; scales: pixels in one of them; is_up: whether y goes up, so that row 0 is the highest.
    Needs   width times height below 2^31.
    """
    start, step = (np.int64(height - 1) * width, -np.int64(width)) if is_up else (np.int64(0), np.int64(width))
    outside, right, last = np.int64(width) * height, np.int64(width - 1), np.int64(height - 1)
    unfit = False
    for i in range(x.shape[0]):
        u, v = x[i], y[i]
        unfit |= (u - u != 0.0) | (v - v != 0.0)
        inside = (u >= x_low) & (u < x_high) & (v >= y_low) & (v < y_high)
        across = (u - x_low) * x_scale if inside else 0.0
        along = (v - y_low) * y_scale if inside else 0.0
        column, row = min(np.int64(across), right), min(np.int64(along), last)
        place[i] = np.int32(start + row * step + column if inside else outside)
    return not unfit


@kernel
def sort_places(
    place: Int32Array, values: Float64Array, shift: int, starts: Int64Array, sorted_place: Int32Array,
    sorted_values: Float64Array,
) -> None:  # fmt: skip
    """Sort places by band, place >> shift, and their values with them; within a band they keep their order.

    Shapes  place, sorted_place: (n,) int32; values, sorted_values: (n,), or both (0,) where there are none; starts:
            (bands + 1,), written: where each band begins.
    """
    ends, bands = np.zeros(starts.shape[0], np.int64), starts.shape[0] - 1
    for i in range(place.shape[0]):
        ends[np.uint64(place[i] >> shift)] += 1
    total = np.int64(0)
    for b in range(bands):
        starts[b] = total
        total += ends[b]
        ends[b] = starts[b]
    starts[bands] = total

    # Put each at the end of its band.
    for i in range(place.shape[0]):
        band = np.uint64(place[i] >> shift)
        end = ends[band]
        sorted_place[np.uint64(end)] = place[i]
        if values.shape[0] > 0:
            sorted_values[np.uint64(end)] = values[i]
        ends[band] = end + 1


@inline_kernel
def write_points(write_sample: Callable[..., None], target: Array, place: Int32Array, values: Float64Array) -> None:
    """Write points, one after the other.

    Shapes  target: (pixels + 1, ...), the image row after row; place: (n,) int32; values: (n,), handed to the writer, or (0,).
    """
    if values.shape[0] > 0:
        for i in range(place.shape[0]):
            write_sample(target, np.uint64(place[i]), True, values[i], 0)
    else:
        for i in range(place.shape[0]):
            write_sample(target, np.uint64(place[i]), True, 0.0, 0)
