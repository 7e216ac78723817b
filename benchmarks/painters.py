"""Who is raced on flat and shaded triangles in the plane: the canvas, Pillow, Skia, Blend2D, rasterio and datashader."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import BLACK, Arrays, Entry, Peer, attempt, first, first_colors, load, nothing, swapped_colors
from benchmarks.scenes import FlatScene

SKIA_VERTICES = 60_000  # Vertices in one call of Skia, whose indices have 16 bits; three to a triangle.


def canvas_entry(scene: FlatScene) -> Entry:
    """Return `Canvas.triangles`, which paints into an array that is cleared each time."""
    import scanspan

    picture = np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    canvas = scanspan.Canvas.from_array(picture, threads=1)
    if scene.kind == "shaded":
        attempt("Canvas.triangles with a colour at each corner", lambda: canvas.triangles(scene.vertices[:1], scene.colors[:1]))

    def draw() -> Arrays:
        picture.fill(0)
        canvas.triangles(scene.vertices, scene.colors)
        return (picture,)

    return Entry(nothing, draw, first_colors, "colors")


def deep_canvas_entry(scene: FlatScene) -> Entry:
    """Return `Canvas.triangles` with depths, which paints into two arrays that are cleared each time."""
    import scanspan

    assert scene.depths is not None
    picture = np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    depth = np.empty(picture.shape[:2], dtype=np.float32)
    canvas = scanspan.Canvas.from_array(picture, depth, threads=1)
    held: list[NDArray[np.float32]] = []

    def convert() -> None:
        assert scene.depths is not None
        held[:] = [-scene.depths]  # what is nearer is larger

    def draw() -> Arrays:
        picture.fill(0)
        depth.fill(-np.inf)
        canvas.triangles(scene.vertices, scene.colors, depths=held[0])
        return picture, depth

    return Entry(convert, draw, first_colors, "colors")


def pillow_entry(scene: FlatScene) -> Entry:
    """Return Pillow's ImageDraw.polygon, called for each triangle."""
    image, drawing = load("PIL.Image", "pillow"), load("PIL.ImageDraw", "pillow")
    held: list[list[Any]] = [[], []]

    def convert() -> None:
        held[0] = scene.vertices.reshape(-1, 6).tolist()
        held[1] = [tuple(color) for color in scene.colors.tolist()]

    def draw() -> Arrays:
        picture = image.new("RGBA", scene.size)
        polygon = drawing.Draw(picture).polygon
        for corners, color in zip(*held, strict=True):
            polygon(corners, color)
        return (np.asarray(picture),)

    return Entry(convert, draw, first_colors, "colors")


def skia_colors(colors: NDArray[np.uint8]) -> list[int]:
    """Return colours as Skia takes them."""
    wide = colors.astype(np.uint32)
    packed: list[int] = (wide[..., 3] << 24 | wide[..., 0] << 16 | wide[..., 1] << 8 | wide[..., 2]).ravel().tolist()
    return packed


def skia_canvas(size: tuple[int, int]) -> tuple[Any, Any, Any, NDArray[np.uint8]]:
    """Return Skia, a surface that paints into an array of RGBA, its canvas, and the array."""
    skia = load("skia", "skia-python")
    picture = np.zeros((size[1], size[0], 4), dtype=np.uint8)
    surface = skia.Surface(picture, skia.ColorType.kRGBA_8888_ColorType, skia.AlphaType.kPremul_AlphaType)
    return skia, surface, surface.getCanvas(), picture


def skia_path_entry(scene: FlatScene) -> Entry:
    """Return Skia's drawPath without antialiasing, called for each triangle."""
    skia, surface, canvas, picture = skia_canvas(scene.size)
    held: list[list[Any]] = [[], []]

    def convert() -> None:
        held[0], held[1] = scene.vertices.tolist(), skia_colors(scene.colors)

    def draw() -> Arrays:
        canvas.clear(0)
        paint, make, point = skia.Paint(AntiAlias=False), skia.Path.Polygon, skia.Point
        for (a, b, c), color in zip(*held, strict=True):
            paint.setColor(color)
            canvas.drawPath(make([point(*a), point(*b), point(*c)], True), paint)
        surface.flushAndSubmit()
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


def skia_vertices_entry(scene: FlatScene) -> Entry:
    """Return Skia's drawVertices, with a colour at each corner."""
    skia, surface, canvas, picture = skia_canvas(scene.size)
    paint = skia.Paint(AntiAlias=False, Color=0xFFFFFFFF)
    held: list[Any] = []

    def convert() -> None:
        colors = skia_colors(scene.colors if scene.kind == "shaded" else np.repeat(scene.colors, 3, axis=0))
        points = [skia.Point(*point) for point in scene.vertices.reshape(-1, 2).tolist()]
        held[:] = [
            skia.Vertices(skia.Vertices.kTriangles_VertexMode, points[start:end], None, colors[start:end])
            for start in range(0, len(points), SKIA_VERTICES)
            for end in (start + SKIA_VERTICES,)
        ]

    def draw() -> Arrays:
        canvas.clear(0)
        for vertices in held:
            canvas.drawVertices(vertices, paint, skia.BlendMode.kDst)
        surface.flushAndSubmit()
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


def blend2d_context(blend2d: Any, image: Any) -> Any:
    """Return a context of Blend2D that has cleared its image to black."""
    context = blend2d.Context(image)
    context.set_comp_op(blend2d.CompOp.SRC_COPY)
    context.set_fill_style_rgba(*BLACK)
    context.fill_all()
    context.set_comp_op(blend2d.CompOp.SRC_OVER)
    return context


def blend2d_path(blend2d: Any, points: list[list[float]]) -> Any:
    """Return a closed path."""
    path = blend2d.Path()
    path.move_to(*points[0])
    for point in points[1:]:
        path.line_to(*point)
    path.close()
    return path


def blend2d_entry(scene: FlatScene) -> Entry:
    """Return Blend2D's fill_path, called for each triangle."""
    blend2d = load("blend2d", "blend2d-py")
    image = blend2d.Image(*scene.size)
    held: list[Any] = [[], []]

    def convert() -> None:
        held[:] = [scene.vertices.tolist(), scene.colors[:, :3].tolist()]

    def draw() -> Arrays:
        context = blend2d_context(blend2d, image)
        for corners, color in zip(*held, strict=True):
            context.set_fill_style_rgba(*color)
            context.fill_path(blend2d_path(blend2d, corners))
        context.end()
        return (image.asarray(),)

    return Entry(convert, draw, swapped_colors, "colors")


def rasterio_entry(scene: FlatScene) -> Entry:
    """Return rasterio's rasterize, which is GDAL's, with the colour as the number to burn."""
    features = load("rasterio.features", "rasterio")
    held: list[Any] = []

    def convert() -> None:
        closed = np.concatenate([scene.vertices, scene.vertices[:, :1]], axis=1).tolist()
        values = scene.colors.view(np.uint32).ravel().tolist()
        held[:] = [({"type": "Polygon", "coordinates": [ring]}, value) for ring, value in zip(closed, values, strict=True)]

    def draw() -> Arrays:
        burnt = features.rasterize(held, scene.size[::-1], dtype="uint32")
        return (burnt.view(np.uint8).reshape(*scene.size[::-1], 4),)

    return Entry(convert, draw, first_colors, "colors")


def datashader_entry(scene: FlatScene) -> Entry:
    """Return datashader's trimesh for one number at each corner: the red of the last triangle."""
    datashader, pandas = load("datashader", "datashader"), load("pandas", "datashader")
    canvas = datashader.Canvas(*scene.size, (0, scene.size[0]), (0, scene.size[1]))
    held: list[Any] = []

    def convert() -> None:
        x, y = scene.vertices.reshape(-1, 2).T
        red = scene.colors[..., 0].ravel() if scene.kind == "shaded" else np.repeat(scene.colors[:, 0], 3)
        corners = np.arange(3 * scene.count).reshape(-1, 3)
        held[:] = [pandas.DataFrame({"x": x, "y": y, "red": red.astype(np.float32)}), pandas.DataFrame(corners)]

    def draw() -> Arrays:
        way = "linear" if scene.kind == "shaded" else "nearest"
        return (canvas.trimesh(*held, interpolate=way, agg=datashader.last("red")).values,)

    return Entry(convert, draw, lambda arrays: np.nan_to_num(first(arrays)), "one channel")


FLAT, SHADED = ("flat",), ("shaded",)
PEERS = {
    "scanspan Canvas.triangles": Peer(canvas_entry, FLAT + SHADED, "RGBA; exact top-left, 8 sub-pixel bits, painted in order"),
    "scanspan Canvas.triangles with depths": Peer(deep_canvas_entry, ("deep",), "RGBA and float32 depth; exact top-left"),
    "Pillow polygon": Peer(pillow_entry, FLAT, "RGBA; whole pixels, fills the outline too"),
    "Skia drawPath": Peer(skia_path_entry, FLAT, "RGBA; pixel centres, sub-pixel bits of its own"),
    "Skia drawVertices": Peer(skia_vertices_entry, FLAT + SHADED, "RGBA; pixel centres, sub-pixel bits of its own"),
    "Blend2D fill_path": Peer(blend2d_entry, FLAT, "RGBA; always antialiased, 8 sub-pixel bits"),
    "rasterio rasterize": Peer(rasterio_entry, FLAT, "one number a pixel, here RGBA in 32 bits; pixel centres, float64"),
    "datashader trimesh": Peer(datashader_entry, FLAT + SHADED, "one float a pixel, here the red of the last triangle"),
}
