"""Polygons to triangles, under any fill rule: sweep, and where edges cross, node them and sweep again.

Most polygons take one sweep. Where it meets a crossing, edges are split (noding.py) and the sweep begins anew, until nothing
crosses; so what comes out never does. Where edges have the inside on both sides or on none, one more sweep goes without them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.errors import ScanspanError
from scanspan.geometry.fill_rule import EVEN_ODD
from scanspan.geometry.noding import Noded, node_edges
from scanspan.geometry.planar_graph import PlanarGraph, join_edges, number_points, ring_edges, sweep_order
from scanspan.geometry.polygon_sweep import BORDERS, CROSSED, sweep_polygon
from scanspan.geometry.project import no_outlines
from scanspan.jit import kernel
from scanspan.records import Float64Array, Int32Array, Int64Array, ScreenTriangles, UInt8Array

PATIENCE = 4  # rounds of noding after which every edge is bent to the points that it passes
MOST_ROUNDS = 32  # rounds of noding; one is common, and more than three were never seen


class PolygonTriangles(NamedTuple):
    """The inside of a polygon, as triangles."""

    points: Int64Array  # (V, 2) sub-pixels; not all need be used
    triangles: Int32Array  # (T, 3) rows of points, counter-clockwise as seen
    inner: UInt8Array  # (T,) bit i set: the edge opposite corner i is a cut
    origin: Int64Array  # (V,) the first of the polygon's own points that is there, -1 where a point was made
    first: Int64Array  # (U,) the same for the points before noding, all of which are the polygon's own
    rounds: list[Noded]  # of noding


@kernel
def cut_once(
    xy: Int64Array, order: Int64Array, ring_starts: Int32Array, fill_rule: int
) -> tuple[int, Int64Array, Int64Array, Int32Array, UInt8Array]:
    """Cut a polygon into triangles in one sweep; return what was found, points, first, triangles and inner.

    Shapes  xy: (P, 2); order: (P,) as from sweep_order; the rest as of PolygonTriangles, of use where BORDERS was found.
    Needs   coordinates within 2^40.
    """
    points, number, first = number_points(xy, order)
    upper, lower, winding = ring_edges(number, ring_starts)
    graph = join_edges(points, upper, lower, winding, np.zeros(upper.shape[0], np.uint8))
    room = 2 * points.shape[0]
    is_border, triangles = np.empty(graph.lower.shape[0], np.uint8), np.empty((room, 3), np.int32)
    inner = np.empty(room, np.uint8)
    state, count = sweep_polygon(points, graph.starts, graph.lower, graph.winding, fill_rule, is_border, triangles, inner)
    return state, points, first, triangles[:count].copy(), inner[:count].copy()


def triangulate_rings(xy: Int64Array, ring_starts: Int32Array, fill_rule: int) -> PolygonTriangles:
    """Cut a polygon into triangles.

    Parameters
    ----------
    xy : (P, 2) sub-pixels within 2^40, ring after ring.
    ring_starts : (R + 1,) where each ring starts.
    fill_rule : one of geometry/fill_rule.py.

    Raises
    ------
    LimitError : edges cross too often.
    """
    if not len(xy):
        none = np.empty(0, np.int64)
        return PolygonTriangles(xy, np.empty((0, 3), np.int32), np.empty(0, np.uint8), none, none, [])
    order = sweep_order(xy)
    state, points, first, triangles, inner = cut_once(xy, order, ring_starts, fill_rule)
    if state == BORDERS:
        return PolygonTriangles(points, triangles, inner, first, first, [])

    # Begin anew, a step at a time.
    points, number, first = number_points(xy, order)
    upper, lower, winding = ring_edges(number, ring_starts)
    graph = join_edges(points, upper, lower, winding, np.zeros(len(upper), np.uint8))
    origin, rounds = first, list[Noded]()
    while True:
        is_border, room = np.empty(len(graph.lower), np.uint8), 2 * len(graph.points)
        triangles, inner = np.empty((room, 3), np.int32), np.empty(room, np.uint8)
        state, count = sweep_polygon(
            graph.points, graph.starts, graph.lower, graph.winding, fill_rule, is_border, triangles, inner
        )
        if state == BORDERS:
            return PolygonTriangles(graph.points, triangles[:count], inner[:count], origin, first, rounds)
        if state != CROSSED:
            graph, fill_rule = borders_of(graph, is_border != 0), EVEN_ODD
            continue

        # Split edges, and keep track of where the polygon's own points are.
        if len(rounds) == MOST_ROUNDS:
            raise ScanspanError(f"rings: edges still cross after {MOST_ROUNDS} rounds of snap rounding")
        noded = node_edges(graph, len(rounds) >= PATIENCE)
        rounds.append(noded)
        graph = noded.graph
        moved = np.full(len(graph.points), -1)
        moved[noded.number] = origin
        origin = moved


def borders_of(graph: PlanarGraph, is_border: NDArray[np.bool_]) -> PlanarGraph:
    """Return a graph with the edges that have the inside on one side alone, each wound about once."""
    upper, lower, loose = graph.upper[is_border], graph.lower[is_border], graph.loose[is_border]
    starts = np.concatenate([[0], np.cumsum(is_border)])[graph.starts]
    return PlanarGraph(graph.points, starts, upper, lower, np.ones(len(upper), np.int64), loose)


def flat_triangles(xy: Int64Array, starts: Int32Array, fill_rule: int, value: float) -> ScreenTriangles:
    """Return a polygon as triangles that all have one depth, which is its colour."""
    cut = triangulate_rings(xy, starts, fill_rule)
    count = len(cut.triangles)
    zeros = np.zeros(count, np.int32)
    return ScreenTriangles(
        xy=cut.points, depth=np.full(len(cut.points), value), clip=np.empty((0, 4)), corners=cut.triangles, source=zeros,
        piece=zeros - 1, weights=np.empty((0, 3, 3)), inner=np.zeros(count, np.uint8), **no_outlines(count),
    )  # fmt: skip


def carry_values(values: Float64Array, first: Int64Array, rounds: list[Noded]) -> Float64Array:
    """Return values of a polygon's own points at the points of its triangles, (V, k).

    A point that was made has the mean of what each edge through it has there; along an edge values change evenly.

    Parameters
    ----------
    values : (P, k).
    first, rounds : as of PolygonTriangles.
    """
    carried = values[first]
    for noded in rounds:
        following = np.zeros((len(noded.graph.points), values.shape[1]))
        following[noded.number] = carried
        made, where, which = np.unique(noded.made, return_index=True, return_inverse=True)
        start, end = following[noded.ends[:, 0]], following[noded.ends[:, 1]]
        there = start + noded.share[:, None] * (end - start)

        # Add what differs from the first to the first, so that constants come out constant.
        base, differences = there[where], np.zeros((len(made), values.shape[1]))
        np.add.at(differences, which, there - base[which])
        following[made] = base + differences / np.bincount(which, minlength=len(made))[:, None]
        carried = following
    return carried
