"""A tree from sorted points, in one pass and in bounded memory: blocks are closed as soon as nothing can be added to them.

Leaves come in Morton order, each with the level at which it parts from the one before. What a stack holds is a binary tree over
them: a part of it is complete when a leaf comes that parts at a higher level. Then its two halves become one list of blocks if
these are few enough for one parent, and else each half gets a parent of its own. A list keeps the splats that will stand for
its blocks; when it is closed they are a block, and a quarter as many stand for them in turn.

So the tree depends on nothing but the order of the points, and all that is kept is a few lists: the rest of a tree of any size
can be on disk. The price: nodes come children first and are numbered anew at the end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.assets.splats.codec import (
    BLOCK,
    CHILD,
    CHILDREN,
    HEIGHT,
    REAL_COLUMNS,
    WHOLE_COLUMNS,
    Splats,
    block_step,
    encode_normals,
    quantise,
)
from scanspan.assets.splats.merge import COLUMNS, COSINE, LEVEL, NORMAL_X, RADIUS, RED, SPARE, X, Z, group_splats, merge_splats
from scanspan.assets.splats.order import CODE_BITS, level_between
from scanspan.jit import kernel
from scanspan.records import Array, Float64Array, Int64Array, Integer

FANOUT = 8  # children of a node at most
LISTS = 2 * CODE_BITS + 66  # as deep as a binary tree can be: the bits of both codes, and halves of points at one place

# What waits: numbers of lists, entries and splats; of blocks that were made before this call, and in it; of splats likewise.
LIST_COUNT, ENTRY_COUNT, SPLAT_COUNT, BLOCKS_BEFORE, BLOCKS_MADE, SPLATS_MADE = range(6)


class Growth(NamedTuple):
    """What is kept of a tree between two calls: lists of blocks that wait for a parent."""

    counts: Int64Array  # (6,)
    lists: Int64Array  # (LISTS, 3) first entry, first splat, level at which it parts from the list before
    entries: Int64Array  # (LISTS * FANOUT, 2) number of a block, and its height over the leaves
    splats: Float64Array  # (LISTS * BLOCK, COLUMNS) that stand for these blocks


class Room(NamedTuple):
    """Where blocks are made: their numbers, their splats, and what is needed to work."""

    whole: Int64Array  # (B, WHOLE_COLUMNS)
    real: Float64Array  # (B, REAL_COLUMNS)
    splats: Splats  # of K splats
    block: Float64Array  # (BLOCK, COLUMNS)
    groups: Int64Array  # (2, BLOCK + 1)


class SortedPoints(NamedTuple):
    """N points in Morton order."""

    lattice: Int64Array  # (N, 3)
    radius: Float64Array  # (N,) in the world
    color: Array  # (N, 3) uint8 sRGB, or (0, 3)
    normal: Array  # (N, 3) float32, or (0, 3)


class Frame(NamedTuple):
    """What holds for a whole tree."""

    scale: Float64Array  # (3,) a step of the lattice in the world
    error: float  # between points and the lattice, in the world
    light: Float64Array  # (256,) of the codes of sRGB
    borders: Float64Array  # (255,) light between two codes
    exact: bool  # whether points keep their places on the lattice where 16 bits allow
    oriented: bool  # whether normals point outwards, so that cones may cull


def make_growth() -> Growth:
    """Return the state before the first leaf."""
    return Growth(
        np.zeros(6, np.int64),
        np.zeros((LISTS, 3), np.int64),
        np.zeros((LISTS * FANOUT, 2), np.int64),
        np.zeros((LISTS * BLOCK, COLUMNS)),
    )


def make_room(points: int, leaves: int, growth: Growth, has_color: bool, has_normals: bool) -> Room:
    """Return room for all blocks that some leaves can make, with those that wait in the lists."""
    waiting = int(growth.counts[ENTRY_COUNT]), int(growth.counts[SPLAT_COUNT])
    blocks = 2 * (leaves + waiting[0]) + 1
    # Groups have two splats at least, save that of a single one, which is a leaf of its own.
    splats = 2 * points + 2 * waiting[1] + leaves + BLOCK + 2 * SPARE * blocks
    return Room(
        np.zeros((blocks, WHOLE_COLUMNS), np.int64),
        np.zeros((blocks, REAL_COLUMNS)),
        Splats(
            np.empty((splats, 3), np.uint16),
            np.empty(splats, np.uint8),
            np.empty((splats if has_color else 0, 3), np.uint8),
            np.empty(splats if has_normals else 0, np.uint16),
        ),
        np.zeros((BLOCK, COLUMNS)),
        np.zeros((2, BLOCK + 2), np.int64),
    )


@kernel
def code_of_light(light: float, borders: Float64Array) -> int:
    """Return the code of sRGB whose light is nearest."""
    code = 0
    for step in (128, 64, 32, 16, 8, 4, 2, 1):
        if code + step <= 255 and light >= borders[code + step - 1]:
            code += step
    return code


@kernel
def close_block(count: Integer, height: Integer, frame: Frame, room: Room, growth: Growth, place: Integer) -> int:
    """Make a block of the splats in room.block, and put those that stand for it on the stack at `place`; return how many."""
    counts, block = growth.counts, room.block
    number, first = counts[BLOCKS_MADE], counts[SPLATS_MADE]
    whole, real = room.whole[number], room.real[number]
    starts, ends = room.groups[0], room.groups[1]
    groups = group_splats(block, count, frame.scale, starts, ends)

    # A leaf that keeps every step of the lattice has the error of the lattice alone; means lie between its steps.
    step = block_step(block, count, starts, groups, frame.scale, frame.exact and height == 0)
    sx, sy, sz = frame.scale[0], frame.scale[1], frame.scale[2]
    error = 0.5 * step * np.sqrt(sx * sx + sy * sy + sz * sz) * (1.0 + 1e-9)
    if height == 0:
        error = (error if step > 1 else 0.0) + frame.error
    quantise(block, count, step, frame.scale, error, room.splats, first, whole, real)
    encode_normals(block, count, room.splats.normal, first, real, frame.oriented)
    whole[HEIGHT] = height

    for k in range(groups):
        merge_splats(block, starts[k], starts[k + 1], frame.scale, growth.splats, place + k)
    counts[BLOCKS_MADE] += 1
    counts[SPLATS_MADE] += count
    return groups


@kernel
def close_list(
    first_entry: Integer, last_entry: Integer, first: Integer, last: Integer, frame: Frame, room: Room, growth: Growth
) -> int:
    """Make one block of a list on the stack, if it has more than one, and put it in its place; return how many splats are left.

    The list shrinks at its end, and what follows on the stack stays where it is.
    """
    if last_entry - first_entry < 2:
        return int(last - first)
    counts, entries = growth.counts, growth.entries
    number = counts[BLOCKS_MADE]
    whole = room.whole[number]
    whole[CHILDREN] = last_entry - first_entry
    height = np.int64(0)
    for i in range(first_entry, last_entry):
        whole[CHILD + i - first_entry] = entries[i, 0]
        height = max(height, entries[i, 1] + 1)
    for i in range(first, last):
        for column in range(COLUMNS):
            room.block[i - first, column] = growth.splats[i, column]

    # Colours of means are rounded; those of points were copied.
    if len(room.splats.color):
        place = counts[SPLATS_MADE]
        for i in range(last - first):
            for channel in range(3):
                room.splats.color[place + i, channel] = np.uint8(code_of_light(room.block[i, RED + channel], frame.borders))
    groups = close_block(last - first, height, frame, room, growth, first)
    entries[first_entry, 0], entries[first_entry, 1] = counts[BLOCKS_BEFORE] + number, height
    return groups


@kernel
def join_lists(frame: Frame, room: Room, growth: Growth) -> None:
    """Make one list of the two on top of the stack; each gets a parent first, if they are too many for one."""
    counts, lists, entries, splats = growth.counts, growth.lists, growth.entries, growth.splats
    a, b = counts[LIST_COUNT] - 2, counts[LIST_COUNT] - 1
    entry_a, entry_b, entry_end = lists[a, 0], lists[b, 0], counts[ENTRY_COUNT]
    splat_a, splat_b, splat_end = lists[a, 1], lists[b, 1], counts[SPLAT_COUNT]
    counts[LIST_COUNT] -= 1
    if entry_end - entry_a <= FANOUT and splat_end - splat_a <= BLOCK:
        splats[splat_b - 1, LEVEL] = lists[b, 2]
        return

    left = close_list(entry_a, entry_b, splat_a, splat_b, frame, room, growth)
    right = close_list(entry_b, entry_end, splat_b, splat_end, frame, room, growth)
    entries[entry_a + 1, 0], entries[entry_a + 1, 1] = entries[entry_b, 0], entries[entry_b, 1]
    counts[ENTRY_COUNT] = entry_a + 2
    if splat_a + left < splat_b:
        for i in range(right):
            for column in range(COLUMNS):
                splats[splat_a + left + i, column] = splats[splat_b + i, column]
    counts[SPLAT_COUNT] = splat_a + left + right
    splats[splat_a + left - 1, LEVEL] = lists[b, 2]


@kernel
def load_leaf(
    points: SortedPoints,
    codes: Int64Array,
    rests: Int64Array,
    first: Integer,
    last: Integer,
    frame: Frame,
    room: Room,
    growth: Growth,
) -> None:
    """Copy the points of a leaf to room.block, and their colours to where its splats go."""
    block = room.block
    place = growth.counts[SPLATS_MADE]
    for i in range(first, last):
        row = i - first
        for axis in range(X, Z + 1):
            block[row, axis] = points.lattice[i, axis]
        block[row, RADIUS] = points.radius[i]
        block[row, LEVEL] = level_between(codes, rests, i, i + 1) if i + 1 < last else 0
        block[row, COSINE] = -1.0
    if len(points.color):
        for i in range(first, last):
            for channel in range(3):
                code = points.color[i, channel]
                room.splats.color[place + i - first, channel] = code
                block[i - first, RED + channel] = frame.light[code]
    if len(points.normal):
        for i in range(first, last):
            nx, ny, nz = points.normal[i, 0], points.normal[i, 1], points.normal[i, 2]
            for axis in range(3):
                block[i - first, NORMAL_X + axis] = points.normal[i, axis]
            if nx * nx + ny * ny + nz * nz > 0.5:
                block[i - first, COSINE] = 1.0


@kernel
def add_leaves(
    points: SortedPoints,
    codes: Int64Array,
    rests: Int64Array,
    starts: Int64Array,
    leaves: Integer,
    frame: Frame,
    room: Room,
    growth: Growth,
) -> None:
    """Add leaves to a tree.

    Writes      room, growth.
    Units       starts: (leaves + 1, 2) as cut_ranges writes it, with the number of points at the end.
    """
    counts, lists, entries = growth.counts, growth.lists, growth.entries
    for leaf in range(leaves):
        # Join what is complete now, before the leaf comes.
        level = starts[leaf, 1]
        while counts[LIST_COUNT] >= 2 and lists[counts[LIST_COUNT] - 1, 2] <= level:
            join_lists(frame, room, growth)

        first, last = starts[leaf, 0], starts[leaf + 1, 0]
        load_leaf(points, codes, rests, first, last, frame, room, growth)
        number, top = counts[BLOCKS_MADE], counts[LIST_COUNT]
        lists[top, 0], lists[top, 1], lists[top, 2] = counts[ENTRY_COUNT], counts[SPLAT_COUNT], level
        groups = close_block(last - first, np.int64(0), frame, room, growth, counts[SPLAT_COUNT])
        entries[counts[ENTRY_COUNT], 0], entries[counts[ENTRY_COUNT], 1] = counts[BLOCKS_BEFORE] + number, 0
        counts[LIST_COUNT] += 1
        counts[ENTRY_COUNT] += 1
        counts[SPLAT_COUNT] += groups


@kernel
def finish_growth(frame: Frame, room: Room, growth: Growth) -> None:
    """Join all that waits, and make the root; the last block that was made."""
    counts = growth.counts
    while counts[LIST_COUNT] >= 2:
        join_lists(frame, room, growth)
    if counts[LIST_COUNT] == 1:
        start = np.int64(0)
        close_list(start, counts[ENTRY_COUNT], start, counts[SPLAT_COUNT], frame, room, growth)
        counts[ENTRY_COUNT] = 1
