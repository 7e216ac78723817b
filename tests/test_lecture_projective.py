"""Homogeneous coordinates on the slides: each number that S3 prints, by its number in the table of the lectures."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan import homogeneous
from scanspan.errors import InputError
from scanspan.lectures import projective

WINDOWS = [(-1.0, 1.0, -1.0, 1.0), (-1.0, 2.0, -0.5, 3.0), (0.25, 0.5, -2.0, -1.5)]
DEPTHS = [(1.0, 2.0), (0.5, 8.0), (0.001, 1000.0), (3.0, 3.5)]


def test_100_no_two_by_two_matrix_moves_the_origin(rng: np.random.Generator) -> None:
    for a, b, c, d in rng.normal(size=(50, 4)):
        assert (a * 0.0 + b * 0.0, c * 0.0 + d * 0.0) == (0.0, 0.0)
        matrix = homogeneous.affine([[a, b], [c, d]])
        assert homogeneous.cartesian(homogeneous.transform(matrix, (0, 0, 1))).tolist() == [0.0, 0.0]
    assert projective.demonstrate_translation() == ((0.0, 0.0), (5.0, 7.0))


def test_101_a_factor_changes_nothing_and_one_triple_is_no_point(rng: np.random.Generator) -> None:
    point = rng.normal(size=3)
    for factor in (-3.0, 0.125, 1e10):
        assert homogeneous.is_same(point, factor * point)
        assert np.allclose(homogeneous.cartesian(factor * point), point[:2] / point[2], rtol=1e-14)
    assert not homogeneous.is_same((0, 0, 0), point)
    with pytest.raises(InputError, match=r"^points = \(0.0, 0.0, 0.0\) is no point: expected one with W not 0$"):
        homogeneous.cartesian((0, 0, 0))


def test_102_the_limit_is_one_ideal_point_from_both_sides() -> None:
    limit = projective.demonstrate_limit()
    assert limit.above == ((2, 4), (20, 40), (200, 400))
    assert limit.below == ((-2, -4), (-20, -40), (-200, -400))
    assert limit.ideal == ((0.5, 1.0, 0.0), (0.5, 1.0, 0.0))
    assert homogeneous.is_ideal(limit.ideal).all()
    assert homogeneous.is_incident(homogeneous.LINE_AT_INFINITY, limit.ideal, 0.0).all()
    assert homogeneous.is_same((1, 2, 0), (-1, -2, 0), 0.0)


def test_103_translations_and_affine_matrices_are_composed_by_products() -> None:
    assert homogeneous.translation((5, 7)).tolist() == [[1, 0, 5], [0, 1, 7], [0, 0, 1]]
    matrix = homogeneous.affine([[2, 3], [5, 7]], (11, 13))
    assert matrix.tolist() == [[2, 3, 11], [5, 7, 13], [0, 0, 1]]
    x, y = 17.0, 19.0
    assert homogeneous.transform(matrix, (x, y, 1)).tolist() == [2 * x + 3 * y + 11, 5 * x + 7 * y + 13, 1]
    both = homogeneous.compose(homogeneous.translation((1, -1)), matrix)
    assert homogeneous.transform(both, (x, y, 1)).tolist() == [2 * x + 3 * y + 12, 5 * x + 7 * y + 12, 1]


def test_104_points_lines_and_directions_in_one_form() -> None:
    # x + y = 1 holds (0, 1), (1, 0) and the direction (1, -1), and any factor of it does.
    for factor in (1, -4):
        line = np.array([1, 1, -1]) * factor
        assert homogeneous.is_incident(line, [(0, 1, 1), (1, 0, 1), (1, -1, 0)], 0.0).all()
        assert not homogeneous.is_incident(line, (0, 0, 1), 0.0)

    # Duality: the same triples as points and lines, the same sum, the same function.
    assert homogeneous.is_incident((0, 1, 1), (1, 1, -1), 0.0)
    assert homogeneous.join((0, 1, 1), (1, 0, 1)).tolist() == homogeneous.meet((0, 1, 1), (1, 0, 1)).tolist()


def test_105_two_points_make_the_line_of_the_slide() -> None:
    found = projective.demonstrate_incidence()
    assert found.line == (1, 1, -1)
    assert found.coincident == (0, 0, 0)


def test_106_two_lines_make_the_point_of_the_slide() -> None:
    found = projective.demonstrate_incidence()
    assert found.point == (-1, -1, -2)
    assert homogeneous.cartesian(found.point).tolist() == [0.5, 0.5]
    assert found.identical == (0, 0, 0)


def test_107_parallel_lines_meet_in_antipodal_directions_that_are_one_point() -> None:
    found = projective.demonstrate_incidence()
    assert (found.parallel, found.parallel_reversed) == ((0, -2, 0), (0, 2, 0))
    assert found.is_one_point
    assert homogeneous.canonical([found.parallel, found.parallel_reversed]).tolist() == [[0, 1, 0], [0, 1, 0]]
    with pytest.raises(InputError, match=r"^points = \(0.0, -2.0, 0.0\) is an ideal point: expected one with W not 0$"):
        homogeneous.cartesian(found.parallel)


def test_108_joins_and_meets_of_space() -> None:
    found = projective.demonstrate_space()
    assert found.line == (0, 1, 0, 0, 0, 1)
    assert found.plane == (1, 0, 0, -1)
    assert found.point == (1, 2, 0)
    assert found.is_one_line


def test_109_directions_are_not_moved_and_normals_need_the_inverse_transpose() -> None:
    # A roof x + y = 0 made twice as wide: its normal gets steeper, where a direction would get flatter.
    matrix = homogeneous.compose(homogeneous.translation((3, 4, 5)), homogeneous.scaling((2, 1, 1)))
    assert homogeneous.transform(matrix, (1, -1, 0, 0)).tolist() == [2, -1, 0, 0]
    along = homogeneous.transform(matrix, (1, -1, 0, 0))[:3]
    normal = homogeneous.transform_directions(homogeneous.normal_matrix(matrix), [(1, 1, 0)])[0]
    wrong = homogeneous.transform(matrix, (1, 1, 0, 0))[:3]
    assert homogeneous.dot(normal, along) == 0.0
    assert homogeneous.dot(wrong, along) == 3.0

    # The normal of the plane H M^-1 is that normal.
    plane = homogeneous.transform_planes(matrix, (1, 1, 0, 0))
    assert plane[:3].tolist() == normal.tolist()


@pytest.mark.parametrize(("near", "far"), DEPTHS)
@pytest.mark.parametrize("window", WINDOWS)
def test_110_the_frustum_and_its_inverse_are_those_of_the_slide(
    window: tuple[float, float, float, float], near: float, far: float
) -> None:
    left, right, bottom, top = window
    width, height, depth = right - left, top - bottom, far - near
    printed = [
        [2 * near / width, 0, (right + left) / width, 0],
        [0, 2 * near / height, (top + bottom) / height, 0],
        [0, 0, -(far + near) / depth, -2 * far * near / depth],
        [0, 0, -1, 0],
    ]
    printed_inverse = [
        [width / (2 * near), 0, 0, (right + left) / (2 * near)],
        [0, height / (2 * near), 0, (top + bottom) / (2 * near)],
        [0, 0, 0, -1],
        [0, 0, 1 / (2 * far) - 1 / (2 * near), 1 / (2 * far) + 1 / (2 * near)],
    ]
    matrix = homogeneous.frustum(*window, near, far)
    assert np.allclose(matrix, printed, rtol=1e-14, atol=0)
    assert np.allclose(homogeneous.inverse(matrix), printed_inverse, rtol=1e-12, atol=1e-15)

    # The corners of the frustum are the corners of the cube.
    corners = [(x * z / near, y * z / near, -z) for x in (left, right) for y in (bottom, top) for z in (near, far)]
    seen = homogeneous.cartesian(homogeneous.transform(matrix, homogeneous.points(corners)))
    assert np.allclose(seen, [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], atol=1e-12)


@pytest.mark.parametrize(("near", "far"), DEPTHS)
def test_111_the_centre_of_projection_goes_to_infinity(near: float, far: float) -> None:
    seen = homogeneous.transform(homogeneous.frustum(-1, 2, -1, 1, near, far), (0, 0, 0, 1))
    assert seen[[0, 1, 3]].tolist() == [0, 0, 0]
    assert seen[2] == pytest.approx(-2 * far * near / (far - near), rel=1e-14)
    assert projective.demonstrate_frustum(near, far).eye == (0, 0, 1, 0)


def test_112_a_plane_becomes_h_times_the_inverse(rng: np.random.Generator) -> None:
    for _ in range(100):
        matrix, plane, points = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=(5, 4))
        points[:, 3] = -(points[:, :3] * plane[:3]).sum(axis=1) / plane[3]
        carried = homogeneous.transform_planes(matrix, plane)
        assert homogeneous.is_incident(carried, homogeneous.transform(matrix, points), 1e-10).all()
        assert homogeneous.is_same(homogeneous.planes_before(matrix, carried), plane, 1e-10)


@pytest.mark.parametrize(("near", "far"), DEPTHS)
def test_113_the_plane_through_the_eye_becomes_the_plane_at_infinity(near: float, far: float) -> None:
    matrix = homogeneous.frustum(-1, 2, -1, 1, near, far)
    plane = homogeneous.transform_planes(matrix, (0, 0, 1, 0))
    assert np.allclose(plane, (0, 0, 0, -1), rtol=1e-13, atol=1e-13)
    assert projective.demonstrate_frustum().eye_plane == homogeneous.PLANE_AT_INFINITY

    # On it lie the ideal points and no others; what is beside the eye becomes one.
    assert homogeneous.is_ideal(homogeneous.transform(matrix, [(1, 0, 0, 1), (3, -2, 0, 1)])).all()
    assert homogeneous.is_incident(homogeneous.PLANE_AT_INFINITY, [(1, 2, 3, 0), (1, 2, 3, 1e-3)], 0.0).tolist() == [
        True,
        False,
    ]


@pytest.mark.parametrize(("near", "far"), DEPTHS)
def test_114_the_projection_plane_becomes_the_front_of_the_cube(near: float, far: float) -> None:
    plane = homogeneous.transform_planes(homogeneous.frustum(-1, 2, -1, 1, near, far), (0, 0, 1, near))
    assert np.allclose(plane, (0, 0, (near - far) / (2 * far), (near - far) / (2 * far)), rtol=1e-11, atol=1e-13)
    images = projective.demonstrate_frustum()
    assert images.projection_plane == (0, 0, 1, 1)
    assert images.far_plane == (0, 0, -1, 1)
    assert images.identity_error < 1e-15


@pytest.mark.parametrize(("near", "far"), DEPTHS)
def test_115_the_plane_at_infinity_comes_within_reach(near: float, far: float) -> None:
    matrix = homogeneous.frustum(-1, 2, -1, 1, near, far)
    plane = homogeneous.transform_planes(matrix, homogeneous.PLANE_AT_INFINITY)
    assert homogeneous.is_same(plane, (0, 0, near - far, near + far), 1e-11)
    images = projective.demonstrate_frustum(near, far)
    assert images.infinity_depth == pytest.approx(-(near + far) / (near - far), rel=1e-9)
    if (near, far) == (1.0, 2.0):
        assert homogeneous.is_same(plane, (0, 0, -1, 3), 0.0)
        assert images.infinity_depth == 3.0

    # Beyond the far plane z' lies between 1 and that plane; behind the eye it lies beyond it.
    beyond, behind = homogeneous.cartesian(homogeneous.transform(matrix, [(0, 0, -10 * far, 1), (0, 0, far, 1)]))[:, 2]
    assert 1 < beyond < images.infinity_depth < behind


def test_116_depth_is_straight_on_the_screen_after_the_division_and_eye_z_is_not() -> None:
    # A floor from 1 to 9 in front of the eye. Half way across the picture it is 1.8 away: not 5, the mean.
    matrix = homogeneous.frustum(-1, 1, -1, 1, 1, 10)
    x, y = np.array([(-1.0, -1.0), (9.0, -9.0), (9.0, 9.0), (-1.0, 1.0)]).T
    z = np.array([1.0, 9.0, 9.0, 1.0])
    clip = homogeneous.transform_points(matrix, np.stack([x, y, -z], axis=1))
    triangles = [(0, 1, 2), (0, 2, 3)]
    seen = ss.rasterize(clip, triangles, (33, 33))
    middle = seen.primitive[16, 16]
    assert middle >= 0
    correct = ss.interpolate(seen, z[:, None])[16, 16]
    assert float(correct[0]) == pytest.approx(1.8, rel=1e-6)

    # z / w is the mean of its ends there, and its place in clip space gives 1.8 back.
    ends = clip[[0, 1], 2] / clip[[0, 1], 3]
    depth = homogeneous.cartesian(homogeneous.transform(homogeneous.inverse(matrix), (0, 0, ends.mean(), 1)))[2]
    assert -depth == pytest.approx(1.8, rel=1e-12)
