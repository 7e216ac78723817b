"""What of a scene is shown, how large its points are, and in which colour all of it is, where a command says so."""

from __future__ import annotations

from typing import Any

from scanspan.assets.cloud import PointCloud
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance, Scene
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError


def parse_point_size(text: str | None) -> float | str | None:
    """Return a number of pixels, or the text, which may be a name.

    >>> parse_point_size("2.5"), parse_point_size("density")
    (2.5, 'density')
    """
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def parse_points(size: str | None, shape: str | None, color_by: str | None, eye_dome: bool | None) -> dict[str, Any]:
    """Return how points are drawn, as `render` takes it; None where nothing was said."""
    return {"point_size": parse_point_size(size), "point_shape": shape, "color_by": color_by, "eye_dome": eye_dome}


def parse_choice(bounds: str | None, classification: str | None, returns: str | None) -> dict[str, Any]:
    """Return which points are kept, as `PointCloud.select` takes it; None where nothing was said.

    >>> parse_choice("0,0,9,9", "ground,6", "last")
    {'bounds': [[0.0, 0.0], [9.0, 9.0]], 'classification': ['ground', 6], 'returns': ['last']}

    Raises
    ------
    InputError : for bounds that are not four or six numbers.
    """
    box = None
    if bounds is not None:
        try:
            numbers = [float(part) for part in bounds.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in (4, 6):
            raise InputError(f"--bounds = {bounds!r}: expected X0,Y0,X1,Y1 or X0,Y0,Z0,X1,Y1,Z1")
        half = len(numbers) // 2
        box = [numbers[:half], numbers[half:]]
    return {"bounds": box, "classification": parse_names(classification), "returns": parse_names(returns)}


def parse_names(text: str | None) -> list[int | str] | None:
    """Return names and whole numbers between commas."""
    if text is None:
        return None
    words = [word.strip() for word in text.split(",")]
    return [int(word) if word.isdecimal() and word.isascii() else word for word in words]


def choose_points(scene: Scene, conditions: dict[str, Any]) -> Scene:
    """Return a scene with the points of its clouds that meet conditions, as `PointCloud.select` takes them.

    Raises
    ------
    InputError : conditions that cannot be read, or for a scene without clouds; where no point is left.
    """
    if not conditions:
        return scene
    options = " and ".join(f"--{name}" for name in conditions)
    if not any(isinstance(one.geometry, PointCloud) for one in scene.instances):
        raise InputError(f"{options}: for point clouds, and the model has none")
    chosen = []
    for one in scene.instances:
        shape = one.geometry.select(**conditions) if isinstance(one.geometry, PointCloud) else one.geometry
        chosen.append(Instance(shape, one.transform, one.material, one.name))
    found = Scene(chosen, scene.up, scene.name, scene.notes, scene.cameras, scene.lights)
    if not found.primitive_count:
        raise InputError(f"{options}: no point is left of {scene.primitive_count}")
    return found


def recolor(instance: Instance, color: tuple[float, ...]) -> Instance:
    """Return an instance in one colour, without texture and colours of its own."""
    shape = instance.geometry
    if isinstance(shape, Mesh):
        attributes, corners = (
            {name: values for name, values in known.items() if name != "color"} for known in (shape.attributes, shape.corners)
        )
        shape = Mesh(
            shape.positions, shape.triangles, shape.source, attributes, corners, shape.inner,
            face_count=shape.face_count, nonfinite="drop", crease_angle=shape.crease_angle,
        )  # fmt: skip
    elif isinstance(shape, Segments):
        shape = Segments(shape.positions, shape.segments, None, shape.width)
    elif isinstance(shape, Points):
        shape = Points(shape.positions, None, shape.size)
    elif isinstance(shape, PointCloud):
        known: dict[str, Any] = shape.columns | {"color": color}
        known["positions" if shape.integers is None else "integers"] = shape.stored
        shape = PointCloud(scale=shape.scale, offset=shape.offset, size=shape.size, crs=shape.crs, **known)
    material = Material(instance.material.name, (color[0], color[1], color[2], color[3]))
    return Instance(shape, instance.transform, material, instance.name)
