"""The edges of exact areas: where they cross rows and columns, stepped exactly, and what they cover of a pixel.

Lengths are whole numbers of 2^-44 pixel, divided out exactly from the snapped corners however far away they are, and rounded
down. A division in 82 bits takes as long as drawing ten pixels, so it is made once for an edge; from row to row and from column
to column a DDA of quotient and remainder then steps the crossing, with the bits that a new division would give. Where an edge
is so far away that a step might not fit, it is divided anew each time.

What an edge leaves depends on that edge, the row and the pixel alone, and is rounded once, to 2^-52 of a pixel.

Source: the accumulation buffer of font-rs and stb_truetype, here in integers; Hecker 1995 for the DDA.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.geometry.fixed_point import HALF_BITS, product_halves
from scanspan.jit import bare_helper, bare_kernel, inline_kernel
from scanspan.records import Int32Array, Int64Array, Integer

AREA_BITS = np.int64(16)  # sub-pixel bits of corners
LENGTH_BITS = np.int64(44)
SHIFT = np.int64(28)  # bits that lengths have more than corners
DIGIT_BITS = np.int64(14)  # half of them
ONE = np.int64(1 << 44)
UNIT = 2.0**52  # areas in a pixel
WHOLE = np.int64(1 << 52)
FARTHEST = np.int64(1 << 62)  # 2^18 px
NEAR = np.int64(1 << 33)  # 2^17 px, in corners' units: steps from a crossing that is nearer fit
PIXEL = np.int64(1 << 16)

# Columns of an edge: it goes down from X0, Y0, and DOWN is 1 where its ring does, else -1. The rest is kept up by a sweep:
# where it is at the upper border of the row, and the next border of a column that it crosses, with the height at which it does.
X0, Y0, X1, Y1, DOWN, X, X_REST, X_STEP, X_STEP_REST, BORDER, Y, Y_REST, Y_STEP, Y_STEP_REST = range(14)
EDGE_COLUMNS = 16  # 128 bytes, two lines of the cache
CORNER_COLUMNS = 5
NONE = np.int64(-1)
NO_BORDER = np.int64(-(1 << 40))
BLOCK_BITS = np.int64(5)  # columns are marked in blocks of 32
BLOCK_MASK = np.int64(31)


@bare_kernel
def list_edges_of(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, height: int, edges: Int64Array, starts: Int64Array
) -> None:
    """List the edges of polygons that go up or down within some rows, each from its upper end, in the order of the rings.

    Shapes  edges: (V, 5), written as far as there are such; starts: (P + 1,), written.
    """
    count, below = np.int64(0), np.int64(height) << AREA_BITS
    for n in range(polygon_rings.shape[0] - 1):
        starts[n] = count
        for r in range(polygon_rings[n], polygon_rings[n + 1]):
            first, last = np.int64(ring_starts[r]), np.int64(ring_starts[r + 1])
            for k in range(first, last):
                after = k + 1 if k + 1 < last else first
                down = np.int64(1) if xy[after, 1] > xy[k, 1] else np.int64(-1)
                upper, lower = (k, after) if down > 0 else (after, k)
                if xy[upper, 1] < xy[lower, 1] and xy[lower, 1] > 0 and xy[upper, 1] < below:
                    edges[count, X0], edges[count, Y0] = xy[upper, 0], xy[upper, 1]
                    edges[count, X1], edges[count, Y1] = xy[lower, 0], xy[lower, 1]
                    edges[count, DOWN] = down
                    count += 1
    starts[polygon_rings.shape[0] - 1] = count


def gather_areas(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, height: int, windings: Int64Array
) -> tuple[Int64Array, Int64Array]:
    """Return the edges of polygons that go up or down within some rows, and where those of each polygon start, (P + 1,).

    Each comes from its upper end, (N, 5), those of a polygon ordered by it, unless it is convex.

    Parameters
    ----------
    xy : (V, 2) corners in sub-pixels of AREA_BITS bits.
    ring_starts : (R + 1,) rows of xy.
    polygon_rings : (P + 1,) polygon p has the rings polygon_rings[p] to polygon_rings[p + 1].
    height : how many rows there are.
    windings : (P,) those within convex polygons, 0 for others.
    """
    edges, starts = np.empty((len(xy), CORNER_COLUMNS), np.int64), np.empty(len(polygon_rings), np.int64)
    list_edges_of(xy, ring_starts, polygon_rings, height, edges, starts)
    edges, counts = edges[: starts[-1]], np.diff(starts)
    swept = np.flatnonzero(np.repeat(windings == 0, counts))
    owner = np.repeat(np.flatnonzero(windings == 0), counts[windings == 0])
    order = np.lexsort((edges[swept, Y0], owner)) if len(windings) > 1 else np.argsort(edges[swept, Y0], kind="stable")
    edges[swept] = edges[swept[order]]
    return edges, starts


@bare_helper
def divide_length(high: Integer, low: Integer, divisor: Integer) -> tuple[Integer, Integer]:
    """Return a product in halves, divided, as a length, and the remainder; it is held at 2^18 px on either side.

    Needs   0 < divisor < 2^42; the product is in squares of corners' units.
    """
    upper = high // divisor
    if upper >= (np.int64(1) << 14) or upper < -(np.int64(1) << 14):
        return (FARTHEST if upper > 0 else -FARTHEST), np.int64(0)
    lower = ((high - upper * divisor) << HALF_BITS) + low
    part = lower // divisor
    rest, length = lower - part * divisor, (upper << HALF_BITS) + part
    for _ in range(2):
        rest = rest << DIGIT_BITS
        digit = rest // divisor
        rest, length = rest - digit * divisor, (length << DIGIT_BITS) + digit
    return length, rest


@bare_helper
def divide_near(product: Integer, divisor: Integer) -> tuple[Integer, Integer]:
    """Return a product divided as a length, and the remainder, as divide_length does.

    Needs   0 < divisor < 2^34; the quotient is below 2^18 px.
    """
    whole = product // divisor
    rest = (product - whole * divisor) << SHIFT
    part = rest // divisor
    return (whole << SHIFT) + part, rest - part * divisor


@bare_helper
def corner_length(x: Integer) -> Integer:
    """Return a corner's coordinate as a length."""
    limit = FARTHEST >> SHIFT
    return min(max(x, -limit), limit) << SHIFT


@bare_helper
def x_at(edges: Int64Array, e: Integer, y: Integer) -> tuple[Integer, Integer]:
    """Return where an edge crosses a height, as a length, and the remainder; y as corners are."""
    across, down = edges[e, X1] - edges[e, X0], edges[e, Y1] - edges[e, Y0]
    high, low = product_halves(edges[e, X0], across, down, y - edges[e, Y0])
    return divide_length(high, low, down)


@bare_helper
def start_edge(edges: Int64Array, e: Integer, upper: Integer) -> None:
    """Put an edge at the upper border of a row, or where it starts in it.

    Units   upper: as corners are.
    """
    edges[e, X_STEP_REST], edges[e, BORDER], edges[e, Y_STEP_REST] = NONE, NO_BORDER, NONE
    edges[e, X] = corner_length(edges[e, X0]) if edges[e, Y0] >= upper else x_at(edges, e, upper)[0]


@bare_kernel
def divide_to(edges: Int64Array, e: Integer, lower: Integer) -> None:
    """Put an edge at the lower border of the row, or at its end, by a division, and find its step if another border follows."""
    if edges[e, Y1] <= lower:
        edges[e, X] = corner_length(edges[e, X1])
        return
    edges[e, X], edges[e, X_REST] = x_at(edges, e, lower)
    if edges[e, Y1] > lower + PIXEL and max(abs(edges[e, X0]), abs(edges[e, X1])) <= NEAR:
        high, low = product_halves(edges[e, X1] - edges[e, X0], np.int64(0), PIXEL, np.int64(0))
        edges[e, X_STEP], edges[e, X_STEP_REST] = divide_length(high, low, edges[e, Y1] - edges[e, Y0])


@bare_helper
def step_to(edges: Int64Array, e: Integer, lower: Integer) -> np.int64:
    """Step an edge to the lower border of the row, or to its end, and return where it is there, as a length.

    Units   lower: as corners are.
    """
    if edges[e, X_STEP_REST] < 0 or edges[e, Y1] <= lower:
        divide_to(edges, e, lower)
        return np.int64(edges[e, X])
    down = edges[e, Y1] - edges[e, Y0]
    rest = edges[e, X_REST] + edges[e, X_STEP_REST]
    carries = rest >= down
    edges[e, X_REST] = rest - (down if carries else np.int64(0))
    edges[e, X] += edges[e, X_STEP] + np.int64(carries)
    return np.int64(edges[e, X])


@bare_kernel
def y_at(edges: Int64Array, e: Integer, border: Integer) -> np.int64:
    """Return how far below the image's upper border an edge crosses the left border of a column, as a length.

    It is ready for the next border of a column on the edge's way down, if that is asked for next.
    """
    if edges[e, BORDER] != border:
        across, down = edges[e, X1] - edges[e, X0], edges[e, Y1] - edges[e, Y0]
        sign, size = (np.int64(1), across) if across > 0 else (np.int64(-1), -across)
        high, low = product_halves(edges[e, Y0], sign * down, size, (border << AREA_BITS) - edges[e, X0])
        edges[e, Y], edges[e, Y_REST] = divide_length(high, low, size)
        edges[e, BORDER] = border
    return np.int64(edges[e, Y])


@bare_kernel
def divide_border(edges: Int64Array, e: Integer) -> None:
    """Find by how much the height steps at which an edge crosses borders, or forget it where a step might not fit."""
    size = abs(edges[e, X1] - edges[e, X0])
    if size < PIXEL or max(abs(edges[e, Y0]), abs(edges[e, Y1])) > NEAR:
        edges[e, BORDER] = NO_BORDER
        return
    high, low = product_halves(edges[e, Y1] - edges[e, Y0], np.int64(0), PIXEL, np.int64(0))
    edges[e, Y_STEP], edges[e, Y_STEP_REST] = divide_length(high, low, size)


@bare_helper
def step_border(edges: Int64Array, e: Integer) -> None:
    """Step the height at which an edge crosses a border to that of the next border, or forget it where a step might not fit."""
    if edges[e, Y_STEP_REST] < 0:
        divide_border(edges, e)
    if edges[e, Y_STEP_REST] >= 0:
        across = edges[e, X1] - edges[e, X0]
        size = abs(across)
        rest = edges[e, Y_REST] + edges[e, Y_STEP_REST]
        carries = rest >= size
        edges[e, Y_REST] = rest - (size if carries else np.int64(0))
        edges[e, Y] += edges[e, Y_STEP] + np.int64(carries)
        edges[e, BORDER] += np.int64(1) if across > 0 else np.int64(-1)


@bare_helper
def leave_trapezoid(sums: Int64Array, place: Integer, height: Integer, inset: Integer, sign: Integer) -> None:
    """Add what a piece covers of one pixel, and of all further right, to the row's sums.

    Shapes  sums: areas; their running sum along a row is the coverage.
    Units   height: a length; inset: how far right of the pixel's left border it is at its upper and its lower end, together.
    """
    offset = np.float64(inset) * (0.5 / np.float64(ONE))
    left_out = sign * np.int64(np.rint(np.float64(height) * offset * (UNIT / np.float64(ONE))))
    sums[place] += sign * (height << 8) - left_out
    sums[place + 1] += left_out


@bare_kernel
def leave_moments(
    moments: Int64Array, column: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer, sign: Integer
) -> None:
    """Add the moments of what a piece covers of one column, and of all further right, to those of the row.

    Shapes  moments: (3, W + 2), running sums of the integrals of v, u and u v over what is covered of a pixel.
    Units   u and v go from 0 at the pixel's left and upper border to 1; integrals in areas.
    Rule    those of v are rounded at the ends of the piece, so that pieces that follow each other add up exactly.
    """
    v0, v1 = np.float64(top) / np.float64(ONE), np.float64(bottom) / np.float64(ONE)
    left = column << LENGTH_BITS
    u0, u1 = np.float64(x_top - left) / np.float64(ONE), np.float64(x_bottom - left) / np.float64(ONE)
    height = v1 - v0
    half = np.int64(np.rint(v1 * v1 * (UNIT / 4.0))) - np.int64(np.rint(v0 * v0 * (UNIT / 4.0)))
    first = np.int64(np.rint(height * (u0 * (2.0 * v0 + v1) + u1 * (v0 + 2.0 * v1)) * (UNIT / 6.0)))
    second = np.int64(np.rint(height * (u0 * u0 + u0 * u1 + u1 * u1) * (UNIT / 6.0)))
    u01 = 2.0 * u0 * u1
    mixed = height * (v0 * (3.0 * u0 * u0 + u01 + u1 * u1) + v1 * (u0 * u0 + u01 + 3.0 * u1 * u1))
    third = np.int64(np.rint(mixed * (UNIT / 24.0)))
    moments[0, column] += sign * (2 * half - first)
    moments[0, column + 1] += sign * first
    moments[1, column] += sign * (((bottom - top) << 7) - second)
    moments[1, column + 1] += sign * second
    moments[2, column] += sign * (half - third)
    moments[2, column + 1] += sign * third


@inline_kernel
def leave_columns(
    leave_cell: Callable[..., None], sums: Int64Array, moments: Int64Array, blocks: Int64Array, edges: Int64Array, e: Integer,
    row: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer, sign: Integer,
) -> None:  # fmt: skip
    """Go along a piece of an edge from column to column and leave in each what it covers.

    Shapes  sums: (W + 2,); moments: (3, W + 2) or (3, 0); blocks: (B,), marked where sums are changed. What lies right of the
            image leaves nothing.
    """
    first, last = x_top >> LENGTH_BITS, x_bottom >> LENGTH_BITS
    low, high = min(first, last), max(first, last)
    if low >= sums.shape[0] - 2:
        return
    for b in range(low >> BLOCK_BITS, ((high + 1) >> BLOCK_BITS) + 1):
        blocks[b] = 1
    ahead = np.int64(last > first)
    column, step, y, x, upper = first, 2 * ahead - 1, top, x_top, row << LENGTH_BITS
    while column != last:
        border = column + ahead
        if edges[e, BORDER] != border:
            y_at(edges, e, border)
        next_y, next_x = min(max(edges[e, Y] - upper, y), bottom), border << LENGTH_BITS
        step_border(edges, e)
        leave_cell(sums, moments, column, y, next_y, x, next_x, sign)
        column, y, x = column + step, next_y, next_x
    leave_cell(sums, moments, last, y, bottom, x, x_bottom, sign)


@bare_helper
def leave_area(
    sums: Int64Array, moments: Int64Array, column: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer,
    sign: Integer,
) -> None:  # fmt: skip
    """Leave what a piece covers of one column."""
    leave_trapezoid(sums, column, bottom - top, x_top + x_bottom - 2 * (column << LENGTH_BITS), sign)


@bare_helper
def leave_area_and_moments(
    sums: Int64Array, moments: Int64Array, column: Integer, top: Integer, bottom: Integer, x_top: Integer, x_bottom: Integer,
    sign: Integer,
) -> None:  # fmt: skip
    """Leave what a piece covers of one column, and its moments."""
    leave_trapezoid(sums, column, bottom - top, x_top + x_bottom - 2 * (column << LENGTH_BITS), sign)
    leave_moments(moments, column, top, bottom, x_top, x_bottom, sign)


@bare_kernel
def leave_piece(
    sums: Int64Array, moments: Int64Array, blocks: Int64Array, edges: Int64Array, e: Integer, row: Integer, top: Integer,
    bottom: Integer, x_top: Integer, x_bottom: Integer, sign: Integer,
) -> None:  # fmt: skip
    """Leave what a piece of an edge covers, and its moments where they are kept."""
    if moments.shape[1] > 0:
        leave_columns(leave_area_and_moments, sums, moments, blocks, edges, e, row, top, bottom, x_top, x_bottom, sign)
    else:
        leave_columns(leave_area, sums, moments, blocks, edges, e, row, top, bottom, x_top, x_bottom, sign)
