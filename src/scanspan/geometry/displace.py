"""Displacement: move the vertices of a surface by a function, or by an image of heights.

What is one point has to move as one, or cracks open: vertices at one place that lie on a border of the mesh (a seam of texture
coordinates, a hard edge) share a normal, which is the sum of those around them weighted by angle, and then the mean of their
offsets. Two sheets that lie on one another are not seams, so only vertices on borders are welded.

The price is that a hard edge moves along a slanted normal, and that an image that does not fit along its seam makes a step
there.

Source: Cook, Carpenter and Catmull 1987 (displacement after dicing); Thuermer and Wuethrich 1998 (weights by angle); Abramowitz
and Stegun, 4.4.45 (arc cosine, error below 7e-5); OpenGL 4.6 core profile, section 8.14 (bilinear look-up).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scanspan.assets.arrays import as_array
from scanspan.assets.mesh import Mesh
from scanspan.errors import InputError
from scanspan.geometry.subdivide import Surface, unit
from scanspan.homogeneous import quote
from scanspan.records import Array, BoolArray, Float64Array, Int32Array, Int64Array

FARTHEST = 1e100  # units of the world that a displacement may reach, so that its square is a number
Displacement = Callable[[Float64Array, Float64Array, Float64Array | None], Any]


def check_displacement(displacement: Any, mesh: Mesh) -> tuple[Displacement, float]:
    """Return a displacement as a function, and how far it reaches as far as that is known from the start."""
    if callable(displacement):
        return displacement, 0.0
    heights = as_array(displacement, "displacement")
    if heights.ndim != 2 or not heights.size or heights.dtype.kind == "b":
        kind = f"shape {heights.shape} and type {heights.dtype}"
        raise InputError(f"displacement: expected a function or heights of shape (H, W), got {kind}")
    heights = heights.astype(np.float64)
    if not np.isfinite(heights).all():
        row, column = np.argwhere(~np.isfinite(heights))[0].tolist()
        raise InputError(f"displacement[{row}, {column}] = {heights[row, column]}: expected a finite height")
    if "uv" not in mesh.attributes and "uv" not in mesh.corners:
        raise InputError("displacement: an image of heights is looked up at texture coordinates, and the mesh has no 'uv'")
    return lambda positions, normals, uv: sample_heights(heights, uv), float(np.abs(heights).max())


def sample_heights(heights: Float64Array, uv: Any) -> Float64Array:
    """Look up an image of heights, bilinear and repeated.

    Parameters
    ----------
    heights : (H, W), row 0 is the top.
    uv : (n, 2), v up, (0, 0) the bottom-left corner; texel centres lie at half integers; what is not finite counts as 0.

    >>> sample_heights(np.array([[0.0, 1.0]]), np.array([[0.25, 0.5], [0.5, 0.5]])).tolist()
    [0.0, 0.5]
    """
    height, width = heights.shape
    inside = np.where(np.isfinite(uv), uv, 0.0)
    inside = inside - np.floor(inside)
    x, y = inside[:, 0] * width - 0.5, inside[:, 1] * height - 0.5
    left, low = np.floor(x), np.floor(y)
    s, t = x - left, y - low

    # Find the four texels around the place; beyond a border comes the other end.
    x0, y0 = left.astype(np.int64) % width, low.astype(np.int64) % height
    x1, y1 = (x0 + 1) % width, (y0 + 1) % height
    y0, y1 = height - 1 - y0, height - 1 - y1
    below = heights[y0, x0] + s * (heights[y0, x1] - heights[y0, x0])
    above = heights[y1, x0] + s * (heights[y1, x1] - heights[y1, x0])
    found: Float64Array = below + t * (above - below)
    return found


def prepare(mesh: Mesh) -> Mesh:
    """Return a mesh whose normals and texture coordinates are values of vertices, as displacement needs them.

    A vertex whose corners disagree becomes one vertex for each of their values. Normals that are missing are computed.
    """
    names = [name for name in ("uv", "normal") if name in mesh.corners]
    if names:
        mesh = split_vertices(mesh, names)
    positions, triangles = mesh.positions, mesh.triangles
    normals = mesh.attributes.get("normal", np.zeros(positions.shape)).astype(np.float64)
    missing = is_zero(normals)
    if missing.any():
        # Sum them at each place; where sheets that face opposite ways cancel out, at each vertex by itself.
        corners, place = geometric_normals(positions, triangles), find_seams(positions, triangles)
        summed = sum_normals(positions, triangles, place, corners)
        alone = sum_normals(positions, triangles, np.arange(len(positions)), corners)
        normals[missing] = np.where(is_zero(summed)[:, None], alone, summed)[missing]
    attributes = {**mesh.attributes, "normal": normals}
    return Mesh(mesh.positions, mesh.triangles, mesh.source, attributes, mesh.corners, mesh.inner, face_count=mesh.face_count)


def split_vertices(mesh: Mesh, names: list[str]) -> Mesh:
    """Return a mesh with a vertex for each place and value that its corners have; the values become those of vertices."""
    vertices = mesh.triangles.reshape(-1)
    columns = [vertices[:, None], *(mesh.corners[name].reshape(len(vertices), -1) for name in names)]
    rows = np.concatenate([column.astype(np.float64) for column in columns], axis=1) + 0.0
    _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    chosen = vertices[first]
    attributes = {name: values[chosen] for name, values in mesh.attributes.items()}
    attributes |= {name: mesh.corners[name].reshape(len(vertices), -1)[first] for name in names}
    corners = {name: values for name, values in mesh.corners.items() if name not in names}
    triangles = number.reshape(-1, 3)
    return Mesh(mesh.positions[chosen], triangles, mesh.source, attributes, corners, mesh.inner, face_count=mesh.face_count)


def weld(positions: Float64Array) -> Int64Array:
    """Return for each position the number of one that is equal to it, the same for all of them.

    >>> weld(np.array([[0.0, 0, 0], [1, 0, 0], [-0.0, 0, 0]])).tolist()
    [0, 1, 0]
    """
    keys = positions + 0.0
    order = np.lexsort((keys[:, 2], keys[:, 1], keys[:, 0]))
    starts = np.ones(len(keys), bool)
    starts[1:] = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
    place = np.empty(len(keys), np.int64)
    place[order] = order[np.flatnonzero(starts)][np.cumsum(starts) - 1]
    return place


def find_seams(positions: Float64Array, triangles: Int32Array) -> Int64Array:
    """Return for each vertex one that stands for all at its place, if they lie on a border of the mesh; else itself."""
    a, b = triangles[:, [1, 2, 0]].astype(np.int64).reshape(-1), triangles[:, [2, 0, 1]].astype(np.int64).reshape(-1)
    keys, counts = np.unique(np.minimum(a, b) * len(positions) + np.maximum(a, b), return_counts=True)
    border = np.unique(np.concatenate(np.divmod(keys[counts == 1], max(1, len(positions)))))
    place = np.arange(len(positions))
    place[border] = border[weld(positions[border])]
    return place


def is_zero(vectors: Float64Array) -> BoolArray:
    """Say which of (n, 3) vectors are zero."""
    return np.asarray(np.equal(vectors, 0.0).all(axis=1))


def cross(u: Float64Array, v: Float64Array) -> Float64Array:
    """Return the cross products of (n, 3) vectors."""
    ux, uy, uz = u.T
    vx, vy, vz = v.T
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)


def sides(positions: Float64Array, triangles: Int32Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the edges of triangles, each opposite corner 0, 1 and 2 and going round, in a scale at which squares fit."""
    corners = positions[triangles]
    largest = float(np.abs(corners).max()) if corners.size else 0.0
    corners = corners / largest if largest > 0.0 else corners
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return c - b, a - c, b - a


def geometric_normals(positions: Float64Array, triangles: Int32Array) -> Float64Array:
    """Return the unit normals of triangles at their corners, (T, 3, 3), zeros where there is no area."""
    _, second, third = sides(positions, triangles)
    return np.repeat(unit(cross(third, -second))[:, None], 3, axis=1)


def sum_normals(positions: Float64Array, triangles: Int32Array, place: Int64Array, corners: Float64Array) -> Float64Array:
    """Return (V, 3) unit normals: the sum of (T, 3, 3) normals at the corners of a place, each weighted by its angle.

    Where they cancel out, but for rounding, there is none, and it is (0, 0, 0).
    """
    edges = [unit(edge) for edge in sides(positions, triangles)]
    weights = np.empty(triangles.shape)
    for k in range(3):
        along, back = edges[(k + 1) % 3], edges[(k + 2) % 3]
        weights[:, k] = angle_of_cosine(-(along[:, 0] * back[:, 0] + along[:, 1] * back[:, 1] + along[:, 2] * back[:, 2]))
    where, count = place[triangles].reshape(-1), len(positions)
    sums = np.empty((count, 3))
    for axis in range(3):
        sums[:, axis] = np.bincount(where, (weights * corners[:, :, axis]).reshape(-1), count)
    total = np.bincount(where, weights.reshape(-1), count)
    sums[(np.abs(sums) <= 1e-9 * total[:, None]).all(axis=1)] = 0.0
    return unit(sums)[place]


def angle_of_cosine(cosine: Float64Array) -> Float64Array:
    """Return the arc cosine in radians, within 7e-5, by additions, multiplications and a square root."""
    x = np.minimum(np.abs(cosine), 1.0)
    angle = np.sqrt(1.0 - x) * (((-0.0187293 * x + 0.0742610) * x - 0.2121144) * x + 1.5707288)
    found: Float64Array = np.where(cosine >= 0.0, angle, np.pi - angle)
    return found


def displace(surface: Surface, displacement: Displacement) -> tuple[Float64Array, Int64Array]:
    """Return how far each vertex of a surface is moved, (V, 3), and which vertices stand for which."""
    positions, triangles = surface.positions, surface.triangles
    place, normals = find_seams(positions, triangles), unit(surface.attributes["normal"])
    shared = np.bincount(place, minlength=len(place))[place]
    if (shared > 1).any():
        summed = sum_normals(positions, triangles, place, normals[triangles])
        normals = np.where(((shared > 1) & ~is_zero(summed))[:, None], summed, normals)

    # Ask for the vertices that are used; the others may be anywhere.
    used = np.zeros(len(positions), bool)
    used[triangles] = True
    uv = surface.attributes["uv"][used] if "uv" in surface.attributes else None
    moved = displacement(positions[used], normals[used], uv)
    offsets = np.zeros(positions.shape)
    offsets[used] = as_offsets(moved, normals[used], positions[used])

    # Let what is one point move as one.
    if (shared > 1).any():
        means = np.stack([np.bincount(place, offsets[:, axis], len(place)) for axis in range(3)], axis=1)
        offsets = np.where((shared > 1)[:, None], means[place] / shared[:, None], offsets)
    return offsets, place


def as_offsets(moved: Any, normals: Float64Array, positions: Float64Array) -> Float64Array:
    """Return what a displacement gave as (n, 3) offsets: heights are measured along the normal."""
    values: Array = as_array(moved, "what displacement returned")
    n = len(positions)
    if values.shape not in ((n,), (n, 3)):
        raise InputError(f"what displacement returned: expected shape ({n},) or ({n}, 3), got {values.shape}")
    finite: BoolArray = np.asarray((np.abs(values.reshape(n, -1).astype(np.float64)) <= FARTHEST).all(axis=1))
    if not finite.all():
        first = int(np.argmin(finite))
        where = quote(tuple(positions[first].tolist()))
        raise InputError(f"displacement at {where} is {quote(values[first].tolist())}: expected numbers within {FARTHEST:g}")
    offsets: Float64Array = np.asarray(values, np.float64).reshape(n, -1)
    return offsets * normals if values.ndim == 1 else offsets


def displaced_normals(positions: Float64Array, surface: Surface, place: Int64Array) -> Float64Array:
    """Return (V, 3) normals of a displaced surface, by its small triangles; the given ones where those have no area."""
    summed = sum_normals(positions, surface.triangles, place, geometric_normals(positions, surface.triangles))
    found: Float64Array = np.where(is_zero(summed)[:, None], unit(surface.attributes["normal"]), summed)
    return found
