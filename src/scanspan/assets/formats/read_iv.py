"""Open Inventor: a scene graph in text or binary, packed with gzip or not, as instances in the world.

The reader is in `assets/inventor/`: the words of a file, the table of node types, the graph, the traversal. Here a file
becomes a list of instances.

Source: Wernecke, The Inventor Mentor; Strauss and Carey 1992, "An object-oriented 3D graphics toolkit".
"""

from __future__ import annotations

import numpy as np

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.inventor.build import colors_at
from scanspan.assets.inventor.cameras import camera_of
from scanspan.assets.inventor.edges import note_open_solids
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.lettering import set_lines
from scanspan.assets.inventor.lights import lights_of
from scanspan.assets.inventor.state import State
from scanspan.assets.inventor.traverse import Traverser, read_nodes
from scanspan.assets.polygons import Polygons
from scanspan.assets.scene import Instance, Scene
from scanspan.errors import InputError
from scanspan.homogeneous import FloatArray

WINDOW = 500.0  # pixels: the height of the window for which letters of a given number of pixels were meant


def read_iv(file: ModelFile) -> list[Instance]:
    """Return the shapes of an Inventor file, one instance for each place of each shape."""
    traverser = traverse(file)
    for node, transform in traverser.cameras:
        if node.get("viewportMapping") != "ADJUST_CAMERA":
            node.note(f"viewportMapping {node.get('viewportMapping')} is not applied: the camera fits the picture's height")
        try:
            file.cameras.append(camera_of(node, transform))
        except InputError as error:
            node.note(f"{node.kind} is left out: {error}")
    note_open_solids(traverser.builder)
    file.lights += lights_of(traverser.lights, traverser.builder.placed)
    return traverser.builder.instances


def traverse(file: ModelFile) -> Traverser:
    """Return what a traversal of an Inventor file found."""
    _, nodes = read_nodes(file, file.content)
    traverser = Traverser(file)
    state = State()
    for node in nodes:
        traverser.visit(node, state)
    _place_texts(traverser)
    if not traverser.builder.instances:
        faults = [note for note in file.notes if note]
        raise file.error("the file has nothing to draw" + (f"; {faults[0]}" if faults else ""))
    return traverser


def _place_texts(traverser: Traverser) -> None:
    """Add the texts that have a size in pixels: upright, as large as they would be in a window that shows the whole scene."""
    if not traverser.texts:
        return
    builder = traverser.builder
    anchors = np.array([state.transform[:3, 3] for _, state in traverser.texts])
    low, high = Scene(builder.instances).bounds if builder.instances else anchors[[0, 0]]
    low, high = np.minimum(low, anchors.min(axis=0)), np.maximum(high, anchors.max(axis=0))
    height = float(np.sqrt(((high - low) ** 2).sum()))
    unit = (height if np.isfinite(height) and height > 0.0 else WINDOW) / WINDOW
    made: dict[tuple[object, ...], Polygons | None] = {}
    for (node, state), anchor in zip(traverser.texts, anchors):
        color = colors_at(state, np.zeros(1, np.int64), always=True)
        assert color is not None
        key = (id(node), state.font_size, *color[0].tolist())
        if key not in made:
            made[key] = _letters(node, state.font_size, unit, color[0])
        letters = made[key]
        if letters is None:
            continue
        traverser.file.note("Text2 stands upright in the scene, as large as in a window of 500 pixels that shows all of it")
        place = state.copy()
        place.transform = np.eye(4)
        place.transform[:3, 3] = anchor
        builder.place(node, place, [letters], is_lit=False)


def _letters(node: Node, size: float, unit: float, color: FloatArray) -> Polygons | None:
    """Return the letters of a Text2, a pixel being so large; None, with a note, where there are none to be had."""
    try:
        letters = set_lines(node.get("string"), size, node.get("spacing"), node.get("justification"))
    except InputError as error:
        node.note(f"Text2 is left out: {error}")
        return None
    rings = [[np.pad(ring * unit, ((0, 0), (0, 1))) for ring in letter] for letter in letters]
    return Polygons(rings, colors=color) if rings else None
