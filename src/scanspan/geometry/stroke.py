"""Strokes: the outlines of lines that have a width, with caps at their ends and joins at their corners.

Each segment is a rectangle, each join and each cap a piece that is put to it; a stroke is all that one of them covers. The
outline runs along one side and back along the other. On the outer side of a corner it goes over the join. On the inner side it
goes through the corner itself, so that the rectangles stay whole: the outline is then the sum of all pieces, which all wind the
same way round, and the non-zero rule fills exactly their union, however the line crosses itself.

Round parts are chords of circles that no point is further from than 1/64 pixel. Their points come from square roots and
divisions alone, which every processor rounds alike.

Names and defaults are SVG's: stroke-linecap, stroke-linejoin, stroke-miterlimit.

Source: SVG 2, section 13.5, the shape of a stroke.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from scanspan.records import Float64Array, Int64Array

CAPS = ("butt", "round", "square")
JOINS = ("miter", "round", "bevel")
CHORD = 1 / 64  # pixels between a round part and its chord
NEAR = 2.0**-60  # pixels; points that are nearer are one
SQUARE = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])


class Shapes(NamedTuple):
    """Outlines of S shapes, to be filled by the non-zero rule; a simple one is counter-clockwise as seen."""

    xy: Float64Array  # (V, 2) pixels
    ring_starts: Int64Array  # (R + 1,) rows of xy
    shape_rings: Int64Array  # (S + 1,) rings


@lru_cache(maxsize=16)
def circle(radius: float) -> Float64Array:
    """Return points on the unit circle, (M, 2), so many that for a radius in pixels no side is further inside than 1/50 pixel.

    They are ((1 - t^2) / (1 + t^2), 2 t / (1 + t^2)), a quarter at a time, which every processor rounds alike; a sine is not.
    Not to be changed.
    """
    quarter = max(4, int(np.ceil(np.sqrt(radius) * 5.2)))
    t = np.arange(quarter) / quarter
    x, y = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
    return np.concatenate([np.stack(side, axis=1) for side in ((x, y), (-y, x), (-x, -y), (y, -x))])


@lru_cache(maxsize=16)
def fan(radius: float, shape: str) -> Float64Array:
    """Return a square or a disc about (0, 0) as triangles, (T, 3, 2), not to be changed; radius is half of its extent."""
    rim = radius * (SQUARE[::-1] if shape == "square" else circle(radius))
    count = len(rim)
    corners = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    triangles: Float64Array = rim[corners]
    return triangles


def unit(vectors: Float64Array) -> Float64Array:
    """Return vectors, (N, 2), at length 1."""
    x, y = vectors[:, 0], vectors[:, 1]
    return vectors / np.sqrt(x * x + y * y)[:, None]


def across(directions: Float64Array) -> Float64Array:
    """Return directions, (N, 2), turned by a right angle from x to y."""
    return np.stack([-directions[:, 1], directions[:, 0]], axis=1)


def as_shapes(rings: Float64Array) -> Shapes:
    """Return rings of equally many points, (N, M, 2), as a shape each."""
    count, size = rings.shape[:2]
    return Shapes(rings.reshape(-1, 2), np.arange(count + 1, dtype=np.int64) * size, np.arange(count + 1, dtype=np.int64))


def point_shapes(centres: Float64Array, size: float, shape: str) -> Shapes:
    """Return squares or discs round centres, (N, 2)."""
    rim = SQUARE if shape == "square" else circle(size / 2)[::-1]
    return as_shapes(centres[:, None] + size / 2 * rim)


def segment_shapes(ends: Float64Array, width: float, cap: str, vectors: Float64Array | None = None) -> Shapes:
    """Return the strokes of segments, (N, 2, 2), each a shape of its own, or along vectors, (N, 2), where these are given.

    One without a length has no area with "butt", is a disc with "round", and with "square" a square, along x if along nothing.
    """
    start, end = ends[:, 0], ends[:, 1]
    along = end - start
    dots = (np.abs(along) <= NEAR).all(axis=1)
    along = along if vectors is None else vectors.copy()
    along[(np.abs(along) <= NEAR).all(axis=1)] = (1.0, 0.0)
    along = unit(along) * (width / 2)
    aside = across(along)
    if cap == "round":
        rim = circle(width / 2)
        half = len(rim) // 2
        x, y = rim[(half // 2 - np.arange(2 * half + 1)) % (2 * half)].T[:, :, None, None]
        turned = x * along + y * aside
        return as_shapes(np.concatenate([end + turned[: half + 1], start + turned[half:]]).transpose(1, 0, 2))
    if cap == "square":
        start, end = start - along, end + along
    else:
        aside[dots] = 0.0
    return as_shapes(np.stack([end + aside, end - aside, start - aside, start + aside], axis=1))


def arc_depth(cosine: Float64Array, radius: float) -> Int64Array:
    """Return how often arcs must be halved so that chords stay near; from the cosine of the angle that each goes through."""
    half = np.sqrt(np.maximum(1 + cosine, 0.0) / 2)
    depth = np.zeros(len(half), np.int64)
    while (far := radius * (1 - half) > CHORD).any():
        depth += far
        half = np.where(far, np.sqrt((1 + half) / 2), half)
    return depth


def arcs(centres: Float64Array, rims: Float64Array, radius: float) -> tuple[Float64Array, Int64Array, Int64Array]:
    """Return the points of arcs, ends included, (K, 2), the arc of each, (K,), and its place along it, (K,).

    Parameters
    ----------
    centres : (N, 2).
    rims : (N, 3, 2) directions to the first point, to the middle and to the last one.
    radius : pixels.
    """
    cosine = (rims[:, 0] * rims[:, 2]).sum(axis=1)
    depths, points, owners, places = np.maximum(arc_depth(cosine, radius), 1), [np.empty((0, 2))], [], []
    for depth in np.unique(depths):
        chosen = np.flatnonzero(depths == depth)
        directions = rims[chosen]
        for _ in range(depth - 1):
            sums = directions[:, :-1] + directions[:, 1:]
            finer = np.empty((len(chosen), 2 * directions.shape[1] - 1, 2))
            finer[:, ::2], finer[:, 1::2] = directions, unit(sums.reshape(-1, 2)).reshape(sums.shape)
            directions = finer
        count = directions.shape[1]
        points.append((centres[chosen, None] + radius * directions).reshape(-1, 2))
        owners.append(np.repeat(chosen, count))
        places.append(np.tile(np.arange(count), len(chosen)))
    none = [np.empty(0, np.int64)]
    return np.concatenate(points), np.concatenate(none + owners), np.concatenate(none + places)
