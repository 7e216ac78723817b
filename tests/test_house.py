"""The rules of the house, checked by machine: who may import whom, style, types, sizes, names, and what must not be in a file.

Each rule that is searched for by our own code is also shown a fault that it must find.
"""

from __future__ import annotations

import ast
import importlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "src" / "scanspan"

# In pipeline order; the import contract holds it, and the names sort in it.
STAGES = ("assets", "geometry", "raster", "shade", "target", "view")

# Budgets in lines, and what is allowed beyond them: a name here needs a reason beside it.
FILE_BUDGET = 450
FUNCTION_BUDGET = 80
LONG_FILES: dict[str, int] = {}
LONG_FUNCTIONS: dict[str, int] = {}

# Words that are not used as names or in names (docs/architecture.md, names), and words that are no verb for a function.
FORBIDDEN_WORDS = frozenset({"data", "info", "tmp", "impl", "rc", "pt", "tri", "col", "proj"})
FORBIDDEN_VERBS = ("process", "handle", "do")
# The command `scanspan info`, the folder ../shared/data, and what pytest calls its folders.
ALLOWED_NAMES = frozenset({"info", "shared_data", "tmp_path", "tmp_path_factory"})


def python(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python in the repository root and return how it ended."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300)


def python_files(*folders: str) -> list[Path]:
    """Return the Python files below some folders of the repository."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def kept_files() -> list[Path]:
    """Return the files that belong to the project: those that git does not ignore, or all of them where there is no git."""
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    if listing.returncode == 0:
        return [ROOT / name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]
    ignored = {".git", ".venv", ".cache", "__pycache__"}
    return [path for path in ROOT.rglob("*") if path.is_file() and not ignored.intersection(path.relative_to(ROOT).parts)]


def test_a_stage_imports_only_from_earlier_stages_and_numba_stays_in_jit() -> None:
    checked = python("scripts/imports.py")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "Contracts: 2 kept, 0 broken." in checked.stdout


def test_the_folders_sort_in_pipeline_order() -> None:
    assert list(STAGES) == sorted(STAGES)


def test_ruff_finds_nothing() -> None:
    checked = python("-m", "ruff", "check", ".")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_ruff_would_format_nothing() -> None:
    checked = python("-m", "ruff", "format", "--check", "--quiet", ".")
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.slow
def test_mypy_strict_finds_nothing() -> None:
    checked = python("-m", "mypy")
    assert checked.returncode == 0, checked.stdout + checked.stderr


# Sizes


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Give every function in a module, methods and inner ones included."""
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def code_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines a function has without its docstring and decorators."""
    assert function.end_lineno is not None
    lines = function.end_lineno - function.lineno + 1
    first = function.body[0]
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
        assert first.end_lineno is not None
        lines -= first.end_lineno - first.lineno + 1
    return lines


def test_files_are_short() -> None:
    counted = {
        path.relative_to(ROOT).as_posix(): len(path.read_text("utf-8").splitlines()) for path in python_files("src", "tests")
    }
    long = {name: lines for name, lines in counted.items() if lines > LONG_FILES.get(name, FILE_BUDGET)}
    assert not long, f"longer than {FILE_BUDGET} lines; is each one room, or two? {long}"
    assert set(LONG_FILES) <= set(counted), "an exception for a file that does not exist"


def test_functions_are_short() -> None:
    counted = {
        f"{path.relative_to(SOURCES).as_posix()}:{function.name}": code_lines(function)
        for path in python_files("src")
        for function in functions(ast.parse(path.read_text("utf-8")))
    }
    long = {name: lines for name, lines in counted.items() if lines > LONG_FUNCTIONS.get(name, FUNCTION_BUDGET)}
    assert not long, f"longer than {FUNCTION_BUDGET} lines: {long}"
    assert set(LONG_FUNCTIONS) <= set(counted), "an exception for a function that does not exist"


def test_a_docstring_does_not_count_as_code() -> None:
    (function,) = functions(ast.parse('def f():\n    """One.\n\n    Two.\n    """\n    return 1\n'))
    assert code_lines(function) == 2


# Names


def defined_names(tree: ast.AST) -> Iterator[tuple[str, int, bool]]:
    """Give every name that a module defines, with its line and whether it is a function or a class."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name, node.lineno, True
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno, False
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.id if isinstance(node, ast.Name) else node.attr, node.lineno, False
        elif isinstance(node, ast.alias) and node.asname:
            yield node.asname, node.lineno, False


def is_forbidden(name: str, is_callable: bool) -> bool:
    """Say whether a name goes against the rules for names."""
    words = [word.lower() for part in name.split("_") for word in re.findall(r"[A-Z]*[a-z]+|[A-Z]+|\d+", part)]
    if not words or name in ALLOWED_NAMES:
        return False
    by_word = not FORBIDDEN_WORDS.isdisjoint(words) or (len(words) > 1 and words[-1] == "new")
    return by_word or (is_callable and (words[0] in FORBIDDEN_VERBS or words[-1] == "2"))


def forbidden_names(source: str, where: str) -> list[str]:
    """Return the names in a source text that go against the rules, each with its place."""
    return [f"{where}:{line}: {name}" for name, line, kind in defined_names(ast.parse(source)) if is_forbidden(name, kind)]


def test_no_forbidden_name() -> None:
    found = [
        fault
        for path in python_files("src", "tests", "scripts", "benchmarks")
        for fault in forbidden_names(path.read_text("utf-8"), path.relative_to(ROOT).as_posix())
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "source",
    [
        "data = 1", "for tri in x: pass", "def f(pt): pass", "def load2(): pass", "def process_rows(): pass", "vertex_data = 1",
        "class MeshInfo: pass", "import numpy as tmp", "self.proj = 1", "rows_new = 1", "def handle(): pass", "TRI_COUNT = 3",
    ],
)  # fmt: skip
def test_a_forbidden_name_is_found(source: str) -> None:
    assert len(forbidden_names(source, "planted")) == 1


@pytest.mark.parametrize("source", ["area2 = 1", "def info(): pass", "x = mesh.data", "column = triangle = 1", "processes = 2"])
def test_a_good_name_is_left_alone(source: str) -> None:
    assert forbidden_names(source, "good") == []


# What must not be written down

# Put together from pieces, so that this file does not contain what it looks for.
MACHINE_PATH = re.compile(r"(?<![\w./:~-])/(?:work|farm|tmp|home|root|Users)/\w")
REGISTRY = re.compile("|".join((r"pypi\.", r"pythonhosted\.", r"registry\.npm", r"index-" + "url", r'"resolved": *"' + "http")))


def unwanted_text(text: str) -> list[str]:
    """Return the lines that hold a path of some machine or the address of a package registry."""
    return [line.strip()[:120] for line in text.splitlines() if MACHINE_PATH.search(line) or REGISTRY.search(line)]


def test_no_machine_path_and_no_registry_address() -> None:
    found = []
    for path in kept_files():
        # This names what it takes out of the lock files.
        if path == ROOT / "scripts" / "lock.py":
            continue
        content = path.read_bytes()
        if b"\0" not in content:
            found += [f"{path.relative_to(ROOT)}: {line}" for line in unwanted_text(content.decode("utf-8", "replace"))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "line", ["open('/" + "tmp/x')", "see /" + "home/me/x", "https://pypi" + ".org/simple", '"resolved": ' + '"https://x"']
)
def test_unwanted_text_is_found(line: str) -> None:
    assert unwanted_text(line) == [line]


def test_lock_files_pin_everything_by_hash() -> None:
    for path in sorted(ROOT.glob("requirements*.lock")):
        entries = re.sub(r"\\\n", " ", re.sub(r"(?m)^#.*\n", "", path.read_text("utf-8"))).strip().splitlines()
        assert len(entries) > 10
        assert [entry for entry in entries if not re.match(r"[a-z0-9-]+==[\w.]+ .*--hash=sha256:[0-9a-f]{64}", entry)] == []


# Kernels


def test_importing_scanspan_leaves_numba_alone() -> None:
    code = "import json, sys; import scanspan; print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))"
    loaded = json.loads(python("-c", code).stdout)
    assert "scanspan" in loaded
    for heavy in ("numba", "llvmlite", "trimesh", "scipy", "dask", "typer", "rich"):
        assert heavy not in loaded


def test_importing_scanspan_is_quick() -> None:
    # Beside numpy, which everybody has; the best of three, because a busy machine only ever adds.
    code = "import numpy, time; start = time.perf_counter(); import scanspan; print(time.perf_counter() - start)"
    seconds = min(float(python("-c", code).stdout) for _ in range(3))
    assert seconds < 0.25, f"import scanspan takes {seconds:.3f} s beyond numpy"


def test_numba_is_named_only_in_jit() -> None:
    naming = re.compile(r"^\s*(?:import|from)\s+(?:numba|llvmlite)\b", re.MULTILINE)
    assert naming.search((SOURCES / "jit.py").read_text("utf-8"))
    assert [str(path) for path in python_files("src") if path.name != "jit.py" and naming.search(path.read_text("utf-8"))] == []


def decorated(path: Path, decorator: str) -> list[str]:
    """Return the names of the functions in a file that carry a decorator of one plain name."""
    return [
        function.name
        for function in functions(ast.parse(path.read_text("utf-8")))
        if any(isinstance(mark, ast.Name) and mark.id == decorator for mark in function.decorator_list)
    ]


def kernels() -> list[tuple[str, str]]:
    """Return the module and the name of every kernel that is compiled on its own."""
    return [
        (".".join(path.relative_to(ROOT / "src").with_suffix("").parts), name)
        for path in python_files("src")
        for decorator in ("kernel", "part_kernel", "bare_kernel", "bare_part")
        for name in decorated(path, decorator)
    ]


def test_every_kernel_is_kept_on_disk() -> None:
    assert kernels(), "no kernels were found"
    for module, name in kernels():
        declared = getattr(importlib.import_module(module), name)
        assert type(declared._cache).__name__ == "KernelCache", f"{module}.{name} is compiled again in every process"


RENDER_AND_COUNT = """
import json, warnings
warnings.simplefilter("error")
from scanspan import jit
import numba.core.event as event

class Count(event.Listener):
    compiled = []
    def on_start(self, started):
        self.compiled.append(str(started.data["dispatcher"]))
    def on_end(self, ended):
        pass

event.register("numba:compile", Count())
heard = []
jit.on_first_compile(lambda: heard.append(True))

import numpy as np
import scanspan as ss
clip = np.array([[-0.9, -0.9, 0.0, 1.0], [0.9, -0.9, 0.0, 1.0], [0.0, 0.9, 0.0, 1.0]])
covered = [int((ss.rasterize(clip, [[0, 1, 2]], (16, 16), algorithm=name).primitive == 0).sum()) for name in ss.ALGORITHMS]
print(json.dumps({"compiled": Count.compiled, "heard": len(heard), "covered": covered}))
"""


@pytest.mark.slow
def test_kernels_are_cache_hits_in_a_second_process(tmp_path: Path) -> None:
    runs = []
    for _ in range(2):
        ended = python("-c", RENDER_AND_COUNT, NUMBA_CACHE_DIR=str(tmp_path))
        assert ended.returncode == 0, ended.stderr
        runs.append(json.loads(ended.stdout))

    # The first process compiles and says so once; the second finds everything, and draws the same.
    assert runs[0]["compiled"]
    assert runs[0]["heard"] == 1
    assert runs[1]["compiled"] == []
    assert runs[1]["heard"] == 0
    assert runs[0]["covered"] == runs[1]["covered"]
    assert min(runs[0]["covered"]) > 50
