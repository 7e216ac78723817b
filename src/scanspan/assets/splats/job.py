"""The build of a file of splats, in bounded memory, which goes on where it was cut off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanspan.assets.splats.builder import (
    HIGHEST,
    Builder,
    Heard,
    Lattice,
    header_of,
    join_rows,
    kept_columns,
    lattice_of,
    rows_of,
)
from scanspan.assets.splats.cells import Cell, Split, Store, distribute, plan, read_cells
from scanspan.assets.splats.journal import Journal
from scanspan.assets.splats.pages import zstandard
from scanspan.assets.splats.source import WIDTHS, Spool, open_source, total
from scanspan.assets.splats.target import FileTarget
from scanspan.assets.splats.tree import SplatTree
from scanspan.errors import FormatError, InputError
from scanspan.records import Array


def build_file(path: Path, source: Any, options: dict[str, Any], size: int, resume: bool, heard: Heard) -> SplatTree:
    """Build a tree of splats in a file.

    Parameters
    ----------
    options : normals, exact and nonfinite of build_tree.
    size : points that are made into blocks together at most.
    """
    zstandard()
    journal = Journal(path)
    if resume and journal.exists():
        settings, arrays = journal.load()
        told = {**settings, **options, "source": _identity(source)}
        if told != settings:
            changed = next(name for name in told if told[name] != settings[name])
            raise InputError(f"resume: this build was begun with {changed} {settings[changed]!r}, got {told[changed]!r}")
        return _grow(path, journal, settings, arrays, heard)
    journal.begin()
    # What may still be open is left to its readers.
    path.unlink(missing_ok=True)
    try:
        ready = _sort(path, journal, source, options, size, heard)
    except BaseException:
        journal.remove()
        raise
    return ready if isinstance(ready, SplatTree) else _grow(path, journal, *ready, heard)


def _identity(source: Any) -> str:
    """Return what tells a file from another, and from itself after a change; nothing for points in memory."""
    if not isinstance(source, (str, Path)):
        return ""
    try:
        found = Path(source).stat()
    except OSError:
        return str(source)
    return f"{source}, {found.st_size} bytes, changed {found.st_mtime_ns}"


def _sort(
    path: Path, journal: Journal, source: Any, options: dict[str, Any], size: int, heard: Heard
) -> SplatTree | tuple[dict[str, Any], dict[str, Array]]:
    """Sort points into cells, and return what the journal then says; or the tree, if all fit in memory."""
    pieces, again = open_source(source, options["nonfinite"])
    spool = Spool(journal.folder / "points")
    totals = total(pieces if again else spool.write(pieces), lambda count: heard("read", count, 0))
    if not again:
        pieces = spool
    normals, exact = options["normals"], options["exact"]
    lattice = lattice_of(totals)
    names = kept_columns(totals.names, normals)
    header = header_of(lattice, totals.names, normals)
    if totals.points <= size:
        target = FileTarget(header, path, journal.folder / "blocks")
        try:
            builder = Builder(lattice, names, normals == "estimate", exact, target)
            if totals.points:
                builder.add(Cell(join_rows(rows_of(pieces, lattice, normals), lattice, names), HIGHEST, 0))
                heard("build", totals.points, totals.points)
            tree = builder.finish(totals.points)
        finally:
            target.close()
        journal.remove()
        return tree

    # Count prefixes, then write each point to its cell.
    piece_rows = max(size // 4, 1)
    done = 0

    def tell(count: int) -> None:
        nonlocal done
        done += count
        heard("sort", done, totals.points)

    split = plan(rows_of(pieces, lattice, normals, piece_rows), lattice.shift, 0, size, HIGHEST)
    store = Store(journal.folder, "cells", _kinds(lattice.kind == np.int32, names), create=True)
    try:
        distribute(rows_of(pieces, lattice, normals, piece_rows), lattice.shift, 0, split, store, tell)
        store.flush()
    finally:
        store.close(remove=False)
    spool.remove()
    settings = {
        **options, "source": _identity(source), "names": list(names), "columns": list(totals.names), "size": size,
        "count": totals.points, "shift": lattice.shift, "error": lattice.error, "whole": lattice.whole,
        "small": lattice.kind == np.int32,
    }  # fmt: skip
    arrays = {"split_cells": split.cells, "split_starts": split.starts, "lattice": np.array([lattice.offset, lattice.scale])}
    arrays["base"] = lattice.base
    journal.save(settings, arrays)
    return settings, arrays


def _kinds(is_small: bool, names: tuple[str, ...]) -> dict[str, tuple[int, Any]]:
    """Return the columns of the points in cells, and their types."""
    return {"lattice": (3, np.int32 if is_small else np.int64), **{name: WIDTHS[name] for name in names}}


def _grow(path: Path, journal: Journal, settings: dict[str, Any], arrays: dict[str, Array], heard: Heard) -> SplatTree:
    """Make the blocks of one cell after the other, from where the journal says."""
    names, normals, size, count = tuple(settings["names"]), settings["normals"], settings["size"], settings["count"]
    offset, scale = arrays["lattice"]
    kind = np.int32 if settings["small"] else np.int64
    lattice = Lattice(offset, scale, arrays["base"], settings["shift"], settings["error"], settings["whole"], kind)
    split = Split(arrays["split_cells"], arrays["split_starts"])
    fixed = {name: arrays[name] for name in ("split_cells", "split_starts", "lattice", "base")}
    going_on = "cells" in arrays
    rows_path = journal.folder / "blocks"
    if going_on:
        _check_sizes(path, rows_path, arrays)
    target = FileTarget(header_of(lattice, tuple(settings["columns"]), normals), path, rows_path, going_on)
    builder = Builder(lattice, names, normals == "estimate", settings["exact"], target)
    store = Store(journal.folder, "cells", _kinds(settings["small"], names), create=False)
    try:
        if going_on:
            builder.restore(arrays)
        done = builder.done
        heard("build", done, count)
        for cell in read_cells(store, split, lattice.shift, 0, size, journal.folder, builder.cells):
            builder.add(cell)
            journal.save(settings, fixed | builder.state())
            heard("build", builder.done, count)
        tree = builder.finish(count)
    finally:
        target.close()
        store.close(remove=False)
    journal.remove()
    return tree


def _check_sizes(path: Path, rows_path: Path, arrays: dict[str, Array]) -> None:
    """Check that nothing of what was written is missing."""
    for place, least in ((path, int(arrays["sizes"][1])), (rows_path, 0)):
        found = place.stat().st_size if place.is_file() else -1
        if found < least:
            raise FormatError(
                place, f"expected at least {least} bytes to go on with, found {max(found, 0)}; build without resume"
            )
