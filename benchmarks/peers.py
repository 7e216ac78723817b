"""Who is raced: scanspan, OpenCV's three ways to fill triangles, and filling the same arrays with a constant.

A peer is made ready for a scene. Its `convert` turns the arrays of the scene into what the peer takes; its `draw` clears,
draws and returns the picture as NumPy arrays. Each is timed by itself, because a caller may hold either form of the arrays.
All use one thread. What peers return differs, and so do their edge rules: `PEERS` says how.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import FlatScene, MeshScene, Scene

Arrays = tuple[NDArray[Any], ...]

BACKGROUND = 0
DEPTHS = (0.5, 4.0)  # The near and far plane of the camera that stands in for the screen in OpenCV.


class Entry(NamedTuple):
    """A peer made ready for a scene: turn arrays, draw, and say which pixels of the result are covered."""

    convert: Callable[[], None]
    draw: Callable[[], Arrays]
    covered: Callable[[Arrays], int]


class MissingError(Exception):
    """A peer that is not installed; the message says what to install."""


def _opencv() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise MissingError("needs opencv-python-headless 5, which is in the bench dependency group") from error
    if not hasattr(cv2, "triangleRasterize"):
        raise MissingError(f"needs OpenCV 5; this is {cv2.__version__}, which has no triangleRasterize")
    cv2.setNumThreads(1)
    return cv2


def scanspan_entry(scene: Scene) -> Entry:
    """Return scanspan: `rasterize`, and for flat scenes a colour for each primitive."""
    import scanspan

    held: dict[str, NDArray[Any]] = {}
    if isinstance(scene, MeshScene):
        matrix = scene.matrix

        def convert_mesh() -> None:
            held["positions"] = np.column_stack([scene.positions, np.ones(scene.positions.shape[0])])

        def draw_mesh() -> Arrays:
            seen = scanspan.rasterize(held["positions"] @ matrix.T, scene.triangles, scene.size, threads=1)
            return seen.primitive, seen.depth

        return Entry(convert_mesh, draw_mesh, lambda arrays: int((arrays[0] >= 0).sum()))

    # Let the depth rise from triangle to triangle, and end the table of colours with the background, which -1 finds.
    width, height = scene.size

    def convert_flat() -> None:
        clip = np.empty((scene.count, 3, 4))
        np.multiply(scene.vertices, (2.0 / width, -2.0 / height), out=clip[..., :2])
        clip[..., :2] += (-1, 1)
        clip[..., 2] = (1 - 2 * np.arange(1, scene.count + 1) / (scene.count + 1))[:, None]
        clip[..., 3] = 1
        held["clip"] = clip.reshape(-1, 4)
        held["triangles"] = np.arange(3 * scene.count, dtype=np.int32).reshape(-1, 3)
        held["table"] = np.append(scene.colors.view(np.uint32).ravel(), np.uint32(BACKGROUND))

    def draw_flat() -> Arrays:
        seen = scanspan.rasterize(held["clip"], held["triangles"], scene.size, threads=1)
        color = held["table"][seen.primitive]
        return color.view(np.uint8).reshape(height, width, 4), seen.primitive, seen.depth

    return Entry(convert_flat, draw_flat, lambda arrays: int((arrays[1] >= 0).sum()))


def _opencv_arrays(scene: Scene) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return vertices in camera space, indices and colours as OpenCV's rasterizer takes them."""
    if isinstance(scene, MeshScene):
        light = scene.positions - scene.positions.min(axis=0)
        return scene.positions, scene.triangles, np.ascontiguousarray(light / light.max(), dtype=np.float32)

    # Place each triangle at a distance that falls with its number, before a camera of 90 degrees.
    width, height = scene.size
    distance = (2 - np.arange(scene.count, dtype=np.float32) / scene.count)[:, None]
    x = (scene.vertices[..., 0] - width / 2) / (height / 2) * distance
    y = (height / 2 - scene.vertices[..., 1]) / (height / 2) * distance
    vertices = np.stack([x, y, np.broadcast_to(-distance, x.shape)], axis=-1).reshape(-1, 3).astype(np.float32)
    colors = np.repeat(scene.colors[:, :3].astype(np.float32) / 255, 3, axis=0)
    return vertices, np.arange(3 * scene.count, dtype=np.int32).reshape(-1, 3), colors


def opencv_rasterize_entry(scene: Scene, with_depth: bool = True) -> Entry:
    """Return OpenCV's triangleRasterize, or triangleRasterizeColor."""
    cv2 = _opencv()
    settings = cv2.TriangleRasterizeSettings()
    settings.setCullingMode(cv2.RASTERIZE_CULLING_NONE)
    flat = isinstance(scene, FlatScene)
    settings.setShadingType(cv2.RASTERIZE_SHADING_FLAT if flat else cv2.RASTERIZE_SHADING_SHADED)
    view, fov, (near, far) = np.eye(4), np.pi / 2, DEPTHS
    if isinstance(scene, MeshScene):
        view, fov, near, far = scene.view, scene.fov, scene.near, scene.far
    view = view[:3].astype(np.float32)

    # Draw into arrays that are made once and cleared each time.
    held: list[NDArray[Any]] = []
    shape = (scene.size[1], scene.size[0])
    color, depth = np.zeros((*shape, 3), dtype=np.float32), np.zeros(shape, dtype=np.float32)

    def convert() -> None:
        held[:] = _opencv_arrays(scene)

    def draw() -> Arrays:
        color.fill(BACKGROUND)
        if not with_depth:
            cv2.triangleRasterizeColor(*held, color, view, fov, near, far, settings)
            return (color,)
        depth.fill(far)
        cv2.triangleRasterize(*held, color, depth, view, fov, near, far, settings)
        return color, depth

    def covered(arrays: Arrays) -> int:
        return int((arrays[1] < far).sum() if with_depth else arrays[0].any(axis=-1).sum())

    return Entry(convert, draw, covered)


def opencv_color_entry(scene: Scene) -> Entry:
    """Return OpenCV's triangleRasterizeColor."""
    return opencv_rasterize_entry(scene, with_depth=False)


def opencv_convex_entry(scene: Scene) -> Entry:
    """Return OpenCV's fillConvexPoly, called for each triangle, with 8 sub-pixel bits."""
    if isinstance(scene, MeshScene):
        raise MissingError("draws flat triangles only")
    cv2, picture = _opencv(), np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    held: list[list[Any]] = [[], []]

    def convert() -> None:
        # Its pixels are centred on whole numbers, and it takes whole sub-pixels.
        held[0] = list(np.rint((scene.vertices.astype(np.float64) - 0.5) * 256).astype(np.int32))
        held[1] = scene.colors.tolist()

    def draw() -> Arrays:
        picture.fill(BACKGROUND)
        for corners, color in zip(*held, strict=True):
            cv2.fillConvexPoly(picture, corners, color, cv2.LINE_8, 8)
        return (picture,)

    return Entry(convert, draw, lambda arrays: int((arrays[0][..., 3] > 0).sum()))


def fill_entry(scene: Scene) -> Entry:
    """Return the filling of the arrays that scanspan returns: the least that any of them could take."""
    shape = (scene.size[1], scene.size[0])
    arrays: list[NDArray[Any]] = [np.zeros(shape, dtype=np.int32), np.zeros(shape, dtype=np.float32)]
    if isinstance(scene, FlatScene):
        arrays.append(np.zeros(shape, dtype=np.uint32))

    def draw() -> Arrays:
        for array in arrays:
            array.fill(1)
        return tuple(arrays)

    return Entry(lambda: None, draw, lambda filled: int(filled[0].sum()))


# Name: how to make it ready, and what it gives.
PEERS: dict[str, tuple[Callable[[Scene], Entry], str]] = {
    "scanspan": (scanspan_entry, "primitive, float32 depth (and RGBA for flat scenes); exact top-left, 8 sub-pixel bits"),
    "cv2.triangleRasterize": (opencv_rasterize_entry, "float32 RGB and depth; ties hit twice"),
    "cv2.triangleRasterizeColor": (opencv_color_entry, "float32 RGB; ties hit twice"),
    "cv2.fillConvexPoly": (opencv_convex_entry, "RGBA; fills the outline too, so neighbours overlap"),
    "memory fill": (fill_entry, "the arrays that scanspan returns, filled with a constant"),
}
OURS, FILL = "scanspan", "memory fill"
