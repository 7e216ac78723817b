"""Clouds that are read a chunk at a time, so that a file may be larger than memory.

`CloudChunks` is what every reader of clouds makes: it says what the file's header says, and gives PointClouds one after the
other, all with the same columns, scale and offset. `load` joins them; a build reads them as they come.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.cloud import COLUMNS, PointCloud
from scanspan.assets.mesh import NONFINITE
from scanspan.errors import FormatError, InputError, unknown_name
from scanspan.records import Float64Array

READERS = {
    "las": ("read_las", "las_chunks"), "laz": ("read_las", "las_chunks"), "ply": ("ply_chunks", "ply_chunks"),
    "npy": ("read_npy", "npy_chunks"), "xyz": ("read_xyz", "xyz_chunks"), "txt": ("read_xyz", "xyz_chunks"),
    "csv": ("read_xyz", "xyz_chunks"), "pts": ("read_xyz", "xyz_chunks"),
}  # fmt: skip
"""Extension to the module in formats/ and its function that reads chunks."""

CHUNK = 1 << 20
"""Points of a chunk: some 40 megabytes while it is read."""


@dataclass(frozen=True, eq=False)
class CloudChunks:
    """A cloud in a file, chunk by chunk; each loop over it reads the file from its beginning.

    Attributes
    ----------
    path : the file as the caller named it.
    count : how many points the file says that it has; None where it does not say.
    bounds : (2, 3) as the file's header has them, which nobody has checked; None where it has none.
    crs : the coordinate reference system as text, "" where the file has none.
    up : the direction that is up in files of this kind.
    notes : what the reader could not do, one line each.
    """

    path: str
    count: int | None
    bounds: Float64Array | None
    crs: str
    up: str
    notes: list[str]
    read: Callable[[], Iterator[PointCloud]]

    def __iter__(self) -> Iterator[PointCloud]:
        return self.read()


def open_chunks(
    path: str | os.PathLike[str], chunk: int = CHUNK, *, nonfinite: str = "error", file_type: str | None = None
) -> CloudChunks:
    """Open a file of points to read it a chunk at a time; no more than some chunks are in memory at once.

    Parameters
    ----------
    path : a LAS, LAZ, COPC, PLY, NPY, XYZ, TXT, CSV or PTS file. Of a PLY with faces the vertices are read; one in text is read
        whole first.
    chunk : points of a chunk at most, at least 1.
    nonfinite : "error" or "drop", as for PointCloud.
    file_type : the extension to go by, where the name has none or a wrong one.

    Returns
    -------
    CloudChunks, to loop over as often as you like: `count`, `bounds` and `crs` are what the header says. All chunks know the
    same of their points.

    Raises
    ------
    FormatError : the file is missing, not a regular file, of an unknown kind, damaged or empty; some damage is found only while
        chunks are read.
    InputError : an option that cannot be used, or a package is missing.
    """
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    if isinstance(chunk, bool) or not isinstance(chunk, int) or not 1 <= chunk <= 1 << 31:
        raise InputError(f"chunk = {chunk!r}: expected a whole number of points, 1 to 2^31")
    name = os.fspath(path)
    kind = (os.path.splitext(name)[1] if file_type is None else str(file_type)).lower().removeprefix(".")
    if kind not in READERS:
        raise unknown_name("file type of a cloud", kind, READERS)
    size = _size_of(name)

    def open_file() -> BinaryIO:
        return open(name, "rb")

    module, function = READERS[kind]
    read: Callable[..., CloudChunks] = getattr(import_module(f"scanspan.assets.formats.{module}"), function)
    return read(open_file, name, size, chunk, nonfinite)


def _size_of(name: str) -> int:
    """Return the size of a regular file that is not empty."""
    try:
        status = os.stat(name)
    except (OSError, ValueError) as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
        raise FormatError(repr(name) if "\0" in name else name, reason) from None
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
        raise FormatError(name, f"it is {kind}, expected a file of points")
    if not status.st_size:
        raise FormatError(name, "the file is empty")
    return status.st_size


def join(chunks: CloudChunks, check: Callable[[int], None] = lambda count: None) -> PointCloud:
    """Return the cloud of all chunks; columns that are 0 throughout say nothing and are left out.

    `check` is told how many points there are so far, and may raise.

    Raises
    ------
    InputError : chunks that differ in what they know or in scale and offset.
    """
    parts: list[PointCloud] = []
    stored: NDArray[Any] | None = None
    columns: dict[str, NDArray[Any]] = {}
    filled = 0
    for part in chunks:
        if chunks.count is None or stored is None:
            parts.append(part)
        if chunks.count is not None and stored is None:
            # Make room for all points once, so that no more than one chunk is in memory twice.
            stored = np.empty((chunks.count, 3), part.stored.dtype)
            columns = {name: np.empty((chunks.count, *v.shape[1:]), v.dtype) for name, v in part.columns.items()}
        if stored is not None:
            check_alike(part, parts[0])
            rows = slice(filled, filled + len(part))
            stored[rows] = part.stored
            for name, values in part.columns.items():
                columns[name] = _fitted(columns[name], values)
                columns[name][rows] = values
        filled += len(part)
        check(filled)
    if not parts:
        return PointCloud([], crs=chunks.crs)
    first = parts[0]
    if stored is None:
        for part in parts:
            check_alike(part, first)
        stored = np.concatenate([part.stored for part in parts])
        columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in first.columns}
    if filled < len(stored):
        stored, columns = stored[:filled], {name: values[:filled] for name, values in columns.items()}
    return _as_cloud(stored, columns, first)


def _fitted(array: NDArray[Any], values: NDArray[Any]) -> NDArray[Any]:
    """Return the room for a column, in a type that holds the values too: intensities may turn into floats."""
    wanted = np.result_type(array, values)
    return array if wanted == array.dtype else array.astype(wanted)


def _as_cloud(stored: NDArray[Any], columns: dict[str, NDArray[Any]], first: PointCloud) -> PointCloud:
    """Return the joined cloud, which keeps these arrays."""
    telling = {name: values for name, values in columns.items() if values.any()}
    for array in (stored, *telling.values()):
        array.flags.writeable = False
    kind = "integers" if stored.dtype == np.int32 else "positions"
    given: dict[str, Any] = {kind: stored, **telling}
    return PointCloud(scale=first.scale, offset=first.offset, crs=first.crs, size=first.size, **given)


def check_alike(part: PointCloud, first: PointCloud) -> None:
    """Raise for a chunk that cannot stand in one cloud with the first."""
    if part.columns.keys() != first.columns.keys() or part.stored.dtype != first.stored.dtype:
        names = [", ".join(name for name in COLUMNS if name in one.columns) or "nothing" for one in (part, first)]
        raise InputError(f"a chunk of {part.stored.dtype} knows {names[0]}, the first of {first.stored.dtype} {names[1]}")
    if not (np.array_equal(part.scale, first.scale) and np.array_equal(part.offset, first.offset)):
        raise InputError("a chunk has another scale or offset than the first")
