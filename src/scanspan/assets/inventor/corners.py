"""Corners of faces and lines: which vertex each one is, and which part, face and place in the indices it belongs to.

Every shape that is made of vertices becomes the same list of corners. What a binding says then is one look-up, and holds for
all shapes alike: a material or a normal for each part, face or vertex, straight or by an index.

Source: the reference pages of IndexedFaceSet, FaceSet, IndexedTriangleStripSet, TriangleStripSet, QuadMesh, IndexedLineSet,
LineSet and MaterialBinding of Inventor 2.1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]

NO_INDEX = np.array([-1])


class Corners(NamedTuple):
    """The corners of all faces, or of all segments, one after the other.

    vertex : (C,) into the coordinates. counts : (F,) corners of each face.
    part, face : (C,) numbers that PER_PART and PER_FACE count by.
    running : (C,) what PER_VERTEX counts by. place : (C,) the place in the indices, -1s counted too.
    """

    vertex: Indices
    counts: Indices
    part: Indices
    face: Indices
    running: Indices
    place: Indices

    def keep(self, faces: NDArray[np.bool_]) -> Corners:
        """Return the corners of some faces."""
        kept = np.repeat(faces, self.counts)
        return Corners(self.vertex[kept], self.counts[faces], *(values[kept] for values in self[2:]))


class Runs(NamedTuple):
    """Runs of vertices: faces, lines or strips. start, length : (R,) into the other two; place, vertex : (N,)."""

    start: Indices
    length: Indices
    place: Indices
    vertex: Indices


def indexed_runs(indices: Indices) -> Runs:
    """Return the runs that negative numbers part."""
    place = np.flatnonzero(indices >= 0)
    run = np.cumsum(indices < 0)[place]
    total = int(run[-1]) + 1 if len(run) else 0
    count = np.bincount(run, minlength=total)
    return Runs(np.cumsum(count) - count, count, place, indices[place])


def counted_runs(counts: Indices, first: int, available: int) -> tuple[Runs, bool]:
    """Return runs of given lengths from a first vertex on, and whether there are enough; -1 stands for all that are left."""
    left = max(available - first, 0)
    lengths: list[int] = []
    is_enough = True
    for count in counts.tolist():
        length = left if count < 0 else count
        if length > left:
            is_enough = False
            break
        lengths.append(length)
        left -= length
    count = np.array(lengths, dtype=np.int64)
    place = np.arange(int(count.sum()))
    return Runs(np.cumsum(count) - count, count, place, place + max(first, 0)), is_enough


def face_corners(runs: Runs) -> Corners:
    """Return the corners where each run is a face."""
    number = np.repeat(np.arange(len(runs.length)), runs.length)
    return Corners(runs.vertex, runs.length, number, number, np.arange(len(runs.vertex)), runs.place)


def strip_corners(runs: Runs) -> Corners:
    """Return the corners where each run is a strip of triangles, all turning the same way."""
    amount = np.maximum(runs.length - 2, 0)
    part = np.repeat(np.arange(len(runs.length)), amount)
    step = np.arange(int(amount.sum())) - np.repeat(np.cumsum(amount) - amount, amount)
    first = runs.start[part] + step
    is_odd = step % 2
    flat = np.stack([first + is_odd, first + 1 - is_odd, first + 2], axis=1).reshape(-1)
    face = np.repeat(np.arange(len(first)), 3)
    counts = np.full(len(first), 3)
    return Corners(runs.vertex[flat], counts, np.repeat(part, 3), face, flat, runs.place[flat])


def quad_corners(rows: int, width: int, first: int) -> Corners:
    """Return the corners of a mesh of quadrilaterals, `width` vertices to a row."""
    row, column = np.divmod(np.arange(max(rows - 1, 0) * max(width - 1, 0)), max(width - 1, 1))
    flat = np.stack([(row + i) * width + column + j for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1).reshape(-1)
    face = np.repeat(np.arange(len(row)), 4)
    return Corners(flat + first, np.full(len(row), 4), np.repeat(row, 4), face, flat, flat)


def line_corners(runs: Runs) -> Corners:
    """Return the two ends of each segment where each run is a line of segments."""
    amount = np.maximum(runs.length - 1, 0)
    line = np.repeat(np.arange(len(runs.length)), amount)
    step = np.arange(int(amount.sum())) - np.repeat(np.cumsum(amount) - amount, amount)
    first = runs.start[line] + step
    flat = np.stack([first, first + 1], axis=1).reshape(-1)
    part = np.repeat(np.arange(len(first)), 2)
    return Corners(runs.vertex[flat], np.full(len(first), 2), part, np.repeat(line, 2), flat, runs.place[flat])


def bind(binding: str, corners: Corners, indices: Indices, is_indexed: bool) -> Indices | None:
    """Return which of the values each corner takes, None for the same everywhere.

    Parameters
    ----------
    binding : the word of a MaterialBinding, a NormalBinding or a TextureCoordinateBinding.
    corners : of the shape.
    indices : of the field for these values; only -1 where the file says nothing.
    is_indexed : whether the shape has indices of its own, which then stand in for those.
    """
    has_own = len(indices) > 0 and not (len(indices) == 1 and indices[0] < 0)
    if binding.startswith("PER_VERTEX"):
        if binding == "PER_VERTEX" or not is_indexed:
            return corners.running
        return _look_up(indices, corners.place) if has_own else corners.vertex
    if binding.startswith(("PER_PART", "PER_FACE")):
        number = corners.part if binding.startswith("PER_PART") else corners.face
        return _look_up(indices, number) if has_own and is_indexed and binding.endswith("INDEXED") else number
    return None


def _look_up(indices: Indices, place: Indices) -> Indices:
    """Return the indices at some places, the last one beyond the end."""
    return np.maximum(indices[np.minimum(place, len(indices) - 1)], 0)
