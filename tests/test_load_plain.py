"""STL, PLY and OFF: every form of them, and what is said of damaged files."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from scanspan.assets.cloud import PointCloud
from scanspan.assets.load import load
from scanspan.assets.shapes import Segments
from tests.models import OFF, TEXT_STL, Write, binary_stl, fault, mesh_of, picture, ply, writer


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into a folder of the test's own and return its path."""
    return writer(tmp_path)


@pytest.mark.parametrize(
    "content", [binary_stl(1), binary_stl(1, b"solid x"), TEXT_STL, TEXT_STL.upper(), TEXT_STL.replace("\n", "\r\n")]
)
def test_stl(write: Write, content: bytes | str) -> None:
    scene = load(write("a.STL", content))
    assert mesh_of(scene).positions.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh_of(scene).triangles.tolist() == [[0, 1, 2]]
    assert scene.up == "+Z"
    assert scene.instances[0].name == "a"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (binary_stl(2)[:-1], ": byte 80: expected 184 bytes for 2 triangles, the file has 183"),
        (binary_stl(2) + b"x", ": byte 80: expected 184 bytes for 2 triangles, the file has 185"),
        (b"\0" * 80 + b"\xff" * 4, ": byte 80: expected 214748364834 bytes for 4294967295 triangles, the file has 84"),
        (b"\0" * 50, ": expected an STL file, at least 84 bytes or the word solid, got 50 bytes"),
        (binary_stl(0), ": the file has no triangles"),
        ("solid\nendsolid\n", ": the file has no triangles"),
        ("solid\n", ": line 1: the file ends without endsolid: it is cut short"),
        (TEXT_STL[:-9], ": line 8: the file ends without endsolid: it is cut short"),
        (TEXT_STL.replace("endloop\n", ""), ": line 7: expected endloop, got 'endfacet'"),
        (TEXT_STL.replace("endfacet\n", ""), ": line 8: expected endfacet, the solid ends here"),
        (TEXT_STL.replace("vertex 1 0 0", "vertex 1 0"), ": line 5: expected vertex and three numbers, got 2"),
        (TEXT_STL.replace("vertex 1 0 0", "vertex 1 0 o"), ": line 5: expected a number, got 'o'"),
        (
            TEXT_STL.replace("vertex 1 0 0", "vertex 1 0 inf"),
            ": positions[1] = (1.0, 0.0, inf): a vertex that is used is not finite",
        ),
    ],
)
def test_damaged_stl(write: Write, content: bytes | str, message: str) -> None:
    assert fault(write("a.stl", content)) == message


FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("faces", [[[0, 1, 2, 3], [2, 1, 0, 3]], [[0, 1, 2, 3], [0, 1], [0, 1, 2]]])
def test_ply(write: Write, form: str, faces: list[list[int]]) -> None:
    scene = load(write("a.ply", ply(form, faces)))
    mesh = mesh_of(scene)
    assert mesh.face_count == len(faces)
    assert mesh.triangles[:2].tolist() == [[0, 1, 3], [1, 2, 3]]
    assert mesh.positions[3].tolist() == [1, 2, 0]
    assert mesh.attributes["color"][2].tolist() == [20, 0, 255, 255]
    assert mesh.attributes["quality"][2].tolist() == [-2]
    assert mesh.corners["color"][-1, 0].tolist() == [50 * (len(faces) - 1), 1, 2, 255]
    assert mesh.corners["uv"][0].tolist() == [[0, 0], [1, 1], [3, 3]]
    assert scene.up == "+Y"


@pytest.mark.parametrize("form", FORMS)
def test_ply_whose_first_face_is_the_smallest(write: Write, form: str) -> None:
    mesh = mesh_of(load(write("a.ply", ply(form, [[0, 1], [0, 1, 2], [0, 1, 2, 3], [2, 1, 0]]))))
    assert mesh.source.tolist() == [1, 2, 2, 3]
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 1, 0]]


def test_ply_with_one_colour_on_all_faces_keeps_those_of_the_vertices(write: Write) -> None:
    mesh = mesh_of(load(write("a.ply", ply("ascii", [[0, 1, 2]]))))
    assert "color" not in mesh.corners
    assert "color" in mesh.attributes


@pytest.mark.parametrize("form", FORMS)
def test_ply_without_faces_is_a_cloud(write: Write, form: str) -> None:
    geometry = load(write("a.ply", ply(form, []))).instances[0].geometry
    assert isinstance(geometry, PointCloud)
    assert geometry.colors is not None
    assert geometry.colors[1].tolist() == [10, 0, 255, 255]


HEAD = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 1\nproperty list uchar int vertex_indices\n"
ROWS = "0 0 0\n1 0 0\n0 1 0\n"


def test_ply_with_edges_and_with_strips(write: Write) -> None:
    edges = HEAD + "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n" + ROWS + "0 2\n"
    geometry = load(write("e.ply", edges)).instances[0].geometry
    assert isinstance(geometry, Segments)
    assert geometry.segments.tolist() == [[0, 2]]
    head = HEAD.replace("vertex 3", "vertex 5") + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    mesh = mesh_of(load(write("s.ply", head + ROWS + "1 1 0\n2 2 2\n9 0 1 2 3 -1 1 3 4 2\n")))
    assert mesh.triangles.tolist() == [[0, 1, 2], [2, 1, 3], [1, 3, 4], [4, 3, 2]]


def test_ply_names_of_attributes_and_a_texture(write: Write) -> None:
    write("skin.png", picture())
    names = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz", "s", "t", "red", "green", "blue", "alpha"))
    head = HEAD.replace("element", "comment TextureFile skin.png\nelement", 1) + names + FACE + "end_header\n"
    rows = "".join(f"{x} {y} 0 0 0 1 {x} {y} 1 0.5 0 1\n" for x, y in ((0, 0), (1, 0), (0, 1)))
    scene = load(write("a.ply", head + rows + "3 0 1 2\n"))
    mesh = mesh_of(scene)
    assert mesh.attributes["normal"].tolist() == [[0, 0, 1]] * 3
    assert mesh.attributes["uv"].tolist() == [[0, 0], [1, 0], [0, 1]]
    assert mesh.attributes["color"].tolist() == [[1, 0.5, 0, 1]] * 3
    assert scene.instances[0].material.texture is not None


GOOD_PLY = HEAD + FACE + "end_header\n" + ROWS + "3 0 1 2\n"
BINARY = HEAD.replace("ascii", "binary_little_endian") + FACE + "end_header\n"
BINARY_ROWS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("plx\n", ": expected ply at the start, got b'plx\\n'"),
        ("ply\nformat", ": the header has no end_header"),
        ("ply\nend_header", ": the file ends with its header"),
        ("ply\nend_header\n", ": the header has no format line"),
        (GOOD_PLY.replace("ascii 1.0", "ascii 2.0"), ": line 2: expected a line of a PLY header, got 'format ascii 2.0'"),
        (GOOD_PLY.replace("vertex 3", "vertex -3"), ": line 3: expected element, a name and a count, got 'element vertex -3'"),
        (GOOD_PLY.replace("vertex 3", "vertex x"), ": line 3: expected element, a name and a count, got 'element vertex x'"),
        (GOOD_PLY.replace("float x", "floaty x"), ": line 4: expected property, a type and a name, got 'property floaty x'"),
        (GOOD_PLY.replace("float y", "float x"), ": line 5: property 'x' is declared twice"),
        (GOOD_PLY.replace("element face", "element vertex"), ": line 7: element 'vertex' is declared twice"),
        (GOOD_PLY.replace("list uchar", "list float"), ": line 8: the count of a list cannot be of type float"),
        (GOOD_PLY.replace("float x", "float q"), ": the file has no element vertex with properties x, y and z"),
        (GOOD_PLY.replace("vertex_indices", "corners"), ": the faces have no list called vertex_indices or vertex_index"),
        (
            GOOD_PLY.replace("uchar int", "uchar float"),
            ": property vertex_indices holds numbers with a point, expected vertices",
        ),
        (GOOD_PLY.replace("3 0 1 2", "3 0 1 3"), ": face 0: vertex 3 does not exist, there are 3"),
        (GOOD_PLY.replace("3 0 1 2", "3 0 1 -1"), ": face 0: vertex -1 does not exist, there are 3"),
        (GOOD_PLY.replace("3 0 1 2", "4 0 1 2"), ": face 0: a list of '4' values is longer than the file or no number"),
        (GOOD_PLY.replace("3 0 1 2", "-1 0 1 2"), ": face 0: a list of '-1' values is longer than the file or no number"),
        (GOOD_PLY.replace("3 0 1 2", "3 0 1 2 9"), ": expected the end, there are 1 more numbers than the header says"),
        (
            GOOD_PLY.replace("3 0 1 2", "3 0 1 2.5"),
            ": face: property vertex_indices: expected a number of type i4, got '2.5', value 2",
        ),
        (
            GOOD_PLY.replace("3 0 1 2", "3 0 1 5000000000"),
            ": face: property vertex_indices has 5000000000, which does not fit its type",
        ),
        (GOOD_PLY.replace("1 0 0", "1 0 q"), ": vertex: property z: expected a number of type f4, got 'q', value 1"),
        (GOOD_PLY.replace("1 0 0", "1 0 nan"), ": positions[1] = (1.0, 0.0, nan): a vertex that is used is not finite"),
        (
            GOOD_PLY.replace("vertex 3", "vertex 2000000000"),
            ": expected 2000000000 of element vertex, the 13 numbers left are too few",
        ),
        (GOOD_PLY.replace("face 1", "face 9"), ": expected 9 of element face, the 4 numbers left are too few"),
        (
            GOOD_PLY.replace("vertex 3", "vertex 0").replace(ROWS, "").replace("face 1", "face 0")[:-8],
            ": the file has no vertices",
        ),
        (BINARY.encode() + BINARY_ROWS[:-1], ": expected 3 of element vertex, the 35 bytes left are too few"),
        (BINARY.encode() + BINARY_ROWS, ": expected 1 of element face, the 0 bytes left are too few"),
        (BINARY.encode() + BINARY_ROWS + b"\xff123", ": byte 205: element face: a list of 255 is longer than the file"),
        (
            BINARY.replace("vertex 3", "vertex 9223372036854775807").encode(),
            ": expected 9223372036854775807 of element vertex, the 0 bytes left are too few",
        ),
        (BINARY.encode() + ROWS.encode(), ": expected 3 of element vertex, the 18 bytes left are too few"),
        (
            GOOD_PLY.replace("float x", "uchar red\nproperty float g\nproperty float x"),
            ": expected 3 of element vertex, the 13 numbers left are too few",
        ),
    ],
)
def test_damaged_ply(write: Write, content: bytes | str, message: str) -> None:
    assert fault(write("a.ply", content)).startswith(message)


def test_a_ply_of_empty_rows_costs_nothing(write: Write) -> None:
    head = GOOD_PLY.replace("element face", "element nothing 4000000000\nelement face")
    assert load(write("a.ply", head)).triangle_count == 1


def test_off(write: Write) -> None:
    scene = load(
        write("a.off", "OFF # comment\n4 2 0\n0 0 0\n4 2 0\n\n0 4 0\n1 2 0\n4 0 1 2 3 255 0 0\n3 0 1 2 0.5 0.5 0.5 0.25\n")
    )
    mesh = mesh_of(scene)
    assert mesh.triangles.tolist() == [[0, 1, 3], [1, 2, 3], [0, 1, 2]]
    assert mesh.corners["color"][:, 0].tolist() == [[1, 0, 0, 1], [1, 0, 0, 1], [0.5, 0.5, 0.5, 0.25]]


def test_off_variants(write: Write) -> None:
    rows = "0 0 0 0 0 1 255 0 0\n1 0 0 0 0 1 0 255 0\n0 1 0 0 0 1 0 0 255\n"
    mesh = mesh_of(load(write("a.off", "CNOFF 3 1 0\n" + rows + "3 0 1 2\n")))
    assert mesh.attributes["normal"].tolist() == [[0, 0, 1]] * 3
    assert mesh.attributes["color"][1].tolist() == [0, 255, 0, 255]
    assert load(write("b.off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2")).triangle_count == 1
    mesh = mesh_of(load(write("c.off", "STOFF\n3 1 0\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2")))
    assert mesh.attributes["uv"].tolist() == [[0, 0], [1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("# nothing\n", ": expected OFF, the file has no words"),
        ("FFO\n", ": line 1: expected OFF, got 'FFO'"),
        ("OFF BINARY\n", ": line 1: OFF BINARY is a kind of OFF that cannot be read"),
        ("4OFF\n", ": line 1: 4OFF is a kind of OFF that cannot be read"),
        ("OFF\n", ": expected the numbers of vertices and faces, the file ends"),
        ("OFF\nx 1 0\n", ": line 2: expected the numbers of vertices and faces, got 'x 1 0'"),
        ("OFF\n-3 1 0\n", ": line 2: expected the numbers of vertices and faces, got '-3 1 0'"),
        (
            OFF.replace("3 1 0", "3 2000000000 0"),
            ": expected 3 vertices and 2000000000 faces, there are 4 lines: the file is cut short",
        ),
        (OFF.replace("1 0 0", "1 0", 1).replace("3 1 0", "3 1"), ": line 4: expected 3 numbers for a vertex, got 2"),
        (OFF.replace("0 1 0\n3 0", "0 z 0\n3 0"), ": line 5: expected a number, got 'z'"),
        (OFF.replace("3 0 1 2", "3 0 1 3"), ": line 6: face 0: vertex 3 does not exist, there are 3"),
        (OFF.replace("3 0 1 2", "3 0 1"), ": line 6: expected 3 vertices for a face, got 2"),
        (OFF.replace("3 0 1 2", "-3 0 1 2"), ": line 6: expected -3 vertices for a face, got 3"),
        (OFF.replace("3 0 1 2", "3 0 1 2.5"), ": line 6: expected whole numbers, got '3 0 1 2.5'"),
        (OFF.replace("3 0 1 2", "3 0 1 2 300 0 0"), ": line 6: a colour is not 0..255 or 0..1"),
        (OFF.replace("3 0 1 2", "3 0 1 2 red 0 0"), ": line 6: expected a number, got 'red'"),
        ("COFF\n1 1 0\n0 0 0 256 0 0\n3 0 0 0", ": a colour is not 0..255 or 0..1"),
        ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", ": the file has no faces"),
    ],
)
def test_damaged_off(write: Write, content: str, message: str) -> None:
    assert fault(write("a.off", content)) == message
