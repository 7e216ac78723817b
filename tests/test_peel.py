"""Translucent surfaces: layers against an oracle that sorts every sample's surfaces by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.errors import InputError
from scanspan.shade.color import LINEAR_FROM_SRGB8, encode_srgb, linear_color
from scanspan.target import peel

CAMERA = ss.Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), height=2)
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def sheet(z: float, color: Any, **options: Any) -> ss.Instance:
    """A square that fills the picture, at some height, in its plain colour."""
    place = np.eye(4)
    place[2, 3] = z
    mesh = ss.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)])
    return ss.Instance(mesh, place, ss.Material("", color, is_lit=False, **options))


def middle(instances: Any, size: tuple[int, int] = (5, 5), **options: Any) -> list[int]:
    """The colour in the middle of a picture."""
    frame = ss.render(ss.Scene(instances), CAMERA, size, **{"samples": 1, "background": "black", **options})
    return np.asarray(frame.color[size[1] // 2, size[0] // 2]).tolist()


def over(*colors: Any) -> list[int]:
    """Colours laid over black, the nearest first."""
    total, through = np.zeros(3), 1.0
    for color in colors:
        light = linear_color(color).astype(float)
        total, through = total + through * light[3] * light[:3], through * (1 - light[3])
    return [*np.asarray(encode_srgb(total.astype(np.float32))).tolist(), 255]


RED, GREEN, BLUE = (0.9, 0.2, 0.1, 0.5), (0.1, 0.8, 0.2, 0.25), (0.2, 0.3, 0.9, 0.75)
WALL = (0.7, 0.7, 0.6, 1.0)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2)])
def test_layers_are_laid_over_each_other_whatever_their_order(order: tuple[int, ...]) -> None:
    sheets = [sheet(0.9, RED), sheet(0.5, GREEN), sheet(0.1, BLUE), sheet(-0.5, WALL)]
    assert middle([sheets[k] for k in order]) == over(RED, GREEN, BLUE, WALL)
    assert middle([sheets[k] for k in order if k != 3]) == over(RED, GREEN, BLUE)
    assert middle([*(sheets[k] for k in order), sheet(0.7, WALL)]) == over(RED, WALL)


def test_of_equal_depths_the_lower_number_lies_in_front() -> None:
    assert middle([sheet(0, RED), sheet(0, GREEN)]) == over(RED, GREEN)
    assert middle([sheet(0, GREEN), sheet(0, RED)]) == over(GREEN, RED)
    assert middle([sheet(0, WALL), sheet(0, RED)]) == over(WALL)
    assert middle([sheet(0, RED), sheet(0, WALL)]) == over(RED, WALL)


def test_without_blending_alpha_is_not_seen() -> None:
    sheets = [sheet(0.9, RED), sheet(-0.5, WALL)]
    assert middle(sheets, translucency=False) == over((*RED[:3], 1.0))
    frame = ss.render(ss.Scene(sheets), CAMERA, (5, 5))
    assert (frame.object == 0).all()
    with pytest.raises(InputError, match="translucency = 1: must be True or False"):
        ss.render(ss.Scene(sheets), translucency=1)  # type: ignore[call-overload]


def test_a_transparent_background_keeps_the_alpha() -> None:
    red, green, blue, alpha = middle([sheet(0, RED)], background="transparent")
    assert alpha == 128
    assert np.abs(np.array([red, green, blue]) - encode_srgb(linear_color(RED)[:3])).max() <= 1


def random_scene(rng: np.random.Generator) -> ss.Scene:
    """Triangles that go through each other, opaque and not, with letters' rings, lines and points among them."""
    instances: list[Any] = []
    for _ in range(24):
        color = (*rng.random(3).tolist(), float(rng.choice([0.0, 0.3, 0.6, 1.0])))
        material = ss.Material("", color, is_lit=False)
        instances.append(ss.Instance(ss.Mesh(rng.uniform(-1.2, 1.2, (3, 3)), [(0, 1, 2)]), material=material))
    ring = [(-0.8, -0.8, 0.1), (0.8, -0.7, 0.1), (0.7, 0.8, 0.1), (-0.6, 0.7, 0.1)]
    hole = [(-0.3, -0.3, 0.1), (0.3, -0.3, 0.1), (0.0, 0.4, 0.1)]
    instances.insert(5, ss.Instance(ss.Polygons([[ring, hole]]), material=ss.Material("", (0, 1, 1, 0.4), is_lit=False)))
    lines = ss.Segments(rng.uniform(-1, 1, (6, 3)), [(0, 1), (2, 3), (4, 5)], (255, 0, 0, 100), 3.0)
    instances.insert(9, ss.Instance(lines, material=ss.Material("", (1, 1, 1, 1), is_lit=False)))
    return ss.Scene(instances)


def sorted_oracle(scene: ss.Scene, size: tuple[int, int]) -> np.ndarray:
    """Each instance rendered by itself, and its surfaces at each pixel sorted by depth, then number."""
    frames = [
        ss.render(ss.Scene(one), CAMERA, size, samples=1, translucency=False, background="black") for one in scene.instances
    ]
    depth = np.array([frame.depth for frame in frames])
    color = np.array([linear_rows(frame.color) for frame in frames])
    alpha = np.array([alpha_of(one) for one in scene.instances])
    total, through = np.zeros((*depth.shape[1:], 3)), np.ones(depth.shape[1:])
    order = np.argsort(depth, axis=0, kind="stable")
    for rank in order:
        near = np.take_along_axis(depth, rank[None], 0)[0] < np.inf
        share = through * alpha[rank] * near
        total += share[..., None] * np.take_along_axis(color, rank[None, ..., None], 0)[0]
        through = through - share
    return total


def linear_rows(codes: np.ndarray) -> np.ndarray:
    """Linear light of 8-bit colours."""
    return LINEAR_FROM_SRGB8[codes[..., :3]].astype(np.float64)


def alpha_of(instance: ss.Instance) -> float:
    """The alpha of an instance of one colour."""
    colors = getattr(instance.geometry, "colors", None)
    own = 1.0 if colors is None or np.shape(colors)[-1] < 4 else float(np.ravel(colors)[3]) / 255.0
    return instance.material.color_of(False)[3] * own


def test_every_sample_is_sorted_by_itself(rng: np.random.Generator) -> None:
    for _ in range(3):
        scene = random_scene(rng)
        picture = ss.render(scene, CAMERA, (40, 30), samples=1, background="black").color
        expected = encode_srgb(sorted_oracle(scene, (40, 30)).astype(np.float32))
        assert np.abs(picture[..., :3].astype(int) - expected).max() <= 3  # each oracle frame was rounded to 8 bits


@pytest.mark.parametrize("algorithm", ["homogeneous", "edge-walk", "scanline-eval", "span-list", "warnock", "micropolygon"])
def test_the_picture_is_the_same_for_any_algorithm(algorithm: str, rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    one = ss.render(scene, CAMERA, (32, 24), samples=2).color
    assert np.array_equal(ss.render(scene, CAMERA, (32, 24), samples=2, algorithm=algorithm).color, one)


def test_the_picture_is_the_same_for_any_number_of_threads_and_in_a_file(rng: np.random.Generator, tmp_path: Path) -> None:
    scene = random_scene(rng)
    one = ss.render(scene, "iso", (600, 500), samples=1, threads=1).color
    assert np.array_equal(ss.render(scene, "iso", (600, 500), samples=1, threads=4).color, one)
    path = ss.render(scene, "iso", (600, 500), samples=1, out=tmp_path / "rows.npy")
    assert np.array_equal(np.load(path), one)


def test_what_lies_farther_than_the_last_layer_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peel, "MAX_LAYERS", 2)
    assert middle([sheet(0.9, RED), sheet(0.5, GREEN), sheet(0.1, BLUE), sheet(-0.5, WALL)]) == over(RED, GREEN, WALL)


def test_textures_and_colours_of_a_mesh_may_be_translucent() -> None:
    pixels = np.full((1, 1, 4), (10, 200, 30, 128), np.uint8)
    mesh = ss.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)], attributes={"uv": np.zeros((4, 2))})
    textured = ss.Instance(mesh, material=ss.Material("", (1, 1, 1), ss.Texture(pixels), is_lit=False))
    expected = over((10 / 255, 200 / 255, 30 / 255, 128 / 255), WALL)
    assert np.abs(np.array(middle([textured, sheet(-0.5, WALL)])) - expected).max() <= 1
    assert middle([textured, sheet(-0.5, WALL)], textures=False) == [255] * 4
    colored = ss.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)], attributes={"color": np.full((4, 4), (10, 200, 30, 128), np.uint8)})
    found = middle([ss.Instance(colored, material=ss.Material("", (1, 1, 1), is_lit=False)), sheet(-0.5, WALL)])
    assert np.abs(np.array(found) - expected).max() <= 1


def test_the_kernels_do_the_same_uncompiled(rng: np.random.Generator) -> None:
    slot = rng.integers(-1, 4, (6, 7)).astype(np.int32)
    depth = np.where(slot < 0, -np.inf, rng.normal(size=slot.shape)).astype(np.float32)
    rank, rows = np.array([0, 1, 1, 2], np.int32), np.array([1, 3, 4], np.int32)
    found = []
    for start, following in (
        (peel.start_kernel, peel.next_kernel),
        (peel.start_kernel.py_func, peel.next_kernel.py_func),  # type: ignore[attr-defined]
    ):
        floor, target, layer = np.empty((6, 7), np.int64), np.empty((6, 7, 2), np.int64), np.empty((6, 7), np.int32)
        start(slot, depth, rank, floor, target)
        target[::2, :, 0] += np.int64(1) << 33
        target[::2, :, 0] |= np.int64(0xFFFFFFFF)
        count = following(target, floor, rows, layer)
        found.append((floor, target, layer, np.array(count)))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)
