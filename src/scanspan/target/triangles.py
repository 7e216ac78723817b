"""Triangles in one value each, painted in order, straight from their corners in pixels: the quick way to fill a canvas.

Bands of rows are shared by threads. Each scans all triangles, which takes a few nanoseconds for one that lies elsewhere, so
there are as few bands as there are threads where triangles are small. The rows are cut so that all bands have as much to do, as
far as a few thousand of the triangles tell. Where triangles are large, there are more bands than threads: that evens out what
those few do not tell, and a band stays in the cache.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event
from typing import Any

import numpy as np

from scanspan.assets.arrays import in_layout
from scanspan.assets.buffers import has_far_values
from scanspan.bands import run_bands
from scanspan.jit import bare_kernel
from scanspan.raster.algorithms import CHUNK, SMALL, SMALL_IMAGE
from scanspan.raster.covered import covered_words, room_for_bits
from scanspan.raster.flat import Room, make_room, scan_flat
from scanspan.raster.lanes import VECTOR
from scanspan.records import Array, Float64Array, Int32Array, Sampling, UInt8Array
from scanspan.target.blend import fetch_none, one_word, set_up_none, write_word
from scanspan.target.planes import SURE

PASS_BYTES = 1 << 21  # of a picture in one band, where it is cut for the sake of the cache
TOLD = 4096  # triangles that are looked at to cut rows into bands, and to find out how deep they lie
DEEP, LARGE_BOX = 32, 4096.0  # boxes over each pixel and pixels in a box, from which on the last are drawn first

# Costs in nanoseconds, roughly: of a triangle's setup, of passing over it, and of each of its rows and vectors.
SETUP_COST, SCAN_COST, ROW_COST, VECTOR_COST = 20.0, 4.0, 1.5, 1.0


@bare_kernel
def flat_words(
    flat: Int32Array, width: int, vertices: Float64Array, words: Int32Array, room: Room, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H width,) words of 32 bits, one a triangle."""
    scan_flat(
        fetch_none, set_up_none, one_word, write_word, False, flat, np.int64(width), vertices, words, room, top, first,
        last, sampling,
    )  # fmt: skip


@bare_kernel
def measure_boxes(vertices: Array, width: float, height: float) -> tuple[float, float]:
    """Return the longest side of the triangles' boxes, and the sum of the areas that these have within an image.

    Shapes  vertices: (N, 3, 2).
    Units   pixels.
    """
    longest, total = 0.0, 0.0
    for n in range(vertices.shape[0]):
        p_x, p_y, q_x, q_y = vertices[n, 0, 0], vertices[n, 0, 1], vertices[n, 1, 0], vertices[n, 1, 1]
        r_x, r_y = vertices[n, 2, 0], vertices[n, 2, 1]
        low_x, high_x, low_y, high_y = min(p_x, q_x, r_x), max(p_x, q_x, r_x), min(p_y, q_y, r_y), max(p_y, q_y, r_y)
        longest = max(longest, high_x - low_x, high_y - low_y)
        across, down = min(high_x, width) - max(low_x, 0.0), min(high_y, height) - max(low_y, 0.0)
        total += max(across, 0.0) * max(down, 0.0)
    return longest, total


def measure_triangles(vertices: Array, subpixel_bits: int) -> tuple[bool, float]:
    """Say whether sums of edge values times 8-bit colours are exact for all triangles; and give the area of their mean box.

    What all coordinates lie within tells of most pictures that they are; the area is that of some triangles.
    """
    limit = SURE / (1 << subpixel_bits)
    some = in_layout(vertices[:: max(1, len(vertices) // TOLD)], np.float64)
    mean = measure_boxes(some, np.inf, np.inf)[1] / max(1, len(some))
    is_sure = not has_far_values(vertices.reshape(-1), limit / 4) or measure_boxes(vertices, np.inf, np.inf)[0] < limit
    return bool(is_sure), mean


def as_words(codes: UInt8Array, count: int) -> Int32Array:
    """Return (4,) or (N, 4) colours as N words of 32 bits, as a picture has them."""
    words = np.ascontiguousarray(codes).view(np.int32)[..., 0]
    return np.ascontiguousarray(words) if words.ndim else np.full(count, words, np.int32)


def row_costs(vertices: Array, height: int) -> Float64Array:
    """Return what each row of a picture costs to paint, (height,), in nanoseconds, from some of the triangles."""
    some = vertices[:: max(1, len(vertices) // TOLD)]
    p, q, r = some[:, 0], some[:, 1], some[:, 2]  # reducing an axis of three takes ten times as long
    low, high = np.minimum(np.minimum(p, q), r), np.maximum(np.maximum(p, q), r)
    top, bottom = (np.clip(y, 0, height).astype(np.int64) for y in (low[:, 1], high[:, 1] + 1))
    cost = ROW_COST + VECTOR_COST * np.ceil((high[:, 0] - low[:, 0]) / float(VECTOR))
    changes = np.zeros(height + 1)
    np.add.at(changes, top, cost)
    np.add.at(changes, bottom, -cost)
    total = np.cumsum(changes)[:height] + np.bincount(np.minimum(top, height - 1), minlength=height) * SETUP_COST
    return np.asarray(total * (len(vertices) / len(some)))


def part_of(arrays: Any, some: slice) -> Any:
    """Return some rows of an array, or of each of several."""
    return tuple(array[some] for array in arrays) if isinstance(arrays, tuple) else arrays[some]


def run_rows(
    kernel: Callable[..., None], target: Any, vertices: Array, values: Any, sampling: Sampling, stop: Event, room: Room,
    top: int | None = None,
) -> None:  # fmt: skip
    """Run a kernel for the rows of a sampling, in chunks so that an interrupt is noticed.

    Parameters
    ----------
    kernel : flat_words, or another of the same form.
    target : (h, W) int32, or several arrays that the kernel writes.
    vertices : (N, 3, 2) corners in pixels, checked; kernels get float64, a chunk at a time if they are float32.
    values : (N, ...), or several of them, as the kernel takes them.
    sampling : with the rows of one band.
    stop : set where no more is wanted.
    room : for as many rows.
    top : the row of the image that target begins with; by default the first of the sampling.
    """
    top = sampling.y_start if top is None else top
    parts = target if isinstance(target, tuple) else (target,)
    flats, width = tuple(part.reshape(-1) for part in parts), parts[0].shape[1]
    flat = flats if isinstance(target, tuple) else flats[0]
    for first in range(0, len(vertices), CHUNK):
        if not stop.is_set():
            some = slice(first, first + CHUNK)
            corners = in_layout(vertices[some], np.float64)
            kernel(flat, width, corners, part_of(values, some), room, top, 0, len(corners), sampling)


def run_flat(kernel: Callable[..., None], target: Any, vertices: Array, values: Any, sampling: Sampling, threads: int) -> None:
    """Run a kernel over all triangles, in bands of rows that cost alike.

    The parameters are those of run_rows, but for `threads`: how many share the rows of the image.
    """

    def fill_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        within = sampling._replace(y_start=y_start, y_end=y_end)
        run_rows(kernel, part_of(target, slice(y_start, y_end)), vertices, values, within, stop, make_room(y_end - y_start))

    share_rows(fill_band, (sampling.y_end, sampling.x_end), vertices, threads)


def share_rows(
    work: Callable[[int, int, Event], None], shape: tuple[int, ...], vertices: Array, threads: int, passes: int = 1,
    is_deep: bool = False,
) -> None:  # fmt: skip
    """Call `work(y_start, y_end, stop)` for bands of rows that cost alike to paint, `passes` or more.

    Where triangles cost much more than to pass over them, bands are so small that they stay in the cache, and two a thread; but
    passing over them must not take longer than half of their painting, which it would in very large pictures. Those that lie
    deep are hardly painted, and so passed over once a thread.
    """
    count, height, pixels = len(vertices), shape[0], shape[0] * shape[1]
    if count == 0:
        return
    if count < SMALL and (threads == 1 or pixels < SMALL_IMAGE):
        run_bands(work, height, 1, passes)
        return
    costs = row_costs(vertices, height)
    mean = costs.sum() / count
    if mean > 20 * SCAN_COST and not is_deep:
        passes = max(passes, -(-4 * pixels // PASS_BYTES))
    passes = max(1, min(passes, int(mean / (2 * SCAN_COST))))
    run_bands(work, height, threads, passes, each=2 if mean > 20 * SCAN_COST * threads and not is_deep else 1, costs=costs)


def fill_rows(target: Int32Array, vertices: Array, words: Int32Array, sampling: Sampling, is_deep: bool, stop: Event) -> None:
    """Paint triangles in order, each in one word, into the rows of a sampling; the parameters are those of run_rows.

    Where they lie deep, they are drawn from the last to the first, which is the same picture.
    """
    if not is_deep:
        run_rows(flat_words, target, vertices, words, sampling, stop, make_room(len(target)))
        return
    room, (taken, still_open) = np.empty((2, len(target)), np.int64), room_for_bits(*target.shape)
    for last in range(len(vertices), 0, -CHUNK):
        if not stop.is_set():
            first = max(last - CHUNK, 0)
            corners = in_layout(vertices[first:last], np.float64)
            covered_words(
                target, corners, words[first:last], room, taken, still_open, sampling.y_start, 0, last - first, sampling
            )  # fmt: skip


def lie_deep(vertices: Array, shape: tuple[int, ...]) -> bool:
    """Say whether triangles are large and lie many deep in a picture, as far as some of them tell."""
    count, pixels = len(vertices), shape[0] * shape[1]
    if count < DEEP:
        return False
    some = in_layout(vertices[:: max(1, count // TOLD)], np.float64)
    mean = measure_boxes(some, float(shape[1]), float(shape[0]))[1] / len(some)
    return mean >= LARGE_BOX and mean * count >= DEEP * pixels


def paint_flat(target: Int32Array, vertices: Array, words: Int32Array, sampling: Sampling, threads: int) -> None:
    """Paint triangles in order, each in one word; the parameters are those of run_flat."""
    is_deep = lie_deep(vertices, target.shape)

    def fill_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        within = sampling._replace(y_start=y_start, y_end=y_end)
        fill_rows(target[y_start:y_end], vertices, words, within, is_deep, stop)

    share_rows(fill_band, target.shape, vertices, threads, is_deep=is_deep)
