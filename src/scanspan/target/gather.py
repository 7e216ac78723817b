"""Gathering: what is plotted goes through its traversal into a target, in threads, with the same bits for any number of them.

Source: docs/decisions/0010-aggregation.md.
"""

from __future__ import annotations

from functools import partial
from threading import Event

import numpy as np

from scanspan.bands import run_bands
from scanspan.geometry.world import World
from scanspan.raster.algorithms import count_passes, run_kernel
from scanspan.raster.points import place_points, sort_places
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Sampling, ScreenTriangles
from scanspan.target.reduce import POINTS, SEGMENTS, TRIANGLES
from scanspan.target.strokes import paint_segments

BLOCK = 1 << 14  # points; their coordinates and places stay in the second-level cache
PART = 1 << 18  # points that a thread sorts at once
NOTHING = np.empty(0)


class Placer:
    """Turns points into places, a block at a time, whatever types and strides their coordinates have.

    Parameters
    ----------
    columns : x and y, (N,).
    world : what becomes the image.
    size : (width, height) in pixels.
    """

    def __init__(self, columns: tuple[Array, Array], world: World, size: tuple[int, int]) -> None:
        self.columns, self.world, self.size = columns, world, size
        self.x, self.y = np.empty(BLOCK), np.empty(BLOCK)

    def place(self, first: int, place: Int32Array) -> bool:
        """Write the places of as many points as there is room for, from the first on, and say if all are finite."""
        w, is_good = self.world, True
        for start in range(0, len(place), BLOCK):
            count = min(BLOCK, len(place) - start)
            x, y, rows = self.x[:count], self.y[:count], slice(first + start, first + start + count)
            np.copyto(x, self.columns[0][rows], casting="unsafe")
            np.copyto(y, self.columns[1][rows], casting="unsafe")
            is_good &= place_points(
                x, y, w.x_low, w.x_high, w.y_low, w.y_high, w.x_scale, w.y_scale, self.size[0], self.size[1], w.is_up,
                place[start : start + count],
            )  # fmt: skip
        return is_good


def values_of(values: Float64Array | None, first: int, count: int) -> Float64Array:
    """Return the values of some points, none where there are none."""
    return NOTHING if values is None else values[first : first + count]


def gather_points(
    reduce: str, target: Array, columns: tuple[Array, Array], values: Float64Array | None, world: World,
    size: tuple[int, int], threads: int,
) -> bool:  # fmt: skip
    """Write points into a target, (pixels + 1, ...), and say if all of them were finite; those that are not are left out.

    Parameters
    ----------
    reduce : a name of REDUCTIONS.
    target : see target/reduce.py; the last place is for what lies outside.
    columns, world, size : see Placer.
    values : (N,), or None to count.
    threads : how many threads share the points.
    """
    count, kernel = len(columns[0]), POINTS[reduce]
    if threads > 1 and count > PART:
        return gather_parts(reduce, target, columns, values, world, size, threads)
    placer, place, is_good = Placer(columns, world, size), np.empty(BLOCK, np.int32), True
    for first in range(0, count, BLOCK):
        here = place[: min(BLOCK, count - first)]
        is_good &= placer.place(first, here)
        kernel(target, here, values_of(values, first, len(here)))
    return is_good


def gather_parts(
    reduce: str, target: Array, columns: tuple[Array, Array], values: Float64Array | None, world: World,
    size: tuple[int, int], threads: int,
) -> bool:  # fmt: skip
    """Do what `gather_points` does in threads: sort parts of the points by band, then write band after band."""
    count, kernel, parts = len(columns[0]), POINTS[reduce], 2 * threads
    shift = max((len(target) // (8 * threads)).bit_length(), 8)
    bands = (len(target) - 1 >> shift) + 1
    place, starts = np.empty((parts, PART), np.int32), np.empty((parts, bands + 1), np.int64)
    kept = np.empty((parts, PART) if values is not None else (parts, 0))

    def sort_parts(base: int, first: int, last: int, stop: Event) -> bool:
        """Sort some of the parts that begin at point `base`, and say if all their points are finite."""
        placer, is_good = Placer(columns, world, size), True
        for part in range(first, last):
            start = base + part * PART
            here = np.empty(max(0, min(PART, count - start)), np.int32)
            is_good &= placer.place(start, here)
            sort_places(here, values_of(values, start, len(here)), shift, starts[part], place[part], kept[part])
        return is_good

    def write_bands(first: int, last: int, stop: Event) -> None:
        """Write what all parts have for some bands, in order."""
        for band in range(first, last):
            low, high = band << shift, min((band + 1) << shift, len(target))
            for part in range(parts):
                rows = slice(starts[part, band], starts[part, band + 1])
                kernel(target[low:high], place[part, rows] - np.int32(low), kept[part, rows])

    is_good = True
    for base in range(0, count, parts * PART):
        is_good &= all(run_bands(partial(sort_parts, base), parts, threads))
        run_bands(write_bands, bands, threads, bands)
    return is_good


def gather_segments(
    reduce: str, target: Array, segments: Int64Array, values: Float64Array | None, rule: int, subpixel_bits: int, threads: int
) -> None:
    """Write segments into a target, (H, W, ...), in order.

    Parameters
    ----------
    segments : (N, 4) x0, y0, x1, y1 in pixels, or in sub-pixels where the rule is DIAMOND_EXIT.
    values : (N,), or None to count.
    rule : a number of raster/segment.py.
    """
    numbers = np.zeros(len(segments)) if values is None else values
    paint_segments(target, segments, numbers, threads, SEGMENTS[reduce], rule, subpixel_bits)


def gather_triangles(reduce: str, target: Array, triangles: ScreenTriangles, sampling: Sampling, threads: int) -> None:
    """Write triangles into a target, (H, W, ...)."""
    run_kernel(TRIANGLES[reduce], target, triangles, sampling, threads, count_passes(triangles, sampling, target.nbytes))
