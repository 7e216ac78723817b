"""Points in a hierarchy, drawn coarse and refined, with small differences stored; S0 and S4.

A tree of spheres: each holds its children, and a leaf is a point with a radius that reaches its neighbours. Drawing goes down
until a sphere is small on the screen, so one tree gives a quick coarse picture and then finer ones.

The spheres and their 13 bits are those of the files in the classic format, assets/splats/spheres.py. A node has 16 bits here.
The 48 of the classic node have also a normal, a cone around the normals below it, and a colour.

Source: S0, lines 543-566; S4, lines 704-727. S. Rusinkiewicz and M. Levoy, QSplat (2000).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.splats.spheres import (
    Tree,
    decode_spheres,
    encode_spheres,
    levels,
    sphere_tree,
)
from scanspan.errors import InputError
from scanspan.records import Array, Float64Array, Int64Array

NODE_BITS = {"sphere": 13, "tree": 3, "normal": 14, "cone": 2, "colour": 16}
LIMIT = 1e100


class Encoded(NamedTuple):
    """A tree as it is stored."""

    root: Float64Array  # (4,) x, y, z and radius
    words: Array  # (N,) uint16: 13 bits of sphere, 2 of children, and 1 for whether any of these has children


class Cut(NamedTuple):
    """What to draw."""

    nodes: Int64Array  # whose spheres are drawn, in order
    visited: int  # how many nodes were looked at


def build_tree(points: ArrayLike, radius: float) -> Tree:
    """Return the tree over points: boxes cut at the middle of their longest side, twice for each node.

    Parameters
    ----------
    points : (M, 3), at least one, within 1e100; any number of them may be the same.
    radius : of each leaf, above 1e-100; half the distance of neighbours or more, or gaps are seen.

    Raises
    ------
    InputError : for other points or another radius.

    >>> build_tree([(0, 0, 0), (1, 0, 0), (8, 0, 0), (9, 0, 0), (9, 1, 0)], 0.5).children.tolist()
    [4, 0, 0, 0, 2, 0, 0]
    """
    places = np.asarray(points, np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not len(places):
        raise InputError(f"points has shape {places.shape}: must be (M, 3), with at least one")
    if not (good := (np.abs(places) <= LIMIT).all(axis=1)).all():
        row = int(np.argmin(good))
        raise InputError(f"points[{row}] = {places[row].tolist()}: must be finite and within {LIMIT:g}")
    if not 1 / LIMIT <= radius <= LIMIT:
        raise InputError(f"radius = {radius!r}: must be from {1 / LIMIT:g} to {LIMIT:g}")

    return sphere_tree(places, np.full(len(places), float(radius)))


def averages(tree: Tree, values: ArrayLike) -> Float64Array:
    """Return the mean of values (M, K) of points over the leaves below each node, (N, K)."""
    given, is_leaf, parents = np.asarray(values, np.float64), tree.children == 0, tree.parents
    sums = np.zeros((len(is_leaf), given.shape[1] + 1))
    sums[is_leaf, :-1], sums[is_leaf, -1] = given[tree.points[is_leaf]], 1
    for level in levels(tree.children)[:0:-1]:
        np.add.at(sums, parents[level], sums[level])
    return np.asarray(sums[:, :-1] / sums[:, -1:])


def encode(tree: Tree) -> Encoded:
    """Return a tree as its root and 16 bits a node, each child measured from its parent as decoded.

    >>> encoded = encode(build_tree([(0, 0, 0), (1, 0, 0)], 0.5))
    >>> encoded.words.tolist(), decode(encoded).centres[1:, 0].round(3).tolist()
    ([60962, 54888, 57240], [0.038, 0.962])
    """
    return Encoded(np.array([*tree.centres[0], tree.radii[0]]), encode_spheres(tree))


def decode(encoded: Encoded) -> Tree:
    """Return the tree of spheres that a reader sees; its leaves are numbered as they come."""
    return decode_spheres(encoded.root, encoded.words)


def cut(tree: Tree, scale: ArrayLike, threshold: float) -> Cut:
    """Return the splats to draw: on each way from the root, the first that is a leaf or not wider than a threshold.

    Parameters
    ----------
    tree : spheres, as built or as decoded.
    scale : pixels a unit: one number in a parallel projection, or (N,) one for each node, smaller far away.
    threshold : in pixels; 0 gives all leaves. A smaller one never gives fewer splats.

    >>> tree = build_tree([(0, 0, 0), (1, 0, 0), (8, 0, 0), (9, 0, 0), (9, 1, 0)], 0.5)
    >>> [cut(tree, 10, threshold).nodes.tolist() for threshold in (200, 25, 0)]
    [[0], [1, 2, 3, 4], [1, 2, 3, 5, 6]]
    """
    # Go down a level at a time, from the nodes that are too large to their children.
    is_drawn = (tree.children == 0) | (2 * tree.radii * np.asarray(scale, np.float64) <= threshold)
    firsts, row, found, visited = tree.firsts, np.zeros(1, np.int64), list[Int64Array](), 0
    while len(row):
        visited += len(row)
        found.append(row[is_drawn[row]])
        opened = row[~is_drawn[row]]
        below = firsts[opened, None] + np.arange(4)
        row = below[np.arange(4) < tree.children[opened, None]]
    return Cut(np.sort(np.concatenate(found)), visited)
