"""Mesh: triangles with the faces they came from and what is known at their vertices and corners.

Everything is checked here, once, so that no later stage has to: a Mesh that exists can be drawn. A polygon with more than three
corners is cut into triangles that share its number (`source`), and the cuts are marked (`inner`), so that a picture can show
and name whole faces. A Mesh owns its arrays, and they are read-only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array, as_colors, as_floats, as_indices, as_integers, in_layout, own, quote_row
from scanspan.assets.faces import cut_faces
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import finite_number

NONFINITE = ("error", "drop")
"""What may be done with a vertex that is used and not finite."""

WIDTHS = {"normal": ((3,), np.float32), "uv": ((2,), np.float64)}
"""Columns and type of the attributes that shading knows by name; "color" has rules of its own."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Mesh:
    """Triangles in space.

    Parameters
    ----------
    positions : (V, 3), any type of number, kept as float64.
    triangles : (T, 3), whole numbers, vertices of each triangle; counter-clockwise is the front. No triangle at all is legal.
    source : (T,), the face of each triangle, non-decreasing; by default every triangle is a face.
    attributes : values per vertex, name to (V, k). Known names: "normal" (V, 3) kept as float32, (0, 0, 0) where there is none;
        "uv" (V, 2) kept as float64, origin bottom-left; "color" (V, 3) or (V, 4), integers 0..255 or floats 0..1, sRGB,
        straight alpha.
    corners : the same per corner of each triangle, name to (T, 3, k); wins over an attribute of the same name.
    inner : (T,) uint8, bit i set: the edge opposite corner i was made by cutting a face and is no edge of it.
    face_count : faces in all, those without a triangle too; by default as many as `source` names.
    nonfinite : "error" raises for a vertex that is used and not finite; "drop" leaves out the faces that use it, and the others
        keep their numbers.

    Raises
    ------
    InputError : a shape, a type, an index or a number that cannot be used; it is quoted.

    Examples
    --------
    >>> mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> mesh
    Mesh(3 vertices, 1 triangle, 1 face)
    >>> mesh.bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """

    positions: NDArray[np.float64]
    triangles: NDArray[np.int32]
    source: NDArray[np.int32]
    attributes: Mapping[str, NDArray[Any]]
    corners: Mapping[str, NDArray[Any]]
    inner: NDArray[np.uint8]
    face_count: int
    crease_angle: float | None

    def __init__(
        self,
        positions: ArrayLike,
        triangles: ArrayLike,
        source: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
        corners: Mapping[str, ArrayLike] | None = None,
        inner: ArrayLike | None = None,
        *,
        face_count: int | None = None,
        nonfinite: str = "error",
        crease_angle: float | None = None,
    ) -> None:
        if nonfinite not in NONFINITE:
            raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
        points = as_floats(positions, 3, "positions")
        indices = as_indices(triangles, 3, len(points), "triangles")
        faces = _as_source(source, len(indices))
        per_vertex = {name: _as_values(v, (len(points),), name, "attributes") for name, v in (attributes or {}).items()}
        per_corner = {name: _as_values(v, (len(indices), 3), name, "corners") for name, v in (corners or {}).items()}
        cuts = _as_inner(inner, len(indices))
        total = _as_face_count(face_count, faces)
        crease = None if crease_angle is None else _as_crease_angle(crease_angle)

        # Find the triangles that use a vertex which is not finite, and quote the first or leave their faces out.
        are_finite = np.isfinite(points)
        if not are_finite.all():
            finite = are_finite.all(axis=1)
            bad = ~finite[indices].all(axis=1)
            if bad.any() and nonfinite == "error":
                vertex = next(v for v in indices[np.argmax(bad)].tolist() if not finite[v])
                raise InputError(f"{quote_row(points, 'positions', vertex)}: a vertex that is used is not finite")
            if bad.any():
                keep = ~np.isin(faces, faces[bad])
                indices, faces, cuts = indices[keep], faces[keep], cuts[keep]
                per_corner = {name: values[keep] for name, values in per_corner.items()}

        # Keep what has been checked, as read-only arrays of its own: what changed later would reach the kernels unchecked.
        self._keep(points, indices, faces, cuts, total, per_vertex, per_corner, crease)

    def _keep(
        self, points: NDArray[np.float64], indices: NDArray[np.int32], faces: NDArray[np.int32], cuts: NDArray[np.uint8],
        total: int, per_vertex: Mapping[str, NDArray[Any]], per_corner: Mapping[str, NDArray[Any]],
        crease_angle: float | None,
    ) -> None:  # fmt: skip
        """Become the mesh of arrays that are as they must be."""
        self.__dict__.update(
            positions=own(points),
            triangles=own(indices),
            source=own(faces),
            attributes=MappingProxyType({name: own(values) for name, values in per_vertex.items()}),
            corners=MappingProxyType({name: own(values) for name, values in per_corner.items()}),
            inner=own(cuts),
            face_count=total,
            crease_angle=crease_angle,
        )

    @classmethod
    def from_checked(
        cls, positions: NDArray[np.float64], triangles: NDArray[np.int32], source: NDArray[np.int32], inner: NDArray[np.uint8],
        face_count: int,
    ) -> Mesh:  # fmt: skip
        """Build a mesh from arrays that the package itself has made, which are kept as they are and checked no more."""
        mesh = cls.__new__(cls)
        for array in (positions, triangles, source, inner):
            array.flags.writeable = False
        mesh._keep(positions, triangles, source, inner, face_count, {}, {}, None)
        return mesh

    @classmethod
    def from_polygons(
        cls,
        positions: ArrayLike,
        faces: Sequence[Sequence[int]] | ArrayLike,
        attributes: Mapping[str, ArrayLike] | None = None,
        corners: Mapping[str, ArrayLike] | None = None,
        *,
        nonfinite: str = "error",
    ) -> Mesh:
        """Build a mesh from faces with any number of corners, convex or concave.

        Parameters
        ----------
        positions : (V, 3), as for Mesh.
        faces : sequences of vertex numbers, or an array (F, k). Faces of fewer than three corners draw nothing and keep their
            number.
        attributes : values per vertex, name to (V, k).
        corners : values per corner of each face, all faces one after the other: name to (number of corners in all, k).
        nonfinite : as for Mesh.

        Raises
        ------
        InputError : a face names a vertex that does not exist, or as for Mesh.

        Examples
        --------
        >>> mesh = Mesh.from_polygons([(0, 0, 0), (4, 2, 0), (0, 4, 0), (1, 2, 0)], [(0, 1, 2, 3)])
        >>> mesh.triangles.tolist(), mesh.source.tolist()
        ([[0, 1, 3], [1, 2, 3]], [0, 0])
        """
        points = as_floats(positions, 3, "positions")
        indices, counts = _flatten(faces)
        _check_faces(indices, counts, len(points))
        return cls.from_flat(points, indices, counts, attributes, corners, nonfinite=nonfinite)

    @classmethod
    def from_flat(
        cls,
        positions: ArrayLike,
        indices: NDArray[np.int64],
        counts: NDArray[np.int64],
        attributes: Mapping[str, ArrayLike] | None = None,
        corners: Mapping[str, ArrayLike] | None = None,
        *,
        nonfinite: str = "error",
        crease_angle: float | None = None,
    ) -> Mesh:
        """Build a mesh from faces given as one flat array of vertices in range, and the number of corners of each face."""
        points = as_floats(positions, 3, "positions")
        cut = cut_faces(points, indices, counts)
        per_corner: dict[str, ArrayLike] = {}
        for name, values in (corners or {}).items():
            flat = _as_values(values, (len(indices),), name, "corners")
            per_corner[name] = flat[cut.corner]
        triangles = indices[cut.corner]
        return cls(
            points, triangles, cut.source, attributes, per_corner, cut.inner,
            face_count=len(counts), nonfinite=nonfinite, crease_angle=crease_angle,
        )  # fmt: skip

    @classmethod
    def from_trimesh(cls, mesh: Any, *, nonfinite: str = "error") -> Mesh:
        """Build a mesh from an object that has `vertices` and `faces`, such as a trimesh.Trimesh.

        Normals that the object has stored (not ones it would have to compute), texture coordinates and colours are taken over.

        Raises
        ------
        InputError : the object has no vertices or faces, or as for Mesh.
        """
        if not hasattr(mesh, "vertices") or not hasattr(mesh, "faces"):
            raise InputError(f"mesh: expected an object with vertices and faces, got {type(mesh).__name__}")
        from scanspan.assets.formats.foreign import trimesh_values

        attributes, corners = trimesh_values(mesh)
        return cls(mesh.vertices, mesh.faces, attributes=attributes, corners=corners, nonfinite=nonfinite)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy in another process needs; the read-only views of the dictionaries cannot be sent."""
        return self.__dict__ | {"attributes": dict(self.attributes), "corners": dict(self.corners)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Become the copy."""
        views = {name: MappingProxyType(state[name]) for name in ("attributes", "corners")}
        self.__dict__.update(state | views)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest x, y, z of the vertices that are used, (2, 3) float64; NaN when there is no triangle."""
        return bounds_of(self.positions, self.triangles)

    def __repr__(self) -> str:
        counts = ((len(self.positions), "vertex"), (len(self.triangles), "triangle"), (self.face_count, "face"))
        plural = {"vertex": "vertices", "triangle": "triangles", "face": "faces"}
        return f"Mesh({', '.join(f'{n:,} {word if n == 1 else plural[word]}' for n, word in counts)})"


def bounds_of(positions: NDArray[np.float64], indices: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the lowest and highest coordinates of the positions that are indexed, (2, 3); NaN when there are none."""
    if not indices.size:
        return np.full((2, 3), np.nan)
    used = np.zeros(len(positions), dtype=bool)
    used[indices.reshape(-1)] = True
    chosen = positions if used.all() else positions[used]
    return np.stack([chosen.min(axis=0), chosen.max(axis=0)])


def _as_source(source: ArrayLike | None, triangle_count: int) -> NDArray[np.int32]:
    """Return the face of each triangle, checked: one for each, not negative, non-decreasing."""
    if source is None:
        return np.arange(triangle_count, dtype=np.int32)
    faces = as_integers(source, "source")
    if faces.shape != (triangle_count,):
        raise InputError(f"source: expected shape ({triangle_count},), one face for each triangle, got {faces.shape}")
    if len(faces) and (faces[0] < 0 or faces[-1] >= 2**31):
        raise InputError(f"source: faces are numbered 0 to 2^31 - 1, got {faces[0]} to {faces[-1]}")
    falls = np.flatnonzero(np.diff(faces) < 0)
    if len(falls):
        i = int(falls[0]) + 1
        raise InputError(f"source[{i}] = {faces[i]}: expected non-decreasing faces, the one before is {faces[i - 1]}")
    checked: NDArray[np.int32] = in_layout(faces, np.int32)
    return checked


def _as_inner(inner: ArrayLike | None, triangle_count: int) -> NDArray[np.uint8]:
    """Return the marks of inner edges, 0..7 for each triangle."""
    if inner is None:
        return np.zeros(triangle_count, dtype=np.uint8)
    marks = as_integers(inner, "inner")
    if marks.shape != (triangle_count,):
        raise InputError(f"inner: expected shape ({triangle_count},), one mark for each triangle, got {marks.shape}")
    bad = np.flatnonzero((marks < 0) | (marks > 7))
    if len(bad):
        raise InputError(f"inner[{bad[0]}] = {marks[bad[0]]}: expected three bits, 0..7")
    checked: NDArray[np.uint8] = in_layout(marks, np.uint8)
    return checked


def _as_face_count(face_count: int | None, source: NDArray[np.int32]) -> int:
    """Return the number of faces, at least one more than the last face that has a triangle."""
    named = int(source[-1]) + 1 if len(source) else 0
    if face_count is None:
        return named
    if isinstance(face_count, bool) or not isinstance(face_count, (int, np.integer)) or not named <= face_count < 2**31:
        raise InputError(f"face_count = {face_count!r}: expected a whole number, at least {named}, which is what source names")
    return int(face_count)


def _as_crease_angle(crease_angle: float) -> float:
    """Return a crease angle in degrees, 0 to 180."""
    angle = finite_number("crease_angle", crease_angle)
    if not 0.0 <= angle <= 180.0:
        raise InputError(f"crease_angle = {crease_angle!r}: expected degrees from 0 to 180")
    return angle


def _as_values(values: ArrayLike, leading: tuple[int, ...], name: str, kind: str) -> NDArray[Any]:
    """Return the values of one attribute, (*leading, k), in the type that its name has; a missing last axis is k = 1."""
    label = f"{kind}[{name!r}]"
    if not isinstance(name, str) or not name:
        raise InputError(f"{kind}: expected names that are text, got {name!r}")
    array = as_array(values, label)
    if array.shape == leading:
        array = array[..., None]
    shape = ", ".join(str(n) for n in leading)
    if array.ndim != len(leading) + 1 or array.shape[:-1] != leading:
        raise InputError(f"{label}: expected shape ({shape}, k), got {array.shape}")
    if name == "color":
        if array.shape[-1] not in (3, 4):
            raise InputError(f"{label}: expected shape ({shape}, 3) or ({shape}, 4), got {array.shape}")
        flat = as_colors(array.reshape(-1, array.shape[-1]), [int(np.prod(leading))], label)
        return flat.reshape(*leading, 4)
    if name in WIDTHS:
        widths, dtype = WIDTHS[name]
        if array.shape[-1] not in widths:
            raise InputError(f"{label}: expected shape ({shape}, {widths[0]}), got {array.shape}")
        with np.errstate(over="ignore"):
            return in_layout(array, dtype)
    return in_layout(array, array.dtype.newbyteorder("="))


def _flatten(faces: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of all faces one after the other, and the number of corners of each."""
    if isinstance(faces, np.ndarray) and faces.dtype != object:
        array = as_integers(faces, "faces")
        if array.ndim != 2 and array.size:
            raise InputError(f"faces: expected one row of vertices for each face, got shape {array.shape}")
        width = array.shape[1] if array.ndim == 2 else 0
        return array.reshape(-1), np.full(array.shape[0] if array.ndim == 2 else 0, width, dtype=np.int64)
    try:
        rows = [row.tolist() if isinstance(row, np.ndarray) else list(row) for row in faces]
    except TypeError:
        raise InputError(f"faces: expected sequences of vertex numbers, got {str(faces)[:60]}") from None
    counts = np.array([len(row) for row in rows], dtype=np.int64)
    flat = list(chain.from_iterable(rows))
    for number, row in enumerate(rows):
        if not all(isinstance(v, (int, float, np.integer, np.floating)) and not isinstance(v, bool) for v in row):
            raise InputError(f"faces[{number}] = {str(tuple(row))[:60]}: expected vertex numbers")
        if not all(v == v and abs(v) < 2**63 and v == int(v) for v in row):
            raise InputError(f"faces[{number}] = {str(tuple(row))[:60]}: expected whole numbers")
    return np.array([int(v) for v in flat], dtype=np.int64), counts


def _check_faces(indices: NDArray[np.int64], counts: NDArray[np.int64], vertex_count: int) -> None:
    """Raise for the first face with a vertex that does not exist, and quote the face."""
    if not indices.size or (int(indices.min()) >= 0 and int(indices.max()) < vertex_count):
        return
    first = int(np.argmax((indices < 0) | (indices >= vertex_count)))
    ends = np.cumsum(counts)
    number = int(np.searchsorted(ends, first, side="right"))
    row = indices[ends[number] - counts[number] : ends[number]].tolist()
    shown = ", ".join(str(v) for v in row[:8]) + (", ..." if len(row) > 8 else "")
    raise InputError(f"faces[{number}] = ({shown}): vertex {indices[first]} does not exist, there are {vertex_count}")
