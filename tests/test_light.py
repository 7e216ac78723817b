"""Light: a plain model in float64 as oracle, two sides, degenerate normals, and pictures that are neither burnt nor black."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from scanspan.assets.camera import Camera
from scanspan.errors import InputError
from scanspan.shade.color import encode_srgb, linear_color
from scanspan.shade.light import BLOCK, LANES, Lights, default_lights, light, turn_normals, weigh_lights

Array = npt.NDArray[Any]

VIEWS = {"iso": (1, 1, 1), "front": (0, 0, 1), "back": (0, 0, -1), "right": (1, 0, 0), "below": (1, -2, 1)}


def lights_from(eye: tuple[float, float, float], up: tuple[float, float, float] = (0, 1, 0)) -> Lights:
    return default_lights(Camera.look_at(eye, (0, 0, 0), up).view, up)


def lit(normals: Any, base: Any, viewers: Any, lights: Lights, two_sided: int = 1) -> Array:
    """Light samples through the kernel."""
    rows = np.array(normals, dtype=np.float32)
    out = np.full((len(rows), 4), np.nan, dtype=np.float32)
    base = np.ascontiguousarray(np.broadcast_to(np.array(base, dtype=np.float32), (len(rows), 4)))
    light(rows, base, np.array(viewers, dtype=np.float32).reshape(-1, 3), lights, two_sided, out)
    return out


def plain_model(normals: Array, base: Array, viewers: Array, lights: Lights, two_sided: int) -> Array:
    """The same light in float64, one formula after the other."""
    n = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    v = viewers / np.linalg.norm(viewers, axis=1, keepdims=True)
    if two_sided:
        facing = (n * v).sum(axis=1, keepdims=True)
        n = np.where(facing >= 0, n, np.where(facing > -0.3, n - 2 * facing * v, -n))
    sky = (0.5 + 0.5 * (n @ lights.up.astype(float)))[:, None]
    turned = np.clip(n @ lights.key_direction.astype(float), 0, None)[:, None]
    half = v + lights.key_direction
    half = half / np.linalg.norm(half, axis=1, keepdims=True)
    shine = np.clip((n * half).sum(axis=1, keepdims=True), 0, None) ** 32 * (turned > 0) * lights.gloss
    facing = np.clip((n * v).sum(axis=1, keepdims=True), 0, None)
    total = lights.ground + (lights.sky.astype(float) - lights.ground) * sky + lights.headlight * facing + lights.key * turned
    return np.concatenate([base[:, :3] * total + lights.key * shine, base[:, 3:]], axis=1)


@pytest.mark.parametrize("two_sided", [0, 1])
@pytest.mark.parametrize("count", [1, 255, 256, 257, 1000])
def test_the_kernel_is_the_plain_model(two_sided: int, count: int, rng: np.random.Generator) -> None:
    normals, viewers, base = rng.normal(size=(count, 3)), rng.normal(size=(count, 3)), rng.random((count, 4))
    lights = lights_from((1, 2, 3))
    expected = plain_model(normals, base, viewers, lights, two_sided)
    assert np.abs(lit(normals, base, viewers, lights, two_sided) - expected).max() < 2e-5
    if count > 1:
        expected = plain_model(normals, base, np.broadcast_to(viewers[:1], (count, 3)), lights, two_sided)
        assert np.abs(lit(normals, base, viewers[:1], lights, two_sided) - expected).max() < 2e-5


def test_base_may_be_overwritten_and_a_block_does_not_change_its_samples(rng: np.random.Generator) -> None:
    normals, viewers = rng.normal(size=(2, 700, 3)).astype(np.float32)
    base, lights = rng.random((700, 4)).astype(np.float32), lights_from((1, 2, 3))
    expected = lit(normals, base, viewers, lights)
    for part in (slice(0, 300), slice(300, 301), slice(301, 700)):
        assert np.array_equal(lit(normals[part], base[part], viewers[part].copy(), lights), expected[part])
    light(normals, base, viewers, lights, 1, base)
    assert np.array_equal(base, expected)


def test_the_length_of_a_direction_does_not_matter() -> None:
    lights, normal = lights_from((1, 1, 1)), np.array([0.2, 0.9, 0.4])
    expected = lit([normal], [1, 1, 1, 1], (1, 1, 1), lights)
    for scale in (1e-6, 64.0, 1e6):
        assert np.abs(lit([normal * scale], [1, 1, 1, 1], (scale, scale, scale), lights) - expected).max() < 1e-6


def test_two_sides_are_lit_alike_and_one_side_alone_is_not() -> None:
    lights = lights_from((1, 1, 1))
    normal = np.array([0.5, 0.7, 0.1])
    for two_sided in (0, 1):
        front, back = lit([normal, -normal], [1, 1, 1, 1], (1, 1, 1), lights, two_sided)
        assert np.array_equal(front, back) == bool(two_sided)


def test_normals_that_lean_back_at_an_outline_are_lit_from_their_own_side() -> None:
    """Across an outline the light changes gently, and does not jump to that of the far side."""
    lights, viewer = lights_from((0, 0, 1)), (0, 0, 1)
    before, after = lit([(1, 0, 0.02), (1, 0, -0.02)], [1, 1, 1, 1], viewer, lights)
    assert np.abs(before - after).max() < 1e-6


@pytest.mark.parametrize("normal", [(0, 0, 0), (np.nan, 0, 0), (np.inf, 0, 0), (1e-30, 0, 0)])
def test_a_normal_that_is_none_faces_the_viewer(normal: tuple[float, float, float]) -> None:
    lights = lights_from((1, 2, 3))
    out = lit([normal, (1, 2, 3)], [1, 1, 1, 1], (1, 2, 3), lights)
    assert np.isfinite(out).all()
    assert np.array_equal(out[0], out[1])


def test_alpha_goes_through() -> None:
    assert lit([(0, 0, 1)], [1, 1, 1, 0.25], (0, 0, 1), lights_from((0, 0, 1)))[0, 3] == 0.25


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("up", [(0, 1, 0), (0, 0.8, -0.6)])
def test_nothing_burns_out_and_nothing_is_black(view: str, up: tuple[float, float, float], rng: np.random.Generator) -> None:
    eye = VIEWS[view]
    normals = rng.normal(size=(20_000, 3))
    normals = normals[normals @ eye > 0]
    white = lit(normals, [1, 1, 1, 1], eye, lights_from(eye, up))[:, :3]
    assert white.max() <= 1
    assert white.max() > 0.8
    assert encode_srgb(white.min()) > 60


@pytest.mark.parametrize(("eye", "up"), [((1, 1, 1), (0, 1, 0)), ((1, 1, 1), (0, 0, 1)), ((1, -1, 1), (0, 1, 0))])
def test_three_sides_of_a_cube_differ_clearly(eye: tuple[int, int, int], up: tuple[int, int, int]) -> None:
    sides = np.eye(3) * eye
    codes = encode_srgb(lit(sides, linear_color((200, 196, 190)), eye, lights_from(eye, up)))[:, 1].astype(int)
    assert np.diff(np.sort(codes)).min() >= 20


def test_the_picture_is_lit_from_its_upper_left() -> None:
    lights = lights_from((0, 0, 1))
    normals = [(-0.6, 0, 0.8), (0.6, 0, 0.8), (0, 0.6, 0.8), (0, -0.6, 0.8)]
    left, right, top, bottom = lit(normals, [1, 1, 1, 1], (0, 0, 1), lights)[:, 1]
    assert left > right * 1.2
    assert top > bottom * 1.2


def test_the_kernels_do_the_same_uncompiled(rng: np.random.Generator) -> None:
    normals, viewers = rng.normal(size=(2, 40, 3)).astype(np.float32)
    normals[3] = 0
    base, lights = rng.random((40, 4)).astype(np.float32), lights_from((1, 2, 3))
    out = np.empty((40, 4), dtype=np.float32)
    light.py_func(normals, base, viewers, lights, 1, out)  # type: ignore[attr-defined]
    assert np.array_equal(out, lit(normals, base, viewers, lights))
    lanes = rng.normal(size=LANES * BLOCK).astype(np.float32)
    slow = lanes.copy()
    turn_normals(lanes, 1)
    weigh_lights(lanes, lights)
    turn_normals.py_func(slow, 1)  # type: ignore[attr-defined]
    weigh_lights.py_func(slow, lights)  # type: ignore[attr-defined]
    assert np.array_equal(lanes, slow)


@pytest.mark.parametrize(
    ("view", "up", "message"),
    [
        (np.eye(3), (0, 1, 0), "camera_view = array([[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]): "
         "expected numbers of shape (4, 4), not shape (3, 3)"),
        (np.eye(4), (0, np.nan, 0), "up[1] = nan: expected a finite number"),
    ],
)  # fmt: skip
def test_messages(view: Any, up: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        default_lights(view, up)
