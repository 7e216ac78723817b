"""Scene and Instance: what is numbered how, exact bounds, and every message."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance, Scene
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


@pytest.fixture
def quad() -> Mesh:
    """One face, two triangles."""
    return Mesh.from_polygons(SQUARE, [(0, 1, 2, 3)])


def moved(x: float, y: float, z: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def test_primitives_are_numbered_through_all_kinds(quad: Mesh) -> None:
    scene = Scene([quad, Segments(SQUARE, [(0, 1), (1, 2)]), Points(SQUARE), Instance(quad, moved(2, 0, 0))])
    assert scene.first_primitive == (0, 1, 3, 7, 8)
    assert scene.primitive_count == 8
    assert scene.triangle_count == 4
    assert repr(scene) == "Scene(4 instances, 4 triangles, up +Y)"


def test_faces_without_a_triangle_count(quad: Mesh) -> None:
    assert Scene([Mesh(SQUARE, [(0, 1, 2)], source=[4], face_count=9), quad]).first_primitive == (0, 9, 10)


def test_bounds_are_exact_over_what_is_used(quad: Mesh) -> None:
    far = Mesh([*SQUARE, (1e9, 0, 0)], [(0, 1, 2)])
    turn = np.array([(0, -1, 0, 5), (1, 0, 0, 0), (0, 0, 2, 0.25), (0, 0, 0, 1)], dtype=np.float64)
    assert Scene([Instance(far, turn)]).bounds.tolist() == [[4, 0, 0.25], [5, 1, 0.25]]
    assert Scene([quad, Instance(Points([(7, 8, 9)]), moved(0, 0, 1))]).bounds.tolist() == [[0, 0, 0], [7, 8, 10]]
    tilt = np.array([(1, 1, 0, 0), (-1, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)], dtype=np.float64)
    assert Scene([Instance(quad, tilt)]).bounds.tolist() == [[0, -1, 0], [2, 1, 0]]


def test_an_empty_scene_has_no_bounds() -> None:
    assert np.isnan(Scene([]).bounds).all()
    assert np.isnan(Scene([Mesh(SQUARE, []), Points([])]).bounds).all()
    assert Scene([]).first_primitive == (0,)


def test_what_a_scene_is_made_of(quad: Mesh) -> None:
    assert len(Scene(quad).instances) == 1
    assert len(Scene(Instance(quad)).instances) == 1
    assert len(Scene([Scene([quad, quad]), quad]).instances) == 3
    assert len(Scene(item for item in (quad, quad)).instances) == 2
    scene = Scene(quad, up="-Z", name="n", notes=["one"])
    assert (scene.up, scene.name, scene.notes) == ("-Z", "n", ("one",))
    other = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(other.bounds, scene.bounds)
    assert repr(other) == repr(scene)


def test_an_instance_keeps_a_transform_of_its_own(quad: Mesh) -> None:
    matrix = moved(1, 2, 3).astype(np.float32)
    instance = Instance(quad, matrix, Material("m"), "part")
    matrix[0, 3] = 9
    assert instance.transform[0, 3] == 1.0
    assert instance.transform.dtype == np.float64
    assert instance.material.name == "m"
    assert repr(instance) == "Instance('part', Mesh(4 vertices, 2 triangles, 1 face))"
    assert np.array_equal(Instance(quad).transform, np.eye(4))


PERSPECTIVE = np.eye(4)
PERSPECTIVE[3] = 0, 0, 1, 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"transform": np.eye(3)}, r"transform: expected shape \(4, 4\), got \(3, 3\)"),
        ({"transform": np.full((4, 4), np.nan)}, r"transform\[0, 0\] = nan: expected finite numbers"),
        ({"transform": PERSPECTIVE}, r"transform\[3\] = \(0.0, 0.0, 1.0, 0.0\): expected the last row \(0, 0, 0, 1\)"),
        ({"transform": "x"}, r"transform: expected an array of numbers"),
        ({"material": "red"}, r"material: expected a Material, got str"),
        ({"name": 5}, r"name: expected text, got 5"),
    ],
)
def test_bad_instances_are_quoted(quad: Mesh, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Instance(quad, **options)


def test_bad_scenes_are_quoted(quad: Mesh) -> None:
    with pytest.raises(InputError, match="geometry: expected a Mesh, Polygons, Segments, Points or PointCloud, got Scene"):
        Instance(Scene(quad))  # type: ignore[arg-type]
    with pytest.raises(
        InputError, match=r"instances\[1\]: expected a Mesh, Polygons, Segments, Points, PointCloud or Instance, got int"
    ):
        Scene([quad, 5])  # type: ignore[list-item]
    with pytest.raises(InputError, match="instances: expected meshes or instances, got str"):
        Scene("model.obj")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="instances: expected meshes or instances, got int"):
        Scene(5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"unknown direction for up 'Y'; did you mean"):
        Scene(quad, up="Y")
