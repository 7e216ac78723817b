"""Many polygons at once, as people give them, checked and laid end to end."""

from __future__ import annotations

from typing import Any

import numpy as np

from scanspan.assets.rings import MAX_COORDINATE, as_points, as_rings, lay_plain_polygons
from scanspan.errors import InputError
from scanspan.records import Float64Array, Int32Array


def as_polygons(polygons: Any) -> tuple[Float64Array, Int32Array, Int32Array]:
    """Return the points of polygons, (V, 2) float64, where each ring starts, (R + 1,), and each polygon's first ring, (P + 1,).

    Parameters
    ----------
    polygons : a list of polygons, each one ring, (M, 2) points, or a list of rings; or an array (P, M, 2), a ring of M points
        for each. A polygon without a ring of three points keeps its place and has no rings.
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
    try:
        several = list(polygons)
    except TypeError:
        raise InputError(f"polygons: expected a list of polygons, got {type(polygons).__name__}") from None
    plain = lay_plain_polygons(several, MAX_COORDINATE)
    if plain is not None:
        return plain

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
