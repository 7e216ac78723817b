"""Items of the lectures that are the library itself, where no other test shows what the slide says."""

from __future__ import annotations

import itertools
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scanspan import color
from scanspan.lectures import brightness, decomposition, projective, sampling
from scanspan.lectures.fixed_point import FixedEdgeEqn
from scanspan.lectures.raster import Vertex
from scanspan.raster import order
from scanspan.triangulation import triangulate_polygon


def twice_exact_area(ring: np.ndarray) -> Fraction:
    """Return twice the area of a ring, exactly."""
    points = [(Fraction(float(x)), Fraction(float(y))) for x, y in ring]
    return sum((a[0] * b[1] - b[0] * a[1] for a, b in zip(points, [*points[1:], points[0]])), Fraction(0))


@pytest.mark.parametrize("name", ["hilbert", "morton"])
def test_curves_are_followed_block_by_block(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The traversal itself, in plain Python, with a recorder in the place of what scans a block."""
    visited: list[tuple[int, int]] = []

    def record(write_sample: Any, bound: Any, target: Any, t: Any, i: int, j: int, n: int, accepted: bool) -> int:
        visited.append((int(i) // order.BLOCK, int(j) // order.BLOCK))
        return 0

    for helper in ("visit_curve", "push_quarters"):
        monkeypatch.setattr(order, helper, getattr(order, helper).py_func)
    monkeypatch.setattr(order, "scan_block", record)
    monkeypatch.setattr(order, "is_rejected", lambda *_: False)
    monkeypatch.setattr(order, "is_accepted", lambda *_: False)
    side = 16
    box = SimpleNamespace(x_start=0, x_end=side * order.BLOCK, y_start=0, y_end=side * order.BLOCK)
    visit = {"hilbert": order.visit_hilbert, "morton": order.visit_morton}[name]
    visit.py_func(None, None, None, box, 0, np.zeros((64, 5), np.int64))

    # Every block once; Hilbert's steps go to a neighbour, Morton's numbers are the bits of x and y in turn.
    assert len(set(visited)) == len(visited) == side**2
    if name == "hilbert":
        assert {abs(x - u) + abs(y - v) for (x, y), (u, v) in itertools.pairwise(visited)} == {1}
    else:
        interleaved = [sum(((p >> k & 1) << k // 2 + (k & 1) * 8) for k in range(8)) for p in range(side**2)]
        assert visited == [(code & 255, code >> 8) for code in interleaved]


def test_three_criteria_make_three_pictures() -> None:
    found = sampling.demonstrate_criteria()
    assert found.area == found.covered == abs(twice_exact_area(sampling.SHAPE)) / 2

    # Centres by the definition: one lies on an edge, a left one, and is owned.
    (ax, ay), (bx, by), (cx, cy) = sampling.SHAPE.tolist()
    edges = ((ax, ay, bx, by), (bx, by, cx, cy), (cx, cy, ax, ay))
    least = [
        min((q_x - p_x) * (j + 0.5 - p_y) - (q_y - p_y) * (i + 0.5 - p_x) for p_x, p_y, q_x, q_y in edges)
        for i in range(16)
        for j in range(16)
    ]
    assert (sum(value > 0 for value in least), least.count(0.0), found.inside) == (66, 1, 67)

    # Each side is as many pixels long as it has columns or rows, but for the corners.
    assert 13 + 9 + 11 - 3 <= found.near <= 13 + 9 + 11


def test_pixels_come_to_have_the_area_as_the_grid_gets_finer() -> None:
    found = sampling.demonstrate_scale()
    assert found.factors == (1, 2, 4, 8, 16, 32, 64)
    assert found.pixels[0] == sampling.demonstrate_criteria().inside
    errors = [abs(area - found.area) for area in found.areas]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.01 < errors[0]


def test_every_simple_polygon_is_cut_along_diagonals() -> None:
    found = decomposition.demonstrate_decomposition()
    assert found == (200, 200, 1, 5)
    rng = np.random.default_rng(7)
    for corners in range(4, 24):
        star = decomposition.random_star(rng, corners)
        triangles = triangulate_polygon(star)
        assert len(triangles) == corners - 2
        assert sum(abs(twice_exact_area(star[k])) for k in triangles) == pytest.approx(float(twice_exact_area(star)), rel=1e-12)
        assert decomposition.twice_areas(star[None])[0] == pytest.approx(float(twice_exact_area(star)), rel=1e-12)


def test_white_is_a_little_grey_and_v_is_no_mean() -> None:
    found = brightness.demonstrate_averages()
    assert found.white_as_printed == 254.745
    assert found.white == 255.0
    assert found.intensities == (85.0, 85.0, 85.0)
    assert found.values == (255.0, 255.0, 255.0)
    assert found.lumas == pytest.approx((255 * 0.299, 255 * 0.587, 255 * 0.114))
    assert color.rgb_to_hsv((0.5, 0.25, 0.125))[2] == 0.5


def test_no_triple_without_w_has_an_image() -> None:
    assert projective.demonstrate_excluded_point() == ("is no point", "is an ideal point", "")


def test_products_may_wrap_around_if_their_sum_fits(rng: np.random.Generator) -> None:
    # Each product leaves 32 bits, and their sum does not: it is right, as two's complement adds up modulo 2^32.
    edge = FixedEdgeEqn(Vertex(0, 600), Vertex(800, 0))
    assert edge.A * 1000 > 2**31
    assert edge.B * 900 > 2**31
    assert edge.evaluate(1000, -700) == edge.A * 1000 - edge.B * 700 + edge.C
    wrapped = 0
    for x, y in rng.integers(-2000, 2000, (400, 2)).tolist():
        exact = edge.A * x + edge.B * y + edge.C
        fits = -(2**31) <= exact < 2**31
        wrapped += fits and max(abs(edge.A * x), abs(edge.B * y)) >= 2**31
        assert (edge.evaluate(x, y) == exact) == fits
    assert wrapped > 20
