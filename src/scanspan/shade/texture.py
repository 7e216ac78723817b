"""Textures: the colour of a picture at texture coordinates, nearest or bilinear, in linear light.

Texels are decoded before they are blended, and weighted by their alpha, so that neither the curve of sRGB nor the colour of
what is transparent darkens an edge. Coordinates are brought into the picture before they become integers: huge ones, and
infinite ones, never index out of range, and NaN counts as 0. There are no mip levels; samples in a pixel do their work.

Conventions: v is up and row 0 of the picture is its top, so (0, 0) is the bottom-left corner. Texel centres lie at half
integers. Ranges are half-open: texel k of a row of w covers k/w <= u < (k + 1)/w.

Source: OpenGL 4.6 core profile, section 8.14 (wrap modes and texel selection).
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import kernel
from scanspan.records import Array, Float32Array, UInt8Array

# The names are those of assets/material.py, in its order.
BILINEAR, NEAREST = 0, 1
REPEAT, CLAMP, MIRROR = 0, 1, 2


@kernel
def wrap_coordinate(u: float, wrap: int) -> float:
    """Return a texture coordinate brought into 0..1.

    Units   the picture is 1 wide.
    Rule    wrap 0 repeats, 1 clamps, 2 mirrors; NaN becomes 0, infinities 0 or, clamped, the border.
    """
    if wrap == CLAMP:
        inside = u
    elif wrap == REPEAT:
        inside = u - np.floor(u)
    else:
        inside = u - 2.0 * np.floor(u * 0.5)
        inside = 2.0 - inside if inside > 1.0 else inside
    inside = inside if inside > 0.0 else 0.0
    return inside if inside < 1.0 else 1.0


@kernel
def neighbour(index: int, count: int, wrap: int) -> int:
    """Return the texel that stands in for one that lies one beyond either border.

    Needs   index in -1..count.
    """
    if index < 0:
        return count - 1 if wrap == REPEAT else 0
    if index >= count:
        return 0 if wrap == REPEAT else count - 1
    return index


@kernel
def sample_texture(
    texture: UInt8Array, uv: Array, filter_kind: int, wrap_u: int, wrap_v: int, decode: Float32Array, out: Float32Array
) -> None:
    """Look up the colour of a texture at many texture coordinates.

    Shapes  texture: (h, w, 4) uint8 sRGB, straight alpha. uv: (n, 2) float32 or float64. decode: (256,) float32. out: (n, 4)
            float32, written.
    Units   uv: the picture is 1 by 1, v up. out: linear light with straight alpha.
    Rule    filter_kind 0 is bilinear, 1 nearest; wrap 0 repeats, 1 clamps, 2 mirrors.
    Needs   h and w at least 1; decode is LINEAR_FROM_SRGB8 of color.py.
    Cost    O(n), one or four texels each.
    """
    height, width = texture.shape[0], texture.shape[1]
    for i in range(len(uv)):
        x = wrap_coordinate(np.float64(uv[i, 0]), wrap_u) * width
        y = wrap_coordinate(np.float64(uv[i, 1]), wrap_v) * height
        if filter_kind == NEAREST:
            column = min(int(x), width - 1)
            row = height - 1 - min(int(y), height - 1)
            out[i, 0] = decode[texture[row, column, 0]]
            out[i, 1] = decode[texture[row, column, 1]]
            out[i, 2] = decode[texture[row, column, 2]]
            out[i, 3] = np.float32(texture[row, column, 3]) / np.float32(255.0)
            continue

        # Find the four texels whose centres surround the place, and how far it is from the first.
        left, low = np.floor(x - 0.5), np.floor(y - 0.5)
        s, t = np.float32(x - 0.5 - left), np.float32(y - 0.5 - low)
        column, row = int(left), int(low)
        x0, x1 = neighbour(column, width, wrap_u), neighbour(column + 1, width, wrap_u)
        y0, y1 = height - 1 - neighbour(row, height, wrap_v), height - 1 - neighbour(row + 1, height, wrap_v)

        # Blend along the rows and then between them, colours weighted by their alpha; what is constant stays so.
        a00, a10 = np.float32(texture[y0, x0, 3]) / np.float32(255.0), np.float32(texture[y0, x1, 3]) / np.float32(255.0)
        a01, a11 = np.float32(texture[y1, x0, 3]) / np.float32(255.0), np.float32(texture[y1, x1, 3]) / np.float32(255.0)
        below, above = a00 + s * (a10 - a00), a01 + s * (a11 - a01)
        alpha = below + t * (above - below)
        for k in range(3):
            c00, c10 = decode[texture[y0, x0, k]] * a00, decode[texture[y0, x1, k]] * a10
            c01, c11 = decode[texture[y1, x0, k]] * a01, decode[texture[y1, x1, k]] * a11
            below, above = c00 + s * (c10 - c00), c01 + s * (c11 - c01)
            value = below + t * (above - below)
            out[i, k] = value / alpha if alpha > np.float32(0.0) else np.float32(0.0)
        out[i, 3] = alpha
