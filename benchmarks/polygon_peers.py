"""Who is raced on one large polygon: the mask, the canvas, OpenCV, Pillow, Skia, Blend2D, rasterio and exactextract."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import (
    Arrays,
    Entry,
    MissingError,
    Peer,
    first,
    first_colors,
    first_share,
    load,
    load_opencv,
    nothing,
    opencv_points,
    swapped_colors,
)  # fmt: skip
from benchmarks.line_peers import CLEARED
from benchmarks.painters import blend2d_context, blend2d_path
from benchmarks.plane_scenes import PolygonScene


def _only(scene: PolygonScene, fill_rule: str) -> None:
    """Refuse another fill rule, unless it makes no difference, as for the star."""
    if scene.fill_rule != fill_rule and not scene.name.startswith("PS"):
        raise MissingError(f"has only the {fill_rule} rule")


def coverage_entry(scene: PolygonScene) -> Entry:
    """Return `coverage`, by centres or by area."""
    import scanspan

    smooth = scene.kind == "smooth polygon"
    options: Any = {"mode": "area" if smooth else "center", "fill_rule": scene.fill_rule}
    if "threads" in inspect.signature(scanspan.coverage).parameters:
        options["threads"] = 1

    def draw() -> Arrays:
        return (scanspan.coverage(scene.ring, scene.size, **options),)

    return Entry(nothing, draw, first, "areas" if smooth else "mask")


def canvas_entry(scene: PolygonScene) -> Entry:
    """Return `Canvas.polygon` in white on black, blended as others blend, without regard to the curve of sRGB."""
    import scanspan

    picture = np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    canvas, pixels = scanspan.Canvas.from_array(picture, blend="srgb", threads=1), picture.view(np.uint32)

    def draw() -> Arrays:
        pixels.fill(CLEARED)
        canvas.polygon(scene.ring, "white", fill_rule=scene.fill_rule, antialias=scene.kind == "smooth polygon")
        return (picture,)

    return Entry(nothing, draw, first_colors, "colors")


def opencv_entry(scene: PolygonScene) -> Entry:
    """Return OpenCV's fillPoly, with 8 sub-pixel bits."""
    _only(scene, "even-odd")
    cv2, picture = load_opencv(), np.zeros(scene.size[::-1], dtype=np.uint8)
    smooth = scene.kind == "smooth polygon"
    held: list[Any] = []

    def convert() -> None:
        held[:] = [opencv_points(scene.ring)]

    def draw() -> Arrays:
        picture.fill(0)
        cv2.fillPoly(picture, held, 255, cv2.LINE_AA if smooth else cv2.LINE_8, 8)
        return (picture,)

    return Entry(convert, draw, first_share if smooth else _set, "areas" if smooth else "mask")


def _set(arrays: Arrays) -> NDArray[Any]:
    return arrays[0] > 0


def pillow_entry(scene: PolygonScene) -> Entry:
    """Return Pillow's ImageDraw.polygon."""
    _only(scene, "even-odd")
    image, drawing = load("PIL.Image", "pillow"), load("PIL.ImageDraw", "pillow")
    held: list[Any] = []

    def convert() -> None:
        held[:] = [scene.ring.ravel().tolist()]

    def draw() -> Arrays:
        picture = image.new("L", scene.size)
        drawing.Draw(picture).polygon(held[0], 255)
        return (np.asarray(picture),)

    return Entry(convert, draw, _set, "mask")


def skia_entry(scene: PolygonScene) -> Entry:
    """Return Skia's drawPath into bytes."""
    skia = load("skia", "skia-python")
    picture = np.zeros((*scene.size[::-1], 1), dtype=np.uint8)
    surface = skia.Surface(picture, skia.ColorType.kAlpha_8_ColorType, skia.AlphaType.kPremul_AlphaType)
    smooth, canvas = scene.kind == "smooth polygon", surface.getCanvas()
    held: list[Any] = []
    rule = skia.PathFillType.kEvenOdd if scene.fill_rule == "even-odd" else skia.PathFillType.kWinding

    def convert() -> None:
        held[:] = [skia.Path.Polygon([skia.Point(*point) for point in scene.ring.tolist()], True, rule)]

    def draw() -> Arrays:
        canvas.clear(0)
        canvas.drawPath(held[0], skia.Paint(AntiAlias=smooth))
        surface.flushAndSubmit()
        return (picture[..., 0],)

    return Entry(convert, draw, first_share if smooth else _set, "areas" if smooth else "mask")


def blend2d_entry(scene: PolygonScene) -> Entry:
    """Return Blend2D's fill_path in white on black."""
    _only(scene, "non-zero")
    blend2d = load("blend2d", "blend2d-py")
    image = blend2d.Image(*scene.size)
    held: list[Any] = []

    def convert() -> None:
        held[:] = [blend2d_path(blend2d, scene.ring.tolist())]

    def draw() -> Arrays:
        context = blend2d_context(blend2d, image)
        context.set_fill_style_rgba(255, 255, 255)
        context.fill_path(held[0])
        context.end()
        return (image.asarray(),)

    return Entry(convert, draw, swapped_colors, "colors")


def rasterio_entry(scene: PolygonScene) -> Entry:
    """Return rasterio's rasterize, which is GDAL's."""
    _only(scene, "even-odd")
    features = load("rasterio.features", "rasterio")
    held: list[Any] = []

    def convert() -> None:
        held[:] = [({"type": "Polygon", "coordinates": [[*scene.ring.tolist(), scene.ring[0].tolist()]]}, 1)]

    def draw() -> Arrays:
        return (features.rasterize(held, scene.size[::-1], dtype="uint8"),)

    return Entry(convert, draw, _set, "mask")


def exactextract_entry(scene: PolygonScene) -> Entry:
    """Return exactextract's shares of the pixels of one polygon, put into an image."""
    if not scene.name.startswith("PS"):
        raise MissingError("takes no polygon that crosses itself")
    extract, raster = load("exactextract", "exactextract"), load("exactextract.raster", "exactextract")
    (width, height) = scene.size
    held: list[Any] = []
    source = raster.NumPyRasterSource(np.zeros((height, width), dtype=np.uint8), 0, 0, width, height)

    def convert() -> None:
        ring = [*scene.ring.tolist(), scene.ring[0].tolist()]
        upright = [[x, height - y] for x, y in ring]
        held[:] = [{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [upright]}}]

    def draw() -> Arrays:
        found = extract.exact_extract(source, held, ["cell_id", "coverage"])[0]["properties"]
        shares = np.zeros(width * height)
        shares[found["cell_id"]] = found["coverage"]
        return (shares.reshape(height, width),)

    return Entry(convert, draw, first, "areas")


HARD, SMOOTH = ("polygon",), ("smooth polygon",)
PEERS = {
    "scanspan coverage": Peer(coverage_entry, HARD + SMOOTH, "bool by centres, float64 by area, right to 2^-40"),
    "scanspan Canvas.polygon": Peer(canvas_entry, HARD + SMOOTH, "RGBA"),
    "cv2.fillPoly": Peer(opencv_entry, HARD + SMOOTH, "uint8; even-odd, 8 sub-pixel bits, fills the outline too"),
    "Pillow one polygon": Peer(pillow_entry, HARD, "uint8; even-odd, whole pixels, fills the outline too"),
    "Skia one path": Peer(skia_entry, HARD + SMOOTH, "uint8; both rules"),
    "Blend2D one path": Peer(blend2d_entry, SMOOTH, "RGBA; non-zero, always antialiased"),
    "rasterio one polygon": Peer(rasterio_entry, HARD, "uint8; even-odd, pixel centres"),
    "exactextract one polygon": Peer(exactextract_entry, SMOOTH, "float64 shares, put into an image"),
}
