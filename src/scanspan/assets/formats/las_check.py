"""What is checked of a LAS or LAZ file before a library sees it.

A few wrong numbers in a file make the libraries allocate without bound, which ends the whole process: the number of variable
records in the header, and that of packed chunks. So these are held against the size of the file first.

Source: the ASPRS LAS specification 1.4, revision 15, section 2.4; M. Isenburg, "LASzip: lossless compression of LiDAR data",
2013, for the chunk table.
"""

from __future__ import annotations

import itertools
import math
import struct
from typing import Any, BinaryIO, NamedTuple

from scanspan.errors import FormatError

HEADER_SIZES = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375}
"""Least bytes of a header by minor version."""

RECORD_SIZES = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)
"""Least bytes of a point by format."""

VLR_BYTES = 54


class Head(NamedTuple):
    """What the header says about where points are."""

    points: int
    start: int  # byte of the first point
    point_bytes: int
    is_packed: bool


def check_header(header: bytes, size: int, path: str) -> Head:
    """Return what the first 375 bytes of a file of `size` bytes say; raise FormatError where they cannot be true."""
    if header[:4] != b"LASF":
        raise FormatError(path, f"expected LASF at the start, got {header[:8]!r}")
    if len(header) < 227:
        raise FormatError(path, f"the file ends within its header, after {size} bytes")
    major, minor = header[24], header[25]
    if major != 1 or minor not in HEADER_SIZES:
        raise FormatError(path, f"version {major}.{minor}: LAS 1.0 to 1.4 can be read")
    header_size, start, records = struct.unpack_from("<HII", header, 94)
    form, point_bytes, count = struct.unpack_from("<BHI", header, 104)
    if header_size < HEADER_SIZES[minor] or not header_size <= start <= size:
        raise FormatError(path, f"a header of {header_size} bytes and points at byte {start}, in a file of {size}")
    if records * VLR_BYTES > start - header_size:
        raise FormatError(path, f"{records} variable length records do not fit before the points at byte {start}")
    if minor == 4:
        (count,) = struct.unpack_from("<Q", header, 247)
    is_packed, form = bool(form & 0xC0), form & 0x3F
    if form >= len(RECORD_SIZES) or point_bytes < RECORD_SIZES[form]:
        raise FormatError(path, f"point format {form} with {point_bytes} bytes a point: formats 0 to 10 can be read")
    _check_placement(struct.unpack_from("<6d", header, 131), path)

    # Points that are not packed must all be there.
    if not is_packed and count * point_bytes > size - start:
        room = (size - start) // point_bytes
        raise FormatError(path, f"the header says {count} points, there is room for {room}")
    return Head(count, start, point_bytes, is_packed)


def _check_placement(placement: tuple[float, ...], path: str) -> None:
    """Raise for a scale or an offset that no coordinates can have."""
    for name, values in (("scale", placement[:3]), ("offset", placement[3:])):
        low = 1e-100 if name == "scale" else 0.0
        if not all(math.isfinite(v) and low <= abs(v) <= 1e100 for v in values) or (low and min(values) < 0):
            raise FormatError(path, f"the {name} of coordinates is {values}")


def check_chunk_table(stream: BinaryIO, record: bytes, head: Head, size: int, path: str, lazrs: Any) -> tuple[int, ...]:
    """Return the first point of each packed chunk; raise unless their table agrees with the header and the file's size."""
    item_bytes = int(lazrs.LazVlr(record).item_size())
    if item_bytes != head.point_bytes:
        raise FormatError(path, f"packed points have {item_bytes} bytes, the header says {head.point_bytes}")
    if not head.points:
        return ()
    table = _number(stream, head.start, size, path)
    if table == -1:
        table = _number(stream, size - 8, size, path)
    if not head.start + 8 <= table <= size - 8:
        raise FormatError(path, f"the table of packed chunks is at byte {table}, in a file of {size}: it may be cut short")
    stream.seek(table)
    _, many = struct.unpack("<II", stream.read(8))

    # Each chunk begins with one point as it is.
    room = table - head.start - 8
    if not 0 < many <= head.points or many * item_bytes > room:
        raise FormatError(path, f"{many} packed chunks do not fit in {room} bytes", f"byte {table}")
    stream.seek(head.start)
    chunks = lazrs.read_chunk_table(stream, lazrs.LazVlr(record))
    points, taken = sum(points for points, _ in chunks), sum(taken for _, taken in chunks)
    if taken != room or points < head.points or min(taken for _, taken in chunks) < item_bytes:
        held = f"{points} points in {taken} bytes, expected {head.points} in {room}"
        raise FormatError(path, f"the table of packed chunks has {held}", f"byte {table}")
    return tuple(itertools.accumulate((points for points, _ in chunks[:-1]), initial=0))


def _number(stream: BinaryIO, place: int, size: int, path: str) -> int:
    """Return the signed number of 8 bytes at a place."""
    if place + 8 > size:
        raise FormatError(path, f"the file ends at byte {size}, before its packed points")
    stream.seek(place)
    return int(struct.unpack("<q", stream.read(8))[0])
