"""The exact way between sRGB and linear light, for colours as people write them and for pictures.

At the surface a colour is sRGB with straight alpha; light is added and averaged in linear values. The curve between them is
that of scanspan.color. Encoding to 8 bits compares with the 255 values of light that lie half way between two codes, each
rounded up to float32, so that the code is the exactly rounded one.

The kernels are in srgb.py; this module does without numba.

Source: IEC 61966-2-1 (sRGB).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.color.names import parse_color, to_float_colors
from scanspan.color.transfer import HALF_WAY, LIGHT_OF_CODES, STARTS, linear_from_srgb
from scanspan.records import Float32Array, UInt8Array


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
