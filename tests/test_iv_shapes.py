"""The shapes of Open Inventor: faces, strips, lines, points, solids, surfaces and text, with their bindings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan.assets.inventor import nurbs, solids
from scanspan.assets.inventor.lettering import set_line, trace
from scanspan.assets.load import load
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import LimitError
from tests.inventor import corner_colors, mesh_in, only, scene_of

R, G, B, W = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]
COLORS = "Material { diffuseColor [ 1 0 0, 0 1 0, 0 0 1, 1 1 1 ] }"
SQUARE = "Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0, 2 0 0, 2 1 0 ] }"
TWO_FACES = "IndexedFaceSet { coordIndex [ 0, 1, 2, -1, 0, 2, 3, -1 ] %s }"


def binding(value: str) -> str:
    """A node that binds materials."""
    return f"MaterialBinding {{ value {value} }}"


@pytest.mark.parametrize(
    ("value", "fields", "colors"),
    [
        ("PER_FACE", "", [R, R, R, G, G, G]),
        ("PER_PART", "", [R, R, R, G, G, G]),
        ("PER_FACE_INDEXED", "materialIndex [ 2, 0 ]", [B, B, B, R, R, R]),
        ("PER_FACE_INDEXED", "", [R, R, R, G, G, G]),
        ("PER_FACE_INDEXED", "materialIndex [ 2 ]", [B, B, B, B, B, B]),
        ("PER_VERTEX", "", [R, G, B, W, W, W]),
        ("PER_VERTEX_INDEXED", "", [R, G, B, R, B, W]),
        ("PER_VERTEX_INDEXED", "materialIndex [ 3, 2, 1, -1, 0, 0, 0, -1 ]", [W, B, G, R, R, R]),
    ],
)
def test_materials_of_an_indexed_face_set(tmp_path: Path, value: str, fields: str, colors: list[list[float]]) -> None:
    scene = scene_of(tmp_path, f"{COLORS} {SQUARE} {binding(value)} {TWO_FACES % fields}")
    assert corner_colors(only(scene)) == colors
    assert only(scene).material.base_color == (1.0, 1.0, 1.0, 1.0)


def test_overall_takes_the_first_material(tmp_path: Path) -> None:
    instance = only(scene_of(tmp_path, f"{COLORS} {SQUARE} {TWO_FACES % ''}"))
    assert instance.material.base_color == (1.0, 0.0, 0.0, 1.0)
    assert "color" not in mesh_in(instance).corners


@pytest.mark.parametrize(
    ("shape", "triangles"),
    [
        ("IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] }", [[0, 1, 2], [0, 2, 3]]),
        ("IndexedFaceSet { coordIndex [ 0, 1, 2, 3 ] }", [[0, 1, 2], [0, 2, 3]]),
        ("IndexedFaceSet { coordIndex [ -1, 0, 1, -1, -1, 0, 1, 2, -1 ] }", [[0, 1, 2]]),
        ("FaceSet { numVertices [ 3, 3 ] }", [[0, 1, 2], [3, 4, 5]]),
        ("FaceSet { startIndex 2 numVertices [ 3 ] }", [[2, 3, 4]]),
        ("FaceSet { startIndex 3 }", [[3, 4, 5]]),
        ("IndexedTriangleStripSet { coordIndex [ 0, 1, 3, 2, -1, 1, 4, 2 ] }", [[0, 1, 3], [3, 1, 2], [1, 4, 2]]),
        ("TriangleStripSet { numVertices [ 4 ] }", [[0, 1, 2], [2, 1, 3]]),
    ],
)
def test_faces_and_their_turn(tmp_path: Path, shape: str, triangles: list[list[int]]) -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)], dtype=float)
    mesh = mesh_in(only(scene_of(tmp_path, f"{SQUARE} {shape}")))
    expected = sorted(sorted(map(tuple, points[list(three)].tolist())) for three in triangles)
    found = mesh.positions[mesh.triangles]
    assert sorted(sorted(map(tuple, three)) for three in found.tolist()) == expected
    first = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2]
    wanted = np.array([np.cross(points[b] - points[a], points[c] - points[a])[2] for a, b, c in triangles])
    assert np.array_equal(np.sort(np.sign(first)), np.sort(np.sign(wanted)))


@pytest.mark.parametrize("indexed", [True, False])
def test_strips_bind_parts_faces_and_vertices(tmp_path: Path, indexed: bool) -> None:
    shape = "IndexedTriangleStripSet { coordIndex [ 0, 1, 2, 3, -1, 1, 4, 2 ] }" if indexed else "TriangleStripSet { }"
    count = 3 if indexed else 4
    colors = corner_colors(only(scene_of(tmp_path, f"{COLORS} {SQUARE} {binding('PER_FACE')} {shape}")))
    assert colors[: 3 * count : 3] == [R, G, B, W][:count]
    colors = corner_colors(only(scene_of(tmp_path, f"{COLORS} {SQUARE} {binding('PER_PART')} {shape}")))
    assert colors[0] == colors[3] == R
    assert colors[6] == (G if indexed else R)
    colors = corner_colors(only(scene_of(tmp_path, f"{COLORS} {SQUARE} {binding('PER_VERTEX')} {shape}")))
    assert colors[:6] == [R, G, B, B, G, W]


def test_quad_mesh_binds_rows_and_faces(tmp_path: Path) -> None:
    points = "Coordinate3 { point [ 0 0 0, 1 0 0, 2 0 0, 0 1 0, 1 1 0, 2 1 0, 0 2 0, 1 2 0, 2 2 0 ] }"
    quads = "QuadMesh { verticesPerRow 3 verticesPerColumn 3 }"
    rows = corner_colors(only(scene_of(tmp_path, f"{COLORS} {points} {binding('PER_PART')} {quads}")))
    assert rows[::6] == [R, R, G, G]
    faces = corner_colors(only(scene_of(tmp_path, f"{COLORS} {points} {binding('PER_FACE')} {quads}")))
    assert faces[::6] == [R, G, B, W]
    mesh = mesh_in(only(scene_of(tmp_path, f"{points} {quads}")))
    assert mesh.triangles[:2].tolist() == [[0, 3, 4], [0, 4, 1]]


def test_normals(tmp_path: Path) -> None:
    normals = "Normal { vector [ 1 0 0, 0 1 0, 0 0 1, 0 0 -1 ] }"

    def found(nodes: str, fields: str = "") -> list[list[float]] | None:
        mesh = mesh_in(only(scene_of(tmp_path, f"{SQUARE} {nodes} {TWO_FACES % fields}")))
        return mesh.corners["normal"].reshape(-1, 3).tolist() if "normal" in mesh.corners else None

    x, y, z, down = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
    assert found("") is None
    assert found(normals) == [x, y, z, x, z, down]
    assert found(normals, "normalIndex [ 3, 3, 3, -1, 0, 1, 2, -1 ]") == [down, down, down, x, y, z]
    assert found(f"{normals} NormalBinding {{ value PER_FACE }}") == [x, x, x, y, y, y]
    assert found(f"{normals} NormalBinding {{ value OVERALL }}") == [x] * 6
    assert found(f"{normals} NormalBinding {{ value DEFAULT }}") == [x, y, z, x, z, down]
    assert found("Normal { vector [ 0 0 1 ] }") is None


def test_too_few_normals_are_made_anew(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"{SQUARE} Normal {{ vector [ 0 0 1 ] }} {TWO_FACES % ''}")
    assert scene.notes == ("line 2: IndexedFaceSet needs 4 normals, there are 1; they are made anew",)


def test_vertex_property_goes_before_what_is_in_force(tmp_path: Path) -> None:
    own = "vertexProperty VertexProperty { vertex [ 0 0 5, 1 0 5, 1 1 5 ] orderedRGBA [ 0xff0000ff, 0x00ff00ff ] }"
    scene = scene_of(
        tmp_path, f"{SQUARE} IndexedFaceSet {{ {own} coordIndex [ 0, 1, 2 ] }} IndexedFaceSet {{ coordIndex [ 0 1 2 ] }}"
    )
    first, second = scene.instances
    assert mesh_in(first).bounds[:, 2].tolist() == [5, 5]
    assert first.material.base_color == (1.0, 0.0, 0.0, 1.0)
    assert mesh_in(second).bounds[:, 2].tolist() == [0, 0]
    assert second.material.base_color == (0.8, 0.8, 0.8, 1.0)
    placed = scene_of(tmp_path, "VertexProperty { vertex [ 0 0 5, 1 0 5, 1 1 5 ] } FaceSet { }")
    assert placed.bounds[0].tolist() == [0, 0, 5]


def test_ordering_turns_faces_round(tmp_path: Path) -> None:
    hints = "ShapeHints { vertexOrdering CLOCKWISE creaseAngle 3 }"
    text = f"{COLORS} {SQUARE} {binding('PER_VERTEX')} {hints} IndexedFaceSet {{ coordIndex [ 0, 1, 2 ] }}"
    instance = only(scene_of(tmp_path, text))
    a, b, c = mesh_in(instance).positions[mesh_in(instance).triangles[0]]
    assert np.cross(b - a, c - a)[2] < 0
    assert corner_colors(instance) == [B, G, R]
    assert math.isclose(mesh_in(instance).crease_angle or 0.0, math.degrees(3.0))


@pytest.mark.parametrize(
    ("shape", "note"),
    [
        (
            "IndexedFaceSet { coordIndex [ 0, 1, 99, -1, 0, 1, 2 ] }",
            "names coordinate 99, there are 6; what uses such is left out",
        ),
        ("FaceSet { numVertices [ 3, 9 ] }", "FaceSet needs 12 coordinates, there are 6; what they do not reach is left out"),
        ("QuadMesh { verticesPerRow 3 verticesPerColumn 9 }", "QuadMesh needs 9 x 3 coordinates from 0 on, there are 6"),
        ("QuadMesh { startIndex -3 verticesPerRow 3 verticesPerColumn 2 }", "QuadMesh needs 2 x 3 coordinates from -3 on"),
        ("PointSet { numPoints 9 }", "PointSet needs 9 coordinates, there are 6; all that there are are drawn"),
        ("IndexedLineSet { coordIndex [ 0, 1, 77 ] }", "IndexedLineSet names coordinate 77, there are 6"),
    ],
)
def test_coordinates_that_do_not_exist(tmp_path: Path, shape: str, note: str) -> None:
    scene = scene_of(tmp_path, f"{SQUARE} {shape}")
    assert any(note in line for line in scene.notes), scene.notes
    assert scene.primitive_count >= 1


def test_a_broken_shape_does_not_lose_the_others(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "Coordinate3 { point [ 1e999 0 0, 1 0 0, 0 1 0 ] } FaceSet { } Cube { }")
    assert len(scene.instances) == 1
    assert "FaceSet is left out: positions[0]" in scene.notes[0]
    with pytest.raises(LimitError, match="max_face_corners"):
        scene_of(tmp_path, "Coordinate3 { point [ " + "0 0 0 1 0 0 1 1 0 " * 4000 + "] } FaceSet { }")


def segments_of(folder: Path, text: str) -> tuple[Segments, Any]:
    """The segments of a scene, and the material."""
    instance = only(scene_of(folder, f"{COLORS} {SQUARE} {text}"))
    assert isinstance(instance.geometry, Segments)
    return instance.geometry, instance.material


@pytest.mark.parametrize(
    ("value", "ends"),
    [
        ("OVERALL", None),
        ("PER_PART", [R, R, G, G, B, B]),
        ("PER_FACE", [R, R, R, R, G, G]),
        ("PER_VERTEX", [R, G, G, B, W, W]),
        ("PER_VERTEX_INDEXED", [R, G, G, B, W, R]),
    ],
)
def test_lines(tmp_path: Path, value: str, ends: list[list[float]] | None) -> None:
    lines = "DrawStyle { lineWidth 4 } IndexedLineSet { coordIndex [ 0, 1, 2, -1, 3, 0, -1 ] }"
    shape, material = segments_of(tmp_path, f"{binding(value)} {lines}")
    assert shape.positions[shape.segments].tolist() == [
        [[0, 0, 0], [1, 0, 0]],
        [[1, 0, 0], [1, 1, 0]],
        [[0, 1, 0], [0, 0, 0]],
    ]
    assert shape.width == 4.0
    assert not material.is_lit
    assert (None if shape.colors is None else shape.colors[:, :3].tolist()) == ends


def test_line_sets_and_points(tmp_path: Path) -> None:
    shape, _ = segments_of(tmp_path, "LineSet { numVertices [ 2, 3 ] }")
    assert shape.segments.shape == (3, 2)
    text = f"{COLORS} {SQUARE} {binding('PER_VERTEX')} DrawStyle {{ pointSize 5 }}"
    points = only(scene_of(tmp_path, f"{text} PointSet {{ startIndex 1 numPoints 3 }}")).geometry
    assert isinstance(points, Points)
    assert (points.size, points.positions.tolist()) == (5.0, [[1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert points.colors is not None
    assert points.colors[:, :3].tolist() == [R, G, B]
    markers = only(scene_of(tmp_path, f"{text} MarkerSet {{ }}")).geometry
    assert isinstance(markers, Points)
    assert (markers.size, len(markers.positions)) == (7.0, 6)


@pytest.mark.parametrize(
    ("style", "kind", "count"), [("LINES", Segments, 8), ("POINTS", Points, 8), ("FILLED", Mesh, 2)]
)  # fmt: skip
def test_styles(tmp_path: Path, style: str, kind: type, count: int) -> None:
    faces = "IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1, 1, 4, 5, 2 ] }"
    scene = scene_of(tmp_path, f"{SQUARE} DrawStyle {{ style {style} }} {faces} DrawStyle {{ style INVISIBLE }} Cube {{ }}")
    assert isinstance(only(scene).geometry, kind)
    assert scene.primitive_count == count


def test_bounding_boxes(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "Complexity { type BOUNDING_BOX } Cone { height 6 }")
    assert scene.triangle_count == 12
    np.testing.assert_allclose(scene.bounds, [[-1, -3, -1], [1, 3, 1]], atol=1e-12)


def volume(mesh: Mesh) -> float:
    """Six times the volume within a mesh, over six."""
    corners = mesh.positions[mesh.triangles]
    return float(np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0)


@pytest.mark.parametrize(
    ("shape", "exact"),
    [
        ("Cube { width 2 height 3 depth 4 }", 24.0),
        ("Sphere { radius 2 }", 32.0 * math.pi / 3.0),
        ("Cone { bottomRadius 2 height 3 }", 4.0 * math.pi),
        ("Cylinder { radius 2 height 3 }", 12.0 * math.pi),
    ],
)
def test_solids_are_closed_and_face_outwards(tmp_path: Path, shape: str, exact: float) -> None:
    mesh = mesh_in(only(scene_of(tmp_path, f"Complexity {{ value 1 }} {shape}")))
    assert 0.99 < volume(mesh) / exact < 1.0000001
    corners = mesh.positions[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("nk,nck->nc", across, mesh.corners["normal"]) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.corners["normal"], axis=2), 1.0, atol=1e-6)


def test_parts_of_solids(tmp_path: Path) -> None:
    def colors(shape: str) -> list[list[float]]:
        table = "Material { diffuseColor [ 1 0 0, 0 1 0, 0 0 1, 0 0 0, .5 0 0, 0 .5 0 ] }"
        found = corner_colors(only(scene_of(tmp_path, f"{table} {binding('PER_PART')} {shape}")))
        return [found[0], found[-1]]

    assert colors("Cube { }") == [R, [0.0, 0.5, 0.0]]
    assert colors("Cone { }") == [R, G]
    assert colors("Cylinder { }") == [R, B]
    assert scene_of(tmp_path, "Cylinder { parts (TOP | BOTTOM) }").primitive_count == 2
    assert scene_of(tmp_path, "Cone { parts SIDES }").primitive_count == solids.side_count(0.5)


def test_texture_coordinates(tmp_path: Path) -> None:
    def found(nodes: str, shape: str = "IndexedFaceSet { coordIndex [ 0, 4, 5, 3 ] }") -> list[list[float]]:
        text = f"{SQUARE} Texture2 {{ image 1 1 3 1 }} {nodes} {shape}"
        uv = mesh_in(only(scene_of(tmp_path, text))).corners["uv"]
        return uv[0].round(6).tolist()

    assert found("") == [[0, 0], [1, 0], [1, 0.5]]
    points = "TextureCoordinate2 { point [ 0 0, .1 0, .2 0, .3 0, .4 0, .5 0 ] }"
    assert found(points) == [[0, 0], [0.4, 0], [0.5, 0]]
    assert found(f"{points} TextureCoordinateBinding {{ value PER_VERTEX }}") == [[0, 0], [0.1, 0], [0.2, 0]]
    indexed = "IndexedFaceSet { coordIndex [ 0, 4, 5, 3 ] textureCoordIndex [ 5, 4, 3, 2 ] }"
    assert found(points, indexed) == [[0.5, 0], [0.4, 0], [0.3, 0]]
    assert found("TextureCoordinatePlane { directionS 2 0 0 directionT 0 2 0 }") == [[0, 0], [1, 0], [1, 0.5]]
    assert found("Texture2Transform { translation 1 2 scaleFactor 2 4 }") == [[1, 2], [3, 2], [3, 4]]
    assert found("Texture2Transform { rotation 1.5707963267948966 }") == [[0, 0], [0, 1], [-0.5, 1]]
    assert found(f"{points} TextureCoordinateDefault {{ }}") == [[0, 0], [1, 0], [1, 0.5]]


def bernstein(knots: list[float], order: int, number: int, place: float) -> float:
    """A basis function by its definition."""
    if order == 1:
        last = knots[number + 1] == knots[-1] and place == knots[-1] and knots[number] < knots[number + 1]
        return float(knots[number] <= place < knots[number + 1] or last)
    left, right = knots[number + order - 1] - knots[number], knots[number + order] - knots[number + 1]
    first = (place - knots[number]) / left * bernstein(knots, order - 1, number, place) if left else 0.0
    second = (knots[number + order] - place) / right * bernstein(knots, order - 1, number + 1, place) if right else 0.0
    return first + second


@given(st.integers(2, 5), st.lists(st.integers(0, 6), min_size=2, max_size=9))
def test_the_basis_is_that_of_its_definition(order: int, inner: list[int]) -> None:
    knots = [float(k) for k in sorted([*inner, *[min(inner)] * (order - 1), *[max(inner)] * (order - 1)])]
    count = len(knots) - order
    if nurbs.fault(np.array(knots), count):
        return
    places = nurbs.parameters(np.array(knots), order, 3)
    values, _ = nurbs.basis(np.array(knots), order, places)
    expected = [[bernstein(knots, order, k, place) for k in range(count)] for place in places.tolist()]
    np.testing.assert_allclose(values, expected, atol=1e-12)


def test_a_weighted_surface_is_an_exact_cylinder(tmp_path: Path) -> None:
    s = 1.0 / math.sqrt(2.0)
    arc = [(1, 0, 1), (1, 1, s), (0, 1, 1)]
    points = [f"{x * w} {y * w} {z * w} {w}" for z in (0, 1) for x, y, w in arc]
    surface = "NurbsSurface { numUControlPoints 3 numVControlPoints 2 uKnotVector [ 0 0 0 1 1 1 ] vKnotVector [ 0 0 1 1 ] }"
    mesh = mesh_in(only(scene_of(tmp_path, f"Coordinate4 {{ point [ {', '.join(points)} ] }} {surface}")))
    radius = np.hypot(mesh.positions[:, 0], mesh.positions[:, 1])
    np.testing.assert_allclose(radius, 1.0, atol=1e-12)
    flat = mesh.positions[mesh.triangles].copy()
    flat[..., 2] = 0.0
    np.testing.assert_allclose(np.abs(np.einsum("nck,nck->nc", flat, mesh.corners["normal"])), 1.0, atol=1e-6)


@pytest.mark.parametrize(
    ("fields", "note"),
    [
        ("numUControlPoints 3 numVControlPoints 2 uKnotVector [ 0 0 1 ] vKnotVector [ 0 0 1 1 ]", "expected 5 to 6 knots"),
        ("numUControlPoints 2 numVControlPoints 2 uKnotVector [ 0 2 1 1 ] vKnotVector [ 0 0 1 1 ]", "expected finite knots"),
        ("numUControlPoints 9 numVControlPoints 2 uKnotVector [ 0 0 1 2 3 4 5 6 7 8 8 ] vKnotVector [ 0 0 1 1 ]",
         "expected 18 control points, there are 6"),
        ("", "expected 2 to 0 knots for 0 control points, got 0"),
        ("numUControlPoints 1500 numVControlPoints 2 uKnotVector [" + " 1" * 2500 + " ] vKnotVector [ 0 0 1 1 ]",
         "expected 1502 to 3000 knots"),
        ("numUControlPoints 2990 numVControlPoints 2 uKnotVector [" + " 1" * 3000 + " ] vKnotVector [ 0 0 1 1 ]",
         "expected at most 2000 knots, got 3000"),
    ],
)  # fmt: skip
def test_surfaces_that_are_none(tmp_path: Path, fields: str, note: str) -> None:
    scene = scene_of(tmp_path, f"{SQUARE} NurbsSurface {{ {fields} }} Cube {{ }}")
    assert f"NurbsSurface is left out: {note}" in scene.notes[0]
    assert len(scene.instances) == 1


def test_curves(tmp_path: Path) -> None:
    curve = "NurbsCurve { numControlPoints 4 knotVector [ 0 0 0 0 1 1 1 1 ] }"
    shape, material = segments_of(tmp_path, curve)
    assert shape.positions[0].tolist() == [0, 0, 0]
    np.testing.assert_allclose(shape.positions[-1], [0, 1, 0], atol=1e-12)
    assert not material.is_lit


def area(rings: tuple[np.ndarray, ...]) -> float:
    """Twice the area of rings, holes taken off, over two."""
    return sum(
        float(np.sum(r[:, 0] * np.roll(r[:, 1], -1) - np.roll(r[:, 0], -1) * r[:, 1])) for r in rings
    ) / 2.0  # fmt: skip


def test_letters_have_the_area_of_their_picture() -> None:
    from PIL import Image, ImageDraw, ImageFont

    for sign in "AgB8i%":
        letter = trace(sign)
        picture = Image.new("L", (128, 128))
        ImageDraw.Draw(picture).text((20, 90), sign, font=ImageFont.load_default(64), anchor="ls", fill=255)
        inked = float(np.asarray(picture, dtype=float).sum()) / 255.0 / 64.0**2
        assert abs(abs(area(letter.rings)) - inked) < 0.03 * inked
    assert len(trace("B").rings) == 3
    assert trace(" ").rings == ()
    assert set_line("ab").width == trace("a").advance + trace("b").advance


def test_text3(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'Font { size 2 } Text3 { string [ "HI", "I" ] parts ALL }')
    front, back, sides = scene.instances
    assert isinstance(front.geometry, Polygons)
    assert front.geometry.count == 3
    assert front.geometry.normals[:, 2].tolist() == [1, 1, 1]
    assert isinstance(back.geometry, Polygons)
    assert back.geometry.normals[:, 2].tolist() == [-1, -1, -1]
    assert back.bounds[:, 2].tolist() == [-1, -1]
    assert sides.bounds[:, 2].tolist() == [-1, 0]
    assert scene.bounds[0, 1] < -1.9
    right = scene_of(tmp_path, 'Text3 { string "HI" justification RIGHT }')
    assert right.bounds[1, 0] < 0
    middle = scene_of(tmp_path, 'AsciiText { string "HH" justification CENTER }')
    assert abs(middle.bounds[:, 0].sum()) < 0.6
    outline = mesh_in(sides)
    assert volume(outline) > 0


def test_text2_has_its_size_in_the_window(tmp_path: Path) -> None:
    scene = scene_of(
        tmp_path, 'Cube { width 300 height 400 depth 1e-9 } Translation { translation 10 0 0 } Text2 { string "H" }'
    )
    letter = scene.instances[1]
    np.testing.assert_allclose(letter.bounds[1, 1], 7.0, atol=0.3)
    assert not letter.material.is_lit
    assert "Text2 stands upright in the scene" in scene.notes[0]
    assert scene_of(tmp_path, 'Text2 { string "H" }').primitive_count == 1


@pytest.mark.parametrize("kind", ["Text3", "Text2", "AsciiText"])
def test_too_many_letters_are_left_out(tmp_path: Path, kind: str) -> None:
    scene = scene_of(tmp_path, f'Cube {{ }} {kind} {{ string [ "{"x" * 15_000}", "{"y" * 6_000}" ] }}')
    assert scene.notes == (f"line 2: {kind} is left out: expected at most 20000 letters, got 21000",)
    assert len(scene.instances) == 1


def test_copies_count_towards_the_limit_of_triangles(tmp_path: Path) -> None:
    path = tmp_path / "a.iv"
    path.write_text("#Inventor V2.1 ascii\nArray { numElements1 10 Cube { } }")
    assert load(path, max_triangles=120).triangle_count == 120
    with pytest.raises(LimitError, match=r"120 triangles are more than the limit of 119 \(max_triangles\)"):
        load(path, max_triangles=119)
