"""Interpolation: barycentric weights of visible samples, and attributes from them, correct in perspective.

A weight comes from the exact edge value at the sample, E_k / 2A on the screen, and is divided by w before it is normed, so the
sum of the three is the interpolated 1 / w. For a piece of a clipped triangle they are then carried over to the corners of its
source. A triangle that is not clipped (raster/homogeneous_edges.py) has its weights as planes of x and y. An attribute is
u_0 + b_1 (u_1 - u_0) + b_2 (u_2 - u_0): a constant comes out exactly constant.

Source: Heckbert and Moreton 1991; the edge values are the lectures' sub-areas.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.depth_plane import UNCUT
from scanspan.geometry.fixed_point import halves_float, product_halves
from scanspan.geometry.outlines import REACHES_OUT
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float32Array, Float64Array, Int32Array, Integer, ScreenTriangles


@helper_kernel
def edge_value(a_x: Integer, a_y: Integer, b_x: Integer, b_y: Integer, x: Integer, y: Integer) -> float:
    """Return the value of the edge from a to b at a sample."""
    high, low = product_halves(a_y - b_y, b_x - a_x, x - a_x, y - a_y)
    return halves_float(high, low)


@helper_kernel
def line_weight(weights: Float64Array, m: Integer, k: int, x: Integer, y: Integer) -> float:
    """Return what the share of corner k of a triangle that is not clipped is proportional to, at a sample."""
    weight: float = (weights[m, k, 0] * np.float64(x) + weights[m, k, 1] * np.float64(y)) + weights[m, k, 2]
    return weight


@kernel
def barycentric_kernel(
    slots: Int32Array, triangles: ScreenTriangles, sample_x: Integer, sample_y: Integer, subpixel_bits: int, y_start: int,
    out: Float64Array,
) -> None:  # fmt: skip
    """Write the perspective-correct weights of the source triangle's corners at every visible sample, 0 elsewhere.

    Shapes  slots: (h, W) int32, row of triangles.corners or -1; triangles: ScreenTriangles; out: (h, W, 3) float64.
    Units   sample_x, sample_y in sub-pixels from the pixel's corner; y_start: row of the image that slots begin with.
    """
    xy, clip, corners = triangles.xy, triangles.clip, triangles.corners
    piece, weights, inner = triangles.piece, triangles.weights, triangles.inner
    for j in range(slots.shape[0]):
        y = ((y_start + j) << subpixel_bits) + sample_y
        for i in range(slots.shape[1]):
            n = slots[j, i]
            if n < 0:
                out[j, i] = 0.0
                continue

            # Weigh the corners by the edge values opposite them.
            x = (i << subpixel_bits) + sample_x
            p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
            m = piece[n]
            if inner[n] & UNCUT:
                e0, e1, e2 = (
                    line_weight(weights, m, 0, x, y),
                    line_weight(weights, m, 1, x, y),
                    line_weight(weights, m, 2, x, y),
                )
                w_p, w_q, w_r = 1.0, 1.0, 1.0
            else:
                e0 = edge_value(xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1], x, y)
                e1 = edge_value(xy[r, 0], xy[r, 1], xy[p, 0], xy[p, 1], x, y)
                e2 = edge_value(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], x, y)
                w_p, w_q, w_r = clip[p, 3], clip[q, 3], clip[r, 3]

            # Turn a clockwise triangle's signs round. A pixel that is touched beside its centre takes the triangle's border.
            turn = -1.0 if (e0 + e1) + e2 < 0.0 else 1.0
            low = -np.inf if inner[n] & REACHES_OUT else 0.0
            w0, w1, w2 = max(turn * e0, low) / w_p, max(turn * e1, low) / w_q, max(turn * e2, low) / w_r
            total = (w0 + w1) + w2
            w0, w1, w2 = w0 / total, w1 / total, w2 / total

            # Carry the weights of a piece over to its source.
            if m >= 0 and inner[n] & UNCUT == 0:
                for k in range(3):
                    out[j, i, k] = (w0 * weights[m, 0, k] + w1 * weights[m, 1, k]) + w2 * weights[m, 2, k]
            else:
                out[j, i, 0], out[j, i, 1], out[j, i, 2] = w0, w1, w2


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
