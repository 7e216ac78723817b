"""The lectures' table of contents: every entry points at a function, at lines of a lecture and at a test that exist."""

from __future__ import annotations

import ast
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import scanspan as ss
from scanspan.errors import InputError
from scanspan.lectures import PORTS, SLIPS, find, sampling
from scanspan.lectures.catalog import Entry
from scanspan.lectures.shipped import SHIPPED

# The lengths of the five documents in lines.
LENGTHS = {"S0": 571, "S1": 153, "S2": 518, "S3": 691, "S4": 729}


def line_ranges(entry: Entry) -> list[tuple[int, int]]:
    """Return the first and last lines that an entry names, all together."""
    found = [tuple(int(k) for k in part.split("-")) for part in re.split("[;,] ", entry.lines)]
    return [(part[0], part[-1]) for part in found]


def test_the_lectures_are_looked_up_on_first_use() -> None:
    code = "import json, sys, scanspan; before = 'scanspan.lectures' in sys.modules; scanspan.lectures.PORTS; "
    code += "print(json.dumps([before, 'lectures' in dir(scanspan)]))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert json.loads(ended.stdout) == [False, True]
    assert ss.lectures.PORTS is PORTS


@pytest.mark.parametrize("entry", [*PORTS, *SLIPS], ids=lambda entry: f"{entry.number} {entry.title}")
def test_an_entry_points_at_what_is_there(entry: Entry, repository: Path) -> None:
    # The function, and that its docstring says something.
    assert entry.home.startswith("scanspan.lectures.")
    assert inspect.getdoc(entry.function)

    # Lines of the lectures, one range for each at least.
    names, ranges = entry.lecture.split(), line_ranges(entry)
    assert set(names) <= set(LENGTHS)
    assert len(ranges) >= len(names)
    assert all(0 < first <= last <= max(LENGTHS[name] for name in names) for first, last in ranges)

    # The test, whose name is that of a function in that file.
    file, name = entry.test.split("::")
    tree = ast.parse((repository / file).read_text("utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_numbers_are_in_order_and_complete() -> None:
    numbers = [entry.number for entry in PORTS]
    assert numbers == sorted(numbers)
    assert {*range(19, 25), *range(28, 42), *range(43, 48), *range(52, 62), *range(63, 74)} <= set(numbers)
    slips = [entry.number for entry in SLIPS]
    assert slips == sorted(slips)


def test_every_demonstration_is_listed() -> None:
    listed = {entry.home for entry in [*PORTS, *SLIPS, *SHIPPED]}
    modules = {inspect.getmodule(entry.function) for entry in [*PORTS, *SLIPS]} | {ss.lectures.fixed_point_faults, sampling}
    for module in modules:
        for name, function in inspect.getmembers(module, inspect.isfunction):
            if name.startswith("demonstrate_") and function.__module__ == getattr(module, "__name__", ""):
                assert f"{function.__module__}.{name}" in listed


def test_a_demonstration_returns_numbers() -> None:
    assert find(67)[0].is_demonstration
    assert not find(69)[0].is_demonstration
    assert [entry.title for entry in find(9, is_slip=True)] == ["index 6"]
    assert find(9, is_slip=True)[0].function().crashes == 1


def test_a_number_without_a_program_is_refused() -> None:
    with pytest.raises(InputError, match=r"^number = 6: no program of the lectures has it; those with one: 7, 8, 10, "):
        find(6)
