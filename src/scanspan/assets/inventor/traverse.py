"""The traversal: nodes in order, each changing what is in force or drawing with it.

A separator gives its children a copy of the state, a group gives them its own. One table says what each type does. The number
of visits is limited, because nodes that stand in many places can multiply: ten groups in a row, each used ten times by the
next, are 10^10 shapes in a short file.

Source: Wernecke, The Inventor Mentor, chapters 3 and 4; the reference pages of Inventor 2.1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.inventor import transforms
from scanspan.assets.inventor.build import Builder
from scanspan.assets.inventor.clipping import use_plane
from scanspan.assets.inventor.graph import MAX_DEPTH, Node, Source, open_source
from scanspan.assets.inventor.lights import KINDS, MAX_SHINING, ambient_of
from scanspan.assets.inventor.parse_binary import parse_binary
from scanspan.assets.inventor.parse_text import parse_text
from scanspan.assets.inventor.pictures import texture_of
from scanspan.assets.inventor.shapes import SHAPES, draw_shape
from scanspan.assets.inventor.state import State, use_material, use_packed_colors, use_vertex_property
from scanspan.errors import FormatError, LimitError
from scanspan.homogeneous import FloatArray, compose

MAX_VISITS = 500_000
MAX_FILES = 1000

NONE, INHERIT, ALL = -1, -2, -3  # of a Switch

SEPARATORS = ("Separator", "Annotation", "LocateHighlight", "Selection", "WWWAnchor", "WWWInline")
IGNORED = (
    "Info", "Label", "PickStyle", "TransparencyType", "EventCallback", "Callback", "Texture3Transform", "TextureCoordinate3",
    "ProfileCoordinate3",
)  # fmt: skip
CAMERAS = ("PerspectiveCamera", "OrthographicCamera")

Visit = Callable[["Traverser", Node, State], None]


def read_nodes(file: ModelFile, content: bytes, name: str = "") -> tuple[Source, list[Node]]:
    """Return the nodes at the top of a file.

    Parameters
    ----------
    file : the model. content : its bytes, or those of a file that it names. name : that file's name, "" for the model itself.

    Raises
    ------
    FormatError : it is no Inventor file, or a damaged gzip file.
    LimitError : it unpacks to more than the limit.
    """
    source = open_source(file, content, name)
    return source, (parse_binary if source.is_binary else parse_text)(source)


class Traverser:
    """Visits nodes and collects what they draw.

    Attributes
    ----------
    builder : collects the instances.
    cameras : nodes with the transformation in force there. lights : likewise, and with the attenuation.
    texts : nodes of Text2 with the state in force there; their size depends on the whole scene.
    active : numbers of the nodes that are being visited, to find one that contains itself.
    """

    def __init__(self, file: ModelFile) -> None:
        self.file = file
        self.builder = Builder(file)
        self.cameras: list[tuple[Node, FloatArray]] = []
        self.lights: list[tuple[Node, FloatArray, FloatArray]] = []
        self.texts: list[tuple[Node, State]] = []
        self.active: set[int] = set()
        self.visits = 0
        self.files: dict[str, list[Node]] = {}

    def visit(self, node: Node, state: State) -> None:
        """Visit one node."""
        self.visits += 1
        if self.visits > MAX_VISITS:
            raise LimitError(f"{self.file.path}: the scene graph has more than {MAX_VISITS} visits to nodes")
        action = ACTIONS.get(node.kind)
        if action is not None:
            action(self, node, state)
        elif not node.children:
            return
        elif id(node) in self.active:
            node.note(f"{node.kind} {node.name} contains itself; the inner one is left out")
        elif state.depth >= MAX_DEPTH:
            node.note(f"nodes are nested deeper than {MAX_DEPTH}; the inner ones are left out")
        else:
            self.enter(node, state)

    def enter(self, node: Node, state: State) -> None:
        """Visit the children of a group that is not being visited."""
        self.active.add(id(node))
        depth, name, transform = state.depth, state.name, state.transform
        inner = state.copy() if node.kind in COPIED else state
        inner.depth = depth + 1
        inner.name = node.name or name
        group = GROUPS.get(node.kind)
        if group is not None:
            group(self, node, inner)
        elif node.type.name:
            for child in node.children:
                self.visit(child, inner)
        state.depth, state.name = depth, name
        if node.kind == "TransformSeparator":
            state.transform = transform
        self.active.discard(id(node))

    def visit_switch(self, node: Node, state: State) -> None:
        """Visit the child of a Switch or a Blinker that is chosen."""
        chosen = int(node.get("whichChild"))
        if node.kind == "Blinker" and chosen == NONE:
            chosen = 0
        if chosen == INHERIT:
            chosen = state.which_child
        if chosen == NONE:
            return
        if not (chosen == ALL or 0 <= chosen < len(node.children)):
            node.note(f"{node.kind} chooses child {chosen}, there are {len(node.children)}")
            return
        outer, state.which_child = state.which_child, chosen
        for child in node.children if chosen == ALL else [node.children[chosen]]:
            self.visit(child, state)
        state.which_child = outer

    def visit_annotation(self, node: Node, state: State) -> None:
        """Visit the children of an Annotation."""
        node.note("Annotation is drawn where it stands, and not in front of everything")
        for child in node.children:
            self.visit(child, state)

    def visit_first(self, node: Node, state: State) -> None:
        """Visit the finest level of detail."""
        self.visit(node.children[0], state)

    def visit_array(self, node: Node, state: State) -> None:
        """Visit the children of an Array once for each of its places."""
        counts = [int(node.get(f"numElements{axis}")) for axis in (1, 2, 3)]
        steps = [node.get(f"separation{axis}") for axis in (1, 2, 3)]
        share = {"FIRST": 0.0, "CENTER": 0.5, "LAST": 1.0}[node.get("origin")]
        first = sum((step * (-share * (count - 1)) for step, count in zip(steps, counts)), np.zeros(3))
        number = 0
        for k in range(counts[2]):
            for j in range(counts[1]):
                for i in range(counts[0]):
                    offset = first + steps[0] * i + steps[1] * j + steps[2] * k
                    self.visit_copy(node, state, transforms.translation(offset), number)
                    number += 1

    def visit_copies(self, node: Node, state: State) -> None:
        """Visit the children of a MultipleCopy once for each of its matrices."""
        for number, matrix in enumerate(node.get("matrix")):
            self.visit_copy(node, state, matrix.T, number)

    def visit_copy(self, node: Node, state: State, matrix: FloatArray, number: int) -> None:
        """Visit the children of a node in another place."""
        self.visits += 1
        if self.visits > MAX_VISITS:
            raise LimitError(f"{self.file.path}: the scene graph has more than {MAX_VISITS} visits to nodes")
        inner = state.copy()
        inner.transform = compose(state.transform, matrix)
        inner.which_child = number
        for child in node.children:
            self.visit(child, inner)

    def visit_file(self, node: Node, state: State) -> None:
        """Visit what another file has, if that lies in the scene's folder."""
        name = str(node.get("name"))
        if name not in self.files:
            self.files[name] = []
            self.files[name] = self._read(node, name)
        if id(node) in self.active or state.depth >= MAX_DEPTH:
            node.note(f"file {name[:80]!r} contains itself; the inner one is left out")
            return
        self.active.add(id(node))
        inner = state.copy() if node.kind in COPIED else state
        inner.depth += 1
        for child in self.files[name]:
            self.visit(child, inner)
        inner.depth -= 1
        self.active.discard(id(node))

    def _read(self, node: Node, name: str) -> list[Node]:
        """Return the nodes of another file, none where it cannot be had."""
        if len(self.files) > MAX_FILES:
            raise LimitError(f"{self.file.path}: more than {MAX_FILES} other files are named")
        if not name:
            return []
        content = self.file.beside(name, "file")
        if content is None:
            return []
        try:
            return read_nodes(self.file, content, name)[1]
        except FormatError as error:
            node.note(f"file {name[:80]!r} is left out: {error.problem}")
            return []


# What nodes do to the state


def _font(traverser: Traverser, node: Node, state: State) -> None:
    """Put the size of letters in force; there is one font for all."""
    if node.has("size"):
        state.font_size = node.get("size")
    if node.get("name") != node.type.fields["name"].default or "family" in node.fields or node.fields.get("style"):
        traverser.file.note("letters are of the one font that there is, whatever font or style is named")


def _binding(name: str, plain: str) -> Visit:
    """Return what puts a binding in force; NONE and DEFAULT of old files mean what holds where nothing is said."""

    def visit(_: Traverser, node: Node, state: State) -> None:
        value = node.get("value")
        setattr(state, name, plain if value in ("NONE", "DEFAULT") else value)

    return visit


def _normals(_: Traverser, node: Node, state: State) -> None:
    state.normals = node.get("vector")


def _coordinates(_: Traverser, node: Node, state: State) -> None:
    """Put coordinates in force; four of them are divided by the last."""
    points = node.get("point")
    state.points, state.weights = points, None
    if node.kind == "Coordinate4":
        if "divided" not in node.fields:
            weights = np.where(points[:, 3] == 0.0, 1.0, points[:, 3])
            node.fields["divided"] = points[:, :3] / weights[:, None], weights
        state.points, state.weights = node.fields["divided"]


def _colors(_: Traverser, node: Node, state: State) -> None:
    """Put colours alone in force."""
    if node.kind == "BaseColor":
        if len(node.get("rgb")) and node.has("rgb"):
            state.diffuse = node.get("rgb")
        return
    old = "rgb" in node.fields and "orderedRGBA" not in node.fields
    packed = node.get("rgb" if old else "orderedRGBA")
    if len(packed):
        use_packed_colors(state, node, packed, is_reversed=old)


def _hints(_: Traverser, node: Node, state: State) -> None:
    """Put the hints about shapes in force."""
    if node.has("vertexOrdering"):
        state.ordering = node.get("vertexOrdering")
    if node.has("shapeType"):
        state.is_solid = node.get("shapeType") == "SOLID"
    if node.has("creaseAngle"):
        state.crease_angle = node.get("creaseAngle")


def _style(_: Traverser, node: Node, state: State) -> None:
    """Put a style of drawing in force."""
    if node.get("linePattern") & 0xFFFF != 0xFFFF:
        node.note("the pattern of DrawStyle is not drawn: lines are whole")
    for name, field in (("style", "style"), ("line_width", "lineWidth"), ("point_size", "pointSize")):
        if node.has(field):
            setattr(state, name, node.get(field))


def _complexity(_: Traverser, node: Node, state: State) -> None:
    """Put a complexity in force."""
    state.complexity, state.complexity_type = node.get("value"), node.get("type")


def _light_model(_: Traverser, node: Node, state: State) -> None:
    state.is_lit = node.get("model") != "BASE_COLOR"


def _texture(traverser: Traverser, node: Node, state: State) -> None:
    """Put a texture in force, or take it out of force where it has no picture."""
    if "texture" not in node.fields:
        node.fields["texture"] = texture_of(node, state, traverser.file)
    state.texture = node.fields["texture"]
    state.replaces_color = node.get("model") != "MODULATE"


def _texture_coordinates(_: Traverser, node: Node, state: State) -> None:
    """Put texture coordinates in force, or how they are made."""
    state.plane = None
    if node.kind == "TextureCoordinate2":
        state.uv = node.get("point")
    elif node.kind == "TextureCoordinatePlane":
        if "plane" not in node.fields:
            node.fields["plane"] = node.get("directionS"), node.get("directionT")
        state.plane = node.fields["plane"]
    else:
        state.uv = None
        if node.kind == "TextureCoordinateEnvironment":
            node.note("textures that mirror the surroundings are not drawn; the texture lies on the surface")


def _texture_transform(_: Traverser, node: Node, state: State) -> None:
    """Multiply the transformation of texture coordinates."""
    matrix = transforms.texture_transform(node)
    if state.uv_transform is not None:
        matrix = np.einsum("ij,jk->ik", state.uv_transform, matrix)
    state.uv_transform = matrix


def _profile(_: Traverser, node: Node, state: State) -> None:
    """Put a profile in force: the points, or which of them are used."""
    if node.kind == "ProfileCoordinate2":
        state.profile = node.get("point")
    else:
        state.profiles = (node.get("index"),) if node.get("linkage") == "START_FIRST" else (*state.profiles, node.get("index"))


def _not_drawn(text: str) -> Visit:
    """Return what notes that something is not drawn."""

    def visit(_: Traverser, node: Node, state: State) -> None:
        node.note(text)

    return visit


def _camera(traverser: Traverser, node: Node, state: State) -> None:
    traverser.cameras.append((node, state.transform))


def _light(traverser: Traverser, node: Node, state: State) -> None:
    """Let a light shine on what follows."""
    if len(state.lights) == MAX_SHINING:
        node.note(f"more than {MAX_SHINING} lights shine at once; the others are left out")
        return
    state.lights = (*state.lights, len(traverser.lights))
    traverser.lights.append((node, state.transform, state.attenuation))


def _environment(_: Traverser, node: Node, state: State) -> None:
    """Put the light from all round in force, and how lights weaken with distance."""
    if node.has("ambientColor") and node.has("ambientIntensity"):
        state.around = ambient_of(node)
    if node.has("attenuation"):
        state.attenuation = node.get("attenuation")[::-1]
    if node.get("fogType") != "NONE":
        node.note("fog is not drawn")


def _text(traverser: Traverser, node: Node, state: State) -> None:
    if state.style != "INVISIBLE":
        traverser.texts.append((node, state.copy()))


ACTIONS: dict[str, Visit] = {
    **dict.fromkeys(SHAPES, lambda traverser, node, state: draw_shape(traverser.builder, node, state)),
    **dict.fromkeys(transforms.MATRICES, lambda _, node, state: transforms.apply_transform(state, node)),
    **dict.fromkeys(IGNORED, lambda _, node, state: None),
    **dict.fromkeys(CAMERAS, _camera),
    **dict.fromkeys(KINDS, _light),
    "Environment": _environment,
    "Text2": _text,
    "File": Traverser.visit_file,
    "WWWInline": Traverser.visit_file,
    "Units": lambda _, node, state: transforms.apply_units(state, node),
    "ResetTransform": lambda _, node, state: transforms.reset_transform(state, node),
    "AntiSquish": lambda _, node, state: transforms.unsquish(state, node),
    "Coordinate3": _coordinates,
    "Coordinate4": _coordinates,
    "Normal": _normals,
    "NormalBinding": _binding("normal_binding", "PER_VERTEX_INDEXED"),
    "VertexProperty": lambda _, node, state: use_vertex_property(state, node),
    "Material": lambda _, node, state: use_material(state, node),
    "MaterialBinding": _binding("material_binding", "OVERALL"),
    "BaseColor": _colors,
    "PackedColor": _colors,
    "LightModel": _light_model,
    "DrawStyle": _style,
    "ShapeHints": _hints,
    "Complexity": _complexity,
    "Texture2": _texture,
    "Texture2Transform": _texture_transform,
    "TextureCoordinate2": _texture_coordinates,
    "TextureCoordinatePlane": _texture_coordinates,
    "TextureCoordinateDefault": _texture_coordinates,
    "TextureCoordinateEnvironment": _texture_coordinates,
    "TextureCoordinateBinding": _binding("uv_binding", "PER_VERTEX_INDEXED"),
    "Font": _font,
    "FontStyle": _font,
    "ProfileCoordinate2": _profile,
    "LinearProfile": _profile,
    "ClipPlane": lambda _, node, state: use_plane(state, node),
    "Texture3": _not_drawn("textures in space are not drawn"),
    "NurbsProfile": _not_drawn("curves of NurbsProfile are not applied: surfaces are drawn whole, letters without bevel"),
    "PolygonOffset": _not_drawn("PolygonOffset is not applied: where two lie at the same depth, the first one is seen"),
    "ColorIndex": _not_drawn("colours by index are not known"),
}
"""What each type does that has no children."""

GROUPS: dict[str, Visit] = {
    "Switch": Traverser.visit_switch,
    "PathSwitch": _not_drawn("PathSwitch is left out"),
    "Annotation": Traverser.visit_annotation,
    "Blinker": Traverser.visit_switch,
    "LevelOfDetail": Traverser.visit_first,
    "LOD": Traverser.visit_first,
    "Array": Traverser.visit_array,
    "MultipleCopy": Traverser.visit_copies,
}
"""Groups that do not simply visit all their children."""

COPIED = (*SEPARATORS, "Array", "MultipleCopy", "LOD")
"""Groups whose children change nothing for those who come after."""
