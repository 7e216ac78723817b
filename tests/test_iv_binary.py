"""Binary files of Open Inventor: the same graph as the text, and what is said of files that are damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.inventor.graph import MAX_DEPTH, Node
from scanspan.assets.load import READERS, _to_scene, load
from scanspan.errors import InputError
from tests.inventor import HEADER, LIMITS, model_file, notes_of, parse, to_binary, whole, word

SCENE = """
DEF top Separator {
  Info { string "for the test" }
  DEF red Material { diffuseColor [ 1 0 0, 0 1 0 ] transparency .25 ~ }
  ShapeHints { vertexOrdering COUNTERCLOCKWISE creaseAngle .5 }
  Texture2 { image 2 3 3 0x010203 0x040506 0x070809 0x0a0b0c 0x0d0e0f 0x101112 wrapS CLAMP }
  Group { Rotation { rotation 0 1 0 1.5 } Cone { parts (SIDES | BOTTOM) height 4 } }
  DirectionalLight { on FALSE intensity .5 }
  MatrixTransform { matrix 1 0 0 0 0 2 0 0 0 0 3 0 4 5 6 1 }
  Array { numElements1 3 Text3 { string [ "a", "bcd" ] parts ALL } }
  IndexedFaceSet {
    vertexProperty VertexProperty { vertex [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] orderedRGBA [ 0xff0000ff, 0xff00 ] }
    coordIndex [ 0, 1, 2, 3, -1 ]
    materialIndex [ 0 ]
  }
  Switch { whichChild -3 Cube { } USE red Sphere { radius 2 } }
}
"""


def describe(node: Node) -> list[object]:
    """All that a node and those below it say, as plain lists."""
    fields = []
    for name in sorted(node.fields):
        value = node.fields[name]
        if isinstance(value, Node):
            value = describe(value)
        elif isinstance(value, np.ndarray):
            value = value.astype(np.float32).tolist()
        elif isinstance(value, float):
            value = float(np.float32(value))
        fields.append((name, value, name in node.ignored))
    return [node.kind, node.name, fields, [describe(child) for child in node.children]]


@pytest.mark.parametrize("version", ["2.0", "2.1"])
def test_a_binary_file_is_the_graph_of_its_text(version: str) -> None:
    _, nodes = parse(SCENE)
    content = to_binary(nodes, version)
    source, again = parse(content)
    assert source.file.notes == []
    assert source.is_binary
    assert [describe(node) for node in again] == [describe(node) for node in nodes]
    assert again[0].children[1] is again[0].children[-1].children[1]


@pytest.mark.parametrize("version", ["2.0", "2.1"])
def test_a_binary_scene_is_that_of_its_text(tmp_path: Path, version: str) -> None:
    (tmp_path / "a.iv").write_text(HEADER + SCENE)
    (tmp_path / "b.iv").write_bytes(to_binary(parse(SCENE)[1], version))
    text, binary = load(tmp_path / "a.iv"), load(tmp_path / "b.iv")
    assert repr(text) == repr(binary)
    np.testing.assert_allclose(text.bounds, binary.bounds, rtol=1e-6)


HEAD = b"#Inventor V2.1 binary  \n"
CUBE = word("Cube") + whole(0)


@pytest.mark.parametrize(
    ("body", "note"),
    [
        (whole(5), "byte 24: expected a node or the end of the file, got 4 bytes"),
        (whole(5_000_000) * 2, "expected the length of the name of a node that fits the file, got 5000000"),
        (whole(-1) + b"abcd", "byte 24: expected the length of the name of a node that fits the file, got -1"),
        (word("\1\2\3") * 2, "byte 24: expected the name of a node, got '\\x01\\x02\\x03'"),
        (word("a" * 5000), "byte 24: expected the name of a node, got a string of 5000 bytes"),
        (CUBE, "byte 36: expected a number of fields, 4 bytes, 0 are left"),
        (CUBE + whole(-7), "byte 36: expected a number of fields, got -7"),
        (CUBE + whole(70_000), "byte 36: expected a number of fields, got 70000"),
        (CUBE + whole(1) + word("size"), "byte 40: expected a field of Cube, got 'size'"),
        (CUBE + whole(1) + word("width"), "byte 52: expected 1 numbers, 4 bytes, 0 are left"),
        (CUBE + whole(1) + word("width") + whole(0), "byte 56: expected the flags of a field, 4 bytes, 0 are left"),
        (
            word("Coordinate3") + whole(0) + whole(1) + word("point") + whole(2**30),
            "expected a number of values that fits the file",
        ),
        (
            word("Group") + whole(2) + whole(0) + whole(2**30),
            "expected a number of children that fits the file, got 1073741824",
        ),
        (
            word("DrawStyle") + whole(0) + whole(1) + word("style") + word("ODD") + whole(0),
            "expected one of FILLED, LINES, POINTS",
        ),
        (word("USE") + word("a"), "byte 24: USE a: no node of this name was defined before"),
        (word("Magic") + whole(0) + whole(0) + CUBE, "byte 24: node 'Magic' is not known and left out"),
        (word("Magic") + whole(0) + whole(1) + word("odd"), "expected a field of Magic, got 'odd'"),
        (word("Magic") + whole(0) + whole(0x4001) + word("SFOdd") + word("a"), "expected the type of a field, got 'SFOdd'"),
        (
            word("Texture2") + whole(0) + whole(1) + word("image") + whole(30_000) + whole(30_000) + whole(3),
            "expected a picture of 1 to 4 channels that fits the file, got 30000 30000 3",
        ),
    ],
)
def test_faults_are_noted_with_their_byte(body: bytes, note: str) -> None:
    found = notes_of(HEAD + body)
    assert note in found[-1] or note == found[0]
    assert all(line.startswith("byte ") for line in found)


def test_what_came_before_a_fault_is_kept() -> None:
    whole_file = to_binary(parse("Separator { Cube { width 3 } Sphere { radius 2 } }")[1])
    source, (root,) = parse(whole_file[:-12])
    assert "the rest of the file is left out" in source.file.notes[0]
    assert [child.kind for child in root.children] == ["Cube", "Sphere"]
    assert root.children[0].get("width") == 3.0


def test_a_type_that_describes_itself_is_read_over() -> None:
    odd = word("Odd") + whole(2) + whole(0x4002) + word("SFFloat") + word("a") + word("MFString") + word("b")
    odd += word("a") + b"\x40\0\0\0" + whole(0) + word("b") + whole(1) + word("c") + whole(0) + whole(1) + CUBE + whole(0)
    source, (node, cube) = parse(HEAD + odd + CUBE + whole(0))
    assert source.file.notes == ["byte 24: node 'Odd' is not known and left out"]
    assert node.fields == {"a": 2.0, "b": ["c"]}
    assert [child.kind for child in node.children] == ["Cube"]
    assert cube.kind == "Cube"


def test_connections_do_not_run() -> None:
    field = word("width") + b"\x40\0\0\0" + whole(2) + CUBE + whole(0) + word("out")
    source, (cube,) = parse(HEAD + CUBE + whole(1) + field)
    assert cube.get("width") == 2.0
    assert source.file.notes == ["byte 60: engines and connections do not run; width of Cube keeps its value"]


def test_deep_nesting_ends() -> None:
    group = word("Group") + whole(2) + whole(0) + whole(1)
    (note,) = notes_of(HEAD + group * 5000 + CUBE)
    assert f"expected nodes nested no deeper than {MAX_DEPTH}" in note


@pytest.fixture(scope="module")
def samples() -> list[bytes]:
    """Whole files, text and binary."""
    nodes = parse(SCENE)[1]
    return [(HEADER + SCENE).encode(), to_binary(nodes), to_binary(nodes, "2.0")]


def read_or_refuse(content: bytes) -> None:
    """Read a file to its end: it becomes a scene or an error of ours that says something, and nothing else is raised."""
    file: ModelFile = model_file(content)
    message = ""
    try:
        assert _to_scene("iv", file).primitive_count > 0
    except InputError as error:
        message = str(error)
    assert "damaged (" not in message
    assert "\n" not in message
    assert len(file.notes) <= 60


assert LIMITS.triangles == 10**7
assert "iv" in READERS


@given(
    which=st.integers(0, 2), edits=st.lists(st.tuples(st.integers(0), st.binary(max_size=8), st.integers(0, 12)), max_size=6)
)
def test_damaged_files_are_read_or_refused(samples: list[bytes], which: int, edits: list[tuple[int, bytes, int]]) -> None:
    content = samples[which]
    for place, put, cut in edits:
        start = 24 + place % len(content)
        content = content[:start] + put + content[start + cut :]
    read_or_refuse(content)


@given(which=st.integers(0, 2), share=st.floats(0, 1))
def test_files_that_break_off_are_read_or_refused(samples: list[bytes], which: int, share: float) -> None:
    read_or_refuse(samples[which][: int(share * len(samples[which]))])


WORDS = [
    "{",
    "}",
    "[",
    "]",
    '"',
    "~",
    "=",
    "#",
    "DEF",
    "USE",
    "NULL",
    "a",
    "1",
    "-1",
    "0x7f",
    "1e999",
    "nan",
    "(",
    "|",
    ")",
    "\n",
]


@given(st.lists(st.sampled_from([*WORDS, "Separator", "Cube", "Coordinate3", "point", "IndexedFaceSet", "coordIndex", "Array",
                                 "numElements1", "Switch", "whichChild", "Text3", "string", "Texture2", "image"])))  # fmt: skip
def test_any_words_are_read_or_refused(words: list[str]) -> None:
    read_or_refuse((HEADER + "Cube { } " + " ".join(words)).encode())


NAMES = ["Group", "Cube", "Separator", "DEF", "USE", "a", "Coordinate3", "point", "width", "Texture2", "image", "Cone", "parts"]


@given(st.lists(st.one_of(st.integers(-(2**31), 2**31 - 1).map(whole), st.sampled_from(NAMES).map(word))))
def test_any_binary_words_are_read_or_refused(words: list[bytes]) -> None:
    read_or_refuse(HEAD + CUBE + whole(0) + b"".join(words))
