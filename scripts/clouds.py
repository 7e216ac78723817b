"""Render point clouds with the defaults, from three sides each: `python scripts/clouds.py OUT.png CLOUD...`."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import scanspan as ss

TILE = (330, 220)
DIRECTIONS = ("iso", "top", "front")


def main(out: str, clouds: list[str]) -> None:
    """Write the sheet, and print for each cloud how many of its points are seen from each side."""
    logging.disable()
    sheet = Image.new("RGB", (len(DIRECTIONS) * TILE[0], len(clouds) * TILE[1]), "white")
    for row, cloud in enumerate(clouds):
        scene, seen = ss.load(cloud), []
        for column, direction in enumerate(DIRECTIONS):
            frame = ss.render(scene, direction, TILE)
            tile = Image.fromarray(np.ascontiguousarray(frame.color[..., :3]))
            text = f"{Path(cloud).name}, {direction}"
            ImageDraw.Draw(tile).text((10, TILE[1] - 22), text, fill=(60, 68, 80), font=ImageFont.load_default(12))
            sheet.paste(tile, (column * TILE[0], row * TILE[1]))
            seen.append(f"{frame.counters['seen']:,}")
        print(f"{Path(cloud).name:24} {scene.primitive_count:10,} points, seen {', '.join(seen)}")
    sheet.save(out, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
