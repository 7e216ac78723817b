"""The words of a binary file: 32-bit numbers, most significant byte first, and strings filled up to four bytes.

Counts are held against what is left of the file before anything is allocated, so a damaged count cannot ask for memory.
What stands in which order was found in the format's own files: a name, from version 2.1 on a word of flags, the number of
fields, the fields, each followed by flags, and for a group the number of children.

Source: the files that Inventor 2.0 and 2.1 wrote.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.inventor.tokens import ReadError
from scanspan.homogeneous import FloatArray

MAX_NAME = 4096  # bytes of a name of a node or a field


class BinaryScanner:
    """A place in a binary file, and what can be read there.

    Parameters
    ----------
    content : the whole file.
    place : where to begin.
    has_wide_pixels : whether a pixel takes four bytes, as it does up to version 2.0, whatever its channels.
    """

    def __init__(self, content: bytes, place: int = 0, has_wide_pixels: bool = False) -> None:
        self.content = content
        self.place = place
        self.has_wide_pixels = has_wide_pixels

    @property
    def left(self) -> int:
        """How many bytes are left."""
        return len(self.content) - self.place

    def take(self, count: int, expected: str) -> bytes:
        """Return so many bytes, and go on to the next multiple of four."""
        if count > self.left or count < 0:
            raise ReadError(f"expected {expected}, {count} bytes, {self.left} are left", self.place)
        taken = self.content[self.place : self.place + count]
        self.place = min(self.place + count + -count % 4, len(self.content))
        return taken

    def integer(self, expected: str = "a whole number") -> int:
        """Return one whole number with a sign."""
        return int(struct.unpack(">i", self.take(4, expected))[0])

    def number(self) -> float:
        """Return one number."""
        return float(struct.unpack(">f", self.take(4, "a number"))[0])

    def double(self) -> float:
        """Return one number of eight bytes."""
        return float(struct.unpack(">d", self.take(8, "a number of eight bytes"))[0])

    def count(self, size: int, expected: str) -> int:
        """Return how many things of at least `size` bytes follow, if so many fit in the file."""
        place = self.place
        count = self.integer(expected)
        if not 0 <= count <= self.left // size:
            raise ReadError(f"expected {expected} that fits the file, got {count}", place)
        return count

    def array(self, count: int, code: str = ">f4") -> NDArray[Any]:
        """Return so many numbers of one type."""
        kind = np.dtype(code)
        return np.frombuffer(self.take(count * kind.itemsize, f"{count} numbers"), kind)

    def numbers(self, count: int) -> FloatArray:
        """Return so many numbers as float64."""
        return self.array(count).astype(np.float64)

    def text_value(self) -> str:
        """Return a string."""
        return self.take(self.count(1, "the length of a string"), "a string").decode("latin-1")

    def word(self, expected: str) -> str:
        """Return a name."""
        place = self.place
        length = self.count(1, f"the length of {expected}")
        if length > MAX_NAME:
            raise ReadError(f"expected {expected}, got a string of {length} bytes", place)
        name = self.take(length, expected).decode("latin-1")
        if not name.isprintable():
            raise ReadError(f"expected {expected}, got {name[:24]!r}", place)
        return name
