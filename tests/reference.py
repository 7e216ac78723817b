"""The oracle: what a pixel must be, decided in exact rational numbers and as naively as the definitions allow.

It shares no code, no formula and no trick with what it checks. A sample on an edge is decided by really moving it, by an amount
so small that it cannot cross another edge, and asking whether the moved point lies strictly inside. Near-plane clipping is not
carried out; the whole homogeneous triangle is solved at the sample. The price is about 20 microseconds a sample.

Coordinates are pixels, x right and y down; sample (i, j) lies at (i + 1/2, j + 1/2). A rule is a name, or has x, y and w.
Source: signed areas, and Olano and Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates".
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

Point = tuple[Fraction, Fraction]
Plane = tuple[Fraction, Fraction, Fraction]

# The moves below. Coordinates up to 2^25 px on a grid of 1/2^17 px make a signed area that is not zero at least 2^-34 and at
# most 2^52, so no move undoes what a larger one has decided. An off-screen point may lie on a grid down to 1/2^60 px.
STEP = Fraction(1, 2**200)
TOWARDS_POINT = Fraction(1, 2**1000)


def snap(vertex: Sequence[float], subpixel_bits: int) -> Point:
    """Return a vertex on the sub-pixel grid, halves to even."""
    scale = 2**subpixel_bits
    x, y = (Fraction(float(value)) * scale for value in vertex)
    return Fraction(round(x), scale), Fraction(round(y), scale)


def sample_position(i: int, j: int) -> Point:
    """Return the centre of pixel (i, j)."""
    return Fraction(2 * i + 1, 2), Fraction(2 * j + 1, 2)


def signed_area(a: Point, b: Point, c: Point) -> Fraction:
    """Return twice the signed area of a triangle: negative when it runs counter-clockwise as seen, because y points down."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])


def signs(triangle: Sequence[Point], point: Point) -> list[Fraction]:
    """Return the three areas that a point makes with the edges, counted so that they are positive inside."""
    a, b, c = triangle
    turn = 1 if signed_area(a, b, c) > 0 else -1
    return [turn * signed_area(a, b, point), turn * signed_area(b, c, point), turn * signed_area(c, a, point)]


def moved(sample: Point, rule: Any) -> Point:
    """Return the sample moved as the rule says: right and then down or up, or towards the off-screen point."""
    x, y = sample
    if rule == "top-left":
        return x + STEP, y + STEP**2
    if rule == "bottom-left":
        return x + STEP, y - STEP**2

    # Go towards the point, which lies a step aside of itself; with w = 0 it is a direction.
    point_x, point_y, point_w = Fraction(rule.x), Fraction(rule.y), Fraction(rule.w)
    x += TOWARDS_POINT * (point_x + STEP - point_w * x)
    y += TOWARDS_POINT * (point_y + STEP**2 - point_w * y)
    return x, y


def coverage(triangle: Sequence[Point], sample: Point, rule: Any = "top-left") -> bool:
    """Say whether a triangle owns a sample. A triangle without area owns nothing, whatever the rule."""
    if signed_area(*triangle) == 0:
        return False
    if rule == "inclusive":
        return min(signs(triangle, sample)) >= 0
    if rule == "exclusive":
        return min(signs(triangle, sample)) > 0
    return min(signs(triangle, moved(sample, rule))) > 0


def is_culled(triangle: Sequence[Point], cull: str) -> bool:
    """Say whether culling drops a triangle: its front is counter-clockwise as seen."""
    return {"none": False, "back": signed_area(*triangle) > 0, "front": signed_area(*triangle) < 0}[cull]


def covers(
    vertices: Sequence[Sequence[float]], i: int, j: int, rule: Any = "top-left", subpixel_bits: int = 8, cull: str = "none"
) -> bool:
    """Say whether a screen triangle, given in pixels as it comes, owns pixel (i, j)."""
    triangle = [snap(vertex, subpixel_bits) for vertex in vertices]
    return not is_culled(triangle, cull) and coverage(triangle, sample_position(i, j), rule)


def is_in_front(vertex: Sequence[float]) -> bool:
    """Say whether a clip-space vertex is kept: w > 0 and z >= -w."""
    return vertex[3] > 0 and Fraction(float(vertex[2])) >= -Fraction(float(vertex[3]))


def to_screen(vertex: Sequence[float], size: tuple[int, int]) -> tuple[float, float]:
    """Return a clip-space vertex in pixels, in float64 as the contract has it."""
    x, y, _, w = (float(value) for value in vertex)
    return (x / w + 1) * size[0] / 2, (1 - y / w) * size[1] / 2


class Hit(NamedTuple):
    """What is seen at a sample: the primitive (-1 for nothing), its exact depth, and by how much it beats the next one."""

    primitive: int
    depth: Fraction
    margin: Fraction


def depth_at(clip: Sequence[Sequence[float]], sample: Point, size: tuple[int, int], subpixel_bits: int = 8) -> Fraction:
    """Return the depth of a triangle wholly in front at a sample: weights by exact areas of the snapped triangle."""
    triangle = [snap(to_screen(vertex, size), subpixel_bits) for vertex in clip]
    areas = signs(triangle, sample)
    depths = [(Fraction(float(v[3])) - Fraction(float(v[2]))) / (2 * Fraction(float(v[3]))) for v in clip]
    return (areas[1] * depths[0] + areas[2] * depths[1] + areas[0] * depths[2]) / sum(areas)


def visible(
    clip: Sequence[Sequence[float]],
    triangles: Sequence[Sequence[int]],
    i: int,
    j: int,
    size: tuple[int, int],
    *,
    rule: Any = "top-left",
    subpixel_bits: int = 8,
    cull: str = "none",
) -> Hit:
    """Return what is seen at pixel (i, j) of triangles that are wholly in front: the largest depth, then the lowest number."""
    sample, candidates = sample_position(i, j), []
    for primitive, corners in enumerate(triangles):
        parent = [clip[corner] for corner in corners]
        if covers([to_screen(vertex, size) for vertex in parent], i, j, rule, subpixel_bits, cull):
            candidates.append((-depth_at(parent, sample, size, subpixel_bits), primitive))
    if not candidates:
        return Hit(-1, Fraction(0), Fraction(0))
    candidates.sort()
    margin = candidates[1][0] - candidates[0][0] if len(candidates) > 1 else Fraction(2**64)
    return Hit(candidates[0][1], -candidates[0][0], margin)


class Verdict(NamedTuple):
    """What is promised at a sample: "must", "may" or "never" be covered; the depth there; the depth's slope squared."""

    coverage: str
    depth: Fraction
    slope_squared: Fraction


def _cross(p: Plane, q: Plane) -> Plane:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def _dot(p: Plane, q: Plane) -> Fraction:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def clipped_verdict(
    clip: Sequence[Sequence[float]], i: int, j: int, size: tuple[int, int], band: Fraction = Fraction(1, 128)
) -> Verdict:
    """Decide pixel (i, j) for a triangle anywhere in clip space, behind the eye included, without clipping it.

    A point of the triangle with weights l >= 0 and w > 0 is seen at (sx, sy) iff b = l / w solves P b = (sx, sy, 1), P being
    the vertices in homogeneous pixels. So the visible part is where four planes over the screen are not negative: the three b,
    and sum b (z + w) for the near plane. A sample nearer to one of the four lines than `band` pixels may go either way.
    """
    x, y, z, w = ([Fraction(float(vertex[k])) for vertex in clip] for k in range(4))
    corners: list[Plane] = [((x[k] + w[k]) * size[0] / 2, (w[k] - y[k]) * size[1] / 2, w[k]) for k in range(3)]
    determinant = _dot(corners[0], _cross(corners[1], corners[2]))
    if determinant == 0:
        return Verdict("never", Fraction(0), Fraction(0))

    # Solve for b as three planes over the screen, and combine them into the near plane and the depth.
    weights = [_cross(corners[(k + 1) % 3], corners[(k + 2) % 3]) for k in range(3)]
    solved: list[Plane] = [(p[0] / determinant, p[1] / determinant, p[2] / determinant) for p in weights]
    columns: list[Plane] = [(solved[0][k], solved[1][k], solved[2][k]) for k in range(3)]
    height: Plane = (z[0] + w[0], z[1] + w[1], z[2] + w[2])
    nearness: Plane = ((w[0] - z[0]) / 2, (w[1] - z[1]) / 2, (w[2] - z[2]) / 2)
    near: Plane = (_dot(columns[0], height), _dot(columns[1], height), _dot(columns[2], height))
    depth: Plane = (_dot(columns[0], nearness), _dot(columns[1], nearness), _dot(columns[2], nearness))

    # Compare each plane's distance with the band, squared so that no root is taken.
    position: Plane = (*sample_position(i, j), Fraction(1))
    verdict = "must"
    for plane in (*solved, near):
        value, reach = _dot(plane, position), band * band * (plane[0] ** 2 + plane[1] ** 2)
        if value * value <= reach:
            verdict = "may"
        elif value < 0:
            return Verdict("never", _dot(depth, position), depth[0] ** 2 + depth[1] ** 2)
    return Verdict(verdict, _dot(depth, position), depth[0] ** 2 + depth[1] ** 2)
