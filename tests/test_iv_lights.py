"""Lights of Inventor files: where they stand, what they reach, and what the Environment says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.inventor.lights import MAX_SHINING
from scanspan.assets.light import Light
from scanspan.errors import InputError
from scanspan.view.shot import Shot, check_index, make_camera
from tests.inventor import scene_of


def shining(scene: ss.Scene) -> list[Light]:
    """The lights of a scene that are not from all round."""
    return [light for light in scene.lights if light.kind != "ambient"]


def reached(light: Light) -> list[int]:
    """The instances that a light reaches."""
    assert light.instances is not None
    return light.instances.tolist()


def test_a_light_shines_on_what_follows_within_its_separator(tmp_path: Path) -> None:
    text = """Cube {} PointLight {} Cube {}
    Separator { DirectionalLight {} Cube {} Group { SpotLight {} } Cube {} }
    TransformSeparator { PointLight { color 1 0 0 } } Cube {} PointLight { on FALSE } Separator { PointLight {} }"""
    scene = scene_of(tmp_path, text)
    assert [(light.kind, reached(light)) for light in shining(scene)] == [
        ("point", [1, 2, 3, 4]), ("directional", [2, 3]), ("spot", [3]), ("point", [4]),
    ]  # fmt: skip


def test_lights_stand_where_the_transformation_takes_them(tmp_path: Path) -> None:
    text = """Transform { translation 1 2 3 rotation 0 0 1 1.5707963267948966 scaleFactor 2 2 2 }
    PointLight { location 1 0 0 color 1 .5 0 intensity .25 }
    SpotLight { location 0 1 0 direction 1 0 0 cutOffAngle .5 dropOffRate .25 }
    DirectionalLight { direction 0 1 0 } Cube {}"""
    point, spot, far = shining(scene_of(tmp_path, text))
    assert point.position.round(9).tolist() == [1, 4, 3]
    assert (point.color, point.intensity) == ((1.0, 0.5, 0.0), 0.25)
    assert spot.position.round(9).tolist() == [-1, 2, 3]
    assert spot.direction.round(9).tolist() == [0, 1, 0]
    assert round(np.radians(spot.cutoff_angle), 6) == 0.5
    assert spot.drop_off == 32
    assert far.direction.round(9).tolist() == [-1, 0, 0]


def test_the_environment_weakens_lights_and_gives_light_from_all_round(tmp_path: Path) -> None:
    text = """PointLight {} Cube {}
    Separator { Environment { ambientIntensity .5 ambientColor 1 0 0 attenuation 3 2 1 } PointLight {} Cube {} }
    Environment { attenuation 0 0 0 ambientIntensity 0 } PointLight {} Cube {}"""
    scene = scene_of(tmp_path, text)
    assert [light.attenuation.tolist() for light in shining(scene)] == [[1, 0, 0], [1, 2, 3], [0, 0, 0]]
    around = [light for light in scene.lights if light.kind == "ambient"]
    assert [(light.color, light.intensity, reached(light)) for light in around] == [
        ((1.0, 1.0, 1.0), pytest.approx(0.2), [0]), ((1.0, 0.0, 0.0), 0.5, [1]),
    ]  # fmt: skip


def test_materials_say_how_they_take_the_light(tmp_path: Path) -> None:
    text = """DirectionalLight {} Cube {}
    Material { ambientColor 1 0 0 specularColor 0 1 0 shininess .5 } Cube {}"""
    plain, shiny = (instance.material for instance in scene_of(tmp_path, text).instances)
    assert plain.ambient_color == pytest.approx((0.2, 0.2, 0.2))
    assert (plain.specular_color, plain.shininess) == (None, pytest.approx(0.2))
    assert (shiny.ambient_color, shiny.specular_color, shiny.shininess) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.5)


def test_a_file_without_lights_is_lit_as_ever(tmp_path: Path) -> None:
    plain = scene_of(tmp_path, "Environment { ambientIntensity 1 } DirectionalLight { on FALSE } Sphere {}")
    assert plain.lights == ()
    assert np.array_equal(ss.render(plain, size=(32, 24)).color, ss.render(plain, size=(32, 24), lights="studio").color)
    lit = scene_of(tmp_path, "DirectionalLight { direction 0 -1 0 color 0 1 0 } Sphere {}")
    red, green, _ = ss.render(lit, "top", (33, 33), lights="scene").color[16, 16, :3].tolist()
    assert green > 200
    assert red < 30


def test_numbers_that_no_light_has_are_left_out_with_a_note(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "SpotLight { direction 0 0 0 } Cube {}")
    assert scene.lights == ()
    assert any("SpotLight is left out: direction = (0, 0, 0): expected a direction" in note for note in scene.notes)
    odd = """SpotLight { intensity -3 cutOffAngle 9 dropOffRate 7 color 2 -1 .5 }
    Environment { attenuation -1 0 1 } PointLight {} Cube {}"""
    spot, point = shining(scene_of(tmp_path, odd))
    assert (spot.intensity, spot.cutoff_angle, spot.drop_off, spot.color) == (0.0, 180.0, 128, (1.0, 0.0, 0.5))
    assert point.attenuation.tolist() == [1, 0, 0]


def test_too_many_lights_are_left_out_with_a_note(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "PointLight {} " * (MAX_SHINING + 5) + "Cube {}")
    assert len(shining(scene)) == MAX_SHINING
    assert any(f"more than {MAX_SHINING} lights shine at once; the others are left out" in note for note in scene.notes)


def test_fog_is_said(tmp_path: Path) -> None:
    assert any("fog is not drawn" in note for note in scene_of(tmp_path, "Environment { fogType HAZE } Cube {}").notes)


def test_a_camera_of_the_file_may_be_chosen(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "PerspectiveCamera { position 0 0 8 } OrthographicCamera { position 1 2 3 } Cube {}")
    for index, camera in enumerate(scene.cameras):
        assert make_camera(scene, Shot(camera_index=index), (8, 6)) is camera
    assert scene.cameras[1].eye.tolist() == [1, 2, 3]
    with pytest.raises(InputError, match=r"^--camera-index = 2: the file has 2, counted from 0$"):
        make_camera(scene, Shot(camera_index=2), (8, 6))
    check_index(Shot(camera_index=1))
    check_index(Shot("top"), ["iso"])
    for shot in (Shot(np.ones(3), camera_index=1), Shot("top", camera_index=1), Shot(elevation=3.0, camera_index=0)):
        with pytest.raises(InputError, match=r"^--camera-index chooses a camera of the file"):
            check_index(shot)
