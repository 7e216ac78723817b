"""The curve between sRGB and linear light, and roots, with the same bits on every machine.

The curve holds a power, and a library's `pow` differs in its last bit from one machine to the next. So there is none here:
x^2.4 is x^2 (x^0.2)^2, x^(5/12) is x^(1/4) x^(1/6), square roots are correctly rounded everywhere, and fifth and third roots
come from Newton's iteration, which adds, multiplies and divides only. The price is some twenty operations a value.

The constants are those of the standard, 0.04045 and 12.92; its two branches miss each other there by 2e-9 of light. In that gap
lies the light of no encoded value, and the way back divides in its middle, so that every value comes back, and even light that
rounding has moved on its way through XYZ.

Source: IEC 61966-2-1 (sRGB); the mirrored curve for negative values is that of CSS Color Module Level 4.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.color.values import array_of, encoded_values, float_values
from scanspan.errors import InputError
from scanspan.records import Float64Array, UInt8Array

# Rounds of Newton's iteration: from the first guess they gain 1, 2, 4, 8 and more than 16 decimals.
_ROUNDS = 7

# The curve is a straight line up to this encoded value.
_ENCODED_KNEE = 0.04045
_SLOPE = 12.92

# The middle of the gap between the branches, 0.003130804954 and 0.003130807283.
_LIGHT_KNEE = 0.003130806


def linear_from_srgb(values: npt.ArrayLike) -> Float64Array:
    """Return linear light from sRGB values, both 0..1, unchecked.

    Parameters
    ----------
    values : numbers of any shape, sRGB 0..1; what is outside is clamped.

    Returns
    -------
    float64 of the same shape.

    >>> linear_from_srgb([0.0, 0.5, 1.0]).round(4)
    array([0.   , 0.214, 1.   ])
    """
    encoded = np.clip(np.asarray(values, dtype=np.float64), 0.0, 1.0)
    base = np.maximum((encoded + 0.055) / 1.055, 0.09)

    # Find the fifth root from the chord of the curve over 0.09..1, within 0.03 of it.
    root = 0.6178 + (base - 0.09) * (0.3822 / 0.91)
    for _ in range(_ROUNDS):
        fourth = root * root * (root * root)
        root = root - (fourth * root - base) / (5.0 * fourth)
    result: Float64Array = np.where(encoded <= _ENCODED_KNEE, encoded / _SLOPE, base * base * (root * root))
    return np.minimum(result, 1.0)


LIGHT_OF_CODES: Float64Array = linear_from_srgb(np.arange(256) / 255.0)
"""(256,) float64, the light of each 8-bit sRGB code."""

HALF_WAY: Float64Array = linear_from_srgb((np.arange(255) + 0.5) / 255.0)
"""(255,) float64, the light half way between each two neighbouring 8-bit codes as encoded."""

# Bins of light that an encoder looks up first. The curve climbs 255 x 12.92 = 3295 codes a unit at most, so that in a bin of
# 1/4096 it passes one half-way value or none.
BINS = 4096

STARTS: UInt8Array = np.searchsorted(HALF_WAY, np.arange(BINS + 1) / BINS, side="right").astype(np.uint8)
"""(4097,) uint8, the code of light k / 4096."""

# The light at which each code ends; the last one has no end.
_ENDS: Float64Array = np.append(HALF_WAY, np.inf)


def cube_root(values: npt.ArrayLike) -> Float64Array:
    """Return the cube roots of numbers of zero or more, within two units in the last place.

    >>> cube_root([0.0, 0.125, 1.0, 1e27]).tolist()
    [0.0, 0.5, 1.0, 1000000000.0]
    """
    fraction, exponent = np.frexp(np.asarray(values, dtype=np.float64))
    third = exponent // 3
    base = np.ldexp(fraction, exponent - 3 * third)

    # Find the root of a number in 1/2..4 from the chord of the curve, within 0.1 of it.
    root = 0.7937 + (base - 0.5) * ((1.5874 - 0.7937) / 3.5)
    for _ in range(_ROUNDS):
        root = root - (root - base / (root * root)) / 3.0
    result: Float64Array = np.where(base == 0.0, 0.0, np.ldexp(root, third))
    return result


def srgb_from_linear(light: Float64Array) -> Float64Array:
    """Return sRGB values from linear light of any size and sign, unchecked.

    >>> srgb_from_linear(np.array([0.0, 0.214041140482, 1.0, -1.0])).round(9).tolist()
    [0.0, 0.5, 1.0, -1.0]
    """
    size = np.abs(light)
    half = np.sqrt(size)
    power = np.sqrt(half) * cube_root(half)
    curve = np.where(size <= _LIGHT_KNEE, size * _SLOPE, power + 0.055 * (power - 1.0))
    return np.copysign(curve, light)


def codes_from_linear(light: Float64Array) -> UInt8Array:
    """Return the 8-bit sRGB codes of linear light, exactly rounded; what is outside 0..1 is clamped.

    >>> codes_from_linear(np.array([-1.0, 0.5, 2.0])).tolist()
    [0, 188, 255]
    """
    value = np.clip(light, 0.0, 1.0)
    codes: UInt8Array = STARTS[(value * BINS).astype(np.int64)]
    return codes + (value >= _ENDS[codes])


def srgb_to_linear(rgb: npt.ArrayLike) -> Float64Array:
    """Return linear light from encoded sRGB values.

    Parameters
    ----------
    rgb : sRGB of any shape, integers 0..255 or floats 0..1, by their type. Alpha is not encoded: leave it out.

    Returns
    -------
    float64 of the same shape, linear light 0..1.

    Raises
    ------
    InputError : when these are no numbers, or one is out of its range.

    Source: IEC 61966-2-1.

    >>> srgb_to_linear([0, 128, 255]).round(4).tolist()
    [0.0, 0.2159, 1.0]
    """
    array = array_of("rgb", rgb, triples=False)
    values = encoded_values("rgb", array, triples=False)
    return linear_from_srgb(values) if array.dtype.kind == "f" else np.asarray(LIGHT_OF_CODES[array.astype(np.uint8)])


def linear_to_srgb(linear: npt.ArrayLike) -> Float64Array:
    """Return encoded sRGB values from linear light: the inverse of `srgb_to_linear`.

    Parameters
    ----------
    linear : floats of any shape; 1 is white. Light above 1 and, mirrored, below 0 is encoded by the same curve.

    Returns
    -------
    float64 of the same shape, 0..1 for light 0..1. Nothing is clamped; `to_uint8` and `numpy.clip` do that.

    Raises
    ------
    InputError : when these are no floats, or one is not finite or beyond 1e30.

    Source: IEC 61966-2-1; CSS Color Module Level 4 for values outside 0..1.

    >>> linear_to_srgb([0.0, 0.5, 1.0]).round(4).tolist()
    [0.0, 0.7354, 1.0]
    """
    return srgb_from_linear(float_values("linear", linear, "integers are codes of encoded sRGB", triples=False))


def to_uint8(rgb: npt.ArrayLike) -> UInt8Array:
    """Return encoded values 0..1 as 8-bit codes, rounded half to even; what is outside 0..1 is clamped.

    Parameters
    ----------
    rgb : floats of any shape, encoded, such as the conversions back to RGB return.

    Returns
    -------
    uint8 of the same shape.

    Raises
    ------
    InputError : when these are no floats, or one is NaN.

    >>> to_uint8([0.0, 0.5, 1.0, 1.2]).tolist()
    [0, 128, 255, 255]
    """
    array = array_of("rgb", rgb, triples=False)
    if array.dtype.kind != "f":
        raise InputError(f"rgb has type {array.dtype}: expected floats; integers are codes already")
    if np.isnan(array).any():
        raise InputError("rgb holds NaN: expected numbers")
    codes: UInt8Array = np.rint(np.clip(array.astype(np.float64), 0.0, 1.0) * 255.0).astype(np.uint8)
    return codes
