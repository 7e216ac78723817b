"""The colours of splats, found for those that are seen: each is shaded once, however many pixels show it.

First the numbers in the keys are marked, then the marked splats are gathered in lanes and lit, and at last every pixel looks up
the colour of its number. So a coarse picture shades fewer splats than it has pixels, and a fine one no more than pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.assets.splats.codec import Splats, decode_normals
from scanspan.color.transfer import STARTS
from scanspan.jit import kernel
from scanspan.raster.write import EMPTY_KEY, unpack_number
from scanspan.records import Array, Float32Array, Float64Array, Int64Array, UInt8Array
from scanspan.shade.cloud_colors import HEIGHTS
from scanspan.shade.color import LINEAR_FROM_SRGB8, THRESHOLDS
from scanspan.shade.light import Lights, light
from scanspan.shade.srgb import encode_value

ROW_BITS = 8  # of a number are the place in its block; the others are the row of the block in the cut
LIT_AT_ONCE = 4096  # splats: their lanes stay in the second-level cache


class BlockRows(NamedTuple):
    """Where the splats of the K blocks of a cut lie, and what their numbers mean."""

    start: Int64Array  # (K,) the first splat of each in the arrays of splats
    low: Float64Array  # (K, 3) a place is low + step * q
    step: Float64Array  # (K, 3)


@kernel
def mark_seen(keys: Int64Array, first: int, last: int, seen: UInt8Array) -> None:
    """Mark the numbers in some keys with 1.

    Shapes  keys: (n,); seen: one for each number.
    """
    for i in range(first, last):
        key = keys[np.uint64(i)]
        if key != EMPTY_KEY:
            seen[np.uint64(unpack_number(key))] = np.uint8(1)


@kernel
def gather_splats(
    numbers: Int64Array, rows: BlockRows, positions: Array, color: UInt8Array, codes: Array, eye: Float64Array,
    curve: Float32Array, base: Float32Array, bases: Float32Array, towards: Float32Array, found: Array,
) -> None:  # fmt: skip
    """Write the linear colour of some splats, the direction from each to the eye, and the code of its normal.

    Shapes  numbers: (n,); positions: (N, 3); color: (N, 3) or (0, 3); codes: (N,) or (0,); eye: (4,), w = 0 for a direction;
            curve: (256,); base: (4,), of splats without colour; bases: (n, 4), towards: (n, 3), found: (n,), written.
    """
    has_color, has_codes = color.shape[0] > 0, codes.shape[0] > 0
    for i in range(numbers.shape[0]):
        row = numbers[i] >> ROW_BITS
        k = np.uint64(rows.start[row] + (numbers[i] & ((1 << ROW_BITS) - 1)))
        if has_color:
            for c in range(3):
                bases[i, c] = curve[color[k, c]]
            bases[i, 3] = np.float32(1.0)
        else:
            for c in range(4):
                bases[i, c] = base[c]
        if has_codes:
            found[i] = codes[k]
            for c in range(3):
                place = rows.low[row, c] + rows.step[row, c] * positions[k, c]
                towards[i, c] = np.float32(eye[c] - place * eye[3])


@kernel
def encode_splats(
    numbers: Int64Array, bases: Float32Array, thresholds: Float32Array, starts: UInt8Array, colors: UInt8Array
) -> None:
    """Write the sRGB colours of some splats to their places in the table of all, (numbers, 4); all are opaque."""
    for i in range(numbers.shape[0]):
        n = np.uint64(numbers[i])
        for c in range(3):
            colors[n, c] = np.uint8(encode_value(bases[i, c], thresholds, starts))
        colors[n, 3] = np.uint8(255)


@kernel
def color_heights(
    numbers: Int64Array, rows: BlockRows, positions: Array, axis: Float64Array, low: float, scale: float, ramp: UInt8Array,
    colors: UInt8Array,
) -> None:  # fmt: skip
    """Write colours by height to the table of all.

    Shapes  axis: (3,), up; ramp: (256, 3). Units  a height h has the colour (h - low) * scale of the ramp.
    """
    for i in range(numbers.shape[0]):
        n, row = np.uint64(numbers[i]), numbers[i] >> ROW_BITS
        k, height = np.uint64(rows.start[row] + (numbers[i] & ((1 << ROW_BITS) - 1))), 0.0
        for c in range(3):
            height += axis[c] * (rows.low[row, c] + rows.step[row, c] * positions[k, c])
        place = np.int64(min(max((height - low) * scale, 0.0), 255.0))
        for c in range(3):
            colors[n, c] = ramp[place, c]
        colors[n, 3] = np.uint8(255)


@kernel
def darken_pixels(
    keys: Int64Array, first: int, last: int, width: int, factor: Float32Array, curve: Float32Array, thresholds: Float32Array,
    starts: UInt8Array, out: UInt8Array,
) -> None:  # fmt: skip
    """Lessen the light of the pixels in some rows that show something.

    Shapes  keys: (n,); factor: (n,); out: (n, 4), written.
    """
    for i in range(first * width, last * width):
        q = np.uint64(i)
        if keys[q] != EMPTY_KEY:
            for c in range(3):
                out[q, c] = np.uint8(encode_value(curve[out[q, c]] * factor[q], thresholds, starts))


@kernel
def paint_keys(keys: Int64Array, first: int, last: int, colors: Array, behind: Array, width: int, out: Array) -> None:
    """Write the colour of what each pixel shows, or the background.

    Shapes  keys: (n,); colors: (numbers,) uint32; behind: (H,) uint32, one a row; out: (n,) uint32.
    """
    for y in range(first, last):
        base, here = np.uint64(y) * np.uint64(width), behind[y]
        for x in range(width):
            i = base + np.uint64(x)
            key = keys[i]
            out[i] = here if key == EMPTY_KEY else colors[np.uint64(unpack_number(key))]


class Look(NamedTuple):
    """How splats are coloured: lit where they have normals, else as they are; by height without a colour of their own."""

    base: Float32Array  # (4,) the linear colour of splats with normals and without colour
    lights: Lights
    up: Float64Array  # (3,)
    low: float  # height of the lowest colour, in the tree's coordinates
    high: float


def shade_splats(
    numbers: Int64Array, rows: BlockRows, splats: Splats, eye: Float64Array, look: Look, colors: UInt8Array
) -> None:
    """Find the colours of some splats, and write them to the table of all.

    Parameters
    ----------
    numbers : (n,) of the splats.
    rows : where their blocks lie.
    splats : what was read.
    eye : (4,) as geometry/cut.py has it.
    look : how they are coloured.
    colors : (numbers, 4) uint8, written.
    """
    if not len(splats.color) and not len(splats.normal):
        scale = 256.0 / (look.high - look.low) if look.high > look.low else 0.0
        color_heights(numbers, rows, splats.positions, look.up, look.low, scale, HEIGHTS, colors)
        return
    for first in range(0, len(numbers), LIT_AT_ONCE):
        part = numbers[first : first + LIT_AT_ONCE]
        bases, towards = np.empty((len(part), 4), np.float32), np.empty((len(part), 3), np.float32)
        found = np.empty(len(part), np.uint16)
        gather_splats(
            part, rows, splats.positions, splats.color, splats.normal, eye, LINEAR_FROM_SRGB8, look.base, bases, towards, found
        )
        if len(splats.normal):
            normals = np.empty((len(part), 3), np.float32)
            decode_normals(found, normals)
            light(normals, bases, towards, look.lights, 1, bases)
        encode_splats(part, bases, THRESHOLDS, STARTS, colors)
