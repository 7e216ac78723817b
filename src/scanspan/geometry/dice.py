"""Dicing: split the triangles of a mesh until no edge is longer than a few pixels on the screen, and displace what that is.

A surface that is to bend needs vertices where it bends. Reyes bounds a primitive, splits it while it is large on the screen,
and dices what is left into micropolygons, which are then displaced and shaded. Here all of a mesh is split at once, in rounds:
each finds the long edges, and each of those gets a vertex in its middle (subdivide.py).

Whether an edge is split depends on its two ends alone, so that neighbours agree and no crack opens. One with both ends beyond
one border of the picture, behind the near plane or beyond the far one is left alone, which keeps what is not seen coarse. That
would overlook a triangle which reaches into a corner of the view while each of its edges lies beyond a plane, each another: all
edges of such a one are split, for its neighbours too. An edge that crosses the near plane counts by the part in front of it.

Price: some 200 bytes and 1.3 us a triangle of the result, twice as much with a displacement. A sliver n times as long as an
edge may be becomes some n^1.6 triangles, since its diagonals are split too; so a surface that passes through the eye, seen from
its edge, may run into the limit. Only the given camera sees micropolygons: another needs dicing of its own.

Source: Cook, Carpenter and Catmull, The Reyes Image Rendering Architecture, 1987; the lectures' "recursive subdivision of
primitive (micropolygons)".
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.camera import Camera
from scanspan.assets.lens import check_size
from scanspan.assets.mesh import Mesh
from scanspan.errors import InputError, LimitError
from scanspan.geometry.displace import Displacement, check_displacement, displace, displaced_normals, prepare, weld
from scanspan.geometry.subdivide import Surface, close_mesh, halve, open_mesh, split
from scanspan.homogeneous import finite_number, planes_before, quote, transform_points
from scanspan.records import Array, BoolArray, Float64Array, Int32Array

MAX_TRIANGLES = 20_000_000  # by default; up to 400 bytes each while they are made
# The near plane, w > 0, the four borders of clip space, and the far plane.
CLIP_BORDERS = np.array(
    [(0, 0, 1, 1), (0, 0, 0, 1), (1, 0, 0, 1), (-1, 0, 0, 1), (0, 1, 0, 1), (0, -1, 0, 1), (0, 0, -1, 1)], np.float64
)
ROOM = 2.0**-20  # of the distance to the origin; a triangle of that size can be halved some thirty times
REACH_ROUNDS = 4  # times that the view is widened for a function that reaches further than it did where it was asked before
DISPLACED_ROUNDS = 2  # rounds by the lengths of displaced edges: they may be four times as long as those they come from


class View(NamedTuple):
    """Where edges are measured."""

    matrix: Float64Array  # (4, 4) world to clip coordinates
    half_size: tuple[float, float]  # pixels
    planes: Float64Array  # (P, 4) in the world: a point is kept where a x + b y + c z + d >= 0
    reaches: Float64Array  # (P,) what a plane's value changes by in a unit of the world
    pixels: float  # the longest edge that is left
    max_triangles: int


def dice(
    mesh: Mesh,
    camera: Camera,
    size: tuple[int, int],
    *,
    pixels: float = 2.0,
    displacement: Displacement | ArrayLike | None = None,
    max_triangles: int = MAX_TRIANGLES,
) -> Mesh:
    """Split the triangles of a mesh until no edge is longer than a few pixels, and displace its vertices.

    Parameters
    ----------
    mesh : positions are those of the world.
    camera, size : where it will be seen from, and the (width, height) of the picture in pixels.
    pixels : no edge that is in view stays longer than this on the screen.
    displacement : None; a function of positions (n, 3), unit normals (n, 3) and texture coordinates (n, 2), or None where the
        mesh has none, that returns heights along the normals (n,) or offsets (n, 3), in units of the world; or heights (H, W),
        looked up at "uv" as a texture is: bilinear, repeated, row 0 at the top.
    max_triangles : more are refused.

    Returns
    -------
    Mesh : the vertices of the given one come first, with their values bit for bit. Faces keep their numbers (`source`), new
        edges within a triangle are marked (`inner`), and every attribute is carried over: colours as light, in their type,
        other whole numbers as float64. A displaced mesh gets new normals, one a vertex, and a vertex for each texture
        coordinate and normal that its corners had.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.
    LimitError : for more than `max_triangles`.

    Notes
    -----
    The surface that is displaced is the one given, flat between its vertices, with normals interpolated. It is diced,
    displaced, and diced for at most two more rounds by the lengths of its displaced edges; only edges that displacement makes
    more than four times as long stay longer than `pixels`. Vertices on borders of the mesh that lie at one place move as one.

    Examples
    --------
    >>> floor = Mesh([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    >>> camera = Camera.orthographic((0, 0, 5), (0, 0, 0), height=2)
    >>> dice(floor, camera, (16, 16), pixels=3)
    Mesh(81 vertices, 128 triangles, 2 faces)
    >>> bumps = dice(floor, camera, (16, 16), pixels=3, displacement=lambda p, n, uv: 0.25 * p[:, 0])
    >>> bumps.bounds.tolist()
    [[-1.0, -1.0, -0.25], [1.0, 1.0, 0.25]]
    """
    if not isinstance(mesh, Mesh):
        raise InputError(f"mesh: expected a Mesh, got {type(mesh).__name__}")
    if not isinstance(camera, Camera):
        raise InputError(f"camera = {quote(camera)}: expected a Camera")
    view = make_view(camera, check_size(size), pixels, max_triangles)
    if displacement is not None:
        function, reach = check_displacement(displacement, mesh)
    if len(mesh.triangles) == 0:
        return mesh
    check_limit(len(mesh.triangles), view)
    if displacement is None:
        return close_mesh(refine(open_mesh(mesh), view), mesh)
    return dice_displaced(prepare(mesh), view, function, reach)


def make_view(camera: Camera, size: tuple[int, int], pixels: Any, max_triangles: Any) -> View:
    """Return where edges are measured, after checking the two limits."""
    longest = finite_number("pixels", pixels)
    if not longest > 0.0:
        raise InputError(f"pixels = {longest}: expected a length above 0")
    is_whole = isinstance(max_triangles, (int, np.integer)) and not isinstance(max_triangles, bool)
    if not is_whole or not 1 <= max_triangles < 2**31:
        raise InputError(f"max_triangles = {quote(max_triangles)}: expected a whole number, 1 to 2^31 - 1")

    # Bring near, w > 0, the four borders and far from clip coordinates to the world.
    matrix = camera.clip_matrix(size)
    planes = planes_before(matrix, CLIP_BORDERS if camera.has_far else CLIP_BORDERS[:-1])
    reaches = np.array([math.hypot(a, b, c) for a, b, c, _ in planes.tolist()])
    return View(matrix, (size[0] / 2, size[1] / 2), planes, reaches, longest, int(max_triangles))


def check_limit(count: int, view: View) -> None:
    """Raise an error for more triangles than are allowed."""
    if count > view.max_triangles:
        needed = f"at least {count} triangles for edges of {view.pixels} pixels"
        raise LimitError(f"dice: {needed}, the limit is max_triangles={view.max_triangles}")


def count_needed(surface: Surface, view: View) -> int:
    """Return how many triangles there will be at least, so that absurd requests are refused at once.

    What is wholly in view keeps its area on the screen, and three edges of a length enclose sqrt(3) / 4 of its square at most.
    Triangles so small and so far from the origin that they may run out of numbers do not count.
    """
    with np.errstate(all="ignore"):
        corners = surface.positions[surface.triangles]
        inside = (find_outcodes(surface.positions, view, 0.0) == 0)[surface.triangles].all(axis=1)
        inside &= np.ptp(corners, axis=1).max(axis=1) > ROOM * np.abs(corners).max(axis=(1, 2))
        pixel = to_pixels(transform_points(view.matrix, surface.positions), view)
        p, q, r = (pixel[surface.triangles[inside, k]] for k in range(3))
        doubled = (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])
        area = float(np.nansum(np.abs(doubled)) / 2)
        needed = area / (math.sqrt(3) / 4 * view.pixels) / view.pixels if view.pixels > 0 else math.inf
    return int(min(needed * 0.999, 1e18))


def refine(surface: Surface, view: View, reach: float = 0.0) -> Surface:
    """Split edges until none is long, those too that come within reach of the view."""
    check_limit(count_needed(surface, view), view)
    while True:
        marks = find_long_edges(surface.triangles, surface.positions, surface.positions, view, reach)
        if not marks.any():
            return surface
        check_limit(len(marks) + int(marks.sum()), view)
        surface = split(surface, marks)


def dice_displaced(mesh: Mesh, view: View, displacement: Displacement, reach: float) -> Mesh:
    """Dice a mesh with normals, displace it, and dice it further by what it measures then."""
    surface = refine(open_mesh(mesh), view, reach)
    offsets, place = displace(surface, displacement)
    for _ in range(REACH_ROUNDS):
        found = float(np.sqrt((offsets**2).sum(axis=1).max()))
        if found <= reach:
            break
        reach = found
        surface = refine(surface, view, reach)
        offsets, place = displace(surface, displacement)

    # Measure displaced edges; the new vertices lie on the surface as it was, and are displaced from there.
    for _ in range(DISPLACED_ROUNDS):
        marks = find_long_edges(surface.triangles, surface.positions, surface.positions + offsets, view, 0.0)
        if not marks.any():
            break
        check_limit(len(marks) + int(marks.sum()), view)
        surface = split(surface, marks)
        offsets, place = displace(surface, displacement)

    # Shade by the small triangles: rendering would give all those of one face one normal.
    positions = surface.positions + offsets
    diced = close_mesh(surface, mesh)
    attributes = {**diced.attributes, "normal": displaced_normals(positions, surface, place)}
    return Mesh(positions, diced.triangles, diced.source, attributes, diced.corners, diced.inner, face_count=diced.face_count)


def find_long_edges(triangles: Int32Array, positions: Float64Array, seen: Float64Array, view: View, reach: float) -> BoolArray:
    """Mark the edges that are to be split, (T, 3) by the corner opposite.

    Parameters
    ----------
    positions : (V, 3), whose middles become new vertices.
    seen : (V, 3), where they are seen.
    reach : how far beyond the view edges are split as well, in units of the world.
    """
    with np.errstate(all="ignore"):
        clip = transform_points(view.matrix, seen)
        codes = find_outcodes(seen, view, reach)
        marks = np.empty(triangles.shape, bool)
        beyond = np.empty(triangles.shape, bool)
        for k in range(3):
            a, b = triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
            beyond[:, k] = (codes[a] & codes[b]) != 0
            marks[:, k] = ~beyond[:, k] & is_long(clip, a, b, view)

        # Split all edges of a triangle that may be seen although none of them is; its neighbours have to hear of it.
        p, q, r = codes[triangles].T
        around = beyond.all(axis=1) & ((p & q & r) == 0)
        if around.any():
            marks |= share(triangles, positions, around)

        # Leave edges that are so short that, along their longest axis, there is no number in the middle.
        for k in range(3):
            rows = np.flatnonzero(marks[:, k])
            a, b = positions[triangles[rows, (k + 1) % 3]], positions[triangles[rows, (k + 2) % 3]]
            axis = np.argmax(np.abs(a - b), axis=1)[:, None]
            low: Float64Array = np.take_along_axis(a, axis, 1)[:, 0]
            high: Float64Array = np.take_along_axis(b, axis, 1)[:, 0]
            middle = halve(low, high)
            marks[rows, k] = (middle != low) & (middle != high)
    return marks


def find_outcodes(points: Float64Array, view: View, reach: float) -> Array:
    """Return which planes each point lies beyond, by more than the reach: (V,) uint8, a bit a plane."""
    codes = np.zeros(len(points), np.uint8)
    x, y, z = points.T
    for k, (a, b, c, d) in enumerate(view.planes.tolist()):
        beyond = ((x * a + y * b) + z * c) + d < -reach * float(view.reaches[k])
        codes |= beyond.astype(np.uint8) << np.uint8(k)
    return codes


def is_long(clip: Float64Array, a: Int32Array, b: Int32Array, view: View) -> BoolArray:
    """Say which edges from a to b are longer than allowed on the screen; what lies behind the near plane does not count."""
    ahead = (clip[:, 2] + clip[:, 3] >= 0.0) & (clip[:, 3] > 0.0)
    pixel = to_pixels(clip, view)
    across = pixel[a] - pixel[b]
    long: BoolArray = (across[:, 0] ** 2 + across[:, 1] ** 2 > view.pixels**2) & ahead[a] & ahead[b]

    # Cut the edges that cross the near plane, always from the end in front.
    rows = np.flatnonzero(ahead[a] != ahead[b])
    front, back = clip[np.where(ahead[a[rows]], a[rows], b[rows])], clip[np.where(ahead[a[rows]], b[rows], a[rows])]
    here, there = front[:, 2] + front[:, 3], back[:, 2] + back[:, 3]
    cut = front + (here / (here - there))[:, None] * (back - front)
    across = to_pixels(front, view) - to_pixels(cut, view)
    long[rows] = (across[:, 0] ** 2 + across[:, 1] ** 2 > view.pixels**2) & (cut[:, 3] > 0.0)
    return long


def to_pixels(clip: Float64Array, view: View) -> Float64Array:
    """Return where points in front of the eye are on the screen, in pixels from its middle."""
    return clip[:, :2] / clip[:, 3:] * view.half_size


def share(triangles: Int32Array, positions: Float64Array, around: BoolArray) -> BoolArray:
    """Mark the edges of some triangles in all that have them, and in those that have one at the same place."""
    place = weld(positions)
    corners = place[triangles]
    a, b = corners[:, [1, 2, 0]], corners[:, [2, 0, 1]]
    keys = np.minimum(a, b) * len(positions) + np.maximum(a, b)
    found: BoolArray = np.isin(keys, keys[around])
    return found
