"""The names of the algorithms, and the one way to run one: over bands of the image, in threads, into a target.

Every algorithm paints the same picture, bit for bit. A band of rows has one owner, so there are no locks and any number of
threads gives the same bits.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from queue import SimpleQueue
from threading import Event
from typing import Any

import numpy as np

from scanspan.bands import run_bands
from scanspan.errors import InputError, unknown_name
from scanspan.memory import borrow
from scanspan.raster import half_space
from scanspan.raster.counters import COUNTERS
from scanspan.raster.edge import OFFSCREEN_POINT
from scanspan.raster.setup import FLOATS, INTEGERS, set_up_outlines
from scanspan.raster.write import EMPTY_KEY
from scanspan.records import Array, Int64Array, Sampling, ScreenTriangles

ALGORITHMS = {
    "half-space": "edge equations over the bounding box of each triangle",
    "homogeneous": "edge equations of corners that may lie behind the eye; nothing is clipped",
    "edge-walk": "step down the left and the right edge, and fill the span between them",
    "scanline-eval": "active edge list; evaluate the depth of every active span at each sample",
    "scanline-zrow": "active edge list; render the spans of a row into a depth buffer of one row",
    "span-list": "active edge list and active span list; no row of memory",
    "warnock": "divide the screen until what a window shows is simple",
    "micropolygon": "divide the triangle until its pieces are a few samples large",
}
ORDERS = {
    "rows": "row by row, from left to right",
    "serpentine": "row by row, to and fro",
    "tiles": "blocks of 8 x 8 samples, row by row",
    "morton": "blocks along Morton's curve, a Z in every square",
    "hilbert": "blocks along Hilbert's curve, from neighbour to neighbour",
}
COVERAGES = {
    "sample": "a pixel is covered where its sample is",
    "touched": "where any part of it is: the open pixel meets the open triangle",
    "inside": "where all of it is: the closed pixel lies in the closed triangle",
}

KINDS = ("keys", "pairs", "hits", "tallies")  # the targets of raster/write.py


class Kernels(Mapping[str, Callable[..., None]]):
    """The kernels of a traversal by the kind of target that they write; their modules are imported when one is asked for.

    Most pictures need one traversal, and a start should not wait for all of them. Some kernels may be another traversal's.

    Examples
    --------
    >>> Kernels("warnock.warnock", hits="half_space.half_space_hits")["hits"].__name__
    'half_space_hits'
    """

    def __init__(self, name: str, **shared: str) -> None:
        self.names = {kind: f"{name}_{kind}" for kind in KINDS} | shared

    def __getitem__(self, kind: str) -> Callable[..., None]:
        """Return the kernel for a kind of target."""
        module, name = self.names[kind].split(".")
        kernel: Callable[..., None] = getattr(importlib.import_module(f"scanspan.raster.{module}"), name)
        return kernel

    def __iter__(self) -> Iterator[str]:
        """Go through the kinds."""
        return iter(self.names)

    def __len__(self) -> int:
        """Return how many kinds there are."""
        return len(self.names)


def half_space_name(order: str) -> str:
    """Return the module, and how the names of the kernels begin, of half-space rasterization in an order."""
    return "half_space.half_space" if order == "rows" else f"order.{order}"


# The kernels of each algorithm, by the orders that it knows. What is counted lies on the screen, so that homogeneous
# rasterization needs no hits of its own; and tallies do not need to be fast, so that half-space rasterization borrows them.
HOMOGENEOUS = {name: f"homogeneous_edges.homogeneous_{name}" for name in ORDERS}
HITS = "scanline.scanline_hits"
KERNELS: dict[str, dict[str, Mapping[str, Callable[..., None]]]] = {
    "half-space": {name: Kernels(half_space_name(name), tallies=f"{HOMOGENEOUS[name]}_tallies") for name in ORDERS},
    "homogeneous": {name: Kernels(HOMOGENEOUS[name], hits=f"{half_space_name(name)}_hits") for name in ORDERS},
    "edge-walk": {"rows": Kernels("edge_walk.edge_walk")},
    "scanline-eval": {"rows": Kernels("scanline.scanline_eval", hits=HITS)},
    "scanline-zrow": {"rows": Kernels("scanline.scanline_zrow", hits=HITS)},
    "span-list": {"rows": Kernels("span_list.span_list", hits=HITS)},
    "warnock": dict.fromkeys(ORDERS, Kernels("warnock.warnock")),
    "micropolygon": dict.fromkeys(ORDERS, Kernels("micropolygon.micropolygon")),
}

# The same where whole pixels decide: depths are held to the triangle's range.
PIXEL_KERNELS: dict[str, dict[str, Mapping[str, Callable[..., None]]]] = {
    "half-space": KERNELS["homogeneous"],
    "homogeneous": KERNELS["homogeneous"],
    "warnock": dict.fromkeys(ORDERS, Kernels("warnock.warnock_pixels", hits="warnock.warnock_hits")),
}

CHUNK = 1 << 16  # triangles between two looks at the keyboard
MANY = 1 << 14  # triangles, from which on keys are written for blocks of them; fewer are not worth compiling that for,
HEAVY, LOOKED_AT = 1 << 24, 256  # but if their boxes have so many samples, as far as a few of them tell
CELL_BITS = 7  # of the pixels along a side of the cells by which triangles are ordered
NATURAL = np.empty(0, np.int32)  # the order of triangles in their list
SHARED = 1 << 15  # triangles, from which on threads share them rather than the rows,
LARGE_BOX = 4096.0  # pixels, from which on most of a triangle lies in blocks that may be hidden as a whole
LAYER_BYTES = 1 << 28  # if keys for each thread take no more than that
SMALL = 1 << 12  # triangles, and
PASS_BYTES = 1 << 22  # of a target that one band may have where triangles come in no order
SMALL_IMAGE = 1 << 18  # pixels, below which starting threads costs more than it saves


def check_algorithm(algorithm: str, order: str, coverage: str) -> None:
    """Raise an InputError for names that are not known, or do not go together."""
    for kind, name, valid in (
        ("algorithm", algorithm, ALGORITHMS),
        ("order", order, ORDERS),
        ("coverage", coverage, COVERAGES),
    ):
        if not isinstance(name, str) or name not in valid:
            raise unknown_name(kind, name, valid)
    if order not in KERNELS[algorithm]:
        raise InputError(
            f"order = {order!r}: the algorithm {algorithm!r} knows {', '.join(map(repr, KERNELS[algorithm]))} alone"
        )
    if coverage != "sample" and algorithm not in PIXEL_KERNELS:
        raise InputError(f"coverage = {coverage!r}: known to {', '.join(PIXEL_KERNELS)}, and not to {algorithm}")


def run(
    algorithm: str, order: str, kind: str, target: Array, triangles: ScreenTriangles, sampling: Sampling, threads: int
) -> Int64Array:
    """Scan-convert all triangles into a target, and return what the algorithm counted, (COUNTERS,).

    Parameters
    ----------
    algorithm, order : names of ALGORITHMS and ORDERS that go together.
    kind : "keys", "pairs", "hits" or "tallies": what the target holds.
    target : see raster/write.py.
    triangles : from geometry.
    sampling : the rectangle, sample, rule and coverage.
    threads : how many threads share the rows.
    """
    kernel = choose_kernel(algorithm, order, kind, sampling)
    ordered = sampling._replace(order=list(ORDERS).index(order))
    if kernel is half_space.half_space_keys and sampling.rule != OFFSCREEN_POINT and are_worth_blocks(triangles, sampling):
        return run_blocks(target, triangles, ordered, threads)
    passes = 1 if kind == "tallies" else count_passes(triangles, sampling, target.nbytes)
    return run_kernel(kernel, target, triangles, ordered, threads, passes)


def are_worth_blocks(triangles: ScreenTriangles, sampling: Sampling) -> bool:
    """Say whether there are so many triangles, or so large ones, that the kernel for blocks is worth its compiling."""
    count = len(triangles.corners)
    if not 0 < count < MANY:
        return count > 0
    return mean_box(triangles, sampling) * count >= HEAVY


def mean_box(triangles: ScreenTriangles, sampling: Sampling) -> float:
    """Return how many pixels the boxes of triangles have within an image, as far as a few of them tell."""
    s, some = sampling.subpixel_bits, triangles.xy[triangles.corners[:: -(-len(triangles.corners) // LOOKED_AT)]]
    ends = np.array([(sampling.x_start, sampling.y_start), (sampling.x_end, sampling.y_end)]) << s
    sides = (np.clip(some.max(axis=1), *ends) - np.clip(some.min(axis=1), *ends)) / (1 << s)
    return float(sides.prod(axis=1).mean())


def run_blocks(target: Int64Array, triangles: ScreenTriangles, sampling: Sampling, threads: int) -> Int64Array:
    """Scan-convert many triangles into keys with the kernel for blocks of them, in an order that suits them.

    Those that jump about are drawn by their place; large ones from the nearest on, which hide the others before they are drawn.
    """
    from scanspan.raster import blocks

    near = NATURAL
    if count_passes(triangles, sampling, target.nbytes) > 1:
        across, down = (sampling.x_end >> CELL_BITS) + 1, (sampling.y_end >> CELL_BITS) + 1
        count = len(triangles.corners)
        near, cells, starts = np.empty(count, np.int32), np.empty(count, np.int32), np.zeros(across * down + 1, np.int64)
        blocks.sort_triangles(
            triangles.xy, triangles.corners, sampling.subpixel_bits, CELL_BITS, starts, np.int64(across), cells, near
        )

    elif mean_box(triangles, sampling) >= LARGE_BOX:
        near = np.argsort(-triangles.depth[triangles.corners].mean(axis=1), kind="stable").astype(np.int32)

    def scan(keys: Array, counters: Int64Array, drawn: ScreenTriangles, first: int, last: int, within: Sampling) -> None:
        """Scan some triangles of the order."""
        blocks.block_keys(keys, counters, drawn, near, first, last, within)

    layers = min(threads, 1 + LAYER_BYTES // max(1, target.nbytes), max(2, len(triangles.corners) // (2 * SHARED)))
    if layers == 1 or len(triangles.corners) < SHARED:
        return run_kernel(scan, target, triangles, sampling, threads)
    return run_layers(scan, target, triangles, sampling, layers)


def run_layers(
    scan: Callable[..., None], target: Int64Array, triangles: ScreenTriangles, sampling: Sampling, threads: int
) -> Int64Array:
    """Run a kernel over parts of the triangles, each thread into keys of its own, and keep the largest of each sample.

    A band of rows would have to look at every triangle; of many small ones that is most of the work.
    """
    drawn = with_outlines(triangles, sampling)

    def scan_part(keys: Int64Array, first: int, last: int, stop: Event) -> Int64Array:
        """Scan some triangles, in chunks so that an interrupt is noticed between them."""
        counters = np.zeros(COUNTERS, np.int64)
        for start in range(first, last, CHUNK):
            if not stop.is_set():
                scan(keys, counters, drawn, start, min(start + CHUNK, last), sampling)
        return counters

    counted = draw_layers(scan_part, target, len(triangles.corners), threads)
    return np.asarray(np.sum(counted, axis=0, initial=0), np.int64)


def draw_layers(
    draw: Callable[[Int64Array, int, int, Event], Any], target: Int64Array, count: int, threads: int,
    empty: int = int(EMPTY_KEY), merge: np.ufunc = np.maximum,
) -> list[Any]:  # fmt: skip
    """Call `draw(keys, first, last, stop)` for parts of `count` things, and keep the largest key of each sample.

    Each thread has keys of its own, which are `empty`, and the first one those of the target; what the calls gave is returned
    in order. `merge` may be another operation in which neither order nor grouping matters.
    """
    free = SimpleQueue[Int64Array | None]()
    others: list[Int64Array] = []
    for keys in (target, *[None] * (threads - 1)):
        free.put(keys)

    def draw_part(first: int, last: int, stop: Event) -> Any:
        """Draw some of them into keys that no other thread has."""
        keys = free.get()
        if keys is None:
            keys = borrow(target.shape, np.int64)
            keys.fill(empty)
            others.append(keys)
        found = draw(keys, first, last, stop)
        free.put(keys)
        return found

    def keep_largest(start: int, end: int, stop: Event) -> None:
        """Merge the rows of one band."""
        for keys in others:
            merge(target[start:end], keys[start:end], out=target[start:end])

    found = run_bands(draw_part, count, threads, each=4)
    if others:
        run_bands(keep_largest, len(target), threads)
    return found


def run_kernel(
    kernel: Callable[..., None], target: Array, triangles: ScreenTriangles, sampling: Sampling, threads: int, passes: int = 1
) -> Int64Array:
    """Run one kernel over bands of the image, and return what it counted."""
    count = len(triangles.corners)

    def scan_band(y_start: int, y_end: int, stop: Event) -> Int64Array:
        """Scan-convert the rows of one band, in chunks so that an interrupt is noticed between them."""
        within, counters = sampling._replace(y_start=y_start, y_end=y_end), np.zeros(COUNTERS, np.int64)
        drawn = with_outlines(triangles, within)
        for first in range(0, count, CHUNK):
            if not stop.is_set():
                kernel(target, counters, drawn, first, min(first + CHUNK, count), within)
        return counters

    height = sampling.y_end
    if threads > 1 and count < SMALL and is_small(triangles.xy, (sampling.x_end, height), sampling.subpixel_bits):
        threads = 1
    counted = run_bands(scan_band, height, threads, passes)
    return np.asarray(np.sum(counted, axis=0, initial=0), np.int64)


def is_small(xy: Int64Array, size: tuple[int, int], subpixel_bits: int) -> bool:
    """Say whether so few pixels of an image lie in the box about points, (N, 2) sub-pixels, that threads would cost more."""
    if size[0] * size[1] < SMALL_IMAGE or not len(xy):
        return True
    low, high = np.clip([xy.min(axis=0) >> subpixel_bits, (xy.max(axis=0) >> subpixel_bits) + 1], 0, size)
    return int((high[0] - low[0]) * (high[1] - low[1])) < SMALL_IMAGE


def with_outlines(triangles: ScreenTriangles, sampling: Sampling) -> ScreenTriangles:
    """Return triangles with their outlines set up for a sampling, if they have any."""
    rows = len(triangles.lines)
    if not rows:
        return triangles
    integers, floats = np.empty((rows, INTEGERS), np.int64), np.empty((rows, FLOATS))
    set_up_outlines(triangles, sampling, integers, floats)
    return triangles._replace(integers=integers, floats=floats)


def choose_kernel(algorithm: str, order: str, kind: str, sampling: Sampling) -> Callable[..., None]:
    """Return the kernel for a target of some kind."""
    return (PIXEL_KERNELS if sampling.coverage else KERNELS)[algorithm][order][kind]


def count_passes(triangles: ScreenTriangles, sampling: Sampling, size: int) -> int:
    """Return into how many bands to cut a target of some bytes so that each is small enough to stay in the cache.

    Only triangles that jump about the picture gain from it: each band scans them all, but then the rows that it writes are
    near. Neighbours that follow each other, as in a mesh, are near anyway. Which of the two it is, a few hundred pairs tell.
    """
    count, y, first = len(triangles.corners), triangles.xy[:, 1], triangles.corners[:, 0]
    if size <= PASS_BYTES or are_in_order(lambda some: y[first[some]], count, sampling.y_end << sampling.subpixel_bits):
        return 1
    return -(-size // PASS_BYTES)


def are_in_order(y_of: Callable[[Int64Array], Array], count: int, height: float) -> bool:
    """Say whether triangles are few, or follow their neighbours and do not jump about a picture; `y_of` gives y of some."""
    if count < SMALL:
        return True
    some = np.linspace(0, count - 2, 512).astype(np.int64)
    return bool(np.median(np.abs(y_of(some + 1) - y_of(some))) <= height / 16)


def run_each(algorithm: str, order: str, kind: str, targets: Array, triangles: ScreenTriangles, sampling: Sampling) -> None:
    """Scan-convert triangle n alone into targets[n], with the same kernel that `run` uses."""
    kernel, counters = choose_kernel(algorithm, order, kind, sampling), np.zeros(COUNTERS, np.int64)
    ordered = sampling._replace(order=list(ORDERS).index(order))
    triangles = with_outlines(triangles, ordered)
    for n in range(len(triangles.corners)):
        kernel(targets[n], counters, triangles, n, n + 1, ordered)
