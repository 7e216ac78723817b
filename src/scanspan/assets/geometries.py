"""Geometries: polygons as maps keep them, taken apart into rings. Shapely, GeoPandas and GeoJSON, none of which is imported.

What a geometry is shows in what it offers: `__geo_interface__`, a column called `geometry`, or a dictionary with a "type".
Shapely's own arrays are taken apart by shapely, all at once, if the program has imported it; that is the same and many times
faster.

Every geometry is one polygon and keeps its number: an empty one has no rings. The parts of a MultiPolygon, and of a collection
within a list, are rings of one polygon, and the fill rule decides what they hold; a hole need not turn the other way. Heights
are dropped. Points and lines cover no area and are refused.

Source: RFC 7946, GeoJSON; S. Gillies, the geo interface.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.arrays import as_array
from scanspan.assets.rings import FILL_RULES as FILL_RULES
from scanspan.assets.rings import lay_plain_polygons
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int32Array

EXPECTED = "expected polygons: rings of (M, 2) points, or shapely, GeoPandas or GeoJSON polygons"
SHAPELY_POLYGONS = (3, 6)  # shapely.GeometryType.POLYGON and MULTIPOLYGON


class PolygonList(NamedTuple):
    """Many polygons, where people have drawn them: P polygons of R rings of V points; nothing is checked against an image."""

    points: Float64Array  # (V, 2) as given, all finite
    ring_starts: Int32Array  # (R + 1,)
    polygon_rings: Int32Array  # (P + 1,)


def quote(value: object) -> str:
    """Return what was given, shortened."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def is_geometry(value: Any) -> bool:
    """Say whether something says of itself that it is a geometry, a feature or a collection."""
    return (isinstance(value, Mapping) and "type" in value) or hasattr(value, "__geo_interface__")


def is_pair(value: Any) -> bool:
    """Say whether something is the coordinates of one point."""
    try:
        return len(value) in (2, 3) and all(np.ndim(part) == 0 and not is_geometry(part) for part in value)
    except (TypeError, ValueError):
        return False


def entry(values: Any) -> Any:
    """Return the first entry of a sequence, or None."""
    try:
        return values[0] if len(values) else None
    except (TypeError, LookupError):
        return None


def ring_points(ring: Any, name: str) -> Float64Array:
    """Return the points of a ring, (M, 2), without heights and without the closing point; quote what cannot be used."""
    array = as_array(ring, name)
    if array.size == 0:
        return np.empty((0, 2))
    if array.ndim != 2 or array.shape[1] < 2 or array.shape[1] > 4 or array.dtype.kind == "b":
        raise InputError(f"{name}: expected points of shape (M, 2), got {array.dtype} {array.shape}")
    points = np.ascontiguousarray(array[:, :2], np.float64)
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputError(f"{name}[{row}] = {points[row].tolist()}: expected finite numbers")
    return points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points


def rings_of(geometry: Mapping[str, Any], name: str) -> list[Float64Array]:
    """Return the rings of a GeoJSON object."""
    kind = geometry.get("type")
    if kind == "Feature":
        inner = geometry.get("geometry")
        return [] if inner is None else rings_of(as_mapping(inner, name), name)
    if kind in ("GeometryCollection", "FeatureCollection"):
        members = geometry.get("geometries" if kind == "GeometryCollection" else "features") or ()
        return [
            ring
            for number, member in enumerate(members)
            for ring in rings_of(as_mapping(member, f"{name}[{number}]"), f"{name}[{number}]")
        ]
    coordinates = geometry.get("coordinates")
    if coordinates is None or kind not in ("Polygon", "MultiPolygon"):
        if kind in ("Point", "MultiPoint", "LineString", "MultiLineString", "LinearRing"):
            raise InputError(f"{name}: a {kind} covers no area; {EXPECTED}")
        raise InputError(f"{name}: {quote(dict(geometry))} is no GeoJSON polygon; {EXPECTED}")
    parts = coordinates if kind == "MultiPolygon" else [coordinates]
    return [ring_points(ring, f"{name}, ring {number}") for part in parts for number, ring in enumerate(part)]


def as_mapping(geometry: Any, name: str) -> Mapping[str, Any]:
    """Return a geometry as the dictionary that GeoJSON would have."""
    found = geometry if isinstance(geometry, Mapping) else getattr(geometry, "__geo_interface__", None)
    if not isinstance(found, Mapping):
        raise InputError(f"{name}: {quote(geometry)} is no geometry; {EXPECTED}")
    return found


def plain_rings(polygon: Any, name: str) -> list[Float64Array]:
    """Return the rings of a polygon given as points: one ring or a list of rings."""
    first = entry(polygon)
    if first is None or is_pair(first):
        return [ring_points(polygon, name)]
    return [ring_points(ring, f"{name}[{number}]") for number, ring in enumerate(polygon)]


def lay_end_to_end(polygons: Sequence[list[Float64Array]]) -> PolygonList:
    """Return polygons as one list of points; rings of fewer than three points hold nothing and are left out."""
    kept = [[ring for ring in rings if len(ring) > 2] for rings in polygons]
    rings = [ring for polygon in kept for ring in polygon]
    return PolygonList(
        np.concatenate([np.empty((0, 2)), *rings]),
        np.cumsum([0, *(len(ring) for ring in rings)]).astype(np.int32),
        np.cumsum([0, *(len(polygon) for polygon in kept)]).astype(np.int32),
    )


def take_apart(geometries: NDArray[Any]) -> PolygonList | None:
    """Return an array of shapely's polygons all at once; None where shapely is not in use, or something else is among them."""
    shapely = sys.modules.get("shapely")
    if shapely is None or not all(isinstance(one, shapely.Geometry) for one in geometries):
        return None
    kinds, present = shapely.get_type_id(geometries), ~shapely.is_empty(geometries)
    if not np.isin(kinds, SHAPELY_POLYGONS).all():
        return None
    full = geometries[present]
    parts, part_owner = shapely.get_parts(full, return_index=True)
    rings, ring_part = shapely.get_rings(parts, return_index=True)
    points, point_ring = shapely.get_coordinates(rings, return_index=True)
    if not np.isfinite(points).all():
        return None

    # Leave out the closing point of every ring, and rings that hold nothing.
    lengths = np.bincount(point_ring, minlength=len(rings))
    closing = np.zeros(len(points), bool)
    closing[np.cumsum(lengths) - 1] = True
    lengths = np.where(lengths > 3, lengths - 1, 0)
    open_points = points[~closing & (lengths[point_ring] > 0)]
    owner = np.flatnonzero(present)[part_owner[ring_part]][lengths > 0]
    counts = np.bincount(owner, minlength=len(geometries))
    return PolygonList(
        np.ascontiguousarray(open_points),
        np.concatenate([[0], np.cumsum(lengths[lengths > 0])]).astype(np.int32),
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
    )


def members(polygons: Any, name: str) -> tuple[list[Any], str] | None:
    """Return geometries, and what to call number {} of them; None for polygons that are given as points."""
    column = polygons if isinstance(polygons, Mapping) else getattr(polygons, "geometry", None)
    if column is not None and not isinstance(column, Mapping) and hasattr(column, "__len__"):
        return list(column), f"{name}.geometry[{{}}]"
    if is_geometry(polygons):
        found = as_mapping(polygons, name)
        if found.get("type") == "FeatureCollection":
            return list(found.get("features") or ()), f"{name}.features[{{}}]"
        return [polygons], name
    try:
        listed = list(polygons)
    except TypeError:
        raise InputError(f"{name}: {EXPECTED}, got {quote(polygons)}") from None
    # A column may hold nothing for some of its polygons.
    if any(is_geometry(one) for one in listed):
        return listed, f"{name}[{{}}]"
    return None


def as_polygons(polygons: Any, name: str = "polygons", *, is_one: bool = False) -> PolygonList:
    """Return polygons in whatever form they come.

    Parameters
    ----------
    polygons : geometries, a list of polygons, each one ring or a list of rings, or a `Polygons`.
    name : what messages call them.
    is_one : whether rings that are given as points are one polygon, a ring or a list of rings.

    Examples
    --------
    >>> square = {"type": "Polygon", "coordinates": [[(0, 0, 7), (1, 0, 7), (1, 1, 7), (0, 0, 7)]]}
    >>> as_polygons([square, None]).polygon_rings.tolist()
    [0, 1, 1]
    """
    if isinstance(polygons, PolygonList):
        return polygons
    if all(hasattr(polygons, field) for field in ("positions", "ring_starts", "polygon_rings", "source", "count")):
        counts = np.zeros(polygons.count, np.int64)
        np.add.at(counts, polygons.source, np.diff(polygons.polygon_rings))
        rings = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        return PolygonList(polygons.positions[:, :2].copy(), polygons.ring_starts.copy(), rings)
    if type(polygons) in (list, np.ndarray):
        # Take plain arrays all at once.
        plain = lay_plain_polygons([polygons] if is_one else list(polygons), np.finfo(np.float64).max)
        if plain is not None:
            return PolygonList(*plain)
    found = None if isinstance(polygons, (str, bytes)) else members(polygons, name)
    if isinstance(polygons, (str, bytes)):
        raise InputError(f"{name}: {EXPECTED}, got {quote(polygons)}")
    if found is None:
        listed = [polygons] if is_one else list(polygons)
        called = name if is_one else f"{name}[{{}}]"
        return lay_end_to_end([plain_rings(one, called.format(number)) for number, one in enumerate(listed)])
    listed, called = found
    array = np.empty(len(listed), object)
    array[:] = listed
    whole = take_apart(array)
    if whole is not None:
        return whole
    return lay_end_to_end([rings_of_one(one, called.format(number)) for number, one in enumerate(listed)])


def rings_of_one(geometry: Any, name: str) -> list[Float64Array]:
    """Return the rings of one member of a list: a geometry, rings given as points, or nothing."""
    if geometry is None:
        return []
    return rings_of(as_mapping(geometry, name), name) if is_geometry(geometry) else plain_rings(geometry, name)
