"""Compare the algorithms with each other: `python -m benchmarks.algorithms -o docs/pictures/algorithms.svg`.

Two questions of the lectures. Which way is faster for few large triangles, and which for many small ones? And what happens when
many triangles lie behind each other? The first is asked with triangles of 1 to 262,144 px that cover the image three times over
in all; the second with 1 to 64 layers of triangles of 4096 px. Each algorithm rasterizes the same list, already on the screen,
on one thread, into keys; they take turns, and the median counts. All pictures are compared bit for bit.

Prints the tables as Markdown and draws the chart with matplotlib.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scanspan.geometry.clip import to_screen
from scanspan.raster.algorithms import ALGORITHMS, run
from scanspan.raster.options import make_sampling
from scanspan.raster.write import EMPTY_KEY
from scanspan.records import ScreenTriangles

SIDE = 1024  # pixels of the square image
AREAS = (1, 4, 16, 64, 256, 1024, 4096, 16384, 65536, 262144)
LAYERS = (1, 2, 4, 8, 16, 32, 64)
COVERED = 3.0  # layers, in the sweep over areas
MOST = 60_000  # triangles; fewer are drawn of the smallest
LAYER_AREA = 4096  # pixels, in the sweep over layers
PALETTE = ("#1b4f72", "#5dade2", "#c0392b", "#117a65", "#58d68d", "#b7950b", "#7d3c98", "#6e2c00")


def make_triangles(area: float, layers: float, seed: int = 1) -> ScreenTriangles:
    """Return equilateral triangles of an area in pixels, turned and placed at random, tilted in depth."""
    random = np.random.default_rng(seed)
    count = int(np.clip(layers * SIDE * SIDE / area, 1, MOST))
    radius = np.sqrt(area / (0.75 * np.sqrt(3.0)))
    angle = random.uniform(0, 2 * np.pi, (count, 1)) + np.arange(3) * (2 * np.pi / 3)
    middle = random.uniform(0, SIDE, (count, 1, 2))
    pixels = middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    depth = random.uniform(-1, 1, (count, 1)) + random.uniform(-0.1, 0.1, (count, 3))
    clip = np.concatenate(
        [pixels.reshape(-1, 2) * (2 / SIDE) - 1, depth.reshape(-1, 1).clip(-1, 1), np.ones((3 * count, 1))], axis=1
    )
    return to_screen(clip, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), (SIDE, SIDE), 8)


def race(triangles: ScreenTriangles, repetitions: int) -> dict[str, float]:
    """Return the median time of each algorithm in seconds; all must give the same picture."""
    sampling = make_sampling((SIDE, SIDE), (128, 128), rule="top-left", cull="none", subpixel_bits=8)
    times: dict[str, list[float]] = {name: [] for name in ALGORITHMS}
    expected: NDArray[np.int64] | None = None
    for repetition in range(repetitions + 1):
        for name in ALGORITHMS:
            keys = np.full((SIDE, SIDE), EMPTY_KEY)
            started = time.perf_counter()
            run(name, "rows", "keys", keys, triangles, sampling, 1)
            if repetition:
                times[name].append(time.perf_counter() - started)
            expected = keys if expected is None else expected
            assert np.array_equal(keys, expected), name
    return {name: float(np.median(taken)) for name, taken in times.items()}


def table(heading: str, rows: list[tuple[str, dict[str, float]]]) -> str:
    """Return times as a Markdown table: half-space in milliseconds, the others as multiples of it."""
    lines = [f"| {heading} | half-space | " + " | ".join(name for name in ALGORITHMS if name != "half-space") + " |"]
    lines.append("|" + "---|" * (len(ALGORITHMS) + 1))
    for label, found in rows:
        base = found["half-space"]
        others = " | ".join(f"{found[name] / base:.2f} x" for name in ALGORITHMS if name != "half-space")
        lines.append(f"| {label} | {base * 1e3:.2f} ms | {others} |")
    return "\n".join(lines)


def draw_chart(areas: list[dict[str, float]], layers: list[dict[str, float]], counts: list[int], path: Path) -> None:
    """Draw both sweeps side by side."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "scanspan"
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), sharey=False)
    covered = [count * area for count, area in zip(counts, AREAS, strict=True)]
    for name, color in zip(ALGORITHMS, PALETTE, strict=True):
        style = {"marker": "o", "markersize": 3.5, "color": color, "label": name}
        left.plot(AREAS, [found[name] / px * 1e9 for found, px in zip(areas, covered, strict=True)], **style)
        right.plot(LAYERS, [found[name] * 1e3 for found in layers], **style)
    left.set(xscale="log", yscale="log", xlabel="pixels in a triangle", ylabel="ns a covered pixel")
    left.set_title("Few large or many small")
    right.set(xscale="log", yscale="log", xlabel="layers", ylabel=f"ms for {SIDE} x {SIDE} px", title="Depth complexity")
    right.set_xticks(LAYERS, [str(count) for count in LAYERS])
    for axes in (left, right):
        axes.grid(True, which="major", alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    left.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main(arguments: list[str] | None = None) -> int:
    """Run both sweeps as a program."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.algorithms", description="Compare the algorithms with each other."
    )
    parser.add_argument("--reps", type=int, default=5, help="repetitions, taken in turns (default: 5)")
    parser.add_argument("-o", dest="output", type=Path, help="draw the chart into this .svg file")
    options = parser.parse_args(arguments)
    sizes = [make_triangles(area, COVERED) for area in AREAS]
    counts = [len(triangles.corners) for triangles in sizes]
    by_area = [race(triangles, options.reps) for triangles in sizes]
    labels = [f"{count:,} of {area:,} px" for count, area in zip(counts, AREAS, strict=True)]
    print(table("triangles", list(zip(labels, by_area, strict=True))), end="\n\n", flush=True)
    by_layer = [race(make_triangles(LAYER_AREA, layers), options.reps) for layers in LAYERS]
    print(table("layers", [(str(count), found) for count, found in zip(LAYERS, by_layer, strict=True)]))
    if options.output:
        draw_chart(by_area, by_layer, counts, options.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
