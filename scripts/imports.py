"""Check the import contracts of pyproject.toml: the order of the folders, and numba in jit.py alone. Exits with 0 or 1."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from importlinter.cli import lint_imports

ROOT = Path(__file__).resolve().parent.parent

if __name__ == "__main__":
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT / "src"))
    sys.exit(lint_imports(config_filename="pyproject.toml", no_cache=True))
