"""How much of each pixel every one of many polygons covers, and what follows: sums weighted by area, and the largest share.

Each polygon is covered by area.py within its own bounding box, one after the other in one kernel, so a polygon costs what it
is large and nothing is kept of it. Wide ones are cut into tiles at fixed columns of the image: whatever block of the image is
asked for, a row of a tile is worked out from the same numbers, and gives the same bits.

Source: area.py.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.area import AREA_BITS, X0, X1, Y0, Y1, area_kernel
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Sampling

TILE = np.int64(2048)  # columns; also rows that are held at a time
QUANTUM = 2.0**32  # parts of a pixel in which shares are compared, so that what was rounded decides no tie


def gather_edges(xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array) -> tuple[Int64Array, Int64Array]:
    """Return the edges of polygons as area.py wants them, (N, 5), by polygon and upper end, and where each polygon starts.

    Level edges are left out.
    """
    after = np.arange(1, len(xy) + 1)
    after[ring_starts[1:] - 1] = ring_starts[:-1]
    goes_down = (xy[after, 1] > xy[:, 1])[:, None]
    upper, lower = np.where(goes_down, xy, xy[after]), np.where(goes_down, xy[after], xy)
    edges = np.concatenate([upper, lower, np.where(goes_down, 1, -1)], axis=1)
    owner = np.repeat(np.arange(len(polygon_rings) - 1), np.diff(ring_starts[polygon_rings]))
    slanted = edges[:, Y0] < edges[:, Y1]
    edges, owner = edges[slanted], owner[slanted]
    order = np.lexsort((edges[:, Y0], owner))
    starts = np.searchsorted(owner, np.arange(len(polygon_rings)))
    return np.ascontiguousarray(edges[order], np.int64), starts.astype(np.int64)


@inline_kernel
def visit_shares(
    write: Callable[..., None], target: Array, edges: Int64Array, starts: Int64Array, values: Float64Array,
    fill_rule: int, sampling: Sampling, image_width: int,
) -> None:  # fmt: skip
    """Hand the share of every pixel near every polygon to a writer, polygon by polygon.

    Shapes  target: (h, w, ...), the sampling's rectangle of the image; edges, starts: from gather_edges; values: (P,).
            write(row, i, share, value, number).
    Rule    fill_rule, one of polygon.py.
    Needs   as for area_kernel.
    Cost    O(the polygons' boxes), each as high as it is in the rectangle and as wide as its tiles that meet it.
    """
    x_start, x_end = np.int64(sampling.x_start), np.int64(sampling.x_end)
    for p in range(starts.shape[0] - 1):
        first, last = starts[p], starts[p + 1]
        if first == last:
            continue

        # Bound the polygon.
        low_x, high_x, low_y, high_y = edges[first, X0], edges[first, X0], edges[first, Y0], edges[first, Y1]
        for e in range(first, last):
            low_x, high_x = min(low_x, edges[e, X0], edges[e, X1]), max(high_x, edges[e, X0], edges[e, X1])
            high_y = max(high_y, edges[e, Y1])
        left, right = max(low_x >> AREA_BITS, np.int64(0)), min(-(-high_x >> AREA_BITS), np.int64(image_width))
        top = max(low_y >> AREA_BITS, np.int64(sampling.y_start))
        bottom = min(-(-high_y >> AREA_BITS), np.int64(sampling.y_end))
        if max(left, x_start) >= min(right, x_end):
            continue

        # Take the tiles that meet the rectangle, and of each a number of rows at a time.
        for tile in range(max(left, x_start) // TILE, (min(right, x_end) - 1) // TILE + 1):
            start, end = max(left, tile * TILE), min(right, (tile + 1) * TILE)
            for y in range(top, bottom, TILE):
                cover = np.empty((min(bottom - y, TILE), end - start))
                near = edges[first:last].copy()
                for e in range(last - first):
                    near[e, X0] -= start << AREA_BITS
                    near[e, X1] -= start << AREA_BITS
                    near[e, Y0] -= y << AREA_BITS
                    near[e, Y1] -= y << AREA_BITS
                area_kernel(near, fill_rule, cover)
                for j in range(cover.shape[0]):
                    row, shares = target[y + j - sampling.y_start], cover[j]
                    for x in range(max(start, x_start), min(end, x_end)):
                        write(row, x - x_start, shares[x - start], values[p], p)


@helper_kernel
def write_share(row: Float64Array, i: int, share: float, value: float, number: int) -> None:
    """Add a share to what is covered of a pixel."""
    row[i] += share


@helper_kernel
def write_sum(row: Float64Array, i: int, share: float, value: float, number: int) -> None:
    """Add a share to the sum of shares of a pixel, and its value, as far as it counts, to the sum of values."""
    row[i, 0] += share
    row[i, 1] += share * value


@helper_kernel
def write_largest(row: Float64Array, i: int, share: float, value: float, number: int) -> None:
    """Keep the largest share of a pixel and the number of its polygon; the first of equals stays."""
    parts = np.rint(share * QUANTUM)
    is_larger = parts > row[i, 0]
    row[i, 0] = parts if is_larger else row[i, 0]
    row[i, 1] = np.float64(number) if is_larger else row[i, 1]


@kernel
def add_shares(
    target: Float64Array, edges: Int64Array, starts: Int64Array, values: Float64Array, fill_rule: int, sampling: Sampling,
    image_width: int,
) -> None:  # fmt: skip
    """Add up shares: target (h, w); see visit_shares."""
    visit_shares(write_share, target, edges, starts, values, fill_rule, sampling, image_width)


@kernel
def sum_shares(
    target: Float64Array, edges: Int64Array, starts: Int64Array, values: Float64Array, fill_rule: int, sampling: Sampling,
    image_width: int,
) -> None:  # fmt: skip
    """Add up shares, and values weighted by them: target (h, w, 2); see visit_shares."""
    visit_shares(write_sum, target, edges, starts, values, fill_rule, sampling, image_width)


@kernel
def largest_share(
    target: Float64Array, edges: Int64Array, starts: Int64Array, values: Float64Array, fill_rule: int, sampling: Sampling,
    image_width: int,
) -> None:  # fmt: skip
    """Find the polygon that covers most: target (h, w, 2), a share in parts and a number; see visit_shares."""
    visit_shares(write_largest, target, edges, starts, values, fill_rule, sampling, image_width)
