"""Clipping planes of Inventor files, against areas and lengths that are known, and what is said of what is not drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.inventor.clipping import MAX_PLANES, Faces, clip_faces
from tests.inventor import mesh_in, only, scene_of


def area(instance: ss.Instance) -> float:
    """The area of a mesh in the world."""
    mesh = mesh_in(instance)
    world = mesh.positions @ instance.transform[:3, :3].T
    corners = world[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(across, axis=1).sum() / 2)


def test_a_plane_cuts_what_follows_within_its_separator(tmp_path: Path) -> None:
    text = """Cube {} Separator { ClipPlane { plane 1 0 0 .5 } Cube {} } Cube {} ClipPlane { plane 0 -1 0 -.25 } Cube {}
    ClipPlane { plane 0 0 1 0 on FALSE } Cube {} ClipPlane { plane 0 0 1 3 } Cube {}"""
    scene = scene_of(tmp_path, text)
    assert [round(area(one), 9) for one in scene.instances] == [24.0, 4 + 4 * 1.0, 24.0, 4 + 10.0, 4 + 10.0]
    assert mesh_in(scene.instances[1]).positions[:, 0].min() == 0.5
    assert mesh_in(scene.instances[3]).positions[:, 1].max() == 0.25


def test_a_plane_stands_where_the_transformation_takes_it(tmp_path: Path) -> None:
    text = """Translation { translation 5 0 0 } Scale { scaleFactor 2 1 1 } ClipPlane { plane 1 0 0 .25 }
    Translation { translation -.5 0 0 } RotationXYZ { axis Z angle 3.141592653589793 } Cube {}"""
    instance = only(scene_of(tmp_path, text))
    low, high = instance.bounds
    assert low.round(9).tolist() == [5.5, -1, -1]
    assert high.round(9).tolist() == [6, 1, 1]


def test_one_shape_in_two_places_is_cut_in_both(tmp_path: Path) -> None:
    text = """ClipPlane { plane 1 0 0 0 } DEF one Cube {} Translation { translation .5 0 0 } USE one
    Translation { translation -2 0 0 } USE one"""
    bounds = [one.bounds[:, 0].round(9).tolist() for one in scene_of(tmp_path, text).instances]
    assert bounds == [[0, 1], [0, 1.5]]


def test_lines_points_and_outlines_are_cut(tmp_path: Path) -> None:
    text = """ClipPlane { plane 1 0 0 0 } Coordinate3 { point [ -1 0 0, 3 4 0, -2 0 0, -3 0 0, 1 0 0 ] }
    BaseColor { rgb [ 1 0 0, 0 1 0, 0 0 1, 1 1 1, 0 0 0 ] } MaterialBinding { value PER_VERTEX }
    LineSet { numVertices [ 2, 3 ] } PointSet {} DrawStyle { style LINES } Cube {}"""
    lines, points, outline = (one.geometry for one in scene_of(tmp_path, text).instances)
    assert isinstance(lines, ss.Segments)
    assert lines.positions[lines.segments].tolist() == [[[0, 1, 0], [3, 4, 0]], [[0, 0, 0], [1, 0, 0]]]
    colors = np.asarray(lines.colors, float)
    assert (colors / (255 if colors.max() > 1 else 1)).round(2).tolist()[0][:3] == [0.75, 0.25, 0]
    assert isinstance(points, ss.Points)
    assert points.positions.tolist() == [[3, 4, 0], [1, 0, 0]]
    assert isinstance(outline, ss.Segments)
    assert outline.positions[:, 0].min() == 0.0


def test_neighbours_get_the_same_cut_points(rng: np.random.Generator) -> None:
    points = np.concatenate([rng.normal(size=(30, 2)), np.zeros((30, 1))], axis=1)
    triangles = ss.triangulate(points[np.argsort(np.arctan2(points[:, 1], points[:, 0])), :2]).triangles
    ring = points[np.argsort(np.arctan2(points[:, 1], points[:, 0]))]
    vertex = triangles.reshape(-1).astype(np.int64)
    whole = Faces(ring, vertex, np.full(len(triangles), 3), (ring[vertex], None, None))
    for plane in ([0.3, 0.9, 0.0, 0.1], [-1.0, 0.2, 0.0, 0.05]):
        cut = clip_faces(whole, np.array(plane))
        other = clip_faces(whole, -np.array(plane))
        assert len({tuple(p) for p in cut.points[len(ring) :]}) == len(cut.points) - len(ring)
        total = sum(polygon_area(part) for part in (cut, other))
        assert abs(total - polygon_area(whole)) < 1e-12
        values = cut.values[0]
        assert values is not None
        assert np.abs(values - cut.points[cut.vertex]).max() < 1e-12


def polygon_area(faces: Faces) -> float:
    """The area of faces in the plane z = 0."""
    total, first = 0.0, 0
    for count in faces.counts.tolist():
        ring = faces.points[faces.vertex[first : first + count]]
        after = np.roll(ring, -1, axis=0)
        total += abs(float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum())) / 2
        first += count
    return total


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("ClipPlane { plane 0 0 0 1 } Cube {}", ""),
        ("Scale { scaleFactor 0 1 1 } ClipPlane {} ResetTransform {} Cube {}", "ClipPlane is left out: "),
        (
            "ClipPlane { plane 1 0 0 -9 } " * (MAX_PLANES + 1) + "Cube {}",
            f"more than {MAX_PLANES} clipping planes are in force",
        ),
        ("ClipPlane { plane 1 0 0 -99 } Text3 { string a }", "clipping planes cut the sides of Text3 alone"),
        ("Texture3 {} Cube {}", "textures in space are not drawn"),
        ("TextureCoordinateEnvironment {} Cube {}", "textures that mirror the surroundings are not drawn"),
        ("NurbsProfile {} Cube {}", "curves of NurbsProfile are not applied"),
        ("PolygonOffset {} Cube {}", "PolygonOffset is not applied"),
        ("ColorIndex {} Cube {}", "colours by index are not known"),
        ("DrawStyle { linePattern 3855 } Cube {}", "the pattern of DrawStyle is not drawn"),
        ("Font { name Times } Cube {}", "letters are of the one font that there is"),
        ("FontStyle { style BOLD } Cube {}", "letters are of the one font that there is"),
        ("Annotation { Cube {} }", "Annotation is drawn where it stands"),
        ("PathSwitch { Sphere {} } Cube {}", "PathSwitch is left out"),
        ("AsciiText { string a width 3 }", "the width of AsciiText is not applied"),
        ("OrthographicCamera { viewportMapping LEAVE_ALONE } Cube {}", "viewportMapping LEAVE_ALONE is not applied"),
        (
            "ProfileCoordinate2 { point [ 0 0, .2 .1, 1 .1 ] } LinearProfile { index [ 0, 1, 2 ] } Text3 { string a }",
            "the profile of Text3 gives its depth alone",
        ),
        (
            "ShapeHints { shapeType SOLID vertexOrdering COUNTERCLOCKWISE } Cylinder { parts SIDES }",
            "1 shape is called SOLID and is open: its back faces are drawn too",
        ),
        ("ShapeHints { shapeType SOLID vertexOrdering COUNTERCLOCKWISE } Cylinder {}", ""),
    ],
)
def test_what_is_not_drawn_is_said(text: str, note: str, tmp_path: Path) -> None:
    notes = scene_of(tmp_path, text).notes
    assert len(notes) == bool(note), notes
    assert not note or note in notes[0]
