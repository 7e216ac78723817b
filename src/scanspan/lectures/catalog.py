"""The table of contents: which item of the lectures lives in which function, and which test holds it.

Items have the numbers under which the lectures were taken apart; slips, the lectures' mistakes, are numbered by themselves. An
entry tells where on the slides the thing is, so that a student finds the one from the other. `docs/lectures.md` and the command
line read this list.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from scanspan.errors import InputError
from scanspan.lectures import (
    brightness,
    decomposition,
    edge_equations,
    edge_faults,
    exercise,
    fills,
    fixed_point,
    fixed_point_faults,
    half_planes,
    hidden_surfaces,
    interpolation,
    lines,
    ownership,
    projective,
    raster,
    walking,
)


class Entry(NamedTuple):
    """One item of the lectures, or one slip, and where it lives."""

    number: int
    title: str
    lecture: str  # "S0" to "S4"; several with spaces between
    lines: str  # of the slides, for each lecture
    function: Callable[..., Any]
    test: str  # file::name
    suffix: str = ""  # "b" for 123b

    @property
    def key(self) -> str:
        """The number as text, with its suffix."""
        return f"{self.number}{self.suffix}"

    @property
    def home(self) -> str:
        """The function by its dotted name."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def is_demonstration(self) -> bool:
        """Whether the function runs without arguments and returns numbers."""
        return self.function.__name__.startswith("demonstrate_")


EDGES, FIXED = "tests/test_lecture_edges.py::", "tests/test_lecture_fixed_point.py::"
WALKING, LINES = "tests/test_lecture_walking.py::", "tests/test_lecture_lines_and_fills.py::"
SURFACES, SHIPPED_TESTS = "tests/test_lecture_hidden_surfaces.py::", "tests/test_lecture_shipped.py::"

# fmt: off
PORTS: tuple[Entry, ...] = (
    # Triangles and walking.
    Entry(7, "three points or three lines", "S0 S4", "27-45; 47-64", half_planes.vertex_of,
          EDGES + "test_three_lines_are_a_triangle"),
    Entry(8, "convex: one span a scan line", "S0 S4", "46-52; 66-76", walking.walk,
          WALKING + "test_a_scan_line_has_one_span_of_a_triangle"),
    Entry(10, "fan of a convex polygon", "S0 S4", "66-68; 93-97", half_planes.fan,
          EDGES + "test_an_n_sided_fan_has_a_corner_too_many"),
    Entry(14, "edge walking", "S0 S4", "82-94; 114-131", walking.walk,
          WALKING + "test_walking_draws_the_shipped_pixels"),
    Entry(16, "fractional offsets", "S4", "133-139", walking.demonstrate_offsets,
          WALKING + "test_values_without_the_fractional_offset_are_off"),
    # Edge equations.
    Entry(19, "a discriminating function", "S0 S4", "98-103; 141-149", edge_equations.EdgeEqn,
          EDGES + "test_the_inside_is_positive_for_both_senses"),
    Entry(20, "the recipe", "S0 S4", "107-113; 151-157", edge_equations.FlatTriangle,
          EDGES + "test_whole_coordinates_give_the_shipped_pixels"),
    Entry(21, "slope form", "S1", "3-15", half_planes.slope_form,
          EDGES + "test_the_forms_of_an_edge"),
    Entry(22, "multiplied form", "S1", "17-28", half_planes.multiplied_form,
          EDGES + "test_the_forms_of_an_edge"),
    Entry(23, "the sign", "S1", "32-60", half_planes.flipped_form,
          EDGES + "test_the_flipped_form_is_positive_inside_counter_clockwise_triangles"),
    Entry(24, "coefficients, and why C may be chosen", "S0 S4", "152-170; 193-211", half_planes.solved_coefficients,
          EDGES + "test_c_may_be_chosen_and_the_choice_needs_no_division"),
    Entry(28, "EdgeEqn in double", "S0", "193-224", edge_equations.EdgeEqn,
          EDGES + "test_edges_pass_through_their_vertices_and_keep_their_flags"),
    Entry(29, "EdgeEqn in 12 bits", "S4", "191; 272-304", fixed_point.FixedEdgeEqn,
          FIXED + "test_every_pixel_is_the_java_programs"),
    Entry(30, "vertices and points", "S0 S4", "119-149; 161-189", raster.Vertex.draw,
          EDGES + "test_points_jump"),
    Entry(31, "the average colour", "S0 S4", "253-255; 328-339", edge_equations.average_channel,
          EDGES + "test_two_sums_and_three_by_six_is_the_rounded_third"),
    Entry(32, "the sort table", "S4", "317", edge_equations.look_up,
          EDGES + "test_the_sort_table_holds_for_all_orders_of_three"),
    Entry(33, "the bounding box", "S0 S4", "327-342; 435-449", edge_faults.demonstrate_box_cast,
          EDGES + "test_the_box_has_a_column_too_many_left_of_the_raster"),
    Entry(34, "the area as a sum of C", "S0 S4", "320-325; 424-433", edge_faults.demonstrate_area_precision,
          EDGES + "test_the_sum_of_c_is_imprecise"),
    Entry(34, "small triangles in 12 bits", "S4", "424-433", fixed_point_faults.demonstrate_small_triangles,
          FIXED + "test_small_triangles_are_turned_and_lost"),
    Entry(35, "the crash on triangles of no width", "S0 S4", "327-329; 436-438", edge_faults.demonstrate_index_crash,
          EDGES + "test_half_of_the_triangles_of_no_width_crash"),
    Entry(35, "the crash on slivers that have a width", "S4", "436-438", fixed_point_faults.demonstrate_sliver_crash,
          FIXED + "test_slivers_with_a_width_crash_as_well"),
    Entry(36, "the drawing loop", "S0 S4", "261-287; 345-386", edge_equations.FlatTriangle.rows,
          EDGES + "test_a_row_at_once_is_the_loop_bit_for_bit"),
    Entry(36, "sums that drift", "S0", "283-285", edge_faults.demonstrate_drift,
          EDGES + "test_running_sums_drift"),
    Entry(37, "two speed hacks", "S0 S4", "292-309; 391-409", edge_faults.demonstrate_early_out,
          EDGES + "test_rows_are_left_early"),
    Entry(37, "one test of three signs", "S4", "391-395", fixed_point.FixedFlatTriangle.rows,
          FIXED + "test_the_speed_hack_changes_work_and_not_pixels"),
    Entry(38, "edges included", "S0 S4", "278; 373", edge_faults.demonstrate_shared_edges,
          EDGES + "test_shared_edges_are_drawn_twice_or_not_at_all"),
    Entry(39, "the area as a determinant, and a positive C", "S0 S4", "347-354; 459-467", edge_faults.positive_c,
          EDGES + "test_the_signed_parts_add_up_wherever_the_origin_is"),
    Entry(40, "why a positive area means a positive inside", "S0 S4", "356-363; 469-479", half_planes.sub_triangles,
          EDGES + "test_the_signed_parts_add_up_wherever_the_origin_is"),
    Entry(41, "exercise 2, answered", "S4", "481-493", exercise.box_steps,
          EDGES + "test_the_box_of_the_exercise_is_the_plain_box"),
    # Which pixels.
    Entry(43, "pixels inside the edges", "S1 S2", "98-104; 381-384", ownership.rule_hits,
          WALKING + "test_the_rules_that_work_are_the_shipped_ones"),
    Entry(44, "left or top", "S1 S2", "106-113; 385-389", ownership.demonstrate_rules,
          WALKING + "test_what_each_rule_makes_of_a_mesh"),
    Entry(45, "the same side as a point off the screen", "S2", "390", ownership.owns,
          WALKING + "test_the_point_minus_one_drops_samples_of_edges_whose_lines_it_is_on"),
    Entry(46, "the shadow rule", "S3", "325-334", ownership.demonstrate_mirror,
          WALKING + "test_the_shadow_rule_is_the_top_left_rule_upside_down"),
    Entry(47, "each sample has one owner", "S3", "313-323", ownership.demonstrate_rules,
          WALKING + "test_what_each_rule_makes_of_a_mesh"),
    # Values.
    Entry(52, "three ways to a value", "S1 S2", "135-138; 402-404", interpolation.plane,
          WALKING + "test_three_ways_to_a_value_agree_exactly"),
    Entry(53, "bilinear", "S2", "406-409", interpolation.demonstrate_turned_square,
          WALKING + "test_the_bilinear_way_turns_with_a_square_and_not_with_a_triangle"),
    Entry(54, "barycentric weights", "S2", "413-451", interpolation.weights_from_areas,
          WALKING + "test_three_ways_to_a_value_agree_exactly"),
    Entry(55, "weights from the bilinear way", "S2", "454-502", interpolation.weights_from_scan_line,
          WALKING + "test_weights_from_the_scan_line_are_the_areas"),
    Entry(56, "weights from areas", "S2", "504-518", interpolation.weights_from_areas,
          WALKING + "test_weights_from_the_scan_line_are_the_areas"),
    Entry(57, "a plane from edge coefficients", "S0 S4", "398-429; 501-527", interpolation.plane,
          WALKING + "test_three_ways_to_a_value_agree_exactly"),
    Entry(58, "PlaneEqn in double", "S0", "470-488", edge_equations.SmoothTriangle.plane_eqn,
          EDGES + "test_smooth_colours_are_cut_off_values_of_the_plane"),
    Entry(59, "PlaneEqn in 12 bits", "S4", "573-588", fixed_point.FixedSmoothTriangle.plane_eqn,
          FIXED + "test_every_pixel_is_the_java_programs"),
    Entry(60, "SmoothTri, flat or not, and its scale", "S0 S4", "431-468; 529-569", edge_faults.demonstrate_stale_scale,
          EDGES + "test_the_scale_is_remembered"),
    Entry(61, "the inner loop, and clamping", "S4", "591-682", fixed_point.clamp_channel,
          FIXED + "test_every_pixel_is_the_java_programs"),
    # Lines and fills.
    Entry(63, "DDA", "S2", "103-131", lines.dda,
          LINES + "test_one_pixel_a_column_and_at_most_half_a_pixel_off"),
    Entry(63, "a rounded slope, added again and again", "S2", "129", lines.demonstrate_dda_drift,
          LINES + "test_the_dda_drifts_and_the_shipped_one_does_not"),
    Entry(63, "the other octants", "S2", "112-114", lines.demonstrate_other_octants,
          LINES + "test_the_other_octants"),
    Entry(64, "midpoint", "S2", "135-148", lines.f,
          LINES + "test_d_is_f_at_the_next_midpoint"),
    Entry(65, "reuse of the last step", "S2", "152-197", lines.demonstrate_previous_step,
          LINES + "test_what_the_previous_step_has_evaluated"),
    Entry(66, "whole numbers only", "S2", "199-234", lines.midpoint_integer,
          LINES + "test_one_pixel_a_column_and_at_most_half_a_pixel_off"),
    Entry(66, "the long form of the start", "S2", "221-223", lines.demonstrate_long_form,
          LINES + "test_the_long_form_leaves_32_bits"),
    Entry(67, "ties", "S2", "128; 209", lines.demonstrate_ties,
          LINES + "test_ties_of_the_819_segments"),
    Entry(68, "filling a polygon: the shape that a flood makes", "S2", "266-275", fills.demonstrate_outline,
          LINES + "test_the_outline_belongs_to_the_flooded_shape"),
    Entry(69, "flood fill", "S2", "279-316", fills.flood_fill,
          LINES + "test_a_flood_is_the_component_and_takes_4_n_plus_1_calls"),
    Entry(69, "four and eight neighbours", "S2", "308-314", fills.demonstrate_leak,
          LINES + "test_an_outline_leaks_over_eight_neighbours"),
    Entry(70, "its drawbacks", "S2", "320-324", fills.demonstrate_recursion,
          LINES + "test_recursion_is_as_deep_as_there_are_pixels"),
    Entry(70, "flags to be cleared", "S2", "323-324", fills.demonstrate_flags,
          LINES + "test_flags_must_be_cleared_for_every_polygon"),
    Entry(71, "scan lines", "S2", "328-331", hidden_surfaces.spans_of,
          SURFACES + "test_the_canonical_rule_shows_what_rasterize_shows"),
    Entry(72, "parity test", "S2", "335-359", fills.parity_fill,
          LINES + "test_half_open_parity_is_the_shipped_coverage"),
    Entry(72, "what counts as crossing", "S2", "351-353", fills.demonstrate_parity,
          LINES + "test_what_parity_gets_wrong"),
    Entry(73, "only the box", "S2", "365-368", fills.box_of,
          LINES + "test_half_open_parity_is_the_shipped_coverage"),
    # Hidden surfaces.
    Entry(80, "no or two edges of a convex polygon", "S3", "117-121", hidden_surfaces.demonstrate_buckets,
          SURFACES + "test_three_edges_where_two_are_promised"),
    Entry(82, "the edge table", "S3", "128-150", hidden_surfaces.edge_table,
          SURFACES + "test_the_canonical_rule_shows_what_rasterize_shows"),
    Entry(84, "events in buckets", "S3", "152-166", hidden_surfaces.demonstrate_buckets,
          SURFACES + "test_buckets_round_down_and_ends_round_up"),
    Entry(85, "the active edge list, empty at the end", "S3", "168-178", hidden_surfaces.demonstrate_left_over,
          SURFACES + "test_the_list_is_empty_only_if_the_sweep_goes_on"),
    Entry(86, "edges that cross", "S3", "180-196", hidden_surfaces.insertion_sort,
          SURFACES + "test_swaps_are_the_edges_that_cross"),
    Entry(87, "spans by in and out", "S3", "198-206", hidden_surfaces.spans_of,
          SURFACES + "test_the_canonical_rule_shows_what_rasterize_shows"),
    Entry(88, "visibility by evaluating spans", "S3", "208-210", hidden_surfaces.show_evaluated,
          SURFACES + "test_all_three_ways_agree_on_polygons_that_do_not_cross"),
    Entry(89, "visibility by a buffer of one row", "S3", "212", hidden_surfaces.show_buffered,
          SURFACES + "test_all_three_ways_agree_on_polygons_that_do_not_cross"),
    Entry(90, "visibility by active spans", "S3", "214; 240-264", hidden_surfaces.demonstrate_identity,
          SURFACES + "test_a_kept_identity_misses_crossings"),
    Entry(91, "the colour of the visible span", "S3", "216-218", hidden_surfaces.Span.at,
          SURFACES + "test_colours_are_those_of_the_plane"),
    Entry(92, "maintenance", "S3", "220-234", hidden_surfaces.sweep_up,
          SURFACES + "test_buckets_round_down_and_ends_round_up"),
    Entry(93, "without a row to store", "S3", "236-258", hidden_surfaces.show_listed,
          SURFACES + "test_all_three_ways_agree_on_polygons_that_do_not_cross"),
    Entry(94, "the algorithm in whole", "S3", "266-280", hidden_surfaces.sweep_up,
          SURFACES + "test_the_canonical_rule_shows_what_rasterize_shows"),
    Entry(95, "four subtleties, answered", "S3", "282-297", hidden_surfaces.edge_table,
          SURFACES + "test_the_canonical_rule_shows_what_rasterize_shows"),
    Entry(96, "twice-filled pixels", "S3", "299-311", hidden_surfaces.demonstrate_neighbours,
          SURFACES + "test_neighbours_draw_their_boundary_twice"),
    # The raster.
    Entry(123, "the raster, and bounds multiplied in place", "S0 S4", "273, 370-393; 363-364", edge_faults.demonstrate_in_place,
          EDGES + "test_alpha_is_dropped_and_fields_are_overwritten", "b"),
    Entry(123, "packed colours", "S4", "161-189", raster.pack_argb,
          FIXED + "test_the_casts_and_sums_of_java", "b"),
)

SLIPS: tuple[Entry, ...] = (
    Entry(1, "the smooth drawing method interpolates nothing", "S0", "492-519", edge_faults.demonstrate_smooth_as_printed,
          EDGES + "test_the_smooth_drawing_method_is_flat"),
    Entry(2, "statements behind the end of the set-up", "S0", "335-342", edge_equations.FlatTriangle.triangle_setup,
          EDGES + "test_a_row_at_once_is_the_loop_bit_for_bit"),
    Entry(3, "one field spelled two ways", "S4", "168; 329-332", fixed_point.FixedFlatTriangle,
          FIXED + "test_every_pixel_is_the_java_programs"),
    Entry(4, "a scale that is never forgotten", "S0 S4", "455-459; 558-562", edge_faults.demonstrate_stale_scale,
          EDGES + "test_the_scale_is_remembered"),
    Entry(5, "xflag and beenInside, one and the same", "S0 S4", "297-309; 396-409", edge_faults.demonstrate_early_out,
          EDGES + "test_rows_are_left_early"),
    Entry(6, "positive in the text, not negative in the code", "S0 S4", "113; 278", edge_faults.demonstrate_shared_edges,
          EDGES + "test_shared_edges_are_drawn_twice_or_not_at_all"),
    Entry(7, "n sides and n + 1 corners", "S0 S4", "68; 97", half_planes.fan,
          EDGES + "test_an_n_sided_fan_has_a_corner_too_many"),
    Entry(8, "both ends of a span included", "S4", "137", walking.demonstrate_both_ends,
          WALKING + "test_both_ends_included_is_drawn_twice"),
    Entry(9, "index 6", "S4", "436-443", fixed_point_faults.demonstrate_index_crash,
          FIXED + "test_triangles_of_no_width_crash"),
    Entry(10, "A, B and C cut off one by one", "S4", "285-287", fixed_point_faults.demonstrate_missed_vertices,
          FIXED + "test_lines_miss_their_own_vertices"),
    Entry(10, "a constant channel that is not constant", "S4", "582-587", fixed_point_faults.demonstrate_constant_channel,
          FIXED + "test_a_constant_channel_is_not_constant"),
    Entry(11, "C is held beyond 724 pixels", "S4", "287", fixed_point_faults.demonstrate_overflow,
          FIXED + "test_c_is_held_from_724_pixels_on"),
    Entry(11, "the sum of C wraps beyond 362 pixels", "S4", "424", fixed_point_faults.demonstrate_area_wrap,
          FIXED + "test_the_sum_of_c_wraps_around_from_362_pixels_on"),
    Entry(11, "gradients of far slivers are held", "S4", "582-584", fixed_point_faults.demonstrate_gradient,
          FIXED + "test_thin_slivers_far_away_hold_their_gradient"),
    Entry(12, "area is twice the area", "S0 S4", "320; 424", edge_faults.demonstrate_area,
          EDGES + "test_area_is_twice_the_area"),
    Entry(13, "edges in the order 2, 3, 1", "S0 S4", "426; 525", interpolation.plane,
          WALKING + "test_three_ways_to_a_value_agree_exactly"),
    Entry(14, "what the step before has evaluated", "S2", "155", lines.demonstrate_previous_step,
          LINES + "test_what_the_previous_step_has_evaluated"),
    Entry(14, "2d is no assignment", "S2", "221-226", lines.demonstrate_literal_doubling,
          LINES + "test_two_d_is_no_assignment"),
    Entry(14, "ties differ from Round", "S2", "128; 209", lines.demonstrate_ties,
          LINES + "test_ties_of_the_819_segments"),
    Entry(15, "three names for one mean, and .999", "S2", "58-61", brightness.demonstrate_averages,
          SHIPPED_TESTS + "test_white_is_a_little_grey_and_v_is_no_mean"),
    Entry(16, "buckets round down, ends round up", "S3", "164; 226", hidden_surfaces.demonstrate_buckets,
          SURFACES + "test_buckets_round_down_and_ends_round_up"),
    Entry(17, "the shadow rule is top-left upside down", "S3", "325-330", ownership.demonstrate_mirror,
          WALKING + "test_the_shadow_rule_is_the_top_left_rule_upside_down"),
    Entry(18, "an exception that is none", "S3", "415-416", projective.demonstrate_excluded_point,
          SHIPPED_TESTS + "test_no_triple_without_w_has_an_image"),
    Entry(19, "two forms with two signs", "S1", "7; 54-60", half_planes.demonstrate_sign_flip,
          EDGES + "test_the_forms_of_an_edge"),
    Entry(20, "usually, always, all", "S0 S4 S2", "69; 99; 243", decomposition.demonstrate_decomposition,
          SHIPPED_TESTS + "test_every_simple_polygon_is_cut_along_diagonals"),
    Entry(21, "a point off the screen and on an edge's line", "S2", "390", ownership.demonstrate_rules,
          WALKING + "test_the_point_minus_one_drops_samples_of_edges_whose_lines_it_is_on"),
    Entry(22, "points rounded half to even", "S0", "143", edge_faults.vertex_points,
          EDGES + "test_points_jump"),
    Entry(23, "no half in PlaneEqn", "S0", "480-485", edge_faults.demonstrate_missing_half,
          EDGES + "test_without_the_half_white_is_dimmed"),
    Entry(24, "alpha is dropped", "S0", "253-256", edge_faults.demonstrate_dropped_alpha,
          EDGES + "test_alpha_is_dropped_and_fields_are_overwritten"),
    Entry(25, "boxes cut off towards zero", "S0 S4", "331; 440", edge_faults.demonstrate_box_cast,
          EDGES + "test_the_box_has_a_column_too_many_left_of_the_raster"),
)
# fmt: on


def find(number: int, *, is_slip: bool = False) -> list[Entry]:
    """Return the entries of an item, or of a slip.

    Parameters
    ----------
    number : of the item.
    is_slip : whether slips are meant.

    Raises
    ------
    InputError : for a number that has no entry here.

    Examples
    --------
    >>> [entry.home for entry in find(69)]
    ['scanspan.lectures.fills.flood_fill', 'scanspan.lectures.fills.demonstrate_leak']
    """
    table = SLIPS if is_slip else PORTS
    found = [entry for entry in table if entry.number == number]
    if not found:
        numbers = ", ".join(str(k) for k in sorted({entry.number for entry in table}))
        raise InputError(f"number = {number!r}: no program of the lectures has it; those with one: {numbers}")
    return found
