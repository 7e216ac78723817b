"""Strokes and points painted: their shapes are made a batch at a time and handed on, so that a million need little memory."""

from __future__ import annotations

from functools import partial

import numpy as np

from scanspan.geometry.chain import chain_rings, without_repeats
from scanspan.geometry.dash import dash_chain, dash_segments
from scanspan.geometry.stroke import Shapes, circle, point_shapes, segment_shapes
from scanspan.raster.stroke_options import Stroke
from scanspan.records import Float64Array, Int64Array, UInt8Array
from scanspan.target.blend import pack_colors, pack_values
from scanspan.target.strokes import paint_covered, paint_shapes

BATCH = 1 << 16  # points of outlines that are made at once


def stroke_segments(
    pixels: UInt8Array, ends: Float64Array, codes: UInt8Array, stroke: Stroke, antialias: bool, blend: str, threads: int
) -> None:
    """Paint the strokes of segments, one after the other.

    Parameters
    ----------
    pixels : (H, W, 4).
    ends : (N, 2, 2) in pixels.
    codes : (4,) or (N, 4).
    antialias : whether pixels are blended by the area that is covered, or painted where their centre is.
    blend : "linear" or "srgb".
    """
    values = pack_values(codes, len(ends))
    is_opaque, is_linear = bool((codes[..., 3] == 255).all()), blend == "linear"
    size = max(1, BATCH // (len(circle(stroke.width / 2)) + 2 if stroke.cap == "round" else 4))
    for first in range(0, len(ends), size):
        part, colors = ends[first : first + size], values[first : first + size]
        shapes = dashed_shapes(part, stroke)
        if not antialias:
            paint_covered(pixels, shapes, colors, is_opaque, blend, threads)
        else:
            paint_shapes(pixels, shapes, colors, is_linear, threads)


def dashed_shapes(ends: Float64Array, stroke: Stroke) -> Shapes:
    """Return the strokes of segments, (N, 2, 2), a shape for each, of as many rings as it has dashes."""
    if stroke.dash is None:
        return segment_shapes(ends, stroke.width, stroke.cap)
    dashes, vectors, owner = dash_segments(ends, stroke.dash, stroke.dash_offset)
    shapes = segment_shapes(dashes, stroke.width, stroke.cap, vectors)
    rings: Int64Array = np.searchsorted(owner, np.arange(len(ends) + 1)).astype(np.int64)
    return shapes._replace(shape_rings=rings)


def stroke_chain(
    pixels: UInt8Array, points: Float64Array, closed: bool, code: UInt8Array, stroke: Stroke, antialias: bool, blend: str,
    threads: int,
) -> None:  # fmt: skip
    """Paint the stroke of a polyline, (M, 2), at once: what it covers twice is painted once. See stroke_segments."""
    outline = partial(chain_rings, width=stroke.width, cap=stroke.cap, join=stroke.join, miter_limit=stroke.miter_limit)
    chain = without_repeats(points, closed)
    if stroke.dash is None or len(chain) < 2:
        rings = outline(chain, closed=closed)
    else:
        whole = np.concatenate([chain, chain[:1]]) if closed else chain
        straight, vectors, bent = dash_chain(whole, stroke.dash, stroke.dash_offset)
        outlines = segment_shapes(straight, stroke.width, stroke.cap, vectors)
        rings = np.split(outlines.xy, outlines.ring_starts[1:-1]) if len(straight) else []
        rings += [ring for dash in bent for ring in outline(dash, closed=False)]
    if not rings:
        return
    starts = np.cumsum([0, *map(len, rings)]).astype(np.int64)
    shapes, color = Shapes(np.concatenate(rings), starts, np.array([0, len(rings)], np.int64)), pack_colors(code)[None]
    if antialias:
        paint_shapes(pixels, shapes, color, blend == "linear", threads)
    else:
        paint_covered(pixels, shapes, color, int(code[3]) == 255, blend, threads)


def cover_points(
    pixels: UInt8Array, centres: Float64Array, codes: UInt8Array, size: float, shape: str, is_linear: bool, threads: int
) -> None:
    """Paint squares or discs round centres, (N, 2), by the area of pixels that they cover."""
    values = pack_values(codes, len(centres))
    step = max(1, BATCH // (4 if shape == "square" else len(circle(size / 2))))
    for first in range(0, len(centres), step):
        shapes = point_shapes(centres[first : first + step], size, shape)
        paint_shapes(pixels, shapes, values[first : first + step], is_linear, threads)
