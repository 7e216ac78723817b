"""The four pictures of the lecture: `python -m benchmarks.splats -o docs/splats.md --pictures docs/pictures`.

One large model, a generated scan of a ball with bumps, is built into a tree of splats once and kept in a temporary folder. It
is drawn at 1920 x 1080 with one thread at four thresholds, which are looked for so that the counts of splats come as near as
they can to the lecture's: 130,712, 259,975, 1,017,149 and 14,835,967. What is timed is all of `SplatTree.render`, warm: cut,
drawing, shading. Beside it, in the same run: a plain Numba loop and NumPy over the same splats as float64 points, one pixel
each, without colour, light or size; and datashader, where it is installed, which bins points of a plane.

Times are CPU time of the process, medians. The table goes between the two markers of the page.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import scanspan as ss
from scanspan.geometry.cut import cut_tree, splat_view
from scanspan.homogeneous import transform_points
from scanspan.target.image import write_image

COUNTS = (130_712, 259_975, 1_017_149, 14_835_967)
LECTURE = (132, 215, 722, 8308)  # ms
TARGETS, AIMS = (24, 32, 75, 650), (8, 14, 35, 300)  # ms
POINTS = COUNTS[-1]
PIECE = 1 << 20  # points generated at once
SIZE = (1920, 1080)
CAMERA = ss.Camera.look_at((2.4, -2.0, 1.3), (0, 0, 0), up=(0, 0, 1), fov=45)
START, END = "<!-- figures -->", "<!-- end of figures -->"


class Row(NamedTuple):
    """One picture."""

    error: float
    splats: int
    milliseconds: float
    fastest: float
    peers: dict[str, float]  # ms


def surface(unit: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points of the model in some directions, and its normals there."""

    def height(at: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, z = at.T
        wave = np.sin(3 * x + 1) * np.sin(4 * y) * np.sin(5 * z + 2)
        return 1.0 + 0.10 * wave + 0.012 * np.sin(23 * x) * np.sin(29 * y) * np.sin(31 * z)

    # The gradient of |p| - height(p / |p|), by differences.
    radius, step = height(unit), 1e-5
    places = unit * radius[:, None]
    slopes = []
    for axis in range(3):
        moved = places.copy()
        moved[:, axis] += step
        length = np.sqrt((moved * moved).sum(axis=1))
        slopes.append((length - height(moved / length[:, None])) / step)
    normals = np.stack(slopes, axis=1)
    return places, normals / np.sqrt((normals * normals).sum(axis=1))[:, None]


def scan(count: int) -> Iterator[dict[str, Any]]:
    """Give the points of the model, as a scanner might see them: spread evenly, in no order, coloured by height."""
    for first in range(0, count, PIECE):
        random = np.random.default_rng(first)
        vectors = random.normal(size=(min(PIECE, count - first), 3))
        places, normals = surface(vectors / np.sqrt((vectors * vectors).sum(axis=1))[:, None])
        share = np.clip((np.sqrt((places * places).sum(axis=1)) - 0.9) / 0.2, 0.0, 1.0)[:, None]
        color = np.uint8(np.array([150, 110, 80]) * (1 - share) + np.array([235, 225, 205]) * share)
        yield {"positions": places, "color": color, "normals": normals}


def model(count: int) -> ss.splat.SplatTree:
    """Return the tree of the model, built if it is not there yet."""
    path = Path(tempfile.gettempdir()) / f"scanspan-splats-{count}.scansplat"
    if not path.exists():
        begun = time.perf_counter()
        beside = path.with_suffix(f".{os.getpid()}.scansplat")
        ss.splat.build(scan(count), beside)
        os.replace(beside, path)
        print(f"built {count} points in {time.perf_counter() - begun:.1f} s, generated in between", file=sys.stderr)
    return ss.splat.open(path, max_bytes=1 << 30)


def threshold(tree: ss.splat.SplatTree, wanted: int) -> float:
    """Return the error at which the number of splats comes nearest to the one wanted."""
    view, low, high = splat_view(CAMERA, SIZE, tree.origin), 0.0, 256.0
    found = {error: cut_tree(tree._state.columns, view, error).splats for error in (low, high)}
    for _ in range(40):
        middle = (low + high) / 2.0
        found[middle] = cut_tree(tree._state.columns, view, middle).splats
        low, high = (middle, high) if found[middle] > wanted else (low, middle)
    return min(found, key=lambda error: (abs(found[error] - wanted), error))


def make_loop() -> Callable[..., None]:
    """Return a plain loop over points, as one would write it with Numba: project, compare, store."""
    numba = importlib.import_module("numba")

    @numba.njit  # type: ignore[untyped-decorator]
    def loop(points: Any, m: Any, width: int, height: int, depth: Any, number: Any) -> None:
        depth[:] = np.inf
        for i in range(len(points)):
            x, y, z = points[i]
            w = m[3, 0] * x + m[3, 1] * y + m[3, 2] * z + m[3, 3]
            if w > 0:
                u = int((m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]) / w)
                v = int((m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]) / w)
                if 0 <= u < width and 0 <= v < height and w < depth[v, u]:
                    depth[v, u] = w
                    number[v, u] = i

    return loop  # type: ignore[no-any-return]


def peers(places: NDArray[np.float64]) -> dict[str, Callable[[], Any]]:
    """Return what draws the same points otherwise."""
    width, height = SIZE
    x, y, _, w = CAMERA.clip_matrix(SIZE)
    matrix = np.stack([(w + x) * width / 2, (w - y) * height / 2, w, w])
    depth, number, loop = np.empty((height, width)), np.empty((height, width), np.int64), make_loop()

    def plain() -> None:
        loop(places, matrix, width, height, depth, number)

    def numpy() -> NDArray[np.int64]:
        u, v, _, away = transform_points(matrix, places).T
        column, row = (u / away).astype(np.int64), (v / away).astype(np.int64)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (away > 0)
        kept = np.flatnonzero(inside)[np.argsort(-away[inside], kind="stable")]
        image = np.full(width * height, -1)
        image[row[kept] * width + column[kept]] = kept
        return image

    ways: dict[str, Callable[[], Any]] = {"Numba loop": plain, "NumPy": numpy}
    try:
        datashader, pandas = importlib.import_module("datashader"), importlib.import_module("pandas")
    except ImportError:
        return ways
    u, v, _, away = transform_points(matrix, places).T
    table = pandas.DataFrame({"x": u / away, "y": v / away, "z": away})
    canvas = datashader.Canvas(width, height, (0, width), (0, height))
    ways["datashader"] = lambda: canvas.points(table, "x", "y", datashader.min("z"))
    return ways


def median(call: Callable[[], Any], repetitions: int) -> tuple[float, float]:
    """Return the median and the least CPU time of some calls in milliseconds, after one that is not counted."""
    times = []
    call()
    for _ in range(repetitions):
        begun = time.process_time()
        call()
        times.append((time.process_time() - begun) * 1e3)
    return float(np.median(times)), min(times)


def measure(tree: ss.splat.SplatTree, wanted: int, repetitions: int, with_peers: bool) -> Row:
    """Draw one of the pictures, and measure all ways to draw it."""
    error = threshold(tree, wanted)
    frame = tree.render(CAMERA, SIZE, error=error, threads=1)
    ours, fastest = median(lambda: tree.render(CAMERA, SIZE, error=error, threads=1), repetitions)
    others = {}
    if with_peers:
        blocks = tree.read_many(cut_tree(tree._state.columns, splat_view(CAMERA, SIZE, tree.origin), error).nodes)
        nodes = np.repeat(
            cut_tree(tree._state.columns, splat_view(CAMERA, SIZE, tree.origin), error).nodes, np.diff(blocks.starts)
        )
        places = tree.origin + tree.nodes["low"][nodes] + tree.nodes["step"][nodes] * blocks.splats.positions
        for name, call in peers(places).items():
            others[name] = median(call, min(repetitions, 5 if len(places) < 5e6 else 2))[0]
    return Row(error, frame.splats, ours, fastest, others)


def table(rows: list[Row]) -> str:
    """Return the figures as Markdown."""
    names = list(rows[0].peers)
    lines = [
        "| lecture: splats, ms | error, px | splats | ms (fastest) | M splats/s | target, aim | "
        + "".join(f"{n} | " for n in names),
        "|---|---|---|---|---|---|" + "---|" * len(names),
    ]
    for row, count, lecture, target, aim in zip(rows, COUNTS, LECTURE, TARGETS, AIMS):
        others = "".join(f"{row.peers[name]:.0f} ({row.peers[name] / row.milliseconds:.1f} x) | " for name in names)
        lines.append(
            f"| {count:,}, {lecture:,} | {row.error:.3f} | {row.splats:,} | **{row.milliseconds:.1f}** ({row.fastest:.1f}) | "
            f"{row.splats / row.milliseconds / 1e3:.1f} | {target}, {aim} | {others}"
        )
    return "\n".join(line.rstrip() for line in lines)


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="the page whose table is renewed")
    parser.add_argument("--pictures", type=Path, help="the folder for the four pictures")
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--reps", type=int, default=7)
    parser.add_argument("--no-peers", action="store_true")
    given = parser.parse_args()
    tree = model(given.points)
    rows = [measure(tree, min(count, given.points), given.reps, not given.no_peers) for count in COUNTS]
    figures = table(rows)
    print(figures)
    for number, row in enumerate(rows):
        if given.pictures:
            color = tree.render(CAMERA, SIZE, error=row.error).color[:, 480:1440].reshape(270, 4, 240, 4, 4)
            write_image(given.pictures / f"splats-{number + 1}.png", np.uint8(np.rint(color.mean(axis=(1, 3)))))
    if given.output:
        page = given.output.read_text("utf-8")
        renewed = re.sub(f"{START}.*{END}", lambda _: f"{START}\n\n{figures}\n\n{END}", page, flags=re.DOTALL)
        given.output.write_text(renewed, "utf-8")


if __name__ == "__main__":
    main()
