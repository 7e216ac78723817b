"""Polygons on a canvas: each pixel once, by every fill rule, and none of the faults that users reported of other libraries."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import Delaunay  # type: ignore[import-untyped]

import scanspan as ss
from tests.painting import BLENDS, FILL_RULES, FILLS, HALF_WHITE, ONCE, PAINTERS, Booleans, filled, gray, inside
from tests.test_polygon import KINDS


@pytest.mark.parametrize("fill_rule", FILL_RULES)
@pytest.mark.parametrize("kind", KINDS)
def test_both_fills_are_what_the_fill_rule_says(
    kind: Callable[[np.random.Generator], list[Any]], fill_rule: str, rng: np.random.Generator
) -> None:
    size = (14, 11)
    for n in range(12):
        bits = (8, 4, 16, 12)[n % 4]
        rings = kind(rng) + ([np.asarray(ring)[::-1] for ring in kind(rng)] if n % 2 else [])
        expected = inside([ring for ring in rings if len(ring) > 2], size, fill_rule, bits)
        for algorithm in FILLS:
            assert np.array_equal(filled(rings, size, fill_rule=fill_rule, algorithm=algorithm, subpixel_bits=bits), expected)


@given(
    st.lists(st.lists(st.tuples(st.integers(-4, 20), st.integers(-4, 20)), max_size=9), max_size=4),
    st.sampled_from(FILL_RULES),
    st.sampled_from([0.5, 1.0, 0.25, 1 / 3]),
)
@settings(max_examples=120)
def test_any_rings(rings: Any, fill_rule: str, scale: float) -> None:
    rings = [np.array(ring, float).reshape(-1, 2) * scale for ring in rings]
    kept = [ring for ring in rings if len(ring) > 2]
    expected = inside(kept, (9, 8), fill_rule)
    for algorithm in FILLS:
        assert np.array_equal(filled(rings, (9, 8), fill_rule=fill_rule, algorithm=algorithm), expected)


def square(side: int, turn: int) -> NDArray[Any]:
    """Return a square round (20, 20), counter-clockwise as seen for a turn of 1."""
    low, high = 20 - side // 2, 20 + side // 2
    return np.array([(low, low), (low, high), (high, high), (high, low)])[::turn]


@pytest.mark.parametrize(
    ("turns", "areas"),
    [
        # Squares of 900, 400 and 100 pixels; even-odd, non-zero, positive, negative, abs-geq-two.
        ((1, 1, 1), (600, 900, 900, 0, 400)),
        ((-1, -1, -1), (600, 900, 0, 900, 400)),
        ((1, -1, 1), (600, 600, 600, 0, 0)),
        ((1, -1, -1), (600, 600, 500, 100, 0)),
        ((1, 1, -1), (600, 900, 900, 0, 300)),
    ],
)
@pytest.mark.parametrize("algorithm", FILLS)
def test_nested_squares_of_the_red_book(turns: tuple[int, ...], areas: tuple[int, ...], algorithm: str) -> None:
    rings = [square(side, turn) for side, turn in zip((30, 20, 10), turns)]
    found = [int(filled(rings, (40, 40), fill_rule=rule, algorithm=algorithm).sum()) for rule in FILL_RULES]
    assert tuple(found) == areas


@pytest.mark.parametrize("algorithm", FILLS)
def test_even_odd_and_scanline_are_the_defaults(algorithm: str) -> None:
    rings = [square(30, 1), square(20, 1)]
    assert filled(rings, (40, 40)).sum() == 500
    assert np.array_equal(filled(rings, (40, 40)), filled(rings, (40, 40), algorithm=algorithm, fill_rule="even-odd"))


def test_rings_as_they_may_come() -> None:
    ring = [(1, 1), (6, 1), (6, 5), (1, 5)]
    for rings in (ring, [ring], np.array(ring), np.array([ring], np.float32), [*ring, ring[0]], [np.array(ring)], tuple(ring)):
        assert filled(rings, (8, 7)).sum() == 20
    assert filled([ring, [], [(0, 0)], [(2, 2), (3, 3)]], (8, 7)).sum() == 20
    assert filled([[], ring], (8, 7)).sum() == 20


@pytest.mark.parametrize("algorithm", FILLS)
@pytest.mark.parametrize("blend", BLENDS)
def test_a_translucent_polygon_touches_each_pixel_once(blend: str, algorithm: str, rng: np.random.Generator) -> None:
    rings = [rng.uniform(-4, 34, (15, 2)), rng.integers(0, 30, (8, 2)) + 0.5]
    for rule in FILL_RULES:
        canvas = ss.Canvas(30, 30, "black", blend=blend)
        canvas.polygon(rings, HALF_WHITE, fill_rule=rule, algorithm=algorithm)
        held = inside(rings, (30, 30), rule)
        assert np.array_equal(gray(canvas), np.where(held, ONCE[blend], 0))


@pytest.mark.parametrize("algorithm", [*PAINTERS, *FILLS])
def test_neighbours_leave_no_gap_and_paint_no_pixel_twice(algorithm: str, rng: np.random.Generator) -> None:
    for n in range(3):
        # Cut the plane into triangles; their corners lie anywhere, on samples, or in a few columns and rows.
        points = rng.uniform(-5, 45, (60, 2)) if n == 0 else rng.integers(-5, 45, (60, 2)) / n + 0.5
        corners = np.unique(np.concatenate([points, [(-90, -90), (130, -90), (130, 130), (-90, 130)]]), axis=0)
        triangles = corners[Delaunay(corners).simplices]
        canvas = ss.Canvas(40, 40, "black", blend="srgb")
        if algorithm in PAINTERS:
            canvas.triangles(triangles, HALF_WHITE, algorithm=algorithm)
        else:
            for triangle in triangles:
                canvas.polygon(triangle, HALF_WHITE, algorithm=algorithm)
        assert (gray(canvas) == 128).all()


@pytest.mark.parametrize("algorithm", FILLS)
def test_polygons_along_wild_chains_own_each_pixel_once(algorithm: str, rng: np.random.Generator) -> None:
    for _ in range(6):
        # Strips between chains that go down from side to side; neighbours share a chain, seen from its other side.
        heights = [np.concatenate([[-3], np.sort(rng.uniform(-2, 42, 12)), [43]]) for _ in range(3)]
        sides = [np.stack([rng.uniform(k * 13 + 1, k * 13 + 13, 14), y], axis=1) for k, y in enumerate(heights)]
        chains = [np.array([(-9.0, -3), (-9, 43)]), *sides, np.array([(60.0, -3), (60, 43)])]
        canvas = ss.Canvas(40, 40, "black", blend="srgb")
        for left, right in pairwise(chains):
            canvas.polygon(np.concatenate([left, right[::-1]]), HALF_WHITE, algorithm=algorithm)
        assert (gray(canvas) == 128).all()


# Faults that users reported of others


def outlined(points: Any, size: tuple[int, int]) -> tuple[Booleans, Booleans]:
    """Return the pixels of a polygon and those of its outline, its corners being pixel centres."""
    ring = np.asarray(points, float) + 0.5
    canvas = ss.Canvas(*size, "black")
    canvas.polyline(ring, "white", closed=True)
    return filled(ring, size), gray(canvas) == 255


def neighbours(pixels: Booleans) -> Booleans:
    """Return the pixels beside some pixels."""
    room = np.pad(pixels, 1)
    beside: Booleans = room[:-2, 1:-1] | room[2:, 1:-1] | room[1:-1, :-2] | room[1:-1, 2:]
    return beside


def test_opencv_26130_a_fill_stays_within_its_outline() -> None:
    fill, outline = outlined([(44, 27), (7, 37), (7, 19), (38, 19)], (50, 50))
    assert fill.sum() > 400
    assert not (neighbours(fill & ~outline) & ~(fill | outline)).any()
    assert np.array_equal(fill, inside([np.array([(44, 27), (7, 37), (7, 19), (38, 19)]) + 0.5], (50, 50), "even-odd"))


def test_opencv_22012_corners_outside_the_image_leave_no_dots() -> None:
    for y in range(128, -50, -6):
        ring = np.array([(100, 256 - y), (256, 256), (256, 0)])
        fill = filled(ring, (256, 256))

        # The image is a part of a larger one in which all corners lie.
        whole = filled(ring + 60, (400, 400))
        assert np.array_equal(fill, whole[60:316, 60:316])
        for row in fill:
            assert np.count_nonzero(np.diff(row.astype(int))) <= 1  # once inside, inside to the right border


def test_opencv_9016_a_polygon_of_no_height_draws_no_line_across_the_image() -> None:
    for algorithm in FILLS:
        for shift in (0.0, 0.5):
            ring = np.array([(6, 20), (14, 20), (13, 20)]) + shift
            assert not filled(ring, (91, 91), algorithm=algorithm).any()
    canvas = ss.Canvas(91, 91, "black")
    canvas.triangles([np.array([(6, 20), (14, 20), (13, 20)]) + 0.5], "white")
    assert not gray(canvas).any()


def test_pillow_6414_a_fill_stays_within_a_wavy_outline(rng: np.random.Generator) -> None:
    for _ in range(5):
        # A level bottom, and a top that goes up and down by less than a pixel, and by more.
        top = [(20.0 * k, 30 + float(v)) for k, v in enumerate(rng.uniform(-2, 2, 10))]
        ring = [*top, (180.0, 60.0), (0.0, 60.0)]
        fill = filled(ring, (185, 70))
        assert np.array_equal(fill, inside([ring], (185, 70), "even-odd"))
        for i, column in enumerate(fill.T[:180]):
            height = np.interp(i + 0.5, [x for x, _ in top], [y for _, y in top])
            rows = np.flatnonzero(column)
            assert height - 1 / 128 <= rows[0] + 0.5 <= height + 1 + 1 / 128
            assert (rows[-1], len(rows)) == (59, 60 - rows[0])


@pytest.mark.parametrize("algorithm", FILLS)
def test_pillow_7104_a_polygon_is_as_wide_as_its_corners_say(algorithm: str) -> None:
    for width in range(5):
        for height in range(5):
            ring = [(3, 2), (3 + width, 2), (3 + width, 2 + height), (3, 2 + height)]
            expected = np.zeros((12, 12), bool)
            expected[2 : 2 + height, 3 : 3 + width] = True
            for turned in (ring, ring[::-1], ring[2:] + ring[:2]):
                assert np.array_equal(filled(turned, (12, 12), algorithm=algorithm), expected)


def test_pillow_8616_a_band_along_a_curve_has_no_holes() -> None:
    # There and back along a curve, with many corners in one row and steps of less than a pixel.
    angle = np.linspace(0.2, 6.0, 400)
    arm = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.concatenate([60 + 50 * arm, 60 + 41 * arm[::-1]])
    for corners in (ring, np.rint(ring), np.rint(ring) + 0.5):
        for rule in ("even-odd", "non-zero"):
            fill = filled(corners, (120, 120), fill_rule=rule)
            assert np.array_equal(fill, inside([corners], (120, 120), rule))

            # Between the two arcs, a pixel away from both, all is filled.
            away = np.arange(120) + 0.5 - 60
            radius, turn = np.hypot(away, away[:, None]), np.arctan2(away[:, None], away + 0 * away[:, None]) % (2 * np.pi)
            between = (radius > 42.5) & (radius < 48.5) & (turn > 0.25) & (turn < 5.95)
            assert fill[between].all()
            assert not fill[(radius < 39.5) | (radius > 51.5)].any()


@pytest.mark.parametrize("algorithm", FILLS)
def test_scikit_image_7271_no_corner_is_favoured(algorithm: str, rng: np.random.Generator) -> None:
    # Mirrored polygons give mirrored pictures where no sample lies on an edge; the corners are odd numbers of sub-pixels.
    for _ in range(20):
        ring = (rng.integers(0, 20 * 128, (7, 2)) * 2 + 1) / 256
        fill = filled(ring, (20, 20), algorithm=algorithm)
        on_edge = inside([ring], (20, 20), "even-odd") ^ inside([20 - ring], (20, 20), "even-odd")[::-1, ::-1]
        for mirror in ((-1, 1), (1, -1), (-1, -1)):
            mirrored = np.where(np.array(mirror) < 0, 20 - ring, ring)
            again = filled(mirrored, (20, 20), algorithm=algorithm)[:: mirror[1], :: mirror[0]]
            assert (again == fill)[~on_edge].all()

    # The middle of what is covered is the middle of the shape, on the average over all places in a pixel.
    ring, offsets = np.array([(-4.3, -3.1), (5.2, -2.4), (3.3, 4.8)]), []
    ring = np.concatenate([ring, -ring])
    for x, y in np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1).reshape(-1, 2) / 12 + 10:
        rows, columns = np.nonzero(filled(ring + np.array((x, y)), (20, 20), algorithm=algorithm))
        offsets.append((columns.mean() + 0.5 - x, rows.mean() + 0.5 - y))
    assert np.abs(np.mean(offsets, axis=0)).max() < 0.01
