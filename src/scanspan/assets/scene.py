"""Scene: what stands where. Instances put geometry in the world; one mesh may stand in many places.

The order of the instances is the order of everything: primitives are numbered through all of them, and where two lie at the
same depth the lower number is seen.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array
from scanspan.assets.camera import Camera
from scanspan.assets.cloud import PointCloud
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import transform_points

Geometry: TypeAlias = Mesh | Polygons | Segments | Points | PointCloud
GEOMETRIES = (Mesh, Polygons, Segments, Points, PointCloud)

UPS = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


def primitive_count(geometry: Geometry) -> int:
    """Return how many primitives a geometry has: faces, polygons, segments or points."""
    if isinstance(geometry, Mesh):
        return geometry.face_count
    if isinstance(geometry, (Polygons, PointCloud)):
        return geometry.count
    return len(geometry.segments) if isinstance(geometry, Segments) else len(geometry.positions)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Instance:
    """One geometry in one place.

    Parameters
    ----------
    geometry : Mesh, Polygons, Segments, Points or PointCloud.
    transform : (4, 4), kept as float64: column vectors, world = transform times local, last row 0 0 0 1. By default the
        identity.
    material : the base colour and texture.
    name : any text.

    Raises
    ------
    InputError : not a geometry, or a transform of another shape, not finite, or with another last row.

    Examples
    --------
    >>> mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> Instance(mesh, name="roof")
    Instance('roof', Mesh(3 vertices, 1 triangle, 1 face))
    """

    geometry: Geometry
    transform: NDArray[np.float64]
    material: Material
    name: str

    def __init__(
        self, geometry: Geometry, transform: ArrayLike | None = None, material: Material | None = None, name: str = ""
    ) -> None:
        if not isinstance(geometry, GEOMETRIES):
            raise InputError(
                f"geometry: expected a Mesh, Polygons, Segments, Points or PointCloud, got {type(geometry).__name__}"
            )
        if material is not None and not isinstance(material, Material):
            raise InputError(f"material: expected a Material, got {type(material).__name__}")
        if not isinstance(name, str):
            raise InputError(f"name: expected text, got {name!r}")
        object.__setattr__(self, "geometry", geometry)
        object.__setattr__(self, "transform", as_transform(transform))
        object.__setattr__(self, "material", Material() if material is None else material)
        object.__setattr__(self, "name", name)

    @property
    def has_colors(self) -> bool:
        """Whether the geometry has colours of its own."""
        geometry = self.geometry
        if isinstance(geometry, Mesh):
            return "color" in geometry.corners or "color" in geometry.attributes
        return geometry.colors is not None

    @property
    def used_positions(self) -> NDArray[np.float64]:
        """The positions that triangles or segments use, or all points, (N, 3) float64, before the transform."""
        geometry = self.geometry
        if isinstance(geometry, (Points, Polygons, PointCloud)):
            return geometry.positions
        used = np.zeros(len(geometry.positions), dtype=bool)
        used[(geometry.triangles if isinstance(geometry, Mesh) else geometry.segments).reshape(-1)] = True
        return geometry.positions if used.all() else geometry.positions[used]

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest x, y, z in the world of the vertices that are used, (2, 3) float64; NaN when there are none."""
        is_placed = not np.array_equal(self.transform, np.eye(4))
        if isinstance(self.geometry, PointCloud):
            return self.geometry.bounds_in(self.transform) if is_placed else self.geometry.bounds
        points = self.used_positions
        if not len(points):
            return np.full((2, 3), np.nan)
        if is_placed:
            points = transform_points(self.transform, points)[:, :3]
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def __repr__(self) -> str:
        return f"Instance({self.name!r}, {self.geometry!r})"


def as_transform(transform: ArrayLike | None) -> NDArray[np.float64]:
    """Return a (4, 4) float64 affine transform of its own; None is the identity."""
    if transform is None:
        return np.eye(4)
    matrix = as_array(transform, "transform")
    if matrix.shape != (4, 4):
        raise InputError(f"transform: expected shape (4, 4), got {matrix.shape}")
    matrix = np.array(matrix, dtype=np.float64, order="C")
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise InputError(f"transform[{row}, {column}] = {matrix[row, column]}: expected finite numbers")
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise InputError(f"transform[3] = {tuple(matrix[3].tolist())}: expected the last row (0, 0, 0, 1)")
    return matrix


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Scene:
    """All that is to be drawn.

    Parameters
    ----------
    instances : one Instance, Mesh, Polygons, Segments, Points, PointCloud or Scene, or a sequence of them.
    up : the direction that is up: "+X", "-X", "+Y", "-Y", "+Z" or "-Z".
    name : any text, such as the file's name.
    notes : what a reader of a file could not do, one line each, such as a texture that was not found.
    cameras : those that a file has; `render` takes one of them only if it is given it.

    Raises
    ------
    InputError : something that cannot be drawn, or an unknown direction.

    Examples
    --------
    >>> scene = Scene(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    >>> scene
    Scene(1 instance, 1 triangle, up +Y)
    """

    instances: tuple[Instance, ...]
    up: str = "+Y"
    name: str = ""
    notes: tuple[str, ...] = field(default=())
    cameras: tuple[Camera, ...] = field(default=())

    def __init__(
        self,
        instances: Instance | Geometry | Scene | Iterable[Instance | Geometry | Scene],
        up: str = "+Y",
        name: str = "",
        notes: Iterable[str] = (),
        cameras: Iterable[Camera] = (),
    ) -> None:
        if up not in UPS:
            raise unknown_name("direction for up", up, UPS)
        single = isinstance(instances, (Instance, Scene, *GEOMETRIES))
        if not single and (isinstance(instances, (str, bytes, np.ndarray)) or not isinstance(instances, Iterable)):
            raise InputError(f"instances: expected meshes or instances, got {type(instances).__name__}")
        listed: list[Instance] = []
        for number, thing in enumerate([instances] if single else instances):  # type: ignore[arg-type]
            if isinstance(thing, Scene):
                listed.extend(thing.instances)
            elif isinstance(thing, Instance):
                listed.append(thing)
            elif isinstance(thing, GEOMETRIES):
                listed.append(Instance(thing))
            else:
                kind = type(thing).__name__
                expected = "expected a Mesh, Polygons, Segments, Points, PointCloud or Instance"
                raise InputError(f"instances[{number}]: {expected}, got {kind}")
        object.__setattr__(self, "instances", tuple(listed))
        object.__setattr__(self, "up", up)
        object.__setattr__(self, "name", str(name))
        object.__setattr__(self, "notes", tuple(notes))
        object.__setattr__(self, "cameras", tuple(cameras))
        for number, camera in enumerate(self.cameras):
            if not isinstance(camera, Camera):
                raise InputError(f"cameras[{number}]: expected a Camera, got {type(camera).__name__}")

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest x, y, z in the world of all that is drawn, (2, 3) float64; NaN when nothing is."""
        boxes = [box for box in (instance.bounds for instance in self.instances) if not np.isnan(box).any()]
        if not boxes:
            return np.full((2, 3), np.nan)
        return np.stack([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])

    @property
    def points(self) -> NDArray[np.float64]:
        """What a camera has to have in view, (N, 3) float64 in the world: positions that are used, or points about a cloud."""
        found = []
        for one in self.instances:
            if isinstance(one.geometry, PointCloud):
                from scanspan.assets.envelope import find_envelope  # it needs the compiler

                found.append(transform_points(one.transform, find_envelope(one.geometry))[:, :3])
            else:
                found.append(transform_points(one.transform, one.used_positions)[:, :3])
        return np.concatenate(found) if found else np.empty((0, 3))

    @property
    def triangle_count(self) -> int:
        """Triangles over all instances."""
        return sum(len(i.geometry.triangles) for i in self.instances if isinstance(i.geometry, Mesh))

    @property
    def primitive_count(self) -> int:
        """Primitives over all instances: faces, polygons, segments and points."""
        return self.first_primitive[-1]

    @property
    def first_primitive(self) -> tuple[int, ...]:
        """The number of each instance's first primitive, and at the end the number of primitives in all."""
        offsets = [0]
        for instance in self.instances:
            offsets.append(offsets[-1] + primitive_count(instance.geometry))
        return tuple(offsets)

    def __repr__(self) -> str:
        many, triangles = len(self.instances), self.triangle_count
        plural = "" if many == 1 else "s"
        return f"Scene({many:,} instance{plural}, {triangles:,} triangle{'' if triangles == 1 else 's'}, up {self.up})"
