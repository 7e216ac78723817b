"""Triangle setup: from three snapped corners to edge functions, depth and bounds, exactly.

One function serves every algorithm, and it is pasted into their loops: for small triangles a separate pass over all of them
costs more than the setup itself. Everything is derived from the snapped corners in integers, so two triangles that share an
edge get the same line, of opposite sign.

Depth uses the edge values too: d = d_p + (E_q (d_q - d_p) + E_r (d_r - d_p)) / 2A, with p the corner that is first in (y, x)
and the others in the order that makes the area positive. So it does not depend on how the triangle was listed, and it stays
accurate on slivers, where a plane in x and y loses what the division by a tiny area magnifies. Two conversions and two products
a sample are the price. Only where an edge value would not fit (s above 12 and a vertex far away) is it the plane in x and y.

Some things are bounded by lines that do not join corners on the grid: a trapezoid of a polygon (polygon.py), a triangle that
reaches behind the eye (homogeneous_edges.py). The pieces of a clipped triangle have its plane of depth, not one of their own.
Such an outline has its lines, its box and its plane of depth given, and gets a setup of the same kind, so that every algorithm
can draw it.

Source: the plane equations of the lectures, with the error of rounding A, B and C apart mended by snapping the vertices.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scanspan.geometry.fixed_point import halves_float, halves_sign, product_halves
from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.edge import HIGH_LIMIT_BITS, SAMPLE, TOP_LEFT, TOUCHED, edge_bias, edge_start, pixel_bias
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

EMPTY = TriangleSetup._make((np.int64(0),) * 19 + (0.0,) * 3 + (-np.inf, np.inf) * 2)


INTEGERS, FLOATS = 19, 7  # fields of a TriangleSetup
NEAR = np.int64(1 << 29)  # sub-pixels; the products of differences below it are exact in an int64


@inline_kernel
def keep_setup(integers: Int64Array, floats: Float64Array, k: int, t: TriangleSetup) -> None:
    """Write a setup into row k of its two arrays."""
    integers[k, 0], integers[k, 1], integers[k, 2], integers[k, 3] = t.x_start, t.x_end, t.y_start, t.y_end
    integers[k, 4], integers[k, 5], integers[k, 6] = t.f0, t.f1, t.f2
    integers[k, 7], integers[k, 8], integers[k, 9] = t.a0, t.a1, t.a2
    integers[k, 10], integers[k, 11], integers[k, 12] = t.b0, t.b1, t.b2
    integers[k, 13], integers[k, 14], integers[k, 15] = t.g1, t.g1_x, t.g1_y
    integers[k, 16], integers[k, 17], integers[k, 18] = t.g2, t.g2_x, t.g2_y
    floats[k, 0], floats[k, 1], floats[k, 2] = t.depth, t.slope1, t.slope2
    floats[k, 3], floats[k, 4], floats[k, 5], floats[k, 6] = t.depth_low, t.depth_high, t.cut_low, t.cut_high


@inline_kernel
def kept_setup(integers: Int64Array, floats: Float64Array, k: Integer) -> TriangleSetup:
    """Return the setup in row k."""
    return TriangleSetup(
        integers[k, 0], integers[k, 1], integers[k, 2], integers[k, 3], integers[k, 4], integers[k, 5], integers[k, 6],
        integers[k, 7], integers[k, 8], integers[k, 9], integers[k, 10], integers[k, 11], integers[k, 12], integers[k, 13],
        integers[k, 14], integers[k, 15], integers[k, 16], integers[k, 17], integers[k, 18],
        floats[k, 0], floats[k, 1], floats[k, 2], floats[k, 3], floats[k, 4], floats[k, 5], floats[k, 6],
    )  # fmt: skip


@helper_kernel
def set_up(
    xy: Int64Array, depths: Float64Array, corners: Int32Array, inner: Array, outline: Int32Array, integers: Int64Array,
    floats: Float64Array, n: int, sampling: Sampling,
) -> TriangleSetup:  # fmt: skip
    """Return the setup of triangle n, or of its outline where it has one: that is made beforehand, as it is rare.

    Shapes  the fields of ScreenTriangles, which a loop has at hand.
    """
    if outline[n] >= 0:
        return kept_setup(integers, floats, outline[n])
    p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
    return set_up_triangle(
        xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1],
        depths[p], depths[q], depths[r], np.int64(inner[n]), sampling,
    )  # fmt: skip


@helper_kernel
def first_sample(position: Integer, sample: int, subpixel_bits: int) -> Integer:
    """Return the first pixel whose sample is not before a position; both in sub-pixels."""
    return -((sample - position) >> subpixel_bits)


@helper_kernel
def pixels_between(
    low: Integer, high: Integer, sample: int, sampling: Sampling, start: int, end: int
) -> tuple[Integer, Integer]:
    """Return the pixels among start to end that a shape from low to high, both included, may cover along one axis.

    Rule    SAMPLE: the sample lies there. TOUCHED: the pixel's open side meets the shape's. INSIDE: all of it lies there.
    """
    s = sampling.subpixel_bits
    if sampling.coverage == SAMPLE:
        return max(first_sample(low, sample, s), start), min(((high - sample) >> s) + 1, end)
    edge = sample - ((1 << s) >> 1)
    if sampling.coverage == TOUCHED:
        return max((low - edge) >> s, start), min(-((edge - high) >> s), end)
    return max(-((edge - low) >> s), start), min((high - edge) >> s, end)


@helper_kernel
def line_bias(a: Integer, b: Integer, q_x: Integer, q_y: Integer, is_inner: bool, sampling: Sampling) -> Integer:
    """Return the bias of an edge: by the rule where samples decide, by its reach where whole pixels do."""
    if sampling.coverage != SAMPLE:
        return pixel_bias(a, b, sampling.coverage, sampling.subpixel_bits)
    return edge_bias(a, b, q_x, q_y, is_inner, sampling.rule, sampling.rule_x, sampling.rule_y, sampling.rule_w)


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
    low_x, high_x, low_y, high_y = min(p_x, q_x, r_x), max(p_x, q_x, r_x), min(p_y, q_y, r_y), max(p_y, q_y, r_y)
    x_start, x_end = pixels_between(low_x, high_x, sampling.sample_x, sampling, sampling.x_start, sampling.x_end)
    y_start, y_end = pixels_between(low_y, high_y, sampling.sample_y, sampling, sampling.y_start, sampling.y_end)
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
    bias0 = line_bias(a0, b0, q_x, q_y, inner_p != 0, sampling)
    bias1 = line_bias(a1, b1, r_x, r_y, inner_q != 0, sampling)
    bias2 = line_bias(a2, b2, p_x, p_y, inner_r != 0, sampling)

    # Evaluate them at the first sample of the box, exactly.
    x, y = (x_start << s) + sampling.sample_x, (y_start << s) + sampling.sample_y
    high0, low0 = product_halves(a0, b0, x - q_x, y - q_y)
    high1, low1 = product_halves(a1, b1, x - r_x, y - r_y)
    high2, low2 = product_halves(a2, b2, x - p_x, y - p_y)
    f0 = edge_start(high0, low0, bias0, s)
    f1 = edge_start(high1, low1, bias1, s)
    f2 = edge_start(high2, low2, bias2, s)

    # Express depth by the last two edges; what flooring and the bias took from them goes into the constant.
    scale = 1.0 / halves_float(area_high, area_low)
    depth, slope1, slope2 = p_depth, (q_depth - p_depth) * scale, (r_depth - p_depth) * scale
    unit = np.float64(np.int64(1) << s)
    limit = np.int64(1) << (HIGH_LIMIT_BITS + s)
    if max(abs(high1), abs(high2)) < limit:
        g1, g2 = f1, f2
        if sampling.coverage != SAMPLE:
            bias1 = bias2 = np.int64(0)
            g1, g2 = edge_start(high1, low1, bias1, s), edge_start(high2, low2, bias2, s)
        mask = (np.int64(1) << s) - 1
        rest1 = np.float64(((low1 + bias1) & mask) - bias1)
        rest2 = np.float64(((low2 + bias2) & mask) - bias2)
        depth += rest1 * slope1 + rest2 * slope2
        g1_x, g1_y, g2_x, g2_y = a1, b1, a2, b2
        slope1, slope2 = slope1 * unit, slope2 * unit
    else:
        along_x = np.float64(a1) * slope1 + np.float64(a2) * slope2
        along_y = np.float64(b1) * slope1 + np.float64(b2) * slope2
        depth, g1, g2 = plane_start(p_x, p_y, depth, along_x, along_y, x_start, y_start, sampling)
        g1_x, g1_y, g2_x, g2_y = np.int64(1), np.int64(0), np.int64(0), np.int64(1)
        slope1, slope2 = along_x * unit, along_y * unit
    depth_low, depth_high = depth_range(p_depth, q_depth, r_depth, sampling)
    return TriangleSetup(x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2,
                         g1, g1_x, g1_y, g2, g2_x, g2_y, depth, slope1, slope2,
                         depth_low, depth_high, -np.inf, np.inf)  # fmt: skip


@helper_kernel
def set_up_edges(p_x: Integer, p_y: Integer, q_x: Integer, q_y: Integer, r_x: Integer, r_y: Integer, sampling: Sampling) -> Any:
    """Return the bounds and edges of a triangle without depth, for whoever needs coverage alone.

    They are those of set_up_triangle but for the order: edges are opposite the corners as they are given, all turned round
    where the area is negative. No rows are left where there is nothing to draw.

    Returns is_cut: whether the rectangle cuts the box off on the right; x_start, x_end, y_start, y_end; f0, f1, f2, a0, a1, a2,
            b0, b1, b2, as in TriangleSetup.
    Units   corners in sub-pixels; of the result, bounds in pixels.
    Needs   sampling.coverage is SAMPLE, and no edge was made inside a primitive.
    """
    s = sampling.subpixel_bits
    low_x, high_x, low_y, high_y = min(p_x, q_x, r_x), max(p_x, q_x, r_x), min(p_y, q_y, r_y), max(p_y, q_y, r_y)
    box_end = ((high_x - sampling.sample_x) >> s) + 1
    x_start, x_end = max(first_sample(low_x, sampling.sample_x, s), sampling.x_start), min(box_end, sampling.x_end)
    y_start, y_end = pixels_between(low_y, high_y, sampling.sample_y, sampling, sampling.y_start, sampling.y_end)

    # Find the sign of the area, and turn all edges round where it is negative.
    is_near = max(high_x - low_x, high_y - low_y) < NEAR
    area: Integer = (q_x - p_x) * (r_y - p_y) + (p_y - q_y) * (r_x - p_x) if is_near else np.int64(0)
    sign = area
    if not is_near:
        area_high, area_low = product_halves(q_x - p_x, p_y - q_y, r_y - p_y, r_x - p_x)
        sign = halves_sign(area_high, area_low)
    turn = np.int64(1) if sign > 0 else np.int64(-1)
    if x_start >= x_end or sign == 0 or turn == sampling.cull:
        y_end = y_start
    a0, b0, a1, b1 = turn * (q_y - r_y), turn * (r_x - q_x), turn * (r_y - p_y), turn * (p_x - r_x)
    a2, b2 = turn * (p_y - q_y), turn * (q_x - p_x)

    # Ask the rule; it is known beforehand for nearly all, and then takes no branches.
    if sampling.rule == TOP_LEFT:
        bias0 = edge_bias(a0, b0, q_x, q_y, False, TOP_LEFT, 0, 0, 1)
        bias1 = edge_bias(a1, b1, r_x, r_y, False, TOP_LEFT, 0, 0, 1)
        bias2 = edge_bias(a2, b2, p_x, p_y, False, TOP_LEFT, 0, 0, 1)
    else:
        bias0 = line_bias(a0, b0, q_x, q_y, False, sampling)
        bias1 = line_bias(a1, b1, r_x, r_y, False, sampling)
        bias2 = line_bias(a2, b2, p_x, p_y, False, sampling)

    # Evaluate the edges at the first sample of the box, exactly.
    x, y = (x_start << s) + sampling.sample_x, (y_start << s) + sampling.sample_y
    f0: Integer
    f1: Integer
    f2: Integer
    if is_near:
        f0 = (a0 * (x - q_x) + b0 * (y - q_y) + bias0) >> s
        f1 = (a1 * (x - r_x) + b1 * (y - r_y) + bias1) >> s
        f2 = (a2 * (x - p_x) + b2 * (y - p_y) + bias2) >> s
    else:
        high0, low0 = product_halves(a0, b0, x - q_x, y - q_y)
        high1, low1 = product_halves(a1, b1, x - r_x, y - r_y)
        high2, low2 = product_halves(a2, b2, x - p_x, y - p_y)
        f0, f1, f2 = edge_start(high0, low0, bias0, s), edge_start(high1, low1, bias1, s), edge_start(high2, low2, bias2, s)
    return box_end > x_end, x_start, x_end, y_start, y_end, f0, f1, f2, a0, a1, a2, b0, b1, b2


@helper_kernel
def depth_range(p_depth: float, q_depth: float, r_depth: float, sampling: Sampling) -> tuple[float, float]:
    """Return the range that depths are held to: that of the corners where a pixel's centre may lie outside of them."""
    if sampling.coverage == SAMPLE:
        return -np.inf, np.inf
    return min(p_depth, q_depth, r_depth), max(p_depth, q_depth, r_depth)


@helper_kernel
def plane_start(
    x: Integer, y: Integer, depth: float, along_x: float, along_y: float, x_start: Integer, y_start: Integer, sampling: Sampling
) -> tuple[float, Integer, Integer]:
    """Return a depth plane in x and y as a constant and the two integers that it has at pixel (x_start, y_start).

    The integers count pixels from the one whose sample is next before (x, y), so that they are small near the triangle.
    """
    s = sampling.subpixel_bits
    i, j = (x - sampling.sample_x) >> s, (y - sampling.sample_y) >> s
    rest_x, rest_y = (i << s) + sampling.sample_x - x, (j << s) + sampling.sample_y - y
    depth += np.float64(rest_x) * along_x + np.float64(rest_y) * along_y
    return depth, x_start - i, y_start - j


@helper_kernel
def line_start(lines: Int64Array, m: Integer, k: int, is_inner: bool, x: Integer, y: Integer, sampling: Sampling) -> Integer:
    """Return the value of line k of outline m at a sample, with the bias in it, divided by 2^s and floored."""
    a, b, q_x, q_y = lines[m, k, 0], lines[m, k, 1], lines[m, k, 2], lines[m, k, 3]
    if a == 0 and b == 0:
        return np.int64(0)
    bias = line_bias(a, b, q_x, q_y, is_inner, sampling)
    high, low = product_halves(a, b, x - q_x, y - q_y)
    return edge_start(high, low, bias, sampling.subpixel_bits)


@kernel
def set_up_outlines(triangles: ScreenTriangles, sampling: Sampling, integers: Int64Array, floats: Float64Array) -> None:
    """Set up all outlines.

    Shapes  triangles: ScreenTriangles; integers: (R, INTEGERS), floats: (R, FLOATS), written.
    """
    for m in range(integers.shape[0]):
        t = set_up_outline(triangles.lines, triangles.limits, triangles.planes, m, sampling)
        keep_setup(integers, floats, m, t)


@helper_kernel
def set_up_outline(lines: Int64Array, limits: Int64Array, planes: Float64Array, m: int, sampling: Sampling) -> TriangleSetup:
    """Return the setup of what up to three lines bound within a box, with depth as a plane in x and y.

    Shapes  row m of the arrays of the same names in ScreenTriangles.
    """
    s = sampling.subpixel_bits
    x_start, x_end = pixels_between(limits[m, 0], limits[m, 1], sampling.sample_x, sampling, sampling.x_start, sampling.x_end)
    y_start, y_end = pixels_between(limits[m, 2], limits[m, 3], sampling.sample_y, sampling, sampling.y_start, sampling.y_end)
    if x_start >= x_end or y_start >= y_end or (sampling.cull != 0 and limits[m, 6] == sampling.cull):
        return EMPTY
    x = (x_start << s) + sampling.sample_x
    y = (y_start << s) + sampling.sample_y
    inner = limits[m, 7]
    f0 = line_start(lines, m, 0, inner & 1 != 0, x, y, sampling)
    f1 = line_start(lines, m, 1, inner & 2 != 0, x, y, sampling)
    f2 = line_start(lines, m, 2, inner & 4 != 0, x, y, sampling)

    # Hold the depth of pixels to the range of what is seen; move the cut by what depth changes towards a pixel's corners.
    along_x, along_y, low, high = planes[m, 1], planes[m, 2], planes[m, 3], planes[m, 4]
    depth, g1, g2 = plane_start(limits[m, 4], limits[m, 5], planes[m, 0], along_x, along_y, x_start, y_start, sampling)
    unit = np.float64(np.int64(1) << s)
    slope1, slope2 = along_x * unit, along_y * unit
    depth_low, depth_high = -np.inf, np.inf
    if sampling.coverage != SAMPLE:
        depth_low, depth_high = planes[m, 5], planes[m, 6]
        reach = (abs(slope1) + abs(slope2)) * (0.5 if sampling.coverage == TOUCHED else -0.5)
        low, high = low - reach, high + reach
    one, none = np.int64(1), np.int64(0)
    return TriangleSetup(x_start, x_end, y_start, y_end, f0, f1, f2, lines[m, 0, 0], lines[m, 1, 0], lines[m, 2, 0],
                         lines[m, 0, 1], lines[m, 1, 1], lines[m, 2, 1], g1, one, none, g2, none, one,
                         depth, slope1, slope2, depth_low, depth_high, low, high)  # fmt: skip


@helper_kernel
def depth_at(setup: TriangleSetup, g1: Integer, g2: Integer) -> float:
    """Return the depth where its two integers have the values g1 and g2: the one expression that every algorithm uses."""
    return setup.depth + (np.float64(g1) * setup.slope1 + np.float64(g2) * setup.slope2)


@helper_kernel
def keep_sample(t: TriangleSetup, inside: bool, depth: float) -> tuple[bool, float]:
    """Leave a sample as it is: the bound of a triangle that geometry has clipped, where samples decide."""
    return inside, depth


@helper_kernel
def keep_flat(t: TriangleSetup, inside: bool, depth: float) -> tuple[bool, float]:
    """Leave a sample as it is, of a triangle that is equally deep everywhere: the compiler need not evaluate its plane."""
    return inside, t.depth


@helper_kernel
def bound_sample(t: TriangleSetup, inside: bool, depth: float) -> tuple[bool, float]:
    """Cut a sample off where its depth lies beyond the planes of the camera, and hold its depth to what the triangle has."""
    return inside & (depth >= t.cut_low) & (depth <= t.cut_high), min(max(depth, t.depth_low), t.depth_high)
