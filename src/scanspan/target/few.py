"""A few triangles: what a call for one or two of them takes, in one kernel from the check to the pixels.

A call that paints a hundred pixels is done in less time than it takes NumPy to look at its arguments. So here arguments that
have the plain types are checked, snapped and painted without going back to Python. Whatever is out of the ordinary, and all
that is wrong, is left untouched for the way that others take, which knows what to say. The pixels are the same: setup,
traversal and colouring are those of paint.py and gouraud.py.

Price: a second way in. It has no rules of its own, only limits of size.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from scanspan.assets.codes import to_code
from scanspan.errors import InputError
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.jit import bare_helper, helper_kernel, kernel
from scanspan.raster.algorithms import ALGORITHMS, SMALL_IMAGE
from scanspan.raster.counters import COUNTERS
from scanspan.raster.edge import OFFSCREEN_POINT
from scanspan.raster.options import check_name, check_subpixel_bits, make_sampling
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array
from scanspan.samples import sample_offsets
from scanspan.target.gouraud import color_numbers
from scanspan.target.paint import PAINTERS, half_space_opaque

OVERLAPS = ("over", "disjoint")
FEW = 64  # triangles
OPAQUE = 256.0 * 255.0  # the highest byte of a packed colour, seen from the third
PLAIN = frozenset(np.dtype(name) for name in ("f8", "f4", "i8", "i4"))


@helper_kernel
def snap_few(vertices: Float64Array, s: int) -> tuple[bool, Int64Array]:
    """Return whether corners can be taken, and where they are, (3 N, 2) sub-pixels, half to even."""
    count, limit, scale = vertices.shape[0], np.float64(MAX_COORDINATE), np.float64(np.int64(1) << s)
    xy, is_good = np.empty((3 * count, 2), np.int64), True
    for n in range(count):
        for k in range(3):
            for axis in range(2):
                position = vertices[n, k, axis]
                is_good = is_good and bool(abs(position) <= limit)
                xy[3 * n + k, axis] = np.int64(np.rint(position * scale)) if is_good else 0
    return is_good, xy


@bare_helper
def box_of(xy: Int64Array, first: Integer, last: Integer, sampling: Sampling) -> tuple[Integer, Integer, Integer, Integer]:
    """Return the pixels of the image that corners first to last reach: x_start, x_end, y_start, y_end."""
    s, x_low, y_low = sampling.subpixel_bits, xy[first, 0], xy[first, 1]
    x_high, y_high = x_low, y_low
    for k in range(first + 1, last):
        x_low, x_high = min(x_low, xy[k, 0]), max(x_high, xy[k, 0])
        y_low, y_high = min(y_low, xy[k, 1]), max(y_high, xy[k, 1])
    zero = np.int64(0)
    x_start, y_start = max(x_low >> s, zero), max(y_low >> s, zero)
    return x_start, min((x_high >> s) + 1, sampling.x_end), y_start, min((y_high >> s) + 1, sampling.y_end)


@bare_helper
def area_of(xy: Int64Array, sampling: Sampling) -> Integer:
    """Return how many pixels lie in the boxes of triangles, all together."""
    area: Integer = np.int64(0)
    for first in range(0, xy.shape[0], 3):
        x_start, x_end, y_start, y_end = box_of(xy, first, first + 3, sampling)
        area += max(x_end - x_start, np.int64(0)) * max(y_end - y_start, np.int64(0))
    return area


@helper_kernel
def screen_of(xy: Int64Array, depth: Float64Array) -> ScreenTriangles:
    """Return triangles that each have corners of their own, as screen_triangles does."""
    count = xy.shape[0] // 3
    corners = np.empty((count, 3), np.int32)
    for n in range(count):
        for k in range(3):
            corners[n, k] = 3 * n + k
    none = np.full(count, -1, np.int32)
    return ScreenTriangles(
        xy, depth, np.empty((0, 4)), corners, none, none, np.empty((0, 3, 3)), np.zeros(count, np.uint8), none,
        np.empty((0, 3, 4), np.int64), np.empty((0, 8), np.int64), np.empty((0, 7)), np.empty((0, 19), np.int64),
        np.empty((0, 7)),
    )  # fmt: skip


@kernel
def paint_flat_kernel(words: Int32Array, vertices: Float64Array, colors: UInt8Array, sampling: Sampling, most: int) -> bool:
    """Paint triangles in opaque colours, and say whether that was done; if not, nothing was.

    Shapes  words: (H, W) pixels; vertices: (N, 3, 2) of any value; colors: (N, 3), (N, 4), (1, 3) or (1, 4);
            most: pixels in their boxes.
    """
    is_good, xy = snap_few(vertices, sampling.subpixel_bits)
    if not is_good or area_of(xy, sampling) > most:
        return False
    depth = np.empty(xy.shape[0])
    for k in range(xy.shape[0]):
        n = min(k // 3, colors.shape[0] - 1)
        if colors.shape[1] == 4 and colors[n, 3] != 255:
            return False
        depth[k] = np.float64(colors[n, 0]) + 256.0 * (np.float64(colors[n, 1]) + 256.0 * (np.float64(colors[n, 2]) + OPAQUE))
    half_space_opaque(words, np.zeros(COUNTERS, np.int64), screen_of(xy, depth), 0, vertices.shape[0], sampling)
    return True


@kernel
def paint_shaded_kernel(words: Int32Array, vertices: Float64Array, colors: UInt8Array, sampling: Sampling, most: int) -> bool:
    """Paint triangles with opaque colours at their corners; as above, with colors (N, 3, 3) or (N, 3, 4)."""
    is_good, xy = snap_few(vertices, sampling.subpixel_bits)
    if not is_good or sampling.rule == OFFSCREEN_POINT or area_of(xy, sampling) > most:
        return False
    for n in range(colors.shape[0] if colors.shape[2] == 4 else 0):
        for k in range(3):
            if colors[n, k, 3] != 255:
                return False

    # Write which triangle a pixel shows, in the box of all of them, and colour that.
    x_start, x_end, y_start, y_end = box_of(xy, np.int64(0), xy.shape[0], sampling)
    if x_start >= x_end or y_start >= y_end:
        return True
    if (x_end - x_start) * (y_end - y_start) > most:
        return False
    depth, s = np.empty(xy.shape[0]), sampling.subpixel_bits
    for k in range(xy.shape[0]):
        xy[k, 0] -= x_start << s
        xy[k, 1] -= y_start << s
        depth[k] = np.float64(k // 3 + 1)
    width, height = int(x_end - x_start), int(y_end - y_start)
    within = Sampling(
        0, width, 0, height, s, sampling.sample_x, sampling.sample_y, sampling.cull, sampling.rule,
        sampling.rule_x, sampling.rule_y, sampling.rule_w, sampling.coverage, sampling.order,
    )  # fmt: skip
    numbers = np.zeros((height, width), np.int32)
    half_space_opaque(numbers, np.zeros(COUNTERS, np.int64), screen_of(xy, depth), 0, vertices.shape[0], within)
    color_numbers(words, numbers, int(x_start), int(y_start), 0, height, xy, colors, within)
    return True


def plan_triangles(
    size: tuple[int, int], algorithm: Any, overlap: Any, rule: Any, cull: Any, subpixel_bits: Any
) -> tuple[str, int, Sampling]:
    """Return the painter's name, the sub-pixel bits and the sampling of a call; the same options are checked once."""
    try:
        return _plan_once(*size, algorithm, overlap, rule, cull, subpixel_bits)
    except TypeError:  # something that cannot be a key, and so is no option
        return _plan_once.__wrapped__(*size, algorithm, overlap, rule, cull, subpixel_bits)


@lru_cache(maxsize=64, typed=True)
def _plan_once(
    width: int, height: int, algorithm: Any, overlap: Any, rule: Any, cull: Any, subpixel_bits: Any
) -> tuple[str, int, Sampling]:
    """Return what plan_triangles does."""
    bits = check_subpixel_bits(subpixel_bits)
    check_name("algorithm", algorithm, ALGORITHMS)
    check_name("overlap", overlap, OVERLAPS)
    name = "half-space" if algorithm == "homogeneous" else algorithm
    if name not in PAINTERS:
        raise InputError(f"algorithm = {algorithm!r}: it sweeps over all triangles at once and cannot paint them in order")
    sampling = make_sampling((width, height), sample_offsets(1, bits)[0], rule=rule, cull=cull, subpixel_bits=bits)
    return name, bits, sampling


def paint_few(pixels: UInt8Array, vertices: Any, colors: Any, sampling: Sampling, threads: int) -> bool:
    """Paint a few triangles by half-space if their arrays are plain, and say whether that was done; if not, nothing was.

    Parameters
    ----------
    pixels : (H, W, 4).
    vertices : whatever came; taken if it is an array (N, 3, 2) of plain numbers, or a list that makes one.
    colors : taken if it is a name, a tuple, or an array of uint8, of one colour, of triangles or of corners.
    sampling : of the whole image.
    threads : where there are more than one, large triangles are left to them.
    """
    if type(vertices) is list and len(vertices) <= FEW:
        try:
            vertices = np.array(vertices)
        except (TypeError, ValueError, OverflowError):
            return False
    if type(vertices) is not np.ndarray or vertices.dtype not in PLAIN:
        return False
    count = len(vertices) if vertices.ndim == 3 else 0
    if not 0 < count <= FEW or vertices.shape[1:] != (3, 2):
        return False
    if type(colors) in (str, tuple):
        try:
            colors = to_code(colors)
        except InputError:
            return False  # which may not be all that is wrong
    if type(colors) is not np.ndarray or colors.dtype != np.uint8:
        return False
    shape = colors.shape
    if shape in ((4,), (3,)):
        paint, given = paint_flat_kernel, colors[None]
    elif shape in ((count, 4), (count, 3)):
        paint, given = paint_flat_kernel, colors
    elif shape in ((count, 3, 4), (count, 3, 3)):
        paint, given = paint_shaded_kernel, colors
    else:
        return False
    words: Array = pixels.view(np.int32)[..., 0]
    most = SMALL_IMAGE if threads > 1 else 1 << 62
    return bool(paint(words, np.array(vertices, np.float64, order="C"), np.array(given, order="C"), sampling, most))
