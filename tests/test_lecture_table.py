"""The table of the lectures: no number is missing, and every row has its code and its test, or says what it waits for."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest

import scanspan
from scanspan.lectures import table
from scanspan.lectures.catalog import SLIPS, Entry
from scanspan.lectures.questions import QUESTIONS
from scanspan.lectures.shipped import AWAITED, BUDGET, SHIPPED, SOUND, Awaited
from scanspan.lectures.table import Row

ROOT = Path(__file__).resolve().parent.parent
LENGTHS = {"S0": 571, "S1": 153, "S2": 518, "S3": 691, "S4": 729}

# Rows without code, each with the reason. Who builds one takes it out here and in AWAITED.
WITHOUT_CODE: dict[str, str] = {}


@cache
def names_of_tests(file: str) -> frozenset[str]:
    """Return the names of the tests in a file of the repository, none where there is no such file."""
    path = ROOT / file
    body = ast.parse(path.read_text("utf-8")).body if path.is_file() else []
    return frozenset(node.name for node in body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"))


def faults_of_entry(entry: Entry) -> list[str]:
    """Return what is wrong with an entry: its function, its test, its lines."""
    found = []
    module = inspect.getmodule(entry.function)
    owner: object = module
    for name in entry.function.__qualname__.split("."):
        owner = getattr(owner, name, None)
    if module is None or not module.__name__.startswith("scanspan.") or owner is not entry.function:
        found.append("its code is not where it says")
    if not inspect.getdoc(entry.function):
        found.append("its code has no docstring")
    file, _, name = entry.test.partition("::")
    if name not in names_of_tests(file):
        found.append(f"there is no test {entry.test}")
    lectures = entry.lecture.split()
    lines = [int(k) for part in table.split_lines(entry.lecture, entry.lines) for k in re.findall(r"\d+", part)]
    if not set(lectures) <= set(LENGTHS) or not lines or max(lines) > max(LENGTHS[name] for name in lectures):
        found.append("its lines are not in the lecture")
    return found


def faults_of(rows: Sequence[Row]) -> list[str]:
    """Return what is wrong with rows: no code and no reason, both, or entries that point at nothing."""
    found = []
    for row in rows:
        if not row.entries and row.awaited is None:
            found.append(f"{row.number}: no code and no reason")
        if row.entries and row.awaited is not None:
            found.append(f"{row.number}: code, and a reason why there is none")
        if not row.idea:
            found.append(f"{row.number}: no idea")
        found += [f"{row.number}: {fault}" for entry in row.entries for fault in faults_of_entry(entry)]
    return found


def test_every_number_has_one_row_and_they_are_in_order() -> None:
    numbers = [row.number for row in table.all_rows()]
    assert numbers == [*(str(k) for k in range(1, 124)), "123b", "124"]
    assert [row.number for row in table.budget_rows()] == ["i1", "i2", "i3", "i4", "i5", "i6"]
    assert sorted({entry.number for entry in SLIPS}) == list(range(1, 26))


def test_every_row_has_its_code_and_its_test_or_says_what_it_waits_for() -> None:
    rows = [*table.all_rows(), *table.budget_rows(), *table.rows_of_entries(SLIPS), *table.rows_of_entries(SOUND)]
    assert faults_of(rows) == []


def test_what_has_no_code_is_counted_and_has_a_reason() -> None:
    assert {item.number: item.reason for item in AWAITED} == WITHOUT_CODE
    assert {row.number for row in table.all_rows() if not row.entries} == set(WITHOUT_CODE)
    assert not [row.number for row in table.budget_rows() if not row.entries]


def test_entries_belong_to_a_number() -> None:
    known = {row.number for row in table.all_rows()}
    assert {entry.key for entry in SHIPPED} <= known
    assert {item.number for item in AWAITED} <= known
    assert {"i" + entry.key for entry in BUDGET} == {row.number for row in table.budget_rows()}
    numbers = [entry.number for entry in SHIPPED]
    assert numbers == sorted(numbers)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (
            {"test": "tests/test_rules.py::test_that_is_not_there"},
            "there is no test tests/test_rules.py::test_that_is_not_there",
        ),
        ({"test": "tests/test_nowhere.py::test_depth"}, "there is no test tests/test_nowhere.py::test_depth"),
        ({"function": lambda: None}, "its code is not where it says"),
        ({"lines": "1-900"}, "its lines are not in the lecture"),
    ],
)
def test_a_row_that_points_at_nothing_is_noticed(change: dict[str, object], fault: str) -> None:
    row = table.all_rows()[0]
    planted = row._replace(entries=(row.entries[0]._replace(**change),))  # type: ignore[arg-type]
    assert f"1: {fault}" in faults_of([planted])
    assert faults_of([row._replace(entries=())]) == ["1: no code and no reason"]
    planted_reason = Awaited("1", "S0", "16", "comes later")
    assert faults_of([row._replace(awaited=planted_reason)]) == ["1: code, and a reason why there is none"]


def test_questions_name_rows_and_have_answers() -> None:
    known = {row.number for row in table.all_rows()}
    for item in QUESTIONS:
        assert item.question.endswith("?")
        assert item.answer
        assert item.numbers
        assert set(item.numbers) <= known


def test_the_page_is_up_to_date_and_its_links_lead_somewhere() -> None:
    page = (ROOT / "docs" / "lectures.md").read_text("utf-8")
    assert page == table.as_markdown(), "run python -m scanspan.lectures.table docs/lectures.md"
    links = re.findall(r"\]\(([^)]+)\)", page)
    assert len(links) > 250
    assert [link for link in set(links) if not (ROOT / "docs" / link).is_file()] == []


def test_lines_within_wider_ones_are_left_out() -> None:
    row = next(row for row in table.all_rows() if row.number == "4")
    assert row.places == "S0 22-25"
    later = next(row for row in table.all_rows() if row.number == "25")
    assert later.places == "S0 172-181; S4 213-219"
    assert scanspan.lectures.table is table
