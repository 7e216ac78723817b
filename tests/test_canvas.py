"""The canvas: what is painted lies over what was there, each pixel once, in the same colours by every algorithm."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scanspan as ss
from tests.painting import BLENDS, FILLS, HALF_WHITE, ONCE, PAINTERS, gray, laid_over, random_triangles

# Order and colours


def test_what_comes_later_lies_over_what_was_there(rng: np.random.Generator) -> None:
    size = (40, 30)
    triangles = random_triangles(rng, 60, size)
    colors = rng.integers(0, 256, (60, 3), dtype=np.uint8)
    expected = np.full((30, 40, 4), 255, np.uint8)
    for triangle, color in zip(triangles, colors):
        expected[ss.count([triangle], size) > 0] = (*color, 255)
    for algorithm in PAINTERS:
        canvas = ss.Canvas(*size)
        canvas.triangles(triangles, colors, algorithm=algorithm)
        assert np.array_equal(canvas.pixels, expected)


@pytest.mark.parametrize("blend", BLENDS)
def test_all_algorithms_blend_to_the_same_pixels(blend: str, rng: np.random.Generator) -> None:
    triangles = random_triangles(rng, 40, (31, 27))
    colors = rng.integers(0, 256, (40, 4), dtype=np.uint8)
    pictures = []
    for algorithm in PAINTERS:
        canvas = ss.Canvas(31, 27, "teal", blend=blend)
        canvas.triangles(triangles, colors, algorithm=algorithm)
        pictures.append(canvas.pixels)
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)

    # One after the other, or all at once.
    canvas = ss.Canvas(31, 27, "teal", blend=blend)
    for triangle, color in zip(triangles, colors):
        canvas.triangles([triangle], color)
    assert np.array_equal(canvas.pixels, pictures[0])


@pytest.mark.parametrize("alpha", [255, 90])
def test_any_number_of_threads_gives_the_same_pixels(alpha: int, rng: np.random.Generator) -> None:
    size = (640, 480)
    triangles = random_triangles(rng, 400, size)
    colors = np.concatenate([rng.integers(0, 256, (400, 3)), np.full((400, 1), alpha)], axis=1)
    star = [(320 + 300 * np.sin(4 * np.pi * k / 5), 240 - 230 * np.cos(4 * np.pi * k / 5)) for k in range(5)]
    pictures = []
    for threads in (1, 2, 7):
        canvas = ss.Canvas(*size, threads=threads)
        canvas.triangles(triangles, colors)
        canvas.polygon(star, (10, 20, 30, alpha))
        pictures.append(canvas.pixels)
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_every_colour_arrives_as_it_is(rng: np.random.Generator) -> None:
    colors = rng.integers(0, 256, (64, 3), dtype=np.uint8)
    colors[:4] = [(0, 0, 0), (255, 255, 255), (0, 0, 128), (255, 0, 127)]
    squares = [[(k, 0), (k + 1, 0), (k, 1)] for k in range(64)] + [[(k + 1, 0), (k + 1, 1), (k, 1)] for k in range(64)]
    for algorithm in PAINTERS:
        canvas = ss.Canvas(64, 1, "pink")
        canvas.triangles(squares, np.concatenate([colors, colors]), algorithm=algorithm)
        assert np.array_equal(canvas.pixels[0, :, :3], colors)


@pytest.mark.parametrize(
    ("color", "code"),
    [
        ("tomato", (255, 99, 71, 255)),
        ("#0f08", (0, 255, 0, 136)),
        ("rgb(1, 2, 3)", (1, 2, 3, 255)),
        ("transparent", (0, 0, 0, 0)),
        ((1, 2, 3), (1, 2, 3, 255)),
        ((1, 2, 3, 4), (1, 2, 3, 4)),
        ((1.0, 0.0, 0.5), (255, 0, 128, 255)),
        (np.array([0.2, 0.4, 0.6, 0.8], np.float32), (51, 102, 153, 204)),
        (np.array([7, 8, 9], np.uint8), (7, 8, 9, 255)),
        ([1, 1, 1], (1, 1, 1, 255)),
        ([1.0, 1, 1], (255, 255, 255, 255)),
    ],
)
def test_colours_by_type_and_never_by_value(color: Any, code: tuple[int, ...]) -> None:
    assert ss.Canvas(1, 1, color).pixels.tolist() == [[list(code)]]
    whole = [[(0, 0), (4, 0), (0, 4)]]
    for count in (1, 3, 4):
        canvas = ss.Canvas(1, 1, (0, 0, 0, 0))
        canvas.triangles(whole * count, color)
        assert canvas.pixels[0, 0, 3] >= code[3]
        if code[3] == 255:
            assert canvas.pixels.tolist() == [[list(code)]]


@pytest.mark.parametrize(
    "colors",
    [
        [(255, 0, 0), (0, 0, 255)],
        [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)],
        [(255, 0, 0, 255), (0, 0, 255, 255)],
        np.array([(1, 0, 0, 1), (0, 0, 1, 1)], np.float64),
        np.array([(255, 0, 0), (0, 0, 255)], np.uint16),
    ],
)
def test_a_colour_for_each(colors: Any) -> None:
    canvas = ss.Canvas(2, 3)
    canvas.triangles([[(0, 0), (2, 0), (0, 2)], [(1, 0), (2, 0), (1, 2)]], colors)
    canvas.lines([[(0, 1), (0, 1)], [(1, 1), (1, 1)]], colors)
    canvas.points([(0.5, 2.5), (1.5, 2.5)], colors)
    assert canvas.pixels.tolist() == [[[255, 0, 0, 255], [0, 0, 255, 255]]] * 3


# Blending


@pytest.mark.parametrize(("blend", "mixed"), [("linear", 188), ("srgb", 128)])
def test_half_white_over_black(blend: str, mixed: int) -> None:
    canvas = ss.Canvas(6, 5, "black", blend=blend)
    canvas.triangles([[(0, 0), (12, 0), (0, 10)]], HALF_WHITE)
    assert (canvas.pixels == (mixed, mixed, mixed, 255)).all()


def test_light_is_blended_by_default() -> None:
    canvas = ss.Canvas(1, 1, "black")
    canvas.points([(0.5, 0.5)], HALF_WHITE)
    assert canvas.pixels[0, 0].tolist() == [188, 188, 188, 255]


@pytest.mark.parametrize("blend", BLENDS)
def test_over_is_that_of_porter_and_duff(blend: str, rng: np.random.Generator) -> None:
    canvas = ss.Canvas(64, 64, blend=blend)
    canvas.pixels[:] = rng.integers(0, 256, canvas.pixels.shape)
    canvas.pixels[:8, :, 3], canvas.pixels[8:16, :, 3] = 0, 255
    for color in [*rng.integers(0, 256, (30, 4)).tolist(), [9, 200, 60, 1], [9, 200, 60, 254], [9, 200, 60, 0]]:
        before = canvas.pixels.copy()
        canvas.triangles([[(0, 0), (128, 0), (0, 128)]], color)
        assert np.abs(canvas.pixels - laid_over(color, before, blend)).max() <= 0.502


@pytest.mark.parametrize("blend", BLENDS)
def test_a_colour_over_itself_and_nothing_over_a_colour_change_nothing(blend: str) -> None:
    codes = np.arange(256)
    for alpha in (0, 1, 100, 254):
        canvas = ss.Canvas(256, 1, blend=blend)
        canvas.pixels[0, :, :3] = codes[:, None]
        segments = np.stack([np.stack([codes, codes * 0], axis=1)] * 2, axis=1)
        canvas.lines(segments, np.stack([codes, codes, codes, codes * 0 + alpha], axis=1))
        assert np.array_equal(canvas.pixels[0, :, 0], codes)
        assert (canvas.pixels[..., 3] == 255).all()


@pytest.mark.parametrize("blend", BLENDS)
def test_on_a_transparent_ground_the_colour_is_kept_whole(blend: str) -> None:
    canvas = ss.Canvas(2, 1, "transparent", blend=blend)
    canvas.points([(0.5, 0.5)], (200, 100, 50, 60))
    assert canvas.pixels[0].tolist() == [[200, 100, 50, 60], [0, 0, 0, 0]]

    # Twice the same colour makes it denser and no other: 1 - (1 - 60/255)^2.
    canvas.points([(0.5, 0.5)], (200, 100, 50, 60))
    assert canvas.pixels[0, 0].tolist() == [200, 100, 50, 106]
    canvas.points([(1.5, 0.5)], (7, 7, 7, 0))
    assert canvas.pixels[0, 1].tolist() == [0, 0, 0, 0]


# Lines and points


@pytest.mark.parametrize("algorithm", ["midpoint", "dda", "symmetric", "diamond-exit"])
@pytest.mark.parametrize("blend", BLENDS)
def test_a_translucent_line_touches_each_pixel_once(blend: str, algorithm: str, rng: np.random.Generator) -> None:
    for ends in rng.integers(0, 20, (20, 2, 2)) + 0.5:
        canvas = ss.Canvas(20, 20, "black", blend=blend)
        canvas.lines([ends], HALF_WHITE, algorithm=algorithm)
        length = np.abs(ends[1] - ends[0]).max() + (algorithm != "diamond-exit")
        assert (gray(canvas) == ONCE[blend]).sum() == np.count_nonzero(gray(canvas)) == length


def test_lines_go_from_pixel_to_pixel_and_by_default_do_not_step_on_a_tie() -> None:
    canvas = ss.Canvas(4, 3, "black")
    canvas.lines([[(0.9, 0.2), (2.1, 1.99)]], "white")
    assert np.argwhere(gray(canvas)).tolist() == [[0, 0], [0, 1], [1, 2]]
    canvas = ss.Canvas(4, 3, "black")
    canvas.lines([[(0, 0), (2, 1)]], "white", algorithm="dda")
    assert np.argwhere(gray(canvas)).tolist() == [[0, 0], [1, 1], [1, 2]]
    canvas = ss.Canvas(4, 3, "black")
    canvas.lines([[(-0.5, 1), (-0.1, 1)]], "white")  # pixel -1, and not pixel 0
    assert not gray(canvas).any()


@pytest.mark.parametrize("closed", [False, True])
def test_a_polyline_paints_its_corners_once(closed: bool) -> None:
    points = [(2.5, 2.5), (14.5, 4.5), (12.5, 15.5), (3.5, 11.5)]
    canvas = ss.Canvas(18, 18, "black", blend="srgb")
    canvas.polyline(points, HALF_WHITE, closed=closed)
    assert set(np.unique(gray(canvas))) == {0, 128}
    assert (gray(canvas) == 128).sum() == 12 + 11 + 9 + (9 if closed else 0)
    assert (gray(canvas)[11, 3] == 128) == closed
    if closed:
        again = ss.Canvas(18, 18, "black", blend="srgb")
        again.polyline([*points, points[0]], HALF_WHITE)
        assert np.array_equal(again.pixels, canvas.pixels)
        again.polyline([*points, points[0]], "black", closed=True)
        assert not gray(again).any()


def test_a_point_is_one_pixel_wherever_it_lies(rng: np.random.Generator) -> None:
    places = np.concatenate([np.arange(512) / 512 + 3, rng.uniform(3, 4, 200), [3.0, 3.5, 4.0]])
    for axis in (0, 1):
        for place in places:
            xy = np.array([5.25, 5.25])
            xy[axis] = place
            canvas = ss.Canvas(9, 9, "black", blend="srgb", threads=1)
            canvas.points([xy], HALF_WHITE)
            (found,) = np.argwhere(gray(canvas))
            assert gray(canvas)[tuple(found)] == 128
            # Its centre lies within half a pixel, to a sub-pixel.
            assert np.abs(found[::-1] + 0.5 - xy).max() <= 0.5 + 1 / 256


@pytest.mark.parametrize("size", [0.25, 1, 2, 3.5, 9])
def test_squares_hold_the_centres_in_them(size: float, rng: np.random.Generator) -> None:
    for x, y in rng.integers(0, 20 * 256, (20, 2)) / 256:
        canvas = ss.Canvas(20, 20, "black", blend="srgb")
        canvas.points([(x, y)], HALF_WHITE, size=size)
        centre = np.arange(20) + 0.5
        column = (x - size / 2 <= centre) & (centre < x + size / 2)
        row = (y - size / 2 <= centre) & (centre < y + size / 2)
        assert np.array_equal(gray(canvas), np.where(np.outer(row, column), 128, 0))


@pytest.mark.parametrize("size", [0.3, 1.0, 2.5, 7, 31])
def test_discs_are_round_and_touch_each_pixel_once(size: float, rng: np.random.Generator) -> None:
    for x, y in rng.uniform(0, 40, (20, 2)):
        canvas = ss.Canvas(40, 40, "black", blend="srgb")
        canvas.points([(x, y)], HALF_WHITE, size=size, shape="disc")
        assert set(np.unique(gray(canvas))) <= {0, 128}
        distance = np.hypot(np.arange(40) + 0.5 - x, (np.arange(40) + 0.5 - y)[:, None]) - size / 2
        assert (gray(canvas)[distance < -0.03] == 128).all()
        assert (gray(canvas)[distance > 0.01] == 0).all()


# In place, empty, and out again


def test_an_array_is_painted_in_place() -> None:
    pixels = np.zeros((4, 5, 4), np.uint8)
    canvas = ss.Canvas.from_array(pixels, blend="srgb", threads=1)
    assert canvas.pixels is pixels
    assert (canvas.size, canvas.blend, canvas.threads) == ((5, 4), "srgb", 1)
    canvas.polygon([(0, 0), (5, 0), (5, 4), (0, 4)], "red")
    assert (pixels == (255, 0, 0, 255)).all()
    canvas.triangles([[(0, 0), (10, 0), (0, 10)]], (0, 0, 255, 128))
    assert (pixels == (127, 0, 128, 255)).all()


def test_an_array_may_lie_anywhere_in_memory(rng: np.random.Generator) -> None:
    pictures = []
    for offset in range(4):
        memory = np.zeros(9 * 8 * 4 + offset, np.uint8)
        pixels = memory[offset:].reshape(8, 9, 4)
        canvas = ss.Canvas.from_array(pixels)
        canvas.triangles([[(0, 0), (9, 1), (2, 8)]], "red")
        canvas.polygon([(1, 1), (8, 3), (2, 7)], "blue", algorithm="parity")
        canvas.lines([[(0, 7), (8, 0)]], (0, 255, 0, 90))
        canvas.flood_fill(8, 7, "yellow")
        pictures.append(pixels.tolist())
    assert all(picture == pictures[0] for picture in pictures)


def test_pixels_may_be_written_at_any_time() -> None:
    canvas = ss.Canvas(3, 2)
    canvas.pixels[0] = 0
    canvas.points([(0.5, 0.5)], "red")
    assert canvas.pixels[0].tolist() == [[255, 0, 0, 255], [0, 0, 0, 0], [0, 0, 0, 0]]


def test_nothing_draws_nothing() -> None:
    canvas = ss.Canvas(4, 3)
    for algorithm in PAINTERS:
        for color in ("red", (255, 0, 0, 9)):
            canvas.triangles([], color, algorithm=algorithm)
            canvas.triangles(np.empty((0, 3, 2)), color, algorithm=algorithm)
    canvas.triangles(np.empty((0, 3, 2)), np.empty((0, 3)))
    empty: list[Any] = [[], [[]], [(1, 1)], [(1, 1), (3, 2)], np.empty((0, 2)), [[(0, 0), (3, 3), (0, 0)]]]
    for fill in FILLS:
        for color in ("red", (255, 0, 0, 9)):
            for rings in empty:
                canvas.polygon(rings, color, algorithm=fill)
    canvas.lines([], "red")
    canvas.lines(np.empty((0, 2, 2)), "red", algorithm="diamond-exit")
    canvas.points([], "red")
    canvas.points(np.empty((0, 2)), "red", shape="disc")
    canvas.polyline([], "red")
    canvas.polyline([(1, 1)], "red")
    canvas.polyline([(1.5, 1.5)], "red", closed=True)
    canvas.triangles([[(1, 1), (3, 3), (2, 2)]], "red")
    canvas.triangles([[(np.nan, 1), (3, 3), (2, 9)]], "red", nonfinite="drop")
    assert (canvas.pixels == 255).all()


@pytest.mark.parametrize("ending", ["png", "ppm", "npy", "jpg"])
def test_a_saved_canvas_is_what_was_painted(ending: str, tmp_path: Path) -> None:
    canvas = ss.Canvas(16, 8, "navy")
    path = tmp_path / f"picture.{ending}"
    if ending in ("png", "npy"):
        canvas.polygon([(1, 1), (14, 2), (7, 7)], (250, 100, 0, 200))
        canvas.pixels[0, 0] = (1, 2, 3, 4)
    canvas.save(path)
    found = np.load(path) if ending == "npy" else np.asarray(Image.open(path))
    if ending == "jpg":
        assert found.shape == (8, 16, 3)
        assert np.abs(found.astype(int) - canvas.pixels[..., :3]).max() < 8
    else:
        assert np.array_equal(found, canvas.pixels[..., : found.shape[2]])
        assert found.shape[2] == (3 if ending == "ppm" else 4)
    with pytest.raises(ss.InputError, match="bmp"):
        canvas.save(tmp_path / "picture.bmp")


def test_a_notebook_shows_it_and_its_size() -> None:
    canvas = ss.Canvas(5, 3, "red")
    assert repr(canvas) == "Canvas(5, 3)"
    assert canvas.size == (5, 3)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(canvas._repr_png_())).convert("RGBA")), canvas.pixels)


# Compiled and not

SCENE = """
import json
import numpy as np
import scanspan as ss
rng = np.random.default_rng(3)
pictures = []
for blend in ("linear", "srgb"):
    for alpha in (255, 77):
        canvas = ss.Canvas(13, 11, (9, 90, 200, 130), blend=blend, threads=1)
        colors = np.concatenate([rng.integers(0, 256, (3, 3)), np.full((3, 1), alpha)], axis=1)
        for algorithm in ("half-space", "homogeneous", "edge-walk", "warnock", "micropolygon"):
            canvas.triangles(rng.uniform(-3, 15, (3, 3, 2)), colors, algorithm=algorithm)
        for rule in ("even-odd", "non-zero", "positive", "negative", "abs-geq-two"):
            for algorithm in ("scanline", "parity"):
                canvas.polygon(rng.uniform(-3, 15, (6, 2)), colors[0], fill_rule=rule, algorithm=algorithm)
        canvas.polygon(rng.uniform(-1, 1, (6, 2)) * 2.0**24, colors[1], algorithm="parity", subpixel_bits=16)
        canvas.polyline(rng.uniform(-3, 15, (5, 2)), colors[2], closed=True)
        canvas.points(rng.uniform(0, 12, (3, 2)), colors, size=2.5, shape="disc")
        canvas.flood_fill(6, 5, colors[1], tolerance=60, connectivity=8)
        pictures.append(canvas.pixels.tolist())
print(json.dumps(pictures))
"""


def test_plain_python_paints_what_the_compiled_kernels_paint() -> None:
    pictures = []
    for environment in ({}, {"NUMBA_DISABLE_JIT": "1"}):
        run = subprocess.run(
            [sys.executable, "-W", "error", "-c", SCENE],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr[-2000:]
        pictures.append(json.loads(run.stdout))
    assert pictures[0] == pictures[1]
