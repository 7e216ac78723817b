"""How much of each pixel every one of many polygons covers, and what follows: sums weighted by area, and the largest share.

The sweep of area.py hands over runs of pixels that a polygon covers alike; here they are added up, or the largest is kept. Wide
images are swept in tiles at fixed columns: whatever block of an image is asked for, a row of a tile is worked out from the same
numbers, and gives the same bits.

Source: area.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.area import Areas, sweep_areas
from scanspan.raster.area_edges import UNIT
from scanspan.raster.area_pieces import AreaSweep
from scanspan.records import Float64Array, Int64Array, Integer

TILE = 4096  # columns
QUANTUM = 2.0**32  # parts of a pixel in which shares are compared, so that what was rounded decides no tie


class Shares(NamedTuple):
    """Where shares land: the columns x_start to x_end of a tile, from row y_start on, and a value for each polygon."""

    rows: Float64Array  # (h, w) or (h, w, 2)
    values: Float64Array  # (P,)
    x_start: int
    x_end: int
    y_start: int


@bare_helper
def write_share(target: Shares, y: Integer, start: Integer, end: Integer, cover: Integer, number: Integer, flag: int) -> None:
    """Add a share to what is covered of each pixel of a run."""
    share, row, left = np.float64(cover) / UNIT, y - target.y_start, target.x_start
    for x in range(max(start, np.int64(left)), min(end, np.int64(target.x_end))):
        target.rows[row, x - left] += share


@bare_helper
def write_sum(target: Shares, y: Integer, start: Integer, end: Integer, cover: Integer, number: Integer, flag: int) -> None:
    """Add a share to the sums of shares of a run, and its value, as far as it counts, to the sums of values."""
    share, row, left = np.float64(cover) / UNIT, y - target.y_start, target.x_start
    for x in range(max(start, np.int64(left)), min(end, np.int64(target.x_end))):
        target.rows[row, x - left, 0] += share
        target.rows[row, x - left, 1] += share * target.values[number]


@bare_helper
def write_largest(target: Shares, y: Integer, start: Integer, end: Integer, cover: Integer, number: Integer, flag: int) -> None:
    """Keep the largest share of each pixel of a run and the number of its polygon; the first of equals stays."""
    parts, row, left = np.rint(np.float64(cover) / UNIT * QUANTUM), y - target.y_start, target.x_start
    for x in range(max(start, np.int64(left)), min(end, np.int64(target.x_end))):
        if parts > target.rows[row, x - left, 0]:
            target.rows[row, x - left, 0] = parts
            target.rows[row, x - left, 1] = np.float64(number)


@bare_kernel
def add_shares(
    target: Shares, y_start: int, y_end: int, areas: Areas, fill_rule: int, sweep: AreaSweep, numbers: Int64Array
) -> None:
    """Add up shares: rows (h, w)."""
    sweep_areas(write_share, target, y_start, y_end, areas, fill_rule, sweep, numbers, 0)


@bare_kernel
def sum_shares(
    target: Shares, y_start: int, y_end: int, areas: Areas, fill_rule: int, sweep: AreaSweep, numbers: Int64Array
) -> None:
    """Add up shares, and values weighted by them: rows (h, w, 2)."""
    sweep_areas(write_sum, target, y_start, y_end, areas, fill_rule, sweep, numbers, 0)


@bare_kernel
def largest_share(
    target: Shares, y_start: int, y_end: int, areas: Areas, fill_rule: int, sweep: AreaSweep, numbers: Int64Array
) -> None:
    """Find the polygon that covers most: rows (h, w, 2), a share in parts and a number."""
    sweep_areas(write_largest, target, y_start, y_end, areas, fill_rule, sweep, numbers, 0)
