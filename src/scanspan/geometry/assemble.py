"""Assembly: a scene becomes one list of triangles in clip coordinates.

Instances follow each other in scene order, so the number of a triangle in the list orders like the number of its primitive.
A polygon is there as three of its corners, which span its plane, with its rings beside them (outlines.py). Segments and points
become quadrangles that face the camera: a point the square of its size round its position, as in Direct3D,
a segment the rectangle of its width round the line. So depth, numbers and merging hold for them without a word more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.cloud import PointCloud
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.rings import FILL_RULES
from scanspan.assets.scene import Geometry, Scene
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import LimitError
from scanspan.homogeneous import compose, transform_points
from scanspan.records import Array, DrawList, Float64Array, Int32Array, Outlines

MAX_TRIANGLES = (1 << 31) - 1

# The two triangles of a quadrangle, and their common edge as seen from each.
QUAD = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


class Part(NamedTuple):
    """One instance's share of a DrawList, with numbers that begin at 0."""

    clip: Float64Array
    positions: Float64Array
    triangles: Int32Array
    primitive: Array
    element: Array
    inner: Array


def assemble(scene: Scene, camera: Camera, size: tuple[int, int]) -> DrawList:
    """Return the triangles of a scene as a camera sees them.

    Parameters
    ----------
    scene : what to draw.
    camera : from where.
    size : (width, height) of the image in pixels.

    Raises
    ------
    LimitError : for more triangles than can be numbered.
    """
    to_clip = camera.clip_matrix(size)
    parts, mirrored = [], []
    for instance in scene.instances:
        part = make_part(instance.geometry, instance.transform, compose(to_clip, instance.transform), size)
        mirrored.append(is_mirrored(instance.transform))
        parts.append(swap_corners(part) if mirrored[-1] and isinstance(instance.geometry, (Mesh, Polygons)) else part)
    if sum(len(part.triangles) for part in parts) > MAX_TRIANGLES:
        raise LimitError(f"{sum(len(part.triangles) for part in parts)} triangles: at most {MAX_TRIANGLES} can be numbered")

    # Number vertices and primitives through all parts.
    first_vertex = np.cumsum([0, *(len(part.clip) for part in parts)])
    firsts = scene.first_primitive
    return DrawList(
        clip=stack([part.clip for part in parts], (0, 4), np.float64),
        positions=stack([part.positions for part in parts], (0, 3), np.float64),
        triangles=stack([part.triangles + offset for part, offset in zip(parts, first_vertex, strict=False)], (0, 3), np.int32),
        primitive=stack([part.primitive + offset for part, offset in zip(parts, firsts, strict=False)], (0,), np.int32),
        instance=stack([np.full(len(part.triangles), k) for k, part in enumerate(parts)], (0,), np.int32),
        element=stack([part.element for part in parts], (0,), np.int32),
        inner=stack([part.inner for part in parts], (0,), np.uint8),
        mirrored=np.array(mirrored, bool),
        outlines=gather_outlines(scene, parts, first_vertex),
    )


def gather_outlines(scene: Scene, parts: list[Part], first_vertex: Array) -> Outlines | None:
    """Return the polygons of a scene, numbered through all its parts, or None."""
    first_triangle = np.cumsum([0, *(len(part.triangles) for part in parts)])
    triangle: list[Array] = []
    rings: list[Array] = []
    polygon_rings: list[Array] = [np.zeros(1, np.int64)]
    fill_rule: list[Array] = []
    for k, instance in enumerate(scene.instances):
        shape = instance.geometry
        if isinstance(shape, Polygons):
            starts, before = shape.ring_starts.astype(np.int64) + first_vertex[k], sum(len(found) for found in rings)
            triangle.append(first_triangle[k] + np.arange(len(shape.source)))
            rings.append(np.stack([starts[:-1], starts[1:]], axis=1))
            polygon_rings.append(shape.polygon_rings[1:].astype(np.int64) + before)
            fill_rule.append(np.full(len(shape.source), FILL_RULES.index(shape.fill_rule)))
    if not triangle:
        return None
    return Outlines(
        np.concatenate(triangle).astype(np.int32), np.concatenate(rings), np.concatenate(polygon_rings),
        np.concatenate(fill_rule).astype(np.int64),
    )  # fmt: skip


def stack(arrays: list[Array], empty: tuple[int, ...], dtype: type) -> Array:
    """Return arrays one after the other in one type, as kernels take them; a single one is copied only if it is read-only."""
    if not arrays:
        return np.empty(empty, dtype)
    return np.require(arrays[0] if len(arrays) == 1 else np.concatenate(arrays), dtype, ["C", "A", "W"])


def is_mirrored(transform: Float64Array) -> bool:
    """Say whether a transform turns left hands into right ones: its determinant is negative."""
    a, b, c = transform[:3, :3].tolist()
    determinant: float = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return determinant < 0


def swap_corners(part: Part) -> Part:
    """Return a part with corners 1 and 2 of its triangles swapped, so that its front is the front again."""
    swapped = (part.inner & 1) | ((part.inner & 2) << 1) | ((part.inner & 4) >> 1)
    return part._replace(triangles=np.ascontiguousarray(part.triangles[:, [0, 2, 1]]), inner=swapped)


def make_part(geometry: Geometry, to_world: Float64Array, to_clip: Float64Array, size: tuple[int, int]) -> Part:
    """Return the triangles of one geometry."""
    places = geometry.positions
    world, clip = transform_points(to_world, places)[:, :3], transform_points(to_clip, places)
    if isinstance(geometry, Mesh):
        count = np.arange(len(geometry.triangles), dtype=np.int32)
        return Part(clip, world, geometry.triangles, geometry.source, count, geometry.inner)
    if isinstance(geometry, Polygons):
        element = np.arange(len(geometry.source), dtype=np.int32)
        return Part(clip, world, geometry.reference, geometry.source, element, np.full(len(element), 7, np.uint8))
    if isinstance(geometry, (Points, PointCloud)):
        return quads(clip, clip, world, world, np.array([[-1.0, 0.0]]), geometry.size or 1.0, size, caps=True)
    return segment_quads(clip, world, geometry, size)


def segment_quads(clip: Float64Array, world: Float64Array, geometry: Segments, size: tuple[int, int]) -> Part:
    """Return a rectangle for each segment, after cutting off what lies behind the near plane."""
    a, b = clip[geometry.segments[:, 0]], clip[geometry.segments[:, 1]]
    a_world, b_world = world[geometry.segments[:, 0]], world[geometry.segments[:, 1]]

    # Move an end that lies behind the near plane onto it; a segment that is all behind stays there and is dropped later.
    from_a, from_b = a[:, 2] + a[:, 3], b[:, 2] + b[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where((from_a < 0) != (from_b < 0), from_a / (from_a - from_b), 0.0)[:, None]
    cut, cut_world = a + share * (b - a), a_world + share * (b_world - a_world)
    a_behind, b_behind = ((from_a < 0) & (from_b >= 0))[:, None], ((from_b < 0) & (from_a >= 0))[:, None]
    a, a_world = np.where(a_behind, cut, a), np.where(a_behind, cut_world, a_world)
    b, b_world = np.where(b_behind, cut, b), np.where(b_behind, cut_world, b_world)

    # Find the direction on the screen.
    with np.errstate(divide="ignore", invalid="ignore"):
        across = (b[:, :2] / b[:, 3:] - a[:, :2] / a[:, 3:]) * (size[0] / 2, size[1] / 2)
        across /= np.sqrt(across[:, :1] ** 2 + across[:, 1:] ** 2)
    across = np.where(np.all(np.isfinite(across), axis=1)[:, None], across, 0.0)
    return quads(a, b, a_world, b_world, across, geometry.width, size, caps=False)


def quads(
    a: Float64Array, b: Float64Array, a_world: Float64Array, b_world: Float64Array, along: Float64Array, width: float,
    size: tuple[int, int], *, caps: bool,
) -> Part:  # fmt: skip
    """Return a rectangle of a width in pixels round each line from a to b, lengthened by half of it where there are caps.

    Shapes  a, b: (S, 4) clip coordinates; along: (S, 2) or (1, 2) unit direction on the screen, y up.
    """
    pixel = np.array([2.0 / size[0], 2.0 / size[1]])
    side = np.stack([-along[:, 1], along[:, 0]], axis=1) * (width / 2) * pixel
    ahead = along * (width / 2 if caps else 0.0) * pixel
    corners = np.stack([a, b, b, a], axis=1)
    offsets = np.stack([-side - ahead, -side + ahead, side + ahead, side - ahead], axis=1)
    corners[:, :, :2] += offsets * corners[:, :, 3:]
    count = len(a)
    number = np.repeat(np.arange(count, dtype=np.int32), 2)
    return Part(
        clip=corners.reshape(-1, 4),
        positions=np.stack([a_world, b_world, b_world, a_world], axis=1).reshape(-1, 3),
        triangles=(QUAD + 4 * np.arange(count, dtype=np.int32)[:, None, None]).reshape(-1, 3),
        primitive=number,
        element=number,
        inner=np.full(2 * count, 7, np.uint8),
    )
