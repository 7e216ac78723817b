"""Join, meet and incidence, against exact rationals; what is the same, what is at infinity, and what is nothing."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from scanspan import homogeneous
from scanspan.errors import InputError
from scanspan.geometry import depth_plane

Rows = list[list[Fraction]]


def rank(rows: Rows) -> int:
    """Return the rank of a matrix, exactly."""
    rows, found = [row[:] for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((i for i in range(found, len(rows)) if rows[i][column] != 0), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        for i in range(found + 1, len(rows)):
            factor = rows[i][column] / rows[found][column]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[found], strict=True)]
        found += 1
    return found


def exact(*vectors: np.ndarray) -> Rows:
    """Return vectors as rows of Fractions."""
    return [[Fraction(float(value)) for value in vector] for vector in vectors]


def small_vectors(rng: np.random.Generator, count: int, width: int, reach: int = 2) -> np.ndarray:
    """Return small whole numbers, so that coincidences are common; none is all zeros."""
    found = rng.integers(-reach, reach + 1, (2 * count, width)).astype(float)
    return found[found.any(axis=1)][:count]


def test_joins_of_the_plane_against_exact_ranks(rng: np.random.Generator) -> None:
    p, q = small_vectors(rng, 400, 3, 1), small_vectors(rng, 400, 3, 1)
    lines = homogeneous.join(p, q)
    assert homogeneous.is_incident(lines, p, 0.0).all()
    assert homogeneous.is_incident(lines, q, 0.0).all()
    same = np.array([rank(exact(a, b)) == 1 for a, b in zip(p, q)])
    assert 10 < same.sum() < 390
    assert np.array_equal(~lines.any(axis=1), same)
    assert np.array_equal(homogeneous.is_same(p, q, 0.0), same)
    assert np.array_equal(homogeneous.join(q, p), -lines)
    assert np.array_equal(homogeneous.meet(p, q), lines)

    # Three points are on a line where the third is on the join.
    r = small_vectors(rng, 400, 3)
    collinear = [rank(exact(*abc)) < 3 for abc in zip(p, q, r)]
    assert np.array_equal(homogeneous.is_incident(lines, r, 0.0), collinear)


def test_joins_of_space_against_exact_ranks(rng: np.random.Generator) -> None:
    p, q, r, s = (small_vectors(rng, 300, 4) for _ in range(4))
    lines, planes = homogeneous.join(p, q), homogeneous.join(p, q, r)
    ranks = np.array([rank(exact(*abc)) for abc in zip(p, q, r)])
    assert np.array_equal(lines.any(axis=1), [rank(exact(a, b)) == 2 for a, b in zip(p, q)])
    assert np.array_equal(planes.any(axis=1), ranks == 3)
    assert np.array_equal(homogeneous.join(lines, r), planes)
    for point in (p, q, r):
        assert homogeneous.is_incident(planes, point, 0.0).all()
    assert np.array_equal(homogeneous.is_incident(planes, s, 0.0), [rank(exact(*k)) < 4 or rank(exact(*k[:3])) < 3
                                                                   for k in zip(p, q, r, s)])  # fmt: skip

    # A point is on a line where it adds nothing to its two points; two lines meet where their four points are on a plane.
    proper = lines.any(axis=1)
    assert np.array_equal(homogeneous.is_incident(lines[proper], r[proper], 0.0), (ranks < 3)[proper])
    others = homogeneous.join(r, s)
    proper &= others.any(axis=1)
    coplanar = np.array([rank(exact(*k)) < 4 for k in zip(p, q, r, s)])
    assert 10 < coplanar[proper].sum() < proper.sum() - 10
    assert np.array_equal((homogeneous.side(lines, others) == 0.0)[proper], coplanar[proper])


def test_meets_of_space_are_the_joins_of_the_dual(rng: np.random.Generator) -> None:
    a, b, c = (small_vectors(rng, 300, 4) for _ in range(3))
    lines, found = homogeneous.meet(a, b), homogeneous.meet(a, b, c)
    assert np.array_equal(found.any(axis=1), [rank(exact(*k)) == 3 for k in zip(a, b, c)])
    for plane in (a, b, c):
        assert homogeneous.is_incident(plane, found, 0.0).all()
    assert np.array_equal(homogeneous.meet(lines, c), found)
    assert np.array_equal(lines, np.roll(homogeneous.join(a, b), 3, axis=1))

    # The line on two planes is the line through any two points on both.
    one, other = homogeneous.meet(lines, (1, 2, 3, 4)), homogeneous.meet(lines, (4, -3, 2, 1))
    through = homogeneous.join(one, other)
    known = through.any(axis=1)
    assert known.sum() > 100
    assert homogeneous.is_same(through, lines, 0.0)[known].all()


def test_parallel_things_meet_at_infinity_and_what_is_one_gives_nothing() -> None:
    up, floor = homogeneous.join((1, 2, 0, 1), (1, 2, 5, 1)), (0, 0, 1, -3)
    assert homogeneous.cartesian(homogeneous.meet(up, floor)).tolist() == [1, 2, 3]
    wall, same_wall, far_wall = (1, 0, 0, -1), (-2, 0, 0, 2), (1, 0, 0, -9)
    assert homogeneous.is_ideal(homogeneous.meet(wall, far_wall))
    assert homogeneous.is_ideal(homogeneous.meet(up, far_wall))
    assert homogeneous.canonical(homogeneous.meet(up, far_wall)).tolist() == [0, 0, 1, 0]
    assert not homogeneous.meet(wall, same_wall).any()
    assert not homogeneous.meet(up, wall).any()
    assert not homogeneous.join(up, (1, 2, 9, 1)).any()
    assert not homogeneous.is_ideal(homogeneous.meet(wall, same_wall))
    assert homogeneous.side(up, homogeneous.join((8, 8, 8, 1), (0, 0, 1, 0))) == 0.0


def test_ideal_points_join_to_the_line_at_infinity_and_to_lines_of_a_direction() -> None:
    assert homogeneous.is_same(homogeneous.join((1, 0, 0), (1, 5, 0)), homogeneous.LINE_AT_INFINITY, 0.0)
    plane = homogeneous.join((1, 0, 0, 0), (0, 1, 0, 0), (1, 1, 1, 0))
    assert homogeneous.is_same(plane, homogeneous.PLANE_AT_INFINITY, 0.0)
    assert homogeneous.is_same(homogeneous.join((2, 3, 1), (0, 1, 0)), (1, 0, -2), 0.0)


@pytest.mark.parametrize("share", [1e-13, 1e-11])
def test_tolerances_are_shares_of_what_is_compared(share: float) -> None:
    near = np.array([3.0, 4.0, 5.0]) * (1.0 + share * np.array([0.0, 0.0, 1.0]))
    assert homogeneous.is_same((3, 4, 5), 1e100 * near) == (share < 1e-12)
    assert homogeneous.is_same((3, 4, 5), 1e-300 * near, 1e-10)
    assert not homogeneous.is_same((3, 4, 5), near, 0.0)
    line = homogeneous.join((3, 4, 5), (1, 0, 0))
    assert homogeneous.is_incident(line, near) == (share < 1e-12)
    assert homogeneous.is_ideal((3, 4, 5 * share)) == np.False_
    assert homogeneous.is_ideal((3, 4, 5 * share), 1e-12) == (share < 1e-12)


@pytest.mark.parametrize("size", [1e-308, 1e-200, 1e200, 1e308])
def test_numbers_of_any_size_are_joined(size: float) -> None:
    p, q, r = (np.array(point) * size for point in ((1.0, 0.0, 0.5, 1.0), (0.0, 1.0, 0.25, 1.0), (0.0, 0.0, 1.0, 1.0)))
    plane = homogeneous.join(p, q, r)
    assert homogeneous.is_same(plane, homogeneous.join(p / size, q / size, r / size))
    assert homogeneous.is_incident(plane, (p, q, r)).all()
    assert homogeneous.is_incident(homogeneous.join(p, q), (p, q)).all()
    assert not homogeneous.is_incident(homogeneous.join(p, q), r)
    assert homogeneous.is_same(homogeneous.join(p[:3], q[:3]), homogeneous.join(p[:3] / size, q[:3] / size))
    assert homogeneous.side(homogeneous.join(p, q), homogeneous.join(r, (0, 0, 0, 1))) != 0.0
    assert np.allclose(homogeneous.cartesian(p), (1, 0, 0.5))


def test_points_directions_and_canonical_forms_keep_the_shape_of_what_came(rng: np.random.Generator) -> None:
    flat, deep = rng.normal(size=(4, 5, 2)), rng.normal(size=(6, 3))
    assert np.array_equal(homogeneous.cartesian(homogeneous.points(flat)), flat)
    assert np.array_equal(homogeneous.cartesian(-2.0 * homogeneous.points(deep)), deep)
    assert homogeneous.is_ideal(homogeneous.directions(flat)).all()
    assert homogeneous.directions(deep).shape == (6, 4)
    once = homogeneous.canonical(7.0 * homogeneous.points(deep))
    assert np.allclose(once, homogeneous.points(deep), rtol=1e-15)
    assert homogeneous.canonical([0, 0, 0, 4, 0, 0]).tolist() == [0, 0, 0, 1, 0, 0]
    assert homogeneous.points(np.zeros((0, 2))).shape == (0, 3)


def test_the_kernel_that_joins_corners_is_this_join(rng: np.random.Generator) -> None:
    for p, q in itertools.pairwise(rng.integers(-1000, 1000, (200, 3)).astype(float)):
        line = homogeneous.join(p, q)
        assert np.array_equal(depth_plane.join.py_func(*p, *q), line)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: homogeneous.join((0, 1), (1, 0)),
            r"^join\[0\] = \(0, 1\): expected numbers of shape \(\.\.\., 3\) or \(\.\.\., 4\) or \(\.\.\., 6\), "
            r"not shape \(2,\)$",
        ),
        (
            lambda: homogeneous.join((0, 1, 1)),
            r"^join: got vectors of \(3,\) numbers, expected \(3, 3\) for points of the plane; \(4, 4\), \(4, 4, 4\) for "
            r"points, or \(6, 4\) for a line and a point of space$",
        ),
        (
            lambda: homogeneous.meet(),
            r"^meet: got vectors of \(\) numbers, expected \(3, 3\) for lines of the plane; \(4, 4\), \(4, 4, 4\) for "
            r"planes, or \(6, 4\) for a line and a plane of space$",
        ),
        (lambda: homogeneous.join((0, 1, np.nan), (1, 0, 1)), r"^join\[0\]\[2\] = nan: expected a finite number$"),
        (
            lambda: homogeneous.meet(np.ones((2, 3)), np.ones((5, 3))),
            r"^meet\[0\] of \(2, 3\), meet\[1\] of \(5, 3\): expected shapes that go together$",
        ),
        (
            lambda: homogeneous.side((1, 0, 0), (0, 1, 0)),
            r"^a = \(1, 0, 0\): expected numbers of shape \(\.\.\., 6\), not shape \(3,\)$",
        ),
        (
            lambda: homogeneous.is_incident((1, 0, 0, 0), (0, 0, 1)),
            r"^element of shape \(4,\), point of shape \(3,\): expected both in the plane or in space$",
        ),
        (lambda: homogeneous.is_incident((1, 0, 0), (0, 0, 1), -1), r"^tolerance = -1\.0: expected a share of at least 0$"),
        (lambda: homogeneous.is_same((1, 0, 0), (0, 0, 1, 1)), r"^a has 3 numbers and b 4: expected as many$"),
        (
            lambda: homogeneous.canonical([(1, 2, 3), (0, 0, 0)]),
            r"^vectors\[1\] = \(0\.0, 0\.0, 0\.0\): expected one that is not all zeros$",
        ),
        (
            lambda: homogeneous.cartesian([[(1, 2, 3)], [(1, 2, 0)]]),
            r"^points\[1, 0\] = \(1\.0, 2\.0, 0\.0\) is an ideal point: expected one with W not 0$",
        ),
        (
            lambda: homogeneous.cartesian((1e300, 1, 1e-300)),
            r"^points = \(1e\+300, 1\.0, 1e-300\): divided by its last number it is too large for float64$",
        ),
        (
            lambda: homogeneous.canonical([(1, 0, 0), (1, 0, 5e-324)]),
            r"^vectors\[1\] = \(1\.0, 0\.0, 5e-324\): divided by its last number it is too large for float64$",
        ),
        (
            lambda: homogeneous.points([[1, 2], [3]]),
            r"^points = \[\[1, 2\], \[3\]\]: expected numbers of shape \(\.\.\., 2\) or \(\.\.\., 3\), not a ragged list$",
        ),
        (
            lambda: homogeneous.directions("up"),
            r"^directions = 'up': expected numbers of shape \(\.\.\., 2\) or \(\.\.\., 3\), not shape \(\)$",
        ),
        (
            lambda: homogeneous.points([True, False]),
            r"^points = \[True, False\]: expected numbers of shape \(2,\), not type bool$",
        ),
    ],
)
def test_what_cannot_be_used_is_refused(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(InputError, match=message):
        call()
