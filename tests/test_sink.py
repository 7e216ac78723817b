"""Sinks: what is written row by row is the picture made in memory, the file is whole or as it was, and memory does not grow."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scanspan as ss
from scanspan.target import picture
from scanspan.target.image import encode_image

SIZE = (40, 37)  # bands of 5 or 8 rows leave a last one of another height
CAMERA = ss.Camera.look_at((0.4, 0.5, 4.0), (0.0, 0.0, 0.0), fov=40)
STAR = np.array([(np.cos(a), np.sin(a), 0.3 * np.sin(a)) for a in 0.2 + 0.8 * np.pi * np.arange(5)])


def all_kinds() -> ss.Scene:
    """A mesh that crosses the near plane of a camera inside, polygons of both rules, segments and points."""
    corners = [(x, y, z) for x in (-0.6, 0.6) for y in (-0.6, 0.6) for z in (-0.6, 0.6)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    uv = {"uv": np.array(corners)[:, :2] + 0.5}
    checks = ss.Texture(np.array([[(250, 40, 30), (20, 90, 250)], [(255, 255, 255), (10, 200, 60)]], np.uint8))
    return ss.Scene([
        ss.Instance(ss.Mesh.from_polygons(corners, faces, uv), material=ss.Material(texture=checks)),
        ss.Polygons([STAR, 1.2 * STAR[:3] - (0, 0, 0.2)], colors=[(255, 200, 0, 255), (0, 180, 255, 120)]),
        ss.Polygons([np.add(STAR, (0.3, 0.2, 0.4))], fill_rule="non-zero"),
        ss.Points([(0.5, 0.9, 0.5), (-0.9, -0.2, 1)], size=5),
        ss.Segments([(-1, -1, 1), (1, 0.8, -1)], [(0, 1)], width=2),
    ])  # fmt: skip


SCENE = all_kinds()
WAYS = [(name, "rows") for name in ss.ALGORITHMS] + [(name, "hilbert") for name in ("half-space", "warnock", "micropolygon")]


def check(
    folder: Path, rows: int, monkeypatch: pytest.MonkeyPatch, camera: Any = CAMERA, size: Any = SIZE, **options: Any
) -> None:
    """Write a picture to both kinds of sink in bands of some rows, and compare the files with the picture made in memory."""
    monkeypatch.setattr(picture, "BAND_PIXELS", rows * size[0] + 3)
    pixels = ss.render(SCENE, camera, size, **options).color
    assert len(np.unique(pixels.reshape(-1, 4), axis=0)) > 5
    for ending in ("ppm", "npy"):
        path = folder / f"picture.{ending}"
        assert ss.render(SCENE, camera, size, out=path, **options) == path
        assert path.read_bytes() == encode_image(pixels, ending)
    assert np.array_equal(np.load(folder / "picture.npy"), pixels)


@pytest.mark.parametrize(("algorithm", "order"), WAYS, ids=str)
def test_every_algorithm_writes_what_it_paints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, algorithm: str, order: str
) -> None:
    check(tmp_path, 5, monkeypatch, samples=1, algorithm=algorithm, order=order)
    check(tmp_path, 8, monkeypatch, samples=4, algorithm=algorithm, order=order, background="transparent")


@pytest.mark.parametrize("rows", [1, 3, 36, 37, 1000])
def test_bands_of_any_height(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    check(tmp_path, rows, monkeypatch, samples=2, threads=2)


@pytest.mark.parametrize(
    "options",
    [
        {"subpixel_bits": 16, "samples": 4},
        {"subpixel_bits": 4, "samples": 16},
        {"background": ("red", (0, 0, 255, 30)), "samples": 4},
        {"background": "white", "blend": "srgb", "samples": 2},
        {"cull": "back", "shading": "smooth", "edges": True},
        {"cull": "front", "shading": "flat", "textures": False, "samples": 1, "threads": 3},
    ],
    ids=str,
)
def test_every_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any]) -> None:
    check(tmp_path, 7, monkeypatch, **options)


@pytest.mark.parametrize("algorithm", ["half-space", "homogeneous", "scanline-zrow", "span-list", "warnock"])
def test_seen_from_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, algorithm: str) -> None:
    inside = ss.Camera.look_at((0.1, 0.05, 0.2), (0.5, 0.3, -0.9), fov=95, near=0.15)
    check(tmp_path, 4, monkeypatch, camera=inside, samples=4, algorithm=algorithm)


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (50, 1), (3, 101)])
def test_pictures_of_odd_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]) -> None:
    monkeypatch.setattr(picture, "BAND_PIXELS", 7)
    for ending in ("ppm", "npy"):
        path = ss.render(SCENE, "iso", size, out=tmp_path / f"picture.{ending}")
        assert path.read_bytes() == encode_image(ss.render(SCENE, "iso", size).color, ending)


def test_a_scene_in_which_nothing_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "BAND_PIXELS", 100)
    away = ss.Camera.look_at((0, 0, 4), (0, 0, 9))
    path = ss.render(SCENE, away, SIZE, out=tmp_path / "picture.npy", background="red")
    assert (np.load(path) == (255, 0, 0, 255)).all()


def test_transparent_pictures_are_laid_over_white_in_ppm(tmp_path: Path) -> None:
    path = ss.render(
        ss.Points([(0, 0, 0)], size=9, colors=(0, 0, 0)), CAMERA, (30, 20), background="transparent", out=tmp_path / "a.ppm"
    )
    header, pixels = path.read_bytes()[:13], np.frombuffer(path.read_bytes()[13:], np.uint8).reshape(20, 30, 3)
    assert header == b"P6\n30 20\n255\n"
    assert (pixels[0, 0] == 255).all()
    assert pixels.min() < 60


def test_a_picture_for_a_file_may_have_more_pixels_than_the_limit(tmp_path: Path) -> None:
    with pytest.raises(ss.LimitError, match=r"^size = \(40, 37\): 1480 pixels, the limit is max_pixels=100$"):
        ss.render(SCENE, CAMERA, SIZE, max_pixels=100)
    path = ss.render(SCENE, CAMERA, SIZE, max_pixels=100, out=str(tmp_path / "PICTURE.PPM"))
    assert path == tmp_path / "PICTURE.PPM"
    assert path.read_bytes() == encode_image(ss.render(SCENE, CAMERA, SIZE).color, "ppm")


# What cannot be written


@pytest.mark.parametrize("out", ["a.png", "a", "", ".ppm", "a.ppm.gz", "a.npz", 3, b"a.ppm", True, ["a.ppm"]], ids=repr)
def test_anything_but_a_ppm_or_npy_is_refused(out: Any) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.render(SCENE, CAMERA, SIZE, out=out)
    assert str(caught.value) == f"out = {out!r}: expected the name of a file that ends in .ppm or .npy"


def test_places_that_cannot_be_written_to_are_named(tmp_path: Path) -> None:
    lost = tmp_path / "nowhere" / "a.ppm"
    with pytest.raises(ss.InputError) as caught:
        ss.render(SCENE, CAMERA, SIZE, out=lost)
    assert str(caught.value).startswith(f"{lost}: the folder '{lost.anchor}")
    assert str(caught.value).endswith("does not exist")
    folder = tmp_path / "folder.npy"
    folder.mkdir()
    with pytest.raises(ss.InputError) as caught:
        ss.render(SCENE, CAMERA, SIZE, out=folder)
    assert str(caught.value) == f"{folder}: is a folder; expected the name of a file"
    assert os.listdir(tmp_path) == ["folder.npy"]


def test_bad_options_are_refused_before_a_file_is_touched(tmp_path: Path) -> None:
    path = tmp_path / "a.ppm"
    path.write_bytes(b"before")
    for options in ({"size": (0, 4)}, {"samples": 3}, {"background": "greeen"}, {"algorithm": "z"}, {"threads": 0}):
        with pytest.raises(ss.InputError):
            ss.render(SCENE, CAMERA, **{"size": SIZE, "out": path, **options})
    assert path.read_bytes() == b"before"
    assert os.listdir(tmp_path) == ["a.ppm"]


@pytest.mark.parametrize("fault", [MemoryError, KeyboardInterrupt, OSError(28, "No space left on device")])
@pytest.mark.parametrize("ending", ["ppm", "npy"])
def test_what_was_there_stays_when_rendering_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, fault: Any
) -> None:
    path = tmp_path / f"a.{ending}"
    whole, bands = ss.render(SCENE, CAMERA, SIZE, out=path).read_bytes(), []
    resolve = picture.resolve

    def fail_in_the_middle(*arguments: Any) -> Any:
        bands.append(os.listdir(tmp_path))
        if len(bands) == 4:
            raise fault
        return resolve(*arguments)

    monkeypatch.setattr(picture, "BAND_PIXELS", 5 * SIZE[0])
    monkeypatch.setattr(picture, "resolve", fail_in_the_middle)
    for present in (True, False):
        bands.clear()
        # Errors of the system say what they are about; all others go through.
        with pytest.raises(ss.InputError if isinstance(fault, OSError) else fault):
            ss.render(SCENE, CAMERA, SIZE, background="red", out=path)
        assert len(bands) == 4
        assert len(bands[-1]) == 1 + present
        assert os.listdir(tmp_path) == [path.name] * present
        if present:
            assert path.read_bytes() == whole
            path.unlink()


# Pictures taller than memory

TALL = """
import sys
import numpy as np
import scanspan as ss

def ladder(rungs):
    y = np.arange(rungs)[:, None] / rungs
    corners = np.array([(-0.1, 0.1), (0.2, 0.35), (-0.15, 0.83)]) * (1, 1 / rungs)
    points = np.concatenate([np.stack([corners[:, 0] + 0 * y, corners[:, 1] + y], axis=-1), np.zeros((rungs, 3, 1))], axis=2)
    palette = np.random.default_rng(4).integers(0, 256, (rungs, 3))
    colors = {"color": np.repeat(palette, 3, axis=0)}
    mesh = ss.Mesh(points.reshape(-1, 3), np.arange(3 * rungs).reshape(-1, 3), attributes=colors)
    return ss.Scene([mesh, ss.Polygons([[(-0.4, 0.2, -0.1), (0.3, 0.3, -0.1), (0, 0.4, -0.1)]])])

def camera(width, height):
    # What is seen is as wide as it is high.
    view, projection = np.eye(4), np.diag([2.0, 2.0, -1.0, 1.0])
    view[1, 3] = -0.5
    view[2, 3] = -1.0
    return ss.Camera.from_matrix(view, projection)

def write(width, height, path, algorithm):
    ss.render(ladder(200), camera(width, height), (width, height), out=path, samples=1, threads=1, algorithm=algorithm)

if __name__ == "__main__":
    exec(sys.argv[1])
"""

# A process takes over the peak of the one that starts it, so a small one stands between.
MEASURE = """
import resource, subprocess, sys
subprocess.run([sys.executable, "-W", "error", "-c", *sys.argv[1:]], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def peak(width: int, height: int, path: Path, algorithm: str) -> int:
    """Return the peak memory of a process of its own that writes a picture."""
    call = f"write({width}, {height}, {str(path)!r}, {algorithm!r})"
    ended = subprocess.run([sys.executable, "-c", MEASURE, TALL, call], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return int(ended.stdout)


@pytest.mark.skipif(sys.platform == "win32", reason="peak memory is asked for in the way of Unix")
@pytest.mark.parametrize(("algorithm", "ending"), [("span-list", "npy")])
def test_memory_does_not_grow_with_the_height_of_the_picture(tmp_path: Path, algorithm: str, ending: str, report: Any) -> None:
    path = tmp_path / f"a.{ending}"
    peak(500, 10, path, algorithm)
    low, high = peak(500, 1000, path, algorithm), peak(500, 100_000, path, algorithm)
    report(f"{algorithm}: 1,000 rows in {low:,}, 100,000 rows in {high:,}, which is {high / low:.3f} times as much")
    assert high <= 1.05 * low
    assert path.stat().st_size == 500 * 100_000 * (4 if ending == "npy" else 3) + (128 if ending == "npy" else 18)
    path.unlink()


def test_a_tall_picture_is_that_of_memory(tmp_path: Path) -> None:
    names: dict[str, Any] = {"__name__": "tall"}
    exec(TALL, names)
    scene, size = names["ladder"](200), (9, 100_000)
    pixels = ss.render(scene, names["camera"](*size), size, samples=1).color
    for algorithm, ending in (("half-space", "npy"), ("span-list", "ppm")):
        path = ss.render(scene, names["camera"](*size), size, samples=1, algorithm=algorithm, out=tmp_path / f"a.{ending}")
        assert path.read_bytes() == encode_image(pixels, ending)
