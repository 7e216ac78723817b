"""glTF and GLB, through trimesh: the tree is checked and made simpler first, then trimesh decodes buffers, pictures and nodes.

trimesh keeps colours in 8 bits of linear light, flips texture coordinates before it scales them, and drops nodes with a camera.
So the attributes are renamed to names that it passes through untouched, nodes and meshes are named by their numbers, and
colours and samplers are taken from the tree. Only triangles, lists and strips, are read. Source: Khronos Group, "glTF 2.0
Specification".
"""

from __future__ import annotations

import io
import json
import struct
import warnings
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.gltf_check import Checker, Tree
from scanspan.assets.formats.pictures import picture_to_texture
from scanspan.assets.material import Material, Texture, linear_to_srgb
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance

if TYPE_CHECKING:
    from PIL.Image import Image

JSON_CHUNK = 0x4E4F534A
BINARY_CHUNK = 0x004E4942
WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
NEAREST = 9728
TRIANGLES, STRIP = 4, 5
NODE_KEYS = ("children", "matrix", "translation", "rotation", "scale", "mesh")


def read_gltf(file: ModelFile) -> list[Instance]:
    """Return the meshes of a glTF or GLB file, one instance for each primitive of each node."""
    tree, binary = _split(file)
    checker = Checker(tree, binary, file)
    checker.check()
    scene = _decode(_simplify(tree, file), binary, file)
    materials = _Materials(tree, file)
    meshes: dict[str, Mesh] = {}
    instances: list[tuple[tuple[int, int], Instance]] = []
    order = {name: number for number, name in enumerate(scene.geometry)}
    for frame in scene.graph.nodes_geometry:
        transform, key = scene.graph[frame]
        geometry = scene.geometry[key]
        node = int(str(frame).partition("_")[0])
        mesh_number, primitive = (int(part) for part in geometry.metadata["scanspan"])
        if key not in meshes:
            meshes[key] = _mesh(geometry, tree, mesh_number, primitive, file)
        name = str(tree["nodes"][node].get("name") or tree["meshes"][mesh_number].get("name") or f"node {node}")
        used = tree["meshes"][mesh_number]["primitives"][primitive].get("material")
        material = Material() if used is None else materials.get(used, geometry)
        instances.append(((node, order[key]), Instance(meshes[key], _affine(transform), material, name)))
    file.check_triangles(sum(len(i.geometry.triangles) for _, i in instances if isinstance(i.geometry, Mesh)))
    return [instance for _, instance in sorted(instances, key=lambda pair: pair[0])]


def _affine(transform: ArrayLike) -> NDArray[np.float64]:
    """Return a matrix whose last row is exactly 0 0 0 1 where rounding alone has changed it."""
    matrix = np.array(transform, dtype=np.float64)
    if np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=1e-9):
        matrix[3] = (0.0, 0.0, 0.0, 1.0)
    return matrix


def _split(file: ModelFile) -> tuple[Tree, bytes | None]:
    """Return the tree, and the binary chunk of a GLB."""
    content, binary = file.content, None
    if content[:4] == b"glTF":
        if len(content) < 20:
            raise file.error(f"expected at least 20 bytes, got {len(content)}")
        version, length, size, kind = struct.unpack_from("<4I", content, 4)
        if version != 2:
            raise file.error(f"expected GLB version 2, got {version}")
        if length != len(content):
            raise file.error(f"expected {length} bytes, the file has {len(content)}", "byte 8")
        if kind != JSON_CHUNK or 20 + size > len(content):
            raise file.error("the first chunk is not text, or is cut short", "byte 12")
        place = 20 + size
        text = content[20:place]
        if place + 8 <= len(content):
            size, kind = struct.unpack_from("<2I", content, place)
            if place + 8 + size > len(content):
                raise file.error("the second chunk is cut short", f"byte {place}")
            if kind == BINARY_CHUNK:
                binary = content[place + 8 : place + 8 + size]
    else:
        text = content
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise file.error(f"the text is not JSON: {str(error)[:100] or 'nested too deeply'}") from None
    if not isinstance(tree, dict):
        raise file.error("the text is not a JSON object")
    return tree, binary


def _simplify(tree: Tree, file: ModelFile) -> Tree:
    """Return a tree that trimesh reads without loss: no cameras, no compression, known names."""
    nodes = [_part(node, NODE_KEYS) | {"name": str(i)} for i, node in enumerate(tree.get("nodes", []))]
    meshes = []
    for i, mesh in enumerate(tree.get("meshes", [])):
        kept: list[Tree] = []
        for j, primitive in enumerate(mesh.get("primitives", [])):
            if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP):
                file.note("points, lines or fans in the file are left out")
                continue
            attributes = {f"_{name.lower()}": value for name, value in primitive["attributes"].items()}
            attributes["POSITION"] = primitive["attributes"]["POSITION"]
            kept.append(_part(primitive, ("indices", "mode", "material")) | {"attributes": attributes})
            meshes.append({"primitives": [kept[-1]], "name": f"{i}.{j}", "extras": {"scanspan": [i, j]}})
        for node in nodes:
            if node.get("mesh") == i and "single" not in node:
                node["single"] = [len(meshes) - len(kept) + k for k in range(len(kept))]

    # Give every further primitive of a mesh a node of its own below the first one's.
    for number in range(len(nodes)):
        node = nodes[number]
        node.pop("mesh", None)
        children = list(node.get("children", []))
        for mesh_number in node.pop("single", []):
            children.append(len(nodes))
            nodes.append({"mesh": mesh_number, "name": f"{number}_{mesh_number}"})
        node["children"] = children
    scenes = tree.get("scenes") or [{"nodes": _roots(tree)}]
    simple = _part(tree, ("buffers", "bufferViews", "accessors", "images", "textures", "scene"))
    simple.setdefault("accessors", [])
    materials = [_part(material, ("pbrMetallicRoughness",)) for material in tree.get("materials", [])]
    return simple | {"asset": {"version": "2.0"}, "nodes": nodes, "meshes": meshes, "materials": materials, "scenes": scenes}


def _part(row: Tree, keys: tuple[str, ...]) -> Tree:
    """Return some keys of an object, those that it has."""
    return {key: row[key] for key in keys if key in row}


def _roots(tree: Tree) -> list[int]:
    """Return the nodes without a parent, for a file that lists no scene."""
    children = {child for node in tree.get("nodes", []) for child in node.get("children", [])}
    return [i for i in range(len(tree.get("nodes", []))) if i not in children]


class _Beside(Mapping[str, bytes]):
    """What trimesh asks for buffers and pictures that lie beside the file."""

    def __init__(self, file: ModelFile) -> None:
        self.file = file

    def __getitem__(self, name: str) -> bytes:
        """Return a file in the model's folder, or raise."""
        content = self.file.beside(name, "the file")
        if content is None:
            raise FileNotFoundError(name)
        return content

    def __iter__(self) -> Iterator[str]:
        """List nothing: files are opened by name alone."""
        return iter(())

    def __len__(self) -> int:
        """Count nothing."""
        return 0


def _decode(simple: Tree, binary: bytes | None, file: ModelFile) -> Any:
    """Return trimesh's scene of a simple tree."""
    import trimesh

    text = json.dumps(simple).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), JSON_CHUNK) + text
    if binary is not None:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<2I", len(binary), BINARY_CHUNK) + binary
    content = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return trimesh.load_scene(io.BytesIO(content), file_type="glb", resolver=_Beside(file), process=False)
        except FileNotFoundError as error:
            raise file.error(f"the buffer {str(error)[:80]!r} could not be opened") from None


def _mesh(geometry: Any, tree: Tree, mesh: int, primitive: int, file: ModelFile) -> Mesh:
    """Return one primitive as a mesh, its attributes as the file has them."""
    spec = tree["meshes"][mesh]["primitives"][primitive]
    accessors = tree["accessors"]
    raw = {
        name: _scaled(np.asarray(geometry.vertex_attributes[f"_{name.lower()}"]), accessors[number])
        for name, number in spec["attributes"].items()
    }
    attributes: dict[str, ArrayLike] = {}
    normal = raw.get("NORMAL")
    if normal is not None and normal.ndim == 2 and normal.shape[1] == 3:
        attributes["normal"] = normal
    material = tree["materials"][spec["material"]] if "material" in spec else {}
    rough = material.get("pbrMetallicRoughness", {})
    uv = raw.get(f"TEXCOORD_{(rough.get('baseColorTexture') or {}).get('texCoord', 0)}")
    if uv is not None and uv.ndim == 2 and uv.shape[1] == 2:
        attributes["uv"] = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)
    color = raw.get("COLOR_0")
    if color is not None and color.ndim == 2 and color.shape[1] in (3, 4) and np.isfinite(color).all():
        encoded = np.clip(color, 0.0, 1.0)
        encoded[:, :3] = linear_to_srgb(encoded[:, :3])
        if material.get("alphaMode") != "BLEND" and encoded.shape[1] == 4:
            encoded[:, 3] = 1.0
        attributes["color"] = encoded.astype(np.float32)
    faces = np.asarray(geometry.faces, dtype=np.int64)
    return Mesh(raw["POSITION"], faces, attributes=attributes, nonfinite=file.nonfinite)


def _scaled(values: NDArray[Any], accessor: Tree) -> NDArray[np.float64]:
    """Return values as float64, with whole numbers that stand for 0..1 or -1..1 brought there."""
    if accessor.get("normalized") and values.dtype.kind in "iu":
        return np.maximum(values.astype(np.float64) / np.iinfo(values.dtype).max, -1.0)
    return values.astype(np.float64)


class _Materials:
    """The materials of a file, each made once."""

    def __init__(self, tree: Tree, file: ModelFile) -> None:
        self.tree = tree
        self.file = file
        self.made: dict[int, Material] = {}
        self.textures: dict[tuple[int, str, float], Texture | None] = {}

    def get(self, number: int, geometry: Any) -> Material:
        """Return a material; the geometry that uses it has its picture."""
        if number not in self.made:
            self.made[number] = self._make(number, geometry)
        return self.made[number]

    def _make(self, number: int, geometry: Any) -> Material:
        """Return a new material."""
        spec = self.tree["materials"][number]
        rough = spec.get("pbrMetallicRoughness", {})
        factor = np.ones(4)
        listed = rough.get("baseColorFactor", [1.0] * 4)
        if isinstance(listed, list) and len(listed) == 4:
            factor = np.clip(np.array(listed, dtype=np.float64), 0.0, 1.0)
        if np.isnan(factor).any():
            raise self.file.error("expected four numbers 0..1", f"materials[{number}].baseColorFactor")
        color = linear_to_srgb(factor[:3]).tolist()
        mode = str(spec.get("alphaMode", "OPAQUE"))
        cutoff = float(spec.get("alphaCutoff", 0.5)) if mode == "MASK" else 0.0
        alpha = float(factor[3]) if mode == "BLEND" else 1.0
        texture = None
        if rough.get("baseColorTexture") is not None:
            texture = self._texture(rough["baseColorTexture"]["index"], mode, cutoff / max(float(factor[3]), 1e-9), geometry)
        double_sided = spec.get("doubleSided") is True
        return Material(str(spec.get("name", "")), (color[0], color[1], color[2], alpha), texture, double_sided)

    def _texture(self, number: int, mode: str, cutoff: float, geometry: Any) -> Texture | None:
        """Return a texture, its alpha made 0 or 255 where the material says so."""
        key = (number, mode, cutoff)
        if key in self.textures:
            return self.textures[key]
        spec = self.tree["textures"][number]
        sampler = self.tree["samplers"][spec["sampler"]] if "sampler" in spec else {}
        filter = "nearest" if sampler.get("magFilter") == NEAREST else "bilinear"
        wrap = (WRAPS.get(sampler.get("wrapS", 10497), "repeat"), WRAPS.get(sampler.get("wrapT", 10497), "repeat"))
        picture: Image | None = getattr(getattr(geometry.visual, "material", None), "baseColorTexture", None)
        texture = None
        if picture is None:
            self.file.note(f"texture {number} was not read: it is missing, too large or no picture")
        else:
            texture = picture_to_texture(picture, self.file, f"{number}", filter, wrap)
        if texture is not None and mode != "BLEND":
            image = texture.image.copy()
            image[..., 3] = 255 if mode == "OPAQUE" else np.where(image[..., 3] >= cutoff * 255, 255, 0)
            texture = Texture(image, filter, wrap, max_pixels=self.file.limits.texture_pixels)
        self.textures[key] = texture
        return texture
