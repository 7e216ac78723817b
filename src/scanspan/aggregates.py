"""Aggregates: how many points, lines or triangles fall on each pixel, or what their values come to. For plots of many things.

A plot of a million points shows how they lie only if each pixel knows how many it has. So they are counted first, or their
values added, averaged or compared, and coloured after (`colorize`). Counting is another target behind the same traversals, so
lines and triangles fall where a canvas would paint them.

Source: the way of datashader, whose bounds, broken lines and reductions these are; here pixels are half-open on every side.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.columns import MAX_VALUE, Plotted, as_bounds, as_plotted
from scanspan.assets.lens import check_size
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.geometry.fixed_point import snap_points
from scanspan.geometry.project import screen_triangles
from scanspan.geometry.world import World, cut_segments, cut_triangles, make_world, to_pixels
from scanspan.homogeneous import quote
from scanspan.raster.options import check_flag, check_subpixel_bits, check_threads, sample_centers
from scanspan.raster.segment import DDA, DIAMOND_EXIT, MIDPOINT, SYMMETRIC
from scanspan.records import Array, Float64Array
from scanspan.target.gather import gather_points, gather_segments, gather_triangles
from scanspan.target.image import MAX_PIXELS
from scanspan.target.reduce import REDUCTIONS, finish, make_target

LINES = {"diamond-exit": DIAMOND_EXIT, "midpoint": MIDPOINT, "dda": DDA, "symmetric": SYMMETRIC}
MAX_COUNT = (1 << 31) - 1  # of primitives, as a pixel may hold all of them


def aggregate(
    geometry: Any, size: tuple[int, int], *, reduce: str = "count", values: Any = None, kind: str | None = None,
    bounds: Any = None, x: Any = "x", y: Any = "y", line: str = "diamond-exit", subpixel_bits: int = 8,
    nonfinite: str = "error", threads: int | None = None, as_xarray: bool = False,
) -> Any:  # fmt: skip
    """Return how many points, lines or triangles fall on each pixel, or what their values come to.

    Parameters
    ----------
    geometry : (N, 2) points, (N, 2, 2) segments, (N, 3, 2) triangles; or a table (a DataFrame, a Dataset of xarray, an array of
        records, a dict of arrays), whose rows are points.
    size : (width, height) of the image in pixels.
    reduce : "count", "sum", "mean", "min" or "max".
    values : (N,) numbers, one for each point, segment or triangle; (N, 3) to interpolate between the corners of triangles; or
        the name of a column. A polyline has one for each of its points, and the segment that begins there has it.
    kind : "points", "lines" or "triangles"; by default what the shape says. As "lines", points are one polyline, which is
        broken where a coordinate is NaN.
    bounds : None for pixels, y down; or the rectangle (x_low, y_low, x_high, y_high) that becomes the image, with y up, so that
        row 0 is the highest; "fit" for the least that holds everything.
    x, y : the columns of a table.
    line : "diamond-exit", by which a polyline counts once in a pixel that it passes through, and a segment that leaves no pixel
        does not count at all; or "midpoint", "dda", "symmetric", which go from the pixel of one end to that of the other.
    subpixel_bits : corners and ends are snapped to 1/2^s pixel; points are not.
    nonfinite : "error", or "drop" to leave out what has a coordinate or a value that is not finite.
    threads : by default one for each processor. The result has the same bits for any number.
    as_xarray : whether to return a DataArray whose coordinates are the centres of the pixels; it needs the package xarray.

    Returns
    -------
    (H, W) int32 for "count"; else float64, NaN where nothing falls. A pixel holds what lies from its low border to before its
    high one, in x and in y, so each point is counted once; points outside of the bounds are left out. A triangle falls on the
    pixels whose centres it covers, by the top-left rule, and its value is the one that it has there.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> aggregate([(0.5, 0.5), (0.7, 0.1), (2.5, 1.0)], (3, 2))
    array([[2, 0, 0],
           [0, 0, 1]], dtype=int32)
    >>> aggregate([(0, 0), (4, 3), (4, 1)], (2, 2), reduce="mean", values=[1, 2, 6], bounds=(0, 0, 8, 4))
    array([[nan,  2.],
           [ 1.,  6.]])
    """
    if not isinstance(reduce, str) or reduce not in REDUCTIONS:
        raise unknown_name("reduction", reduce, REDUCTIONS)
    if not isinstance(line, str) or line not in LINES:
        raise unknown_name("line", line, LINES)
    width, height = check_size(size)
    if width * height > MAX_PIXELS:
        raise LimitError(f"size = ({width}, {height}): the limit is {MAX_PIXELS} pixels in all")
    bits, workers, labelled = check_subpixel_bits(subpixel_bits), check_threads(threads), check_flag("as_xarray", as_xarray)
    xarray = import_xarray() if labelled else None
    plotted = as_plotted(geometry, kind, x, y, values, nonfinite)
    if reduce != "count" and plotted.values is None:
        raise InputError(f"reduce = {reduce!r}: needs values, one for each of the {plotted.kind}")
    limits = as_bounds(bounds, plotted, (width, height))
    world = make_world(limits, (width, height), bounds is not None)
    if plotted.kind == "points":
        found = aggregate_points(reduce, plotted, world, (width, height), nonfinite, workers)
    elif plotted.kind == "lines":
        found = aggregate_lines(reduce, plotted, world, (width, height), line, bits, workers)
    else:
        found = aggregate_triangles(reduce, plotted, world, (width, height), bits, workers)
    return found if xarray is None else with_coordinates(xarray, found, world, reduce)


def aggregate_points(
    reduce: str, plotted: Plotted, world: World, size: tuple[int, int], nonfinite: str, threads: int
) -> NDArray[Any]:
    """Return what points come to in each pixel, (H, W)."""
    assert plotted.columns is not None
    check_count(len(plotted.columns[0]))
    target = make_target(reduce, size[0] * size[1] + 1)
    values = None if reduce == "count" else plotted.values
    is_good = gather_points(reduce, target, plotted.columns, values, world, size, threads)
    if nonfinite == "error" and not is_good:
        x, y = (np.asarray(column, np.float64) for column in plotted.columns)
        n = int(np.argmax(~(np.isfinite(x) & np.isfinite(y))))
        found = f"geometry[{n}] = ({float(x[n])}, {float(y[n])})"
        raise InputError(f'{found}: expected finite numbers; nonfinite="drop" leaves it out')
    return finish(reduce, target[:-1].reshape(size[1], size[0], *target.shape[1:]))


def aggregate_lines(
    reduce: str, plotted: Plotted, world: World, size: tuple[int, int], line: str, subpixel_bits: int, threads: int
) -> NDArray[Any]:
    """Return what segments come to in each pixel, (H, W)."""
    check_count(len(plotted.corners))
    ends, number = cut_segments(corners_in_pixels(plotted, world))
    steps = snap_points(ends, subpixel_bits) if line == "diamond-exit" else np.floor(ends).astype(np.int64)
    target = make_target(reduce, size[0] * size[1])
    shaped = target.reshape(size[1], size[0], *target.shape[1:])
    values = None if reduce == "count" or plotted.values is None else plotted.values[number]
    gather_segments(reduce, shaped, steps.reshape(-1, 4), values, LINES[line], subpixel_bits, threads)
    return finish(reduce, shaped)


def aggregate_triangles(
    reduce: str, plotted: Plotted, world: World, size: tuple[int, int], subpixel_bits: int, threads: int
) -> NDArray[Any]:
    """Return what triangles come to in each pixel, (H, W)."""
    check_count(len(plotted.corners))
    values = np.zeros(len(plotted.corners)) if plotted.values is None else plotted.values
    per_corner = values if values.ndim == 2 else np.repeat(values, 3).reshape(-1, 3)
    corners, per_corner = cut_triangles(corners_in_pixels(plotted, world), per_corner, size, subpixel_bits)
    screen = screen_triangles(corners, subpixel_bits)._replace(depth=per_corner.reshape(-1))
    sampling = sample_centers(size, subpixel_bits)
    target = make_target(reduce, size[0] * size[1])
    shaped = target.reshape(size[1], size[0], *target.shape[1:])
    gather_triangles(reduce, shaped, screen, sampling, threads)
    return finish(reduce, shaped)


def check_count(count: int) -> None:
    """Raise a LimitError for more primitives than a pixel can count."""
    if count > MAX_COUNT:
        raise LimitError(f"geometry: {count} rows, at most {MAX_COUNT} can be counted; add the results of several parts")


def corners_in_pixels(plotted: Plotted, world: World) -> Float64Array:
    """Return the corners of segments or triangles in pixels; raise for one that is too far away to compute with."""
    pixels = to_pixels(world, plotted.corners)
    good = np.abs(pixels) <= MAX_VALUE
    if not good.all():
        n = int(np.argwhere(~good)[0][0])
        raise InputError(f"geometry[{n}] = {quote(plotted.corners[n].tolist())}: more than {MAX_VALUE:g} pixels away")
    return pixels


def import_xarray() -> Any:
    """Return the package xarray, or raise an InputError that says how to get it."""
    try:
        return importlib.import_module("xarray")
    except ImportError:
        raise InputError('as_xarray = True: needs the package xarray: pip install "scanspan[plots]"') from None


def with_coordinates(xarray: Any, found: Array, world: World, name: str) -> Any:
    """Return an image as a DataArray with the centres of the pixels as coordinates."""
    height, width = found.shape
    across = (np.arange(width) + 0.5) / world.x_scale + world.x_low
    along = (np.arange(height) + 0.5) / world.y_scale
    down = world.y_high - along if world.is_up else world.y_low + along
    bounds = (world.x_low, world.y_low, world.x_high, world.y_high)
    return xarray.DataArray(found, {"y": down, "x": across}, ("y", "x"), name, {"bounds": bounds})
