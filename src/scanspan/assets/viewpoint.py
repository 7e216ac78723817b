"""What a camera is to the pipeline: a view matrix, a lens and two planes, and where points of the world appear through them.

How a camera is made, and what it is called in other tools, is in camera.py.

Source: R. Hartley and A. Zisserman, Multiple View Geometry, chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from scanspan import homogeneous
from scanspan.assets.lens import Lens, Orthographic, Projection, check_size
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray, check_planes, compose, finite_array, finite_number, quote


@dataclass(frozen=True, eq=False, repr=False)
class Viewpoint:
    """An eye and a lens; `Camera` adds the ways of making one.

    Parameters
    ----------
    view : (4, 4) float64, world to camera coordinates; its last row is (0, 0, 0, 1).
    lens : how camera coordinates become clip coordinates.
    near, far : distances of the near and the far plane along the line of sight; far None means that there is none.
    """

    view: FloatArray
    lens: Lens
    near: float
    far: float | None = None

    def __post_init__(self) -> None:
        """Check the view matrix and the planes."""
        if not isinstance(self.lens, Lens):
            raise InputError(f"lens = {quote(self.lens)}: expected a Perspective, Orthographic, Pinhole or Projection")
        view = finite_array("view", self.view, (4, 4))
        if view[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
            raise InputError(f"view has the last row {quote(view[3].tolist())}: expected (0, 0, 0, 1)")
        rows = homogeneous.normal_matrix(view)
        if not abs(float(homogeneous.dot(rows[0], view[0, :3]))) > 0.0:
            raise InputError(f"view = {quote(view.tolist())}: expected a matrix that can be inverted")
        view.setflags(write=False)
        object.__setattr__(self, "view", view)
        if not isinstance(self.lens, Projection):
            object.__setattr__(self, "near", finite_number("near", self.near))
            object.__setattr__(self, "far", None if self.far is None else finite_number("far", self.far))
            check_planes(self.near, self.far)

    def __repr__(self) -> str:
        eye = ", ".join(f"{number:.6g}" for number in self.eye)
        return f"{type(self).__name__}(eye=({eye}), lens={self.lens!r}, near={self.near:.6g}, far={self.far})"

    @property
    def eye(self) -> FloatArray:
        """(3,) float64, the position of the eye in the world.

        >>> from scanspan.assets.camera import Camera
        >>> Camera.look_at((1, 2, 3), (0, 0, 0)).eye.round(12)
        array([1., 2., 3.])
        """
        inverse = homogeneous.normal_matrix(self.view)
        x, y, z = (float(value) for value in self.view[:3, 3])
        position: FloatArray = 0.0 - (inverse[0] * x + inverse[1] * y + inverse[2] * z)
        return position

    @property
    def has_far(self) -> bool:
        """Whether there is a far plane."""
        return self.far is not None

    @property
    def is_orthographic(self) -> bool:
        """Whether all lines of sight are parallel."""
        return isinstance(self.lens, Orthographic) or (isinstance(self.lens, Projection) and not self.lens.matrix[3, :3].any())

    def projection(self, size: object) -> FloatArray:
        """Return the (4, 4) matrix from camera to clip coordinates for an image of size (width, height).

        >>> from scanspan.assets.camera import Camera
        >>> Camera.look_at((0, 0, 5), (0, 0, 0), fov=90).projection((64, 64))[3]
        array([ 0.,  0., -1.,  0.])
        """
        return self.lens.projection(check_size(size), self.near, self.far)

    def clip_matrix(self, size: object) -> FloatArray:
        """Return the (4, 4) matrix from world to clip coordinates for an image of size (width, height).

        The aspect comes from the size; the intrinsic matrix of `from_opencv` and its like is scaled as in resizing.

        >>> from scanspan.assets.camera import Camera
        >>> Camera.look_at((0, 0, 5), (0, 0, 0), fov=90).clip_matrix((64, 64))[3]
        array([ 0.,  0., -1.,  5.])
        """
        return compose(self.projection(size), self.view)

    def project(self, points: npt.ArrayLike, size: object) -> FloatArray:
        """Return where points of the world appear in an image.

        Parameters
        ----------
        points : (N, 3) positions in the world.
        size : (width, height) of the image.

        Returns
        -------
        (N, 2) float64 pixels, y down, the first pixel's centre at (1/2, 1/2); NaN for points that are not in front of the eye.

        Raises
        ------
        InputError : when the points are not such an array, or the size is none.

        >>> from scanspan.assets.camera import Camera
        >>> Camera.look_at((0, 0, 5), (0, 0, 0)).project([[0, 0, 0]], (64, 48))
        array([[32., 24.]])
        """
        width, height = check_size(size)
        pinhole = self.lens.pinhole((width, height))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if pinhole is not None:
                x, y, z, _ = homogeneous.transform_points(self.view, points).T
                (fx, skew, cx), (_, fy, cy), _ = pinhole.tolist()
                w = -z
                pixels = np.stack([(x * fx - y * skew) / w + cx, y * -fy / w + cy], axis=-1)
            else:
                x, y, z, w = homogeneous.transform_points(self.clip_matrix(size), points).T
                pixels = np.stack([(x / w + 1.0) * (width / 2.0), (1.0 - y / w) * (height / 2.0)], axis=-1)
        pixels[~(w > 0.0)] = np.nan
        return pixels

    def depth(self, points: npt.ArrayLike) -> FloatArray:
        """Return the distances of (N, 3) points along the line of sight, (N,) float64, negative behind the eye.

        >>> from scanspan.assets.camera import Camera
        >>> Camera.look_at((0, 0, 5), (0, 0, 0)).depth([[3, 0, 1]])
        array([4.])
        """
        result: FloatArray = 0.0 - homogeneous.transform_points(self.view, points)[:, 2]
        return result

    def _pinhole(self, size: object, convention: str) -> FloatArray:
        """Return the intrinsic matrix for an image of a size, or raise an error that names the convention that needs it."""
        matrix = self.lens.pinhole(check_size(size))
        if matrix is None:
            kind = "orthographic" if self.is_orthographic else "oblique"
            raise InputError(f"an {kind} camera has no intrinsic matrix, which {convention} needs")
        return matrix
