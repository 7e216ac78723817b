"""Transformation nodes as matrices for columns, and what units and resets do.

Inventor multiplies rows: a point is p M, and a matrix stands in a file with its translation in the last row. Here points are
columns, so each matrix is transposed once, when it is made.

Source: the reference pages of Transform, Units and ResetTransform of Inventor 2.1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.state import UNIT_LENGTHS, State
from scanspan.homogeneous import FloatArray, compose

AXES = {"X": 0, "Y": 1, "Z": 2}


def translation(vector: FloatArray) -> FloatArray:
    """Return the matrix of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


def scaling(factors: FloatArray | float) -> FloatArray:
    """Return the matrix of a scaling."""
    return np.diag([*np.broadcast_to(np.asarray(factors, dtype=np.float64), 3).tolist(), 1.0])


def rotation(quaternion: FloatArray) -> FloatArray:
    """Return the matrix of a quaternion x y z w of any length.

    >>> rotation(np.array([0.0, 0.0, 1.0, 1.0])).round(12)[:2, :2].tolist()
    [[0.0, -1.0], [1.0, 0.0]]
    """
    length = float(np.sqrt((quaternion * quaternion).sum()))
    if not (np.isfinite(length) and length > 0.0):
        return np.eye(4)
    x, y, z, w = (quaternion / length).tolist()
    matrix = np.eye(4)
    matrix[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return matrix


def about_axis(axis: int, angle: float) -> FloatArray:
    """Return the matrix of a rotation about x, y or z by an angle in radians."""
    turn = np.zeros(4)
    turn[axis], turn[3] = np.sin(angle / 2.0), np.cos(angle / 2.0)
    return rotation(turn)


def chain(*matrices: FloatArray) -> FloatArray:
    """Return the product of matrices, the last of which acts first."""
    product = matrices[0]
    for matrix in matrices[1:]:
        product = compose(product, matrix)
    return product


def transform_of(node: Node) -> FloatArray:
    """Return the matrix of a Transform: scaled along turned axes and rotated about a centre, then moved."""
    centre, turn = node.get("center"), rotation(node.get("scaleOrientation"))
    parts = [translation(node.get("translation") + centre), rotation(node.get("rotation"))]
    if (node.get("scaleFactor") != 1.0).any():
        parts += [turn, scaling(node.get("scaleFactor")), turn.T]
    return chain(*parts, translation(-centre))


MATRICES: dict[str, Callable[[Node], FloatArray]] = {
    "Translation": lambda node: translation(node.get("translation")),
    "Rotation": lambda node: rotation(node.get("rotation")),
    "RotationXYZ": lambda node: about_axis(AXES[node.get("axis")], node.get("angle")),
    "Scale": lambda node: scaling(node.get("scaleFactor")),
    "Transform": transform_of,
    "MatrixTransform": lambda node: node.get("matrix").T,
    "Rotor": lambda node: rotation(node.get("rotation")),
    "Pendulum": lambda node: rotation(node.get("rotation0")),
    "Shuttle": lambda node: translation(node.get("translation0")),
}
"""What each type multiplies the transformation by; what moves stands where it begins."""


def apply_transform(state: State, node: Node) -> None:
    """Multiply the transformation by a node's matrix."""
    state.transform = compose(state.transform, MATRICES[node.kind](node))


def apply_units(state: State, node: Node) -> None:
    """Scale from the units in force to others."""
    length = UNIT_LENGTHS[node.get("units")]
    state.transform = compose(state.transform, scaling(length / state.units))
    state.units = length


def reset_transform(state: State, node: Node) -> None:
    """Take the transformation back to the world's."""
    words = node.get("whatToReset")
    if not words or "TRANSFORM" in words or "BOTH" in words:
        state.transform = np.eye(4)


def unsquish(state: State, node: Node) -> None:
    """Make the scales along the three axes equal."""
    linear = state.transform[:3, :3]
    lengths = np.sqrt((linear * linear).sum(axis=0))
    if not (np.isfinite(lengths).all() and (lengths > 0).all()):
        return
    wanted = {"X": lengths[0], "Y": lengths[1], "Z": lengths[2], "BIGGEST_DIMENSION": lengths.max()}
    wanted |= {"SMALLEST_DIMENSION": lengths.min(), "LONGEST_DIAGONAL": float(np.sqrt((lengths * lengths).sum() / 3.0))}
    state.transform = compose(state.transform, scaling(wanted.get(node.get("sizing"), lengths.mean()) / lengths))


def texture_transform(node: Node) -> FloatArray:
    """Return the (3, 3) matrix of a Texture2Transform, for columns."""
    cosine, sine = np.cos(node.get("rotation")), np.sin(node.get("rotation"))
    (cx, cy), (x, y), (sx, sy) = (node.get(name).tolist() for name in ("center", "translation", "scaleFactor"))
    linear = np.array([[cosine * sx, -sine * sy], [sine * sx, cosine * sy]])
    matrix = np.eye(3)
    matrix[:2, :2] = linear
    matrix[:2, 2] = (x + cx - linear[0, 0] * cx - linear[0, 1] * cy, y + cy - linear[1, 0] * cx - linear[1, 1] * cy)
    return matrix
