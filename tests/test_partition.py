"""Every sample is owned exactly once: on random and adversarial planar meshes, and whatever is done to a mesh or to the image.

The meshes cover the whole image, so that the expected picture is a one in every pixel, or end inside it, so that the outline is
tested as well. They are planar by construction in whole sub-pixels. No oracle takes part in the first half of this file.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import Delaunay  # type: ignore[import-untyped]

import scanspan as ss
from tests import exact, reference

Floats = NDArray[np.float64]
Counts = NDArray[np.int32]

SIZE = (24, 18)
FARTHEST = 10**7

# A point in general position, one on the line of many edges, one inside the image on a sample, one at infinity.
PARTITION_RULES: list[Any] = [
    "top-left",
    "bottom-left",
    ss.OffscreenPoint(-301.125, 77.4375),
    ss.OffscreenPoint(-1.0, -1.0),
    ss.OffscreenPoint(8.5, 8.5),
    ss.OffscreenPoint(1.0, 1.0, 0.0),
]
RULE_NAMES = ["top-left", "bottom-left", "generic-point", "point-on-lines", "point-on-sample", "point-at-infinity"]


def gaps_and_doubles(vertices: Floats, expected: Counts, rule: Any, bits: int = 8) -> tuple[int, int]:
    """Count the samples of a mesh that too few and too many triangles own."""
    counts = ss.count(vertices, (expected.shape[1], expected.shape[0]), rule=rule, subpixel_bits=bits)
    return int((counts < expected).sum()), int((counts > expected).sum())


def shuffled(vertices: Floats, rng: np.random.Generator) -> Floats:
    """Return the triangles in another order, each with another first vertex and a random winding."""
    vertices = vertices[rng.permutation(len(vertices))].copy()
    for k in range(len(vertices)):
        order = np.roll([0, 1, 2], rng.integers(3))
        vertices[k] = vertices[k, order[::-1] if rng.random() < 0.5 else order]
    return vertices


def delaunay_mesh(rng: np.random.Generator, step: float, count: int) -> Floats:
    """Return a triangulation of points on a lattice, with a frame about the image."""
    width, height = SIZE
    points = np.rint(rng.uniform(-6, 6 + max(SIZE), (count, 2)) / step) * step
    frame = np.array([[x, y] for x in (-9, 14.5, width + 9) for y in (-9, 6.5, height + 9)])
    points = np.unique(np.concatenate([points, frame]), axis=0)
    return shuffled(points[Delaunay(points).simplices], rng)


def fan_mesh(rng: np.random.Generator, reach: float) -> Floats:
    """Return a fan about a sample with a spoke through every other sample of its row, its column and its diagonals."""
    centre = np.array([11.5, 7.5])
    side = np.arange(-reach, reach, reach / 4)
    top, right = [(t, -reach) for t in side], [(reach, t) for t in side]
    bottom, left = [(-t, reach) for t in side], [(-reach, -t) for t in side]
    ring = centre + np.array(top + right + bottom + left)
    return shuffled(np.stack([np.broadcast_to(centre, ring.shape), ring, np.roll(ring, -1, axis=0)], axis=1), rng)


def needle_mesh(rng: np.random.Generator, reach: float, step: float) -> Floats:
    """Return a square cut into needles between its left and right sides, many of them a sub-pixel wide in the image."""
    left = np.concatenate([np.arange(2.5, 6.5, step), rng.integers(-40, 60, 30) * 0.5, [-reach, reach]])
    right = np.concatenate([np.arange(2.5, 6.5, step), rng.integers(-40, 60, 30) * 0.5, [-reach, reach]])
    left, right = np.unique(left), np.unique(right)
    triangles, i, j = [], 0, 0
    while i + 1 < len(left) or j + 1 < len(right):
        # Climb on the side where the next point is lower, so that no two needles cross.
        climbs_left = j + 1 == len(right) or (i + 1 < len(left) and left[i + 1] <= right[j + 1])
        third = (-reach, left[i + 1]) if climbs_left else (reach, right[j + 1])
        triangles.append([(-reach, left[i]), (reach, right[j]), third])
        i, j = (i + 1, j) if climbs_left else (i, j + 1)
    return shuffled(np.array(triangles, dtype=np.float64), rng)


def strip_mesh(rng: np.random.Generator) -> Floats:
    """Return long level, upright and slanted strips whose edges run through rows, columns and diagonals of samples."""
    near, far = -40.0, 60.0
    rows = np.concatenate([[near], np.arange(0.5, SIZE[1], 0.5), [far]])
    slant = float(rng.integers(-3, 4))
    lift = 100 * slant
    quads = [((near, a), (far, a + lift), (far, b + lift), (near, b)) for a, b in pairwise(rows)]
    top = ((near, near), (near - 1, near - 900), (far + 1, near - 900), (far, near + lift))
    bottom = ((near, far), (near - 1, far + 900), (far + 1, far + 900), (far, far + lift))
    triangles = [t for a, b, c, d in [*quads, top, bottom] for t in ((a, b, c), (a, c, d))]
    return shuffled(np.array(triangles, dtype=np.float64), rng)


def split_mesh(rng: np.random.Generator, bits: int, count: int) -> Floats:
    """Return a square of 10^7 px in which points near the image split triangle after triangle: exact in whole numbers."""
    scale, far = 2**bits, FARTHEST * 2**bits
    corners = [(-far, -far), (far, -far), (far, far), (-far, far)]
    triangles = [(corners[0], corners[1], corners[2]), (corners[0], corners[2], corners[3])]

    def side(a: tuple[int, int], b: tuple[int, int], p: tuple[int, int]) -> int:
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    for _ in range(count):
        # Choose points on samples, near the image and at all distances.
        spread = float(np.exp(rng.uniform(np.log(2.0), np.log(FARTHEST / 2))))
        place = rng.uniform(-spread, spread, 2) if rng.random() < 0.5 else rng.uniform(-4, 28, 2)
        point = (int(place[0]) * scale + scale // 2, int(place[1]) * scale + scale // 2)
        for k, (a, b, c) in enumerate(triangles):
            if side(a, b, point) > 0 and side(b, c, point) > 0 and side(c, a, point) > 0:
                triangles[k : k + 1] = [(a, b, point), (b, c, point), (c, a, point)]
                break
    return shuffled(np.array(triangles, dtype=np.float64) / scale, rng)


MESHES: dict[str, Callable[[np.random.Generator], Floats]] = {
    "delaunay-lattice": lambda rng: delaunay_mesh(rng, 1.0, 150),
    "delaunay-half-lattice": lambda rng: delaunay_mesh(rng, 0.5, 400),
    "delaunay-random": lambda rng: delaunay_mesh(rng, 1 / 256, 400),
    "delaunay-dense": lambda rng: delaunay_mesh(rng, 1 / 16, 4000),
    "fan": lambda rng: fan_mesh(rng, 32.0),
    "fan-far": lambda rng: fan_mesh(rng, float(FARTHEST - 16)),
    "needles": lambda rng: needle_mesh(rng, 64.0, 1 / 64),
    "needles-far": lambda rng: needle_mesh(rng, float(FARTHEST), 1 / 16),
    "strips": strip_mesh,
    "split-far": lambda rng: split_mesh(rng, 8, 300),
}


@pytest.mark.parametrize("rule", PARTITION_RULES, ids=RULE_NAMES)
@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_over_the_image_owns_every_sample_once(name: str, rule: Any) -> None:
    ones = np.ones((SIZE[1], SIZE[0]), dtype=np.int32)
    for seed in range(2):
        assert gaps_and_doubles(MESHES[name](np.random.default_rng([31, seed])), ones, rule) == (0, 0)


@pytest.mark.parametrize("bits", [4, 12, 16])
@pytest.mark.parametrize("rule", PARTITION_RULES[:3], ids=RULE_NAMES[:3])
def test_partition_on_other_sub_pixel_grids(bits: int, rule: Any) -> None:
    rng = np.random.default_rng(bits)
    ones = np.ones((SIZE[1], SIZE[0]), dtype=np.int32)
    meshes = [split_mesh(rng, bits, 200), delaunay_mesh(rng, 2.0 ** -min(bits, 8), 300), fan_mesh(rng, float(FARTHEST - 16))]
    for vertices in [*meshes, needle_mesh(rng, float(FARTHEST), 1 / 16)]:
        assert gaps_and_doubles(vertices, ones, rule, bits) == (0, 0)


@pytest.mark.parametrize("rule", PARTITION_RULES, ids=RULE_NAMES)
@pytest.mark.parametrize("step", [1.0, 0.5, 1 / 256])
def test_a_mesh_inside_the_image_owns_its_inside_once(rule: Any, step: float) -> None:
    rng = np.random.default_rng(17)
    for _ in range(3):
        points = np.unique(np.rint(rng.uniform(2, 16, (60, 2)) / step) * step, axis=0)
        mesh = Delaunay(points)
        counts = ss.count(shuffled(points[mesh.simplices], rng), SIZE, rule=rule)

        # A sample is strictly inside when it is strictly on one side of every edge of the hull, and may be owned on the hull.
        hull = np.array(points)[mesh.convex_hull]
        centre = points.mean(axis=0)
        x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
        edge = hull[:, 1] - hull[:, 0]

        def side(px: Any, py: Any, start: Floats = hull[:, 0, :, None, None], edge: Floats = edge[..., None, None]) -> Any:
            return edge[:, 0] * (py - start[:, 1]) - edge[:, 1] * (px - start[:, 0])

        distance = side(x, y) * np.sign(side(centre[0], centre[1]))
        assert (counts[(distance > 0).all(axis=0)] == 1).all()
        assert counts.max() == 1
        assert (counts[(distance < 0).any(axis=0)] == 0).all()


def test_planted_faults_break_the_partition() -> None:
    rng = np.random.default_rng(3)
    vertices, ones = delaunay_mesh(rng, 0.5, 400), np.ones((SIZE[1], SIZE[0]), dtype=np.int32)
    assert gaps_and_doubles(vertices, ones, "top-left") == (0, 0)
    gaps, doubles = gaps_and_doubles(vertices, ones, "inclusive")
    assert doubles > 20
    assert gaps == 0
    gaps, doubles = gaps_and_doubles(vertices, ones, "exclusive")
    assert gaps > 20
    assert doubles == 0

    # Flip the rule of half of the triangles, move half of them by 1/128 px, and lose or repeat the largest one.
    half = len(vertices) // 2
    mixed = ss.count(vertices[:half], SIZE) + ss.count(vertices[half:], SIZE, rule="bottom-left")
    assert (mixed != ones).sum() > 10
    moved = np.concatenate([vertices[:half], vertices[half:] + 1 / 128])
    assert sum(gaps_and_doubles(moved, ones, "top-left")) > 20
    largest = int(np.argmax(exact.coverage(vertices, SIZE).sum(axis=(1, 2))))
    assert gaps_and_doubles(np.delete(vertices, largest, axis=0), ones, "top-left")[0] > 0
    assert gaps_and_doubles(np.concatenate([vertices, vertices[largest : largest + 1]]), ones, "top-left")[1] > 0


@pytest.mark.parametrize("rule", PARTITION_RULES[:4], ids=RULE_NAMES[:4])
def test_lattice_parallelogram_identity(rule: Any) -> None:
    # A triangle and its point reflection, over all 16 x 16 sub-pixel shifts, own exactly as many samples as twice the area.
    rng = np.random.default_rng(23)
    shifts = np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=-1).reshape(-1, 1, 1, 2) / 16
    for _ in range(6):
        a, b, c = (rng.integers(40, 100, 2) for _ in range(3))
        doubled_area = abs(int((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])))
        pair = np.array([[a, b, c], [b + c - a, c, b]]) / 16
        vertices = (pair[None] + 6 + shifts).reshape(-1, 3, 2)
        counts = ss.count(vertices, (24, 24), rule=rule, subpixel_bits=4)
        assert int(counts.sum()) == doubled_area


def test_direct3d_golden_triangles() -> None:
    # The document has centres on whole numbers; here they lie half a pixel further.
    upper, lower = np.array([[[0, 0], [5, 0], [5, 5]]]) + 0.5, np.array([[[0, 5], [0, 0], [5, 5]]]) + 0.5
    assert int(ss.count(upper, (8, 8)).sum()) == 15
    assert int(ss.count(lower, (8, 8)).sum()) == 10
    both = ss.count(np.concatenate([upper, lower]), (8, 8))
    assert np.array_equal(both, np.pad(np.ones((5, 5), dtype=np.int32), ((0, 3), (0, 3))))


# Symmetry: what must not change a picture.


def soup(rng: np.random.Generator, count: int = 60) -> Floats:
    """Return triangles on a grid of 1/256 px, half of them on half pixels, some much larger than the image."""
    vertices = np.rint(rng.uniform(-8, 30, (count, 3, 2)) * 256) / 256
    vertices[::2] = np.rint(vertices[::2] * 2) / 2
    vertices[::9] = np.rint(vertices[::9] * 64) - 600
    return vertices


@pytest.mark.parametrize("rule", ["top-left", "bottom-left", "inclusive", "exclusive"])
@pytest.mark.parametrize("shift", [(1, 0), (0, -1), (-17, 12), (20, -15)])
def test_whole_pixel_shifts_and_crops(rule: str, shift: tuple[int, int]) -> None:
    vertices = soup(np.random.default_rng(6))
    whole = ss.count(vertices, (24, 18), rule=rule)
    shifted = ss.count(vertices + np.array(shift), (24, 18), rule=rule)
    dx, dy = shift
    part = shifted[max(0, dy) : 18 + min(0, dy), max(0, dx) : 24 + min(0, dx)]
    assert np.array_equal(part, whole[max(0, -dy) : 18 - max(0, dy), max(0, -dx) : 24 - max(0, dx)])

    # Cut a window out of a picture by drawing the window alone.
    window = ss.count(vertices - (7, 5), (9, 6), rule=rule)
    assert np.array_equal(window, whole[5:11, 7:16])


def test_off_screen_point_moves_with_the_picture() -> None:
    vertices = soup(np.random.default_rng(7))
    whole = ss.count(vertices, (24, 18), rule=ss.OffscreenPoint(-7.5, 2.5))
    moved = ss.count(vertices - (7, 5), (9, 6), rule=ss.OffscreenPoint(-14.5, -2.5))
    assert np.array_equal(moved, whole[5:11, 7:16])


@pytest.mark.parametrize("rule", [*PARTITION_RULES, "inclusive", "exclusive"], ids=[*RULE_NAMES, "inclusive", "exclusive"])
def test_vertex_order_winding_and_triangle_order_change_nothing(rule: Any) -> None:
    rng = np.random.default_rng(9)
    vertices = soup(rng)
    whole = ss.count(vertices, SIZE, rule=rule)
    for turn in (1, 2):
        assert np.array_equal(ss.count(np.roll(vertices, turn, axis=1), SIZE, rule=rule), whole)
    assert np.array_equal(ss.count(vertices[:, ::-1], SIZE, rule=rule), whole)
    assert np.array_equal(ss.count(vertices[::-1], SIZE, rule=rule), whole)
    assert np.array_equal(ss.count(shuffled(vertices, rng), SIZE, rule=rule), whole)
    assert np.array_equal(ss.count(vertices, SIZE, rule=rule, threads=2), ss.count(vertices, SIZE, rule=rule, threads=1))


def test_winding_and_culling_split_the_picture() -> None:
    vertices = soup(np.random.default_rng(12))
    back, front = ss.count(vertices, SIZE, cull="front"), ss.count(vertices, SIZE, cull="back")
    assert np.array_equal(back + front, ss.count(vertices, SIZE))
    assert back.any()
    assert front.any()
    assert np.array_equal(ss.count(vertices[:, ::-1], SIZE, cull="front"), front)


def test_scaling_is_a_change_of_the_sub_pixel_grid() -> None:
    # Two pixels for one, with a bit less: samples fall on other places, so compare the even lattice against shifted halves.
    vertices = soup(np.random.default_rng(13))
    doubled = ss.count(vertices * 2, (48, 36), subpixel_bits=7)
    for x, y in ((0, 0), (1, 0), (0, 1), (1, 1)):
        quarter = ss.count(vertices + np.array([0.25 - x / 2, 0.25 - y / 2]), (24, 18), subpixel_bits=8)
        assert np.array_equal(doubled[y::2, x::2], quarter)


def scene(rng: np.random.Generator, count: int = 40) -> tuple[Floats, NDArray[np.int64]]:
    """Return clip coordinates wholly in front, in perspective, and their triangles."""
    w = rng.uniform(0.5, 4, 3 * count)
    xyz = rng.uniform([-1.4, -1.4, -0.9], [1.4, 1.4, 1.5], (3 * count, 3))
    return np.column_stack([xyz * w[:, None], w]), np.arange(3 * count).reshape(-1, 3)


def test_rasterize_does_not_depend_on_order() -> None:
    rng = np.random.default_rng(14)
    clip, triangles = scene(rng)
    whole = ss.rasterize(clip, triangles, SIZE)
    assert (whole.primitive >= 0).any()
    for turned in (np.roll(triangles, 1, axis=1), np.roll(triangles, 2, axis=1), triangles[:, ::-1]):
        again = ss.rasterize(clip, turned, SIZE)
        assert np.array_equal(again.primitive, whole.primitive)
        assert np.array_equal(again.depth, whole.depth)

    # Permute the triangles and the vertices, and name the primitives back.
    order, places = rng.permutation(len(triangles)), rng.permutation(len(clip))
    again = ss.rasterize(clip[places], np.argsort(places)[triangles[order]], SIZE)
    named = np.where(again.primitive >= 0, order[again.primitive], -1)
    assert np.array_equal(named, whole.primitive)
    assert np.array_equal(again.depth, whole.depth)
    threaded = ss.rasterize(clip, triangles, SIZE, threads=3)
    assert np.array_equal(threaded.primitive, whole.primitive)
    assert np.array_equal(threaded.depth, whole.depth)


def test_neighbours_agree_across_the_near_plane() -> None:
    # A parallelogram in clip space that crosses the near plane and the eye, cut along one diagonal and along the other.
    rng, size = np.random.default_rng(15), (12, 12)
    owned = 0
    for _ in range(40):
        a, b, c = rng.normal(0, 1, (3, 4))
        for vertex in (a, b, c):
            vertex[3] = rng.uniform(-1, 2)
            vertex[2] = rng.uniform(-0.5, 1.5)
        clip = np.array([a, b, c, b + c - a])
        cut, other = [(0, 1, 2), (3, 2, 1)], [(0, 1, 3), (0, 3, 2)]
        covered = [ss.rasterize(clip, np.array([corners]), size).primitive >= 0 for corners in cut]
        counts = covered[0].astype(int) + covered[1]
        if np.linalg.matrix_rank(clip[:, [0, 1, 3]]) < 3:
            continue

        # Of one sheet no ray meets both halves; what lies well inside any half of either cut must be owned.
        assert counts.max() <= 1, clip.tolist()
        for j, i in np.argwhere(counts == 0):
            verdicts = [
                reference.clipped_verdict(clip[list(corners)].tolist(), int(i), int(j), size) for corners in cut + other
            ]
            assert "must" not in [verdict.coverage for verdict in verdicts], (clip.tolist(), i, j)
        owned += int(counts.sum())
    assert owned > 150
