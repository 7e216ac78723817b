"""Polygons to spans of samples: an edge table, an active edge list, and crossings that are put in order by counting them.

Where edges cross a row decides what is filled, and which edge that was does not matter: a sample is inside or not by the sum of
how the edges left of it wind. So nothing is sorted. An edge leaves its winding, 1 or -1, in the column of the first sample that
is not left of it. A walk along the columns adds up, and notes where the sum begins or ceases to be inside. It does not mind how
many edges cross in one column, and it serves all five fill rules.

This is done for a band of 32 rows at a time, down the polygon. The edge table has the edges in buckets by the band in which
they start; the active edge list holds those that cross the present band, in any order, each with its crossing of the row that
is next. An edge crosses all rows of the band in one short loop, with its position and its speed in registers. The rows lie side
by side in memory, so that the walk adds up all 32 at once; it skips blocks of columns that no edge has come through.

A position is in fixed point, with a fraction of 41 bits, and a step is one addition. What all steps lose together stays below
the distance to the next place where a crossing could be (start_edge), so the columns are exact. Edges that are too long for
that are stepped by quotient and remainder, as in edge_walk.py.

Price: 128 bytes for every column that the polygons reach over, and two blocks of columns to walk for every band of a rectangle,
some 10 ns a row. Who must know which edges bound a span sorts them instead: polygon.py.

Source: the lectures' scan-line polygon fill; Ackland and Weste 1981 for the edge flags, here of 32 rows and with a sign.
What else was tried is in docs/decisions/0012-crossings.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from scanspan.geometry.fill_rule import winding_limits
from scanspan.jit import helper_kernel, inline_kernel
from scanspan.raster.edge_walk import start_crossing, step_crossing
from scanspan.raster.polygon import edge_line, edge_rows
from scanspan.records import BoolArray, Int32Array, Int64Array, Integer, Sampling

# Columns of edges: the crossing of the next row, in fixed point or in columns; what a row adds; first row, row after the last;
# 1 where the ring goes down, else -1; and for steps by quotient and remainder the rest, its step, and a, which is else 0.
POSITION, SPEED, ROW, ROW_END, WINDING, REST, STEP_REST, A = range(8)
EDGE_COLUMNS = 8  # 64 bytes, a line of the cache

# Fixed point, and what edges it is for: see start_edge.
FRACTION_BITS = np.int64(41)
ONE = np.int64(1 << 41)
MOST_STEPS = np.int64(1 << 18)  # rows of an image
FAR = np.int64(1 << 20)  # columns
TALL, WIDE = np.int64(1 << 22), np.int64(1 << 21)  # sub-pixels

ROWS = 32  # of a band
ROW_BITS = 5
BLOCK_BITS = 4  # 16 columns
LINE = 32  # int32 in two lines of the cache


class EdgeTable(NamedTuple):
    """The edges of one polygon, in buckets by the band in which they start, and the active edge list."""

    edges: Int64Array  # (N, EDGE_COLUMNS)
    numbers: Int64Array  # (N,)
    starts: Int64Array  # (bands + 2,) bucket j of numbers is starts[j] to starts[j + 1]
    active: Int64Array  # (N,) numbers of the edges that cross the present band


class Band(NamedTuple):
    """The crossings of a band of rows."""

    windings: Int32Array  # (columns, ROWS) 0 where no edge crosses, and everywhere between two bands
    is_crossed: BoolArray  # (blocks,) of columns
    sums: Int32Array  # (ROWS,) of windings, up to the column that is walked
    borders: Int32Array  # (ROWS, stride) columns where the inside begins and ends, in turn
    ends: Int64Array  # (ROWS,) row r of borders, laid flat, is r stride to ends[r]


@helper_kernel
def start_edge(edges: Int64Array, e: Integer, a: Integer, b: Integer, f: Integer, rows: Integer) -> None:
    """Write how edge e crosses its first row, and how that steps.

    Row k is crossed in column -floor(T), where T = (f + k b) / a. Let G = 2^41 and U = G T. From the start and k steps, each
    floored, U comes out too low by less than k + 1. So 2^18 are added, no fewer than there are rows: now U is not below a whole
    G that T reaches. Nor does it reach one that T does not: T is a multiple of 1 / a, so U is short of it by G / a, which is
    2^19 or more. The position is G - 1 - U, so that floor(position / G) = -floor(U / G).
    """
    crossing, rest, step, step_rest = start_crossing(f, a, b)
    is_near = (a <= TALL) & (max(b, -b) <= WIDE) & (max(crossing, -crossing) <= FAR) & (rows <= MOST_STEPS)
    if is_near:
        edges[e, POSITION] = crossing * ONE - (rest * ONE) // a + (ONE - 1 - MOST_STEPS)
        edges[e, SPEED] = step * ONE - (step_rest * ONE) // a
        edges[e, A] = 0
    else:
        edges[e, POSITION], edges[e, SPEED] = crossing, step
        edges[e, REST], edges[e, STEP_REST], edges[e, A] = rest, step_rest, a


@helper_kernel
def gather_edges(
    edges: Int64Array, count: Integer, xy: Int64Array, first: Integer, last: Integer, x_start: Integer, sampling: Sampling
) -> Integer:
    """Add the edges of one ring, points first to last, that cross a row of the rectangle; return how many edges there are now.

    Columns count from x_start. Level edges cross no row.
    """
    for v in range(first, last):
        w = v + 1 if v + 1 < last else first
        upper, lower, row, row_end = edge_rows(xy, v, w, sampling)
        if row < row_end:
            a, b, f = edge_line(xy, upper, lower, x_start, row, sampling)
            start_edge(edges, count, a, b, f, row_end - row)
            edges[count, ROW], edges[count, ROW_END], edges[count, WINDING] = row, row_end, 1 if upper == v else -1
            count += 1
    return count


@helper_kernel
def sort_into_bands(table: EdgeTable, count: Integer) -> tuple[Integer, Integer]:
    """Put the edges into buckets by band, a counting sort; return the first row and how many bands there are."""
    edges, numbers, starts = table.edges, table.numbers, table.starts
    row, row_end = edges[0, ROW], edges[0, ROW_END]
    for e in range(1, count):
        row, row_end = min(row, edges[e, ROW]), max(row_end, edges[e, ROW_END])

    # Count how many start in every band, and add up; one place further on, so that filling the buckets moves it there.
    bands = ((row_end - row - 1) >> ROW_BITS) + 1
    for j in range(bands + 2):
        starts[j] = 0
    for e in range(count):
        starts[((edges[e, ROW] - row) >> ROW_BITS) + 2] += 1
    for j in range(bands):
        starts[j + 2] += starts[j + 1]

    # Fill the buckets.
    for e in range(count):
        j = (edges[e, ROW] - row) >> ROW_BITS
        numbers[starts[j + 1]] = e
        starts[j + 1] += 1
    return row, bands


@helper_kernel
def cross_rows(
    edges: Int64Array, e: Integer, first: Integer, last: Integer, width: Integer, band: Band
) -> tuple[Integer, Integer]:
    """Leave the winding of edge e where it crosses rows first to last of a band; return its leftmost and rightmost column."""
    windings, zero = band.windings, np.int64(0)
    winding = np.int32(edges[e, WINDING])
    position, speed = edges[e, POSITION], edges[e, SPEED]
    if edges[e, A] == 0:
        start = min(max(position >> FRACTION_BITS, zero), width)
        for r in range(first, last):
            column = min(max(position >> FRACTION_BITS, zero), width)
            windings[column, r] += winding
            position += speed
        edges[e, POSITION] = position
        end = min(max((position - speed) >> FRACTION_BITS, zero), width)
        return min(start, end), max(start, end)

    # Step an edge that is too long for it by quotient and remainder.
    rest, step_rest, a = edges[e, REST], edges[e, STEP_REST], edges[e, A]
    start = end = min(max(position, zero), width)
    for r in range(first, last):
        end = min(max(position, zero), width)
        windings[end, r] += winding
        position, rest = step_crossing(position, rest, speed, step_rest, a)
    edges[e, POSITION], edges[e, REST] = position, rest
    return min(start, end), max(start, end)


@helper_kernel
def cross_band(
    table: EdgeTable, band: Band, count: Integer, j: Integer, y: Integer, width: Integer
) -> tuple[Integer, Integer, Integer]:
    """Insert the edges that start in band j, from row y on; let all active ones cross it, and take out those that end.

    Returns the active list's new length, and the first and the last block of columns that is crossed.
    """
    edges, active, is_crossed = table.edges, table.active, band.is_crossed
    for k in range(table.starts[j], table.starts[j + 1]):
        active[count] = table.numbers[k]
        count += 1
    kept: Integer = np.int64(0)
    low: Integer = np.int64(is_crossed.shape[0])
    high: Integer = np.int64(-1)
    for k in range(count):
        e = active[k]
        row, row_end = edges[e, ROW], edges[e, ROW_END]
        left, right = cross_rows(edges, e, max(row, y) - y, min(row_end - y, np.int64(ROWS)), width, band)

        # Mark the blocks that it came through, and keep it if it goes on.
        first, last = left >> BLOCK_BITS, right >> BLOCK_BITS
        for block in range(first, last + 1):
            is_crossed[block] = True
        low, high = min(low, first), max(high, last)
        active[kept] = e
        kept += np.int64(row_end > y + ROWS)
    return kept, low, high


@helper_kernel
def find_borders(band: Band, low: Integer, high: Integer, fill_rule: int) -> None:
    """Walk along the columns of blocks low to high, and note for each row where the inside begins and ends."""
    windings, is_crossed, sums, borders, ends = band.windings, band.is_crossed, band.sums, band.borders, band.ends
    mask, below, above = winding_limits(fill_rule)
    for r in range(ROWS):
        ends[r] = r * borders.shape[1]
    flat = borders.reshape(borders.size)
    for block in range(low, high + 1):
        if not is_crossed[block]:
            continue
        is_crossed[block] = False
        for column in range(block << BLOCK_BITS, (block + 1) << BLOCK_BITS):
            # Add up in all rows at once, and clear for the next band; a bit says in which rows something changes.
            changes = np.int64(0)
            for r in range(ROWS):
                before = sums[r]
                after = np.int32(before + windings[column, r])
                sums[r] = after
                windings[column, r] = 0
                was, now = before & mask, after & mask
                changes |= np.int64(((now < below) | (now > above)) != ((was < below) | (was > above))) << r

            # Note the column in these rows; a power of two as a float64 tells its exponent.
            while changes != 0:
                changed = (np.float64(changes & -changes).view(np.int64) >> np.int64(52)) - 1023
                flat[ends[changed]] = column
                ends[changed] += 1
                changes &= changes - 1


@inline_kernel
def scan_polygons(
    write: Callable[..., tuple[Any, Integer]], kept: Any, owners: Int64Array, xy: Int64Array, ring_starts: Int32Array,
    polygon_rings: Int32Array, fill_rule: int, sampling: Sampling,
) -> tuple[Any, Integer]:  # fmt: skip
    """Write the spans of one polygon after the other, each by row and from left to right; return what `write` has kept of them.

    Shapes  owners: (P,), handed on as owner; xy: (V, 2); ring_starts: (R + 1,) rows of xy, a ring is closed from its last point
            to its first; polygon_rings: (P + 1,) rings. write(kept, total, owner, y, x_start, x_end, sampling), with
            x_start < x_end, returns kept and total.
    Units   sub-pixels; sampling's rectangle and spans in pixels.
    Rule    top-left, whatever sampling.rule: a sample on a left edge is in, one on a right edge is out. fill_rule: one of five.
    Needs   coordinates within 2^24 px; the rectangle is part of an image.
    Cost    O(crossings), and for each band of 32 rows O(columns that are near an edge). Memory: the largest polygon, and 128
            bytes for each column.
    Source  the lectures' scan-line polygon fill.
    """
    # Find the columns that polygons reach, and the largest polygon.
    polygons, most, s = polygon_rings.shape[0] - 1, np.int64(0), sampling.subpixel_bits
    for p in range(polygons):
        most = max(most, np.int64(ring_starts[polygon_rings[p + 1]]) - np.int64(ring_starts[polygon_rings[p]]))
    x_low, x_high = np.int64(1 << 60), np.int64(-(1 << 60))
    for v in range(xy.shape[0]):
        x_low, x_high = min(x_low, xy[v, 0]), max(x_high, xy[v, 0])
    left = max(np.int64(sampling.x_start), x_low >> s)
    width = max(min(np.int64(sampling.x_end), (x_high >> s) + 1) - left, np.int64(0))

    # Make room.
    bands = (max(np.int64(sampling.y_end) - sampling.y_start, np.int64(0)) >> ROW_BITS) + 2
    blocks, stride = (width >> BLOCK_BITS) + 1, min(width + 1, most) // LINE * LINE + LINE + LINE // 2
    table = EdgeTable(
        np.empty((most, EDGE_COLUMNS), np.int64),
        np.empty(most, np.int64),
        np.empty(bands + 2, np.int64),
        np.empty(most, np.int64),
    )
    band = Band(
        np.zeros((blocks << BLOCK_BITS, ROWS), np.int32), np.zeros(blocks, np.bool_), np.zeros(ROWS, np.int32),
        np.empty((ROWS, stride), np.int32), np.empty(ROWS, np.int64),
    )  # fmt: skip
    total: Integer = np.int64(0)
    for p in range(polygons if width > 0 else 0):
        # Build the polygon's edge table.
        edge_count: Integer = np.int64(0)
        for r in range(polygon_rings[p], polygon_rings[p + 1]):
            first, last = np.int64(ring_starts[r]), np.int64(ring_starts[r + 1])
            edge_count = gather_edges(table.edges, edge_count, xy, first, last, left, sampling)
        if edge_count == 0:
            continue
        row, count_of_bands = sort_into_bands(table, edge_count)

        # Sweep down its bands, and write what lies between two borders.
        count: Integer = np.int64(0)
        for j in range(count_of_bands):
            y = row + (np.int64(j) << ROW_BITS)
            count, low, high = cross_band(table, band, count, j, y, width)
            find_borders(band, low, high, fill_rule)
            for r in range(ROWS):
                for k in range(0, band.ends[r] - r * stride, 2):
                    x_start, x_end = left + band.borders[r, k], left + band.borders[r, k + 1]
                    kept, total = write(kept, total, owners[p], y + r, x_start, x_end, sampling)
    return kept, total
