"""What is to be plotted: points, segments, polylines and triangles, from bare arrays or from the columns of a table.

A table is whatever gives a column for a name: a DataFrame, a Dataset of xarray, a dict of arrays. None of their packages is
imported. Coordinates are kept as they come, of any type of number and any stride; only what must be float64 is made so.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.arrays import as_array, in_layout
from scanspan.assets.buffers import has_far_values
from scanspan.assets.mesh import NONFINITE
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import quote
from scanspan.records import Array, BoolArray, Float64Array

KINDS = ("points", "lines", "triangles")
SHAPES = {(2,): "points", (2, 2): "lines", (3, 2): "triangles"}  # of a row of coordinates, and what it is by itself
MAX_VALUE = 1e150  # of values and, in pixels, of corners; products of two of them must be finite
MAX_FLOAT = float(np.finfo(np.float64).max)
DROP = 'nonfinite="drop" leaves it out'


class Plotted(NamedTuple):
    """What is to be plotted, all finite but for the coordinates of points."""

    kind: str
    columns: tuple[Array, Array] | None  # x and y of points, (N,) of any type of number
    corners: Float64Array  # (N, 2, 2) ends of segments or (N, 3, 2) corners of triangles
    values: Float64Array | None  # (N,), or (N, 3) for the corners of triangles


def is_table(source: Any) -> bool:
    """Say whether something gives columns by name: a dict, what has columns or variables, or an array of records."""
    is_structured = getattr(getattr(source, "dtype", None), "names", None) is not None
    return is_structured or isinstance(source, dict) or hasattr(source, "columns") or hasattr(source, "data_vars")


def take_column(table: Any, name: Any, role: str) -> Any:
    """Return a column of a table."""
    try:
        return table[name]
    except Exception:  # each kind of table has an error of its own for it
        have = getattr(table, "columns", None) if not isinstance(table, np.ndarray) else table.dtype.names
        have = list(table if have is None else have)
        raise InputError(f"{role} = {quote(name)}: there is no such column, but {', '.join(map(repr, have[:20]))}") from None


def as_column(table: Any, name: Any, role: str) -> Array:
    """Return a column of numbers of a table, (N,)."""
    return as_array(take_column(table, name, role), f"{role} = {quote(name)}").reshape(-1)


def as_values(values: Any, kind: str, count: int) -> Float64Array | None:
    """Return values as float64, (N,) or, for the corners of triangles, (N, 3)."""
    if values is None:
        return None
    array = as_array(values, "values")
    if kind == "points" and array.size == count:
        array = array.reshape(-1)
    if array.shape != (count,) and not (kind == "triangles" and array.shape == (count, 3)):
        each = f"({count},) or ({count}, 3)" if kind == "triangles" else f"({count},)"
        raise InputError(f"values: expected shape {each}, as there are {count} {kind}, got {array.shape}")
    with np.errstate(over="ignore"):
        floats: Float64Array = in_layout(array, np.float64)
    return floats


def find_good(numbers: Float64Array, limit: float, nonfinite: str, name: str) -> BoolArray | None:
    """Say of each row whether all its numbers are within a limit, None if all are; raise for the first that is not.

    Rows that are to be dropped are no reason to raise; what is finite but beyond the limit always is.
    """
    if not has_far_values(numbers.reshape(-1), limit):
        return None
    with np.errstate(invalid="ignore"):
        good: BoolArray = np.all((np.abs(numbers) <= limit).reshape(len(numbers), -1), axis=1)
    finite: BoolArray = np.all(np.isfinite(numbers).reshape(len(numbers), -1), axis=1)
    wrong = ~good if nonfinite == "error" else ~good & finite
    if wrong.any():
        n = int(np.argmax(wrong))
        hint = "" if finite[n] else f"; {DROP}"
        raise InputError(f"{name}[{n}] = {quote(numbers[n].tolist())}: expected finite numbers within {limit:g}{hint}")
    return good


def take_rows(rows: BoolArray | None, *arrays: Any) -> tuple[Any, ...]:
    """Return some rows of arrays, all of them for None; an array that is None stays so."""
    return arrays if rows is None else tuple(None if array is None else array[rows] for array in arrays)


def as_columns(geometry: Any, kind: Any, x: Any, y: Any) -> tuple[Array, Array] | Array:
    """Return the columns x and y of a table, or else an array of coordinates, (N, 2), (N, 2, 2) or (N, 3, 2)."""
    if is_table(geometry):
        pair = as_column(geometry, x, "x"), as_column(geometry, y, "y")
        if len(pair[0]) != len(pair[1]):
            raise InputError(f"x = {quote(x)} has {len(pair[0])} numbers and y = {quote(y)} has {len(pair[1])}")
        return pair
    array = as_array(geometry, "geometry")
    if array.shape == (0,):
        array = array.reshape(0, 3, 2) if isinstance(kind, str) and kind == "triangles" else array.reshape(0, 2)
    if array.ndim < 2 or array.shape[1:] not in SHAPES:
        raise InputError(f"geometry: expected shape (N, 2), (N, 2, 2), (N, 3, 2), or a table, got {array.shape}")
    return array


def choose_kind(kind: Any, shape: tuple[int, ...]) -> str:
    """Return the kind that was asked for, or the one that a shape stands for; raise where the two do not go together."""
    natural = SHAPES[shape]
    if kind is None:
        return natural
    if not isinstance(kind, str) or kind not in KINDS:
        raise unknown_name("kind", kind, KINDS)
    if kind != natural and (kind, shape) != ("lines", (2,)):
        raise InputError(f"kind = {kind!r}: the geometry has rows of shape {shape}, which are {natural}")
    return kind


def as_plotted(geometry: Any, kind: Any, x: Any, y: Any, values: Any, nonfinite: str) -> Plotted:
    """Check what is to be plotted and return it, without what is to be left out.

    Parameters
    ----------
    geometry : see `aggregate`.
    kind : a name of KINDS, or None.
    x, y : names of columns, if geometry is a table.
    values : numbers, or the name of a column.
    nonfinite : "error" or "drop".
    """
    if not isinstance(nonfinite, str) or nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    if is_table(geometry) and values is not None and np.ndim(values) == 0:
        values = take_column(geometry, values, "values")
    found = as_columns(geometry, kind, x, y)
    columns = found if isinstance(found, tuple) else (found[:, 0], found[:, 1]) if found.ndim == 2 else None
    kind = choose_kind(kind, (2,) if isinstance(found, tuple) else found.shape[1:])
    count = len(columns[0]) if columns is not None else len(found)
    numbers = as_values(values, kind, count)
    if columns is not None and kind == "lines":
        points = np.stack([column.astype(np.float64) for column in columns], axis=1)
        return chain(points, numbers, nonfinite)
    good = None if numbers is None else find_good(numbers, MAX_VALUE, nonfinite, "values")
    if columns is not None:
        first, second, numbers = take_rows(good, *columns, numbers)
        return Plotted(kind, (first, second), np.empty((0, 2, 2)), numbers)
    assert not isinstance(found, tuple)
    corners, numbers = take_rows(good, in_layout(found, np.float64), numbers)
    corners, numbers = take_rows(find_good(corners, MAX_FLOAT, nonfinite, "geometry"), corners, numbers)
    return Plotted(kind, None, corners, numbers)


def chain(points: Float64Array, values: Float64Array | None, nonfinite: str) -> Plotted:
    """Return the segments of a polyline, which is broken where a coordinate is NaN; each has the value of its first point."""
    fit: BoolArray = np.all(~np.isnan(points), axis=1)
    finite = find_good(np.where(fit[:, None], points, 0.0), MAX_FLOAT, nonfinite, "geometry")
    fit = fit if finite is None else fit & finite
    kept = fit[:-1] & fit[1:]
    ends = np.stack([points[:-1], points[1:]], axis=1)

    # A value counts only where a segment begins.
    if values is not None:
        good = find_good(np.where(kept, values[:-1], 0.0), MAX_VALUE, nonfinite, "values")
        kept = kept if good is None else kept & good
        values = values[:-1][kept]
    return Plotted("lines", None, ends[kept], values)


def as_bounds(bounds: Any, plotted: Plotted, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return bounds as four numbers: those given, those that fit what is plotted, or the image's own for None."""
    if bounds is None:
        return 0.0, 0.0, float(size[0]), float(size[1])
    expected = 'expected "fit" or four finite numbers (x_low, y_low, x_high, y_high) with low < high'
    if isinstance(bounds, str):
        if bounds != "fit":
            raise InputError(f"bounds = {bounds!r}: {expected}")
        bounds = fit_bounds(plotted, size)
    try:
        array = np.asarray(bounds)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.shape != (4,) or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise InputError(f"bounds = {quote(bounds)}: {expected}")
    x_low, y_low, x_high, y_high = array.tolist()

    # What is too wide or too narrow for a float64 has no pixels.
    spans = (float(x_high) - float(x_low), float(y_high) - float(y_low))
    if not (min(spans) > 0 and all(0 < side / span < np.inf and span < np.inf for side, span in zip(size, spans, strict=True))):
        raise InputError(f"bounds = {quote(bounds)}: {expected}")
    return float(x_low), float(y_low), float(x_high), float(y_high)


def fit_bounds(plotted: Plotted, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the least bounds that hold all that is finite; those of lines begin and end in the centres of pixels."""
    if plotted.columns is not None:
        x, y = plotted.columns
        good = np.isfinite(x) & np.isfinite(y)
        x, y = take_rows(None if good.all() else good, x, y)
    else:
        x, y = plotted.corners[..., 0], plotted.corners[..., 1]
    is_thick = plotted.kind == "lines"
    (x_low, x_high), (y_low, y_high) = fit_range(x, size[0], is_thick), fit_range(y, size[1], is_thick)
    return x_low, y_low, x_high, y_high


def fit_range(numbers: Array, side: int, is_thick: bool) -> tuple[float, float]:
    """Return the least half-open range that holds some numbers, a unit wide if they are all one.

    Parameters
    ----------
    numbers : coordinates.
    side : of the image, in pixels.
    is_thick : whether there must be half a pixel more on either side.
    """
    if not numbers.size:
        return 0.0, 1.0
    low, high = float(numbers.min()), float(numbers.max())
    if low == high:
        half = max(0.5, abs(low) * 2.0**-30)
        return low - half, high + half
    half = (high - low) / max(side - 1, 1) / 2 if is_thick else 0.0
    return low - half, float(np.nextafter(high + half, np.inf))
