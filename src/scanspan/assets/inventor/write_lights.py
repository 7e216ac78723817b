"""Lights and cameras of a scene as nodes of an Inventor file.

Both stand in the world, so they are written before any matrix. The light from all round is an Environment; so is the way in
which a light weakens with distance, before the light.

Source: Wernecke, The Inventor Mentor, chapter 11, "File Format"; the reference pages of Inventor 2.1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.lens import Orthographic, Perspective
from scanspan.assets.light import MAX_DROP_OFF, Light
from scanspan.assets.pose import quaternion
from scanspan.errors import InputError

NODES = {"directional": "DirectionalLight", "point": "PointLight", "spot": "SpotLight"}


def _words(values: Any) -> str:
    """Return numbers as text that is read back as the same."""
    return " ".join(repr(value) for value in np.asarray(values, dtype=np.float64).reshape(-1).tolist())


def shines_on(light: Light, number: int) -> bool:
    """Say whether a light reaches an instance."""
    if light.instances is None:
        return True
    place = int(np.searchsorted(light.instances, number))
    return place < len(light.instances) and int(light.instances[place]) == number


def write_lights(lights: tuple[Light, ...], number: int) -> Iterator[str]:
    """Return the lines of the lights that reach an instance, and of the light from all round it.

    Raises
    ------
    InputError : more than one light from all round reaches it, which Inventor cannot say.
    """
    reaching = [light for light in lights if shines_on(light, number)]
    for light in reaching:
        if light.kind != "ambient":
            yield from write_light(light)
    around = [light for light in reaching if light.kind == "ambient"]
    if len(around) > 1:
        raise InputError(f"instances[{number}]: {len(around)} ambient lights reach it; an Inventor file has one at a time")
    for light in around:
        yield f"Environment {{ ambientColor {_words(light.color)} ambientIntensity {light.intensity!r} }}"
    if lights and not around:
        yield "Environment { ambientIntensity 0 }"


def write_light(light: Light) -> Iterator[str]:
    """Return the lines of a light that is not from all round."""
    fields = [f"color {_words(light.color)} intensity {light.intensity!r}"]
    if light.kind != "point":
        fields.append(f"direction {_words(light.direction)}")
    if light.kind != "directional":
        yield f"Environment {{ attenuation {_words(light.attenuation[::-1])} }}"
        fields.append(f"location {_words(light.position)}")
    if light.kind == "spot":
        fields.append(f"cutOffAngle {math.radians(light.cutoff_angle)!r} dropOffRate {light.drop_off / MAX_DROP_OFF!r}")
    yield f"{NODES[light.kind]} {{ {' '.join(fields)} }}"


def write_camera(camera: Camera) -> Iterator[str]:
    """Return the lines of a camera; one whose lens Inventor does not know is left out."""
    w, x, y, z = quaternion(camera.view[:3, :3].T).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    turn = (x / sine, y / sine, z / sine, 2.0 * math.atan2(sine, w)) if sine > 0.0 else (0.0, 0.0, 1.0, 0.0)
    place = f"position {_words(camera.eye)} orientation {_words(turn)} nearDistance {camera.near!r}"
    if isinstance(camera.lens, Orthographic):
        yield f"OrthographicCamera {{ {place} height {camera.lens.height!r} }}"
    elif isinstance(camera.lens, Perspective):
        yield f"PerspectiveCamera {{ {place} heightAngle {math.radians(camera.lens.fov)!r} }}"
