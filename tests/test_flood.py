"""Flood fill against scipy's labels, on shapes that are deep, thin, tiny and large, and what it costs, look by look."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage  # type: ignore[import-untyped]

import scanspan as ss
from scanspan.raster.flood import FILLED, flood, make_room

CONNECTIVITY = [4, 8]
NEIGHBOURS = {4: ndimage.generate_binary_structure(2, 1), 8: ndimage.generate_binary_structure(2, 2)}
INK, PAPER, PAINT = (0, 0, 0, 255), (255, 255, 255, 255), (200, 30, 40, 255)

Booleans = NDArray[np.bool_]


def canvas_of(walls: Any, blend: str = "linear") -> ss.Canvas:
    """Return a canvas with ink where there are walls."""
    return ss.Canvas.from_array(np.where(np.asarray(walls, bool)[..., None], INK, PAPER).astype(np.uint8), blend=blend)


def joined(alike: Booleans, x: int, y: int, connectivity: int) -> Booleans:
    """Return the pixels that are joined to a seed and alike: the oracle."""
    labels, _ = ndimage.label(alike, NEIGHBOURS[connectivity])
    found: Booleans = (labels == labels[y, x]) & alike
    return found


def is_painted(canvas: ss.Canvas) -> Booleans:
    """Return the pixels that have the paint."""
    painted: Booleans = (canvas.pixels == PAINT).all(axis=2)
    return painted


def parts(pattern: str) -> Booleans:
    """Return the walls of a drawing: # is a wall."""
    return np.array([[mark == "#" for mark in line] for line in pattern.split()])


def spiral(side: int) -> Booleans:
    """Return the walls of a way one pixel wide that winds to the middle."""
    walls = np.ones((side, side), bool)
    x = y = 1
    across, down = 1, 0
    walls[y, x] = False
    while True:
        # Go on while the place ahead is free and the one behind that is not a way yet; else turn to the right.
        for _ in range(2):
            ahead, further = (x + across, y + down), (x + 2 * across, y + 2 * down)
            inside = 0 < ahead[0] < side - 1 and 0 < ahead[1] < side - 1
            behind_is_wall = not (0 <= further[0] < side and 0 <= further[1] < side) or walls[further[1], further[0]]
            if inside and walls[ahead[1], ahead[0]] and behind_is_wall:
                break
            across, down = -down, across
        else:
            return walls
        x, y = ahead
        walls[y, x] = False


def comb(side: int) -> Booleans:
    """Return walls that leave teeth one pixel wide, joined in the last row."""
    walls = np.zeros((side, side), bool)
    walls[: side - 1, 1::2] = True
    return walls


def serpentine(side: int) -> Booleans:
    """Return walls with a gap at the right and at the left in turn."""
    walls = np.zeros((side, side), bool)
    walls[1::2] = True
    walls[1::4, -1] = walls[3::4, 0] = False
    return walls


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
def test_a_fill_is_the_label_of_its_seed(connectivity: int, rng: np.random.Generator) -> None:
    for n in range(120):
        height, width = (int(v) for v in rng.integers(1, 40, 2))
        walls = rng.random((height, width)) < (0.3, 0.45, 0.6)[n % 3]
        canvas = canvas_of(walls)
        x, y = int(rng.integers(width)), int(rng.integers(height))
        alike = walls == walls[y, x]
        expected = joined(alike, x, y, connectivity)
        counted = canvas.flood_fill(x, y, PAINT, connectivity=connectivity)
        assert np.array_equal(is_painted(canvas), expected)
        assert np.array_equal(canvas.pixels[~expected], canvas_of(walls).pixels[~expected])

        # A span is a run of pixels of a row, so there are as many as there are beginnings.
        starts = expected & ~np.pad(expected, ((0, 0), (1, 0)))[:, :-1]
        assert (counted["filled"], counted["spans"]) == (expected.sum(), starts.sum())


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
def test_a_tolerance_is_measured_from_the_seed(connectivity: int, rng: np.random.Generator) -> None:
    for tolerance in (0, 1, 10, 40, 255):
        for _ in range(10):
            pixels = rng.integers(100, 140, (15, 18, 4), dtype=np.uint8)
            pixels[..., 1:3] = 120
            canvas = ss.Canvas.from_array(pixels.copy())
            x, y = int(rng.integers(18)), int(rng.integers(15))
            alike = (np.abs(pixels.astype(int) - pixels[y, x]) <= tolerance).all(axis=2)
            canvas.flood_fill(x, y, PAINT, connectivity=connectivity, tolerance=tolerance)
            assert np.array_equal(is_painted(canvas), joined(alike, x, y, connectivity))


def test_a_slope_of_colours_ends_where_it_is_too_far_from_the_seed() -> None:
    # Measured from neighbour to neighbour the fill would go on to the end.
    canvas = ss.Canvas(50, 1)
    canvas.pixels[0, :, :3] = (np.arange(50) * 5)[:, None]
    assert canvas.flood_fill(10, 0, PAINT, tolerance=15)["filled"] == 7
    assert np.flatnonzero(is_painted(canvas)).tolist() == [7, 8, 9, 10, 11, 12, 13]


@pytest.mark.parametrize("channel", range(4))
def test_every_channel_counts_and_alpha_is_one(channel: int) -> None:
    canvas = ss.Canvas(5, 1, (100, 100, 100, 100))
    canvas.pixels[0, 3, channel] = 111
    assert canvas.flood_fill(0, 0, PAINT, tolerance=10)["filled"] == 3
    canvas = ss.Canvas(5, 1, (100, 100, 100, 100))
    canvas.pixels[0, 3, channel] = 110
    assert canvas.flood_fill(0, 0, PAINT, tolerance=10)["filled"] == 5


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
def test_a_border_bounds_whatever_lies_inside(connectivity: int, rng: np.random.Generator) -> None:
    for _ in range(40):
        walls = rng.random((20, 17)) < 0.4
        pixels = rng.integers(0, 200, (20, 17, 4), dtype=np.uint8)
        pixels[walls] = (250, 0, 250, 255)
        x, y = int(rng.integers(17)), int(rng.integers(20))
        canvas = ss.Canvas.from_array(pixels.copy())
        counted = canvas.flood_fill(x, y, PAINT, connectivity=connectivity, border=(250, 0, 250))
        expected = joined(~walls, x, y, connectivity)
        assert counted["filled"] == expected.sum()
        assert np.array_equal(canvas.pixels, np.where(expected[..., None], PAINT, pixels))


def test_a_border_has_a_tolerance_and_a_seed_on_it_fills_nothing() -> None:
    canvas = ss.Canvas(9, 1)
    canvas.pixels[0, 3] = (10, 0, 0, 255)
    assert canvas.flood_fill(0, 0, PAINT, border="black")["filled"] == 9
    canvas = ss.Canvas(9, 1)
    canvas.pixels[0, 3] = (10, 0, 0, 255)
    assert canvas.flood_fill(0, 0, PAINT, border="black", tolerance=10)["filled"] == 3
    before = canvas.pixels.copy()
    assert canvas.flood_fill(3, 0, PAINT, border="black", tolerance=10) == {"filled": 0, "looked_at": 1, "spans": 0}
    assert np.array_equal(canvas.pixels, before)


def test_diagonal_walls_hold_four_neighbours_and_not_eight() -> None:
    walls = parts(
        """
        ..#..
        .#.#.
        #...#
        .#.#.
        ..#..
        """
    )
    for connectivity, filled in ((4, 5), (8, 17)):
        canvas = canvas_of(walls)
        assert canvas.flood_fill(2, 2, PAINT, connectivity=connectivity)["filled"] == filled


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
@pytest.mark.parametrize("color", [PAPER, (255, 255, 255, 128)])
def test_a_fill_in_the_seeds_own_colour_ends(color: Any, connectivity: int) -> None:
    walls = comb(20)
    canvas = canvas_of(walls)
    assert canvas.flood_fill(0, 0, color, connectivity=connectivity)["filled"] == (~walls).sum()
    assert np.array_equal(canvas.pixels, canvas_of(walls).pixels)


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
@pytest.mark.parametrize("shape", [spiral, comb, serpentine])
def test_deep_shapes_are_filled_from_any_place(shape: Any, connectivity: int, rng: np.random.Generator) -> None:
    walls = shape(301)
    ways = np.argwhere(~walls)
    assert len(ways) > 30000
    for y, x in ways[[0, -1, int(rng.integers(len(ways)))]].tolist():
        canvas = canvas_of(walls)
        assert canvas.flood_fill(x, y, PAINT, connectivity=connectivity)["filled"] == len(ways)
        assert np.array_equal(is_painted(canvas), ~walls)


def test_a_large_maze_makes_the_stack_grow(rng: np.random.Generator) -> None:
    # At this density what is joined is as ragged as can be and reaches across.
    walls = rng.random((2000, 2000)) < 0.38
    alike = ~walls
    labels, _ = ndimage.label(alike, NEIGHBOURS[4])
    largest = int(np.argmax(np.bincount(labels[alike])))
    y, x = (int(v) for v in np.argwhere(labels == largest)[0])
    canvas = canvas_of(walls)
    counted = canvas.flood_fill(x, y, PAINT)
    assert np.array_equal(is_painted(canvas), labels == largest)
    assert counted["filled"] > 1_500_000
    assert counted["looked_at"] < 4 * 2000 * 2000


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
def test_images_of_one_pixel_row_or_column(connectivity: int) -> None:
    for width, height in ((1, 1), (7, 1), (1, 7), (2, 2)):
        canvas = ss.Canvas(width, height)
        counted = canvas.flood_fill(width - 1, height - 1, PAINT, connectivity=connectivity)
        assert counted["filled"] == width * height
        assert is_painted(canvas).all()
    assert ss.Canvas(1, 1).flood_fill(0, 0, PAINT) == {"filled": 1, "looked_at": 1, "spans": 1}


@pytest.mark.parametrize(("blend", "gray"), [("linear", 188), ("srgb", 128)])
@pytest.mark.parametrize("connectivity", CONNECTIVITY)
def test_a_translucent_fill_touches_each_pixel_once(blend: str, gray: int, connectivity: int, rng: np.random.Generator) -> None:
    walls = rng.random((40, 40)) < 0.4
    canvas = canvas_of(~walls, blend)
    y, x = (int(v) for v in np.argwhere(walls)[0])
    canvas = canvas_of(~walls, blend)
    canvas.flood_fill(x, y, (255, 0, 0, 128), connectivity=connectivity)
    expected = joined(walls, x, y, connectivity)
    ground = canvas_of(~walls).pixels
    once = ss.Canvas(1, 1, PAPER, blend=blend)
    once.points([(0.5, 0.5)], (255, 0, 0, 128))
    assert np.array_equal(canvas.pixels, np.where(expected[..., None], once.pixels, ground))

    # On black the colour itself says how often it was laid.
    canvas = ss.Canvas(5, 4, "black", blend=blend)
    canvas.flood_fill(2, 2, (1.0, 1.0, 1.0, 0.5), connectivity=connectivity)
    assert (canvas.pixels == (gray, gray, gray, 255)).all()


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((9, 0, "red"), {}, "x = 9: must be a whole number from 0 to 8"),
        ((-1, 0, "red"), {}, "x = -1: must be a whole number from 0 to 8"),
        ((0.5, 0, "red"), {}, "x = 0.5: must be a whole number from 0 to 8"),
        ((True, 0, "red"), {}, "x = True: must be a whole number from 0 to 8"),
        ((0, 7, "red"), {}, "y = 7: must be a whole number from 0 to 6"),
        ((0, None, "red"), {}, "y = None: must be a whole number from 0 to 6"),
        ((0, 0, "red"), {"connectivity": 6}, "connectivity = 6: must be 4 or 8"),
        ((0, 0, "red"), {"connectivity": "4"}, "connectivity = '4': must be 4 or 8"),
        ((0, 0, "red"), {"tolerance": 256}, "tolerance = 256: must be a whole number from 0 to 255"),
        ((0, 0, "red"), {"tolerance": 1.0}, "tolerance = 1.0: must be a whole number from 0 to 255"),
        ((0, 0, "rad"), {}, "'rad' is no colour; did you mean 'red'? expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
        ((0, 0, "red"), {"border": (1, 2)}, "(1, 2) is no colour: expected a CSS name, #rrggbb, rgb(...) or 3 or 4 numbers"),
        ((0, 0, (0, 0, 300)), {}, "colour = (0, 0, 300): expected integers between 0 and 255"),
    ],
)
def test_errors_quote_what_came(arguments: Any, options: Any, message: str) -> None:
    canvas = ss.Canvas(9, 7)
    with pytest.raises(ss.InputError) as caught:
        canvas.flood_fill(*arguments, **options)
    assert str(caught.value) == message
    assert (canvas.pixels == 255).all()


# What it costs


def looks_of_the_lecture(side: int) -> int:
    """Return how often the lectures' fill is called on an open square inside a border, with a stack in place of calls."""
    filled, stack, calls = np.zeros((side, side), bool), [(side // 2, side // 2)], 0
    while stack:
        calls += 1
        x, y = stack.pop()
        if 0 <= x < side and 0 <= y < side and not filled[y, x]:
            filled[y, x] = True
            stack += [(x + 1, y), (x, y + 1), (x, y - 1), (x - 1, y)]
    return calls


def test_the_lectures_fill_is_called_four_times_a_pixel_and_once_more() -> None:
    assert looks_of_the_lecture(10) == 401
    counted = ss.Canvas(10, 10).flood_fill(5, 5, PAINT)
    assert counted["filled"] == 100
    assert counted["looked_at"] <= 3 * 100


def look_by_look(walls: Booleans, x: int, y: int, reach: int) -> tuple[Booleans, NDArray[np.int64], int]:
    """Return what a span fill fills that asks pixel by pixel, how often it asks for each, and how many spans it has."""
    height, width = walls.shape
    filled, looks, spans, stack = np.zeros(walls.shape, bool), np.zeros(walls.shape, np.int64), 0, [(y, x, x)]

    def is_open(column: int, row: int) -> bool:
        looks[row, column] += 1
        return not (filled[row, column] or walls[row, column])

    while stack:
        row, i, last = stack.pop()
        while i <= last:
            if not is_open(i, row):
                i += 1
                continue
            start = end = i
            while start > 0 and is_open(start - 1, row):
                start -= 1
            while end + 1 < width and is_open(end + 1, row):
                end += 1
            filled[row, start : end + 1] = True
            spans, i = spans + 1, end + 1
            window = max(start - reach, 0), min(end + reach, width - 1)
            stack += [(other, *window) for other in (row - 1, row + 1) if 0 <= other < height]
    return filled, looks, spans


PLAIN = """
import json, sys
import numpy as np
from scanspan.raster.flood import flood_kernel
report = []
for walls, x, y, diagonal in json.load(sys.stdin):
    words, counters = np.asarray(walls, np.int32), np.zeros(3, np.int64)
    runs = flood_kernel(words, x, y, int(words[y, x]), 0, False, diagonal, counters)
    report.append([runs.tolist(), counters.tolist()])
print(json.dumps(report))
"""


def test_each_pixel_is_looked_at_four_times_at_most_and_every_look_is_counted(rng: np.random.Generator) -> None:
    fields = [rng.random((14, 16)) < density for density in (0.0, 0.2, 0.35, 0.5)]
    fields += [spiral(15), comb(15), serpentine(15), ~parts("... ### ..."), np.zeros((1, 1), bool), np.zeros((9, 1), bool)]
    seeds = [np.argwhere(~field)[0][::-1].tolist() for field in fields]
    case = [(field.tolist(), *seed, diagonal) for field, seed in zip(fields, seeds) for diagonal in (False, True)]
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", PLAIN],
        input=json.dumps(case),
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    for (walls, x, y, diagonal), (runs, counters) in zip(case, json.loads(run.stdout), strict=True):
        filled, looks, spans = look_by_look(np.array(walls), x, y, int(diagonal))
        assert np.array_equal(filled, joined(~np.array(walls), x, y, 8 if diagonal else 4))
        assert looks.max() <= (6 if diagonal else 4)
        assert looks[filled].max() <= (5 if diagonal else 3)

        # The kernel reckons the same from whole runs, as plain Python and compiled.
        found = np.zeros(filled.shape, bool)
        for first, row, last, _ in runs:
            assert not found[row, first : last + 1].any()
            found[row, first : last + 1] = True
        assert np.array_equal(found, filled)
        assert counters == [filled.sum(), looks.sum(), spans]
        canvas = canvas_of(walls)
        compiled = canvas.flood_fill(x, y, PAINT, connectivity=8 if diagonal else 4)
        assert list(compiled.values()) == counters


@pytest.mark.parametrize("connectivity", CONNECTIVITY)
@pytest.mark.parametrize("width", [7, 8, 9, 63, 64, 65])
def test_looks_are_counted_at_every_width(width: int, connectivity: int, rng: np.random.Generator) -> None:
    # A row is gone through eight pixels at a time.
    for density in (0.02, 0.1, 0.4):
        walls = rng.random((20, width)) < density
        x, y = (int(v) for v in np.argwhere(~walls)[0][::-1])
        filled, looks, spans = look_by_look(walls, x, y, int(connectivity == 8))
        canvas = canvas_of(walls)
        counted = canvas.flood_fill(x, y, PAINT, connectivity=connectivity)
        assert list(counted.values()) == [filled.sum(), looks.sum(), spans]
        assert np.array_equal(is_painted(canvas), filled)


def test_a_fill_reads_only_the_rows_that_it_reaches() -> None:
    words = np.zeros((30, 500), np.int32)
    words[10], words[20], words[15, 100:] = 1, 1, 1
    room = flood(words, make_room(30, 500), 3, 12, 0, 0, False, False)
    assert np.flatnonzero(room.rows[:, 0] >= 0).tolist() == list(range(10, 21))
    assert room.counts[FILLED] == 9
