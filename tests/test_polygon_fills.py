"""Polygons filled by triangles and by flooding: where they are the scan line's picture, and where and how they may differ."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import scanspan as ss
from tests.painting import BLENDS, FILL_RULES, HALF_WHITE, ONCE, Booleans, filled, gray, inside
from tests.test_tessellation import crossing, ring_edges

BOTH = ["triangles", "flood"]


def crossing_edges(rings: Any, bits: int) -> list[Any]:
    """Return the edges that cross another away from the grid."""
    found = []
    for a, b in combinations(ring_edges(rings, bits), 2):
        where = crossing(a, b)
        if where and any(v * 2**bits % 1 for v in where):
            found += [a, b]
    return found


def touched(rings: Any, size: tuple[int, int], bits: int = 8) -> Booleans:
    """Return the pixels whose closed squares edges meet."""
    lines = shapely.union_all([shapely.LineString([[float(v) for v in p] for p in edge]) for edge in ring_edges(rings, bits)])
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    met: Booleans = shapely.intersects(shapely.box(x, y, x + 1, y + 1), lines)
    return met


coordinate = st.integers(-10, 60)
rings_of_quarters = st.lists(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=9), min_size=1, max_size=3)


@given(rings_of_quarters, st.sampled_from(FILL_RULES), st.sampled_from([4, 8]))
@settings(max_examples=150)
def test_triangles_are_the_scan_lines_picture_wherever_no_edges_cross(rings: Any, fill_rule: str, bits: int) -> None:
    rings, size = [np.array(ring) / 4 for ring in rings], (12, 11)
    expected = filled(rings, size, fill_rule=fill_rule, subpixel_bits=bits)
    found = filled(rings, size, fill_rule=fill_rule, subpixel_bits=bits, algorithm="triangles")
    crossed = crossing_edges(rings, bits)
    if not crossed:
        assert np.array_equal(found, expected)

    # Where they do, samples that differ lie within two sub-pixels of an edge that crosses.
    for y, x in np.argwhere(found != expected):
        near = [shapely.LineString([[float(v) for v in p] for p in edge]) for edge in crossed]
        assert min(line.distance(shapely.Point(x + 0.5, y + 0.5)) for line in near) <= 2 / 2**bits


@pytest.mark.parametrize("fill_rule", FILL_RULES)
def test_triangles_of_large_polygons_with_holes_are_the_scan_lines_picture(fill_rule: str, rng: np.random.Generator) -> None:
    angle, size = np.arange(300) * 2 * np.pi / 300, (100, 100)
    for bits in (4, 8, 16):
        outer, hole = 48 * (1 - 0.3 * rng.random(300)), 20 * (1 - 0.5 * rng.random(300))
        turned = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        rings = [50 + outer[:, None] * turned, 50 + hole[:, None] * turned[::-1]]
        found = filled(rings, size, fill_rule=fill_rule, algorithm="triangles", subpixel_bits=bits)
        assert np.array_equal(found, inside(rings, size, fill_rule, bits))


@pytest.mark.parametrize("algorithm", BOTH)
@pytest.mark.parametrize("blend", BLENDS)
def test_translucent_fills_touch_each_pixel_once(blend: str, algorithm: str, rng: np.random.Generator) -> None:
    rings = [rng.uniform(-4, 34, (15, 2)), rng.integers(0, 30, (8, 2)) + 0.5]
    for rule in FILL_RULES:
        canvas = ss.Canvas(30, 30, "black", blend=blend)
        canvas.polygon(rings, HALF_WHITE, fill_rule=rule, algorithm=algorithm)
        assert set(np.unique(gray(canvas))) == {0, ONCE[blend]}
        opaque = filled(rings, (30, 30), fill_rule=rule, algorithm=algorithm)
        assert np.array_equal(gray(canvas) > 0, opaque)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_change_no_pixel(threads: int, rng: np.random.Generator) -> None:
    rings = [rng.uniform(0, 600, (400, 2))]
    pictures = []
    for number in (1, threads):
        canvas = ss.Canvas(600, 600, "black", threads=number)
        canvas.polygon(rings, HALF_WHITE, algorithm="triangles")
        pictures.append(canvas.pixels)
    assert np.array_equal(*pictures)


# Flooding


@given(rings_of_quarters, st.sampled_from(FILL_RULES), st.sampled_from([4, 8, 16]))
@settings(max_examples=150)
def test_flooding_adds_pixels_of_the_outline_and_loses_none(rings: Any, fill_rule: str, bits: int) -> None:
    rings, size = [np.array(ring) / 4 for ring in rings], (12, 11)
    expected = inside(rings, size, fill_rule, bits)
    found = filled(rings, size, fill_rule=fill_rule, algorithm="flood", subpixel_bits=bits)
    assert found[expected].all()
    assert not (found & ~expected & ~touched(rings, size, bits)).any()


@given(st.lists(st.lists(st.tuples(st.integers(0, 900), st.integers(0, 900)), min_size=3, max_size=7), min_size=1, max_size=2))
@settings(max_examples=120)
def test_flooding_leaks_nowhere(rings: Any) -> None:
    rings, size = [np.array(ring) / 128 for ring in rings], (8, 8)
    expected = inside(rings, size, "non-zero")
    found = filled(rings, size, fill_rule="non-zero", algorithm="flood")
    assert found[expected].all()
    assert not (found & ~expected & ~touched(rings, size)).any()


@pytest.mark.parametrize("fill_rule", FILL_RULES)
def test_flooding_finds_every_region_and_leaves_holes_open(fill_rule: str) -> None:
    # Three squares in each other, all counter-clockwise as seen, and beside them one that turns the other way.
    rings = [np.array([(x, x), (x, 40 - x), (40 - x, 40 - x), (40 - x, x)]) + 0.5 for x in (2, 8, 14)]
    rings.append(np.array([(50, 5), (70, 5), (70, 35), (50, 35)]) + 0.5)
    found, expected = filled(rings, (80, 44), fill_rule=fill_rule, algorithm="flood"), inside(rings, (80, 44), fill_rule)
    held = [bool(found[y, x]) for x, y in ((5, 5), (11, 11), (20, 20), (60, 20), (45, 20))]
    assert held == {
        "even-odd": [True, False, True, True, False], "non-zero": [True, True, True, True, False],
        "positive": [True, True, True, False, False], "negative": [False, False, False, True, False],
        "abs-geq-two": [False, True, True, False, False],
    }[fill_rule]  # fmt: skip
    away = ~touched(rings, (80, 44))
    assert np.array_equal(found[away], expected[away])
    for ring in rings:
        x, y = ring.astype(int).T
        assert found[y, x].all()


def test_flooding_a_concave_shape_with_many_regions() -> None:
    # A comb whose teeth are parted by the image's border, so that every tooth needs a seed of its own.
    teeth = [(x + dx, y) for x in range(0, 60, 6) for dx, y in ((0, -5), (0, 25), (4, 25), (4, -5))]
    ring = np.array([(-3, -9), *[(x - 1.2, y) for x, y in teeth], (62, -9)], float)
    found, expected = filled(ring, (60, 30), algorithm="flood"), inside([ring], (60, 30), "even-odd")
    away = ~touched([ring], (60, 30))
    assert expected[away].sum() > 300
    assert np.array_equal(found[away], expected[away])


def test_flooding_what_lies_within_a_pixel_and_far_away() -> None:
    tiny = np.array([(3.4, 3.4), (3.6, 3.4), (3.5, 3.6)])
    assert np.argwhere(filled(tiny, (8, 8), algorithm="flood")).tolist() == [[3, 3]]
    for shift in ((50, 0), (-50, 0), (0, 50), (0, -50), (2.0**24 - 8, 0)):
        assert not filled(tiny + shift, (8, 8), algorithm="flood").any()
    wide = np.array([(-(2.0**24), -(2.0**24)), (2.0**24, -(2.0**24)), (2.0**24, 2.0**24), (-(2.0**24), 2.0**24)])
    assert filled(wide, (8, 8), algorithm="flood", subpixel_bits=16).all()
    assert filled([wide, tiny], (8, 8), algorithm="flood", subpixel_bits=16).all()
    assert not filled([], (8, 8), algorithm="flood").any()
    assert not filled([], (8, 8), algorithm="triangles").any()


def test_a_polygon_without_an_area_is_nothing_in_triangles_and_its_outline_when_flooded() -> None:
    line = [(1.5, 1.5), (6.5, 1.5), (6.5, 1.5), (1.5, 1.5), (4.5, 1.5)]
    assert not filled(line, (8, 8), algorithm="triangles").any()
    assert np.argwhere(filled(line, (8, 8), algorithm="flood")).tolist() == [[1, x] for x in range(1, 7)]


def test_the_outline_of_neighbours_is_what_flooding_draws_twice() -> None:
    left, right = [(1, 1), (5, 1), (5, 6), (1, 6)], [(5, 1), (9, 1), (9, 6), (5, 6)]
    both = [filled(np.array(ring) + 0.5, (12, 9), algorithm="flood") for ring in (left, right)]
    assert np.argwhere(both[0] & both[1])[:, 1].tolist() == [5] * 6
    for a, b in pairwise(["scanline", "parity", "triangles"]):
        assert np.array_equal(filled(left, (12, 9), algorithm=a), filled(left, (12, 9), algorithm=b))
