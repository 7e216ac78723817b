"""Model files made by hand for the tests of load(), whole ones, and the helpers that read them."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scanspan.assets.load import load
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Scene
from scanspan.errors import FormatError

Write = Callable[[str, "bytes | str"], Path]

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
ITEM = '<item objectid="1"/>'
CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
TRIANGLE_3MF = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>'
    '<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>'
)


def writer(folder: Path) -> Write:
    """Return a function that writes a file below a folder and returns its path."""

    def write_file(name: str, content: bytes | str) -> Path:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write_file


def picture(width: int = 2, height: int = 2, kind: str = "PNG") -> bytes:
    """A picture whose top-left pixel is red and whose others are blue."""
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[..., 2] = 255
    pixels[0, 0] = 255, 0, 0
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format=kind)
    return stream.getvalue()


def mesh_of(scene: Scene, number: int = 0) -> Mesh:
    """The mesh of an instance."""
    geometry = scene.instances[number].geometry
    assert isinstance(geometry, Mesh)
    return geometry


def fault(path: Path, **options: Any) -> str:
    """The message that loading gives; it is one line, begins with the path and is a FormatError."""
    with pytest.raises(FormatError) as caught:
        load(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    return message[len(str(path)) :]


def binary_stl(count: int, header: bytes = b"") -> bytes:
    """A binary STL of some triangles along x."""
    rows = [struct.pack("<12fH", 0, 0, 1, k, 0, 0, k + 1, 0, 0, k, 1, 0, 0) for k in range(count)]
    return header.ljust(80, b"\0") + struct.pack("<I", count) + b"".join(rows)


TEXT_STL = (
    "solid a b\n"
    + "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    + "endsolid\n"
)


def ply(form: str, faces: list[list[int]], vertices: int = 5) -> bytes:
    """A PLY with colours of vertices and of faces, and a list beside the corners, in any of the three forms."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    head = (
        f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex {vertices}\nproperty float x\nproperty double y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty short quality\n"
        f"element face {len(faces)}\nproperty uchar flag\n"
        "property list uchar int vertex_indices\nproperty list ushort float texcoord\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    )
    points = [(0, 0, 0), (4, 2, 0), (0, 4, 0), (1, 2, 0), (9, 9, 9)][:vertices]
    rows = [("fdfBBBh", (*p, 10 * k, 0, 255, -k)) for k, p in enumerate(points)]
    for k, face in enumerate(faces):
        uv = [float(v) for v in face for _ in range(2)]
        rows.append((f"BB{len(face)}iH{len(uv)}f3B", (1, len(face), *face, len(uv), *uv, 50 * k, 1, 2)))
    if not order:
        return (head + "".join(" ".join(map(str, row)) + "\n" for _, row in rows)).encode()
    return head.encode() + b"".join(struct.pack(order + kind, *row) for kind, row in rows)


def archive(members: dict[str, bytes | str]) -> bytes:
    """A zip archive."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in members.items():
            target.writestr(name, content)
    return stream.getvalue()


def gltf(change: Callable[[dict[str, Any]], None] | None = None) -> tuple[dict[str, Any], bytes]:
    """A tree and its buffer: two triangles with everything, used by two nodes, one below the other."""
    positions = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], "<f4")
    normals = np.array([(0, 0, 1)] * 4, "<f4")
    uv = np.array([(0, 0), (65535, 0), (65535, 65535), (0, 13107)], "<u2")
    color = np.array([(255, 0, 0, 255), (0, 55, 0, 255), (0, 0, 255, 0), (255, 255, 255, 255)], "u1")
    indices = np.array([0, 1, 2, 0, 2, 3], "<u2")
    pieces = [positions.tobytes(), normals.tobytes(), uv.tobytes(), color.tobytes(), indices.tobytes(), picture()]
    starts = np.cumsum([0] + [len(piece) + -len(piece) % 4 for piece in pieces]).tolist()
    buffer = b"".join(piece + b"\0" * (-len(piece) % 4) for piece in pieces)
    shape = [("VEC3", 5126, 4), ("VEC3", 5126, 4), ("VEC2", 5123, 4), ("VEC4", 5121, 4), ("SCALAR", 5123, 6)]
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "root", "mesh": 0, "children": [1], "camera": 0},
            {"mesh": 0, "translation": [5, 0, 0], "scale": [2, 2, 2]},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1, "aspectRatio": 1}}],
        "meshes": [
            {
                "name": "quad",
                "primitives": [
                    {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3}, "indices": 4, "material": 0},
                    {"attributes": {"POSITION": 0}, "mode": 5},
                ],
            }
        ],
        "materials": [
            {
                "name": "skin",
                "doubleSided": True,
                "alphaMode": "BLEND",
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.0, 1.0, 0.5], "baseColorTexture": {"index": 0}},
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": 5, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": k, "type": kind, "componentType": component, "count": count, "normalized": k in (2, 3)}
            for k, (kind, component, count) in enumerate(shape)
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": starts[k], "byteLength": len(piece)} for k, piece in enumerate(pieces)],
        "buffers": [{"byteLength": len(buffer)}],
    }
    if change is not None:
        change(tree)
    return tree, buffer


def glb(tree: dict[str, Any], buffer: bytes) -> bytes:
    """A GLB file."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(buffer), 0x004E4942) + buffer
    return struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks


def mf(resources: str, build: str) -> bytes:
    """A 3MF file."""
    text = (
        f'<?xml version="1.0"?><model unit="millimeter" {CORE}><resources>{resources}</resources><build>{build}</build></model>'
    )
    return archive({"3D/3dmodel.model": text})
