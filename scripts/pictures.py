"""Render models with the defaults and put them on one sheet: `python scripts/pictures.py OUT.png MODEL...`."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import scanspan as ss

TILE = (360, 270)
COLUMNS = 5


def main(out: str, models: list[str]) -> None:
    """Write the sheet, and print for each model the share of its picture that it covers."""
    logging.disable()
    rows = -(-len(models) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * TILE[0], rows * TILE[1]), "white")
    for k, model in enumerate(models):
        frame = ss.render(ss.load(model), size=(2 * TILE[0], 2 * TILE[1]))
        tile = Image.fromarray(np.ascontiguousarray(frame.color[..., :3])).resize(TILE, Image.Resampling.BOX)
        name = Path(model).name
        ImageDraw.Draw(tile).text((10, TILE[1] - 24), name, fill=(60, 68, 80), font=ImageFont.load_default(14))
        sheet.paste(tile, ((k % COLUMNS) * TILE[0], (k // COLUMNS) * TILE[1]))
        print(f"{name:24} {frame.coverage:6.1%}")
    sheet.save(out, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
