"""Draw the countries of npm's world-atlas and one of them in every mode: `python -m scripts.world OUT.png`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from tests.maps import decode, fetch_atlas, unroll

import scanspan as ss

SIZE = (1200, 560)
BOUNDS = (-180.0, -84.0, 180.0, 84.0)
SEA = np.array([222, 232, 240])
HUES = np.array(
    [(228, 164, 120), (240, 208, 136), (168, 200, 144), (136, 176, 152), (176, 168, 208), (220, 160, 176), (204, 184, 152)]
)
ALPS, ALPS_SIZE, CELL = (5.0, 45.0, 18.0, 50.0), (26, 10), 15


def colors_of(polygons: Any, size: tuple[int, int], bounds: Any) -> NDArray[Any]:
    """Return the neighbours' colours: those that touch have different hues, where there are enough."""
    touching = np.array([ss.coverage(rings, size, mode="touched", bounds=bounds).ravel() for rings in polygons])
    near = (touching.astype(np.float32) @ touching.astype(np.float32).T) > 0
    hues: list[int] = []
    for number in range(len(polygons)):
        taken = {hue for hue, touches in zip(hues, near[number, :number], strict=True) if touches}
        turned = [(number + k) % len(HUES) for k in range(len(HUES))]
        hues.append(next((hue for hue in turned if hue not in taken), turned[0]))
    return HUES[hues]


def blended(polygons: Any, colors: NDArray[Any], size: tuple[int, int], bounds: Any) -> NDArray[Any]:
    """Return colours weighted by the share of a pixel that each country has, and the sea the rest: no seam shows."""
    linear = ((colors / 255.0) ** 2.2).T
    share = ss.zones(polygons, size, mode="area", reduce="count", bounds=bounds)[..., None]
    channels = [ss.zones(polygons, size, mode="area", reduce="sum", values=v, bounds=bounds) for v in linear]
    light = np.stack(channels, axis=-1) + (1 - share) * (SEA / 255.0) ** 2.2
    return np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)


def panel(cells: NDArray[Any], title: str) -> Image.Image:
    """Return an enlarged picture with a grid and a title below it."""
    large = Image.fromarray(cells).resize((ALPS_SIZE[0] * CELL, ALPS_SIZE[1] * CELL), Image.Resampling.NEAREST)
    pen = ImageDraw.Draw(large)
    for x in range(0, large.width, CELL):
        pen.line([(x, 0), (x, large.height)], fill=(255, 255, 255))
    for y in range(0, large.height, CELL):
        pen.line([(0, y), (large.width, y)], fill=(255, 255, 255))
    framed = Image.new("RGB", (large.width, large.height + 26), "white")
    framed.paste(large, (0, 0))
    ImageDraw.Draw(framed).text((2, large.height + 5), title, fill=(60, 68, 80), font=ImageFont.load_default(14))
    return framed


def main(out: str) -> None:
    """Write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        found = fetch_atlas(Path(folder))
    if isinstance(found, str):
        sys.exit(found)
    countries, names = decode(found, "countries")
    polygons = [[part for ring in rings for part in unroll(ring)] for rings in countries]
    colors = colors_of(polygons, (720, 360), BOUNDS)
    sheet = Image.new("RGB", (SIZE[0], SIZE[1] + 10 + ALPS_SIZE[1] * CELL + 26), "white")
    sheet.paste(Image.fromarray(blended(polygons, colors, SIZE, BOUNDS)), (0, 0))

    # One country in every mode.
    outline = polygons[names.index("Austria")]
    for k, mode in enumerate(("center", "touched", "area")):
        share = ss.coverage(outline, ALPS_SIZE, mode=mode, bounds=ALPS).astype(float)[..., None]
        cells = np.rint(SEA + (np.array([190, 84, 60]) - SEA) * share).astype(np.uint8)
        sheet.paste(panel(cells, f'coverage(austria, (26, 10), mode="{mode}")'), (k * (ALPS_SIZE[0] * CELL + 15), SIZE[1] + 10))
    sheet.save(out, optimize=True)
    print(out)


if __name__ == "__main__":
    main(sys.argv[1])
