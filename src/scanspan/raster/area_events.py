"""What happens within a row of an area sweep, in order of height: pieces begin, end and cross.

A binary heap of slots. Every piece has two: slot 2 p is where it begins or else ends, slot 2 p + 1 where it crosses the piece
that is next on its right. A slot is in the heap once or not at all, so the heap never outgrows the pieces, however many
crossings there are; where the neighbour changes, the slot is moved or taken out. Ties go to the lower slot, so that the order
of events depends on nothing but the row.

Source: Bentley and Ottmann 1979 for the events; Williams 1964 for the heap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.jit import bare_helper, bare_kernel
from scanspan.records import Int64Array, Integer

ABSENT = np.int64(-1)


class Events(NamedTuple):
    """The heap."""

    heap: Int64Array  # (S + 1,) slots; entry 0 is how many there are
    height: Int64Array  # (S,) of a slot, below the row's upper border, as a length
    place: Int64Array  # (S,) of a slot in the heap, or ABSENT


@bare_helper
def comes_first(height: Int64Array, slot: Integer, other: Integer) -> bool:
    """Say whether one slot comes before another."""
    return bool(height[slot] < height[other] or (height[slot] == height[other] and slot < other))


@bare_helper
def lift(events: Events, k: Integer) -> Integer:
    """Move the slot at a place of the heap up to where it belongs, and return its place."""
    heap, height, place = events.heap, events.height, events.place
    slot = heap[k]
    while k > 1 and comes_first(height, slot, heap[k >> 1]):
        heap[k] = heap[k >> 1]
        place[heap[k]] = k
        k = k >> 1
    heap[k] = slot
    place[slot] = k
    return k


@bare_helper
def lower(events: Events, k: Integer) -> None:
    """Move the slot at a place of the heap down to where it belongs."""
    heap, height, place = events.heap, events.height, events.place
    slot, count = heap[k], heap[0]
    while 2 * k <= count:
        child = 2 * k
        if child < count and comes_first(height, heap[child + 1], heap[child]):
            child += 1
        if not comes_first(height, heap[child], slot):
            break
        heap[k] = heap[child]
        place[heap[k]] = k
        k = child
    heap[k] = slot
    place[slot] = k


@bare_kernel
def put_event(events: Events, slot: Integer, y: Integer) -> None:
    """Let a slot be at a height, whether it was in the heap or not.

    Cost    O(log slots).
    """
    events.height[slot] = y
    k = events.place[slot]
    if k == ABSENT:
        events.heap[0] += 1
        k = events.heap[0]
        events.heap[k] = slot
    lower(events, lift(events, k))


@bare_kernel
def drop_event(events: Events, slot: Integer) -> None:
    """Take a slot out of the heap, if it is there.

    Cost    O(log slots).
    """
    k = events.place[slot]
    if k != ABSENT:
        last = events.heap[events.heap[0]]
        events.heap[0] -= 1
        events.place[slot] = ABSENT
        if last != slot:
            events.heap[k] = last
            lower(events, lift(events, k))


def make_events(slots: int) -> Events:
    """Return an empty heap for so many slots."""
    return Events(np.zeros(slots + 1, np.int64), np.empty(slots, np.int64), np.full(slots, ABSENT))
