"""Masks: which pixels polygons cover, how much of each, and whose they are. For maps, masks and plots.

Polygons come in any form (assets/geometries.py), lie in the image by a transform (assets/placement.py), and are drawn into the
part of it that is asked for: a window, or one block after the other. What a pixel gets depends on the polygons and on where it
lies in the image alone, so blocks of any size fit together to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.geometries import PolygonList, as_polygons
from scanspan.assets.placement import Window, check_raster, check_windows, place, select_near
from scanspan.assets.rings import FILL_RULES
from scanspan.assets.values import check_reduction, fill_value, rank_values, sum_values
from scanspan.bands import run_bands
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.geometry.fixed_point import snap_points
from scanspan.raster.algorithms import PASS_BYTES, SMALL, SMALL_IMAGE
from scanspan.raster.aperture import APERTURES, weigh
from scanspan.raster.area import make_areas
from scanspan.raster.area_edges import AREA_BITS
from scanspan.raster.area_pieces import make_sweep
from scanspan.raster.options import check_subpixel_bits, check_threads, sample_centers
from scanspan.raster.shares import TILE, Shares, add_shares, largest_share, sum_shares
from scanspan.raster.spans import count_inside, count_spans, cut_spans, mark_inside, rank_inside, rank_spans, sum_spans
from scanspan.raster.touched import touch_spans
from scanspan.records import Array, Int32Array, Sampling
from scanspan.target.image import MAX_PIXELS

MANY = 100  # polygons
MODES = ("center", "touched", "area")


class Block:
    """Polygons on the sub-pixel grid, and the part of an image that they are drawn into."""

    def __init__(
        self, polygons: PolygonList, size: Any, window: Any, mode: str, fill_rule: str, subpixel_bits: Any, threads: Any,
        transform: Any, bounds: Any,
    ) -> None:  # fmt: skip
        """Check all that is asked for, and snap the polygons that come near the window; the others keep their numbers."""
        if mode not in MODES:
            raise unknown_name("mode", mode, MODES)
        if fill_rule not in FILL_RULES:
            raise unknown_name("fill rule", fill_rule, FILL_RULES)
        self.size, self.window = check_raster(size, window)
        width, height = self.window.width, self.window.height
        if width * height > MAX_PIXELS:
            raise LimitError(
                f"{'size' if window is None else 'window'} = {width} x {height} pixels: the limit is {MAX_PIXELS} in all; "
                "ask for one window= after the other, or use blocks()"
            )
        bits = check_subpixel_bits(subpixel_bits)
        self.mode, self.rule, self.bits = mode, FILL_RULES.index(fill_rule), int(AREA_BITS) if mode == "area" else bits
        near = select_near(place(polygons, self.size, transform, bounds), self.window)
        self.xy, self.ring_starts, self.polygon_rings = (
            snap_points(near.points, self.bits),
            near.ring_starts,
            near.polygon_rings,
        )
        few = len(self.xy) < SMALL and width * height < SMALL_IMAGE
        self.threads = 1 if few else check_threads(threads)
        check_threads(threads)

    def fill(self, shape: tuple[int, ...], dtype: Any, start: Any, draw: Callable[[Array, Sampling], None]) -> Array:
        """Return an array for the window, filled in bands of rows; `draw` is given the rows of a band and their sampling."""
        window, full = self.window, (self.window.height, self.window.width, *shape)
        target = np.zeros(full, dtype) if np.isscalar(start) and start == 0 else np.full(full, start, dtype)
        whole = sample_centers(self.size, self.bits)._replace(x_start=window.x_start, x_end=window.x_start + window.width)

        def draw_band(y_start: int, y_end: int, stop: Event) -> None:
            """Draw some rows."""
            if not stop.is_set():
                rows = whole._replace(y_start=window.y_start + y_start, y_end=window.y_start + y_end)
                draw(target[y_start:y_end], rows)

        # Let a band of what is written in any order stay in the cache; few polygons are swept from the top once.
        scattered = self.mode != "center" and len(self.polygon_rings) > MANY
        passes = -(-(target.nbytes + 8 * window.width * window.height) // PASS_BYTES) if scattered else 1
        run_bands(draw_band, window.height, self.threads, passes)
        return target

    def spans(self, sampling: Sampling) -> Int32Array:
        """Return the spans that polygons cover or touch."""
        shapes = (self.xy, self.ring_starts, self.polygon_rings, self.rule, sampling)
        inside = cut_spans(*shapes)
        return touch_spans(*shapes, inside) if self.mode == "touched" else inside

    def rank(self, rank: Int32Array) -> Array:
        """Return the highest rank of the polygons at each pixel, int32, -1 for none."""
        if self.mode == "center":
            return self.inside(rank_inside, np.int32, -1, rank.astype(np.int64))
        return self.fill((), np.int32, -1, lambda rows, s: rank_spans(rows, self.spans(s), rank, s.x_start, s.y_start))

    def count(self) -> Array:
        """Return how many polygons are at each pixel, int32; for "area" how much of it they cover, float64."""
        if self.mode == "area":
            return self.share(add_shares, (), 0.0, np.zeros(len(self.polygon_rings) - 1))
        if self.mode == "center":
            return self.inside(count_inside, np.int32, 0, np.zeros(len(self.polygon_rings) - 1, np.int64))
        return self.fill((), np.int32, 0, lambda rows, s: count_spans(rows, self.spans(s), s.x_start, s.y_start))

    def mark(self) -> Array:
        """Return whether a polygon is at each pixel, bool."""
        if self.mode == "center":
            return self.inside(mark_inside, np.bool_, False, np.zeros(len(self.polygon_rings) - 1, np.int64))
        return self.count() > 0

    def inside(self, kernel: Callable[..., None], dtype: Any, start: int, rank: Array) -> Array:
        """Return what a kernel of raster/spans.py makes of the samples that polygons hold."""
        shapes = (self.xy, self.ring_starts, self.polygon_rings, self.rule)
        return self.fill((), dtype, start, lambda rows, s: kernel(rows, rank, *shapes, s))

    def sum(self, values: NDArray[np.float64]) -> tuple[Array, Array]:
        """Return how many polygons are at each pixel, and the sum of their values; for "area" both weighted by shares."""
        if self.mode == "area":
            both = self.share(sum_shares, (2,), 0.0, values)
            return both[..., 0], both[..., 1]
        total = self.fill((), np.float64, 0.0, lambda rows, s: sum_spans(rows, self.spans(s), values, s.x_start, s.y_start))
        return self.count(), total

    def largest(self) -> Array:
        """Return the number of the polygon that covers most of each pixel, int32, -1 for none."""
        both = self.share(largest_share, (2,), (0.0, -1.0), np.zeros(len(self.polygon_rings) - 1))
        return both[..., 1].astype(np.int32)

    def weigh(self, aperture: str) -> Array:
        """Return how much polygons cover of wider pixels, float64."""
        if self.mode != "area":
            raise InputError(f"aperture = {aperture!r}: a pixel's centre has none; it goes with mode = 'area'")
        window = self.window
        points = (self.xy - (np.array([window.x_start, window.y_start]) << self.bits)) / float(1 << self.bits)
        total = np.zeros((window.height, window.width))
        for p in range(len(self.polygon_rings) - 1):
            ends = self.ring_starts[self.polygon_rings[p] : self.polygon_rings[p + 1] + 1]
            if len(ends) > 1:
                corners = np.ascontiguousarray(points[ends[0] : ends[-1]])
                total += weigh(corners, ends - ends[0], self.rule, (window.width, window.height), aperture)
        return total

    def share(self, kernel: Callable[..., None], shape: tuple[int, ...], start: Any, values: Array) -> Array:
        """Return what a kernel of raster/shares.py makes of the shares of pixels."""
        count, tiles = len(self.polygon_rings) - 1, []
        numbers = np.arange(count)
        for left in range(self.window.x_start // TILE * TILE, self.window.x_start + self.window.width, TILE):
            width = min(TILE, self.size[0] - left)
            moved = self.xy - np.array([left << int(AREA_BITS), 0])
            areas = make_areas(moved, self.ring_starts, self.polygon_rings, (width, self.size[1]))
            tiles.append((left, width, areas, int(np.diff(areas.starts).max(initial=0))))

        def draw(rows: Array, s: Sampling) -> None:
            """Sweep the tiles of some rows."""
            for left, width, areas, most in tiles:
                x_start, x_end = max(s.x_start - left, 0), min(s.x_end - left, width)
                part = rows[:, x_start + left - s.x_start : x_end + left - s.x_start]
                target = Shares(part, values, x_start, x_end, s.y_start)
                kernel(target, s.y_start, s.y_end, areas, self.rule, make_sweep(most, width), numbers)

        return self.fill(shape, np.float64, start, draw)


def coverage(
    rings: Any, size: tuple[int, int], *, mode: str = "center", fill_rule: str = "even-odd", transform: Any = None,
    bounds: Any = None, window: Any = None, aperture: str = "box", subpixel_bits: int = 8, threads: int | None = None,
) -> NDArray[Any]:  # fmt: skip
    """Return which pixels a polygon covers, or how much of each.

    Parameters
    ----------
    rings : one polygon: a ring, (M, 2) points in pixels, y down, or a list of rings; the closing point may be repeated. Or any
        geometry, as for `zones`: a pixel is covered where one of them covers it, and shares of several are added up.
    size : (width, height) of the image in pixels.
    mode : "center", whether the pixel's centre is inside; "touched", whether any of it is, the open pixel meets the open
        polygon; or "area", the share of the pixel that is, right to 2^-40. Polygons whose edges match end to end add up to
        exactly 1; so values are not held to 0..1, and may miss it by 2^-40.
    fill_rule : "even-odd", "non-zero", "positive", "negative" or "abs-geq-two"; counter-clockwise as seen is positive.
    transform : an affine transform from columns and rows to the map, in the order of rasterio, (a, b, c, d, e, f), or as an
        array of shape (2, 3) or (3, 3); an `affine.Affine` is one. Points are then those of the map.
    bounds : instead, (left, bottom, right, top) of the image on the map, north up.
    window : (x_start, y_start, width, height), the part of the image that is wanted; the same bits as in the whole.
    aperture : what "area" takes for a pixel. "box", its square. "tent", twice as wide and falling off linearly; as exact, and
        polygons that tile add up to exactly 1. "gaussian", with a standard deviation of half a pixel, cut off at three of them;
        the error is below 2^-11 at a border along an axis, and below 2^-6 whatever the shape.
    subpixel_bits : points are snapped to 1/2^s pixel; for "area" to 1/65536.
    threads : how many threads share the rows; None for one for each processor. The same bits with any number.

    Returns
    -------
    (H, W) bool, or float64 for "area".

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.
    LimitError : for more than 2^28 pixels at once; a window of a larger image may be asked for, up to 2^18 a side.

    Examples
    --------
    >>> coverage([(0, 0), (2, 0), (2, 0.5), (0, 0.5)], (2, 1), mode="area")
    array([[0.5, 0.5]])
    >>> coverage([(0, 0), (1.1, 0), (1.1, 1), (0, 1)], (3, 1), mode="touched")
    array([[ True, True, False]])
    """
    polygons = as_polygons(rings, "rings", is_one=True)
    block = Block(polygons, size, window, mode, fill_rule, subpixel_bits, threads, transform, bounds)
    if not isinstance(aperture, str) or aperture not in APERTURES:
        raise unknown_name("aperture", aperture, APERTURES)
    if aperture != "box":
        return block.weigh(aperture)
    return block.count() if mode == "area" else block.mark()


def zones(
    polygons: Any, size: tuple[int, int], *, values: ArrayLike | None = None, reduce: str = "last", mode: str = "center",
    background: Any = None, fill_rule: str = "even-odd", transform: Any = None, bounds: Any = None, window: Any = None,
    subpixel_bits: int = 8, threads: int | None = None,
) -> NDArray[Any]:  # fmt: skip
    """Return to which of many polygons each pixel belongs, or what becomes of the values of those that cover it.

    Parameters
    ----------
    polygons : a list of polygons, each a ring, a list of rings, or a geometry; or a GeoSeries, a GeoDataFrame or GeoJSON. What
        has `__geo_interface__` will do, shapely's geometries among them. Each is one polygon and keeps its number, empty ones
        too; z is dropped. Points and lines are refused.
    size : (width, height) of the image in pixels.
    values : (P,) numbers of any type, one for each polygon; None for the number of the polygon.
    reduce : which of the polygons at a pixel decides: "first", "last", "min", "max" (by value; NaN wins), or "majority", the
        one that covers most of it, the first of equals. Or what all of them make: "count", "sum", "mean".
    mode : which polygons are at a pixel: "center", those that hold its centre; "touched", those that it meets. Or "area", for
        "majority", "count", "sum" and "mean": all, each by the share of the pixel that it covers.
    background : where there is no polygon. By default -1 for numbers, 0 for counts and sums, NaN for means and floats, and 0
        for values that are whole numbers.
    fill_rule, transform, bounds, window, subpixel_bits, threads : as for `coverage`.

    Returns
    -------
    (H, W): int32 for the numbers of polygons and for counts, the type of the values where one polygon decides, int64 for sums
    of whole numbers, float64 else.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.
    LimitError : as for `coverage`, and for sums of whole numbers that may pass 2^53.

    Examples
    --------
    >>> wide, narrow = [(0, 0), (4, 0), (4, 1), (0, 1)], [(1, 0), (2.4, 0), (2.4, 1), (1, 1)]
    >>> zones([wide, narrow], (5, 1))
    array([[ 0, 1, 0, 0, -1]], dtype=int32)
    >>> zones([wide, narrow], (5, 1), values=[10, 20], reduce="sum")
    array([[10, 30, 10, 10, 0]])
    >>> zones([wide, narrow], (5, 1), reduce="count", mode="touched")
    array([[1, 2, 2, 1, 0]], dtype=int32)
    >>> zones([wide, narrow], (5, 1), values=[0.0, 1.0], reduce="mean", mode="area").round(2)
    array([[0. , 0.5 , 0.29, 0. , nan]])
    """
    listed = as_polygons(polygons)
    count = len(listed.polygon_rings) - 1
    given = check_reduction(reduce, mode, values, count)
    block = Block(listed, size, window, mode, fill_rule, subpixel_bits, threads, transform, bounds)
    if reduce == "count":
        counted = block.count()
        return fill_value(counted, counted == 0, background, 0)
    if reduce in ("sum", "mean"):
        assert given is not None
        weights, total = block.sum(sum_values(given))
        is_empty = weights <= (2.0**-40 if mode == "area" else 0)
        if reduce == "mean":
            return fill_value(np.where(is_empty, 0.0, total) / np.where(is_empty, 1.0, weights), is_empty, background, np.nan)
        is_whole = given.dtype.kind != "f" and mode != "area"
        return fill_value(total.astype(np.int64) if is_whole else total, is_empty, background, 0)

    # One polygon decides.
    if reduce == "majority":
        winner = block.largest()
    else:
        ranks, owner = rank_values(reduce, given, count)
        highest = block.rank(ranks)
        winner = highest if reduce == "last" else owner[highest]
    if given is None and background is None:
        return winner
    if given is None:
        return fill_value(winner, winner < 0, background, -1)
    found = np.concatenate([given, np.zeros(1, given.dtype)])[winner]
    return fill_value(found, winner < 0, background, np.nan if given.dtype.kind == "f" else 0)


def blocks(
    function: Callable[..., NDArray[Any]], polygons: Any, size: tuple[int, int], block: int | tuple[int, int] = 1024,
    **options: Any,
) -> Iterator[tuple[Window, NDArray[Any]]]:  # fmt: skip
    """Return an image one block after the other, row by row from the top left: windows, and what `function` gives for them.

    For images too large to be held. Together the blocks are what the whole would be, to the bit.

    Parameters
    ----------
    function : `coverage` or `zones`.
    polygons : as for the function; they are read once.
    size : (width, height) of the whole image, up to 2^18 a side.
    block : the side of a block in pixels, or its (width, height). Those at the right and the lower border may be smaller.
    options : passed on.

    Returns
    -------
    An iterator over ((x_start, y_start, width, height), an array of (height, width)).

    Raises
    ------
    InputError : at once for a size, a block or polygons that cannot be used; for options with the first block.

    Examples
    --------
    >>> square = [(0, 0), (3, 0), (3, 2), (0, 2)]
    >>> [(tuple(window), int(found.sum())) for window, found in blocks(coverage, square, (4, 2), 2)]
    [((0, 0, 2, 2), 4), ((2, 0, 2, 2), 2)]
    """
    windows = check_windows(size, block)
    listed = as_polygons(polygons, "polygons", is_one=function is coverage)
    return ((window, function(listed, size, window=window, **options)) for window in windows)
