"""Scenes to text files of Inventor 2.1.

Each instance becomes a Separator with the lights that reach it, its matrix, its material and one shape; cameras stand before
them. Numbers are written so that they are read back as the same bits. Faces are written whole, with all their corners, not as
the triangles they were cut into; polygons with holes have no word in Inventor and come as triangles (target/save.py). A texture
that is mirrored is written twice as large, with its mirror image.

Source: Wernecke, The Inventor Mentor, chapter 11, "File Format".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.cloud import PointCloud
from scanspan.assets.inventor.write_lights import write_camera, write_lights
from scanspan.assets.material import Material, Texture
from scanspan.assets.mesh import Mesh
from scanspan.assets.polygons import Polygons
from scanspan.assets.scene import Instance, Scene
from scanspan.assets.shapes import Points, Segments
from scanspan.errors import InputError

HEADER = "#Inventor V2.1 ascii"
NUMBERS_A_LINE = 12
TURNS = {"+Y": "", "-Y": "0 0 1 3.141592653589793", "+Z": "1 0 0 -1.5707963267948966", "-Z": "1 0 0 1.5707963267948966"} | {
    "+X": "0 0 1 1.5707963267948966",
    "-X": "0 0 1 -1.5707963267948966",
}
"""How a scene is turned whose up is another than Inventor's, +Y."""


def write_iv(scene: Scene) -> str:
    """Return a scene as the text of an Inventor file.

    Raises
    ------
    InputError : the scene has something that Inventor has no node for.

    >>> print(write_iv(Scene(Points([(0, 0, 0), (1, 0, 0)]))).splitlines()[0])
    #Inventor V2.1 ascii
    """
    lines = [HEADER, "", "Separator {"]
    if TURNS[scene.up]:
        lines.append(f"  Rotation {{ rotation {TURNS[scene.up]} }}")
    lines += [f"  {line}" for camera in scene.cameras for line in write_camera(camera)]
    for number, instance in enumerate(scene.instances):
        lines += [f"  {line}" for line in _instance(instance, number, list(write_lights(scene.lights, number)))]
    return "\n".join([*lines, "}", ""])


def _instance(instance: Instance, number: int, lights: list[str]) -> Iterator[str]:
    """Return the lines of one instance."""
    name = _name(instance.name)
    yield f"DEF {name} Separator {{" if name else "Separator {"
    yield from (f"  {line}" for line in lights)
    if not np.array_equal(instance.transform, np.eye(4)):
        yield from _field("  MatrixTransform { matrix", instance.transform.T, "  }", is_list=False)
    geometry = instance.geometry
    if isinstance(geometry, Mesh):
        body = _mesh(geometry, instance)
    elif isinstance(geometry, Segments):
        body = _segments(geometry, instance)
    elif isinstance(geometry, (Points, PointCloud)):
        body = _points(geometry if isinstance(geometry, Points) else geometry.as_points(), instance)
    else:
        body = _polygons(geometry, instance, number)
    yield from (f"  {line}" for line in body)
    yield "}"


def _name(name: str) -> str:
    """Return a name as DEF takes it, "" for one of which nothing is left."""
    kept = "".join(sign if sign.isascii() and (sign.isalnum() or sign == "_") else "_" for sign in name)
    kept = kept.strip("_")
    return f"_{kept}" if kept[:1].isdigit() or kept in ("USE", "DEF", "NULL") else kept


def _words(values: Iterable[Any]) -> list[str]:
    """Return numbers as text that is read back as the same."""
    return [repr(value) for value in values]


def _field(head: str, values: NDArray[Any], tail: str = "", is_list: bool = True) -> Iterator[str]:
    """Return the lines of a field with many numbers."""
    words = _words(np.asarray(values).reshape(-1).tolist())
    if len(words) <= NUMBERS_A_LINE:
        listed = " ".join(words)
        yield f"{head} [ {listed} ]{tail}" if is_list else f"{head} {listed}{tail}"
        return
    yield f"{head} [" if is_list else head
    for start in range(0, len(words), NUMBERS_A_LINE):
        yield "    " + " ".join(words[start : start + NUMBERS_A_LINE])
    yield f"  ]{tail}" if is_list else tail


# Materials


def _material(material: Material, has_colors: bool, colors: NDArray[Any] | None) -> Iterator[str]:
    """Return the lines of a material, with the colours (n, 4) of the geometry where it has such."""
    base = np.array(material.color_of(has_colors))
    table = base[None] if colors is None else np.asarray(_as_shares(colors) * base)
    if not material.is_lit:
        yield "LightModel { model BASE_COLOR }"
    yield "Material {"
    yield from _field("  diffuseColor", table[:, :3])
    alphas = table[:, 3] if (table[:, 3] != table[0, 3]).any() else table[:1, 3]
    if (alphas != 1.0).any():
        yield from _field("  transparency", 1.0 - alphas)
    for name, color in (
        ("emissiveColor", material.emissive_color), ("ambientColor", material.ambient_color or table[0, :3]),
        ("specularColor", material.specular_color),
    ):  # fmt: skip
        if color is not None:
            yield from _field(f"  {name}", np.array(color))
    if material.shininess != Material.shininess:
        yield f"  shininess {material.shininess!r}"
    yield "}"
    if material.texture is not None:
        yield from _texture(material.texture)


def _as_shares(colors: NDArray[Any]) -> NDArray[np.float64]:
    """Return colours as floats 0..1."""
    return colors.astype(np.float64) / (255.0 if colors.dtype == np.uint8 else 1.0)


def _texture(texture: Texture) -> Iterator[str]:
    """Return the lines of a texture, its picture among them."""
    words = {"repeat": "REPEAT", "clamp": "CLAMP", "mirror": "REPEAT"}
    image = texture.image[::-1]

    # Set the mirror image beside a picture that is mirrored, and let texture coordinates go half as far.
    across, up = (2 if name == "mirror" else 1 for name in texture.wrap)
    image = np.concatenate([image, image[:, ::-1]], axis=1) if across == 2 else image
    image = np.concatenate([image, image[::-1]], axis=0) if up == 2 else image
    if across * up > 1:
        yield f"Texture2Transform {{ scaleFactor {1 / across!r} {1 / up!r} }}"
    packed = (image.astype(np.int64) << np.array([24, 16, 8, 0])).sum(axis=2).reshape(-1).tolist()
    yield f"Texture2 {{ wrapS {words[texture.wrap[0]]} wrapT {words[texture.wrap[1]]}"
    yield f"  image {image.shape[1]} {image.shape[0]} 4"
    for start in range(0, len(packed), NUMBERS_A_LINE):
        yield "    " + " ".join(f"0x{pixel:08x}" for pixel in packed[start : start + NUMBERS_A_LINE])
    yield "}"


# Shapes


def _mesh(mesh: Mesh, instance: Instance) -> Iterator[str]:
    """Return the lines of a mesh: its faces, with what is known at their corners."""
    corner, counts = whole_faces(mesh)
    triangle, place = np.divmod(corner, 3)
    vertex = mesh.triangles[triangle, place]

    def at_corners(name: str) -> NDArray[Any] | None:
        """Return an attribute at the corners of the faces."""
        if name in mesh.corners:
            return mesh.corners[name][triangle, place]
        return mesh.attributes[name][vertex] if name in mesh.attributes else None

    colors, normals, uv = at_corners("color"), at_corners("normal"), at_corners("uv")
    yield from _material(instance.material, instance.has_colors, colors)
    angle = 0.0 if mesh.crease_angle is None else float(np.radians(mesh.crease_angle))
    yield f"ShapeHints {{ vertexOrdering COUNTERCLOCKWISE faceType UNKNOWN_FACE_TYPE creaseAngle {angle!r} }}"
    if colors is not None:
        yield "MaterialBinding { value PER_VERTEX }"
    if normals is not None and normals.any():
        yield "NormalBinding { value PER_VERTEX }"
        yield from _field("Normal { vector", normals.astype(np.float64), " }")
    if uv is not None:
        yield "TextureCoordinateBinding { value PER_VERTEX }"
        yield from _field("TextureCoordinate2 { point", uv, " }")
    yield from _field("Coordinate3 { point", mesh.positions, " }")
    yield from _field("IndexedFaceSet { coordIndex", _parted(vertex, counts), " }")


def _parted(vertex: NDArray[Any], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return runs of vertices with -1 after each."""
    return np.insert(vertex.astype(np.int64), np.cumsum(counts), -1)


def whole_faces(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of the faces of a mesh, 3 times the triangle plus the corner in it, and how many each face has.

    The outer edges of a face's triangles are followed round. Where they do not close to one ring, the triangles stay.
    """
    flat: list[int] = []
    counts: list[int] = []
    bounds = np.append(np.flatnonzero(np.diff(mesh.source, prepend=-1)), len(mesh.source)).tolist()
    triangles, inner = mesh.triangles.tolist(), mesh.inner.tolist()
    for first, last in pairwise(bounds):
        ring = [] if last - first == 1 else _ring(triangles[first:last], inner[first:last], 3 * first)
        if ring:
            flat += ring
            counts.append(len(ring))
        else:
            flat += range(3 * first, 3 * last)
            counts += [3] * (last - first)
    return np.array(flat, dtype=np.int64), np.array(counts, dtype=np.int64)


def _ring(triangles: list[list[int]], inner: list[int], offset: int) -> list[int]:
    """Return the corners round several triangles, or nothing where they are not one simple ring."""
    after: dict[int, tuple[int, int]] = {}
    for number, (corners, marks) in enumerate(zip(triangles, inner)):
        for k in range(3):
            if not marks >> ((k + 2) % 3) & 1:
                if corners[k] in after:
                    return []
                after[corners[k]] = corners[(k + 1) % 3], offset + 3 * number + k
    ring: list[int] = []
    start = vertex = next(iter(after), -1)
    while vertex in after:
        vertex, corner = after.pop(vertex)
        ring.append(corner)
    return ring if vertex == start and not after and len(ring) == len(triangles) + 2 else []


def _segments(segments: Segments, instance: Instance) -> Iterator[str]:
    """Return the lines of segments."""
    ends, colors = segments.segments, segments.colors
    yield from _material(instance.material, instance.has_colors, None if colors is None else np.atleast_2d(colors))
    if colors is not None and colors.ndim == 2:
        per_segment = len(colors) == len(ends)
        yield f"MaterialBinding {{ value {'PER_PART' if per_segment else 'PER_VERTEX_INDEXED'} }}"
    yield f"DrawStyle {{ lineWidth {segments.width!r} }}"
    yield from _lit(instance.material)
    yield from _field("Coordinate3 { point", segments.positions, " }")
    yield from _field("IndexedLineSet { coordIndex", _parted(ends.reshape(-1), np.full(len(ends), 2)), " }")


def _lit(material: Material) -> Iterator[str]:
    """Return the normal that lets light fall on lines and points, which are drawn without light where they have none."""
    if material.is_lit:
        yield "NormalBinding { value OVERALL }"
        yield "Normal { vector 0 0 1 }"


def _points(points: Points, instance: Instance) -> Iterator[str]:
    """Return the lines of points."""
    colors = points.colors
    yield from _material(instance.material, instance.has_colors, None if colors is None else np.atleast_2d(colors))
    if colors is not None and colors.ndim == 2:
        yield "MaterialBinding { value PER_VERTEX }"
    yield f"DrawStyle {{ pointSize {points.size!r} }}"
    yield from _lit(instance.material)
    yield from _field("Coordinate3 { point", points.positions, " }")
    yield "PointSet { }"


def _polygons(polygons: Polygons, instance: Instance, number: int) -> Iterator[str]:
    """Return the lines of polygons of one ring each."""
    rings = np.diff(polygons.polygon_rings)
    if (rings > 1).any():
        first = int(polygons.source[np.argmax(rings > 1)])
        raise InputError(
            f"instances[{number}]: polygon {first} has {int(rings.max())} rings; an Inventor file has no polygons with holes"
        )
    colors = polygons.colors
    if colors is not None and colors.ndim == 2:
        colors = colors[polygons.source]
    yield from _material(instance.material, instance.has_colors, None if colors is None else np.atleast_2d(colors))
    if colors is not None and colors.ndim == 2:
        yield "MaterialBinding { value PER_FACE }"
    yield "ShapeHints { vertexOrdering COUNTERCLOCKWISE faceType UNKNOWN_FACE_TYPE }"
    yield from _field("Coordinate3 { point", polygons.positions, " }")
    counts = np.diff(polygons.ring_starts).astype(np.int64)
    vertex = np.arange(len(polygons.positions))
    yield from _field("IndexedFaceSet { coordIndex", _parted(vertex, counts), " }")
