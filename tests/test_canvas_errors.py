"""What a canvas refuses: every message, and nothing is painted then."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import scanspan as ss

COLOR_HINT = "expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"
SIZE_HINT = "must be a number of pixels above 0 and at most 262144"
FILL_NAMES = "even-odd, non-zero, positive, negative, abs-geq-two"


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((0, 3), {}, "size = (0, 3): expected (width, height), two whole numbers above 0"),
        ((2.0, 3), {}, "size = (2.0, 3): expected (width, height), two whole numbers above 0"),
        ((1 << 19, 1), {}, "size = (524288, 1): the limit is 262144 for a side and 2147483648 for all pixels"),
        ((1 << 15, 1 << 14), {}, "a canvas of 32768 x 16384 pixels: the limit is 268435456 in all"),
        ((4, 3, "witte"), {}, f"'witte' is no colour; did you mean 'white'? {COLOR_HINT}"),
        ((4, 3, (1, 2)), {}, f"(1, 2) is no colour: {COLOR_HINT}"),
        ((4, 3), {"blend": "gamma"}, "unknown blend 'gamma'; the valid ones are: linear, srgb"),
        ((4, 3), {"blend": "Linear"}, "unknown blend 'Linear'; did you mean 'linear'? The valid ones are: linear, srgb"),
        ((4, 3), {"threads": 0}, "threads = 0: must be a whole number from 1 to 4096"),
        ((4, 3), {"threads": 1.5}, "threads = 1.5: must be a whole number from 1 to 4096"),
    ],
)
def test_what_no_canvas_can_be_made_of(arguments: Any, options: Any, message: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.Canvas(*arguments, **options)
    assert str(caught.value) == message


TRIANGLE = [[(0, 0), (3, 0), (0, 3)]]
RING = TRIANGLE[0]
SEGMENT = [[(0, 0), (3, 2)]]


@pytest.mark.parametrize(
    ("name", "arguments", "options", "message"),
    [
        ("triangles", ([(0, 0), (3, 0), (0, 3)], "red"), {}, "vertices: expected shape (N, 3, 2), got (3, 2)"),
        ("triangles", ([[(0, 0), (3, 0), (0, np.inf)]], "red"), {},
         "vertices[0, 2] = (0.0, inf): expected finite numbers within 16777216 pixels"),
        ("triangles", ([[(0, 0), (3, 2e7), (0, 1)]], "red"), {"nonfinite": "drop"},
         "vertices[0, 1] = (3.0, 20000000.0): expected finite numbers within 16777216 pixels"),
        ("triangles", (TRIANGLE, "red"), {"algorithm": "span-list"},
         "algorithm = 'span-list': it sweeps over all triangles at once and cannot paint them in order"),
        ("triangles", (TRIANGLE, "red"), {"subpixel_bits": 3}, "subpixel_bits = 3: must be a whole number from 4 to 16"),
        ("triangles", (TRIANGLE, "red"), {"cull": "Back"},
         "unknown cull 'Back'; did you mean 'back'? The valid ones are: none, back, front"),
        ("triangles", (TRIANGLE, None), {}, "colors: expected an array of numbers, got dtype object, such as 'None'"),
        ("triangles", (TRIANGLE * 3, np.zeros((2, 3))), {}, "colors: expected shape (4,) or (N, 4) with N = 3, got (2, 3)"),
        ("triangles", (TRIANGLE * 2, [(0, 0, 0), (0, 0, 256)]), {}, "colors[1]: 256 is no colour value, integers are 0..255"),
        ("triangles", (TRIANGLE * 2, [(0, 0, 0), (0, 1.5, 0)]), {}, "colors[1]: 1.5 is no colour value, floats are 0..1"),
        ("triangles", (TRIANGLE * 2, [(True, True, True)] * 2), {},
         "colors: expected integers 0..255 or floats 0..1, got dtype bool"),
        ("triangles", (TRIANGLE, "redd"), {}, f"'redd' is no colour; did you mean 'red'? {COLOR_HINT}"),
        ("polygon", (RING, "red"), {"fill_rule": "nonzero"},
         f"unknown fill rule 'nonzero'; did you mean 'non-zero'? The valid ones are: {FILL_NAMES}"),
        ("polygon", (RING, "red"), {"algorithm": "flod"},
         "unknown algorithm 'flod'; did you mean 'flood'? The valid ones are: scanline, parity, triangles, flood"),
        ("polygon", (RING, "red"), {"subpixel_bits": 17}, "subpixel_bits = 17: must be a whole number from 4 to 16"),
        ("polygon", (5, "red"), {}, "rings: expected one ring, (M, 2) points, or a list of rings"),
        ("polygon", (None, "red"), {}, "rings: expected one ring, (M, 2) points, or a list of rings"),
        ("polygon", ([RING, 5], "red"), {}, "rings[1]: expected numbers of shape (N, 2), got int64 ()"),
        ("polygon", ([(1, 2, 3)] * 3, "red"), {}, "rings: expected numbers of shape (N, 2), got int64 (3, 3)"),
        ("polygon", ([(0, 0), (3, np.nan), (0, 3)], "red"), {},
         "rings[1] = [3.0, nan]: expected finite numbers within 16777216 pixels"),
        ("polygon", ([RING, [(0, 0), (3, 0), (1.7e7, 3)]], "red"), {},
         "rings[1][2] = [17000000.0, 3.0]: expected finite numbers within 16777216 pixels"),
        ("polygon", (RING, [(1, 2, 3), (4, 5, 6)]), {}, f"[(1, 2, 3), (4, 5, 6)] is no colour: {COLOR_HINT}"),
        ("lines", ([(0, 0), (3, 2)], "red"), {}, "segments: expected numbers of shape (N, 2, 2), got int64 (2, 2)"),
        ("lines", ([[(0, 0), (3, -np.inf)]], "red"), {},
         "segments[0] = [[0.0, 0.0], [3.0, -inf]]: expected finite numbers within 16777216 pixels"),
        ("lines", (SEGMENT, "red"), {"algorithm": "bresenham"},
         "unknown algorithm 'bresenham'; the valid ones are: midpoint, dda, symmetric, diamond-exit, run-length, wu"),
        ("lines", (SEGMENT, np.zeros((3, 4))), {}, "colors: expected shape (4,) or (N, 4) with N = 1, got (3, 4)"),
        ("lines", ([[(0, 0), "ab"]], "red"), {}, None),
        ("polyline", ([(0, 0, 0)], "red"), {}, "points: expected numbers of shape (N, 2), got int64 (1, 3)"),
        ("polyline", ([(0, 0), (1, 1)], "red"), {"closed": 1}, "closed = 1: must be True or False"),
        ("polyline", ([(True, False)], "red"), {}, "points: expected numbers of shape (N, 2), got bool (1, 2)"),
        ("points", ((1, 2), "red"), {}, "xy: expected numbers of shape (N, 2), got int64 (2,)"),
        ("points", ([(1, np.nan)], "red"), {}, "xy[0] = [1.0, nan]: expected finite numbers within 16777216 pixels"),
        ("points", ([(1, 2)], "red"), {"shape": "disk"},
         "unknown shape 'disk'; did you mean 'disc'? The valid ones are: square, disc"),
        *[
            ("points", ([(1, 2)], "red"), {"size": size}, f"size = {size!r}: {SIZE_HINT}")
            for size in (0, -1, np.nan, np.inf, True, "2", None, 262145)
        ],
    ],
)  # fmt: skip
def test_errors_quote_what_came_and_paint_nothing(name: str, arguments: Any, options: Any, message: str | None) -> None:
    canvas = ss.Canvas(4, 3)
    with pytest.raises(ss.InputError) as caught:
        getattr(canvas, name)(*arguments, **options)
    assert message is None or str(caught.value) == message
    assert (canvas.pixels == 255).all()


def test_an_unknown_algorithm_is_told_with_the_known_ones() -> None:
    with pytest.raises(ss.InputError, match=r"unknown algorithm 'halfspace'; did you mean 'half-space'\? The valid ones are: "):
        ss.Canvas(4, 3).triangles(TRIANGLE, "red", algorithm="halfspace")
    with pytest.raises(ss.InputError, match="unknown rule 'topleft'; did you mean 'top-left'"):
        ss.Canvas(4, 3).triangles(TRIANGLE, "red", rule="topleft")
    with pytest.raises(ss.LimitError):
        ss.Canvas(1 << 15, 1 << 14)


FROZEN = np.zeros((3, 4, 4), np.uint8)
FROZEN.flags.writeable = False


@pytest.mark.parametrize(
    ("pixels", "told"),
    [
        (np.zeros((3, 4, 3), np.uint8), "uint8 (3, 4, 3)"),
        (np.zeros((3, 4), np.uint8), "uint8 (3, 4)"),
        (np.zeros((3, 4, 4), np.int8), "int8 (3, 4, 4)"),
        (np.zeros((3, 4, 4)), "float64 (3, 4, 4)"),
        (np.zeros((3, 8, 4), np.uint8)[:, ::2], "uint8 (3, 4, 4)"),
        (np.zeros((3, 4, 4), np.uint8, order="F"), "uint8 (3, 4, 4)"),
        (np.zeros((0, 4, 4), np.uint8), "uint8 (0, 4, 4)"),
        (FROZEN, "uint8 (3, 4, 4)"),
        ([[[0, 0, 0, 0]]], "list"),
        (None, "NoneType"),
    ],
)
def test_arrays_that_cannot_be_painted_into(pixels: Any, told: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.Canvas.from_array(pixels)
    assert str(caught.value) == f"pixels: expected a writable, contiguous (H, W, 4) array of uint8 to paint into, got {told}"


@pytest.mark.parametrize(
    ("name", "arguments", "options", "message"),
    [
        ("triangles", (TRIANGLE, "red"), {"algorithm": ["warnock"]}, "unknown algorithm ['warnock']"),
        ("lines", (SEGMENT, "red"), {"algorithm": {}}, "unknown algorithm {}"),
        ("polygon", (RING, "red"), {"algorithm": np.zeros(2)}, "unknown algorithm array([0., 0.])"),
        ("polygon", (RING, "red"), {"fill_rule": np.zeros(2)}, "unknown fill rule array([0., 0.])"),
        ("points", ([(1, 2)], "red"), {"shape": np.zeros(2)}, "unknown shape array([0., 0.])"),
        ("flood_fill", (0, 0, "red"), {"connectivity": np.array([4, 8])}, "connectivity = array([4, 8]): must be 4 or 8"),
        ("flood_fill", (0, 0, "red"), {"connectivity": 4.0}, "connectivity = 4.0: must be 4 or 8"),
        ("polygon", ({"outer": RING}, "red"), {}, "rings: expected one ring, (M, 2) points, or a list of rings"),
        ("triangles", (TRIANGLE * 2, [(1, 2, 3), (1, 2, 3, 4)]), {}, "colors: expected an array of numbers, setting an"),
        ("triangles", (TRIANGLE, []), {}, f"[] is no colour: {COLOR_HINT}"),
        ("triangles", (TRIANGLE * 2, ["red", "blue"]), {}, f"['red', 'blue'] is no colour: {COLOR_HINT}"),
    ],
)  # fmt: skip
def test_things_of_another_kind_are_quoted_too(name: str, arguments: Any, options: Any, message: str) -> None:
    canvas = ss.Canvas(4, 3)
    with pytest.raises(ss.InputError) as caught:
        getattr(canvas, name)(*arguments, **options)
    assert str(caught.value).startswith(message)
    assert (canvas.pixels == 255).all()


def test_points_at_the_limit_and_no_colours_for_nothing_are_no_errors() -> None:
    canvas = ss.Canvas(4, 3)
    for shape in ("square", "disc"):
        canvas.points([(1 << 24, 0), (0, -(1 << 24))], [(255, 0, 0), (0, 0, 255)], size=1 << 18, shape=shape)
    canvas.triangles([], [])
    canvas.points([], [], shape="disc")
    canvas.lines([], [])
    assert (canvas.pixels == 255).all()
    canvas.points([(1 << 24, 0), (1.5, 1.5)], [(255, 0, 0), (0, 0, 255)])
    assert canvas.pixels[1, 1].tolist() == [0, 0, 255, 255]
