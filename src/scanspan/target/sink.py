"""A sink for pictures taller than memory: rows go to a file as they are finished.

PPM and NPY hold plain rows, so nothing has to be kept of what is written. As everywhere, the file is whole or not there.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from scanspan.errors import InputError
from scanspan.records import UInt8Array
from scanspan.target.image import over_white, replacing

ENDINGS = (".ppm", ".npy")


def check_sink(path: Any) -> Path:
    """Return the path of a sink, if rows can be written to it one after the other."""
    if not isinstance(path, (str, os.PathLike)) or Path(os.fsdecode(path)).suffix.lower() not in ENDINGS:
        raise InputError(f"out = {path!r}: expected the name of a file that ends in {' or '.join(ENDINGS)}")
    return Path(os.fsdecode(path))


@contextmanager
def open_sink(path: Path, size: tuple[int, int]) -> Iterator[Callable[[UInt8Array], None]]:
    """Give a function that writes the next rows of a picture, (h, W, 4) uint8, sRGB with straight alpha.

    Parameters
    ----------
    path : .ppm, where the pixels are laid over white as it has no alpha, or .npy for an array (H, W, 4).
    size : (width, height) in pixels.

    Raises
    ------
    InputError : when the file cannot be written.
    """
    width, height = size
    with replacing(path) as file:
        is_ppm = path.suffix.lower() == ".ppm"
        if is_ppm:
            file.write(b"P6\n%d %d\n255\n" % (width, height))
        else:
            header = {"descr": "|u1", "fortran_order": False, "shape": (height, width, 4)}
            np.lib.format.write_array_header_1_0(file, header)

        def write_rows(rows: UInt8Array) -> None:
            """Write the next rows."""
            file.write((over_white(rows) if is_ppm else rows).tobytes())

        yield write_rows


def write_whole(pixels: UInt8Array, path: Path) -> Path:
    """Write a picture that is there as a whole, (H, W, 4), and return its path."""
    with open_sink(path, (pixels.shape[1], pixels.shape[0])) as write_rows:
        write_rows(pixels)
    return path
