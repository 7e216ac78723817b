"""Values inside a triangle, three ways: along edges and then across (bilinear), barycentric, and as a plane; S1 and S2.

For a triangle they are one function, which the tests show in exact fractions. For a polygon with more sides the bilinear way
depends on how the polygon is turned. What the slides leave out or get cut off:

- The figure of the derivation: P2 is the corner that both edges of the scan line leave from, P3 the end of the left one and P1
  of the right one; d1 and d2 are the parts of the left edge, b1 and b2 of the right one, c1 and c2 of the scan line.
- The areas must have signs, or the weights of a point outside add up to more than 1.
- Plane coefficients come with the edges in the order 2, 3, 1: corner 0 with the edge that it does not touch.

Source: S1, lines 126-138; S2, lines 394-518; S0, lines 398-429; S4, lines 501-527.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from scanspan.errors import InputError
from scanspan.homogeneous import quote
from scanspan.lectures.half_planes import coefficients

Point = tuple[Fraction, Fraction]
Weights = tuple[Fraction, Fraction, Fraction]


def exact(points: Sequence[Sequence[float]]) -> list[Point]:
    """Return points as fractions."""
    return [(Fraction(x), Fraction(y)) for x, y in points]


def bilinear(points: Sequence[Point], values: Sequence[Fraction], x: Fraction, y: Fraction) -> Fraction:
    """Return a value inside a convex polygon: along the two edges that the scan line meets, then across; S2, lines 406-409.

    Raises
    ------
    InputError : for a scan line that does not meet two edges.
    """
    meets = []
    for k, (start, end) in enumerate(zip(points, [*points[1:], points[0]], strict=True)):
        if min(start[1], end[1]) <= y < max(start[1], end[1]):
            share = (y - start[1]) / (end[1] - start[1])
            after = values[(k + 1) % len(values)]
            meets.append((start[0] + share * (end[0] - start[0]), values[k] + share * (after - values[k])))
    if len(meets) != 2:
        raise InputError(f"y = {quote(float(y))}: the scan line meets {len(meets)} edges, expected 2")
    (left_x, left), (right_x, right) = sorted(meets)
    return left if left_x == right_x else left + (x - left_x) / (right_x - left_x) * (right - left)


def weights_from_scan_line(
    p1: Point, p2: Point, p3: Point, x: Fraction, y: Fraction
) -> Weights:  # fmt: skip
    """Return alpha, beta and gamma as S2 derives them from the bilinear way, lines 454-502.

    `p2` is the corner that both edges leave from: the scan line at y must meet P2 P3 and P2 P1.
    """
    # The parts of the three lines, as shares: d1 / (d1 + d2) along the left edge, b1 / (b1 + b2) along the right one.
    d = (y - p2[1]) / (p3[1] - p2[1])
    b = (y - p2[1]) / (p1[1] - p2[1])
    x_left, x_right = p2[0] + d * (p3[0] - p2[0]), p2[0] + b * (p1[0] - p2[0])
    c = (x - x_left) / (x_right - x_left)

    # L494-498.
    return c * b, (1 - c) * (1 - d) + c * (1 - b), (1 - c) * d


def weights_from_areas(p1: Point, p2: Point, p3: Point, x: Fraction, y: Fraction, *, signed: bool = True) -> Weights:
    """Return alpha, beta and gamma as shares of the area; S2, lines 504-518. A point's area is the one opposite of it.

    >>> corners = exact([(0, 0), (4, 0), (0, 4)])
    >>> [float(weight) for weight in weights_from_areas(*corners, Fraction(1), Fraction(2))]
    [0.25, 0.25, 0.5]
    >>> float(sum(weights_from_areas(*corners, Fraction(5), Fraction(2), signed=False)))
    2.5
    """
    point = (x, y)
    areas = [doubled_area(point, p2, p3), doubled_area(p1, point, p3), doubled_area(p1, p2, point)]
    total = doubled_area(p1, p2, p3)
    if not signed:
        areas, total = [abs(area) for area in areas], abs(total)
    return areas[0] / total, areas[1] / total, areas[2] / total


def doubled_area(a: Point, b: Point, c: Point) -> Fraction:
    """Return twice the signed area of a triangle, the cross product of two sides."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])


class Plane(NamedTuple):
    """A value over the plane: a x + b y + c."""

    a: Fraction
    b: Fraction
    c: Fraction

    def at(self, x: Fraction, y: Fraction) -> Fraction:
        """Return the value at a point."""
        return self.a * x + self.b * y + self.c


def plane(points: Sequence[Point], values: Sequence[Fraction]) -> Plane:
    """Return the plane through three values by the slides' matrix of edge coefficients; S0, lines 418-426.

    "Obvious?" Yes: an edge's value over twice the area is the barycentric weight of the corner that the edge does not touch,
    and the plane is the sum of three values times their weights.

    >>> corners = exact([(1, 1), (5, 2), (2, 6)])
    >>> found = plane(corners, [Fraction(7), Fraction(9), Fraction(-2)])
    >>> [int(found.at(*corner)) for corner in corners]
    [7, 9, -2]
    """
    p0, p1, p2 = points
    edges = coefficients(p1, p2), coefficients(p2, p0), coefficients(p0, p1)
    total = edges[0][2] + edges[1][2] + edges[2][2]
    if total == 0:
        raise InputError(f"points = {quote([[float(k) for k in point] for point in points])}: expected a triangle with an area")
    rows = [sum((edge[k] * value for edge, value in zip(edges, values, strict=True)), Fraction(0)) / total for k in range(3)]
    return Plane(rows[0], rows[1], rows[2])


class Turned(NamedTuple):
    """A value in the middle of a square whose corners have 0, 1, 0 and 0, at turns of 0, 30 and 45 degrees or so."""

    square: tuple[Fraction, ...]  # bilinear
    triangle: tuple[Fraction, ...]  # the same of one of its halves, at its middle


def demonstrate_turned_square() -> Turned:
    """Turn a square by angles with whole-numbered sides, and interpolate its middle and that of a triangle in it."""
    square, triangle = [], []
    values = [Fraction(0), Fraction(1), Fraction(0), Fraction(0)]
    for cosine, sine in ((1, 0), (4, 3), (12, 5), (3, 4)):
        points = [
            (Fraction(cosine * u - sine * v), Fraction(sine * u + cosine * v)) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        square.append(bilinear(points, values, Fraction(1, 10), Fraction(1, 10)))
        middle = [sum(point[k] for point in points[:3]) / Fraction(3) for k in range(2)]
        triangle.append(bilinear(points[:3], values[:3], middle[0], middle[1]))
    return Turned(tuple(square), tuple(triangle))
