"""Who owns a sample on an edge: the rules of S1, S2 and S3, taken at their word.

A sample inside a triangle is the triangle's; the rules are about samples on its boundary. Each is a function of the edges that
the sample lies on. Where the words leave something open it is the corners, where a sample lies on two edges:

- "draw" and "do not draw" (S1, S2): every sample on a shared edge is drawn twice, or not at all.
- "left or top" (S1, S2): drawn on a left or top edge, not drawn on a right or bottom one. A sample at a corner is often on
  both. Read as "on any left or top edge", corners are drawn too often; "on no right or bottom edge" is the reading that works.
- "same side" (S2): drawn where the triangle lies on the side of the edge on which an off-screen point is. That settles corners
  too, if the point is on no edge's line. The point (-1, -1) often is, and then samples are dropped.
- "shadow" (S3, with y up): not drawn on a level top edge, on an edge that faces right, and at an upper extremum. The first two
  already settle the third, and the shared vertices that the slide still worries about.

The library moves every sample by (+e, +e^2) instead (`raster/edge.py`), which decides edges and corners alike. That is the
top-left rule; with y up it is the shadow rule; and it is the rule of the same side for a point infinitely far to the right.

Source: S1, lines 98-113; S2, lines 381-390; S3, lines 313-334.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.errors import InputError, unknown_name
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.homogeneous import finite_array
from scanspan.lectures.compare import shipped_hits, shuffled_mesh
from scanspan.pipeline import count
from scanspan.raster.options import OffscreenPoint
from scanspan.records import BoolArray, Float64Array, Int32Array, Int64Array

RULES = ("draw", "do not draw", "any left or top", "no right or bottom", "same side", "shadow")


def edges_of(corners: Int64Array) -> Int64Array:
    """Return a, b and c of a triangle's edges, (3, 3), so that a x + b y + c is positive inside."""
    x, y = corners[:, 0], corners[:, 1]
    after_x, after_y = np.roll(x, -1), np.roll(y, -1)
    lines: Int64Array = np.stack([y - after_y, after_x - x, x * after_y - after_x * y], axis=1)
    return -lines if lines[:, 2].sum() < 0 else lines


def owns(lines: Int64Array, values: Int64Array, rule: str, point: tuple[int, int]) -> BoolArray:
    """Return whether a triangle owns samples, by a rule.

    Parameters
    ----------
    lines : (3, 3) from `edges_of`.
    values : (..., 3) edge values of the samples.
    rule : one of RULES.
    point : off the screen, for "same side".
    """
    inside, on = (values > 0).all(axis=-1), values == 0
    on_boundary = (values >= 0).all(axis=-1) & on.any(axis=-1)
    a, b, c = lines.T
    if rule == "draw":
        allowed = np.ones(3, bool)
    elif rule == "do not draw":
        allowed = np.zeros(3, bool)
    elif rule == "same side":
        allowed = a * point[0] + b * point[1] + c > 0
    else:
        # Left edges, and level ones with the inside beyond them: the top ones with y down, the bottom ones with y up, in S3.
        allowed = (a > 0) | ((a == 0) & (b > 0))
    if rule == "any left or top":
        allowed_here = (on & allowed).any(axis=-1)
    else:
        allowed_here = ~(on & ~allowed).any(axis=-1)
    owned: BoolArray = inside | (on_boundary & allowed_here)
    return owned


def rule_hits(triangles: Float64Array, size: tuple[int, int], rule: str, point: tuple[int, int] = (-1, -1)) -> Int32Array:
    """Return how many triangles own each sample by a lecture's rule, sampled at whole coordinates: (H, W).

    Parameters
    ----------
    triangles : (N, 3, 2), whole numbers.
    size : (width, height).
    rule : one of RULES.
    point : off the screen, for "same side".

    Raises
    ------
    InputError : for coordinates that are not whole numbers within 2^24 pixels, and an unknown rule.

    Examples
    --------
    >>> square = np.array([[(0, 0), (2, 0), (0, 2)], [(2, 0), (2, 2), (0, 2)]])
    >>> rule_hits(square, (3, 3), "draw").tolist()
    [[1, 1, 2], [1, 2, 1], [2, 1, 1]]
    """
    if rule not in RULES:
        raise unknown_name("rule", rule, RULES)
    checked = finite_array("triangles", triangles, (None, 3, 2))
    if (checked != np.rint(checked)).any() or (np.abs(checked) > MAX_COORDINATE).any():
        raise InputError(f"triangles: expected whole coordinates within {MAX_COORDINATE} pixels")
    hits = np.zeros((size[1], size[0]), np.int32)
    for corners in checked.astype(np.int64):
        low, high = np.maximum(corners.min(axis=0), 0), np.minimum(corners.max(axis=0) + 1, size)
        lines = edges_of(corners)
        if (low >= high).any() or lines[:, 2].sum() == 0:
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        values = lines[:, 0] * x[..., None] + lines[:, 1] * y[..., None] + lines[:, 2]
        hits[low[1] : high[1], low[0] : high[0]] += owns(lines, values, rule, point)
    return hits


class Ownership(NamedTuple):
    """The samples inside a mesh, by how many triangles own them."""

    samples: int
    gaps: int
    doubles: int


def demonstrate_rules(seed: int = 1) -> dict[str, Ownership]:
    """Draw one mesh under every rule of the lectures, and under the shipped ones."""
    columns, rows, cell = 20, 15, 6
    mesh, size = shuffled_mesh(seed, columns, rows, cell), (columns * cell, rows * cell)
    found = {rule: rule_hits(mesh, size, rule) for rule in RULES}
    found["same side, a point on no line"] = count(
        mesh + 0.5, size, rule=OffscreenPoint(-1 / 3 - 1000.5, -1 / 7 - 500.25), subpixel_bits=12
    )
    for rule in ("top-left", "bottom-left"):
        found[f"shipped {rule}"] = shipped_hits(mesh, size, rule)
    inner = {rule: hits[1:, 1:] for rule, hits in found.items()}
    return {rule: Ownership(hits.size, int((hits == 0).sum()), int((hits > 1).sum())) for rule, hits in inner.items()}


class MirrorImages(NamedTuple):
    """S3 sweeps upwards and S1 downwards: the same words, mirrored."""

    different: int  # samples of a mesh that go to another triangle under the other rule
    after_mirroring: int


def demonstrate_mirror(seed: int = 1) -> MirrorImages:
    """Compare the owner of every sample under top-left with that under bottom-left, as it is and in a mirror."""
    columns, rows, cell = 12, 9, 6
    mesh, height = shuffled_mesh(seed, columns, rows, cell), rows * cell + 1
    size, mirrored = (columns * cell + 1, height), mesh * (1, -1) + (0, height - 1)

    # Draw each triangle's number into a sum: where every sample has one owner, the sum is the owner.
    def owners(triangles: Float64Array, rule: str) -> Int64Array:
        total = np.zeros((height, size[0]), np.int64)
        for number, corners in enumerate(triangles):
            total += number * shipped_hits([corners], size, rule)
        return total

    top, bottom = owners(mesh, "top-left"), owners(mesh, "bottom-left")
    inner = np.s_[1:-1, 1:-1]
    turned = owners(mirrored, "bottom-left")[::-1]
    return MirrorImages(int((top != bottom)[inner].sum()), int((top != turned)[inner].sum()))
