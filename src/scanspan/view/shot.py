"""From the words of a command line to a camera: sizes, vectors, colours, directions, and where the eye stands.

The words mean what they mean in f3d: a direction is the one in which the camera looks, azimuth and elevation turn the eye about
what it looks at, after everything else. A named direction says where the eye is: "front" looks at the front.

Source: F3D, "Command line options"; VTK, vtkCamera (Azimuth, Elevation).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.framing import DIRECTIONS, direction_towards_eye, parse_up
from scanspan.assets.lens import check_size
from scanspan.assets.scene import UPS, Scene
from scanspan.color.names import parse_color
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import cross, unit
from scanspan.records import Float64Array


class Shot(NamedTuple):
    """From where a scene is seen; None where nothing was said."""

    direction: Any = "iso"  # a name, or (3,) from the scene to the eye
    position: Float64Array | None = None  # (3,) of the eye
    focal_point: Float64Array | None = None  # (3,)
    view_up: Float64Array | None = None  # (3,)
    view_angle: float = 30.0  # degrees, vertical
    zoom: float = 1.0
    azimuth: float = 0.0  # degrees
    elevation: float = 0.0  # degrees
    is_orthographic: bool = False
    camera_index: int | None = None  # of a camera that the scene has, which all else gives way to


@contextmanager
def naming(option: str) -> Iterator[None]:
    """Put the name of an option before the message of an error."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


def parse_size(resolution: str | None, size: str | None, default: tuple[int, int]) -> tuple[int, int]:
    """Return (width, height) from "W,H", "WxH" or one number for a square.

    >>> parse_size(None, "640x480", (1, 1)), parse_size("64,48", None, (1, 1)), parse_size(None, "9", (1, 1))
    ((640, 480), (64, 48), (9, 9))
    """
    if resolution is not None and size is not None:
        raise InputError("--resolution and --size say the same: give one of them")
    option, text = ("--resolution", resolution) if resolution is not None else ("--size", size)
    if text is None:
        return default
    sides = re.fullmatch(r"\s*([+-]?\d{1,18})\s*(?:[,xX×]\s*([+-]?\d{1,18})\s*)?", text, re.ASCII)
    if not sides or (option == "--resolution" and sides[2] is None):
        expected = "W,H, such as 1920,1080" if option == "--resolution" else "WxH, such as 1920x1080, or one number"
        raise InputError(f"{option} = {text!r}: expected {expected}")
    with naming(option):
        return check_size((int(sides[1]), int(sides[2] or sides[1])))


def parse_vector(option: str, text: str | None, is_direction: bool = False) -> Float64Array | None:
    """Return three finite numbers from "x,y,z", None from None.

    >>> parse_vector("--camera-position", "1,-2,.5")
    array([ 1. , -2. ,  0.5])
    """
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(math.isfinite(number) for number in numbers):
        raise InputError(f"{option} = {text!r}: expected three numbers x,y,z")
    if is_direction and not any(numbers):
        raise InputError(f"{option} = {text!r}: expected a direction, not 0,0,0")
    return np.array(numbers)


def parse_direction(text: str | None) -> Any:
    """Return the name of a direction, or (3,) from the scene to the eye for the vector in which the camera looks.

    >>> parse_direction("0,0,-1")
    array([0., 0., 1.])
    """
    if text is None:
        return "iso"
    name = text.strip().lower()
    if name in DIRECTIONS:
        return name
    if "," not in text:
        with naming("--camera-direction"):
            raise unknown_name("direction", text, [*DIRECTIONS, "x,y,z"])
    vector = parse_vector("--camera-direction", text, is_direction=True)
    assert vector is not None
    return 0.0 - vector


def parse_shot(
    direction: str | None, position: str | None, focal_point: str | None, view_up: str | None, view_angle: float, zoom: float,
    azimuth: float, elevation: float, is_orthographic: bool, camera_index: int | None = None,
) -> Shot:  # fmt: skip
    """Return the shot that the options of a command line ask for.

    >>> parse_shot("front", None, None, None, 30.0, 1.0, 0.0, 0.0, False).direction
    'front'
    """
    if not 0.0 < zoom < float("inf"):
        raise InputError(f"--camera-zoom-factor = {zoom}: expected a number above 0")
    if not 0.0 < view_angle < 180.0:
        raise InputError(f"--camera-view-angle = {view_angle}: expected degrees between 0 and 180")
    return Shot(
        parse_direction(direction), parse_vector("--camera-position", position),
        parse_vector("--camera-focal-point", focal_point), parse_vector("--camera-view-up", view_up, is_direction=True),
        view_angle, zoom, azimuth, elevation, is_orthographic, camera_index,
    )  # fmt: skip


def parse_background(is_none: bool, color: str | None) -> Any:
    """Return the background that `render` takes, None where nothing was said.

    >>> parse_background(True, None)
    'transparent'
    """
    if is_none and color is not None:
        raise InputError("--no-background and --background-color do not go together")
    return "transparent" if is_none else parse_shade("--background-color", color)


def parse_views(text: str | None) -> list[str]:
    """Return the names of directions from "iso,front,top".

    >>> parse_views("iso, top")
    ['iso', 'top']
    """
    names = [] if text is None else [name.strip().lower() for name in text.split(",")]
    for name in names:
        if name not in DIRECTIONS:
            with naming("--views"):
                raise unknown_name("direction", name, DIRECTIONS)
    return names


def parse_axis(text: str | None) -> str | None:
    """Return the name of an up axis as a scene has it, None from None.

    >>> parse_axis("z")
    '+Z'
    """
    if text is None:
        return None
    name = text.strip().upper()
    name = name if name[:1] in ("+", "-") else f"+{name}"
    if name not in UPS:
        with naming("--up"):
            raise unknown_name("axis", text, UPS)
    return name


def parse_shade(option: str, text: str | None) -> tuple[float, ...] | None:
    """Return a colour as four floats, sRGB with alpha, from a CSS name, "#rrggbb", "255,0,0" or "1.0,0.0,0.0"; None from None.

    >>> parse_shade("--color", "255,0,0")
    (1.0, 0.0, 0.0, 1.0)
    """
    if text is None:
        return None
    value: Any = text
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > 1 and all(re.fullmatch(r"[+-]?[\d.]+(e[+-]?\d+)?", part, re.ASCII | re.IGNORECASE) for part in parts):
        try:
            value = tuple(int(part) if re.fullmatch(r"[+-]?\d{1,9}", part) else float(part) for part in parts)
        except ValueError:
            value = text
    with naming(option):
        return tuple(parse_color(value).tolist())


def make_camera(scene: Scene, shot: Shot, size: tuple[int, int], margin: float = 0.03) -> Camera:
    """Return the camera of a shot: the scene fills the picture unless the shot says where the eye stands or what it looks at.

    Parameters
    ----------
    scene : what is seen.
    shot : from where.
    size : (width, height) of the picture in pixels.
    margin : share of the picture to leave free at each side, where the scene is to fill it.

    Raises
    ------
    InputError : when a number is out of range, the scene has no such camera, or the eye lies in what it looks at.

    Examples
    --------
    >>> from scanspan.assets.mesh import Mesh
    >>> scene = Scene(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    >>> make_camera(scene, Shot(position=np.array([0, 0, 5]), focal_point=np.zeros(3)), (64, 48)).eye
    array([0., 0., 5.])
    """
    if shot.camera_index is not None:
        return camera_of(scene, shot.camera_index)
    sky = parse_up(scene.up)
    if shot.position is None and shot.focal_point is None:
        return _fit(scene, shot, size, sky, margin)

    # Take the distance from the camera that fits where only the target is given, and the target from the bounds.
    low, high = scene.bounds
    centre = low / 2.0 + high / 2.0 if np.isfinite(low).all() else np.zeros(3)
    target = centre if shot.focal_point is None else shot.focal_point
    if shot.position is None:
        towards = direction_towards_eye(shot.direction, sky)[0]
        fitted = _fit(scene, shot._replace(zoom=1.0, azimuth=0.0, elevation=0.0), size, sky, margin)
        offset = towards * max(float(fitted.depth(centre[None])[0]), 2.0 * fitted.near)
    else:
        offset = shot.position - target
    distance = math.hypot(*offset.tolist())
    if not distance > 0.0:
        raise InputError(f"--camera-position = {_quote(target)}: the eye lies in the focal point, which it looks at")

    # Turn the eye about the target, and look.
    upward = direction_towards_eye(offset, sky)[1] if shot.view_up is None else shot.view_up
    offset, upward = _turn(offset, upward, shot)
    slope = math.tan(math.radians(shot.view_angle) / 2.0) / shot.zoom
    angle = shot.view_angle if shot.zoom == 1.0 else math.degrees(2.0 * math.atan(slope))
    if shot.is_orthographic:
        return Camera.orthographic(target + offset, target, upward, height=2.0 * distance * slope)
    return Camera.look_at(target + offset, target, upward, angle)


def check_index(shot: Shot, views: Sequence[str] = ()) -> None:
    """Raise an InputError where a camera of the file is chosen and something else says where the eye stands."""
    if shot.camera_index is None:
        return
    if shot.camera_index < 0:
        raise InputError(f"--camera-index = {shot.camera_index}: expected a number from 0 on")
    if views:
        raise InputError("--camera-index and --views do not go together")
    for name, usual in Shot._field_defaults.items():
        value = getattr(shot, name)
        if name != "camera_index" and (isinstance(value, np.ndarray) or value != usual):
            raise InputError("--camera-index chooses a camera of the file: leave out all other options of the camera but --up")


def camera_of(scene: Scene, index: int) -> Camera:
    """Return a camera that a scene has."""
    if not index < len(scene.cameras):
        there = f"has {len(scene.cameras)}, counted from 0" if scene.cameras else "has no cameras"
        raise InputError(f"--camera-index = {index}: the file {there}")
    return scene.cameras[index]


def _fit(scene: Scene, shot: Shot, size: tuple[int, int], sky: Float64Array, margin: float) -> Camera:
    """Return the camera that looks in the direction of a shot and has the whole scene in view."""
    direction, upward = shot.direction, sky if shot.view_up is None else shot.view_up
    if shot.view_up is not None or shot.azimuth or shot.elevation:
        direction, above = direction_towards_eye(direction, sky)
        direction, upward = _turn(direction, above if shot.view_up is None else upward, shot)
    return Camera.frame(
        scene, direction, up=upward, fov=shot.view_angle, aspect=size[0] / size[1], margin=margin,
        orthographic=shot.is_orthographic, zoom=shot.zoom, fit="points",
    )  # fmt: skip


def _turn(offset: Float64Array, upward: Float64Array, shot: Shot) -> tuple[Float64Array, Float64Array]:
    """Return the direction to the eye, and the up direction, after azimuth and elevation."""
    if not shot.azimuth and not shot.elevation:
        return offset, upward
    for name, degrees in (("azimuth", shot.azimuth), ("elevation", shot.elevation)):
        if not math.isfinite(degrees):
            raise InputError(f"--camera-{name}-angle = {degrees}: expected degrees")
    offset = _rotate(offset, unit(upward), shot.azimuth)
    right = cross(upward, offset)
    if not right.any():
        return offset, upward

    # Turn the up direction too, so that the eye can pass over the top.
    axis = unit(right)
    return _rotate(offset, axis, -shot.elevation), _rotate(cross(offset, right), axis, -shot.elevation)


def _rotate(vector: Float64Array, axis: Float64Array, degrees: float) -> Float64Array:
    """Return a vector turned about an axis of length 1, counter-clockwise as seen from its tip."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along = axis * float((axis * vector).sum())
    turned: Float64Array = along + (vector - along) * cosine + cross(axis, vector) * sine
    return turned


def _quote(vector: Sequence[float] | Float64Array) -> str:
    """Return a vector as it is written on the command line."""
    return ",".join(f"{value:g}" for value in vector)
