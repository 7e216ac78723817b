"""The experiments on the lectures' slides: every number that is known from elsewhere, and that each says what it should."""

from __future__ import annotations

import ast
import inspect
import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from scanspan.errors import InputError
from scanspan.lectures import PORTS, SLIPS
from scanspan.lectures.experiments import EXPERIMENTS, Experiment, find_experiment
from scanspan.lectures.experiments.experiment import Table, aligned, table, written
from tests.experimenting import found, number

# The lengths of the five documents in lines.
LENGTHS = {"S0": 571, "S1": 153, "S2": 518, "S3": 691, "S4": 729}
DEMONSTRATING = (
    "edge_faults", "fixed_point_faults", "walking", "ownership", "interpolation", "lines", "fills", "hidden_surfaces",
    "half_planes",
)  # fmt: skip
NAMES = [one.name for one in EXPERIMENTS]


def column(name: str, heading: str | int) -> list[object]:
    """Return a column of an experiment's table."""
    numbers = found(name).numbers
    k = heading if isinstance(heading, int) else numbers.headings.index(heading)
    return [row[k] for row in numbers.rows]


# What each of them has


@pytest.mark.parametrize("one", EXPERIMENTS, ids=NAMES)
def test_an_experiment_has_a_slide_an_idea_numbers_a_picture_and_a_line(one: Experiment) -> None:
    # The slide, and an idea in a few sentences of its own.
    first, last = one.place[1], int(re.split("[-;, ]", one.lines)[-1])
    assert 0 < first <= last <= LENGTHS[one.lecture]
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", one.name)
    assert 60 < len(one.idea) < 480
    assert one.idea.endswith(".")
    assert one.items
    assert inspect.getdoc(one.function)

    # Numbers: rows as long as the headings, labels that differ, everything written out.
    numbers = found(one.name).numbers
    assert numbers.rows
    assert {len(row) for row in numbers.rows} == {len(numbers.headings)}
    assert len({row[0] for row in numbers.rows}) == len(numbers.rows)
    assert all(written(cell) not in ("nan", "None") or one.name == "slope-forms" for row in numbers.rows for cell in row)

    # Pictures of a size that fits on a page, each with a caption, on which something is to be seen.
    for shown in found(one.name).panels:
        assert shown.caption
        assert (shown.pixels.dtype, shown.pixels.ndim, shown.pixels.shape[2]) == (np.uint8, 3, 3)
        assert shown.pixels.shape[1] * shown.scale <= 720
    assert any(len(np.unique(shown.pixels.reshape(-1, 3), axis=0)) > 1 for shown in found(one.name).panels)
    sheet = found(one.name).picture
    assert sheet.dtype == np.uint8
    assert sheet.shape[1] <= 1080

    # The line that does it: in a file of the package, and there as it is told.
    source = one.find_source()
    lines = (Path(inspect.getfile(Experiment)).parents[3] / source.file).read_text("utf-8").split("\n")
    assert one.statement in lines[source.line - 1]
    shown_code = source.code.split("\n")
    assert shown_code[source.line - source.first].strip() == lines[source.line - 1].strip()
    assert not shown_code[source.line - source.first].strip().startswith(("#", '"""', "def "))


def test_names_differ_and_the_order_is_that_of_the_lectures() -> None:
    assert len(set(NAMES)) == len(NAMES)
    places = [one.place for one in EXPERIMENTS]
    assert places == sorted(places)


def test_every_item_that_can_be_seen_has_an_experiment() -> None:
    items = {item for one in EXPERIMENTS for item in one.items}

    # 99 is about somebody's scenes, 108 about operations in three dimensions.
    assert set(range(1, 125)) - items == {99, 108}
    assert {entry.number for entry in PORTS} - items <= {99, 108}

    # Some slips are about words, and have nothing to show: statements out of place, names spelled two ways, "usually".
    assert {entry.number for entry in SLIPS} - {slip for one in EXPERIMENTS for slip in one.slips} <= {2, 3, 18, 20}


def test_every_demonstration_is_part_of_an_experiment() -> None:
    shown = {
        node.attr
        for path in sorted(Path(inspect.getfile(Experiment)).parent.glob("*.py"))
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Attribute)
    }
    entries = [entry for entry in [*PORTS, *SLIPS] if entry.is_demonstration and entry.home.split(".")[2] in DEMONSTRATING]
    assert len(entries) > 40
    assert {entry.function.__name__ for entry in entries} - shown == set()


def test_an_unknown_name_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(InputError, match=r"^unknown experiment 'moving-sliver'; did you mean 'moving-slivers'\? 'scanspan lec"):
        find_experiment("moving-sliver")
    with pytest.raises(InputError, match=r"^unknown experiment 'x'; 'scanspan lecture list' shows all \d+$"):
        find_experiment("x")


def test_tables_are_written_in_columns() -> None:
    assert table(("a", 1), ("b", 22)).value("b") == 22
    assert (
        aligned(Table(("what", "n"), (("one", 1), ("more", 1234.5))))
        == "what       n\n----  ------\none        1\nmore  1234.5"
    )
    assert written(-0.0) == "0"
    assert written(False) == "no"


def test_experiments_draw_with_what_is_shipped() -> None:
    folder = Path(inspect.getfile(Experiment)).parent
    for path in sorted(folder.glob("*.py")):
        names = {node.module or "" for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.ImportFrom)}
        assert not {name for name in names if name.split(".")[0] in ("scipy", "shapely", "cv2", "matplotlib", "numba")}


# Precision


def test_all_fifteen_rows_of_the_loss_of_precision_are_the_slides() -> None:
    numbers = found("loss-of-precision").numbers
    assert len(numbers.rows) == 16
    assert all(row[-1] for row in numbers.rows)
    assert [str(row[2]) for row in numbers.rows[:5]] == ["-0.054130327", "0.83726716", "0.99334663", "0.9949874", "0.9950065"]
    assert str(number("loss-of-precision", "correct", "slope")) == "0.9950042"


def test_a_difference_keeps_one_digit_of_four() -> None:
    assert column("catastrophic-cancellation", 1) == [1.0, 4, 1]


def test_the_average_is_precise_and_the_difference_is_not() -> None:
    name = "precision-of-c"
    assert number(name, "1 px, x0 y1 - x1 y0") == pytest.approx(2.1e-5, rel=0.1)
    assert number(name, "1 px, the average") == pytest.approx(4.0e-8, rel=0.05)
    assert number(name, "1 px, x0 y1 - x1 y0", 2) == pytest.approx(0.83, abs=0.1)
    assert number(name, "1 px, the average", 2) == pytest.approx(1.2e-4, rel=0.1)
    assert found(name).numbers.value("0.1 px, corners snapped, in whole numbers", 2) == 0
    assert number(name, "100 px, corners snapped, in whole numbers") == 0


def test_the_sum_of_c_is_no_precise_area() -> None:
    assert number("precision-of-area", "1 px") == pytest.approx(1.6e-4, rel=0.1)
    assert number("precision-of-area", "0.01 px") == pytest.approx(1.5e-2, rel=0.1)
    assert 10 < number("precision-of-area", "0.01 px", "wrong signs") < 40
    assert max(column("precision-of-area", "error of the cross product")) < 4e-8


def test_lines_in_twelve_bits_miss_their_corners() -> None:
    assert number("fixed-point-lines", "1 px") == pytest.approx(0.05, abs=0.005)
    assert number("fixed-point-lines", "1 px", 2) == pytest.approx(0.25, abs=0.015)
    assert number("fixed-point-lines", "100 px", 2) == pytest.approx(0.0024, abs=0.0003)
    assert set(column("fixed-point-lines", 3)) == {0.0}


# The programs


def test_the_overflow_and_the_sums_that_wrap_around() -> None:
    wrong = dict(zip(column("overflow", 0), column("overflow", "wrong pixels"), strict=True))
    assert [wrong[size] for size in ("640 x 480", "800 x 600", "724 x 724", "725 x 725", "1024 x 512", "1024 x 768")] == [
        0, 0, 0, 1449, 511, 218964,
    ]  # fmt: skip
    assert wrong["sum of C, -362 to 362"] == 0 < wrong["sum of C, -363 to 363"]
    assert number("overflow", "sum of C, -511 to 511", 3) == -16760832
    assert number("overflow", "724 x 724", 3) == 2147024896
    assert set(column("overflow", "the library's wrong pixels")) == {0}


def test_the_crashes() -> None:
    numbers = found("index-six").numbers
    assert numbers.rows[0][1:] == (1, 1, 0)
    assert numbers.rows[1][1] / numbers.rows[1][2] == pytest.approx(0.86, abs=0.02)
    assert numbers.rows[2][1] / numbers.rows[2][2] == pytest.approx(0.49, abs=0.02)
    assert number("index-six", "exactly 2/4096 px wide") == 0 < number("index-six", "exactly 1/4096 px wide")
    assert set(column("index-six", 3)[:-1]) == {0}


def test_a_constant_is_off_by_up_to_209() -> None:
    assert column("constant-channel", "in 12 bits")[:4] == [101, 209, 28, 0]
    assert column("constant-channel", 2)[:4] == [0.0] * 4
    assert column("constant-channel", "in 12 bits")[4] == -(2**31)


def test_small_triangles_are_lost_and_turned() -> None:
    numbers = found("small-triangles").numbers
    assert numbers.value("0.02 px", 1) / 2000 == pytest.approx(7655 / 49999, abs=0.02)
    assert numbers.value("0.02 px", 2) / 2000 == pytest.approx(23643 / 49999, abs=0.03)


def test_the_smooth_triangle_and_the_sums() -> None:
    assert column("smooth-as-printed", 1)[0] == 1
    assert number("smooth-as-printed", "with it") == 0
    assert number("smooth-as-printed", "alpha of the average of 0, 0 and 30, in S0") == 255
    assert number("smooth-as-printed", "in S4") == 10
    assert number("smooth-as-printed", "the variable area of a triangle whose area is 4") == 8
    assert number("running-sums", "samples lost by the running sum, of 8") == 3
    assert number("running-sums", "by the library") == 0


def test_the_box_by_signs_is_the_box() -> None:
    assert all(column("bounding-box", 4))
    assert sorted(column("bounding-box", 1)[:6]) == ["001", "010", "011", "100", "101", "110"]


def test_points_lines_and_forms() -> None:
    assert column("points-jump", 1)[:6] == [0, 0, 1, 2, 2, 2]
    assert column("points-jump", 2)[:6] == [0, 1, 1, 2, 2, 3]
    assert all(column("three-lines", 4))
    assert number("slope-forms", "edge (0, 0) to (1, 0), at (0.5, 0.5)") == -0.5
    right, left = (found("slope-forms").numbers.rows[k][1:] for k in (0, 1))
    assert (right[0], right[1]) == (left[0], -left[1])
    assert math.isinf(number("slope-forms", "upright, at (10, 20)"))
    assert found("slope-forms").numbers.rows[-2][1:] == (-2.5, -10, 10)
    assert found("slope-forms").numbers.rows[-1][1:] == (-2.5, 10, -10)
    assert math.isnan(number("slope-forms", "upright, on its own line (16, 20)"))


# Ownership and coverage


def test_who_owns_the_pixels_between_two() -> None:
    name = "which-pixels"
    for rule in ("no right or bottom", "shadow", "same side, a point on no line", "shipped top-left", "shipped bottom-left"):
        assert (number(name, rule, "gaps"), number(name, rule, "drawn more than once")) == (0, 0)
    assert number(name, "draw", "drawn more than once") == number(name, "do not draw", "gaps") == 1505
    assert 0 < number(name, "same side", "gaps") < 100
    assert number(name, "the program of S0, which draws where e >= 0", 3) == 1505
    assert column("golden-triangles", 1) == column("golden-triangles", 2) == [15, 10, 25]
    assert [row[1:] for row in found("shared-edge-ordering").numbers.rows] == [(12, 12, 0), (0, 0, 10), (0, 0, 0)]
    assert column("ceil-and-floor", 1)[:3] == [13, 0, 0]
    assert column("ceil-and-floor", 1)[4] == 0.0 < 1.0 < column("ceil-and-floor", 1)[3]
    assert column("shadow-rule", 1)[1] == 0 < column("shadow-rule", 1)[0]


def test_pixels_on_average_are_the_area_of_parallelograms() -> None:
    assert column("pixels-on-average", 1)[:2] == [299, 299]
    assert column("pixels-on-average", 1)[2] < 100


def test_exact_shares_keep_the_light_of_a_moving_sliver() -> None:
    spread = dict(zip(column("moving-slivers", 0), column("moving-slivers", "std / mean"), strict=True))
    assert spread["exact area"] < 1e-12 < 0.2 < spread["1 sample"]
    for heading in ("std / mean", "most pieces", "longest gap", "flicker"):
        measured = column("moving-slivers", heading)
        assert measured == sorted(measured, reverse=True)
    assert number("moving-slivers", "exact area", "most pieces") == 1 < number("moving-slivers", "1 sample", "most pieces")
    assert number("moving-slivers", "exact area", "longest gap") == 0 < number("moving-slivers", "1 sample", "longest gap")


def test_shares_add_up_to_the_area() -> None:
    assert abs(column("sampling-criteria", 3)[2]) < 1e-9
    assert abs(column("sampling-criteria", 3)[3]) < 1e-9
    errors = column("aliasing", "mean error at the border")
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] == 0.0
    assert column("display-coordinates", 3) == sorted(column("display-coordinates", 3), reverse=True)
    assert column("conflation", 2)[-1] == 0.25
    assert column("conflation", 1)[2:5] == [255, 255, 255]
    assert column("conflation", 1)[0] == 192


def test_the_five_fill_rules() -> None:
    pixels = dict(zip(column("fill-rules", 0), column("fill-rules", 1), strict=True))
    assert pixels["even-odd"] + pixels["abs-geq-two"] == pixels["non-zero"] == pixels["positive"]
    assert pixels["negative"] == 0
    areas = dict(zip(column("fill-rules", 0), column("fill-rules", 4), strict=True))
    assert (areas["even-odd"], areas["non-zero"], areas["abs-geq-two"]) == (864, 1296, 432)


# Traversal and values


def test_orders_and_the_cache() -> None:
    numbers = found("traversal-orders").numbers
    assert numbers.value("hilbert", "mean step") == numbers.value("hilbert", "longest step") == 1.0
    assert all(row[-1] for row in numbers.rows)
    assert numbers.value("rows", "misses: frame buffer") == 64 * 64 * 4 // 64
    assert column("traversal-orders", "turned by 37 degrees") == [2105, 964, 532, 526, 674]
    assert numbers.value("hilbert", "turned by 90") * 8 == numbers.value("rows", "turned by 90") == 4096
    assert all(column("large-and-small-triangles", -1))


def test_half_spaces_and_sub_triangles() -> None:
    a, b, c, value = found("half-spaces").numbers.rows[3][1:5]
    assert (a, b) == (0, 0)
    assert c == value
    assert found("half-spaces").numbers.rows[4][-1] == 0
    assert number("speed-hacks", "pixels that differ") == 0
    assert set(column("sub-triangles", 4)) == {720}


def test_three_ways_are_one() -> None:
    values = column("three-ways", 1)
    assert values[0] == values[1] == values[2] == values[3] == 589
    assert values[4] < 1e-12
    assert values[5] == 1 < values[6] == Fraction(25, 11)
    assert len(set(column("gouraud-pitfall", 1))) == 4
    assert set(column("gouraud-pitfall", 3)) == {Fraction(1, 3)}


def test_eye_z_is_not_straight_on_the_screen() -> None:
    values = column("eye-z-pitfall", 1)
    assert values[2:5] == [5.0, 1.8, 3.2]
    assert values[5] == pytest.approx(1.8, abs=1e-12)
    assert values[7] > 1000


# Surfaces


def test_all_sweeps_show_the_same() -> None:
    for heading in ("pixels other than by half-spaces", "pixels that the lecture's program shows otherwise", "edges left over"):
        assert set(column("scan-line-sweep", heading)) == {0}
    assert len(set(column("scan-line-sweep", "swaps"))) == 1
    wrong = column("kept-identity", 1)
    assert wrong[1:] == [0, 0, 0] < [wrong[0]]
    assert number("four-subtleties", "kite: wrong pixels", "canonical") == 0 < number("four-subtleties", "kite: wrong pixels")
    assert number("four-subtleties", "kite: edges on one scan line, at most") == 3
    assert number("four-subtleties", "on one that is high enough", "canonical") == 0
    calls = column("ivscan-views", 1)
    assert calls[0] == calls[1] == calls[2]
    assert calls[3] == 0


def test_coherence_falls_with_the_size_of_triangles() -> None:
    runs = column("spatial-coherence", "mean run, pixels")
    assert runs[0] > runs[1] > runs[2]
    assert runs[4] < 2 < runs[3]


# Shapes


def test_approximation_and_triangulation() -> None:
    for n, exact, near, measured, _ in found("polygonal-approximation").numbers.rows:
        assert measured == pytest.approx(exact, abs=1e-9)
        assert near == pytest.approx(exact, rel=2 / n)
    numbers = found("triangulations").numbers
    assert [row[1:3] for row in numbers.rows] == [(5, 0), (6, 0), (2, 1), (8, 5), (5, 0), (6, "")]
    assert [row[3:5] for row in numbers.rows[:5]] == [(0, 0)] * 5
    assert column("convexity", 1)[:2] == [1, 2]


def test_primitives_and_splats() -> None:
    assert column("five-primitives-a-pixel", "primitives a pixel")[0] == 5.0
    visible = column("five-primitives-a-pixel", "visible in a sample, %")[1:]
    assert visible == sorted(visible, reverse=True)
    rates = column("splats", "million a second")[:4]
    assert [round(rate, 3) for rate in rates] == [0.99, 1.209, 1.409, 1.786]

    # Finer cuts through one tree: more splats, narrower ones, nearer to where they should be, and more to read.
    drawn, widest, off, kibibytes = (column("splats", k)[4:] for k in (1, "widest, px", "off by, px", "KiB at 48 bits a node"))
    assert drawn == sorted(set(drawn))
    assert drawn[-1] == 480 * 48
    assert all(limit >= width for limit, width in zip((40, 20, 10), widest))
    assert (widest, off) == (sorted(widest, reverse=True), sorted(off, reverse=True))
    assert all(size * 1024 >= 6 * number for size, number in zip(kibibytes, drawn))


def test_a_model_is_shown_whole() -> None:
    rows = found("read-a-model").numbers.rows
    lines, vertices, triangles, visible, covered = (float(row[1]) for row in rows)
    assert lines == vertices + triangles
    # Of a closed convex body, less than half faces the eye, and not much less.
    assert 0.3 * triangles < visible < 0.5 * triangles
    for shown in found("read-a-model").panels:
        drawn = (shown.pixels != 255).any(axis=2).mean()
        assert abs(100 * drawn - covered) < 2.5


# Lines and fills


def test_lines() -> None:
    values = column("line-algorithms", 1)
    assert values[:6] == [819, 0, 249, 249, 0, 0]
    assert number("line-algorithms", "DDA of the library: wrong") == 0
    assert number("line-algorithms", "at which d was f(x, y - .5) or f(x, y + .5)") == 39
    assert number("midpoint-steps", "start", "D = 2 d") == 2 * (1 - 6) + (14 - 1) == 3


def test_floods_and_parity() -> None:
    rows = found("flood-fill-drawbacks").numbers.rows
    assert rows[0][1:5] == (100, 401, 401, 100)
    assert rows[2][1:5] == (10000, 40001, 40001, 10000)
    assert rows[2][5] < 2 * 10000
    assert column("parity-test", 1)[2:4] == [0, 0]
    assert min(column("parity-test", 1)[:2]) > 0
    assert [row[2:] for row in found("four-paths").numbers.rows] == [(0, 0), (0, 0), (0, 0), (62, 0)]


# Scenes and colours


def test_scenes_are_the_slides_within_a_level() -> None:
    for name in ("flat-scenes", "smooth-scenes"):
        assert set(column(name, "differ by more than a level, edges included")) == {0}
        assert all(column(name, -1))
    assert column("arbitrary-parameters", 1)[1] < 1e-12


def test_colours() -> None:
    numbers = found("luminance-and-intensity").numbers
    assert numbers.value("white", "slide: .333 each") == pytest.approx(254.745)
    assert numbers.value("green", 3) > numbers.value("red", 3) > numbers.value("blue", 3)
    assert numbers.value("green", "intensity") == numbers.value("blue", "intensity") == 85
    values = column("luma-and-chroma", 1)
    assert values[:3] == [1.0, 0.0, 0.0]
    assert values[3] == pytest.approx(-0.2532)
    assert values[4:7] == ["1.000  0.948  0.624", "1.000  -0.276  -0.640", "1.000  -1.105  1.730"]
    assert found("hue-saturation-value").numbers.rows[2][1:] == (pytest.approx(1 / 6), 1.0, 1.0)
    worst = dict(zip(column("white-balance", 0), column("white-balance", 1), strict=True))
    assert worst["white patch"] <= 2 < worst["grey world"] < worst["as it was taken"]
    assert worst["Bradford, white known"] <= 2


def test_check_a_is_check_b() -> None:
    values = column("checker-shadow", 1)
    assert values[0] == values[1] == 118
    assert values[2]
    assert values[3] == values[4] == 0.18
    assert values[5] > 118 > values[6]
    assert values[7]


# Homogeneous coordinates


def test_joins_meets_and_planes() -> None:
    assert column("points-and-lines", 1)[:6] == [
        "(1, 1, -1)", "(-1, -1, -2)", "(0, -2, 0)", "(0, 2, 0)", "(0, 0, 0)", "(0, 0, 0)",
    ]  # fmt: skip
    assert number("points-and-lines", "the meeting point divided by W") == "(0.5, 0.5)"
    assert column("planes-in-perspective", 2)[:5] == ["at infinity", "at infinity", "z' = -1", "z' = 1", "z' = 3"]
    assert column("planes-in-perspective", 1)[:2] == ["(0, 0, -4, 0)", "(0, 0, 0, -1)"]
    assert number("read-a-model", "triangles") == 2304
