"""Clipping: nothing behind the near plane, no crack where neighbours are cut, weights that give back what was cut."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.geometry.clip import MIN_W, clip_planes, to_screen
from scanspan.raster.algorithms import run
from scanspan.raster.options import make_sampling

SIZE = (48, 36)


def hits_of(clip, triangles, *, bits=8, far=False, rule="top-left"):
    """Count how often each pixel centre is covered by clipped triangles."""
    screen = to_screen(np.asarray(clip, float), np.asarray(triangles, np.int32), SIZE, bits, far)
    sampling = make_sampling(SIZE, (1 << (bits - 1),) * 2, rule=rule, cull="none", subpixel_bits=bits)
    hits = np.zeros(SIZE[::-1], np.int32)
    run("half-space", "rows", "hits", hits, screen, sampling, 1)
    return hits, screen


def floor_grid(rng, rows=9, columns=9, span=6.0):
    """A jittered grid in the plane below the eye, from behind it to far in front: (V, 3) positions and triangles."""
    x, z = np.meshgrid(np.linspace(-span, span, columns), np.linspace(-span, span, rows))
    positions = np.stack([x, np.full_like(x, -0.4), z], axis=-1).reshape(-1, 3)
    positions[:, [0, 2]] += rng.uniform(-0.3, 0.3, (len(positions), 2))
    cell = np.arange((rows - 1) * columns).reshape(rows - 1, columns)[:, :-1].reshape(-1)
    triangles = np.concatenate(
        [np.stack([cell, cell + 1, cell + columns], 1), np.stack([cell + 1, cell + columns + 1, cell + columns], 1)]
    )
    return positions, triangles.astype(np.int32)


def perspective_clip(positions, near=0.1):
    """Clip coordinates for an eye at the origin that looks down -z, 90 degrees high, without a far plane."""
    x, y, z = positions.T
    return np.stack([x * SIZE[1] / SIZE[0], y, -z - 2 * near, -z], axis=1)


@pytest.mark.parametrize("near", [1e-6, 0.1, 1.0])
def test_no_crack_opens_where_a_floor_passes_under_the_eye(rng, near):
    for _ in range(10):
        positions, triangles = floor_grid(rng)
        hits, screen = hits_of(perspective_clip(positions, near), triangles)
        assert (screen.piece >= 0).any()
        assert hits.max() == 1

        # The floor reaches from the near plane to 5 in front, across the whole picture: all rows between are full.
        top = int(np.ceil((0.4 / 4.5 + 1) * SIZE[1] / 2 + 0.5))
        bottom = int(min(SIZE[1], np.floor((0.4 / max(near, 0.4) + 1) * SIZE[1] / 2 - 0.5)))
        assert (hits[top:bottom] == 1).all()


def test_pieces_weigh_their_source(rng):
    clip = rng.normal(size=(300, 4))
    triangles = np.arange(300, dtype=np.int32).reshape(-1, 3)
    screen = to_screen(clip, triangles, SIZE, 8)
    cut = screen.piece >= 0
    assert cut.sum() > 50
    assert (np.diff(screen.source) >= 0).all()
    assert np.allclose(screen.weights.sum(axis=2), 1)
    assert screen.weights.min() >= 0
    for n in np.flatnonzero(cut):
        corners = screen.weights[screen.piece[n]] @ clip[triangles[screen.source[n]]]
        assert (corners[:, 2] + corners[:, 3] >= -1e-12).all()
        assert (corners[:, 3] > 0).all()
        assert np.allclose(screen.clip[screen.corners[n]], corners, rtol=1e-9, atol=1e-12)


def test_interpolation_over_a_cut_triangle_is_that_of_the_whole(rng):
    """World positions interpolated over a floor that is cut lie on the floor, at the sample's line of sight."""
    positions, triangles = floor_grid(rng, 3, 3)
    seen = ss.rasterize(perspective_clip(positions), triangles, SIZE)
    assert seen.counters["cut"] > 0
    found = ss.interpolate(seen, positions)[seen.primitive >= 0]
    y, x = np.nonzero(seen.primitive >= 0)
    assert np.allclose(found[:, 1], -0.4)
    across = (found[:, 0] / -found[:, 2] * SIZE[1] / SIZE[0] + 1) * SIZE[0] / 2
    down = (1 - found[:, 1] / -found[:, 2]) * SIZE[1] / 2
    assert np.abs(across - (x + 0.5)).max() < 1 / 64
    assert np.abs(down - (y + 0.5)).max() < 1 / 64


def test_triangles_behind_at_and_across_the_eye():
    behind = [(0, 0, -2, -1), (1, 0, -2, -1), (0, 1, -2, -1)]
    assert hits_of(behind, [(0, 1, 2)])[0].sum() == 0
    at_the_eye = [(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0)]
    assert hits_of(at_the_eye, [(0, 1, 2)])[0].sum() == 0
    edge_on = [(0, 0, 0, 0), (0, 0, 0, 1), (0, 0, 0.5, 1)]
    assert hits_of(edge_on, [(0, 1, 2)])[0].sum() == 0

    # One corner behind: the visible part opens without end towards the lower edge of the picture.
    across = [(0, 0, 0, 1), (-3, -1, 0.0, -0.5), (3, -1, 0.0, -0.5)]
    hits, screen = hits_of(across, [(0, 1, 2)])
    assert hits.max() == 1
    assert len(screen.corners) >= 1


def test_vertices_that_project_far_away_are_cut_back_to_the_range():
    clip = [(-1e9, -1e9, 0, 1), (1e9, -1e9, 0, 1), (0, 1e9, 0, 1)]
    hits, screen = hits_of(clip, [(0, 1, 2)])
    assert (hits == 1).all()
    assert np.abs(screen.xy).max() <= (1 << 24) * 256
    tiny_w = [(-1, -1, 0, 1e-200), (1, -1, 0, 1e-200), (0, 1, 0, 1e-200)]
    assert hits_of(tiny_w, [(0, 1, 2)])[0].max(initial=0) <= 1


def test_the_far_plane_cuts_only_when_asked_for():
    clip = [(-1, -1, 2, 1), (3, -1, 2, 1), (-1, 3, 2, 1)]
    assert hits_of(clip, [(0, 1, 2)])[0].all()
    assert not hits_of(clip, [(0, 1, 2)], far=True)[0].any()


def test_clipping_is_done_after_once(rng):
    """What was clipped lies inside every plane, so that clipping it again leaves it whole."""
    clip = rng.normal(size=(90, 4))
    screen = to_screen(clip, np.arange(90, dtype=np.int32).reshape(-1, 3), SIZE, 8)
    planes = clip_planes(SIZE, far=False)
    for n in np.flatnonzero(screen.piece >= 0):
        corners = screen.weights[screen.piece[n]] @ clip[3 * screen.source[n] : 3 * screen.source[n] + 3]
        distance = corners @ planes[:, :4].T - planes[:, 4]
        assert distance.min() > -1e-6 * max(1.0, np.abs(corners).max()) * 2**20
    assert MIN_W > 0


@pytest.mark.parametrize("rule", ["inclusive", "exclusive", "top-left", "bottom-left"])
def test_edges_made_by_clipping_are_owned_once(rng, rule):
    """Under any rule the inside of one clipped triangle is covered once: its pieces share their edges top-left."""
    for _ in range(40):
        clip = rng.normal(size=(3, 4)) + np.array([0, 0, 0, 0.5])
        hits, _ = hits_of(clip, [(0, 1, 2)], rule=rule, bits=4)
        assert hits.max(initial=0) <= 1


def test_depth_of_cut_triangles_reaches_one_at_the_near_plane(rng):
    positions, triangles = floor_grid(rng)
    seen = ss.rasterize(perspective_clip(positions, near=0.5), triangles, SIZE, depth_bits=64)
    depth = seen.depth[seen.primitive >= 0]
    assert depth.max() <= 1 + 1e-12
    assert depth.max() > 0.9
