"""Reductions: what a pixel keeps of all that falls on it, its number, sum, mean, least or greatest value.

The traversals of raster/ joined with writers that forget nothing and hide nothing. As in painting, the value comes where others
have a depth: a triangle whose corners are all that deep has that value in every sample, and one whose corners differ has them
interpolated exactly as depths are. A pixel that nothing has fallen on holds NaN, from the beginning; only numbers are 0.

Values reach a pixel in the order of their primitives, whatever the threads: each row has one owner. So even sums, which depend
on their order in the last bits, have the same bits for any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.raster.half_space import half_space, half_space_hits, visit_rows
from scanspan.raster.points import write_points
from scanspan.raster.segment import draw_segments
from scanspan.raster.setup import keep_sample
from scanspan.raster.write import write_sample_hit
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles

REDUCTIONS = ("count", "sum", "mean", "min", "max")


@helper_kernel
def write_sample_sum(row: Float64Array, q: int, inside: bool, value: float, number: Integer) -> None:
    """Add a value to one sample of a row of sums."""
    old = row[q]
    total = old + value if old == old else value
    row[q] = total if inside else old


@helper_kernel
def write_sample_mean(row: Float64Array, q: int, inside: bool, value: float, number: Integer) -> None:
    """Add a value to one sample of a row of pairs, the sum and how many there are."""
    row[q, 0] += value if inside else 0.0
    row[q, 1] += 1.0 if inside else 0.0


@helper_kernel
def write_sample_min(row: Float64Array, q: int, inside: bool, value: float, number: Integer) -> None:
    """Keep the least value of one sample of a row."""
    old = row[q]
    row[q] = value if inside & (not (old <= value)) else old


@helper_kernel
def write_sample_max(row: Float64Array, q: int, inside: bool, value: float, number: Integer) -> None:
    """Keep the greatest value of one sample of a row."""
    old = row[q]
    row[q] = value if inside & (not (old >= value)) else old


@kernel
def triangles_sum(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Triangles into (H, W) sums."""
    half_space(visit_rows, write_sample_sum, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def triangles_mean(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Triangles into (H, W, 2) sums and numbers."""
    half_space(visit_rows, write_sample_mean, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def triangles_min(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Triangles into (H, W) least values."""
    half_space(visit_rows, write_sample_min, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def triangles_max(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Triangles into (H, W) greatest values."""
    half_space(visit_rows, write_sample_max, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def segments_count(
    target: Int32Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W) hits."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width)
    draw_segments(
        write_sample_hit, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_sum(
    target: Float64Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W) sums."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width)
    draw_segments(
        write_sample_sum, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_mean(
    target: Float64Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W, 2) sums and numbers."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width, 2)
    draw_segments(
        write_sample_mean, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_min(
    target: Float64Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W) least values."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width)
    draw_segments(
        write_sample_min, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_max(
    target: Float64Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W) greatest values."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width)
    draw_segments(
        write_sample_max, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def points_count(target: Int32Array, place: Int32Array, values: Float64Array) -> None:
    """Points into (pixels + 1,) hits."""
    write_points(write_sample_hit, target, place, values)


@kernel
def points_sum(target: Float64Array, place: Int32Array, values: Float64Array) -> None:
    """Points into (pixels + 1,) sums."""
    write_points(write_sample_sum, target, place, values)


@kernel
def points_mean(target: Float64Array, place: Int32Array, values: Float64Array) -> None:
    """Points into (pixels + 1, 2) sums and numbers."""
    write_points(write_sample_mean, target, place, values)


@kernel
def points_min(target: Float64Array, place: Int32Array, values: Float64Array) -> None:
    """Points into (pixels + 1,) least values."""
    write_points(write_sample_min, target, place, values)


@kernel
def points_max(target: Float64Array, place: Int32Array, values: Float64Array) -> None:
    """Points into (pixels + 1,) greatest values."""
    write_points(write_sample_max, target, place, values)


TRIANGLES: dict[str, Callable[..., None]] = {
    "count": half_space_hits, "sum": triangles_sum, "mean": triangles_mean, "min": triangles_min, "max": triangles_max,
}  # fmt: skip
SEGMENTS: dict[str, Callable[..., None]] = {
    "count": segments_count, "sum": segments_sum, "mean": segments_mean, "min": segments_min, "max": segments_max,
}  # fmt: skip
POINTS: dict[str, Callable[..., None]] = {
    "count": points_count, "sum": points_sum, "mean": points_mean, "min": points_min, "max": points_max,
}  # fmt: skip


def make_target(reduce: str, pixels: int) -> Array:
    """Return an empty target for a reduction, (pixels,) or (pixels, 2)."""
    if reduce == "count":
        return np.zeros(pixels, np.int32)
    return np.zeros((pixels, 2)) if reduce == "mean" else np.full(pixels, np.nan)


def finish(reduce: str, target: Array) -> Array:
    """Return what a target holds, one number a pixel; empty ones are NaN, or 0 in a count."""
    if reduce != "mean":
        return target
    with np.errstate(invalid="ignore"):
        means: Float64Array = target[..., 0] / target[..., 1]
    return means
