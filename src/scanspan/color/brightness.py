"""How bright a colour is, in four senses that are kept apart by their names.

`luminance` adds up light, so it takes linear values; luma adds up encoded values with the same kind of weights, which is what
television and JPEG do; `intensity` is the plain mean. Equal red, green and blue differ by a factor of ten in luminance and not
at all in intensity. Each is written as green plus weighted differences from green, so that a grey comes out as itself to the
last bit: weights that are rounded one by one, such as three times 0.333, would darken white.

Source: ITU-R BT.709-6, item 3.2 (weights .2126 .7152 .0722); ITU-R BT.601-7 (.299 .587 .114); R. Gonzalez and R. Woods,
Digital Image Processing (intensity of HSI).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.color.values import encoded_values, float_values
from scanspan.records import Float64Array

# Weights of red and of blue; green has the rest to one.
_REC_601 = (0.299, 0.114)
_REC_709 = (0.2126, 0.0722)


def weigh(rgb: Float64Array, red: float, blue: float) -> Float64Array:
    """Return the weighted mean of three channels, (..., 3) to (...), exact for greys; green weighs 1 - red - blue.

    >>> weigh(np.array([0.1, 0.1, 0.1]), 0.299, 0.114).item()
    0.1
    """
    green = rgb[..., 1]
    result: Float64Array = green + (red * (rgb[..., 0] - green) + blue * (rgb[..., 2] - green))
    return result


def luminance(linear: npt.ArrayLike) -> Float64Array:
    """Return the relative luminance of linear light: .2126 R + .7152 G + .0722 B.

    Parameters
    ----------
    linear : (..., 3) floats, linear light of the sRGB primaries; 1 is white. For encoded colours ask for
        ``luminance(srgb_to_linear(rgb))``.

    Returns
    -------
    (...) float64, 1 for white: Y of CIE XYZ, but for the rounding of the weights to four digits.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is not finite.

    Source: ITU-R BT.709-6.

    >>> luminance([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).round(4).tolist()
    [0.2126, 0.7152, 0.0722]
    """
    reason = "integers are codes of encoded sRGB: luminance(srgb_to_linear(rgb))"
    return np.asarray(weigh(float_values("linear", linear, reason), *_REC_709))


def luma_601(rgb: npt.ArrayLike) -> Float64Array:
    """Return the luma of encoded values by Rec. 601: .299 R' + .587 G' + .114 B', as Y of "ntsc" YIQ, JPEG and grey images.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (...) float64, 0..1.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    Source: ITU-R BT.601-7.

    >>> luma_601([[255, 0, 0], [0, 255, 0], [0, 0, 255]]).round(4).tolist()
    [0.299, 0.587, 0.114]
    """
    return np.asarray(weigh(encoded_values("rgb", rgb), *_REC_601))


def luma_709(rgb: npt.ArrayLike) -> Float64Array:
    """Return the luma of encoded values by Rec. 709: .2126 R' + .7152 G' + .0722 B', as high-definition video has it.

    The weights are those of luminance, but they weigh encoded values: the result is not luminance, nor its encoding.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (...) float64, 0..1.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    Source: ITU-R BT.709-6.

    >>> luma_709((255, 255, 0)).round(4).item()
    0.9278
    """
    return np.asarray(weigh(encoded_values("rgb", rgb), *_REC_709))


def intensity(rgb: npt.ArrayLike) -> Float64Array:
    """Return the mean of the three channels, I of HSI.

    It takes no account of the eye: pure green and pure blue have the same intensity.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (...) float64, 0..1.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    >>> intensity([[255, 0, 0], [0, 0, 255], [255, 255, 255]]).round(3).tolist()
    [0.333, 0.333, 1.0]
    """
    return np.asarray(mean_of_three(encoded_values("rgb", rgb)))


def mean_of_three(rgb: Float64Array) -> Float64Array:
    """Return the mean of three channels, (..., 3) to (...), in any order the same; three equal numbers have just that mean.

    >>> mean_of_three(np.array([0.1, 0.1, 0.1])).item()
    0.1
    """
    smallest = np.minimum(np.minimum(rgb[..., 0], rgb[..., 1]), rgb[..., 2])
    result: Float64Array = smallest + ((rgb[..., 0] - smallest) + (rgb[..., 1] - smallest) + (rgb[..., 2] - smallest)) / 3.0
    return result
