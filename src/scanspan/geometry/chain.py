"""The strokes of polylines: two sides, joins at the corners, caps at the ends. See stroke.py for what a stroke is.

All corners are worked out at once. Each gives some points to either side of the line, numbered by corner and by place; sorting
the numbers puts the sides together.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.stroke import NEAR, across, arcs, segment_shapes, unit
from scanspan.records import Array, BoolArray, Float64Array, Int64Array

LAST = 1 << 40  # a place behind all others of a corner


class Side:
    """One side of a stroke, as it is put together: points, each with its corner and its place there."""

    def __init__(self) -> None:
        self.points: list[Float64Array] = [np.empty((0, 2))]
        self.corners: list[Int64Array] = [np.empty(0, np.int64)]
        self.places: list[Int64Array] = [np.empty(0, np.int64)]

    def add(self, points: Float64Array, corners: Int64Array, place: int | Int64Array) -> None:
        """Add points, (N, 2), each at its corner, (N,)."""
        self.points.append(points)
        self.corners.append(corners)
        self.places.append(np.broadcast_to(np.asarray(place, np.int64), corners.shape))

    def in_order(self) -> Float64Array:
        """Return all points from the first corner to the last."""
        order = np.lexsort((np.concatenate(self.places), np.concatenate(self.corners)))
        points: Float64Array = np.concatenate(self.points)[order]
        return points


def without_repeats(points: Float64Array, closed: bool) -> Float64Array:
    """Return a chain without points that lie on the one before."""
    if len(points) == 0:
        return points
    apart = np.r_[True, (np.abs(np.diff(points, axis=0)) > NEAR).any(axis=1)]
    kept = points[apart]
    if closed and len(kept) > 1 and (np.abs(kept[0] - kept[-1]) <= NEAR).all():
        kept = kept[:-1]
    return kept


def add_joins(
    sides: tuple[Side, Side], corners: Int64Array, points: Float64Array, before: Float64Array, after: Float64Array,
    radius: float, join: str, miter_limit: float,
) -> None:  # fmt: skip
    """Add to both sides what lies between the segments that meet at corners.

    Parameters
    ----------
    sides : the one to which directions are turned by `across`, and the other.
    corners : (N,) their numbers; points : (N, 2); before, after : (N, 2) directions of the segments.
    """
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    cosine = (before * after).sum(axis=1)
    goes_on = (turn == 0) & (cosine > 0)
    for side, sign, is_outer in ((sides[0], 1.0, turn < 0), (sides[1], -1.0, turn >= 0)):
        first, last = sign * across(before), sign * across(after)
        for place, rim, chosen in ((0, first, ~goes_on), (LAST, last, np.ones_like(goes_on))):
            side.add(points[chosen] + radius * rim[chosen], corners[chosen], place)
        inner, outer = ~is_outer & ~goes_on, is_outer & ~goes_on
        side.add(points[inner], corners[inner], 1)
        if join == "round":
            add_arcs(side, corners, points, np.stack([first, outward(first, last, before, after), last], axis=1), radius, outer)
        elif join == "miter":
            # The tip is as far away as 1 / cos(half the turn), in halves of the width.
            outer &= (1 + cosine) * miter_limit * miter_limit >= 2
            tips = (first[outer] + last[outer]) / (1 + cosine[outer])[:, None]
            side.add(points[outer] + radius * tips, corners[outer], 1)


def outward(first: Float64Array, last: Float64Array, before: Float64Array, after: Float64Array) -> Float64Array:
    """Return the directions half way round the outer side of corners, each from the pair that is further from opposite."""
    is_sharp = ((before * after).sum(axis=1) < 0)[:, None]
    middle = np.where(is_sharp, before - after, first + last)
    return unit(middle)


def add_arcs(
    side: Side, corners: Int64Array, points: Float64Array, rims: Float64Array, radius: float, chosen: BoolArray
) -> None:
    """Add the inner points of arcs round some corners."""
    found, owners, places = arcs(points[chosen], rims[chosen], radius)
    inner = places > 0
    side.add(found[inner], corners[chosen][owners[inner]], places[inner])


def add_cap(sides: tuple[Side, Side], corner: int, point: Float64Array, out: Float64Array, radius: float, cap: str) -> None:
    """Add the end of a chain to both sides; `out` is the direction in which it ends there.

    At the last corner the first side goes on to the second, at the first corner the second to the first.
    """
    number, rim = np.array([corner]), across(out[None])
    leaves, comes = sides if corner else sides[::-1]
    base = point[None] + (radius * out[None] if cap == "square" else 0.0)
    leaves.add(base + radius * rim, number, 0)
    comes.add(base - radius * rim, number, 0)
    if cap == "round":
        found, _, places = arcs(point[None], np.stack([rim, out[None], -rim], axis=1), radius)
        inner = slice(1, len(found) - 1)
        number = np.repeat(number, len(found) - 2)
        leaves.add(found[inner], number, places[inner] if corner else -places[inner])


def chain_rings(
    points: Float64Array, *, width: float, closed: bool, cap: str, join: str, miter_limit: float
) -> list[Float64Array]:
    """Return the rings of a polyline's stroke, (M, 2) each, to be filled by the non-zero rule.

    Parameters
    ----------
    points : (N, 2) in pixels; such as lie on the one before are left out.
    width : pixels.
    closed : whether its last point is joined to its first; there are two rings then.
    cap, join, miter_limit : as in SVG; a miter that is longer, in widths, is cut to a bevel.
    """
    chain = without_repeats(points, closed)
    if len(chain) < 2:
        dots = segment_shapes(np.repeat(chain[:, None], 2, axis=1), width, cap)
        return [dots.xy] if len(chain) and cap != "butt" else []
    ahead: Array = np.roll(chain, -1, axis=0) if closed else chain[1:]
    directions, radius = unit(ahead - chain[: len(ahead)]), width / 2
    sides = (Side(), Side())
    if closed:
        add_joins(sides, np.arange(len(chain)), chain, np.roll(directions, 1, axis=0), directions, radius, join, miter_limit)
        return [sides[0].in_order(), sides[1].in_order()[::-1]]
    add_joins(sides, np.arange(1, len(chain) - 1), chain[1:-1], directions[:-1], directions[1:], radius, join, miter_limit)
    add_cap(sides, 0, chain[0], -directions[0], radius, cap)
    add_cap(sides, len(chain) - 1, chain[-1], directions[-1], radius, cap)
    return [np.concatenate([sides[0].in_order(), sides[1].in_order()[::-1]])]
