"""Matrices in homogeneous coordinates: products in a fixed order, and where OpenGL's planes and corners are."""

from __future__ import annotations

import numpy as np
import pytest

from scanspan import homogeneous


def test_transform_points_adds_in_a_fixed_order_for_any_length_and_layout(rng: np.random.Generator) -> None:
    matrix = rng.normal(size=(4, 4))
    points = rng.normal(size=(20_000, 3))
    expected = np.stack([points[:, 0] * m[0] + points[:, 1] * m[1] + points[:, 2] * m[2] + m[3] for m in matrix], axis=1)
    assert np.array_equal(homogeneous.transform_points(matrix, points), expected)
    assert np.array_equal(homogeneous.transform_points(np.asfortranarray(matrix), np.asfortranarray(points)), expected)
    assert np.array_equal(homogeneous.transform_points(matrix, points[::-3]), expected[::-3])
    assert homogeneous.transform_points(matrix, np.zeros((0, 3))).shape == (0, 4)


def test_points_that_are_not_finite_pass_through() -> None:
    assert np.isnan(homogeneous.transform_points(np.eye(4), [[np.nan, 0, 0]])[0, 0])


def test_directions_do_not_move_and_normals_stay_perpendicular(rng: np.random.Generator) -> None:
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    a, b = rng.normal(size=(2, 5, 3))
    normals = homogeneous.transform_directions(homogeneous.normal_matrix(matrix), np.cross(a, b))
    for side in (a, b):
        assert np.abs((homogeneous.transform_directions(matrix, side) * normals).sum(axis=1)).max() < 1e-12
    assert np.allclose(homogeneous.normal_matrix(matrix), np.linalg.inv(matrix[:3, :3]).T, rtol=1e-12)


@pytest.mark.parametrize("scale", [0.0, 1e-200])
def test_the_normals_of_a_flattened_scene_point_across_it(scale: float) -> None:
    normal = homogeneous.transform_directions(homogeneous.normal_matrix(np.diag([2.0, scale, 3.0])), [[1.0, 1.0, 1.0]])[0]
    assert np.isfinite(normal).all()
    assert abs(normal[1]) > 1e100 * max(abs(normal[0]), abs(normal[2])) or (normal[0] == normal[2] == 0 and normal[1] > 0)


def test_compose_is_the_product_and_applies_the_second_first(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 4, 4))
    assert np.allclose(homogeneous.compose(a, b), a @ b, rtol=1e-13, atol=1e-14)
    assert not np.allclose(homogeneous.compose(a, b), b @ a)


@pytest.mark.parametrize("far", [None, 7.0, 1e9])
def test_planes_of_a_perspective_are_where_opengl_has_them(far: float | None) -> None:
    for matrix in (homogeneous.perspective(50, 1.5, 0.25, far), homogeneous.frustum(-1, 2, -0.5, 1, 0.25, far)):
        near_clip, far_clip = homogeneous.transform_points(matrix, [[0, 0, -0.25], [0, 0, -(far or 1e300)]])
        assert near_clip[2] == pytest.approx(-near_clip[3], rel=1e-12)
        assert far_clip[2] == pytest.approx(far_clip[3], rel=1e-12)


def test_perspective_is_the_symmetric_frustum() -> None:
    half = np.tan(np.radians(25)) * 0.25
    frustum = homogeneous.frustum(-1.5 * half, 1.5 * half, -half, half, 0.25, 9.0)
    assert np.allclose(homogeneous.perspective(50, 1.5, 0.25, 9.0), frustum, rtol=1e-14)


def test_the_corners_of_the_view_are_the_corners_of_clip_space() -> None:
    clip = homogeneous.transform_points(homogeneous.frustum(-1, 3, -2, 5, 2, 8), [[-1, -2, -2], [3, 5, -2], [12, 20, -8]])
    assert np.allclose(clip[:, :3] / clip[:, 3:], [[-1, -1, -1], [1, 1, -1], [1, 1, 1]], atol=1e-15)
    clip = homogeneous.transform_points(homogeneous.orthographic(4, 2, 1, 3), [[2, 1, -1], [-2, -1, -3]])
    assert np.array_equal(clip, [[1, 1, -1, 1], [-1, -1, 1, 1]])


def test_look_at_makes_a_rotation_that_puts_the_target_on_the_axis() -> None:
    view = homogeneous.look_at((1, 2, 3), (-4, 0, 9), (0, 0, 2))
    assert np.allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-15)
    assert np.linalg.det(view[:3, :3]) == pytest.approx(1)
    target = homogeneous.transform_points(view, [[-4, 0, 9]])[0]
    assert np.allclose(target, [0, 0, -np.sqrt(25 + 4 + 36), 1], atol=1e-14)
    above = homogeneous.transform_points(view, [[-4, 0, 10]])[0]
    assert above[0] == pytest.approx(0, abs=1e-14)
    assert above[1] > 0
