"""Who hears of compiling, and the second process that helps with it."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scanspan.cli.warming import Helper, show_first_triangle
from scanspan.jit import _CompileListener, log_compile
from scanspan.raster.write import unpack_depth, unpack_number
from scanspan.view.metadata import compiled_kernels, describe_kernels, used_kernels


def started(module: str) -> Any:
    """Return the event of a compile that begins."""
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=SimpleNamespace(__module__=module))})


def test_the_first_kernel_of_ours_is_announced_once() -> None:
    heard: list[bool] = []
    listener = _CompileListener(lambda: heard.append(True))
    for module, expected in (("elsewhere.kernels", 0), ("scanspan.raster.flood", 1), ("scanspan.raster.flood", 1)):
        listener.on_start(started(module))
        assert len(heard) == expected


def test_users_of_the_library_are_told_by_the_log(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    # Tests of scenes with a great many notes may have silenced the log in this process.
    monkeypatch.setattr(logging.getLogger("scanspan"), "disabled", False)
    with caplog.at_level(logging.WARNING, "scanspan"):
        log_compile()
    assert [record.getMessage() for record in caplog.records] == [
        "scanspan: compiling kernels for this machine; later starts find them on disk"
    ]


def test_the_first_triangle_is_written_as_kernels_write_it() -> None:
    triangles = SimpleNamespace(corners=np.zeros((2, 3), np.int32))
    keys, pairs = np.zeros((2, 3), np.int64), np.zeros((2, 3, 2))
    show_first_triangle("half-space", "rows", "keys", keys, triangles, None, 1)
    show_first_triangle("half-space", "rows", "pairs", pairs, triangles, None, 1)
    assert (keys == keys[0, 0]).all()
    assert unpack_depth(keys[0, 0]) == 0.5
    assert unpack_number(keys[0, 0]) == 0
    assert (pairs == (0.5, 0.0)).all()

    # Where there is none, nothing is written.
    before = keys.copy()
    show_first_triangle("half-space", "rows", "keys", keys, SimpleNamespace(corners=np.zeros((0, 3), np.int32)), None, 1)
    assert np.array_equal(keys, before)


def test_a_helper_that_fails_is_no_harm(monkeypatch: pytest.MonkeyPatch) -> None:
    with Helper() as helper:
        assert helper.result() == ([], 0.0)
        monkeypatch.setattr("scanspan.raster.options.check_threads", lambda value: 1)
        helper.start(False)
        assert helper.process is None
        monkeypatch.setattr("scanspan.raster.options.check_threads", lambda value: 2)
        monkeypatch.setattr("sys.executable", "/no/such/program")
        helper.start(False)
        assert helper.process is None
        assert helper.result() == ([], 0.0)


def test_a_helper_ends_with_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scanspan.raster.options.check_threads", lambda value: 2)
    with Helper() as helper:
        helper.start(("nothing that", "can be drawn"))
        process = helper.process
        assert process is not None
    assert process.poll() is not None
    assert helper.process is None


def test_kernels_that_another_process_compiled_are_counted() -> None:
    before = describe_kernels()
    names = set(used_kernels())
    assert before["kernels"] == len(names)
    assert before["compiled"] == len(compiled_kernels())
    assert describe_kernels(names)["compiled"] == len(names)
    assert describe_kernels(["elsewhere.kernel"])["compiled"] == before["compiled"]
