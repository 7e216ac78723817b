"""What can be asked of a rasterizer, checked once: rule, culling, sub-pixel bits, threads.

Everything that a kernel relies on is made sure of here; a kernel is not reachable in any other way.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from scanspan.errors import InputError, unknown_name
from scanspan.geometry.fixed_point import MAX_COORDINATE, MAX_SUBPIXEL_BITS, MIN_SUBPIXEL_BITS
from scanspan.raster.edge import BOTTOM_LEFT, EXCLUSIVE, INCLUSIVE, INSIDE, OFFSCREEN_POINT, SAMPLE, TOP_LEFT, TOUCHED
from scanspan.records import Sampling
from scanspan.samples import sample_offsets

RULES = {
    "top-left": TOP_LEFT,
    "bottom-left": BOTTOM_LEFT,
    "shadow": BOTTOM_LEFT,
    "inclusive": INCLUSIVE,
    "exclusive": EXCLUSIVE,
}
COVERAGES = {"sample": SAMPLE, "touched": TOUCHED, "inside": INSIDE}
CULLING = {"none": 0, "back": 1, "front": -1}


@dataclass(frozen=True)
class OffscreenPoint:
    """The edge rule of the lectures: an edge owns its samples if a point off the screen lies on its inner side.

    Where the point lies on an edge's own line, it counts as moved by (+e, +e^2): to the right, and by less, down.

    Parameters
    ----------
    x, y : position in pixels, y down; snapped to the sub-pixel grid like a vertex.
    w : 1 for a point; 0 makes (x, y) a direction, a point infinitely far away; any other value divides x and y.

    Raises
    ------
    InputError : for numbers that are not finite, a point beyond 2^24 pixels, or (0, 0, 0).

    Examples
    --------
    >>> OffscreenPoint(-1, -1)
    OffscreenPoint(x=-1, y=-1, w=1)
    """

    x: float
    y: float
    w: float = 1

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not all(math.isfinite(v) for v in (self.x, self.y, self.w)) or not (self.x or self.y or self.w):
            raise InputError(f"{self!r}: x, y and w must be finite and not all 0")
        if self.w and max(abs(self.x / self.w), abs(self.y / self.w)) > MAX_COORDINATE:
            raise InputError(f"{self!r}: must lie within {MAX_COORDINATE} pixels; use w=0 for a direction")

    def on_grid(self, subpixel_bits: int) -> tuple[int, int, int]:
        """Return (x, y, w) as integers, w being 1 or 0."""
        if self.w:
            scale = float(1 << subpixel_bits)
            return int(np.rint(self.x / self.w * scale)), int(np.rint(self.y / self.w * scale)), 1
        scale = 2.0**39 / max(abs(self.x), abs(self.y))
        return int(np.rint(self.x * scale)), int(np.rint(self.y * scale)), 0


def check_integer(name: str, value: Any, low: int, high: int) -> int:
    """Return an integer argument as an int, or raise an InputError that quotes it."""
    try:
        number = operator.index(value)
    except TypeError:
        number = low - 1
    if isinstance(value, (bool, np.bool_)) or not low <= number <= high:
        raise InputError(f"{name} = {value!r}: must be a whole number from {low} to {high}")
    return number


def check_number(name: str, value: Any, low: float, high: float) -> float:
    """Return a number as a float, or raise an InputError that quotes it."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not is_number or not low <= value <= high:
        raise InputError(f"{name} = {value!r}: must be a number from {low} to {high}")
    return float(value)


def check_flag(name: str, value: Any) -> bool:
    """Return a yes or no as a bool, or raise an InputError that quotes it."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} = {value!r}: must be True or False")
    return bool(value)


def check_name(kind: str, name: object, valid: Iterable[str]) -> None:
    """Raise an InputError for a name that is not one of the valid ones, or no name at all."""
    if not isinstance(name, str) or name not in valid:
        raise unknown_name(kind, name, valid)


def check_subpixel_bits(value: Any) -> int:
    """Return the number of sub-pixel bits, 4 to 16."""
    return check_integer("subpixel_bits", value, MIN_SUBPIXEL_BITS, MAX_SUBPIXEL_BITS)


def check_threads(value: Any) -> int:
    """Return the number of threads; None stands for one for each processor that this process may use."""
    if value is None:
        available = getattr(os, "sched_getaffinity", None)
        return len(available(0)) if available else os.cpu_count() or 1
    return check_integer("threads", value, 1, 4096)


@lru_cache(maxsize=64)
def sample_centers(size: tuple[int, int], subpixel_bits: int) -> Sampling:
    """Return the sampling of polygons and lines: at centres, top-left, nothing culled."""
    offset = sample_offsets(1, subpixel_bits)[0]
    return make_sampling(size, offset, rule="top-left", cull="none", subpixel_bits=subpixel_bits)


def make_sampling(
    size: tuple[int, int], offset: Any, *, rule: str | OffscreenPoint, cull: str, subpixel_bits: int,
    coverage: str = "sample", order: int = 0,
) -> Sampling:  # fmt: skip
    """Return the Sampling of a whole image for one sample position.

    Parameters
    ----------
    size : (width, height) in pixels, checked.
    offset : the sample's (x, y) in sub-pixels from the pixel's corner.
    rule : a name of RULES, or an OffscreenPoint.
    cull : "none", "back" or "front".
    subpixel_bits : s, checked.
    coverage : "sample", "touched" or "inside".
    order : the number of an order, for algorithms that choose it as they go.
    """
    if isinstance(rule, OffscreenPoint):
        code, point = OFFSCREEN_POINT, rule.on_grid(subpixel_bits)
    elif isinstance(rule, str) and rule in RULES:
        code, point = RULES[rule], (0, 0, 1)
    else:
        raise unknown_name("rule", rule, [*RULES, "OffscreenPoint(x, y)"])
    if not isinstance(cull, str) or cull not in CULLING:
        raise unknown_name("cull", cull, CULLING)
    return Sampling(0, size[0], 0, size[1], subpixel_bits, int(offset[0]), int(offset[1]), CULLING[cull], code, *point,
                    COVERAGES[coverage], order)  # fmt: skip
