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
from typing import Any, NamedTuple

import numpy as np

from scanspan.jit import bare_kernel, inline_kernel
from scanspan.raster.area_convex import BOX, find_convex, leave_edge
from scanspan.raster.area_edges import (
    AREA_BITS,
    BLOCK_BITS,
    BLOCK_MASK,
    CORNER_COLUMNS,
    DOWN,
    PIXEL,
    X0,
    X1,
    Y0,
    Y1,
    gather_areas,
)  # fmt: skip
from scanspan.raster.area_pieces import AreaSweep, is_inside
from scanspan.raster.area_row import sweep_row
from scanspan.records import Int32Array, Int64Array, Integer


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


@bare_kernel
def find_boxes(edges: Int64Array, edge_starts: Int64Array, width: int, height: int, boxes: Int64Array) -> None:
    """Find the pixels of an image that each polygon may cover.

    Shapes  boxes: (P, 4), written: x_start, x_end, y_start, y_end; empty where x_start is not below x_end.
    """
    for n in range(boxes.shape[0]):
        first, last = edge_starts[n], edge_starts[n + 1]
        boxes[n, 0], boxes[n, 1], boxes[n, 2], boxes[n, 3] = 0, 0, 0, 0
        if first == last:
            continue
        low, high, top, bottom = edges[first, X0], edges[first, X0], edges[first, Y0], edges[first, Y1]
        for e in range(first, last):
            low, high = min(low, edges[e, X0], edges[e, X1]), max(high, edges[e, X0], edges[e, X1])
            top, bottom = min(top, edges[e, Y0]), max(bottom, edges[e, Y1])
        boxes[n, 0] = max(low >> AREA_BITS, np.int64(0))
        boxes[n, 1] = min((high + PIXEL - 1) >> AREA_BITS, np.int64(width))
        boxes[n, 2] = max(top >> AREA_BITS, np.int64(0))
        boxes[n, 3] = min((bottom + PIXEL - 1) >> AREA_BITS, np.int64(height))


class Areas(NamedTuple):
    """Polygons whose areas are to be swept: their edges, where those of each start, the pixels that each may cover."""

    edges: Int64Array  # (N, 5) as gather_areas gives them
    starts: Int64Array  # (P + 1,)
    boxes: Int64Array  # (P, 4)
    windings: Int64Array  # (P,) within a convex polygon, 0 for others


def make_areas(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, size: tuple[int, int], is_swept: bool = False
) -> Areas:
    """Return polygons ready to be swept.

    Parameters
    ----------
    xy, ring_starts, polygon_rings : as for `gather_areas`.
    size : (width, height) of the image.
    is_swept : whether convex polygons are swept as others are.
    """
    windings = np.zeros(len(polygon_rings) - 1, np.int64)
    if not is_swept:
        find_convex(xy, ring_starts, polygon_rings, size[0], windings)
    edges, starts = gather_areas(xy, ring_starts, polygon_rings, size[1], windings)
    boxes = np.empty((len(windings), 4), np.int64)
    find_boxes(edges, starts, size[0], size[1], boxes)
    return Areas(edges, starts, boxes, windings)


@inline_kernel
def spread_box(
    write_cover: Callable[..., None], target: Any, row: Integer, rows: Integer, left: Integer, stride: Integer,
    sums: Int64Array, extents: Int64Array, color: Integer, flag: int,
) -> None:  # fmt: skip
    """Add up what was left in the rows of a box, write it, and clear the sums."""
    for r in range(rows):
        x, high = extents[r, 0], extents[r, 1]
        cover, place = np.int64(0), r * stride
        while x <= high:
            cover += sums[place + x]
            sums[place + x] = 0
            next_x = x + 1
            while next_x <= high and sums[place + next_x] == 0:
                next_x += 1
            if cover != 0:
                write_cover(target, row + r, left + x, left + next_x, cover, color, flag)
            x = next_x
        sums[place + high + 1] = 0
        extents[r, 0], extents[r, 1] = BOX, -1


@inline_kernel
def sweep_areas(
    write_cover: Callable[..., None], target: Any, y_start: Integer, y_end: Integer, areas: Areas, fill_rule: int,
    sweep: AreaSweep, colors: Int64Array, flag: int,
) -> None:  # fmt: skip
    """Write how much of each pixel polygons cover, one polygon after the other, in some rows.

    Shapes  colors: (P,), handed to the writer with the flag; sweep: room for the largest polygon and the image's width.
    Units   corners in sub-pixels of AREA_BITS bits; the writer gets whole numbers of 2^-52 pixel, a run of pixels at a time.
    Rule    fill_rule, one of polygon.py.
    Needs   corners within 2^24 px, sides within 2^18 px.
    Cost    see above; nothing for pixels outside the polygons' boxes.
    """
    edges, boxes = areas.edges, areas.boxes
    for n in range(boxes.shape[0]):
        row, row_end = max(boxes[n, 2], y_start), min(boxes[n, 3], y_end)
        if boxes[n, 0] >= boxes[n, 1] or row >= row_end:
            continue
        first, last = areas.starts[n], areas.starts[n + 1]
        winding = areas.windings[n]
        if winding != 0:
            # Leave the edges of a convex polygon one after the other, a box of rows at a time.
            if is_inside(fill_rule, winding):
                left, stride = boxes[n, 0], boxes[n, 1] - boxes[n, 0] + 2
                step = BOX // stride
                for y in range(row, row_end, step):
                    rows = min(step, row_end - y)
                    for e in range(first, last):
                        leave_edge(sweep.box, sweep.extents, edges, e, left, y, y + rows, stride, edges[e, DOWN] * winding)
                    spread_box(write_cover, target, y, rows, left, stride, sweep.box, sweep.extents, colors[n], flag)
            continue
        for e in range(first, last):
            for k in range(CORNER_COLUMNS):
                sweep.edges[e - first, k] = edges[e, k]
        count: Integer = np.int64(0)
        following: Integer = np.int64(0)
        for y in range(row, row_end):
            count, following = sweep_row(sweep, count, following, last - first, y, fill_rule)
            spread_row(write_cover, target, y, sweep.sums, sweep.blocks, boxes[n, 0], boxes[n, 1], colors[n], flag)
