"""Who is raced on points, a flood fill, triangulation, and many polygons at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import Arrays, Entry, Peer, attempt, first, load, load_opencv, nothing, opencv_points
from benchmarks.plane_scenes import FloodScene, PointScene, RingsScene


def aggregate_entry(scene: PointScene) -> Entry:
    """Return `aggregate`, which counts points."""
    import scanspan

    held: list[NDArray[Any]] = []
    few = np.zeros((1, 2))
    attempt("aggregate", lambda: scanspan.aggregate(few, (1, 1), threads=1))

    def convert() -> None:
        held[:] = [np.column_stack([scene.x, scene.y])]

    return Entry(convert, lambda: (scanspan.aggregate(held[0], scene.size, threads=1),), first, "counts")


def aggregate_columns_entry(scene: PointScene) -> Entry:
    """Return `aggregate` of a table, which needs no conversion."""
    import scanspan

    table = {"x": scene.x, "y": scene.y}
    attempt("aggregate", lambda: scanspan.aggregate({"x": scene.x[:1], "y": scene.y[:1]}, scene.size))
    return Entry(nothing, lambda: (scanspan.aggregate(table, scene.size, threads=1),), first, "counts")


def datashader_entry(scene: PointScene) -> Entry:
    """Return datashader's points."""
    datashader, pandas = load("datashader", "datashader"), load("pandas", "datashader")
    canvas = datashader.Canvas(*scene.size, (0, scene.size[0]), (0, scene.size[1]))
    held: list[Any] = []

    def convert() -> None:
        held[:] = [pandas.DataFrame({"x": scene.x, "y": scene.y})]

    return Entry(convert, lambda: (canvas.points(held[0], "x", "y", agg=datashader.count()).values,), first, "counts")


def histogram_entry(scene: PointScene) -> Entry:
    """Return NumPy's histogram2d."""
    (width, height) = scene.size

    def draw() -> Arrays:
        return (np.histogram2d(scene.y, scene.x, (height, width), ((0, height), (0, width)))[0],)

    return Entry(nothing, draw, first, "counts")


def bincount_entry(scene: PointScene) -> Entry:
    """Return NumPy's bincount of the numbers of the pixels."""
    (width, height) = scene.size

    def draw() -> Arrays:
        pixels = scene.y.astype(np.int64) * width + scene.x.astype(np.int64)
        return (np.bincount(pixels, minlength=width * height).reshape(height, width),)

    return Entry(nothing, draw, first, "counts")


def _is_filled(scene: FloodScene) -> Any:
    """Return how to see which pixels have been filled, whatever channels there are."""
    return lambda arrays: arrays[0].reshape(*scene.size[::-1], -1)[..., 0] == scene.value


def canvas_flood_entry(scene: FloodScene) -> Entry:
    """Return `Canvas.flood_fill` of a picture in RGBA."""
    import scanspan

    source = np.repeat(scene.image[..., None], 4, axis=2)
    source[..., 3] = 255
    picture = source.copy()
    canvas = scanspan.Canvas.from_array(picture, threads=1)
    color = np.array([scene.value] * 3 + [255], dtype=np.uint8)

    def draw() -> Arrays:
        np.copyto(picture, source)
        canvas.flood_fill(*scene.seed, color)
        return (picture,)

    return Entry(nothing, draw, _is_filled(scene), "mask")


def opencv_flood_entry(scene: FloodScene, channels: int = 3) -> Entry:
    """Return OpenCV's floodFill of a picture in RGB, or in grey."""
    cv2 = load_opencv()
    source = np.ascontiguousarray(np.repeat(scene.image[..., None], channels, axis=2))
    picture = source.copy()

    def draw() -> Arrays:
        np.copyto(picture, source)
        cv2.floodFill(picture, None, scene.seed, (scene.value,) * channels, flags=4)
        return (picture,)

    return Entry(nothing, draw, _is_filled(scene), "mask")


def opencv_grey_flood_entry(scene: FloodScene) -> Entry:
    """Return OpenCV's floodFill of a picture in grey."""
    return opencv_flood_entry(scene, channels=1)


def pillow_flood_entry(scene: FloodScene) -> Entry:
    """Return Pillow's ImageDraw.floodfill."""
    image, drawing = load("PIL.Image", "pillow"), load("PIL.ImageDraw", "pillow")
    source = image.fromarray(scene.image)

    def draw() -> Arrays:
        picture = source.copy()
        drawing.floodfill(picture, scene.seed, scene.value)
        return (np.asarray(picture),)

    return Entry(nothing, draw, _is_filled(scene), "mask")


def label_entry(scene: FloodScene) -> Entry:
    """Return scipy.ndimage.label, which numbers all regions, and the choice of one."""
    ndimage = load("scipy.ndimage", "scipy")
    x, y = scene.seed

    def draw() -> Arrays:
        labels, _ = ndimage.label(scene.image == scene.image[y, x])
        return (np.where(labels == labels[y, x], np.uint8(scene.value), scene.image),)

    return Entry(nothing, draw, _is_filled(scene), "mask")


def triangulate_entry(scene: RingsScene) -> Entry:
    """Return `triangulate`, exact for every fill rule."""
    import scanspan

    rings = scene.rings
    attempt("triangulate", lambda: scanspan.triangulate([(0, 0), (1, 0), (0, 1)]))

    def draw() -> Arrays:
        mesh = scanspan.triangulate(rings)
        return mesh.positions, mesh.triangles

    return Entry(nothing, draw, lambda arrays: arrays[0][arrays[1]][..., :2], "triangles")


def earcut_entry(scene: RingsScene) -> Entry:
    """Return mapbox-earcut."""
    earcut = load("mapbox_earcut", "mapbox-earcut")
    ends = scene.starts[1:].astype(np.uint32)

    def draw() -> Arrays:
        return (earcut.triangulate_float64(scene.points, ends),)

    return Entry(nothing, draw, lambda arrays: scene.points[arrays[0].reshape(-1, 3)], "triangles")


def shapely_entry(scene: RingsScene) -> Entry:
    """Return shapely's constrained Delaunay triangles."""
    shapely = load("shapely", "shapely 2.1")
    held: list[Any] = []

    def convert() -> None:
        held[:] = [shapely.Polygon(scene.rings[0], scene.rings[1:])]

    def draw() -> Arrays:
        return (shapely.get_coordinates(shapely.constrained_delaunay_triangles(held[0])).reshape(-1, 4, 2)[:, :3],)

    return Entry(convert, draw, first, "triangles")


def zones_entry(scene: RingsScene) -> Entry:
    """Return `zones`: the number of the last polygon, or the sum of the shares of a pixel."""
    import scanspan

    rings = scene.rings
    options: Any = {} if scene.kind == "burn" else {"reduce": "count", "mode": "area"}

    def burn(polygons: list[NDArray[Any]]) -> NDArray[Any]:
        burnt: NDArray[Any] = scanspan.zones(polygons, scene.size, threads=1, **options)
        return burnt

    attempt("zones", lambda: burn(rings[:1]))
    if scene.kind == "burn":
        return Entry(nothing, lambda: (burn(rings),), lambda arrays: arrays[0] + 1, "ids")
    return Entry(nothing, lambda: (burn(rings),), first, "areas")


def canvas_burn_entry(scene: RingsScene) -> Entry:
    """Return `Canvas.polygons` with the number of the polygon as its colour."""
    import scanspan

    picture, rings = np.zeros((*scene.size[::-1], 4), dtype=np.uint8), scene.rings
    canvas = scanspan.Canvas.from_array(picture, threads=1)
    numbers = np.arange(1, len(rings) + 1, dtype="<u4")
    colors = (numbers | np.uint32(255 << 24)).view(np.uint8).reshape(-1, 4)
    attempt("Canvas.polygons", lambda: canvas.polygons(rings[:1], colors[:1]))

    def draw() -> Arrays:
        picture.fill(0)
        canvas.polygons(rings, colors)
        return (picture,)

    return Entry(nothing, draw, lambda arrays: arrays[0].view("<u4")[..., 0] & 0xFFFFFF, "ids")


def opencv_burn_entry(scene: RingsScene) -> Entry:
    """Return OpenCV's fillPoly, called for each polygon, with 8 sub-pixel bits."""
    cv2, picture = load_opencv(), np.zeros(scene.size[::-1], dtype=np.int32)
    held: list[Any] = []

    def convert() -> None:
        held[:] = [[opencv_points(ring)] for ring in scene.rings]

    def draw() -> Arrays:
        picture.fill(0)
        for number, rings in enumerate(held, 1):
            cv2.fillPoly(picture, rings, number, cv2.LINE_8, 8)
        return (picture,)

    return Entry(convert, draw, first, "ids")


def pillow_burn_entry(scene: RingsScene) -> Entry:
    """Return Pillow's ImageDraw.polygon, called for each polygon."""
    image, drawing = load("PIL.Image", "pillow"), load("PIL.ImageDraw", "pillow")
    held: list[Any] = []

    def convert() -> None:
        held[:] = [ring.ravel().tolist() for ring in scene.rings]

    def draw() -> Arrays:
        picture = image.new("I", scene.size)
        polygon = drawing.Draw(picture).polygon
        for number, ring in enumerate(held, 1):
            polygon(ring, number)
        return (np.asarray(picture),)

    return Entry(convert, draw, first, "ids")


def rasterio_burn_entry(scene: RingsScene) -> Entry:
    """Return rasterio's rasterize, which is GDAL's."""
    features = load("rasterio.features", "rasterio")
    held: list[Any] = []

    def convert() -> None:
        closed = [[*ring.tolist(), ring[0].tolist()] for ring in scene.rings]
        held[:] = [({"type": "Polygon", "coordinates": [ring]}, number) for number, ring in enumerate(closed, 1)]

    return Entry(convert, lambda: (features.rasterize(held, scene.size[::-1], dtype="int32"),), first, "ids")


def exactextract_entry(scene: RingsScene) -> Entry:
    """Return exactextract's shares of the pixels of each polygon, added up in an image."""
    extract, raster = load("exactextract", "exactextract"), load("exactextract.raster", "exactextract")
    (width, height) = scene.size
    held: list[Any] = []
    source = raster.NumPyRasterSource(np.zeros((height, width), dtype=np.uint8), 0, 0, width, height)

    def convert() -> None:
        upright = [[[x, height - y] for x, y in [*ring.tolist(), ring[0].tolist()]] for ring in scene.rings]
        held[:] = [
            {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}} for ring in upright
        ]

    def draw() -> Arrays:
        shares = np.zeros(width * height)
        for found in extract.exact_extract(source, held, ["cell_id", "coverage"]):
            shares[found["properties"]["cell_id"]] += found["properties"]["coverage"]
        return (shares.reshape(height, width),)

    return Entry(convert, draw, first, "areas")


POINTS, FLOOD, CUT, BURN, MEASURE = ("points",), ("flood",), ("triangulation",), ("burn",), ("measure",)
PEERS = {
    "scanspan aggregate": Peer(aggregate_entry, POINTS, "int32 counts of (N, 2) points"),
    "scanspan aggregate of columns": Peer(aggregate_columns_entry, POINTS, "int32 counts of two columns"),
    "datashader points": Peer(datashader_entry, POINTS, "uint32 counts of two columns"),
    "np.histogram2d": Peer(histogram_entry, POINTS, "float64 counts"),
    "np.bincount": Peer(bincount_entry, POINTS, "int64 counts"),
    "scanspan Canvas.flood_fill": Peer(canvas_flood_entry, FLOOD, "RGBA"),
    "cv2.floodFill": Peer(opencv_flood_entry, FLOOD, "RGB"),
    "cv2.floodFill of grey": Peer(opencv_grey_flood_entry, FLOOD, "uint8"),
    "Pillow floodfill": Peer(pillow_flood_entry, FLOOD, "uint8"),
    "scipy.ndimage.label": Peer(label_entry, FLOOD, "uint8; numbers all regions, and one is chosen"),
    "scanspan triangulate": Peer(triangulate_entry, CUT, "triangles; exact, any fill rule, crossings too"),
    "mapbox-earcut": Peer(earcut_entry, CUT, "triangles; no crossings"),
    "shapely": Peer(shapely_entry, CUT, "constrained Delaunay triangles; no crossings"),
    "scanspan zones": Peer(zones_entry, BURN + MEASURE, "int32 numbers, or float64 sums of shares"),
    "scanspan Canvas.polygons": Peer(canvas_burn_entry, BURN, "RGBA, here the number in 24 bits; painted in order"),
    "cv2.fillPoly, each": Peer(opencv_burn_entry, BURN, "int32; 8 sub-pixel bits, fills the outline too"),
    "Pillow polygon, each": Peer(pillow_burn_entry, BURN, "int32; whole pixels, fills the outline too"),
    "rasterio rasterize of many": Peer(rasterio_burn_entry, BURN, "int32; pixel centres"),
    "exactextract": Peer(exactextract_entry, MEASURE, "float64 sums of shares"),
}
