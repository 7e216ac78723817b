"""Rings: the outlines of polygons on the screen, as people give them, checked and laid end to end."""

from __future__ import annotations

from itertools import accumulate, count
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.arrays import as_array, in_layout
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int32Array, Int64Array

FILL_RULES = ("even-odd", "non-zero", "positive", "negative", "abs-geq-two")
MAX_COORDINATE = 1 << 24  # pixels; screen coordinates beyond it are refused or cut back, see geometry/fixed_point.py


def has_far_points(points: Float64Array) -> bool:
    """Say whether any coordinate is not finite or beyond 2^24 pixels. Reading a model need not load the compiler."""
    from scanspan.assets.buffers import has_far_values

    return has_far_values(points.reshape(-1), float(MAX_COORDINATE))


def as_points(values: ArrayLike, shape: tuple[int, ...], name: str) -> Float64Array:
    """Return (N, *shape) float64 coordinates, finite and within 2^24 pixels."""
    array = as_array(values, name)
    if array.size == 0:
        return np.empty((0, *shape))
    if array.shape[1:] != shape or array.dtype.kind not in "iuf":
        raise InputError(
            f"{name}: expected numbers of shape (N, {', '.join(map(str, shape))}), got {array.dtype} {array.shape}"
        )
    points = in_layout(array, np.float64)
    if has_far_points(points):
        row = int(np.argwhere(~(np.abs(points) <= MAX_COORDINATE))[0][0])
        raise InputError(f"{name}[{row}] = {points[row].tolist()}: expected finite numbers within {MAX_COORDINATE} pixels")
    return points


def is_plain(ring: Any) -> bool:
    """Say whether a ring is an array of float64 points, of any value."""
    return type(ring) is np.ndarray and ring.dtype == np.float64 and ring.ndim == 2 and ring.shape[1] == 2


def join_rings(rings: Any) -> tuple[Float64Array, list[int]]:
    """Return the points of rings, (P, 2) float64, ring after ring, checked, with closing points, and the rings' lengths."""
    try:
        is_single = np.ndim(rings[0][0]) == 0 if len(rings) and len(rings[0]) else False
    except (TypeError, ValueError, LookupError):
        raise InputError("rings: expected one ring, (M, 2) points, or a list of rings") from None

    # Check plain arrays together, and one by one only to quote what is wrong.
    if not is_single and len(rings) and all(is_plain(ring) for ring in rings):
        points = np.concatenate(rings)
        if not has_far_points(points):
            return points, [len(ring) for ring in rings]
    names = ("rings" if is_single else f"rings[{number}]" for number in count())
    listed = [as_points(ring, (2,), name) for ring, name in zip([rings] if is_single else rings, names)]
    points = listed[0] if len(listed) == 1 else np.concatenate([*listed, np.empty((0, 2))])
    return points, [len(ring) for ring in listed]


def lay_plain_polygons(polygons: list[Any], limit: float) -> tuple[Float64Array, Int32Array, Int32Array] | None:
    """Return polygons whose rings are all plain arrays within some limit, laid end to end at once; None for all others.

    Parameters
    ----------
    polygons : each a ring, or a list of rings. A closing point is left out, and so are rings of under 3 points.
    limit : what no coordinate passes.

    Returns
    -------
    The points, (V, 2), where each ring starts, (R + 1,), and each polygon's first ring, (P + 1,).
    """
    rings: list[Float64Array] = []
    ends = [0]
    for polygon in polygons:
        if is_plain(polygon):
            rings.append(polygon)
        elif type(polygon) is list and all(map(is_plain, polygon)):
            rings += polygon
        else:
            return None
        ends.append(len(rings))
    points = np.concatenate([np.empty((0, 2)), *rings])
    if not np.abs(points).max(initial=0.0) <= limit:
        return None

    # Find closing points, and what holds something without them.
    lengths = np.array([len(ring) for ring in rings], np.int64)
    last = np.cumsum(lengths) - 1
    closed = lengths > 1
    closed[closed] = (points[last[closed]] == points[(last - lengths + 1)[closed]]).all(axis=1)
    holds = lengths - closed > 2
    if closed.any() or not holds.all():
        kept = np.repeat(holds, lengths)
        kept[last[closed]] = False
        points = points[kept]
    starts = np.concatenate([[0], np.cumsum((lengths - closed)[holds])]).astype(np.int32)
    return points, starts, np.concatenate([[0], np.cumsum(holds)])[ends].astype(np.int32)


def number_rings(points: Float64Array, lengths: list[int]) -> tuple[Int64Array | None, Int32Array]:
    """Return which points of rings outline something, (V,) or None for all, and where each ring starts, (R + 1,).

    A closing point is left out, and so are rings of under 3 points.

    Parameters
    ----------
    points : (P, 2), ring after ring.
    lengths : of the rings.
    """
    if not lengths or min(lengths) < 3:
        return _number_some(points, [length for length in lengths if length > 0])
    starts = np.array([0, *accumulate(lengths)], np.int32)
    first, last = points.take(starts[:-1], 0), points.take(starts[1:] - 1, 0)
    return _number_some(points, lengths) if (first == last).all(axis=1).any() else (None, starts)


def _number_some(points: Float64Array, lengths: list[int]) -> tuple[Int64Array, Int32Array]:
    """Return what number_rings does, where points or rings have to be left out; no ring is empty."""
    starts, kept, before = [0], [np.empty(0, np.int64)], 0
    for length in lengths:
        last = before + length - 1
        is_closed = length > 1 and points[before, 0] == points[last, 0] and points[before, 1] == points[last, 1]
        used = length - 1 if is_closed else length
        if used > 2:
            kept.append(np.arange(before, before + used))
            starts.append(starts[-1] + used)
        before += length
    return np.concatenate(kept), np.array(starts, np.int32)


def as_rings(rings: Any) -> tuple[Float64Array, Int32Array]:
    """Return the points of rings, (V, 2) float64, and where each ring starts, (R + 1,); rings of under 3 points are left out.

    Parameters
    ----------
    rings : one ring, (M, 2) points in pixels, or a list of rings; the closing point may be repeated.
    """
    points, lengths = join_rings(rings)
    numbers, starts = number_rings(points, lengths)
    return points if numbers is None else points[numbers], starts
