"""What a tree is built from, as pieces of a cloud that can be gone through again: in memory as it is, else from a file.

Positions may be floats or whole numbers with a scale and an offset. If all pieces have whole numbers with the same scale and
offset, the tree keeps these numbers; else it takes places in the world as float64. What can be read only once (an iterator, a
compressed file) is written to a file on the way, as it came.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.arrays import as_floats
from scanspan.assets.cloud import PointCloud
from scanspan.assets.mesh import Mesh
from scanspan.errors import InputError
from scanspan.jit import kernel
from scanspan.records import Array, Float64Array

ROWS = 1 << 19  # points of a piece at most
COLUMNS = ("color", "normals", "radius")
WIDTHS: dict[str, tuple[int, Any]] = {"color": (3, np.uint8), "normals": (3, np.float32), "radius": (1, np.float32)}
LARGEST_COORDINATE = 1e100


class Piece(NamedTuple):
    """Some points."""

    stored: Array  # (N, 3) int32, or floats
    scale: Float64Array  # (3,) world = stored * scale + offset
    offset: Float64Array  # (3,)
    columns: dict[str, Array]  # what is known besides, by the names of COLUMNS: (N, width)

    @property
    def positions(self) -> Float64Array:
        """(N, 3) in the world."""
        return np.asarray(self.stored * self.scale + self.offset)


class Totals(NamedTuple):
    """What one pass over all pieces tells."""

    points: int
    low: Float64Array  # (3,) of positions; of stored numbers if `scale` is given
    high: Float64Array
    scale: Float64Array | None  # that of the whole numbers of all pieces, or None
    offset: Float64Array
    names: tuple[str, ...]  # of the columns


def as_piece(points: Any, nonfinite: str) -> Piece:
    """Return what a caller gives as points: a PointCloud, an array (N, 3), or a dict of what PointCloud takes and "radius".

    Raises
    ------
    InputError : anything else, or points that PointCloud refuses.
    """
    radius = None
    if isinstance(points, Mapping):
        points = dict(points)
        radius = points.pop("radius", None)
        try:
            cloud = PointCloud(**points, nonfinite="error" if radius is not None else nonfinite)
        except TypeError as error:
            raise InputError(f"expected points by names that PointCloud takes, or radius: {error}") from None
    elif isinstance(points, PointCloud):
        cloud = points
    else:
        cloud = PointCloud(points, nonfinite=nonfinite)
    columns: dict[str, Array] = {}
    if cloud.color is not None:
        columns["color"] = np.broadcast_to(cloud.color, (len(cloud), cloud.color.shape[-1]))[:, :3]
    if cloud.normals is not None:
        columns["normals"] = cloud.normals
    if radius is not None:
        reach = as_floats(np.reshape(radius, (-1, 1)), 1, "radius", np.float32)
        if len(reach) != len(cloud) or not (np.isfinite(reach).all() and (reach >= 0).all()):
            raise InputError(f"radius: expected {len(cloud)} finite numbers, none below 0, got {np.asarray(radius)!r:.80}")
        columns["radius"] = reach
    piece = Piece(cloud.stored, cloud.scale, cloud.offset, columns)
    if len(cloud) and np.abs(cloud.bounds).max() > LARGEST_COORDINATE:
        raise InputError(f"positions: expected coordinates up to {LARGEST_COORDINATE:g}, got {np.abs(cloud.bounds).max():g}")
    return piece


def mesh_piece(mesh: Mesh) -> Piece:
    """Return the vertices of a mesh that triangles use: each reaches as far as the largest ball around one of its triangles.

    So neighbours touch, and the surface is closed. Normals and colours are those of the mesh, and normals that it has not are
    those of its triangles, by their areas.
    """
    used = np.unique(mesh.triangles)
    corners = mesh.positions[mesh.triangles]
    a, b, c = (np.linalg.norm(corners[:, i - 2] - corners[:, i - 1], axis=1) for i in range(3))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)

    # The ball around a triangle goes through its corners, unless an angle is obtuse: then it spans the longest side.
    longest = np.maximum(np.maximum(a, b), c)
    obtuse = 2 * longest * longest >= a * a + b * b + c * c
    with np.errstate(divide="ignore", invalid="ignore"):
        ball = np.where(obtuse | (area == 0), longest / 2, a * b * c / (2 * area))
    radius = np.zeros(len(mesh.positions))
    np.maximum.at(radius, mesh.triangles, ball[:, None])

    columns: dict[str, Array] = {"radius": np.nextafter(radius[used].astype(np.float32), np.float32(np.inf))[:, None]}
    normals = np.zeros((len(mesh.positions), 3))
    if "normal" in mesh.attributes:
        normals[:] = mesh.attributes["normal"]
    else:
        np.add.at(normals, mesh.triangles, normal[:, None])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    columns["normals"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)[used].astype(np.float32)
    if "color" in mesh.attributes:
        color = mesh.attributes["color"][used, :3]
        columns["color"] = color if color.dtype == np.uint8 else np.rint(color * 255.0).astype(np.uint8)
    return Piece(mesh.positions[used], np.ones(3), np.zeros(3), columns)


@kernel
def least_and_most(stored: Array, ends: Float64Array) -> None:
    """Widen the least and the greatest coordinates, (2, 3), to hold points (N, 3)."""
    for axis in range(3):
        least, most = stored[0, axis], stored[0, axis]
        for i in range(len(stored)):
            least, most = min(least, stored[i, axis]), max(most, stored[i, axis])
        ends[0, axis], ends[1, axis] = min(ends[0, axis], least), max(ends[1, axis], most)


def slices(piece: Piece, rows: int = ROWS) -> Iterator[Piece]:
    """Give a piece in parts."""
    for first in range(0, len(piece.stored), rows):
        part = slice(first, first + rows)
        columns = {name: values[part] for name, values in piece.columns.items()}
        yield Piece(piece.stored[part], piece.scale, piece.offset, columns)


def total(pieces: Iterable[Piece], heard: Callable[[int], None]) -> Totals:
    """Return what one pass over all pieces tells.

    Raises
    ------
    InputError : pieces that do not have the same columns.
    """
    count, whole, names = 0, True, None
    world = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
    stored = world.copy()
    scale, offset = np.ones(3), np.zeros(3)
    for number, piece in enumerate(pieces):
        own = tuple(name for name in COLUMNS if name in piece.columns)
        if names is None:
            scale, offset, names = piece.scale, piece.offset, own
        elif own != names:
            raise InputError(f"piece {number} of the points has {_listed(own)}, those before it have {_listed(names)}")
        whole &= piece.stored.dtype == np.int32 and (piece.scale == scale).all() and (piece.offset == offset).all()
        if not len(piece.stored):
            continue
        count += len(piece.stored)
        ends = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        least_and_most(piece.stored, ends)
        stored = np.stack([np.minimum(stored[0], ends[0]), np.maximum(stored[1], ends[1])])
        ends = ends * piece.scale + piece.offset
        world = np.stack([np.minimum(world[0], ends[0]), np.maximum(world[1], ends[1])])
        heard(count)
    if whole and count:
        return Totals(count, stored[0], stored[1], scale, offset, names or ())
    return Totals(count, world[0], world[1], None, np.zeros(3), names or ())


def _listed(names: tuple[str, ...]) -> str:
    """Return names as a text."""
    return " and ".join(names) or "positions alone"


class Spool:
    """Pieces in a file, to be gone through more than once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.pieces: list[tuple[int, np.dtype[Any], Float64Array, Float64Array, tuple[str, ...], int]] = []

    def write(self, pieces: Iterable[Piece]) -> Iterator[Piece]:
        """Write pieces, and give each."""
        with self.path.open("wb") as file:
            for whole in pieces:
                for piece in slices(whole):
                    self._write_piece(file, piece)
                    yield piece

    def _write_piece(self, file: BinaryIO, piece: Piece) -> None:
        """Write a piece."""
        names = tuple(piece.columns)
        self.pieces.append((file.tell(), piece.stored.dtype, piece.scale, piece.offset, names, len(piece.stored)))
        for array in (piece.stored, *piece.columns.values()):
            file.write(np.ascontiguousarray(array).tobytes())

    def remove(self) -> None:
        """Remove the file."""
        self.path.unlink(missing_ok=True)

    def __iter__(self) -> Iterator[Piece]:
        """Give the pieces again."""
        with self.path.open("rb") as file:
            for place, dtype, scale, offset, names, count in self.pieces:
                file.seek(place)
                stored = np.fromfile(file, dtype, 3 * count).reshape(count, 3)
                columns: dict[str, NDArray[Any]] = {}
                for name in names:
                    width, kind = WIDTHS[name]
                    columns[name] = np.fromfile(file, kind, width * count).reshape(count, width)
                yield Piece(stored, scale, offset, columns)


def open_source(source: Any, nonfinite: str) -> tuple[Iterable[Piece], bool]:
    """Return the pieces of a source, and whether they can be gone through more than once.

    Raises
    ------
    InputError : what cannot be taken for points.
    FormatError : a file that cannot be read.
    """
    if isinstance(source, Mesh):
        return [mesh_piece(source)], True
    if isinstance(source, (PointCloud, Mapping)) or hasattr(source, "__array__"):
        return [as_piece(source, nonfinite)], True
    if isinstance(source, (str, Path)):
        return _file_pieces(Path(source), nonfinite), False
    if isinstance(source, (list, tuple)) and not any(isinstance(entry, (Mapping, PointCloud)) for entry in source[:1]):
        return [as_piece(np.reshape(source, (0, 3)) if len(source) == 0 else source, nonfinite)], True
    if isinstance(source, Iterable):
        return (as_piece(points, nonfinite) for points in source), False
    raise InputError(f"expected points: a path, a PointCloud, a Mesh, an array or pieces of these, got {source!r:.80}")


def _file_pieces(path: Path, nonfinite: str) -> Iterator[Piece]:
    """Give the points of a file."""
    from scanspan.assets.chunks import open_chunks

    yield from itertools.chain.from_iterable(slices(as_piece(cloud, nonfinite)) for cloud in open_chunks(path))
