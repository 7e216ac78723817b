"""A depth test on a canvas: of triangles with a depth at each corner, what is nearer is seen, and not what is later.

The depth of a sample is the one that `rasterize` gives, from the same exact edge values, rounded once to float32. A triangle is
seen where it is larger than what is there already; of equal depths, the first stays. So a canvas has a depth for each pixel,
and calls that follow each other, and pictures from elsewhere with their depths, hide each other like triangles of one call.

There are two ways, which give the same bits. Half-space draws triangles straight into pixels and depths, each sample tested
and coloured where it is drawn: to find out first what is seen of them costs more than to colour all. Large ones, and all other
algorithms, find out first: they draw into keys, as for `rasterize`, and what is seen is coloured by number afterwards.

Triangles that jump about the picture are first sorted by tiles, which stay in the cache of a processor (tiles.py;
docs/decisions/0020-depth-on-a-canvas.md has the measurements).

Source: E. Catmull 1974 for the depth buffer.
"""

from __future__ import annotations

from threading import Event
from typing import Any

import numpy as np

from scanspan.assets.arrays import in_layout
from scanspan.bands import run_bands
from scanspan.geometry.project import screen_triangles
from scanspan.jit import bare_helper, distinct_kernel, kernel
from scanspan.memory import borrow
from scanspan.raster.algorithms import LARGE_BOX, SMALL_IMAGE, are_in_order, run
from scanspan.raster.edge import OFFSCREEN_POINT
from scanspan.raster.flat import Room, make_room, scan_flat
from scanspan.raster.lanes import BLOCK, DEPTH
from scanspan.raster.write import EMPTY_KEY, is_nearer, unpack_depth, unpack_number
from scanspan.records import Array, Float32Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, UInt8Array
from scanspan.target.color_runs import color_rows
from scanspan.target.gouraud import crop, fetch_codes, set_up_shades, shade_word, start_shade
from scanspan.target.tiles import Tiled, sort_by_tiles
from scanspan.target.triangles import measure_triangles, run_flat, run_rows

THERE, NEW = -1.0, 0.0  # as numbers of primitives: of equal depths, what is there comes first
SORTED_BOX = 400.0  # pixels in the mean box, beyond which what triangles themselves cover makes up for jumping about
CACHE_BYTES = 1 << 22  # of pixels and depths, up to which triangles in no order do no harm


@bare_helper
def fetch_tested(
    values: tuple[Float64Array, UInt8Array], listed: Int64Array, start: Integer, count: Integer, floats: Float64Array,
    codes: UInt8Array,
) -> None:  # fmt: skip
    """Copy the depths and colours at the corners of some triangles of a list into rows of numbers and codes."""
    depths, colors = values
    for k in range(count):
        n = np.uint64(listed[np.uint64(start + k)])
        floats[DEPTH * BLOCK + k], floats[(DEPTH + 1) * BLOCK + k] = depths[n, 0], depths[n, 1]
        floats[(DEPTH + 2) * BLOCK + k] = depths[n, 2]
    fetch_codes(colors, listed, start, count, floats, codes)


@bare_helper
def start_tested(values: Any, n: Integer, floats: Float64Array, k: Integer) -> Any:
    """Return the plane of depth over the box of triangle k of a block, and the planes of colour."""
    depth, slope1 = floats[DEPTH * BLOCK + k], floats[(DEPTH + 1) * BLOCK + k]
    return depth, slope1, floats[(DEPTH + 2) * BLOCK + k], start_shade(values, n, floats, k)


@bare_helper
def write_tested(
    target: tuple[Int32Array, Float32Array], at: Integer, inside: bool, value: Any, i: Integer, j: Integer, e1: Integer,
    e2: Integer,
) -> None:  # fmt: skip
    """Colour one pixel of a box, (i, j) from its first, where it is nearer than what is there; two masked stores."""
    words, depths = target
    start, slope1, slope2, shade = value
    depth = np.float32((start + (np.float64(e1) * slope1 + np.float64(e2) * slope2)) + 0.0)
    if inside and is_nearer(depth, NEW, depths[at], THERE):  # in this order: a lane beyond the box may lie beyond the picture
        words[at], depths[at] = shade_word(shade, i, j), depth


@distinct_kernel
def tested_words(
    target: tuple[Int32Array, Float32Array], width: int, vertices: Float64Array, values: tuple[Float64Array, UInt8Array],
    room: Room, top: int, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H width,) words of 32 bits and as many depths, shaded between the corners.

    Shapes  values: depths (N, 3) and colors (N, 3, 3) or (N, 3, 4).
    Needs   sums of edge values times colours fit; the rule is not that of an off-screen point.
    """
    scan_flat(
        fetch_tested, set_up_shades, start_tested, write_tested, True, target, np.int64(width), vertices, values, room,
        top, first, last, sampling,
    )  # fmt: skip


@kernel
def keep_nearer(keys: Int64Array, depths: Float32Array, numbers: Int32Array) -> None:
    """Keep the depths of keys that are nearer than what is there, and tell whose they are.

    Shapes  keys: (h, w); depths: (h, w), written; numbers: (h, w), written: one more than the slot of the key, or 0.
    """
    for j in range(keys.shape[0]):
        for i in range(keys.shape[1]):
            key = keys[j, i]
            depth = unpack_depth(key)
            is_seen = (key != EMPTY_KEY) & is_nearer(depth, NEW, depths[j, i], THERE)
            depths[j, i] = depth if is_seen else depths[j, i]
            numbers[j, i] = np.int32(unpack_number(key) + 1) if is_seen else np.int32(0)


def paint_by_keys(
    words: Int32Array, depth: Float32Array, vertices: Float64Array, depths: Float64Array, colors: Array, algorithm: str,
    sampling: Sampling, threads: int,
) -> None:  # fmt: skip
    """Find out which triangle is nearest at each pixel, then colour what is seen; the parameters are those of paint_tested."""
    screen = screen_triangles(vertices, sampling.subpixel_bits)._replace(depth=depths.reshape(-1))
    found = crop(screen, sampling)
    if found is None:
        return
    screen, within, x_start, y_start = found
    keys, numbers = (borrow((within.y_end, within.x_end), dtype) for dtype in (np.int64, np.int32))
    keys.fill(EMPTY_KEY)
    run(algorithm, "rows", "keys", keys, screen, within, threads)
    below = depth[y_start : y_start + within.y_end, x_start : x_start + within.x_end]

    def color_band(row: int, row_end: int, stop: Event) -> None:
        """Test and colour the rows of one band."""
        keep_nearer(keys[row:row_end], below[row:row_end], numbers[row:row_end])
        color_rows(words, numbers, (x_start, y_start), (row, row_end), vertices, colors, sampling)

    run_bands(color_band, within.y_end, 1 if keys.size < SMALL_IMAGE else threads)


def paint_tested(
    pixels: UInt8Array, depth: Float32Array, vertices: Array, depths: Array, colors: Array, algorithm: str,
    sampling: Sampling, threads: int,
) -> None:  # fmt: skip
    """Paint opaque triangles with depths and colours at their corners over pixels, where they are nearer than these.

    Parameters
    ----------
    pixels, depth : (H, W, 4) and (H, W); both are written.
    vertices : (N, 3, 2) corners in pixels, float32 or float64, checked.
    depths : (N, 3), float32 or float64, finite; the larger the nearer.
    colors : (N, 3, 3) or (N, 3, 4), uint8, or float64 0..255.
    algorithm : a name of ALGORITHMS, "homogeneous" excepted.
    sampling : of the whole image.
    threads : how many share the rows.
    """
    words, count, is_drawn_here, mean = pixels.view(np.int32)[..., 0], len(vertices), False, 0.0
    if algorithm == "half-space" and sampling.rule != OFFSCREEN_POINT and colors.dtype == np.uint8:
        is_sure, mean = measure_triangles(vertices, sampling.subpixel_bits)
        is_drawn_here = is_sure and mean <= LARGE_BOX
    if not is_drawn_here:
        corners, deep = in_layout(vertices, np.float64), in_layout(depths, np.float64)
        paint_by_keys(words, depth, corners, deep, colors, algorithm, sampling, threads)
        return
    tiled, may_jump = None, mean <= SORTED_BOX and words.nbytes + depth.nbytes > CACHE_BYTES
    if may_jump and not are_in_order(lambda some: vertices[some, 0, 1], count, len(words)):
        tiled = sort_by_tiles(vertices, depths, colors, words.shape, threads)
    if tiled is not None:
        paint_tiles((words, depth), tiled, sampling, threads)
        return

    # The kernel is told that no array lies over another; callers may paint with colours that they take from the canvas.
    corners, deep, codes = (
        array.copy() if np.may_share_memory(array, words) or np.may_share_memory(array, depth) else array
        for array in (vertices, in_layout(depths, np.float64), colors)
    )
    run_flat(tested_words, (words, depth), corners, (deep, codes), sampling, threads)


def paint_tiles(target: tuple[Int32Array, Float32Array], tiled: Tiled, sampling: Sampling, threads: int) -> None:
    """Paint triangles tile by tile; the threads share the tiles."""

    def paint_some(first: int, last: int, stop: Event) -> None:
        """Paint some tiles."""
        room = make_room(max(y_end - y_start for _, _, y_start, y_end in tiled.rectangles))
        for k in range(first, last):
            start, end = tiled.starts[k], tiled.starts[k + 1]
            if start == end or stop.is_set():
                continue
            x_start, x_end, y_start, y_end = tiled.rectangles[k]
            within = sampling._replace(x_start=x_start, x_end=x_end, y_start=y_start, y_end=y_end)
            values = in_layout(tiled.depths[start:end], np.float64), tiled.colors[start:end]
            run_rows(tested_words, target, tiled.vertices[start:end], values, within, stop, room, top=0)

    run_bands(paint_some, len(tiled.rectangles), threads, costs=np.diff(tiled.starts).astype(np.float64))
