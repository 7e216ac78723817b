"""Polygons to triangles: a simple polygon, convex or concave, is cut along diagonals and no new point is made.

Ears are clipped one at a time. Every turn is decided by a predicate that is exact: it is evaluated in float64, and again in
rationals where the rounding error could have changed its sign. A corner on a straight side becomes a corner of a real triangle
wherever one exists, because a triangle that skips it would leave a T-junction, and T-junctions crack once vertices are snapped.
The price is O(n^2) time for a polygon of n corners, which is short for the faces of a mesh. Convex polygons take a vectorised
path. Polygons with holes and other fill rules need new points where edges cross; they are not made here.

Source: Meisters 1975, "Polygons have ears"; the error bound is Shewchuk 1997, "Adaptive precision floating-point arithmetic",
section 4.
"""

from __future__ import annotations

from collections import deque
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ORIENTATION_ERROR = (3.0 + 16.0 * 2.0**-53) * 2.0**-53
"""Relative error of a float64 orientation, times |left| + |right| (Shewchuk's ccwerrboundA)."""

SMALLEST_SAFE = 2.0**-960
"""Below this sum of magnitudes a product may have been rounded to a subnormal, which the relative bound does not cover."""

LOOKS_PER_CORNER = 8
"""Looks at a corner, on average, before the rest is cut as it comes; polygons that do not cross themselves need 1 to 4."""

FEW_POINTS = 32
"""Up to this many corners a Python loop over the reflex ones beats NumPy's cost per call."""


def orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Return the exact sign of twice the area of a, b, c: 1 is a left turn with y up, -1 a right turn, 0 a straight line.

    >>> orientation(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)
    1
    """
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    area = left - right
    size = abs(left) + abs(right)
    if abs(area) > ORIENTATION_ERROR * size and size > SMALLEST_SAFE and size < np.inf:
        return 1 if area > 0 else -1
    return _exact_orientation(ax, ay, bx, by, cx, cy)


def _exact_orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Return the sign of twice the area of a, b, c in rationals."""
    x, y = Fraction(cx), Fraction(cy)
    area = (Fraction(ax) - x) * (Fraction(by) - y) - (Fraction(ay) - y) * (Fraction(bx) - x)
    return (area > 0) - (area < 0)


def orientations(a: FloatArray, b: FloatArray, c: FloatArray) -> IntArray:
    """Return the exact signs of twice the areas of many point triples, each given as an array of shape (..., 2)."""
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        left = (a[..., 0] - c[..., 0]) * (b[..., 1] - c[..., 1])
        right = (a[..., 1] - c[..., 1]) * (b[..., 0] - c[..., 0])
        area = left - right
        size = np.abs(left) + np.abs(right)
        certain = (np.abs(area) > ORIENTATION_ERROR * size) & (size > SMALLEST_SAFE) & (size < np.inf)
    signs = np.where(area > 0, 1, -1).astype(np.int64)

    # Decide the rest in rationals; triples with two equal points are straight and need none.
    equal = np.all(a == b, axis=-1) | np.all(b == c, axis=-1) | np.all(a == c, axis=-1)
    signs[equal] = 0
    for where in zip(*np.nonzero(~certain & ~equal), strict=True):
        signs[where] = _exact_orientation(*a[where].tolist(), *b[where].tolist(), *c[where].tolist())
    return signs


def is_convex(points: FloatArray) -> NDArray[np.bool_]:
    """Say which of N polygons, shape (N, M, 2), turn strictly left at every corner and go round once.

    Left turns alone do not make a convex polygon: a pentagram has them too, and goes round twice. The edges of a polygon that
    goes round once point upward in one run.
    """
    before, after = np.roll(points, 1, axis=1), np.roll(points, -1, axis=1)
    left_turns = np.all(orientations(before, points, after) > 0, axis=1)
    step_x, step_y = after[..., 0] > points[..., 0], after[..., 1] > points[..., 1]
    upward = step_y | ((after[..., 1] == points[..., 1]) & step_x)
    runs = np.sum(upward & ~np.roll(upward, 1, axis=1), axis=1)
    return np.asarray(left_turns & (runs == 1))


def triangulate_polygon(points: ArrayLike) -> IntArray:
    """Cut one polygon without holes into triangles.

    Parameters
    ----------
    points : (M, 2) float64, the corners in order, either way round; the first is not repeated at the end.

    Returns
    -------
    (M - 2, 3) int64, corners of each triangle, turning the same way as the polygon; (0, 3) when M < 3. A polygon that touches
    or crosses itself still gives M - 2 triangles; they are then not a partition. Triangles without area appear only where a
    polygon has repeated points or no area of its own.

    Raises
    ------
    InputError : the shape is not (M, 2), or a coordinate is not finite.

    Examples
    --------
    An arrow head, whose notch a fan from the first corner would fill:

    >>> triangulate_polygon([(0, 0), (4, 2), (0, 4), (1, 2)]).tolist()
    [[3, 0, 1], [3, 1, 2]]
    """
    try:
        corners = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"points: expected numbers of shape (M, 2), {error}") from None
    if corners.size == 0:
        return np.empty((0, 3), dtype=np.int64)
    if corners.ndim != 2 or corners.shape[1] != 2:
        raise InputError(f"points: expected shape (M, 2), got {corners.shape}")
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=1))
    if len(bad):
        raise InputError(f"points[{bad[0]}] = {tuple(corners[bad[0]].tolist())}: a coordinate is not finite")
    return _EarClipper(corners).clip()


class _EarClipper:
    """A ring of corners from which ears are cut.

    Attributes
    ----------
    sign : 1 for a polygon that turns left, -1 for one that turns right.
    turn : at each corner 1 where the ring is convex, 0 where it is straight or doubles back, -1 where it is reflex.
    blunt : corners of the ring that are not convex.
    queue : corners to be looked at, each with its count of changes; a corner that has changed since is passed over.
    waiting : for a corner that stands in the way, the corners it keeps from being ears.
    """

    def __init__(self, points: FloatArray) -> None:
        self.x: list[float] = points[:, 0].tolist()
        self.y: list[float] = points[:, 1].tolist()
        self.points = points
        count = len(points)
        self.before = [(i - 1) % count for i in range(count)]
        self.after = [(i + 1) % count for i in range(count)]
        self.sign = self._turning_sign()
        self.turn = [self._turn_at(i) for i in range(count)]
        self.blunt = np.array(self.turn) <= 0
        self.is_gone = [False] * count
        self.changes = [0] * count
        self.queue = deque((i, 0) for i in range(count))
        self.waiting: dict[int, list[tuple[int, int]]] = {}
        self.place = 0
        self.looks = LOOKS_PER_CORNER * count + 1000
        self.triangles: list[tuple[int, int, int]] = []

    def _turning_sign(self) -> int:
        """Return the exact sign of the polygon's area, 1 for none at all."""
        with np.errstate(over="ignore", invalid="ignore", under="ignore"):
            x, y = self.points[:, 0] - self.x[0], self.points[:, 1] - self.y[0]
            left, right = x[:-1] * y[1:], x[1:] * y[:-1]
            area, size = float(np.sum(left - right)), float(np.sum(np.abs(left) + np.abs(right)))
        if abs(area) > (len(x) + 8) * 2.0**-52 * size and SMALLEST_SAFE < size < np.inf:
            return 1 if area > 0 else -1

        # Add the area up in rationals where rounding could have turned it over.
        exact_x, exact_y = [Fraction(v) for v in self.x], [Fraction(v) for v in self.y]
        exact = sum((exact_x[i] * exact_y[j] - exact_x[j] * exact_y[i] for i, j in enumerate(self.after)), Fraction(0))
        return -1 if exact < 0 else 1

    def _turn_at(self, i: int) -> int:
        """Return 1 where the ring is convex at corner i, 0 where it is straight or doubles back, -1 where it is reflex."""
        a, c = self.before[i], self.after[i]
        return self.sign * orientation(self.x[a], self.y[a], self.x[i], self.y[i], self.x[c], self.y[c])

    def _obstacle(self, i: int) -> int:
        """Return a corner of the ring that lies in the closed triangle at corner i, or -1: then the convex corner i is an ear.

        Only reflex and straight corners are looked at: if any corner lies inside, one of these does. A point equal to a corner
        of the triangle is no obstacle.
        """
        a, c = self.before[i], self.after[i]
        x, y = self.x, self.y
        x_low, x_high = min(x[a], x[i], x[c]), max(x[a], x[i], x[c])
        y_low, y_high = min(y[a], y[i], y[c]), max(y[a], y[i], y[c])
        ends = ((x[a], y[a]), (x[i], y[i]), (x[c], y[c]))
        if len(x) <= FEW_POINTS:
            for j in range(len(x)):
                is_near = self.blunt[j] and x_low <= x[j] <= x_high and y_low <= y[j] <= y_high
                if is_near and (x[j], y[j]) not in ends and self._is_inside(j, a, i, c):
                    return j
            return -1

        # Do the same for a large ring with NumPy, first for a few points: where there are many, one of these is an obstacle.
        px, py = self.points[:, 0], self.points[:, 1]
        near = np.flatnonzero(self.blunt & (px >= x_low) & (px <= x_high) & (py >= y_low) & (py <= y_high))
        for some in (near[:FEW_POINTS], near[FEW_POINTS:]):
            for s, e in ((a, i), (i, c), (c, a)):
                some = some[self.sign * orientations(self.points[s], self.points[e], self.points[some]) >= 0]
            for j in some.tolist():
                if (x[j], y[j]) not in ends:
                    return int(j)
        return -1

    def _is_inside(self, j: int, a: int, b: int, c: int) -> bool:
        """Say whether point j lies in the closed triangle a, b, c, which turns the way of the ring."""
        x, y = self.x, self.y
        sides = ((a, b), (b, c), (c, a))
        return all(self.sign * orientation(x[s], y[s], x[e], y[e], x[j], y[j]) >= 0 for s, e in sides)

    def clip(self) -> IntArray:
        """Cut ears until three corners are left.

        A corner is looked at when it or a neighbour has changed, or when the corner that stood in its way is gone. One that
        has just changed goes to the end of the queue, so that cuts are spread around the ring and slivers are few.
        """
        left = len(self.x)
        while left > 3:
            i = self._next_ear()
            self.triangles.append((self.before[i], i, self.after[i]))
            self._remove(i)
            left -= 1
        if left == 3:
            i = next(i for i in range(len(self.x)) if not self.is_gone[i])
            self.triangles.append((self.before[i], i, self.after[i]))
        return np.array(self.triangles, dtype=np.int64).reshape(-1, 3)

    def _next_ear(self) -> int:
        """Return an ear; where there is none, because the polygon touches or crosses itself, a corner that does least harm."""
        while self.queue and self.looks:
            i, change = self.queue.popleft()
            if self.is_gone[i] or change != self.changes[i] or self.turn[i] <= 0:
                continue
            self.looks -= 1
            obstacle = self._obstacle(i)
            if obstacle < 0:
                return i
            self.waiting.setdefault(obstacle, []).append((i, change))

        # Take a straight corner, else a convex one, within a few steps of the last place, else any.
        best = self.place if not self.is_gone[self.place] else next(i for i in range(len(self.x)) if not self.is_gone[i])
        i = best
        for _ in range(FEW_POINTS):
            if (self.turn[i] == 0, self.turn[i]) > (self.turn[best] == 0, self.turn[best]):
                best = i
            i = self.after[i]
        self.place = self.after[best]
        return best

    def _remove(self, i: int) -> None:
        """Take corner i out of the ring, look again at its neighbours, and wake the corners for which it stood in the way."""
        a, c = self.before[i], self.after[i]
        self.after[a], self.before[c] = c, a
        self.is_gone[i], self.blunt[i] = True, False
        self.queue.extend(self.waiting.pop(i, ()))
        for k in (a, c):
            self.turn[k] = self._turn_at(k)
            self.changes[k] += 1
            self.queue.append((k, self.changes[k]))
            self.blunt[k] = self.turn[k] <= 0
            if not self.blunt[k]:
                self.queue.extend(self.waiting.pop(k, ()))
