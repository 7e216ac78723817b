"""The other scenes of the 2-D side: lines, polygons, points, a flood fill, triangulation and many polygons at once.

L has a million coloured segments, LA the same antialiased. PS is a star of 10,000 corners and PX a closed walk of 2,000 corners
that crosses itself thousands of times, each by pixel centres and by area. Q2 has ten million points to count. FF fills round
1,500 discs. TRI has polygons with holes to cut into triangles, MP ten thousand polygons to burn or to measure into one image.

Coordinates lie on a grid of 1/256 px (TRI: of 1/65536, with more corners than 1/256 can tell apart), so all are asked the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import GRID

Floats = NDArray[np.float64]

HD, SQUARE = (1920, 1080), (4096, 4096)
# Name: fill rule, and whether shares of pixels are wanted.
POLYGONS = {
    "PS-center": ("non-zero", False),
    "PS-area": ("non-zero", True),
    "PX-even-odd": ("even-odd", False),
    "PX-non-zero": ("non-zero", False),
    "PX-even-odd-area": ("even-odd", True),
    "PX-non-zero-area": ("non-zero", True),
}
# Name: corners, holes.
CUT = {"TRI1k": (1_000, 10), "TRI100k": (100_000, 100)}
NAMES = ["L", "LA", *POLYGONS, "Q2", "FF", *CUT, "MP-ids", "MP-area"]
CHECKED_LINES = 400  # Lines of LA that are compared: an exact picture of a million blended in order would take an hour.


@dataclass
class LineScene:
    """Segments with a colour each, painted in order over opaque black."""

    name: str
    size: tuple[int, int]
    segments: NDArray[np.float32]  # (N, 2, 2) pixels
    colors: NDArray[np.uint8]  # (N, 4) straight RGBA
    kind: str  # "lines" or "smooth lines"
    unit: str = "segments"

    @property
    def count(self) -> int:
        """The number of segments."""
        return len(self.segments)

    @property
    def area(self) -> float:
        """The pixels that lines one pixel wide have, counted along the longer axis."""
        return float(np.abs(self.segments[:, 1] - self.segments[:, 0]).max(axis=1).sum())


@dataclass
class PolygonScene:
    """One polygon of one ring."""

    name: str
    size: tuple[int, int]
    ring: Floats  # (M, 2) pixels
    fill_rule: str
    kind: str  # "polygon" or "smooth polygon"
    unit: str = "corners"

    @property
    def count(self) -> int:
        """The number of corners."""
        return len(self.ring)

    @property
    def area(self) -> float:
        """The pixels of the image, which all have to be told."""
        return float(self.size[0] * self.size[1])


@dataclass
class PointScene:
    """Points to count in the pixels that they fall on."""

    name: str
    size: tuple[int, int]
    x: NDArray[np.float32]  # (N,) pixels
    y: NDArray[np.float32]
    kind: str = "points"
    unit: str = "points"

    @property
    def count(self) -> int:
        """The number of points."""
        return len(self.x)

    @property
    def area(self) -> float:
        """One pixel a point."""
        return float(len(self.x))


@dataclass
class FloodScene:
    """A grey image, a seed, and the value that the region of the seed shall have."""

    name: str
    size: tuple[int, int]
    image: NDArray[np.uint8]  # (H, W)
    seed: tuple[int, int]  # x, y
    value: int
    kind: str = "flood"
    unit: str = "fill"
    count: int = 1

    @property
    def area(self) -> float:
        """The pixels that have the colour of the seed."""
        return float((self.image == self.image[self.seed[1], self.seed[0]]).sum())


@dataclass
class RingsScene:
    """Polygons: one with holes to be cut into triangles, or many to be burnt or measured, as rings in one array."""

    name: str
    size: tuple[int, int]
    points: Floats  # (V, 2) pixels
    starts: NDArray[np.int64]  # (rings + 1,)
    kind: str  # "triangulation", "burn" or "measure"
    unit: str

    @property
    def count(self) -> int:
        """Corners where triangles are made, else polygons."""
        return len(self.points) if self.kind == "triangulation" else len(self.starts) - 1

    @property
    def rings(self) -> list[Floats]:
        """The rings one by one."""
        return [self.points[start:end] for start, end in zip(self.starts[:-1], self.starts[1:], strict=True)]

    @property
    def area(self) -> float:
        """The sum of the signed areas of the rings."""
        return float(sum(_signed_area(ring) for ring in self.rings))


def _signed_area(ring: Floats) -> float:
    x, y = ring.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def _on_grid(points: Any, steps: int = GRID) -> Floats:
    return np.asarray(np.rint(np.asarray(points, np.float64) * steps) / steps)


def _line_scene(name: str, scale: float) -> LineScene:
    rng, count = np.random.default_rng(10), max(1, round(1_000_000 * scale))
    length, angle = rng.uniform(2, 58, count), rng.random(count) * 2 * np.pi
    middle = 30 + rng.random((count, 2)) * (np.array(HD) - 60)
    half = np.stack([np.cos(angle), np.sin(angle)], axis=1) * length[:, None] / 2
    segments = _on_grid(np.stack([middle - half, middle + half], axis=1)).astype(np.float32)
    colors = rng.integers(0, 256, (count, 4), dtype=np.uint8)
    colors[:, 3] = 255

    # Lines by pixels go from the middle of a pixel to the middle of a pixel, on which all agree.
    if name == "L":
        segments = np.floor(segments) + np.float32(0.5)
    return LineScene(name, HD, segments, colors, "lines" if name == "L" else "smooth lines")


def _star(middle: Any, radius: Any) -> Floats:
    angle = np.arange(len(radius)) * (2 * np.pi / len(radius))
    return np.asarray(middle + np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius[:, None])


def _polygon_scene(name: str, scale: float) -> PolygonScene:
    fill_rule, smooth = POLYGONS[name]
    side = SQUARE[0]
    if name.startswith("PS"):
        count = 2 * max(4, round(5_000 * scale))
        inner_or_outer = np.where(np.arange(count) % 2, 0.45, 0.95)
        radius = inner_or_outer * side / 2 * np.random.default_rng(11).uniform(0.97, 1.0, count)
        ring = _star(np.array([side / 2, side / 2]), radius)
    else:
        ring = np.random.default_rng(12).uniform(40, side - 40, (max(8, round(2_000 * scale)), 2))
    return PolygonScene(name, SQUARE, _on_grid(ring), fill_rule, "smooth polygon" if smooth else "polygon")


def _point_scene(scale: float) -> PointScene:
    rng, count = np.random.default_rng(13), max(1, round(10_000_000 * scale))
    x, y = (np.clip(rng.normal(0.5, 0.18, count), 0, 0.999999) * side for side in HD)
    return PointScene("Q2", HD, x.astype(np.float32), y.astype(np.float32))


def _flood_scene() -> FloodScene:
    side, rng = 2048, np.random.default_rng(15)
    image = np.zeros((side, side), dtype=np.uint8)
    for _ in range(1_500):
        x, y, radius = rng.integers(0, side), rng.integers(0, side), rng.integers(4, 28)
        top, left = max(0, y - radius), max(0, x - radius)
        patch = image[top : y + radius, left : x + radius]
        rows, columns = np.ogrid[top : top + patch.shape[0], left : left + patch.shape[1]]
        patch[(columns - x) ** 2 + (rows - y) ** 2 < radius**2] = 200
    image[:4, :4] = 0
    return FloodScene("FF", (side, side), image, (1, 1), 100)


def _rings_scene(name: str, size: tuple[int, int], rings: list[Floats], kind: str, unit: str, steps: int = GRID) -> RingsScene:
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    return RingsScene(name, size, _on_grid(np.concatenate(rings), steps), starts, kind, unit)


def _cut_scene(name: str, scale: float) -> RingsScene:
    corners, holes = CUT[name]
    outer, rng, side = max(30, round(corners * scale / 2)), np.random.default_rng(16), SQUARE[0]
    middle, across = np.array([side / 2, side / 2]), int(np.ceil(np.sqrt(holes)))
    rings = [_star(middle, side / 2 * (1 - 0.15 * rng.random(outer)))]
    for number in range(holes):
        place = (np.array([number % across, number // across]) + 0.5) / across - 0.5
        radius = 0.2 * side / across * (1 - 0.5 * rng.random(max(4, outer // holes)))
        rings.append(_star(middle + place * 0.55 * side, radius)[::-1])
    return _rings_scene(name, SQUARE, rings, "triangulation", "corners", 65536)


def _many_scene(name: str, scale: float) -> RingsScene:
    """Return stars of 6 to 23 corners, 16 px or so in radius, that overlap, in a picture of 2048 x 2048."""
    rng, side, rings = np.random.default_rng(17), 2048, []
    for _ in range(max(1, round(10_000 * scale))):
        corners, radius = rng.integers(6, 24), rng.uniform(6, 26)
        middle = rng.uniform(radius + 1, side - radius - 1, 2)
        rings.append(_star(middle, radius * rng.uniform(0.5, 1.0, corners)))
    return _rings_scene(name, (side, side), rings, "burn" if name == "MP-ids" else "measure", "polygons")


def make(name: str, scale: float = 1.0) -> Any:
    """Return the scene of a name in `NAMES`."""
    if name in POLYGONS:
        return _polygon_scene(name, scale)
    if name in CUT:
        return _cut_scene(name, scale)
    if name in ("L", "LA"):
        return _line_scene(name, scale)
    if name == "Q2":
        return _point_scene(scale)
    return _flood_scene() if name == "FF" else _many_scene(name, scale)


def checked_part(scene: Any) -> Any:
    """Return the scene whose picture is compared with the exact one: the scene itself, or the first lines where they blend."""
    if isinstance(scene, LineScene) and scene.kind == "smooth lines":
        count = CHECKED_LINES
        return LineScene(scene.name, scene.size, scene.segments[:count], scene.colors[:count], scene.kind)
    return scene
