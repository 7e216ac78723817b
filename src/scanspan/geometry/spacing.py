"""Spacing: how far apart the points of a cloud lie, at each of them, so that splats can be made to close its surfaces.

Space is divided into cubes, and into cubes of twice the size, five times. A surface that crosses a cube of side c with n points
in it has one in c^2 / n, so they lie c / sqrt(n) apart. Each point takes the smallest cube round it that has enough points to
tell. Of a large cloud every k-th point is counted, which k makes up for; a table of all cubes would not fit the cache.

The price: at the rim of a surface cubes are partly empty, and splats come out up to twice as large as need be; points that fill
a volume, such as leaves, count as a surface.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Float32Array, Float64Array, Int32Array, Int64Array, Integer

LEVELS = 6  # sizes of cubes
COUNTED = 1 << 19  # points that are counted at most
TABLE_BITS = 22  # of the table of cubes, which is never full: LEVELS * COUNTED < 2^22
ENOUGH = 5  # points in a cube that tell their spacing
LONGEST = 3.0  # times the median spacing: what stands alone is not made larger

EMPTY = np.int64(-1)
MIX = np.uint64(0x9E3779B97F4A7C15)


class Spacing(NamedTuple):
    """How far apart the points of a cloud lie, in its own units."""

    typical: float  # the median
    share: Float32Array  # (N,) of each point, as a multiple of the median


@helper_kernel
def find_cube(
    cubes: Int64Array, positions: Array, row: Integer, low: Float64Array, per_unit: Float64Array, level: int
) -> Integer:
    """Return the place in the table of the cube of a size in which a point lies, or where it would be put.

    Shapes  cubes: (2^TABLE_BITS,); positions: (N, 3); low, per_unit: (3,), cubes of the smallest size in a stored unit.
    """
    x = np.int64((np.float64(positions[row, 0]) - low[0]) * per_unit[0]) >> level
    y = np.int64((np.float64(positions[row, 1]) - low[1]) * per_unit[1]) >> level
    z = np.int64((np.float64(positions[row, 2]) - low[2]) * per_unit[2]) >> level
    cube = ((np.int64(level) * 1048576 + x) * 1048576 + y) * 1048576 + z
    place = (np.uint64(cube) * MIX) >> np.uint64(64 - TABLE_BITS)
    while cubes[place] != EMPTY and cubes[place] != cube:
        place = (place + np.uint64(1)) & np.uint64((1 << TABLE_BITS) - 1)
    return np.int64(place)


@kernel
def count_cubes(
    cubes: Int64Array, counts: Int32Array, positions: Array, stride: int, low: Float64Array, per_unit: Float64Array
) -> None:
    """Count the points in each cube of each size, of every stride-th point.

    Shapes  cubes: (2^TABLE_BITS,), EMPTY throughout, and counts, 0 throughout, written; others as for find_cube.
    Needs   at most COUNTED points that are counted, and fewer than 2^20 cubes along an axis.
    """
    for row in range(0, positions.shape[0], stride):
        for level in range(LEVELS):
            place = find_cube(cubes, positions, row, low, per_unit, level)
            x = np.int64((np.float64(positions[row, 0]) - low[0]) * per_unit[0]) >> level
            y = np.int64((np.float64(positions[row, 1]) - low[1]) * per_unit[1]) >> level
            z = np.int64((np.float64(positions[row, 2]) - low[2]) * per_unit[2]) >> level
            cubes[place] = ((np.int64(level) * 1048576 + x) * 1048576 + y) * 1048576 + z
            counts[place] += np.int32(1)


@kernel
def measure_spacing(
    cubes: Int64Array, counts: Int32Array, positions: Array, stride: int, low: Float64Array, per_unit: Float64Array,
    side: float, spacing: Float32Array,
) -> None:  # fmt: skip
    """Write the spacing at each point.

    Shapes  spacing: (N,), written; others as for count_cubes. Units  side: of the smallest cube.
    """
    for row in range(positions.shape[0]):
        found, wide = np.int64(0), side
        for level in range(LEVELS):
            if found < ENOUGH:
                wide = side * np.float64(np.int64(1) << level)
                found = np.int64(counts[find_cube(cubes, positions, row, low, per_unit, level)])
        spacing[row] = np.float32(wide / np.sqrt(np.float64(max(found, np.int64(1)) * stride)))


def find_spacing(cloud: PointCloud) -> Spacing:
    """Return how far apart the points of a cloud lie; it is worked out once for each cloud.

    Examples
    --------
    >>> grid = np.stack(np.meshgrid(np.arange(64.0), np.arange(64.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> 0.5 < find_spacing(PointCloud(grid)).typical < 2
    True
    """
    known = _KNOWN.get(cloud)
    if known is None:
        known = _KNOWN[cloud] = measure(cloud)
    return known


_KNOWN: WeakKeyDictionary[PointCloud, Spacing] = WeakKeyDictionary()


def measure(cloud: PointCloud) -> Spacing:
    """Work out the spacing of a cloud."""
    count = len(cloud)
    if not count:
        return Spacing(0.0, np.empty(0, np.float32))
    columns = [cloud.stored[:, k] for k in range(3)]
    low, high = np.array([[end(column) for column in columns] for end in (np.min, np.max)], np.float64)
    extent = (high - low) * cloud.scale
    longest, second = float(np.sort(extent)[2]), float(np.sort(extent)[1])
    if not longest > 0.0:
        return Spacing(0.0, np.ones(count, np.float32))

    # Begin with cubes in which a flat surface would have two of the points that are counted.
    stride = -(-count // COUNTED)
    counted = -(-count // stride)
    side = max(1.5 * float(np.sqrt(longest / counted * second)), longest / counted, longest / float(1 << 19))
    cubes, counts = np.full(1 << TABLE_BITS, EMPTY), np.zeros(1 << TABLE_BITS, np.int32)
    per_unit = cloud.scale / side
    count_cubes(cubes, counts, cloud.stored, stride, low, per_unit)
    share = np.empty(count, np.float32)
    measure_spacing(cubes, counts, cloud.stored, stride, low, per_unit, 1.0, share)

    # Measure in sides of the smallest cube, which cannot overflow, then as multiples of the median.
    median = float(np.median(share[::stride]))
    np.minimum(share / np.float32(median), np.float32(LONGEST), out=share)
    return Spacing(median * side, share)
