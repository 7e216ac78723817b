"""Translucent surfaces: the layers of them in front of what is opaque, from the nearest on, each found like what is visible.

The opaque triangles are seen as ever. Of the translucent ones, a pass finds at every sample the nearest that lies behind the
layer before and in front of what is opaque: the same traversal and the same order of depth, then number, with a writer that
also knows a ceiling. So layers are exact at every sample, whatever the order of the triangles, even where they go through each
other, and the picture is the same for any number of threads. It takes a pass for each layer; after MAX_LAYERS what lies
farther is left out.

Source: C. Everitt, Interactive Order-Independent Transparency, 2001 (depth peeling); Porter and Duff 1984 (over).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from scanspan.jit import kernel
from scanspan.raster.algorithms import run_kernel
from scanspan.raster.half_space import half_space_layers
from scanspan.raster.trapezoids import draw_polygons
from scanspan.raster.write import EMPTY_KEY, pack_key, unpack_number
from scanspan.records import (
    BoolArray,
    DrawList,
    Float32Array,
    Int32Array,
    Int64Array,
    Integer,
    ScreenPolygons,
    ScreenTriangles,
)
from scanspan.target.visibility import Plane, RasterOptions, sampling_of

MAX_LAYERS = 32
NO_CEILING = np.int64((1 << 63) - 1)


class Part(NamedTuple):
    """Some of the triangles of a picture."""

    screen: ScreenTriangles
    polygons: ScreenPolygons | None
    rows: Int32Array | None  # (n,) where each stands among all of them, in order; None where they are all there are


def split(
    screen: ScreenTriangles, polygons: ScreenPolygons | None, draw: DrawList, is_translucent: BoolArray
) -> tuple[Part, Part | None]:
    """Return the opaque triangles and the translucent ones, None where there are none; `is_translucent` is by instance."""
    if not is_translucent.any():
        return Part(screen, polygons, None), None
    through = is_translucent[draw.instance[screen.source]]
    return select(screen, polygons, ~through), select(screen, polygons, through)


def select(screen: ScreenTriangles, polygons: ScreenPolygons | None, keep: BoolArray) -> Part:
    """Return the triangles that are kept, and the polygons among them."""
    rows = np.flatnonzero(keep).astype(np.int32)
    some = screen._replace(
        corners=screen.corners[rows], source=screen.source[rows], piece=screen.piece[rows], inner=screen.inner[rows],
        outline=screen.outline[rows],
    )  # fmt: skip
    if polygons is None:
        return Part(some, None, rows)

    # Keep whole polygons: their rings, and the points of these.
    kept = keep[polygons.slot]
    rings, points = np.diff(polygons.polygon_rings), np.diff(polygons.ring_starts)
    ring_kept = np.repeat(kept, rings)
    within = polygons._replace(
        xy=polygons.xy[np.repeat(ring_kept, points)],
        ring_starts=np.cumsum([0, *points[ring_kept]]).astype(np.int32),
        polygon_rings=np.cumsum([0, *rings[kept]]).astype(np.int32),
        fill_rule=polygons.fill_rule[kept],
        slot=np.searchsorted(rows, polygons.slot[kept]).astype(np.int32),
        planes=polygons.planes[kept],
        starts=polygons.starts[kept],
    )
    return Part(some, within, rows)


@kernel
def start_kernel(slot: Int32Array, depth: Float32Array, rank: Int32Array, floor: Int64Array, target: Int64Array) -> None:
    """Write the key of what is opaque as the floor of every sample, and open the ceiling.

    Shapes  slot: (h, W) int32, -1 nothing; depth: (h, W) float32; floor: (h, W), target: (h, W, 2) int64; rank: (N,) int32, the
            first translucent triangle after each opaque one in number, so that of equal depths the lower number is seen.
    """
    for j in range(slot.shape[0]):
        for i in range(slot.shape[1]):
            n = slot[j, i]
            floor[j, i] = EMPTY_KEY if n < 0 else pack_key(np.float64(depth[j, i]), np.int64(rank[n]))
            target[j, i, 0], target[j, i, 1] = floor[j, i], NO_CEILING


@kernel
def next_kernel(target: Int64Array, floor: Int64Array, rows: Int32Array, slot: Int32Array) -> Integer:
    """Write the layer that was found, lower the ceiling to it, and return how many samples have one.

    Shapes  target: (h, W, 2), floor: (h, W) int64; rows: (n,) int32, the row of each translucent triangle among all; slot:
            (h, W) int32, written, -1 nothing.
    """
    found = np.int64(0)
    for j in range(slot.shape[0]):
        for i in range(slot.shape[1]):
            key = target[j, i, 0]
            if key > floor[j, i]:
                slot[j, i] = rows[unpack_number(key)]
                found += 1
            else:
                slot[j, i] = -1
            target[j, i, 0], target[j, i, 1] = floor[j, i], key
    return found


def find_layers(part: Part, plane: Plane, options: RasterOptions, y_start: int) -> Iterator[Int32Array]:
    """Return the layers of translucent triangles in front of what is opaque, from the nearest on, (h, W) rows of all triangles.

    Each may be written over by the next.

    Parameters
    ----------
    part : the translucent triangles. plane : what is opaque, in rows of all triangles; image rows from `y_start` on.
    """
    height, width = plane.slot.shape
    below = plane.offset + np.array([0, y_start << options.subpixel_bits])
    sampling = sampling_of(below, options._replace(size=(width, height)))
    assert part.rows is not None
    drawn, rows = part.screen, part.rows
    if part.polygons is not None:
        drawn, row = draw_polygons(drawn, part.polygons, sampling)
        rows = rows[row]
    highest = max(int(plane.slot.max(initial=-1)), int(rows.max(initial=-1))) + 1
    rank = np.searchsorted(rows, np.arange(highest)).astype(np.int32)
    floor, target = np.empty((height, width), np.int64), np.empty((height, width, 2), np.int64)
    slot = np.empty((height, width), np.int32)
    start_kernel(plane.slot, plane.depth, rank, floor, target)
    for _ in range(MAX_LAYERS):
        run_kernel(half_space_layers, target, drawn, sampling, options.threads)
        if not next_kernel(target, floor, rows, slot):
            return
        yield slot
