"""Homogeneous coordinates: points, directions, lines and planes of the plane and of space, and the matrices that move them.

- elements: `points`, `directions`, `cartesian` and `canonical` go between the ways to write a thing; `is_ideal`, `is_same`.
- incidence: `join` and `meet`, which are one function in the plane; `is_incident`; `side` for lines of space.
- transforms: `translation`, `scaling`, `rotation`, `affine`, `projective_map`; `transform` for points, `transform_lines`,
  `transform_planes` (H M^-1) and `planes_before` (H M).
- matrices: `compose`, `inverse`, `normal_matrix` (the inverse transpose), and products of many points at once.
- cameras: `look_at`, `frustum`, `perspective`, `orthographic`.

A point is a column, a plane is a row; a matrix acts from the left. Every product and sum is written out in a fixed order, in
plain NumPy, so that the bits are the same everywhere: the last bit of a vertex decides pixels.

Source: each module names its own.
"""

from __future__ import annotations

from scanspan.homogeneous.cameras import (
    check_fov,
    check_planes,
    frustum,
    look_at,
    orthographic,
    perspective,
    perspective_depth,
)
from scanspan.homogeneous.checks import FloatArray, finite_array, finite_number, quote, shape_of
from scanspan.homogeneous.elements import (
    LINE_AT_INFINITY,
    PLANE_AT_INFINITY,
    canonical,
    cartesian,
    directions,
    is_ideal,
    is_same,
    points,
)
from scanspan.homogeneous.incidence import is_incident, join, meet, side
from scanspan.homogeneous.matrices import (
    compose,
    cross,
    dot,
    inverse,
    normal_matrix,
    transform_directions,
    transform_points,
    unit,
)
from scanspan.homogeneous.transforms import (
    affine,
    is_affine,
    planes_before,
    projective_map,
    rotation,
    scaling,
    transform,
    transform_lines,
    transform_planes,
    translation,
)

__all__ = [
    "LINE_AT_INFINITY",
    "PLANE_AT_INFINITY",
    "FloatArray",
    "affine",
    "canonical",
    "cartesian",
    "check_fov",
    "check_planes",
    "compose",
    "cross",
    "directions",
    "dot",
    "finite_array",
    "finite_number",
    "frustum",
    "inverse",
    "is_affine",
    "is_ideal",
    "is_incident",
    "is_same",
    "join",
    "look_at",
    "meet",
    "normal_matrix",
    "orthographic",
    "perspective",
    "perspective_depth",
    "planes_before",
    "points",
    "projective_map",
    "quote",
    "rotation",
    "scaling",
    "shape_of",
    "side",
    "transform",
    "transform_directions",
    "transform_lines",
    "transform_planes",
    "transform_points",
    "translation",
    "unit",
]
