"""Homogeneous coordinates as S3 shows them: what infinity is, what joins and meets give, and what a frustum does to planes.

Nothing is ported here, as the slides have formulas and no programs; `scanspan.homogeneous` has the formulas. The functions put
the slides' numbers into it and return what comes out, with the answers to the questions in between:

- Which (X, Y, W) has no image on the plane W = 1? (0, 0, 0), as no factor makes it one with W = 1. The slide's exception is
  among the points with W = 0 anyway, all of which have none.
- What if points coincide, or lines? Then the product is (0, 0, 0): there are many lines, or many points. Parallel lines do have
  a point in common, an ideal one.
- What is all this in space? Two points make a line of six numbers, three make a plane; two planes make a line, three a point.
- What points lie on the image of the plane through the eye? Those at infinity, and nothing else.

Source: S3, lines 386-608.
"""

from __future__ import annotations

from typing import NamedTuple

from scanspan.errors import InputError
from scanspan.homogeneous import (
    PLANE_AT_INFINITY,
    FloatArray,
    canonical,
    cartesian,
    compose,
    directions,
    frustum,
    inverse,
    is_same,
    join,
    meet,
    points,
    transform,
    transform_planes,
    translation,
)

Numbers = tuple[float, ...]


class Origin(NamedTuple):
    """Where the origin goes."""

    by_two_rows: Numbers  # x' = a x + b y, y' = c x + d y
    by_three_rows: Numbers  # with t_x and t_y in a third column


def demonstrate_translation() -> Origin:
    """Move the origin by (5, 7): a 2 x 2 matrix leaves it where it is, whatever its numbers; S3, lines 394-398 and 437-447.

    >>> demonstrate_translation()
    Origin(by_two_rows=(0.0, 0.0), by_three_rows=(5.0, 7.0))
    """
    x, y = 0.0, 0.0
    a, b, c, d = 2.0, 3.0, 5.0, 7.0
    return Origin((a * x + b * y, c * x + d * y), _numbers(cartesian(transform(translation((5.0, 7.0)), points((x, y))))))


class Excluded(NamedTuple):
    """Which triples have no image on the plane W = 1, and why; empty where they have one."""

    origin: str  # (0, 0, 0)
    ideal: str  # (1, 2, 0)
    point: str  # (1, 2, 4)


def demonstrate_excluded_point() -> Excluded:
    """Project three triples; S3, lines 415-416: "W not 0, except for one point", which has W = 0 anyway.

    >>> demonstrate_excluded_point()
    Excluded(origin='is no point', ideal='is an ideal point', point='')
    """
    reasons = []
    for triple in ((0, 0, 0), (1, 2, 0), (1, 2, 4)):
        try:
            cartesian(triple)
            reasons.append("")
        except InputError as error:
            reasons.append(str(error).partition(") ")[2].partition(":")[0])
    return Excluded(*reasons)


class Limit(NamedTuple):
    """A point whose W goes to 0 from above and from below, and where it ends."""

    above: tuple[Numbers, ...]  # (x, y) for W = 1, 1/10, 1/100
    below: tuple[Numbers, ...]  # for W = -1, -1/10, -1/100
    ideal: tuple[Numbers, Numbers]  # the ends, which are one ideal point


def demonstrate_limit() -> Limit:
    """Let W of (2, 4, W) go to 0: the point runs away to both sides of one line, and both ends are one; S3, lines 418-433.

    >>> demonstrate_limit().ideal
    ((0.5, 1.0, 0.0), (0.5, 1.0, 0.0))
    """
    weights = 1.0, 1.0 / 10.0, 1.0 / 100.0
    above = tuple(_numbers(cartesian((2.0, 4.0, w))) for w in weights)
    below = tuple(_numbers(cartesian((2.0, 4.0, -w))) for w in weights)
    start, end = canonical(directions([(2.0, 4.0), (-2.0, -4.0)]))
    return Limit(above, below, (_numbers(start), _numbers(end)))


class Incidence(NamedTuple):
    """The products of S3's lines 470-492."""

    line: Numbers  # through (0, 1, 1) and (1, 0, 1)
    point: Numbers  # on (1, 1, -1) and (1, -1, 0)
    coincident: Numbers  # one point twice
    identical: Numbers  # one line twice
    parallel: Numbers  # (1, 0, -1) and (1, 0, 1)
    parallel_reversed: Numbers  # the same, the other one first
    is_one_point: bool  # whether these two are the same


def demonstrate_incidence() -> Incidence:
    """Multiply the slide's points and lines, and those that it asks about.

    >>> demonstrate_incidence().line, demonstrate_incidence().parallel
    ((1.0, 1.0, -1.0), (0.0, -2.0, 0.0))
    """
    parallel, turned = meet((1, 0, -1), (1, 0, 1)), meet((1, 0, 1), (1, 0, -1))
    return Incidence(
        line=_numbers(join((0, 1, 1), (1, 0, 1))),
        point=_numbers(meet((1, 1, -1), (1, -1, 0))),
        coincident=_numbers(join((0, 1, 1), (0, 2, 2))),
        identical=_numbers(meet((1, 1, -1), (-1, -1, 1))),
        parallel=_numbers(parallel),
        parallel_reversed=_numbers(turned),
        is_one_point=bool(is_same(parallel, turned, 0.0)),
    )


class Space(NamedTuple):
    """The same in space; S3, line 494."""

    line: Numbers  # through the points (1, 0, 0) and (1, 1, 0): direction and moment
    plane: Numbers  # through these and (1, 0, 1)
    line_of_planes: Numbers  # on the planes x = 1 and z = 0
    point: Numbers  # on these and y = 2
    is_one_line: bool  # whether the line through the points is the one on the planes


def demonstrate_space() -> Space:
    """Join points of space and meet planes of it: points and planes are dual, and lines are their own duals.

    >>> demonstrate_space().line, demonstrate_space().line_of_planes
    ((0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, -1.0, 0.0, 0.0, 0.0, -1.0))
    """
    a, b, c = points([(1, 0, 0), (1, 1, 0), (1, 0, 1)])
    line, crossing = join(a, b), meet((1, 0, 0, -1), (0, 0, 1, 0))
    return Space(
        line=_numbers(line),
        plane=_numbers(join(a, b, c)),
        line_of_planes=_numbers(crossing),
        point=_numbers(cartesian(meet((1, 0, 0, -1), (0, 0, 1, 0), (0, 1, 0, -2)))),
        is_one_line=bool(is_same(line, crossing, 0.0)),
    )


class FrustumImages(NamedTuple):
    """What a frustum does; planes as rows H M^-1, all with the last number that is not 0 made 1."""

    identity_error: float  # the largest number of M M^-1 less the identity
    eye: Numbers  # of the centre of projection, an ideal point
    eye_plane: Numbers  # of z = 0, the plane at infinity
    projection_plane: Numbers  # of z = -n
    far_plane: Numbers  # of z = -f
    infinity: Numbers  # of the plane at infinity
    infinity_depth: float  # the z' of that plane, (f + n) / (f - n)


def demonstrate_frustum(near: float = 1.0, far: float = 2.0) -> FrustumImages:
    """Send the eye, the plane through it, the projection plane and infinity through a frustum; S3, lines 527-608.

    What lies beyond the far plane comes to lie between z' = 1 and the image of infinity, and what is behind the eye beyond
    that: projected before it is clipped, it comes back from the other side.

    >>> demonstrate_frustum().eye, demonstrate_frustum().infinity_depth
    ((0.0, 0.0, 1.0, 0.0), 3.0)
    """
    matrix = frustum(-1.0, 2.0, -1.5, 1.0, near, far)
    product = compose(matrix, inverse(matrix))
    infinity = transform_planes(matrix, PLANE_AT_INFINITY)
    return FrustumImages(
        identity_error=max(abs(float(product[i, j]) - (i == j)) for i in range(4) for j in range(4)),
        eye=_numbers(canonical(transform(matrix, (0, 0, 0, 1)))),
        eye_plane=_numbers(canonical(transform_planes(matrix, (0, 0, 1, 0)))),
        projection_plane=_numbers(canonical(transform_planes(matrix, (0, 0, 1, near)))),
        far_plane=_numbers(canonical(transform_planes(matrix, (0, 0, 1, far)))),
        infinity=_numbers(canonical(infinity)),
        infinity_depth=float(-infinity[3] / infinity[2]),
    )


def _numbers(array: FloatArray) -> Numbers:
    """Return an array as a tuple."""
    return tuple(array.tolist())
