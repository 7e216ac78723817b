"""The edges of a mesh by how many faces share them: what tells open shapes and faces that turn the wrong way."""

from __future__ import annotations

import numpy as np

from scanspan.assets.inventor.build import Builder
from scanspan.assets.mesh import Mesh

MISTURNED = 0.02  # share of the edges that are open, or that two faces run through the same way, from which on it is said
LOOKED_AT = 200_000  # triangles of a file


def edge_counts(mesh: Mesh) -> tuple[int, int, int]:
    """Return how many edges two triangles run through the same way, how many have one triangle only, and how many there are.

    Corners at the same place are one.
    """
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    vertex = place.reshape(-1)[mesh.triangles]
    pairs = np.concatenate([vertex[:, [0, 1]], vertex[:, [1, 2]], vertex[:, [2, 0]]])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    key = pairs.min(axis=1) * (int(vertex.max()) + 1) + pairs.max(axis=1)
    forward = pairs[:, 0] < pairs[:, 1]
    _, number, uses = np.unique(key, return_inverse=True, return_counts=True)
    ways = np.bincount(number.reshape(-1), weights=forward, minlength=len(uses))
    same = int(((uses == 2) & (ways != 1)).sum())
    return same, int((uses == 1).sum()), len(uses)


def note_open_solids(builder: Builder) -> None:
    """Say how many shapes are called SOLID and are open: Inventor leaves out their back faces, which are drawn here."""
    left, count, known = LOOKED_AT, 0, dict[int, bool]()
    for instance, placed in zip(builder.instances, builder.placed):
        mesh = instance.geometry
        if not placed.is_solid or placed.ordering == "UNKNOWN_ORDERING" or not isinstance(mesh, Mesh):
            continue
        if id(mesh) not in known:
            left -= len(mesh.triangles)
            if left < 0:
                break
            _, open_edges, edges = edge_counts(mesh)
            known[id(mesh)] = open_edges > MISTURNED * edges
        count += known[id(mesh)]
    if count:
        many = "1 shape is called SOLID and is" if count == 1 else f"{count} shapes are called SOLID and are"
        whose = "its" if count == 1 else "their"
        builder.file.note(f'{many} open: {whose} back faces are drawn too; cull="back" leaves them out')
