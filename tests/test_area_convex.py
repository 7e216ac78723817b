"""Short ways in the sweep of areas: convex polygons edge by edge, and rows in which little happens; the bits are the same."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.fixed_point import snap_points
from scanspan.raster.area import make_areas
from scanspan.raster.area_pieces import make_sweep
from scanspan.raster.shares import Shares, add_shares
from tests.test_area_sweep import LIMIT, RULES, slow_coverage

SIZE = (60, 40)


def covered(rings, rule, is_swept, step=SIZE[1]):
    """Return the sum of what polygons of one ring each cover, and which of them were found convex."""
    xy, starts = snap_points(np.concatenate(rings), 16), np.cumsum([0, *map(len, rings)]).astype(np.int32)
    polygons = np.arange(len(rings) + 1, dtype=np.int32)
    areas, out = make_areas(xy, starts, polygons, SIZE, is_swept), np.zeros(SIZE[::-1])
    sweep = make_sweep(int(np.diff(areas.starts).max()), SIZE[0])
    for y in range(0, SIZE[1], step):
        target = Shares(out[y : y + step], np.zeros(1), 0, SIZE[0], y)
        add_shares(target, y, min(y + step, SIZE[1]), areas, rule, sweep, np.zeros(len(rings), np.int64))
    return out, areas.windings


def rectangle(rng, width):
    """Return the outline of a line somewhere in the image."""
    middle, angle, length = rng.uniform(5, (55, 35)), rng.uniform(0, 7), rng.uniform(0.01, 30)
    along = np.array([np.cos(angle), np.sin(angle)])
    aside, along = np.array([-along[1], along[0]]) * width / 2, along * length / 2
    return np.array([middle + along + aside, middle + along - aside, middle - along - aside, middle - along + aside])


def ellipse(rng, corners):
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    return rng.uniform(20, (40, 20)) + np.c_[np.cos(angle) * rng.uniform(0.1, 18), np.sin(angle) * rng.uniform(0.1, 18)]


@pytest.mark.parametrize("rule", range(len(RULES)))
def test_convex_polygons_have_the_bits_of_the_sweep(rule, rng):
    rings = [rectangle(rng, width) for width in (0.001, 0.1, 1.0, 7.0) for _ in range(15)]
    rings += [ellipse(rng, corners) for corners in (3, 5, 40) for _ in range(10)]
    rings = [ring[::-1] if k % 2 else ring for k, ring in enumerate(rings)]
    for ring in rings:
        found, windings = covered([ring], rule, False)
        assert np.array_equal(found, covered([ring], rule, True)[0])
    assert windings[0] != 0


def test_convex_polygons_are_found():
    square = np.array([(3.0, 3), (9, 3), (9, 9), (3, 9)])
    turns = 2 * np.pi * 2 / 5 * np.arange(5)
    star = np.c_[10 + 8 * np.cos(turns), 12 + 8 * np.sin(turns)]  # goes round twice
    beside = [square + np.array(move) for move in ((-4, 0), (52, 0), (0, -5))]
    rings = [square, square[::-1], star, *beside, np.repeat(square, 2, axis=0)]
    assert np.abs(covered(rings, 0, False)[1]).tolist() == [1, 1, 0, 0, 0, 1, 0]
    assert covered([square, square[::-1]], 0, False)[1].sum() == 0
    assert not covered([square * 30], 0, False)[1].any()
    assert not covered([square], 0, True)[1].any()


def test_convex_polygons_in_bands_are_the_same(rng):
    rings = [rectangle(rng, 1.0) for _ in range(50)] + [ellipse(rng, 30) * (1, 1.6) for _ in range(5)]
    whole = covered(rings, 1, False)[0]
    for step in (1, 7):
        assert np.array_equal(covered(rings, 1, False, step)[0], whole)


def test_a_level_edge_within_a_row_changes_windings_far_away():
    # The upper sides of the teeth lie within rows, and other edges pass below and above them.
    outer = [(2, 2.5), (50, 2.5), (50, 30.25), (2, 30.25)]
    bars = [[(4 + k, 8.5), (40 - k, 8.5), (40 - k, 9.75 + k), (4 + k, 9.75 + k)] for k in range(8)]
    slant = [(10, 0), (11, 0), (31, 39), (30, 39)]
    for rule in range(len(RULES)):
        found = ss.coverage([outer, *bars, slant], SIZE, mode="area", fill_rule=RULES[rule])
        assert np.abs(found - slow_coverage([outer, *bars, slant], SIZE, rule)).max() < LIMIT


@pytest.mark.parametrize("rule", range(len(RULES)))
def test_runs_that_only_cross_themselves(rule, rng):
    for corners in (6, 20, 60):
        ring = rng.uniform(1, 39, (corners, 2)) * (1.4, 1)
        found = ss.coverage(ring, SIZE, mode="area", fill_rule=RULES[rule])
        assert np.abs(found - slow_coverage([ring], SIZE, rule)).max() < LIMIT
