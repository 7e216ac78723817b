"""Triangles in one value each, painted in order, straight from their corners in pixels: the quick way to fill a canvas.

Bands of rows are shared by threads. Each scans all triangles, which takes a few nanoseconds for one that lies elsewhere, so
there are as few bands as there are threads where triangles are small; the rows are cut so that all have as much to do, as far
as a few thousand of the triangles tell. More bands than threads even out what that does not foresee, where triangles are large.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event

import numpy as np

from scanspan.jit import bare_kernel
from scanspan.raster.algorithms import CHUNK, SMALL, SMALL_IMAGE, run_bands
from scanspan.raster.flat import scan_flat
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Sampling, UInt8Array
from scanspan.target.blend import one_word, write_word

WORD_LANES = np.int64(16)  # 32-bit words in a vector of 64 bytes
TOLD = 4096  # triangles that are looked at to cut rows into bands

# Costs in nanoseconds, roughly: of a triangle's setup, of passing over it, and of each of its rows and vectors.
SETUP_COST, SCAN_COST, ROW_COST, VECTOR_COST = 20.0, 4.0, 1.5, 1.0


@bare_kernel
def flat_words(
    target: Int32Array, vertices: Float64Array, words: Int32Array, ends: Int64Array, top: int, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Half-space into (H, W) words of 32 bits, one a triangle."""
    scan_flat(one_word, write_word, WORD_LANES, target, vertices, words, ends, top, first, last, sampling)


def as_words(codes: UInt8Array, count: int) -> Int32Array:
    """Return (4,) or (N, 4) colours as N words of 32 bits, as a picture has them."""
    words = np.ascontiguousarray(codes).view(np.int32)[..., 0]
    return np.ascontiguousarray(words) if words.ndim else np.full(count, words, np.int32)


def row_costs(vertices: Float64Array, height: int) -> Float64Array:
    """Return what each row of a picture costs to paint, (height,), in nanoseconds, from some of the triangles."""
    some = vertices[:: max(1, len(vertices) // TOLD)]
    low, high = some.min(axis=1), some.max(axis=1)
    top, bottom = (np.clip(y, 0, height).astype(np.int64) for y in (low[:, 1], high[:, 1] + 1))
    cost = ROW_COST + VECTOR_COST * np.ceil((high[:, 0] - low[:, 0]) / float(WORD_LANES))
    changes = np.zeros(height + 1)
    np.add.at(changes, top, cost)
    np.add.at(changes, bottom, -cost)
    total = np.cumsum(changes)[:height] + np.bincount(np.minimum(top, height - 1), minlength=height) * SETUP_COST
    return np.asarray(total * (len(vertices) / len(some)))


def run_rows(
    kernel: Callable[..., None], target: Int32Array, vertices: Float64Array, values: Array, sampling: Sampling, stop: Event
) -> None:
    """Run a kernel for the rows of a sampling, which target begins with, in chunks so that an interrupt is noticed.

    Parameters
    ----------
    kernel : flat_words, or another of the same form.
    target : (h, W) int32.
    vertices : (N, 3, 2) corners in pixels, checked.
    values : (N, ...), as the kernel takes them.
    sampling : with the rows of one band.
    stop : set where no more is wanted.
    """
    count, ends = len(vertices), np.empty((2, len(target)), np.int64)
    for first in range(0, count, CHUNK):
        if not stop.is_set():
            kernel(target, vertices, values, ends, sampling.y_start, first, min(first + CHUNK, count), sampling)


def run_flat(
    kernel: Callable[..., None], target: Int32Array, vertices: Float64Array, values: Array, sampling: Sampling, threads: int
) -> None:
    """Run a kernel over all triangles, in bands of rows that cost alike.

    The parameters are those of run_rows, but for `threads`: how many share the rows of target, (H, W).
    """

    def fill_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        within = sampling._replace(y_start=y_start, y_end=y_end)
        run_rows(kernel, target[y_start:y_end], vertices, values, within, stop)

    share_rows(fill_band, target.shape, vertices, threads)


def share_rows(
    work: Callable[[int, int, Event], None], shape: tuple[int, ...], vertices: Float64Array, threads: int, passes: int = 1
) -> None:
    """Call `work(y_start, y_end, stop)` for bands of rows that cost alike to paint, `passes` or more."""
    count, height = len(vertices), shape[0]
    if threads == 1 or (count < SMALL and height * shape[1] < SMALL_IMAGE):
        run_bands(work, height, 1, passes)
        return
    costs = row_costs(vertices, height)
    is_dear = costs.sum() > 20 * SCAN_COST * threads * count
    run_bands(work, height, threads, passes, each=4 if is_dear else 1, costs=costs)


def paint_flat(target: Int32Array, vertices: Float64Array, words: Int32Array, sampling: Sampling, threads: int) -> None:
    """Paint triangles in order, each in one word; the parameters are those of run_flat."""
    run_flat(flat_words, target, vertices, words, sampling, threads)
