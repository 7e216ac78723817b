"""A few triangles: what a call for one or two of them takes, in one kernel from the check to the pixels.

A call that paints a hundred pixels is done in less time than it takes NumPy to look at its arguments. So here arguments that
have the plain types are checked and painted without going back to Python. Whatever is out of the ordinary, and all that is
wrong, is left untouched for the way that others take, which knows what to say. The pixels are the same: the kernels are those
of triangles.py and gouraud.py.

Price: a second way in. It has no rules of its own, only limits of size.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from scanspan.assets.buffers import has_far_values
from scanspan.assets.codes import to_code
from scanspan.errors import InputError
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.algorithms import ALGORITHMS, SMALL_IMAGE
from scanspan.raster.flat import make_room_within
from scanspan.raster.options import check_name, check_subpixel_bits, make_sampling
from scanspan.records import Array, Float64Array, Int32Array, Sampling, UInt8Array
from scanspan.samples import sample_offsets
from scanspan.target.gouraud import shaded_words
from scanspan.target.paint import PAINTERS
from scanspan.target.planes import OPAQUE, SURE
from scanspan.target.triangles import flat_words, measure_boxes

OVERLAPS = ("over", "disjoint")
FEW = 64  # triangles
PLAIN = frozenset(np.dtype(name) for name in ("f8", "f4", "i8", "i4"))


@helper_kernel
def are_few(vertices: Float64Array, sampling: Sampling, most: int) -> tuple[bool, bool]:
    """Say whether corners can be taken, and whether their triangles are so small that shades of 8 bits are exact."""
    if has_far_values(vertices.reshape(-1), np.float64(MAX_COORDINATE)):
        return False, False
    longest, total = measure_boxes(vertices, np.float64(sampling.x_end), np.float64(sampling.y_end))
    return bool(total <= most), bool(longest * np.float64(np.int64(1) << sampling.subpixel_bits) < SURE)


@kernel
def paint_flat_kernel(words: Int32Array, vertices: Float64Array, colors: UInt8Array, sampling: Sampling, most: int) -> bool:
    """Paint triangles in opaque colours, and say whether that was done; if not, nothing was.

    Shapes  words: (H, W) pixels; vertices: (N, 3, 2) of any value; colors: (N, 3), (N, 4), (1, 3) or (1, 4);
            most: pixels in their boxes.
    """
    count = vertices.shape[0]
    values = np.empty(count, np.int32)
    if not are_few(vertices, sampling, most)[0]:
        return False
    for n in range(count):
        m = min(n, colors.shape[0] - 1)
        if colors.shape[1] == 4 and colors[m, 3] != 255:
            return False
        word = np.int64(colors[m, 0]) + (np.int64(colors[m, 1]) << 8) + (np.int64(colors[m, 2]) << 16)
        values[n] = np.int32(word - OPAQUE)
    room = make_room_within(words.shape[0])
    flat_words(words.reshape(words.size), words.shape[1], vertices, values, room, 0, 0, count, sampling)
    return True


@kernel
def paint_shaded_kernel(words: Int32Array, vertices: Float64Array, colors: UInt8Array, sampling: Sampling, most: int) -> bool:
    """Paint triangles with opaque colours at their corners; as above, with colors (N, 3, 3) or (N, 3, 4)."""
    count = vertices.shape[0]
    can_take, is_exact = are_few(vertices, sampling, most)
    if not (can_take and is_exact):
        return False
    for n in range(count if colors.shape[2] == 4 else 0):
        for k in range(3):
            if colors[n, k, 3] != 255:
                return False
    room = make_room_within(words.shape[0])
    shaded_words(words.reshape(words.size), words.shape[1], vertices, colors, room, 0, 0, count, sampling)
    return True


def plan_triangles(
    size: tuple[int, int], algorithm: Any, overlap: Any, rule: Any, cull: Any, subpixel_bits: Any, in_order: bool = True
) -> tuple[str, int, Sampling]:
    """Return the painter's name, the sub-pixel bits and the sampling of a call; the same options are checked once.

    Where triangles need not be painted in order, because depth decides, every algorithm can.
    """
    try:
        return _plan_once(*size, algorithm, overlap, rule, cull, subpixel_bits, in_order)
    except TypeError:  # something that cannot be a key, and so is no option
        return _plan_once.__wrapped__(*size, algorithm, overlap, rule, cull, subpixel_bits, in_order)


@lru_cache(maxsize=64, typed=True)
def _plan_once(
    width: int, height: int, algorithm: Any, overlap: Any, rule: Any, cull: Any, subpixel_bits: Any, in_order: bool
) -> tuple[str, int, Sampling]:
    """Return what plan_triangles does."""
    bits = check_subpixel_bits(subpixel_bits)
    check_name("algorithm", algorithm, ALGORITHMS)
    check_name("overlap", overlap, OVERLAPS)
    name = "half-space" if algorithm == "homogeneous" else algorithm
    if in_order and name not in PAINTERS:
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
