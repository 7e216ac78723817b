"""The order of points: Morton codes of 21 bits an axis, sorted by digits, and the levels at which neighbours part.

Points lie on a lattice of whole numbers. The code of a point interleaves the upper 21 bits of x, y and z, so that points with
the same first bits share a cell, and a range of the sorted codes is a part of a binary tree over space. What the codes cannot
part (an outlier far away makes their cells large) a second code parts, of the bits below.

Sorting goes by digits from the lowest (LSD radix), in which equal codes keep their order: the same points give the same order
whatever pieces they come in. The highest 33 bits that differ go first, and what they leave is sorted by insertion, unless there
are long runs. The price: two arrays as long as the codes.

Source: G. M. Morton (1966); Karras, Maximizing parallelism in the construction of BVHs (2012), for trees from sorted codes.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Int64Array, Integer

AXIS_BITS = 21  # of a code, an axis
CODE_BITS = 3 * AXIS_BITS
DIGIT_BITS = 11
DIGITS = 1 << DIGIT_BITS
LONG_RUN = 32  # points of one code that are sorted by insertion


@helper_kernel
def spread(value: Integer) -> Integer:
    """Return the 21 lowest bits of a number with two zeros between neighbours."""
    x = value & 0x1FFFFF
    x = (x | x << 32) & 0x1F00000000FFFF
    x = (x | x << 16) & 0x1F0000FF0000FF
    x = (x | x << 8) & 0x100F00F00F00F00F
    x = (x | x << 4) & 0x10C30C30C30C30C3
    x = (x | x << 2) & 0x1249249249249249
    return x


@helper_kernel
def highest_bit(value: Integer) -> Integer:
    """Return the number of the highest bit of a positive number, counted from 0."""
    bit = np.int64(0)
    for step in (32, 16, 8, 4, 2, 1):
        if value >> (bit + step) != 0:
            bit += step
    return bit


@kernel
def morton_codes(lattice: Array, shift: Integer) -> Int64Array:
    """Return the codes of points (N, 3), of the 21 bits of each coordinate from bit `shift` on."""
    codes = np.empty(len(lattice), np.int64)
    for i in range(len(lattice)):
        x, y, z = np.int64(lattice[i, 0]) >> shift, np.int64(lattice[i, 1]) >> shift, np.int64(lattice[i, 2]) >> shift
        codes[i] = spread(x) << 2 | spread(y) << 1 | spread(z)
    return codes


@kernel
def morton_rests(lattice: Array, shift: Integer) -> Int64Array:
    """Return the codes of the bits that `morton_codes` leaves out, those below `shift`."""
    codes = np.empty(len(lattice), np.int64)
    mask = (np.int64(1) << shift) - 1
    for i in range(len(lattice)):
        x, y, z = np.int64(lattice[i, 0]) & mask, np.int64(lattice[i, 1]) & mask, np.int64(lattice[i, 2]) & mask
        codes[i] = spread(x) << 2 | spread(y) << 1 | spread(z)
    return codes


@kernel
def sort_digit(keys: Int64Array, order: Int64Array, shift: Integer, other_keys: Int64Array, other: Int64Array) -> bool:
    """Sort by one digit into other arrays, in which equal ones keep their order; return whether there was anything to do."""
    place = np.zeros(DIGITS, np.int64)
    for i in range(len(keys)):
        place[keys[i] >> shift & (DIGITS - 1)] += 1
    if place[keys[0] >> shift & (DIGITS - 1)] == len(keys):
        return False
    total = np.int64(0)
    for value in range(DIGITS):
        size = place[value]
        place[value] = total
        total += size
    for i in range(len(keys)):
        key = keys[i]
        value = key >> shift & (DIGITS - 1)
        other_keys[place[value]], other[place[value]] = key, order[i]
        place[value] += 1
    return True


@kernel
def sort_neighbours(keys: Int64Array, order: Int64Array, shift: Integer) -> bool:
    """Sort within runs that agree in the bits from `shift` on, by insertion; return False if a run is too long for that."""
    first = 0
    for i in range(1, len(keys)):
        if keys[i] >> shift != keys[first] >> shift:
            first = i
        if i - first > LONG_RUN:
            return False
        key, number, j = keys[i], order[i], i
        while j > first and keys[j - 1] > key:
            keys[j], order[j] = keys[j - 1], order[j - 1]
            j -= 1
        keys[j], order[j] = key, number
    return True


@kernel
def sorted_order(codes: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return the numbers of codes (N,), none negative, from the smallest code to the largest, and the codes in that order.

    Equal codes keep their order. Three digits of the highest bits that differ mostly leave only runs of a few.
    """
    count = len(codes)
    order, keys = np.arange(count), codes.copy()
    if count < 2:
        return order, keys
    differing = np.int64(0)
    for i in range(count):
        differing |= codes[i] ^ codes[0]
    top = highest_bit(differing) + 1 if differing > 0 else 0
    lowest = max(top - 3 * DIGIT_BITS, 0)
    other_keys, other = np.empty(count, np.int64), np.empty(count, np.int64)
    for shift in range(lowest, top, DIGIT_BITS):
        if sort_digit(keys, order, shift, other_keys, other):
            keys, other_keys, order, other = other_keys, keys, other, order
    if lowest > 0 and not sort_neighbours(keys, order, lowest):
        for shift in range(0, top, DIGIT_BITS):
            if sort_digit(keys, order, shift, other_keys, other):
                keys, other_keys, order, other = other_keys, keys, other, order
    return order, keys


@kernel
def take_rows(rows: Array, order: Int64Array) -> Array:
    """Return some rows of an array (N, C), in the order of their numbers."""
    taken = np.empty((len(order), rows.shape[1]), rows.dtype)
    for i in range(len(order)):
        for column in range(rows.shape[1]):
            taken[i, column] = rows[order[i], column]
    return taken


@kernel
def take_numbers(lattice: Array, order: Int64Array) -> Int64Array:
    """Return some rows of a lattice (N, 3) as int64, in the order of their numbers."""
    taken = np.empty((len(order), 3), np.int64)
    for i in range(len(order)):
        taken[i, 0], taken[i, 1], taken[i, 2] = lattice[order[i], 0], lattice[order[i], 1], lattice[order[i], 2]
    return taken


@kernel
def sort_short_runs(codes: Int64Array, rests: Int64Array, order: Int64Array) -> Int64Array:
    """Sort rests and order within runs of one code, by insertion; return where runs too long for that start and end, (R, 2)."""
    count = len(codes)
    long_runs = np.empty((count // LONG_RUN + 1, 2), np.int64)
    found = 0
    first = 0
    while first < count:
        end = first + 1
        while end < count and codes[end] == codes[first]:
            end += 1
        if end - first > LONG_RUN:
            long_runs[found, 0], long_runs[found, 1] = first, end
            found += 1
        else:
            for i in range(first + 1, end):
                rest, number, j = rests[i], order[i], i
                while j > first and rests[j - 1] > rest:
                    rests[j], order[j] = rests[j - 1], order[j - 1]
                    j -= 1
                rests[j], order[j] = rest, number
        first = end
    return long_runs[:found]


def order_points(lattice: Array, shift: int) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Return the order of points on a lattice, and their two codes in that order.

    Parameters
    ----------
    lattice : (N, 3) whole numbers from 0 to below 2^(21 + shift).
    shift : the bits of a coordinate that the first code leaves to the second, 0 to 21.

    Returns
    -------
    order : (N,) numbers of points.
    codes, rests : (N,) the first and the second code of each, sorted; rests has no entries if `shift` is 0.

    >>> order, codes, rests = order_points(np.array([[3, 0, 0], [0, 0, 1], [0, 2, 0]]), 0)
    >>> order.tolist(), codes.tolist(), rests.tolist()
    ([1, 2, 0], [1, 16, 36], [])
    """
    order, codes = sorted_order(morton_codes(lattice, shift))
    if shift == 0:
        return order, codes, np.empty(0, np.int64)

    # Sort by the rest within runs of one code.
    rests = morton_rests(lattice, shift)[order]
    for first, end in sort_short_runs(codes, rests, order).tolist():
        run = slice(first, end)
        inner, rests[run] = sorted_order(rests[run])
        order[run] = order[run][inner]
    return order, codes, rests


@helper_kernel
def level_between(codes: Int64Array, rests: Int64Array, i: Integer, j: Integer) -> Integer:
    """Return how high in the tree two points part: 64 to 126 by the first code, 1 to 63 by the second, 0 if nowhere."""
    if codes[i] != codes[j]:
        return CODE_BITS + 1 + highest_bit(codes[i] ^ codes[j])
    if len(rests) and rests[i] != rests[j]:
        return 1 + highest_bit(rests[i] ^ rests[j])
    return np.int64(0)


@kernel
def cut_ranges(
    codes: Int64Array, rests: Int64Array, size: Integer, separator: Integer, halved: Integer, starts: Int64Array
) -> int:
    """Cut sorted points where their highest bit differs until no part has more than `size`; return how many parts there are.

    Points that lie at one place are cut in half.

    Writes      starts (K + 1, 2): the first point of each part, and the level at which it parts from the one before; halves
                part at levels below 0. That of the first part is `separator`. At the end the number of points. Room for
                N / 2 + 3.
    Units       codes: of a whole cell, or of all points; halved: how often points of one place were halved until these were
                left.
    """
    waiting = np.empty((256, 4), np.int64)
    waiting[0, 0], waiting[0, 1], waiting[0, 2], waiting[0, 3] = 0, len(codes), separator, halved
    top, parts = 1, 0
    while top > 0:
        top -= 1
        a, b, level, halvings = waiting[top, 0], waiting[top, 1], waiting[top, 2], waiting[top, 3]
        if b - a <= size:
            starts[parts, 0], starts[parts, 1] = a, level
            parts += 1
            continue

        # Find the first point that has the bit in which the first and the last differ; runs that are not sorted are halved.
        inner = level_between(codes, rests, a, b - 1)
        middle = (a + b) // 2
        if inner > 0:
            low, high = a, b - 1
            while high - low > 1:
                probe = (low + high) // 2
                if level_between(codes, rests, a, probe) < inner:
                    low = probe
                else:
                    high = probe
            middle = high
        else:
            halvings += 1
            inner = -halvings

        # The left part is next, so it goes on top.
        waiting[top, 0], waiting[top, 1], waiting[top, 2], waiting[top, 3] = middle, b, inner, halvings
        waiting[top + 1, 0], waiting[top + 1, 1], waiting[top + 1, 2], waiting[top + 1, 3] = a, middle, level, halvings
        top += 2
    starts[parts, 0], starts[parts, 1] = len(codes), 0
    return parts
