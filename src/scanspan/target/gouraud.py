"""Gouraud on a canvas: triangles whose corners have colours of their own.

Numbers first, colours after. The traversals write which triangle a pixel shows, with the writers that paint flat colours: a
colour is a whole number, and so is a triangle's number. Then each run of pixels of one triangle is coloured by plane equations,
from exact edge values; what is hidden costs no colour. So every algorithm gives the same bits, and none knows of colours.

What lets through has to be laid over what is below it, in order. There, the traversals leave in each pixel a list of the
triangles that cover it, and the lists are gone through afterwards. They have room for a few; where a pixel has more, the
triangles are taken in two halves, one after the other.

Source: Gouraud 1971; the plane equations of the lectures.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event
from typing import Any

import numpy as np

from scanspan.assets.arrays import in_layout
from scanspan.bands import run_bands
from scanspan.geometry.project import screen_triangles
from scanspan.jit import bare_helper, bare_kernel, kernel
from scanspan.raster.algorithms import SMALL, SMALL_IMAGE, count_passes, run_kernel
from scanspan.raster.counters import COUNTERS
from scanspan.raster.edge_walk import edge_walk
from scanspan.raster.flat import Room, scan_flat
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.lanes import BLOCK, VALUES
from scanspan.raster.micropolygon import micropolygon
from scanspan.raster.setup import keep_sample
from scanspan.raster.warnock import HIDES_NOTHING, warnock
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.target.blend import ONE, blend_over
from scanspan.target.color_runs import color_rows
from scanspan.target.paint import PAINTERS
from scanspan.target.planes import (
    channel_code,
    channel_plane,
    corner_values,
    pack_word,
    start_planes,
    sure_code,
)
from scanspan.target.triangles import fill_rows, lie_deep, measure_triangles, run_flat, share_rows

LISTED = 15  # triangles that a pixel's list has room for; with their number it is a line of the cache
LIST_BYTES = 1 << 21  # of the lists of one band; they stay in the cache
BAND_BYTES = 1 << 20  # of the numbers of one band
# Rows of floats: the inverse of 2A; and for each channel what channel_plane returns, and how its start changes with each row.
INVERSE, PLANES = VALUES, VALUES + 1
SMALL_BOX = 400.0  # pixels in the mean box, up to which triangles are coloured where they are drawn


@bare_helper
def write_sample_list(row: Int32Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Put a triangle at the end of a pixel's list, and count it, if there is room or not.

    Shapes  row: (n, LISTED + 1) int32, how many there are, then their numbers.
    """
    if inside:
        count = np.int64(row[q, 0]) + 1
        row[q, count if count < LISTED else LISTED] = np.int32(number)
        row[q, 0] = np.int32(count)


@kernel
def half_space_lists(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Half-space into (H, W, LISTED + 1) lists."""
    half_space(visit_rows, write_sample_list, keep_sample, target, counters, triangles, first, last, sampling)


@kernel
def edge_walk_lists(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Edge walking into (H, W, LISTED + 1) lists."""
    edge_walk(write_sample_list, target, counters, triangles, first, last, sampling)


@kernel
def warnock_lists(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Warnock into (H, W, LISTED + 1) lists."""
    warnock(write_sample_list, keep_sample, HIDES_NOTHING, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_lists(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W, LISTED + 1) lists."""
    micropolygon(write_sample_list, target, counters, triangles, first, last, sampling)


LISTERS: dict[str, Callable[..., None]] = {
    "half-space": half_space_lists, "edge-walk": edge_walk_lists, "warnock": warnock_lists, "micropolygon": micropolygon_lists,
}  # fmt: skip


@bare_helper
def fetch_codes(
    colors: UInt8Array, listed: Int64Array, start: Integer, count: Integer, floats: Float64Array, codes: UInt8Array
) -> None:
    """Copy the colours at the corners of some triangles of a list into rows of codes: three channels a corner."""
    for k in range(count):
        n = np.uint64(listed[np.uint64(start + k)])
        for channel in range(3):
            codes[channel * BLOCK + k] = colors[n, 0, channel]
            codes[(3 + channel) * BLOCK + k] = colors[n, 1, channel]
            codes[(6 + channel) * BLOCK + k] = colors[n, 2, channel]


@bare_helper
def set_up_channel(floats: Float64Array, codes: UInt8Array, count: Integer, channel: int) -> None:
    """Write the plane of a channel of each triangle, from the two edges in the first six rows of floats."""
    for k in range(count):
        u0, u1 = np.float64(codes[np.uint64(channel * BLOCK + k)]), np.float64(codes[np.uint64((3 + channel) * BLOCK + k)])
        u2, plane = np.float64(codes[np.uint64((6 + channel) * BLOCK + k)]), PLANES + 4 * channel
        start, right, part = channel_plane(
            u0, u1, u2, floats[k], floats[BLOCK + k], floats[2 * BLOCK + k], floats[3 * BLOCK + k]
        )
        down = channel_plane(u0, u1, u2, floats[4 * BLOCK + k], floats[5 * BLOCK + k], 0.0, 0.0)[0]
        floats[np.uint64(plane * BLOCK + k)], floats[np.uint64((plane + 1) * BLOCK + k)] = start, right
        floats[np.uint64((plane + 2) * BLOCK + k)], floats[np.uint64((plane + 3) * BLOCK + k)] = part, down


@bare_helper
def set_up_shades(floats: Float64Array, codes: UInt8Array, count: Integer, unit: float) -> None:
    """Write the planes of three channels, from corners that count from the first sample of a box; these are overwritten."""
    for k in range(count):
        p_x, p_y, q_x, q_y = floats[k], floats[BLOCK + k], floats[2 * BLOCK + k], floats[3 * BLOCK + k]
        r_x, r_y = floats[4 * BLOCK + k], floats[5 * BLOCK + k]
        e_p, e_q, e_r = q_x * r_y - q_y * r_x, r_x * p_y - r_y * p_x, p_x * q_y - p_y * q_x
        area = (e_p + e_q) + e_r
        floats[INVERSE * BLOCK + k] = 1.0 / (area if area != 0.0 else 1.0)
        floats[k], floats[BLOCK + k] = e_q, e_r
        floats[2 * BLOCK + k], floats[3 * BLOCK + k] = (r_y - p_y) * unit, (p_y - q_y) * unit
        floats[4 * BLOCK + k], floats[5 * BLOCK + k] = (p_x - r_x) * unit, (q_x - p_x) * unit
    for channel in range(3):
        set_up_channel(floats, codes, count, channel)


@bare_helper
def start_shade(values: Any, n: Integer, floats: Float64Array, k: Integer) -> Any:
    """Return the planes of the three channels over the box of triangle k of a block."""
    at = PLANES * BLOCK + k
    return (
        floats[INVERSE * BLOCK + k], floats[at], floats[at + BLOCK], floats[at + 2 * BLOCK], floats[at + 3 * BLOCK],
        floats[at + 4 * BLOCK], floats[at + 5 * BLOCK], floats[at + 6 * BLOCK], floats[at + 7 * BLOCK],
        floats[at + 8 * BLOCK], floats[at + 9 * BLOCK], floats[at + 10 * BLOCK], floats[at + 11 * BLOCK],
    )  # fmt: skip


@bare_helper
def shade_word(shade: Any, i: Integer, j: Integer) -> np.int32:
    """Return the colour of a pixel of a box, (i, j) from its first; the pixel must be covered."""
    (
        inverse, red, red_right, red_part, red_down, green, green_right, green_part, green_down, blue, blue_right, blue_part,
        blue_down,
    ) = shade  # fmt: skip
    y = np.float64(j)
    return pack_word(
        sure_code(red + y * red_down, red_right, red_part, inverse, i),
        sure_code(green + y * green_down, green_right, green_part, inverse, i),
        sure_code(blue + y * blue_down, blue_right, blue_part, inverse, i),
    )


@bare_helper
def write_shade(
    flat: Int32Array, at: Integer, inside: bool, shade: Any, i: Integer, j: Integer, e1: Integer, e2: Integer
) -> None:
    """Colour one pixel of a box; a masked store, as of flat colours."""
    if inside:
        flat[at] = shade_word(shade, i, j)


@bare_kernel
def shaded_words(
    flat: Int32Array, width: int, vertices: Float64Array, colors: UInt8Array, room: Room, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H width,) words of 32 bits, shaded between the corners. Needs: sums of edge values times colours fit."""
    scan_flat(
        fetch_codes, set_up_shades, start_shade, write_shade, False, flat, np.int64(width), vertices, colors, room, top,
        first, last, sampling,
    )  # fmt: skip


@bare_kernel
def lay_lists(
    pixels: UInt8Array, lists: Int32Array, x_start: int, y_start: int, xy: Int64Array, colors: Array, sampling: Sampling,
    is_linear: int,
) -> None:  # fmt: skip
    """Lay the triangles in the list of each pixel over it, and clear the lists.

    Shapes  pixels: (H, W, 4); lists: (h, w, LISTED + 1), of the pixels from (x_start, y_start) on; xy, colors: as above.
    """
    channels = colors.shape[2]
    for j in range(lists.shape[0]):
        for i in range(lists.shape[1]):
            for m in range(lists[j, i, 0]):
                n = np.int64(lists[j, i, m + 1])
                p, q, r = 3 * n, 3 * n + 1, 3 * n + 2
                e1, e2, step1, step2, inverse = start_planes(
                    xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1], np.int64(i), np.int64(j), sampling
                )
                color = np.int64(255) << 24 if channels == 3 else np.int64(0)
                for k in range(channels):
                    values = corner_values(colors, n, 0, 1, 2, k)
                    start, step, part = channel_plane(*values, e1, e2, step1, step2)
                    color += channel_code(start, step, part, inverse, 0) << (8 * k)
                blend_over(pixels[y_start + j], x_start + i, color, ONE, is_linear)
            lists[j, i, 0] = 0


def crop(screen: ScreenTriangles, sampling: Sampling) -> tuple[ScreenTriangles, Sampling, int, int] | None:
    """Return triangles and the rectangle about them, moved to its corner, and where that was; None if there is nothing in it.

    Many triangles are left where they are: to move them costs more than to look at all pixels.
    """
    s = sampling.subpixel_bits
    if len(screen.corners) > SMALL:
        return screen, sampling, 0, 0
    if not len(screen.xy):
        return None
    low, high = screen.xy.min(axis=0) >> s, (screen.xy.max(axis=0) >> s) + 1
    x_start, y_start = max(int(low[0]), 0), max(int(low[1]), 0)
    x_end, y_end = min(int(high[0]), sampling.x_end), min(int(high[1]), sampling.y_end)
    if x_start >= x_end or y_start >= y_end:
        return None
    if x_start or y_start:
        screen, sampling = screen._replace(xy=screen.xy - (np.array([x_start, y_start]) << s)), move(sampling, x_start, y_start)
    return screen, sampling._replace(x_end=x_end - x_start, y_end=y_end - y_start), x_start, y_start


def move(sampling: Sampling, x: int, y: int) -> Sampling:
    """Return a sampling whose off-screen point, where the rule has one, is seen from a pixel; a direction stays."""
    s, w = sampling.subpixel_bits, sampling.rule_w
    return sampling._replace(rule_x=sampling.rule_x - (x << s) * w, rule_y=sampling.rule_y - (y << s) * w)


def are_shaded_in_place(vertices: Array, colors: Array, sampling: Sampling) -> bool:
    """Say whether triangles are so small that they are best coloured where they are drawn, and can be: colours are exact."""
    if colors.dtype != np.uint8:
        return False
    is_sure, mean = measure_triangles(vertices, sampling.subpixel_bits)
    return is_sure and mean <= SMALL_BOX


def paint_numbers(
    pixels: UInt8Array, vertices: Float64Array, colors: Array, algorithm: str, sampling: Sampling, threads: int
) -> None:
    """Paint opaque triangles by number, then colour what is seen of them; the parameters are those of paint_opaque."""
    found = crop(screen_triangles(vertices, sampling.subpixel_bits), sampling)
    if found is None:
        return
    screen, within, x_start, y_start = found
    numbers, words = np.zeros((within.y_end, within.x_end), np.int32), pixels.view(np.int32)[..., 0]
    screen = screen._replace(depth=np.repeat(np.arange(1.0, len(colors) + 1.0), 3))
    passes = count_passes(screen, within, numbers.nbytes)
    run_kernel(PAINTERS[algorithm]["opaque"], numbers, screen, within, threads, passes)

    def color_band(row: int, row_end: int, stop: Event) -> None:
        """Colour the rows of one band."""
        color_rows(words, numbers, (x_start, y_start), (row, row_end), vertices, colors, sampling)

    run_bands(color_band, within.y_end, 1 if numbers.size < SMALL_IMAGE else threads)


def paint_opaque(pixels: UInt8Array, vertices: Array, colors: Array, algorithm: str, sampling: Sampling, threads: int) -> None:
    """Paint opaque triangles with colours at their corners over pixels, in order.

    Half-space has two ways. Small triangles are coloured where they are drawn: to find out what is seen of them costs more than
    to colour all. Others are drawn by number, a band of rows at a time, which stays in the cache until it is coloured.

    Parameters
    ----------
    pixels : (H, W, 4).
    vertices : (N, 3, 2) corners in pixels, float32 or float64, checked.
    colors : (N, 3, 3) or (N, 3, 4), uint8, or float64 0..255.
    algorithm : a name of PAINTERS.
    sampling : of the whole image.
    threads : how many share the rows.
    """
    if algorithm != "half-space":
        paint_numbers(pixels, in_layout(vertices, np.float64), colors, algorithm, sampling, threads)
        return
    words, count = pixels.view(np.int32)[..., 0], len(vertices)
    if are_shaded_in_place(vertices, colors, sampling):
        run_flat(shaded_words, words, vertices, colors, sampling, threads)
        return
    vertices = in_layout(vertices, np.float64)
    following, is_deep = np.arange(1, count + 1, dtype=np.int32), lie_deep(vertices, words.shape)

    def paint_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        numbers = np.zeros((y_end - y_start, words.shape[1]), np.int32)
        fill_rows(numbers, vertices, following, sampling._replace(y_start=y_start, y_end=y_end), is_deep, stop)
        if not stop.is_set():
            color_rows(words, numbers, (0, y_start), (0, len(numbers)), vertices, colors, sampling)

    share_rows(paint_band, words.shape, vertices, threads, -(-words.nbytes // BAND_BYTES))


def paint_translucent(
    pixels: UInt8Array, vertices: Float64Array, colors: Array, algorithm: str, sampling: Sampling, is_linear: bool,
    threads: int,
) -> None:  # fmt: skip
    """Paint triangles with colours at their corners that let through, in order; the parameters are those of paint_opaque."""
    found = crop(screen_triangles(vertices, sampling.subpixel_bits), sampling)
    if found is None:
        return
    screen, sampling, x_start, y_start = found
    width, count = sampling.x_end, len(colors)

    def paint_band(row: int, row_end: int, stop: Event) -> None:
        """Paint the rows of one band, as many triangles at once as the lists have room for."""
        moved = screen._replace(xy=screen.xy - np.array([0, row << sampling.subpixel_bits]))
        within, counters = move(sampling, 0, row)._replace(y_end=row_end - row), np.zeros(COUNTERS, np.int64)
        lists, waiting = np.zeros((row_end - row, width, LISTED + 1), np.int32), [(0, count)]
        while waiting and not stop.is_set():
            first, last = waiting.pop()
            LISTERS[algorithm](lists, counters, moved, first, last, within)
            if last - first > LISTED and int(lists[..., 0].max()) > LISTED:
                lists[..., 0] = 0
                middle = (first + last) // 2
                waiting += [(middle, last), (first, middle)]
            else:
                lay_lists(pixels, lists, x_start, y_start + row, moved.xy, colors, within, int(is_linear))

    area = width * sampling.y_end
    size = LIST_BYTES * max(1, count >> 16)  # larger bands for many triangles, as each band looks at all
    run_bands(paint_band, sampling.y_end, 1 if area < SMALL_IMAGE else threads, -(-area * (LISTED + 1) * 4 // size))


def paint_gouraud(
    pixels: UInt8Array, vertices: Array, colors: Array, algorithm: str, sampling: Sampling, is_opaque: bool, is_linear: bool,
    threads: int,
) -> None:  # fmt: skip
    """Paint triangles with colours at their corners over pixels, in order; the parameters are those of paint_opaque."""
    if is_opaque:
        paint_opaque(pixels, vertices, colors, algorithm, sampling, threads)
    else:
        paint_translucent(pixels, in_layout(vertices, np.float64), colors, algorithm, sampling, is_linear, threads)
