"""The table of all items: what each number says, where its code is and which test holds it; as rows and as `docs/lectures.md`.

The page is written by `python -m scanspan.lectures.table docs/lectures.md`, from ideas.py, catalog.py, shipped.py and
questions.py, so that there is one place for each fact. `scanspan lecture list` may read the same rows.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from scanspan.lectures.catalog import PORTS, SLIPS, Entry
from scanspan.lectures.ideas import BUDGET_IDEAS, IDEAS, Idea
from scanspan.lectures.questions import QUESTIONS
from scanspan.lectures.shipped import AWAITED, BUDGET, SHIPPED, SOUND, Awaited

LECTURES = {
    "S0": "scan converting triangles, in C#",
    "S1": "edge equations",
    "S2": "rasterization",
    "S3": "scan-line hidden surfaces and homogeneous coordinates",
    "S4": "scan converting triangles, in Java",
}

HEAD = """# The lectures, number by number

Every item of the five lectures with where it lives and the test that holds it. {intro}

Code whose name begins with `demonstrate_` runs without arguments and returns numbers. Lines are those of the lectures' text.
This page is written by `python -m scanspan.lectures.table docs/lectures.md`; a test holds that it is up to date, that no number
is missing, and that everything named here exists.

"""


class Row(NamedTuple):
    """One item: what it says, and all that belongs to it."""

    number: str
    slide: str  # the slide's title; empty where there is none
    idea: str
    entries: tuple[Entry, ...]
    awaited: Awaited | None  # where there is no code yet

    @property
    def places(self) -> str:
        """Lectures and lines, such as "S0 46-52; S4 66-76"."""
        named = [(entry.lecture, entry.lines) for entry in self.entries]
        if self.awaited is not None:
            named.append((self.awaited.lecture, self.awaited.lines))
        found: dict[str, set[str]] = {}
        for lectures, lines in named:
            for lecture, part in zip(lectures.split(), split_lines(lectures, lines), strict=True):
                found.setdefault(lecture, set()).update(part.split(", "))
        return "; ".join(f"{lecture} {', '.join(widest(found[lecture]))}" for lecture in sorted(found))


def widest(ranges: Iterable[str]) -> list[str]:
    """Return ranges of lines in order, without those that lie in another.

    >>> widest({"25", "40-44", "22-25"})
    ['22-25', '40-44']
    """
    ends = sorted({(int(part.split("-")[0]), int(part.split("-")[-1])) for part in ranges})
    kept = [(a, b) for a, b in ends if not any((c, d) != (a, b) and c <= a and b <= d for c, d in ends)]
    return [f"{a}-{b}" if a < b else str(a) for a, b in kept]


def split_lines(lectures: str, lines: str) -> list[str]:
    """Return the lines of each lecture: "46-52; 66-76" for two, while those of one lecture stay together.

    >>> split_lines("S0 S4", "273, 370-393; 363-364"), split_lines("S3", "214; 240-264")
    (['273, 370-393', '363-364'], ['214, 240-264'])
    """
    parts = lines.split("; ")
    return parts if len(lectures.split()) == len(parts) else [", ".join(parts)]


def make_rows(ideas: Iterable[Idea], entries: Iterable[Entry], prefix: str = "") -> tuple[Row, ...]:
    """Put ideas, entries and what is awaited together by their numbers, in the order of the ideas."""
    by_key: dict[str, list[Entry]] = {}
    for entry in entries:
        by_key.setdefault(prefix + entry.key, []).append(entry)
    awaited = {item.number: item for item in AWAITED}
    return tuple(
        Row(idea.number, idea.slide, idea.idea, tuple(by_key.get(idea.number, ())), awaited.get(idea.number)) for idea in ideas
    )


def all_rows() -> tuple[Row, ...]:
    """Return the rows 1 to 124.

    >>> len(all_rows()), all_rows()[104].entries[0].home
    (125, 'scanspan.homogeneous.incidence.join')
    """
    return make_rows(IDEAS, [*PORTS, *SHIPPED])


def budget_rows() -> tuple[Row, ...]:
    """Return the rows of the integer budget, i1 to i6."""
    return make_rows(BUDGET_IDEAS, BUDGET, "i")


def rows_of_entries(entries: Sequence[Entry]) -> tuple[Row, ...]:
    """Return a row for each number of a list of entries whose titles say all."""
    keys = list(dict.fromkeys(entry.key for entry in entries))
    grouped = [tuple(entry for entry in entries if entry.key == key) for key in keys]
    return tuple(
        Row(key, "", "; ".join(entry.title for entry in found), found, None)
        for key, found in zip(keys, grouped, strict=True)
    )  # fmt: skip


def link_to_code(function: Callable[..., Any]) -> str:
    """Return a link to the file that a function is in, named as the file below the package and the function.

    >>> link_to_code(make_rows)
    '[`lectures/table.py:make_rows`](../src/scanspan/lectures/table.py)'
    """
    path = "/".join(home_module(function).split(".")[1:]) + ".py"
    return f"[`{path}:{function.__qualname__}`](../src/scanspan/{path})"


def home_module(function: Callable[..., Any]) -> str:
    """Return the dotted name of the module file that defines a function."""
    module = inspect.getmodule(function)
    name = function.__module__ if module is None else module.__name__
    return f"{name}.__init__" if hasattr(module, "__path__") else name


def link_to_test(entry: Entry) -> str:
    """Return a link to the file of an entry's test.

    >>> link_to_test(PORTS[0])
    '[`test_three_lines_are_a_triangle`](../tests/test_lecture_edges.py)'
    """
    file, name = entry.test.split("::")
    return f"[`{name}`](../{file})"


def as_table(rows: Sequence[Row]) -> str:
    """Return rows as a table of Markdown."""
    lines = ["| no. | where | what | code | test |", "|---|---|---|---|---|"]
    for row in rows:
        where = f"{row.slide}<br>{row.places}" if row.slide else row.places or "not on a slide"
        codes = list(dict.fromkeys(link_to_code(entry.function) for entry in row.entries))
        tests = list(dict.fromkeys(link_to_test(entry) for entry in row.entries))
        if row.awaited is not None:
            codes.append(f"*{row.awaited.reason}*")
        what = row.idea.replace("|", "\\|")
        lines.append(f"| {row.number} | {where} | {what} | {'<br>'.join(codes)} | {'<br>'.join(tests)} |")
    return "\n".join(lines) + "\n"


def as_markdown() -> str:
    """Return the whole page."""
    lectures = "; ".join(f"{name} is the one on {topic}" for name, topic in LECTURES.items())
    parts = [HEAD.format(intro=f"{lectures}."), as_table(all_rows())]
    parts += ["\n## The integer budget of 12-bit fixed point\n\n", as_table(budget_rows())]
    parts += ["\n## Slips, found and shown\n\n", as_table(rows_of_entries(SLIPS))]
    parts += ["\n## What looks like a slip and is none\n\n", as_table(rows_of_entries(SOUND))]
    parts += ["\n## Questions, answered\n\n", "| question | answer | no. |\n|---|---|---|\n"]
    parts += [f"| {item.question} | {item.answer} | {', '.join(item.numbers)} |\n" for item in QUESTIONS]
    return "".join(parts)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(as_markdown(), "utf-8")
