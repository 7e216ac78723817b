"""Planes of colour over a triangle: a channel at a pixel, from exact edge values.

A channel is u0 + (E1 (u1 - u0) + E2 (u2 - u0)) / 2A, rounded half up once. The sum is exact in float64 for 8-bit colours and
triangles of up to 2^23 px, and so is the rounding: ties lie further from their neighbours than the margin that makes up for the
product with 1 / 2A. Channels that are constant over a triangle come out exactly constant, whatever its size.

Source: Gouraud 1971; the plane equations of the lectures.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import halves_float, product_halves
from scanspan.jit import bare_helper
from scanspan.raster.setup import NEAR
from scanspan.records import Array, Integer, Sampling

SURE = float(1 << 21)  # sub-pixels along a side, below which sums of edge values times 8-bit colours are exact in float64
OPAQUE = np.int64(1 << 24)  # less this, a word of three channels has an alpha of 255
ALPHA = np.int32(-(1 << 24))  # that alpha in a word
MARGIN = 2.0**-41  # above the error of a channel, below the distance of a value from a tie that it does not meet


@bare_helper
def exact_value(a: Integer, b: Integer, dx: Integer, dy: Integer, is_near: bool | np.bool_) -> float:
    """Return a dx + b dy, rounded once to float64 where it does not fit. Needs: is_near is true only if it fits an int64."""
    if is_near:
        return np.float64(a * dx + b * dy)
    high, low = product_halves(a, b, dx, dy)
    return halves_float(high, low)


@bare_helper
def start_planes(
    p_x: Integer, p_y: Integer, q_x: Integer, q_y: Integer, r_x: Integer, r_y: Integer, i: Integer, j: Integer,
    sampling: Sampling,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return two edge values of a triangle at a pixel's sample, how they step to the next pixel, and the inverse of 2A."""
    s = sampling.subpixel_bits
    x, y = (i << s) + sampling.sample_x, (j << s) + sampling.sample_y
    a1, b1, a2, b2 = r_y - p_y, p_x - r_x, p_y - q_y, q_x - p_x
    dx, dy = x - p_x, y - p_y
    is_near = max(dx, -dx, dy, -dy, a1, -a1, b1, -b1, a2, -a2, b2, -b2) < NEAR
    e1, e2 = exact_value(a1, b1, dx, dy, is_near), exact_value(a2, b2, dx, dy, is_near)
    area = exact_value(a2, b2, r_x - p_x, r_y - p_y, is_near)
    return e1, e2, np.float64(a1 << s), np.float64(a2 << s), 1.0 / area


@bare_helper
def channel_plane(
    u0: float, u1: float, u2: float, e1: float, e2: float, step1: float, step2: float
) -> tuple[float, float, float]:
    """Return a channel of a run of pixels, from its values at three corners, as floor((start + i step) / 2A + part)."""
    d1, d2 = u1 - u0, u2 - u0
    return e1 * d1 + e2 * d2, step1 * d1 + step2 * d2, (u0 + 0.5) + MARGIN


@bare_helper
def corner_values(colors: Array, n: Integer, p: Integer, q: Integer, r: Integer, k: int) -> tuple[float, float, float]:
    """Return channel k of three corners of triangle n."""
    return np.float64(colors[n, p, k]), np.float64(colors[n, q, k]), np.float64(colors[n, r, k])


@bare_helper
def channel_code(start: float, step: float, part: float, inverse: float, i: Integer) -> Integer:
    """Return a channel's code at pixel i of a run."""
    return np.int64(min(max(np.floor((start + np.float64(i) * step) * inverse + part), 0.0), 255.0))


@bare_helper
def sure_code(start: float, step: float, part: float, inverse: float, i: Integer) -> np.int32:
    """Return what channel_code does where the sums are exact: then a code is within its range at every covered sample."""
    return np.int32((start + np.float64(i) * step) * inverse + part)


@bare_helper
def pack_word(red: np.int32, green: np.int32, blue: np.int32) -> np.int32:
    """Return an opaque pixel as it is stored."""
    return np.int32(red | (green << np.int32(8)) | (blue << np.int32(16)) | ALPHA)
