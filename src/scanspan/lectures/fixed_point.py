"""Triangles by edge equations in fixed point, as S4 has them in Java: 12 fractional bits in 32-bit integers.

Java's arithmetic is kept to the bit: a number that is made an int is cut off towards zero and held at the ends of the range; a
sum or a product of ints wraps around; coordinates are 32-bit floats, and so are their sums and differences. Nothing warns.

Known faults, each with numbers in `fixed_point_faults`:

- C is x0 y1 - x1 y0 times 4096: it is held at 2^31 - 1 as soon as that product reaches 524,288. A raster of 1024 x 768 loses
  218,964 pixels of one triangle. The sum of three C wraps earlier, beyond +-362.
- A, B and C are cut off one by one, so a line misses its own vertices: 700 pixels from the origin by up to 0.25 px where the
  edge is one pixel long.
- Their sums are then not those of a triangle: small ones are turned inside out or lost, thin ones end in an index of 6, and a
  channel that is the same at all corners is not the same inside.
- A sample on an edge is drawn by both neighbours, as in floating point.
- The slide spells the same field `argb` and `Argb`, and closes a brace too many, so it does not compile; here it does.

Source: S4, lines 191 and 272-682.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from scanspan.lectures.edge_equations import average_channel, look_up
from scanspan.lectures.raster import Raster, Vertex, inside_columns, pack_argb, unpack_argb
from scanspan.records import Int64Array, UInt8Array

FRAC_BITS = 12  # S4, line 277
ONE = 1 << FRAC_BITS
INT_LOW, INT_HIGH = -(1 << 31), (1 << 31) - 1


def java_int(value: float) -> int:
    """Return `(int)` of a double in Java: cut off towards zero, held within 32 bits, and 0 for what is not a number.

    >>> java_int(-1.9), java_int(1e12), java_int(float("nan"))
    (-1, 2147483647, 0)
    """
    if value != value:
        return 0
    return int(min(max(value, float(INT_LOW)), float(INT_HIGH)))


def wrap(value: int) -> int:
    """Return a whole number as 32 bits with a sign, as Java's sums and products of ints are.

    >>> wrap(2**31), wrap(-4096 * 524289)
    (-2147483648, 2147479552)
    """
    return ((value - INT_LOW) & 0xFFFFFFFF) + INT_LOW


def steps(start: int, step: int, count: int) -> Int64Array:
    """Return start, start + step, ..., each wrapped around."""
    exact = start + step * np.arange(count, dtype=np.int64)
    wrapped: Int64Array = exact.astype(np.int32).astype(np.int64)
    return wrapped


def as_float(value: float) -> np.float32:
    """Return a coordinate as Java's float; one that is too large becomes infinite."""
    with np.errstate(over="ignore"):
        return np.float32(value)


class FixedEdgeEqn:
    """The line A x + B y + C = 0 in units of 1/4096; S4, lines 276-302.

    Examples
    --------
    >>> edge = FixedEdgeEqn(Vertex(0, 0), Vertex(1.5, 0))
    >>> edge.A, edge.B, edge.C, edge.flag
    (0, 6144, 0, 9)
    """

    def __init__(self, v0: Vertex, v1: Vertex) -> None:
        # L282-284: in float, then in double.
        x0, y0, x1, y1 = (as_float(value) for value in (v0.x, v0.y, v1.x, v1.y))
        with np.errstate(over="ignore", invalid="ignore"):
            a, b = float(y0 - y1), float(x1 - x0)
            c = -0.5 * (a * float(x0 + x1) + b * float(y0 + y1))

        # L285-287: each is cut off by itself.
        self.A, self.B, self.C = java_int(a * ONE), java_int(b * ONE), java_int(c * ONE)

        # L288-290: remember the signs, those of the numbers that were cut off.
        self.flag = 0
        if self.A >= 0:
            self.flag += 8
        if self.B >= 0:
            self.flag += 1

    def flip(self) -> None:
        """Turn the positive side to the other side; S4, lines 293-297."""
        self.A, self.B, self.C = wrap(-self.A), wrap(-self.B), wrap(-self.C)

    def evaluate(self, x: int, y: int) -> int:
        """Return A x + B y + C; S4, lines 299-301."""
        return wrap(self.A * x + self.B * y + self.C)


class FixedFlatTriangle:
    """A triangle in one colour: FlatTri of S4, lines 311-451.

    Parameters
    ----------
    v0, v1, v2 : the corners, in any order. Its colour is the average of theirs, alpha included.
    early_out : whether a row is left behind the first run of samples inside: the second of the two speed hacks.

    Examples
    --------
    >>> raster = Raster(4, 3)
    >>> FixedFlatTriangle(Vertex(0, 0), Vertex(3, 0), Vertex(0, 2)).draw(raster)
    >>> raster.hits.tolist()
    [[1, 1, 1, 1], [1, 1, 0, 0], [1, 0, 0, 0]]
    """

    def __init__(self, v0: Vertex, v1: Vertex, v2: Vertex, *, early_out: bool = True) -> None:
        self.v = [v0, v1, v2]
        self.early_out = early_out

        # L329-339: unpack, average, pack.
        channels = [average_channel(v0.color[k], v1.color[k], v2.color[k]) for k in range(4)]
        self.color = pack_argb((channels[0], channels[1], channels[2], channels[3]))

    def triangle_setup(self, raster: Raster) -> bool:
        """Orient the edges and find the box; False for an area of 0. S4, lines 415-451."""
        # L418-420: the three edge equations.
        v = self.v
        self.edge = [FixedEdgeEqn(v[0], v[1]), FixedEdgeEqn(v[1], v[2]), FixedEdgeEqn(v[2], v[0])]

        # L424-433: make the area positive, and with it the inside.
        self.area = wrap(self.edge[0].C + self.edge[1].C + self.edge[2].C)
        if self.area == 0:
            return False
        if self.area < 0:
            for edge in self.edge:
                edge.flip()
            self.area = wrap(-self.area)

        # L436-449: look up the extreme corners, and clamp the box to the raster.
        x_row, y_row = look_up(self.edge[0].flag + 2 * self.edge[1].flag + 4 * self.edge[2].flag)
        one = np.float32(1)
        self.x_min = max(java_int(float(as_float(v[x_row[0]].x))), 0)
        self.x_max = min(java_int(float(as_float(v[x_row[1]].x) + one)), raster.width - 1)
        self.y_min = max(java_int(float(as_float(v[y_row[1]].y))), 0)
        self.y_max = min(java_int(float(as_float(v[y_row[0]].y) + one)), raster.height - 1)
        return True

    def rows(self, raster: Raster) -> Iterator[tuple[int, Int64Array]]:
        """Give each row of the box and the columns of it that are inside; the loops of S4, lines 355-384.

        Raises
        ------
        IndexError : where yMax times the width wraps around, for coordinates beyond 2^31 / width, and a row lies outside of
            the raster. Java notices only when it writes there.
        """
        # L359-364: the values at the corner of the box. The bounds of y become indices, in place.
        t = [edge.evaluate(self.x_min, self.y_min) for edge in self.edge]
        count = self.x_max - self.x_min + 1
        self.y_min, self.y_max = wrap(self.y_min * raster.width), wrap(self.y_max * raster.width)

        # L367-384: the sign bit of e0 | e1 | e2 is set where one of them is negative, so one test does for three.
        for y in range(self.y_min, self.y_max + 1, raster.width):
            if not 0 <= y < raster.width * raster.height:
                raise IndexError(f"pixel[{y}]: the raster has {raster.width * raster.height}")
            if count > 0:
                e0, e1, e2 = (steps(start, edge.A, count) for start, edge in zip(t, self.edge, strict=True))
                columns, tested = inside_columns((e0 | e1 | e2) >= 0, self.early_out)
                raster.tested += tested
                yield y // raster.width, columns + self.x_min
            t = [wrap(value + edge.B) for value, edge in zip(t, self.edge, strict=True)]

    def draw(self, raster: Raster) -> None:
        """Draw the triangle in its colour; S4, lines 349-385."""
        if not self.triangle_setup(raster):
            return
        for y, columns in self.rows(raster):
            raster.write_row(y, columns, unpack_argb(self.color))


class FixedPlane(NamedTuple):
    """A parameter over the raster, in 1/4096: its slopes, and its value at the corner of the box with one half added."""

    step_x: int
    step_y: int
    start: int


def clamp_channel(value: Int64Array) -> UInt8Array:
    """Return values in 1/4096 as bytes, 0 or 255 where they do not fit; S4, lines 663-670.

    >>> clamp_channel(np.array([-1, 4095, 4096, 255 * 4096 + 4095, 256 * 4096])).tolist()
    [0, 0, 1, 255, 255]
    """
    pixel = value >> FRAC_BITS
    held = np.where((pixel & ~255) == 0, pixel, np.where(value < 0, 0, 255))
    return held.astype(np.uint8)


class FixedSmoothTriangle(FixedFlatTriangle):
    """A triangle with a colour at each corner: SmoothTri of S4, lines 537-680.

    Parameters
    ----------
    v0, v1, v2 : the corners, in any order.
    early_out : as for FixedFlatTriangle.

    Examples
    --------
    >>> red, blue = (255, 0, 0, 255), (0, 0, 255, 255)
    >>> raster = Raster(5, 1)
    >>> FixedSmoothTriangle(Vertex(0, 0, red), Vertex(4, 0, blue), Vertex(0, 4, red)).draw(raster)
    >>> raster.rgba[0, :, 0].tolist()
    [255, 191, 128, 64, 0]
    """

    def __init__(self, v0: Vertex, v1: Vertex, v2: Vertex, *, early_out: bool = True) -> None:
        self.v = [v0, v1, v2]
        self.early_out = early_out

        # L550-562: one colour, or one to be found at each sample. The comment there says zero, the code says -1.
        self.is_flat = v0.color == v1.color and v0.color == v2.color
        self.color = pack_argb(v0.color) if self.is_flat else 0
        self.scale = -1.0

    def plane_eqn(self, p0: int, p1: int, p2: int) -> FixedPlane:
        """Return a parameter's plane; S4, lines 574-588. The three coefficients are cut off one by one, as those of edges."""
        # L576-581: one division a triangle.
        if self.scale <= 0:
            self.scale = ONE / float(self.area)
        sp0, sp1, sp2 = self.scale * p0, self.scale * p1, self.scale * p2

        # L582-587: corner 0 goes with the edge that it does not touch, which is edge 1, and so on around.
        e0, e1, e2 = self.edge
        Ap = java_int(e0.A * sp2 + e1.A * sp0 + e2.A * sp1)
        Bp = java_int(e0.B * sp2 + e1.B * sp0 + e2.B * sp1)
        Cp = java_int(e0.C * sp2 + e1.C * sp0 + e2.C * sp1)
        return FixedPlane(Ap, Bp, wrap(Ap * self.x_min + Bp * self.y_min + Cp + (1 << (FRAC_BITS - 1))))

    def draw(self, raster: Raster) -> None:
        """Draw the triangle; S4, lines 596-680."""
        # L597-604: one colour is the flat method's.
        if self.is_flat:
            super().draw(raster)
            return
        if not self.triangle_setup(raster):
            return

        # L611-620: a plane for each channel.
        corners = [vertex.color for vertex in self.v]
        planes = [self.plane_eqn(corners[0][k], corners[1][k], corners[2][k]) for k in range(4)]

        # L639-645 and L658-679: four more accumulators, stepped as the edges are.
        x_min, count = self.x_min, self.x_max - self.x_min + 1
        starts, row = [plane.start for plane in planes], None
        for y, columns in self.rows(raster):
            passed = 0 if row is None else y - row
            starts, row = [wrap(start + plane.step_y * passed) for start, plane in zip(starts, planes, strict=True)], y
            channels = [steps(start, plane.step_x, count)[columns - x_min] for start, plane in zip(starts, planes, strict=True)]
            raster.write_row(y, columns, clamp_channel(np.stack(channels, axis=1)))
