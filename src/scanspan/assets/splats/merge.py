"""Groups of about four splats, and the splat that stands for each: averages, a radius that covers them, a cone of normals.

A group is a range of the Morton order, cut where the highest bit differs, so its members share a cell, and cut further where
they lie much farther apart than they reach: one splat that covers both ends of a gap would cover the gap too. Where that leaves
more than half as many groups as splats, and a few more, one that would stand alone joins its nearer neighbour in the tree.

The average of colours is that of light, not of codes. The sphere of a parent holds the spheres of its children as they are
decoded, so it holds everything below, and no hole opens when it is drawn in their place. The price: spheres around spheres are
a little larger than need be. Cones grow by the sum of angles, with sines and cosines only, so no library's sine is called.

Source: S. Rusinkiewicz and M. Levoy, QSplat (2000).
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.jit import kernel
from scanspan.records import Float64Array, Int64Array, Integer

# Columns of a splat while a tree is built. Places in steps of the lattice, radii in the world, linear light, unit normal
# (zeros: none), the cosine of the half angle of the cone of normals (below 0: no cone), and the level at which the next parts.
X, Y, Z, RADIUS, RED, GREEN, BLUE, NORMAL_X, NORMAL_Y, NORMAL_Z, COSINE, LEVEL = range(12)
COLUMNS = 12
NO_CONE = -1.0

GROUP = 6  # splats that are not cut further; groups have about four on average
FEW, SPARE = 64, 4  # among so few splats, so many groups more than half as many are allowed
LOOSE = 4.0  # times the mean radius and the root of their number, beyond which the diagonal of some splats is much
FULL_GROUP = 8  # splats of a group that takes in no more of those that stand alone
SLACK = 1.0 + 1e-9  # by which radii and distances are larger, so that rounding uncovers nothing


@kernel
def highest_cut(splats: Float64Array, first: Integer, last: Integer) -> int:
    """Return where a range is cut: after the splat whose level is highest, among equals the one nearest to the middle."""
    best, best_level, best_distance = first + 1, -np.inf, np.inf
    for i in range(first, last - 1):
        level = splats[i, LEVEL]
        if level >= best_level:
            distance = abs(2.0 * i + 2.0 - first - last)
            if level > best_level or distance < best_distance:
                best, best_level, best_distance = i + 1, level, distance
    return int(best)


@kernel
def is_loose(splats: Float64Array, first: Integer, last: Integer, scale: Float64Array) -> bool:
    """Say whether some splats lie much farther apart than they reach, so that one in their place would hide what is between."""
    reach, square = 0.0, 0.0
    for i in range(first, last):
        reach += splats[i, RADIUS]
    for axis in range(X, Z + 1):
        low, high = splats[first, axis], splats[first, axis]
        for i in range(first + 1, last):
            low, high = min(low, splats[i, axis]), max(high, splats[i, axis])
        square += ((high - low) * scale[axis]) ** 2
    return square * (last - first) > (LOOSE * reach) ** 2


@kernel
def group_splats(splats: Float64Array, count: Integer, scale: Float64Array, starts: Int64Array, ends: Int64Array) -> int:
    """Cut splats into groups; return how many: no more than half as many as there are splats, and a few.

    Writes      starts (K + 1,): the first splat of each group, and `count`.
    Units       splats: rows as above, in Morton order; starts and ends have room for count + 1, the second to work in.
    """
    groups = cut_groups(splats, count, scale, starts, ends, True)
    spare = SPARE if count <= FEW else 0
    return (
        groups
        if groups <= count // 2 + spare
        else join_lone(splats, count, starts, cut_groups(splats, count, scale, starts, ends, False))
    )


@kernel
def cut_groups(
    splats: Float64Array, count: Integer, scale: Float64Array, starts: Int64Array, ends: Int64Array, splits_loose: bool
) -> int:
    """Cut splats where their highest bit differs while a part is too large, or loose."""
    # Cut the first part; the ends of the others wait, the nearest on top.
    ends[0] = count
    top, first, groups = 0, 0, 0
    while top >= 0:
        size = ends[top] - first
        if size > GROUP or (size > 1 and splits_loose and is_loose(splats, first, ends[top], scale)):
            ends[top + 1] = highest_cut(splats, first, ends[top])
            top += 1
            continue
        starts[groups] = first
        groups += 1
        first = ends[top]
        top -= 1
    starts[groups] = count
    return groups


@kernel
def join_lone(splats: Float64Array, count: Integer, starts: Int64Array, groups: Integer) -> int:
    """Let a splat that stands alone join the part before it, if that is nearer in the tree and not full, or else the next."""
    joined = 0
    k = 0
    while k < groups:
        first = starts[k]
        last = starts[k + 1] if k + 1 < groups else count
        if last - first > 1 or groups == 1:
            starts[joined] = first
            joined += 1
            k += 1
            continue
        has_next = k + 1 < groups
        has_room = joined > 0 and first - starts[joined - 1] < FULL_GROUP
        if (has_room and (not has_next or splats[first - 1, LEVEL] <= splats[first, LEVEL])) or (joined > 0 and not has_next):
            k += 1
            continue
        starts[joined] = first
        joined += 1
        k += 2
    starts[joined] = count
    return joined


@kernel
def covering_radius(splats: Float64Array, first: Integer, last: Integer, scale: Float64Array) -> float:
    """Return the radius of a ball around the mean of some splats that holds their balls."""
    x, y, z = 0.0, 0.0, 0.0
    for i in range(first, last):
        x += splats[i, X]
        y += splats[i, Y]
        z += splats[i, Z]
    share = 1.0 / (last - first)
    radius = 0.0
    for i in range(first, last):
        dx = (splats[i, X] - x * share) * scale[0]
        dy = (splats[i, Y] - y * share) * scale[1]
        dz = (splats[i, Z] - z * share) * scale[2]
        radius = max(radius, math.sqrt(dx * dx + dy * dy + dz * dz) + splats[i, RADIUS])
    return radius


@kernel
def merge_splats(
    splats: Float64Array, first: Integer, last: Integer, scale: Float64Array, parents: Float64Array, k: Integer
) -> None:
    """Write the splat that stands for some others to a row of `parents`.

    Units       scale (3,): a step of the lattice in the world.
    """
    share = 1.0 / (last - first)
    x, y, z, red, green, blue, nx, ny, nz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(first, last):
        x += splats[i, X]
        y += splats[i, Y]
        z += splats[i, Z]
        red += splats[i, RED]
        green += splats[i, GREEN]
        blue += splats[i, BLUE]
        nx += splats[i, NORMAL_X]
        ny += splats[i, NORMAL_Y]
        nz += splats[i, NORMAL_Z]
    parents[k, X], parents[k, Y], parents[k, Z] = x * share, y * share, z * share
    parents[k, RED], parents[k, GREEN], parents[k, BLUE] = red * share, green * share, blue * share
    parents[k, RADIUS] = covering_radius(splats, first, last, scale) * SLACK
    parents[k, LEVEL] = splats[last - 1, LEVEL]

    # Turn the cone until it holds the cones below; opposite normals have no mean, so the first one stands for them.
    length = math.sqrt(nx * nx + ny * ny + nz * nz) * share
    parents[k, COSINE] = NO_CONE
    if length < 1e-6:
        for column in (NORMAL_X, NORMAL_Y, NORMAL_Z):
            parents[k, column] = splats[first, column]
        return
    share /= length
    parents[k, NORMAL_X], parents[k, NORMAL_Y], parents[k, NORMAL_Z] = nx * share, ny * share, nz * share
    parents[k, COSINE] = cone_cosine(splats, first, last, parents[k, NORMAL_X], parents[k, NORMAL_Y], parents[k, NORMAL_Z])


@kernel
def cone_cosine(splats: Float64Array, first: Integer, last: Integer, nx: float, ny: float, nz: float) -> float:
    """Return the cosine of the half angle of the cone around a unit normal that holds the cones of some splats.

    A cone of a right angle or more is NO_CONE: nothing can be known to face away.
    """
    least = 1.0
    for i in range(first, last):
        cone = splats[i, COSINE]
        if cone <= 0.0:
            return NO_CONE
        along = splats[i, NORMAL_X] * nx + splats[i, NORMAL_Y] * ny + splats[i, NORMAL_Z] * nz
        if along <= 0.0:
            return NO_CONE
        along = min(along, 1.0)

        # The cosine of a sum of angles, each of which is below a right angle.
        sine = math.sqrt(max(1.0 - along * along, 0.0)) * math.sqrt(max(1.0 - cone * cone, 0.0))
        least = min(least, along * cone - sine)
    return least - 1e-9 if least > 1e-9 else NO_CONE
