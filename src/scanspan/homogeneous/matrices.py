"""Products of matrices and vectors, each written out in a fixed order of separate multiplications and additions.

`@` is not used: a BLAS chooses its order and its fused instructions by processor, and the last bit of a vertex decides pixels.
The price is some milliseconds for a million points. Vectors are columns: `matrix` acts from the left, and `compose(a, b)`
applies `b` first.

Inverses are made of cofactors, for the same reason: no library decides their bits, and whole numbers give exact cofactors.

Source: G. Strang, Introduction to Linear Algebra, section 5.3 (cofactors).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous.checks import FloatArray, finite_array, quote, shape_of

# Rows that are transformed together: the columns of one block, 64 KiB each, stay in the second-level cache.
_BLOCK = 8192


def transform_points(matrix: npt.ArrayLike, points: npt.ArrayLike) -> FloatArray:
    """Transform points by a 4 x 4 matrix, in a fixed order of operations.

    Parameters
    ----------
    matrix : (4, 4) numbers, acting on columns (x, y, z, 1).
    points : (N, 3) numbers.

    Returns
    -------
    (N, 4) float64, homogeneous: not divided by w.

    Raises
    ------
    InputError : when a shape or type is not as above, or the matrix is not finite. Points that are not finite pass through.

    >>> transform_points(np.diag([2.0, 3.0, 4.0, 1.0]), [[1, 1, 1]])
    array([[2., 3., 4., 1.]])
    """
    rows = finite_array("matrix", matrix, (4, 4)).tolist()
    table = _rows_of_three("points", points)
    result = np.empty((len(table), 4))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(table), _BLOCK):
            x, y, z = np.ascontiguousarray(table[start : start + _BLOCK].T, dtype=np.float64)
            for i, (m0, m1, m2, m3) in enumerate(rows):
                result[start : start + _BLOCK, i] = x * m0 + y * m1 + z * m2 + m3
    return result


def transform_directions(matrix: npt.ArrayLike, directions: npt.ArrayLike) -> FloatArray:
    """Transform directions by a 3 x 3 matrix, or by the upper left 3 x 3 of a 4 x 4 one: translation does not act on them.

    Parameters
    ----------
    matrix : (3, 3) or (4, 4) numbers.
    directions : (N, 3) numbers; for surface normals pass `normal_matrix(matrix)` as the matrix.

    Returns
    -------
    (N, 3) float64, not normalised.

    Raises
    ------
    InputError : when a shape or type is not as above, or the matrix is not finite.

    >>> transform_directions(np.diag([2.0, 3.0, 4.0]), [[1, 0, 1]])
    array([[2., 0., 4.]])
    """
    rows = _linear_part(matrix).tolist()
    table = _rows_of_three("directions", directions)
    result = np.empty((len(table), 3))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(table), _BLOCK):
            x, y, z = np.ascontiguousarray(table[start : start + _BLOCK].T, dtype=np.float64)
            for i, (m0, m1, m2) in enumerate(rows):
                result[start : start + _BLOCK, i] = x * m0 + y * m1 + z * m2
    return result


def normal_matrix(matrix: npt.ArrayLike) -> FloatArray:
    """Return the matrix that carries surface normals: the inverse transpose of the 3 x 3 part, by cofactors.

    A singular matrix (a scene flattened onto a plane) has no inverse; its cofactors still point the normals the right way.

    Parameters
    ----------
    matrix : (3, 3) or (4, 4) numbers.

    Returns
    -------
    (3, 3) float64; the transformed normals have to be normalised again.

    Raises
    ------
    InputError : when the shape is another, or a number is not finite.

    >>> normal_matrix(np.diag([2.0, 4.0, 1.0]))
    array([[0.5 , 0.  , 0.  ],
           [0.  , 0.25, 0.  ],
           [0.  , 0.  , 1.  ]])
    """
    m = _linear_part(matrix).tolist()
    cofactors = _cofactors_of_three(m)
    determinant = m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2]
    result = np.array(cofactors) + 0.0
    if determinant != 0.0 and math.isfinite(determinant):
        with np.errstate(over="ignore"):
            inverse: FloatArray = result / determinant + 0.0
        if np.isfinite(inverse).all():
            return inverse
    return result


def compose(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return the product of two matrices, 3 x 3 or 4 x 4, which applies `b` first, summed in the order of the columns of `a`.

    Raises
    ------
    InputError : when one is not such a matrix of finite numbers, or the other has another size.

    >>> compose(np.diag([2.0, 2.0, 2.0, 1.0]), np.diag([3.0, 1.0, 1.0, 1.0])).diagonal()
    array([6., 2., 2., 1.])
    """
    side = 3 if shape_of(a) == (3, 3) else 4
    left, right = finite_array("a", a, (side, side)), finite_array("b", b, (side, side))
    product: FloatArray = left[:, 0:1] * right[0]
    for k in range(1, side):
        product = product + left[:, k : k + 1] * right[k]
    return product


def inverse(matrix: npt.ArrayLike) -> FloatArray:
    """Return the inverse of a matrix, by cofactors; exact where the matrix is of small whole numbers and its determinant 1.

    Parameters
    ----------
    matrix : (3, 3) or (4, 4) numbers.

    Returns
    -------
    (3, 3) or (4, 4) float64, with no negative zeros.

    Raises
    ------
    InputError : when the shape is another, a number is not finite, or the determinant is 0 or the inverse beyond float64.

    >>> inverse([[1, 0, 5], [0, 1, 7], [0, 0, 1]]).tolist()
    [[1.0, 0.0, -5.0], [0.0, 1.0, -7.0], [0.0, 0.0, 1.0]]
    """
    side = 3 if shape_of(matrix) == (3, 3) else 4
    given = finite_array("matrix", matrix, (side, side))

    # Bring every row and column to about 1 by powers of two, so that no product overflows or is lost.
    rows = np.frexp(np.abs(given).max(axis=1, keepdims=True))[1]
    columns = np.frexp(np.abs(np.ldexp(given, -rows)).max(axis=0, keepdims=True))[1]
    m = np.ldexp(np.ldexp(given, -rows), -columns).tolist()
    cofactors = _cofactors_of_three(m) if side == 3 else _cofactors_of_four(m)
    determinant = m[0][0] * cofactors[0][0]
    for k in range(1, side):
        determinant += m[0][k] * cofactors[0][k]

    # Divide, and give the inverse what was taken.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        result: FloatArray = np.ldexp(np.array(cofactors).T / determinant, -rows.T - columns.T) + 0.0
    if determinant == 0.0 or not np.isfinite(result).all():
        raise InputError(f"matrix = {quote(given.tolist())}: expected a matrix that can be inverted")
    return result


def _cofactors_of_three(m: list[list[float]]) -> list[list[float]]:
    """Return the cofactors of a 3 x 3 matrix."""
    turns = ((1, 2), (2, 0), (0, 1))
    return [[m[a][c] * m[b][d] - m[a][d] * m[b][c] for c, d in turns] for a, b in turns]


def _cofactors_of_four(m: list[list[float]]) -> list[list[float]]:
    """Return the cofactors of a 4 x 4 matrix: determinants of what is left without a row and a column, with their signs."""
    cofactors = []
    for i in range(4):
        rows = [m[k] for k in range(4) if k != i]
        row = []
        for j in range(4):
            minor = [[line[k] for k in range(4) if k != j] for line in rows]
            parts = _cofactors_of_three(minor)[0]
            value = minor[0][0] * parts[0] + minor[0][1] * parts[1] + minor[0][2] * parts[2]
            row.append(-value if (i + j) % 2 else value)
        cofactors.append(row)
    return cofactors


def unit(vector: npt.ArrayLike) -> FloatArray:
    """Return a vector of three scaled to length one, or zeros when it has no length; neither large nor small ones overflow.

    >>> unit([0.0, 3e200, 4e200])
    array([0. , 0.6, 0.8])
    """
    x, y, z = (float(value) for value in np.asarray(vector, dtype=np.float64))
    largest = max(abs(x), abs(y), abs(z))
    if largest == 0.0:
        return np.zeros(3)
    x, y, z = x / largest, y / largest, z / largest
    length = math.sqrt(x * x + y * y + z * z)
    return np.array([x / length, y / length, z / length])


def cross(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return the cross products of vectors of three, (..., 3); whole numbers up to 2^26 give exact ones.

    >>> cross([1, 0, 0], [0, 1, 0])
    array([0., 0., 1.])
    """
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    ax, ay, az = left[..., 0], left[..., 1], left[..., 2]
    bx, by, bz = right[..., 0], right[..., 1], right[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def dot(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return the inner products of vectors of any one length, (..., k) and (..., k), added up from the first to the last.

    >>> dot([1, 2, 3], [[4, 5, 6], [1, 0, 0]])
    array([32.,  1.])
    """
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    total: FloatArray = np.asarray(left[..., 0] * right[..., 0])
    for k in range(1, left.shape[-1]):
        total = total + left[..., k] * right[..., k]
    return total


def _rows_of_three(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return an array of N rows of three real numbers, of its own type."""
    try:
        table = np.asarray(value)
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name} = {quote(value)}: expected numbers of shape (N, 3)") from None
    if table.dtype.kind not in "iuf" or table.ndim != 2 or table.shape[1] != 3:
        raise InputError(f"{name} has shape {table.shape} and type {table.dtype}: expected numbers of shape (N, 3)")
    return table


def _linear_part(matrix: npt.ArrayLike) -> FloatArray:
    """Return the 3 x 3 part of a 3 x 3 or 4 x 4 matrix."""
    side = 4 if shape_of(matrix) == (4, 4) else 3
    return finite_array("matrix", matrix, (side, side))[:3, :3]
