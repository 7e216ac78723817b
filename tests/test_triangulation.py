"""Polygons to triangles: areas against shapely, no T-junctions, termination on anything, and the vectorised cuts of faces."""

from __future__ import annotations

from fractions import Fraction

import mapbox_earcut
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from scanspan.assets.faces import cut_faces
from scanspan.errors import InputError
from scanspan.triangulation import is_convex, orientation, orientations, triangulate_polygon

FloatArray = NDArray[np.float64]

small = st.integers(0, 4)
point = st.tuples(small, small)


def exact_area(points: FloatArray) -> Fraction:
    """Twice the signed area, in rationals."""
    rows = [(Fraction(x), Fraction(y)) for x, y in points.tolist()]
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in zip(rows, [*rows[1:], rows[0]], strict=True)), Fraction(0))


def check_partition(points: FloatArray, triangles: NDArray[np.int64]) -> None:
    """Fail unless the triangles turn as the polygon does and their areas add up to its own, exactly."""
    whole = exact_area(points)
    areas = [exact_area(points[t]) for t in triangles]
    assert all(area * whole >= 0 for area in areas), "a triangle turns the other way"
    assert sum(areas, Fraction(0)) == whole, "the areas do not add up"


def star(rng: np.random.Generator, count: int, grid: int) -> FloatArray:
    """A polygon around the origin, its corners on a grid."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    radius = rng.uniform(0.1, 1.0, count)
    return np.round(np.stack([np.cos(angle) * radius, np.sin(angle) * radius], axis=1) * grid)


def test_the_check_of_a_partition_can_fail() -> None:
    arrow = np.array([(0, 0), (4, 2), (0, 4), (1, 2)], dtype=np.float64)
    with pytest.raises(AssertionError, match="turns the other way"):
        check_partition(arrow, np.array([[0, 1, 2], [0, 2, 3]]))
    with pytest.raises(AssertionError, match="do not add up"):
        check_partition(arrow, np.array([[3, 0, 1]]))


def test_simple_polygons_are_partitioned_without_slivers_of_no_area(rng: np.random.Generator) -> None:
    checked = 0
    for _ in range(400):
        points = star(rng, int(rng.integers(3, 24)), int(rng.choice([4, 20, 1000])))
        if rng.random() < 0.5:
            points = points[::-1].copy()
        polygon = shapely.Polygon(points)
        if not polygon.is_valid or polygon.area == 0.0:
            continue
        triangles = triangulate_polygon(points)
        assert len(triangles) == len(points) - 2
        check_partition(points, triangles)
        if len(np.unique(points, axis=0)) == len(points):
            assert all(exact_area(points[t]) != 0 for t in triangles)
        assert sum(abs(exact_area(points[t])) for t in triangles) / 2 == pytest.approx(polygon.area, rel=1e-12)
        checked += 1
    assert checked > 300


def test_a_large_polygon_agrees_with_earcut(rng: np.random.Generator) -> None:
    points = star(rng, 800, 100_000)
    triangles = triangulate_polygon(points)
    assert shapely.Polygon(points).is_valid
    check_partition(points, triangles)
    other = mapbox_earcut.triangulate_float64(points, np.array([len(points)], dtype=np.uint32)).reshape(-1, 3)
    areas = [sum(abs(exact_area(points[t])) for t in found) for found in (triangles, other.astype(np.int64))]
    assert areas[0] == areas[1]


def test_corners_on_straight_sides_are_corners_of_real_triangles() -> None:
    points = np.array([(0, 0), (1, 0), (2, 0), (4, 0), (4, 4), (2, 4), (0, 4), (0, 1)], dtype=np.float64)
    for first in range(len(points)):
        turned = np.roll(points, first, axis=0)
        triangles = triangulate_polygon(turned)
        check_partition(turned, triangles)
        assert len(triangles) == 6
        assert all(exact_area(turned[t]) != 0 for t in triangles)


def test_a_hole_joined_by_a_bridge_stays_open() -> None:
    outer = [(0, 0), (8, 0), (8, 8), (0, 8), (0, 0)]
    inner = [(2, 2), (2, 6), (6, 6), (6, 2), (2, 2)]
    points = np.array(outer + inner, dtype=np.float64)
    triangles = triangulate_polygon(points)
    check_partition(points, triangles)
    hole = shapely.box(2, 2, 6, 6)
    assert all(shapely.Polygon(points[t]).intersection(hole).area == 0.0 for t in triangles if exact_area(points[t]) != 0)


@given(st.lists(point, max_size=14))
def test_anything_ends_with_two_triangles_fewer_than_corners(rows: list[tuple[int, int]]) -> None:
    points = np.array(rows, dtype=np.float64).reshape(-1, 2)
    triangles = triangulate_polygon(points)
    assert len(triangles) == max(len(points) - 2, 0)
    if len(points) > 2 and shapely.Polygon(points).is_valid:
        check_partition(points, triangles)


def test_a_tangle_of_many_corners_ends_soon(rng: np.random.Generator) -> None:
    assert len(triangulate_polygon(rng.uniform(size=(1500, 2)))) == 1498


def test_turns_that_float64_cannot_see_are_decided_exactly() -> None:
    x = 0.5 + 2.0**-53
    assert orientation(0.5, 0.5, 12.0, 12.0, 24.0, 24.0) == 0
    assert orientation(0.5, x, 12.0, 12.0, 24.0, 24.0) == 1
    assert orientation(0.0, 0.0, 1e-300, 0.0, 0.0, 1e-300) == 1
    assert orientation(0.0, 0.0, 1e300, 0.0, 0.0, 1e300) == 1
    a, b, c = (np.array([[0.5, x], [0.5, 0.5]]), np.full((2, 2), 12.0), np.full((2, 2), 24.0))
    assert orientations(a, b, c).tolist() == [1, 0]


def test_a_thin_polygon_of_the_smallest_numbers_is_cut() -> None:
    points = np.array([(0, 0), (4, 2), (0, 4), (1, 2)], dtype=np.float64) * 1e-200
    assert triangulate_polygon(points).tolist() == [[3, 0, 1], [3, 1, 2]]


def test_a_pentagram_turns_left_everywhere_and_is_not_convex() -> None:
    angle = np.arange(5) * 2.0 * np.pi / 5
    pentagon = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert is_convex(np.stack([pentagon, pentagon[[0, 2, 4, 1, 3]], pentagon[::-1]])).tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0, 0), (1, 1, 1), (2, 0, 0)], r"points: expected shape \(M, 2\), got \(3, 3\)"),
        ([(0, 0), (1, float("nan")), (2, 0)], r"points\[1\] = \(1.0, nan\): a coordinate is not finite"),
        ([(0, 0), (1,)], r"points: expected numbers of shape \(M, 2\)"),
        ("abc", r"points: expected numbers of shape \(M, 2\)"),
    ],
)
def test_bad_points_are_quoted(points: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        triangulate_polygon(points)  # type: ignore[arg-type]


def test_fewer_than_three_corners_give_nothing() -> None:
    assert triangulate_polygon([]).shape == (0, 3)
    assert triangulate_polygon([(0, 0), (1, 1)]).shape == (0, 3)


def cut(faces: list[list[int]], positions: list[tuple[float, float, float]]) -> tuple[list[list[int]], list[int], list[int]]:
    """Triangles by vertices, their faces and their marks."""
    flat = np.array([v for face in faces for v in face], dtype=np.int64)
    found = cut_faces(np.array(positions, dtype=np.float64), flat, np.array([len(face) for face in faces], dtype=np.int64))
    return flat[found.corner].tolist(), found.source.tolist(), found.inner.tolist()


SQUARE = [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 4.0, 0.0), (0.0, 4.0, 0.0)]


def test_a_convex_quadrilateral_is_cut_from_its_first_corner() -> None:
    assert cut([[0, 1, 2, 3]], SQUARE) == ([[0, 1, 2], [0, 2, 3]], [0, 0], [0b010, 0b100])
    assert cut([[1, 2, 3, 0]], SQUARE)[0] == [[1, 2, 3], [1, 3, 0]]


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("first", range(4))
def test_a_concave_quadrilateral_is_cut_at_its_notch_whichever_way_it_faces(axes: tuple[int, int, int], first: int) -> None:
    arrow = np.array([(0, 0, 0), (4, 2, 0), (0, 4, 0), (1, 2, 0)], dtype=np.float64)[:, axes]
    face = np.roll(np.arange(4), first).tolist()
    triangles, source, inner = cut([face], [tuple(row) for row in arrow.tolist()])
    assert all({1, 3} <= set(triangle) for triangle in triangles)
    assert source == [0, 0]
    for triangle, mark in zip(triangles, inner, strict=True):
        opposite = triangle[{1: 0, 2: 1, 4: 2}[mark]]
        assert opposite in (0, 2), "the edge from 1 to 3 is the diagonal"


def test_a_quadrilateral_with_a_straight_corner_uses_it() -> None:
    positions = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0)]
    assert cut([[0, 1, 2, 3]], positions)[0] == [[0, 1, 3], [1, 2, 3]]


def test_faces_keep_their_order_and_number_whatever_their_size() -> None:
    positions = [*SQUARE, (2.0, 6.0, 0.0)]
    triangles, source, inner = cut([[0, 1, 2, 4, 3], [0, 1], [0, 1, 2], [0, 1, 2, 3]], positions)
    assert source == [0, 0, 0, 2, 3, 3]
    assert triangles[3] == [0, 1, 2]
    assert inner[3] == 0
    assert [bin(mark).count("1") for mark in inner] == [1, 2, 1, 0, 1, 1]


def test_a_concave_polygon_in_space_keeps_its_area(rng: np.random.Generator) -> None:
    flat = star(rng, 30, 1000)
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    positions = flat @ frame[:2] + rng.normal(size=3)
    found = cut_faces(positions, np.arange(30), np.array([30]))
    corners = positions[found.corner]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas.sum() / 2 == pytest.approx(shapely.Polygon(flat).area, rel=1e-9)


def test_faces_that_are_not_finite_are_cut_without_a_warning() -> None:
    nan, inf = float("nan"), float("inf")
    triangles, source, _ = cut([[0, 1, 2, 3], [0, 1, 2, 3, 4]], [*SQUARE[:3], (nan, 0.0, 0.0), (inf, 1e308, -1e308)])
    assert source == [0, 0, 1, 1, 1]
    assert len(triangles) == 5
