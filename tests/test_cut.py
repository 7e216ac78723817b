"""The cut through a tree of splats, against all nodes looked at one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scanspan as ss
from scanspan.geometry.cut import cut_tree, node_columns, splat_view
from scanspan.records import BoolArray, Float64Array
from tests.splat_trees import HandTree

SIZE = (320, 200)
RANDOM = np.random.default_rng(8)


def ball(count: int) -> Float64Array:
    """Return points on a ball, all as far from its middle."""
    vectors = RANDOM.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


NORMALS = ball(3000)
TREE = HandTree(NORMALS, NORMALS)
COLUMNS = node_columns(TREE.nodes)
CAMERAS = {
    "whole": ss.Camera.look_at((0, 0, 5), (0, 0, 0), fov=30),
    "near": ss.Camera.look_at((0, 0.2, 1.4), (0.1, 0, 0), fov=70),
    "inside": ss.Camera.look_at((0, 0, 0.5), (0, 0.7, 0.7), fov=90),
    "aside": ss.Camera.look_at((0, 3, 1.2), (3, 0, 0), fov=50),
    "parallel": ss.Camera.orthographic((2, 3, 1), (0, 0, 0), height=1.5),
    "far plane": ss.Camera.look_at((0, 0, 5), (0, 0, 0), fov=30, near=4.2, far=4.9),
    "pinhole": ss.Camera.from_opencv([[300, 20, 10.0], [0, 280, 190], [0, 0, 1]], np.diag([1.0, -1, -1]), (0.3, 0, 4), SIZE),
    "matrix": ss.Camera.from_matrix(
        ss.Camera.look_at((4, 1, 0), (0, 0, 0)).view, [[1.2, 0.1, 0.3, 0], [0, 2, 0, 0.1], [0, 0, -1, -0.2], [0, 0, -1, 0]]
    ),
}


def pixels(camera: ss.Camera, points: Float64Array, between_planes: bool = True) -> Float64Array:
    """Return where points appear, NaN behind the eye, and outside of the near and the far plane."""
    clip = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ camera.clip_matrix(SIZE).T
    x, y, z, w = clip.T
    seen = (w > 0) & (((z >= -w) & ((z <= w) | (not camera.has_far))) | (not between_planes))
    with np.errstate(all="ignore"):
        xy = np.stack([(x / w + 1) * SIZE[0] / 2, (1 - y / w) * SIZE[1] / 2], axis=1)
    return np.where(seen[:, None], xy, np.nan)


def in_picture(xy: Float64Array) -> BoolArray:
    """Say which places lie in the picture."""
    with np.errstate(invalid="ignore"):
        return np.asarray((xy[:, 0] >= 0) & (xy[:, 0] < SIZE[0]) & (xy[:, 1] >= 0) & (xy[:, 1] < SIZE[1]))


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("error", [0.0, 1.0, 7.5, 1000.0])
def test_a_cut_covers_every_leaf_once(name: str, error: float) -> None:
    cut = cut_tree(COLUMNS, splat_view(CAMERAS[name], SIZE), error, culls=False)
    drawn = set(cut.nodes.tolist())
    for leaf in TREE.leaves():
        assert len(drawn.intersection(TREE.path(leaf))) == 1
    assert cut.nodes.tolist() == sorted(drawn)
    assert cut.error <= error
    assert cut.splats == sum(len(TREE.points[node]) for node in drawn)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_smaller_error_gives_more_splats(name: str) -> None:
    view = splat_view(CAMERAS[name], SIZE)
    counts = [cut_tree(COLUMNS, view, 0.5 * 2**k, culls=False).splats for k in range(12)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1] or name == "inside"


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("error", [2.0, 10.0, 40.0])
def test_nothing_seen_lies_farther_than_the_error_from_what_is_drawn(name: str, error: float) -> None:
    camera = CAMERAS[name]
    cut = cut_tree(COLUMNS, splat_view(camera, SIZE), error)
    checked = 0
    for node, own in zip(cut.nodes.tolist(), cut.errors.tolist()):
        places, seen = pixels(camera, TREE.points[node], False), pixels(camera, TREE.leaf_points[node])
        for place in seen[in_picture(seen)]:
            near = float(np.nanmin(np.linalg.norm(places - place, axis=1)))
            assert near <= (own + 1e-6 if TREE.nodes["children"][node] else 1e-6)
            checked += 1
    assert checked > 0


@pytest.mark.parametrize("name", CAMERAS)
def test_culling_removes_nothing_that_is_seen(name: str) -> None:
    camera = CAMERAS[name]
    view = splat_view(camera, SIZE)
    whole, culled = (set(cut_tree(COLUMNS, view, 2.0, culls=culls).nodes.tolist()) for culls in (False, True))
    assert culled <= whole
    for node in whole - culled:
        # Every point of every ball in the node lies outside: look at its surface, which holds the outermost.
        directions = np.concatenate([ball(40), np.eye(3), -np.eye(3)])
        radius = TREE.nodes["splat_radius"][node]
        shells = (TREE.points[node][:, None] + radius * directions).reshape(-1, 3)
        assert not in_picture(pixels(camera, shells)).any()
    assert len(culled) < len(whole) or name in ("whole", "far plane", "matrix")


@pytest.mark.parametrize("name", CAMERAS)
def test_what_turns_away_shows_no_front(name: str) -> None:
    camera = CAMERAS[name]
    view = splat_view(camera, SIZE)
    whole, facing = (set(cut_tree(COLUMNS, view, 0.0, culls=False, turns_away=turns).nodes.tolist()) for turns in (False, True))
    assert facing <= whole
    back = whole - facing
    assert len(back) > 20 or name == "inside"
    for node in back:
        points = TREE.leaf_points[node]
        lines = camera.view[2, :3] if camera.is_orthographic else camera.eye - points
        assert ((points * lines).sum(axis=1) < 0).all()


def test_without_normals_nothing_turns_away() -> None:
    columns = node_columns(HandTree(NORMALS).nodes)
    view = splat_view(CAMERAS["whole"], SIZE)
    plain = cut_tree(columns, view, 1.0)
    assert cut_tree(columns, view, 1.0, turns_away=True).nodes.tolist() == plain.nodes.tolist()


@pytest.mark.parametrize("name", CAMERAS)
def test_a_budget_holds_and_is_used(name: str) -> None:
    view = splat_view(CAMERAS[name], SIZE)
    full = cut_tree(COLUMNS, view, 0.25)
    for budget in (16, 17, 100, 700, full.splats - 1):
        cut = cut_tree(COLUMNS, view, 0.25, budget)
        assert cut.splats <= budget
        again = cut_tree(COLUMNS, view, 0.25, budget)
        assert again.nodes.tolist() == cut.nodes.tolist()
        if np.isfinite(cut.error) and cut.error > 0:
            # It is the cut of the error that it says, and the next finer one does not fit.
            assert cut_tree(COLUMNS, view, cut.error).nodes.tolist() == cut.nodes.tolist()
            assert cut_tree(COLUMNS, view, np.nextafter(cut.error, 0)).splats > budget or cut.splats == 0
    assert cut_tree(COLUMNS, view, 0.25, full.splats).nodes.tolist() == full.nodes.tolist()


def test_a_sphere_around_the_eye_has_no_bound() -> None:
    view = splat_view(CAMERAS["inside"], SIZE)
    assert cut_tree(COLUMNS, view, 1e9, 16).error == np.inf
    assert cut_tree(COLUMNS, view, 1e9).error < 1e9


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 50))
def test_a_far_origin_changes_nothing(seed: int, error: float) -> None:
    random = np.random.default_rng(seed)
    origin = np.round(random.uniform(-1e7, 1e7, 3))
    eye = np.round(random.uniform(-4, 4, 3) * 64) / 64 + (0, 0, 9)
    here, there = ss.Camera.look_at(eye, (0, 0, 0)), ss.Camera.look_at(eye + origin, origin)
    cut = cut_tree(COLUMNS, splat_view(there, SIZE, origin), error)
    errors = dict(zip(cut.nodes.tolist(), cut.errors.tolist()))
    other = cut_tree(COLUMNS, splat_view(here, SIZE), error)
    assert errors == pytest.approx(dict(zip(other.nodes.tolist(), other.errors.tolist())), rel=1e-5)


def test_compiled_and_plain_cuts_agree() -> None:
    from scanspan.geometry import cut as module

    view = splat_view(CAMERAS["near"], SIZE)
    expected = cut_tree(COLUMNS, view, 4.0, turns_away=True)
    names = ("visit_nodes", "see_node", "extent_in_sphere", "stretch_at")
    compiled = {name: getattr(module, name) for name in names}
    try:
        for name in names:
            setattr(module, name, compiled[name].py_func)
        plain = cut_tree(COLUMNS, view, 4.0, turns_away=True)
    finally:
        for name in names:
            setattr(module, name, compiled[name])
    assert plain.nodes.tolist() == expected.nodes.tolist()
    assert plain.errors.tolist() == expected.errors.tolist()
