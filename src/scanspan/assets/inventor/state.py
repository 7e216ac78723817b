"""What is in force at a place of the traversal: transformation, coordinates, materials, hints.

A node that changes something replaces a value and never what the value holds, so that a copy of the state is a shallow one. The
defaults are those of Inventor's elements.

Source: Wernecke, The Inventor Mentor, chapters 3 to 5; the reference pages of Inventor 2.1.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.inventor.graph import Node
from scanspan.assets.material import Texture
from scanspan.homogeneous import FloatArray

UNIT_LENGTHS = {
    "METERS": 1.0, "CENTIMETERS": 1e-2, "MILLIMETERS": 1e-3, "MICROMETERS": 1e-6, "MICRONS": 1e-6, "NANOMETERS": 1e-9,
    "ANGSTROMS": 1e-10, "KILOMETERS": 1e3, "FEET": 0.3048, "INCHES": 0.0254, "POINTS": 0.0254 / 72.0, "YARDS": 0.9144,
    "MILES": 1609.344, "NAUTICAL_MILES": 1852.0,
}  # fmt: skip


@dataclass
class State:
    """What is in force.

    Attributes
    ----------
    transform : (4, 4) to the world, for columns.
    points : (n, 3) coordinates; weights (n,) where they came with four, else None.
    normals : (n, 3). diffuse, emissive, ambient, specular : (n, 3) colours; transparency, shininess : (n,).
    uv : (n, 2) or None where they are to be made; plane : the two directions of a TextureCoordinatePlane.
    uv_transform : (3, 3) for columns, or None.
    clip_planes : (4,) each, of the world.
    lights : numbers of the lights that shine.
    around : red, green, blue and intensity of the light from all round. attenuation : (3,) constant, linear, quadratic.
    name : of the nearest node that has one.
    depth : how many nodes lie above.
    """

    transform: FloatArray = field(default_factory=lambda: np.eye(4))
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    weights: FloatArray | None = None
    normals: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    normal_binding: str = "PER_VERTEX_INDEXED"
    diffuse: FloatArray = field(default_factory=lambda: np.full((1, 3), 0.8))
    emissive: FloatArray = field(default_factory=lambda: np.zeros((1, 3)))
    ambient: FloatArray = field(default_factory=lambda: np.full((1, 3), 0.2))
    specular: FloatArray = field(default_factory=lambda: np.zeros((1, 3)))
    shininess: FloatArray = field(default_factory=lambda: np.full(1, 0.2))
    transparency: FloatArray = field(default_factory=lambda: np.zeros(1))
    material_binding: str = "OVERALL"
    is_lit: bool = True
    style: str = "FILLED"
    line_width: float = 1.0
    point_size: float = 1.0
    ordering: str = "UNKNOWN_ORDERING"
    is_solid: bool = False
    crease_angle: float = 0.0  # radians
    complexity: float = 0.5
    complexity_type: str = "OBJECT_SPACE"
    texture: Texture | None = None
    replaces_color: bool = False
    uv: FloatArray | None = None
    plane: tuple[FloatArray, FloatArray] | None = None
    uv_binding: str = "PER_VERTEX_INDEXED"
    uv_transform: FloatArray | None = None
    font_size: float = 10.0
    profile: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    profiles: tuple[NDArray[np.int64], ...] = ()
    units: float = 1.0  # metres
    which_child: int = -1
    clip_planes: tuple[FloatArray, ...] = ()
    lights: tuple[int, ...] = ()
    around: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 0.2)
    attenuation: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    name: str = ""
    depth: int = 0

    def copy(self) -> State:
        """Return a state that can be changed without changing this one."""
        return copy.copy(self)


def use_vertex_property(state: State, node: Node) -> None:
    """Put what a VertexProperty has in place of what is in force; what it does not have stays."""
    points, normals, uv, colors = (node.get(name) for name in ("vertex", "normal", "texCoord", "orderedRGBA"))
    if len(points):
        state.points, state.weights = points, None
    if len(normals):
        state.normals, state.normal_binding = normals, node.get("normalBinding")
    if len(uv):
        state.uv = uv
    if len(colors):
        use_packed_colors(state, node, colors)
        state.material_binding = node.get("materialBinding")


def use_packed_colors(state: State, node: Node, packed: NDArray[np.int64], is_reversed: bool = False) -> None:
    """Put colours 0xrrggbbaa in force, or 0xaabbggrr."""
    if "colors" not in node.fields:
        channels = (packed[:, None] >> np.array([0, 8, 16, 24] if is_reversed else [24, 16, 8, 0])) & 0xFF
        node.fields["colors"] = channels[:, :3] / 255.0, 1.0 - channels[:, 3] / 255.0
    state.diffuse, state.transparency = node.fields["colors"]


MATERIAL = {
    "diffuseColor": "diffuse", "emissiveColor": "emissive", "ambientColor": "ambient", "specularColor": "specular",
    "shininess": "shininess", "transparency": "transparency",
}  # fmt: skip
"""What of the state each field of a Material changes."""


def use_material(state: State, node: Node) -> None:
    """Put a Material in force, but for the fields that are to be ignored."""
    for name, field_name in MATERIAL.items():
        values: Any = node.get(name)
        if len(values) and node.has(name):
            setattr(state, field_name, values)
