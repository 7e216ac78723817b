"""On which side of a line two others cross: the sign of a determinant of three lines, exactly.

Where two edges cross is no point of the sub-pixel grid, and is never computed. All that a fill needs to know of it is on which
side of a third line it lies, and that is the sign of a 3 x 3 determinant of whole numbers. In float64 it is certain unless the
three all but meet in a point; then it is worked out in digits of 20 bits. Both give the same sign, so which of them is used
shows in the time alone.

Source: J. R. Shewchuk 1997 for filters that leave the rare case to exact arithmetic.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import HALF_BITS, HALF_MASK, halves_sign, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Int64Array, Integer

DIGITS = 10  # of 20 bits, for products of three numbers of 60 bits
SURE = 2.0**-46  # of the sum of the sizes; float64 is right to 2^-50 of it


@helper_kernel
def add_product(digits: Int64Array, sign: Integer, u: Integer, v: Integer, w: Integer) -> None:
    """Add a product of three numbers to a number in digits, which are not carried yet.

    Needs   |u|, |v|, |w| below 2^60; at most a dozen products are added.
    """
    u0, u1, u2 = u & HALF_MASK, (u >> HALF_BITS) & HALF_MASK, u >> (2 * HALF_BITS)
    v0, v1, v2 = v & HALF_MASK, (v >> HALF_BITS) & HALF_MASK, v >> (2 * HALF_BITS)

    # Multiply the first two, and carry.
    p0 = u0 * v0
    p1 = u0 * v1 + u1 * v0 + (p0 >> HALF_BITS)
    p2 = u0 * v2 + u1 * v1 + u2 * v0 + (p1 >> HALF_BITS)
    p3 = u1 * v2 + u2 * v1 + (p2 >> HALF_BITS)
    p4 = u2 * v2 + (p3 >> HALF_BITS)
    p0, p1, p2, p3 = p0 & HALF_MASK, p1 & HALF_MASK, p2 & HALF_MASK, p3 & HALF_MASK
    p4, p5 = p4 & HALF_MASK, p4 >> HALF_BITS

    # Add them up for each digit of the third.
    for k in range(3):
        digit = sign * ((w >> (k * HALF_BITS)) & HALF_MASK if k < 2 else w >> (2 * HALF_BITS))
        digits[k] += p0 * digit
        digits[k + 1] += p1 * digit
        digits[k + 2] += p2 * digit
        digits[k + 3] += p3 * digit
        digits[k + 4] += p4 * digit
        digits[k + 5] += p5 * digit


@helper_kernel
def digits_sign(digits: Int64Array) -> Integer:
    """Return the sign of a number in digits; they are carried."""
    rest = np.int64(0)
    for k in range(DIGITS - 1):
        total = digits[k] + (digits[k - 1] >> HALF_BITS if k > 0 else np.int64(0))
        digits[k] = total
        rest = rest | (total & HALF_MASK)
    top = digits[DIGITS - 1] + (digits[DIGITS - 2] >> HALF_BITS)
    if top != 0:
        return np.int64(1 if top > 0 else -1)
    return np.int64(rest != 0)


@helper_kernel
def cross_sign(a0: Integer, b0: Integer, a1: Integer, b1: Integer) -> Integer:
    """Return the sign of a0 b1 - b0 a1. Needs: all below 2^42."""
    first, second = np.float64(a0) * np.float64(b1), np.float64(b0) * np.float64(a1)
    difference = first - second
    if abs(difference) > SURE * (abs(first) + abs(second)):
        return np.int64(1 if difference > 0.0 else -1)
    high, low = product_halves(a0, -b0, b1, a1)
    return halves_sign(high, low)


@kernel
def triple_sign(
    a0: Integer, b0: Integer, c0: Integer, a1: Integer, b1: Integer, c1: Integer, a2: Integer, b2: Integer, c2: Integer,
    digits: Int64Array,
) -> Integer:  # fmt: skip
    """Return the sign of the determinant of three lines a x + b y + c.

    It is that of the third line's value where the first two cross, times that of a0 b1 - b0 a1.

    Shapes  digits: (DIGITS,), room to work in.
    Needs   all below 2^60 in magnitude.
    """
    x0, x1 = np.float64(b0) * np.float64(c1), np.float64(c0) * np.float64(b1)
    y0, y1 = np.float64(c0) * np.float64(a1), np.float64(a0) * np.float64(c1)
    w0, w1 = np.float64(a0) * np.float64(b1), np.float64(b0) * np.float64(a1)
    a, b, c = np.float64(a2), np.float64(b2), np.float64(c2)
    value = (x0 - x1) * a + (y0 - y1) * b + (w0 - w1) * c
    size = (abs(x0) + abs(x1)) * abs(a) + (abs(y0) + abs(y1)) * abs(b) + (abs(w0) + abs(w1)) * abs(c)
    if abs(value) > SURE * size:
        return np.int64(1 if value > 0.0 else -1)

    # Work it out exactly.
    for k in range(DIGITS):
        digits[k] = 0
    one = np.int64(1)
    add_product(digits, one, b0, c1, a2)
    add_product(digits, -one, c0, b1, a2)
    add_product(digits, one, c0, a1, b2)
    add_product(digits, -one, a0, c1, b2)
    add_product(digits, one, a0, b1, c2)
    add_product(digits, -one, b0, a1, c2)
    return digits_sign(digits)
