"""Materials that send out light or are not lit, and meshes that have a crease angle of their own."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.errors import InputError
from scanspan.shade.color import encode_srgb, linear_color

ROOF = [(-1, 0, 1), (1, 0, 1), (1, 1, 0), (-1, 1, 0), (1, 0, -1), (-1, 0, -1)]
FACES = [(0, 1, 2, 3), (3, 2, 4, 5)]


def picture(mesh: ss.Mesh, **material: object) -> np.ndarray:
    """The colours that a roof shows from the front."""
    instance = ss.Instance(mesh, material=ss.Material("", **material))  # type: ignore[arg-type]
    frame = ss.render(ss.Scene(instance), "front", (40, 30), samples=1)
    return frame.color[frame.primitive >= 0]


def test_what_is_not_lit_shows_its_colour_to_the_bit() -> None:
    mesh = ss.Mesh.from_polygons(ROOF, FACES)
    assert np.unique(picture(mesh, base_color=(0.2, 0.4, 0.6), is_lit=False), axis=0).tolist() == [[51, 102, 153, 255]]
    assert np.unique(picture(mesh, base_color=(0.2, 0.4, 0.6)), axis=0).tolist() != [[51, 102, 153, 255]]


def test_emitted_light_is_added() -> None:
    mesh = ss.Mesh.from_polygons(ROOF, FACES)
    plain = picture(mesh, base_color=(0.5, 0.5, 0.5))
    glowing = picture(mesh, base_color=(0.5, 0.5, 0.5), emissive_color=(0.0, 0.0, 0.5))
    assert np.array_equal(plain[:, :2], glowing[:, :2])
    dark = picture(mesh, base_color=(0.0, 0.0, 0.0), emissive_color=(0.0, 0.0, 0.5))
    light = [linear_color(tuple(row[:3].tolist()))[2] for row in (plain[0], dark[0], glowing[0])]
    assert abs(light[0] + light[1] - light[2]) < 0.01
    assert dark[0, 2] >= 127


def test_only_those_materials_change() -> None:
    mesh = ss.Mesh.from_polygons(ROOF, FACES)
    material = ss.Material("", (0.5, 0.3, 0.1))
    shifted = np.eye(4)
    shifted[0, 3] = 3.0
    alone = ss.render(ss.Scene([ss.Instance(mesh, material=material), ss.Instance(mesh, shifted, material)]), "front", (60, 30))
    unlit = ss.Material("", (0.5, 0.3, 0.1), is_lit=False)
    mixed = ss.render(ss.Scene([ss.Instance(mesh, material=material), ss.Instance(mesh, shifted, unlit)]), "front", (60, 30))
    first = mixed.object == 0
    inner = first & np.roll(first, 1, 1) & np.roll(first, -1, 1)
    assert np.array_equal(alone.color[inner], mixed.color[inner])
    assert not np.array_equal(alone.color, mixed.color)


def test_a_mesh_may_have_a_crease_angle() -> None:
    def shades(angle: float | None) -> int:
        mesh = ss.Mesh(
            [(-1, 0, 0), (0, 0, 1), (0, 2, 1), (-1, 2, 0), (1, 0, 0), (1, 2, 0)],
            [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)], [0, 0, 1, 1], crease_angle=angle,
        )  # fmt: skip
        frame = ss.render(ss.Scene(mesh), "front", (40, 30), samples=1)
        return len(np.unique(frame.normal[frame.primitive >= 0].round(4), axis=0))

    assert shades(0.0) == shades(None) == 2
    assert shades(180.0) > 10
    assert ss.Mesh(ROOF, [(0, 1, 2)], crease_angle=30).crease_angle == 30.0


@pytest.mark.parametrize("angle", [-1.0, 181.0, float("nan"), "steep"])
def test_crease_angles_that_are_none(angle: float) -> None:
    with pytest.raises(InputError, match="crease_angle"):
        ss.Mesh(ROOF, [(0, 1, 2)], crease_angle=angle)


def test_emissive_colours_that_are_none() -> None:
    with pytest.raises(InputError, match=r"emissive_color = \(2.0, 0.0, 0.0\): expected floats 0..1"):
        ss.Material("", emissive_color=(2.0, 0.0, 0.0))
    with pytest.raises(InputError, match="emissive_color: expected three or four floats"):
        ss.Material("", emissive_color=(1.0, 0.0))  # type: ignore[arg-type]
    assert encode_srgb(np.float32([[0.0, 0.0, 0.0]])).tolist() == [[0, 0, 0]]
