"""save(): a scene to a file."""

from __future__ import annotations

import os

from scanspan.assets.inventor.write import write_iv
from scanspan.assets.load import as_path
from scanspan.assets.scene import Geometry, Instance, Scene
from scanspan.errors import unknown_name
from scanspan.target.image import write_bytes

WRITERS = {"iv": write_iv}
"""Extension to the function that makes a text of a scene."""


def save(scene: Scene | Instance | Geometry, path: str | os.PathLike[str]) -> None:
    """Write a scene to a file of the kind that its name ends with: so far .iv, Open Inventor 2.1 in text.

    Parameters
    ----------
    scene : a Scene, or one Mesh, Polygons, Segments, Points, PointCloud or Instance. What `load` read comes back with the same
        positions, faces, colours and textures; polygons with holes cannot be written.
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
    write_bytes(name, WRITERS[kind](whole).encode("ascii"))
