"""Keys written for blocks of triangles: the same bits as one triangle after the other, for every rule, grid and size of box."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from scanspan.geometry.clip import to_screen
from scanspan.geometry.project import screen_triangles
from scanspan.raster import algorithms, blocks, layers
from scanspan.raster.counters import COUNTERS
from scanspan.raster.half_space import half_space_keys
from scanspan.raster.options import make_sampling
from scanspan.raster.write import EMPTY_KEY
from scanspan.samples import sample_offsets

RULES = ("top-left", "bottom-left", "inclusive", "exclusive")


def soup(rng, count, size, extent, on_grid=False):
    """Triangles on the screen round random places, up to some pixels across, at random depths; some without area."""
    place = rng.uniform(-4, np.array(size) + 4, (count, 1, 2))
    corners = place + rng.uniform(-extent / 2, extent / 2, (count, 3, 2))
    corners = np.rint(corners * 2) / 2 if on_grid else corners
    corners[::17, 2] = corners[::17, 1]
    triangles = screen_triangles(corners, 8)
    return triangles._replace(depth=np.rint(rng.uniform(-1, 1, 3 * count) * 64) / 64 if on_grid else rng.random(3 * count))


def both(triangles, sampling, size, order=algorithms.NATURAL, chunk=1 << 16):
    """Keys as blocks write them, and as they are written one triangle after the other."""
    width, height = size
    found, expected = np.full((height, width), EMPTY_KEY), np.full((height, width), EMPTY_KEY)
    counters, count = np.zeros(COUNTERS, np.int64), len(triangles.corners)
    drawn = algorithms.with_outlines(triangles, sampling)
    half_space_keys(expected, counters, drawn, 0, count, sampling)
    for first in range(0, count, chunk):
        blocks.block_keys(found, counters, drawn, order, first, min(first + chunk, count), sampling)
    return found, expected


def sampling_for(size, offset=(128, 128), rule="top-left", cull="none", bits=8):
    """The sampling of a whole image."""
    return make_sampling(size, offset, rule=rule, cull=cull, subpixel_bits=bits)


@pytest.mark.parametrize("cull", ["none", "back", "front"])
@pytest.mark.parametrize("rule", RULES)
def test_boxes_of_every_shape_have_the_same_keys(rng, rule, cull):
    size = (83, 61)
    for extent in (1, 3, 8, 40, 150):
        for on_grid in (False, True):
            triangles = soup(rng, 300, size, extent, on_grid)
            for offset in sample_offsets(4, 8).tolist():
                found, expected = both(triangles, sampling_for(size, offset, rule, cull), size)
                assert np.array_equal(found, expected)
                assert (found > EMPTY_KEY).any()


@pytest.mark.parametrize("size", [(1, 1), (3, 90), (7, 7), (8, 3), (33, 9), (300, 20)])
def test_narrow_and_wide_images(rng, size):
    for extent in (2, 20, 200):
        triangles = soup(rng, 200, size, extent)
        found, expected = both(triangles, sampling_for(size), size)
        assert np.array_equal(found, expected)


def test_what_is_hidden_is_left_out_and_nothing_else(rng, monkeypatch):
    """Many layers: planes that cross each other, are level, or are hidden altogether."""
    size = (200, 120)
    for depth in (rng.random(900), np.repeat(rng.random(300), 3), np.repeat(np.linspace(0, 1, 300), 3), np.zeros(900)):
        triangles = soup(rng, 300, size, 300)._replace(depth=depth)
        found, expected = both(triangles, sampling_for(size), size)
        assert np.array_equal(found, expected)

    # It must be able to fail: with depths that count as nearer than they are hidden, samples are lost.
    monkeypatch.setattr(layers, "MARGIN", -0.25)
    lost = np.full((size[1], size[0]), EMPTY_KEY)
    lows = np.full((size[1] // 8 + 1, size[0] // 32 + 1), EMPTY_KEY)
    equation = np.array([0.0, 0, 0, 1, 1, 1, 1, 1, 1, 0.5, 0, 0])
    draw = getattr(layers.draw_layer, "py_func", layers.draw_layer)
    for k in (0, 1):
        draw(lost, lows, equation + np.eye(12)[9] * 0.01 * k, 0, 0, 100, 16, k, 0, size[1])
    assert (lows[0, :3] > EMPTY_KEY).all()


@pytest.mark.parametrize("bits", [4, 8, 12, 16])
def test_far_corners_and_clipped_pieces(rng, bits):
    size = (64, 48)
    for scale in (1.0, 30.0, 1e5):
        clip = rng.normal(size=(600, 4)) * (scale, scale, 1, 1)
        triangles = to_screen(clip, np.arange(600, dtype=np.int32).reshape(-1, 3), size, bits)
        assert (triangles.outline >= 0).any()
        offset = sample_offsets(1, bits)[0]
        found, expected = both(triangles, sampling_for(size, offset, bits=bits), size)
        assert np.array_equal(found, expected)


def test_order_chunks_and_bands_do_not_matter(rng):
    size = (150, 90)
    triangles = soup(rng, 500, size, 60, on_grid=True)
    _, expected = both(triangles, sampling_for(size), size)
    for chunk in (1, 63, 64, 65, 200):
        found, _ = both(triangles, sampling_for(size), size, chunk=chunk)
        assert np.array_equal(found, expected)
    found, _ = both(triangles, sampling_for(size), size, rng.permutation(500).astype(np.int32))
    assert np.array_equal(found, expected)
    for cuts in ([0, 1, 90], [0, 13, 44, 45, 90]):
        found = np.full((90, 150), EMPTY_KEY)
        for y_start, y_end in pairwise(cuts):
            band = sampling_for(size)._replace(y_start=y_start, y_end=y_end)
            counters = np.zeros(COUNTERS, np.int64)
            blocks.block_keys(found, counters, triangles, algorithms.NATURAL, 0, 500, band)
        assert np.array_equal(found, expected)


def test_triangles_are_sorted_by_cell_and_number(rng):
    triangles = soup(rng, 1000, (500, 300), 5)
    cells, order = np.empty(1000, np.int32), np.empty(1000, np.int32)
    blocks.sort_triangles(triangles.xy, triangles.corners, 8, 6, np.zeros(8 * 5 + 1, np.int64), np.int64(8), cells, order)
    place = np.clip(triangles.xy[triangles.corners[:, 0]] >> 14, 0, [7, 4])
    assert np.array_equal(cells, place[:, 1] * 8 + place[:, 0])
    assert np.array_equal(order, np.argsort(cells, kind="stable"))


@pytest.mark.parametrize("extent", [2, 12, 150])
def test_plain_python_writes_the_same_keys(rng, extent):
    """The kernels run as plain Python as well, where no number wraps round unseen."""
    size = (90, 20)
    triangles = soup(rng, 70, size, extent)
    sampling = sampling_for(size, rule="bottom-left", cull="back")
    found, expected = np.full((20, 90), EMPTY_KEY), np.full((20, 90), EMPTY_KEY)
    counters = np.zeros(COUNTERS, np.int64)
    half_space_keys(expected, counters, triangles, 0, 70, sampling)
    blocks.block_keys.py_func(found, counters, triangles, algorithms.NATURAL, 0, 70, sampling)
    assert np.array_equal(found, expected)
