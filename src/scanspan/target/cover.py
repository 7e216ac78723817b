"""Painting by area: polygons laid over pixels as far as each is covered, row by row as the sweep of raster/area.py gives it.

The sweep hands over runs of pixels that are covered alike, in whole numbers of 2^-52 pixel. A run that is wholly covered by an
opaque colour is a run of equal words; the rest is blended. No picture of coverage is made on the way.

One over the other, two shapes that share an edge let through what lies below: half a pixel and then half of the rest make
three quarters. That is right where they are in each other's way by chance, and wrong where they abut. So shapes that do not
overlap are not laid over each other: what they cover, times colour and alpha, is added up in whole numbers, and the sum is laid
over the picture once. Whole numbers have no order, and areas that tile add up to exactly 1; so a tiling in one colour gives the
bits of the one shape that it tiles.

Source: T. Porter and T. Duff, Compositing Digital Images, 1984 (over, plus); docs/decisions/0011-area.md.
"""

from __future__ import annotations

from threading import Event

import numpy as np

from scanspan.bands import run_bands
from scanspan.color.transfer import STARTS
from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.algorithms import SMALL_IMAGE
from scanspan.raster.area import Areas, make_areas, sweep_areas
from scanspan.raster.area_edges import UNIT, WHOLE
from scanspan.raster.area_pieces import AreaSweep, make_sweep
from scanspan.records import Int32Array, Int64Array, Integer, UInt8Array
from scanspan.shade.color import THRESHOLDS
from scanspan.shade.srgb import encode_value
from scanspan.target.blend import LINEAR, ONE, ZERO, blend_run

Layers = tuple[UInt8Array, Int32Array]  # the pixels of a canvas as (H, W, 4) codes and as (H, W) words

# Sums are kept in two halves, high 2^34 + low. A pixel's area times its alpha is below 2^60, a weight at most 2^20: so 2^16
# layers fit before sums are held, and no low half overflows.
LOW_BITS = np.int64(34)
LOW_MASK = np.int64((1 << 34) - 1)
HIGH = 2.0**34
HIGHEST = np.int64(1 << 62)
FULL = np.int64(1 << 20)  # the weight of a value of 1
OPAQUE = 255.0 * UNIT * 2.0**20  # the sum of weights where a pixel is covered by what is opaque
SUMS = 8  # columns: high halves of red, green, blue and alpha, then the low ones
SUM_BYTES = 1 << 21  # of the sums of one band; they stay in the cache

# The weight of each 8-bit code: its light, or its value.
LIGHT_WEIGHTS = np.rint(LINEAR.astype(np.float64) * 2.0**20).astype(np.int64)
VALUE_WEIGHTS = np.rint(np.arange(256) / 255.0 * 2.0**20).astype(np.int64)


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
            blend_run(pixels[y], words[y], start, end, color, share, is_linear)


@bare_kernel
def paint_areas(
    target: Layers, y_start: int, y_end: int, areas: Areas, fill_rule: int, sweep: AreaSweep, colors: Int64Array, is_linear: int
) -> None:
    """Lay polygons over pixels in order, in some rows."""
    sweep_areas(write_over, target, y_start, y_end, areas, fill_rule, sweep, colors, is_linear)


@bare_helper
def write_sum(
    target: tuple[Int64Array, Integer], y: Integer, start: Integer, end: Integer, cover: Integer, color: Integer, is_linear: int
) -> None:
    """Add what a run of pixels gets of a colour to their sums.

    Shapes  target: (h, W, SUMS) sums, and the row that the first of them is.
    """
    sums, first = target
    red, green, blue, share = color & 255, color >> 8 & 255, color >> 16 & 255, cover * (color >> 24 & 255)
    high, low = share >> LOW_BITS, share & LOW_MASK
    for x in range(start, end):
        for k in range(4):
            code = red if k == 0 else (green if k == 1 else blue)
            weight = LIGHT_WEIGHTS[code] if is_linear == 1 else VALUE_WEIGHTS[code]
            weight = FULL if k == 3 else weight
            lower = sums[y - first, x, k + 4] + low * weight
            sums[y - first, x, k] = min(sums[y - first, x, k] + high * weight + (lower >> LOW_BITS), HIGHEST)
            sums[y - first, x, k + 4] = lower & LOW_MASK


@bare_kernel
def add_areas(
    sums: Int64Array, y_start: int, y_end: int, areas: Areas, fill_rule: int, sweep: AreaSweep, colors: Int64Array,
    is_linear: int,
) -> None:  # fmt: skip
    """Add what polygons give to the sums of some rows; the order does not matter."""
    target = (sums, y_start)
    sweep_areas(write_sum, target, y_start, y_end, areas, fill_rule, sweep, colors, is_linear)


@bare_kernel
def lay_sums(pixels: UInt8Array, sums: Int64Array, y_start: int, x_start: int, x_end: int, is_linear: int) -> None:
    """Lay what was added up over the pixels of some rows, and clear the sums.

    Shapes  pixels: (H, W, 4); sums: (h, W, SUMS), of the rows from y_start on.
    """
    for j in range(sums.shape[0]):
        for x in range(x_start, x_end):
            if (sums[j, x, 3] | sums[j, x, 7]) == 0:
                continue
            y, whole = y_start + j, np.float64(sums[j, x, 3]) * HIGH + np.float64(sums[j, x, 7])
            alpha = np.float32(min(max(whole / OPAQUE, 0.0), 1.0))
            total = alpha + np.float32(pixels[y, x, 3]) / np.float32(255.0) * (ONE - alpha)
            if alpha > ZERO:
                share = alpha / total
                for k in range(3):
                    value = (np.float64(sums[j, x, k]) * HIGH + np.float64(sums[j, x, k + 4])) / whole
                    over, under = np.float32(min(max(value, 0.0), 1.0)) * share, np.int64(pixels[y, x, k])
                    if is_linear == 1:
                        pixels[y, x, k] = encode_value(over + LINEAR[under] * (ONE - share), THRESHOLDS, STARTS)
                    else:
                        light = over * np.float32(255.0) + np.float32(under) * (ONE - share)
                        pixels[y, x, k] = int(light + np.float32(0.5))
                pixels[y, x, 3] = int(total * np.float32(255.0) + np.float32(0.5))
            for k in range(SUMS):
                sums[j, x, k] = 0


def paint_polygons(
    pixels: UInt8Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int, colors: Int64Array,
    is_linear: bool, is_disjoint: bool, threads: int,
) -> None:  # fmt: skip
    """Lay polygons over pixels as far as each is covered: one over the other in order, or all at once.

    Parameters
    ----------
    pixels : (H, W, 4), sRGB with straight alpha.
    xy : (V, 2) corners in sub-pixels of AREA_BITS bits.
    ring_starts, polygon_rings : (R + 1,) rows of xy and (P + 1,) rings.
    fill_rule : one of raster/polygon.py.
    colors : (P,) packed colours.
    is_linear : whether light is blended, or sRGB values.
    is_disjoint : whether what they cover is added up.
    threads : how many share the rows; the pixels are the same for any number.
    """
    height, width = pixels.shape[:2]
    areas = make_areas(xy, ring_starts, polygon_rings, (width, height))
    boxes = areas.boxes[(areas.boxes[:, 0] < areas.boxes[:, 1]) & (areas.boxes[:, 2] < areas.boxes[:, 3])]
    if not len(boxes):
        return
    x_start, x_end, first, last = (
        int(boxes[:, 0].min()), int(boxes[:, 1].max()), int(boxes[:, 2].min()), int(boxes[:, 3].max())
    )  # fmt: skip
    target, most = (pixels, pixels.view(np.int32)[..., 0]), int(np.diff(areas.starts).max())
    flag = int(is_linear)

    def paint_band(y_start: int, y_end: int, stop: Event) -> None:
        """Paint the rows of one band."""
        if stop.is_set():
            return
        sweep, y_start, y_end = make_sweep(most, width), first + y_start, first + y_end
        if is_disjoint:
            sums = np.zeros((y_end - y_start, width, SUMS), np.int64)
            add_areas(sums, y_start, y_end, areas, fill_rule, sweep, colors, flag)
            lay_sums(pixels, sums, y_start, x_start, x_end, flag)
        else:
            paint_areas(target, y_start, y_end, areas, fill_rule, sweep, colors, flag)

    passes = -(-(last - first) * width * SUMS * 8 // SUM_BYTES) if is_disjoint else 1
    run_bands(paint_band, last - first, 1 if (last - first) * width < SMALL_IMAGE else threads, passes)
