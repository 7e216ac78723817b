"""Edge walking, values inside a triangle, and the rules for samples on edges: the lectures' ways against the library's."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import ceil, gcd

import numpy as np
import pytest

from scanspan.errors import InputError
from scanspan.lectures import interpolation, ownership, walking
from scanspan.lectures.compare import shipped_hits, shuffled_mesh

Points = list[list[float]]


def random_triangles(rng: np.random.Generator, count: int) -> list[Points]:
    """Return triangles with an area, half on whole coordinates and half on quarters."""
    found: list[Points] = []
    while len(found) < count:
        grid = 4 if len(found) % 2 else 1
        p = rng.integers(0, 22 * grid, (3, 2)) / grid
        (u, v), (s, t) = p[1:] - p[0]
        if u * t != v * s:
            found.append(p.tolist())
    return found


# Edge walking


@pytest.mark.parametrize(("ends", "rule"), [("ceiling-floor", "inclusive"), ("ceiling-ceiling", "top-left")])
def test_walking_draws_the_shipped_pixels(ends: str, rule: str, rng: np.random.Generator) -> None:
    for points in random_triangles(rng, 150):
        drawn = walking.walked_hits([points], (24, 24), ends)
        assert np.array_equal(drawn, shipped_hits([points], (24, 24), rule))


def test_a_scan_line_has_one_span_of_a_triangle(rng: np.random.Generator) -> None:
    for points in random_triangles(rng, 30):
        hits = shipped_hits([points], (24, 24))
        for row in hits:
            assert (np.diff(np.pad(row, 1)) != 0).sum() in (0, 2)

        # Walking gives that span, in rows one after the other.
        spans = walking.walk(points, [0, 0, 0], ends="ceiling-ceiling").spans
        assert [span.y for span in spans] == list(range(spans[0].y, spans[0].y + len(spans))) if spans else not hits.any()
        lengths = {span.y: max(ceil(span.x_right) - ceil(span.x_left), 0) for span in spans}
        assert [lengths.get(y, 0) for y in range(24)] == hits.sum(axis=1).tolist()


@pytest.mark.parametrize(
    ("points", "place"),
    [
        ([(0, 0), (9, 4), (2, 9)], "right"),
        ([(9, 0), (0, 4), (7, 9)], "left"),
        ([(0, 0), (9, 0), (2, 9)], "none"),
        ([(4, 0), (9, 9), (2, 9)], "none"),
    ],
)
def test_where_the_breakpoint_is(points: Points, place: str) -> None:
    for turned in range(3):
        assert walking.walk(points[turned:] + points[:turned], [0, 0, 0]).breakpoint == place


def test_a_level_line_has_no_spans() -> None:
    assert walking.walk([(0, 3), (5, 3), (9, 3)], [0, 0, 0]) == walking.Walk("none", [])


def test_both_ends_included_is_drawn_twice() -> None:
    found = walking.demonstrate_both_ends()
    assert found == walking.BothEnds(drawn_twice=13, drawn_twice_half_open=0, different_from_shipped=0)


def test_values_without_the_fractional_offset_are_off() -> None:
    found = walking.demonstrate_offsets()
    assert found.without_offset > 1
    assert found.with_offset == 0
    assert found.shipped < 1e-9


def test_what_walking_refuses() -> None:
    with pytest.raises(InputError, match=r"^points = .*: expected numbers of shape \(3, 2\), not shape \(2, 2\)$"):
        walking.walk([(0, 0), (1, 1)], [0, 0, 0])
    with pytest.raises(InputError, match=r"^values"):
        walking.walk([(0, 0), (1, 1), (0, 1)], [0, float("nan"), 0])
    with pytest.raises(InputError, match=r"^unknown ends 'floor'"):
        walking.walk([(0, 0), (1, 1), (0, 1)], [0, 0, 0], ends="floor")


# Values


def test_three_ways_to_a_value_agree_exactly(rng: np.random.Generator) -> None:
    values = [Fraction(5), Fraction(-3), Fraction(11, 7)]
    for points in random_triangles(rng, 40):
        corners = interpolation.exact(points)
        flat = interpolation.plane(corners, values)
        weights = (Fraction(1, 7), Fraction(2, 7), Fraction(4, 7))
        x, y = (sum((w * c[k] for w, c in zip(weights, corners, strict=True)), Fraction(0)) for k in range(2))
        expected = sum(w * v for w, v in zip(weights, values, strict=True))
        assert interpolation.weights_from_areas(*corners, x, y) == weights
        assert flat.at(x, y) == interpolation.bilinear(corners, values, x, y) == expected
        assert [flat.at(*corner) for corner in corners] == values


def test_weights_from_the_scan_line_are_the_areas() -> None:
    p1, p2, p3 = interpolation.exact([(9, 8), (4, 1), (0, 7)])
    for x, y in ((Fraction(4), Fraction(5)), (Fraction(5, 2), Fraction(6)), (Fraction(20), Fraction(13, 2))):
        found = interpolation.weights_from_scan_line(p1, p2, p3, x, y)
        assert found == interpolation.weights_from_areas(p1, p2, p3, x, y)
        assert sum(found) == 1
        inside = all(0 <= weight <= 1 for weight in found)
        assert inside == (x < 20)
        assert (sum(interpolation.weights_from_areas(p1, p2, p3, x, y, signed=False)) == 1) == inside


def test_the_bilinear_way_turns_with_a_square_and_not_with_a_triangle() -> None:
    found = interpolation.demonstrate_turned_square()
    assert len(set(found.square)) == 4
    assert set(found.triangle) == {Fraction(1, 3)}


def test_what_interpolation_refuses() -> None:
    line = interpolation.exact([(0, 0), (1, 1), (2, 2)])
    values = [Fraction(0)] * 3
    with pytest.raises(InputError, match=r"expected a triangle with an area$"):
        interpolation.plane(line, values)
    with pytest.raises(InputError, match=r"^y = 7.0: the scan line meets 0 edges, expected 2$"):
        interpolation.bilinear(line, values, Fraction(1), Fraction(7))


# Rules


def test_what_each_rule_makes_of_a_mesh() -> None:
    found = ownership.demonstrate_rules()
    gaps_and_doubles = {rule: (counted.gaps, counted.doubles) for rule, counted in found.items()}
    assert gaps_and_doubles == {
        "draw": (0, 1505),
        "do not draw": (1505, 0),
        "any left or top": (0, 266),
        "no right or bottom": (0, 0),
        "same side": (9, 0),
        "shadow": (0, 0),
        "same side, a point on no line": (0, 0),
        "shipped top-left": (0, 0),
        "shipped bottom-left": (0, 0),
    }


@pytest.mark.parametrize(
    ("rule", "shipped"), [("draw", "inclusive"), ("do not draw", "exclusive"), ("no right or bottom", "top-left")]
)
def test_the_rules_that_work_are_the_shipped_ones(rule: str, shipped: str) -> None:
    for seed in range(3):
        mesh = shuffled_mesh(seed, 6, 5, 6)
        for triangles in (mesh, mesh[:, ::-1], mesh[::3]):
            assert np.array_equal(ownership.rule_hits(triangles, (37, 31), rule), shipped_hits(triangles, (37, 31), shipped))


def test_the_point_minus_one_drops_samples_of_edges_whose_lines_it_is_on() -> None:
    square = np.array([[(0, 0), (4, 0), (4, 4)], [(0, 0), (4, 4), (0, 4)]])
    hits = ownership.rule_hits(square, (6, 6), "same side")
    assert [hits[k, k] for k in range(1, 4)] == [0, 0, 0]
    moved = ownership.rule_hits(square, (6, 6), "same side", point=(-1, -2))
    assert [moved[k, k] for k in range(1, 4)] == [1, 1, 1]

    # On a mesh it drops what lies within an edge whose line goes through it, and maybe the ends of such an edge.
    within, at_all = set(), set()
    for triangle in shuffled_mesh(1, 20, 15, 6).astype(int).tolist():
        for (a_x, a_y), (b_x, b_y) in pairwise([*triangle, triangle[0]]):
            if (b_x - a_x) * (-1 - a_y) == (b_y - a_y) * (-1 - a_x):
                steps = gcd(b_x - a_x, b_y - a_y)
                line = [(a_x + k * (b_x - a_x) // steps, a_y + k * (b_y - a_y) // steps) for k in range(steps + 1)]
                at_all.update((x, y) for x, y in line if 0 < x < 120 and 0 < y < 90)
                within.update(set(line[1:-1]) & at_all)
    found = ownership.demonstrate_rules()
    assert len(within) <= 9 <= len(at_all)
    assert found["same side"] == (119 * 89, 9, 0)
    assert found["same side, a point on no line"] == (119 * 89, 0, 0)


def test_the_shadow_rule_is_the_top_left_rule_upside_down() -> None:
    found = ownership.demonstrate_mirror()
    assert found.different > 0
    assert found.after_mirroring == 0


def test_what_rules_refuse() -> None:
    with pytest.raises(InputError, match=r"^triangles: expected whole coordinates within 16777216 pixels$"):
        ownership.rule_hits(np.array([[(0, 0), (4.5, 0), (4, 4)]]), (6, 6), "draw")
    with pytest.raises(InputError, match=r"^unknown rule 'shadows'; did you mean 'shadow'\?"):
        ownership.rule_hits(np.zeros((0, 3, 2)), (4, 4), "shadows")
