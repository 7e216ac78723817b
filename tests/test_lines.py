"""Lines on a canvas: run-length and Wu against oracles, crops, threads, and faults of other libraries."""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import scanspan as ss
from scanspan.canvas import LINES
from scanspan.jit import kernel
from scanspan.raster.wu import draw_pairs

FAR = 1 << 24
ALGORITHMS = sorted(LINES)
Pairs = dict[tuple[int, int], Fraction]


def painted(segments: Any, size: tuple[int, int], algorithm: str, **options: Any) -> NDArray[np.uint8]:
    """Return the red of white lines on black."""
    canvas = ss.Canvas(*size, "black", blend="srgb", **options)
    canvas.lines(np.asarray(segments, float).reshape(-1, 2, 2), "white", algorithm=algorithm)
    return canvas.pixels[..., 0].copy()


# Run-length


def test_run_length_is_midpoint_in_every_direction() -> None:
    for x in range(-16, 17):
        for y in range(-16, 17):
            segment = [20, 20, 20 + x, 20 + y]
            assert np.array_equal(painted(segment, (41, 41), "run-length"), painted(segment, (41, 41), "midpoint")), (x, y)


@given(st.lists(st.tuples(*[st.integers(-200, 260)] * 4), min_size=1, max_size=6))
@settings(max_examples=150)
def test_run_length_is_midpoint_wherever_it_is_cut(segments: Any) -> None:
    assert np.array_equal(painted(segments, (60, 50), "run-length"), painted(segments, (60, 50), "midpoint"))


@given(st.tuples(*[st.integers(-FAR, FAR)] * 4), st.tuples(st.integers(0, 30), st.integers(0, 30)))
@settings(max_examples=150)
def test_run_length_is_midpoint_from_far_away(ends: Any, through: Any) -> None:
    # The second runs through the image and as far again on its other side.
    x, y = ends[:2]
    mirrored = [x, y, max(-FAR, min(FAR, 2 * through[0] - x)), max(-FAR, min(FAR, 2 * through[1] - y))]
    for segment in (ends, mirrored):
        assert np.array_equal(painted(segment, (31, 30), "run-length"), painted(segment, (31, 30), "midpoint"))


# Wu


@kernel
def add_cover(flat: NDArray[np.float64], q: int, color: int, cover: float, is_linear: int) -> None:
    """Add up covers."""
    flat[q] += cover


@kernel
def add_pairs(target: NDArray[np.float64], segments: NDArray[np.int64], values: NDArray[np.float64]) -> None:
    """Add up the covers of Wu's pairs."""
    height, width = np.int64(target.shape[0]), np.int64(target.shape[1])
    draw_pairs(add_cover, target.reshape(target.shape[0] * target.shape[1]), width, np.int64(0), height, segments, values, 1)


def pairs_of(segment: Any) -> Pairs:
    """Return the cover of each pixel by Wu's rule: the oracle. Places are cut to 1/65536, from the end with lower (y, x)."""
    x0, y0, x1, y1 = segment
    if (y1, x1) < (y0, x0):
        x0, y0, x1, y1 = x1, y1, x0, y0
    length, found = max(abs(x1 - x0), abs(y1 - y0)), {}
    is_steep = abs(y1 - y0) > abs(x1 - x0)
    for k in range(length + 1):
        share = Fraction(k, max(length, 1))
        u, v = (y1 - y0, x1 - x0) if is_steep else (x1 - x0, y1 - y0)
        gone = Fraction(floor(abs(v) * share * 65536), 65536)
        whole, sign = floor(gone), 1 if v >= 0 else -1
        major, minor = (y0, x0) if is_steep else (x0, y0)
        for aside, cover in ((whole, 1 - (gone - whole)), (whole + 1, gone - whole)):
            place = (minor + sign * aside, major + (1 if u >= 0 else -1) * k)
            if cover:
                found[place if is_steep else place[::-1]] = cover
    return found


def covers(segments: Any, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return how much Wu's lines cover, added up."""
    target, rows = np.zeros(size[::-1]), np.array(segments, np.int64).reshape(-1, 4)
    add_pairs(target, rows, np.zeros(len(rows)))
    return target


def assert_pairs(segment: Any, size: tuple[int, int]) -> None:
    """Compare with the oracle, in every pixel of an image."""
    expected = np.zeros(size[::-1])
    for (x, y), cover in pairs_of(segment).items():
        if 0 <= x < size[0] and 0 <= y < size[1]:
            expected[y, x] = float(cover)
    assert np.array_equal(covers(segment, size), expected), segment


def test_wu_equals_rationals_in_every_direction() -> None:
    for x in range(-11, 12):
        for y in range(-11, 12):
            assert_pairs((12, 12, 12 + x, 12 + y), (25, 25))


@given(st.tuples(*[st.integers(-50, 90)] * 4))
@settings(max_examples=150)
def test_wu_equals_rationals_where_it_is_cut(segment: Any) -> None:
    assert_pairs(segment, (31, 23))


def test_a_wrong_pair_is_noticed() -> None:
    assert pairs_of((0, 0, 7, 3))[3, 1] == Fraction(46812, 65536)
    with pytest.raises(KeyError):
        pairs_of((0, 0, 7, 3))[3, 0]


def test_pairs_add_up_to_exactly_one_pixel_a_step(rng: np.random.Generator) -> None:
    for _ in range(200):
        x0, y0, x1, y1 = rng.integers(3, 97, 4).tolist()
        sums = covers((x0, y0, x1, y1), (100, 100)).sum(axis=1 if abs(y1 - y0) > abs(x1 - x0) else 0)
        assert set(sums.tolist()) <= {0.0, 1.0}
        assert sums.sum() == max(abs(x1 - x0), abs(y1 - y0)) + 1


def test_wu_from_far_away_meets_the_place_where_it_should_be() -> None:
    # From -2^24 to 2^24, rising by one pixel in all: half way it is half way.
    covered = covers((-FAR, 0, FAR, 1), (3, 3))
    assert covered[0].tolist() == [0.5 - k / (2 * FAR) // (1 / 65536) / 65536 for k in range(3)]
    assert (covered.sum(axis=0) == 1.0).all()


@pytest.mark.parametrize("blend", ["linear", "srgb"])
def test_wu_is_blended_as_the_canvas_blends(blend: str) -> None:
    canvas = ss.Canvas(4, 2, "black", blend=blend)
    canvas.lines([[(0, 0), (2, 1)]], "white", algorithm="wu")
    half = {"linear": 188, "srgb": 128}[blend]
    assert canvas.pixels[..., 0].tolist() == [[255, half, 0, 0], [0, half, 255, 0]]


def test_wu_is_the_same_from_both_ends(rng: np.random.Generator) -> None:
    for segment in rng.integers(0, 40, (60, 2, 2)):
        assert np.array_equal(painted(segment, (40, 40), "wu"), painted(segment[::-1], (40, 40), "wu"))


# What holds for all


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_crop_of_a_line_is_the_line_of_a_crop(algorithm: str, rng: np.random.Generator) -> None:
    segments = rng.uniform(-60, 160, (60, 2, 2))
    segments[:20] = rng.uniform(-2e6, 2e6, (20, 2, 2))
    segments[10:20] = segments[10:20, :1] * [[[1], [-1]]] + 50
    whole = painted(segments, (100, 90), algorithm)
    for x, y, w, h in ((0, 0, 30, 20), (37, 41, 25, 30), (99, 0, 1, 90), (50, 89, 50, 1)):
        part = painted(segments - [x, y], (w, h), algorithm)
        assert np.array_equal(part, whole[y : y + h, x : x + w])
    assert (whole > 0).mean() > 0.1


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_threads_change_no_pixel_and_no_order(algorithm: str, rng: np.random.Generator) -> None:
    segments, colors = rng.uniform(-20, 120, (6000, 2, 2)), rng.integers(0, 256, (6000, 4), dtype=np.uint8)
    pictures = []
    for threads in (1, 2, 5):
        canvas = ss.Canvas(100, 99, "black", threads=threads)
        canvas.lines(segments, colors, algorithm=algorithm)
        pictures.append(canvas.pixels)
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])


def steps_written(segment: Any, algorithm: str) -> int:
    """Return how many pixels a line writes into an image of 8 x 8."""
    return int((painted(segment, (8, 8), algorithm) > 0).sum())


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_what_is_not_seen_costs_nothing(algorithm: str) -> None:
    # 32 million steps each, of which a few are seen; 20,000 of them would take minutes if each were gone along.
    segments = np.array([[(-FAR, 3.0), (FAR, 4.0)], [(3.0, -FAR), (4.0, FAR)]] * 10_000)
    assert 15 <= steps_written(segments, algorithm) <= 64
    assert steps_written([[(-FAR, 20), (FAR, 21)]], algorithm) == 0
    assert steps_written([[(-FAR, -FAR + 20), (FAR, FAR + 0)]], algorithm) in (0, 1)


# Faults of others that must not be here


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_opencv_9016_and_28899_negative_coordinates_move_no_line(algorithm: str) -> None:
    assert np.array_equal(
        painted([[(-7, -3), (9, 6)]], (10, 10), algorithm), painted([[(3, 7), (19, 16)]], (20, 20), algorithm)[10:, 10:]
    )


def test_opencv_22012_a_vertex_off_the_image_bends_no_edge() -> None:
    # An outline and the fill of the same polygon, with a corner far outside: all that is filled lies within half a diagonal.
    ring = [(5, 5), (1e6, 40), (5, 75)]
    canvas, filled = ss.Canvas(80, 80, "black"), ss.Canvas(80, 80, "black")
    canvas.polyline(ring, "white", closed=True)
    filled.polygon(ring, "white")
    row = filled.pixels[..., 0] > 0
    edge = canvas.pixels[..., 0] > 0
    for x in range(10, 80):
        inside, border = np.flatnonzero(row[:, x]), np.flatnonzero(edge[:, x])
        assert abs(inside.min() - border.min()) <= 1
        assert abs(inside.max() - border.max()) <= 1


def test_xarray_spatial_3102_a_line_has_no_gap() -> None:
    for algorithm in ALGORITHMS:
        line = painted([[(2, 3), (37, 29)]], (40, 40), algorithm) > 0
        assert (line[:, 3:36].sum(axis=0) >= 1).all()
