"""Shapes to instances: what is in force at a shape becomes a geometry, a material and a place.

A shape that is met again with the same things in force shares its geometry. What cannot be drawn becomes a note at its node, so
that one broken shape does not lose the others; only limits end the reading.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.inventor.clipping import Faces, clip_faces, clip_lines, clip_points, planes_of
from scanspan.assets.inventor.corners import Corners
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.solids import Solid, make_cube
from scanspan.assets.inventor.state import State
from scanspan.assets.material import Material, Texture
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Geometry, Instance, primitive_count
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError, LimitError
from scanspan.homogeneous import FloatArray

MAX_INSTANCES = 100_000

Indices = NDArray[np.int64]

# What of the state a geometry depends on, besides its node.
SHAPING = (
    "points", "weights", "normals", "normal_binding", "diffuse", "transparency", "material_binding", "style", "line_width",
    "point_size", "ordering", "crease_angle", "complexity", "complexity_type", "uv", "plane", "uv_binding", "uv_transform",
    "font_size", "profile",
)  # fmt: skip


class Placed(NamedTuple):
    """What was in force where an instance was made: its node, the hints, the lights, and the light from all round."""

    node: Node
    ordering: str
    is_solid: bool
    lights: tuple[int, ...]
    ambient: tuple[float, float, float, float]


class Builder:
    """Collects the instances of a scene.

    Attributes
    ----------
    file : the model, for its limits and notes.
    instances : in the order in which their shapes were met.
    placed : what was in force at each of them.
    """

    def __init__(self, file: ModelFile) -> None:
        self.file = file
        self.instances: list[Instance] = []
        self.placed: list[Placed] = []
        self.triangles = 0
        self.made: dict[tuple[Any, ...], tuple[State, Node, list[Geometry]]] = {}
        self.materials: dict[tuple[Any, ...], tuple[tuple[Any, ...], Material]] = {}
        self.current: list[Geometry] = []

    def recall(self, node: Node, state: State) -> list[Geometry] | None:
        """Return the geometries that a node has given with the same things in force, or None where it has given none."""
        key = self._key(node, state)
        if key in self.made:
            return self.made[key][2]
        # Keep the state, so that the arrays whose numbers stand in the key live on.
        self.current = []
        self.made[key] = (state.copy(), node, self.current)
        return None

    def _key(self, node: Node, state: State) -> tuple[Any, ...]:
        """Return what decides about the geometry of a node."""
        values = (getattr(state, name) for name in SHAPING)
        words = (v if isinstance(v, (str, float, bool)) or v is None else id(v) for v in values)
        place = (id(state.clip_planes), id(state.transform)) if state.clip_planes else ()
        return (id(node), state.texture is not None, *place, *map(id, state.profiles), *words)

    # Geometry

    def add_faces(
        self,
        node: Node,
        state: State,
        vertex: Indices,
        counts: Indices,
        normals: FloatArray | None,
        colors: FloatArray | None,
        uv: FloatArray | None,
        points: FloatArray | None = None,
    ) -> None:
        """Add faces, in the style that is in force.

        Parameters
        ----------
        vertex : (C,) corners of all faces, into `points` or the coordinates in force. counts : (F,).
        normals : (C, 3), colors : (C, 4), uv : (C, 2), None where there are none.
        """
        points = state.points if points is None else points
        if not len(vertex):
            return
        if state.complexity_type == "BOUNDING_BOX" or state.style != "FILLED":
            self._add_outline(node, state, points, vertex, counts, colors)
            return
        faces = Faces(points, vertex, counts, (normals, colors, uv))
        for plane in planes_of(state):
            faces = clip_faces(faces, plane)
        points, vertex, counts, (normals, colors, uv) = faces
        if not len(vertex):
            return
        self.file.check_faces(np.unique(counts).tolist())
        used, indices = np.unique(vertex, return_inverse=True)
        corners = {"normal": normals, "color": colors, "uv": uv}
        angle = float(np.degrees(min(max(state.crease_angle, 0.0), np.pi))) if np.isfinite(state.crease_angle) else 0.0
        mesh = Mesh.from_flat(
            points[used],
            indices.reshape(-1),
            counts,
            corners={name: values for name, values in corners.items() if values is not None},
            nonfinite=self.file.nonfinite,
            crease_angle=angle,
        )
        self.current.append(mesh)

    def _add_outline(
        self, node: Node, state: State, points: FloatArray, vertex: Indices, counts: Indices, colors: FloatArray | None
    ) -> None:
        """Add the edges, the vertices or the bounding box of faces."""
        if state.complexity_type == "BOUNDING_BOX":
            low, high = points[vertex].min(axis=0), points[vertex].max(axis=0)
            box = make_cube(*(high - low).tolist())
            plain = state.copy()
            plain.complexity_type = "OBJECT_SPACE"
            self.add_faces(node, plain, box.vertex, box.counts, box.normals, None, None, box.points + (low + high) / 2.0)
        elif state.style == "LINES":
            start = np.repeat(np.cumsum(counts) - counts, counts)
            place = np.arange(len(vertex)) - start
            after = start + (place + 1) % np.repeat(counts, counts)
            ends = np.stack([np.arange(len(vertex)), after], axis=1).reshape(-1)
            self.add_lines(state, points[vertex[ends]], None if colors is None else colors[ends])
        else:
            self.add_points(state, points[vertex], colors)

    def add_lines(self, state: State, ends: FloatArray, colors: FloatArray | None) -> None:
        """Add segments by their ends (2 S, 3), with the colours of the ends."""
        for plane in planes_of(state):
            ends, colors = clip_lines(ends, colors, plane)
        if len(ends) and state.style not in ("POINTS", "INVISIBLE"):
            pairs = np.arange(len(ends)).reshape(-1, 2)
            width = state.line_width if np.isfinite(state.line_width) and state.line_width > 0.0 else 1.0
            self.current.append(Segments(ends, pairs, colors, width, nonfinite=self.file.nonfinite))

    def add_points(self, state: State, points: FloatArray, colors: FloatArray | None, size: float | None = None) -> None:
        """Add points, with their colours."""
        for plane in planes_of(state):
            points, colors = clip_points(points, colors, plane)
        if len(points) and state.style != "INVISIBLE":
            size = state.point_size if size is None else size
            size = size if np.isfinite(size) and size > 0.0 else 1.0
            self.current.append(Points(points, colors, size, nonfinite=self.file.nonfinite))

    def add_solid(self, node: Node, state: State, solid: Solid, has_parts: bool) -> None:
        """Add a cube, sphere, cone or cylinder."""
        colors = uv = None
        if has_parts and state.material_binding.startswith(("PER_PART", "PER_FACE")):
            colors = colors_at(state, solid.part)
        if state.texture is not None:
            uv = solid.uv
            if state.plane is not None:
                uv = project(solid.points[solid.vertex], *state.plane)
            uv = transform_uv(uv, state)
        self.add_faces(node, state, solid.vertex, solid.counts, solid.normals, colors, uv, solid.points)

    # Instances

    def place(self, node: Node, state: State, geometries: list[Geometry], is_lit: bool) -> None:
        """Put geometries where the state says, in its material."""
        for geometry in geometries:
            if not primitive_count(geometry):
                continue
            if len(self.instances) == MAX_INSTANCES:
                raise LimitError(f"{self.file.path}: more than {MAX_INSTANCES} shapes are to be drawn")
            if isinstance(geometry, Mesh):
                self.triangles += len(geometry.triangles)
                self.file.check_triangles(self.triangles)
            textured = isinstance(geometry, Mesh) and "uv" in geometry.corners
            if isinstance(geometry, Mesh):
                has_colors = "color" in geometry.corners
            else:
                has_colors = getattr(geometry, "colors", None) is not None
            material = self.material(state, has_colors, state.texture if textured else None, is_lit)
            try:
                self.instances.append(Instance(geometry, state.transform, material, node.name or state.name))
                self.placed.append(Placed(node, state.ordering, state.is_solid, state.lights, state.around))
            except InputError as error:
                node.note(f"{node.kind} is left out: {error}")

    def material(self, state: State, has_colors: bool, texture: Texture | None, is_lit: bool) -> Material:
        """Return the material in force, each made once."""
        is_lit = is_lit and state.is_lit
        arrays = (state.diffuse, state.transparency, state.emissive, state.ambient, state.specular, state.shininess)
        key = (*map(id, arrays), has_colors, id(texture), state.replaces_color, is_lit)
        if key not in self.materials:
            # Keep the arrays, so that their numbers stay theirs.
            self.materials[key] = arrays, self._make_material(state, has_colors, texture, is_lit)
        return self.materials[key][1]

    def _make_material(self, state: State, has_colors: bool, texture: Texture | None, is_lit: bool) -> Material:
        """Return a new material."""
        color = colors_at(state, np.zeros(1, np.int64), always=True)
        assert color is not None
        base = tuple(color[0].tolist()) if not has_colors else (1.0, 1.0, 1.0, float(color[0, 3]))
        if texture is not None and state.replaces_color:
            base = (1.0, 1.0, 1.0, 1.0)
        emissive, ambient, specular = (first_color(values) for values in (state.emissive, state.ambient, state.specular))
        return Material(
            "", base, texture, emissive_color=emissive if any(emissive) and is_lit else None, is_lit=is_lit,
            ambient_color=ambient, specular_color=specular if any(specular) else None,
            shininess=float(clip(state.shininess[:1]).sum()),
        )  # fmt: skip


def clip(values: FloatArray) -> FloatArray:
    """Return values cut off at 0 and 1; what is no number is 0."""
    return np.asarray(np.clip(np.nan_to_num(values, nan=0.0), 0.0, 1.0))


def first_color(colors: FloatArray) -> tuple[float, float, float]:
    """Return the first of several colours, black where there is none."""
    red, green, blue = clip(colors[0]).tolist() if len(colors) else (0.0, 0.0, 0.0)
    return red, green, blue


def colors_at(state: State, number: Indices, always: bool = False) -> FloatArray | None:
    """Return the colours (n, 4) that the materials of given numbers have; None where there is one material only."""
    diffuse, transparency = state.diffuse, state.transparency
    if len(diffuse) <= 1 and len(transparency) <= 1 and not always:
        return None
    diffuse = diffuse if len(diffuse) else np.full((1, 3), 0.8)
    transparency = transparency if len(transparency) else np.zeros(1)
    color = diffuse[np.minimum(number, len(diffuse) - 1)]
    alpha = 1.0 - transparency[np.minimum(number, len(transparency) - 1)]
    return clip(np.concatenate([color, alpha[:, None]], axis=1))


def project(points: FloatArray, s: FloatArray, t: FloatArray) -> FloatArray:
    """Return the texture coordinates that the directions of a TextureCoordinatePlane give."""
    length = np.array([max(float((axis * axis).sum()), 1e-30) for axis in (s, t)])
    return np.asarray(np.stack([(points * s).sum(axis=1), (points * t).sum(axis=1)], axis=1) / length)


def default_uv(points: FloatArray) -> FloatArray:
    """Return texture coordinates where there are none: along the longest side of the box from 0 to 1, and the next longest."""
    low, high = points.min(axis=0), points.max(axis=0)
    order = np.argsort(-(high - low), kind="stable")
    length = float((high - low)[order[0]])
    scale = 1.0 / length if np.isfinite(length) and length > 0.0 else 0.0
    return np.asarray((points[:, order[:2]] - low[order[:2]]) * scale)


def transform_uv(uv: FloatArray, state: State) -> FloatArray:
    """Return texture coordinates after the transform in force."""
    matrix = state.uv_transform
    if matrix is None:
        return uv
    return np.stack([uv[:, 0] * row[0] + uv[:, 1] * row[1] + row[2] for row in matrix[:2]], axis=1)


def reverse_faces(corners: Corners) -> Corners:
    """Return the corners with every face going round the other way."""
    start = np.repeat(np.cumsum(corners.counts) - corners.counts, corners.counts)
    count = np.repeat(corners.counts, corners.counts)
    flat = 2 * start + count - 1 - np.arange(len(corners.vertex))
    return Corners(corners.vertex[flat], corners.counts, *(values[flat] for values in corners[2:]))
