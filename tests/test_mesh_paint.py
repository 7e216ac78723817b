"""Many polygons in one call: in order, by every algorithm; antialiased, one over the other or without a seam."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import scanspan as ss
from tests.painting import BLENDS, FILL_RULES, FILLS, laid_over

SIZE = (21, 17)
HALVES = [[(0, 0), (0.5, 0), (0.5, 1), (0, 1)], [(0.5, 0), (2, 0), (2, 1), (0.5, 1)]]
AROUND = [(-9, -9), (40, -9), (40, 40), (-9, 40)]
seeds = st.integers(0, 2**32 - 1)
shifts = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


def partition(seed, shift, count=40):
    """Return triangles that tile a square which holds the canvas; their corners lie on the grid of areas."""
    inner = np.random.default_rng(seed).uniform(-9, 40, (count, 2))
    points = np.concatenate([inner, AROUND]) + np.array([shift] * count + [(0, 0)] * 4)
    points[:count] = np.clip(points[:count], -8.5, 39.5)
    points = np.rint(points * 65536) / 65536
    return points[Delaunay(points).simplices]


def painted(polygons, colors, background="black", size=SIZE, **options):
    canvas = ss.Canvas(*size, background, blend=options.pop("blend", "linear"), threads=options.pop("threads", 1))
    canvas.polygons(polygons, colors, **options)
    return canvas.pixels


@given(seeds, shifts)
def test_a_white_partition_of_black_is_white(seed, shift):
    assert (painted(partition(seed, shift), "white", antialias=True, overlap="disjoint") == 255).all()
    canvas = ss.Canvas(*SIZE, "black")
    canvas.triangles(partition(seed, shift), "white", antialias=True)
    assert (canvas.pixels == 255).all()


@given(seeds, shifts, st.tuples(*[st.integers(0, 255)] * 4), st.sampled_from(BLENDS))
def test_a_tiling_in_one_colour_is_the_shape_that_it_tiles(seed, shift, color, blend):
    options = {"antialias": True, "overlap": "disjoint", "blend": blend, "background": "tomato"}
    tiles, whole = painted(partition(seed, shift), color, **options), painted([AROUND], color, **options)
    assert np.array_equal(tiles, whole)
    canvas = ss.Canvas(*SIZE, "tomato", blend=blend)
    canvas.polygon(AROUND, color, antialias=True)
    assert np.abs(canvas.pixels.astype(int) - whole).max() <= 1


@given(seeds, shifts)
def test_half_transparent_tiles_are_one_shape_with_an_outline(seed, shift):
    # Here the outline of the whole lies within the canvas, and along no pixel.
    tiles = np.rint((partition(seed, shift) * 0.23 + (5.3, 4.6)) * 65536) / 65536
    whole = np.rint((np.array(AROUND) * 0.23 + (5.3, 4.6)) * 65536) / 65536
    options = {"antialias": True, "overlap": "disjoint", "background": "tomato"}
    color = (0.1, 0.8, 0.2, 0.5)
    assert np.array_equal(painted(tiles, color, **options), painted([whole], color, **options))


def test_the_seam_is_there_without_it():
    # Half white over half white lets a quarter of the black through.
    assert painted(HALVES, "white", size=(2, 1), antialias=True)[0, :, 0].tolist() == [225, 255]
    assert painted(HALVES, "white", size=(2, 1), antialias=True, overlap="disjoint")[0, :, 0].tolist() == [255, 255]


@pytest.mark.parametrize("blend", BLENDS)
def test_colours_are_added_in_light_and_their_order_is_nothing(blend, rng):
    options = {"antialias": True, "overlap": "disjoint", "blend": blend, "background": (3, 4, 5, 255)}
    tiles, colors = partition(5, (0.2, 0.7)), rng.integers(0, 256, (200, 4)).astype(np.uint8)[: len(partition(5, (0.2, 0.7)))]
    order = rng.permutation(len(tiles))
    found = painted(tiles, colors, **options)
    assert np.array_equal(found, painted(tiles[order], colors[order], **options))
    assert np.array_equal(found, painted(tiles, colors, threads=3, **options))

    # Red and green, half and half, are the mean of their light, or of their values.
    pixels = painted(HALVES, [(255, 0, 0), (0, 255, 0)], size=(2, 1), **options)
    assert pixels[0, 0].tolist() == ([188, 188, 0, 255] if blend == "linear" else [128, 128, 0, 255])


def test_a_partly_covered_pixel_is_blended_with_what_lies_below():
    for blend in BLENDS:
        canvas = ss.Canvas(1, 1, (9, 90, 200, 77), blend=blend)
        before = canvas.pixels[0, 0].copy()
        canvas.polygons([[(0, 0), (0.25, 0), (0.25, 1), (0, 1)], [(0.25, 0), (0.5, 0), (0.5, 1), (0.25, 1)]],
                        (200, 30, 60, 102), antialias=True, overlap="disjoint")  # fmt: skip
        assert np.abs(laid_over((200, 30, 60, 51), before, blend) - canvas.pixels[0, 0]).max() < 0.6


def test_what_overlaps_after_all_is_averaged_and_never_too_much():
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    pixels = painted([square] * 300, "white", size=(1, 1), antialias=True, overlap="disjoint")
    assert pixels[0, 0].tolist() == [255, 255, 255, 255]
    colors = [(255, 0, 0), (0, 0, 255)]
    both = painted([square, square], colors, size=(1, 1), antialias=True, overlap="disjoint")
    assert both[0, 0].tolist() == [188, 0, 188, 255]


@pytest.mark.parametrize("antialias", [False, True])
@pytest.mark.parametrize("rule", FILL_RULES)
def test_one_call_is_as_many_calls(antialias, rule, rng):
    polygons = [rng.uniform(-3, 24, (int(rng.integers(3, 9)), 2)) for _ in range(12)]
    polygons[4] = [polygons[4], polygons[5] * 0.5]
    polygons[7] = [(1, 1)]
    colors = rng.integers(0, 256, (12, 4)).astype(np.uint8)
    canvas = ss.Canvas(*SIZE, "teal")
    for polygon, color in zip(polygons, colors, strict=True):
        canvas.polygon(polygon, color, fill_rule=rule, antialias=antialias)
    for algorithm in FILLS:
        for threads in (1, 3):
            found = painted(polygons, colors, "teal", fill_rule=rule, antialias=antialias, algorithm=algorithm, threads=threads)
            assert np.array_equal(found, canvas.pixels)


def test_arrays_of_polygons_and_one_colour_for_all(rng):
    squares = rng.uniform(0, 20, (9, 1, 2)) + np.array([(0, 0), (3, 0), (3, 3), (0, 3)])
    assert np.array_equal(painted(squares, "red"), painted([square.tolist() for square in squares], "red"))
    assert np.array_equal(painted(squares[:, :2], "red"), painted([], "red"))
    assert not painted(np.empty((0, 4, 2)), [])[..., :3].any()


def test_a_large_picture_is_painted_in_bands(rng):
    size = (700, 500)
    tiles = partition(9, (0.1, 0.3), 300) * 20 + (60, 90)
    colors = rng.integers(0, 256, (len(tiles), 3)).astype(np.uint8)
    for overlap in ("over", "disjoint"):
        pictures = [painted(tiles, colors, size=size, antialias=True, overlap=overlap, threads=n) for n in (1, 2, 5)]
        assert np.array_equal(pictures[0], pictures[1])
        assert np.array_equal(pictures[0], pictures[2])


def test_antialiased_triangles_are_culled_and_laid_over_each_other():
    front, back = [(0, 0), (0, 4), (4, 0)], [(0, 0), (4, 0), (0, 4)]
    for cull, seen in (("none", 2), ("back", 1), ("front", 1)):
        canvas = ss.Canvas(4, 4, "black", blend="srgb")
        canvas.triangles([front, back], (1.0, 1.0, 1.0, 0.5), antialias=True, cull=cull, overlap="over")
        assert canvas.pixels[0, 0, 0] == {1: 128, 2: 192}[seen]
    canvas = ss.Canvas(4, 4, "black")
    canvas.triangles([front, back], [(255, 0, 0), (0, 0, 255)], antialias=True, cull="back")
    assert canvas.pixels[0, 0].tolist() == [255, 0, 0, 255]


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((3, "red"), {}, "polygons: expected a list of polygons, got int"),
        (([3], "red"), {}, "polygons[0]: rings: expected one ring, (M, 2) points, or a list of rings"),
        (([*HALVES, [(0, 0), (1, np.inf), (1, 1)]], "red"), {},
         "polygons[2]: rings[1] = [1.0, inf]: expected finite numbers within 16777216 pixels"),
        ((np.full((2, 3, 2), np.nan), "red"), {},
         "polygons[0] = [[nan, nan], [nan, nan], [nan, nan]]: expected finite numbers within 16777216 pixels"),
        ((np.zeros((2, 3, 3)), "red"), {}, "polygons: expected numbers of shape (N, 3, 2), got float64 (2, 3, 3)"),
        ((HALVES, [(1, 2, 3)] * 3), {}, "colors: expected shape (4,) or (N, 4) with N = 2, got (3, 3)"),
        ((HALVES, "red"), {"overlap": "none"}, "unknown overlap 'none'; the valid ones are: over, disjoint"),
        ((HALVES, "red"), {"fill_rule": "odd"}, None),
        ((HALVES, "red"), {"algorithm": "span"}, None),
        ((HALVES, "red"), {"antialias": 1}, "antialias = 1: must be True or False"),
    ],
    ids=str,
)  # fmt: skip
def test_errors_quote_what_came_and_paint_nothing(arguments, options, message):
    canvas = ss.Canvas(4, 3)
    with pytest.raises(ss.InputError) as caught:
        canvas.polygons(*arguments, **options)
    assert message is None or str(caught.value).lower() == message.lower()
    assert (canvas.pixels == 255).all()
