"""PointCloud: what it accepts, that it loses nothing, what is selected, and every message."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.cloud import PointCloud
from scanspan.assets.cloud_choice import CLASSES
from scanspan.assets.scene import Instance, Scene
from scanspan.errors import InputError

NAN, INF = float("nan"), float("inf")
SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.5)]


def survey(count: int = 1000, seed: int = 1) -> PointCloud:
    """Return a cloud as a survey has them: centimetres, far from the origin."""
    rng = np.random.default_rng(seed)
    return PointCloud(
        integers=rng.integers(-(2**31), 2**31, (count, 3)),
        scale=(0.001, 0.001, 0.0005),
        offset=(515384.823, 4918360.74, 2330.73575),
        color=rng.integers(0, 256, (count, 3)),
        intensity=rng.integers(0, 65536, count),
        classification=rng.integers(0, 20, count),
        return_number=rng.integers(1, 4, count),
        number_of_returns=rng.integers(1, 4, count),
        normals=rng.normal(size=(count, 3)),
        crs="EPSG:26912",
    )


def test_coordinates_of_a_survey_lose_nothing() -> None:
    cloud = survey()
    assert cloud.integers is not None
    back = np.rint((cloud.positions - cloud.offset) / cloud.scale).astype(np.int64)
    np.testing.assert_array_equal(back, cloud.integers)

    # A position is off from the exact one by two roundings at most.
    scale, offset = Fraction(0.001), Fraction(515384.823)
    for whole, found in zip(cloud.integers[:50, 0].tolist(), cloud.positions[:50, 0].tolist(), strict=True):
        assert abs(Fraction(found) - (whole * scale + offset)) <= Fraction(1, 2**30)


def test_bounds_are_those_of_the_positions_to_the_bit() -> None:
    for cloud in (
        survey(),
        survey(1),
        PointCloud(np.random.default_rng(2).random((99, 3), np.float32), scale=3, offset=[1, 2, 3]),
    ):
        places = cloud.positions
        np.testing.assert_array_equal(cloud.bounds, [places.min(axis=0), places.max(axis=0)])
    assert np.isnan(PointCloud([]).bounds).all()


def test_what_is_kept_is_narrow_read_only_and_its_own() -> None:
    cloud = survey()
    kept = {name: values.dtype.name for name, values in cloud.columns.items()}
    assert kept == {
        "color": "uint8", "intensity": "uint16", "classification": "uint8", "return_number": "uint8",
        "number_of_returns": "uint8", "normals": "float32",
    }  # fmt: skip
    assert cloud.stored.dtype == np.int32
    for array in (cloud.stored, cloud.scale, cloud.offset, *cloud.columns.values()):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    given = np.zeros((2, 3))
    cloud = PointCloud(given)
    given[:] = 7
    assert not cloud.positions.any()


def test_floats_keep_their_width() -> None:
    assert PointCloud(np.zeros((2, 3), np.float32)).stored.dtype == np.float32
    assert PointCloud(np.zeros((2, 3), np.float16)).stored.dtype == np.float32
    assert PointCloud(np.zeros((2, 3), ">f8")).stored.dtype == np.float64
    assert PointCloud([(1, 2, 3)]).stored.dtype == np.float64
    assert PointCloud([(1, 2, 3)]).integers is None
    assert PointCloud(np.zeros((2, 3), np.float32)).positions.dtype == np.float64


def test_colours_in_all_forms() -> None:
    def kept(color: Any) -> Any:
        found = PointCloud(SQUARE[:2], color=color).color
        assert found is not None
        return found.tolist()

    assert kept([(1, 2, 3), (4, 5, 6)]) == [[1, 2, 3], [4, 5, 6]]
    assert kept([(1, 2, 3, 9), (4, 5, 6, 9)]) == [[1, 2, 3, 9], [4, 5, 6, 9]]
    assert kept([(0.0, 0.5, 1.0), (0.2, 0.2, 0.2)]) == [[0, 128, 255], [51, 51, 51]]
    assert kept("red") == [[255, 0, 0]] * 2
    assert kept((0.0, 0.0, 1.0, 0.2)) == [[0, 0, 255, 51]] * 2
    colors = PointCloud(SQUARE[:1], color=[(1, 2, 3)]).colors
    assert colors is not None
    assert colors.tolist() == [[1, 2, 3, 255]]
    assert PointCloud(SQUARE).colors is None


def test_intensities_beyond_16_bits_or_with_a_point_are_floats() -> None:
    for values, kind in (([0, 65535], "uint16"), ([-2048, 2047], "float32"), ([0.5, 1.0], "float32"), ([0, 65536], "float32")):
        found = PointCloud(SQUARE[:2], intensity=values).intensity
        assert found is not None
        assert found.dtype.name == kind
        assert found.tolist() == values


def test_points_that_are_not_finite_are_quoted_or_left_out() -> None:
    places = [*SQUARE, (NAN, 0, 0)]
    with pytest.raises(InputError, match=r"positions\[4\] = \(nan, 0.0, 0.0\): a point is not finite"):
        PointCloud(places)
    cloud = PointCloud(places, intensity=[1.0, INF, 3, 4, 5], classification=[1, 2, 3, 4, 5], nonfinite="drop")
    assert cloud.classification is not None
    assert cloud.classification.tolist() == [1, 3, 4]
    assert cloud.positions.tolist() == [list(SQUARE[k]) for k in (0, 2, 3)]
    with pytest.raises(InputError, match=r"intensity\[1\] = inf: a point is not finite"):
        PointCloud(SQUARE, intensity=[1.0, INF, 3, 4])
    normals = PointCloud(SQUARE[:2], normals=[(0, 1, NAN), (0, 0, 1)]).normals
    assert normals is not None
    assert normals.tolist() == [[0, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (PointCloud, "a PointCloud takes either positions or integers"),
        (lambda: PointCloud(SQUARE, integers=[(1, 2, 3)]), "a PointCloud takes either positions or integers"),
        (lambda: PointCloud([(1, 2)]), r"positions: expected shape \(N, 3\), got \(1, 2\)"),
        (lambda: PointCloud(["a"]), "positions: expected an array of numbers"),
        (lambda: PointCloud(integers=[(1, 2)]), r"integers: expected shape \(N, 3\), got \(1, 2\)"),
        (lambda: PointCloud(integers=[(1, 2, 0.5)]), r"integers\[0\] = \(1.0, 2.0, 0.5\): expected whole numbers"),
        (lambda: PointCloud(integers=[(0, 0, 0), (0, 2**31, 0)]), r"integers\[1\] = .*: expected numbers of 32 bits"),
        (lambda: PointCloud(SQUARE, scale=0), r"scale = \(0.0, 0.0, 0.0\): expected numbers above 0"),
        (lambda: PointCloud(SQUARE, scale=(1, -1, 1)), "scale = .*: expected numbers above 0"),
        (lambda: PointCloud(SQUARE, scale=(1, 1)), r"scale: expected shape \(3,\), got \(2,\)"),
        (lambda: PointCloud(SQUARE, scale=NAN), "scale = .*: expected finite numbers"),
        (lambda: PointCloud(SQUARE, offset=5), r"offset: expected shape \(3,\), got \(\)"),
        (lambda: PointCloud(SQUARE, offset=(0, 0, INF)), r"offset = \(0.0, 0.0, inf\): expected finite numbers"),
        (lambda: PointCloud([(1e200, 0, 0)]), "positions reach from .* to .*: expected coordinates within 1e150"),
        (lambda: PointCloud(SQUARE, scale=1e300), "positions reach from .*: expected coordinates within 1e150"),
        (lambda: PointCloud(SQUARE, color=[(1, 2, 3)]), r"color: expected shape \(4,\) or \(N, 4\) with N = 4, got \(1, 3\)"),
        (lambda: PointCloud(SQUARE, color=[(1, 2, 300)] * 4), r"color\[0\]: 300 is no colour value, integers are 0..255"),
        (lambda: PointCloud(SQUARE, intensity=[1, 2]), r"intensity: expected shape \(4,\), one for each point, got \(2,\)"),
        (lambda: PointCloud(SQUARE, classification=[1, 2, 3, 256]), r"classification\[3\] = 256: expected 0..255"),
        (lambda: PointCloud(SQUARE, return_number=[1, 1, 1.5, 1]), r"return_number\[2\] = 1.5: expected whole numbers"),
        (lambda: PointCloud(SQUARE, number_of_returns=[-1, 1, 1, 1]), r"number_of_returns\[0\] = -1: expected 0..255"),
        (lambda: PointCloud(SQUARE, normals=[(0, 0, 1)]), r"normals: expected shape \(4, 3\), one for each point"),
        (lambda: PointCloud(SQUARE, size=0), "size = 0: expected a number of pixels above 0"),
        (lambda: PointCloud(SQUARE, crs=4326), "crs: expected text, got int"),  # type: ignore[arg-type]
        (lambda: PointCloud(SQUARE, nonfinite="skip"), "unknown value of nonfinite 'skip'"),
        (lambda: PointCloud(SQUARE).take([4]), r"rows\[0\] = 4: the cloud has 4 points"),
        (lambda: PointCloud(SQUARE).take([[0]]), r"rows: expected row numbers or \(4,\) truth values, got shape \(1, 1\)"),
        (lambda: PointCloud(SQUARE).take([True]), r"rows: expected row numbers or \(4,\) truth values, got shape .* bool"),
        (lambda: PointCloud(SQUARE).select(classification=2), "classification: the cloud has none; it has nothing but pos"),
        (lambda: PointCloud(SQUARE, color="red").select(returns=2), "return_number: the cloud has none; it has color"),
        (lambda: survey().select(classification="grund"), "unknown class 'grund'; did you mean 'ground'?"),
        (lambda: survey().select(classification=300), "classification = 300: expected the number of a class, 0..255, or its n"),
        (lambda: survey().select(classification=[2, 2.5]), "classification = 2.5: expected the number of a class"),  # type: ignore
        (lambda: survey().select(returns="frist"), "unknown return 'frist'; did you mean 'first'?"),
        (lambda: survey().select(returns=True), "returns = True: expected return numbers, 0..255, or first, last or single"),
        (lambda: survey().select(bounds=[0, 1]), r"bounds: expected the lowest and the highest corner, shape \(2, 3\) or"),
        (lambda: survey().select(bounds=[(0, 0), (1, -1)]), r"bounds = .*: expected the lowest corner first"),
        (lambda: survey().select(bounds=[(0, 0), (1, NAN)]), r"bounds = .*: expected the lowest corner first"),
        (lambda: survey().select(intensity=(2, 1)), r"intensity = \(2, 1\): expected the least and the greatest"),
    ],
)  # fmt: skip
def test_messages(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_select_is_what_a_plain_loop_finds() -> None:
    cloud = survey(3000, 4)
    places = cloud.positions
    low, high = np.quantile(places, 0.2, axis=0), np.quantile(places, 0.8, axis=0)
    low[0], high[1] = np.sort(places[:, 0])[500], np.sort(places[:, 1])[2500]
    chosen = cloud.select(
        bounds=[low, high], classification=["ground", 6, 9], returns=["first", "last"], intensity=(100, 60000)
    )
    expected = [
        k
        for k in range(len(cloud))
        if (low <= places[k]).all()
        and (places[k] <= high).all()
        and cloud.columns["classification"][k] in (2, 6, 9)
        and (cloud.columns["return_number"][k] in (1, cloud.columns["number_of_returns"][k]))
        and 100 <= cloud.columns["intensity"][k] <= 60000
    ]
    assert 0 < len(expected) < 3000
    np.testing.assert_array_equal(chosen.stored, cloud.stored[expected])
    for name, values in chosen.columns.items():
        np.testing.assert_array_equal(values, cloud.columns[name][expected])
        assert not values.flags.writeable
    assert (chosen.crs, chosen.scale.tolist()) == (cloud.crs, cloud.scale.tolist())


def test_select_of_single_returns_of_a_plane_and_of_nothing() -> None:
    cloud = survey()
    single = cloud.select(returns="single")
    assert (single.columns["number_of_returns"] == 1).all()
    assert 0 < len(single) < len(cloud)
    flat = cloud.select(bounds=[(-INF, cloud.bounds[0, 1]), (INF, cloud.bounds[0, 1])])
    assert len(flat) == 1
    assert cloud.select() is cloud
    nothing = cloud.select(classification=[])
    assert (len(nothing), repr(nothing)) == (0, f"PointCloud(0 points{''.join(f', {name}' for name in cloud.columns)})")
    assert cloud.select(classification=np.array([2, 6])).count == cloud.select(classification=("ground", "Building")).count
    assert sorted(CLASSES.values()) == list(range(19))


def test_take_of_slices_shares_memory_and_of_rows_copies() -> None:
    cloud = survey()
    part = cloud.take(slice(10, 20))
    assert np.shares_memory(part.stored, cloud.stored)
    np.testing.assert_array_equal(part.positions, cloud.positions[10:20])
    np.testing.assert_array_equal(cloud.take([-1, 3]).stored, cloud.stored[[-1, 3]])
    assert cloud.take(slice(0, 100, 7)).stored.flags.c_contiguous
    assert len(cloud.take([])) == 0


def test_a_cloud_is_a_geometry_like_others() -> None:
    cloud = survey()
    moved = np.eye(4)
    moved[:3, 3] = -cloud.offset
    scene = Scene([cloud, Instance(cloud, moved), ss.Mesh(SQUARE, [(0, 1, 2)])])
    assert scene.primitive_count == 2001
    assert scene.instances[0].has_colors
    np.testing.assert_array_equal(scene.instances[0].bounds, cloud.bounds)
    np.testing.assert_allclose(scene.instances[1].bounds, cloud.bounds - cloud.offset, atol=1e-6)
    assert len(scene.points) == 2003
    assert repr(scene.instances[1]).startswith("Instance('', PointCloud(1,000 points, color, intensity, ")
    copy = pickle.loads(pickle.dumps(cloud))
    np.testing.assert_array_equal(copy.positions, cloud.positions)


def test_beside_a_mesh_a_cloud_is_drawn_as_points() -> None:
    places = np.random.default_rng(5).random((200, 3)) * 2
    colors = np.random.default_rng(6).integers(0, 256, (200, 3))
    mesh = ss.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)])
    cloud = PointCloud(places, color=colors, size=3)
    frames = [ss.render(ss.Scene([mesh, shape]), size=(120, 90)) for shape in (cloud, ss.Points(places, colors, 3))]
    np.testing.assert_array_equal(frames[0].color, frames[1].color)
    np.testing.assert_array_equal(frames[0].primitive, frames[1].primitive)
    assert (frames[0].primitive >= 2).sum() > 500


def test_bounds_of_a_turned_cloud_are_those_of_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scanspan.assets.cloud.PART", 333)
    cloud, turned = survey(), np.eye(4)
    turned[:3, :3] = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
    world = ss.homogeneous.transform_points(turned, cloud.positions)[:, :3]
    np.testing.assert_array_equal(Instance(cloud, turned).bounds, [world.min(axis=0), world.max(axis=0)])
    assert np.isnan(Instance(PointCloud([]), turned).bounds).all()
