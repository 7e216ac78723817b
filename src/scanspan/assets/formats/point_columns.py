"""What the columns of a point file mean, by name or by number, and the cloud that they make.

Names are a matter of custom: those of CloudCompare, PDAL, MeshLab and the LAS specification are known, in any case, with or
without underscores. Columns without names go by their number: x y z, then intensity, colour, normal. Three more columns than
x y z are a normal where they are unit vectors, else a colour. What is decided is decided from the first rows and holds for the
whole file, so that chunks agree.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.errors import InputError
from scanspan.records import Array

NAMES = {
    "x": "x", "y": "y", "z": "z",
    "red": "red", "r": "red", "green": "green", "g": "green", "blue": "blue", "b": "blue",
    "alpha": "alpha", "a": "alpha",
    "diffusered": "red", "diffusegreen": "green", "diffuseblue": "blue", "diffusealpha": "alpha",
    "nx": "nx", "ny": "ny", "nz": "nz", "normalx": "nx", "normaly": "ny", "normalz": "nz",
    "intensity": "intensity", "i": "intensity", "reflectance": "intensity", "amplitude": "intensity",
    "classification": "classification", "class": "classification",
    "returnnumber": "return_number", "numberofreturns": "number_of_returns",
}  # fmt: skip
"""Names as they are met, without underscores and blanks, and what they mean."""

XYZ, RGB, NORMAL = ("x", "y", "z"), ("red", "green", "blue"), ("nx", "ny", "nz")
BY_WIDTH = {
    3: XYZ, 4: (*XYZ, "intensity"), 6: (*XYZ, *RGB), 7: (*XYZ, "intensity", *RGB), 9: (*XYZ, *RGB, *NORMAL),
    10: (*XYZ, "intensity", *RGB, *NORMAL),
}  # fmt: skip


class Plan(NamedTuple):
    """What the columns of a file mean: a name for each, "" for one that is not used, and the highest value of a colour."""

    names: tuple[str, ...]
    brightest: float  # 1, 255, 65535, or the most that the type holds


def meaning(name: str) -> str:
    """Return what a name of a column means, "" where it is unknown.

    >>> meaning("Scalar_Intensity"), meaning("//X"), meaning("gps_time")
    ('intensity', 'x', '')
    """
    plain = re.sub(r"[^a-z]", "", name.lower())
    return NAMES.get(plain.removeprefix("scalar"), NAMES.get(plain, ""))


def name_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Return the meaning of each column; of two with the same the first has it.

    Raises
    ------
    InputError : x, y or z is missing.
    """
    found: list[str] = []
    for name in names:
        known = meaning(name)
        found.append("" if known in found else known)
    if any(axis not in found for axis in XYZ):
        shown = ", ".join(names[:8])
        raise InputError(f"expected columns x, y and z, got {shown[:80]}{', ...' if len(names) > 8 else ''}")
    return tuple(found)


def name_by_number(rows: Array) -> tuple[str, ...]:
    """Return the meaning of each column of (N, k) numbers without names.

    Raises
    ------
    InputError : another number of columns than a cloud has.
    """
    width = rows.shape[1]
    if width not in BY_WIDTH:
        raise InputError(f"{width} columns: expected 3, 4, 6, 7, 9 or 10, or a header that names them")
    if width == 6 and len(rows):
        with np.errstate(over="ignore", invalid="ignore"):
            length = np.sqrt((rows[:, 3:].astype(np.float64) ** 2).sum(axis=1))
        if (np.abs(length - 1.0) < 0.01).mean() > 0.5:
            return (*XYZ, *NORMAL)
    return BY_WIDTH[width]


def make_plan(names: tuple[str, ...], columns: Mapping[str, Array], *, by_type: bool = False) -> Plan:
    """Return the plan for a file, from the meaning of its columns and its first rows, or for colours their type alone."""
    if not all(name in names for name in RGB):
        return Plan(names, 1.0)
    shown = [columns[name] for name in RGB]
    if by_type and all(values.dtype.kind in "iu" for values in shown):
        return Plan(names, float(max(np.iinfo(values.dtype).max for values in shown)))
    if by_type or all(values.dtype == np.uint8 for values in shown):
        return Plan(names, 1.0 if by_type else 255.0)
    highest = max((float(np.nanmax(values)) for values in shown if len(values)), default=0.0)
    is_unit = highest <= 1.0 and any(values.dtype.kind == "f" for values in shown)
    return Plan(names, 1.0 if is_unit else 255.0 if highest <= 255.0 else 65535.0)


def cloud_from(plan: Plan, columns: Mapping[str, Array], nonfinite: str, crs: str = "") -> PointCloud:
    """Return the cloud of columns by meaning, (N,) each.

    Raises
    ------
    InputError : a colour beyond what the first rows had, or as for PointCloud.
    """
    given: dict[str, Any] = {
        name: columns[name] for name in ("intensity", "classification", "return_number", "number_of_returns") if name in columns
    }
    if all(name in columns for name in RGB):
        names = (*RGB, "alpha") if "alpha" in columns else RGB
        given["color"] = as_bytes(np.stack([columns[name] for name in names], axis=1), plan.brightest)
    if all(name in columns for name in NORMAL):
        given["normals"] = np.stack([columns[name] for name in NORMAL], axis=1)
    places = np.stack([columns[name] for name in XYZ], axis=1)
    is_whole = places.dtype.kind in "iu" and np.can_cast(places.dtype, np.int32)
    given["integers" if is_whole else "positions"] = places
    return PointCloud(nonfinite=nonfinite, crs=crs, **given)


def as_bytes(color: Array, brightest: float) -> Array:
    """Return colours 0 to 1, to 255 or to 65535 as 0..255; of 16 bits the upper 8 are taken."""
    if color.dtype == np.uint8:
        return color
    good = (color >= 0) & (color <= brightest)
    if not good.all():
        row = int(np.argmin(good.all(axis=1)))
        shown = tuple(color[row].tolist())
        raise InputError(f"colour of point {row} = {shown}: expected 0 to {brightest:g}, as the first ones are")
    values = color.astype(np.float64)
    scaled = np.floor(values / 256.0) if brightest == 65535.0 else np.rint(values * (255.0 / brightest))
    return scaled.astype(np.uint8)


def by_meaning(names: Sequence[str], columns: Sequence[Array]) -> dict[str, Array]:
    """Return the columns that have a meaning, under it."""
    return {name: values for name, values in zip(names, columns, strict=True) if name}
