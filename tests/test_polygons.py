"""Polygons: what they accept, how they keep it, their planes, and every message."""

from __future__ import annotations

import copy
import itertools
import pickle
from typing import Any

import numpy as np
import pytest

from scanspan.assets import polygons as module
from scanspan.assets.polygons import Polygons
from scanspan.errors import InputError, LimitError

NAN, INF = float("nan"), float("inf")
SQUARE = [(0, 0, 2), (4, 0, 2), (4, 4, 2), (0, 4, 2)]
HOLE = [(1, 1, 2), (1, 2, 2), (2, 2, 2)]
TRIANGLE = [(0, 0, 0), (1, 0, 0), (0, 0, 1)]
SADDLE = [(0, 0, 0), (2, 0, 1), (2, 2, 0), (0, 2, 1)]


def rings_of(polygons: Polygons) -> list[list[list[list[float]]]]:
    """The polygons as nested lists again."""
    rings = [
        polygons.positions[polygons.ring_starts[r] : polygons.ring_starts[r + 1]].tolist()
        for r in range(len(polygons.ring_starts) - 1)
    ]
    return [rings[a:b] for a, b in itertools.pairwise(polygons.polygon_rings.tolist())]


def as_lists(ring: Any) -> list[list[float]]:
    return [[float(v) for v in point] for point in ring]


# What may come


@pytest.mark.parametrize(
    ("rings", "expected"),
    [
        ([], []),
        (np.empty((0, 4, 3)), []),
        ([SQUARE], [[SQUARE]]),
        (SQUARE, [[SQUARE]]),
        (tuple(SQUARE), [[SQUARE]]),
        (np.array(SQUARE), [[SQUARE]]),
        ([np.array(p) for p in SQUARE], [[SQUARE]]),
        ([SQUARE, TRIANGLE], [[SQUARE], [TRIANGLE]]),
        (np.array([SQUARE, SQUARE]), [[SQUARE], [SQUARE]]),
        (np.array([[SQUARE, SQUARE]]), [[SQUARE, SQUARE]]),
        ([[SQUARE, HOLE]], [[SQUARE, HOLE]]),
        ([[HOLE, SQUARE], TRIANGLE, [TRIANGLE]], [[HOLE, SQUARE], [TRIANGLE], [TRIANGLE]]),
        ([TRIANGLE, [HOLE, SQUARE]], [[TRIANGLE], [HOLE, SQUARE]]),
        ([np.array(TRIANGLE), [np.array(HOLE), SQUARE]], [[TRIANGLE], [HOLE, SQUARE]]),
        ([[*SQUARE, SQUARE[0]]], [[SQUARE]]),
        ([(0, 0), (4, 0), (4, 4)], [[[(0, 0, 0), (4, 0, 0), (4, 4, 0)]]]),
        ([[[(0, 0), (4, 0), (4, 4)], [(1, 1, 0), (2, 1, 0), (2, 2, 0)]]],
         [[[(0, 0, 0), (4, 0, 0), (4, 4, 0)], [(1, 1, 0), (2, 1, 0), (2, 2, 0)]]]),
    ],
)  # fmt: skip
def test_rings_may_be_nested_in_these_ways(rings: Any, expected: Any) -> None:
    assert rings_of(Polygons(rings)) == [[as_lists(ring) for ring in polygon] for polygon in expected]


@pytest.mark.parametrize("empty", [[], [[]], [[], []], np.empty((0, 3)), SQUARE[:1], SQUARE[:2], [SQUARE[:2], HOLE[:1]],
                                   [SQUARE[0], SQUARE[1], SQUARE[0]], [SQUARE[0]] * 5, [(0, 0, 0), (1, 2, 3), (2, 4, 6)],
                                   [(0, 0), (0.1, 0.3), (0.2, 0.6), (0.7, 2.1)]])  # fmt: skip
def test_what_has_no_area_is_left_out_and_keeps_its_number(empty: Any) -> None:
    polygons = Polygons([empty, SQUARE, empty, [HOLE, SQUARE], empty, TRIANGLE, empty])
    assert rings_of(polygons) == [[as_lists(SQUARE)], [as_lists(HOLE), as_lists(SQUARE)], [as_lists(TRIANGLE)]]
    assert polygons.source.tolist() == [1, 3, 5]
    assert polygons.count == 7
    assert polygons.reference[[0, 2]].tolist() == [[0, 2, 3], [11, 12, 13]]


def test_points_on_a_line_have_no_area_though_they_are_rounded(rng: np.random.Generator) -> None:
    for _ in range(20):
        line = rng.uniform(-1, 1, (6, 1)) * rng.uniform(-1, 1, 3) + rng.uniform(-1, 1, 3)
        assert len(Polygons([line, [line, line]]).source) == 0
    assert Polygons([[(0, 0), (1, 0), (2, 1e-9)]]).count == len(Polygons([[(0, 0), (1, 0), (2, 1e-9)]]).source) == 1


def test_nothing_but_empty_polygons_is_nothing() -> None:
    polygons = Polygons([[], [SQUARE[:2]], []])
    assert (polygons.count, len(polygons.source), len(polygons.positions)) == (3, 0, 0)
    assert polygons.ring_starts.tolist() == polygons.polygon_rings.tolist() == [0]
    assert np.isnan(polygons.bounds).all()
    assert (polygons.bounds.shape, polygons.normals.shape, polygons.reference.shape) == ((2, 3), (0, 3), (0, 3))


def test_short_rings_are_left_out_of_a_polygon() -> None:
    polygons = Polygons([[HOLE[:2], SQUARE, [], HOLE, [HOLE[0], HOLE[1], HOLE[0]]]])
    assert rings_of(polygons) == [[as_lists(SQUARE), as_lists(HOLE)]]


def test_arrays_are_owned_and_read_only() -> None:
    square, colors = np.array(SQUARE, dtype=np.float64), np.zeros((1, 4))
    polygons = Polygons(square[None], colors=colors)
    square[:], colors[:] = 9, 1
    assert polygons.positions.tolist() == as_lists(SQUARE)
    assert polygons.colors is not None
    assert polygons.colors.tolist() == [[0, 0, 0, 0]]
    types = {
        "positions": "float64", "ring_starts": "int32", "polygon_rings": "int32", "source": "int32", "reference": "int32",
        "colors": "float32",
    }  # fmt: skip
    for name, dtype in types.items():
        array = getattr(polygons, name)
        assert array.dtype == dtype
        assert array.flags.c_contiguous
        assert array.flags.owndata
        assert not array.flags.writeable
    with pytest.raises(AttributeError):
        polygons.count = 2  # type: ignore[misc]


def test_layouts_do_not_matter() -> None:
    given = np.array(SQUARE, dtype=">f4")
    for array in (given, given.astype(np.uint8), np.asfortranarray(given), given[::-1][::-1], given.astype(np.longdouble)):
        before = array.copy()
        assert Polygons(array).positions.tolist() == as_lists(SQUARE)
        assert np.array_equal(before, array)


def test_copies_and_text() -> None:
    polygons = Polygons([[SQUARE, HOLE], TRIANGLE], fill_rule="non-zero")
    assert repr(polygons) == "Polygons(2 polygons, 3 rings, 10 points)"
    assert repr(Polygons([TRIANGLE])) == "Polygons(1 polygon, 1 ring, 3 points)"
    for again in (pickle.loads(pickle.dumps(polygons)), copy.deepcopy(polygons)):
        assert rings_of(again) == rings_of(polygons)
        assert (again.fill_rule, again.count) == ("non-zero", 2)
    assert Polygons([]).fill_rule == "even-odd"


def test_bounds() -> None:
    assert Polygons([TRIANGLE, [SQUARE, HOLE]]).bounds.tolist() == [[0, 0, 0], [4, 4, 2]]


# Colours


@pytest.mark.parametrize(
    ("colors", "expected"),
    [
        ((255, 0, 9), [255, 0, 9, 255]),
        ((0.0, 1.0, 0.0, 0.5), [0, 1, 0, 0.5]),
        ([(1, 2, 3), (4, 5, 6), (7, 8, 9)], [[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]]),
    ],
)
def test_colours_are_those_of_the_polygons_as_given(colors: Any, expected: Any) -> None:
    # The second is left out and the third is cut in two; they keep their colours by number.
    polygons = Polygons([SQUARE, SQUARE[:2], SADDLE], colors=colors)
    assert polygons.source.tolist() == [0, 2, 2]
    assert polygons.colors is not None
    assert polygons.colors.tolist() == expected


# Planes


def test_reference_corners_are_far_apart_and_turn_as_the_normal_says(rng: np.random.Generator) -> None:
    for _ in range(30):
        plane = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
        ring = rng.uniform(-1, 1, (rng.integers(3, 9), 2)) * [1, 10.0 ** rng.integers(-4, 2)] @ plane + rng.uniform(-5, 5, 3)
        polygons = Polygons([ring])
        corners = polygons.positions[polygons.reference[0]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        best = max(np.linalg.norm(np.cross(b - a, c - a)) for a, b, c in itertools.combinations(ring, 3))
        assert np.linalg.norm(normal) >= 0.25 * best
        assert normal @ polygons.normals[0] == pytest.approx(np.linalg.norm(normal))

        # They are the same wherever the ring begins and whichever way it goes.
        for turned in (np.roll(ring, 3, axis=0), ring[::-1]):
            other = Polygons([turned])
            assert {tuple(c) for c in other.positions[other.reference[0]]} == {tuple(c) for c in corners}


@pytest.mark.parametrize(
    ("polygon", "normal"),
    [
        (SQUARE, (0, 0, 1)),
        (SQUARE[::-1], (0, 0, -1)),
        (TRIANGLE, (0, -1, 0)),
        ([[(0, 0), (1, 0), (1, 1), (0.9, 0.1)]], (0, 0, 1)),
        ([[(0, 0), (0.9, 0.1), (1, 1), (1, 0)]], (0, 0, -1)),
        ([SQUARE, HOLE], (0, 0, 1)),
        ([HOLE, SQUARE], (0, 0, 1)),
        ([HOLE[::-1], SQUARE], (0, 0, 1)),
        ([HOLE[::-1], SQUARE[::-1]], (0, 0, -1)),
        ([[(0, 0), (0, 1), (1, 0)], [(10, 5), (5, 0), (10, -5)]], (0, 0, 1)),
        ([(0, 0, 0), (0, 3, 4), (-5, 3, 4), (-5, 0, 0)], (0, -0.8, 0.6)),
        ([(0, 0, 1), (1, 0, 0), (0, 1, 0)][::-1], (-(3**-0.5),) * 3),
    ],
)
def test_normals_are_right_handed(polygon: Any, normal: Any) -> None:
    for scale in (1.0, 1e-300, 1e300, 1e-3):
        scaled = [np.pad(np.asarray(ring, np.float64), ((0, 0), (0, 3 - np.shape(ring)[1]))) * scale
                  for ring in (polygon if np.ndim(polygon[0]) == 2 else [polygon])]  # fmt: skip
        assert Polygons([scaled]).normals == pytest.approx(np.array([normal]), abs=1e-12)


def test_a_figure_of_eight_has_a_normal() -> None:
    normals = Polygons([[(0, 0, 5), (2, 0, 5), (0, 2, 5), (2, 2, 5)]]).normals
    assert np.abs(normals).tolist() == [[0, 0, 1]]


def test_coordinates_may_be_as_large_as_numbers_get() -> None:
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 1.7e308
    assert Polygons([corners]).normals.tolist() == [[0, 0, 1]]
    corners[1, 2] = 1e308
    assert len(Polygons([corners]).source) == 2


def test_many_polygons_are_measured_like_each_alone(rng: np.random.Generator) -> None:
    given: list[Any] = []
    for _ in range(40):
        plane = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
        given.append([rng.uniform(-1, 1, (rng.integers(3, 7), 2)) @ plane for _ in range(rng.integers(1, 4))])
    together = Polygons(given)
    alone = [Polygons([polygon]) for polygon in given]
    assert np.array_equal(together.normals, np.concatenate([polygons.normals for polygons in alone]))
    first = together.ring_starts[together.polygon_rings[:-1]]
    assert np.array_equal(together.reference - first[:, None], np.concatenate([polygons.reference for polygons in alone]))
    assert rings_of(together) == [rings_of(polygons)[0] for polygons in alone]


# Polygons that are not flat


def test_a_polygon_that_is_not_flat_becomes_triangles() -> None:
    polygons = Polygons([TRIANGLE, SADDLE, SQUARE])
    assert polygons.source.tolist() == [0, 1, 1, 2]
    assert polygons.polygon_rings.tolist() == [0, 1, 2, 3, 4]
    assert polygons.ring_starts.tolist() == [0, 3, 6, 9, 13]
    assert polygons.count == 3

    # The pieces are the saddle's own corners, share an edge, and turn as it does.
    pieces = [{tuple(point) for point in polygon[0]} for polygon in rings_of(polygons)[1:3]]
    assert pieces[0] | pieces[1] == set(SADDLE)
    assert len(pieces[0] & pieces[1]) == 2
    assert np.all(polygons.normals[1:3, 2] > 0)
    assert np.all(Polygons([SADDLE[::-1]]).normals[:, 2] < 0)


def test_a_concave_polygon_that_is_not_flat_keeps_its_outline() -> None:
    # An arrow head on its side, bent along x: seen along its normal, which is nearest to y, the pieces fill the notch nowhere.
    outline = np.array([(0, 0, 0), (4, 0, 2), (0, 0, 4), (1, 0, 2)], dtype=np.float64)
    outline[:, 1] = 0.1 * outline[:, 0] ** 2 + 0.02 * outline[:, 2]
    polygons = Polygons([outline, SADDLE])
    assert polygons.source.tolist() == [0, 0, 1, 1]
    corners = polygons.positions[:6].reshape(2, 3, 3)[:, :, [0, 2]]
    areas = np.linalg.det(np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1))
    assert np.abs(areas).sum() / 2 == pytest.approx(6)


@pytest.mark.parametrize(("height", "pieces"), [(0.0, 1), (3.9e-6, 1), (4.1e-6, 2), (1e-4, 2)])
def test_the_tolerance_is_a_share_of_the_extent(height: float, pieces: int) -> None:
    # The plane goes through the corner that is off and two others; the fourth lies as far below it.
    ring = np.array([(0, 0, 0), (4, 0, height), (4, 4, 0), (0, 4, 0)])
    for scale in (1, 1e-9, 1e9):
        assert len(Polygons([ring * scale]).source) == pieces
    assert len(Polygons([ring], tolerance=0.1).source) == 1

    # The extent is that of the polygon, not of what lies on one side of its first point.
    notched = [(0, 0, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), (-2, -2, height)]
    assert len(Polygons([notched]).source) == (1 if pieces == 1 else 3)
    assert len(Polygons([SADDLE], tolerance=10).source) == 1


def test_pieces_without_area_are_left_out() -> None:
    ring = [SADDLE[0], SADDLE[0], *SADDLE[1:], SADDLE[3]]
    polygons = Polygons([ring], tolerance=0)
    assert polygons.source.tolist() == [0, 0]
    assert np.linalg.norm(polygons.normals, axis=1) == pytest.approx(1)


def test_a_thin_polygon_is_as_flat_as_a_wide_one(rng: np.random.Generator) -> None:
    for width in (1e-3, 1e-7, 1e-9, 1e-11):
        plane = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
        outer, hole = ([(0, 0), (1, 0), (1, width), (0, width)] @ plane * size for size in (1, 0.9))
        assert Polygons([[outer, hole], outer], tolerance=1e-14).source.tolist() == [0, 1]


def test_a_triangle_is_flat_at_any_tolerance(rng: np.random.Generator) -> None:
    triangles = rng.uniform(-1, 1, (50, 3, 3))
    assert Polygons(triangles, tolerance=0).positions.tolist() == triangles.reshape(-1, 3).tolist()


def test_several_rings_that_are_not_flat_are_an_error() -> None:
    hole = [(1, 1, 2), (1, 2, 2), (2, 2, 3)]
    message = (
        r"rings\[1\]: its 2 rings do not lie in one plane, a point is 0\.25 of its extent off, the tolerance is 1e-06; "
        r"only a polygon of one ring can be cut"
    )
    with pytest.raises(InputError, match=f"^{message}$"):
        Polygons([TRIANGLE, [SQUARE, hole]])
    assert len(Polygons([TRIANGLE, [SQUARE, hole]], tolerance=0.3).source) == 2


# Numbers that are not finite


def test_a_point_that_is_not_finite_is_quoted_or_its_polygon_dropped() -> None:
    bad = [(0, 0, 0), (1, NAN, 0), (1, 1, 0), (INF, 1, 0)]
    for rings, message in [
        ([SQUARE, bad], r"rings\[1\]\[1\] = \(1\.0, nan, 0\.0\): a point is not finite"),
        ([SQUARE, [TRIANGLE, bad]], r"rings\[1\]\[1\]\[1\] = \(1\.0, nan, 0\.0\): a point is not finite"),
        (bad, r"rings\[1\] = \(1\.0, nan, 0\.0\): a point is not finite"),
        (np.array(bad)[None, 2:, :2].repeat(2, axis=1), r"rings\[0\]\[2\] = \(inf, 1\.0\): a point is not finite"),
    ]:
        with pytest.raises(InputError, match=f"^{message}$"):
            Polygons(rings)
    polygons = Polygons([SQUARE, bad, [TRIANGLE, bad], TRIANGLE], nonfinite="drop", colors=np.zeros((4, 4)))
    assert polygons.source.tolist() == [0, 3]
    assert rings_of(polygons) == [[as_lists(SQUARE)], [as_lists(TRIANGLE)]]


def test_a_ring_too_short_to_be_drawn_may_hold_anything() -> None:
    assert Polygons([[(NAN, 0), (1, 1)], SQUARE]).source.tolist() == [1]


# Messages

LOOP: list[Any] = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    ("rings", "message"),
    [
        ("abc", r"rings = 'abc': expected a list of polygons, each a ring of points or a list of rings"),
        (None, r"rings = None: expected a list of polygons, .*"),
        (5, r"rings = 5: expected a list of polygons, .*"),
        (np.float64(5), r"rings = np\.float64\(5\.0\): expected a list of polygons, .*"),
        (np.array(5.0), r"rings = array\(5\.\): expected a list of polygons, .*"),
        ({1, 2}, r"rings = \{1, 2\}: expected a list of polygons, .*"),
        ((1, 2, 3), r"rings = \(1, 2, 3\): expected a list of polygons, .*"),
        (np.arange(6.0), r"rings = array\(\[0\., 1\., 2\., 3\., 4\., 5\.\]\): expected a list of polygons, .*"),
        ([None, SQUARE, SQUARE], r"rings = \[None, \[\(0, 0, 2\), .*\], \[\(0,\.\.\.: expected a list of polygons, .*"),
        ([[[SQUARE]]], r"rings = \[\[\[\[\(0, 0, 2\), .*\]\]\]\]: expected a list of polygons, .*"),
        (LOOP, r"rings = \[\[\.\.\.\]\]: expected a list of polygons, .*"),
        ([SQUARE, 7], r"rings\[1\] = 7: expected a ring of points or a list of rings"),
        ([SQUARE, (1, 2, 3)], r"rings\[1\] = \(1, 2, 3\): expected a ring of points or a list of rings"),
        ([SQUARE, "abc"], r"rings\[1\] = 'abc': expected a ring of points or a list of rings"),
        ([SQUARE, [[[(1, 2, 3)]]]], r"rings\[1\] = \[\[\[\(1, 2, 3\)\]\]\]: expected a ring of points or a list of rings"),
        ([[SQUARE, (1, 2)]], r"rings\[0\]\[1\] = \(1, 2\): expected a ring of points"),
        ([[SQUARE, [HOLE]]], r"rings\[0\]\[1\] = \[\[\(1, 1, 2\), \(1, 2, 2\), \(2, 2, 2\)\]\]: expected a ring of points"),
        ([[SQUARE, 4]], r"rings\[0\]\[1\] = 4: expected a ring of points"),
        (
            [[(0, 0, 0), (1, 0), (1, 1, 0)]],
            r"rings\[0\]\[1\] = \(1, 0\): expected 3 coordinates, as the ring's first point has",
        ),
        ([(0, 0), (1, 0), (1, 1, 0)], r"rings\[2\] = \(1, 1, 0\): expected 2 coordinates, as the ring's first point has"),
        ([(0, 0, 0, 1)] * 3, r"rings\[0\] = \(0, 0, 0, 1\): expected a point of 2 or 3 coordinates"),
        ([SQUARE, [(0, 0), (1,), (2, 2)]], r"rings\[1\]\[1\] = \(1,\): expected a point of 2 or 3 coordinates"),
        ([SQUARE, [(0, 0), 1, (2, 2)]], r"rings\[1\]\[1\] = 1: expected a point of 2 or 3 coordinates"),
        ([SQUARE, [(0, 0), (), (2, 2)]], r"rings\[1\]\[1\] = \(\): expected a point of 2 or 3 coordinates"),
        ([SQUARE, [(), (0, 0), (2, 2)]], r"rings\[1\]\[0\] = \(\): expected a point of 2 or 3 coordinates"),
        ([(0, 0, 0), SQUARE], r"rings\[1\] = \[\(0, 0, 2\), .*: expected a point of 2 or 3 coordinates"),
        ([(0, 0), ("a", 0), (1, 1)], r"rings: expected an array of numbers, got dtype <U.*, such as '0'"),
        ([SQUARE, [(0, 0), (1j, 0), (1, 1)]], r"rings\[1\]: expected an array of numbers, got dtype complex128, such as '0j'"),
        ([[SQUARE, np.ones((4, 5))]], r"rings\[0\]\[1\]: expected shape \(N, 3\) or \(N, 2\), got \(4, 5\)"),
        ([SQUARE, [(0, 0), (10**400, 0), (1, 1)]], r"rings\[1\]: expected an array of numbers, .*"),
        (np.ma.masked_equal(np.array(SQUARE), 4), r"rings: a masked array with 4 masked entries cannot be used"),
        ([[(0, 0), ((1, 2), 3), (1, 1)]], r"rings\[0\]: expected an array of numbers, .*"),
    ],
)
def test_what_cannot_be_used_is_quoted(rings: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}$"):
        Polygons(rings)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"fill_rule": "evenodd"},
            "unknown fill rule 'evenodd'; did you mean 'even-odd'? The valid ones are: even-odd, non-zero",
        ),
        ({"fill_rule": 0}, "unknown fill rule 0; the valid ones are: even-odd, non-zero"),
        ({"nonfinite": "skip"}, "unknown value of nonfinite 'skip'; the valid ones are: error, drop"),
        ({"tolerance": -1}, "tolerance = -1: expected a finite number, 0 or more"),
        ({"tolerance": NAN}, "tolerance = nan: expected a finite number, 0 or more"),
        ({"tolerance": INF}, "tolerance = inf: expected a finite number, 0 or more"),
        ({"tolerance": "1"}, "tolerance = '1': expected a finite number, 0 or more"),
        ({"tolerance": True}, "tolerance = True: expected a finite number, 0 or more"),
        ({"tolerance": 10**400}, f"tolerance = 1{'0' * 56}...: expected a finite number, 0 or more"),
        ({"tolerance": 10**5000}, "tolerance = (int): expected a finite number, 0 or more"),
        ({"colors": [(1, 2, 3)] * 3}, "colors: expected shape (4,) or (N, 4) with N = 2, got (3, 3)"),
        ({"colors": (1, 2, 300)}, "colors: 300 is no colour value, integers are 0..255"),
        ({"colors": [(0, 0, 0), (0, 0, 1.5)]}, "colors[1]: 1.5 is no colour value, floats are 0..1"),
    ],
)
def test_options_that_cannot_be_used_are_quoted(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        Polygons([SQUARE, TRIANGLE], **options)
    assert str(caught.value) == message


def test_more_points_than_can_be_numbered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_POINTS", 9)
    with pytest.raises(LimitError, match=r"^rings: 10 points, at most 9 can be numbered$"):
        Polygons([[SQUARE, HOLE], TRIANGLE])
    assert Polygons([SQUARE, TRIANGLE]).count == 2


def test_one_colour_may_be_a_name() -> None:
    assert Polygons([SQUARE, TRIANGLE], colors="tomato").colors.tolist() == [255, 99, 71, 255]
    with pytest.raises(InputError, match="'redd' is no colour; did you mean 'red'"):
        Polygons([SQUARE], colors="redd")


def test_fill_rules_are_in_the_order_of_the_kernel() -> None:
    from scanspan.raster.polygon import EVEN_ODD, NON_ZERO

    assert module.SPATIAL_RULES[EVEN_ODD] == "even-odd"
    assert module.SPATIAL_RULES[NON_ZERO] == "non-zero"
