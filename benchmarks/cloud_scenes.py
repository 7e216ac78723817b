"""The scenes of points in space: ten million on a wavy surface, seen in perspective, each in the one pixel that it falls on.

PC-morton has them along Morton's curve, as surveys are stored once they are cut into tiles, and PC-random in any order, where
nearly every point misses the cache. What is asked for is the depth of the nearest point at each pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.plane_scenes import HD

NAMES = ["PC-morton", "PC-random"]
MORTON_BITS = 16  # along each axis


@dataclass
class CloudScene:
    """Points in space, and how they come to the screen."""

    name: str
    size: tuple[int, int]
    positions: NDArray[np.float32]  # (N, 3)
    view: NDArray[np.float64]  # (4, 4) world to camera, looking down -z
    fov: float  # vertical, degrees
    near: float
    unit: str = "points"
    kind: str = "cloud"

    @property
    def count(self) -> int:
        """The number of points."""
        return len(self.positions)

    @property
    def area(self) -> float:
        """One pixel a point."""
        return float(len(self.positions))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix from the world to (column w, row w, depth w, w); depth is 1 at the near plane and 0 far away."""
        (width, height), focal = self.size, self.size[1] / 2 / np.tan(np.radians(self.fov) / 2)
        lens = np.array([(focal, 0, -width / 2, 0), (0, -focal, -height / 2, 0), (0, 0, 0, self.near), (0, 0, -1, 0)])
        return np.asarray(lens @ self.view)


def place(scene: CloudScene) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return the number of the pixel of each point, -1 outside, and its depth."""
    (width, height), m = scene.size, scene.matrix
    x, y, z = scene.positions.T.astype(np.float64)
    across, down, depth, w = (((row[0] * x + row[1] * y) + row[2] * z) + row[3] for row in m)
    column, row = across / w, down / w
    inside = (w > 0) & (depth <= w) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    pixel = np.where(inside, row, 0).astype(np.int64) * width + np.where(inside, column, 0).astype(np.int64)
    return np.where(inside, pixel, -1), (depth / w).astype(np.float32)


def nearest_depths(scene: CloudScene) -> NDArray[np.float32]:
    """Return the depth of the nearest point at each pixel, 0 where there is none, by sorting."""
    pixel, depth = place(scene)
    order = np.lexsort((depth, pixel))
    last = order[np.diff(pixel[order], append=-2) != 0]
    found = np.zeros(scene.size[0] * scene.size[1], np.float32)
    found[pixel[last]] = np.where(pixel[last] < 0, found[-1], depth[last])
    return found.reshape(scene.size[::-1])


def _spread(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F),
                        (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):  # fmt: skip
        values = (values | values << np.uint64(shift)) & np.uint64(mask)
    return values


def make(name: str, scale: float = 1.0) -> Any:
    """Return the scene of a name in `NAMES`."""
    rng, count = np.random.default_rng(18), max(1, round(10_000_000 * scale))
    x, y = rng.random((2, count))
    places = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y) + 0.002 * rng.random(count)], axis=1)
    if name == "PC-morton":
        steps = ((places - places.min(axis=0)) * ((1 << MORTON_BITS) - 1)).astype(np.uint64)
        code = sum(_spread(steps[:, k]) << np.uint64(k) for k in range(3))
        places = places[np.argsort(code, kind="stable")]

    # Look down at it from beside its middle.
    eye, forward = np.array([0.5, -1.0, 0.9]), np.array([0.0, 1.5, -0.9])
    forward /= np.linalg.norm(forward)
    right = np.array([1.0, 0.0, 0.0])
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return CloudScene(name, HD, places.astype(np.float32), view, 45.0, 0.01)
