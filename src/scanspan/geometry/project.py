"""Project and snap: from clip coordinates, or from positions on the screen, to the sub-pixel grid.

The products that lead to clip coordinates are in homogeneous.py, in a fixed order, so that the bits are the same everywhere.
"""

from __future__ import annotations

from threading import Event
from typing import NamedTuple

import numpy as np

from scanspan.bands import run_bands
from scanspan.geometry.fixed_point import MAX_COORDINATE, halves_sign, product_halves
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, BoolArray, Float64Array, Int64Array, Integer, ScreenTriangles, UInt8Array

MANY = 1 << 16  # vertices, from which on threads share them


@helper_kernel
def snap(position: float, scale: float) -> Integer:
    """Return a pixel coordinate in sub-pixels, half to even, cut back to the range that setup can take.

    Rounding away what clipping against the outer planes left over is all that the cut does.
    """
    limit = np.float64(MAX_COORDINATE)
    return np.int64(np.rint(min(max(position, -limit), limit) * scale))


@helper_kernel
def plane_distance(planes: Float64Array, k: int, x: float, y: float, z: float, w: float) -> float:
    """Return the signed distance of a point to plane k, positive where it is kept."""
    return (((planes[k, 0] * x + planes[k, 1] * y) + planes[k, 2] * z) + planes[k, 3] * w) - planes[k, 4]


@kernel
def project_kernel(
    clip: Float64Array, planes: Float64Array, half_width: float, half_height: float, scale: float, outcodes: UInt8Array,
    xy: Int64Array, depth: Float64Array,
) -> Integer:  # fmt: skip
    """Find which planes each vertex lies outside of, project it, and snap it; return the bits of all that occur.

    Shapes  clip: (V, 4); planes: (P, 5), see clip.py; outcodes: (V,) uint8, one bit a plane; xy: (V, 2) int64; depth: (V,).
    Units   half_width, half_height in pixels; scale = 2^s sub-pixels in a pixel.
    Rule    the image point is ((x / w + 1) width / 2, (1 - y / w) height / 2): clip space has y up, the image has it down.
            Vertices with w <= 0 have none and get (0, 0).
    Cost    one pass; two would read all vertices twice.
    """
    all_codes = np.int64(0)
    for i in range(clip.shape[0]):
        x, y, z, w = clip[i, 0], clip[i, 1], clip[i, 2], clip[i, 3]
        code = np.int64(0)
        for k in range(planes.shape[0]):
            code |= np.int64(plane_distance(planes, k, x, y, z, w) < 0.0) << k
        outcodes[i] = np.uint8(code)
        all_codes |= code
        in_front = w > 0.0
        divisor = w if in_front else 1.0
        xy[i, 0] = snap((x / divisor + 1.0) * half_width, scale) if in_front else 0
        xy[i, 1] = snap((1.0 - y / divisor) * half_height, scale) if in_front else 0
        depth[i] = (divisor - z) / (divisor + divisor)
    return all_codes


class Projected(NamedTuple):
    """Vertices on the screen."""

    xy: Int64Array  # (V, 2) sub-pixels
    depth: Float64Array  # (V,)
    outcodes: UInt8Array  # (V,) a bit for each plane
    all_codes: int  # the bits that occur


def project(clip: Float64Array, planes: Float64Array, size: tuple[int, int], subpixel_bits: int, threads: int = 1) -> Projected:
    """Project and snap (V, 4) clip coordinates, and find which planes they lie outside of; many are shared by threads."""
    count, middle, scale = len(clip), (size[0] / 2, size[1] / 2), float(1 << subpixel_bits)
    xy, depth, outcodes = np.empty((count, 2), np.int64), np.empty(count), np.empty(count, np.uint8)

    def project_some(first: int, last: int, stop: Event) -> int:
        """Project some of the vertices."""
        some = slice(first, last)
        return int(project_kernel(clip[some], planes, *middle, scale, outcodes[some], xy[some], depth[some]))

    found = np.bitwise_or.reduce(run_bands(project_some, count, threads if count >= MANY else 1, each=1))
    return Projected(xy, depth, outcodes, int(found))


def room_for_outlines(count: int) -> dict[str, Array]:
    """Return the fields of ScreenTriangles that hold outlines, of nothing yet."""
    return {
        "lines": np.zeros((count, 3, 4), np.int64),
        "limits": np.zeros((count, 8), np.int64),
        "planes": np.zeros((count, 7)),
    }


def no_outlines(count: int) -> dict[str, Array]:
    """Return the fields of ScreenTriangles that say that none of its triangles has an outline of its own."""
    return {
        "outline": np.full(count, -1, np.int32),
        **room_for_outlines(0),
        "integers": np.empty((0, 19), np.int64),
        "floats": np.empty((0, 7)),
    }


def screen_triangles(vertices: Float64Array, subpixel_bits: int) -> ScreenTriangles:
    """Return triangles given on the screen, each with corners of its own, all at depth 0; they have no clip coordinates.

    Parameters
    ----------
    vertices : (N, 3, 2) corners in pixels, within 2^24 pixels.
    subpixel_bits : s, 4 to 16.
    """
    n = len(vertices)
    xy = np.rint(vertices.reshape(-1, 2) * float(1 << subpixel_bits)).astype(np.int64)
    return ScreenTriangles(
        xy=xy,
        depth=np.zeros(3 * n),
        clip=np.empty((0, 4)),
        corners=np.arange(3 * n, dtype=np.int32).reshape(n, 3),
        source=np.arange(n, dtype=np.int32),
        piece=np.full(n, -1, np.int32),
        weights=np.empty((0, 3, 3)),
        inner=np.zeros(n, np.uint8),
        **no_outlines(n),
    )


def cull_triangles(vertices: Float64Array, cull: int) -> BoolArray:
    """Return which triangles given on the screen are drawn, (N,), by the exact sign of the area on a grid of 1/65536 pixel.

    Parameters
    ----------
    vertices : (N, 3, 2) corners in pixels, within 2^24 pixels.
    cull : 0 nothing, 1 clockwise as seen, -1 counter-clockwise as seen, as in Sampling.
    """
    if cull == 0:
        return np.ones(len(vertices), bool)
    kept = np.empty(len(vertices), bool)
    cull_kernel(np.rint(vertices * 65536.0).astype(np.int64), cull, kept)
    return kept


@kernel
def cull_kernel(corners: Int64Array, cull: int, kept: BoolArray) -> None:
    """Write which triangles are drawn.

    Shapes  corners: (N, 3, 2) sub-pixels; kept: (N,).
    """
    for n in range(corners.shape[0]):
        p_x, p_y, q_x, q_y = corners[n, 0, 0], corners[n, 0, 1], corners[n, 1, 0], corners[n, 1, 1]
        high, low = product_halves(q_x - p_x, p_y - q_y, corners[n, 2, 1] - p_y, corners[n, 2, 0] - p_x)
        kept[n] = halves_sign(high, low) != cull
