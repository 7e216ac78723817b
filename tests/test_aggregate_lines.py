"""Lines counted, added, averaged and compared in pixels: where a canvas paints them, however far they reach."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from math import ceil
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.world import cut_segments
from tests.plotting import REDUCTIONS, reduced_image, same

SIZE = (23, 17)
LINES = ("diamond-exit", "midpoint", "dda", "symmetric")


def painted(paint: Callable[[ss.Canvas], None], size: tuple[int, int] = SIZE) -> list[tuple[int, int]]:
    """Return the pixels (x, y) that are painted on a black canvas."""
    canvas = ss.Canvas(*size, "black")
    paint(canvas)
    rows, columns = np.nonzero(canvas.pixels[..., 0])
    return list(zip(columns.tolist(), rows.tolist()))


def random_segments(rng: np.random.Generator, count: int) -> Any:
    """Return segments in and around the image, some on whole pixels."""
    segments = rng.uniform(-10, 33, (count, 2, 2))
    segments[::3] = np.round(segments[::3])
    return segments


@pytest.mark.parametrize("line", LINES)
def test_segments_fall_where_a_canvas_paints_them(line: str, rng: np.random.Generator) -> None:
    segments, values = random_segments(rng, 120), rng.normal(size=120)
    hits = []
    for segment, value in zip(segments, values):
        pixels = painted(lambda canvas, segment=segment: canvas.lines([segment], "white", algorithm=line))
        hits += [(x, y, float(value)) for x, y in pixels]
    for reduce in REDUCTIONS:
        found = ss.aggregate(segments, SIZE, reduce=reduce, values=values, line=line)
        assert same(found, reduced_image(reduce, SIZE, hits))


@pytest.mark.parametrize("line", LINES)
def test_any_number_of_threads_gives_the_same_bits(line: str, rng: np.random.Generator) -> None:
    size = (640, 480)
    segments, values = rng.uniform(-50, 700, (300, 2, 2)), rng.normal(size=300)
    for reduce in REDUCTIONS:
        found = [ss.aggregate(segments, size, reduce=reduce, values=values, line=line, threads=n) for n in (1, 2, 7)]
        assert same(found[0], found[1])
        assert same(found[0], found[2])


def test_a_polyline_breaks_where_a_coordinate_is_missing(rng: np.random.Generator) -> None:
    chain = rng.uniform(0, 17, (40, 2))
    chain[9], chain[20, 0], chain[21, 1] = np.nan, np.nan, np.nan
    parts = [chain[:9], chain[10:20], chain[22:]]
    hits = []
    for part in parts:
        for segment in pairwise(part):
            pixels = painted(lambda canvas, segment=segment: canvas.lines([segment], "white", algorithm="diamond-exit"))
            hits += [(x, y, 1.0) for x, y in pixels]
    for nonfinite in ("error", "drop"):
        found = ss.aggregate(chain, SIZE, kind="lines", nonfinite=nonfinite)
        assert np.array_equal(found, reduced_image("count", SIZE, hits))

    # A polyline counts once where a canvas paints it, unless it comes back.
    track = [(1, 1), (6, 3), (12, 4), (20, 12)]
    found = ss.aggregate(track, SIZE, kind="lines")
    assert found.max() == 1
    assert sorted(zip(*np.nonzero(found.T))) == sorted(painted(lambda canvas: canvas.polyline(track, "white")))


def test_a_segment_of_a_polyline_has_the_value_of_its_first_point() -> None:
    chain = [(0, 0.5), (2.5, 0.5), (5, 0.5), (np.nan, 0), (0, 1.5), (3.5, 1.5)]
    found = ss.aggregate(chain, (4, 2), kind="lines", reduce="sum", values=[1, 2, np.nan, np.nan, 5, np.inf])
    assert same(found, [[1, 1, 2, 2], [5, 5, 5, np.nan]])
    table = {"t": [0, 2.5, 5], "v": [0.5, 0.5, 0.5], "w": [7, 8, np.nan]}
    found = ss.aggregate(table, (4, 1), kind="lines", x="t", y="v", values="w", reduce="max")
    assert found.tolist() == [[7, 7, 8, 8]]


def test_what_is_not_finite_is_left_out_where_that_is_asked_for() -> None:
    segments = [[(0, 0.5), (4, 0.5)], [(0, np.nan), (3, 1)], [(0, 1), (np.inf, 1)], [(0, 1.5), (4, 1.5)]]
    assert ss.aggregate(segments, (3, 2), nonfinite="drop").tolist() == [[1, 1, 1], [1, 1, 1]]
    values = [1, 2, 3, np.nan]
    assert ss.aggregate(segments, (3, 2), values=values, nonfinite="drop").tolist() == [[1, 1, 1], [0, 0, 0]]
    chain = [(0, 0.5), (2.5, 0.5), (3, np.inf), (0, 1.5), (4, 1.5)]
    assert ss.aggregate(chain, (3, 2), kind="lines", nonfinite="drop").tolist() == [[1, 1, 0], [1, 1, 1]]


def test_bounds_turn_the_world_into_pixels(rng: np.random.Generator) -> None:
    segments = rng.integers(-40, 140, (80, 2, 2)) / 8
    bounds = (-1.0, 2.0, 10.5, 10.5)
    pixels = np.stack([(segments[..., 0] + 1) * 2, (10.5 - segments[..., 1]) * 2], axis=-1)
    assert np.array_equal(ss.aggregate(segments, SIZE, bounds=bounds), ss.aggregate(pixels, SIZE))


def test_fitting_bounds_show_the_lowest_and_the_highest_line() -> None:
    frame = [[(-2, 5), (4, 5)], [(4, 5), (4, 9)], [(4, 9), (-2, 9)], [(-2, 9), (-2, 5)]]
    expected = np.ones((5, 7), np.int32)
    expected[1:-1, 1:-1] = 0
    assert np.array_equal(ss.aggregate(frame, (7, 5), bounds="fit"), expected)
    assert ss.aggregate([[(3, 2), (3, 8)]], (3, 4), bounds="fit").sum(axis=0).tolist() == [0, 3, 0]
    assert ss.aggregate([[(3, 2), (4, 8)]], (1, 1), bounds="fit", line="midpoint").tolist() == [[1]]


def test_nothing_draws_nothing() -> None:
    assert not ss.aggregate(np.empty((0, 2, 2)), (3, 2)).any()
    assert not ss.aggregate([], (3, 2), kind="lines").any()
    assert not ss.aggregate([(1, 1)], (3, 2), kind="lines", bounds="fit").any()
    assert not ss.aggregate([(np.nan, 1)] * 3, (3, 2), kind="lines").any()


def steep_line_pixels(a: Any, b: Any, size: tuple[int, int]) -> set[tuple[int, int]]:
    """Return the pixels of an exact line that is steep and passes all rows: at each row's centre, that with the line's x.

    Ties are broken to the left, as diamond-exit does.
    """
    (ax, ay), (bx, by) = [[Fraction(float(v)) for v in point] for point in (a, b)]
    pixels = set()
    for y in range(size[1]):
        x = ceil(ax + (bx - ax) * (y + Fraction(1, 2) - ay) / (by - ay)) - 1
        if 0 <= x < size[0]:
            pixels.add((x, y))
    return pixels


@pytest.mark.parametrize("reach", [1e5, 3e7, 1e9, 1e12])
def test_who_looks_closely_sees_lines_that_reach_far_beyond(reach: float, rng: np.random.Generator) -> None:
    differing = total = 0
    for slope in rng.uniform(-0.9, 0.9, 40):
        a, b = (8.3 - slope * reach, 7.0 - reach), (8.3 + slope * reach * 0.7, 7.0 + reach * 0.7)
        found = set(zip(*(axis.tolist() for axis in np.nonzero(ss.aggregate([[a, b]], SIZE).T))))
        exact = steep_line_pixels(a, b, SIZE)
        differing, total = differing + len(found ^ exact), total + len(exact)
    assert total > 500
    assert differing <= total / 50  # those that pass within a sub-pixel of a border


def test_segments_are_cut_only_where_they_must() -> None:
    far = 2.0**30
    ends = np.array([
        [(0, 0), (5, 5)], [(-far, 3), (far, 3)], [(far, far), (far, -far)], [(0, 0), (far, 0)], [(-far, 0), (0, -far)],
        [(2.0**24, 0), (0, 2.0**24)], [(0, -far), (0, 1e150)],
        [(far, 0), (far, 5e-324)],
    ])  # fmt: skip
    cut, number = cut_segments(ends)
    side = 2.0**23
    assert number.tolist() == [0, 1, 3, 5, 6]
    assert cut.tolist() == [
        [[0, 0], [5, 5]], [[-side, 3], [side, 3]], [[0, 0], [side, 0]], [[2 * side, 0], [0, 2 * side]],
        [[0, -side], [0, side]],
    ]  # fmt: skip
    assert np.array_equal(cut_segments(ends[::-1])[0], cut[::-1])
    turned = cut_segments(ends[:, ::-1])[0]
    assert np.array_equal(turned, cut[:, ::-1])
