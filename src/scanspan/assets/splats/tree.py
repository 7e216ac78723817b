"""SplatTree: points in a hierarchy of blocks, coarse at the root, so that what is small on the screen is drawn with few splats.

A node has a block of up to 256 splats. Those of a leaf are points; each of the others stands for about four splats of its
children. Wherever a cut through the tree is drawn (one node on every way from the root to a leaf), the surface is drawn once,
and nothing that is left out is further from what is drawn than `splat_radius`.

The table of nodes is in memory, some 150 bytes for each 140 points. The splats are read when asked for, from memory or a file.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.splats.codec import Splats
from scanspan.assets.splats.nodes import NODE as NODE
from scanspan.assets.splats.pages import make_splats
from scanspan.errors import InputError
from scanspan.jit import kernel
from scanspan.records import Float64Array, Int64Array


class Pages(Protocol):
    """Where splats come from."""

    def page(self, number: int) -> Splats:
        """Return the splats of a page, decoded."""
        ...


class MemoryPages:
    """Pages that lie in memory."""

    def __init__(self, pages: list[Splats]) -> None:
        self.pages = pages

    def page(self, number: int) -> Splats:
        """Return a page."""
        return self.pages[number]


class Blocks(NamedTuple):
    """The splats of K nodes, one after the other."""

    starts: Int64Array  # (K + 1,) the first of each node, and the number of all
    splats: Splats


@kernel
def copy_blocks(chosen: Int64Array, begin: Int64Array, starts: Int64Array, page: Splats, out: Splats) -> None:
    """Copy the blocks of some nodes from a page to their places.

    Units       chosen: which of the nodes lie on this page; begin: where in the page each begins; starts: where in `out` each
                goes, and the next one.
    """
    for c in range(len(chosen)):
        k = chosen[c]
        source, place, count = begin[k], starts[k], starts[k + 1] - starts[k]
        for i in range(count):
            out.positions[place + i, 0] = page.positions[source + i, 0]
            out.positions[place + i, 1] = page.positions[source + i, 1]
            out.positions[place + i, 2] = page.positions[source + i, 2]
            out.radius[place + i] = page.radius[source + i]
        if len(out.color):
            for i in range(count):
                out.color[place + i, 0] = page.color[source + i, 0]
                out.color[place + i, 1] = page.color[source + i, 1]
                out.color[place + i, 2] = page.color[source + i, 2]
        if len(out.normal):
            for i in range(count):
                out.normal[place + i] = page.normal[source + i]


class SplatTree:
    """Points in a hierarchy, made by `scanspan.splat.build` or read by `scanspan.splat.open`.

    Attributes
    ----------
    nodes : (M,) structured, see NODE: the root first, children after their parents; no node at all in an empty tree.
    origin : (3,) float64, what places are relative to.
    has_color, has_normals : whether splats have these.
    lattice : offset, scale and base, (3,) each: a place is offset + scale * (base + n) for whole numbers n. A cloud of whole
        numbers with a scale and an offset keeps them, and base + n are its numbers where the step is one.
    """

    nodes: NDArray[np.void]
    origin: Float64Array
    has_color: bool
    has_normals: bool
    lattice: tuple[Float64Array, Float64Array, Int64Array]

    def __init__(self, nodes: NDArray[np.void], origin: Float64Array, pages: Pages, has_color: bool, has_normals: bool) -> None:
        self.nodes = nodes
        self.origin = origin
        self.has_color = has_color
        self.has_normals = has_normals
        self._pages = pages
        self.lattice = origin, np.ones(3), np.zeros(3, np.int64)

    def __repr__(self) -> str:
        points, nodes, levels = self.point_count, len(self.nodes), self.level_count
        return f"SplatTree({points:,} points, {nodes:,} nodes, {levels} levels)"

    @property
    def is_leaf(self) -> NDArray[np.bool_]:
        """(M,) whether a node has no children."""
        return np.asarray(self.nodes["children"] == 0)

    @property
    def point_count(self) -> int:
        """The number of points, which are the splats of leaves."""
        return int(self.nodes["count"][self.is_leaf].sum(dtype=np.int64))

    @property
    def splat_count(self) -> int:
        """The number of splats of all nodes."""
        return int(self.nodes["count"].sum(dtype=np.int64))

    @property
    def level_count(self) -> int:
        """The number of levels, 0 if there are no points."""
        return int(self.nodes["level"].max()) + 1 if len(self.nodes) else 0

    @property
    def bounds(self) -> Float64Array:
        """(2, 3) a box that holds every point with its radius; of an empty tree, the origin."""
        if len(self.nodes) == 0:
            return np.array([self.origin, self.origin])
        root = self.nodes[0]
        return np.array([self.origin + root["center"] - root["radius"], self.origin + root["center"] + root["radius"]])

    def verify(self) -> None:
        """Read everything once.

        Raises
        ------
        FormatError : the file was damaged; the message names the place.
        """
        for number in np.unique(self.nodes["page"]).tolist():
            self._pages.page(number)

    def read(self, node: int) -> Splats:
        """Return the splats of one node; the arrays may be parts of larger ones and must not be written to."""
        nodes = np.asarray([node])
        return self.read_many(nodes).splats

    def room(self, count: int) -> Splats:
        """Return arrays for `count` splats of this tree, for `read_many`."""
        return make_splats(count, self.has_color, self.has_normals)

    def read_many(self, nodes: ArrayLike, out: Splats | None = None) -> Blocks:
        """Return the splats of some nodes, those of a node together.

        Parameters
        ----------
        nodes : (K,) numbers of nodes, in any order.
        out : arrays to write to, from the first row on; by default new ones that are just large enough.

        Raises
        ------
        InputError : a node that is not in the tree, or too little room.
        """
        wanted = np.asarray(nodes, np.int64).reshape(-1)
        if len(wanted) and (wanted.min() < 0 or wanted.max() >= len(self.nodes)):
            wrong = wanted[(wanted < 0) | (wanted >= len(self.nodes))][0]
            raise InputError(f"expected nodes from 0 to {len(self.nodes) - 1}, got {wrong}")
        starts = np.zeros(len(wanted) + 1, np.int64)
        np.cumsum(self.nodes["count"][wanted], out=starts[1:])
        total = int(starts[-1])
        splats = self.room(total) if out is None else out
        if len(splats.radius) < total:
            raise InputError(f"expected room for {total} splats, got room for {len(splats.radius)}")

        # Copy page by page, so that each is fetched once.
        pages, begin = self.nodes["page"][wanted], self.nodes["start"][wanted].astype(np.int64)
        order = np.argsort(pages, kind="stable")
        ends = np.append(np.flatnonzero(np.diff(pages[order])) + 1, len(order)) if len(order) else np.empty(0, np.int64)
        first = 0
        for end in ends.tolist():
            chosen = order[first:end]
            copy_blocks(chosen, begin, starts, self._pages.page(int(pages[chosen[0]])), splats)
            first = end
        return Blocks(starts, splats)
