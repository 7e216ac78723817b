"""Memory of pictures: it is used again when nobody looks at it, and never before."""

from __future__ import annotations

import gc

import numpy as np
import pytest

import scanspan as ss
from scanspan import memory

SHAPE = (512, 1024)


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setattr(memory, "_spare", type(memory._spare)())


def address(array):
    return array.__array_interface__["data"][0]


def kept():
    gc.collect()
    return sum(buffer.memory.nbytes for buffer in memory._spare)


@pytest.mark.parametrize(
    "look", [lambda a: a, lambda a: a[::2, 1:], lambda a: a.T, lambda a: a.view(np.int32), lambda a: a.reshape(-1)[5:6],
             memoryview, lambda a: a[3].view(np.recarray), lambda a: np.asarray(memoryview(a))],
)  # fmt: skip
def test_memory_is_kept_from_others_as_long_as_anybody_looks_at_it(look):
    array = memory.borrow(SHAPE, np.float32)
    place, seen = address(array), look(array)
    del array
    assert kept() == 0
    other = memory.borrow(SHAPE, np.float32)
    assert address(other) != place
    del seen
    assert kept() == 4 * 512 * 1024
    assert address(memory.borrow(SHAPE, np.int32)) == place


def test_small_and_huge_arrays_are_left_to_the_allocator(monkeypatch):
    monkeypatch.setattr(memory, "SPARE_BYTES", 1 << 22)
    for shape in ((3, 4), (0, 7), (1024, 1025)):
        array = memory.borrow(shape, np.float32)
        assert array.shape == shape
        assert array.flags.owndata
        del array
        assert kept() == 0


def test_the_longest_unused_goes_first(monkeypatch):
    monkeypatch.setattr(memory, "SPARE_BYTES", 1 << 22)
    first, second = memory.borrow((1 << 20,), np.uint8), memory.borrow((3 << 20,), np.uint8)
    del first
    del second
    assert kept() == 4 << 20
    third = memory.borrow((2 << 20,), np.uint8)
    del third
    assert kept() == 2 << 20


def test_an_empty_picture_after_a_full_one_is_empty():
    """What was seen before must not shine through, in any field."""
    clip, size = np.array([(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)], np.float64), (1024, 768)
    corner = clip * (0.01, 0.01, 1, 1)
    for places in (clip, corner, clip):
        seen = ss.rasterize(places, [(0, 1, 2)], size)
        found = ss.interpolate(seen, np.ones((3, 3), np.float32))
        there = seen.primitive == 0
        assert np.array_equal(found, np.repeat(there[..., None], 3, axis=2).astype(np.float32))
        assert np.array_equal(np.isneginf(seen.depth), ~there)
        assert there.all() if places is clip else 0 < there.sum() < 200
        del seen, found
    assert kept() > 0


def test_what_one_picture_shows_is_not_changed_by_the_next():
    rng = np.random.default_rng(3)
    clip = rng.normal(size=(300, 4))
    clip[:, 3] = 2.0
    pictures = []
    for shift in range(4):
        seen = ss.rasterize(clip + np.array([shift / 4, 0, 0, 0]), np.arange(300).reshape(-1, 3), (700, 600))
        pictures.append((seen, ss.interpolate(seen, clip), *(a.copy() for a in (seen.primitive, seen.depth))))
    for seen, values, primitive, depth in pictures:
        assert np.array_equal(seen.primitive, primitive)
        assert np.array_equal(seen.depth, depth)
        assert np.array_equal(ss.interpolate(seen, clip), values)
        assert not np.shares_memory(seen.primitive, seen.planes[0].slot)
