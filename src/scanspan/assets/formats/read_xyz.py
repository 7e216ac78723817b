"""XYZ, TXT, CSV and PTS: points as lines of numbers.

Blanks, tabs, commas and semicolons part numbers; # and // begin a remark; empty lines are skipped. A first line of names, or a
remark that has x, y and z among its words, says what the columns are; else their number does (point_columns.py). A first line
with one whole number is the count of a PTS file.

The file is read in blocks of whole lines, so a chunk takes no more memory than its points.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from typing import BinaryIO, NamedTuple

import numpy as np

from scanspan.assets.chunks import CHUNK, CloudChunks, join
from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.point_columns import Plan, by_meaning, cloud_from, make_plan, name_by_number, name_columns
from scanspan.assets.formats.text_numbers import read_rows
from scanspan.assets.scene import Instance
from scanspan.errors import FormatError, InputError
from scanspan.records import Float64Array

BLOCK = 1 << 22
"""Bytes that are read at once."""

MAX_LINE = 1 << 20
"""Bytes of a line; one of numbers has some hundred."""


class Head(NamedTuple):
    """What stands before the numbers: names of columns, the first byte and line of numbers, and the count where it is said."""

    names: tuple[str, ...] | None
    start: int
    lines: int
    points: int | None


def read_xyz(file: ModelFile) -> list[Instance]:
    """Return the one cloud of a text file."""
    chunks = xyz_chunks(lambda: io.BytesIO(file.content), file.path, len(file.content), CHUNK, file.nonfinite)
    return [Instance(join(chunks, file.check_points), name=file.stem)]


def xyz_chunks(open_file: Callable[[], BinaryIO], path: str, size: int, chunk: int, nonfinite: str) -> CloudChunks:
    """Return the chunks of a text file, whose size does not matter."""
    with open_file() as stream:
        head = read_head(stream.read(BLOCK), path)

    def read() -> Iterator[PointCloud]:
        plan: Plan | None = None
        points = 0
        for text, line in blocks_of(open_file, head, path):
            rows = rows_of(text, line, plan, head, path)
            if head.points is not None and points + len(rows) > head.points:
                raise FormatError(path, f"the first line says {head.points} points, there are more")
            if len(rows):
                try:
                    names = plan.names if plan else head.names or name_by_number(rows)
                    columns = by_meaning(names, list(rows.T))
                    plan = plan or make_plan(names, columns)
                    for first in range(0, len(rows), chunk):
                        part = {name: values[first : first + chunk] for name, values in columns.items()}
                        yield cloud_from(plan, part, nonfinite)
                except InputError as error:
                    raise FormatError(path, str(error), f"points from {points}") from None
                points += len(rows)
        if head.points is not None and points != head.points:
            raise FormatError(path, f"the first line says {head.points} points, there are {points}")

    return CloudChunks(path, head.points, None, "", "+Z", [], read)


def read_head(text: bytes, path: str) -> Head:
    """Return what stands before the numbers."""
    if b"\0" in text[:4096]:
        raise FormatError(path, "expected lines of numbers, got bytes that are no text")
    start = 3 if text.startswith(b"\xef\xbb\xbf") else 0
    names: tuple[str, ...] | None = None
    for number, line in enumerate(text[start:].splitlines(keepends=True), 1):
        words = words_of(line.decode("latin-1").strip())
        if not words or words[0].startswith(("#", "//")):
            names = names or _names_in(words)
        elif all(map(is_number, words)):
            is_count = len(words) == 1 and words[0].isdigit() and names is None
            return Head(names, start + len(line) * is_count, number - 1 + is_count, int(words[0]) if is_count else None)
        else:
            try:
                return Head(name_columns(words), start + len(line), number, None)
            except InputError as error:
                raise FormatError(path, f"expected numbers or names of columns: {error}", f"line {number}") from None
        start += len(line)
    raise FormatError(path, "the file has no numbers")


def words_of(line: str) -> list[str]:
    """Return the words of a line without the remark at its end; where commas part them, names may have blanks."""
    plain = line if line.startswith(("#", "//")) else re.split(r"#|//", line)[0].strip()
    parts = re.split(
        r"[,;]" if re.search(r"[,;]", plain) and not re.match(r"[-+.\d]", plain) else r"[\s,;]+", plain.strip(",;")
    )
    return [part.strip(" \t\"'") for part in parts] if plain else []


def _names_in(words: list[str]) -> tuple[str, ...] | None:
    """Return the names of columns that a remark has, or None."""
    plain = [word for word in (word.lstrip("#/") for word in words) if word]
    try:
        return name_columns(plain) if plain else None
    except InputError:
        return None


def is_number(word: str) -> bool:
    """Say whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def blocks_of(open_file: Callable[[], BinaryIO], head: Head, path: str) -> Iterator[tuple[bytes, int]]:
    """Give whole lines of a file, some bytes at a time, and the number of lines before them."""
    line, left = head.lines, b""
    with open_file() as stream:
        stream.seek(head.start)
        while True:
            read = stream.read(BLOCK)
            text = left + (read if b"\n" in read or b"\r" not in read else read.replace(b"\r", b"\n"))
            end = text.rfind(b"\n") + 1 if read else len(text)
            left = text[end:]
            if len(left) > MAX_LINE:
                raise FormatError(path, f"a line has more than {MAX_LINE} bytes: these are no lines of numbers")
            if end:
                ready = text[:end] if text[end - 1 : end] == b"\n" else text[:end] + b"\n"
                yield ready, line
                line += ready.count(b"\n")
            if not read:
                return


def rows_of(text: bytes, line: int, plan: Plan | None, head: Head, path: str) -> Float64Array:
    """Return the numbers of whole lines, one row for each line that has any."""
    values, ends, odd = read_rows(text)
    for place, word in odd:
        raise FormatError(path, f"expected a number, got {word[:20].decode('latin-1')!r}", f"line {line + place + 1}")
    counts = np.diff(ends, prepend=0)
    used = counts[counts > 0]
    if not len(used):
        return np.empty((0, 3))
    names = plan.names if plan else head.names
    width = len(names) if names else int(used[0])
    if (used != width).any():
        place = int(np.argmax((counts > 0) & (counts != width)))
        raise FormatError(path, f"{counts[place]} numbers, expected {width}", f"line {line + place + 1}")
    rows: Float64Array = values.reshape(-1, width)
    return rows
