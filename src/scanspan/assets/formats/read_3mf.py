"""3MF, through trimesh: a zip archive with a model in XML.

trimesh builds every path through the tree of components one by one, so a small file could ask for billions; the parts are
counted first. It also stops reading at a number that it cannot parse; that is made an error. It does not read materials, so the
base colours of whole objects are taken from the XML here. Source: 3MF Consortium, "Core Specification" 1.3.
"""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scanspan.assets.formats.files import ModelFile, open_zip
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance
from scanspan.errors import LimitError

MAX_PARTS = 100_000
"""Placed parts of one file."""

COLOR = re.compile(r"^#([0-9A-Fa-f]{6})([0-9A-Fa-f]{2})?$")


@dataclass
class Outline:
    """What the XML says before trimesh reads it.

    Attributes
    ----------
    components : parts of each object that has parts, by number.
    items : the objects that are built.
    materials : base materials by group: name and colour.
    chosen : the group and place of each object's base material.
    names : the objects' names.
    """

    components: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    items: list[str] = field(default_factory=list)
    materials: dict[str, list[Material]] = field(default_factory=dict)
    chosen: dict[str, tuple[str, str]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    triangles: int = 0


def read_3mf(file: ModelFile) -> list[Instance]:
    """Return the meshes of a 3MF file, one instance for each part that is built."""
    archive = open_zip(file.content, file)
    outline = _outline(archive, file)
    parts = _count_parts(outline, file)
    if not parts:
        raise file.error("the file builds nothing")
    file.check_triangles(outline.triangles)
    import trimesh

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", message=".*(string or file could not be read|unmatched data).*")
        scene = trimesh.load_scene(io.BytesIO(file.content), file_type="3mf", process=False, postprocess=False)

    # Give each part its mesh, made once, and the material of its object.
    materials = _materials_by_name(outline)
    meshes: dict[str, Mesh] = {}
    instances: list[Instance] = []
    for frame in scene.graph.nodes_geometry:
        transform, named = scene.graph[frame]
        key = str(named)
        geometry: Any = scene.geometry[key]
        if key not in meshes:
            meshes[key] = Mesh(np.asarray(geometry.vertices), np.asarray(geometry.faces), nonfinite=file.nonfinite)
        instances.append(Instance(meshes[key], np.array(transform), materials.get(key), str(frame)))
    file.check_triangles(sum(len(i.geometry.triangles) for i in instances if isinstance(i.geometry, Mesh)))
    return instances


def _outline(archive: zipfile.ZipFile, file: ModelFile) -> Outline:
    """Return what the XML says of objects, parts and base colours."""
    from lxml import etree
    from trimesh.exchange.common import XML_PARSER_OPTIONS

    names = [name for name in archive.namelist() if name.lower().endswith(".model")]
    if not any("3d/3dmodel.model" in name.lower() for name in names):
        raise file.error("the archive has no 3D/3dmodel.model")
    outline = Outline()
    tags = tuple(f"{{*}}{name}" for name in ("object", "component", "item", "basematerials", "triangle", "vertex"))
    owner: list[str] = []
    for name in names:
        try:
            with archive.open(name) as stream:
                for event, element in etree.iterparse(stream, events=("start", "end"), tag=tags, **XML_PARSER_OPTIONS):
                    _take(event, element, outline, owner)
        except etree.XMLSyntaxError as error:
            raise file.error(f"{name} is not XML: {str(error)[:100]}") from None
        except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, OSError) as error:
            raise file.error(f"{name} cannot be unpacked: {str(error)[:100]}") from None
    return outline


def _take(event: str, element: Any, outline: Outline, owner: list[str]) -> None:
    """Take one element of the XML into the outline."""
    kind = str(element.tag).rpartition("}")[2]
    values = element.attrib
    if event == "start":
        if kind == "object":
            owner.append(str(values.get("id", "")))
            outline.names[owner[-1]] = str(values.get("name", owner[-1]))
            if "pid" in values:
                outline.chosen[owner[-1]] = (str(values["pid"]), str(values.get("pindex", "0")))
        return
    if kind == "object":
        owner.pop()
    elif kind == "component" and owner:
        outline.components[owner[-1]].append(str(values.get("objectid", "")))
    elif kind == "item":
        outline.items.append(str(values.get("objectid", "")))
    elif kind == "triangle":
        outline.triangles += 1
    elif kind == "basematerials":
        outline.materials[str(values.get("id", ""))] = [_material(base.attrib) for base in element.iter("{*}base")]
    element.clear()


def _material(values: Any) -> Material:
    """Return a base material; white where its colour cannot be read."""
    match = COLOR.match(str(values.get("displaycolor", "")))
    digits = match[1] + (match[2] or "FF") if match else "FFFFFFFF"
    numbers = [int(digits[i : i + 2], 16) / 255 for i in range(0, 8, 2)]
    return Material(str(values.get("name", "")), (numbers[0], numbers[1], numbers[2], numbers[3]))


def _materials_by_name(outline: Outline) -> dict[str, Material]:
    """Return the materials of objects by name, as trimesh knows objects by theirs; a name used twice tells nothing."""
    found: dict[str, Material] = {}
    listed = list(outline.names.values())
    for number, (group, place) in outline.chosen.items():
        rows = outline.materials.get(group, [])
        if place.isdigit() and int(place) < len(rows) and listed.count(outline.names[number]) == 1:
            found[outline.names[number]] = rows[int(place)]
    return found


def _count_parts(outline: Outline, file: ModelFile) -> int:
    """Return how many parts are placed in all; raise when an object is part of itself or there are too many."""
    counts: dict[str, int] = {}
    for item in outline.items:
        stack = [(item, False)]
        above: set[str] = set()
        while stack:
            name, is_done = stack.pop()
            if is_done:
                above.discard(name)
                counts[name] = min(MAX_PARTS + 1, max(1, sum(counts[part] for part in outline.components.get(name, []))))
            elif name in above:
                raise file.error(f"object {name[:40]!r} is a part of itself")
            elif name not in counts:
                above.add(name)
                stack.append((name, True))
                stack.extend((part, False) for part in outline.components.get(name, []))
    total = sum(counts[item] for item in outline.items)
    if total > MAX_PARTS:
        raise LimitError(f"{file.path}: more than {MAX_PARTS} parts are placed")
    return total
