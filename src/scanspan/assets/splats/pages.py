"""Pages: up to 8,192 splats of blocks that lie side by side, as planes of bytes that compress well, and back.

A block is too small to be compressed alone: tables of codes would cost as much as they save. So blocks of one height over the
leaves share a page, in the order in which they were made, which is that of space. A reader that wants one block decodes a page,
and keeps it, because its neighbours are wanted next.

Each plane holds one byte of one number of all splats: of the difference of each coordinate to that of the splat before (zigzag,
so that small ones of either sign have a high byte of 0); the radius; green, red less green and blue less green, again as
differences; both halves of the normal likewise, and the bits of the cone. Every plane is a frame of zstd of its own, as one
table of codes for all would fit none. The price: a page is decoded whole.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np

from scanspan.assets.splats.codec import Splats
from scanspan.errors import InputError
from scanspan.jit import kernel
from scanspan.records import UInt8Array

PAGE = 8192  # splats at most
LEVEL = 1  # of zstd; higher ones gained nothing (docs/decisions/0017-trees-of-splats.md)
COLOR_PLANES, NORMAL_PLANES = 3, 3
FIRST_COLOR_PLANE = 7  # after two bytes for each coordinate, and the radius


def plane_count(has_color: bool, has_normals: bool) -> int:
    """Return how many planes a page has.

    >>> plane_count(True, True)
    13
    """
    return FIRST_COLOR_PLANE + COLOR_PLANES * has_color + NORMAL_PLANES * has_normals


def make_splats(count: int, has_color: bool, has_normals: bool) -> Splats:
    """Return room for some splats."""
    return Splats(
        np.empty((count, 3), np.uint16),
        np.empty(count, np.uint8),
        np.empty((count if has_color else 0, 3), np.uint8),
        np.empty(count if has_normals else 0, np.uint16),
    )


@kernel
def split_planes(splats: Splats, planes: UInt8Array) -> None:
    """Write the planes (P, N) of N splats."""
    for axis in range(3):
        before = np.int64(0)
        for i in range(len(splats.radius)):
            value = np.int64(splats.positions[i, axis])
            step = ((value - before + 32768) & 65535) - 32768
            code = (step << 1 ^ step >> 63) & 65535
            planes[2 * axis, i] = code & 255
            planes[2 * axis + 1, i] = code >> 8
            before = value
    for i in range(len(splats.radius)):
        planes[6, i] = splats.radius[i]
    if len(splats.color):
        green, red, blue = np.int64(0), np.int64(0), np.int64(0)
        for i in range(len(splats.color)):
            g = np.int64(splats.color[i, 1])
            r, b = np.int64(splats.color[i, 0]) - g, np.int64(splats.color[i, 2]) - g
            planes[7, i], planes[8, i], planes[9, i] = (g - green) & 255, (r - red) & 255, (b - blue) & 255
            green, red, blue = g, r, b
    if len(splats.normal):
        p = len(planes) - NORMAL_PLANES
        u, v = np.int64(0), np.int64(0)
        for i in range(len(splats.normal)):
            code = np.int64(splats.normal[i])
            planes[p, i], planes[p + 1, i], planes[p + 2, i] = ((code >> 9) - u) & 127, ((code >> 2) - v) & 127, code & 3
            u, v = code >> 9, code >> 2


@kernel
def join_planes(planes: UInt8Array, splats: Splats) -> None:
    """Write the N splats of planes (P, N)."""
    x, y, z = np.int64(0), np.int64(0), np.int64(0)
    for i in range(len(splats.radius)):
        code_x = np.int64(planes[0, i]) | np.int64(planes[1, i]) << 8
        code_y = np.int64(planes[2, i]) | np.int64(planes[3, i]) << 8
        code_z = np.int64(planes[4, i]) | np.int64(planes[5, i]) << 8
        x += code_x >> 1 ^ -(code_x & 1)
        y += code_y >> 1 ^ -(code_y & 1)
        z += code_z >> 1 ^ -(code_z & 1)
        splats.positions[i, 0], splats.positions[i, 1], splats.positions[i, 2] = x & 65535, y & 65535, z & 65535
        splats.radius[i] = planes[6, i]
    if len(splats.color):
        green, red, blue = np.int64(0), np.int64(0), np.int64(0)
        for i in range(len(splats.color)):
            green += np.int64(planes[7, i])
            red += np.int64(planes[8, i])
            blue += np.int64(planes[9, i])
            splats.color[i, 0], splats.color[i, 1], splats.color[i, 2] = (red + green) & 255, green & 255, (blue + green) & 255
    if len(splats.normal):
        p = len(planes) - NORMAL_PLANES
        u, v = np.int64(0), np.int64(0)
        for i in range(len(splats.normal)):
            u += np.int64(planes[p, i])
            v += np.int64(planes[p + 1, i])
            splats.normal[i] = (u & 127) << 9 | (v & 127) << 2 | np.int64(planes[p + 2, i]) & 3


def zstandard() -> Any:
    """Return the package for zstd.

    Raises
    ------
    InputError : it is not installed.
    """
    try:
        import zstandard as package
    except ImportError:
        raise InputError('files of splats need zstandard; install it with: pip install "scanspan[points]"') from None
    return package


def pack_bytes(planes: UInt8Array, compressor: Any) -> bytes:
    """Return planes (P, N) as bytes: the length of each when compressed (P, uint32), then the planes."""
    frames = [compressor.compress(plane) for plane in planes]
    return struct.pack(f"<{len(frames)}I", *map(len, frames)) + b"".join(frames)


def unpack_bytes(content: bytes | memoryview, planes: UInt8Array, decompressor: Any) -> str:
    """Write the planes (P, N) of bytes; return what is wrong with these, or nothing."""
    count, size = planes.shape
    if len(content) < 4 * count:
        return f"expected {count} lengths of planes, got {len(content)} bytes"
    lengths = struct.unpack_from(f"<{count}I", content)
    if sum(lengths) != len(content) - 4 * count:
        return f"expected planes of {len(content) - 4 * count} bytes in all, got {sum(lengths)}"
    place = 4 * count
    package = zstandard()
    for p, length in enumerate(lengths):
        # Ask for the size first, so that no frame takes more memory than it may.
        frame = content[place : place + length]
        try:
            found = package.frame_content_size(frame)
            plane = decompressor.decompress(frame) if found == size else b""
        except package.ZstdError as error:
            return f"plane {p} cannot be decompressed ({error})"
        if found != size or len(plane) != size:
            return f"expected {size} bytes in plane {p}, got {found}"
        planes[p] = np.frombuffer(plane, np.uint8)
        place += length
    return ""


def checksum(content: bytes) -> int:
    """Return the CRC-32 of some bytes."""
    return zlib.crc32(content)
