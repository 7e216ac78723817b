"""Clouds for tests of trees of splats, and what holds for every tree, checked against the points that it was made from."""

from __future__ import annotations

from typing import Any

import numpy as np

from scanspan.assets.splats.codec import decode_normals
from scanspan.assets.splats.tree import SplatTree
from scanspan.records import Array, Float64Array, Int64Array


def ball(count: int, seed: int = 1) -> dict[str, Array]:
    """Return numbered points on a ball, with outward normals."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return {"positions": 7.0 * normals, "color": numbered(count), "normals": normals}


def hard(count: int = 3000) -> dict[str, Array]:
    """Return numbered points of which many lie at one place, many closer than the codes can tell, and one far away."""
    rng = np.random.default_rng(5)
    positions = np.vstack(
        [
            rng.random((count, 3)),
            np.full((count, 3), 0.3),
            0.7 + rng.random((count, 3)) * 1e-4,
            np.repeat(rng.random((20, 3)), 10, axis=0),
            2.0 ** -np.arange(60)[:, None] * [1.0, 0.5, 0.25],
            [[1e6, -1e6, 3.0]],
        ]
    )
    rng.shuffle(positions)
    return {"positions": positions, "color": numbered(len(positions))}


def decoded(tree: SplatTree, nodes: Array) -> tuple[Int64Array, Float64Array, Float64Array, Any]:
    """Return the node, the place from the origin, and the radius of each splat of some nodes, and their blocks."""
    blocks = tree.read_many(nodes)
    table = tree.nodes
    number = np.repeat(nodes, table["count"][nodes])
    places = table["low"][number] + table["step"][number] * blocks.splats.positions
    return number, places, blocks.splats.radius / 255.0 * table["splat_radius"][number], blocks.splats


def parents(tree: SplatTree) -> Int64Array:
    """Return the parent of each node, -1 for the root."""
    found = np.full(len(tree.nodes), -1)
    for node, (first, count) in enumerate(zip(tree.nodes["first_child"].tolist(), tree.nodes["children"].tolist())):
        assert (found[first : first + count] == -1).all()
        found[first : first + count] = node
    assert (found[1:] >= 0).all()
    assert (found[1:] < np.arange(1, len(found))).all()
    return found


def check_tree(tree: SplatTree, cloud: dict[str, Array]) -> None:
    """Check all that is promised of a tree."""
    table = tree.nodes
    parent = parents(tree)
    children = table["children"]
    assert not (children == 1).any()
    assert (table["level"][1:] == table["level"][parent[1:]] + 1).all()
    assert table["level"][0] == 0
    assert (table["first_number"] == np.cumsum(table["count"]) - table["count"]).all()
    assert 1 <= table["count"].min() <= table["count"].max() <= 256
    assert tree.point_count == len(cloud["positions"])

    # The ball of a node holds the balls of all splats at and below it.
    number, places, radii, splats = decoded(tree, np.arange(len(table)))
    own = number
    while len(number):
        distance = np.linalg.norm(places - table["center"][number], axis=1) + radii
        assert (distance <= table["radius"][number] * (1 + 1e-12)).all()
        keep = parent[number] >= 0
        number, places, radii = parent[number[keep]], places[keep], radii[keep]

    # Splats below are in the ball of one of the splats above, so that what is left out is within its radius of what is drawn.
    _, places, radii, _ = decoded(tree, np.arange(len(table)))
    for node in np.flatnonzero(children).tolist()[:40]:
        first = int(table["first_child"][node])
        below = (own >= first) & (own < first + int(children[node]))
        gap = np.linalg.norm(places[below][:, None] - places[own == node][None], axis=2) + radii[below][:, None]
        assert (gap <= radii[own == node][None] * (1 + 1e-9)).any(axis=1).all()

    check_points(tree, cloud["positions"])
    if "normals" in cloud:
        check_cones(tree, parent, own, splats.normal)


def numbered(count: int) -> Array:
    """Return a colour for each of some points, that no other has."""
    number = np.arange(count)
    return np.column_stack([number >> 16, number >> 8 & 255, number & 255]).astype(np.uint8)


def check_points(tree: SplatTree, positions: Array) -> None:
    """Check that each of some numbered points is in one leaf, no further from its place than the leaf says."""
    number, places, _, splats = decoded(tree, np.flatnonzero(tree.is_leaf))
    point = splats.color.astype(np.int64) @ [1 << 16, 1 << 8, 1]
    assert np.array_equal(np.sort(point), np.arange(len(positions)))
    distance = np.linalg.norm(places + tree.origin - positions[point], axis=1)
    assert (distance <= tree.nodes["error"][number]).all()


def check_cones(tree: SplatTree, parent: Int64Array, own: Int64Array, codes: Array) -> None:
    """Check that the cone of each node holds the normals of all points below it."""
    table = tree.nodes
    normals = np.empty((len(codes), 3))
    decode_normals(codes, normals)
    is_point = tree.is_leaf[own]
    number, normals = own[is_point], normals[is_point]
    while len(number):
        along = (normals * table["cone_axis"][number]).sum(axis=1)
        sine = table["cone_sine"][number]
        off = np.sqrt(np.maximum(1.0 - along * along, 0.0))
        assert ((sine > 1) | ((along > 0) & (off <= sine))).all()
        keep = parent[number] >= 0
        number, normals = parent[number[keep]], normals[keep]
