"""Trees of splats from points of any number in bounded memory: put on a lattice, sorted into cells, grown cell by cell.

Points that fit are sorted in memory. Others go through files beside the target, in a folder that is named after it: the first
pass finds bounds, the second writes each point to its cell, and then the blocks of one cell after the other go to the target.
A journal in that folder says how far the build has come, so that it goes on there after a crash. The tree depends on the points
and their order alone, and so do the bytes of its file: not on memory, nor on the pieces in which points come.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scanspan.assets.mesh import NONFINITE
from scanspan.assets.splats.builder import HIGHEST, Builder, Heard, header_of, join_rows, kept_columns, lattice_of, rows_of
from scanspan.assets.splats.cells import Cell
from scanspan.assets.splats.job import build_file
from scanspan.assets.splats.source import open_source, total
from scanspan.assets.splats.target import MemoryTarget
from scanspan.assets.splats.tree import SplatTree
from scanspan.errors import InputError, unknown_name

NORMALS = ("given", "none", "estimate")
POINT_BYTES = 190  # of memory that a point takes while its cell is built
BASE_BYTES = 190 << 20  # that Python and the compiled code take
LEAST_MEMORY = 256 << 20


def as_bytes(memory: Any) -> int:
    """Return how many bytes a text such as "512MB" or a number stands for.

    Raises
    ------
    InputError : anything else, or less than is needed at all.

    >>> as_bytes("1GB")
    1073741824
    """
    units = {"KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30, "TB": 1 << 40}
    text = str(memory).strip().upper().replace(" ", "").replace("IB", "B")
    try:
        size = float(text[:-2]) * units[text[-2:]] if text[-2:] in units else float(text)
        count = int(size)
    except (ValueError, OverflowError):
        raise InputError(f'max_memory: expected bytes, or a text such as "512MB", got {memory!r}') from None
    if count < LEAST_MEMORY:
        raise InputError(f'max_memory: expected at least "{LEAST_MEMORY >> 20}MB", got {memory!r}')
    return count


def build_tree(
    source: Any,
    path: str | Path | None = None,
    *,
    normals: str = "given",
    exact: bool = False,
    max_memory: str | int = "512MB",
    resume: bool = False,
    nonfinite: str = "error",
    progress: Heard | None = None,
) -> SplatTree:
    """Return the tree of splats of some points, in memory or written to a file.

    Parameters
    ----------
    source : a path of points, a PointCloud, an array (N, 3), a Mesh (its vertices), a dict of what PointCloud takes and
        "radius" (N,), or an iterator of pieces of these. No points make a tree without nodes, of which nothing is drawn.
    path : the file to write; None keeps the tree in memory, however large it is.
    normals : "given" keeps those of the source; "none" leaves them out; "estimate" finds them from neighbours, without saying
        which side is out, so that nothing is taken to face away.
    exact : whether points keep the whole numbers that they have in the source, where those of a block fit in 16 bits; the file
        is larger. Else they are rounded to a tenth of what the classic format rounds to.
    max_memory : bytes, or a text such as "512MB"; 256 MB at least. Beside it there are some 100 bytes for each node.
    resume : go on with a build to the same path that was cut off; the source is then read again only if need be.
    nonfinite : "error" raises for a point that is not finite, "drop" leaves it out.
    progress : called with what is being done, how many points are done, and how many there are, or 0 while that is not known.

    Raises
    ------
    InputError : points or options that cannot be used.
    FormatError : a file of points that cannot be read, or a build that cannot be gone on with.

    Examples
    --------
    >>> import numpy as np
    >>> build_tree(np.random.default_rng(1).random((1000, 3)))
    SplatTree(1,000 points, ...)
    """
    if normals not in NORMALS:
        raise unknown_name("value of normals", normals, NORMALS)
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    memory = as_bytes(max_memory)
    size = max((memory - BASE_BYTES) // POINT_BYTES, 1 << 16)
    if path is None:
        if resume:
            raise InputError("resume: expected a path, a tree in memory cannot be gone on with")
        return _build_in_memory(source, normals, exact, nonfinite, progress or _ignore)
    place = Path(path)
    if place.is_dir() or not place.parent.is_dir():
        raise InputError(f"path: expected a file in a folder that exists, got {str(path)!r}")
    options = {"normals": normals, "exact": exact, "nonfinite": nonfinite}
    return build_file(place, source, options, size, resume, progress or _ignore)


def _ignore(stage: str, done: int, count: int) -> None:
    """Tell nobody."""


def _build_in_memory(source: Any, normals: str, exact: bool, nonfinite: str, heard: Heard) -> SplatTree:
    """Return the tree of points, all in memory."""
    kept = list(open_source(source, nonfinite)[0])
    totals = total(kept, lambda count: heard("read", count, 0))
    lattice = lattice_of(totals)
    names = kept_columns(totals.names, normals)
    builder = Builder(lattice, names, normals == "estimate", exact, MemoryTarget(header_of(lattice, totals.names, normals)))
    if totals.points:
        builder.add(Cell(join_rows(rows_of(kept, lattice, normals), lattice, names), HIGHEST, 0))
    heard("build", totals.points, totals.points)
    return builder.finish(totals.points)
