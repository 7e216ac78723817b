"""Each type of shape: from its fields and what is in force to faces, lines or points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.assets.inventor import nurbs
from scanspan.assets.inventor.build import Builder, Indices, colors_at, default_uv, project, reverse_faces, transform_uv
from scanspan.assets.inventor.corners import (
    NO_INDEX,
    Corners,
    Runs,
    bind,
    counted_runs,
    face_corners,
    indexed_runs,
    line_corners,
    quad_corners,
    strip_corners,
)
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.lettering import set_lines
from scanspan.assets.inventor.solids import grid_faces, has_part, make_cone, make_cube, make_cylinder, make_sphere
from scanspan.assets.inventor.state import State, use_vertex_property
from scanspan.assets.polygons import Polygons
from scanspan.errors import InputError, LimitError
from scanspan.homogeneous import FloatArray

MARKER_SIZE = 7.0  # pixels

Shape = Callable[[Builder, Node, State], None]


def draw_shape(builder: Builder, node: Node, state: State) -> None:
    """Add what a shape draws; a shape that cannot be drawn becomes a note."""
    if state.style == "INVISIBLE":
        return
    known = node.fields.get("vertexProperty")
    if isinstance(known, Node) and known.kind == "VertexProperty":
        state = state.copy()
        use_vertex_property(state, known)
    geometries = builder.recall(node, state)
    if geometries is None:
        geometries = builder.current
        try:
            SHAPES[node.kind](builder, node, state)
        except LimitError:
            raise
        except InputError as error:
            node.note(f"{node.kind} is left out: {error}")
    is_lit = node.kind not in UNLIT or (len(state.normals) > 0 and node.kind in HAVE_NORMALS)
    builder.place(node, state, geometries, is_lit)


# Faces, lines and points of vertices


def draw_vertices(builder: Builder, node: Node, state: State, corners: Corners, is_indexed: bool) -> None:
    """Add faces by their corners."""
    corners = within(corners, len(state.points), 3, node)
    if state.ordering == "CLOCKWISE":
        corners = reverse_faces(corners)
    if not len(corners.vertex):
        return
    normals = normals_of(node, state, corners, is_indexed)
    number = bind(state.material_binding, corners, index_field(node, "materialIndex"), is_indexed)
    colors = None if number is None else colors_at(state, number)
    uv = None if state.texture is None else uv_of(node, state, corners, is_indexed)
    builder.add_faces(node, state, corners.vertex, corners.counts, normals, colors, uv)


def within(corners: Corners, available: int, fewest: int, node: Node) -> Corners:
    """Return the faces that have enough corners, all of which exist."""
    counts = corners.counts
    bad = corners.vertex >= available
    keep = counts >= fewest
    if bad.any():
        number = np.repeat(np.arange(len(counts)), counts)
        keep = keep & (np.bincount(number[bad], minlength=len(counts)) == 0)
        worst = int(corners.vertex.max())
        node.note(f"{node.kind} names coordinate {worst}, there are {available}; what uses such is left out")
    return corners if keep.all() else corners.keep(keep)


def normals_of(node: Node, state: State, corners: Corners, is_indexed: bool) -> FloatArray | None:
    """Return the normals at the corners, None where they are to be made."""
    available = len(state.normals)
    if not available:
        return None
    number = bind(state.normal_binding, corners, index_field(node, "normalIndex"), is_indexed)
    if number is None:
        return np.tile(state.normals[0], (len(corners.vertex), 1))
    if number.max() >= available:
        node.note(f"{node.kind} needs {int(number.max()) + 1} normals, there are {available}; they are made anew")
        return None
    return np.asarray(state.normals[number])


def uv_of(node: Node, state: State, corners: Corners, is_indexed: bool) -> FloatArray:
    """Return the texture coordinates at the corners."""
    if state.plane is not None:
        uv = project(state.points[corners.vertex], *state.plane)
    elif state.uv is None or not len(state.uv):
        uv = default_uv(state.points[corners.vertex])
    else:
        binding = state.uv_binding if state.uv_binding.startswith("PER_VERTEX") else "PER_VERTEX_INDEXED"
        number = bind(binding, corners, index_field(node, "textureCoordIndex"), is_indexed)
        assert number is not None
        if number.max() >= len(state.uv):
            node.note(f"{node.kind} needs {int(number.max()) + 1} texture coordinates, there are {len(state.uv)}")
        uv = state.uv[np.minimum(number, len(state.uv) - 1)]
    return transform_uv(uv, state)


def index_field(node: Node, name: str) -> Indices:
    """Return a field of indices, only -1 where the type has none."""
    return np.asarray(node.get(name)) if name in node.type.fields else NO_INDEX


def runs_of(node: Node, state: State) -> Runs:
    """Return the runs of vertices of a shape with indices, or with counts."""
    if "coordIndex" in node.type.fields:
        indices = node.get("coordIndex")
        return indexed_runs(indices)
    counts = node.get("numVertices")
    runs, is_enough = counted_runs(counts, int(node.get("startIndex")), len(state.points))
    if not is_enough:
        wanted = int(counts[counts > 0].sum()) + int(node.get("startIndex"))
        node.note(f"{node.kind} needs {wanted} coordinates, there are {len(state.points)}; what they do not reach is left out")
    return runs


def draw_faces(builder: Builder, node: Node, state: State) -> None:
    """Add an IndexedFaceSet or a FaceSet."""
    draw_vertices(builder, node, state, face_corners(runs_of(node, state)), "coordIndex" in node.type.fields)


def draw_strips(builder: Builder, node: Node, state: State) -> None:
    """Add an IndexedTriangleStripSet or a TriangleStripSet."""
    draw_vertices(builder, node, state, strip_corners(runs_of(node, state)), "coordIndex" in node.type.fields)


def draw_quads(builder: Builder, node: Node, state: State) -> None:
    """Add a QuadMesh."""
    rows, width, first = (int(node.get(name)) for name in ("verticesPerColumn", "verticesPerRow", "startIndex"))
    if rows < 2 or width < 2:
        return
    left = len(state.points) - first
    if rows * width > left or first < 0:
        node.note(
            f"QuadMesh needs {rows} x {width} coordinates from {first} on, there are {len(state.points)}; some are left out"
        )
        first = max(first, 0)
        rows = min(rows, max(len(state.points) - first, 0) // width)
    draw_vertices(builder, node, state, quad_corners(rows, width, first), False)


def draw_lines(builder: Builder, node: Node, state: State) -> None:
    """Add an IndexedLineSet or a LineSet."""
    if state.style == "POINTS":
        draw_points(builder, node, state)
        return
    corners = within(line_corners(runs_of(node, state)), len(state.points), 2, node)
    if len(corners.vertex):
        number = bind(state.material_binding, corners, index_field(node, "materialIndex"), "coordIndex" in node.type.fields)
        colors = None if number is None else colors_at(state, number)
        builder.add_lines(state, state.points[corners.vertex], colors)


def draw_points(builder: Builder, node: Node, state: State) -> None:
    """Add the vertices of a shape as points."""
    if "coordIndex" in node.type.fields:
        indices = node.get("coordIndex")
        vertex = indices[indices >= 0]
        place = np.flatnonzero(indices >= 0)
    else:
        count = node.get("numPoints") if "numPoints" in node.type.fields else -1
        runs, is_enough = counted_runs(np.array([int(count)]), int(node.get("startIndex")), len(state.points))
        if not is_enough:
            node.note(
                f"{node.kind} needs {int(count)} coordinates, there are {len(state.points)}; all that there are are drawn"
            )
            runs, _ = counted_runs(NO_INDEX, int(node.get("startIndex")), len(state.points))
        vertex, place = runs.vertex, runs.place
    number = np.arange(len(vertex))
    corners = within(Corners(vertex, np.ones_like(vertex), number, number, number, place), len(state.points), 1, node)
    bound = bind(state.material_binding, corners, index_field(node, "materialIndex"), "coordIndex" in node.type.fields)
    colors = None if bound is None else colors_at(state, bound)
    size = MARKER_SIZE if node.kind in ("MarkerSet", "IndexedMarkerSet") else None
    builder.add_points(state, state.points[corners.vertex], colors, size)


# Surfaces and curves


def control_points(node: Node, state: State, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the control points of a curve or a surface, and their weights."""
    indices = node.get("coordIndex") if "coordIndex" in node.type.fields else np.arange(min(count, len(state.points)))
    indices = indices[indices >= 0][:count]
    if len(indices) < count or count < 1 or (indices >= len(state.points)).any():
        raise InputError(f"expected {count} control points, there are {len(state.points)}")
    weights = np.ones(len(state.points)) if state.weights is None else state.weights
    return state.points[indices], weights[indices]


def draw_surface(builder: Builder, node: Node, state: State) -> None:
    """Add a NurbsSurface or an IndexedNurbsSurface."""
    width, rows = int(node.get("numUControlPoints")), int(node.get("numVControlPoints"))
    knots = node.get("uKnotVector"), node.get("vKnotVector")
    problem = nurbs.fault(knots[0], width) or nurbs.fault(knots[1], rows)
    if problem:
        raise InputError(problem)
    points, weights = control_points(node, state, width * rows)
    shape = rows, width
    grid = nurbs.evaluate_surface(points.reshape(*shape, 3), weights.reshape(shape), *knots, state.complexity)
    if state.profiles:
        node.note(f"the trimming curves of {node.kind} are not applied; it is drawn whole")
    vertex, counts = grid_faces(grid.rows, grid.width)
    uv = transform_uv(grid.uv, state)[vertex] if state.texture is not None else None
    builder.add_faces(node, state, vertex, counts, grid.normals[vertex], None, uv, grid.points)


def draw_curve(builder: Builder, node: Node, state: State) -> None:
    """Add a NurbsCurve or an IndexedNurbsCurve."""
    count, knots = int(node.get("numControlPoints")), node.get("knotVector")
    problem = nurbs.fault(knots, count)
    if problem:
        raise InputError(problem)
    points, weights = control_points(node, state, count)
    curve = nurbs.evaluate_curve(points, weights, knots, state.complexity)
    builder.add_lines(state, np.stack([curve[:-1], curve[1:]], axis=1).reshape(-1, 3), None)


# Solids and text


def draw_text3(builder: Builder, node: Node, state: State) -> None:
    """Add a Text3: its front, its back, and its sides as deep as the profile says; an AsciiText has a front alone."""
    lines, size, spacing = node.get("string"), state.font_size, node.get("spacing")
    letters = set_lines(lines, size, spacing, node.get("justification"))
    if not letters:
        return
    parts = node.get("parts") if node.kind == "Text3" else ("FRONT",)
    parts = parts or ("FRONT",)
    depth = float(state.profile[:, 0].max(initial=0.0)) if state.profiles else 1.0
    if state.profiles and len(state.profile) and (state.profile[:, 1] != state.profile[0, 1]).any():
        builder.file.note("the profile of Text3 gives its depth alone: its sides are straight, without bevel")
    if node.kind == "AsciiText" and (node.get("width") > 0.0).any():
        builder.file.note("the width of AsciiText is not applied: lines are as long as their letters")
    if state.clip_planes:
        node.note(f"clipping planes cut the sides of {node.kind} alone, not its front and back")

    def at(z: float, step: int) -> list[list[FloatArray]]:
        return [[np.pad(ring, ((0, 0), (0, 1)), constant_values=z)[::step] for ring in rings] for rings in letters]

    per_part = len(state.diffuse) > 1 and state.material_binding.startswith("PER_PART")
    for number, (name, z, step) in enumerate((("FRONT", 0.0, 1), ("BACK", -depth, -1))):
        if has_part(parts, name):
            colors = colors_at(state, np.array([2 * number])) if per_part else None
            builder.current.append(Polygons(at(z, step), colors=None if colors is None else colors[0]))
    if has_part(parts, "SIDES") and depth > 0.0:
        add_text_sides(builder, node, state, letters, depth, per_part)


def add_text_sides(
    builder: Builder, node: Node, state: State, letters: list[list[FloatArray]], depth: float, per_part: bool
) -> None:
    """Add the sides of letters: a quadrilateral for each edge of their outlines."""
    rings = [ring for letter in letters for ring in letter]
    start = np.concatenate(rings)
    end = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    corners = [np.column_stack([end, np.zeros(len(end))]), np.column_stack([start, np.zeros(len(start))])]
    corners += [np.column_stack([start, np.full(len(start), -depth)]), np.column_stack([end, np.full(len(end), -depth)])]
    points = np.stack(corners, axis=1).reshape(-1, 3)
    vertex = np.arange(len(points))
    colors = colors_at(state, np.ones(len(vertex), np.int64)) if per_part else None
    smooth = state.copy()
    smooth.crease_angle = max(state.crease_angle, 0.6)
    builder.add_faces(node, smooth, vertex, np.full(len(start), 4), None, colors, None, points)


SHAPES: dict[str, Shape] = {
    "IndexedFaceSet": draw_faces,
    "FaceSet": draw_faces,
    "IndexedTriangleStripSet": draw_strips,
    "TriangleStripSet": draw_strips,
    "QuadMesh": draw_quads,
    "IndexedLineSet": draw_lines,
    "LineSet": draw_lines,
    "PointSet": draw_points,
    "IndexedPointSet": draw_points,
    "MarkerSet": draw_points,
    "NurbsSurface": draw_surface,
    "IndexedNurbsSurface": draw_surface,
    "NurbsCurve": draw_curve,
    "IndexedNurbsCurve": draw_curve,
    "Text3": draw_text3,
    "AsciiText": draw_text3,
    "Cube": lambda b, n, s: b.add_solid(n, s, make_cube(n.get("width"), n.get("height"), n.get("depth")), True),
    "Sphere": lambda b, n, s: b.add_solid(n, s, make_sphere(n.get("radius"), s.complexity), False),
    "Cone": lambda b, n, s: b.add_solid(
        n, s, make_cone(n.get("bottomRadius"), n.get("height"), s.complexity, n.get("parts")), True
    ),
    "Cylinder": lambda b, n, s: b.add_solid(
        n, s, make_cylinder(n.get("radius"), n.get("height"), s.complexity, n.get("parts")), True
    ),
}
"""How each type of shape is drawn."""

HAVE_NORMALS = ("IndexedLineSet", "LineSet", "PointSet", "IndexedPointSet")
UNLIT = (*HAVE_NORMALS, "MarkerSet", "NurbsCurve", "IndexedNurbsCurve", "Text2")
"""Lines and points without normals are drawn in their colour, without light."""
