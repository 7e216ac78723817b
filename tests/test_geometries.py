"""Polygons of maps in every form that people have them, and where they lie in the image."""

from __future__ import annotations

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from shapely.geometry import mapping

import scanspan as ss
from scanspan.assets.geometries import as_polygons, take_apart

SIZE = (12, 10)
OUTER, HOLE = [(1, 1), (9, 1.5), (8, 8), (1.5, 7)], [(3, 3), (5, 3), (5, 5), (3, 5)]
ISLAND = [(9.5, 8), (11, 8), (11, 9.5)]
BOTH = shapely.MultiPolygon([shapely.Polygon(OUTER), shapely.Polygon(ISLAND)])
SHAPES = [shapely.Polygon(OUTER, [HOLE]), shapely.Polygon(), BOTH, shapely.Polygon(ISLAND)]
FAR = shapely.set_coordinates(shapely.Polygon(ISLAND), [(0, 0), (1, np.inf), (1, 1), (0, 0)])
PLAIN = [[OUTER, HOLE], [], [OUTER, ISLAND], [ISLAND]]


class Outline:
    """What knows nothing but the geo interface."""

    def __init__(self, geometry):
        self.__geo_interface__ = mapping(geometry)


class Column:
    """A column of geometries as GeoPandas has it: a sequence that also says how it is as GeoJSON."""

    def __init__(self, geometries):
        self.geometries = geometries

    def __len__(self):
        return len(self.geometries)

    def __iter__(self):
        return iter(self.geometries)

    @property
    def geometry(self):
        return self

    @property
    def __geo_interface__(self):
        raise AssertionError("a column is read as it is")


def features(geometries):
    return {"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {}, "geometry": None if g.is_empty else mapping(g)} for g in geometries]}  # fmt: skip


FORMS = {
    "shapely": SHAPES, "array": np.array(SHAPES, object), "tuple": tuple(SHAPES), "geo interface": [Outline(s) for s in SHAPES],
    "GeoSeries": Column(SHAPES), "GeoDataFrame": SimpleNamespace(geometry=Column(SHAPES)),
    "GeoJSON": features(SHAPES),
    "read": json.loads(json.dumps(features(SHAPES))), "features": features(SHAPES)["features"],
    "mixed": [SHAPES[0], None, PLAIN[2], mapping(SHAPES[3])], "None": [SHAPES[0], None, SHAPES[2], SHAPES[3]],
    "collections": [shapely.GeometryCollection([s]) for s in SHAPES],
    "closed": [[[*r, r[0]] for r in rings] for rings in PLAIN],
    "height": [shapely.force_3d(s, 7.0) for s in SHAPES],
    "arrays": [[np.array(r, np.float32) for r in rings] for rings in PLAIN],
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_polygons(form):
    expected = ss.zones(PLAIN, SIZE, reduce="first", mode="touched")
    assert set(np.unique(expected)) == {-1, 0, 2}
    found = as_polygons(FORMS[form])
    assert found.polygon_rings.tolist() == [0, 2, 2, 4, 5]
    assert np.array_equal(ss.zones(FORMS[form], SIZE, reduce="first", mode="touched"), expected)


def test_shapely_takes_apart_what_the_geo_interface_does(rng):
    many = [shapely.Polygon(rng.uniform(0, 9, (5, 2)), [rng.uniform(0, 9, (4, 2))]) for _ in range(20)] + SHAPES
    fast, slow = take_apart(np.array(many, object)), as_polygons([Outline(shape) for shape in many])
    assert fast is not None
    for left, right in zip(fast, slow, strict=True):
        assert left.dtype == right.dtype
        assert np.array_equal(left, right)


def test_one_polygon_in_every_form():
    expected = ss.coverage([OUTER, HOLE], SIZE)
    forms = [SHAPES[0], Outline(SHAPES[0]), mapping(SHAPES[0]), {"type": "Feature", "geometry": mapping(SHAPES[0])},
             [SHAPES[0]], np.array([SHAPES[0]], object), features([SHAPES[0]]),
             shapely.GeometryCollection([SHAPES[0]])]  # fmt: skip
    for form in forms:
        assert np.array_equal(ss.coverage(form, SIZE), expected)
        assert np.array_equal(ss.zones(form, SIZE) == 0, expected)
    both = ss.coverage([OUTER], SIZE) | ss.coverage(ISLAND, SIZE)
    assert np.array_equal(ss.coverage([shapely.Polygon(OUTER), shapely.Polygon(ISLAND)], SIZE), both)


def test_polygons_of_a_scene_keep_their_numbers():
    made = ss.Polygons([[(0, 0), (1, 0)], [OUTER, HOLE], ISLAND])
    assert as_polygons(made).polygon_rings.tolist() == [0, 0, 2, 3]
    assert np.array_equal(ss.zones(made, SIZE), ss.zones([[], [OUTER, HOLE], ISLAND], SIZE))


def test_shapely_is_not_imported():
    code = """import sys, scanspan as ss
ss.zones([{'type': 'Polygon', 'coordinates': [[(0, 0), (1, 0), (1, 1)]]}], (2, 2), transform=(1, 0, 0, 0, 1, 0))
print(sorted({'shapely', 'geopandas', 'affine', 'rasterio'} & set(sys.modules)))"""
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("polygons", "message"),
    [(shapely.Point(1, 2), "polygons: a Point covers no area; expected polygons"),
     ([SHAPES[0], shapely.LineString([(0, 0), (1, 1)])], r"polygons\[1\]: a LineString covers no area"),
     (features([SHAPES[0], shapely.MultiPoint([(0, 0)])]), r"polygons.features\[1\]: a MultiPoint covers no area"),
     ([shapely.GeometryCollection([SHAPES[0], shapely.Point(1, 2)])], r"polygons\[0\]\[1\]: a Point covers no area"),
     (Column([shapely.Point(0, 0)]), r"polygons.geometry\[0\]: a Point"),
     ({"type": "Polygone", "coordinates": []}, "polygons: {'type': 'Polygone', 'coordinates': .* is no GeoJSON polygon"),
     ({"type": "Polygon"}, "is no GeoJSON polygon"), ({"type": "Feature", "geometry": 3}, "polygons: 3 is no geometry"),
     ([SHAPES[0], 5], r"polygons\[1\]: expected points of shape \(M, 2\), got int64"),
     ({"type": "Polygon", "coordinates": [[(0, 0), (1, "a"), (1, 1)]]}, "polygons, ring 0: expected an array of numbers"),
     ({"type": "Polygon", "coordinates": [[(0, 0), (1,), (1, 1)]]}, "polygons, ring 0: expected an array of numbers"),
     ([FAR], r"polygons\[0\], ring 0\[1\] = \[1.0, inf\]: expected finite numbers"),
     (features([SHAPES[0]])["features"][0] | {"type": "Topology"}, "is no GeoJSON polygon")],
)  # fmt: skip
def test_what_is_no_polygon_is_quoted(polygons, message):
    with pytest.raises(ss.InputError, match=message):
        ss.zones(polygons, SIZE)


# Where it lies


def test_transforms_in_every_form_put_a_polygon_in_one_place():
    affine = pytest.importorskip("affine")
    world = [(10 + 2 * x, 50 - 4 * y) for x, y in OUTER]
    expected = ss.coverage(OUTER, SIZE, mode="area")
    six = (2.0, 0.0, 10.0, 0.0, -4.0, 50.0)
    forms = [six, list(six), np.array(six), np.reshape(six, (2, 3)), np.concatenate([np.reshape(six, (2, 3)), [[0, 0, 1]]]),
             affine.Affine(*six), (*six, 0, 0, 1)]  # fmt: skip
    for transform in forms:
        assert np.array_equal(ss.coverage(world, SIZE, mode="area", transform=transform), expected)
    assert np.array_equal(ss.coverage(world, SIZE, mode="area", bounds=(10, 10, 34, 50)), expected)


@pytest.mark.parametrize("mode", ["center", "touched"])
def test_a_turned_transform_equals_rasterio(rng, mode):
    features_of = pytest.importorskip("rasterio.features")
    affine = pytest.importorskip("affine")
    # Powers of two and a rotation by 3, 4, 5: everything stays on the grid.
    a, b, c, d, e, f = 3.0, -4.0, 64.0, 4.0, 3.0, -32.0
    transform = affine.Affine(a, b, c, d, e, f)
    for _ in range(20):
        pixels = rng.integers(-2 * 16, 34 * 16, (6, 2)) / 16 + 1 / 64
        world = [(a * x + b * y + c, d * x + e * y + f) for x, y in pixels]
        shape = {"type": "Polygon", "coordinates": [[*world, world[0]]]}
        burned = features_of.rasterize([shape], (30, 32), transform=transform, all_touched=mode == "touched") > 0
        assert np.array_equal(ss.coverage(shape, (32, 30), mode=mode, transform=transform), burned)


def test_neighbours_on_the_map_are_neighbours_in_the_image(rng):
    shared = rng.uniform(-180, 180, (30, 2))
    for options in ({"bounds": (-170.1, -80.3, 171.7, 83.9)}, {"transform": (0.37, 0.011, -180.3, -0.013, -0.41, 91.7)}):
        triangles = [shared[[0, 1, 2]], shared[[2, 1, 3]], shared[[1, 4, 3]]]
        hits = ss.zones(triangles, (97, 61), reduce="count", **options)
        edges = ss.coverage(
            [shared[[0, 1, 2]], shared[[2, 1, 3]], shared[[1, 4, 3]]], (97, 61), fill_rule="even-odd", **options
        )
        assert np.array_equal(hits % 2 == 1, edges)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"transform": (1, 2, 3)}, r"transform = \(1, 2, 3\): expected an affine transform"),
     ({"transform": (1, 0, 0, 2, 0, 0)}, r"transform = \(1, 0, 0, 2, 0, 0\): is singular"),
     ({"transform": (1e-200, 0, 0, 0, 1e-200, 0)}, "is singular"), ({"transform": (1e200, 0, 0, 0, 1e200, 0)}, "is singular"),
     ({"transform": (1, 0, float("nan"), 0, 1, 0)}, "transform = .*: expected finite numbers"),
     ({"transform": np.ones((3, 3))}, "its last row must be 0, 0, 1"),
     ({"transform": "x"}, "transform: expected an array of numbers"),
     ({"bounds": (0, 0, 1)}, r"bounds = \(0, 0, 1\): expected \(left, bottom, right, top\)"),
     ({"bounds": (0, 0, 0, 1)}, "bounds = .*: expected left < right and bottom < top"),
     ({"bounds": (0, 3, 1, 1)}, "expected left < right and bottom < top"),
     ({"bounds": (0, 0, 1, float("inf"))}, "finite numbers"),
     ({"bounds": (-1e308, 0, 1e308, 1)}, "expected left < right"),
     ({"bounds": (0, 0, 1, 1), "transform": (1, 0, 0, 0, 1, 0)}, "transform and bounds: expected one of them, got both"),
     ({"bounds": (0, 0, 1e-9, 1e-9)}, r"polygons\[0\]: the point \[1.0, 1.0\] is more than 16777216 pixels away"),
     ({"transform": (1e-300, 0, 0, 0, 1, 0)}, "more than 16777216 pixels away")],
    ids=str,
)  # fmt: skip
def test_what_makes_no_place_is_quoted(options, message):
    with pytest.raises(ss.InputError, match=message):
        ss.coverage(OUTER, SIZE, **options)


def test_plain_arrays_are_taken_at_once_as_they_are_one_by_one():
    arrays = [[np.array(ring, float) for ring in rings] for rings in PLAIN]
    closed = [[np.concatenate([ring, ring[:1]]) for ring in rings] for rings in arrays]
    short = [*arrays, [np.array(OUTER[:2], float), np.empty((0, 2))], np.array([*OUTER[:2], OUTER[0]], float), arrays[0][0]]
    for polygons in (arrays, closed, short, [], [[]], [arrays[3][0]]):
        # A tuple is not plain, and taken apart one by one.
        found, expected = as_polygons(polygons), as_polygons(tuple(polygons))
        assert [part.dtype for part in found] == [part.dtype for part in expected]
        assert all(np.array_equal(one, other) for one, other in zip(found, expected, strict=True))
    for rings in (arrays[0], arrays[0][0], closed[0], []):
        found, expected = (as_polygons(form, is_one=True) for form in (rings, tuple(rings)))
        assert all(np.array_equal(one, other) for one, other in zip(found, expected, strict=True))


def test_plain_arrays_are_checked_before_short_rings_are_left_out():
    for bad in (np.nan, np.inf, -np.inf):
        short = np.array([(0, 0), (bad, 1)])
        with pytest.raises(ss.InputError, match=r"polygons\[1\]\[1\] = \[-?(nan|inf), 1.0\]: expected finite numbers"):
            as_polygons([np.array(OUTER, float), short])
    with pytest.raises(ss.InputError, match=r"polygons\[1\]: rings\[0\] = \[33554432.0, 0.0\]: expected finite numbers within"):
        ss.Canvas(3, 3).polygons([np.array(OUTER, float), np.array([(2.0**25, 0)])], ["red", "blue"])


@pytest.mark.parametrize("form", FORMS)
def test_a_canvas_paints_every_form(form):
    pictures = []
    for polygons in (PLAIN, FORMS[form]):
        canvas = ss.Canvas(*SIZE)
        canvas.polygons(polygons, np.arange(16, dtype=np.uint8).reshape(4, 4) | 128)
        pictures.append(canvas.pixels)
    assert np.array_equal(*pictures)
    assert not (pictures[0] == 255).all()


def test_a_canvas_paints_one_polygon_in_every_form():
    pictures = []
    shape = SHAPES[0]
    for rings in ([OUTER, HOLE], shape, Outline(shape), mapping(shape), [shape], features([shape]), Column([shape])):
        canvas = ss.Canvas(*SIZE)
        canvas.polygon(rings, "red", antialias=True)
        pictures.append(canvas.pixels)
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])
    assert not (pictures[0] == 255).all()


@pytest.mark.parametrize(
    ("method", "given", "message"),
    [
        ("polygon", SHAPES[:1] * 3, "rings: expected one polygon, got 3; use polygons for many"),
        ("polygon", shapely.Point(1, 2), "rings: a Point covers no area; expected polygons: rings of (M, 2) points, or shapely,"
         " GeoPandas or GeoJSON polygons"),
        ("polygons", [OUTER, shapely.Point(1, 2)], "polygons[1]: a Point covers no area; expected polygons: rings of (M, 2)"
         " points, or shapely, GeoPandas or GeoJSON polygons"),
        ("polygons", [shapely.box(0, 0, 1e8, 1)], "polygons[0]: the point [100000000.0, 0.0] is more than 16777216 pixels away"
         " from the image"),
    ],
)  # fmt: skip
def test_a_canvas_quotes_what_it_cannot_paint(method, given, message):
    with pytest.raises(ss.InputError) as caught:
        getattr(ss.Canvas(*SIZE), method)(given, "red")
    assert str(caught.value) == message
