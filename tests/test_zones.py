"""Many polygons at once: reductions against NumPy, one polygon at a time; blocks, windows and threads; and every message."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
import shapely

import scanspan as ss
from scanspan.assets.values import REDUCTIONS
from scanspan.jit import signature_count
from scanspan.raster import shares, spans, touched

SIZE = (40, 30)
MODES = ["center", "touched"]


@pytest.fixture
def polygons(rng):
    """Give polygons that overlap, some of several rings, some empty, some outside."""
    made = []
    for number in range(40):
        middle = rng.uniform(-5, 45, 2)
        rings = [middle + rng.uniform(-9, 9, (int(rng.integers(3, 7)), 2)) for _ in range(1 + number % 2)]
        made.append(rings if number % 7 else [])
    return made


def stack(polygons, mode, fill_rule="even-odd"):
    """Return what each polygon covers, (P, H, W)."""
    return np.array([ss.coverage(rings, SIZE, mode=mode, fill_rule=fill_rule) for rings in polygons])


def reduced(covers, values, reduce, background):
    """Return the reduction pixel by pixel: the oracle."""
    out = np.full(covers.shape[1:], background, np.float64)
    for j, i in np.ndindex(out.shape):
        here = np.flatnonzero(covers[:, j, i])
        if len(here):
            found = values[here].astype(float)
            pick = {"first": lambda f: f[0], "last": lambda f: f[-1], "min": np.min, "max": np.max, "count": len,
                    "sum": np.sum, "mean": lambda f: np.cumsum(f)[-1] / len(f)}[reduce]  # fmt: skip
            out[j, i] = pick(found)
    return out


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("reduce", ["first", "last", "min", "max", "count", "sum", "mean"])
def test_reductions_equal_numpy(rng, polygons, mode, reduce):
    covers = stack(polygons, mode)
    whole = rng.integers(0, 9, len(polygons))
    for values in (whole, whole / 4):
        expected = reduced(covers, values, reduce, -7)
        found = ss.zones(polygons, SIZE, values=values, reduce=reduce, mode=mode, background=-7)
        assert np.array_equal(found, expected)
        assert found.dtype == (np.int32 if reduce == "count" else np.float64 if reduce == "mean" else values.dtype)


@pytest.mark.parametrize("mode", MODES)
def test_without_values_the_numbers_are_reduced(polygons, mode):
    covers, numbers = stack(polygons, mode), np.arange(len(polygons))
    for reduce in ("first", "last", "min", "max"):
        found = ss.zones(polygons, SIZE, reduce=reduce, mode=mode)
        assert found.dtype == np.int32
        assert np.array_equal(found, reduced(covers, numbers, reduce, -1))
    assert np.array_equal(ss.zones(polygons, SIZE, reduce="count", mode=mode), covers.sum(axis=0))


def test_areas_weigh(rng, polygons):
    shares, values = stack(polygons, "area"), rng.normal(size=len(polygons))
    total = np.zeros(SIZE[::-1])
    weights = np.zeros(SIZE[::-1])
    for share, value in zip(shares, values, strict=True):
        weights, total = weights + share, total + share * value
    assert np.array_equal(ss.zones(polygons, SIZE, reduce="count", mode="area"), weights)
    assert np.array_equal(ss.zones(polygons, SIZE, reduce="sum", values=values, mode="area"), total)
    mean = ss.zones(polygons, SIZE, reduce="mean", values=values, mode="area")
    assert np.array_equal(np.isnan(mean), weights <= 2.0**-40)
    assert np.array_equal(mean[~np.isnan(mean)], (total / np.where(weights > 0, weights, 1))[~np.isnan(mean)])
    assert np.array_equal(
        ss.coverage([{"type": "Polygon", "coordinates": rings} for rings in polygons], SIZE, mode="area"), weights
    )


def test_majority_is_the_largest_area_and_of_equals_the_first(polygons):
    shares = np.rint(stack(polygons, "area") * 2.0**32)
    expected = np.where(shares.max(axis=0) > 0, shares.argmax(axis=0), -1)
    assert np.array_equal(ss.zones(polygons, SIZE, reduce="majority", mode="area"), expected)
    left, right = [(0, 0), (0.5, 0), (0.5, 1), (0, 1)], [(0.5, 0), (1.2, 0), (1.2, 1), (0.5, 1)]
    for order in ([left, right], [right, left]):
        assert ss.zones(order, (2, 1), reduce="majority", mode="area")[0, 0] == 0
    labels = ss.zones([left, right], (3, 1), reduce="majority", mode="area", values=np.array([7, 9], np.uint8), background=255)
    assert (labels.dtype, labels.tolist()) == (np.uint8, [[7, 9, 255]])


def test_equal_values_and_nan():
    a, b, c = ([(x, 0), (x + 2, 0), (x + 2, 1), (x, 1)] for x in (0, 1, 2))
    nan = float("nan")
    for reduce in ("min", "max"):
        found = ss.zones([a, b, c], (5, 1), values=[1.0, nan, 2.0], reduce=reduce, background=0)
        assert np.array_equal(found, [[1, nan, nan, 2, 0]], equal_nan=True)
    minus = ss.zones([a, a], (1, 1), values=[0.0, -0.0], reduce="max")
    assert not np.signbit(minus[0, 0])


@pytest.mark.parametrize("dtype", ["bool", "uint8", "int16", "int64", "uint64", "float32", "float64"])
def test_values_keep_their_type(dtype):
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    found = ss.zones([square], (2, 1), values=np.array([1], dtype))
    assert found.dtype == dtype
    assert np.array_equal(found, np.array([[1, np.nan if dtype[0] == "f" else 0]]).astype(dtype), equal_nan=dtype[0] == "f")
    big = np.array([2**63 - 1], np.int64)
    assert ss.zones([square], (1, 1), values=big)[0, 0] == big[0]


@pytest.mark.parametrize("fill_rule", ["even-odd", "non-zero", "positive", "negative", "abs-geq-two"])
def test_blocks_of_any_size_fit_together(polygons, fill_rule):
    # Polygons here cross themselves and reach over many blocks.
    values = np.linspace(-1, 3, len(polygons))
    calls = [{"mode": mode, "reduce": reduce} for mode in MODES for reduce in ("last", "mean")]
    calls += [{"mode": "area", "reduce": reduce} for reduce in ("count", "sum", "mean", "majority")]
    for options in calls:
        options = {**options, "values": values, "fill_rule": fill_rule}
        whole = ss.zones(polygons, SIZE, **options)
        for block in (1000, (7, 11), (40, 1), 9):
            joined = np.full_like(whole, 123)
            for (x, y, width, height), part in ss.blocks(ss.zones, polygons, SIZE, block, **options):
                assert part.shape == (height, width)
                joined[y : y + height, x : x + width] = part
            assert np.array_equal(joined.view(np.int64), whole.view(np.int64)), (options["mode"], options["reduce"], block)


@pytest.mark.parametrize("mode", ["center", "touched", "area"])
def test_a_window_of_a_large_image_is_the_same_place(rng, mode):
    size, window = (1 << 18, 1 << 18), (131_000, 200_000, 60, 50)
    ring = rng.uniform(-40, 100, (9, 2)) + window[:2]
    ring[0] = (5.0, 7.0)
    found = ss.coverage(ring, size, mode=mode, window=window)
    assert found.shape == (50, 60)
    shifted = ss.coverage(ring - window[:2], (60, 50), mode=mode)
    if mode == "area":
        assert np.abs(found - shifted).max() < 2.0**-40
    else:
        assert np.array_equal(found, shifted)
    parts = [ss.coverage(ring, size, mode=mode, window=(131_000 + i, 200_000, 20, 50)) for i in (0, 20, 40)]
    assert np.array_equal(np.concatenate(parts, axis=1), found)


def test_wide_polygons_are_cut_at_fixed_columns(rng):
    # Four tiles of shares, and windows that begin and end within them.
    size = (7000, 3)
    ring = rng.uniform(0, 1, (60, 2)) * size
    whole = ss.coverage(ring, size, mode="area")
    assert abs(whole.sum() - abs(ss.coverage(ring, (7100, 4), mode="area").sum())) < 1e-9
    for start, width in ((0, 10), (2040, 30), (4095, 2), (6900, 100), (100, 6000)):
        assert np.array_equal(
            ss.coverage(ring, size, mode="area", window=(start, 1, width, 2)), whole[1:, start : start + width]
        )


def test_any_number_of_threads_gives_the_same_bits(rng):
    many = rng.uniform(0, 600, (300, 1, 2)) + rng.uniform(-30, 30, (300, 20, 2))
    values = rng.normal(size=300)
    for options in ({"reduce": "mean"}, {"mode": "touched", "reduce": "sum"}, {"mode": "area", "reduce": "sum"},
                    {"mode": "area", "reduce": "majority"}):  # fmt: skip
        one, three = (ss.zones(many, (600, 500), values=values, threads=n, **options) for n in (1, 3))
        assert np.array_equal(one, three, equal_nan=True)


def test_nothing_at_all():
    for polygons in ([], [[]], [None, {"type": "Polygon", "coordinates": []}]):
        assert (ss.zones(polygons, (3, 2)) == -1).all()
        assert not ss.zones(polygons, (3, 2), reduce="count", mode="touched").any()
        assert (ss.zones(polygons, (3, 2), reduce="majority", mode="area") == -1).all()
    assert not ss.coverage([], (3, 2), mode="touched").any()
    assert not ss.coverage([], (3, 2), mode="area").any()


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


@pytest.mark.parametrize(
    ("options", "message"),
    [({"reduce": "middle"}, "unknown reduce 'middle'"), ({"reduce": 3}, "unknown reduce 3"),
     ({"mode": "centre"}, "unknown mode 'centre'; did you mean 'center'"), ({"reduce": "sum"}, "'sum': needs values, one for"),
     ({"reduce": "mean"}, "'mean': needs values"),
     ({"reduce": "majority"}, "compares areas and needs mode 'area', got 'center'"),
     ({"reduce": "first", "mode": "area"}, "reduce = 'first': means nothing for mode 'area', which weighs; use mode 'touched'"),
     ({"values": [1, 2]}, r"values: expected shape \(1,\), one for each polygon, got \(2,\)"),
     ({"values": ["a"]}, "values: expected an array of numbers"),
     ({"values": [2**60, ], "reduce": "sum"}, "values: sums of whole numbers may pass 2\\^53"),
     ({"background": 0.5}, "background = 0.5: expected one number that int32 holds"),
     ({"values": np.array([1], np.uint8), "background": -1}, "background = -1: expected one number that uint8 holds"),
     ({"background": [1, 2]}, r"background = \[1, 2\]: expected one number"),
     ({"background": float("nan")}, "background = nan"),
     ({"fill_rule": "odd"}, "unknown fill rule 'odd'"), ({"subpixel_bits": 3}, "subpixel_bits = 3"),
     ({"threads": 0}, "threads = 0"),
     ({"size": (0, 3)}, r"size = \(0, 3\): expected \(width, height\)"), ({"size": 5}, "size = 5: expected"),
     ({"size": (2**18 + 1, 1)}, "the limit is 262144 for a side"),
     ({"size": (2**17, 2**17)}, "size = 131072 x 131072 pixels: the limit is 268435456 in all; ask for one window="),
     ({"window": (0, 0, 3)}, "window = .*: expected .x_start, y_start, width, height."),
     ({"window": (-1, 0, 1, 1)}, "window = .-1, 0, 1, 1.: expected"),
     ({"window": (0, 0, 0, 1)}, "window = .0, 0, 0, 1.: expected"),
     ({"window": (2, 0, 2, 1)}, r"window = \(2, 0, 2, 1\): reaches beyond the image of 3 x 3 pixels"),
     ({"polygons": 3}, "polygons: expected polygons: rings"), ({"polygons": "x"}, "polygons: expected polygons: .* got 'x'"),
     ({"polygons": [SQUARE, [(0, 0), (1, float("inf")), (1, 1)]]}, r"polygons\[1\]\[1\] = \[1.0, inf\]: expected finite"),
     ({"polygons": [[(0, 0), (1 << 25, 0), (0, 1)]]}, r"polygons\[0\]: the point \[33554432.0, 0.0\] is more than")],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_used_is_quoted(options, message):
    arguments = {"polygons": [SQUARE], "size": (3, 3)} | options
    with pytest.raises(ss.InputError, match=message):
        ss.zones(**arguments)


def test_blocks_check_their_block():
    for block, quoted in ((0, "0"), ("x", "'x'"), ((2, 0), ".2, 0."), (1.5, "1.5"), (True, "True")):
        with pytest.raises(ss.InputError, match=f"block = {quoted}: expected the side of a block, or its"):
            ss.blocks(ss.zones, [SQUARE], (3, 3), block)


PLAIN = """
import hashlib
import numpy as np
import scanspan as ss

rng = np.random.default_rng(7)
polygons = [[rng.uniform(-3, 15, (5, 2)), np.rint(rng.uniform(-3, 15, (4, 2)))] for _ in range(6)]
polygons.append([polygons[0][0], polygons[0][0][::-1]])
digest = hashlib.sha256()
for rule in ("even-odd", "abs-geq-two"):
    for options in ({}, {"mode": "touched"}, {"mode": "touched", "reduce": "sum"}, {"reduce": "count"},
                    *({"mode": "area", "reduce": reduce} for reduce in ("sum", "count", "majority"))):
        digest.update(ss.zones(polygons, (12, 9), values=np.arange(7) / 4, fill_rule=rule, **options).tobytes())
far = np.array([(-3e6, 4.0), (9e6, 5.1), (8e6, 5.3), (-3e6, 4.1)])
digest.update(ss.coverage([far, far[::-1] + 0.001], (12, 9), mode="touched", fill_rule="positive", subpixel_bits=16).tobytes())
print(digest.hexdigest())
"""


def test_plain_python_gives_the_bits_of_the_compiled_kernels():
    printed = [
        subprocess.run(
            [sys.executable, "-W", "error", "-c", PLAIN], env={**os.environ, **changed}, capture_output=True, text=True
        )
        for changed in ({}, {"NUMBA_DISABLE_JIT": "1"})
    ]
    assert [ended.stderr[-2000:] for ended in printed] == ["", ""]
    assert printed[0].stdout == printed[1].stdout


def test_no_kernel_is_compiled_twice_for_odd_inputs():
    kernels = [spans.cut_spans, spans.rank_spans, spans.count_spans, spans.sum_spans, touched.touch_spans, shares.add_shares,
               shares.sum_shares, shares.largest_share]  # fmt: skip
    before = [signature_count(kernel) for kernel in kernels]
    ring = np.array([(0, 0), (5, 0.5), (3, 4.5)])
    frozen = ring.copy()
    frozen.flags.writeable = False
    forms = [
        ring,
        ring.tolist(),
        np.asfortranarray(ring),
        ring.astype(np.float32),
        frozen,
        ring[::-1][::-1],
        ring.astype(">f8"),
    ]
    pictures = []
    for form in [*([form] for form in forms), ss.Polygons([ring]), [shapely.Polygon(ring)]]:
        for mode, reduce in (
            ("center", "last"),
            ("center", "mean"),
            ("touched", "sum"),
            ("area", "mean"),
            ("area", "majority"),
        ):
            window = tuple(np.array([0, 0, 5, 4], np.int16))
            found = ss.zones(form, (np.int16(8), 6), values=np.array([2], ">i2"), mode=mode, reduce=reduce, window=window)
            pictures.append(found.astype(float))
    assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(pictures, pictures[5:], strict=False))
    after = [signature_count(kernel) for kernel in kernels]
    assert all(count <= max(1, old) for count, old in zip(after, before, strict=True))


def test_every_reduction_is_tested():
    assert set(REDUCTIONS) == {"first", "last", "min", "max", "count", "sum", "mean", "majority"}
