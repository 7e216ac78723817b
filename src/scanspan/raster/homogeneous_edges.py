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

import math

import numpy as np

from scanspan.geometry.clip import MAX_CORNERS, clip_planes, cut_polygon
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.geometry.project import no_outlines, project, snap
from scanspan.jit import helper_kernel, kernel
from scanspan.raster.half_space import half_space, visit_rows
from scanspan.raster.order import visit_hilbert, visit_morton, visit_serpentine, visit_tiles
from scanspan.raster.setup import bound_sample
from scanspan.raster.write import write_sample_key, write_sample_pair, write_sample_tally
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, UInt8Array

NEAR_CODE, FAR_CODE = 1, 64  # bits of the near and the far plane in an outcode; a corner outside of these alone has an image
LINE_UNITS = 2.0**40  # of the longer side of a line's direction; product_halves takes up to 2^41
FAR_AWAY = MAX_COORDINATE / 2.0  # pixels from the middle of the image, where a line has the whole image on one side
EMPTY_BOX = (1, 0, 1, 0)  # lowest and highest x and y
SPLIT = 2.0**27 + 1.0  # Dekker's constant


@helper_kernel
def product_rest(a: float, b: float, product: float) -> float:
    """Return a b - product, what rounding took from a product, exactly. Source: Dekker 1971."""
    a_head, b_head = a * SPLIT - (a * SPLIT - a), b * SPLIT - (b * SPLIT - b)
    a_tail, b_tail = a - a_head, b - b_head
    return ((a_head * b_head - product) + a_head * b_tail + a_tail * b_head) + a_tail * b_tail


@helper_kernel
def determinant(a: float, b: float, c: float, d: float) -> float:
    """Return a d - b c, right to the last bits also where the products nearly cancel."""
    left, right = a * d, b * c
    return (left - right) + (product_rest(a, d, left) - product_rest(b, c, right))


@helper_kernel
def image_point(clip: Float64Array, v: int, half_width: float, half_height: float) -> tuple[float, float, float, float, float]:
    """Return corner v as a homogeneous point (x, y, w) of the image with its z, and the power of two that it was divided by.

    Units   x / w and y / w are pixels right of and below the middle of the image.
    """
    x, y, z, w = clip[v, 0], clip[v, 1], clip[v, 2], clip[v, 3]
    exponent = math.frexp(max(abs(x), abs(y), abs(z), abs(w)))[1]
    scale = math.ldexp(1.0, -exponent) if exponent > -1000 else 1.0
    return x * scale * half_width, -(y * scale) * half_height, w * scale, z * scale, scale


@helper_kernel
def join(
    p_x: float, p_y: float, p_w: float, q_x: float, q_y: float, q_w: float
) -> tuple[float, float, float]:  # fmt: skip
    """Return the line through two points, p x q, the same but for its sign whichever comes first."""
    swaps = (q_x < p_x) | ((q_x == p_x) & ((q_y < p_y) | ((q_y == p_y) & (q_w < p_w))))
    if swaps:
        p_x, p_y, p_w, q_x, q_y, q_w = q_x, q_y, q_w, p_x, p_y, p_w
    a, b, c = determinant(p_y, p_w, q_y, q_w), determinant(p_w, p_x, q_w, q_x), determinant(p_x, p_y, q_x, q_y)
    return (-a, -b, -c) if swaps else (a, b, c)


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
def has_image(outcode: int) -> bool:
    """Say whether a corner lies in front of the eye and within 2^24 px, so that it has a place on the grid."""
    return bool(np.int64(outcode) & ~np.int64(NEAR_CODE | FAR_CODE) == 0)


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


@helper_kernel
def write_plane(
    corners: Int32Array, xy: Int64Array, depth: Float64Array, outcodes: UInt8Array, points: Float64Array, joins: Float64Array,
    volume: float, middle: Float64Array, limits: Int64Array, plane: Float64Array,
) -> None:  # fmt: skip
    """Write the plane of depth: (1 - z / w) / 2 with z / w = (z0, z1, z2) M^-1 (x, y, 1).

    It starts from a corner that has an image, the first in (y, x), and from the middle of the image where none has.
    """
    slope_x, slope_y, at_middle = 0.0, 0.0, 0.0
    for k in range(3):
        share = points[k, 3] / volume
        slope_x += share * joins[k, 0]
        slope_y += share * joins[k, 1]
        at_middle += share * joins[k, 2]
    plane[0], plane[1], plane[2] = 0.5 - 0.5 * at_middle, -0.5 * slope_x / middle[2], -0.5 * slope_y / middle[2]
    limits[4], limits[5] = np.int64(middle[0] * middle[2]), np.int64(middle[1] * middle[2])
    found = False
    for k in range(3):
        v = corners[k]
        is_first = not found or xy[v, 1] < limits[5] or (xy[v, 1] == limits[5] and xy[v, 0] < limits[4])
        if has_image(outcodes[v]) and is_first:
            limits[4], limits[5], plane[0] = xy[v, 0], xy[v, 1], depth[v]
            found = True


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
        codes = np.int64(0)
        for k in range(3):
            v = corners[m, k]
            codes |= np.int64(outcodes[v])
            points[k, 0], points[k, 1], points[k, 2], points[k, 3], points[k, 4] = image_point(clip, v, middle[0], middle[1])
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            joins[k, 0], joins[k, 1], joins[k, 2] = join(
                points[i, 0], points[i, 1], points[i, 2], points[j, 0], points[j, 1], points[j, 2]
            )

        # The volume has the sign of the visible part's area; without any, the plane goes through the eye.
        x, y, w = points[0, 0] * joins[0, 0], points[0, 1] * joins[0, 1], points[0, 2] * joins[0, 2]
        volume = x + y + w
        if abs(volume) <= 2.0**-50 * (abs(x) + abs(y) + abs(w)):
            continue
        sign = -1.0 if volume < 0.0 else 1.0
        limits[m, 6] = np.int64(sign)
        for k in range(3):
            scale = sign * points[k, 4]
            weights[m, k, 0], weights[m, k, 1] = joins[k, 0] * scale / middle[2], joins[k, 1] * scale / middle[2]
            weights[m, k, 2] = (joins[k, 2] - (joins[k, 0] * middle[0] + joins[k, 1] * middle[1])) * scale
        if write_lines(corners[m], xy, outcodes, joins, sign, middle, lines[m]):
            write_box(clip, corners[m], codes, cut, middle, polygon, other, made, limits[m], planes[m])
            write_plane(corners[m], xy, depth, outcodes, points, joins, volume, middle, limits[m], planes[m])
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
    limits = np.zeros((rows, 7), np.int64)
    limits[:, :4] = EMPTY_BOX
    lines, planes, weights = np.zeros((rows, 3, 4), np.int64), np.zeros((rows, 7)), np.zeros((rows, 3, 3))
    middle = np.array([size[0] / 2, size[1] / 2, float(1 << subpixel_bits)])
    outline_kernel(clip, seen.xy, seen.depth, seen.outcodes, corners[crossing], cut, middle, lines, limits, planes, weights)
    fields = no_outlines(count) | {"outline": outline, "lines": lines, "limits": limits, "planes": planes}
    return ScreenTriangles(
        xy=seen.xy, depth=seen.depth, clip=clip, corners=corners, source=kept.astype(np.int32),
        piece=outline, weights=weights, inner=np.zeros(count, np.uint8), **fields,
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
