"""SplatFrame: a picture of a tree of splats, and what is known of its pixels."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.splats.cache import ORDERS, BlockCache
from scanspan.assets.splats.codec import Splats, decode_normals
from scanspan.raster.write import EMPTY_KEY, NUMBER_MASK
from scanspan.records import Array, BoolArray, Float32Array, Float64Array, Int64Array, UInt8Array
from scanspan.shade.splats import ROW_BITS
from scanspan.target.cloud_frame import CornerlessFrame


class Progress(NamedTuple):
    """What a picture of a tree has cost, and what it is worth."""

    error: float  # pixels: nothing seen lies farther from what is drawn; inf where there is no bound
    splats: int  # drawn for this picture, with all before it
    bytes_read: int  # of splats that were decoded for it, with all before it
    seconds: float  # since it was asked for
    is_final: bool  # whether it meets the error that was asked for


class SplatFrame(CornerlessFrame):
    """What `SplatTree.render` and `refine` return: a Frame whose pixels come from splats.

    Attributes
    ----------
    color, depth, position, normal, object : as in a Frame; a splat has one depth, that of its middle.
    primitive : (H, W) number of the splat, counted over all nodes of the tree in order; -1 where there is nothing.
    barycentric, uv : splats have none: 0 and NaN.
    progress : error reached, splats drawn, bytes read and seconds; `error`, `splats` and `bytes_read` are short for its fields.
    """

    def __init__(
        self, color: UInt8Array, keys: Int64Array, nodes: Int64Array, cache: BlockCache, camera: Camera, size: tuple[int, int],
        progress: Progress,
    ) -> None:  # fmt: skip
        self.color, self.camera, self.size, self.progress = color, camera, size, progress
        self._keys, self._nodes, self._cache = keys[: size[0] * size[1]], nodes, cache
        self.counters = {"splats": progress.splats}

    @property
    def error(self) -> float:
        """Pixels that anything seen lies from what is drawn, at most."""
        return self.progress.error

    @property
    def splats(self) -> int:
        """How many splats were drawn."""
        return self.progress.splats

    @property
    def bytes_read(self) -> int:
        """How many bytes of splats were decoded."""
        return self.progress.bytes_read

    @property
    def is_final(self) -> bool:
        """Whether the error that was asked for is met."""
        return self.progress.is_final

    @cached_property
    def _covered(self) -> BoolArray:
        """(H W,) whether there is something."""
        return np.asarray(self._keys != EMPTY_KEY)

    @cached_property
    def _found(self) -> tuple[Int64Array, Int64Array]:
        """The node, and the place in its block, of every covered pixel."""
        numbers = NUMBER_MASK - (self._keys[self._covered] & NUMBER_MASK)
        return self._nodes[numbers >> ROW_BITS], numbers & ((1 << ROW_BITS) - 1)

    def _spread(self, values: Array, fill: float) -> Any:
        """Return values of covered pixels as an image."""
        out = np.full((len(self._keys), *values.shape[1:]), fill, values.dtype)
        out[self._covered] = values
        return out.reshape(self.size[1], self.size[0], *values.shape[1:])

    def _splats(self) -> Iterator[tuple[BoolArray, Int64Array, Splats]]:
        """Give covered pixels in groups, with the rows of their splats in arrays that were read."""
        nodes, places = self._found
        unique = np.unique(nodes)
        with self._cache.lock:
            for first, last in self._cache.parts(unique):
                part = (nodes >= unique[first]) & (nodes <= unique[last - 1])
                yield part, self._cache.start[nodes[part]] + places[part], self._cache.splats

    @cached_property
    def primitive(self) -> Array:
        """(H, W) int32, int64 where there are more splats than that; -1 where there is nothing."""
        nodes, places = self._found
        table = self._cache.tree.nodes
        fits = self._cache.tree.splat_count < 2**31
        numbers = table["first_number"][nodes].astype(np.int64) + ORDERS[table["count"][nodes], places]
        return np.asarray(self._spread(numbers.astype(np.int32 if fits else np.int64), -1))

    @cached_property
    def object(self) -> Array:
        """(H, W) int32, 0 for the tree, -1 where there is nothing."""
        return np.where(self._covered, np.int32(0), np.int32(-1)).reshape(self.size[1], self.size[0])

    @cached_property
    def position(self) -> Float64Array:
        """(H, W, 3) float64, NaN where there is nothing."""
        nodes, table, tree = self._found[0], self._cache.tree.nodes, self._cache.tree
        places = np.empty((len(nodes), 3))
        for part, rows, splats in self._splats():
            at = nodes[part]
            places[part] = table["low"][at] + table["step"][at] * splats.positions[rows] + tree.origin
        return np.asarray(self._spread(places, np.nan))

    @cached_property
    def depth(self) -> Float32Array:
        """(H, W) float32, +inf where there is nothing."""
        places = self.position.reshape(-1, 3)[self._covered]
        with np.errstate(over="ignore"):
            return np.asarray(self._spread(self.camera.depth(places).astype(np.float32), np.inf))

    @cached_property
    def normal(self) -> Float32Array:
        """(H, W, 3) float32 of length 1, 0 where there is none."""
        normals = np.zeros((len(self._found[0]), 3), np.float32)
        if self._cache.tree.has_normals:
            for part, rows, splats in self._splats():
                decoded = np.empty((len(rows), 3), np.float32)
                decode_normals(splats.normal[rows], decoded)
                normals[part] = decoded
        return np.asarray(self._spread(normals, 0.0))

    @property
    def coverage(self) -> float:
        """Share of the pixels whose centre is covered, 0 to 1."""
        return float(self._covered.mean())

    def __repr__(self) -> str:
        width, height = self.size
        return f"SplatFrame({width} x {height}, {self.splats:,} splats drawn, error {self.error:.3g} px)"
