"""Points, directions and 4 x 4 matrices in homogeneous coordinates, in plain NumPy.

Every product is written out in a fixed order of separate multiplications and additions, and `@` is not used: a BLAS chooses its
order and its fused instructions by processor, and the last bit of a vertex decides pixels. The price is some milliseconds for a
million points. Vectors are columns: `matrix` acts from the left, and `compose(a, b)` applies `b` first.

Clip space is OpenGL's: y up, -w <= z <= w, the near plane at z = -w. Without a far plane its place is taken by the limit for an
infinite one, which loses nothing: the depth that is stored, (1 - z/w) / 2, is then near / distance.

Source: OpenGL 4.6 core profile, section 13.8 (clip volume); the matrices of glFrustum and glOrtho; E. Lengyel,
Projection Matrix Tricks, GDC 2007 (infinite far plane).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError

FloatArray = npt.NDArray[np.float64]

# Rows that are transformed together: the columns of one block, 64 KiB each, stay in the second-level cache.
_BLOCK = 8192


def quote(value: object) -> str:
    """Return a value as one short line for an error message.

    >>> quote([[1.0, 2.0],
    ...        [3.0, 4.0]])
    '[[1.0, 2.0], [3.0, 4.0]]'
    """
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else text[:77] + "..."


def finite_array(name: str, value: object, shape: tuple[int | None, ...]) -> FloatArray:
    """Return a value as a float64 array of a given shape, every number finite.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : numbers; booleans, strings and complex numbers are refused.
    shape : the expected shape, None where any length will do.

    Raises
    ------
    InputError : when the value has another shape or type, or holds NaN or an infinity.

    >>> finite_array("eye", (1, 2, 3), (3,))
    array([1., 2., 3.])
    """
    wanted = "a number" if shape == () else f"numbers of shape ({', '.join('N' if n is None else str(n) for n in shape)}"
    wanted += "" if shape == () else ",)" if len(shape) == 1 else ")"
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name} = {quote(value)}: expected {wanted}") from None

    # Compare type and shape before the values, so that the message names the first thing that is wrong.
    matches = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in "iuf" or not matches:
        came = f"shape {array.shape}" if array.dtype.kind in "iuf" else f"type {array.dtype}"
        raise InputError(f"{name} = {quote(value)}: expected {wanted}, not {came}")
    with np.errstate(over="ignore"):
        result = np.array(array, dtype=np.float64)
    if not np.isfinite(result).all():
        where = np.argwhere(~np.isfinite(result))[0]
        index = f"[{', '.join(map(str, where))}]" if shape else ""
        raise InputError(f"{name}{index} = {float(result[tuple(where)])}: expected a finite number")
    return result


def shape_of(value: object) -> tuple[int, ...] | None:
    """Return the shape of an array, or None when a value is none, such as a ragged list.

    >>> shape_of([[1, 2], [3]]) is None
    True
    """
    try:
        return np.asarray(value).shape
    except (ValueError, TypeError, OverflowError):
        return None


def finite_number(name: str, value: object) -> float:
    """Return a value as a finite float, or raise an InputError that quotes it.

    >>> finite_number("fov", 45)
    45.0
    """
    return float(finite_array(name, value, ()))


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
    turns = ((1, 2), (2, 0), (0, 1))
    cofactors = [[m[a][c] * m[b][d] - m[a][d] * m[b][c] for c, d in turns] for a, b in turns]
    determinant = m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2]
    result = np.array(cofactors) + 0.0
    if determinant != 0.0 and math.isfinite(determinant):
        with np.errstate(over="ignore"):
            inverse: FloatArray = result / determinant + 0.0
        if np.isfinite(inverse).all():
            return inverse
    return result


def compose(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return the product of two 4 x 4 matrices, which applies `b` first, summed in the order of the columns of `a`.

    Raises
    ------
    InputError : when one is not a 4 x 4 matrix of finite numbers.

    >>> compose(np.diag([2.0, 2.0, 2.0, 1.0]), np.diag([3.0, 1.0, 1.0, 1.0])).diagonal()
    array([6., 2., 2., 1.])
    """
    left, right = finite_array("a", a, (4, 4)), finite_array("b", b, (4, 4))
    product: FloatArray = left[:, 0:1] * right[0] + left[:, 1:2] * right[1] + left[:, 2:3] * right[2] + left[:, 3:4] * right[3]
    return product


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
    """Return the cross product of two vectors of three.

    >>> cross([1, 0, 0], [0, 1, 0])
    array([0., 0., 1.])
    """
    ax, ay, az = (float(value) for value in np.asarray(a, dtype=np.float64))
    bx, by, bz = (float(value) for value in np.asarray(b, dtype=np.float64))
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def look_at(eye: npt.ArrayLike, target: npt.ArrayLike, up: npt.ArrayLike = (0.0, 1.0, 0.0)) -> FloatArray:
    """Return the view matrix of an eye that looks at a target: world to camera, x right, y up, looking down -z.

    Parameters
    ----------
    eye, target : (3,) positions in the world.
    up : (3,) the direction that shall point up in the picture; it need not be a unit vector or at a right angle.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    InputError : when a number is not finite, eye and target are the same, or up is zero or parallel to the line of sight.

    >>> look_at((0, 0, 5), (0, 0, 0))[2]
    array([ 0.,  0.,  1., -5.])
    """
    position, aim, upward = finite_array("eye", eye, (3,)), finite_array("target", target, (3,)), finite_array("up", up, (3,))
    with np.errstate(over="ignore"):
        sight = aim - position
    if not sight.any():
        raise InputError(f"eye = target = {quote(position.tolist())}: expected two different positions")
    if not np.isfinite(sight).all():
        raise InputError(f"eye = {quote(position.tolist())}, target = {quote(aim.tolist())}: too far apart")
    if not upward.any():
        raise InputError(f"up = {quote(upward.tolist())}: expected a direction")

    # Make the three axes: a cross product below 1e-9 of two unit vectors is no more than their rounding.
    forward = unit(sight)
    sideways = cross(forward, unit(upward))
    if not np.abs(sideways).max() > 1e-9:
        raise InputError(f"up = {quote(upward.tolist())}: parallel to the line of sight; expected another direction")
    right = unit(sideways)
    axes = np.array([right, unit(cross(right, forward)), -forward])
    result = np.eye(4)
    result[:3, :3] = axes
    result[:3, 3] = -(axes[:, 0] * position[0] + axes[:, 1] * position[1] + axes[:, 2] * position[2])
    return result + 0.0


def check_planes(near: float, far: float | None) -> None:
    """Raise an InputError unless 0 < near < far; far may be None for no far plane.

    >>> check_planes(0.1, None)
    """
    if not near > 0.0:
        raise InputError(f"near = {near}: expected a distance above 0")
    if far is not None and not far > near:
        raise InputError(f"far = {far}: expected a distance beyond near = {near}, or None for no far plane")


def perspective_depth(near: float, far: float | None) -> tuple[float, float]:
    """Return the third row (0, 0, a, b) of a perspective matrix as (a, b): z = -w at near, z = w at far or at infinity.

    >>> perspective_depth(0.5, None)
    (-1.0, -1.0)
    """
    if far is None:
        return -1.0, -2.0 * near
    ratio = near / far
    return -(1.0 + ratio) / (1.0 - ratio), -2.0 * near / (1.0 - ratio)


def frustum(left: float, right: float, bottom: float, top: float, near: float, far: float | None = None) -> FloatArray:
    """Return the perspective projection through a window of the near plane, as glFrustum has it.

    Parameters
    ----------
    left, right, bottom, top : the window on the near plane, in units of the world.
    near, far : distances of the planes along the line of sight; far None is an infinite one.

    Returns
    -------
    (4, 4) float64, camera to clip coordinates.

    Raises
    ------
    InputError : when the window is empty, near is not above 0, or far not beyond near.

    >>> frustum(-1, 1, -1, 1, 1)[3]
    array([ 0.,  0., -1.,  0.])
    """
    edges = {"left": left, "right": right, "bottom": bottom, "top": top}
    window = [finite_number(name, value) for name, value in edges.items()]
    near, far = finite_number("near", near), None if far is None else finite_number("far", far)
    check_planes(near, far)
    width, height = window[1] - window[0], window[3] - window[2]
    if width == 0.0 or height == 0.0:
        raise InputError(f"left, right, bottom, top = {quote(window)}: expected a window that is not empty")
    a, b = perspective_depth(near, far)
    return np.array(
        [
            [2.0 * near / width, 0.0, (window[1] + window[0]) / width, 0.0],
            [0.0, 2.0 * near / height, (window[3] + window[2]) / height, 0.0],
            [0.0, 0.0, a, b],
            [0.0, 0.0, -1.0, 0.0],
        ]
    )


def perspective(fov_degrees: float, aspect: float, near: float, far: float | None = None) -> FloatArray:
    """Return the symmetric perspective projection of a vertical field of view.

    Parameters
    ----------
    fov_degrees : vertical field of view in degrees, between 0 and 180.
    aspect : width over height of the picture.
    near, far : distances of the planes along the line of sight; far None is an infinite one.

    Returns
    -------
    (4, 4) float64, camera to clip coordinates.

    Raises
    ------
    InputError : when an argument is outside its range.

    >>> perspective(90, 2, 1)[:2].round(12)
    array([[0.5, 0. , 0. , 0. ],
           [0. , 1. , 0. , 0. ]])
    """
    fov, aspect = check_fov(fov_degrees), finite_number("aspect", aspect)
    near, far = finite_number("near", near), None if far is None else finite_number("far", far)
    if not aspect > 0.0:
        raise InputError(f"aspect = {aspect}: expected a number above 0")
    check_planes(near, far)
    slope = math.tan(math.radians(fov) / 2.0)
    a, b = perspective_depth(near, far)
    return np.array(
        [[1.0 / (slope * aspect), 0.0, 0.0, 0.0], [0.0, 1.0 / slope, 0.0, 0.0], [0.0, 0.0, a, b], [0.0, 0.0, -1.0, 0.0]]
    )


def check_fov(fov: float) -> float:
    """Return a field of view in degrees as a float, or raise an InputError unless it lies between 0 and 180.

    >>> check_fov(45)
    45.0
    """
    degrees = finite_number("fov", fov)
    if not 0.0 < degrees < 180.0:
        raise InputError(f"fov = {degrees}: expected degrees between 0 and 180")
    return degrees


def orthographic(width: float, height: float, near: float, far: float) -> FloatArray:
    """Return the orthographic projection of a box centred on the line of sight.

    Parameters
    ----------
    width, height : size of the box across the line of sight, in units of the world.
    near, far : distances of its two ends.

    Returns
    -------
    (4, 4) float64, camera to clip coordinates; w is 1.

    Raises
    ------
    InputError : when a side is not above 0, or far is not beyond near.

    >>> orthographic(4, 2, 1, 3)[:2].tolist()
    [[0.5, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
    """
    width, height = finite_number("width", width), finite_number("height", height)
    near, far = finite_number("near", near), finite_number("far", far)
    for name, side in (("width", width), ("height", height)):
        if not side > 0.0:
            raise InputError(f"{name} = {side}: expected a length above 0")
    if not far > near:
        raise InputError(f"far = {far}: expected a distance beyond near = {near}")
    depth = far - near
    return np.array(
        [
            [2.0 / width, 0.0, 0.0, 0.0],
            [0.0, 2.0 / height, 0.0, 0.0],
            [0.0, 0.0, -2.0 / depth, -(far + near) / depth],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


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
