"""Displacement: heights exact, seams closed, dicing by displaced edges, and every message of dicing."""

from __future__ import annotations

import doctest
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.dice import dice
from tests.test_dice import (
    ABOVE,
    NAN,
    QUAD,
    TWO,
    UV,
    assert_closed,
    cube,
    edge_counts,
    floor,
    icosahedron,
    pixel_lengths,
)


def test_a_plane_is_displaced_by_a_function() -> None:
    def wave(positions: Any, normals: Any, uv: Any) -> Any:
        assert uv is None
        assert np.array_equal(normals, np.tile([0.0, 0.0, 1.0], (len(positions), 1)))
        return 0.1 * np.sin(7 * positions[:, 0])

    diced = dice(floor(), ABOVE, (32, 32), displacement=wave)
    x, y, z = diced.positions.T
    assert np.array_equal(z, 0.1 * np.sin(7 * x))
    assert np.abs(z).max() > 0.09
    assert set(edge_counts(diced).values()) == {1}

    # Each vertex has the normal of the wave.
    slope = 0.7 * np.cos(7 * x)
    expected = np.stack([-slope, 0 * x, np.ones_like(x)], axis=1) / np.sqrt(1 + slope**2)[:, None]
    interior = (np.abs(x) < 0.99) & (np.abs(y) < 0.99)
    assert np.abs(diced.attributes["normal"] - expected)[interior].max() < 0.05


def test_a_displacement_may_be_offsets_or_whole_numbers() -> None:
    diced = dice(floor(), ABOVE, (16, 16), displacement=lambda p, n, uv: np.tile([1, 2, 3], (len(p), 1)))
    assert np.array_equal(diced.bounds, [(0, 1, 3), (2, 3, 3)])
    lifted = dice(floor(), ABOVE, (16, 16), displacement=lambda p, n, uv: np.ones(len(p), int))
    assert np.array_equal(lifted.bounds, [(-1, -1, 1), (1, 1, 1)])


def test_a_function_cannot_spoil_the_mesh() -> None:
    def spoil(positions: Any, normals: Any, uv: Any) -> Any:
        positions[:], normals[:], uv[:] = 5, 5, 5
        return np.zeros(len(positions))

    diced = dice(floor(attributes={"uv": UV}), ABOVE, (16, 16), displacement=spoil)
    assert np.array_equal(diced.bounds, [(-1, -1, 0), (1, 1, 0)])
    assert np.array_equal(diced.attributes["uv"], (diced.positions[:, :2] + 1) / 2)


@pytest.mark.parametrize("per_corner", [False, True])
def test_a_plane_is_displaced_by_an_image(per_corner: bool) -> None:
    # Row 0 is the top; texel centres lie at 1/8, 3/8, 5/8 and 7/8; beyond the last comes the first.
    heights = np.arange(16).reshape(4, 4) / 64
    mesh = floor(corners={"uv": UV[TWO]}) if per_corner else floor(attributes={"uv": UV})
    diced = dice(mesh, ABOVE, (32, 32), displacement=heights)
    u, v = diced.attributes["uv"].T
    assert np.array_equal(diced.positions[:, :2], np.stack([u, v], axis=1) * 2 - 1)
    for (x, y), z in zip(np.stack([u, v], axis=1) * 4 - 0.5, diced.positions[:, 2]):
        columns, rows = [int(np.floor(x)) % 4, int(np.floor(x) + 1) % 4], [int(np.floor(y)) % 4, int(np.floor(y) + 1) % 4]
        s, t = x - np.floor(x), y - np.floor(y)
        texels = [[heights[3 - r, c] for c in columns] for r in rows]
        assert z == pytest.approx(np.array([1 - t, t]) @ np.array(texels) @ np.array([1 - s, s]), abs=1e-12)


@pytest.mark.parametrize("normals", ["none", "vertices", "corners"])
def test_seams_and_hard_edges_stay_closed(normals: str) -> None:
    # Six sides with texture coordinates and vertices of their own, displaced by what fits nowhere along the seams.
    sides = np.repeat([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)], 4, axis=0)
    uv = np.tile(UV, (6, 1)) * 3 + np.arange(24)[:, None] / 7
    values = {"none": {}, "vertices": {"attributes": {"normal": sides, "uv": uv}},
              "corners": {"corners": {"normal": sides, "uv": uv}}}[normals]  # fmt: skip
    mesh, camera = cube(**values), ss.Camera.look_at((2, 3, 4), (0, 0, 0), fov=40)
    heights = np.random.default_rng(1).uniform(0, 0.2, (5, 7))
    displacement: Any = heights if normals != "none" else lambda p, n, uv: 0.2 * np.sin(9 * p[:, 0]) * np.cos(5 * p[:, 1])
    diced = dice(mesh, camera, (60, 60), pixels=4, displacement=displacement)
    assert np.abs(diced.positions).max() > 1.05
    assert_closed(diced)


def test_sheets_that_lie_on_one_another_go_their_own_ways() -> None:
    mesh = ss.Mesh([*QUAD, *QUAD], [*TWO, (6, 5, 4), (7, 6, 4)])
    diced = dice(mesh, ABOVE, (16, 16), displacement=lambda p, n, uv: np.full(len(p), 0.5))
    x, y, z = diced.positions.T
    assert set(z[(np.abs(x) < 1) & (np.abs(y) < 1)].tolist()) == {-0.5, 0.5}
    assert_closed(diced)


def test_normals_that_a_file_does_not_have_are_computed() -> None:
    ball, camera = icosahedron(), ss.Camera.look_at((0, 0, 4), (0, 0, 0))
    diced = dice(ball, camera, (40, 40), pixels=8, displacement=lambda p, n, uv: np.full(len(p), 0.5))
    assert_closed(diced)
    assert np.allclose(diced.positions[:12], 1.5 * ball.positions, atol=1e-6)
    partly = ss.Mesh(ball.positions, ball.triangles, attributes={"normal": ball.positions * (np.arange(12) > 3)[:, None]})
    again = dice(partly, camera, (40, 40), pixels=8, displacement=lambda p, n, uv: np.full(len(p), 0.5))
    assert np.allclose(again.positions[:12], diced.positions[:12], atol=1e-6)


def test_the_normal_of_a_corner_does_not_depend_on_how_its_faces_were_cut() -> None:
    camera = ss.Camera.look_at((0, 0, 9), (0, 0, 0))
    diced = dice(cube(), camera, (8, 8), pixels=100, displacement=lambda p, n, uv: np.ones(len(p)))
    assert np.allclose(diced.positions, cube().positions * (1 + 3**-0.5), atol=1e-3)


def test_a_steep_displacement_is_diced_by_its_own_edges() -> None:
    camera, size = ss.Camera.orthographic((0, -8, 3), (0, 0, 0), up=(0, 0, 1), height=3), (40, 40)
    diced = dice(floor(), camera, size, displacement=lambda p, n, uv: 0.3 * np.sin(8 * p[:, 0]))
    assert pixel_lengths(diced, camera, size).max() <= 2 * (1 + 1e-12)
    assert pixel_lengths(dice(floor(), camera, size), camera, size).max() <= 2
    assert len(diced.triangles) > len(dice(floor(), camera, size).triangles)


@pytest.mark.parametrize("kind", ["function", "image"])
def test_what_is_displaced_into_view_is_fine_too(kind: str) -> None:
    # The floor lies below the picture and is lifted into it.
    camera, size = ss.Camera.orthographic((0, -5, 4), (0, 0, 4), up=(0, 0, 1), height=2), (40, 40)
    displacement: Any = np.full((2, 2), 4.0) if kind == "image" else lambda p, n, uv: 4.0 + 0.5 * np.sin(3 * p[:, 0])
    assert len(dice(floor(), camera, size).triangles) == 2
    diced = dice(floor(attributes={"uv": UV}), camera, size, displacement=displacement)
    assert pixel_lengths(diced, camera, size).max() <= 2 * (1 + 1e-12)


def test_what_stays_behind_the_eye_is_left() -> None:
    # It moves far enough to come into view, but sideways.
    camera = ss.Camera.look_at((0, 0, -5), (0, 0, -9))
    diced = dice(floor(), camera, (64, 64), displacement=lambda p, n, uv: np.full((len(p), 3), (100.0, 0.0, 0.0)))
    assert len(diced.triangles) == 2


def test_light_falls_on_the_displaced_surface() -> None:
    # One face, so the normals have to come with the mesh: rendering computes one a face.
    camera, size = ABOVE, (40, 40)
    diced = dice(floor(), camera, size, displacement=lambda p, n, uv: 0.3 * np.sin(8 * p[:, 0]))
    normal = ss.render(diced, camera, size).normal
    assert normal[20, :, 0].min() < -0.5
    assert normal[20, :, 0].max() > 0.5


# Errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mesh": [1, 2]}, "mesh: expected a Mesh, got list"),
        ({"camera": "front"}, "camera = 'front': expected a Camera"),
        ({"size": (0, 8)}, "size = (0, 8): expected (width, height), two whole numbers above 0"),
        ({"size": 8}, "size = 8: expected (width, height), two whole numbers above 0"),
        ({"pixels": 0}, "pixels = 0.0: expected a length above 0"),
        ({"pixels": -2}, "pixels = -2.0: expected a length above 0"),
        ({"pixels": NAN}, "pixels = nan: expected a finite number"),
        ({"pixels": "2"}, "pixels = '2': expected a number, not type <U1"),
        ({"max_triangles": 0}, "max_triangles = 0: expected a whole number, 1 to 2^31 - 1"),
        ({"max_triangles": 2.5}, "max_triangles = 2.5: expected a whole number, 1 to 2^31 - 1"),
        ({"max_triangles": True}, "max_triangles = True: expected a whole number, 1 to 2^31 - 1"),
        (
            {"displacement": [1.0, 2.0]},
            "displacement: expected a function or heights of shape (H, W), got shape (2,) and type float64",
        ),
        (
            {"displacement": np.zeros((0, 3))},
            "displacement: expected a function or heights of shape (H, W), got shape (0, 3) and type float64",
        ),
        ({"displacement": "bumps"}, "displacement: expected an array of numbers, got dtype <U5, such as 'bumps'"),
        ({"displacement": [[0.0, 1.0], [NAN, 0.0]]}, "displacement[1, 0] = nan: expected a finite height"),
        (
            {"displacement": [[0.5]]},
            "displacement: an image of heights is looked up at texture coordinates, and the mesh has no 'uv'",
        ),
        ({"displacement": lambda p, n, uv: 1.0}, "what displacement returned: expected shape (4,) or (4, 3), got ()"),
        ({"displacement": lambda p, n, uv: p[:, :2]}, "what displacement returned: expected shape (4,) or (4, 3), got (4, 2)"),
        (
            {"displacement": lambda p, n, uv: None},
            "what displacement returned: expected an array of numbers, got dtype object, such as 'None'",
        ),
        (
            {"displacement": lambda p, n, uv: np.where(p[:, 0] > 0, np.inf, 0)},
            "displacement at (1.0, -1.0, 0.0) is inf: expected numbers within 1e+100",
        ),
        (
            {"displacement": lambda p, n, uv: np.where(p[:, :1] > 0, (0, NAN, 1), p)},
            "displacement at (1.0, -1.0, 0.0) is [0.0, nan, 1.0]: expected numbers within 1e+100",
        ),
        (
            {"displacement": lambda p, n, uv: np.where(p[:, 0] > 0, 1e101, 0)},
            "displacement at (1.0, -1.0, 0.0) is 1e+101: expected numbers within 1e+100",
        ),
    ],
)
def test_what_cannot_be_used_is_quoted(arguments: dict[str, Any], message: str) -> None:
    given = {"mesh": floor(), "camera": ABOVE, "size": (8, 8), "pixels": 100.0, **arguments}
    with pytest.raises(ss.InputError) as raised:
        dice(**given)
    assert str(raised.value) == message


@pytest.mark.parametrize(("pixels", "limit", "needed"), [(100, 1, 2), (1, 100, 147), (1e-9, 5000, 10**18)])
def test_too_many_triangles_are_refused(pixels: float, limit: int, needed: int) -> None:
    expected = f"dice: at least {needed} triangles for edges of {float(pixels)} pixels, the limit is max_triangles={limit}"
    for displacement in (None, lambda p, n, uv: p):
        with pytest.raises(ss.LimitError) as raised:
            dice(floor(), ABOVE, (8, 8), pixels=pixels, max_triangles=limit, displacement=displacement)
        assert str(raised.value) == expected


def test_the_limit_holds_for_what_displacement_adds() -> None:
    camera = ss.Camera.orthographic((0, -8, 3), (0, 0, 0), up=(0, 0, 1), height=3)
    plain = len(dice(floor(), camera, (40, 40)).triangles)
    with pytest.raises(ss.LimitError, match=f"the limit is max_triangles={plain}"):
        dice(floor(), camera, (40, 40), max_triangles=plain, displacement=lambda p, n, uv: np.sin(8 * p[:, 0]))


def test_the_example_in_the_documentation_runs(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ss, "dice", dice, raising=False)
    failed, tried = doctest.testfile(
        str(repository / "docs" / "displacement.md"), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE
    )
    assert tried > 5
    assert failed == 0
