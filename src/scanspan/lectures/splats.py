"""Points in a hierarchy, drawn coarse and refined, with small differences stored; S0 and S4.

A tree of spheres: each holds its children, and a leaf is a point with a radius that reaches its neighbours. Drawing goes down
until a sphere is small on the screen, so one tree gives a quick coarse picture and then finer ones.

A child is stored against its parent, in whole steps of a thirteenth of the parent's diameter. Only 7,621 sizes and places can
occur, as a child must fit and meet the parent's ball: 13 bits hold one. Rounding goes outward, so the cube around a decoded
sphere holds the cube around the true one, and no hole opens. A child is measured from its parent as decoded, so errors do not
add up: along each axis, a centre is off by no more than its radius has grown. That is less than 2/13 of the parent's radius
(3/13 in corners, where cubes of one and two steps may have no code and take three), and mostly 1/13 or less. The price: spheres
are larger than they need be.

A node has 16 bits here. The 48 of the classic node have also a normal, a cone around the normals below it, and a colour.

Source: S0, lines 543-566; S4, lines 704-727. S. Rusinkiewicz and M. Levoy, QSplat (2000).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.errors import InputError
from scanspan.records import Array, Float64Array, Int64Array

STEPS = 13
NODE_BITS = {"sphere": 13, "tree": 3, "normal": 14, "cone": 2, "colour": 16}
LIMIT = 1e100
SLACK = 1e-12  # by which a parent is larger, so that a child that touches it from within stays there after rounding


class Tree(NamedTuple):
    """A tree of N spheres, breadth first: node 0 is the root, and the children of a node stand together."""

    centres: Float64Array  # (N, 3)
    radii: Float64Array  # (N,)
    children: Int64Array  # (N,) how many: 0 for a leaf, else 2, 3 or 4
    points: Int64Array  # (N,) which point a leaf is; -1 for others

    @property
    def firsts(self) -> Int64Array:
        """(N,) the first child of each node, if it has any."""
        return np.asarray(1 + np.cumsum(self.children) - self.children)

    @property
    def parents(self) -> Int64Array:
        """(N,) the parent of each node; -1 for the root."""
        return np.concatenate([[-1], np.repeat(np.arange(len(self.children)), self.children)])


class Encoded(NamedTuple):
    """A tree as it is stored."""

    root: Float64Array  # (4,) x, y, z and radius
    words: Array  # (N,) uint16: 13 bits of sphere, 2 of children, and 1 for whether any of these has children


class Cut(NamedTuple):
    """What to draw."""

    nodes: Int64Array  # whose spheres are drawn, in order
    visited: int  # how many nodes were looked at


@cache
def sphere_codes() -> Int64Array:
    """Return all (size, x, y, z) that a child may have, (7621, 4): a cube and its first corner, in steps of the parent's cube.

    Kept are those whose circumscribed ball meets the ball in the parent's cube, decided in whole numbers.

    >>> len(sphere_codes()), sphere_codes()[-1].tolist()
    (7621, [13, 0, 0, 0])
    """
    every = np.stack(np.meshgrid(*[np.arange(STEPS + 1)] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
    size, corner = every[:, 0], every[:, 1:]
    fits = (size > 0) & (corner <= STEPS - size[:, None]).all(axis=1)

    # |c| <= 13 + sqrt(3) size, with c in half steps from the middle: |c|^2 - 13^2 - 3 size^2 <= 26 sqrt(3) size.
    excess = ((size[:, None] + 2 * corner - STEPS) ** 2).sum(axis=1) - STEPS**2 - 3 * size**2
    meets = (excess <= 0) | (excess**2 <= 3 * (2 * STEPS * size) ** 2)
    found: Int64Array = every[fits & meets]
    found.flags.writeable = False
    return found


@cache
def code_numbers() -> Int64Array:
    """Return the number of each code by size, x, y and z; -1 where there is none."""
    numbers = np.full((STEPS + 1, STEPS, STEPS, STEPS), -1)
    numbers[tuple(sphere_codes().T)] = np.arange(len(sphere_codes()))
    return numbers


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

    # Split groups of points, while the list of them grows.
    groups, children = [np.arange(len(places))], list[int]()
    for group in groups:
        parts = split(places, group)
        children.append(len(parts))
        groups += parts
    counts = np.array(children, np.int64)
    leaf = np.array([group[0] for group in groups])
    tree = Tree(places[leaf], np.full(len(groups), float(radius)), counts, np.where(counts == 0, leaf, -1))

    # From the leaves up: the mean of the children's centres, and the farthest that any of them reaches.
    firsts = tree.firsts
    for node in np.flatnonzero(counts)[::-1]:
        below = slice(firsts[node], firsts[node] + counts[node])
        tree.centres[node] = tree.centres[below].mean(axis=0)
        reach = np.sqrt(((tree.centres[below] - tree.centres[node]) ** 2).sum(axis=1)) + tree.radii[below]
        tree.radii[node] = reach.max() * (1 + SLACK)
    return tree


def split(places: Float64Array, group: Int64Array) -> list[Int64Array]:
    """Return the parts of a node, 2 to 4: single points, or the halves of halves; none for a leaf."""
    if len(group) <= 4:
        return [] if len(group) == 1 else [group[k : k + 1] for k in range(len(group))]
    return [part for half in halves(places, group) for part in (halves(places, half) if len(half) > 1 else [half])]


def halves(places: Float64Array, group: Int64Array) -> list[Int64Array]:
    """Return a group cut at the middle of the longest side of its box; points that no cut parts are shared out."""
    inside = places[group]
    low, high = inside.min(axis=0), inside.max(axis=0)
    axis = int(np.argmax(high - low))
    is_low = inside[:, axis] <= (low[axis] + high[axis]) / 2
    if is_low.all() or not is_low.any():
        is_low = np.arange(len(group)) < len(group) // 2
    return [group[is_low], group[~is_low]]


def levels(children: Int64Array) -> list[slice]:
    """Return the nodes of each level, from the root down."""
    found, ends = [slice(0, 1)], np.concatenate([[1], 1 + np.cumsum(children)])
    while found[-1].stop < len(children):
        found.append(slice(found[-1].stop, int(ends[found[-1].stop])))
    return found


def averages(tree: Tree, values: ArrayLike) -> Float64Array:
    """Return the mean of values (M, K) of points over the leaves below each node, (N, K)."""
    given, is_leaf, parents = np.asarray(values, np.float64), tree.children == 0, tree.parents
    sums = np.zeros((len(is_leaf), given.shape[1] + 1))
    sums[is_leaf, :-1], sums[is_leaf, -1] = given[tree.points[is_leaf]], 1
    for level in levels(tree.children)[:0:-1]:
        np.add.at(sums, parents[level], sums[level])
    return np.asarray(sums[:, :-1] / sums[:, -1:])


def place(centres: Float64Array, radii: Float64Array, codes: Int64Array) -> tuple[Float64Array, Float64Array]:
    """Return the spheres that codes (M, 4) mean in parents: the one place where a code becomes numbers."""
    size, corner = codes[:, :1], codes[:, 1:]
    return centres + radii[:, None] * ((size + 2 * corner - STEPS) / STEPS), radii * (size[:, 0] / STEPS)


def quantise(tree: Tree, nodes: slice, centres: Float64Array, radii: Float64Array) -> Int64Array:
    """Return the number of the code of each node, in parents with these decoded centres and radii."""
    # The child's cube in steps of the parent's, rounded outward.
    middle = ((tree.centres[nodes] - centres) / radii[:, None] + 1) * (STEPS / 2)
    half = (tree.radii[nodes] / radii * (STEPS / 2))[:, None]
    low = np.clip(np.floor(middle - half), 0, STEPS - 1).astype(np.int64)
    high = np.clip(np.ceil(middle + half), low + 1, STEPS).astype(np.int64)

    # The longest side is the size. Of the places that hold the cube, take the nearest; where it has no code, the next size.
    size, numbers = (high - low).max(axis=1), np.full(len(middle), -1)
    while (missing := numbers < 0).any():
        length = size[missing, None]
        nearest = np.rint(middle[missing] - length / 2).astype(np.int64)
        corner = np.clip(nearest, np.maximum(high[missing] - length, 0), np.minimum(low[missing], STEPS - length))
        numbers[missing] = code_numbers()[size[missing], corner[:, 0], corner[:, 1], corner[:, 2]]
        size[missing] += 1
    return numbers


def encode(tree: Tree) -> Encoded:
    """Return a tree as its root and 16 bits a node, each child measured from its parent as decoded.

    >>> encoded = encode(build_tree([(0, 0, 0), (1, 0, 0)], 0.5))
    >>> encoded.words.tolist(), decode(encoded).centres[1:, 0].round(3).tolist()
    ([60962, 54888, 57240], [0.038, 0.962])
    """
    count, parents = len(tree.radii), tree.parents
    centres, radii = np.array(tree.centres), np.array(tree.radii)
    numbers = np.full(count, len(sphere_codes()) - 1)
    for level in levels(tree.children)[1:]:
        above = parents[level]
        numbers[level] = quantise(tree, level, centres[above], radii[above])
        centres[level], radii[level] = place(centres[above], radii[above], sphere_codes()[numbers[level]])

    # Children 0, 2, 3 and 4 are 0 to 3; then whether any of them has children, so that a reader need not look.
    has_more = np.isin(np.arange(count), parents[tree.children > 0])
    words = (numbers << 3) | (np.maximum(tree.children - 1, 0) << 1) | has_more
    return Encoded(np.array([*tree.centres[0], tree.radii[0]]), words.astype(np.uint16))


def decode(encoded: Encoded) -> Tree:
    """Return the tree of spheres that a reader sees; its leaves are numbered as they come."""
    words = encoded.words.astype(np.int64)
    children = np.array([0, 2, 3, 4])[(words >> 1) & 3]
    is_leaf = children == 0
    tree = Tree(np.empty((len(words), 3)), np.empty(len(words)), children, np.where(is_leaf, np.cumsum(is_leaf) - 1, -1))
    tree.centres[0], tree.radii[0] = encoded.root[:3], encoded.root[3]
    parents, codes = tree.parents, sphere_codes()[words >> 3]
    for level in levels(children)[1:]:
        above = parents[level]
        tree.centres[level], tree.radii[level] = place(tree.centres[above], tree.radii[above], codes[level])
    return tree


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
