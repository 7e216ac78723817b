"""Few points that stand for many where only their hull matters: what a camera must have in view, and bounds once transformed.

The box of a cloud is cut into cells; the corners of cells that hold a point are a hull around all points, larger by one cell at
most. Of the cells along a line in x only the first and the last can be at the hull, so that is all that is kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.arrays import own
from scanspan.assets.cloud import PointCloud
from scanspan.homogeneous import transform_points
from scanspan.records import Float64Array

CELLS = 128
"""Cells along each side of the box: a picture that fits the hull is smaller by less than a hundredth than it might be."""

FEW = 1 << 18
"""A cloud of this many points is used as it is."""

PART = 1 << 20


def outline(cloud: PointCloud) -> Float64Array:
    """Return points whose hull holds the cloud, (K, 3) float64: all of a small one, else at most 2^18 corners of cells.

    >>> outline(PointCloud([(0, 0, 0), (1, 0, 0)])).tolist()
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    """
    if len(cloud) <= FEW:
        return cloud.positions
    if "_outline" not in cloud.__dict__:
        cloud.__dict__["_outline"] = own(corners_of(cloud))
    known: Float64Array = cloud.__dict__["_outline"]
    return known


def corners_of(cloud: PointCloud) -> Float64Array:
    """Return the corners of cells at the hull; a cloud keeps them, as pictures of it are taken again and again."""
    low, high = cloud.bounds
    cell = np.maximum(high - low, 1e-300) / CELLS
    is_used = np.zeros(CELLS**3, bool)
    for part in parts_of(cloud):
        place = np.clip((part.positions - low) / cell, 0, CELLS - 1).astype(np.int32)
        is_used[(place[:, 2] * CELLS + place[:, 1]) * CELLS + place[:, 0]] = True

    # Take the first and the last cell of each line, and give them a little more than their size, for rounding.
    lines = is_used.reshape(-1, CELLS)
    ends = np.stack([lines.argmax(axis=1), CELLS - 1 - lines[:, ::-1].argmax(axis=1)], axis=1)[lines.any(axis=1)]
    z, y = np.divmod(np.flatnonzero(lines.any(axis=1)), CELLS)
    cells = np.stack([ends.reshape(-1), np.repeat(y, 2), np.repeat(z, 2)], axis=1)
    offsets = np.stack(np.meshgrid(*[(-1e-6, 1 + 1e-6)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = low + (cells[:, None] + offsets).reshape(-1, 3) * cell
    clipped: Float64Array = np.unique(np.clip(corners, low, high), axis=0)
    return clipped


def bounds_in(cloud: PointCloud, transform: NDArray[np.float64]) -> Float64Array:
    """Return the lowest and the highest x, y, z of a transformed cloud, (2, 3); some points at a time."""
    boxes = []
    for part in parts_of(cloud):
        places = transform_points(transform, part.positions)[:, :3]
        boxes.append((places.min(axis=0), places.max(axis=0)))
    if not boxes:
        return np.full((2, 3), np.nan)
    return np.stack([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def parts_of(cloud: PointCloud) -> list[PointCloud]:
    """Return a cloud in parts of a million points, which share its memory; none for an empty one."""
    return [cloud.take(slice(first, first + PART)) for first in range(0, len(cloud), PART)]
