"""Scenes written as Open Inventor files and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan.assets.camera import Camera
from scanspan.assets.inventor.write import whole_faces
from scanspan.assets.light import Light
from scanspan.assets.load import load
from scanspan.assets.material import Material, Texture
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.scene import UPS, Instance, Scene
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError
from scanspan.homogeneous import transform_points
from scanspan.pipeline import render
from scanspan.target.save import save
from tests.inventor import mesh_in, only

CORNERS = [(0.0, 0.0, 0.0), (4.0, 0.1, 0.0), (4.0, 1.0 / 3.0, 0.0), (1.0, 1e-7, 2.0), (0.0, 5.0, 0.0)]


def again(scene: Any, folder: Path) -> Scene:
    """A scene after it was written and read."""
    save(scene, folder / "again.iv")
    found = load(folder / "again.iv")
    assert found.notes == ()
    return found


def test_a_mesh_comes_back(tmp_path: Path) -> None:
    normals = np.tile(np.array([[0.0, 0.6, 0.8]]), (7, 1))
    colors = np.linspace(0.0, 1.0, 28).reshape(7, 4)
    mesh = Mesh.from_flat(
        np.array(CORNERS), np.array([0, 1, 2, 4, 0, 3, 1]), np.array([4, 3]),
        corners={"normal": normals, "color": colors, "uv": colors[:, :2] * 3.0},
    )  # fmt: skip
    texture = Texture(np.arange(24, dtype=np.uint8).reshape(2, 3, 4), wrap=("clamp", "repeat"))
    place = np.array([[1.0, 0.0, 0.5, 1.0 / 3.0], [0.0, 2.0, 0.0, 5.0], [0.0, 0.0, 1e-3, 0.0], [0.0, 0.0, 0.0, 1.0]])
    instance = Instance(mesh, place, Material("", (0.5, 1.0, 0.25, 0.75), texture, emissive_color=(0.1, 0.2, 0.3)), "a part")
    found = only(again(instance, tmp_path))
    other = mesh_in(found)
    assert found.name == "a_part"
    assert np.array_equal(found.transform, place)
    assert other.face_count == mesh.face_count
    assert np.array_equal(other.positions[other.triangles], mesh.positions[mesh.triangles])
    assert np.array_equal(other.corners["normal"], mesh.corners["normal"])
    assert np.array_equal(other.corners["uv"], mesh.corners["uv"])
    shown = mesh.corners["color"][..., :3] * np.array([0.5, 1.0, 0.25])
    np.testing.assert_allclose(other.corners["color"][..., :3], shown, atol=1e-6)
    assert found.material.texture is not None
    assert np.array_equal(found.material.texture.image, texture.image)
    assert found.material.texture.wrap == texture.wrap
    assert found.material.emissive_color == (0.1, 0.2, 0.3)


def test_the_picture_comes_back(tmp_path: Path) -> None:
    house = Mesh.from_polygons(CORNERS, [(0, 1, 2, 4), (0, 3, 1), (1, 3, 4)])
    scene = Scene(
        [
            Instance(house, material=Material("", (0.9, 0.2, 0.1))),
            Instance(Segments(CORNERS, [(0, 3), (2, 4)], colors=[(255, 0, 0), (0, 0, 255)], width=3.0)),
            Instance(Points(CORNERS, size=9.0), material=Material("", (0.0, 0.5, 0.0), is_lit=False)),
            Instance(Polygons([[(0, 0, 3), (2, 0, 3), (2, 2, 3)]], colors=(0, 128, 255))),
        ]
    )
    found = again(scene, tmp_path)
    first, second = (render(one, "front", (80, 60), samples=1) for one in (scene, found))
    assert np.array_equal(first.color, second.color)
    assert np.array_equal(first.depth, second.depth)
    assert len(np.unique(first.color.reshape(-1, 4), axis=0)) > 30


@pytest.mark.parametrize("up", UPS)
def test_what_is_up_stays_up(tmp_path: Path, up: str) -> None:
    axis = np.zeros(3)
    axis["XYZ".index(up[1])] = 1.0 if up[0] == "+" else -1.0
    found = again(Scene(Points([axis]), up=up), tmp_path)
    assert found.up == "+Y"
    place = transform_points(only(found).transform, only(found).used_positions)[0, :3]
    np.testing.assert_allclose(place, [0, 1, 0], atol=1e-12)


def test_colors_of_lines_points_and_polygons(tmp_path: Path) -> None:
    ends = Segments(CORNERS[:3], [(0, 1), (1, 2)], colors=[(255, 0, 0), (0, 255, 0), (0, 0, 255)])
    lines = only(again(ends, tmp_path)).geometry
    assert isinstance(lines, Segments)
    assert lines.colors is not None
    assert lines.colors[:, :3].tolist() == [[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]]
    dots = only(again(Points(CORNERS[:2], colors=[(255, 0, 0), (0, 255, 0)]), tmp_path)).geometry
    assert isinstance(dots, Points)
    assert dots.colors is not None
    assert dots.colors[:, :3].tolist() == [[1, 0, 0], [0, 1, 0]]
    square = [(0, 0), (1, 0), (1, 1)]
    faces = again(Polygons([square, [(3, 0), (4, 0), (4, 1)]], colors=[(255, 0, 0), (0, 0, 255)]), tmp_path)
    colors = mesh_in(only(faces)).corners["color"][:, 0, :3]
    assert colors.tolist() == [[1, 0, 0], [0, 0, 1]]


@given(st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=6, unique=True), min_size=1, max_size=4))
def test_faces_are_written_whole(faces: list[list[int]]) -> None:
    angle = np.arange(8) * np.pi / 4.0
    points = np.stack([np.cos(angle), np.sin(angle), np.zeros(8)], axis=1)
    ordered = [sorted(face) for face in faces]
    mesh = Mesh.from_polygons(points, ordered)
    corner, counts = whole_faces(mesh)
    assert counts.tolist() == [len(face) for face in ordered]
    vertex = mesh.triangles.reshape(-1)[corner]
    starts = np.cumsum(counts) - counts
    for face, start in zip(ordered, starts.tolist()):
        ring = vertex[start : start + len(face)].tolist()
        turn = ring.index(face[0])
        assert ring[turn:] + ring[:turn] == face


@pytest.mark.parametrize(
    ("scene", "path", "message"),
    [
        (Points([(0, 0, 0)]), "a.obj", "unknown ending of a scene file 'obj'; the valid ones are: iv"),
        (Points([(0, 0, 0)]), "", "path: expected the name of a file, got an empty one"),
        (Points([(0, 0, 0)]), "no/such/folder.iv", "does not exist"),
    ],
)
def test_what_cannot_be_written(scene: Any, path: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        save(scene, str(tmp_path / path) if path.startswith("a") else path)
    assert message in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_two_ambient_lights_on_one_shape_cannot_be_written(tmp_path: Path) -> None:
    scene = Scene(Mesh(CORNERS[:3], [(0, 1, 2)]), lights=[Light("ambient"), Light("ambient", (1, 0, 0))])
    with pytest.raises(InputError, match=r"^instances\[0\]: 2 ambient lights reach it; an Inventor file has one at a time$"):
        save(scene, tmp_path / "a.iv")


def test_polygons_with_holes_come_back_as_triangles(tmp_path: Path) -> None:
    ring, hole = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)], [(1, 1, 0), (2, 1, 0), (2, 3, 0)]
    across = [[(x, 2.0, y + 1.0 / 3.0) for x, y, _ in points] for points in (ring, hole)]
    crossed = [[(8, 0, 0), (9, 0, 1), (9, 0, 0), (8, 0, 1)], [(8.1, 0, 0.4), (8.2, 0, 0.5), (8.1, 0, 0.6)]]
    polygons = Polygons([[ring, hole], across, crossed], colors=[(255, 0, 0), (0, 255, 0), (0, 0, 255)])
    scene = Scene([Instance(polygons), Instance(Polygons([[ring, hole]]), np.diag([1.0, -2.0, 1.0, 1.0]))])
    found = again(scene, tmp_path)
    mesh = mesh_in(found.instances[0])
    assert {tuple(point) for rings in ([ring, hole], across) for one in rings for point in one} <= {
        tuple(point) for point in mesh.positions.tolist()
    }
    corners = mesh.positions[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert abs(np.linalg.norm(normals, axis=1).sum() / 2 - (15 + 15 + 0.5 - 0.01)) < 1e-6
    for direction in ("iso", "front", "top"):
        ours, theirs = (render(one, direction, (80, 60), samples=1).color.astype(int) for one in (scene, found))
        assert (np.abs(ours - theirs).max(axis=2) > 2).mean() < 0.003


def test_a_mirrored_texture_is_written_with_its_mirror_image(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (3, 5, 3)).astype(np.uint8)
    mesh = Mesh(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)],
        attributes={"uv": [(-1.5, -1.5), (2.5, -1.5), (2.5, 2.5), (-1.5, 2.5)]},
    )  # fmt: skip
    for wrap in ("mirror", ("mirror", "repeat"), ("clamp", "mirror")):
        scene = Scene(Instance(mesh, material=Material("", texture=Texture(pixels, wrap=wrap))))
        found = again(scene, tmp_path)
        ours, theirs = (render(one, "front", (80, 80), samples=1).color.astype(int) for one in (scene, found))
        assert np.abs(ours - theirs).max() <= 1


def test_lights_and_cameras_come_back(tmp_path: Path) -> None:
    mesh = Mesh(CORNERS[:3], [(0, 1, 2)])
    shiny = Material("", (0.5, 0.4, 0.3), ambient_color=(0.1, 0.2, 0.3), specular_color=(1, 1, 0), shininess=0.75)
    place = {"position": (1, 2, 9), "attenuation": (1, 0.5, 0.25)}
    lights = [
        Light("ambient", (1, 1, 0), 0.3, instances=[1]), Light("directional", direction=(1, 2, -3)),
        Light("spot", (1, 0.5, 0), 0.7, direction=(0, 0, -1), cutoff_angle=40, drop_off=3, instances=[0], **place),
        Light("point", intensity=0.25, instances=[1], **place),
    ]  # fmt: skip
    cameras = [
        Camera.look_at((5, 6, 7), (0, 0, 0), (0, 1, 0), fov=40),
        Camera.orthographic((5, -6, 7), (0, 1, 0), (1, 0, 0), height=9),
        Camera.from_opencv([(9, 0, 4), (0, 8, 3), (0, 0, 1)], np.eye(3), (0, 0, 3), (8, 6)),
    ]
    scene = Scene([Instance(mesh), Instance(mesh, material=shiny)], "+Z", lights=lights, cameras=cameras)
    found = again(scene, tmp_path)
    assert found.instances[1].material.specular_color == (1.0, 1.0, 0.0)
    assert (found.instances[1].material.ambient_color, found.instances[1].material.shininess) == ((0.1, 0.2, 0.3), 0.75)
    assert len(found.cameras) == 2
    for camera in (0, 1):
        ours, theirs = (render(one, one.cameras[camera], (60, 40)).color.astype(int) for one in (scene, found))
        assert len(np.unique(ours.reshape(-1, 4), axis=0)) > 50
        assert np.abs(ours - theirs).max() <= 1


def test_odd_names_are_made_fit(tmp_path: Path) -> None:
    scene = Scene([Instance(Points([(0, 0, 0)]), name=name) for name in ("a{b}", "1", "DEF", "é", "")])
    assert [one.name for one in again(scene, tmp_path).instances] == ["a_b", "_1", "_DEF", "", ""]
