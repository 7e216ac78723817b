"""Triangle setup: from three snapped corners to edge functions, depth and bounds, exactly.

One function serves every algorithm, and it is pasted into their loops: for small triangles a separate pass over all of them
costs more than the setup itself. Everything is derived from the snapped corners in integers, so two triangles that share an
edge get the same line, of opposite sign.

Depth uses the edge values too: d = d_p + (E_q (d_q - d_p) + E_r (d_r - d_p)) / 2A, with p the corner that is first in (y, x)
and the others in the order that makes the area positive. So it does not depend on how the triangle was listed, and it stays
accurate on slivers, where a plane in x and y loses what the division by a tiny area magnifies. Two conversions and two products
a sample are the price. Only where an edge value would not fit (s above 12 and a vertex far away) is it the plane in x and y.

Source: the plane equations of the lectures, with the error of rounding A, B and C apart mended by snapping the vertices.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import halves_float, halves_sign, product_halves
from scanspan.jit import helper_kernel
from scanspan.raster.edge import HIGH_LIMIT_BITS, edge_bias, edge_start
from scanspan.records import Integer, Sampling, TriangleSetup

EMPTY = TriangleSetup._make((np.int64(0),) * 19 + (0.0,) * 3)


@helper_kernel
def first_sample(position: Integer, sample: int, subpixel_bits: int) -> Integer:
    """Return the first pixel whose sample is not before a position; both in sub-pixels."""
    return -((sample - position) >> subpixel_bits)


@helper_kernel
def set_up_triangle(
    p_x: Integer, p_y: Integer, q_x: Integer, q_y: Integer, r_x: Integer, r_y: Integer,
    p_depth: float, q_depth: float, r_depth: float, inner: Integer, sampling: Sampling,
) -> TriangleSetup:  # fmt: skip
    """Return the setup of the triangle p, q, r; its rows are empty where there is nothing to draw.

    Units   corners in sub-pixels; of the result, bounds in pixels, edge values in sub-pixels squared over 2^s.
    Needs   bit i of inner is set where the edge opposite corner i was made inside a primitive.
    Rule    sampling.rule; zero area and culled triangles draw nothing, decided by the exact sign after snapping.
    """
    s = sampling.subpixel_bits

    # Find the pixels whose samples lie in the bounding box; most triangles of a fine mesh end here.
    x_start = max(first_sample(min(p_x, q_x, r_x), sampling.sample_x, s), sampling.x_start)
    x_end = min(((max(p_x, q_x, r_x) - sampling.sample_x) >> s) + 1, sampling.x_end)
    y_start = max(first_sample(min(p_y, q_y, r_y), sampling.sample_y, s), sampling.y_start)
    y_end = min(((max(p_y, q_y, r_y) - sampling.sample_y) >> s) + 1, sampling.y_end)
    if x_start >= x_end or y_start >= y_end:
        return EMPTY

    # Cull by the exact sign of the area: positive is clockwise as seen, because y points down.
    area_high, area_low = product_halves(q_x - p_x, p_y - q_y, r_y - p_y, r_x - p_x)
    sign = halves_sign(area_high, area_low)
    if sign == 0 or sign == sampling.cull:
        return EMPTY

    # Put the corners in canonical order: positive area, and the first in (y, x) first.
    inner_p, inner_q, inner_r = inner & 1, (inner >> 1) & 1, inner >> 2
    if sign < 0:
        q_depth, r_depth, q_x, q_y, r_x, r_y, inner_q, inner_r = r_depth, q_depth, r_x, r_y, q_x, q_y, inner_r, inner_q
        area_high, area_low = product_halves(q_x - p_x, p_y - q_y, r_y - p_y, r_x - p_x)
    if q_y < p_y or (q_y == p_y and q_x < p_x):
        if r_y < q_y or (r_y == q_y and r_x < q_x):
            p_depth, q_depth, r_depth = r_depth, p_depth, q_depth
            p_x, p_y, q_x, q_y, r_x, r_y = r_x, r_y, p_x, p_y, q_x, q_y
            inner_p, inner_q, inner_r = inner_r, inner_p, inner_q
        else:
            p_depth, q_depth, r_depth = q_depth, r_depth, p_depth
            p_x, p_y, q_x, q_y, r_x, r_y = q_x, q_y, r_x, r_y, p_x, p_y
            inner_p, inner_q, inner_r = inner_q, inner_r, inner_p
    elif r_y < p_y or (r_y == p_y and r_x < p_x):
        p_depth, q_depth, r_depth = r_depth, p_depth, q_depth
        p_x, p_y, q_x, q_y, r_x, r_y = r_x, r_y, p_x, p_y, q_x, q_y
        inner_p, inner_q, inner_r = inner_r, inner_p, inner_q

    # Form the three edges, each opposite the corner whose weight it gives.
    a0, b0, a1, b1, a2, b2 = q_y - r_y, r_x - q_x, r_y - p_y, p_x - r_x, p_y - q_y, q_x - p_x
    rule, rule_x, rule_y, rule_w = sampling.rule, sampling.rule_x, sampling.rule_y, sampling.rule_w
    bias0 = edge_bias(a0, b0, q_x, q_y, inner_p != 0, rule, rule_x, rule_y, rule_w)
    bias1 = edge_bias(a1, b1, r_x, r_y, inner_q != 0, rule, rule_x, rule_y, rule_w)
    bias2 = edge_bias(a2, b2, p_x, p_y, inner_r != 0, rule, rule_x, rule_y, rule_w)

    # Evaluate them at the first sample of the box, exactly.
    x = (x_start << s) + sampling.sample_x
    y = (y_start << s) + sampling.sample_y
    high0, low0 = product_halves(a0, b0, x - q_x, y - q_y)
    high1, low1 = product_halves(a1, b1, x - r_x, y - r_y)
    high2, low2 = product_halves(a2, b2, x - p_x, y - p_y)
    f0 = edge_start(high0, low0, bias0, s)
    f1 = edge_start(high1, low1, bias1, s)
    f2 = edge_start(high2, low2, bias2, s)

    # Express depth by the last two edges; what flooring and the bias took from them goes into the constant.
    scale = 1.0 / halves_float(area_high, area_low)
    depth = p_depth
    slope1 = (q_depth - depth) * scale
    slope2 = (r_depth - depth) * scale
    unit = np.float64(np.int64(1) << s)
    limit = np.int64(1) << (HIGH_LIMIT_BITS + s)
    if max(abs(high1), abs(high2)) < limit:
        mask = (np.int64(1) << s) - 1
        rest1 = np.float64(((low1 + bias1) & mask) - bias1)
        rest2 = np.float64(((low2 + bias2) & mask) - bias2)
        depth += rest1 * slope1 + rest2 * slope2
        g1, g1_x, g1_y, g2, g2_x, g2_y = f1, a1, b1, f2, a2, b2
        slope1, slope2 = slope1 * unit, slope2 * unit
    else:
        high1, low1 = product_halves(a1, b1, sampling.sample_x - r_x, sampling.sample_y - r_y)
        high2, low2 = product_halves(a2, b2, sampling.sample_x - p_x, sampling.sample_y - p_y)
        depth += halves_float(high1, low1) * slope1 + halves_float(high2, low2) * slope2
        along_x = (np.float64(a1) * slope1 + np.float64(a2) * slope2) * unit
        along_y = (np.float64(b1) * slope1 + np.float64(b2) * slope2) * unit
        g1, g1_x, g1_y, g2, g2_x, g2_y = x_start, np.int64(1), np.int64(0), y_start, np.int64(0), np.int64(1)
        slope1, slope2 = along_x, along_y
    return TriangleSetup(x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2,
                         g1, g1_x, g1_y, g2, g2_x, g2_y, depth, slope1, slope2)  # fmt: skip


@helper_kernel
def depth_at(setup: TriangleSetup, g1: Integer, g2: Integer) -> float:
    """Return the depth where its two integers have the values g1 and g2: the one expression that every algorithm uses."""
    return setup.depth + (np.float64(g1) * setup.slope1 + np.float64(g2) * setup.slope2)
