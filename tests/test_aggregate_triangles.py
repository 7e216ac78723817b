"""Triangles counted, added, averaged and compared in pixels, with values that may differ from corner to corner."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.world import cut_triangles
from scanspan.pipeline import count_each
from tests.plotting import REDUCTIONS, reduced_image, same

SIZE = (23, 17)


def random_triangles(rng: np.random.Generator, count: int) -> Any:
    """Return triangles in and around the image, of both windings, some with corners on sample positions."""
    triangles = rng.uniform(-10, 33, (count, 3, 2))
    triangles[::3] = np.round(triangles[::3] * 2) / 2
    return triangles


def test_counts_are_those_of_count(rng: np.random.Generator) -> None:
    triangles = random_triangles(rng, 200)
    expected = ss.count(triangles, SIZE)
    for threads in (1, 3):
        found = ss.aggregate(triangles, SIZE, threads=threads)
        assert np.array_equal(found, expected)
        assert found.dtype == expected.dtype


@pytest.mark.parametrize("per_corner", [False, True])
def test_a_value_that_is_one_for_all_of_a_triangle_stays_that(per_corner: bool, rng: np.random.Generator) -> None:
    triangles, values = random_triangles(rng, 60), rng.normal(size=60) * 10.0 ** rng.integers(-9, 9, 60)
    hits = [
        (int(x), int(y), float(value))
        for image, value in zip(count_each(triangles, SIZE), values)
        for y, x in np.argwhere(image)
    ]
    given = np.repeat(values, 3).reshape(-1, 3) if per_corner else values
    for reduce in REDUCTIONS:
        found = ss.aggregate(triangles, SIZE, reduce=reduce, values=given)
        assert same(found, reduced_image(reduce, SIZE, hits))


def test_values_of_corners_are_interpolated_at_centres(rng: np.random.Generator) -> None:
    for _ in range(30):
        corners, values = rng.integers(-40, 400, (3, 2)) / 16, rng.normal(size=3)
        found = ss.aggregate([corners], SIZE, reduce="sum", values=[values])
        (px, py), (qx, qy), (rx, ry) = [[Fraction(float(v)) for v in corner] for corner in corners]
        area = (qx - px) * (ry - py) - (qy - py) * (rx - px)
        for y, x in np.argwhere(~np.isnan(found)):
            cx, cy = Fraction(int(x)) + Fraction(1, 2), Fraction(int(y)) + Fraction(1, 2)
            b1 = ((cx - px) * (ry - py) - (cy - py) * (rx - px)) / area
            b2 = ((qx - px) * (cy - py) - (qy - py) * (cx - px)) / area
            u, v, w = (Fraction(float(value)) for value in values)
            assert float(u + b1 * (v - u) + b2 * (w - u)) == pytest.approx(float(found[y, x]), abs=1e-13)


def test_any_number_of_threads_gives_the_same_bits(rng: np.random.Generator) -> None:
    size = (640, 480)
    triangles, values = rng.uniform(-50, 700, (150, 3, 2)), rng.normal(size=(150, 3))
    for reduce in REDUCTIONS:
        found = [ss.aggregate(triangles, size, reduce=reduce, values=values, threads=n) for n in (1, 2, 7)]
        assert same(found[0], found[1])
        assert same(found[0], found[2])


def test_neighbours_share_every_pixel_between_them(rng: np.random.Generator) -> None:
    # A plane over a mesh that covers the image: one value in each pixel, the plane's.
    x, y = np.meshgrid(np.linspace(-3, 26, 8), np.linspace(-3, 20, 6))
    points = np.stack([x.ravel(), y.ravel()], axis=1) + rng.uniform(-1.5, 1.5, (48, 2))
    rows = [(j * 8 + i, j * 8 + i + 1, j * 8 + i + 8, j * 8 + i + 9) for j in range(5) for i in range(7)]
    faces = np.array([face for a, b, c, d in rows for face in ((a, b, c), (b, d, c))])
    points = np.round(points * 256) / 256
    heights = points[:, 0] * 2 - points[:, 1] * 3
    assert (ss.aggregate(points[faces], SIZE) == 1).all()
    found = ss.aggregate(points[faces], SIZE, reduce="mean", values=heights[faces])
    across, down = np.meshgrid(np.arange(23) + 0.5, np.arange(17) + 0.5)
    assert np.allclose(found, across * 2 - down * 3, rtol=0, atol=1e-12)


def test_bounds_turn_the_world_into_pixels(rng: np.random.Generator) -> None:
    triangles, values = rng.integers(-40, 140, (80, 3, 2)) / 8, rng.normal(size=(80, 3))
    pixels = np.stack([(triangles[..., 0] + 1) * 2, (10.5 - triangles[..., 1]) * 2], axis=-1)
    found = ss.aggregate(triangles, SIZE, bounds=(-1.0, 2.0, 10.5, 10.5), reduce="max", values=values)
    assert same(found, ss.aggregate(pixels, SIZE, reduce="max", values=values))


@pytest.mark.parametrize("reach", [3e7, 1e9, 1e12])
def test_who_looks_closely_sees_triangles_that_reach_far_beyond(reach: float, rng: np.random.Generator) -> None:
    # Four triangles around a point in the image fill it, with a plane over them; a small one lies on top.
    corners = np.array([(-1, -1.1), (1.2, -1), (1, 0.9), (-1.1, 1)]) * reach
    fan = [((11.25, 8.5), tuple(corners[k]), tuple(corners[(k + 1) % 4])) for k in range(4)]
    small = [((3, 3), (9, 3), (3, 9))]
    found = ss.aggregate(fan + small, SIZE, bounds=None)
    assert np.array_equal(found, 1 + ss.count(small, SIZE))
    heights = np.array([[1.0, 1.0 + a[0] / reach, 1.0 + b[0] / reach] for _, a, b in fan])
    plane = ss.aggregate(fan, SIZE, reduce="mean", values=heights)
    assert np.allclose(plane, 1.0, rtol=0, atol=1e-4)
    assert (ss.aggregate(fan, SIZE, reduce="mean", values=[4, 5, 6, 7]) >= 4).all()
    assert (ss.aggregate(np.array(fan) + reach * 3, SIZE) == 0).all()


def test_a_far_triangle_leaves_the_others_as_they_are(rng: np.random.Generator) -> None:
    triangles, values = random_triangles(rng, 50), rng.normal(size=(50, 3))
    far = np.array([[(-1e9, -1e9), (3e9, -1e9), (-1e9, 3e9)]])
    at = 20
    mixed = np.concatenate([triangles[:at], far, triangles[at:]])
    given = np.concatenate([values[:at], [[2.5] * 3], values[at:]])
    assert np.array_equal(ss.aggregate(mixed, SIZE), ss.aggregate(triangles, SIZE) + 1)
    corners, kept = cut_triangles(mixed, given, SIZE, 8)
    assert np.array_equal(corners[:at], triangles[:at])
    assert np.array_equal(corners[at - 50 :], triangles[at:])
    assert (kept[at : at - 50] == 2.5).all()
    assert np.array_equal(kept[at - 50 :], values[at:])


def test_what_is_not_finite_is_left_out_where_that_is_asked_for() -> None:
    good = [(0, 0), (2, 0), (0, 3)]
    triangles = [good, [(0, 0), (2, np.nan), (0, 2)], good]
    assert ss.aggregate(triangles, (2, 2), nonfinite="drop").tolist() == [[2, 2], [2, 0]]
    values = [(1, 1, 1), (2, 2, 2), (3, np.inf, 3)]
    assert ss.aggregate(triangles, (2, 2), values=values, nonfinite="drop").tolist() == [[1, 1], [1, 0]]


def test_nothing_and_triangles_without_area_draw_nothing() -> None:
    assert not ss.aggregate(np.empty((0, 3, 2)), (3, 2)).any()
    assert not ss.aggregate([], (3, 2), kind="triangles").any()
    flat = [[(0, 0), (2, 2), (1, 1)], [(1, 1)] * 3]
    assert np.isnan(ss.aggregate(flat, (3, 2), reduce="mean", values=[1, 2])).all()
    assert not ss.aggregate(flat, (3, 2), bounds="fit").any()
