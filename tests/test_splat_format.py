"""docs/scansplat.md, read by a reader that shares no code with the library: struct, zstd and NumPy alone."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import zstandard

from scanspan.assets.cloud import PointCloud
from scanspan.assets.splats.build import build_tree
from scanspan.records import Array
from tests.splatting import ball, hard, numbered

NODE = np.dtype("3i8, f8, f8, f8, i8, u4, 3u2, u2, 3i1, u1, u1, u1")
NODE.names = ("low", "ball", "largest", "error", "step", "page", "middle", "first", "axis", "sine", "children", "count")


def planes(content: bytes, count: int) -> Array:
    """Return the planes of a page or table, (count, N)."""
    lengths = struct.unpack_from(f"<{count}I", content)
    ends = 4 * count + np.cumsum([0, *lengths])
    frames = [content[a:b] for a, b in zip(ends.tolist(), ends[1:].tolist())]
    return np.array([np.frombuffer(zstandard.ZstdDecompressor().decompress(frame), np.uint8) for frame in frames])


def rows(content: bytes, dtype: np.dtype[np.void]) -> Array:
    return np.frombuffer(np.ascontiguousarray(planes(content, dtype.itemsize).T).tobytes(), dtype)


def unfold(low: Array, high: Array) -> Array:
    folded = low.astype(np.int64) + 256 * high.astype(np.int64)
    return np.cumsum(np.where(folded % 2, -(folded + 1) // 2, folded // 2)) % 65536


def read_file(content: bytes) -> dict[str, Array]:
    """Return all that a file says of its nodes and splats."""
    footer = struct.unpack("<IQQQQQQII16s", content[-76:])
    assert footer[0] == zlib.crc32(content[-72:])
    assert content[:16] == b"scanspan splats\n"
    assert footer[9] == b"scanspan splats."
    version, flags = struct.unpack_from("<II", content, 16)
    assert version == 1
    place, first_size, second_size = footer[1:4]
    tables = content[place : place + first_size], content[place + first_size : place + first_size + second_size]
    assert tuple(map(zlib.crc32, tables)) == footer[7:9]
    pages, nodes = rows(tables[0], np.dtype("u8, u4, u4, u4, u4")), rows(tables[1], NODE)
    assert (len(pages), len(nodes)) == footer[4:6]

    # Corners are differences to the parents; the children of a node follow those of the nodes before it.
    low, first = nodes["low"].copy(), 1
    for node, children in enumerate(nodes["children"].tolist()):
        low[first : first + children] += low[node]
        first += children
    decoded = []
    for offset, size, crc, count, _ in pages.tolist():
        part = content[offset : offset + size]
        assert zlib.crc32(part) == crc
        p = planes(part, 7 + 3 * (flags & 1) + 3 * (flags >> 1 & 1))
        steps = np.column_stack([unfold(p[0], p[1]), unfold(p[2], p[3]), unfold(p[4], p[5])])
        assert len(steps) == count
        green = np.cumsum(p[7], dtype=np.int64) if flags & 1 else np.zeros(count, int)
        color = np.column_stack([green + np.cumsum(p[8]), green, green + np.cumsum(p[9])]) % 256 if flags & 1 else None
        u, v = (np.cumsum(p[-3], dtype=np.int64) % 128, np.cumsum(p[-2], dtype=np.int64) % 128) if flags & 2 else (green, green)
        decoded.append((steps, p[6], color, u << 9 | v << 2 | p[-1]))
    offset, scale = np.frombuffer(content, "f8", 6, 24).reshape(2, 3)
    base = np.frombuffer(content, "i8", 3, 72)

    numbers, radii, colors, normals = [], [], [], []
    for node, row in enumerate(nodes):
        part = slice(int(row["first"]), int(row["first"]) + int(row["count"]) + 1)
        steps, share, color, normal = decoded[row["page"]]
        numbers.append(low[node] + row["step"] * steps[part])
        radii.append(share[part] / 255 * row["largest"])
        colors.append(color[part] if color is not None else np.empty((0, 3)))
        normals.append(normal[part])
    return {
        "nodes": nodes, "numbers": np.concatenate(numbers) + base, "radii": np.concatenate(radii), "scale": scale,
        "color": np.concatenate(colors), "normal": np.concatenate(normals), "offset": offset, "flags": np.array(flags),
    }  # fmt: skip


def test_the_document_says_how_to_read_a_file(tmp_path: Path) -> None:
    path = tmp_path / "file.scansplat"
    for cloud, flags in ((ball(40_000), 7), (hard(2000), 1), ({"positions": np.eye(3)}, 0)):
        tree = build_tree(cloud, path)
        found = read_file(path.read_bytes())
        assert found["flags"] == flags
        nodes = np.arange(len(tree.nodes))
        splats = tree.read_many(nodes).splats
        number = np.repeat(nodes, tree.nodes["count"])
        places = tree.origin + tree.nodes["low"][number] + tree.nodes["step"][number] * splats.positions
        assert np.array_equal(found["offset"] + found["scale"] * found["numbers"], places)
        assert np.array_equal(found["radii"], splats.radius / 255.0 * tree.nodes["splat_radius"][number])
        assert np.array_equal(found["color"], splats.color)
        if flags & 2:
            assert np.array_equal(found["normal"], splats.normal)
        assert np.array_equal(found["nodes"]["error"], tree.nodes["error"])


def test_the_numbers_of_a_survey_are_in_the_file(tmp_path: Path) -> None:
    numbers = np.random.default_rng(1).integers(-5000, 5000, (900, 3))
    cloud = PointCloud(integers=numbers, scale=0.01, offset=(5e5, 4e6, 10.0), color=numbered(900))
    build_tree(cloud, tmp_path / "file.scansplat", exact=True)
    found = read_file((tmp_path / "file.scansplat").read_bytes())
    leaves = np.repeat(found["nodes"]["children"] == 0, found["nodes"]["count"].astype(int) + 1)
    point = found["color"][leaves].astype(np.int64) @ [1 << 16, 1 << 8, 1]
    assert np.array_equal(found["numbers"][leaves], numbers[point])
