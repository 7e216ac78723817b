"""A few triangles take a short way through one kernel: the same pixels, and the same errors, as by the long way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan import canvas as canvases
from scanspan.target.few import FEW, paint_few
from tests.painting import random_triangles

SIZE = (61, 47)
FORMS = ["name", "tuple", "floats", "codes", "opaque codes", "rows of three", "rows of four", "corners", "corners of four"]


@pytest.fixture
def ways(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that paints by both ways and says whether the short one was taken."""
    taken: list[bool] = []

    def short(*arguments: Any) -> bool:
        taken.append(paint_few(*arguments))
        return taken[-1]

    def paint(vertices: Any, colors: Any, size: tuple[int, int] = SIZE, threads: int = 1, **options: Any) -> bool:
        pictures, found = [], []
        for way in (short, lambda *_: False):
            monkeypatch.setattr(canvases, "paint_few", way)
            canvas = ss.Canvas(*size, (9, 8, 7, 200), threads=threads)
            try:
                canvas.triangles(vertices, colors, **options)
                found.append("")
            except ss.ScanspanError as error:
                found.append(str(error))
            pictures.append(canvas.pixels)
        assert np.array_equal(*pictures)
        assert found[0] == found[1]
        assert not found[0] or (pictures[0] == (9, 8, 7, 200)).all()
        was_taken = bool(taken) and taken[-1]
        taken.clear()
        return was_taken

    return paint


def colors_of(form: str, count: int, rng: np.random.Generator) -> Any:
    """Return colours as people give them."""
    codes = rng.integers(0, 256, (count, 3, 4), dtype=np.uint8)
    codes[..., 3] = 255
    return {
        "name": "tomato", "tuple": (200, 100, 0), "floats": (0.25, 1.0, 0.5),
        "codes": codes[0, 0, :3], "opaque codes": codes[0, 0],
        "rows of three": codes[:, 0, :3], "rows of four": codes[:, 0], "corners": codes[..., :3], "corners of four": codes,
    }[form]  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_both_ways_paint_the_same(ways: Any, form: str, rng: np.random.Generator) -> None:
    for count in (1, 2, 7, FEW):
        corners = random_triangles(rng, count, SIZE)
        for options in (
            {}, {"cull": "back"}, {"cull": "front", "rule": "bottom-left"}, {"subpixel_bits": 4}, {"rule": "inclusive"},
            {"algorithm": "homogeneous", "subpixel_bits": 12}, {"overlap": "over"},
        ):  # fmt: skip
            assert ways(corners, colors_of(form, count, rng), **options)
        # Sums over shades of large triangles do not fit 53 bits when sub-pixels are so fine.
        assert ways(corners, colors_of(form, count, rng), subpixel_bits=16) or "corners" in form
        assert ways(corners.astype(np.float32), colors_of(form, count, rng))
        assert ways(np.rint(corners).astype(np.int32), colors_of(form, count, rng))
        assert ways(corners.tolist(), colors_of(form, count, rng))
        assert ways(corners[::-1, ::-1], colors_of(form, count, rng))
        assert ways(corners + np.array([1000, 0]), colors_of(form, count, rng))
        assert ways(corners * (1, -3), colors_of(form, count, rng))


def test_what_is_out_of_the_ordinary_takes_the_long_way(ways: Any, rng: np.random.Generator) -> None:
    corners = random_triangles(rng, 3, SIZE)
    for colors in ((255, 0, 0, 90), [(1, 2, 3)] * 3, np.full((3, 4), 90, np.uint8), np.ones((3, 3, 4)), np.full((3, 4), 0.5)):
        assert not ways(corners, colors)
    translucent = colors_of("corners of four", 3, rng)
    translucent[2, 1, 3] = 254
    assert not ways(corners, translucent)
    assert not ways(corners, "red", algorithm="edge-walk")
    assert ways(corners, colors_of("corners", 3, rng), rule=ss.OffscreenPoint(-1, -1))
    assert ways(corners, "red", rule=ss.OffscreenPoint(-1, -1))
    assert not ways(random_triangles(rng, FEW + 1, SIZE), "red")
    assert not ways([], "red")
    assert not ways(np.where(corners > 60, np.nan, corners), "red", nonfinite="drop")

    # Large ones are left to threads, where there are any.
    large = [[(0, 0), (900, 0), (0, 900)]]
    assert not ways(large, "red", (900, 900), threads=2)
    assert not ways(large, [[(9, 9, 9)] * 3], (900, 900), threads=2)
    assert ways(large, "red", (900, 900))
    assert ways(corners, "red", (900, 900), threads=2)
    assert ways(corners, colors_of("corners", 3, rng), (900, 900), threads=2)


@pytest.mark.parametrize(
    ("vertices", "colors", "options"),
    [
        ([[(0, 0), (np.nan, 4), (4, 0)]], "red", {}),
        ([[(0, 0), (1e9, 4), (4, 0)]], (1, 2, 3), {}),
        ([[(0, 0), (4, 4), (4, np.inf)]], "no colour", {}),
        ([[(0, 0), (4, 4), (4, 0)]], "no colour", {}),
        ([[(0, 0), (4, 4), (4, 0)]], (1, 2, 300), {}),
        ([[(0, 0), (4, 4), (4, 0)]], np.zeros((2, 4), np.uint8), {}),
        ([[(0, 0), (4, 4), (4, 0)]], np.zeros((1, 2), np.uint8), {}),
        ([[(0, 0), (4, 4), (4, 0)]], np.zeros((1, 4, 3), np.uint8), {}),
        ([[(0, 0), (4, 4)]], "red", {}),
        ([[(0, 0), (4, 4), (4,)]], "red", {}),
        ([[(0, 0), (10**30, 4), (4, 0)]], "red", {}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"nonfinite": "keep"}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"antialias": 0}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"overlap": []}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"rule": ["top-left"]}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"cull": None}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"subpixel_bits": 8.0}),
        ([[(0, 0), (4, 4), (4, 0)]], "red", {"algorithm": "span-list"}),
    ],
)
def test_both_ways_say_the_same_of_what_is_wrong(ways: Any, vertices: Any, colors: Any, options: Any) -> None:
    ss.Canvas(*SIZE).triangles([[(0, 0), (4, 4), (4, 0)]], "red", subpixel_bits=8)
    canvas = ss.Canvas(*SIZE)
    with pytest.raises(ss.InputError):
        canvas.triangles(vertices, colors, **options)
    ways(vertices, colors, **options)


def test_numbers_that_are_equal_but_of_another_type_are_other_colours() -> None:
    found = []
    for color in ((1, 0, 1), (1.0, 0.0, 1.0), (1, 0, 1)):
        canvas = ss.Canvas(1, 1, color)
        canvas.points([(0.5, 0.5)], color)
        found.append(canvas.pixels[0, 0].tolist())
    assert found == [[1, 0, 1, 255], [255, 0, 255, 255], [1, 0, 1, 255]]


def test_a_colour_that_was_read_before_is_the_same_for_all_and_is_not_changed() -> None:
    canvas = ss.Canvas(2, 1, "red")
    canvas.pixels[0, 0] = 0
    canvas.lines([[(0, 0), (0, 0)]], "red")
    assert ss.Canvas(1, 1, "red").pixels[0, 0].tolist() == canvas.pixels[0, 0].tolist() == [255, 0, 0, 255]
