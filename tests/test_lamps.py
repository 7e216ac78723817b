"""Lights of a scene: a plain model as oracle, who is reached, the way of choosing, and every message."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.light import Light
from scanspan.errors import InputError
from scanspan.shade.color import linear_color
from scanspan.shade.lamps import choose_lighting, gather_lamps, raise_to, shine_kernel

FLAT = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
FACES = [(0, 1, 2), (0, 2, 3)]
CAMERA = ss.Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), height=4)

SOME = [
    Light("directional", (1.0, 0.5, 0.2), 0.7, direction=(1, -2, -3)),
    Light("point", (0.3, 1.0, 1.0), 2.0, position=(0.5, 1.0, 2.0), attenuation=(1.0, 0.2, 0.1), instances=[0, 1]),
    Light("spot", intensity=3.0, position=(0, 0, 1), direction=(0.1, 0.2, -1), cutoff_angle=50.0, drop_off=7, instances=[1]),
    Light("spot", (1.0, 1.0, 0.0), position=(2, 0, 1), direction=(-1, 0, 0), cutoff_angle=180.0, attenuation=(0, 0, 0)),
    Light("ambient", (0.5, 0.5, 1.0), 0.4, instances=[0]),
]
MATERIALS = [
    ss.Material("", (0.8, 0.7, 0.6, 1.0), ambient_color=(0.2, 0.3, 0.4), specular_color=(0.5, 0.6, 0.7), shininess=0.1),
    ss.Material("", (0.3, 0.9, 0.5, 1.0)),
]


def two_squares(lights: list[Light]) -> ss.Scene:
    """Two instances of a square."""
    mesh = ss.Mesh(FLAT, FACES)
    return ss.Scene([ss.Instance(mesh, material=material) for material in MATERIALS], lights=lights)


def light_of(color: Any) -> np.ndarray:
    """A colour as linear light."""
    return linear_color((*color, 1.0))[:3].astype(np.float64)


def plain_model(normal: Any, position: Any, viewer: Any, base: Any, lights: list[Light], k: int) -> np.ndarray:
    """One sample of instance k in float64, one light after the other."""
    n, v = (np.asarray(way, float) / np.linalg.norm(way) for way in (normal, viewer))
    facing = n @ v
    n = n if facing >= 0 else n - 2 * facing * v if facing > -0.3 else -n
    material, total = MATERIALS[k], np.zeros(3)
    specular = np.zeros(3) if material.specular_color is None else light_of(material.specular_color)
    for one in lights:
        if one.instances is not None and k not in one.instances:
            continue
        color = light_of(one.color) * one.intensity
        if one.kind == "ambient":
            total += color * (np.asarray(base) if material.ambient_color is None else light_of(material.ambient_color))
            continue
        share, way = 1.0, -one.direction
        if one.kind != "directional":
            way = one.position - position
            d = np.linalg.norm(way)
            way = way / d
            lost = one.attenuation @ (1.0, d, d * d)
            share = 1.0 / lost if lost > 0 else 1.0
        if one.kind == "spot" and one.cutoff_angle < 180.0:
            along = -way @ one.direction
            share *= along**one.drop_off if along >= np.cos(np.radians(one.cutoff_angle)) else 0.0
        turned = max(n @ way, 0.0)
        if turned > 0.0 and share > 0.0:
            half = (v + way) / np.linalg.norm(v + way)
            shine = max(n @ half, 0.0) ** round(material.shininess * 128)
            total += color * share * (np.asarray(base) * turned + specular * shine)
    return np.minimum(total, 1.0)


def shine(rng: np.random.Generator, count: int, lights: list[Light], kernel: Any = shine_kernel) -> tuple[np.ndarray, ...]:
    """Light random samples of two instances; what was used, and the result."""
    lamps = gather_lamps(two_squares(lights), CAMERA, "scene")
    assert lamps is not None
    numbers = rng.integers(-1, 4, count).astype(np.int32)
    instance = np.array([0, 0, 1, 1], np.int32)
    normals, viewers = rng.normal(size=(2, count, 3)).astype(np.float32)
    positions, base = rng.normal(size=(count, 3)), rng.random((count, 4)).astype(np.float32)
    around = np.where(lamps.takes_base[instance[numbers]][:, None], base[:, :3], np.float32(1.0))
    out = np.full((count, 4), np.nan, np.float32)
    kernel(numbers, instance, normals, positions, base, around, viewers, lamps, 1, out)
    return numbers, normals, positions, viewers, base, out


@pytest.mark.parametrize("count", [1, 256, 700])
def test_the_kernel_is_the_plain_model(count: int, rng: np.random.Generator) -> None:
    numbers, normals, positions, viewers, base, out = shine(rng, count, SOME)
    seen = 0
    for i in range(count):
        if numbers[i] < 0:
            assert np.isnan(out[i]).all()
            continue
        expected = plain_model(normals[i], positions[i], viewers[i], base[i, :3], SOME, int(numbers[i]) // 2)
        assert np.abs(out[i, :3] - expected).max() < 1e-4
        assert out[i, 3] == base[i, 3]
        seen += bool((expected > 0.05).any())
    assert seen > count / 3 or count == 1


def test_the_kernel_does_the_same_uncompiled() -> None:
    compiled, plain = (
        shine(np.random.default_rng(7), 60, SOME, kernel)[-1]
        for kernel in (shine_kernel, shine_kernel.py_func)  # type: ignore[attr-defined]
    )
    assert np.array_equal(compiled, plain, equal_nan=True)


def test_powers_are_multiplied_out() -> None:
    for exponent in (0, 1, 2, 5, 32, 127, 128):
        assert abs(raise_to(0.9, exponent) - 0.9**exponent) < 1e-15


def test_lights_that_are_far_away_or_at_the_surface_do_no_harm(rng: np.random.Generator) -> None:
    for place in ((1e200, 0, 0), (0, 0, 0), (1e160, -1e160, 3)):
        lights = [Light("point", position=place), Light("spot", position=place, cutoff_angle=90.0, drop_off=128)]
        numbers, *_, out = shine(rng, 50, lights)
        assert np.isfinite(out[numbers >= 0]).all()


def middle(scene: ss.Scene, **options: Any) -> list[int]:
    """The colour in the middle of a picture."""
    frame = ss.render(scene, CAMERA, (9, 9), samples=1, **options)
    return np.asarray(frame.color[4, 4, :3]).tolist()


def test_a_light_from_the_front_gives_a_surface_its_own_colour() -> None:
    mesh = ss.Instance(ss.Mesh(FLAT, FACES), material=ss.Material("", (0.2, 0.4, 0.6)))
    for light in (Light("directional"), Light("point", position=(0, 0, 3)), Light("spot", position=(0, 0, 3), drop_off=9)):
        assert middle(ss.Scene(mesh, lights=[light]), lights="scene") == [51, 102, 153]
    assert middle(ss.Scene(mesh, lights=[Light("directional", (1, 0, 0))]), lights="scene") == [51, 0, 0]
    assert middle(ss.Scene(mesh, lights=[Light("directional", direction=(0, 0, 1))]), lights="scene") == [0, 0, 0]
    assert middle(ss.Scene(mesh, lights=[Light("directional", intensity=0.0)]), lights="scene") == [0, 0, 0]
    assert middle(ss.Scene(mesh, lights=[Light("ambient")]), lights="scene") == [51, 102, 153]


def test_no_outline_is_black_where_a_light_at_the_eye_is_added() -> None:
    scene = ss.Scene(two_squares([]).instances, lights=[Light("directional")])
    assert min(middle(scene, lights="viewer")) > 60
    dark = ss.Scene(scene.instances, lights=[Light("directional", direction=(0, 0, 1))])
    tilted = ss.Camera.orthographic((5, 0, 0.05), (0, 0, 0), (0, 1, 0), height=2)
    frame = ss.render(dark, tilted, (9, 9), samples=1, lights="viewer", background="black")
    assert frame.color[frame.primitive >= 0][:, :3].min() > 20


def test_textures_are_lit_and_the_ambient_colour_shows_them_too() -> None:
    texture = ss.Texture(np.full((1, 1, 3), 128, np.uint8))
    mesh = ss.Mesh(FLAT, FACES, attributes={"uv": np.zeros((4, 2))})
    material = ss.Material("", (1.0, 1.0, 1.0), texture, ambient_color=(1.0, 0.0, 1.0))
    assert middle(ss.Scene(ss.Instance(mesh, material=material), lights=[Light("ambient")]), lights="scene") == [128, 0, 128]
    assert middle(ss.Scene(ss.Instance(mesh, material=material), lights=[Light("directional")]), lights="scene") == [128] * 3


def test_by_default_the_scenes_lights_shine_where_there_are_any() -> None:
    plain, lit = two_squares([]), two_squares([Light("directional", (1, 0, 0), 0.5)])
    dim = two_squares([Light("ambient")])
    assert [choose_lighting("auto", scene) for scene in (plain, lit, dim)] == ["studio", "viewer", "studio"]
    assert choose_lighting("scene", plain) == "scene"
    for scene, way in ((plain, "studio"), (lit, "viewer"), (dim, "studio")):
        assert middle(scene) == middle(scene, lights=way)
    assert middle(lit, lights="studio") == middle(plain)
    red, green, _ = middle(lit)
    assert red > green > 0
    assert middle(lit, lights="scene")[1] == 0
    assert middle(plain, lights="scene") == [0, 0, 0]


def test_the_picture_is_the_same_for_any_number_of_threads_and_in_a_file(tmp_path: Any) -> None:
    scene = two_squares(SOME)
    one = ss.render(scene, "iso", (40, 300), threads=1)
    assert np.array_equal(ss.render(scene, "iso", (40, 300), threads=5).color, one.color)
    path = ss.render(scene, "iso", (40, 300), out=tmp_path / "rows.npy")
    assert np.array_equal(np.load(path), one.color)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Light("sun"), "unknown kind of light 'sun'; the valid ones are: directional, point, spot, ambient"),
        (lambda: Light("point", (2, 0, 0)), "color = (2.0, 0.0, 0.0): expected floats 0..1"),
        (lambda: Light("point", intensity=-1), "intensity = -1: expected a number from 0 to 1e+06"),
        (lambda: Light("point", position=(0, np.nan, 0)), "position[1] = nan: expected a finite number"),
        (lambda: Light("spot", direction=(0, 0, 0)), "direction = (0, 0, 0): expected a direction"),
        (lambda: Light("spot", cutoff_angle=181), "cutoff_angle = 181: expected a number from 0 to 180"),
        (lambda: Light("spot", drop_off=1.5), "drop_off = 1.5: expected a whole number from 0 to 128"),
        (lambda: Light("spot", drop_off=129), "drop_off = 129: expected a whole number from 0 to 128"),
        (lambda: Light("point", attenuation=(1, -1, 0)), "attenuation = (1.0, -1.0, 0.0): expected numbers from 0 on"),
        (lambda: Light("point", instances=[-1]), "instances = [-1]: expected whole numbers from 0 on"),
        (lambda: Light("point", instances=3), "instances = 3: expected whole numbers from 0 on"),
        (lambda: two_squares([Light("point", instances=[2])]), "lights[0]: shines on instance 2, there are 2"),
        (lambda: two_squares(["sun"]), "lights[0]: expected a Light, got str"),
        (lambda: ss.render(two_squares([]), lights="sun"),
         "unknown lighting 'sun'; the valid ones are: auto, studio, scene, viewer"),
        (lambda: ss.Material(ambient_color=(1, 2, 3)), "ambient_color = (1.0, 2.0, 3.0): expected floats 0..1"),
        (lambda: ss.Material(specular_color=(1, 2, 3)), "specular_color = (1.0, 2.0, 3.0): expected floats 0..1"),
        (lambda: ss.Material(shininess=2), "shininess = 2: expected a number 0..1"),
    ],
)  # fmt: skip
def test_messages(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        make()
    assert repr(Light("spot", intensity=0.5)) == "Light('spot', intensity 0.5)"
