"""The one home of the edge rule: edge values in exact integers, and who owns a sample that lies on an edge.

An edge from q to r has the value E(x, y) = a (x - q_x) + b (y - q_y) with a = q_y - r_y and b = r_x - q_x, all in sub-pixels.
With y down and the corners in the order that makes the area positive, the inside is where all three values are positive. A rule
decides about E = 0. It is folded into the constant as a bias of 0 (the edge owns its samples) or -1, so that one sign test
remains. Where whole pixels are asked for, "touched" or "inside", the bias moves the edge outwards or inwards by half a pixel.

Samples lie 2^s sub-pixels apart, so the value of a sample is a constant plus 2^s (a i + b j). Divided by 2^s and floored it
becomes F, which is negative exactly where the biased value is, and steps by a and b from pixel to pixel. |F| < 2^(51 + s) for
vertices within 2^24 px: an int64 up to s = 12. Above that F is held at about +-2^61. An image side is at most 2^18 px and a and
b are at most 2^41, so steps across a whole image add at most 2^60, and a pixel's bias 2^42: a held value keeps its sign.
(geometry/fixed_point.py has the other bit counts.)

Source: Pineda 1988 for edge functions; Direct3D for the top-left rule; the bias as in llvmpipe and meshoptimizer.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import HALF_BITS, halves_sign, product_halves
from scanspan.jit import helper_kernel
from scanspan.records import Integer

TOP_LEFT, BOTTOM_LEFT, INCLUSIVE, EXCLUSIVE, OFFSCREEN_POINT = range(5)
SAMPLE, TOUCHED, INSIDE = range(3)  # what of a pixel must be covered: its sample, any part of it, all of it

HIGH_LIMIT_BITS = np.int64(41)  # high is held at 2^(41 + s), which makes F about 2^61


@helper_kernel
def edge_bias(
    a: Integer, b: Integer, q_x: Integer, q_y: Integer, is_inner: bool, rule: int, rule_x: int, rule_y: int, rule_w: int
) -> Integer:
    """Return 0 where an edge owns the samples that lie on it, -1 where it does not.

    Rule    top-left: left edges (a > 0), and top ones (a = 0, b > 0). bottom-left: left edges, and bottom ones. An off-screen
            point: edges that have it on their inner side; on the edge's own line it counts as moved by (+e, +e^2), which is
            top-left.
    Needs   is_inner is true for an edge made inside a primitive: it is top-left under the inclusive and the exclusive rule.
    """
    is_left = a > 0
    is_level = a == 0
    owns = is_left | (is_level & (b > 0))
    if rule == BOTTOM_LEFT:
        owns = is_left | (is_level & (b < 0))
    elif rule == INCLUSIVE:
        owns = owns | (not is_inner)
    elif rule == EXCLUSIVE:
        owns = owns & is_inner
    elif rule == OFFSCREEN_POINT:
        high, low = product_halves(a, b, rule_x - q_x * rule_w, rule_y - q_y * rule_w)
        side = halves_sign(high, low)
        owns = (side > 0) | ((side == 0) & owns)
    return np.int64(0) if owns else np.int64(-1)


@helper_kernel
def pixel_bias(a: Integer, b: Integer, coverage: int, subpixel_bits: int) -> Integer:
    """Return the bias that lets the centre of a pixel decide about all of it; no rule applies to that.

    Over the pixel the edge value differs from the centre's by up to (|a| + |b|) / 2 pixel, at a corner.

    Rule    TOUCHED: the open pixel has a point on the inner side. INSIDE: the closed pixel has none on the outer side.
    """
    reach = (max(a, -a) + max(b, -b)) << (subpixel_bits - 1)
    return reach - 1 if coverage == TOUCHED else -reach


@helper_kernel
def edge_start(high: Integer, low: Integer, bias: Integer, subpixel_bits: int) -> Integer:
    """Return F, the biased edge value divided by 2^s and floored, held where it would not fit."""
    limit = np.int64(1) << (HIGH_LIMIT_BITS + subpixel_bits)
    held = min(max(high, -limit), limit)
    return held * (np.int64(1) << (HALF_BITS - subpixel_bits)) + ((low + bias) >> subpixel_bits)
