"""The command `scanspan`, also as `python -m scanspan`.

It imports the rest where Ctrl-C is caught already, so that one in the first moments ends as later ones do.
"""

from __future__ import annotations

import sys


def main() -> int:
    """Run the command and return its exit code."""
    try:
        from scanspan.cli import main as run
    except KeyboardInterrupt:
        print("scanspan: interrupted", file=sys.stderr)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
