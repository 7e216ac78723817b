"""The lights of a scene on a surface: matte and shiny light from far lights, points and cones, and light from all round.

Where a scene has lights of its own they take the place of those in light.py. The model is that of OpenGL 1 and so of Inventor,
in linear light: for each light that reaches the instance, its colour, weakened by distance and by the angle to the axis of a
cone, times the base colour and the cosine to the normal, plus the colour of the highlight times a power of the cosine to the
half-way vector; and the ambient light times the ambient colour. Nothing casts a shadow. What is brighter than 1 is cut off.

There is no `pow`: exponents are whole numbers, and powers are multiplied out by squaring. Only + - * / and square roots are
used, in the order written: the same bits on every processor.

Source: the OpenGL 1.x specification, "Lighting"; J. F. Blinn, Models of Light Reflection, 1977; SoXtViewer (the headlight).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.light import MAX_DROP_OFF, Light
from scanspan.assets.material import Material
from scanspan.assets.scene import Scene
from scanspan.errors import unknown_name
from scanspan.jit import helper_kernel, kernel
from scanspan.records import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, Integer
from scanspan.shade.color import linear_color
from scanspan.shade.light import BLOCK, LANES, turn_normals

LIGHTINGS = {
    "auto": "viewer where the scene has lights, else studio",
    "studio": "lights that show the shape of anything, fixed to the camera",
    "scene": "the scene's lights alone",
    "viewer": "the scene's lights, one at the eye as viewers of Inventor add it, and a little from all round",
}

# In axes of the camera, x right, y up, z towards the viewer: how the light at the eye of Inventor's viewers shines. There
# it has an intensity of 1; half as much leaves room for the scene's own lights before white burns out.
_HEADLIGHT_WAY = (0.2, -0.2, -0.9797958971)
_HEADLIGHT = 0.5

# Share of the base colour that is seen besides, so that no outline is black.
_FILL = 0.06

DIRECTIONAL, POINT, SPOT = 0, 1, 2
_KINDS = {"directional": DIRECTIONAL, "point": POINT, "spot": SPOT}

_FARTHEST = 1e150  # of a light; squares of what is farther off are no numbers


class Lamps(NamedTuple):
    """The L lights of a scene as arrays, and what N instances do with them; colours are linear light."""

    kind: Int64Array  # (L,) DIRECTIONAL, POINT or SPOT
    color: Float64Array  # (L, 3) times the intensity
    position: Float64Array  # (L, 3)
    direction: Float64Array  # (L, 3) in which it shines, of length 1
    attenuation: Float64Array  # (L, 3) constant, linear, quadratic
    rim: Float64Array  # (L,) cosine of the angle from the axis of a cone to its rim
    drop_off: Int64Array  # (L,) exponent
    fill: float  # share of the base colour that is seen without any light
    starts: Int64Array  # (N + 1,) instance n is reached by the lights of reached from starts[n] to before starts[n + 1]
    reached: Int64Array  # (K,) numbers of lights
    ambient: Float64Array  # (N, 3) light from all round, times the ambient colour of materials that have one
    specular: Float64Array  # (N, 3)
    shininess: Int64Array  # (N,) exponent
    takes_base: BoolArray  # (N,) whether it falls on the base colour, for the material has none for it


def check_lighting(lights: str) -> None:
    """Raise an InputError for a lighting that is not known."""
    if not isinstance(lights, str) or lights not in LIGHTINGS:
        raise unknown_name("lighting", lights, LIGHTINGS)


def choose_lighting(lights: str, scene: Scene) -> str:
    """Return "studio", "scene" or "viewer" for what was asked for; ambient light alone is no reason to leave the studio."""
    if lights != "auto":
        return lights
    return "viewer" if any(light.kind != "ambient" for light in scene.lights) else "studio"


def gather_lamps(scene: Scene, camera: Camera, lighting: str) -> Lamps | None:
    """Return the lights that shine on a scene, None where those of light.py do."""
    if lighting == "studio":
        return None
    count = len(scene.instances)
    shining = [light for light in scene.lights if light.kind != "ambient" and light.intensity > 0.0 and any(light.color)]
    if lighting == "viewer":
        axes = camera.view[:3, :3]
        way = _HEADLIGHT_WAY[0] * axes[0] + _HEADLIGHT_WAY[1] * axes[1] + _HEADLIGHT_WAY[2] * axes[2]
        shining.append(Light("directional", intensity=_HEADLIGHT, direction=way))

    # List for each instance the lights that reach it, in their order.
    every = np.arange(count, dtype=np.int64)
    reach = [every if light.instances is None else light.instances for light in shining]
    instance = np.concatenate([np.empty(0, np.int64), *reach])
    number = np.repeat(np.arange(len(shining), dtype=np.int64), [len(some) for some in reach])
    order = np.argsort(instance, kind="stable")
    materials = [one.material for one in scene.instances]
    around = find_ambient(scene)
    has_own = np.array([material.ambient_color is not None for material in materials], dtype=bool)
    around[has_own] *= _linear([material.ambient_color for material in materials if material.ambient_color is not None])
    return Lamps(
        kind=np.array([_KINDS[light.kind] for light in shining], np.int64),
        color=np.array([linear_color((*light.color, 1.0))[:3] * light.intensity for light in shining]).reshape(-1, 3) + 0.0,
        position=np.array([light.position for light in shining]).reshape(-1, 3),
        direction=np.array([light.direction for light in shining]).reshape(-1, 3),
        attenuation=np.array([light.attenuation for light in shining]).reshape(-1, 3),
        rim=np.array([find_rim(light) for light in shining], np.float64),
        drop_off=np.array([light.drop_off for light in shining], np.int64),
        fill=_FILL if lighting == "viewer" else 0.0,
        starts=np.searchsorted(instance[order], np.arange(count + 1)).astype(np.int64),
        reached=number[order],
        ambient=around,
        specular=_linear([material.specular_color or (0.0, 0.0, 0.0) for material in materials]),
        shininess=np.array([find_exponent(material) for material in materials], np.int64),
        takes_base=~has_own,
    )


def _linear(colors: list[tuple[float, float, float]]) -> Float64Array:
    """Return colours as linear light, (n, 3) float64."""
    known = {color: linear_color((*color, 1.0))[:3].astype(np.float64) for color in set(colors)}
    return np.array([known[color] for color in colors], np.float64).reshape(-1, 3)


def find_ambient(scene: Scene) -> Float64Array:
    """Return the sum of the ambient lights on each instance, (N, 3)."""
    around = np.zeros((len(scene.instances), 3))
    for light in scene.lights:
        if light.kind == "ambient":
            around[slice(None) if light.instances is None else light.instances] += (
                linear_color((*light.color, 1.0))[:3].astype(np.float64) * light.intensity
            )
    return around


def find_rim(light: Light) -> float:
    """Return the cosine of a cone's half angle; 180 degrees is light to all sides, as in OpenGL.

    Nine decimals are kept, so that a cosine which differs in the last bit from machine to machine gives the same picture.
    """
    return round(math.cos(math.radians(light.cutoff_angle)), 9)


def find_exponent(material: Material) -> int:
    """Return the exponent of a material's highlight, a whole number."""
    return int(material.shininess * MAX_DROP_OFF + 0.5)


@helper_kernel
def raise_to(base: float, exponent: Integer) -> float:
    """Return a number to the power of a whole number from 0 to 128, by squaring."""
    power, square = np.float64(1.0), base
    for _ in range(8):
        power = power * square if exponent & 1 else power
        exponent = exponent >> 1
        square = square * square
    return power


def find_around(lamps: Lamps, numbers: Int32Array, instance: Int32Array, bases: Float32Array) -> Float32Array:
    """Return what the ambient light of samples is multiplied by, but for textures: the base colour, or 1, (n, 3) float32."""
    around = np.ones((len(numbers), 3), np.float32)
    takes = (numbers >= 0) & lamps.takes_base[instance[numbers]]
    around[takes] = bases[takes, :3]
    return around


@kernel
def shine_kernel(
    numbers: Int32Array, instance: Int32Array, normals: Float32Array, positions: Float64Array, base: Float32Array,
    around: Float32Array, viewers: Float32Array, lamps: Lamps, two_sided: int, out: Float32Array,
) -> None:  # fmt: skip
    """Light samples of surfaces with the lights of a scene.

    Shapes  numbers: (n,) int32 triangle of each sample, -1 nothing; instance: (T,) int32; normals: (n, 3) float32; positions:
            (n, 3) float64; base: (n, 4), around: (n, 3) float32; viewers: (n, 3) float32; out: (n, 4) float32, written where
            there is something; it may be base.
    Units   normals and viewers: directions in the world of any length; positions: in the world; base, out: linear light with
            straight alpha; around: what the ambient light is multiplied by.
    Rule    normals are turned as in light.py.
    Needs   viewers of a length above zero.
    Cost    O(n L) for L lights on a sample.
    Source: the OpenGL 1.x specification; Blinn 1977.
    """
    lanes = np.zeros(LANES * BLOCK, dtype=np.float32)
    kind, color, position, direction = lamps.kind, lamps.color, lamps.position, lamps.direction
    attenuation, rim, drop_off = lamps.attenuation, lamps.rim, lamps.drop_off
    starts, reached, ambient = lamps.starts, lamps.reached, lamps.ambient
    specular, shininess, fill = lamps.specular, lamps.shininess, np.float64(lamps.fill)
    for start in range(0, len(normals), BLOCK):
        count = min(BLOCK, len(normals) - start)

        # Turn the normals of a block to the viewer.
        for j in range(count):
            for k in range(3):
                lanes[k * BLOCK + j] = normals[start + j, k]
                lanes[(3 + k) * BLOCK + j] = viewers[start + j, k]
        turn_normals(lanes, two_sided)
        for j in range(count):
            i = start + j
            if numbers[i] < 0:
                continue
            n = instance[numbers[i]]
            nx, ny, nz = np.float64(lanes[j]), np.float64(lanes[BLOCK + j]), np.float64(lanes[2 * BLOCK + j])
            vx, vy, vz = (
                np.float64(lanes[3 * BLOCK + j]), np.float64(lanes[4 * BLOCK + j]), np.float64(lanes[5 * BLOCK + j])
            )  # fmt: skip
            matte_r, matte_g, matte_b = fill, fill, fill
            shine_r, shine_g, shine_b = np.float64(0.0), np.float64(0.0), np.float64(0.0)
            for entry in range(starts[n], starts[n + 1]):
                # Find the way to the light, and what is left of it here.
                m = reached[entry]
                tx, ty, tz, share = -direction[m, 0], -direction[m, 1], -direction[m, 2], np.float64(1.0)
                if kind[m] != DIRECTIONAL:
                    tx, ty = position[m, 0] - positions[i, 0], position[m, 1] - positions[i, 1]
                    tz = position[m, 2] - positions[i, 2]
                    if not abs(tx) + abs(ty) + abs(tz) < _FARTHEST:
                        continue
                    distance = np.sqrt(tx * tx + ty * ty + tz * tz)
                    scale = 1.0 / distance if distance > 0.0 else np.float64(0.0)
                    tx, ty, tz = tx * scale, ty * scale, tz * scale
                    lost = attenuation[m, 0] + (attenuation[m, 1] + attenuation[m, 2] * distance) * distance
                    share = 1.0 / lost if lost > 0.0 else np.float64(1.0)
                if kind[m] == SPOT and rim[m] > -1.0:
                    along = -(tx * direction[m, 0] + ty * direction[m, 1] + tz * direction[m, 2])
                    share = share * raise_to(along, drop_off[m]) if along >= rim[m] and along > 0.0 else np.float64(0.0)

                # Weigh it by how far the surface turns to it, and to the half-way vector.
                turned = nx * tx + ny * ty + nz * tz
                if not (turned > 0.0 and share > 0.0):
                    continue
                hx, hy, hz = vx + tx, vy + ty, vz + tz
                half = (nx * hx + ny * hy + nz * hz) / np.sqrt(hx * hx + hy * hy + hz * hz + 1e-30)
                gleam = share * raise_to(min(half, 1.0), shininess[n]) if half > 0.0 else np.float64(0.0)
                turned = turned * share
                matte_r, shine_r = matte_r + color[m, 0] * turned, shine_r + color[m, 0] * gleam
                matte_g, shine_g = matte_g + color[m, 1] * turned, shine_g + color[m, 1] * gleam
                matte_b, shine_b = matte_b + color[m, 2] * turned, shine_b + color[m, 2] * gleam

            # Add the ambient light and the highlight, and cut off what is too bright.
            red = base[i, 0] * matte_r + around[i, 0] * ambient[n, 0] + specular[n, 0] * shine_r
            green = base[i, 1] * matte_g + around[i, 1] * ambient[n, 1] + specular[n, 1] * shine_g
            blue = base[i, 2] * matte_b + around[i, 2] * ambient[n, 2] + specular[n, 2] * shine_b
            out[i, 0], out[i, 1] = np.float32(min(red, 1.0)), np.float32(min(green, 1.0))
            out[i, 2], out[i, 3] = np.float32(min(blue, 1.0)), base[i, 3]
