"""The table of contents: assets -> geometry -> raster -> shade -> target.

`rasterize`, `interpolate` and `count` are the stages by themselves, for arrays; `render` runs all of them for a scene.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.lens import check_size
from scanspan.assets.buffers import check_clip, check_screen_triangles, check_triangles, check_values
from scanspan.errors import InputError
from scanspan.geometry.clip import to_screen
from scanspan.geometry.project import screen_triangles
from scanspan.raster.algorithms import check_algorithm, run, run_each
from scanspan.raster.options import OffscreenPoint, check_subpixel_bits, check_threads, make_sampling
from scanspan.samples import sample_offsets
from scanspan.target.visibility import RasterOptions, Visibility, interpolate_visible, rasterize_triangles


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
    if depth_bits not in (32, 64) or isinstance(depth_bits, bool):
        raise InputError(f"depth_bits = {depth_bits!r}: must be 32 or 64")
    options = RasterOptions(check_size(size), algorithm, rule, cull, bits, int(depth_bits), check_threads(threads))
    make_sampling(options.size, (0, 0), rule=rule, cull=cull, subpixel_bits=bits)
    vertices, corners = check_clip(clip, check_triangles(triangles), nonfinite)
    return rasterize_triangles(to_screen(vertices, corners, options.size, bits), corners, int(samples), options)


def interpolate(visibility: Visibility, per_vertex: ArrayLike) -> NDArray[Any]:
    """Interpolate per-vertex values over what is seen, correct in perspective.

    Parameters
    ----------
    visibility : from `rasterize`.
    per_vertex : (V, k) or (V,) values, one row for each row of the clip coordinates.

    Returns
    -------
    (H, W, k) or (H, W), after (H, W, S) for S samples; floats keep their type, integers become float64; 0 where nothing is seen.

    Raises
    ------
    InputError : for values that are not numbers, or too few of them.

    Examples
    --------
    >>> clip = [(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1)]
    >>> seen = rasterize(clip, [(0, 1, 2)], size=(2, 2))
    >>> interpolate(seen, [0.0, 4.0, 0.0])
    array([[0.5, 1.5],
           [0.5, 1.5]])
    """
    if not isinstance(visibility, Visibility):
        raise InputError(f"visibility: expected what rasterize returned, got {type(visibility).__name__}")
    values, dtype = check_values(per_vertex, visibility.triangles)
    found = interpolate_visible(visibility, values.reshape(len(values), -1)).astype(dtype, copy=False)
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
    width, height = check_size(size)
    bits = check_subpixel_bits(subpixel_bits)
    sampling = make_sampling((width, height), sample_offsets(1, bits)[0], rule=rule, cull=cull, subpixel_bits=bits)
    screen = screen_triangles(check_screen_triangles(vertices, nonfinite), bits)
    hits = np.zeros((height, width), np.int32)
    run(algorithm, "hits", hits, screen, sampling, check_threads(threads))
    return hits


def count_each(
    vertices: ArrayLike, size: tuple[int, int], *, algorithm: str = "half-space", cull: str = "none",
    rule: str | OffscreenPoint = "top-left", subpixel_bits: int = 8,
) -> NDArray[np.int32]:  # fmt: skip
    """Count as `count` does, but every triangle alone in an image of its own: (N, H, W) int32, for checking many at once."""
    check_algorithm(algorithm, "rows", "sample")
    width, height = check_size(size)
    bits = check_subpixel_bits(subpixel_bits)
    sampling = make_sampling((width, height), sample_offsets(1, bits)[0], rule=rule, cull=cull, subpixel_bits=bits)
    screen = screen_triangles(check_screen_triangles(vertices, "error"), bits)
    hits = np.zeros((len(screen.corners), height, width), np.int32)
    run_each(algorithm, "hits", hits, screen, sampling)
    return hits
