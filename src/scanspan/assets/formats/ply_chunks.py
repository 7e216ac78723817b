"""The vertices of a PLY file chunk by chunk, whether or not it has faces: what a tree of splats is built from.

A binary file whose vertices are all of one length is read as it stands, so many at a time. Others, text and vertices with
lists among their properties, are read whole first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from scanspan.assets.chunks import CloudChunks
from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats.files import DiskFolder, Limits, ModelFile
from scanspan.assets.formats.ply_body import Table, read_body
from scanspan.assets.formats.ply_header import MAX_HEADER, Element, Header, read_header
from scanspan.assets.formats.point_columns import Plan, by_meaning, cloud_from, make_plan, name_columns
from scanspan.errors import FormatError, InputError


def ply_chunks(open_file: Callable[[], BinaryIO], path: str, size: int, chunk: int, nonfinite: str) -> CloudChunks:
    """Return the chunks of a PLY file's vertices."""
    with open_file() as stream:
        file = _as_file(stream.read(MAX_HEADER + 64), path, nonfinite)
    header = read_header(file)
    names = [element.name for element in header.elements]
    before = header.elements[: names.index("vertex")] if "vertex" in names else header.elements
    vertex = header.elements[len(before)] if "vertex" in names else Element("vertex", 0)
    if not {"x", "y", "z"} <= {p.name for p in vertex.properties if not p.count_type}:
        raise FormatError(path, "the file has no element vertex with properties x, y and z")
    is_plain = bool(header.order) and not any(element.lists and element.count for element in [*before, vertex])
    start = header.start + sum(element.least_bytes * element.count for element in before)
    if is_plain and start + vertex.least_bytes * vertex.count > size:
        room = max(size - start, 0) // vertex.least_bytes
        raise FormatError(path, f"expected {vertex.count} of element vertex, there is room for {room}")

    def read() -> Iterator[PointCloud]:
        plan: Plan | None = None
        parts = _rows(open_file, header, vertex, start, chunk) if is_plain else _whole(open_file, path, nonfinite, chunk)
        for table in parts:
            meanings = name_columns(list(table.columns))
            columns = by_meaning(meanings, list(table.columns.values()))
            plan = plan or make_plan(meanings, columns, by_type=True)
            try:
                yield cloud_from(plan, columns, nonfinite)
            except InputError as error:
                raise FormatError(path, str(error)) from None

    count = vertex.count if nonfinite == "error" else None
    return CloudChunks(path, count, None, "", "+Y", [], read)


def _as_file(content: bytes, path: str, nonfinite: str) -> ModelFile:
    """Return bytes as the readers of PLY take them; nothing beside the file is opened."""
    return ModelFile(path, content, DiskFolder(Path(path).parent), Limits(len(content), 0, 0, 0), nonfinite)


def _rows(open_file: Callable[[], BinaryIO], header: Header, vertex: Element, start: int, chunk: int) -> Iterator[Table]:
    """Give the vertices of a binary file, so many at a time."""
    kind = np.dtype([(p.name, header.order + p.type) for p in vertex.properties])
    with open_file() as stream:
        for first in range(0, vertex.count, chunk):
            stream.seek(start + first * kind.itemsize)
            count = min(chunk, vertex.count - first)
            rows = np.frombuffer(stream.read(count * kind.itemsize), kind, count)
            yield Table(count, {p.name: rows[p.name].astype(p.type) for p in vertex.properties})


def _whole(open_file: Callable[[], BinaryIO], path: str, nonfinite: str, chunk: int) -> Iterator[Table]:
    """Give the vertices of a file that has to be read whole."""
    with open_file() as stream:
        file = _as_file(stream.read(), path, nonfinite)
    table = read_body(read_header(file), file)["vertex"]
    for first in range(0, len(table.columns["x"]), chunk):
        yield Table(table.count, {name: values[first : first + chunk] for name, values in table.columns.items()})
