"""Light nodes as lights of the scene: where they stand in the world, and which instances they shine on.

A light shines on the shapes that come after it in the traversal, as far as its separator reaches. How it weakens with distance
is what the Environment says at the light; the light from all round is what it says at the shape.

Source: the reference pages of Light, DirectionalLight, PointLight, SpotLight and Environment of Inventor 2.1.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any

import numpy as np

from scanspan.assets.inventor.build import Placed, clip
from scanspan.assets.inventor.graph import Node
from scanspan.assets.light import MAX_DROP_OFF, STRONGEST, Light
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray, transform_directions, transform_points

MAX_SHINING = 64
"""Lights that shine on one shape; OpenGL promised 8, and so many is what Inventor shows."""

KINDS = {"DirectionalLight": "directional", "PointLight": "point", "SpotLight": "spot"}


def lights_of(lights: list[tuple[Node, FloatArray, FloatArray]], placed: list[Placed]) -> list[Light]:
    """Return the lights of a file that has any, and the light from all round.

    Parameters
    ----------
    lights : nodes, with the transformation and the attenuation in force there.
    placed : what was in force at each instance.
    """
    reached: dict[int, list[int]] = defaultdict(list)
    around: dict[tuple[float, ...], list[int]] = defaultdict(list)
    for instance, place in enumerate(placed):
        around[place.ambient].append(instance)
        for number in place.lights:
            reached[number].append(instance)
    found = []
    for number, (node, transform, attenuation) in enumerate(lights):
        if node.get("on") and number in reached:
            try:
                found.append(light_of(node, transform, attenuation, reached[number]))
            except InputError as error:
                node.note(f"{node.kind} is left out: {error}")
    for (red, green, blue, intensity), instances in around.items():
        if found and intensity > 0.0:
            found.append(Light("ambient", (red, green, blue), intensity, instances=instances))
    return found


def light_of(node: Node, transform: FloatArray, attenuation: FloatArray, instances: list[int]) -> Light:
    """Return the light of a DirectionalLight, a PointLight or a SpotLight.

    Raises
    ------
    InputError : a number that is none for a light, or a transformation that leaves no direction.
    """
    options: dict[str, Any] = {}
    if node.kind != "PointLight":
        (options["direction"],) = transform_directions(transform, [node.get("direction")])
    if node.kind != "DirectionalLight":
        options["position"] = transform_points(transform, [node.get("location")])[0, :3]
        options["attenuation"] = np.maximum(np.nan_to_num(attenuation), 0.0)
    if node.kind == "SpotLight":
        angle, rate = float(node.get("cutOffAngle")), float(node.get("dropOffRate"))
        options["cutoff_angle"] = math.degrees(min(max(angle, 0.0), math.pi)) if math.isfinite(angle) else 45.0
        options["drop_off"] = round(min(max(rate, 0.0), 1.0) * MAX_DROP_OFF) if math.isfinite(rate) else 0
    color = tuple(clip(node.get("color")).tolist())
    return Light(KINDS[node.kind], color, strength(node.get("intensity")), instances=instances, **options)


def strength(intensity: float) -> float:
    """Return an intensity that can be used."""
    return min(max(float(intensity), 0.0), STRONGEST) if math.isfinite(intensity) else 0.0


def ambient_of(node: Node) -> tuple[float, float, float, float]:
    """Return the colour and the intensity of the light from all round of an Environment."""
    red, green, blue = clip(node.get("ambientColor")).tolist()
    return red, green, blue, strength(node.get("ambientIntensity"))
