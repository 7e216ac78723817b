"""CIE XYZ and Lab, white points, and the matrix that follows from primaries and a white.

XYZ is that of light: Y is luminance, 1 for white. A white point is written as its chromaticity (x, y), as the standards do, or
as any colour (X, Y, Z), whose brightness does not count. Matrices are worked out in exact fractions from the chromaticities
and rounded once, and so are their inverses: published matrices are rounded to some digits, and their published inverses do not
undo them.

Source: CIE 15:2004 (illuminants, Lab); IEC 61966-2-1 (sRGB); FCC 47 CFR 73.682 (the primaries of 1953); B. Lindbloom, RGB/XYZ
Matrices, for the derivation.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from scanspan.color.transfer import cube_root, srgb_from_linear, srgb_to_linear
from scanspan.color.values import LARGEST, array_of, bounded_values, float_values
from scanspan.errors import InputError
from scanspan.homogeneous import finite_array, quote, transform_directions
from scanspan.records import Float64Array

A = (0.44758, 0.40745)
"""Chromaticity (x, y) of an incandescent lamp of 2856 K."""

C = (0.31006, 0.31616)
"""Chromaticity (x, y) of illuminant C, a daylight of older standards, the white of television in 1953."""

D50 = (0.3457, 0.3585)
"""Chromaticity (x, y) of warm daylight, the white of printing."""

D65 = (0.3127, 0.3290)
"""Chromaticity (x, y) of average daylight, the white of sRGB."""

E = (1.0 / 3.0, 1.0 / 3.0)
"""Chromaticity (x, y) of equal energy at every wavelength."""

SRGB_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
"""Chromaticities (x, y) of red, green and blue of sRGB and Rec. 709."""

NTSC_PRIMARIES = ((0.67, 0.33), (0.21, 0.71), (0.14, 0.08))
"""Chromaticities (x, y) of red, green and blue of American television in 1953."""

_Rows = list[list[Fraction]]

# A matrix of numbers near one whose determinant is below this has no inverse.
_SINGULAR = 1e-9


def _fractions(matrix: npt.ArrayLike) -> _Rows:
    """Return the exact values of a matrix of floats."""
    return [[Fraction(value) for value in row] for row in np.asarray(matrix, dtype=np.float64).tolist()]


def _exact_inverse(m: _Rows) -> _Rows | None:
    """Return the inverse of a 3 x 3 matrix by cofactors, None when it has none that is of any use."""
    turns = ((1, 2), (2, 0), (0, 1))
    cofactors = [[m[a][c] * m[b][d] - m[a][d] * m[b][c] for c, d in turns] for a, b in turns]
    determinant = sum((m[0][k] * cofactors[0][k] for k in range(3)), Fraction(0))
    if abs(determinant) < _SINGULAR:
        return None
    return [[cofactors[k][i] / determinant for k in range(3)] for i in range(3)]


def inverse(matrix: npt.ArrayLike, sums: Sequence[int] | None = None) -> Float64Array:
    """Return the inverse of a 3 x 3 matrix, every entry the nearest float64 to the exact one.

    Parameters
    ----------
    matrix : (3, 3) finite numbers with an inverse.
    sums : what the rows sum to; the middle column is then taken as what is left of it, free of its own rounding.

    >>> inverse([[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]])[1].round(4).tolist()
    [0.0, 0.3333, 0.0]
    """
    rows = _fractions(matrix)
    if sums is not None:
        rows = [[row[0], total - row[0] - row[2], row[2]] for row, total in zip(rows, sums, strict=True)]
    result = _exact_inverse(rows)
    if result is None:
        raise InputError(f"matrix = {quote(np.asarray(matrix).tolist())}: it has no inverse")
    return np.array([[float(value) for value in row] for row in result])


def white_xyz(white: npt.ArrayLike, name: str = "white") -> Float64Array:
    """Return a white point as XYZ with Y = 1.

    Parameters
    ----------
    white : a chromaticity (x, y), such as `D65`, or a colour (X, Y, Z), whose brightness does not count: `rgb_to_xyz` of a
        pixel of grey card is the white of the light on it.
    name : what the caller calls it, for the message.

    Returns
    -------
    (3,) float64.

    Raises
    ------
    InputError : when it has another shape, a negative number, or a y or Y of 0.

    >>> white_xyz(D65).round(5).tolist()
    [0.95046, 1.0, 1.08906]
    """
    array = finite_array(name, white, (None,))
    if len(array) == 2:
        array = np.array([array[0], array[1], 1.0 - array[0] - array[1]])
    if len(array) != 3 or array.min() < 0.0 or not 1e-6 * array.max() < array[1] <= LARGEST:
        raise InputError(f"{name} = {quote(white)}: expected (x, y) or (X, Y, Z), none negative, y above 0")
    return np.array([array[0] / array[1], 1.0, array[2] / array[1]])


def primaries_matrix(primaries: npt.ArrayLike, white: npt.ArrayLike) -> Float64Array:
    """Return the matrix from linear light of three primaries to XYZ; its second row holds their luminances.

    Parameters
    ----------
    primaries : (3, 2) chromaticities (x, y) of red, green and blue.
    white : chromaticity (x, y) or (X, Y, Z) of the colour that all three at 1 give.

    Returns
    -------
    (3, 3) float64, every entry the nearest to the exact one.

    Raises
    ------
    InputError : when a shape is another, the primaries lie on a line, or a number is not usable.

    Source: B. Lindbloom; SMPTE RP 177.

    >>> primaries_matrix(SRGB_PRIMARIES, D65)[1].round(6).tolist()
    [0.212639, 0.715169, 0.072192]
    """
    corners = finite_array("primaries", primaries, (3, 2))
    if np.abs(corners).max() > 1e6:
        raise InputError(f"primaries = {quote(primaries)}: expected chromaticities (x, y)")
    aim = [Fraction(value) for value in white_xyz(white).tolist()]
    x, y = ([Fraction(value) for value in column] for column in corners.T.tolist())
    columns = [x, y, [1 - a - b for a, b in zip(x, y, strict=True)]]
    undone = _exact_inverse(columns)
    if undone is None:
        raise InputError(f"primaries = {quote(primaries)}: expected three that do not lie on a line")

    # Scale each primary so that together they make the white.
    scale = [sum((undone[k][i] * aim[i] for i in range(3)), Fraction(0)) for k in range(3)]
    return np.array([[float(row[k] * scale[k]) for k in range(3)] for row in columns])


XYZ_FROM_LINEAR = primaries_matrix(SRGB_PRIMARIES, D65)
"""(3, 3) float64, from linear light of the sRGB primaries to XYZ."""

LINEAR_FROM_XYZ = inverse(XYZ_FROM_LINEAR)
"""(3, 3) float64, its inverse."""


def transform(matrix: Float64Array, colors: Float64Array) -> Float64Array:
    """Return colours (..., 3) with a 3 x 3 matrix applied, in a fixed order of operations.

    >>> transform(np.diag([1.0, 2.0, 3.0]), np.ones((2, 2, 3))).shape
    (2, 2, 3)
    """
    return transform_directions(matrix, colors.reshape(-1, 3)).reshape(colors.shape)


def linear_to_xyz(linear: npt.ArrayLike) -> Float64Array:
    """Return CIE XYZ of linear light of the sRGB primaries.

    Parameters
    ----------
    linear : (..., 3) floats, 1 is white; any sign and size.

    Returns
    -------
    (..., 3) float64, Y = 1 for white.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is not finite or beyond 1e30.

    Source: IEC 61966-2-1, from the chromaticities, not from the rounded matrix.

    >>> linear_to_xyz((1.0, 1.0, 1.0)).round(4).tolist()
    [0.9505, 1.0, 1.0891]
    """
    return transform(XYZ_FROM_LINEAR, float_values("linear", linear, "integers are codes of encoded sRGB: see rgb_to_xyz"))


def xyz_to_linear(xyz: npt.ArrayLike) -> Float64Array:
    """Return linear light of the sRGB primaries from CIE XYZ: the inverse of `linear_to_xyz`.

    Parameters
    ----------
    xyz : (..., 3) floats, Y = 1 for white.

    Returns
    -------
    (..., 3) float64; colours that sRGB cannot show have numbers outside 0..1, which are not clamped.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is not finite or beyond 1e30.

    >>> xyz_to_linear(linear_to_xyz((0.2, 0.5, 0.9))).round(12).tolist()
    [0.2, 0.5, 0.9]
    """
    return transform(LINEAR_FROM_XYZ, float_values("xyz", xyz, "white has Y = 1.0"))


def rgb_to_xyz(rgb: npt.ArrayLike) -> Float64Array:
    """Return CIE XYZ of encoded sRGB, under its own white D65.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (..., 3) float64, Y = 1 for white.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    >>> rgb_to_xyz((255, 0, 0)).round(4).tolist()
    [0.4124, 0.2126, 0.0193]
    """
    return transform(XYZ_FROM_LINEAR, srgb_to_linear(array_of("rgb", rgb)))


def xyz_to_rgb(xyz: npt.ArrayLike) -> Float64Array:
    """Return encoded sRGB from CIE XYZ: the inverse of `rgb_to_xyz`.

    Parameters
    ----------
    xyz : (..., 3) floats, Y = 1 for white.

    Returns
    -------
    (..., 3) float64; colours that sRGB cannot show have numbers outside 0..1, which are not clamped.

    Raises
    ------
    InputError : when these are no floats of that shape, or one is not finite or beyond 1e30.

    >>> xyz_to_rgb(rgb_to_xyz((0.2, 0.5, 0.9))).round(12).tolist()
    [0.2, 0.5, 0.9]
    """
    return srgb_from_linear(xyz_to_linear(xyz))


# Cubes of L*a*b* up to this stay below what XYZ may be.
_LARGEST_LAB = 1e6

# Below this the cube root of Lab is a straight line.
_KNEE = 6.0 / 29.0
_LINE = 3.0 * _KNEE * _KNEE


def xyz_to_lab(xyz: npt.ArrayLike, white: npt.ArrayLike = D65) -> Float64Array:
    """Return CIE L*a*b* of XYZ.

    Parameters
    ----------
    xyz : (..., 3) floats, Y = 1 for white.
    white : chromaticity (x, y) or (X, Y, Z) of what counts as white.

    Returns
    -------
    (..., 3) float64: L 0 (black) to 100 (white); a from green to red and b from blue to yellow, 0 for greys.

    Raises
    ------
    InputError : when these are no floats of that shape, one is not finite or beyond 1e30, or the white is none.

    Source: CIE 15:2004, section 8.2.1.

    >>> xyz_to_lab((0.2, 0.2, 0.2), white=E).round(4).tolist()
    [51.8372, 0.0, 0.0]
    """
    ratio = float_values("xyz", xyz, "white has Y = 1.0") / _lab_white(white)
    root = cube_root(np.maximum(ratio, 0.0))
    f = np.where(ratio > _KNEE * _KNEE * _KNEE, root, ratio / _LINE + 4.0 / 29.0)
    return np.stack([116.0 * f[..., 1] - 16.0, 500.0 * (f[..., 0] - f[..., 1]), 200.0 * (f[..., 1] - f[..., 2])], axis=-1)


def lab_to_xyz(lab: npt.ArrayLike, white: npt.ArrayLike = D65) -> Float64Array:
    """Return CIE XYZ from L*a*b*: the inverse of `xyz_to_lab` with the same white.

    Parameters
    ----------
    lab : (..., 3) numbers, L 0..100.
    white : chromaticity (x, y) or (X, Y, Z) of what counts as white.

    Returns
    -------
    (..., 3) float64, Y = 1 for white.

    Raises
    ------
    InputError : when these are no numbers of that shape, one is not finite or beyond 1e6, or the white is none.

    >>> lab_to_xyz((100, 0, 0), white=E).round(12).tolist()
    [1.0, 1.0, 1.0]
    """
    values = bounded_values("lab", array_of("lab", lab), _LARGEST_LAB)
    y = (values[..., 0] + 16.0) / 116.0
    f = np.stack([y + values[..., 1] / 500.0, y, y - values[..., 2] / 200.0], axis=-1)
    result: Float64Array = np.where(f > _KNEE, f * f * f, _LINE * (f - 4.0 / 29.0)) * _lab_white(white)
    return result


def rgb_to_lab(rgb: npt.ArrayLike) -> Float64Array:
    """Return CIE L*a*b* of encoded sRGB, under its own white D65.

    Parameters
    ----------
    rgb : (..., 3) encoded, integers 0..255 or floats 0..1, by their type.

    Returns
    -------
    (..., 3) float64: L 0 (black) to 100 (white); a from green to red and b from blue to yellow.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range.

    >>> rgb_to_lab((255, 0, 0)).round(2).tolist()
    [53.24, 80.09, 67.2]
    """
    return xyz_to_lab(rgb_to_xyz(rgb))


def lab_to_rgb(lab: npt.ArrayLike) -> Float64Array:
    """Return encoded sRGB from L*a*b* under D65: the inverse of `rgb_to_lab`.

    Parameters
    ----------
    lab : (..., 3) numbers, L 0..100.

    Returns
    -------
    (..., 3) float64; colours that sRGB cannot show have numbers outside 0..1, which are not clamped.

    Raises
    ------
    InputError : when these are no numbers of that shape, or one is not finite or beyond 1e6.

    >>> lab_to_rgb(rgb_to_lab((0.2, 0.5, 0.9))).round(12).tolist()
    [0.2, 0.5, 0.9]
    """
    return xyz_to_rgb(lab_to_xyz(lab))


def _lab_white(white: npt.ArrayLike) -> Float64Array:
    """Return a white by whose X, Y and Z one can divide."""
    result = white_xyz(white)
    if result.min() < 1e-6:
        raise InputError(f"white = {quote(white)}: expected X and Z above a millionth of Y")
    return result
