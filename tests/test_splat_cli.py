"""The commands for trees of splats, as they are called."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scanspan as ss
from scanspan.cli import main
from scanspan.view.shot import Shot, make_camera


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a file of points and a tree of them, in which commands run."""
    monkeypatch.chdir(tmp_path)
    vectors = np.random.default_rng(3).normal(size=(20_000, 3))
    np.savetxt("ball.xyz", vectors / np.linalg.norm(vectors, axis=1)[:, None], "%.5f")
    ss.splat.build(np.loadtxt("ball.xyz"), "ball.scansplat")
    return tmp_path


def test_points_become_a_tree_and_a_picture(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["splat", "build", "ball.xyz", "-o", "made.scansplat", "--verbose"]) == 0
    told = capsys.readouterr()
    assert told.out == "made.scansplat\n"
    assert "bytes a point" in told.err
    assert main(["splat", "render", "made.scansplat", "-o", "made.png", "--size", "200x100", "--error", "4"]) == 0
    assert capsys.readouterr().out == "made.png\n"
    expected = ss.splat.open("ball.scansplat").render("iso", (200, 100), error=4)
    with Image.open("made.png") as picture:
        assert (np.asarray(picture) == expected.color).all()


def test_names_are_chosen_where_none_are_given(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "ball.scansplat").unlink()
    assert main(["splat", "build", "ball.xyz"]) == 0
    assert main(["splat", "render", "ball.scansplat", "--resolution", "64,48"]) == 0
    assert main(["render", "ball.scansplat", "--resolution", "64,48", "-o", "again.png"]) == 0
    assert capsys.readouterr().out == "ball.scansplat\nball.png\nagain.png\n"
    assert (folder / "ball.png").read_bytes() == (folder / "again.png").read_bytes()


def test_options_reach_the_picture(folder: Path) -> None:
    tree = ss.splat.open("ball.scansplat")
    tree.up = "+Y"
    arguments = [
        "--camera-direction", "front", "--up", "y", "--background-color", "black", "--budget", "300", "--threads", "1",
    ]  # fmt: skip
    assert main(["splat", "render", "ball.scansplat", "-o", "x.npy", "--size", "64x48", *arguments]) == 0
    camera = make_camera(tree, Shot("front"), (64, 48))
    expected = tree.render(camera, (64, 48), background="black", budget=300)
    assert expected.splats <= 300
    assert (np.load("x.npy") == expected.color).all()
    assert main(["splat", "render", "ball.scansplat", "-o", "y.png", "--size", "64x48", "--deadline", "0"]) == 0
    with Image.open("y.png") as picture:
        assert picture.size == (64, 48)


def test_arrays_can_be_had(folder: Path) -> None:
    assert main(["render", "ball.scansplat", "-o", "x.npz", "--size", "64x48", "--aov", "depth,primitive"]) == 0
    arrays = np.load("x.npz")
    assert sorted(arrays) == ["depth", "primitive"]
    assert np.isfinite(arrays["depth"][arrays["primitive"] >= 0]).all()


def test_a_tree_is_described(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["splat", "info", "ball.scansplat", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["points"] == 20_000
    assert record["splats"] > 20_000
    assert record["bytes"] == (folder / "ball.scansplat").stat().st_size
    assert not record["normals"]
    assert main(["splat", "info", "ball.scansplat"]) == 0
    assert "points           20,000" in capsys.readouterr().out


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["splat"]) == 0
    assert "build" in capsys.readouterr().out
    for command in ("build", "render", "info"):
        assert main(["splat", command, "--help"]) == 0
        assert f"scanspan splat {command}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["render", "nothing.scansplat"], "nothing.scansplat: cannot be opened"),
        (["render", "ball.xyz", "-o", "x.png"], "ball.xyz: byte 0: expected a file of splats"),
        (["render", "ball.scansplat", "-o", "x.gif"], "unknown image format '.gif'"),
        (["render", "ball.scansplat", "--error", "-1"], "error = -1.0: must be a number from 0 to 1000000.0"),
        (["render", "ball.scansplat", "--budget", "3"], "budget = 3: must be a whole number from 256"),
        (["render", "ball.scansplat", "--cull", "front"], "unknown cull 'front'"),
        (["render", "ball.scansplat", "--size", "0"], "--size: size = (0, 0)"),
        (["render", "ball.scansplat", "--no-background", "--background-color", "red"], "do not go together"),
        (["render", "ball.scansplat", "-o", "ball.scansplat"], "unknown image format '.scansplat'"),
        (["build", "nothing.laz"], "nothing.laz"),
        (["build", "ball.xyz", "--max-memory", "1MB"], 'expected at least "256MB"'),
        (["build", "ball.xyz", "--normals", "some"], "unknown value of normals 'some'"),
        (["build", "ball.xyz", "-o", "ball.xyz"], "--output = 'ball.xyz': is the file of points itself"),
        (["info", "ball.xyz"], "expected a file of splats"),
    ],
)
def test_one_line_says_what_is_wrong(
    arguments: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["splat", *arguments]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "compiling" not in line]
    assert line.startswith("scanspan: error: ")
    assert message in line


@pytest.mark.parametrize("option", [["--edges"], ["--shading", "flat"], ["--views", "iso,top"], ["--json", "x.json"]])
def test_render_says_which_options_a_tree_cannot_have(
    option: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", "ball.scansplat", *option]) == 2
    assert f"{option[0]} does not go with a tree of splats" in capsys.readouterr().err
