"""Trapezoids in the place of polygons, as triangles with an outline, which every algorithm draws."""

from __future__ import annotations

import numpy as np

from scanspan.raster.polygon import EVEN_ODD, NON_ZERO, cut_trapezoids
from scanspan.records import Int32Array, Sampling, ScreenPolygons, ScreenTriangles


def draw_polygons(
    triangles: ScreenTriangles, polygons: ScreenPolygons, sampling: Sampling
) -> tuple[ScreenTriangles, Int32Array]:
    """Return triangles with trapezoids in the place of polygons, and the row that each was before, (N,), in order.

    Parameters
    ----------
    triangles : with three corners for each polygon.
    polygons : their rings, and which rows they are.
    sampling : what the trapezoids are cut for.
    """
    if not len(polygons.slot):
        return triangles, np.arange(len(triangles.corners), dtype=np.int32)
    found = []
    for rule in (EVEN_ODD, NON_ZERO):
        under = polygons.fill_rule == rule
        if under.any():
            # Give polygons under another rule no rings, which leaves their numbers alone.
            counts = np.where(under, np.diff(polygons.polygon_rings), 0)
            rings = np.flatnonzero(np.repeat(under, np.diff(polygons.polygon_rings)))
            points = np.repeat(np.isin(np.arange(len(polygons.ring_starts) - 1), rings), np.diff(polygons.ring_starts))
            starts = np.cumsum([0, *np.diff(polygons.ring_starts)[rings]]).astype(np.int32)
            per_polygon = np.cumsum([0, *counts]).astype(np.int32)
            found.append(cut_trapezoids(np.ascontiguousarray(polygons.xy[points]), starts, per_polygon, rule, sampling))
    owner, lines, limits = (np.concatenate(parts) for parts in zip(*found, strict=True))

    # Put the trapezoids behind the triangles, and sort both by the row that they come from.
    plain = np.ones(len(triangles.corners), bool)
    plain[polygons.slot] = False
    row = np.concatenate([np.flatnonzero(plain), polygons.slot[owner]]).astype(np.int32)
    first, count = len(triangles.lines), len(owner)
    outline = np.concatenate([triangles.outline[plain], np.arange(first, first + count)]).astype(np.int32)
    order = np.argsort(row, kind="stable")
    row, sides = row[order], np.zeros((count, 3, 4), np.int64)
    sides[:, 1:] = lines
    drawn = triangles._replace(
        corners=triangles.corners[row], source=triangles.source[row], piece=triangles.piece[row], inner=triangles.inner[row],
        outline=outline[order], lines=np.concatenate([triangles.lines, sides]),
        limits=np.concatenate([triangles.limits, np.concatenate([limits, polygons.starts[owner]], axis=1)]),
        planes=np.concatenate([triangles.planes, polygons.planes[owner]]),
    )  # fmt: skip
    return drawn, row
