"""The sweep of exact areas: against the same without steps, lists or events; rows of hundreds of edges; bands; every side."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.geometry.fixed_point import snap_points
from scanspan.raster import area
from scanspan.raster.area_pieces import make_sweep
from scanspan.raster.shares import Shares, add_shares
from tests import slow_area

LIMIT = 2.0**-40
RULES = ["even-odd", "non-zero", "positive", "negative", "abs-geq-two"]


def slow_coverage(rings, size, rule=0):
    """Return areas from the oracle."""
    points = [snap_points(np.asarray(ring, float), 16) for ring in rings]
    starts = np.cumsum([0, *map(len, points)]).astype(np.int32)
    out = np.empty((size[1], size[0]))
    slow_area.area_kernel(slow_area.gather_edges(np.concatenate(points), starts, size[1]), rule, out)
    return out


def in_bands(rings, size, rule, step):
    """Return areas that were made a few rows at a time, each band from nothing."""
    points = [snap_points(np.asarray(ring, float), 16) for ring in rings]
    starts = np.cumsum([0, *map(len, points)]).astype(np.int32)
    areas = area.make_areas(np.concatenate(points), starts, np.array([0, len(rings)], np.int32), size)
    out = np.zeros((size[1], size[0]))
    for y in range(0, size[1], step):
        sweep = make_sweep(len(areas.edges), size[0])
        y_end = min(y + step, size[1])
        target = Shares(out[y:y_end], np.zeros(1), 0, size[0], y)
        add_shares(target, y, y_end, areas, rule, sweep, np.zeros(1, np.int64))
    return out


def comb(rng, teeth, size):
    """Return a polygon that goes up and down across the image, with two edges a tooth in every row, and crosses nowhere."""
    x = np.sort(rng.uniform(0, size[0], 2 * teeth)) + 1e-3 * np.arange(2 * teeth)
    lean = np.linspace(-3, 3, 2 * teeth)
    top = np.stack([x + lean, np.where(np.arange(2 * teeth) % 2, size[1] - 0.5, rng.uniform(0, 1, 2 * teeth))], axis=1)
    return np.concatenate([top, [(size[0] + 9, size[1] + 2.0), (-9, size[1] + 2.0)]])


def star(rng, corners, middle, reach):
    angle = (np.arange(corners) + 0.5) * (2 * np.pi / corners)
    radius = np.where(np.arange(corners) % 2, 0.3, 0.9) * reach * rng.uniform(0.9, 1, corners)
    return np.c_[middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle)]


@pytest.mark.parametrize("shape", ["comb", "star", "far"])
def test_rows_of_hundreds_of_edges_are_those_of_the_oracle(shape, rng):
    size = (90, 12)
    ring = comb(rng, 150, size) if shape == "comb" else star(rng, 900, (45.3, 6.1), 60.0 if shape == "star" else 3e5)
    found = ss.coverage(ring, size, mode="area")
    assert np.array_equal(found, slow_coverage([ring], size))
    assert 0.1 < found.mean() < 0.9 or shape == "far"


@pytest.mark.parametrize("rule", RULES)
def test_hundreds_of_crossings_in_a_row_are_those_of_the_oracle(rule, rng):
    size = (40, 6)
    rings = [rng.uniform(-5, 45, (90, 2)) * (1, 0.3), rng.integers(-2, 42, (30, 2)) * (1, 0.25)]
    found = ss.coverage(rings, size, mode="area", fill_rule=rule)
    assert np.abs(found - slow_coverage(rings, size, RULES.index(rule))).max() < LIMIT
    assert np.array_equal(in_bands(rings, size, RULES.index(rule), 1), found)
    assert np.array_equal(in_bands(rings, size, RULES.index(rule), 4), found)


COARSE = st.tuples(st.integers(-8, 40).map(lambda v: v / 4), st.integers(-8, 32).map(lambda v: v / 4))


@given(st.lists(COARSE, min_size=3, max_size=14), st.sampled_from(RULES))
def test_corners_on_edges_and_edges_on_edges(points, rule):
    size = (8, 6)
    found = ss.coverage([points, points[::2]], size, mode="area", fill_rule=rule)
    rings = [ring for ring in (points, points[::2]) if len(ring) > 2]
    assert np.abs(found - slow_coverage(rings, size, RULES.index(rule))).max() < LIMIT
    assert np.array_equal(in_bands(rings, size, RULES.index(rule), 1), found)


def test_edges_that_begin_and_end_within_a_row(rng):
    # A thousand corners within four rows, and a row that holds the whole polygon.
    size = (30, 5)
    ring = star(rng, 1000, (15.2, 2.6), 2.3) * (1, 1)
    assert np.array_equal(ss.coverage(ring, size, mode="area"), slow_coverage([ring], size))
    ring = ring * (5, 0.1) - (60, -2.3)
    assert np.array_equal(ss.coverage(ring, size, mode="area"), slow_coverage([ring], size))


@pytest.mark.parametrize("scale", [1.0, 1e3, 1.6e6])
def test_edges_that_pass_both_sides_of_the_image_in_one_row(scale, rng):
    size = (7, 9)
    for _ in range(20):
        ring = rng.uniform(-10, 10, (5, 2)) * (scale, 1) + (3, 4)
        found = ss.coverage(ring, size, mode="area", fill_rule="non-zero")
        assert np.abs(found - slow_coverage([ring], size, 1)).max() < LIMIT
        assert np.array_equal(in_bands([ring], size, 1, 2), found)


def test_steps_are_what_divisions_give(rng):
    # Edges so long that a thousand rows and columns are stepped, with slopes that never come out even.
    size = (700, 500)
    for _ in range(4):
        ring = rng.uniform(-0.2, 1.2, (3, 2)) * size
        assert np.array_equal(ss.coverage(ring, size, mode="area"), slow_coverage([ring], size))


def test_ten_thousand_edges_in_a_row_take_no_minutes(rng):
    # Comparing each with each would. The comb lies within the image, so that its area is known.
    size = (256, 3)
    ring = comb(rng, 5000, (250, 2))[:-2] * (0.9, 1) + (6, 0)
    ring = np.concatenate([ring, [(ring[-1, 0], 2.75), (ring[0, 0], 2.75)]])
    x, y = snap_points(ring, 16).T / 65536
    expected = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    assert abs(ss.coverage(ring, size, mode="area").sum() - expected) < 1e-6
