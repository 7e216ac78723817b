"""Barycentric weights of the visible samples of a row, in lanes: look up each triangle once, then weigh all samples together.

Small triangles lie all over the memory, so what a sample costs is the time until its corners have arrived. A row is cut into
runs of one triangle. What is needed of it is kept as a record in a ring, in the order in which rows show them, and a table
that hashes triangles' numbers tells which have one; so a triangle is fetched once, though several rows show it. Loops that only
copy have dozens of fetches under way at once. The last loop has no branch and no look-up, so the compiler turns it into vector
instructions, divisions included (docs/decisions/0015-frames.md has the measurements).

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

LANES = 256  # samples at a time; their numbers take 20 KiB, and stay in the first-level cache
NEAR = 2.0**25  # sub-pixels
RING = np.int64(1 << 13)  # records kept: those that the last rows of a picture show; LANES of them are written at a time
HASHES = np.int64(1 << 14)
LONG = 6  # samples of a run, from which on runs are worth a loop of their own

# Numbers of a record: x and y of the first corner; of the second and the third from there; w of each; and 1 where the triangle
# is to be weighed by `weigh_sample`. The lanes have a row for each; the weights take the place
# of the first three.
SECOND, THIRD, CORNER_W, IS_ODD, FIELDS = 2, 4, 6, 9, 10

# Rows of LANES whole numbers: the triangle of each run, and its record; the run of each sample, and where these are short, its
# record; the first samples of runs that need a record; their corners; and where
# runs begin and the last ends, in a row that is longer by one.
NUMBER, RECORD, RUN, AT, FRESH, CORNER, FIRST, SCRATCH = 0, 1, 2, 3, 4, 5, 8, 9


class Records(NamedTuple):
    """What is kept from row to row."""

    lanes: Float64Array  # (FIELDS x LANES,)
    scratch: Int64Array  # (SCRATCH x LANES + 1,)
    kept: Float64Array  # (RING x FIELDS,)
    tags: Int64Array  # (HASHES x 2,) the triangle that has this hash, and how many records came before its own


@inline_kernel
def make_records() -> Records:
    """Return empty records."""
    return Records(
        np.empty(FIELDS * LANES),
        np.empty(SCRATCH * LANES + 1, np.int64),
        np.empty(RING * FIELDS),
        np.full(2 * HASHES, -1, np.int64),
    )


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
def find_covered(slots: Int32Array, j: Integer, places: Int32Array) -> Integer:
    """List the columns of row j in which something is visible, and return how many there are."""
    count = np.int64(0)
    for i in range(slots.shape[1]):
        places[count] = i
        count += np.int64(slots[j, i] >= 0)
    return count


@bare_part
def find_runs(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, count: Integer, scratch: Int64Array
) -> Integer:
    """Cut some samples of a row into runs of one triangle, and return how many."""
    run, before = np.int64(-1), np.int64(-1)
    scratch[FIRST * LANES] = 0
    for k in range(count):
        n = np.int64(slots[j, places[start + k]])
        run += np.int64(n != before)
        scratch[np.uint64(NUMBER * LANES + run)] = n
        scratch[RUN * LANES + k] = run
        scratch[np.uint64(FIRST * LANES + 1 + run)] = k + 1
        before = n
    return run + 1


@bare_part
def find_records(scratch: Int64Array, runs: Integer, tags: Int64Array, before: Integer) -> Integer:
    """Tell each run its record, list those whose record is yet to be written, and return how many these are.

    Units   before: records that have been written.
    """
    fresh = np.int64(0)
    for r in range(runs):
        n = scratch[NUMBER * LANES + r]
        h = np.uint64(n & (HASHES - 1)) * np.uint64(2)
        there = tags[h + np.uint64(1)]
        is_known = (tags[h] == n) & (before + fresh - there < RING - LANES)
        record = there if is_known else before + fresh
        tags[h], tags[h + np.uint64(1)] = n, record
        scratch[RECORD * LANES + r] = record & (RING - 1)
        scratch[np.uint64(FRESH * LANES + fresh)] = scratch[FIRST * LANES + r]
        fresh += np.int64(not is_known)
    return fresh


@bare_part
def write_records(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, fresh: Integer, before: Integer, xy: Int64Array,
    clip: Float64Array, corners: Int32Array, scratch: Int64Array, kept: Float64Array,
) -> None:  # fmt: skip
    """Write the records of the triangles that are new."""
    for f in range(fresh):
        n = np.uint64(slots[j, places[start + scratch[FRESH * LANES + f]]])
        scratch[CORNER * LANES + f], scratch[(CORNER + 1) * LANES + f] = corners[n, 0], corners[n, 1]
        scratch[(CORNER + 2) * LANES + f] = corners[n, 2]
    for f in range(fresh):
        p, q = np.uint64(scratch[CORNER * LANES + f]), np.uint64(scratch[(CORNER + 1) * LANES + f])
        r = np.uint64(scratch[(CORNER + 2) * LANES + f])
        at = np.uint64(((before + f) & (RING - 1)) * FIELDS)
        p_x, p_y = xy[p, 0], xy[p, 1]
        q_x, q_y = np.float64(xy[q, 0] - p_x), np.float64(xy[q, 1] - p_y)
        r_x, r_y = np.float64(xy[r, 0] - p_x), np.float64(xy[r, 1] - p_y)
        kept[at], kept[at + np.uint64(1)] = np.float64(p_x), np.float64(p_y)
        kept[at + np.uint64(SECOND)], kept[at + np.uint64(SECOND + 1)] = q_x, q_y
        kept[at + np.uint64(THIRD)], kept[at + np.uint64(THIRD + 1)] = r_x, r_y
        kept[at + np.uint64(CORNER_W)], kept[at + np.uint64(CORNER_W + 1)] = clip[p, 3], clip[q, 3]
        kept[at + np.uint64(CORNER_W + 2)] = clip[r, 3]
        reach = max(max(abs(q_x), abs(q_y)), max(abs(r_x), abs(r_y)))
        kept[at + np.uint64(IS_ODD)] = 1.0 if reach >= NEAR else 0.0


@bare_part
def mark_odd(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, fresh: Integer, before: Integer, piece: Int32Array,
    inner: UInt8Array, scratch: Int64Array, kept: Float64Array,
) -> None:  # fmt: skip
    """Mark the new records of triangles that are cut, and of polygons."""
    for f in range(fresh):
        n = slots[j, places[start + scratch[FRESH * LANES + f]]]
        if piece[n] >= 0 or inner[n] != 0:
            kept[((before + f) & (RING - 1)) * FIELDS + IS_ODD] = 1.0


@bare_part
def copy_records(scratch: Int64Array, kept: Float64Array, runs: Integer, count: Integer, lanes: Float64Array) -> None:
    """Copy the record of each sample into the lanes: run by run where runs are long, else sample by sample."""
    if runs * LONG <= count:
        for r in range(runs):
            first, end = scratch[FIRST * LANES + r], scratch[FIRST * LANES + r + 1]
            at = scratch[RECORD * LANES + r] * FIELDS
            for field in range(FIELDS):
                value = kept[at + field]
                for k in range(field * LANES + first, field * LANES + end):
                    lanes[np.uint64(k)] = value
    else:
        for k in range(count):
            record = scratch[np.uint64(RECORD * LANES + scratch[RUN * LANES + k])]
            scratch[AT * LANES + k] = record
            at = np.uint64(record * FIELDS)
            for field in range(FIELDS):
                lanes[field * LANES + k] = kept[at + np.uint64(field)]


@bare_part
def weigh_lanes(
    places: Int32Array, start: Integer, count: Integer, sample_x: Integer, y: Integer, s: Integer, lanes: Float64Array
) -> bool:
    """Overwrite the first three rows with the weights, and say whether any of them has to be weighed by itself."""
    any_odd_one, height = False, np.float64(y)
    for k in range(count):
        p_x = lanes[k] - np.float64((np.int64(places[start + k]) << s) + sample_x)
        p_y, q_x, q_y = lanes[LANES + k] - height, lanes[SECOND * LANES + k], lanes[(SECOND + 1) * LANES + k]
        r_x, r_y = lanes[THIRD * LANES + k], lanes[(THIRD + 1) * LANES + k]
        any_odd_one |= lanes[IS_ODD * LANES + k] != 0.0

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
    return any_odd_one


@bare_part
def any_odd(weights: Float64Array, inner: UInt8Array) -> bool:
    """Say whether any triangle is a piece of one, or is not weighed by its corners as they are."""
    bits = np.uint8(0)
    for n in range(inner.shape[0]):
        bits |= inner[n]
    return weights.shape[0] > 0 or bool(bits != 0)


@bare_part
def weigh_row(
    slots: Int32Array, j: Integer, places: Int32Array, start: Integer, count: Integer, triangles: ScreenTriangles,
    sample_x: Integer, y: Integer, s: Integer, has_odd: bool, records: Records, before: Integer,
) -> tuple[Integer, Integer]:  # fmt: skip
    """Put the weights of at most LANES visible samples of row j into the first three rows of lanes.

    Return how many runs there are, and how many of the records are new.

    Shapes  slots: (h, W), row of triangles.corners or -1; places: (W,), the columns, of which `count` are wanted from `start`
            on; has_odd: any_odd of the triangles; before: how many records have been written, all for these triangles.
    Units   sample_x: sub-pixels from a pixel's corner; y: of the row's samples, in sub-pixels.
    """
    xy, clip, corners = triangles.xy, triangles.clip, triangles.corners
    piece, weights, inner = triangles.piece, triangles.weights, triangles.inner
    lanes, scratch, kept = records.lanes, records.scratch, records.kept
    runs = find_runs(slots, j, places, start, count, scratch)
    fresh = find_records(scratch, runs, records.tags, before)
    write_records(slots, j, places, start, fresh, before, xy, clip, corners, scratch, kept)
    if has_odd:
        mark_odd(slots, j, places, start, fresh, before, piece, inner, scratch, kept)
    copy_records(scratch, kept, runs, count, lanes)

    # Weigh one by one what is far, or cut, or a polygon.
    if weigh_lanes(places, start, count, sample_x, y, s, lanes):
        for k in range(count):
            if lanes[IS_ODD * LANES + k] != 0.0:
                n = slots[j, places[start + k]]
                x = (np.int64(places[start + k]) << s) + sample_x
                lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = weigh_sample(
                    xy, clip, corners, piece, weights, inner, n, x, y
                )  # fmt: skip
    return runs, fresh
