"""Visibility: keys that order like depth, merges that are a monoid, and the same bits however the work is split."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.geometry.project import screen_triangles
from scanspan.raster import algorithms
from scanspan.raster.options import make_sampling
from scanspan.raster.write import is_nearer, pack_key, unpack_depth, unpack_number
from scanspan.samples import POSITIONS
from scanspan.shade.weights import weigh_sample

SIZE = (64, 48)
SAMPLING = make_sampling(SIZE, (128, 128), rule="top-left", cull="none", subpixel_bits=8)
DEPTHS = st.floats(-4, 4, width=32)
NUMBERS = st.integers(0, 2**32 - 1)


def soup(rng, count=400, spread=1.2):
    """Random triangles all over the picture, some behind the eye: clip coordinates and indices."""
    clip = rng.normal(size=(3 * count, 4)) * spread
    clip[:, 3] = rng.uniform(-0.2, 3, 3 * count)
    return clip, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def check_same(a, b):
    """Compare two Visibilities bit for bit."""
    assert np.array_equal(a.primitive, b.primitive)
    assert np.array_equal(a.depth, b.depth)


@given(DEPTHS, NUMBERS, DEPTHS, NUMBERS)
def test_keys_order_like_is_nearer(depth, number, other_depth, other_number):
    key, other = pack_key(float(depth), np.int64(number)), pack_key(float(other_depth), np.int64(other_number))
    assert (key > other) == is_nearer(depth, number, other_depth, other_number)
    assert (key == other) == (depth == other_depth and number == other_number)


@given(DEPTHS, NUMBERS)
def test_keys_give_back_what_was_packed(depth, number):
    key = pack_key(float(depth), np.int64(number))
    assert unpack_depth(key) == np.float32(depth)
    assert unpack_number(key) == number
    assert pack_key.py_func(float(depth), np.int64(number)) == key


def test_depth_is_rounded_once_to_float32():
    value = 0.1 + 2.0**-30
    assert unpack_depth(pack_key(value, np.int64(0))) == np.float32(value)


@pytest.mark.parametrize("samples", sorted(POSITIONS))
@pytest.mark.parametrize("depth_bits", [32, 64])
def test_threads_do_not_change_a_bit(rng, monkeypatch, samples, depth_bits):
    monkeypatch.setattr(algorithms, "SMALL", 0)
    clip, triangles = soup(rng)
    one = ss.rasterize(clip, triangles, SIZE, samples=samples, depth_bits=depth_bits, threads=1)
    for threads in (2, 3, 7, 64):
        many = ss.rasterize(clip, triangles, SIZE, samples=samples, depth_bits=depth_bits, threads=threads)
        check_same(one, many)
        assert np.array_equal(one.barycentric, many.barycentric)


def test_chunks_do_not_change_a_bit(rng, monkeypatch):
    clip, triangles = soup(rng)
    whole = ss.rasterize(clip, triangles, SIZE)
    monkeypatch.setattr(algorithms, "CHUNK", 7)
    check_same(whole, ss.rasterize(clip, triangles, SIZE))


def test_passes_do_not_change_a_bit(rng, monkeypatch):
    clip, triangles = soup(rng)
    whole = ss.rasterize(clip, triangles, SIZE, threads=1)
    monkeypatch.setattr(algorithms, "SMALL", 0)
    monkeypatch.setattr(algorithms, "PASS_BYTES", 2000)
    screen = whole.screen
    assert algorithms.count_passes(screen, SAMPLING, 64 * 48 * 8) == 13
    for threads in (1, 2):
        check_same(whole, ss.rasterize(clip, triangles, SIZE, threads=threads))


def test_only_triangles_in_no_order_get_passes(rng, monkeypatch):
    monkeypatch.setattr(algorithms, "PASS_BYTES", 2000)
    x = np.linspace(0, 60, 5000)
    row = np.stack([np.stack([x, x * 0.7], 1), np.stack([x + 1, x * 0.7], 1), np.stack([x, x * 0.7 + 1], 1)], axis=1)
    assert algorithms.count_passes(screen_triangles(row, 8), SAMPLING, 64 * 48 * 8) == 1
    assert algorithms.count_passes(screen_triangles(rng.permutation(row), 8), SAMPLING, 64 * 48 * 8) == 13
    assert algorithms.count_passes(screen_triangles(rng.permutation(row), 8), SAMPLING, 2000) == 1


def test_samples_lie_at_the_standard_positions(rng):
    """A sample at (x, y) sixteenths sees what the centre sees when the scene is moved by the difference."""
    vertices = rng.uniform(0, 1, (60, 3, 2)) * SIZE
    depth = rng.uniform(0, 1, (60, 3))
    for samples, positions in POSITIONS.items():
        seen = ss.rasterize(*on_screen(vertices, depth), SIZE, samples=samples)
        for s, (x, y) in enumerate(positions):
            moved = ss.rasterize(*on_screen(vertices + (8 - x, 8 - y) / np.array(16.0), depth), SIZE)
            primitive = seen.primitive if samples == 1 else seen.primitive[..., s]
            assert (primitive != moved.primitive).mean() < 0.01  # the moved corners snap alike but for rounding


def on_screen(vertices, depth):
    """Clip coordinates with w = 1 for triangles given on the screen."""
    x, y = vertices[..., 0] / SIZE[0] * 2 - 1, 1 - vertices[..., 1] / SIZE[1] * 2
    clip = np.stack([x, y, 1 - 2 * depth, np.ones_like(x)], axis=-1).reshape(-1, 4)
    return clip, np.arange(len(clip)).reshape(-1, 3)


def test_float64_depth_agrees_with_float32(rng):
    clip, triangles = soup(rng)
    short, long = (ss.rasterize(clip, triangles, SIZE, depth_bits=bits) for bits in (32, 64))
    assert long.depth.dtype == np.float64
    assert np.array_equal(short.depth, long.depth.astype(np.float32))
    assert (short.primitive != long.primitive).mean() < 0.01


def test_equal_depths_go_to_the_lower_number(rng):
    square = np.array([(-1, -1, 0.25, 1), (3, -1, 0.25, 1), (-1, 3, 0.25, 1)])
    clip = np.concatenate([square] * 3)
    seen = ss.rasterize(clip, [(3, 4, 5), (0, 1, 2), (6, 7, 8)], SIZE)
    assert (seen.primitive == 0).all()


def test_order_of_triangles_changes_only_their_numbers(rng):
    clip, triangles = soup(rng)
    order = rng.permutation(len(triangles))
    seen, shuffled = ss.rasterize(clip, triangles, SIZE), ss.rasterize(clip, triangles[order], SIZE)
    assert np.array_equal(seen.depth, shuffled.depth)
    numbers = np.where(shuffled.primitive < 0, -1, order[shuffled.primitive])
    ties = seen.primitive != numbers
    assert ties.mean() < 0.001


def parts(rng, clip, triangles, count=3):
    """The scene in parts: each a Visibility in the numbers of the whole."""
    found = []
    for part in np.array_split(rng.permutation(len(triangles)), count):
        kept = np.zeros_like(triangles)
        kept[part] = triangles[part]
        found.append(ss.rasterize(clip, kept, SIZE))
    return found


@pytest.mark.parametrize("depth_bits", [32, 64])
def test_merge_is_a_monoid_and_gives_the_whole(rng, depth_bits):
    clip, triangles = soup(rng)
    clip[0] = clip[1] = clip[2] = (0, 0, 0, 1)
    a, b, c = parts(rng, clip, triangles)
    check_same(ss.merge(ss.merge(a, b), c), ss.merge(a, ss.merge(b, c)))
    check_same(ss.merge(a, b), ss.merge(b, a))
    check_same(ss.merge(a, a), a)
    check_same(ss.merge(ss.merge(a, b), c), ss.rasterize(clip, triangles, SIZE))
    nothing = ss.rasterize(clip, [], SIZE)
    check_same(ss.merge(a, nothing), a)
    check_same(ss.merge(nothing, a), a)


def test_merge_refuses_what_does_not_fit(rng):
    clip, triangles = soup(rng, 3)
    a = ss.rasterize(clip, triangles, SIZE)
    with pytest.raises(
        ss.InputError, match=r"^merge: \(48, 64\) float32 and \(48, 32\) float32 must have the same shape and type"
    ):
        ss.merge(a, ss.rasterize(clip, triangles, (32, 48)))
    with pytest.raises(ss.InputError, match="a merged Visibility has no barycentric weights"):
        _ = ss.merge(a, a).barycentric


def test_culling_is_by_the_sign_after_snapping():
    clockwise = [[(2, 2), (12, 2), (2, 12)]]
    counter = [[(2, 2), (2, 12), (12, 2)]]
    full = ss.count(clockwise, (16, 16)).sum()
    assert full > 0
    assert ss.count(clockwise, (16, 16), cull="back").sum() == 0
    assert ss.count(clockwise, (16, 16), cull="front").sum() == full
    assert ss.count(counter, (16, 16), cull="back").sum() == full
    assert ss.count(counter, (16, 16), cull="front").sum() == 0

    # Half a sub-pixel of area, which snapping takes away, is culled from both sides.
    thin = [[(2, 2), (12, 2), (7, 2 + 1 / 1024)]]
    assert all(ss.count(thin, (16, 16), cull=cull).sum() == 0 for cull in ("none", "back", "front"))


def test_nothing_draws_nothing():
    seen = ss.rasterize(np.empty((0, 4)), [], (3, 2))
    assert seen.primitive.tolist() == [[-1] * 3] * 2
    assert np.isneginf(seen.depth).all()
    assert seen.barycentric.shape == (2, 3, 3)
    assert set(seen.counters.values()) == {0}
    assert ss.count([], (3, 2)).tolist() == [[0] * 3] * 2


def test_nonfinite_vertices_are_named_or_dropped():
    clip = np.array([(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1), (np.nan, 0, 0, 1), (0, np.inf, 0, 1)])
    triangles = [(0, 1, 3), (0, 1, 2), (4, 1, 2)]
    with pytest.raises(
        ss.InputError, match=r"^clip\[3\] = \(nan, 0.0, 0.0, 1.0\): expected finite numbers within 1e\+150; triangle 0 uses it$"
    ):
        ss.rasterize(clip, triangles, (4, 4))
    assert (ss.rasterize(clip, triangles, (4, 4), nonfinite="drop").primitive == 1).all()
    assert (ss.rasterize(clip, [(0, 1, 2)], (4, 4)).primitive == 0).all()  # a bad vertex that nothing uses
    vertices = [[(0, 0), (8, 0), (0, np.nan)], [(0, 0), (8, 0), (0, 8)]]
    with pytest.raises(
        ss.InputError, match=r"^vertices\[0, 2\] = \(0.0, nan\): expected finite numbers within 16777216 pixels$"
    ):
        ss.count(vertices, (4, 4))
    assert ss.count(vertices, (4, 4), nonfinite="drop").sum() == 16
    with pytest.raises(ss.InputError, match=r"^vertices\[1, 1\] = \(1e\+09, 0.0\)|^vertices\[1, 1\] = \(1000000000.0, 0.0\)"):
        ss.count([vertices[0], [(0, 0), (1e9, 0), (0, 8)]], (4, 4), nonfinite="drop")
    with pytest.raises(ss.InputError, match="unknown value of nonfinite 'skip'"):
        ss.count(vertices, (4, 4), nonfinite="skip")


CLIP = [(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"algorithm": "halfspace"}, r"unknown algorithm 'halfspace'; did you mean 'half-space'\?"),
        ({"algorithm": None}, "unknown algorithm None"),
        ({"order": "zigzag"}, "unknown order 'zigzag'"),
        ({"coverage": "centre"}, "unknown coverage 'centre'"),
        ({"samples": 3}, "samples = 3: must be one of 1, 2, 4, 8, 16"),
        ({"samples": True}, "samples = True: must be one of"),
        ({"samples": [4]}, r"samples = \[4\]: must be one of"),
        ({"cull": "Back"}, r"unknown cull 'Back'; did you mean 'back'\?"),
        ({"rule": 3}, "unknown rule 3"),
        ({"subpixel_bits": 3}, "subpixel_bits = 3: must be a whole number from 4 to 16"),
        ({"subpixel_bits": 8.0}, "subpixel_bits = 8.0: must be a whole number from 4 to 16"),
        ({"depth_bits": 16}, "depth_bits = 16: must be 32 or 64"),
        ({"depth_bits": None}, "depth_bits = None: must be 32 or 64"),
        ({"threads": 0}, "threads = 0: must be a whole number from 1 to 4096"),
        ({"threads": 10**6}, "threads = 1000000: must be a whole number"),
        ({"size": (0, 4)}, r"size = \(0, 4\): expected \(width, height\)"),
        ({"size": (-1, 4)}, "size"),
        ({"size": 8}, "size"),
        ({"size": (2**18 + 1, 1)}, "size"),
        ({"size": (40000, 40000)}, r"size = \(40000, 40000\): 1600000000 pixels, the limit is max_pixels=268435456"),
        ({"triangles": [(0, 1, 3)]}, r"triangles\[0\] = \(0, 1, 3\): vertex 3 does not exist, there are 3"),
        ({"triangles": np.array([(0, 1, 3)], np.int32)}, r"triangles\[0\] = \(0, 1, 3\): vertex 3 does not exist, there are 3"),
        ({"triangles": [(0, 1, -1)]}, r"triangles\[0\] = \(0, 1, -1\): vertex -1 does not exist"),
        ({"triangles": [(0, 1)]}, r"triangles: expected shape \(T, 3\), got \(1, 2\)"),
        ({"triangles": [(0, 1, 0.5)]}, r"triangles\[0\] = \(0.0, 1.0, 0.5\): expected whole numbers"),
        ({"triangles": "abc"}, "triangles: expected an array of numbers"),
        ({"clip": [(0, 0, 0)]}, r"clip: expected shape \(N, 4\), got \(1, 3\)"),
        ({"clip": None}, "clip: expected an array of numbers"),
        ({"clip": [(0, 0, 0, 1j)]}, "clip: expected an array of numbers, got dtype complex128"),
    ],
)
def test_what_cannot_be_used_is_quoted(options, message):
    arguments = {"clip": CLIP, "triangles": [(0, 1, 2)], "size": (4, 4), **options}
    with pytest.raises(ss.InputError, match=message) as caught:
        ss.rasterize(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ((np.nan, 0), "must be finite"),
        ((0, 0, 0), "not all 0"),
        ((1e9, 0), "within 16777216 pixels; use w=0"),
        ((1, 1, np.inf), "must be finite"),
    ],
)
def test_offscreen_points_are_checked(point, message):
    with pytest.raises(ss.InputError, match=message):
        ss.OffscreenPoint(*point)


def test_interpolate_keeps_types_and_constants(rng):
    clip, triangles = soup(rng, 40)
    seen = ss.rasterize(clip, triangles, SIZE, samples=4)
    for dtype in (np.float16, np.float32, np.float64):
        constant = ss.interpolate(seen, np.full((len(clip), 2), 1 / 3, dtype))
        assert constant.dtype == dtype
        assert constant.shape == (48, 64, 4, 2)
        assert (constant[seen.primitive >= 0] == dtype(1 / 3)).all()
        assert (constant[seen.primitive < 0] == 0).all()
    assert ss.interpolate(seen, np.arange(len(clip))).dtype == np.float64
    with pytest.raises(ss.InputError, match=f"^per_vertex: 5 rows, but the triangles use {len(clip)} vertices$"):
        ss.interpolate(seen, np.zeros(5))
    with pytest.raises(ss.InputError, match=r"^per_vertex: expected shape"):
        ss.interpolate(seen, np.zeros((len(clip), 2, 2)))
    with pytest.raises(ss.InputError, match=r"^visibility: expected what rasterize returned, got tuple"):
        ss.interpolate((), np.zeros(5))


@pytest.mark.parametrize("algorithm", ss.ALGORITHMS)
def test_nothing_is_seen_beyond_the_box_about_all_triangles(algorithm, rng):
    # Each picture gets the memory of the one before, which is full of keys that are nearer.
    size, whole = (640, 330), [(-3, -3, -2.9, 3), (9, -3, -2.9, 3), (-3, 9, -2.9, 3)]
    for scale, shift, options in ((0.3, 0.4, {}), (0.1, -0.95, {"threads": 2}), (0.2, 1.05, {}), (0.6, 0.0, {"threads": 3})):
        ss.rasterize(whole, [(0, 1, 2)], size, algorithm=algorithm)
        clip = np.concatenate(
            [rng.uniform(-scale, scale, (60, 2)) + shift, rng.uniform(-0.5, 0.5, (60, 1)), np.ones((60, 1))], 1
        )
        triangles = np.arange(60).reshape(-1, 3)
        seen = ss.rasterize(clip, triangles, size, algorithm=algorithm, **options)
        wide = ss.rasterize(np.concatenate([clip, whole]), triangles, size, algorithm=algorithm, **options)
        assert np.array_equal(seen.primitive, wide.primitive)
        assert np.array_equal(seen.depth, wide.depth)
        assert 0 < (seen.primitive >= 0).mean() < 0.4
        assert ((seen.primitive >= 0) == (seen.depth > -np.inf)).all()


def test_codes_are_interpolated_and_rounded_half_up(rng):
    clip, triangles = soup(rng, 60)
    for columns, options in ((3, {}), (4, {"samples": 4}), (1, {"depth_bits": 64, "threads": 2})):
        seen = ss.rasterize(clip, triangles, SIZE, **options)
        codes = rng.integers(0, 256, (len(clip), columns)).astype(np.uint8)
        found = ss.interpolate(seen, codes, dtype=np.uint8)
        assert found.dtype == np.uint8
        assert np.array_equal(found, np.floor(ss.interpolate(seen, codes) + 0.5))
        assert len(np.unique(found)) > 200
    flat = ss.interpolate(seen, codes[:, 0], dtype="uint8")
    assert np.array_equal(flat, found[..., 0])


def test_a_half_is_rounded_up():
    clip = [(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)]
    seen = ss.rasterize(clip, [(0, 1, 2)], size=(2, 1))
    assert ss.interpolate(seen, np.array([0, 4, 0], np.uint8)).tolist() == [[0.5, 1.5]]
    assert ss.interpolate(seen, np.array([0, 4, 0], np.uint8), dtype=np.uint8).tolist() == [[1, 2]]


def test_the_type_of_what_is_interpolated_can_be_chosen(rng):
    clip, triangles = soup(rng, 20)
    seen, values = ss.rasterize(clip, triangles, SIZE), rng.normal(size=(len(clip), 2))
    wide, narrow = ss.interpolate(seen, values), ss.interpolate(seen, values, dtype=np.float32)
    assert narrow.dtype == np.float32
    assert np.array_equal(narrow, wide.astype(np.float32))
    single = values.astype(np.float32)
    assert np.array_equal(ss.interpolate(seen, single, dtype=np.float64), ss.interpolate(seen, single.astype(np.float64)))
    assert ss.interpolate(seen, np.arange(len(clip)), dtype="float32").dtype == np.float32


@pytest.mark.parametrize(
    ("values", "dtype", "got"),
    [
        (np.float64, np.uint8, "uint8 for values that are float64"),
        (np.int64, "uint8", "uint8 for values that are int64"),
        (np.uint8, np.int32, "int32"),
        (np.float64, "complex128", "complex128"),
        (np.float64, "colours", "'colours'"),
        (np.float64, 7, "7"),
    ],
)
def test_types_that_nothing_can_be_interpolated_in(values, dtype, got):
    seen = ss.rasterize([(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)], [(0, 1, 2)], size=(2, 1))
    with pytest.raises(ss.InputError) as caught:
        ss.interpolate(seen, np.zeros(3, values), dtype=dtype)
    assert str(caught.value) == f"dtype: expected float32 or float64, or uint8 for values that are uint8, got {got}"


@pytest.mark.parametrize("ratio", [1.0, 1e2, 1e6])
def test_interpolation_is_right_to_a_few_bits(rng, ratio):
    """Against the exact perspective formula from the snapped corners, in rationals."""
    from fractions import Fraction

    for _ in range(10):
        w = ratio ** rng.uniform(0, 1, 3)
        corners = rng.integers(0, 16 * 64, (3, 2)) / 16
        clip = np.stack([corners[:, 0] / 32 - 1, 1 - corners[:, 1] / 24, np.zeros(3), np.ones(3)], axis=1) * w[:, None]
        clip[:, 2] = 0
        values = rng.normal(size=3)
        seen = ss.rasterize(clip, [(0, 1, 2)], SIZE)
        found = ss.interpolate(seen, values)
        xy = [(int(np.rint((a + 1) * 32 * 256)), int(np.rint((1 - b) * 24 * 256))) for a, b in clip[:, :2] / clip[:, 3:]]
        for y, x in np.argwhere(seen.primitive == 0)[::7].tolist():
            px, py = 256 * x + 128, 256 * y + 128
            e = [
                Fraction((b[0] - a[0]) * (py - a[1]) - (px - a[0]) * (b[1] - a[1]))
                for a, b in ((xy[1], xy[2]), (xy[2], xy[0]), (xy[0], xy[1]))
            ]
            share = [v / Fraction(float(z)) for v, z in zip(e, clip[:, 3], strict=True)]
            exact = sum(s * Fraction(float(v)) for s, v in zip(share, values, strict=True)) / sum(share)
            assert abs(Fraction(float(found[y, x])) - exact) <= Fraction(1, 10**15) * Fraction(float(np.abs(values).max()))


def test_triangles_that_change_later_do_no_harm():
    triangles = np.array([(0, 1, 2)], np.int32)
    seen = ss.rasterize(CLIP, triangles, (4, 4))
    triangles[:] = 200_000_000
    assert np.array_equal(ss.interpolate(seen, [1.0, 1.0, 1.0]), np.ones((4, 4)))


def test_odd_values_and_merges_are_refused_or_empty():
    seen = ss.rasterize(CLIP, [(0, 1, 2)], (4, 4))
    assert ss.interpolate(seen, np.zeros((3, 0))).shape == (4, 4, 0)
    with pytest.raises(ss.InputError, match=r"^merge: b must be a Visibility, got NoneType$"):
        ss.merge(seen, None)


@pytest.mark.parametrize("low_w", [0.5, -0.1])
def test_weights_in_blocks_are_those_of_each_sample_by_itself(rng, low_w):
    """More triangles than records are kept, one is seen behind them all over, and some are cut by the near plane."""
    count, size, s = 8192, (360, 110), 8  # as many as there are hashes, so that none drives out another
    clip = np.ones((count, 3, 4))
    clip[..., :2] = rng.uniform(-1, 1, (count, 1, 2)) + rng.normal(size=(count, 3, 2)) * (0.01, 0.03)
    clip[..., 2] = rng.uniform(-1, 0, (count, 1))
    clip[0, :, :3] = [(-1, -1, 0.95), (3, -1, 0.95), (-1, 3, 0.95)]
    clip *= rng.uniform(0.5, 2, (count, 3, 1))
    clip[300::700, 0, 3] = low_w
    seen = ss.rasterize(clip.reshape(-1, 4), np.arange(3 * count).reshape(-1, 3), size, threads=1)
    slot, t, found = seen.planes[0].slot, seen.screen, seen.barycentric
    values = rng.normal(size=(3 * count, 2))
    blended = ss.interpolate(seen, values)
    assert len(np.unique(slot)) > 4096 + 1024
    assert (found[slot < 0] == 0).all()
    for j, i in np.argwhere(slot >= 0)[::13]:
        n = np.int64(slot[j, i])
        x, y = (np.int64(i) << s) + 128, (np.int64(j) << s) + 128
        weights = weigh_sample(t.xy, t.clip, t.corners, t.piece, t.weights, t.inner, n, x, y)
        assert found[j, i].tolist() == list(weights)
        u0, u1, u2 = values[3 * t.source[n] : 3 * t.source[n] + 3]
        assert (blended[j, i] == u0 + (weights[1] * (u1 - u0) + weights[2] * (u2 - u0))).all()
