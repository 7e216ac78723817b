"""Lines one pixel wide, as S2 prints them: the DDA, the midpoint algorithm, and the midpoint algorithm in whole numbers.

All three are for one octant, 0 < dy < dx; the slides say so. What they do elsewhere is shown and not mended: an upright line is
one pixel, a steep one has gaps, one to the left is nothing.

Known faults, with numbers in the functions at the end:

- The DDA adds a rounded slope again and again: on a tie, or far along, a pixel lands on the wrong side.
- DDA and midpoint break ties differently: `Round` goes up, `d < 0` stays down. Of the 819 segments from the origin with
  0 <= dy <= dx <= 39, 249 differ, and those are the ones that the midpoint algorithm draws differently from the other end.
- f is not defined on the slides. It is the edge function (y0 - y1) x + (x1 - x0) y + x0 y1 - x1 y0, negative below the line.
- "On the previous step evaluated f(x - 1, y - .5) or f(x - 1, y + .05)": it was f(x, y - .5) or f(x, y + .5).
- "2d = ..." is no assignment, and the loop goes on to test d. Read literally, d starts with half of what it should.
- The first loop lacks its last brace.

Not a fault: y steps before d is updated; the update does not use y.

Source: S2, lines 103-234.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scanspan.canvas import Canvas

Pixel = tuple[int, int]
LARGEST = 39  # the segments of the notes end at most so far right
INT32 = (1 << 31) - 1


def dda(x0: int, y0: int, x1: int, y1: int) -> list[Pixel]:
    """Return the pixels of the DDA; S2, lines 119-131. `float` has 32 bits, Round goes to the nearest, halves up.

    >>> dda(0, 0, 4, 2)
    [(0, 0), (1, 1), (2, 1), (3, 2), (4, 2)]
    """
    # L122-125: the slope.
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = np.float32(x1 - x0), np.float32(y1 - y0)
        slope = dy / dx
        y = np.float32(y0)

        # L126-130: a pixel in every column.
        pixels = []
        for x in range(x0, x1 + 1):
            pixels.append((x, int(np.floor(np.float64(y) + 0.5))))
            y = y + slope
    return pixels


def f(x: Fraction, y: Fraction, x0: int, y0: int, x1: int, y1: int) -> Fraction:
    """Return the function that S2 uses and does not define: 0 on the line, negative below it.

    >>> int(f(Fraction(2), Fraction(0), 0, 0, 4, 2)), int(f(Fraction(2), Fraction(1), 0, 0, 4, 2))
    (-4, 0)
    """
    return (y0 - y1) * x + (x1 - x0) * y + x0 * y1 - x1 * y0


def midpoint(x0: int, y0: int, x1: int, y1: int) -> list[Pixel]:
    """Return the pixels of the midpoint algorithm; S2, lines 160-196, with the brace that is missing.

    >>> midpoint(0, 0, 4, 2)
    [(0, 0), (1, 0), (2, 1), (3, 1), (4, 2)]
    """
    y = y0
    d = f(Fraction(x0 + 1), y0 + Fraction(1, 2), x0, y0, x1, y1)
    pixels = []
    for x in range(x0, x1 + 1):
        pixels.append((x, y))
        if d < 0:
            y = y + 1
            d = d + (x1 - x0) + (y0 - y1)
        else:
            d = d + (y0 - y1)
    return pixels


def doubled_start(x0: int, y0: int, x1: int, y1: int) -> int:
    """Return what S2 writes after "2d =", lines 221-223. Since f is 0 at the start, it is 2 (y0 - y1) + (x1 - x0)."""
    return 2 * (y0 - y1) * (x0 + 1) + (x1 - x0) * (2 * y0 + 1) + 2 * x0 * y1 - 2 * x1 * y0


def midpoint_integer(x0: int, y0: int, x1: int, y1: int) -> list[Pixel]:
    """Return the pixels of the midpoint algorithm in whole numbers; S2, lines 220-233, with D for 2d throughout.

    >>> midpoint_integer(0, 0, 4, 2) == midpoint(0, 0, 4, 2)
    True
    """
    return step_doubled(x0, y0, x1, y1, Fraction(doubled_start(x0, y0, x1, y1)))


def midpoint_as_printed(x0: int, y0: int, x1: int, y1: int) -> list[Pixel]:
    """Return the pixels of the same lines read literally: 2 d is the sum, so d is half of it; the steps stay doubled.

    >>> midpoint_as_printed(0, 0, 4, 1), midpoint(0, 0, 4, 1)
    ([(0, 0), (1, 0), (2, 1), (3, 1), (4, 1)], [(0, 0), (1, 0), (2, 0), (3, 1), (4, 1)])
    """
    return step_doubled(x0, y0, x1, y1, Fraction(doubled_start(x0, y0, x1, y1), 2))


def step_doubled(x0: int, y0: int, x1: int, y1: int, d: Fraction) -> list[Pixel]:
    """Walk with doubled steps from a given start; S2, lines 224-233."""
    y = y0
    pixels = []
    for x in range(x0, x1 + 1):
        pixels.append((x, y))
        if d < 0:
            y = y + 1
            d = d + 2 * (x1 - x0) + 2 * (y0 - y1)
        else:
            d = d + 2 * (y0 - y1)
    return pixels


def shipped_pixels(x0: int, y0: int, x1: int, y1: int, algorithm: str) -> set[Pixel]:
    """Return the pixels that `Canvas.lines` paints between two pixels."""
    canvas = Canvas(max(x0, x1) + 1, max(y0, y1) + 1, "black")
    canvas.lines([[(x0, y0), (x1, y1)]], "white", algorithm=algorithm)
    return {(int(x), int(y)) for y, x in zip(*np.nonzero(canvas.pixels[..., 0]), strict=True)}


def octant(largest: int = LARGEST) -> list[tuple[int, int]]:
    """Return the ends (dx, dy) of the segments with 0 <= dy <= dx <= largest, dx > 0."""
    return [(dx, dy) for dx in range(1, largest + 1) for dy in range(dx + 1)]


class Ties(NamedTuple):
    """How many segments of an octant are drawn differently."""

    segments: int
    from_half_down: int  # midpoint against the exact line with halves rounded down
    from_half_up: int  # midpoint against halves rounded up
    from_other_end: int  # midpoint against itself, drawn from the other end
    shipped_midpoint: int  # midpoint against the shipped midpoint
    shipped_symmetric_from_other_end: int  # the shipped symmetric line against itself, from the other end


def demonstrate_ties(largest: int = LARGEST) -> Ties:
    """Draw all segments of an octant and compare.

    >>> demonstrate_ties(4)[:4]
    (14, 0, 4, 4)
    """
    differences = np.zeros(5, int)
    for dx, dy in octant(largest):
        drawn = set(midpoint(0, 0, dx, dy))
        down = {(x, (2 * dy * x + dx - 1) // (2 * dx)) for x in range(dx + 1)}
        up = {(x, (2 * dy * x + dx) // (2 * dx)) for x in range(dx + 1)}
        turned = {(dx - x, dy - y) for x, y in drawn}
        there, back = shipped_pixels(0, 0, dx, dy, "symmetric"), shipped_pixels(dx, dy, 0, 0, "symmetric")
        differences += [
            drawn != down,
            drawn != up,
            drawn != turned,
            drawn != shipped_pixels(0, 0, dx, dy, "midpoint"),
            there != back,
        ]
    return Ties(len(octant(largest)), *differences.tolist())


class DdaDrift(NamedTuple):
    """Segments of an octant that the DDA draws wrong, because its float has rounded."""

    segments: int
    wrong: int  # the DDA against the exact line with halves rounded up
    shipped_wrong: int
    example: tuple[int, int]  # the first end (dx, dy) that goes wrong, from the origin


def demonstrate_dda_drift(largest: int = LARGEST) -> DdaDrift:
    """Draw all segments of an octant with the DDA."""
    wrong, shipped_wrong = [], 0
    for dx, dy in octant(largest):
        exact = {(x, (2 * dy * x + dx) // (2 * dx)) for x in range(dx + 1)}
        if set(dda(0, 0, dx, dy)) != exact:
            wrong.append((dx, dy))
        shipped_wrong += shipped_pixels(0, 0, dx, dy, "dda") != exact
    return DdaDrift(len(octant(largest)), len(wrong), shipped_wrong, wrong[0] if wrong else (0, 0))


class OtherOctants(NamedTuple):
    """Pixels of a line outside of the slides' octant, and how many a line without gaps has."""

    drawn: int
    needed: int
    shipped: int


def demonstrate_other_octants(algorithm: Callable[..., list[Pixel]] = dda) -> dict[str, OtherOctants]:
    """Draw an upright line, a steep one, one to the left and one downwards.

    >>> demonstrate_other_octants()["steep"]
    OtherOctants(drawn=4, needed=10, shipped=10)
    """
    lines = {"upright": (3, 0, 3, 9), "steep": (0, 0, 3, 9), "to the left": (9, 4, 0, 0), "falling": (0, 4, 9, 0)}
    found = {}
    for name, ends in lines.items():
        x0, y0, x1, y1 = ends
        exact = max(abs(x1 - x0), abs(y1 - y0)) + 1
        right = set(algorithm(*ends)) & shipped_pixels(*ends, "midpoint" if algorithm is not dda else "dda")
        found[name] = OtherOctants(len(right), exact, len(shipped_pixels(*ends, "midpoint")))
    return found


class LiteralDoubling(NamedTuple):
    """Segments of an octant that the doubled algorithm draws wrong."""

    segments: int
    wrong_as_printed: int
    wrong_as_meant: int


def demonstrate_literal_doubling(largest: int = LARGEST) -> LiteralDoubling:
    """Draw all segments of an octant with "2d = ..." read both ways."""
    ends = octant(largest)
    printed = sum(midpoint_as_printed(0, 0, *end) != midpoint(0, 0, *end) for end in ends)
    meant = sum(midpoint_integer(0, 0, *end) != midpoint(0, 0, *end) for end in ends)
    return LiteralDoubling(len(ends), printed, meant)


class PreviousStep(NamedTuple):
    """At how many steps of a line the value d of the step before is f at a place."""

    steps: int
    at_printed: int  # (x - 1, y - .5) or (x - 1, y + .05)
    at_mended: int  # (x, y - .5) or (x, y + .5)


def demonstrate_previous_step(dx: int = 39, dy: int = 17) -> PreviousStep:
    """Walk a line and ask at each pixel (x, y) where the step before has evaluated f."""
    ends = (0, 0, dx, dy)
    pixels = midpoint(*ends)
    printed = mended = 0
    for (_, y_before), (x, y) in pairwise(pixels):
        d = f(Fraction(x), y_before + Fraction(1, 2), *ends)
        printed += d in (f(Fraction(x - 1), y - Fraction(1, 2), *ends), f(Fraction(x - 1), y + Fraction(1, 20), *ends))
        mended += d in (f(Fraction(x), y - Fraction(1, 2), *ends), f(Fraction(x), y + Fraction(1, 2), *ends))
    return PreviousStep(dx, printed, mended)


class LongForm(NamedTuple):
    """The start value of a line, term by term as the slide has it."""

    largest_term: int
    start: int
    short_form: int
    overflows: bool  # whether a term leaves 32 bits; where ints wrap around, the sum comes right all the same


def demonstrate_long_form(x0: int = 40_000, y0: int = 40_000, dx: int = 300, dy: int = 100) -> LongForm:
    """Form the start value far from the origin: its terms cancel, and leave 32 bits before they do."""
    x1, y1 = x0 + dx, y0 + dy
    terms = [2 * (y0 - y1) * (x0 + 1), (x1 - x0) * (2 * y0 + 1), 2 * x0 * y1, -2 * x1 * y0]
    largest = max(abs(term) for term in terms)
    return LongForm(largest, sum(terms), 2 * (y0 - y1) + (x1 - x0), largest > INT32)
