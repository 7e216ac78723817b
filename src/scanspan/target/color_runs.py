"""Colour a picture of numbers: each run of pixels of one triangle by the planes of its three channels.

Where triangles are seen in runs of a few pixels, what a run costs is to get ready for it. So the planes of a triangle are kept,
as values at its first corner and steps from there, and the rows below find them. There is a place for each of some thousand
triangles, chosen by the lowest bits of its number; one that finds another there takes its place. All values are sums of whole
numbers that float64 holds, so it makes no difference from which point they are counted. Triangles that are too large for that,
and colours that are no whole numbers, are worked out for each run from edge values, which are exact (planes.py).
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import to_grid
from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.lanes import whole_vectors
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling
from scanspan.target.planes import (
    OPAQUE,
    SURE,
    channel_code,
    channel_plane,
    corner_values,
    pack_word,
    start_planes,
    sure_code,
)  # fmt: skip

KEPT = 1 << 12  # triangles whose planes are kept

# Numbers of a record: the first corner, the inverse of twice the area or 0 where sums may not be exact; and from PLANES on, for
# each channel, what it changes by with a sub-pixel right and down, times twice the area, and its part of a code.
INVERSE, PLANES, PLANE, FIELDS = 2, 3, 3, 12


def room_for_planes() -> tuple[Float64Array, Int64Array]:
    """Return places for the planes of triangles, and the numbers of those that have one, -1 for none."""
    return np.empty(KEPT * FIELDS), np.full(KEPT, -1, np.int64)


@bare_kernel
def keep_planes(vertices: Float64Array, colors: Array, n: Integer, scale: float, kept: Float64Array, start: Integer) -> None:
    """Write the planes of triangle n to the place that begins at start."""
    at = np.uint64(start)
    p_x, p_y = to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale)
    q_x, q_y = np.float64(to_grid(vertices[n, 1, 0], scale) - p_x), np.float64(to_grid(vertices[n, 1, 1], scale) - p_y)
    r_x, r_y = np.float64(to_grid(vertices[n, 2, 0], scale) - p_x), np.float64(to_grid(vertices[n, 2, 1], scale) - p_y)
    kept[at], kept[at + np.uint64(1)] = np.float64(p_x), np.float64(p_y)
    kept[at + np.uint64(INVERSE)] = 0.0
    low_x, high_x, low_y, high_y = min(q_x, r_x, 0.0), max(q_x, r_x, 0.0), min(q_y, r_y, 0.0), max(q_y, r_y, 0.0)
    if max(high_x - low_x, high_y - low_y) >= SURE:
        return
    kept[at + np.uint64(INVERSE)] = 1.0 / (q_x * r_y - q_y * r_x)
    for k in range(3):
        plane = at + np.uint64(PLANES + PLANE * k)
        kept[plane], kept[plane + np.uint64(1)], kept[plane + np.uint64(2)] = channel_plane(
            *corner_values(colors, n, 0, 1, 2, k), r_y, -q_y, -r_x, q_x
        )


@bare_helper
def color_far_run(
    row: Int32Array, vertices: Float64Array, colors: Array, n: Integer, x: Integer, y: Integer, scale: float, sampling: Sampling
) -> None:
    """Colour a run of pixels, the first of which is (x, y), by the edge values of triangle n there."""
    e1, e2, step1, step2, inverse = start_planes(
        to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale), to_grid(vertices[n, 1, 0], scale),
        to_grid(vertices[n, 1, 1], scale), to_grid(vertices[n, 2, 0], scale), to_grid(vertices[n, 2, 1], scale), x, y, sampling,
    )  # fmt: skip
    red, red_step, red_part = channel_plane(*corner_values(colors, n, 0, 1, 2, 0), e1, e2, step1, step2)
    green, green_step, green_part = channel_plane(*corner_values(colors, n, 0, 1, 2, 1), e1, e2, step1, step2)
    blue, blue_step, blue_part = channel_plane(*corner_values(colors, n, 0, 1, 2, 2), e1, e2, step1, step2)
    for k in range(row.shape[0]):
        word = (
            channel_code(red, red_step, red_part, inverse, k)
            + (channel_code(green, green_step, green_part, inverse, k) << 8)
            + (channel_code(blue, blue_step, blue_part, inverse, k) << 16)
        )
        row[k] = np.int32(word - OPAQUE)


@bare_kernel
def color_numbers(
    words: Int32Array, numbers: Int32Array, x_start: int, y_start: int, rows: int, row_end: int, vertices: Float64Array,
    colors: Array, kept: Float64Array, tags: Int64Array, is_whole: bool, sampling: Sampling,
) -> None:  # fmt: skip
    """Colour some rows of pixels by the triangles that they show.

    Shapes  words: (H, W), contiguous, written where numbers is not 0; numbers: (h, w), one more than a triangle's number, of
            the pixels from (x_start, y_start) on; vertices: (N, 3, 2) in pixels; colors: (N, 3, 3) or (N, 3, 4); kept, tags:
            from room_for_planes; is_whole: whether the colours are whole numbers up to 255.
    Units   rows to row_end: rows of numbers.
    Cost    a run is coloured in whole vectors: most are shorter than one.
    """
    width, s = np.int64(numbers.shape[1]), np.int64(sampling.subpixel_bits)
    scale = np.float64(np.int64(1) << s)
    flat, across = words.reshape(words.shape[0] * words.shape[1]), np.int64(words.shape[1])
    one, two = np.uint64(1), np.uint64(2)
    for j in range(rows, row_end):
        i, y, start = np.int64(0), ((y_start + np.int64(j)) << s) + sampling.sample_y, (y_start + j) * across + x_start
        while i < width:
            # Find a run of pixels of one triangle.
            number = numbers[j, np.uint64(i)]
            if number == 0:
                i += 1
                continue
            end = i + 1
            while end < width and numbers[j, np.uint64(end)] == number:
                end += 1

            # Find its planes.
            n, length = np.int64(number) - 1, end - i
            place = n & (KEPT - 1)
            at = np.uint64(place * FIELDS)
            if tags[place] != n:
                keep_planes(vertices, colors, n, scale, kept, place * FIELDS)
                kept[at + two] = kept[at + two] if is_whole else 0.0
                tags[place] = n
            inverse = kept[at + two]
            if inverse == 0.0:
                row = flat[start + i : start + end]
                color_far_run(row, vertices, colors, n, x_start + i, y_start + np.int64(j), scale, sampling)
                i = end
                continue

            # Colour it.
            right = np.float64(((x_start + i) << s) + sampling.sample_x) - kept[at]
            down = np.float64(y) - kept[at + one]
            red_at = at + np.uint64(PLANES)
            green_at, blue_at = red_at + np.uint64(PLANE), red_at + np.uint64(2 * PLANE)
            red, red_step = right * kept[red_at] + down * kept[red_at + one], kept[red_at] * scale
            green, green_step = right * kept[green_at] + down * kept[green_at + one], kept[green_at] * scale
            blue, blue_step = right * kept[blue_at] + down * kept[blue_at + one], kept[blue_at] * scale
            red_part, green_part, blue_part = kept[red_at + two], kept[green_at + two], kept[blue_at + two]
            padded = whole_vectors(length)
            row = flat[start + i : start + i + padded]
            for k in range(padded):
                if k < length:
                    row[k] = pack_word(
                        sure_code(red, red_step, red_part, inverse, k), sure_code(green, green_step, green_part, inverse, k),
                        sure_code(blue, blue_step, blue_part, inverse, k),
                    )  # fmt: skip
            i = end


def color_rows(
    words: Int32Array, numbers: Int32Array, corner: tuple[int, int], rows: tuple[int, int], vertices: Float64Array,
    colors: Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Colour some rows of pixels by the triangles that they show; see color_numbers.

    Parameters
    ----------
    words : (H, W) pixels.
    numbers : (h, w), of the pixels from `corner` on.
    corner : (x, y), the pixel that the first of `numbers` tells of.
    rows : the first and the one after the last, of `numbers`.
    vertices, colors : (N, 3, 2) and (N, 3, 3 or 4).
    sampling : of the whole image.
    """
    color_numbers(
        words, numbers, *corner, *rows, vertices, colors, *room_for_planes(), colors.dtype == np.uint8, sampling
    )  # fmt: skip
