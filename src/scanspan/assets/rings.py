"""Rings: the outlines of polygons on the screen, as people give them, checked and laid end to end."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.arrays import as_array
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int32Array

FILL_RULES = ("even-odd", "non-zero", "positive", "negative", "abs-geq-two")
MAX_COORDINATE = 1 << 24  # pixels, as in geometry/fixed_point.py


def as_points(values: ArrayLike, shape: tuple[int, ...], name: str) -> Float64Array:
    """Return (N, *shape) float64 coordinates, finite and within 2^24 pixels."""
    array = as_array(values, name)
    if array.size == 0:
        return np.empty((0, *shape))
    if array.shape[1:] != shape or array.dtype.kind not in "iuf":
        raise InputError(
            f"{name}: expected numbers of shape (N, {', '.join(map(str, shape))}), got {array.dtype} {array.shape}"
        )
    points = np.ascontiguousarray(array, np.float64)
    if not (points.min() >= -MAX_COORDINATE and points.max() <= MAX_COORDINATE):
        row = int(np.argwhere(~(np.abs(points) <= MAX_COORDINATE))[0][0])
        raise InputError(f"{name}[{row}] = {points[row].tolist()}: expected finite numbers within {MAX_COORDINATE} pixels")
    return points


def as_rings(rings: Any) -> tuple[Float64Array, Int32Array]:
    """Return the points of rings, (V, 2) float64, and where each ring starts, (R + 1,); rings of under 3 points are left out.

    Parameters
    ----------
    rings : one ring, (M, 2) points in pixels, or a list of rings; the closing point may be repeated.
    """
    try:
        is_single = np.ndim(rings[0][0]) == 0 if len(rings) and len(rings[0]) else False
    except (TypeError, ValueError, LookupError):
        raise InputError("rings: expected one ring, (M, 2) points, or a list of rings") from None
    kept = []
    for number, ring in enumerate([rings] if is_single else rings):
        points = as_points(ring, (2,), "rings" if is_single else f"rings[{number}]")
        if len(points) > 1 and (points[0] == points[-1]).all():
            points = points[:-1]
        if len(points) > 2:
            kept.append(points)
    starts = np.cumsum([0, *(len(ring) for ring in kept)]).astype(np.int32)
    return np.concatenate([np.empty((0, 2)), *kept]), starts
