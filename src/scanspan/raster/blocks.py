"""Half-space rasterization of many triangles into keys: the setup of eight at a time, and boxes of one shape together.

A mesh of a million triangles has boxes of one to nine samples. One by one, most of the time of such a triangle goes into
branches that no processor can foresee: is the box empty, which corner is first, how many rows. So triangles are taken 64 at a
time and put into bins by the shape of their box, up to 4 x 4 samples. A bin that has enough of them is drawn as a whole: its
setups, then the first sample of all its boxes, then the second, each in one loop without a branch, which the compiler turns
into vector instructions. What is left for one at a time is the maximum that writes a key. Larger boxes have a bin of their own
and are scanned row by row, and the largest in layers.py, where what is hidden is left out.

Numbers are float64: of corners that lie within 2^24 sub-pixels of each other, all products are whole numbers below 2^50, exact,
and so are the steps from sample to sample. The expressions are those of setup.py, so the bits are the same. What is larger, or
has an outline, goes the way of half_space.py. Keys keep the largest: no order matters (docs/decisions/0015-frames.md).

Source: Pineda 1988; M. Abrash, Rasterization on Larrabee, 2009, for lanes and for doing without branches.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_kernel, helper_kernel, kernel
from scanspan.raster.edge import BOTTOM_LEFT, EXCLUSIVE, INCLUSIVE
from scanspan.raster.half_space import STACK, visit_rows
from scanspan.raster.lanes import BLOCK, set_up_lane
from scanspan.raster.layers import BLOCK_COLUMNS, BLOCK_ROWS, draw_layer
from scanspan.raster.setup import keep_sample, set_up
from scanspan.raster.write import EMPTY_KEY, pack_key, write_sample_key
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles

LANES = 2 * BLOCK  # of a bin, which is drawn when a further block might not fit
SIDE = 4  # samples along a side of the boxes that are drawn together
WIDE, NONE, APART = SIDE * SIDE, SIDE * SIDE + 1, SIDE * SIDE + 2  # bins: larger boxes, nothing to draw, drawn by itself
BINS = APART + 1
NEAR = np.int64(1 << 24)  # sub-pixels that a triangle is smaller than
SPAN = 64  # samples along a row, above which a box is drawn in layers.py
GROUP = np.int64(8)  # samples that a row of a wide box is a multiple of, so that no sample is left to a slower loop

# Rows of a block, each of BLOCK numbers: the corners' x and y, the triangle's number, and its bin.
NUMBER, BIN, FETCHED = 6, 7, 8

# Rows that a block and a bin have, the latter each of LANES numbers, two numbers of 32 bits in each: the corners counted from
# the first sample of the box, in sub-pixels; that sample; how many columns and rows follow it; and the triangle's number.
PLACE, SIZE, LABEL, KEPT = 3, 4, 5, 6
LOW, SIGN = np.int64((1 << 32) - 1), np.int64(1 << 31)

# Rows of what is computed for a bin, each of LANES numbers: three edge values at the first sample, what they change by to the
# right and down, the depth where the last two are zero, and what it changes by with each of them.
EDGE, RIGHT, DOWN, DEPTH, SLOPE = 0, 3, 6, 9, 10
EQUATIONS = 12


@bare_kernel
def fetch_corners(
    xy: Int64Array, depths: Float64Array, corners: Int32Array, order: Int32Array, start: Integer, count: Integer,
    fetched: Int64Array, deep: Float64Array,
) -> None:  # fmt: skip
    """Copy the corners of some triangles into rows of numbers.

    Shapes  order: (N,) int32, the triangles in the order in which they are drawn, or (0,) for that of their numbers.
    """
    for k in range(count):
        n = np.int64(order[start + k]) if order.shape[0] else start + k
        p, q, r = np.uint64(corners[n, 0]), np.uint64(corners[n, 1]), np.uint64(corners[n, 2])
        fetched[k], fetched[BLOCK + k] = xy[p, 0], xy[p, 1]
        fetched[2 * BLOCK + k], fetched[3 * BLOCK + k] = xy[q, 0], xy[q, 1]
        fetched[4 * BLOCK + k], fetched[5 * BLOCK + k] = xy[r, 0], xy[r, 1]
        fetched[NUMBER * BLOCK + k] = n
        deep[k], deep[BLOCK + k], deep[2 * BLOCK + k] = depths[p], depths[q], depths[r]


@helper_kernel
def pack_pair(x: Integer, y: Integer) -> Integer:
    """Return two numbers of 32 bits in one of 64."""
    return (x << 32) | (y & LOW)


@helper_kernel
def first_of(pair: Integer) -> Integer:
    """Return the first of two packed numbers, with its sign."""
    return pair >> 32


@helper_kernel
def second_of(pair: Integer) -> Integer:
    """Return the second of two packed numbers, with its sign."""
    return ((pair & LOW) ^ SIGN) - SIGN


@bare_kernel
def choose_bins(
    fetched: Int64Array, packed: Int64Array, count: Integer, cull: float, x_start: Integer, x_end: Integer, y_start: Integer,
    y_end: Integer, sample_x: Integer, sample_y: Integer, s: Integer,
) -> None:  # fmt: skip
    """Find the box of each triangle, and the bin that it belongs to, and pack what is put there.

    Shapes  fetched: (FETCHED x BLOCK,); packed: (KEPT x BLOCK,), written.
    Units   x_start to y_end in pixels; sample_x, sample_y in sub-pixels; cull as in Sampling.
    """
    past = (np.int64(1) << s) - 1
    for k in range(count):
        p_x, p_y, q_x, q_y = fetched[k], fetched[BLOCK + k], fetched[2 * BLOCK + k], fetched[3 * BLOCK + k]
        r_x, r_y = fetched[4 * BLOCK + k], fetched[5 * BLOCK + k]
        low_x, high_x, low_y, high_y = min(p_x, q_x, r_x), max(p_x, q_x, r_x), min(p_y, q_y, r_y), max(p_y, q_y, r_y)
        x = max((low_x + (past - sample_x)) >> s, x_start)
        y = max((low_y + (past - sample_y)) >> s, y_start)
        width, height = min((high_x - sample_x) >> s, x_end - 1) - x, min((high_y - sample_y) >> s, y_end - 1) - y

        # The area of a large triangle is rounded, so nothing is culled by it that is not near.
        is_near = ((high_x - low_x) | (high_y - low_y)) < NEAR
        a_x, a_y = np.float64(q_x - p_x), np.float64(q_y - p_y)
        area = a_x * np.float64(r_y - p_y) - a_y * np.float64(r_x - p_x)
        is_drawn = ((width | height) >= 0) & ((area * cull < 0.0) | (cull == 0.0) | (not is_near))
        is_small = (width < SIDE) & (height < SIDE)
        shape = width * SIDE + height if is_small else np.int64(WIDE)
        shape = shape if is_near else np.int64(APART)
        fetched[BIN * BLOCK + k] = shape if is_drawn else np.int64(NONE)

        # What is drawn and near has numbers that fit into 32 bits; of the others they are not looked at.
        fits, left, top = is_drawn & is_near, (x << s) + sample_x, (y << s) + sample_y
        packed[k] = pack_pair(p_x - left, p_y - top) if fits else np.int64(0)
        packed[BLOCK + k] = pack_pair(q_x - left, q_y - top) if fits else np.int64(0)
        packed[2 * BLOCK + k] = pack_pair(r_x - left, r_y - top) if fits else np.int64(0)
        packed[PLACE * BLOCK + k] = pack_pair(x, y) if fits else np.int64(0)
        packed[SIZE * BLOCK + k] = pack_pair(width, height) if fits else np.int64(0)
        packed[LABEL * BLOCK + k] = fetched[NUMBER * BLOCK + k]


@bare_kernel
def fill_bins(
    fetched: Int64Array, packed: Int64Array, deep: Float64Array, count: Integer, kept: Int64Array, depths: Float64Array,
    counts: Int64Array,
) -> None:  # fmt: skip
    """Put each triangle at the end of its bin.

    Shapes  kept: (BINS x KEPT x LANES,); depths: (BINS x 3 x LANES,); counts: (BINS,), how many are in each.
    """
    lanes = np.uint64(LANES)
    for k in range(count):
        b = np.uint64(fetched[BIN * BLOCK + k])
        c = np.uint64(counts[b])
        at = b * np.uint64(KEPT * LANES) + c
        for row in range(KEPT):
            kept[at + np.uint64(row) * lanes] = packed[row * BLOCK + k]
        at = b * np.uint64(3 * LANES) + c
        depths[at], depths[at + lanes], depths[at + lanes + lanes] = deep[k], deep[BLOCK + k], deep[2 * BLOCK + k]
        counts[b] += 1


@bare_kernel
def set_up_bin(
    kept: Int64Array, depths: Float64Array, equations: Float64Array, count: Integer, cull: float, rule: Integer, s: Integer
) -> None:  # fmt: skip
    """Set up the triangles of a bin, all of which are near.

    Shapes  kept: (KEPT x LANES,); depths: (3 x LANES,); equations: (EQUATIONS x LANES,), written; an edge value is -inf where
            there is nothing to draw.
    """
    is_inclusive, is_exclusive, down = rule == INCLUSIVE, rule == EXCLUSIVE, -1.0 if rule == BOTTOM_LEFT else 1.0
    unit = np.float64(np.int64(1) << s)
    for k in range(count):
        is_drawn, f0, f1, f2, a0, a1, a2, b0, b1, b2, depth, slope1, slope2 = set_up_lane(
            np.float64(first_of(kept[k])), np.float64(second_of(kept[k])), np.float64(first_of(kept[LANES + k])),
            np.float64(second_of(kept[LANES + k])), np.float64(first_of(kept[2 * LANES + k])),
            np.float64(second_of(kept[2 * LANES + k])), depths[k], depths[LANES + k], depths[2 * LANES + k], cull, is_inclusive,
            is_exclusive, down, unit,
        )  # fmt: skip
        equations[EDGE * LANES + k] = f0 if is_drawn else -np.inf
        equations[(EDGE + 1) * LANES + k], equations[(EDGE + 2) * LANES + k] = f1, f2
        equations[RIGHT * LANES + k], equations[(RIGHT + 1) * LANES + k], equations[(RIGHT + 2) * LANES + k] = a0, a1, a2
        equations[DOWN * LANES + k], equations[(DOWN + 1) * LANES + k], equations[(DOWN + 2) * LANES + k] = b0, b1, b2
        equations[DEPTH * LANES + k] = depth
        equations[SLOPE * LANES + k], equations[(SLOPE + 1) * LANES + k] = slope1, slope2


@bare_kernel
def draw_small(
    flat: Int64Array, width: Integer, kept: Int64Array, equations: Float64Array, keys: Int64Array, count: Integer,
    columns: Integer, rows: Integer,
) -> None:  # fmt: skip
    """Draw the triangles of a bin whose boxes have all so many columns and rows: sample by sample, of all of them at once.

    Shapes  flat: (H W,), keys row after row; keys: (2 x LANES,), overwritten.
    """
    for k in range(count):
        place = kept[PLACE * LANES + k]
        keys[LANES + k] = second_of(place) * width + first_of(place)
    for j in range(rows):
        for i in range(columns):
            right, down = np.float64(i), np.float64(j)
            for k in range(count):
                f0 = equations[k] + (right * equations[RIGHT * LANES + k] + down * equations[DOWN * LANES + k])
                f1 = equations[LANES + k] + (
                    right * equations[(RIGHT + 1) * LANES + k] + down * equations[(DOWN + 1) * LANES + k]
                )
                f2 = equations[2 * LANES + k] + (
                    right * equations[(RIGHT + 2) * LANES + k] + down * equations[(DOWN + 2) * LANES + k]
                )
                inside = (f0 >= 0.0) & (f1 >= 0.0) & (f2 >= 0.0)
                depth = equations[DEPTH * LANES + k] + (
                    f1 * equations[SLOPE * LANES + k] + f2 * equations[(SLOPE + 1) * LANES + k]
                )
                key = pack_key(depth, kept[LABEL * LANES + k])
                keys[k] = key if inside else EMPTY_KEY

            # Write them one by one, as two may be for the same place.
            off = j * width + i
            for k in range(count):
                at = np.uint64(keys[LANES + k] + off)
                flat[at] = max(flat[at], keys[k])


@kernel
def draw_wide(
    flat: Int64Array, width: Integer, kept: Int64Array, equations: Float64Array, large: Int64Array, count: Integer
) -> int:
    """Draw the triangles of the bin of larger boxes row by row; list those that are larger still, and return their number.

    Shapes  flat: (H W,), keys row after row; large: (LANES,), written.
    """
    found = 0
    for k in range(count):
        f0, f1, f2 = equations[k], equations[LANES + k], equations[2 * LANES + k]
        place, size, n = kept[PLACE * LANES + k], kept[SIZE * LANES + k], kept[LABEL * LANES + k]
        x, y, columns, rows = first_of(place), second_of(place), first_of(size) + 1, second_of(size) + 1
        across = (columns + GROUP - 1) // GROUP * GROUP
        if columns > SPAN or across > width:
            large[found] = k
            found += 1
            continue

        # Widen the rows to whole groups, to the left where the picture ends; what is added lies outside of the triangle.
        a0, a1, a2 = equations[RIGHT * LANES + k], equations[(RIGHT + 1) * LANES + k], equations[(RIGHT + 2) * LANES + k]
        b0, b1, b2 = equations[DOWN * LANES + k], equations[(DOWN + 1) * LANES + k], equations[(DOWN + 2) * LANES + k]
        depth, slope1 = equations[DEPTH * LANES + k], equations[SLOPE * LANES + k]
        slope2 = equations[(SLOPE + 1) * LANES + k]
        left = min(x, width - across)
        back = np.float64(left - x)
        f0, f1, f2 = f0 + back * a0, f1 + back * a1, f2 + back * a2
        at = y * width + left
        for _ in range(rows if f0 > -np.inf else np.int64(0)):
            row = flat[at : at + across]
            for i in range(across):
                right = np.float64(i)
                e0, e1, e2 = f0 + right * a0, f1 + right * a1, f2 + right * a2
                inside = (e0 >= 0.0) & (e1 >= 0.0) & (e2 >= 0.0)
                write_sample_key(row, i, inside, depth + (e1 * slope1 + e2 * slope2), n)
            f0, f1, f2, at = f0 + b0, f1 + b1, f2 + b2, at + width
    return found


@kernel
def draw_bin(
    target: Int64Array, flat: Int64Array, b: int, kept: Int64Array, depths: Float64Array, counts: Int64Array,
    equations: Float64Array, scratch: Int64Array, lows: Int64Array, sampling: Sampling,
) -> None:  # fmt: skip
    """Draw and empty bin b.

    Shapes  kept, depths, counts: as for fill_bins; scratch: (2 x LANES,); lows: as for draw_layer.
    """
    count, width = counts[b], np.int64(target.shape[1])
    here = kept[b * KEPT * LANES : (b + 1) * KEPT * LANES]
    set_up_bin(
        here, depths[b * 3 * LANES : (b + 1) * 3 * LANES], equations, count, np.float64(sampling.cull),
        np.int64(sampling.rule), np.int64(sampling.subpixel_bits),
    )  # fmt: skip
    if b < WIDE:
        draw_small(flat, width, here, equations, scratch, count, np.int64(b // SIDE + 1), np.int64(b % SIDE + 1))
    else:
        large = draw_wide(flat, width, here, equations, scratch, count)
        for i in range(large):
            k = scratch[i]
            place, size = here[PLACE * LANES + k], here[SIZE * LANES + k]
            draw_layer(
                target, lows, equations[k::LANES], first_of(place), second_of(place), first_of(size) + 1, second_of(size) + 1,
                here[LABEL * LANES + k],
                np.int64(sampling.y_start), np.int64(sampling.y_end),
            )  # fmt: skip
    counts[b] = 0


@kernel
def block_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, order: Int32Array, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Write every covered sample of triangles first to last of an order into (H, W) keys.

    Shapes  order: (N,) int32, numbers of triangles; or (0,), where first to last are the numbers themselves.
    Needs   samples decide, and the rule is not that of an off-screen point. The rectangle of sampling spans the target's width.
    Cost    O(triangles + bounding boxes) up to SPAN samples across; beyond it O(covered samples that may be seen).
    Source  Pineda 1988.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = triangles.integers, triangles.floats
    fetched, packed, deep = np.empty(FETCHED * BLOCK, np.int64), np.empty(KEPT * BLOCK, np.int64), np.empty(3 * BLOCK)
    kept, kept_depths, counts = np.empty(BINS * KEPT * LANES, np.int64), np.empty(BINS * 3 * LANES), np.zeros(BINS, np.int64)
    equations, scratch, stack = np.empty(EQUATIONS * LANES), np.empty(2 * LANES, np.int64), np.empty(STACK, np.int64)
    lows = np.full(((target.shape[0] // BLOCK_ROWS) + 1, (target.shape[1] // BLOCK_COLUMNS) + 1), EMPTY_KEY)
    flat = target.reshape(-1)
    for start in range(first, last, BLOCK):
        count = np.int64(min(last - start, BLOCK))
        fetch_corners(xy, depths, corners, order, start, count, fetched, deep)
        choose_bins(
            fetched, packed, count, np.float64(sampling.cull), np.int64(sampling.x_start), np.int64(sampling.x_end),
            np.int64(sampling.y_start), np.int64(sampling.y_end), np.int64(sampling.sample_x), np.int64(sampling.sample_y),
            np.int64(sampling.subpixel_bits),
        )  # fmt: skip

        # Set aside those with an outline of their own, if there are any at all.
        if integers.shape[0]:
            for k in range(count):
                n = fetched[NUMBER * BLOCK + k]
                if outline[n] >= 0 or inner[n] != 0:
                    fetched[BIN * BLOCK + k] = APART
        fill_bins(fetched, packed, deep, count, kept, kept_depths, counts)

        # Draw the bins that have no room for another block, and empty the others that are none.
        for b in range(WIDE + 1):
            if counts[b] > LANES - BLOCK:
                draw_bin(target, flat, b, kept, kept_depths, counts, equations, scratch, lows, sampling)
        for i in range(counts[APART]):
            n = kept[(APART * KEPT + LABEL) * LANES + i]
            t = set_up(xy, depths, corners, inner, outline, integers, floats, n, sampling)
            visit_rows(write_sample_key, keep_sample, target, t, n, stack)
        counts[APART], counts[NONE] = 0, 0
    for b in range(WIDE + 1):
        draw_bin(target, flat, b, kept, kept_depths, counts, equations, scratch, lows, sampling)


@kernel
def sort_triangles(
    xy: Int64Array, corners: Int32Array, subpixel_bits: int, bits: int, starts: Int64Array, across: Integer, cells: Int32Array,
    order: Int32Array,
) -> None:  # fmt: skip
    """Order triangles by the cell of the picture that their first corner lies in, and within a cell by number.

    Shapes  starts: (cells + 1,) zeros, overwritten; cells, order: (N,) int32, written.
    Units   a cell has 2^bits pixels a side; across: cells in a row of them.
    Cost    O(N), a counting sort.
    """
    down = (starts.shape[0] - 1) // across
    shift = subpixel_bits + bits
    for n in range(corners.shape[0]):
        p = corners[n, 0]
        x, y = min(max(xy[p, 0] >> shift, 0), across - 1), min(max(xy[p, 1] >> shift, 0), down - 1)
        cell = y * across + x
        cells[n] = cell
        starts[cell + 1] += 1
    for c in range(1, starts.shape[0]):
        starts[c] += starts[c - 1]
    for n in range(corners.shape[0]):
        cell = cells[n]
        order[starts[cell]] = n
        starts[cell] += 1
