"""Triangles in the order of tiles: of those in no order, each tile of a picture gets the ones that reach into it, side by side.

Where triangles jump about a picture, every row of one waits for the memory, the more so if other programs use the cache. A tile
stays in the cache of its processor until all of its triangles are drawn. They are copied, not listed: copies are written and
read one after the other, and to follow a list is to jump again. Within a tile they keep the order in which they came, so the
picture is the same.

Source: J. Snyder, R. Barzel and S. Gabriel 1990 for sorting by tiles; M. Abrash 2009, Rasterization on Larrabee.
"""

from __future__ import annotations

from threading import Event
from typing import NamedTuple

import numpy as np

from scanspan.bands import run_bands
from scanspan.jit import bare_kernel
from scanspan.records import Array, Int64Array, Integer, UInt8Array

COLUMN_BITS, ROW_BITS = 7, 7  # of a tile, 128 x 128 pixels; with depths it has 128 KiB
MOST_TILES = 512  # else larger ones, as each takes some microseconds
MOST_COPIES = 4  # of a triangle, in the mean, up to which sorting is worth it
FIRST = 0.5 + 1 / 32  # pixels from the corner of a pixel to its centre, and what snapping to 1/16 may move a vertex by
ZERO = np.int64(0)


class Tiled(NamedTuple):
    """Triangles in the order of tiles."""

    rectangles: list[tuple[int, int, int, int]]  # x_start, x_end, y_start, y_end of each tile in pixels
    starts: Int64Array  # (tiles + 1,) the first triangle of each tile
    vertices: Array  # (M, 3, 2)
    depths: Array  # (M, 3)
    colors: UInt8Array  # (M, 3, 3) or (M, 3, 4)


@bare_kernel
def count_triangles(
    vertices: Array,
    across: Integer,
    down: Integer,
    column_bits: Integer,
    row_bits: Integer,
    reach: Int64Array,
    counts: Int64Array,
) -> None:
    """Count the triangles that reach into each tile.

    Shapes  vertices: (N, 3, 2); reach: (N,), written: the first tile of each triangle, and how many more it has down and
            across, in 16 bits each; counts: (across down,), added to.
    Units   vertices in pixels.
    """
    for n in range(vertices.shape[0]):
        p_x, q_x, r_x = vertices[n, 0, 0], vertices[n, 1, 0], vertices[n, 2, 0]
        p_y, q_y, r_y = vertices[n, 0, 1], vertices[n, 1, 1], vertices[n, 2, 1]

        # The centre of the first pixel that is covered lies in the box, but for snapping. What is outside counts to the rim.
        left = min(max(np.int64(min(p_x, q_x, r_x) - FIRST) >> column_bits, ZERO), across - 1)
        right = min(max(np.int64(max(p_x, q_x, r_x)) >> column_bits, ZERO), across - 1)
        top = min(max(np.int64(min(p_y, q_y, r_y) - FIRST) >> row_bits, ZERO), down - 1)
        bottom = min(max(np.int64(max(p_y, q_y, r_y)) >> row_bits, ZERO), down - 1)
        first, more = top * across + left, ((bottom - top) << 16) + (right - left)
        reach[n] = (first << 32) + more
        if more == 0:
            counts[np.uint64(first)] += 1
        else:
            for j in range(bottom - top + 1):
                for i in range(right - left + 1):
                    counts[np.uint64(first + j * across + i)] += 1


@bare_kernel
def copy_triangles(
    vertices: Array, depths: Array, colors: UInt8Array, across: Integer, reach: Int64Array, places: Int64Array,
    tiled_vertices: Array, tiled_depths: Array, tiled_colors: UInt8Array,
) -> None:  # fmt: skip
    """Copy each triangle to all tiles that it reaches into.

    Shapes  as in Tiled; reach: from count_triangles; places: (across down,), where the next triangle of each tile goes.
    """
    channels = colors.shape[2]
    for n in range(vertices.shape[0]):
        first, down, right = reach[n] >> 32, (reach[n] >> 16) & 0xFFFF, reach[n] & 0xFFFF
        for j in range(down + 1):
            for i in range(right + 1):
                tile = np.uint64(first + j * across + i)
                k = np.uint64(places[tile])
                places[tile] += 1
                for c in range(3):
                    tiled_vertices[k, c, 0], tiled_vertices[k, c, 1] = vertices[n, c, 0], vertices[n, c, 1]
                    tiled_depths[k, c] = depths[n, c]
                    for channel in range(channels):
                        tiled_colors[k, c, channel] = colors[n, c, channel]


def tiles_along(side: int, bits: int) -> int:
    """Return how many tiles of 2^bits pixels cover a side."""
    return ((side - 1) >> bits) + 1


def sort_by_tiles(vertices: Array, depths: Array, colors: UInt8Array, shape: tuple[int, ...], threads: int) -> Tiled | None:
    """Return triangles in the order of the tiles of a picture; None where too many reach into too many of them.

    Parameters
    ----------
    vertices : (N, 3, 2) float32 or float64, corners in pixels, within 2^24.
    depths, colors : (N, 3) and (N, 3, 3 or 4).
    shape : height and width of the picture.
    threads : how many share the triangles; each has a part of every tile for its own.
    """
    (height, width), column_bits, row_bits = shape, COLUMN_BITS, ROW_BITS
    while tiles_along(width, column_bits) * tiles_along(height, row_bits) > MOST_TILES:
        column_bits, row_bits = column_bits + 1, row_bits + 1
    across, down = tiles_along(width, column_bits), tiles_along(height, row_bits)
    sides = np.int64(across), np.int64(down), np.int64(column_bits), np.int64(row_bits)
    size = -(-len(vertices) // threads)
    parts = [slice(first, first + size) for first in range(0, len(vertices), size)]
    reach, counts = np.empty(len(vertices), np.int64), np.zeros((len(parts), across * down), np.int64)

    def count(first: int, last: int, stop: Event) -> None:
        """Count the triangles of some parts."""
        for part, found in zip(parts[first:last], counts[first:last], strict=True):
            count_triangles(vertices[part], *sides, reach[part], found)

    run_bands(count, len(parts), threads, each=1)

    # Of each tile, the first part comes first.
    ends = np.cumsum(counts.T).reshape(across * down, len(parts))
    starts, total = np.append(0, ends[:, -1]), int(ends[-1, -1])
    if total > MOST_COPIES * len(vertices):
        return None
    copies = (
        np.empty((total, 3, 2), vertices.dtype), np.empty((total, 3), depths.dtype),
        np.empty((total, *colors.shape[1:]), np.uint8),
    )  # fmt: skip
    places = np.ascontiguousarray(ends.T) - counts

    def copy(first: int, last: int, stop: Event) -> None:
        """Copy the triangles of some parts."""
        for part, place in zip(parts[first:last], places[first:last], strict=True):
            copy_triangles(vertices[part], depths[part], colors[part], sides[0], reach[part], place, *copies)

    run_bands(copy, len(parts), threads, each=1)
    rectangles = [
        (i << column_bits, min((i + 1) << column_bits, width), j << row_bits, min((j + 1) << row_bits, height))
        for j in range(down)
        for i in range(across)
    ]
    return Tiled(rectangles, starts, *copies)
