"""Flood fill: from a seed to all pixels that are joined to it and alike, run by run.

The lectures' fill calls itself for each of four neighbours: 4 N + 1 calls for N pixels, as deep as there are pixels, and most
calls find nothing to do. Here a stack holds spans to be looked at, a row's from left to right. The runs of alike pixels that a
span meets are filled whole, and leave spans in the rows above and below. The stack grows as it must, and nothing is called
twice. What is done is noted for each run, in place of comparing colours, so that a fill in its own colour ends too.

A row is read when a span first asks for it: all of its pixels are compared at once, and eight of them that are all like the one
before are passed over in one step. After that a span costs the same whether it is one pixel wide or a thousand. Rows that are
not asked for are never read. What a fill that asks for pixels one by one would have looked at is reckoned from the runs.

Price: O(width) for a row that is asked for, 8 bytes for a run of it, and 32 for one that is filled.

Source: the lectures; Heckbert 1990, A seed fill algorithm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.jit import bare_helper, bare_kernel, helper_kernel, kernel
from scanspan.records import Array, Int32Array, Int64Array, Integer, UInt8Array

FIRST_ROOM = 1 << 10  # runs and spans
EIGHT = np.uint64(0x0101010101010101)  # eight pixels that are alike
NOTHING = np.uint64(0)
SPANS, CHANGES, FILLED, PIXELS, LOOKS = range(5)  # what is counted


class FloodRoom(NamedTuple):
    """What a fill knows of an image of H rows and W columns. The second to the fifth grow."""

    rows: Int64Array  # (H, 2) the runs of each row, from the first to before the last; -1 for a row that was not read
    changes: Int32Array  # (2 M,) run k has columns changes[2 k] to changes[2 k + 1], the last not included
    done: UInt8Array  # (M,) 1 for a run that is filled
    spans: Int32Array  # (S, 3) row, first and last column of what is to be looked at
    filled: Int64Array  # (F, 4) runs that are filled, as segments x0, y, x1, y, both ends included
    alike: UInt8Array  # (8 K,) of one row, 1 where a pixel may be filled; 0 at its end
    counts: Int64Array  # (5,) spans, changes and runs in use, pixels filled, pixels looked at


@kernel
def make_room(height: int, width: int) -> FloodRoom:
    """Return room for a fill, of which nothing is known yet."""
    return FloodRoom(
        np.full((height, 2), -1, np.int64),
        np.empty(2 * FIRST_ROOM, np.int32),
        np.empty(FIRST_ROOM, np.uint8),
        np.empty((FIRST_ROOM, 3), np.int32),
        np.empty((FIRST_ROOM, 4), np.int64),
        np.zeros((width + 8) // 8 * 8, np.uint8),
        np.zeros(5, np.int64),
    )


@helper_kernel
def grown(array: Array, used: Integer, spare: Integer) -> Array:
    """Return an array with `spare` rows to spare: the same, or one of twice the size at least."""
    if used + spare <= array.shape[0]:
        return array
    longer = np.empty((2 * array.shape[0] + spare, *array.shape[1:]), array.dtype)
    longer[:used] = array[:used]
    return longer


@kernel
def enlarge(room: FloodRoom) -> FloodRoom:
    """Return room for one more row and all that may come of a span."""
    counts, spare = room.counts, room.alike.shape[0]
    return FloodRoom(
        room.rows,
        grown(room.changes, counts[CHANGES], spare),
        grown(room.done, counts[CHANGES] >> 1, spare),
        grown(room.spans, counts[SPANS], 2 * spare),
        grown(room.filled, counts[FILLED], spare),
        room.alike,
        counts,
    )


@bare_helper
def has_room(room: FloodRoom) -> bool:
    """Say whether a row can be read and a span be looked at."""
    counts, spare = room.counts, room.alike.shape[0]
    return bool(
        counts[CHANGES] + spare <= room.changes.shape[0]
        and (counts[CHANGES] >> 1) + spare <= room.done.shape[0]
        and counts[SPANS] + 2 * spare <= room.spans.shape[0]
        and counts[FILLED] + spare <= room.filled.shape[0]
    )


@bare_helper
def compare_row(words: Int32Array, y: Integer, color: int, tolerance: int, to_border: bool, alike: UInt8Array) -> None:
    """Say of each pixel of a row whether it is like a colour, or, in a fill up to a border, unlike the border's.

    Cost    both loops become vector instructions: eight or sixteen pixels at a time.
    """
    width = words.shape[1]
    if tolerance == 0:
        same = np.int32(color)
        for x in range(width):
            alike[x] = np.uint8((words[y, x] == same) != to_border)
        return
    red, green, blue, alpha = color & 255, color >> 8 & 255, color >> 16 & 255, color >> 24 & 255
    for x in range(width):
        word = np.int64(words[y, x])
        first = max(abs((word & 255) - red), abs((word >> 8 & 255) - green))
        second = max(abs((word >> 16 & 255) - blue), abs((word >> 24 & 255) - alpha))
        alike[x] = np.uint8((max(first, second) <= tolerance) != to_border)


@bare_helper
def read_row(words: Int32Array, room: FloodRoom, y: Integer, color: int, tolerance: int, to_border: bool) -> None:
    """Find the runs of a row. Where pixels change is written without a branch; the next change overwrites what is none."""
    alike, changes = room.alike, room.changes
    compare_row(words, y, color, tolerance, to_border, alike)
    eights, count, before = alike.view(np.uint64), room.counts[CHANGES], np.uint8(0)
    room.rows[y, 0] = count >> 1
    for e in range(eights.shape[0]):
        if eights[e] == (EIGHT if before == 1 else NOTHING):
            continue
        for x in range(8 * e, 8 * e + 8):
            changes[count] = x
            count += np.int64(alike[x] != before)
            before = alike[x]

    # A row ends with a pixel that is not alike, so every run has its end.
    for k in range(room.rows[y, 0], count >> 1):
        room.done[k] = 0
    room.rows[y, 1], room.counts[CHANGES] = count >> 1, count


@bare_helper
def first_run(room: FloodRoom, y: Integer, x: Integer) -> Integer:
    """Return the first run of a row that ends after a column; by halves, without a branch that cannot be foreseen."""
    low: Integer = room.rows[y, 0]
    size = room.rows[y, 1] - low
    while size > 0:
        half = size >> 1
        is_before = room.changes[2 * (low + half) + 1] <= x
        low = low + half + 1 if is_before else low
        size = size - half - 1 if is_before else half
    return low


@bare_kernel
def spread(words: Int32Array, room: FloodRoom, color: int, tolerance: int, to_border: bool, reach: int) -> None:
    """Look at spans, and fill what they meet, until there are no more, or no room for what one may bring.

    Shapes  words: (H, W) pixels of 32 bits; room: changed; color: packed.
    Units   reach: 1 where neighbours may share a corner, 0 where they share a side.
    """
    rows, changes, done, spans, filled, counts = room.rows, room.changes, room.done, room.spans, room.filled, room.counts
    height, width = words.shape
    while counts[SPANS] > 0 and has_room(room):
        counts[SPANS] -= 1
        top = counts[SPANS]
        y, first, last = np.int64(spans[top, 0]), np.int64(spans[top, 1]), np.int64(spans[top, 2])
        if rows[y, 0] < 0:
            read_row(words, room, y, color, tolerance, to_border)
        counts[LOOKS] += last - first + 1

        # Fill the runs that the span meets and that are not filled.
        for k in range(first_run(room, y, first), rows[y, 1]):
            start, end = np.int64(changes[2 * k]), np.int64(changes[2 * k + 1])
            if start > last:
                break
            if done[k] == 1:
                continue
            done[k] = 1
            found = counts[FILLED]
            filled[found, 0], filled[found, 1], filled[found, 2], filled[found, 3] = start, y, end - 1, y
            counts[FILLED] = found + 1
            counts[PIXELS] += end - start

            # One by one, a run's pixels are looked at, and the two beside it; the span then goes on behind it.
            beside = np.int64(start > 0) + np.int64(end < width)
            counts[LOOKS] += end - start + beside - (min(end - 1, last) - max(start, first) + 1)

            # Look above and below it later.
            low, high = max(start - reach, np.int64(0)), min(end - 1 + reach, np.int64(width - 1))
            for other in (y - 1, y + 1):
                if 0 <= other < height:
                    spans[top, 0], spans[top, 1], spans[top, 2] = other, low, high
                    top += 1
            counts[SPANS] = top


@kernel
def flood(
    words: Int32Array, room: FloodRoom, x: Integer, y: Integer, color: int, tolerance: int, to_border: bool, diagonal: bool
) -> FloodRoom:
    """Fill what is joined to a seed, and return the room, which may have grown."""
    reach = 1 if diagonal else 0
    room.spans[0, 0], room.spans[0, 1], room.spans[0, 2] = y, x, x
    room.counts[SPANS] = 1
    spread(words, room, color, tolerance, to_border, reach)
    while room.counts[SPANS] > 0:
        room = enlarge(room)
        spread(words, room, color, tolerance, to_border, reach)
    return room


@kernel
def flood_kernel(
    words: Int32Array, x: int, y: int, color: int, tolerance: int, to_border: bool, diagonal: bool, counters: Int64Array
) -> Int64Array:
    """Return the runs of all pixels that are joined to a seed, (N, 4) as segments x0, y, x1, y, both ends included.

    Shapes  words: (H, W) pixels of 32 bits; color: packed likewise, the seed's, or the border's; counters: (3,), added to:
            pixels filled, looks at a pixel by a fill that goes from pixel to pixel, runs.
    Needs   the seed lies in the image.
    Cost    O(width) for each row that is reached, O(runs). Going from pixel to pixel, one that is filled is looked at three
            times at most, one that is not four times; with diagonal, five and six times.
    """
    room = flood(words, make_room(words.shape[0], words.shape[1]), x, y, color, tolerance, to_border, diagonal)
    found = room.counts[FILLED]
    counters[0] += room.counts[PIXELS]
    counters[1] += room.counts[LOOKS]
    counters[2] += found
    return room.filled[:found].copy()
