"""Faces to triangles: the polygons of a mesh, all at once, with the bookkeeping that lets them be whole again.

Each polygon is projected along the largest axis of its Newell normal, which drops a coordinate and so rounds nothing, and is
cut there. Triangles pass through; quadrilaterals are cut with one vectorised rule; larger convex polygons become fans; only
what is left is clipped ear by ear. Quadrilaterals are cut from the first corner to the third, as a fan would, unless the second
or fourth corner is reflex or straight while the first and third are convex: then the other diagonal is the one inside.

Source: Newell's normal as in Sutherland, Sproull and Schumacker 1974; the vectorised cuts are our own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scanspan.triangulation import is_convex, orientations, triangulate_polygon

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

OTHER_AXES = np.array([[1, 2], [2, 0], [0, 1]])
"""The two axes kept when axis 0, 1 or 2 is dropped, in the order that keeps the turn of a normal along +axis."""


@dataclass(frozen=True)
class CutFaces:
    """Triangles made from polygons, in the order of the polygons.

    Attributes
    ----------
    corner : (T, 3) int64, for each corner of each triangle its position in the flat list of polygon corners.
    source : (T,) int32, the polygon of each triangle, non-decreasing.
    inner : (T,) uint8, bit i set: the edge opposite corner i is a diagonal.
    """

    corner: IntArray
    source: NDArray[np.int32]
    inner: NDArray[np.uint8]


def cut_faces(positions: FloatArray, indices: IntArray, counts: IntArray) -> CutFaces:
    """Cut polygons into triangles.

    Parameters
    ----------
    positions : (V, 3) float64. Polygons with a corner that is not finite are cut as a fan.
    indices : (sum of counts,) int64, the vertices of all polygons one after the other, in range.
    counts : (F,) int64, corners of each polygon; fewer than three give no triangle.
    """
    start = np.cumsum(counts) - counts
    pieces: list[IntArray] = []
    owners: list[IntArray] = []
    for count in np.unique(counts[counts >= 3]).tolist():
        faces = np.flatnonzero(counts == count)
        flat = start[faces, None] + np.arange(count)
        if count == 3:
            pieces.append(flat)
            owners.append(faces)
            continue

        # Cut all polygons of this size in their own numbering, then go back to the flat list.
        local, owner = _cut_equal(_project(positions[indices[flat]]))
        pieces.append(np.take_along_axis(flat[owner], local, axis=1))
        owners.append(faces[owner])

    if not pieces:
        return CutFaces(np.empty((0, 3), np.int64), np.empty(0, np.int32), np.empty(0, np.uint8))
    corner, source = np.concatenate(pieces), np.concatenate(owners)
    if len(pieces) > 1:
        order = np.argsort(source, kind="stable")
        corner, source = corner[order], source[order]
    return CutFaces(corner, source.astype(np.int32), _diagonals(corner, start[source], counts[source]))


def _project(corners: FloatArray) -> FloatArray:
    """Return N polygons (N, M, 3) in the plane, (N, M, 2), seen so that most of them turn left."""
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.max(np.abs(corners), axis=(1, 2), keepdims=True)
        shape = (corners - corners[:, :1]) / np.where((scale > 0) & np.isfinite(scale), scale, 1.0)
        after = np.roll(shape, -1, axis=1)
        normal = np.sum(np.cross(shape, after), axis=1)
    normal[~np.isfinite(normal).all(axis=1)] = 0.0

    # Drop the largest axis; swap the other two where the normal points the other way.
    axis = np.argmax(np.abs(normal), axis=1)
    axes = OTHER_AXES[axis]
    backward = normal[np.arange(len(axis)), axis] < 0
    axes[backward] = axes[backward][:, ::-1]
    return np.take_along_axis(corners, axes[:, None, :], axis=2)


def _cut_equal(flat: FloatArray) -> tuple[IntArray, IntArray]:
    """Cut N polygons of M > 3 corners, (N, M, 2); return corners (T, 3) within each polygon, and the polygon of each."""
    count = flat.shape[1]
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(flat).all(axis=(1, 2)))
    if count == 4:
        return _cut_quadrilaterals(np.where(finite[:, None, None], flat, 0.0))
    fan = np.stack([np.zeros(count - 2, np.int64), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    whole = np.ones(len(flat), dtype=bool)
    whole[finite] = is_convex(flat[finite])

    # Give convex polygons a fan each and clip the ears of the others.
    owner = np.flatnonzero(whole)
    local = np.tile(fan, (len(owner), 1))
    owner = np.repeat(owner, count - 2)
    others = np.flatnonzero(~whole)
    if len(others):
        cuts = [triangulate_polygon(flat[i]) for i in others.tolist()]
        local = np.concatenate([local, *cuts])
        owner = np.concatenate([owner, np.repeat(others, [len(cut) for cut in cuts])])
        order = np.argsort(owner, kind="stable")
        local, owner = local[order], owner[order]
    return local, owner


def _cut_quadrilaterals(flat: FloatArray) -> tuple[IntArray, IntArray]:
    """Cut N quadrilaterals, (N, 4, 2), in two triangles each."""
    turns = orientations(np.roll(flat, 1, axis=1), flat, np.roll(flat, -1, axis=1))
    convex = turns > 0
    other = convex[:, 0] & convex[:, 2] & ~(convex[:, 1] & convex[:, 3])
    local = np.empty((len(flat), 2, 3), dtype=np.int64)
    local[:] = [[0, 1, 2], [0, 2, 3]]
    local[other] = [[0, 1, 3], [1, 2, 3]]
    return local.reshape(-1, 3), np.repeat(np.arange(len(flat)), 2)


def _diagonals(corner: IntArray, start: IntArray, counts: IntArray) -> NDArray[np.uint8]:
    """Return the bits of the edges that join corners which are not neighbours in their polygon; edge i is opposite corner i."""
    place = corner - start[:, None]
    inner = np.zeros(len(corner), dtype=np.uint8)
    for i in range(3):
        gap = np.abs(place[:, (i + 1) % 3] - place[:, (i + 2) % 3])
        inner |= ((gap != 1) & (gap != counts - 1)).astype(np.uint8) << np.uint8(i)
    return inner
