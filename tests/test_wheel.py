"""The promise that it runs bare: the wheel, away from the repository, read-only, without a home, without a graphics library.

The environment sees the standard library, the wheel, and the packages that the wheel's own metadata asks for: those are linked,
not copied, from the environment of the tests, so a dependency that was forgotten is missed here. Where the system allows it, a
mount namespace makes the installation truly read-only and hides libGL, EGL, OSMesa, GLX, OpenGL and X11 behind /dev/null (a
broken library to the loader, which is as good as none). Elsewhere file modes stand in for the first, and the list of libraries
that the process has loaded for the second. The summary of the run says which of them it was.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import shutil
import stat
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from PIL import Image

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="links and file modes of POSIX")]

ROOT = Path(__file__).resolve().parent.parent
GRAPHICS = (
    *("libGL", "libGLX", "libGLdispatch", "libGLES", "libOpenGL", "libEGL", "libOSMesa", "libglapi", "libgallium"),
    *("libX11", "libxcb"),
)

# The number of the user who owns nothing.
NOBODY = 65534

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

# Runs the command line in this process, and then writes down what had been loaded to do it.
OBSERVED_RUN = """
import json, os, runpy, sys
libraries, sys.argv = sys.argv[1], ["scanspan", *sys.argv[2:]]
try:
    runpy.run_module("scanspan", run_name="__main__")
    code = 0
except SystemExit as ended:
    code = ended.code or 0
maps = "/proc/self/maps"
loaded = sorted({line.split(None, 5)[5].strip() for line in open(maps) if line.count("/")}) if os.path.exists(maps) else None
import numba, scanspan
observed = {
    "code": code, "loaded": loaded, "package": scanspan.__file__, "user": os.getuid(), "home": os.environ.get("HOME"),
    "version": sys.version, "writable": os.access(os.path.dirname(scanspan.__file__), os.W_OK), "numba": numba.__file__,
}
with open(libraries, "w") as file:
    json.dump(observed, file)
sys.exit(code)
"""


def core_distributions(requirements: list[str]) -> dict[str, importlib.metadata.Distribution]:
    """Return the installed distributions that some requirements ask for, with all that those need in turn."""
    found: dict[str, importlib.metadata.Distribution] = {}
    waiting = [(Requirement(text), "") for text in requirements]
    while waiting:
        requirement, extra = waiting.pop()
        name = canonicalize_name(requirement.name)
        if requirement.marker and not requirement.marker.evaluate({"extra": extra}):
            continue
        if name not in found:
            found[name] = importlib.metadata.distribution(name)
            extras = ("", *requirement.extras)
            waiting += [(Requirement(text), wanted) for text in found[name].requires or [] for wanted in extras]
    return found


def link_distribution(distribution: importlib.metadata.Distribution, folder: Path) -> None:
    """Link the top-level files and folders of an installed distribution into a folder."""
    tops = {path.parts[0] for path in distribution.files or [] if path.parts[0] not in ("..", "__pycache__")}
    assert tops, f"{distribution.name} does not say which files it has"
    for top in tops:
        link = folder / top
        if not link.exists():
            link.symlink_to(Path(str(distribution.locate_file(top))).resolve())


def run(command: list[str], **options: object) -> subprocess.CompletedProcess[str]:
    """Run a command, and show all that it printed when it fails."""
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)  # type: ignore[call-overload]
    assert ended.returncode == 0, f"{command}\n{ended.stdout}{ended.stderr}"
    return ended  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def place() -> Iterator[Path]:
    """Give a folder away from the repository that any user may enter; pytest's own folders are closed to others."""
    folder = Path(tempfile.mkdtemp(prefix="scanspan wheel "))
    folder.chmod(0o755)
    yield folder
    for path in (folder, *folder.rglob("*")):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o755)
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def wheel(place: Path) -> Path:
    """Build the wheel from a copy of the sources, so that nothing left over in the repository gets into it."""
    copy = place / "source"
    shutil.copytree(ROOT / "src", copy / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    pip = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--no-index", "--quiet"]
    run([*pip, "--wheel-dir", str(place / "dist"), str(copy)])
    (built,) = (place / "dist").glob("*.whl")
    shutil.rmtree(copy)
    return built


@pytest.fixture(scope="module")
def installed(place: Path, wheel: Path) -> Path:
    """Install the wheel into a clean environment, link what it asks for beside it, and take the right to write away."""
    environment = place / "installed"
    run([sys.executable, "-m", "venv", "--without-pip", str(environment)])
    python = environment / "bin" / "python"
    run([sys.executable, "-m", "pip", "--python", str(python), "install", "--no-deps", "--no-index", "--quiet", str(wheel)])

    # Link the closure of the wheel's requirements, and nothing else, into a folder of its own.
    (site,) = environment.glob("lib/python*/site-packages")
    (packages,) = importlib.metadata.distributions(name="scanspan", path=[str(site)])
    links = environment / "dependencies"
    links.mkdir()
    for distribution in core_distributions(packages.requires or []).values():
        link_distribution(distribution, links)
    (site / "dependencies.pth").write_text(f"{links}\n", encoding="utf-8")

    # Take away the right to write, from the folders last to first.
    for path in (*environment.rglob("*"), environment):
        if not path.is_symlink():
            path.chmod(stat.S_IMODE(path.stat().st_mode) & ~0o222)
    return environment


def graphics_libraries() -> list[str]:
    """Return the graphics libraries of this machine, links resolved."""
    folders = {Path(name) for name in ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib")}
    folders |= {Path("/usr/lib") / (sysconfig.get_config_var("MULTIARCH") or "")}
    files = [path for folder in folders if folder.is_dir() for name in GRAPHICS for path in folder.glob(f"{name}*.so*")]
    return sorted({str(path.resolve()) for path in files if path.exists()})


def can_unshare() -> list[str]:
    """Return the command that starts a mount namespace here, or nothing where that is not allowed."""
    for command in (["unshare", "--mount"], ["unshare", "--mount", "--map-root-user"]):
        try:
            probe = [*command, "sh", "-c", "mount --bind /dev/null /etc/passwd"]
            if subprocess.run(probe, capture_output=True, timeout=30).returncode == 0:
                return command
        except OSError:
            pass
    return []


def as_nobody(python: Path) -> list[str]:
    """Return the command that drops root's rights, or nothing where it is not needed or this Python is closed to others.

    setpriv still has root's right to pass through closed folders when it starts a program, so a shell stands in between: else a
    Python below a closed home would start, and then run with the library of another Python.
    """
    if os.geteuid() != 0 or not shutil.which("setpriv"):
        return []
    command = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "sh", "-c", 'exec "$@"', "sh"]
    code = "import sys, numpy; print(sys.version)"
    probe = subprocess.run([*command, str(python), "-c", code], capture_output=True, text=True, timeout=60)
    return command if probe.returncode == 0 and probe.stdout.strip() == sys.version.strip() else []


MOUNTS = """
set -e
installed=$1; shift
mount --bind "$installed" "$installed"
mount -o remount,bind,ro "$installed"
while [ "$1" != -- ]; do mount --bind /dev/null "$1"; shift; done
shift
exec "$@"
"""


def test_the_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert "scanspan/py.typed" in names
    assert {name.split("/")[0] for name in names} == {"scanspan", f"{wheel.name.removesuffix('-py3-none-any.whl')}.dist-info"}
    sources = {path.relative_to(ROOT / "src").as_posix() for path in (ROOT / "src" / "scanspan").rglob("*.py")}
    assert sources <= set(names)


def test_the_wheel_asks_for_the_core_only(wheel: Path, installed: Path) -> None:
    linked = {path.name for path in (installed / "dependencies").iterdir()}
    assert {"numpy", "numba", "llvmlite", "PIL", "trimesh", "lxml", "networkx", "typer", "rich"} <= linked
    assert not {"scipy", "shapely", "pytest", "hypothesis", "embreex", "dask"} & linked


def test_the_wheel_renders_bare(place: Path, installed: Path, report: Callable[[str], None]) -> None:
    work = place / "work"
    work.mkdir()
    work.chmod(0o777)
    (work / "model.obj").write_text(TETRAHEDRON, encoding="utf-8")
    (work / "observed_run.py").write_text(OBSERVED_RUN, encoding="utf-8")
    python = installed / "bin" / "python"

    # Leave nothing in the environment but the path and a place for temporary files: no home, no display.
    namespace, nobody, hidden = can_unshare(), as_nobody(python), graphics_libraries()
    environment = {"PATH": os.defpath, "TMPDIR": str(work)}
    if not nobody:
        environment["HOME"] = str(installed / "no-home")
    command = [*nobody, str(python), "-I", str(work / "observed_run.py"), str(work / "observed.json")]
    command += ["render", "model.obj", "-o", "picture.png", "--resolution", "160,120"]
    if namespace:
        command = [*namespace, "sh", "-c", MOUNTS, "sh", str(installed), *hidden, "--", *command]
    run(command, cwd=work, env=environment)
    observed = json.loads((work / "observed.json").read_text("utf-8"))

    # It was the wheel that ran, on this Python, not the repository, and it could not write there.
    assert observed["version"] == sys.version
    assert observed["user"] == (NOBODY if nobody else os.getuid() if "--map-root-user" not in namespace else 0)
    assert Path(observed["package"]).is_relative_to(installed)
    assert Path(observed["numba"]).is_relative_to(installed)
    read_only = not observed["writable"]
    assert read_only or (os.geteuid() == 0 and not namespace and not nobody)
    assert not read_only or not list(installed.rglob("*.nb[ic]"))

    # No graphics library of the system came in, hidden or not. (Pillow's own wheel carries a libxcb, which asks for nothing.)
    if observed["loaded"] is not None:
        assert any("llvmlite" in name for name in observed["loaded"]), "the list of loaded libraries is not to be trusted"
        system = [Path(name) for name in observed["loaded"] if "site-packages" not in name]
        assert [path for path in system if path.name.startswith(GRAPHICS)] == []

    # The object stands before the background: across the middle, both ends agree and the centre differs.
    picture = np.asarray(Image.open(work / "picture.png").convert("RGB")).astype(int)
    assert picture.shape == (120, 160, 3)
    left, centre, right = picture[60, 0], picture[60, 80], picture[60, 159]
    assert abs(left - right).max() <= 8
    assert abs(left - centre).max() > 24
    assert picture.max() > picture.min()

    by_modes = "by file modes" if read_only else "NOT CHECKED, root may write"
    report("read-only installation: " + ("a read-only mount" if namespace else by_modes))
    no_home = "HOME names a folder that cannot be made" if read_only else "NOT CHECKED, root could make the folder"
    report("without a home: " + ("as the user nobody, HOME unset" if nobody else no_home))
    hiding = f"{len(hidden)} hidden in a mount namespace" if namespace else "NOT HIDDEN, a mount namespace is not permitted"
    report(f"graphics libraries of the system: {hiding}")
    report("none of them loaded: " + ("checked" if observed["loaded"] is not None else "NOT CHECKED, no /proc/self/maps"))


def test_dependencies_are_followed() -> None:
    found = core_distributions(["trimesh", "numba", "rich; python_version < '3'"])
    assert set(found) == {"trimesh", "numba", "llvmlite", "numpy"}
