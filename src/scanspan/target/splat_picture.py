"""A picture of blocks of splats: keys that blocks are drawn into, and the colours of what they show.

A number in a key is the row of the block in the cut, then the place in the block, so that ties between splats are broken alike
whatever is drawn first, and a tree may have more splats than a key has numbers.
"""

from __future__ import annotations

from threading import Event

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.splats.cache import ORDERS, STRIDES, BlockCache, pass_ends
from scanspan.bands import run_bands
from scanspan.color.transfer import STARTS
from scanspan.geometry.cut import NodeColumns, SplatView, largest_gap, stretch_of_nodes
from scanspan.raster.splats import draw_splats, new_keys, pixel_matrix
from scanspan.records import Float32Array, Int64Array, UInt8Array
from scanspan.shade.color import LINEAR_FROM_SRGB8, THRESHOLDS
from scanspan.shade.eyedome import eye_dome
from scanspan.shade.splats import ROW_BITS, BlockRows, Look, darken_pixels, mark_seen, paint_keys, shade_splats
from scanspan.target.points import find_distances
from scanspan.target.resolve import resolve

MOST_REACH = 16  # pixels
LARGEST_SHARE = 255.0  # of the radius of a splat in that of its block


class SplatPicture:
    """Blocks of a tree, drawn for one camera.

    Attributes
    ----------
    keys : (height * width + some,) what each pixel shows.
    nodes : (K,) the blocks that may be drawn; a row of it is part of a number.
    splats : how many were drawn so far.
    """

    def __init__(
        self, cache: BlockCache, columns: NodeColumns, camera: Camera, size: tuple[int, int], nodes: Int64Array,
        view: SplatView, threads: int,
    ) -> None:  # fmt: skip
        self.cache, self.camera, self.size, self.threads, self.view = cache, camera, size, threads, view
        self.nodes, self.splats = nodes, 0
        self.keys = new_keys(size)
        self.matrix = pixel_matrix(view.clip, size)[None]
        table = cache.tree.nodes
        self._low, self._step, self._count = table["low"][nodes], table["step"][nodes], cache.count[nodes].astype(np.int64)
        self._center, self._radius = columns.center[nodes], columns.radius[nodes]
        self._radii = np.zeros((len(nodes), 2))
        self._radii[:, 1] = columns.splat_radius[nodes] * stretch_of_nodes(view, self._center, self._radius) / LARGEST_SHARE

    def _reach(self, rows: Int64Array) -> int:
        """Return how many pixels splats of some blocks reach: half the largest radius of the block in the middle among them."""
        if not len(rows):
            return 1
        (x, y, z), (a, b, c, d) = self._center[rows].T, self.view.matrix[2]
        away = np.maximum(x * a + y * b + z * c + d, self._radius[rows] * self.view.slope)
        sizes = self._radii[rows, 1] * LARGEST_SHARE / np.where(away > 0.0, away, 1.0)
        return int(np.clip(np.rint(np.median(sizes) / 2.0), 1, MOST_REACH))

    def draw(self, rows: Int64Array, first_pass: int = 0, last_pass: int = len(STRIDES) - 1) -> None:
        """Draw some blocks, by their rows in the cut; of each those splats that belong to some passes."""
        for first, last in self.cache.parts(self.nodes[rows]):
            part, splats = rows[first:last], self.cache.splats
            begin, end = (pass_ends(self._count[part], number) for number in (first_pass - 1, last_pass))
            start = self.cache.start[self.nodes[part]]
            blocks = np.stack([start + begin, end - begin, (part << ROW_BITS) + begin, np.zeros_like(begin)], axis=1)
            draw_splats(
                self.keys, self.size, splats.positions, blocks, self._low[part], self._step[part], self.matrix,
                radii=self._radii[part], shares=splats.radius, has_far=self.camera.has_far, threads=self.threads,
            )  # fmt: skip
            self.splats += int((end - begin).sum())

    def gap(self, rows: Int64Array, number: int) -> float:
        """Return how many pixels a splat of some blocks may lie from one of the same block that is drawn after a pass."""
        most = 0.0
        for first, last in self.cache.parts(self.nodes[rows]):
            part = rows[first:last]
            blocks = np.stack(
                [self.cache.start[self.nodes[part]], pass_ends(self._count[part], number), self._count[part]], axis=1
            )
            found = largest_gap(
                self.view, self._center[part], self._radius[part], self._low[part], self._step[part], blocks,
                self.cache.splats.positions, ORDERS, STRIDES[number],
            )  # fmt: skip
            most = max(most, float(found))
        return most

    def seen(self) -> Int64Array:
        """Return the numbers that the keys show, ascending."""
        marks = np.zeros(len(self.nodes) << ROW_BITS, np.bool_)

        def mark(first: int, last: int, _: Event) -> None:
            """Mark those of some pixels."""
            mark_seen(self.keys, first, last, marks.view(np.uint8))

        run_bands(mark, self.size[0] * self.size[1], self.threads)
        return np.flatnonzero(marks)

    def color(self, look: Look, behind: Float32Array) -> UInt8Array:
        """Return the picture, (H, W, 4), before a background."""
        width, height = self.size
        numbers = self.seen()
        colors = np.empty((len(self.nodes) << ROW_BITS, 4), np.uint8)
        rows, first = np.unique(numbers >> ROW_BITS, return_index=True)
        bounds = np.append(first, len(numbers))
        for start, end in self.cache.parts(self.nodes[rows]):
            places = BlockRows(self.cache.start[self.nodes], self._low, self._step)
            part, splats = numbers[bounds[start] : bounds[end]], self.cache.splats

            def shade(first: int, last: int, _: Event) -> None:
                """Shade some splats."""
                shade_splats(part[first:last], places, splats, self.view.eye, look, colors)  # noqa: B023

            run_bands(shade, len(part), self.threads) if len(part) else None

        # Look up the colour of each pixel.
        backdrop = resolve(np.zeros((height, 1, 4), np.float32), 1, behind)
        picture = np.empty((height, width, 4), np.uint8)
        flat, table, ground = (array.reshape(-1, 4).view(np.uint32)[:, 0] for array in (picture, colors, backdrop))

        def paint(first: int, last: int, _: Event) -> None:
            """Paint some rows."""
            paint_keys(self.keys, first, last, table, ground, width, flat)

        run_bands(paint, height, self.threads)
        if not self.cache.tree.has_normals:
            self._darken(picture.reshape(-1, 4), self._reach(rows))
        return picture

    def _darken(self, picture: UInt8Array, reach: int) -> None:
        """Darken what stands behind something close by, (H W, 4), as clouds without normals show their shape by that alone."""
        width, height = self.size
        p, factor = self.camera.projection(self.size), np.ones((height, width), np.float32)
        distance, per_pixel = np.empty((height, width), np.float32), 2.0 / (height * abs(float(p[1, 1])))
        find_distances(self.keys, p[3, 3] - p[2, 3], -2.0 * p[3, 3], p[2, 2] - p[3, 2], 2.0 * p[3, 2], distance.reshape(-1))

        def darken(first: int, last: int, _: Event) -> None:
            """Darken some rows."""
            eye_dome(distance, first, last, per_pixel, self.camera.is_orthographic, reach, 1.0, factor)
            darken_pixels(self.keys, first, last, width, factor.reshape(-1), LINEAR_FROM_SRGB8, THRESHOLDS, STARTS, picture)

        run_bands(darken, height, self.threads)
