"""NPY: points as NumPy saves them, (N, 3) and more columns, or a structured array with fields x, y and z.

The header is read by NumPy, nothing that is pickled is, and the size of the file is held against the shape before any memory
is taken. Coordinates of 32 bits or less, whole or not, stay as they are.

Source: NEP 1, "A simple file format for NumPy arrays".
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import BinaryIO, NamedTuple

import numpy as np

from scanspan.assets.chunks import CHUNK, CloudChunks, join
from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.point_columns import Plan, by_meaning, cloud_from, make_plan, name_by_number, name_columns
from scanspan.assets.scene import Instance
from scanspan.errors import FormatError, InputError
from scanspan.records import Array


class Saved(NamedTuple):
    """Where the rows of an array are in its file."""

    points: int
    width: int  # columns, 0 for a structured array
    kind: np.dtype[np.generic]
    start: int
    by_column: bool


def read_npy(file: ModelFile) -> list[Instance]:
    """Return the one cloud of an NPY file."""
    chunks = npy_chunks(lambda: io.BytesIO(file.content), file.path, len(file.content), CHUNK, file.nonfinite)
    file.check_points(chunks.count or 0)
    return [Instance(join(chunks), name=file.stem)]


def npy_chunks(open_file: Callable[[], BinaryIO], path: str, size: int, chunk: int, nonfinite: str) -> CloudChunks:
    """Return the chunks of an NPY file."""
    with open_file() as stream:
        saved = read_head(stream, size, path)

    def read() -> Iterator[PointCloud]:
        plan: Plan | None = None
        for first in range(0, saved.points, chunk):
            with open_file() as stream:
                rows = rows_of(stream, saved, first, min(chunk, saved.points - first))
            try:
                found = list(rows.T) if saved.width else [rows[name] for name in saved.kind.names or ()]
                names = plan.names if plan else name_by_number(rows) if saved.width else name_columns(saved.kind.names or ())
                columns = by_meaning(names, found)
                plan = plan or make_plan(names, columns)
                yield cloud_from(plan, columns, nonfinite)
            except InputError as error:
                raise FormatError(path, str(error), f"points from {first}" if first else "") from None

    count = saved.points if nonfinite == "error" else None
    return CloudChunks(path, count, None, "", "+Z", [], read)


def read_head(stream: BinaryIO, size: int, path: str) -> Saved:
    """Return where the rows are, after all checks that need no row."""
    try:
        version = np.lib.format.read_magic(stream)
        if version > (2, 0):
            raise ValueError(f"version {version[0]}.{version[1]}, expected 1.0 or 2.0")
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_column, kind = reader(stream)
    except Exception as error:
        # A damaged header is parsed as Python: SyntaxError, TypeError, tokenize errors and more may come.
        line = (str(error).splitlines() or [""])[0][:120]
        raise FormatError(path, f"the header of the array cannot be read: {line}") from None
    start = stream.tell()
    fields = kind.names is not None
    if kind.hasobject or any(n < 0 for n in shape) or len(shape) != (1 if fields else 2):
        expected = "expected numbers in shape (N, 3) or a structured array with x, y and z"
        raise FormatError(path, f"an array of shape {shape} and type {str(kind)[:60]}: {expected}")
    if fields and any(kind[name].kind not in "iuf" or kind[name].shape for name in kind.names or ()):
        raise FormatError(path, f"an array of type {str(kind)[:120]}: expected fields of one number each")
    if not fields and kind.kind not in "iuf":
        raise FormatError(path, f"an array of type {kind}: expected numbers")
    needed = int(np.prod([int(n) for n in shape], dtype=object)) * kind.itemsize
    if needed > size - start:
        raise FormatError(path, f"an array of shape {shape} takes {needed} bytes, there are {size - start}")
    return Saved(int(shape[0]), 0 if fields else int(shape[1]), kind, start, bool(by_column) and not fields)


def rows_of(stream: BinaryIO, saved: Saved, first: int, count: int) -> Array:
    """Return some rows, (count, width) or (count,) of fields, in native byte order."""
    size = saved.kind.itemsize
    if saved.by_column:
        columns = []
        for k in range(saved.width):
            stream.seek(saved.start + (k * saved.points + first) * size)
            columns.append(np.frombuffer(stream.read(count * size), saved.kind))
        rows = np.stack(columns, axis=1)
    else:
        stream.seek(saved.start + first * size * max(saved.width, 1))
        rows = np.frombuffer(stream.read(count * size * max(saved.width, 1)), saved.kind)
        rows = rows.reshape(count, saved.width) if saved.width else rows
    native: Array = rows.astype(saved.kind.newbyteorder("="), copy=False)
    return native
