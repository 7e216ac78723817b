"""save(): a scene to a file.

Polygons with holes become faces of triangles before they are written: what a format has no word for is cut by the sweep that
fills polygons, in the polygon's own plane, on a grid of 2^-30 of its extent.
"""

from __future__ import annotations

import os
from itertools import pairwise

import numpy as np

from scanspan.assets.inventor.write import write_iv
from scanspan.assets.load import as_path
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.rings import FILL_RULES
from scanspan.assets.scene import Geometry, Instance, Scene
from scanspan.errors import unknown_name
from scanspan.target.image import write_bytes

GRID = 2.0**30

WRITERS = {"iv": write_iv}
"""Extension to the function that makes a text of a scene."""


def save(scene: Scene | Instance | Geometry, path: str | os.PathLike[str]) -> None:
    """Write a scene to a file of the kind that its name ends with: so far .iv, Open Inventor 2.1 in text.

    Parameters
    ----------
    scene : a Scene, or one Mesh, Polygons, Segments, Points, PointCloud or Instance. What `load` read comes back with the same
        positions, faces, colours, textures, lights and cameras; polygons with holes come back as triangles.
    path : where to; the file is either written whole or left as it was.

    Raises
    ------
    InputError : another ending, something that the format has no word for, or a path that cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> from scanspan.assets.mesh import Mesh
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), f"{folder}/triangle.iv")
    """
    name = as_path(path)
    kind = os.path.splitext(name)[1].lower().removeprefix(".")
    if kind not in WRITERS:
        raise unknown_name("ending of a scene file", kind, WRITERS)
    whole = scene if isinstance(scene, Scene) else Scene(scene)
    instances = [without_holes(instance) for instance in whole.instances]
    plain = Scene(instances, whole.up, whole.name, whole.notes, whole.cameras, whole.lights)
    write_bytes(name, WRITERS[kind](plain).encode("ascii"))


def without_holes(instance: Instance) -> Instance:
    """Return an instance with its polygons as triangles, where one of them has more than one ring."""
    polygons = instance.geometry
    if not isinstance(polygons, Polygons) or (np.diff(polygons.polygon_rings) <= 1).all():
        return instance
    from scanspan.geometry.polygon_triangles import carry_values, triangulate_rings  # which needs the compiler

    points, triangles, source, count = [], [], [], 0
    rule = FILL_RULES.index(polygons.fill_rule)
    for number, (first, last) in enumerate(pairwise(polygons.polygon_rings.tolist())):
        # Leave out the axis along which the polygon is flattest, and bring the other two to the grid.
        starts = polygons.ring_starts[first : last + 1]
        given = polygons.positions[starts[0] : starts[-1]]
        normal = polygons.normals[number]
        axis = int(np.argmax(np.abs(normal)))
        flat = given[:, [(axis + 1) % 3, (axis + 2) % 3]]
        low, extent = flat.min(axis=0), float(np.ptp(flat, axis=0).max()) or 1.0
        snapped = np.ascontiguousarray(np.rint((flat - low) * (GRID / extent)), np.int64)
        cut = triangulate_rings(snapped, (starts - starts[0]).astype(np.int32), rule)

        # Keep the polygon's own points, and turn the triangles as it turns.
        found = carry_values(given, cut.first, cut.rounds)
        own = cut.origin >= 0
        found[own] = given[cut.origin[own]]
        corners = cut.triangles.astype(np.int64) + count
        sides = found[cut.triangles]
        across = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
        if (across * normal).sum() < 0.0:
            corners = corners[:, [0, 2, 1]]
        points.append(found)
        triangles.append(corners)
        source.append(np.full(len(corners), number))
        count += len(found)
    owner = np.concatenate(source)
    colors = polygons.colors
    corner_colors = {}
    if colors is not None:
        table = colors[polygons.source[owner]] if colors.ndim == 2 else np.broadcast_to(colors, (len(owner), colors.shape[0]))
        corner_colors["color"] = np.repeat(table[:, None], 3, axis=1)
    mesh = Mesh(np.concatenate(points), np.concatenate(triangles), None, None, corner_colors, crease_angle=0.0)
    return Instance(mesh, instance.transform, instance.material, instance.name)
