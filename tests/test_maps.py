"""Maps: neighbours tile the world, and what other rasterizers of maps make of the same polygons."""

from __future__ import annotations

import json
import shutil
from functools import reduce

import numpy as np
import pytest
import shapely

import scanspan as ss
from tests.maps import decode, fetch_atlas, subdivision, unroll

SIZES = [(36, 18), (160, 80), (501, 251), (1024, 512), (2000, 1000)]
LIMIT = 2.0**-40


def hits_of(polygons, size, **options):
    return ss.zones(polygons, size, reduce="count", **options)


def check_tiling(polygons, size, **options):
    """Check that polygons which fill an image do so without gaps and without double pixels, in centres and in areas."""
    hits = hits_of(polygons, size, **options)
    assert (int((hits == 0).sum()), int((hits > 1).sum())) == (0, 0)
    assert (hits_of(polygons, size, mode="area", **options) == 1.0).all()
    owner, first = (ss.zones(polygons, size, reduce=rule, **options) for rule in ("last", "first"))
    assert np.array_equal(owner, first)
    return owner


@pytest.mark.parametrize("size", [*SIZES[:3], (5000, 30)])
def test_subdivisions_tile_the_image(rng, size):
    for regions in (3, 30):
        polygons = subdivision(rng, 200, regions, size)
        assert max(len(rings) for rings in polygons) > 3
        owner = check_tiling(polygons, size)
        assert set(np.unique(owner)) <= set(range(regions))


@pytest.mark.parametrize("fault", ["moved", "lost", "twice"])
def test_a_fault_in_a_tiling_is_noticed(rng, fault):
    polygons = subdivision(rng, 60, 5, (60, 40))
    if fault == "moved":
        polygons[1] = [ring + 0.3 for ring in polygons[1]]
    elif fault == "lost":
        polygons[1] = polygons[1][1:]
    else:
        polygons.append(polygons[1])
    with pytest.raises(AssertionError):
        check_tiling(polygons, (60, 40))


def test_the_largest_share_of_a_tiling_leaves_nothing_out(rng):
    polygons = subdivision(rng, 100, 12, (50, 40))
    owner = ss.zones(polygons, (50, 40), mode="area", reduce="majority")
    shares = np.array([ss.coverage(rings, (50, 40), mode="area") for rings in polygons])
    assert np.array_equal(owner, np.rint(shares * 2.0**32).argmax(axis=0))
    assert owner.min() >= 0


def test_topologies_are_decoded_with_their_shared_arcs():
    # Two squares side by side, with a hole that an island fills; the middle arc belongs to both, once backwards.
    topology = {
        "transform": {"scale": [0.5, 0.25], "translate": [-1.0, 2.0]},
        "arcs": [[[4, 0], [0, 8]], [[4, 8], [-4, 0], [0, -8], [4, 0]], [[4, 0], [4, 0], [0, 8], [-4, 0]],
                 [[1, 1], [0, 2], [2, 0], [0, -2], [-2, 0]]],
        "objects": {"squares": {"geometries": [
            {"type": "Polygon", "arcs": [[0, 1], [3]], "properties": {"name": "left"}},
            {"type": "MultiPolygon", "arcs": [[[2, ~0]]], "properties": {"name": "right"}},
            {"type": "Polygon", "arcs": [[~3]], "properties": {"name": "island"}}]}},
    }  # fmt: skip
    polygons, names = decode(json.loads(json.dumps(topology)), "squares")
    assert names == ["left", "right", "island"]
    for width in (5, 8, 31, 64, 100):
        check_tiling(polygons, (width, width // 2), bounds=(-1, 2, 3, 4))


def test_a_ring_over_the_date_line_is_there_on_both_sides_of_the_map():
    bounds = {"bounds": (-180, -90, 180, 90)}
    across = unroll(np.array([(170.0, 0.0), (-170.0, 0.0), (-170.0, 30.0), (170.0, 30.0)]))
    assert np.argwhere(ss.coverage(across, (36, 18), **bounds)[7]).ravel().tolist() == [0, 35]
    cap = unroll(np.array([(float(x), -60.0) for x in (-90, 0, 90, 180)]))
    assert np.argwhere(ss.coverage(cap, (36, 18), **bounds).all(axis=1)).ravel().tolist() == [15, 16, 17]
    assert len(unroll(np.array([(0.0, 0.0), (9.0, 0.0), (9.0, 9.0)]))) == 1


@pytest.fixture(scope="module")
def atlas(tmp_path_factory):
    """Give the countries of the world, or skip and say why."""
    found = fetch_atlas(tmp_path_factory.mktemp("atlas"))
    if isinstance(found, str):
        pytest.skip(f"the countries of npm's world-atlas cannot be had: {found}")
    polygons, names = decode(found, "countries")
    return [[part for ring in polygon for part in unroll(ring)] for polygon in polygons], names


@pytest.fixture(scope="module")
def overlaps(atlas):
    """Give what shapely finds to lie in two countries, with a margin."""
    shapes = [reduce(shapely.symmetric_difference, [shapely.Polygon(ring).buffer(0) for ring in rings]) for rings in atlas[0]]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="intersects").T
    found = [shapes[a].intersection(shapes[b]) for a, b in pairs if a < b]
    return [both.buffer(1e-3) for both in found if both.area > 0]


@pytest.mark.parametrize("size", SIZES)
def test_countries_tile_the_world(atlas, overlaps, size, report):
    polygons, _ = atlas
    options = {"bounds": (-180, -90, 180, 90)}
    hits = hits_of(polygons, size, **options)

    # A border between two countries is walked twice, once in each direction, so all rings together, even-odd, are the land:
    # where that is covered, exactly one country is; elsewhere none.
    land = ss.coverage([ring for polygon in polygons for ring in polygon], size, **options)
    gaps, doubles = int((land & (hits == 0)).sum()), int((hits > 1).sum())
    report(f"{size[0]} x {size[1]}: {len(polygons)} countries, {int(land.sum())} pixels of land, {gaps} gaps, {doubles} double")
    assert (gaps, doubles) == (0, 0)
    assert np.array_equal(hits == 1, land)

    # In areas the same, but where the outlines themselves lie on each other by less than a pixel, as Sudan's do.
    share = ss.coverage([ring for polygon in polygons for ring in polygon], size, mode="area", **options)
    off = np.abs(hits_of(polygons, size, mode="area", **options) - share) > LIMIT
    assert not (off & ~ss.coverage(overlaps, size, mode="touched", **options)).any()
    assert int(off.sum()) < 20
    assert abs(land.mean() - share.mean()) < 0.02


def test_the_sea_is_what_the_countries_leave(atlas):
    polygons, names = atlas
    frame = [(-180, -90), (180, -90), (180, 90), (-180, 90)]
    sea = [frame, *(ring for polygon in polygons for ring in polygon)]
    hits = hits_of([*polygons, sea], (720, 360), bounds=(-180, -90, 180, 90))
    assert (hits == 1).all()
    owner = ss.zones(polygons, (720, 360), bounds=(-180, -90, 180, 90))
    assert names[owner[2 * (90 - 47), 2 * (180 + 2)]] == "France"
    assert names[owner[2 * (90 + 25), 2 * (180 + 134)]] == "Australia"


def test_without_npm_or_a_registry_the_reason_is_told(monkeypatch, tmp_path):
    if shutil.which("npm"):
        monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9")
        monkeypatch.setenv("npm_config_cache", str(tmp_path))
        assert "npm could not fetch world-atlas" in str(fetch_atlas(tmp_path))
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert fetch_atlas(tmp_path) == "npm is not installed"


# Others


def geojson(ring):
    points = np.asarray(ring).tolist()
    return {
        "type": "Feature",
        "id": 1,
        "properties": {},
        "geometry": {"type": "Polygon", "coordinates": [[*points, points[0]]]},
    }


def fractions(feature, size):
    """Return exactextract's share of each pixel, which it keeps in float32."""
    extract = pytest.importorskip("exactextract")
    raster = pytest.importorskip("exactextract.raster")
    source = raster.NumPyRasterSource(np.zeros(size[::-1]), 0, 0, *size)
    found = extract.exact_extract(source, [feature], ["cell_id", "coverage"])[0]["properties"]
    out = np.zeros(size[0] * size[1])
    out[np.array(found["cell_id"], int)] = found["coverage"]
    return out.reshape(size[::-1])


def random_ring(rng, size, unit):
    angle = np.sort(rng.uniform(0, 2 * np.pi, 11))
    ring = np.c_[np.cos(angle), np.sin(angle)] * rng.uniform(0.2, 0.45, (11, 1)) * min(size) + np.array(size) / 2
    return np.rint(ring * unit) / unit


def test_areas_equal_exactextract(rng, report):
    size, worst = (24, 20), 0.0
    for _ in range(30):
        feature = geojson(random_ring(rng, size, 65536))
        theirs, ours = fractions(feature, size), ss.coverage(feature, size, mode="area", bounds=(0, 0, *size))
        rounded = np.spacing(np.maximum(theirs, ours).astype(np.float32)).astype(float) / 2
        worst = max(worst, float((np.abs(theirs - ours) - rounded).max()))
    report(f"beyond the rounding of its float32, exactextract differs by {max(worst, 0.0):.1e}")
    assert worst < 1e-9


def test_areas_that_float32_holds_equal_exactextract_to_the_ninth_digit(rng):
    # Edges level, upright or at 45 degrees, from sixteenths of a pixel: shares are multiples of 1 / 512.
    for _ in range(30):
        x, y, w, h = rng.integers(16, 160, 4)
        c = int(rng.integers(1, min(w, h) // 2))
        corners = [(x + c, y), (x + w - c, y), (x + w, y + c), (x + w, y + h - c), (x + w - c, y + h), (x + c, y + h),
                   (x, y + h - c), (x, y + c)]  # fmt: skip
        feature = geojson(np.array(corners) / 16)
        ours = ss.coverage(feature, (20, 20), mode="area", bounds=(0, 0, 20, 20))
        assert np.abs(fractions(feature, (20, 20)) - ours).max() < 1e-9


def burn(features, size, **options):
    rasterio = pytest.importorskip("rasterio.features")
    return rasterio.rasterize(
        [(f["geometry"], n) for n, f in enumerate(features)], size[::-1], fill=-1, dtype="int32", **options
    )


def test_centres_equal_rasterio_on_the_grid_and_away_from_ties(rng):
    # Corners lie on odd 512ths of a pixel, so no centre lies on a level or an upright edge.
    for _ in range(20):
        rings = [np.floor(rng.uniform(-3, 67, (5, 2)) * 128) / 128 + 1 / 256 for _ in range(12)]
        features = [geojson(ring) for ring in rings]
        assert np.array_equal(ss.zones(features, (64, 48)), burn(features, (64, 48)))


def test_on_a_tie_the_left_edge_owns_the_centre_and_with_rasterio_the_right_one():
    ring = [(1.5, 1.5), (3.5, 1.5), (3.5, 3.5), (1.5, 3.5)]
    ours, theirs = ss.coverage(ring, (5, 5)), burn([geojson(ring)], (5, 5)) >= 0
    assert np.argwhere(ours).tolist() == [[1, 1], [1, 2], [2, 1], [2, 2]]
    assert np.argwhere(theirs).tolist() == [[1, 2], [1, 3], [2, 2], [2, 3]]


# Other tools' bugs


def test_rasterio_619_a_shared_border_belongs_to_one_polygon_by_the_rule_that_is_asked_for():
    left, right = [(0, 0), (2.5, 0), (2.5, 4), (0, 4)], [(2.5, 0), (5, 0), (5, 4), (2.5, 4)]
    shared = {
        reduce: ss.zones([left, right], (5, 4), mode="touched", reduce=reduce)[0, 2] for reduce in ("first", "last", "count")
    }
    assert shared == {"first": 0, "last": 1, "count": 2}
    assert (ss.zones([left, right], (5, 4), reduce="count") == 1).all()
    assert ss.zones([left, right], (5, 4), mode="area", values=[1.0, 3.0], reduce="mean")[0].tolist() == [1, 1, 2, 3, 3]


def test_rasterio_232_pixels_are_weighted_by_the_polygon():
    third = [(0.25, 0), (1.25, 0), (1.25, 2), (0.25, 2)]
    assert ss.coverage(third, (3, 1), mode="area").tolist() == [[0.75, 0.25, 0.0]]


def test_ctreeskit_3_shares_of_a_giant_raster_are_had_without_it():
    size, ring = (200_000, 200_000), [(100.25, 7.5), (199_000.5, 9.25), (50_000, 199_999.75)]
    around = ss.coverage(ring, size, mode="area", window=(99, 6, 40, 30))
    assert around[1, 1] > 0
    assert around[0].sum() == 0.0


def test_drtk_9_two_triangles_leave_no_diagonal():
    corners = [(2.0, 2.0), (14.0, 2.0), (14.0, 14.0), (2.0, 14.0)]
    for pair in ([(0, 1, 2), (0, 2, 3)], [(0, 1, 3), (1, 2, 3)]):
        triangles = [[corners[k] for k in triangle] for triangle in pair]
        hits = ss.zones(triangles, (16, 16), reduce="count")
        assert (hits[2:14, 2:14] == 1).all()
        assert int(hits.sum()) == 144


def test_scikit_image_7271_nothing_is_rounded_up_at_one_corner():
    ring = np.array([(2.2, 2.2), (9.8, 2.2), (9.8, 9.8), (2.2, 9.8)])
    found = ss.coverage(ring, (12, 12))
    assert np.array_equal(found, found[::-1])
    assert np.array_equal(found, found[:, ::-1])
    assert np.array_equal(found, found.T)


def test_xarray_spatial_3102_a_mode_holds_for_every_reduction():
    sliver = [(0.4, 0.6), (10.4, 10.6), (10.6, 10.4), (0.6, 0.4)]
    mask = ss.coverage(sliver, (11, 11), mode="touched")
    for rule in ("first", "last", "min", "max", "sum", "mean", "count"):
        found = ss.zones([sliver], (11, 11), values=[1.0], reduce=rule, mode="touched", background=0)
        assert np.array_equal(found == 1, mask)
