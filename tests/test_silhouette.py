"""Silhouettes of real models against a ray caster: nothing differs but within one sub-pixel of an edge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scanspan as ss

SIZE = (320, 240)


def edge_distances(frame, pixels):
    """Distance in pixels from pixel centres to the nearest projected edge of any triangle, up to 2."""
    scene, camera = frame.scene, frame.camera
    found = np.full(len(pixels), 2.0)
    centres = pixels + 0.5
    for instance in scene.instances:
        world = instance.geometry.positions @ instance.transform[:3, :3].T + instance.transform[:3, 3]
        screen = camera.project(world, SIZE)[instance.geometry.triangles]
        for k in range(3):
            a, b = screen[:, k], screen[:, (k + 1) % 3]
            for i, centre in enumerate(centres):
                along, to = b - a, centre - a
                share = np.clip((to * along).sum(1) / np.maximum((along * along).sum(1), 1e-300), 0, 1)
                away = np.hypot(*(to - share[:, None] * along).T)
                found[i] = min(found[i], away.min())
    return found


def check_silhouette(scene):
    """Compare what is covered with what rays through the pixel centres hit; return how many pixels are covered and differ."""
    trimesh = pytest.importorskip("trimesh")
    embree = pytest.importorskip("trimesh.ray.ray_pyembree")
    frame = ss.render(scene, size=SIZE, samples=1)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].reshape(2, -1)
    inverse = np.linalg.inv(frame.camera.clip_matrix(SIZE))
    ndc = np.stack([(x + 0.5) / SIZE[0] * 2 - 1, 1 - (y + 0.5) / SIZE[1] * 2], axis=1)
    ends = [np.c_[ndc, np.full(len(x), z), np.ones(len(x))] @ inverse.T for z in (-1.0, 0.5)]
    near, far = (end[:, :3] / end[:, 3:] for end in ends)
    hit = np.zeros(len(x), bool)
    for instance in scene.instances:
        world = instance.geometry.positions @ instance.transform[:3, :3].T + instance.transform[:3, 3]
        mesh = trimesh.Trimesh(world, instance.geometry.triangles, process=False)
        hit |= embree.RayMeshIntersector(mesh).intersects_any(near, far - near)
    covered = frame.primitive.reshape(-1) >= 0
    differ = np.flatnonzero(covered != hit)
    if len(differ):
        assert edge_distances(frame, np.stack([x, y], axis=1)[differ]).max() <= 1 / 256
    return int(covered.sum()), len(differ)


def test_the_shipped_model(repository):
    covered, differ = check_silhouette(ss.load(repository / "examples/models/spot.obj"))
    assert covered > 0.2 * SIZE[0] * SIZE[1]
    assert differ < 20


def test_a_wrong_silhouette_is_noticed(repository, monkeypatch):
    scene = ss.load(repository / "examples/models/featuretype.STL")
    moved = ss.Camera.frame(scene, "iso", fit="points", zoom=1.02)
    frame = ss.render(scene, moved, SIZE, samples=1)
    monkeypatch.setattr(ss, "render", lambda *_, **__: Shifted(frame))
    with pytest.raises(AssertionError):
        check_silhouette(scene)


class Shifted:
    """A frame whose picture is one pixel to the right of where its camera says."""

    def __init__(self, frame):
        self.scene, self.camera = frame.scene, frame.camera
        self.primitive = np.roll(frame.primitive, 1, axis=1)


FILES = [
    "ADIS16480.STL", "CesiumMilkTruck.glb", "Duck.glb", "cow.obj", "cycloidal.ply", "featuretype.STL",
    "fuze.zip", "quadknot.obj", "rocker-arm.obj", "suzanne.ply", "teapot.obj", "torus.STL",
]  # fmt: skip


@pytest.mark.parametrize("name", FILES)
@pytest.mark.filterwarnings("ignore")
def test_real_files(shared_data: Path, name: str):
    scene = ss.load(shared_data / "meshes" / name)
    covered, _ = check_silhouette(scene)
    assert 0.2 <= covered / (SIZE[0] * SIZE[1]) <= 0.8
