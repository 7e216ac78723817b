"""Mesh, Segments, Points, Texture and Material: what they accept, how they keep it, and every message."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scanspan.assets.material import Material, Texture, linear_to_srgb
from scanspan.assets.mesh import Mesh
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError, LimitError

NAN, INF = float("nan"), float("inf")
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TWO = [(0, 1, 2), (0, 2, 3)]

POSITIONS = np.array(SQUARE, dtype=np.float64)


def in_layouts() -> list[np.ndarray[Any, Any]]:
    """The square's positions in many types and layouts."""
    read_only = POSITIONS.copy()
    read_only.flags.writeable = False
    strided = np.zeros((8, 6))
    strided[::2, ::2] = POSITIONS
    unaligned = np.zeros(POSITIONS.nbytes + 1, dtype=np.uint8)[1:].view(np.float64).reshape(4, 3)
    unaligned[:] = POSITIONS
    return [
        POSITIONS.astype(np.float32),
        POSITIONS.astype(np.float16),
        POSITIONS.astype(np.longdouble),
        POSITIONS.astype(">f8"),
        POSITIONS.astype(np.uint8),
        POSITIONS.astype(bool),
        np.asfortranarray(POSITIONS),
        POSITIONS[::-1][::-1],
        strided[::2, ::2],
        unaligned,
        read_only,
        np.ma.MaskedArray(POSITIONS),
    ]


@pytest.mark.parametrize("number", range(len(in_layouts())))
def test_any_layout_gives_one_layout_and_is_not_changed(number: int) -> None:
    given = in_layouts()[number]
    before = given.copy()
    mesh = Mesh(given, TWO)
    assert np.array_equal(mesh.positions, POSITIONS)
    assert mesh.positions.dtype == np.float64
    assert mesh.positions.flags.c_contiguous
    assert mesh.positions.flags.aligned
    assert not mesh.positions.flags.writeable
    assert not np.shares_memory(mesh.positions, given)
    assert type(mesh.positions) is np.ndarray
    assert np.array_equal(given, before)


def test_a_mesh_owns_what_it_holds() -> None:
    triangles = np.array(TWO, dtype=np.int32)
    color = np.full((4, 4), 7, dtype=np.uint8)
    mesh = Mesh(POSITIONS, triangles, attributes={"color": color})
    for held, given in ((mesh.positions, POSITIONS), (mesh.triangles, triangles), (mesh.attributes["color"], color)):
        assert not np.shares_memory(held, given)
        assert not held.flags.writeable
    again = Mesh(mesh.positions, mesh.triangles, attributes=mesh.attributes)
    assert np.array_equal(again.positions, POSITIONS)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.uint32, np.int64, np.uint64, np.float32, ">i4"])
def test_any_type_of_index(dtype: Any) -> None:
    mesh = Mesh(SQUARE, np.array(TWO, dtype=dtype))
    assert mesh.triangles.dtype == np.int32
    assert mesh.triangles.tolist() == [list(row) for row in TWO]


def test_defaults() -> None:
    mesh = Mesh(SQUARE, TWO)
    assert mesh.source.tolist() == [0, 1]
    assert mesh.source.dtype == np.int32
    assert mesh.inner.tolist() == [0, 0]
    assert mesh.inner.dtype == np.uint8
    assert mesh.face_count == 2
    assert not mesh.attributes
    assert not mesh.corners


@pytest.mark.parametrize("empty", [[], np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=bool)])
def test_no_triangle_is_legal(empty: Any) -> None:
    mesh = Mesh(SQUARE, empty)
    assert mesh.triangles.shape == (0, 3)
    assert mesh.face_count == 0
    assert np.isnan(mesh.bounds).all()
    assert Mesh([], []).positions.shape == (0, 3)


def test_bounds_are_of_the_vertices_that_are_used() -> None:
    mesh = Mesh([*SQUARE, (NAN, INF, 9)], TWO)
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]


def test_a_mesh_is_frozen_and_shows_itself() -> None:
    mesh = Mesh(SQUARE, TWO, source=[0, 0])
    assert repr(mesh) == "Mesh(4 vertices, 2 triangles, 1 face)"
    with pytest.raises(AttributeError):
        mesh.positions = POSITIONS  # type: ignore[misc]
    with pytest.raises(TypeError):
        mesh.attributes["color"] = POSITIONS  # type: ignore[index]


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))])
def test_a_mesh_can_be_sent_to_another_process(duplicate: Callable[[Mesh], Mesh]) -> None:
    mesh = Mesh(SQUARE, TWO, attributes={"uv": np.ones((4, 2))}, corners={"heat": np.ones((2, 3))})
    other = duplicate(mesh)
    assert np.array_equal(other.triangles, mesh.triangles)
    assert np.array_equal(other.attributes["uv"], mesh.attributes["uv"])
    assert other.corners["heat"].shape == (2, 3, 1)


def test_attributes_have_the_type_of_their_name() -> None:
    mesh = Mesh(
        SQUARE,
        TWO,
        attributes={
            "normal": np.ones((4, 3)),
            "uv": np.ones((4, 2), np.float32),
            "color": np.ones((4, 3)),
            "heat": np.arange(4),
        },
        corners={"color": np.full((2, 3, 3), 128)},
    )
    assert mesh.attributes["normal"].dtype == np.float32
    assert mesh.attributes["uv"].dtype == np.float64
    assert mesh.attributes["color"].dtype == np.float32
    assert mesh.attributes["heat"].shape == (4, 1)
    assert mesh.corners["color"].dtype == np.uint8
    assert mesh.corners["color"][0, 0].tolist() == [128, 128, 128, 255]


@pytest.mark.parametrize(
    ("positions", "triangles", "options", "message"),
    [
        (SQUARE, [(0, 1, 2), (0, 2, 9)], {}, r"triangles\[1\] = \(0, 2, 9\): vertex 9 does not exist, there are 4"),
        (SQUARE, [(0, 1, -1)], {}, r"triangles\[0\] = \(0, 1, -1\): vertex -1 does not exist, there are 4"),
        (SQUARE, [(0, 1, 2**31)], {}, r"vertex 2147483648 does not exist, there are 4"),
        (SQUARE, [(0, 1, 2**64 + 1)], {}, r"triangles: 18446744073709551617 is beyond 2\^63"),
        (
            SQUARE,
            np.array([(0, 1, 2**64 - 1)], np.uint64),
            {},
            r"triangles\[0\] = \(0, 1, 18446744073709551615\): a number beyond 2",
        ),
        (SQUARE, [(0, 1, 1.5)], {}, r"triangles\[0\] = \(0.0, 1.0, 1.5\): expected whole numbers"),
        (SQUARE, [(0, 1, NAN)], {}, r"triangles\[0\] = \(0.0, 1.0, nan\): expected whole numbers"),
        (SQUARE, [(True, False, True)], {}, r"triangles: expected integers, got dtype bool"),
        (SQUARE, [(0, 1, 2, 3)], {}, r"triangles: expected shape \(N, 3\), got \(1, 4\)"),
        (SQUARE, [0, 1, 2], {}, r"triangles: expected shape \(N, 3\), got \(3,\)"),
        (SQUARE, [(0, 1), (1,)], {}, r"triangles: expected an array of numbers, "),
        (SQUARE, [("a", "b", "c")], {}, r"triangles: expected an array of numbers, got dtype <U1, such as 'a'"),
        (SQUARE, None, {}, r"triangles: expected an array of numbers, got dtype object, such as 'None'"),
        (SQUARE, [(1j, 0, 0)], {}, r"triangles: expected an array of numbers, got dtype complex128"),
        ([(0, 0), (1, 1)], [], {}, r"positions: expected shape \(N, 3\), got \(2, 2\)"),
        (5, [], {}, r"positions: expected shape \(N, 3\), got \(\)"),
        (np.ma.MaskedArray(SQUARE, np.eye(4, 3)), [], {}, r"positions: a masked array with 3 masked entries cannot be used"),
        (
            [*SQUARE, (1, NAN, 0)],
            [(0, 1, 2), (0, 1, 4)],
            {},
            r"positions\[4\] = \(1.0, nan, 0.0\): a vertex that is used is not",
        ),
        ([*SQUARE, (INF, 0, 0)], [(4, 1, 2)], {}, r"positions\[4\] = \(inf, 0.0, 0.0\): a vertex that is used is not finite"),
        (SQUARE, TWO, {"source": [0]}, r"source: expected shape \(2,\), one face for each triangle, got \(1,\)"),
        (SQUARE, TWO, {"source": [1, 0]}, r"source\[1\] = 0: expected non-decreasing faces, the one before is 1"),
        (SQUARE, TWO, {"source": [-1, 0]}, r"source: faces are numbered 0 to 2\^31 - 1, got -1 to 0"),
        (SQUARE, TWO, {"inner": [0]}, r"inner: expected shape \(2,\), one mark for each triangle, got \(1,\)"),
        (SQUARE, TWO, {"inner": [0, 8]}, r"inner\[1\] = 8: expected three bits, 0..7"),
        (SQUARE, TWO, {"face_count": 1}, r"face_count = 1: expected a whole number, at least 2, which is what source names"),
        (SQUARE, TWO, {"face_count": 2.5}, r"face_count = 2.5: expected a whole number"),
        (SQUARE, TWO, {"nonfinite": "dorp"}, r"unknown value of nonfinite 'dorp'; did you mean 'drop'\?"),
        (SQUARE, TWO, {"attributes": {"uv": np.ones((3, 2))}}, r"attributes\['uv'\]: expected shape \(4, k\), got \(3, 2\)"),
        (SQUARE, TWO, {"attributes": {"uv": np.ones((4, 3))}}, r"attributes\['uv'\]: expected shape \(4, 2\), got \(4, 3\)"),
        (
            SQUARE,
            TWO,
            {"attributes": {"normal": np.ones((4, 2))}},
            r"attributes\['normal'\]: expected shape \(4, 3\), got \(4, 2\)",
        ),
        (
            SQUARE,
            TWO,
            {"attributes": {"color": np.ones((4, 2))}},
            r"attributes\['color'\]: expected shape \(4, 3\) or \(4, 4\), got",
        ),
        (
            SQUARE,
            TWO,
            {"attributes": {"color": np.full((4, 3), 1.5)}},
            r"color'\]\[0\]: 1.5 is no colour value, floats are 0..1",
        ),
        (
            SQUARE,
            TWO,
            {"attributes": {"color": np.full((4, 3), 256)}},
            r"color'\]\[0\]: 256 is no colour value, integers are 0..255",
        ),
        (SQUARE, TWO, {"attributes": {"color": np.full((4, 3), NAN)}}, r"nan is no colour value"),
        (
            SQUARE,
            TWO,
            {"attributes": {"color": np.ones((4, 3), bool)}},
            r"expected integers 0..255 or floats 0..1, got dtype bool",
        ),
        (SQUARE, TWO, {"attributes": {"": np.ones(4)}}, r"attributes: expected names that are text, got ''"),
        (SQUARE, TWO, {"corners": {"uv": np.ones((2, 2))}}, r"corners\['uv'\]: expected shape \(2, 3, k\), got \(2, 2\)"),
    ],
)
def test_bad_input_is_quoted(positions: Any, triangles: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        Mesh(positions, triangles, **options)
    assert "\n" not in str(caught.value)


def test_dropped_faces_go_whole_and_the_others_keep_their_numbers() -> None:
    positions = [*SQUARE, (2, 0, 0), (2, NAN, 0), (9, 9, 9)]
    faces = [(0, 1, 2, 3), (4, 5, 2, 1), (0, 1, 6)]
    mesh = Mesh.from_polygons(positions, faces, corners={"heat": np.arange(11)}, nonfinite="drop")
    assert mesh.source.tolist() == [0, 0, 2]
    assert mesh.face_count == 3
    assert mesh.corners["heat"][..., 0].tolist() == [[0, 1, 2], [0, 2, 3], [8, 9, 10]]
    with pytest.raises(InputError, match=r"positions\[5\] = \(2.0, nan, 0.0\): a vertex that is used is not finite"):
        Mesh.from_polygons(positions, faces)


def test_polygons_of_all_sizes_become_triangles() -> None:
    mesh = Mesh.from_polygons(SQUARE, [(0, 1, 2, 3), (0, 1), np.array([0, 2, 3])])
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 2, 3]]
    assert mesh.source.tolist() == [0, 0, 2]
    assert mesh.face_count == 3
    assert mesh.inner.tolist() == [0b010, 0b100, 0]
    assert Mesh.from_polygons(SQUARE, np.array([[0, 1, 2, 3]])).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert Mesh.from_polygons(SQUARE, []).face_count == 0


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([(0, 1, 2), (0, 1, 2, 4)], r"faces\[1\] = \(0, 1, 2, 4\): vertex 4 does not exist, there are 4"),
        ([(0, 1, -1)], r"faces\[0\] = \(0, 1, -1\): vertex -1 does not exist, there are 4"),
        ([(0, 1, 2.5)], r"faces\[0\] = \(0, 1, 2.5\): expected whole numbers"),
        ([(0, 1, NAN)], r"faces\[0\] = \(0, 1, nan\): expected whole numbers"),
        ([(0, 1, 2**70)], r"faces\[0\] = .*: expected whole numbers"),
        ([(0, 1, "2")], r"faces\[0\] = \(0, 1, '2'\): expected vertex numbers"),
        ([0, 1, 2], r"faces: expected sequences of vertex numbers, got \[0, 1, 2\]"),
        (np.arange(3), r"faces: expected one row of vertices for each face, got shape \(3,\)"),
    ],
)
def test_bad_faces_are_quoted(faces: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Mesh.from_polygons(SQUARE, faces)


def test_a_mesh_like_object_of_another_library() -> None:
    visual = SimpleNamespace(kind="face", face_colors=np.array([(255, 0, 0, 255), (0, 255, 0, 255)], np.uint8))
    mesh = Mesh.from_trimesh(SimpleNamespace(vertices=np.array(SQUARE), faces=np.array(TWO), visual=visual))
    assert mesh.triangles.tolist() == [list(row) for row in TWO]
    assert mesh.corners["color"][1, 2].tolist() == [0, 255, 0, 255]
    with pytest.raises(InputError, match="mesh: expected an object with vertices and faces, got int"):
        Mesh.from_trimesh(5)


def test_trimesh_itself() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    assert "normal" not in Mesh.from_trimesh(box).attributes
    box.visual.vertex_colors = np.full((8, 4), 9, np.uint8)
    mesh = Mesh.from_trimesh(box)
    assert mesh.bounds.tolist() == [[-0.5] * 3, [0.5] * 3]
    assert mesh.attributes["color"].tolist() == [[9, 9, 9, 9]] * 8


def test_segments_and_points() -> None:
    segments = Segments([*SQUARE, (NAN, 0, 0)], [(0, 1), (1, 4)], colors=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], nonfinite="drop")
    assert segments.segments.tolist() == [[0, 1]]
    assert segments.colors is not None
    assert segments.colors.tolist() == [[1.0, 0.0, 0.0, 1.0]]
    assert segments.bounds.tolist() == [[0, 0, 0], [1, 0, 0]]
    points = Points([*SQUARE, (NAN, 0, 0)], colors=np.arange(15).reshape(5, 3), size=2.5, nonfinite="drop")
    assert points.colors is not None
    assert points.colors.shape == (4, 4)
    assert points.size == 2.5
    assert repr(points) == "Points(4 points)"
    assert np.isnan(Points([]).bounds).all()


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Segments(SQUARE, [(0, 4)]), r"segments\[0\] = \(0, 4\): vertex 4 does not exist, there are 4"),
        (
            lambda: Segments([(NAN, 0, 0), (0, 0, 0)], [(0, 1)]),
            r"positions\[0\] = \(nan, 0.0, 0.0\): a position that is used is not",
        ),
        (lambda: Segments(SQUARE, [(0, 1)], width=0), "width = 0: expected a number of pixels above 0"),
        (lambda: Segments(SQUARE, [(0, 1)], width=NAN), "width = nan: expected a number of pixels above 0"),
        (lambda: Segments(SQUARE, [(0, 1)], width="wide"), "width = 'wide': expected a number of pixels"),  # type: ignore[arg-type]
        (
            lambda: Segments(SQUARE, [(0, 1)], colors=np.ones((3, 4))),
            r"colors: expected shape \(4,\) or \(N, 4\) with N = 1 or 4, got",
        ),
        (lambda: Segments(SQUARE, [(0, 1)], nonfinite="no"), "unknown value of nonfinite 'no'"),
        (lambda: Points([(0, INF, 0)]), r"positions\[0\] = \(0.0, inf, 0.0\): a point is not finite"),
        (lambda: Points(SQUARE, size=-1), "size = -1: expected a number of pixels above 0"),
        (lambda: Points(SQUARE, size=True), "size = True: expected a number of pixels above 0"),
        (lambda: Points(SQUARE, nonfinite=""), "unknown value of nonfinite ''"),
    ],
)
def test_bad_segments_and_points_are_quoted(build: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        build()


def test_textures_come_to_bytes_with_alpha() -> None:
    grey = Texture(np.array([[0, 128]]), wrap=("clamp", "mirror"))
    assert grey.image.tolist() == [[[0, 0, 0, 255], [128, 128, 128, 255]]]
    assert grey.size == (2, 1)
    assert repr(grey) == "Texture(2 x 1, bilinear, clamp/mirror)"
    assert Texture(np.full((1, 1, 4), 0.5)).image.tolist() == [[[128, 128, 128, 128]]]
    image = np.zeros((2, 2, 4), np.uint8)
    assert Texture(image).image is image


def test_material_keeps_floats() -> None:
    material = Material("m", (0, 0.5, 1), Texture([[0]]), double_sided=False)
    assert material.base_color == (0.0, 0.5, 1.0, 1.0)
    assert not material.double_sided
    assert Material().base_color is None


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Texture([[0]], filter="linear"), "unknown texture filter 'linear'; did you mean 'bilinear'"),
        (lambda: Texture([[0]], wrap="mirrored"), "unknown texture wrap 'mirrored'; did you mean 'mirror'"),
        (lambda: Texture([[0]], wrap=("clamp",)), r"wrap: expected one name or two, for u and v, got \('clamp',\)"),
        (lambda: Texture(np.zeros((0, 4))), r"image: expected shape \(h, w\), \(h, w, 3\) or \(h, w, 4\), none of them 0"),
        (lambda: Texture(np.zeros((2, 2, 2))), r"image: expected shape"),
        (lambda: Texture([[1.5]]), "image: expected integers 0..255 or floats 0..1"),
        (lambda: Texture([[NAN]]), "image: expected integers 0..255 or floats 0..1"),
        (lambda: Texture([[True]]), "image: expected integers 0..255 or floats 0..1"),
        (lambda: Texture([["x"]]), "image: expected an array of numbers"),
        (lambda: Material(base_color=(1.0, 1.0)), r"base_color: expected three or four floats 0..1, got \(1.0, 1.0\)"),  # type: ignore[arg-type]
        (lambda: Material(base_color=(1.0, 1.0, 2.0, 1.0)), r"base_color = \(1.0, 1.0, 2.0, 1.0\): expected floats 0..1"),
        (lambda: Material(base_color=(1.0, NAN, 1.0, 1.0)), "expected floats 0..1"),
        (lambda: Material(texture="x.png"), "texture: expected a Texture or None, got str"),  # type: ignore[arg-type]
        (lambda: Material(name=3), "name: expected text, got 3"),  # type: ignore[arg-type]
    ],
)
def test_bad_materials_are_quoted(build: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        build()


def test_a_texture_beyond_the_limit_is_refused_before_it_is_copied() -> None:
    huge = np.broadcast_to(np.uint8(0), (60_000, 60_000, 4))
    with pytest.raises(LimitError, match=r"image: 60000 x 60000 pixels are more than the limit of 67108864 \(max_pixels\)"):
        Texture(huge)


def test_linear_light_is_encoded_as_the_standard_says() -> None:
    assert linear_to_srgb([0.0, 1.0, 2.0, -1.0]).tolist() == [0.0, 1.0, 1.0, 0.0]
    assert linear_to_srgb(0.0031308) == pytest.approx(0.04045, abs=1e-5)
    assert linear_to_srgb(0.214041) == pytest.approx(0.5, abs=1e-6)
