"""Setup of many triangles at once: their corners side by side in rows of numbers, and loops over these without a branch.

One by one, a triangle of a few samples takes longer to set up than to draw: a hundred instructions, and branches that no
processor can foresee. In lanes it is eight at a time, and what cannot be foreseen is a choice between two values
(docs/decisions/0022-lanes.md has the measurements). blocks.py sets up what it has sorted by the shape of its boxes, flat.py
what it draws in order.

Numbers are float64: of corners that lie within 2^24 sub-pixels of each other, all products are whole numbers below 2^50, exact.
The expressions are those of setup.py, so the bits are the same. What is larger, or has an outline, is set up there.

Source: Pineda 1988; M. Abrash, Rasterization on Larrabee, 2009, for lanes and for doing without branches.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper
from scanspan.raster.edge import BOTTOM_LEFT, EXCLUSIVE, INCLUSIVE, OFFSCREEN_POINT
from scanspan.records import Array, Float64Array, Int64Array, Integer, Sampling

BLOCK = 64  # triangles that are set up together
NEAR = 2.0**24  # sub-pixels that a triangle is smaller than
VECTOR = np.int64(8)  # numbers of 64 bits, which a vector of 64 bytes holds

# Rows of BLOCK whole numbers: the first sample of the box in pixels; its columns and rows; the columns rounded up to whole
# vectors, 0 where its rows are filled as spans; and the three edges. No rows are left where there is nothing to draw; they are
# negative where a triangle is to be set up by itself.
LEFT, TOP, ACROSS, ROWS, PADDED, EDGE, RIGHT, DOWN, WHOLE = 0, 1, 2, 3, 4, 5, 8, 11, 14

# Rows of BLOCK floats: x and y of three corners, as they are given, then in sub-pixels from the first sample; their depths,
# then the depth where the last two edges are zero and its two slopes; and from VALUES on, whatever a picture needs.
DEPTH, VALUES = 6, 9


@bare_helper
def whole_vectors(count: Integer) -> Integer:
    """Return a count rounded up to whole vectors, so that a loop has no rest that would be done one by one."""
    return (count + (VECTOR - 1)) & -VECTOR


@bare_helper
def bias_of(a: float, b: float, down: float, is_inclusive: bool, is_exclusive: bool) -> float:
    """Return the bias of an edge as edge_bias does; down is -1 where the lower of two level edges owns its samples."""
    owns = (((a > 0.0) | ((a == 0.0) & (down * b > 0.0))) | is_inclusive) & (not is_exclusive)
    return 0.0 if owns else -1.0


@bare_helper
def turned(is_r: bool, is_q: bool, p: float, q: float, r: float) -> float:
    """Return the number of the corner that is first."""
    return r if is_r else (q if is_q else p)


@bare_helper
def set_up_lane(
    p_x: float, p_y: float, q_x: float, q_y: float, r_x: float, r_y: float, p_depth: float, q_depth: float, r_depth: float,
    cull: float, is_inclusive: bool, is_exclusive: bool, down: float, unit: float,
) -> tuple[bool, float, float, float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return what set_up_triangle does, of a triangle that is near, without a branch.

    Returns is_drawn; f0, f1, f2, a0, a1, a2, b0, b1, b2; the depth where the last two are zero, and how it changes with each.
    Units   corners in sub-pixels from the first sample of the box, so that edge values there are products of two of them; unit:
            sub-pixels in a pixel; cull as in Sampling; down: -1 for the bottom-left rule, else 1.
    """
    e_p, e_q, e_r = q_x * r_y - q_y * r_x, r_x * p_y - r_y * p_x, p_x * q_y - p_y * q_x
    area = (e_p + e_q) + e_r
    is_drawn = (area != 0.0) & (area * cull <= 0.0)

    # Make the area positive.
    swaps = area < 0.0
    q_x, r_x, q_y, r_y = (r_x if swaps else q_x), (q_x if swaps else r_x), (r_y if swaps else q_y), (q_y if swaps else r_y)
    q_depth, r_depth = (r_depth if swaps else q_depth), (q_depth if swaps else r_depth)
    e_p, e_q, e_r = (-e_p if swaps else e_p), (-e_r if swaps else e_q), (-e_q if swaps else e_r)
    scale, part = 1.0 / (abs(area) if is_drawn else 1.0), 1.0 / unit

    # Form the edges; fold the rule in, divide by a pixel and floor, and keep what that took away.
    a_p, b_p, a_q, b_q, a_r, b_r = q_y - r_y, r_x - q_x, r_y - p_y, p_x - r_x, p_y - q_y, q_x - p_x
    bias_p = bias_of(a_p, b_p, down, is_inclusive, is_exclusive)
    bias_q = bias_of(a_q, b_q, down, is_inclusive, is_exclusive)
    bias_r = bias_of(a_r, b_r, down, is_inclusive, is_exclusive)
    e_p, e_q, e_r = e_p + bias_p, e_q + bias_q, e_r + bias_r
    f_p, f_q, f_r = np.floor(e_p * part), np.floor(e_q * part), np.floor(e_r * part)
    rest_p, rest_q, rest_r = (e_p - f_p * unit) - bias_p, (e_q - f_q * unit) - bias_q, (e_r - f_r * unit) - bias_r

    # Put the corner first that is first in (y, x).
    r_is_before_q = (r_y < q_y) | ((r_y == q_y) & (r_x < q_x))
    is_r = r_is_before_q & ((r_y < p_y) | ((r_y == p_y) & (r_x < p_x)))
    is_q = (not r_is_before_q) & ((q_y < p_y) | ((q_y == p_y) & (q_x < p_x)))
    depth = turned(is_r, is_q, p_depth, q_depth, r_depth)
    slope1 = (turned(is_r, is_q, q_depth, r_depth, p_depth) - depth) * scale
    slope2 = (turned(is_r, is_q, r_depth, p_depth, q_depth) - depth) * scale
    rest1, rest2 = turned(is_r, is_q, rest_q, rest_r, rest_p), turned(is_r, is_q, rest_r, rest_p, rest_q)
    return (
        is_drawn, turned(is_r, is_q, f_p, f_q, f_r), turned(is_r, is_q, f_q, f_r, f_p), turned(is_r, is_q, f_r, f_p, f_q),
        turned(is_r, is_q, a_p, a_q, a_r), turned(is_r, is_q, a_q, a_r, a_p), turned(is_r, is_q, a_r, a_p, a_q),
        turned(is_r, is_q, b_p, b_q, b_r), turned(is_r, is_q, b_q, b_r, b_p), turned(is_r, is_q, b_r, b_p, b_q),
        depth + (rest1 * slope1 + rest2 * slope2), slope1 * unit, slope2 * unit,
    )  # fmt: skip


@bare_helper
def fetch_corners(vertices: Array, listed: Int64Array, start: Integer, count: Integer, floats: Float64Array) -> None:
    """Copy the corners of some triangles of a list into rows of numbers.

    Shapes  vertices: (N, 3, 2).
    """
    for k in range(count):
        n = np.uint64(listed[np.uint64(start + k)])
        floats[k], floats[BLOCK + k] = vertices[n, 0, 0], vertices[n, 0, 1]
        floats[2 * BLOCK + k], floats[3 * BLOCK + k] = vertices[n, 1, 0], vertices[n, 1, 1]
        floats[4 * BLOCK + k], floats[5 * BLOCK + k] = vertices[n, 2, 0], vertices[n, 2, 1]


@bare_helper
def find_boxes(floats: Float64Array, whole: Int64Array, count: Integer, sampling: Sampling, unit: float, wide: float) -> None:
    """Snap the corners, find the box of each triangle, and count its corners from there.

    Units   wide: samples across, beyond which rows are filled as spans.
    """
    part, has_lanes = 1.0 / unit, sampling.rule != OFFSCREEN_POINT
    sample_x, sample_y = np.float64(sampling.sample_x), np.float64(sampling.sample_y)
    x_start, x_end = np.float64(sampling.x_start), np.float64(sampling.x_end)
    y_start, y_end = np.float64(sampling.y_start), np.float64(sampling.y_end)
    for k in range(count):
        p_x, p_y = np.rint(floats[k] * unit), np.rint(floats[BLOCK + k] * unit)
        q_x, q_y = np.rint(floats[2 * BLOCK + k] * unit), np.rint(floats[3 * BLOCK + k] * unit)
        r_x, r_y = np.rint(floats[4 * BLOCK + k] * unit), np.rint(floats[5 * BLOCK + k] * unit)
        low_x, high_x, low_y, high_y = min(p_x, q_x, r_x), max(p_x, q_x, r_x), min(p_y, q_y, r_y), max(p_y, q_y, r_y)
        x, y = max(np.ceil((low_x - sample_x) * part), x_start), max(np.ceil((low_y - sample_y) * part), y_start)
        box_end = np.floor((high_x - sample_x) * part) + 1.0
        across, rows = min(box_end, x_end) - x, min(np.floor((high_y - sample_y) * part) + 1.0, y_end) - y
        is_drawn = (across > 0.0) & (rows > 0.0)
        is_near = (high_x - low_x < NEAR) & (high_y - low_y < NEAR)
        whole[LEFT * BLOCK + k], whole[TOP * BLOCK + k] = np.int64(x), np.int64(y)
        whole[ACROSS * BLOCK + k] = np.int64(across)
        whole[ROWS * BLOCK + k] = np.int64((rows if is_near & has_lanes else -rows) if is_drawn else 0.0)
        whole[PADDED * BLOCK + k] = whole_vectors(np.int64(across if (across <= wide) & (box_end <= x_end) else 0.0))

        # Of others than these the numbers might not fit, and are not looked at.
        fits, left, top = is_drawn & is_near, x * unit + sample_x, y * unit + sample_y
        floats[k], floats[BLOCK + k] = p_x - left if fits else 0.0, p_y - top if fits else 0.0
        floats[2 * BLOCK + k], floats[3 * BLOCK + k] = q_x - left if fits else 0.0, q_y - top if fits else 0.0
        floats[4 * BLOCK + k], floats[5 * BLOCK + k] = r_x - left if fits else 0.0, r_y - top if fits else 0.0


@bare_helper
def set_up_lanes(floats: Float64Array, whole: Int64Array, count: Integer, cull: float, rule: Integer, unit: float) -> None:
    """Set up the edges and the depth of the triangles whose boxes have been found."""
    is_inclusive, is_exclusive, down = rule == INCLUSIVE, rule == EXCLUSIVE, -1.0 if rule == BOTTOM_LEFT else 1.0
    for k in range(count):
        is_drawn, f0, f1, f2, a0, a1, a2, b0, b1, b2, depth, slope1, slope2 = set_up_lane(
            floats[k], floats[BLOCK + k], floats[2 * BLOCK + k], floats[3 * BLOCK + k], floats[4 * BLOCK + k],
            floats[5 * BLOCK + k], floats[DEPTH * BLOCK + k], floats[(DEPTH + 1) * BLOCK + k], floats[(DEPTH + 2) * BLOCK + k],
            cull, is_inclusive, is_exclusive, down, unit,
        )  # fmt: skip
        rows = whole[ROWS * BLOCK + k]
        whole[ROWS * BLOCK + k] = rows if is_drawn | (rows < 0) else np.int64(0)
        whole[EDGE * BLOCK + k], whole[(EDGE + 1) * BLOCK + k] = np.int64(f0), np.int64(f1)
        whole[(EDGE + 2) * BLOCK + k] = np.int64(f2)
        whole[RIGHT * BLOCK + k], whole[(RIGHT + 1) * BLOCK + k] = np.int64(a0), np.int64(a1)
        whole[(RIGHT + 2) * BLOCK + k] = np.int64(a2)
        whole[DOWN * BLOCK + k], whole[(DOWN + 1) * BLOCK + k] = np.int64(b0), np.int64(b1)
        whole[(DOWN + 2) * BLOCK + k] = np.int64(b2)
        floats[DEPTH * BLOCK + k] = depth
        floats[(DEPTH + 1) * BLOCK + k], floats[(DEPTH + 2) * BLOCK + k] = slope1, slope2
