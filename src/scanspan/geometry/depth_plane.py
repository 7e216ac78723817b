"""Planes of depth of triangles whose corners may lie behind the eye, from their homogeneous corners.

Depth is a plane over the image also for a triangle of which only a part is in front: z / w = (z0, z1, z2) M^-1 (x, y, 1),
where the rows of M are the corners (x, y, w). The rows of the inverse are the joins of two corners each, which are the
triangle's edges as homogeneous lines. All sums are made in an order of the corners that does not depend on how the triangle
was listed.

The pieces that clipping makes of a triangle have its plane, and so does the triangle that is not clipped
(raster/homogeneous_edges.py): cut points are snapped, and planes of their own would be turned by that. So both ways give the
same depth, bit for bit.

Source: Olano and Greer 1997.
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.geometry.fixed_point import halves_sign, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, UInt8Array

NEAR_CODE, FAR_CODE = 1, 64  # bits of the near and the far plane in an outcode; a corner outside of these alone has an image
UNCUT = 16  # bit of `inner`: the triangle crosses a plane of the camera and was not clipped
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


@helper_kernel
def exchange(corners: Int32Array, weights: Float64Array, i: int, j: int) -> None:
    """Exchange two corners of a piece and their weights.

    Shapes  corners: (3,), weights: (3, 3).
    """
    corners[i], corners[j] = corners[j], corners[i]
    for k in range(3):
        weights[i, k], weights[j, k] = weights[j, k], weights[i, k]


@helper_kernel
def is_above(xy: Int64Array, i: Integer, j: Integer) -> bool:
    """Say whether point i comes before point j in (y, x)."""
    return bool(xy[i, 1] < xy[j, 1] or (xy[i, 1] == xy[j, 1] and xy[i, 0] < xy[j, 0]))


@helper_kernel
def put_in_order(
    corners: Int32Array, weights: Float64Array, inner: UInt8Array, n: int, piece_xy: Int64Array, first_row: int
) -> Integer:
    """Put the corners of piece n in canonical order: clockwise, the first in (y, x) first; return how it ran, -1, 0 or 1.

    Shapes  corners: (3,), weights: (3, 3), a row of each; inner: (N,); piece_xy: (V', 2), its row 0 being corner first_row.
    """
    p, q, r = corners[0] - first_row, corners[1] - first_row, corners[2] - first_row
    across, down, far_across, far_down = (
        piece_xy[q, 0] - piece_xy[p, 0], piece_xy[q, 1] - piece_xy[p, 1],
        piece_xy[r, 0] - piece_xy[p, 0], piece_xy[r, 1] - piece_xy[p, 1],
    )  # fmt: skip
    turn = halves_sign(*product_halves(across, -down, far_down, far_across))

    # Turn the other two round if it runs the other way, then each forward until the first is in front.
    bits = np.int64(inner[n])
    if turn < 0:
        exchange(corners, weights, 1, 2)
        bits = (bits & 1) | (bits & 2) << 1 | (bits & 4) >> 1
    for _ in range(2):
        p, q, r = corners[0] - first_row, corners[1] - first_row, corners[2] - first_row
        if is_above(piece_xy, q, p) or is_above(piece_xy, r, p):
            exchange(corners, weights, 0, 1)
            exchange(corners, weights, 1, 2)
            bits = (bits >> 1) | (bits & 1) << 2
    inner[n] = np.uint8(bits)
    return turn


@kernel
def outline_pieces(
    clip: Float64Array, xy: Int64Array, depth: Float64Array, outcodes: UInt8Array, triangles: Int32Array, middle: Float64Array,
    corners: Int32Array, source: Int32Array, inner: UInt8Array, piece: Int32Array, weights: Float64Array, piece_xy: Int64Array,
    outline: Int32Array, lines: Int64Array, limits: Int64Array, planes: Float64Array,
) -> Integer:  # fmt: skip
    """Give pieces an outline: their own three edges, with the plane of depth of the triangle that they come from.

    A piece without area, or of a triangle whose plane goes through the eye, gets none. Returns how many there are.

    Shapes  clip: (V, 4), xy: (V, 2), depth: (V,), outcodes: (V,), of the corners as given; triangles: (T, 3); corners: (N, 3),
            source: (N,), inner: (N,), piece: (N,), weights: (P, 3, 3) as in ScreenTriangles, of which the corners of pieces are
            put in order; piece_xy: (V', 2) of the corners from row V on; outline: (N,), -1 throughout, lines, limits, planes:
            as there and long enough, written.
    """
    points, joins = np.empty((3, 5)), np.empty((3, 3))
    start, plane = np.zeros(2, np.int64), np.zeros(3)
    volume, before, m = 0.0, np.int64(-1), np.int64(0)
    for n in range(corners.shape[0]):
        if piece[n] < 0:
            continue
        if source[n] != before:
            before = np.int64(source[n])
            volume = find_joins(clip, triangles[before], middle, points, joins)
            if volume != 0.0:
                write_plane(triangles[before], xy, depth, outcodes, points, joins, volume, middle, start, plane)
        turn = put_in_order(corners[n], weights[piece[n]], inner, n, piece_xy, clip.shape[0])
        if volume == 0.0 or turn == 0:
            continue

        # Bound it by the lines between its corners, the inner side to the positive.
        p, q, r = corners[n, 0] - clip.shape[0], corners[n, 1] - clip.shape[0], corners[n, 2] - clip.shape[0]
        p_x, p_y, q_x, q_y, r_x, r_y = (
            piece_xy[p, 0], piece_xy[p, 1], piece_xy[q, 0], piece_xy[q, 1], piece_xy[r, 0], piece_xy[r, 1],
        )  # fmt: skip
        lines[m, 0, 0], lines[m, 0, 1], lines[m, 0, 2], lines[m, 0, 3] = q_y - r_y, r_x - q_x, q_x, q_y
        lines[m, 1, 0], lines[m, 1, 1], lines[m, 1, 2], lines[m, 1, 3] = r_y - p_y, p_x - r_x, r_x, r_y
        lines[m, 2, 0], lines[m, 2, 1], lines[m, 2, 2], lines[m, 2, 3] = p_y - q_y, q_x - p_x, p_x, p_y
        limits[m, 0], limits[m, 1] = min(p_x, q_x, r_x), max(p_x, q_x, r_x)
        limits[m, 2], limits[m, 3] = min(p_y, q_y, r_y), max(p_y, q_y, r_y)
        limits[m, 4], limits[m, 5], limits[m, 6], limits[m, 7] = start[0], start[1], turn, np.int64(inner[n])
        planes[m, 0], planes[m, 1], planes[m, 2] = plane[0], plane[1], plane[2]
        planes[m, 3], planes[m, 4], planes[m, 5], planes[m, 6] = -np.inf, np.inf, -np.inf, np.inf
        outline[n] = m
        m += 1
    return m
