"""Drawings: outlines in a plane with a style each, as SVG files and maps have them, before they are put on pixels.

A path is a chain of cubic curves, of which straight sides are the simplest. Curves are kept as curves until the scale is known,
and are then cut into chords that lie within 1/50 pixel of them.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from scanspan.assets.formats.files import DiskFolder, Limits, ModelFile
from scanspan.assets.load import as_limit, as_path, read_content
from scanspan.errors import FormatError, LimitError, unknown_name
from scanspan.records import BoolArray, Float64Array

READERS = {"svg": "read_svg", "geojson": "read_map", "json": "read_map", "topojson": "read_map"}
MAX_BYTES = 1 << 28
CHORD_ERROR = 0.02  # pixels from a curve
MAX_CHORDS = 4096  # of one curve


class Style(NamedTuple):
    """How a shape is painted; colours are (4,) float64 sRGB with straight alpha, None for none."""

    fill: Float64Array | None = None
    fill_rule: str = "non-zero"
    stroke: Float64Array | None = None
    width: float = 1.0  # in units of the drawing
    cap: str = "butt"
    join: str = "miter"
    miter_limit: float = 4.0
    dash: tuple[float, ...] = ()
    dash_offset: float = 0.0


class Path(NamedTuple):
    """A chain of K curves, each from where the last one ended."""

    curves: Float64Array  # (K, 4, 2) control points of cubics
    is_straight: BoolArray  # (K,)
    is_closed: bool


class Shape(NamedTuple):
    """Paths that are filled and stroked as one, and points that are marked."""

    paths: tuple[Path, ...]
    points: Float64Array  # (P, 2)
    style: Style


class Drawing(NamedTuple):
    """Shapes in painter's order.

    `bounds` is what is shown, (left, low, right, high) in units of the drawing; `size` the width and height in pixels that the
    file asks for, None where it does not; `is_upward` whether y grows upwards; `is_tiling` whether neighbours share borders.
    """

    shapes: tuple[Shape, ...]
    bounds: tuple[float, float, float, float]
    size: tuple[float, float] | None
    is_upward: bool
    is_tiling: bool
    notes: tuple[str, ...]


def straight_path(points: Float64Array, is_closed: bool) -> Path:
    """Return the path with straight sides through (M, 2) points."""
    ends = np.concatenate([points, points[:1]]) if is_closed else points
    curves = np.stack([ends[:-1], ends[:-1], ends[1:], ends[1:]], axis=1)
    return Path(curves, np.ones(len(curves), bool), is_closed)


def flatten(path: Path, scale: Float64Array, offset: Float64Array) -> Float64Array:
    """Return a path in pixels as (M, 2) points, each curve as chords within 1/50 pixel.

    Parameters
    ----------
    scale, offset : (2,) pixels are scale * units + offset.
    """
    curves = path.curves * scale + offset
    if not len(curves):
        return np.empty((0, 2))

    # Chords miss a curve by an eighth of its second derivative over the square of their number, at most.
    bend = np.abs(curves[:, :2] - 2 * curves[:, 1:3] + curves[:, 2:]).sum(axis=2).max(axis=1)
    count = np.clip(np.ceil(np.sqrt(0.75 * bend / CHORD_ERROR)), 1, MAX_CHORDS).astype(np.int64)
    count[path.is_straight] = 1

    # Evaluate all curves at the ends of their chords.
    row = np.repeat(np.arange(len(curves)), count)
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1
    t = (step / count[row])[:, None]
    a, b, c, d = (curves[row, k] for k in range(4))
    rest = 1 - t
    points = rest * (rest * (rest * a + 3 * t * b) + 3 * t * t * c) + t * t * t * d
    points[step == count[row]] = d[step == count[row]]
    points = np.concatenate([curves[:1, 0], points])
    return points[:-1] if path.is_closed and len(points) > 1 and (points[0] == points[-1]).all() else points


def bounds_of_shapes(shapes: tuple[Shape, ...]) -> tuple[float, float, float, float] | None:
    """Return the box of all control points, (left, low, right, high), None where there are none."""
    parts = [path.curves.reshape(-1, 2) for shape in shapes for path in shape.paths] + [shape.points for shape in shapes]
    points = np.concatenate([np.empty((0, 2)), *parts])
    if not len(points):
        return None
    (left, low), (right, high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return left, low, right, high


def load_drawing(path: str | os.PathLike[str], *, file_type: str | None = None, max_bytes: int = MAX_BYTES) -> Drawing:
    """Read a drawing.

    Parameters
    ----------
    path : an .svg file, or a map or outlines as .geojson, .topojson or .json.
    file_type : "svg", "geojson", "topojson" or "json", where the name does not say it.
    max_bytes : of the file.

    Raises
    ------
    FormatError : when it cannot be read, with the place.
    LimitError : when it is larger than the limit.
    """
    name, most = as_path(path), as_limit(max_bytes, "max_bytes")
    kind = file_type or os.path.splitext(name)[1].lower().removeprefix(".")
    if kind not in READERS:
        raise unknown_name("file type", kind, READERS)
    content = read_content(name, most, "a drawing")
    file = ModelFile(name, content, DiskFolder(FilePath(name).parent), Limits(most, 0, 0, 0), "error")
    if not content.strip():
        raise file.error("it is empty")
    read = getattr(import_module(f"scanspan.assets.formats.{READERS[kind]}"), READERS[kind])
    try:
        drawing: Drawing = read(file)
    except (FormatError, LimitError):
        raise
    except MemoryError:
        raise file.error("it needs more memory than there is") from None
    except RecursionError:
        raise file.error("it is nested too deeply, or refers to itself") from None
    except Exception as error:
        # The libraries that parse it raise what they like over a damaged file.
        problem = (str(error).splitlines() or [""])[0][:120]
        raise file.error(f"the file is damaged ({type(error).__name__}: {problem})") from error
    if not drawing.shapes:
        raise file.error("there is nothing in it to draw" + (f"; {drawing.notes[0]}" if drawing.notes else ""))
    return drawing
