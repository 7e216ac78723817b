"""Lines: the pixels of every rule against closed forms and exact rationals, in all octants, at any distance, compiled and not.

The oracles work with fractions and look at one pixel at a time; nothing is stepped and nothing is clipped. Pixels are counted,
so one that is touched twice shows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from fractions import Fraction
from itertools import pairwise, product
from math import ceil, floor
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import scanspan as ss
from scanspan.jit import kernel
from scanspan.raster.segment import DDA, DIAMOND_EXIT, MIDPOINT, RUN_LENGTH, SYMMETRIC, draw_segments
from scanspan.raster.write import write_sample_hit

Point = tuple[int, int]
Segment = tuple[int, int, int, int]
Size = tuple[int, int]

WHOLE_RULES = [MIDPOINT, DDA, SYMMETRIC, RUN_LENGTH]
RULES = [*WHOLE_RULES, DIAMOND_EXIT]
FAR = 1 << 24
HALF = Fraction(1, 2)

# How far a segment is moved before its diamonds are looked at: less than any distance that can occur here.
SHIFT_X, SHIFT_Y = Fraction(1, 1 << 120), Fraction(1, 1 << 240)


@kernel
def count_segments(
    target: NDArray[np.int32], segments: NDArray[np.int64], values: NDArray[np.float64], rule: int, subpixel_bits: int
) -> None:
    """Count how often each pixel is touched."""
    height, width = np.int64(target.shape[0]), np.int64(target.shape[1])
    flat = target.reshape(target.shape[0] * target.shape[1])
    draw_segments(write_sample_hit, flat, width, np.int64(0), height, segments, values, rule, subpixel_bits)


def touched(segments: Any, rule: int, size: Size, bits: int = 8) -> NDArray[np.int32]:
    """Return how often each pixel is touched, (H, W)."""
    rows = np.array(segments, np.int64).reshape(-1, 4)
    target = np.zeros((size[1], size[0]), np.int32)
    count_segments(target, rows, np.ones(len(rows)), rule, bits)
    return target


def pixels_of(counts: NDArray[np.int32]) -> set[Point]:
    """Return the pixels (x, y) that were touched; none may have been touched twice."""
    assert counts.max(initial=0) <= 1
    return {(int(x), int(y)) for y, x in np.argwhere(counts)}


def drawn(segment: Segment, rule: int, margin: int = 2) -> list[Point]:
    """Return the pixels of one segment, drawn on a canvas that holds all of it, in order along its longer side."""
    x0, y0, x1, y1 = segment
    left, top = min(x0, x1) - margin, min(y0, y1) - margin
    size = (abs(x1 - x0) + 1 + 2 * margin, abs(y1 - y0) + 1 + 2 * margin)
    moved = (x0 - left, y0 - top, x1 - left, y1 - top)
    found = [(x + left, y + top) for x, y in pixels_of(touched(moved, rule, size))]
    along = 1 if abs(y1 - y0) > abs(x1 - x0) else 0
    sign = 1 if segment[2 + along] >= segment[along] else -1
    return sorted(found, key=lambda pixel: sign * pixel[along])


def pixel_at(segment: Segment, k: int, rule: int) -> Point:
    """Return pixel k of a segment: the oracle. Round the exact place; on a tie stay (midpoint) or take the larger (dda)."""
    x0, y0, x1, y1 = segment
    if rule == SYMMETRIC and (y1, x1) < (y0, x0):
        across, down = x1 - x0, y1 - y0
        return pixel_at((x1, y1, x0, y0), max(abs(across), abs(down)) - k, MIDPOINT)
    across, down = x1 - x0, y1 - y0
    length = max(abs(across), abs(down), 1)
    is_steep = abs(down) > abs(across)
    start, aside = (x0, across) if is_steep else (y0, down)
    place = start + Fraction(aside * k, length)
    if rule == DDA:
        minor = floor(place + HALF)
    else:
        minor = ceil(place - HALF) if aside >= 0 else floor(place + HALF)
    step = (1 if (down if is_steep else across) >= 0 else -1) * k
    return (minor, y0 + step) if is_steep else (x0 + step, minor)


def expected(segment: Segment, rule: int) -> list[Point]:
    """Return all pixels of a segment, from its first to its last."""
    length = max(abs(segment[2] - segment[0]), abs(segment[3] - segment[1]))
    return [pixel_at(segment, k, rule) for k in range(length + 1)]


def in_octants(across: int, down: int) -> set[Point]:
    """Return a direction turned and mirrored into all octants."""
    return {(s * u, t * v) for u, v in ((across, down), (down, across)) for s, t in product((1, -1), repeat=2)}


def diamonds_left(segment: Segment, size: Size, bits: int) -> set[Point]:
    """Return the pixels whose open diamond a segment meets and does not end in, after it is moved by -(e, e^2): the oracle."""
    x0, y0, x1, y1 = (Fraction(v, 1 << bits) for v in segment)
    x0, x1, y0, y1 = x0 - SHIFT_X, x1 - SHIFT_X, y0 - SHIFT_Y, y1 - SHIFT_Y
    across, down = x1 - x0, y1 - y0
    found = set()
    for i, j in product(range(size[0]), range(size[1])):
        u, v = x0 - i - HALF, y0 - j - HALF

        # The distance is convex along the segment and bends where it passes the centre: the least is at a bend or at an end.
        bends = [-u / across] if across else []
        bends += [-v / down] if down else []
        places = [Fraction(0), Fraction(1), *(t for t in bends if 0 < t < 1)]
        least = min(abs(u + t * across) + abs(v + t * down) for t in places)
        if least < HALF <= abs(u + across) + abs(v + down):
            found.add((i, j))
    return found


def test_midpoint_is_the_loop_of_the_lectures() -> None:
    for length in range(1, 40):
        for height in range(length + 1):
            # Follow f at the midpoint between the two candidates; below the line f is negative.
            y, loop = 0, []
            for x in range(length + 1):
                loop.append((x, y))
                y += 1 if -height * (x + 1) + length * (y + HALF) < 0 else 0
            assert drawn((0, 0, length, height), MIDPOINT) == loop


@pytest.mark.parametrize("rule", WHOLE_RULES)
def test_pixels_are_rounded_places_in_all_octants(rule: int) -> None:
    for length in range(18):
        for height in range(length + 1):
            for across, down in in_octants(length, height):
                segment = (3, -5, 3 + across, -5 + down)
                assert drawn(segment, rule) == expected(segment, rule)


def test_midpoint_and_dda_differ_where_there_are_ties() -> None:
    both = [(length, height) for length in range(1, 40) for height in range(length + 1)]
    assert len(both) == 819
    differ = [end for end in both if drawn((0, 0, *end), MIDPOINT) != drawn((0, 0, *end), DDA)]
    assert len(differ) == 249
    ties = [(m, h) for m, h in both if any((2 * h * k) % (2 * m) == m for k in range(m))]
    assert differ == ties

    # The same lines look otherwise from their other end.
    turned = [end for end in both if drawn((0, 0, *end), MIDPOINT) != drawn((*end, 0, 0), MIDPOINT)[::-1]]
    assert turned == ties


@pytest.mark.parametrize("rule", [SYMMETRIC, DDA])
def test_symmetric_and_dda_are_the_same_from_both_ends(rule: int) -> None:
    for length in range(14):
        for height in range(length + 1):
            for end in in_octants(length, height):
                assert drawn((0, 0, *end), rule) == drawn((*end, 0, 0), rule)[::-1]


def test_symmetric_is_the_midpoint_line_from_the_end_with_the_lower_y_and_x() -> None:
    assert drawn((0, 0, 2, 1), SYMMETRIC) == drawn((0, 0, 2, 1), MIDPOINT) == [(0, 0), (1, 0), (2, 1)]
    assert drawn((2, 1, 0, 0), SYMMETRIC) == [(2, 1), (1, 0), (0, 0)]
    assert drawn((2, 1, 0, 0), MIDPOINT) == [(2, 1), (1, 1), (0, 0)]
    assert drawn((0, 1, 2, 0), SYMMETRIC) == drawn((2, 0, 0, 1), MIDPOINT)[::-1] == [(0, 1), (1, 0), (2, 0)]


@pytest.mark.parametrize("rule", WHOLE_RULES)
def test_lines_are_thin_whole_and_joined(rule: int, rng: np.random.Generator) -> None:
    for _ in range(200):
        segment: Segment = tuple(rng.integers(-30, 30, 4).tolist())
        x0, y0, x1, y1 = segment
        line = drawn(segment, rule)
        assert len(line) == max(abs(x1 - x0), abs(y1 - y0)) + 1
        assert (line[0], line[-1]) == ((x0, y0), (x1, y1))
        assert all(max(abs(x - u), abs(y - v)) == 1 for (x, y), (u, v) in pairwise(line))


@pytest.mark.parametrize("rule", WHOLE_RULES)
@pytest.mark.parametrize(
    ("segment", "line"),
    [
        ((1, 2, 1, 2), [(1, 2)]),
        ((1, 2, 4, 2), [(1, 2), (2, 2), (3, 2), (4, 2)]),
        ((4, 2, 1, 2), [(4, 2), (3, 2), (2, 2), (1, 2)]),
        ((1, 4, 1, 2), [(1, 4), (1, 3), (1, 2)]),
        ((0, 0, 2, 2), [(0, 0), (1, 1), (2, 2)]),
        ((0, 2, 2, 0), [(0, 2), (1, 1), (2, 0)]),
    ],
)
def test_points_levels_uprights_and_diagonals(segment: Segment, line: list[Point], rule: int) -> None:
    assert drawn(segment, rule) == line


@pytest.mark.parametrize("rule", RULES)
def test_clipping_moves_no_pixel(rule: int, rng: np.random.Generator) -> None:
    scale = 256 if rule == DIAMOND_EXIT else 1
    for _ in range(150):
        segments = rng.integers(-20 * scale, 100 * scale, (4, 4))
        x, y = (int(v) for v in rng.integers(0, 60, 2))
        whole = touched(segments, rule, (80, 80))
        part = touched(segments - np.tile([x * scale, y * scale], 2), rule, (13, 17))
        assert np.array_equal(part, whole[y : y + 17, x : x + 13])


@pytest.mark.parametrize("rule", WHOLE_RULES)
def test_ends_may_lie_far_away(rule: int, rng: np.random.Generator) -> None:
    size, met = (9, 7), 0
    for n in range(300):
        # Go through the image, or nearly, from one far end to another.
        x0, y0 = (int(v) for v in rng.integers(-FAR, FAR + 1, 2))
        if n % 3 == 0:
            x0 = int(rng.integers(-3, 12))
        far = rng.uniform(0.01, 1.0)
        x1, y1 = (int(np.clip(-far * v + rng.integers(-2, 10), -FAR, FAR)) for v in (x0, y0))
        segment = (x0, y0, x1, y1) if n % 2 else (x1, y1, x0, y0)

        # Ask the oracle for each row or column of the image.
        along = 1 if abs(y1 - y0) > abs(x1 - x0) else 0
        sign = 1 if segment[2 + along] >= segment[along] else -1
        steps = [sign * (place - segment[along]) for place in range(size[along])]
        length = abs(segment[2 + along] - segment[along])
        pixels = [pixel_at(segment, k, rule) for k in steps if 0 <= k <= length]
        inside = {(x, y) for x, y in pixels if 0 <= x < size[0] and 0 <= y < size[1]}
        assert pixels_of(touched(segment, rule, size)) == inside
        met += bool(inside)
    assert met > 100


@pytest.mark.parametrize(
    "segment",
    [
        (-FAR, 3, FAR, 3),
        (3, FAR, 3, -FAR),
        (-FAR, -FAR, FAR, FAR),
        (FAR, -FAR, -FAR, FAR),
        (FAR, FAR, FAR, FAR),
    ],
)
@pytest.mark.parametrize("rule", WHOLE_RULES)
def test_lines_across_all_that_is_allowed(segment: Segment, rule: int) -> None:
    x0, y0, x1, y1 = segment
    pixels = pixels_of(touched(segment, rule, (6, 5)))
    if y0 == y1 and x0 != x1:
        assert pixels == {(x, 3) for x in range(6)}
    elif x0 == x1 and y0 != y1:
        assert pixels == {(3, y) for y in range(5)}
    elif (x0, x1) == (-FAR, FAR):
        assert pixels == {(k, k) for k in range(5)}
    elif (x0, x1) == (FAR, -FAR):
        assert pixels == {(0, 0)}
    else:
        assert pixels == set()


# Diamonds


@pytest.mark.parametrize("bits", [4, 8])
def test_diamond_exit_is_the_rule_in_exact_rationals(bits: int, rng: np.random.Generator) -> None:
    size = (7, 6)
    for n in range(350):
        grid = int(rng.choice([1, 2, 4, 8])) << (bits - 4)
        segment = (rng.integers(-(3 << bits) // grid, (10 << bits) // grid, 4) * grid).tolist()
        if n % 5 == 0:
            segment[int(rng.integers(4))] = segment[int(rng.integers(4))]
        if n % 5 == 1:  # exactly diagonal
            segment[3] = segment[1] + (segment[2] - segment[0]) * int(rng.choice([-1, 1]))
        assert pixels_of(touched(segment, DIAMOND_EXIT, size, bits)) == diamonds_left(tuple(segment), size, bits), segment


@given(st.tuples(*[st.integers(-8, 40)] * 4))
@settings(max_examples=150)
def test_diamond_exit_on_a_coarse_lattice(corners: Segment) -> None:
    # Sixteenths of a pixel, in steps of an eighth: ends on centres, corners and sides of diamonds.
    x0, y0, x1, y1 = corners
    segment = (2 * x0, 2 * y0, 2 * x1, 2 * y1)
    assert pixels_of(touched(segment, DIAMOND_EXIT, (5, 5), 4)) == diamonds_left(segment, (5, 5), 4)


@pytest.mark.parametrize("bits", [8, 16])
def test_diamond_exit_from_far_away(bits: int, rng: np.random.Generator) -> None:
    size, limit, met = (5, 4), FAR << bits, 0
    for n in range(120):
        x0, y0 = (int(v) for v in rng.integers(-limit, limit + 1, 2))
        if n % 4 == 0:
            y0 = x0 * (1 if n % 8 else -1)
        far = rng.uniform(0.1, 1.0)
        x1, y1 = (int(np.clip(-far * v + rng.integers(0, 5 << bits), -limit, limit)) for v in (x0, y0))
        segment = (x0, y0, x1, y1) if n % 2 else (x1, y1, x0, y0)
        pixels = pixels_of(touched(segment, DIAMOND_EXIT, size, bits))
        assert pixels == diamonds_left(segment, size, bits)
        met += bool(pixels)
    assert met > 40


@pytest.mark.parametrize("bits", [4, 8, 16])
def test_ties_of_far_segments_are_broken_as_near_ones_are(bits: int) -> None:
    one = 1 << bits
    for across, down in sorted(in_octants(2, 1)):
        lines = []
        for reach in (1, 3 << 10, 1 << 22, 7 << 20, 3 << 21):
            # Through the place between two rows, or two columns, half way.
            x, y = (2 * one + one // 2, 2 * one) if abs(across) == 2 else (2 * one, 2 * one + one // 2)
            u, v = across * reach * one, down * reach * one
            segment = (x - u, y - v, x + u, y + v)
            pixels = pixels_of(touched(segment, DIAMOND_EXIT, (5, 5), bits))
            assert pixels == diamonds_left(segment, (5, 5), bits)
            lines.append({pixel for pixel in pixels if pixel[0 if abs(across) == 2 else 1] == 2})
        assert all(line == lines[0] for line in lines)
        assert len(lines[0]) == 1


def test_between_centres_diamond_exit_is_half_open_and_as_long_as_the_longer_side() -> None:
    for length in range(1, 14):
        for height in range(length + 1):
            for across, down in in_octants(length, height):
                start = (20 * 256 + 128, 20 * 256 + 128)
                segment = (*start, start[0] + across * 256, start[1] + down * 256)
                pixels = pixels_of(touched(segment, DIAMOND_EXIT, (40, 40)))
                assert len(pixels) == length
                assert (20, 20) in pixels
                assert (20 + across, 20 + down) not in pixels


def test_ties_of_diamond_exit_go_where_a_shift_to_the_left_and_up_sends_them() -> None:
    # From centre to centre, half way between two rows or two columns on the way; e decides, and e^2 only where e cannot.
    def between(x0: int, y0: int, x1: int, y1: int) -> set[Point]:
        return pixels_of(touched([256 * v + 128 for v in (x0, y0, x1, y1)], DIAMOND_EXIT, (4, 4)))

    assert between(0, 0, 2, 1) == {(0, 0), (1, 1)}
    assert between(0, 1, 2, 0) == {(0, 1), (1, 0)}
    assert between(0, 0, 1, 2) == {(0, 0), (0, 1)}
    assert between(1, 0, 0, 2) == {(1, 0), (0, 1)}


@pytest.mark.parametrize("steep", [False, True])
def test_a_chain_of_flat_segments_touches_each_column_once(steep: bool, rng: np.random.Generator) -> None:
    for n in range(60):
        grid = (1, 64, 128)[n % 3]
        steps = rng.integers(1, 4 * 256, 30) // grid * grid + grid
        slopes = rng.choice([-1.0, 1.0], 30) if n % 4 == 0 else rng.uniform(-1, 1, 30)
        rises = np.trunc(slopes * steps / grid).astype(np.int64) * grid
        x = np.cumsum([int(rng.integers(256)) // grid * grid, *steps])
        y = 40 * 256 + np.cumsum([int(rng.integers(256)) // grid * grid, *rises])
        chain = np.stack([y, x] if steep else [x, y], axis=1)[:: -1 if n % 2 else 1]
        segments = np.concatenate([chain[:-1], chain[1:]], axis=1)
        counts = touched(segments, DIAMOND_EXIT, (140, 140))
        assert counts.max() == 1

        # Each column whose centre is passed has one pixel; the pixel of the first end may come to that.
        columns = counts.sum(axis=1 if steep else 0)
        passed = np.zeros(140, int)
        passed[(x[0] + 127) // 256 : min((x[-1] + 127) // 256, 140)] = 1
        assert set(columns - passed) <= {-1, 0, 1}
        assert np.abs(columns - passed).sum() <= 2
        assert columns[2 : (x[-1] + 127) // 256 - 2].tolist() == passed[2 : (x[-1] + 127) // 256 - 2].tolist()


def test_a_chain_through_pixel_centres_touches_each_corner_once(rng: np.random.Generator) -> None:
    for _ in range(40):
        corners = rng.integers(2, 58, (9, 2))
        closed = np.concatenate([corners, corners[:1]])
        chain = closed * 256 + 128
        counts = touched(np.concatenate([chain[:-1], chain[1:]], axis=1), DIAMOND_EXIT, (60, 60))
        assert counts.sum() == np.abs(np.diff(closed, axis=0)).max(axis=1).sum()

        # Next to a corner only the two segments that meet there count; leave out those that come by again.
        for k, (x, y) in enumerate(corners.tolist()):
            meeting = np.concatenate([closed[k - 1 : k + 1] if k else closed[[-2, 0]], closed[k + 1 : k + 2]]) * 256 + 128
            pair = touched(np.concatenate([meeting[:-1], meeting[1:]], axis=1), DIAMOND_EXIT, (60, 60))
            assert pair[y, x] == 1


@pytest.mark.parametrize("turn", [1, -1])
def test_the_outline_of_a_convex_polygon_touches_each_pixel_once(turn: int) -> None:
    angles = np.linspace(0, 2 * np.pi, 23)[:-1]
    ring = np.rint((30 + 25 * np.stack([np.cos(angles), np.sin(angles)], axis=1)) * 256).astype(np.int64)[::turn]
    counts = touched(np.concatenate([ring, np.roll(ring, -1, axis=0)], axis=1), DIAMOND_EXIT, (60, 60))
    assert counts.max() == 1

    # It is closed: no way leads out of it over sides of pixels.
    canvas = ss.Canvas(60, 60)
    canvas.pixels[counts > 0] = 0
    canvas.flood_fill(30, 30, "red")
    assert canvas.pixels[0, 0].tolist() == [255, 255, 255, 255]


def test_a_segment_of_no_length_leaves_no_diamond() -> None:
    for x, y in product(range(0, 32, 4), repeat=2):
        assert not touched((x, y, x, y), DIAMOND_EXIT, (3, 3), 4).any()


def test_a_segment_may_lie_within_one_pixel() -> None:
    # It stays in the diamond, leaves it, comes from outside and stays, starts at the centre and leaves.
    assert pixels_of(touched((130, 128, 250, 128), DIAMOND_EXIT, (1, 1))) == set()
    assert pixels_of(touched((130, 128, 257, 128), DIAMOND_EXIT, (1, 1))) == {(0, 0)}
    assert pixels_of(touched((8, 8, 40, 8), DIAMOND_EXIT, (1, 1))) == set()
    assert pixels_of(touched((128, 128, 250, 250), DIAMOND_EXIT, (1, 1))) == {(0, 0)}


def test_segments_come_in_order_and_none_draw_nothing() -> None:
    assert not touched(np.empty((0, 4)), MIDPOINT, (3, 3)).any()
    canvas = ss.Canvas(3, 3)
    canvas.lines([[(0, 1), (2, 1)], [(1, 0), (1, 2)]], [(255, 0, 0), (0, 0, 255)])
    assert canvas.pixels[1].tolist() == [[255, 0, 0, 255], [0, 0, 255, 255], [255, 0, 0, 255]]


PLAIN = """
import json, sys
import numpy as np
from scanspan.target.paint import SEGMENTS
case = json.load(sys.stdin)
pictures = []
for rule in range(5):
    segments = np.array(case["subpixels" if rule == 3 else "pixels"], np.int64)
    target = np.zeros((9, 12), np.int32)
    SEGMENTS["opaque"](target, segments, np.arange(len(segments)) + 1.0, rule, 8)
    pictures.append(target.tolist())
print(json.dumps(pictures))
"""


def test_plain_python_gives_what_the_compiled_kernels_give(rng: np.random.Generator) -> None:
    near, far = rng.integers(-10 * 256, 20 * 256, (90, 4)), rng.integers(-FAR * 256, FAR * 256, (60, 4))
    far[:30, 2:] = -far[:30, :2] // 3
    subpixels = np.concatenate([near, far, near[:5, [0, 1, 0, 1]]])
    pictures = []
    for environment in ({}, {"NUMBA_DISABLE_JIT": "1"}):
        run = subprocess.run(
            [sys.executable, "-W", "error", "-c", PLAIN],
            input=json.dumps({"pixels": (subpixels // 256).tolist(), "subpixels": subpixels.tolist()}),
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr[-2000:]
        pictures.append(json.loads(run.stdout))
    assert pictures[0] == pictures[1]
    assert all(np.count_nonzero(picture) > 20 for picture in pictures[0])
