"""Memory for pictures that is used again once nobody looks at it.

The system clears each page of memory that a process has not had before, and takes back what is freed in large pieces. For a
picture of a few million pixels that takes as long as half of its triangles. So the memory of a picture that has been let go of
is kept for the next one of the same size, up to SPARE_BYTES in all. The arrays are ordinary ones, but for `base`, which is not
None: the buffer below it tells when the last array that looks at it has gone.
"""

from __future__ import annotations

import weakref
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

SPARE_BYTES = 1 << 26
LEAST_BYTES = 1 << 20  # less than this the allocator keeps by itself


class Buffer:
    """Some memory, nobody else's."""

    def __init__(self, size: int) -> None:
        self.memory = np.empty(size, np.uint8)


_spare: deque[Buffer] = deque()  # the longest unused first


def borrow(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Return an array whose values are not set, as `np.empty` does; its memory may have been another's before."""
    size = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
    if size < LEAST_BYTES or size > SPARE_BYTES:
        return np.empty(shape, dtype)
    buffer = find_spare(size) or Buffer(size)

    # All views of this array have it as their base, because what it lies in is no array.
    whole = np.frombuffer(buffer.memory.data, dtype)
    weakref.finalize(whole, give_back, buffer).atexit = False
    return whole.reshape(shape)


def find_spare(size: int) -> Buffer | None:
    """Take a buffer of a size from those that are kept, if there is one."""
    for buffer in tuple(_spare):
        if buffer.memory.nbytes == size:
            try:
                _spare.remove(buffer)
            except ValueError:  # another thread was faster
                continue
            return buffer
    return None


def give_back(buffer: Buffer) -> None:
    """Keep a buffer for later, and let go of those that have not been used for longest if there are too many."""
    _spare.append(buffer)
    while sum(kept.memory.nbytes for kept in tuple(_spare)) > SPARE_BYTES:
        try:
            _spare.popleft()
        except IndexError:  # another thread did
            return
