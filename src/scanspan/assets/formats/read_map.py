"""Maps and outlines in JSON: GeoJSON, TopoJSON, or plain lists of rings.

GeoJSON is in the order longitude, latitude, drawn as it stands (y grows upwards, no projection). In TopoJSON neighbours share
their borders as arcs, which are decoded once, so that both have the same points. Plain outlines are one ring, [[x, y], ...],
or a list of rings that belong together, in pixels with y down.

A feature may say how it is painted, by the names of the simplestyle specification: fill, fill-opacity, stroke,
stroke-opacity, stroke-width, marker-color.

Source: RFC 7946 (GeoJSON); the TopoJSON format specification; simplestyle-spec 1.1.0.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from scanspan.assets.drawing import Drawing, Path, Shape, Style, bounds_of_shapes, straight_path
from scanspan.assets.formats.files import ModelFile
from scanspan.color.names import parse_color
from scanspan.errors import InputError
from scanspan.records import Float64Array

LAND, BORDER = (0.80, 0.84, 0.76, 1.0), (0.30, 0.34, 0.36, 1.0)
GEOMETRIES = (
    "Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon", "GeometryCollection",
)  # fmt: skip


def read_map(file: ModelFile) -> Drawing:
    """Read GeoJSON, TopoJSON or a list of rings."""
    try:
        content = json.loads(file.content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise file.error("it is not text in UTF-8", f"byte {error.start}") from None
    except json.JSONDecodeError as error:
        raise file.error(f"it is not JSON, {error.msg}", f"line {error.lineno}") from None
    if isinstance(content, list):
        return read_rings(content, file)
    kind = content.get("type") if isinstance(content, dict) else None
    if kind == "Topology":
        arcs = decode_arcs(content, file)
        objects = content.get("objects")
        if not isinstance(objects, dict) or not objects:
            raise file.error("a Topology without objects")
        chosen = max(objects.values(), key=lambda found: len(found.get("geometries", ())) if isinstance(found, dict) else 0)
        shapes = tuple(shapes_of(chosen, {}, arcs, file))
    elif kind in ("Feature", "FeatureCollection", *GEOMETRIES):
        shapes = tuple(shapes_of(content, {}, None, file))
    else:
        raise file.error(f"expected GeoJSON, TopoJSON or a list of rings, got type = {kind!r}")
    left, low, right, high = bounds_of_shapes(shapes) or (0.0, 0.0, 1.0, 1.0)
    if right - left > 360 and left >= -540 and right <= 540 and max(abs(low), abs(high)) <= 90:
        left, right = -180.0, 180.0
    return Drawing(
        shapes, (left, low, right, high), None, is_upward=True, is_tiling=kind == "Topology", notes=tuple(file.notes)
    )


def read_rings(content: list[Any], file: ModelFile) -> Drawing:
    """Return plain outlines as one black shape, under the even-odd rule."""
    is_single = bool(content) and isinstance(content[0], list) and bool(content[0]) and not isinstance(content[0][0], list)
    rings = [content] if is_single else content
    paths = tuple(straight_path(to_points(ring, f"ring {k}", file), True) for k, ring in enumerate(rings))
    style = Style(fill=np.array([0.0, 0.0, 0.0, 1.0]), fill_rule="even-odd")
    shapes = (Shape(paths, np.empty((0, 2)), style),) if paths else ()
    bounds = bounds_of_shapes(shapes) or (0.0, 0.0, 1.0, 1.0)
    size = (bounds[2], bounds[3]) if min(bounds[:2]) >= 0 and min(bounds[2:]) > 0 else None
    box = (0.0, 0.0, *size) if size else bounds
    return Drawing(shapes, box, size, is_upward=False, is_tiling=False, notes=())


def to_points(values: Any, where: str, file: ModelFile) -> Float64Array:
    """Return positions as (M, 2) float64; heights are left out."""
    try:
        points: Float64Array = np.array([position[:2] for position in values], np.float64).reshape(-1, 2)
    except (TypeError, ValueError, IndexError):
        raise file.error("expected positions [x, y]", where) from None
    if not np.isfinite(points).all():
        raise file.error("a position is not finite", where)
    return points


def decode_arcs(content: dict[str, Any], file: ModelFile) -> list[Float64Array]:
    """Return the arcs of a topology, (M, 2) each: sums of steps, scaled and moved, where it has a transform."""
    transform = content.get("transform")
    arcs = [to_points(arc, f"arc {k}", file) for k, arc in enumerate(content.get("arcs", ()))]
    if transform is None:
        return arcs
    scale, offset = np.array(transform["scale"], np.float64), np.array(transform["translate"], np.float64)
    return [np.cumsum(arc, axis=0) * scale + offset for arc in arcs]


def join_arcs(numbers: list[int], arcs: list[Float64Array]) -> Float64Array:
    """Return arcs end to end; ~k is arc k from its end, and a point where two meet comes once."""
    parts = [arcs[k] if k >= 0 else arcs[~k][::-1] for k in numbers]
    return np.concatenate([part[1:] if k else part for k, part in enumerate(parts)]) if parts else np.empty((0, 2))


def shapes_of(item: Any, properties: dict[str, Any], arcs: list[Float64Array] | None, file: ModelFile) -> Iterator[Shape]:
    """Return the shapes of a feature or geometry and of all within it, in order."""
    stack: list[tuple[Any, dict[str, Any]]] = [(item, properties)]
    while stack:
        found, given = stack.pop()
        if found is None:
            continue
        if not isinstance(found, dict):
            raise file.error(f"expected a geometry, got {str(found)[:40]!r}")
        kind = found.get("type")
        own: dict[str, Any] = found["properties"] if isinstance(found.get("properties"), dict) else given
        if kind == "FeatureCollection":
            stack.extend((part, own) for part in reversed(found.get("features") or []))
        elif kind == "GeometryCollection":
            stack.extend((part, own) for part in reversed(found.get("geometries") or []))
        elif kind == "Feature":
            stack.append((found.get("geometry"), own))
        elif kind in GEOMETRIES:
            shape = shape_of(found, kind, own, arcs, file)
            if shape.paths or len(shape.points):
                yield shape
        elif kind is not None:
            raise file.error(f"unknown geometry {kind!r}, expected one of {', '.join(GEOMETRIES)}")


def shape_of(
    geometry: dict[str, Any], kind: str, properties: dict[str, Any], arcs: list[Float64Array] | None, file: ModelFile
) -> Shape:
    """Return one geometry."""
    where = f"{kind} {str(geometry.get('id', properties.get('name', '')))[:40]}".rstrip()

    def line(values: Any) -> Float64Array:
        """Return a line or a ring, of arcs where there are arcs."""
        try:
            return to_points(values, where, file) if arcs is None else join_arcs(values, arcs)
        except (TypeError, IndexError, ValueError) as error:
            raise error if isinstance(error, InputError) else file.error("it names arcs that are not there", where) from None

    depth = {"LineString": 0, "MultiLineString": 1, "Polygon": 1, "MultiPolygon": 2}.get(kind)
    if depth is None:
        positions = [geometry.get("coordinates")] if kind == "Point" else geometry.get("coordinates")
        points = to_points([] if positions == [[]] else positions, where, file)
        if arcs is not None and file.content and "transform" in geometry:
            raise file.error("a transform within a geometry", where)
        return Shape((), points, style_of(properties, "marker-color", None, file))
    parts = geometry.get("coordinates" if arcs is None else "arcs")
    if not isinstance(parts, list):
        raise file.error("it has no coordinates", where)
    for _ in range(depth - 1):
        parts = [inner for part in parts for inner in part]
    parts = [parts] if depth == 0 else parts
    is_filled = kind.endswith("Polygon")
    paths = [to_path(copy, is_filled) for part in parts for copy in unroll(line(part))]
    style = style_of(properties, "stroke", LAND if is_filled else None, file)
    return Shape(tuple(path for path in paths if len(path.curves)), np.empty((0, 2)), style)


def unroll(points: Float64Array) -> list[Float64Array]:
    """Return a line or a ring of longitudes and latitudes without its jumps over the date line, once for each side of it.

    What lies beyond 180 degrees lies beyond the map's border, and its copy 360 degrees away within. One round a pole stays as
    it is, and so does one round the whole map.
    """
    jumps = np.diff(points[:, 0])
    is_jump = np.abs(jumps) > 180
    if not is_jump.any() or np.abs(points[:, 0]).max() > 180 or np.abs(points[:, 1]).max() > 90:
        return [points]
    turns = np.cumsum([0, *np.where(is_jump, -np.sign(jumps), 0)])
    if turns[-1] != 0 and (points[0] == points[-1]).all():
        return [points]
    whole = points + np.stack([360 * turns, np.zeros(len(points))], axis=1)
    if np.ptp(whole[:, 0]) == 0:
        return [points]
    copies = [whole + np.array([shift, 0.0]) for shift in (-360.0, 0.0, 360.0)]
    return [copy for copy in copies if copy[:, 0].max() > -180 and copy[:, 0].min() < 180]


def to_path(points: Float64Array, is_ring: bool) -> Path:
    """Return a line or a ring as a path; the closing point of a ring may be repeated."""
    if is_ring and len(points) > 1 and (points[0] == points[-1]).all():
        points = points[:-1]
    return straight_path(points, is_ring and len(points) > 1)


def style_of(properties: dict[str, Any], stroke: str, land: tuple[float, ...] | None, file: ModelFile) -> Style:
    """Return how a feature is painted."""

    def color(name: str, default: tuple[float, ...]) -> Float64Array:
        found = np.array(parse_paint(properties[name], file) if isinstance(properties.get(name), str) else default)
        opacity = properties.get(f"{name}-opacity")
        if isinstance(opacity, (int, float)) and 0 <= opacity <= 1:
            found[3] = opacity
        return found

    width = properties.get("stroke-width")
    return Style(
        fill=color("fill", land) if land is not None else None,
        fill_rule="even-odd",
        stroke=color(stroke, BORDER),
        width=float(width) if isinstance(width, (int, float)) and 0 <= width < 1e6 else 1.0,
        join="round",
    )


def parse_paint(text: str, file: ModelFile) -> tuple[float, ...]:
    """Return a colour by name or in hexadecimal digits, with or without a #; grey with a note for anything else."""
    for candidate in (text, f"#{text}"):
        try:
            return tuple(parse_color(candidate).tolist())
        except InputError:
            continue
    file.note(f"the colour {text[:40]!r} is not known")
    return 0.5, 0.5, 0.5, 1.0
