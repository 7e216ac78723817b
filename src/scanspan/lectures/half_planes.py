"""Lines and half-planes as formulas: slope form and multiplied form (S1), and where A, B and C come from (S0, S4).

S1 writes an edge from s to e as a line with a slope, multiplies by e_x - s_x so that upright edges work, and chooses the sign
by the order of the vertices. S0 and S4 solve two equations for A and B and choose C. All are one function up to a factor, and
the factor is where the slips are:

- In slope form an upright edge divides by 0.
- Its sign tells above from below, whichever way the edge runs. The multiplied form changes sign where e_x < s_x, so the one
  cannot take the other's place.
- "Negative inside for counter-clockwise" holds with y up. On a raster with y down, what is seen counter-clockwise has a
  negative formula area, and the two cases change places.

Source: S1, lines 3-60; S0, lines 27-45, 152-170 and 347-363; S4, lines 47-64, 193-227 and 459-479.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from scanspan.errors import InputError
from scanspan.homogeneous import quote

Point = tuple[Fraction, Fraction]
Number = float | Fraction


def slope_form(x: float, y: float, start: tuple[float, float], end: tuple[float, float]) -> float:
    """Return the edge function of S1's line 7: the slope times x - x_s, less y - y_s.

    S1 asks what happens for an upright edge: the division gives infinity, or no number at all on the edge's own column.

    >>> slope_form(1.0, 3.0, (0.0, 0.0), (4.0, 2.0))
    -2.5
    >>> slope_form(1.0, 3.0, (0.0, 0.0), (0.0, 2.0)), slope_form(0.0, 3.0, (0.0, 0.0), (0.0, 2.0))
    (inf, nan)
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.float64(end[1] - start[1]) / np.float64(end[0] - start[0])
        return float(slope * (x - start[0]) - (y - start[1]))


def multiplied_form(x: Number, y: Number, start: tuple[Number, Number], end: tuple[Number, Number]) -> Number:
    """Return the slope form times x_e - x_s; S1, lines 17-24 and, for clockwise triangles, line 60. Exact for Fractions.

    It is negative inside a triangle that runs counter-clockwise with y up.

    >>> multiplied_form(0.5, 0.5, (0.0, 0.0), (1.0, 0.0))
    -0.5
    """
    return (end[1] - start[1]) * (x - start[0]) - (y - start[1]) * (end[0] - start[0])


def flipped_form(x: Number, y: Number, start: tuple[Number, Number], end: tuple[Number, Number]) -> Number:
    """Return the form for counter-clockwise triangles, y up; S1, line 54. It is A x + B y + C of S0.

    >>> flipped_form(0.5, 0.5, (0.0, 0.0), (1.0, 0.0))
    0.5
    """
    return -multiplied_form(x, y, start, end)


def coefficients(start: Point, end: Point) -> tuple[Fraction, Fraction, Fraction]:
    """Return A, B and C of S0's line 168.

    Why C may simply be chosen: a line's equation has a free factor. This choice is the determinant that the solution divides
    by, so nothing is divided; whole numbers stay whole; edges through the origin, where the determinant is 0, need no special
    case; and the value at a point is twice the area of the triangle that the point makes with the edge.
    """
    return start[1] - end[1], end[0] - start[0], start[0] * end[1] - end[0] * start[1]


def solved_coefficients(start: Point, end: Point, c: Fraction) -> tuple[Fraction, Fraction, Fraction]:
    """Return A, B and C for any C but 0, by the inverse matrix of S0's line 166.

    Raises
    ------
    InputError : for an edge whose line runs through the origin, where there is no inverse.
    """
    determinant = start[0] * end[1] - end[0] * start[1]
    if determinant == 0:
        raise InputError(f"start = {quote(start)}, end = {quote(end)}: the line runs through the origin and has no inverse")
    factor = -c / determinant
    return factor * (end[1] - start[1]), factor * (start[0] - end[0]), c


def vertex_of(first: tuple[Fraction, Fraction, Fraction], second: tuple[Fraction, Fraction, Fraction]) -> Point:
    """Return the point on two lines (A, B, C), their cross product; S0, lines 32-38.

    So three edges determine a triangle. They seem to take nine numbers where three points take six; but each line has a free
    factor, and 9 - 3 = 6.

    Raises
    ------
    InputError : for lines that are parallel or one.
    """
    x = first[1] * second[2] - first[2] * second[1]
    y = first[2] * second[0] - first[0] * second[2]
    w = first[0] * second[1] - first[1] * second[0]
    if w == 0:
        raise InputError(f"lines {quote(first)} and {quote(second)}: they have no point in common, or all")
    return x / w, y / w


def twice_area(a: Point, b: Point, c: Point) -> Fraction:
    """Return the determinant of S0's line 351, without the half: positive where the corners run counter-clockwise, y up."""
    return a[0] * (b[1] - c[1]) + b[0] * (c[1] - a[1]) + c[0] * (a[1] - b[1])


def fan(n: int) -> list[tuple[int, int, int]]:
    """Return the triangles of "an n-sided polygon p0 to pn", as S0's line 68 lists them, by the numbers of their corners.

    The slip: p0 to pn are n + 1 corners, and these n - 1 triangles are those of a polygon with n + 1 sides.

    >>> fan(4)
    [(0, 1, 2), (0, 2, 3), (0, 3, 4)]
    """
    return [(0, k, k + 1) for k in range(1, n)]


class SubTriangles(NamedTuple):
    """The three triangles that the edges of a triangle make with the origin; S0, lines 356-363."""

    twice_areas: tuple[Fraction, Fraction, Fraction]  # the three C
    total: Fraction  # twice the area of the triangle, wherever the origin is


def sub_triangles(a: Point, b: Point, c: Point) -> SubTriangles:
    """Cut a triangle into three signed ones from the origin: why a positive area makes the inside positive.

    The slide's last two steps are a sketch. In full: at a point inside, the three edge values are twice the areas that the
    point makes with the edges; seen from there all have one sign, and their sum is twice the area.
    """
    areas = coefficients(a, b)[2], coefficients(b, c)[2], coefficients(c, a)[2]
    return SubTriangles(areas, areas[0] + areas[1] + areas[2])


class SignFlip(NamedTuple):
    """Both forms at one point above an edge, for the edge and for its reverse."""

    slope: tuple[float, float]
    multiplied: tuple[float, float]


def demonstrate_sign_flip() -> SignFlip:
    """Ask both forms about the point (1, 3) over the edge from (0, 0) to (4, 2), and over the same edge turned round.

    >>> demonstrate_sign_flip()
    SignFlip(slope=(-2.5, -2.5), multiplied=(-10.0, 10.0))
    """
    a, b = (0.0, 0.0), (4.0, 2.0)
    slope = slope_form(1.0, 3.0, a, b), slope_form(1.0, 3.0, b, a)
    return SignFlip(slope, (float(multiplied_form(1.0, 3.0, a, b)), float(multiplied_form(1.0, 3.0, b, a))))
