"""Checks of arrays at the public boundary: from whatever NumPy can read to one layout that every kernel takes.

What comes out is C-contiguous, aligned, native and writable, so that each kernel is compiled once; what is so already is not
copied. Nothing is changed in place. A value that cannot be used is quoted with its position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from scanspan.errors import InputError


def as_array(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return a plain array of numbers; refuse ragged lists, text, objects, complex numbers and masked entries."""
    if isinstance(values, np.ma.MaskedArray):
        if np.ma.is_masked(values):
            masked = int(np.sum(np.ma.getmaskarray(values)))
            raise InputError(f"{name}: a masked array with {masked} masked entries cannot be used")
        values = values.data
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: expected an array of numbers, {str(error).splitlines()[0]}") from None
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name}: expected an array of numbers, got dtype {array.dtype}{_first_entry(array)}")
    return array


def _first_entry(array: NDArray[Any]) -> str:
    """Quote the first entry of an array of an odd type."""
    if not array.size or array.dtype.kind == "V":
        return ""
    return f", such as {str(array.reshape(-1)[0])[:40]!r}"


def in_layout(array: NDArray[Any], dtype: DTypeLike) -> NDArray[Any]:
    """Return the array in a type, C-contiguous, aligned and writable, copied only where it has to be."""
    flags = array.flags
    if type(array) is np.ndarray and array.dtype == dtype and flags.carray:
        return array
    return np.require(array, dtype=dtype, requirements=["C", "A", "W", "E"])


def own(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only copy, which nobody else can change; an array that is already such a copy is kept."""
    if array.flags.owndata and not array.flags.writeable:
        return array
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def as_floats(values: ArrayLike, columns: int | Sequence[int], name: str, dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """Return values as an array of shape (N, k), k one of `columns`; an empty list is (0, k)."""
    widths = (columns,) if isinstance(columns, int) else tuple(columns)
    array = as_array(values, name)
    if array.size == 0 and (array.ndim == 1 or (array.ndim == 2 and array.shape[1] not in widths)):
        array = array.reshape(0, widths[0]) if array.shape[0] == 0 else array
    if array.ndim != 2 or array.shape[1] not in widths:
        expected = " or ".join(f"(N, {width})" for width in widths)
        raise InputError(f"{name}: expected shape {expected}, got {array.shape}")
    with np.errstate(over="ignore"):
        return in_layout(array, dtype)


def as_integers(values: ArrayLike, name: str) -> NDArray[np.int64]:
    """Return values as int64, without loss; quote the row of the first one that is not a whole number."""
    array = as_array_of_integers(values, name)
    if array.dtype.kind == "b":
        if array.size:
            raise InputError(f"{name}: expected integers, got dtype bool")
        return np.zeros(array.shape, dtype=np.int64)
    if array.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            bad = ~(np.isfinite(array) & (array == np.rint(array)) & (np.abs(array) < 2.0**63))
        if bad.any():
            row = int(np.argwhere(bad)[0][0]) if array.ndim else 0
            raise InputError(f"{quote_row(array, name, row)}: expected whole numbers")
    if array.dtype.kind == "u" and array.size and int(array.max()) > np.iinfo(np.int64).max:
        row = int(np.argwhere(array > np.iinfo(np.int64).max)[0][0])
        raise InputError(f"{quote_row(array, name, row)}: a number beyond 2^63")
    return array.astype(np.int64, copy=False)


def as_array_of_integers(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return an array of numbers; quote the first Python integer that does not fit 64 bits, which NumPy keeps as an object."""
    if not isinstance(values, np.ndarray):
        try:
            array = np.asarray(values)
        except (TypeError, ValueError, OverflowError):
            return as_array(values, name)
        if array.dtype == object:
            entries = array.reshape(-1).tolist()
            for value in entries:
                if isinstance(value, int) and not -(2**63) <= value < 2**63:
                    raise InputError(f"{name}: {str(value)[:40]} is beyond 2^63")
    return as_array(values, name)


def quote_row(array: NDArray[Any], name: str, row: int) -> str:
    """Return ``name[row] = (a, b, c)`` with plain Python numbers, at most eight of them."""
    if array.ndim == 0:
        return f"{name} = {array.item()}"
    value = array[row].tolist()
    if not isinstance(value, list):
        return f"{name}[{row}] = {value}"
    shown = ", ".join(str(v) for v in value[:8])
    return f"{name}[{row}] = ({shown}{', ...' if len(value) > 8 else ''})"


def as_indices(values: ArrayLike, columns: int, vertex_count: int, name: str) -> NDArray[np.int32]:
    """Return (N, columns) int32 indices of vertices that exist; quote the first row with one that does not."""
    array: NDArray[Any] = values if type(values) is np.ndarray and values.dtype == np.int32 else as_integers(values, name)
    if array.size == 0 and array.ndim in (1, 2) and array.shape[0] == 0:
        array = array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        raise InputError(f"{name}: expected shape (N, {columns}), got {array.shape}")
    check_range(array, vertex_count, name)
    return np.require(array, dtype=np.int32, requirements=["C", "A", "W"])


def check_range(array: NDArray[Any], vertex_count: int, name: str) -> None:
    """Raise for the first row of indices with a vertex that does not exist."""
    if array.size and (int(array.min()) < 0 or int(array.max()) >= vertex_count):
        bad = (array < 0) | (array >= vertex_count)
        row = int(np.argwhere(bad)[0][0])
        value = int(array[row][bad[row]].flat[0])
        raise InputError(f"{quote_row(array, name, row)}: vertex {value} does not exist, there are {vertex_count}")


def as_colors(values: ArrayLike, rows: Sequence[int], name: str) -> NDArray[Any]:
    """Return colours as (4,) or (N, 4), uint8 0..255 or float32 0..1, by type; a missing alpha is opaque.

    `rows` are the counts that are allowed for (N, 3) and (N, 4); one colour for all, (3,) or (4,) or a CSS name, always is.
    """
    if isinstance(values, str):
        # Pillow knows the names; reading a model need not load it.
        from scanspan.color.names import parse_color

        return np.rint(parse_color(values) * 255.0).astype(np.uint8)
    array = as_array(values, name)
    if array.ndim not in (1, 2) or array.shape[-1] not in (3, 4) or (array.ndim == 2 and len(array) not in rows):
        counts = " or ".join(str(count) for count in dict.fromkeys(rows))
        raise InputError(f"{name}: expected shape (4,) or (N, 4) with N = {counts}, got {array.shape}")
    is_float = array.dtype.kind == "f"
    highest = 1 if is_float else 255
    if array.dtype.kind == "b":
        raise InputError(f"{name}: expected integers 0..255 or floats 0..1, got dtype bool")
    bad = ~((array >= 0) & (array <= highest))
    if bad.any():
        kind = "floats are 0..1" if is_float else "integers are 0..255"
        where = name if array.ndim == 1 else f"{name}[{int(np.argwhere(bad)[0][0])}]"
        raise InputError(f"{where}: {array[bad].flat[0]} is no colour value, {kind}")
    array = in_layout(array, np.float32 if is_float else np.uint8)
    if array.shape[-1] == 3:
        opaque = np.full((*array.shape[:-1], 1), highest, dtype=array.dtype)
        array = np.concatenate([array, opaque], axis=-1)
    return array
