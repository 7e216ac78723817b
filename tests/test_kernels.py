"""Kernels: the same bits compiled and not, one signature each, and cached in a second process."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import scanspan as ss
from scanspan.assets import buffers
from scanspan.geometry import clip, project
from scanspan.jit import cache_folder, signature_count
from scanspan.raster import (
    active_edges,
    edge_walk,
    half_space,
    homogeneous_edges,
    micropolygon,
    order,
    polygon,
    scanline,
    setup,
    span_list,
    warnock,
)
from scanspan.shade import interpolate, light, shading, wireframe
from scanspan.target import merge, resolve, visibility

# A scene that goes through every stage: clipped, textured, coloured, with edges, lines and points, and all targets.
SCENE = """
import hashlib
import numpy as np
import scanspan as ss

rng = np.random.default_rng(5)
clip = rng.normal(size=(60, 4))
triangles = np.arange(60).reshape(-1, 3)
digest = hashlib.sha256()
point = ss.OffscreenPoint(-3, 5)
choices = [{}, {"samples": 4}, {"depth_bits": 64}, {"subpixel_bits": 16}, {"rule": point}, {"cull": "back"}]
orders = ["serpentine", "tiles", "morton", "hilbert"]
choices += [{"algorithm": name} for name in ss.ALGORITHMS] + [{"order": order} for order in orders]
choices += [{"algorithm": "homogeneous", "order": "morton", "depth_bits": 64}, {"algorithm": "warnock", "coverage": "touched"}]
choices += [{"coverage": "touched"}, {"coverage": "inside", "order": "hilbert"}]
for options in choices:
    seen = ss.rasterize(clip, triangles, (24, 18), **options)
    codes = ss.interpolate(seen, np.arange(180, dtype=np.uint8).reshape(60, 3), dtype=np.uint8)
    for part in (seen.primitive, seen.depth, seen.barycentric, ss.interpolate(seen, clip), codes):
        digest.update(np.ascontiguousarray(part).tobytes())
digest.update(ss.count(rng.uniform(-9, 40, (30, 3, 2)), (24, 18)).tobytes())
digest.update(ss.count(rng.uniform(-1e6, 1e6, (30, 3, 2)), (24, 18), subpixel_bits=16).tobytes())

image = rng.integers(0, 256, (3, 5, 4), dtype=np.uint8)
square = ss.Mesh.from_polygons(
    [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 1)], [(0, 1, 2, 3)],
    attributes={"uv": [(0, 0), (3, 0), (3, 3), (0, 3)], "color": [(255, 0, 0), (0, 255, 0), (0, 0, 255), (9, 9, 9)]},
)
scene = ss.Scene([
    ss.Instance(square, material=ss.Material(texture=ss.Texture(image))),
    ss.Segments([(0, 0, 1), (2, 2, 1)], [(0, 1)], width=2), ss.Points([(1, 0, 1)], size=3),
])
camera = ss.Camera.look_at((1, 1, 1.2), (1, 1.5, 0), fov=90, near=0.9)
frame = ss.render(scene, camera, (24, 18), edges=True, shading="smooth")
digest.update(frame.color.tobytes())
for name in ("depth", "primitive", "object", "barycentric", "normal", "position", "uv"):
    digest.update(np.ascontiguousarray(getattr(frame, name)).tobytes())
print(frame.counters["cut"], digest.hexdigest())
"""


def run_scene(**environment):
    """Run the scene in a process of its own and return what it prints."""
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCENE],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr[-2000:]
    return result.stdout.split()


def test_plain_python_gives_the_bits_of_the_compiled_kernels():
    compiled, plain = run_scene(), run_scene(NUMBA_DISABLE_JIT="1")
    assert int(compiled[0]) > 0
    assert compiled == plain


def kernels():
    """All kernels of the stages, by name."""
    modules = (
        buffers, clip, project, setup, active_edges, half_space, order, homogeneous_edges, edge_walk, scanline, span_list,
        warnock, micropolygon, polygon, interpolate, light, shading, wireframe, merge, resolve, visibility,
    )  # fmt: skip
    found = {}
    for module in modules:
        for name, value in vars(module).items():
            if (
                hasattr(value, "py_func")
                and value.py_func.__module__ == module.__name__
                and not value.targetoptions.get("forceinline")
            ):
                found[f"{module.__name__}.{name}"] = value
    return found


def odd_layouts(array):
    """The same numbers as callers may have them: other types, orders, strides, read-only."""
    yield array
    yield np.asfortranarray(array)
    yield array[::-1][::-1]
    yield array.astype(np.float32)
    yield array.astype(">f8")
    yield array.tolist()
    frozen = array.copy()
    frozen.flags.writeable = False
    yield frozen
    yield np.repeat(array, 2, axis=0)[::2]


def test_no_kernel_is_compiled_twice_for_odd_inputs():
    before = {name: signature_count(kernel) for name, kernel in kernels().items()}
    clip_coordinates = np.array([(-1, -1, 0, 1), (3, -1, 0, 1), (-1, 3, 0, 1.0)])
    pictures = []
    for layout in odd_layouts(clip_coordinates):
        for triangles in ([(0, 1, 2)], np.array([(0, 1, 2)], np.uint8), np.array([(0, 1, 2)], np.int32, order="F")):
            seen = ss.rasterize(layout, triangles, (np.int16(8), 6))
            ss.interpolate(seen, layout)
            pictures.append(seen.primitive)
        for name in ss.ALGORITHMS:
            pictures.append(ss.rasterize(layout, [(0, 1, 2)], (8, 6), algorithm=name).primitive)
        ss.rasterize(layout, [(0, 1, 2)], (8, 6), coverage="touched", order="morton")
    for layout in odd_layouts(np.array([[(0, 0), (8, 0), (0, 8.0)]])):
        ss.count(layout, (8, 6))
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)
    after = {name: signature_count(kernel) for name, kernel in kernels().items()}
    assert any(before[name] != after[name] or after[name] == 1 for name in after)
    assert {name: after[name] for name in after if after[name] > max(1, before[name])} == {}


def test_the_list_of_kernels_is_not_empty():
    names = kernels()
    assert "scanspan.raster.half_space.half_space_keys" in names
    assert "scanspan.raster.homogeneous_edges.outline_kernel" in names
    assert "scanspan.raster.setup.set_up_outlines" in names
    assert len(names) > 60


def test_inputs_are_not_changed():
    clip_coordinates = np.array([(-1, -1, 0, 1), (3, -1, 0, 1), (np.nan, 3, 0, 1.0)])
    triangles = np.array([(0, 1, 2)], np.int32)
    before = clip_coordinates.copy(), triangles.copy()
    ss.rasterize(clip_coordinates, triangles, (8, 6), nonfinite="drop")
    assert np.array_equal(clip_coordinates, before[0], equal_nan=True)
    assert np.array_equal(triangles, before[1])


def test_kernels_find_a_place_for_their_code_when_nothing_is_writable(monkeypatch, tmp_path):
    from scanspan import jit

    monkeypatch.setattr(jit.config, "CACHE_DIR", "")
    monkeypatch.setattr(jit, "_is_writable", lambda folder: str(folder).startswith(str(tmp_path)))
    monkeypatch.setattr(jit.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = cache_folder()
    assert folder.startswith(str(tmp_path))
    assert os.stat(os.path.dirname(folder)).st_mode & 0o777 == 0o700
    assert cache_folder() == folder


def test_a_changed_helper_is_compiled_again(tmp_path):
    """Machine code of another state of the sources is never run, though numba looks only at a kernel's own file."""
    import shutil

    package = tmp_path / "scanspan"
    shutil.copytree(os.path.dirname(ss.__file__), package, ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-c", "import scanspan as ss; print(ss.count([[(0, 0), (3, 0), (0, 3)]], (3, 3)).sum())"]
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment["PYTHONPATH"] = str(tmp_path)

    def covered():
        result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return int(result.stdout)

    assert covered() == 3
    helper = package / "raster" / "edge.py"
    rule = "return np.int64(0) if owns else np.int64(-1)"
    assert rule in helper.read_text()
    helper.write_text(helper.read_text().replace(rule, "return np.int64(0)"))
    assert covered() == 6
    assert len(list((package / "__pycache__").glob("kernels-*"))) == 1


@pytest.mark.parametrize("name", ["half_space_keys", "half_space_hits"])
def test_rows_are_scanned_with_vector_instructions(name, tmp_path, report):
    """The loop over a row compiles to vector code; looked up in the machine code, on x86 with AVX2."""
    script = f"""
import llvmlite.binding as llvm, numpy as np, sys
from scanspan.geometry.project import screen_triangles
from scanspan.raster import half_space
from scanspan.raster.counters import COUNTERS
from scanspan.raster.options import make_sampling
if not dict(llvm.get_host_cpu_features()).get("avx2"):
    print("no AVX2"); sys.exit()
kernel = half_space.{name}
target = np.zeros((8, 8), np.int64 if {name!r} == "half_space_keys" else np.int32)
sampling = make_sampling((8, 8), (128, 128), rule="top-left", cull="none", subpixel_bits=8)
kernel(target, np.zeros(COUNTERS, np.int64), screen_triangles(np.zeros((1, 3, 2)), 8), 0, 1, sampling)
lines = [line for line in kernel.inspect_asm(kernel.signatures[0]).splitlines() if line.strip()]
wide = [line.split()[0] for line in lines if "ymm" in line or "zmm" in line]
names = ("vpmaxsq", "vblendvpd", "vpcmpgtq", "vporq", "vpternlogq", "vpor", "vpaddd", "vpsubd")
print(sum(name in names for name in wide))
"""
    result = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr[-2000:]
    if result.stdout.strip() == "no AVX2":
        report("not checked: this processor has no AVX2")
    else:
        assert int(result.stdout) >= 4
