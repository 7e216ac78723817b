"""The calls that an algorithm makes to set pixels, in order, from the algorithm that ships.

The kernel that draws is taken apart into the plain Python it was compiled from, and put together again with another writer in
the place of the one for samples: it writes the same key, and keeps what it wrote where. So the recording cannot differ from the
picture, and drawing itself pays nothing for it. Only the pixels of a region are recorded, and only triangles that reach into it
are looked at.

Price: some microseconds a sample, a thousand times the kernel's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType
from typing import Any

import numpy as np

from scanspan.assets.framing import parse_up
from scanspan.errors import InputError, LimitError
from scanspan.raster import write
from scanspan.raster.algorithms import choose_kernel, run_kernel
from scanspan.raster.trapezoids import draw_polygons
from scanspan.records import Array, Float32Array, Int32Array, Int64Array, Sampling, ScreenTriangles, UInt8Array
from scanspan.samples import sample_offsets
from scanspan.shade.shading import gather_surfaces, shade_rows
from scanspan.target.frame import Frame
from scanspan.target.resolve import background, resolve
from scanspan.target.visibility import sampling_of

MAX_PIXELS = 1 << 18  # of a region: a million calls take seconds

Region = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False)
class Calls:
    """What was set, in order.

    Attributes
    ----------
    xy : (N, 2) int64, the pixel of each call; x right, y down, from the image's corner.
    color : (N, 4) uint8, what it was set to.
    primitive : (N,) int32, the face, polygon, segment or point that it shows.
    depth : (N,) float32, 1 at the near plane; larger is nearer.
    refused : how many more samples were covered and lay behind what was there.
    size : (width, height) of the image. region : x_start, y_start, x_end, y_end of what was recorded.
    """

    xy: Int64Array
    color: UInt8Array
    primitive: Int32Array
    depth: Float32Array
    refused: int
    size: tuple[int, int]
    region: Region

    def replay(self, behind: Array, count: int | None = None) -> UInt8Array:
        """Return the region after the first `count` calls, or all, (h, w, 4) uint8, drawn over `behind` (h, w, 4)."""
        x_start, y_start, _, _ = self.region
        picture = np.array(behind, dtype=np.uint8)
        for (x, y), color in zip(self.xy[:count].tolist(), self.color[:count]):
            picture[y - y_start, x - x_start] = color
        return picture


def record_calls(frame: Frame, region: Region | None = None) -> Calls:
    """Draw a region of a frame again and return every call that set a pixel.

    Parameters
    ----------
    frame : from `render` with samples=1.
    region : x_start, y_start, x_end, y_end in pixels; the whole image when None.

    Raises
    ------
    InputError : a region that is none or reaches beyond the image.
    LimitError : a region of more than 2^18 pixels.
    """
    region = check_region(region, frame.size)
    options, draw = frame._options, frame._draw
    offset = sample_offsets(1, options.subpixel_bits)[0]
    x_start, y_start, x_end, y_end = region
    sampling = sampling_of(offset, options)._replace(x_start=x_start, x_end=x_end, y_start=y_start, y_end=y_end)
    screen, row = frame._screen, np.arange(len(frame._screen.corners), dtype=np.int32)
    if frame._polygons is not None:
        screen, row = draw_polygons(screen, frame._polygons, sampling)
    near = reaching(screen, sampling)
    screen, row = select(screen, near), row[near]

    # Draw with the recording writer.
    recorder = Recorder(frame.size)
    kernel = choose_kernel(options.algorithm, options.order, "keys", sampling)
    recording = take_apart(kernel, {id(write.write_sample_key): recorder}, {})
    run_window(recording, recorder.target, screen, sampling)
    listed = np.array(recorder.calls, dtype=np.float64).reshape(-1, 4)
    xy, slot = listed[:, :2].astype(np.int64), row[listed[:, 2].astype(np.int64)]
    color = shade_calls(frame, xy, slot)
    primitive = draw.primitive[frame._screen.source[slot]]
    return Calls(xy, color, primitive, listed[:, 3].astype(np.float32), recorder.refused, frame.size, region)


def check_region(region: Any, size: tuple[int, int]) -> Region:
    """Return a region of whole pixels within an image."""
    if region is None:
        region = (0, 0, *size)
    listed = tuple(region) if isinstance(region, (tuple, list, np.ndarray)) else ()
    if len(listed) != 4 or not all(isinstance(v, (int, np.integer)) and not isinstance(v, bool) for v in listed):
        raise InputError(f"region = {region!r}: expected x_start, y_start, x_end, y_end, whole numbers of pixels")
    x_start, y_start, x_end, y_end = (int(v) for v in listed)
    if not (0 <= x_start < x_end <= size[0] and 0 <= y_start < y_end <= size[1]):
        raise InputError(
            f"region = {(x_start, y_start, x_end, y_end)}: expected a part of the image, 0, 0, {size[0]}, {size[1]}"
        )
    if (x_end - x_start) * (y_end - y_start) > MAX_PIXELS:
        raise LimitError(f"region: {x_end - x_start} x {y_end - y_start} pixels are more than the limit of {MAX_PIXELS}")
    return x_start, y_start, x_end, y_end


class Keys(np.ndarray):
    """A target of keys that tells its recorder when a run of a row is copied in; an algorithm may fill a row beforehand."""

    recorder: Recorder | None = None

    def __array_finalize__(self, other: Any) -> None:
        """Give parts of the target its recorder."""
        self.recorder = getattr(other, "recorder", None)

    def __setitem__(self, where: Any, value: Any) -> None:
        """Write, and keep what a run of samples became."""
        if isinstance(where, slice) and self.recorder is not None:
            self.recorder.copy_run(self[where], np.asarray(value))
        super().__setitem__(where, value)


class Recorder:
    """The writer for one sample that keeps what it writes.

    Attributes
    ----------
    target : (H, W) keys.
    calls : x, y, row of the triangles and depth of every sample that was set, in order.
    refused : how many covered samples were not.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.width, self.height = size
        self.target = np.full((self.height, self.width), write.EMPTY_KEY).view(Keys)
        self.target.recorder = self
        self.start = self.target.__array_interface__["data"][0]
        self.calls: list[tuple[int, int, int, float]] = []
        self.refused = 0
        self.pack = take_apart(write.pack_key, {}, {})

    def __call__(self, row: Array, q: int, inside: bool, depth: float, number: int) -> None:
        """Write one sample of a row of keys, as `write_sample_key` does, and keep it."""
        if not inside:
            return
        key = self.pack(np.float64(depth), np.int64(number))
        if key <= row[q]:
            self.refused += 1
            return
        row[q] = key
        self._keep(row, int(q), key)

    def copy_run(self, row: Array, keys: Array) -> None:
        """Keep the samples that a copy changes."""
        for q in np.flatnonzero(row != keys).tolist():
            self._keep(row, q, keys[q])

    def _keep(self, row: Array, q: int, key: int) -> None:
        """Keep a sample, if it lies in the target and not in memory of the algorithm's own."""
        place = (row.__array_interface__["data"][0] + q * row.strides[0] - self.start) // row.itemsize
        y, x = divmod(place, self.width)
        if 0 <= y < self.height:
            word = np.int64(key)
            self.calls.append((x, y, int(write.unpack_number(word)), float(write.unpack_depth(word))))


def take_apart(function: Any, others: dict[int, Any], made: dict[int, Any]) -> Callable[..., Any]:
    """Return a kernel as plain Python, with what it calls taken apart too, and some of that replaced.

    Parameters
    ----------
    function : a kernel. others : what takes the place of a function, by the function's id. made : what was taken apart before.
    """
    if id(function) in others:
        return others[id(function)]  # type: ignore[no-any-return]
    if id(function) not in made:
        source = getattr(function, "py_func", function)
        names = dict(source.__globals__)
        plain = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
        made[id(function)] = plain
        for name in source.__code__.co_names:
            value = names.get(name)
            if id(value) in others or hasattr(value, "py_func") or _is_ours(value):
                names[name] = take_apart(value, others, made)
    return made[id(function)]  # type: ignore[no-any-return]


def _is_ours(value: Any) -> bool:
    """Say whether something is a function of this package, as kernels are where the compiler is switched off."""
    return isinstance(value, FunctionType) and value.__module__.startswith("scanspan.raster")


def reaching(screen: ScreenTriangles, sampling: Sampling) -> Int64Array:
    """Return the rows of the triangles that may reach into the rectangle of a sampling."""
    low = np.array([sampling.x_start, sampling.y_start]) << sampling.subpixel_bits
    high = np.array([sampling.x_end, sampling.y_end]) << sampling.subpixel_bits
    corners = screen.xy[screen.corners]
    lowest, highest = corners.min(axis=1), corners.max(axis=1)
    outlined = screen.outline >= 0
    limits = screen.limits[screen.outline[outlined]]
    lowest[outlined], highest[outlined] = limits[:, [0, 2]], limits[:, [1, 3]]
    return np.flatnonzero(((highest >= low) & (lowest <= high)).all(axis=1))


def select(screen: ScreenTriangles, rows: Int64Array) -> ScreenTriangles:
    """Return some of the triangles."""
    return screen._replace(
        corners=screen.corners[rows], source=screen.source[rows], piece=screen.piece[rows], inner=screen.inner[rows],
        outline=screen.outline[rows],
    )  # fmt: skip


def run_window(kernel: Callable[..., Any], target: Array, screen: ScreenTriangles, sampling: Sampling) -> None:
    """Run a kernel that is plain Python over the rectangle of a sampling."""
    window = (sampling.y_start, sampling.y_end)

    def within(target: Array, counters: Array, drawn: ScreenTriangles, first: int, last: int, band: Sampling) -> None:
        """Keep to the rows of the window."""
        kernel(target, counters, drawn, first, last, band._replace(y_start=window[0], y_end=window[1]))

    with np.errstate(all="ignore"):
        run_kernel(within, target, screen, sampling, 1)


def shade_calls(frame: Frame, xy: Int64Array, slot: Int32Array) -> UInt8Array:
    """Return the colour of each call, (N, 4) uint8: what the picture would show if nothing nearer came after it."""
    draw, options = frame._draw, frame._options
    up = parse_up(frame.scene.up)
    surfaces = gather_surfaces(frame.scene, draw, frame.camera, frame.size, up, frame._look)
    behind = background("black", frame.size)
    offset = sample_offsets(1, options.subpixel_bits)[0]
    colors = np.zeros((len(xy), 4), np.uint8)
    width, height = frame.size

    # Shade the first calls of all pixels together, then the second ones, and so on.
    pixel = xy[:, 1] * width + xy[:, 0]
    order = np.argsort(pixel, kind="stable")
    sorted_pixels = pixel[order]
    starts = np.flatnonzero(np.diff(sorted_pixels, prepend=-1))
    turn = np.empty(len(xy), np.int64)
    turn[order] = np.arange(len(xy)) - np.repeat(starts, np.diff(np.append(starts, len(xy))))
    for number in range(int(turn.max(initial=-1)) + 1):
        some = np.flatnonzero(turn == number)
        slots = np.full((height, width), -1, np.int32)
        slots[xy[some, 1], xy[some, 0]] = slot[some]
        rows = np.flatnonzero((slots >= 0).any(axis=1))
        first, last = int(rows[0]), int(rows[-1]) + 1
        sums = np.zeros((last - first, width, 4), np.float32)
        shade_rows(
            frame.scene, draw, frame._screen, surfaces, slots[first:last], offset, options.subpixel_bits, first, sums
        )  # fmt: skip
        picture = resolve(sums, 1, behind)
        colors[some] = picture[xy[some, 1] - first, xy[some, 0]]
    return colors
