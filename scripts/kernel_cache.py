"""Name the folder for compiled kernels after a hash of the sources, and print it.

numba checks only the file that a kernel stands in: after an edit of a helper in another file it would run stale machine code.
A folder per state of the sources makes that impossible, at the price of compiling again after every edit. Used by the Makefile
and by tests/conftest.py.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def kernel_cache_folder(root: Path = ROOT) -> Path:
    """Return the absolute folder whose name holds a hash of the names and the contents of all Python sources."""
    digest = hashlib.sha256()
    for path in sorted((root / "src").rglob("*.py")):
        source = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(source)}\n".encode())
        digest.update(source)
    return root / ".cache" / f"numba-{digest.hexdigest()[:16]}"


if __name__ == "__main__":
    print(kernel_cache_folder())
