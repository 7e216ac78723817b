"""Fixed point: the sub-pixel grid, and exact products on it in two int64 halves.

A coordinate is snapped to 1/2^s of a pixel, half to even, once; everything after is integer. The bits, with s at most 16:

    vertices lie within 2^24 px              |x|, |y| <= 2^40    41 bits signed
    differences of two of them               <= 2^41             42 bits
    an edge value, twice an area             <= 2^82             more than an int64 holds

So one factor of every product is split at bit 20 and a value is kept as high 2^20 + low with 0 <= low < 2^20. While it is
formed, each upper product is at most 2^21 2^41 = 2^62 and their sum is at most 2^62 + 2^42, because the whole value is twice an
area inside a square of 2^25 px; each lower product is below 2^20 2^41 = 2^61. Cost: two more multiplications an edge, and no
second path for vertices that are far away (docs/decisions/0002-exact-edges.md). tests/test_fixed_point.py holds the limits.

Source: Direct3D 11.3, 3.4.1 for the snapping (n.8 fixed point, round to nearest even).
"""

from __future__ import annotations

import numpy as np

from scanspan.assets.rings import MAX_COORDINATE as MAX_COORDINATE
from scanspan.jit import helper_kernel
from scanspan.records import Float64Array, Int64Array, Integer

MAX_SUBPIXEL_BITS = 16
MIN_SUBPIXEL_BITS = 4  # the standard sample positions are sixteenths of a pixel
MAX_SIDE = 1 << 18  # pixels along one side of an image; see edge_start in raster/edge.py

HALF_BITS = np.int64(20)
HALF = np.int64(1 << 20)
HALF_MASK = np.int64((1 << 20) - 1)


def snap_points(points: Float64Array, subpixel_bits: int) -> Int64Array:
    """Return coordinates in pixels, within 2^24 of 0, as sub-pixels, half to even."""
    return np.rint(points * float(1 << subpixel_bits)).astype(np.int64)


@helper_kernel
def to_grid(position: float, scale: float) -> Integer:
    """Return a coordinate in pixels, within 2^24 of 0, in sub-pixels, half to even; scale = 2^s."""
    return np.int64(np.rint(np.float64(position) * scale))


@helper_kernel
def product_halves(a: Integer, b: Integer, dx: Integer, dy: Integer) -> tuple[np.int64, np.int64]:
    """Return a dx + b dy exactly as (high, low), which stands for high 2^20 + low with 0 <= low < 2^20.

    Needs   all four below 2^42 in magnitude, and the result below 2^82.
    """
    high = (a >> HALF_BITS) * dx + (b >> HALF_BITS) * dy
    low = (a & HALF_MASK) * dx + (b & HALF_MASK) * dy
    return high + (low >> HALF_BITS), low & HALF_MASK


@helper_kernel
def halves_sign(high: Integer, low: Integer) -> Integer:
    """Return the sign of a value in two halves: -1, 0 or 1."""
    return np.int64(-1) if high < 0 else np.int64((high | low) != 0)


@helper_kernel
def halves_float(high: Integer, low: Integer) -> float:
    """Return a value in two halves as a float64: exact below 2^53, else rounded."""
    return np.float64(high) * np.float64(HALF) + np.float64(low)
