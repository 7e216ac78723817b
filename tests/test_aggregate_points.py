"""Points counted, added, averaged and compared in pixels: each once, in order, the same for any number of threads."""

from __future__ import annotations

import doctest
import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scanspan as ss
from scanspan.raster.points import place_points, sort_places
from scanspan.target import gather
from tests.plotting import REDUCTIONS, exact_pixels, reduced_image, same

SIZE = (13, 7)


@pytest.fixture
def small_parts() -> Iterator[None]:
    """Let even a few points make several blocks, and several parts for threads."""
    before = gather.BLOCK, gather.PART
    gather.BLOCK, gather.PART = 16, 40
    yield
    gather.BLOCK, gather.PART = before


def quarters(rng: np.random.Generator, count: int) -> Any:
    """Return points on a grid of quarters, many of them on the borders of pixels and of the image."""
    return rng.integers(-8, 4 * 16, (count, 2)) / 4


@pytest.mark.parametrize("bounds", [None, (0.0, 0.0, 13.0, 7.0), (-1.5, 0.25, 11.5, 7.25), (2.0, 1.0, 5.25, 2.75)])
@pytest.mark.parametrize("reduce", REDUCTIONS)
def test_points_are_where_rationals_put_them(reduce: str, bounds: Any, rng: np.random.Generator, small_parts: None) -> None:
    points, values = quarters(rng, 600), rng.normal(size=600)
    pixels = exact_pixels(points, SIZE, bounds)
    hits = [(*pixel, float(value)) for pixel, value in zip(pixels, values) if pixel is not None]
    expected = reduced_image(reduce, SIZE, hits)
    for threads in (1, 2, 5):
        found = ss.aggregate(points, SIZE, reduce=reduce, values=values, bounds=bounds, threads=threads)
        assert same(found, expected)
        assert found.dtype == (np.int32 if reduce == "count" else np.float64)
        assert found.shape == (7, 13)


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=4).filter(lambda b: b[0] < b[2] - 1e-6 and b[1] < b[3] - 1e-6),
    st.lists(st.tuples(st.floats(-2e3, 2e3), st.floats(-2e3, 2e3)), max_size=20),
)
def test_every_point_within_the_bounds_is_counted_once(bounds: list[float], points: Any) -> None:
    # The corners of the bounds, and the last numbers before them, are where a product may round over the border.
    x_low, y_low, x_high, y_high = bounds
    points = [*points, (x_low, y_low), (x_high, y_high), (np.nextafter(x_high, -np.inf), np.nextafter(y_high, -np.inf))]
    found = ss.aggregate(points, (97, 31), bounds=bounds, threads=1)
    assert found.sum() == sum(x_low <= x < x_high and y_low <= y < y_high for x, y in points)
    assert found[-1, 0] >= 1
    assert found[0, -1] >= 1


def test_counts_equal_those_of_numpy(rng: np.random.Generator) -> None:
    points = rng.normal(size=(20000, 2))
    found = ss.aggregate(points, (64, 32), bounds=(-2, -1, 2, 1))
    expected = np.histogram2d(points[:, 1], points[:, 0], (32, 64), ((-1, 1), (-2, 2)))[0]
    assert np.array_equal(found[::-1], expected)


def test_sums_have_the_bits_of_adding_one_after_the_other(rng: np.random.Generator, small_parts: None) -> None:
    points = rng.random((3000, 2)) * SIZE
    values = 10.0 ** rng.uniform(-8, 8, 3000) * rng.choice([-1, 1], 3000)
    expected = np.zeros((SIZE[1], SIZE[0]))
    np.add.at(expected, tuple(points.astype(int)[:, ::-1].T), values)
    for threads in (1, 2, 3, 8):
        assert np.array_equal(ss.aggregate(points, SIZE, reduce="sum", values=values, threads=threads), expected)

    # The order matters in the last bits, or this test could not fail.
    other = ss.aggregate(points[::-1], SIZE, reduce="sum", values=values[::-1])
    assert not np.array_equal(other, expected)


@pytest.mark.parametrize("dtype", ["float64", "float32", "float16", "int64", "uint8", "bool", ">f4", "longdouble"])
def test_any_type_and_layout_of_numbers_gives_the_same(dtype: str, rng: np.random.Generator) -> None:
    points = rng.integers(0, 2 if dtype == "bool" else 7, (200, 2)).astype(dtype)
    expected = ss.aggregate(points.astype(np.float64), SIZE)
    assert expected.sum() == 200
    for layout in (points, np.asfortranarray(points), np.repeat(points, 3, axis=0)[::3], points[::-1], points.tolist()):
        assert np.array_equal(ss.aggregate(layout, SIZE), expected)


def test_what_is_not_finite_is_left_out_where_that_is_asked_for() -> None:
    points = [(0, 0), (np.nan, 1), (1, np.inf), (-np.inf, np.nan), (2, 1), (2, 1)]
    values = [1, 2, 3, 4, np.nan, 6]
    assert ss.aggregate(points, (3, 2), nonfinite="drop").tolist() == [[1, 0, 0], [0, 0, 2]]
    assert ss.aggregate(points, (3, 2), values=values, nonfinite="drop").tolist() == [[1, 0, 0], [0, 0, 1]]
    assert np.nansum(ss.aggregate(points, (3, 2), reduce="sum", values=values, nonfinite="drop")) == 7


def test_points_may_lie_anywhere() -> None:
    points = [(1e308, -1e308), (-1e308, 1e308), (5e-324, 0.0), (1e20, 1), (0.5, 1 << 62)]
    assert ss.aggregate(points, (2, 2)).tolist() == [[1, 0], [0, 0]]
    assert ss.aggregate(points[2:], (2, 2), bounds="fit").sum() == 3


def test_nothing_and_one_point() -> None:
    for nothing in ([], np.empty((0, 2)), {"x": [], "y": []}):
        assert not ss.aggregate(nothing, (3, 2)).any()
        assert np.isnan(ss.aggregate(nothing, (3, 2), reduce="sum", values=[])).all()
        assert ss.aggregate(nothing, (3, 2), bounds="fit").sum() == 0
    assert ss.aggregate([(2, 1)], (3, 2)).tolist() == [[0, 0, 0], [0, 0, 1]]
    assert ss.aggregate([(0, 0)], (1, 1), reduce="min", values=[-0.5]).tolist() == [[-0.5]]


def test_fitting_bounds_hold_all_points(rng: np.random.Generator) -> None:
    points = rng.normal(size=(500, 2)) * [1e-9, 1e9] + [5, -3]
    for size in ((3, 2), (640, 480)):
        assert ss.aggregate(points, size, bounds="fit").sum() == 500
    lost = np.concatenate([points, [(np.nan, 0), (np.inf, 0)]])
    found = ss.aggregate(lost, (30, 20), bounds="fit", nonfinite="drop")
    assert np.array_equal(found, ss.aggregate(points, (30, 20), bounds="fit"))


@pytest.mark.parametrize("where", [(0, 0), (5.5, -3), (1e20, -1e-20), (1e300, 1e300)])
def test_points_that_are_all_one_fit_too(where: tuple[float, float]) -> None:
    # As spatialdata-plot 724, where an extent of zero became a division by it.
    found = ss.aggregate([where] * 4, (5, 5), bounds="fit")
    assert found.sum() == 4
    assert found[2, 2] == 4


def test_y_goes_up_with_bounds_and_down_without() -> None:
    assert ss.aggregate([(0.5, 0.5)], (1, 2)).tolist() == [[1], [0]]
    assert ss.aggregate([(0.5, 0.5)], (1, 2), bounds=(0, 0, 1, 2)).tolist() == [[0], [1]]


class Frame:
    """A table that is neither of pandas nor of xarray."""

    def __init__(self, **columns: Any) -> None:
        self.columns = list(columns)
        self.content = columns

    def __getitem__(self, name: str) -> Any:
        return np.array(self.content[name])


def test_columns_of_tables(rng: np.random.Generator) -> None:
    points, weights = rng.random((50, 2)) * SIZE, rng.random(50)
    expected = ss.aggregate(points, SIZE, reduce="max", values=weights)
    columns = {"lon": points[:, 0], "lat": points[:, 1], "w": weights}
    records = np.rec.fromarrays(list(columns.values()), names=list(columns))
    tables: list[Any] = [columns, Frame(**columns), records]
    if importlib.util.find_spec("pandas"):
        tables.append(importlib.import_module("pandas").DataFrame(columns))
    for table in tables:
        assert same(ss.aggregate(table, SIZE, x="lon", y="lat", values="w", reduce="max"), expected)
        assert same(ss.aggregate(table, SIZE, x="lon", y="lat", values=weights, reduce="max"), expected)
    assert np.array_equal(ss.aggregate({"x": points[:, 0], "y": points[:, 1]}, SIZE), ss.aggregate(points, SIZE))


def test_arrays_of_xarray_in_and_out(rng: np.random.Generator) -> None:
    xarray = pytest.importorskip("xarray")
    points, weights = rng.random((50, 2)) * 8, rng.random(50)
    table = xarray.Dataset({"w": ("n", weights)}, {"a": ("n", points[:, 0]), "b": ("n", points[:, 1])})
    plain = ss.aggregate(points, (4, 2), reduce="sum", values=weights, bounds=(0, 0, 8, 8))
    found = ss.aggregate(table, (4, 2), x="a", y="b", values="w", reduce="sum", bounds=(0, 0, 8, 8), as_xarray=True)
    assert isinstance(found, xarray.DataArray)
    assert same(found.to_numpy(), plain)
    assert found.dims == ("y", "x")
    assert found.x.to_numpy().tolist() == [1.0, 3.0, 5.0, 7.0]
    assert found.y.to_numpy().tolist() == [6.0, 2.0]
    assert found.attrs["bounds"] == (0, 0, 8, 8)
    assert found.name == "sum"
    assert same(found.sel(x=4.9, y=1.0, method="nearest"), plain[1, 2])

    # In pixels y goes down; a DataArray of points is an array of points.
    found = ss.aggregate(xarray.DataArray(points), (4, 2), as_xarray=True)
    assert found.y.to_numpy().tolist() == [0.5, 1.5]
    assert np.array_equal(found, ss.aggregate(points, (4, 2)))


def test_kernels_give_the_same_as_plain_python(rng: np.random.Generator) -> None:
    x, y = rng.normal(size=(2, 200)) * 3
    x[:3], y[:3] = (1.0, -1.0, 3.0), (2.0, -2.0, 0.0)
    for last in (0.5, np.nan, np.inf):
        x[-1] = last
        placed = []
        for place in (place_points, place_points.py_func):  # type: ignore[attr-defined]
            out = np.empty(200, np.int32)
            with np.errstate(invalid="ignore"):
                is_good = place(x, y, -1.0, 3.0, -2.0, 2.0, 2.5, 1.75, 10, 7, True, out)
            placed.append((bool(is_good), out.tolist()))
        assert placed[0] == placed[1]
        assert placed[0][0] == np.isfinite(last)
    for values in (rng.random(200), np.empty(0)):
        ordered = []
        for order in (sort_places, sort_places.py_func):  # type: ignore[attr-defined]
            starts, places, kept = np.empty(10, np.int64), np.empty(200, np.int32), np.empty_like(values)
            order(out, values, 3, starts, places, kept)
            ordered.append((starts.tolist(), places.tolist(), kept.tolist()))
        assert ordered[0] == ordered[1]
        assert ordered[0][1] == sorted(out.tolist(), key=lambda place: place >> 3)


def test_the_examples_in_the_documentation_run(repository: Path) -> None:
    failed, tried = doctest.testfile(
        str(repository / "docs" / "aggregation.md"), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE
    )
    assert tried > 10
    assert failed == 0
