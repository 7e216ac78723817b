"""Barycentric weights of the visible samples of a row, in lanes: gather the corners of all, then weigh them at once.

Small triangles lie all over the memory, so what a sample costs is the time until its corners have arrived. A loop that only
copies has dozens of them under way at once; one that weighs each sample before the next has one or two. The second loop has no
branch and no look-up, so the compiler turns it into vector instructions, divisions included.

A weight is max(E_k, 0) / w_k over the sum of the three, as `weigh_sample` has it; that is the slow way, which knows pieces of
clipped triangles and corners that are far away, and is taken for these. For all others coordinates are counted from the sample,
and below 2^25 sub-pixels edge values are exact in float64: the same bits.

Source: Heckbert and Moreton 1991.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.depth_plane import UNCUT
from scanspan.geometry.fixed_point import halves_float, product_halves
from scanspan.geometry.outlines import REACHES_OUT
from scanspan.jit import bare_kernel, helper_kernel, kernel
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, ScreenTriangles, UInt8Array

LANES = 256  # samples at a time; their numbers take 22 KiB, and stay in the first-level cache
NEAR = 2.0**25  # sub-pixels

# Rows of LANES numbers: x and y of the three corners from the sample, w of each, and 1 where a corner is far. The weights take
# the place of the first three.
CORNER_W, IS_FAR, ROWS = 6, 9, 10


@helper_kernel
def edge_value(a_x: Integer, a_y: Integer, b_x: Integer, b_y: Integer, x: Integer, y: Integer) -> float:
    """Return the value of the edge from a to b at a sample."""
    high, low = product_halves(a_y - b_y, b_x - a_x, x - a_x, y - a_y)
    return halves_float(high, low)


@helper_kernel
def line_weight(weights: Float64Array, m: Integer, k: int, x: Integer, y: Integer) -> float:
    """Return what the share of corner k of a triangle that is not clipped is proportional to, at a sample."""
    weight: float = (weights[m, k, 0] * np.float64(x) + weights[m, k, 1] * np.float64(y)) + weights[m, k, 2]
    return weight


@bare_kernel
def weigh_sample(
    xy: Int64Array, clip: Float64Array, corners: Int32Array, piece: Int32Array, weights: Float64Array, inner: UInt8Array,
    n: Integer, x: Integer, y: Integer,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the weights of the source triangle's corners at a sample.

    Shapes  the fields of ScreenTriangles; n: the row that is visible there.
    Units   x, y in sub-pixels.
    """
    # Weigh the corners by the edge values opposite them.
    p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
    m = piece[n]
    if inner[n] & UNCUT:
        e0, e1, e2 = line_weight(weights, m, 0, x, y), line_weight(weights, m, 1, x, y), line_weight(weights, m, 2, x, y)
        w_p, w_q, w_r = 1.0, 1.0, 1.0
    else:
        e0 = edge_value(xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1], x, y)
        e1 = edge_value(xy[r, 0], xy[r, 1], xy[p, 0], xy[p, 1], x, y)
        e2 = edge_value(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], x, y)
        w_p, w_q, w_r = clip[p, 3], clip[q, 3], clip[r, 3]

    # Turn a clockwise triangle's signs round. A pixel that is touched beside its centre takes the triangle's border.
    turn = -1.0 if (e0 + e1) + e2 < 0.0 else 1.0
    low = -np.inf if inner[n] & REACHES_OUT else 0.0
    w0, w1, w2 = max(turn * e0, low) / w_p, max(turn * e1, low) / w_q, max(turn * e2, low) / w_r
    total = (w0 + w1) + w2
    w0, w1, w2 = w0 / total, w1 / total, w2 / total

    # Carry the weights of a piece over to its source.
    if m >= 0 and inner[n] & UNCUT == 0:
        return (
            (w0 * weights[m, 0, 0] + w1 * weights[m, 1, 0]) + w2 * weights[m, 2, 0],
            (w0 * weights[m, 0, 1] + w1 * weights[m, 1, 1]) + w2 * weights[m, 2, 1],
            (w0 * weights[m, 0, 2] + w1 * weights[m, 1, 2]) + w2 * weights[m, 2, 2],
        )
    return w0, w1, w2


@bare_kernel
def find_covered(slots: Int32Array, j: Integer, places: Int32Array) -> Integer:
    """List the columns of row j in which something is visible, and return how many there are."""
    count = np.int64(0)
    for i in range(slots.shape[1]):
        places[count] = i
        count += np.int64(slots[j, i] >= 0)
    return count


@bare_kernel
def gather_lanes(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, count: Integer, xy: Int64Array, clip: Float64Array,
    corners: Int32Array, sample_x: Integer, y: Integer, s: Integer, lanes: Float64Array,
) -> None:  # fmt: skip
    """Copy the corners of the triangles that some samples of a row show."""
    for k in range(count):
        i = np.int64(places[start + k])
        n = np.uint32(slots[j, i])
        x = (i << s) + sample_x
        p, q, r = np.uint32(corners[n, 0]), np.uint32(corners[n, 1]), np.uint32(corners[n, 2])
        lanes[k], lanes[LANES + k] = np.float64(xy[p, 0] - x), np.float64(xy[p, 1] - y)
        lanes[2 * LANES + k], lanes[3 * LANES + k] = np.float64(xy[q, 0] - x), np.float64(xy[q, 1] - y)
        lanes[4 * LANES + k], lanes[5 * LANES + k] = np.float64(xy[r, 0] - x), np.float64(xy[r, 1] - y)
        lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k] = clip[p, 3], clip[q, 3], clip[r, 3]


@bare_kernel
def weigh_lanes(lanes: Float64Array, count: Integer) -> bool:
    """Overwrite the first three rows with the weights, and say whether a corner of any of them is far."""
    any_far = False
    for k in range(count):
        p_x, p_y, q_x, q_y = lanes[k], lanes[LANES + k], lanes[2 * LANES + k], lanes[3 * LANES + k]
        r_x, r_y = lanes[4 * LANES + k], lanes[5 * LANES + k]
        reach_x, reach_y = max(abs(p_x), max(abs(q_x), abs(r_x))), max(abs(p_y), max(abs(q_y), abs(r_y)))
        is_far = max(reach_x, reach_y) >= NEAR
        any_far |= is_far
        lanes[IS_FAR * LANES + k] = 1.0 if is_far else 0.0

        # Adding 0.0 makes -0.0 into 0.0, which a difference of whole numbers is.
        e0, e1, e2 = (q_x * r_y - q_y * r_x) + 0.0, (r_x * p_y - r_y * p_x) + 0.0, (p_x * q_y - p_y * q_x) + 0.0
        turn = -1.0 if (e0 + e1) + e2 < 0.0 else 1.0
        w0 = max(turn * e0, 0.0) / lanes[CORNER_W * LANES + k]
        w1 = max(turn * e1, 0.0) / lanes[(CORNER_W + 1) * LANES + k]
        w2 = max(turn * e2, 0.0) / lanes[(CORNER_W + 2) * LANES + k]
        total = (w0 + w1) + w2
        lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = w0 / total, w1 / total, w2 / total
    return any_far


@bare_kernel
def any_odd(weights: Float64Array, inner: UInt8Array) -> bool:
    """Say whether any triangle is a piece of one, or is not weighed by its corners as they are."""
    bits = np.uint8(0)
    for n in range(inner.shape[0]):
        bits |= inner[n]
    return weights.shape[0] > 0 or bool(bits != 0)


@kernel
def weigh_row(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, count: Integer, triangles: ScreenTriangles,
    sample_x: Integer, y: Integer, s: Integer, has_odd: bool, lanes: Float64Array,
) -> None:  # fmt: skip
    """Put the weights of at most LANES visible samples of row j into the first three rows of lanes.

    Shapes  slots: (h, W), row of triangles.corners or -1; places: (W,), the columns, of which `count` are wanted from `start`
            on; has_odd: any_odd of the triangles; lanes: (ROWS x LANES,).
    Units   sample_x: sub-pixels from a pixel's corner; y: of the row's samples, in sub-pixels.
    """
    xy, clip, corners = triangles.xy, triangles.clip, triangles.corners
    piece, weights, inner = triangles.piece, triangles.weights, triangles.inner
    gather_lanes(slots, j, places, start, count, xy, clip, corners, sample_x, y, s, lanes)
    any_far = weigh_lanes(lanes, count)

    # Weigh one by one what is far, or cut, or a polygon.
    if any_far or has_odd:
        for k in range(count):
            n = slots[j, places[start + k]]
            if lanes[IS_FAR * LANES + k] != 0.0 or piece[n] >= 0 or inner[n] != 0:
                x = (np.int64(places[start + k]) << s) + sample_x
                lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = weigh_sample(
                    xy, clip, corners, piece, weights, inner, n, x, y
                )  # fmt: skip
