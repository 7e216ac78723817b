"""Gaussian splats: the colours of all splats that lie close behind the nearest are added up, by a weight that falls off.

A first run writes keys, as for discs; this one goes over all splats again, and a splat counts at a sample if it would be the
nearest there once moved towards the eye by a multiple of its radius. So splats of one surface blend, and what lies behind it
does not shine through. Light and weights are whole numbers, whose sums are the same in any order and for any number of threads.

The weight is (1 - d^2 / r^2)^2 at a distance d: near a Gaussian, but it ends at the radius, and needs no exponential.

Source: M. Botsch, A. Hornung, M. Zwicker, L. Kobbelt, High-Quality Surface Splatting on Today's GPUs (2005), for the two runs.
"""

from __future__ import annotations

from threading import Event

import numpy as np

from scanspan.jit import bare_kernel
from scanspan.raster.algorithms import LAYER_BYTES, SHARED, draw_layers
from scanspan.raster.splats import BLOCK, BLOCKS, FARTHEST, MOST, fold_map, make_room, project, take_apart
from scanspan.raster.write import EMPTY_KEY, unpack_depth
from scanspan.records import Array, Float64Array, Int64Array, UInt16Array

FINEST = 1023.0  # the largest weight; with light of 16 bits, 2^37 splats may lie at one sample
DEEP = 2.0  # radii between splats of one surface, at most


@bare_kernel
def sum_splats(
    sums: Int64Array, keys: Int64Array, width: int, height: int, least: float, positions: Array, blocks: Int64Array,
    origins: Float64Array, steps: Float64Array, matrices: Float64Array, places: Float64Array, shares: Array,
    radii: Float64Array, most: float, light: UInt16Array, towards: Float64Array,
) -> None:  # fmt: skip
    """Add up light and weights.

    Shapes  sums: (height * width or more, 5), four of light and the weight; keys: of the same splats; light: (N, 4); towards:
            (3,) by how much depth w and w change with a step of 1 towards the eye, and the length of a step for each pixel of
            radius, at w = 1; others as for write_splats.
    """
    wide, high = np.float64(width), np.float64(height)
    has_shares, by_depth, by_w, length = shares.shape[0] > 0, towards[0], towards[1], towards[2]
    for b in range(blocks.shape[0]):
        start, count = blocks[b, 0], blocks[b, 1]
        m, fixed, scale = fold_map(matrices[blocks[b, 3]], origins[b], steps[b]), radii[b, 0], radii[b, 1]
        for first in range(0, count, BLOCK):
            n = min(count - first, BLOCK)
            take_apart(positions, start + first, n, places)
            for i in range(n):
                q, k = np.uint64(i), np.uint64(start + first + i)
                fits, u, v, depth, inverse = project(m, places[0, q], places[1, q], places[2, q], least)
                share = np.float64(shares[k]) if has_shares else 1.0
                radius = min(max(fixed + scale * share * inverse, 0.5), most)
                fits &= (u + radius > 0.0) & (u - radius < wide) & (v + radius > 0.0) & (v - radius < high)
                if not fits:
                    continue

                # Move it towards the eye; past the eye, it is before everything.
                step = length * radius
                moved = (depth + step * by_depth) / (1.0 + step * by_w) if 1.0 + step * by_w > 0.0 else 1.0
                across, down = u - 0.5, v - 0.5
                middle_x, middle_y = np.floor(u), np.floor(v)
                left = np.int64(max(min(np.ceil(across - radius), middle_x), 0.0))
                right = np.int64(min(max(np.floor(across + radius), middle_x), wide - 1.0))
                top = np.int64(max(min(np.ceil(down - radius), middle_y), 0.0))
                bottom = np.int64(min(max(np.floor(down + radius), middle_y), high - 1.0))
                for row in range(top, bottom + 1):
                    dy = np.float64(row) - down
                    for column in range(left, right + 1):
                        dx = np.float64(column) - across
                        is_covered = (radius > 0.5) & (dx * dx <= radius * radius - dy * dy)
                        is_covered |= (np.float64(column) == middle_x) & (np.float64(row) == middle_y)
                        place = np.uint64(row) * np.uint64(width) + np.uint64(column)
                        key = keys[place]
                        if not is_covered or key == EMPTY_KEY or np.float32(moved) < unpack_depth(key):
                            continue
                        room = max(1.0 - (dx * dx + dy * dy) / (radius * radius), 0.0)
                        weight = np.int64(room * room * FINEST) + np.int64(1)
                        for c in range(4):
                            sums[place, c] += weight * np.int64(light[k, c])
                        sums[place, 4] += weight


def blend_splats(
    keys: Int64Array, size: tuple[int, int], positions: Array, blocks: Int64Array, origins: Float64Array, steps: Float64Array,
    matrices: Float64Array, light: UInt16Array, towards: Float64Array, *, radii: Float64Array, shares: Array | None = None,
    most: float = MOST, has_far: bool = False, threads: int = 1, sums: Int64Array | None = None,
) -> Int64Array:  # fmt: skip
    """Return (height * width, 5) int64: the weighted sums of the light of splats, and of the weights, at each sample.

    Parameters
    ----------
    keys : what `draw_splats` wrote for these splats, and for all others of the picture.
    light : (N, 4) uint16, of each splat.
    towards : see `sum_splats`.
    sums : to be added to; they are given back.
    others : as for `draw_splats`.
    """
    least, flat = 0.0 if has_far else FARTHEST, positions.reshape(-1)
    share = np.empty(0, np.uint8) if shares is None else shares
    total = np.zeros((size[0] * size[1], 5), np.int64) if sums is None else sums

    def add(layer: Int64Array, first: int, last: int, stop: Event) -> None:
        """Add up some blocks, in chunks so that an interrupt is noticed between them."""
        places = make_room()[0]
        for begin in range(first, last, BLOCKS):
            if stop.is_set():
                return
            part = slice(begin, min(begin + BLOCKS, last))
            sum_splats(
                layer, keys, *size, least, flat, blocks[part], origins[part], steps[part], matrices, places, share,
                radii[part], most, light, towards,
            )  # fmt: skip

    layers = min(threads, 1 + LAYER_BYTES // total.nbytes) if int(blocks[:, 1].sum()) >= SHARED else 1
    draw_layers(add, total, len(blocks), layers, empty=0, merge=np.add)
    return total
