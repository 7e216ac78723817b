"""The numbers of a PLY file, in text or in binary of either byte order.

Every element becomes one array per property; a list becomes its counts and its values, one list after the other. Where all
lists of an element have the length of the first, which is the rule, the whole element is read at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.ply_header import Element, Header


@dataclass
class Table:
    """The numbers of one element: columns by name, and lists by name as (counts, values)."""

    count: int = 0
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    lists: dict[str, tuple[NDArray[np.int64], NDArray[Any]]] = field(default_factory=dict)


def read_body(header: Header, file: ModelFile) -> dict[str, Table]:
    """Return the numbers of every element, by name."""
    tables: dict[str, Table] = {}
    words = file.content[header.start :].split() if not header.order else []
    place = 0 if not header.order else header.start
    for element in header.elements:
        if not element.properties:
            continue
        if header.order:
            table, place = _binary(element, header.order, place, file)
        else:
            table, place = _text(element, words, place, file)
        tables[element.name] = table
    rest = len(words) - place if not header.order else 0
    if rest:
        raise file.error(f"expected the end, there are {rest} more numbers than the header says")
    return tables


def _short(element: Element, got: int, unit: str, file: ModelFile) -> Exception:
    """Return the error that an element is cut short."""
    return file.error(f"expected {element.count} of element {element.name}, the {got} {unit} left are too few")


def _binary(element: Element, order: str, place: int, file: ModelFile) -> tuple[Table, int]:
    """Return one element and the byte after it."""
    content = file.content
    left = len(content) - place
    if element.least_bytes * element.count > left:
        raise _short(element, left, "bytes", file)
    if not element.count:
        return _empty(element), place

    # Guess that all lists are as long as those of the first; check, and go one by one where they are not.
    lengths, _ = _first_lengths(element, order, place, file)
    columns: list[tuple[Any, ...]] = []
    for k, p in enumerate(element.properties):
        if p.count_type:
            columns.append((f"n{k}", order + p.count_type))
            columns.append((f"v{k}", order + p.type, (lengths[k],)))
        else:
            columns.append((f"v{k}", order + p.type))
    record = np.dtype(columns)
    if record.itemsize * element.count <= left:
        rows = np.frombuffer(content, dtype=record, count=element.count, offset=place)
        if all((rows[f"n{k}"] == lengths[k]).all() for k, p in enumerate(element.properties) if p.count_type):
            return _from_rows(element, rows, lengths), place + record.itemsize * element.count
    return _one_by_one(element, order, place, file)


def _empty(element: Element) -> Table:
    """Return an element of which there is none."""
    table = Table()
    for p in element.properties:
        if p.count_type:
            table.lists[p.name] = (np.zeros(0, np.int64), np.zeros(0, p.type))
        else:
            table.columns[p.name] = np.zeros(0, p.type)
    return table


def _first_lengths(element: Element, order: str, place: int, file: ModelFile) -> tuple[dict[int, int], int]:
    """Return the length of each list of the element at `place`, by property, and the byte after it."""
    content, lengths = file.content, {}
    for k, p in enumerate(element.properties):
        kind = np.dtype(order + (p.count_type or p.type))
        if place + kind.itemsize > len(content):
            raise _short(element, len(content) - place, "bytes", file)
        if p.count_type:
            lengths[k] = int(np.frombuffer(content, dtype=kind, count=1, offset=place)[0])
            size = lengths[k] * np.dtype(p.type).itemsize
            if lengths[k] < 0 or place + kind.itemsize + size > len(content):
                raise file.error(f"element {element.name}: a list of {lengths[k]} is longer than the file", f"byte {place}")
            place += size
        place += kind.itemsize
    return lengths, place


def _from_rows(element: Element, rows: NDArray[Any], lengths: dict[int, int]) -> Table:
    """Return an element whose lists all have the same length."""
    table = Table(element.count)
    for k, p in enumerate(element.properties):
        values = rows[f"v{k}"].astype(p.type)
        if p.count_type:
            table.lists[p.name] = (np.full(element.count, lengths[k], np.int64), values.reshape(-1))
        else:
            table.columns[p.name] = values
    return table


def _one_by_one(element: Element, order: str, place: int, file: ModelFile) -> tuple[Table, int]:
    """Return an element whose lists differ in length, and the byte after it."""
    content = file.content
    counts: dict[int, list[int]] = {k: [] for k in range(len(element.properties))}
    pieces: dict[int, list[bytes]] = {k: [] for k in range(len(element.properties))}
    sizes = [(np.dtype(p.type).itemsize, np.dtype(p.count_type).itemsize if p.count_type else 0) for p in element.properties]
    endian = "big" if order == ">" else "little"
    for _ in range(element.count):
        for k, p in enumerate(element.properties):
            size, count_size = sizes[k]
            if count_size:
                signed = p.count_type.startswith("i")
                count = int.from_bytes(content[place : place + count_size], endian, signed=signed)  # type: ignore[arg-type]
                place += count_size
                if count < 0 or place + count * size > len(content):
                    raise file.error(f"element {element.name}: a list of {count} is longer than the file", f"byte {place}")
                counts[k].append(count)
                size *= count
            pieces[k].append(content[place : place + size])
            place += size
        if place > len(content):
            raise _short(element, 0, "bytes", file)

    # Join what belongs to one property.
    table = Table(element.count)
    for k, p in enumerate(element.properties):
        values = np.frombuffer(b"".join(pieces[k]), dtype=order + p.type).astype(p.type)
        if p.count_type:
            table.lists[p.name] = (np.array(counts[k], dtype=np.int64), values)
        else:
            table.columns[p.name] = values
    return table, place


def _text(element: Element, words: list[bytes], place: int, file: ModelFile) -> tuple[Table, int]:
    """Return one element of a text file and the word after it."""
    if len(element.properties) * element.count > len(words) - place:
        raise _short(element, len(words) - place, "numbers", file)
    if not element.count:
        return _empty(element), place
    table = Table(element.count)
    if not element.lists:
        width = len(element.properties)
        chosen = words[place : place + width * element.count]
        for k, p in enumerate(element.properties):
            table.columns[p.name] = _numbers(chosen[k::width], p.type, element, p.name, file)
        return table, place + width * element.count

    # Walk through the words: where the next property begins depends on the lists before it.
    taken: list[list[list[bytes]]] = [[] for _ in element.properties]
    for row in range(element.count):
        for k, p in enumerate(element.properties):
            count = 1
            if p.count_type:
                count = _list_length(words, place, element, row, file)
                place += 1
            taken[k].append(words[place : place + count])
            place += count
        if place > len(words):
            raise _short(element, 0, "numbers", file)
    for k, p in enumerate(element.properties):
        values = _numbers(list(chain.from_iterable(taken[k])), p.type, element, p.name, file)
        if p.count_type:
            table.lists[p.name] = (np.array([len(w) for w in taken[k]], dtype=np.int64), values)
        else:
            table.columns[p.name] = values
    return table, place


def _list_length(words: list[bytes], place: int, element: Element, row: int, file: ModelFile) -> int:
    """Return the length of the list that begins at a word."""
    word = words[place] if place < len(words) else b""
    if not word.isdigit() or len(word) > 10 or place + int(word) >= len(words):
        shown = word[:20].decode("latin-1")
        raise file.error(f"{element.name} {row}: a list of {shown!r} values is longer than the file or no number")
    return int(word)


def _numbers(words: list[bytes], kind: str, element: Element, name: str, file: ModelFile) -> NDArray[Any]:
    """Return words as numbers of a type; whole numbers must be whole and fit."""
    is_float = kind.startswith("f")
    try:
        values = np.array(list(map(float if is_float else int, words)), dtype="f8" if is_float else "i8")
    except (ValueError, OverflowError):
        return _salvage(words, kind, element, name, file)
    if is_float:
        with np.errstate(over="ignore"):
            return values.astype(kind)
    limits = np.iinfo(kind)
    bad = np.flatnonzero((values < limits.min) | (values > limits.max))
    if len(bad):
        raise file.error(f"{element.name}: property {name} has {values[bad[0]]}, which does not fit its type")
    return values.astype(kind)


def _salvage(words: list[bytes], kind: str, element: Element, name: str, file: ModelFile) -> NDArray[Any]:
    """Accept whole numbers written like 3.0; raise for the first word that is no number of the type."""
    for row, word in enumerate(words):
        try:
            value = float(word)
            good = kind.startswith("f") or value == int(value)
        except (ValueError, OverflowError):
            good = False
        if not good:
            shown = word[:20].decode("latin-1")
            raise file.error(f"{element.name}: property {name}: expected a number of type {kind}, got {shown!r}, value {row}")
    return _numbers([str(int(float(word))).encode() for word in words], kind, element, name, file)
