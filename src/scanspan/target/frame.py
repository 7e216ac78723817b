"""Frame: a rendered picture and everything that is known of its pixels.

Colour is averaged over the samples of a pixel; every other field comes from one sample at its centre and is worked out when it
is first asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.scene import Scene
from scanspan.errors import InputError, unknown_name
from scanspan.records import (
    Array,
    DrawList,
    Float32Array,
    Float64Array,
    Int32Array,
    ScreenPolygons,
    ScreenTriangles,
    UInt8Array,
)
from scanspan.shade import surface
from scanspan.shade.interpolate import interpolate_corners_kernel, interpolate_vertices_kernel
from scanspan.shade.shading import Look
from scanspan.target.image import png_bytes, write_image
from scanspan.target.visibility import Plane, RasterOptions, find_barycentric, numbers_of

FIELDS = ("color", "depth", "primitive", "object", "barycentric", "normal", "position", "uv")


class Frame:
    """What `render` returns. In a notebook it shows itself.

    Attributes
    ----------
    color : (H, W, 4) uint8, sRGB with straight alpha.
    depth : (H, W) float32, distance along the line of sight in the scene's units; +inf where there is nothing.
    primitive : (H, W) int32, number of the face, segment or point in scene order; -1 where there is nothing.
    object : (H, W) int32, number of the instance; -1 where there is nothing.
    barycentric : (H, W, 3) float32, perspective-correct weights of the triangle's corners; 0 where there is nothing.
    normal : (H, W, 3) float32, of length 1 in the world, as shaded but not turned to the viewer; 0 where there is none.
    position : (H, W, 3) float64 in the world; NaN where there is nothing.
    uv : (H, W, 2) float32 texture coordinates; NaN where there are none.
    counters : what happened to the triangles.
    camera, scene, size : what was asked for.

    Examples
    --------
    >>> import scanspan as ss
    >>> frame = ss.render(ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), size=(64, 48))
    >>> frame.color.shape, frame.primitive.max().item()
    ((48, 64, 4), 0)
    """

    def __init__(
        self, color: UInt8Array, centre: Plane, draw: DrawList, screen: ScreenTriangles, *, scene: Scene, camera: Camera,
        options: RasterOptions, look: Look, counters: Mapping[str, int], polygons: ScreenPolygons | None = None,
    ) -> None:  # fmt: skip
        self.color = color
        self.scene, self.camera, self.size = scene, camera, options.size
        self.counters = counters
        self._centre, self._draw, self._screen = centre, draw, screen
        self._options, self._look, self._polygons = options, look, polygons

    @cached_property
    def _number(self) -> Int32Array:
        """(H, W) the triangle of the DrawList at each pixel, -1 nothing."""
        return numbers_of(self._centre.slot, self._screen.source)

    @cached_property
    def _weights(self) -> Float64Array:
        """(H, W, 3) weights of the DrawList's corners, in float64."""
        return find_barycentric(self._centre, self._screen, self._options)

    def _interpolate(self, values: Float64Array, fill: float) -> Float64Array:
        """Return (H, W, k) per-vertex values, `fill` where there is nothing."""
        out = np.full((*self._number.shape, values.shape[1]), fill)
        interpolate_vertices_kernel(
            self._number.reshape(-1),
            self._weights.reshape(-1, 3),
            self._draw.triangles,
            values,
            out.reshape(-1, values.shape[1]),
        )
        return out

    def _interpolate_corners(self, values: Float32Array, fill: float) -> Float32Array:
        """Return (H, W, k) per-corner values, `fill` where there is nothing."""
        k = values.shape[2]
        out = np.full((*self._number.shape, k), fill, np.float32)
        interpolate_corners_kernel(self._number.reshape(-1), self._weights.reshape(-1, 3), values, out.reshape(-1, k))
        return out

    @cached_property
    def primitive(self) -> Array:
        """(H, W) int32, -1 where there is nothing."""
        return numbers_of(self._number, self._draw.primitive)

    @cached_property
    def object(self) -> Array:
        """(H, W) int32, -1 where there is nothing."""
        return numbers_of(self._number, self._draw.instance)

    @cached_property
    def depth(self) -> Float32Array:
        """(H, W) float32, +inf where there is nothing."""
        found = self._interpolate(self.camera.depth(self._draw.positions)[:, None], np.inf)[..., 0]
        with np.errstate(over="ignore"):
            return found.astype(np.float32)

    @cached_property
    def position(self) -> Float64Array:
        """(H, W, 3) float64, NaN where there is nothing."""
        return self._interpolate(self._draw.positions, np.nan)

    @cached_property
    def barycentric(self) -> Float32Array:
        """(H, W, 3) float32, 0 where there is nothing."""
        weights = self._weights.astype(np.float32)
        if self._draw.mirrored.any():
            swapped = (self.object >= 0) & self._draw.mirrored[self.object]
            weights[swapped] = weights[swapped][:, [0, 2, 1]]
        return weights

    @cached_property
    def normal(self) -> Float32Array:
        """(H, W, 3) float32 of length 1, 0 where there is none."""
        corners = surface.normals(self.scene, self._draw, self._look.shading, self._look.crease_angle)
        found = self._interpolate_corners(corners, 0.0)
        length = np.sqrt(found[..., 0] ** 2 + found[..., 1] ** 2 + found[..., 2] ** 2)[..., None]
        unit: Float32Array = np.divide(found, length, out=np.zeros_like(found), where=length > 0)
        return unit

    @cached_property
    def uv(self) -> Float32Array:
        """(H, W, 2) float32, NaN where there are none."""
        corners = surface.texture_coordinates(self.scene, self._draw)
        if corners is None:
            return np.full((*self._number.shape, 2), np.nan, np.float32)
        return self._interpolate_corners(corners, np.nan)

    @property
    def coverage(self) -> float:
        """Share of the pixels whose centre is covered, 0 to 1."""
        return float((self._centre.slot >= 0).mean())

    def fields(self, names: Any) -> dict[str, Array]:
        """Return fields by name, for writing them together.

        Raises
        ------
        InputError : for a name that is none of the fields.
        """
        names = [names] if isinstance(names, str) else list(names)
        for name in names:
            if name not in FIELDS:
                raise unknown_name("field", name, FIELDS)
        return {name: getattr(self, name) for name in names}

    def save(self, path: str | PathLike[str], fields: Any = None) -> None:
        """Write the picture, or fields of it.

        Parameters
        ----------
        path : the ending says how: .png, .jpg, .ppm or .npy for the colour, .npz for fields.
        fields : for .npz alone, the names of the fields to write; all of them by default.

        Raises
        ------
        InputError : for an ending that is not known, or a place that cannot be written to.
        """
        if str(path).lower().endswith(".npz"):
            write_image(path, self.fields(FIELDS if fields is None else fields))
        elif fields is not None:
            raise InputError(f"fields = {fields!r}: only .npz holds fields, not {str(path)!r}")
        else:
            write_image(path, self.color)

    def _repr_png_(self) -> bytes:
        """Show the picture in a notebook."""
        return png_bytes(self.color)

    def __repr__(self) -> str:
        width, height = self.size
        seen = np.unique(self.primitive[self.primitive >= 0])
        return f"Frame({width} x {height}, {len(seen):,} primitives seen)"
