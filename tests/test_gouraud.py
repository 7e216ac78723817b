"""Gouraud on a canvas: against rationals, by every algorithm, opaque and translucent, and every error."""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from tests.painting import BLENDS, PAINTERS, laid_over, random_triangles

SIZE = (24, 18)
CLOSE = Fraction(1, 10**9)


def exact_shade(triangle, colors, x, y, bits=8):
    """Return the channels of a triangle at the centre of a pixel, 0 to 255, in rationals."""
    (ax, ay), (bx, by), (cx, cy) = [[Fraction(int(v), 1 << bits) for v in np.rint(np.array(p) * 2.0**bits)] for p in triangle]
    px, py = x + Fraction(1, 2), y + Fraction(1, 2)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    u = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area
    v = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area
    corners = [
        [Fraction(float(c)) * (1 if np.asarray(colors).dtype.kind in "iu" else 255) for c in corner] for corner in colors
    ]
    return [p + u * (q - p) + v * (r - p) for p, q, r in zip(*corners, strict=True)]


def check_shades(triangle, colors, pixels, is_exact):
    """Compare the pixels of one triangle with rationals, rounded half up; return how many there were."""
    covered = ss.count([triangle], SIZE) > 0
    for y, x in np.argwhere(covered):
        for value, code in zip(exact_shade(triangle, colors, int(x), int(y)), pixels[y, x], strict=False):
            expected = min(max(floor(value + Fraction(1, 2)), 0), 255)
            is_tie = abs(value - floor(value) - Fraction(1, 2)) < CLOSE
            assert code == expected or (is_tie and not is_exact and abs(int(code) - expected) == 1), (x, y, float(value), code)
    return int(covered.sum())


@pytest.mark.parametrize("kind", ["integers", "floats"])
@pytest.mark.parametrize("channels", [3, 4])
def test_channels_are_the_rational_ones_rounded_half_up(kind, channels, rng):
    seen = 0
    for triangle in random_triangles(rng, 40, SIZE):
        colors = (
            rng.integers(0, 256, (3, channels)).astype(np.uint8) if kind == "integers" else rng.uniform(0, 1, (3, channels))
        )
        colors = np.concatenate(
            [colors[:, :3], np.full((3, channels - 3), 255 if kind == "integers" else 1.0, colors.dtype)], 1
        )
        canvas = ss.Canvas(*SIZE, "black")
        canvas.triangles([triangle], colors[None])
        seen += check_shades(triangle, colors, canvas.pixels, kind == "integers")
    assert seen > 1000


def test_ties_are_rounded_up():
    # At the centre of pixel x the red of this one is x + 1/2, exactly.
    canvas = ss.Canvas(16, 1, "black")
    canvas.triangles([[(0, -100), (64, -100), (0, 100)]], np.array([[(0, 0, 0), (64, 0, 0), (0, 0, 0)]], np.uint8))
    assert canvas.pixels[0, :, 0].tolist() == list(range(1, 17))


def test_a_wrong_shade_is_noticed(rng):
    triangle, colors = [(1, 1), (20, 3), (5, 17)], rng.integers(0, 256, (3, 3)).astype(np.uint8)
    canvas = ss.Canvas(*SIZE, "black")
    canvas.triangles([triangle], colors[None])
    with pytest.raises(AssertionError):
        check_shades(triangle, colors ^ 1, canvas.pixels, True)


@given(st.integers(0, 255), st.floats(0, 1), st.integers(3, 24))
def test_constant_channels_are_constant(code, share, power):
    triangle = [(-(2.0**power) / 3, -7.0), (2.0**power / 7, 3.3), (1.1, 2.0**power / 5)]
    canvas = ss.Canvas(6, 5, "black")
    canvas.triangles([triangle], np.array([[(code, 0, 255), (code, 9, 255), (code, 80, 255)]], np.uint8))
    inside = ss.count([triangle], (6, 5)) > 0
    assert (canvas.pixels[inside][:, [0, 2]] == (code, 255)).all()
    canvas.triangles([triangle], np.array([[(share, 0.0, 0.1), (share, 1.0, 0.1), (share, 0.5, 0.1)]]))
    assert (canvas.pixels[inside][:, [0, 2]] == (floor(share * 255.0 + 0.5), 26)).all()


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("channels", [3, 4])
def test_all_algorithms_and_threads_give_the_same_bits(blend, channels, rng):
    size = (61, 47)
    triangles = random_triangles(rng, 150, size)
    colors = rng.integers(0, 256, (150, 3, channels)).astype(np.uint8)
    pictures = []
    for algorithm in PAINTERS:
        for threads in (1, 3):
            canvas = ss.Canvas(*size, "teal", blend=blend, threads=threads)
            canvas.triangles(triangles, colors, algorithm=algorithm)
            pictures.append(canvas.pixels)
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)

    # One after the other, or all at once.
    canvas = ss.Canvas(*size, "teal", blend=blend)
    for triangle, color in zip(triangles, colors, strict=True):
        canvas.triangles([triangle], color[None])
    assert np.array_equal(canvas.pixels, pictures[0])


@pytest.mark.parametrize("threads", [1, 4])
def test_large_pictures_are_painted_in_bands(threads, rng):
    size = (800, 600)
    triangles, colors = random_triangles(rng, 60, size), rng.integers(0, 256, (60, 3, 4)).astype(np.uint8)
    canvas, other = ss.Canvas(*size, threads=threads), ss.Canvas(*size, threads=1)
    canvas.triangles(triangles, colors)
    for triangle, color in zip(triangles, colors, strict=True):
        other.triangles([triangle], color[None])
    assert np.array_equal(canvas.pixels, other.pixels)
    opaque = colors.copy()
    opaque[..., 3] = 255
    canvas.triangles(triangles, opaque)
    for triangle, color in zip(triangles, opaque, strict=True):
        other.triangles([triangle], color[None])
    assert np.array_equal(canvas.pixels, other.pixels)


def test_more_layers_than_a_list_has_room_for(rng):
    triangle, colors = [(0, 0), (9, 0), (0, 9)], rng.integers(0, 256, (50, 3, 4)).astype(np.uint8)
    canvas, other = ss.Canvas(6, 5), ss.Canvas(6, 5)
    canvas.triangles([triangle] * 50, colors)
    for color in colors:
        other.triangles([triangle], color[None])
    assert np.array_equal(canvas.pixels, other.pixels)


@pytest.mark.parametrize("blend", BLENDS)
def test_alpha_is_interpolated_and_blended(blend, rng):
    triangle, colors = [(-3, -2), (27, 1), (4, 22)], np.array([(255, 0, 0, 0), (0, 255, 0, 120), (9, 9, 255, 255)], np.uint8)
    canvas = ss.Canvas(*SIZE, "orchid", blend=blend)
    before = canvas.pixels.copy()
    canvas.triangles([triangle], colors[None])
    covered = ss.count([triangle], SIZE) > 0
    for y, x in np.argwhere(covered):
        shade = [floor(value + Fraction(1, 2)) for value in exact_shade(triangle, colors, int(x), int(y))]
        assert np.abs(laid_over(shade, before[y, x], blend) - canvas.pixels[y, x]).max() < 0.6
    assert np.array_equal(canvas.pixels[~covered], before[~covered])


def test_equal_corners_paint_what_a_flat_colour_paints(rng):
    triangles, colors = random_triangles(rng, 30, SIZE), rng.integers(0, 256, (30, 4)).astype(np.uint8)
    for codes in (colors, colors[:, :3]):
        flat, shaded = ss.Canvas(*SIZE), ss.Canvas(*SIZE)
        flat.triangles(triangles, codes)
        shaded.triangles(triangles, np.repeat(codes[:, None], 3, axis=1))
        assert np.array_equal(flat.pixels, shaded.pixels)


def test_far_corners_and_nothing_to_paint():
    canvas = ss.Canvas(*SIZE, "black")
    canvas.triangles([], np.zeros((0, 3, 3), np.uint8))
    canvas.triangles([[(100, 100), (120, 100), (100, 120)]], np.full((1, 3, 4), 9, np.uint8))
    canvas.triangles([[(-100, 1), (-120, 1), (-100, 9)]], np.full((1, 3, 3), 9, np.uint8))
    assert not canvas.pixels[..., :3].any()
    limit = float(1 << 24)
    canvas.triangles(
        [[(-limit, -limit), (limit, -limit), (0, limit)]], np.array([[(0, 0, 9), (255, 0, 9), (127, 0, 9)]], np.uint8)
    )
    assert np.abs(canvas.pixels[..., 0].astype(int) - 127).max() <= 1
    assert (canvas.pixels[..., 2] == 9).all()


@pytest.mark.parametrize(
    ("colors", "options", "message"),
    [
        (np.zeros((2, 3, 3)), {}, "colors: expected shape (1, 3, 3) or (1, 3, 4), got (2, 3, 3)"),
        (np.zeros((1, 2, 3)), {}, "colors: expected shape (1, 3, 3) or (1, 3, 4), got (1, 2, 3)"),
        (np.zeros((1, 3, 2)), {}, "colors: expected shape (1, 3, 3) or (1, 3, 4), got (1, 3, 2)"),
        (np.zeros((1, 3, 3), bool), {}, "colors: expected integers 0..255 or floats 0..1, got dtype bool"),
        ([[(0, 0, 0), (0, 256, 0), (0, 0, 0)]], {}, "colors[0, 1]: 256 is no colour value, integers are 0..255"),
        ([[(0, 0, 0), (0, 0, 0), (0, 0, 1.5)]], {}, "colors[0, 2]: 1.5 is no colour value, floats are 0..1"),
        ([[(0, 0, 0), (0, 0, 0), (0, 0, np.nan)]], {}, "colors[0, 2]: nan is no colour value, floats are 0..1"),
        (np.zeros((1, 3, 3)), {"antialias": True},
         "colors: one for each corner, and antialias = True: antialiased triangles have one colour each"),
    ],
)  # fmt: skip
def test_errors_quote_what_came(colors, options, message):
    canvas = ss.Canvas(4, 3)
    with pytest.raises(ss.InputError) as caught:
        canvas.triangles([[(0, 0), (4, 0), (0, 3)]], colors, **options)
    assert str(caught.value) == message
    assert (canvas.pixels == 255).all()


@pytest.mark.parametrize("point", [(5, 5, 1), (12, 30, 1), (15, 8, 1), (1, 0, 0)])
@pytest.mark.parametrize("alpha", [255, 128])
def test_an_off_screen_point_gives_shaded_triangles_the_pixels_of_flat_ones(point: Any, alpha: int) -> None:
    corners = np.array([[(10.5, 10.5), (20.5, 10.5), (10.5, 20.5)], [(10.5, 10.5), (10.5, 20.5), (2.5, 12.5)]])
    flat, shaded = ss.Canvas(30, 30), ss.Canvas(30, 30)
    flat.triangles(corners, (9, 9, 9, alpha), rule=ss.OffscreenPoint(*point))
    shaded.triangles(corners, np.array([[(9, 9, 9, alpha)] * 3] * 2, np.uint8), rule=ss.OffscreenPoint(*point))
    assert np.array_equal(flat.pixels, shaded.pixels)
