"""Subdivision: cut triangles at the middles of marked edges, and carry along what is known at their vertices and corners.

A marked edge gets one new vertex, whichever triangle asks for it, and a triangle with 1, 2 or 3 marked edges becomes 2, 3 or 4.
So the mesh stays conforming: no crack and no vertex in the middle of a neighbour's edge. Nothing depends on the order in which
triangles or corners are listed: the middle of a and b is that of b and a to the last bit, and of the two diagonals that cut
off a corner leaves, the shorter is taken.

Values are halved in float64, colours as light, because that is how shading interpolates them; what was there before comes back
bit for bit. The price is that all values are copied in each round.

Source: Cook, Carpenter and Catmull 1987 (the split); R. E. Bank, A. H. Sherman and A. Weiser, Refinement Algorithms, 1983 (the
patterns).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.assets.material import linear_to_srgb
from scanspan.assets.mesh import Mesh
from scanspan.records import Array, BoolArray, Float64Array, Int32Array, UInt8Array


class Surface(NamedTuple):
    """A mesh while it is being subdivided: T triangles over V vertices, values in float64."""

    positions: Float64Array  # (V, 3)
    triangles: Int32Array  # (T, 3)
    source: Int32Array  # (T,)
    inner: UInt8Array  # (T,)
    attributes: dict[str, Float64Array]  # (V, k) each
    corners: dict[str, Float64Array]  # (T, 3, k) each
    given: Int32Array  # (T, 3) the number of each corner among those of the mesh, row by row; -1 for a new one; empty if unused


def children_of(code: int) -> list[tuple[int, int, int]]:
    """Return the triangles that a triangle is cut into.

    Bit k of the code: the edge opposite corner k is cut; bit 3: of two diagonals the second. Numbers 0 to 2 are the corners,
    and 3 + k is the middle of the edge opposite corner k.
    """
    cut = [k for k in range(3) if code >> k & 1]
    if len(cut) == 3:
        return [(0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5)]
    if not cut:
        return [(0, 1, 2)]
    p = cut[0] if len(cut) == 1 else 3 - cut[0] - cut[1]
    q, r = (p + 1) % 3, (p + 2) % 3
    if len(cut) == 1:
        return [(p, q, 3 + p), (p, 3 + p, r)]

    # Cut off corner p; the diagonal of what remains begins at q or at r.
    tip = (p, 3 + r, 3 + q)
    return [tip, (3 + r, q, r), (3 + r, r, 3 + q)] if code & 8 else [tip, (3 + r, q, 3 + q), (q, r, 3 + q)]


def edge_between(a: int, b: int) -> int:
    """Return which edge of the triangle two of its corners or middles lie on; 3 for none."""
    return next((k for k in range(3) if {a, b} <= {(k + 1) % 3, (k + 2) % 3, 3 + k}), 3)


COUNTS = np.array([len(children_of(code)) for code in range(16)])
CHILDREN = np.zeros((16, 4, 3), np.int64)
EDGES = np.full((16, 4, 3), 3)  # the parent's edge that the edge opposite a child's corner is part of, 3 for none
for _code in range(16):
    for _n, _child in enumerate(children_of(_code)):
        CHILDREN[_code, _n] = _child
        EDGES[_code, _n] = [edge_between(_child[(k + 1) % 3], _child[(k + 2) % 3]) for k in range(3)]


def halve(a: Float64Array, b: Float64Array) -> Float64Array:
    """Return what lies in the middle; the same bits for either order, and no overflow."""
    return 0.5 * a + 0.5 * b


def split(surface: Surface, marks: BoolArray) -> Surface:
    """Cut the triangles of a surface at the middles of marked edges.

    Parameters
    ----------
    marks : (T, 3), whether the edge opposite each corner is cut; the triangles that share an edge have to agree.
    """
    triangles, count = surface.triangles, len(surface.positions)

    # Give each marked edge a vertex in its middle.
    rows, edges = np.nonzero(marks)
    a, b = triangles[rows, (edges + 1) % 3].astype(np.int64), triangles[rows, (edges + 2) % 3].astype(np.int64)
    keys, number = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
    low, high = np.divmod(keys, count)
    positions = np.concatenate([surface.positions, halve(surface.positions[low], surface.positions[high])])
    attributes = {name: np.concatenate([v, halve(v[low], v[high])]) for name, v in surface.attributes.items()}
    six = np.full((len(triangles), 6), -1, np.int32)
    six[:, :3] = triangles
    six[rows, 3 + edges] = count + number.reshape(-1)

    # Look up the children of each triangle, in its place, so that the numbers of faces never decrease.
    code = marks[:, 0] + 2 * marks[:, 1] + 4 * marks[:, 2] + 8 * takes_second_diagonal(marks, six, positions)
    parent = np.repeat(np.arange(len(triangles)), COUNTS[code])
    nth = np.arange(len(parent)) - np.repeat(np.cumsum(COUNTS[code]) - COUNTS[code], COUNTS[code])
    slots = CHILDREN[code[parent], nth]
    row = parent[:, None]

    # An edge made here is an inner one; a part of an edge is what that was.
    is_inner = np.ones((len(triangles), 4), bool)
    is_inner[:, :3] = surface.inner[:, None] >> np.arange(3) & 1
    inner = np.packbits(is_inner[row, EDGES[code[parent], nth]], axis=1, bitorder="little")[:, 0]
    given = surface.given
    if len(given):
        given = np.concatenate([given, np.full_like(given, -1)], axis=1)[row, slots]
    return Surface(
        positions=positions,
        triangles=six[row, slots],
        source=surface.source[parent],
        inner=inner,
        attributes=attributes,
        corners={name: with_middles(values)[row, slots] for name, values in surface.corners.items()},
        given=given,
    )


def with_middles(values: Float64Array) -> Float64Array:
    """Return (T, 6, k) values at the corners of triangles and at the middles of the edges opposite them."""
    return np.concatenate([values, halve(values[:, [1, 2, 0]], values[:, [2, 0, 1]])], axis=1)


def takes_second_diagonal(marks: BoolArray, six: Int32Array, positions: Float64Array) -> BoolArray:
    """Say which triangles with two marked edges are cut along the second diagonal, from corner r and not from corner q.

    It is the shorter one; of two that are equally long, the one from the corner with the lower coordinates.
    """
    second = np.zeros(len(marks), bool)
    rows = np.flatnonzero(marks.sum(axis=1) == 2)
    p = np.argmin(marks[rows], axis=1)
    q, r = (p + 1) % 3, (p + 2) % 3
    at_q, at_r = positions[six[rows, q]], positions[six[rows, r]]
    from_q, from_r = at_q - positions[six[rows, 3 + q]], at_r - positions[six[rows, 3 + r]]
    square_q = from_q[:, 0] ** 2 + from_q[:, 1] ** 2 + from_q[:, 2] ** 2
    square_r = from_r[:, 0] ** 2 + from_r[:, 1] ** 2 + from_r[:, 2] ** 2

    # Compare x, then y, then z, where the lengths tie.
    lower = at_r[:, 2] < at_q[:, 2]
    for axis in (1, 0):
        lower = np.where(at_r[:, axis] == at_q[:, axis], lower, at_r[:, axis] < at_q[:, axis])
    second[rows] = np.where(square_q == square_r, lower, square_r < square_q)
    return second


def open_mesh(mesh: Mesh) -> Surface:
    """Return a mesh as a surface that can be split."""
    count = len(mesh.triangles) if mesh.corners else 0
    return Surface(
        positions=mesh.positions,
        triangles=mesh.triangles,
        source=mesh.source,
        inner=mesh.inner,
        attributes={name: to_values(name, values) for name, values in mesh.attributes.items()},
        corners={name: to_values(name, values) for name, values in mesh.corners.items()},
        given=np.arange(3 * count, dtype=np.int32).reshape(count, 3),
    )


def close_mesh(surface: Surface, mesh: Mesh) -> Mesh:
    """Return a split surface as a mesh; vertices and corners that `mesh` had keep their values bit for bit."""
    attributes, corners = {}, {}
    for name, values in surface.attributes.items():
        attributes[name] = from_values(name, values, mesh.attributes[name].dtype)
        attributes[name][: len(mesh.positions)] = mesh.attributes[name]
    for name, values in surface.corners.items():
        corners[name] = from_values(name, values, mesh.corners[name].dtype)
        known = surface.given >= 0
        corners[name][known] = mesh.corners[name].reshape(-1, values.shape[-1])[surface.given[known]]
    return Mesh(
        surface.positions, surface.triangles, surface.source, attributes, corners, surface.inner, face_count=mesh.face_count
    )


def to_values(name: str, stored: Array) -> Float64Array:
    """Return an attribute as numbers that may be averaged: colours as light."""
    values = stored.astype(np.float64)
    if name == "color":
        if stored.dtype == np.uint8:
            values /= 255.0
        values[..., :3] = srgb_to_linear(values[..., :3])
    return values


def from_values(name: str, values: Float64Array, dtype: np.dtype[np.generic]) -> Array:
    """Return what `to_values` made in its type again; whole numbers other than colours become float64."""
    if name == "color":
        encoded = np.concatenate([linear_to_srgb(values[..., :3]), values[..., 3:]], axis=-1)
        return np.rint(encoded * 255.0).astype(np.uint8) if dtype == np.uint8 else encoded.astype(dtype)
    if name == "normal":
        return unit(values).astype(dtype)
    kept: Array = values.astype(dtype if dtype.kind == "f" else np.float64)
    return kept


def srgb_to_linear(values: Float64Array) -> Float64Array:
    """Decode sRGB 0..1 to linear light, to twelve decimals as `linear_to_srgb` encodes it. Source: IEC 61966-2-1.

    >>> srgb_to_linear(np.array([0.0, 0.5, 1.0])).round(4).tolist()
    [0.0, 0.214, 1.0]
    """
    curve = ((values + 0.055) / 1.055) ** 2.4
    return np.asarray(np.round(np.where(values <= 0.04045, values / 12.92, curve), 12), dtype=np.float64)


def unit(vectors: Float64Array) -> Float64Array:
    """Return vectors of length one; what has no length, or none that is finite, becomes zero.

    >>> unit(np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])).tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
    """
    length = np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2 + vectors[..., 2] ** 2)[..., None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=(length > 0.0) & (length < np.inf))
