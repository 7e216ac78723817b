"""Decoded splats that are kept: one stretch of memory for many blocks, so that a kernel takes them all in one call.

Within a block the splats are put in passes: every 64th along Morton's curve, then those between them that are every 16th, every
4th, and the rest. So the first ones of all blocks are spread evenly over everything, and a part of each is one range.

Blocks are put one behind the other as they are read. When the next ones do not fit within the limit, everything is forgotten
and what is wanted now is read again: simple, and it costs a reading of one view, not of the tree. A view that is larger than
the limit is handed out in parts, each within it.
"""

from __future__ import annotations

from collections.abc import Iterator
from threading import RLock

import numpy as np

from scanspan.assets.splats.codec import BLOCK, Splats
from scanspan.assets.splats.tree import SplatTree
from scanspan.jit import kernel
from scanspan.records import Array, Int64Array

MAX_BYTES = 384 << 20  # of decoded splats that are kept by default: some 30 million
BYTES_READ_AT_ONCE = 1 << 24  # so that what is read twice for a moment stays small
STRIDES = (64, 16, 4, 1)  # of the passes: half the distance between what is drawn from one to the next


def _make_orders() -> Array:
    """Return (BLOCK + 1, BLOCK) uint8: row n says which splat of a block of n comes at each place."""
    orders = np.zeros((BLOCK + 1, BLOCK), np.uint8)
    place = np.arange(BLOCK)
    first_pass = np.array([next(k for k, stride in enumerate(STRIDES) if i % stride == 0) for i in range(BLOCK)])
    for n in range(BLOCK + 1):
        orders[n, :n] = np.lexsort((place[:n], first_pass[:n]))
    return orders


ORDERS = _make_orders()


def pass_ends(count: Int64Array, number: int) -> Int64Array:
    """Return how many splats of blocks of `count` are drawn after a pass; none before pass 0, which is number -1.

    >>> [pass_ends(np.array([256, 5]), number).tolist() for number in range(-1, 4)]
    [[0, 0], [4, 1], [16, 1], [64, 2], [256, 5]]
    """
    return np.asarray(-(-count // STRIDES[number])) if number >= 0 else np.zeros_like(count)


@kernel
def put_in_passes(orders: Array, starts: Int64Array, source: Splats, out: Splats, first: int) -> None:
    """Copy blocks, each in the order of its passes.

    Shapes  orders: ORDERS; starts: (K + 1,) of the blocks in `source`; out: blocks come one behind the other from `first` on.
    """
    has_color, has_normal = source.color.shape[0] > 0, source.normal.shape[0] > 0
    for b in range(starts.shape[0] - 1):
        begin, count = starts[b], starts[b + 1] - starts[b]
        for i in range(count):
            k, q = np.uint64(begin + orders[count, i]), np.uint64(first + begin + i)
            for c in range(3):
                out.positions[q, c] = source.positions[k, c]
            out.radius[q] = source.radius[k]
            if has_color:
                for c in range(3):
                    out.color[q, c] = source.color[k, c]
            if has_normal:
                out.normal[q] = source.normal[k]


class BlockCache:
    """The decoded blocks of one tree.

    Attributes
    ----------
    count : (M,), how many splats each node has.
    splats : the arrays that hold them.
    start : (M,) int64, the first splat of each node in them; -1 for one that is not there.
    bytes_read : of decoded splats so far, all told.
    lock : to be held while `parts` is walked through, and what it gave is used.
    """

    def __init__(self, tree: SplatTree, max_bytes: int = MAX_BYTES) -> None:
        self.tree, self.lock, self.bytes_read = tree, RLock(), 0
        self.count = tree.nodes["count"]
        self.start = np.full(len(tree.nodes), -1, np.int64)
        self.width = 7 + 3 * tree.has_color + 2 * tree.has_normals
        self.limit = max(max_bytes // self.width, BLOCK)
        self.splats = tree.room(0)
        self._room, self._used = 0, 0

    def parts(self, nodes: Int64Array) -> Iterator[tuple[int, int]]:
        """Give ranges of some nodes, in order, after the splats of each range were read."""
        ends = np.cumsum(self.count[nodes], dtype=np.int64)
        first = 0
        while first < len(nodes):
            before = int(ends[first - 1]) if first else 0
            last = int(np.searchsorted(ends, before + self.limit, side="right"))
            self._fetch(nodes[first:last])
            yield first, last
            first = last

    def missing(self, nodes: Int64Array) -> int:
        """Return how many splats of some nodes would have to be read."""
        return int(self.count[nodes[self.start[nodes] < 0]].sum(dtype=np.int64))

    def _fetch(self, nodes: Int64Array) -> None:
        """Read what is not there of some nodes, which fit within the limit together."""
        wanted = nodes[self.start[nodes] < 0]
        needed = int(self.count[wanted].sum(dtype=np.int64))
        if needed == 0:
            return
        if self._used + needed > self.limit:
            self.start[:], self._used, wanted = -1, 0, nodes
            needed = int(self.count[wanted].sum(dtype=np.int64))
        if self._used + needed > self._room:
            self._grow(self._used + needed)

        # Read a part at a time, each behind the last.
        ends = np.cumsum(self.count[wanted], dtype=np.int64)
        first, at_once = 0, BYTES_READ_AT_ONCE // self.width
        while first < len(wanted):
            before = int(ends[first - 1]) if first else 0
            last = max(int(np.searchsorted(ends, before + at_once, side="right")), first + 1)
            blocks = self.tree.read_many(wanted[first:last])
            put_in_passes(ORDERS, blocks.starts, blocks.splats, self.splats, self._used)
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
