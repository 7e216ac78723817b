"""CloudFrame: a rendered picture of point clouds, and everything that is known of its pixels.

It has the fields of a Frame. A pixel shows one point, whose own position, depth and normal they are.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.scene import Scene
from scanspan.homogeneous import normal_matrix
from scanspan.raster.write import EMPTY_KEY, NUMBER_MASK
from scanspan.records import Array, Float32Array, Float64Array, Int64Array, UInt8Array
from scanspan.shade.cloud_colors import cloud_of, places_of
from scanspan.target.frame import Frame


class CornerlessFrame(Frame):
    """A Frame of what has no corners, so neither weights of them nor texture coordinates."""

    @cached_property
    def barycentric(self) -> Float32Array:
        """(H, W, 3) float32, 0."""
        return np.zeros((self.size[1], self.size[0], 3), np.float32)

    @cached_property
    def uv(self) -> Float32Array:
        """(H, W, 2) float32, NaN."""
        return np.full((self.size[1], self.size[0], 2), np.nan, np.float32)


class CloudFrame(CornerlessFrame):
    """What `render` returns for a scene of point clouds. In a notebook it shows itself.

    Attributes
    ----------
    color : (H, W, 4) uint8, sRGB with straight alpha.
    depth : (H, W) float32, distance of the point along the line of sight in the scene's units; +inf where there is nothing.
    primitive : (H, W) int32, or int64 beyond 2^31 points, number of the point in scene order; -1 where there is nothing.
    object : (H, W) int32, number of the instance; -1 where there is nothing.
    normal : (H, W, 3) float32, of length 1 in the world; 0 where there is none.
    position : (H, W, 3) float64, of the point in the world; NaN where there is nothing.
    barycentric, uv : 0 and NaN throughout: points have none.
    counters : how many points there are, and how many are seen.
    camera, scene, size : what was asked for.

    Examples
    --------
    >>> import scanspan as ss
    >>> frame = ss.render(ss.PointCloud([(0, 0, 0), (1, 0, 0), (0, 1, 0)]), "front", size=(64, 48), point_size=3)
    >>> frame.color.shape, frame.primitive.max().item()
    ((48, 64, 4), 2)
    """

    def __init__(self, color: UInt8Array, keys: Int64Array, *, scene: Scene, camera: Camera, size: tuple[int, int]) -> None:
        self.color, self.scene, self.camera, self.size = color, scene, camera, size
        self._keys = keys

    @cached_property
    def _seen(self) -> tuple[Int64Array, Int64Array]:
        """The pixels that show a point, as numbers row after row, and the numbers of their points."""
        pixels = np.flatnonzero(self._keys != EMPTY_KEY)
        return pixels, NUMBER_MASK - (self._keys[pixels] & NUMBER_MASK)

    def _gather(self, fill: float, columns: int, dtype: type, name: str) -> Array:
        """Return a field (H, W, columns): of each instance, what the method of that name gives for rows of its cloud."""
        pixels, numbers = self._seen
        out: Array = np.full((self.size[0] * self.size[1], columns), fill, dtype)
        firsts = np.array(self.scene.first_primitive)
        owner = np.searchsorted(firsts, numbers, side="right") - 1
        for k in np.unique(owner).tolist():
            mine = owner == k
            out[pixels[mine]] = getattr(self, name)(k, numbers[mine] - firsts[k])
        return out.reshape(self.size[1], self.size[0], columns)

    def _places(self, k: int, rows: Int64Array) -> Float64Array:
        """Return where points are."""
        return places_of(self.scene.instances[k], rows)

    def _owner(self, k: int, rows: Int64Array) -> Array:
        """Return the number of the instance."""
        return np.full((len(rows), 1), k)

    def _normals(self, k: int, rows: Int64Array) -> Array:
        """Return normals of length 1 in the world, or 0."""
        instance = self.scene.instances[k]
        known = cloud_of(instance).normals
        if known is None:
            return np.zeros((len(rows), 3))
        m, n = normal_matrix(instance.transform), known[rows].astype(np.float64)
        turned = n[:, :1] * m[:, 0] + n[:, 1:2] * m[:, 1] + n[:, 2:] * m[:, 2]
        length = np.sqrt(turned[:, :1] ** 2 + turned[:, 1:2] ** 2 + turned[:, 2:] ** 2)
        return np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)

    @cached_property
    def primitive(self) -> Array:
        """(H, W) int32 or int64, -1 where there is nothing."""
        pixels, numbers = self._seen
        dtype = np.int32 if self.scene.primitive_count < 1 << 31 else np.int64
        out = np.full(self.size[0] * self.size[1], -1, dtype)
        out[pixels] = numbers
        return out.reshape(self.size[1], self.size[0])

    @cached_property
    def object(self) -> Array:
        """(H, W) int32, -1 where there is nothing."""
        return self._gather(-1, 1, np.int32, "_owner")[..., 0]

    @cached_property
    def position(self) -> Float64Array:
        """(H, W, 3) float64, NaN where there is nothing."""
        return self._gather(np.nan, 3, np.float64, "_places")

    @cached_property
    def depth(self) -> Float32Array:
        """(H, W) float32, +inf where there is nothing."""
        found = self.camera.depth(np.nan_to_num(self.position).reshape(-1, 3))
        out = np.full(len(found), np.inf, np.float32)
        with np.errstate(over="ignore"):
            out[self._seen[0]] = found[self._seen[0]].astype(np.float32)
        return out.reshape(self.size[1], self.size[0])

    @cached_property
    def normal(self) -> Float32Array:
        """(H, W, 3) float32 of length 1, 0 where there is none."""
        return self._gather(0.0, 3, np.float32, "_normals")

    @property
    def coverage(self) -> float:
        """Share of the pixels whose centre is covered, 0 to 1."""
        return len(self._seen[0]) / (self.size[0] * self.size[1])

    @cached_property
    def counters(self) -> dict[str, int]:  # type: ignore[override]
        """How many points there are, and how many are seen."""
        return {"points": self.scene.primitive_count, "seen": len(np.unique(self._seen[1]))}

    def __repr__(self) -> str:
        width, height = self.size
        return f"CloudFrame({width} x {height}, {self.counters['seen']:,} points seen)"
