"""Planes of depth of triangles whose corners may lie behind the eye, from their homogeneous corners.

Depth is a plane over the image also for a triangle of which only a part is in front: z / w = (z0, z1, z2) M^-1 (x, y, 1),
where the rows of M are the corners (x, y, w). The rows of the inverse are the joins of two corners each, which are the
triangle's edges as homogeneous lines. All sums are made in an order of the corners that does not depend on how the triangle
was listed.

The pieces that clipping makes of a triangle take their depths from its plane, and so does the triangle that is not clipped
(raster/homogeneous_edges.py): cut points are snapped, and planes of their own would be turned by that.

Source: Olano and Greer 1997.
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float64Array, Int32Array, Int64Array, UInt8Array

NEAR_CODE, FAR_CODE = 1, 64  # bits of the near and the far plane in an outcode; a corner outside of these alone has an image
SPLIT = 2.0**27 + 1.0  # Dekker's constant
NO_VOLUME = 2.0**-50  # as a share of what is added up; such a plane goes through the eye


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
def has_image(outcode: int) -> bool:
    """Say whether a corner lies in front of the eye and within 2^24 px, so that it has a place on the grid."""
    return bool(np.int64(outcode) & ~np.int64(NEAR_CODE | FAR_CODE) == 0)


@helper_kernel
def is_before(points: Float64Array, i: int, j: int) -> bool:
    """Say whether corner i comes before corner j in the order of their numbers."""
    for c in range(4):
        if points[i, c] != points[j, c]:
            return bool(points[i, c] < points[j, c])
    return False


@helper_kernel
def in_order(points: Float64Array) -> tuple[int, int, int]:
    """Return the three corners in an order that does not depend on how they were listed."""
    i, j, k = 0, 1, 2
    if is_before(points, j, i):
        i, j = j, i
    if is_before(points, k, j):
        j, k = k, j
    if is_before(points, j, i):
        i, j = j, i
    return i, j, k


@helper_kernel
def find_joins(
    clip: Float64Array, corners: Int32Array, middle: Float64Array, points: Float64Array, joins: Float64Array
) -> float:
    """Write the corners as points of the image and the joins opposite them; return the volume, 0 for a plane through the eye.

    Shapes  corners: (3,); middle: (3,) the middle of the image in pixels, and the sub-pixels in a pixel; points: (3, 5) as from
            image_point, joins: (3, 3), written. The volume has the sign of the area of the part that is seen.
    """
    for k in range(3):
        points[k, 0], points[k, 1], points[k, 2], points[k, 3], points[k, 4] = image_point(
            clip, corners[k], middle[0], middle[1]
        )
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        joins[k, 0], joins[k, 1], joins[k, 2] = join(
            points[i, 0], points[i, 1], points[i, 2], points[j, 0], points[j, 1], points[j, 2]
        )
    k, _, _ = in_order(points)
    x, y, w = points[k, 0] * joins[k, 0], points[k, 1] * joins[k, 1], points[k, 2] * joins[k, 2]
    volume = (x + y) + w
    return 0.0 if abs(volume) <= NO_VOLUME * (abs(x) + abs(y) + abs(w)) else volume


@helper_kernel
def write_plane(
    corners: Int32Array, xy: Int64Array, depth: Float64Array, outcodes: UInt8Array, points: Float64Array, joins: Float64Array,
    volume: float, middle: Float64Array, start: Int64Array, plane: Float64Array,
) -> None:  # fmt: skip
    """Write the plane of depth, (1 - z / w) / 2: where it starts, its depth there, and its two slopes in a sub-pixel.

    It starts from a corner that has an image, the first in (y, x), and from the middle of the image where none has.

    Shapes  corners: (3,); points, joins: from find_joins; start: (2,) sub-pixels, plane: (3,), written.
    """
    slope_x, slope_y, at_middle = 0.0, 0.0, 0.0
    for k in in_order(points):
        share = points[k, 3] / volume
        slope_x += share * joins[k, 0]
        slope_y += share * joins[k, 1]
        at_middle += share * joins[k, 2]
    plane[0], plane[1], plane[2] = 0.5 - 0.5 * at_middle, -0.5 * slope_x / middle[2], -0.5 * slope_y / middle[2]
    start[0], start[1] = np.int64(middle[0] * middle[2]), np.int64(middle[1] * middle[2])
    found = False
    for k in in_order(points):
        v = corners[k]
        is_first = not found or xy[v, 1] < start[1] or (xy[v, 1] == start[1] and xy[v, 0] < start[0])
        if has_image(outcodes[v]) and is_first:
            start[0], start[1], plane[0] = xy[v, 0], xy[v, 1], depth[v]
            found = True


@kernel
def lay_pieces(
    clip: Float64Array, xy: Int64Array, depth: Float64Array, outcodes: UInt8Array, triangles: Int32Array, middle: Float64Array,
    corners: Int32Array, source: Int32Array, piece: Int32Array, piece_xy: Int64Array, piece_depth: Float64Array,
) -> None:  # fmt: skip
    """Put the corners of pieces onto the plane of depth of the triangle that they come from.

    Shapes  clip: (V, 4), xy: (V, 2), depth: (V,), outcodes: (V,), of the corners as given; triangles: (T, 3); corners: (N, 3),
            source: (N,), piece: (N,) as in ScreenTriangles; piece_xy: (V', 2) and piece_depth: (V',) written, of the corners
            from row V on, which no two triangles share.
    """
    points, joins = np.empty((3, 5)), np.empty((3, 3))
    start, plane = np.zeros(2, np.int64), np.zeros(3)
    volume, before = 0.0, np.int64(-1)
    for n in range(corners.shape[0]):
        if piece[n] < 0:
            continue
        if source[n] != before:
            before = np.int64(source[n])
            volume = find_joins(clip, triangles[before], middle, points, joins)
            if volume != 0.0:
                write_plane(triangles[before], xy, depth, outcodes, points, joins, volume, middle, start, plane)
        if volume != 0.0:
            for k in range(3):
                v = corners[n, k] - clip.shape[0]
                across, down = np.float64(piece_xy[v, 0] - start[0]), np.float64(piece_xy[v, 1] - start[1])
                piece_depth[v] = plane[0] + (across * plane[1] + down * plane[2])
