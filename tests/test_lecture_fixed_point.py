"""The lectures' triangles in 12-bit fixed point, against the pixels of the Java program itself; each fault in numbers."""

from __future__ import annotations

import numpy as np
import pytest

from scanspan.lectures import fixed_point_faults as faults
from scanspan.lectures.compare import shipped_channel, shipped_hits
from scanspan.lectures.fixed_point import FixedFlatTriangle, FixedSmoothTriangle, java_int, steps, wrap
from scanspan.lectures.raster import Raster, Vertex, pack_argb, unpack_argb, vertices
from scanspan.records import Int32Array

COLORS = [(255, 40, 0, 255), (10, 200, 90, 128), (3, 60, 250, 7)]

# The program of S4, with `argb` spelled one way, was run under a JDK 17: the size, whether it is smooth, the corners, the
# variable `area`, the pixels that are not 0, and java.util.Arrays.hashCode of all pixels.
RUNS = [
    ((40, 30), False, [(3, 2), (35, 9), (11, 28)], 3178496, 391, -1564168492),
    ((40, 30), True, [(3, 2), (35, 9), (11, 28)], 3178496, 391, -2136915484),
    ((40, 30), True, [(35, 9), (3, 2), (11, 28)], 3178496, 391, 1317756464),
    ((40, 30), True, [(-20.5, -7.25), (70.125, 4.875), (11.3, 61.7)], 24014924, 1194, -1904919390),
    ((64, 64), True, [(5.1, 5.2), (60.9, 58.3), (31.7, 34.1)], 819855, 102, -1725803656),
    ((64, 64), True, [(5.1, 5.2), (60.9, 58.3), (33.0, 31.76)], 2284, 1, 486353560),
    ((1024, 768), False, [(0, 0), (1024, 0), (0, 768)], 2147483647, 175275, 1198860006),
    ((511, 511), False, [(-511, -511), (511, -511), (511, 511)], 16760832, 0, 864518175),
    ((90, 90), True, [(-2000, -900), (1900, -1200), (300, 2100)], 2147483645, 1, -1850426590),
    ((1024, 768), True, [(830.0, 700.0), (837.82, 706.23), (834.14, 703.33)], 1020, 1, -397165813),
    ((20, 20), True, [(1e9, 5), (-3e9, -2e8), (7, 1e12)], -2147483648, 20, 1974355393),
]


def java_hash(pixels: Int32Array) -> int:
    """Return what java.util.Arrays.hashCode returns: 31 h + p for one pixel after the other, in 32 bits."""
    value = 1
    for pixel in pixels.ravel().tolist():
        value = (31 * value + pixel) & 0xFFFFFFFF
    return wrap(value)


@pytest.mark.parametrize(("size", "is_smooth", "points", "area", "drawn", "hashed"), RUNS)
def test_every_pixel_is_the_java_programs(
    size: tuple[int, int], is_smooth: bool, points: list[tuple[float, float]], area: int, drawn: int, hashed: int
) -> None:
    raster = Raster(*size)
    triangle = (FixedSmoothTriangle if is_smooth else FixedFlatTriangle)(*vertices(points, COLORS))
    triangle.draw(raster)
    assert (triangle.area, int((raster.argb != 0).sum()), java_hash(raster.argb)) == (area, drawn, hashed)


def test_the_java_programs_crash_is_ours() -> None:
    # Under the JDK: ArrayIndexOutOfBoundsException, Index 6 out of bounds for length 6.
    with pytest.raises(IndexError, match=r"^sort\[6\] for x: the table has rows 0 to 5$"):
        FixedFlatTriangle(*vertices([(48.8, 77.4), (48.8, 74.9), (48.8, 24.1)])).draw(Raster(90, 90))
    with pytest.raises(IndexError, match=r"^sort\[6\] for y"):
        FixedFlatTriangle(*vertices([(77.4, 48.8), (74.9, 48.8), (24.1, 48.8)])).draw(Raster(90, 90))


def test_rows_that_wrap_around_leave_the_raster() -> None:
    # Under the JDK: Index 2398 out of bounds for length 2397.
    points = [(-363325472.0, -249007232.0), (-970660864.0, -364074496.0), (348862592.0, -72270704.0)]
    with pytest.raises(IndexError, match=r"^pixel\[2397\]: the raster has 2397$"):
        FixedFlatTriangle(*vertices(points)).draw(Raster(51, 47))


def test_the_casts_and_sums_of_java() -> None:
    assert [java_int(x) for x in (1.9, -1.9, 3e9, -3e9, float("inf"), float("-inf"), float("nan"))] == [
        1, -1, 2**31 - 1, -(2**31), 2**31 - 1, -(2**31), 0,
    ]  # fmt: skip
    assert [wrap(x) for x in (2**31 - 1, 2**31, -(2**31) - 1, 2**32 + 5)] == [2**31 - 1, -(2**31), 2**31 - 1, 5]
    assert steps(2**31 - 2, 1, 4).tolist() == [2**31 - 2, 2**31 - 1, -(2**31), -(2**31) + 1]
    for color in ((1, 2, 3, 4), (255, 255, 255, 255), (9, 8, 7, 200)):
        assert unpack_argb(pack_argb(color)) == color


# What the slide gets right


def test_whole_coordinates_give_the_shipped_pixels(rng: np.random.Generator) -> None:
    for _ in range(60):
        points = rng.integers(-40, 140, (3, 2))
        raster = Raster(100, 80)
        FixedFlatTriangle(*vertices(points)).draw(raster)
        assert np.array_equal(raster.hits, shipped_hits([points], (100, 80), "inclusive"))


def test_the_speed_hack_changes_work_and_not_pixels(rng: np.random.Generator) -> None:
    tested = [0, 0]
    for _ in range(30):
        points = rng.uniform(-20, 120, (3, 2))
        rasters = [Raster(100, 80), Raster(100, 80)]
        for k, raster in enumerate(rasters):
            FixedSmoothTriangle(*vertices(points, COLORS), early_out=k == 0).draw(raster)
            tested[k] += raster.tested
        assert np.array_equal(rasters[0].argb, rasters[1].argb)
    assert tested[0] < 0.8 * tested[1]


def test_colours_are_right_within_a_level_where_the_triangle_is_large(rng: np.random.Generator) -> None:
    for _ in range(20):
        points = rng.integers(0, 60, (3, 2))
        if abs(faults.fixed_area(points)) < 400 * 4096:
            continue
        raster = Raster(60, 60)
        FixedSmoothTriangle(*vertices(points, COLORS)).draw(raster)
        shipped = shipped_channel(points, COLORS, (60, 60))
        assert np.abs(raster.rgba - shipped)[raster.covered].max() <= 1.0


# What it gets wrong


@pytest.mark.parametrize(
    ("width", "height", "wrong"),
    [(640, 480, 0), (800, 600, 0), (724, 724, 0), (725, 725, 1449), (1024, 512, 511), (1024, 768, 218964)],
)
def test_c_is_held_from_724_pixels_on(width: int, height: int, wrong: int) -> None:
    found = faults.demonstrate_overflow(width, height)
    assert (found.wrong_pixels, found.shipped_wrong_pixels, found.pixels) == (wrong, 0, width * height)
    assert (found.largest != found.exact) == (wrong > 0) == (width * height >= faults.MAX_PRODUCT)


@pytest.mark.parametrize(
    ("n", "area", "is_right"), [(362, 2147024896, True), (363, -2136064000, False), (511, -16760832, False)]
)
def test_the_sum_of_c_wraps_around_from_362_pixels_on(n: int, area: int, is_right: bool) -> None:
    found = faults.demonstrate_area_wrap(n)
    assert (found.area, found.shipped_wrong_pixels) == (area, 0)
    assert (found.wrong_pixels == 0) == (found.area == found.exact) == is_right


def test_lines_miss_their_own_vertices() -> None:
    short, long = faults.demonstrate_missed_vertices(1.0), faults.demonstrate_missed_vertices(100.0)
    assert short.median == pytest.approx(0.05, abs=0.005)
    assert short.worst == pytest.approx(0.25, abs=0.015)
    assert long.worst == pytest.approx(0.0024, abs=0.0003)
    assert short.snapped_worst == long.snapped_worst == 0


def test_small_triangles_are_turned_and_lost() -> None:
    # 7655 and 23643 of 49999 in the notes; other random triangles, the same shares.
    found = faults.demonstrate_small_triangles(0.02)
    assert found.turned / found.triangles == pytest.approx(7655 / 49999, abs=0.015)
    assert found.dropped / found.triangles == pytest.approx(23643 / 49999, abs=0.02)
    larger = faults.demonstrate_small_triangles(1.0)
    assert 0 < larger.turned + larger.dropped < 0.003 * larger.triangles


def test_triangles_of_no_width_crash() -> None:
    found = faults.demonstrate_index_crash()
    assert (found.crashes, found.shipped_pixels) == (1, 0)
    harmless = faults.demonstrate_index_crash([(1, 1), (9, 1), (1, 9)])
    assert (harmless.crashes, harmless.message) == (0, "")


def test_slivers_with_a_width_crash_as_well() -> None:
    # 171161 of 200000 in the notes.
    found = faults.demonstrate_sliver_crash()
    assert found.crashes / found.triangles == pytest.approx(0.86, abs=0.02)


@pytest.mark.parametrize(
    ("points", "error"),
    [
        (((828.0, 700.0), (828.91, 700.42), (828.57, 700.35)), 101),
        (faults.THIN, 209),
        (((478.0, 234.0), (558.39, 293.48), (499.47, 249.9)), 28),
        (((10.0, 10.0), (50.0, 12.0), (20.0, 60.0)), 0),
    ],
)
def test_a_constant_channel_is_not_constant(points: tuple[tuple[float, float], ...], error: int) -> None:
    found = faults.demonstrate_constant_channel(points)
    assert (found.worst_error, found.shipped_worst_error) == (error, 0.0)
    assert found.drawn > 0


def test_thin_slivers_far_away_hold_their_gradient() -> None:
    assert not faults.demonstrate_gradient(600, 600 / 2050).is_held
    assert faults.demonstrate_gradient(600, 600 / 2060).is_held


def test_the_cached_scale_and_the_flat_path() -> None:
    flat = FixedSmoothTriangle(Vertex(1, 1), Vertex(9, 1), Vertex(1, 9))
    assert flat.is_flat
    flat_raster, smooth_raster = Raster(10, 10), Raster(10, 10)
    flat.draw(flat_raster)
    flat.is_flat = False
    flat.draw(smooth_raster)
    assert np.array_equal(flat_raster.argb, smooth_raster.argb)
    assert (flat.scale, flat.area) == (4096 / flat.area, 64 * 4096)
