"""The numbers beside a picture and behind a file, as plain dictionaries that go into JSON.

Everything is in the conventions of the library: matrices by rows for column vectors, clip coordinates as OpenGL has them,
pixels with y down. What does not exist is None, never NaN, because JSON has no NaN.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanspan.assets.camera import Camera
from scanspan.assets.cloud import PointCloud
from scanspan.assets.lens import Orthographic, Perspective
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Geometry, Instance, Scene, primitive_count
from scanspan.target.frame import Frame
from scanspan.view.cloud_metadata import describe_clouds
from scanspan.view.reporter import to_line

Record = dict[str, Any]

_SHOWN = 20  # rows of one entry that people are shown
_LONG = 80  # a single thing that takes more letters has a row for each thing known of it


def describe_frame(frame: Frame) -> Record:
    """Return what is known of a picture.

    Returns
    -------
    A dictionary: ``size``, ``coverage`` (share of the pixels whose centre is covered), ``blank`` (whether nothing at all is to
    be seen), ``seen_bounds`` (left, top, right and bottom in pixels, half-open, of what is covered), ``depth_range`` (nearest
    and farthest distance along the line of sight), ``camera``, ``counts`` and ``scene``. The bounds and the range are None
    where nothing is covered.

    Examples
    --------
    >>> import scanspan as ss
    >>> record = describe_frame(ss.render(ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), "front", (64, 48)))
    >>> record["blank"], record["counts"]["drawn"], record["camera"]["kind"]
    (False, 1, 'perspective')
    """
    covered = frame.primitive >= 0
    coverage = float(covered.mean())
    is_empty = coverage == 0.0 and bool((frame.color == frame.color[:, :1]).all())
    seen_bounds = depth_range = None
    if coverage:
        columns, rows = np.flatnonzero(covered.any(axis=0)), np.flatnonzero(covered.any(axis=1))
        seen_bounds = [int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1]
        depths = frame.depth[covered]
        depth_range = [float(depths.min()), float(depths.max())]
    scene = describe_scene(frame.scene)
    return {
        "size": list(frame.size),
        "coverage": coverage,
        "blank": is_empty,
        "seen_bounds": seen_bounds,
        "depth_range": depth_range,
        "camera": describe_camera(frame.camera, frame.size, centre_of(frame.scene)),
        "counts": {
            **scene.pop("counts"),
            **{name: int(count) for name, count in frame.counters.items() if name != "triangles"},
        },
        "scene": scene,
    }


def describe_camera(camera: Camera, size: tuple[int, int], centre: npt.ArrayLike) -> Record:
    """Return what a program needs to know of a camera.

    Parameters
    ----------
    camera, size : of the picture.
    centre : (3,) the centre of the scene; ``units_per_pixel`` holds there, and everywhere for an orthographic camera.

    Examples
    --------
    >>> describe_camera(Camera.orthographic((0, 0, 5), (0, 0, 0), height=2), (64, 50), (0, 0, 0))["units_per_pixel"]
    0.04
    """
    view, projection = camera.view, camera.projection(size)
    kind = "orthographic" if camera.is_orthographic else "perspective"
    distance = float(camera.depth(np.asarray(centre)[None])[0])
    reach = 1.0 if camera.is_orthographic else distance
    record: Record = {
        "kind": kind,
        "eye": camera.eye.tolist(),
        "forward": (0.0 - view[2, :3]).tolist(),
        "right": view[0, :3].tolist(),
        "up": view[1, :3].tolist(),
        "near": float(camera.near),
        "far": None if camera.far is None else float(camera.far),
        "view_angle": camera.lens.fov if isinstance(camera.lens, Perspective) else None,
        "view_height": camera.lens.height if isinstance(camera.lens, Orthographic) else None,
        "distance": distance,
        "units_per_pixel": 2.0 * reach / (float(projection[1, 1]) * size[1]) if reach > 0.0 else None,
        "units_per_pixel_holds": "everywhere" if camera.is_orthographic else "at the centre of the scene",
        "view": view.tolist(),
        "projection": projection.tolist(),
        "clip": camera.clip_matrix(size).tolist(),
        "opencv": None,
    }
    if camera.lens.pinhole(size) is not None:
        matrix, turn, shift = camera.to_opencv(size)
        record["opencv"] = {"K": matrix.tolist(), "R": turn.tolist(), "t": shift.tolist()}
    return record


def centre_of(scene: Scene) -> npt.NDArray[np.float64]:
    """Return the (3,) centre of a scene's bounds, the origin for an empty scene."""
    low, high = scene.bounds
    return low / 2.0 + high / 2.0 if np.isfinite(low).all() else np.zeros(3)


def describe_scene(scene: Scene) -> Record:
    """Return what is known of a scene as a whole.

    Examples
    --------
    >>> describe_scene(Scene(Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])))["extent"]
    [1.0, 1.0, 0.0]
    """
    low, high = scene.bounds
    exists = bool(np.isfinite(low).all())
    return {
        "name": scene.name,
        "up": scene.up,
        "bounds": [low.tolist(), high.tolist()] if exists else None,
        "extent": (high - low).tolist() if exists else None,
        "counts": {
            "instances": len(scene.instances),
            "triangles": scene.triangle_count,
            "primitives": scene.primitive_count,
        },
        "cameras": len(scene.cameras),
        "lights": [light.kind for light in scene.lights],
        "notes": list(scene.notes),
    }


def describe_parts(scene: Scene) -> Record:
    """Return the instances of a scene one by one, and the materials and textures that they use, each once."""
    materials: list[Material] = []
    for instance in scene.instances:
        if not any(instance.material is known for known in materials):
            materials.append(instance.material)
    numbers = {id(material): number for number, material in enumerate(materials)}
    return {
        "attributes": sorted({name for instance in scene.instances for name in attributes_of(instance)}),
        "instances": [
            {
                "name": instance.name,
                "kind": type(instance.geometry).__name__.lower(),
                "vertices": vertex_count(instance.geometry),
                "triangles": len(instance.geometry.triangles) if isinstance(instance.geometry, Mesh) else 0,
                "primitives": primitive_count(instance.geometry),
                "attributes": attributes_of(instance),
                "material": numbers[id(instance.material)],
            }
            for instance in scene.instances
        ],
        "materials": [
            {
                "name": material.name,
                "base_color": None if material.base_color is None else list(material.base_color),
                "texture": None if material.texture is None else list(material.texture.size),
            }
            for material in materials
        ],
    }


def vertex_count(geometry: Geometry) -> int:
    """Return how many positions a geometry has; a cloud would have to work them out."""
    return geometry.count if isinstance(geometry, PointCloud) else len(geometry.positions)


def attributes_of(instance: Instance) -> list[str]:
    """Return the names of what an instance has at its vertices or corners."""
    geometry = instance.geometry
    if isinstance(geometry, Mesh):
        return sorted({*geometry.attributes, *geometry.corners})
    if isinstance(geometry, PointCloud):
        return sorted(geometry.columns)
    return [] if geometry.colors is None else ["color"]


def to_json(record: Any) -> str:
    """Return a record as JSON, rows of numbers on one line each.

    >>> print(to_json({"eye": [0.0, 1.0], "view": [[1, 0], [0, 1]]}))
    {
      "eye": [0.0, 1.0],
      "view": [
        [1, 0],
        [0, 1]
      ]
    }
    """
    return _to_lines(record, "")


def _to_lines(value: Any, indent: str) -> str:
    """Return a value as JSON whose later lines are indented."""
    inner = indent + "  "
    if isinstance(value, dict) and value:
        lines = [f"{inner}{json.dumps(key)}: {_to_lines(item, inner)}" for key, item in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
        return "[\n" + ",\n".join(inner + _to_lines(item, inner) for item in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False)


def describe_model(path: str, scene: Scene) -> Record:
    """Return what is known of a model file: its format and size, the scene, and its parts."""
    kind = Path(path).suffix.lower().removeprefix(".")
    record = {"file": path, "format": kind, "bytes": os.path.getsize(path)} | describe_scene(scene) | describe_clouds(scene)
    return record | describe_parts(scene)


def describe_machine() -> Record:
    """Return what this machine has to run on: versions, processors, where kernels are kept, and the algorithms."""
    from scanspan.raster.algorithms import ALGORITHMS, ORDERS
    from scanspan.raster.options import check_threads

    return {
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "numba", "pillow", "trimesh")},
        "system": f"{platform.system()} {platform.machine()}",
        "threads": check_threads(None),
        "kernels": describe_kernels()["folder"],
        "algorithms": dict(ALGORITHMS),
        "orders": dict(ORDERS),
    }


def used_kernels() -> dict[str, Any]:
    """Return what numba knows of the kernels that were compiled or loaded and are kept on disk, by name."""
    dispatchers = {
        id(value): value
        for name, module in list(sys.modules.items())
        if name.startswith("scanspan.")
        for value in list(vars(module).values())
        if hasattr(value, "py_func") and hasattr(value, "stats")
    }
    stats = {f"{kernel.py_func.__module__}.{kernel.py_func.__name__}": kernel.stats for kernel in dispatchers.values()}
    return {name: known for name, known in stats.items() if known.cache_path and (known.cache_hits or known.cache_misses)}


def compiled_kernels() -> list[str]:
    """Return the names of the kernels that were compiled by this process."""
    return [name for name, known in used_kernels().items() if known.cache_misses]


def describe_kernels(elsewhere: Iterable[str] = ()) -> Record:
    """Return where the machine code of the kernels is kept, how many are in use, and how many were compiled just now.

    Parameters
    ----------
    elsewhere : names of those that another process has compiled just now.
    """
    kept = used_kernels()
    return {
        "folder": os.path.commonpath([known.cache_path for known in kept.values()]) if kept else None,
        "kernels": len(kept),
        "compiled": len(set(kept) & {*compiled_kernels(), *elsewhere}),
    }


def to_text(record: Record) -> str:
    """Return a record as lines for people: one for each entry, what is in a list or dictionary below its name.

    >>> print(to_text({"up": "+Y", "bounds": [[0.0, 0.5], [1.0, 1.0]], "notes": []}))
    up      +Y
    bounds  0, 0.5
            1, 1
    notes   none
    """
    width = max(len(name) for name in record) + 2
    lines = []
    for name, value in record.items():
        rows = _to_rows(value)
        shown = rows if len(rows) <= _SHOWN else [*rows[: _SHOWN - 1], f"... and {len(rows) - _SHOWN + 1} more"]
        lines += [f"{name.replace('_', ' ') if not n else '':<{width}}{row}" for n, row in enumerate(shown)]
    return "\n".join(line.rstrip() for line in lines)


def _to_rows(value: Any) -> list[str]:
    """Return a value as rows of text."""
    if isinstance(value, dict):
        return [f"{name.replace('_', ' ')}: {_to_words(item)}" for name, item in value.items()] or ["none"]
    if isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
        rows = [_to_words(item) for item in value]
        return _to_rows(value[0]) if len(value) == 1 and len(rows[0]) > _LONG else rows
    return [_to_words(value)]


def _to_words(value: Any) -> str:
    """Return a value on one line."""
    if isinstance(value, dict):
        return "; ".join(
            f"{name.replace('_', ' ')} {_to_words(item)}" for name, item in value.items() if item not in ("", None)
        )
    if isinstance(value, list):
        return ", ".join(_to_words(item) for item in value) or "none"
    if isinstance(value, float):
        # Coordinates of surveys have millions of metres and need their millimetres.
        return f"{value:.6g}" if not 1e5 <= abs(value) < 1e10 else f"{value:.3f}".rstrip("0").rstrip(".")
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{value:,}"
    return "none" if value is None else to_line(str(value))
