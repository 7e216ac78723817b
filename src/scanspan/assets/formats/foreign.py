"""Values taken from objects of other libraries, known by what they have and not by their class."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def trimesh_values(mesh: Any) -> tuple[dict[str, ArrayLike], dict[str, ArrayLike]]:
    """Return what a trimesh-like mesh knows at its vertices and at the corners of its faces."""
    attributes: dict[str, ArrayLike] = {}
    corners: dict[str, ArrayLike] = {}
    stored = getattr(mesh, "_cache", None)
    if stored is not None and "vertex_normals" in stored:
        attributes["normal"] = np.asarray(mesh.vertex_normals)
    visual: Any = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "vertex":
        attributes["color"] = np.asarray(visual.vertex_colors)
    elif kind == "face":
        colors = np.asarray(visual.face_colors)
        corners["color"] = np.repeat(colors[:, None, :], 3, axis=1)
    elif getattr(visual, "uv", None) is not None:
        attributes["uv"] = np.asarray(visual.uv)
    return attributes, corners
