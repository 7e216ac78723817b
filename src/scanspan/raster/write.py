"""The only writers: one comparison, a verb for one sample of each kind of target, and a verb for a span.

A traversal opens a row of its target as a slice and hands samples to its writer; it knows nothing of depth formats or counts.
Five targets, each one array:

keys    (H, W) int64: depth as float32 in the upper half, mapped so that order is kept, and the complement of the triangle's
        number in the lower, so the nearest sample is the largest word. Writing is one maximum, without a branch.
pairs   (H, W, 2) float64: depth unrounded, and the number.
hits    (H, W) int32: how often each sample was covered; nothing hides anything.
tallies (H, W, 4) int64: a key, and how often the sample was tested, was covered, and was written.
layers  (H, W, 2) int64: a key, and the ceiling that it stays below, for what lies behind what was found before.

Writers select and do not branch: a branch in the loop can cost ten times, because it stops the compiler from using vector
instructions (docs/decisions/0001-the-seam.md).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel
from scanspan.raster.setup import depth_at
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, TriangleSetup

EMPTY_KEY = np.int64(-(1 << 63))  # below every key, as no depth maps there
NUMBER_MASK = np.int64((1 << 32) - 1)
KEY_STEP = np.int64(1 << 32)
MAGNITUDE = np.int32(0x7FFFFFFF)


@helper_kernel
def is_nearer(
    depth: float | np.float32, primitive: float, other_depth: float | np.float32, other_primitive: float
) -> bool | np.bool_:
    """Say whether the first of two samples hides the second: the larger depth, then the lower number.

    An empty sample has depth -inf, so everything hides it.
    """
    return (depth > other_depth) | ((depth == other_depth) & (primitive < other_primitive))


@helper_kernel
def pack_key(depth: float, number: Integer) -> Integer:
    """Return the word whose order is that of `is_nearer`: depth rounded once to float32, then the lower number.

    The bits of a positive float are ordered like integers; those of a negative one run backwards, so all but its sign are
    flipped. Adding 0.0 makes -0.0 into 0.0, which must compare equal to it.
    """
    bits = np.float32(depth + 0.0).view(np.int32)
    ordered = np.int64(bits ^ ((bits >> np.int32(31)) & MAGNITUDE))
    return ordered * KEY_STEP + (NUMBER_MASK - number)


@helper_kernel
def unpack_depth(key: Integer) -> np.float32:
    """Return the float32 depth of a key."""
    ordered = np.int32(key >> np.int64(32))
    return np.int32(ordered ^ ((ordered >> np.int32(31)) & MAGNITUDE)).view(np.float32)


@helper_kernel
def unpack_number(key: Integer) -> Integer:
    """Return the triangle's number of a key."""
    return NUMBER_MASK - (key & NUMBER_MASK)


@helper_kernel
def write_sample_key(row: Int64Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Write one sample of a row of keys."""
    key = pack_key(depth, number)
    row[q] = max(row[q], key if inside else EMPTY_KEY)


@helper_kernel
def write_sample_layer(row: Int64Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Write one sample of a row of layers."""
    key = pack_key(depth, number)
    row[q, 0] = max(row[q, 0], key if inside & (key < row[q, 1]) else EMPTY_KEY)


@helper_kernel
def write_sample_pair(row: Float64Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Write one sample of a row of pairs."""
    nearer = inside & is_nearer(depth, np.float64(number), row[q, 0], row[q, 1])
    row[q, 0] = depth if nearer else row[q, 0]
    row[q, 1] = np.float64(number) if nearer else row[q, 1]


@helper_kernel
def write_sample_hit(row: Int32Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Count one sample of a row of hits."""
    row[q] += np.int32(inside)


@helper_kernel
def write_sample_tally(row: Int64Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Write one sample of a row of tallies, and count what is done to it."""
    key = pack_key(depth, number)
    written = inside & (key > row[q, 0])
    row[q, 0] = key if written else row[q, 0]
    row[q, 1] += 1
    row[q, 2] += np.int64(inside)
    row[q, 3] += np.int64(written)


@inline_kernel
def write_span(
    write_sample: Callable[..., None], bound: Callable[..., tuple[bool, float]], row: Array, t: TriangleSetup,
    g1: Integer, g2: Integer, n: Integer,
) -> None:  # fmt: skip
    """Write a span, all of which is covered, but for what `bound` cuts off (keep_sample, bound_sample in setup.py).

    Shapes  row: a slice of a target; g1, g2: the two integers of the setup's depth at its first sample.
    """
    for i in range(row.shape[0]):
        inside, depth = bound(t, True, depth_at(t, g1 + i * t.g1_x, g2 + i * t.g2_x))
        write_sample(row, i, inside, depth, n)
