"""PointCloud: millions of points with what a scanner knows of each.

A cloud keeps its coordinates as its file has them: whole numbers with a scale and an offset, as in LAS, or floats. So a survey
in metres from the equator loses nothing, and a point takes 12 bytes where float64 takes 24. Everything is checked here, once;
arrays are read-only and the cloud's own. Positions are worked out when asked for: world = stored * scale + offset in float64,
the one expression for all, so that bounds, pictures and selections agree to the bit.

Source: the ASPRS LAS specification 1.4, revision 15, for scale and offset, returns and the names of classes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from scanspan.assets.arrays import as_array, as_colors, as_floats, as_integers, own, quote_row
from scanspan.assets.cloud_choice import choose
from scanspan.assets.mesh import NONFINITE
from scanspan.assets.shapes import Points, as_pixels
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import transform_points
from scanspan.records import BoolArray, Float64Array

COLUMNS = ("color", "intensity", "classification", "return_number", "number_of_returns", "normals")
"""What a cloud may know of each point besides its position."""

PART = 1 << 20

MAX_COORDINATE = 1e150
"""Coordinates lie within this, so that no distance overflows."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class PointCloud:
    """Points in space, as a scanner or a reconstruction gives them.

    Parameters
    ----------
    positions : (N, 3) floats; float32 and float64 are kept as they are, other numbers as float64. Either these or `integers`.
    integers : (N, 3) whole numbers of 32 bits; world = integers * scale + offset.
    scale : one number or (3,), above 0.
    offset : (3,). Positions may have a scale and an offset too.
    color : (N, 3) or (N, 4), or one for all: integers 0..255 or floats 0..1, sRGB, kept as uint8; or a CSS name.
    intensity : (N,); integers 0..65535 are kept as uint16, all other numbers as float32.
    classification, return_number, number_of_returns : (N,) integers 0..255.
    normals : (N, 3) of any length, kept as float32; (0, 0, 0) where there is none, also for one that is not finite.
    size : pixels, above 0; None leaves it to the renderer.
    crs : the coordinate reference system as text, as the file has it.
    nonfinite : "error" raises for a position or an intensity that is not finite, "drop" leaves the point out.

    Raises
    ------
    InputError : a shape, a type or a number that cannot be used; it is quoted.

    Examples
    --------
    >>> cloud = PointCloud(integers=[(1, 2, 3), (4, 5, 6)], scale=0.01, offset=(500000, 4900000, 0), classification=[2, 6])
    >>> cloud
    PointCloud(2 points, classification)
    >>> cloud.positions.tolist()
    [[500000.01, 4900000.02, 0.03], [500000.04, 4900000.05, 0.06]]
    >>> cloud.select(classification="building").integers.tolist()
    [[4, 5, 6]]
    """

    stored: NDArray[Any]
    scale: Float64Array
    offset: Float64Array
    color: NDArray[np.uint8] | None
    intensity: NDArray[Any] | None
    classification: NDArray[np.uint8] | None
    return_number: NDArray[np.uint8] | None
    number_of_returns: NDArray[np.uint8] | None
    normals: NDArray[np.float32] | None
    size: float | None
    crs: str

    def __init__(
        self,
        positions: ArrayLike | None = None,
        *,
        integers: ArrayLike | None = None,
        scale: ArrayLike = 1.0,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        color: ArrayLike | None = None,
        intensity: ArrayLike | None = None,
        classification: ArrayLike | None = None,
        return_number: ArrayLike | None = None,
        number_of_returns: ArrayLike | None = None,
        normals: ArrayLike | None = None,
        size: float | None = None,
        crs: str = "",
        nonfinite: str = "error",
    ) -> None:
        if nonfinite not in NONFINITE:
            raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
        if (positions is None) == (integers is None):
            raise InputError("a PointCloud takes either positions or integers")
        if not isinstance(crs, str):
            raise InputError(f"crs: expected text, got {type(crs).__name__}")
        stored = _as_positions(positions) if integers is None else _as_stored_integers(integers)
        columns: dict[str, NDArray[Any] | None] = {
            "color": None if color is None else _as_bytes_of_color(color, len(stored)),
            "intensity": None if intensity is None else _as_intensity(intensity, len(stored)),
            "normals": None if normals is None else _as_normals(normals, len(stored)),
        }
        small = {"classification": classification, "return_number": return_number, "number_of_returns": number_of_returns}
        columns |= {name: None if values is None else _as_bytes(values, len(stored), name) for name, values in small.items()}

        # Quote the first number that is not finite, or leave its point out.
        keep = _find_finite(stored, "positions", columns, nonfinite)
        if keep is not None:
            stored = stored[keep]
            columns = {name: None if values is None else values[keep] for name, values in columns.items()}
        self._keep(
            own(stored), _as_scale(scale), _as_offset(offset), None if size is None else as_pixels(size, "size"), crs,
            {name: None if values is None else own(values) for name, values in columns.items()},
        )  # fmt: skip
        _check_reach(self)

    def _keep(
        self, stored: NDArray[Any], scale: Float64Array, offset: Float64Array, size: float | None, crs: str,
        columns: dict[str, NDArray[Any] | None],
    ) -> None:  # fmt: skip
        """Become the cloud of arrays that are as they must be."""
        self.__dict__.update(stored=stored, scale=scale, offset=offset, size=size, crs=crs, **columns)

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.stored)

    def __len__(self) -> int:
        return len(self.stored)

    @property
    def integers(self) -> NDArray[np.int32] | None:
        """The coordinates as stored, (N, 3) int32, or None where the cloud was made from floats."""
        return self.stored if self.stored.dtype == np.int32 else None

    @property
    def positions(self) -> Float64Array:
        """The points in space, (N, 3) float64, worked out anew each time: 24 bytes a point."""
        found: Float64Array = self.stored * self.scale + self.offset
        return found

    @property
    def colors(self) -> NDArray[np.uint8] | None:
        """Colours as other shapes have them, (N, 4) uint8, or None."""
        return None if self.color is None else as_colors(self.color, (len(self),), "color")

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """What is known of each point besides its position, by name."""
        return {name: getattr(self, name) for name in COLUMNS if getattr(self, name) is not None}

    @cached_property
    def bounds(self) -> Float64Array:
        """Lowest and highest x, y, z, (2, 3) float64; NaN when there is no point."""
        if not len(self.stored):
            return np.full((2, 3), np.nan)
        # Rounding keeps the order, so these are the least and the greatest positions to the bit.
        columns = [self.stored[:, axis] for axis in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]]) * self.scale + self.offset

    def bounds_in(self, transform: Float64Array) -> Float64Array:
        """Return lowest and highest x, y, z after a (4, 4) transform, (2, 3) float64; a million points at a time."""
        if not len(self):
            return np.full((2, 3), np.nan)
        parts = (self.take(slice(first, first + PART)) for first in range(0, len(self), PART))
        placed = (transform_points(transform, part.positions)[:, :3] for part in parts)
        ends = np.array([(places.min(axis=0), places.max(axis=0)) for places in placed])
        return np.stack([ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)])

    def take(self, rows: slice | ArrayLike) -> PointCloud:
        """Return some of the points: a slice, which copies nothing, or an array of row numbers or of truth values.

        Raises
        ------
        InputError : rows that are not there.

        Examples
        --------
        >>> PointCloud([(0, 0, 0), (1, 0, 0), (2, 0, 0)]).take([2, 0]).positions[:, 0].tolist()
        [2.0, 0.0]
        """
        chosen = rows if isinstance(rows, slice) else _as_rows(rows, len(self))
        taken = PointCloud.__new__(PointCloud)
        stored = np.ascontiguousarray(self.stored[chosen])
        columns = dict.fromkeys(COLUMNS) | {name: np.ascontiguousarray(v[chosen]) for name, v in self.columns.items()}
        for array in (stored, *columns.values()):
            if array is not None:
                array.flags.writeable = False
        taken._keep(stored, self.scale, self.offset, self.size, self.crs, columns)
        return taken

    def select(
        self,
        *,
        bounds: ArrayLike | None = None,
        classification: int | str | Iterable[int | str] | None = None,
        returns: int | str | Iterable[int | str] | None = None,
        intensity: tuple[float, float] | None = None,
    ) -> PointCloud:
        """Return the points that meet all conditions that are given, in their order.

        Parameters
        ----------
        bounds : lowest and highest corner, both belong to it: (2, 3), or (2, 2) for x and y alone; may be infinite.
        classification : a class or several: numbers 0..255, or names such as "ground" or "building".
        returns : return numbers, or "first", "last" or "single"; several of them are joined by or.
        intensity : least and greatest.

        Raises
        ------
        InputError : a condition that cannot be read, or about what the cloud does not know.

        Examples
        --------
        >>> cloud = PointCloud([(0, 0, 0), (1, 0, 0), (2, 0, 0)], return_number=[1, 1, 2], number_of_returns=[1, 2, 2])
        >>> cloud.select(returns="last").positions[:, 0].tolist()
        [0.0, 2.0]
        >>> cloud.select(bounds=[(0.5, -1), (9, 1)], returns=[1]).positions[:, 0].tolist()
        [1.0]
        """
        kept = choose(self, bounds, classification, returns, intensity)
        return self if kept.all() else self.take(kept)

    def as_points(self) -> Points:
        """Return the cloud as Points, which are drawn as squares among meshes."""
        return Points(self.positions, self.colors, 1.0 if self.size is None else self.size)

    def __repr__(self) -> str:
        names = "".join(f", {name}" for name in self.columns)
        return f"PointCloud({len(self):,} point{'' if len(self) == 1 else 's'}{names})"


def _as_positions(positions: ArrayLike | None) -> NDArray[Any]:
    """Return positions as float32 or float64, (N, 3)."""
    array = as_array(positions if positions is not None else [], "positions")
    kind = np.float32 if array.dtype.kind == "f" and array.dtype.itemsize <= 4 else np.float64
    if array.ndim == 2 and array.shape[1] == 3 and array.dtype == kind:
        return _laid_out(array, kind)
    return as_floats(array, 3, "positions", kind)


def _laid_out(array: NDArray[Any], dtype: DTypeLike) -> NDArray[Any]:
    """Return the array in a type and C-contiguous; one that is so is not copied, though it may be read-only."""
    return np.require(array, dtype, ["C", "A", "E"])


def _as_stored_integers(integers: ArrayLike) -> NDArray[np.int32]:
    """Return coordinates as int32, (N, 3); quote the first that does not fit."""
    whole: NDArray[Any] = as_array(integers, "integers")
    if whole.dtype != np.int32:
        whole = as_integers(integers, "integers")
    if whole.size == 0 and whole.ndim == 1:
        whole = whole.reshape(0, 3)
    if whole.ndim != 2 or whole.shape[1] != 3:
        raise InputError(f"integers: expected shape (N, 3), got {whole.shape}")
    if whole.dtype != np.int32 and whole.size and (whole.min() < -(2**31) or whole.max() >= 2**31):
        row = int(np.argmax(((whole < -(2**31)) | (whole >= 2**31)).any(axis=1)))
        raise InputError(f"{quote_row(whole, 'integers', row)}: expected numbers of 32 bits")
    checked: NDArray[np.int32] = _laid_out(whole, np.int32)
    return checked


def _as_scale(scale: ArrayLike) -> Float64Array:
    """Return a scale, (3,), above 0."""
    found = _as_three(scale, "scale")
    if not (found > 0).all():
        raise InputError(f"scale = {tuple(found.tolist())}: expected numbers above 0")
    return found


def _as_offset(offset: ArrayLike) -> Float64Array:
    """Return an offset, (3,)."""
    if np.ndim(as_array(offset, "offset")) != 1:
        raise InputError(f"offset: expected shape (3,), got {np.shape(offset)}")
    return _as_three(offset, "offset")


def _as_three(values: ArrayLike, name: str) -> Float64Array:
    """Return three finite numbers, read-only; one stands for three."""
    array = as_array(values, name).astype(np.float64)
    if array.shape not in ((), (3,)):
        raise InputError(f"{name}: expected shape (3,), got {array.shape}")
    array = np.array(np.broadcast_to(array, 3))
    if not np.isfinite(array).all():
        raise InputError(f"{name} = {tuple(array.tolist())}: expected finite numbers")
    return own(array)


def _as_bytes_of_color(color: ArrayLike, count: int) -> NDArray[np.uint8]:
    """Return colours as (N, 3) or (N, 4) uint8."""
    if isinstance(color, np.ndarray) and color.dtype == np.uint8 and color.shape in ((count, 3), (count, 4)):
        return _laid_out(color, np.uint8)
    has_alpha = not isinstance(color, str) and np.shape(color)[-1:] == (4,)
    array = as_colors(color, (count,), "color")
    if array.dtype != np.uint8:
        array = np.rint(array.astype(np.float64) * 255.0).astype(np.uint8)
    array = array if has_alpha else array[..., :3]
    return _laid_out(np.tile(array, (count, 1)) if array.ndim == 1 else array, np.uint8)


def _one_for_each(values: ArrayLike, count: int, name: str) -> NDArray[Any]:
    """Return numbers, one for each point."""
    array = as_array(values, name)
    if array.shape == (count, 1):
        array = array[:, 0]
    if array.shape != (count,):
        raise InputError(f"{name}: expected shape ({count},), one for each point, got {array.shape}")
    return array


def _as_intensity(values: ArrayLike, count: int) -> NDArray[Any]:
    """Return intensities as uint16 where they are whole and fit, else as float32."""
    array = _one_for_each(values, count, "intensity")
    if array.dtype.kind in "biu" and (not count or (array.min() >= 0 and array.max() < 2**16)):
        return _laid_out(array, np.uint16)
    with np.errstate(over="ignore"):
        return _laid_out(array, np.float32)


def _as_bytes(values: ArrayLike, count: int, name: str) -> NDArray[np.uint8]:
    """Return whole numbers 0..255, one for each point."""
    array = _one_for_each(values, count, name)
    if array.dtype != np.uint8:
        array = as_integers(array, name) if array.dtype.kind != "b" else array.astype(np.int64)
        bad = (array < 0) | (array > 255)
        if bad.any():
            raise InputError(f"{quote_row(array, name, int(np.argmax(bad)))}: expected 0..255")
    checked: NDArray[np.uint8] = _laid_out(array, np.uint8)
    return checked


def _as_normals(values: ArrayLike, count: int) -> NDArray[np.float32]:
    """Return normals, (N, 3) float32."""
    array = as_floats(values, 3, "normals", np.float32)
    if len(array) != count:
        raise InputError(f"normals: expected shape ({count}, 3), one for each point, got {array.shape}")
    finite = np.isfinite(array)
    return array if finite.all() else np.where(finite.all(axis=1)[:, None], array, np.float32(0))


def _find_finite(
    stored: NDArray[Any], name: str, columns: dict[str, NDArray[Any] | None], nonfinite: str
) -> BoolArray | None:  # fmt: skip
    """Return which points have finite numbers only, None where all have; raise where none may be left out."""
    keep: BoolArray | None = None
    for label, values in ((name, stored), ("intensity", columns["intensity"])):
        if values is None or values.dtype.kind != "f" or (finite := np.isfinite(values)).all():
            continue
        good = finite if finite.ndim == 1 else finite.all(axis=1)
        if nonfinite == "error":
            raise InputError(f"{quote_row(values, label, int(np.argmin(good)))}: a point is not finite")
        keep = good if keep is None else keep & good
    return keep


def _check_reach(cloud: PointCloud) -> None:
    """Raise for a cloud so far away, or so large, that distances in it overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        low, high = cloud.bounds
    if len(cloud) and not (np.abs((low, high)) <= MAX_COORDINATE).all():
        raise InputError(f"positions reach from {low.tolist()} to {high.tolist()}: expected coordinates within 1e150")


def _as_rows(rows: ArrayLike, count: int) -> NDArray[Any]:
    """Return row numbers, or truth values of which there is one for each point."""
    array = as_array(rows, "rows")
    if array.dtype.kind == "b" and array.shape == (count,):
        return array
    if array.size == 0 and array.ndim == 1:
        return np.zeros(0, np.int64)
    if array.dtype.kind == "b" or array.ndim != 1:
        raise InputError(f"rows: expected row numbers or ({count},) truth values, got shape {array.shape} of {array.dtype}")
    whole = as_integers(array, "rows")
    if whole.min() < -count or whole.max() >= count:
        row = int(np.argmax((whole < -count) | (whole >= count)))
        raise InputError(f"{quote_row(whole, 'rows', row)}: the cloud has {count} points")
    return whole
