"""Strokes: the outlines against shapely, coverage against the area of polygons to the bit, and every degenerate line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

import scanspan as ss
from scanspan.assets.rings import FILL_RULES
from scanspan.geometry.chain import chain_rings
from scanspan.geometry.fixed_point import snap_points
from scanspan.geometry.stroke import Shapes, arcs, circle, point_shapes, segment_shapes
from scanspan.raster.area import make_areas
from scanspan.raster.area_pieces import make_sweep
from scanspan.raster.shares import Shares, add_shares

FAR = float(1 << 24)
CAPS = ["butt", "round", "square"]
JOINS = ["miter", "round", "bevel"]
Floats = NDArray[np.float64]


def covered(shapes: Shapes, size: tuple[int, int]) -> Floats:
    """Return how much shapes cover, added up, as float32 each."""
    total, xy = np.zeros(size[::-1]), snap_points(shapes.xy, 16)
    starts = shapes.ring_starts.astype(np.int32)
    for first, last in pairwise(shapes.shape_rings.tolist()):
        rings = starts[first : last + 1]
        points = np.ascontiguousarray(xy[rings[0] : rings[-1]])
        areas = make_areas(points, rings - rings[0], np.array([0, last - first], np.int32), size)
        cover = np.zeros(size[::-1])
        sweep = make_sweep(int(np.diff(areas.starts).max(initial=0)), size[0])
        target = Shares(cover, np.zeros(1), 0, size[0], 0)
        add_shares(target, 0, size[1], areas, FILL_RULES.index("non-zero"), sweep, np.zeros(1, np.int64))
        total += np.minimum(np.maximum(cover, 0.0), 1.0).astype(np.float32)
    return total


def area_of(rings: Any, size: tuple[int, int]) -> Floats:
    """Return the area of polygons as the writer gets it."""
    cover = ss.coverage(rings, size, mode="area", fill_rule="non-zero")
    return np.minimum(np.maximum(cover, 0.0), 1.0).astype(np.float32).astype(np.float64)


# Batches


@pytest.mark.parametrize("cap", CAPS)
@pytest.mark.parametrize("width", [0.01, 0.7, 1.0, 3.3, 20.0, 1000.0])
def test_batches_cover_what_the_polygon_covers_to_the_bit(cap: str, width: float, rng: np.random.Generator) -> None:
    size = (31, 23)
    for k in range(24):
        reach = (10, 40, 2e4, FAR)[k % 4]
        ends = rng.uniform(-reach, reach, (1, 2, 2)) + (k % 3 == 0) * np.array([15.0, 11.0])
        if k % 4 == 3:
            ends[0, 1] = -ends[0, 0] * rng.uniform(0.1, 0.9)
        if k % 5 == 0:
            ends[0, 1, k % 2] = ends[0, 0, k % 2]
        ends = np.clip(ends, -FAR, FAR)
        shapes = segment_shapes(ends, width, cap)
        assert np.array_equal(covered(shapes, size), area_of(shapes.xy, size)), (ends, width)


@pytest.mark.parametrize("shape", ["square", "disc"])
@pytest.mark.parametrize("size", [0.05, 1.0, 2.5, 9.0, 60.0])
def test_points_cover_what_the_polygon_covers_to_the_bit(shape: str, size: float, rng: np.random.Generator) -> None:
    for centre in rng.uniform(-5, 35, (12, 1, 2)):
        shapes = point_shapes(centre, size, shape)
        assert np.array_equal(covered(shapes, (30, 28)), area_of(shapes.xy, (30, 28)))


def test_a_wrong_edge_is_noticed() -> None:
    shapes = segment_shapes(np.array([[(3.0, 4.0), (20.0, 17.0)]]), 2.0, "butt")
    moved = shapes._replace(xy=shapes.xy + np.array([[0, 0], [0, 0], [0, 0], [2.0**-15, 0]]))
    assert not np.array_equal(covered(moved, (30, 30)), area_of(shapes.xy, (30, 30)))


def test_only_what_is_touched_is_looked_at() -> None:
    # A million pixels lie in the box of this line, a few thousand are touched; 3,000 such lines would take minutes.
    ends = np.tile(np.array([[(0.0, 0.0), (1024.0, 1000.0)]]), (3000, 1, 1))
    canvas = ss.Canvas(1024, 1000, "black")
    canvas.lines(ends, "white", antialias=True)
    assert (canvas.pixels[..., 0] > 0).sum() < 4000


def test_segments_lie_over_each_other_in_order(rng: np.random.Generator) -> None:
    ends, colors = rng.uniform(0, 40, (30, 2, 2)), rng.integers(0, 256, (30, 4), dtype=np.uint8)
    together, single = ss.Canvas(40, 40), ss.Canvas(40, 40)
    together.lines(ends, colors, antialias=True, width=5, cap="round")
    for end, color in zip(ends, colors, strict=True):
        single.lines(end[None], color, antialias=True, width=5, cap="round")
    assert np.array_equal(together.pixels, single.pixels)


@pytest.mark.parametrize("options", [{"antialias": True}, {"antialias": True, "dash": (5, 3)}, {"width": 3}])
def test_threads_change_no_pixel(options: Any, rng: np.random.Generator) -> None:
    ends, colors = rng.uniform(-20, 120, (5000, 2, 2)), rng.integers(0, 256, (5000, 4), dtype=np.uint8)
    pictures = []
    for threads in (1, 3):
        canvas = ss.Canvas(101, 97, "black", threads=threads)
        canvas.lines(ends, colors, **options)
        canvas.polyline(ends[:20, 0], "red", **options)
        pictures.append(canvas.pixels)
    assert np.array_equal(pictures[0], pictures[1])


def test_a_crop_of_a_stroke_is_the_stroke_of_a_crop(rng: np.random.Generator) -> None:
    ends = rng.uniform(-60, 160, (40, 2, 2))
    ends[:10] = rng.uniform(-1e6, 1e6, (10, 2, 2))
    ends[5:10] = ends[5:10, :1] * [[[1], [-1]]] + 50
    whole = ss.Canvas(100, 90)
    whole.lines(ends, "black", antialias=True, width=2.5)
    whole.polyline(ends[10:16, 0], "blue", antialias=True, width=7)
    for x, y, w, h in ((0, 0, 30, 20), (37, 41, 25, 30), (99, 0, 1, 90)):
        part = ss.Canvas(w, h)
        part.lines(ends - [x, y], "black", antialias=True, width=2.5)
        part.polyline(ends[10:16, 0] - [x, y], "blue", antialias=True, width=7)
        assert np.array_equal(part.pixels, whole.pixels[y : y + h, x : x + w])


def test_without_antialiasing_centres_decide(rng: np.random.Generator) -> None:
    for end in rng.uniform(-5, 45, (25, 1, 2, 2)):
        canvas, polygon = ss.Canvas(40, 40), ss.Canvas(40, 40)
        canvas.lines(end, (200, 30, 30, 128), width=6.5, cap="round")
        polygon.polygon(segment_shapes(end, 6.5, "round").xy, (200, 30, 30, 128))
        assert np.array_equal(canvas.pixels, polygon.pixels)


# Outlines


ZIGZAG = np.array([(10, 50), (30, 15), (52, 48), (80, 44), (70, 20)], float)


@pytest.mark.parametrize("cap", CAPS)
@pytest.mark.parametrize("join", JOINS)
@pytest.mark.parametrize("width", [1.0, 9.0, 14.0])
def test_outlines_are_those_of_shapely(cap: str, join: str, width: float) -> None:
    rings = chain_rings(ZIGZAG, width=width, closed=False, cap=cap, join=join, miter_limit=10.0)
    ours = ss.coverage(rings, (100, 70), mode="area", fill_rule="non-zero")
    styles = {"butt": "flat", "miter": "mitre"}
    line = shapely.LineString(ZIGZAG)
    buffer = line.buffer(
        width / 2, cap_style=styles.get(cap, cap), join_style=styles.get(join, join), mitre_limit=10.0, quad_segs=200
    )
    theirs = ss.coverage([np.array(buffer.exterior.coords)], (100, 70), mode="area", fill_rule="non-zero")
    assert np.abs(ours - theirs).max() < (0.03 if "round" in (cap, join) else 1e-4)


@pytest.mark.parametrize("join", JOINS)
def test_closed_outlines_are_those_of_shapely(join: str) -> None:
    ring = np.array([(10, 50), (30, 15), (60, 20), (75, 60)], float)
    rings = chain_rings(ring, width=6.0, closed=True, cap="butt", join=join, miter_limit=10.0)
    ours = ss.coverage(rings, (100, 70), mode="area", fill_rule="non-zero")
    style = {"miter": "mitre"}.get(join, join)
    shape = shapely.LinearRing(ring).buffer(3.0, join_style=style, mitre_limit=10.0, quad_segs=200)
    theirs = ss.coverage(
        [np.array(shape.exterior.coords), *[np.array(hole.coords) for hole in shape.interiors]], (100, 70), mode="area"
    )
    assert np.abs(ours - theirs).max() < (0.03 if join == "round" else 1e-4)


@pytest.mark.parametrize(("limit", "tip"), [(4.0, False), (5.2, True)])
def test_a_miter_that_is_too_long_is_cut(limit: float, tip: bool) -> None:
    # Half the angle between the two has the sine 1 / 5.099, so the miter is 5.099 widths long.
    rings = chain_rings(np.array([(0, 0), (50, 10), (0, 20)], float), width=4.0, closed=False, cap="butt", join="miter",
                        miter_limit=limit)  # fmt: skip
    farthest = rings[0][:, 0].max()
    assert farthest == pytest.approx(50 + (2 * 26**0.5 if tip else 2 / 26**0.5))


def test_round_parts_are_as_near_as_promised() -> None:
    for radius in (0.01, 0.5, 2.0, 17.0, 500.0, 1e5):
        for turn in (0.1, 1.0, 2.0, 3.1):
            first, last = np.array([1.0, 0.0]), np.array([np.cos(turn), np.sin(turn)])
            middle = np.array([np.cos(turn / 2), np.sin(turn / 2)])
            points, _, _ = arcs(np.zeros((1, 2)), np.stack([first, middle, last])[None], radius)
            chords = (points[:-1] + points[1:]) / 2
            assert radius - np.hypot(*chords.T).min() <= 1 / 50
            assert np.abs(np.hypot(*points.T) - radius).max() < 1e-9 * max(radius, 1.0)
            assert np.allclose(points[[0, -1]], radius * np.stack([first, last]))
        rim = circle(radius) * radius
        assert radius - np.hypot(*((rim + np.roll(rim, -1, axis=0)) / 2).T).min() <= 1 / 50


def test_what_a_line_covers_twice_is_painted_once() -> None:
    canvas = ss.Canvas(60, 60, "black", blend="srgb")
    canvas.polyline([(5, 5), (55, 55), (55, 5), (5, 55)], (1.0, 1.0, 1.0, 0.5), antialias=True, width=8)
    assert canvas.pixels[30, 30, 0] == canvas.pixels[20, 20, 0] == canvas.pixels[30, 55, 0] == 128
    assert canvas.pixels[..., 0].max() == 128


def test_a_noisy_curve_takes_no_time() -> None:
    # Thousands of pieces stand side by side in each row; compared with each other they would take minutes.
    curve = np.stack([np.linspace(10, 390, 4000), 100 + 40 * np.random.default_rng(3).normal(size=4000)], axis=1)
    canvas = ss.Canvas(400, 200, "black", blend="srgb")
    canvas.polyline(curve, "white", antialias=True)
    assert (canvas.pixels[60:140, :, 0] > 200).mean() > 0.5


# Lines that are hardly any


def total(*arguments: Any, name: str = "polyline", size: tuple[int, int] = (40, 40), **options: Any) -> float:
    """Return the area that something paints, white on black, right to half a code a pixel."""
    canvas = ss.Canvas(*size, "black", blend="srgb")
    getattr(canvas, name)(*arguments, "white", antialias=True, **options)
    return float(canvas.pixels[..., 0].sum() / 255)


@pytest.mark.parametrize("points", [[(20, 20)], [(20, 20)] * 3, [(20, 20), (20 + 1e-19, 20)]])
@pytest.mark.parametrize("closed", [False, True])
def test_a_line_of_no_length_is_nothing_a_disc_or_a_square(points: Any, closed: bool) -> None:
    assert total(points, width=10, closed=closed) == 0
    assert total(points, width=10, closed=closed, cap="square") == 100
    assert total(points, width=10, closed=closed, cap="round") == pytest.approx(25 * np.pi, abs=0.8)
    two = [[points[0], points[-1]]]
    assert total(two, name="lines", width=10) == 0
    assert total(two, name="lines", width=10, cap="square") == 100
    assert total(two, name="lines", width=10, cap="round") == pytest.approx(25 * np.pi, abs=0.8)


@pytest.mark.parametrize("join", JOINS)
def test_repeated_points_change_nothing(join: str) -> None:
    once, twice = ss.Canvas(100, 70), ss.Canvas(100, 70)
    once.polyline(ZIGZAG, "black", antialias=True, width=7, join=join)
    twice.polyline(np.repeat(ZIGZAG, 3, axis=0), "black", antialias=True, width=7, join=join)
    assert np.array_equal(once.pixels, twice.pixels)


def test_a_line_that_turns_back_has_a_flat_or_a_round_end() -> None:
    there_and_back = [(10, 20), (30, 20), (10, 20)]
    assert total(there_and_back, width=6) == total(there_and_back, width=6, join="bevel") == 120
    assert total(there_and_back, width=6, join="round") == pytest.approx(120 + 4.5 * np.pi, abs=0.5)
    assert total([(10, 20), (30, 20)], width=6, closed=True) == 120
    assert total([(10, 20), (30, 20)], width=6, closed=True, join="round") == pytest.approx(120 + 9 * np.pi, abs=0.8)


def test_nothing_paints_nothing() -> None:
    for cap in CAPS:
        assert total(np.empty((0, 2)), width=3, cap=cap) == 0
        assert total(np.empty((0, 2, 2)), name="lines", width=3, cap=cap, dash=(1, 2)) == 0
    assert total(np.empty((0, 2)), name="points") == 0


@pytest.mark.parametrize("width", [0.01, 1.0, 1000.0])
@pytest.mark.parametrize("antialias", [False, True])
def test_lines_across_all_that_is_allowed(width: float, antialias: bool) -> None:
    canvas = ss.Canvas(8, 8, "black", blend="srgb")
    for cap in CAPS:
        canvas.lines(
            [[(-FAR, -FAR), (FAR, FAR)], [(-FAR, FAR), (FAR, -FAR)]], "white", antialias=antialias, width=width, cap=cap
        )
        canvas.polyline([(-FAR, 4), (FAR, 4), (FAR, -FAR)], "white", antialias=antialias, width=width, cap=cap, join="round")
    assert (canvas.pixels[1, 5, 0], canvas.pixels[3, 3, 0] > 0) == (255 if width > 1 else 0, True)
    canvas.points([(FAR, FAR), (-FAR, 3)], "red", size=1 << 18, antialias=antialias)


@pytest.mark.parametrize("width", [0.01, 0.3, 1.0, 7.5])
def test_the_area_is_length_times_width(width: float) -> None:
    ends = np.array([[(3.2, 4.1), (33.7, 28.9)]])
    length = float(np.hypot(*(ends[0, 1] - ends[0, 0])))
    assert covered(segment_shapes(ends, width, "butt"), (40, 40)).sum() == pytest.approx(length * width, rel=2e-3)


def test_points_have_the_area_of_squares_and_discs() -> None:
    assert total([(20.3, 19.8)], name="points", size=(40, 40)) == pytest.approx(1.0, abs=0.01)
    discs = ss.Canvas(40, 40, "black", blend="srgb")
    discs.points([(12.4, 20.1), (29.7, 18.2)], "white", size=12.5, shape="disc", antialias=True)
    assert discs.pixels[..., 0].sum() / 255 == pytest.approx(2 * np.pi * 6.25**2, abs=1.0)


# Dashes


@pytest.mark.parametrize(
    ("dash", "offset", "spans"),
    [
        ((4, 2), 0, [(0, 4), (6, 10), (12, 16), (18, 20)]),
        ((4, 2), 1, [(0, 3), (5, 9), (11, 15), (17, 20)]),
        ((4, 2), -1, [(1, 5), (7, 11), (13, 17), (19, 20)]),
        ((4, 2), 5, [(1, 5), (7, 11), (13, 17), (19, 20)]),
        ((3,), 0, [(0, 3), (6, 9), (12, 15), (18, 20)]),
        ((1, 2, 3), 0, [(0, 1), (3, 6), (7, 9), (12, 13), (15, 18), (19, 20)]),
        ((0, 0), 0, [(0, 20)]),
        ((100, 1), 0, [(0, 20)]),
        ((1, 100), 50, []),
    ],
)
@pytest.mark.parametrize("name", ["lines", "polyline"])
def test_dashes_lie_where_svg_has_them(dash: Any, offset: float, spans: Any, name: str) -> None:
    canvas = ss.Canvas(30, 4, "black")
    chain = [(5, 2), (25, 2)] if name == "lines" else [(5, 2), (11, 2), (25, 2)]
    getattr(canvas, name)(
        [chain] if name == "lines" else chain, "white", antialias=True, width=2, dash=dash, dash_offset=offset
    )
    expected = np.zeros(30, bool)
    for start, stop in spans:
        expected[5 + start : 5 + stop] = True
    assert np.array_equal(canvas.pixels[1, :, 0] == 255, expected)
    assert set(np.unique(canvas.pixels[..., 0])) <= {0, 255}


def test_dashes_of_no_length_are_dots() -> None:
    dots = total([[(10, 20), (30, 20)]], name="lines", width=4, cap="round", dash=(0, 10), size=(60, 40))
    assert dots == pytest.approx(2 * 4 * np.pi, abs=1)
    tilted = [(10, 10), (30, 30)]
    assert total(tilted, width=4, cap="square", dash=(0, 10)) == pytest.approx(3 * 16, abs=0.5)
    assert total(tilted, width=4, dash=(0, 10)) == 0


def test_a_dash_goes_round_a_corner() -> None:
    assert total([(10, 10), (20, 10), (20, 20)], width=2, dash=(14, 1, 1, 50)) == 14 * 2 + 2
    assert total([(10, 10), (20, 10), (20, 20)], width=2, dash=(9, 2)) == 18 + 18


def test_caps_of_dashes_that_meet_are_painted_once() -> None:
    canvas = ss.Canvas(40, 12, "black", blend="srgb")
    canvas.lines([[(4, 6), (36, 6)]], (1.0, 1.0, 1.0, 0.5), antialias=True, width=6, cap="round", dash=(2, 3))
    assert canvas.pixels[..., 0].max() == 128
    assert canvas.pixels[6, :, 0][5:34].min() == 128


# The same bits without a compiler, and what is refused

SCENE = """
import json
import numpy as np
import scanspan as ss
canvas = ss.Canvas(23, 17, threads=1)
segments = [[(1.3, 2.2), (20.7, 11.9)], [(-1e7, 3), (1e7, 9)], [(5, 5), (5, 5)]]
canvas.lines(segments, (200, 0, 0, 90), antialias=True, width=1.7, cap="round")
canvas.lines([[(1, 15), (22, 3)]], "navy", algorithm="wu")
canvas.polyline([(2, 14), (9, 3), (14, 13), (30, 2)], "teal", antialias=True, width=2.5, join="round", dash=(6, 2))
canvas.points([(7.3, 8.1), (0.2, 16.9)], "orange", size=3.3, shape="disc", antialias=True)
print(json.dumps(canvas.pixels.tolist()))
"""


def test_plain_python_paints_what_the_compiled_kernels_paint() -> None:
    pictures = []
    for environment in ({}, {"NUMBA_DISABLE_JIT": "1"}):
        run = subprocess.run(
            [sys.executable, "-W", "error", "-c", SCENE], env={**os.environ, **environment}, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr[-2000:]
        pictures.append(json.loads(run.stdout))
    assert pictures[0] == pictures[1]


EXTENT = "must be a number of pixels above 0 and at most 262144"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"width": 0}, f"width = 0: {EXTENT}"),
        ({"width": np.nan}, f"width = nan: {EXTENT}"),
        ({"width": 1 << 19}, f"width = 524288: {EXTENT}"),
        ({"cap": "flat"}, "unknown cap 'flat'; the valid ones are: butt, round, square"),
        ({"join": "mitre"}, "unknown join 'mitre'; did you mean 'miter'? The valid ones are: miter, round, bevel"),
        ({"miter_limit": 0.5}, "miter_limit = 0.5: must be a number from 1.0 to 262144.0"),
        ({"miter_limit": 1e3, "width": 600}, "miter_limit = 1000.0: with width = 600 a miter may be longer than 262144 pixels"),
        ({"dash": (1, -2)}, "dash = (1, -2): must be lengths (on, off, ...) from 0 to 262144 pixels, or None"),
        ({"dash": 3}, "dash = 3: must be lengths (on, off, ...) from 0 to 262144 pixels, or None"),
        ({"dash": ()}, "dash = (): must be lengths (on, off, ...) from 0 to 262144 pixels, or None"),
        ({"dash": [(1, 2), 3]}, "dash = [(1, 2), 3]: must be lengths (on, off, ...) from 0 to 262144 pixels, or None"),
        ({"dash_offset": np.inf}, "dash_offset = inf: must be a number from -16777216.0 to 16777216.0"),
        ({"antialias": 1}, "antialias = 1: must be True or False"),
        ({"dash": (1e-6,)}, "dash: 1000000 dashes: the limit is 4194304 in all"),
    ],
)  # fmt: skip
def test_strokes_that_cannot_be_are_told(options: Any, message: str) -> None:
    canvas = ss.Canvas(8, 8)
    with pytest.raises(ss.InputError) as caught:
        canvas.polyline([(0, 0), (20, 0)] if "dash" in options else [(0, 0), (2, 0)], "red", **options)
    assert str(caught.value) == message or message.endswith("in all")
    if "join" not in options and "miter_limit" not in options:
        with pytest.raises(ss.InputError):
            canvas.lines([[(0, 0), (20, 0)]], "red", **options)
    assert (canvas.pixels == 255).all()


def test_wu_has_one_width() -> None:
    for options in ({"antialias": True}, {"width": 2}, {"cap": "round"}, {"dash": (1, 2)}):
        with pytest.raises(ss.InputError, match="algorithm = 'wu': its lines are as they are; leave out antialias, width"):
            ss.Canvas(4, 4).lines([[(0, 0), (3, 2)]], "red", algorithm="wu", **options)


# Faults of others that must not be here


@pytest.mark.parametrize("width", [1, 2, 3, 4, 5, 8])
@pytest.mark.parametrize("antialias", [False, True])
def test_pillow_7104_a_line_is_as_wide_as_it_was_asked_for(width: int, antialias: bool) -> None:
    # Pillow paints one pixel more or less, by the direction.
    for chain in ([(5, 12), (25, 12)], [(25, 12), (5, 12)], [(12, 5), (12, 25)], [(12, 25), (12, 5)]):
        canvas = ss.Canvas(30, 30, "black", blend="srgb")
        canvas.lines([chain], "white", width=width, antialias=antialias, cap="square" if width == 1 else "butt")
        along = canvas.pixels[..., 0].sum(axis=0 if chain[0][1] == 12 else 1) / 255
        assert along[8:22] == pytest.approx(width, abs=0.005)


def test_pillow_5577_lines_are_antialiased_without_drawing_them_larger() -> None:
    assert total([(2.0, 3.25), (30.0, 3.25)], width=0.5) == pytest.approx(14.0, abs=0.1)
