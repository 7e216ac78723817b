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

import numpy as np

from scanspan.jit import bare_helper, bare_kernel, kernel
from scanspan.raster.algorithms import SMALL, SMALL_IMAGE, count_passes, run_bands, run_kernel
from scanspan.raster.counters import COUNTERS
from scanspan.raster.edge_walk import edge_walk
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.micropolygon import micropolygon
from scanspan.raster.setup import keep_sample
from scanspan.raster.warnock import HIDES_NOTHING, warnock
from scanspan.records import Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.shade.interpolate import edge_value
from scanspan.target.blend import ONE, blend_over
from scanspan.target.paint import PAINTERS

LISTED = 15  # triangles that a pixel's list has room for; with their number it is a line of the cache
LIST_BYTES = 1 << 21  # of the lists of one band; they stay in the cache
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
def start_planes(
    xy: Int64Array, n: Integer, i: Integer, j: Integer, sampling: Sampling
) -> tuple[float, float, float, float, float]:
    """Return two edge values of a triangle at a pixel's sample, how they step to the next pixel, and the inverse of 2A."""
    s, p, q, r = sampling.subpixel_bits, 3 * n, 3 * n + 1, 3 * n + 2
    x, y = (i << s) + sampling.sample_x, (j << s) + sampling.sample_y
    e1 = edge_value(xy[r, 0], xy[r, 1], xy[p, 0], xy[p, 1], x, y)
    e2 = edge_value(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], x, y)
    area = edge_value(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1])
    step1, step2 = np.float64((xy[r, 1] - xy[p, 1]) << s), np.float64((xy[p, 1] - xy[q, 1]) << s)
    return e1, e2, step1, step2, 1.0 / area


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


@bare_kernel
def color_numbers(
    words: Int32Array, numbers: Int32Array, x_start: int, y_start: int, rows: int, row_end: int, xy: Int64Array, colors: Array,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Colour some rows of pixels by the triangles that they show.

    Shapes  words: (H, W), written where numbers is not 0; numbers: (h, w), one more than a triangle's number, of the pixels
            from (x_start, y_start) on; xy: (3 N, 2) corners, from there too; colors: (N, 3, 3) or (N, 3, 4).
    Units   rows to row_end: rows of numbers.
    """
    width = numbers.shape[1]
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
            n = np.int64(number) - 1
            e1, e2, step1, step2, inverse = start_planes(xy, n, i, np.int64(j), sampling)
            red, red_step, red_base, red_part = channel_plane(colors, n, 0, e1, e2, step1, step2)
            green, green_step, green_base, green_part = channel_plane(colors, n, 1, e1, e2, step1, step2)
            blue, blue_step, blue_base, blue_part = channel_plane(colors, n, 2, e1, e2, step1, step2)
            row = words[y_start + j, x_start + i : x_start + end]
            for k in range(row.shape[0]):
                row[k] = np.int32(
                    channel_code(red, red_step, red_base, red_part, inverse, k)
                    + (channel_code(green, green_step, green_base, green_part, inverse, k) << 8)
                    + (channel_code(blue, blue_step, blue_base, blue_part, inverse, k) << 16)
                    - (np.int64(1) << 24)
                )
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
                e1, e2, step1, step2, inverse = start_planes(xy, n, np.int64(i), np.int64(j), sampling)
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


def paint_opaque(
    pixels: UInt8Array, screen: ScreenTriangles, colors: Array, algorithm: str, sampling: Sampling, threads: int
) -> None:
    """Paint opaque triangles with colours at their corners over pixels, in order.

    Parameters
    ----------
    pixels : (H, W, 4).
    screen : from screen_triangles, N of them.
    colors : (N, 3, 3) or (N, 3, 4), uint8, or float64 0..255.
    algorithm : a name of PAINTERS.
    sampling : of the whole image.
    threads : how many share the rows.
    """
    found = crop(screen, sampling)
    if found is None:
        return
    screen, sampling, x_start, y_start = found
    numbers, words = np.zeros((sampling.y_end, sampling.x_end), np.int32), pixels.view(np.int32)[..., 0]
    screen = screen._replace(depth=np.repeat(np.arange(1.0, len(colors) + 1.0), 3))
    passes = count_passes(screen, sampling, numbers.nbytes)
    run_kernel(PAINTERS[algorithm]["opaque"], numbers, screen, sampling, threads, passes)

    def color_band(row: int, row_end: int, stop: Event) -> None:
        """Colour the rows of one band."""
        color_numbers(words, numbers, x_start, y_start, row, row_end, screen.xy, colors, sampling)

    run_bands(color_band, sampling.y_end, 1 if numbers.size < SMALL_IMAGE else threads)


def paint_translucent(
    pixels: UInt8Array, screen: ScreenTriangles, colors: Array, algorithm: str, sampling: Sampling, is_linear: bool,
    threads: int,
) -> None:  # fmt: skip
    """Paint triangles with colours at their corners that let through, in order; the parameters are those of paint_opaque."""
    found = crop(screen, sampling)
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
    pixels: UInt8Array, screen: ScreenTriangles, colors: Array, algorithm: str, sampling: Sampling, is_opaque: bool,
    is_linear: bool, threads: int,
) -> None:  # fmt: skip
    """Paint triangles with colours at their corners over pixels, in order; the parameters are those of paint_opaque."""
    if is_opaque:
        paint_opaque(pixels, screen, colors, algorithm, sampling, threads)
    else:
        paint_translucent(pixels, screen, colors, algorithm, sampling, is_linear, threads)
