"""Clipping planes: faces, lines and points of a shape are cut when the scene is made.

A plane cuts what comes after it, as far as its separator reaches. Faces are cut corner by corner round their edges, all at
once; a point where an edge is cut is computed from the end that is kept, so that neighbours get the same one and no crack
opens. The cut is left open: what was solid can be looked into, as in Inventor.

Source: Sutherland and Hodgman 1974; the reference page of ClipPlane of Inventor 2.1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.state import State
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray, planes_before, transform_planes

MAX_PLANES = 32
"""Planes in force at once; OpenGL promised 6."""

Indices = NDArray[np.int64]


class Faces(NamedTuple):
    """Faces by their corners: (C,) rows of points, (F,) corners of each, and values (C, k) at the corners or None."""

    points: FloatArray
    vertex: Indices
    counts: Indices
    values: tuple[FloatArray | None, ...]


def use_plane(state: State, node: Node) -> None:
    """Put a ClipPlane in force, as a plane (a, b, c, d) of the world: a x + b y + c z + d is not below 0 where it is seen."""
    if not node.get("on"):
        return
    if len(state.clip_planes) == MAX_PLANES:
        node.note(f"more than {MAX_PLANES} clipping planes are in force; the others are left out")
        return
    x, y, z, distance = node.get("plane").tolist()
    try:
        plane = transform_planes(state.transform, (x, y, z, -distance))
    except InputError as error:
        node.note(f"ClipPlane is left out: {error}")
        return
    if plane[:3].any():
        state.clip_planes = (*state.clip_planes, plane)


def planes_of(state: State) -> list[FloatArray]:
    """Return the planes in force as those of the shape's own coordinates."""
    return [planes_before(state.transform, plane) for plane in state.clip_planes]


def _height(points: FloatArray, plane: FloatArray) -> FloatArray:
    """Return how far points lie on the side that is seen, times the length of the plane's normal."""
    return np.asarray(points[:, 0] * plane[0] + points[:, 1] * plane[1] + points[:, 2] * plane[2] + plane[3])


def _cut(kept: FloatArray, lost: FloatArray, share: FloatArray) -> FloatArray:
    """Return what lies a share of the way from what is kept to what is lost."""
    return np.asarray(kept + (lost - kept) * share[:, None])


def clip_faces(faces: Faces, plane: FloatArray) -> Faces:
    """Return what a plane leaves of faces."""
    points, vertex, counts, values = faces
    start = np.repeat(np.cumsum(counts) - counts, counts)
    place = np.arange(len(vertex))
    after = start + (place - start + 1) % np.repeat(counts, counts)
    height = _height(points, plane)[vertex]
    inside = height >= 0.0
    if inside.all():
        return faces

    # Find the edges that are cut, and where, from the end that is kept.
    cut = np.flatnonzero(inside != inside[after])
    kept = np.where(inside[cut], cut, after[cut])
    lost = np.where(inside[cut], after[cut], cut)
    share = height[kept] / (height[kept] - height[lost])
    crossings, number = np.unique(_cut(points[vertex[kept]], points[vertex[lost]], share), axis=0, return_inverse=True)

    # Go round each face: a corner that is kept, then the point where the edge to the next one is cut.
    source = np.concatenate([np.flatnonzero(inside), cut])
    order = np.argsort(np.concatenate([2 * np.flatnonzero(inside), 2 * cut + 1]), kind="stable")
    face = np.repeat(np.arange(len(counts)), counts)
    remaining = np.bincount(face[source], minlength=len(counts))
    corner = np.concatenate([vertex[inside], len(points) + number.reshape(-1)])[order]
    found = tuple(
        None if one is None else np.concatenate([one[inside], _cut(one[kept], one[lost], share)])[order] for one in values
    )
    enough = np.repeat(remaining >= 3, remaining)
    return Faces(
        np.concatenate([points, crossings]),
        corner[enough],
        remaining[remaining >= 3],
        tuple(None if one is None else one[enough] for one in found),
    )


def clip_lines(ends: FloatArray, colors: FloatArray | None, plane: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """Return what a plane leaves of segments, by their ends (2 S, 3) with the colours of these."""
    inside = (_height(ends, plane) >= 0.0).reshape(-1, 2)
    keep = np.repeat(inside.any(axis=1), 2)
    ends, colors = ends[keep], None if colors is None else colors[keep]
    height = _height(ends, plane)
    lost = np.flatnonzero(height < 0.0)
    kept = lost ^ 1
    share = height[kept] / (height[kept] - height[lost])
    cut = ends.copy()
    cut[lost] = _cut(ends[kept], ends[lost], share)
    if colors is not None:
        colors = colors.copy()
        colors[lost] = _cut(colors[kept], colors[lost], share)
    return cut, colors


def clip_points(points: FloatArray, colors: FloatArray | None, plane: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """Return the points that a plane leaves, with their colours."""
    inside = _height(points, plane) >= 0.0
    return points[inside], None if colors is None else colors[inside]
