"""Splats: points in space, each written as one pixel, a square or a disc at one depth; clouds and blocks of a hierarchy alike.

A splat is three numbers of any type, with an affine map to the world that is folded into the camera's matrix. So integers are
drawn as a file or a tree stores them, and nothing is decoded on the way.

As in points.py, two passes go over each block of a few hundred splats: the first places them, in vector instructions and
without a branch; the second writes. Off the image lies one place more, behind the last pixel. The word that is written orders
by depth, then by number, so the order of the splats, and how threads share them, change nothing.

Indices are unsigned. A signed one may count from the end, which has to be looked at, and then the loop that takes the
coordinates apart is not vectorized: 160 instead of 430 M points/s (docs/decisions/0016-splats.md).

Source: M. Schuetz, B. Kerbl, M. Wimmer, Rendering Point Clouds with Compute Shaders (2021), for the packed word.
"""

from __future__ import annotations

from threading import Event
from typing import TypeAlias

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.raster.algorithms import LAYER_BYTES, SHARED, draw_layers
from scanspan.raster.write import EMPTY_KEY, pack_key
from scanspan.records import Array, Float64Array, Int64Array

BLOCK = 256  # splats that are placed, then written
BLOCKS = 1 << 12  # between two looks at the keyboard
FLAT = 1 << 12  # splats of a block of a cloud that has no blocks of its own
MOST = 1024.0  # pixels, the largest radius by default
FARTHEST = -1e38  # the least depth where there is no far plane; below it float32 ends
PAD = 1  # keys behind the image

Map: TypeAlias = tuple[float, ...]  # sixteen numbers of a matrix, row after row


@bare_helper
def fold_map(matrix: Float64Array, origin: Float64Array, step: Float64Array) -> Map:
    """Return a matrix with an affine map, world = origin + step * stored, folded into it.

    Shapes  matrix: (4, 4); origin, step: (3,).
    """
    m, s0, s1, s2, x, y, z = matrix, step[0], step[1], step[2], origin[0], origin[1], origin[2]
    return (
        m[0, 0] * s0, m[0, 1] * s1, m[0, 2] * s2, ((m[0, 0] * x + m[0, 1] * y) + m[0, 2] * z) + m[0, 3],
        m[1, 0] * s0, m[1, 1] * s1, m[1, 2] * s2, ((m[1, 0] * x + m[1, 1] * y) + m[1, 2] * z) + m[1, 3],
        m[2, 0] * s0, m[2, 1] * s1, m[2, 2] * s2, ((m[2, 0] * x + m[2, 1] * y) + m[2, 2] * z) + m[2, 3],
        m[3, 0] * s0, m[3, 1] * s1, m[3, 2] * s2, ((m[3, 0] * x + m[3, 1] * y) + m[3, 2] * z) + m[3, 3],
    )  # fmt: skip


@bare_helper
def take_apart(positions: Array, first: int, count: int, places: Float64Array) -> None:
    """Put coordinates that lie x, y, z, x, y, z, ... into three rows.

    Shapes  positions: (3 N,); places: (>= 3, BLOCK), rows 0 to 2 written.
    """
    for i in range(count):
        k, q = np.uint64(3) * np.uint64(first + i), np.uint64(i)
        places[0, q] = np.float64(positions[k])
        places[1, q] = np.float64(positions[k + np.uint64(1)])
        places[2, q] = np.float64(positions[k + np.uint64(2)])


@bare_helper
def project(m: Map, x: float, y: float, z: float, least: float) -> tuple[bool, float, float, float, float]:
    """Return whether a stored place is before the eye and between the planes, its pixel (u, v), depth, and 1 / w."""
    w = ((m[12] * x + m[13] * y) + m[14] * z) + m[15]
    inverse = 1.0 / w
    u = (((m[0] * x + m[1] * y) + m[2] * z) + m[3]) * inverse
    v = (((m[4] * x + m[5] * y) + m[6] * z) + m[7]) * inverse
    depth = (((m[8] * x + m[9] * y) + m[10] * z) + m[11]) * inverse
    return (w > 0.0) & (depth <= 1.0) & (depth >= least), u, v, depth, inverse


@bare_kernel
def write_points(
    keys: Int64Array, width: int, height: int, least: float, positions: Array, blocks: Int64Array, origins: Float64Array,
    steps: Float64Array, matrices: Float64Array, places: Float64Array, words: Int64Array,
) -> None:  # fmt: skip
    """Write splats of one pixel each: the one they lie in.

    Shapes  keys: (height * width + 1,), the image row after row; positions: (3 N,) of any type; blocks: (B, 4) first splat,
            how many, number of the first, row of matrices; origins, steps: (B, 3), world = origin + step * stored;
            matrices: (K, 4, 4) from `pixel_matrix`; places, words: room, from `make_room`.
    Units   least: the depth at the far plane, or FARTHEST.
    Needs   numbers below 2^32, pixels below 2^31; coordinates may be anything, NaN as well.
    """
    wide, high, outside = np.float64(width), np.float64(height), np.int64(width) * np.int64(height)
    for b in range(blocks.shape[0]):
        start, count, number = blocks[b, 0], blocks[b, 1], blocks[b, 2]
        m = fold_map(matrices[blocks[b, 3]], origins[b], steps[b])
        for first in range(0, count, BLOCK):
            n = min(count - first, BLOCK)
            take_apart(positions, start + first, n, places)

            # Find the pixel and the word of each.
            for i in range(n):
                q = np.uint64(i)
                fits, u, v, depth, _ = project(m, places[0, q], places[1, q], places[2, q], least)
                inside = fits & (u >= 0.0) & (u < wide) & (v >= 0.0) & (v < high)
                column, row = np.int32(u if inside else 0.0), np.int32(v if inside else 0.0)
                words[0, q] = np.int64(row * np.int32(width) + column) if inside else outside
                words[1, q] = pack_key(depth, number + first + i)

            # Write them.
            for i in range(n):
                q = np.uint64(i)
                place = np.uint64(words[0, q])
                keys[place] = max(keys[place], words[1, q])


@bare_helper
def write_square(keys: Int64Array, wide: float, high: float, across: float, down: float, radius: float, word: int) -> None:
    """Write a square of twice the radius; of its border, the right and the lower side belong to it.

    Shapes  keys: as for write_points. Units  across, down: its middle, where whole numbers are samples.
    """
    left, right = np.int64(max(np.floor(across - radius) + 1.0, 0.0)), np.int64(min(np.floor(across + radius), wide - 1.0))
    top, bottom = np.int64(max(np.floor(down - radius) + 1.0, 0.0)), np.int64(min(np.floor(down + radius), high - 1.0))
    for row in range(top, bottom + 1):
        base = np.uint64(row) * np.uint64(wide) + np.uint64(left)
        for i in range(right - left + 1):
            place = base + np.uint64(i)
            keys[place] = max(keys[place], word)


@bare_helper
def write_disc(keys: Int64Array, wide: float, high: float, across: float, down: float, radius: float, word: int) -> None:
    """Write a disc: all samples of its box are looked at, as that takes no branch and few vector instructions.

    A root that tells where each row begins and ends takes two to three times as long, for any radius from 1 to 20 pixels.
    """
    left, right = np.int64(max(np.ceil(across - radius), 0.0)), np.int64(min(np.floor(across + radius), wide - 1.0))
    top, bottom = np.int64(max(np.ceil(down - radius), 0.0)), np.int64(min(np.floor(down + radius), high - 1.0))
    start = np.float64(left) - across
    for row in range(top, bottom + 1):
        dy = np.float64(row) - down
        room = radius * radius - dy * dy
        base = np.uint64(row) * np.uint64(wide) + np.uint64(left)
        for i in range(right - left + 1):
            place, dx = base + np.uint64(i), start + np.float64(i)
            keys[place] = max(keys[place], word if dx * dx <= room else EMPTY_KEY)


@bare_helper
def write_small_disc(keys: Int64Array, wide: float, across: float, down: float, radius: float, word: int) -> None:
    """Write a disc of less than 1.5 pixels in its window of 3 x 3, all of which lies in the image, a third faster."""
    column, row = np.floor(across + 0.5) - 1.0, np.floor(down + 0.5) - 1.0
    base = np.uint64(row) * np.uint64(wide) + np.uint64(column)
    start, dy = column - across, row - down
    for _ in range(3):
        room = radius * radius - dy * dy
        for i in range(3):
            place, dx = base + np.uint64(i), start + np.float64(i)
            keys[place] = max(keys[place], word if dx * dx <= room else EMPTY_KEY)
        base += np.uint64(wide)
        dy += 1.0


@bare_kernel
def write_splats(
    keys: Int64Array, width: int, height: int, least: float, positions: Array, blocks: Int64Array, origins: Float64Array,
    steps: Float64Array, matrices: Float64Array, places: Float64Array, words: Int64Array, shares: Array, radii: Float64Array,
    most: float, is_disc: bool,
) -> None:  # fmt: skip
    """Write splats with a radius: discs, or squares of twice the radius.

    A disc covers the samples within its radius, and as a square that of its border on the right and below. A splat whose middle
    is in the image covers at least the pixel it lies in. It has one depth.

    Shapes  as for write_points, and shares: (N,) of each splat in the radius of its block, or (0,) for 1; radii: (B, 2).
    Units   radius in pixels = radii[b, 0] + radii[b, 1] * share / w, and at most `most`.
    """
    wide, high = np.float64(width), np.float64(height)
    has_shares = shares.shape[0] > 0
    for b in range(blocks.shape[0]):
        start, count, number = blocks[b, 0], blocks[b, 1], blocks[b, 2]
        m, fixed, scale = fold_map(matrices[blocks[b, 3]], origins[b], steps[b]), radii[b, 0], radii[b, 1]
        for first in range(0, count, BLOCK):
            n = min(count - first, BLOCK)
            take_apart(positions, start + first, n, places)
            for i in range(n):
                places[3, np.uint64(i)] = 1.0
            if has_shares:
                for i in range(n):
                    places[3, np.uint64(i)] = np.float64(shares[np.uint64(start + first + i)])

            # Find the middle, radius and word of each; what is not seen gets a radius below 0.
            for i in range(n):
                q = np.uint64(i)
                fits, u, v, depth, inverse = project(m, places[0, q], places[1, q], places[2, q], least)
                radius = max(fixed + scale * places[3, q] * inverse, 0.5)
                radius = min(radius, most)
                fits &= (u + radius > 0.0) & (u - radius < wide) & (v + radius > 0.0) & (v - radius < high)
                places[0, q], places[1, q] = (u if fits else 0.0), (v if fits else 0.0)
                places[3, q] = radius if fits else -1.0
                words[1, q] = pack_key(depth, number + first + i)

            # Write the pixel that each lies in, then its rows.
            for i in range(n):
                q = np.uint64(i)
                u, v, radius, word = places[0, q], places[1, q], places[3, q], words[1, q]
                if radius < 0.0:
                    continue
                if (u >= 0.0) & (u < wide) & (v >= 0.0) & (v < high):
                    place = np.uint64(v) * np.uint64(width) + np.uint64(u)
                    keys[place] = max(keys[place], word)
                if radius <= 0.5:
                    continue
                across, down = u - 0.5, v - 0.5
                if not is_disc:
                    write_square(keys, wide, high, across, down, radius, word)
                elif (radius < 1.5) & (u >= 1.0) & (u < wide - 1.0) & (v >= 1.0) & (v < high - 1.0):
                    write_small_disc(keys, wide, across, down, radius, word)
                else:
                    write_disc(keys, wide, high, across, down, radius, word)


def draw_splats(
    keys: Int64Array, size: tuple[int, int], positions: Array, blocks: Int64Array, origins: Float64Array, steps: Float64Array,
    matrices: Float64Array, *, radii: Float64Array | None = None, shares: Array | None = None, shape: str = "disc",
    most: float = MOST, has_far: bool = False, threads: int = 1,
) -> None:  # fmt: skip
    """Write splats into keys; the same keys for any order of the blocks and any number of threads.

    Parameters
    ----------
    keys : (height * width + PAD,) from `new_keys`; the nearest stays, of equals the one with the lower number.
    size : (width, height) in pixels.
    positions : (N, 3) integers or floats of any type, C-contiguous.
    blocks : (B, 4) int64, for each block its first splat, how many it has, the number of the first, and its row of `matrices`.
    origins, steps : (B, 3) float64, world = origin + step * stored.
    matrices : (K, 4, 4) float64 from `pixel_matrix`.
    radii : (B, 2) float64; a splat's radius in pixels is radii[b, 0] + radii[b, 1] * share / w. None is one pixel for each.
    shares : (N,) uint8 or float32, the share of each splat in the radius of its block; None is 1.
    shape : "disc" or "square".
    most : pixels, the largest radius that is drawn.
    has_far : whether what lies beyond z = w is left out.
    threads : how many share the blocks.
    """
    least, flat = 0.0 if has_far else FARTHEST, positions.reshape(-1)
    share = np.empty(0, np.uint8) if shares is None else shares

    def draw(layer: Int64Array, first: int, last: int, stop: Event) -> None:
        """Write some blocks, in chunks so that an interrupt is noticed between them."""
        places, words = make_room()
        for start in range(first, last, BLOCKS):
            if stop.is_set():
                return
            part = slice(start, min(start + BLOCKS, last))
            shared = (layer, *size, least, flat, blocks[part], origins[part], steps[part], matrices, places, words)
            if radii is None:
                write_points(*shared)
            else:
                write_splats(*shared, share, radii[part], most, shape == "disc")

    layers = min(threads, 1 + LAYER_BYTES // keys.nbytes) if int(blocks[:, 1].sum()) >= SHARED else 1
    draw_layers(draw, keys, len(blocks), layers)


def cut_blocks(count: int, first: int = 0, number: int = 0, row: int = 0) -> Int64Array:
    """Return blocks of FLAT splats or fewer, which stand one after the other from `first` on: (B, 4) int64."""
    starts = np.arange(0, count, FLAT)
    counts = np.minimum(count - starts, FLAT)
    return np.stack([starts + first, counts, starts + number, np.full(len(starts), row)], axis=1)


def make_room() -> tuple[Float64Array, Int64Array]:
    """Return the room that a kernel works in: `places` and `words`."""
    return np.empty((4, BLOCK)), np.empty((2, BLOCK), np.int64)


def new_keys(size: tuple[int, int]) -> Int64Array:
    """Return keys of an empty image, row after row, with some more for what lies outside, (height * width + PAD,)."""
    return np.full(size[0] * size[1] + PAD, EMPTY_KEY)


def pixel_matrix(clip: Float64Array, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> Float64Array:
    """Return the (4, 4) matrix from the world to (u w, v w, depth w, w): the sample (i, j) takes what has floor(u, v) = (i, j).

    Parameters
    ----------
    clip : (4, 4), world to clip coordinates.
    size : (width, height) in pixels.
    offset : the sample's place in the pixel, in pixels.
    """
    width, height = size
    x, y, z, w = np.asarray(clip, np.float64)
    found = np.empty((4, 4))
    found[0] = (x + w) * (width / 2) + (0.5 - offset[0]) * w
    found[1] = (w - y) * (height / 2) + (0.5 - offset[1]) * w
    found[2], found[3] = (w - z) / 2, w
    return found
