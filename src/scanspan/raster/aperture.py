"""Apertures: how much a polygon covers of a pixel that is wider than its square and weighs more in its middle.

box       the square of the pixel, all of it alike: raster/area.py.
tent      twice as wide, and falling off to its border on both axes: the weights of bilinear interpolation, so that the tents of
          neighbours add up to 1 everywhere. Exact: within a square between four centres the weight is a product of two linear
          functions, so that its integral is made of four moments, which edges leave as they leave areas, each rounded once.
          Tilings whose edges match add up to exactly 1.
gaussian  a standard deviation of half a pixel, cut off at three of them: a sum of small tents, a quarter of a pixel apart.
          Along an axis, the error at a border is below 2^-11, and for whatever shape it is below 2^-6; tilings add up to 1 but
          for 2^-40. Corners lie within 2^22 px, sides within 2^15 px.

Source: Green's theorem, by edges; the weights of the Gaussian were found by linear programming, for the least largest error at
a border, and are stored, so that they are the same everywhere.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.geometry.fixed_point import snap_points
from scanspan.jit import bare_kernel
from scanspan.raster.area import Areas, make_areas
from scanspan.raster.area_edges import AREA_BITS, CORNER_COLUMNS, UNIT
from scanspan.raster.area_pieces import AreaSweep, make_sweep
from scanspan.raster.area_row import sweep_row
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer

APERTURES = ("box", "tent", "gaussian")

FINE_BITS = 2  # a Gaussian is made of tents a quarter of a pixel apart
GAUSSIAN = (
    np.array([213472, 188980, 125781, 67788, 25054, 9949]) / 1048576
)  # weights of the tents in the middle, one beside it, and so on
REACH = len(GAUSSIAN) - 1
ROWS = 32  # of pixels whose small tents are kept at a time
MAX_REACH = 1 << 22  # pixels, of the corners of what a Gaussian is laid over
MAX_SIDE = 1 << 15


@bare_kernel
def tent_rows(out: Float64Array, areas: Areas, fill_rule: int, sweep: AreaSweep) -> None:
    """Write the coverage of tents.

    Shapes  out: (H, W), 0 before; areas: one polygon, moved right and down by half a pixel, in an image of (W + 1, H + 1);
            sweep: room for that, with moments.
    """
    height, width = out.shape
    sums, moments, blocks, edges = sweep.sums, sweep.moments, sweep.blocks, areas.edges
    count: Integer = np.int64(0)
    following: Integer = np.int64(0)
    for e in range(edges.shape[0]):
        for k in range(CORNER_COLUMNS):
            sweep.edges[e, k] = edges[e, k]
    for row in range(areas.boxes[0, 2], areas.boxes[0, 3]):
        count, following = sweep_row(sweep, count, following, edges.shape[0], row, fill_rule)
        area = along_y = along_x = along_both = np.int64(0)
        for c in range(areas.boxes[0, 0], areas.boxes[0, 1]):
            # Add up the moments of the square between four centres.
            area, along_y = area + sums[c], along_y + moments[0, c]
            along_x, along_both = along_x + moments[1, c], along_both + moments[2, c]
            sums[c] = 0
            for k in range(3):
                moments[k, c] = 0

            # Give each of the four its share.
            if row > 0 and c > 0:
                out[row - 1, c - 1] += np.float64(area - along_x - along_y + along_both) / UNIT
            if row > 0 and c < width:
                out[row - 1, c] += np.float64(along_x - along_both) / UNIT
            if row < height and c > 0:
                out[row, c - 1] += np.float64(along_y - along_both) / UNIT
            if row < height and c < width:
                out[row, c] += np.float64(along_both) / UNIT
        for c in range(areas.boxes[0, 1], sums.shape[0]):
            sums[c] = 0
            for k in range(3):
                moments[k, c] = 0
        blocks[:] = 0


def tent_coverage(xy: Int64Array, ring_starts: Int32Array, fill_rule: int, size: tuple[int, int]) -> Float64Array:
    """Return how much of each tent a polygon covers, (H, W).

    Parameters
    ----------
    xy : (V, 2) corners in sub-pixels of AREA_BITS bits.
    ring_starts : (R + 1,) rows of xy.
    fill_rule : one of raster/polygon.py.
    size : (width, height).
    """
    out, rings = np.zeros((size[1], size[0])), np.array([0, len(ring_starts) - 1], np.int32)
    areas = make_areas(xy + (1 << int(AREA_BITS) - 1), ring_starts, rings, (size[0] + 1, size[1] + 1), is_swept=True)
    if areas.boxes[0, 0] < areas.boxes[0, 1]:
        tent_rows(out, areas, fill_rule, make_sweep(len(areas.edges), size[0] + 1, has_moments=True))
    return out


def gaussian_coverage(xy: Int64Array, ring_starts: Int32Array, fill_rule: int, size: tuple[int, int]) -> Float64Array:
    """Return how much of each Gaussian a polygon covers, (H, W); the parameters are those of tent_coverage."""
    scale, half = 1 << FINE_BITS, 1 << int(AREA_BITS) - 1
    out, middle = np.empty((size[1], size[0])), scale // 2
    margin = REACH - middle
    for first in range(0, size[1], ROWS):
        # Put the small tents' centres where the pixels' centres are, and REACH of them round about.
        rows = min(ROWS, size[1] - first)
        moved = xy * scale + np.array([(2 * margin + 1) * half, (2 * margin + 1) * half - (scale * first << int(AREA_BITS))])
        fine_size = (scale * (size[0] - 1) + 2 * REACH + 1, scale * (rows - 1) + 2 * REACH + 1)
        fine = tent_coverage(moved, ring_starts, fill_rule, fine_size)
        for axis, count in ((0, rows), (1, size[0])):
            parts = np.moveaxis(fine, axis, 0)
            total = GAUSSIAN[0] * parts[REACH::scale][:count]
            for k in range(1, REACH + 1):
                total = total + GAUSSIAN[k] * (parts[REACH - k :: scale][:count] + parts[REACH + k :: scale][:count])
            fine = np.moveaxis(total, 0, axis)
        out[first : first + rows] = fine
    return out


def weigh(points: Float64Array, ring_starts: Int32Array, fill_rule: int, size: tuple[int, int], aperture: str) -> Float64Array:
    """Return how much a polygon covers of pixels that are wider than their squares, (H, W).

    Parameters
    ----------
    points : (V, 2) corners in pixels, within 2^24 pixels.
    ring_starts, fill_rule, size : as for tent_coverage.
    aperture : "tent" or "gaussian".
    """
    xy = snap_points(points, int(AREA_BITS))
    if aperture == "tent":
        return tent_coverage(xy, ring_starts, fill_rule, size)
    if max(size) > MAX_SIDE or (len(points) and np.abs(points).max() > MAX_REACH):
        raise LimitError(
            f"aperture = 'gaussian': the limits are {MAX_SIDE} pixels a side and corners within {MAX_REACH} pixels"
        )
    return gaussian_coverage(xy, ring_starts, fill_rule, size)


def check_antialias(value: Any) -> str:
    """Return the aperture that is asked for by `antialias`: True is a box, False is none, which is ""."""
    if isinstance(value, str):
        if value not in APERTURES:
            raise unknown_name("aperture", value, APERTURES)
        return value
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"antialias = {value!r}: must be True, False, {', '.join(map(repr, APERTURES))}")
    return "box" if value else ""
