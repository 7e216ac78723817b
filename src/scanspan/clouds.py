"""The face for scenes of point clouds alone: as `render` for other scenes, assets -> geometry -> raster -> shade -> target.

Each sample of a pixel finds its nearest point; then the colours of those points are looked up, darkened by what stands before
them (shade/eyedome.py), added up and averaged. With Gaussian splats, the colours of all splats close behind the nearest are
blended instead.
"""

from __future__ import annotations

from threading import Event
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.framing import parse_up
from scanspan.assets.scene import Instance, Scene
from scanspan.bands import run_bands
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.geometry.spacing import find_spacing
from scanspan.homogeneous import compose, quote, transform_points
from scanspan.raster.splat_sums import DEEP, blend_splats
from scanspan.raster.splats import PAD, cut_blocks, draw_splats, new_keys, pixel_matrix
from scanspan.raster.write import EMPTY_KEY, NUMBER_MASK
from scanspan.records import Array, Float32Array, Float64Array, Int64Array, UInt16Array
from scanspan.shade.cloud_colors import Coloring, check_choice, choose_colorings, cloud_of, point_colors
from scanspan.shade.color import LINEAR_FROM_SRGB8
from scanspan.shade.eyedome import eye_dome
from scanspan.target.cloud_frame import CloudFrame
from scanspan.target.points import add_blended, add_light, find_distances
from scanspan.target.resolve import resolve

SHAPES = ("square", "disc", "gaussian")
SIZES = ("density", "spacing")
COVER = 1.1  # radius of a splat, in distances between points: what closes a surface of points that lie as they fall
MOST_PIXELS = 4096.0  # of a size that is asked for
WIDEST = 128.0  # pixels, the largest radius of splats that follow the spacing: near the eye, few would fill the picture
CHUNK = 1 << 18  # points that are coloured at once
MAX_POINTS = 1 << 32  # that can be numbered


class CloudLook(NamedTuple):
    """How points are shown, all checked."""

    size: float | str | None  # pixels, or a name of SIZES; None is the cloud's own, else "density"
    shape: str
    color_by: str
    strength: float  # of eye-dome lighting
    reach: int = 1  # pixels to the nearest neighbour of eye-dome lighting


class Part(NamedTuple):
    """One instance, ready to be drawn."""

    instance: Instance
    positions: Array
    blocks: Int64Array
    origins: Float64Array
    steps: Float64Array
    radii: Float64Array | None
    shares: Float32Array | None
    most: float  # pixels, the largest radius


def check_cloud_look(point_size: Any = None, point_shape: Any = None, color_by: Any = None, eye_dome: Any = None) -> CloudLook:
    """Return how points are to be shown, or raise an InputError that quotes what cannot be."""
    if isinstance(point_size, str):
        if point_size not in SIZES:
            raise unknown_name("point_size", point_size, SIZES)
    elif point_size is not None and (not _is_number(point_size) or not 0.0 < point_size <= MOST_PIXELS):
        raise InputError(
            f"point_size = {quote(point_size)}: expected pixels above 0, up to {MOST_PIXELS:g}, or density or spacing"
        )
    shape = "disc" if point_shape is None else point_shape
    if not isinstance(shape, str) or shape not in SHAPES:
        raise unknown_name("point_shape", shape, SHAPES)
    choice = check_choice("auto" if color_by is None else color_by)
    flag = True if eye_dome is None else eye_dome
    strength = float(flag) if isinstance(flag, (bool, np.bool_)) else flag
    if not _is_number(strength) or not 0.0 <= strength <= 100.0:
        raise InputError(f"eye_dome = {quote(eye_dome)}: expected True, False or a strength from 0 to 100")
    length = point_size if point_size is None or isinstance(point_size, str) else float(point_size)
    return CloudLook(length, shape, choice, float(strength))


def _is_number(value: Any) -> bool:
    """Say whether a value is a number, and no truth value."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, (bool, np.bool_))


def render_clouds(
    scene: Scene, camera: Camera, size: tuple[int, int], look: CloudLook, *, offsets: Float64Array, background: Float32Array,
    blend: str, up: Any, threads: int,
) -> CloudFrame:  # fmt: skip
    """Render a scene of point clouds.

    Parameters
    ----------
    scene, camera, size, threads : as for `render`, checked.
    look : from `check_cloud_look`.
    offsets : (S, 2) the samples of a pixel, in pixels from its corner.
    background, blend : as for `target.resolve`.
    up : direction along which heights are measured.
    """
    if scene.primitive_count > MAX_POINTS:
        raise LimitError(f"{scene.primitive_count} points: at most {MAX_POINTS} can be numbered")
    parts = [make_part(scene, k, camera, size, look) for k in range(len(scene.instances))]
    look = look._replace(reach=choose_reach(parts, scene, camera, size))
    colorings = choose_colorings(scene.instances, look.color_by, parse_up(up))
    light = [splat_light(*one, blend) for one in zip(parts, colorings, strict=True)] if look.shape == "gaussian" else []
    sums, centre = np.zeros((size[0] * size[1], 4), np.float32), None
    for offset in offsets:
        place = (float(offset[0]), float(offset[1]))
        keys = draw_parts(parts, camera, size, look, place, threads)
        if look.shape == "gaussian":
            add_blended_sample(parts, camera, keys, size, look, light, place, threads, sums)
        else:
            add_sample(parts, scene, camera, keys, size, look, colorings, blend, threads, sums)
        centre = keys if place == (0.5, 0.5) else centre
    color = resolve(sums.reshape(size[1], size[0], 4), len(offsets), background, blend)
    if centre is None:
        centre = draw_parts(parts, camera, size, look, (0.5, 0.5), threads)
    return CloudFrame(color, centre[:-PAD], scene=scene, camera=camera, size=size)


def make_part(scene: Scene, k: int, camera: Camera, size: tuple[int, int], look: CloudLook) -> Part:
    """Return instance k of a scene, with what the kernels take and the sizes of its splats."""
    instance = scene.instances[k]
    cloud = cloud_of(instance)
    blocks = cut_blocks(len(cloud), number=scene.first_primitive[k])
    origins, steps = np.tile(cloud.offset, (len(blocks), 1)), np.tile(cloud.scale, (len(blocks), 1))
    chosen = look.size if look.size is not None else cloud.size if cloud.size is not None else "density"
    if isinstance(chosen, float):
        is_point = chosen <= 1.0 and look.shape != "gaussian"
        radii = None if is_point else np.tile([chosen / 2.0, 0.0], (len(blocks), 1))
        return Part(instance, cloud.stored, blocks, origins, steps, radii, None, chosen / 2.0)

    # Let a splat reach over the gap to its neighbours, as large as that is on the screen.
    spacing = find_spacing(cloud)
    reach = COVER * spacing.typical * stretch(instance.transform) * pixels_per_unit(camera, size)
    radii = np.tile([0.0, reach], (len(blocks), 1))
    shares = spacing.share if chosen == "density" else None
    return Part(instance, cloud.stored, blocks, origins, steps, radii, shares, WIDEST)


def choose_reach(parts: list[Part], scene: Scene, camera: Camera, size: tuple[int, int]) -> int:
    """Return how far eye-dome lighting looks: one and a half radii of a splat in the middle of the scene, 1 to 8 pixels."""
    low, high = scene.bounds
    middle = low / 2.0 + high / 2.0
    w = float(transform_points(camera.clip_matrix(size), middle[None])[0, 3]) if np.isfinite(middle).all() else 0.0
    found = [part.radii[0] for part in parts if part.radii is not None and len(part.radii)]
    radii = [float(fixed + scale / w) for fixed, scale in found if w > 0.0]
    return int(min(max(np.rint(1.5 * max(radii, default=0.5)), 1.0), 8.0))


def stretch(transform: Float64Array) -> float:
    """Return by how much a transform lengthens, at most."""
    squares = (transform[:3, :3] * transform[:3, :3]).sum(axis=0)
    return float(np.sqrt(squares.max()))


def pixels_per_unit(camera: Camera, size: tuple[int, int]) -> float:
    """Return how many pixels a unit is long at w = 1: at distance 1, or anywhere without perspective."""
    return abs(float(camera.projection(size)[1, 1])) * size[1] / 2.0


def draw_parts(
    parts: list[Part], camera: Camera, size: tuple[int, int], look: CloudLook, offset: tuple[float, float], threads: int
) -> Int64Array:
    """Return the keys of one sample of every pixel."""
    keys, to_clip = new_keys(size), camera.clip_matrix(size)
    for part in parts:
        matrix = pixel_matrix(compose(to_clip, part.instance.transform), size, offset)
        draw_splats(
            keys, size, part.positions, part.blocks, part.origins, part.steps, matrix[None], radii=part.radii,
            shares=part.shares, shape="square" if look.shape == "square" else "disc", most=part.most,
            has_far=camera.has_far, threads=threads,
        )  # fmt: skip
    return keys


def add_sample(
    parts: list[Part], scene: Scene, camera: Camera, keys: Int64Array, size: tuple[int, int], look: CloudLook,
    colorings: list[Coloring], blend: str, threads: int, sums: Float32Array,
) -> None:  # fmt: skip
    """Shade what one sample of every pixel sees, and add it to the sums."""
    pixels = np.flatnonzero(keys[:-PAD] != EMPTY_KEY)
    numbers = NUMBER_MASK - (keys[pixels] & NUMBER_MASK)
    codes, firsts = np.empty((len(pixels), 4), np.uint8), np.array(scene.first_primitive)
    owner = np.searchsorted(firsts, numbers, side="right") - 1 if len(parts) > 1 else np.zeros(len(pixels), np.int64)
    for k, part in enumerate(parts):
        mine = owner == k if len(parts) > 1 else slice(None)
        codes[mine] = point_colors(part.instance, numbers[mine] - firsts[k], colorings[k])
    add_light(pixels, codes, light_of_codes(blend), find_shade(camera, keys, size, look, threads).reshape(-1), sums)


def light_of_codes(blend: str) -> Float32Array:
    """Return what is averaged for each code, (256,): its light, or for "srgb" itself."""
    return LINEAR_FROM_SRGB8 if blend == "linear" else (np.arange(256) / 255.0).astype(np.float32)


def splat_light(part: Part, coloring: Coloring, blend: str) -> UInt16Array:
    """Return the light of all points of a part, (N, 4) uint16, premultiplied by alpha."""
    count, table = len(part.positions), light_of_codes(blend)
    light = np.empty((count, 4), np.uint16)
    for first in range(0, count, CHUNK):
        codes = point_colors(part.instance, np.arange(first, min(first + CHUNK, count)), coloring)
        alpha = codes[:, 3:] / 255.0
        light[first : first + CHUNK] = np.rint(np.concatenate([table[codes[:, :3]] * alpha, alpha], axis=1) * 65535.0)
    return light


def add_blended_sample(
    parts: list[Part], camera: Camera, keys: Int64Array, size: tuple[int, int], look: CloudLook, light: list[UInt16Array],
    offset: tuple[float, float], threads: int, sums: Float32Array,
) -> None:  # fmt: skip
    """Blend the splats at one sample of every pixel, and add them to the sums."""
    p, to_clip = camera.projection(size), camera.clip_matrix(size)
    towards = np.array([(p[3, 2] - p[2, 2]) / 2.0, p[3, 2], DEEP / pixels_per_unit(camera, size)])
    blended = np.zeros((size[0] * size[1], 5), np.int64)
    for part, own in zip(parts, light, strict=True):
        matrix = pixel_matrix(compose(to_clip, part.instance.transform), size, offset)
        assert part.radii is not None
        blend_splats(
            keys, size, part.positions, part.blocks, part.origins, part.steps, matrix[None], own, towards, radii=part.radii,
            shares=part.shares, most=part.most, has_far=camera.has_far, threads=threads, sums=blended,
        )  # fmt: skip
    add_blended(blended, find_shade(camera, keys, size, look, threads).reshape(-1), sums)


def find_shade(camera: Camera, keys: Int64Array, size: tuple[int, int], look: CloudLook, threads: int) -> Float32Array:
    """Return by how much eye-dome lighting lessens the light of each pixel, (H, W)."""
    width, height = size
    factor = np.ones((height, width), np.float32)
    if look.strength == 0.0:
        return factor
    p, distance = camera.projection(size), np.empty((height, width), np.float32)
    find_distances(keys, p[3, 3] - p[2, 3], -2.0 * p[3, 3], p[2, 2] - p[3, 2], 2.0 * p[3, 2], distance.reshape(-1))
    per_pixel, reach = 1.0 / pixels_per_unit(camera, size), look.reach

    def darken(y_start: int, y_end: int, stop: Event) -> None:
        """Light the rows of one band."""
        eye_dome(distance, y_start, y_end, per_pixel, camera.is_orthographic, reach, look.strength, factor)

    run_bands(darken, height, threads)
    return factor
