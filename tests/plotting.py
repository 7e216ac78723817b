"""What the tests of aggregates share: a naive oracle for points, and reductions of values that come in order."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from math import floor
from typing import Any

import numpy as np

REDUCTIONS = ("count", "sum", "mean", "min", "max")


def reduced(reduce: str, values: list[float]) -> float:
    """Return what the values of one pixel come to, in their order."""
    if reduce == "count":
        return len(values)
    if not values:
        return np.nan
    total = values[0]
    for value in values[1:]:
        total += value
    return {"sum": total, "mean": total / len(values), "min": min(values), "max": max(values)}[reduce]


def reduced_image(reduce: str, size: tuple[int, int], hits: Iterable[tuple[int, int, float]]) -> Any:
    """Return an image of what the values of all (x, y, value) come to."""
    lists: dict[tuple[int, int], list[float]] = {}
    for x, y, value in hits:
        lists.setdefault((x, y), []).append(value)
    return np.array([[reduced(reduce, lists.get((x, y), [])) for x in range(size[0])] for y in range(size[1])])


def exact_pixels(points: Any, size: tuple[int, int], bounds: Any) -> list[tuple[int, int] | None]:
    """Return the pixel (x, y) of each point in rationals, None outside; bounds of None are pixels, y down."""
    x_low, y_low, x_high, y_high = (Fraction(float(v)) for v in (bounds or (0, 0, *size)))
    found: list[tuple[int, int] | None] = []
    for x, y in points:
        column = floor((Fraction(float(x)) - x_low) * size[0] / (x_high - x_low))
        row = floor((Fraction(float(y)) - y_low) * size[1] / (y_high - y_low))
        row = row if bounds is None else size[1] - 1 - row
        found.append((column, row) if 0 <= column < size[0] and 0 <= row < size[1] else None)
    return found


def same(a: Any, b: Any) -> bool:
    """Say whether two images have the same bits, NaN included."""
    return np.array_equal(a, b, equal_nan=True)
