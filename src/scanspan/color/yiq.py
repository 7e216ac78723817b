"""YIQ, the colours of American television: a brightness that black-and-white sets show, and two differences of colour.

Three matrices go by this name, and they differ in the third digit:

- "ntsc": worked out here. The weights of Y are the luminances of the 1953 primaries under illuminant C, rounded to three digits
  as the standard does (.299 .587 .114). B - Y and R - Y are scaled so that the composite signal of fully saturated bars stays
  within -1/3..4/3, and turned by 33 degrees.
- "fcc": the two-digit rule of the FCC, I = .74 (R - Y) - .27 (B - Y), Q = .48 (R - Y) + .41 (B - Y), Y = .30 R + .59 G + .11 B,
  which Python's colorsys uses.
- "slide": the two-digit matrix of the lecture. Its rows sum to 1, 0 and 0, as they must.

It acts on encoded values, so Y is a luma, though it is often called luminance; and I is not the I of HSI. Everything is
computed from the differences R - G and B - G, so that greys have I = Q = 0 and keep their value, to the last bit. The inverse
is found in exact fractions.

Source: FCC 47 CFR 73.682 (1953); SMPTE 170M; C. Poynton, Digital Video and HD, chapter 28; the lecture on colour.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from scanspan.color.brightness import weigh
from scanspan.color.spaces import NTSC_PRIMARIES, C, inverse, primaries_matrix
from scanspan.color.values import encoded_values, float_values
from scanspan.errors import unknown_name
from scanspan.records import Float64Array

# Sine and cosine of 33 degrees.
_SINE = 0.54463903501502708222
_COSINE = 0.83867056794542402964


def _differences_matrix(red: float, blue: float, i: tuple[float, float], q: tuple[float, float]) -> Float64Array:
    """Return the matrix of Y with two weights, and of I and Q given as multiples of R - Y and B - Y."""
    y = np.array([red, 1.0 - red - blue, blue])
    by_red, by_blue = np.array([1.0, 0.0, 0.0]) - y, np.array([0.0, 0.0, 1.0]) - y
    return np.array([y, i[0] * by_red + i[1] * by_blue, q[0] * by_red + q[1] * by_blue])


def _ntsc_matrix() -> Float64Array:
    """Return the matrix that follows from the primaries, the limits of the signal and the turn of 33 degrees."""
    red, _, blue = (round(weight, 3) for weight in primaries_matrix(NTSC_PRIMARIES, C)[1].tolist())

    # Let yellow (1, 1, 0) and cyan (0, 1, 1) just reach 4/3: two equations in the squares of the scales of B - Y and R - Y.
    yellow, cyan = 1.0 - blue, 1.0 - red
    a, b, c = yellow * yellow, (1.0 - yellow) * (1.0 - yellow), (4.0 / 3.0 - yellow) * (4.0 / 3.0 - yellow)
    d, e, f = (1.0 - cyan) * (1.0 - cyan), cyan * cyan, (4.0 / 3.0 - cyan) * (4.0 / 3.0 - cyan)
    by_blue = math.sqrt((c * e - b * f) / (a * e - b * d))
    by_red = math.sqrt((a * f - c * d) / (a * e - b * d))

    # Turn both differences by 33 degrees.
    i, q = (by_red * _COSINE, -by_blue * _SINE), (by_red * _SINE, by_blue * _COSINE)
    return _differences_matrix(red, blue, i, q)


def _frozen(matrix: npt.ArrayLike) -> Float64Array:
    """Return a matrix that cannot be written to."""
    result = np.array(matrix, dtype=np.float64)
    result.flags.writeable = False
    return result


YIQ_MATRICES: dict[str, Float64Array] = {
    "ntsc": _frozen(_ntsc_matrix()),
    "fcc": _frozen(_differences_matrix(0.30, 0.11, (0.74, -0.27), (0.48, 0.41))),
    "slide": _frozen([[0.30, 0.59, 0.11], [0.60, -0.28, -0.32], [0.21, -0.52, 0.31]]),
}
"""The three matrices by name, (3, 3) float64 each, from encoded RGB to YIQ; the rows sum to 1, 0 and 0 but for rounding."""

# Green is taken with the weight that makes the rows sum to 1, 0 and 0, as it is in the differences below.
_INVERSES = {name: inverse(matrix, (1, 0, 0)) for name, matrix in YIQ_MATRICES.items()}


def rgb_to_yiq(rgb: npt.ArrayLike, matrix: str = "ntsc") -> Float64Array:
    """Return luma and two differences of colour.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.
    matrix : "ntsc" (four good digits and more), "fcc" (as colorsys) or "slide" (as in the lecture).

    Returns
    -------
    (..., 3) float64: Y 0..1; I within -0.6..0.6 and Q within -0.53..0.53, both 0 for greys.

    Raises
    ------
    InputError : when the shape or type is another, a number is out of its range, or the matrix unknown.

    >>> rgb_to_yiq((255, 0, 0), matrix="slide").tolist()
    [0.3, 0.6, 0.21]
    >>> rgb_to_yiq((255, 0, 0)).round(4).tolist()
    [0.299, 0.5959, 0.2115]
    """
    _check(matrix)
    forward = YIQ_MATRICES[matrix]
    channels = encoded_values("rgb", rgb)
    from_red, from_blue = channels[..., 0] - channels[..., 1], channels[..., 2] - channels[..., 1]
    y = weigh(channels, forward[0, 0], forward[0, 2])
    i = forward[1, 0] * from_red + forward[1, 2] * from_blue
    q = forward[2, 0] * from_red + forward[2, 2] * from_blue
    return np.stack([y, i, q], axis=-1)


def yiq_to_rgb(yiq: npt.ArrayLike, matrix: str = "ntsc") -> Float64Array:
    """Return encoded RGB from YIQ: the inverse of `rgb_to_yiq` with the same matrix.

    Parameters
    ----------
    yiq : (..., 3) floats.
    matrix : "ntsc", "fcc" or "slide".

    Returns
    -------
    (..., 3) float64. Not every triple is a colour: what lies outside 0..1 is not clamped (colorsys does).

    Raises
    ------
    InputError : when these are no floats of that shape, one is not finite or beyond 1e30, or the matrix is unknown.

    >>> yiq_to_rgb((1.0, 0.0, 0.0)).tolist()
    [1.0, 1.0, 1.0]
    >>> yiq_to_rgb(rgb_to_yiq((0.2, 0.4, 0.6), "slide"), "slide").round(12).tolist()
    [0.2, 0.4, 0.6]
    """
    _check(matrix)
    values = float_values("yiq", yiq, "Y is 0..1")
    y, i, q = np.moveaxis(values, -1, 0)
    return np.stack([y + (row[1] * i + row[2] * q) for row in _INVERSES[matrix]], axis=-1)


def _check(name: str) -> None:
    """Raise an InputError unless a matrix has this name."""
    if not isinstance(name, str) or name not in YIQ_MATRICES:
        raise unknown_name("matrix", name, YIQ_MATRICES)
