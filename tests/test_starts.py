"""Starts: what a small picture must not wait for, and kernels that are loaded as they are compiled."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import scanspan as ss
from scanspan import __main__ as program
from scanspan import jit
from scanspan.cli.warming import show_one_normal
from scanspan.geometry.fixed_point import product_halves
from scanspan.raster.algorithms import KERNELS, KINDS, ORDERS, PIXEL_KERNELS
from scanspan.shade.normals import direction_cell

MODEL = Path(__file__).resolve().parent.parent / "examples" / "models" / "spot.obj"
RENDER = """
import json, sys
from scanspan.cli import main
code = main(["render", sys.argv[1], "-o", sys.argv[2], "--size", "64x48"])
from scanspan.jit import compile_seconds
print(json.dumps([code, compile_seconds(), sorted(sys.modules)]))
"""

# What numba prepares itself with for compiling, and what other pictures need.
NEEDLESS = {
    *("numba.np.linalg", "numba.np.arraymath", "numba.typed.typedlist", "scipy.linalg", "rich", "trimesh", "networkx", "lxml"),
    *("scanspan.clouds", "scanspan.canvas", "scanspan.aggregates", "scanspan.splat", "scanspan.lectures"),
    *("scanspan.raster.blocks", "scanspan.raster.homogeneous_edges", "scanspan.raster.scanline", "scanspan.raster.span_list"),
    *("scanspan.raster.warnock", "scanspan.raster.micropolygon", "scanspan.raster.order"),
}


def render(output: Path) -> tuple[bytes, float, set[str]]:
    """Render a small picture in a process of its own: the file, how long was compiled, and which modules were imported."""
    ran = subprocess.run([sys.executable, "-c", RENDER, MODEL, output], capture_output=True, text=True, check=True)
    code, seconds, modules = json.loads(ran.stdout.splitlines()[-1])
    assert code == 0
    return output.read_bytes(), seconds, set(modules)


def test_a_cached_start_imports_no_more_than_it_needs(tmp_path: Path) -> None:
    first, _, _ = render(tmp_path / "first.png")
    second, seconds, modules = render(tmp_path / "second.png")
    assert seconds == 0.0
    assert second == first
    assert modules & NEEDLESS == set()
    assert "numba" in modules


LOAD_AND_COMPILE = """
import sys
import numpy as np
import scanspan as ss
seen = ss.rasterize([(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)], [(0, 1, 2)], size=(4, 4)).primitive
before = "numba.np.linalg" in sys.modules

import numba

@numba.njit
def total(values):
    return values.sum() + np.zeros(3).size

print(before, total(np.arange(4.0)), "numba.np.linalg" in sys.modules, (seen >= 0).sum())
"""


def test_a_program_that_compiles_kernels_of_its_own_finds_numba_whole() -> None:
    jit_once = [sys.executable, "-c", LOAD_AND_COMPILE]
    ss.rasterize([(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)], [(0, 1, 2)], size=(4, 4))
    ran = subprocess.run(jit_once, capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["False", "9.0", "True", "6"]


def test_the_cache_of_a_kernel_is_made_when_it_is_first_needed() -> None:
    @jit.kernel
    def double(values: ss.records.Float64Array) -> float:  # type: ignore[name-defined]
        return 2.0 * values[0]

    cache = double._cache  # type: ignore[attr-defined]
    assert "_on_disk" not in vars(cache)
    before = jit.config.CACHE_DIR
    assert Path(cache.cache_path).is_relative_to(jit.CACHE_FOLDER)
    assert before == jit.config.CACHE_DIR
    assert "_on_disk" in vars(cache)

    # What is turned off finds nothing.
    cache.disable()
    assert double(np.ones(1)) == 2.0
    assert double.stats.cache_misses  # type: ignore[attr-defined]
    cache.enable()
    cache.flush()


@pytest.mark.parametrize("part", [product_halves, direction_cell])
def test_a_part_of_kernels_may_be_called_from_python_too(part: object) -> None:
    values = (3, 5, 7, 9) if part is product_halves else (0.5, -0.25, 1.0)
    expected = part.py_func(*values)  # type: ignore[attr-defined]
    for _ in range(2):
        assert part(*values) == expected  # type: ignore[operator]


def test_every_kernel_of_every_way_is_found_by_its_name() -> None:
    for known in (KERNELS, PIXEL_KERNELS):
        for orders in known.values():
            for kernels in orders.values():
                assert list(kernels) == list(KINDS)
                assert len(kernels) == len(KINDS)
                assert all(callable(kernel) for kernel in kernels.values())
    assert KERNELS["half-space"]["rows"]["keys"] is not KERNELS["half-space"]["hilbert"]["keys"]
    assert KERNELS["homogeneous"]["rows"]["tallies"] is KERNELS["half-space"]["rows"]["tallies"]
    assert list(KERNELS["warnock"]) == list(ORDERS)
    with pytest.raises(KeyError):
        KERNELS["warnock"]["rows"]["colours"]


def test_the_command_looks_for_garbage_seldom_and_not_at_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, done = gc.get_threshold(), []
    monkeypatch.setattr("scanspan.cli.main", lambda: done.append(gc.get_threshold()[0]) or 0)
    monkeypatch.setattr(gc, "freeze", lambda: done.append("frozen"))
    try:
        assert program.main() == 0
    finally:
        gc.set_threshold(*usual)
    assert done == [program.NEW_OBJECTS, "frozen"]
    assert gc.isenabled()


def test_one_normal_stands_for_all() -> None:
    normals = show_one_normal(np.zeros((4, 3)), np.zeros((2, 3), np.int32), np.zeros(2), 30.0)
    assert normals.dtype == np.float32
    assert np.array_equal(normals, np.broadcast_to(np.float32([0, 0, 1]), (2, 3, 3)))


def test_kernels_were_compiled_here() -> None:
    ss.count([[(0, 0), (3, 0), (0, 3)]], size=(3, 3))
    assert jit.has_kernels()
