"""Hue, saturation and a third number: HSV, HSL and HSI, which stand RGB's cube on its black corner.

All three are of encoded values. Hue is in turns, 0 <= hue < 1, as in Python's colorsys: red 0, green 1/3, blue 2/3; 360 times
it is degrees. A grey has no hue and no saturation: both are 0, and for black too. The third number differs: V is the largest
channel, L the middle between the largest and the smallest, I the mean of all three. No matrix leads to any of them.

HSV and HSL go round the cube's hexagon in six straight pieces. HSI measures the angle itself, arccos in the books; within the
third of the circle about a mixture of the two larger channels p and q, that angle is the arc tangent of sqrt(3) (q - p) /
(p + q - 2 m), m the smallest, which needs no case for the sign and keeps its digits near greys. The arc tangent and the
tangent are worked out here by their series, with the same bits on every machine.

Source: A. R. Smith, Color Gamut Transform Pairs, SIGGRAPH 1978 (HSV); Foley et al., Computer Graphics (HLS); R. Gonzalez and
R. Woods, Digital Image Processing (HSI).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from scanspan.color.brightness import mean_of_three
from scanspan.color.values import array_of, bounded_values, encoded_values, unit_values
from scanspan.errors import InputError
from scanspan.records import Float64Array

_ROOT_3 = math.sqrt(3.0)

# The series end where their terms fall below half a unit in the last place, for arguments up to tan 7.5 and pi / 12.
_ARCTAN_TERMS = 9
_TANGENT_TERMS = 7


def rgb_to_hsv(rgb: npt.ArrayLike) -> Float64Array:
    """Return hue, saturation and value.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (..., 3) float64: hue in turns, 0 <= hue < 1, 0 for greys; saturation 0..1, 0 for black; value 0..1, the largest channel.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    Source: A. R. Smith 1978; the bits are those of Python's colorsys.

    >>> rgb_to_hsv([[255, 0, 0], [0, 102, 0], [51, 51, 51]]).round(4).tolist()
    [[0.0, 1.0, 1.0], [0.3333, 1.0, 0.4], [0.0, 0.0, 0.2]]
    """
    channels = encoded_values("rgb", rgb)
    largest, smallest = channels.max(axis=-1), channels.min(axis=-1)
    saturation = _ratio(largest - smallest, largest)
    return np.stack([_hexagon_hue(channels, largest, smallest), saturation, largest], axis=-1)


def hsv_to_rgb(hsv: npt.ArrayLike) -> Float64Array:
    """Return encoded RGB from hue, saturation and value: the inverse of `rgb_to_hsv`.

    Parameters
    ----------
    hsv : (..., 3) floats: hue in turns, any number, as it goes round; saturation and value 0..1.

    Returns
    -------
    (..., 3) float64, 0..1.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is out of its range.

    >>> hsv_to_rgb([[0.5, 1.0, 0.4], [-0.5, 1.0, 0.4]]).tolist()
    [[0.0, 0.4, 0.4], [0.0, 0.4, 0.4]]
    """
    hue, saturation, value = _read_cylinder("hsv", "value", hsv)
    sextant = np.floor(hue * 6.0)
    f = hue * 6.0 - sextant
    p = value * (1.0 - saturation)
    q = value * (1.0 - saturation * f)
    t = value * (1.0 - saturation * (1.0 - f))

    # Put the largest channel, the one on its way and the smallest in the places of the sextant.
    which = sextant.astype(np.int64)
    red = np.choose(which, [value, q, p, p, t, value])
    green = np.choose(which, [t, value, value, q, p, p])
    blue = np.choose(which, [p, p, t, value, value, q])
    return np.stack([red, green, blue], axis=-1)


def rgb_to_hsl(rgb: npt.ArrayLike) -> Float64Array:
    """Return hue, saturation and lightness, in this order (colorsys has hue, lightness, saturation).

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (..., 3) float64: hue in turns, 0 <= hue < 1, 0 for greys; saturation 0..1, 0 for greys; lightness 0..1, the middle between
    the largest and the smallest channel.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    >>> rgb_to_hsl([[255, 0, 0], [255, 255, 255]]).tolist()
    [[0.0, 1.0, 0.5], [0.0, 0.0, 1.0]]
    """
    channels = encoded_values("rgb", rgb)
    largest, smallest = channels.max(axis=-1), channels.min(axis=-1)
    lightness = (largest + smallest) / 2.0
    room = np.where(lightness <= 0.5, largest + smallest, 2.0 - largest - smallest)
    saturation = _ratio(largest - smallest, room)
    return np.stack([_hexagon_hue(channels, largest, smallest), saturation, lightness], axis=-1)


def hsl_to_rgb(hsl: npt.ArrayLike) -> Float64Array:
    """Return encoded RGB from hue, saturation and lightness: the inverse of `rgb_to_hsl`.

    Parameters
    ----------
    hsl : (..., 3) floats: hue in turns, any number, as it goes round; saturation and lightness 0..1.

    Returns
    -------
    (..., 3) float64, 0..1.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is out of its range.

    >>> hsl_to_rgb((0.0, 1.0, 0.75)).tolist()
    [1.0, 0.5, 0.5]
    """
    hue, saturation, lightness = _read_cylinder("hsl", "lightness", hsl)
    spread = saturation * np.minimum(lightness, 1.0 - lightness)
    channels = []
    for shift in (2.0, 0.0, 4.0):
        # Walk round the hexagon: up in one sextant, two above, down in one, two below.
        place = np.mod(hue * 6.0 + shift, 6.0)
        height = np.clip(np.minimum(place, 4.0 - place), 0.0, 1.0)
        channels.append(np.clip(lightness - spread + 2.0 * spread * height, 0.0, 1.0))
    return np.stack(channels, axis=-1)


def rgb_to_hsi(rgb: npt.ArrayLike) -> Float64Array:
    """Return hue, saturation and intensity, the hue by angle and not by hexagon.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (..., 3) float64: hue in turns, 0 <= hue < 1, 0 for greys; saturation 0..1, one less the smallest channel over the mean, 0
    for black; intensity 0..1, the mean.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    Source: Gonzalez and Woods; the hue is up to 1.12 degrees off that of HSV, and equal to it at the six pure colours.

    >>> rgb_to_hsi([[255, 0, 0], [255, 128, 0]]).round(4).tolist()
    [[0.0, 1.0, 0.3333], [0.0837, 1.0, 0.5007]]
    """
    channels = encoded_values("rgb", rgb)
    red, green, blue = np.moveaxis(channels, -1, 0)
    mean = mean_of_three(channels)

    # Name the channels p, q and m, in the order of the circle, so that m is the smallest.
    third = np.where((blue <= red) & (blue <= green), 0, np.where(red <= green, 1, 2))
    p, q, m = np.choose(third, [red, green, blue]), np.choose(third, [green, blue, red]), np.choose(third, [blue, red, green])
    from_grey = (p - m) + (q - m)
    slant = _ratio(q - p, from_grey)

    # Measure the angle from the middle of the third, a sixth of a turn after its pure colour p.
    sixth = np.where(np.abs(slant) == 1.0, slant / 6.0, _arctan(_ROOT_3 * slant) / math.tau)
    hue = np.where(from_grey > 0.0, _wrap((2.0 * third + 1.0) / 6.0 + sixth), 0.0)
    return np.stack([hue, np.minimum(_ratio(from_grey / 3.0, mean), 1.0), mean], axis=-1)


def hsi_to_rgb(hsi: npt.ArrayLike) -> Float64Array:
    """Return encoded RGB from hue, saturation and intensity: the inverse of `rgb_to_hsi`.

    Parameters
    ----------
    hsi : (..., 3) floats: hue in turns, any number, as it goes round; saturation and intensity 0..1.

    Returns
    -------
    (..., 3) float64. Not every triple is a colour: bright and saturated ones have channels up to 3; nothing is clamped.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is out of its range.

    >>> hsi_to_rgb((0.0, 1.0, 0.25)).round(12).tolist()
    [0.75, 0.0, 0.0]
    """
    hue, saturation, mean = _read_cylinder("hsi", "intensity", hsi)
    third = np.minimum(np.floor(hue * 3.0), 2.0)
    slant = _tangent(math.tau * (hue - (2.0 * third + 1.0) / 6.0)) / _ROOT_3

    # Share what the smallest channel leaves between the other two.
    colour = mean * saturation
    m, middle, half = mean - colour, mean + 0.5 * colour, 1.5 * colour * slant
    p, q = middle - half, middle + half
    which = third.astype(np.int64)
    return np.stack([np.choose(which, [p, m, q]), np.choose(which, [q, p, m]), np.choose(which, [m, q, p])], axis=-1)


def _ratio(numerator: Float64Array, denominator: Float64Array) -> Float64Array:
    """Return quotients, 0 where the denominator is 0."""
    return np.divide(numerator, denominator, out=np.zeros_like(denominator), where=denominator > 0.0)


def _wrap(hue: Float64Array) -> Float64Array:
    """Return hues brought into 0 <= hue < 1; just below 0 the remainder rounds to 1, which is 0 again."""
    turned = np.mod(hue, 1.0)
    return np.where(turned >= 1.0, 0.0, turned)


def _hexagon_hue(channels: Float64Array, largest: Float64Array, smallest: Float64Array) -> Float64Array:
    """Return the hue of HSV and HSL, which rises evenly along each side of the hexagon."""
    spread = largest - smallest
    red, green, blue = (_ratio(largest - channels[..., k], spread) for k in range(3))
    is_red, is_green = channels[..., 0] == largest, channels[..., 1] == largest
    sixths = np.where(is_red, blue - green, np.where(is_green, 2.0 + red - blue, 4.0 + green - red))
    return np.where(spread > 0.0, _wrap(sixths / 6.0), 0.0)


def _read_cylinder(name: str, third: str, value: npt.ArrayLike) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return hue in 0 <= hue < 1, saturation and the third number, checked."""
    array = array_of(name, value)
    if array.dtype.kind != "f":
        raise InputError(f"{name} has type {array.dtype}: expected floats; hue is in turns, saturation and {third} 0..1")
    hue = _wrap(bounded_values(f"hue of {name}", array[..., 0]))
    return hue, unit_values(f"saturation of {name}", array[..., 1]), unit_values(f"{third} of {name}", array[..., 2])


def _arctan(x: Float64Array) -> Float64Array:
    """Return the arc tangent of numbers within -sqrt(3)..sqrt(3), in radians."""
    for _ in range(3):
        # Halve the angle.
        x = x / (1.0 + np.sqrt(1.0 + x * x))
    square = x * x
    total = np.zeros_like(x)
    for n in range(_ARCTAN_TERMS - 1, -1, -1):
        total = 1.0 / (2 * n + 1) - square * total
    return 8.0 * (x * total)


def _tangent(angle: Float64Array) -> Float64Array:
    """Return the tangent of angles within -pi/3..pi/3."""
    quarter = angle / 4.0
    square = quarter * quarter
    sine, cosine = np.ones_like(angle), np.ones_like(angle)
    for n in range(_TANGENT_TERMS, 0, -1):
        sine = 1.0 - square * sine / (2 * n * (2 * n + 1))
        cosine = 1.0 - square * cosine / ((2 * n - 1) * 2 * n)
    tangent = quarter * sine / cosine
    for _ in range(2):
        # Double the angle.
        tangent = 2.0 * tangent / (1.0 - tangent * tangent)
    return tangent
