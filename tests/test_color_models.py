"""Colour models: against colorsys, the books' formulas, published numbers and exact decimals; there and back; every message."""

from __future__ import annotations

import colorsys
import itertools
import math
import re
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scanspan as ss
from scanspan import color
from scanspan.color import cylinders

Array = npt.NDArray[Any]

UNIT, TRIPLES = "expected floats between 0 and 1", "expected numbers of shape (..., 3)"

MODELS: dict[str, tuple[Callable[..., Array], Callable[..., Array]]] = {
    "hsv": (color.rgb_to_hsv, color.hsv_to_rgb),
    "hsl": (color.rgb_to_hsl, color.hsl_to_rgb),
    "hsi": (color.rgb_to_hsi, color.hsi_to_rgb),
    "yiq": (color.rgb_to_yiq, color.yiq_to_rgb),
    "xyz": (color.rgb_to_xyz, color.xyz_to_rgb),
    "lab": (color.rgb_to_lab, color.lab_to_rgb),
    "linear": (color.srgb_to_linear, color.linear_to_srgb),
}

unit = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 1.0, 0.5, 0.04045, 1.0 - 2.0**-53, 5e-324, 1e-300, 2.0**-52]))


def every_kind() -> Array:
    """Return colours at random, with all corners of the cube, greys, ties between channels and neighbours of them."""
    rng = np.random.default_rng(7)
    corners = np.array(list(itertools.product((0.0, 0.5, 1.0, 1.0 - 2.0**-53, 2.0**-52), repeat=3)))
    greys = np.repeat(rng.random((50, 1)), 3, axis=1)
    return np.concatenate([rng.random((2000, 3)), rng.integers(0, 256, (500, 3)) / 255, corners, greys])


# The hexagons


def test_hsv_has_the_bits_of_colorsys() -> None:
    colors = every_kind()
    there = np.array([colorsys.rgb_to_hsv(*row) for row in colors.tolist()])
    there[there[:, 0] == 1.0, 0] = 0.0
    assert np.array_equal(color.rgb_to_hsv(colors), there)
    back = np.array([colorsys.hsv_to_rgb(*row) for row in colors.tolist()])
    assert np.array_equal(color.hsv_to_rgb(colors), back)


def test_hsl_is_hls_of_colorsys() -> None:
    colors = every_kind()
    # The end of lightness is computed as colorsys does since Python 3.12; before, it divided by zero next to white.
    safe = colors[colors.max(axis=1) + colors.min(axis=1) < 2.0]
    there = np.array([colorsys.rgb_to_hls(*row) for row in safe.tolist()])[:, [0, 2, 1]]
    there[there[:, 0] == 1.0, 0] = 0.0
    assert np.abs(color.rgb_to_hsl(safe) - there).max() < 1e-15
    back = np.array([colorsys.hls_to_rgb(h, lightness, s) for h, s, lightness in colors.tolist()])
    assert np.abs(color.hsl_to_rgb(colors) - back).max() < 2e-15


@pytest.mark.parametrize("name", ["hsv", "hsl", "hsi"])
def test_greys_and_black_have_no_hue_and_no_saturation(name: str) -> None:
    greys = np.repeat(np.array([0.0, 5e-324, 0.1, 0.3, 0.7, 1.0])[:, None], 3, axis=1)
    result = MODELS[name][0](greys)
    assert np.array_equal(result, np.stack([0 * greys[:, 0], 0 * greys[:, 0], greys[:, 0]], axis=-1))
    assert np.array_equal(MODELS[name][1](result), greys)


@pytest.mark.parametrize("name", ["hsv", "hsl", "hsi"])
def test_the_six_pure_colours_are_a_sixth_of_a_turn_apart(name: str) -> None:
    pure = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]], dtype=np.uint8)
    result = MODELS[name][0](255 * pure)
    assert result[0, 0] == 0.0
    assert np.abs(result[:, 0] - np.arange(6) / 6).max() < 1e-15
    assert (result[:, 1] == 1.0).all()


@pytest.mark.parametrize("name", ["hsv", "hsl", "hsi"])
def test_hue_goes_round(name: str) -> None:
    turned = np.array(
        [[0.25, 0.5, 0.5], [1.25, 0.5, 0.5], [-0.75, 0.5, 0.5], [1e30, 0.5, 0.5], [1.0, 0.5, 0.5], [-1e-30, 0.5, 0.5]]
    )
    rgb = MODELS[name][1](turned)
    assert np.array_equal(rgb[1], rgb[0])
    assert np.array_equal(rgb[2], rgb[0])
    red = MODELS[name][1]((0.0, 0.5, 0.5))
    assert all(np.array_equal(row, red) for row in [*rgb[3:], MODELS[name][1]((-1e-30, 0.5, 0.5))])
    assert (MODELS[name][0](every_kind())[:, 0] < 1.0).all()
    assert MODELS[name][0]((1.0, 0.5, 0.5 + 2.0**-53))[0] < 1.0


# The angle


def books_hsi(r: float, g: float, b: float) -> tuple[float, float, float]:
    """Return HSI as Gonzalez and Woods write it, hue by arc cosine."""
    mean = (r + g + b) / 3
    under = math.sqrt((r - g) ** 2 + (r - b) * (g - b))
    angle = math.acos(max(-1.0, min(1.0, 0.5 * ((r - g) + (r - b)) / under)))
    return (angle if b <= g else math.tau - angle) / math.tau, 1 - min(r, g, b) / mean, mean


def test_hsi_is_that_of_the_books(rng: np.random.Generator) -> None:
    colors = rng.random((2000, 3))
    expected = np.array([books_hsi(*row) for row in colors.tolist()])
    assert np.abs(color.rgb_to_hsi(colors) - expected).max() < 1e-7  # what an arc cosine near its ends is good for
    far = np.ptp(colors, axis=1) > 0.2
    assert np.median(np.abs(color.rgb_to_hsi(colors) - expected)[far]) < 1e-15


def test_hsi_back_is_that_of_the_books() -> None:
    for hue, s, i in itertools.product((0.0, 0.05, 0.2, 1 / 3, 0.4, 0.6, 0.75, 0.99), (0.0, 0.3, 1.0), (0.1, 0.5)):
        sector, turn = divmod(math.tau * hue, math.tau / 3)
        smallest = i * (1 - s)
        first = i * (1 + s * math.cos(turn) / math.cos(math.pi / 3 - turn))
        ordered = [first, 3 * i - first - smallest, smallest]
        expected = np.roll(ordered, int(sector))
        assert np.abs(color.hsi_to_rgb((hue, s, i)) - expected).max() < 1e-14
    assert color.hsi_to_rgb((0.0, 1.0, 1.0)).round(12).tolist() == [3, 0, 0]


def test_the_series_are_as_good_as_a_library() -> None:
    x = np.concatenate([np.linspace(-1.7320508, 1.7320508, 4001), [5e-324, -5e-324, 0.0]])
    assert np.abs(cylinders._arctan(x) - np.arctan(x)).max() < 1e-15
    angles = np.linspace(-math.pi / 3, math.pi / 3, 4001)
    assert np.abs(cylinders._tangent(angles) - np.tan(angles)).max() < 4e-15


# YIQ


def test_the_matrix_of_the_slide_is_sound() -> None:
    rows = [[Fraction(repr(value)) for value in row] for row in color.YIQ_MATRICES["slide"].tolist()]
    assert rows == [[Fraction(n, 100) for n in row] for row in ((30, 59, 11), (60, -28, -32), (21, -52, 31))]
    assert [sum(row) for row in rows] == [1, 0, 0]
    (a, b, c), (d, e, f), (g, h, i) = rows
    assert a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) == Fraction("-0.2532")


def test_the_inverse_of_the_slides_matrix_is_worked_out() -> None:
    columns = color.yiq_to_rgb(np.eye(3), "slide")
    assert columns[0].tolist() == [1, 1, 1]
    assert np.abs(columns.T - [[1, 0.948, 0.624], [1, -0.276, -0.640], [1, -1.105, 1.730]]).max() < 6e-4
    assert np.abs(columns.T - np.linalg.inv(color.YIQ_MATRICES["slide"])).max() < 1e-14


def test_the_precise_matrix_follows_from_the_primaries() -> None:
    luminances = color.primaries_matrix(color.NTSC_PRIMARIES, color.C)[1]
    assert luminances.round(3).tolist() == [0.299, 0.587, 0.114]
    expected = [[0.299, 0.587, 0.114], [0.5959, -0.2746, -0.3213], [0.2115, -0.5227, 0.3112]]
    assert np.abs(color.YIQ_MATRICES["ntsc"] - expected).max() < 5e-5

    # Find I and Q as multiples of R - Y and B - Y: the scales of the standard, turned by 33 degrees.
    (i_red, _, i_blue), (q_red, _, q_blue) = color.YIQ_MATRICES["ntsc"][1:]
    (i_v, q_v), (i_u, q_u) = np.linalg.solve([[0.701, -0.299], [-0.114, 0.886]], [[i_red, q_red], [i_blue, q_blue]])
    assert abs(math.hypot(i_u, q_u) - 0.492111) < 1e-6
    assert abs(math.hypot(i_v, q_v) - 0.877283) < 1e-6
    assert abs(math.degrees(math.atan2(q_v, i_v)) - 33) < 1e-9
    assert abs(math.degrees(math.atan2(-i_u, q_u)) - 33) < 1e-9


def test_the_fcc_matrix_is_that_of_colorsys() -> None:
    colors = every_kind()
    expected = np.array([colorsys.rgb_to_yiq(*row) for row in colors.tolist()])
    assert np.abs(color.rgb_to_yiq(colors, "fcc") - expected).max() < 1e-15
    back = np.array([colorsys.yiq_to_rgb(*row) for row in expected.tolist()])
    # colorsys types in its inverse, to some digits; ours is better.
    assert np.abs(color.yiq_to_rgb(expected, "fcc") - back).max() < 1e-12
    # Rounded to two digits, this matrix is not that of the slide: a row would no longer sum to 0.
    assert color.YIQ_MATRICES["fcc"].round(2).tolist()[2] == [0.21, -0.53, 0.31]


@pytest.mark.parametrize("matrix", list(color.YIQ_MATRICES))
def test_greys_have_neither_i_nor_q(matrix: str) -> None:
    greys = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    y, i, q = color.rgb_to_yiq(greys, matrix).T
    assert np.array_equal(y, np.arange(256) / 255)
    assert not i.any()
    assert not q.any()
    assert np.array_equal(color.yiq_to_rgb(np.stack([y, i, q], axis=-1), matrix), greys / 255)
    with pytest.raises(ValueError, match="read-only"):
        color.YIQ_MATRICES[matrix][0, 0] = 1.0


@given(st.tuples(unit, unit, unit), st.sampled_from(list(color.YIQ_MATRICES)))
@settings(max_examples=200, deadline=None)
def test_yiq_is_the_matrix_and_comes_back(rgb: tuple[float, float, float], matrix: str) -> None:
    yiq = color.rgb_to_yiq(rgb, matrix)
    exact = [sum(Fraction(m) * Fraction(v) for m, v in zip(row, rgb)) for row in color.YIQ_MATRICES[matrix].tolist()]
    assert max(abs(Fraction(a) - b) for a, b in zip(yiq.tolist(), exact)) < 1e-15
    assert np.abs(color.yiq_to_rgb(yiq, matrix) - rgb).max() < 1e-14


# How bright


def test_green_is_lighter_than_red_and_red_than_blue() -> None:
    bars = np.eye(3)
    for brightness in (color.luminance, color.luma_601, color.luma_709):
        red, green, blue = brightness(bars).tolist()
        assert green > red > blue
    assert len(set(color.intensity(bars).tolist())) == 1
    assert color.luminance(bars).round(12).tolist() == color.luma_709(bars).round(12).tolist() == [0.2126, 0.7152, 0.0722]
    assert color.luma_601(bars).round(12).tolist() == [0.299, 0.587, 0.114]


def test_the_slide_calls_three_things_the_average_and_one_of_them_is() -> None:
    orange = (1.0, 0.5, 0.0)
    assert color.intensity(orange) == color.rgb_to_hsi(orange)[2] == 0.5
    assert color.rgb_to_hsv(orange)[2] == 1.0
    assert color.rgb_to_hsl(orange)[2] == 0.5
    assert color.rgb_to_hsl((1.0, 0.5, 0.5))[2] == 0.75 != color.intensity((1.0, 0.5, 0.5))
    # Three times .333 darkens white; a mean does not.
    assert abs(255 * 3 * 0.333 - 254.745) < 1e-9
    assert color.intensity((255, 255, 255)) == 1.0


def test_value_is_the_distance_from_black_only() -> None:
    assert color.rgb_to_hsv([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0]])[:, 2].tolist() == [1, 1]


def test_no_matrix_leads_to_hsv() -> None:
    red, green = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.5, 0.0])
    assert not np.allclose(color.rgb_to_hsv(red + green), color.rgb_to_hsv(red) + color.rgb_to_hsv(green))
    assert np.allclose(color.rgb_to_yiq(red + green), color.rgb_to_yiq(red) + color.rgb_to_yiq(green))


def test_luminance_is_not_luma() -> None:
    grey = np.array([188, 188, 188], dtype=np.uint8)
    assert abs(color.luma_709(grey) - 188 / 255) < 1e-15
    assert abs(color.luminance(color.srgb_to_linear(grey)) - 0.5028864580325687) < 1e-12
    assert np.array_equal(color.rgb_to_yiq(every_kind())[:, 0], color.luma_601(every_kind()))
    light = color.srgb_to_linear(every_kind())
    assert np.abs(color.luminance(light) - color.linear_to_xyz(light)[:, 1]).max() < 5e-5


@pytest.mark.parametrize("brightness", [color.luminance, color.luma_601, color.luma_709, color.intensity])
def test_a_grey_is_as_bright_as_itself(brightness: Callable[[Array], Array]) -> None:
    greys = np.random.default_rng(3).random(1000)
    assert np.array_equal(brightness(np.repeat(greys[:, None], 3, axis=1)), greys)


# There and back, shapes and types


@given(st.sampled_from(list(MODELS)), st.tuples(unit, unit, unit))
@settings(max_examples=500, deadline=None)
def test_every_colour_comes_back(name: str, rgb: tuple[float, float, float]) -> None:
    there, back = MODELS[name]
    assert np.abs(back(there(rgb)) - rgb).max() < 1e-12


@pytest.mark.parametrize("name", MODELS)
def test_shapes_and_types(name: str) -> None:
    there, back = MODELS[name]
    codes = np.random.default_rng(5).integers(0, 256, (4, 5, 3)).astype(np.uint8)
    result = there(codes)
    assert result.shape == (4, 5, 3)
    assert result.dtype == back(result).dtype == np.float64
    assert np.array_equal(color.to_uint8(back(result)), codes)
    assert np.array_equal(there(codes / 255), result)
    assert np.array_equal(there(codes.astype(np.uint64)), result)
    assert np.array_equal(there(codes[::-1, ::2]), result[::-1, ::2])
    assert np.array_equal(there(codes[1, 2].tolist()), result[1, 2])
    assert np.array_equal(back(result[1, 2]), back(result)[1, 2])
    assert there(np.zeros((0, 3))).shape == back(np.zeros((2, 0, 3))[:, :, :])[0].shape == (0, 3)
    # What other conversions leave outside by rounding is taken, float32 and float16 too.
    assert np.array_equal(there((1.0 + 1e-15, -1e-15, np.float64(0.5))), there((1.0, 0.0, 0.5)))
    assert np.abs(there(np.float32([0.2, 0.5, 1.0000001])) - there((0.2, 0.5, 1.0))).max() < 1e-4
    assert there(np.float16([0.25, 0.5, 1.0])).tolist() == there((0.25, 0.5, 1.0)).tolist()


def test_integers_and_floats_go_by_type_and_never_by_value() -> None:
    assert color.rgb_to_hsv((1, 1, 1))[2] == 1 / 255
    assert color.rgb_to_hsv((1.0, 1.0, 1.0))[2] == 1.0
    assert color.to_uint8(np.array([-3.0, 0.5 / 255, 1.5 / 255, np.inf])).tolist() == [0, 0, 2, 255]


def test_color_and_homogeneous_are_public_and_found_on_first_use() -> None:
    code = "import sys; import scanspan as ss; early = 'scanspan.color' in sys.modules; ss.color.rgb_to_hsv((1, 2, 3)); "
    code += "ss.homogeneous.unit((1, 2, 3)); ss.color.grey_world([[1, 2, 3]]); print(early, 'numba' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.split() == ["False", "False"]
    assert {"color", "homogeneous"} <= set(dir(ss))
    assert all(hasattr(color, name) for name in color.__all__)


# Messages


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: color.rgb_to_hsv([[1, 2], [3]]), f"rgb = [[1, 2], [3]]: {TRIPLES}"),
        (lambda: color.rgb_to_hsv("red"), f"rgb has type <U3: {TRIPLES}"),
        (lambda: color.rgb_to_hsv([True, False, True]), f"rgb has type bool: {TRIPLES}"),
        (lambda: color.rgb_to_hsl(0.5), f"rgb has shape (): {TRIPLES}"),
        (lambda: color.rgb_to_hsi(np.zeros((3, 2))), f"rgb has shape (3, 2): {TRIPLES}"),
        (
            lambda: color.rgb_to_yiq(np.zeros((2, 2, 4))),
            f"rgb has shape (2, 2, 4): {TRIPLES}; leave the alpha out with rgb[..., :3]",
        ),
        (lambda: color.rgb_to_xyz([[0, 0, 0], [0, 256, 0]]), "rgb[1, 1] = 256: expected integers between 0 and 255"),
        (lambda: color.rgb_to_lab((0, 0, -1)), "rgb[2] = -1: expected integers between 0 and 255"),
        (
            lambda: color.luma_601((0.0, 1.1, 0.0)),
            f"rgb[1] = 1.1: {UNIT}; 0..255 needs an integer type",
        ),
        (lambda: color.luma_709((0.0, 0.0, -0.1)), f"rgb[2] = -0.1: {UNIT}"),
        (lambda: color.intensity((0.0, np.nan, 0.0)), f"rgb[1] = nan: {UNIT}"),
        (lambda: color.srgb_to_linear(2.0), f"rgb = 2.0: {UNIT}; 0..255 needs an integer type"),
        (lambda: color.srgb_to_linear([300]), "rgb[0] = 300: expected integers between 0 and 255"),
        (lambda: color.srgb_to_linear(None), "rgb has type object: expected numbers"),
        (lambda: color.linear_to_srgb([1, 2]), "linear has type int64: expected floats; integers are codes of encoded sRGB"),
        (lambda: color.linear_to_srgb(np.inf), "linear = inf: expected finite numbers, none beyond 1e+30"),
        (
            lambda: color.luminance((255, 0, 0)),
            "linear has type int64: expected floats; integers are codes of encoded sRGB: luminance(srgb_to_linear(rgb))",
        ),
        (lambda: color.luminance((0.0, 2e30, 0.0)), "linear[1] = 2e+30: expected finite numbers, none beyond 1e+30"),
        (
            lambda: color.linear_to_xyz((255, 0, 0)),
            "linear has type int64: expected floats; integers are codes of encoded sRGB: see rgb_to_xyz",
        ),
        (lambda: color.to_uint8([1, 2]), "rgb has type int64: expected floats; integers are codes already"),
        (lambda: color.to_uint8([np.nan]), "rgb holds NaN: expected numbers"),
        (
            lambda: color.hsv_to_rgb((0, 1, 1)),
            "hsv has type int64: expected floats; hue is in turns, saturation and value 0..1",
        ),
        (lambda: color.hsv_to_rgb((0.0, 1.5, 1.0)), f"saturation of hsv = 1.5: {UNIT}"),
        (lambda: color.hsl_to_rgb([[0.0, 1.0, -1.0]]), f"lightness of hsl[0] = -1.0: {UNIT}"),
        (lambda: color.hsi_to_rgb((np.nan, 1.0, 1.0)), "hue of hsi = nan: expected finite numbers, none beyond 1e+30"),
        (lambda: color.yiq_to_rgb((0, 0, 0)), "yiq has type int64: expected floats; Y is 0..1"),
        (
            lambda: color.rgb_to_yiq((0, 0, 0), "slides"),
            "unknown matrix 'slides'; did you mean 'slide'? The valid ones are: ntsc, fcc, slide",
        ),
        (lambda: color.yiq_to_rgb((0.0, 0.0, 0.0), 3), "unknown matrix 3; the valid ones are: ntsc, fcc, slide"),
        (lambda: color.xyz_to_linear((1, 1, 1)), "xyz has type int64: expected floats; white has Y = 1.0"),
        (lambda: color.xyz_to_rgb((1, 1, 1)), "xyz has type int64: expected floats; white has Y = 1.0"),
        (lambda: color.xyz_to_lab((1, 1, 1)), "xyz has type int64: expected floats; white has Y = 1.0"),
        (lambda: color.lab_to_xyz((50, 0, 2_000_000)), "lab[2] = 2000000: expected finite numbers, none beyond 1e+06"),
        (lambda: color.lab_to_rgb("lab"), f"lab has type <U3: {TRIPLES}"),
        (
            lambda: color.xyz_to_lab((1.0, 1.0, 1.0), (0.5, 0.5)),
            "white = (0.5, 0.5): expected X and Z above a millionth of Y",
        ),
        (lambda: color.white_xyz((0.3, 0.0)), "white = (0.3, 0.0): expected (x, y) or (X, Y, Z), none negative, y above 0"),
        (lambda: color.white_xyz((0.9, 0.5)), "white = (0.9, 0.5): expected (x, y) or (X, Y, Z), none negative, y above 0"),
        (lambda: color.white_xyz((1, 1, 1, 1)), "white = (1, 1, 1, 1): expected (x, y) or (X, Y, Z), none negative, y above 0"),
        (lambda: color.white_xyz("D65"), "white = 'D65': expected numbers of shape (N,), not type <U3"),
        (
            lambda: color.primaries_matrix([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]], color.D65),
            "primaries = [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]]: expected three that do not lie on a line",
        ),
        (
            lambda: color.primaries_matrix([[1e7, 0], [0, 1], [0, 0]], color.D65),
            "primaries = [[10000000.0, 0], [0, 1], [0, 0]]: expected chromaticities (x, y)",
        ),
    ],
)
def test_what_cannot_be_used_is_quoted(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ss.InputError, match=f"^{re.escape(message)}$"):
        call()
