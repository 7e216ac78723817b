"""Segments and points in space: what is drawn beside triangles.

Widths and sizes are in pixels, whatever the distance. Colours are one for all, one for each segment, or one for each point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_colors, as_floats, as_indices, own, quote_row
from scanspan.assets.mesh import NONFINITE, bounds_of
from scanspan.errors import InputError, unknown_name


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Segments:
    """Straight lines between points in space.

    Parameters
    ----------
    positions : (P, 3), kept as float64.
    segments : (S, 2), whole numbers, the two ends of each segment.
    colors : None for the material's colour, (4,) for all, (S, 4) for each segment or (P, 4) for each end; where S equals P,
        they are the segments'. Integers 0..255 or floats 0..1, sRGB, straight alpha; a missing alpha is opaque.
    width : pixels, above 0.
    nonfinite : "error" or "drop", as for Mesh.

    Raises
    ------
    InputError : a shape, a type, an index or a number that cannot be used; it is quoted.

    Examples
    --------
    >>> Segments([(0, 0, 0), (1, 0, 0)], [(0, 1)], colors=(255, 0, 0))
    Segments(2 positions, 1 segment)
    """

    positions: NDArray[np.float64]
    segments: NDArray[np.int32]
    colors: NDArray[Any] | None
    width: float

    def __init__(
        self,
        positions: ArrayLike,
        segments: ArrayLike,
        colors: ArrayLike | None = None,
        width: float = 1.0,
        *,
        nonfinite: str = "error",
    ) -> None:
        if nonfinite not in NONFINITE:
            raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
        points = as_floats(positions, 3, "positions")
        ends = as_indices(segments, 2, len(points), "segments")
        palette = None if colors is None else as_colors(colors, (len(ends), len(points)), "colors")
        finite = np.isfinite(points).all(axis=1)
        bad = ~finite[ends].all(axis=1)
        if bad.any() and nonfinite == "error":
            vertex = next(v for v in ends[np.argmax(bad)].tolist() if not finite[v])
            raise InputError(f"{quote_row(points, 'positions', vertex)}: a position that is used is not finite")
        if bad.any():
            if palette is not None and palette.ndim == 2 and len(palette) == len(ends):
                palette = palette[~bad]
            ends = ends[~bad]
        object.__setattr__(self, "positions", own(points))
        object.__setattr__(self, "segments", own(ends))
        object.__setattr__(self, "colors", palette)
        object.__setattr__(self, "width", as_pixels(width, "width"))

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest x, y, z of the ends that are used, (2, 3) float64; NaN when there is no segment."""
        return bounds_of(self.positions, self.segments)

    def __repr__(self) -> str:
        count = len(self.segments)
        return f"Segments({len(self.positions):,} positions, {count:,} segment{'' if count == 1 else 's'})"


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Points:
    """Points in space, drawn as squares.

    Parameters
    ----------
    positions : (P, 3), kept as float64.
    colors : None for the material's colour, (4,) for all or (P, 4) for each, as for Segments.
    size : pixels, above 0.
    nonfinite : "error" or "drop", as for Mesh.

    Raises
    ------
    InputError : a shape, a type or a number that cannot be used; it is quoted.

    Examples
    --------
    >>> Points([(0, 0, 0), (1, 0, 0)], size=3)
    Points(2 points)
    """

    positions: NDArray[np.float64]
    colors: NDArray[Any] | None
    size: float

    def __init__(
        self, positions: ArrayLike, colors: ArrayLike | None = None, size: float = 1.0, *, nonfinite: str = "error"
    ) -> None:
        if nonfinite not in NONFINITE:
            raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
        points = as_floats(positions, 3, "positions")
        palette = None if colors is None else as_colors(colors, (len(points),), "colors")
        finite = np.isfinite(points).all(axis=1)
        if not finite.all():
            if nonfinite == "error":
                raise InputError(f"{quote_row(points, 'positions', int(np.argmin(finite)))}: a point is not finite")
            points = points[finite]
            palette = palette if palette is None or palette.ndim == 1 else palette[finite]
        object.__setattr__(self, "positions", own(points))
        object.__setattr__(self, "colors", palette)
        object.__setattr__(self, "size", as_pixels(size, "size"))

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest x, y, z, (2, 3) float64; NaN when there is no point."""
        return bounds_of(self.positions, np.arange(len(self.positions), dtype=np.int32))

    def __repr__(self) -> str:
        count = len(self.positions)
        return f"Points({count:,} point{'' if count == 1 else 's'})"


def as_pixels(value: float, name: str) -> float:
    """Return a length in pixels, finite and above 0."""
    try:
        length = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {value!r}: expected a number of pixels") from None
    if isinstance(value, (bool, str)) or not (math.isfinite(length) and length > 0):
        raise InputError(f"{name} = {value!r}: expected a number of pixels above 0")
    return length
