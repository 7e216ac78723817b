"""The sweep: its table and its list are what they say in every row, its crossings are exact, and a planted fault is noticed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from scanspan.geometry import fixed_point
from scanspan.geometry.clip import to_screen
from scanspan.geometry.project import screen_triangles
from scanspan.raster import active_edges, algorithms, edge, edge_walk, half_space, scanline, setup, span_list, write
from scanspan.raster.algorithms import with_outlines
from scanspan.raster.counters import COUNTERS, INSERTIONS, LEFT_OVER, OUT_OF_ORDER, SET_TWICE, SPANS, SWAPS
from scanspan.raster.options import OffscreenPoint, make_sampling
from scanspan.raster.write import EMPTY_KEY
from tests import exact

SIZE = (24, 18)
RULES = ["top-left", "bottom-left", "inclusive", "exclusive", OffscreenPoint(-3.25, 7.5), OffscreenPoint(1, 0, 0)]
BREACHES = [OUT_OF_ORDER, LEFT_OVER, SET_TWICE]
REAL_STEP = active_edges.step_edges.py_func


def flat(vertices: Any, depths: Any, bits: int = 8) -> Any:
    """Triangles given on the screen: (N, 3, 2) pixels and depths of their corners."""
    corners = np.asarray(vertices, float)
    return screen_triangles(corners, bits)._replace(depth=np.broadcast_to(depths, corners.shape[:2]).astype(float).ravel())


def soup(rng: np.random.Generator, count: int) -> Any:
    """Triangles of random clip coordinates, many of them behind the eye."""
    return to_screen(rng.normal(size=(3 * count, 4)), np.arange(3 * count, dtype=np.int32).reshape(-1, 3), SIZE, 8)


def sampling_of(rule: Any = "top-left", size: Any = SIZE, bits: int = 8) -> Any:
    """A whole image, sampled at its pixels' centres."""
    return make_sampling(size, (1 << (bits - 1),) * 2, rule=rule, cull="none", subpixel_bits=bits)


def blank(kind: str, size: Any = SIZE) -> Any:
    """A target in which nothing has been written."""
    if kind == "keys":
        return np.full(size[::-1], EMPTY_KEY)
    if kind == "hits":
        return np.zeros(size[::-1], np.int32)
    pairs = np.empty((*size[::-1], 2))
    pairs[...] = (-np.inf, -1.0)
    return pairs


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the algorithms plain Python, so that a test can look into one, or plant a fault in a part of it."""
    for module in (fixed_point, edge, setup, write, edge_walk, half_space, active_edges, scanline, span_list):
        for name, value in list(vars(module).items()):
            if hasattr(value, "py_func"):
                monkeypatch.setattr(module, name, value.py_func)

    # A kernel that was not compiled before could not be compiled now: it calls what has just become plain Python.
    monkeypatch.setattr(algorithms, "set_up_outlines", algorithms.set_up_outlines.py_func)


def sweeps() -> list[tuple[str, Callable[..., None], str]]:
    """Each sweep as its name, a function, and its kind of target; call it under `plain`."""
    return [
        (
            "scanline-eval",
            lambda *a: scanline.sweep(scanline.evaluate_row, scanline.find_nearest_key, write.write_sample_key, *a),
            "keys",
        ),
        (
            "scanline-zrow",
            lambda *a: scanline.sweep(scanline.buffer_row, scanline.find_nearest_key, write.write_sample_key, *a),
            "keys",
        ),
        (
            "scanline-count",
            lambda *a: scanline.sweep(scanline.write_spans, scanline.find_nearest_key, write.write_sample_hit, *a),
            "hits",
        ),
        (
            "span-list",
            lambda *a: scanline.sweep(span_list.list_spans, scanline.find_nearest_pair, write.write_sample_pair, *a),
            "pairs",
        ),
    ]


def swept(function: Callable[..., None], kind: str, triangles: Any, sampling: Any = None, size: Any = SIZE) -> Any:
    """Sweep once and return the target and what was counted."""
    target, counters, within = blank(kind, size), np.zeros(COUNTERS, np.int64), sampling or sampling_of(size=size)
    function(target, counters, with_outlines(triangles, within), 0, len(triangles.corners), within)
    return target, counters


# Tables and crossings


def test_a_bucket_has_the_triangles_that_start_in_its_row(rng: np.random.Generator) -> None:
    triangles = flat(rng.uniform(-10, 30, (80, 3, 2)), 0)
    sampling = sampling_of()._replace(y_start=2, y_end=15)
    table = active_edges.build_edge_table.py_func(triangles, 5, 77, sampling)
    first = np.maximum(np.ceil(triangles.xy[:, 1].reshape(-1, 3).min(axis=1) / 256 - 0.5), 2)
    last = np.minimum(np.floor(triangles.xy[:, 1].reshape(-1, 3).max(axis=1) / 256 - 0.5), 14)
    for j in range(13):
        bucket = table.triangles[table.starts[j] : table.starts[j + 1]]
        assert list(bucket) == [n for n in range(5, 77) if first[n] == j + 2 and last[n] >= j + 2]
    assert table.starts[13] == ((first <= last)[5:77]).sum() > 20

    # The list has room for the fullest row, and for no triangle more.
    assert table.most == max(((first[5:77] <= y) & (last[5:77] >= y)).sum() for y in range(2, 15))
    active = active_edges.make_active_edges.py_func(table.most, sampling)
    assert len(active.order) == len(active.edges) == 2 * table.most
    assert len(active.slots) == len(active.planes) == table.most


def test_one_triangle_a_row_needs_room_for_one() -> None:
    ladder = [[(2, y + 0.1), (20, y + 0.2), (9, y + 0.9)] for y in range(18)]
    table = active_edges.build_edge_table.py_func(flat(ladder, 0), 0, 18, sampling_of())
    assert table.most == 1


@pytest.mark.parametrize("slope", ["steep", "shallow", "level but for a hair", "far"])
def test_a_crossing_is_the_exact_ceiling_in_every_row(rng: np.random.Generator, slope: str) -> None:
    a_top, b_top = {
        "steep": (1 << 20, 9),
        "shallow": (9, 1 << 20),
        "level but for a hair": (2, 1 << 41),
        "far": (1 << 41,) * 2,
    }[slope]
    for _ in range(40):
        a, b = int(rng.integers(1, a_top)), int(rng.integers(-b_top, b_top))
        f = int(rng.integers(-(1 << 59), 1 << 59)) if slope == "far" else int(rng.integers(-(1 << 30), 1 << 30))
        crossing, rest, step, step_rest = edge_walk.start_crossing(np.int64(f), np.int64(a), np.int64(b))
        for y in range(60):
            assert crossing == -((f + y * b) // a), (f, a, b, y)
            assert rest == f + y * b + a * crossing
            assert 0 <= rest < a
            crossing, rest = edge_walk.step_crossing(crossing, rest, step, step_rest, a)


# Invariants


@pytest.mark.parametrize("rule", RULES, ids=str)
def test_the_list_is_in_order_in_every_row_and_empty_at_the_end(
    rng: np.random.Generator, plain: None, monkeypatch: pytest.MonkeyPatch, rule: Any
) -> None:
    rows: list[int] = []
    insert = active_edges.insert_edges

    def insert_and_look(active: Any, count: int, y: int, *others: Any) -> int:
        count = insert(active, count, y, *others)
        listed = active.order[:count]
        x = active.x[listed]
        assert (np.diff(x) >= 0).all()
        assert sorted(listed >> 1) == sorted([*set(listed >> 1)] * 2)
        assert len(set(listed)) == count <= len(active.order)
        rows.append(y)
        return count

    monkeypatch.setattr(scanline, "insert_edges", insert_and_look)
    sampling = sampling_of(rule)
    cross = flat([[(4, 1), (6, 1), (20, 17)], [(18, 1), (20, 1), (4, 17)]], 0)  # its leftmost edges cross within the picture
    for triangles in (soup(rng, 15), flat(rng.uniform(-4, 30, (15, 3, 2)), rng.uniform(size=(15, 3))), cross):
        for name, function, kind in sweeps():
            target, counters = swept(function, kind, triangles, sampling)
            assert rows == list(range(SIZE[1]))
            rows.clear()
            assert not counters[BREACHES].any(), name
            assert counters[INSERTIONS] > 0
            with np.errstate(over="ignore"):
                expected = blank(kind)
                drawn = with_outlines(triangles, sampling)
                getattr(half_space, f"half_space_{kind}")(
                    expected, np.zeros(COUNTERS, np.int64), drawn, 0, len(triangles.corners), sampling
                )
            assert np.array_equal(target, expected)


def test_each_sample_is_set_once(rng: np.random.Generator, plain: None) -> None:
    vertices = rng.uniform(-4, 30, (15, 3, 2))
    triangles = flat(vertices, rng.uniform(size=(15, 3)))
    covered = exact.coverage(vertices, SIZE).any(axis=0)
    times = np.zeros(SIZE[::-1], int)

    def set_sample(row: Any, q: int, inside: bool, depth: float, number: int) -> None:
        """Count what is set in a row of hits."""
        row[q] += 1

    for nearest in (scanline.find_nearest_key, scanline.find_nearest_pair):
        for scan in (scanline.evaluate_row, span_list.list_spans):
            times[...] = 0
            scanline.sweep(scan, nearest, set_sample, times, np.zeros(COUNTERS, np.int64), triangles, 0, 15, sampling_of())
            assert np.array_equal(times, covered)


def test_insertions_swaps_and_spans_are_counted(plain: None) -> None:
    size = (20, 20)
    crossing = [[(2, 0), (4, 0), (18, 20)], [(16, 0), (18, 0), (2, 20)]]
    apart = [[(2, 0), (4, 0), (3, 20)], [(16, 0), (18, 0), (17, 20)]]
    rows = int(exact.coverage(np.array(crossing, float), size).any(axis=2).sum())
    for _, function, kind in sweeps():
        _, counters = swept(function, kind, flat(crossing, 0), size=size)
        assert counters[[INSERTIONS, SWAPS, SPANS]].tolist() == [4, 4, rows]
        assert swept(function, kind, flat(apart, 0), size=size)[1][SWAPS] == 0


# Planted faults


def unsorted(active: Any, count: int, counters: Any) -> None:
    """A fault: the list is left as it is."""


def never_ending(active: Any, count: int, y: int, sampling: Any, counters: Any) -> int:
    """A fault: edges that have ended stay in the list."""
    active.edges[:, active_edges.Y_END] = 1 << 30
    return int(REAL_STEP(active, count, y, sampling, counters))


@pytest.mark.parametrize("name", ["scanline-eval", "scanline-zrow", "scanline-count", "span-list"])
@pytest.mark.parametrize("fault", [unsorted, never_ending])
def test_a_planted_fault_breaks_an_invariant(
    rng: np.random.Generator, plain: None, monkeypatch: pytest.MonkeyPatch, name: str, fault: Callable[..., Any]
) -> None:
    function, kind = next((function, kind) for found, function, kind in sweeps() if found == name)
    part, breach = ("sort_edges", OUT_OF_ORDER) if fault is unsorted else ("step_edges", LEFT_OVER)
    triangles = flat(rng.uniform(-4, 30, (12, 3, 2)) if fault is unsorted else [[(3, 3), (9, 4), (5, 9)]], 0)
    assert not swept(function, kind, triangles)[1][BREACHES].any()
    monkeypatch.setattr(scanline, part, fault)
    assert swept(function, kind, triangles)[1][breach] > 0


@pytest.mark.parametrize("always", [True, False])
def test_runs_are_only_taken_where_they_are_clear(
    rng: np.random.Generator, plain: None, monkeypatch: pytest.MonkeyPatch, always: bool
) -> None:
    through = flat(rng.uniform(-20, 50, (12, 3, 2)), rng.normal(size=(12, 3)))
    _, eval_keys, kind = sweeps()[0]
    expected, _ = swept(eval_keys, kind, through)
    monkeypatch.setattr(span_list, "is_clear", lambda *arguments: always)
    found, _ = swept(
        lambda *a: scanline.sweep(span_list.list_spans, scanline.find_nearest_key, write.write_sample_key, *a), "keys", through
    )
    assert np.array_equal(found, expected) == (not always)
