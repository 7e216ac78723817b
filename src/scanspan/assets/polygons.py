"""Polygons in space: flat, with any number of rings, drawn as they are and not as triangles.

A polygon lies in one plane, so three of its points say how deep it is everywhere; they are chosen far apart, by a quick search,
because rounding is magnified where they nearly lie on a line. A polygon of one ring that does not lie in a plane is cut into
triangles, which do. Price: they are those of its outline seen along one axis, and another cut would bend another way.

All polygons are kept in one list of points, one list of rings and one of polygons, and are measured all at once.

Source: Newell's method for normals (Sutherland, Sproull and Schumacker 1974, appendix).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_colors, as_floats, own, quote_row
from scanspan.assets.mesh import NONFINITE, bounds_of
from scanspan.assets.rings import FILL_RULES
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.triangulation import triangulate_polygon

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

SPATIAL_RULES = FILL_RULES[:2]  # of polygons in space, which have no sides that are theirs alone
"""What is inside where rings cross or lie in each other, in the order of the constants of raster/polygon.py."""

MAX_POINTS = (1 << 31) - 1  # points and rings are numbered in 32 bits

NO_AREA = 1e-12
"""A polygon whose points lie this near to one line has no area, as a share of its size; rounding makes less."""

CANCELLED = 1e-3
"""Below this share of the area of its reference corners a ring's area says little of its plane, as in a figure of eight."""

DEEPEST = 5  # lists in lists in lists: deeper than any polygons are


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Polygons:
    """Planar polygons in space: convex or concave, with holes, or crossing themselves.

    Parameters
    ----------
    rings : a list of polygons. A polygon is one ring, or a list of rings in any order, as the fill rule decides what is inside.
        A ring is (M, 3), or (M, 2) with z = 0; its first point may be repeated at its end. A single list of points is one
        ring. Rings of fewer than three points, and polygons without area, are left out; the others keep their numbers.
    colors : None for the material's colour, (4,) for all or (P, 4) for each polygon as given. Integers 0..255 or floats 0..1,
        sRGB, straight alpha; a missing alpha is opaque.
    fill_rule : "even-odd" or "non-zero".
    nonfinite : "error" raises for a point that is not finite; "drop" leaves out the polygons that have one.
    tolerance : how far a polygon's points may lie from its plane, as a share of its extent. A polygon of one ring that is less
        flat is cut into triangles, which share its number.

    Attributes
    ----------
    positions : (V, 3) float64, the points of all rings in order.
    ring_starts : (R + 1,) int32, ring r is positions ring_starts[r] to ring_starts[r + 1].
    polygon_rings : (P + 1,) int32, polygon p has the rings polygon_rings[p] to polygon_rings[p + 1].
    source : (P,) int32, the number of each polygon as given.
    reference : (P, 3) int32, three of its positions that span its plane well, in the direction of its normal.
    colors : None, (4,) or (count, 4), by source.
    count : how many polygons were given.

    Raises
    ------
    InputError : a shape, a type or a number that cannot be used, or a polygon of several rings that is not flat; it is quoted.
    LimitError : more points than can be numbered.

    Examples
    --------
    A square with a hole, and a triangle:

    >>> square, hole = [(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (1, 2), (2, 2)]
    >>> polygons = Polygons([[square, hole], [(0, 0, 1), (4, 0, 1), (0, 4, 1)]])
    >>> polygons
    Polygons(2 polygons, 3 rings, 10 points)
    >>> polygons.normals.tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    """

    positions: Floats
    ring_starts: NDArray[np.int32]
    polygon_rings: NDArray[np.int32]
    source: NDArray[np.int32]
    reference: NDArray[np.int32]
    colors: NDArray[Any] | None
    fill_rule: str
    count: int

    def __init__(
        self,
        rings: Any,
        *,
        colors: ArrayLike | None = None,
        fill_rule: str = "even-odd",
        nonfinite: str = "error",
        tolerance: float = 1e-6,
    ) -> None:
        if fill_rule not in SPATIAL_RULES:
            raise unknown_name("fill rule", fill_rule, SPATIAL_RULES)
        if nonfinite not in NONFINITE:
            raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
        share = _as_tolerance(tolerance)
        polygons = _read_polygons(rings, nonfinite)
        palette = None if colors is None else as_colors(colors, (len(polygons),), "colors")

        # Cut what is not flat, and leave out what has no area.
        outlines = _join([(number, polygon) for number, polygon in enumerate(polygons) if polygon])
        outlines = _flatten_bent(outlines, share)
        planes = _find_planes(outlines)
        if not np.all(planes.has_area):
            outlines = _select(outlines, planes.has_area)
            planes = _find_planes(outlines)

        object.__setattr__(self, "positions", own(outlines.points))
        object.__setattr__(self, "ring_starts", own(outlines.ring_starts.astype(np.int32)))
        object.__setattr__(self, "polygon_rings", own(outlines.polygon_rings.astype(np.int32)))
        object.__setattr__(self, "source", own(outlines.source.astype(np.int32)))
        object.__setattr__(self, "reference", own(planes.reference.astype(np.int32)))
        object.__setattr__(self, "colors", None if palette is None else own(palette))
        object.__setattr__(self, "fill_rule", str(fill_rule))
        object.__setattr__(self, "count", len(polygons))

    @property
    def bounds(self) -> Floats:
        """Lowest and highest x, y, z, (2, 3) float64; NaN when there is no polygon."""
        return bounds_of(self.positions, np.arange(len(self.positions), dtype=np.int32))

    @property
    def normals(self) -> Floats:
        """Unit normals of the planes, (P, 3) float64, right-handed: a polygon turns left when its normal points at the eye.

        The ring of largest area decides. Where it cancels itself out, as a figure of eight does, the reference corners do.
        """
        starts, rings = self.ring_starts.astype(np.int64), self.polygon_rings.astype(np.int64)
        return _find_planes(_Outlines(self.positions, starts, rings, self.source.astype(np.int64))).normal

    def __repr__(self) -> str:
        counts = ((self.count, "polygon"), (len(self.ring_starts) - 1, "ring"), (len(self.positions), "point"))
        return f"Polygons({', '.join(f'{n:,} {word}' + 's' * (n != 1) for n, word in counts)})"


class _Outlines(NamedTuple):
    """Polygons in flat arrays: what Polygons keeps. No ring and no polygon is empty."""

    points: Floats  # (V, 3)
    ring_starts: Indices  # (R + 1,)
    polygon_rings: Indices  # (P + 1,)
    source: Indices  # (P,)


class _Planes(NamedTuple):
    """The planes of polygons."""

    reference: Indices  # (P, 3) points
    normal: Floats  # (P, 3) of length 1, or 0 where there is no area
    has_area: NDArray[np.bool_]  # (P,)
    distance: Floats  # (P,) from the reference corners' plane to the furthest point, as a share of the extent


def _as_tolerance(tolerance: float) -> float:
    """Return the tolerance as a finite number, 0 or more."""
    is_number = isinstance(tolerance, (int, float, np.integer, np.floating)) and not isinstance(tolerance, bool)
    if not is_number or not 0 <= tolerance <= sys.float_info.max:
        raise InputError(f"tolerance = {_quote(tolerance)}: expected a finite number, 0 or more")
    return float(tolerance)


def _quote(value: object) -> str:
    """Return a value as text, shortened; its type where it holds a whole number too long for Python to write out."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        return f"({type(value).__name__})"
    return text if len(text) <= 60 else text[:57] + "..."


def _is_list(value: object) -> bool:
    """Say whether a value is something that polygons may be nested in."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _nesting(value: Any, depth: int = 0) -> int | None:
    """Return how many lists lie around the first number, or None where there is none; no deeper than DEEPEST.

    A point is 1, a ring 2, a list of rings 3, and a list of such polygons 4.
    """
    if isinstance(value, np.ndarray) and value.dtype != object:
        return value.ndim if value.size else None
    if not _is_list(value) or depth == DEEPEST:
        return 0
    for entry in value:
        inner = _nesting(entry, depth + 1)
        if inner is not None:
            return inner + 1
    return None


def _read_polygons(rings: Any, nonfinite: str) -> list[list[Floats]]:
    """Return the rings of each polygon; none for one that is left out."""
    depth = _nesting(rings)
    if not _is_list(rings) or depth not in (None, 2, 3, 4):
        raise InputError(f"rings = {_quote(rings)}: expected a list of polygons, each a ring of points or a list of rings")
    if depth == 2:
        return [_read_polygon([("rings", rings)], nonfinite)]
    polygons = []
    for number, polygon in enumerate(rings):
        name, depth = f"rings[{number}]", _nesting(polygon)
        named = [(name, polygon)]
        if depth == 3:
            named = [(f"{name}[{k}]", ring) for k, ring in enumerate(polygon)]
        elif depth is None:
            named = []
        elif depth != 2:
            raise InputError(f"{name} = {_quote(polygon)}: expected a ring of points or a list of rings")
        polygons.append(_read_polygon(named, nonfinite))
    return polygons


def _read_polygon(named: list[tuple[str, Any]], nonfinite: str) -> list[Floats]:
    """Return the rings of a polygon, given with their names; none when one is not finite and such are dropped."""
    rings = []
    is_finite = True
    for name, values in named:
        if _nesting(values) is None:
            continue
        array = _read_ring(values, name)
        closed = len(array) > 1 and bool(np.all(array[0] == array[-1]))
        array = array[:-1] if closed else array
        if len(array) < 3:
            continue
        good = np.isfinite(array).all(axis=1)
        if not good.all() and nonfinite == "error":
            raise InputError(f"{quote_row(array, name, int(np.argmin(good)))}: a point is not finite")
        is_finite &= bool(good.all())
        rings.append(np.pad(array, ((0, 0), (0, 3 - array.shape[1]))) if array.shape[1] < 3 else array)
    return rings if is_finite else []


def _read_ring(values: Any, name: str) -> Floats:
    """Return one ring as (M, 3) or (M, 2), as given."""
    if not isinstance(values, np.ndarray):
        if _nesting(values) != 2:
            raise InputError(f"{name} = {_quote(values)}: expected a ring of points")
        first = len(values[0]) if _is_list(values[0]) else 0
        for k, point in enumerate(values):
            width = len(point) if _is_list(point) else 0
            if width not in (2, 3):
                raise InputError(f"{name}[{k}] = {_quote(point)}: expected a point of 2 or 3 coordinates")
            if width != first:
                raise InputError(f"{name}[{k}] = {_quote(point)}: expected {first} coordinates, as the ring's first point has")
    ring: Floats = as_floats(values, (3, 2), name)
    return ring


# Flat arrays


def _join(polygons: list[tuple[int, list[Floats]]]) -> _Outlines:
    """Put polygons, each with its number, one after the other."""
    rings = [ring for _, polygon in polygons for ring in polygon]
    lengths = np.array([len(ring) for ring in rings], dtype=np.int64)
    if lengths.sum() > MAX_POINTS:
        raise LimitError(f"rings: {lengths.sum():,} points, at most {MAX_POINTS:,} can be numbered")
    counts = np.array([len(polygon) for _, polygon in polygons], dtype=np.int64)
    points = np.concatenate(rings) if rings else np.empty((0, 3))
    return _Outlines(points, _starts(lengths), _starts(counts), np.array([number for number, _ in polygons], dtype=np.int64))


def _starts(lengths: Indices) -> Indices:
    """Return where runs of given lengths start, and where the last one ends."""
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(lengths)])


def _select(outlines: _Outlines, keep: NDArray[np.bool_]) -> _Outlines:
    """Return the polygons that are to be kept."""
    ring_counts, lengths = np.diff(outlines.polygon_rings), np.diff(outlines.ring_starts)
    keep_ring = np.repeat(keep, ring_counts)
    keep_point = np.repeat(keep_ring, lengths)
    return _Outlines(
        outlines.points[keep_point], _starts(lengths[keep_ring]), _starts(ring_counts[keep]), outlines.source[keep]
    )


def _furthest(values: Floats, starts: Indices) -> Indices:
    """Return, for each run of values, where the first of its greatest is."""
    if len(starts) == 1:
        return np.empty(0, dtype=np.int64)
    greatest = np.repeat(np.maximum.reduceat(values, starts[:-1]), np.diff(starts))
    places = np.where(values == greatest, np.arange(len(values)), len(values))
    return np.asarray(np.minimum.reduceat(places, starts[:-1]), dtype=np.int64)


# Planes


def _find_planes(outlines: _Outlines) -> _Planes:
    """Return the planes of all polygons.

    The reference corners are a polygon's lowest point in (x, y, z), the one furthest from it, and the one furthest from their
    line. So they do not depend on where its rings begin, and equal polygons are equally deep.
    """
    points, ring_starts = outlines.points, outlines.ring_starts
    if not len(outlines.source):
        return _Planes(np.empty((0, 3), np.int64), np.empty((0, 3)), np.empty(0, np.bool_), np.empty(0))
    starts = ring_starts[outlines.polygon_rings]
    begins, owner = starts[:-1], np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0], owner))
    first = order[begins]

    # Measure from that point, in units of the polygon's size, so that no product overflows or vanishes.
    offsets = 0.5 * points - 0.5 * points[first][owner]
    size = np.maximum.reduceat(np.abs(offsets).max(axis=1), begins)
    offsets /= np.where(size > 0, size, 1.0)[owner, None]
    extent = (np.maximum.reduceat(offsets, begins) - np.minimum.reduceat(offsets, begins)).max(axis=1)

    # Find the reference corners and their plane.
    q = order[_furthest(_lengths(offsets)[order], starts)]
    across = np.cross(offsets[q][owner], offsets)
    r = order[_furthest(_lengths(across)[order], starts)]
    twice_area = _lengths(across[r])
    has_area = twice_area > NO_AREA * extent * _lengths(offsets[q])

    # Take out of its normal what rounding put along the line; a thin polygon would seem bent.
    normal, along = _unit(across[r]), _unit(offsets[q])
    normal = _unit(normal - np.einsum("ij,ij->i", normal, along)[:, None] * along)
    distance = np.maximum.reduceat(np.abs(np.einsum("ij,ij->i", offsets, normal[owner])), begins)

    # Take the direction of the ring of largest area, by Newell's method.
    after = np.arange(1, len(points) + 1)
    after[ring_starts[1:] - 1] = ring_starts[:-1]
    areas = np.add.reduceat(np.cross(offsets, offsets[after]), ring_starts[:-1])
    largest = areas[_furthest(_lengths(areas), outlines.polygon_rings)]
    tells = _lengths(largest) > CANCELLED * twice_area
    normal = np.where(tells[:, None], _unit(largest), normal)

    # Turn the reference corners the same way.
    turned = np.einsum("ij,ij->i", across[r], normal) < 0
    reference = np.stack([first, np.where(turned, r, q), np.where(turned, q, r)], axis=1)
    return _Planes(reference, normal, has_area, distance / np.where(extent > 0, extent, 1.0))


def _lengths(vectors: Floats) -> Floats:
    """Return the lengths of vectors (N, 3)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def _unit(vectors: Floats) -> Floats:
    """Return vectors (N, 3) with length 1; 0 stays 0."""
    lengths = _lengths(vectors)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0)[:, None])


def _flatten_bent(outlines: _Outlines, tolerance: float) -> _Outlines:
    """Cut the polygons that are not flat into triangles."""
    planes = _find_planes(outlines)
    ring_counts, lengths = np.diff(outlines.polygon_rings), np.diff(outlines.ring_starts)
    is_triangle = (ring_counts == 1) & (lengths[outlines.polygon_rings[:-1]] == 3)
    bent = planes.has_area & ~is_triangle & (planes.distance > tolerance)
    if not bent.any():
        return outlines
    several = np.flatnonzero(bent & (ring_counts > 1))
    if len(several):
        p = several[0]
        raise InputError(
            f"rings[{outlines.source[p]}]: its {ring_counts[p]} rings do not lie in one plane, a point is "
            f"{planes.distance[p]:.3g} of its extent off, the tolerance is {tolerance:g}; only a polygon of one ring can be cut"
        )

    # Triangulate each along the axis that its normal follows best.
    pieces: list[tuple[int, list[Floats]]] = []
    for p, number in enumerate(outlines.source.tolist()):
        first, last = outlines.polygon_rings[p : p + 2]
        rings = [outlines.points[outlines.ring_starts[r] : outlines.ring_starts[r + 1]] for r in range(first, last)]
        if bent[p]:
            seen = np.delete(rings[0], int(np.argmax(np.abs(planes.normal[p]))), axis=1)
            pieces += [(number, [rings[0][corners]]) for corners in triangulate_polygon(seen)]
        else:
            pieces.append((number, rings))
    return _join(pieces)
