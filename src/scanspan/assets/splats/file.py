"""The file of a tree of splats, `.scansplat`: pages as they were made, then the tables, and a footer that says where these are.

The footer is written last, so a file whose build was cut off has none, and is refused. Everything has a CRC-32: the header,
each page, both tables and the footer; and pages, tables and footer follow each other without a gap, so no byte can change
unseen. The file is memory-mapped; pages are checked and decoded when asked for, and the latest are kept. docs/scansplat.md
has the bytes.
"""

from __future__ import annotations

import math
import mmap
import struct
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.splats.codec import Splats
from scanspan.assets.splats.nodes import STORED, Table, node_table
from scanspan.assets.splats.pages import (
    PAGE,
    checksum,
    join_planes,
    make_splats,
    pack_bytes,
    plane_count,
    unpack_bytes,
    zstandard,
)
from scanspan.assets.splats.tree import SplatTree
from scanspan.errors import FormatError
from scanspan.records import Float64Array, Int64Array

MAGIC = b"scanspan splats\n"
END_MAGIC = b"scanspan splats."
VERSION = 1
HAS_COLOR, HAS_NORMALS, ORIENTED = 1, 2, 4
HEADER = struct.Struct("<16sII3d3d3q")  # magic, version, flags, offset, scale, base of the lattice; a CRC follows
HEADER_SIZE = HEADER.size + 4
FOOTER = struct.Struct(
    "<QQQQQQII16s"
)  # places and sizes of the tables, nodes, points, CRCs of the tables, magic; a CRC is first
FOOTER_SIZE = FOOTER.size + 4
CACHE = 256 << 20  # bytes of decoded pages that are kept

PAGE_ROW = np.dtype([("offset", "<u8"), ("bytes", "<u4"), ("crc", "<u4"), ("splats", "<u4"), ("height", "<u4")])
"""A page: where it lies, how long it is, its checksum, how many splats it has, and the height of its blocks over the leaves."""


class Header(NamedTuple):
    """What holds for a whole tree; a place is offset + scale * (base + number on the lattice)."""

    flags: int
    offset: Float64Array  # (3,)
    scale: Float64Array  # (3,)
    base: Int64Array  # (3,)

    @property
    def origin(self) -> Float64Array:
        """(3,) the place of number 0."""
        return np.asarray(self.base * self.scale + self.offset)

    def pack(self) -> bytes:
        """Return the bytes of the header."""
        content = HEADER.pack(MAGIC, VERSION, self.flags, *self.offset.tolist(), *self.scale.tolist(), *self.base.tolist())
        return content + struct.pack("<I", checksum(content))


def pack_table(table: Table, compressor: Any) -> bytes:
    """Return a table as bytes, split into planes and compressed."""
    planes = np.ascontiguousarray(table).view(np.uint8).reshape(len(table), table.dtype.itemsize).T
    return pack_bytes(np.ascontiguousarray(planes), compressor)


def unpack_table(content: bytes | memoryview, dtype: np.dtype[Any], count: int) -> tuple[Table, str]:
    """Return a table from its bytes, and what is wrong with these, or nothing."""
    planes = np.empty((dtype.itemsize, count), np.uint8)
    problem = unpack_bytes(content, planes, zstandard().ZstdDecompressor())
    return np.ascontiguousarray(planes.T).view(dtype).reshape(count), problem


def pack_end(pages: Table, nodes: Table, point_count: int, place: int) -> bytes:
    """Return what follows the pages: both tables and the footer."""
    compressor = zstandard().ZstdCompressor(level=9)
    first, second = pack_table(pages, compressor), pack_table(nodes, compressor)
    footer = FOOTER.pack(
        place, len(first), len(second), len(pages), len(nodes), point_count, checksum(first), checksum(second), END_MAGIC
    )
    return first + second + struct.pack("<I", checksum(footer)) + footer


MAPPED_MOST = 32 << 20  # bytes of the file that stay mapped: what was read counts as memory of this program until it is let go


class FilePages:
    """The pages of a file, decoded when asked for; the latest are kept. Threads may share it."""

    def __init__(self, path: Path, content: mmap.mmap, table: Table, flags: int, cache: int) -> None:
        self.path = path
        self.table = table
        self.bytes_read = 0
        self._content = content
        self._flags = flags
        self._room = cache
        self._kept: OrderedDict[int, Splats] = OrderedDict()
        self._size = 0
        self._mapped = 0
        self._lock = threading.Lock()
        self._tools = threading.local()

    def page(self, number: int) -> Splats:
        """Return a page, decoded.

        Raises
        ------
        FormatError : its bytes are not those that were written.
        """
        with self._lock:
            if number in self._kept:
                self._kept.move_to_end(number)
                return self._kept[number]
        splats = self._decode(number)
        with self._lock:
            if number not in self._kept:
                self._kept[number] = splats
                self._size += sum(array.nbytes for array in splats)
                self.bytes_read += int(self.table["bytes"][number])
                self._let_go(int(self.table["bytes"][number]))
            while self._size > self._room and len(self._kept) > 1:
                _, dropped = self._kept.popitem(last=False)
                self._size -= sum(array.nbytes for array in dropped)
        return splats

    def _let_go(self, count: int) -> None:
        """Let go of what is mapped of the file when it is much; the system still has it, as long as there is memory."""
        self._mapped += count
        if self._mapped > MAPPED_MOST and hasattr(mmap, "MADV_DONTNEED"):
            self._content.madvise(mmap.MADV_DONTNEED)
            self._mapped = 0

    def _decode(self, number: int) -> Splats:
        """Check and decode a page."""
        row = self.table[number]
        first, last, count = int(row["offset"]), int(row["offset"]) + int(row["bytes"]), int(row["splats"])
        where = f"page {number}, bytes {first} to {last - 1}"
        content = self._content[first:last]
        if checksum(content) != row["crc"]:
            raise FormatError(self.path, "the checksum does not fit; the file was damaged", where)
        has_color, has_normals = bool(self._flags & HAS_COLOR), bool(self._flags & HAS_NORMALS)
        height = plane_count(has_color, has_normals)

        # Each thread keeps room for the planes of a page, because memory that is new is slow.
        if not hasattr(self._tools, "decompressor"):
            self._tools.decompressor = zstandard().ZstdDecompressor()
            self._tools.room = np.empty(height * PAGE, np.uint8)
        planes = self._tools.room[: height * count].reshape(height, count)
        problem = unpack_bytes(memoryview(content), planes, self._tools.decompressor)
        if problem:
            raise FormatError(self.path, problem, where)
        splats = make_splats(count, has_color, has_normals)
        join_planes(planes, splats)
        return splats


def _read_header(path: Path, content: mmap.mmap) -> Header:
    """Return the header, checked."""
    if len(content) < HEADER_SIZE:
        raise FormatError(path, f"expected a header of {HEADER_SIZE} bytes, the file has {len(content)}")
    if content[: len(MAGIC)] != MAGIC:
        raise FormatError(
            path, f"expected a file of splats, which starts with {MAGIC!r}, got {content[: len(MAGIC)]!r}", "byte 0"
        )
    _, version, flags, *numbers = HEADER.unpack_from(content)
    if struct.unpack_from("<I", content, HEADER.size)[0] != checksum(content[: HEADER.size]):
        raise FormatError(path, "the checksum does not fit; the file was damaged", f"header, bytes 0 to {HEADER_SIZE - 1}")
    if version != VERSION:
        raise FormatError(path, f"expected version {VERSION} of the format, got {version}", "header")
    if not all(map(math.isfinite, numbers)) or min(numbers[3:6]) <= 0 or max(map(abs, numbers[6:])) > 1 << 52 or flags >> 3:
        raise FormatError(path, "expected finite numbers and a scale above 0", "header")
    return Header(flags, np.array(numbers[:3]), np.array(numbers[3:6]), np.array(numbers[6:], np.int64))


def _read_tables(path: Path, content: mmap.mmap) -> tuple[Table, Table, int]:
    """Return the tables of pages and nodes and the number of points, checked."""
    place = len(content) - FOOTER_SIZE
    if place < HEADER_SIZE or content[-len(END_MAGIC) :] != END_MAGIC:
        problem = "expected a footer at the end; the build was not finished (go on with resume=True) or the file was cut off"
        raise FormatError(path, problem, f"byte {len(content)}")
    footer = content[place + 4 :]
    where = f"footer, bytes {place} to {len(content) - 1}"
    if struct.unpack_from("<I", content, place)[0] != checksum(footer):
        raise FormatError(path, "the checksum does not fit; the file was damaged", where)
    first, first_size, second_size, page_count, node_count, point_count, first_crc, second_crc, _ = FOOTER.unpack(footer)
    if first < HEADER_SIZE or first + first_size + second_size != place:
        raise FormatError(path, "the places of the tables do not fit the size of the file", where)

    tables = []
    begin = first
    for name, size, crc, count, dtype in (
        ("pages", first_size, first_crc, page_count, PAGE_ROW),
        ("nodes", second_size, second_crc, node_count, STORED),
    ):
        where = f"table of {name}, bytes {begin} to {begin + size - 1}"
        part = content[begin : begin + size]
        if checksum(part) != crc:
            raise FormatError(path, "the checksum does not fit; the file was damaged", where)
        # A frame of zstd holds at most some 10,000 times its bytes, so this is no limit on true files.
        table, problem = unpack_table(part, dtype, count) if count <= size * 100_000 else (np.empty(0, dtype), "too many rows")
        if problem:
            raise FormatError(path, problem, where)
        tables.append(table)
        begin += size
    pages, nodes = tables

    # Pages follow each other without a gap, from the header to the tables.
    ends = pages["offset"] + pages["bytes"]
    order = np.argsort(pages["offset"], kind="stable")
    starts = np.append(HEADER_SIZE, ends[order]).astype(np.uint64)
    if not (np.append(pages["offset"][order], first).astype(np.uint64) == starts).all() or (pages["splats"] > PAGE).any():
        raise FormatError(path, "the pages do not follow each other without a gap", "table of pages")
    return pages, nodes, point_count


def read_tree(path: str | Path, cache: int = CACHE) -> SplatTree:
    """Return the tree in a file, which is mapped and read as its nodes are asked for.

    Parameters
    ----------
    path : a file that `scanspan.splat.build` wrote.
    cache : bytes of decoded pages that are kept at most.

    Raises
    ------
    FormatError : the file is missing, damaged, cut off or of another kind; the message names the place.
    """
    place = Path(path)
    try:
        with place.open("rb") as file:
            content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except ValueError:
        raise FormatError(path, "the file is empty") from None
    except OSError as error:
        raise FormatError(path, f"cannot be opened ({error.strerror})") from None
    header = _read_header(place, content)
    pages, stored, point_count = _read_tables(place, content)
    nodes, problem = node_table(stored, header.scale)
    if problem:
        raise FormatError(path, problem, "table of nodes")

    # A block lies within its page, and the leaves have the points.
    sizes = pages["splats"].astype(np.int64)
    number = nodes["page"].astype(np.int64)
    inside = number < len(pages)
    if len(nodes) and inside.all():
        inside = nodes["start"].astype(np.int64) + nodes["count"] <= sizes[number]
    if not inside.all():
        raise FormatError(path, f"node {int(np.argmin(inside))} lies outside its page", "table of nodes")
    source = FilePages(place, content, pages, header.flags, cache)
    tree = SplatTree(nodes, header.origin, source, bool(header.flags & HAS_COLOR), bool(header.flags & HAS_NORMALS))
    tree.lattice = header.offset, header.scale, header.base
    if tree.point_count != point_count or tree.splat_count != int(sizes.sum()):
        raise FormatError(path, f"expected {point_count} points, the nodes have {tree.point_count}", "table of nodes")
    return tree
