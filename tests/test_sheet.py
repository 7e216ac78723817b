"""How a scene is seen: the camera of a shot; the contact sheet, its scale, and labels that are in the way of nothing."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.lens import Orthographic
from scanspan.view.sheet import Layout, compose, match_scales, plan, write_label
from scanspan.view.shot import Shot, make_camera

BOX = ss.Scene(ss.Mesh([(0, 0, 0), (4, 0, 0), (4, 2, 0), (0, 2, 1)], [(0, 1, 2), (0, 2, 3)]))
NAMES = ["iso", "front", "back", "left", "right", "top", "bottom"]


@pytest.mark.parametrize("size", [(1280, 960), (900, 300), (300, 900), (641, 479), (64, 48)])
@pytest.mark.parametrize("count", range(1, 8))
def test_views_stand_inside_the_sheet_and_apart(size: tuple[int, int], count: int) -> None:
    layout = plan(NAMES[:count], size)
    owners = np.zeros((size[1], size[0]), np.int64)
    width, height = layout.cell
    assert len(layout.corners) == count
    for left, top in layout.corners:
        assert min(left, top) >= 0
        assert left + width <= size[0]
        assert top + height <= size[1]
        owners[top : top + height, left : left + width] += 1
    assert owners.max() == 1
    assert (owners == 1).mean() > 0.5, "more paper than pictures"


def test_the_grid_suits_the_sheet() -> None:
    assert plan(["iso"], (640, 480)) == Layout((640, 480), (640, 480), ((0, 0),), 18, 1.75 * 18 / 480)
    four = plan(NAMES[:4], (1280, 960))
    assert four.cell == (638, 478)
    assert four.corners == ((0, 0), (642, 0), (0, 482), (642, 482))
    assert [corner[1] for corner in plan(NAMES[:3], (900, 300)).corners] == [0, 0, 0]
    assert [corner[0] for corner in plan(NAMES[:3], (300, 900)).corners] == [0, 0, 0]


def test_a_last_row_that_is_not_full_is_centred() -> None:
    layout = plan(NAMES[:3], (400, 300))
    assert layout.corners[2][0] == (400 - layout.cell[0]) // 2


def test_too_many_views_for_the_pixels_are_refused() -> None:
    with pytest.raises(ss.InputError, match=r"^size = \(2, 2\): too small for 7 views$"):
        plan(NAMES, (2, 2))


def test_labels_are_left_out_where_they_would_cover_the_picture() -> None:
    assert plan(["bottom"], (64, 48)).letters == 0
    assert plan(["bottom"], (64, 48)).margin == 0.03
    assert plan(["bottom"], (4000, 4000)).letters == 30


def pixels_per_unit(camera: ss.Camera, centre: np.ndarray) -> float:
    """Return how long a unit at a point is in a picture of 100 x 100 pixels."""
    right = camera.view[0, :3]
    ends = camera.project([centre - right / 2, centre + right / 2], (100, 100))
    return float(ends[1, 0] - ends[0, 0])


@pytest.mark.parametrize("orthographic", [False, True])
def test_all_views_have_the_smallest_scale_and_lose_nothing(orthographic: bool) -> None:
    centre = BOX.bounds.mean(axis=0)
    cameras = [ss.Camera.frame(BOX, name, aspect=1.0, orthographic=orthographic, fit="points") for name in NAMES]
    before = [pixels_per_unit(camera, centre) for camera in cameras]
    matched = match_scales(cameras, centre)
    assert max(before) > 1.2 * min(before)
    for camera, old in zip(matched, cameras):
        assert pixels_per_unit(camera, centre) == pytest.approx(min(before), rel=1e-12)
        pixels = camera.project(BOX.points, (100, 100))
        assert pixels.min() >= 0
        assert pixels.max() <= 100
        assert camera.depth(BOX.points).min() > camera.near
        np.testing.assert_array_equal(camera.view[:3, :3], old.view[:3, :3])
        assert isinstance(camera.lens, Orthographic) == orthographic


def plain(layout: Layout, color: tuple[int, int, int, int]) -> np.ndarray:
    """Return a picture of one colour that fits a cell."""
    return np.full((layout.cell[1], layout.cell[0], 4), color, np.uint8)


def test_pictures_keep_their_pixels_beside_the_label() -> None:
    layout = plan(["iso", "top"], (400, 150))
    pictures = [plain(layout, (10, 20, 200, 255)), plain(layout, (250, 250, 250, 255))]
    sheet = compose(pictures, ["iso", "top"], layout)
    assert sheet.shape == (150, 400, 4)
    for picture, (left, top) in zip(pictures, layout.corners):
        part = sheet[top : top + layout.cell[1], left : left + layout.cell[0]]
        rows, columns = np.nonzero((part != picture).any(axis=2))
        assert len(rows) > 20, "no label"
        assert rows.max() < layout.margin * layout.cell[1]
        assert columns.max() < 5 * layout.letters
    gap = layout.corners[0][0] + layout.cell[0]
    assert (sheet[:, gap] == (10, 13, 18, 255)).all()


def test_light_pictures_lie_on_white_paper_and_transparent_ones_on_none() -> None:
    layout = plan(["iso", "top"], (400, 150))
    gap = layout.corners[0][0] + layout.cell[0]
    light = [plain(layout, (200, 210, 220, 255))] * 2
    assert (compose(light, ["iso", "top"], layout)[:, gap] == 255).all()
    clear = compose([plain(layout, (0, 0, 0, 0))] * 2, ["iso", "top"], layout, transparent=True)
    assert (clear[:, gap, 3] == 0).all()
    assert 20 < (clear[..., 3] > 128).sum() < 1000, "the labels are opaque, the rest is not"


def test_the_ink_stands_out() -> None:
    for shade in (0, 60, 150, 255):
        labelled = write_label(np.full((60, 100, 4), (shade, shade, shade, 255), np.uint8), "top", 16)
        assert np.abs(labelled[..., :3].astype(int) - shade).max() > 80
        assert (labelled[..., 3] == 255).all()


def test_a_picture_of_another_size_is_refused() -> None:
    layout = plan(["iso"], (400, 150))
    with pytest.raises(ss.InputError, match=r"^the picture of 'iso' has shape \(5, 5, 4\): expected \(150, 400, 4\)$"):
        compose([np.zeros((5, 5, 4), np.uint8)], ["iso"], layout)


def test_a_direction_is_the_one_in_which_the_camera_looks() -> None:
    scene = ss.Scene(ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 1)], [(0, 1, 2)]))
    size = (64, 48)
    for shot, forward in (
        (Shot("front"), (0, 0, -1)),
        (Shot("front", azimuth=90.0), (-1, 0, 0)),
        (Shot("front", elevation=90.0), (0, -1, 0)),
        (Shot("front", focal_point=np.array([5.0, 5.0, 5.0])), (0, 0, -1)),
        (Shot(position=np.array([3.0, 1.0, 1.0]), focal_point=np.ones(3)), (-1, 0, 0)),
        (Shot(position=np.array([3.0, 1.0, 1.0]), focal_point=np.ones(3), azimuth=90.0), (0, 0, 1)),
    ):
        camera = make_camera(scene, shot, size)
        np.testing.assert_allclose(-camera.view[2, :3], forward, atol=1e-12)
    above = make_camera(scene, Shot(position=np.array([0.0, 9.0, 0.0]), focal_point=np.zeros(3)), size)
    np.testing.assert_allclose(above.eye, (0, 9, 0), atol=1e-12)


def test_what_the_eye_looks_at_is_in_the_middle_of_the_picture() -> None:
    scene = ss.Scene(ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 1)], [(0, 1, 2)]))
    for orthographic in (False, True):
        shot = Shot(focal_point=np.array([1.0, 0.0, 0.0]), zoom=3.0, is_orthographic=orthographic)
        np.testing.assert_allclose(make_camera(scene, shot, (64, 48)).project([(1, 0, 0)], (64, 48)), [(32, 24)], atol=1e-9)


def test_a_zoom_factor_enlarges_by_that_much() -> None:
    centre = BOX.bounds.mean(axis=0)
    for orthographic in (False, True):
        for position in (None, np.array([3.0, 4.0, 9.0])):
            shot = Shot(position=position, is_orthographic=orthographic)
            one, three = (make_camera(BOX, shot._replace(zoom=zoom), (100, 100)) for zoom in (1.0, 3.0))
            assert pixels_per_unit(three, centre) == pytest.approx(3 * pixels_per_unit(one, centre), rel=1e-9)


def test_an_eye_in_the_focal_point_sees_nothing() -> None:
    with pytest.raises(ss.InputError, match=r"^--camera-position = 1,2,3: the eye lies in the focal point"):
        make_camera(BOX, Shot(position=np.array([1.0, 2.0, 3.0]), focal_point=np.array([1.0, 2.0, 3.0])), (64, 48))
