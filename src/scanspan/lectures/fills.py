"""Filling polygons as S2 prints it: the recursive flood fill from a seed, and the parity test along a scan line.

Flood fill: draw the outline, then call for a seed pixel a function that calls itself for the four neighbours. It fills what it
should and needs 4 N + 1 calls for N pixels, nested as deep as N. Python stops that at some thousand; Java and C end with a
full stack. `flood_fill` is the slide's function; `flood_fill_frames` is the same with its frames in a list, so that large ones
can be measured.

Parity test: along a scan line an odd number of crossed edges means inside. The slide leaves open what crossing means.

Known faults, with numbers in the functions at the end:

- Depth and calls of the recursion.
- The flag of each pixel must be cleared for every polygon, or the next one stays open where they overlap.
- The outline belongs to the shape, and where outlines touch, what is behind them is never reached.
- A line drawn from pixel to pixel is closed for a fill over four neighbours, and leaks over eight.
- A scan line through a vertex crosses two edges or one, unless one end of each edge is left out.
- Two edges between two pixels are one increment, not two.

Source: S2, lines 266-368.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.rings import as_points
from scanspan.canvas import Canvas
from scanspan.errors import unknown_name
from scanspan.masks import coverage
from scanspan.records import BoolArray, Int64Array

CROSSINGS = ("closed", "half-open")


class Flood:
    """What a fill has done so far: a polygon's outline, and the pixels that have the colour.

    Parameters
    ----------
    boundary : (H, W) bool, the pixels of the outline. What lies outside of the array counts as outline too, of which the slide
        says nothing.
    colored : (H, W) bool, pixels that have the colour already; changed in place. None is no pixel.
    """

    def __init__(self, boundary: BoolArray, colored: BoolArray | None = None) -> None:
        self.boundary = boundary
        self.colored: BoolArray = np.zeros(boundary.shape, bool) if colored is None else colored
        self.calls = self.depth = self.deepest = self.filled = 0

    def on_boundary(self, x: int, y: int) -> bool:
        """Say whether a pixel is on the outline."""
        height, width = self.boundary.shape
        return not (0 <= x < width and 0 <= y < height) or bool(self.boundary[y, x])

    def plot(self, x: int, y: int) -> None:
        """Colour a pixel."""
        self.colored[y, x] = True
        self.filled += 1


def flood_fill(flood: Flood, x: int, y: int) -> None:
    """Fill from a seed as S2 does in its lines 300-316, by calling itself.

    Raises
    ------
    RecursionError : for more pixels than Python lets calls nest; what was filled stays filled.

    Examples
    --------
    >>> flood = Flood(np.zeros((10, 10), bool))
    >>> flood_fill(flood, 4, 4)
    >>> flood.filled, flood.calls
    (100, 401)
    """
    flood.calls += 1
    if not (flood.on_boundary(x, y) or flood.colored[y, x]):
        flood.depth += 1
        flood.deepest = max(flood.deepest, flood.depth)
        flood.plot(x, y)
        flood_fill(flood, x + 1, y)
        flood_fill(flood, x, y + 1)
        flood_fill(flood, x, y - 1)
        flood_fill(flood, x - 1, y)
        flood.depth -= 1


def flood_fill_frames(flood: Flood, x: int, y: int) -> None:
    """Fill as `flood_fill` does, in the same order and with the same counts, with its frames in a list.

    >>> flood = Flood(np.zeros((100, 100), bool))
    >>> flood_fill_frames(flood, 0, 0)
    >>> flood.filled, flood.calls, flood.deepest
    (10000, 40001, 10000)
    """
    frames: list[tuple[int, int, int]] = []
    call: tuple[int, int] | None = (x, y)
    while call is not None:
        # Enter the function: its frame stays if the pixel is to be filled.
        flood.calls += 1
        if not (flood.on_boundary(*call) or flood.colored[call[1], call[0]]):
            flood.plot(*call)
            frames.append((*call, 0))
            flood.deepest = max(flood.deepest, len(frames))

        # Go on in the innermost frame that has a neighbour left.
        while frames and frames[-1][2] == 4:
            frames.pop()
        call = None
        if frames:
            i, j, k = frames.pop()
            frames.append((i, j, k + 1))
            call = ((i + 1, j), (i, j + 1), (i, j - 1), (i - 1, j))[k]


def outline(points: Sequence[tuple[int, int]], size: tuple[int, int]) -> BoolArray:
    """Return the pixels of a closed outline drawn from pixel to pixel: (height, width) bool. S2, line 296."""
    canvas = Canvas(*size, "black")
    canvas.lines(list(zip(points, [*points[1:], points[0]], strict=True)), "white")
    drawn: BoolArray = canvas.pixels[..., 0] > 0
    return drawn


class Recursion(NamedTuple):
    """A square filled by recursion."""

    pixels: int
    filled_before_the_crash: int  # all of them where Python's limit allows it
    python_limit: int  # calls
    calls_needed: int  # 4 N + 1
    depth_needed: int  # N
    shipped_filled: int
    shipped_looked_at: int


def demonstrate_recursion(side: int = 100) -> Recursion:
    """Fill a square of `side` pixels from its corner, by recursion until Python stops it, and by the shipped spans."""
    flood, frames = Flood(np.zeros((side, side), bool)), Flood(np.zeros((side, side), bool))
    with suppress(RecursionError):
        flood_fill(flood, 0, 0)
    flood_fill_frames(frames, 0, 0)
    canvas = Canvas(side, side, "white")
    shipped = canvas.flood_fill(0, 0, "red")
    limit = sys.getrecursionlimit()
    return Recursion(side * side, flood.filled, limit, frames.calls, frames.deepest, shipped["filled"], shipped["looked_at"])


class FloodShape(NamedTuple):
    """A polygon filled by flood, against the centres that are inside."""

    flooded: int  # pixels with the outline
    sampled: int  # pixels whose centres are inside
    only_flooded: int
    unreached: int  # pixels strictly inside that the flood never came to


def demonstrate_outline(points: Sequence[tuple[int, int]] = ((2, 2), (60, 11), (2, 13), (20, 10))) -> FloodShape:
    """Fill a thin polygon from a seed inside: the outline is drawn as well, and the tips stay cut off behind it."""
    size = (64, 16)
    edge = outline(points, size)
    inside = coverage([(x + 0.5, y + 0.5) for x, y in points], size)
    free = inside & ~edge
    y, x = (int(k) for k in np.argwhere(free)[0])
    flood = Flood(edge)
    flood_fill_frames(flood, x, y)
    shape = flood.colored | edge
    return FloodShape(
        int(shape.sum()), int(inside.sum()), int((shape & ~inside).sum()), int((free & ~flood.colored).sum())
    )  # fmt: skip


class StaleFlags(NamedTuple):
    """Two overlapping squares filled one after the other."""

    second_filled: int  # with the flags of the first left standing
    second_filled_if_cleared: int
    looked_at_to_clear: int  # pixels, for every polygon


def demonstrate_flags(side: int = 20) -> StaleFlags:
    """Fill a square, and then one that overlaps it by a quarter, without clearing the flags in between."""
    shape = (2 * side, 2 * side)
    first, second = np.ones(shape, bool), np.ones(shape, bool)
    first[:side, :side] = second[side // 2 : side // 2 + side, side // 2 : side // 2 + side] = False
    before = Flood(first)
    flood_fill_frames(before, 0, 0)
    stale, fresh = Flood(second, before.colored.copy()), Flood(second)
    for flood in (stale, fresh):
        flood_fill_frames(flood, side, side)
    return StaleFlags(stale.filled, fresh.filled, fresh.colored.size)


class Leak(NamedTuple):
    """Pixels filled inside of an outline with slanted sides."""

    over_four: int
    over_eight: int  # the whole picture, through the corners between the outline's pixels
    shipped_over_four: int


def demonstrate_leak() -> Leak:
    """Fill a rhombus over four neighbours and over eight."""
    points, size = [(16, 2), (30, 16), (16, 30), (2, 16)], (33, 33)
    edge = outline(points, size)
    flood = Flood(edge)
    flood_fill_frames(flood, 16, 16)
    filled = []
    for connectivity in (4, 8):
        canvas = Canvas(*size, "white")
        canvas.pixels[edge] = (0, 0, 0, 255)
        filled.append(canvas.flood_fill(16, 16, "red", connectivity=connectivity)["filled"])
    return Leak(flood.filled, filled[1], filled[0])


class Parity(NamedTuple):
    """A polygon filled by the parity test."""

    inside: BoolArray  # (H, W)
    tested: int  # pixels


def parity_fill(
    points: Sequence[Sequence[float]], size: tuple[int, int], *, crossing: str = "closed", counts_each: bool = False,
    in_box: bool = False,
) -> Parity:  # fmt: skip
    """Fill a polygon by counting edges along each scan line, through the centres of pixels; S2, lines 343-359.

    Parameters
    ----------
    points : (M, 2) one ring.
    size : (width, height).
    crossing : whether an edge includes "closed" both of its ends, as one would first write it, or is "half-open".
    counts_each : whether two edges between two pixels count as two. The slide adds one.
    in_box : whether only pixels of the polygon's box are tested; S2, lines 365-368.

    Raises
    ------
    InputError : for points that are not finite, and an unknown name.

    Examples
    --------
    >>> parity_fill([(0, 0), (3, 0), (0, 3)], (3, 3), crossing="half-open", counts_each=True).inside.astype(int).tolist()
    [[1, 1, 0], [1, 0, 0], [0, 0, 0]]
    """
    if crossing not in CROSSINGS:
        raise unknown_name("crossing", crossing, CROSSINGS)
    ring = [(Fraction(x), Fraction(y)) for x, y in as_points(points, (2,), "points").tolist()]
    if not ring:
        return Parity(np.zeros(size[::-1], bool), 0)
    width, height = size
    inside, tested = np.zeros((height, width), bool), 0
    first_x, end_x, first_y, end_y = box_of(points, size) if in_box else (0, width, 0, height)
    for j in range(first_y, end_y):
        # Between which pixels edges are crossed; before the first one, all of them that lie left of it.
        steps: Int64Array = np.zeros(width + 1, np.int64)
        y = j + Fraction(1, 2)
        for start, end in zip(ring, [*ring[1:], ring[0]], strict=True):
            low, high = sorted((start[1], end[1]))
            if low == high or not low <= y <= high or (crossing == "half-open" and y == high):
                continue
            x = start[0] + (y - start[1]) / (end[1] - start[1]) * (end[0] - start[0])
            steps[min(max(ceil(x - Fraction(1, 2)), first_x), width)] += 1

        # edgeCnt++ for each pair of pixels, and draw where it is odd.
        count = np.cumsum(steps if counts_each else np.minimum(steps, 1))[:width]
        inside[j, first_x:end_x] = count[first_x:end_x] % 2 == 1
        tested += end_x - first_x
    return Parity(inside, tested)


def box_of(points: Sequence[Sequence[float]], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the pixels of a polygon's box within the picture: x from and to before, and y."""
    found = np.asarray(points, np.float64)
    (x_low, y_low), (x_high, y_high) = np.floor(found.min(axis=0)), np.ceil(found.max(axis=0))
    return max(int(x_low), 0), min(int(x_high), size[0]), max(int(y_low), 0), min(int(y_high), size[1])


class ParityFaults(NamedTuple):
    """Pixels that a parity fill gets wrong."""

    closed: int  # an edge includes both ends
    once: int  # half-open, but two edges between two pixels count as one
    half_open: int  # half-open, and each edge counts
    shipped: int  # Canvas.polygon by parity, against its scan lines
    tested: int  # pixels
    tested_in_box: int


def demonstrate_parity() -> ParityFaults:
    """Fill a star that crosses itself, with points on the scan lines and tips narrower than a pixel."""
    points: list[tuple[float, float]] = [(30.5, 2.5), (42.5, 44.5), (5.5, 17.5), (55.5, 18.5), (17.5, 44.5)]
    size = (64, 48)
    right = coverage(points, size)
    ways: list[dict[str, Any]] = [
        {"crossing": "closed", "counts_each": True}, {"crossing": "half-open"}, {"crossing": "half-open", "counts_each": True},
    ]  # fmt: skip
    wrong = [int((parity_fill(points, size, **way).inside != right).sum()) for way in ways]
    boxed = parity_fill(points, size, crossing="half-open", counts_each=True, in_box=True)
    canvas = Canvas(*size, "black")
    canvas.polygon(points, "white", algorithm="parity")
    shipped = int(((canvas.pixels[..., 0] > 0) != right).sum())
    return ParityFaults(wrong[0], wrong[1], wrong[2], shipped, size[0] * size[1], boxed.tested)
