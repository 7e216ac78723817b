"""Triangles tested against depths on a canvas: against rationals, against `rasterize`, by every algorithm, and every error."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.target import depth_test
from tests.painting import random_triangles

ALGORITHMS = tuple(ss.ALGORITHMS)
SIZE = (61, 47)
RED, BLUE = (255, 0, 0), (0, 0, 255)
LEFT = [[(0, 0), (4, 0), (0, 4)]]


def scene(rng: np.random.Generator, count: int, size: tuple[int, int] = SIZE, share: float = 1.0) -> tuple[Any, Any, Any]:
    """Return triangles, colours and depths at their corners; some lie in planes that all of them share."""
    triangles = random_triangles(rng, count, size)
    triangles = triangles[:, :1] + (triangles - triangles[:, :1]) * share
    depths = rng.uniform(-1, 2, (count, 3))
    depths[::4] = 0.75
    return triangles, rng.integers(0, 256, (count, 3, 3)).astype(np.uint8), depths


def painted(
    triangles: Any, colors: Any, depths: Any, size: tuple[int, int] = SIZE, **options: Any
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the pixels and depths of a canvas."""
    canvas = ss.Canvas(*size, "teal", threads=options.pop("threads", 1))
    canvas.triangles(triangles, colors, depths=depths, **options)
    return canvas.pixels, canvas.depth


def exact_depth(triangle: Any, depths: Any, x: int, y: int) -> Fraction:
    """Return the depth of a triangle's plane at the centre of a pixel, in rationals, after snapping to 1/256 px."""
    (ax, ay), (bx, by), (cx, cy) = [[Fraction(int(v), 256) for v in np.rint(np.array(p) * 256.0)] for p in triangle]
    px, py = x + Fraction(1, 2), y + Fraction(1, 2)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    u = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area
    v = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area
    p, q, r = (Fraction(float(depth)) for depth in depths)
    return p + u * (q - p) + v * (r - p)


@pytest.mark.parametrize("algorithm", ["half-space", "span-list"])
def test_the_nearest_in_rationals_is_seen(algorithm: str, rng: np.random.Generator) -> None:
    size = (24, 18)
    triangles, colors, depths = scene(rng, 30, size)
    pixels, found = painted(triangles, colors, depths, size, algorithm=algorithm)
    nearest: dict[tuple[int, int], list[tuple[Fraction, int]]] = {}
    for n, triangle in enumerate(triangles):
        for y, x in np.argwhere(ss.count([triangle], size)).tolist():
            nearest.setdefault((y, x), []).append((exact_depth(triangle, depths[n], x, y), n))
    assert len(nearest) > 200
    for (y, x), layers in nearest.items():
        depth, n = max(layers, key=lambda layer: (layer[0], -layer[1]))
        assert found[y, x] == np.float32(float(depth)) or abs(found[y, x] - float(depth)) < 2e-7 * max(1, abs(depth))
        close = [m for other, m in layers if abs(other - depth) < Fraction(1, 10**6)]
        if close == [n] or all((depths[m] == 0.75).all() for m in close):
            alone = ss.Canvas(*size)
            alone.triangles(triangles[n : n + 1], colors[n : n + 1])
            assert (pixels[y, x] == alone.pixels[y, x]).all()
    untouched = np.ones(found.shape, bool)
    untouched[tuple(np.array(list(nearest)).T)] = False
    assert (found[untouched] == -np.inf).all()
    assert (pixels[untouched] == (0, 128, 128, 255)).all()


@pytest.mark.parametrize("share", [1.0, 0.1], ids=["large", "small"])
@pytest.mark.parametrize("channels", [3, 4])
def test_all_algorithms_and_threads_give_the_same_bits(channels: int, share: float, rng: np.random.Generator) -> None:
    triangles, colors, depths = scene(rng, 200, share=share)
    colors = np.concatenate([colors, np.full((200, 3, channels - 3), 255, np.uint8)], axis=2)
    pixels, depth = painted(triangles, colors, depths)
    assert (depth > -np.inf).sum() > 300
    for algorithm in ALGORITHMS:
        for threads in (1, 3):
            again = painted(triangles, colors, depths, algorithm=algorithm, threads=threads)
            assert np.array_equal(again[0], pixels), algorithm
            assert np.array_equal(again[1], depth), algorithm

    # One after the other, or all at once.
    canvas = ss.Canvas(*SIZE, "teal")
    for n in range(200):
        canvas.triangles(triangles[n : n + 1], colors[n : n + 1], depths=depths[n : n + 1])
    assert np.array_equal(canvas.pixels, pixels)
    assert np.array_equal(canvas.depth, depth)


@pytest.mark.parametrize("options", [{"rule": "bottom-left"}, {"cull": "back"}, {"subpixel_bits": 12}, {"rule": "inclusive"}],
                         ids=str)  # fmt: skip
def test_both_ways_of_half_space_give_the_same_bits(
    options: dict[str, Any], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    # So many that they are sorted by tiles, in no order, with samples on edges; of one vector across, of some, and wide ones.
    size, spread = (700, 800), rng.choice([1.5, 4.0, 12.0, 60.0], (6000, 1, 1), p=[0.3, 0.4, 0.25, 0.05])
    triangles = np.round((rng.random((6000, 1, 2)) * size + rng.normal(0, 1, (6000, 3, 2)) * spread) * 4) / 4
    colors, depths = rng.integers(0, 256, (6000, 3, 4)).astype(np.uint8), rng.integers(0, 9, (6000, 3)) / 8
    colors[..., 3] = 255
    pictures = []
    for large, sort, threads in ((1e9, 1e9, 1), (1e9, 1e9, 3), (1e9, 0.0, 1), (1e9, 0.0, 3), (0.0, 0.0, 1), (0.0, 0.0, 3)):
        monkeypatch.setattr(depth_test, "LARGE_BOX", large)
        monkeypatch.setattr(depth_test, "SORTED_BOX", sort)
        monkeypatch.setattr(depth_test, "CACHE_BYTES", 1 << 19)
        pictures.append(painted(triangles, colors, depths, size, threads=threads, **options))
    for pixels, depth in pictures[1:]:
        assert np.array_equal(pixels, pictures[0][0])
        assert np.array_equal(depth, pictures[0][1])
    assert (pictures[0][1] > -np.inf).mean() > 0.15


@pytest.mark.parametrize("share", [1.0, 0.1], ids=["large", "small"])
def test_depths_are_those_of_rasterize(share: float, rng: np.random.Generator) -> None:
    # In a picture whose sides are powers of two, grid and clip coordinates are the same numbers.
    size, count = (64, 32), 120
    triangles, _, _ = scene(rng, count, size, share)
    triangles, depths = np.rint(triangles * 256) / 256, rng.integers(1, 1024, (count, 3)) / 1024
    clip = np.concatenate([triangles / (32, -16) + (-1, 1), 1 - 2 * depths[..., None], np.ones((count, 3, 1))], axis=2)
    seen = ss.rasterize(clip.reshape(-1, 4), np.arange(3 * count).reshape(-1, 3), size)
    numbers = np.arange(count)
    colors = np.stack([numbers, numbers, numbers], axis=1).astype(np.uint8)
    pixels, depth = painted(triangles, colors, depths, size)
    assert np.array_equal(depth, seen.depth)
    inside = seen.primitive >= 0
    assert inside.sum() > 100
    assert np.array_equal(pixels[inside][:, 0], seen.primitive[inside])


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_of_equal_depths_the_first_stays(algorithm: str) -> None:
    canvas = ss.Canvas(4, 4, "black")
    canvas.triangles(LEFT * 2, [RED, BLUE], depths=[(0, 1, 0.5), (0, 1, 0.5)], algorithm=algorithm)
    canvas.triangles(LEFT, BLUE, depths=[(0, 1, 0.5)], algorithm=algorithm)
    assert canvas.pixels[0].tolist() == [[255, 0, 0, 255]] * 3 + [[0, 0, 0, 255]]
    canvas.triangles(LEFT, BLUE, depths=[(0, 1.001, 0.5)], algorithm=algorithm)
    assert canvas.pixels[0].tolist() == [[0, 0, 255, 255]] * 3 + [[0, 0, 0, 255]]


@pytest.mark.parametrize("algorithm", ["half-space", "warnock"])
def test_what_was_rendered_hides_what_is_painted_behind_it(algorithm: str) -> None:
    clip = [(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)]
    seen = ss.rasterize(clip, [(0, 1, 2)], size=(4, 4))
    pixels = np.zeros((4, 4, 4), np.uint8)
    canvas = ss.Canvas.from_array(pixels, seen.depth)
    canvas.triangles(LEFT * 2, [RED, BLUE], depths=[(0.4, 0.4, 0.4), (0.25, 0.75, 0.25)], algorithm=algorithm)
    assert canvas.depth is seen.depth
    assert canvas.pixels is pixels
    assert pixels[..., 2].tolist() == [[0, 0, 255, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]
    assert not pixels[..., 0].any()
    assert seen.depth[0].tolist() == [0.5, 0.5, 0.5625, 0.5]


@pytest.mark.parametrize("algorithm", ["half-space", "edge-walk"])
def test_a_depth_that_is_no_number_is_never_painted_over(algorithm: str) -> None:
    canvas = ss.Canvas(4, 4, "black")
    canvas.depth[0, 1] = np.nan
    canvas.triangles(LEFT, RED, depths=[(1, 1, 1)], algorithm=algorithm)
    assert canvas.pixels[0, :, 0].tolist() == [255, 0, 255, 0]
    assert np.isnan(canvas.depth[0, 1])


@pytest.mark.parametrize("size", [(9, 3), (16, 16), (8, 1), (1, 9), (70, 5)])
def test_nothing_beyond_the_picture_is_read_or_written(size: tuple[int, int], rng: np.random.Generator) -> None:
    width, height = size
    frame = (np.zeros((height + 40, width, 4), np.uint8), np.full((height + 40, width), np.nan, np.float32))
    frame[0][20:-20], frame[1][20:-20] = 7, -np.inf
    canvas = ss.Canvas.from_array(frame[0][20:-20], frame[1][20:-20])
    triangles, colors, depths = scene(rng, 300, size, 0.5)
    canvas.triangles(triangles, colors, depths=depths)
    alone = painted(triangles, colors, depths, size, algorithm="edge-walk")
    assert np.array_equal(canvas.depth, alone[1])
    inside = alone[1] > -np.inf
    assert inside.any()
    assert np.array_equal(canvas.pixels[inside], alone[0][inside])
    assert (canvas.pixels[~inside] == 7).all()
    for part in (slice(0, 20), slice(-20, None)):
        assert not frame[0][part].any()
        assert np.isnan(frame[1][part]).all()


def test_far_corners_and_long_slivers_are_tested_too(rng: np.random.Generator) -> None:
    triangles = rng.uniform(-1, 1, (40, 3, 2)) * np.array([60, 3e3, 2e7])[rng.integers(0, 3, (40, 1, 1))] % 2**24
    depths = rng.uniform(0, 1, (40, 3))
    colors = rng.integers(0, 256, (40, 3, 3)).astype(np.uint8)
    pictures = [painted(triangles, colors, depths, algorithm=name) for name in ("half-space", "span-list", "micropolygon")]
    for pixels, depth in pictures[1:]:
        assert np.array_equal(pixels, pictures[0][0])
        assert np.array_equal(depth, pictures[0][1])
    assert (pictures[0][1] > -np.inf).any()


def test_one_colour_colours_of_triangles_and_floats() -> None:
    for colors in ("red", RED, [RED], np.array([[1.0, 0.0, 0.0]]), np.array([[(1.0, 0.0, 0.0)] * 3]), [[(255, 0, 0, 255)] * 3]):
        pixels, depth = painted(LEFT, colors, [(1, 2, 3)], (4, 4))
        assert (pixels[depth > 0] == (255, 0, 0, 255)).all()
        assert (depth > 0).sum() == 6


def test_nothing_is_painted_of_nothing() -> None:
    pixels, depth = painted(np.empty((0, 3, 2)), "red", np.empty((0, 3)))
    assert (pixels == (0, 128, 128, 255)).all()
    assert (depth == -np.inf).all()


def test_triangles_with_corners_or_depths_that_are_no_numbers_are_dropped() -> None:
    triangles = LEFT * 4
    depths = np.array([(9, 9, np.nan), (0, 1, 2), (9, np.inf, 9), (8, 8, 8)])
    triangles = np.array(triangles, float)
    triangles[3, 1, 1] = np.nan
    pixels, depth = painted(triangles, [BLUE, RED, BLUE, BLUE], depths, (4, 4), nonfinite="drop")
    assert np.array_equal(depth, painted(LEFT, RED, [(0, 1, 2)], (4, 4))[1])
    assert (pixels[depth >= 0] == (255, 0, 0, 255)).all()


@pytest.mark.parametrize(
    ("colors", "depths", "options", "message"),
    [
        ("red", [(1, 2)], {}, "depths: expected shape (1, 3), one for each corner, got (1, 2)"),
        ("red", 1.0, {}, "depths: expected shape (1, 3), one for each corner, got ()"),
        ("red", [(1, 2, "x")], {}, "depths: expected an array of numbers, got dtype <U21, such as '1'"),
        ("red", [(1, np.nan, 2)], {}, "depths[0] = (1.0, nan, 2.0): expected finite numbers up to 1e+30"),
        ("red", [(1, 2, 3e30)], {"nonfinite": "drop"}, "depths[0] = (1.0, 2.0, 3e+30): expected finite numbers up to 1e+30"),
        ((255, 0, 0, 9), [(1, 2, 3)], {},
         "depths: a pixel shows one triangle or none, which does not go together with colors that let something through"),
        ("red", [(1, 2, 3)], {"antialias": True},
         "depths: a pixel shows one triangle or none, which does not go together with antialias = True"),
    ],
)  # fmt: skip
def test_what_cannot_be_tested(colors: Any, depths: Any, options: dict[str, Any], message: str) -> None:
    canvas = ss.Canvas(4, 4, "black")
    with pytest.raises(ss.InputError) as caught:
        canvas.triangles(LEFT, colors, depths=depths, **options)
    assert str(caught.value) == message
    assert not canvas.pixels[..., :3].any()
    assert (canvas.depth == -np.inf).all()


@pytest.mark.parametrize(
    ("depth", "told"),
    [
        (np.zeros((4, 4)), "float64 (4, 4)"),
        (np.zeros((4, 5), np.float32), "float32 (4, 5)"),
        (np.zeros((4, 8), np.float32)[:, ::2], "float32 (4, 4)"),
        ([[0.0]], "list"),
    ],
)
def test_what_cannot_be_painted_into(depth: Any, told: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.Canvas.from_array(np.zeros((4, 4, 4), np.uint8), depth)
    assert str(caught.value) == f"depth: expected a writable, contiguous (4, 4) array of float32 to paint into, got {told}"


def test_pixels_and_depths_in_the_same_memory() -> None:
    memory = np.zeros((4, 4, 4), np.uint8)
    with pytest.raises(ss.InputError) as caught:
        ss.Canvas.from_array(memory, memory.view(np.float32)[..., 0])
    assert str(caught.value) == "depth: expected memory of its own, got some that the pixels have, too"


def test_painting_with_colours_and_corners_that_the_canvas_has() -> None:
    size, count = (40, 30), 60
    own, other = ss.Canvas(*size), ss.Canvas(*size)
    for canvas in (own, other):
        canvas.pixels[..., :3] = np.random.default_rng(4).integers(0, 256, (*size[::-1], 3))
    corners = np.random.default_rng(5).uniform(0, 30, (count, 3, 2))
    corners[:, 1:] = corners[:, :1] + np.random.default_rng(6).uniform(-9, 9, (count, 2, 2))
    depths = np.random.default_rng(7).uniform(0, 1, (count, 3))
    shared = own.pixels.reshape(-1)[: count * 12].reshape(count, 3, 4)
    copied = shared.copy()
    own.triangles(corners, shared, depths=depths)
    other.triangles(corners, copied, depths=depths)
    assert np.array_equal(own.pixels, other.pixels)
    assert (own.depth > -np.inf).sum() > 200
