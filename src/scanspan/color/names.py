"""Colours as people write them: CSS names, hexadecimal digits, numbers.

Source: CSS Color Module Level 4.
"""

from __future__ import annotations

import difflib
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous import quote
from scanspan.records import Float64Array

_EXPECTED = "expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"


def parse_color(value: object) -> Float64Array:
    """Return a colour as sRGB with straight alpha, each 0..1.

    Parameters
    ----------
    value : a CSS name, "#rgb", "#rrggbb", "#rrggbbaa", "rgb(...)", "hsl(...)" or "transparent"; or three or four numbers:
        integers are 0..255 and floats 0..1, by their type and never by their value. A missing alpha is opaque.

    Returns
    -------
    (4,) float64.

    Raises
    ------
    InputError : when it is none of these, or a number is out of its range.

    >>> parse_color("tomato").round(3)
    array([1.   , 0.388, 0.278, 1.   ])
    >>> parse_color((255, 0, 0)).tolist() == parse_color((1.0, 0.0, 0.0)).tolist()
    True
    """
    if isinstance(value, str):
        from PIL import ImageColor  # which takes a while, and only names need it

        name = value.strip()
        if name.lower() == "transparent":
            return np.zeros(4)
        try:
            numbers: Any = ImageColor.getrgb(name)
        except ValueError:
            near = difflib.get_close_matches(name.lower(), ImageColor.colormap, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ":"
            raise InputError(f"{quote(value)} is no colour{hint} {_EXPECTED}") from None
    else:
        numbers = value
    try:
        array = np.asarray(numbers)
    except (ValueError, TypeError, OverflowError):
        array = np.zeros(0)
    if array.shape not in ((3,), (4,)) or array.dtype.kind not in "iuf":
        raise InputError(f"{quote(value)} is no colour: {_EXPECTED}")
    return cast(Float64Array, to_float_colors(array[None], np.float64)[0])


def to_float_colors(colors: npt.ArrayLike, dtype: npt.DTypeLike = np.float32) -> npt.NDArray[Any]:
    """Return many colours as sRGB with straight alpha, each 0..1.

    Parameters
    ----------
    colors : (N, 3) or (N, 4), integers 0..255 or floats 0..1, by their type.
    dtype : type of the result.

    Returns
    -------
    (N, 4) of that type; a missing alpha is 1.

    Raises
    ------
    InputError : when the shape or type is another, or a number is out of its range; the message quotes the row.

    >>> to_float_colors([[255, 0, 51]])
    array([[1. , 0. , 0.2, 1. ]], dtype=float32)
    """
    array = np.asarray(colors)
    if array.ndim != 2 or array.shape[1] not in (3, 4) or array.dtype.kind not in "iuf":
        raise InputError(f"colors has shape {array.shape} and type {array.dtype}: expected numbers of shape (N, 3) or (N, 4)")
    top = 1 if array.dtype.kind == "f" else 255
    bad = ~((array >= 0) & (array <= top)).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        kind = "floats between 0 and 1" if top == 1 else "integers between 0 and 255"
        where = f"colors[{row}]" if len(array) > 1 else "colour"
        raise InputError(f"{where} = {tuple(array[row].tolist())}: expected {kind}")
    result = np.ones((len(array), 4), dtype=dtype)
    result[:, : array.shape[1]] = array if top == 1 else array.astype(np.float64) / 255.0
    return result
