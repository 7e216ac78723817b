"""The matrices of cameras: where the eye stands, and the frustum or the box that becomes clip space.

Clip space is OpenGL's: y up, -w <= z <= w, the near plane at z = -w. Without a far plane its place is taken by the limit for an
infinite one, which loses nothing: the depth that is stored, (1 - z/w) / 2, is then near / distance.

Source: OpenGL 4.6 core profile, section 13.8 (clip volume); the matrices of glFrustum and glOrtho; E. Lengyel,
Projection Matrix Tricks, GDC 2007 (infinite far plane).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous.checks import FloatArray, finite_array, finite_number, quote
from scanspan.homogeneous.matrices import cross, unit


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
