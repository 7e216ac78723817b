"""How a line may be stroked, checked once: width, cap, join, miter limit and dashes, named as in SVG."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanspan.errors import InputError, unknown_name
from scanspan.geometry.fixed_point import MAX_SIDE
from scanspan.geometry.stroke import CAPS, JOINS
from scanspan.raster.options import check_number
from scanspan.records import Float64Array


class Stroke(NamedTuple):
    """A checked way to stroke."""

    width: float  # pixels
    cap: str
    join: str
    miter_limit: float  # widths
    dash: Float64Array | None  # on, off, ... in pixels, not all 0
    dash_offset: float

    @property
    def is_plain(self) -> bool:
        """Whether it is one pixel wide and nothing else was asked for."""
        return self.width == 1 and self.cap == "butt" and self.dash is None


def check_extent(name: str, value: Any) -> float:
    """Return a number of pixels above 0 and at most 2^18, or raise an InputError that quotes it."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not is_number or not 0 < value <= MAX_SIDE:
        raise InputError(f"{name} = {value!r}: must be a number of pixels above 0 and at most {MAX_SIDE}")
    return float(value)


def check_dash(dash: Any) -> Float64Array | None:
    """Return a pattern of dashes, None for a whole line, or raise an InputError that quotes it."""
    if dash is None:
        return None
    try:
        pattern = np.asarray(dash)
    except ValueError:
        pattern = np.empty((0, 0))
    is_pattern = pattern.ndim == 1 and pattern.dtype.kind in "iuf" and 0 < len(pattern) <= MAX_SIDE
    if not is_pattern or not ((pattern >= 0) & (pattern <= MAX_SIDE)).all():
        raise InputError(f"dash = {dash!r}: must be lengths (on, off, ...) from 0 to {MAX_SIDE} pixels, or None")
    return pattern.astype(np.float64) if pattern.any() else None


def check_stroke(
    width: Any, cap: Any, join: Any = "miter", miter_limit: Any = 4.0, dash: Any = None, dash_offset: Any = 0.0
) -> Stroke:
    """Return a checked way to stroke, or raise an InputError."""
    wide = check_extent("width", width)
    for kind, name, valid in (("cap", cap, CAPS), ("join", join, JOINS)):
        if not isinstance(name, str) or name not in valid:
            raise unknown_name(kind, name, valid)
    limit = check_number("miter_limit", miter_limit, 1.0, float(MAX_SIDE))
    if join == "miter" and wide / 2 * limit > MAX_SIDE:
        raise InputError(f"miter_limit = {miter_limit!r}: with width = {width!r} a miter may be longer than {MAX_SIDE} pixels")
    offset = check_number("dash_offset", dash_offset, -float(1 << 24), float(1 << 24))
    return Stroke(wide, cap, join, limit, check_dash(dash), offset)
