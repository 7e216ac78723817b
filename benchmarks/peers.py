"""Who is raced on triangles in space: scanspan, OpenCV's rasterizer, and filling the same arrays with a constant.

Flat and shaded triangles are given a depth that rises from one to the next, so that the later hides the earlier.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import Arrays, Entry, MissingError, Peer, first, first_colors, load_opencv, nothing, opencv_points
from benchmarks.scenes import FlatScene, MeshScene, Scene

BACKGROUND = 0
DEPTHS = (0.5, 4.0)  # The near and far plane of the camera that stands in for the screen in OpenCV.


def rasterize_entry(scene: Scene) -> Entry:
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

        return Entry(convert_mesh, draw_mesh, lambda arrays: arrays[0] >= 0, "mask")

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

    return Entry(convert_flat, draw_flat, first_colors, "colors")


def interpolate_entry(scene: Scene) -> Entry:
    """Return scanspan: `rasterize`, and `interpolate` for a colour at each corner or vertex: RGB and depth."""
    import scanspan

    held: dict[str, NDArray[Any]] = {}
    if isinstance(scene, MeshScene):
        matrix = scene.matrix

        def convert_mesh() -> None:
            held["positions"] = np.column_stack([scene.positions, np.ones(scene.positions.shape[0])])
            light = scene.positions - scene.positions.min(axis=0)
            held["colors"] = np.rint(light / light.max() * 255).astype(np.uint8)

        def draw_mesh() -> Arrays:
            seen = scanspan.rasterize(held["positions"] @ matrix.T, scene.triangles, scene.size, threads=1)
            return scanspan.interpolate(seen, held["colors"], dtype=np.uint8), seen.depth, seen.primitive

        return Entry(convert_mesh, draw_mesh, lambda arrays: arrays[2] >= 0, "mask")

    width, height = scene.size

    def convert_deep() -> None:
        assert scene.depths is not None
        clip = np.ones((scene.count, 3, 4))
        np.multiply(scene.vertices, (2.0 / width, -2.0 / height), out=clip[..., :2])
        clip[..., :2] += (-1, 1)
        clip[..., 2] = 2 * scene.depths - 1.0
        held["clip"] = clip.reshape(-1, 4)
        held["triangles"] = np.arange(3 * scene.count, dtype=np.int32).reshape(-1, 3)
        held["colors"] = np.ascontiguousarray(scene.colors.reshape(-1, 4)[:, :3])

    def draw_deep() -> Arrays:
        seen = scanspan.rasterize(held["clip"], held["triangles"], scene.size, threads=1)
        return scanspan.interpolate(seen, held["colors"], dtype=np.uint8), seen.depth, seen.primitive

    return Entry(convert_deep, draw_deep, first, "colors")


def _opencv_arrays(scene: Scene) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return vertices in camera space, indices and colours as OpenCV's rasterizer takes them."""
    if isinstance(scene, MeshScene):
        light = scene.positions - scene.positions.min(axis=0)
        return scene.positions, scene.triangles, np.ascontiguousarray(light / light.max(), dtype=np.float32)

    # Place each triangle at a distance that falls with its number, before a camera of 90 degrees.
    width, height = scene.size
    distance = (2 - np.arange(scene.count, dtype=np.float32) / scene.count)[:, None]
    if scene.depths is not None:
        distance = 1 + scene.depths
    x = (scene.vertices[..., 0] - width / 2) / (height / 2) * distance
    y = (height / 2 - scene.vertices[..., 1]) / (height / 2) * distance
    vertices = np.stack([x, y, np.broadcast_to(-distance, x.shape)], axis=-1).reshape(-1, 3).astype(np.float32)
    corners = scene.colors if scene.colors.ndim == 3 else np.repeat(scene.colors, 3, axis=0)
    colors = corners.reshape(-1, 4)[:, :3].astype(np.float32) / 255
    return vertices, np.arange(3 * scene.count, dtype=np.int32).reshape(-1, 3), colors


def opencv_rasterize_entry(scene: Scene, with_depth: bool = True) -> Entry:
    """Return OpenCV's triangleRasterize, or triangleRasterizeColor."""
    cv2 = load_opencv()
    if not hasattr(cv2, "triangleRasterize"):
        raise MissingError(f"needs OpenCV 5; this is {cv2.__version__}, which has no triangleRasterize")
    settings = cv2.TriangleRasterizeSettings()
    settings.setCullingMode(cv2.RASTERIZE_CULLING_NONE)
    settings.setShadingType(cv2.RASTERIZE_SHADING_FLAT if scene.kind == "flat" else cv2.RASTERIZE_SHADING_SHADED)
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

    if isinstance(scene, MeshScene):
        mask = (lambda arrays: arrays[1] < far) if with_depth else (lambda arrays: arrays[0].any(axis=-1))
        return Entry(convert, draw, mask, "mask")
    gives = "colors in perspective" if scene.kind == "deep" else "colors"
    return Entry(convert, draw, lambda arrays: np.rint(arrays[0] * 255), gives)


def opencv_color_entry(scene: Scene) -> Entry:
    """Return OpenCV's triangleRasterizeColor."""
    return opencv_rasterize_entry(scene, with_depth=False)


def opencv_convex_entry(scene: FlatScene) -> Entry:
    """Return OpenCV's fillConvexPoly, called for each triangle, with 8 sub-pixel bits."""
    cv2, picture = load_opencv(), np.zeros((scene.size[1], scene.size[0], 4), dtype=np.uint8)
    held: list[list[Any]] = [[], []]

    def convert() -> None:
        held[0] = list(opencv_points(scene.vertices))
        held[1] = scene.colors.tolist()

    def draw() -> Arrays:
        picture.fill(BACKGROUND)
        for corners, color in zip(*held, strict=True):
            cv2.fillConvexPoly(picture, corners, color, cv2.LINE_8, 8)
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


# What scanspan returns for a scene of a kind: types of pixels, of so many channels.
RETURNED: dict[str, tuple[tuple[Any, int], ...]] = {
    "flat": ((np.uint8, 4), (np.int32, 1), (np.float32, 1)),
    "shaded": ((np.uint8, 4),),
    "deep": ((np.float32, 3), (np.float32, 1), (np.int32, 1)),
    "mesh": ((np.int32, 1), (np.float32, 1)),
    "lines": ((np.uint8, 4),),
    "smooth lines": ((np.uint8, 4),),
    "polygon": ((np.bool_, 1),),
    "smooth polygon": ((np.float64, 1),),
    "points": ((np.int32, 1),),
    "cloud": ((np.int64, 1),),
    "flood": ((np.uint8, 4),),
    "burn": ((np.int32, 1),),
    "measure": ((np.float64, 1),),
}


def fill_entry(scene: Any) -> Entry:
    """Return the filling of the arrays that scanspan returns: the least that any of them could take."""
    arrays = [np.zeros((scene.size[1], scene.size[0], channels), dtype) for dtype, channels in RETURNED[scene.kind]]

    def draw() -> Arrays:
        for array in arrays:
            array.fill(1)
        return tuple(arrays)

    return Entry(nothing, draw, first, "a constant")


FLAT, SPACE, DEEP = ("flat",), ("flat", "shaded", "mesh"), ("deep", "mesh")
PEERS = {
    "scanspan rasterize": Peer(
        rasterize_entry,
        ("flat", "mesh"),
        "primitive, float32 depth (and RGBA for flat scenes); exact top-left, 8 sub-pixel bits",
    ),
    "scanspan rasterize, interpolate": Peer(
        interpolate_entry, DEEP, "8-bit RGB and depth, and primitive; exact top-left, 8 sub-pixel bits"
    ),
    "cv2.triangleRasterize": Peer(
        opencv_rasterize_entry, (*SPACE, "deep"), "float32 RGB and depth, always in perspective; ties hit twice"
    ),
    "cv2.triangleRasterizeColor": Peer(opencv_color_entry, SPACE, "float32 RGB; ties hit twice"),
    "cv2.fillConvexPoly": Peer(
        opencv_convex_entry, FLAT, "RGBA; 8 sub-pixel bits, fills the outline too, so neighbours overlap"
    ),
}
FILL = "memory fill"
FILLS = {FILL: Peer(fill_entry, tuple(RETURNED), "the arrays that scanspan returns, filled with a constant")}
