"""The one file that touches numba: how kernels are declared, where their machine code is cached, and who hears of compiling.

A kernel is a plain function of arrays and numbers. It never raises and never checks, so that it could be compiled ahead of
time. `kernel` compiles it on its first call and caches the machine code on disk; `inline_kernel` pastes it into the kernel that
calls it, which is how a traversal takes its writer as an argument at no cost (docs/decisions/0001-the-seam.md).

No fastmath and no contraction: the same bits on every processor.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numba.core.config
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., Any])

config: Any = numba.core.config  # its settings are made while it is imported, so no type checker knows them


def _is_writable(folder: Path) -> bool:
    """Say whether files can be made in a folder, or in the nearest parent that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def source_hash() -> str:
    """Return a hash of the names and contents of all sources of the package."""
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def cache_folder() -> str:
    """Return the folder for machine code: beside the sources, else in the user's cache, else among the temporary files.

    Its name holds a hash of the sources. numba compares only the file that a kernel stands in, and would go on running what was
    compiled from a helper in another file before that was changed. NUMBA_CACHE_DIR, where it is set, is used as it is. In a
    read-only install without a home, a private folder among the temporary files takes the place of both; its owner is checked,
    because what lies in it is run.
    """
    if config.CACHE_DIR:
        return str(config.CACHE_DIR)
    name = f"kernels-{source_hash()}"
    beside = Path(__file__).parent / "__pycache__"
    if _is_writable(beside):
        # Leave no folders of older sources behind.
        for old in beside.glob("kernels-*"):
            if old.name != name:
                shutil.rmtree(old, ignore_errors=True)
        return str(beside / name)
    home = Path(os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")) / "scanspan"
    if _is_writable(home):
        return str(home / name)
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"scanspan-kernels-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        trusted = not hasattr(os, "getuid") or (folder.stat().st_uid == user and not folder.is_symlink())
        if trusted and _is_writable(folder):
            return str(folder / name)
    except OSError:
        pass
    return tempfile.mkdtemp(prefix="scanspan-kernels-")


CACHE_FOLDER = cache_folder()


def _declare(function: Function, **options: Any) -> Function:
    """Declare a kernel with the cache folder in force for this declaration alone, so that other users of numba keep theirs."""
    before = config.CACHE_DIR
    try:
        config.CACHE_DIR = CACHE_FOLDER
        declared: Function = numba.njit(nogil=True, error_model="numpy", **options)(function)
        return declared
    finally:
        config.CACHE_DIR = before


def kernel(function: Function) -> Function:
    """Declare a kernel: compiled on first use, cached on disk, and it lets other threads run."""
    return _declare(function, cache=True)


def inline_kernel(function: Function) -> Function:
    """Declare a kernel that is pasted into its callers; it may take other kernels as arguments and has no code of its own."""
    return _declare(function, inline="always")


def helper_kernel(function: Function) -> Function:
    """Declare a small kernel that the compiler must paste into the machine code of whoever calls it."""
    return _declare(function, forceinline=True)


def bare_kernel(function: Function) -> Function:
    """Declare a kernel that makes no arrays and keeps none, so that it need not count who uses those that it is given.

    Counting is an atomic operation for every array at every call within a loop; where a kernel is many small functions, that
    can be four fifths of its time (docs/decisions/0011-area.md). Its callers hold the arrays. It is cached as kernels are.
    """
    return _declare(function, cache=True, _nrt=False)


def bare_helper(function: Function) -> Function:
    """Declare a helper kernel for bare kernels: pasted into them, and as bare as they are."""
    return _declare(function, forceinline=True, _nrt=False)


def log_compile() -> None:
    """Tell users of the library that they wait for the compiler; a program's own logging decides where that is seen."""
    logging.getLogger("scanspan").warning("scanspan: compiling kernels for this machine; later starts find them on disk")


class _CompileListener(event.Listener):
    """Calls a function at the first kernel of ours that is compiled (a cache hit is no compile), and adds up the time."""

    def __init__(self, announce: Callable[[], None]) -> None:
        self.announce = announce
        self.told = False
        self.depth = 0  # compiling a kernel begins with compiling what it calls
        self.began = 0.0
        self.seconds = 0.0

    def on_start(self, event: Any) -> None:
        """Tell once, and look at the clock."""
        if not self.told and event.data["dispatcher"].py_func.__module__.startswith("scanspan."):
            self.told = True
            self.announce()
        if self.depth == 0:
            self.began = time.perf_counter()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """Add what the kernel took with all that it calls."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self.began


_LISTENER = _CompileListener(log_compile)
event.register("numba:compile", _LISTENER)


def on_first_compile(announce: Callable[[], None]) -> None:
    """Call `announce` when a kernel is about to be compiled in this process for the first time, in the place of a log entry."""
    _LISTENER.announce = announce


def compile_seconds() -> float:
    """Return how long this process has compiled so far, in seconds; a kernel that was found on disk takes none."""
    return _LISTENER.seconds


def signature_count(function: Any) -> int:
    """Return how many argument types a kernel has been compiled or loaded for."""
    return len(function.signatures)
