"""Rasterization without clipping: neighbours agree, also behind the eye, and what is seen is what clipping leaves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

import scanspan as ss
from scanspan.geometry.clip import clip_planes
from scanspan.geometry.project import project
from scanspan.raster import homogeneous_edges
from scanspan.raster.homogeneous_edges import outline_kernel, without_clipping
from tests import zoo
from tests.zoo import screen_planes

SIZE = (24, 20)
RULES = ["top-left", "bottom-left", ss.OffscreenPoint(-3.25, 7.5), ss.OffscreenPoint(1, 0, 0)]
ORDERS = ["rows", "serpentine", "tiles", "morton", "hilbert"]
BAND = 1 / 128


def covered(clip, triangles, **options):
    """Which samples each triangle covers, each alone: (T, H, W)."""
    seen = [ss.rasterize(clip, [corners], SIZE, algorithm="homogeneous", **options).primitive >= 0 for corners in triangles]
    return np.stack(seen)


def to_clip(points, near=1e-3):
    """Clip coordinates of points about an eye at the origin that looks along -z, a little askew."""
    x, y, z = np.asarray(points, float).T
    return np.stack([x + 0.1 * y, y - 0.2 * x, -z - 2 * near, -z], axis=1)


def box(low, high):
    """The corners and the twelve triangles of a box; seen from outside they are counter-clockwise."""
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])], float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def hull(rng, count):
    """A convex shell about the eye with triangles of any size."""
    points = rng.normal(size=(count, 3))
    points *= rng.uniform(1, 4) / np.linalg.norm(points, axis=1)[:, None]
    return points, ConvexHull(points).simplices


def grid_round_the_eye(rng):
    """A closed shell of a lattice of directions, with corners straight ahead, to the side (w = 0 exactly) and behind."""
    levels, turns = np.linspace(-1, 1, 7), np.linspace(0, 2 * np.pi, 9)[:-1]
    ring = [(np.cos(t) * np.sqrt(1 - z * z), np.sin(t) * np.sqrt(1 - z * z), z) for z in levels[1:-1] for t in turns]
    points = np.array([(0, 0, -1), *ring, (0, 0, 1)], float) * 2
    triangles = [(0, 1 + k, 1 + (k + 1) % 8) for k in range(8)]
    for row in range(4):
        for k in range(8):
            a, b = 1 + 8 * row + k, 1 + 8 * row + (k + 1) % 8
            triangles += [(a, a + 8, b), (b, a + 8, b + 8)]
    triangles += [(33 + k, 41, 33 + (k + 1) % 8) for k in range(8)]
    return points, np.array(triangles)


SHELLS = {
    "box": lambda rng: box((-2, -1.5, -4), (3, 1, 2)),
    "thin box": lambda rng: box((-0.02, -30, -4), (0.01, 20, 2)),
    "few": lambda rng: hull(rng, 7),
    "many": lambda rng: hull(rng, 60),
    "grid": grid_round_the_eye,
}


def surrounds(points, triangles):
    """Say whether a convex shell has the eye well inside."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    middle = points.mean(axis=0)
    side = np.einsum("nk,nk->n", normal, a - middle)
    return (np.einsum("nk,nk->n", normal, a) * np.sign(side) > 0.05 * np.linalg.norm(normal, axis=1)).all()


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("bits", [4, 8, 16])
@pytest.mark.parametrize("name", SHELLS)
def test_a_shell_about_the_eye_covers_every_sample_once(rng, name, bits, rule):
    """Corners lie ahead, behind and at w = 0; no tolerance: every ray meets the shell once."""
    shells = 0
    while shells < (1 if name in ("box", "thin box", "grid") else 4):
        points, triangles = SHELLS[name](rng)
        if name in ("few", "many") and not surrounds(points, triangles):
            continue
        counts = covered(to_clip(points), triangles, rule=rule, subpixel_bits=bits).sum(axis=0)
        assert (counts == 1).all(), (name, np.argwhere(counts != 1).tolist()[:5])
        shells += 1


def test_rules_that_are_no_partition_are_noticed():
    """The lectures' inclusive rule hits samples on edges twice, the exclusive one leaves them out."""
    clip, (_, triangles) = to_clip(SHELLS["grid"](None)[0]), SHELLS["grid"](None)
    clip[:, 0], clip[:, 1] = clip[:, 0] - 0.1 * clip[:, 1] + clip[:, 3] / SIZE[0], clip[:, 1] + clip[:, 3] / SIZE[1]
    inclusive, exclusive = (covered(clip, triangles, rule=rule).sum(axis=0) for rule in ("inclusive", "exclusive"))
    assert inclusive.max() > 1
    assert exclusive.min() == 0
    assert (covered(clip, np.delete(triangles, 3, axis=0)).sum(axis=0) == 0).any()


@pytest.mark.parametrize("rule", RULES[:3], ids=str)
def test_a_sheet_through_the_near_plane_has_no_cracks_and_no_double_hits(rng, rule):
    """A flat mesh in clip space: its picture is a partition of what is seen of the sheet, whatever lies behind the eye."""
    inside = behind = 0
    for _ in range(12):
        places = np.unique(np.rint(rng.uniform(-1, 1, (14, 2)) * 8) / 8, axis=0)
        base, across, down = rng.normal(size=(3, 4))
        base[3], across[3], down[3] = 0.6, rng.uniform(-1.5, 1.5), rng.uniform(-1.5, 1.5)
        base[2], across[2], down[2] = 0.3, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)
        clip = base + places[:, :1] * across + places[:, 1:] * down
        triangles = Delaunay(places).simplices
        parts = covered(clip, triangles, rule=rule)
        assert parts.sum(axis=0).max() <= 1

        # A sample well inside of the sheet and behind the near plane is covered; solve for its place on the sheet.
        matrix = np.stack([across, down, base])[:, [0, 1, 3]].T
        outline = ConvexHull(places)
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                found = np.linalg.solve(matrix, [2 * (i + 0.5) / SIZE[0] - 1, 1 - 2 * (j + 0.5) / SIZE[1], 1.0])
                place = found[:2] / found[2]
                depth = base + place[0] * across + place[1] * down
                reach = (outline.equations[:, :2] @ place + outline.equations[:, 2]).max()
                if found[2] > 0 and reach < -0.05 and depth[2] + depth[3] > 0.05 and depth[3] > 0.05:
                    assert parts[:, j, i].sum() == 1, (clip.tolist(), i, j)
                    inside += 1
        behind += (clip[:, 3] < 0).sum()
    assert inside > 500
    assert behind > 10


def hard_triangles(rng):
    """Triangles by name, (N, 3, 4): each kind reaches where division by w fails."""

    def ordinary(count):
        clip = rng.normal(size=(count, 3, 4)) * (1, 1, 0.5, 1)
        clip[..., 3] = np.abs(clip[..., 3]) + 0.2
        clip[..., 2] = clip[..., 3] * rng.uniform(-0.9, 0.9, (count, 3))
        return clip

    one, two, level, beyond, near, three = (ordinary(40) for _ in range(6))
    one[:, 1, 3] *= -1
    two[:, 1:, 3] *= -1
    level[:, 2, 3] = 0
    beyond[:, 0, 3], beyond[:, 0, 2] = 1e-9, 0
    near[:, 0, 2] = -1.5 * near[:, 0, 3]
    three[..., 3] *= -1
    through = ordinary(20)
    through[:, 2] = through[:, 0] - 2 * through[:, 1]  # the plane goes through the eye
    behind_near = one.copy()
    behind_near[:, 0, 2] = -2
    return {
        "one corner behind": one, "two corners behind": two, "a corner at w = 0": level, "beyond 2^24 px": beyond,
        "before the near plane": near, "all behind": three, "through the eye": through, "behind and before": behind_near,
    }  # fmt: skip


def check_triangle(clip, found):
    """Compare one triangle's samples with its half-planes; return how many it must cover."""
    planes = screen_planes(clip, SIZE)
    must = 0
    for j in range(SIZE[1]):
        for i in range(SIZE[0]):
            least = (planes @ [i + 0.5, j + 0.5, 1.0]).min()
            if abs(least) > BAND:
                assert found[j, i] == (least > 0), (clip.tolist(), i, j)
                must += least > 0
    return must


@pytest.mark.parametrize("order", ORDERS)
def test_triangles_are_covered_within_the_band(rng, order):
    for name, triangles in hard_triangles(rng).items():
        must = 0
        for clip in triangles:
            found = ss.rasterize(clip, [(0, 1, 2)], SIZE, algorithm="homogeneous", order=order).primitive >= 0
            if name in ("all behind", "through the eye"):
                assert not found.any() or name == "through the eye"
            must += check_triangle(clip, found)
        assert must > 100 or name in ("all behind", "through the eye"), name


def test_a_wrong_triangle_is_noticed(rng):
    clip = hard_triangles(rng)["two corners behind"]
    seen = [ss.rasterize(each, [(0, 1, 2)], SIZE, algorithm="homogeneous").primitive >= 0 for each in clip]
    large = int(np.argmax([min(each.sum(), (~each).sum()) for each in seen]))
    check_triangle(clip[large], seen[large])
    for wrong in (np.roll(seen[large], 1, axis=1), ~seen[large], np.zeros_like(seen[large])):
        with pytest.raises(AssertionError):
            check_triangle(clip[large], wrong)


def test_triangles_without_area_draw_nothing():
    corner, other = (0.3, 0.2, 0.1, -0.5), (-0.5, 0.1, 0.2, 1.0)
    middle = tuple((a + b) / 2 for a, b in zip(corner, other, strict=True))
    for clip in ([corner, other, other], [corner, corner, other], [corner, other, middle], [corner] * 3, [(0, 0, 0, 0)] * 3,
                 [(0, 0, 0, 0), other, corner], [(0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0)]):  # fmt: skip
        for coverage in ("sample", "touched", "inside"):
            seen = ss.rasterize(clip, [(0, 1, 2)], SIZE, algorithm="homogeneous", coverage=coverage, rule="inclusive")
            assert (seen.primitive == -1).all(), (clip, coverage)
            assert (seen.barycentric == 0).all()


@pytest.mark.parametrize("name", ["box", "many", "grid"])
def test_culling_splits_the_picture(rng, name):
    """Seen from inside, all faces of a shell are back faces; of a soup, each is one or the other."""
    points, triangles = SHELLS[name](rng)
    a, b, c = points[triangles].transpose(1, 0, 2)
    inwards = np.einsum("nk,nk->n", np.cross(b - a, c - a), a - points.mean(axis=0)) < 0
    triangles = np.where(inwards[:, None], triangles[:, [0, 2, 1]], triangles)
    clip = to_clip(points)
    assert not covered(clip, triangles, cull="back").any()
    assert np.array_equal(covered(clip, triangles, cull="front"), covered(clip, triangles))

    soup = rng.normal(size=(60, 4))
    three = np.arange(60).reshape(-1, 3)
    back, front = covered(soup, three, cull="front"), covered(soup, three, cull="back")
    assert back.any()
    assert front.any()
    assert not (back & front).any()
    assert np.array_equal(back | front, covered(soup, three))
    assert np.array_equal(covered(soup, three[:, [0, 2, 1]], cull="front"), front)


def test_corners_may_come_in_any_order(rng):
    soup, three = rng.normal(size=(90, 4)), np.arange(90).reshape(-1, 3)
    whole = ss.rasterize(soup, three, SIZE, algorithm="homogeneous")
    for turned in (three[:, [1, 2, 0]], three[:, [2, 1, 0]]):
        seen = ss.rasterize(soup, turned, SIZE, algorithm="homogeneous")
        assert np.array_equal(seen.primitive, whole.primitive)
        assert np.allclose(seen.depth, whole.depth, rtol=1e-6)


def room_scene(rng):
    """A coloured room with things in it, and a camera that stands inside."""
    corners, triangles = box((-2, -1.5, -4), (3, 1, 2))
    room = ss.Mesh(corners, triangles, attributes={"color": rng.integers(0, 256, (8, 3)).astype(np.uint8)})
    walls = ss.Mesh(rng.uniform((-2, -1.5, -4), (3, 1, 2), (30, 3)), np.arange(30).reshape(-1, 3))
    return ss.Scene([room, walls])


@pytest.mark.parametrize("far", [None, 3.0])
@pytest.mark.parametrize("near", [0.01, 1.5])
def test_frames_from_inside_a_room(rng, near, far):
    scene = room_scene(rng)
    different = empty = 0
    for turn in range(6):
        target = (np.cos(turn), 0.3 * np.sin(turn), np.sin(turn))
        camera = ss.Camera.look_at((0.1, 0.05, 0.2), target, (0, 1, 0), fov=80, near=near, far=far)
        clipped, whole = (ss.render(scene, camera, (80, 60), algorithm=name) for name in ("half-space", "homogeneous"))
        differs = (clipped.color != whole.color).any(axis=2)
        elsewhere = clipped.primitive != whole.primitive
        different += int((np.abs(clipped.color.astype(int) - whole.color) > 2).any(axis=2).sum())
        assert elsewhere.sum() <= 10
        assert differs.mean() < 0.5
        same = ~elsewhere & (whole.primitive >= 0)
        assert np.allclose(whole.depth[same], clipped.depth[same], rtol=1e-3)
        assert np.allclose(whole.barycentric[same], clipped.barycentric[same], atol=0.01)
        if far is not None:
            assert whole.depth[same].max() <= far * (1 + 1e-6)
        assert near * (1 - 1e-6) <= whole.depth[same].min()
        empty += int((whole.primitive < 0).sum())
    assert different <= 6 * 80 * 60 // 200
    assert (empty > 0) == (near > 1 or far is not None)


@pytest.mark.parametrize("name", ["soup", "room", "beyond"])
def test_explanations_equal_the_picture(rng, name):
    from tests.test_explain import check_every_pixel

    clip, triangles = zoo.scene_zoo(rng)[name]
    seen = ss.rasterize(clip, triangles[:40], (16, 12), algorithm="homogeneous")
    assert {"visible", "hidden", "outside"} <= check_every_pixel(seen)
    for y, x in np.argwhere(seen.primitive >= 0).tolist():
        assert ss.explain(seen, x, y).decisions[0].depth == seen.depth[y, x]


@pytest.mark.parametrize("far", [False, True])
def test_outlines_are_the_same_as_plain_python(rng, far):
    clip = np.concatenate([*hard_triangles(rng).values()]).reshape(-1, 4)
    corners = np.arange(len(clip), dtype=np.int32).reshape(-1, 3)
    cut = clip_planes(SIZE, far)
    seen = project(clip, cut, SIZE, 8)
    middle = np.array([SIZE[0] / 2, SIZE[1] / 2, 256.0])
    results = []
    for kernel in (outline_kernel, outline_kernel.py_func):
        rows = len(corners)
        limits = np.zeros((rows, 7), np.int64)
        limits[:, :4] = homogeneous_edges.EMPTY_BOX
        found = [np.zeros((rows, 3, 4), np.int64), limits, np.zeros((rows, 7)), np.zeros((rows, 3, 3))]
        with np.errstate(all="ignore"):
            kernel(clip, seen.xy, seen.depth, seen.outcodes, corners, cut, middle, *found)
        results.append(found)
    for compiled, plain in zip(*results, strict=True):
        assert np.array_equal(compiled, plain)
    assert (results[0][1][:, 0] <= results[0][1][:, 1]).sum() > 100


def test_only_triangles_that_are_cut_have_an_outline(rng):
    for clip, triangles in zoo.scene_zoo(rng).values():
        screen = without_clipping(clip, triangles.astype(np.int32), SIZE, 8)
        crossing = zoo.is_cut(clip, triangles, SIZE)
        assert crossing[screen.source[screen.outline >= 0]].all()
        assert not crossing[screen.source[screen.outline < 0]].any()
        assert np.isin(np.flatnonzero(~crossing), screen.source).all()


@pytest.mark.parametrize("bits", [4, 8, 16])
def test_pieces_have_the_plane_of_the_whole(rng, bits):
    """Depth is that of the triangle that is not clipped, bit for bit, and does not depend on which corner comes first."""
    clip, triangles = rng.normal(size=(150, 4)), np.arange(150).reshape(-1, 3)
    pieces = ss.rasterize(clip, triangles, (40, 30), subpixel_bits=bits)
    assert pieces.counters["cut"] > 10
    ways = [({"algorithm": "homogeneous"}, [0, 1, 2]), ({}, [1, 2, 0]), ({}, [2, 1, 0])]
    for options, order in ways:
        other = ss.rasterize(clip, triangles[:, order], (40, 30), subpixel_bits=bits, **options)
        same = (other.primitive == pieces.primitive) & (pieces.primitive >= 0)
        assert same.sum() > 0.9 * (pieces.primitive >= 0).sum()
        assert np.array_equal(other.depth[same], pieces.depth[same])
