"""A contact sheet: several views of one scene on one picture, each with its name, all at one scale.

The sheet has the size that was asked for; the views share it as a grid of equal cells. One scale for all lets a length be
compared from view to view, as on an engineer's drawing, at the price that a long object is small when seen end on. Under
perspective the scale is that at the centre of the scene, so the eyes stand at one distance from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from scanspan.assets.camera import Camera
from scanspan.assets.lens import Orthographic
from scanspan.errors import InputError
from scanspan.records import UInt8Array

# Letters are this share of a cell's height, within limits that can be read and do not shout.
_LETTER_SHARE = 1 / 26
_LETTER_PIXELS = (12, 30)
_MARGIN = 0.03  # share of a cell left free at each side where there is no label, as Camera.frame has it
_DARK, _LIGHT = (52, 60, 72), (236, 240, 245)
_WHITE_PAPER, _BLACK_PAPER = (255, 255, 255), (10, 13, 18)


class Layout(NamedTuple):
    """Where the views stand on a sheet, in pixels."""

    size: tuple[int, int]  # of the sheet
    cell: tuple[int, int]  # width and height of every view
    corners: tuple[tuple[int, int], ...]  # left and top of every view
    letters: int  # height of the letters, 0 for no labels
    margin: float  # share of a cell to leave free at each side


def plan(names: Sequence[str], size: tuple[int, int]) -> Layout:
    """Return where views stand on a sheet: the grid of equal cells with the largest room for a picture of 4:3.

    Parameters
    ----------
    names : the labels of the views.
    size : (width, height) of the sheet in pixels.

    Raises
    ------
    InputError : when a view would have no pixel.

    Examples
    --------
    >>> plan(["iso", "front", "right", "top"], (1280, 960)).cell
    (638, 478)
    """
    width, height = size
    gap = max(1, round(min(size) / 240))

    # Try every number of columns; of two as good, take the one with fewer empty cells.
    best = (0.0, 0, 1)
    for across in range(1, len(names) + 1):
        down = -(-len(names) // across)
        room = min(width / across, height / down * 4 / 3)
        best = max(best, (room, len(names) - across * down, across))
    columns = best[2]
    rows = -(-len(names) // columns)
    cell = ((width - gap * (columns - 1)) // columns, (height - gap * (rows - 1)) // rows)
    if min(cell) < 1:
        raise InputError(f"size = ({width}, {height}): too small for {len(names)} views")

    # Centre the grid on the sheet, and a last row that is not full in the grid.
    corners = []
    for number in range(len(names)):
        row, column = divmod(number, columns)
        in_row = min(columns, len(names) - row * columns)
        left = (width - in_row * cell[0] - (in_row - 1) * gap) // 2 + column * (cell[0] + gap)
        top = (height - rows * cell[1] - (rows - 1) * gap) // 2 + row * (cell[1] + gap)
        corners.append((left, top))
    letters = _letter_height(names, cell)
    return Layout(size, cell, tuple(corners), letters, max(_MARGIN, 1.75 * letters / cell[1]))


def _letter_height(names: Sequence[str], cell: tuple[int, int]) -> int:
    """Return the height of the letters in pixels, 0 where a cell is too small for labels."""
    low, high = _LETTER_PIXELS
    letters = min(max(round(cell[1] * _LETTER_SHARE), low), high)
    widest = max(ImageFont.load_default(letters).getlength(name) for name in names)
    return letters if cell[1] >= 8 * letters and cell[0] >= widest + 2 * letters else 0


def match_scales(cameras: Sequence[Camera], centre: npt.ArrayLike) -> list[Camera]:
    """Return cameras that look the same way and show a length at the centre of the scene equally long: the smallest of theirs.

    Parameters
    ----------
    cameras : all with the same lens, each with the scene in view.
    centre : (3,) the centre of the scene.

    Examples
    --------
    >>> near, far = Camera.look_at((0, 0, 5), (0, 0, 0)), Camera.look_at((8, 0, 0), (0, 0, 0))
    >>> match_scales([near, far], (0, 0, 0))[0].eye
    array([0., 0., 8.])
    """
    heights = [camera.lens.height for camera in cameras if isinstance(camera.lens, Orthographic)]
    if len(heights) == len(cameras):
        tallest = max(heights)
        return [_with_height(camera, tallest) for camera in cameras]

    # Move every eye back along its line of sight; what was in view stays in view.
    distances = [float(camera.depth(np.asarray(centre)[None])[0]) for camera in cameras]
    farthest = max(distances)
    moved = []
    for camera, distance in zip(cameras, distances):
        view = camera.view.copy()
        view[2, 3] -= farthest - distance
        moved.append(replace(camera, view=view, near=camera.near + (farthest - distance)))
    return moved


def _with_height(camera: Camera, height: float) -> Camera:
    """Return an orthographic camera that shows another height."""
    assert isinstance(camera.lens, Orthographic)
    return replace(camera, lens=Orthographic(height, camera.lens.reach))


def compose(pictures: Sequence[UInt8Array], names: Sequence[str], layout: Layout, *, transparent: bool = False) -> UInt8Array:
    """Return the sheet.

    Parameters
    ----------
    pictures : (h, w, 4) uint8, one for each view, of the size that `layout.cell` has.
    names : the label of each.
    layout : from `plan`.
    transparent : whether the gaps between the views are transparent. Else they are white beside light pictures, and nearly
        black beside dark ones.

    Returns
    -------
    (H, W, 4) uint8.

    Raises
    ------
    InputError : when a picture has another size.
    """
    width, height = layout.size
    paper = _WHITE_PAPER if transparent or all(_is_light(picture[:1]) for picture in pictures) else _BLACK_PAPER
    sheet = np.full((height, width, 4), (*paper, 0 if transparent else 255), np.uint8)
    for picture, name, (left, top) in zip(pictures, names, layout.corners):
        if picture.shape != (layout.cell[1], layout.cell[0], 4):
            raise InputError(f"the picture of {name!r} has shape {picture.shape}: expected {(*layout.cell[::-1], 4)}")
        sheet[top : top + layout.cell[1], left : left + layout.cell[0]] = write_label(picture, name, layout.letters)
    return sheet


def write_label(picture: UInt8Array, name: str, letters: int) -> UInt8Array:
    """Return a picture with a name in its top left corner, in the one of two inks that stands out there.

    Parameters
    ----------
    picture : (h, w, 4) uint8, sRGB with straight alpha.
    name : what to write.
    letters : height of the letters in pixels; 0 writes nothing.
    """
    if not letters:
        return picture
    font = ImageFont.load_default(letters)
    left, top = round(letters * 0.8), round(letters * 0.5)

    # Draw the letters as a mask, one that covers only where they are.
    mask = Image.new("L", (math.ceil(font.getlength(name)) + 2, 2 * letters))
    ImageDraw.Draw(mask).text((1, 0), name, fill=255, font=font)
    share = np.asarray(mask, dtype=np.float64)[: picture.shape[0] - top, : picture.shape[1] - left, None] / 255.0

    # Choose the ink by what is behind it, and lay it over that.
    where = slice(top, top + share.shape[0]), slice(left, left + share.shape[1])
    behind = picture[where].astype(np.float64)
    alpha = behind[..., 3:] / 255.0
    ink = np.array(_DARK if _is_light(picture[where]) else _LIGHT, np.float64)
    above = share + alpha * (1.0 - share)
    colors = ink * share + behind[..., :3] * alpha * (1.0 - share)
    mixed = np.concatenate([colors / np.where(above > 0.0, above, 1.0), above * 255.0], axis=2)
    labelled = picture.copy()
    labelled[where] = np.where(share > 0.0, np.rint(mixed), behind).astype(np.uint8)
    return labelled


def _is_light(picture: UInt8Array) -> bool:
    """Say whether a picture, laid over white, is light rather than dark."""
    alpha = picture[..., 3:] / 255.0
    return bool((picture[..., :3] * alpha + 255.0 * (1.0 - alpha)).mean() > 110.0)
