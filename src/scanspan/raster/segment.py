"""Lines one pixel wide: which pixels a segment goes through, in integers, in all octants.

On its way from a to b a segment takes one step along its longer side for each pixel, and M / L of one along its shorter side.
After k steps it is (2 M k + c) // 2 L pixels off, where c says how a tie is rounded: L - 1 down, L up. Steps are made by adding
to a remainder; but the number can also be had at any k, so a segment begins where it enters the image, with the pixels that it
would have had there anyway. Clipping never moves a pixel.

midpoint      the lectures' rule: on a tie it does not step
dda           halves are rounded up in the coordinate, so it is the same from both ends
symmetric     the midpoint line from the end with the lower (y, x)
diamond-exit  ends between pixels; a pixel is drawn where the segment leaves the diamond |x| + |y| < 1/2 round its centre. So
              polylines touch shared corners once. Ties are broken as if all were moved by -(e, e^2)

Source: the lectures; Bresenham 1965; the line rasterization rules of OpenGL and Vulkan.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.geometry.fixed_point import product_halves
from scanspan.jit import helper_kernel, inline_kernel
from scanspan.raster.edge import edge_start
from scanspan.raster.edge_walk import start_crossing, step_crossing
from scanspan.records import Array, Float64Array, Int64Array, Integer

MIDPOINT, DDA, SYMMETRIC, DIAMOND_EXIT = range(4)


@helper_kernel
def size_of(value: Integer) -> Integer:
    """Return a whole number without its sign."""
    return max(value, -value)


@inline_kernel
def write_pixel(
    write_sample: Callable[..., None], target: Array, is_steep: bool | np.bool_, major: Integer, minor: Integer, value: float
) -> None:
    """Write a pixel by its coordinates along the longer and the shorter side, if it is in the target."""
    x, y = (minor, major) if is_steep else (major, minor)
    if 0 <= x < target.shape[1] and 0 <= y < target.shape[0]:
        write_sample(target[y, x : x + 1], 0, True, value, 0)


@inline_kernel
def walk_pixels(
    write_sample: Callable[..., None],
    target: Array,
    x0: Integer,
    y0: Integer,
    x1: Integer,
    y1: Integer,
    rule: int,
    value: float,
) -> None:
    """Write the pixels from (x0, y0) to (x1, y1), both included. Cost: O(steps in the image)."""
    if rule == SYMMETRIC and (y1 < y0 or (y1 == y0 and x1 < x0)):
        x0, y0, x1, y1 = x1, y1, x0, y0
    across, down = x1 - x0, y1 - y0
    is_steep = size_of(down) > size_of(across)
    major, minor, along, aside = (y0, x0, down, across) if is_steep else (x0, y0, across, down)
    side = np.int64(target.shape[0] if is_steep else target.shape[1])
    length, height = size_of(along), size_of(aside)
    sign, minor_sign = np.int64(1 if along >= 0 else -1), np.int64(1 if aside >= 0 else -1)

    # Keep the steps that lie in the image along the longer side, and begin with the first of them.
    first = max(-major if sign > 0 else major - side + 1, np.int64(0))
    last = min(side - 1 - major if sign > 0 else major, length)
    tie = length if rule == DDA and aside > 0 else length - 1
    whole = max(2 * length, np.int64(1))
    off = (2 * height * first + tie) // whole if length > 0 else np.int64(0)
    rest = 2 * height * first + tie - off * whole
    for k in range(first, last + 1):
        write_pixel(write_sample, target, is_steep, major + sign * k, minor + minor_sign * off, value)

        # Step the remainder, and the shorter side where it is full.
        rest += 2 * height
        if rest >= whole:
            rest -= whole
            off += 1


@helper_kernel
def is_in_diamond(x: Integer, y: Integer, i: Integer, j: Integer, s: int) -> bool | np.bool_:
    """Say whether a point, moved by -(e, e^2), lies in the open diamond of pixel (i, j); x, y in sub-pixels."""
    half = np.int64(1) << (s - 1)
    u, v = x - (i << s) - half, y - (j << s) - half
    distance = size_of(u) + size_of(v)
    return (distance < half) | ((distance == half) & (u > 0))


@inline_kernel
def walk_diamonds(
    write_sample: Callable[..., None], target: Array, x0: Integer, y0: Integer, x1: Integer, y1: Integer, s: int, value: float
) -> None:
    """Write the pixels whose diamonds a segment leaves; ends in sub-pixels.

    A segment that passes a centre, along its longer side, is then in the diamond of the pixel that it is in, and leaves it
    unless it ends there. It may also start in a diamond behind the centre, and leave that.
    """
    across, down = x1 - x0, y1 - y0
    is_steep = size_of(down) > size_of(across)
    side = np.int64(target.shape[0] if is_steep else target.shape[1])
    start, start_minor, end, along, aside = (y0, x0, y1, down, across) if is_steep else (x0, y0, x1, across, down)
    half = np.int64(1) << (s - 1)

    # The pixel it starts in.
    i, j = (x0 - 1) >> s, y0 >> s
    starts_behind = (
        start > ((j if is_steep else i) << s) + half if along >= 0 else start <= ((j if is_steep else i) << s) + half
    )
    if starts_behind and is_in_diamond(x0, y0, i, j, s) and not is_in_diamond(x1, y1, i, j, s):
        write_pixel(write_sample, target, is_steep, j if is_steep else i, i if is_steep else j, value)

    # The centres that it passes, those in the image.
    low, high = (start, end) if along >= 0 else (end, start)
    first, last = -((half - low) >> s), (high - half - 1) >> s
    final = last if along >= 0 else first
    first, last = max(first, np.int64(0)), min(last, side - 1)
    if first > last:
        return

    # At each, the first pixel border that is not before the line, by the machinery of edges; the pixel before it is the one.
    a, b = size_of(along), -aside if along >= 0 else aside
    at_border = is_steep or (aside >= 0 if along <= 0 else aside <= 0)
    high_part, low_part = product_halves(a, b, -start_minor, (first << s) + half - start)
    f = edge_start(high_part, low_part, np.int64(0 if at_border else -1), s)
    border, rest, step, step_rest = start_crossing(f, a, b)
    for major in range(first, last + 1):
        minor = border - 1
        ends_here = major == final and is_in_diamond(x1, y1, minor if is_steep else major, major if is_steep else minor, s)
        if not ends_here:
            write_pixel(write_sample, target, is_steep, major, minor, value)
        border, rest = step_crossing(border, rest, step, step_rest, a)


@inline_kernel
def draw_segments(
    write_sample: Callable[..., None], target: Array, segments: Int64Array, values: Float64Array, rule: int, s: int
) -> None:
    """Write the pixels of segments, one after the other.

    Shapes  target: (H, W, ...); segments: (N, 4) x0, y0, x1, y1; values: (N,), handed to the writer.
    Units   pixels, and sub-pixels of s bits for DIAMOND_EXIT.
    Needs   coordinates within 2^24 px.
    """
    for n in range(segments.shape[0]):
        x0, y0, x1, y1 = segments[n, 0], segments[n, 1], segments[n, 2], segments[n, 3]
        if rule == DIAMOND_EXIT:
            walk_diamonds(write_sample, target, x0, y0, x1, y1, s, values[n])
        else:
            walk_pixels(write_sample, target, x0, y0, x1, y1, rule, values[n])
