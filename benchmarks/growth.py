"""How time grows with work: `python -m benchmarks.growth -o docs/pictures/growth.svg`.

Flat triangles are painted in order, and rasterized with depth, while one thing grows: their number, the pixels of the image,
the layers behind each other, the size of a triangle, or the threads. A model with seven costs says what each point should take:
a call, a triangle, a scan line of a triangle, a sample of it, a pixel of the image that is cleared, and what such a pixel costs
more where the image does not fit the second-level cache, or the third. It is fitted to every other point and predicts the rest.

Prints the tables as Markdown and draws the chart with matplotlib. Times are medians of repetitions taken in
turns: of the processor, but for threads.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import scanspan

BATCH = 2_000_000  # triangles painted at once; more are painted by painting the same ones again
SIDE = 1024  # pixels of the square image, where nothing else is said
COUNTS = (10**3, 10**4, 10**5, 10**6, 10**7, 10**8)
SIDES = (256, 512, 1024, 2048, 4096, 8192, 16384)
LAYERS = (1, 2, 4, 8, 16, 32, 64)
AREAS = (0.01, 0.1, 1, 4, 16, 64, 256, 1024, 4096, 16384, 65536, 262144)
THREADS = (1, 2, 4, 8)
CACHES = (1 << 18, 1 << 23)  # pixels of four bytes that a second-level cache holds, 1 MiB, and a third-level one, 32 MiB
COSTS = (
    "a call",
    "a triangle",
    "a scan line",
    "a sample",
    "a pixel",
    "more beyond 1 MiB of them",
    "more beyond 32 MiB of them",
)
WITHIN = 0.25  # of the measured time: how far a prediction may be off


class Work(NamedTuple):
    """What is drawn: so many triangles of an area in pixels, into a square image."""

    count: int
    area: float
    side: int
    threads: int = 1

    @property
    def batches(self) -> int:
        """How often the triangles are painted; few are made where there are very many."""
        return -(-self.count // BATCH)


@dataclass
class Point:
    """One measurement, and what the model is given."""

    panel: str
    label: str
    work: Work
    amounts: NDArray[np.float64]  # as many as COSTS
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """The median time in seconds."""
        return float(np.median(self.seconds))


def panels() -> dict[str, list[tuple[str, Work]]]:
    """Return what is drawn in each panel, with its label."""
    layer = 256.0  # pixels in a triangle, where layers or the image grow
    return {
        "triangles": [(f"{count:,}", Work(count, 8.0, SIDE)) for count in COUNTS],
        "pixels": [(f"{side:,} x {side:,}", Work(int(side * side / layer), layer, side)) for side in SIDES],
        "layers": [(str(count), Work(int(count * SIDE * SIDE / layer), layer, SIDE)) for count in LAYERS],
        "size": [(f"{area:,} px", Work(int(np.clip(4 * SIDE * SIDE / area, 4, 300_000)), area, SIDE)) for area in AREAS],
        "threads": [(str(count), Work(200_000, 200.0, 2048, count)) for count in THREADS],
    }


def make_triangles(work: Work) -> NDArray[np.float32]:
    """Return equilateral triangles (N, 3, 2) in pixels, turned and placed at random, as far as they fit within the image."""
    random = np.random.default_rng(1)
    count = -(-work.count // work.batches)
    radius = np.sqrt(work.area / (0.75 * np.sqrt(3.0)))
    angle = random.uniform(0, 2 * np.pi, (count, 1)) + np.arange(3) * (2 * np.pi / 3)
    free = max(work.side - 2 * radius, 0.0)
    middle = (work.side - free) / 2 + random.uniform(0, 1, (count, 1, 2)) * free
    return (middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=2)).astype(np.float32)


def amounts(work: Work, vertices: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return how many calls, triangles, scan lines, samples and pixels there are, and how many pixels beyond each cache."""
    inside = vertices.clip(0, work.side)
    heights = np.rint(inside[..., 1].max(axis=1)) - np.rint(inside[..., 1].min(axis=1))
    a, b, c = (inside[:, corner].astype(np.float64) for corner in range(3))
    areas = abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])) / 2
    batches = work.batches
    each = [batches, batches * len(vertices), batches * heights.sum(), batches * areas.sum(), work.side**2]
    return np.array([*each, *(max(work.side**2 - held, 0) for held in CACHES)], dtype=np.float64)


def painter(work: Work, vertices: NDArray[np.float32]) -> Callable[[], Any]:
    """Return the painting of triangles on a cleared canvas."""
    picture = np.zeros((work.side, work.side, 4), dtype=np.uint8)
    canvas = scanspan.Canvas.from_array(picture, threads=work.threads)
    colors = np.random.default_rng(2).integers(0, 256, (len(vertices), 4), dtype=np.uint8) | np.uint8((0, 0, 0, 255))

    def draw() -> None:
        picture.fill(0)
        for _ in range(work.batches):
            canvas.triangles(vertices, colors)

    return draw


def rasterizer(work: Work, vertices: NDArray[np.float32]) -> Callable[[], Any]:
    """Return the rasterizing of triangles with a depth at each corner, at random."""
    clip = np.ones((len(vertices), 3, 4))
    clip[..., :2] = vertices * (2 / work.side, -2 / work.side) + (-1, 1)
    clip[..., 2] = np.random.default_rng(3).uniform(-1, 1, clip.shape[:2])
    clip, corners = clip.reshape(-1, 4), np.arange(clip.shape[0] * 3, dtype=np.int32).reshape(-1, 3)

    def draw() -> None:
        for _ in range(work.batches):
            scanspan.rasterize(clip, corners, (work.side, work.side), threads=work.threads)

    return draw


WAYS = {"Canvas.triangles": painter, "rasterize": rasterizer}
MOST = {"Canvas.triangles": 10**8, "rasterize": 10**6}  # rasterize takes all triangles at once


def measure(way: str, repetitions: int, seconds: float) -> list[Point]:
    """Return all points of one way to draw; a point that has taken so many seconds is not repeated."""
    points = []
    for panel, works in panels().items():
        rows = []
        for label, work in works:
            if work.count > MOST[way]:
                continue
            vertices = make_triangles(work)
            rows.append((Point(panel, label, work, amounts(work, vertices)), WAYS[way](work, vertices)))
        for repetition in range(repetitions + 1):
            for point, draw in rows:
                if repetition > 1 and sum(point.seconds) > seconds:
                    continue
                clock = time.perf_counter if panel == "threads" else time.process_time
                started = clock()
                draw()
                if repetition:
                    point.seconds.append(clock() - started)
        points += [point for point, _ in rows]
        print(f"{way}: {panel}", file=sys.stderr)
    return points


def fit(points: list[Point]) -> NDArray[np.float64]:
    """Return the costs in seconds, none below 0, that make the relative errors least."""
    from scipy.optimize import nnls

    known = np.array([point.amounts / point.median for point in points])
    scale = known.max(axis=0)
    return np.asarray(nnls(known / scale, np.ones(len(points)))[0] / scale)


def is_fitted(points: list[Point]) -> list[bool]:
    """Say of each point whether the model is fitted to it: every other one of a panel, its ends among them; not the threads."""
    found, places = [], dict.fromkeys((point.panel for point in points), 0)
    for point in points:
        found.append(point.panel != "threads" and places[point.panel] % 2 == 0)
        places[point.panel] += 1
    return found


def tables(way: str, points: list[Point], costs: NDArray[np.float64], fitted: list[bool]) -> str:
    """Return the costs, each panel and how far predictions are off, as Markdown."""
    each = ", ".join(f"{cost * 1e9:,.2f} ns {name}" for name, cost in zip(COSTS, costs, strict=True))
    lines = [f"### {way}", "", f"Costs: {each}.", ""]
    for panel in dict.fromkeys(point.panel for point in points):
        chosen = [(point, known) for point, known in zip(points, fitted, strict=True) if point.panel == panel]
        if panel == "threads":
            base = chosen[0][0].median
            lines += ["| threads | measured | times one thread's speed |", "|---|---|---|"]
            lines += [f"| {p.label} | {p.median * 1e3:,.2f} ms | {base / p.median:.2f} |" for p, _ in chosen]
        else:
            lines += [f"| {panel} | measured | model | off by | |", "|---|---|---|---|---|"]
            for point, known in chosen:
                model = float(point.amounts @ costs)
                off, word = model / point.median - 1, "fitted" if known else "predicted"
                lines.append(f"| {point.label} | {point.median * 1e3:,.3f} ms | {model * 1e3:,.3f} ms | {off:+.0%} | {word} |")
        lines.append("")
    held = [p for p, known in zip(points, fitted, strict=True) if not known and p.panel != "threads"]
    good = sum(abs(float(point.amounts @ costs) / point.median - 1) <= WITHIN for point in held)
    return "\n".join([*lines, f"{good} of {len(held)} predicted points are within {WITHIN:.0%}.", ""])


def draw_chart(found: dict[str, tuple[list[Point], NDArray[np.float64]]], path: Path) -> None:
    """Draw a panel for each thing that grows, measured points over the line of the model."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "scanspan"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 5, figsize=(17, 3.8))
    places: dict[str, Callable[[Work], float]] = {
        "triangles": lambda work: work.count,
        "pixels": lambda work: work.side**2,
        "layers": lambda work: work.count * work.area / work.side**2,
        "size": lambda work: work.area,
        "threads": lambda work: work.threads,
    }
    for (way, (points, costs)), color in zip(found.items(), ("#1b4f72", "#c0392b"), strict=True):
        for (panel, place), side in zip(places.items(), axes, strict=True):
            chosen = [point for point in points if point.panel == panel]
            x, y = [place(point.work) for point in chosen], [point.median * 1e3 for point in chosen]
            side.plot(x, y, "o", markersize=4, color=color, label=way)
            if panel != "threads":
                side.plot(x, [float(point.amounts @ costs) * 1e3 for point in chosen], "-", linewidth=1, color=color)
            side.set(xscale="log", yscale="log", xlabel=panel if panel != "size" else "pixels in a triangle")
            side.grid(True, which="major", alpha=0.25)
            side.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel("ms; line: the model")
    axes[0].legend(frameon=False, fontsize=8)
    axes[-1].set_xticks(THREADS, [str(count) for count in THREADS])
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main(arguments: list[str] | None = None) -> int:
    """Run all panels as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth", description="Measure how time grows with work.")
    parser.add_argument("--reps", type=int, default=7, help="repetitions, taken in turns (default: 7)")
    parser.add_argument("--seconds", type=float, default=2.0, help="after which a point is not repeated (default: 2)")
    parser.add_argument("-o", dest="output", type=Path, help="draw the chart into this .svg file")
    options = parser.parse_args(arguments)
    found = {}
    for way in WAYS:
        points = measure(way, options.reps, options.seconds)
        fitted = is_fitted(points)
        costs = fit([point for point, known in zip(points, fitted, strict=True) if known])
        print(tables(way, points, costs, fitted), flush=True)
        found[way] = (points, costs)
    if options.output:
        draw_chart(found, options.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
