"""The command line, end to end: what it prints and where, what it writes, how it ends, and every message."""

from __future__ import annotations

import inspect
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scanspan as ss
from scanspan import cli
from scanspan.cli import main
from scanspan.view.reporter import to_line

TETRAHEDRON = "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SMALL = ("--size", "64x48")

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the current folder, empty but for a small model."""
    (tmp_path / "model.obj").write_text(TETRAHEDRON)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """Give a function that runs the command in this process: exit code, standard output, standard error."""

    def call(*words: str) -> tuple[int, str, str]:
        code = main(words)
        written = capsys.readouterr()
        return code, written.out, "".join(line for line in written.err.splitlines(True) if "compiling kernels" not in line)

    return call


def files(folder: Path) -> set[str]:
    """Return the names of all files in a folder, hidden ones too."""
    return {path.name for path in folder.iterdir()}


def start(*words: str, **more: Any) -> subprocess.Popen[bytes]:
    """Start the command in a process of its own."""
    command = [sys.executable, "-m", "scanspan", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more)


# Pictures


def test_without_options_the_picture_has_the_model_s_name(run: Run, folder: Path) -> None:
    assert run("render", "model.obj", "--samples", "1") == (0, "model.png\n", "")
    with Image.open("model.png") as picture:
        assert picture.size == (1280, 960)
    assert files(folder) == {"model.obj", "model.png"}


def test_the_picture_is_the_one_that_the_library_renders(run: Run) -> None:
    assert run("render", "model.obj", "-o", "a.npy", "--resolution", "64,48") == (0, "a.npy\n", "")
    np.testing.assert_array_equal(np.load("a.npy"), ss.render(ss.load("model.obj"), size=(64, 48)).color)


@pytest.mark.parametrize(("name", "begin"), [("a.png", b"\x89PNG"), ("a.jpg", b"\xff\xd8"), ("a.ppm", b"P6\n64 48\n")])
def test_the_ending_chooses_the_format(run: Run, name: str, begin: bytes) -> None:
    assert run("render", "model.obj", *SMALL, "-o", name) == (0, f"{name}\n", "")
    assert Path(name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    "words",
    [
        "--camera-direction front", "--camera-direction 0,0,-1", "--camera-position 1,1,9", "--camera-azimuth-angle 30",
        "--camera-elevation-angle 20", "--camera-orthographic", "--camera-zoom-factor 2", "--camera-view-angle 60",
        "--camera-view-up 1,0,0", "--camera-focal-point 2,0,0", "--up z", "--no-background", "--background-color tomato",
        "--background-color 255,0,0", "--edges", "--color red", "--color 0.2,0.4,1.0", "--shading flat --color navy",
        "--samples 1", "--cull front",
    ],
)  # fmt: skip
def test_every_option_changes_the_picture(run: Run, words: str) -> None:
    plain = ss.render(ss.load("model.obj"), size=(64, 48)).color
    assert run("render", "model.obj", *SMALL, "-o", "a.npy", *words.split())[0] == 0
    assert not np.array_equal(np.load("a.npy"), plain)


@pytest.mark.parametrize("words", ["--threads 3", "--no-textures", "--algorithm half-space", "--max-pixels 9999", "--up +Y"])
def test_some_options_do_not(run: Run, words: str) -> None:
    assert run("render", "model.obj", *SMALL, "-o", "a.npy", *words.split())[0] == 0
    np.testing.assert_array_equal(np.load("a.npy"), ss.render(ss.load("model.obj"), size=(64, 48)).color)


def test_one_colour_replaces_those_of_vertices_and_keeps_faces(run: Run) -> None:
    colored = re.sub(r"(?m)^(v .*)$", r"\1 1 0 0", TETRAHEDRON)
    Path("colored.obj").write_text(colored)
    for name in ("model", "colored"):
        assert run("render", f"{name}.obj", *SMALL, "-o", f"{name}.npy", "--color", "#2050a0")[0] == 0
    np.testing.assert_array_equal(np.load("colored.npy"), np.load("model.npy"))


def test_a_vector_is_the_direction_of_sight_and_a_name_the_side_that_is_seen(run: Run) -> None:
    for name, words in (("a.npy", "front"), ("b.npy", "0,0,-1"), ("c.npy", "back")):
        assert run("render", "model.obj", *SMALL, "-o", name, "--camera-direction", words)[0] == 0
    np.testing.assert_array_equal(np.load("a.npy"), np.load("b.npy"))
    assert not np.array_equal(np.load("a.npy"), np.load("c.npy"))


# Arrays, sheets and numbers


def test_fields_go_into_one_file(run: Run) -> None:
    assert run("render", "model.obj", *SMALL, "--aov", "depth, primitive", "-o", "a.npz") == (0, "a.npz\n", "")
    frame = ss.render(ss.load("model.obj"), size=(64, 48))
    with np.load("a.npz") as arrays:
        assert set(arrays) == {"depth", "primitive"}
        np.testing.assert_array_equal(arrays["depth"], frame.depth)
        np.testing.assert_array_equal(arrays["primitive"], frame.primitive)


def test_all_fields_are_written_by_default(run: Run) -> None:
    assert run("render", "model.obj", *SMALL, "-o", "a.npz")[0] == 0
    with np.load("a.npz") as arrays:
        assert set(arrays) == {"color", "depth", "primitive", "object", "barycentric", "normal", "position", "uv"}
    assert run("render", "model.obj", *SMALL, "--aov", "uv")[:2] == (0, "model.npz\n")


def test_a_sheet_has_the_size_that_was_asked_for(run: Run) -> None:
    words = ("--views", "iso,front,right,top", "--size", "320x240", "-o", "a.png", "--json", "a.json")
    assert run("render", "model.obj", *words) == (0, "a.png\n", "")
    with Image.open("a.png") as picture:
        sheet = np.array(picture)
    assert sheet.shape == (240, 320, 4)
    records = json.loads(Path("a.json").read_text())
    assert [record["name"] for record in records] == ["iso", "front", "right", "top"]
    scales = [record["camera"]["units_per_pixel"] for record in records]
    assert scales == pytest.approx([scales[0]] * 4, rel=1e-9)
    for record in records:
        left, top, right, bottom = record["region"]
        assert [right - left, bottom - top] == record["size"]
        assert len(np.unique(sheet[top:bottom, left:right].reshape(-1, 4), axis=0)) > 30


def test_the_numbers_beside_a_picture(run: Run) -> None:
    assert run("render", "model.obj", *SMALL, "-o", "a.png", "--json", "a.json")[0] == 0
    record = json.loads(Path("a.json").read_text())
    frame = ss.render(ss.load("model.obj"), size=(64, 48))
    assert record["scanspan"] == ss.__version__
    assert (record["model"], record["output"], record["size"]) == ("model.obj", "a.png", [64, 48])
    assert record["counts"] == {"instances": 1, "triangles": 4, "primitives": 4, "drawn": 4, "cut": 0, "outside": 0}
    assert record["scene"]["bounds"] == [[0, 0, 0], [2, 1, 1]]
    assert record["scene"]["up"] == "+Y"
    assert record["coverage"] == frame.coverage
    assert record["blank"] is False
    camera = record["camera"]
    assert camera["kind"] == "perspective"
    np.testing.assert_array_equal(camera["clip"], frame.camera.clip_matrix((64, 48)))
    np.testing.assert_array_equal(camera["view"], frame.camera.view)
    np.testing.assert_array_equal(camera["projection"], frame.camera.projection((64, 48)))
    np.testing.assert_array_equal(camera["opencv"]["K"], frame.camera.to_opencv((64, 48))[0])
    rows, columns = np.nonzero(frame.primitive >= 0)
    assert record["seen_bounds"] == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    assert record["depth_range"] == [frame.depth.min(), frame.depth[frame.primitive >= 0].max()]


def test_the_scale_of_an_orthographic_picture(run: Run) -> None:
    words = ("--camera-orthographic", "--camera-direction", "front", "--json", "a.json", "-o", "a.npy")
    assert run("render", "model.obj", *SMALL, *words)[0] == 0
    record = json.loads(Path("a.json").read_text())
    assert record["camera"]["opencv"] is None
    assert record["camera"]["units_per_pixel_holds"] == "everywhere"
    left, _, right, _ = record["seen_bounds"]
    assert (right - left) * record["camera"]["units_per_pixel"] == pytest.approx(2.0, rel=0.04)


def test_a_picture_in_which_nothing_is_seen_is_blank(run: Run) -> None:
    words = ("--camera-position", "0,0,9", "--camera-focal-point", "0,0,99", "--json", "a.json", "-o", "a.png")
    said = "scanspan: nothing of the model is in the picture\n"
    assert run("render", "model.obj", *SMALL, *words) == (0, "a.png\n", said)
    record = json.loads(Path("a.json").read_text())
    assert (record["blank"], record["coverage"], record["seen_bounds"], record["depth_range"]) == (True, 0.0, None, None)


# Information


def test_what_is_in_a_file(run: Run) -> None:
    code, told, complaints = run("info", "model.obj")
    assert (code, complaints) == (0, "")
    for line in ("format      obj", "up          +Y", "bounds      0, 0, 0", "            2, 1, 1", "notes       none"):
        assert line in told.splitlines()
    record = json.loads(run("info", "model.obj", "--json")[1])
    assert record["counts"] == {"instances": 1, "triangles": 4, "primitives": 4}
    assert record["instances"][0]["kind"] == "mesh"
    assert record["bytes"] == len(TETRAHEDRON)


def test_what_this_machine_has(run: Run) -> None:
    code, told, complaints = run("info", "--json")
    record = json.loads(told)
    assert (code, complaints) == (0, "")
    assert record["scanspan"] == ss.__version__
    assert set(record["algorithms"]) == set(ss.ALGORITHMS)
    assert record["threads"] >= 1


def test_notes_of_the_reader_are_told_once(folder: Path) -> None:
    # In a process of its own: what the reader logs as well would be printed by Python's logger of last resort.
    (folder / "model.obj").write_text("mtllib gone.mtl\nusemtl a\n" + TETRAHEDRON)
    ended = start("render", "model.obj", *SMALL)
    printed, complaints = ended.communicate(timeout=300)
    assert printed == b"model.png\n"
    assert complaints.count(b"gone.mtl") == 1
    assert b"scanspan: note: model.obj: " in complaints


def test_version_and_help(run: Run) -> None:
    assert run("--version") == (0, f"scanspan {ss.__version__}\n", "")
    for words in ((), ("--help",), ("-h",)):
        code, printed, complaints = run(*words)
        assert (code, complaints) == (0, "")
        assert "scanspan render model.glb -o picture.png" in printed


def test_help_names_every_option_and_leaves_numba_alone() -> None:
    heavy = "{'numba', 'numpy', 'PIL', 'trimesh'}"
    code = (
        f"import sys; from scanspan.cli import main; main(['render', '--help']); print('heavy:', *{heavy} & set(sys.modules))"
    )
    environment = {**os.environ, "COLUMNS": "160"}
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=environment)
    assert shown.stdout.splitlines()[-1] == "heavy:"
    for option in ("--output", "--views", "--aov", "--json", "--camera-azimuth-angle", "--max-pixels", "--crease-angle"):
        assert option in shown.stdout


# Bad input: one line, exit code 2, and no file

BAD = {
    "render": "Missing argument 'MODEL'",
    "render gone.obj": "gone.obj: there is no such file",
    "render .": ".: it is a folder, expected a model file",
    "render nan.obj": "nan.obj: positions[2] = (0.0, nan, 0.0): a vertex that is used is not finite",
    "render index.obj": "index.obj: line 4: vertex 9 does not exist, there are 3",
    "render empty.obj": "empty.obj: the file has no faces",
    "render zero.obj": "zero.obj: the file is empty",
    "render short.stl": "short.stl: byte 80: expected 50084 bytes for 1000 triangles, the file has 200",
    "render model.obj --size 0": "--size: size = (0, 0): expected (width, height), two whole numbers above 0",
    "render model.obj --resolution -4,4": "--resolution: size = (-4, 4): expected (width, height), two whole numbers above 0",
    "render model.obj --size 1000000": "--size: size = (1000000, 1000000): the limit is 262144 for a side",
    "render model.obj --size 40000": "size = (40000, 40000): 1600000000 pixels, the limit is --max-pixels=268435456",
    "render model.obj --size 4x": "--size = '4x': expected WxH, such as 1920x1080, or one number",
    "render model.obj --resolution 4": "--resolution = '4': expected W,H, such as 1920,1080",
    "render model.obj --size 4 --resolution 4,4": "--resolution and --size say the same: give one of them",
    "render model.obj --shading flta": "unknown shading 'flta'; did you mean 'flat'? The valid ones are: auto, smooth, flat",
    "render model.obj --algorithm magic": "unknown algorithm 'magic'; the valid ones are: ",
    "render model.obj --cull all": "unknown cull 'all'; the valid ones are: none, back, front",
    "render model.obj --samples 3": "--samples = 3: must be one of 1, 2, 4, 8, 16",
    "render model.obj --samples x": "Invalid value for '--samples': ",
    "render model.obj --threads 0": "--threads = 0: must be a whole number from 1 to 4096",
    "render model.obj --crease-angle 999": "--crease-angle = 999.0: must be a number from 0 to 180",
    "render model.obj --line-width nan": "--line-width = nan: must be a number from 0 to 1000",
    "render model.obj --max-triangles 0": "--max-triangles = 0: expected a whole number above 0",
    "render model.obj --max-pixels 9": "size = (1280, 960): 1228800 pixels, the limit is --max-pixels=9",
    "render model.obj --nonfinite keep": "unknown value of nonfinite 'keep'; the valid ones are: error, drop",
    "render model.obj --file-type max": "unknown file type 'max'; the valid ones are: ",
    "render model.obj --up Q": "--up: unknown axis 'Q'; the valid ones are: +X, -X, +Y, -Y, +Z, -Z",
    "render model.obj --camera-direction frnt": "--camera-direction: unknown direction 'frnt'; did you mean 'front'? ",
    "render model.obj --camera-direction 0,0,0": "--camera-direction = '0,0,0': expected a direction, not 0,0,0",
    "render model.obj --camera-position 1,2": "--camera-position = '1,2': expected three numbers x,y,z",
    "render model.obj --camera-position 1,2,inf": "--camera-position = '1,2,inf': expected three numbers x,y,z",
    "render model.obj --camera-position 1,.5,.5": "--camera-position = 1,0.5,0.5: the eye lies in the focal point",
    "render model.obj --camera-view-up 0,0,0": "--camera-view-up = '0,0,0': expected a direction, not 0,0,0",
    "render model.obj --camera-view-angle 180": "--camera-view-angle = 180.0: expected degrees between 0 and 180",
    "render model.obj --camera-view-angle nan": "--camera-view-angle = nan: expected degrees between 0 and 180",
    "render model.obj --camera-zoom-factor 0": "--camera-zoom-factor = 0.0: expected a number above 0",
    "render model.obj --camera-azimuth-angle inf": "--camera-azimuth-angle = inf: expected degrees",
    "render model.obj --camera-elevation-angle nan": "--camera-elevation-angle = nan: expected degrees",
    "render model.obj --background-color no": "--background-color: 'no' is no colour",
    "render model.obj --no-background --background-color red": "--no-background and --background-color do not go together",
    "render model.obj --color 1,2,300": "--color: colour = (1, 2, 300): expected integers between 0 and 255",
    "render model.obj -o a.gif": "--output: unknown image format '.gif'; the valid ones are: .png",
    "render model.obj -o gone/a.png": "--output = 'gone/a.png': the folder 'gone' does not exist",
    "render model.obj -o folder.png": "--output = 'folder.png': expected the name of a file",
    "render model.obj --json -": "--json = '-': expected the name of a file",
    "render model.obj --json model.obj": "--json = 'model.obj': is the model itself, which is not overwritten",
    "render model.obj -o a.png --json a.png": "--json = 'a.png': is the --output too",
    "render model.obj --aov depht -o a.npz": "--aov: unknown field 'depht'; did you mean 'depth'? The valid ones are: color",
    "render model.obj --aov depth -o a.png": "--aov writes arrays: expected an --output that ends in .npz, got 'a.png'",
    "render model.obj --views iso -o a.npz": "--views makes one picture: expected an --output that is none of arrays",
    "render model.obj --views iso,frnt": "--views: unknown direction 'frnt'; did you mean 'front'? The valid ones are: iso",
    "render model.obj --views iso --camera-position 1,1,1": "--views chooses where the eye stands: leave out ",
    "render model.obj --camera-index 0": "--camera-index = 0: the file has no cameras",
    "render model.obj --views iso,top --size 1": "size = (1, 1): too small for 2 views",
    "render model.obj --bogus": "No such option: --bogus",
    "render model.obj more": "Got unexpected extra argument",
    "render model.obj -o": "Option '-o' requires an argument",
    "paint": "No such command 'paint'",
    "info gone.obj": "gone.obj: there is no such file",
}  # fmt: skip


@pytest.mark.parametrize("words", BAD)
def test_bad_input_is_one_line(run: Run, folder: Path, words: str) -> None:
    triangle = "v 0 0 0\nv 1 0 0\nv 0 {} 0\nf 1 2 {}\n"
    (folder / "nan.obj").write_text(triangle.format("nan", 3))
    (folder / "index.obj").write_text(triangle.format(1, 9))
    (folder / "empty.obj").write_text("v 0 0 0\n")
    (folder / "zero.obj").write_bytes(b"")
    (folder / "short.stl").write_bytes(bytes(80) + (1000).to_bytes(4, "little") + bytes(116))
    (folder / "folder.png").mkdir()
    before = files(folder)
    code, printed, complaints = run(*words.split())
    assert (code, printed) == (2, "")
    assert complaints.startswith(f"scanspan: error: {BAD[words]}")
    assert complaints.count("\n") == 1
    assert files(folder) == before
    assert (folder / "model.obj").read_text() == TETRAHEDRON


def test_a_model_with_the_ending_of_a_picture_is_not_overwritten(run: Run, folder: Path) -> None:
    (folder / "model.obj").rename("model.png")
    assert run("render", "model.png", "--file-type", "obj")[::2] == (
        2, "scanspan: error: --output = 'model.png': is the model itself, which is not overwritten\n",
    )  # fmt: skip
    assert (folder / "model.png").read_text() == TETRAHEDRON


def test_names_cannot_write_on_the_terminal(run: Run) -> None:
    assert to_line("a\nb\x1b[31m\x07é") == "a\\nb\\x1b[31m\\x07é"
    code, _, complaints = run("render", "a\n\x1b[2J.obj")
    assert code == 2
    assert complaints == "scanspan: error: a\\n\\x1b[2J.obj: there is no such file\n"


def test_a_failed_write_leaves_what_was_there(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "a.png").write_text("precious")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    assert run("render", "model.obj", *SMALL, "-o", "a.png") == (
        2, "", "scanspan: error: a.png: cannot be written: No space left on device\n",
    )  # fmt: skip
    assert (folder / "a.png").read_text() == "precious"
    assert files(folder) == {"model.obj", "a.png"}


@pytest.mark.parametrize(
    ("fault", "code", "message"),
    [
        (KeyError("x"), 3, "error: a fault of scanspan: KeyError: 'x'; --verbose shows where"),
        (MemoryError(), 2, "error: this needs more memory than there is"),
        (PermissionError(13, "Permission denied", "secret"), 2, "error: secret: permission denied"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_how_it_ends(run: Run, monkeypatch: pytest.MonkeyPatch, fault: BaseException, code: int, message: str) -> None:
    def fail(*_: object, **__: object) -> None:
        raise fault

    monkeypatch.setattr("scanspan.assets.load.load", fail)
    monkeypatch.delenv("SCANSPAN_DEBUG", raising=False)
    assert run("render", "model.obj") == (code, "", f"scanspan: {message}\n")
    if code == 3:
        assert "Traceback" in run("render", "model.obj", "--verbose")[2]
        monkeypatch.setenv("SCANSPAN_DEBUG", "1")
        assert "Traceback" in run("render", "model.obj")[2]


# In a process of its own


def test_a_picture_on_standard_output_is_nothing_else(folder: Path) -> None:
    ended = start("render", "model.obj", *SMALL, "-o", "-")
    printed, complaints = ended.communicate(timeout=300)
    assert ended.returncode == 0
    assert b"\x1b" not in complaints
    with Image.open(io.BytesIO(printed)) as picture:
        assert (picture.format, picture.size) == ("PNG", (64, 48))
    assert printed.endswith(b"IEND\xaeB`\x82")
    assert files(folder) == {"model.obj"}


def test_a_reader_that_goes_away_is_no_error(folder: Path) -> None:
    ended = start("render", "model.obj", *SMALL, "-o", "-")
    assert ended.stdout is not None
    assert ended.stderr is not None
    ended.stdout.close()
    complaints = ended.stderr.read()
    ended.stderr.close()
    assert ended.wait(300) == 0
    assert b"Error" not in complaints
    assert b"error" not in complaints


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs the signals of POSIX")
def test_an_interrupt_ends_it_at_once_and_leaves_nothing(folder: Path) -> None:
    ended = start("render", "model.obj", "--size", "6000", "--samples", "16", "--verbose", "-o", "big.png")
    assert ended.stderr is not None
    while b"rendering" not in (line := ended.stderr.readline()):
        assert line, "it ended before it rendered"
    ended.send_signal(signal.SIGINT)
    asked = time.perf_counter()
    _, complaints = ended.communicate(timeout=60)
    assert time.perf_counter() - asked < 5.0, "a busy machine may take more than the second that is promised, but not this"
    assert ended.returncode == 130
    assert complaints.splitlines()[-1] == b"scanspan: interrupted"
    assert files(folder) == {"model.obj"}


@pytest.mark.slow
def test_after_warming_nothing_is_compiled(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    cache = str(tmp_path_factory.mktemp("cache"))
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    for expected in (r"^(\d+) kernels ready, \1 of them compiled now, in ", r"^\d+ kernels ready, 0 of them compiled now, in "):
        ended = start("warm", env=environment)
        printed, complaints = ended.communicate(timeout=500)
        assert (ended.returncode, cache in printed.decode()) == (0, True)
        assert re.match(expected, printed.decode())
        assert bool(re.search(r"^compiling took \d+ s, \d\.\d s a kernel$", printed.decode(), re.M)) == ("\\1" in expected)
        assert complaints.count(b"compiling kernels for this machine, once") == expected.count("\\1")
    for words in (
        ("-e", "-o", "a.npz"),
        ("--views", "iso,top"),
        ("--camera-orthographic", "--shading", "flat", "--cull", "back"),
    ):
        ended = start("render", "model.obj", *SMALL, *words, env=environment)
        assert ended.communicate(timeout=300)[1] == b""


def test_the_command_has_the_defaults_of_the_library() -> None:
    library = inspect.signature(ss.render).parameters
    command = inspect.signature(cli.render).parameters
    for name in ("crease_angle", "samples", "shading", "cull", "algorithm", "line_width"):
        assert command[name].default == library[name].default, name
