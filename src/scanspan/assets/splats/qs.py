"""The classic format: a tree of spheres with 48 bits a node, written and read as `.qs` files of our own layout.

A node is 13 bits of sphere against its parent and 3 of tree (spheres.py), 14 of normal, 2 of the cone around all normals
below, and 16 of colour. The bytes are described in docs/qs.md. The price of so few: a centre is off by up to a thirteenth of
the parent's radius and more, and a file says nothing of what a scanner knows besides colour. The format `.scansplat` has a
tenth of that error; this one is here to be compared with, and for teaching.

A checksum covers the header and one the nodes, so damage anywhere is an error and never a wrong picture.

Source: S. Rusinkiewicz and M. Levoy, "QSplat: a multiresolution point rendering system for large meshes", 2000, section 3.
"""

from __future__ import annotations

import math
import os
import struct
import zlib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.assets.mesh import Mesh
from scanspan.assets.splats.spheres import (
    Tree,
    decode_spheres,
    encode_spheres,
    families,
    has_grandchildren,
    levels,
    sphere_codes,
    sphere_tree,
)
from scanspan.errors import FormatError, InputError
from scanspan.records import Array, Float32Array, Float64Array, Int64Array, UInt8Array

MAGIC = b"\x89SSQS\r\n\n"
VERSION = 1
HEADER = struct.Struct("<8sIIQQ4dII")
"""Mark, version, flags, nodes, leaves, the root's x, y, z and radius, the checksum of the nodes, and that of what is before."""

HAS_NORMALS, HAS_COLORS = 1, 2
NODE_BYTES = 6

CELLS = 52
"""Cells along a side of the cube of normals: 6 * 52 * 52 = 16,224 codes fit 14 bits."""

MAX_REACH = 1e100
"""Coordinates and radii lie within this."""

NO_NORMAL = (1 << 14) - 1
CONE_SINES = (1 / 16, 4 / 16, 9 / 16, 1.0)
"""The four cones; the last is that of a node whose normals may point anywhere."""


class Splats(NamedTuple):
    """A tree of N splats, breadth first; the splats of a level are a picture of the whole."""

    tree: Tree
    normals: Float32Array  # (N, 3) unit vectors, 0 where there is none
    cones: Float32Array  # (N,) sine of the angle within which all normals below lie; 1 says nothing
    colors: UInt8Array  # (N, 3)
    has_normals: bool
    has_colors: bool

    @property
    def levels(self) -> list[slice]:
        """The nodes of each level, from the root down; leaves of a level stand for themselves in all finer ones."""
        return levels(self.tree.children)


def build_splats(geometry: PointCloud | Mesh, radius: float | None = None) -> Splats:
    """Return the tree of splats over a cloud, or over the vertices of a mesh.

    Parameters
    ----------
    geometry : at least one point. Of a mesh, those that triangles use, with the attributes "normal" and "color".
    radius : of all leaves; by default, of a mesh's vertex the largest radius of a sphere about a triangle at it, and of a
        cloud's point the distance of neighbours, as it is on the whole.

    Raises
    ------
    InputError : no point, or a radius that is no number above 0.

    Examples
    --------
    >>> splats = build_splats(PointCloud([(0, 0, 0), (1, 0, 0), (8, 0, 0), (9, 0, 0), (9, 1, 0)], color="red"), 0.5)
    >>> splats.tree.children.tolist(), splats.colors[0].tolist()
    ([4, 0, 0, 0, 2, 0, 0], [255, 0, 0])
    """
    places, normals, colors = _vertices(geometry)
    if not len(places):
        raise InputError("a tree of splats needs at least one point")
    if np.abs(places).max() > MAX_REACH:
        raise InputError(f"points reach to {np.abs(places).max():g}: expected coordinates within {MAX_REACH:g}")
    if radius is not None and (isinstance(radius, (bool, str)) or not 1 / MAX_REACH <= float(radius) <= MAX_REACH):
        raise InputError(f"radius = {radius!r}: expected a number above 0")
    radii = np.full(len(places), spacing(places) if radius is None else float(radius))
    if radius is None and isinstance(geometry, Mesh):
        radii = np.maximum(_triangle_radii(geometry), 1e-9 * float(np.ptp(places, axis=0).max()) + 1e-90)
    tree = sphere_tree(places, radii)

    # From the leaves up: sums of normals and means of colours, then cones about the normals.
    is_leaf = tree.points >= 0
    summed, mean = np.zeros((len(is_leaf), 3)), np.zeros((len(is_leaf), 3))
    if normals is not None:
        summed[is_leaf] = _units(normals[tree.points[is_leaf]])
    if colors is not None:
        mean[is_leaf] = colors[tree.points[is_leaf], :3]
    below = np.where(is_leaf, 1, 0)
    for level, lower, begins in reversed(families(tree.children)):
        inner = level.start + np.flatnonzero(tree.children[level])
        below[inner] = np.add.reduceat(below[lower], begins)
        summed[inner] = np.add.reduceat(summed[lower], begins, axis=0)
        mean[inner] = np.add.reduceat(mean[lower] * below[lower, None], begins, axis=0) / below[inner, None]
    axes = _units(summed)
    sines = np.sin(np.minimum(_cone_angles(tree, axes), math.pi / 2)).astype(np.float32)
    cones = np.minimum(np.nextafter(sines, np.float32(2)), np.float32(1))
    return Splats(
        tree, axes.astype(np.float32), cones, np.rint(mean).astype(np.uint8), normals is not None,
        colors is not None,
    )  # fmt: skip


def _vertices(geometry: PointCloud | Mesh) -> tuple[Float64Array, Array | None, Array | None]:
    """Return positions, normals and colours of the points that count."""
    if isinstance(geometry, PointCloud):
        return geometry.positions, geometry.normals, geometry.color
    if not isinstance(geometry, Mesh):
        raise InputError(f"geometry: expected a PointCloud or a Mesh, got {type(geometry).__name__}")
    used = np.unique(geometry.triangles)
    colors = geometry.attributes["color"][used] if "color" in geometry.attributes else None
    if colors is not None and colors.dtype != np.uint8:
        colors = np.rint(colors * 255.0).astype(np.uint8)
    normals = geometry.attributes["normal"][used] if "normal" in geometry.attributes else _vertex_normals(geometry)[used]
    return geometry.positions[used], normals, colors


def _vertex_normals(mesh: Mesh) -> Float64Array:
    """Return the sum of the faces' normals at each vertex, each as long as its face is large, (V, 3)."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    normals = np.zeros((len(mesh.positions), 3))
    for k in range(3):
        np.add.at(normals, mesh.triangles[:, k], np.cross(b - a, c - a))
    return normals


def _triangle_radii(mesh: Mesh) -> Float64Array:
    """Return for each vertex that is used the largest radius of a sphere about a triangle at it."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    middle = (a + b + c) / 3
    reach = np.sqrt(np.max([((corner - middle) ** 2).sum(axis=1) for corner in (a, b, c)], axis=0))
    radii = np.zeros(len(mesh.positions))
    np.maximum.at(radii, mesh.triangles.reshape(-1), np.repeat(reach, 3))
    return radii[np.unique(mesh.triangles)]


def spacing(places: Float64Array) -> float:
    """Return about how far apart neighbours are: the side of cubes that hold some two points each.

    >>> 0.5 < spacing(np.stack(np.mgrid[:20, :20, :1], axis=-1).reshape(-1, 3).astype(float)) < 3
    True
    """
    low = places.min(axis=0)
    side = float((places.max(axis=0) - low).max())
    if not side > 1e-90:
        return 1.0
    halvings = 0
    while halvings < 20:
        # Number the cubes; as soon as few of them hold more than one point, they have become too small.
        cells = np.floor((places - low) * (2**halvings / side)).astype(np.int64)
        numbers = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
        if len(places) <= 2 * len(np.unique(numbers)):
            break
        halvings += 1
    return side / (1 << halvings)


def _units(vectors: Array) -> Float64Array:
    """Return vectors in length 1, 0 where they have none."""
    wide = vectors.astype(np.float64)
    largest = np.abs(wide).max(axis=1, keepdims=True)
    wide = np.divide(wide, largest, out=np.zeros_like(wide), where=largest > 0)
    length = np.sqrt((wide**2).sum(axis=1, keepdims=True))
    unit: Float64Array = np.divide(wide, length, out=np.zeros_like(wide), where=length > 0)
    return unit


def _angles(a: Float64Array, b: Float64Array) -> Float64Array:
    """Return the angle between unit vectors; beyond a half turn where one is 0, as it may then be any."""
    across = np.sqrt((np.cross(a, b) ** 2).sum(axis=1))
    known = a.any(axis=1) & b.any(axis=1)
    return np.where(known, np.arctan2(across, (a * b).sum(axis=1)), 4.0)


def _cone_angles(tree: Tree, axes: Float64Array) -> Float64Array:
    """Return within which angle of its normal all normals below a node lie."""
    angles = np.where(axes.any(axis=1), 0.0, 4.0)
    for level, lower, begins in reversed(families(tree.children)):
        inner = level.start + np.flatnonzero(tree.children[level])
        above = np.repeat(axes[inner], tree.children[inner], axis=0)
        angles[inner] = np.maximum.reduceat(_angles(above, axes[lower]) + angles[lower], begins)
    return angles


@cache
def normal_codes() -> Float32Array:
    """Return the normal of each of the 16,224 codes, (16224, 3): six sides of a cube, 52 by 52 directions on each.

    >>> normal_codes().shape
    (16224, 3)
    """
    # Equal angles, not equal lengths on the side, part two neighbours.
    across = np.array([math.tan(((k + 0.5) / CELLS * 2 - 1) * math.pi / 4) for k in range(CELLS)])
    first, second = np.meshgrid(across, across, indexing="ij")
    sides = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            side = np.empty((CELLS, CELLS, 3))
            side[..., axis], side[..., (axis + 1) % 3], side[..., (axis + 2) % 3] = sign, first, second
            sides.append(side.reshape(-1, 3))
    found = _units(np.concatenate(sides)).astype(np.float32)
    found.flags.writeable = False
    return found


def encode_normals(normals: Array) -> Int64Array:
    """Return the code of each normal, NO_NORMAL for 0."""
    wide = normals.astype(np.float64)
    axis = np.abs(wide).argmax(axis=1)
    rows = np.arange(len(wide))
    longest = wide[rows, axis]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [wide[rows, (axis + k) % 3] / np.abs(longest) for k in (1, 2)]
        cells = [np.clip(np.floor((np.arctan(r) * (4 / math.pi) + 1) / 2 * CELLS), 0, CELLS - 1) for r in ratios]
    codes = ((2 * axis + (longest < 0)) * CELLS + np.nan_to_num(cells[0])) * CELLS + np.nan_to_num(cells[1])
    return np.where(longest == 0, NO_NORMAL, codes).astype(np.int64)


def encode_qs(splats: Splats) -> bytes:
    """Return a file with these splats.

    >>> content = encode_qs(build_splats(PointCloud([(0, 0, 0), (1, 0, 0)]), 0.5))
    >>> len(content) == HEADER.size + 3 * NODE_BYTES
    True
    """
    tree, count = splats.tree, len(splats.tree.radii)
    words = np.zeros((count, 3), "<u2")
    words[:, 0] = encode_spheres(tree)

    # A cone is about the normal as decoded, so it is wider by what that is off.
    codes = encode_normals(splats.normals) if splats.has_normals else np.full(count, NO_NORMAL)
    known = codes != NO_NORMAL
    off = np.full(count, 4.0)
    off[known] = _angles(normal_codes()[codes[known]].astype(np.float64), _units(splats.normals[known]))
    half = np.where(splats.cones < 1, np.arcsin(np.minimum(splats.cones, 1.0).astype(np.float64)), 4.0) + off + 1e-6
    sines = np.where(half < math.pi / 2, np.sin(np.minimum(half, math.pi / 2)), 2.0)
    words[:, 1] = (codes << 2) | np.minimum(np.searchsorted(CONE_SINES, sines), 3)
    words[:, 2] = to_565(splats.colors)
    body = words.tobytes()
    flags = HAS_NORMALS * splats.has_normals | HAS_COLORS * splats.has_colors
    leaves = int((tree.children == 0).sum())
    root = (*tree.centres[0].tolist(), float(tree.radii[0]))
    head = HEADER.pack(MAGIC, VERSION, flags, count, leaves, *root, zlib.crc32(body), 0)[:-4]
    return head + struct.pack("<I", zlib.crc32(head)) + body


def to_565(colors: UInt8Array) -> Array:
    """Return colours as 16 bits: 5 of red, 6 of green, 5 of blue, each the nearest."""
    red, green, blue = (np.rint(colors[:, k] * (most / 255.0)).astype(np.int64) for k, most in enumerate((31, 63, 31)))
    words: Array = (red << 11) | (green << 5) | blue
    return words


def from_565(words: Array) -> UInt8Array:
    """Return colours of 16 bits as (N, 3) bytes."""
    bits = words.astype(np.int64)
    parts = [(bits >> 11) * (255.0 / 31), ((bits >> 5) & 63) * (255.0 / 63), (bits & 31) * (255.0 / 31)]
    return np.rint(np.stack(parts, axis=1)).astype(np.uint8)


def decode_qs(content: bytes, path: str = "splats.qs") -> Splats:
    """Return the splats of a file as a reader sees them.

    Raises
    ------
    FormatError : the file is cut short, damaged, or of another kind.
    """
    flags, count, leaves, root, checksum = _read_header(content, path)
    body = content[HEADER.size :]
    if len(body) != count * NODE_BYTES:
        raise FormatError(path, f"the header says {count} nodes of {NODE_BYTES} bytes, there are {len(body)} bytes")
    if zlib.crc32(body) != checksum:
        raise FormatError(path, "the checksum of the nodes is wrong: the file is damaged", f"byte {HEADER.size} on")
    words = np.frombuffer(body, "<u2").reshape(-1, 3)
    _check_tree(words[:, 0], leaves, path)
    tree = decode_spheres(root, words[:, 0])
    codes = words[:, 1].astype(np.int64) >> 2
    known = codes < len(normal_codes())
    normals = np.where(known[:, None], normal_codes()[np.where(known, codes, 0)], np.float32(0))
    cones = np.array(CONE_SINES, np.float32)[words[:, 1] & 3]
    return Splats(tree, normals, cones, from_565(words[:, 2]), bool(flags & HAS_NORMALS), bool(flags & HAS_COLORS))


def _read_header(content: bytes, path: str) -> tuple[int, int, int, Float64Array, int]:
    """Return flags, nodes, leaves, the root's sphere, and the checksum of the nodes."""
    if content[:8] != MAGIC:
        raise FormatError(path, f"expected the mark of a .qs file at the start, got {content[:8]!r}")
    if len(content) < HEADER.size:
        raise FormatError(path, f"the file ends within its header, after {len(content)} bytes")
    _, version, flags, count, leaves, *root, checksum, own = HEADER.unpack_from(content)
    if zlib.crc32(content[: HEADER.size - 4]) != own:
        raise FormatError(path, "the checksum of the header is wrong: the file is damaged", "byte 0 on")
    if version != VERSION:
        raise FormatError(path, f"version {version}, expected {VERSION}")
    if not (all(math.isfinite(v) and abs(v) <= 1e150 for v in root) and root[3] > 0 and count > 0):
        raise FormatError(path, f"{count} nodes below a sphere at {tuple(root[:3])} of radius {root[3]}")
    return flags, count, leaves, np.array(root), checksum


def _check_tree(words: Array, leaves: int, path: str) -> None:
    """Raise for words that make no tree; a checksum has said already that they are as they were written."""
    bits = words.astype(np.int64)
    beyond = np.flatnonzero((bits >> 3) >= len(sphere_codes()))
    if len(beyond):
        raise FormatError(path, f"node {beyond[0]} has sphere {bits[beyond[0]] >> 3}, there are {len(sphere_codes())}")
    children = np.array([0, 2, 3, 4])[(bits >> 1) & 3]
    known = 1 + np.cumsum(children)
    if known[-1] != len(bits) or (known[:-1] <= np.arange(1, len(bits))).any() or (children == 0).sum() != leaves:
        raise FormatError(path, f"the {len(bits)} nodes are no tree with {leaves} leaves")
    empty = np.zeros(0)
    if not np.array_equal(has_grandchildren(Tree(empty, empty, children, children)), bits & 1):
        raise FormatError(path, "the marks of grandchildren do not fit the tree")


def write_qs(path: str | os.PathLike[str], splats: Splats) -> None:
    """Write splats into a file, which is either written whole or left as it was.

    Raises
    ------
    FormatError : the file cannot be written.
    """
    target = Path(path)
    beside = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        beside.write_bytes(encode_qs(splats))
        os.replace(beside, target)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise FormatError(target, f"it cannot be written: {(error.strerror or str(error)).lower()}") from None


def read_qs(path: str | os.PathLike[str]) -> Splats:
    """Return the splats of a file.

    Raises
    ------
    FormatError : the file is missing, cut short, damaged, or of another kind.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise FormatError(Path(path), f"it cannot be read: {(error.strerror or str(error)).lower()}") from None
    return decode_qs(content, os.fspath(path))
