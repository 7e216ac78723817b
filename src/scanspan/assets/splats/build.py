"""Trees of splats from points: checked, put on a lattice, ordered, and grown block by block."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.arrays import as_colors, as_floats, quote_row
from scanspan.assets.splats.codec import BLOCK, FIRST
from scanspan.assets.splats.grow import (
    BLOCKS_MADE,
    SPLATS_MADE,
    Frame,
    SortedPoints,
    add_leaves,
    finish_growth,
    make_growth,
    make_room,
)
from scanspan.assets.splats.order import AXIS_BITS, cut_ranges, order_points
from scanspan.assets.splats.spacing import neighbour_distances
from scanspan.assets.splats.tree import MemoryPages, SplatTree, node_table
from scanspan.color.transfer import LIGHT_OF_CODES, linear_from_srgb
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int64Array

LATTICE_STEPS_BITS = 40  # of the extent of points that bring no lattice of their own
LARGEST_COORDINATE = 1e100

# Light between two codes, half way between them as they are encoded.
BORDERS = linear_from_srgb((np.arange(255) + 0.5) / 255.0)


class Lattice(NamedTuple):
    """Whole numbers that places are kept as: a place is origin + scale * number."""

    origin: Float64Array  # (3,)
    scale: Float64Array  # (3,)
    shift: int  # bits of a number that the first Morton code leaves out
    error: float  # between a place and its number, in the world


def lattice_of_bounds(low: Float64Array, high: Float64Array) -> Lattice:
    """Return a lattice for places between two corners: its step is a power of two, 2^-40 of the extent."""
    extent = float((high - low).max())
    # Points at one place have no extent; any step will do.
    exponent = math.frexp(extent)[1] - LATTICE_STEPS_BITS if extent > 0.0 else -LATTICE_STEPS_BITS
    step = math.ldexp(1.0, exponent)
    scale = np.full(3, step)
    return Lattice(low.copy(), scale, LATTICE_STEPS_BITS + 1 - AXIS_BITS, float(0.5 * step * math.sqrt(3.0)))


def on_lattice(positions: Float64Array, lattice: Lattice) -> Int64Array:
    """Return the numbers of places (N, 3)."""
    return np.rint((positions - lattice.origin) / lattice.scale).astype(np.int64)


def build_in_memory(
    positions: ArrayLike,
    color: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    radius: ArrayLike | None = None,
) -> SplatTree:
    """Return the tree of some points, all in memory.

    >>> rng = np.random.default_rng(1)
    >>> build_in_memory(rng.random((1000, 3)))
    SplatTree(1,000 points, ...)
    """
    places = as_floats(positions, 3, "positions")
    if not np.isfinite(places).all():
        row = int(np.flatnonzero(~np.isfinite(places).all(axis=1))[0])
        raise InputError(f"expected finite positions, got {quote_row(places, 'positions', row)}")
    count = len(places)
    colors = np.zeros((0, 3), np.uint8) if color is None else as_colors(color, [count], "color")[:, :3]
    if colors.dtype != np.uint8:
        colors = np.rint(colors * 255).astype(np.uint8)
    directions = np.zeros((0, 3), np.float32) if normals is None else as_floats(normals, 3, "normals").astype(np.float32)
    if count == 0:
        return SplatTree(node_table(*_nothing()), np.zeros(3), MemoryPages([]), color is not None, normals is not None)

    lattice = lattice_of_bounds(places.min(axis=0), places.max(axis=0))
    numbers = on_lattice(places, lattice)
    order, codes, rests = order_points(numbers, lattice.shift)
    numbers = numbers[order]
    if radius is None:
        reach = np.empty(count, np.float32)
        neighbour_distances(numbers, lattice.scale, 0, count, reach)
    else:
        reach = np.asarray(radius, np.float32)[order]
    points = SortedPoints(
        numbers, reach, colors[order] if len(colors) else colors, directions[order] if len(directions) else directions
    )

    frame = Frame(lattice.scale, lattice.error, LIGHT_OF_CODES, BORDERS, False, True)
    growth = make_growth()
    starts = np.zeros((2 * count // BLOCK * 8 + 256, 2), np.int64)
    starts = np.zeros((count + 1, 2), np.int64)
    leaves = cut_ranges(codes, rests, 0, count, BLOCK, 1000, starts)
    starts[leaves, 0] = count
    room = make_room(count, leaves, growth, len(colors) > 0, len(directions) > 0)
    add_leaves(points, codes, rests, starts, leaves, frame, room, growth)
    finish_growth(frame, room, growth)

    blocks, splats = int(growth.counts[BLOCKS_MADE]), int(growth.counts[SPLATS_MADE])
    whole, real = room.whole[:blocks], room.real[:blocks]
    page = type(room.splats)(*(array[:splats] for array in room.splats))
    nodes = node_table(whole, real, lattice.scale, np.zeros(blocks, np.int64), whole[:, FIRST].copy())
    return SplatTree(nodes, lattice.origin, MemoryPages([page]), color is not None, normals is not None)


def _nothing() -> tuple[Int64Array, Float64Array, Float64Array, Int64Array, Int64Array]:
    """Return the numbers of no block."""
    none = np.zeros(0, np.int64)
    return np.zeros((0, 16), np.int64), np.zeros((0, 10)), np.ones(3), none, none
