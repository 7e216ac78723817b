"""Splats as whole numbers: how a block of up to 256 is quantised, and what its numbers mean.

A place is a multiple of the block's step from the block's low corner, both whole numbers of the lattice that the whole tree
shares: so the corner of a child is an exact number of steps from that of its parent, a child is quantised against its parent
as decoded, and errors cannot add up. A radius is a share of the largest of the block, rounded up after the error of the place
was added, so that decoded balls hold the true ones. A normal is a place on an octahedron, 7 bits a side, with two bits for its
cone.

The step is a hundredth of the mean radius of the splats that stand for those of the block, or that of the lattice if larger.
The classic format rounds to thirteenths of the parent's radius, outwards; its mean error is ten times as large as that of this
step, measured on scans, and so is the largest (docs/decisions/0017-trees-of-splats.md).

Source: S. Rusinkiewicz and M. Levoy, QSplat (2000); Q. Meyer et al., On floating-point normal vectors (2010), for octahedra.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scanspan.assets.splats.merge import (
    COSINE,
    NO_CONE,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    RADIUS,
    SLACK,
    X,
    Z,
    cone_cosine,
    covering_radius,
)
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, Float64Array, Int64Array, Integer, UInt8Array

BLOCK = 256  # splats at most
STEPS_IN_RADIUS = 100.0  # of the mean parent
LARGEST = 65535  # steps along an axis of a block
RADIUS_LEVELS = 15  # shares of the largest radius that are told apart; a code is a multiple of 255 / 15
RADIUS_UNIT = 17
SIDE = 127  # steps along a side of the octahedron
# Sine and cosine of the largest angle between a normal and its code, two degrees (in the middle of the eight faces).
NORMAL_SINE, NORMAL_COSINE = 0.0348995, 0.9993908

# Numbers of a block while a tree is built. Whole ones: the low corner and the step on the lattice, how many splats, the first
# of them among those that were made, the height over the leaves, how many children and which.
LOW_X, LOW_Y, LOW_Z, STEP, COUNT, FIRST, HEIGHT, CHILDREN, CHILD = range(9)
WHOLE_COLUMNS = CHILD + 8
# Others: the middle of the box in steps, the radius of the ball around it that holds everything, the largest radius of a splat
# and the bound on the error, in the world; the axis of the cone as -127 to 127, and its sine in parts of 250.
MIDDLE_X, MIDDLE_Y, MIDDLE_Z, SPHERE, LARGEST_RADIUS, ERROR, AXIS_X, AXIS_Y, AXIS_Z, SINE = range(10)
REAL_COLUMNS = 10
AXIS_UNIT = 127.0
SINE_UNIT = 250.0
NO_SINE = 255.0  # of a node of which nothing is known to face away
MANTISSA = 4096.0  # lengths of a node are rounded up to 12 bits, which compress well


class Splats(NamedTuple):
    """N splats as they are stored."""

    positions: Array  # (N, 3) uint16, steps from the low corner of the block
    radius: UInt8Array  # (N,) 255 is the largest of the block
    color: UInt8Array  # (N, 3) sRGB; (0, 3) where the tree has none
    normal: Array  # (N,) uint16: 7 bits u, 7 bits v, 2 bits cone; (0,) where the tree has none


@helper_kernel
def octahedral(nx: float, ny: float, nz: float) -> Integer:
    """Return the 14 bits of a unit normal; (0, 0, 0) has those of (0, 0, 1)."""
    size = abs(nx) + abs(ny) + abs(nz)
    if size == 0.0:
        nz, size = 1.0, 1.0
    u, v = nx / size, ny / size
    if nz < 0.0:
        u, v = (1.0 - abs(v)) * (1.0 if u >= 0.0 else -1.0), (1.0 - abs(u)) * (1.0 if v >= 0.0 else -1.0)
    return np.int64(math.floor((u + 1.0) * (SIDE / 2) + 0.5)) << 7 | np.int64(math.floor((v + 1.0) * (SIDE / 2) + 0.5))


@kernel
def decode_normals(codes: Array, normals: Array) -> None:
    """Write the unit normals (N, 3) of codes (N,) of 16 bits.

    Units       normals: float32 or float64.
    """
    for i in range(len(codes)):
        code = np.int64(codes[i])
        u = (code >> 9) * (2.0 / SIDE) - 1.0
        v = ((code >> 2) & 127) * (2.0 / SIDE) - 1.0
        z = 1.0 - abs(u) - abs(v)
        if z < 0.0:
            u, v = (1.0 - abs(v)) * (1.0 if u >= 0.0 else -1.0), (1.0 - abs(u)) * (1.0 if v >= 0.0 else -1.0)
        length = math.sqrt(u * u + v * v + z * z)
        normals[i, 0], normals[i, 1], normals[i, 2] = u / length, v / length, z / length


@helper_kernel
def cone_bits(cosine: float) -> Integer:
    """Return the two bits of a cone: its sine is at most (1 + bits)^2 / 16; 3 also if there is no cone."""
    if cosine <= 0.0:
        return np.int64(3)
    square = 1.0 - cosine * cosine
    return (
        np.int64(0)
        if square <= 1.0 / 256
        else np.int64(1)
        if square <= 1.0 / 16
        else np.int64(2)
        if square <= 81.0 / 256
        else np.int64(3)
    )


@helper_kernel
def round_up(length: float) -> float:
    """Return the next larger number of 12 bits, or 0."""
    mantissa, exponent = math.frexp(length)
    return math.ldexp(math.ceil(mantissa * MANTISSA) / MANTISSA, exponent)


@kernel
def block_step(
    splats: Float64Array, count: Integer, groups: Int64Array, group_count: Integer, scale: Float64Array, exact: bool
) -> int:
    """Return the step of a block, in steps of the lattice: as its parents' radius says, and so that its extent fits 16 bits."""
    total = 0.0
    for k in range(group_count):
        total += covering_radius(splats, groups[k], groups[k + 1], scale)
    wanted = total / group_count / STEPS_IN_RADIUS / max(scale[0], scale[1], scale[2])
    extent = 0.0
    for axis in range(X, Z + 1):
        low, high = splats[0, axis], splats[0, axis]
        for i in range(1, count):
            low, high = min(low, splats[i, axis]), max(high, splats[i, axis])
        extent = max(extent, math.floor(high) - math.floor(low) + 1.0)
    least = math.ceil(extent / (LARGEST - 1))
    return int(max(least, 1.0 if exact else math.floor(wanted), 1.0))


@kernel
def quantise(
    splats: Float64Array,
    count: Integer,
    step: Integer,
    scale: Float64Array,
    error: float,
    out: Splats,
    first: Integer,
    whole: Int64Array,
    real: Float64Array,
) -> None:
    """Write places, radii and normals of a block, and put its splats where they will be decoded, their radii enlarged likewise.

    Writes      out from `first` on; LOW_X to FIRST of whole, MIDDLE_X to ERROR of real; X to RADIUS of splats.
    Units       error: between the decoded and the true place, in the world.
    """
    whole[STEP], whole[COUNT], whole[FIRST] = step, count, first
    real[ERROR] = round_up(error)
    for axis in range(X, Z + 1):
        low, high = splats[0, axis], splats[0, axis]
        for i in range(1, count):
            low, high = min(low, splats[i, axis]), max(high, splats[i, axis])
        corner = math.floor(low)
        whole[LOW_X + axis] = np.int64(corner)
        for i in range(count):
            steps = math.floor((splats[i, axis] - corner) / step + 0.5)
            out.positions[first + i, axis] = np.uint16(steps)
            splats[i, axis] = corner + steps * step
        real[MIDDLE_X + axis] = math.floor((high - corner) / step * 0.5 + 0.5)

    # Round radii up to a share of the largest.
    largest = 0.0
    for i in range(count):
        largest = max(largest, splats[i, RADIUS])
    largest = round_up((largest + error) * (1.0 + 1e-6))
    real[LARGEST_RADIUS] = largest
    reach = 0.0
    for i in range(count):
        share = math.ceil((splats[i, RADIUS] + error) * SLACK / largest * RADIUS_LEVELS) if largest > 0.0 else 0.0
        out.radius[first + i] = np.uint8(share * RADIUS_UNIT)
        splats[i, RADIUS] = share / RADIUS_LEVELS * largest
        dx = (splats[i, X] - whole[LOW_X] - step * real[MIDDLE_X]) * scale[0]
        dy = (splats[i, X + 1] - whole[LOW_Y] - step * real[MIDDLE_Y]) * scale[1]
        dz = (splats[i, Z] - whole[LOW_Z] - step * real[MIDDLE_Z]) * scale[2]
        reach = max(reach, math.sqrt(dx * dx + dy * dy + dz * dz) + splats[i, RADIUS])
    real[SPHERE] = round_up(reach * (1.0 + 1e-6))


@kernel
def encode_normals(
    splats: Float64Array, count: Integer, normals: Array, first: Integer, real: Float64Array, oriented: bool
) -> None:
    """Write the normals of a block and the cone that holds all below, where the tree has normals.

    Writes      normals from `first` on; AXIS_X to SINE of real.
    """
    real[AXIS_X], real[AXIS_Y], real[AXIS_Z], real[SINE] = 0.0, 0.0, AXIS_UNIT, NO_SINE
    if len(normals) == 0:
        return
    x, y, z = 0.0, 0.0, 0.0
    for i in range(count):
        nx, ny, nz = splats[i, NORMAL_X], splats[i, NORMAL_Y], splats[i, NORMAL_Z]
        normals[first + i] = np.uint16(octahedral(nx, ny, nz) << 2 | cone_bits(splats[i, COSINE]))
        x += nx
        y += ny
        z += nz

    # Round the axis first, so that the cone is around the axis as it is decoded.
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-6 or not oriented:
        return
    x = math.floor(x / length * AXIS_UNIT + 0.5)
    y = math.floor(y / length * AXIS_UNIT + 0.5)
    z = math.floor(z / length * AXIS_UNIT + 0.5)
    length = math.sqrt(x * x + y * y + z * z)
    cosine = cone_cosine(splats, 0, count, x / length, y / length, z / length)
    if cosine == NO_CONE:
        return

    # Widen it by the error of the codes, so that it holds the normals as they are decoded too.
    cosine = cosine * NORMAL_COSINE - math.sqrt(max(1.0 - cosine * cosine, 0.0)) * NORMAL_SINE
    if cosine > 0.0:
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0)) + 1e-6
        real[AXIS_X], real[AXIS_Y], real[AXIS_Z] = x, y, z
        real[SINE] = math.ceil(sine * SINE_UNIT) if sine < 1.0 else NO_SINE
