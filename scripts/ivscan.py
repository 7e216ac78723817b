"""Make the five views of the example scenes for the documentation: `python scripts/ivscan.py docs/pictures/ivscan`.

One sheet a scene, the views side by side, and the animation of its calls.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import scanspan as ss
from scanspan.assets.inventor.report import listing_of
from scanspan.lectures import ivscan

# Scene, direction, size of the picture, and the region that is magnified.
SCENES = (
    ("triangles", "front", (48, 36), (12, 9, 36, 27)),
    ("solids", "iso", (64, 48), (20, 12, 44, 30)),
    ("letters", "iso", (48, 36), (8, 6, 40, 30)),
)
VIEW = (432, 324)
GAP = 8


def make_sheet(views: list[np.ndarray]) -> Image.Image:
    """Return views on one sheet, the input above and the others two by two."""
    tiles = [Image.fromarray(view).convert("RGB") for view in views]
    head = tiles[0].resize((2 * VIEW[0] + GAP, round(tiles[0].height * (2 * VIEW[0] + GAP) / tiles[0].width)))
    sheet = Image.new("RGB", (2 * VIEW[0] + GAP, head.height + 2 * (VIEW[1] + GAP)), "white")
    sheet.paste(head, (0, 0))
    for number, tile in enumerate(tiles[1:]):
        place = (number % 2) * (VIEW[0] + GAP), head.height + GAP + (number // 2) * (VIEW[1] + GAP)
        sheet.paste(tile.resize(VIEW, Image.Resampling.LANCZOS), place)
    return sheet


def main(folder: str) -> None:
    """Write a sheet and an animation for each scene, and print what was counted."""
    root = Path(__file__).resolve().parent.parent / "examples" / "scenes"
    for name, direction, size, region in SCENES:
        path = root / f"{name}.iv"
        session = ivscan.scan(ss.load(path), size, camera=direction, region=region)
        views = [ivscan.draw_view(session, view, listing_of(str(path))) for view in ivscan.VIEWS]
        make_sheet(views).quantize(256, kmeans=3, dither=Image.Dither.NONE).save(Path(folder) / f"{name}.png", optimize=True)
        (Path(folder) / f"{name}.gif").write_bytes(ivscan.animate(session))
        print(name, *ivscan.describe_calls(session), sep="\n  ")


if __name__ == "__main__":
    main(sys.argv[1])
