"""The fast oracle: coverage of many triangles, each alone, over every sample of a small image, in exact integers and NumPy.

It exists because the rational oracle would need a day for a million triangles. It equals that one (test_reference.py), and like
it shares no code with the kernels: no running sums, no bounding box, no bias in the edge value.

Bits. Vertices lie within 2^24 px on a grid of 1/2^16 px: coordinates are at most 2^40, differences a and u at most 2^41, and an
edge value a u + b v at most 2^83, too much for int64. A product is therefore held in two halves: a u = high 2^21 + low with
0 <= low < 2^21. Split a = a1 2^21 + a0: then a1 u and a0 u stay within 2^62, and nothing overflows. Because u depends on the
column alone and v on the row alone, the sign of a u + b v is the comparison of a u with -b v, half by half.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

LOW_BITS = 21  # The lower half of a product; see the module's paragraph on bits.
BLOCK_SAMPLES = 1 << 16  # Samples worked on together, so that the arrays of one step stay in the second-level cache.


def snap(vertices: NDArray[Any], subpixel_bits: int) -> Integers:
    """Return vertices in sub-pixels, halves to even; the product with a power of two is exact in float64."""
    return np.rint(np.asarray(vertices, dtype=np.float64) * float(2**subpixel_bits)).astype(np.int64)


def _product(a: Integers, u: Integers) -> tuple[Integers, Integers]:
    """Return a u as two halves: high 2^21 + low, with 0 <= low < 2^21."""
    low = (a & ((1 << LOW_BITS) - 1)) * u
    return (a >> LOW_BITS) * u + (low >> LOW_BITS), low & ((1 << LOW_BITS) - 1)


def _compare(p: tuple[Integers, Integers], q: tuple[Integers, Integers]) -> tuple[Booleans, Booleans]:
    """Say where p > q and where p == q, both in halves."""
    same_high = p[0] == q[0]
    return (p[0] > q[0]) | (same_high & (p[1] > q[1])), same_high & (p[1] == q[1])


def area_sign(points: Integers) -> Integers:
    """Return the sign of the signed area of triangles (N, 3, 2) in sub-pixels; negative is counter-clockwise as seen."""
    d1, d2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    more, same = _compare(_product(d1[:, 0], d2[:, 1]), _product(d2[:, 0], d1[:, 1]))
    return np.where(same, 0, np.where(more, 1, -1)).astype(np.int64)


def _first_sign(*terms: Integers) -> Integers:
    """Return the sign of the first term that is not zero."""
    sign = np.sign(terms[-1])
    for term in terms[-2::-1]:
        sign = np.where(term != 0, np.sign(term), sign)
    return sign


def _owns_its_line(points: Integers, a: Integers, b: Integers, rule: Any, subpixel_bits: int) -> Booleans:
    """Say which edges (N, 3) own the samples on their line; a and b are the steps of the edge value to the right and down."""
    if rule in ("inclusive", "exclusive"):
        return np.full(a.shape, rule == "inclusive")
    if rule == "top-left":
        return _first_sign(a, b) > 0
    if rule == "bottom-left":
        return _first_sign(a, -b) > 0

    # Put the off-screen point into whole numbers over one denominator, and its edge values into Python's integers.
    x, y, w = Fraction(rule.x) * 2**subpixel_bits, Fraction(rule.y) * 2**subpixel_bits, Fraction(rule.w)
    scale = lcm(x.denominator, y.denominator, w.denominator)
    big_x, big_y, big_w = int(x * scale), int(y * scale), int(w * scale)
    start = points.astype(object)
    value = a.astype(object) * (big_x - big_w * start[..., 0]) + b.astype(object) * (big_y - big_w * start[..., 1])
    sign = ((value > 0).astype(np.int64)) - (value < 0).astype(np.int64)
    return _first_sign(sign, a, b) > 0


def _blocks(count: int, size: tuple[int, int]) -> Iterator[slice]:
    step = max(1, BLOCK_SAMPLES // max(1, size[0] * size[1]))
    for start in range(0, count, step):
        yield slice(start, min(count, start + step))


def _edge_signs(points: Integers, size: tuple[int, int], bits: int) -> Iterator[tuple[Booleans, Booleans]]:
    """Yield, edge by edge, where the edge value is positive (inside) and where it is zero."""
    half, one = 1 << (bits - 1), 1 << bits
    columns, rows = np.arange(size[0], dtype=np.int64) * one + half, np.arange(size[1], dtype=np.int64) * one + half
    for edge in range(3):
        start, end = points[:, edge], points[:, (edge + 1) % 3]
        a, b = start[:, 1] - end[:, 1], end[:, 0] - start[:, 0]
        across = _product(a[:, None, None], columns[None, None, :] - start[:, 0, None, None])
        down = _product(-b[:, None, None], rows[None, :, None] - start[:, 1, None, None])
        yield _compare(across, down)


def _facing_inwards(vertices: NDArray[Any], subpixel_bits: int) -> tuple[Integers, Integers]:
    """Return snapped triangles turned so that edge values are positive inside, and the sign that their area had."""
    points = snap(vertices, subpixel_bits)
    turn = area_sign(points)
    points[turn < 0] = points[turn < 0][:, [0, 2, 1]]
    return points, turn


def coverage(
    vertices: NDArray[Any], size: tuple[int, int], *, rule: Any = "top-left", subpixel_bits: int = 8, cull: str = "none"
) -> Booleans:
    """Return which samples of an image each triangle owns, each triangle alone.

    Parameters
    ----------
    vertices : (N, 3, 2) float, pixels, within 2^24 of the origin.
    size : (width, height).
    rule : the name of a rule, or an object with x, y and w.
    subpixel_bits : 1 to 16.
    cull : "none", "back" or "front".

    Returns
    -------
    (N, height, width) bool
    """
    points, turn = _facing_inwards(vertices, subpixel_bits)
    drawn = turn != {"none": 0, "back": 1, "front": -1}[cull]
    drawn &= turn != 0
    ends = np.roll(points, -1, axis=1)
    owns = _owns_its_line(points, points[..., 1] - ends[..., 1], ends[..., 0] - points[..., 0], rule, subpixel_bits)
    inside = np.empty((len(points), size[1], size[0]), dtype=np.bool_)
    for block in _blocks(len(points), size):
        inside[block] = drawn[block, None, None]
        for edge, (positive, zero) in enumerate(_edge_signs(points[block], size, subpixel_bits)):
            inside[block] &= positive | (zero & owns[block, edge, None, None])
    return inside


def whole_pixels(
    vertices: NDArray[Any], size: tuple[int, int], coverage: str, *, subpixel_bits: int = 8, cull: str = "none"
) -> Booleans:
    """Return which pixels each triangle touches, or which lie inside of it, (N, height, width): decided at their corners.

    "touched": the open square meets the open triangle, so no line separates them along a side of the one or of the other.
    "inside": all four corners of the closed square lie in the closed triangle. A triangle without area has neither.
    """
    points, turn = _facing_inwards(vertices, subpixel_bits)
    drawn = (turn != 0) & (turn != {"none": 0, "back": 1, "front": -1}[cull])
    one, (width, height) = 1 << subpixel_bits, size
    found = np.empty((len(points), height, width), dtype=np.bool_)
    for block in _blocks(len(points), (width + 1, height + 1)):
        found[block] = drawn[block, None, None]

        # Ask every edge about all corners of pixels: none on the inner side separates, one on the outer side lies outside.
        for positive, zero in _edge_signs(points[block] + (one >> 1), (width + 1, height + 1), subpixel_bits):
            fits = positive if coverage == "touched" else positive | zero
            four = (fits[:, :-1, :-1], fits[:, :-1, 1:], fits[:, 1:, :-1], fits[:, 1:, 1:])
            found[block] &= np.logical_or.reduce(four) if coverage == "touched" else np.logical_and.reduce(four)

        # Ask the sides of the pixels about all corners of the triangle.
        for axis, count in ((0, width), (1, height)):
            low = np.arange(count, dtype=np.int64) * one
            place = points[block, :, axis]
            meets = (place.max(axis=1)[:, None] > low) & (place.min(axis=1)[:, None] < low + one)
            found[block] &= meets[:, None, :] if axis == 0 else meets[:, :, None]
    return found


def samples_on_edges(vertices: NDArray[Any], size: tuple[int, int], subpixel_bits: int = 8) -> Integers:
    """Return how many samples lie on the boundary of each triangle; none for a triangle without area."""
    points, turn = _facing_inwards(vertices, subpixel_bits)
    numbers = np.zeros(len(points), dtype=np.int64)
    for block in _blocks(len(points), size):
        closed = np.broadcast_to((turn[block] != 0)[:, None, None], (len(turn[block]), size[1], size[0])).copy()
        tied = np.zeros_like(closed)
        for positive, zero in _edge_signs(points[block], size, subpixel_bits):
            closed &= positive | zero
            tied |= zero
        numbers[block] = (closed & tied).sum(axis=(1, 2))
    return numbers
