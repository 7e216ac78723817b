"""Where the blocks of a growing tree go: gathered into pages by their height, and these into memory or into a file."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from pathlib import Path
from typing import IO, Any

import numpy as np

from scanspan.assets.splats.codec import COUNT, FIRST, HEIGHT, Splats
from scanspan.assets.splats.file import HAS_COLOR, HAS_NORMALS, HEADER_SIZE, PAGE_ROW, Header, pack_end, read_tree
from scanspan.assets.splats.nodes import BLOCK, Table, block_rows, node_table, stored_nodes
from scanspan.assets.splats.pages import LEVEL, PAGE, checksum, make_splats, pack_bytes, plane_count, split_planes, zstandard
from scanspan.assets.splats.tree import MemoryPages, SplatTree, copy_blocks
from scanspan.jit import kernel
from scanspan.records import Array, Float64Array, Int64Array

HEIGHTS = 256
FULLNESS, NUMBER = 0, 1  # of the open page of a height: splats in it, and its number, -1 if there is none


@kernel
def assign_pages(whole: Int64Array, open_pages: Int64Array, next_page: int, page: Int64Array, start: Int64Array) -> int:
    """Write the page of each block and where in it the block starts; return the number of the next page.

    Writes      page, start (B,); open_pages (HEIGHTS, 2).
    """
    for block in range(len(whole)):
        height, count = whole[block, HEIGHT], whole[block, COUNT]
        if open_pages[height, NUMBER] < 0 or open_pages[height, FULLNESS] + count > PAGE:
            open_pages[height, FULLNESS], open_pages[height, NUMBER] = 0, next_page
            next_page += 1
        page[block], start[block] = open_pages[height, NUMBER], open_pages[height, FULLNESS]
        open_pages[height, FULLNESS] += count
    return next_page


def _joined(parts: list[Splats]) -> Splats:
    """Return several lots of splats as one."""
    return parts[0] if len(parts) == 1 else Splats(*(np.concatenate(arrays) for arrays in zip(*parts)))


class Target(ABC):
    """Takes blocks as they are made and hands on full pages; a subclass says what becomes of them."""

    def __init__(self, header: Header) -> None:
        self.header = header
        self.has_color = bool(header.flags & HAS_COLOR)
        self.has_normals = bool(header.flags & HAS_NORMALS)
        self.open_pages = np.full((HEIGHTS, 2), -1, np.int64)
        self.next_page = 0
        self.pending: dict[int, tuple[int, list[Splats]]] = {}

    @abstractmethod
    def write_page(self, number: int, height: int, splats: Splats) -> None:
        """Keep a page."""

    @abstractmethod
    def write_rows(self, rows: Table) -> None:
        """Keep rows of BLOCK."""

    @abstractmethod
    def finish(self, point_count: int) -> SplatTree:
        """Return the tree of all that came."""

    def add(self, whole: Int64Array, real: Float64Array, splats: Splats) -> None:
        """Take the blocks that the kernels made."""
        page, start = np.empty(len(whole), np.int64), np.empty(len(whole), np.int64)
        self.next_page = assign_pages(whole, self.open_pages, self.next_page, page, start)
        self.write_rows(block_rows(whole, real, page, start))

        # Gather the blocks of each page; blocks follow each other in a page as they were made.
        order = np.argsort(page, kind="stable")
        ends = (np.flatnonzero(np.diff(page[order], append=-1))) + 1
        first = 0
        for end in ends.tolist():
            chosen = order[first:end]
            starts = np.zeros(len(chosen) + 1, np.int64)
            np.cumsum(whole[chosen, COUNT], out=starts[1:])
            part = make_splats(int(starts[-1]), self.has_color, self.has_normals)
            copy_blocks(np.arange(len(chosen)), whole[chosen, FIRST], starts, splats, part)
            self.pending.setdefault(int(page[chosen[0]]), (int(whole[chosen[0], HEIGHT]), []))[1].append(part)
            first = end
        self._hand_on(is_last=False)

    def _hand_on(self, is_last: bool) -> None:
        """Write the pages that are complete: those that another of their height follows, or all at the end.

        They are written in the order in which others took their places, so that it does not matter how often this is called.
        """
        followers: dict[int, int] = {}
        latest: dict[int, int] = {}
        for number in sorted(self.pending, reverse=True):
            height = self.pending[number][0]
            if height in latest:
                followers[number] = latest[height]
            latest[height] = number
        ready = sorted(followers, key=followers.__getitem__)
        if is_last:
            ready += sorted(set(self.pending) - set(followers))
        for number in ready:
            height, parts = self.pending.pop(number)
            self.write_page(number, height, _joined(parts))


class MemoryTarget(Target):
    """Keeps pages and rows in memory."""

    def __init__(self, header: Header) -> None:
        super().__init__(header)
        self.pages: dict[int, Splats] = {}
        self.rows: list[Table] = []

    def write_page(self, number: int, height: int, splats: Splats) -> None:
        """Keep a page."""
        self.pages[number] = splats

    def write_rows(self, rows: Table) -> None:
        """Keep rows."""
        self.rows.append(rows)

    def finish(self, point_count: int) -> SplatTree:
        """Return the tree."""
        self._hand_on(is_last=True)
        rows = np.concatenate(self.rows) if self.rows else np.empty(0, BLOCK)
        nodes, problem = node_table(stored_nodes(rows), self.header.scale)
        assert not problem, problem
        pages = MemoryPages([self.pages[number] for number in range(self.next_page)])
        tree = SplatTree(nodes, self.header.origin, pages, self.has_color, self.has_normals)
        tree.lattice = self.header.offset, self.header.scale, self.header.base
        return tree


class FileTarget(Target):
    """Writes pages to the end of a file, and rows to another until the tree is complete."""

    def __init__(self, header: Header, path: Path, rows_path: Path, going_on: bool = False) -> None:
        super().__init__(header)
        self.path = path
        self.rows_path = rows_path
        self.table: list[tuple[int, ...]] = []  # number, and the columns of PAGE_ROW
        mode = "r+b" if going_on else "w+b"
        self.file: IO[bytes] = path.open(mode)
        self.rows_file: IO[bytes] = rows_path.open(mode)
        self.compressor = zstandard().ZstdCompressor(level=LEVEL)
        if not going_on:
            self.file.write(header.pack())
        self.size = HEADER_SIZE
        self.row_count = 0

    def write_page(self, number: int, height: int, splats: Splats) -> None:
        """Compress a page and write it."""
        planes = np.empty((plane_count(self.has_color, self.has_normals), len(splats.radius)), np.uint8)
        split_planes(splats, planes)
        content = pack_bytes(planes, self.compressor)
        self.file.write(content)
        self.table.append((number, self.size, len(content), checksum(content), len(splats.radius), height))
        self.size += len(content)

    def write_rows(self, rows: Table) -> None:
        """Write rows."""
        self.rows_file.write(rows.tobytes())
        self.row_count += len(rows)

    def finish(self, point_count: int) -> SplatTree:
        """Write the tables and the footer, and return the tree as it is read from the file."""
        self._hand_on(is_last=True)
        self.rows_file.flush()
        pages = np.zeros(self.next_page, PAGE_ROW)
        table = np.array(self.table, np.int64).reshape(-1, 6)
        for column, name in enumerate(PAGE_ROW.names or ()):
            pages[name][table[:, 0]] = table[:, 1 + column]
        # Nothing of these tables is kept, because the tree that is read next needs their room.
        nodes = np.fromfile(self.rows_path, BLOCK, self.row_count)
        self.file.write(pack_end(pages, stored_nodes(nodes), point_count, self.size))
        del nodes
        self.close()
        return read_tree(self.path)

    def close(self) -> None:
        """Close the files, whether or not they are complete."""
        self.file.close()
        self.rows_file.close()

    def state(self) -> dict[str, Array]:
        """Return what must be known to go on after what has been written so far, which is on the disk when this returns."""
        for file in (self.file, self.rows_file):
            file.flush()
            os.fsync(file.fileno())
        kept: dict[str, Any] = {"open_pages": self.open_pages, "table": np.array(self.table, np.int64).reshape(-1, 6)}
        kept["sizes"] = np.array([self.next_page, self.size, self.row_count])
        kept["pending"] = np.array([[number, height] for number, (height, _) in self.pending.items()], np.int64).reshape(-1, 2)
        for number, (_, parts) in self.pending.items():
            for name, array in zip(Splats._fields, _joined(parts)):
                kept[f"{name}_{number}"] = array
        return kept

    def restore(self, kept: dict[str, Array]) -> None:
        """Go on from a state: what was written after it is cut off."""
        self.open_pages = kept["open_pages"]
        self.table = [tuple(row) for row in kept["table"].tolist()]
        self.next_page, self.size, self.row_count = kept["sizes"].tolist()
        for number, height in kept["pending"].tolist():
            self.pending[number] = height, [Splats(*(kept[f"{name}_{number}"] for name in Splats._fields))]
        for file, size in ((self.file, self.size), (self.rows_file, self.row_count * BLOCK.itemsize)):
            file.truncate(size)
            file.seek(size)
