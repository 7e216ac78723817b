"""Eye-dome lighting: a pixel is darkened by what stands before it close by, so that points without normals show their shape.

A neighbour that is nearer to the eye takes away light, by how steep the way up to it is: the difference of depth over the
width that the step between the two has in space. So the picture does not change with the field of view or the resolution, as
it does with the usual differences of logarithms. The steepness t counts as t / (t + 4), and the light is 1 / (1 + a multiple of
the mean): fractions, where others have an exponential, so that the bits are the same on every machine.

Neighbours are looked at in eight directions and at three distances, which show edges and hollows. The nearest lies somewhat
beyond the radius of the splats, as all of one has one depth: closer by, their rims would be seen and not the shape.

Source: C. Boucheny, Visualisation scientifique de grands volumes de donnees (2009), for the idea.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import kernel
from scanspan.records import Float32Array

DISTANCES = 3  # each twice the one before
HALF = np.float32(4.0)  # the steepness that counts half
WEIGHT = 4.0  # of the mean at strength 1


@kernel
def eye_dome(
    distance: Float32Array, y_start: int, y_end: int, per_pixel: float, is_parallel: bool, reach: int, strength: float,
    factor: Float32Array,
) -> None:  # fmt: skip
    """Write by how much the light of each pixel of some rows is lessened: a factor above 0, at most 1.

    Shapes  distance: (H, W) along the line of sight, inf where nothing is; factor: (H, W), of which rows y_start to before
            y_end are written.
    Units   per_pixel: width of a pixel in space, at distance 1 unless lines of sight are parallel; reach: pixels to the nearest
            neighbour.
    """
    height, width = distance.shape
    zero, one, weight = np.float32(0.0), np.float32(1.0), np.float32(strength * WEIGHT / (8 * DISTANCES))
    total, scale = np.empty(width, np.float32), np.empty(width, np.float32)
    for y in range(y_start, y_end):
        for x in range(width):
            total[x] = zero
            scale[x] = np.float32(1.0 / (per_pixel * (1.0 if is_parallel else np.float64(distance[y, x]))))
        for k in range(DISTANCES * 9):
            step = reach << (k // 9)
            dy, dx = ((k % 9) // 3 - 1) * step, (k % 3 - 1) * step
            if (dx == 0 and dy == 0) or y + dy < 0 or y + dy >= height:
                continue

            # Add what the neighbours in one direction take away.
            shrink = np.float32(1.0 / step)
            for x in range(max(-dx, 0), min(width - dx, width)):
                slope = (distance[y, x] - distance[y + dy, x + dx]) * scale[x] * shrink
                slope = slope if slope > zero else zero
                slope = slope if slope < np.float32(1e6) else np.float32(1e6)
                total[x] += slope / (slope + HALF)
        for x in range(width):
            factor[y, x] = one / (one + weight * total[x]) if distance[y, x] < np.inf else one
