"""Triangles painted straight from their corners: every size class against the exact oracle, and both ways to shade alike."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.bands import run_bands
from scanspan.target import gouraud, planes, triangles
from tests import exact

Floats = NDArray[np.float64]
SIZE = (150, 60)
RULES = ["top-left", "bottom-left", "inclusive", "exclusive", ss.OffscreenPoint(-41.25, 13.0625), ss.OffscreenPoint(0, 1, 0)]


def classes(rng: np.random.Generator) -> Floats:
    """Return triangles of all size classes, about as wide as vectors and classes are, in, about and far from the image."""
    found = []
    for across in (0.4, 2, 8, 15.9, 16.1, 31, 33, 63, 64, 65, 90, 300, 4000, 3e5, 1e7):
        for down in (0.6, 5, 40, across):
            corner = rng.uniform(-0.5, 1.0, 2) * (SIZE[0], SIZE[1]) - rng.uniform(0, 0.7, 2) * (across, down)
            box = np.array([(0, 0), (1, rng.uniform()), (rng.uniform(), 1)])[rng.permutation(3)]
            found.append(corner + np.where(rng.random(2) < 0.5, box, 1 - box) * (across, down))
    lattice = np.round(np.array(found[:40]) * 2) / 2
    return np.clip(np.concatenate([found, lattice, lattice[:, ::-1]]), -(2**24), 2**24)


def shown(vertices: Floats, **options: Any) -> NDArray[np.int64]:
    """Return the number of the last triangle that covers each pixel, from 1 on, by the oracle."""
    named = {**options, "rule": options["rule"]}
    if isinstance(named["rule"], ss.OffscreenPoint):
        named["rule"] = SimpleNamespace(x=named["rule"].x, y=named["rule"].y, w=named["rule"].w)
    inside = exact.coverage(vertices, SIZE, **named)
    return np.asarray((inside * np.arange(1, len(vertices) + 1)[:, None, None]).max(axis=0))


def painted(vertices: Floats, threads: int = 1, **options: Any) -> NDArray[np.int64]:
    """Return the same from a canvas, with numbers as colours."""
    numbers = np.arange(1, len(vertices) + 1)
    canvas = ss.Canvas(*SIZE, (0, 0, 0), threads=threads)
    canvas.triangles(vertices, np.stack([numbers & 255, numbers >> 8, np.zeros_like(numbers)], axis=1), **options)
    return np.asarray(canvas.pixels[..., 0] + 256 * canvas.pixels[..., 1].astype(np.int64))


@pytest.mark.parametrize("bits", [4, 8, 12, 16])
@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("is_deep", [False, True], ids=["in-order", "last-first"])
def test_every_class_owns_what_the_oracle_says(
    is_deep: bool, rule: Any, bits: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    for cull in ("none", "back", "front"):
        monkeypatch.setattr(triangles, "lie_deep", lambda vertices, shape: is_deep)
        vertices = rng.permutation(classes(rng))
        for part in np.array_split(vertices, 12):
            options = {"rule": rule, "subpixel_bits": bits, "cull": cull}
            expected = shown(part, **options)
            assert np.array_equal(painted(part, **options), expected)
            assert np.array_equal(painted(part, threads=3, **options), expected)


def test_a_moved_edge_is_noticed(rng: np.random.Generator) -> None:
    vertices = classes(rng)[:12]
    options = {"rule": "top-left", "subpixel_bits": 8, "cull": "none"}
    moved = vertices - np.array([(0.5, 0), (0, 0), (0, 0)])
    assert not np.array_equal(painted(moved, **options), shown(vertices, **options))


@pytest.mark.parametrize("bits", [4, 8, 12])
@pytest.mark.parametrize("threads", [1, 2])
def test_both_ways_to_shade_give_the_same_bits(bits: int, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, pictures = np.random.default_rng(5), []
    vertices = classes(rng)
    reach = (vertices.max(axis=1) - vertices.min(axis=1)).max(axis=1)
    vertices = rng.permutation(vertices[reach * 2**bits < planes.SURE])
    colors = rng.integers(0, 256, (len(vertices), 3, 3)).astype(np.uint8)
    for limit in (0.0, np.inf):
        monkeypatch.setattr(gouraud, "SMALL_BOX", limit)
        canvas = ss.Canvas(*SIZE, threads=threads)
        canvas.triangles(vertices, colors, subpixel_bits=bits)
        pictures.append(canvas.pixels)
    canvas.triangles(vertices, colors, subpixel_bits=bits, algorithm="edge-walk")
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(canvas.pixels, pictures[0])


def test_what_lies_deep_is_drawn_from_the_last_to_the_first(rng: np.random.Generator) -> None:
    size, count = (300, 200), 3000
    large = rng.uniform(-0.2, 1.2, (count, 3, 2)) * size
    small = large[:, :1] + rng.uniform(-20, 20, (count, 3, 2))
    assert triangles.lie_deep(large, size[::-1])
    assert not triangles.lie_deep(large[:31], size[::-1])
    assert not triangles.lie_deep(small, size[::-1])
    assert not triangles.lie_deep(large + 1e6, size[::-1])
    colors, shades = rng.integers(0, 256, (count, 3)), rng.integers(0, 256, (count, 3, 3))
    for chosen in (colors, shades):
        pictures = []
        for algorithm, threads in (("half-space", 1), ("half-space", 2), ("edge-walk", 1)):
            canvas = ss.Canvas(*size, threads=threads)
            canvas.triangles(large, chosen, algorithm=algorithm)
            pictures.append(canvas.pixels)
        assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_bands_cost_alike() -> None:
    rng = np.random.default_rng(3)
    low = rng.uniform(0, 1, 3000) ** 3 * 380
    vertices = np.stack([np.zeros((3000, 3)), low[:, None] + rng.uniform(0, 20, (3000, 3))], axis=2)
    costs, bands = triangles.row_costs(vertices, 400), []
    run_bands(lambda y_start, y_end, stop: bands.append((y_start, y_end)), 400, 2, each=2, costs=costs)
    bands.sort()
    sums = [costs[y_start:y_end].sum() for y_start, y_end in bands]
    assert [end for _, end in bands[:-1]] == [start for start, _ in bands[1:]]
    assert (bands[0][0], bands[-1][1]) == (0, 400)
    assert max(sums) < 1.2 * min(sums)
    assert bands[0][1] < 40


def test_nothing_is_painted_in_threads_too() -> None:
    canvas = ss.Canvas(700, 500, "white", threads=2)
    canvas.triangles([], "red")
    canvas.triangles(np.zeros((0, 3, 2)), np.zeros((0, 3, 3), np.uint8))
    assert (canvas.pixels == 255).all()


def test_bands_of_nothing_are_equally_high() -> None:
    bands: list[tuple[int, int]] = []
    run_bands(lambda y_start, y_end, stop: bands.append((y_start, y_end)), 40, 2, costs=np.zeros(40))
    assert sorted(bands) == [(0, 10), (10, 20), (20, 30), (30, 40)]


SCENE = """
import hashlib, numpy as np, scanspan as ss
rng, digest = np.random.default_rng(4), hashlib.sha256()
corners = rng.uniform(-5, 90, (9, 3, 2)) * np.array([1, 0.2])
corners[:6] = corners[:6, :1] + rng.uniform(-5, 5, (6, 3, 2))
corners[8] *= 1e5
for colors in (rng.integers(0, 256, (9, 3)), rng.integers(0, 256, (9, 3, 3)), rng.uniform(0, 1, (9, 3, 3))):
    canvas = ss.Canvas(80, 20, threads=1)
    canvas.triangles(corners, colors.astype(np.uint8) if colors.dtype != float else colors)
    canvas.triangles(corners[:6] / 2, colors[:6].astype(np.uint8) if colors.dtype != float else colors[:6])
    digest.update(canvas.pixels.tobytes())
print(digest.hexdigest())
"""


def test_plain_python_gives_the_bits_of_the_compiled_kernels() -> None:
    printed = []
    for environment in ({}, {"NUMBA_DISABLE_JIT": "1"}):
        command = [sys.executable, "-W", "error", "-c", SCENE]
        result = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr[-2000:]
        printed.append(result.stdout)
    assert printed[0] == printed[1] != ""
