"""Wireframe overlay: how far a visible sample is from the nearest edge of its face, on the screen.

The distance is the edge value over the edge's length, so the overlay needs no lines, hides what is hidden, and cannot stray
from the triangles. Half a line is drawn on either side of an edge; the cuts inside a polygon are no edges.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.depth_plane import UNCUT
from scanspan.geometry.fixed_point import halves_float, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float32Array, Int32Array, Integer, ScreenTriangles, UInt8Array


@helper_kernel
def line_distance(a: Integer, b: Integer, q_x: Integer, q_y: Integer, x: Integer, y: Integer) -> float:
    """Return the distance of a sample to the line with the edge function a (x - q_x) + b (y - q_y), in sub-pixels."""
    high, low = product_halves(a, b, x - q_x, y - q_y)
    across, down = np.float64(b), np.float64(a)
    return abs(halves_float(high, low)) / np.sqrt(across * across + down * down)


@helper_kernel
def edge_distance(a_x: Integer, a_y: Integer, b_x: Integer, b_y: Integer, x: Integer, y: Integer) -> float:
    """Return the distance of a sample to the line through a and b, all in sub-pixels."""
    return line_distance(a_y - b_y, b_x - a_x, a_x, a_y, x, y)


@kernel
def overlay_edges_kernel(
    slots: Int32Array, triangles: ScreenTriangles, inner: UInt8Array, sample_x: Integer, sample_y: Integer,
    subpixel_bits: int, y_start: int, width: float, color: Float32Array, out: Float32Array,
) -> None:  # fmt: skip
    """Paint the samples that lie within half a line's width of an edge.

    Shapes  slots: (h, W) int32; triangles: ScreenTriangles; inner: (T,) uint8 of the DrawList; color: (4,) float32;
            out: (h, W, 4) float32 linear.
    Units   width in pixels; sample_x, sample_y in sub-pixels; y_start: row of the image that slots begin with.
    """
    xy, corners, outline, lines = triangles.xy, triangles.corners, triangles.outline, triangles.lines
    limit = 0.5 * width * np.float64(np.int64(1) << subpixel_bits)
    for j in range(slots.shape[0]):
        y = ((y_start + j) << subpixel_bits) + sample_y
        for i in range(slots.shape[1]):
            n = slots[j, i]
            if n < 0:
                continue
            x = (i << subpixel_bits) + sample_x
            p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
            is_uncut = triangles.inner[n] & UNCUT != 0
            is_whole = triangles.piece[n] < 0 or is_uncut
            hidden = triangles.inner[n] | inner[triangles.source[n]] if is_whole else triangles.inner[n]
            if is_uncut:
                m = outline[n]
                for k in range(3):
                    distance = line_distance(lines[m, k, 0], lines[m, k, 1], lines[m, k, 2], lines[m, k, 3], x, y)
                    if hidden >> k & 1 == 0 and distance <= limit:
                        out[j, i] = color
                continue
            near = hidden & 1 == 0 and edge_distance(xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1], x, y) <= limit
            near |= hidden & 2 == 0 and edge_distance(xy[r, 0], xy[r, 1], xy[p, 0], xy[p, 1], x, y) <= limit
            near |= hidden & 4 == 0 and edge_distance(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], x, y) <= limit
            if near:
                for k in range(4):
                    out[j, i, k] = color[k]
