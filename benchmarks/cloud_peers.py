"""Who is raced on points in space: scanspan, the plain loop of numba that one would write, datashader, and NumPy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.cloud_scenes import CloudScene, place
from benchmarks.entry import Arrays, Entry, Peer, attempt, load, nothing


def _upright(scene: CloudScene) -> Any:
    """Return how depths row after row become an image, with 0 where there is nothing."""
    width, height = scene.size
    return lambda arrays: np.nan_to_num(arrays[0][: width * height]).reshape(height, width)


def splats_entry(scene: CloudScene) -> Entry:
    """Return scanspan's kernel: depth and number of the nearest point, in one word a pixel."""
    from scanspan.raster.splats import cut_blocks, draw_splats, new_keys
    from scanspan.raster.write import EMPTY_KEY, unpack_depth

    keys, blocks = new_keys(scene.size), cut_blocks(scene.count)
    none, one, matrix = np.zeros((len(blocks), 3)), np.ones((len(blocks), 3)), scene.matrix[None]

    def draw() -> Arrays:
        keys.fill(EMPTY_KEY)
        draw_splats(keys, scene.size, scene.positions, blocks, none, one, matrix)
        return (keys,)

    def depths(arrays: Arrays) -> NDArray[Any]:
        found = np.zeros(scene.size[0] * scene.size[1], np.float32)
        seen = np.flatnonzero(arrays[0][: len(found)] != EMPTY_KEY)
        found[seen] = [unpack_depth(key) for key in arrays[0][seen]]
        return found.reshape(scene.size[::-1])

    return Entry(nothing, draw, depths, "depths")


def render_entry(scene: CloudScene) -> Entry:
    """Return scanspan's `render`, to a picture by height."""
    import scanspan
    from scanspan.assets.lens import Perspective

    camera = scanspan.Camera(scene.view, Perspective(scene.fov), scene.near)
    options = {"samples": 1, "point_size": 1, "eye_dome": False, "threads": 1, "background": "black"}
    held: list[Any] = []
    few = scanspan.PointCloud(scene.positions[:9])
    attempt("render of clouds", lambda: scanspan.render(few, camera, (64, 48), **options))

    def convert() -> None:
        held[:] = [scanspan.PointCloud(scene.positions)]

    def draw() -> Arrays:
        frame = scanspan.render(held[0], camera, scene.size, **options)
        return frame.color, frame._keys

    def depths(arrays: Arrays) -> NDArray[Any]:
        return splats_entry(scene).result(arrays[1:])

    return Entry(convert, draw, depths, "depths")


def loop_entry(scene: CloudScene) -> Entry:
    """Return a plain loop over the points that keeps the nearest, with a branch."""
    numba = load("numba", "numba")

    @numba.njit(error_model="numpy")  # type: ignore[untyped-decorator]
    def draw_points(positions: Any, m: Any, width: int, height: int, depths: Any, numbers: Any) -> None:
        for i in range(len(positions)):
            x, y, z = np.float64(positions[i, 0]), np.float64(positions[i, 1]), np.float64(positions[i, 2])
            w = m[3, 0] * x + m[3, 1] * y + m[3, 2] * z + m[3, 3]
            if w <= 0:
                continue
            column = (m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]) / w
            row = (m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]) / w
            depth = np.float32((m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]) / w)
            inside = 0 <= column < width and 0 <= row < height and depth <= 1
            if inside and depth > depths[int(row), int(column)]:
                depths[int(row), int(column)] = depth
                numbers[int(row), int(column)] = i

    depths, numbers = np.zeros(scene.size[::-1], np.float32), np.full(scene.size[::-1], -1, np.int32)
    draw_points(scene.positions[:1], scene.matrix, *scene.size, depths, numbers)

    def draw() -> Arrays:
        depths.fill(0)
        numbers.fill(-1)
        draw_points(scene.positions, scene.matrix, *scene.size, depths, numbers)
        return depths, numbers

    return Entry(nothing, draw, lambda arrays: arrays[0], "depths")


def datashader_entry(scene: CloudScene) -> Entry:
    """Return datashader's points with the largest depth; it draws in the plane, so that projecting counts as converting."""
    datashader, pandas = load("datashader", "datashader"), load("pandas", "datashader")
    width, height = scene.size
    canvas = datashader.Canvas(width, height, (0, width), (0, height))
    held: list[Any] = []

    def convert() -> None:
        x, y, z = scene.positions.T.astype(np.float64)
        across, down, depth, w = (((row[0] * x + row[1] * y) + row[2] * z) + row[3] for row in scene.matrix)
        held[:] = [pandas.DataFrame({"x": across / w, "y": down / w, "depth": (depth / w).astype(np.float32)})]

    def draw() -> Arrays:
        return (canvas.points(held[0], "x", "y", agg=datashader.max("depth")).values,)

    return Entry(convert, draw, lambda arrays: np.nan_to_num(arrays[0]), "depths")


def maximum_entry(scene: CloudScene) -> Entry:
    """Return NumPy's maximum.at."""
    width, height = scene.size

    def draw() -> Arrays:
        pixel, depth = place(scene)
        depths = np.zeros(width * height + 1, np.float32)
        np.maximum.at(depths, pixel, depth)
        return (depths,)

    return Entry(nothing, draw, _upright(scene), "depths")


def sort_entry(scene: CloudScene) -> Entry:
    """Return NumPy's assignment of points that are sorted by depth, the nearest last."""
    width, height = scene.size

    def draw() -> Arrays:
        pixel, depth = place(scene)
        order = np.argsort(depth)
        depths = np.zeros(width * height + 1, np.float32)
        depths[pixel[order]] = depth[order]
        return (depths,)

    return Entry(nothing, draw, _upright(scene), "depths")


CLOUD = ("cloud",)
PEERS = {
    "scanspan splats": Peer(splats_entry, CLOUD, "float32 depth and number in a word, of float32 points"),
    "scanspan render of points": Peer(render_entry, CLOUD, "RGBA by height, and depth and number"),
    "numba loop over points": Peer(loop_entry, CLOUD, "float32 depth and int32 number; a branch for each test"),
    "datashader max of points": Peer(datashader_entry, CLOUD, "float64 depth, of points in the plane"),
    "np.maximum.at": Peer(maximum_entry, CLOUD, "float32 depth"),
    "np.argsort of points": Peer(sort_entry, CLOUD, "float32 depth"),
}
