"""Fixed point and edges: exact at the limits that the bit counts promise."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanspan.geometry.fixed_point import MAX_COORDINATE, MAX_SIDE, halves_float, halves_sign, product_halves
from scanspan.geometry.project import snap
from scanspan.raster.edge import edge_start

BITS = st.sampled_from([4, 8, 12, 16])
INT = np.int64


def corner(bits: int) -> st.SearchStrategy[int]:
    """A coordinate in sub-pixels, often at the limit."""
    limit = MAX_COORDINATE << bits
    return st.one_of(st.integers(-limit, limit), st.sampled_from([-limit, limit, 0, 1, -1, limit - 1]))


@st.composite
def edges(draw: st.DrawFn) -> tuple[int, tuple[int, int], tuple[int, int], tuple[int, int]]:
    """Two corners, and a sample inside the largest image."""
    bits = draw(BITS)
    q, r = ((draw(corner(bits)), draw(corner(bits))) for _ in range(2))
    side = st.integers(0, (MAX_SIDE << bits) - 1)
    return bits, q, r, (draw(side), draw(side))


@given(edges())
def test_product_halves_are_exact_up_to_the_limits(case):
    _, (q_x, q_y), (r_x, r_y), (x, y) = case
    a, b = q_y - r_y, r_x - q_x
    high, low = product_halves(INT(a), INT(b), INT(x - q_x), INT(y - q_y))
    exact = a * (x - q_x) + b * (y - q_y)
    assert int(high) * 2**20 + int(low) == exact
    assert 0 <= low < 2**20
    assert halves_sign(high, low) == (exact > 0) - (exact < 0)
    assert halves_float(high, low) == pytest.approx(float(exact), rel=2**-51)


@given(edges(), st.sampled_from([0, -1]))
def test_edge_start_is_negative_exactly_where_the_value_is(case, bias):
    bits, (q_x, q_y), (r_x, r_y), (x, y) = case
    a, b = q_y - r_y, r_x - q_x
    start = edge_start(*product_halves(INT(a), INT(b), INT(x - q_x), INT(y - q_y)), INT(bias), INT(bits))
    exact = a * (x - q_x) + b * (y - q_y) + bias
    if abs(exact >> bits) < 2**61:
        assert start == exact >> bits
    assert (start < 0) == (exact < 0)

    # Step to the far corner of the image: what is held must not change sign, and nothing may leave the int64.
    steps_x, steps_y = ((MAX_SIDE - 1 - (x >> bits)), (MAX_SIDE - 1 - (y >> bits)))
    for i in (-(x >> bits), steps_x):
        for j in (-(y >> bits), steps_y):
            stepped = int(start) + a * i + b * j
            assert abs(stepped) < 2**63
            assert (stepped < 0) == (exact + ((a * i + b * j) << bits) < 0)


@pytest.mark.parametrize(
    ("value", "bits", "expected"), [(0.5, 0, 0), (1.5, 0, 2), (2.5, 0, 2), (-0.5, 0, 0), (1 / 512, 8, 0), (3 / 512, 8, 2)]
)
def test_snapping_rounds_half_to_even(value, bits, expected):
    assert snap(value, float(1 << bits)) == expected


def test_snapping_cuts_back_what_lies_beyond_the_range():
    assert snap(1e300, 256.0) == MAX_COORDINATE << 8
    assert snap(-1e300, 65536.0) == -(MAX_COORDINATE << 16)


def test_the_limits_are_those_of_the_comments():
    """The largest values that the module's text speaks of fit, computed in whole numbers."""
    difference = 2 * MAX_COORDINATE << 16
    assert difference == 2**41
    assert (difference >> 20) * difference * 2 <= 2**63  # the two upper products, before one takes from the other
    assert Fraction(difference**2, 2**20) + 2**42 < 2**63  # their sum, as the whole is an area in a square
    assert 2 * ((1 << 20) - 1) * difference < 2**63  # the lower products
