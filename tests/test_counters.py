"""Counters: what is counted by hand in small scenes and by NumPy in large ones; breaches of the sweep's invariants are told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.raster import algorithms
from scanspan.raster.counters import BREACHES, COUNTERS, LEFT_OVER, NAMES, OUT_OF_ORDER, SAMPLES_TESTED, SET_TWICE
from scanspan.samples import POSITIONS
from scanspan.target import visibility
from tests import exact

Floats = NDArray[np.float64]

SIZE = (48, 36)
WAYS = [(name, order) for name in ss.ALGORITHMS for order in algorithms.KERNELS[name]]
SWEEPS = ["scanline-eval", "scanline-zrow", "span-list"]
WORK = ["samples_tested", "edge_evaluations", "spans", "depth_tests", "writes", "subdivisions", "insertions", "swaps"]

# A square of 4 x 4 pixels. Its diagonal runs through samples, which go to the lower triangle: 6 samples and 10.
SQUARE = [[(2, 2), (6, 2), (2, 6)], [(6, 2), (6, 6), (2, 6)]]


def on_screen(vertices: Any, size: tuple[int, int] = SIZE, depths: Any = 0.5) -> tuple[Floats, NDArray[np.int64]]:
    """Clip coordinates with w = 1 of triangles given on the screen with the depths of their corners, and their triangles."""
    corners = np.asarray(vertices, float)
    d = np.broadcast_to(depths, corners.shape[:2])
    x, y = corners[..., 0] / size[0] * 2 - 1, 1 - corners[..., 1] / size[1] * 2
    return np.stack([x, y, 1 - 2 * d, np.ones_like(x)], axis=-1).reshape(-1, 4), np.arange(d.size).reshape(-1, 3)


def counters_of(vertices: Any, size: tuple[int, int] = (8, 8), depths: Any = 0.5, **options: Any) -> dict[str, int]:
    """The counters of triangles given on the screen."""
    return dict(ss.rasterize(*on_screen(vertices, size, depths), size, **options).counters)


def soup(rng: np.random.Generator, count: int = 60) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles in perspective, some of them behind the eye."""
    return rng.normal(size=(3 * count, 4)), np.arange(3 * count).reshape(-1, 3)


# In general


@pytest.mark.parametrize(("algorithm", "order"), WAYS, ids=str)
def test_every_way_counts(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch, algorithm: str, order: str) -> None:
    monkeypatch.setattr(algorithms, "SMALL", 0)
    clip, triangles = soup(rng)
    seen = [ss.rasterize(clip, triangles, SIZE, algorithm=algorithm, order=order, threads=n) for n in (1, 3)]
    found = seen[0].counters
    assert list(found) == ["triangles", "cut", "outside", "drawn", *WORK]
    assert all(type(value) is int and value >= 0 for value in found.values())
    assert seen[1].counters == found
    assert seen[0].counters is found
    assert found["triangles"] == 60
    assert found["samples_tested"] >= found["writes"] >= (seen[0].primitive >= 0).sum() > 0
    assert found["depth_tests"] >= found["writes"]
    assert found["edge_evaluations"] > 0
    assert (found["spans"] > 0) == (algorithm in ("edge-walk", *SWEEPS))
    assert (found["insertions"] > 0) == (found["swaps"] > 0) == (algorithm in SWEEPS)
    assert (found["subdivisions"] > 0) == (algorithm in ("warnock", "micropolygon"))


@pytest.mark.parametrize("algorithm", ss.ALGORITHMS)
def test_nothing_costs_nothing(algorithm: str) -> None:
    found = ss.rasterize(np.empty((0, 4)), [], SIZE, algorithm=algorithm).counters
    assert set(found.values()) == {0}


@pytest.mark.parametrize("algorithm", ss.ALGORITHMS)
def test_samples_are_counted_one_after_the_other(rng: np.random.Generator, algorithm: str) -> None:
    """A sample at (x, y) sixteenths does the work that the centre does for a scene moved by the difference."""
    vertices, depths = np.rint(rng.uniform(-4, 50, (30, 3, 2)) * 256) / 256, rng.uniform(0, 1, (30, 3))
    whole = counters_of(vertices, SIZE, depths, algorithm=algorithm, samples=4)
    moved = [
        counters_of(vertices + (8 - x, 8 - y) / np.array(16.0), SIZE, depths, algorithm=algorithm) for x, y in POSITIONS[4]
    ]
    assert {name: whole[name] for name in WORK} == {name: sum(each[name] for each in moved) for name in WORK}
    assert whole["triangles"] == whole["drawn"] == 30


def test_a_merged_visibility_has_the_work_of_its_parts(rng: np.random.Generator) -> None:
    clip, triangles = soup(rng)
    a = ss.rasterize(clip, triangles[:20], SIZE, algorithm="span-list")
    b = ss.rasterize(clip, triangles[20:], SIZE, algorithm="micropolygon")
    sums = {name: a.counters[name] + b.counters[name] for name in a.counters}
    assert ss.merge(a, b).counters == ss.merge(b, a).counters == sums
    assert ss.merge(ss.merge(a, b), a).counters == {name: sums[name] + a.counters[name] for name in sums}
    assert sums["triangles"] == 60


# By hand


def test_a_square_of_two_triangles() -> None:
    assert (ss.rasterize(*on_screen(SQUARE, (8, 8)), (8, 8)).primitive >= 0).sum() == 16
    found = {name: counters_of(SQUARE, algorithm=name) for name in ss.ALGORITHMS}
    for name in ss.ALGORITHMS:
        assert found[name]["drawn"] == 2
        assert found[name]["writes"] == 16
        assert found[name]["swaps"] == 0

    # Both boxes are tested whole, three edges a sample. Warnock asks six corner values of each triangle before.
    for name, evaluations in (("half-space", 96), ("homogeneous", 96), ("warnock", 96 + 2 * 6)):
        assert found[name] == {**found["half-space"], "edge_evaluations": evaluations}
        assert (found[name]["samples_tested"], found[name]["depth_tests"]) == (2 * 16, 16)

    # What walks edges tests what it covers alone: one triangle has spans in four rows, the other in three.
    for name in ("edge-walk", *SWEEPS):
        assert found[name]["samples_tested"] == 16
        assert found[name]["spans"] == 4 + 3
        assert found[name]["insertions"] == (0 if name == "edge-walk" else 2 * 2)
    assert found["edge-walk"]["edge_evaluations"] == 2 * (2 * 4 + 1)
    assert found["scanline-zrow"]["edge_evaluations"] == 4 * 4

    # An evaluation at every sample, and the comparison with what is there; zrow has that alone, span-list one or two a span.
    assert found["edge-walk"]["depth_tests"] == found["scanline-zrow"]["depth_tests"] == 16
    assert found["scanline-eval"]["depth_tests"] == 16 + 16
    assert 16 < found["span-list"]["depth_tests"] <= 16 + 2 * 7
    assert found["micropolygon"]["subdivisions"] == 2
    assert found["micropolygon"]["depth_tests"] == 16


@pytest.mark.parametrize("algorithm", ["edge-walk", *SWEEPS])
def test_spans_are_those_rows_of_triangles_that_cover_a_sample(rng: np.random.Generator, algorithm: str) -> None:
    vertices = rng.uniform(-10, 50, (40, 3, 2))
    rows = int(exact.coverage(vertices, SIZE).any(axis=2).sum())
    assert counters_of(vertices, SIZE, algorithm=algorithm)["spans"] == rows


@pytest.mark.parametrize("algorithm", SWEEPS)
def test_edges_that_cross_are_swapped_once(algorithm: str) -> None:
    crossing = [[(2, 0), (4, 0), (18, 20)], [(16, 0), (18, 0), (2, 20)]]
    apart = [[(2, 0), (4, 0), (3, 20)], [(16, 0), (18, 0), (17, 20)]]
    for vertices, swaps in ((crossing, 2 * 2), (apart, 0)):
        found = counters_of(vertices, (20, 20), algorithm=algorithm)
        assert (found["insertions"], found["swaps"]) == (4, swaps)


@pytest.mark.parametrize(("side", "windows"), [(32, 0), (64, 1), (128, 1 + 2), (256, 1 + 2 + 4)])
def test_warnock_divides_along_a_diagonal(side: int, windows: int) -> None:
    """Windows off the diagonal show one triangle, and one of 32 samples is not divided."""
    square = [[(0, 0), (side, 0), (0, side)], [(side, 0), (side, side), (0, side)]]
    assert counters_of(square, (side, side), algorithm="warnock")["subdivisions"] == windows
    assert counters_of(square[:1], (side, side), algorithm="warnock")["subdivisions"] == 0


def test_warnock_drops_what_is_hidden() -> None:
    """The nearest of five layers surrounds the window; the others are neither divided nor drawn."""
    layers = np.tile([(-99.0, -80.0), (300.0, -80.0), (30.0, 300.0)], (5, 1, 1))
    depths = np.repeat([[0.1], [0.3], [0.9], [0.5], [0.7]], 3, axis=1)
    found = counters_of(layers, (64, 64), depths, algorithm="warnock")
    assert (found["subdivisions"], found["samples_tested"], found["writes"]) == (0, 64 * 64, 64 * 64)
    assert counters_of(layers, (64, 64), depths)["writes"] == 3 * 64 * 64


@pytest.mark.parametrize(("side", "pieces"), [(12, 1), (13, 1 + 4), (24, 1 + 4), (25, 1 + 4 + 16), (49, 1 + 4 + 16 + 64)])
def test_micropolygon_splits_long_edges_into_two(side: int, pieces: int) -> None:
    """An edge of more than 12 pixels is split, and so a right triangle into four."""
    found = counters_of([[(0, 0), (side, 0), (0, side)]], (64, 64), algorithm="micropolygon")
    assert found["subdivisions"] == pieces


def test_micropolygon_drops_pieces_off_the_picture() -> None:
    large = [[(-64, -64), (192, -64), (-64, 192)]]
    found = counters_of(large, (8, 8), algorithm="micropolygon")
    assert found["writes"] == 64
    assert found["subdivisions"] < 40 < counters_of(large, (200, 200), algorithm="micropolygon")["subdivisions"]


@pytest.mark.parametrize("algorithm", ["half-space", "homogeneous", "warnock"])
def test_whole_pixels(algorithm: str) -> None:
    """The diagonal goes through four pixels, which both triangles touch and of which neither has all."""
    touched = counters_of(SQUARE, algorithm=algorithm, coverage="touched")
    assert (touched["samples_tested"], touched["depth_tests"], touched["writes"]) == (32, 20, 16)
    inside = counters_of(SQUARE, algorithm=algorithm, coverage="inside")
    assert (inside["samples_tested"], inside["depth_tests"], inside["writes"]) == (32, 12, 12)


# By NumPy


@pytest.mark.parametrize("algorithm", ["half-space", "homogeneous", "edge-walk", "scanline-zrow", "micropolygon"])
@pytest.mark.parametrize("rule", ["top-left", "inclusive", "exclusive"])
def test_depth_tests_and_writes_are_those_of_painting_one_by_one(rng: np.random.Generator, algorithm: str, rule: str) -> None:
    vertices = np.rint(rng.uniform(-4, 50, (50, 3, 2)) * 2) / 2
    clip, triangles = on_screen(vertices, SIZE, np.rint(rng.uniform(0, 4, (50, 1))) / 4)
    covered, nearest, writes = exact.coverage(vertices, SIZE, rule=rule), np.full(SIZE[::-1], -np.inf), 0
    for inside, corners in zip(covered, triangles):
        depth = ss.rasterize(clip, [corners], SIZE, rule=rule).depth
        assert np.array_equal(depth > -np.inf, inside)
        writes += int((depth > nearest).sum())
        nearest = np.maximum(depth, nearest)
    found = ss.rasterize(clip, triangles, SIZE, algorithm=algorithm, rule=rule).counters
    assert found["depth_tests"] == int(covered.sum())
    if algorithm != "scanline-zrow":
        assert found["writes"] == writes
    else:
        # In a row spans come by their left edges, in another order than the triangles.
        assert int(covered.any(axis=0).sum()) <= found["writes"] <= int(covered.sum())


@pytest.mark.parametrize("algorithm", ["scanline-eval", "span-list"])
def test_sweeps_that_know_what_is_nearest_write_each_sample_once(rng: np.random.Generator, algorithm: str) -> None:
    vertices, depths = rng.uniform(-10, 50, (60, 3, 2)), rng.uniform(0, 1, (60, 3))
    covered = exact.coverage(vertices, SIZE)
    found = counters_of(vertices, SIZE, depths, algorithm=algorithm)
    assert found["samples_tested"] == found["writes"] == int(covered.any(axis=0).sum())
    if algorithm == "scanline-eval":
        assert found["depth_tests"] == int(covered.sum()) + found["writes"]


def test_half_space_tests_the_samples_of_boxes(rng: np.random.Generator) -> None:
    vertices = rng.uniform(-4, 40, (40, 1, 2)) + rng.uniform(-9, 9, (40, 3, 2))
    first = np.maximum(np.ceil(np.rint(vertices.min(axis=1) * 256) / 256 - 0.5), 0)
    last = np.minimum(np.floor(np.rint(vertices.max(axis=1) * 256) / 256 - 0.5), np.array(SIZE) - 1)
    boxes = int(np.maximum(last - first + 1, 0).prod(axis=1).sum())
    found = counters_of(vertices, SIZE)
    assert (found["samples_tested"], found["edge_evaluations"]) == (boxes, 3 * boxes)


# Breaches


@pytest.mark.parametrize(("place", "breach"), list(zip((OUT_OF_ORDER, LEFT_OVER, SET_TWICE), BREACHES)))
def test_a_breach_is_told(monkeypatch: pytest.MonkeyPatch, place: int, breach: str) -> None:
    counted = np.zeros(COUNTERS, np.int64)
    counted[place] = 3
    seen = ss.rasterize(*on_screen(SQUARE, (8, 8)), (8, 8), algorithm="span-list", samples=2)
    monkeypatch.setattr(visibility, "run", lambda *arguments: counted)
    with pytest.raises(RuntimeError, match=f"^span-list: {breach}, 6 times$"):
        _ = seen.counters
    counted[place], counted[SAMPLES_TESTED] = 0, 5
    assert seen.counters["samples_tested"] == 10
    assert len(NAMES) + len(BREACHES) == COUNTERS


def test_a_kernel_that_breaks_an_invariant_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    kernels = dict(algorithms.KERNELS["scanline-eval"]["rows"])
    sweep = kernels["tallies"]

    def forgetful(target: Any, counters: Any, triangles: Any, first: int, last: int, sampling: Any) -> None:
        """A fault: the sweep ends before the triangles do, with edges in its list."""
        sweep(target, counters, triangles, first, last, sampling._replace(y_end=sampling.y_end - 4))
        counters[LEFT_OVER] += 2

    monkeypatch.setitem(algorithms.KERNELS["scanline-eval"], "rows", {**kernels, "tallies": forgetful})
    seen = ss.rasterize(*on_screen(SQUARE, (8, 8)), (8, 8), algorithm="scanline-eval")
    assert (seen.primitive >= 0).sum() == 16
    with pytest.raises(RuntimeError, match=r"^scanline-eval: edges left over at the end of a sweep, \d+ times$"):
        _ = seen.counters
