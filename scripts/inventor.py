"""Read and draw every Inventor file below a folder: `python scripts/inventor.py ../shared/data/inventor -o sheets`.

Prints for each file how many shapes and triangles it has, how long it was read, which lights and cameras it has, and what was
said; then the slowest. With a folder to write to, sheets of small pictures of all of them, to be looked at.
"""

from __future__ import annotations

import argparse
import logging
import time
from pathlib import Path

from PIL import Image, ImageDraw

import scanspan as ss
from scanspan.errors import ScanspanError

TILE = (240, 180)
COLUMNS, ROWS = 7, 6


def main() -> None:
    """Print the table and write the sheets."""
    options = argparse.ArgumentParser()
    options.add_argument("folder", type=Path)
    options.add_argument("-o", "--output", type=Path)
    given = options.parse_args()
    logging.getLogger("scanspan").disabled = True
    times, tiles = [], []
    for path in sorted(path for path in given.folder.rglob("*.iv*") if path.is_file()):
        name, start = str(path.relative_to(given.folder)), time.process_time()
        try:
            scene = ss.load(path)
        except ScanspanError as error:
            print(f"{name}: refused: {error}")
            continue
        spent = time.process_time() - start
        times.append((spent, name))
        kinds = [light.kind for light in scene.lights if light.kind != "ambient"]
        print(
            f"{name}: {len(scene.instances):,} shapes, {scene.triangle_count:,} triangles, {spent:.2f} s, "
            f"{len(scene.cameras)} cameras, lights: {', '.join(kinds) or 'none'}; {'; '.join(scene.notes)}"
        )
        if given.output is not None:
            tile = Image.fromarray(ss.render(scene, size=TILE).color).convert("RGB")
            ImageDraw.Draw(tile).text((3, 3), path.name, fill=(160, 0, 0))
            tiles.append(tile)
    print(*(f"{spent:.2f} s {name}" for spent, name in sorted(times)[-3:]), sep="\n")
    for first in range(0, len(tiles), COLUMNS * ROWS):
        sheet = Image.new("RGB", (COLUMNS * TILE[0], ROWS * TILE[1]), "white")
        for number, tile in enumerate(tiles[first : first + COLUMNS * ROWS]):
            sheet.paste(tile, (number % COLUMNS * TILE[0], number // COLUMNS * TILE[1]))
        given.output.mkdir(exist_ok=True)
        sheet.save(given.output / f"sheet-{first // (COLUMNS * ROWS) + 1}.png")


if __name__ == "__main__":
    main()
