"""What a peer is to the race: how it is made ready for a scene, which scenes it can draw, and what it returns.

A peer's `convert` turns the arrays of the scene into what the peer takes; its `draw` clears, draws and returns the output as
NumPy arrays. Each is timed by itself, because a caller may hold either form of the arrays. `result` brings the output into the
form that `exact.judge` compares; it is not timed. All use one thread.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Arrays = tuple[NDArray[Any], ...]

# The color, as RGBA, that pictures are cleared to; black because smooth edges are blended with it.
BLACK = (0, 0, 0, 255)


class Entry(NamedTuple):
    """A peer made ready for a scene."""

    convert: Callable[[], None]
    draw: Callable[[], Arrays]
    # To colors (H, W, 3) 0..255, mask (H, W), areas (H, W) 0..1, counts or ids (H, W), or triangles (N, 3, 2) in pixels.
    result: Callable[[Arrays], NDArray[Any]]
    gives: str  # which of these: peers that give the same are compared


class Peer(NamedTuple):
    """A way to draw, the kinds of scenes that it is raced on, and what it gives, for the reader of the tables."""

    make: Callable[[Any], Entry]
    kinds: tuple[str, ...]
    note: str


class MissingError(Exception):
    """A peer that cannot run here; the message says what to install, or what it cannot do."""


def load(module: str, package: str) -> Any:
    """Import the module of a peer, or say which package has it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingError(f"needs {package}, which `make .venv/.bench` installs where there is a wheel ({error})") from error


def load_opencv() -> Any:
    """Import OpenCV, with one thread."""
    cv2 = load("cv2", "opencv-python-headless 5")
    cv2.setNumThreads(1)
    return cv2


def attempt(what: str, call: Callable[[], Any]) -> None:
    """Try a small case of something that scanspan may not do yet."""
    try:
        call()
    except (AttributeError, ImportError, TypeError, ValueError) as error:
        raise MissingError(f"this scanspan has no {what} ({error})") from error


def nothing() -> None:
    """Convert what needs no conversion."""


def first_colors(arrays: Arrays) -> NDArray[Any]:
    """Return the colors of a picture in RGBA."""
    return arrays[0][..., :3]


def swapped_colors(arrays: Arrays) -> NDArray[Any]:
    """Return the colors of a picture in BGRA."""
    return arrays[0][..., 2::-1]


def first(arrays: Arrays) -> NDArray[Any]:
    """Return an output that has its form already."""
    return arrays[0]


def first_share(arrays: Arrays) -> NDArray[Any]:
    """Return shares of 255 as shares of 1."""
    return arrays[0] / np.float64(255)


def opencv_points(points: NDArray[Any]) -> NDArray[np.int32]:
    """Return points as OpenCV takes them with 8 sub-pixel bits: whole, and counted from the centre of the first pixel."""
    return np.rint((points.astype(np.float64) - 0.5) * 256).astype(np.int32)
