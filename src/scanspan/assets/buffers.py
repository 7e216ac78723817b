"""Bare arrays as input: clip coordinates, index buffers, screen triangles and per-vertex values, checked once.

What passes is what the kernels need: float64 and int32, C-contiguous, finite, indices in range. With `nonfinite="drop"` a
triangle that uses a bad vertex collapses to one point, so that the others keep their numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from scanspan.assets.arrays import as_array, as_floats, as_integers, check_range, in_layout, quote_row
from scanspan.assets.mesh import NONFINITE
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.jit import kernel
from scanspan.records import BoolArray

MAX_TRIANGLES = (1 << 31) - 1  # triangles are numbered in 32 bits on the way
MAX_CLIP = 1e150  # clip coordinates; products of two of them must be finite
MAX_DEPTH = 1e30  # of a corner on a canvas; float32 has a little more, which sums of depths may reach
MAX_SCREEN = float(1 << 24)  # pixels


@kernel
def has_far_values(values: NDArray[np.float64], limit: float) -> bool:
    """Say whether any of (N,) values is not finite or beyond a limit, in one pass."""
    is_far = False
    for i in range(values.shape[0]):
        is_far |= not (abs(values[i]) <= limit)
    return is_far


@kernel
def copy_indices(indices: NDArray[np.int32], count: int, copy: NDArray[np.int32]) -> bool:
    """Copy (T, 3) int32 indices, and say whether any is below 0 or not below `count`, in one pass."""
    low, high, given, kept = np.int32(0), np.int32(0), indices.reshape(-1), copy.reshape(-1)
    for n in range(given.shape[0]):
        index = given[n]
        low, high = min(low, index), max(high, index)
        kept[n] = index
    return bool((low < 0) | ((high >= count) & (given.shape[0] > 0)))


def check_target(
    name: str, array: Any, dtype: type[np.generic], shape: tuple[Any, ...], other: NDArray[Any] | None = None
) -> None:
    """Raise an InputError unless kernels can write into an array in place; a letter in `shape` is any number above 0.

    It must not lie over another array that is written at the same time.
    """
    fits = isinstance(array, np.ndarray) and array.dtype == dtype and array.ndim == len(shape) and 0 not in array.shape
    fits = fits and all(isinstance(n, str) or n == m for n, m in zip(shape, array.shape, strict=True))
    if not fits or not array.flags.c_contiguous or not array.flags.writeable:
        told = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
        sides = ", ".join(map(str, shape))
        raise InputError(
            f"{name}: expected a writable, contiguous ({sides}) array of {np.dtype(dtype)} to paint into, got {told}"
        )
    if other is not None and np.may_share_memory(array, other):
        raise InputError(f"{name}: expected memory of its own, got some that the pixels have, too")


def check_triangles(triangles: ArrayLike, vertex_count: int) -> NDArray[np.int32]:
    """Return triangles as (T, 3) int32 rows of vertices that exist."""
    indices = as_array(triangles, "triangles")
    if indices.size == 0 and indices.ndim in (1, 2) and indices.shape[0] == 0:
        indices = np.empty((0, 3), np.int32)
    if indices.dtype != np.int32:
        indices = as_integers(indices, "triangles")
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise InputError(f"triangles: expected shape (T, 3), got {indices.shape}")
    if len(indices) > MAX_TRIANGLES:
        raise LimitError(f"triangles: {len(indices)} of them, at most {MAX_TRIANGLES} can be numbered")
    if indices.dtype == np.int64:
        check_range(indices, vertex_count, "triangles")
        return np.require(indices, np.int32, ["C", "A", "W"])
    # Keep a copy: what is interpolated later must be in range.
    corners = np.empty(indices.shape, np.int32)
    if copy_indices(in_layout(indices, np.int32), vertex_count, corners):
        check_range(corners.astype(np.int64), vertex_count, "triangles")
    return corners


def collapse_bad(
    vertices: NDArray[np.float64], corners: NDArray[np.int32], nonfinite: str
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return clip coordinates and triangles that kernels can take; raise for, or collapse, those with a bad vertex."""
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    if not has_far_values(vertices.reshape(-1), MAX_CLIP):
        return vertices, corners

    # Quote the first bad vertex that is used, or collapse the triangles that use one.
    with np.errstate(invalid="ignore"):
        good: BoolArray = np.all(np.abs(vertices) <= MAX_CLIP, axis=1)
    bad: BoolArray = ~np.all(good[corners], axis=1)
    if bad.any() and nonfinite == "error":
        n = int(np.argmax(bad))
        vertex = next(int(v) for v in corners[n] if not good[v])
        raise InputError(
            f"{quote_row(vertices, 'clip', vertex)}: expected finite numbers within {MAX_CLIP:g}; triangle {n} uses it"
        )
    return np.where(good[:, None], vertices, 1.0), np.where(bad[:, None], 0, corners).astype(np.int32)


def check_clip(clip: ArrayLike, triangles: ArrayLike, nonfinite: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return clip coordinates as (V, 4) float64 and triangles as (T, 3) int32, ready for the kernels."""
    vertices: NDArray[np.float64] = as_floats(clip, 4, "clip")
    return collapse_bad(vertices, check_triangles(triangles, len(vertices)), nonfinite)


def check_screen_triangles(vertices: ArrayLike, nonfinite: str, keeps_float32: bool = False) -> NDArray[Any]:
    """Return screen triangles as (N, 3, 2) float64 within 2^24 pixels, or as float32 if that is what they are and may stay."""
    array = as_array(vertices, "vertices")
    if array.size == 0 and array.ndim in (1, 3) and array.shape[0] == 0:
        array = array.reshape(0, 3, 2)
    if array.ndim != 3 or array.shape[1:] != (3, 2):
        raise InputError(f"vertices: expected shape (N, 3, 2), got {array.shape}")
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    with np.errstate(over="ignore"):
        triangles: NDArray[Any] = in_layout(array, np.float32 if keeps_float32 and array.dtype == np.float32 else np.float64)
    if not has_far_values(triangles.reshape(-1), MAX_SCREEN):
        return triangles

    # Quote the first bad corner; a coordinate that is finite but far away is an error even when others are dropped.
    with np.errstate(invalid="ignore"):
        good: BoolArray = np.all(np.abs(triangles) <= MAX_SCREEN, axis=(1, 2))
    finite: BoolArray = np.all(np.isfinite(triangles), axis=(1, 2))
    wrong = ~good if nonfinite == "error" else ~good & finite
    if wrong.any():
        n = int(np.argmax(wrong))
        k = int(np.argmax(~(np.abs(triangles[n]) <= MAX_SCREEN).all(axis=1)))
        raise InputError(
            f"vertices[{n}, {k}] = {tuple(triangles[n, k].tolist())}: expected finite numbers within {MAX_SCREEN:.0f} pixels"
        )
    return np.where(good[:, None, None], triangles, 0.0)


def check_corner_depths(depths: ArrayLike, count: int, nonfinite: str) -> tuple[NDArray[Any], BoolArray | None]:
    """Return depths at corners as (count, 3) float32, if that is what they are, or float64; and which to keep, None for all."""
    array = as_array(depths, "depths")
    if array.shape != (count, 3) and not (count == 0 and array.size == 0):
        raise InputError(f"depths: expected shape ({count}, 3), one for each corner, got {array.shape}")
    with np.errstate(over="ignore"):
        kept = np.float32 if array.dtype == np.float32 else np.float64
        found: NDArray[Any] = in_layout(array, kept).reshape(count, 3)
    if not has_far_values(found.reshape(-1), MAX_DEPTH):
        return found, None
    with np.errstate(invalid="ignore"):
        good: BoolArray = np.all(np.abs(found) <= MAX_DEPTH, axis=1)
    wrong = ~good if nonfinite == "error" else ~good & np.all(np.isfinite(found), axis=1)
    if wrong.any():
        n = int(np.argmax(wrong))
        raise InputError(f"depths[{n}] = {tuple(found[n].tolist())}: expected finite numbers up to {MAX_DEPTH:.0e}")
    return np.where(good[:, None], found, 0.0), good


def check_values(
    per_vertex: ArrayLike, triangles: NDArray[np.int32], dtype: DTypeLike | None
) -> tuple[NDArray[Any], np.dtype[Any]]:
    """Return per-vertex values as (V, k) or (V,), in a type that kernels take, and what `interpolate` returns."""
    values = as_array(per_vertex, "per_vertex")
    if values.ndim not in (1, 2):
        raise InputError(f"per_vertex: expected shape (V, k) or (V,), got {values.shape}")
    needed = int(triangles.max()) + 1 if triangles.size else 0
    if len(values) < needed:
        raise InputError(f"per_vertex: {len(values)} rows, but the triangles use {needed} vertices")
    if dtype is None:
        wanted = values.dtype if values.dtype.kind == "f" else np.dtype(np.float64)
    else:
        wanted = check_result_type(dtype, values.dtype)
    if wanted == np.uint8:
        return in_layout(values, np.uint8), wanted
    is_float32 = wanted == np.float32 and values.dtype.itemsize <= 4 and values.dtype.kind == "f"
    return in_layout(values, np.float32 if is_float32 else np.float64), wanted


def check_result_type(dtype: DTypeLike, given: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type in which values are wanted that are given in another."""
    expected = "expected float32 or float64, or uint8 for values that are uint8"
    try:
        wanted = np.dtype(dtype)
    except TypeError:
        raise InputError(f"dtype: {expected}, got {dtype!r}") from None
    if wanted == np.uint8 and given != np.uint8:
        raise InputError(f"dtype: {expected}, got uint8 for values that are {given}")
    if wanted not in (np.float32, np.float64, np.uint8):
        raise InputError(f"dtype: {expected}, got {wanted}")
    return wanted
