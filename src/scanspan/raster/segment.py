"""Lines one pixel wide: which pixels a segment goes through, in integers, in all octants.

On its way from a to b a segment takes one step along its longer side for each pixel, and M / L of one along its shorter side.
After k steps it is (2 M k + c) // 2 L pixels off, where c says how a tie is rounded: L - 1 down, L up. Steps are made by adding
to a remainder. But the number can also be had at any k, and the first k for any number; so a segment begins where it enters the
rectangle that is drawn and ends where it leaves it, with the pixels that it would have had there anyway. Clipping never moves a
pixel, and costs nothing for what is not seen.

midpoint      the lectures' rule: on a tie it does not step
dda           halves are rounded up in the coordinate, so it is the same from both ends
symmetric     the midpoint line from the end with the lower (y, x)
run-length    the pixels of midpoint, a run of equal rows or columns at a time: its length is one of two that differ by one. To
              be chosen for long lines that are nearly level; for others the runs are too short to gain from
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
from scanspan.raster.edge_walk import start_crossing
from scanspan.records import Array, Float64Array, Int64Array, Integer

MIDPOINT, DDA, SYMMETRIC, DIAMOND_EXIT, RUN_LENGTH, WU = range(6)  # wu.py has the last
NEVER = np.int64(1 << 62)  # steps, more than any segment has


@helper_kernel
def size_of(value: Integer) -> Integer:
    """Return a whole number without its sign."""
    return max(value, -value)


@helper_kernel
def steps_to(reached: Integer, whole: Integer, tie: Integer, twice: Integer) -> Integer:
    """Return after how many steps along the longer side a segment is so many along the shorter; NEVER for a level one."""
    if reached <= 0:
        return np.int64(0)
    return NEVER if twice == 0 else -((tie - whole * reached) // twice)


@helper_kernel
def step_range(
    major: Integer, minor: Integer, sign: Integer, minor_sign: Integer, length: Integer, whole: Integer, tie: Integer,
    twice: Integer, major_start: Integer, major_end: Integer, minor_start: Integer, minor_end: Integer,
) -> tuple[Integer, Integer]:  # fmt: skip
    """Return the first and the last step of a segment within a rectangle; the last is the lower if there is none."""
    zero = np.int64(0)
    first = max(major_start - major if sign > 0 else major - major_end + 1, zero)
    last = min(major_end - 1 - major if sign > 0 else major - major_start, length)
    near = minor_start - minor if minor_sign > 0 else minor - minor_end + 1
    far = minor_end - minor if minor_sign > 0 else minor - minor_start + 1
    if far <= 0:
        return zero, np.int64(-1)
    return max(first, steps_to(near, whole, tie, twice)), min(last, steps_to(far, whole, tie, twice) - 1)


@inline_kernel
def write_steps(
    write_sample: Callable[..., None], flat: Array, q: Integer, count: Integer, step: Integer, minor_step: Integer,
    rest: Integer, twice: Integer, whole: Integer, value: float,
) -> None:  # fmt: skip
    """Write one pixel for each step; where the remainder is full, step along the shorter side too."""
    for _ in range(count):
        write_sample(flat, q, True, value, 0)
        rest += twice
        carries = rest >= whole
        rest -= whole if carries else np.int64(0)
        q += step + (minor_step if carries else np.int64(0))


@inline_kernel
def write_runs(
    write_sample: Callable[..., None], flat: Array, q: Integer, count: Integer, step: Integer, minor_step: Integer,
    rest: Integer, twice: Integer, whole: Integer, value: float,
) -> None:  # fmt: skip
    """Write the same pixels run by run. The remainder is full after `shorter` steps or one more."""
    shorter = whole // twice if twice > 0 else count
    steps = (whole - rest + twice - 1) // twice if twice > 0 else count
    while count > 0:
        taken = min(steps, count)
        if size_of(step) == 1:
            run = flat[q if step > 0 else q - taken + 1 :]
            for i in range(taken):
                write_sample(run, i, True, value, 0)
        else:
            for i in range(taken):
                write_sample(flat, q + i * step, True, value, 0)
        count -= taken
        q += taken * step + minor_step
        rest += steps * twice - whole
        steps = shorter + np.int64(rest + shorter * twice < whole)


@inline_kernel
def walk_pixels(
    write_sample: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, x0: Integer, y0: Integer,
    x1: Integer, y1: Integer, rule: int, value: float,
) -> None:  # fmt: skip
    """Write the pixels from (x0, y0) to (x1, y1), both included. Cost: O(pixels written)."""
    if rule == SYMMETRIC and (y1 < y0 or (y1 == y0 and x1 < x0)):
        x0, y0, x1, y1 = x1, y1, x0, y0
    across, down = x1 - x0, y1 - y0
    is_steep = size_of(down) > size_of(across)
    along, aside = (down, across) if is_steep else (across, down)
    length, height, zero = size_of(along), size_of(aside), np.int64(0)
    sign, minor_sign = np.int64(1 if along >= 0 else -1), np.int64(1 if aside >= 0 else -1)
    tie, whole, twice = length if rule == DDA and aside > 0 else length - 1, 2 * length, 2 * height

    # Keep the steps within the rectangle, and begin with the first of them.
    first: Integer = zero
    off: Integer = zero
    rest: Integer = tie
    last = length
    is_inside = min(x0, x1) >= 0 and max(x0, x1) < width and min(y0, y1) >= y_start and max(y0, y1) < y_end
    if not is_inside:
        limits = (y_start, y_end, zero, width) if is_steep else (zero, width, y_start, y_end)
        major, minor = (y0, x0) if is_steep else (x0, y0)
        first, last = step_range(major, minor, sign, minor_sign, length, whole, tie, twice, *limits)
        if first > 0 and first <= last:
            off = (twice * first + tie) // whole
            rest = twice * first + tie - off * whole
    step, minor_step = (sign * width, minor_sign) if is_steep else (sign, minor_sign * width)
    q = y0 * width + x0 + first * step + off * minor_step
    if rule == RUN_LENGTH:
        write_runs(write_sample, flat, q, last - first + 1, step, minor_step, rest, twice, whole, value)
    else:
        write_steps(write_sample, flat, q, last - first + 1, step, minor_step, rest, twice, whole, value)


@helper_kernel
def is_in_diamond(x: Integer, y: Integer, i: Integer, j: Integer, s: int) -> bool | np.bool_:
    """Say whether a point, moved by -(e, e^2), lies in the open diamond of pixel (i, j); x, y in sub-pixels."""
    half = np.int64(1) << (s - 1)
    u, v = x - (i << s) - half, y - (j << s) - half
    distance = size_of(u) + size_of(v)
    return (distance < half) | ((distance == half) & (u > 0))


@helper_kernel
def crossing_after(border: Integer, rest: Integer, b: Integer, a: Integer, rows: Integer) -> tuple[Integer, Integer]:
    """Return a crossing and its rest so many rows further on; see start_crossing."""
    f = rest - a * border + b * rows
    crossing = -(f // a)
    return crossing, f + a * crossing


@helper_kernel
def crossing_range(
    f: Integer, a: Integer, b: Integer, minor_start: Integer, minor_end: Integer, last: Integer
) -> tuple[Integer, Integer]:
    """Return the first and the last row, from 0 to `last`, whose crossing is above minor_start and at most minor_end."""
    # The crossing is at most c where f + b k + a c >= 0; it grows with k where b is below 0.
    below, within = f + a * minor_start, f + a * minor_end
    if b < 0:
        return max(np.int64(0), below // -b + 1), min(last, within // -b)
    if b > 0:
        return max(np.int64(0), -(within // b)), min(last, -(below // b) - 1)
    return (np.int64(0), last) if below < 0 <= within else (np.int64(0), np.int64(-1))


@inline_kernel
def walk_diamonds(
    write_sample: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, x0: Integer, y0: Integer,
    x1: Integer, y1: Integer, s: int, value: float,
) -> None:  # fmt: skip
    """Write the pixels whose diamonds a segment leaves; ends in sub-pixels. Cost: O(pixels written).

    A segment that passes a centre, along its longer side, is then in the diamond of the pixel that it is in, and leaves it
    unless it ends there. It may also start in a diamond behind the centre, and leave that.
    """
    across, down, zero = x1 - x0, y1 - y0, np.int64(0)
    is_steep = size_of(down) > size_of(across)
    start, start_minor, end, along, aside = (y0, x0, y1, down, across) if is_steep else (x0, y0, x1, across, down)
    half = np.int64(1) << (s - 1)

    # The pixel it starts in.
    i, j = (x0 - 1) >> s, y0 >> s
    middle = ((j if is_steep else i) << s) + half
    starts_behind = start > middle if along >= 0 else start <= middle
    leaves = starts_behind and is_in_diamond(x0, y0, i, j, s) and not is_in_diamond(x1, y1, i, j, s)
    if leaves and 0 <= i < width and y_start <= j < y_end:
        write_sample(flat, j * width + i, True, value, 0)

    # The centres that it passes, but for that of the pixel it ends in.
    low, high = (start, end) if along >= 0 else (end, start)
    first: Integer = -((half - low) >> s)
    last: Integer = (high - half - 1) >> s
    i, j = (x1 - 1) >> s, y1 >> s
    if (j if is_steep else i) == (last if along >= 0 else first) and is_in_diamond(x1, y1, i, j, s):
        first, last = (first, last - 1) if along >= 0 else (first + 1, last)
    first, last = max(first, y_start if is_steep else zero), min(last, (y_end if is_steep else width) - 1)
    if first > last:
        return

    # At each, the first pixel border that is not before the line, by the machinery of edges; the pixel before it is the one.
    a, b = size_of(along), -aside if along >= 0 else aside
    at_border = is_steep or (aside >= 0 if along <= 0 else aside <= 0)
    high_part, low_part = product_halves(a, b, -start_minor, (first << s) + half - start)
    f = edge_start(high_part, low_part, np.int64(0 if at_border else -1), s)
    border, rest, slope, slope_rest = start_crossing(f, a, b)

    # Leave out those where that pixel is not in the rectangle.
    final, _ = crossing_after(border, rest, b, a, last - first)
    minor_start, minor_end = (zero, width) if is_steep else (y_start, y_end)
    if min(border, final) <= minor_start or max(border, final) > minor_end:
        skipped, kept = crossing_range(f, a, b, minor_start, minor_end, last - first)
        first, last = first + skipped, first + kept
        border, rest = crossing_after(border, rest, b, a, skipped)
    step, minor_step = (width, np.int64(1)) if is_steep else (np.int64(1), width)
    q = first * step + (border - 1) * minor_step
    for _ in range(last - first + 1):
        write_sample(flat, q, True, value, 0)
        rest += slope_rest
        carries = rest >= a
        rest -= a if carries else zero
        q += step + (slope - 1 if carries else slope) * minor_step


@inline_kernel
def draw_segments(
    write_sample: Callable[..., None], flat: Array, width: Integer, y_start: Integer, y_end: Integer, segments: Int64Array,
    values: Float64Array, rule: int, s: int,
) -> None:  # fmt: skip
    """Write the pixels of segments in some rows, one segment after the other.

    Shapes  flat: (H W, ...), a target, row after row; segments: (N, 4) x0, y0, x1, y1; values: (N,), handed to the writer.
    Units   pixels, and sub-pixels of s bits for DIAMOND_EXIT.
    Needs   coordinates within 2^24 px; y_start to y_end are rows of the target.
    Cost    O(segments + pixels written).
    """
    # A tie is broken upwards, so a segment on the lower border may still come in.
    bits, sinks = (s, 1) if rule == DIAMOND_EXIT else (0, 0)
    top, bottom = y_start << bits, (y_end << bits) + sinks
    for n in range(segments.shape[0]):
        x0, y0, x1, y1 = segments[n, 0], segments[n, 1], segments[n, 2], segments[n, 3]
        if max(y0, y1) < top or min(y0, y1) >= bottom:
            continue
        if rule == DIAMOND_EXIT:
            walk_diamonds(write_sample, flat, width, y_start, y_end, x0, y0, x1, y1, s, values[n])
        else:
            walk_pixels(write_sample, flat, width, y_start, y_end, x0, y0, x1, y1, rule, values[n])
