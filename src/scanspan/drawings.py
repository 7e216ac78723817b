"""Drawings on a canvas: SVG files and maps, fitted into a picture and painted shape by shape."""

from __future__ import annotations

import os

import numpy as np

from scanspan.assets.drawing import Drawing, Shape, Style, bounds_of_shapes, flatten, load_drawing
from scanspan.assets.lens import check_size
from scanspan.canvas import Canvas
from scanspan.color.names import parse_color
from scanspan.errors import unknown_name
from scanspan.raster.options import check_flag, check_number
from scanspan.records import Float64Array

LONGER_SIDE = 1280  # pixels of a drawing that names no size
FITS = ("page", "content")
MARGIN = 0.02  # of the shorter side, round a map


def draw(
    drawing: Drawing | str | os.PathLike[str], size: tuple[int, int] | None = None, *, background: object = "white",
    antialias: bool = True, fill: object = None, stroke: object = None, stroke_width: float | None = None,
    fit: str = "page",
) -> Canvas:  # fmt: skip
    """Paint a drawing: an SVG file, a map in GeoJSON or TopoJSON, or a list of rings in JSON.

    Parameters
    ----------
    drawing : a path, or what `load_drawing` returns.
    size : (width, height) in pixels, into which it is fitted; by default what the file asks for, or 1280 for the longer side.
    background : any colour, also "transparent".
    antialias : whether pixels are blended by the share of them that is covered; else those are painted whose centre is.
    fill, stroke : colours in the place of those of the file, also "none"; a shape without a fill or a stroke gets none.
    stroke_width : pixels, in the place of the widths of the file.
    fit : "page", what the file says is its page, or "content", the box of all that is in it.

    Returns
    -------
    Canvas : with `pixels`, `save` and a picture of its own in a notebook.

    Raises
    ------
    InputError, FormatError : for anything that cannot be used or read; the message quotes it.
    """
    opened = drawing if isinstance(drawing, Drawing) else load_drawing(drawing)
    smooth = check_flag("antialias", antialias)
    thick = None if stroke_width is None else check_number("stroke_width", stroke_width, 0, 1 << 16)
    if fit not in FITS:
        raise unknown_name("fit", fit, FITS)
    if fit == "content":
        opened = opened._replace(bounds=bounds_of_shapes(opened.shapes) or opened.bounds, size=None)
    inside, outside = parse_paint(fill), parse_paint(stroke)
    extent = check_size(size) if size is not None else natural_size(opened)
    scale, offset = lay_out(opened, extent)
    canvas = Canvas(*extent, background)
    thickness = 1.0 if opened.is_upward else float(abs(scale[0]))
    shapes = []
    for shape in opened.shapes:
        style = shape.style._replace(width=shape.style.width * thickness if thick is None else thick)
        if fill is not None and style.fill is not None:
            style = style._replace(fill=inside)
        if stroke is not None and style.stroke is not None:
            style = style._replace(stroke=outside)
        rings = [flatten(path, scale, offset) for path in shape.paths]
        shapes.append((shape, rings, style._replace(dash=tuple(part * thickness for part in style.dash))))

    # Lay the land of a map before its borders, so that no neighbour covers half of them.
    if opened.is_tiling:
        fills = [(rings, style) for _, rings, style in shapes if style.fill is not None and rings]
        canvas.polygons(
            [rings for rings, _ in fills], np.array([style.fill for _, style in fills]).reshape(-1, 4),
            fill_rule="even-odd", antialias=smooth, overlap="disjoint" if smooth else "over",
        )  # fmt: skip
    for shape, rings, style in shapes:
        if style.fill is not None and rings and not opened.is_tiling:
            canvas.polygon(rings, style.fill, fill_rule=style.fill_rule, antialias=smooth)
        paint_strokes(canvas, shape, rings, style, smooth)
        if len(shape.points) and style.stroke is not None:
            canvas.points(shape.points * scale + offset, style.stroke, size=max(6.0, 3 * style.width), shape="disc")
    return canvas


def paint_strokes(canvas: Canvas, shape: Shape, rings: list[Float64Array], style: Style, smooth: bool) -> None:
    """Paint the outlines of a shape."""
    if style.stroke is None or style.width <= 0:
        return
    for path, points in zip(shape.paths, rings, strict=True):
        canvas.polyline(
            points, style.stroke, closed=path.is_closed, width=style.width, cap=style.cap, join=style.join,
            miter_limit=style.miter_limit, dash=style.dash or None, dash_offset=style.dash_offset, antialias=smooth,
        )  # fmt: skip


def parse_paint(value: object) -> Float64Array | None:
    """Return a colour, None for "none" and for nothing."""
    if value is None or (isinstance(value, str) and value.strip().lower() == "none"):
        return None
    return parse_color(value)


def natural_size(drawing: Drawing) -> tuple[int, int]:
    """Return the size that a drawing asks for, or one whose longer side is 1280."""
    left, low, right, high = drawing.bounds
    width, height = drawing.size or (right - left, high - low)
    if drawing.size is None or max(width, height) > LONGER_SIDE * 8:
        longer = max(width, height) or 1.0
        width, height = width / longer * LONGER_SIDE, height / longer * LONGER_SIDE
    return max(1, round(width)), max(1, round(height))


def lay_out(drawing: Drawing, size: tuple[int, int]) -> tuple[Float64Array, Float64Array]:
    """Return scale and offset, (2,) each, that lay the bounds of a drawing into the middle of a picture."""
    left, low, right, high = drawing.bounds
    margin = MARGIN * min(size) if drawing.size is None else 0.0
    room = np.array(size) - 2 * margin
    extent = np.array([right - left, high - low])
    ratios = np.divide(room, extent, out=np.full(2, np.inf), where=extent > 0)
    unit = float(ratios.min())
    scale = np.array([unit, -unit if drawing.is_upward else unit]) if np.isfinite(unit) else np.array([1.0, 1.0])
    middle = np.array([left + right, low + high]) / 2
    return scale, np.array(size) / 2 - scale * middle
