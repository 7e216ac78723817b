"""Lines and strokes on a canvas: batches of segments and of shapes handed to their kernels, in order, by bands of rows.

A band of rows has one owner and takes everything in order, so the pixels are the same for any number of threads. Segments are
clipped to the band exactly, which moves no pixel; one that misses it costs a few nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event

import numpy as np

from scanspan.bands import run_bands
from scanspan.geometry.fixed_point import snap_points
from scanspan.geometry.stroke import Shapes
from scanspan.jit import kernel
from scanspan.raster.algorithms import CHUNK, SMALL
from scanspan.raster.area_edges import AREA_BITS
from scanspan.raster.options import sample_centers
from scanspan.raster.polygon import NON_ZERO
from scanspan.raster.segment import DIAMOND_EXIT
from scanspan.raster.wu import draw_pairs
from scanspan.records import Array, Float64Array, Int64Array, UInt8Array
from scanspan.target.blend import blend_over
from scanspan.target.cover import paint_polygons
from scanspan.target.fill import fill_polygons

LINE_BITS = 8  # sub-pixel bits of lines whose ends lie between pixels
SNAPPED = 1 << 14  # segments that are put on the grid at once, so that they stay in the cache


def snap_segments(ends: Float64Array, rule: int) -> Int64Array:
    """Return (N, 2, 2) ends as (N, 4) whole numbers: the pixels that they lie in, or sub-pixels for DIAMOND_EXIT."""
    rows = ends.reshape(-1, 4)
    steps = np.empty(rows.shape, np.int64)
    for first in range(0, len(rows), SNAPPED):
        part = rows[first : first + SNAPPED]
        steps[first : first + SNAPPED] = np.rint(part * float(1 << LINE_BITS)) if rule == DIAMOND_EXIT else np.floor(part)
    return steps


@kernel
def pairs_kernel(
    target: UInt8Array, segments: Int64Array, values: Float64Array, is_linear: int, y_start: int, y_end: int
) -> None:
    """Segments by Wu's rule into (H, W, 4) pixels."""
    width = target.shape[1]
    flat = target.reshape(target.shape[0] * width, 4)
    draw_pairs(blend_over, flat, np.int64(width), np.int64(y_start), np.int64(y_end), segments, values, is_linear)


def paint_segments(
    target: Array, segments: Int64Array, values: Float64Array, threads: int, kernel: Callable[..., None], *options: int
) -> None:
    """Paint segments one pixel wide, in order.

    Parameters
    ----------
    target : (H, W) int32 or (H, W, 4) uint8 pixels, as the kernel takes them.
    segments : (N, 4), from snap_segments.
    values : (N,) packed colours.
    threads : how many share the rows.
    kernel : one of SEGMENT_KERNELS, or pairs_kernel.
    options : what it takes before the rows.
    """
    count = len(segments)

    def scan_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band, in chunks so that an interrupt is noticed between them."""
        for first in range(0, count, CHUNK):
            if not stop.is_set():
                part = slice(first, first + CHUNK)
                kernel(target, segments[part], values[part], *options, y_start, y_end)

    run_bands(scan_band, len(target), 1 if count < SMALL else threads, each=1)


def paint_shapes(target: UInt8Array, shapes: Shapes, values: Float64Array, is_linear: bool, threads: int) -> None:
    """Paint shapes in order, each by the area of pixels that it covers by the non-zero rule.

    Parameters
    ----------
    target : (H, W, 4) pixels.
    values : (S,) packed colours.
    """
    xy, starts, polygons = snap_points(shapes.xy, int(AREA_BITS)), shapes.ring_starts, shapes.shape_rings
    colors = values.astype(np.int64)
    if len(xy):
        paint_polygons(
            target, xy, starts.astype(np.int32), polygons.astype(np.int32), NON_ZERO, colors, is_linear, False, threads
        )


def paint_covered(pixels: UInt8Array, shapes: Shapes, values: Float64Array, is_opaque: bool, blend: str, threads: int) -> None:
    """Paint shapes in order, each where it holds centres of pixels by the non-zero rule; arguments as for stroke_segments."""
    size = pixels.shape[1], pixels.shape[0]
    sampling = sample_centers(size, LINE_BITS)
    starts, polygons = shapes.ring_starts.astype(np.int32), shapes.shape_rings.astype(np.int32)
    target, kind = (pixels.view(np.int32)[..., 0], "opaque") if is_opaque else (pixels, blend)
    xy = snap_points(shapes.xy, LINE_BITS)
    fill_polygons(kind, target, xy, starts, polygons, NON_ZERO, values, sampling, threads)
