"""Placement: where an image lies on the map, and which part of it is asked for.

A point of the map becomes a place in the image by one expression in float64, in a fixed order, which depends on nothing but the
point. Polygons that share a corner of the map share it in the image, to the bit, so neighbours stay neighbours.

Source: rasterio's convention for affine transforms, from column and row to x and y.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.arrays import as_array
from scanspan.assets.geometries import PolygonList, quote
from scanspan.assets.lens import MAX_SIDE
from scanspan.assets.rings import MAX_COORDINATE
from scanspan.errors import InputError, LimitError
from scanspan.records import Float64Array


class Window(NamedTuple):
    """A part of an image, in pixels."""

    x_start: int
    y_start: int
    width: int
    height: int


def whole_numbers(name: str, values: Any, meaning: str, lowest: tuple[int, ...]) -> list[int]:
    """Return some whole numbers, none below its lowest, or raise an InputError that quotes them."""
    problem = InputError(f"{name} = {quote(values)}: expected {meaning}")
    if isinstance(values, (str, bytes, dict, set)) or not hasattr(values, "__len__") or len(values) != len(lowest):
        raise problem
    found = []
    for value, low in zip(values, lowest, strict=True):
        if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__") or value.__index__() < low:
            raise problem
        found.append(value.__index__())
    return found


def check_raster(size: Any, window: Any) -> tuple[tuple[int, int], Window]:
    """Return the size of an image and the window of it that is asked for: all of it for None."""
    width, height = whole_numbers("size", size, "(width, height), two whole numbers above 0", (1, 1))
    if max(width, height) > MAX_SIDE:
        raise LimitError(f"size = ({width}, {height}): the limit is {MAX_SIDE} for a side")
    if window is None:
        return (width, height), Window(0, 0, width, height)
    meaning = "(x_start, y_start, width, height), whole numbers"
    part = Window(*whole_numbers("window", window, meaning, (0, 0, 1, 1)))
    if part.x_start + part.width > width or part.y_start + part.height > height:
        raise InputError(f"window = {tuple(part)}: reaches beyond the image of {width} x {height} pixels")
    return (width, height), part


def check_affine(transform: Any) -> tuple[float, ...]:
    """Return the six numbers (a, b, c, d, e, f) of a transform: x = a column + b row + c, y = d column + e row + f."""
    expected = "expected an affine transform, (a, b, c, d, e, f) or an array of shape (2, 3) or (3, 3)"
    array = as_array(transform, "transform")
    if array.shape in ((9,), (6,)):
        array = array.reshape(-1, 3)
    if array.shape not in ((2, 3), (3, 3)) or array.dtype.kind == "b":
        raise InputError(f"transform = {quote(transform)}: {expected}")
    if array.shape == (3, 3) and array[2].tolist() != [0, 0, 1]:
        raise InputError(f"transform = {quote(transform)}: its last row must be 0, 0, 1")
    a, b, c, d, e, f = (float(value) for value in array[:2].reshape(-1))
    if not np.isfinite([a, b, c, d, e, f]).all():
        raise InputError(f"transform = {quote(transform)}: expected finite numbers")
    area = a * e - b * d
    if area == 0.0 or not np.isfinite(area):
        raise InputError(f"transform = {quote(transform)}: is singular, it makes no image")
    return a, b, c, d, e, f


def check_bounds(bounds: Any) -> tuple[float, float, float, float]:
    """Return (left, bottom, right, top) of an image whose top is north."""
    array = as_array(bounds, "bounds")
    if array.shape != (4,) or array.dtype.kind == "b" or not np.isfinite(array).all():
        raise InputError(f"bounds = {quote(bounds)}: expected (left, bottom, right, top), finite numbers")
    left, bottom, right, top = (float(value) for value in array)
    if not (left < right and bottom < top and np.isfinite(right - left) and np.isfinite(top - bottom)):
        raise InputError(f"bounds = {quote(bounds)}: expected left < right and bottom < top")
    return left, bottom, right, top


def to_pixels(points: Float64Array, size: tuple[int, int], transform: Any, bounds: Any) -> Float64Array:
    """Return points of the map as places in the image, in pixels; without a transform or bounds they are that already."""
    x, y = points[:, 0], points[:, 1]
    with np.errstate(over="ignore", invalid="ignore"):
        if transform is not None and bounds is not None:
            raise InputError("transform and bounds: expected one of them, got both")
        if bounds is not None:
            left, bottom, right, top = check_bounds(bounds)
            return np.stack([(x - left) * size[0] / (right - left), (top - y) * size[1] / (top - bottom)], axis=1)
        if transform is None:
            return points
        a, b, c, d, e, f = check_affine(transform)
        if b == 0.0 and d == 0.0:
            return np.stack([(x - c) / a, (y - f) / e], axis=1)
        area = a * e - b * d
        return np.stack([(e * (x - c) - b * (y - f)) / area, (a * (y - f) - d * (x - c)) / area], axis=1)


def place(polygons: PolygonList, size: tuple[int, int], transform: Any, bounds: Any) -> PolygonList:
    """Return polygons of the map as polygons of the image; quote the first point that lies too far from it."""
    points = to_pixels(polygons.points, size, transform, bounds)
    near = (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    if not near.all():
        row = int(np.argmin(near))
        ring = int(np.searchsorted(polygons.ring_starts, row, side="right")) - 1
        number = int(np.searchsorted(polygons.polygon_rings, ring, side="right")) - 1
        where = polygons.points[row].tolist()
        raise InputError(f"polygons[{number}]: the point {where} is more than {MAX_COORDINATE} pixels away from the image")
    return polygons._replace(points=np.ascontiguousarray(points))


def select_near(polygons: PolygonList, window: Window) -> PolygonList:
    """Return polygons of the image without those whose box does not meet a window; they keep their numbers, but no rings."""
    points, ring_starts, polygon_rings = polygons
    counts = np.diff(polygon_rings)
    full = np.flatnonzero(counts)
    if not len(full):
        return polygons

    # Bound rings, and with them polygons. A pixel more on every side is for what snapping moves.
    firsts = polygon_rings[full]
    low = np.minimum.reduceat(np.minimum.reduceat(points, ring_starts[:-1]), firsts)
    high = np.maximum.reduceat(np.maximum.reduceat(points, ring_starts[:-1]), firsts)
    start = np.array([window.x_start - 1, window.y_start - 1])
    end = np.array([window.x_start + window.width + 1, window.y_start + window.height + 1])
    near = (high >= start).all(axis=1) & (low <= end).all(axis=1)
    if near.all():
        return polygons
    kept = np.zeros(len(counts), bool)
    kept[full[near]] = True
    rings = np.repeat(kept, counts)
    lengths = np.diff(ring_starts)
    return PolygonList(
        points[np.repeat(rings, lengths)],
        np.concatenate([[0], np.cumsum(lengths[rings])]).astype(np.int32),
        np.concatenate([[0], np.cumsum(np.where(kept, counts, 0))]).astype(np.int32),
    )


def check_windows(size: Any, block: Any) -> list[Window]:
    """Return the windows that an image is cut into, row by row."""
    (width, height), _ = check_raster(size, None)
    meaning = "the side of a block, or its (width, height), whole numbers above 0"
    is_side = hasattr(block, "__index__") and not isinstance(block, (bool, np.bool_))
    if is_side and block.__index__() > 0:
        across = down = block.__index__()
    else:
        across, down = whole_numbers("block", block, meaning, (1, 1))
    return [
        Window(x, y, min(across, width - x), min(down, height - y))
        for y in range(0, height, down)
        for x in range(0, width, across)
    ]
