"""OBJ: vertices, texture coordinates and normals numbered apart, and faces that name all three at each corner.

Lines are sorted by their first word in one pass; the numbers of each kind are then read all at once, which takes about a
microsecond a line. A face keeps all its corners. The file becomes one instance for each pair of object and material, in the
order in which the pairs first appear, because an instance has one material. Free-form curves, lines and points are left out,
with a note.

Source: Wavefront, "Object Files (.obj)", Advanced Visualizer manual, appendix B1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.obj_corners import Corners, read_corners
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance

FloatArray = NDArray[np.float64]

SKIPPED = {b"l": "lines", b"p": "points", b"curv": "curves", b"curv2": "curves", b"surf": "surfaces"}


@dataclass
class Statements:
    """The lines of a file by kind, each with its line number beside it, and what was in force at each face."""

    vertices: list[bytes] = field(default_factory=list)
    vertex_lines: list[int] = field(default_factory=list)
    uvs: list[bytes] = field(default_factory=list)
    uv_lines: list[int] = field(default_factory=list)
    normals: list[bytes] = field(default_factory=list)
    normal_lines: list[int] = field(default_factory=list)
    faces: list[bytes] = field(default_factory=list)
    face_lines: list[int] = field(default_factory=list)
    seen: list[tuple[int, int, int]] = field(default_factory=list)
    group: list[int] = field(default_factory=list)
    groups: dict[tuple[str, str], int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)
    skipped: set[str] = field(default_factory=set)


def read_obj(file: ModelFile) -> list[Instance]:
    """Return the meshes of an OBJ file, one for each object and material."""
    statements = _sort_lines(file)
    positions, colors = _positions(statements, file)
    uv = _numbers(statements.uvs, statements.uv_lines, 2, "vt", file)
    normals = _numbers(statements.normals, statements.normal_lines, 3, "vn", file)
    if not statements.faces:
        raise file.error("the file has no faces")
    totals = (len(positions), len(uv), len(normals))
    corners = read_corners(statements.faces, statements.face_lines, statements.seen, totals, file)
    file.check_faces(np.unique(corners.counts).tolist())
    file.check_triangles(int(np.maximum(corners.counts - 2, 0).sum()))
    for kind in sorted(statements.skipped):
        file.note(f"{kind} in the file are left out")

    # Read the materials only if a face uses one.
    used = {material for _, material in statements.groups}
    materials = _materials(statements.libraries, file) if used != {""} else {}
    instances: list[Instance] = []
    group = np.array(statements.group, dtype=np.int64)
    for (name, material), number in statements.groups.items():
        chosen = corners if len(statements.groups) == 1 else corners.of_faces(group == number)
        mesh = _mesh(positions, colors, uv, normals, chosen, len(statements.groups) > 1, file)
        if material and material not in materials:
            file.note(f"material {material!r} is not defined")
        instances.append(Instance(mesh, material=materials.get(material, Material(material)), name=name or file.stem))
    return instances


def _sort_lines(file: ModelFile) -> Statements:
    """Sort the lines by their first word."""
    content = file.content.removeprefix(b"\xef\xbb\xbf")
    if b"\0" in content[:4096]:
        raise file.error("expected text, the file is binary or UTF-16")
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    content = content.replace(b"\r\n", b"\n")
    lines = content.split(b"\n")
    if b"\\\n" in content:
        lines = _join_continued(lines)
    found = Statements()
    object_name, material = "", ""
    number_of_group = -1
    for number, line in enumerate(lines, 1):
        word, _, rest = line.partition(b" ")
        if word == b"v":
            found.vertices.append(rest)
            found.vertex_lines.append(number)
        elif word == b"f":
            if number_of_group < 0:
                number_of_group = found.groups.setdefault((object_name, material), len(found.groups))
            found.faces.append(rest)
            found.face_lines.append(number)
            found.seen.append((len(found.vertices), len(found.uvs), len(found.normals)))
            found.group.append(number_of_group)
        elif word == b"vn":
            found.normals.append(rest)
            found.normal_lines.append(number)
        elif word == b"vt":
            found.uvs.append(rest)
            found.uv_lines.append(number)
        elif line and line[0] != 35:
            words = line.split(None, 1)
            if not words:
                continue
            if words[0] in (b"v", b"f", b"vn", b"vt"):
                # Come back to a line that is indented or uses tabs.
                again = b" ".join(line.split())
                _file_again(found, again, number, object_name, material)
                number_of_group = -1
                continue
            text = words[1].strip().decode("utf-8", "replace") if len(words) == 2 else ""
            if words[0] == b"usemtl":
                material, number_of_group = text, -1
            elif words[0] == b"o":
                object_name, number_of_group = text, -1
            elif words[0] == b"mtllib":
                found.libraries.append(text)
            elif words[0] in SKIPPED:
                found.skipped.add(SKIPPED[words[0]])
    return found


def _file_again(found: Statements, line: bytes, number: int, object_name: str, material: str) -> None:
    """Sort one line whose words have been brought to single spaces."""
    word, _, rest = line.partition(b" ")
    if word == b"f":
        found.group.append(found.groups.setdefault((object_name, material), len(found.groups)))
        found.faces.append(rest)
        found.face_lines.append(number)
        found.seen.append((len(found.vertices), len(found.uvs), len(found.normals)))
        return
    texts, numbers = {
        b"v": (found.vertices, found.vertex_lines),
        b"vt": (found.uvs, found.uv_lines),
        b"vn": (found.normals, found.normal_lines),
    }[word]
    texts.append(rest)
    numbers.append(number)


def _join_continued(lines: list[bytes]) -> list[bytes]:
    """Join lines that end in a backslash with the next ones; empty lines keep the numbers of the others."""
    joined: list[bytes] = []
    pieces: list[bytes] = []
    for line in lines:
        if line.endswith(b"\\"):
            pieces.append(line[:-1])
            continue
        joined.extend([b""] * len(pieces))
        joined.append(b" ".join([*pieces, line]))
        pieces = []
    return [*joined, b" ".join(pieces)]


def _positions(statements: Statements, file: ModelFile) -> tuple[FloatArray, FloatArray | None]:
    """Return the positions, and colours where the vertices have them: x y z, x y z w, x y z r g b or x y z r g b a."""
    rows = [text.split() for text in statements.vertices]
    widths = {len(row) for row in rows}
    if widths <= {3, 4} or not widths & {6, 7}:
        return _numbers(statements.vertices, statements.vertex_lines, 3, "v", file), None
    full = _numbers(statements.vertices, statements.vertex_lines, min(widths), "v", file)
    if min(widths) < 6:
        file.note("only some vertices have colours; they are left out")
        return np.ascontiguousarray(full[:, :3]), None
    colors = full[:, 3 : min(7, min(widths))]
    if not (np.isfinite(colors).all() and (colors >= 0).all() and (colors <= 255).all()):
        raise file.error("a vertex has a colour that is not 0..1 or 0..255")
    return np.ascontiguousarray(full[:, :3]), colors / 255.0 if (colors > 1).any() else colors


def _numbers(texts: list[bytes], lines: list[int], width: int, word: str, file: ModelFile) -> FloatArray:
    """Return the first `width` numbers of each line."""
    rows = [text.split() for text in texts]
    try:
        if all(len(row) == width for row in rows):
            values = list(map(float, chain.from_iterable(rows)))
        else:
            values = list(map(float, chain.from_iterable(row[:width] for row in rows)))
            if any(len(row) < width for row in rows):
                raise ValueError
    except ValueError:
        raise _bad_row(rows, lines, width, word, file) from None
    return np.array(values, dtype=np.float64).reshape(-1, width)


def _bad_row(rows: list[list[bytes]], lines: list[int], width: int, word: str, file: ModelFile) -> Exception:
    """Return the error for the first line without enough numbers."""
    for row, line in zip(rows, lines, strict=True):
        if len(row) < width:
            return file.error(f"expected {word} and {width} numbers, got {len(row)}", f"line {line}")
        for text in row[:width]:
            try:
                float(text)
            except ValueError:
                return file.error(f"expected {word} and {width} numbers, got {text[:20].decode('latin-1')!r}", f"line {line}")
    return file.error(f"a line {word} has no {width} numbers")


def _mesh(
    positions: FloatArray,
    colors: FloatArray | None,
    uv: FloatArray,
    normals: FloatArray,
    chosen: Corners,
    is_part: bool,
    file: ModelFile,
) -> Mesh:
    """Return the mesh of some faces; a part of the file keeps only the vertices that it uses."""
    indices = chosen.vertices
    if is_part:
        used, indices = np.unique(indices, return_inverse=True)
        positions = positions[used]
        colors = None if colors is None else colors[used]
    attributes: dict[str, ArrayLike] = {} if colors is None else {"color": colors}
    corners: dict[str, ArrayLike] = {}
    for name, values, numbers in (("uv", uv, chosen.uvs), ("normal", normals, chosen.normals)):
        if numbers is None or not (numbers >= 0).any():
            continue
        if not is_part and len(values) == len(positions) and np.array_equal(numbers, indices):
            attributes[name] = values
            continue
        at_corners = values[np.maximum(numbers, 0)]
        at_corners[numbers < 0] = 0.0
        corners[name] = at_corners
    return Mesh.from_flat(positions, indices, chosen.counts, attributes, corners, nonfinite=file.nonfinite)


def _materials(libraries: list[str], file: ModelFile) -> dict[str, Material]:
    """Return the materials of all libraries that the file names, by name."""
    found: dict[str, Material] = {}
    for text in libraries:
        content = file.beside(text, "material library")
        if content is None:
            continue
        from scanspan.assets.formats.read_mtl import read_mtl

        for name, material in read_mtl(content, file, text).items():
            found.setdefault(name, material)
    return found
