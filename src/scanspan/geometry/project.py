"""Project and snap: from clip coordinates, or from positions on the screen, to the sub-pixel grid.

The products that lead to clip coordinates are in homogeneous.py, in a fixed order, so that the bits are the same everywhere.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Float64Array, ScreenTriangles


@helper_kernel
def snap(position, scale):
    """Return a pixel coordinate in sub-pixels, half to even, cut back to the range that setup can take.

    Rounding away what clipping against the outer planes left over is all that the cut does.
    """
    limit = np.float64(MAX_COORDINATE)
    return np.int64(np.rint(min(max(position, -limit), limit) * scale))


@kernel
def project_kernel(clip, half_width, half_height, scale, xy, depth, inverse_w):
    """Project clip coordinates to the image and snap them.

    Shapes  clip: (V, 4); xy: (V, 2) int64; depth, inverse_w: (V,).
    Units   half_width, half_height in pixels; scale = 2^s sub-pixels in a pixel.
    Needs   w > 0 where the result is used; rows with w <= 0 are skipped.
    """
    for i in range(clip.shape[0]):
        w = clip[i, 3]
        if w > 0.0:
            xy[i, 0] = snap((clip[i, 0] / w + 1.0) * half_width, scale)
            xy[i, 1] = snap((1.0 - clip[i, 1] / w) * half_height, scale)
            depth[i] = (w - clip[i, 2]) / (w + w)
            inverse_w[i] = 1.0 / w


def project(clip: Float64Array, size: tuple[int, int], subpixel_bits: int) -> tuple[Array, Float64Array, Float64Array]:
    """Return (V, 2) int64 sub-pixel positions, (V,) depths and (V,) reciprocals of w of clip coordinates.

    The image point is ((x / w + 1) width / 2, (1 - y / w) height / 2): clip space has y up, the image has it down.
    """
    count = len(clip)
    xy, depth, inverse_w = np.zeros((count, 2), np.int64), np.zeros(count), np.zeros(count)
    project_kernel(clip, size[0] / 2, size[1] / 2, float(1 << subpixel_bits), xy, depth, inverse_w)
    return xy, depth, inverse_w


def screen_triangles(vertices: Float64Array, subpixel_bits: int) -> ScreenTriangles:
    """Return triangles given on the screen, each with corners of its own, all at depth 0.

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
        inverse_w=np.ones(3 * n),
        corners=np.arange(3 * n, dtype=np.int32).reshape(n, 3),
        source=np.arange(n, dtype=np.int32),
        piece=np.full(n, -1, np.int32),
        weights=np.empty((0, 3, 3)),
        inner=np.zeros(n, np.uint8),
    )
