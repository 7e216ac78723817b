"""Real Open Inventor files: each draws as many shapes and triangles as a count of its nodes gives, or says what is wrong."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.report import listing_of, report_of
from scanspan.assets.load import load
from scanspan.errors import FormatError
from tests import fuzz_iv
from tests.inventor import HEADER, model_file, parse

FACES = ("IndexedFaceSet", "IndexedTriangleStripSet")
SOLIDS = ("Cube", "Sphere", "Cone", "Cylinder")
OTHERS = ("IndexedLineSet", "LineSet", "PointSet", "QuadMesh", "FaceSet", "TriangleStripSet", "NurbsSurface")
GROUPS = ("Separator", "Group", "TransformSeparator")

# Files whose shapes the plain count below does not know: they count other files, copies, or what is not to be drawn.
PLAIN = 50

BROKEN = {
    "models_io_correct_bug029-2.iv": "the file has nothing to draw; line 6: node 'MyNode' is not known and left out",
    "models_io_correct_bug077.iv": "the file has nothing to draw; line 8: engine 'ElapsedTime' is not known and left out",
    "models_io_incorrect_bug029-3.iv": "line 10: expected one of FILLED, LINES, POINTS, INVISIBLE, got 'VALUE_A'",
    "models_io_incorrect_bug039.iv": "VRML 2.0 is another language",
    "models_io_incorrect_bug055-6.iv": "line 11: expected a node or an engine that whichChild of Switch is connected to, got",
    "models_io_incorrect_bug199-error-1.iv": 'line 4: expected a string that ends with ", got the end of the file',
}


SAID = ("file '", "Text2", "called SOLID", "letters are of the one font", "the profile of Text3", "fog is not drawn")
"""What may be said of a scene of SGI."""


def runs(indices: list[int]) -> list[int]:
    """The lengths of runs parted by negative numbers."""
    lengths = [0]
    for index in indices:
        if index < 0:
            lengths.append(0)
        else:
            lengths[-1] += 1
    return lengths


def count(node: Node) -> tuple[int, int] | None:
    """Shapes and triangles of vertices below a node, None where more than a count is needed to tell."""
    if node.kind in FACES:
        return 1, sum(max(length - 2, 0) for length in runs(node.get("coordIndex").tolist()))
    if node.kind in (*SOLIDS, *OTHERS):
        return 1, 0
    if node.kind in GROUPS:
        below = [count(child) for child in node.children]
        if any(one is None for one in below):
            return None
        return sum(one[0] for one in below if one), sum(one[1] for one in below if one)
    if node.kind == "Switch" and node.get("whichChild") == -1:
        return 0, 0
    unknown = node.children or node.kind in ("File", "Text2", "Text3") or node.fields.get("style") == "INVISIBLE"
    return None if unknown else (0, 0)


def inventor_files(folder: Path, part: str) -> list[Path]:
    """The Inventor files below a folder."""
    return sorted(path for path in (folder / "inventor" / part).rglob("*.iv*") if path.is_file())


def test_every_scene_of_sgi_draws_what_its_nodes_say(shared_data: Path) -> None:
    files = inventor_files(shared_data, "sgi")
    assert len(files) == 65
    plain = 0
    for path in files:
        scene = load(path)
        assert scene.primitive_count > 0
        assert np.isfinite(scene.bounds).all()
        assert all(any(word in note for word in SAID) for note in scene.notes), (path.name, scene.notes)
        found = [count(node) for node in parse(path.read_bytes())[1]]
        if any(one is None for one in found):
            continue
        plain += 1
        assert len(scene.instances) == sum(one[0] for one in found if one), path.name
        kinds = {node.kind for root in parse(path.read_bytes())[1] for node in root.walk()}
        solid = kinds & {*SOLIDS, *OTHERS, "DrawStyle"}
        if not solid:
            assert scene.triangle_count == sum(one[1] for one in found if one), path.name
    assert plain > PLAIN


def test_every_file_of_coin_draws_or_says_why_not(shared_data: Path) -> None:
    for path in inventor_files(shared_data, "coin"):
        if path.name in BROKEN:
            with pytest.raises(FormatError) as caught:
                load(path)
            assert BROKEN[path.name] in str(caught.value)
        else:
            assert load(path).primitive_count > 0


def test_the_largest_scenes_are_read_in_under_two_seconds(shared_data: Path) -> None:
    for name in ("scenes/chesschairs.iv.asc", "geography/earth.iv"):
        start = time.process_time()
        load(shared_data / "inventor" / "sgi" / name)
        assert time.process_time() - start < 2.0


def test_a_reference_that_leaves_the_folder_is_refused(shared_data: Path) -> None:
    notes = load(shared_data / "inventor" / "sgi" / "scenes" / "chesschairs.iv.asc").notes
    assert notes == ("file '../chess/chessboard.iv' was not opened: only files in the model's folder are opened",)


def test_damaged_files_are_read_or_refused(shared_data: Path) -> None:
    results, faults = fuzz_iv.run(shared_data / "inventor" / "coin", seconds=2.0, seed=3)
    assert faults == []
    assert results["read"] + results["FormatError"] > 0


PITFALLS = """
Cube { }
Separator { DirectionalLight { } }
SpotLight { on FALSE }
ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }
Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }
NormalBinding { value OVERALL }
Normal { vector 0 0 -2 }
IndexedFaceSet { coordIndex [ 0, 1, 2, -1, 0, 3, 2, -1 ] }
"""


def test_the_report_names_what_the_lecture_warns_of(tmp_path: Path) -> None:
    path = tmp_path / "a.iv"
    path.write_text(HEADER + PITFALLS)
    report = report_of(str(path))
    assert report == [
        "shapes: 2 (2 of Mesh), 14 triangles",
        "largest shape: 12 triangles, 86 % of all",
        "cameras: 0, lights: 2",
        "light 0, DirectionalLight at line 4, reaches 0 of 2 shapes: it shines on nothing, for no shape follows it within its "
        "separator",
        "light 1, SpotLight at line 5, switched off, reaches 1 of 2 shapes",
        "lights: 1 of 2 shapes stand before every light or outside of their separators",
        "lights: they cast no shadows",
        "ordering: IndexedFaceSet at line 10: neighbours turn both ways along 1 of 5 edges",
        "ordering: IndexedFaceSet at line 10: is called SOLID and has 4 open edges; its back faces would be missed",
        "normals: IndexedFaceSet at line 10: 1 of 2 triangles turn against their normals",
        "normals: IndexedFaceSet at line 10: 6 of 6 are not of length 1",
    ]
    path.write_text(HEADER + "PointLight { } Cube { } Foo { }")
    assert report_of(str(path))[3] == "light 0, PointLight at line 2, reaches 1 of 1 shapes"
    assert report_of(str(path))[-1] == "note: line 2: node 'Foo' is not known and left out"
    (tmp_path / "b.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    assert report_of(str(tmp_path / "b.off")) == listing_of(str(tmp_path / "b.off")) == []


def test_the_report_warns_of_many_lights_and_triangles(tmp_path: Path) -> None:
    path = tmp_path / "a.iv"
    path.write_text(HEADER + "PointLight { } " * 9 + "Complexity { value 1 } Array { numElements1 30 Sphere { } }")
    report = report_of(str(path))
    assert "budget: 151,200 triangles are more than 100,000; a lower Complexity or fewer copies would do" in report
    assert "lights: 9 are more than the 8 that Inventor shows at once" in report


def test_the_listing_is_indented_and_short(tmp_path: Path) -> None:
    path = tmp_path / "a.iv"
    points = ", ".join("0 0 0" for _ in range(9))
    path.write_text(
        HEADER + f'DEF a Separator {{ Coordinate3 {{ point [ {points} ] }} Cube {{ width .1 }} Text2 {{ string "x" }} }}'
    )
    assert listing_of(str(path)) == [
        "DEF a Separator",
        "  Coordinate3  point [9 values]",
        "  Cube  width 0.1",
        "  Text2  string x",
    ]
    assert model_file("x").path == "a.iv"
