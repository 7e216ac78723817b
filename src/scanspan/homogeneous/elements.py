"""Points, directions, lines and planes in homogeneous coordinates: what they are, and when two of them are the same.

In the plane a point is (X, Y, W) and a line (a, b, c), the points with a X + b Y + c W = 0. In space a point is (X, Y, Z, W), a
plane (a, b, c, d) likewise, and a line has six Pluecker coordinates: its direction d and its moment m, which is p x d for every
point p on it. Numbers that differ by a factor are the same thing, so the sign does not matter either.

W = 0 is a direction, or ideal point: where parallel lines meet. All of them are the line at infinity, in space the plane at
infinity. All zeros is nothing: what two coincident points have for a line between them. It is returned where there is no answer
(incidence.py), and whatever needs an answer refuses it.

Source: H. S. M. Coxeter, Projective Geometry, chapter 12; J. Pluecker, On a New Geometry of Space, 1865.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous.checks import FloatArray, finite_number, finite_vectors, quote

BoolArray = npt.NDArray[np.bool_]

LINE_AT_INFINITY = (0.0, 0.0, 1.0)
PLANE_AT_INFINITY = (0.0, 0.0, 0.0, 1.0)

# Vectors whose numbers are products of rounded ones are compared within this share of what is compared.
TOLERANCE = 1e-12


def points(cartesian: npt.ArrayLike) -> FloatArray:
    """Return points of the plane (..., 2) or of space (..., 3) with a W of 1.

    Raises
    ------
    InputError : when the shape is another, or a number is not finite.

    >>> points([3, 4])
    array([3., 4., 1.])
    """
    given = finite_vectors("points", cartesian, (2, 3))
    return np.concatenate([given, np.ones((*given.shape[:-1], 1))], axis=-1)


def directions(cartesian: npt.ArrayLike) -> FloatArray:
    """Return directions in the plane (..., 2) or in space (..., 3) as ideal points, with a W of 0: no translation moves them.

    Raises
    ------
    InputError : when the shape is another, or a number is not finite.

    >>> directions([3, 4])
    array([3., 4., 0.])
    """
    given = finite_vectors("directions", cartesian, (2, 3))
    return np.concatenate([given, np.zeros((*given.shape[:-1], 1))], axis=-1)


def cartesian(points: npt.ArrayLike) -> FloatArray:
    """Return points (..., 3) or (..., 4) divided by their W, without it.

    Raises
    ------
    InputError : when the shape is another, a number is not finite, or a W is 0; an ideal point has no such coordinates, and one
        that is almost ideal may have none that float64 can hold.

    >>> cartesian([[3, 4, 2], [-1, -1, -2]])
    array([[1.5, 2. ],
           [0.5, 0.5]])
    """
    given = finite_vectors("points", points, (3, 4))
    missing: BoolArray = np.asarray(given[..., -1] == 0.0)
    if missing.any():
        name, value = _first("points", given, missing)
        kind = "is an ideal point" if value.any() else "is no point"
        raise InputError(f"{name} = {quote(tuple(value.tolist()))} {kind}: expected one with W not 0")
    return _divide("points", given, given[..., -1:])[..., :-1]


def canonical(vectors: npt.ArrayLike) -> FloatArray:
    """Return the one way to write a point, a line or a plane in which the last number that is not 0 is 1.

    A point is divided by its W; an ideal point by the last of its other numbers, so that antipodal directions, which are the
    same ideal point, become the same numbers.

    Parameters
    ----------
    vectors : (..., 3), (..., 4) or (..., 6) homogeneous coordinates.

    Raises
    ------
    InputError : when the shape is another, a number is not finite, a vector is all zeros, which is nothing, or float64 cannot
        hold it so.

    >>> canonical([[-1, -1, -2], [0, -2, 0], [0, 2, 0]])
    array([[0.5, 0.5, 1. ],
           [0. , 1. , 0. ],
           [0. , 1. , 0. ]])
    """
    given = finite_vectors("vectors", vectors, (3, 4, 6))
    empty: BoolArray = np.asarray(~given.any(axis=-1))
    if empty.any():
        name, value = _first("vectors", given, empty)
        raise InputError(f"{name} = {quote(tuple(value.tolist()))}: expected one that is not all zeros")
    last = given.shape[-1] - 1 - np.argmax(given[..., ::-1] != 0.0, axis=-1)
    return _divide("vectors", given, np.take_along_axis(given, last[..., None], axis=-1)) + 0.0


def is_ideal(vectors: npt.ArrayLike, tolerance: float = 0.0) -> BoolArray:
    """Say which points, or lines of space, are at infinity: a W of 0, or no direction. All zeros are not, being nothing.

    Parameters
    ----------
    vectors : (..., 3) or (..., 4) points, or (..., 6) lines of space.
    tolerance : W counts as 0 up to this share of the largest of the other numbers.

    Raises
    ------
    InputError : when the shape is another, a number is not finite, or the tolerance is negative.

    >>> is_ideal([[0, 2, 0], [0, 0, 1], [0, 0, 0]])
    array([ True, False, False])
    """
    given, share = finite_vectors("vectors", vectors, (3, 4, 6)), check_tolerance(tolerance)
    places = slice(3, 6) if given.shape[-1] == 6 else slice(0, given.shape[-1] - 1)
    rest, finite = given[..., places], np.delete(given, places, axis=-1)
    ideal: BoolArray = rest.any(axis=-1) & (np.abs(finite).max(axis=-1) <= share * np.abs(rest).max(axis=-1))
    return ideal


def is_same(a: npt.ArrayLike, b: npt.ArrayLike, tolerance: float = TOLERANCE) -> BoolArray:
    """Say which homogeneous vectors are the same point, line or plane: equal up to a factor, of whatever sign.

    Parameters
    ----------
    a, b : (..., 3), (..., 4) or (..., 6), of one length.
    tolerance : what differences of products may be off by, as a share of the largest product; 0 is exact for whole numbers.

    Raises
    ------
    InputError : when the shapes do not go together, a number is not finite, or the tolerance is negative.

    >>> is_same((1, 2, 3), [(-2, -4, -6), (1, 2, 4)])
    array([ True, False])
    """
    left, right = finite_vectors("a", a, (3, 4, 6)), finite_vectors("b", b, (3, 4, 6))
    share = check_tolerance(tolerance)
    check_together({"a": left, "b": right})
    if left.shape[-1] != right.shape[-1]:
        raise InputError(f"a has {left.shape[-1]} numbers and b {right.shape[-1]}: expected as many")
    left, right = about_one(left), about_one(right)
    minors = left[..., :, None] * right[..., None, :] - left[..., None, :] * right[..., :, None]
    same: BoolArray = left.any(axis=-1) & right.any(axis=-1) & (np.abs(minors).max(axis=(-2, -1)) <= share)
    return same


def check_together(vectors: dict[str, FloatArray]) -> None:
    """Raise an InputError unless the axes before the last of some named vectors go together as NumPy broadcasts them.

    >>> check_together({"p": np.zeros((5, 3)), "q": np.zeros(3)})
    """
    try:
        np.broadcast_shapes(*(vector.shape[:-1] for vector in vectors.values()))
    except ValueError:
        shapes = ", ".join(f"{name} of {vector.shape}" for name, vector in vectors.items())
        raise InputError(f"{shapes}: expected shapes that go together") from None


def check_tolerance(tolerance: float) -> float:
    """Return a tolerance as a float, or raise an InputError unless it is finite and not negative.

    >>> check_tolerance(0)
    0.0
    """
    share = finite_number("tolerance", tolerance)
    if not share >= 0.0:
        raise InputError(f"tolerance = {share}: expected a share of at least 0")
    return share


def about_one(vectors: FloatArray, reach: int = 0) -> FloatArray:
    """Return vectors times powers of two that bring their largest numbers to between 1/2 and 1; zeros stay.

    Those whose largest number is already within 2^-reach to 2^reach stay too.

    >>> about_one(np.array([3.0, 4.0, 0.0])).tolist()
    [0.375, 0.5, 0.0]
    """
    exponents = np.frexp(np.abs(vectors).max(axis=-1, keepdims=True, initial=0.0))[1]
    scaled: FloatArray = np.ldexp(vectors, np.where(np.abs(exponents) <= reach, 0, -exponents))
    return scaled


def _divide(name: str, vectors: FloatArray, divisors: FloatArray) -> FloatArray:
    """Return vectors divided by numbers that are not 0, or raise an InputError where float64 cannot hold the result."""
    with np.errstate(over="ignore"):
        divided: FloatArray = vectors / divisors
    beyond: BoolArray = np.asarray(~np.isfinite(divided).all(axis=-1))
    if beyond.any():
        name, value = _first(name, vectors, beyond)
        raise InputError(f"{name} = {quote(tuple(value.tolist()))}: divided by its last number it is too large for float64")
    return divided


def _first(name: str, vectors: FloatArray, marked: BoolArray) -> tuple[str, FloatArray]:
    """Return what to call the first marked vector, and its numbers."""
    where = tuple(int(k) for k in np.argwhere(marked)[0])
    return (f"{name}[{', '.join(map(str, where))}]" if where else name), vectors[where]
