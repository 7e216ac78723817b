"""Colours as people write them, and the exact way between sRGB and linear light.

At the surface a colour is sRGB with straight alpha; light is added and averaged in linear values. The curve between them is
that of scanspan.color. Encoding to 8 bits compares with the 255 values of light that lie half way between two codes, each
rounded up to float32, so that the code is the exactly rounded one.

The kernels are in srgb.py; this module does without numba.

Source: IEC 61966-2-1 (sRGB); CSS Color Module Level 4 (names).
"""

from __future__ import annotations

import difflib
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from PIL import ImageColor

from scanspan.color.transfer import HALF_WAY, LIGHT_OF_CODES, STARTS, linear_from_srgb
from scanspan.errors import InputError
from scanspan.homogeneous import quote
from scanspan.records import Float32Array, Float64Array, UInt8Array

_EXPECTED = "expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"


def parse_color(value: object) -> Float64Array:
    """Return a colour as sRGB with straight alpha, each 0..1.

    Parameters
    ----------
    value : a CSS name, "#rgb", "#rrggbb", "#rrggbbaa", "rgb(...)", "hsl(...)" or "transparent"; or three or four numbers:
        integers are 0..255 and floats 0..1, by their type and never by their value. A missing alpha is opaque.

    Returns
    -------
    (4,) float64.

    Raises
    ------
    InputError : when it is none of these, or a number is out of its range.

    >>> parse_color("tomato").round(3)
    array([1.   , 0.388, 0.278, 1.   ])
    >>> parse_color((255, 0, 0)).tolist() == parse_color((1.0, 0.0, 0.0)).tolist()
    True
    """
    if isinstance(value, str):
        name = value.strip()
        if name.lower() == "transparent":
            return np.zeros(4)
        try:
            numbers: Any = ImageColor.getrgb(name)
        except ValueError:
            near = difflib.get_close_matches(name.lower(), ImageColor.colormap, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ":"
            raise InputError(f"{quote(value)} is no colour{hint} {_EXPECTED}") from None
    else:
        numbers = value
    try:
        array = np.asarray(numbers)
    except (ValueError, TypeError, OverflowError):
        array = np.zeros(0)
    if array.shape not in ((3,), (4,)) or array.dtype.kind not in "iuf":
        raise InputError(f"{quote(value)} is no colour: {_EXPECTED}")
    return cast(Float64Array, to_float_colors(array[None], np.float64)[0])


def to_float_colors(colors: npt.ArrayLike, dtype: npt.DTypeLike = np.float32) -> npt.NDArray[Any]:
    """Return many colours as sRGB with straight alpha, each 0..1.

    Parameters
    ----------
    colors : (N, 3) or (N, 4), integers 0..255 or floats 0..1, by their type.
    dtype : type of the result.

    Returns
    -------
    (N, 4) of that type; a missing alpha is 1.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range; the message quotes the row.

    >>> to_float_colors([[255, 0, 51]])
    array([[1. , 0. , 0.2, 1. ]], dtype=float32)
    """
    array = np.asarray(colors)
    if array.ndim != 2 or array.shape[1] not in (3, 4) or array.dtype.kind not in "iuf":
        raise InputError(f"colors has shape {array.shape} and type {array.dtype}: expected numbers of shape (N, 3) or (N, 4)")
    top = 1 if array.dtype.kind == "f" else 255
    bad = ~((array >= 0) & (array <= top)).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        kind = "floats between 0 and 1" if top == 1 else "integers between 0 and 255"
        where = f"colors[{row}]" if len(array) > 1 else "colour"
        raise InputError(f"{where} = {tuple(array[row].tolist())}: expected {kind}")
    result = np.ones((len(array), 4), dtype=dtype)
    result[:, : array.shape[1]] = array if top == 1 else array.astype(np.float64) / 255.0
    return result


def linear_color(value: object) -> Float32Array:
    """Return a colour that `parse_color` reads as linear light with straight alpha, (4,) float32.

    >>> linear_color("white")
    array([1., 1., 1., 1.], dtype=float32)
    """
    color = parse_color(value)
    return np.append(linear_from_srgb(color[:3]), color[3]).astype(np.float32)


def _make_thresholds() -> Float32Array:
    """Return (256,) float32: entry i is the least light that is encoded as i + 1 or more; the last one is out of reach."""
    rounded = HALF_WAY.astype(np.float32)
    above = np.where(rounded.astype(np.float64) < HALF_WAY, np.nextafter(rounded, np.float32(2.0)), rounded)
    return np.append(above, np.float32(np.inf)).astype(np.float32)


LINEAR_FROM_SRGB8: Float32Array = LIGHT_OF_CODES.astype(np.float32)
"""(256,) float32, the light of each 8-bit sRGB code."""

THRESHOLDS: Float32Array = _make_thresholds()
"""(256,) float32, the least light of each next code: code i is for THRESHOLDS[i - 1] <= light < THRESHOLDS[i]."""


def linear_from_srgb8(codes: npt.ArrayLike) -> Float32Array:
    """Return linear light, float32 0..1, from 8-bit sRGB codes of any shape.

    >>> linear_from_srgb8(np.array([0, 255], dtype=np.uint8))
    array([0., 1.], dtype=float32)
    """
    return LINEAR_FROM_SRGB8[np.asarray(codes, dtype=np.uint8)]


def encode_srgb(linear: npt.ArrayLike) -> UInt8Array:
    """Return 8-bit sRGB codes, exactly rounded, from linear light of any shape.

    Parameters
    ----------
    linear : float32 light; what is outside 0..1 is clamped, NaN gives 0.

    Returns
    -------
    uint8 of the same shape.

    >>> encode_srgb([0.0, 0.5, 1.0])
    array([  0, 188, 255], dtype=uint8)
    """
    from scanspan.shade.srgb import encode_values

    light = np.require(linear, dtype=np.float32, requirements=["C", "A", "W", "E"])
    codes = np.empty(light.shape, dtype=np.uint8)
    encode_values(light.reshape(-1), THRESHOLDS, STARTS, codes.reshape(-1))
    return codes


def linear_colors(colors: npt.ArrayLike) -> Float32Array:
    """Return many colours that `to_float_colors` reads as linear light with straight alpha, (N, 4) float32.

    >>> linear_colors(np.array([[255, 0, 0]], dtype=np.uint8))
    array([[1., 0., 0., 1.]], dtype=float32)
    """
    array = np.asarray(colors)
    if array.dtype == np.uint8 and array.ndim == 2:
        result = np.ones((len(array), 4), dtype=np.float32)
        result[:, :3] = LINEAR_FROM_SRGB8[array[:, :3]]
        if array.shape[1] == 4:
            result[:, 3] = array[:, 3] / np.float32(255)
        return result
    result = to_float_colors(array)
    result[:, :3] = linear_from_srgb(result[:, :3])
    return result
