"""The last first: opaque triangles drawn from the last to the first, each into what none after it covers.

Where triangles lie over each other many deep, most of what a painter paints is painted over. Drawn backwards, every pixel is
written once, by the one triangle that is seen there; the picture is the same. What is taken already is known by a bit for each
pixel, 32 in a word, and by a count for each tile of 32 words: where all tiles below 32 rows of a triangle are full, these rows
are done with at once. The bits cost more than they save unless triangles are large and lie some sixteen deep.

Source: E. Catmull 1984 for visibility by what is still open; Greene 1996 for masks with a coarser level above them.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import to_grid
from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.flat import ZERO, cut_rows
from scanspan.raster.setup import set_up_edges
from scanspan.records import Array, Int32Array, Int64Array, Integer, Sampling

WORD = np.int64(32)  # pixels in a word, and rows in a tile
ONE = np.int64(1)
FULL = np.int64((1 << 32) - 1)


def room_for_bits(height: int, width: int) -> tuple[Int64Array, Int64Array]:
    """Return the bits of an image that is all open, (height, words), and how many words of each tile are, (tiles, words)."""
    words, rows = -(-width // int(WORD)), np.arange(0, height, int(WORD))
    taken = np.zeros((height, words), np.int64)
    taken[:, -1] = int(FULL) & ~((1 << (width - (words - 1) * int(WORD))) - 1)
    return taken, np.repeat(np.minimum(height - rows, int(WORD))[:, None], words, axis=1).astype(np.int64)


@bare_helper
def take_span(
    flat: Int32Array, start: Integer, taken: Int64Array, still_open: Int64Array, y: Integer, left: Integer, right: Integer,
    value: np.int32,
) -> None:  # fmt: skip
    """Write a value to the pixels of a span that are still open, and close them.

    Shapes  flat: the target in one row; start: where row y begins in it; taken, still_open: from room_for_bits.
    Units   left, right: pixels, half-open.
    """
    for w in range(left // WORD, (right + (WORD - 1)) // WORD):
        x = w * WORD
        low, high = max(left - x, ZERO), min(right - x, WORD)
        before = taken[y, w]
        wanted = ((ONE << high) - (ONE << low)) & ~before
        if wanted == 0:
            continue
        taken[y, w] = before | wanted
        if before | wanted == FULL:
            still_open[y // WORD, w] -= 1
        row = flat[start + x : start + x + WORD]
        for k in range(WORD):
            if (wanted >> k) & 1 != 0:
                row[k] = value


@bare_kernel
def covered_words(
    target: Int32Array, vertices: Array, values: Int32Array, room: Int64Array, taken: Int64Array, still_open: Int64Array,
    top: int, first: int, last: int, sampling: Sampling,
) -> None:  # fmt: skip
    """Write the values of triangles last - 1 down to first to the samples that they cover and that are still open.

    Shapes  target: (H, W), contiguous, whose first row is row `top` of the image; vertices: (N, 3, 2); values: (N,);
            room: (2, H) or more, to work in; taken, still_open: from room_for_bits.
    Units   vertices in pixels, within 2^24 of 0.
    Rule    sampling.rule; samples decide.
    """
    scale, width = np.float64(np.int64(1) << sampling.subpixel_bits), np.int64(target.shape[1])
    flat, starts, ends = target.reshape(target.shape[0] * target.shape[1]), room[0], room[1]
    for back in range(last - first):
        n = last - 1 - back
        _, x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2 = set_up_edges(
            to_grid(vertices[n, 0, 0], scale), to_grid(vertices[n, 0, 1], scale), to_grid(vertices[n, 1, 0], scale),
            to_grid(vertices[n, 1, 1], scale), to_grid(vertices[n, 2, 0], scale), to_grid(vertices[n, 2, 1], scale), sampling,
        )  # fmt: skip
        if y_start >= y_end:
            continue
        across, rows, y_first = x_end - x_start, y_end - y_start, y_start - top
        cut_rows(starts, ends, rows, across, f0, f1, f2, a0, a1, a2, b0, b1, b2)

        # Go through the rows of tiles that it reaches, and pass over those where nothing is open.
        for band in range(y_first // WORD, (y_end - top + (WORD - 1)) // WORD):
            j_start, j_end = max(band * WORD - y_first, ZERO), min((band + 1) * WORD - y_first, rows)
            left, right = across, ZERO
            for j in range(j_start, j_end):
                left, right = min(left, starts[j]), max(right, ends[j])
            waiting = ZERO
            for w in range((x_start + left) // WORD, (x_start + right + (WORD - 1)) // WORD):
                waiting += still_open[band, w]
            if waiting == 0:
                continue
            for j in range(j_start, j_end):
                if starts[j] < ends[j]:
                    y = y_first + j
                    take_span(
                        flat, y * width, taken, still_open, y, x_start + starts[j], x_start + ends[j], values[n]
                    )  # fmt: skip
