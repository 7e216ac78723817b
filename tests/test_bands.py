"""Work shared by threads: every band is done once, whoever does it; errors and interrupts reach the caller; all ends."""

from __future__ import annotations

import os
import threading
import time
from threading import Event

import numpy as np
import pytest

from scanspan import bands
from scanspan.bands import run_bands


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
@pytest.mark.parametrize("height", [0, 1, 2, 7, 100])
def test_every_row_is_in_one_band_and_results_come_in_order(height: int, threads: int) -> None:
    found = run_bands(lambda start, end, stop: (start, end), height, threads, passes=3)
    assert [row for start, end in found for row in range(start, end)] == list(range(height))
    assert len(found) >= min(height, 3)


def test_the_caller_takes_part_and_helpers_stay() -> None:
    def who(start: int, end: int, stop: Event) -> int:
        time.sleep(0.02)
        return threading.get_ident()

    first, count = set(run_bands(who, 8, 3)), threading.active_count()
    second = set(run_bands(who, 8, 3))
    assert threading.get_ident() in first & second
    assert 1 < len(first) <= 3
    assert threading.active_count() == count


def test_a_call_within_a_call_ends() -> None:
    def outer(start: int, end: int, stop: Event) -> int:
        return sum(run_bands(lambda y, y_end, halt: y_end - y, 50, 4)) * (end - start)

    assert sum(run_bands(outer, 40, 8, each=4)) == 50 * 40


def test_where_no_helper_is_free_the_caller_does_it_all(monkeypatch: pytest.MonkeyPatch) -> None:
    class Busy:
        """Helpers that never begin."""

        def submit(self, work: object) -> bands.Future[None]:
            return bands.Future()

    monkeypatch.setattr(bands, "helpers", Busy)
    assert sum(run_bands(lambda start, end, stop: end - start, 10, 4)) == 10


@pytest.mark.parametrize("whose", ["anybody's", "a helper's"])
def test_an_error_reaches_the_caller_and_stops_the_others(whose: str) -> None:
    caller, seen = threading.get_ident(), []

    def fail(start: int, end: int, stop: Event) -> None:
        if whose == "anybody's" or threading.get_ident() != caller:
            raise ValueError(f"band {start}")
        while not stop.wait(0.01):
            seen.append(start)

    with pytest.raises(ValueError, match="band"):
        run_bands(fail, 4, 2)


def test_an_interrupt_waits_for_those_who_have_begun() -> None:
    done, caller = [], threading.get_ident()

    def work(start: int, end: int, stop: Event) -> None:
        if threading.get_ident() == caller:
            while not begun.is_set():
                time.sleep(0.001)
            raise KeyboardInterrupt
        begun.set()
        stop.wait(10)
        time.sleep(0.05)
        done.append(stop.is_set())

    begun = Event()
    with pytest.raises(KeyboardInterrupt):
        run_bands(work, 2, 2, each=1)
    assert done == [True]


def test_bands_cost_alike() -> None:
    costs = np.array([8.0, 1, 1, 1, 1, 1, 1, 1, 1, 1])
    assert run_bands(lambda start, end, stop: (start, end), 10, 2, each=1, costs=costs) == [(0, 1), (1, 10)]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_has_helpers_of_its_own() -> None:
    run_bands(lambda start, end, stop: time.sleep(0.01), 4, 2)
    child = os.fork()
    if child == 0:
        found = sum(run_bands(lambda start, end, stop: end - start, 100, 4))
        os._exit(0 if found == 100 else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
