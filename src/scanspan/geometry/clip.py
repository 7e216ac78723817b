"""Clipping in homogeneous space: what lies behind the near plane is cut off before the division by w.

Keeps z >= -w and w > 0; z <= w only for a camera with a far plane. There is no clipping at the borders of the image, since the
bounds of a triangle do that; only what projects beyond 2^24 px is cut back to it, so that fixed point can hold it.

A cut triangle becomes a fan of pieces. Each keeps weights, the share of the source's corners in its own, so that any
attribute can be interpolated later without having been clipped, and has the triangle's own plane of depth. A cut point is
computed from the end that is inside towards the end that is outside: two triangles that share the edge get the identical
point, and no crack opens.

Source: Sutherland and Hodgman 1974, in homogeneous coordinates after Blinn and Newell 1978.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.depth_plane import outline_pieces
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.geometry.project import no_outlines, plane_distance, project, room_for_outlines
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float64Array, Int32Array, ScreenTriangles, UInt8Array

MIN_W = 2.0**-100  # where w reaches 0; anything positive that 1 / w can take
MAX_CORNERS = 10  # of a triangle after seven planes


def clip_planes(size: tuple[int, int], far: bool) -> Float64Array:
    """Return the planes as (P, 5) rows (a, b, c, d, e): a point is kept where a x + b y + c z + d w >= e.

    In order: near, w > 0, the four sides at 2^24 px, far.
    """
    across, down = 2.0 * MAX_COORDINATE / size[0], 2.0 * MAX_COORDINATE / size[1]
    planes = [
        (0.0, 0.0, 1.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 1.0, MIN_W),
        (1.0, 0.0, 0.0, across + 1.0, 0.0),
        (-1.0, 0.0, 0.0, across - 1.0, 0.0),
        (0.0, 1.0, 0.0, down - 1.0, 0.0),
        (0.0, -1.0, 0.0, down + 1.0, 0.0),
    ]
    if far:
        planes.append((0.0, 0.0, -1.0, 1.0, 0.0))
    return np.array(planes)


@kernel
def count_pieces(triangles: Int32Array, outcodes: UInt8Array) -> tuple[int, int]:
    """Return how many triangles are whole and how many are cut; the others lie outside of one plane altogether."""
    whole = cut = 0
    for n in range(triangles.shape[0]):
        p, q, r = outcodes[triangles[n, 0]], outcodes[triangles[n, 1]], outcodes[triangles[n, 2]]
        if (p | q | r) == 0:
            whole += 1
        elif (p & q & r) == 0:
            cut += 1
    return whole, cut


@helper_kernel
def cut_polygon(
    polygon: Float64Array, made: UInt8Array, count: int, planes: Float64Array, k: int, out: Float64Array, out_made: UInt8Array
) -> int:
    """Cut a convex polygon by plane k and return its new number of corners.

    Shapes  polygon, out: (MAX_CORNERS, 7): clip coordinates and the three weights; made, out_made: (MAX_CORNERS,) uint8, 1
            where the edge that starts at a corner was made by clipping.
    Source  Sutherland and Hodgman 1974.
    """
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        from_here = plane_distance(planes, k, polygon[i, 0], polygon[i, 1], polygon[i, 2], polygon[i, 3])
        from_next = plane_distance(planes, k, polygon[j, 0], polygon[j, 1], polygon[j, 2], polygon[j, 3])
        if from_here >= 0.0:
            out[kept] = polygon[i]
            out_made[kept] = made[i]
            kept += 1

        # Cut the edge, going from its inner end to its outer one.
        if (from_here >= 0.0) != (from_next >= 0.0):
            leaves = from_here >= 0.0
            a, b = (i, j) if leaves else (j, i)
            inner, outer = (from_here, from_next) if leaves else (from_next, from_here)
            share = inner / (inner - outer)
            for c in range(7):
                out[kept, c] = polygon[a, c] + share * (polygon[b, c] - polygon[a, c])
            if k == 1:
                out[kept, 3] = MIN_W
            out_made[kept] = np.uint8(1) if leaves else made[i]
            kept += 1
    return kept


@kernel
def cut_ring(ring: Float64Array, planes: Float64Array, k: int, out: Float64Array) -> int:
    """Cut a ring of any length, convex or not, by plane k, and return how many corners are left.

    Shapes  ring: (M, 7) as for cut_polygon; out: (2 M, 7), written.
    """
    made, out_made = np.zeros(ring.shape[0], np.uint8), np.zeros(out.shape[0], np.uint8)
    return cut_polygon(ring, made, ring.shape[0], planes, k, out, out_made)


@kernel
def clip_kernel(
    clip: Float64Array, triangles: Int32Array, outcodes: UInt8Array, planes: Float64Array, vertices: Float64Array,
    corners: Int32Array, source: Int32Array, piece: Int32Array, weights: Float64Array, inner: UInt8Array,
) -> tuple[int, int, int]:  # fmt: skip
    """Write the triangles that are kept, in order, and return how many there are and how many new vertices and pieces.

    Shapes  clip: (V, 4); triangles: (T, 3); vertices: (V', 4) new clip coordinates, numbered from V on; the others as in
            ScreenTriangles, each long enough.
    """
    polygon, other = np.empty((MAX_CORNERS, 7)), np.empty((MAX_CORNERS, 7))
    made, other_made = np.zeros(MAX_CORNERS, np.uint8), np.zeros(MAX_CORNERS, np.uint8)
    n_out = n_vertices = n_pieces = 0
    for n in range(triangles.shape[0]):
        p, q, r = outcodes[triangles[n, 0]], outcodes[triangles[n, 1]], outcodes[triangles[n, 2]]
        if (p & q & r) != 0:
            continue
        if (p | q | r) == 0:
            corners[n_out] = triangles[n]
            source[n_out], piece[n_out], inner[n_out] = n, -1, 0
            n_out += 1
            continue

        # Cut by every plane that a corner lies outside of.
        polygon[:3] = 0.0
        for i in range(3):
            polygon[i, :4] = clip[triangles[n, i]]
            polygon[i, 4 + i] = 1.0
            made[i] = 0
        count = 3
        for k in range(planes.shape[0]):
            if (p | q | r) >> k & 1:
                count = cut_polygon(polygon, made, count, planes, k, other, other_made)
                polygon, other, made, other_made = other, polygon, other_made, made

        # Fan what is left; edges inside the fan and along the planes are marked.
        for i in range(count):
            vertices[n_vertices + i] = polygon[i, :4]
        for i in range(1, count - 1):
            corners[n_out, 0] = clip.shape[0] + n_vertices
            corners[n_out, 1] = clip.shape[0] + n_vertices + i
            corners[n_out, 2] = clip.shape[0] + n_vertices + i + 1
            weights[n_pieces, 0], weights[n_pieces, 1], weights[n_pieces, 2] = (
                polygon[0, 4:],
                polygon[i, 4:],
                polygon[i + 1, 4:],
            )
            last_edge = made[count - 1] if i + 2 == count else np.uint8(1)
            first_edge = made[0] if i == 1 else np.uint8(1)
            source[n_out], piece[n_out], inner[n_out] = n, n_pieces, made[i] | last_edge << 1 | first_edge << 2
            n_out += 1
            n_pieces += 1
        n_vertices += count
    return n_out, n_vertices, n_pieces


def to_screen(
    clip: Float64Array, triangles: Int32Array, size: tuple[int, int], subpixel_bits: int, far: bool = False, threads: int = 1
) -> ScreenTriangles:
    """Clip, project and snap triangles.

    Parameters
    ----------
    clip : (V, 4) float64 clip coordinates, finite.
    triangles : (T, 3) int32 rows of `clip`.
    size : width and height of the image in pixels.
    subpixel_bits : s, 4 to 16.
    far : whether to cut at z = w.
    threads : how many share the vertices.
    """
    planes = clip_planes(size, far)
    seen = project(clip, planes, size, subpixel_bits, threads)
    if not seen.all_codes:
        n = len(triangles)
        return ScreenTriangles(
            xy=seen.xy,
            depth=seen.depth,
            clip=clip,
            corners=triangles,
            source=np.arange(n, dtype=np.int32),
            piece=np.full(n, -1, np.int32),
            weights=np.empty((0, 3, 3)),
            inner=np.zeros(n, np.uint8),
            **no_outlines(n),
        )

    # Make room for the worst case, a corner and a piece more for each plane, and give back what was not needed.
    whole, cut = count_pieces(triangles, seen.outcodes)
    room, pieces = cut * MAX_CORNERS, cut * (MAX_CORNERS - 2)
    vertices, corners = np.empty((room, 4)), np.empty((whole + pieces, 3), np.int32)
    source, piece = np.empty(whole + pieces, np.int32), np.empty(whole + pieces, np.int32)
    weights, inner = np.empty((pieces, 3, 3)), np.empty(whole + pieces, np.uint8)
    n, n_vertices, n_pieces = clip_kernel(
        clip, triangles, seen.outcodes, planes, vertices, corners, source, piece, weights, inner
    )
    added = project(vertices[:n_vertices], planes, size, subpixel_bits)
    middle = np.array([size[0] / 2, size[1] / 2, float(1 << subpixel_bits)])
    fields = no_outlines(n) | room_for_outlines(n_pieces)
    rows = outline_pieces(
        clip, seen.xy, seen.depth, seen.outcodes, triangles, middle, corners[:n], source[:n], inner[:n], piece[:n], weights,
        added.xy, fields["outline"], fields["lines"], fields["limits"], fields["planes"],
    )  # fmt: skip
    fields |= {name: fields[name][:rows].copy() for name in ("lines", "limits", "planes")}
    return ScreenTriangles(
        xy=np.concatenate([seen.xy, added.xy]),
        depth=np.concatenate([seen.depth, added.depth]),
        clip=np.concatenate([clip, vertices[:n_vertices]]),
        corners=corners[:n].copy(),
        source=source[:n].copy(),
        piece=piece[:n].copy(),
        weights=weights[:n_pieces].copy(),
        inner=inner[:n].copy(),
        **fields,
    )
