"""The header of a PLY file: which elements follow, how many of each, and what each is made of.

Source: G. Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scanspan.assets.formats.files import ModelFile

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
"""PLY's names of number types to NumPy's."""

BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

MAX_HEADER = 2**20
"""Bytes of a header: the longest real ones hold some thousand comments."""


@dataclass(frozen=True)
class Property:
    """One property of an element; `count_type` is set for a list. Types are NumPy's, without a byte order."""

    name: str
    type: str
    count_type: str = ""


@dataclass
class Element:
    """A kind of thing that the file lists, such as vertex or face."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def least_bytes(self) -> int:
        """Bytes that one takes at least in a binary file: its numbers, and the counts of its lists."""
        return sum(np.dtype(p.count_type or p.type).itemsize for p in self.properties)

    @property
    def lists(self) -> list[Property]:
        """The properties that are lists."""
        return [p for p in self.properties if p.count_type]


@dataclass(frozen=True)
class Header:
    """What stands before the numbers; `start` is where they begin, `order` the byte order, empty for text."""

    order: str
    elements: list[Element]
    comments: list[str]
    start: int


def read_header(file: ModelFile) -> Header:
    """Return the header, or raise when a line of it cannot be understood."""
    content = file.content
    if not content.startswith(b"ply") or content[3:4] not in (b"\n", b"\r", b" "):
        raise file.error(f"expected ply at the start, got {content[:8]!r}")
    end = content.find(b"end_header", 0, MAX_HEADER)
    if end < 0:
        raise file.error("the header has no end_header")
    stop = content.find(b"\n", end)
    carriage = content.find(b"\r", end)
    if carriage >= 0 and (stop < 0 or carriage < stop - 1):
        stop = carriage
    if stop < 0:
        raise file.error("the file ends with its header")

    # Read the lines one by one; an unknown first word is an error, as everything after it would be misread.
    order: str | None = None
    elements: list[Element] = []
    comments: list[str] = []
    for number, line in enumerate(content[:end].decode("latin-1").splitlines()[1:], 2):
        words = line.split()
        if not words:
            continue
        if words[0] in ("comment", "obj_info"):
            comments.append(line.strip())
        elif words[0] == "format" and len(words) == 3 and words[1] in BYTE_ORDERS and words[2] == "1.0":
            order = BYTE_ORDERS[words[1]]
        elif words[0] == "element":
            elements.append(_element(words, elements, file, number))
        elif words[0] == "property" and elements:
            _add_property(elements[-1], words, file, number)
        else:
            raise file.error(f"expected a line of a PLY header, got {line.strip()[:60]!r}", f"line {number}")
    if order is None:
        raise file.error("the header has no format line")
    return Header(order, elements, comments, stop + 1)


def _element(words: list[str], elements: list[Element], file: ModelFile, number: int) -> Element:
    """Return the element that a line declares."""
    count = int(words[2]) if len(words) == 3 and words[2].isascii() and words[2].isdigit() and len(words[2]) < 20 else -1
    if count < 0:
        raise file.error(f"expected element, a name and a count, got {' '.join(words)[:60]!r}", f"line {number}")
    if any(element.name == words[1] for element in elements):
        raise file.error(f"element {words[1][:20]!r} is declared twice", f"line {number}")
    return Element(words[1], count)


def _add_property(element: Element, words: list[str], file: ModelFile, number: int) -> None:
    """Add the property that a line declares."""
    is_list = len(words) == 5 and words[1] == "list"
    types = words[2:4] if is_list else words[1:2]
    if not (is_list or len(words) == 3) or not all(t in TYPES for t in types):
        raise file.error(f"expected property, a type and a name, got {' '.join(words)[:60]!r}", f"line {number}")
    if any(p.name == words[-1] for p in element.properties):
        raise file.error(f"property {words[-1][:20]!r} is declared twice", f"line {number}")
    if not is_list:
        element.properties.append(Property(words[2], TYPES[words[1]]))
        return
    if TYPES[words[2]].startswith("f"):
        raise file.error(f"the count of a list cannot be of type {words[2]}", f"line {number}")
    element.properties.append(Property(words[4], TYPES[words[3]], TYPES[words[2]]))
