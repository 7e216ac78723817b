"""Draw a strange attractor on three scales of colour, side by side: `python scripts/attractor.py OUT.png [POINTS]`."""

from __future__ import annotations

import sys
import time

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import scanspan as ss

SIDE = 420  # pixels of each picture
WALKERS = 10_000
A, B, C, D = -1.4, 1.6, 1.0, 0.7  # of Clifford Pickover's attractor


def attractor(count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return (count, 2) points that many walkers visit once they have found the attractor."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1, 1, (2, WALKERS))
    steps = -(-count // WALKERS)
    points = np.empty((steps, WALKERS, 2))
    for step in range(-20, steps):
        x, y = np.sin(A * y) + C * np.cos(A * x), np.sin(B * x) + D * np.cos(B * y)
        points[max(step, 0)] = np.stack([x, y], axis=1)
    return points.reshape(-1, 2)[:count]


def main(out: str, count: int) -> None:
    """Write the picture, and print how long it took to count and to colour."""
    points = attractor(count)
    sheet = Image.new("RGB", (3 * SIDE, SIDE), "black")
    ss.aggregate(points[:1], (1, 1), threads=1)  # compile
    start = time.perf_counter()
    counts = ss.aggregate(points, (SIDE, SIDE), bounds=(-2.05, -1.8, 2.05, 1.8), threads=1)
    print(f"{counts.sum()} of {count} points counted in {1e3 * (time.perf_counter() - start):.0f} ms, on one thread")
    for k, scale in enumerate(("linear", "log", "equalize")):
        start = time.perf_counter()
        colors = ss.colorize(counts, "inferno", scale=scale, nan="black")
        print(f"{scale}: {1e3 * (time.perf_counter() - start):.0f} ms")
        tile = Image.fromarray(colors[..., :3])
        ImageDraw.Draw(tile).text((10, SIDE - 24), scale, fill="white", font=ImageFont.load_default(14))
        sheet.paste(tile, (k * SIDE, 0))
    sheet.quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 10_000_000)
