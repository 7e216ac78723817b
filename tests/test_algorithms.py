"""Agreement: every algorithm paints the same picture as the oracle and as every other, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.pipeline import count_each
from scanspan.raster import algorithms
from tests.exact import coverage

SIZE = (40, 30)
# Every algorithm in every order that it knows; the first is what the others are compared with.
WAYS = [{"algorithm": name, "order": order} for name in ss.ALGORITHMS for order in algorithms.KERNELS[name]]
OTHERS = WAYS[1:]
RULES = ["top-left", "bottom-left", "inclusive", "exclusive", ss.OffscreenPoint(-3.25, 7.5), ss.OffscreenPoint(1, 0, 0)]


def scene_zoo(rng):
    """Scenes that have broken rasterizers before, as (clip coordinates, triangles) by name."""
    soup = rng.normal(size=(360, 4))
    whole = np.c_[rng.uniform(-1.2, 1.2, (360, 2)), rng.uniform(-1, 1, 360), np.ones(360)]
    tiny = np.repeat(rng.uniform(-1, 1, (400, 2)), 3, axis=0) + rng.uniform(-0.06, 0.06, (1200, 2))
    angle = np.sort(rng.uniform(0, 2 * np.pi, 24))
    rim = np.c_[np.cos(angle), np.sin(angle), rng.uniform(-0.5, 0.5, 24), np.ones(24)]
    fan = np.concatenate([[(1 / SIZE[0], 1 / SIZE[1], 0, 1)], rim])
    slivers = np.repeat(rng.uniform(-1, 1, (60, 2)), 3, axis=0) + rng.normal(size=(180, 2)) * (1e-3, 0.8)
    lattice = np.rint(rng.uniform(-1, 1, (300, 2)) * (SIZE[0] / 2, SIZE[1] / 2)) / (SIZE[0] / 2, SIZE[1] / 2)
    far = rng.normal(size=(90, 2)) * 1e4
    cycle = [(-0.8, -0.6, 0.3), (0.8, -0.5, -0.3), (0.8, -0.3, -0.3), (0.7, -0.8, 0.3), (0.1, 0.8, -0.3), (-0.1, 0.8, -0.3),
             (0.1, 0.7, 0.3), (-0.9, -0.3, -0.3), (-0.8, -0.5, -0.3)]  # fmt: skip
    same = np.tile([(-0.9, -0.8, 0.1, 1), (0.8, -0.7, 0.4, 1), (0.1, 0.9, -0.3, 1)], (4, 1))

    def flat(points):
        return np.c_[points, rng.uniform(-1, 1, len(points)), np.ones(len(points))]

    zoo = {
        "soup": soup, "whole": whole, "tiny": flat(tiny), "slivers": flat(slivers), "lattice": flat(lattice), "far": flat(far),
        "cycle": np.c_[cycle, np.ones(9)], "same": same, "nothing": np.empty((0, 4)),
    }  # fmt: skip
    scenes = {name: (clip, np.arange(len(clip)).reshape(-1, 3)) for name, clip in zoo.items()}
    scenes["fan"] = (fan, np.stack([np.zeros(24, int), 1 + np.arange(24), 1 + (np.arange(24) + 1) % 24], axis=1))
    return scenes


SCENES = list(scene_zoo(np.random.default_rng(0)))


@pytest.mark.parametrize("way", OTHERS, ids=lambda way: "-".join(way.values()))
@pytest.mark.parametrize("name", SCENES)
def test_scenes_look_the_same(rng, name, way):
    clip, triangles = scene_zoo(rng)[name]
    for k, options in enumerate(
        (
            {},
            {"samples": 4},
            {"depth_bits": 64},
            {"subpixel_bits": 16},
            {"cull": "back", "subpixel_bits": 4},
            {"rule": RULES[4]},
        )
    ):
        expected = ss.rasterize(clip, triangles, SIZE, **options)
        found = ss.rasterize(clip, triangles, SIZE, **way, **options)
        assert np.array_equal(found.primitive, expected.primitive), (k, options)
        assert np.array_equal(found.depth, expected.depth), (k, options)


@pytest.mark.parametrize("way", WAYS, ids=lambda way: "-".join(way.values()))
@pytest.mark.parametrize("rule", RULES, ids=str)
def test_single_triangles_equal_the_oracle(rng, rule, way):
    for bits, scale in ((4, 1.0), (8, 1.0), (8, 3e5), (12, 1e3), (16, 4e5)):
        vertices = rng.uniform(-8, 30, (60, 3, 2)) * scale
        if scale == 1.0:
            vertices = np.rint(vertices * 2) / 2
        found = count_each(vertices, (24, 20), **way, rule=rule, subpixel_bits=bits)
        assert np.array_equal(found, coverage(vertices, (24, 20), rule=rule, subpixel_bits=bits))


@pytest.mark.parametrize("way", OTHERS, ids=lambda way: "-".join(way.values()))
def test_threads_and_chunks_do_not_change_a_bit(rng, monkeypatch, way):
    monkeypatch.setattr(algorithms, "SMALL", 0)
    clip, triangles = scene_zoo(rng)["soup"]
    expected = ss.rasterize(clip, triangles, SIZE)
    for threads, chunk in ((1, 50), (2, 1 << 16), (7, 13)):
        monkeypatch.setattr(algorithms, "CHUNK", chunk)
        found = ss.rasterize(clip, triangles, SIZE, **way, threads=threads)
        assert np.array_equal(found.primitive, expected.primitive)
        assert np.array_equal(found.depth, expected.depth)


@pytest.mark.parametrize("way", OTHERS, ids=lambda way: "-".join(way.values()))
def test_counts_are_the_same(rng, way):
    vertices = rng.uniform(-10, 50, (300, 3, 2))
    for rule in RULES[:4]:
        counts = [ss.count(vertices, SIZE, rule=rule, **each) for each in (WAYS[0], way)]
        assert np.array_equal(*counts)


COORDINATE = st.one_of(st.integers(-64, 64).map(lambda v: v / 4), st.floats(-40, 40), st.sampled_from([-3e5, 3e5, 0.5]))
TRIANGLE = st.tuples(*[st.tuples(COORDINATE, COORDINATE)] * 3)


@given(st.lists(TRIANGLE, min_size=1, max_size=4), st.sampled_from(OTHERS), st.sampled_from(RULES), st.sampled_from([4, 8, 16]))
def test_no_difference_can_be_found(triangles, way, rule, bits):
    options = {"rule": rule, "subpixel_bits": bits}
    counts = [ss.count(triangles, (12, 9), **each, **options) for each in (WAYS[0], way)]
    assert np.array_equal(*counts)


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (50, 1)])
@pytest.mark.parametrize("way", OTHERS, ids=lambda way: "-".join(way.values()))
def test_images_of_one_pixel_across(rng, size, way):
    clip, triangles = scene_zoo(rng)["soup"]
    expected, found = (ss.rasterize(clip, triangles, size, **each) for each in (WAYS[0], way))
    assert np.array_equal(found.primitive, expected.primitive)
    assert np.array_equal(found.depth, expected.depth)


def test_an_order_that_an_algorithm_does_not_know_is_refused():
    with pytest.raises(ss.InputError, match=r"^order = 'tiles': the algorithm 'edge-walk' knows 'rows' alone$"):
        ss.count([], SIZE, algorithm="edge-walk", order="tiles")


@pytest.mark.parametrize("order", ["morton", "hilbert"])
def test_curves_visit_every_quarter_once_and_hilbert_goes_to_neighbours(order):
    """Follow the table of a curve down five levels, as the traversal does, and look at the steps between blocks."""
    from scanspan.raster.order import HILBERT, MORTON

    quarters, places, stack = {"morton": MORTON, "hilbert": HILBERT}[order], [], [(0, 0, 32, 0)]
    while stack:
        x, y, side, way = stack.pop()
        if side == 1:
            places.append((x, y))
            continue
        half = side // 2
        for k in range(4):
            quarter, turned = quarters[way, 0, 3 - k], quarters[way, 1, 3 - k]
            stack.append((x + (quarter & 1) * half, y + (quarter >> 1) * half, half, turned))
    assert len(set(places)) == 32 * 32
    steps = np.abs(np.diff(places, axis=0)).sum(axis=1)
    assert (steps == 1).all() == (order == "hilbert")
