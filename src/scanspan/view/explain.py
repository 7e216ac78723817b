"""Explain: why a pixel shows what it shows.

Every triangle that comes within a pixel of the sample is tried again, with the setup, the rule and the comparison that made the
picture, and is given a verdict. Triangles that would cover the sample but for the near plane are listed too.

Verdicts: visible; hidden (by a nearer triangle); outside; excluded edge (the sample lies on an edge that does not own it);
culled; degenerate (no area after snapping); clipped (cut away by the near or the far plane).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scanspan.errors import InputError
from scanspan.geometry.fixed_point import product_halves
from scanspan.homogeneous import join
from scanspan.jit import kernel
from scanspan.raster.algorithms import with_outlines
from scanspan.raster.edge import SAMPLE, TOUCHED, edge_bias
from scanspan.raster.options import check_integer
from scanspan.raster.setup import bound_sample, depth_at, set_up
from scanspan.raster.trapezoids import draw_polygons
from scanspan.raster.write import is_nearer
from scanspan.records import Array, Int32Array, Int64Array, Sampling, ScreenTriangles
from scanspan.target.frame import Frame
from scanspan.target.visibility import Visibility, sampling_of

VERDICTS = ("visible", "hidden", "outside", "excluded edge", "culled", "degenerate", "clipped")


@dataclass(frozen=True)
class Decision:
    """What became of one triangle at one sample.

    Attributes
    ----------
    primitive : number of the face, segment or point (of the triangle, for a Visibility).
    triangle : number of the triangle it was tried as, in the order of the scene.
    verdict : one of VERDICTS.
    edge_values : exact values of the three edges, opposite corner 0, 1 and 2, in square sub-pixels; positive is inside.
    depth : as it is compared, 1 near and 0 far; None where the sample is not covered.
    reason : one sentence.
    """

    primitive: int
    triangle: int
    verdict: str
    edge_values: tuple[int, int, int] | None
    depth: float | None
    reason: str


@dataclass(frozen=True)
class Explanation:
    """All that came near one pixel, the nearest first. Printed, it is a table.

    Attributes
    ----------
    x, y : the pixel.
    primitive : what is seen, -1 nothing.
    decisions : one for each triangle or piece of one that came near.
    """

    x: int
    y: int
    primitive: int
    decisions: tuple[Decision, ...]

    def __str__(self) -> str:
        seen = "nothing" if self.primitive < 0 else f"primitive {self.primitive}"
        lines = [f"pixel ({self.x}, {self.y}) shows {seen}; {len(self.decisions)} triangles came near"]
        for d in self.decisions:
            values = "" if d.edge_values is None else " ".join(f"{v:+d}" for v in d.edge_values)
            depth = "" if d.depth is None else f"{d.depth:.9g}"
            lines.append(f"  {d.primitive:>8}  {d.verdict:<13}  {depth:<14}  {values}")
            lines.append(f"            {d.reason}")
        return "\n".join(lines)


@kernel
def find_near_kernel(triangles: ScreenTriangles, x: int, y: int, reach: int, near: Array) -> None:
    """Mark the triangles whose bounding box comes within a reach of a point.

    Shapes  triangles: ScreenTriangles; near: (N,) bool, written.
    Units   sub-pixels.
    """
    xy, corners, limits = triangles.xy, triangles.corners, triangles.limits
    for n in range(corners.shape[0]):
        p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
        low_x, high_x = min(xy[p, 0], xy[q, 0], xy[r, 0]), max(xy[p, 0], xy[q, 0], xy[r, 0])
        low_y, high_y = min(xy[p, 1], xy[q, 1], xy[r, 1]), max(xy[p, 1], xy[q, 1], xy[r, 1])
        if triangles.outline[n] >= 0:
            m = triangles.outline[n]
            low_x, high_x, low_y, high_y = limits[m, 0], limits[m, 1], limits[m, 2], limits[m, 3]
        near[n] = low_x - reach <= x <= high_x + reach and low_y - reach <= y <= high_y + reach


def explain(frame: Frame | Visibility, x: int, y: int) -> Explanation:
    """Say which triangles were tried at a pixel's centre, what their edge values and depths are, and what decided.

    Parameters
    ----------
    frame : what `render` or `rasterize` returned; of a Visibility with several samples, the first one is explained.
    x, y : the pixel; x to the right, y down.

    Raises
    ------
    InputError : when it is neither, or the pixel lies outside the picture.

    Examples
    --------
    >>> import scanspan as ss
    >>> seen = ss.rasterize([(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)], [(0, 1, 2)], size=(4, 4))
    >>> explain(seen, 1, 1).decisions[0].verdict
    'excluded edge'
    """
    polygons = None
    if isinstance(frame, Frame):
        screen, options, plane, draw = frame._screen, frame._options, frame._centre, frame._draw
        polygons = frame._polygons
        clip, triangles, primitive = draw.clip, draw.triangles, draw.primitive
    elif isinstance(frame, Visibility) and frame.screen is not None and frame.options is not None:
        screen, options, plane = frame.screen, frame.options, frame.planes[0]
        clip, triangles, primitive = screen.clip, frame.triangles, np.arange(len(frame.triangles), dtype=np.int32)
    else:
        raise InputError(f"frame: expected what render or rasterize returned, got {type(frame).__name__}")
    width, height = options.size
    x, y = check_integer("x", x, 0, width - 1), check_integer("y", y, 0, height - 1)
    sampling = sampling_of(plane.offset, options)

    # Try everything that comes within a pixel again.
    px, py = (x << options.subpixel_bits) + int(plane.offset[0]), (y << options.subpixel_bits) + int(plane.offset[1])
    whole = screen
    if polygons is not None:
        row = sampling._replace(y_start=y, y_end=y + 1)
        screen, _ = draw_polygons(screen, polygons, row)
    near = np.zeros(len(screen.corners), bool)
    find_near_kernel(screen, px, py, 1 << options.subpixel_bits, near)
    places = ((x, y), (px, py))
    tries = [try_triangle(screen, int(n), sampling, *places, primitive, options.depth_bits) for n in np.flatnonzero(near)]
    decisions = compare([decision for decision in tries if decision is not None]) + find_clipped(
        clip, triangles, whole, primitive, (x, y), plane.offset, options
    )
    visible = [d.primitive for d in decisions if d.verdict == "visible"]
    order = {verdict: k for k, verdict in enumerate(VERDICTS)}
    decisions.sort(key=lambda d: (order[d.verdict], -(d.depth if d.depth is not None else 0.0), d.triangle))
    return Explanation(x, y, visible[0] if visible else -1, tuple(decisions))


@kernel
def probe_kernel(
    triangles: ScreenTriangles, n: int, sampling: Sampling, x: int, y: int, halves: Int64Array, owns: Array
) -> tuple[float, bool, float, float]:
    """Write the exact values of a triangle's edges at a sample, and of its area; return what the setup makes of the sample.

    That is its depth, whether it is covered, and the depths that it is cut off at.

    Shapes  triangles: ScreenTriangles, outlines set up; halves: (4, 2) int64, the edges opposite corner 0, 1, 2 as listed, and
            the area, as (high, low); owns: (3,) bool, whether each edge owns the samples on it. sampling: one pixel.
    Units   x, y and edge values in sub-pixels and their squares. The depth means something where the sample is covered.
    """
    xy, corners, lines, m = triangles.xy, triangles.corners, triangles.lines, triangles.outline[n]
    p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
    area_high, area_low = product_halves(xy[q, 0] - xy[p, 0], xy[p, 1] - xy[q, 1], xy[r, 1] - xy[p, 1], xy[r, 0] - xy[p, 0])
    halves[3, 0], halves[3, 1] = area_high, area_low
    turn = np.int64(-1) if area_high < 0 else np.int64(1)
    if m >= 0:
        turn = halves[3, 1] = triangles.limits[m, 6]
        halves[3, 0] = 0
    for k in range(3):
        start, end = corners[n, (k + 1) % 3], corners[n, (k + 2) % 3]
        a, b, q_x, q_y = xy[start, 1] - xy[end, 1], xy[end, 0] - xy[start, 0], xy[start, 0], xy[start, 1]
        if m >= 0:
            a, b, q_x, q_y = turn * lines[m, k, 0], turn * lines[m, k, 1], lines[m, k, 2], lines[m, k, 3]
        halves[k, 0], halves[k, 1] = product_halves(a, b, x - q_x, y - q_y)
        is_inner = (triangles.inner[n] >> k) & 1 != 0
        bias = edge_bias(
            turn * a, turn * b, q_x, q_y, is_inner, sampling.rule, sampling.rule_x, sampling.rule_y, sampling.rule_w
        )
        owns[k] = bias == 0 or (a == 0 and b == 0)
    t = set_up(
        xy, triangles.depth, corners, triangles.inner, triangles.outline, triangles.integers, triangles.floats, n, sampling
    )
    inside = (t.y_start < t.y_end) & (t.x_start < t.x_end) & ((t.f0 | t.f1 | t.f2) >= 0)
    covered, depth = bound_sample(t, bool(inside), depth_at(t, t.g1, t.g2))
    return depth, covered, t.cut_low if inside else -np.inf, t.cut_high if inside else np.inf


def try_triangle(
    screen: ScreenTriangles, n: int, sampling: Sampling, pixel: tuple[int, int], sample: tuple[int, int], primitive: Array,
    depth_bits: int,
) -> Decision | None:  # fmt: skip
    """Try one triangle at one sample: its exact edge values, and its depth where it covers it; None if it is not near."""
    halves, owns = np.empty((4, 2), np.int64), np.empty(3, bool)
    within = sampling._replace(x_start=pixel[0], x_end=pixel[0] + 1, y_start=pixel[1], y_end=pixel[1] + 1)
    only = with_outlines(screen, within)
    depth, covered, *cut = probe_kernel(only, n, within, *sample, halves, owns)
    *values, area = ((int(high) << 20) + int(low) for high, low in halves)
    sign = (area > 0) - (area < 0)
    edges = (values[0] * (sign or 1), values[1] * (sign or 1), values[2] * (sign or 1))
    if not is_within_reach(screen, n, edges if sign else (-abs(edges[0]), -abs(edges[1]), -abs(edges[2])), sampling):
        return None

    source = int(screen.source[n])
    known = (int(primitive[source]), source)
    if sign == 0:
        return Decision(*known, "degenerate", edges, None, "its corners lie on one line after snapping to the grid")
    if sign == sampling.cull:
        facing = "clockwise, a back face" if sign > 0 else "counter-clockwise, a front face"
        return Decision(*known, "culled", edges, None, f"as seen it runs {facing}")
    if covered:
        return Decision(*known, "visible", edges, depth if depth_bits == 64 else float(np.float32(depth)), "")
    verdict, reason = why_not_covered(edges, owns, sampling.coverage, float(depth), cut)
    return Decision(*known, verdict, edges, None, reason)


def why_not_covered(edges: tuple[int, int, int], owns: Array, coverage: int, depth: float, cut: list[float]) -> tuple[str, str]:
    """Return verdict and reason of a triangle that faces the right way and does not cover a sample."""
    k = edges.index(min(edges))
    if coverage != SAMPLE:
        what = "no part" if coverage == TOUCHED else "not all"
        return "outside", f"{what} of the pixel is on the inner side of all edges"
    if min(edges) < 0:
        return "outside", f"the edge opposite corner {k} has the sample on its outer side"
    for k in range(3):
        if edges[k] == 0 and not owns[k]:
            return "excluded edge", f"the sample lies on the edge opposite corner {k}, which does not own it"
    side = "in front of the near plane" if depth > cut[1] else "behind the far plane" if depth < cut[0] else "out of reach"
    return "clipped", f"it lies {side} there"


def is_within_reach(screen: ScreenTriangles, n: int, edges: tuple[int, int, int], sampling: Sampling) -> bool:
    """Say whether a sample is at most a pixel outside of every edge of a triangle."""
    corners, m = screen.xy[screen.corners[n]], screen.outline[n]
    for k in range(3):
        along = screen.lines[m, k, :2] if m >= 0 else corners[(k + 2) % 3] - corners[(k + 1) % 3]
        if edges[k] < -math.hypot(*along.tolist()) * (1 << sampling.subpixel_bits):
            return False
    return True


@kernel
def is_hidden_kernel(depth: float, number: int, other_depth: float, other_number: int) -> bool:
    """Say whether the first sample is hidden by the second, by the comparison of the writers."""
    return bool(is_nearer(other_depth, other_number, depth, number))


def compare(tried: list[Decision]) -> list[Decision]:
    """Let the decisions that cover the sample hide each other, by the comparison of the writers."""
    covering = [(d.depth, d) for d in tried if d.depth is not None]
    if not covering:
        return tried
    depth, best = covering[0]
    for other_depth, d in covering[1:]:
        if is_hidden_kernel(depth, best.triangle, other_depth, d.triangle):
            depth, best = other_depth, d
    found = []
    for d in tried:
        if d is best:
            many = len(covering)
            reason = "it alone covers the sample" if many == 1 else f"it is the nearest of {many} that cover the sample"
            found.append(Decision(d.primitive, d.triangle, "visible", d.edge_values, d.depth, reason))
        elif d.verdict == "visible":
            how = "is nearer" if best.depth != d.depth else "has the same depth and the lower number"
            reason = f"primitive {best.primitive} {how}"
            found.append(Decision(d.primitive, d.triangle, "hidden", d.edge_values, d.depth, reason))
        else:
            found.append(d)
    return found


def find_clipped(
    clip: Array, triangles: Int32Array, screen: ScreenTriangles, primitive: Array, pixel: tuple[int, int], offset: Array,
    options: Any,
) -> list[Decision]:  # fmt: skip
    """Return the triangles that cover the sample as they came, but not where the planes have left them.

    Source: Olano and Greer 1997: a point of the image lies in a triangle where the three rows of the inverse of its homogeneous
    corners are positive. In floating point, as it says only what is gone.
    """
    whole = np.zeros(len(triangles), bool)
    whole[screen.source[screen.piece < 0]] = True
    gone = np.flatnonzero(~whole)
    if not len(gone):
        return []
    unit = float(1 << options.subpixel_bits)
    x = (pixel[0] + offset[0] / unit) / options.size[0] * 2 - 1
    y = 1 - (pixel[1] + offset[1] / unit) / options.size[1] * 2
    corners = clip[triangles[gone]]
    matrix = corners[:, :, [0, 1, 3]]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        weights = np.stack([join(matrix[:, (k + 1) % 3], matrix[:, (k + 2) % 3]) for k in range(3)], axis=1)
        volume = np.einsum("nk,nk->n", matrix[:, 0], weights[:, 0])
        shares = np.einsum("nkc,c->nk", weights, [x, y, 1.0])
        shares /= volume[:, None]
        inside = (shares > 0).all(axis=1)
        at = np.einsum("nk,nkc->nc", shares, corners) / shares.sum(axis=1)[:, None]
    found = []
    for k in np.flatnonzero(inside & ~(at[:, 2] + at[:, 3] >= 0)):
        n = int(gone[k])
        found.append(Decision(int(primitive[n]), n, "clipped", None, None, "it lies in front of the near plane there"))
    return found
