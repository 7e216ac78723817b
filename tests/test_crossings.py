"""Crossings: columns that are exact for edges of any length, sums of any size, and bands that fit together."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.fill_rule import is_filled, winding_limits
from scanspan.raster import crossings
from tests.painting import FILL_RULES, filled


def inside_by_limits(rule: int, winding: int) -> bool:
    """Say whether a winding is inside by the limits of a rule."""
    mask, below, above = winding_limits(rule)
    return bool((winding & mask) < below or (winding & mask) > above)


def test_limits_of_windings_are_the_fill_rules() -> None:
    for rule, winding in product(range(5), [*range(-6, 7), 2**31 - 1, -(2**31), 2**31 - 2]):
        assert inside_by_limits(rule, winding) == is_filled(rule, winding, winding), (rule, winding)


def columns(a: int, b: int, f: int, rows: int, allowance: int = 0) -> tuple[Any, Any]:
    """Return the columns that an edge crosses in fixed point, and exactly."""
    edges = np.zeros((1, crossings.EDGE_COLUMNS), np.int64)
    crossings.start_edge(edges, 0, np.int64(a), np.int64(b), np.int64(f), np.int64(rows))
    k = np.arange(rows)
    assert edges[0, crossings.A] == 0, "not stepped in fixed point"
    position = edges[0, crossings.POSITION] + allowance + k * edges[0, crossings.SPEED]
    return position >> crossings.FRACTION_BITS, -((f + k * b) // a)


TALL, WIDE = int(crossings.TALL), int(crossings.WIDE)
SLOPES = [
    (TALL, WIDE),
    (TALL, -WIDE),
    (TALL, 1),
    (TALL, -1),
    (TALL - 1, WIDE - 1),
    (TALL - 3, 7),
    (3, 1),
    (7, -2),
    (1, 0),
    (1, WIDE),
]


@pytest.mark.parametrize(("a", "b"), SLOPES)
def test_columns_in_fixed_point_are_exact(a: int, b: int, rng: np.random.Generator) -> None:
    # Edges that meet a sample in their last row, or miss it by the least that there is, and others.
    rows = max(1, min(a // 16, 1 << 18))
    meets = [-(rows - 1) * b + offset for offset in (-1, 0, 1, a - 1, 5 * a)]
    for f in [*meets, *rng.integers(-(10**5) * a // 4, 10**5 * a // 4, 20).tolist()]:
        found, exact = columns(a, b, f, rows)
        assert np.array_equal(found, exact), f


def test_without_its_allowance_a_position_falls_short() -> None:
    # What start_edge adds is taken away again, and edges that meet a sample in their last row are a column off.
    rows = TALL // 16
    wrong = [np.not_equal(*columns(a, b, -(rows - 1) * b, rows, int(crossings.MOST_STEPS))).any() for a, b in SLOPES[:6]]
    assert any(wrong)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("reach", [60.0, 3000.0, 1e5, 1.6e7])
def test_edges_of_any_length_equal_the_parity_fill(reach: float, bits: int, rng: np.random.Generator) -> None:
    size = (70, 90)
    for rule in FILL_RULES:
        ring = np.array([35, 45]) + rng.uniform(-1, 1, (9, 2)) * rng.choice([30.0, reach], (9, 1))
        painted = [filled([ring], size, fill_rule=rule, subpixel_bits=bits, algorithm=name) for name in ("scanline", "parity")]
        assert np.array_equal(*painted)
        found = ss.coverage(ring, size, fill_rule=rule, subpixel_bits=bits)
        assert np.array_equal(found, painted[0])


def test_rows_of_a_picture_do_not_depend_on_where_bands_begin(rng: np.random.Generator) -> None:
    ring = rng.uniform(-10, 140, (40, 2))
    whole = ss.coverage(ring, (130, 131), fill_rule="non-zero")
    for y_start, height in ((0, 1), (1, 32), (31, 34), (64, 67), (130, 1)):
        part = ss.coverage(ring, (130, 131), fill_rule="non-zero", window=(3, y_start, 100, height))
        assert np.array_equal(part, whole[y_start : y_start + height, 3:103])


def test_many_edges_cross_in_one_column() -> None:
    square = np.array([(1.0, 1), (3, 1), (3, 3), (1, 3)])
    for count, rules in ((40_000, [False, True, False, True, True]), (65_536, [False, True, False, True, True])):
        for rule, is_inside in zip(FILL_RULES, rules, strict=True):
            found = ss.coverage([square] * count, (4, 4), fill_rule=rule)
            assert found[1:3, 1:3].all() == is_inside
            assert found.sum() == (4 if is_inside else 0)


def test_polygons_above_each_other_leave_bands_empty() -> None:
    rings = [np.array([(1.0, y), (2, y), (2, y + 1), (1, y + 1)]) for y in (0, 500, 199)]
    found = ss.coverage(rings, (4, 600))
    assert np.argwhere(found).tolist() == [[0, 1], [199, 1], [500, 1]]
