"""Items of the lectures that are not ported, because they are the library itself: where each lives, and which test holds it.

`SHIPPED` goes on with the numbers of `PORTS` (catalog.py); an item may be in both. `BUDGET` has the limits of 12-bit fixed
point, `SOUND` what looks like a slip on the slides and is none, and `AWAITED` the items that nothing here does yet, with the
reason.
"""

from __future__ import annotations

from typing import NamedTuple

from scanspan import color, homogeneous, pipeline, tessellation
from scanspan.assets import drawing, faces, load
from scanspan.assets.inventor.report import report_of
from scanspan.geometry import clip, polygon_triangles
from scanspan.geometry import fixed_point as shipped_fixed_point
from scanspan.lectures import (
    brightness,
    decomposition,
    edge_equations,
    fixed_point,
    fixed_point_faults,
    interpolation,
    ivscan,
    lines,
    projective,
    sampling,
    splats,
)
from scanspan.lectures.catalog import EDGES, FIXED, LINES, SHIPPED_TESTS, WALKING, Entry
from scanspan.lectures.experiments import colors, precision, projection, scenes, shapes, slivers
from scanspan.raster import (
    active_edges,
    algorithms,
    aperture,
    area,
    edge,
    edge_walk,
    homogeneous_edges,
    micropolygon,
    order,
    polygon,
    segment,
    span_list,
    warnock,
    write,
)
from scanspan.target import gouraud, sink

PROJECTIVE, MODELS = "tests/test_lecture_projective.py::", "tests/test_color_models.py::"
ALGORITHMS, TESSELLATION = "tests/test_algorithms.py::", "tests/test_tessellation.py::"
EXPERIMENTS, SPLATS = "tests/test_lecture_experiments.py::", "tests/test_lecture_splats.py::"

# fmt: off
SHIPPED: tuple[Entry, ...] = (
    # What drawing is.
    Entry(1, "samples of exact shapes", "S0", "16", pipeline.rasterize,
          "tests/test_rules.py::test_visible_primitive_and_depth_equal_the_oracle"),
    Entry(2, "thin lines", "S0", "23", segment.walk_pixels,
          "tests/test_segment.py::test_lines_are_thin_whole_and_joined"),
    Entry(3, "area", "S0", "24", area.sweep_areas,
          "tests/test_area.py::test_the_sum_is_the_area"),
    Entry(3, "a wider aperture", "S0", "24", aperture.tent_coverage,
          "tests/test_aperture.py::test_tents_over_tilings_add_up_to_exactly_one"),
    Entry(4, "inside, and on the edge", "S0", "25", edge.edge_bias,
          "tests/test_rules.py::test_named_rules_equal_the_oracle"),
    Entry(4, "three criteria, three pictures", "S0", "22-25", sampling.demonstrate_criteria,
          SHIPPED_TESTS + "test_three_criteria_make_three_pictures"),
    Entry(5, "eight ways, one picture", "S2", "82-91", algorithms.run_kernel,
          ALGORITHMS + "test_scenes_look_the_same"),
    Entry(6, "one shape on finer grids", "S2", "93-97", sampling.demonstrate_scale,
          SHIPPED_TESTS + "test_pixels_come_to_have_the_area_as_the_grid_gets_finer"),
    Entry(9, "curves as chords", "S0 S4", "54; 78-91", drawing.flatten,
          "tests/test_drawing.py::test_chords_lie_within_a_fiftieth_of_a_pixel"),
    Entry(11, "corners are made at crossings", "S0 S4 S2", "69; 99; 256-260", tessellation.triangulate,
          TESSELLATION + "test_a_pentagram_has_five_points_made_and_an_inside_that_depends_on_the_rule"),
    Entry(11, "values at corners that are made", "S2", "260", polygon_triangles.carry_values,
          TESSELLATION + "test_values_are_carried_to_points_that_are_made"),
    Entry(11, "every simple polygon is cut", "S0 S4 S2", "69; 99; 243", decomposition.demonstrate_decomposition,
          SHIPPED_TESTS + "test_every_simple_polygon_is_cut_along_diagonals"),
    Entry(12, "faces are cut into triangles", "S2", "236-247", faces.cut_faces,
          "tests/test_triangulation.py::test_faces_keep_their_order_and_number_whatever_their_size"),
    Entry(13, "splitting the shape", "S0 S4", "73-78; 101-110", micropolygon.micropolygon,
          "tests/test_counters.py::test_micropolygon_splits_long_edges_into_two"),
    Entry(13, "each sample in one piece", "S0 S4", "73-78; 101-110", micropolygon.owns_sample,
          "tests/test_subdivision.py::test_every_sample_belongs_to_one_micropolygon"),
    Entry(13, "splitting the screen", "S0 S4", "73-78; 101-110", warnock.warnock,
          "tests/test_counters.py::test_warnock_drops_what_is_hidden"),
    Entry(15, "walking, beside the others", "S0 S4", "92-94; 128-131", edge_walk.edge_walk,
          ALGORITHMS + "test_single_triangles_equal_the_oracle"),
    Entry(17, "clipping before walking", "S1", "68-75", clip.to_screen,
          "tests/test_clip.py::test_triangles_behind_at_and_across_the_eye"),
    Entry(18, "space-filling curves", "S1", "83-94", order.visit_hilbert,
          SHIPPED_TESTS + "test_curves_are_followed_block_by_block"),
    Entry(18, "without clipping", "S1", "87", homogeneous_edges.without_clipping,
          "tests/test_homogeneous_edges.py::test_a_sheet_through_the_near_plane_has_no_cracks_and_no_double_hits"),
    Entry(25, "what a difference keeps", "S0 S4", "172-181; 213-219", precision.four_digits,
          EXPERIMENTS + "test_a_difference_keeps_one_digit_of_four"),
    Entry(26, "C three ways", "S0 S4", "183-191; 221-227", precision.precision_of_c,
          EXPERIMENTS + "test_the_average_is_precise_and_the_difference_is_not"),
    Entry(27, "fifteen rows", "S4", "229-268", precision.loss_of_precision,
          EXPERIMENTS + "test_all_fifteen_rows_of_the_loss_of_precision_are_the_slides"),
    Entry(42, "both scenes, flat", "S0 S4", "365-394; 495-499", scenes.flat_scenes,
          EXPERIMENTS + "test_scenes_are_the_slides_within_a_level"),
    Entry(48, "moving slivers", "S2", "371-373", slivers.moving_slivers,
          EXPERIMENTS + "test_exact_shares_keep_the_light_of_a_moving_sliver"),
    Entry(49, "an edge has one owner, whatever the order", "S2", "377", edge.edge_bias,
          "tests/test_partition.py::test_a_mesh_over_the_image_owns_every_sample_once"),
    Entry(49, "so has a sample where two are as near", "S2", "377", write.is_nearer,
          "tests/test_visibility.py::test_keys_order_like_is_nearer"),
    Entry(50, "area as the cure", "S1", "119-122", area.sweep_areas,
          "tests/test_area.py::test_tilings_add_up_to_exactly_one"),
    Entry(51, "any attributes", "S1 S2", "126-134; 394-401", pipeline.interpolate,
          "tests/test_visibility.py::test_interpolation_is_right_to_a_few_bits"),
    Entry(62, "triangles shaded between their corners", "S0 S4", "523; 684", gouraud.paint_gouraud,
          "tests/test_gouraud.py::test_channels_are_the_rational_ones_rounded_half_up"),
    # Colour.
    Entry(74, "HSV", "S2", "28-36", color.rgb_to_hsv,
          MODELS + "test_hsv_has_the_bits_of_colorsys"),
    Entry(75, "YIQ", "S2", "37-50", color.rgb_to_yiq,
          MODELS + "test_yiq_is_the_matrix_and_comes_back"),
    Entry(76, "green, red, blue", "S2", "49", color.luma_601,
          MODELS + "test_green_is_lighter_than_red_and_red_than_blue"),
    Entry(77, "three averages", "S2", "51-70", brightness.demonstrate_averages,
          SHIPPED_TESTS + "test_white_is_a_little_grey_and_v_is_no_mean"),
    Entry(77, "luminance of light", "S2", "53-55", color.luminance,
          MODELS + "test_luminance_is_not_luma"),
    Entry(78, "grey world", "S2", "72-77", color.grey_world,
          "tests/test_white_balance.py::test_grey_comes_out_of_coloured_light"),
    Entry(78, "adaptation", "S2", "72-77", color.adaptation_matrix,
          "tests/test_white_balance.py::test_matrices_are_the_published_ones"),
    # Hidden surfaces.
    Entry(79, "rows are written as they are done", "S3", "114-115", sink.open_sink,
          "tests/test_sink.py::test_every_algorithm_writes_what_it_paints"),
    Entry(81, "in order in every row", "S3", "123-126", active_edges.sort_edges,
          "tests/test_scanline.py::test_the_list_is_in_order_in_every_row_and_empty_at_the_end"),
    Entry(83, "buckets by counting", "S3", "150", active_edges.build_edge_table,
          "tests/test_scanline.py::test_a_bucket_has_the_triangles_that_start_in_its_row"),
    Entry(97, "concave and crossing polygons", "S3", "338-358", polygon.cut_trapezoids,
          "tests/test_polygon.py::test_trapezoids_hold_what_the_fill_rule_says"),
    Entry(98, "visible runs instead of pixels", "S3", "360-384", span_list.list_spans,
          "tests/test_counters.py::test_sweeps_that_know_what_is_nearest_write_each_sample_once"),
    Entry(99, "what a scene gives trouble with", "S3", "39-53", report_of,
          "tests/test_iv_files.py::test_the_report_names_what_the_lecture_warns_of"),
    # Homogeneous coordinates.
    Entry(100, "the origin moves", "S3", "386-399", projective.demonstrate_translation,
          PROJECTIVE + "test_100_no_two_by_two_matrix_moves_the_origin"),
    Entry(101, "factors", "S3", "401-413", homogeneous.is_same,
          PROJECTIVE + "test_101_a_factor_changes_nothing_and_one_triple_is_no_point"),
    Entry(101, "division by W", "S3", "407-416", homogeneous.cartesian,
          PROJECTIVE + "test_101_a_factor_changes_nothing_and_one_triple_is_no_point"),
    Entry(102, "the limit", "S3", "418-433", projective.demonstrate_limit,
          PROJECTIVE + "test_102_the_limit_is_one_ideal_point_from_both_sides"),
    Entry(102, "at infinity", "S3", "424-433", homogeneous.is_ideal,
          PROJECTIVE + "test_102_the_limit_is_one_ideal_point_from_both_sides"),
    Entry(103, "affine maps", "S3", "435-447", homogeneous.affine,
          PROJECTIVE + "test_103_translations_and_affine_matrices_are_composed_by_products"),
    Entry(104, "on a line", "S3", "449-468", homogeneous.is_incident,
          PROJECTIVE + "test_104_points_lines_and_directions_in_one_form"),
    Entry(105, "join", "S3", "470-482", homogeneous.join,
          PROJECTIVE + "test_105_two_points_make_the_line_of_the_slide"),
    Entry(106, "meet", "S3", "484-490", homogeneous.meet,
          PROJECTIVE + "test_106_two_lines_make_the_point_of_the_slide"),
    Entry(107, "one ideal point, two signs", "S3", "490-492", homogeneous.canonical,
          PROJECTIVE + "test_107_parallel_lines_meet_in_antipodal_directions_that_are_one_point"),
    Entry(107, "all products of the slide", "S3", "470-492", projective.demonstrate_incidence,
          PROJECTIVE + "test_107_parallel_lines_meet_in_antipodal_directions_that_are_one_point"),
    Entry(108, "join and meet of space", "S3", "494", projective.demonstrate_space,
          PROJECTIVE + "test_108_joins_and_meets_of_space"),
    Entry(109, "normals", "S3", "496-521", homogeneous.normal_matrix,
          PROJECTIVE + "test_109_directions_are_not_moved_and_normals_need_the_inverse_transpose"),
    Entry(110, "the frustum", "S3", "523-531; 568", homogeneous.frustum,
          PROJECTIVE + "test_110_the_frustum_and_its_inverse_are_those_of_the_slide"),
    Entry(110, "its inverse", "S3", "568", homogeneous.inverse,
          PROJECTIVE + "test_110_the_frustum_and_its_inverse_are_those_of_the_slide"),
    Entry(111, "the eye", "S3", "527-537", homogeneous.transform,
          PROJECTIVE + "test_111_the_centre_of_projection_goes_to_infinity"),
    Entry(112, "planes", "S3", "539-562", homogeneous.transform_planes,
          PROJECTIVE + "test_112_a_plane_becomes_h_times_the_inverse"),
    Entry(113, "the plane through the eye", "S3", "564-576", projective.demonstrate_frustum,
          PROJECTIVE + "test_113_the_plane_through_the_eye_becomes_the_plane_at_infinity"),
    Entry(114, "the projection plane", "S3", "578-594", projective.demonstrate_frustum,
          PROJECTIVE + "test_114_the_projection_plane_becomes_the_front_of_the_cube"),
    Entry(115, "the plane at infinity", "S3", "596-608", projective.demonstrate_frustum,
          PROJECTIVE + "test_115_the_plane_at_infinity_comes_within_reach"),
    Entry(116, "in perspective", "S3", "610-630", pipeline.interpolate,
          PROJECTIVE + "test_116_depth_is_straight_on_the_screen_after_the_division_and_eye_z_is_not"),
    Entry(117, "two checks of one light", "S3", "632-662", colors.checker_shadow,
          EXPERIMENTS + "test_check_a_is_check_b"),
    Entry(118, "five views", "S3", "664-690", ivscan.draw_view, "tests/test_ivscan.py::test_views"),
    Entry(118, "the log of calls", "S3", "664-690", ivscan.replay_log,
          "tests/test_ivscan.py::test_the_log_makes_the_result"),
    Entry(119, "a model read and shown", "S3", "55-108", projection.model,
          EXPERIMENTS + "test_a_model_is_shown_whole"),
    Entry(120, "primitives a pixel", "S0 S4", "531-542; 692-703", shapes.five_primitives,
          EXPERIMENTS + "test_primitives_and_splats"),
    Entry(121, "a great many points", "S0 S4", "536-542; 697-703", shapes.five_primitives,
          EXPERIMENTS + "test_primitives_and_splats"),
    Entry(122, "a tree of spheres", "S0 S4", "543-549; 704-710", splats.build_tree,
          SPLATS + "test_a_tree_holds_every_point_once_and_parents_hold_their_children"),
    Entry(122, "coarse and refined", "S0 S4", "543-549; 704-710", splats.cut,
          SPLATS + "test_every_cut_covers_each_leaf_once_and_finer_ones_have_more"),
    Entry(122, "small differences", "S0 S4", "543-549; 704-710", splats.encode,
          SPLATS + "test_decoded_spheres_are_never_smaller_and_errors_do_not_add_up"),
    Entry(123, "the four pictures", "S0 S4", "550-566; 711-727", shapes.splats,
          EXPERIMENTS + "test_primitives_and_splats"),
    Entry(124, "read a model", "S0 S4", "567-571; 728-729", load.load,
          "tests/test_silhouette.py::test_the_shipped_model"),
    Entry(124, "show it", "S0 S4", "567-571; 728-729", pipeline.render,
          "tests/test_silhouette.py::test_the_shipped_model"),
)

# What 32 bits with 12 of them behind the point can hold.
BUDGET: tuple[Entry, ...] = (
    Entry(1, "the cast", "S4", "285-287", fixed_point.java_int,
          FIXED + "test_the_casts_and_sums_of_java"),
    Entry(2, "C is held", "S4", "287", fixed_point_faults.demonstrate_overflow,
          FIXED + "test_c_is_held_from_724_pixels_on"),
    Entry(3, "the sum of C wraps", "S4", "424", fixed_point_faults.demonstrate_area_wrap,
          FIXED + "test_the_sum_of_c_wraps_around_from_362_pixels_on"),
    Entry(4, "sums of products that wrap", "S4", "299-301", fixed_point.FixedEdgeEqn.evaluate,
          SHIPPED_TESTS + "test_products_may_wrap_around_if_their_sum_fits"),
    Entry(5, "gradients are held", "S4", "582-584", fixed_point_faults.demonstrate_gradient,
          FIXED + "test_thin_slivers_far_away_hold_their_gradient"),
    Entry(6, "products in two halves", "S4", "272-304", shipped_fixed_point.product_halves,
          "tests/test_fixed_point.py::test_product_halves_are_exact_up_to_the_limits"),
)

# What looks like a slip and was checked.
SOUND: tuple[Entry, ...] = (
    Entry(1, "flip() leaves the flag alone: it tells how the edge ran at first", "S0 S4", "214-220; 293-297",
          edge_equations.EdgeEqn.flip, EDGES + "test_edges_pass_through_their_vertices_and_keep_their_flags"),
    Entry(2, "the sort table, for every order of three", "S4", "317", edge_equations.look_up,
          EDGES + "test_the_sort_table_holds_for_all_orders_of_three"),
    Entry(3, "(2 sum + 3) / 6 is the rounded third", "S0 S4", "253-255; 328-339", edge_equations.average_channel,
          EDGES + "test_two_sums_and_three_by_six_is_the_rounded_third"),
    Entry(4, "y is stepped before d, which does not use it", "S2", "152-197", lines.midpoint,
          LINES + "test_d_is_f_at_the_next_midpoint"),
    Entry(5, "the products of points and lines", "S3", "470-492", projective.demonstrate_incidence,
          PROJECTIVE + "test_105_two_points_make_the_line_of_the_slide"),
    Entry(6, "barycentric weights from bilinear ones", "S2", "454-502", interpolation.weights_from_scan_line,
          WALKING + "test_weights_from_the_scan_line_are_the_areas"),
    Entry(7, "the printed inverse of the frustum", "S3", "568", homogeneous.inverse,
          PROJECTIVE + "test_110_the_frustum_and_its_inverse_are_those_of_the_slide"),
    Entry(8, "rows of the YIQ matrix add up to 1, 0 and 0", "S2", "47", color.rgb_to_yiq,
          MODELS + "test_greys_have_neither_i_nor_q"),
)
# fmt: on


class Awaited(NamedTuple):
    """An item that nothing here does yet."""

    number: str
    lecture: str
    lines: str
    reason: str


AWAITED: tuple[Awaited, ...] = ()
