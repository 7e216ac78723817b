"""OBJ: faces kept whole, corners, materials and objects, and what is said of damaged files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.load import load
from tests.models import POINTS, Write, fault, mesh_of, picture, writer


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into a folder of the test's own and return its path."""
    return writer(tmp_path)


def test_obj_with_everything(write: Write) -> None:
    write(
        "materials/m.mtl", "newmtl skin\nKd 0.5 0.25 1\nd 0.5\nmap_Kd -clamp on -s 1 1 1 maps/p.png\nnewmtl plain\nKd 1 0 0\n"
    )
    write("materials/../maps/p.png", picture())
    path = write(
        "a.obj",
        "\ufeff# a comment\nmtllib materials/m.mtl\no first part\n"
        "v 0 0 0\nv 4 2 0\n\tv\t0 4 0\nv 1 2 0\r\nvt 0 0\nvt 1 0 0\nvt 1 1\nvn 0 0 1\n"
        "usemtl skin\nf 1/1/1 2/2/1 \\\n 3/3/1 4/1/1\nusemtl plain\nf -4//-1 -3//-1 -2//-1 # the end\n"
        "o second\nf 1 2 4\ns off\ng x\nl 1 2\n",
    )
    scene = load(path)
    assert [i.name for i in scene.instances] == ["first part", "first part", "second"]
    assert [i.material.name for i in scene.instances] == ["skin", "plain", "plain"]
    assert scene.first_primitive == (0, 1, 2, 3)
    assert scene.up == "+Y"
    assert scene.notes == ("lines in the file are left out",)
    skin = scene.instances[0].material
    assert skin.base_color == (0.5, 0.25, 1.0, 0.5)
    assert skin.texture is not None
    assert skin.texture.wrap == ("clamp", "clamp")
    assert skin.texture.image[0, 0].tolist() == [255, 0, 0, 255]

    # The arrow head is cut at its notch, and its corners keep their coordinates.
    first = mesh_of(scene)
    assert first.triangles.tolist() == [[0, 1, 3], [1, 2, 3]]
    assert first.corners["uv"].tolist() == [[[0, 0], [1, 0], [0, 0]], [[1, 0], [1, 1], [0, 0]]]
    assert first.corners["normal"][0, 0].tolist() == [0, 0, 1]
    second = mesh_of(scene, 1)
    assert second.positions.tolist() == [[0, 0, 0], [4, 2, 0], [0, 4, 0]]
    assert "uv" not in second.corners
    assert not mesh_of(scene, 2).corners


def test_obj_coordinates_that_follow_the_vertices_are_vertex_attributes(write: Write) -> None:
    path = write("a.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 3/3 1/1 2/2")
    mesh = mesh_of(load(path))
    assert mesh.attributes["uv"].tolist() == [[0, 0], [1, 0], [0, 1]]
    assert not mesh.corners


@pytest.mark.parametrize("scale", [1, 255])
def test_obj_vertex_colours(write: Write, scale: int) -> None:
    rows = [(0, 0, 0, scale, 0, 0), (1, 0, 0, 0, scale, 0), (0, 1, 0, 0, 0, scale)]
    path = write("a.obj", "".join(f"v {' '.join(map(str, row))}\n" for row in rows) + "f 1 2 3")
    assert mesh_of(load(path)).attributes["color"].tolist() == np.eye(4)[[0, 1, 2]].__add__([0, 0, 0, 1]).tolist()


def test_obj_with_some_corners_without_normals(write: Write) -> None:
    mesh = mesh_of(load(write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\nf 1/ 2// 3//1")))
    assert mesh.corners["normal"].tolist() == [[[0, 0, 1]] * 3, [[0, 0, 0]] * 3, [[0, 0, 0], [0, 0, 0], [0, 0, 1]]]


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_obj_line_endings(write: Write, ending: str) -> None:
    path = write("a.obj", ending.join(["v 0 0 0", "v 1 0 0", "v 0 1 0", "f 1 2 3"]))
    assert load(path).triangle_count == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (POINTS, ": the file has no faces"),
        (POINTS + "f 1 2 4", ": line 4: vertex 4 does not exist, there are 3"),
        (POINTS + "f 1 2 -4", ": line 4: vertex -4 does not exist, there are 3"),
        (POINTS + "f 1 2 0", ": line 4: expected a corner such as 3 or 3/1/2, got '0'"),
        (POINTS + "f 1 2 18446744073709551617", ": line 4: expected a corner such as 3 or 3/1/2, got '18446744073709551617'"),
        (POINTS + "f 1 2 x", ": line 4: expected a corner such as 3 or 3/1/2, got 'x'"),
        (POINTS + "f 1 2 3/1/2/4", ": line 4: expected a corner such as 3 or 3/1/2, got '3/1/2/4'"),
        (POINTS + "f 1 2 " + "9" * 100_000, ": line 4: expected a corner such as 3 or 3/1/2, got '" + "9" * 30 + "'"),
        (POINTS + "f 1/1 2/1 3/1", ": line 4: texture coordinate 1 does not exist, there are 0"),
        (POINTS + "f 1//1 2//1 3//1", ": line 4: normal 1 does not exist, there are 0"),
        (POINTS + "v 1 2\nf 1 2 3", ": line 4: expected v and 3 numbers, got 2"),
        (POINTS + "v 1 2 x\nf 1 2 3", ": line 4: expected v and 3 numbers, got 'x'"),
        (POINTS + "vt 1\nf 1 2 3", ": line 4: expected vt and 2 numbers, got 1"),
        (POINTS + "vn 1 0 q\nf 1 2 3", ": line 4: expected vn and 3 numbers, got 'q'"),
        (POINTS + "v nan 0 0\nf 1 2 4", ": positions[3] = (nan, 0.0, 0.0): a vertex that is used is not finite"),
        (POINTS + "v 1e400 0 0\nf 1 2 4", ": positions[3] = (inf, 0.0, 0.0): a vertex that is used is not finite"),
        ("v 0 0 0 1 1 -1\nf 1 1 1", ": a vertex has a colour that is not 0..1 or 0..255"),
        (POINTS.encode("utf-16"), ": expected text, the file is binary or UTF-16"),
        (bytes(range(256)) * 8, ": expected text, the file is binary or UTF-16"),
        ("f 1 2 3\n" * 3, ": line 1: vertex 1 does not exist, there are 0"),
        ("call evil.obj\ncsh rm -rf x\n", ": the file has no faces"),
    ],
)
def test_damaged_obj(write: Write, content: bytes | str, message: str) -> None:
    assert fault(write("a.obj", content)) == message


def test_negative_numbers_count_from_the_face_and_not_from_the_end(write: Write) -> None:
    mesh = mesh_of(load(write("a.obj", POINTS + "f -3 -2 -1\n" + "v 5 5 5\nv 6 6 6\nf -5 -4 -1\n")))
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 1, 4]]


def test_nonfinite_vertices_can_be_dropped(write: Write) -> None:
    path = write("a.obj", POINTS + "v nan 0 0\nf 1 2 3\nf 1 2 4\nf 3 2 1")
    mesh = mesh_of(load(path, nonfinite="drop"))
    assert mesh.source.tolist() == [0, 2]
    assert mesh.face_count == 3
