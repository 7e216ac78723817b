"""Homogeneous rasterization: triangles are drawn without clipping them, also those that reach behind the eye.

The division by w is what a corner behind the eye cannot take. But the edge functions do not need it: the line through two
corners is their cross product as homogeneous points (x, y, w) of the image, wherever they lie. A sample is inside where all
three lines have it on their inner side, and that implies w > 0 there. The planes of the camera cut nothing off either: a sample
is left out if its depth lies beyond them, which is one comparison for each plane.

A triangle with all corners in front of the planes is set up by its snapped corners, as everywhere, and comes out the same to
the bit. In others, an edge with both ends in front runs through the snapped ends; one with an end behind has the direction of
the exact line, rounded to 40 bits, and goes through the snapped end in front; one with none in front goes through its own point
next to the middle of the image, snapped. All are computed from the ends in one order, so the neighbour gets the same line, and
no crack opens. Edges that clipping makes move by up to the snapping of cut points: the two ways differ within 1/128 px of an
edge.

It also serves coverage of whole pixels ("touched", "inside") in the other algorithms, which a triangle cut into pieces could
not: a pixel may lie inside of the whole and of no piece.

When to choose it: when corners lie behind the eye in great number, as inside of a room; else it costs what half-space does.

Source: Olano and Greer 1997, Triangle scan conversion using 2D homogeneous coordinates.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.clip import MAX_CORNERS, clip_planes, cut_polygon
from scanspan.geometry.depth_plane import FAR_CODE, NEAR_CODE, UNCUT, find_joins, has_image, write_plane
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.geometry.project import no_outlines, project, room_for_outlines, snap
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.order import visit_hilbert, visit_morton, visit_serpentine, visit_tiles
from scanspan.raster.setup import bound_sample
from scanspan.raster.write import write_sample_key, write_sample_pair, write_sample_tally
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array

LINE_UNITS = 2.0**40  # of the longer side of a line's direction; product_halves takes up to 2^41
FAR_AWAY = MAX_COORDINATE / 2.0  # pixels from the middle of the image, where a line has the whole image on one side
EMPTY_BOX = (1, 0, 1, 0)  # lowest and highest x and y


@helper_kernel
def write_line(
    line: Int64Array, a: float, b: float, c: float, sign: float, x: float, y: float, has_point: bool, middle: Float64Array
) -> bool:
    """Write an exact line as integers and say whether anything of the image can be on its inner side.

    Shapes  line: (4,): a, b, q_x, q_y; middle: (3,) the middle of the image and the sub-pixels in a pixel.
    Units   x, y in sub-pixels: where the line is to go through, if it has such a point; c for pixels from the middle.
    """
    size = max(abs(a), abs(b))
    if not has_point:
        # Find the point next to the middle; a line beyond all images has them on one side.
        square = (a / size) * (a / size) + (b / size) * (b / size) if size > 0.0 else 0.0
        away = abs(c / size) if size > 0.0 else np.inf
        if not away < FAR_AWAY:
            line[:] = 0
            return sign * c > 0.0
        x = np.rint((middle[0] - c / size * (a / size) / square) * middle[2])
        y = np.rint((middle[1] - c / size * (b / size) / square) * middle[2])
    elif size == 0.0:
        return False
    line[0], line[1] = np.int64(np.rint(sign * a / size * LINE_UNITS)), np.int64(np.rint(sign * b / size * LINE_UNITS))
    line[2], line[3] = np.int64(x), np.int64(y)
    return True


@helper_kernel
def write_lines(
    corners: Int32Array, xy: Int64Array, outcodes: UInt8Array, joins: Float64Array, sign: float, middle: Float64Array,
    lines: Int64Array,
) -> bool:  # fmt: skip
    """Write the three lines of a triangle, and say whether anything of the image can be inside of all.

    Shapes  corners: (3,); joins: (3, 3); lines: (3, 4).
    """
    is_seen = True
    for k in range(3):
        i, j = corners[(k + 1) % 3], corners[(k + 2) % 3]
        i_front, j_front = has_image(outcodes[i]), has_image(outcodes[j])
        if i_front and j_front and (xy[i, 0] != xy[j, 0] or xy[i, 1] != xy[j, 1]):
            turn = np.int64(sign)
            lines[k, 0], lines[k, 1] = turn * (xy[i, 1] - xy[j, 1]), turn * (xy[j, 0] - xy[i, 0])
            lines[k, 2], lines[k, 3] = xy[i, 0], xy[i, 1]
            continue
        v = i if i_front else j
        is_seen &= write_line(
            lines[k], joins[k, 0], joins[k, 1], joins[k, 2], sign,
            np.float64(xy[v, 0]), np.float64(xy[v, 1]), i_front or j_front, middle,
        )  # fmt: skip
    return is_seen


@helper_kernel
def write_box(
    clip: Float64Array, corners: Int32Array, codes: Integer, planes: Float64Array, middle: Float64Array,
    polygon: Float64Array, other: Float64Array, made: UInt8Array, limits: Int64Array, plane: Float64Array,
) -> None:  # fmt: skip
    """Write the box and the range of depth of what the planes leave of a triangle; the box stays empty where that is nothing.

    Shapes  polygon, other: (MAX_CORNERS, 7); made: (2, MAX_CORNERS), room to cut in; limits, plane: rows of limits and planes.
    """
    count = 3
    for i in range(3):
        for c in range(4):
            polygon[i, c] = clip[corners[i], c]
    for k in range(planes.shape[0]):
        if codes >> k & 1:
            count = cut_polygon(polygon, made[0], count, planes, k, other, made[1])
            for i in range(count):
                for c in range(4):
                    polygon[i, c] = other[i, c]
    for i in range(count):
        w = polygon[i, 3]
        x = snap(middle[0] + polygon[i, 0] / w * middle[0], middle[2])
        y = snap(middle[1] - polygon[i, 1] / w * middle[1], middle[2])
        limits[0], limits[1] = x if i == 0 else min(limits[0], x), x if i == 0 else max(limits[1], x)
        limits[2], limits[3] = y if i == 0 else min(limits[2], y), y if i == 0 else max(limits[3], y)
        depth = (w - polygon[i, 2]) / (w + w)
        plane[5], plane[6] = depth if i == 0 else min(plane[5], depth), depth if i == 0 else max(plane[6], depth)


@kernel
def outline_kernel(
    clip: Float64Array, xy: Int64Array, depth: Float64Array, outcodes: UInt8Array, corners: Int32Array, cut: Float64Array,
    middle: Float64Array, lines: Int64Array, limits: Int64Array, planes: Float64Array, weights: Float64Array,
) -> None:  # fmt: skip
    """Write lines, box, depth and weights of triangles of which the planes of the camera cut a part off.

    Shapes  corners: (R, 3); cut: (P, 5), see clip.py; middle: (3,) as in write_line; lines, limits, planes,
            weights: of ScreenTriangles, limits being those of empty boxes, which triangles keep that have nothing to draw.
    Source  Olano and Greer 1997.
    """
    points, joins = np.empty((3, 5)), np.empty((3, 3))
    polygon, other, made = np.empty((MAX_CORNERS, 7)), np.empty((MAX_CORNERS, 7)), np.zeros((2, MAX_CORNERS), np.uint8)
    for m in range(corners.shape[0]):
        volume = find_joins(clip, corners[m], middle, points, joins)
        if volume == 0.0:
            continue
        codes = np.int64(outcodes[corners[m, 0]]) | np.int64(outcodes[corners[m, 1]]) | np.int64(outcodes[corners[m, 2]])
        sign = -1.0 if volume < 0.0 else 1.0
        limits[m, 6] = np.int64(sign)
        for k in range(3):
            scale = sign * points[k, 4]
            weights[m, k, 0], weights[m, k, 1] = joins[k, 0] * scale / middle[2], joins[k, 1] * scale / middle[2]
            weights[m, k, 2] = (joins[k, 2] - (joins[k, 0] * middle[0] + joins[k, 1] * middle[1])) * scale
        if write_lines(corners[m], xy, outcodes, joins, sign, middle, lines[m]):
            write_box(clip, corners[m], codes, cut, middle, polygon, other, made, limits[m], planes[m])
            write_plane(corners[m], xy, depth, outcodes, points, joins, volume, middle, limits[m, 4:6], planes[m, :3])
            planes[m, 3] = 0.0 if codes & FAR_CODE else -np.inf
            planes[m, 4] = 1.0 if codes & NEAR_CODE else np.inf
            planes[m, 5] = 0.0 if codes & FAR_CODE else planes[m, 5]
            planes[m, 6] = 1.0 if codes & NEAR_CODE else planes[m, 6]


def without_clipping(
    clip: Float64Array, triangles: Int32Array, size: tuple[int, int], subpixel_bits: int, far: bool = False
) -> ScreenTriangles:
    """Project and snap triangles, and give those that cross a plane of the camera an outline.

    Parameters and result are those of `to_screen` in geometry/clip.py, but that no triangle becomes pieces.
    """
    cut = clip_planes(size, far)
    seen = project(clip, cut, size, subpixel_bits)
    codes = seen.outcodes[triangles]
    kept = np.flatnonzero((codes[:, 0] & codes[:, 1] & codes[:, 2]) == 0)
    crossing = (codes[kept, 0] | codes[kept, 1] | codes[kept, 2]) != 0
    corners = np.ascontiguousarray(triangles[kept])
    rows, count = int(crossing.sum()), len(kept)
    outline = np.full(count, -1, np.int32)
    outline[crossing] = np.arange(rows, dtype=np.int32)
    fields, weights = no_outlines(count) | {"outline": outline} | room_for_outlines(rows), np.zeros((rows, 3, 3))
    fields["limits"][:, :4] = EMPTY_BOX
    middle = np.array([size[0] / 2, size[1] / 2, float(1 << subpixel_bits)])
    outline_kernel(
        clip, seen.xy, seen.depth, seen.outcodes, corners[crossing], cut, middle,
        fields["lines"], fields["limits"], fields["planes"], weights,
    )  # fmt: skip
    return ScreenTriangles(
        xy=seen.xy, depth=seen.depth, clip=clip, corners=corners, source=kept.astype(np.int32),
        piece=outline, weights=weights, inner=np.where(crossing, np.uint8(UNCUT), np.uint8(0)), **fields,
    )  # fmt: skip


@kernel
def homogeneous_rows_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Rows, without clipping, into (H, W) keys."""
    half_space(visit_rows, write_sample_key, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_rows_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Rows, without clipping, into (H, W, 2) pairs."""
    half_space(visit_rows, write_sample_pair, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_rows_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Rows, without clipping, into (H, W, 4) tallies."""
    half_space(visit_rows, write_sample_tally, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_serpentine_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine, without clipping, into (H, W) keys."""
    half_space(visit_serpentine, write_sample_key, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_serpentine_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine, without clipping, into (H, W, 2) pairs."""
    half_space(visit_serpentine, write_sample_pair, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_serpentine_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Serpentine, without clipping, into (H, W, 4) tallies."""
    half_space(visit_serpentine, write_sample_tally, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_tiles_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles, without clipping, into (H, W) keys."""
    half_space(visit_tiles, write_sample_key, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_tiles_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles, without clipping, into (H, W, 2) pairs."""
    half_space(visit_tiles, write_sample_pair, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_tiles_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Tiles, without clipping, into (H, W, 4) tallies."""
    half_space(visit_tiles, write_sample_tally, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_morton_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve, without clipping, into (H, W) keys."""
    half_space(visit_morton, write_sample_key, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_morton_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve, without clipping, into (H, W, 2) pairs."""
    half_space(visit_morton, write_sample_pair, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_morton_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Morton's curve, without clipping, into (H, W, 4) tallies."""
    half_space(visit_morton, write_sample_tally, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_hilbert_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve, without clipping, into (H, W) keys."""
    half_space(visit_hilbert, write_sample_key, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_hilbert_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve, without clipping, into (H, W, 2) pairs."""
    half_space(visit_hilbert, write_sample_pair, bound_sample, target, counters, triangles, first, last, sampling)


@kernel
def homogeneous_hilbert_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Hilbert's curve, without clipping, into (H, W, 4) tallies."""
    half_space(visit_hilbert, write_sample_tally, bound_sample, target, counters, triangles, first, last, sampling)
