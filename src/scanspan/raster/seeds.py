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
from scanspan.raster.flood import CHANGES, FILLED, enlarge, flood, make_room, read_row
from scanspan.raster.parity import cross_row
from scanspan.records import Int32Array, Int64Array

OUTLINE = 1


@kernel
def fill_regions(
    drawn: Int32Array, xy: Int64Array, ring_starts: Int32Array, fill_rule: int, sample_x: int, sample_y: int, s: int
) -> None:
    """Set the pixels of all regions that are inside to OUTLINE, region by region.

    Shapes  drawn: (H, W) int32, OUTLINE on the outline, else 0; xy: (V, 2); ring_starts: (R + 1,).
    Units   xy in sub-pixels from the corner of pixel (0, 0); the sample likewise.
    Needs   coordinates within 2^24 px.
    """
    count, height = xy.shape[0], drawn.shape[0]
    f, a, turn = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    room = make_room(height, drawn.shape[1])
    for j in range(height):
        if room.rows[j, 0] < 0:
            room = enlarge(room)
            read_row(drawn, room, np.int64(j), OUTLINE, 0, True)
        edges = -1
        for k in range(room.rows[j, 0], room.rows[j, 1]):
            if room.done[k] == 1:
                continue
            if edges < 0:
                edges = cross_row(xy, ring_starts, np.int64(sample_x), (np.int64(j) << s) + sample_y, s, f, a, turn)

            # Ask the fill rule about this seed, and find its region; forget it where it is outside.
            i = np.int64(room.changes[2 * k])
            crossings = winding = np.int64(0)
            for e in range(edges):
                if f[e] + i * a[e] >= 0:
                    crossings += 1
                    winding += turn[e]
            before = room.counts[FILLED]
            room = flood(drawn, room, i, j, OUTLINE, 0, True, False)
            if not is_filled(fill_rule, crossings, winding):
                room.counts[FILLED] = before

    # Draw what is inside; until here the outline had to stay as it was.
    for n in range(room.counts[FILLED]):
        for x in range(room.filled[n, 0], room.filled[n, 2] + 1):
            drawn[room.filled[n, 1], x] = OUTLINE


@kernel
def drawn_runs(drawn: Int32Array) -> Int64Array:
    """Return the runs of pixels that are OUTLINE, (N, 4) as segments x0, y, x1, y, both ends included."""
    height, width = drawn.shape
    room = make_room(height, width)
    for j in range(height):
        room = enlarge(room)
        read_row(drawn, room, np.int64(j), OUTLINE, 0, False)
    runs = np.empty((room.counts[CHANGES] >> 1, 4), np.int64)
    for j in range(height):
        for k in range(room.rows[j, 0], room.rows[j, 1]):
            runs[k, 0], runs[k, 1], runs[k, 2], runs[k, 3] = room.changes[2 * k], j, room.changes[2 * k + 1] - 1, j
    return runs
