"""SVG: shapes, paths, groups, transforms, units and styles, as svgelements reads them; here they become paths of cubics.

What is not drawn is noted, once each: text, pictures, gradients and patterns, masks, filters and markers. Nothing outside of
the file is ever opened. The opacity of a group goes to its members one by one; of groups in each other, the innermost counts.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import svgelements

from scanspan.assets.drawing import Drawing, Path, Shape, Style, bounds_of_shapes
from scanspan.assets.formats.files import ModelFile
from scanspan.records import Float64Array

MAX_ELEMENTS = 1_000_000
PIXELS_PER_INCH = 96.0
CURVES = (svgelements.CubicBezier, svgelements.QuadraticBezier, svgelements.Arc)
NOT_DRAWN = {
    "text": "texts", "image": "pictures", "mask": "masks", "filter": "filters", "marker": "markers", "pattern": "patterns",
    "foreignObject": "foreign objects",
}  # fmt: skip


def read_svg(file: ModelFile) -> Drawing:
    """Read an SVG file."""
    picture = svgelements.SVG.parse(io.BytesIO(file.content), ppi=PIXELS_PER_INCH)
    shapes = []
    for count, element in enumerate(picture.elements()):
        if count >= MAX_ELEMENTS:
            raise file.error(f"it has more than {MAX_ELEMENTS} elements")
        tag = str(getattr(element, "values", {}).get("tag", "")).rsplit("}", 1)[-1]
        if tag in NOT_DRAWN:
            file.note(f"{NOT_DRAWN[tag]} are not drawn")
        if isinstance(element, svgelements.Shape) and is_shown(element):
            paths = tuple(to_paths(svgelements.Path(element), file))
            if paths:
                shapes.append(Shape(paths, np.empty((0, 2)), style_of(element, file)))
    found = tuple(shapes)
    size = viewport(picture)
    bounds = (0.0, 0.0, *size) if size else bounds_of_shapes(found) or (0.0, 0.0, 1.0, 1.0)
    return Drawing(found, bounds, size, is_upward=False, is_tiling=False, notes=tuple(file.notes))


def viewport(picture: Any) -> tuple[float, float] | None:
    """Return the width and height in pixels that the file asks for, None where it does not say."""
    sides = [picture.width, picture.height]
    given = {key: picture.values.get(key) for key in ("width", "height")}
    if picture.viewbox is not None and (given["width"] is None or given["height"] is None):
        sides = [picture.viewbox.width, picture.viewbox.height]
    elif given["width"] is None or given["height"] is None:
        return None
    if not all(isinstance(side, (int, float)) and math.isfinite(side) and side > 0 for side in sides):
        return None
    return float(sides[0]), float(sides[1])


def is_shown(element: Any) -> bool:
    """Say whether an element is visible at all."""
    return element.values.get("visibility") not in ("hidden", "collapse") and element.values.get("display") != "none"


def to_paths(path: Any, file: ModelFile) -> Iterator[Path]:
    """Return the chains of a path, transformed, each from one move to the next."""
    curves: list[list[tuple[float, float]]] = []
    straight: list[bool] = []
    for segment in abs(path):
        if isinstance(segment, svgelements.Move):
            if curves:
                yield make_path(curves, straight, False, file)
            curves, straight = [], []
            continue
        is_end = isinstance(segment, svgelements.Close)
        if segment.start is not None and segment.end is not None:
            for points in to_cubics(segment):
                curves.append(points)
                straight.append(not isinstance(segment, CURVES))
        if is_end and curves:
            yield make_path(curves, straight, True, file)
            curves, straight = [], []
    if curves:
        yield make_path(curves, straight, False, file)


def to_cubics(segment: Any) -> Iterator[list[tuple[float, float]]]:
    """Return a side of a path as cubics, four points each."""
    if isinstance(segment, svgelements.Arc):
        for cubic in segment.as_cubic_curves():
            yield from to_cubics(cubic)
        return
    start, end = (segment.start.x, segment.start.y), (segment.end.x, segment.end.y)
    if isinstance(segment, svgelements.CubicBezier):
        yield [start, (segment.control1.x, segment.control1.y), (segment.control2.x, segment.control2.y), end]
    elif isinstance(segment, svgelements.QuadraticBezier):
        x, y = segment.control.x, segment.control.y
        controls = [(p[0] + (x - p[0]) * 2 / 3, p[1] + (y - p[1]) * 2 / 3) for p in (start, end)]
        yield [start, *controls, end]
    else:
        yield [start, start, end, end]


def make_path(curves: list[list[tuple[float, float]]], straight: list[bool], is_closed: bool, file: ModelFile) -> Path:
    """Return a path; refuse coordinates that are no numbers."""
    array: Float64Array = np.array(curves, np.float64)
    is_good = np.isfinite(array).all(axis=(1, 2))
    if not is_good.all():
        raise file.error(f"a path has the coordinates {array[~is_good][0].tolist()}, expected numbers")
    return Path(array, np.array(straight), is_closed)


def style_of(element: Any, file: ModelFile) -> Style:
    """Return how a shape is painted; what cannot be read takes the value that SVG gives it."""
    values = element.values
    opacity = number(values.get("opacity"), 1.0)
    fill = color_of(element.fill, values, "fill", opacity, file)
    stroke = color_of(element.stroke, values, "stroke", opacity, file)
    width = element.stroke_width
    own = number(values.get("stroke-width"), 1.0)
    across = float(width) / own if width is not None and own > 0 else 1.0
    dash = tuple(number(part, -1.0) * across for part in str(values.get("stroke-dasharray", "")).replace(",", " ").split())
    return Style(
        fill=fill,
        fill_rule="even-odd" if values.get("fill-rule") == "evenodd" else "non-zero",
        stroke=stroke if width is not None and width > 0 else None,
        width=float(width) if width is not None and math.isfinite(width) else 1.0,
        cap=one_of(values.get("stroke-linecap"), ("butt", "round", "square")),
        join=one_of(values.get("stroke-linejoin"), ("miter", "round", "bevel")),
        miter_limit=max(number(values.get("stroke-miterlimit"), 4.0), 1.0),
        dash=dash if dash and min(dash) >= 0 and sum(dash) > 0 else (),
        dash_offset=number(values.get("stroke-dashoffset"), 0.0) * across,
    )


def color_of(paint: Any, values: dict[str, Any], name: str, opacity: float, file: ModelFile) -> Float64Array | None:
    """Return a colour with its opacities in it, None for none."""
    given = str(values.get(name, ""))
    if given.startswith("url("):
        file.note("gradients and patterns are not drawn")
    if paint is None or paint.value is None:
        return None
    alpha = min(max(paint.alpha / 255.0 * opacity, 0.0), 1.0)
    return np.array([paint.red / 255.0, paint.green / 255.0, paint.blue / 255.0, alpha])


def number(value: object, default: float) -> float:
    """Return a number, or a share given in percent; the default for anything else."""
    text = str(value).strip()
    try:
        found = float(text[:-1]) / 100 if text.endswith("%") else float(text.removesuffix("px"))
    except ValueError:
        return default
    return found if math.isfinite(found) else default


def one_of(value: object, valid: tuple[str, ...]) -> str:
    """Return a name if it is valid, else the first that is."""
    return str(value) if value in valid else valid[0]
