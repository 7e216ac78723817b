"""Splats in a hierarchy: which differences there are, that rounding goes outward and adds nothing up, and what a cut covers."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from scanspan.assets.splats import spheres
from scanspan.errors import InputError
from scanspan.lectures import splats
from scanspan.lectures.splats import Tree
from scanspan.records import Float64Array, Int64Array

# How much a sum of a few float64 may be off, as a share of the largest number in it.
ROUNDING = 1e-13


def clouds() -> dict[str, tuple[Float64Array, float]]:
    """Return points and radii: on a surface, in a body, very uneven, all the same, on a line, and few."""
    rng = np.random.default_rng(122)
    ball = rng.normal(size=(3000, 3))
    clusters = rng.uniform(-1, 1, (60, 1, 3)) + rng.uniform(-1e-4, 1e-4, (60, 20, 3))
    return {
        "surface": (ball / np.linalg.norm(ball, axis=1)[:, None], 0.03),
        "body": (rng.uniform(-1, 1, (1000, 3)) + 1000, 0.01),
        "uneven": (rng.uniform(-1, 1, (1500, 3)) ** 9, 1e-5),
        "clusters": (clusters.reshape(-1, 3), 1e-5),
        "the same": (np.full((70, 3), 0.3), 0.1),
        "a line": (rng.uniform(-1, 1, (300, 1)) * (1, 0, 0), 1e-3),
        "five": (np.array([(0, 0, 0), (1, 0, 0), (8, 0, 0), (9, 0, 0), (9, 1, 0)], np.float64), 0.5),
        "one": (np.array([(1.0, 2.0, 3.0)]), 2.0),
    }


CLOUDS = clouds()
TREES = {name: splats.build_tree(*cloud) for name, cloud in CLOUDS.items()}


def leaves_below(tree: Tree, node: int) -> list[int]:
    """Return the leaves below a node, or itself."""
    found, waiting = [], [node]
    while waiting:
        node = waiting.pop()
        waiting += range(tree.firsts[node], tree.firsts[node] + tree.children[node])
        found += [node] if tree.children[node] == 0 else []
    return found


def faults_of_code(tree: Tree, seen: Tree) -> list[str]:
    """Return what is wrong with decoded spheres."""
    unit = ROUNDING * (np.abs(tree.centres).max() + tree.radii[0])
    above = seen.radii[np.maximum(tree.parents, 0)]
    growth = seen.radii - tree.radii
    off = np.abs(seen.centres - tree.centres).max(axis=1)
    size = spheres.sphere_codes()[np.asarray(splats.encode(tree).words, np.int64) >> 3, 0]
    faults = {
        "a radius has shrunk": growth < -unit,
        "a cube sticks out": off + tree.radii > seen.radii + unit,
        "a centre is off by 3/13": off >= 3 / 13 * above + unit,
        "a centre is off by 2/13, and no corner made it so": (off >= 2 / 13 * above + unit) & (size != 3),
    }
    return [name for name, wrong in faults.items() if wrong.any()]


def test_there_are_7621_codes_and_none_is_missing() -> None:
    codes = spheres.sphere_codes()
    counts = np.bincount(codes[:, 0])
    assert len(codes) == 7621 < 2**13
    assert counts[1:].tolist() == [1617, 1648, 1331, 1000, 729, 512, 343, 216, 125, 64, 27, 8, 1]
    assert sum(k**3 for k in range(1, 14)) == 8281

    # By the formula, with 3 as the square of the square root: a + b sqrt(3) >= 0 in fractions.
    for size in (1, 2, 3):
        found = 0
        for corner in itertools.product(range(14 - size), repeat=3):
            square = sum(Fraction(size + 2 * k - 13, 13) ** 2 for k in corner)
            a, b = 1 + 3 * Fraction(size, 13) ** 2 - square, 2 * Fraction(size, 13)
            found += a >= 0 or a * a <= 3 * b * b
        assert found == counts[size]


@pytest.mark.parametrize("name", CLOUDS)
def test_a_tree_holds_every_point_once_and_parents_hold_their_children(name: str) -> None:
    (points, radius), tree = CLOUDS[name], TREES[name]
    is_leaf = tree.children == 0
    assert sorted(tree.points[is_leaf]) == list(range(len(points)))
    assert (tree.points[~is_leaf] == -1).all()
    assert np.array_equal(tree.centres[is_leaf], points[tree.points[is_leaf]])
    assert (tree.radii[is_leaf] == radius).all()
    assert set(tree.children) <= {0, 2, 3, 4}

    # Breadth first: children follow each other from node 1 on, and lie in their parents.
    parents = tree.parents[1:]
    assert (np.diff(parents) >= 0).all()
    assert np.array_equal(tree.firsts[parents], np.searchsorted(parents, parents) + 1)
    reach = np.linalg.norm(tree.centres[1:] - tree.centres[parents], axis=1) + tree.radii[1:]
    assert (reach <= tree.radii[parents] * (1 + ROUNDING)).all()


def test_boxes_are_cut_at_the_middle_of_their_longest_side() -> None:
    points = np.array([(x, y, 0) for x in (0, 1, 2, 6, 7, 100) for y in (0, 1)], np.float64)
    tree = splats.build_tree(points, 0.1)
    below = [sorted(set(points[tree.points[leaves_below(tree, node)], 0])) for node in range(1, 1 + tree.children[0])]
    assert below == [[0, 1, 2], [6, 7], [100], [100]]


def test_points_that_no_cut_parts_are_shared_out() -> None:
    tree = TREES["the same"]
    assert len(splats.levels(tree.children)) == 5
    assert np.allclose(tree.radii, 0.1, rtol=1e-10)
    apart = splats.build_tree([(1.0, 0, 0), (np.nextafter(1.0, 2), 0, 0)] * 5, 0.1)
    assert (apart.children == 0).sum() == 10


@pytest.mark.parametrize("name", CLOUDS)
def test_decoded_spheres_are_never_smaller_and_errors_do_not_add_up(name: str) -> None:
    tree = TREES[name]
    encoded = splats.encode(tree)
    seen = splats.decode(encoded)
    assert encoded.words.dtype == np.uint16
    assert np.array_equal(seen.children, tree.children)
    assert np.array_equal(seen.points[seen.children == 0], np.arange((seen.children == 0).sum()))
    assert (seen.centres[0].tolist(), seen.radii[0]) == (tree.centres[0].tolist(), tree.radii[0])
    assert faults_of_code(tree, seen) == []

    # The last bit tells whether there is a grandchild.
    assert set(np.flatnonzero(encoded.words & 1)) == set(tree.parents[1:][tree.children[1:] > 0])


def test_most_centres_are_off_by_half_a_step() -> None:
    tree = TREES["surface"]
    seen = splats.decode(splats.encode(tree))
    off = np.abs(seen.centres - tree.centres).max(axis=1)[1:] / seen.radii[tree.parents[1:]]
    assert (off <= 1 / 13 + ROUNDING).mean() > 0.99


def test_corners_without_a_code_take_three_steps() -> None:
    # Small spheres in all corners of the cube around a sphere: further out than a code of one or two steps reaches.
    for sign in itertools.product((-1, 1), repeat=3):
        tree = Tree(
            np.array([(0, 0, 0), sign, (0, 0, 0)]) * 0.9999, np.array([1, 1e-5, 0.5]), np.array([2, 0, 0]), np.arange(3)
        )
        word = int(splats.encode(tree).words[1])
        assert spheres.sphere_codes()[word >> 3].tolist() == [3, *(10 * (k > 0) for k in sign)]
        assert faults_of_code(tree, splats.decode(splats.encode(tree))) == []


def test_planted_faults_in_the_code_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    tree, honest = TREES["surface"], spheres.quantise
    assert faults_of_code(tree, splats.decode(splats.encode(tree))) == []

    # Children measured from their true parents instead of the decoded ones: errors add up.
    def measured_from_the_truth(tree: Tree, nodes: slice, centres: Float64Array, radii: Float64Array) -> Int64Array:
        above = tree.parents[nodes]
        return honest(tree, nodes, tree.centres[above], tree.radii[above])

    with monkeypatch.context() as patch:
        patch.setattr(spheres, "quantise", measured_from_the_truth)
        assert "a cube sticks out" in faults_of_code(tree, splats.decode(splats.encode(tree)))

    # Rounding to the nearest step instead of outward.
    with monkeypatch.context() as patch:
        patch.setattr(spheres.np, "ceil", np.rint)
        planted = splats.encode(tree)
    assert {"a radius has shrunk", "a cube sticks out"} <= set(faults_of_code(tree, splats.decode(planted)))


def faults_of_cut(tree: Tree, nodes: Int64Array) -> list[str]:
    """Return what is wrong with the nodes of a cut: each leaf must lie below one of them, and one only."""
    covered = np.zeros(len(tree.radii), np.int64)
    for node in nodes:
        covered[leaves_below(tree, int(node))] += 1
    is_leaf = tree.children == 0
    return ["a leaf is missing"] * bool((covered[is_leaf] == 0).any()) + ["one is over another"] * bool((covered > 1).any())


@pytest.mark.parametrize("name", ["clusters", "five", "the same", "one"])
@pytest.mark.parametrize("is_decoded", [False, True])
def test_every_cut_covers_each_leaf_once_and_finer_ones_have_more(name: str, is_decoded: bool) -> None:
    tree = splats.decode(splats.encode(TREES[name])) if is_decoded else TREES[name]
    away = 50 / (3 - np.clip(tree.centres[:, 2], -2, 2))
    for scale in (40.0, away):
        last, visited = 0, 0
        for threshold in (1e9, 100, 30, 10, 3, 1, 0.1, 0):
            found = splats.cut(tree, scale, threshold)
            assert faults_of_cut(tree, found.nodes) == []
            drawn = np.isin(np.arange(len(tree.radii)), found.nodes)
            wide = 2 * tree.radii * scale > threshold
            assert not (drawn & wide & (tree.children > 0)).any()
            assert len(found.nodes) >= last
            assert found.visited >= max(visited, len(found.nodes))
            last, visited = len(found.nodes), found.visited
        assert last == (tree.children == 0).sum()
        assert visited == len(tree.radii)
    assert splats.cut(tree, 1.0, 1e9).nodes.tolist() == [0]


def test_planted_faults_in_a_cut_are_found() -> None:
    tree = TREES["five"]
    nodes = splats.cut(tree, 10, 25).nodes
    assert faults_of_cut(tree, nodes) == []
    assert faults_of_cut(tree, nodes[1:]) == ["a leaf is missing"]
    assert faults_of_cut(tree, np.array([0, 2])) == ["one is over another"]


@pytest.mark.parametrize("name", ["surface", "the same", "one"])
def test_averages_are_means_over_the_leaves_below(name: str) -> None:
    (points, _), tree = CLOUDS[name], TREES[name]
    found = splats.averages(tree, points)
    for node in range(0, len(found), 97):
        assert np.allclose(found[node], points[tree.points[leaves_below(tree, node)]].mean(axis=0))


def test_a_classic_node_has_48_bits() -> None:
    assert sum(splats.NODE_BITS.values()) == 48
    assert splats.NODE_BITS["sphere"] + splats.NODE_BITS["tree"] == 16


@pytest.mark.parametrize(
    ("points", "radius", "message"),
    [
        ([(0, 0)], 1, r"^points has shape \(1, 2\): must be \(M, 3\), with at least one$"),
        (np.zeros((0, 3)), 1, r"^points has shape \(0, 3\): must be \(M, 3\), with at least one$"),
        ([(0, 0, 0), (0, np.nan, 0)], 1, r"^points\[1\] = \[0.0, nan, 0.0\]: must be finite and within 1e\+100$"),
        ([(0, 0, 0)], 0.0, r"^radius = 0.0: must be from 1e-100 to 1e\+100$"),
        ([(0, 0, 0)], float("nan"), r"^radius = nan: must be from 1e-100 to 1e\+100$"),
    ],
)
def test_points_that_cannot_be_used(points: object, radius: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        splats.build_tree(points, radius)  # type: ignore[arg-type]


def test_the_largest_and_smallest_numbers_are_taken() -> None:
    points = [(1e100, -1e100, 0), (-1e100, 1e100, 1e100), (0, 0, 0), (1e-100, 0, 0), (1e-90, 0, 0), (1, 1, 1)]
    tree = splats.build_tree(points, 1e-100)
    seen = splats.decode(splats.encode(tree))
    assert np.isfinite(seen.centres).all()
    assert faults_of_code(tree, seen) == []
