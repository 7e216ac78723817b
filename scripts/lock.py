"""Write the lock files: every version and the hashes of every file of it, for all platforms and Pythons, and no address.

One resolution over everything comes first and constrains the others, so that all lock files agree on each version. It is
universal: where a package needs different versions on different Pythons, both stand there with a marker. uv does it, because
pip resolves for the running Python only. Run by `make lock`, which keeps uv in an environment of its own.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / ".cache" / "lock"

# The extras each lock file holds; all of them hold the core and the build backend.
LOCKS = {
    "requirements.lock": (),
    "requirements-dev.lock": ("dev",),
    "requirements-bench.lock": ("dev", "bench"),
}

HEADER = """\
# Written by `make lock`; do not edit. Versions and hashes for every platform and every Python from {python} on.
# Install: pip install --require-hashes -r {name}
"""


def resolve(output: Path, extras: tuple[str, ...], constraint: Path | None) -> None:
    """Resolve the project with some extras, and its build backend, into a file."""
    command = [
        sys.executable,
        "-m",
        "uv",
        "pip",
        "compile",
        "--quiet",
        "--universal",
        "--generate-hashes",
        "--python-version",
        python(),
    ]
    command += ["--no-header", "--no-annotate", "--no-emit-index-url", "--no-emit-find-links"]
    command += [f"--extra={extra}" for extra in extras]
    command += ["--constraint", str(constraint)] if constraint else []
    command += ["--upgrade", "--output-file", str(output), "pyproject.toml", str(WORK / "backend.in")]
    subprocess.run(command, cwd=ROOT, check=True)


def project() -> dict[str, object]:
    """Return pyproject.toml, parsed."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def python() -> str:
    """Return the oldest Python that the project supports, such as 3.11."""
    return re.sub(r"[^\d.]", "", str(project()["project"]["requires-python"]))  # type: ignore[index]


def main() -> None:
    """Write all lock files."""
    WORK.mkdir(parents=True, exist_ok=True)
    (WORK / "backend.in").write_text("\n".join(project()["build-system"]["requires"]) + "\n", encoding="utf-8")  # type: ignore[index]

    # Resolve everything at once, then each lock file within that.
    everything = WORK / "everything.txt"
    resolve(everything, tuple(sorted({extra for extras in LOCKS.values() for extra in extras})), None)
    for name, extras in LOCKS.items():
        resolved = WORK / name
        resolve(resolved, extras, everything)
        text = resolved.read_text(encoding="utf-8")

        # Refuse to write an address, whatever the settings of this machine.
        if "://" in text or "index-url" in text:
            raise SystemExit(f"{name}: expected versions and hashes only, and an address came; is a package taken from a path?")
        (ROOT / name).write_text(HEADER.format(python=python(), name=name) + text, encoding="utf-8")
        print(f"{name}: {text.count('==')} versions, {text.count('sha256:')} hashes")


if __name__ == "__main__":
    main()
