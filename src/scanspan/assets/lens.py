"""The four kinds of lens: how camera coordinates become clip coordinates for an image of a given size.

A lens knows nothing of where the camera stands. Three of them adapt to the size of the image that is asked for: a field of
view and a view height keep their vertical extent and take the aspect from the size; an intrinsic matrix, which belongs to one
size, is scaled the way the image would be when it is resized. A projection matrix of the caller's own is used as it comes.

The intrinsic matrix is kept in scanspan's pixel convention, the first pixel's centre at (1/2, 1/2): there, and only there,
resizing an image by a factor is a multiplication by the factor. OpenCV's, with that centre at (0, 0), needs the half pixel off
and on again.

Source: R. Hartley and A. Zisserman, Multiple View Geometry, section 6.1; OpenCV calib3d, "Detailed Description".
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass

import numpy as np

from scanspan.errors import InputError, LimitError
from scanspan.homogeneous import (
    FloatArray,
    check_fov,
    finite_array,
    finite_number,
    orthographic,
    perspective,
    perspective_depth,
    planes_before,
    quote,
)

Size = tuple[int, int]

# An image of more pixels than this cannot be numbered in int32; a side beyond 2^18 leaves the exact range of 16 sub-pixel bits.
MAX_SIDE = 2**18
MAX_PIXELS = 2**31


def check_size(size: object) -> tuple[int, int]:
    """Return an image size as two Python integers (width, height).

    Parameters
    ----------
    size : two integers above 0 of any integer type; booleans and floats are refused.

    Raises
    ------
    InputError : when it is not two integers above 0.
    LimitError : when a side is above 2**18 or the pixels are more than 2**31.

    >>> check_size(np.array([640, 480], dtype=np.uint16))
    (640, 480)
    """
    expected = "expected (width, height), two whole numbers above 0"
    if isinstance(size, (str, bytes, dict, set)) or not hasattr(size, "__len__") or len(size) != 2:
        raise InputError(f"size = {quote(size)}: {expected}")
    sides = []
    for side in size:  # type: ignore[attr-defined]
        if isinstance(side, (bool, np.bool_)):
            raise InputError(f"size = {quote(size)}: {expected}")
        try:
            sides.append(operator.index(side))
        except TypeError:
            raise InputError(f"size = {quote(size)}: {expected}") from None
    width, height = sides
    if width < 1 or height < 1:
        raise InputError(f"size = ({width}, {height}): {expected}")
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise LimitError(f"size = ({width}, {height}): the limit is {MAX_SIDE} for a side and {MAX_PIXELS} for all pixels")
    return width, height


@dataclass(frozen=True)
class Perspective:
    """A lens with a vertical field of view in degrees; the pixels are square."""

    fov: float

    def __post_init__(self) -> None:
        """Check the angle."""
        object.__setattr__(self, "fov", check_fov(self.fov))

    def projection(self, size: Size, near: float, far: float | None) -> FloatArray:
        """Return the (4, 4) matrix from camera to clip coordinates for an image of size (width, height)."""
        return perspective(self.fov, size[0] / size[1], near, far)

    def pinhole(self, size: Size) -> FloatArray:
        """Return the (3, 3) intrinsic matrix for an image of size (width, height), first pixel centre at (1/2, 1/2)."""
        focal = size[1] / 2.0 / math.tan(math.radians(self.fov) / 2.0)
        return np.array([[focal, 0.0, size[0] / 2.0], [0.0, focal, size[1] / 2.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Orthographic:
    """A lens without perspective: a view height in units of the world; the pixels are square.

    `reach` is the distance at which the stored depth becomes 0 when there is no far plane; nothing is cut there.
    """

    height: float
    reach: float

    def __post_init__(self) -> None:
        """Check the two lengths."""
        for name in ("height", "reach"):
            length = finite_number(name, getattr(self, name))
            if not length > 0.0:
                raise InputError(f"{name} = {length}: expected a length above 0")
            object.__setattr__(self, name, length)

    def projection(self, size: Size, near: float, far: float | None) -> FloatArray:
        """Return the (4, 4) matrix from camera to clip coordinates for an image of size (width, height)."""
        return orthographic(
            self.height * (size[0] / size[1]), self.height, near, max(self.reach, 2.0 * near) if far is None else far
        )

    def pinhole(self, size: Size) -> None:
        """Return None: parallel rays meet in no pinhole."""


@dataclass(frozen=True, eq=False, repr=False)
class Pinhole:
    """A lens given by an intrinsic matrix for images of one size.

    `matrix` is (3, 3) with the rows (fx, skew, cx), (0, fy, cy), (0, 0, 1) in pixels, the first pixel's centre at (1/2, 1/2).
    """

    matrix: FloatArray
    size: Size

    def __post_init__(self) -> None:
        """Check the form of the matrix; the size has been checked by the camera."""
        k = finite_array("K", self.matrix, (3, 3))
        if k[1, 0] != 0.0 or k[2].tolist() != [0.0, 0.0, 1.0]:
            raise InputError(f"K = {quote(k.tolist())}: expected the rows (fx, skew, cx), (0, fy, cy), (0, 0, 1)")
        if not (k[0, 0] > 0.0 and k[1, 1] > 0.0):
            raise InputError(f"K has the focal lengths {k[0, 0]} and {k[1, 1]}: expected pixels above 0")
        k.setflags(write=False)
        object.__setattr__(self, "matrix", k)

    def __repr__(self) -> str:
        return f"Pinhole({self.matrix.tolist()}, size={self.size})"

    def projection(self, size: Size, near: float, far: float | None) -> FloatArray:
        """Return the (4, 4) matrix from camera to clip coordinates for an image of size (width, height)."""
        (fx, skew, cx), (_, fy, cy), _ = self.pinhole(size).tolist()
        width, height = size
        a, b = perspective_depth(near, far)
        return np.array(
            [
                [2.0 * fx / width, -2.0 * skew / width, 1.0 - 2.0 * cx / width, 0.0],
                [0.0, 2.0 * fy / height, 2.0 * cy / height - 1.0, 0.0],
                [0.0, 0.0, a, b],
                [0.0, 0.0, -1.0, 0.0],
            ]
        )

    def pinhole(self, size: Size) -> FloatArray:
        """Return the (3, 3) intrinsic matrix for an image of size (width, height), scaled as the image would be resized."""
        if size == self.size:
            return self.matrix.copy()
        scale = np.array([[size[0] / self.size[0]], [size[1] / self.size[1]], [1.0]])
        scaled: FloatArray = self.matrix * scale
        return scaled


@dataclass(frozen=True, eq=False, repr=False)
class Projection:
    """A lens given by a projection matrix of the caller's own: (4, 4), camera to clip coordinates, for images of every size."""

    matrix: FloatArray

    def __post_init__(self) -> None:
        """Check that the matrix is one, and keep it from being written to."""
        matrix = finite_array("projection", self.matrix, (4, 4))
        if not matrix[3].any():
            raise InputError("projection has a last row of zeros: w would be 0 everywhere")
        matrix.setflags(write=False)
        object.__setattr__(self, "matrix", matrix)

    def __repr__(self) -> str:
        return f"Projection({self.matrix.tolist()})"

    def projection(self, size: Size, near: float, far: float | None) -> FloatArray:
        """Return the matrix; neither the size nor the planes change it."""
        return self.matrix.copy()

    def pinhole(self, size: Size) -> FloatArray | None:
        """Return the (3, 3) intrinsic matrix for an image of size (width, height), or None when there is none."""
        m = self.matrix
        scale = -m[3, 2]
        if not (scale > 0.0 and m[3].tolist() == [0.0, 0.0, m[3, 2], 0.0] and m[0, 3] == m[1, 3] == m[1, 0] == 0.0):
            return None
        width, height = size
        fx, skew, cx = m[0, 0] / scale * width / 2.0, -m[0, 1] / scale * width / 2.0, (1.0 - m[0, 2] / scale) * width / 2.0
        fy, cy = m[1, 1] / scale * height / 2.0, (1.0 + m[1, 2] / scale) * height / 2.0
        return np.array([[fx, skew + 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def planes(self) -> tuple[float, float | None]:
        """Return the distances of the near and the far plane that the matrix holds; far is None for an infinite one."""
        nearest, farthest = planes_before(self.matrix, [(0, 0, 1, 1), (0, 0, -1, 1)]).tolist()
        near = nearest[3] / nearest[2] if nearest[2] != 0.0 else 0.0
        far = farthest[3] / farthest[2] if farthest[2] != 0.0 else None
        return near, far if far is not None and near < far < np.inf else None


Lens = Perspective | Orthographic | Pinhole | Projection
