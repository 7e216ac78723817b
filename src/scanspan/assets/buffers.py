"""Bare arrays as input: clip coordinates, index buffers, screen triangles and per-vertex values, checked once.

What passes is what the kernels need: float64 and int32, C-contiguous, finite, indices in range. With `nonfinite="drop"` a triangle
that uses a bad vertex collapses to one point, so that the others keep their numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array, as_floats, as_integers, check_range, in_layout, quote_row
from scanspan.assets.mesh import NONFINITE
from scanspan.errors import InputError, LimitError, unknown_name

MAX_TRIANGLES = (1 << 31) - 1  # triangles are numbered in 32 bits on the way
MAX_CLIP = 1e150  # clip coordinates; products of two of them must be finite
MAX_SCREEN = 1 << 24  # pixels


def check_triangles(triangles: ArrayLike) -> NDArray[np.int64]:
    """Return triangles as (T, 3) int64; their range is checked against the vertices later."""
    indices = as_integers(triangles, "triangles")
    if indices.size == 0 and indices.ndim in (1, 2) and indices.shape[0] == 0:
        indices = indices.reshape(0, 3)
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise InputError(f"triangles: expected shape (T, 3), got {indices.shape}")
    if len(indices) > MAX_TRIANGLES:
        raise LimitError(f"triangles: {len(indices)} of them, at most {MAX_TRIANGLES} can be numbered")
    return indices


def collapse_bad(
    vertices: NDArray[np.float64], indices: NDArray[np.int64], name: str, limit: float, nonfinite: str
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and (T, 3) int32 triangles that kernels can take; raise for or collapse those with a bad vertex."""
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    corners = np.require(indices, np.int32, ["C", "A", "W"])
    with np.errstate(invalid="ignore"):
        good = (np.abs(vertices) <= limit).all(axis=1)
    if good.all():
        return vertices, corners

    # Quote the first bad vertex that is used, or collapse the triangles that use one.
    bad = ~good[corners].all(axis=1)
    if bad.any() and nonfinite == "error":
        vertex = next(int(v) for v in corners[np.argmax(bad)] if not good[v])
        raise InputError(f"{quote_row(vertices, name, vertex)}: must be finite and within {limit:g}; triangle {int(np.argmax(bad))} uses it")
    corners = np.where(bad[:, None], 0, corners).astype(np.int32)
    return np.where(good[:, None], vertices, 1.0), corners


def check_clip(clip: ArrayLike, indices: NDArray[np.int64], nonfinite: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return clip coordinates as (V, 4) float64 and triangles as (T, 3) int32, ready for the kernels."""
    vertices = as_floats(clip, 4, "clip")
    check_range(indices, len(vertices), "triangles")
    return collapse_bad(vertices, indices, "clip", MAX_CLIP, nonfinite)


def check_screen_triangles(vertices: ArrayLike, nonfinite: str) -> NDArray[np.float64]:
    """Return screen triangles as (N, 3, 2) float64 within 2^24 pixels."""
    array = as_array(vertices, "vertices")
    if array.size == 0 and array.ndim in (1, 3) and array.shape[0] == 0:
        array = array.reshape(0, 3, 2)
    if array.ndim != 3 or array.shape[1:] != (3, 2):
        raise InputError(f"vertices: expected shape (N, 3, 2), got {array.shape}")
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    with np.errstate(over="ignore"):
        triangles: NDArray[np.float64] = in_layout(array, np.float64)
    with np.errstate(invalid="ignore"):
        good = (np.abs(triangles) <= MAX_SCREEN).all(axis=(1, 2))
    if good.all():
        return triangles

    # Quote the first bad corner; a coordinate that is finite but far away is an error even when others are dropped.
    finite = np.isfinite(triangles).all(axis=(1, 2))
    wrong = ~good if nonfinite == "error" else ~good & finite
    if wrong.any():
        n = int(np.argmax(wrong))
        k = int(np.argmax(~(np.abs(triangles[n]) <= MAX_SCREEN).all(axis=1)))
        raise InputError(f"vertices[{n}, {k}] = {tuple(triangles[n, k].tolist())}: must be finite and within {MAX_SCREEN} pixels")
    return np.where(good[:, None, None], triangles, 0.0)


def check_values(per_vertex: ArrayLike, triangles: NDArray[np.int32]) -> tuple[NDArray[np.float64], np.dtype[Any]]:
    """Return per-vertex values as (V, k) or (V,) float64, and the type that the result shall have."""
    values = as_array(per_vertex, "per_vertex")
    if values.ndim not in (1, 2):
        raise InputError(f"per_vertex: expected shape (V, k) or (V,), got {values.shape}")
    needed = int(triangles.max()) + 1 if triangles.size else 0
    if len(values) < needed:
        raise InputError(f"per_vertex: {len(values)} rows, but the triangles use {needed} vertices")
    dtype = values.dtype if values.dtype.kind == "f" else np.dtype(np.float64)
    return in_layout(values, np.float64), dtype
