"""Who is raced on lines: the canvas, counting, OpenCV, Pillow, Skia, Blend2D, rasterio and datashader.

Where a peer draws all lines in one colour only, it gives a mask, and where it counts lines, it gives counts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import (
    BLACK,
    Arrays,
    Entry,
    Peer,
    attempt,
    first,
    first_colors,
    load,
    load_opencv,
    nothing,
    opencv_points,
    swapped_colors,
)  # fmt: skip
from benchmarks.painters import blend2d_context, blend2d_path, skia_canvas, skia_colors
from benchmarks.plane_scenes import LineScene

WHITE = (255, 255, 255, 255)


def any_color(arrays: Arrays) -> NDArray[Any]:
    """Return which pixels of a picture over black are drawn."""
    return np.asarray(arrays[0][..., :3].any(axis=-1))


def black_picture(scene: LineScene) -> tuple[NDArray[np.uint8], NDArray[np.uint32]]:
    """Return a picture in RGBA, and the same as whole pixels, which are cleared quickly."""
    picture = np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    return picture, picture.view(np.uint32)[..., 0]


CLEARED = int(np.array(BLACK, dtype=np.uint8).view(np.uint32)[0])


def canvas_entry(scene: LineScene) -> Entry:
    """Return `Canvas.lines`; smooth lines are blended as others blend them, without regard to the curve of sRGB."""
    import scanspan

    picture, pixels = black_picture(scene)
    canvas = scanspan.Canvas.from_array(picture, blend="srgb", threads=1)
    options: Any = {}
    if scene.kind == "smooth lines":
        options = {"antialias": True, "width": 1.0}
        attempt("Canvas.lines(antialias=True)", lambda: canvas.lines(scene.segments[:1], scene.colors[:1], **options))

    def draw() -> Arrays:
        pixels.fill(CLEARED)
        canvas.lines(scene.segments, scene.colors, **options)
        return (picture,)

    return Entry(nothing, draw, first_colors, "colors")


def wu_entry(scene: LineScene) -> Entry:
    """Return `Canvas.lines` by Wu's algorithm, which goes from pixel to pixel."""
    import scanspan

    picture, pixels = black_picture(scene)
    canvas = scanspan.Canvas.from_array(picture, blend="srgb", threads=1)
    attempt('Canvas.lines(algorithm="wu")', lambda: canvas.lines(scene.segments[:1], scene.colors[:1], algorithm="wu"))

    def draw() -> Arrays:
        pixels.fill(CLEARED)
        canvas.lines(scene.segments, scene.colors, algorithm="wu")
        return (picture,)

    return Entry(nothing, draw, first_colors, "Wu's lines")


def aggregate_entry(scene: LineScene) -> Entry:
    """Return `aggregate`, which counts lines."""
    import scanspan

    def count(segments: NDArray[Any]) -> NDArray[Any]:
        counts: NDArray[Any] = scanspan.aggregate(segments, scene.size, line="midpoint", threads=1)
        return counts

    attempt("aggregate", lambda: count(scene.segments[:1]))
    return Entry(nothing, lambda: (count(scene.segments),), first, "counts")


def opencv_line_entry(scene: LineScene) -> Entry:
    """Return OpenCV's line, called for each segment."""
    cv2, (picture, pixels) = load_opencv(), black_picture(scene)
    smooth = scene.kind == "smooth lines"
    held: list[Any] = [[], []]
    way, bits = (cv2.LINE_AA, 8) if smooth else (cv2.LINE_8, 0)

    def convert() -> None:
        ends = opencv_points(scene.segments) if smooth else np.floor(scene.segments).astype(np.int32)
        held[:] = [ends.tolist(), scene.colors.tolist()]

    def draw() -> Arrays:
        pixels.fill(CLEARED)
        for (start, end), color in zip(*held, strict=True):
            cv2.line(picture, start, end, color, 1, way, bits)
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


def opencv_polylines_entry(scene: LineScene) -> Entry:
    """Return OpenCV's polylines, called once for all segments, in white."""
    cv2, (picture, pixels) = load_opencv(), black_picture(scene)
    smooth = scene.kind == "smooth lines"
    held: list[Any] = []
    way, bits = (cv2.LINE_AA, 8) if smooth else (cv2.LINE_8, 0)

    def convert() -> None:
        held[:] = list(opencv_points(scene.segments) if smooth else np.floor(scene.segments).astype(np.int32))

    def draw() -> Arrays:
        pixels.fill(CLEARED)
        cv2.polylines(picture, held, False, WHITE, 1, way, bits)
        return (picture,)

    return Entry(convert, draw, any_color, "one colour")


def pillow_entry(scene: LineScene) -> Entry:
    """Return Pillow's ImageDraw.line, called for each segment."""
    image, drawing = load("PIL.Image", "pillow"), load("PIL.ImageDraw", "pillow")
    held: list[list[Any]] = [[], []]

    def convert() -> None:
        held[0] = np.floor(scene.segments).astype(int).reshape(-1, 4).tolist()
        held[1] = [tuple(color) for color in scene.colors.tolist()]

    def draw() -> Arrays:
        picture = image.new("RGBA", scene.size, BLACK)
        line = drawing.Draw(picture).line
        for ends, color in zip(*held, strict=True):
            line(ends, color)
        return (np.asarray(picture),)

    return Entry(convert, draw, first_colors, "colors")


def skia_line_entry(scene: LineScene) -> Entry:
    """Return Skia's drawLine, called for each segment; a width of none is its line of single pixels."""
    skia, surface, canvas, picture = skia_canvas(scene.size)
    smooth = scene.kind == "smooth lines"
    held: list[Any] = [[], []]

    def convert() -> None:
        held[:] = [scene.segments.reshape(-1, 4).tolist(), skia_colors(scene.colors)]

    def draw() -> Arrays:
        canvas.clear(0xFF000000)
        paint = skia.Paint(AntiAlias=smooth, StrokeWidth=1 if smooth else 0)
        for ends, color in zip(*held, strict=True):
            paint.setColor(color)
            canvas.drawLine(*ends, paint)
        surface.flushAndSubmit()
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


def skia_points_entry(scene: LineScene) -> Entry:
    """Return Skia's drawPoints, called once for all segments, in white."""
    skia, surface, canvas, picture = skia_canvas(scene.size)
    smooth = scene.kind == "smooth lines"
    held: list[Any] = []
    paint = skia.Paint(AntiAlias=smooth, StrokeWidth=1 if smooth else 0, Color=0xFFFFFFFF)

    def convert() -> None:
        held[:] = [skia.Point(*point) for point in scene.segments.reshape(-1, 2).tolist()]

    def draw() -> Arrays:
        canvas.clear(0xFF000000)
        canvas.drawPoints(skia.Canvas.kLines_PointMode, held, paint)
        surface.flushAndSubmit()
        return (picture,)

    return Entry(convert, draw, any_color, "one colour")


def blend2d_entry(scene: LineScene) -> Entry:
    """Return Blend2D's fill_path for the outline of each line, because the package has no strokes."""
    blend2d = load("blend2d", "blend2d-py")
    image = blend2d.Image(*scene.size)
    held: list[Any] = [[], []]

    def convert() -> None:
        start, end = scene.segments.astype(np.float64).swapaxes(0, 1)
        along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
        aside = np.stack([-along[:, 1], along[:, 0]], axis=1) / 2
        held[:] = [np.stack([start - aside, end - aside, end + aside, start + aside], axis=1).tolist()]
        held.append(scene.colors[:, :3].tolist())

    def draw() -> Arrays:
        context = blend2d_context(blend2d, image)
        for corners, color in zip(*held, strict=True):
            context.set_fill_style_rgba(*color)
            context.fill_path(blend2d_path(blend2d, corners))
        context.end()
        return (image.asarray(),)

    return Entry(convert, draw, swapped_colors, "colors")


def rasterio_entry(scene: LineScene) -> Entry:
    """Return rasterio's rasterize, which is GDAL's, with the colour as the number to burn."""
    features = load("rasterio.features", "rasterio")
    held: list[Any] = []

    def convert() -> None:
        values = scene.colors.view(np.uint32).ravel().tolist()
        lines = scene.segments.tolist()
        held[:] = [({"type": "LineString", "coordinates": line}, value) for line, value in zip(lines, values, strict=True)]

    def draw() -> Arrays:
        burnt = features.rasterize(held, scene.size[::-1], dtype="uint32", fill=CLEARED)
        return (burnt.view(np.uint8).reshape(*scene.size[::-1], 4),)

    return Entry(convert, draw, first_colors, "colors")


def datashader_entry(scene: LineScene) -> Entry:
    """Return datashader's line, which counts lines, or takes the largest share where they are smooth."""
    datashader, pandas = load("datashader", "datashader"), load("pandas", "datashader")
    canvas = datashader.Canvas(*scene.size, (0, scene.size[0]), (0, scene.size[1]))
    held: list[Any] = []
    options = {"line_width": 1} if scene.kind == "smooth lines" else {}

    def convert() -> None:
        ends = scene.segments.reshape(-1, 4).T
        held[:] = [pandas.DataFrame(dict(zip(("x0", "y0", "x1", "y1"), ends, strict=True)))]

    def draw() -> Arrays:
        return (canvas.line(held[0], x=["x0", "x1"], y=["y0", "y1"], axis=1, agg=datashader.count(), **options).values,)

    gives = "counts" if scene.kind == "lines" else "sums of shares"
    return Entry(convert, draw, lambda arrays: np.nan_to_num(arrays[0]), gives)


HARD, SMOOTH = ("lines",), ("smooth lines",)
PEERS = {
    "scanspan Canvas.lines": Peer(canvas_entry, HARD + SMOOTH, "RGBA; midpoint lines, or exact shares of a line 1 px wide"),
    "scanspan Wu lines": Peer(wu_entry, SMOOTH, "RGBA; two pixels share the colour at each step, ends in whole pixels"),
    "scanspan aggregate of lines": Peer(aggregate_entry, HARD, "int32 counts"),
    "cv2.line": Peer(opencv_line_entry, HARD + SMOOTH, "RGBA; smooth lines are wider than a pixel"),
    "cv2.polylines": Peer(opencv_polylines_entry, HARD + SMOOTH, "RGBA, all lines in one colour"),
    "Pillow line": Peer(pillow_entry, HARD, "RGBA; has no smooth lines"),
    "Skia drawLine": Peer(skia_line_entry, HARD + SMOOTH, "RGBA; leaves out the last pixel of a line one pixel wide"),
    "Skia drawPoints": Peer(skia_points_entry, HARD + SMOOTH, "RGBA, all lines in one colour"),
    "Blend2D lines": Peer(blend2d_entry, SMOOTH, "RGBA; outlines filled one by one, 8 sub-pixel bits"),
    "rasterio lines": Peer(rasterio_entry, HARD, "one number a pixel, here RGBA in 32 bits"),
    "datashader line": Peer(datashader_entry, HARD + SMOOTH, "counts, without colours"),
}
