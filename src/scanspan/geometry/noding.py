"""Noding: edges that cross, touch or overlap become edges that meet at their ends alone, by snap rounding as few as it can.

A crossing is not on the grid. It is rounded to the nearest point that is, and the edges through it are bent there: by half a
sub-pixel at most in x and in y. An edge that was bent could now have a point on its wrong side; so it is bent to every point
that it passes that close, and so is every edge that passes a rounded crossing that close. Then nothing can have changed sides.
Edges that have none of that to do with are split where points lie on them, exactly, and stay where they are. Should that leave
a crossing of an edge that was bent and one that was not, the next round bends that one too.

Source: Guibas and Marimont 1998, Rounding arrangements dynamically, for snap rounding and why it is right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.errors import LimitError
from scanspan.geometry.crossings import MOST_FOUND, find_crossings, find_passing
from scanspan.geometry.planar_graph import PlanarGraph, join_edges, number_points, sweep_order
from scanspan.records import Float64Array, Int64Array, Integer

NO_POINTS = np.empty((0, 2), np.int64)


class Noded(NamedTuple):
    """A graph after a round, and where its points came from."""

    graph: PlanarGraph
    number: Int64Array  # (V,) of the points before: which they are now
    made: Int64Array  # (K,) points that were made, as often as edges pass them
    ends: Int64Array  # (K, 2) the ends of such an edge, points as they are now
    share: Float64Array  # (K,) how much the lower end counts at the point that was made, 0 to 1


def found_rows(rows: Int64Array, total: Integer) -> Int64Array:
    """Return the rows that were found, unless there are too many."""
    if total >= MOST_FOUND:
        raise LimitError(f"rings: edges cross or touch more than {MOST_FOUND} times")
    return rows[:total]


def edge_ends(points: Int64Array, upper: Int64Array, lower: Int64Array) -> Int64Array:
    """Return x, y of both ends of edges, (E, 4)."""
    return np.concatenate([points[upper], points[lower]], axis=1)


def node_edges(graph: PlanarGraph, bend_all: bool = False) -> Noded:
    """Split edges where they cross or touch, one round.

    Parameters
    ----------
    graph : its edges may cross.
    bend_all : whether all edges are bent to the points that they pass, as full snap rounding has it.

    Raises
    ------
    LimitError : there are too many crossings.
    """
    crossings = found_rows(*find_crossings(edge_ends(graph.points, graph.upper, graph.lower), NO_POINTS))

    # Number the old points and the crossings together.
    xy = np.concatenate([graph.points, crossings[:, 3:]])
    points, number, first = number_points(xy, sweep_order(xy))
    count = len(graph.points)
    number, is_made = number[:count], first >= count
    upper, lower = number[graph.upper], number[graph.lower]

    # Find the points that edges pass, and which edges have to be bent there.
    passing = found_rows(*find_passing(edge_ends(points, upper, lower), points))
    edge, point, is_exact = passing[:, 0], passing[:, 1], passing[:, 2] != 0
    loose = graph.loose | np.uint8(bend_all)
    loose[crossings[crossings[:, 2] == 0, :2]] = 1
    loose[edge[is_made[point] & ~is_exact]] = 1
    chosen = is_exact | (loose[edge] != 0)
    edge, point = edge[chosen], point[chosen]

    # Sort them along each edge: those that a straight line passes lie on a staircase.
    rightward = np.sign(points[lower, 0] - points[upper, 0])
    order = np.lexsort((rightward[edge] * points[point, 0] + points[point, 1], edge))
    edge, point = edge[order], point[order]

    # Put the edges' parts one after the other.
    parts = np.bincount(edge, minlength=len(upper)) + 1
    ends = np.cumsum(parts)
    begins = ends - parts
    behind = np.arange(len(edge)) + edge + 1
    start, end = np.empty(int(ends[-1]), np.int64), np.empty(int(ends[-1]), np.int64)
    start[begins], end[ends - 1] = upper, lower
    start[behind], end[behind - 1] = point, point
    winding = np.repeat(graph.winding, parts) * np.where(start < end, 1, -1)
    joined = join_edges(points, np.minimum(start, end), np.maximum(start, end), winding, np.repeat(loose, parts))
    of_made = is_made[point]
    edge, made = edge[of_made], point[of_made]
    share = shares(points, upper[edge], lower[edge], made)
    return Noded(joined, number, made, np.stack([upper[edge], lower[edge]], axis=1), share)


def shares(points: Int64Array, upper: Int64Array, lower: Int64Array, made: Int64Array) -> Float64Array:
    """Return how far along edges points lie, 0 at the upper end and 1 at the lower, along the longer side."""
    whole, part = points[lower] - points[upper], points[made] - points[upper]
    is_steep = np.abs(whole[:, 1]) >= np.abs(whole[:, 0])
    along = np.where(is_steep, part[:, 1], part[:, 0])
    result: Float64Array = np.clip(along / np.where(is_steep, whole[:, 1], whole[:, 0]), 0.0, 1.0)
    return result
