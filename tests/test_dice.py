"""Dicing: watertight, short edges wherever anything is seen, the same picture, and values kept."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry import dice as dicing
from scanspan.geometry.dice import dice
from scanspan.shade.color import encode_srgb, linear_from_srgb8

NAN = float("nan")
QUAD = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
TWO = [(0, 1, 2), (0, 2, 3)]
ABOVE = ss.Camera.orthographic((0, 0, 5), (0, 0, 0), height=2)
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)


def floor(**more: Any) -> ss.Mesh:
    """A square of two triangles that fills the view of ABOVE."""
    return ss.Mesh(QUAD, TWO, **more)


def icosahedron() -> ss.Mesh:
    """Twenty triangles round the origin."""
    g = (1 + 5**0.5) / 2
    points = np.array([p for a in (-1, 1) for b in (-g, g) for p in ((0, a, b), (a, b, 0), (b, 0, a))], float)
    points /= np.sqrt((points**2).sum(axis=1))[:, None]
    near = ((points[:, None] - points[None]) ** 2).sum(axis=2) < 1.2
    found = [
        (i, j, k) for i in range(12) for j in range(12) for k in range(12)
        if i < j < k and near[i, j] and near[j, k] and near[i, k]
    ]  # fmt: skip
    outward = [t if np.linalg.det(points[list(t)]) > 0 else (t[0], t[2], t[1]) for t in found]
    return ss.Mesh(points, outward)


def cube(**more: Any) -> ss.Mesh:
    """Six squares that share no vertex."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    points = corners[np.array(faces)].reshape(-1, 3)
    return ss.Mesh.from_polygons(points, np.arange(24).reshape(6, 4), **more)


def soup(mesh: ss.Mesh) -> ss.Mesh:
    """The same triangles with corners of their own."""
    return ss.Mesh(mesh.positions[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


def edge_counts(mesh: ss.Mesh) -> Counter[tuple[tuple[float, ...], tuple[float, ...]]]:
    """How often each directed edge occurs, by the positions of its ends."""
    places = [tuple(p) for p in (mesh.positions + 0.0).tolist()]
    return Counter((places[t[k]], places[t[(k + 1) % 3]]) for t in mesh.triangles.tolist() for k in range(3))


def assert_closed(mesh: ss.Mesh) -> None:
    """Each edge has one triangle on either side, and they go round it in opposite directions."""
    counts = edge_counts(mesh)
    assert set(counts.values()) == {1}
    assert all((b, a) in counts for a, b in counts)


def triangles_by_place(mesh: ss.Mesh) -> list[list[tuple[float, ...]]]:
    """The triangles as sorted lists of corners, in a fixed order."""
    return sorted(sorted(tuple(p) for p in t) for t in (mesh.positions[mesh.triangles] + 0.0).tolist())


def pixel_lengths(mesh: ss.Mesh, camera: ss.Camera, size: tuple[int, int]) -> np.ndarray[Any, Any]:
    """The lengths of all edges on the screen, (T, 3), by the camera's own projection."""
    seen = camera.project(mesh.positions, size)[mesh.triangles]
    return np.sqrt(((seen - np.roll(seen, 1, axis=1)) ** 2).sum(axis=2))


def visible_boxes(mesh: ss.Mesh, camera: ss.Camera, size: tuple[int, int]) -> np.ndarray[Any, Any]:
    """The larger side, in pixels, of the box round what is seen of each triangle that is seen."""
    number = ss.render(ss.Mesh(mesh.positions, mesh.triangles), camera, size, samples=1).primitive
    rows, columns = np.nonzero(number >= 0)
    boxes = np.full((len(mesh.triangles), 4), -(10**6))
    for k, values in enumerate((columns, -columns, rows, -rows)):
        np.maximum.at(boxes[:, k], number[rows, columns], values)
    sides = np.stack([boxes[:, 0] + boxes[:, 1], boxes[:, 2] + boxes[:, 3]], axis=1) + 1
    return sides[boxes[:, 0] >= 0].max(axis=1)


# Splitting


@pytest.mark.parametrize("fov", [20, 90])
@pytest.mark.parametrize("pixels", [1.5, 4, 40])
def test_a_closed_mesh_in_view_stays_closed_and_gets_short_edges(fov: float, pixels: float) -> None:
    camera, size = ss.Camera.frame(icosahedron_scene(), (1, 2, 3), fov=fov), (60, 45)
    diced = dice(icosahedron(), camera, size, pixels=pixels)
    assert_closed(diced)
    assert pixel_lengths(diced, camera, size).max() <= pixels * (1 + 1e-12)
    assert (np.bincount(diced.triangles.reshape(-1)) > 0).all()
    assert len(diced.positions) - len(diced.triangles) * 3 // 2 + len(diced.triangles) == 2


def icosahedron_scene() -> ss.Scene:
    """The icosahedron as a scene, for framing."""
    return ss.Scene(icosahedron())


def test_edges_that_are_short_already_are_left() -> None:
    mesh = icosahedron()
    diced = dice(mesh, ss.Camera.look_at((0, 0, 5), (0, 0, 0)), (8, 8), pixels=20)
    assert np.array_equal(diced.triangles, mesh.triangles)
    assert np.array_equal(diced.positions, mesh.positions)


def test_no_triangle_is_folded_or_lost() -> None:
    # The vectors of the areas of the parts of a face point the same way and add up to that of the face.
    mesh, camera = icosahedron(), ss.Camera.look_at((0.5, 0.2, 2.2), (0.4, 0, 0), fov=60)
    diced = dice(mesh, camera, (50, 50))
    a, b, c = diced.positions[diced.triangles].transpose(1, 0, 2)
    areas = np.cross(b - a, c - a)
    a, b, c = mesh.positions[mesh.triangles].transpose(1, 0, 2)
    whole = np.cross(b - a, c - a)
    assert ((areas * whole[diced.source]).sum(axis=1) > 0).all()
    sums = np.stack([np.bincount(diced.source, areas[:, k]) for k in range(3)], axis=1)
    assert np.allclose(sums, whole, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("close", [False, True])
def test_the_order_of_listing_changes_nothing(close: bool, rng: np.random.Generator) -> None:
    mesh, size = icosahedron(), (40, 30)
    camera = ss.Camera.look_at((0.3, 0.2, 1.3) if close else (2, 1, 3), (0.2, 0.1, 0), fov=50, far=2.0 if close else None)
    expected = triangles_by_place(dice(mesh, camera, size))
    assert len(expected) > 400
    for _ in range(3):
        order, names = rng.permutation(20), rng.permutation(12)
        triangles = np.argsort(names)[mesh.triangles][order]
        turned = np.take_along_axis(triangles, rng.permuted(np.tile(np.arange(3), (20, 1)), axis=1), axis=1)
        shuffled = ss.Mesh(mesh.positions[names], turned)
        assert triangles_by_place(dice(shuffled, camera, size)) == expected
    assert triangles_by_place(dice(soup(mesh), camera, size)) == expected


def test_a_soup_of_triangles_stays_closed() -> None:
    assert_closed(dice(soup(icosahedron()), ss.Camera.look_at((1, 1, 1.5), (0, 0, 0), fov=70), (50, 50), pixels=3))


def test_the_picture_is_the_same_but_for_samples_on_edges() -> None:
    mesh, size = cube(), (160, 120)
    camera = ss.Camera.look_at((2.5, 2, 3), (0, 0, 0))
    before, after = ss.render(mesh, camera, size), ss.render(dice(mesh, camera, size), camera, size)
    differs = before.primitive != after.primitive
    assert (before.primitive >= 0).sum() > 5000
    assert differs.sum() <= 20

    # Where they differ, an edge of a face runs through the pixel or beside it.
    padded = np.pad(before.primitive, 1, mode="edge")
    around = np.stack([padded[i : i + 120, j : j + 160] for i in range(3) for j in range(3)])
    assert (around.min(axis=0) != around.max(axis=0))[differs].all()


# What is in view


@pytest.mark.parametrize(
    ("eye", "target", "far"),
    [
        ((0, 0, 1), (0, 5, 0), None),
        ((0, 0, 1), (3, 5, 0.9), 40),
        ((0, 0, 0.02), (0, 5, 0), 10),
        ((3, 2, 20), (0, 0, 0), 19),
        ((0, 0, 1), (4, 4, -3), 3),
    ],
)
def test_what_is_seen_of_a_huge_floor_is_fine_and_the_rest_is_coarse(eye: Any, target: Any, far: float | None) -> None:
    mesh = ss.Mesh(1000 * np.array(QUAD, float), TWO)
    camera, size = ss.Camera.look_at(eye, target, up=(0, 0, 1), far=far), (64, 48)
    diced = dice(mesh, camera, size, pixels=4)
    assert visible_boxes(diced, camera, size).max() <= 5
    assert len(diced.triangles) < 8000
    counts = Counter(edge_counts(diced).values())
    assert set(counts) == {1}


def test_a_triangle_that_reaches_into_a_corner_of_the_view_is_split_with_its_neighbours() -> None:
    # Each edge lies beyond a plane of its own (left, bottom, far), and the middle is seen.
    camera, size = ss.Camera.from_matrix(np.eye(4), np.diag([1.0, 1.0, -1.0, 1.0])), (64, 64)
    corner = np.array([-1.0, -1.0, -1.0])
    points = corner + np.array([(2.3, -1, -1), (-1, 2.3, -1), (-1, -1, 2.3)])
    codes = [(p[0] < -1, p[1] < -1, p[2] < -1) for p in points]
    assert all(any(a and b for a, b in zip(codes[i], codes[j])) for i, j in ((0, 1), (1, 2), (2, 0)))
    mesh = ss.Mesh(np.r_[points, points[:2], [(2.0, 2.0, -9.0)]], [(0, 1, 2), (4, 3, 5)])
    diced = dice(mesh, camera, size, pixels=4)
    sides = visible_boxes(diced, camera, size)
    assert len(sides) > 5
    assert sides.max() <= 5
    assert set(edge_counts(diced).values()) == {1}

    # The neighbour has vertices of its own at the shared edge, and the same ones.
    shared = [{tuple(p) for p in diced.positions[diced.triangles[diced.source == k]].reshape(-1, 3).tolist()} for k in (0, 1)]
    a, b = points[:2]
    along = [{p for p in places if np.linalg.norm(np.cross(np.array(p) - a, b - a)) < 1e-9} for places in shared]
    assert len(along[0]) > 2
    assert along[0] == along[1]


@pytest.mark.parametrize(("eye", "target", "far"), [((0, 0, -5), (0, 0, -9), None), ((0, 0, 5), (0, 0, 0), 4.9)])
def test_what_lies_behind_the_eye_or_beyond_the_far_plane_is_left(eye: Any, target: Any, far: float | None) -> None:
    assert len(dice(floor(), ss.Camera.look_at(eye, target, far=far), (64, 64)).triangles) == 2


def test_an_edge_through_the_near_plane_ends() -> None:
    corners, size = [(-1, 0, 5), (1, 0, 5), (0, 0, -5), (0, 1, -5)], (64, 64)
    edge_on, above = ss.Mesh(corners, [(0, 1, 2)]), ss.Mesh(corners, [(0, 1, 3)])
    for mesh, near in ((above, None), (above, 1e-9), (edge_on, 0.5)):
        camera = ss.Camera.look_at((0, 0, 0), (0, 0, -1), near=near)
        diced = dice(mesh, camera, size, pixels=8)
        assert 30 < len(diced.triangles) < 3000
        assert set(edge_counts(diced).values()) == {1}

    # A surface that meets the eye from its edge has no end but the limit.
    with pytest.raises(ss.LimitError):
        dice(edge_on, ss.Camera.look_at((0, 0, 0), (0, 0, -1), near=1e-9), size, pixels=8, max_triangles=10_000)


@pytest.mark.parametrize("scale", [1e-320, 1e-150, 1e150, 1e300])
def test_the_tiny_and_the_huge_end(scale: float) -> None:
    mesh = ss.Mesh(np.array(QUAD) * scale, TWO)
    camera = ss.Camera.from_matrix(np.eye(4), np.diag([min(1 / scale, 1e300), min(1 / scale, 1e300), -1e-300, 1]))
    assert len(dice(mesh, camera, (16, 16), pixels=4).triangles) in range(2, 200)


@pytest.mark.parametrize("last", [(0, 4, 0), (4, 0, 0.5)])
def test_an_edge_without_a_number_in_its_middle_is_left(last: Any) -> None:
    # Out there whole numbers are 4 apart, and so are the corners.
    far_off = 3 * 2.0**53
    mesh = ss.Mesh(np.add([(0, 0, 0), (4, 0, 0), last], (far_off, far_off, 0)), [(0, 1, 2)])
    view = np.eye(4)
    view[:2, 3] = -far_off
    camera = ss.Camera.from_matrix(view, np.diag([0.25, 0.25, -1.0, 1.0]))
    assert pixel_lengths(mesh, camera, (64, 64)).max() >= 32
    assert len(dice(mesh, camera, (64, 64), max_triangles=100).triangles) == 1


def test_an_absurd_length_is_refused_before_anything_is_split(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_split(*arguments: Any) -> Any:
        raise AssertionError("it splits")

    monkeypatch.setattr(dicing, "split", no_split)
    with pytest.raises(
        ss.LimitError, match=r"dice: at least \d{14,} triangles for edges of 1e-06 pixels, the limit is max_tri"
    ):
        dice(floor(), ABOVE, (64, 64), pixels=1e-6)
    with pytest.raises(AssertionError, match="it splits"):
        dice(floor(), ABOVE, (64, 64), pixels=1)


@pytest.mark.parametrize("pixels", [0.7, 1.0, 3.0, 9.0, 40.0])
def test_no_fewer_triangles_come_than_are_needed(pixels: float) -> None:
    for mesh in (floor(), icosahedron()):
        diced = dice(mesh, ABOVE, (64, 64), pixels=pixels)
        view = dicing.make_view(ABOVE, (64, 64), pixels, 10**6)
        assert 0 < dicing.count_needed(dicing.open_mesh(mesh), view) <= len(diced.triangles)


def test_an_empty_mesh_stays_empty() -> None:
    assert len(dice(ss.Mesh([(0, 0, 0)], []), ABOVE, (8, 8), displacement=lambda p, n, uv: p).triangles) == 0


# Values


def test_values_at_vertices_are_carried_over() -> None:
    color = np.array([(200, 9, 0, 255), (50, 255, 0, 55), (0, 0, 255, 0), (7, 8, 9, 77)], np.uint8)
    normal = np.array([(0, 0, 1), (0.6, 0, 0.8), (0, 0, 0), (0, 1, 0)], np.float32)
    mesh = floor(attributes={
        "uv": UV, "color": color, "normal": normal, "heat": np.array([0.1, 0.2, 0.3, NAN], np.float32), "label": [1, 2, 4, 9],
    })  # fmt: skip
    diced = dice(mesh, ABOVE, (8, 8), pixels=6)
    for name, values in mesh.attributes.items():
        assert np.array_equal(diced.attributes[name][:4], values, equal_nan=True)
        assert diced.attributes[name].dtype == (np.float64 if name == "label" else values.dtype)
    assert np.array_equal(diced.positions[:4], mesh.positions)
    assert np.array_equal(diced.attributes["uv"], (diced.positions[:, :2] + 1) / 2)

    # The middle of the first edge: colours are averaged as light, and normals have length one.
    middle = diced.positions.tolist().index([0.0, -1.0, 0.0])
    assert diced.attributes["label"][middle] == 1.5
    light = linear_from_srgb8(color[:2, :3]).mean(axis=0)
    assert diced.attributes["color"][middle].tolist() == [*encode_srgb(light).tolist(), 155]
    expected = np.array([0.3, 0, 0.9]) / np.hypot(0.3, 0.9)
    assert np.allclose(diced.attributes["normal"][middle], expected, atol=1e-7)
    lengths = np.sqrt((diced.attributes["normal"].astype(float) ** 2).sum(axis=1))
    assert np.all((np.abs(lengths - 1) < 1e-6) | (lengths == 0))
    assert lengths[2] == 0


def test_values_at_corners_are_carried_over() -> None:
    heat = np.arange(6).reshape(2, 3)
    color = np.linspace(0, 1, 18).reshape(2, 3, 3)
    normal = np.tile([0.0, 0.0, 2.0], (2, 3, 1))
    diced = dice(floor(corners={"heat": heat, "color": color, "uv": UV[TWO], "normal": normal}), ABOVE, (8, 8), pixels=3)
    assert np.array_equal(diced.corners["uv"], (diced.positions[diced.triangles][..., :2] + 1) / 2)
    assert diced.corners["color"].dtype == np.float32
    for row, triangle in enumerate(TWO):
        for k, vertex in enumerate(triangle):
            at = np.argwhere((diced.triangles == vertex) & (diced.source == row)[:, None])
            assert len(at) > 0
            for t, c in at:
                assert diced.corners["heat"][t, c] == heat[row, k]
                assert diced.corners["normal"][t, c].tolist() == [0, 0, 2]
                assert np.array_equal(diced.corners["color"][t, c, :3], color[row, k].astype(np.float32))

    # Each is affine over its face, so it is what the weights of the corner give.
    x, y = ((diced.positions[diced.triangles][..., :2] + 1) / 2).transpose(2, 0, 1)
    first = diced.source[:, None] == 0
    expected = np.where(first, 0 * (1 - x) + 1 * (x - y) + 2 * y, 3 * (1 - y) + 4 * x + 5 * (y - x))
    assert np.allclose(diced.corners["heat"][..., 0], expected, atol=1e-12)


def test_colours_look_the_same_after_dicing() -> None:
    color = np.array([(155, 10, 40), (30, 255, 60), (70, 90, 255), (205, 180, 220)], np.uint8)
    mesh, size = floor(attributes={"color": color, "normal": [(0, 0, 1)] * 4}), (48, 48)
    before, after = ss.render(mesh, ABOVE, size).color, ss.render(dice(mesh, ABOVE, size), ABOVE, size).color
    assert np.abs(before.astype(int) - after).max() <= 1


def test_faces_keep_their_numbers_and_their_outlines() -> None:
    mesh = ss.Mesh.from_polygons([*QUAD, (3, 0, 0)], [(0, 1), (0, 1, 2, 3), (0,), (1, 4, 2), (0, 4)])
    diced = dice(mesh, ABOVE, (16, 16))
    assert diced.face_count == 5
    assert sorted(set(diced.source.tolist())) == [1, 3]
    middles = diced.positions[diced.triangles].mean(axis=1)
    assert np.array_equal(diced.source == 3, middles[:, 0] > 1)

    # What is left of the edges adds up to the outline.
    ends = diced.positions[diced.triangles]
    lengths = np.sqrt(((ends[:, [1, 2, 0]] - ends[:, [2, 0, 1]]) ** 2).sum(axis=2))
    shown = (diced.inner[:, None] >> np.arange(3) & 1) == 0
    assert np.isclose((lengths * shown)[diced.source == 1].sum(), 8, rtol=1e-12)
    assert np.isclose((lengths * shown)[diced.source == 3].sum(), 2 + 2 * 5**0.5, rtol=1e-12)
