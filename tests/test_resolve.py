"""Resolving: constants that stay exact, backgrounds, partial coverage in linear light, both blends, and every error message."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from scanspan.color.transfer import linear_from_srgb
from scanspan.errors import InputError
from scanspan.shade.color import LINEAR_FROM_SRGB8, THRESHOLDS
from scanspan.target import resolve as module
from scanspan.target.resolve import DEFAULT_BACKGROUND, background, resolve

Array = npt.NDArray[Any]

EVERY_CODE = np.stack([np.arange(256), np.arange(256)[::-1], (np.arange(256) * 7) % 256, np.full(256, 255)], axis=-1).astype(
    np.uint8
)


def accumulate(colors: Array, samples: int) -> Array:
    """Add up equal samples of opaque colours, one after the other, as shading does."""
    light = np.concatenate([LINEAR_FROM_SRGB8[colors[..., :3]], np.ones((*colors.shape[:-1], 1), np.float32)], axis=-1)
    total = np.zeros(light.shape, dtype=np.float32)
    for _ in range(samples):
        total += light
    return total


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 7, 8, 16])
@pytest.mark.parametrize("spec", [None, "transparent", "red", ("white", "transparent")])
def test_every_colour_that_fills_its_pixel_comes_back_exactly(samples: int, spec: Any) -> None:
    pixels = resolve(accumulate(EVERY_CODE.reshape(16, 16, 4), samples), samples, background(spec, (16, 16)))
    assert np.array_equal(pixels.reshape(-1, 4), EVERY_CODE)


@pytest.mark.parametrize("samples", [1, 4, 16])
@pytest.mark.parametrize("blend", ["linear", "srgb"])
def test_every_background_colour_comes_back_exactly_where_nothing_is_drawn(samples: int, blend: str) -> None:
    nothing = np.zeros((2, 3, 4), dtype=np.float32)
    for color in EVERY_CODE:
        pixels = resolve(nothing, samples, background(tuple(color.tolist()), (3, 2), blend), blend)
        assert (pixels == color).all()


def test_alpha_of_a_background_comes_back() -> None:
    pixels = resolve(
        np.zeros((1, 256, 4), np.float32), 4, np.stack([background((9, 8, 7, a), (1, 1))[0, 0] for a in range(256)])[None]
    )
    assert np.array_equal(pixels[0, :, 3], np.arange(256))
    assert (pixels[..., :3] == (9, 8, 7)).all()


def test_half_a_pixel_of_white_over_black_is_half_the_light() -> None:
    half = np.full((1, 1, 4), 2.0, dtype=np.float32)
    assert resolve(half, 4, background("black", (1, 1))).tolist() == [[[188, 188, 188, 255]]]
    assert resolve(half, 4, background("black", (1, 1), "srgb"), "srgb").tolist() == [[[128, 128, 128, 255]]]


def test_over_nothing_the_colour_stays_and_the_alpha_tells_the_coverage() -> None:
    light = LINEAR_FROM_SRGB8[[200, 100, 50]]
    for covered in range(1, 17):
        sums = np.append(light * covered, covered).astype(np.float32).reshape(1, 1, 4)
        pixel = resolve(sums, 16, background("transparent", (1, 1)))[0, 0].tolist()
        assert pixel == [200, 100, 50, int(covered / 16 * 255 + 0.5)]


def test_pixels_are_those_of_porter_and_duff(rng: np.random.Generator) -> None:
    alpha = rng.random((8, 9, 1))
    sums = (np.concatenate([rng.random((8, 9, 3)) * alpha, alpha], axis=2) * 4).astype(np.float32)
    behind = rng.random((8, 9, 4)).astype(np.float32)
    over = sums.astype(float) / 4 + np.concatenate([behind[..., :3] * behind[..., 3:], behind[..., 3:]], axis=2) * (1 - alpha)
    codes = np.searchsorted(THRESHOLDS, over[..., :3] / over[..., 3:], side="right")
    pixels = resolve(sums, 4, behind).astype(int)
    assert np.abs(pixels[..., :3] - codes).max() <= 1
    assert (pixels[..., :3] != codes).mean() < 0.01
    assert np.abs(pixels[..., 3] - over[..., 3] * 255).max() < 0.501


def test_a_gradient_goes_from_the_one_colour_to_the_other() -> None:
    pixels = resolve(np.zeros((64, 3, 4), np.float32), 1, background(("#ff0000", (0, 0, 255)), (3, 64)))
    assert pixels[0, 0].tolist() == [255, 0, 0, 255]
    assert pixels[-1, 2].tolist() == [0, 0, 255, 255]
    assert (np.diff(pixels[:, 0, 2].astype(int)) >= 4).all()
    assert (pixels == pixels[:, :1]).all()
    assert background(("red", "blue"), (3, 1)).shape == (1, 1, 4)


def test_a_gradient_into_nothing_keeps_its_colour() -> None:
    rows = background(("red", "transparent"), (4, 11))
    assert np.array_equal(rows[:-1, 0, :3], np.tile([1, 0, 0], (10, 1)))
    assert np.allclose(rows[:, 0, 3], np.linspace(1, 0, 11))


def test_the_default_is_a_soft_gradient_from_light_above() -> None:
    pixels = resolve(np.zeros((480, 1, 4), np.float32), 1, background(None, (1, 480)))
    assert tuple(pixels[0, 0, :3]) == DEFAULT_BACKGROUND[0]
    assert tuple(pixels[-1, 0, :3]) == DEFAULT_BACKGROUND[1]
    assert np.abs(np.diff(pixels.astype(int), axis=0)).max() <= 1


@pytest.mark.parametrize("shape", [(1, 1), (4, 1), (1, 5), (4, 5)])
def test_a_background_may_be_constant_along_either_side(shape: tuple[int, int], rng: np.random.Generator) -> None:
    sums, behind = rng.random((4, 5, 4)).astype(np.float32), rng.random((*shape, 4)).astype(np.float32)
    sums[::2, ::2] = 0
    full = np.ascontiguousarray(np.broadcast_to(behind, (4, 5, 4)))
    assert np.array_equal(resolve(sums, 1, behind), resolve(sums, 1, full))


def test_values_that_are_none_stay_in_range() -> None:
    sums = np.array([[[np.nan, np.inf, -1, 1], [5, 5, 5, 9], [0, 0, 0, np.nan]]], dtype=np.float32)
    pixels = resolve(sums, 1, background("red", (3, 1)))
    assert pixels[0, 0].tolist() == [0, 255, 0, 255]
    assert pixels[0, 1].tolist() == [255, 255, 255, 255]
    assert pixels[0, 2].tolist() == [255, 0, 0, 255]


def test_the_srgb_blend_takes_srgb_values() -> None:
    values = np.array([[[0.25, 0.5, 1.0, 1.0]]], dtype=np.float32)
    assert resolve(values, 1, background("red", (1, 1), "srgb"), "srgb").tolist() == [[[64, 128, 255, 255]]]
    assert background((0.25, 0.5, 1.0), (1, 1), "srgb")[0, 0].tolist() == [0.25, 0.5, 1, 1]
    assert background((0.25, 0.5, 1.0), (1, 1))[0, 0, 1] == np.float32(linear_from_srgb(0.5))


def test_the_kernels_do_the_same_uncompiled(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    sums, behind = rng.random((5, 6, 4)).astype(np.float32), rng.random((5, 1, 4)).astype(np.float32)
    sums[::2] = 0
    expected = [resolve(sums, 2, behind, blend) for blend in ("linear", "srgb")]
    for name in ("resolve_rows", "encode_channel"):
        monkeypatch.setattr(module, name, getattr(module, name).py_func)
    for blend, pixels in zip(("linear", "srgb"), expected, strict=True):
        assert np.array_equal(resolve(sums, 2, behind, blend), pixels)


SUMS = np.zeros((2, 3, 4), dtype=np.float32)
BEHIND = np.zeros((1, 1, 4), dtype=np.float32)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: background("redd", (3, 2)),
         "'redd' is no colour; did you mean 'red'? expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
        (lambda: background(("red", None), (3, 2)),
         "None is no colour: expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
        (lambda: background(7, (3, 2)), "7 is no colour: expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
        (lambda: background("red", (3, 2), "gamma"), "unknown blend 'gamma'; the valid ones are: linear, srgb"),
        (lambda: resolve(SUMS, 1, BEHIND, "lin"),
         "unknown blend 'lin'; did you mean 'linear'? The valid ones are: linear, srgb"),
        (lambda: resolve(SUMS, 0, BEHIND), "samples = 0: expected a whole number above 0"),
        (lambda: resolve(SUMS, True, BEHIND), "samples = True: expected a whole number above 0"),
        (lambda: resolve(SUMS, 1.0, BEHIND), "samples = 1.0: expected a whole number above 0"),
        (lambda: resolve(SUMS[..., :3], 1, BEHIND),
         "accumulated has shape (2, 3, 3) and type float32: expected floats of shape (H, W, 4)"),
        (lambda: resolve(SUMS, 1, np.zeros((3, 3, 4))),
         "background has shape (3, 3, 4) and type float64: expected floats of (2, 3, 4)"),
        (lambda: resolve(SUMS, 1, np.zeros((1, 1, 4), int)),
         "background has shape (1, 1, 4) and type int64: expected floats of (2, 3, 4)"),
    ],
)  # fmt: skip
def test_messages(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        make()
