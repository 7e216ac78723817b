"""Drawings on a canvas: fitted, painted in order, and by the command `draw`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.cli import main
from scanspan.drawings import LONGER_SIDE, natural_size

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10">'
OUTLINES = Path(__file__).resolve().parents[2] / "shared" / "data" / "polygons"


def svg(folder: Path, inside: str) -> Path:
    """Write an SVG file of 20 x 10 pixels with this in it."""
    path = folder / "a.svg"
    path.write_text(f"{SVG}{inside}</svg>")
    return path


def test_fills_and_strokes_are_those_of_a_canvas(tmp_path: Path) -> None:
    path = svg(
        tmp_path,
        '<path d="M2 1H11V8H2Z M4 3H9V6H4Z" fill="#08f" fill-rule="evenodd"/>'
        '<path d="M13 2L18 5L13 8" fill="none" stroke="rgb(200,0,0)" stroke-width="1.5" stroke-linecap="round"/>',
    )
    for smooth in (True, False):
        expected = ss.Canvas(20, 10, "white")
        rings: Any = [[(2, 1), (11, 1), (11, 8), (2, 8)], [(4, 3), (9, 3), (9, 6), (4, 6)]]
        expected.polygon(rings, (0, 136, 255), antialias=smooth)
        expected.polyline([(13, 2), (18, 5), (13, 8)], (200, 0, 0), width=1.5, cap="round", antialias=smooth)
        assert np.array_equal(ss.draw(path, antialias=smooth).pixels, expected.pixels)


def test_a_drawing_keeps_its_shape_in_any_size(tmp_path: Path) -> None:
    path = svg(tmp_path, '<rect x="0" y="0" width="20" height="10" fill="black"/>')
    assert ss.draw(path).pixels.shape == (10, 20, 4)
    tall = ss.draw(path, (40, 60)).pixels[..., 0]
    assert (tall[20:40] == 0).all()
    assert (tall[:20] == 255).all()
    assert (tall[40:] == 255).all()
    wide = ss.draw(path, (60, 10), background="transparent").pixels[..., 3]
    assert (wide[:, 20:40] == 255).all()
    assert wide.sum() == 255 * 200


def test_the_content_is_fitted_where_it_is_asked_for(tmp_path: Path) -> None:
    path = svg(tmp_path, '<rect x="1000" y="-500" width="30" height="30" fill="black"/>')
    assert (ss.draw(path).pixels == 255).all()
    assert (ss.draw(path, (50, 50), fit="content").pixels[2:-2, 2:-2, 0] == 0).all()


def test_paints_can_be_replaced(tmp_path: Path) -> None:
    path = svg(tmp_path, '<rect x="2" y="2" width="6" height="6" fill="lime" stroke="red" stroke-width="2"/>')
    pixels = ss.draw(path, fill="blue", stroke="none").pixels
    assert pixels[5, 5].tolist() == [0, 0, 255, 255]
    assert pixels[1, 5].tolist() == [255, 255, 255, 255]
    thick = ss.draw(path, fill="none", stroke="black", stroke_width=4).pixels[..., 0]
    assert thick[0, 5] == thick[3, 5] == 0
    assert thick[5, 5] == 255
    assert ss.draw(path, stroke_width=0).pixels[1, 5].tolist() == [255, 255, 255, 255]


def test_a_map_is_upright_and_has_no_seams(tmp_path: Path) -> None:
    left = {"type": "Polygon", "arcs": [[0, 1]], "properties": {"fill": "white", "stroke": "white", "stroke-width": 0}}
    right = {"type": "Polygon", "arcs": [[2, -1]], "properties": {"fill": "white", "stroke": "white", "stroke-width": 0}}
    topology = {
        "type": "Topology",
        "arcs": [[[2.3, 0], [2.7, 8]], [[2.7, 8], [0, 8], [0, 0], [2.3, 0]], [[2.3, 0], [5, 0], [5, 8], [2.7, 8]]],
        "objects": {"both": {"type": "GeometryCollection", "geometries": [left, right]}},
    }
    path = tmp_path / "a.json"
    path.write_text(json.dumps(topology))
    for size in ((37, 51), (64, 64), (101, 333)):
        pixels = ss.draw(path, size, background="black").pixels[..., 0]
        rows, columns = np.nonzero(pixels)
        inside = pixels[rows.min() + 1 : rows.max(), columns.min() + 1 : columns.max()]
        assert (inside == 255).all()
    feature = {"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [2, 9]]]}
    path.write_text(json.dumps(feature))
    upright = ss.draw(path, (40, 60)).pixels[..., 0] < 255
    assert upright[:15].sum() < upright[-15:].sum()
    assert natural_size(ss.assets.drawing.load_drawing(path)) == (569, LONGER_SIDE)


def test_points_are_discs(tmp_path: Path) -> None:
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "MultiPoint", "coordinates": [[0, 0], [10, 0], [10, 10]]}))
    seen = ss.draw(path, (100, 100)).pixels[..., 0] < 255
    assert 60 < seen.sum() < 110


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fit": "pages"}, "unknown fit 'pages'; did you mean 'page'? The valid ones are: page, content"),
        ({"stroke_width": -1}, "stroke_width = -1: must be a number from 0 to 65536"),
        ({"antialias": 1}, "antialias = 1: must be True or False"),
        ({"fill": "blu"}, "'blu' is no colour; did you mean 'blue'?"),
        ({"size": (0, 5)}, "size = (0, 5)"),
    ],
)
def test_options_that_cannot_be_used(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    path = svg(tmp_path, '<rect width="5" height="5"/>')
    with pytest.raises(ss.InputError) as caught:
        ss.draw(path, **options)
    assert message in str(caught.value)


@pytest.mark.skipif(not OUTLINES.is_dir(), reason="the shared files are not there")
def test_real_outlines(tmp_path: Path) -> None:
    polygon = ss.draw(OUTLINES / "polygon.svg", stroke="none", background="black")
    assert polygon.size == (794, 1123)
    assert (polygon.pixels[..., 0] == 0).all()
    tray = ss.draw(OUTLINES / "tray-easy1.svg", (600, 600), fit="content", stroke_width=1.0)
    assert 0.005 < (tray.pixels[..., 0] < 128).mean() < 0.1


# The command


def test_the_command_writes_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = svg(tmp_path, '<rect x="2" y="2" width="6" height="6" fill="lime"/><text>a</text>'), tmp_path / "b.png"
    assert main(["draw", str(path), "-o", str(out), "--size", "40x20", "--fill", "red", "--no-antialias"]) == 0
    printed = capsys.readouterr()
    assert printed.out == f"{out}\n"
    assert "texts are not drawn" in printed.err
    from scanspan.target.image import read_image

    assert np.array_equal(read_image(out), ss.draw(path, (40, 20), fill="red", antialias=False).pixels)


def test_the_command_refuses_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = svg(tmp_path, '<rect width="5" height="5"/>')
    for arguments, message in [
        ([str(path), "-o", str(path)], "unknown kind of picture"),
        ([str(tmp_path / "none.svg")], "there is no such file"),
        ([str(path), "--size", "0"], "--size"),
        ([str(path), "-o", str(tmp_path / "no" / "b.png")], "no"),
        ([str(path), "--fit", "all"], "unknown fit 'all'"),
    ]:
        assert main(["draw", *arguments]) == 2
        lines = [line for line in capsys.readouterr().err.splitlines() if "compiling kernels" not in line]
        assert len(lines) == 1, lines
        line = lines[0]
        assert message in line or arguments[-1] == str(path)
    assert path.read_text().startswith("<svg")
