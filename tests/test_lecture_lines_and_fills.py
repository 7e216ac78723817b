"""The lectures' lines and fills against the library's, and each of their faults in numbers."""

from __future__ import annotations

import sys
from fractions import Fraction

import numpy as np
import pytest
from scipy import ndimage

from scanspan.errors import InputError
from scanspan.lectures import fills, lines
from scanspan.masks import coverage

# Lines


def test_one_pixel_a_column_and_at_most_half_a_pixel_off() -> None:
    for dx, dy in lines.octant(20):
        for algorithm in (lines.dda, lines.midpoint, lines.midpoint_integer):
            pixels = algorithm(3, 5, 3 + dx, 5 + dy)
            assert [x for x, _ in pixels] == list(range(3, 4 + dx))
            assert max(abs(y - 5 - Fraction(dy * (x - 3), dx)) for x, y in pixels) <= Fraction(1, 2)


def test_d_is_f_at_the_next_midpoint() -> None:
    assert lines.f(Fraction(4), Fraction(1), 0, 0, 8, 4) < 0 < lines.f(Fraction(4), Fraction(3), 0, 0, 8, 4)
    for dx, dy in lines.octant(12):
        # The loop decides by d as it steps it, and f decides anew at each midpoint: the same pixels.
        y, decided = 0, []
        for x in range(dx + 1):
            decided.append((x, y))
            y += lines.f(Fraction(x + 1), y + Fraction(1, 2), 0, 0, dx, dy) < 0
        assert lines.midpoint(0, 0, dx, dy) == decided
        for x0, y0 in ((0, 0), (5, 3), (-7, 11)):
            ends = (x0, y0, x0 + dx, y0 + dy)
            assert lines.f(Fraction(x0), Fraction(y0), *ends) == lines.f(Fraction(x0 + dx), Fraction(y0 + dy), *ends) == 0
            assert lines.doubled_start(*ends) == 2 * lines.f(Fraction(x0 + 1), y0 + Fraction(1, 2), *ends) == dx - 2 * dy


def test_ties_of_the_819_segments() -> None:
    found = lines.demonstrate_ties()
    assert found == lines.Ties(
        segments=819, from_half_down=0, from_half_up=249, from_other_end=249, shipped_midpoint=0,
        shipped_symmetric_from_other_end=0,
    )  # fmt: skip


def test_the_dda_drifts_and_the_shipped_one_does_not() -> None:
    found = lines.demonstrate_dda_drift()
    assert found == lines.DdaDrift(segments=819, wrong=73, shipped_wrong=0, example=(12, 2))


def test_the_other_octants() -> None:
    found = lines.demonstrate_other_octants()
    assert {name: line.drawn for name, line in found.items()} == {"upright": 1, "steep": 4, "to the left": 0, "falling": 10}
    assert {line.shipped for line in found.values()} == {line.needed for line in found.values()} == {10}
    falling = lines.demonstrate_other_octants(lines.midpoint)["falling"]
    assert falling.drawn < falling.needed


def test_two_d_is_no_assignment() -> None:
    assert lines.demonstrate_literal_doubling() == lines.LiteralDoubling(819, wrong_as_printed=597, wrong_as_meant=0)


def test_what_the_previous_step_has_evaluated() -> None:
    assert lines.demonstrate_previous_step() == lines.PreviousStep(39, at_printed=0, at_mended=39)


def test_the_long_form_leaves_32_bits() -> None:
    found = lines.demonstrate_long_form()
    assert found.overflows
    assert found.start == found.short_form == 100
    assert not lines.demonstrate_long_form(1000, 1000).overflows


# Flood fill


def test_a_flood_is_the_component_and_takes_4_n_plus_1_calls(rng: np.random.Generator) -> None:
    for _ in range(10):
        boundary = rng.random((12, 15)) < 0.35
        boundary[6, 7] = False
        labels, _ = ndimage.label(~boundary)
        by_calls, by_frames = fills.Flood(boundary), fills.Flood(boundary)
        fills.flood_fill(by_calls, 7, 6)
        fills.flood_fill_frames(by_frames, 7, 6)
        for flood in (by_calls, by_frames):
            assert np.array_equal(flood.colored, labels == labels[6, 7])
            assert flood.calls == 4 * flood.filled + 1
        assert by_calls.deepest == by_frames.deepest


def test_a_seed_on_the_outline_or_outside_fills_nothing() -> None:
    for x, y in ((0, 0), (-1, 2), (2, 9)):
        flood = fills.Flood(np.eye(4, dtype=bool))
        fills.flood_fill(flood, x, y)
        assert (flood.filled, flood.calls) == (0, 1)


def test_recursion_is_as_deep_as_there_are_pixels() -> None:
    limit = sys.getrecursionlimit()
    found = fills.demonstrate_recursion(100)
    assert (found.calls_needed, found.depth_needed, found.shipped_filled) == (40001, 10000, 10000)
    assert found.shipped_looked_at < 2 * found.pixels
    assert found.filled_before_the_crash == 10000 or found.filled_before_the_crash <= found.python_limit
    assert sys.getrecursionlimit() == limit
    small = fills.demonstrate_recursion(10)
    assert (small.calls_needed, small.filled_before_the_crash) == (401, 100)


def test_the_outline_belongs_to_the_flooded_shape() -> None:
    found = fills.demonstrate_outline()
    assert found == fills.FloodShape(flooded=290, sampled=221, only_flooded=74, unreached=5)


def test_flags_must_be_cleared_for_every_polygon() -> None:
    assert fills.demonstrate_flags() == fills.StaleFlags(300, 400, 1600)


def test_an_outline_leaks_over_eight_neighbours() -> None:
    found = fills.demonstrate_leak()
    assert found.over_four == found.shipped_over_four == 365
    assert found.over_eight > 33 * 33 - 60


# Parity


def test_half_open_parity_is_the_shipped_coverage(rng: np.random.Generator) -> None:
    for _ in range(25):
        points = (rng.integers(-16, 112, (rng.integers(3, 9), 2)) / 4).tolist()
        found = fills.parity_fill(points, (24, 20), crossing="half-open", counts_each=True)
        boxed = fills.parity_fill(points, (24, 20), crossing="half-open", counts_each=True, in_box=True)
        assert np.array_equal(found.inside, coverage(points, (24, 20)))
        assert np.array_equal(found.inside, boxed.inside)
        assert boxed.tested <= found.tested == 480


def test_what_parity_gets_wrong() -> None:
    found = fills.demonstrate_parity()
    assert found == fills.ParityFaults(closed=9, once=161, half_open=0, shipped=0, tested=3072, tested_in_box=2193)


def test_what_parity_refuses() -> None:
    assert not fills.parity_fill([], (3, 3)).inside.any()
    with pytest.raises(InputError, match=r"^points\[1\] = \[nan, 0.0\]: expected finite numbers"):
        fills.parity_fill([(0, 0), (float("nan"), 0), (0, 3)], (3, 3))
    with pytest.raises(InputError, match=r"^unknown crossing 'open'"):
        fills.parity_fill([(0, 0), (3, 0), (0, 3)], (3, 3), crossing="open")
