"""Normals of faces and of their corners: smooth over gentle edges, sharp over steep ones.

Corners at exactly equal positions are welded first, however often a file stores them, by hashing the bits of the coordinates
and comparing them in full. A corner's normal is then the sum of the face normals around its position that turn away from its
own face by less than the crease angle, each weighted by the angle that its face spans there. That weight does not depend on
how a flat face was cut into triangles, which weights by area do. The arc cosine is a polynomial and a square root: the same
bits everywhere.

The price is a loop over pairs of corners at one position. Where more than 64 meet (the tip of a cone), their normals are
gathered into 1536 directions first, so that no mesh takes quadratic time.

Source: G. Thuermer and C. A. Wuethrich, Computing Vertex Normals from Polygonal Facets, 1998; M. Abramowitz and I. Stegun,
Handbook of Mathematical Functions, 4.4.46 (arc cosine, error below 2e-8).
"""

from __future__ import annotations

import math

import numpy as np

from scanspan.jit import kernel, part_kernel
from scanspan.records import Array, Float32Array, Float64Array, Int32Array, Int64Array

# Beyond this many corners at one position their normals are gathered by direction.
_MANY = 64

# Directions to a side of each face of the cube that directions are sorted onto.
_SIDE = 16

_LOW_BITS = 0x7FFFFFFF


def face_normals(positions: Float64Array, triangles: Int32Array) -> Float32Array:
    """Return the unit normal of each triangle.

    Parameters
    ----------
    positions : (V, 3) float64.
    triangles : (T, 3) integers, counter-clockwise as seen from the front.

    Returns
    -------
    (T, 3) float32; zeros where a triangle has no area.

    >>> face_normals(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    array([[0., 0., 1.]], dtype=float32)
    """
    points, corners = _normalise(positions, triangles)
    vectors = np.empty((len(corners), 3))
    face_vectors(points, corners, scale_of(points), vectors, np.empty((len(corners), 3)))
    unit_vectors(vectors)
    return vectors.astype(np.float32)


def corner_normals(positions: Float64Array, triangles: Int32Array, source: Array, crease_angle: float = 30.0) -> Float32Array:
    """Return a unit normal for each corner of each triangle.

    Parameters
    ----------
    positions : (V, 3) float64.
    triangles : (T, 3) integers, counter-clockwise as seen from the front.
    source : (T,) integers, the face that each triangle is part of; triangles of one face share its normal.
    crease_angle : degrees; faces that meet at a smaller angle look smooth. 0 is flat, 180 smooth everywhere.

    Returns
    -------
    (T, 3, 3) float32; a face's own normal where the sum is zero, zeros for a face without area.

    >>> roof = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 1]])
    >>> corner_normals(roof, np.array([[0, 1, 2], [0, 2, 3]]), np.arange(2), crease_angle=0)[0, 0]
    array([0., 0., 1.], dtype=float32)
    """
    points, corners = _normalise(positions, triangles)
    count = len(corners)
    normals = np.zeros((count, 3, 3), dtype=np.float32)
    if count == 0:
        return normals

    # Add up the area vectors of the triangles of each face, and make them unit normals.
    faces, face_count = _number_faces(np.asarray(source))
    vectors, angles = np.empty((count, 3)), np.empty((count, 3))
    face_vectors(points, corners, scale_of(points), vectors, angles)
    face_units = np.zeros((face_count, 3))
    sum_by_face(vectors, faces, face_units)
    unit_vectors(face_units)

    # Group the corners by position, then sum around each.
    table = np.full(1 << max(4, (2 * len(points) - 1).bit_length()), -1, dtype=np.int32)
    first = np.empty(len(points), dtype=np.int32)
    weld(points.view(np.int64), table, first)
    offsets = np.zeros(len(points) + 1, dtype=np.int64)
    members = np.empty(3 * count, dtype=np.int64)
    group_corners(first, corners, offsets, members)
    cells = np.zeros((6 * _SIDE * _SIDE, 4))
    sum_corners(offsets, members, faces, face_units, angles, _least_cosine(crease_angle), cells, normals)
    return normals


def _normalise(positions: Float64Array, triangles: Int32Array) -> tuple[Float64Array, Int32Array]:
    """Return both in the one layout that the kernels are compiled for; adding zero makes -0 and 0 the same position."""
    points = np.asarray(positions, dtype=np.float64) + 0.0
    corners = np.require(triangles, dtype=np.int32, requirements=["C", "A", "W"])
    return np.ascontiguousarray(points), corners


def scale_of(points: Float64Array) -> float:
    """Return the power of two that brings the largest finite coordinate to 1/2..1; multiplying by it rounds nothing."""
    finite = np.abs(points, where=np.isfinite(points), out=np.zeros(points.shape)) if len(points) else np.zeros(1)
    largest = float(finite.max())
    return math.ldexp(1.0, max(-1022, min(1000, -math.frexp(largest)[1]))) if largest > 0.0 else 1.0


def _number_faces(source: Array) -> tuple[Int32Array, int]:
    """Return the faces of triangles numbered from 0, and how many there are."""
    lowest, highest = int(source.min()), int(source.max())
    if lowest >= 0 and highest < 4 * len(source):
        return source.astype(np.int32), highest + 1
    _, numbers = np.unique(source, return_inverse=True)
    return numbers.reshape(-1).astype(np.int32), int(numbers.max()) + 1


def _least_cosine(degrees: float) -> float:
    """Return the cosine that faces have to exceed to share a normal, by its power series; -2, which all do, from 180 on."""
    if degrees >= 180.0:
        return -2.0
    angle = max(degrees, 0.0) / 180.0 * 3.141592653589793
    square, term, total = angle * angle, 1.0, 1.0
    for k in range(1, 20):
        term = -term * square / ((2 * k - 1) * (2 * k))
        total += term
    return total


@kernel
def angle_of_cosine(cosine: float) -> float:
    """Return the arc cosine, by a polynomial and a square root.

    Units   radians, within 2e-8.
    Needs   nothing; what is outside -1..1 is clamped.
    Source: Abramowitz and Stegun 4.4.46.
    """
    x = abs(cosine) if abs(cosine) < 1.0 else 1.0
    p = -0.0012624911 * x + 0.0066700901
    p = p * x - 0.0170881256
    p = p * x + 0.0308918810
    p = p * x - 0.0501743046
    p = p * x + 0.0889789874
    p = p * x - 0.2145988016
    p = p * x + 1.5707963050
    angle = float(np.sqrt(1.0 - x)) * p
    return angle if cosine >= 0.0 else 3.141592653589793 - angle


@kernel
def face_vectors(points: Float64Array, corners: Int32Array, scale: float, vectors: Float64Array, angles: Float64Array) -> None:
    """Compute the area vector and the three corner angles of each triangle.

    Shapes  points: (V, 3). corners: (T, 3) int32. vectors, angles: (T, 3) float64, written; zeros where there is no area.
    Units   vectors: twice the area, after scaling. angles: radians.
    Needs   corners within points.
    Cost    O(T).
    """
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        ax, ay, az = points[a, 0] * scale, points[a, 1] * scale, points[a, 2] * scale
        ux, uy, uz = points[b, 0] * scale - ax, points[b, 1] * scale - ay, points[b, 2] * scale - az
        vx, vy, vz = points[c, 0] * scale - ax, points[c, 1] * scale - ay, points[c, 2] * scale - az
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx

        # Leave out what has no area, and what is not finite.
        square = nx * nx + ny * ny + nz * nz
        if not (square > 0.0 and square < np.inf):
            for k in range(3):
                vectors[t, k] = 0.0
                angles[t, k] = 0.0
            continue
        vectors[t, 0], vectors[t, 1], vectors[t, 2] = nx, ny, nz

        # Take the angles between the sides.
        uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
        angles[t, 0] = angle_of_cosine((ux * vx + uy * vy + uz * vz) / np.sqrt(uu * vv))
        angles[t, 1] = angle_of_cosine(-(ux * wx + uy * wy + uz * wz) / np.sqrt(uu * ww))
        angles[t, 2] = angle_of_cosine((vx * wx + vy * wy + vz * wz) / np.sqrt(vv * ww))


@kernel
def unit_vectors(vectors: Float64Array) -> None:
    """Scale vectors to length one, in place; what has no length, or none that is finite, becomes zero.

    Shapes  vectors: (N, 3) float64.
    Cost    O(N).
    """
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0 and length < np.inf:
            vectors[i, 0], vectors[i, 1], vectors[i, 2] = x / length, y / length, z / length
        else:
            vectors[i, 0], vectors[i, 1], vectors[i, 2] = 0.0, 0.0, 0.0


@kernel
def sum_by_face(vectors: Float64Array, faces: Int32Array, sums: Float64Array) -> None:
    """Add up the vectors of the triangles of each face.

    Shapes  vectors: (T, 3). faces: (T,) int32. sums: (F, 3) float64, zeros before.
    Cost    O(T).
    """
    for t in range(len(faces)):
        for k in range(3):
            sums[faces[t], k] += vectors[t, k]


@kernel
def weld(bits: Int64Array, table: Int32Array, first: Int32Array) -> None:
    """Find for each position the first one with the same coordinates.

    Shapes  bits: (V, 3) int64, the bits of the coordinates. table: (2^k,) int32, all -1, 2^k at least 2 V. first: (V,) int32,
            written.
    Rule    equal bits are equal positions; the hash only says where to look.
    Needs   no -0 among the coordinates.
    Cost    O(V), one to two look-ups of the table each.
    """
    mask = len(table) - 1
    for i in range(len(bits)):
        # Mix 31 bits at a time: the products stay below 2^62, and nothing wraps around.
        mixed = np.int64(0)
        for k in range(3):
            word = bits[i, k]
            mixed = (mixed ^ (word & _LOW_BITS)) * 1540483477 + 1013904223
            mixed = (mixed ^ (mixed >> 27)) & _LOW_BITS
            mixed = (mixed ^ ((word >> 31) & _LOW_BITS)) * 1664525 + ((word >> 62) & 3)
            mixed = (mixed ^ (mixed >> 29)) & _LOW_BITS
        slot = (mixed ^ (mixed >> 15)) & mask

        # Walk on from there to the same position, or to a free place.
        while True:
            other = table[slot]
            if other < 0:
                table[slot] = i
                first[i] = i
                break
            if bits[other, 0] == bits[i, 0] and bits[other, 1] == bits[i, 1] and bits[other, 2] == bits[i, 2]:
                first[i] = other
                break
            slot = (slot + 1) & mask


@kernel
def group_corners(first: Int32Array, corners: Int32Array, offsets: Int64Array, members: Int64Array) -> None:
    """List the corners at each position, in their order: a counting sort.

    Shapes  first: (V,) int32. corners: (T, 3) int32. offsets: (V + 1,) int64, zeros before. members: (3 T,) int64, written:
            corner 3 t + k is corner k of triangle t, those of position p are members[offsets[p]:offsets[p + 1]].
    Cost    O(V + T).
    """
    for t in range(len(corners)):
        for k in range(3):
            offsets[first[corners[t, k]]] += 1

    # Turn the counts into the ends of the lists, and fill each list from its end.
    total = np.int64(0)
    for p in range(len(offsets)):
        total += offsets[p]
        offsets[p] = total
    for i in range(3 * len(corners) - 1, -1, -1):
        place = first[corners[i // 3, i % 3]]
        offsets[place] -= 1
        members[offsets[place]] = i


@part_kernel
def direction_cell(x: float, y: float, z: float) -> int:
    """Return the number of the direction, out of 6 x 16 x 16, that a vector points along: its square on the faces of a cube.

    Needs   a vector that is not zero.
    """
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, u, v = (0 if x > 0.0 else 1), y / ax, z / ax
    elif ay >= az:
        face, u, v = (2 if y > 0.0 else 3), x / ay, z / ay
    else:
        face, u, v = (4 if z > 0.0 else 5), x / az, y / az
    column = min(int((u + 1.0) * (_SIDE / 2)), _SIDE - 1)
    row = min(int((v + 1.0) * (_SIDE / 2)), _SIDE - 1)
    return (face * _SIDE + row) * _SIDE + column


@part_kernel
def gather_directions(
    start: int, end: int, members: Int64Array, faces: Int32Array, units: Float64Array, angles: Float64Array, cells: Float64Array
) -> int:
    """Add up the weighted normals of some corners by direction; return how many directions there are.

    Shapes  members[start:end]: the corners. faces: (T,). units: (F, 3). angles: (T, 3). cells: (1536, 4) float64, written: the
            sum of each direction that occurs, closed up, and its number.
    Needs   units of length one or zero.
    Cost    O(corners + 1536).
    """
    for cell in range(len(cells)):
        for axis in range(4):
            cells[cell, axis] = 0.0
    for i in range(start, end):
        t, k = members[i] // 3, members[i] % 3
        f = faces[t]
        if units[f, 0] != 0.0 or units[f, 1] != 0.0 or units[f, 2] != 0.0:
            cell = direction_cell(units[f, 0], units[f, 1], units[f, 2])
            for axis in range(3):
                cells[cell, axis] += angles[t, k] * units[f, axis]
            cells[cell, 3] = 1.0

    # Close up the directions that occur.
    count = 0
    for cell in range(len(cells)):
        if cells[cell, 3] > 0.0:
            for axis in range(3):
                cells[count, axis] = cells[cell, axis]
            cells[count, 3] = cell + 1.0
            count += 1
    return count


@kernel
def sum_corners(
    offsets: Int64Array,
    members: Int64Array,
    faces: Int32Array,
    units: Float64Array,
    angles: Float64Array,
    least_cosine: float,
    cells: Float64Array,
    normals: Float32Array,
) -> None:
    """Sum the normals around each position that lie within the crease angle of each corner's own.

    Shapes  offsets: (V + 1,). members: (3 T,). faces: (T,). units: (F, 3). angles: (T, 3). cells: (1536, 4), room.
            normals: (T, 3, 3) float32, written.
    Rule    a face shares a normal with itself, and with faces whose cosine to it is above least_cosine.
    Needs   units of length one or zero.
    Cost    O(corners x corners at a position), 64 at most, or 1536 directions.
    """
    for p in range(len(offsets) - 1):
        start, end = offsets[p], offsets[p + 1]
        many = end - start > _MANY
        count = gather_directions(start, end, members, faces, units, angles, cells) if many else 0
        for i in range(start, end):
            t, k = members[i] // 3, members[i] % 3
            f = faces[t]
            ux, uy, uz = units[f, 0], units[f, 1], units[f, 2]
            x, y, z = 0.0, 0.0, 0.0

            # Add the directions near the own one.
            if many and (ux != 0.0 or uy != 0.0 or uz != 0.0):
                own = direction_cell(ux, uy, uz) + 1.0
                for cell in range(count):
                    cx, cy, cz = cells[cell, 0], cells[cell, 1], cells[cell, 2]
                    length = np.sqrt(cx * cx + cy * cy + cz * cz)
                    if cells[cell, 3] == own or cx * ux + cy * uy + cz * uz > least_cosine * length:
                        x, y, z = x + cx, y + cy, z + cz

            # Or add the faces near the own one.
            for j in range(start, start if many else end):
                s = members[j] // 3
                g = faces[s]
                if g == f or units[g, 0] * ux + units[g, 1] * uy + units[g, 2] * uz > least_cosine:
                    weight = angles[s, members[j] % 3]
                    x, y, z = x + weight * units[g, 0], y + weight * units[g, 1], z + weight * units[g, 2]

            # Scale to length one; fall back to the face where the sum cancels out.
            length = np.sqrt(x * x + y * y + z * z)
            if length > 1e-9:
                x, y, z = x / length, y / length, z / length
            else:
                x, y, z = ux, uy, uz
            normals[t, k, 0], normals[t, k, 1], normals[t, k, 2] = x, y, z
