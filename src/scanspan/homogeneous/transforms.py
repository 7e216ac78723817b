"""Transforms of the plane and of space as one matrix each, and what they do to points, lines and planes.

A translation is no 2 x 2 matrix, since those leave the origin where it is; it is a 3 x 3 one. Points are columns and are
multiplied from the left. A plane is a row H with H p = 0; after M its points are M p, so it is H M^-1, because
(H M^-1)(M p) = 0. That is why normals take the inverse transpose (matrices.py: normal_matrix). A line of the plane goes as a
plane does; one of space is carried by the points on it.

A matrix with the last row (0, 0, 1) or (0, 0, 0, 1), up to a factor, is affine and leaves infinity where it is. Others are
projective: the frustum's sends the eye to infinity, and infinity to a plane within reach.

Source: R. Hartley and A. Zisserman, Multiple View Geometry, chapters 2 and 3, section 4.1 (maps from points).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous.checks import FloatArray, finite_array, finite_number, finite_vectors, quote, shape_of
from scanspan.homogeneous.elements import about_one
from scanspan.homogeneous.incidence import REACH
from scanspan.homogeneous.matrices import compose, inverse, unit


def translation(offset: npt.ArrayLike) -> FloatArray:
    """Return the matrix that moves points: (3, 3) for an offset (2,), (4, 4) for one of (3,).

    Raises
    ------
    InputError : when the offset is neither, or not finite.

    >>> translation((5, 7)).tolist()
    [[1.0, 0.0, 5.0], [0.0, 1.0, 7.0], [0.0, 0.0, 1.0]]
    """
    moved = finite_array("offset", offset, (2,) if shape_of(offset) == (2,) else (3,))
    return affine(np.eye(len(moved)), moved)


def scaling(factors: npt.ArrayLike) -> FloatArray:
    """Return the matrix that scales along the axes: (3, 3) for two factors, (4, 4) for three.

    Raises
    ------
    InputError : when the factors are neither, or not finite.

    >>> scaling((2, 3)).diagonal()
    array([2., 3., 1.])
    """
    given = finite_array("factors", factors, (2,) if shape_of(factors) == (2,) else (3,))
    return affine(np.diag(given))


def rotation(degrees: float, axis: npt.ArrayLike | None = None) -> FloatArray:
    """Return the matrix that turns by an angle: the plane from x to y, or space about an axis, as a right-handed screw.

    Parameters
    ----------
    degrees : the angle; quarter turns are exact.
    axis : None for (3, 3) in the plane; (3,) a direction for (4, 4) in space.

    Raises
    ------
    InputError : when a number is not finite, or the axis is zero.

    >>> rotation(90).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    angle = math.fmod(finite_number("degrees", degrees), 360.0)
    quarters = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    turned = angle + 360.0 if angle < 0.0 else angle
    cosine, sine = quarters.get(turned, (math.cos(math.radians(angle)), math.sin(math.radians(angle))))
    if axis is None:
        return affine([[cosine, -sine], [sine, cosine]])
    along = finite_array("axis", axis, (3,))
    if not along.any():
        raise InputError(f"axis = {quote(along.tolist())}: expected a direction")
    x, y, z = unit(along).tolist()
    rest = 1.0 - cosine
    return affine(
        [
            [cosine + x * x * rest, x * y * rest - z * sine, x * z * rest + y * sine],
            [y * x * rest + z * sine, cosine + y * y * rest, y * z * rest - x * sine],
            [z * x * rest - y * sine, z * y * rest + x * sine, cosine + z * z * rest],
        ]
    )


def affine(linear: npt.ArrayLike, offset: npt.ArrayLike | None = None) -> FloatArray:
    """Return the matrix of x' = linear x + offset: (3, 3) for a linear part (2, 2), (4, 4) for one of (3, 3).

    Raises
    ------
    InputError : when the shapes are others, or a number is not finite.

    >>> affine([[1, 2], [3, 4]], (5, 6)).tolist()
    [[1.0, 2.0, 5.0], [3.0, 4.0, 6.0], [0.0, 0.0, 1.0]]
    """
    side = 2 if shape_of(linear) == (2, 2) else 3
    result = np.eye(side + 1)
    result[:side, :side] = finite_array("linear", linear, (side, side))
    if offset is not None:
        result[:side, side] = finite_array("offset", offset, (side,))
    return result


def is_affine(matrix: npt.ArrayLike) -> bool:
    """Say whether a (3, 3) or (4, 4) matrix leaves the line or plane at infinity where it is.

    Raises
    ------
    InputError : when the shape is another, or a number is not finite.

    >>> is_affine(translation((1, 2)))
    True
    """
    side = 3 if shape_of(matrix) == (3, 3) else 4
    last = finite_array("matrix", matrix, (side, side))[-1]
    return not last[:-1].any() and bool(last[-1] != 0.0)


def transform(matrix: npt.ArrayLike, points: npt.ArrayLike) -> FloatArray:
    """Return homogeneous points M p, each sum in the order of the columns; ideal points are points.

    Parameters
    ----------
    matrix : (3, 3) for points of the plane (..., 3), (4, 4) for points of space (..., 4).

    Raises
    ------
    InputError : when the shapes are others, a number is not finite, or the product is too large for float64.

    >>> transform(translation((5, 7)), [(1, 1, 1), (1, 1, 0)])
    array([[6., 8., 1.],
           [1., 1., 0.]])
    """
    given = finite_vectors("points", points, (3, 4))
    side = given.shape[-1]
    return _times(finite_array("matrix", matrix, (side, side)), given)


def transform_planes(matrix: npt.ArrayLike, planes: npt.ArrayLike) -> FloatArray:
    """Return planes as rows H M^-1: where a matrix takes them when it takes their points p to M p.

    Parameters
    ----------
    matrix : (4, 4), invertible.
    planes : (..., 4).

    Raises
    ------
    InputError : when the shapes are others, a number is not finite, or the matrix has no inverse.

    >>> transform_planes(translation((0, 0, 5)), (0, 0, 1, 0))
    array([ 0.,  0.,  1., -5.])
    """
    return planes_before(inverse(finite_array("matrix", matrix, (4, 4))), planes)


def planes_before(matrix: npt.ArrayLike, planes: npt.ArrayLike) -> FloatArray:
    """Return rows H M: the planes that a matrix takes to the given ones, such as the borders of clip space in the world.

    Parameters
    ----------
    matrix : (4, 4); it need not have an inverse.
    planes : (..., 4) after the matrix.

    Raises
    ------
    InputError : when the shapes are others, or a number is not finite.

    >>> planes_before(translation((0, 0, 5)), (0, 0, 1, -5))
    array([0., 0., 1., 0.])
    """
    return _times(finite_array("matrix", matrix, (4, 4)).T, finite_vectors("planes", planes, (4,)))


def transform_lines(matrix: npt.ArrayLike, lines: npt.ArrayLike) -> FloatArray:
    """Return lines of the plane as rows l M^-1, and lines of space by the points on them.

    Parameters
    ----------
    matrix : (3, 3) for lines (..., 3), invertible; (4, 4) for Pluecker lines (..., 6).

    Raises
    ------
    InputError : when the shapes are others, a number is not finite, or a (3, 3) matrix has no inverse.

    >>> transform_lines(translation((5, 7)), (1, 1, -1))
    array([  1.,   1., -13.])
    >>> transform_lines(translation((0, 1, 0)), (1, 0, 0, 0, 0, 0))
    array([ 1.,  0.,  0.,  0.,  0., -1.])
    """
    given = finite_vectors("lines", lines, (3, 6))
    side = 3 if given.shape[-1] == 3 else 4
    m = finite_array("matrix", matrix, (side, side))
    if side == 3:
        return _times(inverse(m).T, given)

    # Take each of the six numbers, p_i q_j - p_j q_i, to those of M p and M q, by the 2 x 2 minors of M.
    m = about_one(m.reshape(1, 16), REACH).reshape(4, 4)
    pairs = ((3, 0), (3, 1), (3, 2), (1, 2), (2, 0), (0, 1))
    minors = [[m[i, k] * m[j, n] - m[i, n] * m[j, k] for k, n in pairs] for i, j in pairs]
    return _times(np.array(minors), given)


def projective_map(sources: npt.ArrayLike, targets: npt.ArrayLike) -> FloatArray:
    """Return the matrix that takes four points of the plane, or five of space, to as many others, up to a factor.

    Parameters
    ----------
    sources, targets : (4, 3) points of the plane, no three on a line; or (5, 4) points of space, no four on a plane.

    Raises
    ------
    InputError : when the shapes are others, a number is not finite, or points are in such a place.

    >>> square = [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    >>> projective_map(square, [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]).diagonal()
    array([2., 2., 1.])
    """
    shape = (4, 3) if shape_of(sources) == (4, 3) else (5, 4)
    before = _basis("sources", finite_array("sources", sources, shape))
    after = _basis("targets", finite_array("targets", targets, shape))
    result = compose(after, inverse(before))
    largest = result[-1, -1] if result[-1, -1] != 0.0 else result.flat[np.abs(result).argmax()]
    scaled: FloatArray = result / largest + 0.0
    return scaled


def _basis(name: str, points: FloatArray) -> FloatArray:
    """Return the matrix that takes the ends of the axes and the point of all ones to points."""
    columns = points[:-1].T
    place = "three on a line" if len(points) == 4 else "four on a plane"
    trouble = InputError(f"{name} = {quote(points.tolist())}: expected no {place}")
    try:
        factors = _times(inverse(columns), points[-1])
    except InputError:
        raise trouble from None
    if (np.abs(factors) <= 1e-12 * np.abs(factors).max()).any():
        raise trouble
    scaled: FloatArray = columns * factors
    return scaled


def _times(matrix: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return M v for vectors (..., k), each sum in the order of the columns, or raise an InputError where that overflows."""
    columns = [vectors[..., k] for k in range(vectors.shape[-1])]
    result = []
    with np.errstate(over="ignore", invalid="ignore"):
        for row in matrix.tolist():
            total = columns[0] * row[0]
            for value, number in zip(columns[1:], row[1:], strict=True):
                total = total + value * number
            result.append(total)
    products: FloatArray = np.stack(result, axis=-1) + 0.0
    if not np.isfinite(products).all():
        raise InputError(f"matrix = {quote(matrix.tolist())}: the product is too large for float64")
    return products
