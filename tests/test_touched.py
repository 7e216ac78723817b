"""Touched pixels: against rationals under every fill rule, and against areas; and the exact signs that they rest on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.raster.triple import DIGITS, cross_sign, triple_sign
from tests.maps import FILLED, touched

SIZE = (5, 4)
RULES = list(FILLED)


def in_pixels(rings, bits):
    return [np.array(ring) / 2.0**bits for ring in rings]


def check(rings, size=SIZE, bits=4, rules=RULES):
    for rule in rules:
        found = ss.coverage(in_pixels(rings, bits), size, mode="touched", fill_rule=rule, subpixel_bits=bits)
        assert np.array_equal(found, touched(rings, size, rule, bits)), (rule, rings)


def random_rings(rng, step, count):
    """Return rings on a lattice, which makes ties, with some that lie on others."""
    low, high = -16 // step, (16 * max(SIZE) + 16) // step
    rings = [[(int(x) * step, int(y) * step) for x, y in rng.integers(low, high + 1, (int(rng.integers(3, 7)), 2))]
             for _ in range(count)]  # fmt: skip
    kind = int(rng.integers(4))
    if kind == 1:
        rings.append(rings[0][::-1])
    elif kind == 2:
        rings.append(list(rings[0]))
    elif kind == 3:
        (x0, y0), (x1, y1) = rings[0][:2]
        rings.append([rings[0][0], rings[0][1], ((x0 + x1) // 2, (y0 + y1) // 2)])
    return rings


@pytest.mark.parametrize("step", [1, 2, 4, 8, 16])
def test_every_fill_rule_equals_rationals(rng, step):
    for _ in range(40):
        check(random_rings(rng, step, int(rng.integers(1, 4))))


@pytest.mark.parametrize("rule", RULES)
def test_another_rule_is_noticed(rng, rule):
    other = RULES[RULES.index(rule) - 1]
    found = 0
    for _ in range(20):
        rings = random_rings(rng, 4, 2)
        mask = ss.coverage(in_pixels(rings, 4), SIZE, mode="touched", fill_rule=rule, subpixel_bits=4)
        found += not np.array_equal(mask, touched(rings, SIZE, other, 4))
    assert found


def test_lines_that_all_but_meet_in_a_point():
    # Slivers far below 2^-40 px in area: three long edges whose crossings lie in one pixel, moved by single sub-pixels.
    for shift in range(-2, 3):
        far = 1 << 38
        ring = [(-far, 3 - far), (far + shift, far), (far, 1 - far), (-far, far), (7, -far), (9 + shift, far)]
        check([ring], bits=16)
        check([ring, ring[::-1]], bits=16, rules=["positive", "negative", "abs-geq-two"])


@given(st.lists(st.tuples(st.integers(-20, 90), st.integers(-20, 80)), min_size=3, max_size=7), st.sampled_from(RULES))
def test_any_ring_equals_rationals(ring, rule):
    check([ring], rules=[rule])


def test_touched_is_an_area_above_nothing(rng):
    for _ in range(10):
        points = rng.uniform(-2, 22, (int(rng.integers(3, 8)), 2))
        for rule in RULES:
            found = ss.coverage(points, (20, 20), mode="touched", fill_rule=rule, subpixel_bits=16)
            area = ss.coverage(points, (20, 20), mode="area", fill_rule=rule)
            assert (found[area > 2.0**-40]).all()
            assert (np.abs(area[~found]) <= 2.0**-40).all()


def test_centres_are_touched_and_wholes_are_centres(rng):
    points = rng.uniform(-5, 45, (12, 2))
    center, area = ss.coverage(points, (40, 40)), ss.coverage(points, (40, 40), mode="area")
    found = ss.coverage(points, (40, 40), mode="touched")
    assert not (center & ~found).any()
    assert not ((area > 0.999) & ~center).any()
    assert (found & ~center).any()


@pytest.mark.parametrize(
    ("ring", "expected"),
    [([(1, 1), (3, 1), (3, 2), (1, 2)], 2), ([(1.5, 1), (2.5, 1), (2.5, 2), (1.5, 2)], 2), ([(1, 1), (3, 1), (1, 1)], 0),
     ([(0.5, 0.5), (4.5, 0.5), (0.5, 0.5)], 0), ([(1, 1), (2, 1), (2, 2)], 1), ([(0, 0), (4, 4), (4, 3.9), (0, -0.1)], 7),
     ([(2, 2), (2.01, 2), (2.01, 2.01)], 1), ([(1.9, 1.9), (2.1, 1.9), (2.1, 2.1), (1.9, 2.1)], 4)],
    ids=str,
)  # fmt: skip
def test_what_only_runs_along_a_pixel_does_not_touch_it(ring, expected):
    assert int(ss.coverage(ring, SIZE, mode="touched").sum()) == expected


def test_a_bridge_that_goes_to_and_fro_touches_nothing():
    left, right = [(0.2, 0.2), (0.8, 0.2), (0.8, 0.4)], [(4.2, 0.4), (4.2, 0.2), (4.8, 0.2), (4.8, 0.8), (4.2, 0.8), (4.2, 0.4)]
    islands = [*left, *right, (0.8, 0.4), (0.8, 0.8), (0.2, 0.8)]
    for rule in ("even-odd", "non-zero"):
        assert ss.coverage(islands, (5, 1), mode="touched", fill_rule=rule).tolist() == [[True, False, False, False, True]]


def test_two_squares_on_each_other():
    square, half = [(0.5, 0.5), (3.5, 0.5), (3.5, 2.5), (0.5, 2.5)], [(1.5, 0.5), (3.5, 0.5), (3.5, 2.5), (1.5, 2.5)]
    counts = {rule: int(ss.coverage([square, half], SIZE, mode="touched", fill_rule=rule).sum()) for rule in RULES}
    assert counts == {"even-odd": 6, "non-zero": 12, "positive": 0, "negative": 12, "abs-geq-two": 9}


@pytest.mark.parametrize("rule", RULES)
def test_thousands_of_edges_in_a_pixel(rule):
    angle = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    circle = np.c_[0.4 * np.cos(angle), 0.4 * np.sin(angle)]
    rings = [circle + np.array(middle) for middle in ((1.45, 1.5), (3.45, 1.5), (3.55, 1.5))]
    found = ss.coverage(
        [*rings, (circle + np.array((1.55, 1.5)))[::-1]], (5, 4), mode="touched", fill_rule=rule, subpixel_bits=16
    )
    columns = {"positive": [1], "negative": [1, 3], "abs-geq-two": [3]}.get(rule, [1, 3])
    assert np.argwhere(found).tolist() == [[1, column] for column in columns]


# Other tools' bugs


def test_xarray_spatial_3102_a_thin_diagonal_strip_touches_all_that_it_crosses():
    # Bresenham's line, which burned 11 pixels here, goes from corner to corner and leaves out the pixels beside it.
    strip = [(0.4, 0.6), (10.4, 10.6), (10.6, 10.4), (0.6, 0.4)]
    found = ss.coverage(strip, (11, 11), mode="touched")
    j, i = np.indices((11, 11))
    assert np.array_equal(found, np.abs(i - j) <= 1)
    assert int(found.sum()) == 31


def test_xarray_spatial_2169_a_slanted_sliver_has_no_gaps():
    sliver = [(0.5, 0.5), (4.5, 4.25), (4.5, 4.26)]
    found = ss.coverage(sliver, (5, 5), mode="touched")
    assert int(found.sum()) == 9
    assert np.array_equal(found, touched([[(128, 128), (1152, 1088), (1152, 1091)]], (5, 5), "even-odd", 8))


def test_rasterio_1436_all_touched_is_what_is_touched():
    rasterio = pytest.importorskip("rasterio.features")
    ring = [(1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)]
    burned = (
        rasterio.rasterize([{"type": "Polygon", "coordinates": [[*ring, ring[0]]]}], out_shape=(6, 6), all_touched=True) > 0
    )
    found = ss.coverage(ring, (6, 6), mode="touched")
    assert int(found.sum()) == 6
    # GDAL takes borders of pixels for pixels, on some sides; it never misses what is touched.
    assert not (found & ~burned).any()
    assert int(burned.sum()) >= 6


def test_rasterio_never_leaves_out_what_is_touched(rng, report):
    rasterio = pytest.importorskip("rasterio.features")
    more = less = total = 0
    for _ in range(100):
        angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
        ring = np.rint((np.c_[np.cos(angle), np.sin(angle)] * rng.uniform(3, 15) + 16) * 256) / 256
        burned = rasterio.rasterize([{"type": "Polygon", "coordinates": [[*ring.tolist(), ring[0].tolist()]]}],
                                    out_shape=(32, 32), all_touched=True) > 0  # fmt: skip
        found = ss.coverage(ring, (32, 32), mode="touched")
        more, less, total = more + int((burned & ~found).sum()), less + int((found & ~burned).sum()), total + int(found.sum())
    report(f"of {total} touched pixels rasterio's all_touched leaves out {less}, and adds {more} others")
    assert less + more <= total // 1000


# Signs


def determinant(lines):
    (a0, b0, c0), (a1, b1, c1), (a2, b2, c2) = lines
    return a2 * (b0 * c1 - c0 * b1) + b2 * (c0 * a1 - a0 * c1) + c2 * (a0 * b1 - b0 * a1)


def test_signs_of_three_lines_are_exact(rng):
    digits = np.empty(DIGITS, np.int64)
    for bits in (3, 20, 42, 59):
        for _ in range(300):
            lines = [[int(v) for v in rng.integers(-(1 << bits), 1 << bits, 3)] for _ in range(3)]
            if bits < 59:
                # All but a sum of the others, so that float64 cannot tell.
                lines[2] = [p - q for p, q in zip(lines[0], lines[1], strict=True)]
                lines[2][int(rng.integers(3))] += int(rng.integers(-1, 2))
            exact = determinant(lines)
            found = triple_sign_of(lines, digits)
            assert found == (exact > 0) - (exact < 0), lines


def triple_sign_of(lines, digits):
    return triple_sign.py_func(*(np.int64(v) for line in lines for v in line), digits)


def test_signs_of_two_directions_are_exact(rng):
    for a, b in pairwise(rng.integers(-(1 << 41), 1 << 41, (200, 2)).tolist()):
        scaled = [a[0] // 3 * 3, a[1] // 3 * 3]
        third = [scaled[0] // 3 + int(rng.integers(-1, 2)), scaled[1] // 3]
        for p, q in ((a, b), (scaled, third)):
            exact = p[0] * q[1] - p[1] * q[0]
            assert cross_sign.py_func(*(np.int64(v) for v in (*p, *q))) == (exact > 0) - (exact < 0)
