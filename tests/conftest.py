"""What all tests share: the kernel cache, the fixed Hypothesis profile, seeded randomness, the real files, and the report."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from kernel_cache import kernel_cache_folder

ROOT = Path(__file__).resolve().parent.parent

# Set before numba is imported: kernels compiled from other sources are never run, here and in every process that a test starts.
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache_folder(ROOT)))

# The same examples in every run; a run that searches for new ones is started with HYPOTHESIS_PROFILE=search.
settings.register_profile("ci", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("search", deadline=None, max_examples=2000, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))

_CHECKED = pytest.StashKey[list[str]]()


@pytest.fixture
def rng() -> np.random.Generator:
    """Give random numbers that are the same in every run and in every test."""
    return np.random.default_rng(20261121)


@pytest.fixture(scope="session")
def repository() -> Path:
    """Give the root of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Give the folder of real files that lies beside the repository, or skip the test."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the folder of real files, ../shared/data, is not there")
    return folder


@pytest.fixture
def report(request: pytest.FixtureRequest) -> Callable[[str], None]:
    """Give a function that puts a line into the summary: what a test could check on this machine, and what it could not."""
    lines = request.config.stash.setdefault(_CHECKED, [])
    return lambda line: lines.append(f"{request.node.name}: {line}")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print the lines of `report`."""
    lines = config.stash.get(_CHECKED, [])
    if lines:
        terminalreporter.section("what was checked on this machine")
        for line in lines:
            terminalreporter.line(line)
