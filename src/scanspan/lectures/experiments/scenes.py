"""Experiments that draw whole scenes: the demonstrations of the lectures, simple and complicated, flat and smooth.

The lectures do not say what their scenes were; these are a fan of overlapping triangles and a torus. Both are drawn by the
programs of the slides and by the canvas of this library, sampled alike.

Source: S0, lines 365-394, 431-523; S4, lines 495-499 and 684-688.
"""

from __future__ import annotations

import numpy as np

from scanspan.canvas import Canvas
from scanspan.lectures.compare import BITS
from scanspan.lectures.edge_equations import FlatTriangle, SmoothTriangle
from scanspan.lectures.experiments.experiment import Experiment, Result, Table
from scanspan.lectures.experiments.figure import Panel, painted, panel, shaded
from scanspan.lectures.raster import Raster, at_centres, vertices
from scanspan.pipeline import rasterize
from scanspan.raster.edge import edge_bias
from scanspan.records import BoolArray, Float64Array, UInt8Array
from scanspan.shade.weights import weigh_sample

PAINTERS = ("half-space", "edge-walk", "warnock", "micropolygon")


def simple_scene() -> tuple[Float64Array, UInt8Array]:
    """Return seven triangles that overlap, corners (N, 3, 2) on whole coordinates and their colours (N, 3, 3)."""
    points = [
        [(6, 8), (70, 20), (22, 76)], [(122, 8), (84, 70), (40, 16)], [(64, 90), (14, 62), (110, 48)],
        [(90, 12), (120, 84), (62, 62)], [(30, 30), (52, 84), (8, 88)], [(100, 50), (124, 92), (76, 92)],
        [(40, 40), (88, 34), (66, 74)],
    ]  # fmt: skip
    tones = [
        [(230, 60, 60), (250, 190, 40), (120, 20, 90)], [(40, 120, 220), (30, 220, 200), (90, 40, 200)],
        [(60, 180, 80), (210, 230, 60), (10, 90, 70)], [(250, 120, 30), (250, 220, 120), (160, 40, 20)],
        [(150, 80, 200), (240, 120, 200), (60, 40, 140)], [(20, 160, 190), (180, 240, 250), (10, 60, 120)],
        [(250, 250, 250), (90, 90, 90), (200, 200, 210)],
    ]  # fmt: skip
    return np.array(points, np.float64), np.array(tones, np.uint8)


def complicated_scene(around: int = 48, across: int = 24, size: int = 160) -> tuple[Float64Array, UInt8Array]:
    """Return a torus of 2 x 48 x 24 triangles from the far ones to the near ones, on the grid of 1/4096 pixel."""
    u, v = np.meshgrid(np.arange(around + 1) * 2 * np.pi / around, np.arange(across + 1) * 2 * np.pi / across, indexing="ij")
    ring = 1.0 + 0.42 * np.cos(v)
    places = np.stack([ring * np.cos(u), ring * np.sin(u), 0.42 * np.sin(v)], axis=2)
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=2)

    # Tilt it, and light it from the upper left; one colour runs around it.
    tilt = np.array([[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]])
    places, normals = places @ tilt.T, normals @ tilt.T
    light = np.clip(normals @ np.array([-0.48, -0.6, 0.64]), 0, 1)
    hue = np.stack([1 + np.cos(u), 1 + np.cos(u + 2.1), 1 + np.cos(u + 4.2)], axis=2) / 2
    tones = np.rint(255 * np.clip(0.15 + 0.85 * light[..., None], 0, 1) * (0.45 + 0.55 * hue))

    # Cut each cell in two, and sort by depth.
    points = np.rint((size / 2 + size * 0.32 * places[..., :2]) * 4096) / 4096
    cells = [(slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)), (slice(1, None), slice(1, None)),
             (slice(None, -1), slice(1, None))]  # fmt: skip
    halves = [[cells[0], cells[1], cells[2]], [cells[0], cells[2], cells[3]]]
    corners = np.concatenate([np.stack([points[c] for c in half], axis=2).reshape(-1, 3, 2) for half in halves])
    colors = np.concatenate([np.stack([tones[c] for c in half], axis=2).reshape(-1, 3, 3) for half in halves])
    depth = np.concatenate([np.stack([places[c][..., 2] for c in half], axis=2).reshape(-1, 3).mean(axis=1) for half in halves])
    order = np.argsort(depth, kind="stable")
    return corners[order], colors[order].astype(np.uint8)


def lecture_picture(corners: Float64Array, colors: UInt8Array, size: tuple[int, int], *, is_smooth: bool) -> Raster:
    """Draw a scene by the slides' program in floating point, on black as `clearRaster(0,0,0,255)` does."""
    raster = Raster(*size)
    raster.rgba[:] = (0, 0, 0, 255)
    opaque = np.concatenate([colors, np.full((len(colors), 3, 1), 255, np.uint8)], axis=2)
    for points, tones in zip(corners, opaque, strict=True):
        if is_smooth:
            SmoothTriangle(*vertices(points, tones)).draw(raster, rounding=0.5)
        else:
            FlatTriangle(*vertices(points, tones)).draw(raster)
    return raster


def canvas_picture(
    corners: Float64Array,
    colors: UInt8Array,
    size: tuple[int, int],
    *,
    is_smooth: bool,
    rule: str,
    algorithm: str = "half-space",
) -> UInt8Array:
    """Draw a scene on a canvas, sampled where the slides sample: (H, W, 3)."""
    canvas = Canvas(*size, "black")
    flat = ((2 * colors.astype(np.int64).sum(axis=1) + 3) // 6).astype(np.uint8)
    canvas.triangles(at_centres(corners), colors if is_smooth else flat, rule=rule, algorithm=algorithm, subpixel_bits=BITS)
    return canvas.pixels[..., :3].copy()


def compare_scene(name: str, *, is_smooth: bool) -> tuple[tuple[object, ...], list[Panel]]:
    """Return the numbers and the panels of one scene."""
    (corners, colors), size = (simple_scene(), (128, 96)) if name == "simple" else (complicated_scene(), (160, 160))
    raster = lecture_picture(corners, colors, size, is_smooth=is_smooth)
    alike = canvas_picture(corners, colors, size, is_smooth=is_smooth, rule="inclusive")
    shipped = canvas_picture(corners, colors, size, is_smooth=is_smooth, rule="top-left")
    same = all(
        np.array_equal(shipped, canvas_picture(corners, colors, size, is_smooth=is_smooth, rule="top-left", algorithm=other))
        for other in PAINTERS
    )
    off = np.abs(raster.rgba[..., :3].astype(np.int64) - alike).max(axis=2)
    moved: BoolArray = (shipped != alike).any(axis=2)
    row = (name, len(corners), int(raster.covered.sum()), int((off > 1).sum()), int(off.max()), int(moved.sum()), same)
    scale = 3 if name == "simple" else 2
    panels = [
        panel(f"{name}: the slide's program", raster.rgba, scale),
        panel(f"{name}: this library, top-left rule", shipped, scale),
    ]
    if not is_smooth:
        panels.append(
            panel(
                f"{name}: pixels that the rule gives to another triangle",
                painted(moved, [(244, 246, 249), (213, 94, 0)]),
                scale,
            )
        )
    return row, panels


def scenes(*, is_smooth: bool) -> Result:
    """Draw both scenes."""
    found = [compare_scene(name, is_smooth=is_smooth) for name in ("simple", "complicated")]
    headings = (
        "scene", "triangles", "pixels drawn", "differ by more than a level, edges included", "largest difference in levels",
        "pixels that change with the rule", "all four algorithms alike",
    )  # fmt: skip
    return Result(Table(headings, tuple(row for row, _ in found)), tuple(shown for _, panels in found for shown in panels))


def flat_scenes() -> Result:
    """Draw both scenes in flat colours."""
    return scenes(is_smooth=False)


def smooth_scenes() -> Result:
    """Draw both scenes with a colour at each corner."""
    return scenes(is_smooth=True)


def arbitrary_parameters() -> Result:
    """Interpolate depth, texture coordinates, a colour and a normal over one triangle in perspective."""
    clip = np.array([(-1.2, -0.9, 0.2, 1.5), (2.6, -2.0, 2.4, 4.0), (-0.3, 2.6, 1.5, 3.0)])
    seen = rasterize(clip, [(0, 1, 2)], (120, 90))
    inside = seen.primitive >= 0
    weights = seen.barycentric
    uv = weights @ np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    normal = weights @ np.array([(-0.7, 0.0, 0.7), (0.7, 0.0, 0.7), (0.0, 0.9, 0.4)])
    length = np.linalg.norm(normal, axis=2)
    checks = (np.floor(uv * 8).sum(axis=2) % 2).astype(np.uint8)
    unit = normal / np.where(inside, length, 1)[..., None]
    far, near = float(seen.depth[inside].min()), float(seen.depth[inside].max())
    pictures = {
        "r, g, b": np.rint(weights * 255),
        "depth": shaded(seen.depth, far, near, [(12, 34, 80), (230, 240, 250)]),
        "u, v as a checkerboard": painted(checks, [(250, 235, 200), (60, 80, 120)]),
        "normals": np.rint(unit * 127.5 + 127.5),
    }
    panels = [panel(name, np.where(inside[..., None], pixels, 255), 2) for name, pixels in pictures.items()]
    sums = float(np.abs(weights[inside].sum(axis=1) - 1).max())
    rows = (
        ("pixels", int(inside.sum())),
        ("weights add up to 1, worst error", sums),
        ("least weight", float(weights[inside].min())),
        ("shortest interpolated normal, before it is made a unit again", float(length[inside].min())),
    )
    return Result(Table(("", ""), rows), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "flat-scenes", "S0", "365-394", "Demonstration",
        "A simple and a complicated scene, flat",
        "A list of triangles is cleared, drawn and shown. Each triangle has the average of its corners' colours. The "
        "program of the slide draws pixels on an edge for both neighbours, so the last one drawn wins; under the top-left"
        " rule the order decides nothing between neighbours.",
        flat_scenes, (31, 42), edge_bias, "is_left = a > 0",
    ),
    Experiment(
        "smooth-scenes", "S4", "684-688", "Demonstrations of smooth triangles",
        "A simple and a complicated scene, smooth",
        "The same scenes with a colour at each corner. In floating point and with the half that S4 adds, the program of "
        "the slides and the library differ by a level at most, where rounding falls the other way.",
        smooth_scenes, (60, 62), Canvas.triangles, "paint_gouraud",
    ),
    Experiment(
        "arbitrary-parameters", "S0", "523-527", "Demo: Smooth Triangles",
        "Any parameter over a triangle",
        "Colour, depth, texture coordinates and normals are all sums of three weights. The weights are right in "
        "perspective: the checks get smaller with distance. A normal comes out too short and has to be made a unit again.",
        arbitrary_parameters, (51, 62), weigh_sample, "w0, w1, w2 = w0 / total",
    ),
)  # fmt: skip
