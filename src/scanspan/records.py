"""The data dictionary: every record that flows along an arrow of the pipeline, with shapes, types and units.

All are named tuples of arrays or of numbers, because that is what kernels take; none has methods. Sub-pixels are 1/2^s of a
pixel with s = ``subpixel_bits``. Ranges are half-open.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
BoolArray = npt.NDArray[np.bool_]
Float32Array = npt.NDArray[np.float32]
Float64Array = npt.NDArray[np.float64]
Int32Array = npt.NDArray[np.int32]
Int64Array = npt.NDArray[np.int64]
UInt8Array = npt.NDArray[np.uint8]
UInt16Array = npt.NDArray[np.uint16]

# A whole number in a kernel: 64 bits once compiled, either of these when the kernel runs as plain Python.
Integer = int | np.int64


class Outlines(NamedTuple):
    """The P polygons of a DrawList: there, three corners that span its plane stand for each."""

    triangle: Int32Array  # (P,) row of the DrawList's triangles
    rings: Int64Array  # (R, 2) rows of clip and positions, from the first to before the last
    polygon_rings: Int64Array  # (P + 1,) polygon p has rings polygon_rings[p] to polygon_rings[p + 1]
    fill_rule: Int64Array  # (P,) EVEN_ODD or NON_ZERO of raster/polygon.py


class ScreenPolygons(NamedTuple):
    """The P polygons of a scene on the screen, clipped and snapped."""

    xy: Int64Array  # (M, 2) sub-pixels, ring after ring
    ring_starts: Int32Array  # (R + 1,)
    polygon_rings: Int32Array  # (P + 1,)
    fill_rule: Int64Array  # (P,)
    slot: Int32Array  # (P,) row of ScreenTriangles
    planes: Float64Array  # (P, 7) as in ScreenTriangles
    starts: Int64Array  # (P, 4) the last four of limits there


class DrawList(NamedTuple):
    """A scene flattened for one camera: T triangles over all instances, in order, with V vertices.

    A segment or a point comes as the two triangles of a quadrangle that faces the camera, so one rasterizer serves all kinds.
    """

    clip: Float64Array  # (V, 4) clip coordinates
    positions: Float64Array  # (V, 3) in the world
    triangles: Int32Array  # (T, 3) rows of clip and positions
    primitive: Int32Array  # (T,) number of the face, segment or point, in scene order
    instance: Int32Array  # (T,) number of the instance
    element: Int32Array  # (T,) within its geometry: the triangle of a mesh, the segment, or the point
    inner: UInt8Array  # (T,) bit i set: the edge opposite corner i is no edge of the face
    mirrored: BoolArray  # (instances,) whether the transform turns left hands into right ones, so corners 1 and 2 are swapped
    outlines: Outlines | None  # the polygons, None where there are none


class ScreenTriangles(NamedTuple):
    """What geometry hands to raster and shade: N triangles in front of the eye, as corners in a list of V projected vertices.

    A triangle that the near plane cut comes as several pieces; they follow each other, so `source` never decreases and the
    lower piece is always the lower primitive.
    """

    xy: Int64Array  # (V, 2) sub-pixels, x right and y down from the image's top-left corner
    depth: Float64Array  # (V,) 1 at the near plane, 0 at z = w
    clip: Float64Array  # (V, 4) clip coordinates; shading divides by w
    corners: Int32Array  # (N, 3) rows of xy
    source: Int32Array  # (N,) the input triangle that each belongs to
    piece: Int32Array  # (N,) row of weights, -1 for a triangle that was not cut
    weights: Float64Array  # (P, 3, 3) weights[p, c, k]: share of the source's corner k in corner c of piece p; for a triangle
    # that was not clipped, the share of corner k at (x, y) in sub-pixels is proportional to weights[p, k] . (x, y, 1)
    inner: UInt8Array  # (N,) bit i set: the edge opposite corner i was made by clipping; bit 3: a polygon, which reaches beyond
    # its three corners; bit 4: a triangle that crosses a plane of the camera and was not clipped
    outline: Int32Array  # (N,) row of lines, limits and planes, -1 for a triangle bounded by the edges between its corners
    lines: Int64Array  # (R, 3, 4) a, b, q_x, q_y: at (x, y) the edge value is a (x - q_x) + b (y - q_y); all 0 is no edge
    limits: Int64Array  # (R, 8) sub-pixels: lowest and highest x and y, both included; the point that the plane starts from;
    # 1 where it is clockwise as seen, -1 counter-clockwise; and the bits of `inner`
    planes: Float64Array  # (R, 7) depth at that point, its slopes in a sub-pixel, the depths it is cut off at, and those it has
    integers: Int64Array  # (R, 19) and
    floats: Float64Array  # (R, 7) the fields of the TriangleSetup of each outline; made in raster/ for one Sampling


class Sampling(NamedTuple):
    """Where a kernel samples and by which rule: a rectangle of pixels, the sample's place in each, edge rule and culling."""

    x_start: int  # pixels
    x_end: int
    y_start: int
    y_end: int
    subpixel_bits: int
    sample_x: int  # sub-pixels right of a pixel's left edge
    sample_y: int  # sub-pixels below a pixel's top edge
    cull: int  # 0 nothing, 1 clockwise as seen (back faces), -1 counter-clockwise as seen
    rule: int  # raster/edge.py: TOP_LEFT ... OFFSCREEN_POINT
    rule_x: int  # the off-screen point in sub-pixels, homogeneous
    rule_y: int
    rule_w: int  # 1 or, for a direction, 0
    coverage: int  # raster/edge.py: SAMPLE, TOUCHED, INSIDE
    order: int  # number in raster/algorithms.py, for algorithms that choose as they go


class TriangleSetup(NamedTuple):
    """One triangle ready to be scan-converted: three edge functions and the depth, all affine in integer pixel steps.

    At the sample of pixel (x, y), with i = x - x_start and j = y - y_start, edge k is f_k + a_k i + b_k j: the exact edge value
    with the rule's bias folded in, divided by 2^s and floored, so it is negative exactly where the edge excludes the sample.
    Depth is depth + (g1 + g1_x i + g1_y j) slope1 + (g2 + g2_x i + g2_y j) slope2, the integers exact.
    """

    x_start: Integer  # the pixels whose samples lie in the bounding box, within the rectangle
    x_end: Integer
    y_start: Integer
    y_end: Integer  # equal to y_start where there is nothing to draw
    f0: Integer
    f1: Integer
    f2: Integer
    a0: Integer
    a1: Integer
    a2: Integer
    b0: Integer
    b1: Integer
    b2: Integer
    g1: Integer
    g1_x: Integer
    g1_y: Integer
    g2: Integer
    g2_x: Integer
    g2_y: Integer
    depth: float
    slope1: float
    slope2: float
    depth_low: float  # where depth is held: the range of the corners, if a sample may lie outside of them
    depth_high: float
    cut_low: float  # a sample below or above is cut off; infinite where geometry has clipped already
    cut_high: float
