"""Gouraud on a canvas: triangles whose corners have colours of their own.

Numbers first, colours after. The traversals write which triangle a pixel shows, with the writers that paint flat colours: a
colour is a whole number, and so is a triangle's number. Then each run of pixels of one triangle is coloured by plane equations,
from exact edge values; what is hidden costs no colour. So every algorithm gives the same bits, and none knows of colours.

What lets through has to be laid over what is below it, in order. There, the traversals leave in each pixel a list of the
triangles that cover it, and the lists are gone through afterwards. They have room for a few; where a pixel has more, the
triangles are taken in two halves, one after the other.

A channel is u0 + (E1 (u1 - u0) + E2 (u2 - u0)) / 2A, rounded half up once. The sum is exact in float64 for 8-bit colours and
triangles of up to 2^23 px, and so is the rounding: ties lie further from their neighbours than the margin that makes up for the
product with 1 / 2A. Channels that are constant over a triangle come out exactly constant, whatever its size.

Source: Gouraud 1971; the plane equations of the lectures.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event
from typing import Any

import numpy as np

from scanspan.geometry.fixed_point import halves_float, product_halves, to_grid
from scanspan.geometry.project import screen_triangles
from scanspan.jit import bare_helper, bare_kernel, kernel
from scanspan.raster.algorithms import SMALL, SMALL_IMAGE, count_passes, run_bands, run_kernel
from scanspan.raster.counters import COUNTERS
from scanspan.raster.edge_walk import edge_walk
from scanspan.raster.flat import scan_flat
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.micropolygon import micropolygon
from scanspan.raster.setup import NEAR, keep_sample
from scanspan.raster.warnock import HIDES_NOTHING, warnock
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.target.blend import ONE, blend_over
from scanspan.target.paint import PAINTERS
from scanspan.target.triangles import fill_rows, lie_deep, measure_boxes, run_flat, share_rows

LISTED = 15  # triangles that a pixel's list has room for; with their number it is a line of the cache
LIST_BYTES = 1 << 21  # of the lists of one band; they stay in the cache
BAND_BYTES = 1 << 20  # of the numbers of one band
SURE = float(1 << 21)  # sub-pixels along a side, below which sums of edge values times 8-bit colours are exact in float64
SMALL_BOX = 400.0  # pixels in the mean box, up to which triangles are coloured where they are drawn
SHADE_LANES = np.int64(8)  # channels are worked out in float64, and a vector has 64 bytes
OPAQUE = np.int64(1 << 24)  # less this, a word of three channels has an alpha of 255
MARGIN = 2.0**-41  # above the error of a channel, below the distance of a value from a tie that it does not meet


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
def exact_value(a: Integer, b: Integer, dx: Integer, dy: Integer, is_near: bool | np.bool_) -> float:
    """Return a dx + b dy, rounded once to float64 where it does not fit. Needs: is_near is true only if it fits an int64."""
    if is_near:
        return np.float64(a * dx + b * dy)
    high, low = product_halves(a, b, dx, dy)
    return halves_float(high, low)


@bare_helper
def start_planes(
    p_x: Integer, p_y: Integer, q_x: Integer, q_y: Integer, r_x: Integer, r_y: Integer, i: Integer, j: Integer,
    sampling: Sampling,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return two edge values of a triangle at a pixel's sample, how they step to the next pixel, and the inverse of 2A."""
    s = sampling.subpixel_bits
    x, y = (i << s) + sampling.sample_x, (j << s) + sampling.sample_y
    a1, b1, a2, b2 = r_y - p_y, p_x - r_x, p_y - q_y, q_x - p_x
    dx, dy = x - p_x, y - p_y
    is_near = max(dx, -dx, dy, -dy, a1, -a1, b1, -b1, a2, -a2, b2, -b2) < NEAR
    e1, e2 = exact_value(a1, b1, dx, dy, is_near), exact_value(a2, b2, dx, dy, is_near)
    area = exact_value(a2, b2, r_x - p_x, r_y - p_y, is_near)
    return e1, e2, np.float64(a1 << s), np.float64(a2 << s), 1.0 / area


@bare_helper
def channel_plane(
    colors: Array, n: Integer, k: int, e1: float, e2: float, step1: float, step2: float
) -> tuple[float, float, float, float]:
    """Return a channel of a run of pixels as base + floor((start + i step) / 2A + part)."""
    u0 = np.float64(colors[n, 0, k])
    d1, d2 = np.float64(colors[n, 1, k]) - u0, np.float64(colors[n, 2, k]) - u0
    base = np.floor(u0 + 0.5)
    return e1 * d1 + e2 * d2, step1 * d1 + step2 * d2, base, (u0 + 0.5 - base) + MARGIN


@bare_helper
def channel_code(start: float, step: float, base: float, part: float, inverse: float, i: Integer) -> Integer:
    """Return a channel's code at pixel i of a run."""
    return np.int64(min(max(base + np.floor((start + np.float64(i) * step) * inverse + part), 0.0), 255.0))


@bare_helper
def start_shade(
    colors: Array, n: int, e1: Integer, e2: Integer, a1: Integer, a2: Integer, b1: Integer, b2: Integer, area: Integer,
    subpixel_bits: int,
) -> Any:  # fmt: skip
    """Return the planes of the three channels over a box, from the edges that scan_flat has at its first sample."""
    start1, start2 = np.float64(e1), np.float64(e2)
    right1, right2 = np.float64(a1 << subpixel_bits), np.float64(a2 << subpixel_bits)
    down1, down2 = np.float64(b1 << subpixel_bits), np.float64(b2 << subpixel_bits)
    red, red_right, red_base, red_part = channel_plane(colors, n, 0, start1, start2, right1, right2)
    green, green_right, green_base, green_part = channel_plane(colors, n, 1, start1, start2, right1, right2)
    blue, blue_right, blue_base, blue_part = channel_plane(colors, n, 2, start1, start2, right1, right2)
    red_down = channel_plane(colors, n, 0, down1, down2, 0.0, 0.0)[0]
    green_down = channel_plane(colors, n, 1, down1, down2, 0.0, 0.0)[0]
    blue_down = channel_plane(colors, n, 2, down1, down2, 0.0, 0.0)[0]
    return (
        1.0 / np.float64(area), red, red_right, red_down, red_base, red_part, green, green_right, green_down, green_base,
        green_part, blue, blue_right, blue_down, blue_base, blue_part,
    )  # fmt: skip


@bare_helper
def write_shade(row: Int32Array, q: int, inside: bool, shade: Any, i: Integer, j: Integer) -> None:
    """Colour one pixel of a box, (i, j) from its first; a masked store, as of flat colours."""
    (
        inverse, red, red_right, red_down, red_base, red_part, green, green_right, green_down, green_base, green_part, blue,
        blue_right, blue_down, blue_base, blue_part,
    ) = shade  # fmt: skip
    y = np.float64(j)
    word = (
        channel_code(red + y * red_down, red_right, red_base, red_part, inverse, i)
        + (channel_code(green + y * green_down, green_right, green_base, green_part, inverse, i) << 8)
        + (channel_code(blue + y * blue_down, blue_right, blue_base, blue_part, inverse, i) << 16)
    )
    if inside:
        row[q] = np.int32(word - OPAQUE)


@bare_kernel
def shaded_words(
    target: Int32Array, vertices: Float64Array, colors: UInt8Array, ends: Int64Array, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H, W) words of 32 bits, shaded between the corners. Needs: sums of edge values times colours fit."""
    scan_flat(start_shade, write_shade, SHADE_LANES, target, vertices, colors, ends, top, first, last, sampling)


@bare_kernel
def color_numbers(
    words: Int32Array, numbers: Int32Array, x_start: int, y_start: int, rows: int, row_end: int, vertices: Float64Array,
    colors: Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Colour some rows of pixels by the triangles that they show.

    Shapes  words: (H, W), contiguous, written where numbers is not 0; numbers: (h, w), one more than a triangle's number, of
            the pixels from (x_start, y_start) on; vertices: (N, 3, 2) in pixels; colors: (N, 3, 3) or (N, 3, 4).
    Units   rows to row_end: rows of numbers.
    Cost    a run is coloured in whole vectors: most are shorter than one.
    """
    width, scale = numbers.shape[1], np.float64(np.int64(1) << sampling.subpixel_bits)
    flat, across = words.reshape(words.shape[0] * words.shape[1]), np.int64(words.shape[1])
    for j in range(rows, row_end):
        i = np.int64(0)
        while i < width:
            # Find a run of pixels of one triangle.
            number = numbers[j, i]
            if number == 0:
                i += 1
                continue
            end = i + 1
            while end < width and numbers[j, end] == number:
                end += 1

            # Colour it.
            n, length = np.int64(number) - 1, end - i
            e1, e2, step1, step2, inverse = start_planes(
                to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale), to_grid(vertices[n, 1, 0], scale),
                to_grid(vertices[n, 1, 1], scale), to_grid(vertices[n, 2, 0], scale), to_grid(vertices[n, 2, 1], scale),
                x_start + i, y_start + np.int64(j), sampling,
            )  # fmt: skip
            red, red_step, red_base, red_part = channel_plane(colors, n, 0, e1, e2, step1, step2)
            green, green_step, green_base, green_part = channel_plane(colors, n, 1, e1, e2, step1, step2)
            blue, blue_step, blue_base, blue_part = channel_plane(colors, n, 2, e1, e2, step1, step2)
            start, padded = (y_start + j) * across + x_start + i, (length + (SHADE_LANES - 1)) & -SHADE_LANES
            row = flat[start : start + padded]
            for k in range(padded):
                word = (
                    channel_code(red, red_step, red_base, red_part, inverse, k)
                    + (channel_code(green, green_step, green_base, green_part, inverse, k) << 8)
                    + (channel_code(blue, blue_step, blue_base, blue_part, inverse, k) << 16)
                )
                if k < length:
                    row[k] = np.int32(word - OPAQUE)
            i = end


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
                    start, step, base, part = channel_plane(colors, n, k, e1, e2, step1, step2)
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
        color_numbers(words, numbers, x_start, y_start, row, row_end, vertices, colors, sampling)

    run_bands(color_band, within.y_end, 1 if numbers.size < SMALL_IMAGE else threads)


def paint_opaque(
    pixels: UInt8Array, vertices: Float64Array, colors: Array, algorithm: str, sampling: Sampling, threads: int
) -> None:
    """Paint opaque triangles with colours at their corners over pixels, in order.

    Half-space has two ways. Small triangles are coloured where they are drawn: to find out what is seen of them costs more than
    to colour all. Others are drawn by number, a band of rows at a time, which stays in the cache until it is coloured.

    Parameters
    ----------
    pixels : (H, W, 4).
    vertices : (N, 3, 2) corners in pixels, checked.
    colors : (N, 3, 3) or (N, 3, 4), uint8, or float64 0..255.
    algorithm : a name of PAINTERS.
    sampling : of the whole image.
    threads : how many share the rows.
    """
    if algorithm != "half-space":
        paint_numbers(pixels, vertices, colors, algorithm, sampling, threads)
        return
    words, count = pixels.view(np.int32)[..., 0], len(vertices)
    longest, total = measure_boxes(vertices, np.inf, np.inf)
    if colors.dtype == np.uint8 and longest * (1 << sampling.subpixel_bits) < SURE and total <= SMALL_BOX * count:
        run_flat(shaded_words, words, vertices, colors, sampling, threads)
        return
    following, is_deep = np.arange(1, count + 1, dtype=np.int32), lie_deep(vertices, words.shape)

    def paint_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        numbers = np.zeros((y_end - y_start, words.shape[1]), np.int32)
        fill_rows(numbers, vertices, following, sampling._replace(y_start=y_start, y_end=y_end), is_deep, stop)
        if not stop.is_set():
            color_numbers(words, numbers, 0, y_start, 0, len(numbers), vertices, colors, sampling)

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
    pixels: UInt8Array, vertices: Float64Array, colors: Array, algorithm: str, sampling: Sampling, is_opaque: bool,
    is_linear: bool, threads: int,
) -> None:  # fmt: skip
    """Paint triangles with colours at their corners over pixels, in order; the parameters are those of paint_opaque."""
    if is_opaque:
        paint_opaque(pixels, vertices, colors, algorithm, sampling, threads)
    else:
        paint_translucent(pixels, vertices, colors, algorithm, sampling, is_linear, threads)
