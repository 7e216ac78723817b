"""Tessellation: polygons of any kind as meshes. For what draws or reckons with triangles alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array
from scanspan.assets.mesh import Mesh
from scanspan.assets.rings import FILL_RULES, join_rings, number_rings
from scanspan.errors import InputError, unknown_name
from scanspan.geometry.fixed_point import snap_points
from scanspan.geometry.polygon_triangles import PolygonTriangles, carry_values, triangulate_rings
from scanspan.raster.options import check_subpixel_bits
from scanspan.records import Int64Array


def triangulate(
    rings: Any, fill_rule: str = "even-odd", *, attributes: Mapping[str, ArrayLike] | None = None, subpixel_bits: int = 16
) -> Mesh:
    """Cut a polygon into triangles: convex, concave, with holes, or crossing itself.

    Points are snapped to 1/2^s of a pixel, and then nothing is inexact: the triangles do not overlap, leave no gap, and none is
    without an area. A corner on a side or a diagonal is a corner of the triangles on both sides. A crossing is not on that
    grid. It becomes a point at most half of 1/2^s away from it in x and in y, to which the edges are bent; no edge that crosses
    nothing is moved, unless it lies that close to such a point.

    Parameters
    ----------
    rings : one ring, (M, 2) points in pixels, y down, or a list of rings; the closing point may be repeated.
    fill_rule : "even-odd", "non-zero", "positive", "negative" or "abs-geq-two"; counter-clockwise as seen is positive.
    attributes : values per point of all rings one after the other, closing points included: name to (V, k). A point that is
        made has the mean of what the edges through it have there. Floats keep their type, and so does "color"; other integers
        become float64. Where several points are at one place, the first counts.
    subpixel_bits : s, 4 to 16.

    Returns
    -------
    Mesh : one face. Vertices are all the points that were given, in order and snapped, then those that were made; z is 0.
        Triangles are counter-clockwise as seen, y down. `inner` marks the cuts.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.
    LimitError : edges cross too often.

    Examples
    --------
    A bow tie, whose edges cross at (2, 2):

    >>> mesh = triangulate([(0, 0), (4, 4), (4, 0), (0, 4)], attributes={"height": [0, 4, 4, 0]})
    >>> mesh.triangles.tolist()
    [[3, 4, 0], [1, 2, 4]]
    >>> mesh.positions[4].tolist(), mesh.attributes["height"][4].tolist()
    ([2.0, 2.0, 0.0], [2.0])
    """
    if fill_rule not in FILL_RULES:
        raise unknown_name("fill rule", fill_rule, FILL_RULES)
    if attributes is not None and not isinstance(attributes, Mapping):
        raise InputError(f"attributes: expected a mapping of names to values, got {type(attributes).__name__}")
    bits = check_subpixel_bits(subpixel_bits)
    points, lengths = join_rings(rings)
    numbers, starts = number_rings(points, lengths)
    given = snap_points(points, bits)
    cut = triangulate_rings(given if numbers is None else given[numbers], starts, FILL_RULES.index(fill_rule))

    # Number vertices: those given, then those made that are used.
    vertices = cut.origin if numbers is None else numbers[cut.origin]
    made = np.empty(0, np.int64)
    if cut.rounds:
        is_used = np.zeros(len(cut.points), bool)
        is_used[cut.triangles] = True
        made = np.flatnonzero(is_used & (cut.origin < 0))
        vertices = vertices.copy()
        vertices[made] = np.arange(len(given), len(given) + len(made))
    positions = np.zeros((len(given) + len(made), 3))
    np.multiply(given if not len(made) else np.concatenate([given, cut.points[made]]), 0.5**bits, out=positions[:, :2])
    values = {
        name: carried(given_values, name, len(given), numbers, cut, made) for name, given_values in (attributes or {}).items()
    }
    triangles = vertices.astype(np.int32).take(cut.triangles)
    faces = np.zeros(len(triangles), np.int32)
    if values:
        return Mesh(positions, triangles, faces, values, inner=cut.inner, face_count=1)
    return Mesh.from_checked(positions, triangles, faces, cut.inner, 1)


def carried(
    values: ArrayLike, name: str, count: int, numbers: Int64Array | None, cut: PolygonTriangles, made: Int64Array
) -> NDArray[Any]:
    """Return an attribute at the vertices of the mesh: as it was given, then at the points that were made."""
    array = as_array(values, f"attributes[{name!r}]")
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or len(array) != count:
        raise InputError(f"attributes[{name!r}]: expected shape ({count}, k), a row for each point, got {np.shape(values)}")
    is_color = name == "color"
    kind = array.dtype if is_color or array.dtype.kind == "f" else np.dtype(np.float64)
    if not len(made):
        return array.astype(kind)
    own = array if numbers is None else array[numbers]
    there = carry_values(own.astype(np.float64), cut.first, cut.rounds)[made]
    return np.concatenate([array.astype(kind), (np.rint(there) if kind.kind in "iu" else there).astype(kind)])
