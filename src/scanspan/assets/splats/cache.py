"""Decoded splats that are kept: one stretch of memory for many blocks, so that a kernel takes them all in one call.

Blocks are put one behind the other as they are read. When the next ones do not fit within the limit, everything is forgotten
and what is wanted now is read again: simple, and it costs a reading of one view, not of the tree. A view that is larger than the
limit is handed out in parts, each within it.

Pages that lie in memory as they are need no second copy, and are used where they lie.
"""

from __future__ import annotations

from collections.abc import Iterator
from threading import RLock

import numpy as np

from scanspan.assets.splats.codec import Splats
from scanspan.assets.splats.tree import MemoryPages, SplatTree
from scanspan.records import Int64Array

MAX_BYTES = 384 << 20  # of decoded splats that are kept by default: some 30 million
BYTES_READ_AT_ONCE = 1 << 24  # so that Ctrl-C, and a deadline, wait for no more


class BlockCache:
    """The decoded blocks of one tree.

    Attributes
    ----------
    splats : the arrays that hold them.
    start : (M,) int64, the first splat of each node in them; -1 for one that is not there.
    bytes_read : of decoded splats so far, all told.
    lock : to be held while `parts` is walked through, and what it gave is used.
    """

    def __init__(self, tree: SplatTree, max_bytes: int = MAX_BYTES) -> None:
        self.tree, self.lock, self.bytes_read = tree, RLock(), 0
        self.count = tree.nodes["count"].astype(np.int64)
        self._room, self._used = 0, 0
        pages = tree._pages
        if isinstance(pages, MemoryPages) and len(pages.pages) == 1:
            self.splats, self.start = pages.pages[0], tree.nodes["start"].astype(np.int64)
            self.is_resident = True
            return
        self.is_resident = False
        self.start = np.full(len(tree.nodes), -1, np.int64)
        self.width = 7 + 3 * tree.has_color + 2 * tree.has_normals
        most = int(self.count.max(initial=1))
        self.limit = max(max_bytes // self.width, most)
        self.splats = tree.room(0)

    def parts(self, nodes: Int64Array) -> Iterator[tuple[int, int]]:
        """Give ranges of some nodes, in order, after the splats of each range were read."""
        if self.is_resident:
            if len(nodes):
                yield 0, len(nodes)
            return
        ends = np.cumsum(self.count[nodes])
        first = 0
        while first < len(nodes):
            before = int(ends[first - 1]) if first else 0
            last = int(np.searchsorted(ends, before + self.limit, side="right"))
            self._fetch(nodes[first:last])
            yield first, last
            first = last

    def missing(self, nodes: Int64Array) -> int:
        """Return how many splats of some nodes would have to be read."""
        return 0 if self.is_resident else int(self.count[nodes[self.start[nodes] < 0]].sum())

    def _fetch(self, nodes: Int64Array) -> None:
        """Read what is not there of some nodes, which fit within the limit together."""
        wanted = nodes[self.start[nodes] < 0]
        needed = int(self.count[wanted].sum())
        if needed == 0:
            return
        if self._used + needed > self.limit:
            self.start[:], self._used, wanted = -1, 0, nodes
            needed = int(self.count[wanted].sum())
        if self._used + needed > self._room:
            self._grow(self._used + needed)

        # Read a part at a time, each behind the last.
        ends = np.cumsum(self.count[wanted])
        first, at_once = 0, BYTES_READ_AT_ONCE // self.width
        while first < len(wanted):
            before = int(ends[first - 1]) if first else 0
            last = max(int(np.searchsorted(ends, before + at_once, side="right")), first + 1)
            rest = Splats(*(array[self._used :] for array in self.splats))
            blocks = self.tree.read_many(wanted[first:last], rest)
            self.start[wanted[first:last]] = self._used + blocks.starts[:-1]
            self._used += int(blocks.starts[-1])
            self.bytes_read += int(blocks.starts[-1]) * self.width
            first = last

    def _grow(self, needed: int) -> None:
        """Make room for more splats; memory is touched only when it is written to."""
        self._room = min(max(needed, 2 * self._room), self.limit)
        larger = self.tree.room(self._room)
        for array, old in zip(larger, self.splats):
            if len(array):
                array[: self._used] = old[: self._used]
        self.splats = larger
