"""Polygons to paint, as people give them: rings in pixels, or geometries as maps keep them; checked and laid end to end.

Rings are read here, and geometries by geometries.py, so a canvas takes what `coverage` takes. A canvas is more exact about
rings: it quotes the ring of a polygon that it cannot paint, and takes no heights.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scanspan.assets.geometries import PolygonList
from scanspan.assets.geometries import as_polygons as read_geometries
from scanspan.assets.placement import place
from scanspan.assets.rings import MAX_COORDINATE, as_points, as_rings, lay_plain_polygons
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int32Array

PLAIN = (list, tuple, np.ndarray)


def is_map(polygons: Any) -> bool:
    """Say whether something holds geometries: it is one, or keeps them in a column, or is a `Polygons` or a PolygonList.

    A column is not asked for its interface, which would write out all that is in it.
    """
    if isinstance(polygons, PLAIN) and not isinstance(polygons, PolygonList):
        return False
    if isinstance(polygons, (PolygonList, Mapping)):
        return isinstance(polygons, PolygonList) or "type" in polygons
    if hasattr(type(polygons), "__geo_interface__") or "__geo_interface__" in getattr(polygons, "__dict__", ()):
        return True
    return all(hasattr(polygons, name) for name in ("ring_starts", "polygon_rings")) or hasattr(polygons, "geometry")


def has_maps(polygons: Any) -> bool:
    """Say whether an entry of a list is a geometry."""
    return any(not isinstance(one, PLAIN) and is_map(one) for one in polygons)


def as_placed(polygons: Any, name: str, is_one: bool) -> PolygonList:
    """Return geometries whose coordinates are pixels."""
    return place(read_geometries(polygons, name, is_one=is_one), (1, 1), None, None)


def as_polygon(rings: Any) -> tuple[Float64Array, Int32Array]:
    """Return the points of one polygon, (V, 2) float64, and where each ring starts, (R + 1,).

    Parameters
    ----------
    rings : one ring, (M, 2) points, a list of rings, or one geometry: shapely, GeoPandas or GeoJSON.
    """
    if not is_map(rings) and not (type(rings) in (list, tuple) and has_maps(rings)):
        return as_rings(rings)
    found = as_placed(rings, "rings", is_one=True)
    if len(found.polygon_rings) != 2:
        raise InputError(f"rings: expected one polygon, got {len(found.polygon_rings) - 1}; use polygons for many")
    return found.points, found.ring_starts


def as_polygons(polygons: Any) -> tuple[Float64Array, Int32Array, Int32Array]:
    """Return the points of polygons, (V, 2) float64, where each ring starts, (R + 1,), and each polygon's first ring, (P + 1,).

    Parameters
    ----------
    polygons : a list of polygons, each one ring, (M, 2) points, or a list of rings; or an array (P, M, 2), a ring of M points
        for each; or geometries, in any form that `coverage` takes. A polygon without a ring of three points keeps its place
        and has no rings.
    """
    if isinstance(polygons, np.ndarray) and polygons.ndim == 3 and polygons.dtype.kind in "iuf":
        count, corners = polygons.shape[:2]
        points = as_points(polygons, (corners, 2), "polygons")
        rings = count if corners > 2 else 0
        starts = np.arange(rings + 1, dtype=np.int32) * corners
        return (
            points.reshape(-1, 2)[: rings * corners],
            starts.astype(np.int32),
            np.minimum(np.arange(count + 1), rings).astype(np.int32),
        )
    if is_map(polygons):
        return as_placed(polygons, "polygons", is_one=False)
    try:
        several = list(polygons)
    except TypeError:
        raise InputError(f"polygons: expected a list of polygons, got {type(polygons).__name__}") from None
    plain = lay_plain_polygons(several, MAX_COORDINATE)
    if plain is not None:
        return plain
    if has_maps(several):
        return as_placed(several, "polygons", is_one=False)

    # Check what is not plain one by one, and quote what is wrong.
    parts, lengths, counts = [np.empty((0, 2))], [0], [0]
    for number, rings in enumerate(several):
        try:
            points, starts = as_rings(rings)
        except InputError as error:
            raise InputError(f"polygons[{number}]: {error}") from None
        parts.append(points)
        lengths += np.diff(starts).tolist()
        counts.append(len(starts) - 1)
    return np.concatenate(parts), np.cumsum(lengths).astype(np.int32), np.cumsum(counts).astype(np.int32)
