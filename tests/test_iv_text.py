"""Text files of Open Inventor: words, values, nodes, and what is said of files that are wrong."""

from __future__ import annotations

import gzip
import time
from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.inventor.graph import MAX_DEPTH, MAX_NOTES, Node
from scanspan.assets.inventor.nodes import NODES, node_type
from scanspan.assets.load import load
from scanspan.errors import LimitError
from tests.inventor import HEADER, notes_of, parse, scene_of
from tests.models import Write, fault, writer


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into a folder of the test's own and return its path."""
    return writer(tmp_path)


def node_of(text: str) -> Node:
    """The one node of a text without faults."""
    source, nodes = parse(text)
    assert source.file.notes == []
    (node,) = nodes
    return node


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("Cube { width 3 }", "width", 3.0),
        ("Cube { width +.5e1 }", "width", 5.0),
        ("Cube{width 0x10}", "width", 16.0),
        ("Cube { width # 7\n 2 }", "width", 2.0),
        ("Switch { whichChild -3 }", "whichChild", -3),
        ("Array { numElements1 7 }", "numElements1", 7),
        ("DirectionalLight { on FALSE }", "on", False),
        ("DirectionalLight { on 1 }", "on", True),
        ("DrawStyle { style LINES }", "style", "LINES"),
        ('Info { string "a # \\"b\\" \\\\ c" }', "string", 'a # "b" \\ c'),
        ('Info { string "two\nlines" }', "string", "two\nlines"),
        ("Label { label plain }", "label", "plain"),
        ('Text3 { string [ "a", "b" "c" ] }', "string", ["a", "b", "c"]),
        ('Text3 { string "a" }', "string", ["a"]),
        ("Cone { parts SIDES }", "parts", ("SIDES",)),
        ("Cone { parts (SIDES | BOTTOM) }", "parts", ("SIDES", "BOTTOM")),
        ("Cone { parts () }", "parts", ()),
        ("IndexedFaceSet { coordIndex [ 0, 1, 2, -1, ] }", "coordIndex", [0, 1, 2, -1]),
        ("IndexedFaceSet { coordIndex 5 }", "coordIndex", [5]),
        ("IndexedFaceSet { coordIndex [ ] }", "coordIndex", []),
        ("PackedColor { orderedRGBA [ 0xff8000ff 12 ] }", "orderedRGBA", [0xFF8000FF, 12]),
        ("Coordinate3 { point [ 0 1 2, # three ]\n 3 4 5 ] }", "point", [[0, 1, 2], [3, 4, 5]]),
        ("Coordinate3 { point 0 1 2 }", "point", [[0, 1, 2]]),
        ("Coordinate3 { point [ 0x1 1e2 -.5 ] }", "point", [[1, 100, -0.5]]),
        ("Scale { scaleFactor 1 2 3 }", "scaleFactor", [1, 2, 3]),
        ("Rotation { rotation 0 0 2 3.141592653589793 }", "rotation", [0, 0, 1, 0]),
        ("Rotation { rotation 0 0 0 3 }", "rotation", [0, 0, 0, 1]),
        ("MatrixTransform { matrix 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 }", "matrix", np.arange(1, 17).reshape(4, 4)),
        ("Texture2 { image 2 1 3 0xff0001 0x020304 }", "image", [[[255, 0, 1], [2, 3, 4]]]),
        ("Texture2 { image 1 2 1 7 9 }", "image", [[[7]], [[9]]]),
        ("Texture2 { image 0 0 0 }", "image", np.zeros((0, 0, 1))),
    ],
)
def test_values(text: str, name: str, value: object) -> None:
    found = node_of(text).get(name)
    if isinstance(found, np.ndarray):
        np.testing.assert_allclose(found, np.asarray(value, dtype=np.float64).reshape(found.shape), atol=1e-15)
        assert found.shape == np.shape(value) or not found.size
    else:
        assert found == value
        assert type(found) is type(value)


def test_children_names_and_ignored_fields() -> None:
    root = node_of(
        "DEF top Separator { DEF a+1 Material { diffuseColor 1 0 0 ~ transparency ~ } Group { USE a+1 } SoCube { } }"
    )
    assert root.name == "top"
    material, group, cube = root.children
    assert material.name == "a"
    assert material.ignored == {"diffuseColor", "transparency"}
    assert group.children == [material]
    assert cube.kind == "Cube"
    assert [node.kind for node in root.walk()] == ["Separator", "Material", "Group", "Cube"]


def test_nodes_in_fields() -> None:
    node = node_of("IndexedFaceSet { vertexProperty DEF v VertexProperty { vertex [ 0 0 0 ] } coordIndex [ 0 ] }")
    assert node.get("vertexProperty").kind == "VertexProperty"
    assert [inner.kind for inner in node.walk()] == ["IndexedFaceSet", "VertexProperty"]
    assert node_of("FaceSet { vertexProperty NULL numVertices 3 }").get("vertexProperty") is None


def test_old_names_and_old_headers() -> None:
    assert parse("#Inventor V1.0 ascii\nIndexedTriangleMesh { }")[1][0].kind == "IndexedTriangleStripSet"
    assert parse("#VRML V1.0 ascii\nCube { }")[1][0].kind == "Cube"
    assert parse("#Inventor V2.0 ascii  \r\nCube { }")[0].version == 2.0


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        ("Cube { width x }", ["line 2: expected a number, got 'x }'"]),
        ("Cube { width }", ["line 2: expected a number, got '}'"]),
        ("Cube { widht 3 height 4 }", ["line 2: expected a field of Cube, got 'widht'"]),
        ("Cube {\n width 1\n", ["line 4: expected '}' at the end of Cube, got the end of the file"]),
        ("Cube", ["line 2: expected '{' after Cube, got the end of the file"]),
        ("Cube }", ["line 2: expected '{' after Cube, got '}'"]),
        ("]", ["line 2: expected a node, got ']'"]),
        ("DEF {", ["line 2: expected the name of a node, got '{'"]),
        ("DEF a {", ["line 2: expected a node, got '{'"]),
        ("USE b", ["line 2: USE b: no node of this name was defined before"]),
        ("DrawStyle { style LINE }", ["line 2: expected one of FILLED, LINES, POINTS, INVISIBLE, got 'LINE'"]),
        ("DirectionalLight { on MAYBE }", ["line 2: expected TRUE or FALSE, got 'MAYBE }'"]),
        ("Cone { parts (SIDES BOTTOM) }", ["line 2: expected '|' or ')', got 'BOTTOM) }'"]),
        ("Cone { parts [ }", ["line 2: expected a word, got '[ }'"]),
        ('Info { string "abc }', ['line 2: expected a string that ends with ", got the end of the file']),
        ("Coordinate3 { point [ 0 1 }", ["line 2: expected ']' after a list of numbers, got '}'"]),
        ("Coordinate3 { point [ 0 1 2 3 ] }", ["line 2: expected numbers in rows of 3, got 4 of them"]),
        ("Coordinate3 { point [ 0 1\n x ] }", ["line 3: expected a number or ']', got 'x'"]),
        ('Text3 { string [ "a" }', ["line 2: expected ']' after a list, got '}'"]),
        ("Texture2 { image 2 2 9 1 1 1 1 }", ["line 2: expected a picture of 1 to 4 channels that fits the file, got 2 2 9"]),
        ("Texture2 { image 90 90 3 1 }", ["line 2: expected a picture of 1 to 4 channels that fits the file, got 90 90 3"]),
        ("Texture2 { image -1 2 3 }", ["line 2: expected the sides of a picture and its channels, got -1 2 3"]),
        ("Texture2 { image 1 1 1 -5 }", ["line 2: expected pixels from 0 to 0xffffffff"]),
        ("Cube { Sphere { } }", ["line 2: Cube cannot have children; Sphere is left out"]),
        ("Magic { }", ["line 2: node 'Magic' is not known and left out"]),
        ("Magic { } Magic { }", ["line 2: node 'Magic' is not known and left out"]),
        ("Magic { fields [ SFOdd a ] }", ["expected the type of a field, got 'SFOdd'"]),
        (
            "Switch { whichChild 0 = NULL }",
            ["expected a node or an engine that whichChild of Switch is connected to, got 'NULL }'"],
        ),
        (
            "Cube { width = Clock { } . now }",
            ["engine 'Clock'", "engines and connections do not run; width of Cube keeps its value"],
        ),
        ("Cube { width 2 = Clock { } }", ["engine 'Clock'", "expected the name of an output, got '}'"]),
    ],
)
def test_faults_are_noted_with_their_line(text: str, notes: list[str]) -> None:
    found = notes_of(text)
    for note in notes:
        assert any(note in line for line in found), found
        assert all(line.startswith("line ") for line in found)


@pytest.mark.parametrize(
    "fault",
    ["Cube { width x }", "Magic { a 1 b [ 2 { 3 } ] Cube { } }", 'Info { string 5 } ]', "DrawStyle { style LINE lineWidth 2 }",
     "Cube { blah \"}\" [ 1 ] 2 }", "USE nothing", "Coordinate3 { point [ 1 2 x ] }", "Switch { whichChild 0 = NULL }"],
)  # fmt: skip
def test_a_fault_does_not_lose_the_rest(fault: str) -> None:
    source, nodes = parse(f"Separator {{ Cone {{ }} {fault} Sphere {{ radius 3 }} }} Cylinder {{ }}")
    assert source.file.notes
    kinds = [node.kind for root in nodes for node in root.walk()]
    assert {"Cone", "Sphere", "Cylinder"} <= set(kinds)
    sphere = next(node for root in nodes for node in root.walk() if node.kind == "Sphere")
    assert sphere.get("radius") == 3.0


def test_a_fault_keeps_the_other_fields() -> None:
    source, (cube,) = parse("Cube { width x height 4 odd 1 2 [ 3 ] depth 5 }")
    assert [cube.get(name) for name in ("width", "height", "depth")] == [2.0, 4.0, 5.0]
    assert len(source.file.notes) == 2


def test_a_type_that_describes_itself() -> None:
    source, (node, sphere) = parse("Odd { fields [ SFFloat a, MFVec3f b ] a 1 b [ 1 2 3 ] DEF s Sphere { } } USE s")
    assert source.file.notes == ["line 2: node 'Odd' is not known and left out"]
    assert node.fields["a"] == 1.0
    assert node.fields["b"].tolist() == [[1, 2, 3]]
    assert sphere.kind == "Sphere"
    (like,) = parse('Odd { isA [ MFString "Foo" "Cube" ] width 3 }'.replace("MFString ", ""))[1]
    assert (like.kind, like.get("width")) == ("Cube", 3.0)


def test_a_connection_to_a_node_that_is_used() -> None:
    source, nodes = parse("DEF a Cube { } Sphere { radius = USE a.width }")
    assert source.file.notes == ["line 2: engines and connections do not run; radius of Sphere keeps its value"]
    assert [node.kind for node in nodes] == ["Cube", "Sphere"]


def test_deep_nesting_and_many_faults_end() -> None:
    deep = "Group { " * 100_000 + "}" * 100_000
    source, nodes = parse(deep)
    assert any(f"nodes are nested deeper than {MAX_DEPTH}; the inner ones are left out" in note for note in source.file.notes)
    assert len(list(nodes[0].walk())) == MAX_DEPTH + 1
    notes = notes_of("USE a\n" * 10_000)
    assert len(notes) == MAX_NOTES + 1
    assert notes[-1] == "more faults were found than are listed"
    for text in ("[" * 50_000, "Cube { a " + "[" * 50_000, '"' * 50_001, "Foo { " * 50_000, "Cube { width ( ( ("):
        assert notes_of(text)


def test_headers(write: Write) -> None:
    expected = ": expected a first line such as '#Inventor V2.1 ascii', got "
    assert fault(write("a.iv", "Separator { }")) == expected + "'Separator { }'"
    assert fault(write("b.iv", b"\0\1\2")) == expected + "'\\x00\\x01\\x02'"
    assert "VRML 2.0 is another language" in fault(write("c.iv", "#VRML V2.0 utf8\nShape { }"))
    assert fault(write("d.iv", "#Inventor V9.0 ascii\n")) == ": expected Inventor 1.0 to 2.1, got version 9.0"


def test_packed_files(tmp_path: Path, write: Write) -> None:
    text = (HEADER + "Cube { width 4 }").encode()
    for name in ("a.iv", "a.iv.gz"):
        assert load(write(name, gzip.compress(text))).bounds[1].tolist() == [2, 1, 1]
    assert load(write("a.iv.asc", text)).triangle_count == 12
    assert ": the file is packed with gzip and damaged: " in fault(write("b.iv", gzip.compress(text)[:-12]))
    with pytest.raises(LimitError, match=r"unpacks to more than the limit of 1000 bytes \(max_bytes\)"):
        load(write("c.iv", gzip.compress(text + b" " * 100_000)), max_bytes=1000)


def test_a_scene_that_draws_nothing_names_the_first_fault(tmp_path: Path, write: Write) -> None:
    assert fault(write("a.iv", HEADER + "Separator { }")) == ": the file has nothing to draw"
    message = fault(write("b.iv", HEADER + "\nFoo { }"))
    assert message == ": the file has nothing to draw; line 3: node 'Foo' is not known and left out"
    assert scene_of(tmp_path, "Cube { } Foo { }").notes == ("line 2: node 'Foo' is not known and left out",)


def test_the_table_is_whole() -> None:
    assert len(NODES) > 90
    for kind in NODES.values():
        for name, field in kind.fields.items():
            assert name.isidentifier()
            assert field.kind != "Enum" or field.words, (kind.name, name)
    assert node_type("Separator") is node_type("SoSeparator")
    assert node_type("Nothing") is None


@pytest.mark.parametrize(
    "text",
    [
        "Coordinate3 { " + "point [ 1 " * 60_000 + "] }",
        "Coordinate3 { " + "point [ x ] " * 60_000 + "}",
        "Cube { " + "width x " * 60_000 + "}",
        "Cube { " + "a " * 200_000 + "}",
        "Foo { " * 60_000,
        "[ " * 200_000,
        "{ " * 200_000,
        "DEF " * 200_000,
        "Text3 { string [ " * 60_000,
        '"' + "\\\\" * 200_000,
        "Cone { parts ( " * 60_000,
        "Separator { " + "# x\n" * 200_000 + "}",
        "Foo { fields [ " * 30_000,
        "Switch { whichChild 0 = " * 30_000,
        "IndexedFaceSet { vertexProperty " * 30_000,
    ],
)
def test_long_files_are_read_in_time_that_grows_with_their_length(text: str) -> None:
    start = time.process_time()
    notes_of(text)
    assert time.process_time() - start < 4.0
