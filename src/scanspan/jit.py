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
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numba.core.config
from numba.core import caching, compiler, event, registry
from numba.core.runtime import nrt

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


class KernelCache(caching._Cache):
    """The machine code of one kernel on disk: numba's own cache, made when the kernel is first called, and quicker to load.

    Before numba looks for a kernel on disk it prepares itself for compiling: it imports, and registers, what it knows of all
    functions of Python and NumPy (SciPy too, where it is installed). That takes longer than all else in a start, and longer
    again when Python ends; to load machine code takes no more than the part of it that allocates arrays. The rest is done
    by the compiler itself where a kernel is not found. docs/decisions/0019-starts.md.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @cached_property
    def _on_disk(self) -> Any:
        """The cache of numba, which looks for the folder in force when it is made; other users of numba keep theirs."""
        before = config.CACHE_DIR
        try:
            config.CACHE_DIR = CACHE_FOLDER
            return caching.FunctionCache(self._function)
        finally:
            config.CACHE_DIR = before

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the kernel compiled for some types of arguments, or None where it is not on disk."""
        nrt.rtsys.initialize(target_context)
        with self._on_disk._guard_against_spurious_io_errors():
            return self._on_disk._load_overload(sig, target_context)

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep what was compiled."""
        self._on_disk.save_overload(sig, cres)

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self._on_disk.cache_path)

    def enable(self) -> None:
        """Use what is on disk, as at first."""
        self._on_disk.enable()

    def disable(self) -> None:
        """Use nothing that is on disk."""
        self._on_disk.disable()

    def flush(self) -> None:
        """Forget what is on disk."""
        self._on_disk.flush()


class PartDispatcher(registry.CPUDispatcher):
    """A kernel that other kernels call, and Python does not, so that it is compiled without the code that Python calls it by.

    To make that for every part of a kernel took a fifth of the time until the first picture. Where Python does call one, as
    tests and lectures do, it is compiled once more, with that code.
    """

    @cached_property
    def _whole(self) -> Any:
        """The same function as Python may call it."""
        return registry.CPUDispatcher(self.py_func, targetoptions=self.targetoptions | {"no_cpython_wrapper": False})

    def add_overload(self, cres: Any) -> None:
        """Keep what was compiled for kernels, and from Python, which would call what is not there."""
        self.overloads[tuple(cres.signature.args)] = cres

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        """Return what Python is to call, which asks here as often as it calls, as no machine code was kept for it."""
        return self._whole


class DistinctCompiler(compiler.Compiler):
    """Compiles functions whose arrays do not lie over each other."""

    def __init__(self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, local_types: Any) -> None:
        flags.noalias = True
        super().__init__(typing, target, library, args, result, flags, local_types)  # type: ignore[no-untyped-call]


def _declare(
    function: Function, is_part: bool = False, is_cached: bool = False, pipeline: Any = compiler.Compiler, **options: Any
) -> Function:
    """Declare a kernel; without the code by which C would call it, and where it is part of others, without that for Python."""
    if config.DISABLE_JIT:
        return function
    options |= {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": None}
    options |= {"no_cfunc_wrapper": True, "no_cpython_wrapper": is_part}
    declared: Any = (PartDispatcher if is_part else registry.CPUDispatcher)(
        function, targetoptions=options, pipeline_class=pipeline
    )
    if is_cached:
        declared._cache = KernelCache(function)
    return cast(Function, declared)


def kernel(function: Function) -> Function:
    """Declare a kernel: compiled on first use, cached on disk, and it lets other threads run."""
    return _declare(function, is_cached=True)


def inline_kernel(function: Function) -> Function:
    """Declare a kernel that is pasted into its callers; it may take other kernels as arguments and has no code of its own."""
    return _declare(function, inline="always")


def helper_kernel(function: Function) -> Function:
    """Declare a small kernel that the compiler must paste into the machine code of whoever calls it."""
    return _declare(function, is_part=True, forceinline=True)


def part_kernel(function: Function) -> Function:
    """Declare a kernel that only kernels call, too large to be pasted into them; it is cached as they are."""
    return _declare(function, is_part=True, is_cached=True)


def bare_kernel(function: Function) -> Function:
    """Declare a kernel that makes no arrays and keeps none, so that it need not count who uses those that it is given.

    Counting is an atomic operation for every array at every call within a loop; where a kernel is many small functions, that
    can be four fifths of its time (docs/decisions/0011-area.md). Its callers hold the arrays. It is cached as kernels are.
    """
    return _declare(function, is_cached=True, _nrt=False)


def distinct_kernel(function: Function) -> Function:
    """Declare a bare kernel none of whose arrays lies over another, so that the compiler need not ask in every row.

    Where it would have to, and a row is one vector, it gives up vectors altogether. Callers see to it that it is so.
    """
    return _declare(function, is_cached=True, pipeline=DistinctCompiler, _nrt=False)


def bare_part(function: Function) -> Function:
    """Declare a bare kernel that only kernels call."""
    return _declare(function, is_part=True, is_cached=True, _nrt=False)


def bare_helper(function: Function) -> Function:
    """Declare a helper kernel for bare kernels: pasted into them, and as bare as they are."""
    return _declare(function, is_part=True, forceinline=True, _nrt=False)


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


def has_kernels() -> bool:
    """Say whether any kernel was ever compiled here; if not, all that a picture needs will have to be."""
    return os.path.isdir(CACHE_FOLDER)


def compile_seconds() -> float:
    """Return how long this process has compiled so far, in seconds; a kernel that was found on disk takes none."""
    return _LISTENER.seconds


def signature_count(function: Any) -> int:
    """Return how many argument types a kernel has been compiled or loaded for."""
    return len(function.signatures)
