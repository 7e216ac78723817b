"""Where edges cross, and which of them pass close by a point: both exact, both by cutting the plane into cells.

A cell with many edges is halved, across the side that parts them better, until few are left, and then all pairs are looked at.
Which edges reach a cell is decided in float64 with a margin, because it only spares work; everything else is exact. A crossing
belongs to the cell that its rounded point lies in, so each is found once.

Price: cells are found quickly where edges are short or cross often. Many long slanting edges that run side by side stay
together in every part of a cell; then it is not halved on, and they cost the square of their number.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.geometry.fixed_point import HALF, HALF_BITS, HALF_MASK, halves_float, halves_sign, product_halves
from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.records import Float64Array, Int64Array, Integer

MOST_FOUND = 1 << 24  # crossings, or edges close by a point, after which the search gives up

FEW_EDGES = 16  # a cell of so few is not halved
FEW_POINTS = 2  # nor one of so few points, where points are asked for
SMALLEST_CELL = 4  # sub-pixels
MOST_CELLS = 256  # that may wait: one for each halving
MOST_DEBT = (
    3.9  # pairs in all parts of a cell, relative to those in the first; halving that only makes more of them is given up
)

LIMBS = 5  # of 20 bits: a value of 82 bits, and its sign
LIMB_COUNT = 4

# Columns of a cell: its box, half-open; its edges and its points, as ranges of lists.
X_LOW, X_HIGH, Y_LOW, Y_HIGH, EDGE_FIRST, EDGE_LAST, POINT_FIRST, POINT_LAST = range(8)
CELL_COLUMNS = 8


@helper_kernel
def grown(rows: Int64Array, count: Integer) -> Int64Array:
    """Return rows with room for one more after `count`, as they are or copied into twice the room."""
    if count < rows.shape[0]:
        return rows
    longer = np.empty((2 * count, rows.shape[1]), np.int64)
    for k in range(count):
        for i in range(rows.shape[1]):
            longer[k, i] = rows[k, i]
    return longer


@helper_kernel
def spread_limbs(limbs: Int64Array, row: int, high: Integer, low: Integer) -> None:
    """Write the magnitude of a value in two halves as limbs of 20 bits, lowest first."""
    if high < 0:
        high, low = -high, -low
        if low < 0:
            high, low = high - 1, low + HALF
    limbs[row, 0] = low
    for i in range(1, LIMBS):
        limbs[row, i] = high & HALF_MASK
        high >>= HALF_BITS


@helper_kernel
def carry_limbs(limbs: Int64Array, row: int) -> Integer:
    """Carry what is above 20 bits from limb to limb, and return the last, which carries the sign."""
    for i in range(LIMBS - 1):
        limbs[row, i + 1] += limbs[row, i] >> HALF_BITS
        limbs[row, i] &= HALF_MASK
    top: Integer = limbs[row, LIMBS - 1]
    return top


@helper_kernel
def round_share(limbs: Int64Array, length: Integer, share: float) -> Integer:
    """Return length num / den rounded to the nearest whole number, halves up, exactly.

    Shapes  limbs: (4, LIMBS); row 0 holds num, row 1 den; rows 2 and 3 are room. share is about num / den.
    Needs   length at most 2^41 in magnitude, num at most den, den at most 2^83.
    """
    # Guess, and find twice what is left over, plus den to round: it must be at least 0 and below 2 den.
    guess = np.int64(np.floor(np.float64(length) * share + 0.5))
    for i in range(LIMBS):
        limbs[2, i] = 2 * length * limbs[0, i] - 2 * guess * limbs[1, i] + limbs[1, i]
    while carry_limbs(limbs, 2) < 0:
        guess -= 1
        for i in range(LIMBS):
            limbs[2, i] += 2 * limbs[1, i]
    while True:
        for i in range(LIMBS):
            limbs[3, i] = limbs[2, i] - 2 * limbs[1, i]
        if carry_limbs(limbs, 3) < 0:
            return guess
        guess += 1
        for i in range(LIMBS):
            limbs[2, i] = limbs[3, i]


@helper_kernel
def edge_side(ends: Int64Array, e: Integer, x: Integer, y: Integer) -> tuple[np.int64, np.int64]:
    """Return on which side of an edge's line a point lies, as a value in two halves, above 0 on the right."""
    return product_halves(ends[e, 3] - ends[e, 1], ends[e, 0] - ends[e, 2], x - ends[e, 0], y - ends[e, 1])


@helper_kernel
def cross_at(ends: Int64Array, e: Integer, f: Integer, limbs: Int64Array) -> tuple[bool, Integer, Integer]:
    """Say whether two edges cross, inside both of them, and return the point nearest to that on the grid."""
    nothing = np.int64(0)
    if max(ends[e, 1], ends[f, 1]) > min(ends[e, 3], ends[f, 3]) or max(
        min(ends[e, 0], ends[e, 2]), min(ends[f, 0], ends[f, 2])
    ) > min(max(ends[e, 0], ends[e, 2]), max(ends[f, 0], ends[f, 2])):
        return False, nothing, nothing
    high, low = edge_side(ends, f, ends[e, 0], ends[e, 1])
    end_high, end_low = edge_side(ends, f, ends[e, 2], ends[e, 3])
    if halves_sign(high, low) * halves_sign(end_high, end_low) >= 0:
        return False, nothing, nothing
    other, other_low = edge_side(ends, e, ends[f, 0], ends[f, 1])
    other_end, other_end_low = edge_side(ends, e, ends[f, 2], ends[f, 3])
    if halves_sign(other, other_low) * halves_sign(other_end, other_end_low) >= 0:
        return False, nothing, nothing

    # It lies at num / den of the way along the first.
    spread_limbs(limbs, 0, high, low)
    spread_limbs(limbs, 1, end_high, end_low)
    for i in range(LIMBS):
        limbs[1, i] += limbs[0, i]
    carry_limbs(limbs, 1)
    near, far = abs(halves_float(high, low)), abs(halves_float(end_high, end_low))
    share = near / (near + far)
    x = ends[e, 0] + round_share(limbs, ends[e, 2] - ends[e, 0], share)
    return True, x, ends[e, 1] + round_share(limbs, ends[e, 3] - ends[e, 1], share)


@inline_kernel
def meet_edges(
    ends: Int64Array, points: Int64Array, edge_list: Int64Array, point_list: Int64Array, cell: Int64Array, limbs: Int64Array,
    found: Int64Array, total: Integer,
) -> tuple[Int64Array, Integer]:  # fmt: skip
    """Find the pairs of a cell's edges that cross, and where."""
    for i in range(cell[EDGE_FIRST], cell[EDGE_LAST]):
        for j in range(i + 1, cell[EDGE_LAST]):
            crosses, x, y = cross_at(ends, edge_list[i, 0], edge_list[j, 0], limbs)
            if crosses and cell[X_LOW] <= x < cell[X_HIGH] and cell[Y_LOW] <= y < cell[Y_HIGH]:
                found = grown(found, total)
                e, f = edge_list[i, 0], edge_list[j, 0]
                high, low = edge_side(ends, e, x, y)
                other, other_low = edge_side(ends, f, x, y)
                found[total, 0], found[total, 1], found[total, 3], found[total, 4] = e, f, x, y
                found[total, 2] = 1 if (high | low | other | other_low) == 0 else 0
                total += 1
    return found, total


@inline_kernel
def meet_points(
    ends: Int64Array, points: Int64Array, edge_list: Int64Array, point_list: Int64Array, cell: Int64Array, limbs: Int64Array,
    found: Int64Array, total: Integer,
) -> tuple[Int64Array, Integer]:  # fmt: skip
    """Find which of a cell's edges pass through the squares of one sub-pixel round its points, and whether through the points.

    A square has its left and its upper side. An edge between points of the grid that only touches a square does so at a corner.
    """
    for i in range(cell[EDGE_FIRST], cell[EDGE_LAST]):
        e = edge_list[i, 0]
        across, down = ends[e, 2] - ends[e, 0], ends[e, 3] - ends[e, 1]
        reach = max(across, -across) + down
        x_low, x_high = min(ends[e, 0], ends[e, 2]), max(ends[e, 0], ends[e, 2])
        for j in range(cell[POINT_FIRST], cell[POINT_LAST]):
            p = point_list[j, 0]
            x, y = points[p, 0], points[p, 1]
            is_end = (x == ends[e, 0] and y == ends[e, 1]) or (x == ends[e, 2] and y == ends[e, 3])
            if is_end or x < x_low or x > x_high or y < ends[e, 1] or y > ends[e, 3]:
                continue

            # At corners of the square the value differs by up to half the reach.
            high, low = edge_side(ends, e, x, y)
            if high < -(HALF << 4) or high > HALF << 4:
                continue
            value = 2 * (high * HALF + low)
            if -reach < value < reach or value == down - across:
                found = grown(found, total)
                found[total, 0], found[total, 1], found[total, 2] = e, p, 1 if value == 0 else 0
                total += 1
    return found, total


@helper_kernel
def reaches_cell(lines: Float64Array, e: Integer, x: float, y: float, half_width: float, half_height: float) -> bool:
    """Say whether an edge may come into a box round (x, y), or within a sub-pixel of it.

    Shapes  lines: (E, 8) a, b, x, y of the upper end, and the box of the edge.
    """
    if (
        lines[e, 4] > x + half_width + 1.0
        or lines[e, 5] < x - half_width - 1.0
        or lines[e, 6] > y + half_height + 1.0
        or lines[e, 7] < y - half_height - 1.0
    ):
        return False
    right, left = lines[e, 0] * (x - lines[e, 2]), lines[e, 1] * (y - lines[e, 3])
    margin = abs(lines[e, 0]) * (half_width + 2.0) + abs(lines[e, 1]) * (half_height + 2.0)
    return bool(abs(right + left) <= margin + 1e-14 * (abs(right) + abs(left)))


@helper_kernel
def cuts_across(lines: Float64Array, edge_list: Int64Array, cell: Int64Array) -> bool:
    """Say whether an upright cut through a cell's middle parts its edges better than a level one: it should meet fewer."""
    width, height = np.float64(cell[X_HIGH] - cell[X_LOW]), np.float64(cell[Y_HIGH] - cell[Y_LOW])
    across = down = 0.0
    for i in range(cell[EDGE_FIRST], cell[EDGE_LAST]):
        e = edge_list[i, 0]
        across += min(lines[e, 5] - lines[e, 4], width)
        down += min(lines[e, 7] - lines[e, 6], height)
    is_tall = height > 64.0 * width
    is_wide = width > 64.0 * height
    return bool(is_wide or (not is_tall and across * height < down * width))


@inline_kernel
def visit_cells(
    meet: Callable[..., tuple[Int64Array, Integer]], ends: Int64Array, points: Int64Array
) -> tuple[Int64Array, Integer]:
    """Cut the plane into cells and let `meet` find what meets in each; return its rows, (N, 5), and how many.

    Shapes  ends: (E, 4) x, y of the upper and the lower end of each edge; points: (P, 2), or none if only edges are asked for.
    """
    edges, hot = ends.shape[0], points.shape[0]
    edge_list, point_list = np.empty((2 * edges + 1, 1), np.int64), np.empty((2 * hot + 1, 1), np.int64)
    lines = np.empty((edges, 8))
    found, limbs = np.empty((64, 5), np.int64), np.empty((LIMB_COUNT, LIMBS), np.int64)
    total: Integer = np.int64(0)
    cells, debts = np.empty((MOST_CELLS, CELL_COLUMNS), np.int64), np.empty(MOST_CELLS)
    if edges == 0:
        return found, total

    # The first cell holds everything.
    cells[0, X_LOW] = cells[0, X_HIGH] = ends[0, 0]
    cells[0, Y_LOW] = cells[0, Y_HIGH] = ends[0, 1]
    for e in range(edges):
        x_low, x_high = min(ends[e, 0], ends[e, 2]), max(ends[e, 0], ends[e, 2])
        cells[0, X_LOW], cells[0, X_HIGH] = min(cells[0, X_LOW], x_low), max(cells[0, X_HIGH], x_high + 1)
        cells[0, Y_LOW], cells[0, Y_HIGH] = min(cells[0, Y_LOW], ends[e, 1]), max(cells[0, Y_HIGH], ends[e, 3] + 1)
        lines[e, 0], lines[e, 1], lines[e, 2], lines[e, 3] = (
            ends[e, 3] - ends[e, 1], ends[e, 0] - ends[e, 2], ends[e, 0], ends[e, 1]
        )  # fmt: skip
        lines[e, 4], lines[e, 5], lines[e, 6], lines[e, 7] = x_low, x_high, ends[e, 1], ends[e, 3]
        edge_list[e, 0] = e
    for p in range(hot):
        point_list[p, 0] = p
    cells[0, EDGE_FIRST], cells[0, EDGE_LAST], cells[0, POINT_FIRST], cells[0, POINT_LAST] = 0, edges, 0, hot
    debts[0] = 1.0
    waiting = 1
    while waiting > 0 and total < MOST_FOUND:
        waiting -= 1
        cell = cells[waiting].copy()
        count, width, height = cell[EDGE_LAST] - cell[EDGE_FIRST], cell[X_HIGH] - cell[X_LOW], cell[Y_HIGH] - cell[Y_LOW]
        here = cell[POINT_LAST] - cell[POINT_FIRST]
        if hot > 0 and here == 0:
            continue
        is_few = count <= FEW_EDGES or max(width, height) <= SMALLEST_CELL or (hot > 0 and here <= FEW_POINTS)
        if is_few or debts[waiting] > MOST_DEBT or waiting + 2 > MOST_CELLS:
            found, total = meet(ends, points, edge_list, point_list, cell, limbs, found, total)
            continue

        # Halve it; the halves' lists lie behind its own.
        next_edge, next_point, pairs = cell[EDGE_LAST], cell[POINT_LAST], 0.0
        is_upright = cuts_across(lines, edge_list, cell)
        for k in range(2):
            half = cells[waiting + k]
            for i in range(CELL_COLUMNS):
                half[i] = cell[i]
            if is_upright:
                half[X_HIGH - k] = cell[X_LOW] + (width >> 1)
            else:
                half[Y_HIGH - k] = cell[Y_LOW] + (height >> 1)
            half[EDGE_FIRST], half[POINT_FIRST] = next_edge, next_point
            half_width, half_height = (half[X_HIGH] - half[X_LOW]) / 2.0, (half[Y_HIGH] - half[Y_LOW]) / 2.0
            x, y = half[X_LOW] + half_width, half[Y_LOW] + half_height
            for i in range(cell[EDGE_FIRST], cell[EDGE_LAST]):
                if reaches_cell(lines, edge_list[i, 0], x, y, half_width, half_height):
                    edge_list = grown(edge_list, next_edge)
                    edge_list[next_edge, 0] = edge_list[i, 0]
                    next_edge += 1
            for i in range(cell[POINT_FIRST], cell[POINT_LAST]):
                p = point_list[i, 0]
                if half[X_LOW] <= points[p, 0] < half[X_HIGH] and half[Y_LOW] <= points[p, 1] < half[Y_HIGH]:
                    point_list = grown(point_list, next_point)
                    point_list[next_point, 0] = p
                    next_point += 1
            half[EDGE_LAST], half[POINT_LAST] = next_edge, next_point
            both = half[POINT_LAST] - half[POINT_FIRST] if hot > 0 else half[EDGE_LAST] - half[EDGE_FIRST]
            pairs += np.float64(half[EDGE_LAST] - half[EDGE_FIRST]) * np.float64(both)
        debts[waiting] = debts[waiting + 1] = (
            debts[waiting] * pairs / (np.float64(count) * np.float64(here if hot > 0 else count))
        )
        waiting += 2
    return found, total


@kernel
def find_crossings(ends: Int64Array, points: Int64Array) -> tuple[Int64Array, Integer]:
    """Return the pairs of edges that cross, (N, 5): the two, whether it is at a point of the grid, and x, y of the nearest one.

    Shapes  ends: (E, 4) x, y of the upper end, then of the lower one; points: none, (0, 2).
    Needs   coordinates within 2^40.
    """
    return visit_cells(meet_edges, ends, points)


@kernel
def find_passing(ends: Int64Array, points: Int64Array) -> tuple[Int64Array, Integer]:
    """Return which edges pass within half a sub-pixel of points, (N, 5): edge, point, whether it lies on the edge.

    Shapes  ends: (E, 4); points: (P, 2). The ends of an edge are left out.
    Needs   coordinates within 2^40.
    """
    return visit_cells(meet_points, ends, points)
