"""Curves and surfaces of NURBS, evaluated on a grid.

The basis functions of all parameters are computed together by the recurrence of Cox and de Boor; a surface is then two products
with its control points, and its normals come from the derivatives of the basis, so they are exact. Each knot span is cut into
the same number of pieces, more of them with greater complexity. Trimming curves are not applied.

Source: Piegl and Tiller, The NURBS Book, sections 2.2, 2.3 and 4.4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.homogeneous import FloatArray

MAX_ORDER = 24
MAX_SAMPLES = 1024  # along one direction, where there are fewer spans
MAX_KNOTS = 2000  # the table of the basis grows with their square


class Grid(NamedTuple):
    """Points of a surface, row by row of the second parameter: points, normals (rows * width, 3), uv (rows * width, 2)."""

    points: FloatArray
    normals: FloatArray
    uv: FloatArray
    rows: int
    width: int


def parameters(knots: FloatArray, order: int, pieces: int) -> FloatArray:
    """Return where a curve is evaluated: each span of knots in its domain is cut into so many pieces."""
    domain = np.unique(knots[order - 1 : len(knots) - order + 1])
    pieces = max(1, min(pieces, MAX_SAMPLES // max(len(domain), 1)))
    share = np.arange(pieces) / pieces
    inner = (domain[:-1, None] + np.diff(domain)[:, None] * share).reshape(-1)
    return np.append(inner, domain[-1])


def basis(knots: FloatArray, order: int, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the basis functions and their derivatives at some places, (N, control points) each."""
    count = len(knots) - order
    last = np.flatnonzero(knots < knots[count])[-1] if (knots < knots[count]).any() else order - 1
    span = np.clip(np.searchsorted(knots, places, side="right") - 1, 0, last)
    values = np.zeros((len(places), len(knots) - 1))
    values[np.arange(len(places)), span] = 1.0
    slopes = np.zeros((len(places), count))
    for degree in range(1, order):
        width = len(knots) - 1 - degree
        rise = knots[degree : degree + width] - knots[:width]
        fall = knots[degree + 1 : degree + 1 + width] - knots[1 : 1 + width]
        up = np.divide(1.0, rise, out=np.zeros(width), where=rise > 0)
        down = np.divide(1.0, fall, out=np.zeros(width), where=fall > 0)
        if degree == order - 1:
            slopes = degree * (values[:, :width] * up - values[:, 1 : 1 + width] * down)
        left = (places[:, None] - knots[:width]) * up * values[:, :width]
        values = left + (knots[degree + 1 : degree + 1 + width] - places[:, None]) * down * values[:, 1 : 1 + width]
    return values, slopes


def fault(knots: FloatArray, count: int) -> str:
    """Return what is wrong with a knot vector for so many control points, or ""."""
    order = len(knots) - count
    if not 2 <= order <= MAX_ORDER or count < order:
        return f"expected {count + 2} to {2 * count} knots for {count} control points, got {len(knots)}"
    if len(knots) > MAX_KNOTS:
        return f"expected at most {MAX_KNOTS} knots, got {len(knots)}"
    if not np.isfinite(knots).all() or (np.diff(knots) < 0).any() or not knots[order - 1] < knots[count]:
        return "expected finite knots that do not fall"
    return ""


def evaluate_surface(
    points: FloatArray, weights: FloatArray, u_knots: FloatArray, v_knots: FloatArray, complexity: float
) -> Grid:
    """Return the points of a surface; points (v, u, 3) and weights (v, u) are its control points."""
    pieces = 2 + round(12 * min(max(complexity, 0.0), 1.0))
    u_order, v_order = len(u_knots) - points.shape[1], len(v_knots) - points.shape[0]
    u, v = parameters(u_knots, u_order, pieces), parameters(v_knots, v_order, pieces)
    (u_values, u_slopes), (v_values, v_slopes) = basis(u_knots, u_order, u), basis(v_knots, v_order, v)
    control = np.concatenate([points * weights[..., None], weights[..., None]], axis=2)
    place = np.einsum("ri,ck,ikd->rcd", v_values, u_values, control, optimize=True)
    along_u = np.einsum("ri,ck,ikd->rcd", v_values, u_slopes, control, optimize=True)
    along_v = np.einsum("ri,ck,ikd->rcd", v_slopes, u_values, control, optimize=True)

    # Divide by the weight; the direction of a derivative is what the quotient rule has above the line.
    weight = np.where(place[..., 3:] == 0.0, 1.0, place[..., 3:])
    surface = place[..., :3] / weight
    normals = np.cross(along_u[..., :3] - surface * along_u[..., 3:], along_v[..., :3] - surface * along_v[..., 3:])
    length = np.sqrt((normals * normals).sum(axis=2, keepdims=True))
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 1e-12 * float(length.max(initial=0.0)))
    uv = np.stack(np.broadcast_arrays(_share(u)[None], _share(v)[:, None]), axis=2)
    return Grid(surface.reshape(-1, 3), normals.reshape(-1, 3), uv.reshape(-1, 2), len(v), len(u))


def evaluate_curve(points: FloatArray, weights: FloatArray, knots: FloatArray, complexity: float) -> FloatArray:
    """Return the points of a curve, (N, 3)."""
    order = len(knots) - len(points)
    places = parameters(knots, order, 4 + round(24 * min(max(complexity, 0.0), 1.0)))
    values = basis(knots, order, places)[0]
    weight = (values * weights).sum(axis=1, keepdims=True)
    curve = np.einsum("ni,id->nd", values, points * weights[:, None])
    return np.asarray(curve / np.where(weight == 0.0, 1.0, weight))


def _share(places: FloatArray) -> FloatArray:
    """Return places as shares of their range."""
    return np.asarray((places - places[0]) / (places[-1] - places[0]))
