"""Experiments on values between corners: three ways to them that are one, and two ways that are wrong.

Source: S1, lines 126-138; S2, lines 394-518; S0, lines 398-429; S3, lines 610-620.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np

from scanspan.canvas import Canvas
from scanspan.lectures import half_planes, interpolation
from scanspan.lectures.compare import shipped_channel
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    GREEN,
    INK,
    RED,
    WHITE,
    Panel,
    enlarged,
    painted,
    panel,
    shaded,
    with_outlines,
)
from scanspan.pipeline import interpolate, rasterize
from scanspan.raster.setup import depth_at
from scanspan.records import Array, BoolArray, Float64Array
from scanspan.shade.interpolate import blend
from scanspan.shade.weights import weigh_sample

CORNERS = [(4, 4), (40, 12), (14, 38)]  # the scan lines above y = 12 meet the two edges that leave from the first


def three_ways() -> Result:
    """Interpolate over one triangle in fractions by the slides' three ways, and by the library."""
    corners, values = interpolation.exact(CORNERS), [Fraction(10), Fraction(250), Fraction(120)]
    size, plane = (46, 44), interpolation.plane(corners, values)
    shipped = shipped_channel(CORNERS, [10.0, 250.0, 120.0], size)
    inside = shipped_channel(CORNERS, [1.0] * 3, size) > 0
    p2, p1, p3 = corners
    bilinear = barycentric = derived = samples = 0
    worst = 0.0
    for y, x in np.argwhere(inside).tolist():
        at, point = plane.at(Fraction(x), Fraction(y)), (Fraction(x), Fraction(y))
        samples += 1
        worst = max(worst, abs(float(at) - float(shipped[y, x])))
        weights = interpolation.weights_from_areas(p1, p2, p3, *point)
        barycentric += weights[0] * values[1] + weights[1] * values[0] + weights[2] * values[2] == at
        bilinear += y == 38 or interpolation.bilinear(corners, values, *point) == at
        derived += not 4 < y <= 12 or interpolation.weights_from_scan_line(p1, p2, p3, *point) == weights
    outside = (Fraction(40), Fraction(40))
    rows = (
        ("samples inside", samples), ("where the bilinear way is the plane, exactly", bilinear),
        ("where the barycentric way is", barycentric),
        ("where weights derived from the scan line are shares of area", derived), ("worst difference of the library's", worst),
        ("sum of weights at (40, 40), outside, with signed areas", sum(interpolation.weights_from_areas(p1, p2, p3, *outside))),
        ("the same with areas that have no sign", sum(interpolation.weights_from_areas(p1, p2, p3, *outside, signed=False))),
    )  # fmt: skip

    # Show each weight in bands, and all three as a colour.
    k, panels = 4, []
    weights3 = np.stack([shipped_channel(CORNERS, np.eye(3)[m], size) for m in range(3)], axis=2)
    panels.append(
        panel("the three weights as red, green and blue", np.where(inside[..., None], np.rint(255 * weights3), 255), k)
    )
    for m, (name, color) in enumerate((("first", RED), ("second", GREEN), ("third", BLUE))):
        bands = shaded(np.floor(weights3[..., m] * 10) / 10, 0, 1, [(246, 247, 249), color])
        picture = np.where(inside[..., None], bands, 255).astype(np.uint8)
        panels.append(panel(f"weight of the {name} corner", with_outlines(enlarged(picture, k), [np.array(CORNERS) + 0.5], k)))
    return Result(Table(("", ""), rows), tuple(panels))


def turned_square(cosine: int, sine: int, side: int) -> tuple[list[interpolation.Point], Float64Array]:
    """Return a square turned by an angle with sides of whole numbers, as fractions and as floats, in a picture."""
    length = Fraction(5 if cosine % 5 == 0 or (cosine, sine) in ((3, 4), (4, 3)) else 1)
    middle, half = Fraction(side, 2), Fraction(side) * Fraction(3, 10)
    points = [
        (middle + half * (cosine * u - sine * v) / length, middle + half * (sine * u + cosine * v) / length)
        for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return points, np.array([[float(x), float(y)] for x, y in points])


def bilinear_picture(points: list[interpolation.Point], values: list[Fraction], inside: BoolArray) -> Float64Array:
    """Return what the bilinear way gives at every pixel of a polygon."""
    found = np.zeros(inside.shape)
    for y, x in np.argwhere(inside).tolist():
        found[y, x] = float(interpolation.bilinear(points, values, Fraction(2 * x + 1, 2), Fraction(2 * y + 1, 2)))
    return found


def gouraud_pitfall() -> Result:
    """Turn a square with one bright corner, and shade it along scan lines and as two triangles."""
    found, side = interpolation.demonstrate_turned_square(), 44
    values, panels = [Fraction(0), Fraction(1), Fraction(0), Fraction(0)], []
    for cosine, sine in ((1, 0), (4, 3), (3, 4)):
        points, places = turned_square(cosine, sine, side)
        canvas = Canvas(side, side, "black")
        canvas.polygon(places, "white")
        inside = canvas.pixels[..., 0] > 0
        shown = shaded(bilinear_picture(points, values, inside), 0, 1, [(20, 30, 70), (255, 210, 90)])
        picture = np.where(inside[..., None], shown, 255)
        degrees = round(float(np.degrees(np.arctan2(sine, cosine))))
        panels.append(panel(f"along scan lines, turned by {degrees} degrees", picture, 3))
    for cosine, sine in ((1, 0), (3, 4)):
        _, places = turned_square(cosine, sine, side)
        colors = np.array([(20, 30, 70), (255, 210, 90), (20, 30, 70), (20, 30, 70)], np.uint8)
        canvas = Canvas(side, side, "white")
        canvas.triangles(places[[[0, 1, 2], [0, 2, 3]]], colors[[[0, 1, 2], [0, 2, 3]]])
        degrees = round(float(np.degrees(np.arctan2(sine, cosine))))
        panels.append(panel(f"as two triangles, turned by {degrees} degrees", canvas.pixels, 3))
    names = ("not turned", "turned by 37 degrees", "turned by 23 degrees", "turned by 53 degrees")
    rows = tuple(
        (name, square, float(square), triangle)
        for name, square, triangle in zip(names, found.square, found.triangle, strict=True)
    )
    headings = ("square", "near its middle, along scan lines", "as a decimal", "middle of one triangle")
    return Result(Table(headings, rows), tuple(panels))


NEAR, FAR = 1.0, 20.0
WALL = [(-1.6, -1.1, 1.4), (5.5, -2.8, 9.0), (5.5, 3.2, 9.0), (-1.6, 1.1, 1.4)]  # x, y and how far from the eye
FENCE = [(-3.6, -3.4, 6.4), (4.6, -3.4, 6.4), (1.9, 1.7, 2.5), (-1.7, 1.7, 2.5)]


def projected(corners: Float64Array, *, by_eye_z: bool) -> Float64Array:
    """Return corners (N, 3) in clip coordinates; or with eye z as depth, straight on the screen, as the pitfall has it."""
    x, y, z = corners.T
    if by_eye_z:
        return np.stack([x / z, y / z, 2 * (z - NEAR) / (FAR - NEAR) - 1, np.ones(len(z))], axis=1)
    return np.stack([x, y, ((FAR + NEAR) * z - 2 * FAR * NEAR) / (FAR - NEAR), z], axis=1)


def eye_z_pitfall() -> Result:
    """Draw two walls that pass through each other, with depth in perspective and with eye z straight on the screen."""
    near, far = 1.0, 9.0
    rows: list[tuple[str, float]] = [("eye z of the two ends, near", near), ("far", far)]
    rows.append(("in the middle of the screen, straight: (near + far) / 2", (near + far) / 2))
    middle = 2 * near * far / (near + far)
    rows.append(("in perspective: 2 near far / (near + far)", middle))
    rows.append(("error: (near - far)^2 / (2 (near + far))", (near - far) ** 2 / (2 * (near + far))))
    strip = np.array([(-near, -0.1 * near, near), (far, -0.1 * far, far), (far, 0.1 * far, far), (-near, 0.1 * near, near)])
    level = rasterize(projected(strip, by_eye_z=False), [(0, 1, 2), (0, 2, 3)], (3, 3))
    rows.append(("the library's, in the middle pixel", float(interpolate(level, strip[:, 2])[1, 1])))

    # The walls, as two triangles each.
    corners, triangles, size = np.array(WALL + FENCE), [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], (120, 90)
    right, wrong = (rasterize(projected(corners, by_eye_z=by), triangles, size) for by in (False, True))
    colors = [WHITE, (70, 130, 200), (110, 165, 225), (235, 150, 60), (250, 185, 100)]
    differ = (right.primitive >= 2) != (wrong.primitive >= 2)
    rows.append(("pixels of the two walls", int((right.primitive >= 0).sum())))
    rows.append(("that show the wrong wall by eye z", int(differ.sum())))
    panels = [
        panel("depth in perspective", painted(right.primitive + 1, colors), 2),
        panel("eye z, straight on the screen", painted(wrong.primitive + 1, colors), 2),
        panel("the wrong wall", painted(differ, [(244, 246, 249), RED]), 2),
    ]
    panels += checked_walls(corners[:4])
    return Result(Table(("", ""), tuple(rows)), tuple(panels))


def checked_walls(corners: Float64Array) -> list[Panel]:
    """Return one wall with a texture, in perspective and straight on the screen."""
    panels = []
    for name, by in (("u, v in perspective", False), ("u, v straight on the screen: Gouraud's pitfall", True)):
        seen = rasterize(projected(corners, by_eye_z=by), [(0, 1, 2), (0, 2, 3)], (120, 90))
        uv = interpolate(seen, np.array([(0.0, 0), (8, 0), (8, 4), (0, 4)]))
        checks: Array = np.where(seen.primitive >= 0, 1 + np.floor(uv).sum(axis=2).astype(int) % 2, 0)
        panels.append(panel(name, painted(checks, [WHITE, (60, 80, 120), (250, 235, 200)]), 2))
    return panels


def sub_triangles() -> Result:
    """Cut a triangle into three signed ones from an origin inside, and from one outside."""
    rows, panels, k = list[Row](), list[Panel](), 5
    corners = [(12, 8), (40, 16), (20, 36)]
    for name, origin in (("inside", (23, 19)), ("outside", (2, 30)), ("far outside", (-300, 500))):
        moved = [(Fraction(x - origin[0]), Fraction(y - origin[1])) for x, y in corners]
        found = half_planes.sub_triangles(moved[0], moved[1], moved[2])
        signs = sum(value > 0 for value in found.twice_areas)
        rows.append((f"origin {name}", *(int(value) for value in found.twice_areas), int(found.total), signs))
        if name == "far outside":
            continue
        canvas = Canvas(46 * k, 42 * k, "white")
        for (a, b), value in zip(pairwise([*corners, corners[0]]), found.twice_areas, strict=True):
            shape = np.array([(a, b, origin)], np.float64) * k
            canvas.triangles(shape, (0, 158, 115, 110) if value > 0 else (213, 94, 0, 110))
        outlines = [corners] + [[origin, corner] for corner in corners]
        panels.append(
            panel(f"origin {name}: green counts, red is taken off", with_outlines(canvas.pixels, outlines, k, INK, 1.2))
        )
    headings = ("", "C of edge 0", "C of edge 1", "C of edge 2", "sum: twice the area", "positive C")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "sub-triangles", "S0", "347-363", "Why a positive area implies a positive interior",
        "Three signed triangles from the origin",
        "Each C is twice the area of a triangle from the origin to an edge: positive if the origin lies on the edge's "
        "positive side. Wherever the origin is, what lies outside is taken off again, and the sum is twice the area.",
        sub_triangles, (39, 40), half_planes.sub_triangles, "areas = coefficients", slips=(12,),
    ),
    Experiment(
        "three-ways", "S1", "126-138", "How to Interpolate?",
        "Interpolation three ways",
        "Along edges and then across, as a weighted sum, as a plane: three ways to the same number. In fractions they "
        "agree exactly at every sample, and the weights derived from the scan line are shares of area. Outside of the "
        "triangle the areas need their signs.",
        three_ways, (51, 52, 54, 55, 56, 57), weigh_sample, "e0 = edge_value(", slips=(13,),
    ),
    Experiment(
        "gouraud-pitfall", "S2", "406-409", "Bilinear Interpolation",
        "Gouraud's pitfall: a square that turns",
        "Interpolated along scan lines, a square with one bright corner changes its pattern when it is turned, because "
        "other edges meet the scan line. Triangles look the same from all sides.",
        gouraud_pitfall, (53,), blend, "return u0 +",
    ),
    Experiment(
        "eye-z-pitfall", "S3", "610-620", "Screen Space Depth Interpolation",
        "Eye z interpolated on the screen",
        "Half way between 1 and 9 on the screen is a depth of 1.8, and not 5: what is far takes less room. With eye z "
        "interpolated straight on the screen two walls cut each other in the wrong place, along a line with a kink. Depth"
        " divided by w is straight on the screen.",
        eye_z_pitfall, (116,), depth_at, "return setup.depth",
    ),
)  # fmt: skip
