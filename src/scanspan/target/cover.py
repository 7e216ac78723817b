"""Painting by area: polygons laid over pixels as far as each is covered, row by row as the sweep of raster/area.py gives it.

The sweep hands over runs of pixels that are covered alike, in whole numbers of 2^-52 pixel. A run that is wholly covered by an
opaque colour is a run of equal words; the rest is blended. No picture of coverage is made on the way.
"""

from __future__ import annotations

from threading import Event

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.algorithms import SMALL_IMAGE, run_bands
from scanspan.raster.area import sweep_areas
from scanspan.raster.area_edges import AREA_BITS, UNIT, WHOLE, Y0, Y1, gather_areas
from scanspan.raster.area_pieces import AreaSweep, make_sweep
from scanspan.records import Int32Array, Int64Array, Integer, UInt8Array
from scanspan.target.blend import ZERO, blend_over

Layers = tuple[UInt8Array, Int32Array]  # the pixels of a canvas as (H, W, 4) codes and as (H, W) words


@bare_helper
def write_over(
    target: Layers, y: Integer, start: Integer, end: Integer, cover: Integer, color: Integer, is_linear: int
) -> None:
    """Lay a colour over a run of pixels that are covered alike.

    Shapes  color: packed as by `pack_colors`.
    """
    pixels, words = target
    if cover == WHOLE and color >> 24 == 255:
        word = np.int32(color - (color >> 31 << 32))
        for x in range(start, end):
            words[y, x] = word
    else:
        share = np.float32(min(np.float64(cover) / UNIT, 1.0))
        if share > ZERO:
            for x in range(start, end):
                blend_over(pixels[y], x, color, share, is_linear)


@bare_kernel
def paint_areas(
    target: Layers, y_start: int, y_end: int, edges: Int64Array, edge_starts: Int64Array, fill_rule: int, sweep: AreaSweep,
    colors: Int64Array, is_linear: int,
) -> None:  # fmt: skip
    """Lay polygons over pixels in order, in some rows."""
    sweep_areas(write_over, target, target[1].shape[1], y_start, y_end, edges, edge_starts, fill_rule, sweep, colors, is_linear)


def paint_polygons(
    pixels: UInt8Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int, colors: Int64Array,
    is_linear: bool, threads: int,
) -> None:  # fmt: skip
    """Lay polygons over pixels in order, as far as each is covered.

    Parameters
    ----------
    pixels : (H, W, 4), sRGB with straight alpha.
    xy : (V, 2) corners in sub-pixels of AREA_BITS bits.
    ring_starts, polygon_rings : (R + 1,) rows of xy and (P + 1,) rings.
    fill_rule : one of raster/polygon.py.
    colors : (P,) packed colours.
    is_linear : whether light is blended, or sRGB values.
    threads : how many share the rows; the pixels are the same for any number.
    """
    height, width = pixels.shape[:2]
    edges, edge_starts = gather_areas(xy, ring_starts, polygon_rings, height)
    if not len(edges):
        return
    target, most = (pixels, pixels.view(np.int32)[..., 0]), int(np.diff(edge_starts).max())
    first, last = find_rows(edges, height)

    def paint_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        sweep = make_sweep(most, width)
        paint_areas(target, first + y_start, first + y_end, edges, edge_starts, fill_rule, sweep, colors, int(is_linear))

    run_bands(paint_band, last - first, 1 if (last - first) * width < SMALL_IMAGE else threads)


def find_rows(edges: Int64Array, height: int) -> tuple[int, int]:
    """Return the first row that edges pass through, and the row after the last, within an image of some height."""
    first, last = int(edges[:, Y0].min()) >> int(AREA_BITS), -(-int(edges[:, Y1].max()) >> int(AREA_BITS))
    return max(first, 0), min(last, height)
