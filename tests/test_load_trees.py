"""glTF and 3MF: instances, colours and textures kept, and every number of the tree checked."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scanspan.assets.load import load
from scanspan.assets.scene import Scene
from scanspan.errors import LimitError
from tests.models import CORE, ITEM, TRIANGLE_3MF, Write, archive, fault, glb, gltf, mesh_of, mf, picture, writer


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into a folder of the test's own and return its path."""
    return writer(tmp_path)


def check_gltf(scene: Scene) -> None:
    """Fail unless the scene is what `gltf` says."""
    assert [i.name for i in scene.instances] == ["root", "root", "quad", "quad"]
    assert scene.instances[0].geometry is scene.instances[2].geometry
    assert scene.triangle_count == 8
    assert scene.bounds.tolist() == [[0, 0, 0], [7, 2, 0]]
    mesh = mesh_of(scene)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.attributes["normal"].tolist() == [[0, 0, 1]] * 4
    assert mesh.attributes["uv"].tolist() == pytest.approx(np.array([[0, 1], [1, 1], [1, 0], [0, 0.8]]))
    assert mesh.attributes["color"][1].tolist() == pytest.approx([0, 0.501777, 0, 1], abs=1e-5)
    assert mesh.attributes["color"][2].tolist() == [0, 0, 1, 0]
    material = scene.instances[0].material
    assert material.name == "skin"
    assert material.double_sided
    assert material.base_color == pytest.approx((0.735357, 0.0, 1.0, 0.5), abs=1e-6)
    assert material.texture is not None
    assert (material.texture.filter, material.texture.wrap) == ("nearest", ("clamp", "mirror"))
    assert material.texture.image[0, 0].tolist() == [255, 0, 0, 255]
    assert mesh_of(scene, 1).triangles.tolist() == [[0, 1, 2], [3, 2, 1]]


def test_glb(write: Write) -> None:
    check_gltf(load(write("a.glb", glb(*gltf()))))


def test_gltf_with_files_beside_it(write: Write) -> None:
    tree, buffer = gltf()
    tree["buffers"][0]["uri"] = "my%20parts.bin"
    tree["images"][0] = {"uri": "p.png"}
    write("my parts.bin", buffer)
    write("p.png", picture())
    check_gltf(load(write("a.gltf", json.dumps(tree))))


@pytest.mark.parametrize(("mode", "alpha"), [("OPAQUE", [255, 255]), ("MASK", [255, 0]), ("BLEND", [200, 20])])
def test_gltf_alpha(write: Write, mode: str, alpha: list[int]) -> None:
    stream = io.BytesIO()
    Image.fromarray(np.array([[(9, 9, 9, 200), (9, 9, 9, 20)]], np.uint8)).save(stream, format="PNG")
    tree, buffer = gltf()
    tree["materials"][0] |= {"alphaMode": mode, "alphaCutoff": 0.3}
    tree["images"][0] = {"uri": "p.png"}
    write("p.png", stream.getvalue())
    material = load(write("a.glb", glb(tree, buffer))).instances[0].material
    assert material.texture is not None
    assert material.texture.image[0, :, 3].tolist() == alpha
    assert material.base_color is not None
    assert material.base_color[3] == (0.5 if mode == "BLEND" else 1.0)


@pytest.mark.parametrize("uri", ["../p.bin", "/dev/zero", "http://localhost/p.bin", "none.bin", "%2e%2e/p.bin"])
def test_gltf_buffers_outside_are_not_opened(write: Write, uri: str) -> None:
    tree, buffer = gltf()
    write("p.bin", buffer)
    tree["buffers"][0]["uri"] = uri
    assert fault(write("model/a.gltf", json.dumps(tree))).startswith(": the buffer ")


def put(path: str, value: object) -> Callable[[dict[str, Any]], None]:
    """A change of one value in a tree, its place written with dots."""

    def change(tree: dict[str, Any]) -> None:
        *parents, last = path.split(".")
        row: Any = tree
        for key in parents:
            row = row[int(key)] if isinstance(row, list) else row[key]
        row[int(last) if isinstance(row, list) else last] = value

    return change


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("asset.version", "1.0", "asset.version: expected glTF version 2, got '1.0'"),
        ("asset", 5, "asset.version: expected glTF version 2, got 'None'"),
        (
            "extensionsRequired",
            ["KHR_draco_mesh_compression"],
            "the file needs the extension 'KHR_draco_mesh_compression', which cannot be",
        ),
        ("accessors.0.count", 2_000_000_000, "accessors[0]: 2000000000 items end at byte 24000000000 of a view of 48 bytes"),
        ("accessors.0.count", -1, "accessors[0].count: expected a whole number from 1, got -1"),
        ("accessors.0.count", 2**63, "accessors[0].count: expected a whole number from 1, got 9223372036854775808"),
        ("accessors.0.count", "4", "accessors[0].count: expected a whole number from 1, got 4"),
        ("accessors.0.type", "VEC9", "accessors[0]: unknown type 'VEC9'"),
        ("accessors.0.componentType", 5, "accessors[0]: unknown componentType '5'"),
        ("accessors.0.bufferView", 9, "accessors[0]: bufferView 9 does not exist, there are 6"),
        ("accessors.0.bufferView", -1, "accessors[0].bufferView: expected a whole number from 0, got -1"),
        ("accessors.0.sparse", {}, "accessors[0]: an accessor that is sparse or has no bufferView cannot be read"),
        ("accessors.0.byteOffset", 4, "accessors[0]: 4 items end at byte 52 of a view of 48 bytes"),
        ("bufferViews.0.byteStride", 1, "accessors[0]: 4 items end at byte 15 of a view of 48 bytes"),
        ("bufferViews.0.byteLength", 10**9, "bufferViews[0]: ends at byte 1000000000 of a buffer of "),
        ("buffers.0.uri", 5, "buffers[0].uri: expected text"),
        ("buffers.0.byteLength", 10**6, "buffers[0]: expected 1000000 bytes in the file, there are "),
        ("bufferViews", 5, "bufferViews: expected a list of objects"),
        ("meshes.0.primitives.0.attributes", {}, "meshes[0].primitives[0]: expected attributes with POSITION"),
        ("meshes.0.primitives.0.attributes.POSITION", 99, "meshes[0].primitives[0]: POSITION 99 does not exist, there are 5"),
        ("meshes.0.primitives.0.attributes.NORMAL", 4, "meshes[0].primitives[0]: NORMAL has 6 items, POSITION has 4"),
        ("meshes.0.primitives.0.attributes.POSITION", 2, "meshes[0].primitives[0]: POSITION: expected type VEC3, got VEC2"),
        ("meshes.0.primitives.0.indices", 0, "meshes[0].primitives[0]: indices: expected whole numbers without a sign"),
        ("meshes.0.primitives.0.material", 7, "meshes[0].primitives[0]: material 7 does not exist, there are 1"),
        ("materials.0.pbrMetallicRoughness", 5, "materials[0].pbrMetallicRoughness: expected an object"),
        ("materials.0.pbrMetallicRoughness.baseColorTexture", 5, "materials[0].baseColorTexture: expected an object"),
        (
            "materials.0.pbrMetallicRoughness.baseColorTexture.index",
            3,
            "materials[0].baseColorTexture: index 3 does not exist, there are 1",
        ),
        (
            "materials.0.pbrMetallicRoughness.baseColorFactor",
            [0, 0, 0, float("nan")],
            "materials[0].baseColorFactor: expected four numbers",
        ),
        ("textures.0.source", 3, "textures[0]: source 3 does not exist, there are 1"),
        ("textures.0.sampler", 3, "textures[0]: sampler 3 does not exist, there are 1"),
        ("images.0.bufferView", 30, "images[0]: bufferView 30 does not exist, there are 6"),
        ("nodes.1.mesh", 3, "nodes[1]: mesh 3 does not exist, there are 1"),
        ("nodes.1.children", [2], "nodes[1].children: node 2 does not exist, there are 2"),
        ("nodes.1.children", 2, "nodes[1].children: expected a list of nodes"),
        ("nodes.1.children", [1], "nodes[1]: node 1 has two parents, 0 and 1"),
        ("nodes.1.children", [0], "scenes[0]: node 0 is a root and a child of 1"),
        ("scene", 4, "scene: scene 4 does not exist, there are 1"),
        ("scenes.0.nodes", [7], "scenes[0].nodes: node 7 does not exist, there are 2"),
        ("scenes.0.nodes", [], "the file has nothing to draw"),
        ("nodes.0.matrix", [1] * 15, "nodes[0].matrix: expected 16 finite numbers"),
        ("nodes.0.matrix", [float("nan")] * 16, "nodes[0].matrix: expected 16 finite numbers"),
        ("nodes.1.rotation", 5, "nodes[1].rotation: expected 4 finite numbers"),
        ("nodes.1.rotation", ["a", 0, 0, 1], "nodes[1].rotation: expected 4 finite numbers"),
        ("nodes.1.matrix", [1.0] * 16, "transform[3] = (2.0, 2.0, 2.0, 6.0): expected the last row (0, 0, 0, 1)"),
    ],
)
def test_damaged_gltf(write: Write, path: str, value: object, message: str) -> None:
    assert fault(write("a.glb", glb(*gltf(put(path, value))))).startswith(f": {message}")


def test_gltf_nodes_in_a_circle_and_nodes_too_deep(write: Write) -> None:
    tree, buffer = gltf()
    tree["scenes"], tree["nodes"] = [{"nodes": []}], [{"children": [1]}, {"children": [0]}]
    assert "nodes are nested in a circle or more than 1000 deep" in fault(write("a.glb", glb(tree, buffer)))
    tree["nodes"] = [{"children": [k + 1]} for k in range(5000)] + [{"mesh": 0}]
    assert "nodes are nested in a circle or more than 1000 deep" in fault(write("b.glb", glb(tree, buffer)))


def test_gltf_indices_out_of_range(write: Write) -> None:
    tree, buffer = gltf(put("accessors.4.componentType", 5121))
    start = tree["bufferViews"][4]["byteOffset"]
    bad = buffer[:start] + bytes([0, 1, 2, 0, 2, 4]) + buffer[start + 6 :]
    assert fault(write("a.glb", glb(tree, bad))) == ": triangles[1] = (0, 2, 4): vertex 4 does not exist, there are 4"


def test_damaged_containers(write: Write) -> None:
    good = glb(*gltf())
    assert fault(write("a.glb", good[:12])) == ": expected at least 20 bytes, got 12"
    assert fault(write("b.glb", good[:-4])) == f": byte 8: expected {len(good)} bytes, the file has {len(good) - 4}"
    assert fault(write("c.glb", good[:4] + b"\1" + good[5:])) == ": expected GLB version 2, got 1"
    assert fault(write("d.glb", good[:12] + b"\xff\xff\xff\x7f" + good[16:])).startswith(
        ": byte 12: the first chunk is not text"
    )
    assert fault(write("e.gltf", "{")).startswith(": the text is not JSON: ")
    assert fault(write("f.gltf", "[]")) == ": the text is not a JSON object"
    assert fault(write("g.gltf", "[" * 100_000)).startswith(": the text is not JSON")
    assert fault(write("h.gltf", b"\xff\xfe\0\1")).startswith(": the text is not JSON: ")


def test_gltf_notes(write: Write) -> None:
    tree, buffer = gltf()
    tree["meshes"][0]["primitives"][1]["mode"] = 1
    tree["extensionsRequired"] = ["KHR_texture_transform"]
    start = tree["bufferViews"][5]["byteOffset"]
    scene = load(write("a.glb", glb(tree, buffer[:start] + b"\0" * (len(buffer) - start))))
    assert scene.triangle_count == 4
    assert scene.notes == (
        "the extension KHR_texture_transform is not applied",
        "points, lines or fans in the file are left out",
        "texture 0 was not read: it is missing, too large or no picture",
    )


def test_3mf(write: Write) -> None:
    resources = (
        '<basematerials id="9"><base name="red" displaycolor="#FF000080"/></basematerials>'
        f'<object id="1" name="part" pid="9" pindex="0">{TRIANGLE_3MF}</object>'
        '<object id="2"><components><component objectid="1"/>'
        '<component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 3"/></components></object>'
    )
    scene = load(write("a.3mf", mf(resources, '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 5 6 7"/><item objectid="1"/>')))
    assert len(scene.instances) == 3
    assert len({id(i.geometry) for i in scene.instances}) == 1
    assert sorted(i.transform[:3, 3].tolist() for i in scene.instances) == [[0, 0, 0], [5, 6, 7], [5, 6, 10]]
    assert all(i.material.base_color == (1.0, 0.0, 0.0, 128 / 255) for i in scene.instances)
    assert scene.up == "+Z"


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (TRIANGLE_3MF.replace('v3="2"', 'v3="3"'), "triangles[0] = (0, 1, 3): vertex 3 does not exist, there are 3"),
        (TRIANGLE_3MF.replace('v3="2"', 'v3="-1"'), "triangles[0] = (0, 1, -1): vertex -1 does not exist, there are 3"),
        (TRIANGLE_3MF.replace('v3="2"', ""), "the file is damaged (KeyError: 'v3')"),
        (TRIANGLE_3MF.replace('x="1"', 'x="1q"'), "the file is damaged ("),
        (TRIANGLE_3MF.replace('x="1"', 'x="nan"'), "positions[1] = (nan, 0.0, 0.0): a vertex that is used is not finite"),
        (TRIANGLE_3MF.replace("</mesh>", ""), "3D/3dmodel.model is not XML: "),
        ("", "the file is damaged (KeyError: '1')"),
    ],
)
def test_damaged_3mf(write: Write, mesh: str, message: str) -> None:
    assert fault(write("a.3mf", mf(f'<object id="1">{mesh}</object>', ITEM))).startswith(f": {message}")


def test_3mf_parts_are_counted_before_they_are_built(write: Write) -> None:
    twice = '<object id="{0}"><components><component objectid="{1}"/><component objectid="{1}"/></components></object>'
    resources = f'<object id="1">{TRIANGLE_3MF}</object>' + "".join(twice.format(k, k - 1) for k in range(2, 60))
    with pytest.raises(LimitError, match=r"a.3mf: more than 100000 parts are placed"):
        load(write("a.3mf", mf(resources, '<item objectid="59"/>')))
    circle = '<object id="1"><components><component objectid="1"/></components></object>'
    assert fault(write("b.3mf", mf(circle, ITEM))) == ": object '1' is a part of itself"
    assert fault(write("c.3mf", mf(f'<object id="1">{TRIANGLE_3MF}</object>', ""))) == ": the file builds nothing"
    assert fault(write("d.3mf", archive({"x.txt": "x"}))) == ": the archive has no 3D/3dmodel.model"
    assert fault(write("e.3mf", b"PK")).startswith(": not a zip archive that can be read: ")


def test_3mf_does_not_expand_entities(write: Write) -> None:
    levels = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 50}">' for k in range(1, 10))
    bomb = f'<!DOCTYPE m [<!ENTITY e0 "aaaaaaaaaa">{levels}]>'
    named = f'<object id="1" name="&e9;">{TRIANGLE_3MF}</object>'
    text = f"{bomb}<model {CORE}><resources>{named}</resources><build>{ITEM}</build></model>"
    assert "3D/3dmodel.model is not XML: " in fault(write("a.3mf", archive({"3D/3dmodel.model": text})))
