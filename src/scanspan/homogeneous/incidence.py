"""Join and meet: the line through two points, the point on two lines, and the same in space.

In the plane both are the cross product. That is duality: interchange "point" and "line" and every sentence stays true. In space
points and planes are dual and lines are dual to themselves, with direction and moment exchanged:

    two points              a line        two planes                 a line
    a line and a point      a plane       a line and a plane         a point
    three points            a plane       three planes               a point

Where there is no answer, or more than one, all numbers are 0: for coincident points, collinear ones, a line and a point on it,
and the duals of these. Parallel lines and planes do have an answer: an ideal point, or an ideal line. Every product is written
out in a fixed order, and whole numbers up to 2^26 give exact answers in the plane. Since a factor is free, what is larger than
2^256 or smaller than 2^-256 is brought to about 1 first, and no product overflows.

Source: F. Klein, Elementary Mathematics from an Advanced Standpoint: Geometry; J. Stolfi, Oriented Projective Geometry, 1991.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous.checks import FloatArray, finite_vectors
from scanspan.homogeneous.elements import TOLERANCE, BoolArray, about_one, check_together, check_tolerance
from scanspan.homogeneous.matrices import cross, dot

# Powers of two between which numbers are multiplied as they come.
REACH = 256


def join(*parts: npt.ArrayLike) -> FloatArray:
    """Return what goes through points and lines: the line through two points, or in space the plane through three or the like.

    Parameters
    ----------
    parts : two points of the plane (..., 3); or two or three points of space (..., 4); or a line of space (..., 6) and a point
        of it (..., 4), in this order. Ideal points are points.

    Returns
    -------
    (..., 3) a line of the plane, (..., 6) a line of space, or (..., 4) a plane. All zeros where points are the same, are on
    one line, or the point is on the line.

    Raises
    ------
    InputError : for other shapes, or a number that is not finite.

    >>> join((0, 1, 1), (1, 0, 1))
    array([ 1.,  1., -1.])
    >>> join((0, 0, 2, 1), (1, 0, 2, 1), (0, 1, 2, 1))
    array([ 0.,  0.,  1., -2.])
    """
    return _combine("join", "point", parts, swap=False)


def meet(*parts: npt.ArrayLike) -> FloatArray:
    """Return what lines and planes have in common: the point on two lines, or in space the point on three planes or the like.

    Parameters
    ----------
    parts : two lines of the plane (..., 3); or two or three planes (..., 4); or a line of space (..., 6) and a plane (..., 4),
        in this order.

    Returns
    -------
    (..., 3) or (..., 4) a point, or (..., 6) a line of space; an ideal one where the parts are parallel. All zeros where lines
    or planes are the same, planes have a line in common, or the line is on the plane.

    Raises
    ------
    InputError : for other shapes, or a number that is not finite.

    >>> meet((1, 1, -1), (1, -1, 0))
    array([-1., -1., -2.])
    >>> meet((1, 0, -1), (1, 0, 1))
    array([ 0., -2.,  0.])
    """
    return _combine("meet", "plane", parts, swap=True)


def side(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return on which side two lines of space pass each other: positive, negative, or 0 for lines that meet or are parallel.

    Parameters
    ----------
    a, b : (..., 6) lines of space.

    Raises
    ------
    InputError : for other shapes, or a number that is not finite.

    >>> x_axis, upright = join((0, 0, 0, 1), (1, 0, 0, 1)), join((5, 1, 0, 1), (5, 1, 1, 1))
    >>> float(side(x_axis, upright))
    1.0
    """
    left, right = (about_one(finite_vectors(name, line, (6,)), REACH) for name, line in (("a", a), ("b", b)))
    check_together({"a": left, "b": right})
    return dot(left[..., :3], right[..., 3:]) + dot(left[..., 3:], right[..., :3])


def is_incident(element: npt.ArrayLike, point: npt.ArrayLike, tolerance: float = TOLERANCE) -> BoolArray:
    """Say which points lie on lines or planes. In the plane the two may change places; in space the plane or line comes first.

    Parameters
    ----------
    element : (..., 3) lines of the plane, (..., 4) planes or (..., 6) lines of space.
    point : (..., 3) points of the plane, or (..., 4) of space.
    tolerance : what sums of products may be off by, as a share of the largest product; 0 is exact for whole numbers.

    Raises
    ------
    InputError : for other shapes, a number that is not finite, or a negative tolerance.

    >>> is_incident((1, 1, -1), [(0.5, 0.5, 1), (1, -1, 0), (1, 1, 1)])
    array([ True,  True, False])
    """
    on, given = finite_vectors("element", element, (3, 4, 6)), finite_vectors("point", point, (3, 4))
    share = check_tolerance(tolerance)
    check_together({"element": on, "point": given})
    on, given = about_one(on), about_one(given)
    if on.shape[-1] == 6 and given.shape[-1] == 4:
        rest = np.abs(_line_and_point(on, given)).max(axis=-1)
    elif on.shape[-1] == given.shape[-1]:
        rest = np.abs(dot(on, given))
    else:
        raise InputError(f"element of shape {on.shape}, point of shape {given.shape}: expected both in the plane or in space")
    incident: BoolArray = rest <= share * np.abs(on).max(axis=-1) * np.abs(given).max(axis=-1)
    return incident


def _combine(name: str, kind: str, parts: tuple[npt.ArrayLike, ...], *, swap: bool) -> FloatArray:
    """Return the join of parts, or their meet, which is the join with direction and moment of lines exchanged."""
    given = [about_one(finite_vectors(f"{name}[{k}]", part, (3, 4, 6)), REACH) for k, part in enumerate(parts)]
    check_together({f"{name}[{k}]": part for k, part in enumerate(given)})
    widths = tuple(part.shape[-1] for part in given)
    if widths == (3, 3):
        return cross(*given) + 0.0
    if widths == (4, 4):
        return (_exchange(_two_points(*given)) if swap else _two_points(*given)) + 0.0
    if widths == (4, 4, 4):
        return _line_and_point(_two_points(*given[:2]), given[2]) + 0.0
    if widths == (6, 4):
        return _line_and_point(_exchange(given[0]) if swap else given[0], given[1]) + 0.0
    of_plane = "lines" if swap else "points"
    raise InputError(
        f"{name}: got vectors of {widths} numbers, expected (3, 3) for {of_plane} of the plane; (4, 4), (4, 4, 4) for {kind}s, "
        f"or (6, 4) for a line and a {kind} of space"
    )


def _two_points(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the line through two points of space: its direction, and its moment."""
    direction = p[..., 3:] * q[..., :3] - q[..., 3:] * p[..., :3]
    return np.concatenate([direction, cross(p[..., :3], q[..., :3])], axis=-1)


def _line_and_point(line: FloatArray, point: FloatArray) -> FloatArray:
    """Return the plane through a line of space and a point."""
    direction, moment = line[..., :3], line[..., 3:]
    normal = cross(direction, point[..., :3]) + point[..., 3:] * moment
    return np.concatenate([normal, -dot(moment, point[..., :3])[..., None]], axis=-1)


def _exchange(line: FloatArray) -> FloatArray:
    """Return a line with direction and moment exchanged: from lines as joins to lines as meets, and back."""
    return np.concatenate([line[..., 3:], line[..., :3]], axis=-1)
