"""Numbers as colours: the step that each gets on every scale, the same on every machine, and every message."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.shade.colormap import logarithm

RAMP = np.arange(256)
STEPS = np.stack([RAMP, RAMP, RAMP], axis=1).astype(np.uint8)


def steps(values: Any, count: int, **options: Any) -> list[Any]:
    """Return the step of each value, -1 for those that are empty."""
    found = ss.colorize(values, STEPS[:count], **options)
    return np.where(found[..., 3] == 0, -1, found[..., 0].astype(int)).tolist()


def test_a_linear_scale_has_steps_of_one_width() -> None:
    assert steps(np.arange(9.0), 4) == [0, 0, 1, 1, 2, 2, 3, 3, 3]
    assert steps([0.0, 1.0, 1.9999, 2.0, 3.0], 2, limits=(1, 3)) == [0, 0, 0, 1, 1]
    assert steps([-1e308, 0.0, 1e308], 3) == [0, 1, 2]
    assert steps([5.0, 5.0], 3) == [0, 0]


def test_a_logarithmic_scale_has_steps_of_one_ratio() -> None:
    assert steps([1.0, 9.99, 10.01, 99.0, 101.0, 1000.0], 3, scale="log") == [0, 0, 1, 1, 2, 2]
    assert steps([1, 3, 5, 100, 0], 2, scale="log") == [0, 0, 0, 1, -1]
    assert steps([-1.0, 0.0, 1.0, 4.0, 16.0], 2, scale="log") == [-1, -1, 0, 1, 1]
    assert steps([0.0, -1.0], 2, scale="log") == [-1, -1]
    assert steps([5e-324, 1.0, 1e308], 4, scale="log", limits=(1e-300, 1e300)) == [0, 2, 3]


def test_the_logarithm_is_right_to_the_last_bits(rng: np.random.Generator) -> None:
    numbers = np.concatenate([10.0 ** rng.uniform(-300, 300, 5000), 1 + rng.uniform(-0.4, 0.9, 5000), [5e-324, 1.0, 2.0, 0.5]])
    exact = np.array([math.log(number) for number in numbers])
    assert (np.abs(logarithm(numbers) - exact) <= 4e-16 * np.abs(exact)).all()
    assert logarithm(np.ones(1))[0] == 0.0
    ordered = np.sort(numbers)
    assert (np.diff(logarithm(ordered)) >= 0).all()


def test_an_equalized_scale_gives_each_step_as_many(rng: np.random.Generator) -> None:
    values = rng.normal(size=10000) ** 3
    found = steps(values, 8, scale="equalize")
    assert np.abs(np.bincount(found) - 1250).max() <= 1
    assert np.array_equal(np.array(found)[np.argsort(values)], np.sort(found))
    assert steps([7.0, 7.0], 8, scale="equalize") == [0, 0]
    assert steps([[np.nan]], 8, scale="equalize") == [[-1]]
    assert steps([1.0, 2.0, 3.0, 50.0], 2, scale="equalize", limits=(1, 3)) == [0, 1, 1, 1]


def test_an_equalized_scale_of_counts_is_that_of_datashader(rng: np.random.Generator) -> None:
    # Its share of a count is that of the counts not above it, stretched so that the least is 0 and the greatest 1.
    values = rng.poisson(3, (40, 50))
    shown = values[values > 0]
    found = np.array(steps(values, 64, scale="equalize"))
    for value in np.unique(shown):
        share, least = (shown <= value).mean(), (shown <= shown.min()).mean()
        exact = (share - least) / (1 - least) * 64
        expected = {min(int(exact - 1e-9), 63), min(int(exact + 1e-9), 63)}
        assert set(found[values == value]) <= expected
    assert (found[values == 0] == -1).all()


def test_nothing_is_empty_and_so_is_a_count_of_zero() -> None:
    assert steps([0.0, 1.0, np.nan], 2) == [0, 1, -1]
    assert steps([0, 1, 2], 2) == [-1, 0, 1]
    assert steps(np.array([0, 3], np.uint32), 2) == [-1, 0]
    assert steps([True, False], 2) == [0, -1]
    for nothing in (np.zeros((0, 3)), np.zeros((2, 0), int)):
        for scale in ("linear", "log", "equalize"):
            assert ss.colorize(nothing, "grey", scale=scale).shape == (*nothing.shape, 4)
    assert steps(np.full((2, 2), np.nan), 2) == [[-1, -1], [-1, -1]]


def test_colours_beyond_the_limits_and_of_nothing() -> None:
    values = [-np.inf, 0.0, 1.0, 2.0, 3.0, np.inf, np.nan]
    found = ss.colorize(values, STEPS[5:7], limits=(1, 2), below="red", above=(0, 255, 0), nan=(0.0, 0.0, 1.0, 0.5))
    red, green, blue, first, last = [255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 128], [5, 5, 5, 255], [6, 6, 6, 255]
    assert found.tolist() == [red, red, first, last, green, green, blue]
    found = ss.colorize(values, STEPS[5:7], limits=(1, 2))
    assert found.tolist() == [first, first, first, last, last, last, [0, 0, 0, 0]]
    assert steps([-np.inf, 1.0, 2.0, np.inf], 4) == [0, 0, 3, 3]


def test_grey_needs_no_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cmap", None)
    values = np.arange(256.0)
    assert ss.colorize(values, "grey")[:, :3].tolist() == np.stack([RAMP] * 3, axis=1).tolist()
    assert ss.colorize(values, "gray_r")[:, 0].tolist() == RAMP[::-1].tolist()
    assert (ss.colorize(values, "grey")[:, 3] == 255).all()
    with pytest.raises(ss.InputError) as caught:
        ss.colorize(values)
    assert str(caught.value) == (
        'cmap = \'viridis\': needs the package cmap: pip install "scanspan[plots]"; "grey" does without'
    )


def test_colormaps_have_their_names() -> None:
    cmap = pytest.importorskip("cmap")
    values = np.linspace(0.0, 1.0, 256)
    expected = np.rint(cmap.Colormap("viridis").lut(256) * 255)
    assert np.array_equal(ss.colorize(values), expected)
    assert np.array_equal(ss.colorize(values, "viridis_r"), expected[::-1])
    assert len(np.unique(ss.colorize(values, "tab10"), axis=0)) == 10
    for name, hint in (("viridos", "did you mean 'viridis'?"), ("", None)):
        with pytest.raises(ss.InputError) as caught:
            ss.colorize(values, name)
        hint = hint or 'expected the name of a colormap, "grey", or colours of shape (N, 3) or (N, 4)'
        assert str(caught.value) == f"cmap = {name!r}: the package cmap has no such colormap; {hint}"


def test_colours_may_be_given() -> None:
    given = [(255, 0, 0, 128), (0, 0, 255, 255)]
    assert ss.colorize([0.0, 1.0], given).tolist() == [list(color) for color in given]
    assert ss.colorize([0.0, 1.0], [(1.0, 0, 0), (0, 0.5, 0)]).tolist() == [[255, 0, 0, 255], [0, 128, 0, 255]]
    assert ss.colorize(7.0, given).tolist() == [255, 0, 0, 128]


COLORS = 'expected the name of a colormap, "grey", or colours of shape (N, 3) or (N, 4)'


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        ([1.0], {"scale": "eq"}, "unknown scale 'eq'; the valid ones are: linear, log, equalize"),
        ([1.0], {"scale": None}, "unknown scale None; the valid ones are: linear, log, equalize"),
        (["a"], {}, "values: expected an array of numbers, got dtype <U1, such as 'a'"),
        ([1.0], {"cmap": None}, f"cmap = None: {COLORS}"),
        ([1.0], {"cmap": [(1, 2)]}, f"cmap = [(1, 2)]: {COLORS}"),
        ([1.0], {"cmap": np.zeros((0, 3))}, f"cmap = array([], shape=(0, 3), dtype=float64): {COLORS}"),
        ([1.0], {"cmap": [(1, 2, 3), (1, 2)]}, f"cmap = [(1, 2, 3), (1, 2)]: {COLORS}"),
        ([1.0], {"cmap": [(0, 0, 0), (0, 0, 256)]},
         "colors[1] = (0, 0, 256): expected integers between 0 and 255"),
        ([1.0], {"limits": (2, 1)}, "limits = (2, 1): expected two finite numbers (low, high) with low <= high"),
        ([1.0], {"limits": 3}, "limits = 3: expected two finite numbers (low, high) with low <= high"),
        ([1.0], {"limits": (0, np.inf)}, "limits = (0, inf): expected two finite numbers (low, high) with low <= high"),
        ([1.0], {"limits": ((1, 2), (3,))},
         "limits = ((1, 2), (3,)): expected two finite numbers (low, high) with low <= high"),
        ([1.0], {"limits": (0, 1), "scale": "log"},
         "limits = (0, 1): expected two finite numbers (low, high) with 0 < low <= high"),
        ([1.0], {"nan": "witte"}, "'witte' is no colour; did you mean 'white'? "
         "expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
    ],
)  # fmt: skip
def test_what_has_no_colours(values: Any, options: Any, message: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.colorize(values, **{"cmap": "grey", **options})
    assert str(caught.value) == message
