"""Scenes written as Open Inventor files and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan.assets.inventor.write import whole_faces, write_iv
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
        (
            Polygons([[[(0, 0), (9, 0), (9, 9)], [(5, 1), (6, 1), (6, 2)]]]),
            "a.iv",
            "instances[0]: polygon 0 has 2 rings; an Inventor",
        ),
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


def test_a_mirrored_texture_cannot_be_written() -> None:
    mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], attributes={"uv": [(0, 0), (1, 0), (0, 1)]})
    with pytest.raises(InputError, match="a texture that is mirrored cannot be written to an Inventor file"):
        write_iv(Scene(Instance(mesh, material=Material("", texture=Texture([[0]], wrap="mirror")))))


def test_odd_names_are_made_fit(tmp_path: Path) -> None:
    scene = Scene([Instance(Points([(0, 0, 0)]), name=name) for name in ("a{b}", "1", "DEF", "é", "")])
    assert [one.name for one in again(scene, tmp_path).instances] == ["a_b", "_1", "_DEF", "", ""]
