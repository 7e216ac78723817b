"""How far a point reaches: a radius for each, from the distances to its neighbours, so that a surface of points closes.

The radius is the distance to the third nearest of the points up to eight places before and after it in its leaf, in Morton
order; but no more than twice the mean of the leaf, so that a lone point is no blot. Of random points on a plane that leaves
holes in 0.3 % of it, where the mean radius is 1.1 times the spacing. Some points that are near lie far away in that order, so
radii are larger at the borders of cells; that closes more and costs nothing. Leaves alone decide, so that the radius does not
depend on how much fits in memory. The price: in rows whose points are close along the row and more than some four times as far
across, a point sees its row alone, and gaps between rows stay.
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.assets.splats.codec import BLOCK
from scanspan.jit import kernel
from scanspan.records import Array, Float64Array, Int64Array, Integer

REACH = 8  # points before and after
LARGEST = 2.0  # times the mean of a leaf


@kernel
def leaf_radii(lattice: Int64Array, scale: Float64Array, starts: Int64Array, leaves: Integer, radius: Array) -> None:
    """Write the radius of each point, from its neighbours in its leaf, to radius (N,).

    Points at the same place are no neighbours. A point with none has 0.

    Units       starts: as cut_ranges writes them.
    """
    far, none = np.inf, 0.0
    x, y, z, squares = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    first, second, third = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for leaf in range(leaves):
        begin = starts[leaf, 0]
        count = starts[leaf + 1, 0] - begin
        for i in range(count):
            x[i] = (lattice[begin + i, 0] - lattice[begin, 0]) * scale[0]
            y[i] = (lattice[begin + i, 1] - lattice[begin, 1]) * scale[1]
            z[i] = (lattice[begin + i, 2] - lattice[begin, 2]) * scale[2]
            first[i], second[i], third[i] = far, far, far

        # Take all pairs that are equally far apart in the order at once, and keep the three smallest distances of each point.
        for apart in range(1, min(REACH, count - 1) + 1):
            for i in range(count - apart):
                dx, dy, dz = x[i + apart] - x[i], y[i + apart] - y[i], z[i + apart] - z[i]
                square = dx * dx + dy * dy + dz * dz
                squares[i] = square if square > none else far
            for side in range(2):
                shift = apart * side
                for i in range(count - apart):
                    a = squares[i]
                    low = min(first[i + shift], a)
                    a = max(first[i + shift], a)
                    first[i + shift] = low
                    low = min(second[i + shift], a)
                    a = max(second[i + shift], a)
                    second[i + shift] = low
                    third[i + shift] = min(third[i + shift], a)

        # Points with fewer neighbours take the furthest that they have.
        total = 0.0
        for i in range(count):
            square = third[i] if third[i] < far else second[i] if second[i] < far else first[i] if first[i] < far else none
            radius[begin + i] = math.sqrt(square)
            total += radius[begin + i]
        largest = LARGEST * total / count
        for i in range(count):
            radius[begin + i] = min(radius[begin + i], largest)


@kernel
def leaf_normals(lattice: Int64Array, scale: Float64Array, starts: Int64Array, leaves: Integer, normals: Array) -> None:
    """Write unit normals (N, 3) of points, each the direction in which the points near it in its leaf spread least.

    Which side is out cannot be known: z is not below 0. A point with fewer than two others has (0, 0, 0).
    """
    moments = np.empty((3, 3))
    for leaf in range(leaves):
        first, last = starts[leaf, 0], starts[leaf + 1, 0]
        for i in range(first, last):
            begin, end = max(first, i - REACH), min(last, i + REACH + 1)
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
    tiny = 1e-30 * (a[0, 0] + a[1, 1] + a[2, 2])
    for _ in range(6):
        for p in range(2):
            for q in range(p + 1, 3):
                if not abs(a[p, q]) > tiny:
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
