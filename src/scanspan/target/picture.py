"""The colour of a picture: what each sample sees is shaded, added up, averaged, and kept or written row by row.

A whole picture is made at once. One that goes to a file is made in bands of a fixed number of pixels, each from the triangles
that reach into it, so that memory does not grow with the picture's height.
"""

from __future__ import annotations

from pathlib import Path
from threading import Event
from typing import NamedTuple

import numpy as np

from scanspan.assets.scene import Scene
from scanspan.bands import run_bands
from scanspan.records import DrawList, Float32Array, Int64Array, ScreenTriangles, UInt8Array
from scanspan.shade.shading import ROWS, Surfaces, shade_rows
from scanspan.target.peel import Part, find_layers
from scanspan.target.resolve import resolve
from scanspan.target.sink import open_sink
from scanspan.target.visibility import Plane, RasterOptions, find_visible, find_visible_rows, numbers_of, y_range

BAND_PIXELS = 1 << 17  # that are made at once where rows go to a file


class Picture(NamedTuple):
    """All that the colour of a picture is made from."""

    scene: Scene
    draw: DrawList
    screen: ScreenTriangles
    opaque: Part  # of the triangles on the screen
    translucent: Part | None
    surfaces: Surfaces
    offsets: Int64Array  # (S, 2) samples in sub-pixels
    options: RasterOptions
    behind: Float32Array  # the background, see target/resolve.py
    blend: str


def shade_picture(picture: Picture) -> UInt8Array:
    """Return the whole picture, (H, W, 4)."""
    width, height = picture.options.size
    sums = np.zeros((height, width, 4), np.float32)
    for offset in picture.offsets:
        add_samples(picture, find_visible(picture.opaque.screen, offset, picture.options, picture.opaque.polygons), 0, sums)
    return resolve(sums, len(picture.offsets), picture.behind, picture.blend)


def write_picture(picture: Picture, path: Path) -> None:
    """Write the picture to a sink band by band; of each band, the samples are swept one after the other."""
    (width, height), behind, opaque = picture.options.size, picture.behind, picture.opaque
    reach = y_range(opaque.screen)
    rows_at_once = max(1, BAND_PIXELS // width)
    with open_sink(path, (width, height)) as write_rows:
        for y_start in range(0, height, rows_at_once):
            y_end = min(height, y_start + rows_at_once)
            sums = np.zeros((y_end - y_start, width, 4), np.float32)
            for offset in picture.offsets:
                plane = find_visible_rows(opaque.screen, reach, offset, picture.options, (y_start, y_end), opaque.polygons)
                add_samples(picture, plane, y_start, sums)
            rows = behind if len(behind) == 1 else behind[y_start:y_end]
            write_rows(resolve(sums, len(picture.offsets), rows, picture.blend))


def add_samples(picture: Picture, plane: Plane, first_row: int, sums: Float32Array) -> None:
    """Shade what is seen at one sample of every pixel and add it to the (h, W, 4) sums: layers of it where it is translucent.

    `plane` has rows of the opaque triangles.
    """
    if picture.opaque.rows is not None:
        plane = plane._replace(slot=numbers_of(plane.slot, picture.opaque.rows))
    if picture.translucent is None:
        add_layer(picture, plane, first_row, sums, None)
        return
    through = np.ones(plane.slot.shape, np.float32)
    for slot in find_layers(picture.translucent, plane, picture.options, first_row):
        add_layer(picture, plane._replace(slot=slot), first_row, sums, through)
    add_layer(picture, plane, first_row, sums, through)


def add_layer(picture: Picture, plane: Plane, first_row: int, sums: Float32Array, through: Float32Array | None) -> None:
    """Shade one layer and add it to the sums, a few rows at a time in threads; `through` (h, W) is what comes through to it."""
    options = picture.options

    def shade_band(y_start: int, y_end: int, stop: Event) -> None:
        """Shade the rows of one band."""
        for y in range(y_start, y_end, ROWS):
            slots = plane.slot[y : min(y + ROWS, y_end)]
            if not stop.is_set() and slots.max() >= 0:
                shade_rows(
                    picture.scene, picture.draw, picture.screen, picture.surfaces, slots, plane.offset,
                    options.subpixel_bits, first_row + y, sums[y : y + len(slots)], picture.blend,
                    None if through is None else through[y : y + len(slots)],
                )  # fmt: skip

    run_bands(shade_band, len(sums), options.threads)
