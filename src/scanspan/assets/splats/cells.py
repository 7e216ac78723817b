"""Points sorted into cells on the disk, each of which fits in memory, in the order of their Morton codes.

One pass counts the points of each prefix of 21 bits; a cell is the largest part of the binary tree over prefixes that has no
more points than fit. A second pass writes each point to the place of its cell. A prefix with too many points is split likewise
by its next 21 bits, and in the end by numbers, where points lie at one place. Points of a cell keep the order in which they
came, so the tree that is made of them is the same for all sizes of memory. The price: each point is written and read once more.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from scanspan.assets.splats.order import CODE_BITS, highest_bit, morton_codes, morton_rests, sorted_order, take_rows
from scanspan.jit import kernel
from scanspan.records import Array, Int64Array, Integer

PREFIX_BITS = 21
PREFIXES = 1 << PREFIX_BITS
DIGITS = 6  # of 21 bits: three of the first code, and three of the second


class Rows(NamedTuple):
    """Points on the lattice, with what is known of each."""

    lattice: Array  # (N, 3) int32 or int64
    columns: dict[str, Array]


class Cell(NamedTuple):
    """Points that are made into blocks together."""

    rows: Rows
    level: int  # at which they part from the cell before
    halved: int  # how often points of one place were halved until these were left


class Store:
    """Points in files, one for each column; parts can be written and read in any order."""

    def __init__(self, folder: Path, name: str, kinds: dict[str, tuple[int, Any]], create: bool) -> None:
        self.kinds = kinds
        self.paths = {key: folder / f"{name}.{key}" for key in kinds}
        self.files: dict[str, BinaryIO] = {key: path.open("w+b" if create else "r+b") for key, path in self.paths.items()}

    def write(self, first: int, rows: Rows, part: slice) -> None:
        """Write a part of some rows to row `first` and those after it."""
        for key, (width, kind) in self.kinds.items():
            array = rows.lattice if key == "lattice" else rows.columns[key]
            file = self.files[key]
            file.seek(first * width * np.dtype(kind).itemsize)
            file.write(array[part].tobytes())

    def read(self, first: int, last: int) -> Rows:
        """Return the rows from `first` to before `last`."""
        columns: dict[str, Array] = {}
        for key, (width, kind) in self.kinds.items():
            file = self.files[key]
            file.seek(first * width * np.dtype(kind).itemsize)
            columns[key] = np.fromfile(file, kind, (last - first) * width).reshape(last - first, width)
        return Rows(columns.pop("lattice"), columns)

    def flush(self) -> None:
        """Bring what was written to the disk."""
        for file in self.files.values():
            file.flush()
            os.fsync(file.fileno())

    def close(self, remove: bool) -> None:
        """Close the files, and remove them if asked to."""
        for key, file in self.files.items():
            file.close()
            if remove:
                self.paths[key].unlink(missing_ok=True)


def prefixes(lattice: Array, shift: int, digit: int) -> Int64Array:
    """Return 21 bits of the codes of points: 0 to 2 from the top of the first code, 3 to 5 of the second."""
    codes = morton_codes(lattice, shift) if digit < 3 else morton_rests(lattice, shift)
    take_digit(codes, CODE_BITS - PREFIX_BITS * (digit % 3 + 1))
    return codes


@kernel
def take_digit(codes: Int64Array, shift: Integer) -> None:
    """Leave 21 bits of each code, from bit `shift` on."""
    for i in range(len(codes)):
        codes[i] = codes[i] >> shift & (PREFIXES - 1)


@kernel
def count_prefixes(prefix: Int64Array, counts: Int64Array) -> None:
    """Add one to the count of each prefix."""
    for i in range(len(prefix)):
        counts[prefix[i]] += 1


@kernel
def cut_prefixes(totals: Int64Array, size: Integer, bit_level: Integer, level: Integer, cells: Int64Array) -> int:
    """Cut all prefixes into cells of no more than `size` points, or of one prefix; return how many. Empty ones are left out.

    Writes      cells (C, 4): first prefix, the one after the last, points, level at which it parts from the one before.
    Units       totals (PREFIXES + 1,): points in all prefixes before each; bit_level: the level of the lowest bit of a prefix;
                level: of the first cell.
    """
    waiting = np.empty((64, 3), np.int64)
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = 0, len(totals) - 1, level
    top, count = 1, 0
    while top > 0:
        top -= 1
        a, b, parting = waiting[top, 0], waiting[top, 1], waiting[top, 2]
        points = totals[b] - totals[a]
        if points == 0:
            continue
        if points <= size or b - a == 1:
            cells[count, 0], cells[count, 1], cells[count, 2], cells[count, 3] = a, b, points, parting
            count += 1
            continue

        # Only where both halves have points do they part here.
        middle = (a + b) // 2
        inner = bit_level + highest_bit(b - a) - 1
        if totals[middle] == totals[a]:
            inner = parting
        waiting[top, 0], waiting[top, 1], waiting[top, 2] = middle, b, inner
        waiting[top + 1, 0], waiting[top + 1, 1], waiting[top + 1, 2] = a, middle, parting
        top += 2
    return count


class Split(NamedTuple):
    """How points go to cells."""

    cells: Int64Array  # (C, 4) as cut_prefixes writes them
    starts: Int64Array  # (C + 1,) first row of each


def plan(pieces: Iterable[Rows], shift: int, digit: int, size: int, level: int) -> Split:
    """Return the cells of points, from the counts of their prefixes."""
    counts = np.zeros(PREFIXES, np.int64)
    for rows in pieces:
        count_prefixes(prefixes(rows.lattice, shift, digit), counts)
    totals = np.concatenate([[0], np.cumsum(counts)])
    most = int(np.count_nonzero(counts))
    cells = np.empty((most, 4), np.int64)
    # Bits of the first code have the levels from 64 on, those of the second from 1 on.
    lowest = CODE_BITS - PREFIX_BITS * (digit % 3 + 1) + 1 + (CODE_BITS if digit < 3 else 0)
    cells = cells[: cut_prefixes(totals, size, lowest, level, cells)].copy()
    return Split(cells, np.concatenate([[0], np.cumsum(cells[:, 2])]))


def distribute(
    pieces: Iterable[Rows], shift: int, digit: int, split: Split, store: Store, heard: Callable[[int], None]
) -> None:
    """Write each point to the rows of its cell, in the order in which they come."""
    cell_of_prefix = np.zeros(PREFIXES, np.int32)
    for cell, (first, last, _, _) in enumerate(split.cells.tolist()):
        cell_of_prefix[first:last] = cell
    place = split.starts[:-1].copy()
    for rows in pieces:
        cells = cell_of_prefix[prefixes(rows.lattice, shift, digit)].astype(np.int64)
        order, cells = sorted_order(cells)
        columns = {name: take_rows(values, order) for name, values in rows.columns.items()}
        ordered = Rows(take_rows(rows.lattice, order), columns)
        ends = np.flatnonzero(np.diff(cells, append=-1)) + 1
        first = 0
        for end in ends.tolist():
            cell = int(cells[first])
            store.write(int(place[cell]), ordered, slice(first, end))
            place[cell] += end - first
            first = end
        heard(len(order))


def read_pieces(store: Store, first: int, last: int, size: int) -> Iterator[Rows]:
    """Give rows of a store in pieces."""
    for row in range(first, last, size):
        yield store.read(row, min(row + size, last))


def read_cells(store: Store, split: Split, shift: int, digit: int, size: int, folder: Path, skip: int) -> Iterator[Cell]:
    """Give the points of each cell, cells with too many in parts; the first `skip` are left out, though they are counted."""
    passed = 0
    for (_, _, count, level), first in zip(split.cells.tolist(), split.starts.tolist()):
        if count <= size:
            passed += 1
            if passed > skip:
                yield Cell(store.read(first, first + count), level, 0)
            continue
        for cell in _read_large(store, first, first + count, level, shift, digit + 1, size, folder):
            passed += 1
            if passed > skip:
                yield cell


def _read_large(
    store: Store, first: int, last: int, level: int, shift: int, digit: int, size: int, folder: Path
) -> Iterator[Cell]:
    """Give the points of a cell that is too large: split by more bits, or halved where all lie at one place."""
    if digit == 3 and shift == 0:
        digit = DIGITS
    if digit == DIGITS:
        yield from _halves(store, first, last, level, 0, size)
        return
    split = plan(read_pieces(store, first, last, size), shift, digit, size, level)
    if len(split.cells) == 1 and split.cells[0, 2] > size:
        yield from _read_large(store, first, last, level, shift, digit + 1, size, folder)
        return
    parts = Store(folder, f"part{digit}", store.kinds, create=True)
    try:
        distribute(read_pieces(store, first, last, size), shift, digit, split, parts, lambda count: None)
        yield from read_cells(parts, split, shift, digit, size, folder, 0)
    finally:
        parts.close(remove=True)


def _halves(store: Store, first: int, last: int, level: int, halved: int, size: int) -> Iterator[Cell]:
    """Give the points of one place in halves that fit."""
    if last - first <= size:
        yield Cell(store.read(first, last), level, halved)
        return
    middle = first + (last - first) // 2
    yield from _halves(store, first, middle, level, halved + 1, size)
    yield from _halves(store, middle, last, -(halved + 1), halved + 1, size)
