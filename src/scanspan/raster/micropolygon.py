"""Micropolygons: subdivide the primitive until its pieces are about a pixel across, with the verbs bound, split, dice, sample.

A piece is bounded and dropped if it lies off the band; split if one of its edges is long; else diced into a grid of
micropolygons, and the few samples in the box of each are tested. Whether an edge is split depends on that edge alone, so
neighbours that share it split it alike.

Nothing is rounded on the way. A corner is m / 2^level of the way from the primitive's first corner to its second and
n / 2^level to its third. In units of 1/2^(s + level) pixel, from that first corner, it lies at whole numbers, and an edge
between two corners keeps the bits that it had at level 0, since the units halve with the edges. So edge values are exact.

Pieces must share out the primitive: each of its samples belongs to one micropolygon, also one on its border under a rule that
owns all of that. A shift in one direction for all, which is what top-left amounts to, cannot do it, because it leads out of the
primitive. So an edge made here owns its samples where the primitive's first corner is on its inner side, as for an off-screen
point: from everywhere in the triangle the way to that corner stays inside. The primitive's own edges, with the rule, and its
depth are those of its setup. So the picture is that of every other algorithm, bit for bit.

When to choose it: when something is to happen to the pieces, such as shading or displacing them. For flat triangles, half-space
is faster at any size.

Source: Cook, Carpenter and Catmull 1987 (REYES); the lectures' "recursive subdivision of the primitive".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scanspan.geometry.fixed_point import halves_sign, product_halves
from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.counters import EDGE_EVALUATIONS, SAMPLES_TESTED, SUBDIVISIONS
from scanspan.raster.order import Window, list_blocks
from scanspan.raster.setup import depth_at, set_up
from scanspan.raster.write import write_sample_hit, write_sample_key, write_sample_pair, write_sample_tally
from scanspan.records import Array, Float64Array, Int32Array, Int64Array, Integer, Sampling, ScreenTriangles, TriangleSetup

HALF_PIXELS = np.int64(3)  # half pixels along an edge of a micropolygon, at most; then it covers about one sample
DICE_LEVELS = np.int64(3)  # halvings at most, so a grid has up to 8 micropolygons along a side
SPLIT_SIDE = np.int64(12)  # pixels; a piece with a longer edge is split, so the grid of one that is not gets there

# How far halving goes. A corner lies within 2^25 px of the first one and has s + level bits below the pixel: with 36 of them
# its position fits an int64, and so does the distance of a sample. Splitting, which stops DICE_LEVELS earlier, leaves no edge
# longer than 2^(25 - level) px and twice SPLIT_SIDE, for what it makes is at most half of a long edge and a short one. So an
# edge stays below 1.1 2^41 units, and the halves of products below 2^63. At level 30 products of m and n still fit. What may
# not be split any more is diced and sampled as it is, which is only slower.
FRACTION_BITS = np.int64(36)
MAX_LEVEL = np.int64(30)
MAX_PIECES = 3 * 30 + 1  # that wait: three siblings on each level


BUCKET = np.int64(32)  # pixels along a side of the windows that an order other than rows goes by


class Frame(NamedTuple):
    """Where a primitive lies: its first corner, from which its pieces are measured, and the ways to the other two."""

    p_x: Integer  # sub-pixels, less the sample's place in the pixel
    p_y: Integer
    u_x: Integer  # sub-pixels along m
    u_y: Integer
    v_x: Integer  # sub-pixels along n
    v_y: Integer
    subpixel_bits: Integer


class Piece(NamedTuple):
    """Three corners (m, n) of a piece, in 1/2^level of the primitive."""

    m0: Integer
    n0: Integer
    m1: Integer
    n1: Integer
    m2: Integer
    n2: Integer
    level: Integer


class Grid(NamedTuple):
    """The micropolygons of a piece: triangles with one corner and the ways to the other two, or turned by half a turn."""

    m: Integer  # the piece's first corner, in 1/2^level of the primitive
    n: Integer
    u_m: Integer  # from a micropolygon's corner to its next one
    u_n: Integer
    v_m: Integer  # from there to its last one
    v_n: Integer
    x: Integer  # the same in units of the level
    y: Integer
    u_x: Integer
    u_y: Integer
    v_x: Integer
    v_y: Integer
    sample_x: Integer  # the sample of pixel (0, 0)
    sample_y: Integer
    bits: Integer  # samples are 2^bits units apart
    side: Integer  # micropolygons along each side of the piece


@helper_kernel
def make_frame(p_x: Integer, p_y: Integer, t: TriangleSetup, sampling: Sampling) -> Frame:
    """Return the frame of a primitive whose corner that comes first in (y, x) is p; the setup's edges give the other two."""
    return Frame(p_x - sampling.sample_x, p_y - sampling.sample_y, t.b2, -t.a2, -t.b1, t.a1, np.int64(sampling.subpixel_bits))


@helper_kernel
def make_box_frame(t: TriangleSetup, sampling: Sampling) -> Frame:
    """Return the frame of an outline, which has no corners: a triangle twice as wide and high as its box, and so round it."""
    s = np.int64(sampling.subpixel_bits)
    return Frame(t.x_start << s, t.y_start << s, (t.x_end - t.x_start) << (s + 1), np.int64(0),
                 np.int64(0), (t.y_end - t.y_start) << (s + 1), s)  # fmt: skip


@helper_kernel
def position(frame: Frame, m: Integer, n: Integer) -> tuple[Integer, Integer]:
    """Return where (m, n) lies, or how far it reaches, from the first corner, in units of its level."""
    return m * frame.u_x + n * frame.v_x, m * frame.u_y + n * frame.v_y


@helper_kernel
def longest_side(frame: Frame, m: Integer, n: Integer) -> Integer:
    """Return the larger of the width and the height of an edge that goes by (m, n), in units of its level."""
    x, y = position(frame, m, n)
    return max(x, -x, y, -y)


@helper_kernel
def find_samples(
    low: Integer, high: Integer, sample: Integer, bits: Integer, start: Integer, end: Integer
) -> tuple[Integer, Integer]:
    """Return the samples from low to high, both included, that are also among start to end, as a half-open range of pixels."""
    return max(-((sample - low) >> bits), start), min(((high - sample) >> bits) + 1, end)


@helper_kernel
def is_off(frame: Frame, window: Window, piece: Piece) -> bool | np.bool_:
    """Bound: say whether no sample of a window lies in the box of a piece."""
    x0, y0 = position(frame, piece.m0, piece.n0)
    x1, y1 = position(frame, piece.m1, piece.n1)
    x2, y2 = position(frame, piece.m2, piece.n2)
    bits = frame.subpixel_bits + piece.level
    sample_x, sample_y = -(frame.p_x << piece.level), -(frame.p_y << piece.level)
    x_start, x_end = find_samples(min(x0, x1, x2), max(x0, x1, x2), sample_x, bits, window.x_start, window.x_end)
    y_start, y_end = find_samples(min(y0, y1, y2), max(y0, y1, y2), sample_y, bits, window.y_start, window.y_end)
    return (x_start >= x_end) | (y_start >= y_end)


@helper_kernel
def push_piece(
    pieces: Int64Array, count: int, m0: Integer, n0: Integer, m1: Integer, n1: Integer, m2: Integer, n2: Integer, level: Integer
) -> int:
    """Push a piece and return the new count; one with two equal corners is none."""
    if (m0 == m1 and n0 == n1) or (m1 == m2 and n1 == n2) or (m2 == m0 and n2 == n0):
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = m0, n0, m1, n1
    pieces[count, 4], pieces[count, 5], pieces[count, 6] = m2, n2, level
    return count + 1


@helper_kernel
def split(pieces: Int64Array, count: int, frame: Frame, piece: Piece) -> int:
    """Split the long edges of a piece in the middle and push what becomes of it; return the count, unchanged if none is long.

    An edge that is not split gives its end where the others give their middle. Then the four children of a piece with three
    long edges are right for one and two as well: those that are too many have two equal corners.
    """
    m0, n0, m1, n1, m2, n2, level = piece
    long = SPLIT_SIDE << (frame.subpixel_bits + level)
    splits01 = longest_side(frame, m1 - m0, n1 - n0) > long
    splits12 = longest_side(frame, m2 - m1, n2 - n1) > long
    splits20 = longest_side(frame, m0 - m2, n0 - n2) > long
    if not (splits01 or splits12 or splits20):
        return count

    # Find the middles; on the next level all numbers are twice as large.
    m01, n01 = (m0 + m1, n0 + n1) if splits01 else (2 * m1, 2 * n1)
    m12, n12 = (m1 + m2, n1 + n2) if splits12 else (2 * m2, 2 * n2)
    m20, n20 = (m2 + m0, n2 + n0) if splits20 else (2 * m0, 2 * n0)
    count = push_piece(pieces, count, 2 * m0, 2 * n0, m01, n01, m20, n20, level + 1)
    count = push_piece(pieces, count, m01, n01, 2 * m1, 2 * n1, m12, n12, level + 1)
    count = push_piece(pieces, count, m20, n20, m12, n12, 2 * m2, 2 * n2, level + 1)
    return push_piece(pieces, count, m12, n12, m20, n20, m01, n01, level + 1)


@helper_kernel
def dice(frame: Frame, piece: Piece) -> Grid:
    """Halve the edges of a piece until they are as short as a micropolygon's, and return the grid that this makes."""
    u_m, u_n, v_m, v_n = piece.m1 - piece.m0, piece.n1 - piece.n0, piece.m2 - piece.m0, piece.n2 - piece.n0
    longest = max(longest_side(frame, u_m, u_n), longest_side(frame, v_m, v_n), longest_side(frame, v_m - u_m, v_n - u_n))
    halvings = np.int64(0)
    while halvings < DICE_LEVELS and 2 * longest > (HALF_PIXELS << (frame.subpixel_bits + piece.level + halvings)):
        halvings += 1

    # On that level the ways have the numbers that the piece's edges had on its own.
    level = piece.level + halvings
    m, n = piece.m0 << halvings, piece.n0 << halvings
    x, y = position(frame, m, n)
    u_x, u_y = position(frame, u_m, u_n)
    v_x, v_y = position(frame, v_m, v_n)
    return Grid(
        m, n, u_m, u_n, v_m, v_n, x, y, u_x, u_y, v_x, v_y,
        -(frame.p_x << level), -(frame.p_y << level), frame.subpixel_bits + level, np.int64(1) << halvings,
    )  # fmt: skip


@helper_kernel
def edge_owns(m: Integer, n: Integer, along_m: Integer, along_n: Integer) -> Integer:
    """Return 1 where the edge from corner (m, n) along a direction owns the samples on it, else 0.

    It does where the first corner is on its inner side. On its own line that corner counts as moved by (e, e^2) in m and n,
    into the primitive.
    """
    side = along_n * m - along_m * n
    is_ahead = along_n < 0 or (along_n == 0 and along_m > 0)
    return np.int64(side > 0 or (side == 0 and is_ahead))


@helper_kernel
def is_inside(x: Integer, y: Integer, along_x: Integer, along_y: Integer, owns: Integer) -> bool | np.bool_:
    """Say whether a sample at (x, y) from the start of an edge is on its inner side, or on it where the edge owns it."""
    high, low = product_halves(-along_y, along_x, x, y)
    return halves_sign(high, low) + owns > 0


@helper_kernel
def owns_sample(grid: Grid, i: Integer, j: Integer, sign: Integer, x: Integer, y: Integer) -> bool | np.bool_:
    """Say whether a micropolygon owns the sample at (x, y) from its corner (i, j) of the grid; sign is -1 for a turned one."""
    m, n = grid.m + i * grid.u_m + j * grid.v_m, grid.n + i * grid.u_n + j * grid.v_n
    u_m, u_n, v_m, v_n = sign * grid.u_m, sign * grid.u_n, sign * grid.v_m, sign * grid.v_n
    u_x, u_y, v_x, v_y = sign * grid.u_x, sign * grid.u_y, sign * grid.v_x, sign * grid.v_y
    return (
        is_inside(x, y, u_x, u_y, edge_owns(m, n, u_m, u_n))
        and is_inside(x - u_x, y - u_y, v_x - u_x, v_y - u_y, edge_owns(m + u_m, n + u_n, v_m - u_m, v_n - u_n))
        and is_inside(x, y, -v_x, -v_y, edge_owns(m + v_m, n + v_n, -v_m, -v_n))
    )


@inline_kernel
def sample_grid(
    write_sample: Callable[..., None], target: Array, t: TriangleSetup, window: Window, n: int, grid: Grid, counters: Int64Array
) -> None:
    """Sample: test the few samples in the box of each micropolygon, and write those that belong to it and to its primitive."""
    tested = written = np.int64(0)
    low_x, high_x = min(0, grid.u_x, grid.v_x), max(0, grid.u_x, grid.v_x)
    low_y, high_y = min(0, grid.u_y, grid.v_y), max(0, grid.u_y, grid.v_y)
    for row in range(grid.side):
        for place in range(2 * (grid.side - row) - 1):
            # In a row of the grid every other triangle is turned, with its corner at the far end.
            turned = place & 1
            i, j, sign = (place >> 1) + turned, row + turned, 1 - 2 * turned
            x0, y0 = grid.x + i * grid.u_x + j * grid.v_x, grid.y + i * grid.u_y + j * grid.v_y
            left, right = (x0 - high_x, x0 - low_x) if turned else (x0 + low_x, x0 + high_x)
            top, bottom = (y0 - high_y, y0 - low_y) if turned else (y0 + low_y, y0 + high_y)
            y_start, y_end = find_samples(top, bottom, grid.sample_y, grid.bits, window.y_start, window.y_end)
            x_start, x_end = find_samples(left, right, grid.sample_x, grid.bits, window.x_start, window.x_end)
            tested += max(x_end - x_start, np.int64(0)) * max(y_end - y_start, np.int64(0))
            for y in range(y_start, y_end):
                for x in range(x_start, x_end):
                    # Ask the primitive's own edges, which have the rule in them, and then those of the micropolygon.
                    k, h = x - t.x_start, y - t.y_start
                    if ((t.f0 + k * t.a0 + h * t.b0) | (t.f1 + k * t.a1 + h * t.b1) | (t.f2 + k * t.a2 + h * t.b2)) < 0:
                        continue
                    if owns_sample(
                        grid, i, j, sign, (x << grid.bits) + grid.sample_x - x0, (y << grid.bits) + grid.sample_y - y0
                    ):
                        depth = depth_at(t, t.g1 + k * t.g1_x + h * t.g1_y, t.g2 + k * t.g2_x + h * t.g2_y)
                        write_sample(target[y, x : x + 1], 0, True, depth, n)
                        written += 1
    counters[SAMPLES_TESTED] += tested - written
    counters[EDGE_EVALUATIONS] += 3 * (tested + written)


@inline_kernel
def dice_window(
    write_sample: Callable[..., None], target: Array, t: TriangleSetup, frame: Frame, window: Window, n: int,
    max_level: Integer, pieces: Int64Array, counters: Int64Array,
) -> None:  # fmt: skip
    """Bound and split what waits, beginning with the primitive itself; dice and sample what is not split.

    Shapes  pieces: (MAX_PIECES, 7), room for those that wait.
    """
    count = push_piece(pieces, 0, 0, 0, 1, 0, 0, 1, 0)
    while count > 0:
        count -= 1
        piece = Piece(
            pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3],
            pieces[count, 4], pieces[count, 5], pieces[count, 6],
        )  # fmt: skip
        if is_off(frame, window, piece):
            continue
        counters[SUBDIVISIONS] += 1
        if piece.level < max_level:
            more = split(pieces, count, frame, piece)
            if more > count:
                count = more
                continue
        sample_grid(write_sample, target, t, window, n, dice(frame, piece), counters)


@inline_kernel
def micropolygon(
    write_sample: Callable[..., None], target: Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Write every covered sample of triangles first to last.

    Shapes  target: (H, W, ...), opened a sample at a time; counters: (COUNTERS,), added to; triangles: ScreenTriangles.
    Units   pixels and sub-pixels, see TriangleSetup.
    Rule    sampling.rule for the edges of the primitive, folded into them by the setup; edge_owns for those made here.
            Where sampling.order is not by rows, a primitive is made bucket by bucket, as Reyes renders a picture.
    Needs   the rectangle of sampling lies within the target.
    Cost    O(area of the boxes of micropolygons); some 100 ns a covered sample.
    Source  Cook, Carpenter and Catmull 1987.
    """
    xy, depths, corners, inner, outline = triangles.xy, triangles.depth, triangles.corners, triangles.inner, triangles.outline
    integers, floats = triangles.integers, triangles.floats
    pieces = np.empty((MAX_PIECES, 7), np.int64)
    max_level = min(FRACTION_BITS - sampling.subpixel_bits, MAX_LEVEL) - DICE_LEVELS
    for n in range(first, last):
        t = set_up(xy, depths, corners, inner, outline, integers, floats, n, sampling)
        if t.y_start == t.y_end:
            continue
        p, q, r = corners[n, 0], corners[n, 1], corners[n, 2]
        if xy[q, 1] < xy[p, 1] or (xy[q, 1] == xy[p, 1] and xy[q, 0] < xy[p, 0]):
            p = q
        if xy[r, 1] < xy[p, 1] or (xy[r, 1] == xy[p, 1] and xy[r, 0] < xy[p, 0]):
            p = r
        frame = make_frame(xy[p, 0], xy[p, 1], t, sampling) if outline[n] < 0 else make_box_frame(t, sampling)

        # Take the whole box at once, or buckets in the order that is asked for.
        if sampling.order == 0 or max(t.x_end - t.x_start, t.y_end - t.y_start) <= BUCKET:
            window = Window(t.x_start, t.x_end, t.y_start, t.y_end)
            dice_window(write_sample, target, t, frame, window, n, max_level, pieces, counters)
            continue
        blocks = list_blocks(sampling.order, (t.x_end - t.x_start - 1) // BUCKET + 1, (t.y_end - t.y_start - 1) // BUCKET + 1)
        for k in range(blocks.shape[0]):
            x, y = t.x_start + blocks[k, 0] * BUCKET, t.y_start + blocks[k, 1] * BUCKET
            window = Window(x, min(x + BUCKET, t.x_end), y, min(y + BUCKET, t.y_end))
            dice_window(write_sample, target, t, frame, window, n, max_level, pieces, counters)


@kernel
def micropolygon_keys(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W) keys."""
    micropolygon(write_sample_key, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_pairs(
    target: Float64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W, 2) pairs."""
    micropolygon(write_sample_pair, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_hits(
    target: Int32Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W) hits."""
    micropolygon(write_sample_hit, target, counters, triangles, first, last, sampling)


@kernel
def micropolygon_tallies(
    target: Int64Array, counters: Int64Array, triangles: ScreenTriangles, first: int, last: int, sampling: Sampling
) -> None:
    """Micropolygons into (H, W, 4) tallies."""
    micropolygon(write_sample_tally, target, counters, triangles, first, last, sampling)
