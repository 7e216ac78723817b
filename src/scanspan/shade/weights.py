"""Barycentric weights of visible samples, in lanes: look up each triangle once, then weigh many samples together.

Small triangles lie all over the memory, so what a sample costs is the time until its corners have arrived. The picture is
taken in blocks, whose triangles share corners, and a block's samples are cut into runs of one triangle. What is needed of it
is kept as a record in a ring, and a table that hashes triangles' numbers tells which have one; so a triangle is fetched once,
though several rows show it. All new records of a block are written together, in loops that only copy and have dozens of
fetches under way at once. The last loop has no branch and no look-up, so the compiler turns it into vector instructions,
divisions included (docs/decisions/0015-frames.md has the measurements).

A weight is max(E_k, 0) / w_k over the sum of the three, as `weigh_sample` has it; that is the slow way, which knows pieces of
clipped triangles and corners that are far away, and is taken for these. For all others coordinates are counted from the first
corner, and below 2^25 sub-pixels edge values are exact in float64: the same bits.

Source: Heckbert and Moreton 1991.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.geometry.depth_plane import UNCUT
from scanspan.geometry.fixed_point import halves_float, product_halves
from scanspan.geometry.outlines import REACHES_OUT
from scanspan.jit import bare_part, helper_kernel, inline_kernel
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, ScreenTriangles, UInt8Array

BLOCK_COLUMNS, BLOCK_ROWS = np.int64(64), np.int64(16)  # samples
LANES = 256  # samples that are weighed together; their numbers take 18 KiB, and stay in the first-level cache
NEAR = 2.0**25  # sub-pixels
RING = np.int64(1 << 12)  # records kept, many more than a block may write; they stay in the second-level cache
HASHES = np.int64(1 << 13)
LONG = 6  # samples of a run, from which on runs are worth a loop of their own

# Numbers of a record: x and y of the first corner; of the second and the third from there; w of each; and 1 where the triangle
# is to be weighed by `weigh_sample`. The lanes have a row for each but the last; weights take the place of the first three.
SECOND, THIRD, CORNER_W, IS_ODD, FIELDS = 2, 4, 6, 9, 10

# Rows of ROOM whole numbers. For each sample of a block: its place, which is its row times 2^32 and its column; its number
# in the picture; its triangle; and its run. For each run: its triangle, its record, and its first sample. Then the new
# triangles, and their corners.
PLACE, PIXEL, SHOWN, RUN, NUMBER, RECORD, FIRST, FRESH, CORNER, SCRATCH = 0, 1, 2, 3, 4, 5, 6, 7, 8, 11
ROOM = 64 * 16 + 8
COLUMN_MASK = np.int64((1 << 32) - 1)


class Records(NamedTuple):
    """What is kept from block to block."""

    lanes: Float64Array  # (IS_ODD x LANES,)
    scratch: Int64Array  # (SCRATCH x ROOM,)
    kept: Float64Array  # (RING x FIELDS,)
    tags: Int64Array  # (HASHES x 2,) the triangle that has this hash, and how many records came before its own


@inline_kernel
def make_records() -> Records:
    """Return empty records."""
    return Records(
        np.empty(IS_ODD * LANES), np.empty(SCRATCH * ROOM, np.int64), np.empty(RING * FIELDS), np.full(2 * HASHES, -1, np.int64)
    )  # fmt: skip


@helper_kernel
def edge_value(a_x: Integer, a_y: Integer, b_x: Integer, b_y: Integer, x: Integer, y: Integer) -> float:
    """Return the value of the edge from a to b at a sample."""
    high, low = product_halves(a_y - b_y, b_x - a_x, x - a_x, y - a_y)
    return halves_float(high, low)


@helper_kernel
def line_weight(weights: Float64Array, m: Integer, k: int, x: Integer, y: Integer) -> float:
    """Return what the share of corner k of a triangle that is not clipped is proportional to, at a sample."""
    weight: float = (weights[m, k, 0] * np.float64(x) + weights[m, k, 1] * np.float64(y)) + weights[m, k, 2]
    return weight


@bare_part
def weigh_sample(
    xy: Int64Array, clip: Float64Array, corners: Int32Array, piece: Int32Array, weights: Float64Array, inner: UInt8Array,
    n: Integer, x: Integer, y: Integer,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the weights of the source triangle's corners at a sample.

    Shapes  the fields of ScreenTriangles; n: the row that is visible there.
    Units   x, y in sub-pixels.
    """
    # Weigh the corners by the edge values opposite them.
    p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
    m = piece[n]
    if inner[n] & UNCUT:
        e0, e1, e2 = line_weight(weights, m, 0, x, y), line_weight(weights, m, 1, x, y), line_weight(weights, m, 2, x, y)
        w_p, w_q, w_r = 1.0, 1.0, 1.0
    else:
        e0 = edge_value(xy[q, 0], xy[q, 1], xy[r, 0], xy[r, 1], x, y)
        e1 = edge_value(xy[r, 0], xy[r, 1], xy[p, 0], xy[p, 1], x, y)
        e2 = edge_value(xy[p, 0], xy[p, 1], xy[q, 0], xy[q, 1], x, y)
        w_p, w_q, w_r = clip[p, 3], clip[q, 3], clip[r, 3]

    # Turn a clockwise triangle's signs round. A pixel that is touched beside its centre takes the triangle's border.
    turn = -1.0 if (e0 + e1) + e2 < 0.0 else 1.0
    low = -np.inf if inner[n] & REACHES_OUT else 0.0
    w0, w1, w2 = max(turn * e0, low) / w_p, max(turn * e1, low) / w_q, max(turn * e2, low) / w_r
    total = (w0 + w1) + w2
    w0, w1, w2 = w0 / total, w1 / total, w2 / total

    # Carry the weights of a piece over to its source.
    if m >= 0 and inner[n] & UNCUT == 0:
        return (
            (w0 * weights[m, 0, 0] + w1 * weights[m, 1, 0]) + w2 * weights[m, 2, 0],
            (w0 * weights[m, 0, 1] + w1 * weights[m, 1, 1]) + w2 * weights[m, 2, 1],
            (w0 * weights[m, 0, 2] + w1 * weights[m, 1, 2]) + w2 * weights[m, 2, 2],
        )
    return w0, w1, w2


@bare_part
def find_covered(
    slots: Int32Array, seen: Int32Array, row: Integer, row_end: Integer, column: Integer, column_end: Integer,
    scratch: Int64Array,
) -> Integer:  # fmt: skip
    """List the samples of a block in which something is visible, and return how many there are.

    Shapes  slots: (h, W); seen: (h W,), the same.
    """
    count, pixel, shown = np.uint64(0), np.uint64(PIXEL * ROOM), np.uint64(SHOWN * ROOM)
    first, end = np.uint64(column), np.uint64(column_end)
    for j in range(row, row_end):
        # Leave out a row in which there is nothing; whether there is takes a vector instruction for sixteen samples.
        start, high = np.uint64(j * slots.shape[1]), np.int32(-1)
        for i in range(start + first, start + end):
            high = max(high, seen[i])
        if high >= 0:
            place = np.int64(j) << 32
            for i in range(first, end):
                n = np.int64(seen[start + np.uint64(i)])
                scratch[count], scratch[pixel + count] = place + np.int64(i), np.int64(start + np.uint64(i))
                scratch[shown + count] = n
                count += np.uint64(n >= 0)
    return np.int64(count)


@bare_part
def find_runs(count: Integer, scratch: Int64Array) -> Integer:
    """Cut the samples of a block into runs of one triangle, and return how many."""
    run, before = np.int64(-1), np.int64(-1)
    for k in range(count):
        n = scratch[SHOWN * ROOM + k]
        run += np.int64(n != before)
        scratch[np.uint64(NUMBER * ROOM + run)] = n
        scratch[RUN * ROOM + k] = run
        scratch[np.uint64(FIRST * ROOM + 1 + run)] = k + 1
        before = n
    scratch[FIRST * ROOM] = 0
    return run + 1


@bare_part
def find_records(scratch: Int64Array, runs: Integer, tags: Int64Array, before: Integer) -> Integer:
    """Tell each run its record, list the triangles whose record is yet to be written, and return how many these are.

    Units   before: records that have been written.
    """
    fresh = np.int64(0)
    for r in range(runs):
        n = scratch[NUMBER * ROOM + r]
        h = np.uint64(n & (HASHES - 1)) * np.uint64(2)
        there = tags[h + np.uint64(1)]
        is_known = (tags[h] == n) & (before + fresh - there < RING - ROOM)
        record = there if is_known else before + fresh
        tags[h], tags[h + np.uint64(1)] = n, record
        scratch[RECORD * ROOM + r] = record & (RING - 1)
        scratch[np.uint64(FRESH * ROOM + fresh)] = n
        fresh += np.int64(not is_known)
    return fresh


@bare_part
def write_records(
    fresh: Integer, before: Integer, xy: Int64Array, clip: Float64Array, corners: Int32Array, scratch: Int64Array,
    kept: Float64Array,
) -> bool:  # fmt: skip
    """Write the records of the triangles that are new, and say whether any is too far to be weighed with others."""
    for f in range(fresh):
        n = np.uint64(scratch[FRESH * ROOM + f])
        scratch[CORNER * ROOM + f], scratch[(CORNER + 1) * ROOM + f] = corners[n, 0], corners[n, 1]
        scratch[(CORNER + 2) * ROOM + f] = corners[n, 2]
    any_far = False
    for f in range(fresh):
        p, q = np.uint64(scratch[CORNER * ROOM + f]), np.uint64(scratch[(CORNER + 1) * ROOM + f])
        r = np.uint64(scratch[(CORNER + 2) * ROOM + f])
        at = np.uint64(((before + f) & (RING - 1)) * FIELDS)
        p_x, p_y = xy[p, 0], xy[p, 1]
        q_x, q_y = np.float64(xy[q, 0] - p_x), np.float64(xy[q, 1] - p_y)
        r_x, r_y = np.float64(xy[r, 0] - p_x), np.float64(xy[r, 1] - p_y)
        kept[at], kept[at + np.uint64(1)] = np.float64(p_x), np.float64(p_y)
        kept[at + np.uint64(SECOND)], kept[at + np.uint64(SECOND + 1)] = q_x, q_y
        kept[at + np.uint64(THIRD)], kept[at + np.uint64(THIRD + 1)] = r_x, r_y
        kept[at + np.uint64(CORNER_W)], kept[at + np.uint64(CORNER_W + 1)] = clip[p, 3], clip[q, 3]
        kept[at + np.uint64(CORNER_W + 2)] = clip[r, 3]
        is_far = bool(max(max(abs(q_x), abs(q_y)), max(abs(r_x), abs(r_y))) >= NEAR)
        kept[at + np.uint64(IS_ODD)] = 1.0 if is_far else 0.0
        any_far |= is_far
    return any_far


@bare_part
def mark_odd(
    fresh: Integer, before: Integer, piece: Int32Array, inner: UInt8Array, scratch: Int64Array, kept: Float64Array
) -> None:
    """Mark the new records of triangles that are cut, and of polygons."""
    for f in range(fresh):
        n = scratch[FRESH * ROOM + f]
        if piece[n] >= 0 or inner[n] != 0:
            kept[((before + f) & (RING - 1)) * FIELDS + IS_ODD] = 1.0


@bare_part
def fetch_block(
    slots: Int32Array, seen: Int32Array, row: Integer, column: Integer, triangles: ScreenTriangles, has_odd: bool,
    records: Records, before: Integer,
) -> tuple[Integer, Integer, Integer, bool]:  # fmt: skip
    """List what is visible in a block, and write the records that are missing.

    Return how many samples and runs there are, how many of the records are new, and whether any record is odd so far.

    Shapes  slots: (h, W), row of triangles.corners or -1; seen: (h W,), the same; has_odd: any_odd of the triangles, or what
            the last call said; before: how many records have been written, all for these triangles.
    """
    scratch, kept = records.scratch, records.kept
    row_end, column_end = min(row + BLOCK_ROWS, slots.shape[0]), min(column + BLOCK_COLUMNS, slots.shape[1])
    count = find_covered(slots, seen, row, row_end, column, column_end, scratch)
    runs = find_runs(count, scratch)
    fresh = find_records(scratch, runs, records.tags, before)
    any_far = write_records(fresh, before, triangles.xy, triangles.clip, triangles.corners, scratch, kept)
    if has_odd:
        mark_odd(fresh, before, triangles.piece, triangles.inner, scratch, kept)
    return count, runs, fresh, has_odd | any_far


@bare_part
def copy_runs(scratch: Int64Array, kept: Float64Array, start: Integer, end: Integer, lanes: Float64Array) -> None:
    """Copy the records of some samples into the lanes, run by run."""
    r, last = scratch[RUN * ROOM + start], scratch[RUN * ROOM + end - 1]
    while r <= last:
        first, final = max(scratch[FIRST * ROOM + r], start) - start, min(scratch[FIRST * ROOM + r + 1], end) - start
        at = scratch[RECORD * ROOM + r] * FIELDS
        for field in range(IS_ODD):
            value = kept[at + field]
            for k in range(field * LANES + first, field * LANES + final):
                lanes[np.uint64(k)] = value
        r += 1


@bare_part
def copy_samples(scratch: Int64Array, kept: Float64Array, start: Integer, count: Integer, lanes: Float64Array) -> None:
    """Copy the records of some samples into the lanes, sample by sample."""
    for k in range(count):
        at = np.uint64(scratch[np.uint64(RECORD * ROOM + scratch[RUN * ROOM + start + k])] * FIELDS)
        for field in range(IS_ODD):
            lanes[field * LANES + k] = kept[at + np.uint64(field)]


@bare_part
def weigh_lanes(
    scratch: Int64Array, start: Integer, count: Integer, sample_x: Integer, sample_y: Integer, s: Integer, lanes: Float64Array
) -> None:
    """Overwrite the first three rows with the weights."""
    for k in range(count):
        place = scratch[PLACE * ROOM + start + k]
        p_x = lanes[k] - np.float64(((place & COLUMN_MASK) << s) + sample_x)
        p_y = lanes[LANES + k] - np.float64(((place >> 32) << s) + sample_y)
        q_x, q_y = lanes[SECOND * LANES + k], lanes[(SECOND + 1) * LANES + k]
        r_x, r_y = lanes[THIRD * LANES + k], lanes[(THIRD + 1) * LANES + k]

        # Take two of the edges at the first corner, and the third from the area. Adding 0.0 makes -0.0 into 0.0.
        e1, e2 = (r_x * p_y - r_y * p_x) + 0.0, (p_x * q_y - p_y * q_x) + 0.0
        area = q_x * r_y - q_y * r_x
        e0 = (area - e1) - e2
        turn = -1.0 if area < 0.0 else 1.0
        w0 = max(turn * e0, 0.0) / lanes[CORNER_W * LANES + k]
        w1 = max(turn * e1, 0.0) / lanes[(CORNER_W + 1) * LANES + k]
        w2 = max(turn * e2, 0.0) / lanes[(CORNER_W + 2) * LANES + k]
        total = (w0 + w1) + w2
        lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = w0 / total, w1 / total, w2 / total


@bare_part
def any_odd(weights: Float64Array, inner: UInt8Array) -> bool:
    """Say whether any triangle is a piece of one, or is not weighed by its corners as they are."""
    bits = np.uint8(0)
    for n in range(inner.shape[0]):
        bits |= inner[n]
    return weights.shape[0] > 0 or bool(bits != 0)


@bare_part
def weigh_samples(
    start: Integer, count: Integer, is_long: bool, triangles: ScreenTriangles, sample_x: Integer, sample_y: Integer, s: Integer,
    has_odd: bool, records: Records,
) -> None:  # fmt: skip
    """Put the weights of some samples of a block, at most LANES, into the first three rows of lanes.

    Shapes  is_long: whether the block's runs are worth a loop of their own; has_odd: from fetch_block.
    Units   sample_x, sample_y: sub-pixels from the corner of a pixel, counted from the first of the slots.
    """
    lanes, scratch, kept = records.lanes, records.scratch, records.kept
    if is_long:
        copy_runs(scratch, kept, start, start + count, lanes)
    else:
        copy_samples(scratch, kept, start, count, lanes)
    weigh_lanes(scratch, start, count, sample_x, sample_y, s, lanes)

    # Weigh one by one what is far, or cut, or a polygon.
    for k in range(count if has_odd else np.int64(0)):
        if kept[scratch[RECORD * ROOM + scratch[RUN * ROOM + start + k]] * FIELDS + IS_ODD] != 0.0:
            place = scratch[PLACE * ROOM + start + k]
            x, y = ((place & COLUMN_MASK) << s) + sample_x, ((place >> 32) << s) + sample_y
            lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = weigh_sample(
                triangles.xy, triangles.clip, triangles.corners, triangles.piece, triangles.weights, triangles.inner,
                scratch[SHOWN * ROOM + start + k], x, y,
            )  # fmt: skip
