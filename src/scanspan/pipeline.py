"""The table of contents: assets -> geometry -> raster -> shade -> target.

`rasterize`, `interpolate` and `count` are the stages by themselves, for arrays; `render` runs all of them for a scene.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from scanspan.assets.buffers import check_clip, check_screen_triangles, check_values
from scanspan.assets.camera import Camera
from scanspan.assets.cloud import PointCloud
from scanspan.assets.framing import parse_up
from scanspan.assets.lens import check_size
from scanspan.assets.scene import GEOMETRIES, Geometry, Instance, Scene
from scanspan.errors import InputError, LimitError
from scanspan.geometry.assemble import assemble
from scanspan.geometry.clip import to_screen
from scanspan.geometry.outlines import to_screen_with_polygons
from scanspan.geometry.project import screen_triangles
from scanspan.homogeneous import quote
from scanspan.raster.algorithms import check_algorithm, run, run_each
from scanspan.raster.options import OffscreenPoint, check_flag, check_number, check_subpixel_bits, check_threads, make_sampling
from scanspan.records import DrawList, ScreenPolygons, ScreenTriangles
from scanspan.samples import sample_offsets
from scanspan.shade.color import linear_color
from scanspan.shade.lamps import check_lighting, choose_lighting
from scanspan.shade.shading import Look, are_translucent, gather_surfaces
from scanspan.shade.surface import check_shading
from scanspan.target.frame import Frame
from scanspan.target.peel import split
from scanspan.target.picture import Picture, shade_picture, write_picture
from scanspan.target.resolve import background as make_background
from scanspan.target.sink import check_sink, write_whole
from scanspan.target.visibility import (
    RasterOptions,
    Visibility,
    count_triangles,
    find_visible,
    interpolate_visible,
    rasterize_triangles,
)

if TYPE_CHECKING:
    from scanspan.clouds import CloudLook

MAX_PIXELS = 1 << 28  # of an image by default; buffers take some 50 bytes a pixel


def check_pixels(size: Any, max_pixels: int) -> tuple[int, int]:
    """Return a size as two integers, if it is one and not too large."""
    width, height = check_size(size)
    if width * height > max_pixels:
        raise LimitError(f"size = ({width}, {height}): {width * height} pixels, the limit is max_pixels={max_pixels}")
    return width, height


@overload
def render(
    scene: Scene | Instance | Geometry, camera: Camera | str | None = None, size: tuple[int, int] = (1280, 960), *,
    algorithm: str = "half-space", order: str = "rows", samples: int = 4, cull: str = "none", background: Any = None,
    shading: str = "auto", crease_angle: float = 40.0, two_sided: bool = True, textures: bool = True, translucency: bool = True,
    lights: str = "auto", edges: bool = False, line_width: float = 1.0, edge_color: Any = (0.08, 0.09, 0.11),
    point_size: float | str | None = None, point_shape: str | None = None, color_by: str | None = None,
    eye_dome: bool | float | None = None, up: str | None = None, blend: str = "linear", subpixel_bits: int = 8,
    threads: int | None = None, max_pixels: int = MAX_PIXELS, out: None = None,
) -> Frame: ...  # fmt: skip


@overload
def render(
    scene: Scene | Instance | Geometry, camera: Camera | str | None = None, size: tuple[int, int] = (1280, 960), *,
    algorithm: str = "half-space", order: str = "rows", samples: int = 4, cull: str = "none", background: Any = None,
    shading: str = "auto", crease_angle: float = 40.0, two_sided: bool = True, textures: bool = True, translucency: bool = True,
    lights: str = "auto", edges: bool = False, line_width: float = 1.0, edge_color: Any = (0.08, 0.09, 0.11),
    point_size: float | str | None = None, point_shape: str | None = None, color_by: str | None = None,
    eye_dome: bool | float | None = None, up: str | None = None, blend: str = "linear", subpixel_bits: int = 8,
    threads: int | None = None, max_pixels: int = MAX_PIXELS, out: str | PathLike[str],
) -> Path: ...  # fmt: skip


def render(
    scene: Scene | Instance | Geometry, camera: Camera | str | None = None, size: tuple[int, int] = (1280, 960), *,
    algorithm: str = "half-space", order: str = "rows", samples: int = 4, cull: str = "none", background: Any = None,
    shading: str = "auto", crease_angle: float = 40.0, two_sided: bool = True, textures: bool = True, translucency: bool = True,
    lights: str = "auto", edges: bool = False, line_width: float = 1.0, edge_color: Any = (0.08, 0.09, 0.11),
    point_size: float | str | None = None, point_shape: str | None = None, color_by: str | None = None,
    eye_dome: bool | float | None = None, up: str | None = None, blend: str = "linear", subpixel_bits: int = 8,
    threads: int | None = None, max_pixels: int = MAX_PIXELS, out: str | PathLike[str] | None = None,
) -> Frame | Path:  # fmt: skip
    """Render a scene to a picture.

    Parameters
    ----------
    scene : a Scene, or one Mesh, Polygons, Segments, Points, PointCloud or Instance.
    camera : a Camera, or the name of a direction ("iso", "front", "back", "left", "right", "top", "bottom") from which the
        scene fills the picture; None is "iso".
    size : (width, height) in pixels.
    algorithm, order : names; see `scanspan.ALGORITHMS`. All paint the same picture.
    samples : samples a pixel for the colour: 1, 2, 4, 8 or 16.
    cull : "none", "back" or "front".
    background : None for a soft gradient, a colour, a pair (top, bottom) of them, or "transparent".
    shading : "auto" takes the file's normals where it has them, "smooth" computes them, "flat" has one for each face.
    crease_angle : degrees; faces that meet at less share a normal.
    two_sided : whether the back of a surface is lit like its front.
    textures : whether base-colour textures are shown.
    translucency : whether what lies behind is seen through surfaces whose alpha is below 1; the fields of the Frame other than
        the colour tell of the nearest surface either way.
    lights : "studio" shows any shape well; "scene" lets the scene's own lights shine, and "viewer" those and one at the eye, as
        viewers of Inventor do, and a little from all round; "auto" is "viewer" where the scene has lights, else "studio".
    edges, line_width, edge_color : whether the edges of faces are drawn over them, how wide in pixels, and in which colour.
    point_size : of point clouds, in pixels; "density" closes surfaces, however far apart their points lie, "spacing" has one
        size in the world for all; the cloud's own by default, else "density". For scenes of clouds alone, as the next three.
    point_shape : "disc" (default), "square" or "gaussian", which blends splats that lie close behind each other.
    color_by : "rgb", "elevation", "intensity", "class" or "return"; "auto" (default) takes colours where there are any.
    eye_dome : whether, or how strongly, points are darkened by what stands before them; True by default.
    up : "+Y", "-Z", ...: the direction of the sky, and of a named view; the scene's own by default.
    blend : "linear", or "srgb" to average samples as tools without linear light do.
    subpixel_bits : vertices are snapped to 1/2^s pixel; 4 to 16.
    threads : by default one for each processor. The picture is the same for any number.
    max_pixels : a larger size is refused, unless the picture goes to a file as it is made.
    out : a .ppm or .npy file that finished rows are written to, band by band, so that a picture may be larger than memory.

    Returns
    -------
    Frame : `frame.color` is the picture, `frame.save("out.png")` writes it; depth, numbers and more are fields of it. With
        `out`, the path of the file instead.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> import scanspan as ss
    >>> mesh = ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> ss.render(mesh, "front", size=(64, 48), background="white").color[0, 0].tolist()
    [255, 255, 255, 255]
    """
    # Check everything before anything is done.
    check_algorithm(algorithm, order, "sample")
    check_shading(shading)
    bits = check_subpixel_bits(subpixel_bits)
    offsets, centre_offset = sample_offsets(samples, bits), sample_offsets(1, bits)[0]
    sink = None if out is None else check_sink(out)
    pixels = check_pixels(size, max_pixels) if sink is None else check_size(size)
    options = RasterOptions(pixels, algorithm, order, "top-left", cull, bits, 32, check_threads(threads))
    make_sampling(options.size, centre_offset, rule=options.rule, cull=cull, subpixel_bits=bits)
    behind = make_background(background, options.size, blend)
    angle, width = check_number("crease_angle", crease_angle, 0, 180), check_number("line_width", line_width, 0, 1000)
    sides, pictures, lines = check_flag("two_sided", two_sided), check_flag("textures", textures), check_flag("edges", edges)
    clear = check_flag("translucency", translucency)
    check_lighting(lights)
    points = check_points(point_size, point_shape, color_by, eye_dome)

    # Assets: what is there, from where it is seen, and how it is to look.
    scene = as_scene(scene)
    lighting = choose_lighting(lights, scene)
    look = Look(shading, angle, sides, pictures, lines, width, linear_color(edge_color), clear, lighting)
    sky = parse_up(scene.up if up is None else up)
    camera = as_camera(camera, scene, up, options.size)
    if scene.instances and all(isinstance(one.geometry, PointCloud) for one in scene.instances):
        from scanspan.clouds import check_cloud_look, render_clouds

        check_pixels(size, max_pixels)  # rows that go to a file are made all at once
        frame = render_clouds(
            scene, camera, options.size, points or check_cloud_look(), offsets=offsets / (1 << bits), background=behind,
            blend=blend, up=sky, threads=options.threads,
        )  # fmt: skip
        return frame if sink is None else write_whole(frame.color, sink)
    if points is not None:
        raise InputError("point_size, point_shape, color_by and eye_dome are for scenes of point clouds alone")

    # Geometry: triangles on the screen.
    draw = assemble(scene, camera, options.size)
    screen, polygons = to_triangles_and_polygons(draw, options, camera.has_far)

    # Raster, shade and target, band by band where rows go to a file: find what each sample sees, add up its light, average.
    surfaces = gather_surfaces(scene, draw, camera, options.size, sky, look)
    opaque, translucent = split(screen, polygons, draw, are_translucent(scene, look))
    picture = Picture(scene, draw, screen, opaque, translucent, surfaces, offsets, options, behind, blend)
    if sink is not None:
        write_picture(picture, sink)
        return sink
    color = shade_picture(picture)

    # Every other field of the frame comes from one sample at the centre.
    centre = find_visible(screen, centre_offset, options, polygons)
    counters = count_triangles(draw.triangles, screen)
    return Frame(
        color, centre, draw, screen, scene=scene, camera=camera, options=options, look=look, counters=counters,
        polygons=polygons,
    )  # fmt: skip


def check_points(*choices: Any) -> CloudLook | None:
    """Return how points are to be shown, checked, or None if nothing is said of it; other scenes need no such import."""
    if all(choice is None for choice in choices):
        return None
    from scanspan.clouds import check_cloud_look

    return check_cloud_look(*choices)


def as_scene(scene: Any) -> Scene:
    """Return what was given to `render` as a Scene."""
    if not isinstance(scene, (Scene, Instance, *GEOMETRIES)):
        expected = "expected a Scene, Mesh, Polygons, Segments, Points, PointCloud or Instance; use load() to read a file"
        raise InputError(f"scene = {quote(scene)}: {expected}")
    return scene if isinstance(scene, Scene) else Scene(scene)


def as_camera(camera: Any, scene: Scene, up: str | None, size: tuple[int, int]) -> Camera:
    """Return what was given to `render` as a Camera; a direction, or nothing, fits the scene into the picture."""
    if isinstance(camera, Camera):
        return camera
    if camera is not None and not isinstance(camera, str):
        raise InputError(f"camera = {quote(camera)}: expected a Camera or the name of a direction")
    return Camera.frame(scene, "iso" if camera is None else camera, up=up, aspect=size[0] / size[1], fit="points")


def rasterize(
    clip: ArrayLike,
    triangles: ArrayLike,
    size: tuple[int, int],
    *,
    algorithm: str = "half-space",
    order: str = "rows",
    samples: int = 1,
    cull: str = "none",
    rule: str | OffscreenPoint = "top-left",
    coverage: str = "sample",
    subpixel_bits: int = 8,
    depth_bits: int = 32,
    nonfinite: str = "error",
    threads: int | None = None,
    max_pixels: int = MAX_PIXELS,
) -> Visibility:
    """Find the triangle that is seen at every sample.

    Parameters
    ----------
    clip : (V, 4) clip coordinates, OpenGL's: y up, seen where -w <= z and w > 0. Nothing is cut at z = w.
    triangles : (T, 3) whole numbers, rows of `clip`.
    size : (width, height) of the image in pixels.
    algorithm, order, coverage : names; see `scanspan.ALGORITHMS`.
    samples : samples a pixel: 1, 2, 4, 8 or 16, at the standard positions.
    cull : "none", "back" or "front"; counter-clockwise as seen is the front.
    rule : who owns a sample on an edge: "top-left", "bottom-left" ("shadow"), "inclusive", "exclusive" or an OffscreenPoint.
    subpixel_bits : vertices are snapped to 1/2^s pixel, half to even; 4 to 16.
    depth_bits : 32, or 64 to keep the depth unrounded.
    nonfinite : "error", or "drop" to leave out triangles that use a vertex that is not finite.
    threads : by default one for each processor. The result is the same for any number.
    max_pixels : a larger size is refused.

    Returns
    -------
    Visibility : with `primitive` (H, W) int32, `depth` (H, W) float32 and, when asked for, `barycentric` (H, W, 3). With S > 1
        samples they are (H, W, S) and (H, W, S, 3).

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> clip = [(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)]
    >>> rasterize(clip, [(0, 1, 2)], size=(4, 4)).primitive
    array([[-1, -1, -1, -1],
           [ 0, -1, -1, -1],
           [ 0,  0, -1, -1],
           [ 0,  0,  0, -1]], dtype=int32)
    """
    check_algorithm(algorithm, order, coverage)
    bits = check_subpixel_bits(subpixel_bits)
    sample_offsets(samples, bits)
    if not isinstance(depth_bits, (int, np.integer)) or depth_bits not in (32, 64):
        raise InputError(f"depth_bits = {depth_bits!r}: must be 32 or 64")
    pixels = check_pixels(size, max_pixels)
    if coverage != "sample" and samples != 1:
        raise InputError(f"samples = {samples}: coverage={coverage!r} concerns whole pixels, which have one sample")
    options = RasterOptions(pixels, algorithm, order, rule, cull, bits, int(depth_bits), check_threads(threads), coverage)
    make_sampling(options.size, (0, 0), rule=rule, cull=cull, subpixel_bits=bits)
    vertices, corners = check_clip(clip, triangles, nonfinite)
    screen = way_to_screen(options)(vertices, corners, options.size, bits)
    return rasterize_triangles(screen, corners, int(samples), options)


def way_to_screen(options: RasterOptions) -> Callable[..., ScreenTriangles]:
    """Return what brings triangles to the screen: clipping, unless the algorithm does without, or whole pixels decide."""
    if options.algorithm != "homogeneous" and options.coverage == "sample":
        return partial(to_screen, threads=options.threads)
    from scanspan.raster.homogeneous_edges import without_clipping

    return without_clipping


def to_triangles_and_polygons(
    draw: DrawList, options: RasterOptions, far: bool
) -> tuple[ScreenTriangles, ScreenPolygons | None]:
    """Return the triangles of a DrawList on the screen, and its polygons if it has any."""
    way, bits = way_to_screen(options), options.subpixel_bits
    if draw.outlines is not None:
        return to_screen_with_polygons(draw, options.size, bits, far, way)
    return way(draw.clip, draw.triangles, options.size, bits, far), None


def interpolate(visibility: Visibility, per_vertex: ArrayLike, *, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Interpolate per-vertex values over what is seen, correct in perspective.

    Parameters
    ----------
    visibility : from `rasterize`.
    per_vertex : (V, k) or (V,) values, one row for each row of the clip coordinates.
    dtype : of the result: float32 or float64, or uint8 for values that are uint8, as colours often are, rounded half up. By
        default floats keep their type, and integers become float64.

    Returns
    -------
    (H, W, k) or (H, W), for S samples (H, W, S, k) or (H, W, S); 0 where nothing is seen.

    Raises
    ------
    InputError : for values that are not numbers, or too few of them, and for another dtype.

    Examples
    --------
    >>> clip = [(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)]
    >>> seen = rasterize(clip, [(0, 1, 2)], size=(2, 2))
    >>> interpolate(seen, [0.0, 4.0, 0.0])
    array([[0.5, 1.5],
           [0.5, 1.5]])
    >>> interpolate(seen, np.array([0, 4, 0], np.uint8), dtype=np.uint8)
    array([[1, 2],
           [1, 2]], dtype=uint8)
    """
    if not isinstance(visibility, Visibility):
        raise InputError(f"visibility: expected what rasterize returned, got {type(visibility).__name__}")
    values, dtype = check_values(per_vertex, visibility.triangles, dtype)
    columns = values.shape[1] if values.ndim == 2 else 1
    found = interpolate_visible(visibility, values.reshape(len(values), columns)).astype(dtype, copy=False)
    return found if values.ndim > 1 else found[..., 0]


def count(
    vertices: ArrayLike,
    size: tuple[int, int],
    *,
    algorithm: str = "half-space",
    order: str = "rows",
    cull: str = "none",
    rule: str | OffscreenPoint = "top-left",
    coverage: str = "sample",
    subpixel_bits: int = 8,
    nonfinite: str = "error",
    threads: int | None = None,
    max_pixels: int = MAX_PIXELS,
) -> NDArray[np.int32]:
    """Count how many triangles cover the centre of each pixel; nothing hides anything.

    Parameters
    ----------
    vertices : (N, 3, 2) corners (x, y) in pixels, y down, within 2^24 pixels.
    size : (width, height) of the image in pixels.
    others : as for `rasterize`.

    Returns
    -------
    (H, W) int32.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> count([[(0, 0), (3, 0), (0, 3)], [(3, 0), (3, 3), (0, 3)]], size=(3, 3))
    array([[1, 1, 1],
           [1, 1, 1],
           [1, 1, 1]], dtype=int32)
    """
    check_algorithm(algorithm, order, coverage)
    width, height = check_pixels(size, max_pixels)
    bits = check_subpixel_bits(subpixel_bits)
    sampling = make_sampling(
        (width, height), sample_offsets(1, bits)[0], rule=rule, cull=cull, subpixel_bits=bits, coverage=coverage
    )
    screen = screen_triangles(check_screen_triangles(vertices, nonfinite), bits)
    hits = np.zeros((height, width), np.int32)
    run(algorithm, order, "hits", hits, screen, sampling, check_threads(threads))
    return hits


def count_each(
    vertices: ArrayLike, size: tuple[int, int], *, algorithm: str = "half-space", order: str = "rows", cull: str = "none",
    rule: str | OffscreenPoint = "top-left", coverage: str = "sample", subpixel_bits: int = 8,
) -> NDArray[np.int32]:  # fmt: skip
    """Count as `count` does, but every triangle alone in an image of its own: (N, H, W) int32, for checking many at once."""
    check_algorithm(algorithm, order, coverage)
    width, height = check_size(size)
    bits = check_subpixel_bits(subpixel_bits)
    sampling = make_sampling(
        (width, height), sample_offsets(1, bits)[0], rule=rule, cull=cull, subpixel_bits=bits, coverage=coverage
    )
    screen = screen_triangles(check_screen_triangles(vertices, "error"), bits)
    hits = np.zeros((len(screen.corners), height, width), np.int32)
    run_each(algorithm, order, "hits", hits, screen, sampling)
    return hits
