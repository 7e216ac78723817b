"""STL: triangles without anything else, in text or in binary.

A file is binary when its size is exactly what its count asks for, whatever its first word: many binary files begin with
"solid". The corners stay as they stand, three for each triangle; where they should be one, shading finds out. The normals in
the file are not used: they are wrong too often. Source: 3D Systems, StereoLithography Interface Specification, 1989.
"""

from __future__ import annotations

from itertools import chain

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance

HEADER_BYTES = 84
TRIANGLE_BYTES = 50

KEYWORDS = ("facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet")
"""The first words of the seven lines of a triangle."""


def read_stl(file: ModelFile) -> list[Instance]:
    """Return the one mesh of an STL file."""
    content = file.content
    count = int.from_bytes(content[80:84], "little") if len(content) >= HEADER_BYTES else -1
    if count >= 0 and len(content) == HEADER_BYTES + TRIANGLE_BYTES * count:
        corners = _binary_corners(content, file, count)
    elif content.lstrip()[:5].lower() == b"solid" and b"\0" not in content[HEADER_BYTES:4096]:
        corners = _text_corners(content, file)
    elif count >= 0:
        needed = HEADER_BYTES + TRIANGLE_BYTES * count
        raise file.error(f"expected {needed} bytes for {count} triangles, the file has {len(content)}", "byte 80")
    else:
        raise file.error(f"expected an STL file, at least {HEADER_BYTES} bytes or the word solid, got {len(content)} bytes")
    if not len(corners):
        raise file.error("the file has no triangles")

    # Number the corners one after the other.
    triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    return [Instance(Mesh(corners, triangles, nonfinite=file.nonfinite), name=file.stem)]


def _binary_corners(content: bytes, file: ModelFile, count: int) -> NDArray[np.float64]:
    """Return the corners of all triangles of a binary file, (3 T, 3)."""
    file.check_triangles(count)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
    records = np.frombuffer(content, dtype=record, count=count, offset=HEADER_BYTES)
    return records["corners"].reshape(-1, 3).astype(np.float64)


def _text_corners(content: bytes, file: ModelFile) -> NDArray[np.float64]:
    """Return the corners of all triangles of a text file, (3 T, 3); every line is checked."""
    numbered = [(n, words) for n, line in enumerate(content.splitlines(), 1) if (words := line.lower().split())]
    body = [(n, words) for n, words in numbered if words[0] not in (b"solid", b"endsolid")]
    if numbered[-1][1][0] != b"endsolid":
        raise file.error("the file ends without endsolid: it is cut short", f"line {numbered[-1][0]}")
    file.check_triangles(len(body) // 7)

    # Compare each seventh line with the word that belongs there.
    for place, keyword in enumerate(KEYWORDS):
        word = keyword.encode()
        for n, words in body[place::7]:
            if words[0] != word:
                raise file.error(f"expected {keyword}, got {words[0][:20].decode('latin-1')!r}", f"line {n}")
    if len(body) % 7:
        raise file.error(f"expected {KEYWORDS[len(body) % 7]}, the solid ends here", f"line {numbered[-1][0]}")

    # Read three numbers from each vertex line.
    vertices = [line for place in range(0, len(body), 7) for line in body[place + 2 : place + 5]]
    for n, words in vertices:
        if len(words) != 4:
            raise file.error(f"expected vertex and three numbers, got {len(words) - 1}", f"line {n}")
    try:
        values = list(map(float, chain.from_iterable(words[1:] for _, words in vertices)))
    except ValueError:
        for n, words in vertices:
            _check_numbers(words[1:], file, n)
        raise
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def _check_numbers(words: list[bytes], file: ModelFile, line: int) -> None:
    """Raise for the first word that is no number."""
    for word in words:
        try:
            float(word)
        except ValueError:
            raise file.error(f"expected a number, got {word[:20].decode('latin-1')!r}", f"line {line}") from None
