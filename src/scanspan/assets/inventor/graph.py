"""The scene graph: nodes with their fields and children, and what is the same for text and binary files.

A node that is defined once may stand in many places; its children are then the same objects. What a file says wrongly becomes a
note and the rest is kept, so reading ends with a graph, however short, unless the file is none of ours.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.inventor.nodes import NodeType
from scanspan.errors import LimitError

MAX_DEPTH = 120
"""How deep nodes may be nested; scenes reach some 30, and Python's stack ends at a thousand calls."""

MAX_NOTES = 50
"""Notes of one file; a damaged one would give thousands."""

HEADER = re.compile(rb"#(?:Inventor V([0-9]+\.[0-9]+) (ascii|binary)|VRML V([0-9]+\.[0-9]+) (ascii|utf8))[^\n]*\n?")
GZIP = b"\x1f\x8b"
NEWLINE = 10


@dataclass(eq=False)
class Node:
    """One node.

    Attributes
    ----------
    kind : the name of its type, as in the table.
    type : its line in the table.
    source, place : the file, and the place in it.
    name : what it is called by DEF, or "".
    fields : values of the fields that the file sets.
    ignored : names of the fields that the file marks to be ignored.
    children : in order.
    """

    kind: str
    type: NodeType
    source: Source | None = None
    place: int = 0
    name: str = ""
    fields: dict[str, Any] = field(default_factory=dict)
    ignored: set[str] = field(default_factory=set)
    children: list[Node] = field(default_factory=list)

    def get(self, name: str) -> Any:
        """Return the value of a field, or what holds where the file says nothing."""
        return self.fields[name] if name in self.fields else self.type.fields[name].default

    def has(self, name: str) -> bool:
        """Say whether a field is to be used: it is not marked to be ignored."""
        return name not in self.ignored

    def place_text(self) -> str:
        """Return the node's place as "line 12" or "byte 80"."""
        return "" if self.source is None else self.source.where(self.place)

    def note(self, text: str) -> None:
        """Keep a remark about this node."""
        if self.source is not None:
            self.source.note(text, self.source.where(self.place) if self.source.has_room else "")

    def walk(self) -> Iterator[Node]:
        """Return the node and all below it, each once."""
        seen = {id(self)}
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            inner = [value for value in node.fields.values() if isinstance(value, Node)]
            for child in reversed([*inner, *node.children]):
                if id(child) not in seen:
                    seen.add(id(child))
                    waiting.append(child)


@dataclass
class Source:
    """A file that is being read, and what has been found in it.

    Attributes
    ----------
    file : the model; of a file that it names, with that one's content.
    content : what is parsed, unpacked.
    name : the file's name before each note, "" for the model itself.
    version : of the header, such as 2.1.
    is_binary : whether it is a binary file.
    start : where the header ends.
    defined : nodes by the names that DEF gave.
    """

    file: ModelFile
    content: bytes
    name: str = ""
    version: float = 2.1
    is_binary: bool = False
    start: int = 0
    defined: dict[str, Node] = field(default_factory=dict)

    def where(self, place: int) -> str:
        """Return a place as "line 12" or "byte 80"."""
        if self.is_binary:
            return f"byte {place}"
        return f"line {int(np.searchsorted(self.line_ends, place)) + 1}"

    @cached_property
    def line_ends(self) -> NDArray[np.int64]:
        """Where the lines of a text end."""
        return np.flatnonzero(np.frombuffer(self.content, np.uint8) == NEWLINE)

    @property
    def has_room(self) -> bool:
        """Whether another note would be kept."""
        return len(self.file.notes) < MAX_NOTES

    def note(self, text: str, where: str = "") -> None:
        """Keep a remark with its place."""
        if self.has_room:
            self.file.note(": ".join(part for part in (self.name, where, text) if part))
        elif len(self.file.notes) == MAX_NOTES:
            self.file.note("more faults were found than are listed")


def open_source(file: ModelFile, content: bytes, name: str = "") -> Source:
    """Return a source with its header read.

    Raises
    ------
    FormatError : it is no Inventor file, or a damaged gzip file.
    LimitError : it unpacks to more than the limit.
    """
    if content.startswith(GZIP):
        content = _unpack(content, file, name)
    header = HEADER.match(content[:256])
    if not header:
        shown = content[:24].split(b"\n")[0].decode("latin-1")
        raise file.error(f"expected a first line such as '#Inventor V2.1 ascii', got {shown!r}", name)
    if header[3] is not None and header[3] != b"1.0":
        raise file.error(f"VRML {header[3].decode()} is another language; Inventor 1.0 to 2.1 and VRML 1.0 are read", name)
    version = float(header[1] or b"2.0")
    if not 1.0 <= version < 3.0:
        raise file.error(f"expected Inventor 1.0 to 2.1, got version {version}", name)
    return Source(file, content, name, version, header[2] == b"binary", header.end())


def _unpack(content: bytes, file: ModelFile, name: str) -> bytes:
    """Return what a gzip file holds."""
    most = file.limits.bytes
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as stream:
            unpacked = stream.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise file.error(f"the file is packed with gzip and damaged: {error}", name) from None
    if len(unpacked) > most:
        raise LimitError(f"{file.path}: unpacks to more than the limit of {most} bytes (max_bytes)")
    return unpacked
