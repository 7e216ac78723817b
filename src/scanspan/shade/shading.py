"""Shading: the linear colour of every visible sample, a few rows at a time.

The stages follow each other over the rows as plain loops: weights, normals, base colour, texture, light (the studio's in
light.py or the scene's own in lamps.py), edges. Visibility came first, so each sample is shaded once, whatever was hidden
behind it; of translucent surfaces, once for each layer (target/peel.py).

Source: the order of nvdiffrast (rasterize, interpolate, shade) and of deferred shading.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.material import FILTERS, WRAPS
from scanspan.assets.scene import Scene
from scanspan.homogeneous import normal_matrix, transform_directions
from scanspan.jit import kernel
from scanspan.records import Array, BoolArray, DrawList, Float32Array, Float64Array, Int32Array, ScreenTriangles
from scanspan.shade import surface
from scanspan.shade.color import LINEAR_FROM_SRGB8, encode_srgb, linear_color
from scanspan.shade.interpolate import (
    barycentric_kernel,
    interpolate_corners_kernel,
    interpolate_vertices_kernel,
    numbers_kernel,
)
from scanspan.shade.lamps import Lamps, find_around, gather_lamps, shine_kernel
from scanspan.shade.light import Lights, default_lights, light
from scanspan.shade.texture import sample_texture
from scanspan.shade.wireframe import overlay_edges_kernel

ROWS = 16  # shaded at a time: their buffers stay in the second-level cache


class Look(NamedTuple):
    """How surfaces shall look, all checked."""

    shading: str  # a name of surface.SHADINGS
    crease_angle: float  # degrees
    two_sided: bool
    textures: bool
    edges: bool
    line_width: float  # pixels
    edge_color: Float32Array  # (4,) linear
    translucency: bool  # whether alpha is blended
    lights: str  # "studio", "scene" or "viewer" of lamps.LIGHTINGS


class Glow(NamedTuple):
    """What materials show besides the light that they send back."""

    emissive: Float32Array  # (instances, 3) linear
    is_unlit: Array  # (instances,) bool


class Surfaces(NamedTuple):
    """All that shading needs to know of a scene for one camera."""

    normals: Float32Array  # (T, 3, 3) in the world
    uv: Float32Array | None  # (T, 3, 2)
    colors: Float32Array | None  # (T, 3, 4) linear
    base: Float32Array  # (instances, 4) linear
    glow: Glow | None  # of materials that send out light of their own or are not lit; None where there are none
    viewers: Float64Array  # (3, 3): towards the eye at pixel (0, 0), and its change a pixel to the right and down
    lights: Lights
    lamps: Lamps | None  # the scene's own lights, where they take the place of those
    look: Look


def gather_surfaces(
    scene: Scene, draw: DrawList, camera: Camera, size: tuple[int, int], up: Float64Array, look: Look
) -> Surfaces:
    """Return what shading needs of a scene."""
    base = [linear_color(instance.material.color_of(instance.has_colors)) for instance in scene.instances]
    return Surfaces(
        normals=surface.normals(scene, draw, look.shading, look.crease_angle),
        uv=surface.texture_coordinates(scene, draw),
        colors=surface.colors(scene, draw),
        base=np.array(base, np.float32).reshape(-1, 4),
        glow=gather_glow(scene),
        viewers=find_viewers(camera, size),
        lights=default_lights(camera.view, up),
        lamps=gather_lamps(scene, camera, look.lights),
        look=look,
    )


def are_translucent(scene: Scene, look: Look) -> BoolArray:
    """Return which instances may have an alpha below 1, (instances,), none where alpha is not blended."""
    if not look.translucency:
        return np.zeros(len(scene.instances), dtype=bool)
    return np.array([surface.is_translucent(instance, look.textures) for instance in scene.instances], dtype=bool)


def gather_glow(scene: Scene) -> Glow | None:
    """Return what materials show besides the light that they send back, None where no material does."""
    materials = [instance.material for instance in scene.instances]
    if all(material.is_lit and material.emissive_color is None for material in materials):
        return None
    emissive = [linear_color((*(material.emissive_color or (0.0, 0.0, 0.0)), 1.0))[:3] for material in materials]
    return Glow(np.array(emissive, np.float32), np.array([not material.is_lit for material in materials]))


def add_glow(glow: Glow, numbers: Int32Array, instance: Int32Array, unlit: Float32Array, lit: Float32Array) -> None:
    """Add what materials send out to the lit colours, and put back the colours of materials that are not lit.

    Shapes  numbers: (n,) int32, -1 for none; instance: (T,) int32; unlit, lit: (n, 4) float32, `lit` is changed.
    """
    seen = np.flatnonzero(numbers >= 0)
    owner = instance[numbers[seen]]
    plain = glow.is_unlit[owner]
    lit[seen[plain]] = unlit[seen[plain]]
    lit[seen, :3] += glow.emissive[owner]


def find_viewers(camera: Camera, size: tuple[int, int]) -> Float64Array:
    """Return the direction towards the eye at pixel (0, 0), and how it changes from pixel to pixel: (3, 3), in the world.

    Three rows of the projection take a direction in the camera to the image, so their inverse takes an image point to its
    direction.
    """
    rotation = camera.view[:3, :3].T
    if camera.is_orthographic:
        return np.concatenate([transform_directions(rotation, [(0.0, 0.0, 1.0)]), np.zeros((2, 3))])
    to_image = camera.projection(size)[[0, 1, 3], :3]
    image = np.array([(-1.0, 1.0, 1.0), (2.0 / size[0], 0.0, 0.0), (0.0, -2.0 / size[1], 0.0)])
    return -transform_directions(rotation, transform_directions(normal_matrix(to_image).T, image))


@kernel
def find_bases_kernel(
    numbers: Int32Array, instance: Int32Array, base: Float32Array, viewers: Float64Array, x: float, y: float, width: int,
    bases: Float32Array, towards: Float32Array,
) -> None:  # fmt: skip
    """Write the material's colour of every visible sample, and the direction from every sample to the eye.

    Shapes  numbers: (n,) int32, rows of `width` samples; instance: (T,) int32; base: (instances, 4) float32; viewers: (3, 3);
            bases: (n, 4), towards: (n, 3) float32.
    Units   x, y: place of the first sample in pixels.
    """
    for i in range(numbers.shape[0]):
        across, down = x + np.float64(i % width), y + np.float64(i // width)
        for k in range(3):
            towards[i, k] = np.float32(viewers[0, k] + (across * viewers[1, k] + down * viewers[2, k]))
        n = numbers[i]
        if n >= 0:
            for k in range(4):
                bases[i, k] = base[instance[n], k]


@kernel
def add_samples_kernel(numbers: Int32Array, colors: Float32Array, out: Float32Array) -> None:
    """Add the colours of visible samples, as opaque ones.

    Shapes  numbers: (n,) int32; colors: (n, 4), out: (n, 4) float32, premultiplied sums.
    """
    for i in range(numbers.shape[0]):
        if numbers[i] >= 0:
            out[i, 0] += colors[i, 0]
            out[i, 1] += colors[i, 1]
            out[i, 2] += colors[i, 2]
            out[i, 3] += np.float32(1.0)


@kernel
def add_layer_kernel(numbers: Int32Array, colors: Float32Array, through: Float32Array, out: Float32Array) -> None:
    """Add the colours of visible samples behind those that were added before, by their alpha.

    Shapes  numbers: (n,) int32; colors: (n, 4), out: (n, 4) float32, premultiplied sums; through: (n,) float32, the share that
            is still seen through what was added, overwritten.
    """
    one, zero = np.float32(1.0), np.float32(0.0)
    for i in range(numbers.shape[0]):
        if numbers[i] >= 0:
            alpha = min(max(colors[i, 3], zero), one)
            share = through[i] * alpha
            for k in range(3):
                out[i, k] += colors[i, k] * share
            out[i, 3] += share
            through[i] = through[i] * (one - alpha)


def multiply_textures(
    scene: Scene, draw: DrawList, numbers: Int32Array, uv: Float32Array, bases: Float32Array, around: Float32Array | None
) -> None:
    """Multiply the base colours, and those of ambient light, by what the textures have there.

    Shapes  numbers: (n,) int32; uv: (n, 2) float32, NaN where there are none; bases: (n, 4), around: (n, 3) float32.
    """
    shown = np.where(numbers >= 0, draw.instance[numbers], -1)
    for k in np.unique(shown[shown >= 0]).tolist():
        texture = scene.instances[k].material.texture
        if texture is None:
            continue
        where = np.flatnonzero((shown == k) & ~np.isnan(uv[:, 0]))
        found = np.empty((len(where), 4), np.float32)
        wrap_u, wrap_v = (WRAPS.index(name) for name in texture.wrap)
        sample_texture(texture.image, uv[where], FILTERS.index(texture.filter), wrap_u, wrap_v, LINEAR_FROM_SRGB8, found)
        bases[where] *= found
        if around is not None:
            around[where] *= found[:, :3]


def shade_rows(
    scene: Scene, draw: DrawList, screen: ScreenTriangles, surfaces: Surfaces, slots: Int32Array, offset: Array, bits: int,
    y_start: int, out: Float32Array, blend: str = "linear", through: Float32Array | None = None,
) -> None:  # fmt: skip
    """Shade some rows at one sample position and add them up.

    Parameters
    ----------
    slots : (h, W) int32, the visible rows of `screen` at that sample.
    offset : (2,) the sample's place in the pixel, in sub-pixels of `bits` bits.
    y_start : the image row of the first of them.
    out : (h, W, 4) float32, premultiplied sums, added to.
    blend : "linear", or "srgb" to add up sRGB values.
    through : (h, W) the share of the light that what lies nearer lets through, lowered by what is shaded here; None where
        nothing is translucent.
    """
    height, width = slots.shape
    count = height * width
    numbers, barycentric = np.empty(count, np.int32), np.empty((height, width, 3))
    numbers_kernel(slots.reshape(-1), screen.source, numbers)
    barycentric_kernel(slots, screen, offset[0], offset[1], bits, y_start, barycentric)
    weights = barycentric.reshape(-1, 3)

    # Find normals, base colours and the way to the eye.
    normals, bases, towards = (
        np.zeros((count, 3), np.float32),
        np.zeros((count, 4), np.float32),
        np.empty((count, 3), np.float32),
    )
    unit = float(1 << bits)
    interpolate_corners_kernel(numbers, weights, surfaces.normals, normals)
    find_bases_kernel(
        numbers, draw.instance, surfaces.base, surfaces.viewers, offset[0] / unit, y_start + offset[1] / unit, width,
        bases, towards,
    )  # fmt: skip
    if surfaces.colors is not None:
        shown = np.zeros((count, 4), np.float32)
        interpolate_corners_kernel(numbers, weights, surfaces.colors, shown)
        bases *= shown
    around = None if surfaces.lamps is None else find_around(surfaces.lamps, numbers, draw.instance, bases)
    if surfaces.uv is not None and surfaces.look.textures:
        uv = np.full((count, 2), np.nan, np.float32)
        interpolate_corners_kernel(numbers, weights, surfaces.uv, uv)
        multiply_textures(scene, draw, numbers, uv, bases, around)

    # Light them, draw the edges over them, and add them up.
    unlit = None if surfaces.glow is None else bases.copy()
    if surfaces.lamps is not None and around is not None:
        positions = np.zeros((count, 3))
        interpolate_vertices_kernel(numbers, weights, draw.triangles, draw.positions, positions)
        two_sided = int(surfaces.look.two_sided)
        shine_kernel(
            numbers, draw.instance, normals, positions, bases, around, towards, surfaces.lamps, two_sided, bases
        )  # fmt: skip
    else:
        light(normals, bases, towards, surfaces.lights, int(surfaces.look.two_sided), bases)
    if surfaces.glow is not None and unlit is not None:
        add_glow(surfaces.glow, numbers, draw.instance, unlit, bases)
    if surfaces.look.edges:
        look = surfaces.look
        overlay_edges_kernel(
            slots, screen, draw.inner, offset[0], offset[1], bits, y_start, look.line_width, look.edge_color,
            bases.reshape(height, width, 4),
        )  # fmt: skip
    if blend == "srgb":
        bases[:, :3] = encode_srgb(bases[:, :3]) / np.float32(255)
    if through is None:
        add_samples_kernel(numbers, bases, out.reshape(-1, 4))
    else:
        add_layer_kernel(numbers, bases, through.reshape(-1), out.reshape(-1, 4))
