"""How fast trees of splats are built and read, in how much memory, and how large their files are.

    python -m benchmarks.cloud_build --points 10000000
    python -m benchmarks.cloud_build --points 100000000 --folder FOLDER

The points are synthetic: hills with noise, seen by a scanner that flies over them in strips, with colours and normals, made in
pieces from a seed, so that no more than a piece is ever in memory. Each build runs in a process of its own, which tells the
most memory that it had; so does the drawing of the tree at an error of one pixel.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

PIECE = 1 << 19
SPACING = 0.25  # metres between points on the ground, on average
ORIGIN = (515000.0, 4918000.0, 0.0)


def height(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the ground in metres."""
    return np.asarray(
        40 * np.sin(x / 310) * np.cos(y / 270) + 6 * np.sin(x / 23 + y / 31) + 0.8 * np.sin(x / 3.1) * np.sin(y / 2.7)
    )


def pieces(count: int, columns: tuple[str, ...], seed: int = 1) -> Iterator[dict[str, Any]]:
    """Give points in strips of a square, as whole millimetres with a scale and an offset."""
    side = SPACING * np.sqrt(count)
    rng = np.random.default_rng(seed)
    for first in range(0, count, PIECE):
        size = min(PIECE, count - first)
        x = rng.random(size) * side
        y = (first + np.arange(size)) / count * side + rng.normal(size=size) * 20
        z = height(x, y) + rng.normal(size=size) * 0.02
        piece: dict[str, Any] = {
            "integers": np.rint(np.column_stack([x, y, z]) * 1000).astype(np.int32), "scale": 0.001, "offset": ORIGIN
        }  # fmt: skip
        if "color" in columns:
            shade = 128 + 60 * np.sin(x / 40) * np.sin(y / 55)
            color = shade[:, None] + [20, 0, -30] + rng.normal(size=(size, 1)) * 6 + rng.normal(size=(size, 3)) * 2
            piece["color"] = np.clip(color, 0, 255).astype(np.uint8)
        if "normals" in columns:
            step = 0.01
            slope_x = (height(x + step, y) - height(x - step, y)) / (2 * step)
            slope_y = (height(x, y + step) - height(x, y - step)) / (2 * step)
            normal = np.column_stack([-slope_x, -slope_y, np.ones(size)])
            piece["normals"] = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32)
        yield piece


class Timed:
    """Pieces, and how long it took to make them, which is not the build's time."""

    def __init__(self, count: int, columns: tuple[str, ...]) -> None:
        self.pieces = pieces(count, columns)
        self.cpu = self.wall = 0.0

    def __iter__(self) -> Iterator[dict[str, Any]]:
        while True:
            cpu, wall = time.process_time(), time.perf_counter()
            piece = next(self.pieces, None)
            self.cpu += time.process_time() - cpu
            self.wall += time.perf_counter() - wall
            if piece is None:
                return
            yield piece


def build(count: int, path: Path, memory: str, columns: tuple[str, ...], normals: str) -> dict[str, float]:
    """Build a tree, and return what it took."""
    from scanspan.assets.splats.build import build_tree

    # Compile everything first, in memory.
    build_tree(pieces(5000, columns), path, normals=normals)
    stages: dict[str, float] = {}
    last = ["read", time.process_time()]

    def heard(stage: str, done: int, total: int) -> None:
        if stage != last[0]:
            now = time.process_time()
            stages[str(last[0])] = now - float(last[1])
            last[:] = [stage, now]

    source = Timed(count, columns)
    cpu, wall = time.process_time(), time.perf_counter()
    last[1] = cpu
    tree = build_tree(source, path, max_memory=memory, normals=normals, progress=heard)
    cpu, wall = time.process_time() - cpu - source.cpu, time.perf_counter() - wall - source.wall
    stages[str(last[0])] = time.process_time() - float(last[1])
    stages["read"] = stages.get("read", 0.0) - source.cpu
    return {
        "points": count, "M points/s, CPU": count / cpu / 1e6, "M points/s, wall": count / wall / 1e6,
        "peak MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "bytes a point": path.stat().st_size / count, "splats a point": tree.splat_count / count, "nodes": len(tree.nodes),
        **{f"s in {name}": seconds for name, seconds in stages.items()},
    }  # fmt: skip


def read(path: Path, splats: int) -> dict[str, float]:
    """Read the leaves of a tree, some at a time: from the disk, and again from decoded pages."""
    from scanspan.assets.splats.file import read_tree

    tree = read_tree(path, cache=1 << 30)
    leaves = np.flatnonzero(tree.is_leaf)[: splats // 150]
    out = tree.room(int(tree.nodes["count"][leaves].sum()))
    # Load the kernels, and touch the memory that is read to.
    tree.read_many(leaves[-1:], out)
    for array in out:
        array.fill(1)
    times = []
    for _ in range(6):
        start = time.thread_time()
        tree.read_many(leaves, out)
        times.append(time.thread_time() - start)
    total = len(out.radius)
    return {"M splats/s from the file, CPU": total / times[0] / 1e6, "M splats/s from pages, CPU": total / min(times[1:]) / 1e6}


def draw(path: Path) -> dict[str, float]:
    """Draw a tree out of its file with nothing kept, and return what it took, the memory of this process included."""
    import scanspan

    tree = scanspan.splat.open(path)
    started = time.perf_counter()
    frame = tree.render("iso", (1920, 1080))
    return {
        "s to draw, from the file": time.perf_counter() - started, "splats drawn": frame.splats,
        "peak MiB to draw": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }  # fmt: skip


def show(found: dict[str, float]) -> None:
    """Print what was measured, a line each."""
    for name, value in found.items():
        print(f"{name:30}{value:16,.2f}", flush=True)


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--memory", default="512MB")
    parser.add_argument("--columns", default="color", help="of color and normals, with a comma between")
    parser.add_argument("--normals", default="given")
    parser.add_argument("--folder", type=Path, help="where the file is made; a temporary folder by default")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    parser.add_argument("--draw", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    columns = tuple(options.columns.split(","))
    if options.draw:
        print(json.dumps(draw(options.draw)))
        return
    if options.child:
        path = Path(options.child)
        print(json.dumps(build(options.points, path, options.memory, columns, options.normals)))
        return
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        path = Path(folder) / "cloud.scansplat"
        for stage in ("--child", "--draw"):
            command = [sys.executable, "-m", "benchmarks.cloud_build", *sys.argv[1:], stage, str(path)]
            ended = subprocess.run(command, capture_output=True, text=True)
            if ended.returncode:
                sys.exit(ended.stderr)
            show(json.loads(ended.stdout))
        show(read(path, 10_000_000))


if __name__ == "__main__":
    main()
