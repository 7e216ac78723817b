"""Polygons to triangles: the area that the fill rule says, in rationals; no overlap, no gap, no T-junction; nothing moved."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any

import mapbox_earcut
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import scanspan as ss
from scanspan.geometry import noding, polygon_triangles
from tests.painting import FILL_RULES

Point = tuple[Fraction, Fraction]
Edge = tuple[Point, Point]

HOLDS = {
    "even-odd": lambda winding: winding % 2 == 1,
    "non-zero": lambda winding: winding != 0,
    "positive": lambda winding: winding > 0,
    "negative": lambda winding: winding < 0,
    "abs-geq-two": lambda winding: abs(winding) >= 2,
}


# The oracle: everything in rationals, and nothing shared with what is checked.


def ring_edges(rings: Any, bits: int) -> list[Edge]:
    """Return the edges of rings, snapped."""
    edges = []
    for ring in rings:
        points = [(Fraction(int(u), 2**bits), Fraction(int(v), 2**bits)) for u, v in np.rint(np.asarray(ring) * 2.0**bits)]
        edges += list(pairwise([*points, *points[:1]]))
    return edges


def crossing(a: Edge, b: Edge) -> Point | None:
    """Return where two edges cross, inside both of them."""
    (ax, ay), (bx, by) = a
    (cx, cy), (dx, dy) = b
    below = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    if below == 0:
        return None
    t = ((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)) / below
    u = ((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / below
    return (ax + t * (bx - ax), ay + t * (by - ay)) if 0 < t < 1 and 0 < u < 1 else None


def area_under(edges: list[Edge], fill_rule: str) -> Fraction:
    """Return the area of what a fill rule holds, slab by slab."""
    crossings = [where for a, b in combinations(edges, 2) if (where := crossing(a, b))]
    levels = sorted({y for edge in edges for _, y in edge} | {y for _, y in crossings})
    total = Fraction(0)
    for top, bottom in pairwise(levels):
        met = []
        for (ax, ay), (bx, by) in edges:
            if min(ay, by) <= top and max(ay, by) >= bottom:
                x = ax + (bx - ax) * ((top + bottom) / 2 - ay) / (by - ay)
                met.append((x, 1 if by > ay else -1))
        winding = 0
        for (x, turn), (following, _) in pairwise(sorted(met)):
            winding += turn
            total += (following - x) * (bottom - top) if HOLDS[fill_rule](winding) else 0
    return total


def corners_of(mesh: ss.Mesh) -> list[list[Point]]:
    """Return the corners of triangles as rationals."""
    return [[(Fraction(x), Fraction(y)) for x, y, _ in rows.tolist()] for rows in mesh.positions[mesh.triangles]]


def turning_area(corners: list[Point]) -> Fraction:
    """Return the area of a triangle, above 0 where it is counter-clockwise as seen."""
    (ax, ay), (bx, by), (cx, cy) = corners
    return ((by - ay) * (cx - ax) - (bx - ax) * (cy - ay)) / 2


def check(rings: Any, fill_rule: str, bits: int, **options: Any) -> ss.Mesh:
    """Triangulate, and check all that is promised of any polygon; return the mesh."""
    mesh = ss.triangulate(rings, fill_rule, subpixel_bits=bits, **options)
    corners = corners_of(mesh)
    assert all(turning_area(triangle) > 0 for triangle in corners)
    assert len(np.unique(mesh.positions[len(np.concatenate(rings)) :], axis=0)) == len(mesh.positions) - len(
        np.concatenate(rings)
    )

    # Each cut is a side of two triangles, one each way; each other side is a side of one.
    cuts, sides = Counter[tuple[int, int]](), Counter[tuple[int, int]]()
    for triangle, marks in zip(mesh.triangles.tolist(), mesh.inner.tolist()):
        for i in range(3):
            side = triangle[(i + 1) % 3], triangle[(i + 2) % 3]
            (cuts if marks >> i & 1 else sides)[side] += 1
    assert all(count == 1 and cuts[b, a] == 1 for (a, b), count in cuts.items())
    assert all(count == 1 for count in sides.values())
    assert not any((b, a) in sides or (a, b) in cuts or (b, a) in cuts for a, b in sides)

    # The area is right, to as much as bending at crossings may move it; nothing is covered twice.
    edges = ring_edges([ring for ring in rings if len(ring) > 2], bits)
    found, expected = sum(map(turning_area, corners), Fraction(0)), area_under(edges, fill_rule)
    off_grid = [w for a, b in combinations(edges, 2) if (w := crossing(a, b)) and any(v * 2**bits % 1 for v in w)]
    reach = sum(abs(bx - ax) + abs(by - ay) for (ax, ay), (bx, by) in edges) / 2**bits if off_grid else 0
    assert abs(found - expected) <= reach
    triangle_edges = [edge for triangle in corners for edge in pairwise([*triangle, triangle[0]])]
    if len(triangle_edges) < 120:
        assert area_under(triangle_edges, "abs-geq-two") == 0

    # No vertex lies on a side.
    used = {point for triangle in corners for point in triangle}
    for (ax, ay), (bx, by) in triangle_edges:
        for x, y in used:
            is_between = min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by)
            assert not is_between or (x, y) in ((ax, ay), (bx, by)) or (bx - ax) * (y - ay) != (by - ay) * (x - ax)
    return mesh


def star(rng: np.random.Generator, centre: tuple[float, float], radius: float, count: int, depth: float) -> NDArray[np.float64]:
    """Return a ring round a centre, its points at random distances."""
    angle = np.arange(count) * 2 * np.pi / count
    far = radius * (1 - depth * rng.random(count))
    return np.stack([centre[0] + far * np.cos(angle), centre[1] + far * np.sin(angle)], axis=1)


def test_the_oracle_knows_a_bow_tie_and_nested_squares() -> None:
    tie = ring_edges([[(0, 0), (4, 4), (4, 0), (0, 4)]], 4)
    assert [area_under(tie, rule) for rule in FILL_RULES] == [8, 8, 4, 4, 0]
    squares = ring_edges([[(0, 0), (0, 6), (6, 6), (6, 0)], [(2, 2), (2, 4), (4, 4), (4, 2)]], 4)
    assert [area_under(squares, rule) for rule in FILL_RULES] == [32, 36, 36, 0, 4]


# Any polygon


small = st.integers(0, 7)
ring = st.lists(st.tuples(small, small), min_size=3, max_size=8)


@given(st.lists(ring, min_size=1, max_size=3), st.sampled_from(FILL_RULES))
@settings(max_examples=100)
def test_small_whole_numbers_meet_in_every_way(rings: Any, fill_rule: str) -> None:
    check([np.array(ring, float) for ring in rings], fill_rule, 8)


@given(st.lists(st.lists(st.tuples(st.integers(0, 15), st.integers(0, 9)), min_size=3, max_size=8), min_size=1, max_size=2))
@settings(max_examples=150)
def test_sub_pixels_so_coarse_that_crossings_are_bent_far(rings: Any) -> None:
    for fill_rule in ("even-odd", "non-zero"):
        check([np.array(ring, float) / 16 for ring in rings], fill_rule, 4)


@pytest.mark.parametrize("fill_rule", FILL_RULES)
def test_random_polygons_have_the_area_of_the_fill_rule(fill_rule: str, rng: np.random.Generator) -> None:
    for n in range(6):
        rings = [rng.uniform(0, 30, (5 + n, 2)), rng.integers(0, 30, (4, 2)).astype(float)]
        check(rings, fill_rule, (16, 8, 4)[n % 3])


@pytest.mark.parametrize("fill_rule", FILL_RULES)
def test_shapely_agrees_on_large_polygons(fill_rule: str, rng: np.random.Generator) -> None:
    rings = [np.rint(rng.uniform(0, 100, (14, 2)) * 65536) / 65536 for _ in range(3)]
    mesh = ss.triangulate(rings, fill_rule)
    lines = shapely.union_all([shapely.LinearRing(ring) for ring in rings])
    expected = 0.0
    for face in shapely.get_parts(shapely.polygonize([lines])):
        x, y = face.representative_point().coords[0]
        winding = 0
        for points in rings:
            for (ax, ay), (bx, by) in pairwise([*points, points[0]]):
                if min(ay, by) <= y < max(ay, by) and ax + (bx - ax) * (y - ay) / (by - ay) < x:
                    winding += 1 if by > ay else -1
        expected += face.area if HOLDS[fill_rule](winding) else 0.0
    found = sum(map(turning_area, corners_of(mesh)), Fraction(0))
    assert float(found) == pytest.approx(expected, abs=0.05)
    assert fill_rule == "abs-geq-two" or found > 1000


@pytest.mark.parametrize(("count", "holes"), [(60, 1), (1000, 9), (20_000, 25)])
def test_earcut_agrees_on_stars_with_holes(count: int, holes: int, rng: np.random.Generator) -> None:
    rings = [star(rng, (500, 500), 480, count, 0.15)]
    across = int(np.sqrt(holes))
    for k in range(holes):
        centre = 230 + 540 * (k % across + 0.5) / across, 230 + 540 * (k // across + 0.5) / across
        rings.append(star(rng, centre, 190 / across, max(count // holes, 8), 0.5)[::-1])
    rings = [np.rint(ring * 65536) / 65536 for ring in rings]
    mesh = ss.triangulate(rings)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    other = mapbox_earcut.triangulate_float64(np.concatenate(rings), ends).reshape(-1, 3).astype(np.int64)
    assert len(mesh.triangles) == len(other) == sum(map(len, rings)) - 2 + 2 * holes
    assert len(mesh.positions) == sum(map(len, rings))

    # Compare areas in whole numbers of 2^-33 pixels.
    whole = np.rint(mesh.positions[:, :2] * 65536).astype(np.int64).astype(object)
    areas = [abs(turning(whole[triangles].transpose(1, 2, 0))).sum() for triangles in (mesh.triangles, other)]
    assert areas[0] == areas[1]
    assert (turning(whole[mesh.triangles].transpose(1, 2, 0)) < 0).all()


def turning(corners: NDArray[Any]) -> NDArray[Any]:
    """Return twice the area of triangles, (3, 2, T), above 0 where they are clockwise as seen."""
    (ax, ay), (bx, by), (cx, cy) = corners
    result: NDArray[Any] = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return result


# What samples see


@given(st.lists(st.lists(st.tuples(st.integers(0, 48), st.integers(0, 48)), min_size=3, max_size=9), min_size=1, max_size=3))
@settings(max_examples=150)
def test_every_sample_is_owned_once_where_no_edges_cross(rings: Any) -> None:
    rings, bits = [np.array(ring, float) / 4 for ring in rings], 8
    edges = ring_edges(rings, bits)
    crossings = [w for a, b in combinations(edges, 2) if (w := crossing(a, b)) and any(v * 2**bits % 1 for v in w)]
    for fill_rule in FILL_RULES:
        mesh = ss.triangulate(rings, fill_rule, subpixel_bits=bits)
        hits = ss.count(mesh.positions[mesh.triangles][..., :2], (13, 13))
        cover = ss.coverage(rings, (13, 13), mode="center", fill_rule=fill_rule)
        assert (hits <= 1).all()
        if not crossings:
            assert np.array_equal(hits, cover)


def test_touching_holes_and_rings_on_rings_own_every_sample_once() -> None:
    outer = [(0, 0), (16, 0), (16, 16), (0, 16)]
    touching = [[(4, 4), (8, 8), (4, 12)], [(8, 8), (12, 4), (12, 12)], [(4, 12), (8, 16), (12, 12)], [(0, 3), (4, 4), (0, 6)]]
    rings = [np.array(ring, float) + 0.5 for ring in [outer, *touching]]
    mesh = check(rings, "even-odd", 8)
    hits = ss.count(mesh.positions[mesh.triangles][..., :2], (18, 18))
    assert np.array_equal(hits, ss.coverage(rings, (18, 18)))


# Known shapes


def test_convex_concave_and_holes_have_as_many_triangles_as_there_are() -> None:
    assert len(check([[(0, 0), (4, 0), (6, 3), (4, 6), (0, 6)]], "even-odd", 8).triangles) == 3
    assert len(check([[(0, 0), (4, 2), (0, 4), (1, 2)]], "even-odd", 8).triangles) == 2
    square, hole = [(0, 0), (9, 0), (9, 9), (0, 9)], [(3, 3), (3, 6), (6, 6), (6, 3)]
    mesh = check([square, hole], "even-odd", 8)
    assert (len(mesh.triangles), len(mesh.positions), mesh.face_count) == (8, 8, 1)
    assert (mesh.source == 0).all()
    assert len(check([square, hole], "non-zero", 8).triangles) == 8
    assert len(check([square, hole[::-1]], "non-zero", 8).triangles) == 2


def test_a_pentagram_has_five_points_made_and_an_inside_that_depends_on_the_rule() -> None:
    angle = np.arange(5) * 4 * np.pi / 5
    ring = np.stack([120 + 100 * np.sin(angle), 120 - 100 * np.cos(angle)], axis=1)
    meshes = [check([ring], rule, 16) for rule in FILL_RULES]
    assert [len(mesh.triangles) for mesh in meshes] == [5, 8, 0, 8, 3]
    assert [len(mesh.positions) for mesh in meshes] == [10, 10, 5, 10, 10]


def test_spikes_repeated_points_and_rings_without_an_area_leave_nothing() -> None:
    square = [(0, 0), (8, 0), (8, 8), (0, 8)]
    spiked = [(0, 0), (4, 0), (4, -5), (4, 0), (8, 0), (8, 0), (8, 8), (0, 8), (0, 8)]
    mesh = check([spiked], "even-odd", 8)
    assert mesh.triangles.max() < len(spiked)
    assert sum(map(turning_area, corners_of(mesh))) == 64
    for rings in ([[(0, 0), (5, 5), (9, 9)]], [[(1, 1)] * 5], [square, square], [[(0, 0), (4, 0), (0, 0), (4, 0)]]):
        assert len(check(rings, "even-odd", 8).triangles) == 0
    assert len(ss.triangulate([]).triangles) == len(ss.triangulate([[(0, 0), (1, 1)]]).triangles) == 0


def test_corners_on_a_straight_side_are_corners_of_triangles() -> None:
    mesh = check([[(0, 0), (2, 0), (5, 0), (9, 0), (9, 9), (4, 9), (0, 9), (0, 1)]], "even-odd", 8)
    assert len(mesh.triangles) == 6
    assert set(mesh.triangles.ravel().tolist()) == set(range(8))


def test_vertices_are_the_points_that_were_given_in_order() -> None:
    rings = [[(0, 0), (9, 0), (9, 9), (0, 9), (0, 0)], [(5, 5), (6, 6)], [(2, 2), (4, 2), (3, 4.00001)]]
    mesh = ss.triangulate(rings)
    assert np.allclose(mesh.positions[:, :2], np.concatenate(rings), rtol=0, atol=2.0**-17)
    assert (mesh.positions * 65536 % 1 == 0).all()
    assert set(mesh.triangles.ravel().tolist()) == {0, 1, 2, 3, 7, 8, 9}


@pytest.mark.parametrize("offset", [0.0, 2.0**24 - 64, -(2.0**24)])
def test_far_away_nothing_is_less_exact(offset: float) -> None:
    ring = np.array([(0.25, 0.5), (60, 47.3), (59.999, 0.1), (0, 47), (30, 60.7)]) + offset
    near, far = ss.triangulate(ring - offset), ss.triangulate(ring)
    assert np.array_equal(near.triangles, far.triangles)
    if offset:
        assert np.array_equal(near.positions[:, :2], far.positions[:, :2] - offset)


def test_the_widest_crossing_is_rounded_right() -> None:
    side = 2.0**24
    for nudge in (0, 1, 3, 12345):
        step = nudge / 65536
        mesh = check([[(-side, -side), (side - step, side), (side, -side + step), (-side + 3 * step, side)]], "even-odd", 16)
        assert len(mesh.triangles) == 2


def test_a_point_may_be_shared_by_many_edges() -> None:
    angle = np.arange(400) * 2 * np.pi / 400
    rim = np.stack([50 + 40 * np.cos(angle), 50 + 40 * np.sin(angle)], axis=1)
    fan = np.full((1200, 2), 50.0)
    fan[1::3], fan[2::3] = rim, np.roll(rim, -1, axis=0)
    mesh = ss.triangulate(fan, "non-zero")
    assert len(mesh.triangles) == 398
    wedges = fan.reshape(200, 6, 2)[:, :3].reshape(-1, 2)
    assert len(ss.triangulate(wedges, "non-zero").triangles) == 200


def test_many_crossings_in_one_place_come_out_right(rng: np.random.Generator) -> None:
    angle = rng.uniform(0, 2 * np.pi, 25)
    ends = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.stack([8 + 5 * ends, 8 - 5 * ends], axis=1).reshape(-1, 2)
    for fill_rule in ("even-odd", "non-zero"):
        check([ring], fill_rule, 4)


# Values


def test_values_are_carried_to_points_that_are_made() -> None:
    rings = [[(0, 0), (8, 8), (8, 0), (0, 8)]]
    given = {
        "height": np.array([0.0, 8.0, 2.0, 4.0], np.float32), "uv": [(0, 0), (1, 1), (1, 0), (0, 1)],
        "color": np.array([(0, 0, 0), (100, 0, 0), (0, 51, 0), (0, 0, 9)], np.uint8), "label": [1, 2, 3, 4],
    }  # fmt: skip
    mesh = ss.triangulate(rings, attributes=given)
    assert mesh.positions[4].tolist() == [4, 4, 0]
    height, uv, color, label = (mesh.attributes[name] for name in ("height", "uv", "color", "label"))
    assert height.dtype == np.float32
    assert height[:, 0].tolist() == [0, 8, 2, 4, 3.5]
    assert uv[4].tolist() == [0.5, 0.5]
    assert color.dtype == np.uint8
    assert color[4].tolist() == [25, 13, 2, 255]
    assert label.dtype == np.float64
    assert label[4].tolist() == [2.5]


def test_values_that_are_a_plane_stay_one_and_constants_stay_constant(rng: np.random.Generator) -> None:
    rings = [rng.uniform(0, 60, (17, 2)), rng.integers(0, 60, (9, 2)) / 3]
    points = np.concatenate(rings)
    values = {"plane": points @ [3.0, -2.0] + 1.0, "constant": np.full(len(points), 0.1)}
    mesh = ss.triangulate(rings, "non-zero", attributes=values)
    assert len(mesh.positions) > 40
    used = np.unique(mesh.triangles)
    expected = mesh.positions[used, :2] @ [3.0, -2.0] + 1.0
    assert np.abs(mesh.attributes["plane"][used, 0] - expected).max() < 5 * 2.0**-16
    assert (mesh.attributes["constant"][used] == 0.1).all()


def test_values_of_points_at_one_place_are_those_of_the_first() -> None:
    rings = [[(0, 0), (4, 4), (0, 4)], [(4, 4), (8, 4), (8, 8)]]
    mesh = ss.triangulate(rings, attributes={"number": np.arange(6.0)})
    assert set(mesh.triangles.ravel().tolist()) == {0, 1, 2, 4, 5}
    assert mesh.attributes["number"][:, 0].tolist() == [0, 1, 2, 3, 4, 5]


# Bad input


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        (([(0, 0), (1, 0), (0, 1)], "odd"), {}, "unknown fill rule 'odd'; the valid ones are: even-odd, non-zero, positive"),
        (([(0, 0), (1, 0), (0, 1)],), {"subpixel_bits": 17}, "subpixel_bits = 17"),
        (([(0, 0), (1, np.nan), (0, 1)],), {}, r"rings\[1\] = \[1.0, nan\]: expected finite numbers within 16777216 pixels"),
        (([[(0, 0), (1, 2), (2.0**25, 1)]],), {}, r"rings\[0\]\[2\] = \[33554432.0, 1.0\]: expected finite"),
        ((5,), {}, r"rings: expected one ring, \(M, 2\) points, or a list of rings"),
        (
            ([(0, 0), (1, 0), (0, 1)],), {"attributes": {"height": [1, 2]}},
            r"attributes\['height'\]: expected shape \(3, k\), a row for each point, got \(2,\)",
        ),
        (([(0, 0), (1, 0), (0, 1)],), {"attributes": {"uv": [1, 2, 3]}}, r"attributes\['uv'\]: expected shape \(3, 2\)"),
        (([(0, 0), (1, 0), (0, 1)],), {"attributes": [1]}, "attributes: expected a mapping of names to values, got list"),
        (([(0, 0), (1, 0), (0, 1)],), {"attributes": {"name": ["a", "b", "c"]}}, r"attributes\['name'\]: expected an array"),
    ],
)  # fmt: skip
def test_bad_input_is_quoted(arguments: tuple[Any, ...], options: dict[str, Any], message: str) -> None:
    with pytest.raises(ss.InputError, match=message):
        ss.triangulate(*arguments, **options)


def test_too_many_crossings_are_refused(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    monkeypatch.setattr(noding, "MOST_FOUND", 10)
    with pytest.raises(ss.LimitError, match="rings: edges cross or touch more than 10 times"):
        ss.triangulate(rng.uniform(0, 9, (20, 2)))


def test_rounds_without_end_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polygon_triangles, "MOST_ROUNDS", 0)
    with pytest.raises(ss.ScanspanError, match="rings: edges still cross after 0 rounds of snap rounding"):
        ss.triangulate([(0, 0), (4, 4), (4, 0), (0, 4)])
