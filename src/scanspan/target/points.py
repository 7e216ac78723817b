"""Points in a picture: from keys to distances, and from colours to light."""

from __future__ import annotations

import numpy as np

from scanspan.jit import kernel
from scanspan.raster.write import EMPTY_KEY, unpack_depth
from scanspan.records import Float32Array, Int64Array, UInt8Array


@kernel
def find_distances(keys: Int64Array, n0: float, n1: float, d0: float, d1: float, distance: Float32Array) -> None:
    """Turn depths back into distances along the line of sight: -(n0 + n1 depth) / (d0 + d1 depth), inf where nothing is.

    Shapes  keys: (n or more,); distance: (n,), written.
    """
    for i in range(distance.shape[0]):
        depth = np.float64(unpack_depth(keys[i]))
        distance[i] = np.inf if keys[i] == EMPTY_KEY else np.float32(-(n0 + n1 * depth) / (d0 + d1 * depth))


@kernel
def add_blended(blended: Int64Array, factor: Float32Array, sums: Float32Array) -> None:
    """Add blended splats to the sums of their pixels.

    Shapes  blended: (n, 5), light of 16 bits and alpha times weights, and the weights; factor: (n,); sums: (n, 4).
    """
    for i in range(blended.shape[0]):
        if blended[i, 4] > 0:
            whole = np.float64(blended[i, 4]) * 65535.0
            for c in range(3):
                sums[i, c] += np.float32(np.float64(blended[i, c]) / whole * np.float64(factor[i]))
            sums[i, 3] += np.float32(np.float64(blended[i, 3]) / whole)


@kernel
def add_light(pixels: Int64Array, codes: UInt8Array, table: Float32Array, factor: Float32Array, sums: Float32Array) -> None:
    """Add the colours of points to the sums of their pixels, as light.

    Shapes  pixels: (k,), rows of sums; codes: (k, 4), sRGB with straight alpha; table: (256,), the light of each code;
            factor: (n,) of light at each pixel; sums: (n, 4), premultiplied.
    """
    for i in range(pixels.shape[0]):
        k = np.uint64(pixels[i])
        alpha = np.float32(codes[i, 3]) * np.float32(1.0 / 255.0)
        light = factor[k] * alpha
        sums[k, 0] += table[codes[i, 0]] * light
        sums[k, 1] += table[codes[i, 1]] * light
        sums[k, 2] += table[codes[i, 2]] * light
        sums[k, 3] += alpha
