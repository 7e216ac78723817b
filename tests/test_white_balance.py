"""White balance: grey comes out of coloured light, grey stays, published matrices, exact sums, and every message."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanspan import color
from scanspan.errors import InputError

Array = npt.NDArray[Any]

GUESSES: dict[str, Callable[..., Array]] = {
    "grey world": color.grey_world,
    "white patch": color.white_patch,
    "white patch 99": lambda image, **options: color.white_patch(image, percentile=99, **options),
    "shades of grey": color.shades_of_grey,
}
ADAPTATIONS = {"von-kries": color.von_kries, "bradford": color.bradford}


@pytest.fixture
def scene(rng: np.random.Generator) -> Array:
    """Return the linear light of a scene, (20, 30, 3), whose colours are grey in every mean, with a grey card at its corner."""
    third = rng.random((20, 10, 3)) * 0.8
    third[0, 0] = 0.4
    return np.concatenate([third, third[..., [1, 2, 0]], third[..., [2, 0, 1]]], axis=1)


@pytest.mark.parametrize("name", GUESSES)
def test_a_neutral_picture_stays_as_it_is(name: str, scene: Array) -> None:
    codes = color.to_uint8(color.linear_to_srgb(scene))
    assert np.array_equal(GUESSES[name](scene), scene)
    assert np.array_equal(GUESSES[name](codes), codes)
    assert np.abs(GUESSES[name](codes / 255, encoding="srgb") - codes / 255).max() < 1e-15


@pytest.mark.parametrize("name", GUESSES)
def test_grey_comes_out_of_coloured_light(name: str, scene: Array) -> None:
    light = np.array([1.0, 0.7, 0.35])
    balanced = GUESSES[name](scene * light)
    # All comes back but for one factor, which leaves the luminance of a grey as it was under that light.
    assert np.abs(balanced - scene * color.luminance(light)).max() < 1e-14
    assert np.ptp(balanced[0, 0]) < 1e-15

    codes = color.to_uint8(color.linear_to_srgb(scene * light))
    assert np.ptp(GUESSES[name](codes)[0, 0].astype(int)) <= 2


@pytest.mark.parametrize("name", GUESSES)
def test_exposure_makes_no_difference(name: str, scene: Array) -> None:
    tinted = scene * (1.0, 0.7, 0.35)
    assert np.array_equal(GUESSES[name](tinted * 0.25), GUESSES[name](tinted) * 0.25)


@pytest.mark.parametrize("name", GUESSES)
def test_the_order_of_the_pixels_makes_no_difference(name: str, rng: np.random.Generator) -> None:
    image = rng.random((70_000, 3)) * (1.0, 0.5, 0.2)
    order = rng.permutation(len(image))
    assert np.array_equal(GUESSES[name](image[order]), GUESSES[name](image)[order])
    assert np.array_equal(GUESSES[name](np.asfortranarray(image)), GUESSES[name](image))


def test_the_mean_of_the_grey_world_is_the_exact_one(rng: np.random.Generator) -> None:
    image = rng.random((501, 3)) * (1.0, 1e-3, 1e-6)
    means = np.array([float(sum(map(Fraction, channel)) / 501) for channel in image.T.tolist()])
    assert np.allclose(color.grey_world(image), image * (color.luminance(means) / means), rtol=1e-15, atol=0)


@pytest.mark.parametrize("p", [1, 2, 6, 7, 100, 1000, 6.0, np.int64(3)])
def test_shades_of_grey_is_a_minkowski_mean(p: float, rng: np.random.Generator) -> None:
    image = rng.random((400, 3)) * (0.9, 0.6, 0.3)
    found = np.array(
        [(np.mean((channel / channel.max()) ** float(p))) ** (1 / float(p)) * channel.max() for channel in image.T]
    )
    expected = image * (color.luminance(found) / found)
    assert np.allclose(color.shades_of_grey(image, p=p), expected, rtol=1e-13, atol=0)


def test_shades_of_grey_runs_from_grey_world_to_white_patch(rng: np.random.Generator) -> None:
    image = rng.random((20, 20, 3)) * (0.9, 0.6, 0.3)
    assert np.array_equal(color.shades_of_grey(image, p=1), color.grey_world(image))
    assert np.array_equal(color.shades_of_grey(image, p=math.inf), color.white_patch(image))
    assert np.array_equal(color.shades_of_grey(image), color.shades_of_grey(image, p=6))


def test_a_percentile_does_not_heed_one_shining_pixel(scene: Array) -> None:
    tinted = scene * (1.0, 0.7, 0.35)
    shining = tinted.copy()
    shining[5, 5] = (1.0, 1.0, 50.0)
    assert np.ptp(color.white_patch(shining)[0, 0]) > 0.1
    assert np.ptp(color.white_patch(shining, percentile=99)[0, 0]) < 0.02
    # Of 200 values, 99.5 percent are at or below the last but one.
    ladder = np.stack([np.arange(1.0, 201), 2 * np.arange(1.0, 201), np.arange(1.0, 201)], axis=-1)
    ladder[-1] = (1000, 1000, 1000)
    assert np.ptp(color.white_patch(ladder, percentile=99.5)[0]) < 1e-15


@pytest.mark.parametrize("name", GUESSES)
def test_black_and_nothing_are_left_alone(name: str) -> None:
    assert GUESSES[name](np.zeros((4, 4, 3), dtype=np.uint8)).tolist() == np.zeros((4, 4, 3)).tolist()
    assert GUESSES[name](np.zeros((0, 4, 3))).shape == (0, 4, 3)
    # One percent of light is beyond the 99th percentile of the other 200 pixels.
    spark = np.zeros((201, 3))
    spark[7] = (0.5, 0.5, 0.5)
    assert np.array_equal(GUESSES[name](spark), spark)


def test_what_comes_out_is_what_went_in(scene: Array) -> None:
    codes = color.to_uint8(color.linear_to_srgb(scene * (1.0, 0.7, 0.35)))
    for balance in (*GUESSES.values(), lambda image, **options: color.bradford(image, color.A, color.D65, **options)):
        encoded = balance(codes)
        assert encoded.dtype == np.uint8
        assert np.array_equal(balance(codes.astype(np.int32)), encoded)
        assert np.array_equal(balance(codes, encoding="srgb"), encoded)
        assert np.array_equal(balance(codes.tolist()), encoded)
        floats = balance(codes / 255, encoding="srgb")
        assert floats.dtype == np.float64
        assert floats.max() <= 1.0
        assert np.array_equal(color.to_uint8(floats), encoded)
        linear = balance(color.srgb_to_linear(codes))
        assert np.array_equal(balance(color.srgb_to_linear(codes), encoding="linear"), linear)
        assert np.abs(np.clip(color.linear_to_srgb(linear), 0, 1) - floats).max() < 1e-14
    # Codes that are scaled as if they were light give another picture.
    assert np.abs(color.grey_world(codes / 255) - color.grey_world(codes / 255, encoding="srgb")).max() > 0.01


def test_the_argument_is_left_alone(scene: Array) -> None:
    before = scene.copy()
    for result in (color.grey_world(scene), color.bradford(scene, color.D65, color.D65), color.grey_world(np.zeros((1, 1, 3)))):
        result += 1.0
    assert np.array_equal(scene, before)


# Adaptation


def test_matrices_are_the_published_ones() -> None:
    css = [
        [1.0479297925449969, 0.022946870601609652, -0.05019226628920524],
        [0.02962780877005599, 0.9904344267538799, -0.017073799063418826],
        [-0.009243040646204504, 0.015055191490298152, 0.7518742814281371],
    ]
    assert np.abs(color.adaptation_matrix(color.D65, color.D50) - css).max() < 1e-14
    d65, d50, a = (0.95047, 1, 1.08883), (0.96422, 1, 0.82521), (1.09850, 1, 0.35585)
    lindbloom = [[1.0478112, 0.0228866, -0.0501270], [0.0295424, 0.9904844, -0.0170491], [-0.0092345, 0.0150436, 0.7521316]]
    assert np.abs(color.adaptation_matrix(d65, d50) - lindbloom).max() < 1e-7
    lindbloom = [[1.0160803, 0.0552297, -0.0521326], [0.0060666, 0.9955661, -0.0012235], [0.0, 0.0, 0.7578869]]
    assert np.abs(color.adaptation_matrix(d65, d50, "von-kries") - lindbloom).max() < 1e-7
    lindbloom = [[0.8446965, -0.1179225, 0.3948108], [-0.1366303, 1.1041226, 0.1291718], [0.0798489, -0.1348999, 3.1924009]]
    assert np.abs(color.adaptation_matrix(a, d65) - lindbloom).max() < 2e-6


whites = st.sampled_from([color.A, color.C, color.D50, color.D65, color.E, (0.28, 0.35), (0.4, 0.3)])


@given(whites, whites, st.sampled_from(list(ADAPTATIONS)))
@settings(max_examples=100, deadline=None)
def test_a_white_leads_to_a_white_and_back(source: Any, target: Any, method: str) -> None:
    there, back = color.adaptation_matrix(source, target, method), color.adaptation_matrix(target, source, method)
    assert np.abs(there.dot(color.white_xyz(source)) - color.white_xyz(target)).max() < 1e-14
    assert np.abs(there.dot(back) - np.eye(3)).max() < 1e-14
    if source == target:
        assert np.array_equal(there, np.eye(3))


@pytest.mark.parametrize("method", ADAPTATIONS)
def test_a_card_under_a_lamp_becomes_grey(method: str, scene: Array) -> None:
    adapt = ADAPTATIONS[method]
    card = color.xyz_to_linear(0.4 * color.white_xyz(color.A))
    assert card[2] < 0.13 < 0.9 * card[0]
    assert np.abs(adapt(card, color.A, color.D65) - 0.4).max() < 1e-14
    # The pixel itself may say what the white is, dark or bright.
    assert np.abs(adapt(card, color.linear_to_xyz(card), color.D65) - 0.4).max() < 1e-14

    # There and back is where it was, and equal whites change nothing.
    assert np.abs(adapt(adapt(scene, color.A, color.D65), color.D65, color.A) - scene).max() < 1e-13
    assert np.array_equal(adapt(scene, color.A, color.A), scene)
    codes = np.random.default_rng(6).integers(0, 256, (9, 9, 3)).astype(np.uint8)
    assert np.array_equal(adapt(codes, color.D50, color.D50), codes)


def test_bradford_is_not_von_kries(scene: Array) -> None:
    ways = [adapt(scene, color.A, color.D65) for adapt in ADAPTATIONS.values()]
    assert np.abs(ways[0] - ways[1]).max() > 0.05
    assert ways[0].min() < 0.0


# Messages

ENCODINGS, METHODS = "The valid ones are: linear, srgb", "valid ones are: bradford, von-kries"
NO_WHITE = "expected (x, y) or (X, Y, Z), none negative, y above 0"


@pytest.mark.parametrize("name", GUESSES)
@pytest.mark.parametrize(
    ("image", "options", "message"),
    [
        (np.zeros((2, 2)), {}, "image has shape (2, 2): expected numbers of shape (..., 3)"),
        (
            np.zeros((2, 2, 4)),
            {},
            "image has shape (2, 2, 4): expected numbers of shape (..., 3); leave the alpha out with image[..., :3]",
        ),
        ("photo.png", {}, "image has type <U9: expected numbers of shape (..., 3)"),
        ([[1, 2, 300]], {}, "image[0, 2] = 300: expected integers between 0 and 255"),
        ([[0.5, -0.25, 0.5]], {}, "image[0, 1] = -0.25: expected light of 0 or more"),
        ([[0.5, math.inf, 0.5]], {}, "image[0, 1] = inf: expected finite numbers, none beyond 1e+30"),
        (
            [[0.5, 200.0, 0.5]],
            {"encoding": "srgb"},
            "image[0, 1] = 200.0: expected floats between 0 and 1; 0..255 needs an integer type",
        ),
        ([[255, 0, 255]], {}, "image has no green light to scale: expected some in every channel, or black"),
        ([[0.5, 0.5, 1e-20]], {}, "image has no blue light to scale: expected some in every channel, or black"),
        (
            [[0.5, 0.5, 0.5]],
            {"encoding": "srbg"},
            f"unknown encoding 'srbg'; did you mean 'srgb'? {ENCODINGS}",
        ),
        ([[0.5, 0.5, 0.5]], {"encoding": 1}, "unknown encoding 1; the valid ones are: linear, srgb"),
        (
            [[1, 2, 3]],
            {"encoding": "linear"},
            "image has type int64, which is encoded sRGB: expected floats for encoding='linear'",
        ),
    ],
)
def test_a_picture_that_cannot_be_balanced_is_quoted(name: str, image: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        GUESSES[name](image, **options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda i: color.white_patch(i, percentile=0), "percentile = 0: expected a number above 0, at most 100"),
        (lambda i: color.white_patch(i, percentile=101), "percentile = 101: expected a number above 0, at most 100"),
        (lambda i: color.white_patch(i, percentile="99"), "percentile = '99': expected a number, not type <U2"),
        (lambda i: color.shades_of_grey(i, p=0), "p = 0: expected a whole number from 1 to 1000, or infinity"),
        (lambda i: color.shades_of_grey(i, p=2.5), "p = 2.5: expected a whole number from 1 to 1000, or infinity"),
        (lambda i: color.shades_of_grey(i, p=1001), "p = 1001: expected a whole number from 1 to 1000, or infinity"),
        (lambda i: color.shades_of_grey(i, p=math.nan), "p = nan: expected a finite number"),
        (lambda i: color.shades_of_grey(i, p=-math.inf), "p = -inf: expected a finite number"),
        (lambda i: color.bradford(i, (0, 0), color.D65), f"source_white = (0, 0): {NO_WHITE}"),
        (lambda i: color.bradford(i, (0, 0, 0), color.D65), f"source_white = (0, 0, 0): {NO_WHITE}"),
        (lambda i: color.von_kries(i, color.D65, (-0.1, 0.5)), f"target_white = (-0.1, 0.5): {NO_WHITE}"),
        (lambda i: color.von_kries(i, color.D65, (0.0, 1.0)), "target_white = (0.0, 1.0): too far from white to adapt to"),
        (lambda i: color.bradford(i, (0.7, 0.3), color.D65), "source_white = (0.7, 0.3): too far from white to adapt to"),
        (
            lambda i: color.bradford(i[..., :2], color.A, color.E),
            "image has shape (1, 2): expected numbers of shape (..., 3)",
        ),
        (
            lambda i: color.adaptation_matrix(color.A, color.D65, "bradfort"),
            "unknown method 'bradfort'; did you mean 'bradford'? The valid ones are: bradford, von-kries",
        ),
        (
            lambda i: color.adaptation_matrix(color.A, color.D65, None),
            f"unknown method None; the {METHODS}",
        ),
    ],
)
def test_an_option_that_cannot_be_used_is_quoted(call: Callable[[Array], object], message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        call(np.full((1, 3), 0.5))
