"""What there is to say of a scene before it is drawn: its size, its lights and what they reach, ordering and normals.

These are the places where scenes go wrong: more polygons than anyone sees, lights that shine on nothing or on everything
because no separator holds them, faces that turn both ways, normals that point into the solid.

Source: MIT 6.837, assignment 2 of 2002, its list of pitfalls; Wernecke, The Inventor Mentor, chapter 4, on lights.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.read_iv import traverse
from scanspan.assets.inventor.build import Placed
from scanspan.assets.inventor.edges import MISTURNED, edge_counts
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.traverse import Traverser, read_nodes
from scanspan.assets.load import open_model
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance

MANY_TRIANGLES = 100_000
MANY_LIGHTS = 8  # as many as OpenGL promised, and so as many as Inventor shows
MAX_DEPTH = 12  # of the listing
SHOWN = 8  # names or nodes of one kind in a line


def report_of(path: str, file_type: str | None = None) -> list[str]:
    """Return what there is to say of an Inventor file, a line each; of another kind of file, nothing.

    Raises
    ------
    FormatError, LimitError : as for `load`.
    """
    kind, file = open_model(path, file_type)
    if kind != "iv":
        return []
    return [*report(file), *(f"note: {note}" for note in file.notes)]


def listing_of(path: str, file_type: str | None = None) -> list[str]:
    """Return the nodes of an Inventor file as indented lines; of another kind of file, nothing."""
    kind, file = open_model(path, file_type)
    return [line for node in read_nodes(file, file.content)[1] for line in outline(node)] if kind == "iv" else []


def outline(node: Node, depth: int = 0) -> Iterator[str]:
    """Return a node and those below it, one line each."""
    fields = "  ".join(f"{name} {_short(value)}" for name, value in node.fields.items() if not isinstance(value, tuple))
    name = f"DEF {node.name} " if node.name else ""
    yield "  " * depth + f"{name}{node.kind}" + (f"  {fields}" if fields else "")
    for inner in [value for value in node.fields.values() if isinstance(value, Node)] + node.children:
        if depth < MAX_DEPTH:
            yield from outline(inner, depth + 1)


def _short(value: Any) -> str:
    """Return the value of a field in a few words."""
    if isinstance(value, Node):
        return value.kind
    if isinstance(value, np.ndarray):
        if value.size > 6:
            return f"[{len(value)} values]"
        return " ".join(f"{number:g}" for number in value.reshape(-1).tolist())
    if isinstance(value, float):
        return f"{value:g}"
    text = " ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text.replace("\n", " ")[:40]


def report(file: ModelFile) -> list[str]:
    """Return what there is to say of a file that has been opened."""
    traverser = traverse(file)
    builder = traverser.builder
    return [
        *_budget(builder.instances),
        *_lights(traverser),
        *(line for instance, placed in zip(builder.instances, builder.placed) for line in _surface(instance, placed)),
    ]


def _budget(instances: list[Instance]) -> Iterator[str]:
    """Return how many shapes and triangles there are, and who has most."""
    meshes = [len(one.geometry.triangles) for one in instances if isinstance(one.geometry, Mesh)]
    total = sum(meshes)
    kinds = Counter(type(one.geometry).__name__ for one in instances)
    listed = ", ".join(f"{count:,} of {kind}" for kind, count in sorted(kinds.items()))
    yield f"shapes: {len(instances):,} ({listed}), {total:,} triangles"
    if meshes:
        yield f"largest shape: {max(meshes):,} triangles, {100 * max(meshes) / max(total, 1):.0f} % of all"
    if total > MANY_TRIANGLES:
        yield f"budget: {total:,} triangles are more than {MANY_TRIANGLES:,}; a lower Complexity or fewer copies would do"


def _lights(traverser: Traverser) -> Iterator[str]:
    """Return the lights and how many shapes each reaches."""
    placed, lights = traverser.builder.placed, traverser.lights
    yield f"cameras: {len(traverser.cameras)}, lights: {len(lights)}"
    for number, (node, *_) in enumerate(lights):
        reached = sum(number in one.lights for one in placed)
        state = "" if node.get("on") else ", switched off"
        hint = ""
        if not reached:
            hint = ": it shines on nothing, for no shape follows it within its separator"
        elif reached == len(placed) > 1:
            hint = ": it shines on everything that follows; a separator round it would hold it"
        yield f"light {number}, {node.kind} at {node.place_text()}{state}, reaches {reached} of {len(placed)} shapes{hint}"
    if len(lights) > MANY_LIGHTS:
        yield f"lights: {len(lights)} are more than the {MANY_LIGHTS} that Inventor shows at once"
    dark = sum(not one.lights for one in placed)
    if lights and dark:
        yield f"lights: {dark} of {len(placed)} shapes stand before every light or outside of their separators"
    if lights:
        yield "lights: they cast no shadows"


def _surface(instance: Instance, placed: Placed) -> Iterator[str]:
    """Return what is odd about the faces and the normals of a mesh."""
    mesh, name = instance.geometry, f"{placed.node.kind} {instance.name}".strip()
    if not isinstance(mesh, Mesh) or not len(mesh.triangles):
        return
    where = f"{name} at {placed.node.place_text()}"
    same, open_edges, edges = edge_counts(mesh)
    if same > MISTURNED * edges:
        yield f"ordering: {where}: neighbours turn both ways along {same:,} of {edges:,} edges"
    if placed.is_solid and open_edges > MISTURNED * edges:
        yield f"ordering: {where}: is called SOLID and has {open_edges:,} open edges; its back faces would be missed"
    normals = mesh.corners.get("normal")
    if normals is None:
        return
    corners = mesh.positions[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.einsum("nk,nck->nc", across, normals.astype(np.float64))
    against = int((facing < 0).all(axis=1).sum())
    if placed.ordering != "UNKNOWN_ORDERING" and against > MISTURNED * len(facing):
        yield f"normals: {where}: {against:,} of {len(facing):,} triangles turn against their normals"
    length = np.sqrt((normals.astype(np.float64) ** 2).sum(axis=2))
    odd = int((np.abs(length - 1.0) > 0.01).sum())
    if odd:
        yield f"normals: {where}: {odd:,} of {length.size:,} are not of length 1"
