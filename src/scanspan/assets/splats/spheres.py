"""Trees of spheres and the classic way to store them: a child in steps of a thirteenth of its parent, 13 bits for one.

A child is stored against its parent, in whole steps of a thirteenth of the parent's diameter. Only 7,621 sizes and places can
occur, as a child must fit and meet the parent's ball: 13 bits hold one. Rounding goes outward, so the cube around a decoded
sphere holds the cube around the true one, and no hole opens. A child is measured from its parent as decoded, so errors do not
add up: along each axis, a centre is off by no more than its radius has grown. That is less than 2/13 of the parent's radius
(3/13 in corners, where cubes of one and two steps may have no code and take three), and mostly 1/13 or less. The price is that
spheres are larger than they need be.

Source: S. Rusinkiewicz and M. Levoy, "QSplat: a multiresolution point rendering system for large meshes", 2000, section 3.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Float64Array, Int64Array, Integer

STEPS = 13
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


def sphere_tree(places: Float64Array, radii: Float64Array) -> Tree:
    """Return the tree over points: boxes cut at the middle of their longest side, twice for each node.

    Parameters
    ----------
    places : (M, 3), at least one, finite and within 1e100; any number of them may be the same.
    radii : (M,) of the leaves, above 0.
    """
    count = len(places)
    order, scratch = np.arange(count), np.empty(count, np.int64)
    starts, stops, children = (np.empty(2 * count, np.int64) for _ in range(3))
    nodes = int(split_points(np.require(places, np.float64, ["C", "A", "W"]), order, scratch, starts, stops, children))
    leaf, counts = order[starts[:nodes]], children[:nodes].copy()
    tree = Tree(places[leaf], radii[leaf].astype(np.float64), counts, np.where(counts == 0, leaf, -1))

    # From the leaves up: the mean of the children's centres, and the farthest that any of them reaches.
    for level, below, begins in reversed(families(counts)):
        inner = level.start + np.flatnonzero(counts[level])
        tree.centres[inner] = np.add.reduceat(tree.centres[below], begins, axis=0) / counts[inner, None]
        offsets = tree.centres[below] - np.repeat(tree.centres[inner], counts[inner], axis=0)
        reach = np.sqrt((offsets**2).sum(axis=1)) + tree.radii[below]
        tree.radii[inner] = np.maximum.reduceat(reach, begins) * (1 + SLACK)
    return tree


@kernel
def split_points(
    places: Float64Array, order: Int64Array, scratch: Int64Array, starts: Int64Array, stops: Int64Array, children: Int64Array
) -> Integer:
    """Sort row numbers into nodes, breadth first, and return how many there are; a node has order[starts:stops]."""
    starts[0], stops[0] = 0, len(order)
    node, count = np.int64(0), np.int64(1)
    while node < count:
        first, last, before = starts[node], stops[node], count
        if 1 < last - first <= 4:
            for k in range(first, last):
                starts[count], stops[count] = k, k + 1
                count += 1
        elif last - first > 4:
            middle = halve(places, order, scratch, first, last)
            for half in range(2):
                low, high = (first, middle) if half == 0 else (middle, last)
                cut = halve(places, order, scratch, low, high) if high - low > 1 else high
                starts[count], stops[count] = low, cut
                count += 1
                if cut < high:
                    starts[count], stops[count] = cut, high
                    count += 1
        children[node] = count - before
        node += 1
    return count


@helper_kernel
def halve(places: Float64Array, order: Int64Array, scratch: Int64Array, first: Integer, last: Integer) -> Integer:
    """Cut a group at the middle of the longest side of its box and return where the second part begins.

    The order in both parts is kept; points that no cut parts are shared out.
    """
    axis, middle, longest = 0, 0.0, -1.0
    for k in range(3):
        low = places[order[first], k]
        high = low
        for row in range(first, last):
            low = min(low, places[order[row], k])
            high = max(high, places[order[row], k])
        if high - low > longest:
            axis, middle, longest = k, (low + high) / 2, high - low

    # Move those on the low side to the front, and the others behind them.
    ahead, behind = first, np.int64(0)
    for row in range(first, last):
        point = order[row]
        if places[point, axis] <= middle:
            order[ahead] = point
            ahead += 1
        else:
            scratch[behind] = point
            behind += 1
    for row in range(behind):
        order[ahead + row] = scratch[row]
    return ahead if first < ahead < last else first + (last - first) // 2


def levels(children: Int64Array) -> list[slice]:
    """Return the nodes of each level, from the root down."""
    found, ends = [slice(0, 1)], np.concatenate([[1], 1 + np.cumsum(children)])
    while found[-1].stop < len(children):
        found.append(slice(found[-1].stop, int(ends[found[-1].stop])))
    return found


def families(children: Int64Array) -> list[tuple[slice, slice, Int64Array]]:
    """Return each level that has children, the level of these, and where in it each family begins."""
    every = levels(children)
    found = []
    for level, below in pairwise(every):
        counts = children[level][children[level] > 0]
        found.append((level, below, np.cumsum(counts) - counts))
    return found


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


def encode_spheres(tree: Tree) -> Array:
    """Return 16 bits a node, each child measured from its parent as decoded.

    13 bits of sphere, 2 of children (0, 2, 3, 4 as 0 to 3), and 1 for whether any of these has children, so that a reader need
    not look. The root's sphere, which these words do not hold, has the last code.
    """
    parents = tree.parents
    centres, radii = np.array(tree.centres), np.array(tree.radii)
    numbers = np.full(len(tree.radii), len(sphere_codes()) - 1)
    for level in levels(tree.children)[1:]:
        above = parents[level]
        numbers[level] = quantise(tree, level, centres[above], radii[above])
        centres[level], radii[level] = place(centres[above], radii[above], sphere_codes()[numbers[level]])
    words = (numbers << 3) | (np.maximum(tree.children - 1, 0) << 1) | has_grandchildren(tree)
    return words.astype(np.uint16)


def has_grandchildren(tree: Tree) -> Int64Array:
    """Return 1 for each node with a child that has children."""
    found = np.zeros(len(tree.children), np.int64)
    found[tree.parents[1:][tree.children[1:] > 0]] = 1
    return found


def decode_spheres(root: Float64Array, words: Array) -> Tree:
    """Return the tree of spheres that words mean below a root (x, y, z, radius); its leaves are numbered as they come."""
    bits = words.astype(np.int64)
    children = np.array([0, 2, 3, 4])[(bits >> 1) & 3]
    is_leaf = children == 0
    tree = Tree(np.empty((len(bits), 3)), np.empty(len(bits)), children, np.where(is_leaf, np.cumsum(is_leaf) - 1, -1))
    tree.centres[0], tree.radii[0] = root[:3], root[3]
    parents, codes = tree.parents, sphere_codes()[bits >> 3]
    for level in levels(children)[1:]:
        above = parents[level]
        tree.centres[level], tree.radii[level] = place(tree.centres[above], tree.radii[above], codes[level])
    return tree
