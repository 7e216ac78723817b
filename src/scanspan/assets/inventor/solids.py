"""Cube, sphere, cone and cylinder as faces with normals and texture coordinates.

Round surfaces are cut the finer the greater the complexity is: at 0.5 a circle has 40 sides. The parts are numbered as
PER_PART counts them. Texture coordinates run as Inventor's do: round the side from the back, counter-clockwise seen from above.

Source: the reference pages of Cube, Sphere, Cone, Cylinder and Complexity of Inventor 2.1; the numbers of sides are our own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.homogeneous import FloatArray

FEWEST_SIDES, MOST_SIDES = 8, 72

# Each side of a cube: its normal, and the directions of s and t over it; front, back, left, right, top, bottom.
CUBE = (
    ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
)


class Solid(NamedTuple):
    """Faces of a solid, with what is known at their corners.

    points : (V, 3). vertex : (C,) the corners of all faces. counts : (F,) corners of each face. normals : (C, 3). uv : (C, 2).
    part : (C,) numbers of parts.
    """

    points: FloatArray
    vertex: NDArray[np.int64]
    counts: NDArray[np.int64]
    normals: FloatArray
    uv: FloatArray
    part: NDArray[np.int64]


def side_count(complexity: float) -> int:
    """Return how many sides a circle is cut into.

    >>> side_count(0.0), side_count(0.5), side_count(1.0)
    (8, 40, 72)
    """
    share = min(max(complexity, 0.0), 1.0) if math.isfinite(complexity) else 0.5
    return FEWEST_SIDES + round((MOST_SIDES - FEWEST_SIDES) * share / 4.0) * 4


def make_cube(width: float, height: float, depth: float) -> Solid:
    """Return a box about the origin."""
    half = np.array([width, height, depth]) / 2.0
    points, normals, uv = [], [], []
    for normal, along, up in np.array(CUBE, dtype=np.float64):
        for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
            points.append((normal + (2 * s - 1) * along + (2 * t - 1) * up) * half)
            normals.append(normal)
            uv.append((s, t))
    vertex = np.arange(24)
    return Solid(np.array(points), vertex, np.full(6, 4), np.array(normals), np.array(uv, float), vertex // 4)


def make_sphere(radius: float, complexity: float) -> Solid:
    """Return a sphere about the origin, its poles on the y axis."""
    sides = side_count(complexity)
    height = np.linspace(-1.0, 1.0, sides // 2 + 1)
    around = circle(sides)
    ring, upward = np.cos(height * math.pi / 2.0), np.sin(height * math.pi / 2.0)
    ring[0] = ring[-1] = 0.0
    normals = np.stack(
        [around[:, 0] * ring[:, None], np.repeat(upward[:, None], sides + 1, 1), around[:, 1] * ring[:, None]], 2
    )
    uv = np.stack(np.broadcast_arrays(np.linspace(0, 1, sides + 1)[None], ((height + 1) / 2)[:, None]), 2)
    vertex, counts = grid_faces(len(height), sides + 1)

    # Leave one of the two equal corners out of the faces at the poles.
    keep = np.ones((len(counts), 4), dtype=bool)
    keep[:sides, 0] = keep[-sides:, 2] = False
    counts[:sides] = counts[-sides:] = 3
    vertex = vertex[keep.reshape(-1)]
    flat = normals.reshape(-1, 3)
    return Solid(flat * radius, vertex, counts, flat[vertex], uv.reshape(-1, 2)[vertex], np.zeros(len(vertex), np.int64))


def make_cone(radius: float, height: float, complexity: float, parts: tuple[str, ...]) -> Solid:
    """Return a cone about the origin, its tip on the y axis."""
    sides = side_count(complexity)
    solids = []
    if has_part(parts, "SIDES"):
        around = circle(sides)
        length = math.hypot(radius, height) or 1.0
        slope = np.stack([around[:, 0] * height, np.full(sides + 1, radius), around[:, 1] * height], axis=1) / length
        foot = np.stack([around[:, 0] * radius, np.full(sides + 1, -height / 2.0), around[:, 1] * radius], axis=1)
        tip = np.tile((0.0, height / 2.0, 0.0), (sides, 1))
        share = np.linspace(0.0, 1.0, sides + 1)
        middle = slope[:-1] + slope[1:]
        middle /= np.maximum(np.sqrt((middle * middle).sum(axis=1, keepdims=True)), 1e-300)
        points = np.stack([foot[:-1], foot[1:], tip], axis=1).reshape(-1, 3)
        normals = np.stack([slope[:-1], slope[1:], middle], axis=1).reshape(-1, 3)
        half = (share[:-1] + share[1:]) / 2.0
        bottom, top = np.zeros(sides), np.ones(sides)
        uv = np.stack([np.stack([share[:-1], share[1:], half], 1), np.stack([bottom, bottom, top], 1)], axis=2).reshape(-1, 2)
        solids.append(Solid(points, np.arange(3 * sides), np.full(sides, 3), normals, uv, np.zeros(3 * sides, np.int64)))
    if has_part(parts, "BOTTOM"):
        solids.append(_disc(radius, -height / 2.0, sides, False, 1))
    return join(solids)


def make_cylinder(radius: float, height: float, complexity: float, parts: tuple[str, ...]) -> Solid:
    """Return a cylinder about the origin, along the y axis."""
    sides = side_count(complexity)
    solids = []
    if has_part(parts, "SIDES"):
        around = circle(sides)
        normals = np.tile(np.stack([around[:, 0], np.zeros(sides + 1), around[:, 1]], axis=1), (2, 1))
        points = normals * radius
        points[:, 1] = np.repeat([-height / 2.0, height / 2.0], sides + 1)
        uv = np.stack([np.tile(np.linspace(0, 1, sides + 1), 2), np.repeat([0.0, 1.0], sides + 1)], axis=1)
        vertex, counts = grid_faces(2, sides + 1)
        solids.append(Solid(points, vertex, counts, normals[vertex], uv[vertex], np.zeros(len(vertex), np.int64)))
    if has_part(parts, "TOP"):
        solids.append(_disc(radius, height / 2.0, sides, True, 1))
    if has_part(parts, "BOTTOM"):
        solids.append(_disc(radius, -height / 2.0, sides, False, 2))
    return join(solids)


def has_part(parts: tuple[str, ...], name: str) -> bool:
    """Say whether a part is among those that a field names; no word at all means all of them.

    >>> has_part(("SIDES", "BOTTOM"), "TOP"), has_part((), "TOP")
    (False, True)
    """
    return not parts or "ALL" in parts or name in parts


def circle(sides: int) -> FloatArray:
    """Return x and z of the corners of a circle from the back, counter-clockwise from above, the first again at the end."""
    angle = np.arange(sides + 1) * (2.0 * math.pi / sides)
    around = np.stack([-np.sin(angle), -np.cos(angle)], axis=1).round(15)
    around[-1] = around[0]
    return np.asarray(around)


def grid_faces(rows: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of the quadrilaterals of a grid of vertices, and how many each has."""
    row, column = np.divmod(np.arange((rows - 1) * (width - 1)), width - 1)
    first = row * width + column
    vertex = np.stack([first, first + 1, first + width + 1, first + width], axis=1)
    return vertex.reshape(-1), np.full(len(first), 4)


def join(solids: list[Solid]) -> Solid:
    """Return several solids as one."""
    if not solids:
        none = np.empty(0, np.int64)
        return Solid(np.empty((0, 3)), none, none, np.empty((0, 3)), np.empty((0, 2)), none)
    offset = 0
    vertices = []
    for solid in solids:
        vertices.append(solid.vertex + offset)
        offset += len(solid.points)
    points, _, *rest = (np.concatenate(column) for column in zip(*solids))
    return Solid(points, np.concatenate(vertices), *rest)


def _disc(radius: float, height: float, sides: int, is_top: bool, part: int) -> Solid:
    """Return a disc across the y axis as one face that looks up or down."""
    around = circle(sides)[:-1] if is_top else circle(sides)[:-1][::-1]
    points = np.stack([around[:, 0] * radius, np.full(sides, height), around[:, 1] * radius], axis=1)
    normals = np.tile((0.0, 1.0 if is_top else -1.0, 0.0), (sides, 1))
    uv = np.stack([0.5 + around[:, 0] / 2.0, 0.5 + (-0.5 if is_top else 0.5) * around[:, 1]], axis=1)
    return Solid(points, np.arange(sides), np.array([sides]), normals, uv, np.full(sides, part))
