"""Triangles by edge walking, as S0 and S4 describe it in words: sort, find the breakpoint, fill spans, mind the offsets.

No slide has code for it; this follows the sentences one by one. The two that decide about pixels are switches, so that what is
wrong with them can be seen: which pixels a span has, and whether values are moved from the edge to the pixel's centre.

Known faults, with numbers in the functions at the end:

- Ceiling for the leftmost pixel and floor for the rightmost includes both ends: an upright edge through samples is drawn by
  both neighbours, and so is a level one. Ceiling less one for the rightmost, and the same for rows, gives each sample to one.
- Without the fractional offset a value is that of the edge and not of the sample: off by up to a whole step.
- Sorting in x is not needed; the sign of a cross product says on which side the breakpoint is.

Source: S0, lines 82-94; S4, lines 114-139; S1, lines 68-75, for the order of work on old hardware.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from scanspan.errors import unknown_name
from scanspan.homogeneous import finite_array
from scanspan.lectures.compare import shipped_channel, shipped_hits
from scanspan.lectures.raster import Raster
from scanspan.records import Float64Array, Int32Array

ENDS = ("ceiling-floor", "ceiling-ceiling")


class Corner(NamedTuple):
    """A corner with a value, exact."""

    x: Fraction
    y: Fraction
    value: Fraction


class Span(NamedTuple):
    """The part of a scan line that is inside: where its edges are, and their values there."""

    y: int
    x_left: Fraction
    x_right: Fraction
    left_value: Fraction
    right_value: Fraction


class Walk(NamedTuple):
    """A triangle cut into spans."""

    breakpoint: str  # where the middle corner is: "left", "right", or "none" for a triangle with a level edge
    spans: list[Span]


def corners_of(points: Sequence[Sequence[float]], values: Sequence[float]) -> list[Corner]:
    """Return three points with three values as exact corners."""
    places, levels = finite_array("points", points, (3, 2)).tolist(), finite_array("values", values, (3,)).tolist()
    return [Corner(Fraction(x), Fraction(y), Fraction(value)) for (x, y), value in zip(places, levels, strict=True)]


def along(start: Corner, end: Corner, y: int, is_offset: bool) -> tuple[Fraction, Fraction]:
    """Return where an edge meets a scan line, and its value there.

    Without the offset the value is that of as many whole steps as rows were walked: it starts at the corner, which lies above
    the first scan line.
    """
    down = end.y - start.y
    share = (y - start.y) / down
    told = share if is_offset else Fraction(y - ceil(start.y)) / down
    return start.x + share * (end.x - start.x), start.value + told * (end.value - start.value)


def walk(
    points: Sequence[Sequence[float]], values: Sequence[float], *, ends: str = "ceiling-floor", is_offset: bool = True
) -> Walk:
    """Cut a triangle into spans, y down, sampled at whole coordinates; S4, lines 118-121.

    Parameters
    ----------
    points, values : three corners (x, y), and a value at each.
    ends : "ceiling-floor", as S4 says in its line 137, or "ceiling-ceiling", which leaves out the far end; of rows and spans.
    is_offset : whether values start at the first scan line instead of at the corner.

    Raises
    ------
    InputError : for anything but three finite points and three finite values, and an unknown name.

    Examples
    --------
    >>> found = walk([(0, 0), (4, 0), (0, 2)], [0, 0, 0])
    >>> found.breakpoint, [(span.y, float(span.x_left), float(span.x_right)) for span in found.spans]
    ('none', [(0, 0.0, 4.0), (1, 0.0, 2.0), (2, 0.0, 0.0)])
    """
    if ends not in ENDS:
        raise unknown_name("ends", ends, ENDS)

    # L118: sort the corners. In y first; x only breaks ties.
    top, middle, bottom = sorted(corners_of(points, values), key=lambda corner: (corner.y, corner.x))
    if top.y == bottom.y:
        return Walk("none", [])

    # L119: on which side of the long edge the middle one lies.
    side = (middle.x - top.x) * (bottom.y - top.y) - (bottom.x - top.x) * (middle.y - top.y)
    is_level = middle.y in (top.y, bottom.y)
    place = "none" if is_level or side == 0 else "right" if side > 0 else "left"

    # L120-121: walk down the long edge and the two short ones, one after the other.
    last = floor(bottom.y) if ends == "ceiling-floor" else ceil(bottom.y) - 1
    spans = []
    for y in range(ceil(top.y), last + 1):
        is_above = y < middle.y or (y == middle.y == bottom.y and middle.y != top.y)
        long = along(top, bottom, y, is_offset)
        short = along(top, middle, y, is_offset) if is_above else walk_lower(middle, bottom, y, is_offset)
        left, right = (long, short) if side > 0 else (short, long)
        spans.append(Span(y, left[0], right[0], left[1], right[1]))
    return Walk(place, spans)


def walk_lower(middle: Corner, bottom: Corner, y: int, is_offset: bool) -> tuple[Fraction, Fraction]:
    """Return `along` of the lower short edge, which may be level."""
    return (middle.x, middle.value) if middle.y == bottom.y else along(middle, bottom, y, is_offset)


def fill(raster: Raster, found: Walk, *, ends: str = "ceiling-floor", is_offset: bool = True) -> Float64Array:
    """Fill the spans of a walk and return the values, (height, width); S4, lines 137-139.

    The value of a pixel starts from the left edge's; with the offset, it is moved from there to the pixel.
    """
    values = np.zeros((raster.height, raster.width))
    for span in found.spans:
        last = floor(span.x_right) if ends == "ceiling-floor" else ceil(span.x_right) - 1
        first, width = ceil(span.x_left), span.x_right - span.x_left
        slope = (span.right_value - span.left_value) / width if width else Fraction(0)
        offset = first - span.x_left if is_offset else Fraction(0)
        if not 0 <= span.y < raster.height:
            continue
        for x in range(max(first, 0), min(last, raster.width - 1) + 1):
            raster.hits[span.y, x] += 1
            values[span.y, x] = float(span.left_value + (x - first + offset) * slope)
    return values


def walked_hits(triangles: Sequence[Sequence[Sequence[float]]], size: tuple[int, int], ends: str) -> Int32Array:
    """Return how often walking draws each pixel."""
    raster = Raster(*size)
    for points in triangles:
        fill(raster, walk(points, [0, 0, 0], ends=ends), ends=ends)
    return raster.hits


class BothEnds(NamedTuple):
    """Two triangles that share an upright edge through samples, and the pixels that both draw."""

    drawn_twice: int  # ceiling and floor
    drawn_twice_half_open: int  # ceiling and ceiling less one
    different_from_shipped: int  # of the half-open ones, from the top-left rule


def demonstrate_both_ends() -> BothEnds:
    """Draw two triangles left and right of the edge from (8, 0) to (8, 12)."""
    triangles, size = [[(8, 0), (8, 12), (1, 5)], [(8, 0), (8, 12), (15, 7)]], (17, 14)
    closed, half_open = (walked_hits(triangles, size, ends) for ends in ENDS)
    return BothEnds(
        int((closed > 1).sum()), int((half_open > 1).sum()), int((half_open != shipped_hits(triangles, size)).sum())
    )  # fmt: skip


class Offsets(NamedTuple):
    """The worst error of a value that rises by one step a pixel, in steps."""

    without_offset: float
    with_offset: float
    shipped: float


def demonstrate_offsets() -> Offsets:
    """Walk a triangle with corners between samples, with the value 3 x + 5 y; steps are of 5, the larger slope."""
    points, size = [(2.75, 1.125), (29.5, 9.25), (10.125, 28.75)], (32, 32)
    values = [3 * x + 5 * y for x, y in points]
    exact = np.add.outer(5.0 * np.arange(size[1]), 3.0 * np.arange(size[0]))
    errors = []
    for is_offset in (False, True):
        raster = Raster(*size)
        found = fill(raster, walk(points, values, is_offset=is_offset), is_offset=is_offset)
        errors.append(float(np.abs(found - exact)[raster.covered].max() / 5))
    shipped = shipped_channel(points, values, size)
    return Offsets(errors[0], errors[1], float(np.abs(shipped - exact)[raster.covered].max() / 5))
