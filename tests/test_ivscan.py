"""ivscan: the calls that set pixels are those of the shipping algorithms, and five views show them."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scanspan as ss
from scanspan.errors import FormatError, InputError, LimitError
from scanspan.lectures import ivscan
from scanspan.raster import write
from scanspan.view.calls import record_calls
from tests.inventor import HEADER

TEXT = """
ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }
DirectionalLight { }
Separator { Material { diffuseColor 1 0 0 } DEF box Cube { } }
Separator { PointLight { } }
Separator { Translation { translation 1 .5 .3 } Material { diffuseColor 0 1 0 emissiveColor 0 0 1 } Sphere { } }
Translation { translation -1 -.5 2 } Font { size 2 } Text3 { string "i" }
Coordinate3 { point [ -2 -2 0, 2 -2 1, 2 2 0 ] } IndexedLineSet { coordIndex [ 0, 1, 2 ] }
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> ss.Scene:
    """A scene of solids, lines and a letter."""
    path = tmp_path_factory.mktemp("scene") / "a.iv"
    path.write_text(HEADER + TEXT)
    return ss.load(path)


def white(region: tuple[int, int, int, int]) -> np.ndarray[Any, Any]:
    """A white background."""
    return np.full((region[3] - region[1], region[2] - region[0], 4), 255, np.uint8)


@pytest.mark.parametrize("algorithm", list(ss.ALGORITHMS))
def test_replaying_the_calls_gives_the_picture(scene: ss.Scene, algorithm: str) -> None:
    frame = ss.render(scene, size=(40, 30), samples=1, background="white", algorithm=algorithm)
    for region in (None, (7, 5, 31, 22)):
        calls = record_calls(frame, region)
        x_start, y_start, x_end, y_end = calls.region
        assert np.array_equal(calls.replay(white(calls.region)), frame.color[y_start:y_end, x_start:x_end])
        inside = (calls.xy >= (x_start, y_start)).all() and (calls.xy < (x_end, y_end)).all()
        assert inside
        last = {tuple(xy): primitive for xy, primitive in zip(calls.xy.tolist(), calls.primitive.tolist())}
        assert all(frame.primitive[y, x] == primitive for (x, y), primitive in last.items())
        assert len(last) == int((frame.primitive[y_start:y_end, x_start:x_end] >= 0).sum())


@pytest.mark.parametrize("algorithm", ["scanline-eval", "scanline-zrow", "span-list"])
def test_a_sweep_sets_each_pixel_once_from_the_top_left(scene: ss.Scene, algorithm: str) -> None:
    calls = record_calls(ss.render(scene, size=(40, 30), samples=1, algorithm=algorithm))
    turns = calls.xy[:, 1] * 40 + calls.xy[:, 0]
    assert (np.diff(turns) > 0).all()


def test_other_algorithms_set_pixels_again(scene: ss.Scene) -> None:
    calls = record_calls(ss.render(scene, size=(40, 30), samples=1, algorithm="half-space"))
    assert len(np.unique(calls.xy, axis=0)) < len(calls.xy)
    assert calls.refused > 0
    for pixel in np.unique(calls.xy, axis=0):
        depth = calls.depth[(calls.xy == pixel).all(axis=1)]
        assert (np.diff(depth) >= 0).all()


def test_a_planted_fault_is_seen(scene: ss.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = ss.render(scene, size=(40, 30), samples=1, background="white", algorithm="half-space")

    original = write.pack_key

    def pack(depth: float, number: int) -> Any:
        return original(-depth, number)

    monkeypatch.setattr(write, "pack_key", pack)
    calls = record_calls(frame)
    assert not np.array_equal(calls.replay(white(calls.region)), frame.color)


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ((0, 0, 41, 30), r"region = \(0, 0, 41, 30\): expected a part of the image, 0, 0, 40, 30"),
        ((5, 5, 5, 9), "expected a part of the image"),
        ((-1, 0, 5, 9), "expected a part of the image"),
        ((1, 2, 3), r"region = \(1, 2, 3\): expected x_start, y_start, x_end, y_end, whole numbers of pixels"),
        ("all", "region = 'all': expected x_start"),
        ((0, 0, 2.5, 3), "whole numbers of pixels"),
    ],
)
def test_regions_that_are_none(scene: ss.Scene, region: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        record_calls(ss.render(scene, size=(40, 30), samples=1), region)


def test_a_region_that_is_too_large() -> None:
    frame = ss.render(ss.Points([(0, 0, 0)]), size=(1024, 512), samples=1)
    with pytest.raises(LimitError, match="region: 1024 x 512 pixels are more than the limit of 262144"):
        record_calls(frame)


@pytest.fixture(scope="module")
def session(scene: ss.Scene) -> ivscan.Session:
    """The scene, scan-converted."""
    return ivscan.scan(scene, (40, 30), region=(6, 4, 36, 26), zoom=16)


def test_the_log_makes_the_result(session: ivscan.Session) -> None:
    log = ivscan.write_log(session)
    assert np.array_equal(ivscan.replay_log(log), session.frame.color[4:26, 6:36])
    assert ivscan.is_exact(session)
    assert len(log.splitlines()) == 5 + len(session.calls.xy)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("scanspan setPixel log 1", "hello", "log: expected a log that begins with 'scanspan setPixel log 1'"),
        ("size 40 30", "size 40", "log: line 2: expected 'size' and 2 whole numbers"),
        ("region 6", "region x", "log: line 3: expected 'region' and 4 whole numbers"),
        ("calls ", "calls 9", "log: line 5: expected "),
        ("region 6 4 36 26", "region 35 25 36 26", "lies outside of the region"),
        (" 255 ", " 300 ", "log: line 6: expected x y r g b a primitive depth"),
    ],
)
def test_logs_that_are_wrong(session: ivscan.Session, before: str, after: str, message: str) -> None:
    log = ivscan.write_log(session)
    head, _, calls = log.partition("\ncalls")
    wrong = head.replace(before, after) + "\ncalls" + calls if before in head and before != " 255 " else log
    if wrong == log:
        wrong = head + ("\ncalls" + calls).replace(before, after, 1)
    with pytest.raises(FormatError) as caught:
        ivscan.replay_log(wrong)
    assert message in str(caught.value)


def test_views(session: ivscan.Session) -> None:
    pictures = {name: ivscan.draw_view(session, name) for name in ivscan.VIEWS}
    color = session.frame.color[4:26, 6:36]
    assert np.array_equal(pictures["result"][8::16, 8::16], color)
    assert {name: picture.shape for name, picture in pictures.items() if name != "input"} == dict.fromkeys(
        ("pixels", "edges", "calls", "result"), (352, 480, 4)
    )

    # The outlines run along the borders of pixels, and leave the inner parts as they are.
    changed = (pictures["pixels"] != pictures["result"]).any(axis=2)
    assert changed[::16].all()
    assert changed[:, ::16].all()
    assert not changed[2::16, 2::16].any()
    assert (pictures["edges"] != pictures["pixels"]).any()
    reddish = (pictures["edges"][..., 0] > 180) & (pictures["edges"][..., 1] < 60)
    assert reddish.sum() > 100

    # The calls are dark blue at first and yellow at the end; pixels that were not set are grey.
    x, y = session.calls.xy[0] - (6, 4)
    assert pictures["calls"][16 * y + 3, 16 * x + 3, 2] > 60 > pictures["calls"][16 * y + 3, 16 * x + 3, 1]
    x, y = session.calls.xy[-1] - (6, 4)
    assert pictures["calls"][16 * y + 3, 16 * x + 3, :2].min() > 200
    assert pictures["input"].shape[1] > 700
    with pytest.raises(InputError, match="view = 'all': expected one of input, pixels, edges, calls, result"):
        ivscan.draw_view(session, "all")


def test_edges_lie_where_the_corners_are_snapped_to() -> None:
    mesh = ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    session = ivscan.scan(ss.Scene(mesh), (32, 24), camera="front")
    lines, is_seen = ivscan.edge_lines(session)
    assert lines.shape == (3, 2, 2)
    assert is_seen.all()
    expected = session.frame.camera.project(mesh.positions, (32, 24))
    np.testing.assert_allclose(np.unique(lines.reshape(-1, 2), axis=0), np.unique(np.round(expected * 256) / 256, axis=0))


def test_the_animation_ends_with_the_result(session: ivscan.Session) -> None:
    with Image.open(io.BytesIO(ivscan.animate(session))) as animation:
        frames = getattr(animation, "n_frames", 1)
        assert 50 < frames <= ivscan.MAX_FRAMES
        animation.seek(0)
        first = np.asarray(animation.convert("RGB"))
        animation.seek(frames - 1)
        last = np.asarray(animation.convert("RGB")).astype(int)
    assert (first == 255).all()
    shown = ivscan.magnify(session.frame.color[4:26, 6:36], 16)[..., :3].astype(int)
    assert np.abs(last - shown).mean() < 3


def test_an_empty_region_is_shown_too(scene: ss.Scene) -> None:
    session = ivscan.scan(scene, (40, 30), region=(0, 0, 3, 3), zoom=24)
    assert len(session.calls.xy) == 0
    assert all(ivscan.draw_view(session, name).size for name in ivscan.VIEWS)
    assert ivscan.is_exact(session)
    assert ivscan.animate(session)[:3] == b"GIF"


@pytest.mark.parametrize("zoom", [0, -1, True, 1.5, 1000])
def test_zooms_that_are_none(scene: ss.Scene, zoom: Any) -> None:
    with pytest.raises(InputError, match=r"zoom = .*: expected a whole number from 1 to 102"):
        ivscan.scan(scene, (40, 30), zoom=zoom)


def run_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run scanspan and return how it ended."""
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "scanspan", "ivscan", *arguments], capture_output=True, text=True, timeout=300
    )  # fmt: skip


def test_the_command(tmp_path: Path) -> None:
    (tmp_path / "a.iv").write_text(HEADER + TEXT)
    ended = run_command(str(tmp_path / "a.iv"), "-o", str(tmp_path / "out"), "--size", "40x30", "--region", "6,4,36,26")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == f"{tmp_path / 'out'}\n"
    names = ["calls.gif", "calls.png", "calls.txt", "edges.png", "input.png", "pixels.png", "report.txt", "result.png"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == names
    with Image.open(tmp_path / "out" / "result.png") as picture:
        result = np.asarray(picture.convert("RGBA"))
    zoom = result.shape[1] // 30
    assert np.array_equal(ivscan.replay_log((tmp_path / "out" / "calls.txt").read_text()), result[::zoom, ::zoom])
    report = (tmp_path / "out" / "report.txt").read_text()
    assert "light 0, DirectionalLight at line 4, reaches 4 of 4 shapes: it shines on everything that follows" in report
    assert "light 1, PointLight at line 6, reaches 0 of 4 shapes: it shines on nothing" in report
    assert "the log makes the result: yes, to the bit" in report
    one = run_command(str(tmp_path / "a.iv"), "-o", str(tmp_path / "one"), "--view", "pixels", "--size", "20")
    assert one.returncode == 0, one.stderr
    assert [path.name for path in (tmp_path / "one").iterdir()] == ["pixels.png"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--view", "pixel"), "--view: unknown view 'pixel'; did you mean 'pixels'?"),
        (("--region", "1,2,3"), "--region = '1,2,3': expected X0,Y0,X1,Y1, four whole numbers"),
        (("--region", "0,0,999,9"), "expected a part of the image, 0, 0, 96, 72"),
        (("-o", "a.iv"), "is a file, expected a folder"),
    ],
)
def test_what_the_command_refuses(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    from scanspan.cli import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.iv").write_text(HEADER + TEXT)
    assert main(["ivscan", "a.iv", *arguments]) == 2
    assert message in capsys.readouterr().err
