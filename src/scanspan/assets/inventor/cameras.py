"""Camera nodes as cameras.

A camera stands where the transformation in force takes it, without that one's scale, and looks down its own -z. There is no far
plane: Inventor's viewers set both planes to the scene, whatever the file says.

Source: the reference pages of Camera, PerspectiveCamera and OrthographicCamera of Inventor 2.1.
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.transforms import rotation
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray, transform_directions, transform_points

NEAREST = 1e-3  # of the focal distance, where a file gives no near plane that can be used


def camera_of(node: Node, transform: FloatArray) -> Camera:
    """Return the camera of a PerspectiveCamera or an OrthographicCamera.

    Parameters
    ----------
    node : the camera. transform : (4, 4) to the world, for columns, in force there.

    Raises
    ------
    InputError : a number that is none for a camera, or a transformation that leaves no direction.
    """
    turn = rotation(node.get("orientation"))
    eye = transform_points(transform, [node.get("position")])[0, :3]
    forward, up = transform_directions(transform, [-turn[:3, 2], turn[:3, 1]])
    length = float(np.sqrt((forward * forward).sum()))
    if not (math.isfinite(length) and length > 0.0):
        raise InputError("its transformation leaves no direction of sight")
    focal = float(node.get("focalDistance"))
    focal = focal if math.isfinite(focal) and focal > 0.0 else 5.0
    near = float(node.get("nearDistance"))
    near = near if math.isfinite(near) and near > 0.0 else focal * NEAREST
    target = eye + forward * (focal / length)
    if node.kind == "OrthographicCamera":
        return Camera.orthographic(eye, target, up, height=float(node.get("height")), near=near)
    return Camera.look_at(eye, target, up, math.degrees(float(node.get("heightAngle"))), near=near)
