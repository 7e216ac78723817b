"""Affine and projective matrices, their inverses, and what they do to points, lines and planes."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from scanspan import homogeneous
from scanspan.assets.lens import Projection
from scanspan.errors import InputError


@pytest.mark.parametrize("side", [3, 4])
def test_the_inverse_of_whole_numbers_is_exact_up_to_one_division(side: int, rng: np.random.Generator) -> None:
    inverted = 0
    for _ in range(200):
        matrix = rng.integers(-4, 5, (side, side))
        rows = [
            [Fraction(int(value)) for value in row] + [Fraction(i == j) for j in range(side)] for i, row in enumerate(matrix)
        ]
        found = reduce_rows(rows)
        if found is None:
            with pytest.raises(InputError, match=r"^matrix = .*: expected a matrix that can be inverted$"):
                homogeneous.inverse(matrix)
            continue
        inverted += 1
        assert np.allclose(homogeneous.inverse(matrix), np.array(found, float), rtol=3e-16, atol=0)
    assert inverted > 150


def reduce_rows(rows: list[list[Fraction]]) -> list[list[float]] | None:
    """Return the right half of a matrix and the identity after elimination, or None for one that is singular."""
    side = len(rows)
    for k in range(side):
        pivot = next((i for i in range(k, side) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for i in range(side):
            if i != k:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [[float(value) for value in row[side:]] for row in rows]


def test_numbers_of_any_size_are_inverted(rng: np.random.Generator) -> None:
    assert np.array_equal(homogeneous.inverse(np.diag([2.0**-900, 2.0**900, 4.0])), np.diag([2.0**900, 2.0**-900, 0.25]))
    matrix = rng.normal(size=(4, 4))
    rows, columns = 2.0 ** rng.integers(-200, 200, (4, 1)), 2.0 ** rng.integers(-200, 200, (1, 4))
    assert np.allclose(homogeneous.inverse(matrix * rows * columns) * rows.T * columns.T, np.linalg.inv(matrix), rtol=1e-9)
    with pytest.raises(InputError, match=r"expected a matrix that can be inverted$"):
        homogeneous.inverse(np.diag([1e-320, 1.0, 1.0]))
    with pytest.raises(InputError, match=r"^matrix = \[1, 2\]: expected numbers of shape \(4, 4\), not shape \(2,\)$"):
        homogeneous.inverse([1, 2])


def test_translations_scalings_and_rotations_move_points_as_they_say() -> None:
    assert homogeneous.transform(homogeneous.translation((1, 2, 3)), (4, 5, 6, 1)).tolist() == [5, 7, 9, 1]
    assert homogeneous.transform(homogeneous.scaling((2, 3, 4)), (1, 1, 1, 1)).tolist() == [2, 3, 4, 1]
    assert homogeneous.transform(homogeneous.scaling((2, 3)), (1, 1, 0)).tolist() == [2, 3, 0]
    for degrees, expected in ((90, (-2, 1)), (-270, (-2, 1)), (180, (-1, -2)), (450, (-2, 1)), (0, (1, 2)), (-90, (2, -1))):
        assert homogeneous.transform(homogeneous.rotation(degrees), (1, 2, 1))[:2].tolist() == list(expected)

    # About an axis as a right-handed screw: x to y about z, and about a diagonal x to y to z.
    assert homogeneous.transform(homogeneous.rotation(90, (0, 0, 7)), (1, 2, 3, 1)).tolist() == [-2, 1, 3, 1]
    turned = homogeneous.transform(homogeneous.rotation(120, (1, 1, 1)), (1, 0, 0, 1))
    assert np.allclose(turned, (0, 1, 0, 1), atol=1e-15)
    matrix = homogeneous.rotation(33, (1, -2, 0.5))[:3, :3]
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
    assert np.allclose(homogeneous.rotation(33) @ homogeneous.rotation(-33), np.eye(3), atol=1e-15)


def test_affine_matrices_leave_infinity_where_it_is_and_frustums_do_not(rng: np.random.Generator) -> None:
    linear, offset = rng.normal(size=(3, 3)), rng.normal(size=3)
    matrix = homogeneous.affine(linear, offset)
    assert homogeneous.is_affine(matrix)
    assert homogeneous.is_affine(-3.0 * matrix)
    assert homogeneous.is_ideal(homogeneous.transform(matrix, homogeneous.directions(rng.normal(size=(9, 3))))).all()
    assert homogeneous.is_same(homogeneous.transform_planes(matrix, (0, 0, 0, 1)), (0, 0, 0, 1))
    assert not homogeneous.is_affine(homogeneous.perspective(45, 1, 1, 9))
    assert homogeneous.is_affine(homogeneous.orthographic(4, 3, 1, 9))
    assert not homogeneous.is_affine(np.zeros((3, 3)))


@pytest.mark.parametrize("width", [3, 4])
def test_incidence_survives_every_transform(width: int, rng: np.random.Generator) -> None:
    matrix = rng.normal(size=(width, width))
    p, q, r = rng.normal(size=(3, 40, width))
    moved = [homogeneous.transform(matrix, points) for points in (p, q, r)]
    line = homogeneous.transform_lines(matrix, homogeneous.join(p, q))
    assert homogeneous.is_same(line, homogeneous.join(moved[0], moved[1]), 1e-9).all()
    if width == 4:
        plane = homogeneous.transform_planes(matrix, homogeneous.join(p, q, r))
        assert homogeneous.is_same(plane, homogeneous.join(*moved), 1e-9).all()
        assert homogeneous.is_same(homogeneous.transform_planes(matrix, homogeneous.planes_before(matrix, q)), q, 1e-9).all()


def test_products_add_up_in_the_order_of_the_columns(rng: np.random.Generator) -> None:
    matrix, points = rng.normal(size=(4, 4)), rng.normal(size=(50, 4))
    columns = points.T
    expected = [columns[0] * m[0] + columns[1] * m[1] + columns[2] * m[2] + columns[3] * m[3] for m in matrix]
    assert np.array_equal(homogeneous.transform(matrix, points), np.stack(expected, axis=1))
    assert np.array_equal(homogeneous.planes_before(matrix.T, points), np.stack(expected, axis=1))
    three = matrix[:3, :3]
    product = np.stack([three[:, 0] * m[0] + three[:, 1] * m[1] + three[:, 2] * m[2] for m in three.T], axis=1)
    assert np.array_equal(homogeneous.compose(three, three), product)


def test_the_planes_of_a_projection_are_found_again() -> None:
    for near, far in ((0.1, 100.0), (1.0, 2.0), (0.5, None)):
        found = Projection(homogeneous.perspective(45, 1.5, near, far)).planes()
        assert found[0] == pytest.approx(near, rel=1e-12)
        assert found[1] is None if far is None else found[1] == pytest.approx(far, rel=1e-9)


@pytest.mark.parametrize("count", [4, 5])
def test_a_map_is_known_by_four_points_of_the_plane_or_five_of_space(count: int, rng: np.random.Generator) -> None:
    matrix, sources = rng.normal(size=(count - 1, count - 1)), rng.normal(size=(count, count - 1))
    targets = homogeneous.transform(matrix, sources) * rng.uniform(1, 3, (count, 1))
    found = homogeneous.projective_map(sources, targets)
    assert np.allclose(found, matrix / matrix[-1, -1], rtol=1e-7, atol=1e-7)

    # A square seen in perspective: its parallel sides meet on the horizon.
    if count == 4:
        square = homogeneous.points([(0, 0), (1, 0), (1, 1), (0, 1)])
        seen = homogeneous.projective_map(square, homogeneous.points([(0, 0), (4, 0), (3, 1), (1, 1)]))
        assert homogeneous.cartesian(homogeneous.transform(seen, (0, 1, 0))) == pytest.approx([2, 2])
        assert homogeneous.is_ideal(homogeneous.transform(seen, (1, 0, 0)), 1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: homogeneous.projective_map([(0, 0, 1), (1, 0, 1), (2, 0, 1), (0, 1, 1)], np.eye(4)[:, :3]),
            r"^sources = \[\[0\.0, 0\.0, 1\.0\], .*: expected no three on a line$",
        ),
        (lambda: homogeneous.projective_map(np.ones((5, 4)), np.ones((5, 4))), r"^sources = .*: expected no four on a plane$"),
        (
            lambda: homogeneous.projective_map(np.ones((3, 3)), np.ones((3, 3))),
            r"^sources = .*: expected numbers of shape \(5, 4\), not shape \(3, 3\)$",
        ),
        (lambda: homogeneous.rotation(np.inf), r"^degrees = inf: expected a finite number$"),
        (lambda: homogeneous.rotation(90, (0, 0, 0)), r"^axis = \[0\.0, 0\.0, 0\.0\]: expected a direction$"),
        (
            lambda: homogeneous.translation((1, 2, 3, 4)),
            r"^offset = \(1, 2, 3, 4\): expected numbers of shape \(3,\), not shape \(4,\)$",
        ),
        (lambda: homogeneous.scaling(2), r"^factors = 2: expected numbers of shape \(3,\), not shape \(\)$"),
        (
            lambda: homogeneous.affine(np.eye(2), (1, 2, 3)),
            r"^offset = \(1, 2, 3\): expected numbers of shape \(2,\), not shape \(3,\)$",
        ),
        (
            lambda: homogeneous.transform(np.eye(4), (1, 2, 3)),
            r"^matrix = .*: expected numbers of shape \(3, 3\), not shape \(4, 4\)$",
        ),
        (
            lambda: homogeneous.transform(np.eye(3) * 1e200, (1e200, 0, 1)),
            r"^matrix = .*: the product is too large for float64$",
        ),
        (
            lambda: homogeneous.transform_planes(np.zeros((4, 4)), (0, 0, 0, 1)),
            r"^matrix = .*: expected a matrix that can be inverted$",
        ),
        (
            lambda: homogeneous.transform_lines(np.eye(3), (1, 2, 3, 4)),
            r"^lines = \(1, 2, 3, 4\): expected numbers of shape \(\.\.\., 3\) or \(\.\.\., 6\), not shape \(4,\)$",
        ),
        (
            lambda: homogeneous.planes_before(np.eye(4), (1, 2, 3)),
            r"^planes = \(1, 2, 3\): expected numbers of shape \(\.\.\., 4\), not shape \(3,\)$",
        ),
        (
            lambda: homogeneous.compose(np.eye(3), np.eye(4)),
            r"^b = .*: expected numbers of shape \(3, 3\), not shape \(4, 4\)$",
        ),
        (lambda: homogeneous.is_affine([1, 2]), r"^matrix = \[1, 2\]: expected numbers of shape \(4, 4\), not shape \(2,\)$"),
    ],
)
def test_what_cannot_be_used_is_refused(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(InputError, match=message):
        call()
