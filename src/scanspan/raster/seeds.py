"""Seeds: a polygon filled as the lectures do, from its outline inwards, by a flood fill from a pixel of every region.

The outline parts the pixels beside it into regions, and within a region every sample is inside or none is: a polygon's edge
that passes between the samples of two neighbours has one of them on its outline. So one sample of each region decides, by the
parity test, or the winding number where the fill rule asks for that.

Price: O(pixels of the box), and O(edges) for every row in which a region is met first.

Source: the lectures' flood fill, whose seed is given; the parity test finds it.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.fill_rule import is_filled
from scanspan.jit import kernel
from scanspan.raster.flood import flood_kernel
from scanspan.raster.parity import cross_row
from scanspan.records import Array, Int32Array, Int64Array, UInt8Array

OUTLINE = np.array([1], np.uint8)


@kernel
def fill_regions(
    outline: UInt8Array, inside: Array, outside: Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int,
    border: UInt8Array, sample_x: int, sample_y: int, s: int,
) -> None:  # fmt: skip
    """Mark every pixel that is not on the outline as inside or outside, region by region.

    Shapes  outline: (H, W, 1) uint8, 1 on the outline; inside, outside: (H, W) bool, False at first; xy: (V, 2);
            ring_starts: (R + 1,); border: OUTLINE.
    Units   xy in sub-pixels from the corner of pixel (0, 0); the sample likewise.
    Needs   coordinates within 2^24 px.
    """
    count, counters = xy.shape[0], np.zeros(3, np.int64)
    f, a, turn = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    for j in range(outline.shape[0]):
        edges = -1
        for i in range(outline.shape[1]):
            if outline[j, i, 0] == 1 or inside[j, i] or outside[j, i]:
                continue
            if edges < 0:
                edges = cross_row(xy, ring_starts, np.int64(sample_x), (np.int64(j) << s) + sample_y, s, f, a, turn)

            # Ask the fill rule about this seed, and fill its region.
            crossings = winding = np.int64(0)
            for k in range(edges):
                if f[k] + i * a[k] >= 0:
                    crossings += 1
                    winding += turn[k]
            filled = inside if is_filled(fill_rule, crossings, winding) else outside
            flood_kernel(outline, filled, i, j, border, 0, True, False, counters)
