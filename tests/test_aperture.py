"""Apertures: tents against rationals, Gaussians against their integral; tilings; what cannot be asked for."""

from __future__ import annotations

from fractions import Fraction
from math import erf, sqrt

import numpy as np
import pytest
from scipy.spatial import Delaunay

import scanspan as ss
from tests.test_area import cut, snapped, star

SIZE = (8, 6)
LIMIT = 2.0**-40


def moment(ring, x, y):
    """Return the integral of (X - x) (Y - y) over a ring of Fractions, by its edges; with it those of 1, X - x and Y - y."""
    total = [Fraction(0)] * 4
    for (ax, ay), (bx, by) in zip(ring, ring[1:] + ring[:1], strict=True):
        ax, ay, bx, by = ax - x, ay - y, bx - x, by - y
        turn = ax * by - bx * ay
        total[0] += turn / 2
        total[1] += turn * (ax + bx) / 6
        total[2] += turn * (ay + by) / 6
        total[3] += turn * (2 * ax * ay + ax * by + bx * ay + 2 * bx * by) / 24
    return total


def exact_tents(points, size):
    """Return the integral of each pixel's tent over a polygon, in rationals: a product of two lines in each of four squares."""
    ring = [(Fraction(float(x)), Fraction(float(y))) for x, y in snapped(points)]
    sign = 1 if moment(ring, 0, 0)[0] > 0 else -1
    out = np.empty((size[1], size[0]), object)
    for j in range(size[1]):
        for i in range(size[0]):
            x, y, total = i + Fraction(1, 2), j + Fraction(1, 2), Fraction(0)
            for right in (0, 1):
                for below in (0, 1):
                    part = cut(cut(ring, 0, x - 1 + right, True), 0, x + right, False)
                    part = cut(cut(part, 1, y - 1 + below, True), 1, y + below, False)
                    area, along_x, along_y, both = moment(part, x, y)
                    u, v = (-1 if right else 1), (-1 if below else 1)
                    total += area + u * along_x + v * along_y + u * v * both
            out[j, i] = sign * total
    return out


@pytest.mark.parametrize("radius", [0.4, 3.0, 60.0, 1e5])
def test_tents_equal_rationals(radius, rng):
    for corners in (3, 4, 9):
        points = star(rng, corners, radius, (4, 3))
        found, expected = ss.coverage(points, SIZE, mode="area", aperture="tent"), exact_tents(points, SIZE)
        assert max(abs(Fraction(float(a)) - b) for a, b in zip(found.flat, expected.flat, strict=True)) <= LIMIT


def test_a_wrong_tent_is_noticed(rng):
    points = star(rng, 5, 3.0, (4, 3))
    found, expected = ss.coverage(points + 2.0**-16, SIZE, mode="area", aperture="tent"), exact_tents(points, SIZE)
    assert max(abs(Fraction(float(a)) - b) for a, b in zip(found.flat, expected.flat, strict=True)) > LIMIT


def test_a_point_is_seen_by_four_tents():
    # A small square at a quarter between four centres gives each its bilinear share.
    e = 2.0**-10
    points = np.array([(-e, -e), (e, -e), (e, e), (-e, e)]) + np.array((2.75, 1.75))
    shares = ss.coverage(points, (5, 4), mode="area", aperture="tent") / (4 * e * e)
    assert np.allclose(shares[1:3, 2:4], [[0.5625, 0.1875], [0.1875, 0.0625]], atol=1e-9)
    assert shares.sum() == pytest.approx(1)


def tiles(rng, size):
    points = np.concatenate([rng.uniform(-3, 12, (40, 2)), [(-9, -9), (30, -9), (-9, 30), (30, 30)]])
    points = np.rint(points * 65536) / 65536
    return points[Delaunay(points).simplices]


def test_tents_over_tilings_add_up_to_exactly_one(rng):
    total = sum(ss.coverage(tile, SIZE, mode="area", aperture="tent") for tile in tiles(rng, SIZE))
    assert (total == 1.0).all()


def test_gaussians_over_tilings_add_up_to_one(rng):
    total = sum(ss.coverage(tile, SIZE, mode="area", aperture="gaussian") for tile in tiles(rng, SIZE))
    assert np.abs(total - 1.0).max() < LIMIT


def normal(x):
    """Return the share of a Gaussian, half a pixel wide and cut off at three times that, that lies left of x."""
    low, high = (0.5 * (1 + erf(k / sqrt(2))) for k in (-3, 3))
    return (0.5 * (1 + erf(min(max(x / 0.5, -3), 3) / sqrt(2))) - low) / (high - low)


@pytest.mark.parametrize("axis", [0, 1])
def test_gaussians_at_a_border_are_right_to_the_stated_error(axis):
    worst = 0.0
    for shift in np.linspace(0, 1, 23):
        points = np.array([(-20, -20), (4 + shift, -20), (4 + shift, 40), (-20, 40)])
        found = ss.coverage(points[:, ::-1] if axis else points, (9, 9), mode="area", aperture="gaussian")
        line = found[:, 4] if axis else found[4]
        worst = max(worst, max(abs(line[i] - normal(4 + shift - i - 0.5)) for i in range(9)))
    assert 2.0**-13 < worst < 2.0**-11


def test_gaussians_of_shapes_are_right_to_the_stated_error(rng):
    for _ in range(4):
        low, high = np.sort(rng.uniform(-2.2, 2.2, (2, 2)), axis=0)
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        found = ss.coverage(np.array(corners) + 3.5, (7, 7), mode="area", aperture="gaussian")[3, 3]
        expected = (normal(high[0]) - normal(low[0])) * (normal(high[1]) - normal(low[1]))
        assert abs(found - expected) < 2.0**-9


def test_shapes_may_cross_themselves_and_have_holes(rng):
    points = rng.uniform(-2, 9, (7, 2))
    hole = star(rng, 6, 1.5, (4, 3))
    outer = [(-5, -5), (15, -5), (15, 15), (-5, 15)]
    for aperture in ("tent", "gaussian"):
        options = {"mode": "area", "aperture": aperture}
        whole, part = ss.coverage(outer, SIZE, **options), ss.coverage(hole, SIZE, **options)
        assert np.abs(ss.coverage([outer, hole], SIZE, **options) - (whole - part)).max() < LIMIT
        inside = ss.coverage(points, SIZE, fill_rule="non-zero", **options)
        assert inside.min() > -LIMIT
        assert inside.max() < 1 + LIMIT


def test_an_antialiased_polygon_takes_an_aperture(rng):
    points = star(rng, 7, 2.5, (4, 3))
    for aperture in ("box", "tent", "gaussian"):
        canvas = ss.Canvas(*SIZE, "black", blend="srgb")
        canvas.polygon(points, "white", antialias=aperture)
        share = np.clip(ss.coverage(points, SIZE, mode="area", aperture=aperture), 0, 1)
        assert np.abs(canvas.pixels[..., 0] - 255 * share).max() < 0.51
    boxes = ss.Canvas(*SIZE, "black", blend="srgb")
    boxes.polygon(points, "white", antialias=True)
    assert not np.array_equal(boxes.pixels, canvas.pixels)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"aperture": "disc"}, "unknown aperture 'disc'"),
        ({"aperture": None}, "unknown aperture None"),
        ({"mode": "center", "aperture": "tent"}, "aperture = 'tent': a pixel's centre has none; it goes with mode = 'area'"),
        ({"aperture": "gaussian", "size": (1 << 15, 1), "rings": [(0, 0), (1 << 23, 0), (0, 1)]},
         "aperture = 'gaussian': the limits are 32768 pixels a side and corners within 4194304 pixels"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_quoted(options, message):
    arguments = {"rings": [(0, 0), (1, 0), (1, 1)], "size": (3, 3), "mode": "area"} | options
    with pytest.raises(ss.InputError) as caught:
        ss.coverage(**arguments)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("value", "message"),
    [("disc", "unknown aperture 'disc'"), (1, "antialias = 1: must be True, False, 'box', 'tent', 'gaussian'"),
     (None, "antialias = None: must be True")],
)  # fmt: skip
def test_what_is_no_aperture_is_quoted(value, message):
    with pytest.raises(ss.InputError, match=message):
        ss.Canvas(3, 3).polygon([(0, 0), (1, 0), (1, 1)], "red", antialias=value)
