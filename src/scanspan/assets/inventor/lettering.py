"""Text as polygons: the outlines of letters, traced from the font that Pillow brings.

Pillow gives letters as pictures, not as outlines. Each is drawn large, its contour at half coverage is followed from pixel to
pixel with the crossing interpolated on every side, and points that lie on a line within a tenth of a pixel are left out. Fonts
that a file names are not searched for.

Source: Lorensen and Cline 1987, in two dimensions; Douglas and Peucker 1973.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray

PIXELS = 64  # of the letters that are traced, from line to line
LEVEL = 127.5
TOLERANCE = 0.12  # pixels
MAX_LETTERS = 20_000  # of one shape


class Letter(NamedTuple):
    """A letter one unit high: its rings, (n, 2) each with y up and the inside on the left, and how far the next one stands."""

    rings: tuple[FloatArray, ...]
    advance: float


class Line(NamedTuple):
    """A line of text: the rings of its letters, each letter's together, and its width."""

    letters: list[list[FloatArray]]
    width: float


def set_line(text: str) -> Line:
    """Return the letters of a line of text one unit high, from the origin to the right."""
    letters, x = [], 0.0
    for sign in text:
        letter = trace(sign)
        if letter.rings:
            letters.append([ring + np.array([x, 0.0]) for ring in letter.rings])
        x += letter.advance
    return Line(letters, x)


def set_lines(texts: list[str], size: float, spacing: float, justification: str) -> list[list[FloatArray]]:
    """Return the letters of several lines, of a size, one below the other: for each its rings, (n, 2).

    Raises
    ------
    InputError : more than MAX_LETTERS.
    """
    total = sum(map(len, texts))
    if total > MAX_LETTERS:
        raise InputError(f"expected at most {MAX_LETTERS} letters, got {total}")
    letters = []
    for number, text in enumerate(texts):
        line = set_line(text)
        shift = {"RIGHT": -line.width, "CENTER": -line.width / 2.0}.get(justification, 0.0)
        for rings in line.letters:
            letters.append([(ring + np.array([shift, -number * spacing])) * size for ring in rings])
    return letters


@lru_cache(maxsize=1)
def _font() -> Any:
    """Return the font."""
    from PIL import ImageFont

    return ImageFont.load_default(PIXELS)


@lru_cache(maxsize=1024)
def trace(sign: str) -> Letter:
    """Return the outline of one letter."""
    from PIL import Image, ImageDraw

    font = _font()
    if not sign.isprintable():
        sign = " "
    advance = float(font.getlength(sign)) / PIXELS
    left, top, right, bottom = font.getbbox(sign, anchor="ls")
    width, height = int(right - left) + 4, int(bottom - top) + 4
    if right <= left or bottom <= top:
        return Letter((), advance)
    picture = Image.new("L", (width, height))
    ImageDraw.Draw(picture).text((2 - left, 2 - top), sign, font=font, anchor="ls", fill=255)
    rings = [simplify(ring)[::-1] for ring in contours(np.asarray(picture, dtype=np.float64))]
    corner = np.array([2.0 - left, 2.0 - top])
    return Letter(tuple((ring - corner) * (1.0, -1.0) / PIXELS for ring in rings if len(ring) >= 3), advance)


def contours(values: FloatArray) -> list[FloatArray]:
    """Return the rings where values pass LEVEL, (n, 2) with x right and y down, at pixel centres; the border must be below."""
    inside = values > LEVEL
    after: dict[tuple[int, int, int], tuple[int, int, int]] = {}
    cells = inside[:-1, :-1] + 2 * inside[:-1, 1:] + 4 * inside[1:, 1:] + 8 * inside[1:, :-1]
    for row, column in zip(*(axis.tolist() for axis in np.nonzero((cells > 0) & (cells < 15)))):
        # Go round the cell: leave through each side where the inside ends, and come back where it begins.
        corners = [int(cells[row, column]) >> k & 1 for k in range(4)]
        sides = ((0, row, column), (1, row, column + 1), (0, row + 1, column), (1, row, column))
        exits = [sides[k] for k in range(4) if corners[k] and not corners[(k + 1) % 4]]
        entries = [sides[k] for k in range(4) if not corners[k] and corners[(k + 1) % 4]]
        if len(exits) == 2 and corners[0]:
            entries.reverse()
        for start, end in zip(exits, entries):
            after[start] = end
    rings = []
    while after:
        side = next(iter(after))
        ring = []
        while side in after:
            ring.append(_crossing(values, side))
            side = after.pop(side)
        rings.append(np.array(ring))
    return rings


def _crossing(values: FloatArray, side: tuple[int, int, int]) -> tuple[float, float]:
    """Return where the values pass LEVEL between two neighbours."""
    is_down, row, column = side
    first = values[row, column]
    share = (LEVEL - first) / (values[row + is_down, column + 1 - is_down] - first)
    return (column + 0.5, row + 0.5 + share) if is_down else (column + 0.5 + share, row + 0.5)


def simplify(ring: FloatArray) -> FloatArray:
    """Return a ring without the points that lie within TOLERANCE of the line between others."""
    far = int(np.argmax(((ring - ring[0]) ** 2).sum(axis=1)))
    keep = np.zeros(len(ring) + 1, dtype=bool)
    keep[[0, far]] = True
    closed = np.append(ring, ring[:1], axis=0)
    waiting = [(0, far), (far, len(ring))]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        direction = closed[last] - closed[first]
        offset = closed[first + 1 : last] - closed[first]
        length = float(np.sqrt((direction * direction).sum())) or 1.0
        distance = np.abs(offset[:, 0] * direction[1] - offset[:, 1] * direction[0]) / length
        middle = first + 1 + int(np.argmax(distance))
        if distance[middle - first - 1] > TOLERANCE:
            keep[middle] = True
            waiting += [(first, middle), (middle, last)]
    return np.asarray(ring[keep[:-1]])
