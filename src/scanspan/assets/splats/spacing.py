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
def leaf_radii(lattice: Int64Array, scale: Float64Array, starts: Int64Array, leaves: Integer, radius: Array) -> None:
    """Write the radius of each point, from its neighbours in its leaf, to radius (N,).

    Units       starts: as cut_ranges writes them.
    """
    for leaf in range(leaves):
        neighbour_distances(lattice, scale, starts[leaf, 0], starts[leaf + 1, 0], radius)


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


@kernel
def leaf_normals(lattice: Int64Array, scale: Float64Array, starts: Int64Array, leaves: Integer, normals: Array) -> None:
    """Write unit normals (N, 3) of points, each the direction in which the points near it in its leaf spread least.

    Which side is out cannot be known: z is not below 0. A point with fewer than two others has (0, 0, 0).
    """
    moments = np.empty((3, 3))
    for leaf in range(leaves):
        first, last = starts[leaf, 0], starts[leaf + 1, 0]
        for i in range(first, last):
            begin, end = max(first, i - WINDOW), min(last, i + WINDOW + 1)
            fill_moments(lattice, scale, begin, end, i, moments)
            least_axis(moments, normals, i)


@kernel
def fill_moments(
    lattice: Int64Array, scale: Float64Array, first: Integer, last: Integer, i: Integer, moments: Float64Array
) -> None:
    """Write how points spread about their mean: the sums of products of their differences, (3, 3).

    Units       i: the point from which differences are taken, so that nothing is lost far from the origin.
    """
    x, y, z, xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(first, last):
        dx = (lattice[j, 0] - lattice[i, 0]) * scale[0]
        dy = (lattice[j, 1] - lattice[i, 1]) * scale[1]
        dz = (lattice[j, 2] - lattice[i, 2]) * scale[2]
        x += dx
        y += dy
        z += dz
        xx += dx * dx
        xy += dx * dy
        xz += dx * dz
        yy += dy * dy
        yz += dy * dz
        zz += dz * dz
    share = 1.0 / (last - first)
    moments[0, 0], moments[1, 1], moments[2, 2] = xx - x * x * share, yy - y * y * share, zz - z * z * share
    moments[0, 1], moments[0, 2], moments[1, 2] = xy - x * y * share, xz - x * z * share, yz - y * z * share


@kernel
def least_axis(moments: Float64Array, normals: Array, i: Integer) -> None:
    """Write the direction of the smallest spread: by rotations that clear one product after the other (Jacobi)."""
    v = np.eye(3)
    a = moments
    for _ in range(6):
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                theta = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                r = 3 - p - q
                other_p, other_q = a[min(p, r), max(p, r)], a[min(q, r), max(q, r)]
                a[p, p] -= t * a[p, q]
                a[q, q] += t * a[p, q]
                a[p, q] = 0.0
                a[min(p, r), max(p, r)] = c * other_p - s * other_q
                a[min(q, r), max(q, r)] = s * other_p + c * other_q
                for k in range(3):
                    v[k, p], v[k, q] = c * v[k, p] - s * v[k, q], s * v[k, p] + c * v[k, q]
    axis = 0
    for k in range(1, 3):
        if a[k, k] < a[axis, axis]:
            axis = k
    middle = a[0, 0] + a[1, 1] + a[2, 2] - a[axis, axis] - max(a[0, 0], a[1, 1], a[2, 2])

    # Points on a line or at one place spread nowhere else, and have no normal.
    sign = -1.0 if v[2, axis] < 0.0 else 1.0
    if not middle > 1e-12 * max(a[0, 0], a[1, 1], a[2, 2]):
        sign = 0.0
    for k in range(3):
        normals[i, k] = sign * v[k, axis]
