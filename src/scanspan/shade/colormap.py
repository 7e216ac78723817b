"""Colormaps: numbers become colours, on a linear, a logarithmic or an equalized scale.

A colormap is a list of colours, and a number gets the one of its step. Which step that is, is decided by operations that every
processor rounds alike. A library's logarithm is none, so there is one here: with v = 2^e m and m near 1, ln v = e ln 2 +
2 (s + s^3/3 + s^5/5 + ...), s = (m - 1) / (m + 1), |s| < 0.172, where eleven terms reach the last bits. An equalized scale
needs whole numbers alone: a step begins at the least number that enough others do not exceed, which is found by sorting.

The names and colours of colormaps come from the package cmap, which holds those of matplotlib, colorcet, crameri and others.

Source: the histogram equalization of scikit-image and datashader (`eq_hist`): a number's share is that of the numbers that are
not above it. There, floats are counted in 65,536 bins first; here, none are.
"""

from __future__ import annotations

import difflib
import importlib
from typing import Any

import numpy as np

from scanspan.assets.arrays import as_array
from scanspan.assets.codes import to_code
from scanspan.color.names import to_float_colors
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import quote
from scanspan.records import Array, Float64Array, Int64Array, UInt8Array

SCALES = ("linear", "log", "equalize")
STEPS = 256  # colours of a continuous colormap
BLOCK = 1 << 13  # numbers that are worked on together; they stay in the cache
TERMS = 11  # of the series of the logarithm; the next one is below 2^-58 of the first
LN2 = 0.6931471805599453
EXPECTED = 'expected the name of a colormap, "grey", or colours of shape (N, 3) or (N, 4)'


def colorize(
    values: Any, cmap: Any = "viridis", *, scale: str = "linear", limits: Any = None, nan: Any = "transparent",
    below: Any = None, above: Any = None,
) -> UInt8Array:  # fmt: skip
    """Return numbers as colours.

    Parameters
    ----------
    values : numbers of any shape, such as what `aggregate` returns. NaN is empty; in whole numbers, which are counts, so is 0.
    cmap : "grey", or the name of a colormap, which needs the package cmap; "_r" behind a name turns it round. Or (N, 3) or
        (N, 4) colours, integers 0..255 or floats 0..1, each for a step of the same width.
    scale : "linear"; "log", on which numbers that are not above 0 are empty; or "equalize", on which each step has about
        as many of the numbers as any other.
    limits : (low, high), where the first colour begins and the last one ends; by default the least and greatest number.
    nan : the colour of what is empty.
    below, above : colours of numbers beyond the limits; by default the first and the last one of the colormap.

    Returns
    -------
    (..., 4) uint8, sRGB with straight alpha, with the same bits on every machine for colours that are given.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> colorize([[1.0, 10.0, 100.0, np.nan]], "grey", scale="log")[..., 0]
    array([[  0, 128, 255,   0]], dtype=uint8)
    """
    if not isinstance(scale, str) or scale not in SCALES:
        raise unknown_name("scale", scale, SCALES)
    colors = find_colors(cmap)
    ends = [to_code(colors[0] if below is None else below), to_code(colors[-1] if above is None else above), to_code(nan)]
    array = as_array(values, "values")
    with np.errstate(over="ignore"):
        numbers = array.astype(np.float64).reshape(-1)
    empty = np.isnan(numbers) | (numbers == 0.0) if array.dtype.kind in "biu" else np.isnan(numbers)
    if scale == "log":
        empty |= ~(numbers > 0.0)
    low, high = find_limits(limits, numbers[~empty], scale)

    # Number the colours: those of the map, then below, above and empty.
    count = len(colors)
    step = find_steps(numbers, low, high, scale, count)
    step[numbers < low] = count
    step[numbers > high] = count + 1
    step[empty] = count + 2
    table = np.concatenate([colors, ends]).astype(np.uint8)
    found: UInt8Array = table[step].reshape(*array.shape, 4)
    return found


def find_colors(cmap: Any) -> UInt8Array:
    """Return the colours of a colormap, (N, 4) uint8."""
    if isinstance(cmap, str):
        if cmap in ("grey", "gray", "grey_r", "gray_r"):
            ramp = np.arange(STEPS)[:: -1 if cmap.endswith("_r") else 1]
            return np.stack([ramp, ramp, ramp, np.full(STEPS, 255)], axis=1).astype(np.uint8)
        return named_colors(cmap)
    try:
        array = np.asarray(cmap)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.ndim != 2 or array.shape[0] == 0 or array.shape[1] not in (3, 4) or array.dtype.kind not in "iuf":
        raise InputError(f"cmap = {quote(cmap)}: {EXPECTED}")
    codes: UInt8Array = np.rint(to_float_colors(array, np.float64) * 255.0).astype(np.uint8)
    return codes


def named_colors(name: str) -> UInt8Array:
    """Return the colours of a colormap of the package cmap: all of them where it is a list, else 256 steps."""
    try:
        catalog: Any = importlib.import_module("cmap")
    except ImportError:
        needed = 'needs the package cmap: pip install "scanspan[plots]"; "grey" does without'
        raise InputError(f"cmap = {name!r}: {needed}") from None
    try:
        found = catalog.Colormap(name)
    except (ValueError, TypeError, KeyError):
        near = difflib.get_close_matches(name, sorted(catalog.Catalog().short_keys()), n=1)
        hint = f"did you mean {near[0]!r}?" if near else EXPECTED
        raise InputError(f"cmap = {name!r}: the package cmap has no such colormap; {hint}") from None
    steps = found.num_colors if found.interpolation == "nearest" else STEPS
    codes: UInt8Array = np.rint(np.clip(found.lut(steps), 0.0, 1.0) * 255.0).astype(np.uint8)
    return codes


def find_limits(limits: Any, numbers: Float64Array, scale: str) -> tuple[float, float]:
    """Return where the first colour begins and the last one ends: as given, or the least and greatest finite number."""
    if limits is None:
        finite = numbers[np.isfinite(numbers)]
        return (float(finite.min()), float(finite.max())) if len(finite) else (1.0, 1.0)
    try:
        array = np.asarray(limits)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    good = array.shape == (2,) and array.dtype.kind in "iuf" and bool(np.isfinite(array).all()) and array[0] <= array[1]
    if not good or (scale == "log" and array[0] <= 0):
        wanted = "with 0 < low <= high" if scale == "log" else "with low <= high"
        raise InputError(f"limits = {quote(limits)}: expected two finite numbers (low, high) {wanted}")
    return float(array[0]), float(array[1])


def find_steps(numbers: Float64Array, low: float, high: float, scale: str, count: int) -> Int64Array:
    """Return the step of each number, 0 to count - 1; anything for those that are not from low to high."""
    if scale == "equalize":
        within = numbers[(numbers >= low) & (numbers <= high)]
        return np.searchsorted(equal_starts(within, count), numbers, side="right")
    steps = np.empty(len(numbers), np.int64)
    start, end = (logarithm(np.array([low, high])) if scale == "log" else np.array([low, high])).tolist()
    for first in range(0, len(numbers), BLOCK):
        block = np.clip(numbers[first : first + BLOCK], low, high)
        block = np.where(np.isnan(block), low, block)
        block = logarithm(block) if scale == "log" else block

        # Halve what would overflow; a range without length is the first step.
        span = end * 0.5 - start * 0.5
        share = (block * 0.5 - start * 0.5) / (span if span > 0.0 else 1.0)
        steps[first : first + BLOCK] = np.clip(share * count, 0, count - 1)
    return steps


def equal_starts(numbers: Array, count: int) -> Array:
    """Return the numbers at which steps 1 to count - 1 begin, so that each has about as many of them, (count - 1,).

    The share of a number is that of those that are not above it, with the least number's counted as 0: for whole numbers what
    datashader has.
    """
    ordered = np.sort(numbers)
    total = len(ordered)
    if not total or ordered[0] == ordered[-1]:
        return np.full(count - 1, np.inf)
    least = int(np.searchsorted(ordered, ordered[0], side="right"))

    # Step k begins where the share reaches k / count, which is a question of whole numbers.
    k = np.arange(1, count)
    needed = least - (-k * (total - least)) // count
    starts: Array = ordered[needed - 1]
    return starts


def logarithm(numbers: Float64Array) -> Float64Array:
    """Return the natural logarithm of numbers above 0 to the last bits, by operations that every processor rounds alike."""
    mantissa, exponent = np.frexp(numbers)
    is_low = mantissa < 0.7071067811865476
    m = np.where(is_low, mantissa + mantissa, mantissa)
    s = (m - 1.0) / (m + 1.0)
    square = s * s
    total = np.full(len(numbers), 1.0 / (2 * TERMS - 1))
    for k in range(TERMS - 2, -1, -1):
        total = total * square + 1.0 / (2 * k + 1)
    result: Float64Array = (exponent - is_low) * LN2 + 2.0 * s * total
    return result
