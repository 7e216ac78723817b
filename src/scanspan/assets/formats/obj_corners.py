"""The corners of an OBJ file's faces: vertex, texture coordinate and normal of each, counted from 1, or backward from -1.

Where all corners are written alike, which is the rule, the whole text is turned into numbers at once; otherwise corner by
corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.formats.files import ModelFile

IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Corners:
    """Corners of faces, one face after the other, counted from 0; -1 where a corner has no texture coordinate or normal.

    Attributes
    ----------
    counts : (F,) corners of each face.
    vertices, uvs, normals : (sum of counts,); None where no corner of the file has one.
    """

    counts: IntArray
    vertices: IntArray
    uvs: IntArray | None
    normals: IntArray | None

    def of_faces(self, chosen: NDArray[np.bool_]) -> Corners:
        """Return the corners of some of the faces."""
        flat = np.repeat(chosen, self.counts)
        uvs = None if self.uvs is None else self.uvs[flat]
        normals = None if self.normals is None else self.normals[flat]
        return Corners(self.counts[chosen], self.vertices[flat], uvs, normals)


def read_corners(
    texts: list[bytes], lines: list[int], seen: list[tuple[int, int, int]], totals: tuple[int, int, int], file: ModelFile
) -> Corners:
    """Read the corners of all faces.

    Parameters
    ----------
    texts : what stands after the f of each line.
    lines : the line number of each.
    seen : how many vertices, texture coordinates and normals stood above each face, which negative numbers count from.
    totals : how many of them the file has.
    """
    words = [text.split() for text in texts]
    if any(b"#" in text for text in texts):
        words = [text.partition(b"#")[0].split() for text in texts]
    counts = np.array([len(row) for row in words], dtype=np.int64)
    try:
        table = _read_alike(list(chain.from_iterable(words)))
    except (ValueError, OverflowError):
        table = None
    if table is None:
        table = _read_each(words, lines, file)

    # Bring all numbers to counting from 0 and check that they exist.
    found: list[IntArray | None] = []
    for k, kind in enumerate(("vertex", "texture coordinate", "normal")):
        numbers = table[:, k]
        if k and not numbers.any():
            found.append(None)
            continue
        above = np.repeat(np.array([row[k] for row in seen], dtype=np.int64), counts) if (numbers < 0).any() else 0
        numbers = np.where(numbers < 0, numbers + above, np.where(numbers == 0, -1 if k else -2, numbers - 1))
        wrong = (numbers >= totals[k]) | ((numbers < 0) & (table[:, k] != 0)) | ((numbers < 0) & (k == 0))
        if wrong.any():
            first = int(np.argmax(wrong))
            face = int(np.searchsorted(np.cumsum(counts), first, side="right"))
            problem = f"{kind} {table[first, k]} does not exist, there are {totals[k]}"
            raise file.error(problem, f"line {lines[face]}")
        found.append(numbers)
    vertices, uvs, normals = found
    assert vertices is not None
    return Corners(counts, vertices, uvs, normals)


def _read_alike(words: list[bytes]) -> IntArray | None:
    """Return (N, 3) numbers, 0 where there is none, if all corners are written alike; None otherwise."""
    slashes = set(map(bytes.count, words, [b"/"] * len(words)))
    if len(slashes) != 1:
        return None
    blob = b" ".join(words)
    count = slashes.pop()
    double = blob.count(b"//")
    if count > 2 or (double and double != len(words)):
        return None
    width = count + 1 - (1 if double else 0)
    numbers = np.array(list(map(int, blob.replace(b"/", b" ").split())), dtype=np.int64)
    if len(numbers) != width * len(words):
        return None
    columns = {1: [0], 2: [0, 2] if double else [0, 1], 3: [0, 1, 2]}[width]
    table = np.zeros((len(words), 3), dtype=np.int64)
    table[:, columns] = numbers.reshape(-1, width)
    return table if table[:, columns].all() else None


def _read_each(words: list[list[bytes]], lines: list[int], file: ModelFile) -> IntArray:
    """Return (N, 3) numbers, 0 where there is none, corner by corner; raise for the first that is no corner."""
    rows: list[list[int]] = []
    for row, line in zip(words, lines, strict=True):
        for word in row:
            parts = word.split(b"/")
            try:
                numbers = [int(part) if part or not k else 0 for k, part in enumerate(parts)]
                good = len(parts) <= 3 and all(abs(n) < 2**62 for n in numbers)
                good = good and all(n or not part for n, part in zip(numbers, parts, strict=True))
            except ValueError:
                good = False
            if not good:
                raise file.error(f"expected a corner such as 3 or 3/1/2, got {word[:30].decode('latin-1')!r}", f"line {line}")
            rows.append(numbers + [0] * (3 - len(numbers)))
    return np.array(rows, dtype=np.int64).reshape(-1, 3)
