"""Open Inventor files made by hand, and a naive writer of binary ones, for the tests of the reader."""

from __future__ import annotations

import logging
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scanspan.assets.formats.files import DiskFolder, Limits, ModelFile
from scanspan.assets.inventor.graph import Node, Source
from scanspan.assets.inventor.nodes import NUMBERS, WHOLE_NUMBERS, WIDTHS, FieldType
from scanspan.assets.inventor.traverse import read_nodes
from scanspan.assets.load import load
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance, Scene

HEADER = "#Inventor V2.1 ascii\n"
LIMITS = Limits(2**31, 10**7, 2**26, 10_000)


def model_file(content: bytes | str, folder: Path = Path("."), path: str = "a.iv") -> ModelFile:
    """A file that is being read."""
    logging.getLogger("scanspan").disabled = True
    raw = content.encode("latin-1") if isinstance(content, str) else content
    return ModelFile(path, raw, DiskFolder(folder), LIMITS, "error")


def parse(content: bytes | str) -> tuple[Source, list[Node]]:
    """The nodes at the top of a file; text without a header gets one."""
    if isinstance(content, str) and not content.startswith("#"):
        content = HEADER + content
    file = model_file(content)
    return read_nodes(file, file.content)


def notes_of(content: bytes | str) -> list[str]:
    """What the reader says of a file."""
    return parse(content)[0].file.notes


def scene_of(folder: Path, text: str, name: str = "a.iv") -> Scene:
    """The scene of a text, which gets a header."""
    path = folder / name
    path.write_text(HEADER + text, encoding="latin-1")
    return load(path)


def only(scene: Scene) -> Instance:
    """The one instance of a scene."""
    (instance,) = scene.instances
    return instance


def mesh_in(instance: Instance) -> Mesh:
    """The mesh of an instance."""
    assert isinstance(instance.geometry, Mesh)
    return instance.geometry


def base_of(instance: Instance) -> list[float]:
    """The red, green and blue of an instance's material."""
    color = instance.material.base_color
    assert color is not None
    return [round(value, 6) for value in color[:3]]


def places(scene: Scene) -> list[list[float]]:
    """Where the origin of each instance lies in the world."""
    return [np.asarray(instance.transform[:3, 3]).round(9).tolist() for instance in scene.instances]


def corner_colors(instance: Instance) -> list[list[float]]:
    """The colours at all corners of a mesh's triangles."""
    colors = np.asarray(mesh_in(instance).corners["color"], dtype=np.float64)
    return colors.reshape(-1, colors.shape[-1])[:, :3].round(3).tolist()


# Binary files


def word(text: str) -> bytes:
    """A string with its length, filled up to four bytes."""
    raw = text.encode("latin-1")
    return struct.pack(">i", len(raw)) + raw + b"\0" * (-len(raw) % 4)


def whole(number: int) -> bytes:
    """A whole number."""
    return struct.pack(">i", number)


def to_binary(nodes: Sequence[Node], version: str = "2.1") -> bytes:
    """A binary file of nodes, written as Inventor's files are."""
    seen: dict[int, str] = {}
    return f"#Inventor V{version} binary  \n".encode() + b"".join(_node(node, version, seen) for node in nodes)


def _node(node: Node, version: str, seen: dict[int, str]) -> bytes:
    """One node, USE where it was written before."""
    if id(node) in seen and node.name:
        return word("USE") + word(node.name)
    seen[id(node)] = node.name
    parts = [word("DEF") + word(node.name)] if node.name else []
    parts.append(word(node.kind))
    if version > "2.0":
        parts.append(whole(2 if node.type.is_group else 0))
    if version > "2.0" or node.type.fields:
        parts.append(whole(len(node.fields)))
        for name, value in node.fields.items():
            field = node.type.fields[name]
            parts += [word(name), _value(value, field, version, seen), whole(int(name in node.ignored))]
    if node.type.is_group:
        parts += [whole(len(node.children)), *(_node(child, version, seen) for child in node.children)]
    return b"".join(parts)


def _value(value: Any, field: FieldType, version: str, seen: dict[int, str]) -> bytes:
    """The value of a field."""
    kind = field.kind
    if kind == "Node":
        return word("NULL") if value is None else _node(value, version, seen)
    if kind in WIDTHS or kind in NUMBERS:
        raw = np.asarray(value, dtype=np.float64).reshape(-1)
        code = ">i4" if kind in WHOLE_NUMBERS else ">f8" if kind in ("Double", "Time", "Vec3d") else ">f4"
        count = whole(len(raw) // WIDTHS.get(kind, 1)) if field.is_many else b""
        return count + (raw.astype(np.int64).astype(np.uint32).astype(">u4") if code == ">i4" else raw.astype(code)).tobytes()
    if kind == "Image":
        height, width, channels = value.shape
        head = struct.pack(">3i", width, height, channels)
        if version <= "2.0":
            wide = np.zeros((height, width, 4), np.uint8)
            wide[..., 4 - channels :] = value
            return head + wide.tobytes()
        return head + value.tobytes() + b"\0" * (-value.size % 4)
    listed = value if field.is_many else [value]
    count = whole(len(listed)) if field.is_many else b""
    return count + b"".join(_single(one, kind) for one in listed)


def _single(value: Any, kind: str) -> bytes:
    """One truth, set of words or text."""
    if kind == "Bool":
        return whole(int(value))
    if kind == "BitMask":
        return b"".join(word(one) for one in value) + word("")
    return word(value)
