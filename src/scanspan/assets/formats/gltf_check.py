"""The checks that a glTF tree must pass before trimesh sees it: every number that is an index, a count or an offset.

trimesh, like Python, takes -1 for the last, makes zeros for an accessor without bytes whatever its count, and reads past one
view into the next. Source: Khronos Group, "glTF 2.0 Specification", sections 3.6 and 5.
"""

from __future__ import annotations

import math
from typing import Any

from scanspan.assets.formats.files import ModelFile

Tree = dict[str, Any]

COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

UNDERSTOOD = {"KHR_mesh_quantization", "KHR_materials_unlit", "EXT_texture_webp"}
"""Extensions that a file may require; materials' and textures' others change the picture, and are noted."""

MAX_DEPTH = 1000
"""Levels of nodes. Real scenes have tens."""


class Checker:
    """Checks one tree; every message says where in the tree the fault is."""

    def __init__(self, tree: Tree, binary: bytes | None, file: ModelFile) -> None:
        self.tree = tree
        self.binary = binary
        self.file = file

    def rows(self, parent: Tree, key: str, where: str = "") -> list[Tree]:
        """Return the list of objects under a key, empty where there is none."""
        rows = parent.get(key, [])
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise self.file.error("expected a list of objects", f"{where}{key}")
        return rows

    def whole(self, parent: Tree, key: str, where: str, default: int | None = None, least: int = 0) -> int:
        """Return the whole number under a key, at least `least`."""
        value = parent.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least or value >= 2**53:
            raise self.file.error(f"expected a whole number from {least}, got {str(value)[:40]}", f"{where}.{key}")
        return value

    def index(self, parent: Tree, key: str, rows: list[Tree], where: str) -> int:
        """Return the number under a key as an index of a row that exists."""
        value = self.whole(parent, key, where)
        if value >= len(rows):
            raise self.file.error(f"{key} {value} does not exist, there are {len(rows)}", where)
        return value

    def check(self) -> None:
        """Raise for the first fault in the tree."""
        asset = self.tree.get("asset")
        version = asset.get("version") if isinstance(asset, dict) else None
        if not isinstance(version, str) or not version.startswith("2"):
            raise self.file.error(f"expected glTF version 2, got {str(version)[:20]!r}", "asset.version")
        self._extensions()
        self._accessors()
        self._meshes()
        self._materials()
        self._nodes()

    def _extensions(self) -> None:
        """Refuse extensions without which the geometry cannot be read; note those that change the colours."""
        required = self.tree.get("extensionsRequired", [])
        for name in required if isinstance(required, list) else [required]:
            if str(name).startswith(("KHR_materials_", "KHR_texture_", "KHR_lights_")) and name not in UNDERSTOOD:
                self.file.note(f"the extension {str(name)[:40]} is not applied")
            elif name not in UNDERSTOOD:
                raise self.file.error(f"the file needs the extension {str(name)[:40]!r}, which cannot be read")

    def _accessors(self) -> None:
        """Check that every accessor lies in its view and every view in its buffer."""
        buffers, views = self.rows(self.tree, "buffers"), self.rows(self.tree, "bufferViews")
        for i, buffer in enumerate(buffers):
            length = self.whole(buffer, "byteLength", f"buffers[{i}]")
            if not isinstance(buffer.get("uri", ""), str):
                raise self.file.error("expected text", f"buffers[{i}].uri")
            held = 0 if self.binary is None or i else len(self.binary)
            if "uri" not in buffer and length > held:
                raise self.file.error(f"expected {length} bytes in the file, there are {held}", f"buffers[{i}]")
        for i, view in enumerate(views):
            where = f"bufferViews[{i}]"
            buffer = buffers[self.index(view, "buffer", buffers, where)]
            end = self.whole(view, "byteOffset", where, 0) + self.whole(view, "byteLength", where, None, 1)
            if end > buffer["byteLength"]:
                raise self.file.error(f"ends at byte {end} of a buffer of {buffer['byteLength']} bytes", where)
        for i, accessor in enumerate(self.rows(self.tree, "accessors")):
            self._accessor(accessor, views, f"accessors[{i}]")

    def _accessor(self, accessor: Tree, views: list[Tree], where: str) -> None:
        """Check one accessor."""
        count = self.whole(accessor, "count", where, None, 1)
        kind, component = accessor.get("type"), accessor.get("componentType")
        if not isinstance(kind, str) or kind not in COMPONENTS:
            raise self.file.error(f"unknown type {str(kind)[:20]!r}", where)
        if not isinstance(component, int) or component not in COMPONENT_BYTES:
            raise self.file.error(f"unknown componentType {str(component)[:20]!r}", where)
        if "sparse" in accessor or "bufferView" not in accessor:
            raise self.file.error("an accessor that is sparse or has no bufferView cannot be read", where)
        view = views[self.index(accessor, "bufferView", views, where)]
        size = COMPONENTS[kind] * COMPONENT_BYTES[component]
        stride = self.whole(view, "byteStride", where, size, 1)
        end = self.whole(accessor, "byteOffset", where, 0) + (count - 1) * stride + size
        if stride < size or end > view["byteLength"]:
            raise self.file.error(f"{count} items end at byte {end} of a view of {view['byteLength']} bytes", where)

    def _meshes(self) -> None:
        """Check that primitives name accessors and materials that exist, and that their attributes agree in count."""
        accessors, materials = self.rows(self.tree, "accessors"), self.rows(self.tree, "materials")
        for i, mesh in enumerate(self.rows(self.tree, "meshes")):
            for j, primitive in enumerate(self.rows(mesh, "primitives", f"meshes[{i}].")):
                where = f"meshes[{i}].primitives[{j}]"
                attributes = primitive.get("attributes")
                if not isinstance(attributes, dict) or "POSITION" not in attributes:
                    raise self.file.error("expected attributes with POSITION", where)
                rows = {name: accessors[self.index(attributes, name, accessors, where)] for name in attributes}
                count = rows["POSITION"]["count"]
                for name, row in rows.items():
                    if row["count"] != count:
                        raise self.file.error(f"{name} has {row['count']} items, POSITION has {count}", where)
                if rows["POSITION"]["type"] != "VEC3":
                    raise self.file.error(f"POSITION: expected type VEC3, got {rows['POSITION']['type']}", where)
                if "indices" in primitive:
                    row = accessors[self.index(primitive, "indices", accessors, where)]
                    if row["type"] != "SCALAR" or row["componentType"] not in (5121, 5123, 5125):
                        raise self.file.error("indices: expected whole numbers without a sign", where)
                if "material" in primitive:
                    self.index(primitive, "material", materials, where)

    def _materials(self) -> None:
        """Check that textures, images and samplers that are named exist."""
        textures, images = self.rows(self.tree, "textures"), self.rows(self.tree, "images")
        samplers, views = self.rows(self.tree, "samplers"), self.rows(self.tree, "bufferViews")
        for i, texture in enumerate(textures):
            if "source" in texture:
                self.index(texture, "source", images, f"textures[{i}]")
            if "sampler" in texture:
                self.index(texture, "sampler", samplers, f"textures[{i}]")
        for i, image in enumerate(images):
            if "bufferView" in image:
                self.index(image, "bufferView", views, f"images[{i}]")
        for i, material in enumerate(self.rows(self.tree, "materials")):
            rough = material.get("pbrMetallicRoughness", {})
            if not isinstance(rough, dict):
                raise self.file.error("expected an object", f"materials[{i}].pbrMetallicRoughness")
            base = rough.get("baseColorTexture")
            if base is not None:
                if not isinstance(base, dict):
                    raise self.file.error("expected an object", f"materials[{i}].baseColorTexture")
                self.index(base, "index", textures, f"materials[{i}].baseColorTexture")

    def _nodes(self) -> None:
        """Check that nodes form trees: every node has one parent at most, and none is its own ancestor."""
        nodes, meshes = self.rows(self.tree, "nodes"), self.rows(self.tree, "meshes")
        scenes = self.rows(self.tree, "scenes")
        if "scene" in self.tree:
            self.index(self.tree, "scene", scenes, "scene")
        parent: dict[int, int] = {}
        for i, node in enumerate(nodes):
            where = f"nodes[{i}]"
            if "mesh" in node:
                self.index(node, "mesh", meshes, where)
            self._placement(node, where)
            for child in self._numbers(node.get("children", []), len(nodes), f"{where}.children"):
                if child in parent:
                    raise self.file.error(f"node {child} has two parents, {parent[child]} and {i}", where)
                parent[child] = i
        for i, scene in enumerate(scenes):
            for root in self._numbers(scene.get("nodes", []), len(nodes), f"scenes[{i}].nodes"):
                if root in parent:
                    raise self.file.error(f"node {root} is a root and a child of {parent[root]}", f"scenes[{i}]")
        self._depths(len(nodes), parent)

    def _placement(self, node: Tree, where: str) -> None:
        """Check that what places a node is as many finite numbers as it has to be."""
        for key, count in (("matrix", 16), ("translation", 3), ("rotation", 4), ("scale", 3)):
            values = node.get(key, [0.0] * count)
            good = isinstance(values, list) and len(values) == count
            if not good or not all(isinstance(v, (int, float)) and math.isfinite(v) for v in values):
                raise self.file.error(f"expected {count} finite numbers", f"{where}.{key}")

    def _depths(self, count: int, parent: dict[int, int]) -> None:
        """Check that going up from any node ends, soon."""
        depth: dict[int, int] = {}
        for start in range(count):
            path: list[int] = []
            node: int | None = start
            while node is not None and node not in depth:
                if len(path) > MAX_DEPTH:
                    raise self.file.error(f"nodes are nested in a circle or more than {MAX_DEPTH} deep", f"nodes[{start}]")
                path.append(node)
                node = parent.get(node)
            level = 0 if node is None else depth[node]
            for step in reversed(path):
                level += 1
                depth[step] = level
            if level > MAX_DEPTH:
                raise self.file.error(f"nodes are nested in a circle or more than {MAX_DEPTH} deep", f"nodes[{start}]")

    def _numbers(self, values: Any, count: int, where: str) -> list[int]:
        """Return a list of indices of nodes that exist."""
        if not isinstance(values, list):
            raise self.file.error("expected a list of nodes", where)
        for value in values:
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < count:
                raise self.file.error(f"node {str(value)[:40]} does not exist, there are {count}", where)
        return values
