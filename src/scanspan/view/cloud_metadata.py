"""What `scanspan info` tells about a cloud of points: how many, how exact, which classes and returns."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from scanspan.assets.cloud import PointCloud
from scanspan.assets.cloud_choice import CLASSES
from scanspan.assets.scene import Scene


def describe_clouds(scene: Scene) -> dict[str, Any]:
    """Return what is known of the clouds of a scene, nothing where it has none.

    >>> describe_clouds(Scene(PointCloud([(0, 0, 0), (1, 0, 0)], classification=[2, 2])))["clouds"][0]["classes"]
    {'ground': 2}
    """
    clouds = [instance.geometry for instance in scene.instances if isinstance(instance.geometry, PointCloud)]
    return {"clouds": [describe_cloud(cloud) for cloud in clouds]} if clouds else {}


def describe_cloud(cloud: PointCloud) -> dict[str, Any]:
    """Return what is known of a cloud."""
    steps = cloud.scale.tolist()
    unit = "" if cloud.integers is None else f" in steps of {steps[0]:g}" if len({*steps}) == 1 else f" in steps of {steps}"
    found: dict[str, Any] = {"points": len(cloud), "coordinates": f"{cloud.stored.dtype}{unit}"}
    if cloud.crs:
        found["crs"] = name_of_crs(cloud.crs)
    if cloud.intensity is not None and len(cloud):
        found["intensity"] = [cloud.intensity.min().item(), cloud.intensity.max().item()]
    if cloud.classification is not None:
        names = {number: name for name, number in CLASSES.items()}
        found["classes"] = {names.get(number, f"class {number}"): many for number, many in tally(cloud.classification)}
    if cloud.return_number is not None:
        found["returns"] = {f"return {number}": many for number, many in tally(cloud.return_number)}
    return found


def tally(values: Any) -> list[tuple[int, int]]:
    """Return which bytes there are, each with how often."""
    counts = np.bincount(values, minlength=256)
    return [(number, int(counts[number])) for number in np.flatnonzero(counts).tolist()]


def name_of_crs(crs: str) -> str:
    """Return the name of a coordinate reference system: the first in its text, or the text where there is none.

    >>> name_of_crs('PROJCS["WGS 84 / UTM zone 12N",GEOGCS["WGS 84"]]'), name_of_crs("EPSG:26912")
    ('WGS 84 / UTM zone 12N', 'EPSG:26912')
    """
    named = re.match(r'\s*([A-Z_]+)\[\s*"([^"]*)"', crs)
    if named is None:
        return crs[:80]
    return named[2][:80] if named[2] not in ("", "unnamed", "unknown") else named[1]
