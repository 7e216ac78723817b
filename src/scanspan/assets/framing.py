"""Where to stand so that a scene fills the picture: named directions for any up axis, and three ways of fitting.

"sphere" puts the bounding sphere of the bounds inside the picture: the same distance from every direction, at the price of a
small object. "box" fits the eight projected corners of the bounds, "points" the scene's own points: tight and centred. A round
object in its box still leaves half of each side empty; only its points tell that it is round.

Source: the fit solves the linear constraints |x - x0| <= slope * (z + distance) of all points at once; derived here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import FloatArray, cross, dot, finite_array, quote, shape_of, unit

DIRECTIONS = ("iso", "front", "back", "left", "right", "top", "bottom")
FITS = ("sphere", "box", "points")

# The nearest point is kept this far away, as a share of the radius of the scene: else a needle seen end on would touch the eye.
_CLEARANCE = 0.25


@dataclass(frozen=True)
class Placement:
    """Where the eye stands: position, line of sight and up direction, and the distances along it that hold the scene."""

    eye: FloatArray
    forward: FloatArray
    up: FloatArray
    height: float
    nearest: float
    farthest: float


def parse_up(up: object) -> FloatArray:
    """Return an up direction as a unit vector: a name such as "+Y", "-z" or "Z", or three numbers.

    >>> parse_up("+Z")
    array([0., 0., 1.])
    """
    if isinstance(up, str):
        name = up.strip().upper()
        axis = "XYZ".find(name[-1:]) if name else -1
        if axis < 0 or name[:-1] not in ("", "+", "-"):
            raise unknown_name("up axis", up, ("+X", "-X", "+Y", "-Y", "+Z", "-Z"))
        vector = np.zeros(3)
        vector[axis] = -1.0 if name[0] == "-" else 1.0
        return vector
    vector = finite_array("up", up, (3,))
    if not vector.any():
        raise InputError(f"up = {quote(up)}: expected a direction")
    return unit(vector)


def direction_towards_eye(direction: object, up: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the direction from the scene to the eye, and the direction that is up in the picture, both unit vectors.

    Parameters
    ----------
    direction : one of `DIRECTIONS`, or the three numbers of a direction from the scene to the eye.
    up : (3,) unit vector, the scene's up.

    With +Y up the front is seen from +Z, with +Z up from -Y, and the right side from +X in both.

    >>> direction_towards_eye("top", parse_up("+Z"))[1]
    array([0., 1., 0.])
    """
    axis = int(np.argmax(np.abs(up)))
    front = np.array([0.0, -1.0, 0.0]) if axis == 2 else np.array([0.0, 0.0, 1.0])
    front = unit(front - up * float(dot(front, up)))
    right = cross(up, front)
    if isinstance(direction, str):
        corner = np.ones(3)
        corner[axis] = math.copysign(1.0, up[axis])
        named = {"iso": corner, "front": front, "back": -front, "left": -right, "right": right, "top": up, "bottom": -up}
        if direction not in named:
            raise unknown_name("direction", direction, DIRECTIONS)
        towards = unit(named[direction])
    else:
        vector = finite_array("direction", direction, (3,))
        if not vector.any():
            raise InputError(f"direction = {quote(direction)}: expected a direction or one of {', '.join(DIRECTIONS)}")
        towards = unit(vector)

    # Looking along the up axis, put the front at the bottom of the picture, or at its top when looking up.
    if np.abs(cross(towards, up)).max() > 1e-6:
        return towards, up
    looks_down = float(dot(towards, up)) > 0.0
    return towards, (-front if looks_down else front) + 0.0


def place(
    bounds: npt.ArrayLike | None,
    points: npt.ArrayLike | None,
    direction: object,
    up: object,
    slopes: tuple[float, float] | None,
    fit: str,
    aspect: float,
) -> Placement:
    """Return where to stand so that a scene fits.

    Parameters
    ----------
    bounds : (2, 3) lowest and highest corner; None or all NaN for an empty scene.
    points : (N, 3) points that the fit "points" uses; the corners of the bounds when None or empty.
    direction, up : as `direction_towards_eye` and `parse_up` take them.
    slopes : tangents of half the usable horizontal and vertical field of view; None for a camera without perspective.
    fit : one of `FITS`.
    aspect : width over height of the part of the picture to be filled, for a camera without perspective.
    """
    if fit not in FITS:
        raise unknown_name("fit", fit, FITS)
    centre, radius, corners = _ball(bounds)
    towards, upward = direction_towards_eye(direction, parse_up(up))
    right = unit(cross(upward, towards))
    above = cross(towards, right)
    if fit == "points" and points is not None and len(np.asarray(points)):
        corners = finite_array("points", points, (None, 3))

    # Turn the points so that x is right, y up and z away from the eye, all relative to the centre.
    local = corners - centre
    x, y, z = (dot(local, axis) for axis in (right, above, -towards))
    if fit == "sphere":
        x = y = z = np.array([-radius, radius])
        x0, y0, height = 0.0, 0.0, 2.0 * radius * max(1.0, 1.0 / aspect)
        distance = 2.0 * radius if slopes is None else radius * math.sqrt(1.0 + min(slopes) ** -2)
    elif slopes is None:
        x0, y0 = _middle(x), _middle(y)
        height = max(float(y.max() - y.min()), float(x.max() - x.min()) / aspect)
        distance = 2.0 * radius
    else:
        distance = max(_distance(x, z, slopes[0]), _distance(y, z, slopes[1]), _CLEARANCE * radius - float(z.min()))
        x0, y0, height = _centred(x, z, slopes[0], distance), _centred(y, z, slopes[1], distance), 0.0
    height = height if height > 1e-9 * radius else 2.0 * radius
    eye = centre + right * x0 + above * y0 + towards * distance
    return Placement(eye, -towards, upward, height, distance + float(z.min()), distance + float(z.max()))


def _ball(bounds: npt.ArrayLike | None) -> tuple[FloatArray, float, FloatArray]:
    """Return centre and radius of the bounding sphere of bounds, and their eight corners; a point gets a ball around it."""
    if bounds is None or (shape_of(bounds) == (2, 3) and not (np.asarray(bounds) == bounds).any()):
        bounds = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    low, high = finite_array("bounds", bounds, (2, 3))
    if (high < low).any():
        raise InputError(f"bounds = {quote([low.tolist(), high.tolist()])}: expected the lowest corner first")
    centre = low / 2.0 + high / 2.0
    half = high / 2.0 - low / 2.0
    with np.errstate(over="ignore"):
        radius = float(np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]))
    if not math.isfinite(radius) or np.abs(centre).max() > 1e150:
        raise InputError(f"bounds = {quote([low.tolist(), high.tolist()])}: too large to frame")
    if radius <= 1e-9 * float(np.abs(centre).max()):
        radius = max(1.0, 1e-6 * float(np.abs(centre).max())) if radius == 0.0 else 1e-6 * float(np.abs(centre).max())
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return centre, radius or 1.0, corners


def _middle(x: FloatArray) -> float:
    """Return the middle of the range of some numbers."""
    return float(x.min()) / 2.0 + float(x.max()) / 2.0


def _distance(x: FloatArray, z: FloatArray, slope: float) -> float:
    """Return the least distance from which all points lie between two rays of a slope, wherever the eye stands sideways."""
    return (float((x - slope * z).max()) - float((x + slope * z).min())) / (2.0 * slope)


def _centred(x: FloatArray, z: FloatArray, slope: float, distance: float) -> float:
    """Return the sideways position of the eye from which both ends of the picture of some points are as far from the middle.

    The position is that of the tightest pair of rays; their slope is the fixed point of slope = extent(slope) / distance. The
    iteration contracts by about thickness / distance, so that a few rounds do.
    """
    for _ in range(32):
        previous = slope
        slope = max((float((x - slope * z).max()) - float((x + slope * z).min())) / (2.0 * distance), 0.0)
        if abs(slope - previous) <= 1e-9 * previous:
            break
    return (float((x - slope * z).max()) + float((x + slope * z).min())) / 2.0
