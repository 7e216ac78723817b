"""How far a point reaches: a radius for each, from the distances to its neighbours, so that a surface of points closes.

Neighbours are looked for among the points before and after in Morton order. Some that are near lie far away in that order, so a
radius is a little larger at the borders of cells; that closes more and costs nothing. The price of the short window is that
points in thin rows, close along the row and far across, see their row alone, and gaps between rows can stay.
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.jit import kernel
from scanspan.records import Array, Float64Array, Int64Array, Integer

WINDOW = 12  # points before and after
NEIGHBOURS = 4  # the distance to the fourth is taken


@kernel
def neighbour_distances(lattice: Int64Array, scale: Float64Array, first: Integer, last: Integer, radius: Array) -> None:
    """Write the distance of each point to the fourth nearest of those near it in the order, to radius (N,).

    Points at the same place do not count. A point without neighbours has 0.
    """
    nearest = np.empty(NEIGHBOURS)
    for i in range(first, last):
        nearest[:] = np.inf
        for j in range(max(first, i - WINDOW), min(last, i + WINDOW + 1)):
            dx = (lattice[i, 0] - lattice[j, 0]) * scale[0]
            dy = (lattice[i, 1] - lattice[j, 1]) * scale[1]
            dz = (lattice[i, 2] - lattice[j, 2]) * scale[2]
            square = dx * dx + dy * dy + dz * dz
            if square > 0.0 and square < nearest[NEIGHBOURS - 1]:
                k = NEIGHBOURS - 1
                while k > 0 and nearest[k - 1] > square:
                    nearest[k] = nearest[k - 1]
                    k -= 1
                nearest[k] = square
        k = NEIGHBOURS - 1
        while k > 0 and nearest[k] == np.inf:
            k -= 1
        radius[i] = math.sqrt(nearest[k]) if nearest[k] < np.inf else 0.0
