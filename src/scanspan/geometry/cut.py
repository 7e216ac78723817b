"""The cut through a tree of splats: which blocks are drawn, so that nothing larger than an error in pixels is missed.

A cut takes exactly one block on every path from the root to a leaf: an antichain that covers every leaf. Going down from the
root, a block is replaced by its children while what they would add could be seen. Blocks that lie outside of the picture, or
that turn away from the eye, are left out with all that is below them.

All splats of a block and of the blocks below it lie in one sphere, and a splat lies within `splat_radius` of what it stands
for. Where (x, y) = (X, Y) / W is the projection in pixels, a step d from p to another point q of the sphere moves the picture
by ((a - x m) . d, (b - y m) . d) / W(q), where a, b and m are the linear parts of X, Y and W, and x, y belong to p. So the norm
of that 2 x 3 matrix, times the radius, over the least W in the sphere bounds the error. The norm at p is the one at the centre
of the sphere and no more than |m| times the distance between the two on the screen; within the picture it is no more than at
its corners, as it is convex. That holds for any projection, off the middle of a picture as in it; parallel rays are m = 0.
Where the sphere reaches behind the eye there is no bound, and the block is replaced.

The price of a bound that holds everywhere: towards the corners of a picture more is drawn than in the middle.

Source: S. Rusinkiewicz and M. Levoy, QSplat (2000), for culling by sphere and cone; the bound is derived here.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Array, BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, Integer, UInt8Array

# How far beyond the border of the picture a sphere must lie to be left out, in pixels: discs are rounded up to whole pixels.
MARGIN = 2.0

ALL_PLANES = 0xFF  # a bit for each plane that is still to be tested
BEHIND = 1e100  # pixels for a length of 1 where the sphere of a node reaches behind the eye: beyond all limits, and yet ordered
BOUNDED = 1e30  # pixels below which an error is one


class NodeColumns(NamedTuple):
    """What the cut needs of the M nodes of a tree, in the tree's own coordinates; the children of a node follow each other."""

    center: Float64Array  # (M, 3) of a sphere around all splats of a node and of all below it
    radius: Float64Array  # (M,) of that sphere
    splat_radius: Float32Array  # (M,) of the largest splat of the node
    cone: Float32Array  # (M, 4) axis and sine of a cone around all normals, the sine above 1 where there is none
    first_child: Int32Array  # (M,)
    children: UInt8Array  # (M,) how many, 0 for a leaf
    splats: Int32Array  # (M,) how many the node itself has


class SplatView(NamedTuple):
    """A camera as seen from a tree: the projection to pixels, the planes of the picture, and the eye."""

    clip: Float64Array  # (4, 4) from the tree's coordinates to clip coordinates
    matrix: Float64Array  # (3, 4) from the tree's coordinates to X, Y and W, with X / W and Y / W in pixels, y down
    planes: Float64Array  # (P, 4) inside is n . p + d >= 0, n of length 1
    eye: Float64Array  # (4,) homogeneous; w = 0 is the direction from what is seen to the eye
    stretch: float  # the largest norm of the projection within the picture
    slope: float  # |m|, how W changes


class Cut(NamedTuple):
    """The blocks to draw."""

    nodes: Int64Array  # (K,) rows of the table of nodes, ascending: coarse ones first, and then along Morton's curve
    errors: Float64Array  # (K,) pixels by which what is below a node may lie beside what is drawn of it, 0 for a leaf
    error: float  # pixels, the largest of these
    splats: int
    visited: int  # how many nodes were looked at


def node_columns(nodes: Array) -> NodeColumns:
    """Return the columns of a table of nodes (assets/splats/tree.py) that a cut needs: 60 bytes a node."""
    cone = np.empty((len(nodes), 4), np.float32)
    cone[:, :3], cone[:, 3] = nodes["cone_axis"], nodes["cone_sine"]
    center, radius = np.ascontiguousarray(nodes["center"], np.float64), np.ascontiguousarray(nodes["radius"], np.float64)
    first, splats = (np.ascontiguousarray(nodes[name], np.int32) for name in ("first_child", "count"))
    splat_radius = np.ascontiguousarray(nodes["splat_radius"], np.float32)
    children = np.ascontiguousarray(nodes["children"], np.uint8)
    return NodeColumns(center, radius, splat_radius, cone, first, children, splats)


def splat_view(camera: Camera, size: tuple[int, int], origin: Any = (0.0, 0.0, 0.0)) -> SplatView:
    """Return a camera as seen from a tree whose coordinates are relative to an origin.

    Parameters
    ----------
    camera : what looks.
    size : (width, height) of the picture in pixels.
    origin : (3,) of the tree in the world.

    >>> view = splat_view(Camera.look_at((0, 0, 5), (0, 0, 0), fov=90), (64, 64))
    >>> view.eye.tolist(), view.matrix[2].tolist()
    ([0.0, 0.0, 5.0, 1.0], [0.0, 0.0, -1.0, 5.0])
    """
    width, height = size
    shift = np.asarray(origin, np.float64)
    x, y, z, w = clip = clip_from(camera, size, shift)
    matrix = np.stack([(w + x) * (width / 2.0), (w - y) * (height / 2.0), w])

    # Bring the planes to length 1, so that they measure distances; what is the same everywhere bounds nothing.
    across, along, _ = matrix
    planes = [
        across + MARGIN * w, (width + MARGIN) * w - across, along + MARGIN * w, (height + MARGIN) * w - along, z + w,
        *([w - z] if camera.has_far else []),
    ]  # fmt: skip
    lengths = [_length(plane[:3]) for plane in planes]
    kept = [plane / length for plane, length in zip(planes, lengths) if length > 0.0]

    # Find the largest norm in the corners, and the eye.
    corners = [(u, v) for u in (-MARGIN, width + MARGIN) for v in (-MARGIN, height + MARGIN)]
    stretch = max(stretch_at(matrix, u, v) for u, v in corners)
    return SplatView(clip, matrix, np.array(kept), _eye(camera, shift), stretch, _length(w[:3]))


def clip_from(camera: Camera, size: tuple[int, int], origin: Float64Array) -> Float64Array:
    """Return the (4, 4) matrix to clip coordinates from places relative to an origin in the world."""
    clip = camera.clip_matrix(size)
    clip[:, 3] += clip[:, 0] * origin[0] + clip[:, 1] * origin[1] + clip[:, 2] * origin[2]
    return clip


def _eye(camera: Camera, shift: Float64Array) -> Float64Array:
    """Return the eye in the tree's coordinates, or the direction towards it where all rays are parallel."""
    if not camera.is_orthographic:
        return np.append(camera.eye - shift, 1.0)

    # A point at the near plane and one behind it that are seen at the same place lie on one ray.
    inverse = np.linalg.inv(camera.clip_matrix((1, 1)))
    away = np.array(inverse[:3, 2]) * float(np.sign(inverse[3, 3]))
    return np.append(away / -_length(away), 0.0)


def _length(vector: Float64Array) -> float:
    """Return the length of a vector of three."""
    return math.hypot(*vector.tolist())


@helper_kernel
def stretch_at(matrix: Float64Array, x: float, y: float) -> float:
    """Return the norm of the projection at a pixel: by how many pixels a step of one moves it, times W."""
    ax, ay, az = matrix[0, 0] - x * matrix[2, 0], matrix[0, 1] - x * matrix[2, 1], matrix[0, 2] - x * matrix[2, 2]
    bx, by, bz = matrix[1, 0] - y * matrix[2, 0], matrix[1, 1] - y * matrix[2, 1], matrix[1, 2] - y * matrix[2, 2]
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    half = (aa - bb) * 0.5
    return float(np.sqrt((aa + bb) * 0.5 + np.sqrt(half * half + ab * ab)))


@kernel
def visit_nodes(
    nodes: NodeColumns, view: SplatView, error: float, turns_away: bool, culls: bool, queue: Int64Array, own: Float64Array,
    above: Float64Array, mask: UInt8Array,
) -> int:  # fmt: skip
    """Go down from the root while a node's error in pixels is above a limit, and return how many nodes were kept.

    Shapes  queue, own, above, mask: (M,), written: the nodes that may be seen, ascending; the error of each, 0 for a leaf; the
            least error of the nodes above it, inf for the root; the planes that may cut its sphere.
    Units   error: pixels. turns_away: whether nodes whose normals all point away from the eye are left out; culls: whether
            those outside of the planes are.
    Needs   at least one node; children that stand after their parent.
    Cost    some 30 ns a node visited.
    """
    kept = np.int64(0)
    visible, planes_left = see_node(nodes, view, np.int64(0), np.uint8(ALL_PLANES), turns_away, culls)
    if visible:
        queue[0], above[0], mask[0] = np.int64(0), np.inf, planes_left
        kept = np.int64(1)

    # Take the nodes in the order in which they came, and put the children of those that are too coarse at the end.
    i = np.int64(0)
    while i < kept:
        node = queue[i]
        if nodes.children[node] == 0:
            own[i] = 0.0
        else:
            x, y, z = nodes.center[node, 0], nodes.center[node, 1], nodes.center[node, 2]
            own[i] = extent_in_sphere(view, x, y, z, nodes.radius[node], np.float64(nodes.splat_radius[node]))
            if own[i] > error:
                first, least = np.int64(nodes.first_child[node]), min(above[i], own[i])
                for child in range(first, first + np.int64(nodes.children[node])):
                    visible, planes_left = see_node(nodes, view, child, mask[i], turns_away, culls)
                    if visible:
                        queue[kept], above[kept], mask[kept] = child, least, planes_left
                        kept += 1
        i += 1
    return int(kept)


@helper_kernel
def see_node(
    nodes: NodeColumns, view: SplatView, node: Integer, mask: Integer | np.uint8, turns_away: bool, culls: bool
) -> tuple[bool, np.uint8]:
    """Say whether a node may be seen, and which planes may still cut what is below it.

    A sphere wholly inside of a plane holds all spheres below it, so that plane is never tested again.
    """
    x, y, z, radius = nodes.center[node, 0], nodes.center[node, 1], nodes.center[node, 2], nodes.radius[node]
    slack = 1e-9 * (abs(x) + abs(y) + abs(z) + radius)
    left = np.int64(mask)
    if culls:
        for p in range(view.planes.shape[0]):
            if left >> p & 1:
                a, b, c, d = view.planes[p, 0], view.planes[p, 1], view.planes[p, 2], view.planes[p, 3]
                distance = a * x + b * y + c * z + d
                if distance < -radius - slack - 1e-9 * abs(d):
                    return False, np.uint8(0)
                if distance > radius + slack + 1e-9 * abs(d):
                    left &= ~(np.int64(1) << p)

    # Leave it out where the angles from the line of sight to the axis, and of the cone, stay below a right angle together, by
    # more than the sphere is wide.
    sine = np.float64(nodes.cone[node, 3])
    if turns_away and sine < 1.0:
        w = view.eye[3]
        vx, vy, vz = x * w - view.eye[0], y * w - view.eye[1], z * w - view.eye[2]
        along = vx * nodes.cone[node, 0] + vy * nodes.cone[node, 1] + vz * nodes.cone[node, 2]
        across = np.sqrt(max(vx * vx + vy * vy + vz * vz - along * along, 0.0))
        if along * np.sqrt(1.0 - sine * sine) - across * sine > radius * w + slack + 1e-6 * (abs(along) + across):
            return False, np.uint8(0)
    return True, np.uint8(left)


@helper_kernel
def extent_in_sphere(view: SplatView, x: float, y: float, z: float, radius: float, length: float) -> float:
    """Return how many pixels a length in a sphere has at most; past all limits where there is no bound."""
    m = view.matrix
    w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
    least = w - view.slope * radius
    if not least > 0.0:
        return float(BEHIND * length)
    u = (m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]) / w
    v = (m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]) / w
    stretch = stretch_at(m, u, v)
    stretch += view.slope * (stretch * radius / least)
    return float(min(stretch, view.stretch) * length / least)


@kernel
def largest_gap(
    view: SplatView, center: Float64Array, radius: Float64Array, low: Float64Array, step: Float64Array, blocks: Int64Array,
    positions: Array, orders: Array, stride: int,
) -> float:  # fmt: skip
    """Return how many pixels a splat may lie from one of the same block that is drawn, where every `stride`th is.

    Shapes  center, low, step: (K, 3); radius: (K,); blocks: (K, 3) first splat, how many are drawn, how many there are;
            positions: (N, 3); orders: (BLOCK + 1, BLOCK) the place along the curve of each splat in its block.
    """
    most = 0.0
    for b in range(blocks.shape[0]):
        start, drawn, count = blocks[b, 0], blocks[b, 1], blocks[b, 2]
        longest = 0.0
        for i in range(drawn, count):
            # Those that are drawn come first, in their own order, so the place of the one before this one tells its own.
            k, q = np.uint64(start + i), np.uint64(start + np.int64(orders[count, i]) // stride)
            dx = (np.float64(positions[k, 0]) - np.float64(positions[q, 0])) * step[b, 0]
            dy = (np.float64(positions[k, 1]) - np.float64(positions[q, 1])) * step[b, 1]
            dz = (np.float64(positions[k, 2]) - np.float64(positions[q, 2])) * step[b, 2]
            longest = max(longest, dx * dx + dy * dy + dz * dz)
        x, y, z = center[b, 0], center[b, 1], center[b, 2]
        most = max(most, extent_in_sphere(view, x, y, z, radius[b], np.sqrt(longest)))
    return most


def cut_tree(
    nodes: NodeColumns, view: SplatView, error: float, budget: int | None = None, *, turns_away: bool = False,
    culls: bool = True,
) -> Cut:  # fmt: skip
    """Return the blocks to draw.

    Parameters
    ----------
    nodes : the tree.
    view : from where it is seen.
    error : pixels by which what is drawn may be off at most; 0 goes down to the leaves.
    budget : most splats to draw: the error is raised until they are no more; at least as many as the root has. The same tree
        and view always give the same cut.
    turns_away : whether blocks whose normals all point away from the eye are left out; right for closed surfaces alone.
    culls : whether blocks outside of the picture are left out.
    """
    total = len(nodes.splats)
    queue, mask = np.empty(total, np.int64), np.empty(total, np.uint8)
    own, above = np.empty(total), np.empty(total)
    visited = int(visit_nodes(nodes, view, float(error), turns_away, culls, queue, own, above, mask)) if total else 0
    queue, own, above = queue[:visited], own[:visited], above[:visited]
    counts = nodes.splats[queue].astype(np.int64)
    limit = float(error)
    drawn = own <= limit
    if budget is not None and int(counts[drawn].sum()) > budget:
        limit = raise_error(np.minimum(own, above), above, counts, limit, budget)
        drawn = is_in_cut(np.minimum(own, above), above, limit)
    errors = np.where(own[drawn] < BOUNDED, own[drawn], np.inf)
    reached = float(errors.max()) if len(errors) else 0.0
    return Cut(queue[drawn], errors, reached, int(counts[drawn].sum()), visited)


def is_in_cut(least: Float64Array, above: Float64Array, limit: float) -> BoolArray:
    """Say which nodes are drawn at an error: no more than that is missed below them, and more than that above them."""
    return np.asarray((least <= limit) & (above > limit))


def raise_error(least: Float64Array, above: Float64Array, counts: Int64Array, error: float, budget: int) -> float:
    """Return the least error, no less than the one given, at which no more splats than the budget are drawn.

    A node is drawn from the error above it, which is left out, down to its own; so between errors that occur nothing changes.
    """
    steps, place = np.unique(np.concatenate([least, above, [error]]), return_inverse=True)
    change = np.zeros(len(steps), np.int64)
    np.add.at(change, place[: len(least)], counts)
    np.subtract.at(change, place[len(least) : 2 * len(least)], counts)
    fits = (np.cumsum(change) <= budget) & (steps >= error)
    return float(steps[np.flatnonzero(fits)[0]])


@kernel
def write_stretch(
    matrix: Float64Array, most: float, slope: float, center: Float64Array, radius: Float64Array, stretch: Float64Array
) -> None:
    """Write the norm of the projection in the middle of some spheres, (n,); the largest of the picture where it is unknown."""
    for i in range(len(radius)):
        x, y, z = center[i, 0], center[i, 1], center[i, 2]
        w = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
        stretch[i] = most
        if w > slope * radius[i]:
            u = (matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]) / w
            v = (matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]) / w
            stretch[i] = min(stretch_at(matrix, u, v), most)


def stretch_of_nodes(view: SplatView, center: Float64Array, radius: Float64Array) -> Float64Array:
    """Return by how many pixels a step of one in the middle of some spheres moves the picture, times W, (n,)."""
    stretch = np.empty(len(radius))
    write_stretch(
        view.matrix, view.stretch, view.slope, np.ascontiguousarray(center), np.ascontiguousarray(radius, np.float64), stretch
    )
    return stretch
