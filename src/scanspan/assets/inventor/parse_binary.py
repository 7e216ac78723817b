"""Binary files to nodes.

Nothing in a binary file says where a node ends, so a fault ends the reading; what came before it is kept. A type that is not
known can be read where it describes its fields, and is left out of the scene.

Up to version 2.0 there are no flags, and a type without fields does not even have their number.

Source: the files that Inventor 2.0 and 2.1 wrote.
"""

from __future__ import annotations

from typing import Any

from scanspan.assets.inventor.binary import BinaryScanner
from scanspan.assets.inventor.graph import MAX_DEPTH, Node, Source
from scanspan.assets.inventor.nodes import FieldType, NodeType, field_type, node_type
from scanspan.assets.inventor.tokens import ReadError
from scanspan.assets.inventor.values import binary_value

IS_GROUP = 2  # flag of a node, from version 2.1 on
IS_IGNORED, IS_CONNECTED = 1, 2  # flags of a field
SMALLEST_NODE = 8  # bytes: a length, and four letters


def parse_binary(source: Source) -> list[Node]:
    """Return the nodes that stand at the top of a binary file."""
    parser = BinaryParser(source)
    nodes: list[Node] = []
    try:
        while parser.scanner.left >= SMALLEST_NODE:
            parser.read_node(nodes, 0)
        if any(parser.scanner.content[parser.scanner.place :]):
            raise ReadError(f"expected a node or the end of the file, got {parser.scanner.left} bytes", parser.scanner.place)
    except ReadError as error:
        source.note(f"{error}; the rest of the file is left out", source.where(error.place))
    return nodes


class BinaryParser:
    """Reads the nodes of one binary file."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.scanner = BinaryScanner(source.content, source.start, source.version <= 2.0)
        self.has_flags = source.version > 2.0
        self.unknown: set[str] = set()

    def read_node(self, siblings: list[Node], depth: int) -> None:
        """Read the node that stands next and put it among its siblings, before what is in it is read."""
        scanner = self.scanner
        place = scanner.place
        word = scanner.word("the name of a node")
        if word in ("", "NULL"):
            return
        if word == "USE":
            name = scanner.word("the name of a node")
            if name in self.source.defined:
                siblings.append(self.source.defined[name])
            else:
                self.source.note(f"USE {name[:60]}: no node of this name was defined before", self.source.where(place))
            return
        name = ""
        if word == "DEF":
            name = scanner.word("the name of a node")
            word = scanner.word("the type of a node")
        if depth > MAX_DEPTH:
            raise ReadError(f"expected nodes nested no deeper than {MAX_DEPTH}", place)

        # Make the node, known before it is read so that it is kept where the file breaks off.
        known = node_type(word)
        flags = scanner.integer("flags") if self.has_flags else 0
        if known is None and word not in self.unknown:
            self.unknown.add(word)
            self.source.note(f"node {word[:60]!r} is not known and left out", self.source.where(place))
        type = known or NodeType("", {}, bool(flags & IS_GROUP))
        node = Node(word if known is None else known.name, type, self.source, place)
        if name:
            node.name = name.partition("+")[0]
            self.source.defined[name] = node
        siblings.append(node)
        if self.has_flags or node.type.fields or known is None:
            self.read_fields(node, depth)
        is_group = bool(flags & IS_GROUP) if self.has_flags else node.type.is_group
        if is_group:
            for _ in range(scanner.count(SMALLEST_NODE, "a number of children")):
                self.read_node(node.children, depth + 1)

    def read_fields(self, node: Node, depth: int) -> None:
        """Read the fields of a node."""
        scanner = self.scanner
        place = scanner.place
        number = scanner.integer("a number of fields")
        count, is_described = number & 0xFF, number > 0xFF
        if not 0 <= number <= 0xFFFF:
            raise ReadError(f"expected a number of fields, got {number}", place)
        fields = dict(node.type.fields)
        for _ in range(count if is_described else 0):
            kind = scanner.word("the type of a field")
            described = field_type(kind)
            if described is None:
                raise ReadError(f"expected the type of a field, got {kind[:40]!r}", scanner.place)
            fields.setdefault(scanner.word("the name of a field"), described)
        for _ in range(count):
            place = scanner.place
            name = scanner.word("the name of a field")
            if name not in fields:
                raise ReadError(f"expected a field of {node.kind}, got {name[:40]!r}", place)
            self.read_field(node, name, fields[name], depth)

    def read_field(self, node: Node, name: str, field: FieldType, depth: int) -> None:
        """Read the value of a field and its flags."""
        node.fields[name] = self.read_nodes(field, depth) if field.kind == "Node" else binary_value(self.scanner, field)
        flags = self.scanner.integer("the flags of a field")
        if flags & IS_IGNORED:
            node.ignored.add(name)
        if flags & IS_CONNECTED:
            place = self.scanner.place
            self.read_node([], depth + 1)
            self.scanner.word("the name of an output")
            where = self.source.where(place)
            self.source.note(f"engines and connections do not run; {name} of {node.kind} keeps its value", where)

    def read_nodes(self, field: FieldType, depth: int) -> Any:
        """Return a node, or many of them."""
        nodes: list[Node] = []
        for _ in range(self.scanner.count(SMALLEST_NODE, "a number of nodes") if field.is_many else 1):
            self.read_node(nodes, depth + 1)
        return nodes if field.is_many else nodes[0] if nodes else None
