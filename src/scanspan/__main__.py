"""The command `scanspan`, also as `python -m scanspan`.

It imports the rest where Ctrl-C is caught already, so that one in the first moments ends as later ones do.

Python looks for cycles of garbage after every few hundred new objects, and once more in all that there is when it ends. A start
makes some 100,000 objects that stay, most of them numba's, and the looking took a third of its time. So a command looks seldom,
and not at its end, where all memory is given back at once (docs/decisions/0019-starts.md).
"""

from __future__ import annotations

import gc
import sys

NEW_OBJECTS = 100_000  # between two searches for cycles of garbage


def main() -> int:
    """Run the command and return its exit code."""
    gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])
    try:
        from scanspan.cli import main as run
    except KeyboardInterrupt:
        print("scanspan: interrupted", file=sys.stderr)
        return 130
    code = run()
    gc.freeze()
    return code


if __name__ == "__main__":
    sys.exit(main())
