"""What aggregate refuses: every message."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan import aggregates as face
from scanspan.errors import LimitError

POINTS = [(0, 0), (1, 1)]
SEGMENTS = [[(0, 0), (3, 2)]]
TRIANGLES = [[(0, 0), (3, 0), (0, 3)]]
DROP = 'nonfinite="drop" leaves it out'
BOUNDS = 'expected "fit" or four finite numbers (x_low, y_low, x_high, y_high) with low < high'


@pytest.mark.parametrize(
    ("geometry", "options", "message"),
    [
        (POINTS, {"reduce": "median"}, "unknown reduction 'median'; did you mean 'mean'? "
         "The valid ones are: count, sum, mean, min, max"),
        (POINTS, {"reduce": None}, "unknown reduction None; the valid ones are: count, sum, mean, min, max"),
        (POINTS, {"reduce": "sum"}, "reduce = 'sum': needs values, one for each of the points"),
        (TRIANGLES, {"reduce": "max"}, "reduce = 'max': needs values, one for each of the triangles"),
        (POINTS, {"line": "wu"}, "unknown line 'wu'; the valid ones are: diamond-exit, midpoint, dda, symmetric"),
        (POINTS, {"kind": "point"}, "unknown kind 'point'; did you mean 'points'? "
         "The valid ones are: points, lines, triangles"),
        (POINTS, {"kind": ["points"]}, "unknown kind ['points']; did you mean 'points'? "
         "The valid ones are: points, lines, triangles"),
        (POINTS, {"kind": "triangles"}, "kind = 'triangles': the geometry has rows of shape (2,), which are points"),
        (SEGMENTS, {"kind": "points"}, "kind = 'points': the geometry has rows of shape (2, 2), which are lines"),
        ([1, 2, 3], {}, "geometry: expected shape (N, 2), (N, 2, 2), (N, 3, 2), or a table, got (3,)"),
        (np.zeros((4, 3)), {}, "geometry: expected shape (N, 2), (N, 2, 2), (N, 3, 2), or a table, got (4, 3)"),
        (np.zeros((0, 3)), {}, "geometry: expected shape (N, 2), (N, 2, 2), (N, 3, 2), or a table, got (0, 3)"),
        ("points.csv", {}, "geometry: expected an array of numbers, got dtype <U10, such as 'points.csv'"),
        ([(0, 0), (1,)], {}, "geometry: expected an array of numbers, setting an array element with a sequence. The requested "
         "array has an inhomogeneous shape after 1 dimensions. The detected shape was (2,) + inhomogeneous part."),
        ({"lon": [1], "lat": [2]}, {}, "x = 'x': there is no such column, but 'lon', 'lat'"),
        ({"lon": [1], "lat": [2]}, {"x": "lon"}, "y = 'y': there is no such column, but 'lon', 'lat'"),
        ({"x": [1], "y": [2]}, {"values": "w"}, "values = 'w': there is no such column, but 'x', 'y'"),
        ({"x": [1], "y": [2, 3]}, {}, "x = 'x' has 1 numbers and y = 'y' has 2"),
        ({"x": ["a"], "y": [2]}, {}, "x = 'x': expected an array of numbers, got dtype <U1, such as 'a'"),
        (POINTS, {"values": [1, 2, 3]}, "values: expected shape (2,), as there are 2 points, got (3,)"),
        (POINTS, {"values": "w"}, "values: expected an array of numbers, got dtype <U1, such as 'w'"),
        (SEGMENTS, {"values": [[1, 2, 3]]}, "values: expected shape (1,), as there are 1 lines, got (1, 3)"),
        (TRIANGLES, {"values": [[1, 2]]}, "values: expected shape (1,) or (1, 3), as there are 1 triangles, got (1, 2)"),
        (POINTS, {"values": [1, np.nan]}, f"values[1] = nan: expected finite numbers within 1e+150; {DROP}"),
        (POINTS, {"values": [1, 2e150], "nonfinite": "drop"}, "values[1] = 2e+150: expected finite numbers within 1e+150"),
        (TRIANGLES, {"values": [(1, 2, np.inf)]},
         f"values[0] = [1.0, 2.0, inf]: expected finite numbers within 1e+150; {DROP}"),
        ([(0, 0), (np.nan, 1)], {}, f"geometry[1] = (nan, 1.0): expected finite numbers; {DROP}"),
        ([(0, -np.inf)], {"threads": 1}, f"geometry[0] = (0.0, -inf): expected finite numbers; {DROP}"),
        ([(0, 0), (np.inf, 1)], {"kind": "lines"},
         f"geometry[1] = [inf, 1.0]: expected finite numbers within 1.79769e+308; {DROP}"),
        ([[(0, 0), (1, np.nan)]], {},
         f"geometry[0] = [[0.0, 0.0], [1.0, nan]]: expected finite numbers within 1.79769e+308; {DROP}"),
        ([[(0, 0), (1e200, 1)]], {}, "geometry[0] = [[0.0, 0.0], [1e+200, 1.0]]: more than 1e+150 pixels away"),
        ([[(0, 0), (-1e308, 1), (1, 1)]], {"bounds": (0, 0, 1e-9, 1)},
         "geometry[0] = [[0.0, 0.0], [-1e+308, 1.0], [1.0, 1.0]]: more than 1e+150 pixels away"),
        (POINTS, {"nonfinite": "skip"}, "unknown value of nonfinite 'skip'; the valid ones are: error, drop"),
        (POINTS, {"bounds": "auto"}, f"bounds = 'auto': {BOUNDS}"),
        (POINTS, {"bounds": (0, 1, 2)}, f"bounds = (0, 1, 2): {BOUNDS}"),
        (POINTS, {"bounds": ((0, 1), (2,))}, f"bounds = ((0, 1), (2,)): {BOUNDS}"),
        (POINTS, {"bounds": (0, 0, 0, 1)}, f"bounds = (0, 0, 0, 1): {BOUNDS}"),
        (POINTS, {"bounds": (0, 2, 1, 1)}, f"bounds = (0, 2, 1, 1): {BOUNDS}"),
        (POINTS, {"bounds": (0, np.nan, 1, 1)}, f"bounds = (0, nan, 1, 1): {BOUNDS}"),
        (POINTS, {"bounds": (-1e308, 0, 1e308, 1)}, f"bounds = (-1e+308, 0, 1e+308, 1): {BOUNDS}"),
        (POINTS, {"bounds": (0, 0, 5e-324, 1)}, f"bounds = (0, 0, 5e-324, 1): {BOUNDS}"),
        ([(1e308, 0), (-1e308, 1)], {"bounds": "fit"},
         f"bounds = (-1e+308, 0.0, 1.0000000000000002e+308, 1.0000000000000002): {BOUNDS}"),
        (POINTS, {"subpixel_bits": 3}, "subpixel_bits = 3: must be a whole number from 4 to 16"),
        (POINTS, {"threads": 0}, "threads = 0: must be a whole number from 1 to 4096"),
        (POINTS, {"as_xarray": 1}, "as_xarray = 1: must be True or False"),
    ],
)  # fmt: skip
def test_what_cannot_be_aggregated(geometry: Any, options: Any, message: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.aggregate(geometry, (4, 3), **options)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((0, 3), "size = (0, 3): expected (width, height), two whole numbers above 0"),
        ((1 << 15, 1 << 14), "size = (32768, 16384): the limit is 268435456 pixels in all"),
    ],
)
def test_sizes_that_no_image_has(size: Any, message: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.aggregate(POINTS, size)
    assert str(caught.value) == message


def test_more_primitives_than_can_be_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(face, "MAX_COUNT", 1)
    with pytest.raises(LimitError) as caught:
        face.aggregate(POINTS, (4, 3))
    assert str(caught.value) == "geometry: 2 rows, at most 1 can be counted; add the results of several parts"


def test_without_xarray_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert ss.aggregate(POINTS, (2, 2)).tolist() == [[1, 0], [0, 1]]
    with pytest.raises(ss.InputError) as caught:
        ss.aggregate(POINTS, (2, 2), as_xarray=True)
    assert str(caught.value) == 'as_xarray = True: needs the package xarray: pip install "scanspan[plots]"'
