"""Visibility: which triangle is seen at each sample and how deep, and the one way to find that out.

The buffers live here; the algorithms of raster/ fill them through the writers. What comes out is in terms of slots, the rows of
ScreenTriangles; the numbers of the caller's triangles follow from them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from scanspan.bands import run_bands
from scanspan.errors import InputError
from scanspan.jit import kernel
from scanspan.memory import borrow
from scanspan.raster.algorithms import run
from scanspan.raster.counters import BREACHES, COUNTERS, NAMES
from scanspan.raster.options import OffscreenPoint, make_sampling
from scanspan.raster.trapezoids import draw_polygons
from scanspan.raster.write import EMPTY_KEY, unpack_depth, unpack_number
from scanspan.records import (
    Array,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    Integer,
    Sampling,
    ScreenPolygons,
    ScreenTriangles,
)
from scanspan.samples import sample_offsets
from scanspan.shade.interpolate import (
    barycentric_kernel,
    interpolate_codes_kernel,
    interpolate_float32_rows_kernel,
    interpolate_rows_kernel,
    numbers_kernel,
)
from scanspan.target.merge import merge_kernel

UNPACKED = 256  # keys looked at together for whether all are empty
NOT_TWICE = np.empty((0, 0), np.int32)
POINTS_WORTH = 4  # pixels for each point, from which on it is worth finding out where the points lie
INTERPOLATE: dict[np.dtype[Any], Callable[..., None]] = {
    np.dtype(np.float64): interpolate_rows_kernel, np.dtype(np.float32): interpolate_float32_rows_kernel,
    np.dtype(np.uint8): interpolate_codes_kernel,
}  # fmt: skip


class RasterOptions(NamedTuple):
    """How to rasterize, all checked."""

    size: tuple[int, int]
    algorithm: str
    order: str
    rule: str | OffscreenPoint
    cull: str
    subpixel_bits: int
    depth_bits: int
    threads: int
    coverage: str = "sample"


class Plane(NamedTuple):
    """What is seen at one sample of every pixel."""

    offset: Array  # (2,) int64, the sample's place in the pixel in sub-pixels
    slot: Int32Array  # (H, W) row of ScreenTriangles, -1 nothing
    depth: Array  # (H, W) float32 or float64, -inf nothing


@kernel
def unpack_kernel(
    keys: Int64Array, slot: Int32Array, same: Int32Array, depth: Float32Array, x_start: Integer, x_end: Integer,
) -> None:  # fmt: skip
    """Split keys into slots and depths, and write the slots twice where two arrays are given.

    Shapes  keys: (h, W) int64, of which columns x_start to x_end are looked at, and the others are empty; slot: (h, W) int32;
            same: (h, W) or (0, W) int32; depth: (h, W) float32.
    """
    is_twice, step, width = same.shape[0] > 0, np.uint64(UNPACKED), np.uint64(keys.shape[1])
    first, end = np.uint64(x_start), np.uint64(x_end)
    for j in range(keys.shape[0]):
        for i in range(np.uint64(0), first):
            slot[j, i], depth[j, i] = np.int32(-1), np.float32(-np.inf)
        start = first
        while start < end:
            last, high = min(start + step, end), EMPTY_KEY
            for i in range(start, last):
                high = max(high, keys[j, i])
            if high == EMPTY_KEY:
                for i in range(start, last):
                    slot[j, i], depth[j, i] = np.int32(-1), np.float32(-np.inf)
            else:
                for i in range(start, last):
                    key = keys[j, i]
                    slot[j, i] = np.int32(-1) if key == EMPTY_KEY else np.int32(unpack_number(key))
                    depth[j, i] = np.float32(-np.inf) if key == EMPTY_KEY else unpack_depth(key)
            start = last
        for i in range(end, width):
            slot[j, i], depth[j, i] = np.int32(-1), np.float32(-np.inf)
        for i in range(np.uint64(0), width if is_twice else np.uint64(0)):
            same[j, i] = slot[j, i]


def find_rectangle(triangles: ScreenTriangles, offset: Array, options: RasterOptions) -> tuple[int, int, int, int]:
    """Return x_start, x_end, y_start and y_end of pixels beyond which nothing is drawn, where that is worth finding out."""
    (width, height), s = options.size, options.subpixel_bits
    is_plain = options.coverage == "sample" and not len(triangles.lines) and not len(triangles.weights)
    if not is_plain or not 0 < len(triangles.xy) <= width * height // POINTS_WORTH:
        return 0, width, 0, height
    x, y = triangles.xy[:, 0], triangles.xy[:, 1]  # reducing an axis of two takes thirty times as long
    low_x, high_x, low_y, high_y = x.min(), x.max(), y.min(), y.max()
    left, top = min(max(int(low_x - offset[0]) >> s, 0), width), min(max(int(low_y - offset[1]) >> s, 0), height)
    right, bottom = (int(high_x - offset[0]) >> s) + 1, (int(high_y - offset[1]) >> s) + 1
    return left, max(min(right, width), left), top, max(min(bottom, height), top)


def sampling_of(offset: Array, options: RasterOptions) -> Sampling:
    """Return the Sampling of a whole image at one sample position."""
    return make_sampling(
        options.size, offset, rule=options.rule, cull=options.cull, subpixel_bits=options.subpixel_bits,
        coverage=options.coverage,
    )  # fmt: skip


def find_visible(
    triangles: ScreenTriangles, offset: Array, options: RasterOptions, polygons: ScreenPolygons | None = None,
    copy: Int32Array | None = None,
) -> Plane:  # fmt: skip
    """Rasterize triangles at one sample position and keep the nearest at each pixel.

    Parameters
    ----------
    triangles : from geometry.
    offset : (2,) the sample's place in the pixel, sub-pixels.
    options : the checked options.
    polygons : the rings of those among the triangles that stand for a polygon.
    copy : (H, W), written with the slots, too, where there are no polygons.
    """
    width, height = options.size
    sampling = sampling_of(offset, options)
    if polygons is not None:
        drawn, row = draw_polygons(triangles, polygons, sampling)
        seen = find_visible(drawn, offset, options)
        return seen._replace(slot=numbers_of(seen.slot, row))
    if options.depth_bits == 64:
        pairs = np.empty((height, width, 2))
        pairs[...] = (-np.inf, -1.0)
        run(options.algorithm, options.order, "pairs", pairs, triangles, sampling, options.threads)
        slot = pairs[..., 1].astype(np.int32)
        if copy is not None:
            copy[...] = slot
        return Plane(offset, slot, pairs[..., 0].copy())

    keys, (x_start, x_end, top, bottom) = borrow((height, width), np.int64), find_rectangle(triangles, offset, options)
    keys[top:bottom, x_start:x_end] = EMPTY_KEY
    run(options.algorithm, options.order, "keys", keys, triangles, sampling, options.threads)
    slot, depth = borrow((height, width), np.int32), borrow((height, width), np.float32)

    def unpack(y_start: int, y_end: int, stop: Event) -> None:
        """Split the keys of one band; above and below the rectangle there are none."""
        first, last = min(max(top, y_start), y_end), min(max(bottom, y_start), y_end)
        for start, end, columns in ((y_start, first, (0, 0)), (first, last, (x_start, x_end)), (last, y_end, (0, 0))):
            rows = slice(start, end)
            unpack_kernel(keys[rows], slot[rows], NOT_TWICE if copy is None else copy[rows], depth[rows], *columns)

    run_bands(unpack, height, options.threads)
    return Plane(offset, slot, depth)


def find_visible_rows(
    triangles: ScreenTriangles, reach: Int64Array, offset: Array, options: RasterOptions, rows: tuple[int, int],
    polygons: ScreenPolygons | None = None,
) -> Plane:  # fmt: skip
    """Return what some rows see, from the first to before the last, of the triangles that reach into them alone.

    To the kernels it is an image of its own, whose samples lie that many pixels further down. `reach` is from `y_range`.
    """
    (y_start, y_end), s = rows, options.subpixel_bits
    reaches = (reach[1] >= y_start << s) & (reach[0] < y_end << s)
    if polygons is not None:
        reaches[polygons.slot] = True
    near = np.flatnonzero(reaches)
    within = triangles._replace(
        corners=triangles.corners[near], source=triangles.source[near], piece=triangles.piece[near],
        inner=triangles.inner[near], outline=triangles.outline[near],
    )  # fmt: skip
    band = options._replace(size=(options.size[0], y_end - y_start))
    if polygons is not None:
        polygons = polygons._replace(slot=np.searchsorted(near, polygons.slot).astype(np.int32))
    seen = find_visible(within, offset + np.array([0, y_start << s]), band, polygons)
    return Plane(offset, numbers_of(seen.slot, near.astype(np.int32)), seen.depth)


def y_range(triangles: ScreenTriangles) -> Int64Array:
    """Return the lowest and the highest y of every triangle in sub-pixels, (2, N)."""
    y = triangles.xy[:, 1][triangles.corners]
    reach = np.stack([y.min(axis=1, initial=1 << 62), y.max(axis=1, initial=-1 << 62)])
    outlined = triangles.outline >= 0
    reach[:, outlined] = triangles.limits[triangles.outline[outlined], 2:4].T
    return reach


def find_barycentric(plane: Plane, triangles: ScreenTriangles, options: RasterOptions) -> Float64Array:
    """Return the (H, W, 3) perspective-correct weights of the source triangles' corners, 0 where there is nothing."""
    out = np.empty((*plane.slot.shape, 3))

    def weigh(y_start: int, y_end: int, stop: Event) -> None:
        """Find the weights of one band."""
        barycentric_kernel(
            plane.slot[y_start:y_end], triangles, plane.offset[0], plane.offset[1], options.subpixel_bits, y_start,
            out[y_start:y_end],
        )  # fmt: skip

    run_bands(weigh, options.size[1], options.threads)
    return out


def numbers_of(slot: Int32Array, number: Int32Array) -> Int32Array:
    """Return the number of the thing in each slot of a plane, -1 where there is nothing."""
    found = borrow(slot.shape, np.int32)
    numbers_kernel(slot.reshape(-1), number, found.reshape(-1))
    return found


class Counted(NamedTuple):
    """What is needed to count the work of a rasterization."""

    triangles: Int32Array
    screen: ScreenTriangles
    offsets: Array
    options: RasterOptions


@dataclass(frozen=True, eq=False)
class Visibility:
    """What `rasterize` found at every sample.

    Attributes
    ----------
    primitive : (H, W) or (H, W, S) int32, the triangle that is seen, -1 where there is none.
    depth : the same shape, float32 or float64: 1 at the near plane and 0 at z = w, -inf where there is nothing.
    barycentric : (H, W, 3) or (H, W, S, 3) float64, perspective-correct weights of the triangle's corners; computed
        when asked for.
    counters : what it took. How many triangles came, were cut by a plane, lay outside one, and were drawn; and the work of the
        algorithm: samples_tested, edge_evaluations, spans, depth_tests, writes, subdivisions, and insertions and swaps in its
        list. The work is counted in a run of its own when it is asked for, on one thread, as bands would count twice.
    """

    primitive: Array
    depth: Array
    triangles: Int32Array = field(repr=False)
    planes: tuple[Plane, ...] = field(repr=False, default=())
    screen: ScreenTriangles | None = field(repr=False, default=None)
    options: RasterOptions | None = field(repr=False, default=None)
    parts: tuple[Counted, ...] = field(repr=False, default=())

    @cached_property
    def counters(self) -> Mapping[str, int]:
        """Triangles and work, by name."""
        total: dict[str, int] = {}
        for part in self.parts:
            for name, value in count_work(*part).items():
                total[name] = total.get(name, 0) + value
        return total

    @cached_property
    def barycentric(self) -> Float64Array:
        """Perspective-correct weights, (H, W, 3) or (H, W, S, 3) float64."""
        if self.screen is None or self.options is None:
            raise InputError("a merged Visibility has no barycentric weights: take them before merging")
        weights = [find_barycentric(plane, self.screen, self.options) for plane in self.planes]
        return weights[0] if len(weights) == 1 else np.stack(weights, axis=2)


def is_whole(screen: ScreenTriangles) -> bool:
    """Say whether all triangles that came are there and none was cut, so that slots are their numbers."""
    count = len(screen.source)
    return not len(screen.weights) and count > 0 and int(screen.source[-1]) == count - 1


def count_triangles(triangles: Int32Array, screen: ScreenTriangles) -> dict[str, int]:
    """Return how many triangles came, were cut by a plane, lay outside one, and how many are drawn in all."""
    pieces = screen.source[screen.piece >= 0]
    cut = int((np.diff(pieces, prepend=-1) != 0).sum())
    outside = len(triangles) - (len(screen.corners) - len(pieces)) - cut
    return {"triangles": len(triangles), "cut": cut, "outside": outside, "drawn": len(screen.corners)}


def count_work(triangles: Int32Array, screen: ScreenTriangles, offsets: Array, options: RasterOptions) -> dict[str, int]:
    """Return how many triangles came and what became of them, and the work that the algorithm does on them.

    The run checks what the lectures say of a sweep: the list is in order and empty at the end, each sample is set once.

    Raises
    ------
    RuntimeError : if that is not so, which would be a fault of the algorithm.
    """
    width, height = options.size
    counted, samples = np.zeros(COUNTERS, np.int64), np.zeros(3, np.int64)
    tallies = np.empty((height, width, 4), np.int64)
    for offset in offsets:
        tallies[...] = (EMPTY_KEY, 0, 0, 0)
        counted += run(options.algorithm, options.order, "tallies", tallies, screen, sampling_of(offset, options), 1)
        samples += tallies[..., 1:].sum(axis=(0, 1))
    for breach, times in zip(BREACHES, counted[-len(BREACHES) :].tolist(), strict=True):
        if times:
            raise RuntimeError(f"{options.algorithm}: {breach}, {times} times")
    tested, covered, written = samples.tolist()
    work = dict(zip(NAMES, counted.tolist(), strict=False))
    return {
        **count_triangles(triangles, screen),
        "samples_tested": work["samples_tested"] + tested, "edge_evaluations": work["edge_evaluations"],
        "spans": work["spans"], "depth_tests": work["depth_tests"] + covered, "writes": written,
        "subdivisions": work["subdivisions"], "insertions": work["insertions"], "swaps": work["swaps"],
    }  # fmt: skip


def rasterize_triangles(screen: ScreenTriangles, triangles: Int32Array, samples: int, options: RasterOptions) -> Visibility:
    """Rasterize triangles at every sample and return what is seen, by the number of the input triangle."""
    offsets = sample_offsets(samples, options.subpixel_bits)
    whole, (width, height) = is_whole(screen), options.size
    copies = [borrow((height, width), np.int32) if whole else None for _ in offsets]
    planes = tuple(find_visible(screen, offset, options, copy=copy) for offset, copy in zip(offsets, copies, strict=True))
    primitive = [
        numbers_of(plane.slot, screen.source) if copy is None else copy for plane, copy in zip(planes, copies, strict=True)
    ]
    return Visibility(
        primitive=primitive[0] if samples == 1 else np.stack(primitive, axis=2),
        depth=planes[0].depth if samples == 1 else np.stack([plane.depth for plane in planes], axis=2),
        triangles=triangles,
        planes=planes,
        screen=screen,
        options=options,
        parts=(Counted(triangles, screen, offsets, options),),
    )


def interpolate_visible(visibility: Visibility, values: Array) -> Array:
    """Return (..., k) per-vertex values at every sample of a Visibility, 0 where there is nothing, in the type of the values.

    Parameters
    ----------
    visibility : from `rasterize_triangles`.
    values : (V, k), of a type of INTERPOLATE.
    """
    if visibility.screen is None or visibility.options is None:
        raise InputError("a merged Visibility has no barycentric weights: take them before merging")
    screen, options, (width, height) = visibility.screen, visibility.options, visibility.options.size
    source = np.empty(0, np.int32) if is_whole(screen) else screen.source
    kernel = INTERPOLATE[values.dtype]
    found = []
    for plane in visibility.planes:
        out = borrow((height, width, values.shape[1]), values.dtype)

        def shade(y_start: int, y_end: int, stop: Event, plane: Plane = plane, out: Array = out) -> None:
            """Interpolate in the rows of one band."""
            rows = slice(y_start, y_end)
            kernel(
                plane.slot[rows], screen, source, plane.offset[0], plane.offset[1], options.subpixel_bits, y_start,
                visibility.triangles, values, out[rows],
            )  # fmt: skip

        run_bands(shade, height, options.threads)
        found.append(out)
    return found[0] if len(found) == 1 else np.stack(found, axis=2)


def merge(a: Visibility, b: Visibility) -> Visibility:
    """Return the nearer of two Visibilities at every sample; equal depths go to the lower primitive number.

    The two must have the same shape and depth type, and their primitives must be numbered through both.

    Raises
    ------
    InputError : when shapes or types differ.
    """
    for name, value in (("a", a), ("b", b)):
        if not isinstance(value, Visibility):
            raise InputError(f"merge: {name} must be a Visibility, got {type(value).__name__}")
    if a.primitive.shape != b.primitive.shape or a.depth.dtype != b.depth.dtype:
        both = f"{a.primitive.shape} {a.depth.dtype} and {b.primitive.shape} {b.depth.dtype}"
        raise InputError(f"merge: {both} must have the same shape and type")
    depth, primitive = a.depth.copy(), a.primitive.copy()
    merge_kernel(depth.reshape(-1), primitive.reshape(-1), b.depth.reshape(-1), b.primitive.reshape(-1))
    return Visibility(primitive, depth, a.triangles, parts=a.parts + b.parts)
