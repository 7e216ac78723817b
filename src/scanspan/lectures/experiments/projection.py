"""Experiments on homogeneous coordinates: lines through points, points at infinity, what a projection does to planes, a model.

Source: S3, lines 386-608; S0, lines 568-571; S4, lines 724-728.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from scanspan.assets.load import load
from scanspan.homogeneous import cross, frustum
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table, written
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREEN,
    GREY,
    PALE,
    RED,
    Axis,
    chart,
    panel,
    with_dots,
    with_outlines,
)
from scanspan.lectures.experiments.shapes import sphere
from scanspan.pipeline import render
from scanspan.records import Float64Array, UInt8Array


def triple(vector: Float64Array) -> str:
    """Return homogeneous coordinates as text.

    >>> triple(np.array([1.0, -0.0, 2.5]))
    '(1, 0, 2.5)'
    """
    return "(" + ", ".join(f"{value + 0.0:g}" for value in vector) + ")"


def blank(side: int = 220) -> UInt8Array:
    """Return a white picture with the axes of a plane from -2 to 2."""
    picture = np.full((side, side, 3), 255, np.uint8)
    axes: list[list[tuple[float, float]]] = [[(0, side / 2), (side, side / 2)], [(side / 2, 0), (side / 2, side)]]
    return with_outlines(picture, axes, 1, PALE, 1.2, closed=False)


def placed(points: list[tuple[float, float]], side: int = 220) -> Float64Array:
    """Return places of that plane, y up, in the picture."""
    found = np.array(points, np.float64)
    return np.stack([side / 2 + found[:, 0] * side / 4, side / 2 - found[:, 1] * side / 4], axis=1)


def points_and_lines() -> Result:
    """Join points and meet lines by the cross product, for the slide's examples and its questions."""
    p, q, line, other = np.array([0, 1, 1]), np.array([1, 0, 1]), np.array([1, 1, -1]), np.array([1, -1, 0])
    left, right = np.array([1, 0, -1]), np.array([1, 0, 1])
    met = cross(line, other)
    pairs = (
        ("points (0, 1, 1) and (1, 0, 1): the line x + y - 1 = 0", p, q),
        ("lines (1, 1, -1) and (1, -1, 0): the point (0.5, 0.5)", line, other),
        ("parallel lines (1, 0, -1) and (1, 0, 1): a point at infinity", left, right),
        ("the other way round: the same, antipodal", right, left),
        ("a point and itself: no line", p, p),
        ("a line and twice itself: no point", line, 2 * line),
    )
    rows: list[Row] = [(name, triple(cross(a, b))) for name, a, b in pairs]
    rows += [
        ("the meeting point divided by W", triple(met[:2] / met[2])),
        ("line . p and line . q: both points are on it", triple(np.array([p, q]) @ cross(p, q))),
        ("duality: the line of the two points, the point of the two lines", "one and the same function"),
    ]
    move = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0], [0.0, 0.0, 1.0]])
    rows.append(("(0, 0, 1) moved by (3, -2): no 2 x 2 matrix does that", triple(move @ (0, 0, 1))))
    rows.append(("the direction (1, 1, 0) moved by (3, -2)", triple(move @ (1, 1, 0))))

    # Lines with the points that make them and the one they make, and points that go to infinity.
    first = with_outlines(blank(), [placed([(-3, 4), (4, -3)])], 1, BLUE, closed=False)
    first = with_outlines(first, [placed([(-3, -3), (3, 3)])], 1, GREEN, closed=False)
    first = with_dots(with_dots(first, placed([(0, 1), (1, 0)]), 1, BLUE, 9), placed([(0.5, 0.5)]), 1, RED, 9)
    second = blank()
    for w in (1.0, 0.75, 0.5, 0.35, 0.25):
        second = with_dots(second, placed([(0.4 / w, 0.25 / w), (-0.4 / w, -0.25 / w)]), 1, RED, 4 + 5 * w)
    second = with_outlines(second, [placed([(-3.2, -2), (3.2, 2)])], 1, GREY, 1, closed=False)
    panels = (
        panel("Two points make the blue line; with the green one it makes the red point.", first),
        panel("(0.4, 0.25, W) as W goes to 0 from 1 and from -1: one point at infinity", second),
    )
    return Result(Table(("what is crossed", "result"), tuple(rows)), panels)


def planes_in_perspective() -> Result:
    """Send the centre of projection and several planes through the frustum matrix, near = 1 and far = 2."""
    near, far = 1.0, 2.0
    matrix = frustum(-1, 1, -1, 1, near, far)
    back = np.linalg.inv(matrix)
    rows: list[Row] = [("centre of projection (0, 0, 0, 1)", triple(matrix @ (0, 0, 0, 1)), "at infinity")]
    planes = {
        "plane z = 0, through it": (0, 0, 1, 0),
        "projection plane z = -near": (0, 0, 1, near),
        "plane z = -far": (0, 0, 1, far),
        "plane at infinity": (0, 0, 0, 1),
    }
    for name, plane in planes.items():
        found = np.array(plane) @ back
        where = "at infinity" if abs(found[2]) < 1e-12 else f"z' = {-found[3] / found[2]:g}"
        rows.append((f"{name}: {triple(np.array(plane))}", triple(np.round(found, 12)), where))
    rows.append(("(far + near) / (far - near)", (far + near) / (far - near), ""))
    rows.append(("far to infinity: z' of the plane at infinity", (1e9 + near) / (1e9 - near), ""))
    point = np.array([0.3, -0.2, -1.7, 1.0])
    tilted = np.array([0.2, 0.7, 0.4, -0.3])
    both = float(tilted @ point), float((tilted @ back) @ (matrix @ point))
    rows.append(("H p and (H M^-1) (M p), for a plane and a point", *map(written, both)))

    # Depth after projection over depth before it, in front of the eye and behind.
    ahead, behind = np.linspace(0.62, 8, 60), np.linspace(-8, -1.2, 60)
    curves = [(name, z, depth_after(matrix, z)) for name, z in (("in front of the eye", ahead), ("behind it", behind))]
    curves.append(("where the plane at infinity goes", np.array([-8.0, 8.0]), np.array([3.0, 3.0])))
    shown = chart(curves, Axis("distance before the eye"), Axis("z' = Z / W"))
    headings = ("", "after M, or H M^-1", "which is")
    caption = "From near = 1 to far = 2 z' goes from -1 to 1; what is behind the eye comes back from beyond 3."
    return Result(Table(headings, tuple(rows)), (panel(caption, shown),))


def depth_after(matrix: Float64Array, distance: Float64Array) -> Float64Array:
    """Return z' of points straight before the eye."""
    moved = np.stack([np.zeros_like(distance), np.zeros_like(distance), -distance, np.ones_like(distance)], axis=1) @ matrix.T
    found: Float64Array = moved[:, 2] / moved[:, 3]
    return found


def model() -> Result:
    """Write a model to a file, read it in, and show it."""
    points, triangles = sphere(24)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ball.obj"
        path.write_text("\n".join(lines))
        scene = load(path)
    looks: dict[str, dict[str, Any]] = {
        "flat, one sample a pixel": {"shading": "flat", "samples": 1},
        "smooth, four samples": {"shading": "smooth"},
        "with its edges": {"shading": "smooth", "edges": True, "line_width": 0.6},
    }
    frames = [(name, render(scene, "iso", (180, 150), background="white", **look)) for name, look in looks.items()]
    frame = frames[1][1]
    rows = (
        ("lines of the file", len(lines)),
        ("vertices", len(points)),
        ("triangles", len(triangles)),
        ("visible faces", len(np.unique(frame.primitive)) - 1),
        ("pixels covered, %", 100 * frame.coverage),
    )
    return Result(Table(("", ""), rows), tuple(panel(name, one.color, 1) for name, one in frames))


EXPERIMENTS = (
    Experiment(
        "points-and-lines", "S3", "386-494", "Incidence of Lines and Points",
        "Lines of points, points of lines",
        "With a third coordinate the line through two points and the point on two lines are one function, the cross "
        "product. Parallel lines meet in a point with W = 0, a direction; crossed the other way round they give the "
        "antipodal direction, which is the same. A point with itself gives (0, 0, 0), which is nothing.",
        points_and_lines, (100, 101, 102, 103, 104, 105, 106, 107), cross, "ay * bz - az * by",
    ),
    Experiment(
        "planes-in-perspective", "S3", "509-608", "What happens to plane at infinity?",
        "What a projection does to planes",
        "The frustum matrix sends the eye to infinity, and with it the plane through the eye; near goes to -1, far to 1, "
        "and the plane at infinity to a place not far behind: z' = 3 for near 1 and far 2. Planes are rows and go with "
        "the inverse.",
        planes_in_perspective, (109, 110, 111, 112, 113, 114, 115), frustum, "[0.0, 0.0, -1.0, 0.0]",
    ),
    Experiment(
        "read-a-model", "S0", "568-571", "Next Time",
        "Read in and display a 3D model",
        "What the lecture announces: a file with vertices and faces, read, projected, scan-converted and shaded.",
        model, (119, 124), render, "draw = assemble(",
    ),
)  # fmt: skip
