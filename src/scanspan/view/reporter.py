"""Telling on a terminal what is going on, and nothing but what matters where nobody is watching.

Everything goes to standard error, a line at a time; the spinner is there only where that is a terminal.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

COMPILE_SECONDS = 10  # all kernels of a first picture, on a desktop machine of 2026


def to_line(text: str) -> str:
    r"""Return a text on one line, with what would move the cursor or ring the bell written out.

    >>> print(to_line("one\ntwo"))
    one\ntwo
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


class Reporter:
    """Tells on standard error what is going on: notes always, the stage on a terminal, details when asked for."""

    def __init__(self, is_verbose: bool = False) -> None:
        self.is_verbose = is_verbose
        self._status: Any = None
        self._started = time.perf_counter()

    def __enter__(self) -> Reporter:
        """Start a spinner where somebody can see it."""
        if sys.stderr.isatty():
            from rich.console import Console

            self._status = Console(stderr=True, highlight=False).status("starting")
            self._status.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take the spinner away."""
        if self._status is not None:
            self._status.stop()
            self._status = None

    def stage(self, text: str) -> None:
        """Say what is being done now."""
        self.detail(text)
        if self._status is not None:
            from rich.markup import escape

            self._status.update(escape(to_line(text)))

    def note(self, text: str) -> None:
        """Say something that the user should know."""
        print(f"scanspan: {to_line(text)}", file=sys.stderr, flush=True)

    def detail(self, text: str) -> None:
        """Say something for the curious, with the seconds since the start."""
        if self.is_verbose:
            self.note(f"{time.perf_counter() - self._started:6.2f} s  {text}")

    def await_kernels(self, begin: Callable[[], None] = lambda: None) -> None:
        """Tell when kernels have to be compiled, once, and call what is to be begun then."""
        from scanspan.jit import on_first_compile

        def announce() -> None:
            """Tell, and begin."""
            self.note(f"compiling kernels for this machine, once (about {COMPILE_SECONDS} s)")
            begin()

        on_first_compile(announce)
