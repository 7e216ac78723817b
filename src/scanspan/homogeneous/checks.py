"""What every public function asks of its arguments: arrays of a shape and finite numbers; and how a message quotes a value."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanspan.errors import InputError

FloatArray = npt.NDArray[np.float64]


def quote(value: object) -> str:
    """Return a value as one short line for an error message.

    >>> quote([[1.0, 2.0],
    ...        [3.0, 4.0]])
    '[[1.0, 2.0], [3.0, 4.0]]'
    """
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else text[:77] + "..."


def finite_array(name: str, value: object, shape: tuple[int | None, ...]) -> FloatArray:
    """Return a value as a float64 array of a given shape, every number finite.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : numbers; booleans, strings and complex numbers are refused.
    shape : the expected shape, None where any length will do.

    Raises
    ------
    InputError : when the value has another shape or type, or holds NaN or an infinity.

    >>> finite_array("eye", (1, 2, 3), (3,))
    array([1., 2., 3.])
    """
    wanted = "a number" if shape == () else f"numbers of shape ({', '.join('N' if n is None else str(n) for n in shape)}"
    wanted += "" if shape == () else ",)" if len(shape) == 1 else ")"
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name} = {quote(value)}: expected {wanted}") from None

    # Compare type and shape before the values, so that the message names the first thing that is wrong.
    matches = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in "iuf" or not matches:
        came = f"shape {array.shape}" if array.dtype.kind in "iuf" else f"type {array.dtype}"
        raise InputError(f"{name} = {quote(value)}: expected {wanted}, not {came}")
    with np.errstate(over="ignore"):
        result = np.array(array, dtype=np.float64)
    if not np.isfinite(result).all():
        where = np.argwhere(~np.isfinite(result))[0]
        index = f"[{', '.join(map(str, where))}]" if shape else ""
        raise InputError(f"{name}{index} = {float(result[tuple(where)])}: expected a finite number")
    return result


def shape_of(value: object) -> tuple[int, ...] | None:
    """Return the shape of an array, or None when a value is none, such as a ragged list.

    >>> shape_of([[1, 2], [3]]) is None
    True
    """
    try:
        return np.asarray(value).shape
    except (ValueError, TypeError, OverflowError):
        return None


def finite_number(name: str, value: object) -> float:
    """Return a value as a finite float, or raise an InputError that quotes it.

    >>> finite_number("fov", 45)
    45.0
    """
    return float(finite_array(name, value, ()))


def finite_vectors(name: str, value: object, widths: tuple[int, ...]) -> FloatArray:
    """Return vectors as a float64 array (..., k), every number finite.

    Parameters
    ----------
    name : what the caller calls the value, for the message.
    value : numbers; booleans, strings and complex numbers are refused.
    widths : the k that will do.

    Raises
    ------
    InputError : when the last axis has another length, the type is another, or a number is NaN or an infinity.

    >>> finite_vectors("line", (1, 1, -1), (3, 6))
    array([ 1.,  1., -1.])
    """
    shape = shape_of(value)
    if not shape or shape[-1] not in widths:
        came = "a ragged list" if shape is None else f"shape {shape}"
        wanted = " or ".join(f"(..., {width})" for width in widths)
        raise InputError(f"{name} = {quote(value)}: expected numbers of shape {wanted}, not {came}")
    return finite_array(name, value, shape)
