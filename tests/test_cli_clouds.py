"""Point clouds on the command line: pictures with no options at all, every option, and every message."""

from __future__ import annotations

import json

import numpy as np
import pytest

import scanspan as ss
from scanspan.cli import main

laspy = pytest.importorskip("laspy")
SMALL = ("--size", "64x48")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Give a function that runs the command beside a small survey, and returns code, output and errors."""
    las = laspy.create(point_format=3, file_version="1.2")
    las.header.scales, las.header.offsets = [0.01] * 3, [500_000, 4_900_000, 0]
    x, y = (part.reshape(-1) for part in np.meshgrid(np.arange(40.0), np.arange(30.0)))
    las.x, las.y, las.z = 500_000 + x, 4_900_000 + y, np.where(x > 20, 8.0, 0.0)
    las.classification = np.where(x > 20, 6, 2).astype(np.uint8)
    las.return_number, las.number_of_returns = np.where(y > 15, 2, 1).astype(np.uint8), np.full(len(x), 2, np.uint8)
    las.red, las.green, las.blue = (np.full(len(x), value << 8, np.uint16) for value in (200, 100, 50))
    las.write(tmp_path / "survey.las")
    (tmp_path / "model.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    monkeypatch.chdir(tmp_path)

    def call(*words):
        code = main(["render", *words])
        told = capsys.readouterr()
        return code, told.out, told.err

    return call


def picture(path="survey.png"):
    """Return what a picture holds."""
    from scanspan.target.image import read_image

    return read_image(path)


def test_no_options_make_the_picture_of_the_library(run):
    assert run("survey.las")[:2] == (0, "survey.png\n")
    assert np.array_equal(picture(), ss.render(ss.load("survey.las")).color)
    assert picture().shape == (960, 1280, 4)


def test_every_option_reaches_the_library(run):
    options = {"point_size": 2.5, "point_shape": "square", "color_by": "class", "eye_dome": False}
    words = ("--point-size", "2.5", "--point-shape", "square", "--color-by", "class", "--no-eye-dome")
    assert run("survey.las", *SMALL, *words)[0] == 0
    assert np.array_equal(picture(), ss.render(ss.load("survey.las"), size=(64, 48), **options).color)
    assert run("survey.las", *SMALL, "--point-size", "spacing", "--eye-dome", "--point-shape", "gaussian")[0] == 0
    expected = ss.render(ss.load("survey.las"), size=(64, 48), point_size="spacing", point_shape="gaussian")
    assert np.array_equal(picture(), expected.color)


@pytest.mark.parametrize(
    ("words", "count"),
    [
        (("--classification", "building"), 19 * 30),
        (("--classification", "2,building"), 1200),
        (("--returns", "first"), 16 * 40),
        (("--returns", "1,last"), 1200),
        (("--bounds", "500000,4900000,500009,4900004"), 50),
        (("--bounds", "500000,4900000,1,500030,4900004,9", "--classification", "6"), 50),
    ],
)
def test_filters_keep_the_points_that_are_asked_for(run, words, count):
    assert run("survey.las", *SMALL, "-o", "a.png", "--json", "a.json", *words)[0] == 0
    with open("a.json", encoding="utf-8") as file:
        assert json.load(file)["counts"]["points"] == count


def test_arrays_and_views_and_one_colour(run):
    assert run("survey.las", *SMALL, "-o", "a.npz", "--aov", "primitive,depth")[0] == 0
    assert np.load("a.npz")["primitive"].max() > 1000
    assert run("survey.las", "--size", "200x150", "--views", "iso,top", "-o", "sheet.png")[0] == 0
    assert run("survey.las", *SMALL, "--color", "#0000ff", "--no-eye-dome", "--camera-direction", "top")[0] == 0
    assert picture()[24, 32].tolist() == [0, 0, 255, 255]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("survey.las", "--point-size", "huge"), "unknown --point-size 'huge'; the valid ones are: density, spacing"),
        (("survey.las", "--point-size", "-2"), "--point-size = -2.0: expected pixels above 0"),
        (("survey.las", "--point-shape", "dot"), "unknown --point-shape 'dot'; the valid"),
        (("survey.las", "--color-by", "hue"), "unknown --color-by 'hue'; the valid"),
        (("survey.las", "--bounds", "1,2,3"), "--bounds = '1,2,3': expected X0,Y0,X1,Y1 or X0,Y0,Z0,X1,Y1,Z1"),
        (("survey.las", "--bounds", "a,b,c,d"), "--bounds = 'a,b,c,d': expected"),
        (("survey.las", "--bounds", "0,0,1,1"), "--bounds: no point is left of 1200"),
        (("survey.las", "--classification", "wood"), "unknown class 'wood'"),
        (("survey.las", "--returns", "third"), "unknown return 'third'"),
        (("model.obj", "--returns", "first"), "--returns: for point clouds, and the model has none"),
        (("model.obj", "--point-size", "2"), "are for scenes of point clouds alone"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(run, words, message):
    code, out, err = run(*words, *SMALL, "-o", "a.png")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
