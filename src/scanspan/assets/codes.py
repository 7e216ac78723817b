"""Colours as people give them, as the 8-bit codes that are painted.

Names and plain tuples that were met before are not read again: a call that paints a pixel takes less time than that.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from scanspan.assets.arrays import as_colors, in_layout
from scanspan.color.names import parse_color
from scanspan.records import UInt8Array


@lru_cache(maxsize=256)
def _code_of(color: Any, kinds: tuple[type, ...]) -> UInt8Array:
    """Return a colour, (4,); 1 and 1.0 are equal but not the same colour, so the types of its numbers come with it."""
    return np.rint(parse_color(color) * 255.0).astype(np.uint8)


def to_code(color: Any) -> UInt8Array:
    """Return one colour as (4,) uint8, not to be changed."""
    if type(color) is str:
        return _code_of(color, ())
    if type(color) is tuple and all(type(part) in (int, float) for part in color):
        return _code_of(color, tuple(map(type, color)))
    return np.rint(parse_color(color) * 255.0).astype(np.uint8)


def to_codes(colors: Any, count: int | None = None) -> UInt8Array:
    """Return colours as (4,) or (N, 4) uint8; N must be `count`, and there is only one where that is None."""
    if count is None or type(colors) is str:
        return to_code(colors)
    if type(colors) is np.ndarray and colors.dtype == np.uint8 and colors.shape == (count, 4):
        return in_layout(colors, np.uint8)
    try:
        shape = np.shape(colors)
    except ValueError:
        shape = (0, 0)  # rows of several lengths, which as_colors refuses
    if count == 0 and shape == (0,):
        return np.empty((0, 4), np.uint8)
    if isinstance(colors, str) or len(shape) == 1:
        return to_code(colors)
    found = as_colors(colors, (count,), "colors")
    return found if found.dtype == np.uint8 else np.rint(found.astype(np.float64) * 255.0).astype(np.uint8)
