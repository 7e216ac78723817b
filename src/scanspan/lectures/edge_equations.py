"""Triangles by edge equations in floating point, as S0 has them in C#: EdgeEqn, FlatTri, SmoothTri and PlaneEqn.

The statements stand in the slides' order, with the slide's line in the comment above them. What is added are names, the
counting of `Raster`, and one thing for speed: a row is computed at once. Sums are still formed from left to right, one step a
pixel, so every bit is the loop's.

Known faults, each with numbers in `edge_faults`:

- A sample on an edge is drawn (`>= 0`), so neighbours draw it twice; the text says "positive".
- A triangle on a vertical or a horizontal line ends in an index of 6 where rounding hides that its area is 0.
- The variable `area` is twice the area.
- The sums e += A drift away from the exact edge value.
- The drawing method of the smooth triangle is a copy of the flat one's: it interpolates nothing.
- PlaneEqn does not round and does not clamp; a constant of 255 comes out as 254 here and there.
- The scale is remembered when the corners move. Alpha is dropped from the average colour.
- Colours are compared with ==, which in C# asks whether they are one object; here, whether they are equal.
- Drawing multiplies yMin and yMax in place; PlaneEqn must come before that.

Not faults, though they look it: `flip` leaves the flag alone, because it tells of the corners as they were given; and the order
of the edges in PlaneEqn, edge 1 with corner 0.

Source: S0, lines 193-519.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scanspan.lectures.raster import UNSET, Color, Raster, Vertex, inside_columns
from scanspan.records import Float64Array, Int64Array

# S4, line 317, used by S0 without being shown: for each code of the signs of three edges, the corner with the least x and
# the one with the greatest. For y the columns change places, because A counts the other way round.
SORT = ((0, 1), (1, 2), (0, 2), (2, 0), (2, 1), (1, 0))

Plane = tuple[float, float, float]


class EdgeEqn:
    """The line A x + B y + C = 0 through two vertices; S0, lines 201-223.

    Examples
    --------
    >>> edge = EdgeEqn(Vertex(0, 0), Vertex(4, 0))
    >>> edge.A, edge.B, edge.C, edge.flag
    (0, 4, -0.0, 9)
    >>> edge.evaluate_at(1, 2)
    8.0
    """

    def __init__(self, v0: Vertex, v1: Vertex) -> None:
        # L206-208: the coefficients, C as the average of what the two vertices ask for.
        self.A = v0.y - v1.y
        self.B = v1.x - v0.x
        self.C = -0.5 * (self.A * (v0.x + v1.x) + self.B * (v0.y + v1.y))

        # L209-211: remember the signs.
        self.flag = 0
        if self.A >= 0:
            self.flag += 8
        if self.B >= 0:
            self.flag += 1

    def flip(self) -> None:
        """Turn the positive side to the other side; S0, lines 214-218."""
        self.A, self.B, self.C = -self.A, -self.B, -self.C

    def evaluate_at(self, x: float, y: float) -> float:
        """Return A x + B y + C; S0, lines 220-222."""
        return self.A * x + self.B * y + self.C


def average_channel(v0: int, v1: int, v2: int) -> int:
    """Return (2 sum + 3) / 6 in whole numbers: the average of three, rounded; S0, line 253.

    It is right for every sum from 0 to 765: a third never ends in one half, so there are no ties.
    """
    return (2 * (v0 + v1 + v2) + 3) // 6


def to_int(value: float) -> int:
    """Return `(int)` of a number: cut off towards zero. Beyond 32 bits it is held, as in Java; C# does not say what comes."""
    if value != value:
        return 0
    return int(min(max(value, -(2.0**31)), 2.0**31 - 1))


def look_up(codes: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the rows of SORT for the x and the y of three edges' flags; S0, lines 327-329.

    Raises
    ------
    IndexError : where all three signs agree (6), or a coordinate is not a number (-1), as the slides' programs do.
    """
    y_row = (codes >> 3) - 1
    x_row = (codes & 7) - 1
    for name, row in (("x", x_row), ("y", y_row)):
        if not 0 <= row < len(SORT):
            raise IndexError(f"sort[{row}] for {name}: the table has rows 0 to {len(SORT) - 1}")
    return SORT[x_row], SORT[y_row]


class FlatTriangle:
    """A triangle in one colour: FlatTri of S0, lines 236-258.

    Parameters
    ----------
    v0, v1, v2 : the corners, in any order. Its colour is the average of theirs.
    early_out : whether a row is left behind the first run of samples inside (lines 292-309).
    inclusive : whether a sample on an edge is drawn, as the code has it; the text (line 113) says otherwise.

    Examples
    --------
    >>> raster = Raster(4, 3)
    >>> FlatTriangle(Vertex(0, 0), Vertex(3, 0), Vertex(0, 2)).draw(raster)
    >>> raster.hits.tolist()
    [[1, 1, 1, 1], [1, 1, 0, 0], [1, 0, 0, 0]]
    """

    def __init__(self, v0: Vertex, v1: Vertex, v2: Vertex, *, early_out: bool = True, inclusive: bool = True) -> None:
        self.v = [v0, v1, v2]
        self.early_out, self.inclusive = early_out, inclusive

        # L253-256: three channels are averaged; the fourth is forgotten, and a colour without alpha is opaque.
        red, green, blue = (average_channel(v0.color[k], v1.color[k], v2.color[k]) for k in range(3))
        self.color: Color = (red, green, blue, 255)

    def triangle_setup(self, raster: Raster) -> bool:
        """Orient the edges and find the box; False for a triangle without area. S0, lines 314-342.

        The slide's layout puts the last four statements behind the end of the method; here they are back inside.
        """
        # L316-318: the three edge equations.
        v = self.v
        self.edge = [EdgeEqn(v[0], v[1]), EdgeEqn(v[1], v[2]), EdgeEqn(v[2], v[0])]

        # L320-325: make the area positive, and with it the inside.
        self.area = self.edge[0].C + self.edge[1].C + self.edge[2].C
        if self.area == 0:
            return False
        if self.area < 0:
            for edge in self.edge:
                edge.flip()
            self.area = -self.area

        # L327-334 and L338-341: look up the extreme corners, and clamp the box to the raster.
        x_row, y_row = look_up(self.edge[0].flag + 2 * self.edge[1].flag + 4 * self.edge[2].flag)
        self.x_min = max(to_int(v[x_row[0]].x), 0)
        self.y_min = max(to_int(v[y_row[1]].y), 0)
        self.x_max = min(to_int(v[x_row[1]].x + 1), raster.width - 1)
        self.y_max = min(to_int(v[y_row[0]].y + 1), raster.height - 1)
        return True

    def rows(self, raster: Raster) -> Iterator[tuple[int, Int64Array]]:
        """Give each row of the box and the columns of it that are inside; the loops of S0, lines 267-286."""
        # L267-272: the values at the corner of the box. The bounds of y become indices, in place.
        A = [edge.A for edge in self.edge]
        t = [edge.evaluate_at(self.x_min, self.y_min) for edge in self.edge]
        count = self.x_max - self.x_min + 1
        self.y_min, self.y_max = self.y_min * raster.width, self.y_max * raster.width

        # L274-286: test every sample of a row, then step to the next.
        for y in range(self.y_min, self.y_max + 1, raster.width):
            if count > 0:
                e = [accumulate(start, step, count) for start, step in zip(t, A, strict=True)]
                inside = np.logical_and.reduce([value >= 0 if self.inclusive else value > 0 for value in e])
                columns, tested = inside_columns(inside, self.early_out)
                raster.tested += tested
                yield y // raster.width, columns + self.x_min
            t = [value + edge.B for value, edge in zip(t, self.edge, strict=True)]

    def draw(self, raster: Raster) -> None:
        """Draw the triangle; S0, lines 264-287."""
        if not self.triangle_setup(raster):
            return
        for y, columns in self.rows(raster):
            raster.write_row(y, columns, self.color)


def accumulate(start: float, step: float, count: int) -> Float64Array:
    """Return start, start + step, ... as a loop has them that adds, rounding at each step."""
    steps = np.full(count, step, np.float64)
    steps[0] = start
    with np.errstate(over="ignore", invalid="ignore"):
        return np.add.accumulate(steps)


class SmoothTriangle(FlatTriangle):
    """A triangle with a colour at each corner: SmoothTri of S0, lines 441-519.

    Parameters
    ----------
    v0, v1, v2 : the corners, in any order.
    early_out, inclusive : as for FlatTriangle.

    Examples
    --------
    >>> red, blue = (255, 0, 0, 255), (0, 0, 255, 255)
    >>> raster = Raster(5, 1)
    >>> SmoothTriangle(Vertex(0, 0, red), Vertex(4, 0, blue), Vertex(0, 4, red)).draw(raster)
    >>> raster.rgba[0, :, 0].tolist()
    [255, 191, 127, 63, 0]
    """

    def __init__(self, v0: Vertex, v1: Vertex, v2: Vertex, *, early_out: bool = True, inclusive: bool = True) -> None:
        self.v = [v0, v1, v2]
        self.early_out, self.inclusive = early_out, inclusive

        # L452-459: one colour, or one to be found at each sample. The comment there says zero, the code says -1.
        self.is_flat = v0.color == v1.color and v0.color == v2.color
        self.color = v0.color if self.is_flat else UNSET
        self.scale = -1.0

    def plane_eqn(self, p0: int, p1: int, p2: int) -> Plane:
        """Return the slopes of a parameter in x and in y, and its value at the corner of the box; S0, lines 471-487."""
        # L474-479: one division a triangle. `area` is twice the area already, which is what the formula wants.
        if self.scale <= 0:
            self.scale = 1.0 / self.area
        sp0, sp1, sp2 = self.scale * p0, self.scale * p1, self.scale * p2

        # L480-486: corner 0 goes with the edge that it does not touch, which is edge 1, and so on around.
        e0, e1, e2 = self.edge
        Ap = e0.A * sp2 + e1.A * sp0 + e2.A * sp1
        Bp = e0.B * sp2 + e1.B * sp0 + e2.B * sp1
        Cp = e0.C * sp2 + e1.C * sp0 + e2.C * sp1
        return Ap, Bp, Ap * self.x_min + Bp * self.y_min + Cp

    def draw_as_printed(self, raster: Raster) -> None:
        """Draw what S0 prints in its lines 495-518: the flat method again, in a colour that was never set."""
        if not self.triangle_setup(raster):
            return
        for y, columns in self.rows(raster):
            raster.write_row(y, columns, self.color)

    def draw(self, raster: Raster, *, rounding: float = 0.0) -> None:
        """Draw with what S0's lines 464-487 prepare, put together as S4 does; `rounding` is what S0 forgot, 0.5.

        A value becomes a byte by being cut off, and what does not fit wraps around.
        """
        if not self.triangle_setup(raster):
            return
        corners = [vertex.color for vertex in self.v]
        planes = [self.plane_eqn(corners[0][k], corners[1][k], corners[2][k]) for k in range(4)]
        x_min, count = self.x_min, self.x_max - self.x_min + 1
        starts = [plane[2] + rounding for plane in planes]
        for y, columns in self.rows(raster):
            values = np.stack([accumulate(start, plane[0], count) for start, plane in zip(starts, planes, strict=True)], axis=1)
            with np.errstate(invalid="ignore"):
                raster.write_row(y, columns, values[columns - x_min].astype(np.int64) & 255)
            starts = [start + plane[1] for start, plane in zip(starts, planes, strict=True)]
