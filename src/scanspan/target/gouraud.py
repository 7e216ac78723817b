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
from scanspan.raster.flat import as_given, one_row, scan_flat
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.micropolygon import micropolygon
from scanspan.raster.setup import keep_sample
from scanspan.raster.warnock import HIDES_NOTHING, warnock
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.target.blend import ONE, blend_over
from scanspan.target.color_runs import color_rows
from scanspan.target.paint import PAINTERS
from scanspan.target.planes import (
    OPAQUE,
    SHADE_LANES,
    channel_code,
    channel_plane,
    corner_values,
    start_planes,
    sure_code,
)
from scanspan.target.triangles import fill_rows, lie_deep, measure_triangles, run_flat, share_rows

LISTED = 15  # triangles that a pixel's list has room for; with their number it is a line of the cache
LIST_BYTES = 1 << 21  # of the lists of one band; they stay in the cache
BAND_BYTES = 1 << 20  # of the numbers of one band
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
def start_shade(
    colors: Array, n: Integer, p: Integer, q: Integer, r: Integer, e1: Integer, e2: Integer, f1: Integer, f2: Integer,
    a1: Integer, a2: Integer, b1: Integer, b2: Integer, area: Integer, subpixel_bits: int,
) -> Any:  # fmt: skip
    """Return the planes of the three channels over a box, from the edges that scan_flat has at its first sample."""
    start1, start2 = np.float64(e1), np.float64(e2)
    right1, right2 = np.float64(a1 << subpixel_bits), np.float64(a2 << subpixel_bits)
    down1, down2 = np.float64(b1 << subpixel_bits), np.float64(b2 << subpixel_bits)
    reds, greens, blues = (
        corner_values(colors, n, p, q, r, 0), corner_values(colors, n, p, q, r, 1), corner_values(colors, n, p, q, r, 2),
    )  # fmt: skip
    red, red_right, red_base, red_part = channel_plane(*reds, start1, start2, right1, right2)
    green, green_right, green_base, green_part = channel_plane(*greens, start1, start2, right1, right2)
    blue, blue_right, blue_base, blue_part = channel_plane(*blues, start1, start2, right1, right2)
    red_down = channel_plane(*reds, down1, down2, 0.0, 0.0)[0]
    green_down = channel_plane(*greens, down1, down2, 0.0, 0.0)[0]
    blue_down = channel_plane(*blues, down1, down2, 0.0, 0.0)[0]
    return (
        1.0 / np.float64(area), red, red_right, red_down, red_base, red_part, green, green_right, green_down, green_base,
        green_part, blue, blue_right, blue_down, blue_base, blue_part,
    )  # fmt: skip


@bare_helper
def shade_word(shade: Any, i: Integer, j: Integer) -> np.int32:
    """Return the colour of a pixel of a box, (i, j) from its first."""
    (
        inverse, red, red_right, red_down, red_base, red_part, green, green_right, green_down, green_base, green_part, blue,
        blue_right, blue_down, blue_base, blue_part,
    ) = shade  # fmt: skip
    y = np.float64(j)
    word = (
        sure_code(red + y * red_down, red_right, red_base, red_part, inverse, i)
        + (sure_code(green + y * green_down, green_right, green_base, green_part, inverse, i) << 8)
        + (sure_code(blue + y * blue_down, blue_right, blue_base, blue_part, inverse, i) << 16)
    )
    return np.int32(word - OPAQUE)


@bare_helper
def write_shade(row: Int32Array, q: int, inside: bool, shade: Any, i: Integer, j: Integer) -> None:
    """Colour one pixel of a box; a masked store, as of flat colours."""
    word = shade_word(shade, i, j)
    if inside:
        row[q] = word


@bare_kernel
def shaded_words(
    target: Int32Array, vertices: Float64Array, colors: UInt8Array, room: Int64Array, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H, W) words of 32 bits, shaded between the corners. Needs: sums of edge values times colours fit."""
    flat, width = target.reshape(target.shape[0] * target.shape[1]), np.int64(target.shape[1])
    scan_flat(
        as_given, start_shade, write_shade, one_row, SHADE_LANES, flat, width, vertices, colors, room, top, first, last,
        sampling,
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
                    start, step, base, part = channel_plane(*values, e1, e2, step1, step2)
                    color += channel_code(start, step, base, part, inverse, 0) << (8 * k)
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
