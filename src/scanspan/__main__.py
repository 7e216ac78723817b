"""`python -m scanspan` is the command `scanspan`."""

from __future__ import annotations

import sys

from scanspan.cli import main

if __name__ == "__main__":
    sys.exit(main())
