"""The parts of triangulation: the tree of the sweep, crossings found and rounded right, kernels the same however they run."""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction
from itertools import combinations
from math import floor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.geometry import crossings, planar_graph, polygon_sweep, polygon_triangles
from scanspan.geometry.crossings import find_crossings, find_passing
from scanspan.geometry.edge_tree import AFTER, LEFT, LINKS, PARENT, PRIORITY, RIGHT, insert_after, take_out
from scanspan.geometry.noding import NO_POINTS
from scanspan.jit import signature_count

Ends = NDArray[np.int64]


def depth_of(links: NDArray[np.int64], node: int) -> int:
    """Return how deep a tree is."""
    return 1 + max(depth_of(links, int(links[node, side])) for side in (LEFT, RIGHT)) if node else 0


def sorted_nodes(links: NDArray[np.int64]) -> list[int]:
    """Return the nodes in the order of the tree."""

    def walk(node: int) -> list[int]:
        return [*walk(int(links[node, LEFT])), node, *walk(int(links[node, RIGHT]))] if node else []

    return walk(int(links[0, RIGHT]))


def test_the_tree_is_the_list_and_stays_low(rng: np.random.Generator) -> None:
    links, expected = np.zeros((601, LINKS), np.int64), [0]
    for node in range(1, 601):
        place = int(rng.integers(len(expected))) if node % 3 else len(expected) - 1
        insert_after(links, expected[place], node)
        expected.insert(place + 1, node)
        if node % 5 == 0:
            take_out(links, expected.pop(int(rng.integers(1, len(expected)))))
        if node % 40 == 0:
            listed, at = [], int(links[0, AFTER])
            while at:
                listed.append(at)
                at = int(links[at, AFTER])
            assert listed == expected[1:] == sorted_nodes(links)
            for parent in listed:
                for child in (int(links[parent, LEFT]), int(links[parent, RIGHT])):
                    assert child == 0 or (links[child, PARENT] == parent and links[child, PRIORITY] <= links[parent, PRIORITY])
    assert depth_of(links, int(links[0, RIGHT])) < 30
    for node in expected[1:]:
        take_out(links, node)
    assert links[0, RIGHT] == links[0, AFTER] == 0


def random_ends(rng: np.random.Generator, count: int, reach: int) -> Ends:
    """Return edges from their upper to their lower ends, none without a length."""
    ends = rng.integers(-reach, reach + 1, (count, 4))
    ends = ends[(ends[:, :2] != ends[:, 2:]).any(axis=1)]
    is_turned = (ends[:, 1] > ends[:, 3]) | ((ends[:, 1] == ends[:, 3]) & (ends[:, 0] > ends[:, 2]))
    ends[is_turned] = ends[is_turned][:, [2, 3, 0, 1]]
    return ends


def crossing_of(a: list[int], b: list[int]) -> tuple[Fraction, Fraction] | None:
    """Return where two edges cross inside both of them, in rationals."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = a, b
    below = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    if below == 0:
        return None
    t = Fraction((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx), below)
    u = Fraction((cx - ax) * (by - ay) - (cy - ay) * (bx - ax), below)
    return (ax + t * (bx - ax), ay + t * (by - ay)) if 0 < t < 1 and 0 < u < 1 else None


@pytest.mark.parametrize(("count", "reach"), [(40, 6), (120, 40), (160, 3000), (90, 1 << 40)])
def test_all_crossings_are_found_once_and_rounded_right(count: int, reach: int, rng: np.random.Generator) -> None:
    ends = random_ends(rng, count, reach)
    if reach > 1 << 30:
        ends[:3] = [(-reach, -reach, reach, reach), (reach, -reach, -reach, reach), (-reach, -reach, reach - 1, reach)]
    rows, total = find_crossings(ends, NO_POINTS)
    found = sorted((*sorted(row[:2]), *row[2:]) for row in rows[:total].tolist())
    expected = []
    half = Fraction(1, 2)
    for (i, a), (j, b) in combinations(enumerate(ends.tolist()), 2):
        where = crossing_of(a, b)
        if where:
            is_exact = where[0].denominator == where[1].denominator == 1
            expected.append((i, j, int(is_exact), floor(where[0] + half), floor(where[1] + half)))
    assert len(expected) > 50
    assert found == sorted(expected)


@pytest.mark.parametrize(("count", "reach"), [(60, 5), (120, 20), (60, 60)])
def test_all_points_that_edges_pass_are_found(count: int, reach: int, rng: np.random.Generator) -> None:
    ends = random_ends(rng, count, reach)
    points = np.unique(rng.integers(-reach, reach + 1, (4 * count, 2)), axis=0)
    rows, total = find_passing(ends, points)
    expected = []
    for e, (ax, ay, bx, by) in enumerate(ends.tolist()):
        for p, (x, y) in enumerate(points.tolist()):
            if (x, y) in ((ax, ay), (bx, by)):
                continue

            # Clip the edge to the square round the point, times two, which has its left and its upper side.
            low, high, is_open = Fraction(0), Fraction(1), False
            for start, step, centre in ((ax, bx - ax, x), (ay, by - ay, y)):
                near, far = 2 * centre - 1 - 2 * start, 2 * centre + 1 - 2 * start
                if step == 0:
                    is_open |= not near <= 0 < far
                    continue
                times = sorted((Fraction(near, 2 * step), Fraction(far, 2 * step)))
                low, high = max(low, times[0]), min(high, times[1])
            middle = (low + high) / 2
            inside_x = 2 * x - 1 <= 2 * (ax + middle * (bx - ax)) < 2 * x + 1
            inside_y = 2 * y - 1 <= 2 * (ay + middle * (by - ay)) < 2 * y + 1
            if low <= high and not is_open and inside_x and inside_y:
                exact = (bx - ax) * (y - ay) == (by - ay) * (x - ax)
                expected.append((e, p, int(exact)))
    assert len(expected) > 15
    assert sorted(map(tuple, rows[:total, :3].tolist())) == sorted(expected)


def test_edges_that_run_side_by_side_are_not_halved_for_ever() -> None:
    # 600 long edges a few sub-pixels apart, and one across them all.
    step = np.arange(600) * 3
    ends = np.stack([step, np.zeros(600), step + (1 << 30), np.full(600, 1 << 30)], axis=1).astype(np.int64)
    ends = np.concatenate([ends, [(1 << 30, 5, 77, 1 << 30)]])
    assert find_crossings(ends, NO_POINTS)[1] == 600


SCENE = """
import hashlib
import numpy as np
import scanspan as ss
rng, digest = np.random.default_rng(3), hashlib.sha256()
for n in range(6):
    rings = [rng.uniform(0, 60, (6 + n, 2)), rng.integers(0, 12, (7, 2)) * 5.0, rng.uniform(-(2**24), 2**24, (5, 2))]
    rings = rings[: 1 + n % 3]
    for rule in ("even-odd", "non-zero"):
        values = {"height": rng.normal(size=sum(map(len, rings)))}
        mesh = ss.triangulate(rings, rule, subpixel_bits=(16, 8, 4)[n % 3], attributes=values)
        for part in (mesh.positions, mesh.triangles, mesh.inner, mesh.attributes["height"]):
            digest.update(part.tobytes())
        canvas = ss.Canvas(20, 16)
        canvas.polygon(rings, "red", fill_rule=rule, algorithm="flood")
        digest.update(canvas.pixels.tobytes())
print(digest.hexdigest())
"""


def test_plain_python_gives_the_bits_of_the_compiled_kernels() -> None:
    command = [sys.executable, "-W", "error", "-c", SCENE]
    results = [
        subprocess.run(command, env={**os.environ, **extra}, capture_output=True, text=True, check=True).stdout
        for extra in ({}, {"NUMBA_DISABLE_JIT": "1"})
    ]
    assert results[0] == results[1] != ""


def test_kernels_are_compiled_once_whatever_comes() -> None:
    ring: NDArray[Any] = np.array([(0, 0), (9, 9), (9, 0), (0, 9), (4, 7.5)], np.float64)
    strided = np.repeat(ring, 2, axis=0)[::2]
    kinds = [ring, ring.astype(np.float32), np.asfortranarray(ring), ring.tolist(), [ring, ring + 1], strided]
    meshes = [ss.triangulate(kind, "non-zero", subpixel_bits=np.int16(8)) for kind in kinds]
    assert all(np.array_equal(mesh.triangles, meshes[0].triangles) for mesh in (*meshes[1:4], meshes[5]))
    modules = (planar_graph, polygon_sweep, polygon_triangles, crossings)
    kernels = {name: value for module in modules for name, value in vars(module).items() if hasattr(value, "py_func")}
    counted = {name: signature_count(value) for name, value in kernels.items() if "forceinline" not in value.targetoptions}
    assert {"sweep_polygon", "find_crossings", "find_passing", "cut_once"} <= set(counted)
    assert max(counted.values()) == 1
