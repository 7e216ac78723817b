"""Exact area coverage: how much of each pixel a polygon covers, as if every point of it were a sample.

An edge covers what lies right of it. In a row it changes the cover of the pixels that it passes by the area of a trapezoid,
and of all further right by its height; so each edge leaves two numbers a pixel, and one running sum along the row gives the
coverage. What an edge leaves depends on that edge, the row and the pixel alone, and is rounded once (area_edges.py). A
neighbour that has the same edge the other way round leaves the same with the other sign: the sums cancel to the bit, and
tilings whose edges match add up to exactly 1.

The edges of a row stand in a list from left to right, kept up from row to row, and the fill rule says which of them bound the
inside; the others leave nothing. Most rows are quiet: nothing begins, ends or crosses within them, and one pass is all. In the
others the row is swept from event to event (area_events.py), and only those that an event touches are looked at again. Where
an edge is a boundary all through a row, as all edges of a simple polygon are, it leaves what it always does.

Crossings alone are found in float64. So a pixel with a dozen edges in it is right to 2^-40. Which of several edges that meet in
one point comes first is decided by their slopes, then by their numbers: by nothing that depends on the rows before, so that
bands of rows give the same bits.

Price: O(n) for a quiet row of n edges, O((n + k) log n) for one with k events, and the pixels along the edges; a number for
every column of the polygon's box in each row.

Source: the accumulation buffer of font-rs and stb_truetype, here in integers; Bentley and Ottmann 1979.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scanspan.jit import bare_helper, bare_kernel, inline_kernel
from scanspan.raster.area_edges import (
    AREA_BITS,
    BLOCK_BITS,
    BLOCK_MASK,
    CORNER_COLUMNS,
    PIXEL,
    UNIT,
    X0,
    X1,
    Y0,
    Y1,
    gather_areas,
    gather_edges,
)  # fmt: skip
from scanspan.raster.area_pieces import AreaSweep, make_sweep
from scanspan.raster.area_row import sweep_row
from scanspan.records import Float64Array, Int64Array, Integer

__all__ = ["AREA_BITS", "area_kernel", "gather_areas", "gather_edges"]


@inline_kernel
def spread_row(
    write_cover: Callable[..., None], target: Any, y: Integer, sums: Int64Array, blocks: Int64Array, start: Integer,
    end: Integer, color: Integer, flag: int,
) -> None:  # fmt: skip
    """Add up what was left in a row from one column to another, write it, and clear the sums.

    Shapes  blocks: (B,); only those marked are gone through pixel by pixel.
    """
    cover, x, last = np.int64(0), start, (end - 1) >> BLOCK_BITS
    while x < end:
        # Take a pixel of a block that is marked, or all blocks up to the next such.
        b, next_x = x >> BLOCK_BITS, x + 1
        if blocks[b] != 0:
            cover += sums[x]
            sums[x] = 0
            if next_x & BLOCK_MASK == 0:
                blocks[b] = 0
        else:
            while b <= last and blocks[b] == 0:
                b += 1
            next_x = min(b << BLOCK_BITS, end)
        if cover != 0:
            write_cover(target, y, x, next_x, cover, color, flag)
        x = next_x
    sums[end] = 0
    sums[end + 1] = 0
    blocks[last] = 0
    blocks[end >> BLOCK_BITS] = 0


@bare_helper
def find_box(
    edges: Int64Array, first: Integer, last: Integer, width: Integer, y_start: Integer, y_end: Integer
) -> tuple[Integer, Integer, Integer, Integer]:
    """Return the columns and rows that a polygon may cover, within those of an image: x_start, x_end, y_start, y_end."""
    low, high, bottom = edges[first, X0], edges[first, X0], edges[first, Y1]
    for e in range(first, last):
        low, high = min(low, edges[e, X0], edges[e, X1]), max(high, edges[e, X0], edges[e, X1])
        bottom = max(bottom, edges[e, Y1])
    return (
        max(low >> AREA_BITS, np.int64(0)),
        min((high + PIXEL - 1) >> AREA_BITS, width),
        max(edges[first, Y0] >> AREA_BITS, y_start),
        min((bottom + PIXEL - 1) >> AREA_BITS, y_end),
    )


@inline_kernel
def sweep_areas(
    write_cover: Callable[..., None], target: Any, width: Integer, y_start: Integer, y_end: Integer, edges: Int64Array,
    edge_starts: Int64Array, fill_rule: int, sweep: AreaSweep, colors: Int64Array, flag: int,
) -> None:  # fmt: skip
    """Write how much of each pixel polygons cover, one polygon after the other, in some rows.

    Shapes  edges: (N, 5), from gather_areas; edge_starts: (P + 1,); colors: (P,), handed to the writer with the flag.
    Units   corners in sub-pixels of AREA_BITS bits; the writer gets whole numbers of 2^-52 pixel, a run of pixels at a time.
    Rule    fill_rule, one of polygon.py.
    Needs   corners within 2^24 px, sides within 2^18 px.
    Cost    see above; nothing for pixels outside the polygons' boxes.
    """
    for n in range(edge_starts.shape[0] - 1):
        first, last = edge_starts[n], edge_starts[n + 1]
        if first == last:
            continue
        x, x_end, row, row_end = find_box(edges, first, last, width, y_start, y_end)
        if x >= x_end:
            continue
        for e in range(first, last):
            for k in range(CORNER_COLUMNS):
                sweep.edges[e - first, k] = edges[e, k]
        count: Integer = np.int64(0)
        following: Integer = np.int64(0)
        for y in range(row, row_end):
            count, following = sweep_row(sweep, count, following, last - first, y, fill_rule)
            spread_row(write_cover, target, y, sweep.sums, sweep.blocks, x, x_end, colors[n], flag)


@bare_helper
def write_share(
    target: Float64Array, y: Integer, start: Integer, end: Integer, cover: Integer, color: Integer, flag: int
) -> None:
    """Write how much of each pixel of a run is covered."""
    share = np.float64(cover) / UNIT
    for x in range(start, end):
        target[y, x] = share


@bare_kernel
def area_rows(
    out: Float64Array, y_start: int, y_end: int, edges: Int64Array, edge_starts: Int64Array, fill_rule: int, sweep: AreaSweep,
    colors: Int64Array,
) -> None:  # fmt: skip
    """Write how much of each pixel a polygon covers, in some rows.

    Shapes  out: (H, W) float64, 0 before, and then 0 to 1 but for 2^-40.
    """
    sweep_areas(write_share, out, out.shape[1], y_start, y_end, edges, edge_starts, fill_rule, sweep, colors, 0)


def area_kernel(edges: Int64Array, fill_rule: int, out: Float64Array) -> None:
    """Write how much of each pixel a polygon covers: the rows of an image, from edges that gather_edges gave."""
    out[:] = 0.0
    starts = np.array([0, len(edges)])
    area_rows(out, 0, len(out), edges, starts, fill_rule, make_sweep(len(edges), out.shape[1]), np.zeros(1, np.int64))
