"""Envelope: a few points whose hull holds all of a cloud, for fitting a camera to it.

The box of the cloud is divided into small boxes; the corners of those with a point in them stand for the points. They reach
farther by at most a box, which is one in CELLS of the cloud. A fit to millions of points takes seconds, this milliseconds.
"""

from __future__ import annotations

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.jit import kernel
from scanspan.records import Array, BoolArray, Float64Array

CELLS = 96  # boxes along each side
FEW = 1 << 17  # points, up to which all are taken


@kernel
def mark_cells(positions: Array, low: Float64Array, per_unit: Float64Array, marked: BoolArray) -> None:
    """Mark the boxes in which points lie.

    Shapes  positions: (N, 3); low, per_unit: (3,), boxes in a stored unit; marked: (n, n, n), written.
    """
    last = np.int64(marked.shape[0] - 1)
    for row in range(positions.shape[0]):
        x = min(np.int64((np.float64(positions[row, 0]) - low[0]) * per_unit[0]), last)
        y = min(np.int64((np.float64(positions[row, 1]) - low[1]) * per_unit[1]), last)
        z = min(np.int64((np.float64(positions[row, 2]) - low[2]) * per_unit[2]), last)
        marked[x, y, z] = True


def find_envelope(cloud: PointCloud) -> Float64Array:
    """Return points whose hull holds a cloud, (K, 3) float64; all of it if it is small.

    >>> find_envelope(PointCloud([(0, 0, 0), (1, 2, 3)])).tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]
    """
    if len(cloud) <= FEW:
        return cloud.positions
    columns = [cloud.stored[:, k] for k in range(3)]  # one by one is far quicker than along the rows
    low, high = np.array([[end(column) for column in columns] for end in (np.min, np.max)], np.float64)
    side = np.where(high > low, (high / CELLS - low / CELLS), 1.0)
    marked = np.zeros((CELLS, CELLS, CELLS), bool)
    mark_cells(cloud.stored, low, 1.0 / side, marked)

    # A corner counts if any of the eight boxes at it is marked.
    at = np.zeros((CELLS + 1, CELLS + 1, CELLS + 1), bool)
    for x, y, z in np.ndindex(2, 2, 2):
        at[x : CELLS + x, y : CELLS + y, z : CELLS + z] |= marked
    steps = np.argwhere(at)
    corners: Float64Array = np.where(steps == CELLS, high, low + steps * side) * cloud.scale + cloud.offset
    return corners
