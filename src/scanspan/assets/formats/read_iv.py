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
from scanspan.assets.inventor.lettering import set_lines
from scanspan.assets.inventor.lights import lights_of
from scanspan.assets.inventor.state import State
from scanspan.assets.inventor.traverse import Traverser, read_nodes
from scanspan.assets.polygons import Polygons
from scanspan.assets.scene import Instance, Scene
from scanspan.errors import InputError

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
    for (node, state), anchor in zip(traverser.texts, anchors):
        try:
            letters = set_lines(node.get("string"), state.font_size, node.get("spacing"), node.get("justification"))
        except InputError as error:
            node.note(f"Text2 is left out: {error}")
            continue
        if not letters:
            continue
        traverser.file.note("Text2 stands upright in the scene, as large as in a window of 500 pixels that shows all of it")
        rings = [[np.pad(ring * unit, ((0, 0), (0, 1))) for ring in letter] for letter in letters]
        color = colors_at(state, np.zeros(1, np.int64), always=True)
        assert color is not None
        place = state.copy()
        place.transform = np.eye(4)
        place.transform[:3, 3] = anchor
        builder.place(node, place, [Polygons(rings, colors=color[0])], is_lit=False)
