"""The camera: where the eye stands, what its lens is, and exact converters to and from the conventions of other tools.

One convention holds inside: the world is right-handed, the camera looks down its -z axis with y up, pixel (x, y) covers
[x, x + 1) x [y, y + 1) with y down and its centre at (x + 1/2, y + 1/2). The others differ in axes, in the side from which a
matrix acts, and by half a pixel, which is where most converters are wrong:

    OpenCV      x right, y down, z forward    columns    centre of the first pixel at (0, 0)
    COLMAP      x right, y down, z forward    columns    centre of the first pixel at (1/2, 1/2)
    PyTorch3D   x left,  y up,   z forward    rows       centre of the first pixel at (1/2, 1/2)

Axes change by signs alone, so that poses come back bit for bit.

Source: OpenCV calib3d, "Detailed Description"; COLMAP, "Output Format" and "Frequently Asked Questions"; PyTorch3D, "Cameras".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from scanspan import homogeneous
from scanspan.assets import framing
from scanspan.assets.lens import MAX_PIXELS, MAX_SIDE, Orthographic, Perspective, Pinhole, Projection, check_size
from scanspan.assets.pose import (
    FROM_OPENCV,
    FROM_PYTORCH3D,
    pose_matrix,
    quaternion,
    rotation,
    rotation_from_quaternion,
    translation,
)
from scanspan.assets.viewpoint import Viewpoint
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import FloatArray, finite_array, finite_number, shape_of

__all__ = ["MAX_PIXELS", "MAX_SIDE", "Camera", "check_size"]

# Default near distance of a camera that is given by a matrix and so knows no scale: 0.1 mm where the unit is a metre.
DEFAULT_NEAR = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Camera(Viewpoint):
    """An eye and a lens. Make one with `look_at`, `orthographic`, `frame`, `from_opencv` or another of the class methods.

    Parameters
    ----------
    view : (4, 4) float64, world to camera coordinates; its last row is (0, 0, 0, 1).
    lens : how camera coordinates become clip coordinates.
    near, far : distances of the near and the far plane along the line of sight; far None means that there is none.

    >>> camera = Camera.look_at(eye=(0, 0, 5), target=(0, 0, 0), fov=90)
    >>> camera.project([[0, 0, 0], [1, 1, 0]], size=(200, 100))
    array([[100.,  50.],
           [110.,  40.]])
    """

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        fov: float = 45.0,
        *,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """Return a perspective camera that looks at a point.

        Parameters
        ----------
        eye, target : (3,) positions in the world.
        up : (3,) the direction that shall point up in the picture.
        fov : vertical field of view in degrees.
        near : distance of the near plane; 1/1000 of the distance from eye to target when None.
        far : distance of the far plane; none when None.

        Raises
        ------
        InputError : when a number is out of range, eye equals target, or up is parallel to the line of sight.

        >>> Camera.look_at((0, 0, 5), (0, 0, 0)).eye
        array([0., 0., 5.])
        """
        view = homogeneous.look_at(eye, target, up)
        return cls(view, Perspective(fov), _distance(eye, target) / 1000.0 if near is None else near, far)

    @classmethod
    def orthographic(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        *,
        height: float,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """Return a camera without perspective that looks at a point.

        Parameters
        ----------
        eye, target, up, near, far : as for `look_at`.
        height : what the picture shows from bottom to top, in units of the world.

        Raises
        ------
        InputError : as for `look_at`, or when the height is not above 0.

        >>> Camera.orthographic((0, 0, 5), (0, 0, 0), height=2).project([[1, 1, 0]], (200, 100))
        array([[150.,   0.]])
        """
        view = homogeneous.look_at(eye, target, up)
        distance = _distance(eye, target)
        return cls(view, Orthographic(height, 2.0 * distance), distance / 1000.0 if near is None else near, far)

    @classmethod
    def from_matrix(cls, view: npt.ArrayLike, projection: npt.ArrayLike) -> Camera:
        """Return a camera from two matrices as OpenGL has them; they are used for images of every size as they are.

        Parameters
        ----------
        view : (4, 4) world to camera coordinates, x right, y up, looking down -z; last row (0, 0, 0, 1).
        projection : (4, 4) camera to clip coordinates, -w <= z <= w, the near plane at z = -w.

        Raises
        ------
        InputError : when one is not such a matrix of finite numbers.

        >>> from scanspan.homogeneous import look_at, perspective
        >>> Camera.from_matrix(look_at((0, 0, 5), (0, 0, 0)), perspective(45, 4 / 3, 0.1)).has_far
        False
        """
        lens = Projection(finite_array("projection", projection, (4, 4)))
        near, far = lens.planes()
        return cls(finite_array("view", view, (4, 4)), lens, near, far)

    @classmethod
    def from_opencv(
        cls,
        K: npt.ArrayLike,
        R: npt.ArrayLike,
        t: npt.ArrayLike,
        size: object,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """Return a camera from OpenCV's intrinsic matrix and pose: pixel = K (R x + t), first pixel centre at (0, 0).

        Parameters
        ----------
        K : (3, 3) intrinsic matrix in pixels, rows (fx, skew, cx), (0, fy, cy), (0, 0, 1); the skew is kept.
        R : (3, 3) rotation, world to camera (x right, y down, z forward); cv2.Rodrigues makes it from a vector.
        t : (3,) or (3, 1) translation.
        size : (width, height) of the image that K belongs to. An image of another size is what resizing that one would give.
        near : distance of the near plane, 1e-4 when None. far : distance of the far plane; none when None.

        Raises
        ------
        InputError : when K has another form, R is not a rotation within 1e-6, or a number is out of range.

        >>> camera = Camera.from_opencv([[100, 0, 31.5], [0, 100, 23.5], [0, 0, 1]], np.eye(3), np.zeros(3), (64, 48))
        >>> camera.project([[0, 0, 1]], (64, 48))
        array([[32., 24.]])
        """
        matrix = finite_array("K", K, (3, 3))
        matrix[:2, 2] += 0.5
        pose = pose_matrix(FROM_OPENCV, rotation("R", R), translation("t", t))
        return cls(pose, Pinhole(matrix, check_size(size)), DEFAULT_NEAR if near is None else near, far)

    def to_opencv(self, size: object) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (K (3, 3), R (3, 3), t (3,)) as OpenCV has them for an image of size (width, height).

        Raises
        ------
        InputError : when the camera is not a pinhole camera.

        >>> Camera.look_at((0, 0, 5), (0, 0, 0), fov=90).to_opencv((64, 48))[0]
        array([[24. ,  0. , 31.5],
               [ 0. , 24. , 23.5],
               [ 0. ,  0. ,  1. ]])
        """
        matrix = self._pinhole(size, "OpenCV")
        matrix[:2, 2] -= 0.5
        return matrix, self.view[:3, :3] * FROM_OPENCV + 0.0, self.view[:3, 3] * FROM_OPENCV[:, 0] + 0.0

    @classmethod
    def from_colmap(
        cls,
        model: str,
        params: Sequence[float] | npt.ArrayLike,
        qvec: npt.ArrayLike,
        tvec: npt.ArrayLike,
        size: object,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """Return a camera from COLMAP's cameras.txt and images.txt; the first pixel's centre is at (1/2, 1/2).

        Parameters
        ----------
        model : "PINHOLE" with params (fx, fy, cx, cy), or "SIMPLE_PINHOLE" with (f, cx, cy); a lens with distortion
            has to be undistorted first.
        qvec : (4,) unit quaternion (w, x, y, z), world to camera. tvec : (3,) translation.
        size : (width, height) from cameras.txt. near, far : as for `from_opencv`.

        Raises
        ------
        InputError : when the model is another, or a number is out of range.

        >>> camera = Camera.from_colmap("SIMPLE_PINHOLE", (100, 32, 24), (1, 0, 0, 0), (0, 0, 0), (64, 48))
        >>> camera.project([[0, 0, 1]], (64, 48))
        array([[32., 24.]])
        """
        counts = {"PINHOLE": 4, "SIMPLE_PINHOLE": 3}
        if model not in counts:
            raise unknown_name("camera model", model, counts)
        numbers = finite_array("params", params, (counts[model],)).tolist()
        fx, fy, cx, cy = numbers if model == "PINHOLE" else (numbers[0], numbers[0], numbers[1], numbers[2])
        pose = pose_matrix(FROM_OPENCV, rotation_from_quaternion(qvec), translation("tvec", tvec))
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        return cls(pose, Pinhole(matrix, check_size(size)), DEFAULT_NEAR if near is None else near, far)

    def to_colmap(self, size: object) -> tuple[str, FloatArray, FloatArray, FloatArray]:
        """Return ("PINHOLE", params (4,), qvec (4,), tvec (3,)) as COLMAP has them for an image of size (width, height).

        Raises
        ------
        InputError : when the camera is not a pinhole camera without skew.

        >>> model, params, qvec, tvec = Camera.look_at((0, 0, 5), (0, 0, 0), fov=90).to_colmap((64, 48))
        >>> params
        array([24., 24., 32., 24.])
        """
        matrix = self._pinhole(size, "COLMAP")
        if matrix[0, 1] != 0.0:
            raise InputError(f"the camera has a skew of {matrix[0, 1]} pixels, which COLMAP's PINHOLE cannot hold")
        params = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])
        return "PINHOLE", params, quaternion(self.view[:3, :3] * FROM_OPENCV), self.view[:3, 3] * FROM_OPENCV[:, 0] + 0.0

    @classmethod
    def from_pytorch3d(
        cls,
        R: npt.ArrayLike,
        T: npt.ArrayLike,
        focal_length: npt.ArrayLike,
        principal_point: npt.ArrayLike,
        size: object,
        in_ndc: bool = False,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """Return a camera from PyTorch3D's PerspectiveCameras: row vectors, camera = x R + T with x left, y up, z forward.

        Parameters
        ----------
        R : (3, 3) rotation, acting from the right. T : (3,) translation.
        focal_length : a number or (2,); principal_point : (2,); in pixels, or in NDC units when `in_ndc`.
        size : (width, height); PyTorch3D writes (height, width).
        in_ndc : NDC has +x left and +y up, and the shorter side of the image runs from -1 to 1.
        near, far : as for `from_opencv`.

        Raises
        ------
        InputError : when R is not a rotation within 1e-6, or a number is out of range.

        >>> camera = Camera.from_pytorch3d(np.eye(3), (0, 0, 2), 1.0, (0, 0), (64, 48), in_ndc=True)
        >>> camera.project([[1, 0, 0]], (64, 48))
        array([[20., 24.]])
        """
        width, height = check_size(size)
        focal = np.broadcast_to(finite_array("focal_length", focal_length, () if shape_of(focal_length) == () else (2,)), (2,))
        principal = finite_array("principal_point", principal_point, (2,))
        if in_ndc:
            scale = min(width, height) / 2.0
            focal, principal = focal * scale, np.array([width / 2.0, height / 2.0]) - principal * scale
        matrix = np.array([[focal[0], 0.0, principal[0]], [0.0, focal[1], principal[1]], [0.0, 0.0, 1.0]])
        pose = pose_matrix(FROM_PYTORCH3D, rotation("R", R).T, translation("T", T))
        return cls(pose, Pinhole(matrix, (width, height)), DEFAULT_NEAR if near is None else near, far)

    def to_pytorch3d(self, size: object, in_ndc: bool = False) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return (R (3, 3), T (3,), focal_length (2,), principal_point (2,)) as PyTorch3D has them.

        The size is (width, height), where PyTorch3D writes (height, width); `in_ndc` as for `from_pytorch3d`.

        Raises
        ------
        InputError : when the camera is not a pinhole camera without skew.

        >>> Camera.look_at((0, 0, 5), (0, 0, 0), fov=90).to_pytorch3d((64, 48), in_ndc=True)[2:]
        (array([1., 1.]), array([0., 0.]))
        """
        matrix = self._pinhole(size, "PyTorch3D")
        if matrix[0, 1] != 0.0:
            raise InputError(f"the camera has a skew of {matrix[0, 1]} pixels, which PyTorch3D cannot hold")
        focal, principal = np.array([matrix[0, 0], matrix[1, 1]]), matrix[:2, 2].copy()
        if in_ndc:
            width, height = check_size(size)
            scale = min(width, height) / 2.0
            focal, principal = focal / scale, (np.array([width / 2.0, height / 2.0]) - principal) / scale
        turned = np.ascontiguousarray((self.view[:3, :3] * FROM_PYTORCH3D).T)
        return turned + 0.0, self.view[:3, 3] * FROM_PYTORCH3D[:, 0] + 0.0, focal, principal

    @classmethod
    def frame(
        cls,
        scene: Any,
        direction: str | npt.ArrayLike = "iso",
        *,
        up: str | npt.ArrayLike | None = None,
        fov: float = 30.0,
        aspect: float = 4.0 / 3.0,
        margin: float = 0.03,
        orthographic: bool = False,
        zoom: float = 1.0,
        fit: str = "sphere",
        points: npt.ArrayLike | None = None,
    ) -> Camera:
        """Return a camera that has a whole scene in view from a named direction.

        Parameters
        ----------
        scene : anything with `bounds` ((2, 3), or None when empty) and `up` (a name such as "+Z", or a direction).
        direction : "iso", "front", "back", "left", "right", "top", "bottom", or (3,) the direction from the scene to the eye.
            "iso" looks from (1, 1, 1); with +Y up the front is seen from +Z, with +Z up from -Y.
        up : overrides the scene's.
        fov : vertical field of view in degrees.
        aspect : width over height of the picture to fill.
        margin : share of the picture left free on each side.
        orthographic : without perspective; `fov` then has no effect.
        zoom : enlarges the picture about its middle by this factor, without moving the eye.
        fit : "sphere" fits the bounding sphere of the bounds, "box" their corners, "points" the `points`; the last two are
            tight and centred.
        points : (N, 3) points in the world for fit "points"; when None the scene's own `points`, or the corners of its bounds.

        Raises
        ------
        InputError : when a name is unknown or a number out of range.

        >>> from types import SimpleNamespace
        >>> cube = SimpleNamespace(bounds=[[-1, -1, -1], [1, 1, 1]], up="+Y")
        >>> Camera.frame(cube, "front", fov=90, margin=0, fit="box").eye.round(12)
        array([0., 0., 2.])
        """
        fov, aspect, margin, zoom = (
            homogeneous.check_fov(fov),
            finite_number("aspect", aspect),
            finite_number("margin", margin),
            finite_number("zoom", zoom),
        )
        if not 0.0 <= margin < 0.5:
            raise InputError(f"margin = {margin}: expected a share of at least 0 and below 0.5")
        for name, value in (("aspect", aspect), ("zoom", zoom)):
            if not value > 0.0:
                raise InputError(f"{name} = {value}: expected a number above 0")
        used = 1.0 - 2.0 * margin
        if points is None and fit == "points":
            points = getattr(scene, "points", None)
        slope = math.tan(math.radians(fov) / 2.0)
        slopes = None if orthographic else (slope * aspect * used, slope * used)
        place = framing.place(
            scene.bounds, points, direction, getattr(scene, "up", "+Y") if up is None else up, slopes, fit, aspect
        )

        # Put the near plane half way to the scene: nothing is cut, and the depths keep their precision.
        view = homogeneous.look_at(place.eye, place.eye + place.forward * place.farthest, place.up)
        near = place.nearest / 2.0
        if orthographic:
            return cls(view, Orthographic(place.height / used / zoom, place.farthest + near), near)
        return cls(view, Perspective(math.degrees(2.0 * math.atan(slope / zoom)) if zoom != 1.0 else fov), near)


def _distance(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    """Return the distance of two points."""
    return math.dist(np.asarray(a, dtype=np.float64).tolist(), np.asarray(b, dtype=np.float64).tolist())
