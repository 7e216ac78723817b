"""Wu's antialiased line: at each step along the longer side the two pixels nearest to the line share its colour.

The one takes 1 - f and the other f, where f says how far the line has gone from the one to the other; so every step lays down
exactly one pixel's worth. Wu's own accumulator drifts, as its slope is cut off; here quotient and remainder step the line's
place exactly, in 1/65536 pixel, rounded down. The line is drawn from its end with the lower (y, x): it is the same from both.

It is quick, and one pixel wide across its longer side; so a diagonal is thinner than a level line, by the square root of 2.
Strokes of exact area are even (geometry/stroke.py).

Source: X. Wu, An efficient antialiasing technique, 1991.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import inline_kernel
from scanspan.raster.segment import size_of, step_range
from scanspan.records import Array, Float64Array, Int64Array, Integer

PLACE_BITS = np.int64(16)
PLACE = np.int64(1 << 16)
UNIT = np.float32(1.0 / 65536.0)


@inline_kernel
def walk_pairs(
    write_cover: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, x0: Integer, y0: Integer,
    x1: Integer, y1: Integer, color: Integer, is_linear: int,
) -> None:  # fmt: skip
    """Write the pairs of pixels from (x0, y0) to (x1, y1), both included. Cost: O(pixels written)."""
    if y1 < y0 or (y1 == y0 and x1 < x0):
        x0, y0, x1, y1 = x1, y1, x0, y0
    across, down = x1 - x0, y1 - y0
    is_steep = size_of(down) > size_of(across)
    major, minor, along, aside = (y0, x0, down, across) if is_steep else (x0, y0, across, down)
    length, height, zero = size_of(along), size_of(aside), np.int64(0)
    sign, minor_sign = np.int64(1 if along >= 0 else -1), np.int64(1 if aside >= 0 else -1)

    # Keep the steps at which one of the two lies in the rectangle.
    major_start, major_end = (y_start, y_end) if is_steep else (zero, width)
    minor_start, minor_end = (zero, width) if is_steep else (y_start, y_end)
    near, far = (minor_start - 1, minor_end) if minor_sign > 0 else (minor_start, minor_end + 1)
    first, last = step_range(major, minor, sign, minor_sign, length, length, zero, height, major_start, major_end, near, far)

    # Step the place along the shorter side, exactly.
    whole = max(length, np.int64(1))
    slope = (height << PLACE_BITS) // whole
    slope_rest = (height << PLACE_BITS) - slope * whole
    carried = slope_rest * first // whole
    place, rest = slope * first + carried, slope_rest * first - carried * whole
    step, minor_step = (width, np.int64(1)) if is_steep else (np.int64(1), width)
    for k in range(first, last + 1):
        other = place & (PLACE - 1)
        aim = minor + minor_sign * (place >> PLACE_BITS)
        q = (major + sign * k) * step + aim * minor_step
        if minor_start <= aim < minor_end:
            write_cover(flat, q, color, np.float32(PLACE - other) * UNIT, is_linear)
        if other > 0 and minor_start <= aim + minor_sign < minor_end:
            write_cover(flat, q + minor_sign * minor_step, color, np.float32(other) * UNIT, is_linear)
        place, rest = place + slope, rest + slope_rest
        if rest >= whole:
            place, rest = place + 1, rest - whole


@inline_kernel
def draw_pairs(
    write_cover: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, segments: Int64Array,
    values: Float64Array, is_linear: int,
) -> None:  # fmt: skip
    """Write segments by Wu's rule in some rows, one segment after the other.

    Shapes  flat: (H W, ...), a target, row after row; segments: (N, 4) x0, y0, x1, y1; values: (N,) packed colours, handed to
            the writer, and with each the cover, a float32 above 0 and at most 1.
    Units   pixels.
    Needs   coordinates within 2^24 px; y_start to y_end are rows of the target.
    Cost    O(segments + pixels written).
    """
    for n in range(segments.shape[0]):
        x0, y0, x1, y1 = segments[n, 0], segments[n, 1], segments[n, 2], segments[n, 3]
        if max(y0, y1) >= y_start and min(y0, y1) < y_end:
            walk_pairs(write_cover, flat, width, y_start, y_end, x0, y0, x1, y1, np.int64(values[n]), is_linear)
