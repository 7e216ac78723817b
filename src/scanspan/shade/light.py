"""Light on a surface: a matte model with a sky, a light at the eye, one from above, and a faint highlight.

The lights are fixed to the camera, so that every picture is lit from its upper left, whatever the model and the view; the sky
alone is fixed to the world. Each does one job. The sky keeps what turns away from black, the headlight shows every face that
can be seen and lets it darken towards the outline, and the light from above gives faces at different angles different values.
Together they stay below 1 for white, highlight included, so that nothing burns out.

There is no `pow`: a highlight of exponent 32 is five squarings. Only + - * / and square roots are used, on float32, in the
order written: the same bits on every processor. Two-sided lighting flips the normal towards the eye.

Source: J. H. Lambert, Photometria, 1760; J. F. Blinn, Models of Light Reflection, 1977 (half-way vector).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanspan.homogeneous import finite_array, unit
from scanspan.jit import kernel, part_kernel
from scanspan.records import Float32Array

# Linear light that reaches a surface from each side, red, green, blue: a sky a little cool, a ground a little warm.
_SKY = (0.165, 0.186, 0.222)
_GROUND = (0.088, 0.080, 0.072)
_HEADLIGHT = (0.260, 0.260, 0.260)
_KEY = (0.615, 0.590, 0.550)

# Share of the light from above that the highlight sends on: the sheen of dry clay.
_GLOSS = 0.045

# The cosine to the viewer above which a normal that leans back belongs to an outline, and not to the back of a surface.
_GRAZING = -0.3

# Where the light from above stands, in axes of the camera: left of it, above it, and a little nearer to it than the model.
_KEY_PLACE = (-0.55, 0.80, 0.55)

# Samples that are lit at a time, and the lanes of numbers for each: 7 KiB, in the first-level cache.
BLOCK = 256
LANES = 7


class Lights(NamedTuple):
    """The lights of a picture: directions are unit vectors towards the light in the world, colours are linear light.

    All but the last are (3,) float32.
    """

    up: Float32Array  # towards the middle of the sky
    sky: Float32Array
    ground: Float32Array
    headlight: Float32Array  # comes from the eye
    key: Float32Array  # comes from key_direction
    key_direction: Float32Array
    gloss: float  # share of the key light in the highlight


def default_lights(camera_view: npt.ArrayLike, up: npt.ArrayLike) -> Lights:
    """Return lights that show the shape of a matte model from any side.

    Parameters
    ----------
    camera_view : (4, 4) world to camera, x right, y up, looking down -z: `camera.view`.
    up : (3,) direction of the sky in the world.

    Returns
    -------
    Lights

    Raises
    ------
    InputError : when one has another shape, or is not finite.

    >>> default_lights(np.eye(4), (0, 1, 0)).key_direction.round(2)
    array([-0.49,  0.72,  0.49], dtype=float32)
    """
    axes = finite_array("camera_view", camera_view, (4, 4))[:3, :3]
    right, above, back = (unit(axis) for axis in axes)
    x, y, z = _KEY_PLACE

    def light(values: npt.ArrayLike) -> Float32Array:
        return np.array(values, dtype=np.float32)

    return Lights(
        up=light(unit(finite_array("up", up, (3,)))),
        sky=light(_SKY),
        ground=light(_GROUND),
        headlight=light(_HEADLIGHT),
        key=light(_KEY),
        key_direction=light(unit(right * x + above * y + back * z)),
        gloss=_GLOSS,
    )


@kernel
def light(
    normals: Float32Array, base: Float32Array, viewers: Float32Array, lights: Lights, two_sided: int, out: Float32Array
) -> None:
    """Light samples of surfaces.

    Shapes  normals: (n, 3) float32. base: (n, 4) float32. viewers: (n, 3) or (1, 3) float32. out: (n, 4) float32, written; it
            may be base.
    Units   normals and viewers: directions in the world of any length, viewers towards the eye; one viewer holds for all. base,
            out: linear light with straight alpha.
    Rule    a normal without length, or that is not finite, faces the viewer; two_sided 1 turns normals to the viewer, 0 leaves
            the back of a surface to the sky and to the light from above.
    Needs   viewers of a length above zero.
    Cost    O(n), some nanoseconds a sample.
    Source: Lambert 1760, Blinn 1977.
    """
    lanes = np.zeros(LANES * BLOCK, dtype=np.float32)
    step = np.int64(1 if len(viewers) > 1 else 0)
    sky_r, sky_g, sky_b = lights.sky[0], lights.sky[1], lights.sky[2]
    ground_r, ground_g, ground_b = lights.ground[0], lights.ground[1], lights.ground[2]
    head_r, head_g, head_b = lights.headlight[0], lights.headlight[1], lights.headlight[2]
    key_r, key_g, key_b = lights.key[0], lights.key[1], lights.key[2]
    for start in range(0, len(normals), BLOCK):
        count = min(BLOCK, len(normals) - start)

        # Part the components of a block into lanes, turn the normals, and weigh the lights, in all of them at once.
        for j in range(count):
            lanes[j] = normals[start + j, 0]
            lanes[BLOCK + j] = normals[start + j, 1]
            lanes[2 * BLOCK + j] = normals[start + j, 2]
            lanes[3 * BLOCK + j] = viewers[(start + j) * step, 0]
            lanes[4 * BLOCK + j] = viewers[(start + j) * step, 1]
            lanes[5 * BLOCK + j] = viewers[(start + j) * step, 2]
        turn_normals(lanes, two_sided)
        weigh_lights(lanes, lights)

        # Add up the light, colour by colour.
        for j in range(count):
            i = start + j
            facing, sky, turned, shine = lanes[j], lanes[BLOCK + j], lanes[2 * BLOCK + j], lanes[3 * BLOCK + j]
            red = ground_r + (sky_r - ground_r) * sky + head_r * facing + key_r * turned
            green = ground_g + (sky_g - ground_g) * sky + head_g * facing + key_g * turned
            blue = ground_b + (sky_b - ground_b) * sky + head_b * facing + key_b * turned
            out[i, 0] = base[i, 0] * red + key_r * shine
            out[i, 1] = base[i, 1] * green + key_g * shine
            out[i, 2] = base[i, 2] * blue + key_b * shine
            out[i, 3] = base[i, 3]


@part_kernel
def turn_normals(lanes: Float32Array, two_sided: int) -> None:
    """Bring the normals and the ways to the viewer of a block to length one, and turn the normals to the viewer.

    Shapes  lanes: (7 x 256,) float32: the x, y, z of the normals and the x, y, z towards the viewer, overwritten; the last lane
            is written with the cosine between them.
    Rule    as for `light`.
    Cost    one pass over the block, eight or sixteen samples at a time: one array with fixed offsets is what lets it vectorise.
    """
    zero, one, tiny = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
    flipped, two = np.float32(-1.0 if two_sided != 0 else 1.0), np.float32(2.0)
    grazing = np.float32(_GRAZING if two_sided != 0 else 0.0)
    for j in range(BLOCK):
        # Bring both directions to length one.
        vx, vy, vz = lanes[3 * BLOCK + j], lanes[4 * BLOCK + j], lanes[5 * BLOCK + j]
        scale = one / np.sqrt(vx * vx + vy * vy + vz * vz + tiny)
        vx, vy, vz = vx * scale, vy * scale, vz * scale
        nx, ny, nz = lanes[j], lanes[BLOCK + j], lanes[2 * BLOCK + j]
        square = nx * nx + ny * ny + nz * nz
        usable = (square > tiny) & (square < np.float32(1e30))
        scale = one / np.sqrt(square if usable else one)
        nx = nx * scale if usable else vx
        ny = ny * scale if usable else vy
        nz = nz * scale if usable else vz

        # Turn the normal to the viewer. One that leans back a little is interpolated across an outline: only its lean is
        # mirrored, as turning it round would light it from the far side.
        facing = nx * vx + ny * vy + nz * vz
        lean = facing if (facing < zero) & (facing > grazing) else zero
        nx, ny, nz, facing = nx - two * lean * vx, ny - two * lean * vy, nz - two * lean * vz, facing - two * lean
        flip = flipped if facing < zero else one
        lanes[j], lanes[BLOCK + j], lanes[2 * BLOCK + j] = nx * flip, ny * flip, nz * flip
        lanes[3 * BLOCK + j], lanes[4 * BLOCK + j], lanes[5 * BLOCK + j] = vx, vy, vz
        lanes[6 * BLOCK + j] = facing * flip


@part_kernel
def weigh_lights(lanes: Float32Array, lights: Lights) -> None:
    """Compute how much of each light reaches the samples of a block.

    Shapes  lanes: (7 x 256,) float32 from turn_normals; the first four lanes are overwritten with the shares of headlight, sky,
            light from above and highlight.
    Units   shares 0..1.
    Cost    one pass over the block, as turn_normals.
    """
    zero, half, tiny = np.float32(0.0), np.float32(0.5), np.float32(1e-30)
    gloss = np.float32(lights.gloss)
    up_x, up_y, up_z = lights.up[0], lights.up[1], lights.up[2]
    key_x, key_y, key_z = lights.key_direction[0], lights.key_direction[1], lights.key_direction[2]
    for j in range(BLOCK):
        nx, ny, nz, facing = lanes[j], lanes[BLOCK + j], lanes[2 * BLOCK + j], lanes[6 * BLOCK + j]
        vx, vy, vz = lanes[3 * BLOCK + j], lanes[4 * BLOCK + j], lanes[5 * BLOCK + j]

        # Measure how far the surface turns to the light from above, and to the half-way vector.
        turned = nx * key_x + ny * key_y + nz * key_z
        turned = turned if turned > zero else zero
        hx, hy, hz = vx + key_x, vy + key_y, vz + key_z
        shine = (nx * hx + ny * hy + nz * hz) / np.sqrt(hx * hx + hy * hy + hz * hz + tiny)
        shine = shine if shine > zero else zero
        shine = shine if turned > zero else zero

        # Raise the cosine of the highlight to the power 32.
        shine = shine * shine
        shine = shine * shine
        shine = shine * shine
        shine = shine * shine
        lanes[j] = facing if facing > zero else zero
        lanes[BLOCK + j] = half + half * (nx * up_x + ny * up_y + nz * up_z)
        lanes[2 * BLOCK + j] = turned
        lanes[3 * BLOCK + j] = gloss * (shine * shine)
