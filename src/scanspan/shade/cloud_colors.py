"""Colours of points: their own, or by height, intensity, class or return.

Only what is seen is looked up. Heights and intensities run through a colormap between limits that all but a few points lie in,
as a single bird or a mirror would else leave one colour for the rest.

Source: the ASPRS LAS specification 1.4, for classes; their colours are near those of common viewers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.assets.cloud_choice import column_of
from scanspan.assets.scene import Instance
from scanspan.errors import unknown_name
from scanspan.homogeneous import transform_points
from scanspan.records import Array, Float64Array, Int64Array, UInt8Array
from scanspan.shade.colormap import colorize

CHOICES = ("auto", "rgb", "elevation", "intensity", "class", "return")
LOOKED_AT = 1 << 16  # points of a cloud that the limits are taken from
SHARE = 0.01  # of the points that may lie below the limits, and as many above

# Heights from deep water over grass and sand to snow; even in lightness, so that shading by depth can be read beside it.
STOPS = (
    (38, 70, 120), (43, 105, 152), (52, 140, 160), (84, 166, 140), (134, 185, 112), (190, 200, 102), (228, 198, 106),
    (236, 172, 96), (226, 140, 98), (208, 112, 112), (224, 190, 196), (248, 244, 244),
)  # fmt: skip

CLASSES = {
    0: (170, 170, 170), 1: (185, 185, 185), 2: (170, 122, 80), 3: (150, 200, 100), 4: (90, 170, 70), 5: (40, 125, 50),
    6: (215, 85, 60), 7: (255, 0, 255), 8: (120, 120, 120), 9: (60, 120, 215), 10: (110, 80, 60), 11: (95, 95, 105),
    12: (200, 200, 160), 13: (250, 220, 80), 14: (255, 190, 30), 15: (230, 130, 40), 16: (255, 240, 150), 17: (180, 100, 200),
    18: (255, 60, 160),
}  # fmt: skip

RETURNS = (
    (130, 130, 134), (205, 208, 212), (232, 152, 52), (70, 160, 90), (60, 120, 200), (160, 90, 190), (210, 80, 80),
    (90, 190, 200),
)  # fmt: skip


def ramp(stops: Any, steps: int = 256) -> UInt8Array:
    """Return a colormap that runs evenly through some colours, (steps, 3)."""
    places, at = np.linspace(0.0, 1.0, len(stops)), np.linspace(0.0, 1.0, steps)
    levels = [np.interp(at, places, np.array(stops)[:, k]) for k in range(3)]
    return np.asarray(np.rint(np.stack(levels, axis=1)), np.uint8)


def table_of(colors: dict[int, tuple[int, int, int]]) -> UInt8Array:
    """Return (256, 4) colours of bytes; those without one of their own repeat three shades."""
    spare = ((150, 140, 190), (190, 140, 150), (140, 190, 180))
    return np.array([(*colors.get(k, spare[k % 3]), 255) for k in range(256)], np.uint8)


class Coloring(NamedTuple):
    """How the points of one instance are coloured."""

    kind: str  # a choice other than "auto", or "material"
    limits: tuple[float, float]
    up: Float64Array  # (3,)


def check_choice(choice: Any) -> str:
    """Return what points are coloured by, or raise an InputError."""
    if not isinstance(choice, str) or choice not in CHOICES:
        raise unknown_name("color_by", choice, CHOICES)
    return choice


def choose_colorings(instances: tuple[Instance, ...], choice: str, up: Float64Array) -> list[Coloring]:
    """Return how each instance is coloured, with limits that hold for all of them.

    Raises
    ------
    InputError : for what a cloud does not know.
    """
    kinds = []
    for instance in instances:
        cloud = cloud_of(instance)
        known = {"rgb": "color", "intensity": "intensity", "class": "classification", "return": "return_number"}
        if choice in known:
            column_of(cloud, known[choice])
        kinds.append(choice if choice != "auto" else own_kind(instance))

    # Take the limits of heights and of intensities from all clouds together.
    limits = {}
    for kind in ("elevation", "intensity"):
        values = [sample(instance, kind, up) for instance, used in zip(instances, kinds, strict=True) if used == kind]
        limits[kind] = limits_of(np.concatenate(values)) if values else (0.0, 1.0)
    return [Coloring(kind, limits.get(kind, (0.0, 1.0)), up) for kind in kinds]


def own_kind(instance: Instance) -> str:
    """Return how a cloud is coloured where nothing is said: by its colours, else by that of its material, else by height."""
    if cloud_of(instance).color is not None:
        return "rgb"
    return "elevation" if instance.material.base_color is None else "material"


def cloud_of(instance: Instance) -> PointCloud:
    """Return the cloud of an instance that is one."""
    assert isinstance(instance.geometry, PointCloud)
    return instance.geometry


def sample(instance: Instance, kind: str, up: Float64Array) -> Float64Array:
    """Return heights or intensities of some of the points."""
    rows = np.arange(0, len(cloud_of(instance)), max(1, len(cloud_of(instance)) // LOOKED_AT))
    return values_of(instance, kind, rows, up)


def values_of(instance: Instance, kind: str, rows: Int64Array, up: Float64Array) -> Float64Array:
    """Return the heights in the world, or the intensities, of some points."""
    if kind == "intensity":
        return column_of(cloud_of(instance), "intensity")[rows].astype(np.float64)
    cloud, m = cloud_of(instance), instance.transform
    along = [float((up[0] * m[0, k] + up[1] * m[1, k]) + up[2] * m[2, k]) for k in range(4)]
    x, y, z = (cloud.stored[:, k][rows] * (along[k] * cloud.scale[k]) for k in range(3))
    base = sum(along[k] * float(cloud.offset[k]) for k in range(3)) + along[3]
    return np.asarray(((x + y) + z) + base, np.float64)


def places_of(instance: Instance, rows: Int64Array) -> Float64Array:
    """Return where some points are in the world, (k, 3)."""
    cloud = cloud_of(instance)
    return transform_points(instance.transform, cloud.stored[rows] * cloud.scale + cloud.offset)[:, :3]


def limits_of(values: Float64Array) -> tuple[float, float]:
    """Return between which values all but a few lie."""
    if not len(values):
        return 0.0, 1.0
    ordered = np.sort(values)
    last = len(ordered) - 1
    return float(ordered[int(last * SHARE)]), float(ordered[last - int(last * SHARE)])


def point_colors(instance: Instance, rows: Int64Array, coloring: Coloring) -> UInt8Array:
    """Return the colours of some points, (k, 4) uint8, sRGB with straight alpha."""
    cloud, kind = cloud_of(instance), coloring.kind
    if kind == "rgb":
        colors: Array = column_of(cloud, "color")[rows]
        opaque = np.full((len(rows), 1), 255, np.uint8)
        return colors if colors.shape[1] == 4 else np.concatenate([colors, opaque], axis=1)
    if kind in ("class", "return"):
        table = CLASS_TABLE if kind == "class" else RETURN_TABLE
        return np.asarray(table[column_of(cloud, "classification" if kind == "class" else "return_number")[rows]])
    if kind == "material":
        codes = np.rint(np.array(instance.material.base_color, np.float64) * 255.0).astype(np.uint8)
        return np.broadcast_to(codes, (len(rows), 4))
    values = values_of(instance, kind, rows, coloring.up)
    return colorize(values, HEIGHTS if kind == "elevation" else GREYS, limits=coloring.limits)


HEIGHTS, GREYS = ramp(STOPS), ramp([(40, 40, 44), (250, 250, 248)])
CLASS_TABLE, RETURN_TABLE = table_of(CLASSES), table_of(dict(enumerate(RETURNS)))
