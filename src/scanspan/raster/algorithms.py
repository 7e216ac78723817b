"""The names of the algorithms, and the one way to run one: over bands of the image, in threads, into a target.

Every algorithm paints the same picture, bit for bit. A band of rows has one owner, so there are no locks and any number of
threads gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from threading import Event
from types import ModuleType
from typing import Any

import numpy as np

from scanspan.errors import InputError, unknown_name
from scanspan.raster import edge_walk, half_space, micropolygon, scanline, span_list, warnock
from scanspan.raster import order as orders
from scanspan.records import Array, Sampling, ScreenTriangles

ALGORITHMS = {
    "half-space": "edge equations over the bounding box of each triangle",
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
COVERAGES = {"sample": "a pixel is covered where its sample is"}

KINDS = ("keys", "pairs", "hits")  # the targets of raster/write.py


def kernels_of(module: ModuleType, name: str, **shared: Callable[..., None]) -> dict[str, Callable[..., None]]:
    """Return the kernels of a traversal by the kind of target that they write; some may be shared with others."""
    return {kind: shared[kind] if kind in shared else getattr(module, f"{name}_{kind}") for kind in KINDS}


# The kernels of each algorithm, by the orders that it knows.
KERNELS: dict[str, dict[str, dict[str, Callable[..., None]]]] = {
    "half-space": {
        "rows": kernels_of(half_space, "half_space"),
        **{name: kernels_of(orders, name) for name in ORDERS if name != "rows"},
    },
    "edge-walk": {"rows": kernels_of(edge_walk, "edge_walk")},
    "scanline-eval": {"rows": kernels_of(scanline, "scanline_eval", hits=scanline.scanline_hits)},
    "scanline-zrow": {"rows": kernels_of(scanline, "scanline_zrow", hits=scanline.scanline_hits)},
    "span-list": {"rows": kernels_of(span_list, "span_list", hits=scanline.scanline_hits)},
    "warnock": {"rows": kernels_of(warnock, "warnock")},
    "micropolygon": {"rows": kernels_of(micropolygon, "micropolygon")},
}

CHUNK = 1 << 16  # triangles between two looks at the keyboard
SMALL = 1 << 12  # triangles, and
PASS_BYTES = 1 << 22  # of a target that one band may have where triangles come in no order
SMALL_IMAGE = 1 << 18  # pixels, below which starting threads costs more than it saves


def check_algorithm(algorithm: str, order: str, coverage: str) -> None:
    """Raise an InputError for a name that is not known."""
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


def run(
    algorithm: str, order: str, kind: str, target: Array, triangles: ScreenTriangles, sampling: Sampling, threads: int
) -> None:
    """Scan-convert all triangles into a target.

    Parameters
    ----------
    algorithm, order : names of ALGORITHMS and ORDERS that go together.
    kind : "keys", "pairs" or "hits": what the target holds.
    target : (H, W) or (H, W, 2), see raster/write.py.
    triangles : from geometry.
    sampling : the rectangle, sample and rule.
    threads : how many threads share the rows.
    """
    kernel = KERNELS[algorithm][order][kind]
    count = len(triangles.corners)

    def scan_band(y_start: int, y_end: int, stop: Event) -> None:
        """Scan-convert the rows of one band, in chunks so that an interrupt is noticed between them."""
        within = sampling._replace(y_start=y_start, y_end=y_end)
        for first in range(0, count, CHUNK):
            if not stop.is_set():
                kernel(target, triangles, first, min(first + CHUNK, count), within)

    height, width = sampling.y_end, sampling.x_end
    if count < SMALL and height * width < SMALL_IMAGE:
        threads = 1
    run_bands(scan_band, height, threads, count_passes(triangles, sampling, target.nbytes))


def count_passes(triangles: ScreenTriangles, sampling: Sampling, size: int) -> int:
    """Return into how many bands to cut a target of some bytes so that each is small enough to stay in the cache.

    Only triangles that jump about the picture gain from it: each band scans them all, but then the rows that it writes are
    near. Neighbours that follow each other, as in a mesh, are near anyway. Which of the two it is, a few hundred pairs tell.
    """
    count = len(triangles.corners)
    if size <= PASS_BYTES or count < SMALL:
        return 1
    some = np.linspace(0, count - 2, 512).astype(np.int64)
    y = triangles.xy[:, 1]
    jumps = np.abs(y[triangles.corners[some + 1, 0]] - y[triangles.corners[some, 0]]) >> sampling.subpixel_bits
    return -(-size // PASS_BYTES) if np.median(jumps) > sampling.y_end / 16 else 1


def run_bands(work: Callable[[int, int, Event], Any], height: int, threads: int, passes: int = 1) -> list[Any]:
    """Call `work(y_start, y_end, stop)` for bands of rows and return what it gave, from the top band to the bottom one.

    At least `passes` bands, and two a thread, so that one that finishes early has something to do. `stop` is set when the
    others need not go on.
    """
    stop = Event()
    count = max(1, min(max(passes, 2 * threads if threads > 1 else 1), height))
    edges = [height * i // count for i in range(count + 1)]
    if threads == 1 or count == 1:
        return [work(y_start, y_end, stop) for y_start, y_end in pairwise(edges)]
    with ThreadPoolExecutor(threads) as pool:
        try:
            return list(pool.map(work, edges[:-1], edges[1:], [stop] * count))
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


def run_each(algorithm: str, order: str, kind: str, targets: Array, triangles: ScreenTriangles, sampling: Sampling) -> None:
    """Scan-convert triangle n alone into targets[n], with the same kernel that `run` uses."""
    kernel = KERNELS[algorithm][order][kind]
    for n in range(len(triangles.corners)):
        kernel(targets[n], triangles, n, n + 1, sampling)
