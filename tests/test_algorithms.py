"""Agreement: every algorithm paints the same picture as the oracle and as every other, bit for bit.

The default suite tries every pair of choices (algorithm with order, scene, rule, samples, grid, depth, culling, threads) in
some combination; `make verify` tries all combinations. Homogeneous rasterization is exact where all corners lie in front, and
has the tolerance of the contract elsewhere.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.pipeline import count_each
from scanspan.raster import algorithms
from tests import zoo
from tests.exact import coverage
from tests.zoo import OPTIONS, OTHERS, PIXEL_WAYS, RULES, SCENES, SIZE, WAYS, covering_array, scene_zoo


def name_of(way):
    return "-".join(way.values())


@cache
def scene(name):
    return scene_zoo(np.random.default_rng(20261121))[name]


SLICE = covering_array({"way": OTHERS, "scene": SCENES, **OPTIONS})
PIXEL_OPTIONS = {name: OPTIONS[name] for name in ("subpixel_bits", "depth_bits", "cull", "threads")}
PIXEL_SLICE = covering_array({"way": PIXEL_WAYS[1:], "scene": SCENES, "coverage": ("touched", "inside"), **PIXEL_OPTIONS})
COUNT_OPTIONS = {name: OPTIONS[name] for name in ("rule", "subpixel_bits", "cull")}
COUNT_SLICE = covering_array({"way": WAYS, **COUNT_OPTIONS, "scale": (1.0, 1e3, 3e5)})


CUT_SCENES = [name for name in SCENES if zoo.is_cut(*scene(name), SIZE).any()]


def of_way(rows, way):
    """The rows of a covering array that concern one way, without it."""
    return [{name: value for name, value in row.items() if name != "way"} for row in rows if row["way"] == way]


def test_the_slice_has_every_pair():
    assert CUT_SCENES == ["soup", "beyond", "room"]
    assert all(way["algorithm"] == "homogeneous" for way in WAYS[5:10])
    for rows, factors in (
        (SLICE, {"way": OTHERS, "scene": SCENES, **OPTIONS}),
        (COUNT_SLICE, {"way": WAYS, **COUNT_OPTIONS}),
    ):
        assert len(rows) < 1.5 * len(factors["way"]) * max(len(choices) for name, choices in factors.items() if name != "way")
        for one, choices in factors.items():
            for other, other_choices in factors.items():
                pairs = {(repr(row[one]), repr(row[other])) for row in rows}
                assert one == other or len(pairs) == len(choices) * len(other_choices)


@pytest.mark.parametrize("way", OTHERS, ids=name_of)
def test_scenes_look_the_same(way):
    for row in of_way(SLICE, way):
        name = row.pop("scene")
        clip, triangles = scene(name)
        expected = ss.rasterize(clip, triangles, SIZE, **row)
        found = ss.rasterize(clip, triangles, SIZE, **way, **row)
        if way["algorithm"] == "homogeneous" and zoo.is_cut(clip, triangles, SIZE).any():
            places = clip, triangles, SIZE, found, expected, row["samples"], row["subpixel_bits"]
            assert zoo.check_unclipped(*places)[1] == [], (name, row)
        else:
            assert np.array_equal(found.primitive, expected.primitive), (name, row)
            assert np.array_equal(found.depth, expected.depth), (name, row)


@pytest.mark.parametrize("bits", OPTIONS["subpixel_bits"])
@pytest.mark.parametrize("name", CUT_SCENES)
def test_few_samples_look_different_without_clipping(name, bits, report):
    clip, triangles = scene(name)
    elsewhere = compared = 0
    for rule, cull, samples in zip(RULES, ("none", "back", "front") * 2, (1, 2, 1, 4, 8, 1), strict=True):
        options = {"rule": rule, "cull": cull, "samples": samples, "subpixel_bits": bits}
        expected = ss.rasterize(clip, triangles, SIZE, **options)
        found = ss.rasterize(clip, triangles, SIZE, algorithm="homogeneous", **options)
        number, wrong = zoo.check_unclipped(clip, triangles, SIZE, found, expected, samples, bits)
        assert wrong == [], options
        elsewhere, compared = elsewhere + number, compared + int((expected.primitive >= 0).sum())

        # The orders of homogeneous rasterization equal each other to the bit.
        for way in WAYS[6:10]:
            assert zoo.different(ss.rasterize(clip, triangles, SIZE, **way, **options), found) == 0
    report(f"{elsewhere} of {compared} samples show another triangle")
    assert compared > 4000
    assert elsewhere <= compared // (50 if bits == 4 else 500)


@pytest.mark.parametrize("way", PIXEL_WAYS[1:], ids=name_of)
def test_whole_pixels_look_the_same(way):
    shown = 0
    for row in of_way(PIXEL_SLICE, way):
        name = row.pop("scene")
        expected, found = (ss.rasterize(*scene(name), SIZE, **each, **row) for each in (WAYS[0], way))
        assert np.array_equal(found.primitive, expected.primitive), (name, row)
        assert np.array_equal(found.depth, expected.depth), (name, row)
        shown += (expected.primitive >= 0).sum()
    assert shown > 1000


@pytest.mark.parametrize("way", WAYS, ids=name_of)
def test_single_triangles_equal_the_oracle(rng, way):
    for row in of_way(COUNT_SLICE, way):
        scale = row.pop("scale")
        vertices = rng.uniform(-8, 30, (60, 3, 2)) * scale
        if scale == 1.0:
            vertices = np.rint(vertices * 2) / 2
        found = count_each(vertices, (24, 20), **way, **row)
        assert np.array_equal(found, coverage(vertices, (24, 20), **row)), row


@pytest.mark.parametrize("way", OTHERS, ids=name_of)
def test_threads_and_chunks_do_not_change_a_bit(monkeypatch, way):
    monkeypatch.setattr(algorithms, "SMALL", 0)
    clip, triangles = scene("soup")
    first = {**way, "order": "rows"} if way["algorithm"] == "homogeneous" else WAYS[0]
    expected = ss.rasterize(clip, triangles, SIZE, **first)
    for threads, chunk in ((1, 50), (2, 1 << 16), (7, 13)):
        monkeypatch.setattr(algorithms, "CHUNK", chunk)
        found = ss.rasterize(clip, triangles, SIZE, **way, threads=threads)
        assert zoo.different(found, expected) == 0


@pytest.mark.parametrize("way", OTHERS, ids=name_of)
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
@pytest.mark.parametrize("way", OTHERS, ids=name_of)
def test_images_of_one_pixel_across(size, way):
    clip, triangles = scene("deep")
    expected, found = (ss.rasterize(clip, triangles, size, **each) for each in (WAYS[0], way))
    assert zoo.different(found, expected) == 0


def test_a_difference_is_noticed():
    """Plant faults that the comparison of homogeneous rasterization must not take for its tolerance."""
    clip, triangles = scene("soup")
    expected = ss.rasterize(clip, triangles, SIZE)

    def complaints(**changed):
        found = ss.rasterize(clip, triangles, SIZE, algorithm="homogeneous")
        for name, change in changed.items():
            change(getattr(found, name))
        return zoo.check_unclipped(clip, triangles, SIZE, found, expected, 1, 8)[1]

    def shift(part):
        part[:, 1:] = part[:, :-1].copy()

    def lift(part):
        part[...] = np.where(part > 0, np.nextafter(part, np.float32(9)), part)

    assert complaints() == []
    assert len(complaints(primitive=shift)) > 50
    assert len(complaints(depth=lift)) > 50
    assert len(complaints(primitive=lambda part: part.fill(-1))) > 500

    # Triangles in front alone have no tolerance at all.
    clip, triangles = scene("whole")
    expected = ss.rasterize(clip, triangles, SIZE)
    assert complaints() == []
    assert len(complaints(depth=lambda part: part.__setitem__((5, 5), 0.125))) == 1


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
