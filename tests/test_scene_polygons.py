"""Polygons in a scene: every algorithm paints the same, and the picture is that of the rings, decided one sample at a time.

The oracle projects and snaps the rings and counts, for each sample, the edges left of it; it knows nothing of trapezoids.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.raster import algorithms
from scanspan.triangulation import triangulate_polygon

SIZE = (60, 44)
CAMERA = ss.Camera.look_at((0.7, 0.9, 6.0), (0.1, 0.0, 0.0), fov=38)
OTHERS = [name for name in ss.ALGORITHMS if name != "half-space"]

SQUARE = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])
ARROW = np.array([(-1.6, -1.3, 0.2), (0.1, -0.4, 0.2), (1.5, -1.2, 0.2), (0.2, 1.5, 0.2)])
HOLES = [SQUARE * 1.5, SQUARE * 0.9, SQUARE[::-1] * 0.4 + (0.2, 0.1, 0.0)]
SADDLE = np.array([(-1.5, -1.2, 0.6), (1.4, -1.1, -0.5), (1.3, 1.2, 0.7), (-1.2, 1.1, -0.6)])


def circle(corners: int, radius: float = 1.5, skip: int = 1) -> NDArray[np.float64]:
    """A regular polygon, or a star that crosses itself, in a tilted plane."""
    angle = 0.3 + 2 * np.pi * skip * np.arange(corners) / corners
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([x, y, 0.2 * x - 0.4 * y + 0.1], axis=1)


def turned(axis: int, angle: float) -> NDArray[np.float64]:
    """The matrix of a turn about an axis."""
    matrix = np.eye(4)
    p, q = (axis + 1) % 3, (axis + 2) % 3
    matrix[p, p] = matrix[q, q] = np.cos(angle)
    matrix[p, q], matrix[q, p] = -np.sin(angle), np.sin(angle)
    return matrix


def bar(angle: float) -> NDArray[np.float64]:
    """One of three bars of which each lies over the next: an end in front and an end behind."""
    ring = np.array([(-1.7, 0.4, 0.5), (1.7, 0.4, -0.5), (1.7, 0.8, -0.5), (-1.7, 0.8, 0.5)])
    return ring @ turned(2, angle)[:3, :3].T


def fan(rings: Any) -> ss.Mesh:
    """A Mesh of convex rings."""
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    return ss.Mesh.from_polygons(np.concatenate(rings), [range(a, b) for a, b in itertools.pairwise(starts)])


def scenes() -> dict[str, ss.Scene]:
    """What polygons can be, by name."""
    box = [(x, y, z) for x in (-0.7, 0.7) for y in (-0.8, 0.8) for z in (-0.9, 0.9)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    solid = ss.Instance(ss.Mesh.from_polygons(box, faces), turned(1, 0.5) @ turned(0, 0.4))
    star = circle(5, skip=2)
    colors = [(255, 40, 30), (30, 255, 40), (60, 90, 255)]
    found: dict[str, Any] = {
        "convex": ss.Polygons([circle(7), SQUARE], colors=colors[:2]),
        "concave": ss.Polygons([ARROW]),
        "even-odd": ss.Polygons([star]),
        "non-zero": ss.Polygons([star], fill_rule="non-zero"),
        "holes": ss.Polygons([HOLES], colors=(200, 120, 0, 128)),
        "holes that wind": ss.Polygons([HOLES], fill_rule="non-zero"),
        "both rules": [ss.Polygons([star]), ss.Instance(ss.Polygons([star, HOLES], fill_rule="non-zero"), turned(1, 0.7))],
        "through a mesh": [ss.Polygons([HOLES, star]), solid],
        "through each other": [ss.Instance(ss.Polygons([circle(6), ARROW, HOLES]), turned(k, 0.9)) for k in range(3)],
        "in a cycle": ss.Polygons([bar(2 * np.pi * k / 3) for k in range(3)], colors=colors),
        "twice the same": [ss.Polygons([star, star[::-1], ARROW]), ss.Polygons([ARROW, star])],
        "bent": ss.Polygons([SADDLE, ARROW - (0, 0, 0.4)]),
        "mirrored": [ss.Instance(ss.Polygons([ARROW, HOLES]), np.diag([-1.0, 1, 1, 1]) @ turned(k, 0.8)) for k in (0, 1)],
        "with all kinds": [
            solid, ss.Polygons([HOLES]), ss.Segments([(-2, -1, 1), (2, 1, -1)], [(0, 1)], width=3),
            ss.Points([(0, 0, 1)], size=9),
        ],
        "tiny": ss.Polygons([SQUARE * 0.04 + (x, y, x * y) for x in np.linspace(-1.5, 1.5, 9) for y in (-0.9, 0.05, 0.8)]),
    }  # fmt: skip
    return {name: ss.Scene(parts) for name, parts in found.items()}


SCENES = scenes()
INSIDE = ss.Camera.look_at((0.05, 0.1, 0.55), (0.4, 0.3, -0.8), fov=80, near=0.25)


def crossing() -> ss.Scene:
    """Polygons that reach behind the eye: a floor with a hole, a star, and a wall that crosses itself."""
    floor = np.array([(-3.0, -0.4, -4), (3, -0.5, -4), (3, -0.3, 4), (-3, -0.2, 4)])
    wall = np.array([(-1.0, -2, 3), (-1, 2, -4), (-1, 2, 3), (-1, -2, -4)])
    return ss.Scene([
        ss.Polygons([[floor, 0.4 * floor + (0, -0.21, 0)]], tolerance=0.1),
        ss.Instance(ss.Polygons([circle(5, 3.0, 2)]), turned(0, 1.4)),
        ss.Polygons([wall], fill_rule="non-zero"),
    ])  # fmt: skip


def assert_same(found: ss.Frame, expected: ss.Frame) -> None:
    """Compare two frames bit for bit."""
    assert np.array_equal(found.primitive, expected.primitive)
    assert np.array_equal(found._centre.depth, expected._centre.depth)
    assert np.array_equal(found.color, expected.color)


# Agreement


@pytest.mark.parametrize("name", SCENES)
def test_every_algorithm_paints_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, seen = SCENES[name], 0
    monkeypatch.setattr(algorithms, "SMALL", 0)
    for options in ({"samples": 1}, {"samples": 4, "cull": "back"}, {"samples": 1, "cull": "front", "subpixel_bits": 16}):
        expected = ss.render(scene, CAMERA, SIZE, threads=1, **options)  # type: ignore[call-overload]
        seen += int((expected.primitive >= 0).sum())
        assert_same(ss.render(scene, CAMERA, SIZE, threads=3, **options), expected)  # type: ignore[call-overload]
        for algorithm in OTHERS:
            assert_same(ss.render(scene, CAMERA, SIZE, algorithm=algorithm, **options), expected)  # type: ignore[call-overload]
    assert seen > 20


@pytest.mark.parametrize("algorithm", OTHERS)
def test_polygons_behind_the_eye_look_the_same(algorithm: str) -> None:
    scene, seen = crossing(), set()
    for options in ({"samples": 4}, {"samples": 1, "cull": "back"}, {"samples": 1, "cull": "front"}):
        expected = ss.render(scene, INSIDE, SIZE, **options)  # type: ignore[call-overload]
        seen |= set(np.unique(expected.primitive))
        assert_same(ss.render(scene, INSIDE, SIZE, algorithm=algorithm, **options), expected)  # type: ignore[call-overload]
    assert seen == {-1, 0, 1, 2}


@pytest.mark.parametrize("name", ["through a mesh", "in a cycle", "both rules"])
@pytest.mark.parametrize("algorithm", ["half-space", "homogeneous", "warnock", "micropolygon"])
def test_orders_change_nothing(name: str, algorithm: str) -> None:
    expected = ss.render(SCENES[name], CAMERA, SIZE, samples=1)
    for order in ("serpentine", "hilbert"):
        assert_same(ss.render(SCENES[name], CAMERA, SIZE, samples=1, algorithm=algorithm, order=order), expected)


# The oracle


def inside(rings: Any, transform: Any = None, fill_rule: str = "even-odd", camera: ss.Camera = CAMERA) -> NDArray[np.bool_]:
    """The pixels of a polygon wholly in front: snapped rings, and for each sample the edges that lie left of it or on it."""
    passed, winding = np.zeros((SIZE[1], SIZE[0]), int), np.zeros((SIZE[1], SIZE[0]), int)
    x, y = np.meshgrid(256 * np.arange(SIZE[0]) + 128, 256 * np.arange(SIZE[1]) + 128)
    for ring in rings:
        points = ring if transform is None else ring @ transform[:3, :3].T + transform[:3, 3]
        corners = np.rint(camera.project(points, SIZE) * 256).astype(int)
        for start, end in zip(corners, np.roll(corners, -1, axis=0)):
            (u_x, u_y), (l_x, l_y) = sorted((start.tolist(), end.tolist()), key=lambda corner: corner[1])
            meets = (u_y <= y) & (y < l_y) & ((x - u_x) * (l_y - u_y) >= (y - u_y) * (l_x - u_x))
            passed += meets
            winding += np.where(meets, 1 if start[1] < end[1] else -1, 0)
    return np.asarray((winding if fill_rule == "non-zero" else passed % 2) != 0)


@pytest.mark.parametrize("fill_rule", ["even-odd", "non-zero"])
@pytest.mark.parametrize(
    "rings",
    [[circle(7)], [ARROW], [circle(5, skip=2)], [circle(7, skip=3)], HOLES, [*HOLES, circle(3, 1.2)], [SQUARE, SQUARE]],
    ids=["convex", "concave", "star", "deep star", "holes", "overlap", "twice"],
)
def test_one_polygon_covers_what_its_rings_enclose(rings: Any, fill_rule: str) -> None:
    for transform in (np.eye(4), turned(1, 1.0), turned(0, -0.8) @ np.diag([-1.0, 1, 1, 1])):
        flat = [ring * (1, 1, 0) for ring in rings]
        scene = ss.Instance(ss.Polygons([flat], fill_rule=fill_rule), transform)
        frame = ss.render(scene, CAMERA, SIZE, samples=1)
        assert np.array_equal(frame.primitive >= 0, inside(flat, transform, fill_rule))


def test_a_convex_polygon_is_its_fan() -> None:
    rings = [circle(7), SQUARE - (0.5, 0.2, 0.7), circle(3, 2.0) * (1, 1, -2), np.add(circle(12, 0.3), (1, 1, 0.5))]
    for transform in (np.eye(4), turned(1, 0.9), np.diag([1.0, 1, -1, 1])):
        for cull in ("none", "back", "front"):
            for ring in rings:
                found, expected = (
                    ss.render(ss.Instance(shape, transform), CAMERA, SIZE, samples=1, cull=cull)
                    for shape in (ss.Polygons([ring]), fan([ring]))
                )
                assert np.array_equal(found.primitive, expected.primitive)
        found, expected = (
            ss.render(ss.Instance(shape, transform), CAMERA, SIZE, samples=1) for shape in (ss.Polygons(rings), fan(rings))
        )

        # As corners are snapped, the fan is not quite flat, and another may be seen where two cross.
        assert np.array_equal(found.primitive >= 0, expected.primitive >= 0)
        seen = (found.primitive >= 0) & (found.primitive == expected.primitive)
        assert (found.primitive != expected.primitive).sum() <= 6
        assert np.allclose(found.depth[seen], expected.depth[seen], rtol=3e-4)
        assert np.allclose(found.position[seen], expected.position[seen], atol=3e-3)
        assert np.abs(found.color.astype(int) - expected.color).max() <= 1


def lines_of(rings: Any, camera: ss.Camera) -> NDArray[np.float64]:
    """The lines a x + b y + c over the screen, (a, b) of length 1, of a polygon's edges and of its cut by the near plane."""
    matrix = camera.clip_matrix(SIZE)
    found = []
    for ring in rings:
        clip = np.c_[ring, np.ones(len(ring))] @ matrix.T
        pixels = np.stack(
            [(clip[:, 0] + clip[:, 3]) * SIZE[0] / 2, (clip[:, 3] - clip[:, 1]) * SIZE[1] / 2, clip[:, 3]], axis=1
        )
        found += [np.cross(p, q) for p, q in zip(pixels, np.roll(pixels, -1, axis=0))]
        found.append(np.linalg.solve(pixels[:3], clip[:3, 2] + clip[:3, 3]))
    lines = np.array(found)
    return np.asarray(lines / np.hypot(lines[:, 0], lines[:, 1])[:, None])


@pytest.mark.parametrize("cull", ["none", "back", "front"])
def test_a_polygon_that_reaches_behind_the_eye_is_its_triangles_but_for_a_hair(cull: str) -> None:
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    covered = 0
    for k in range(8):
        ring = np.array([(-3.0, -0.4, -4), (0.2, -0.3, 0.5), (3, -0.5, -4), (2.5, -0.6, 4), (-2.7, -0.2, 4)])
        ring = (ring * (1, 0, 1)) @ turned(2, 0.8 * k)[:3, :3].T + (0.05, 0.1 - 0.3 * (-1) ** k, 0.3)
        seen = np.delete(ring, int(np.argmax(np.abs(np.cross(ring[1] - ring[0], ring[2] - ring[0])))), axis=1)
        mesh = ss.Mesh(ring, triangulate_polygon(seen))
        found, expected = (ss.render(shape, INSIDE, SIZE, samples=1, cull=cull) for shape in (ss.Polygons([ring]), mesh))
        differs = (found.primitive >= 0) != (expected.primitive >= 0)
        distance = np.abs(np.stack([a * x + b * y + c for a, b, c in lines_of([ring], INSIDE)])).min(axis=0)
        assert (distance[differs] <= 1 / 128).all()
        both = (found.primitive >= 0) & ~differs
        covered += int(both.sum())
        assert np.allclose(found.depth[both], expected.depth[both], rtol=1e-2)
        error = np.linalg.norm(INSIDE.project(found.position[both], SIZE) - np.stack([x, y], axis=-1)[both], axis=1)
        assert (error < 0.05).all()
    assert covered > 600


# What is seen


def test_the_front_is_where_the_ring_turns_left() -> None:
    front = ss.Camera.look_at((0, 0, 6), (0, 0, 0))
    for ring in (SQUARE, ARROW, circle(9)):
        for shape, is_front in ((ss.Polygons([ring]), True), (ss.Polygons([ring[::-1]]), False)):
            shown = [(ss.render(shape, front, SIZE, samples=1, cull=cull).primitive >= 0).any() for cull in ("back", "front")]
            assert shown == [is_front, not is_front]

    # A mirror turns left into right and the front into the front of what is seen in it; of several rings the largest decides.
    mirror = np.diag([-1.0, 1, 1, 1])
    for shape, is_front in (
        (ss.Instance(ss.Polygons([ARROW]), mirror), True),
        (ss.Instance(ss.Polygons([ARROW[::-1]]), mirror), False),
        (ss.Instance(fan([SQUARE]), mirror), True),
        (ss.Polygons([[HOLES[2], HOLES[0]]]), True),
        (ss.Polygons([[HOLES[2][::-1], HOLES[0][::-1]]]), False),
    ):
        frame = ss.render(shape, front, SIZE, samples=1, cull="back")
        assert (frame.primitive >= 0).any() == is_front
        frame = ss.render(shape, front, SIZE, samples=1)
        assert (frame.normal[frame.primitive >= 0][:, 2] > 0).all() == is_front


@pytest.mark.parametrize("name", ["convex", "holes", "both rules", "mirrored", "twice the same", "bent"])
def test_fields_describe_the_plane(name: str) -> None:
    scene, (x, y) = SCENES[name], np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    frame = ss.render(scene, CAMERA, SIZE, samples=1)
    seen = frame.primitive >= 0
    assert (frame.object >= 0).tolist() == seen.tolist()
    assert np.isnan(frame.position[~seen]).all()
    assert not frame.normal[~seen].any()
    assert not frame.barycentric[~seen].any()
    assert np.isposinf(frame.depth[~seen]).all()
    assert np.isnan(frame.uv).all()
    assert np.abs(frame._weights[seen].sum(axis=1) - 1).max() < 1e-12
    assert np.allclose(frame.barycentric[seen].sum(axis=1), 1, atol=1e-5)
    assert np.allclose(np.linalg.norm(frame.normal[seen], axis=1), 1, atol=1e-6)
    assert np.allclose(frame.depth[seen], CAMERA.depth(frame.position[seen]), rtol=1e-6)
    off = np.linalg.norm(CAMERA.project(frame.position[seen], SIZE) - np.stack([x, y], axis=-1)[seen], axis=1)
    assert off.max() < 0.02

    # Every point lies in the plane of a piece of its polygon, and its weights are those of that piece's reference corners.
    for k, (instance, first) in enumerate(zip(scene.instances, scene.first_primitive)):
        polygons = instance.geometry
        assert isinstance(polygons, ss.Polygons)
        matrix, turn = instance.transform[:3, :3], instance.transform[:3, 3]
        for number in range(polygons.count):
            at = frame.primitive == first + number
            assert (frame.object[at] == k).all()
            errors, misses, bends = [], [], []
            for corners in polygons.reference[polygons.source == number]:
                p, q, r = polygons.positions[corners] @ matrix.T + turn
                normal = np.cross(q - p, r - p) * np.sign(np.linalg.det(matrix))
                normal /= np.linalg.norm(normal)
                errors.append(np.abs((frame.position[at] - p) @ normal))
                misses.append(
                    np.abs(frame.barycentric[at].astype(float) @ np.stack([p, q, r]) - frame.position[at]).max(axis=1)
                )
                bends.append(np.abs(frame.normal[at] - normal).max(axis=1))
            assert (np.min(errors, axis=0) < 1e-9).all()
            assert (np.min(misses, axis=0) < 1e-5).all()
            assert (np.min(bends, axis=0) < 1e-6).all()


def test_equal_depths_go_to_the_lower_number() -> None:
    star = circle(5, skip=2)
    for first, second in (([star], [star]), ([star, star], [star, star]), ([HOLES], [HOLES, ARROW - (0, 0, 0.4)])):
        frame = ss.render(ss.Scene([ss.Polygons(first), ss.Polygons(second)]), CAMERA, SIZE)
        assert set(np.unique(frame.primitive)) - {2} == {-1, 0}
    level = np.add(SQUARE, (0, 0, 0.5))
    facing = ss.Camera.orthographic((0, 0, 5), (0, 0, 0), height=4)
    scene = ss.Scene([ss.Polygons([level * (1, 0.5, 1), level]), ss.Polygons([level * (2, 1, 1)])])
    frame = ss.render(scene, facing, SIZE)
    assert [(frame.primitive == k).any() for k in range(3)] == [True] * 3
    assert np.array_equal(frame.primitive == 0, inside([level * (1, 0.5, 1)], camera=facing))
    assert np.array_equal((frame.primitive == 0) | (frame.primitive == 1), inside([level], camera=facing))


def test_each_bar_of_a_cycle_lies_over_the_next() -> None:
    frame = ss.render(SCENES["in a cycle"], ss.Camera.look_at((0, 0, 6), (0, 0, 0)), (120, 120), samples=1)
    alone = [
        ss.render(ss.Polygons([bar(2 * np.pi * k / 3)]), frame.camera, (120, 120), samples=1).primitive >= 0 for k in range(3)
    ]
    shown = []
    for k in range(3):
        common = alone[k] & alone[(k + 1) % 3]
        assert common.any()
        shown.append(np.unique(frame.primitive[common]).tolist())
    assert shown in ([[0], [1], [2]], [[1], [2], [0]])


def test_colors_are_by_polygon() -> None:
    squares = [0.4 * SQUARE + (x, 0, 0) for x in (-1.5, -0.5, 0.5, 1.5)]
    squares[1] = squares[1][:2]
    shape = ss.Polygons(
        [*squares, 2 * SQUARE - (0, 0, 1)], colors=[(255, 0, 0), (1, 1, 1), (0, 255, 0), (0, 0, 255), (0, 0, 0)]
    )
    frame = ss.render(shape, CAMERA, SIZE, background="white")
    assert set(np.unique(frame.primitive)) == {-1, 0, 2, 3, 4}
    for number, strongest in ((0, 0), (2, 1), (3, 2)):
        colors = frame.color[frame.primitive == number].astype(int)
        inner = np.median(colors, axis=0)
        assert inner[strongest] > 2 * max(np.delete(inner[:3], strongest))
    one = ss.render(ss.Polygons(squares, colors=(255, 0, 0, 255)), CAMERA, SIZE, background="black", samples=1)
    assert one.color[one.primitive >= 0][:, 0].min() > 50
    assert not one.color[..., 1:3].any() or one.color[..., 1:3].max() < one.color[..., 0].max()


def test_a_bent_polygon_is_cut_and_keeps_its_number() -> None:
    polygons = ss.Polygons([SADDLE, ARROW - (0, 0, 3)])
    assert polygons.source.tolist() == [0, 0, 1]
    frame = ss.render(polygons, CAMERA, SIZE, samples=1)
    triangles = [polygons.positions[a:b] for a, b in zip(polygons.ring_starts[:2], polygons.ring_starts[1:3])]
    mesh = ss.render(fan(triangles), CAMERA, SIZE, samples=1)
    assert np.array_equal(frame.primitive == 0, mesh.primitive >= 0)
    assert np.allclose(frame.position[frame.primitive == 0], mesh.position[frame.primitive == 0], atol=1e-9)


def test_numbers_run_through_all_kinds() -> None:
    small = 0.3 * SQUARE
    mesh = fan([np.add(small, (x, 1.2, 0)) for x in (-1.5, -0.5)])
    polygons = ss.Polygons([np.add(small, (-1.5, 0, 0)), small[:2], np.add(small, (0.5, 0, 0))])
    lines = ss.Segments([(-1.5, -1, 0), (-1, -1, 0), (0, -1, 0), (0.5, -1, 0)], [(0, 1), (2, 3)], width=3)
    points = ss.Points([(1.5, 1.2, 0), (1.5, -1, 0)], size=5)
    parts = {"mesh": mesh, "polygons": polygons, "lines": lines, "points": points}
    for order in (["mesh", "polygons", "lines", "points"], ["points", "polygons", "mesh", "lines", "polygons"]):
        scene = ss.Scene([ss.Instance(parts[name], np.diag([1, 1, 1, 1.0])) for name in order])
        frame = ss.render(scene, ss.Camera.look_at((0, 0, 6), (0, 0, 0)), (120, 90), samples=1)
        counts = {"mesh": 2, "polygons": 3, "lines": 2, "points": 2}
        firsts = np.cumsum([0, *(counts[name] for name in order)])
        assert scene.first_primitive == tuple(firsts)
        expected = {-1: -1}
        for k, name in enumerate(order):
            if name != "polygons" or k < 2:
                expected.update({firsts[k] + n: k for n in range(counts[name]) if (name, n) != ("polygons", 1)})
        found = {int(number): set(frame.object[frame.primitive == number].tolist()) for number in np.unique(frame.primitive)}
        assert found == {number: {k} for number, k in expected.items()}


@pytest.mark.parametrize(
    "nothing", [[], [[]], [SQUARE[:2]], [SQUARE[[0, 1, 0]]]], ids=["none", "no ring", "two points", "a line"]
)
def test_polygons_without_area_draw_nothing(nothing: Any) -> None:
    empty = ss.Polygons(nothing)
    for algorithm in ss.ALGORITHMS:
        frame = ss.render(empty, CAMERA, SIZE, algorithm=algorithm)
        assert (frame.primitive == -1).all()
        assert np.isposinf(frame.depth).all()
        assert frame.normal.shape == (SIZE[1], SIZE[0], 3)
    both = ss.render(ss.Scene([empty, fan([SQUARE])]), CAMERA, SIZE, samples=1)
    assert set(np.unique(both.primitive)) == {-1, empty.count}


def test_what_lies_off_the_picture_or_behind_the_eye_draws_nothing() -> None:
    for shift in ((50, 0, 0), (0, 0, 20), (0, -1e6, 0)):
        frame = ss.render(ss.Polygons([circle(5, skip=2) + shift, HOLES + np.array(shift)]), CAMERA, SIZE)
        assert (frame.primitive == -1).all()
    far = ss.Camera.look_at((0, 0, 6), (0, 0, 0), far=5.0)
    assert (ss.render(ss.Polygons([SQUARE]), far, SIZE).primitive == -1).all()
