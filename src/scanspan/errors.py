"""The errors that scanspan raises, all of them at the public boundary.

A message says in one line what was expected, what came and where it was found. Kernels never raise: whatever reaches them has
been checked before. Source: the rules in docs/architecture.md.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class ScanspanError(Exception):
    """Base class of every error that scanspan raises on purpose."""


class InputError(ScanspanError, ValueError):
    """An argument or a value in an array cannot be used; the message quotes it."""


class LimitError(InputError):
    """The request is larger than a limit that protects the machine; the message names the option that raises the limit."""


class FormatError(InputError):
    """A file cannot be read: missing, a folder, truncated, corrupt, or of an unknown kind.

    Parameters
    ----------
    path : the file as the caller named it.
    problem : one line, what was expected and what came.
    where : position in the file, such as ``line 12`` or ``byte 80``; empty when there is none.
    """

    def __init__(self, path: str | Path, problem: str, where: str = "") -> None:
        self.path = str(path)
        self.problem = problem
        self.where = where
        super().__init__(f"{self.path}: {where + ': ' if where else ''}{problem}")


def unknown_name(kind: str, name: object, valid: Iterable[str]) -> InputError:
    """Return the error for a name that is not one of the valid ones, with the nearest valid name as a suggestion.

    >>> print(unknown_name("rule", "topleft", ["top-left", "inclusive"]))
    unknown rule 'topleft'; did you mean 'top-left'? The valid ones are: top-left, inclusive
    """
    names = list(valid)
    near = difflib.get_close_matches(str(name), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ";"
    return InputError(f"unknown {kind} {name!r}{hint} The valid ones are: {', '.join(names)}".replace("; The", "; the"))
