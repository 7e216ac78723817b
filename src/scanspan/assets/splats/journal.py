"""The journal of a build: how far it has come, written anew after each cell, so that a build that was cut off goes on there.

It is written to another name and then renamed, so there is always a whole one; each of its arrays has a checksum.
"""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from scanspan.errors import FormatError, InputError
from scanspan.records import Array

SUFFIX = ".build"
NAMES = ("journal", "points", "blocks", "cells.", "part")  # with which files of a build begin


class Journal:
    """The folder beside a target where its build works."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self.folder = target.with_name(target.name + SUFFIX)
        self.path = self.folder / "journal"

    def exists(self) -> bool:
        """Say whether a build can be gone on with."""
        return self.path.is_file()

    def begin(self) -> None:
        """Make the folder, empty.

        Raises
        ------
        InputError : there is a folder of that name with files that no build makes.
        """
        if self.folder.exists():
            foreign = [entry.name for entry in self.folder.iterdir() if not entry.name.startswith(NAMES)]
            if foreign:
                raise InputError(f"path: {str(self.folder)!r} is needed to work in, but holds {sorted(foreign)[0]!r}")
        self.remove()
        self.folder.mkdir()

    def remove(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def save(self, settings: dict[str, Any], arrays: dict[str, Array]) -> None:
        """Write the journal, which is on the disk when this returns."""
        other = self.folder / "journal.next"
        with other.open("wb") as file:
            kept: dict[str, Any] = {"settings": np.frombuffer(json.dumps(settings).encode(), np.uint8), **arrays}
            np.savez(file, **kept)
            file.flush()
            os.fsync(file.fileno())
        os.replace(other, self.path)

    def load(self) -> tuple[dict[str, Any], dict[str, Array]]:
        """Return what was saved.

        Raises
        ------
        FormatError : the journal is damaged.
        """
        try:
            with self.path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
                arrays = {name: kept[name] for name in kept.files}
            settings: dict[str, Any] = json.loads(arrays.pop("settings").tobytes())
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise FormatError(self.path, f"the journal of this build is damaged ({error}); build without resume") from None
        return settings, arrays
