"""Values: what polygons of a map carry, and how those that share a pixel are reduced to one number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array
from scanspan.assets.geometries import quote
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.records import Float64Array, Int32Array

REDUCTIONS = ("last", "first", "min", "max", "majority", "count", "sum", "mean")
WEIGHED = ("majority", "count", "sum", "mean")
EXACT = 2.0**53  # whole numbers that a float64 holds


def check_reduction(reduce: Any, mode: str, values: ArrayLike | None, count: int) -> NDArray[Any] | None:
    """Return the values, (count,), or None; raise an InputError for what does not go together."""
    if not isinstance(reduce, str) or reduce not in REDUCTIONS:
        raise unknown_name("reduce", reduce, REDUCTIONS)
    if mode == "area" and reduce not in WEIGHED:
        raise InputError(f"reduce = {reduce!r}: means nothing for mode 'area', which weighs; use mode 'touched'")
    if mode != "area" and reduce == "majority":
        raise InputError(f"reduce = 'majority': compares areas and needs mode 'area', got {mode!r}")
    if values is None:
        if reduce in ("sum", "mean"):
            raise InputError(f"reduce = {reduce!r}: needs values, one for each polygon")
        return None
    array = as_array(values, "values")
    if array.shape != (count,):
        raise InputError(f"values: expected shape ({count},), one for each polygon, got {array.shape}")
    return array


def sum_values(values: NDArray[Any]) -> Float64Array:
    """Return values as float64, in which whole numbers add up exactly."""
    found = values.astype(np.float64)
    if values.dtype.kind != "f" and float(np.abs(found).sum()) >= EXACT:
        raise LimitError("values: sums of whole numbers may pass 2^53, beyond which they are not exact; give floats")
    return found


def rank_values(reduce: str, values: NDArray[Any] | None, count: int) -> tuple[Int32Array, Int32Array]:
    """Return a rank for each polygon, the highest of which decides, and the polygon of each rank, with -1 at the end.

    Among equal values the lower number decides; NaN decides against all.
    """
    numbers = np.arange(count)
    if reduce == "last" or (values is None and reduce == "max"):
        order = numbers
    elif reduce == "first" or values is None:
        order = numbers[::-1]
    else:
        is_nan = np.isnan(values) if values.dtype.kind == "f" else np.zeros(count, bool)
        rising = np.unique(values, return_inverse=True)[1]
        order = np.lexsort((-numbers, rising if reduce == "max" else -rising, is_nan))
    ranks = np.empty(count, np.int32)
    ranks[order] = np.arange(count)
    return ranks, np.concatenate([order, [-1]]).astype(np.int32)


def fill_value(found: NDArray[Any], is_empty: NDArray[np.bool_], background: Any, default: float) -> NDArray[Any]:
    """Return an array with the background where nothing is; quote a background that its type cannot hold."""
    if background is None:
        background = default
    array = as_array(background, "background")
    problem = InputError(f"background = {quote(background)}: expected one number that {found.dtype} holds")
    if array.shape != ():
        raise problem
    with np.errstate(all="ignore"):
        held = array.astype(found.dtype)
    value = array.item()
    is_same = bool(held.item() == value) or (held.dtype.kind == "f" and value != value)
    if not is_same and held.dtype.kind != "f":
        raise problem
    found = np.ascontiguousarray(found)
    found[is_empty] = held
    return found
