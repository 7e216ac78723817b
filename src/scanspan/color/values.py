"""Reading the numbers of colours: checked once at the boundary, then trusted.

Encoded values are integers 0..255 or floats 0..1, by their type. A float that rounding has pushed out of 0..1 by less than a
millionth is taken as 0 or 1, so that the result of one conversion is always good enough for the next; anything further out is
a mistake, most often 0..255 in floats, and is quoted.

Source: the rule that the whole package has for colours, as in shade/color.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError
from scanspan.homogeneous import quote
from scanspan.records import Float64Array

# How far a float may lie outside 0..1: four units in the last place of a float32.
_SLACK = 1e-6

# Values without a natural end, light among them, may be this large, so that squares and ratios of them stay finite.
LARGEST = 1e30


def array_of(name: str, value: object, triples: bool = True) -> npt.NDArray[Any]:
    """Return a value as an array of numbers, its last axis three long if it holds triples.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : integers or floats; booleans, strings and complex numbers are refused.
    triples : whether the shape must be (..., 3).

    Raises
    ------
    InputError : when the type or the shape is another.

    >>> array_of("rgb", [[1, 2, 3]])
    array([[1, 2, 3]])
    """
    wanted = "numbers of shape (..., 3)" if triples else "numbers"
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name} = {quote(value)}: expected {wanted}") from None
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} has type {array.dtype}: expected {wanted}")
    if triples and (array.ndim == 0 or array.shape[-1] != 3):
        hint = f"; leave the alpha out with {name}[..., :3]" if array.ndim and array.shape[-1] == 4 else ""
        raise InputError(f"{name} has shape {array.shape}: expected {wanted}{hint}")
    return array


def quote_first(name: str, array: npt.NDArray[Any], bad: npt.NDArray[np.bool_]) -> str:
    """Return the first bad element of an array as `name[index] = value`.

    >>> quote_first("light", np.array([1.0, -2.0]), np.array([False, True]))
    'light[1] = -2.0'
    """
    where = tuple(int(i) for i in np.argwhere(bad)[0])
    index = f"[{', '.join(map(str, where))}]" if where else ""
    return f"{name}{index} = {array[where].item()}"


def encoded_values(name: str, value: object, triples: bool = True) -> Float64Array:
    """Return encoded values as float64 0..1: integers are divided by 255.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : integers 0..255 or floats 0..1, by their type.
    triples : whether the shape must be (..., 3).

    Raises
    ------
    InputError : when the type or the shape is another, or a number is out of its range.

    >>> encoded_values("rgb", (255, 51, 0)).tolist()
    [1.0, 0.2, 0.0]
    """
    array = array_of(name, value, triples)
    if array.dtype.kind != "f":
        bad = (array < 0) | (array > 255)
        if bad.any():
            raise InputError(f"{quote_first(name, array, bad)}: expected integers between 0 and 255")
        return np.asarray(array / 255.0, dtype=np.float64)
    return unit_values(name, array, "; 0..255 needs an integer type")


def unit_values(name: str, array: npt.NDArray[Any], hint: str = "") -> Float64Array:
    """Return floats as float64 0..1, or raise an InputError that quotes the first that is further out.

    >>> unit_values("saturation", np.array([0.5, 1.0000001])).tolist()
    [0.5, 1.0]
    """
    values = _as_float64(array)
    bad = ~((values >= -_SLACK) & (values <= 1.0 + _SLACK))
    if bad.any():
        hint = hint if 1.0 < values[bad].max() <= 255.0 else ""
        raise InputError(f"{quote_first(name, array, bad)}: expected floats between 0 and 1{hint}")
    result: Float64Array = np.clip(values, 0.0, 1.0)
    return result


def float_values(name: str, value: object, reason: str, triples: bool = True) -> Float64Array:
    """Return values without a natural end, such as light, as float64.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : floats; integers are refused.
    reason : why integers are refused, for the message.
    triples : whether the shape must be (..., 3).

    Raises
    ------
    InputError : when the type or the shape is another, or a number is not finite or beyond 1e30.

    >>> float_values("linear", (0.5, 2.0, -0.25), "linear light has no codes").tolist()
    [0.5, 2.0, -0.25]
    """
    array = array_of(name, value, triples)
    if array.dtype.kind != "f":
        raise InputError(f"{name} has type {array.dtype}: expected floats; {reason}")
    return bounded_values(name, array)


def bounded_values(name: str, array: npt.NDArray[Any], largest: float = LARGEST) -> Float64Array:
    """Return numbers as float64, or raise an InputError that quotes the first that is not finite or too large.

    >>> bounded_values("lab", np.array([50, 0, 0])).tolist()
    [50.0, 0.0, 0.0]
    """
    values = _as_float64(array)
    bad = ~(np.abs(values) <= largest)
    if bad.any():
        raise InputError(f"{quote_first(name, array, bad)}: expected finite numbers, none beyond {largest:g}")
    return values


def _as_float64(array: npt.NDArray[Any]) -> Float64Array:
    """Return a copy as float64; what is too large for that becomes infinity, which is refused later."""
    with np.errstate(over="ignore"):
        return np.array(array, dtype=np.float64)
