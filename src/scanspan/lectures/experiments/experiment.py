"""What an experiment is: a slide, an idea, a function that returns numbers and pictures, and the line of code that does it.

The functions that make them stand in the other files of this folder, by theme. The command line prints what they return and the
report puts it on a page; both write a number by `written`, so that it reads the same wherever it is met.
"""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanspan.lectures.experiments.figure import Panel, compose
from scanspan.records import UInt8Array

Row = tuple[Any, ...]  # of words and numbers
PACKAGE = Path(__file__).parents[2]


class Table(NamedTuple):
    """Numbers with headings; the first column tells what a row is about."""

    headings: tuple[str, ...]
    rows: tuple[Row, ...]

    def value(self, label: str, heading: str | int = 1) -> Any:
        """Return one number by the first cell of its row and by its heading, or the number of the column.

        >>> Table(("n", "square"), ((2, 4), (3, 9))).value(3, "square")
        9
        """
        column = heading if isinstance(heading, int) else self.headings.index(heading)
        return next(row[column] for row in self.rows if row[0] == label)


class Result(NamedTuple):
    """What an experiment found."""

    numbers: Table
    panels: tuple[Panel, ...]

    @property
    def picture(self) -> UInt8Array:
        """(H, W, 3) uint8, all panels on one sheet, with their captions."""
        return compose(self.panels)


class Source(NamedTuple):
    """Some lines of code, and where they stand."""

    file: str  # from the folder of the package
    line: int  # of the one that does it
    first: int  # of the lines that are shown
    code: str


class Experiment(NamedTuple):
    """An experiment, and the slide that it is about."""

    name: str  # for the command line
    lecture: str  # "S0" to "S4"
    lines: str  # of the lecture's text
    slide: str  # its title
    title: str
    idea: str
    function: Callable[[], Result]
    items: tuple[int, ...]  # the numbers under which the lectures were taken apart
    source: Callable[..., Any]  # the function whose line does it
    statement: str  # a part of that line
    slips: tuple[int, ...] = ()  # of the lecture's mistakes

    def run(self) -> Result:
        """Run it."""
        return self.function()

    @property
    def place(self) -> tuple[str, int]:
        """What to sort by: the lecture, then the line."""
        return self.lecture, int(self.lines.split("-")[0].split(",")[0].split(";")[0])

    @property
    def told_lines(self) -> str:
        """The lines in words."""
        return f"lines {self.lines}" if "-" in self.lines else f"line {self.lines}"

    def find_source(self, around: int = 3) -> Source:
        """Return the line that does it, with a few lines around it that belong to the same function."""
        function = getattr(self.source, "py_func", self.source)
        lines, start = inspect.getsourcelines(function)
        hit = next(k for k, line in enumerate(lines) if self.statement in line)
        first, last = max(hit - around, 0), min(hit + around + 1, len(lines))
        while not lines[first].strip():
            first += 1
        code = textwrap.dedent("".join(lines[first:last])).rstrip("\n")
        file = Path(inspect.getsourcefile(function) or "").relative_to(PACKAGE.parent).as_posix()
        return Source(file, max(start, 1) + hit, max(start, 1) + first, code)


def table(*rows: Row, headings: tuple[str, ...] = ("", "")) -> Table:
    """Return a table of rows."""
    return Table(headings, rows)


def written(value: Any) -> str:
    """Return a number as it is printed.

    >>> [written(value) for value in (1234567, 0.1, 1 / 3, 4.0e-8, True, np.float32(0.1), "as it is")]
    ['1,234,567', '0.1', '0.333333', '4e-08', 'yes', '0.1', 'as it is']
    """
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, np.integer)):
        return f"{int(value):,}"
    if isinstance(value, np.float32):
        return str(value)
    if isinstance(value, (float, np.floating)):
        return f"{value + 0.0:.6g}"
    return str(value)


def aligned(numbers: Table, narrow: int = 14) -> str:
    """Return a table as text: columns of numbers to the right, words to the left, long headings in several lines.

    >>> print(aligned(table(("pixels", 12), ("gaps", 3))))
    pixels  12
    gaps     3
    """
    body = [[written(cell) for cell in row] for row in numbers.rows]
    columns = range(len(numbers.headings))
    is_word = [k == 0 or all(isinstance(row[k], str) for row in numbers.rows) for k in columns]
    widths = [max(len(row[k]) for row in body) for k in columns]

    # Break headings where they are wider than their column, and set them at its foot.
    heads = [textwrap.wrap(name, max(width, narrow), break_long_words=False) for name, width in zip(numbers.headings, widths)]
    widths = [max([width, *map(len, head)]) for width, head in zip(widths, heads)]
    depth = max(map(len, heads))
    top = [[head[k - depth] if k >= depth - len(head) else "" for head in heads] for k in range(depth)]
    lines = [
        "  ".join(cell.ljust(w) if word else cell.rjust(w) for cell, w, word in zip(row, widths, is_word)).rstrip()
        for row in top + body
    ]
    if depth:
        lines.insert(depth, "  ".join("-" * w for w in widths))
    return "\n".join(lines)
