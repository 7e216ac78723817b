"""Keys written for blocks of triangles: the same bits as one triangle after the other, for every rule, grid and size of box."""

from __future__ import annotations

import os
import subprocess
import sys
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
from scanspan.target.visibility import NOT_TWICE, unpack_kernel

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


def test_what_is_hidden_is_left_out_and_nothing_else(rng):
    """Many layers: planes that cross each other, are level, or are hidden altogether."""
    size = (200, 120)
    for depth in (rng.random(900), np.repeat(rng.random(300), 3), np.repeat(np.linspace(0, 1, 300), 3), np.zeros(900)):
        triangles = soup(rng, 300, size, 300)._replace(depth=depth)
        found, expected = both(triangles, sampling_for(size), size)
        assert np.array_equal(found, expected)


def test_a_block_remembers_the_least_of_its_keys():
    """A level triangle fills it; then one that is further away leaves all as it is, and one that is nearer hides it."""
    size = (64, 16)
    target, lows = np.full((16, 64), EMPTY_KEY), np.full((3, 3), EMPTY_KEY)
    equation = np.array([0.0, 0, 0, 1, 1, 1, 1, 1, 1, 0.5, 0, 0])
    for n, (depth, seen) in enumerate([(0.5, 0), (0.25, 0), (0.5, 0), (0.75, 3)]):
        equation[9] = depth
        layers.draw_layer(target, lows, equation, np.int64(0), np.int64(0), np.int64(64), np.int64(16), np.int64(n),
                          np.int64(0), np.int64(16))  # fmt: skip
        slot, depths = np.empty(size[::-1], np.int32), np.empty(size[::-1], np.float32)
        unpack_kernel(target, slot, NOT_TWICE, depths, 0, target.shape[1])
        assert (slot == seen).all()
        assert (lows[:2, :2] == target.min()).all()

    # It must be able to fail: a least key that is too large hides what is in front.
    lows[:] = layers.LARGEST_KEY
    equation[9] = 0.875
    layers.draw_layer(target, lows, equation, np.int64(0), np.int64(0), np.int64(64), np.int64(16), np.int64(4),
                      np.int64(0), np.int64(16))  # fmt: skip
    unpack_kernel(target, slot, NOT_TWICE, depths, 0, target.shape[1])
    assert (slot == 3).all()


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


def test_blocks_are_taken_for_many_triangles_and_for_large_ones(rng):
    sampling = sampling_for((1000, 1000))
    for count, reach, expected in ((0, 5, False), (2000, 5, False), (2000, 900, True), (20_000, 5, True)):
        assert algorithms.are_worth_blocks(soup(rng, count, (1000, 1000), reach), sampling) is expected
    assert not algorithms.are_worth_blocks(soup(rng, 2000, (1000, 1000), 900), sampling_for((20, 20)))


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_that_share_triangles_write_the_same_keys(rng, monkeypatch, threads):
    size = (150, 90)
    triangles = soup(rng, 700, size, 30, on_grid=True)
    _, expected = both(triangles, sampling_for(size), size)
    monkeypatch.setattr(algorithms, "MANY", 100)
    monkeypatch.setattr(algorithms, "SHARED", 100)
    for room in (1 << 28, 150 * 90 * 8, 0):
        monkeypatch.setattr(algorithms, "LAYER_BYTES", room)
        found = np.full((90, 150), EMPTY_KEY)
        algorithms.run("half-space", "rows", "keys", found, triangles, sampling_for(size), threads)
        assert np.array_equal(found, expected)


PLAIN = """
import hashlib, numpy as np, scanspan as ss
from scanspan.raster import algorithms
algorithms.MANY = 64
rng, digest = np.random.default_rng(3), hashlib.sha256()
for reach, size in ((0.05, (64, 40)), (0.3, (40, 12)), (3, (90, 10))):
    clip = np.ones((210, 4))
    clip[:, :3] = np.repeat(rng.uniform(-1, 1, (70, 3)), 3, axis=0) + rng.uniform(-reach, reach, (210, 3)) * (1, 1, 0.1)
    seen = ss.rasterize(clip, np.arange(210).reshape(-1, 3), size, rule="bottom-left", cull="back")
    for part in (seen.primitive, seen.depth, ss.interpolate(seen, clip), ss.interpolate(seen, clip.astype(np.float32))):
        digest.update(part.tobytes())
print((seen.primitive >= 0).sum() > 50, digest.hexdigest())
"""


def test_plain_python_gives_the_same_bits():
    """The kernels run as plain Python as well, where no number wraps round unseen."""
    printed = [
        subprocess.run([sys.executable, "-W", "error", "-c", PLAIN], env={**os.environ, **more}, capture_output=True, text=True)
        for more in ({}, {"NUMBA_DISABLE_JIT": "1"})
    ]
    assert [run.returncode for run in printed] == [0, 0], printed
    assert printed[0].stdout == printed[1].stdout
    assert printed[0].stdout.startswith("True")
