"""Text files to nodes.

Every fault is noted with its line and what was expected; reading goes on with the next field or node of the same block. A type
that is not known is read as far as braces go, so that what it defines can still be used, and left out of the scene.

Source: Wernecke, The Inventor Mentor, chapter 11, "File Format".
"""

from __future__ import annotations

from typing import Any

from scanspan.assets.inventor.graph import MAX_DEPTH, Node, Source
from scanspan.assets.inventor.nodes import FieldType, NodeType, field_type, node_type
from scanspan.assets.inventor.tokens import ReadError, Scanner
from scanspan.assets.inventor.values import text_value

DESCRIBED = ("fields", "inputs", "outputs", "isA")


def parse_text(source: Source) -> list[Node]:
    """Return the nodes that stand at the top of a text file."""
    return TextParser(source).read_all()


class TextParser:
    """Reads the nodes of one text file."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.scanner = Scanner(source.content.decode("latin-1"), source.start)
        self.unknown: set[str] = set()

    def note(self, text: str, place: int) -> None:
        """Keep a remark about a place."""
        self.source.note(text, self.source.where(place) if self.source.has_room else "")

    def read_all(self) -> list[Node]:
        """Return all nodes, up to the end of the file."""
        nodes: list[Node] = []
        while self.scanner.peek():
            place = self.scanner.place
            try:
                node = self.read_node(0)
                if node is not None:
                    nodes.append(node)
            except ReadError as error:
                self.note(str(error), error.place)
                self.scanner.place = max(self.scanner.place, place)
                self.scanner.skip_value()
        return nodes

    def read_node(self, depth: int, is_engine: bool = False) -> Node | None:
        """Return the node that stands next, None for NULL or one that cannot be had."""
        scanner = self.scanner
        place = scanner.skip_space()
        word = scanner.word("a node")
        if word == "NULL":
            return None
        if word == "USE":
            return self.find_node(scanner.word("the name of a node"), place)
        name = ""
        if word == "DEF":
            name = scanner.word("the name of a node")
            word = scanner.word("a node")
        if not scanner.take("{"):
            raise scanner.fail(f"'{{' after {word[:40]}")
        if depth > MAX_DEPTH:
            self.note(f"nodes are nested deeper than {MAX_DEPTH}; the inner ones are left out", place)
            scanner.skip_block()
            return None
        known = node_type(word)
        if known is None and word not in self.unknown:
            self.unknown.add(word)
            self.note(f"{'engine' if is_engine else 'node'} {word[:60]!r} is not known and left out", place)
        node = Node(word if known is None else known.name, known or NodeType("", {}, True), self.source, place)
        if name:
            node.name = name.partition("+")[0]
            self.source.defined[name] = node
        self.read_body(node, depth)
        return node

    def find_node(self, name: str, place: int) -> Node | None:
        """Return the node that was defined by a name."""
        defined = self.source.defined
        if name not in defined and name.rpartition(".")[0] in defined:
            # The name of an output follows: put it back.
            name, _, output = name.rpartition(".")
            self.scanner.place -= len(output) + 1
        if name not in defined:
            self.note(f"USE {name[:60]}: no node of this name was defined before", place)
        return defined.get(name)

    def read_body(self, node: Node, depth: int) -> None:
        """Read the fields and children of a node up to its closing brace."""
        scanner = self.scanner
        fields = dict(node.type.fields) if not node.type.name else node.type.fields
        while True:
            if scanner.take("}"):
                return
            if not scanner.peek():
                self.note(f"expected '}}' at the end of {node.kind}, got the end of the file", scanner.place)
                return
            place = scanner.place
            word = scanner.peek_word()
            try:
                if word in fields:
                    scanner.place += len(word)
                    self.read_field(node, word, fields[word], depth)
                elif not node.type.name and word in DESCRIBED:
                    scanner.place += len(word)
                    self.read_description(node, word, fields)
                elif word in ("DEF", "USE") or self.is_block(word):
                    child = self.read_node(depth + 1)
                    if child is not None:
                        self.adopt(node, child, place)
                else:
                    if node.type.name:
                        self.note(f"expected a field of {node.kind}, got {word[:40] or scanner.peek()!r}", place)
                    scanner.place = max(scanner.place + len(word), place + (not word))
                    self.find_next(fields)
            except ReadError as error:
                self.note(str(error), error.place)
                scanner.place = max(scanner.place, place + max(len(word), 1))
                self.find_next(fields)

    def adopt(self, node: Node, child: Node, place: int) -> None:
        """Put a child below its parent, if that may have children."""
        if node.type.is_group:
            node.children.append(child)
        else:
            self.note(f"{node.kind} cannot have children; {child.kind} is left out", place)

    def is_block(self, word: str) -> bool:
        """Say whether a word that stands next is followed by an opening brace."""
        if not word:
            return False
        scanner = self.scanner
        place = scanner.place
        scanner.place += len(word)
        opens = scanner.peek() == "{"
        scanner.place = place
        return opens

    def find_next(self, fields: dict[str, FieldType]) -> None:
        """Go over what cannot be read, up to the next field or child or the end of the node."""
        scanner = self.scanner
        while scanner.peek() not in ("", "}"):
            word = scanner.peek_word()
            if word in fields or word in ("DEF", "USE") or self.is_block(word):
                return
            scanner.skip_value()

    def read_field(self, node: Node, name: str, field: FieldType, depth: int) -> None:
        """Read the value of a field, and what may follow it: a mark to ignore it, and what it is connected to."""
        scanner = self.scanner
        if scanner.peek() not in ("~", "="):
            node.fields[name] = self.read_nodes(field, depth) if field.kind == "Node" else text_value(scanner, field)
        if scanner.take("~"):
            node.ignored.add(name)
        if scanner.take("="):
            place = scanner.place
            if scanner.peek_word() == "NULL":
                raise scanner.fail(f"a node or an engine that {name} of {node.kind} is connected to")
            self.read_node(depth + 1, is_engine=True)
            output = scanner.word("the name of an output")
            if output == ".":
                scanner.word("the name of an output")
            self.note(f"engines and connections do not run; {name} of {node.kind} keeps its value", place)

    def read_nodes(self, field: FieldType, depth: int) -> Any:
        """Return a node, or the nodes in brackets."""
        if not field.is_many:
            return self.read_node(depth + 1)
        if not self.scanner.take("["):
            return [self.read_node(depth + 1)]
        nodes = []
        while not self.scanner.take("]"):
            nodes.append(self.read_node(depth + 1))
        return nodes

    def read_description(self, node: Node, word: str, fields: dict[str, FieldType]) -> None:
        """Read what a type that is not known says of itself: its fields, or the types that it is like."""
        scanner = self.scanner
        if word == "isA":
            for name in text_value(scanner, FieldType("String", True)):
                known = node_type(name)
                if known is not None and not node.type.name:
                    node.type, node.kind = known, known.name
                    fields.update(known.fields)
            return
        scanner.expect("[")
        while not scanner.take("]"):
            place = scanner.place
            kind = scanner.word("the type of a field")
            name = scanner.word("the name of a field")
            described = field_type(kind)
            if described is not None and word == "fields":
                fields[name] = described
            elif described is None and word != "outputs":
                self.note(f"expected the type of a field, got {kind[:40]!r}", place)
