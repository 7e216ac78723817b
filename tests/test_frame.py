"""Frames: every field says where a pixel's surface is, and the picture is what the fields say."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.raster import algorithms
from scanspan.target.frame import FIELDS

SIZE = (120, 90)
CUBE = ss.Mesh.from_polygons(
    [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)


def cube_scene():
    """Two cubes, one turned and mirrored, a few segments and points."""
    mirror = np.array([(-1, 0, 0, 2.5), (0, 1, 0, 0.25), (0, 0, 1, -0.5), (0, 0, 0, 1.0)])
    lines = ss.Segments([(0, 0, 1.5), (2.5, 1, 1.5)], [(0, 1)], colors=(255, 0, 0), width=3)
    points = ss.Points([(0.2, 1.3, 0.5), (1.0, 1.3, 0.5)], colors=[(0, 255, 0), (0, 0, 255)], size=5)
    return ss.Scene([CUBE, ss.Instance(CUBE, mirror, ss.Material(base_color=(0.2, 0.4, 0.9))), lines, points])


@pytest.fixture(scope="module")
def frame():
    return ss.render(cube_scene(), size=SIZE, background="transparent")


def test_fields_have_the_promised_shapes_types_and_blanks(frame):
    expected = {
        "color": (4, np.uint8), "depth": (0, np.float32), "primitive": (0, np.int32), "object": (0, np.int32),
        "barycentric": (3, np.float32), "normal": (3, np.float32), "position": (3, np.float64), "uv": (2, np.float32),
    }  # fmt: skip
    assert set(expected) == set(FIELDS)
    for name, (width, dtype) in expected.items():
        value = getattr(frame, name)
        assert value.shape == (90, 120, *([width] if width else [])), name
        assert value.dtype == dtype, name
        assert value.flags.owndata or value.base is not None
    nothing = frame.primitive < 0
    assert 0.3 < nothing.mean() < 0.8
    assert np.isposinf(frame.depth[nothing]).all()
    assert (frame.object[nothing] == -1).all()
    assert np.isnan(frame.position[nothing]).all()
    assert (frame.barycentric[nothing] == 0).all()
    assert (frame.normal[nothing] == 0).all()
    assert np.isnan(frame.uv).all()


def test_positions_project_to_the_centres_of_their_pixels(frame):
    y, x = np.nonzero(frame.object >= 0)
    solid = frame.object[y, x] < 2
    found = frame.camera.project(frame.position[y, x], SIZE)
    assert np.abs(found - np.stack([x, y], axis=1) - 0.5)[solid].max() < 1 / 128
    assert np.allclose(frame.depth[y, x], frame.camera.depth(frame.position[y, x]), rtol=1e-6)


def test_numbers_run_through_all_instances(frame):
    assert frame.scene.first_primitive == (0, 6, 12, 13, 15)
    for k, (first, last) in enumerate(zip((0, 6, 12, 13), (6, 12, 13, 15), strict=True)):
        shown = frame.primitive[frame.object == k]
        assert len(shown) > 0
        assert shown.min() >= first
        assert shown.max() < last


def test_barycentric_weights_give_the_position(frame):
    """Weights are those of the mesh's own corners, on the mirrored cube too."""
    for k in (0, 1):
        instance = frame.scene.instances[k]
        corners = CUBE.positions[CUBE.triangles] @ instance.transform[:3, :3].T + instance.transform[:3, 3]
        for y, x in np.argwhere(frame.object == k)[::37].tolist():
            blends = np.einsum("k,tkc->tc", frame.barycentric[y, x].astype(float), corners)
            assert np.abs(blends - frame.position[y, x]).max(axis=1).min() < 1e-5


def test_normals_point_out_of_both_cubes(frame):
    for k, centre in enumerate([(0.5, 0.5, 0.5), (2.0, 0.75, 0.0)]):
        shown = frame.object == k
        normal = frame.normal[shown]
        assert np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)
        outward = frame.position[shown] - centre
        assert (np.einsum("ij,ij->i", normal, outward) > 0.49).all()


@pytest.mark.parametrize("cull", ["none", "back"])
def test_culling_back_faces_changes_nothing_on_closed_solids(cull):
    meshes = ss.Scene(cube_scene().instances[:2])
    assert np.array_equal(ss.render(meshes, size=SIZE, cull=cull).primitive, ss.render(meshes, size=SIZE).primitive)


def test_culling_front_faces_shows_the_inside():
    front, back = (ss.render(CUBE, size=SIZE, cull=cull).primitive for cull in ("back", "front"))
    assert not set(np.unique(front)) & set(np.unique(back)) - {-1}


def test_segments_and_points_have_the_size_in_pixels_that_was_asked_for():
    for size in (1, 2, 5, 8):
        frame = ss.render(ss.Points([(0, 0, 0)], size=size), ss.Camera.look_at((0, 0, 5), (0, 0, 0)), (32, 32))
        assert (frame.primitive == 0).sum() == size * size
    line = ss.Segments([(-1, 0.01, 0), (1, 0.01, 0)], [(0, 1)], width=3)
    frame = ss.render(line, ss.Camera.orthographic((0, 0, 5), (0, 0, 0), height=4), (64, 32))
    assert (frame.primitive == 0).sum() == 3 * 16


def test_a_segment_through_the_eye_is_cut_at_the_near_plane():
    line = ss.Segments([(0.1, -0.5, 10), (0.1, -0.5, -50)], [(0, 1)], width=2)
    frame = ss.render(line, ss.Camera.look_at((0, 0, 5), (0, 0, 0), near=0.1), (64, 64))
    rows = np.nonzero((frame.primitive == 0).any(axis=1))[0]
    assert rows.min() < 40
    assert rows.max() == 63
    assert np.isfinite(frame.depth[frame.primitive == 0]).all()


def test_colours_of_segments_and_points_are_theirs():
    frame = ss.render(cube_scene(), size=(240, 180), samples=1, shading="flat")
    red, green, blue = (frame.color[frame.primitive == n][:, :3].astype(int).mean(axis=0) for n in (12, 13, 14))
    assert red[0] > 2 * max(red[1:])
    assert green[1] > 2 * max(green[0], green[2])
    assert blue[2] > 2 * max(blue[:2])


def test_threads_do_not_change_the_picture(monkeypatch):
    monkeypatch.setattr(algorithms, "SMALL", 0)
    pictures = [ss.render(cube_scene(), size=SIZE, edges=True, threads=threads).color for threads in (1, 2, 5)]
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_a_crop_is_part_of_the_whole_picture():
    """A camera for the left half, with its principal point moved, sees the left half of the whole."""
    camera = ss.Camera.from_opencv([(100, 0, 63.5), (0, 100, 31.5), (0, 0, 1)], np.eye(3), (-0.5, -0.5, 3), (128, 64))
    half = ss.Camera.from_opencv([(100, 0, 63.5), (0, 100, 31.5), (0, 0, 1)], np.eye(3), (-0.5, -0.5, 3), (64, 64))
    whole, left = ss.render(CUBE, camera, (128, 64)), ss.render(CUBE, half, (64, 64))
    assert (whole.primitive[:, :64] == left.primitive).mean() > 0.999


def test_a_quad_has_one_number_and_no_line_across():
    frame = ss.render(CUBE, "front", size=SIZE, edges=True, line_width=2, background="white", samples=1)
    shown = np.unique(frame.primitive[frame.primitive >= 0])
    assert len(shown) == 1
    dark = frame.color[..., 0] < 60
    middle = dark[30:60, 40:80]
    assert dark.sum() > 100
    assert not middle.any()


def test_edges_are_as_wide_as_asked_for():
    camera = ss.Camera.orthographic((0.5, 0.5, 5), (0.5, 0.5, 0), height=1.2)
    for width in (1.0, 4.0):
        frame = ss.render(CUBE, camera, (120, 120), edges=True, line_width=width, samples=1, edge_color="black")
        row = frame.color[60, :, 0]
        assert abs(int((row == 0).sum()) - width) <= 1


def test_crease_angle_and_shading():
    flat, smooth = (ss.render(CUBE, size=SIZE, shading="smooth", crease_angle=angle).normal for angle in (0.0, 180.0))
    assert len(np.unique(flat.reshape(-1, 3).round(4), axis=0)) == 4  # three faces and nothing
    assert len(np.unique(smooth.reshape(-1, 3).round(4), axis=0)) > 100


def test_background_colours_come_back_exactly():
    frame = ss.render(CUBE, size=SIZE, background=(12, 200, 99))
    assert (frame.color[frame.primitive < 0][:, :4] == (12, 200, 99, 255)).all(axis=1).mean() > 0.9
    assert frame.color[0, 0].tolist() == [12, 200, 99, 255]
    assert ss.render(CUBE, size=SIZE, background="transparent").color[0, 0].tolist() == [0, 0, 0, 0]


def test_textures_are_seen_through_uv():
    image = np.zeros((2, 2, 4), np.uint8)
    image[..., 3] = 255
    image[0, 0, :3], image[1, 1, :3] = (255, 0, 0), (0, 255, 0)
    square = ss.Mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)],
                     attributes={"uv": [(0, 0), (1, 0), (1, 1), (0, 1)]})  # fmt: skip
    scene = ss.Scene(ss.Instance(square, material=ss.Material(texture=ss.Texture(image, filter="nearest"))))
    camera = ss.Camera.orthographic((0.5, 0.5, 5), (0.5, 0.5, 0), height=1)
    frame = ss.render(scene, camera, (64, 64))
    assert frame.color[10, 10, 0] > 150 > 60 > frame.color[10, 10, 1]
    assert frame.color[50, 50, 1] > 150 > 60 > frame.color[50, 50, 0]
    assert np.allclose(frame.uv[10, 10], (10.5 / 64, 1 - 10.5 / 64), atol=1e-6)
    assert ss.render(scene, camera, (64, 64), textures=False).color[50, 10, 0] > 150


def test_an_empty_scene_is_all_background():
    for scene in (ss.Scene([]), ss.Scene(ss.Mesh(np.empty((0, 3)), [])), ss.Scene(ss.Points(np.empty((0, 3))))):
        frame = ss.render(scene, size=(8, 6), background="navy")
        assert (frame.color == (0, 0, 128, 255)).all()
        assert frame.coverage == 0
        assert all(getattr(frame, name) is not None for name in FIELDS)


def test_saving_and_showing(frame, tmp_path):
    frame.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert frame._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    frame.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert set(arrays) == set(FIELDS)
        assert np.array_equal(arrays["primitive"], frame.primitive)
    frame.save(tmp_path / "b.npz", ["depth"])
    with np.load(tmp_path / "b.npz") as arrays:
        assert set(arrays) == {"depth"}
    with pytest.raises(ss.InputError, match=r"^fields = 'depth': only .npz holds fields, not '.*a.npy'$"):
        frame.save(tmp_path / "a.npy", "depth")
    frame.save(tmp_path / "d.npz", "depth")
    with pytest.raises(ss.InputError, match=r"unknown field 'deep'; did you mean 'depth'\?"):
        frame.save(tmp_path / "c.npz", ["deep"])
    assert not (tmp_path / "c.npz").exists()


def test_repr_counts_the_primitives_that_are_seen():
    seen = ss.render(CUBE, "front", size=SIZE, samples=1)
    assert repr(seen) == "Frame(120 x 90, 1 primitives seen)"

    # A wall of 36 x 36 squares, three pixels each, that fills the picture; and a picture of nothing.
    corners = [(x / 36, y / 36, 0.0) for y in range(37) for x in range(37)]
    squares = [(i, i + 1, i + 38, i + 37) for y in range(36) for i in range(37 * y, 37 * y + 36)]
    front = ss.Camera.orthographic((0.5, 0.5, 5), (0.5, 0.5, 0), height=1.0)
    wall = ss.render(ss.Mesh.from_polygons(corners, squares), front, (108, 108), samples=1)
    assert repr(wall) == "Frame(108 x 108, 1,296 primitives seen)"
    away = ss.Camera.orthographic((9, 9, 5), (9, 9, 0), height=1.0)
    assert repr(ss.render(CUBE, away, (8, 8), samples=1)) == "Frame(8 x 8, 0 primitives seen)"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shading": "phong"}, "unknown shading 'phong'"),
        ({"crease_angle": 200}, "crease_angle = 200: must be a number from 0 to 180"),
        ({"crease_angle": "30"}, "crease_angle = '30': must be a number"),
        ({"line_width": -1}, "line_width = -1: must be a number from 0 to 1000"),
        ({"line_width": np.nan}, "line_width = nan: must be a number"),
        ({"edge_color": "blurple"}, "'blurple'"),
        ({"background": (1, 2)}, "colour"),
        ({"camera": "izo"}, "unknown direction 'izo'"),
        ({"camera": 5}, "camera = 5: expected a Camera or the name of a direction"),
        ({"up": "upward"}, "unknown up axis 'upward'"),
        (
            {"scene": "spot.obj"},
            r"scene = 'spot.obj': expected a Scene, Mesh, Polygons, Segments, Points, PointCloud or Instance; "
            r"use load\(\) to read a file",
        ),
        ({"scene": None}, "scene = None: expected a Scene"),
        ({"blend": "gamma"}, "unknown blend 'gamma'"),
        ({"size": (100000, 100000)}, "pixels"),
        ({"samples": 5}, "samples = 5: must be one of"),
        ({"edges": "no"}, "edges = 'no': must be True or False"),
        ({"two_sided": 3}, "two_sided = 3: must be True or False"),
        ({"textures": None}, "textures = None: must be True or False"),
    ],
)
def test_what_cannot_be_used_is_quoted(options, message):
    arguments = {"scene": CUBE, "size": (8, 8), **options}
    with pytest.raises(ss.InputError, match=message) as caught:
        ss.render(**arguments)
    assert "\n" not in str(caught.value)


def test_a_mesh_cannot_be_changed_behind_its_checks():
    """A Mesh owns read-only arrays, so no index reaches a kernel that was not checked."""
    positions, triangles = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0.0)]), np.array([(0, 1, 2)], np.int32)
    mesh = ss.Mesh(positions, triangles)
    triangles[0, 2] = 200_000_000
    positions[:] = np.nan
    frame = ss.render(mesh, "front", (32, 24))
    assert frame.coverage > 0.1
    assert np.isfinite(frame.position[frame.primitive >= 0]).all()
    for array in (mesh.positions, mesh.triangles, mesh.source, mesh.inner):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
