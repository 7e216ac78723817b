"""In which order the blocks of a cut are drawn, so that a part of them stands for all.

The blocks follow each other along Morton's curve, so blocks that are near each other are near in that order, and those whose
places are multiples of 64 are spread over the whole; then come those of 16, of 4, and the rest. What is not drawn yet lies in a
sphere, that of the lowest node above it of which something is drawn: no farther than its diameter from something that is seen.

Source: van der Corput, Verteilungsfunktionen (1935), for the order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.geometry.cut import BOUNDED, Cut, NodeColumns, SplatView, node_extent
from scanspan.jit import kernel
from scanspan.records import BoolArray, Int64Array

FIRST_BLOCKS = 16  # that the first pass has at least
MOST_PASSES = 6
STEP = 4  # times as many blocks are drawn after a pass as before it: half the distance between them


class TreeOrder(NamedTuple):
    """What does not depend on the view."""

    parent: Int64Array  # (M,) -1 for the root
    rank: Int64Array  # (M,) how many leaves come before those of a node, depth first


@kernel
def find_order(first_child: Int64Array, children: Int64Array, parent: Int64Array, rank: Int64Array) -> None:
    """Write the parents of nodes, and the number of leaves before each.

    Shapes  all (M,); parent and rank are written.
    Needs   children that stand after their parent.
    """
    total = first_child.shape[0]
    leaves = np.ones(total, np.int64)
    parent[0] = -1
    for node in range(total - 1, -1, -1):
        count = np.int64(0)
        for child in range(first_child[node], first_child[node] + children[node]):
            parent[child] = node
            count += leaves[child]
        if children[node] > 0:
            leaves[node] = count
    rank[0] = 0
    for node in range(total):
        before = rank[node]
        for child in range(first_child[node], first_child[node] + children[node]):
            rank[child] = before
            before += leaves[child]


def tree_order(nodes: NodeColumns) -> TreeOrder:
    """Return the order of the nodes of a tree."""
    order = TreeOrder(np.empty(len(nodes.splats), np.int64), np.empty(len(nodes.splats), np.int64))
    if len(nodes.splats):
        find_order(nodes.first_child, nodes.children, *order)
    return order


def plan_passes(cut: Cut, order: TreeOrder) -> list[Int64Array]:
    """Return the rows of a cut that each pass draws; together they are all rows, once."""
    along = np.argsort(order.rank[cut.nodes], kind="stable")
    count = len(along)
    passes = 1
    while passes < MOST_PASSES and count // STEP**passes >= FIRST_BLOCKS:
        passes += 1
    place = np.arange(count)
    left = np.ones(count, np.bool_)
    planned = []
    for k in range(passes - 1, -1, -1):
        chosen = left & (place % STEP**k == 0)
        left &= ~chosen
        planned.append(np.sort(along[chosen]))
    return planned


@kernel
def largest_gap(
    nodes: NodeColumns, view: SplatView, parent: Int64Array, drawn: Int64Array, missing: Int64Array, marks: BoolArray
) -> float:
    """Return the largest diameter in pixels of the spheres that hold each missing node and something drawn.

    Shapes  parent: (M,); drawn, missing: numbers of nodes; marks: (M,) false, written: what has something drawn below it.
    """
    for i in range(drawn.shape[0]):
        node = drawn[i]
        while node >= 0 and not marks[node]:
            marks[node] = True
            node = parent[node]
    most = 0.0
    for i in range(missing.shape[0]):
        node = missing[i]
        while node >= 0 and not marks[node]:
            node = parent[node]
        if node < 0:
            return np.inf
        most = max(most, node_extent(nodes, view, node, 2.0 * nodes.radius[node]))
    return most


def error_of_part(nodes: NodeColumns, view: SplatView, order: TreeOrder, cut: Cut, drawn: BoolArray) -> float:
    """Return how many pixels something of a cut may lie from what is drawn, where some of its rows (K,) are."""
    marks = np.zeros(len(nodes.splats), np.bool_)
    gap = float(largest_gap(nodes, view, order.parent, cut.nodes[drawn], cut.nodes[~drawn], marks))
    return max(gap, cut.error) if gap < BOUNDED else float(np.inf)
