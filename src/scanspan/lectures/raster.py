"""The raster that the lectures' triangles are drawn on, and their vertices: what S0 and S4 take for granted.

S0 keeps four bytes a pixel, red first; S4 one 32-bit number, alpha in its upper byte. Here the bytes are kept and the numbers
made from them. Beside the pixels stand two things that no slide has and every demonstration needs: how often each pixel was
written, and how many samples were tested.

Row 0 is at the bottom in S0, which hands the rows to glDrawPixels, and at the top in S4; no program here knows.

Both lectures sample at whole coordinates: pixel (i, j) stands for the point (i, j), where the rest of this library takes
(i + 1/2, j + 1/2). `at_centres` moves a shape from the one to the other.

Source: S0, lines 119-149 and 365-394; S4, lines 161-189.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.errors import InputError, LimitError
from scanspan.records import BoolArray, Float64Array, Int32Array, Int64Array, UInt8Array

Color = tuple[int, int, int, int]  # red, green, blue, alpha, 0 to 255
UNSET: Color = (0, 0, 0, 0)
MAX_PIXELS = 1 << 24  # the programs are for study, and slow


class Vertex(NamedTuple):
    """A corner of a triangle on the raster; S0, lines 130-149, and S4, lines 166-178."""

    x: float
    y: float
    color: Color = (255, 255, 255, 255)

    def draw(self, raster: Raster) -> None:
        """Draw the vertex as a point, as S0 does in its line 143.

        Known fault: the rounding is half to even, so points at 0.5, 1.5 and 2.5 land on 0, 2 and 2: they jump unevenly.
        """
        raster.set_pixel(round(self.x), round(self.y), self.color)


class Raster:
    """Pixels that the lectures draw on.

    Parameters
    ----------
    width, height : pixels.

    Attributes
    ----------
    rgba : (height, width, 4) uint8, all 0 at first.
    hits : (height, width) int32, how often each pixel was written.
    tested : how many samples were tested against edges.

    Raises
    ------
    InputError : for a size below one pixel, or of more than 2^24 pixels.

    Examples
    --------
    >>> raster = Raster(2, 1)
    >>> raster.set_pixel(1, 0, (255, 128, 0, 255))
    >>> hex(int(raster.argb[0, 1]) & 0xFFFFFFFF)
    '0xffff8000'
    """

    def __init__(self, width: int, height: int) -> None:
        if width < 1 or height < 1:
            raise InputError(f"a raster of {width} x {height}: expected at least one pixel each way")
        if width * height > MAX_PIXELS:
            raise LimitError(f"a raster of {width} x {height}: the limit is {MAX_PIXELS} pixels in all")
        self.width, self.height = width, height
        self.rgba: UInt8Array = np.zeros((height, width, 4), np.uint8)
        self.hits: Int32Array = np.zeros((height, width), np.int32)
        self.tested = 0

    @property
    def covered(self) -> BoolArray:
        """(height, width), which pixels were written."""
        return self.hits > 0

    @property
    def argb(self) -> Int32Array:
        """(height, width) int32, the packed colours of S4."""
        wide = self.rgba.astype(np.int64)
        packed = (wide[..., 3] << 24) | (wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2]
        return packed.astype(np.int32)

    def set_pixel(self, x: int, y: int, color: Color) -> None:
        """Write one pixel; what lies outside is left alone, of which the slides say nothing."""
        if 0 <= x < self.width and 0 <= y < self.height:
            self.rgba[y, x] = color
            self.hits[y, x] += 1

    def write_row(self, y: int, columns: Int64Array, colors: Any) -> None:
        """Write some pixels of row y, in one colour or one for each."""
        self.rgba[y, columns] = colors
        self.hits[y, columns] += 1


def pack_argb(color: Color) -> int:
    """Return a colour as the 32-bit number of S4, with its sign.

    >>> pack_argb((255, 255, 255, 255)), pack_argb((1, 2, 3, 0))
    (-1, 66051)
    """
    red, green, blue, alpha = color
    packed = alpha << 24 | red << 16 | green << 8 | blue
    return packed - (1 << 32) if packed >= 1 << 31 else packed


def unpack_argb(packed: int) -> Color:
    """Return the colour of a 32-bit number of S4.

    >>> unpack_argb(-1)
    (255, 255, 255, 255)
    """
    return packed >> 16 & 255, packed >> 8 & 255, packed & 255, packed >> 24 & 255


def vertices(points: ArrayLike, colors: ArrayLike | None = None) -> list[Vertex]:
    """Return points (N, 2) as vertices, white or with colours (N, 4)."""
    places = np.asarray(points, np.float64).tolist()
    if colors is None:
        return [Vertex(x, y) for x, y in places]
    return [Vertex(x, y, (r, g, b, a)) for (x, y), (r, g, b, a) in zip(places, np.asarray(colors).tolist(), strict=True)]


def at_centres(points: ArrayLike) -> Float64Array:
    """Return points moved by half a pixel, so that sampling at centres sees what the lectures see at whole coordinates."""
    moved: Float64Array = np.asarray(points, np.float64) + 0.5
    return moved


def inside_columns(inside: BoolArray, early_out: bool) -> tuple[Int64Array, int]:
    """Return which samples of a row are drawn, and how many were tested to find them.

    With the early way out of the lectures' inner loops, a row is left as soon as it was inside and then outside.

    >>> inside_columns(np.array([False, True, True, False, True]), True)
    (array([1, 2]), 4)
    """
    columns = np.flatnonzero(inside)
    if not early_out or len(columns) == 0:
        return columns, len(inside)
    start = int(columns[0])
    rest = inside[start:]
    end = len(inside) if rest.all() else start + int(rest.argmin())
    return np.arange(start, end), min(end + 1, len(inside))
