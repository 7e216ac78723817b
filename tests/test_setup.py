"""Triangle setup: depth against exact rationals, and independence of how a triangle was listed."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.project import screen_triangles
from scanspan.raster.options import make_sampling
from scanspan.raster.setup import depth_at, set_up_triangle

SIZE = (32, 24)


def make_clip(screen, depth):
    """Clip coordinates, w = 1, of corners on the screen: (3, 2) pixels and (3,) depths."""
    x, y = screen[:, 0] / SIZE[0] * 2 - 1, 1 - screen[:, 1] / SIZE[1] * 2
    return np.stack([x, y, 1 - 2 * depth, np.ones(3)], axis=1)


def exact_depths(corners, depth, bits):
    """Depths at all samples from the exact plane through snapped corners, as {(x, y): Fraction}."""
    (x0, y0), (x1, y1), (x2, y2) = [(int(x), int(y)) for x, y in corners]
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    d = [Fraction(float(v)) for v in depth]
    found = {}
    for y in range(SIZE[1]):
        for x in range(SIZE[0]):
            px, py = (2 * x + 1) << (bits - 1), (2 * y + 1) << (bits - 1)
            w1 = Fraction((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0), area)
            w2 = Fraction((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0), area)
            found[x, y] = d[0] + w1 * (d[1] - d[0]) + w2 * (d[2] - d[0])
    return found


def check_depth(screen, depth, bits, bound):
    """Compare the depth of one triangle with the exact plane at every sample it covers; return how many there are."""
    seen = ss.rasterize(make_clip(screen, depth), [(0, 1, 2)], SIZE, subpixel_bits=bits, depth_bits=64)
    corners = np.rint(screen * (1 << bits)).astype(int)
    covered = np.argwhere(seen.primitive == 0)
    exact = exact_depths(corners, depth, bits) if len(covered) else {}
    for y, x in covered.tolist():
        assert abs(Fraction(float(seen.depth[y, x])) - exact[x, y]) <= bound, (x, y)
    return len(covered)


@pytest.mark.parametrize("bits", [4, 8, 12, 16])
def test_depth_is_the_exact_plane_rounded(rng, bits):
    covered = 0
    for _ in range(30):
        screen = np.rint(rng.uniform(-8, 40, (3, 2)) * 16) / 16
        covered += check_depth(screen, rng.integers(0, 1 << 20, 3) / 2.0**20, bits, 6e-16)
    assert covered > 1000


@pytest.mark.parametrize("bits", [8, 16])
def test_depth_of_slivers_and_far_corners(rng, bits):
    covered = 0
    for reach in (1e2, 1e4, 1e6):
        for _ in range(20):
            middle = np.floor(rng.uniform(4, 20, 2)) + 0.5
            along = rng.normal(size=2)
            along /= np.hypot(*along)
            across = np.array([-along[1], along[0]]) / 16
            corners = np.stack([middle - along * reach - across, middle + along * reach, middle - along * reach + across])
            screen = np.rint(corners * 16) / 16
            (a, b), (c, d) = screen[1] - screen[0], screen[2] - screen[0]
            if a * d == b * c:
                continue
            covered += check_depth(screen, rng.integers(0, 1 << 10, 3) / 2.0**10, bits, 2e-13)
    assert covered > 100


def test_a_wrong_depth_is_noticed(rng):
    screen = np.array([(1.0, 1.0), (30.0, 2.0), (5.0, 22.0)])
    with pytest.raises(AssertionError):
        check_depth(screen, np.array([0.0, 0.5, 1.0]), 8, -1)


def test_setup_does_not_depend_on_the_order_of_the_corners(rng):
    for _ in range(50):
        screen, depth = rng.uniform(-8, 40, (3, 2)), rng.uniform(0, 1, 3)
        pictures = []
        for order in permutations(range(3)):
            clip = make_clip(screen, depth)
            pictures.append(ss.rasterize(clip, [order], SIZE, depth_bits=64))
        for picture in pictures[1:]:
            assert np.array_equal(picture.depth, pictures[0].depth)
            assert np.array_equal(picture.primitive, pictures[0].primitive)


def test_setup_in_plain_python_equals_the_compiled_one(rng):
    for bits in (8, 16):
        vertices = rng.uniform(-50, 80, (20, 3, 2)) * (1000.0 if bits == 16 else 1.0)
        screen = screen_triangles(vertices, bits)
        sampling = make_sampling(SIZE, (1 << (bits - 1),) * 2, rule="top-left", cull="none", subpixel_bits=bits)
        for p, q, r in screen.corners.tolist():
            arguments = (*screen.xy[p], *screen.xy[q], *screen.xy[r], 0.25, 0.5, 0.125, np.int64(0), sampling)
            compiled = set_up_triangle(*arguments)
            assert set_up_triangle.py_func(*arguments) == compiled
            assert depth_at.py_func(compiled, 5, 7) == depth_at(compiled, 5, 7)
