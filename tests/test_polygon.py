"""Polygons cut into trapezoids: each sample is held once and only where the fill rule says so, in exact whole numbers.

The oracle looks at one sample at a time and counts the edges that lie left of it or on it; it shares nothing with the sweep: no
list, no stepping, no pairs. The trapezoids are drawn just as plainly, from their lines and limits.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scanspan.geometry.fixed_point import MAX_SIDE
from scanspan.raster.polygon import EVEN_ODD, NON_ZERO, cut_trapezoids
from scanspan.records import Sampling

Point = tuple[int, int]
Ring = list[Point]
Polygon = list[Ring]
Rectangle = tuple[int, int, int, int]  # x_start, x_end, y_start, y_end, pixels

SIZE = (14, 11)
WHOLE = (0, SIZE[0], 0, SIZE[1])
BITS = [4, 8, 16]
FILL_RULES = [EVEN_ODD, NON_ZERO]


def sampling(bits: int, rectangle: Rectangle = WHOLE, sample: Point | None = None) -> Sampling:
    """Where samples lie: the middle of each pixel, or another place in it."""
    x, y = sample or (1 << (bits - 1), 1 << (bits - 1))
    names = ("x_start", "x_end", "y_start", "y_end", "subpixel_bits", "sample_x", "sample_y")
    return Sampling(**{**dict.fromkeys(Sampling._fields, 0), **dict(zip(names, (*rectangle, bits, x, y)))})


def cut(polygons: list[Polygon], where: Sampling, fill_rule: int = EVEN_ODD) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Cut polygons given as lists of rings of points in sub-pixels."""
    rings = [ring for polygon in polygons for ring in polygon]
    points = np.array([point for ring in rings for point in ring], np.int64).reshape(-1, 2)
    ring_starts = np.cumsum([0] + [len(ring) for ring in rings]).astype(np.int32)
    polygon_rings = np.cumsum([0] + [len(polygon) for polygon in polygons]).astype(np.int32)
    return cut_trapezoids(points, ring_starts, polygon_rings, fill_rule, where)


def samples(where: Sampling) -> list[tuple[int, int, int, int]]:
    """Every sample of the rectangle: its column, row, x and y."""
    s = where.subpixel_bits
    return [
        (i, j, (i << s) + where.sample_x, (j << s) + where.sample_y)
        for j in range(where.y_start, where.y_end)
        for i in range(where.x_start, where.x_end)
    ]


def expected(polygon: Polygon, where: Sampling, fill_rule: int = EVEN_ODD) -> set[Point]:
    """The pixels inside a polygon: the oracle."""
    edges = [(ring[k], ring[(k + 1) % len(ring)]) for ring in polygon for k in range(len(ring))]
    inside = set()
    for i, j, x, y in samples(where):
        winding = passed = 0
        for start, end in edges:
            (u_x, u_y), (l_x, l_y) = sorted((start, end), key=lambda point: point[1])
            # Count an edge in its rows, upper end included, when the sample is on it or right of it.
            if u_y <= y < l_y and (x - u_x) * (l_y - u_y) >= (y - u_y) * (l_x - u_x):
                passed += 1
                winding += 1 if start[1] < end[1] else -1
        if (passed % 2 if fill_rule == EVEN_ODD else winding) != 0:
            inside.add((i, j))
    return inside


def drawn(lines: NDArray[Any], limits: NDArray[Any], where: Sampling) -> dict[Point, Point]:
    """The pixels of one trapezoid, with their samples: in its limits, not left of its left line, left of its right one."""
    (a, b, q_x, q_y), (c, d, r_x, r_y) = lines.tolist()
    x_low, x_high, y_low, y_high = limits.tolist()
    assert a > 0 > c
    return {
        (i, j): (x, y)
        for i, j, x, y in samples(where)
        if x_low <= x <= x_high
        and y_low <= y <= y_high
        and a * (x - q_x) + b * (y - q_y) >= 0
        and c * (x - r_x) + d * (y - r_y) > 0
    }


def draw(lines: NDArray[Any], limits: NDArray[Any], where: Sampling) -> set[Point]:
    """The pixels of one trapezoid; its limits are samples, and as narrow as can be."""
    pixels = drawn(lines, limits, where)
    assert pixels, "a trapezoid that holds no sample"
    places = np.array(list(pixels.values()))
    (x_low, y_low), (x_high, y_high) = places.min(axis=0), places.max(axis=0)
    assert limits.tolist() == [x_low, x_high, y_low, y_high]
    return set(pixels)


def check(polygons: list[Polygon], where: Sampling, fill_rule: int = EVEN_ODD) -> list[int]:
    """Compare what the trapezoids of each polygon hold with the oracle; return how many trapezoids each has."""
    owner, lines, limits = cut(polygons, where, fill_rule)
    assert owner.dtype == np.int32
    assert lines.dtype == limits.dtype == np.int64
    assert (lines.shape, limits.shape) == ((len(owner), 2, 4), (len(owner), 4))
    assert np.all(np.diff(owner) >= 0)
    for p, polygon in enumerate(polygons):
        held: set[Point] = set()
        for k in np.flatnonzero(owner == p):
            pixels = draw(lines[k], limits[k], where)
            assert not held & pixels, "a sample that two trapezoids of one polygon hold"
            held |= pixels
        assert held == expected(polygon, where, fill_rule)
    return np.bincount(owner, minlength=len(polygons)).tolist()


def scaled(ring: Any, bits: int) -> Ring:
    """A ring in pixels, snapped to sub-pixels."""
    return [(int(x), int(y)) for x, y in np.rint(np.asarray(ring, dtype=np.float64) * 2**bits)]


# Kinds of polygon, in pixels; each takes random numbers and gives rings.


def convex(rng: np.random.Generator) -> list[Any]:
    angles = np.sort(rng.uniform(0, 2 * np.pi, 7))
    return [rng.uniform(3, 9, 2) + rng.uniform(1, 8) * np.stack([np.cos(angles), np.sin(angles)], axis=1)]


def star_shaped(rng: np.random.Generator) -> list[Any]:
    angles = np.sort(rng.uniform(0, 2 * np.pi, 14))
    radii = rng.uniform(0.5, 9, (14, 1))
    return [rng.uniform(3, 9, 2) + radii * np.stack([np.cos(angles), np.sin(angles)], axis=1)]


def self_crossing(rng: np.random.Generator) -> list[Any]:
    return [rng.uniform(-4, 16, (9, 2))]


def with_holes(rng: np.random.Generator) -> list[Any]:
    return [convex(rng)[0], *(rng.uniform(2, 9, 2) + rng.uniform(-3, 3, (5, 2)) for _ in range(3))]


def on_lattice(rng: np.random.Generator) -> list[Any]:
    """Corners on few samples and pixel corners: coincident edges, shared corners, samples on edges, level edges."""
    return [rng.integers(0, 10, (12, 2)) / 2 + 2, rng.integers(2, 8, (6, 2)), rng.integers(2, 8, (6, 2)) + 0.5]


def doubled(rng: np.random.Generator) -> list[Any]:
    """A ring, parts of it again, forwards and backwards, and a ring on its corners."""
    ring = rng.integers(0, 12, (7, 2)) + 0.5
    return [ring, ring[2:6][::-1], ring[rng.permutation(7)], ring[[0, 1]], ring[[3]]]


def far_away(rng: np.random.Generator) -> list[Any]:
    """Corners at the limit of the coordinates, beside some in the picture."""
    ring = rng.uniform(0, 12, (8, 2))
    ring[::2] = rng.choice([-1, 1, 0.25, -0.125], (4, 2)) * 2.0**24
    ring[1, 0], ring[5, 1] = 2.0**24, -(2.0**24)
    return [ring, rng.uniform(-(2.0**24), 2.0**24, (5, 2))]


KINDS = [convex, star_shaped, self_crossing, with_holes, on_lattice, doubled, far_away]


@pytest.mark.parametrize("fill_rule", FILL_RULES)
@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("kind", KINDS)
def test_trapezoids_hold_what_the_fill_rule_says(
    kind: Callable[[np.random.Generator], list[Any]], bits: int, fill_rule: int, rng: np.random.Generator
) -> None:
    one = 1 << bits
    places = [None, (0, 0), (one - 1, one // 4), (3, one - 1)]
    rectangles = [WHOLE, WHOLE, (3, 12, 4, 9), (5, 6, 0, 11), (0, 14, 10, 11)]
    for k in range(20):
        polygons = [[scaled(ring, bits) for ring in kind(rng)] for _ in range(2)]
        check(polygons, sampling(bits, rectangles[k % 5], places[k % 4]), fill_rule)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("rectangle", [(0, MAX_SIDE, 0, 11), (0, 14, 0, MAX_SIDE), (MAX_SIDE - 14, MAX_SIDE, 0, MAX_SIDE)])
def test_edges_are_stepped_exactly_across_the_largest_picture(
    rectangle: Rectangle, bits: int, rng: np.random.Generator
) -> None:
    # Cut all of a long strip, and look at its far end.
    _, x_end, _, y_end = rectangle
    corner = sampling(bits, (x_end - 14, x_end, y_end - 11, y_end))
    for _ in range(3):
        polygon = [scaled(ring, bits) for ring in far_away(rng)]
        polygon.append(scaled(rng.uniform((x_end - 14, y_end - 11), (x_end, y_end), (5, 2)), bits))
        polygon[2][:2] = [(0, 0), (x_end << bits, 0)]
        _, lines, limits = cut([polygon], sampling(bits, rectangle))
        hits = [pixel for k in range(len(lines)) for pixel in drawn(lines[k], limits[k], corner)]
        assert len(hits) == len(set(hits))
        assert set(hits) == expected(polygon, corner)


def test_the_oracle_tells_the_fill_rules_apart() -> None:
    ring = scaled([(1, 1), (9, 1), (9, 9), (1, 9)], 8)
    inner = scaled([(3, 3), (7, 3), (7, 7), (3, 7)], 8)
    assert len(expected([ring, inner], sampling(8), EVEN_ODD)) == 48
    assert len(expected([ring, inner], sampling(8), NON_ZERO)) == 64
    assert len(expected([ring, inner[::-1]], sampling(8), NON_ZERO)) == 48


@pytest.mark.parametrize(
    ("rings", "fill_rule", "count"),
    [
        ([[(1, 1), (9, 1), (9, 9), (1, 9)]], EVEN_ODD, 1),
        ([[(1, 1), (9, 2), (8, 9), (2, 10)]], EVEN_ODD, 3),
        ([[(1, 1), (9, 5), (2, 10)]], EVEN_ODD, 2),
        ([[(1, 1), (9, 1), (9, 5), (5, 5), (5, 9), (1, 9)]], EVEN_ODD, 2),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(3, 3), (6, 3), (6, 6), (3, 6)]], EVEN_ODD, 4),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(3, 6), (6, 6), (6, 3), (3, 3)]], NON_ZERO, 4),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(3, 3), (6, 3), (6, 6), (3, 6)]], NON_ZERO, 1),
        ([[(1, 1), (9, 1), (1, 9), (9, 9)]], EVEN_ODD, 2),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(1, 1), (9, 1), (9, 9), (1, 9)]], EVEN_ODD, 0),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(1, 1), (9, 1), (9, 9), (1, 9)]], NON_ZERO, 1),
        ([[(1, 1), (9, 1), (9, 9), (1, 9)], [(4, 1), (4, 9), (4, 1)]], EVEN_ODD, 2),
        ([[(5, 0), (6, 10), (7, 0), (9, 10), (3, 10)]], EVEN_ODD, 2),
    ],
)
def test_a_polygon_is_cut_no_finer_than_its_edges_ask(rings: list[Any], fill_rule: int, count: int) -> None:
    assert check([[scaled(ring, 8) for ring in rings]], sampling(8), fill_rule) == [count]


@pytest.mark.parametrize("turn", [1, -1])
def test_edges_that_start_at_one_corner_are_put_in_order_at_once(turn: int) -> None:
    # Both sides of the hole cross the first row of samples in the same column.
    square, hole = [(1, 1), (12, 1), (12, 10), (1, 10)], [(5.1, 2.4), (7, 7), (4, 7)][::turn]
    assert check([[scaled(square, 8), scaled(hole, 8)]], sampling(8)) == [4]
    assert check([[scaled(hole, 8), scaled(square, 8)]], sampling(8)) == [4]


@pytest.mark.parametrize("turn", [1, -1])
def test_a_polygon_one_sub_pixel_high_has_the_row_of_its_upper_side(turn: int) -> None:
    for top, rows in [(127, 0), (128, 1), (129, 0)]:
        flat = [(256, top), (1024, top), (1024, top + 1), (256, top + 1)][::turn]
        assert check([[flat]], sampling(8)) == [rows]
        assert expected([flat], sampling(8)) == ({(1, 0), (2, 0), (3, 0)} if rows else set())


def test_no_two_trapezoids_of_a_pair_of_edges_follow_each_other(rng: np.random.Generator) -> None:
    for _ in range(20):
        polygon = [scaled(ring, 8) for ring in self_crossing(rng)]
        _, lines, limits = cut([polygon], sampling(8))
        last = {(pair.tobytes(), int(rows[3])) for pair, rows in zip(lines, limits)}
        assert not last & {(pair.tobytes(), int(rows[2]) - 256) for pair, rows in zip(lines, limits)}


def test_lines_are_the_uncut_edges() -> None:
    where = sampling(8, (0, 14, 5, 7))
    polygon = [scaled([(7, -1), (12, 10), (2, 10)], 8)]
    owner, lines, limits = cut([polygon], where)
    assert owner.tolist() == [0]
    assert lines.tolist() == [[[11 * 256, 5 * 256, 2 * 256, 10 * 256], [-11 * 256, 5 * 256, 7 * 256, -256]]]
    assert limits.tolist() == [[4 * 256 + 128, 9 * 256 + 128, 5 * 256 + 128, 6 * 256 + 128]]


@pytest.mark.parametrize("bits", BITS)
def test_a_run_goes_on_through_rows_without_a_sample(bits: int) -> None:
    # A needle that is thinner than the distance of samples: some of its rows are empty.
    needle = [scaled([(2.6, 0.2), (3, 0.2), (6.4, 10.6), (6, 10.6)], bits)]
    assert check([needle], sampling(bits)) == [1]
    assert len(expected(needle, sampling(bits))) < 6


def test_trapezoids_come_in_the_order_of_their_polygons() -> None:
    square = scaled([(1, 1), (4, 1), (4, 4), (1, 4)], 8)
    low = scaled([(1, 6), (4, 6), (4, 9), (1, 9)], 8)
    nothing: Polygon = [[], [(0, 0)], [(0, 0), (900, 0)], [(0, 0), (900, 900)], [(0, 300), (900, 300), (400, 300)]]
    owner, _, limits = cut([[low], nothing, [square], [], [low, square], [square]], sampling(8))
    assert owner.tolist() == [0, 2, 4, 4, 5]
    assert limits[:, 2].tolist() == [6 * 256 + 128, 256 + 128, 256 + 128, 6 * 256 + 128, 256 + 128]


@pytest.mark.parametrize(
    "rectangle", [(0, 14, 5, 5), (7, 7, 0, 11), (9, 3, 8, 2), (0, 14, 9, 11), (10, 14, 0, 11), (0, 1, 0, 11)]
)
def test_nothing_is_cut_outside_the_rectangle(rectangle: Rectangle) -> None:
    square = scaled([(1, 1), (8, 1), (8, 8), (1, 8)], 8)
    owner, lines, limits = cut([[square]], sampling(8, rectangle))
    assert (owner.shape, lines.shape, limits.shape) == ((0,), (0, 2, 4), (0, 4))


def test_no_polygons_give_no_trapezoids() -> None:
    assert [len(part) for part in cut([], sampling(8))] == [0, 0, 0]


def test_there_is_room_for_many_trapezoids() -> None:
    teeth = 700
    ring = [(x * 10, 1000 if x % 2 else 0) for x in range(2 * teeth + 1)] + [(20 * teeth, -500), (0, -500)]
    where = sampling(4, (0, 1000, 0, 70))
    owner, lines, limits = cut([[ring], [ring]], where)
    assert np.bincount(owner).tolist() == [teeth, teeth]
    assert len({line.tobytes() for line in lines.reshape(-1, 4)}) == 2 * teeth
    assert limits[:, 2].max() < limits[:, 3].max() < 1000


# Neighbours


@pytest.mark.parametrize("bits", BITS)
def test_two_polygons_along_a_chain_own_each_sample_once(bits: int, rng: np.random.Generator) -> None:
    where = sampling(bits)
    corners = [(1.5, 0.5), (12.5, 0.5), (12.5, 10.5), (1.5, 10.5)]
    whole = expected([scaled(corners, bits)], where)
    for k in range(30):
        count = 9
        heights = np.sort(rng.integers(1, 20, count) / 2 + 0.5 if k % 2 else rng.uniform(0.5, 10.5, count))
        widths = rng.integers(2, 12, count) + 0.5 if k % 2 else rng.uniform(1.5, 12.5, count)
        if k % 3 == 0:  # a chain that turns back on itself; what it encloses twice changes sides
            heights = rng.permutation(heights)
        chain = [(widths[0], 0.5), *zip(widths, heights), (widths[-1], 10.5)]
        left = [corners[0], *chain, corners[3]]
        right = [*chain[::-1], corners[1], corners[2]]
        owner, lines, limits = cut([[scaled(left, bits)], [scaled(right, bits)]], where)
        hits = [draw(lines[n], limits[n], where) for n in range(len(owner))]
        assert sum(len(pixels) for pixels in hits) == len(whole)
        assert set().union(*hits) == whole


# Whatever comes


@st.composite
def cases(draw: st.DrawFn) -> tuple[Polygon, Sampling, int]:
    """Rings on a lattice that is coarse, fine or has corners at the limit; any rectangle, sample place and fill rule."""
    bits = draw(st.sampled_from(BITS))
    limit = 1 << (24 + bits)
    lattice = st.integers(-2, 8).map(lambda v: v << (bits - 1))
    coordinate = draw(
        st.sampled_from(
            [lattice, st.integers(-(4 << bits), 10 << bits), st.one_of(lattice, st.sampled_from([-limit, limit, limit - 1]))]
        )
    )
    rings = draw(st.lists(st.lists(st.tuples(coordinate, coordinate), max_size=8), max_size=4))
    x_start, y_start = draw(st.integers(0, 4)), draw(st.integers(0, 4))
    place = st.integers(0, (1 << bits) - 1)
    where = sampling(
        bits,
        (x_start, x_start + draw(st.integers(0, 6)), y_start, y_start + draw(st.integers(0, 6))),
        (draw(place), draw(place)),
    )
    return rings, where, draw(st.sampled_from(FILL_RULES))


@given(cases())
@settings(max_examples=250)
def test_any_polygon(case: tuple[Polygon, Sampling, int]) -> None:
    polygon, where, fill_rule = case
    check([polygon], where, fill_rule)


PLAIN = """
import json, sys
import numpy as np
from scanspan.geometry.fixed_point import MAX_SIDE
from scanspan.raster.polygon import cut_trapezoids
from scanspan.records import Sampling
polygon = json.load(sys.stdin)
xy, starts, rings = np.array(polygon["xy"], np.int64), np.array(polygon["starts"], np.int32), np.array([0, 2, 5], np.int32)
parts = cut_trapezoids(xy, starts, rings, polygon["fill_rule"], Sampling(*polygon["sampling"]))
print(json.dumps([[str(part.dtype), part.tolist()] for part in parts]))
"""


@pytest.mark.parametrize("fill_rule", FILL_RULES)
def test_plain_python_gives_what_the_compiled_kernel_gives(fill_rule: int, rng: np.random.Generator) -> None:
    bits = 16
    rings = [scaled(kind(rng)[0], bits) for kind in (star_shaped, on_lattice, self_crossing, far_away, convex)]
    where = sampling(bits, (1, 13, 2, 10))
    compiled = cut([rings[:2], rings[2:]], where, fill_rule)
    assert len(compiled[0]) > 16  # the room was made larger once
    case = {
        "xy": [point for ring in rings for point in ring],
        "starts": np.cumsum([0] + [len(ring) for ring in rings]).tolist(),
        "fill_rule": fill_rule,
        "sampling": where,
    }
    plain = subprocess.run(
        [sys.executable, "-W", "error", "-c", PLAIN],
        input=json.dumps(case),
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert plain.returncode == 0, plain.stderr[-2000:]
    assert json.loads(plain.stdout) == [[str(part.dtype), part.tolist()] for part in compiled]
