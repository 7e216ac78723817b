"""Cameras: the matrices, the conventions of other tools against their own formulas, framing, and every error message."""

from __future__ import annotations

import pickle
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan import homogeneous
from scanspan.assets.camera import Camera, check_size
from scanspan.assets.framing import DIRECTIONS, FITS
from scanspan.errors import InputError, LimitError

SIZE = (640, 480)
Array = npt.NDArray[np.float64]


def random_rotation(rng: np.random.Generator) -> Array:
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def pixels_of_clip(clip: Array, size: tuple[int, int]) -> Array:
    """Map clip coordinates to pixels, as the viewport of the rasterizer does."""
    w = clip[:, 3]
    return np.stack([(clip[:, 0] / w + 1) * size[0] / 2, (1 - clip[:, 1] / w) * size[1] / 2], axis=1)


def scene(low: Any, high: Any, up: object = "+Y") -> SimpleNamespace:
    return SimpleNamespace(bounds=np.array([low, high], dtype=float), up=up)


def corners_of(bounds: Array) -> Array:
    return np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


@pytest.mark.parametrize("size", [(64, 48), (48, 64), (1, 1)])
def test_projecting_a_known_point(size: tuple[int, int]) -> None:
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), fov=90)
    width, height = size
    expected = [width / 2 + height / 2 * 2 / 5, height / 2 - height / 2 * 1 / 5]
    assert camera.project([[2, 1, 0]], size)[0] == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(camera.project([[0, 0, 0]], size), [[width / 2, height / 2]])


def test_points_behind_the_eye_appear_nowhere() -> None:
    camera = Camera.look_at((0, 0, 5), (0, 0, 0))
    assert np.isnan(camera.project([[0, 0, 5], [1, 0, 6]], SIZE)).all()
    assert np.array_equal(camera.depth([[0, 0, 0], [3, 4, 6]]), [5, -1])


def test_a_point_with_opencv_s_centre_lands_half_a_pixel_on() -> None:
    width, height = SIZE
    K = [[500, 0, (width - 1) / 2], [0, 500, (height - 1) / 2], [0, 0, 1]]
    camera = Camera.from_opencv(K, np.eye(3), (0, 0, 0), SIZE)
    assert np.array_equal(camera.project([[0, 0, 1]], SIZE), [[width / 2, height / 2]])


@pytest.mark.parametrize("seed", range(5))
def test_opencv_projects_as_opencv_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    K = np.array([[510.0, 3.5, 301.25], [0, 470.5, 250.75], [0, 0, 1]])
    R, t = random_rotation(rng), rng.normal(size=3)
    inside = rng.uniform([-1, -1, 2], [1, 1, 9], (50, 3))
    points = (inside - t) @ R
    expected = (inside @ K.T)[:, :2] / inside[:, 2:] + 0.5
    for translation in (t, t.reshape(3, 1)):
        camera = Camera.from_opencv(K, R, translation, SIZE)
        assert np.abs(camera.project(points, SIZE) - expected).max() < 1e-12 * 1000
        assert (
            np.abs(pixels_of_clip(homogeneous.transform_points(camera.clip_matrix(SIZE), points), SIZE) - expected).max() < 1e-9
        )
    assert np.abs(camera.depth(points) - inside[:, 2]).max() < 1e-12
    assert np.abs(camera.eye + R.T @ t).max() < 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_every_convention_comes_back_as_it_went(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R, t = random_rotation(rng), rng.normal(size=3)
    K = np.array([[510.0, 3.5, 301.3], [0, 470.5, 250.7], [0, 0, 1]])
    back = Camera.from_opencv(K, R, t, SIZE).to_opencv(SIZE)
    assert np.abs(back[0] - K).max() < 1e-12
    assert np.array_equal(back[1], R)
    assert np.array_equal(back[2], t)

    # Through COLMAP the rotation becomes a quaternion; pixels keep their centres.
    camera = Camera.from_opencv(K * [[1, 0, 1], [1, 1, 1], [1, 1, 1]], R, t, SIZE)
    model, params, qvec, tvec = camera.to_colmap(SIZE)
    assert model == "PINHOLE"
    assert params == pytest.approx([510.0, 470.5, 301.8, 251.2], abs=1e-12)
    assert np.linalg.norm(qvec) == pytest.approx(1, abs=1e-15)
    again = Camera.from_colmap(model, params, qvec, tvec, SIZE)
    assert np.abs(again.view - camera.view).max() < 1e-12
    assert np.abs(again.clip_matrix(SIZE) - camera.clip_matrix(SIZE)).max() < 1e-12

    for in_ndc in (False, True):
        numbers = camera.to_pytorch3d(SIZE, in_ndc)
        again = Camera.from_pytorch3d(*numbers, SIZE, in_ndc)
        assert np.array_equal(again.view, camera.view)
        assert np.abs(again.to_opencv(SIZE)[0] - camera.to_opencv(SIZE)[0]).max() < 1e-12 * 1000


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4))
def test_quaternions_of_any_rotation_come_back(numbers: list[float]) -> None:
    length = np.linalg.norm(numbers)
    if length < 1e-3:
        return
    qvec = np.array(numbers) / length
    camera = Camera.from_colmap("PINHOLE", (500, 500, 320, 240), qvec, (0, 0, 0), SIZE)
    back = camera.to_colmap(SIZE)[2]
    assert back[0] >= 0
    assert min(np.abs(back - qvec).max(), np.abs(back + qvec).max()) < 1e-12


def test_colmap_turns_as_its_quaternion_says() -> None:
    half = np.sqrt(0.5)
    camera = Camera.from_colmap("SIMPLE_PINHOLE", (100, 32.5, 24), (half, 0, 0, half), (0, 0, 5), (64, 48))
    # A quarter turn about z takes +x to +y, which is down in COLMAP.
    assert camera.project([[1, 0, 0]], (64, 48))[0] == pytest.approx([32.5, 24 + 20], abs=1e-12)


@pytest.mark.parametrize("size", [(64, 48), (48, 64)])
def test_pytorch3d_projects_as_its_documentation_says(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    R, T = random_rotation(rng), np.array([0.1, -0.2, 4.0])
    focal, principal = np.array([1.7, 1.9]), np.array([0.1, -0.2])
    points = rng.uniform(-1, 1, (20, 3))
    seen = points @ R + T
    ndc = focal * seen[:, :2] / seen[:, 2:] + principal
    scale = min(size) / 2
    expected = np.array(size) / 2 - ndc * scale
    camera = Camera.from_pytorch3d(R, T, focal, principal, size, in_ndc=True)
    assert np.abs(camera.project(points, size) - expected).max() < 1e-12
    on_screen = Camera.from_pytorch3d(R, T, focal * scale, np.array(size) / 2 - principal * scale, size)
    assert np.abs(on_screen.project(points, size) - expected).max() < 1e-12


def test_another_size_scales_the_intrinsic_matrix_as_resizing_would() -> None:
    K = [[500, 2, 300], [0, 400, 200], [0, 0, 1]]
    camera = Camera.from_opencv(K, np.eye(3), (0, 0, 0), SIZE)
    points = [[0.1, 0.2, 1], [-0.3, 0, 2]]
    assert np.abs(camera.project(points, (1280, 240)) - camera.project(points, SIZE) * [2, 0.5]).max() < 1e-12
    # OpenCV's own centre moves by the half pixel: (300 + 0.5) * 2 - 0.5.
    assert camera.to_opencv((1280, 240))[0][0].tolist() == [1000, 4, 600.5]


def test_skew_stays_and_is_refused_where_it_cannot_be_kept() -> None:
    camera = Camera.from_opencv([[500, 2, 300], [0, 400, 200], [0, 0, 1]], np.eye(3), (0, 0, 0), SIZE)
    assert camera.to_opencv(SIZE)[0][0, 1] == 2
    with pytest.raises(InputError, match=r"^the camera has a skew of 2\.0 pixels, which COLMAP's PINHOLE cannot hold$"):
        camera.to_colmap(SIZE)
    with pytest.raises(InputError, match=r"^the camera has a skew of 2\.0 pixels, which PyTorch3D cannot hold$"):
        camera.to_pytorch3d(SIZE)


def test_two_matrices_make_the_same_camera() -> None:
    made = Camera.look_at((1, 2, 3), (0, 0, 0), fov=40, near=0.5, far=20)
    camera = Camera.from_matrix(made.view, made.projection(SIZE))
    assert np.array_equal(camera.clip_matrix(SIZE), made.clip_matrix(SIZE))
    assert camera.near == pytest.approx(0.5)
    assert camera.far == pytest.approx(20)
    assert np.allclose(camera.to_opencv(SIZE)[0], made.to_opencv(SIZE)[0], atol=1e-12)
    flat = Camera.orthographic((1, 2, 3), (0, 0, 0), height=4, far=9)
    camera = Camera.from_matrix(flat.view, flat.projection(SIZE))
    assert camera.is_orthographic
    assert camera.far == pytest.approx(9)
    assert np.array_equal(camera.project([[0, 0, 0]], SIZE), flat.project([[0, 0, 0]], SIZE))


def test_has_far_says_whether_there_is_a_far_plane() -> None:
    assert not Camera.look_at((0, 0, 5), (0, 0, 0)).has_far
    assert Camera.look_at((0, 0, 5), (0, 0, 0), far=9).has_far
    assert not Camera.orthographic((0, 0, 5), (0, 0, 0), height=1).has_far
    assert not Camera.from_matrix(np.eye(4), homogeneous.perspective(45, 1, 0.1)).has_far
    assert Camera.from_matrix(np.eye(4), homogeneous.perspective(45, 1, 0.1, 5)).has_far


def test_a_far_plane_that_is_none_is_left_out() -> None:
    reversed_depth = homogeneous.perspective(45, 1, 0.1, 5) * [[1], [1], [-1], [1]]
    assert not Camera.from_matrix(np.eye(4), reversed_depth).has_far


def test_a_camera_shows_itself_on_one_line() -> None:
    assert (
        repr(Camera.look_at((0, 0, 5), (0, 0, 0))) == "Camera(eye=(0, 0, 5), lens=Perspective(fov=45.0), near=0.005, far=None)"
    )
    pinhole = Camera.from_opencv(K, np.eye(3), (0, 0, 0), SIZE)
    for camera in (pinhole, Camera.from_matrix(np.eye(4), homogeneous.perspective(45, 1, 0.1))):
        assert "\n" not in repr(camera)
        assert "eye=(0, 0, 0)" in repr(camera)


def test_the_near_plane_defaults_to_a_thousandth_of_the_distance() -> None:
    assert Camera.look_at((0, 3, 4), (0, 0, 0)).near == 0.005
    assert Camera.orthographic((0, 3, 4), (0, 0, 0), height=1).near == 0.005


def test_a_camera_cannot_be_changed_and_survives_pickling() -> None:
    camera = Camera.from_opencv([[500, 2, 300], [0, 400, 200], [0, 0, 1]], np.eye(3), (1, 2, 3), SIZE, far=10)
    with pytest.raises(ValueError, match="read-only"):
        camera.view[0, 0] = 2
    again = pickle.loads(pickle.dumps(camera))
    assert np.array_equal(again.clip_matrix(SIZE), camera.clip_matrix(SIZE))
    assert again.far == 10


def test_inputs_are_copied() -> None:
    K, view = np.eye(3) * [[500], [500], [1]], np.eye(4)
    camera, other = (
        Camera.from_opencv(K, np.eye(3), np.zeros(3), SIZE),
        Camera.from_matrix(view, homogeneous.perspective(45, 1, 1)),
    )
    K[0, 0] = view[0, 0] = 7
    assert camera.to_opencv(SIZE)[0][0, 0] == 500
    assert other.view[0, 0] == 1


# Framing


@pytest.mark.parametrize("up", ["+X", "-X", "+Y", "-Y", "+Z", "-Z", (1.0, 2.0, -0.5)])
@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("orthographic", [False, True])
def test_a_framed_scene_is_inside_the_picture_from_every_side(up: object, fit: str, orthographic: bool) -> None:
    thing = scene((-1, 2, 30), (5, 3, 31), up)
    points = corners_of(thing.bounds)
    for direction in (*DIRECTIONS, (1.0, -2.0, 0.3), up):
        for size in ((400, 300), (300, 400)):
            if direction == up and isinstance(up, str):
                continue
            aspect = size[0] / size[1]
            camera = Camera.frame(thing, direction, fit=fit, aspect=aspect, orthographic=orthographic, points=points)
            seen = camera.project(points, size)
            assert (seen > 0).all()
            assert (seen < size).all()
            clip = homogeneous.transform_points(camera.clip_matrix(size), points)
            assert (clip[:, 2] > -clip[:, 3]).all()
            assert camera.near > 0.01


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("fit", ["box", "points"])
def test_a_tight_fit_touches_the_margin_and_is_centred(fit: str, orthographic: bool) -> None:
    thing = scene((-1, 2, 30), (5, 3, 31))
    rng = np.random.default_rng(3)
    points = corners_of(thing.bounds) if fit == "box" else rng.uniform(*thing.bounds, (200, 3))
    for direction in DIRECTIONS:
        camera = Camera.frame(thing, direction, fit=fit, margin=0.1, orthographic=orthographic, points=points)
        seen = camera.project(points, (400, 300)) / (400, 300)
        low, high = seen.min(axis=0), seen.max(axis=0)
        assert (low + high)[0] == pytest.approx(1, abs=1e-6)
        assert (low + high)[1] == pytest.approx(1, abs=1e-6)
        assert low.min() == pytest.approx(0.1, abs=1e-6)


def test_the_bounding_sphere_touches_the_margin() -> None:
    camera = Camera.frame(scene((-1, -1, -1), (1, 1, 1)), "front", margin=0.05, fov=40)
    distance = np.linalg.norm(camera.eye)
    assert np.tan(np.arcsin(np.sqrt(3) / distance)) == pytest.approx(np.tan(np.radians(20)) * 0.9)
    wide = Camera.frame(scene((-1, -1, -1), (1, 1, 1)), "front", aspect=0.5)
    assert np.linalg.norm(wide.eye) > np.linalg.norm(Camera.frame(scene((-1, -1, -1), (1, 1, 1)), "front").eye) * 1.5


@pytest.mark.parametrize(
    ("up", "direction", "towards"),
    [
        ("+Y", "iso", (1, 1, 1)), ("+Z", "iso", (1, 1, 1)), ("-Y", "iso", (1, -1, 1)),
        ("+Y", "front", (0, 0, 1)), ("+Y", "right", (1, 0, 0)), ("+Y", "left", (-1, 0, 0)), ("+Y", "back", (0, 0, -1)),
        ("+Z", "front", (0, -1, 0)), ("+Z", "right", (1, 0, 0)), ("+Z", "left", (-1, 0, 0)), ("+Z", "top", (0, 0, 1)),
        ("+Z", "bottom", (0, 0, -1)), ("z", "back", (0, 1, 0)), ((0, 0, 3), "front", (0, -1, 0)),
        ("+Y", (0, 0, -7), (0, 0, -1)),
    ],
)  # fmt: skip
def test_directions_are_where_they_are_said_to_be(up: object, direction: Any, towards: tuple[float, ...]) -> None:
    camera = Camera.frame(scene((-1, -1, -1), (1, 1, 1), up), direction)
    assert camera.eye / np.linalg.norm(camera.eye) == pytest.approx(np.array(towards) / np.linalg.norm(towards), abs=1e-12)


@pytest.mark.parametrize(("up", "front"), [("+Y", (0, 0, 1)), ("+Z", (0, -1, 0))])
def test_from_above_the_front_is_at_the_bottom_and_the_right_at_the_right(up: str, front: tuple[int, int, int]) -> None:
    thing = scene((-1, -1, -1), (1, 1, 1), up)
    for direction, sign in (("top", 1), ("bottom", -1)):
        seen = Camera.frame(thing, direction).project([front, (1, 0, 0)], (400, 300))
        assert (seen[0, 1] - 150) * sign > 10
        assert seen[1, 0] > 210 if up == "+Y" or direction == "top" else seen[1, 0] != 200


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize(
    "bounds",
    [
        None, np.full((2, 3), np.nan), [[0, 0, 0], [0, 0, 0]], [[5, 5, 5], [5, 5, 5]], [[1e9, 0, 0], [1e9, 0, 0]],
        [[0, 0, 0], [0, 0, 9]], [[0, 0, 0], [1, 0, 1]], [[1e-30, 0, 0], [2e-30, 1e-30, 0]], [[-1e100, 0, 0], [1e100, 1, 1]],
        [[1e15, 0, 0], [1e15 + 1, 0, 0]],
    ],
)  # fmt: skip
def test_degenerate_bounds_still_give_a_camera(bounds: Any, fit: str, orthographic: bool) -> None:
    thing = SimpleNamespace(bounds=bounds, up="+Y")
    for direction in DIRECTIONS:
        camera = Camera.frame(thing, direction, fit=fit, orthographic=orthographic)
        matrix = camera.clip_matrix((400, 300))
        assert np.isfinite(matrix).all()
        if bounds is not None and np.isfinite(bounds).all():
            seen = camera.project(np.asarray(bounds, dtype=float), (400, 300))
            assert ((seen >= 0) & (seen <= (400, 300))).all()


def test_zoom_enlarges_about_the_middle_and_leaves_the_eye() -> None:
    thing = scene((-1, -1, -1), (1, 2, 1))
    for orthographic in (False, True):
        plain, zoomed = (Camera.frame(thing, zoom=zoom, orthographic=orthographic) for zoom in (1.0, 2.5))
        points = corners_of(thing.bounds)
        assert np.array_equal(plain.eye, zoomed.eye)
        offsets = [camera.project(points, (400, 300)) - (200, 150) for camera in (plain, zoomed)]
        assert np.abs(offsets[1] - offsets[0] * 2.5).max() < 1e-10


# Sizes and errors


@pytest.mark.parametrize("size", [(3, 4), [3, 4], np.array([3, 4], dtype=np.uint8), (np.int16(3), np.uint64(4))])
def test_a_size_may_be_any_two_integers(size: object) -> None:
    assert check_size(size) == (3, 4)
    assert all(type(side) is int for side in check_size(size))


@pytest.mark.parametrize(
    "size",
    [0, 5, None, "ab", b"ab", {1, 2}, {1: 2, 3: 4}, (1,), (1, 2, 3), (1.0, 2), (1.5, 2), (True, 2), ("8", 8), (None, 1), (0, 4),
     (4, -1), (-(2**31), 1), (float("nan"), 1), np.array([3.0, 4.0]), np.array([True, True]), np.array([[1, 2], [3, 4]])],
)  # fmt: skip
def test_a_bad_size_is_quoted(size: object) -> None:
    with pytest.raises(InputError, match=r"^size = .*: expected \(width, height\), two whole numbers above 0$") as caught:
        check_size(size)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("size", [(2**18 + 1, 1), (1, 2**40), (2**16, 2**16), (2**63, 2**63)])
def test_an_enormous_size_is_over_the_limit(size: tuple[int, int]) -> None:
    with pytest.raises(
        LimitError, match=r"^size = \(\d+, \d+\): the limit is 262144 for a side and 2147483648 for all pixels$"
    ):
        check_size(size)


K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
UNIT = scene((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Camera.look_at((np.nan, 0, 0), (0, 0, 0)), "eye[0] = nan: expected a finite number"),
        (lambda: Camera.look_at((0, 0), (0, 0, 0)), "eye = (0, 0): expected numbers of shape (3,), not shape (2,)"),
        (lambda: Camera.look_at("abc", (0, 0, 0)), "eye = 'abc': expected numbers of shape (3,), not type <U3"),
        (lambda: Camera.look_at((1, 2, 3), (1, 2, 3)), "eye = target = [1.0, 2.0, 3.0]: expected two different positions"),
        (lambda: Camera.look_at((1e308, 0, 0), (-1e308, 0, 0)),
         "eye = [1e+308, 0.0, 0.0], target = [-1e+308, 0.0, 0.0]: too far apart"),
        (lambda: Camera.look_at((0, 5, 0), (0, 0, 0)),
         "up = [0.0, 1.0, 0.0]: parallel to the line of sight; expected another direction"),
        (lambda: Camera.look_at((0, 5, 0), (0, 0, 0), (0, 0, 0)), "up = [0.0, 0.0, 0.0]: expected a direction"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), fov=0), "fov = 0.0: expected degrees between 0 and 180"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), fov=180), "fov = 180.0: expected degrees between 0 and 180"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), fov="wide"), "fov = 'wide': expected a number, not type <U4"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), near=0), "near = 0.0: expected a distance above 0"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), near=np.nan), "near = nan: expected a finite number"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0), near=2, far=2),
         "far = 2.0: expected a distance beyond near = 2.0, or None for no far plane"),
        (lambda: Camera.orthographic((0, 0, 5), (0, 0, 0), height=-1), "height = -1.0: expected a length above 0"),
        (lambda: Camera.from_opencv(np.eye(4), np.eye(3), (0, 0, 0), SIZE),
         "K = array([[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]]): "
         "expected numbers of shape (3, 3), not shape (4, 4)"),
        (lambda: Camera.from_opencv([[1, 0, 0], [0, 1, 0], [0, 0, 2]], np.eye(3), (0, 0, 0), SIZE),
         "K = [[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 2.0]]: expected the rows (fx, skew, cx), (0, fy, cy), (0, 0, 1)"),
        (lambda: Camera.from_opencv([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], np.eye(3), (0, 0, 0), SIZE),
         "K has the focal lengths -1.0 and 1.0: expected pixels above 0"),
        (lambda: Camera.from_opencv(K, np.eye(3) * 2, (0, 0, 0), SIZE),
         "R = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]: expected a rotation, but it is off by 3"),
        (lambda: Camera.from_opencv(K, -np.eye(3), (0, 0, 0), SIZE),
         "R = [[-1.0, -0.0, -0.0], [-0.0, -1.0, -0.0], [-0.0, -0.0, -1.0]]: expected a rotation, but it mirrors"),
        (lambda: Camera.from_opencv(K, np.eye(3), [[1, 2], [3]], SIZE), "t = [[1, 2], [3]]: expected numbers of shape (3,)"),
        (lambda: Camera.from_opencv(K, np.eye(3), (0, 0, 0), (0, 1)),
         "size = (0, 1): expected (width, height), two whole numbers above 0"),
        (lambda: Camera.from_colmap("OPENCV", (1, 2, 3), (1, 0, 0, 0), (0, 0, 0), SIZE),
         "unknown camera model 'OPENCV'; the valid ones are: PINHOLE, SIMPLE_PINHOLE"),
        (lambda: Camera.from_colmap("PINHOLE", (1, 2, 3), (1, 0, 0, 0), (0, 0, 0), SIZE),
         "params = (1, 2, 3): expected numbers of shape (4,), not shape (3,)"),
        (lambda: Camera.from_colmap("PINHOLE", (1, 2, 3, 4), (1, 1, 0, 0), (0, 0, 0), SIZE),
         "qvec = [1.0, 1.0, 0.0, 0.0]: expected a unit quaternion, but its length is 1.41421356"),
        (lambda: Camera.from_pytorch3d(np.eye(3), (0, 0, 0), (1, 2, 3), (0, 0), SIZE),
         "focal_length = (1, 2, 3): expected numbers of shape (2,), not shape (3,)"),
        (lambda: Camera.from_matrix(np.diag([1, 1, 1, 2]), np.eye(4)),
         "view has the last row [0.0, 0.0, 0.0, 2.0]: expected (0, 0, 0, 1)"),
        (lambda: Camera.from_matrix(np.diag([0, 0, 1, 1]), np.eye(4)),
         "view = [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0,...: "
         "expected a matrix that can be inverted"),
        (lambda: Camera.from_matrix(np.eye(4), np.diag([1, 1, 1, 0])),
         "projection has a last row of zeros: w would be 0 everywhere"),
        (lambda: Camera(np.eye(4), 45, 1), "lens = 45: expected a Perspective, Orthographic, Pinhole or Projection"),
        (lambda: Camera.orthographic((0, 0, 5), (0, 0, 0), height=1).to_opencv(SIZE),
         "an orthographic camera has no intrinsic matrix, which OpenCV needs"),
        (lambda: Camera.from_matrix(np.eye(4), np.eye(4)[[3, 1, 2, 0]]).to_colmap(SIZE),
         "an oblique camera has no intrinsic matrix, which COLMAP needs"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0, 0)).project([1, 2, 3], SIZE),
         "points has shape (3,) and type int64: expected numbers of shape (N, 3)"),
        (lambda: homogeneous.transform_points(np.eye(4), [[1, 2], [3]]),
         "points = [[1, 2], [3]]: expected numbers of shape (N, 3)"),
        (lambda: Camera.frame(UNIT, "izo"),
         "unknown direction 'izo'; did you mean 'iso'? The valid ones are: iso, front, back, left, right, top, bottom"),
        (lambda: Camera.frame(UNIT, (0, 0, 0)),
         "direction = (0, 0, 0): expected a direction or one of iso, front, back, left, right, top, bottom"),
        (lambda: Camera.frame(UNIT, up="up"), "unknown up axis 'up'; the valid ones are: +X, -X, +Y, -Y, +Z, -Z"),
        (lambda: Camera.frame(UNIT, up=(0, 0, 0)), "up = (0, 0, 0): expected a direction"),
        (lambda: Camera.frame(UNIT, fit="tight"), "unknown fit 'tight'; the valid ones are: sphere, box, points"),
        (lambda: Camera.frame(UNIT, margin=0.5), "margin = 0.5: expected a share of at least 0 and below 0.5"),
        (lambda: Camera.frame(UNIT, aspect=0), "aspect = 0.0: expected a number above 0"),
        (lambda: Camera.frame(UNIT, zoom=-1), "zoom = -1.0: expected a number above 0"),
        (lambda: Camera.frame(scene((0, 0, 0), (1, np.inf, 1))), "bounds[1, 1] = inf: expected a finite number"),
        (lambda: Camera.frame(scene((1, 0, 0), (0, 1, 1))),
         "bounds = [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]: expected the lowest corner first"),
        (lambda: Camera.frame(scene((-1e300, 0, 0), (1e300, 1, 1))),
         "bounds = [[-1e+300, 0.0, 0.0], [1e+300, 1.0, 1.0]]: too large to frame"),
        (lambda: homogeneous.frustum(1, 1, 0, 1, 1),
         "left, right, bottom, top = [1.0, 1.0, 0.0, 1.0]: expected a window that is not empty"),
        (lambda: homogeneous.perspective(45, 0, 1), "aspect = 0.0: expected a number above 0"),
        (lambda: homogeneous.orthographic(1, 0, 1, 2), "height = 0.0: expected a length above 0"),
        (lambda: homogeneous.orthographic(1, 1, 2, 1), "far = 1.0: expected a distance beyond near = 2.0"),
    ],
)  # fmt: skip
def test_messages(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        make()
