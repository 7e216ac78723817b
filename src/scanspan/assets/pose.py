"""The conversion between poses: signs that turn axes, rotations that are checked, and quaternions.

Axes change by signs alone, so that a pose comes back bit for bit.

Source: S. W. Shepperd, Quaternion from Rotation Matrix, Journal of Guidance and Control 1 (1978).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from scanspan import homogeneous
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray, finite_array, quote, shape_of

# A rotation may be off by this much, the rounding of a float32 file; it is then used as it came.
ROTATION_TOLERANCE = 1e-6

# Signs that turn the axes (x right, y down, z forward) and (x left, y up, z forward) into (x right, y up, z backward).
FROM_OPENCV = np.array([[1.0], [-1.0], [-1.0]])
FROM_PYTORCH3D = np.array([[-1.0], [1.0], [-1.0]])


def pose_matrix(signs: FloatArray, rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Return the view matrix of a rotation and a translation into other axes."""
    view = np.eye(4)
    view[:3, :3] = rotation * signs + 0.0
    view[:3, 3] = translation * signs[:, 0] + 0.0
    return view


def translation(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return a translation of shape (3,) or (3, 1) as (3,)."""
    return finite_array(name, value, (3, 1) if shape_of(value) == (3, 1) else (3,)).reshape(3)


def rotation(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return a rotation matrix as it came, or raise an InputError when it is none."""
    matrix = finite_array(name, value, (3, 3))
    error = float(np.abs(homogeneous.compose(matrix, matrix.T) - np.eye(3)).max())
    if not error <= ROTATION_TOLERANCE:
        raise InputError(f"{name} = {quote(matrix.tolist())}: expected a rotation, but it is off by {error:.3g}")
    if float(homogeneous.dot(homogeneous.cross(matrix[0], matrix[1]), matrix[2])) < 0.0:
        raise InputError(f"{name} = {quote(matrix.tolist())}: expected a rotation, but it mirrors")
    return matrix


def rotation_from_quaternion(value: npt.ArrayLike) -> FloatArray:
    """Return the rotation of a unit quaternion (w, x, y, z)."""
    quaternion = finite_array("qvec", value, (4,))
    length = math.hypot(*quaternion.tolist())
    if not abs(length - 1.0) <= ROTATION_TOLERANCE:
        raise InputError(f"qvec = {quote(quaternion.tolist())}: expected a unit quaternion, but its length is {length:.9g}")
    w, x, y, z = (quaternion / length).tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternion(rotation: FloatArray) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) of a rotation, w not negative.

    Take the largest of the four components from the diagonal, so that nothing is divided by a small one.
    Source: S. W. Shepperd, Quaternion from Rotation Matrix, 1978.
    """
    r = rotation.tolist()
    trace = r[0][0] + r[1][1] + r[2][2]
    squares = [1.0 + trace, *(1.0 + 2.0 * r[i][i] - trace for i in range(3))]
    largest = max(range(4), key=lambda i: squares[i])
    mixed = [
        [squares[0], r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]],
        [r[2][1] - r[1][2], squares[1], r[0][1] + r[1][0], r[0][2] + r[2][0]],
        [r[0][2] - r[2][0], r[0][1] + r[1][0], squares[2], r[1][2] + r[2][1]],
        [r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], squares[3]],
    ][largest]
    length = math.hypot(*mixed) * (-1.0 if mixed[0] < 0.0 else 1.0)
    return np.array(mixed) / length + 0.0
