"""Colours at the corners of triangles, as people give them, checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.arrays import as_array, in_layout
from scanspan.errors import InputError
from scanspan.records import UInt8Array


def as_corner_colors(colors: Any, count: int) -> NDArray[Any]:
    """Return colours (N, 3, 3) or (N, 3, 4) as uint8, or as float64 from 0 to 255 where floats 0..1 are given.

    Parameters
    ----------
    colors : (N, 3, 3) or (N, 3, 4), N the count; integers 0..255 or floats 0..1, by their type.
    """
    array = as_array(colors, "colors")
    if array.ndim != 3 or array.shape[:2] != (count, 3) or array.shape[2] not in (3, 4):
        raise InputError(f"colors: expected shape ({count}, 3, 3) or ({count}, 3, 4), got {array.shape}")
    if array.dtype.kind == "b":
        raise InputError("colors: expected integers 0..255 or floats 0..1, got dtype bool")
    highest = 1 if array.dtype.kind == "f" else 255
    if array.dtype != np.uint8:
        bad = ~((array >= 0) & (array <= highest))
        if bad.any():
            n, k, channel = np.argwhere(bad)[0].tolist()
            kind = "floats are 0..1" if highest == 1 else "integers are 0..255"
            raise InputError(f"colors[{n}, {k}]: {array[n, k, channel]} is no colour value, {kind}")
    return in_layout(array, np.uint8) if highest == 255 else np.ascontiguousarray(array, np.float64) * 255.0


def to_corner_codes(codes: UInt8Array, count: int) -> UInt8Array:
    """Return colours (4,) or (N, 4) of triangles, one for all or one for each, as those of their corners, (N, 3, 4)."""
    each = codes if codes.ndim == 1 else codes[:, None]
    return np.ascontiguousarray(np.broadcast_to(each, (count, 3, 4)))


def has_alpha(colors: NDArray[Any]) -> bool:
    """Say whether any of the colours of corners lets something through."""
    return colors.shape[2] == 4 and bool((colors[..., 3] < 255).any())


def are_shaded(colors: Any) -> bool:
    """Say whether colours are given for corners: three axes, whatever is in them."""
    try:
        return not isinstance(colors, str) and np.ndim(colors) == 3
    except ValueError:
        return False  # rows of several lengths
