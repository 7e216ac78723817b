"""Exercise 2 of S4, answered: how the bounding box of a triangle is computed without comparing coordinates.

What the flag keeps. Bit 0 says that B >= 0, which is that x does not fall along the edge; bit 3 says that A >= 0, which is that
y does not grow along it. Both are of the edge as it was given, so turning the triangle over must not change them.

What the table holds. Three edges, weighted 1, 2 and 4, make a number of three bits that tells in which cyclic order the three
coordinates rise and fall. Rising along edge 0 alone, for one, means that corner 1 is the greatest and corner 0 the least or
equal to it. Row code - 1 holds the corner with the least and the one with the greatest; for y the two change places, since A
counts the other way.

How the box comes out. Both codes are taken apart from one sum of flags, and four corners are looked up; x and y are cut off to
whole numbers, one is added at the far ends, and the box is clamped to the raster.

For it: the signs are there already, no coordinate is compared, nothing branches. Against it: it is obscure; the code 7 (all
edges rise, so all coordinates are equal) and, where a coordinate is no number, 0 lie outside of the table; the signs are those
of coefficients that were cut off, so the corner that is found may be 1/4096 short of the extreme, which a box of whole
numbers forgives; and it costs a look into memory where two comparisons would do.

Source: S4, lines 276-291, 317 and 435-449, and 481-493 for the questions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from scanspan.lectures.edge_equations import EdgeEqn, look_up
from scanspan.lectures.raster import vertices


class BoxSteps(NamedTuple):
    """The bounding box of a triangle, step by step."""

    flags: tuple[int, int, int]  # of the three edges: 8 for A >= 0, 1 for B >= 0
    x_code: int  # three bits, one an edge
    y_code: int
    x_corners: tuple[int, int]  # the corners with the least and the greatest x
    y_corners: tuple[int, int]
    box: tuple[float, float, float, float]  # least x, greatest x, least y, greatest y, not yet cut off


def box_steps(points: Sequence[Sequence[float]]) -> BoxSteps:
    """Compute a triangle's box as the lectures do, and keep what happens on the way.

    Raises
    ------
    IndexError : for three equal x or y, as the lectures' programs do.

    >>> box_steps([(5, 1), (9, 7), (2, 4)])
    BoxSteps(flags=(1, 8, 9), x_code=5, y_code=6, x_corners=(2, 1), y_corners=(0, 1), box=(2.0, 9.0, 1.0, 7.0))
    """
    v = vertices(points)
    first, second, third = EdgeEqn(v[0], v[1]).flag, EdgeEqn(v[1], v[2]).flag, EdgeEqn(v[2], v[0]).flag
    codes = first + 2 * second + 4 * third
    x_row, (y_high, y_low) = look_up(codes)
    box = v[x_row[0]].x, v[x_row[1]].x, v[y_low].y, v[y_high].y
    return BoxSteps((first, second, third), codes & 7, codes >> 3, x_row, (y_low, y_high), box)


def plain_box(points: Sequence[Sequence[float]]) -> tuple[float, float, float, float]:
    """Return the same box by comparing, which has no code that is out of range.

    >>> plain_box([(5, 1), (5, 7), (5, 4)])
    (5, 5, 1, 7)
    """
    xs, ys = [point[0] for point in points], [point[1] for point in points]
    return min(xs), max(xs), min(ys), max(ys)
