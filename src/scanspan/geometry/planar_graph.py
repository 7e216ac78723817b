"""Rings as a graph: points that are all different, in the order of a sweep, and edges that know how rings wind about them.

A sweep goes down the picture, and from left to right where points are level; points are numbered in that order, so an edge
goes from its lower number to its higher one. Edges between the same two points are one edge. It carries a winding: how many
times rings go down it, less how many times they go up; that is what crossing it from left to right adds to the winding number.
Edges with a winding of 0 bound nothing under any rule and are left out, and spikes without an area with them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.geometry.fixed_point import halves_sign, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Int32Array, Int64Array, Integer, UInt8Array

KEY_LIMIT = 2.0**62  # points in the box, up to which each has a number of its own in an int64


class PlanarGraph(NamedTuple):
    """Points and edges. Edges may cross; a sweep finds out."""

    points: Int64Array  # (V, 2) sub-pixels, by y and then by x, no two equal
    starts: Int64Array  # (V + 1,) edges starts[v] to starts[v + 1] begin at point v, from left to right
    upper: Int64Array  # (E,) where an edge begins
    lower: Int64Array  # (E,) where it ends, a higher number
    winding: Int64Array  # (E,) not 0
    loose: UInt8Array  # (E,) 1 where the edge has been moved off its line, by half a sub-pixel at most


@helper_kernel
def turn_sign(points: Int64Array, a: Integer, b: Integer, c: Integer) -> Integer:
    """Return 1 where the way from a over b to c turns clockwise as seen, -1 where it turns the other way, 0 where neither."""
    x, y = points[b, 0], points[b, 1]
    high, low = product_halves(x - points[a, 0], points[a, 1] - y, points[c, 1] - y, points[c, 0] - x)
    return halves_sign(high, low)


@kernel
def sweep_keys(xy: Int64Array) -> tuple[Int64Array, bool]:
    """Return numbers that are in the order of a sweep as points are, and whether they fit.

    Shapes  xy: (P, 2) sub-pixels, one at least.
    """
    x_low = x_high = xy[0, 0]
    y_low = y_high = xy[0, 1]
    for k in range(1, xy.shape[0]):
        x_low, x_high = min(x_low, xy[k, 0]), max(x_high, xy[k, 0])
        y_low, y_high = min(y_low, xy[k, 1]), max(y_high, xy[k, 1])
    width, keys = x_high - x_low + 1, np.empty(xy.shape[0], np.int64)
    if np.float64(width) * np.float64(y_high - y_low + 1) > KEY_LIMIT:
        return keys, False
    for k in range(xy.shape[0]):
        keys[k] = (xy[k, 1] - y_low) * width + (xy[k, 0] - x_low)
    return keys, True


def sweep_order(xy: Int64Array) -> Int64Array:
    """Return the numbers of points, (P, 2), by y and then by x; one at least."""
    keys, fits = sweep_keys(xy)
    return np.argsort(keys) if fits else np.lexsort((xy[:, 0], xy[:, 1]))


@kernel
def number_points(xy: Int64Array, order: Int64Array) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Give points numbers in the order of a sweep, equal ones the same.

    Shapes  xy: (P, 2); order: (P,) as from sweep_order. Of the result: the (V, 2) different points; (P,) the number of each in
            xy; (V,) the first in xy of each.
    """
    count, total = order.shape[0], 0
    points, number, first = np.empty((count, 2), np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    for k in range(count):
        i = order[k]
        if k == 0 or xy[i, 0] != points[total - 1, 0] or xy[i, 1] != points[total - 1, 1]:
            points[total, 0], points[total, 1], first[total] = xy[i, 0], xy[i, 1], i
            total += 1
        number[i] = total - 1
        first[total - 1] = min(first[total - 1], i)
    return points[:total].copy(), number, first[:total].copy()


@kernel
def ring_edges(number: Int64Array, ring_starts: Int32Array) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Return the edges of rings, each from its upper end: upper, lower and winding, (E,) each.

    Shapes  number: (P,) of the points, ring after ring; ring_starts: (R + 1,).
    """
    upper, lower = np.empty(number.shape[0], np.int64), np.empty(number.shape[0], np.int64)
    winding, total = np.empty(number.shape[0], np.int64), 0
    for ring in range(ring_starts.shape[0] - 1):
        first, last = ring_starts[ring], ring_starts[ring + 1]
        for k in range(first, last):
            v, w = number[k], number[k + 1 if k + 1 < last else first]
            if v != w:
                upper[total], lower[total], winding[total] = min(v, w), max(v, w), 1 if v < w else -1
                total += 1
    return upper[:total].copy(), lower[:total].copy(), winding[:total].copy()


@helper_kernel
def stands_before(points: Int64Array, v: Integer, a: Integer, b: Integer) -> bool:
    """Say whether the edge from v to a stands left of the one from v to b; on one line, whether a comes first."""
    turn = turn_sign(points, v, a, b)
    return bool(turn < 0 or (turn == 0 and a < b))


@helper_kernel
def sort_by_angle(
    points: Int64Array, v: Integer, lower: Int64Array, some: Int64Array, spare: Int64Array, first: Integer, last: Integer
) -> None:
    """Sort edges that begin at one point, some[first:last], from left to right, by merging; `spare` is room."""
    width = 1
    while width < last - first:
        for low in range(first, last, 2 * width):
            middle, high = min(low + width, last), min(low + 2 * width, last)
            i, j = low, middle
            for k in range(low, high):
                from_left = i < middle
                if from_left and j < high:
                    from_left = not stands_before(points, v, lower[some[j]], lower[some[i]])
                spare[k] = some[i] if from_left else some[j]
                i, j = (i + 1, j) if from_left else (i, j + 1)
        for k in range(first, last):
            some[k] = spare[k]
        width *= 2


@kernel
def join_edges(points: Int64Array, upper: Int64Array, lower: Int64Array, winding: Int64Array, loose: UInt8Array) -> PlanarGraph:
    """Return the graph of edges: sorted round the points at which they begin, equal ones joined.

    Shapes  as of PlanarGraph; the edges in any order, and there may be many between two points.
    Needs   upper < lower.
    Cost    O(V + E), and O(k log k) for k edges that begin at one point.
    """
    count, edges = points.shape[0], upper.shape[0]
    places, numbers, spare = np.zeros(count + 2, np.int64), np.empty(edges, np.int64), np.empty(edges, np.int64)

    # Put the edges into buckets by the point at which they begin, a counting sort.
    for e in range(edges):
        places[upper[e] + 2] += 1
    for v in range(count):
        places[v + 2] += places[v + 1]
    for e in range(edges):
        numbers[places[upper[e] + 1]] = e
        places[upper[e] + 1] += 1

    # Sort each bucket by angle, then add up the windings of equal edges.
    starts, total = np.empty(count + 1, np.int64), 0
    from_point, to_point = np.empty(edges, np.int64), np.empty(edges, np.int64)
    windings, is_loose = np.empty(edges, np.int64), np.empty(edges, np.uint8)
    for v in range(count):
        starts[v] = total
        first, last = places[v], places[v + 1]
        if last - first > 1:
            sort_by_angle(points, v, lower, numbers, spare, first, last)
        k = first
        while k < last:
            e = numbers[k]
            wound, moved = winding[e], loose[e]
            k += 1
            while k < last and lower[numbers[k]] == lower[e]:
                wound += winding[numbers[k]]
                moved |= loose[numbers[k]]
                k += 1
            if wound != 0:
                from_point[total], to_point[total], windings[total], is_loose[total] = v, lower[e], wound, moved
                total += 1
    starts[count] = total
    return PlanarGraph(
        points, starts, from_point[:total].copy(), to_point[:total].copy(), windings[:total].copy(), is_loose[:total].copy()
    )
