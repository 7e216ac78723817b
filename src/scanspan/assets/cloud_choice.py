"""Which points of a cloud meet conditions: a box, classes, returns, intensities.

Source: the ASPRS LAS specification 1.4, revision 15, table 17, for the classes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from scanspan.assets.arrays import as_array
from scanspan.errors import InputError, unknown_name
from scanspan.records import Array, BoolArray

if TYPE_CHECKING:
    from scanspan.assets.cloud import PointCloud

CLASSES = {
    "never classified": 0, "unclassified": 1, "ground": 2, "low vegetation": 3, "medium vegetation": 4, "high vegetation": 5,
    "building": 6, "low noise": 7, "key point": 8, "water": 9, "rail": 10, "road": 11, "overlap": 12, "wire guard": 13,
    "wire conductor": 14, "transmission tower": 15, "wire connector": 16, "bridge": 17, "high noise": 18,
}  # fmt: skip
"""Names of the classes that a survey uses; 19 to 63 are reserved and 64 to 255 anybody's."""

RETURNS = ("first", "last", "single")


def choose(cloud: PointCloud, bounds: Any, classification: Any, returns: Any, intensity: Any) -> BoolArray:
    """Return which points of a cloud meet all conditions that are not None, (N,) bool; see PointCloud.select."""
    kept = np.ones(len(cloud), bool)
    if bounds is not None:
        low, high = as_box(bounds)
        for axis in range(len(low)):
            values = cloud.stored[:, axis] * cloud.scale[axis] + cloud.offset[axis]
            kept &= (values >= low[axis]) & (values <= high[axis])
    if classification is not None:
        known = column_of(cloud, "classification")
        wanted = np.zeros(256, bool)
        wanted[[as_class(one) for one in listed(classification)]] = True
        kept &= wanted[known]
    if returns is not None:
        met = np.zeros(len(cloud), bool)
        for one in listed(returns):
            met |= of_return(cloud, one)
        kept &= met
    if intensity is not None:
        low, high = as_range(intensity, "intensity")
        values = column_of(cloud, "intensity")
        kept &= (values >= low) & (values <= high)
    return kept


def column_of(cloud: PointCloud, name: str) -> Array:
    """Return what a cloud knows under a name, or raise."""
    found: Array | None = getattr(cloud, name)
    if found is None:
        known = ", ".join(cloud.columns) or "nothing but positions"
        raise InputError(f"{name}: the cloud has none; it has {known}")
    return found


def listed(wanted: Any) -> list[Any]:
    """Return one condition or several as a list."""
    if isinstance(wanted, str) or not isinstance(wanted, Iterable):
        return [wanted]
    return wanted.tolist() if isinstance(wanted, np.ndarray) else list(wanted)


def as_class(wanted: Any) -> int:
    """Return the number of a class from its number or name."""
    if isinstance(wanted, str):
        name = " ".join(wanted.lower().replace("_", " ").replace("-", " ").split())
        if name not in CLASSES:
            raise unknown_name("class", wanted, CLASSES)
        return CLASSES[name]
    return as_byte(wanted, "classification", "the number of a class, 0..255, or its name")


def as_byte(wanted: Any, name: str, expected: str) -> int:
    """Return a whole number 0..255."""
    if isinstance(wanted, bool) or not isinstance(wanted, (int, np.integer)) or not 0 <= wanted <= 255:
        raise InputError(f"{name} = {wanted!r}: expected {expected}")
    return int(wanted)


def of_return(cloud: PointCloud, wanted: Any) -> BoolArray:
    """Return which points are of one return, given by its number or name."""
    if isinstance(wanted, str) and wanted not in RETURNS:
        raise unknown_name("return", wanted, RETURNS)
    if wanted == "single":
        return np.asarray(column_of(cloud, "number_of_returns") == 1)
    number = column_of(cloud, "return_number")
    if wanted == "last":
        return np.asarray(number == column_of(cloud, "number_of_returns"))
    value = 1 if wanted == "first" else as_byte(wanted, "returns", "return numbers, 0..255, or first, last or single")
    return np.asarray(number == value)


def as_box(bounds: ArrayLike) -> Array:
    """Return the lowest and the highest corner of a box, (2, 3) or (2, 2) float64."""
    box = as_array(bounds, "bounds").astype(np.float64)
    if box.shape not in ((2, 3), (2, 2)):
        raise InputError(f"bounds: expected the lowest and the highest corner, shape (2, 3) or (2, 2), got {box.shape}")
    if not (box[0] <= box[1]).all():
        raise InputError(f"bounds = {box.tolist()}: expected the lowest corner first")
    return box


def as_range(limits: Any, name: str) -> tuple[float, float]:
    """Return the least and the greatest of a range."""
    pair = as_array(limits, name).astype(np.float64)
    if pair.shape != (2,) or not pair[0] <= pair[1]:
        raise InputError(f"{name} = {limits!r}: expected the least and the greatest")
    return float(pair[0]), float(pair[1])
