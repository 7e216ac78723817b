"""Surface attributes: normals, texture coordinates and colours at the corners of every triangle of a DrawList.

They are brought together only when shading asks for them; finding out what is visible needs none. What a geometry does not have
is left out: no normal is (0, 0, 0), no texture coordinate NaN, no colour white.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.scene import Instance, Scene
from scanspan.errors import unknown_name
from scanspan.homogeneous import normal_matrix, transform_directions
from scanspan.records import DrawList, Float32Array
from scanspan.shade.color import linear_colors
from scanspan.shade.normals import corner_normals

SHADINGS = {
    "auto": "the file's normals where it has them, else smooth, up to the mesh's own crease angle where it has one",
    "smooth": "faces that meet at less than the crease angle share a normal",
    "flat": "one normal a face",
}


def check_shading(shading: str) -> None:
    """Raise an InputError for a shading that is not known."""
    if not isinstance(shading, str) or shading not in SHADINGS:
        raise unknown_name("shading", shading, SHADINGS)


def per_corner(mesh: Mesh, name: str) -> NDArray[Any] | None:
    """Return an attribute of a mesh as (T, 3, k) values at the corners of its triangles, or None."""
    if name in mesh.corners:
        return mesh.corners[name]
    return mesh.attributes[name][mesh.triangles] if name in mesh.attributes else None


def normals_of(instance: Instance, shading: str, crease_angle: float) -> Float32Array:
    """Return (T, 3, 3) world normals, not normed, at the corners of a mesh's triangles."""
    mesh = instance.geometry
    assert isinstance(mesh, Mesh)
    stored = per_corner(mesh, "normal") if shading == "auto" else None
    angle = 0.0 if shading == "flat" else crease_angle
    if shading == "auto" and mesh.crease_angle is not None:
        angle = mesh.crease_angle
    if stored is None or not stored.any():
        stored = corner_normals(mesh.positions, mesh.triangles, mesh.source, angle)
    if np.array_equal(instance.transform[:3, :3], np.eye(3)):
        return np.ascontiguousarray(stored, np.float32)
    turned = transform_directions(normal_matrix(instance.transform), stored.reshape(-1, 3).astype(np.float64))

    # Bring all to one length, since a scale may have left them tiny or huge.
    length = np.sqrt(turned[:, 0] ** 2 + turned[:, 1] ** 2 + turned[:, 2] ** 2)[:, None]
    unit = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
    return unit.reshape(-1, 3, 3).astype(np.float32)


def corner_order(draw: DrawList, k: int) -> list[int]:
    """Return the order in which the DrawList has the corners of instance k."""
    return [0, 2, 1] if draw.mirrored[k] else [0, 1, 2]


def normals(scene: Scene, draw: DrawList, shading: str, crease_angle: float) -> Float32Array:
    """Return (T, 3, 3) float32 world normals at the corners of all triangles, 0 where there is none."""
    out = np.zeros((len(draw.triangles), 3, 3), np.float32)
    for k, instance in enumerate(scene.instances):
        if isinstance(instance.geometry, Mesh):
            out[draw.instance == k] = normals_of(instance, shading, crease_angle)[:, corner_order(draw, k)]
        elif isinstance(instance.geometry, Polygons):
            flat = transform_directions(normal_matrix(instance.transform), instance.geometry.normals)
            length = np.sqrt(flat[:, 0] ** 2 + flat[:, 1] ** 2 + flat[:, 2] ** 2)[:, None]
            out[draw.instance == k] = np.divide(flat, length, out=np.zeros_like(flat), where=length > 0)[:, None]
    return out


def texture_coordinates(scene: Scene, draw: DrawList) -> Float32Array | None:
    """Return (T, 3, 2) float32 texture coordinates at all triangles' corners, NaN where there are none; None if nowhere."""
    out = None
    for k, instance in enumerate(scene.instances):
        found = per_corner(instance.geometry, "uv") if isinstance(instance.geometry, Mesh) else None
        if found is not None:
            out = np.full((len(draw.triangles), 3, 2), np.nan, np.float32) if out is None else out
            out[draw.instance == k] = found[:, corner_order(draw, k)]
    return out


def colors(scene: Scene, draw: DrawList) -> Float32Array | None:
    """Return (T, 3, 4) float32 linear colours at the corners of all triangles, 1 where there are none; None if nowhere."""
    out = None
    for k, instance in enumerate(scene.instances):
        found = corner_colors(instance, draw.element[draw.instance == k])
        if found is not None:
            out = np.ones((len(draw.triangles), 3, 4), np.float32) if out is None else out
            out[draw.instance == k] = found[:, corner_order(draw, k)] if isinstance(instance.geometry, Mesh) else found
    return out


def is_translucent(instance: Instance, textures: bool) -> bool:
    """Say whether an instance may have an alpha below 1: of its material, its texture or its own colours."""
    material, geometry = instance.material, instance.geometry
    if material.color_of(instance.has_colors)[3] < 1.0:
        return True
    is_mesh = isinstance(geometry, Mesh)
    if textures and is_mesh and material.texture is not None and not material.texture.is_opaque:
        return True
    stored = per_corner(geometry, "color") if isinstance(geometry, Mesh) else geometry.colors
    if stored is None or stored.shape[-1] < 4 or not stored.size:
        return False
    return bool(stored[..., 3].min() < (255 if stored.dtype == np.uint8 else 1.0))


def corner_colors(instance: Instance, element: NDArray[np.int32]) -> Float32Array | None:
    """Return (T, 3, 4) linear colours at the corners of one instance's triangles, or None."""
    geometry = instance.geometry
    if isinstance(geometry, Mesh):
        stored = per_corner(geometry, "color")
        return None if stored is None else linear_colors(stored.reshape(-1, stored.shape[-1])).reshape(len(stored), 3, 4)
    if geometry.colors is None:
        return None
    values = linear_colors(np.atleast_2d(geometry.colors))
    if len(values) == 1:
        return np.broadcast_to(values, (len(element), 3, 4)).astype(np.float32)

    if isinstance(geometry, Polygons):
        return np.repeat(values[geometry.source[element]][:, None], 3, axis=1)

    # A quadrangle has corners a, b, b, a; its triangles take a, b, b and a, b, a.
    ends = getattr(geometry, "segments", None)
    if ends is None or len(values) == len(ends):
        return np.repeat(values[element][:, None], 3, axis=1)
    which = np.where(np.arange(len(element))[:, None] % 2 == 0, [0, 1, 1], [0, 1, 0])
    shown: Float32Array = values[ends[element[:, None], which]]
    return shown
