"""The traversal of Open Inventor scenes: what is in force where, and who changes it for whom."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.inventor.graph import MAX_DEPTH
from scanspan.assets.scene import Scene
from scanspan.errors import InputError, LimitError
from scanspan.homogeneous import transform_points
from tests.inventor import base_of, only, places, scene_of
from tests.models import picture

BY_ONE = "Translation { translation 1 0 0 }"
RED = "BaseColor { rgb 1 0 0 }"


def test_a_separator_keeps_changes_in_and_a_group_lets_them_out(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"Separator {{ {BY_ONE} {RED} Cube {{ }} }} Cube {{ }}")
    assert places(scene) == [[1, 0, 0], [0, 0, 0]]
    assert [base_of(one) for one in scene.instances] == [[1, 0, 0], [0.8, 0.8, 0.8]]
    scene = scene_of(tmp_path, f"Group {{ {BY_ONE} {RED} Cube {{ }} }} Cube {{ }}")
    assert places(scene) == [[1, 0, 0], [1, 0, 0]]
    assert [base_of(one) for one in scene.instances] == [[1, 0, 0], [1, 0, 0]]


def test_a_transform_separator_keeps_only_the_transformation_in(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"TransformSeparator {{ {BY_ONE} {RED} }} Cube {{ }}")
    assert places(scene) == [[0, 0, 0]]
    assert base_of(only(scene)) == [1, 0, 0]


@pytest.mark.parametrize(
    ("chosen", "kinds"),
    [("", []), ("whichChild -1", []), ("whichChild 0", [2.0]), ("whichChild 1", [4.0]), ("whichChild -3", [2.0, 4.0])],
)
def test_switch(tmp_path: Path, chosen: str, kinds: list[float]) -> None:
    switch = f"Switch {{ {chosen} Cube {{ width 2 }} Cube {{ width 4 }} }}"
    scene = scene_of(tmp_path, f"{switch} Cube {{ width 9 }}")
    assert [float(np.ptp(one.bounds[:, 0])) for one in scene.instances] == [*kinds, 9.0]


def test_a_switch_inherits_and_a_wrong_one_is_noted(tmp_path: Path) -> None:
    inner = "Switch { whichChild -2 Cube { width 2 } Cube { width 4 } }"
    scene = scene_of(tmp_path, f"Switch {{ whichChild 1 Sphere {{ }} {inner} }}")
    assert float(np.ptp(scene.bounds[:, 0])) == 4.0
    scene = scene_of(tmp_path, "Cube { }\nSwitch { whichChild 7 Cube { } }")
    assert scene.notes == ("line 3: Switch chooses child 7, there are 1",)
    assert len(scene_of(tmp_path, "Blinker { Cube { } Sphere { } }").instances) == 1
    assert scene_of(tmp_path, "LOD { range 5 Cube { } Sphere { } }").triangle_count == 12
    assert scene_of(tmp_path, "LevelOfDetail { screenArea 5 Cube { } Sphere { } }").triangle_count == 12
    assert len(scene_of(tmp_path, "Cube { } PathSwitch { Cube { } }").instances) == 1


def test_array_and_multiple_copy(tmp_path: Path) -> None:
    fields = "numElements1 2 numElements2 2 separation1 3 0 0 separation2 0 5 0"
    scene = scene_of(tmp_path, f"Array {{ {fields} {BY_ONE} Cube {{ }} }} Cube {{ }}")
    assert places(scene) == [[1, 0, 0], [4, 0, 0], [1, 5, 0], [4, 5, 0], [0, 0, 0]]
    centred = scene_of(tmp_path, f"Array {{ {fields} origin CENTER Cube {{ }} }}")
    assert places(centred)[0] == [-1.5, -2.5, 0]
    last = scene_of(tmp_path, f"Array {{ {fields} origin LAST Cube {{ }} }}")
    assert places(last)[-1] == [0, 0, 0]
    moved = "1 0 0 0 0 1 0 0 0 0 1 0 2 3 4 1"
    scene = scene_of(
        tmp_path, f"MultipleCopy {{ matrix [ {moved}, {moved} ] Switch {{ whichChild -2 Cube {{ }} Sphere {{ }} }} }}"
    )
    assert places(scene) == [[2, 3, 4], [2, 3, 4]]
    assert scene.instances[0].geometry is not scene.instances[1].geometry


def test_what_is_used_often_is_made_once(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"Array {{ numElements1 9 DEF a Cube {{ }} }} {RED} USE a Complexity {{ value 1 }} USE a")
    shapes = [one.geometry for one in scene.instances]
    assert all(shape is shapes[0] for shape in shapes[:9])
    assert [one.name for one in scene.instances] == ["a"] * 11


@pytest.mark.parametrize(
    ("node", "point", "expected"),
    [
        ("Translation { translation 1 2 3 }", (1, 0, 0), (2, 2, 3)),
        ("Scale { scaleFactor 2 3 4 }", (1, 1, 1), (2, 3, 4)),
        ("Rotation { rotation 0 0 1 1.5707963267948966 }", (1, 0, 0), (0, 1, 0)),
        ("RotationXYZ { axis X angle 1.5707963267948966 }", (0, 1, 0), (0, 0, 1)),
        ("RotationXYZ { axis Y angle 1.5707963267948966 }", (1, 0, 0), (0, 0, -1)),
        ("MatrixTransform { matrix 0 1 0 0  -1 0 0 0  0 0 1 0  5 6 7 1 }", (1, 0, 0), (5, 7, 7)),
        ("Transform { translation 1 0 0 rotation 0 0 1 1.5707963267948966 scaleFactor 2 1 1 }", (1, 0, 0), (1, 2, 0)),
        ("Transform { center 1 0 0 scaleFactor 2 2 2 }", (1, 0, 0), (1, 0, 0)),
        ("Transform { scaleFactor 2 1 1 scaleOrientation 0 0 1 1.5707963267948966 }", (0, 1, 0), (0, 2, 0)),
        ("Units { units CENTIMETERS }", (100, 0, 0), (1, 0, 0)),
        ("Units { units FEET } Units { units METERS }", (3, 0, 0), (3, 0, 0)),
        ("Translation { translation 1 2 3 } ResetTransform { }", (1, 0, 0), (1, 0, 0)),
        ("Translation { translation 1 2 3 } ResetTransform { whatToReset BBOX }", (0, 0, 0), (1, 2, 3)),
        ("Scale { scaleFactor 2 4 6 } AntiSquish { }", (1, 1, 1), (4, 4, 4)),
        ("Scale { scaleFactor 2 4 6 } AntiSquish { sizing BIGGEST_DIMENSION }", (1, 1, 1), (6, 6, 6)),
        ("Scale { scaleFactor 2 4 6 } AntiSquish { sizing X }", (1, 1, 1), (2, 2, 2)),
        ("Shuttle { translation0 1 2 3 }", (0, 0, 0), (1, 2, 3)),
        ("Rotor { rotation 0 0 1 1.5707963267948966 }", (1, 0, 0), (0, 1, 0)),
        ("Pendulum { rotation0 0 0 1 1.5707963267948966 }", (1, 0, 0), (0, 1, 0)),
    ],
)
def test_transformations(tmp_path: Path, node: str, point: tuple[float, ...], expected: tuple[float, ...]) -> None:
    matrix = only(scene_of(tmp_path, f"{node} Cube {{ }}")).transform
    np.testing.assert_allclose(transform_points(matrix, [point])[0, :3], expected, atol=1e-12)


def test_transformations_multiply_from_the_outside_in(tmp_path: Path) -> None:
    text = f"Scale {{ scaleFactor 2 2 2 }} {BY_ONE} Cube {{ }}"
    assert places(scene_of(tmp_path, text)) == [[2, 0, 0]]


def test_materials(tmp_path: Path) -> None:
    scene = scene_of(
        tmp_path,
        "Material { diffuseColor 1 0 0 transparency .25 } Cube { } Material { diffuseColor 0 1 0 ~ transparency 0 } Cube { }"
        " PackedColor { orderedRGBA 0x0000ff80 } Cube { } Material { emissiveColor .5 0 0 } Cube { }"
        " LightModel { model BASE_COLOR } Cube { }",
    )
    colors = [one.material.base_color for one in scene.instances]
    assert colors[:2] == [(1.0, 0.0, 0.0, 0.75), (1.0, 0.0, 0.0, 1.0)]
    np.testing.assert_allclose(colors[2], (0, 0, 1, 128 / 255))
    assert colors[3] == (0.8, 0.8, 0.8, 1.0)
    assert [one.material.emissive_color for one in scene.instances] == [None, None, None, (0.5, 0.0, 0.0), None]
    assert [one.material.is_lit for one in scene.instances] == [True] * 4 + [False]


def test_the_old_packed_color_begins_with_alpha(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "PackedColor { rgb 0xff0000ff } Cube { }")
    assert base_of(only(scene)) == [1, 0, 0]


def test_hints_style_and_complexity(tmp_path: Path) -> None:
    scene = scene_of(
        tmp_path,
        "ShapeHints { creaseAngle 1.5707963267948966 } DrawStyle { lineWidth 3 } Complexity { value 0 } Sphere { }"
        " Complexity { value 1 } Sphere { }",
    )
    coarse, fine = (one.geometry for one in scene.instances)
    assert repr(coarse) == "Mesh(43 vertices, 48 triangles, 32 faces)"
    assert repr(fine) == "Mesh(2,699 vertices, 5,040 triangles, 2,592 faces)"
    assert getattr(fine, "crease_angle", None) == 90.0


def test_names_are_those_of_the_nearest_node_that_has_one(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "DEF a Separator { Cube { } DEF b Cube { } Separator { Cube { } } } Cube { }")
    assert [one.name for one in scene.instances] == ["a", "b", "a", ""]


def test_other_files(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b.iv").write_text("#Inventor V2.1 ascii\nTranslation { translation 5 0 0 } Cube { }")
    scene = scene_of(tmp_path, 'File { name "sub/b.iv" } Cube { } Separator { File { name "sub/b.iv" } }')
    assert places(scene) == [[5, 0, 0], [5, 0, 0], [10, 0, 0]]
    assert scene.notes == ()


@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("none.iv", "file 'none.iv' was not found"),
        ("../up.iv", "file '../up.iv' was not opened: only files in the model's folder are opened"),
        ("/etc/passwd", "file '/etc/passwd' was not opened: only files in the model's folder are opened"),
        (
            "http://example.org/a.iv",
            "file 'http://example.org/a.iv' was not opened: only files in the model's folder are opened",
        ),
        ("text.iv", "line 2: file 'text.iv' is left out: expected a first line such as '#Inventor V2.1 ascii', got 'hello'"),
        ("bad.iv", "bad.iv: line 2: expected a number, got 'x }'"),
        ("link.iv", "file 'link.iv' was not opened: it is a link that leads out of the model's folder"),
    ],
)
def test_other_files_that_are_not_read(tmp_path: Path, name: str, note: str) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "up.iv").write_text("#Inventor V2.1 ascii\nCube { }")
    (folder / "text.iv").write_text("hello")
    (folder / "bad.iv").write_text("#Inventor V2.1 ascii\nCube { width x }")
    (folder / "link.iv").symlink_to(tmp_path / "up.iv")
    scene = scene_of(folder, f'File {{ name "{name}" }} Cube {{ }}')
    assert scene.notes == (note,)
    assert len(scene.instances) == (2 if name == "bad.iv" else 1)


def test_a_file_or_a_node_that_contains_itself_ends(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'Cube { } Separator { File { name "a.iv" } }')
    assert any("contains itself" in note or "nested deeper" in note for note in scene.notes)
    scene = scene_of(tmp_path, "DEF a Separator { Cube { } USE a }")
    assert scene.notes == ("line 2: Separator a contains itself; the inner one is left out",)
    assert len(scene.instances) == 1


def test_graphs_that_multiply_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scanspan.assets.inventor.traverse.MAX_VISITS", 20_000)
    levels = "".join(f"DEF n{k} Group {{ {f'USE n{k - 1} ' * 10} }} " for k in range(1, 12))
    with pytest.raises(LimitError, match="the scene graph has more than 20000 visits to nodes"):
        scene_of(tmp_path, f"DEF n0 Group {{ Info {{ }} }} {levels}")
    monkeypatch.setattr("scanspan.assets.inventor.build.MAX_INSTANCES", 20)
    with pytest.raises(LimitError, match="more than 20 shapes are to be drawn"):
        scene_of(tmp_path, "Array { numElements1 50 Cube { } }")
    with pytest.raises(LimitError, match="visits to nodes"):
        scene_of(tmp_path, "Array { numElements1 32000 numElements2 32000 numElements3 9 Group { Info { } } }")


def test_nesting_through_uses_ends(tmp_path: Path) -> None:
    levels = "".join(f"DEF n{k} Separator {{ USE n{k - 1} }} " for k in range(1, 2 * MAX_DEPTH))
    scene = scene_of(tmp_path, f"DEF n0 Separator {{ Cube {{ }} }} {levels}")
    assert any(f"nodes are nested deeper than {MAX_DEPTH}" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("node", "note"),
    [
        ("Texture3 { }", "line 2: textures in space are not drawn"),
        ("MatrixTransform { matrix 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1 }", "Cube is left out: transform[3] = (1.0, 0.0, 0.0, 1.0)"),
        ("Scale { scaleFactor 1e39 1 nan }", "expected a number"),
    ],
)
def test_what_is_not_applied_is_noted(tmp_path: Path, node: str, note: str) -> None:
    scene = scene_of(tmp_path, f"Separator {{ {node} Cube {{ }} }} Sphere {{ }}")
    assert any(note in line for line in scene.notes), scene.notes
    assert scene.instances


def test_textures(tmp_path: Path) -> None:
    (tmp_path / "p.png").write_bytes(picture())
    scene = scene_of(
        tmp_path,
        'Texture2 { filename "p.png" wrapS CLAMP } Cube { } Texture2 { image 1 2 3 0xff0000 0x00ff00 } Cube { }'
        " Texture2 { } Cube { }",
    )
    first, second, third = (one.material.texture for one in scene.instances)
    assert first is not None
    assert first.wrap == ("clamp", "repeat")
    assert first.image[0, 0].tolist() == [255, 0, 0, 255]
    assert second is not None
    assert second.image[:, 0].tolist() == [[0, 255, 0, 255], [255, 0, 0, 255]]
    assert third is None


@pytest.mark.parametrize(
    ("fields", "color", "pixel"),
    [
        ("image 1 1 1 0x40", (1, 0, 0), [64, 64, 64, 255]),
        ("image 1 1 2 0x4080", (1, 0, 0), [64, 64, 64, 128]),
        ("image 1 1 4 0x0000ff80 model DECAL", (1, 1, 1), [127, 0, 128, 255]),
        ("image 1 1 3 0x00ff00 model DECAL", (1, 1, 1), [0, 255, 0, 255]),
        ("image 1 1 1 0x80 model BLEND blendColor 0 0 1", (1, 1, 1), [127, 0, 128, 255]),
        ("image 1 1 3 0x00ff00 model REPLACE", (1, 1, 1), [0, 255, 0, 255]),
    ],
)
def test_texture_models(tmp_path: Path, fields: str, color: tuple[float, ...], pixel: list[int]) -> None:
    instance = only(scene_of(tmp_path, f"{RED} Texture2 {{ {fields} }} Cube {{ }}"))
    assert base_of(instance) == list(color)
    assert instance.material.texture is not None
    assert instance.material.texture.image[0, 0].tolist() == pixel


def test_a_texture_that_is_not_there_is_noted(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'Texture2 { filename "none.rgb" } Cube { }')
    assert scene.notes == ("texture 'none.rgb' was not found",)
    assert math.isclose(float(scene.bounds[1, 0]), 1.0)


def test_cameras(tmp_path: Path) -> None:
    scene = scene_of(
        tmp_path,
        "PerspectiveCamera { position 1 2 3 heightAngle 1.5707963267948966 nearDistance .5 } Cube { }"
        " Rotation { rotation 0 1 0 1.5707963267948966 } Scale { scaleFactor 2 2 2 }"
        " OrthographicCamera { position 0 0 5 orientation 1 0 0 .5 height 4 nearDistance -1 }",
    )
    first, second = scene.cameras
    np.testing.assert_allclose(first.eye, (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(-first.view[2, :3], (0, 0, -1), atol=1e-12)
    assert (first.near, first.is_orthographic) == (0.5, False)
    np.testing.assert_allclose(first.project([[1, 2, 0], [4, 2, 0]], (200, 200)), [[100, 100], [200, 100]], atol=1e-9)
    np.testing.assert_allclose(second.eye, (10, 0, 0), atol=1e-12)
    np.testing.assert_allclose(-second.view[2, :3], (-math.cos(0.5), math.sin(0.5), 0), atol=1e-12)
    assert second.is_orthographic
    assert scene.bounds[1].tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("camera", "note"),
    [
        ("PerspectiveCamera { heightAngle 4 }", "PerspectiveCamera is left out: fov"),
        ("OrthographicCamera { height 0 }", "OrthographicCamera is left out: height"),
        ("Scale { scaleFactor 0 0 0 } PerspectiveCamera { }", "PerspectiveCamera is left out: its transformation leaves no"),
    ],
)
def test_cameras_that_are_none(tmp_path: Path, camera: str, note: str) -> None:
    scene = scene_of(tmp_path, f"Cube {{ }} {camera}")
    assert scene.cameras == ()
    assert note in scene.notes[0]
    with pytest.raises(InputError, match=r"cameras\[0\]: expected a Camera, got str"):
        Scene(scene.instances, cameras=["x"])  # type: ignore[list-item]
