"""Exact area coverage: against rationals, against an arrangement of crossing edges, and as a partition."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import scanspan as ss

SIZE = (10, 8)
LIMIT = 2.0**-40


def snapped(points):
    return np.rint(np.asarray(points, float) * 65536) / 65536


def cut(ring, axis, at, keeps_above):
    """Cut a ring of Fractions by a line, exactly; what runs along the line cancels out in areas."""
    kept = []
    for p, q in zip(ring, ring[1:] + ring[:1], strict=True):
        inside, follows = (p[axis] >= at) == keeps_above, (q[axis] >= at) == keeps_above
        if inside:
            kept.append(p)
        if inside != follows:
            share = (at - p[axis]) / (q[axis] - p[axis])
            kept.append(tuple(a + share * (b - a) for a, b in zip(p, q, strict=True)))
    return kept


def exact_area(ring):
    """Return the area of a ring of Fractions; a simple ring that was cut keeps its sign."""
    return sum((p[0] * q[1] - q[0] * p[1] for p, q in zip(ring, ring[1:] + ring[:1], strict=True)), Fraction(0)) / 2


def exact_coverage(points, size):
    """Return what a simple polygon covers of each pixel, in rationals."""
    ring = [(Fraction(float(x)), Fraction(float(y))) for x, y in snapped(points)]
    out = np.empty((size[1], size[0]), object)
    for j in range(size[1]):
        row = cut(cut(ring, 1, Fraction(j), True), 1, Fraction(j + 1), False)
        for i in range(size[0]):
            out[j, i] = abs(exact_area(cut(cut(row, 0, Fraction(i), True), 0, Fraction(i + 1), False)))
    return out


def check_coverage(points, size=SIZE, expected=None):
    """Compare with rationals, to 2^-40 in every pixel."""
    found = ss.coverage(points, size, mode="area")
    expected = exact_coverage(points, size) if expected is None else expected
    worst = max(abs(Fraction(float(a)) - b) for a, b in zip(found.reshape(-1), expected.reshape(-1), strict=True))
    assert worst <= LIMIT, float(worst)
    return found


def star(rng, corners, radius, middle=(5, 4)):
    angle = (np.arange(corners) + rng.uniform(0, 0.8, corners)) * (2 * np.pi / corners)
    reach = rng.uniform(0.3, 1, corners) * radius
    return np.c_[middle[0] + reach * np.cos(angle), middle[1] + reach * np.sin(angle)]


@pytest.mark.parametrize("radius", [0.3, 3.0, 40.0, 1e4, 1e7])
def test_simple_polygons_equal_rationals(rng, radius):
    for corners in (3, 4, 7, 12):
        check_coverage(star(rng, corners, radius))


def test_a_wrong_area_is_noticed(rng):
    points = star(rng, 5, 4.0)
    with pytest.raises(AssertionError):
        check_coverage(points, expected=exact_coverage(points + 2.0**-16, SIZE))


def test_edges_along_pixels_and_through_corners():
    for points in ([(1, 1), (4, 1), (4, 3), (1, 3)], [(0, 0), (10, 8), (0, 8)], [(-3, -3), (30, -3), (30, 20), (-3, 20)],
                   [(2.5, 0), (2.5, 8), (7.25, 8), (7.25, 0)], [(-2, 1), (12, 1.25), (12, 1.5), (-2, 1.75)],
                   [(20, 1), (30, 1), (30, 5)], [(-20, 1), (-10, 1), (-10, 5)]):  # fmt: skip
        check_coverage(points)


POINT = st.tuples(st.integers(-40, 120).map(lambda v: v / 8), st.integers(-40, 120).map(lambda v: v / 8))


@given(st.tuples(POINT, POINT, POINT))
def test_triangles_equal_rationals(points):
    check_coverage(list(points), (6, 5))


def arrangement(points, rule):
    """Return the faces of a closed line that are inside under a fill rule, by the winding at a point of each."""
    points = snapped(points)
    faces = shapely.polygonize([shapely.node(shapely.LinearRing(points))]).geoms
    inside = {"even-odd": lambda w: w % 2, "non-zero": lambda w: w, "positive": lambda w: w > 0, "negative": lambda w: w < 0,
              "abs-geq-two": lambda w: abs(w) > 1}[rule]  # fmt: skip
    kept = []
    for face in faces:
        x, y = face.representative_point().coords[0]
        winding = 0
        for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
            if (p[1] <= y) != (q[1] <= y) and p[0] + (y - p[1]) * (q[0] - p[0]) / (q[1] - p[1]) < x:
                winding += 1 if q[1] > p[1] else -1
        if inside(winding):
            kept.append(face)
    return kept


@pytest.mark.parametrize("rule", ["even-odd", "non-zero", "positive", "negative", "abs-geq-two"])
def test_crossing_polygons_equal_their_arrangement(rng, rule):
    for _ in range(25):
        points = rng.uniform(-2, 12, (int(rng.integers(4, 9)), 2))
        found = ss.coverage(points, SIZE, mode="area", fill_rule=rule)
        faces = arrangement(points, rule)
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                pixel = shapely.box(i, j, i + 1, j + 1)
                assert abs(sum(face.intersection(pixel).area for face in faces) - found[j, i]) < LIMIT


@pytest.mark.parametrize("shift", [0.0, 0.1, 1 / 3])
def test_tilings_add_up_to_exactly_one(rng, shift):
    inner = rng.uniform(0, 1, (80, 2)) * (16, 12)
    points = snapped(np.concatenate([inner, [(0, 0), (16, 0), (0, 12), (16, 12)]]) * 1.5 - [3 + shift, 2 + shift])
    total = sum(ss.coverage(points[triangle], (16, 12), mode="area") for triangle in Delaunay(points).simplices)
    assert (total == 1.0).all()


def test_a_hole_takes_away_exactly_what_it_covers(rng):
    outer, hole = [(0.3, 0.2), (9.6, 0.4), (9.1, 7.7), (0.5, 7.2)], star(rng, 9, 2.5)
    whole, part = ss.coverage(outer, SIZE, mode="area"), ss.coverage(hole, SIZE, mode="area")
    assert (ss.coverage([outer, hole], SIZE, mode="area") == whole - part).all()


def test_the_sum_is_the_area(rng):
    points = star(rng, 60, 3.9)
    expected = abs(exact_area([(Fraction(float(x)), Fraction(float(y))) for x, y in snapped(points)]))
    found = ss.coverage(points, SIZE, mode="area")
    assert abs(sum(map(Fraction, found.reshape(-1).tolist())) - expected) <= LIMIT * found.size


def test_centres_are_those_of_the_canvas(rng):
    points = rng.uniform(-2, 12, (7, 2))
    canvas = ss.Canvas(*SIZE)
    canvas.polygon(points, (1, 2, 3))
    assert (ss.coverage(points, SIZE) == (canvas.pixels[..., 0] == 1)).all()


def test_an_antialiased_polygon_is_blended_by_its_area():
    canvas = ss.Canvas(2, 1, "black", blend="srgb")
    canvas.polygon([(0, 0), (1.5, 0), (1.5, 1), (0, 1)], "white", antialias=True)
    assert canvas.pixels[0, :, 0].tolist() == [255, 128]
    canvas = ss.Canvas(2, 1, "black")
    canvas.polygon([(0, 0), (1.5, 0), (1.5, 1), (0, 1)], "white", antialias=True)
    assert canvas.pixels[0, :, 0].tolist() == [255, 188]


@pytest.mark.parametrize(
    ("options", "message"),
    [({"mode": "all"}, "unknown mode 'all'"), ({"fill_rule": "odd"}, "unknown fill rule 'odd'"),
     ({"size": (0, 3)}, "size"), ({"rings": [(0, 0), (1, float("nan")), (1, 1)]}, "rings"), ({"rings": 3}, "rings: expected")],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_used_is_quoted(options, message):
    arguments = {"rings": [(0, 0), (1, 0), (1, 1)], "size": (3, 3)} | options
    with pytest.raises(ss.InputError, match=message):
        ss.coverage(**arguments)
