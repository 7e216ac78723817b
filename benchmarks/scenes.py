"""The scenes of triangles: flat and shaded ones of three sizes, a mesh of two sizes, and one; plane_scenes has the others.

A has a million triangles of 8 px, B a hundred thousand of 200 px, C two thousand of 50,000 px, all inside the image and painted
in order, the later over the earlier. D, E and F are the same with a colour at each corner, and G, H and I have a random depth
there as well, in any order. M are meshes in perspective with depth: a torus knot, and a model whose triangles are cut into
n x n with waves laid over them. T is one triangle in a small image, where the overhead of a call shows. Everything is made from
fixed seeds; `scale` changes the number of triangles and little else.

Corners of flat triangles lie on a grid of 1/256 px, so that all with 8 sub-pixel bits or more are asked the same question.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Name: number of triangles, mean area in pixels, seed.
FLAT = {"A": (1_000_000, 8.0, 1), "B": (100_000, 200.0, 2), "C": (2_000, 50_000.0, 3)}
# Name: steps along the knot and around the tube; two triangles each.
KNOTS = {"M100k": (500, 100), "M1M": (2000, 250)}
# Into how many parts each edge of the model is cut.
MODELS = {"M211k": 6, "M843k": 12}
# Shaded scenes, those with depth, and the flat ones whose triangles they have.
SHADED = {"D": "A", "E": "B", "F": "C"}
DEEP = {"G": "A", "H": "B", "I": "C"}
NAMES = [*FLAT, *SHADED, *DEEP, *KNOTS, *MODELS, "T"]
MODEL = Path(__file__).resolve().parent.parent / "examples" / "models" / "spot.obj"
GRID = 256  # sub-pixels in a pixel

MEAN_SHARE = 0.4775  # Mean area of a triangle with random corners on a circle, as a share of the radius squared: 3 / (2 pi).


@dataclass
class FlatScene:
    """Triangles in pixels with a colour each, painted in order."""

    name: str
    size: tuple[int, int]
    vertices: NDArray[np.float32]  # (N, 3, 2) pixels, y down, centres at + 1/2
    colors: NDArray[np.uint8]  # straight RGBA; (N, 4), or (N, 3, 4) with a colour for each corner
    unit: str = "triangles"
    depths: NDArray[np.float32] | None = None  # (N, 3), 0 near to 1 far; what is nearer is seen, instead of what is later

    @property
    def kind(self) -> str:
        """What is asked of a peer."""
        if self.depths is not None:
            return "deep"
        return "flat" if self.colors.ndim == 2 else "shaded"

    @property
    def count(self) -> int:
        """The number of triangles."""
        return len(self.vertices)

    @property
    def area(self) -> float:
        """The sum of the areas in pixels, what is painted over included."""
        return float(np.abs(_doubled_areas(self.vertices.astype(np.float64))).sum() / 2)


@dataclass
class MeshScene:
    """A mesh with the camera that looks at it."""

    name: str
    size: tuple[int, int]
    positions: NDArray[np.float32]  # (V, 3)
    triangles: NDArray[np.int32]  # (N, 3)
    view: Floats  # (4, 4) world to camera, looking down -z
    fov: float  # vertical, radians
    near: float
    far: float
    unit: str = "triangles"
    kind: str = "mesh"

    @property
    def count(self) -> int:
        """The number of triangles."""
        return len(self.triangles)

    @property
    def matrix(self) -> Floats:
        """The matrix from the world to clip space."""
        tangent = 1 / np.tan(self.fov / 2)
        projection = np.zeros((4, 4))
        projection[0, 0], projection[1, 1] = tangent * self.size[1] / self.size[0], tangent
        projection[2, 2] = (self.far + self.near) / (self.near - self.far)
        projection[2, 3] = 2 * self.far * self.near / (self.near - self.far)
        projection[3, 2] = -1
        return np.asarray(projection @ self.view)

    @property
    def area(self) -> float:
        """The sum of the areas on the screen in pixels, hidden ones included."""
        clip = np.column_stack([self.positions.astype(np.float64), np.ones(len(self.positions))]) @ self.matrix.T
        screen = clip[:, :2] / clip[:, 3:] * np.array(self.size) / 2
        return float(np.abs(_doubled_areas(screen[self.triangles])).sum() / 2)


Scene = FlatScene | MeshScene


def _doubled_areas(vertices: Floats) -> Floats:
    a, b, c = vertices[:, 0], vertices[:, 1], vertices[:, 2]
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def flat_scene(name: str, scale: float = 1.0) -> FlatScene:
    """Return triangles with corners on random circles that lie inside a picture of 1920 x 1080."""
    full_count, mean_area, seed = FLAT[name]
    rng, size, count = np.random.default_rng(seed), (1920, 1080), max(1, round(full_count * scale))

    # Choose circles that give the mean area, of sizes that vary by about two, wholly inside the image.
    radius = np.sqrt(mean_area / MEAN_SHARE) * rng.uniform(0.6, 1.35, count)
    radius = np.minimum(radius, (min(size) - 2) / 2)[:, None]
    centre = 1 + radius + rng.random((count, 2)) * (np.array(size) - 2 - 2 * radius)
    angle = rng.random((count, 3)) * 2 * np.pi
    corners = np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    # Scale all by one factor so that the mean is exact, as far as they stay inside.
    factor = np.sqrt(2 * mean_area / np.abs(_doubled_areas(corners * radius[..., None])).mean())
    vertices = centre[:, None] + corners * radius[..., None] * factor
    vertices = (np.rint(np.clip(vertices, 0, np.array(size)) * GRID) / GRID).astype(np.float32)
    colors = rng.integers(0, 256, (count, 4), dtype=np.uint8)
    colors[:, 3] = 255
    return FlatScene(name, size, vertices, colors)


def shaded_scene(name: str, scale: float = 1.0) -> FlatScene:
    """Return the triangles of a flat scene with a colour at each corner."""
    scene = flat_scene(SHADED[name], scale)
    colors = np.random.default_rng(FLAT[SHADED[name]][2] + 3).integers(0, 256, (scene.count, 3, 4), dtype=np.uint8)
    colors[..., 3] = 255
    return FlatScene(name, scene.size, scene.vertices, colors)


def deep_scene(name: str, scale: float = 1.0) -> FlatScene:
    """Return the triangles of a flat scene with a colour and a depth at each corner."""
    rng, scene = np.random.default_rng(FLAT[DEEP[name]][2] + 6), flat_scene(DEEP[name], scale)
    colors = rng.integers(0, 256, (scene.count, 3, 4), dtype=np.uint8)
    colors[..., 3] = 255
    depths = rng.random((scene.count, 3)).astype(np.float32)
    return FlatScene(name, scene.size, scene.vertices, colors, depths=depths)


def one_triangle() -> FlatScene:
    """Return one triangle in a picture of 256 x 256."""
    vertices = np.array([[[20.25, 30.5], [230.75, 60.25], [90.5, 220.75]]], dtype=np.float32)
    return FlatScene("T", (256, 256), vertices, np.array([[255, 128, 0, 255]], dtype=np.uint8))


def _curve(t: NDArray[Any]) -> Floats:
    """Return points of the (2, 3) torus knot."""
    ring = 2 + np.cos(3 * t)
    return np.asarray(np.stack([ring * np.cos(2 * t), ring * np.sin(2 * t), np.sin(3 * t)], axis=-1) / 3)


def torus_knot(along: int, around: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices and triangles of a closed tube along a torus knot, triangles facing outwards."""
    t = np.arange(along) * (2 * np.pi / along)
    phi = np.arange(around) * (2 * np.pi / around)

    # Carry a frame along the curve: its tangent, and two directions across.
    tangent, bend = _curve(t + 1e-4) - _curve(t - 1e-4), _curve(t + 1e-3) + _curve(t - 1e-3)
    side = np.cross(tangent, bend)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, tangent)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    radius = 0.17 + 0.014 * np.sin(24 * t[:, None] + 5 * phi)
    across = np.cos(phi)[None, :, None] * up[:, None] + np.sin(phi)[None, :, None] * side[:, None]
    positions = _curve(t)[:, None] + radius[..., None] * across

    # Join each ring to the next with two triangles a step.
    i, j = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a, b = i * around + j, (i + 1) % along * around + j
    c, d = (i + 1) % along * around + (j + 1) % around, i * around + (j + 1) % around
    triangles = np.concatenate([np.stack([a, c, b], axis=-1), np.stack([a, d, c], axis=-1)]).reshape(-1, 3)
    return positions.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32)


def _look_at(eye: Floats, target: Floats) -> Floats:
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = np.stack([right, np.cross(right, forward), -forward])
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def mesh_scene(name: str, scale: float = 1.0) -> MeshScene:
    """Return a torus knot that fills most of the height of a picture of 1920 x 1080."""
    along, around = KNOTS[name]
    positions, triangles = torus_knot(max(8, round(along * scale**0.5)), max(4, round(around * scale**0.5)))
    view = _look_at(np.array([0.2, -0.5, 3.2]), np.zeros(3))
    return MeshScene(name, (1920, 1080), positions, triangles, view, float(np.radians(45)), 0.5, 6.0)


def read_model() -> tuple[Floats, NDArray[np.int64]]:
    """Return the vertices (V, 3) and triangles (T, 3) of the model; faces of four corners are cut along a diagonal."""
    rows = [line.split() for line in MODEL.read_text(encoding="utf-8").splitlines()]
    positions = np.array([row[1:4] for row in rows if row and row[0] == "v"], dtype=np.float64)
    faces = [[int(corner.split("/")[0]) - 1 for corner in row[1:]] for row in rows if row and row[0] == "f"]
    return positions, np.array([(face[0], *pair) for face in faces for pair in pairwise(face[1:])])


def model_scene(name: str, scale: float = 1.0) -> MeshScene:
    """Return the model, each triangle cut into n x n, that fills most of the height of a picture of 1920 x 1080."""
    parts = max(1, round(MODELS[name] * scale**0.5))
    positions, triangles = read_model()
    i, j = (index.ravel() for index in np.meshgrid(np.arange(parts + 1), np.arange(parts + 1), indexing="ij"))
    number = np.full((parts + 1, parts + 1), -1)
    number[i[i + j <= parts], j[i + j <= parts]] = np.arange((i + j <= parts).sum())
    weights = np.stack([parts - i - j, i, j], axis=1)[i + j <= parts] / parts
    cut = [
        corners
        for a in range(parts)
        for b in range(parts - a)
        for corners in ([(a, b), (a + 1, b), (a, b + 1)], [(a + 1, b), (a + 1, b + 1), (a, b + 1)])[: 1 + (a + b < parts - 1)]
    ]
    pattern = np.array([[number[corner] for corner in corners] for corners in cut])

    # Weld the corners that triangles share, in the order in which they come first.
    placed = np.einsum("mk,tkc->tmc", weights, positions[triangles]).reshape(-1, 3)
    indices = (pattern + len(weights) * np.arange(len(triangles))[:, None, None]).reshape(-1, 3)
    _, first, same = np.unique(np.rint(placed * 1e7).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    placed, indices = placed[first[order]], rank[same.reshape(-1)][indices]

    # Bring it to one size, and lay waves over it.
    placed -= (placed.max(axis=0) + placed.min(axis=0)) / 2
    placed /= np.linalg.norm(placed, axis=1).max()
    placed *= 1 + 0.004 * np.sin(placed * (60, 71, 53)).prod(axis=1)[:, None]
    view = _look_at(np.array([1.0, 0.45, 2.0]), np.zeros(3))
    return MeshScene(
        name, (1920, 1080), placed.astype(np.float32), indices.astype(np.int32), view, float(np.radians(45)), 0.5, 5.0
    )


def make(name: str, scale: float = 1.0) -> Any:
    """Return the scene of a name in `NAMES`."""
    makers = ((FLAT, flat_scene), (SHADED, shaded_scene), (DEEP, deep_scene), (KNOTS, mesh_scene), (MODELS, model_scene))
    for names, maker in makers:
        if name in names:
            return maker(name, scale)
    return one_triangle()
