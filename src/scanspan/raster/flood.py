"""Flood fill: from a seed to all pixels that are joined to it and alike, span by span.

The lectures' fill calls itself for each of four neighbours: 4 N + 1 calls for N pixels, as deep as there are pixels, and most
calls find nothing to do. Here a stack holds spans to be looked at, a row's from left to right; each is filled whole, and leaves
the parts of the rows above and below in which pixels are alike. The stack grows as it must, and nothing is called twice. A map
of what is done takes the place of comparing colours, so that a fill in its own colour ends too.

Source: the lectures; Heckbert 1990, A seed fill algorithm.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Int64Array, Integer, UInt8Array

FIRST_ROOM = 256  # spans


@helper_kernel
def is_open(
    pixels: UInt8Array, filled: Array, x: Integer, y: Integer, color: UInt8Array, tolerance: int, to_border: bool
) -> bool:
    """Say whether a pixel is to be filled: like the seed, or, in a fill up to a border, unlike the border's colour."""
    if filled[y, x]:
        return False
    alike = True
    for k in range(pixels.shape[2]):
        difference = np.int64(pixels[y, x, k]) - np.int64(color[k])
        alike = alike and bool(max(difference, -difference) <= tolerance)
    return alike != to_border


@helper_kernel
def push_span(stack: Int64Array, count: int, y: Integer, first: Integer, last: Integer) -> tuple[Int64Array, int]:
    """Push columns first to last of row y, in which pixels may be open; the stack is doubled when it is full."""
    if count == stack.shape[0]:
        grown = np.empty((2 * count, 3), np.int64)
        for k in range(count):
            grown[k, 0], grown[k, 1], grown[k, 2] = stack[k, 0], stack[k, 1], stack[k, 2]
        stack = grown
    stack[count, 0], stack[count, 1], stack[count, 2] = y, first, last
    return stack, count + 1


@kernel
def flood_kernel(
    pixels: UInt8Array, filled: Array, x: int, y: int, color: UInt8Array, tolerance: int, to_border: bool, diagonal: bool,
    counters: Int64Array,
) -> None:  # fmt: skip
    """Mark all pixels that are joined to a seed.

    Shapes  pixels: (H, W, k) uint8; filled: (H, W) bool, False at first, True where the fill has been; color: (k,) the
            seed's, or the border's; counters: (3,), added to: pixels filled, pixels looked at, spans.
    Needs   the seed lies in the image.
    Cost    O(pixels filled). One that is filled is looked at three times at most, one that is not four times; with
            diagonal, five and six times.
    """
    height, width = filled.shape
    reach = 1 if diagonal else 0
    stack, count = np.empty((FIRST_ROOM, 3), np.int64), 0
    stack, count = push_span(stack, count, np.int64(y), np.int64(x), np.int64(x))
    while count > 0:
        count -= 1
        row, first, last = stack[count, 0], stack[count, 1], stack[count, 2]
        i = first
        while i <= last:
            # Find an open pixel, and from it the whole run that it is in.
            counters[1] += 1
            if not is_open(pixels, filled, i, row, color, tolerance, to_border):
                i += 1
                continue
            start = end = i
            while start > 0 and is_open(pixels, filled, start - 1, row, color, tolerance, to_border):
                start -= 1
            while end + 1 < width and is_open(pixels, filled, end + 1, row, color, tolerance, to_border):
                end += 1
            counters[1] += end - start + (1 if start > 0 else 0) + (1 if end + 1 < width else 0)

            # Fill it, and look above and below it later.
            for k in range(start, end + 1):
                filled[row, k] = True
            counters[0] += end - start + 1
            counters[2] += 1
            low, high = max(start - reach, np.int64(0)), min(end + reach, np.int64(width - 1))
            if row > 0:
                stack, count = push_span(stack, count, row - 1, low, high)
            if row + 1 < height:
                stack, count = push_span(stack, count, row + 1, low, high)
            i = end + 1
