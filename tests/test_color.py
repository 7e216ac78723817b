"""Colours: reading them, the sRGB tables against exact decimals, encoding, and every error message."""

from __future__ import annotations

import re
from decimal import Decimal, getcontext
from typing import Any

import numpy as np
import pytest

from scanspan.errors import InputError
from scanspan.shade import color
from scanspan.shade.srgb import encode_values

EXPECTED = "expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"


def exact_light(code: Decimal) -> Decimal:
    """Return the light of an sRGB value 0..1 to fifty digits."""
    getcontext().prec = 50
    if code <= Decimal("0.04045"):
        return code / Decimal("12.92")
    return ((code + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4")


def nearest(value: Decimal, number: np.float32) -> bool:
    """Say whether a float32 is the one nearest to an exact value."""
    distances = [abs(Decimal(float(np.nextafter(number, np.float32(end)))) - value) for end in (-1, 2)]
    return abs(Decimal(float(number)) - value) <= min(distances)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("red", (1, 0, 0, 1)), (" Tomato ", (1, 99 / 255, 71 / 255, 1)), ("#f00", (1, 0, 0, 1)),
        ("#ff000080", (1, 0, 0, 128 / 255)),
        ("rgb(255, 0, 51)", (1, 0, 0.2, 1)), ("transparent", (0, 0, 0, 0)), ("rgba(0, 0, 0, 51)", (0, 0, 0, 0.2)),
        ((255, 0, 51), (1, 0, 0.2, 1)), ([1, 1, 1], (1 / 255, 1 / 255, 1 / 255, 1)), ((1.0, 1.0, 1.0), (1, 1, 1, 1)),
        ((0.25, 0.5, 0.75, 0.5), (0.25, 0.5, 0.75, 0.5)), (np.array([255, 0, 0, 51], dtype=np.uint8), (1, 0, 0, 0.2)),
    ],
)  # fmt: skip
def test_colours_are_read_by_their_type(value: Any, expected: tuple[float, ...]) -> None:
    assert color.parse_color(value).tolist() == list(expected)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("redd", f"'redd' is no colour; did you mean 'red'? {EXPECTED}"),
        ("#12", f"'#12' is no colour: {EXPECTED}"),
        ("", f"'' is no colour: {EXPECTED}"),
        (None, f"None is no colour: {EXPECTED}"),
        (True, f"True is no colour: {EXPECTED}"),
        (0.5, f"0.5 is no colour: {EXPECTED}"),
        ((True, False, True), f"(True, False, True) is no colour: {EXPECTED}"),
        ((1, 2), f"(1, 2) is no colour: {EXPECTED}"),
        (((1, 2), 3, 4), f"((1, 2), 3, 4) is no colour: {EXPECTED}"),
        (("1", "2", "3"), f"('1', '2', '3') is no colour: {EXPECTED}"),
        ((1, 2, 300), "colour = (1, 2, 300): expected integers between 0 and 255"),
        ((1, 2, -1), "colour = (1, 2, -1): expected integers between 0 and 255"),
        ((255.0, 0, 0), "colour = (255.0, 0.0, 0.0): expected floats between 0 and 1"),
        ((0.5, 0.5, float("nan")), "colour = (0.5, 0.5, nan): expected floats between 0 and 1"),
        ("rgb(300, 0, 0)", "colour = (300, 0, 0): expected integers between 0 and 255"),
    ],
)
def test_what_is_no_colour_is_quoted(value: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        color.parse_color(value)


def test_many_colours_become_floats_with_alpha() -> None:
    floats = color.to_float_colors(np.array([[0, 51, 255]], dtype=np.uint8))
    assert floats.dtype == np.float32
    assert floats.tolist() == [[0, np.float32(0.2), 1, 1]]
    assert color.to_float_colors([[0.25, 0.5, 1.0, 0.5]]).tolist() == [[0.25, 0.5, 1, 0.5]]
    assert color.to_float_colors(np.zeros((0, 3))).shape == (0, 4)


def test_colours_of_either_type_are_the_same_light() -> None:
    codes = np.random.default_rng(1).integers(0, 256, (50, 4)).astype(np.uint8)
    for k in (3, 4):
        light = color.linear_colors(codes[:, :k])
        assert np.abs(light - color.linear_colors(codes[:, :k] / 255.0)).max() < 1e-6
        assert np.array_equal(light[:, :3], color.LINEAR_FROM_SRGB8[codes[:, :3]])
        assert np.array_equal(color.encode_srgb(light[:, :3]), codes[:, :3])


@pytest.mark.parametrize(
    ("colors", "message"),
    [
        ([1, 2, 3], "colors has shape (3,) and type int64: expected numbers of shape (N, 3) or (N, 4)"),
        (np.zeros((2, 5)), "colors has shape (2, 5) and type float64: expected numbers of shape (N, 3) or (N, 4)"),
        (np.zeros((2, 3), dtype=bool), "colors has shape (2, 3) and type bool: expected numbers of shape (N, 3) or (N, 4)"),
        ([[0.0, 0, 0], [0, 1.5, 0]], "colors[1] = (0.0, 1.5, 0.0): expected floats between 0 and 1"),
    ],
)
def test_many_bad_colours_are_quoted(colors: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        color.to_float_colors(colors)


def test_the_light_of_every_code_is_the_nearest_float32() -> None:
    assert all(nearest(exact_light(Decimal(i) / 255), color.LINEAR_FROM_SRGB8[i]) for i in range(256))


def test_the_thresholds_are_the_first_float32_past_the_half_codes() -> None:
    for i in range(255):
        exact, number = exact_light((Decimal(i) + Decimal("0.5")) / 255), color.THRESHOLDS[i]
        assert Decimal(float(number)) >= exact > Decimal(float(np.nextafter(number, np.float32(-1))))
    assert np.isinf(color.THRESHOLDS[255])


def test_light_of_any_float_is_exact_to_sixteen_digits() -> None:
    values = np.concatenate([np.linspace(0, 1, 401), [0.04045, np.nextafter(0.04045, 1)]])
    light = color.linear_from_srgb(values)
    worst = max(abs(Decimal(float(y)) - exact_light(Decimal(float(x)))) for x, y in zip(values, light, strict=True))
    assert worst < Decimal("1e-15")
    assert color.linear_from_srgb([-1, 2]).tolist() == [0, 1]


def test_every_code_comes_back() -> None:
    codes = np.arange(256, dtype=np.uint8)
    assert np.array_equal(color.encode_srgb(color.linear_from_srgb8(codes)), codes)
    assert np.array_equal(color.encode_srgb(color.linear_from_srgb(codes / 255.0)), codes)


def test_encoding_rounds_exactly_on_either_side_of_every_threshold() -> None:
    thresholds = color.THRESHOLDS[:255]
    assert np.array_equal(color.encode_srgb(thresholds), np.arange(1, 256))
    assert np.array_equal(color.encode_srgb(np.nextafter(thresholds, np.float32(-1))), np.arange(255))


def test_a_bin_of_the_encoder_holds_one_threshold_at_most() -> None:
    assert np.diff(color.STARTS.astype(int)).max() == 1


def test_encoding_agrees_with_a_search_of_the_thresholds(rng: np.random.Generator) -> None:
    light = np.concatenate([rng.random(100_000), rng.random(10_000) ** 8]).astype(np.float32)
    assert np.array_equal(color.encode_srgb(light), np.searchsorted(color.THRESHOLDS, light, side="right"))


def test_what_is_outside_is_clamped() -> None:
    assert color.encode_srgb([np.nan, -np.inf, -1, -0.0, 2, np.inf]).tolist() == [0, 0, 0, 0, 255, 255]
    assert color.encode_srgb(np.zeros((2, 0, 3))).shape == (2, 0, 3)
    assert color.encode_srgb(np.full((2, 3), 0.5)[:, ::2]).tolist() == [[188, 188], [188, 188]]


def test_the_encoder_does_the_same_uncompiled(rng: np.random.Generator) -> None:
    light = np.concatenate([rng.random(200), [0, 1, 2, -1]]).astype(np.float32)
    codes, slow = np.empty((2, len(light)), dtype=np.uint8)
    encode_values(light, color.THRESHOLDS, color.STARTS, codes)
    encode_values.py_func(light, color.THRESHOLDS, color.STARTS, slow)  # type: ignore[attr-defined]
    assert np.array_equal(codes, slow)


def test_linear_color_is_the_light_of_a_name() -> None:
    assert color.linear_color("#00ff80").tolist() == [0, 1, color.LINEAR_FROM_SRGB8[128], 1]
    assert color.linear_color("transparent").tolist() == [0, 0, 0, 0]
