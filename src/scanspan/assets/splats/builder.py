"""A tree of splats, grown cell by cell: the lattice that points lie on, and what is done with the points of a cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from scanspan.assets.splats.cells import Cell, Rows
from scanspan.assets.splats.codec import BLOCK, Splats
from scanspan.assets.splats.file import HAS_COLOR, HAS_NORMALS, ORIENTED, Header
from scanspan.assets.splats.grow import (
    BLOCKS_BEFORE,
    BLOCKS_MADE,
    SPLATS_MADE,
    Frame,
    Growth,
    SortedPoints,
    add_leaves,
    finish_growth,
    make_growth,
    make_room,
)
from scanspan.assets.splats.order import AXIS_BITS, cut_ranges, order_points, take_numbers, take_rows
from scanspan.assets.splats.source import ROWS, WIDTHS, Piece, Totals, slices
from scanspan.assets.splats.spacing import leaf_normals, leaf_radii
from scanspan.assets.splats.target import FileTarget, Target
from scanspan.assets.splats.tree import SplatTree
from scanspan.color.transfer import LIGHT_OF_CODES, linear_from_srgb
from scanspan.records import Array, Float64Array, Int64Array

LATTICE_BITS = 40  # of the extent of points that bring no lattice of their own
LEAST_EXPONENT = -332  # of two, a step: what is closer than 1e-100 lies at one place, and no square is 0
HIGHEST = 1000  # level at which the first leaf parts from nothing

# Light between two codes, half way between them as they are encoded.
BORDERS = linear_from_srgb((np.arange(255) + 0.5) / 255.0)

Heard = Callable[[str, int, int], None]


class Lattice(NamedTuple):
    """Whole numbers that places are kept as: a place is offset + scale * (base + number)."""

    offset: Float64Array  # (3,)
    scale: Float64Array  # (3,)
    base: Int64Array  # (3,)
    shift: int  # bits of a number that the first Morton code leaves out
    error: float  # between a place and its number, in the world
    whole: bool  # whether points bring these numbers
    kind: type  # of the numbers

    def rows(self, piece: Piece, estimate: bool) -> Rows:
        """Return points on the lattice."""
        if self.whole:
            numbers = piece.stored.astype(np.int64) - self.base
        else:
            numbers = np.rint((piece.positions - self.offset) / self.scale).astype(np.int64)
        columns = {name: values for name, values in piece.columns.items() if not (estimate and name == "normals")}
        return Rows(numbers.astype(self.kind), columns)


def lattice_of(totals: Totals) -> Lattice:
    """Return the lattice of points: their own whole numbers, or steps of a power of two, 2^-40 of the extent."""
    extent = float((totals.high - totals.low).max()) if totals.points else 0.0
    if totals.scale is not None:
        shift = max(int(extent).bit_length() - AXIS_BITS, 0)
        kind = np.int32 if extent < 1 << 31 else np.int64
        ends = np.array([totals.low, totals.high]) * totals.scale + totals.offset
        return Lattice(totals.offset, totals.scale, totals.low.astype(np.int64), shift, _rounding(ends), True, kind)
    # Points at one place have no extent; any step will do.
    step = math.ldexp(1.0, max(math.frexp(extent)[1] - LATTICE_BITS, LEAST_EXPONENT)) if extent > 0.0 else 1.0
    low, high = (totals.low, totals.high) if totals.points else (np.zeros(3), np.zeros(3))
    error = 0.5 * step * math.sqrt(3.0) + _rounding(np.array([low, high])) if extent > 0.0 else 0.0
    return Lattice(low, np.full(3, step), np.zeros(3, np.int64), LATTICE_BITS + 1 - AXIS_BITS, error, False, np.int64)


def _rounding(ends: Float64Array) -> float:
    """Return how far a place within some bounds moves when it is added up in float64."""
    return 4.0 * float(np.spacing(np.abs(ends).max()))


class Builder:
    """Grows a tree cell by cell."""

    def __init__(self, lattice: Lattice, names: tuple[str, ...], estimate: bool, exact: bool, target: Target) -> None:
        self.lattice = lattice
        self.estimate = estimate
        self.has_color = "color" in names
        self.has_normals = "normals" in names or estimate
        # Arrays of our own, so that the kernels are compiled for one kind of them.
        scale, light = lattice.scale.copy(), LIGHT_OF_CODES.copy()
        self.frame = Frame(scale, lattice.error, light, BORDERS.copy(), exact, not estimate)
        self.growth = make_growth()
        self.target = target
        self.cells = 0
        self.done = 0

    def add(self, cell: Cell) -> None:
        """Make the blocks of a cell."""
        count = len(cell.rows.lattice)
        order, codes, rests = order_points(cell.rows.lattice, self.lattice.shift)
        lattice = take_numbers(cell.rows.lattice, order)
        starts = np.empty((count // 2 + 3, 2), np.int64)
        leaves = cut_ranges(codes, rests, BLOCK, cell.level, cell.halved, starts)

        columns = {name: take_rows(values, order) for name, values in cell.rows.columns.items()}
        if "radius" in columns:
            radius = columns["radius"][:, 0].astype(np.float64)
        else:
            radius = np.empty(count)
            leaf_radii(lattice, self.frame.scale, starts, leaves, radius)
        normals = columns.get("normals", np.empty((0, 3), np.float32))
        if self.estimate:
            normals = np.empty((count, 3), np.float32)
            leaf_normals(lattice, self.frame.scale, starts, leaves, normals)
        points = SortedPoints(lattice, radius, columns.get("color", np.empty((0, 3), np.uint8)), normals)
        del order, cell
        room = make_room(count, leaves, self.growth, self.has_color, self.has_normals)
        add_leaves(points, codes, rests, starts, leaves, self.frame, room, self.growth)
        self._hand_on(room.whole, room.real, room.splats)
        self.cells += 1
        self.done += count

    def finish(self, count: int) -> SplatTree:
        """Return the tree."""
        room = make_room(0, 0, self.growth, self.has_color, self.has_normals)
        finish_growth(self.frame, room, self.growth)
        self._hand_on(room.whole, room.real, room.splats)
        return self.target.finish(count)

    def _hand_on(self, whole: Int64Array, real: Float64Array, splats: Splats) -> None:
        """Give the blocks that were made to the target."""
        counts = self.growth.counts
        blocks, made = int(counts[BLOCKS_MADE]), int(counts[SPLATS_MADE])
        self.target.add(whole[:blocks], real[:blocks], Splats(*(array[:made] for array in splats)))
        counts[BLOCKS_BEFORE] += blocks
        counts[BLOCKS_MADE] = counts[SPLATS_MADE] = 0

    def state(self) -> dict[str, Array]:
        """Return what must be known to go on."""
        assert isinstance(self.target, FileTarget)
        return self.target.state() | self.growth._asdict() | {"cells": np.array([self.cells, self.done])}

    def restore(self, kept: dict[str, Array]) -> None:
        """Go on from a state."""
        assert isinstance(self.target, FileTarget)
        self.target.restore(kept)
        self.growth = Growth(*(kept[name] for name in Growth._fields))
        self.cells, self.done = kept["cells"].tolist()


def rows_of(pieces: Iterable[Piece], lattice: Lattice, normals: str, size: int = ROWS) -> Iterator[Rows]:
    """Give points on the lattice, no more than `size` at a time."""
    for whole in pieces:
        for piece in slices(whole, min(size, ROWS)):
            yield lattice.rows(piece, normals != "given")


def header_of(lattice: Lattice, names: tuple[str, ...], normals: str) -> Header:
    """Return the header of a tree."""
    flags = HAS_COLOR * ("color" in names)
    if normals == "estimate":
        flags |= HAS_NORMALS
    elif normals == "given" and "normals" in names:
        flags |= HAS_NORMALS | ORIENTED
    return Header(flags, lattice.offset, lattice.scale, lattice.base)


def kept_columns(names: tuple[str, ...], normals: str) -> tuple[str, ...]:
    """Return the columns that are kept."""
    return tuple(name for name in names if name != "normals" or normals == "given")


def join_rows(pieces: Iterable[Rows], lattice: Lattice, names: tuple[str, ...]) -> Rows:
    """Return all points."""
    parts = list(pieces)
    if not parts:
        return Rows(np.empty((0, 3), lattice.kind), {name: np.empty((0, WIDTHS[name][0]), WIDTHS[name][1]) for name in names})
    columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in names}
    return Rows(np.concatenate([part.lattice for part in parts]), columns)
