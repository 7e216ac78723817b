"""Painting: the traversals of raster/ joined with the writers that lay colours over pixels, in the order in which things come.

Source: the painter's algorithm, as in the lectures.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from scanspan.jit import inline_kernel, kernel
from scanspan.raster.crossings import scan_polygons
from scanspan.raster.edge_walk import edge_walk
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.micropolygon import micropolygon
from scanspan.raster.parity import parity_fill
from scanspan.raster.segment import draw_segments
from scanspan.raster.setup import keep_flat, keep_sample
from scanspan.raster.warnock import HIDES_NOTHING, warnock
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.target.blend import blend_over, write_sample_linear, write_sample_paint, write_sample_srgb


@kernel
def half_space_linear(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W, 4) pixels, in linear light."""
    half_space(visit_rows, write_sample_linear, keep_flat, target, counters, triangles, first, last, sampling)


@kernel
def half_space_srgb(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W, 4) pixels, in sRGB values."""
    half_space(visit_rows, write_sample_srgb, keep_flat, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_opaque(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W) pixels of 32 bits."""
    edge_walk(write_sample_paint, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_linear(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W, 4) pixels, in linear light."""
    edge_walk(write_sample_linear, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_srgb(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W, 4) pixels, in sRGB values."""
    edge_walk(write_sample_srgb, target, counters, triangles, first, last, sampling)


@kernel
def warnock_opaque(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W) pixels of 32 bits."""
    warnock(write_sample_paint, keep_sample, HIDES_NOTHING, target, counters, triangles, first, last, sampling)


@kernel
def warnock_linear(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W, 4) pixels, in linear light."""
    warnock(write_sample_linear, keep_sample, HIDES_NOTHING, target, counters, triangles, first, last, sampling)


@kernel
def warnock_srgb(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W, 4) pixels, in sRGB values."""
    warnock(write_sample_srgb, keep_sample, HIDES_NOTHING, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_opaque(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W) pixels of 32 bits."""
    micropolygon(write_sample_paint, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_linear(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W, 4) pixels, in linear light."""
    micropolygon(write_sample_linear, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_srgb(
    target: UInt8Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W, 4) pixels, in sRGB values."""
    micropolygon(write_sample_srgb, target, counters, triangles, first, last, sampling)


@kernel
def segments_opaque(
    target: Int32Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W) pixels of 32 bits."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width)
    draw_segments(
        write_sample_paint, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_linear(
    target: UInt8Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W, 4) pixels, in linear light."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width, 4)
    draw_segments(
        write_sample_linear, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@kernel
def segments_srgb(
    target: UInt8Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int, y_start: int, y_end: int
) -> None:
    """Segments into (H, W, 4) pixels, in sRGB values."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width, 4)
    draw_segments(
        write_sample_srgb, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, rule, subpixel_bits
    )


@inline_kernel
def fill_span(
    write_sample: Callable[..., None],
    target: Array,
    total: Integer,
    color: Integer,
    y: Integer,
    x_start: Integer,
    x_end: Integer,
) -> tuple[Array, Integer]:
    """Paint a span of a polygon; what scan_polygons takes for its owner is its colour."""
    row = target[y, x_start:x_end]
    for q in range(row.shape[0]):
        write_sample(row, q, True, np.float64(color), 0)
    return target, total


@inline_kernel
def fill_span_opaque(target: Any, total: Any, color: Any, y: Any, x_start: Any, x_end: Any, s: Any) -> Any:
    """Fill a span of pixels of 32 bits."""
    return fill_span(write_sample_paint, target, total, color, y, x_start, x_end)


@inline_kernel
def fill_span_linear(target: Any, total: Any, color: Any, y: Any, x_start: Any, x_end: Any, s: Any) -> Any:
    """Fill a span in linear light."""
    return fill_span(write_sample_linear, target, total, color, y, x_start, x_end)


@inline_kernel
def fill_span_srgb(target: Any, total: Any, color: Any, y: Any, x_start: Any, x_end: Any, s: Any) -> Any:
    """Fill a span in sRGB values."""
    return fill_span(write_sample_srgb, target, total, color, y, x_start, x_end)


@kernel
def scanline_opaque(
    target: Int32Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    colors: Int64Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Polygons, one after the other, into (H, W) pixels of 32 bits."""
    scan_polygons(fill_span_opaque, target, colors, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def scanline_linear(
    target: UInt8Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    colors: Int64Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Polygons, one after the other, into (H, W, 4) pixels, in linear light."""
    scan_polygons(fill_span_linear, target, colors, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def scanline_srgb(
    target: UInt8Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    colors: Int64Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Polygons, one after the other, into (H, W, 4) pixels, in sRGB values."""
    scan_polygons(fill_span_srgb, target, colors, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def parity_opaque(
    target: Int32Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int, value: float, sampling: Sampling
) -> None:
    """Parity fill into (H, W) pixels of 32 bits."""
    parity_fill(write_sample_paint, target, xy, ring_starts, fill_rule, value, sampling)


@kernel
def parity_linear(
    target: UInt8Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int, value: float, sampling: Sampling
) -> None:
    """Parity fill into (H, W, 4) pixels, in linear light."""
    parity_fill(write_sample_linear, target, xy, ring_starts, fill_rule, value, sampling)


@kernel
def parity_srgb(
    target: UInt8Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int, value: float, sampling: Sampling
) -> None:
    """Parity fill into (H, W, 4) pixels, in sRGB values."""
    parity_fill(write_sample_srgb, target, xy, ring_starts, fill_rule, value, sampling)


@kernel
def cover_kernel(target: UInt8Array, cover: Float64Array, color: int, is_linear: int) -> None:
    """Lay a colour over pixels as far as each is covered.

    Shapes  target: (H, W, 4) uint8; cover: (H, W), 0 to 1; color: packed as by pack_colors.
    """
    for y in range(target.shape[0]):
        row = target[y]
        for x in range(target.shape[1]):
            if cover[y, x] > 0.0:
                blend_over(row, x, color, np.float32(min(cover[y, x], 1.0)), is_linear)


def segments_in_all_rows(
    kind: str, target: Array, segments: Int64Array, values: Float64Array, rule: int, subpixel_bits: int
) -> None:
    """Paint segments into all rows of a target."""
    SEGMENT_KERNELS[kind](target, segments, values, rule, subpixel_bits, 0, len(target))


# By algorithm and by what is done to a pixel: replaced, or blended in linear light or in sRGB values.
# What half-space replaces is painted by triangles.py.
PAINTERS: dict[str, dict[str, Callable[..., None]]] = {
    "half-space": {"linear": half_space_linear, "srgb": half_space_srgb},
    "edge-walk": {"opaque": edge_walk_opaque, "linear": edge_walk_linear, "srgb": edge_walk_srgb},
    "warnock": {"opaque": warnock_opaque, "linear": warnock_linear, "srgb": warnock_srgb},
    "micropolygon": {"opaque": micropolygon_opaque, "linear": micropolygon_linear, "srgb": micropolygon_srgb},
}
SEGMENT_KERNELS: dict[str, Callable[..., None]] = {"opaque": segments_opaque, "linear": segments_linear, "srgb": segments_srgb}
SEGMENTS: dict[str, Callable[..., None]] = {kind: partial(segments_in_all_rows, kind) for kind in SEGMENT_KERNELS}
SCANLINE: dict[str, Callable[..., None]] = {"opaque": scanline_opaque, "linear": scanline_linear, "srgb": scanline_srgb}
PARITY: dict[str, Callable[..., None]] = {"opaque": parity_opaque, "linear": parity_linear, "srgb": parity_srgb}
