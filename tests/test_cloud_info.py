"""What `scanspan info` tells about clouds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.cloud import PointCloud
from scanspan.assets.load import load
from scanspan.assets.scene import Scene
from scanspan.view.cloud_metadata import describe_clouds, name_of_crs
from scanspan.view.metadata import describe_model, describe_scene, to_json, to_text


def test_a_file_of_points(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("x,y,z,class,return_number,intensity\n4918340.364,636001.76,1,2,1,7\n4918341.5,636002,2,66,2,9\n", "utf-8")
    record = describe_model(str(path), load(path))
    assert record["clouds"] == [
        {
            "points": 2,
            "coordinates": "float64",
            "intensity": [7.0, 9.0],
            "classes": {"ground": 1, "class 66": 1},
            "returns": {"return 1": 1, "return 2": 1},
        }
    ]
    assert record["instances"][0]["kind"] == "pointcloud"
    assert record["counts"] == {"instances": 1, "triangles": 0, "primitives": 2}
    assert json.loads(to_json(record))["clouds"] == record["clouds"]
    lines = to_text(record).splitlines()
    assert "bounds      4918340.364, 636001.76, 1" in lines
    assert "clouds      points: 2" in lines
    assert "            classes: ground 1; class 66 1" in lines


def test_steps_and_the_reference_system() -> None:
    whole = PointCloud(integers=[(1, 2, 3)], scale=0.01, crs='PROJCS["UTM 12N",GEOGCS["WGS 84"]]')
    uneven = PointCloud(integers=[(1, 2, 3)], scale=(0.5, 1, 2))
    told = describe_clouds(Scene([whole, uneven]))["clouds"]
    assert told[0] == {"points": 1, "coordinates": "int32 in steps of 0.01", "crs": "UTM 12N"}
    assert told[1] == {"points": 1, "coordinates": "int32 in steps of [0.5, 1.0, 2.0]"}
    assert name_of_crs('GEOCCS["unnamed",DATUM["WGS_1984"]]') == "GEOCCS"
    assert name_of_crs("some words") == "some words"
    assert describe_clouds(Scene([])) == {}


@pytest.mark.parametrize("count", [0, 1])
def test_a_cloud_with_hardly_any_points(count: int) -> None:
    cloud = PointCloud(np.zeros((count, 3)), intensity=np.zeros(count), classification=np.zeros(count, np.uint8))
    told = describe_clouds(Scene(cloud))["clouds"][0]
    assert told["classes"] == ({"never classified": 1} if count else {})
    assert ("intensity" in told) == bool(count)
    assert describe_scene(Scene(cloud))["counts"]["primitives"] == count
