"""OFF: vertices, and faces with any number of corners and perhaps a colour.

Text only. The optional letters before OFF say what follows each position: ST texture coordinates, C a colour, N a normal; 4 and
n (other dimensions) are refused. Source: Geomview manual, "OFF: Object File Format".
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance

HEADER = re.compile(rb"^(ST)?(C)?(N)?(4)?(n)?OFF$")

Line = tuple[int, list[bytes]]


def read_off(file: ModelFile) -> list[Instance]:
    """Return the one mesh of an OFF file."""
    lines = _lines(file)
    flags, lines = _header(lines, file)
    (vertex_count, face_count), lines = _counts(lines, file)
    if vertex_count + face_count > len(lines):
        raise file.error(
            f"expected {vertex_count} vertices and {face_count} faces, there are {len(lines)} lines: the file is cut short"
        )
    positions, attributes = _vertices(lines[:vertex_count], flags, file)
    indices, counts, colors = _faces(lines[vertex_count : vertex_count + face_count], vertex_count, file)
    if not len(counts):
        raise file.error("the file has no faces")
    corners: dict[str, ArrayLike] = {}
    if colors is not None:
        corners["color"] = np.repeat(colors, counts, axis=0)
    mesh = Mesh.from_flat(positions, indices, counts, attributes, corners, nonfinite=file.nonfinite)
    return [Instance(mesh, name=file.stem)]


def _lines(file: ModelFile) -> list[Line]:
    """Return the words of each line that has any, without comments."""
    split = ((n, line.partition(b"#")[0].split()) for n, line in enumerate(file.content.splitlines(), 1))
    return [(n, words) for n, words in split if words]


def _header(lines: list[Line], file: ModelFile) -> tuple[tuple[bool, bool, bool], list[Line]]:
    """Return what follows each position (texture coordinates, colour, normal), and the lines after the header word."""
    if not lines:
        raise file.error("expected OFF, the file has no words")
    number, words = lines[0]
    match = HEADER.match(words[0].removeprefix(b"\xef\xbb\xbf"))
    if match is None:
        if words[0].isdigit():
            return (False, False, False), lines
        raise file.error(f"expected OFF, got {words[0][:20].decode('latin-1')!r}", f"line {number}")
    if match[4] or match[5] or (len(words) > 1 and words[1].upper() == b"BINARY"):
        raise file.error(f"{b' '.join(words[:2]).decode('latin-1')} is a kind of OFF that cannot be read", f"line {number}")
    rest = lines[1:] if len(words) == 1 else [(number, words[1:]), *lines[1:]]
    return (bool(match[1]), bool(match[2]), bool(match[3])), rest


def _counts(lines: list[Line], file: ModelFile) -> tuple[tuple[int, int], list[Line]]:
    """Return the numbers of vertices and faces, and the lines after them."""
    if not lines:
        raise file.error("expected the numbers of vertices and faces, the file ends")
    number, words = lines[0]
    try:
        counts = [int(word) for word in words[:2]]
    except ValueError:
        counts = []
    if len(counts) < 2 or min(counts) < 0:
        shown = b" ".join(words)[:40].decode("latin-1")
        raise file.error(f"expected the numbers of vertices and faces, got {shown!r}", f"line {number}")
    return (counts[0], counts[1]), lines[1:]


def _vertices(
    lines: list[Line], flags: tuple[bool, bool, bool], file: ModelFile
) -> tuple[NDArray[np.float64], dict[str, ArrayLike]]:
    """Return positions and what is known at the vertices; columns are position, normal, colour, texture coordinates."""
    has_uv, has_color, has_normal = flags
    least = 3 + 3 * has_normal + 3 * has_color + 2 * has_uv
    for number, words in lines:
        if len(words) < least:
            raise file.error(f"expected {least} numbers for a vertex, got {len(words)}", f"line {number}")
    width = min((len(words) for _, words in lines), default=3)
    try:
        table = np.array([list(map(float, words[:width])) for _, words in lines], dtype=np.float64).reshape(-1, width)
    except ValueError:
        raise _bad_number(lines, file) from None

    # Take the columns apart.
    attributes: dict[str, ArrayLike] = {}
    place = 3
    if has_normal:
        attributes["normal"] = table[:, place : place + 3]
        place += 3
    if has_color:
        wide = 4 if width >= least + 1 else 3
        attributes["color"] = _as_color(table[:, place : place + wide], file)
        place += wide
    if has_uv:
        attributes["uv"] = table[:, place : place + 2]
    return table[:, :3], attributes


def _as_color(values: NDArray[np.float64], file: ModelFile) -> NDArray[np.float32] | NDArray[np.uint8]:
    """Return colours as bytes where one is above 1, else as floats."""
    if not np.isfinite(values).all() or (values.size and (values.min() < 0 or values.max() > 255)):
        raise file.error("a colour is not 0..255 or 0..1")
    if values.size and values.max() > 1:
        return np.rint(values).astype(np.uint8)
    return values.astype(np.float32)


def _faces(
    lines: list[Line], vertex_count: int, file: ModelFile
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32] | None]:
    """Return the corners of all faces, how many each has, and a colour for each face if any has one."""
    counts: list[int] = []
    corners: list[int] = []
    colors: dict[int, list[float]] = {}
    for face, (number, words) in enumerate(lines):
        try:
            count = int(words[0])
            row = [int(word) for word in words[1 : 1 + count]] if count >= 0 else []
        except ValueError:
            raise _bad_number([(number, words)], file) from None
        if count < 0 or len(row) != count:
            raise file.error(f"expected {words[0][:20].decode()} vertices for a face, got {len(words) - 1}", f"line {number}")
        if row and not (min(row) >= 0 and max(row) < vertex_count):
            bad = next(v for v in row if not 0 <= v < vertex_count)
            raise file.error(f"face {face}: vertex {str(bad)[:40]} does not exist, there are {vertex_count}", f"line {number}")
        counts.append(count)
        corners.extend(row)
        color = words[1 + count :]
        if len(color) in (3, 4):
            colors[face] = _face_color(color, file, number)
    file.check_faces(counts)
    table = None
    if colors:
        table = np.ones((len(counts), 4), dtype=np.float32)
        for face, color_row in colors.items():
            table[face, : len(color_row)] = color_row
    return np.array(corners, dtype=np.int64), np.array(counts, dtype=np.int64), table


def _face_color(words: list[bytes], file: ModelFile, number: int) -> list[float]:
    """Return a colour 0..1 from whole numbers 0..255 or from floats 0..1, told apart by how they are written."""
    try:
        whole = all(word.isdigit() for word in words)
        values = [int(word) / 255 if whole else float(word) for word in words]
    except ValueError:
        raise _bad_number([(number, words)], file) from None
    if not all(0 <= value <= 1 for value in values):
        raise file.error("a colour is not 0..255 or 0..1", f"line {number}")
    return values


def _bad_number(lines: list[Line], file: ModelFile) -> Exception:
    """Return the error for the first word that is no number, or no whole number where one has to be."""
    for number, words in lines:
        for word in words:
            try:
                float(word)
            except ValueError:
                return file.error(f"expected a number, got {word[:20].decode('latin-1')!r}", f"line {number}")
    number, words = lines[0]
    return file.error(f"expected whole numbers, got {b' '.join(words)[:40].decode('latin-1')!r}", f"line {number}")
