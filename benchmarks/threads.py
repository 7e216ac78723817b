"""What more threads give: `python -m benchmarks.threads`.

Wall time of scenes of the race, drawn by one to eight threads in turns, beside a loop of plain arithmetic that needs no memory:
what two virtual processors can give at most is what they give to that. More threads than processors show what sharing costs.

Prints a table as Markdown.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

import scanspan
from benchmarks import scenes

THREADS = (1, 2, 4, 8)
SCENES = ("A", "B", "C", "G", "H", "I", "M211k", "M843k")
ROUNDS = 60_000_000  # of plain arithmetic, shared by the threads


def make_arithmetic() -> Callable[[int], Any]:
    """Return a loop of plain arithmetic, shared by so many threads."""
    from scanspan.jit import kernel

    def turn(rounds: int) -> float:
        value = 0.5
        for _ in range(rounds):
            value = value * 3.7 * (1.0 - value)
        return value

    loop = kernel(turn)
    loop(1)

    def draw(threads: int) -> None:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(loop, [ROUNDS // threads] * threads))

    return draw


def make_painter(scene: scenes.FlatScene) -> Callable[[int], Any]:
    """Return the painting of triangles on the screen by so many threads, tested against depths where they have any."""
    picture = np.zeros((scene.size[1], scene.size[0], 4), np.uint8)
    depth = np.empty(picture.shape[:2], np.float32)
    depths = None if scene.depths is None else -scene.depths

    def draw(threads: int) -> None:
        picture.fill(0)
        depth.fill(-np.inf)
        canvas = scanspan.Canvas.from_array(picture, depth, threads=threads)
        canvas.triangles(scene.vertices, scene.colors, depths=depths)

    return draw


def make_rasterizer(scene: scenes.MeshScene) -> Callable[[int], Any]:
    """Return `rasterize` of a mesh, and `interpolate` of three colours at each vertex."""
    clip = np.column_stack([scene.positions, np.ones(scene.positions.shape[0])]) @ scene.matrix.T
    triangles = scene.triangles
    colors = np.random.default_rng(1).integers(0, 256, (clip.shape[0], 3), dtype=np.uint8)

    def draw(threads: int) -> None:
        scanspan.interpolate(scanspan.rasterize(clip, triangles, scene.size, threads=threads), colors, dtype=np.uint8)

    return draw


def measure(draw: Callable[[int], Any], repetitions: int) -> list[float]:
    """Return the median wall time for each number of threads, taken in turns."""
    found: dict[int, list[float]] = {threads: [] for threads in THREADS}
    for repetition in range(repetitions + 1):
        for threads in THREADS:
            started = time.perf_counter()
            draw(threads)
            if repetition:
                found[threads].append(time.perf_counter() - started)
    return [statistics.median(times) for times in found.values()]


def main(arguments: list[str] | None = None) -> int:
    """Print the table as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.threads", description="Measure what more threads give.")
    parser.add_argument("--reps", type=int, default=7, help="repetitions, taken in turns (default: 7)")
    options = parser.parse_args(arguments)
    print("| scene | one thread | " + " | ".join(f"{threads} threads" for threads in THREADS[1:]) + " |")
    print("|---" * (len(THREADS) + 1) + "|")
    for name in ("plain arithmetic", *SCENES):
        if name == "plain arithmetic":
            draw = make_arithmetic()
        else:
            scene = scenes.make(name)
            draw = make_rasterizer(scene) if isinstance(scene, scenes.MeshScene) else make_painter(scene)
        times = measure(draw, options.reps)
        more = " | ".join(f"{times[0] / value:.2f} x" for value in times[1:])
        print(f"| {name} | {times[0] * 1e3:,.1f} ms | {more} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
