"""PLY: vertices and faces with any properties; without faces, a cloud of points, or segments where it lists edges.

Names of properties are a matter of custom; the usual ones are known: x y z, nx ny nz, s t / u v / texture_u texture_v, red
green blue alpha, vertex_indices / vertex_index. Other numbers at a vertex are kept under their own names. Where both vertices
and faces have colours the faces' win, unless all faces have the same, which says nothing.

Source: G. Turk, "The PLY Polygon File Format", 1994; MeshLab's and Blender's exporters for the names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.pictures import decode_texture
from scanspan.assets.formats.ply_body import Table, read_body
from scanspan.assets.formats.ply_header import read_header
from scanspan.assets.formats.point_columns import by_meaning, cloud_from, make_plan, name_columns
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Geometry, Instance
from scanspan.assets.shapes import Segments

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
COLOR_NAMES = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)
FACE_NAMES = ("vertex_indices", "vertex_index")


def read_ply(file: ModelFile) -> list[Instance]:
    """Return the one mesh, cloud or set of segments of a PLY file."""
    header = read_header(file)
    tables = read_body(header, file)
    vertex = tables.get("vertex", Table())
    if any(name not in vertex.columns for name in "xyz"):
        raise file.error("the file has no element vertex with properties x, y and z")
    positions = np.stack([vertex.columns[name].astype(np.float64) for name in "xyz"], axis=1)
    attributes = _attributes(vertex, file)
    material = _material(header.comments, file)
    geometry: Geometry
    if tables.get("face", Table()).count:
        geometry = _mesh(positions, attributes, tables["face"], file)
    elif tables.get("tristrips", Table()).count:
        geometry = _strips(positions, attributes, tables["tristrips"], file)
    elif tables.get("edge", Table()).count and {"vertex1", "vertex2"} <= tables["edge"].columns.keys():
        ends = np.stack([tables["edge"].columns[name].astype(np.int64) for name in ("vertex1", "vertex2")], axis=1)
        geometry = Segments(positions, ends, attributes.get("color"), nonfinite=file.nonfinite)
    else:
        if not len(positions):
            raise file.error("the file has no vertices")
        geometry = _cloud(vertex, file)
    return [Instance(geometry, material=material, name=file.stem)]


def _attributes(vertex: Table, file: ModelFile) -> dict[str, NDArray[Any]]:
    """Return what is known at the vertices besides their positions."""
    columns = dict(vertex.columns)
    for name in "xyz":
        columns.pop(name)
    found: dict[str, NDArray[Any]] = {}
    color = _color(columns, file)
    if color is not None:
        found["color"] = color
    for key, names in (("normal", ("nx", "ny", "nz")), *(("uv", pair) for pair in UV_NAMES)):
        if key not in found and all(name in columns for name in names):
            found[key] = np.stack([columns.pop(name) for name in names], axis=1)
    return {**{name: values[:, None] for name, values in columns.items() if name not in ("normal", "uv", "color")}, **found}


def _color(columns: dict[str, NDArray[Any]], file: ModelFile) -> NDArray[Any] | None:
    """Take the colour out of the columns: bytes as they are, other whole numbers scaled, floats 0..1."""
    for names in COLOR_NAMES:
        if not all(name in columns for name in names[:3]):
            continue
        chosen = [columns.pop(name) for name in names if name in columns]
        if len(chosen) == 4 and not chosen[3].any():
            file.note("alpha is 0 everywhere, which would show nothing; it is left out")
            chosen.pop()
        if all(values.dtype == np.uint8 for values in chosen):
            return np.stack(chosen, axis=1)
        highest = [np.iinfo(v.dtype).max if v.dtype.kind in "iu" else 1.0 for v in chosen]
        table = np.stack([v.astype(np.float64) / most for v, most in zip(chosen, highest, strict=True)], axis=1)
        if not ((table >= 0) & (table <= 1)).all():
            raise file.error(f"a colour ({names[0]}, {names[1]}, {names[2]}) is not 0..1")
        return table
    return None


def _indices(table: Table, names: tuple[str, ...], file: ModelFile) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (counts, vertices) of the list with one of the names."""
    for name in names:
        if name in table.lists:
            counts, values = table.lists[name]
            if values.dtype.kind == "f":
                raise file.error(f"property {name} holds numbers with a point, expected vertices")
            return counts, values.astype(np.int64)
    raise file.error(f"the faces have no list called {' or '.join(names)}")


def _check(indices: NDArray[np.int64], counts: NDArray[np.int64], vertex_count: int, file: ModelFile) -> None:
    """Raise for the first face with a vertex that does not exist."""
    bad = np.flatnonzero((indices < 0) | (indices >= vertex_count))
    if len(bad):
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        raise file.error(f"face {face}: vertex {indices[bad[0]]} does not exist, there are {vertex_count}")


def _mesh(positions: NDArray[np.float64], attributes: dict[str, NDArray[Any]], face: Table, file: ModelFile) -> Mesh:
    """Return the mesh of the faces."""
    counts, indices = _indices(face, FACE_NAMES, file)
    _check(indices, counts, len(positions), file)
    file.check_faces(np.unique(counts).tolist())
    file.check_triangles(int(np.maximum(counts - 2, 0).sum()))
    corners: dict[str, ArrayLike] = {}
    color = _color(dict(face.columns), file)
    if color is not None and not ("color" in attributes and (color == color[0]).all()):
        corners["color"] = np.repeat(color, counts, axis=0)

    # Take texture coordinates at the corners where every face has two for each of its corners.
    if "texcoord" in face.lists:
        uv_counts, uv = face.lists["texcoord"]
        if np.array_equal(uv_counts, 2 * counts):
            corners["uv"] = uv.astype(np.float64).reshape(-1, 2)
    return Mesh.from_flat(positions, indices, counts, attributes, corners, nonfinite=file.nonfinite)


def _cloud(vertex: Table, file: ModelFile) -> PointCloud:
    """Return the vertices as a cloud, with what scanners know of points."""
    file.check_points(len(vertex.columns["x"]))
    names = name_columns(list(vertex.columns))
    columns = by_meaning(names, list(vertex.columns.values()))
    return cloud_from(make_plan(names, columns, by_type=True), columns, file.nonfinite)


def _strips(positions: NDArray[np.float64], attributes: dict[str, NDArray[Any]], table: Table, file: ModelFile) -> Mesh:
    """Return the mesh of triangle strips: -1 ends a strip, and every second triangle is turned round."""
    _, indices = _indices(table, FACE_NAMES, file)
    if np.any((indices < -1) | (indices >= len(positions))):
        bad = indices[(indices < -1) | (indices >= len(positions))][0]
        raise file.error(f"a strip: vertex {bad} does not exist, there are {len(positions)}")
    first = np.maximum.accumulate(np.where(indices < 0, np.arange(len(indices)) + 1, 0))
    triples = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    odd = (np.arange(len(triples)) - first[: len(triples)]) % 2 == 1
    triples[odd] = triples[odd][:, [1, 0, 2]]
    triples = triples[(triples >= 0).all(axis=1)]
    file.check_triangles(len(triples))
    return Mesh(positions, triples, attributes=attributes, nonfinite=file.nonfinite)


def _material(comments: list[str], file: ModelFile) -> Material:
    """Return the material: MeshLab names a texture in a comment."""
    for comment in comments:
        words = comment.split(None, 2)
        if len(words) == 3 and words[1] == "TextureFile":
            content = file.beside(words[2], "texture")
            return Material(texture=None if content is None else decode_texture(content, file, words[2]))
    return Material()
