"""Polygons on the screen: their rings clipped, projected and snapped, with three corners each that say how deep they are.

A ring is cut by a plane corner by corner, as a triangle is (clip.py). Rings of a concave polygon may fall into several parts;
what joins these runs along the plane to and fro, and fill rules take no notice of it. What stays is one polygon, with one
number and one plane of depth.

Source: Sutherland and Hodgman 1974.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from scanspan.geometry.clip import clip_planes, cut_ring
from scanspan.geometry.project import project
from scanspan.homogeneous import cross, dot
from scanspan.records import Array, DrawList, Float64Array, Int32Array, Int64Array, ScreenPolygons, ScreenTriangles

REACHES_OUT = 8  # bit of `inner`: samples may lie outside of the three corners
NO_EDGES = 7


class Part(NamedTuple):
    """What the planes leave of a polygon."""

    polygon: int
    rings: list[Int64Array]  # (M, 2) sub-pixels
    clip: Float64Array  # (3, 4) three corners that span the plane; empty where they are those of the DrawList
    weights: Float64Array  # (3, 3) their shares of the corners of the DrawList, or empty


def to_screen_with_polygons(
    draw: DrawList, size: tuple[int, int], subpixel_bits: int, far: bool, to_triangles: Callable[..., ScreenTriangles]
) -> tuple[ScreenTriangles, ScreenPolygons]:
    """Return the triangles of a DrawList on the screen, polygons among them as three corners each, and the polygons.

    Parameters
    ----------
    draw : with outlines.
    size, subpixel_bits, far : as for `to_screen`.
    to_triangles : `to_screen`, or what does without clipping; called with the triangles that are no polygons.
    """
    assert draw.outlines is not None
    outlines = draw.outlines
    plain = np.ones(len(draw.triangles), bool)
    plain[outlines.triangle] = False
    triangles = to_triangles(draw.clip, draw.triangles[plain], size, subpixel_bits, far)
    triangles = triangles._replace(source=np.flatnonzero(plain).astype(np.int32)[triangles.source])

    # Take whole polygons as they are, and cut the others.
    planes = clip_planes(size, far)
    seen = project(draw.clip, planes, size, subpixel_bits)
    parts = []
    for p in range(len(outlines.triangle)):
        spans = outlines.rings[outlines.polygon_rings[p] : outlines.polygon_rings[p + 1]]
        codes = np.concatenate([seen.outcodes[start:end] for start, end in spans])
        if np.bitwise_and.reduce(codes):
            continue
        if not codes.any():
            parts.append(Part(p, [seen.xy[start:end] for start, end in spans], np.empty((0, 4)), np.empty((0, 3))))
            continue
        found = cut_rings(draw, p, planes, size, subpixel_bits)
        if found is not None:
            parts.append(found)
    return join(triangles, draw, parts, planes, size, subpixel_bits)


def cut_rings(draw: DrawList, p: int, planes: Float64Array, size: tuple[int, int], subpixel_bits: int) -> Part | None:
    """Return what the planes leave of polygon p, None for nothing."""
    assert draw.outlines is not None
    outlines = draw.outlines
    corners = draw.triangles[outlines.triangle[p]]
    rings = []
    for start, end in outlines.rings[outlines.polygon_rings[p] : outlines.polygon_rings[p + 1]]:
        weights = shares(draw.positions[start:end], draw.positions[corners])
        ring = np.concatenate([draw.clip[start:end], weights], axis=1)
        for k in range(len(planes)):
            cut = np.empty((2 * len(ring), 7))
            ring = cut[: cut_ring(ring, planes, k, cut)]
        if len(ring) > 2:
            rings.append(ring)
    if not rings:
        return None
    points = np.concatenate(rings)
    snapped = project(np.ascontiguousarray(points[:, :4]), planes, size, subpixel_bits).xy
    ends = np.cumsum([len(ring) for ring in rings])[:-1]
    reference = far_apart(snapped.astype(np.float64), turn_of(draw.clip[corners]))
    return Part(p, np.split(snapped, ends), points[reference, :4], points[reference, 4:])


def shares(points: Float64Array, corners: Float64Array) -> Float64Array:
    """Return the shares of three corners in points of their plane, (M, 3), which add up to 1."""
    p, q, r = corners
    normal = cross(q - p, r - p)
    length = dot(normal, normal)
    of_q = dot(cross(points - p, r - p), normal) / length
    of_r = dot(cross(q - p, points - p), normal) / length
    return np.stack([1.0 - of_q - of_r, of_q, of_r], axis=1)


def turn_of(clip: Float64Array) -> float:
    """Return a number with the sign of the area that three corners have as seen, also behind the eye."""
    x, y, w = clip[:, 0], clip[:, 1], clip[:, 3]
    return float(
        -(x[0] * (y[1] * w[2] - y[2] * w[1]) - y[0] * (x[1] * w[2] - x[2] * w[1]) + w[0] * (x[1] * y[2] - x[2] * y[1]))
    )


def far_apart(xy: Float64Array, turn: float) -> Int64Array:
    """Return three points that lie far apart, turned as asked: the furthest from the first, and from the line of the two."""
    p = 0
    q = int(np.argmax(((xy - xy[p]) ** 2).sum(axis=1)))
    across = (xy[q, 0] - xy[p, 0]) * (xy[:, 1] - xy[p, 1]) - (xy[q, 1] - xy[p, 1]) * (xy[:, 0] - xy[p, 0])
    r = int(np.argmax(np.abs(across)))
    return np.array([p, q, r] if across[r] * turn >= 0 else [p, r, q])


def depth_planes(xy: Int64Array, depth: Float64Array, corners: Int32Array) -> tuple[Float64Array, Int64Array]:
    """Return the planes of depth through three corners each, and where they start, as in ScreenTriangles.

    Returns
    -------
    (P, 7) depth at a corner, slopes in a sub-pixel, no cut and no range; (P, 4) that corner's x and y, 1 for clockwise and -1
    for not, and 0: no edge was made by clipping.
    """
    p, q, r = corners[:, 0], corners[:, 1], corners[:, 2]
    to_q, to_r = (xy[q] - xy[p]).astype(np.float64), (xy[r] - xy[p]).astype(np.float64)
    area = to_q[:, 0] * to_r[:, 1] - to_q[:, 1] * to_r[:, 0]
    of_q, of_r = depth[q] - depth[p], depth[r] - depth[p]
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0)
    slope_x = (of_q * to_r[:, 1] - of_r * to_q[:, 1]) * scale
    slope_y = (of_r * to_q[:, 0] - of_q * to_r[:, 0]) * scale
    no_cut = np.full(len(p), np.inf)
    turn = np.sign(area).astype(np.int64)
    starts = np.stack([xy[p, 0], xy[p, 1], turn, np.zeros_like(turn)], axis=1)
    return np.stack([depth[p], slope_x, slope_y, -no_cut, no_cut, -no_cut, no_cut], axis=1), starts


def join(
    triangles: ScreenTriangles, draw: DrawList, parts: list[Part], planes: Float64Array, size: tuple[int, int],
    subpixel_bits: int,
) -> tuple[ScreenTriangles, ScreenPolygons]:  # fmt: skip
    """Return the triangles with three corners for each polygon among them, in order of source, and the polygons."""
    assert draw.outlines is not None
    outlines, count, first = draw.outlines, len(parts), len(triangles.xy)
    cut = [k for k, part in enumerate(parts) if len(part.clip)]
    source = outlines.triangle[[part.polygon for part in parts]].astype(np.int32)
    corners = draw.triangles[source].astype(np.int32).reshape(count, 3)
    piece = np.full(count, -1, np.int32)
    piece[cut] = len(triangles.weights) + np.arange(len(cut))
    corners[cut] = first + np.arange(3 * len(cut)).reshape(-1, 3)
    added = np.concatenate([np.empty((0, 4)), *(parts[k].clip for k in cut)])
    more = project(added, planes, size, subpixel_bits)

    def grown(field: str, values: Any) -> Array:
        """Return a field of the triangles with more values behind."""
        present = getattr(triangles, field)
        return np.concatenate([present, np.asarray(values, present.dtype).reshape(-1, *present.shape[1:])])

    joined = triangles._replace(
        xy=grown("xy", more.xy), depth=grown("depth", more.depth), clip=grown("clip", added), corners=grown("corners", corners),
        source=grown("source", source), piece=grown("piece", piece), weights=grown("weights", [parts[k].weights for k in cut]),
        inner=grown("inner", np.full(count, REACHES_OUT | NO_EDGES)), outline=grown("outline", np.full(count, -1)),
    )  # fmt: skip

    # Sort by source, so that a lower row is a lower primitive.
    order = np.argsort(joined.source, kind="stable")
    by_order = {name: getattr(joined, name)[order] for name in ("corners", "source", "piece", "inner", "outline")}
    slot = np.empty(len(order), np.int32)
    slot[order] = np.arange(len(order), dtype=np.int32)
    depths, starts = depth_planes(joined.xy, joined.depth, corners)
    rings = [ring for part in parts for ring in part.rings]
    polygons = ScreenPolygons(
        xy=np.ascontiguousarray(np.concatenate([np.empty((0, 2), np.int64), *rings])),
        ring_starts=np.cumsum([0, *(len(ring) for ring in rings)]).astype(np.int32),
        polygon_rings=np.cumsum([0, *(len(part.rings) for part in parts)]).astype(np.int32),
        fill_rule=outlines.fill_rule[[part.polygon for part in parts]].astype(np.int64),
        slot=slot[len(order) - count :].copy(), planes=depths, starts=starts,
    )  # fmt: skip
    return joined._replace(**by_order), polygons
