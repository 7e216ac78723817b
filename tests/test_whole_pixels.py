"""Coverage of whole pixels, "touched" and "inside": equal to an exact oracle, in every algorithm and order that has them.

The oracle cuts the pixel's square by the triangle in rational numbers: the open square meets the open triangle where a part
with area is left, and lies inside where all of it is left. The fast one of exact.py equals it.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial import Delaunay

import scanspan as ss
from scanspan.pipeline import count_each
from tests import exact, reference
from tests.test_explain import check_every_pixel
from tests.zoo import PIXEL_WAYS, SCENES, scene_zoo, screen_planes

SIZE = (13, 9)
MODES = ("touched", "inside")
BITS = (4, 8, 16)
PLANE = tuple[Fraction, Fraction, Fraction]


def name_of(way):
    return "-".join(way.values())


def cut(polygon, plane):
    """Cut a convex polygon by a half-plane a x + b y + c >= 0."""
    heights = [plane[0] * x + plane[1] * y + plane[2] for x, y in polygon]
    left = []
    for k, (p, height) in enumerate(zip(polygon, heights, strict=True)):
        q, other = polygon[k - 1], heights[k - 1]
        if (height >= 0) != (other >= 0):
            share = height / (height - other)
            left.append((p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])))
        if height >= 0:
            left.append(p)
    return left


def area(polygon):
    """Return the area of a polygon."""
    return abs(sum(polygon[k - 1][0] * polygon[k][1] - polygon[k - 1][1] * polygon[k][0] for k in range(len(polygon)))) / 2


def shared_area(planes, i, j):
    """Return how much of pixel (i, j) lies on the inner side of all lines."""
    left = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    for plane in planes:
        left = cut(left, plane)
    return area(left)


def planes_of(vertices, bits):
    """Return the three half-planes whose common part a screen triangle is, after snapping; none where it has no area."""
    corners = [reference.snap(vertex, bits) for vertex in vertices]
    turn = reference.signed_area(*corners)
    found = []
    for k in range(3):
        (x, y), (other_x, other_y) = corners[k], corners[(k + 1) % 3]
        a, b = (y - other_y) * turn, (other_x - x) * turn
        found.append((a, b, -(a * x + b * y)))
    return found if turn else None


def covers(vertices, i, j, mode, bits):
    planes = planes_of(vertices, bits)
    if planes is None:
        return False
    share = shared_area(planes, Fraction(i), Fraction(j))
    return share > 0 if mode == "touched" else share == 1


def kinds(rng, bits):
    """Triangles that make it hard: on corners of pixels and beside them, needles, far away, without area."""
    free = rng.uniform(-5, 18, (60, 3, 2))
    lattice = rng.integers(-3, 16, (80, 3, 2)).astype(float)
    halves = rng.integers(-6, 32, (60, 3, 2)) / 2
    beside = rng.integers(-3, 16, (60, 3, 2)) + rng.integers(-1, 2, (60, 3, 2)) / 2.0**bits
    slivers = np.repeat(rng.uniform(0, 12, (40, 1, 2)), 3, axis=1) + rng.normal(size=(40, 3, 2)) * (0.02, 8)
    needles = np.round(rng.uniform(-5, 18, (40, 3, 2)))
    needles[:, 2] = needles[:, 0] + (needles[:, 1] - needles[:, 0]) * rng.random((40, 1)) + rng.normal(size=(40, 2)) / 2**bits
    large = rng.uniform(-1e6, 1e6, (80, 3, 2))
    edges = np.stack([np.tile([-1e6, 4.0], (20, 1)), np.tile([1e6, 4.0], (20, 1)), rng.uniform(-1e6, 1e6, (20, 2))], axis=1)
    inside = rng.integers(0, 12, (20, 1, 2)) + rng.uniform(0.1, 0.9, (20, 3, 2))
    line = np.repeat(rng.integers(0, 12, (10, 1, 2)), 3, axis=1) * np.ones((10, 3, 2))
    line[5:, 1] += 3
    return {
        "free": free, "lattice": lattice, "halves": halves, "beside": beside, "slivers": slivers, "needles": needles,
        "large": large, "edges": edges, "within a pixel": inside, "degenerate": line,
    }  # fmt: skip


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("bits", BITS)
def test_the_oracle_at_corners_equals_the_one_that_cuts(rng, mode, bits):
    seen = 0
    for name, vertices in kinds(rng, bits).items():
        some = vertices[:3]
        fast = exact.whole_pixels(some, (6, 5), mode, subpixel_bits=bits)
        slow = [[[covers(each, i, j, mode, bits) for i in range(6)] for j in range(5)] for each in some.tolist()]
        assert np.array_equal(fast, slow), name
        seen += fast.sum()
    assert seen > 10


@pytest.mark.parametrize("way", PIXEL_WAYS, ids=name_of)
def test_pixels_equal_the_oracle(rng, way):
    for bits in BITS:
        for name, vertices in kinds(rng, bits).items():
            for mode in MODES:
                expected = exact.whole_pixels(vertices, SIZE, mode, subpixel_bits=bits)
                options = {**way, "coverage": mode, "subpixel_bits": bits}
                assert np.array_equal(count_each(vertices, SIZE, **options), expected), (name, mode, bits)
                assert np.array_equal(ss.count(vertices, SIZE, **options), expected.sum(axis=0)), (name, mode, bits)
                assert expected.any() or name in ("degenerate", "within a pixel", "slivers", "needles", "free"), (name, mode)
                assert not expected.any() or name != "degenerate"


@pytest.mark.parametrize("fault", ["top-left", "half a pixel", "inclusive", "a pixel more"])
def test_planted_faults_are_noticed(rng, fault):
    wrong = 0
    for vertices in kinds(rng, 8).values():
        for mode in MODES:
            expected = exact.whole_pixels(vertices, SIZE, mode)
            if fault == "half a pixel":
                found = exact.whole_pixels(vertices + 1 / 256, SIZE, mode)
            elif fault == "a pixel more":
                found = expected | np.pad(expected, ((0, 0), (0, 0), (1, 0)))[:, :, :-1]
            else:
                found = exact.coverage(vertices, SIZE, rule="inclusive" if fault == "inclusive" else "top-left")
            wrong += (found != expected).sum()
    assert wrong > 100


@pytest.mark.parametrize("cull", ["none", "back", "front"])
def test_culling_and_rules(rng, cull):
    vertices = kinds(rng, 8)["free"]
    for mode in MODES:
        expected = exact.whole_pixels(vertices, SIZE, mode, cull=cull)
        for rule in ("top-left", "bottom-left", "inclusive", "exclusive", ss.OffscreenPoint(3, 4)):
            assert np.array_equal(count_each(vertices, SIZE, cull=cull, coverage=mode, rule=rule), expected)


def test_inside_implies_sample_implies_touched(rng):
    for vertices in kinds(rng, 8).values():
        inside, touched = (count_each(vertices, SIZE, coverage=mode) for mode in ("inside", "touched"))
        for rule in ("inclusive", "top-left", "exclusive"):
            sample = count_each(vertices, SIZE, rule=rule)
            assert (inside <= sample).all()
            assert (sample <= touched).all()


@pytest.mark.parametrize("step", [1.0, 0.5, 1 / 256])
def test_a_mesh_touches_what_its_outline_touches(rng, step):
    for _ in range(5):
        points = np.unique(np.rint(rng.uniform(-3, 14, (30, 2)) / step) * step, axis=0)
        mesh = Delaunay(points)
        count = ss.count(points[mesh.simplices], SIZE, coverage="touched")
        union = exact.whole_pixels(points[mesh.simplices], SIZE, "touched").any(axis=0)
        assert np.array_equal(count > 0, union)

        # The hull is convex: its half-planes say the same of the whole.
        hull, centre = points[mesh.convex_hull], points.mean(axis=0)
        planes = []
        for (x, y), (other_x, other_y) in hull.tolist():
            a, b = Fraction(y) - Fraction(other_y), Fraction(other_x) - Fraction(x)
            turn = 1 if a * Fraction(centre[0] - x) + b * Fraction(centre[1] - y) > 0 else -1
            planes.append((turn * a, turn * b, -turn * (a * Fraction(x) + b * Fraction(y))))
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                assert (count[j, i] > 0) == (shared_area(planes, Fraction(i), Fraction(j)) > 0)


def in_front(rng, count):
    """Clip coordinates of triangles in front of the eye, in perspective, and their triangles."""
    w = rng.uniform(0.5, 4, 3 * count)
    xyz = rng.uniform((-1.4, -1.4, -0.9), (1.4, 1.4, 1.5), (3 * count, 3))
    return np.c_[xyz * w[:, None], w], np.arange(3 * count).reshape(-1, 3)


@pytest.mark.parametrize("way", PIXEL_WAYS, ids=name_of)
@pytest.mark.parametrize("mode", MODES)
def test_depth_is_the_planes_held_to_the_triangles_range(rng, way, mode):
    clip, triangles = in_front(rng, 25)
    held = compared = 0
    for corners in triangles:
        own = clip[corners].tolist()
        seen = ss.rasterize(clip, [corners], SIZE, **way, coverage=mode)
        depths = [(Fraction(w) - Fraction(z)) / (2 * Fraction(w)) for _, _, z, w in own]
        vertices = np.array([reference.to_screen(vertex, SIZE) for vertex in own])
        covered = exact.whole_pixels(vertices[None], SIZE, mode)[0]
        assert np.array_equal(seen.primitive >= 0, covered)
        for j, i in np.argwhere(covered).tolist():
            plane = reference.depth_at(own, reference.sample_position(i, j), SIZE)
            expected = np.float32(float(min(max(plane, min(depths)), max(depths))))
            assert abs(seen.depth[j, i] - expected) <= 2 * np.spacing(np.abs(expected)), (corners, i, j)
            held, compared = held + (not min(depths) <= plane <= max(depths)), compared + 1
    assert compared > 100
    assert held > 10 or mode == "inside"


@pytest.mark.parametrize("mode", MODES)
def test_the_nearest_is_seen(rng, mode):
    clip, triangles = in_front(rng, 40)
    whole = ss.rasterize(clip, triangles, SIZE, coverage=mode)
    alone = [ss.rasterize(clip, [corners], SIZE, coverage=mode) for corners in triangles]
    depths = np.stack([seen.depth for seen in alone])
    nearest = np.where(np.isfinite(depths).any(axis=0), depths.argmax(axis=0), -1)
    assert np.array_equal(whole.primitive, nearest)
    assert np.array_equal(whole.depth, depths.max(axis=0))
    assert len(np.unique(nearest)) > 10


def moved(planes, by):
    """Return half-planes moved outwards, in pixels."""
    return [(a, b, c + by) for a, b, c in planes]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("way", [PIXEL_WAYS[0], PIXEL_WAYS[5], PIXEL_WAYS[-1]], ids=name_of)
def test_triangles_that_reach_behind_the_eye(rng, way, mode):
    """A pixel may go either way only where moving the edges by 1/128 px decides."""
    sure = covered = 0
    for _ in range(60):
        clip = rng.normal(size=(3, 4)) * (1, 1, 0.7, 1)
        clip[rng.integers(3), 3] = -abs(rng.normal())
        found = ss.rasterize(clip, [(0, 1, 2)], SIZE, **way, coverage=mode).primitive >= 0
        planes = screen_planes(clip, SIZE)
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                least, most = (shared_area(moved(planes, by), float(i), float(j)) for by in (-1 / 128, 1 / 128))
                must, never = (least > 0, most == 0) if mode == "touched" else (least > 1 - 1e-9, most < 1 - 1e-9)
                assert found[j, i] or not must, (clip.tolist(), i, j)
                assert not (found[j, i] and never), (clip.tolist(), i, j)
                sure += must or never
        covered += found.sum()
    assert covered > 200
    assert sure > 0.9 * 60 * SIZE[0] * SIZE[1]


def seen_part(clip):
    """Return the lowest and the highest depth of what the near plane leaves of a triangle, as a camera sees it."""
    depths = []
    for k in range(3):
        (z, w), (other_z, other_w) = clip[k][2:], clip[k - 1][2:]
        if z + w >= 0:
            depths.append((w - z) / (2 * w))
        if (z + w >= 0) != (other_z + other_w >= 0):
            depths.append(1.0)
    return min(depths), max(depths)


@pytest.mark.parametrize("way", [PIXEL_WAYS[0], PIXEL_WAYS[5], PIXEL_WAYS[-1]], ids=name_of)
def test_depth_of_a_cut_triangle_is_held_to_what_is_left_of_it(rng, way):
    touched = 0
    for _ in range(60):
        clip = np.c_[rng.uniform(-1, 1, (3, 2)), np.zeros(3), np.ones(3)] * rng.uniform(0.5, 3, (3, 1))
        clip[rng.integers(3), 3] = rng.choice([-0.5, 0.1])
        clip[:, 2] = 0.9 * clip[:, 3] - 0.4
        low, high = seen_part(clip)
        seen = ss.rasterize(clip, [(0, 1, 2)], SIZE, **way, coverage="touched")
        depth = seen.depth[seen.primitive >= 0]
        assert ((depth >= low - 1e-6) & (depth <= high + 1e-6)).all(), (clip.tolist(), low, high)
        touched += len(depth)
    assert touched > 300


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", [name for name in SCENES if name != "nothing"])
def test_weights_lie_in_the_triangle(rng, name, mode):
    clip, triangles = scene_zoo(rng)[name]
    seen = ss.rasterize(clip, triangles, SIZE, coverage=mode)
    weights, shown = seen.barycentric, seen.primitive >= 0
    assert (weights[~shown] == 0).all()
    assert ((weights[shown] >= 0) & (weights[shown] <= 1)).all()
    assert np.allclose(weights[shown].sum(axis=1), 1, rtol=0, atol=1e-14)
    assert shown.any() or mode == "inside"


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", ["soup", "lattice", "beyond"])
def test_explanations_equal_the_picture(rng, name, mode):
    clip, triangles = scene_zoo(rng)[name]
    seen = ss.rasterize(clip, triangles[:40], (16, 12), coverage=mode)
    assert {"visible", "outside"} <= check_every_pixel(seen)
    for y, x in np.argwhere(seen.primitive >= 0).tolist():
        assert ss.explain(seen, x, y).decisions[0].depth == seen.depth[y, x]


def test_what_does_not_go_together_is_refused():
    clip, triangles = [(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)], [(0, 1, 2)]
    with pytest.raises(ss.InputError, match=r"^samples = 2: coverage='touched' concerns whole pixels, which have one sample$"):
        ss.rasterize(clip, triangles, SIZE, samples=2, coverage="touched")
    with pytest.raises(ss.InputError, match=r"^unknown coverage 'centre'"):
        ss.rasterize(clip, triangles, SIZE, coverage="centre")
    for algorithm in set(ss.ALGORITHMS) - {way["algorithm"] for way in PIXEL_WAYS}:
        message = rf"^coverage = 'inside': known to half-space, homogeneous, warnock, and not to {algorithm}$"
        with pytest.raises(ss.InputError, match=message):
            ss.rasterize(clip, triangles, SIZE, algorithm=algorithm, coverage="inside")
        with pytest.raises(ss.InputError, match=message):
            ss.count([], SIZE, algorithm=algorithm, coverage="inside")
