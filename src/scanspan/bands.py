"""Work that threads share: bands of rows, or parts of a list, each done by one of them.

The thread that calls takes part, and helpers stay for the next call: to start one takes a millisecond on some machines, as
long as a small picture. A band is anybody's who comes first, so that one who is early has something to do, and where no helper
is free, as in a call within a call, the caller does all of it. The result is the same whoever does what.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from itertools import pairwise
from threading import Event
from typing import Any

import numpy as np

from scanspan.records import Float64Array

NEVER = Event()  # to stop; what one thread does is not stopped by another
MOST_HELPERS = 4096  # threads; they are made when they are wanted

_helpers: list[ThreadPoolExecutor] = []  # one, once it was needed


def helpers() -> ThreadPoolExecutor:
    """Return the helpers of this process."""
    if not _helpers:
        _helpers.append(ThreadPoolExecutor(MOST_HELPERS, "scanspan"))
    return _helpers[0]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helpers.clear)  # threads stay with the parent


def run_bands(
    work: Callable[[int, int, Event], Any], height: int, threads: int, passes: int = 1, each: int = 2,
    costs: Float64Array | None = None,
) -> list[Any]:  # fmt: skip
    """Call `work(y_start, y_end, stop)` for bands of rows and return what it gave, from the top band to the bottom one.

    At least `passes` bands, and two a thread, so that one that finishes early has something to do; `each` a thread where it is
    dear that every band looks at everything. `stop` is set when the others need not go on. With the `costs` of rows, (height,),
    bands cost alike and may be empty; without, they are equally high.
    """
    count = max(1, min(max(passes, each * threads if threads > 1 else 1), height))
    edges = [height * i // count for i in range(count + 1)]
    sums = np.cumsum(costs) if costs is not None else np.zeros(1)
    if count > 1 and sums[-1] > 0.0:
        edges[1:-1] = np.searchsorted(sums, sums[-1] * np.arange(1, count) / count).tolist()
    if threads == 1 or count == 1:
        return [work(y_start, y_end, NEVER) for y_start, y_end in pairwise(edges)]

    stop, waiting = Event(), deque(range(count))
    found: list[Any] = [None] * count

    def take_part() -> None:
        """Do bands until there are none left."""
        try:
            while waiting and not stop.is_set():
                try:
                    i = waiting.popleft()
                except IndexError:  # another was faster
                    return
                found[i] = work(edges[i], edges[i + 1], stop)
        except BaseException:
            stop.set()
            raise

    others: list[Future[None]] = []
    try:
        for _ in range(min(threads, count) - 1):
            others.append(helpers().submit(take_part))
        take_part()
    except BaseException:
        stop.set()
        raise
    finally:
        let_end(others, stop)
    for other in others:
        if not other.cancelled():
            other.result()
    return found


def let_end(others: list[Future[None]], stop: Event) -> None:
    """Wait for those who have begun, as they write into arrays of the caller; do not wait for those who have not."""
    begun = [other for other in others if not other.cancel()]
    try:
        wait(begun)
    except BaseException:
        stop.set()
        wait(begun)
        raise
