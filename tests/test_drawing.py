"""Drawings: what SVG, GeoJSON, TopoJSON and lists of rings become, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets.drawing import Drawing, flatten, load_drawing

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]
ONE, ZERO = np.ones(2), np.zeros(2)


def svg(folder: Path, inside: str, attributes: str = 'width="20" height="10"') -> Drawing:
    """Read an SVG file with this in it."""
    path = folder / "a.svg"
    path.write_text(f"{SVG} {attributes}>{inside}</svg>")
    return load_drawing(path)


def maps(folder: Path, content: Any, name: str = "a.json") -> Drawing:
    """Read this as a JSON file."""
    path = folder / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return load_drawing(path)


# SVG


def test_a_path_keeps_its_chains_curves_and_closing(tmp_path: Path) -> None:
    drawing = svg(tmp_path, '<path d="M0 0 C 0 4 4 4 4 0 Z M 5 5 H 9 V 9"/>')
    assert drawing.size == (20, 10)
    assert drawing.bounds == (0, 0, 20, 10)
    first, second = drawing.shapes[0].paths
    assert first.is_closed
    assert not second.is_closed
    assert first.is_straight.tolist() == [False, True]
    assert flatten(second, ONE, ZERO).tolist() == [[5, 5], [9, 5], [9, 9]]


@pytest.mark.parametrize("scale", [0.5, 1.0, 30.0, 1000.0])
def test_chords_lie_within_a_fiftieth_of_a_pixel(tmp_path: Path, scale: float) -> None:
    drawing = svg(tmp_path, '<circle cx="5" cy="5" r="4"/>')
    points = flatten(drawing.shapes[0].paths[0], np.full(2, scale), ZERO)
    middles = (points + np.roll(points, -1, axis=0)) / 2
    radius = np.hypot(*(middles - 5 * scale).T)
    assert np.abs(radius - 4 * scale).max() < 0.02 + 4 * scale * 3e-4
    assert len(points) < 40 + 12 * scale


def test_transforms_units_and_the_view_box_are_followed(tmp_path: Path) -> None:
    inside = '<g transform="translate(10 0) scale(2)"><rect x="1" y="1" width="3" height="2"/></g>'
    drawing = svg(tmp_path, inside, 'width="2in" height="96" viewBox="0 0 96 48"')
    assert drawing.size == (192, 96)
    points = flatten(drawing.shapes[0].paths[0], ONE, ZERO)
    assert points.min(axis=0).tolist() == [24, 4]
    assert points.max(axis=0).tolist() == [36, 12]


def test_styles_are_read(tmp_path: Path) -> None:
    inside = (
        '<path d="M0 0H9V9Z" style="fill:#ff000080;fill-rule:evenodd;stroke:blue;stroke-width:2;stroke-linecap:round;'
        'stroke-linejoin:bevel;stroke-miterlimit:7;stroke-dasharray:1,2 3" opacity="0.5" transform="scale(2)"/>'
        '<path d="M0 0H9V9Z" fill="none" stroke="lime" stroke-opacity="50%" stroke-linejoin="odd" stroke-dasharray="0 0"/>'
        '<path d="M0 0H9V9Z" visibility="hidden"/><g display="none"><path d="M0 0H9V9Z"/></g>'
    )
    first, second = (shape.style for shape in svg(tmp_path, inside).shapes)
    assert first.fill is not None
    assert first.stroke is not None
    assert np.allclose(first.fill, [1, 0, 0, 0.25], atol=0.002)
    assert np.allclose(first.stroke, [0, 0, 1, 0.5], atol=0.002)
    assert first[1:2] + first[3:] == ("even-odd", 4.0, "round", "bevel", 7.0, (2.0, 4.0, 6.0), 0.0)
    assert second.fill is None
    assert (second.cap, second.join, second.dash, second.fill_rule) == ("butt", "miter", (), "non-zero")


def test_what_is_not_drawn_is_noted_once(tmp_path: Path) -> None:
    inside = '<text x="1" y="5">a</text><text x="1" y="9">b</text><path d="M0 0H9V9Z" fill="url(#none)"/>'
    assert svg(tmp_path, inside).notes == ("texts are not drawn", "gradients and patterns are not drawn")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "it is empty"),
        ("<svg", "the file is damaged (ParseError: unclosed token: line 1, column 0)"),
        (f"{SVG}/>", "there is nothing in it to draw"),
        (f'{SVG}><text x="1">a</text></svg>', "there is nothing in it to draw; texts are not drawn"),
        (f'{SVG}><g id="a"><use xlink:href="#a"/><path d="M0 0H1"/></g></svg>', "it is nested too deeply, or refers to itself"),
    ],
)
def test_svg_files_that_cannot_be_drawn(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "a.svg"
    path.write_text(content)
    with pytest.raises(ss.FormatError) as caught:
        load_drawing(path)
    assert str(caught.value) == f"{path}: {message}"


# Maps


def test_a_map_has_its_features_in_order_with_their_styles(tmp_path: Path) -> None:
    collection = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [SQUARE, [[1, 1], [2, 1], [2, 2]]]},
             "properties": {"fill": "red", "fill-opacity": 0.5, "stroke": "00f", "stroke-width": 3}},
            {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0, 7], [9, 3, 7]]}, "properties": None},
            {"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": [
                {"type": "Point", "coordinates": [1, 2]}, {"type": "MultiPoint", "coordinates": [[3, 4], [5, 6]]}]}},
            {"type": "Feature", "geometry": None},
            {"type": "Feature", "geometry": {"type": "MultiPolygon", "coordinates": [[SQUARE], [[[6, 6], [7, 6], [7, 7]]]]}},
        ],
    }  # fmt: skip
    drawing = maps(tmp_path, collection, "a.geojson")
    land, line, one, two, parts = drawing.shapes
    assert drawing.is_upward
    assert not drawing.is_tiling
    assert drawing.bounds == (0, 0, 9, 7)
    assert [len(shape.paths) for shape in drawing.shapes] == [2, 1, 0, 0, 2]
    assert land.style.fill is not None
    assert land.style.fill.tolist() == [1, 0, 0, 0.5]
    assert land.style.stroke is not None
    assert land.style.stroke.tolist() == [0, 0, 1, 1]
    assert land.style.width == 3
    assert line.style.fill is None
    assert flatten(line.paths[0], ONE, ZERO).tolist() == [[0, 0], [9, 3]]
    assert (one.points.tolist(), two.points.tolist()) == ([[1, 2]], [[3, 4], [5, 6]])
    assert all(path.is_closed and len(path.curves) == len(flatten(path, ONE, ZERO)) for path in parts.paths)


def test_neighbours_in_a_topology_have_the_same_points(tmp_path: Path) -> None:
    topology = {
        "type": "Topology", "transform": {"scale": [0.5, 0.25], "translate": [10, 20]},
        "arcs": [[[4, 0], [0, 8]], [[4, 8], [-4, 0], [0, -8], [4, 0]], [[4, 0], [4, 0], [0, 8], [-4, 0]]],
        "objects": {"land": {"type": "GeometryCollection", "geometries": [
            {"type": "Polygon", "arcs": [[0, 1]]}, {"type": "MultiPolygon", "arcs": [[[2, -1]]]}]}},
    }  # fmt: skip
    drawing = maps(tmp_path, topology)
    left, right = (flatten(shape.paths[0], ONE, ZERO) for shape in drawing.shapes)
    assert drawing.is_tiling
    assert left.tolist() == [[12, 20], [12, 22], [10, 22], [10, 20]]
    assert right.tolist() == [[12, 20], [14, 20], [14, 22], [12, 22]]


def test_a_ring_over_the_date_line_lies_on_both_sides(tmp_path: Path) -> None:
    ring = [[170, 10], [-170, 10], [-170, 20], [170, 20], [170, 10]]
    world = {"type": "Polygon", "coordinates": [[[-180, -90], [180, -90], [180, 90], [-180, 90]]]}
    found = maps(tmp_path, {"type": "GeometryCollection", "geometries": [world, {"type": "Polygon", "coordinates": [ring]}]})
    copies = [flatten(path, ONE, ZERO) for path in found.shapes[1].paths]
    assert found.bounds == (-180, -90, 180, 90)
    assert [copy.tolist() for copy in copies] == [
        [[-190, 10], [-170, 10], [-170, 20], [-190, 20]], [[170, 10], [190, 10], [190, 20], [170, 20]],
    ]  # fmt: skip
    pole = [[-180, -80], [-60, -70], [60, -70], [180, -80], [-180, -80]]
    assert len(maps(tmp_path, {"type": "Polygon", "coordinates": [pole]}).shapes[0].paths) == 1
    line = maps(tmp_path, {"type": "LineString", "coordinates": [[170, 0], [-175, 5]]}).shapes[0]
    assert [flatten(path, ONE, ZERO).tolist() for path in line.paths] == [[[-190, 0], [-175, 5]], [[170, 0], [185, 5]]]


def test_plain_rings_are_one_shape_with_holes(tmp_path: Path) -> None:
    for content in (SQUARE, [SQUARE, [[1, 1], [2, 1], [2, 2]]]):
        drawing = maps(tmp_path, content)
        assert len(drawing.shapes) == 1
        assert drawing.size == (4, 4)
        assert drawing.shapes[0].style.fill_rule == "even-odd"
    assert maps(tmp_path, [[[-1, 0], [4, 0], [4, 4]]]).size is None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "line 1: it is not JSON, Expecting property name enclosed in double quotes"),
        ('{"type": "Sphere"}', "expected GeoJSON, TopoJSON or a list of rings, got type = 'Sphere'"),
        ("7", "expected GeoJSON, TopoJSON or a list of rings, got type = None"),
        ("[]", "there is nothing in it to draw"),
        ("[[1, 2], 3]", "ring 0: expected positions [x, y]"),
        ('{"type": "Feature", "geometry": {"type": "Circle"}}', "unknown geometry 'Circle', expected one of Point, MultiPoint, "
         "LineString, MultiLineString, Polygon, MultiPolygon, GeometryCollection"),
        ('{"type": "FeatureCollection", "features": [3]}', "expected a geometry, got '3'"),
        ('{"type": "Polygon", "id": 7, "coordinates": [[[0, 0], ["a", 1]]]}', "Polygon 7: expected positions [x, y]"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [1e999, 1]]]}', "Polygon: a position is not finite"),
        ('{"type": "Polygon"}', "Polygon: it has no coordinates"),
        ('{"type": "Topology"}', "a Topology without objects"),
        ('{"type": "Topology", "arcs": [], "objects": {"a": {"type": "Polygon", "arcs": [[3]]}}}',
         "Polygon: it names arcs that are not there"),
    ],
)  # fmt: skip
def test_maps_that_cannot_be_drawn(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(ss.FormatError) as caught:
        maps(tmp_path, content)
    assert str(caught.value) == f"{tmp_path / 'a.json'}: {message}"


def test_an_unknown_colour_is_noted(tmp_path: Path) -> None:
    feature = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [SQUARE]}, "properties": {"fill": "redd"}}
    assert maps(tmp_path, feature).notes == ("the colour 'redd' is not known",)


# Files


def test_files_that_cannot_be_opened(tmp_path: Path) -> None:
    (tmp_path / "folder.svg").mkdir()
    (tmp_path / "big.svg").write_text("<svg/>" * 10)
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00")
    for name, options, message in [
        ("none.svg", {}, "there is no such file"),
        ("folder.svg", {}, "it is a folder, expected a drawing"),
        ("big.svg", {"max_bytes": 20}, "60 bytes are more than the limit of 20 (max_bytes)"),
        ("bytes.json", {}, "byte 0: it is not text in UTF-8"),
    ]:
        with pytest.raises(ss.InputError) as caught:
            load_drawing(tmp_path / name, **options)
        assert str(caught.value) == f"{tmp_path / name}: {message}"
    with pytest.raises(ss.InputError, match=r"unknown file type 'obj'; the valid ones are: svg, geojson, json, topojson"):
        load_drawing("a.obj")
    with pytest.raises(ss.FormatError, match="it is not a name of a file"):
        load_drawing("a\0.svg")
