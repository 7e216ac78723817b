"""The other side of every demonstration: the same shapes by the algorithms that this library ships.

The lectures S0, S3 and S4 sample at whole coordinates, the library at the centres of pixels; shapes are moved by half a pixel
on the way, which is exact for all that the demonstrations draw.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from scanspan.lectures.raster import at_centres
from scanspan.pipeline import count, interpolate, rasterize
from scanspan.records import Array, Float64Array, Int32Array

BITS = 12  # sub-pixel bits: as many as the lectures' fixed point has


def shipped_hits(triangles: ArrayLike, size: tuple[int, int], rule: str = "top-left") -> Int32Array:
    """Return how often triangles (N, 3, 2), sampled at whole coordinates, own each pixel: (H, W)."""
    return count(at_centres(triangles), size, rule=rule, subpixel_bits=BITS)


def shipped_channel(points: ArrayLike, values: ArrayLike, size: tuple[int, int], rule: str = "inclusive") -> Array:
    """Return values at three corners, interpolated over a triangle sampled at whole coordinates: (H, W) float64, else 0."""
    (width, height), corners = size, at_centres(points)
    clip = np.stack(
        [2 * corners[:, 0] / width - 1, 1 - 2 * corners[:, 1] / height, np.zeros(3), np.ones(3)], axis=1
    )  # fmt: skip
    seen = rasterize(clip, [(0, 1, 2)], size, rule=rule, subpixel_bits=BITS)
    return interpolate(seen, np.asarray(values, np.float64))


def shuffled_mesh(seed: int, columns: int, rows: int, cell: int) -> Float64Array:
    """Return the triangles (N, 3, 2) of a lattice whose inner vertices are scattered over other whole coordinates.

    It covers the rectangle from (0, 0) to (columns cell, rows cell) without gap or overlap: no vertex moves by more than
    a sixth of a cell along an axis, so no triangle is turned over.
    """
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    x, y, reach = i * cell, j * cell, cell // 6
    inner = np.s_[1:-1, 1:-1]
    for place, salt in ((x, 1 + 2 * seed), (y, 2 + 2 * seed)):
        scattered = (i * 7919 + j * 104_729 + salt * 1_299_709) ** 2 // 64
        place[inner] += (scattered % (2 * reach + 1) - reach)[inner]
    points = np.stack([x, y], axis=2).astype(np.float64)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, :-1], points[1:, 1:]
    cut = (np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0)[..., None, None]
    first = np.where(cut, np.stack([a, b, d], axis=2), np.stack([a, b, c], axis=2))
    second = np.where(cut, np.stack([a, d, c], axis=2), np.stack([b, d, c], axis=2))
    triangles: Float64Array = np.stack([first, second], axis=2).reshape(-1, 3, 2)
    return triangles
