"""The lectures' edge equations in floating point, the formulas behind them, and each of their faults in numbers."""

from __future__ import annotations

import contextlib
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import pytest

from scanspan.errors import InputError, LimitError
from scanspan.lectures import edge_faults as faults
from scanspan.lectures import half_planes
from scanspan.lectures.compare import shipped_channel, shipped_hits
from scanspan.lectures.edge_equations import SORT, EdgeEqn, FlatTriangle, SmoothTriangle, average_channel, look_up, to_int
from scanspan.lectures.exercise import box_steps, plain_box
from scanspan.lectures.fixed_point import FixedFlatTriangle, FixedSmoothTriangle
from scanspan.lectures.raster import Raster, Vertex, vertices

COLORS = [(255, 40, 0, 255), (10, 200, 90, 128), (3, 60, 250, 7)]


def draw_by_the_loop(points: list[tuple[float, float]], width: int, height: int) -> list[list[int]]:
    """Draw as S0 prints it, one sample after the other."""
    drawn = [[0] * width for _ in range(height)]
    triangle, raster = FlatTriangle(*vertices(points)), Raster(width, height)
    if not triangle.triangle_setup(raster):
        return drawn
    (A0, A1, A2), (B0, B1, B2) = ([e.A for e in triangle.edge], [e.B for e in triangle.edge])
    t0, t1, t2 = (edge.evaluate_at(triangle.x_min, triangle.y_min) for edge in triangle.edge)
    for y in range(triangle.y_min, triangle.y_max + 1):
        e0, e1, e2, been_inside = t0, t1, t2, False
        for x in range(triangle.x_min, triangle.x_max + 1):
            if e0 >= 0 and e1 >= 0 and e2 >= 0:
                drawn[y][x], been_inside = 1, True
            elif been_inside:
                break
            e0, e1, e2 = e0 + A0, e1 + A1, e2 + A2
        t0, t1, t2 = t0 + B0, t1 + B1, t2 + B2
    return drawn


# What the slides get right


def test_a_row_at_once_is_the_loop_bit_for_bit(rng: np.random.Generator) -> None:
    for k in range(40):
        points = [(float(x), float(y)) for x, y in np.round(rng.uniform(-10, 50, (3, 2)), 1 if k % 2 else 12)]
        raster = Raster(40, 36)
        FlatTriangle(*vertices(points)).draw(raster)
        assert raster.hits.tolist() == draw_by_the_loop(points, 40, 36)


def test_whole_coordinates_give_the_shipped_pixels(rng: np.random.Generator) -> None:
    for rule in ("inclusive", "exclusive"):
        for _ in range(40):
            points = rng.integers(-40, 140, (3, 2))
            raster = Raster(100, 80)
            FlatTriangle(*vertices(points), inclusive=rule == "inclusive").draw(raster)
            assert np.array_equal(raster.hits, shipped_hits([points], (100, 80), rule))


def test_direct3d_counts_fifteen_and_ten_pixels() -> None:
    for points, count in (([(0, 0), (5, 0), (5, 5)], 15), ([(0, 5), (0, 0), (5, 5)], 10)):
        assert shipped_hits([points], (8, 8)).sum() == count


def test_edges_pass_through_their_vertices_and_keep_their_flags() -> None:
    edge = EdgeEqn(Vertex(3, 8), Vertex(11, 2))
    assert (edge.A, edge.B, edge.C, edge.flag) == (6, 8, -82, 9)
    assert edge.evaluate_at(3, 8) == edge.evaluate_at(11, 2) == 0
    assert [EdgeEqn(Vertex(0, 0), Vertex(*end)).flag for end in ((4, 0), (0, 4), (-4, 0), (0, -4))] == [9, 1, 8, 9]
    edge.flip()
    assert (edge.A, edge.B, edge.C, edge.flag) == (-6, -8, 82, 9)


def test_the_inside_is_positive_for_both_senses() -> None:
    for points in ([(1, 1), (9, 2), (3, 8)], [(1, 1), (3, 8), (9, 2)]):
        triangle = FlatTriangle(*vertices(points))
        assert triangle.triangle_setup(Raster(10, 10))
        assert min(edge.evaluate_at(4, 3) for edge in triangle.edge) > 0
        assert min(edge.evaluate_at(0, 0) for edge in triangle.edge) < 0


def test_two_sums_and_three_by_six_is_the_rounded_third() -> None:
    for total in range(766):
        first = min(total, 255)
        second = min(total - first, 255)
        average = average_channel(first, second, total - first - second)
        assert average == round(Fraction(total, 3))
        assert abs(average - Fraction(total, 3)) < Fraction(1, 2)


def test_the_sort_table_holds_for_all_orders_of_three() -> None:
    rows = set()
    for xs in product(range(3), repeat=3):
        signs = [b >= a for a, b in pairwise([*xs, xs[0]])]
        code = sum(1 << k for k, sign in enumerate(signs) if sign)
        if len(set(xs)) == 1:
            assert code == 7  # row 6, which the table does not have
            continue
        low, high = SORT[code - 1]
        rows.add(code - 1)
        assert look_up(code + 8 * 1) == ((low, high), SORT[0])
        assert look_up(1 + 8 * code) == (SORT[0], (low, high))
        assert (xs[low], xs[high]) == (min(xs), max(xs))
    assert rows == set(range(6))


def test_the_box_of_the_exercise_is_the_plain_box(rng: np.random.Generator) -> None:
    for points in product(product(range(3), repeat=2), repeat=3):
        if len({x for x, _ in points}) > 1 and len({y for _, y in points}) > 1:
            assert box_steps(points).box == plain_box(points)
    for _ in range(100):
        points = rng.uniform(-50, 50, (3, 2)).tolist()
        assert box_steps(points).box == plain_box(points)
    with pytest.raises(IndexError, match=r"^sort\[6\] for x"):
        box_steps([(1, 0), (1, 4), (1, 9)])


def test_codes_outside_of_the_table_are_refused() -> None:
    assert look_up(1 + 8 * 6) == ((0, 1), (1, 0))
    with pytest.raises(IndexError, match=r"^sort\[-1\] for y: the table has rows 0 to 5$"):
        look_up(1)
    with pytest.raises(IndexError, match=r"^sort\[-1\] for x"):
        FlatTriangle(*vertices([(float("nan"), 0), (4, 0), (0, 4)])).draw(Raster(4, 4))


def test_smooth_colours_are_cut_off_values_of_the_plane() -> None:
    points = [(2.0, 1.0), (50.0, 7.0), (19.0, 44.0)]
    raster = Raster(60, 50)
    SmoothTriangle(*vertices(points, COLORS)).draw(raster)
    exact = shipped_channel(points, COLORS, (60, 50))
    below = exact[raster.covered] - raster.rgba[raster.covered]
    assert below.min() > -1e-9
    assert below.max() < 1 + 1e-9


def test_casts() -> None:
    assert [to_int(x) for x in (1.9, -1.9, 1e30, -1e30, float("nan"))] == [1, -1, 2**31 - 1, -(2**31), 0]
    with pytest.raises(InputError, match=r"^a raster of 0 x 5: expected at least one pixel each way$"):
        Raster(0, 5)
    with pytest.raises(LimitError, match=r"^a raster of 5000 x 5000: the limit is 16777216 pixels in all$"):
        Raster(5000, 5000)


def test_infinite_corners_draw_nothing_and_warn_of_nothing() -> None:
    for kind in (FlatTriangle, SmoothTriangle, FixedFlatTriangle, FixedSmoothTriangle):
        raster = Raster(6, 6)
        with contextlib.suppress(IndexError):  # as the programs themselves may end
            kind(*vertices([(float("inf"), 0), (4, float("-inf")), (0, 4)], COLORS)).draw(raster)
        assert kind in (FixedFlatTriangle, FixedSmoothTriangle) or raster.hits.sum() == 0


# What they get wrong


def test_shared_edges_are_drawn_twice_or_not_at_all() -> None:
    found = faults.demonstrate_shared_edges()
    assert found == faults.SharedEdges(samples=10591, drawn_twice=1505, gaps=1505, shipped_not_once=0)


def test_half_of_the_triangles_of_no_width_crash() -> None:
    found = faults.demonstrate_index_crash()
    assert found.crashes / found.triangles == pytest.approx(0.49, abs=0.02)
    assert found.crashes + found.drawn_as_degenerate == found.triangles
    assert found.shipped_pixels == 0


def test_the_smooth_drawing_method_is_flat() -> None:
    found = faults.demonstrate_smooth_as_printed()
    assert found.as_printed == 1
    assert found.as_meant > 300
    assert found.worst_against_shipped <= 0.5 + 1e-9


def test_without_the_half_white_is_dimmed() -> None:
    found = faults.demonstrate_missing_half()
    assert (found.drawn, found.dimmed, found.dimmed_when_rounded, found.shipped_dimmed) == (1801, 1801, 0, 0)
    assert found.mean_error == pytest.approx(-0.5, abs=0.02)
    assert found.mean_error_when_rounded == pytest.approx(0, abs=0.02)


def test_running_sums_drift() -> None:
    found = faults.demonstrate_drift()
    assert 0 < abs(found.last) < 1e-9
    assert (found.lost_samples, found.lost_samples_evaluated, found.shipped_lost_samples) == (3, 0, 0)


def test_the_scale_is_remembered() -> None:
    found = faults.demonstrate_stale_scale()
    assert found.worst_error > 100
    assert found.worst_error_if_made_anew <= 0.5


def test_alpha_is_dropped_and_fields_are_overwritten() -> None:
    assert faults.demonstrate_dropped_alpha() == faults.DroppedAlpha(float_version=255, fixed_version=10)
    assert faults.demonstrate_in_place() == faults.InPlace(before=3, after=36, width=12)


def test_the_box_has_a_column_too_many_left_of_the_raster() -> None:
    assert faults.demonstrate_box_cast() == faults.Box(as_cast=0, as_floor=-1, drawn=0)
    inside = faults.demonstrate_box_cast(4.25)
    assert inside.as_cast == inside.as_floor
    assert inside.drawn > 0


def test_rows_are_left_early() -> None:
    found = faults.demonstrate_early_out()
    assert found.different_pixels == 0
    assert found.tested_early < 0.6 * found.tested_all == 0.6 * 201 * 151


def test_area_is_twice_the_area() -> None:
    found = faults.demonstrate_area()
    assert found.variable == 2 * found.exact
    assert found.plane_exact


@pytest.mark.parametrize(("size", "error"), [(1.0, 1.6e-4), (0.01, 1.5e-2)])
def test_the_sum_of_c_is_imprecise(size: float, error: float) -> None:
    found = faults.demonstrate_area_precision(size)
    assert found.sum_of_c == pytest.approx(error, rel=0.1)
    assert found.cross_product < 3e-8
    assert (found.wrong_signs > 10) == (size < 0.1)


def test_points_jump() -> None:
    assert faults.vertex_points([0.5, 1.5, 2.5, 3.5]) == [0, 2, 2, 4]


# Formulas


def test_the_forms_of_an_edge() -> None:
    assert half_planes.multiplied_form(0.5, 0.5, (0.0, 0.0), (1.0, 0.0)) == -0.5
    flip = half_planes.demonstrate_sign_flip()
    assert flip.slope[0] == flip.slope[1]
    assert flip.multiplied[0] == -flip.multiplied[1]
    assert half_planes.slope_form(2.0, 5.0, (1.0, 0.0), (1.0, 9.0)) == float("inf")
    assert half_planes.multiplied_form(2.0, 5.0, (1.0, 0.0), (1.0, 9.0)) == 9.0


def test_the_flipped_form_is_positive_inside_counter_clockwise_triangles() -> None:
    corners = [(Fraction(1), Fraction(1)), (Fraction(9), Fraction(2)), (Fraction(3), Fraction(8))]
    middle = Fraction(13, 3), Fraction(11, 3)
    assert half_planes.twice_area(*corners) > 0
    for a, b in pairwise([*corners, corners[0]]):
        A, B, C = half_planes.coefficients(a, b)
        assert half_planes.flipped_form(*middle, a, b) == A * middle[0] + B * middle[1] + C > 0
        assert A * a[0] + B * a[1] + C == A * b[0] + B * b[1] + C == 0


def test_c_may_be_chosen_and_the_choice_needs_no_division() -> None:
    start, end = (Fraction(2), Fraction(3)), (Fraction(7), Fraction(5))
    chosen = half_planes.coefficients(start, end)
    assert half_planes.solved_coefficients(start, end, chosen[2]) == chosen
    other = half_planes.solved_coefficients(start, end, Fraction(1))
    assert [value / other[2] for value in other] == [value / chosen[2] for value in chosen]
    with pytest.raises(InputError, match=r"runs through the origin and has no inverse$"):
        half_planes.solved_coefficients(start, (Fraction(4), Fraction(6)), Fraction(1))
    assert half_planes.coefficients(start, (Fraction(4), Fraction(6))) == (-3, 2, 0)


def test_three_lines_are_a_triangle() -> None:
    corners = [(Fraction(1), Fraction(1)), (Fraction(9), Fraction(2)), (Fraction(3), Fraction(8))]
    lines = [half_planes.coefficients(a, b) for a, b in pairwise([*corners, corners[0]])]
    scaled = [(7 * a, 7 * b, 7 * c) for a, b, c in lines]
    assert [half_planes.vertex_of(scaled[k - 1], lines[k]) for k in range(3)] == corners
    with pytest.raises(InputError, match=r"they have no point in common, or all$"):
        half_planes.vertex_of(lines[0], scaled[0])


def test_the_signed_parts_add_up_wherever_the_origin_is() -> None:
    for shift in range(-5, 6):
        corners = [(Fraction(x + shift), Fraction(y - shift)) for x, y in ((1, 1), (9, 2), (3, 8))]
        found = half_planes.sub_triangles(*corners)
        assert sum(found.twice_areas) == found.total == half_planes.twice_area(*corners) == 54
    assert faults.positive_c(Vertex(2, 1), Vertex(1, 2))


def test_an_n_sided_fan_has_a_corner_too_many() -> None:
    for n in range(3, 9):
        triangles = half_planes.fan(n)
        assert len(triangles) == n - 1  # an n-sided polygon has n - 2
        assert len({corner for triangle in triangles for corner in triangle}) == n + 1

        # They are those of a polygon with n + 1 sides: all run as it does, and their areas add up to its own.
        ring = [(Fraction(x), Fraction(x * x)) for x in range(n + 1)]
        areas = [half_planes.twice_area(*(ring[k] for k in triangle)) for triangle in triangles]
        assert min(areas) > 0
        assert sum(areas) == sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise([*ring, ring[0]]))
