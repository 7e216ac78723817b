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
RUN = 256  # points of which none reaches farther than
LONGEST = 2.0  # times the median: what stands alone, or at the end of a fold of the curve, is not made larger


@kernel
def neighbour_distances(lattice: Int64Array, scale: Float64Array, first: Integer, last: Integer, radius: Array) -> None:
    """Write the distance of each point to the fourth nearest of those near it in the order, to radius (N,).

    Points at the same place do not count. A point without neighbours has 0. Within a run of points, none has more than a multiple
    of their median.
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
    for start in range(first, last, RUN):
        end = min(start + RUN, last)
        most = LONGEST * median_of(radius, start, end)
        for i in range(start, end):
            radius[i] = min(radius[i], most)


@kernel
def median_of(values: Array, first: Integer, last: Integer) -> float:
    """Return a number that about half of a range of values above 0 are no more than, to within 1 %."""
    low, high, count = 0.0, 0.0, 0
    for i in range(first, last):
        high = max(high, values[i])
        count += 1 if values[i] > 0.0 else 0
    for _ in range(40):
        if high - low <= 0.01 * high:
            break
        middle, below = 0.5 * (low + high), 0
        for i in range(first, last):
            below += 1 if (values[i] > 0.0) & (values[i] <= middle) else 0
        if 2 * below >= count:
            high = middle
        else:
            low = middle
    return high
