"""The tables of nodes: as blocks are made, as they are stored, and as they are used.

While a tree grows, a row of BLOCK is written for each block, children before their parents. At the end the nodes are numbered
level by level, so that children follow each other and one number says where they are. Corners are stored as differences to
those of the parents, in steps of the lattice: small whole numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.splats import codec
from scanspan.jit import kernel
from scanspan.records import Array, BoolArray, Float64Array, Int64Array

Table = NDArray[np.void]

_KEPT = [
    ("low", "<i8", 3),  # corner of the box on the lattice; stored: less that of the parent
    ("sphere", "<f8"),
    ("largest", "<f8"),
    ("error", "<f8"),
    ("step", "<i8"),  # steps of the lattice
    ("page", "<u4"),
    ("middle", "<u2", 3),  # steps from the corner to the centre of the ball
    ("start", "<u2"),
    ("axis", "i1", 3),  # parts of 127
    ("sine", "u1"),  # parts of 250, 255: no cone
    ("children", "u1"),
    ("count", "u1"),  # splats less one
]

BLOCK = np.dtype([*_KEPT, ("child", "<u4", 8)])
"""A block while a tree is built, with the numbers of its children among the blocks."""

STORED = np.dtype(_KEPT)
"""A node in a file."""

NODE = np.dtype(
    [
        ("low", "f8", 3),  # a decoded place is tree.origin + low + step * q; q are the whole numbers of the block
        ("step", "f8", 3),
        ("center", "f8", 3),  # of a ball around everything below with the radii of the splats; from tree.origin
        ("radius", "f8"),
        ("splat_radius", "f8"),  # the largest of the block
        ("error", "f8"),  # of a decoded place at most; of a leaf: from the point that was given
        ("cone_axis", "f4", 3),  # every normal below is within the angle of that sine; a sine above 1: nothing is known
        ("cone_sine", "f4"),
        ("first_child", "u4"),  # children follow each other
        ("children", "u1"),  # 0: a leaf
        ("level", "u1"),  # 0 is the root
        ("count", "u2"),  # splats of the block, 1 to 256
        ("first_number", "u8"),  # of its first splat, counted over all nodes in order
        ("page", "u4"),  # where its splats lie
        ("start", "u4"),  # and which of the page is the first
    ]
)
"""The table of nodes: the root first, then level by level; lengths in units of the world."""


def block_rows(whole: Int64Array, real: Float64Array, page: Int64Array, start: Int64Array) -> Table:
    """Return rows of BLOCK from the numbers that the kernels wrote, and where the splats of each block lie."""
    rows = np.zeros(len(whole), BLOCK)
    rows["low"], rows["step"] = whole[:, codec.LOW_X : codec.LOW_X + 3], whole[:, codec.STEP]
    rows["count"], rows["children"] = whole[:, codec.COUNT] - 1, whole[:, codec.CHILDREN]
    rows["child"] = whole[:, codec.CHILD : codec.CHILD + 8]
    rows["middle"] = real[:, codec.MIDDLE_X : codec.MIDDLE_X + 3]
    rows["sphere"], rows["largest"], rows["error"] = real[:, codec.SPHERE], real[:, codec.LARGEST_RADIUS], real[:, codec.ERROR]
    rows["axis"], rows["sine"] = real[:, codec.AXIS_X : codec.AXIS_X + 3], real[:, codec.SINE]
    rows["page"], rows["start"] = page, start
    return rows


@kernel
def number_nodes(children: Array, child: Array, order: Int64Array, parent: Int64Array) -> None:
    """Write the numbers of nodes, level by level.

    Writes      order (M,): which block each node is; parent (M,): of each node, which for the root is 0.
    Units       children (M,), child (M, 8): how many, and which blocks; the root is the last block.
    """
    count = len(children)
    order[0], parent[0] = count - 1, 0
    end = 1
    for node in range(count):
        block = order[node]
        for c in range(children[block]):
            order[end], parent[end] = child[block, c], node
            end += 1


def stored_nodes(blocks: Table) -> Table:
    """Return rows of STORED, numbered level by level, from rows of BLOCK in the order in which they were made."""
    count = len(blocks)
    stored = np.zeros(count, STORED)
    if count == 0:
        return stored
    order, parent = np.empty(count, np.int64), np.empty(count, np.int64)
    number_nodes(blocks["children"], blocks["child"], order, parent)
    for name in STORED.names or ():
        stored[name] = blocks[name][order]
    low = stored["low"].copy()
    stored["low"][1:] -= low[parent[1:]]
    return stored


@kernel
def follow_children(children: Array, first_child: Array, level: Array, low: Int64Array) -> int:
    """Write what follows from the numbers of children, and add up the corners; return the first node that cannot be, or -1.

    Writes      first_child, level (M,); low (M, 3): corners in the place of differences.
    """
    count = len(children)
    end = np.int64(1)
    level[0] = 0
    for node in range(count):
        # The parents of all nodes come before them; else a node has none.
        if node >= end or end + children[node] > count or (children[node] > 0 and level[node] + 1 >= 255):
            return node
        first_child[node] = end if children[node] > 0 else 0
        for child in range(end, end + children[node]):
            level[child] = level[node] + 1
            for axis in range(3):
                low[child, axis] += low[node, axis]
        end += children[node]
    return -1 if end == count else count - 1


def node_table(stored: Table, scale: Float64Array) -> tuple[Table, str]:
    """Return the table of nodes from what is stored, and what is wrong with that, or nothing.

    Parameters
    ----------
    stored : (M,) rows of STORED.
    scale : (3,) a step of the lattice.
    """
    count = len(stored)
    nodes = np.zeros(count, NODE)
    if count == 0:
        return nodes, ""
    low = np.ascontiguousarray(stored["low"])
    wrong = follow_children(stored["children"], nodes["first_child"], nodes["level"], low)
    if wrong >= 0:
        return nodes, f"node {wrong} does not fit among {count} nodes"
    finite: BoolArray = np.isfinite(stored["sphere"]) & np.isfinite(stored["largest"]) & np.isfinite(stored["error"])
    sound = (
        finite
        & (stored["sphere"] >= 0)
        & (stored["largest"] >= 0)
        & (stored["error"] >= 0)
        & (stored["step"] > 0)
        & (stored["step"] < 1 << 44)
    )
    sound &= (np.abs(low) < 1 << 52).all(axis=1) & (stored["children"] <= 8) & (stored["axis"] != 0).any(axis=1)
    if not sound.all():
        return nodes, f"node {int(np.argmin(sound))} has numbers that cannot be"

    nodes["low"], nodes["step"] = low * scale, stored["step"][:, None] * scale
    nodes["center"] = (low + stored["step"][:, None] * stored["middle"]) * scale
    nodes["radius"], nodes["splat_radius"], nodes["error"] = stored["sphere"], stored["largest"], stored["error"]
    axis = stored["axis"].astype(np.float64)
    nodes["cone_axis"] = axis / np.sqrt((axis * axis).sum(axis=1))[:, None]
    nodes["cone_sine"] = np.where(stored["sine"] == codec.NO_SINE, 2.0, stored["sine"] / codec.SINE_UNIT)
    nodes["children"], nodes["count"] = stored["children"], stored["count"].astype(np.uint16) + 1
    nodes["first_number"][1:] = np.cumsum(nodes["count"][:-1], dtype=np.uint64)
    nodes["page"], nodes["start"] = stored["page"], stored["start"]
    return nodes, ""
