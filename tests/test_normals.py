"""Normals: welding, creases, weights, polygons, degenerate triangles, and speed where many corners meet."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from scanspan.shade import normals
from scanspan.shade.normals import angle_of_cosine, corner_normals, face_normals

Array = npt.NDArray[np.float64]

CUBE_POINTS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def triangulate(quads: npt.NDArray[np.int64], other_way: bool = False) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Cut quads along either diagonal."""
    cut = ([0, 1, 3], [1, 2, 3]) if other_way else ([0, 1, 2], [0, 2, 3])
    triangles = np.concatenate([quads[:, [part]].reshape(-1, 3) for part in cut]).astype(np.int32)
    return triangles, np.tile(np.arange(len(quads), dtype=np.int32), 2)


def soup(points: Array, triangles: npt.NDArray[np.int32]) -> tuple[Array, npt.NDArray[np.int32]]:
    """Store every corner by itself, as STL does."""
    return points[triangles.reshape(-1)], np.arange(triangles.size, dtype=np.int32).reshape(-1, 3)


def sphere(steps: int) -> tuple[Array, npt.NDArray[np.int32]]:
    """Make a ball of quads cut in two, without its poles."""
    u, v = np.meshgrid(np.arange(2 * steps), np.arange(1, steps), indexing="ij")
    turn, tilt = np.pi * u / steps, np.pi * v / steps
    points = np.stack([np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(2 * steps), np.arange(steps - 2), indexing="ij")
    width = steps - 1
    a, b = i * width + j, (i + 1) % (2 * steps) * width + j
    quads = np.stack([a, a + 1, b + 1, b], axis=-1).reshape(-1, 4)
    return points, triangulate(quads)[0]


def test_face_normals_of_a_cube_point_outwards() -> None:
    triangles, source = triangulate(CUBE_QUADS)
    expected = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]])
    found = face_normals(CUBE_POINTS, triangles)
    assert found.dtype == np.float32
    assert np.array_equal(found, expected[source])


@pytest.mark.parametrize("stored", ["shared", "apart"])
@pytest.mark.parametrize("crease", [0.0, 30.0, 89.999])
def test_a_cube_stays_sharp_below_ninety_degrees(stored: str, crease: float) -> None:
    triangles, source = triangulate(CUBE_QUADS)
    points, corners = (CUBE_POINTS, triangles) if stored == "shared" else soup(CUBE_POINTS, triangles)
    found = corner_normals(points, corners, source, crease)
    assert np.array_equal(found, np.repeat(face_normals(CUBE_POINTS, triangles)[:, None], 3, axis=1))


@pytest.mark.parametrize("stored", ["shared", "apart"])
@pytest.mark.parametrize("other_way", [False, True])
@pytest.mark.parametrize("as_faces", [False, True])
@pytest.mark.parametrize("crease", [90.001, 180.0])
def test_a_smooth_cube_points_along_its_diagonals_however_it_is_cut(
    stored: str, other_way: bool, as_faces: bool, crease: float
) -> None:
    triangles, source = triangulate(CUBE_QUADS, other_way)
    points, corners = (CUBE_POINTS, triangles) if stored == "shared" else soup(CUBE_POINTS, triangles)
    found = corner_normals(points, corners, source if as_faces else np.arange(len(triangles)), crease)
    expected = (CUBE_POINTS[triangles] * 2 - 1) / np.sqrt(3)
    assert np.abs(found - expected).max() < 1e-6


def test_a_ball_is_smooth_and_its_normals_point_along_its_radii() -> None:
    points, triangles = sphere(40)
    found = corner_normals(points, triangles, np.arange(len(triangles)))
    inner = np.abs(points[triangles][..., 2]) < 0.9
    assert np.abs(found - points[triangles])[inner].max() < 2e-3
    apart, corners = soup(points, triangles)
    assert np.abs(corner_normals(apart, corners, np.arange(len(triangles))) - found).max() < 1e-6


@pytest.mark.parametrize("fold", [10.0, 29.9, 30.1, 120.0])
def test_the_crease_angle_decides_which_edges_are_sharp(fold: float) -> None:
    turn = np.radians(fold)
    points = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [np.cos(turn), 0, -np.sin(turn)]])
    triangles = np.array([[0, 1, 2], [0, 3, 1]], dtype=np.int32)
    flat = face_normals(points, triangles)
    assert np.degrees(np.arccos(np.clip(flat[0] @ flat[1], -1, 1))) == pytest.approx(fold, abs=1e-3)
    found = corner_normals(points, triangles, np.arange(2), 30.0)
    assert np.array_equal(found[0, 0], found[1, 0]) == (fold < 30)
    assert np.array_equal(found[0, 0], flat[0]) == (fold > 30)
    assert np.array_equal(found[0, 2], flat[0])


def test_the_pieces_of_a_face_share_its_normal_even_when_flat() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]])
    triangles, source = triangulate(np.array([[0, 1, 2, 3]]))
    found = corner_normals(points, triangles, source, 0.0).reshape(-1, 3)
    assert (found == found[0]).all()
    assert not np.array_equal(found[0], face_normals(points, triangles)[0])


@pytest.mark.parametrize("numbers", [[7, 7], [-3, -3], [2**40, 2**40]])
def test_faces_may_have_any_numbers(numbers: list[int]) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]])
    triangles, source = triangulate(np.array([[0, 1, 2, 3]]))
    expected = corner_normals(points, triangles, source)
    assert np.array_equal(corner_normals(points, triangles, np.array(numbers)), expected)


def test_minus_zero_is_zero_and_positions_a_bit_apart_are_two() -> None:
    triangles, source = triangulate(CUBE_QUADS)
    points, corners = soup(CUBE_POINTS, triangles)
    signed = points.copy()
    signed[::2][signed[::2] == 0] = -0.0
    smooth = corner_normals(points, corners, source, 180.0)
    assert np.array_equal(corner_normals(signed, corners, source, 180.0), smooth)
    signed[0, 0] = 1e-300
    assert not np.array_equal(corner_normals(signed, corners, source, 180.0), smooth)


def test_welding_finds_exactly_the_equal_positions(rng: np.random.Generator) -> None:
    points = rng.integers(-3, 4, (3000, 3)) * 0.1 + 0.0
    table, first = np.full(8192, -1, dtype=np.int32), np.empty(3000, dtype=np.int32)
    normals.weld(points.view(np.int64), table, first)
    _, index, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    assert np.array_equal(first, index[inverse.reshape(-1)])


def test_triangles_without_area_change_nothing_and_give_no_nan() -> None:
    points, triangles = sphere(10)
    expected = corner_normals(points, triangles, np.arange(len(triangles)))
    bad = np.array([[0, 0, 0], [0, 1, 1], [5, 6, 5]], dtype=np.int32)
    both = np.concatenate([triangles, bad])
    found = corner_normals(points, both, np.arange(len(both)))
    assert np.array_equal(found[: len(triangles)], expected)
    assert np.isfinite(found).all()
    assert np.array_equal(face_normals(points, bad), np.zeros((3, 3)))


def test_points_that_are_not_finite_give_no_nan() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0], [np.inf, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 1, 3], [0, 4, 2]], dtype=np.int32)
    found = corner_normals(points, triangles, np.arange(3))
    assert np.isfinite(found).all()
    assert np.array_equal(found[0], [[0, 0, 1]] * 3)


@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1e160, 1e300])
def test_very_small_and_very_large_meshes_are_like_others(scale: float) -> None:
    points, triangles = sphere(8)
    expected = corner_normals(points, triangles, np.arange(len(triangles)))
    found = corner_normals(points * scale, triangles, np.arange(len(triangles)))
    assert np.abs(found - expected).max() < 1e-5


def test_two_sides_of_a_sheet_keep_their_own_normals_when_all_is_smooth() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    found = corner_normals(points, np.array([[0, 1, 2], [0, 2, 1]], dtype=np.int32), np.arange(2), 180.0)
    assert np.array_equal(found[:, 0], [[0, 0, 1], [0, 0, -1]])


def cone(count: int) -> tuple[Array, npt.NDArray[np.int32]]:
    """Make a cone without a base, its tip at vertex 0."""
    turn = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    k = np.arange(count)
    triangles = np.stack([np.zeros(count, dtype=int), 1 + k, 1 + (k + 1) % count], axis=1)
    return np.concatenate([[[0, 0, 1.0]], rim]), triangles.astype(np.int32)


def test_the_tip_of_a_cone_with_very_many_sides_takes_no_time_and_looks_like_one_with_few() -> None:
    points, triangles = cone(200_000)
    many = corner_normals(points, triangles, np.arange(len(triangles)))
    assert np.isfinite(many).all()
    few = corner_normals(*cone(64), np.arange(64))
    assert np.abs(many[::3125][:, 0] - few[:, 0]).max() < 0.08
    smooth = corner_normals(points, triangles, np.arange(len(triangles)), 180.0)
    assert np.abs(smooth[:, 0] - [0, 0, 1]).max() < 1e-4


def test_no_triangles_have_no_normals() -> None:
    none = np.zeros((0, 3), dtype=np.int32)
    assert corner_normals(CUBE_POINTS, none, np.zeros(0, dtype=np.int32)).shape == (0, 3, 3)
    assert face_normals(np.zeros((0, 3)), none).shape == (0, 3)


def test_the_arc_cosine_is_good_to_eight_digits() -> None:
    cosines = np.concatenate([np.linspace(-1, 1, 2001), [-1.0000001, 1.0000001]])
    found = np.array([angle_of_cosine(float(c)) for c in cosines])
    assert np.abs(found - np.arccos(np.clip(cosines, -1, 1))).max() < 3e-8


@pytest.mark.parametrize("degrees", [0.0, 1.0, 30.0, 60.0, 90.0, 150.0, 179.0])
def test_the_cosine_of_the_crease_is_exact_to_fifteen_digits(degrees: float) -> None:
    assert normals._least_cosine(degrees) == pytest.approx(np.cos(np.radians(degrees)), abs=1e-15)


def test_the_kernels_do_the_same_uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    points, triangles = sphere(6)
    tip, sides = cone(80)
    source = np.arange(len(triangles))
    expected = corner_normals(points, triangles, source), corner_normals(tip, sides, np.arange(80))
    for name, function in vars(normals).copy().items():
        if hasattr(function, "py_func"):
            monkeypatch.setattr(normals, name, function.py_func)
    assert np.array_equal(corner_normals(points, triangles, source), expected[0])
    assert np.array_equal(corner_normals(tip, sides, np.arange(80)), expected[1])
