"""Subdivision: Warnock's windows and micropolygons paint what half-space paints, bit for bit, and decide as they say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.clip import to_screen
from scanspan.geometry.project import screen_triangles
from scanspan.raster import half_space, micropolygon, warnock
from scanspan.raster.counters import COUNTERS
from scanspan.raster.options import make_sampling
from scanspan.raster.setup import depth_at, set_up_triangle
from scanspan.raster.write import EMPTY_KEY

MODULES = {"half_space": half_space, "warnock": warnock, "micropolygon": micropolygon}
NAMES = ["warnock", "micropolygon"]
KINDS = ["keys", "pairs", "hits"]
RULES = ["top-left", "bottom-left", "inclusive", "exclusive", ss.OffscreenPoint(20.5, 15.5), ss.OffscreenPoint(1, 0, 0)]
SIZE = (70, 50)


def blank(kind, size):
    """An empty target."""
    if kind == "pairs":
        pairs = np.empty((size[1], size[0], 2))
        pairs[...] = (-np.inf, -1.0)
        return pairs
    return np.full((size[1], size[0]), EMPTY_KEY) if kind == "keys" else np.zeros((size[1], size[0]), np.int32)


def draw(name, kind, triangles, size=SIZE, rectangle=None, target=None, offset=None, **options):
    """Scan-convert triangles with one algorithm into a target of one kind, within (x_start, x_end, y_start, y_end)."""
    options = {"rule": "top-left", "cull": "none", "subpixel_bits": 8, **options}
    middle = 1 << options["subpixel_bits"] - 1
    sampling = make_sampling(size, (middle, middle) if offset is None else offset, **options)
    if rectangle is not None:
        sampling = sampling._replace(**dict(zip(("x_start", "x_end", "y_start", "y_end"), rectangle)))
    target = blank(kind, size) if target is None else target
    counters = np.zeros(COUNTERS, np.int64)
    getattr(MODULES[name], f"{name}_{kind}")(target, counters, triangles, 0, len(triangles.corners), sampling)
    return target


def on_screen(vertices, depth, bits=8):
    """Triangles on the screen with a depth for each corner."""
    triangles = screen_triangles(np.asarray(vertices, float).reshape(-1, 3, 2), bits)
    return triangles._replace(depth=np.broadcast_to(np.asarray(depth, float), (len(vertices), 3)).ravel().copy())


def clipped_soup(rng, bits):
    """Triangles through and behind the eye."""
    clip = rng.normal(size=(240, 4))
    return to_screen(clip, np.arange(240, dtype=np.int32).reshape(-1, 3), SIZE, bits)


def layers(rng, bits):
    """Large triangles in many layers, so that most are hidden, and some that cross."""
    vertices = np.array([(-90, -20), (80, -90), (60, 150)]) + rng.normal(size=(60, 3, 2)) * 20
    depth = np.repeat(rng.uniform(0, 1, (60, 1)), 3, axis=1)
    depth[::5] += rng.uniform(-0.3, 0.3, (12, 3))
    return on_screen(vertices, depth, bits)


def near_ties(rng, bits):
    """Layers that are apart by about a unit in the last place of a float32 or of a float64, or by nothing, in any order."""
    vertices = np.array([(-90, -20), (80, -90), (60, 150)]) + rng.normal(size=(48, 3, 2))
    steps = rng.integers(-3, 4, (48, 1)) * np.tile([2.0**-25, 2.0**-24, 2.0**-53, 0.0], 12)[:, None]
    return on_screen(vertices, 0.7 + steps, bits)


def crossing(rng, bits):
    """Triangles that interpenetrate, and three that overlap in a cycle."""
    vertices = np.concatenate([rng.uniform(-30, 100, (30, 3, 2)), [[(5, 5), (65, 10), (60, 16)], [(60, 2), (30, 48), (24, 46)],
                               [(36, 48), (4, 14), (10, 4)]]])  # fmt: skip
    depth = np.concatenate([rng.uniform(-1, 1, (30, 3)), [(1, -1, -1)] * 3])
    return on_screen(vertices, depth, bits)


def fan(rng, bits):
    """A fan round the sample of a pixel, whose rim is far away in places."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, 24))
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.choice([9, 60, 3e5], (24, 1)) + (30.5, 20.5)
    vertices = np.stack([np.full((24, 2), (30.5, 20.5)), rim, np.roll(rim, -1, axis=0)], axis=1)
    return on_screen(vertices, rng.uniform(0, 1, (24, 3)), bits)


def slivers(rng, bits):
    """Long and thin triangles."""
    vertices = rng.uniform(-20, 80, (60, 1, 2)) + rng.normal(size=(60, 3, 2)) * rng.permutation([0.02, 60.0])
    return on_screen(vertices, rng.uniform(0, 1, (60, 3)), bits)


def far(rng, bits):
    """Triangles that reach hundreds of thousands of pixels away, up to the limit."""
    vertices = np.concatenate([rng.normal(size=(50, 3, 2)) * 4e5, rng.uniform(-(1 << 24), 1 << 24, (10, 3, 2))])
    return on_screen(vertices, rng.uniform(0, 1, (60, 3)), bits)


def tiny(rng, bits):
    """Triangles of about a pixel, some of them on the corners of a lattice, so that samples lie on edges."""
    vertices = rng.uniform(0, 60, (500, 1, 2)) + rng.normal(size=(500, 3, 2))
    vertices[::2] = np.rint(vertices[::2] * 2) / 2
    return on_screen(vertices, rng.uniform(0, 1, (500, 3)), bits)


def lattice(rng, bits):
    """Triangles of all sizes whose corners are samples, so that the points where they are split are samples too."""
    return on_screen(rng.integers(-20, 90, (80, 3, 2)) + 0.5, rng.integers(0, 3, (80, 3)) / 2, bits)


def nothing(rng, bits):
    """No triangles."""
    return on_screen(np.empty((0, 3, 2)), np.empty((0, 3)), bits)


SCENES = [clipped_soup, layers, near_ties, crossing, fan, slivers, far, tiny, lattice, nothing]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rule", RULES, ids=str)
def test_a_large_triangle_counts_each_sample_once(rng, rule, name):
    """Its border and its inner edges, halved again and again, pass through samples."""
    for corners in (
        [(0, 0), (64, 0), (0, 64)],
        [(0, 32), (64, 0), (64, 64)],
        [(0, 0), (192, 64), (64, 192)],
        [(9, 0), (57, 48), (9, 96)],
    ):
        for order in ([0, 1, 2], [1, 2, 0], [2, 1, 0]):
            triangles = on_screen(np.array([corners])[:, order] + 0.5, 0.0)
            expected, found = (draw(each, "hits", triangles, (200, 200), rule=rule) for each in ("half_space", name))
            assert found.max() == 1
            assert np.array_equal(found, expected)


# Warnock's decisions


def setup_of(triangles, n):
    """The setup of one triangle."""
    sampling = make_sampling(SIZE, (128, 128), rule="top-left", cull="none", subpixel_bits=8)
    p, q, r = triangles.corners[n]
    xy, depth = triangles.xy, triangles.depth
    return set_up_triangle(*xy[p], *xy[q], *xy[r], depth[p], depth[q], depth[r], 0, sampling)


def window_of(*bounds):
    """A window whose numbers are of the type that kernels use."""
    return warnock.Window(*(np.int64(bound) for bound in bounds))


def test_relations_are_what_their_names_say(rng):
    seen = set()
    for scene in (layers, crossing, tiny, lattice):
        triangles = scene(rng, 8)
        for n in range(0, len(triangles.corners), 3 if len(triangles.corners) < 100 else 40):
            t = setup_of(triangles, n)
            if t.y_start == t.y_end:
                continue
            covered = draw("half_space", "hits", triangles._replace(corners=triangles.corners[n : n + 1])) > 0
            corners = rng.integers(0, (50, 30), (8, 2))
            windows = [window_of(x, x + rng.integers(1, 20), y, y + rng.integers(1, 20)) for x, y in corners]
            for window in [window_of(*t[:4]), *windows]:
                part = covered[window.y_start : window.y_end, window.x_start : window.x_end]
                relation = warnock.relate(window, t)
                seen.add(relation)
                assert (relation == warnock.SURROUNDING) == part.all()
                if relation == warnock.DISJOINT:
                    assert not part.any()
                if relation == warnock.CONTAINED:
                    assert part.sum() == covered.sum()
    assert seen == {warnock.DISJOINT, warnock.SURROUNDING, warnock.CONTAINED, warnock.INTERSECTING}


def depths_in(t, window):
    """The depths of a plane at all samples of a window, as the writers get them."""
    i, j = np.meshgrid(np.arange(window.x_start, window.x_end) - t.x_start, np.arange(window.y_start, window.y_end) - t.y_start)
    return depth_at.py_func(t, t.g1 + i * t.g1_x + j * t.g1_y, t.g2 + i * t.g2_x + j * t.g2_y)


def test_what_is_hidden_is_behind_at_every_sample(rng):
    answers = set()
    for scene in (near_ties, layers):
        triangles = scene(rng, 8)
        for n in range(48):
            s, t = setup_of(triangles, n), setup_of(triangles, (n + 7) % 48)
            window = window_of(20, 36, 10, 26)
            if warnock.relate(window, s) != warnock.SURROUNDING or warnock.relate(window, t) == warnock.DISJOINT:
                continue
            part = warnock.overlap(window, t)
            behind = np.float32(depths_in(t, part)) < np.float32(depths_in(s, part))
            is_hidden = warnock.is_hidden(window, t, s)
            answers.add((is_hidden, bool(behind.all())))
            assert behind.all() or not is_hidden
    assert {(True, True), (False, False)} <= answers


def test_a_gap_below_the_margin_hides_nothing():
    screen = [(-500, -500), (900, -500), (100, 900)]
    window = window_of(0, 70, 0, 50)
    for depths, expected in (
        ((0.5, 0.5), False),
        ((0.5, 0.5 - 2.0**-25), False),
        ((0.5, 0.5 - 2.0**-20), True),
        ((-3e38, -1e39), False),
        ((2.0**-130, 0.0), False),
        ((0.5, -1e39), True),
        ((0.5, -1e30), True),
        ((0.5, 0.4), True),
    ):
        triangles = on_screen([screen, screen], np.array(depths)[:, None])
        found = warnock.is_hidden(window, setup_of(triangles, 1), setup_of(triangles, 0))
        assert found == expected, depths
        for kind in KINDS:
            for order in ([0, 1], [1, 0]):
                turned = triangles._replace(corners=np.ascontiguousarray(triangles.corners[order]))
                with np.errstate(over="ignore"):
                    expected_picture, picture = (draw(each, kind, turned) for each in ("half_space", "warnock"))
                assert np.array_equal(picture, expected_picture)


# What becomes of a primitive


def twice_area(piece):
    """Twice the area of a piece in (m, n)."""
    return (piece.m1 - piece.m0) * (piece.n2 - piece.n0) - (piece.n1 - piece.n0) * (piece.m2 - piece.m0)


def children(frame, piece):
    """The pieces that a piece is split into."""
    pieces = np.empty((micropolygon.MAX_PIECES, 7), np.int64)
    count = micropolygon.split(pieces, 0, frame, piece)
    return [micropolygon.Piece(*row) for row in pieces[:count]]


def whole_piece():
    """The piece that is the whole primitive."""
    return micropolygon.Piece(*(np.int64(v) for v in (0, 0, 1, 0, 0, 1, 0)))


def frame_of(p, q, r):
    """The frame of a triangle given in pixels, with the rest of its corners relative to the first."""
    (p_x, p_y), u, v = np.array(p) * 256, (np.array(q) - p) * 256, (np.array(r) - p) * 256
    return micropolygon.Frame(*(np.int64(number) for number in (p_x, p_y, *u, *v, 8)))


@pytest.mark.parametrize(
    ("corners", "count"),
    [
        ([(0, 0), (5, 2), (1, 9)], 0),
        ([(0, 0), (12, 0), (0, 12)], 0),
        ([(0, 0), (20, 0), (10, 8)], 2),
        ([(0, 0), (8, 7), (3, 16)], 2),
        ([(0, 0), (6, 11), (-8, 11)], 2),
        ([(0, 0), (20, 0), (0, 4)], 3),
        ([(0, 0), (4, 0), (0, 20)], 3),
        ([(0, 0), (20, 18), (18, 20)], 3),
        ([(0, 0), (20, 0), (0, 20)], 4),
    ],
)
def test_each_long_edge_makes_one_more_piece(corners, count):
    frame, whole = frame_of(*corners), whole_piece()
    found = children(frame, whole)
    assert len(found) == count
    assert all(piece.level == 1 and twice_area(piece) > 0 for piece in found)
    assert not found or sum(twice_area(piece) for piece in found) == 4 * twice_area(whole)


def edge_points(corners, ends):
    """The points at which the border between two corners of a triangle is split, down to the pieces that are diced."""
    frame = frame_of(*corners)
    waiting, points = [whole_piece()], set()
    while waiting:
        piece = waiting.pop()
        waiting += children(frame, piece)
        for m, n in ((piece.m0, piece.n0), (piece.m1, piece.n1), (piece.m2, piece.n2)):
            scale = 2.0**-piece.level
            weights = (1 - (m + n) * scale, m * scale, n * scale)
            if weights[3 - sum(ends)] == 0:
                points.add((weights[ends[0]], weights[ends[1]]))
    return points


def test_neighbours_split_their_common_edge_alike(rng):
    for _ in range(12):
        p, q, r = ((0, 0), tuple(rng.integers(-80, 80, 2)), tuple(rng.integers(60, 200, 2)))
        other = tuple(rng.integers(-200, 0, 2))
        assert edge_points((p, q, r), (0, 1)) == edge_points((p, q, other), (0, 1))


def test_splitting_ends_soon_after_the_edges_are_short(rng):
    for _ in range(30):
        corners = rng.normal(size=(3, 2)) * rng.choice([3, 60, 400], (1, 2))
        waiting, deepest = [whole_piece()], 0
        frame = frame_of(*np.rint(corners * 256) / 256)
        while waiting:
            piece = waiting.pop()
            deepest = max(deepest, piece.level)
            waiting += children(frame, piece)
        longest = np.abs(corners - np.roll(corners, 1, axis=0)).max()
        assert deepest <= max(0, np.ceil(np.log2(longest / 12))) + 2


def micropolygons(grid):
    """The micropolygons of a grid: their corners (i, j) and signs, as sample_grid goes through them."""
    for row in range(grid.side):
        for place in range(2 * (grid.side - row) - 1):
            turned = place & 1
            yield (place >> 1) + turned, row + turned, 1 - 2 * turned


@pytest.mark.parametrize("corners", [[(0, 0), (6, 0), (0, 6)], [(0, 0), (5, 7), (-6, 9)], [(0.5, 0.5), (12.5, 0.5), (4.5, 8.5)],
                                     [(0, 0), (12, 12), (-12, 12)], [(0.25, 0), (1, 1.5), (0.5, 2)]])  # fmt: skip
def test_every_sample_belongs_to_one_micropolygon(corners):
    """Also one on the border of the primitive, on an inner edge, or on a corner that six of them share."""
    grid = micropolygon.dice(frame_of(*corners), whole_piece())
    p, q, r = (np.array(corner) for corner in corners)
    seen = set()
    for m, n in itertools.product(range(17), repeat=2):
        if m + n > 16:
            continue
        # A point of the lattice that halves the micropolygons' edges once more, in units of the grid's level.
        point = (q - p) * m / 16 + (r - p) * n / 16
        x, y = (point * 256 * (1 << (grid.bits - 8))).astype(int).tolist()
        if any(point * 256 * (1 << (grid.bits - 8)) != (x, y)):
            continue
        owners = [
            (i, j, sign)
            for i, j, sign in micropolygons(grid)
            if micropolygon.owns_sample(
                grid, i, j, sign,
                np.int64(x - (grid.x + i * grid.u_x + j * grid.v_x)), np.int64(y - (grid.y + i * grid.u_y + j * grid.v_y)),
            )
        ]  # fmt: skip
        assert len(owners) == 1, (m, n, owners)
        seen.update(owners)
    assert len(seen) == grid.side**2


def test_pieces_off_the_window_are_dropped(rng):
    """A piece is dropped where no sample of the window lies in its box, and never where one is covered."""
    answers = set()
    for _ in range(200):
        corners = np.rint(rng.uniform(-20, 60, (3, 2)) * 256) / 256
        frame = frame_of(*corners)._replace(p_x=np.int64(corners[0, 0] * 256 - 128), p_y=np.int64(corners[0, 1] * 256 - 128))
        (x, y), (width, height) = rng.integers(0, 40, 2).tolist(), rng.integers(1, 12, 2).tolist()
        window = micropolygon.Window(*(np.int64(v) for v in (x, x + width, y, y + height)))
        first, last = np.ceil(corners.min(axis=0) - 0.5), np.floor(corners.max(axis=0) - 0.5)
        is_off = (np.minimum(last, (x + width - 1, y + height - 1)) < np.maximum(first, (x, y))).any()
        assert bool(micropolygon.is_off(frame, window, whole_piece())) == is_off
        answers.add(bool(is_off))
    assert answers == {True, False}
