"""Pictures of experiments: pixels shown large, outlines over them, numbers as colours, charts, and a sheet of all of them.

Where pixels are the point they are kept small and shown with several screen pixels each; where an outline lies over them they
are enlarged here, so that it can be drawn finely. Outlines and curves are drawn on a Canvas. Letters are Pillow's, which the
contact sheets use too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageDraw, ImageFont

from scanspan.canvas import Canvas
from scanspan.records import Array, Float64Array, UInt8Array

# Colours that can be told apart by most people, on white (Okabe and Ito 2008).
BLUE, ORANGE, GREEN, RED, VIOLET, SKY = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (213, 94, 0),
    (148, 83, 160),
    (86, 180, 233),
)
WHITE, PALE, GREY, INK = (255, 255, 255), (226, 230, 235), (140, 148, 158), (38, 44, 52)
CURVES = (BLUE, RED, GREEN, ORANGE, VIOLET, SKY)
SHEET_WIDTH = 1080
MARGIN = 12
LETTERS = 13


class Panel(NamedTuple):
    """A picture with a caption."""

    caption: str
    pixels: UInt8Array  # (H, W, 3)
    scale: int = 1  # screen pixels along a side of a pixel


def panel(caption: str, pixels: Array, scale: int = 1) -> Panel:
    """Return a panel of pixels (H, W), (H, W, 3) or (H, W, 4); greys are repeated, and alpha is left out."""
    found = np.asarray(pixels, np.uint8)
    colors = np.repeat(found[..., None], 3, axis=2) if found.ndim == 2 else found[..., :3]
    return Panel(caption, np.ascontiguousarray(colors), scale)


def enlarged(pixels: Array, k: int) -> UInt8Array:
    """Return pixels repeated k times each way.

    >>> enlarged(np.array([[1, 2]]), 2).tolist()
    [[1, 1, 2, 2], [1, 1, 2, 2]]
    """
    return np.repeat(np.repeat(np.asarray(pixels, np.uint8), k, axis=0), k, axis=1)


def gridded(pixels: Array, k: int) -> UInt8Array:
    """Return pixels (H, W, 3 or 4) repeated k times each way, with a thin line between them: (H k, W k, 3)."""
    large = enlarged(np.asarray(pixels)[..., :3], k)
    for line in (large[::k], large[:, ::k]):
        line[:] = (line.astype(np.int64) * 4 + 128) // 5
    return large


def painted(numbers: ArrayLike, colors: Sequence[tuple[int, int, int]]) -> UInt8Array:
    """Return whole numbers as colours, (H, W, 3): 0 is the first of them, and the last is for all beyond.

    >>> painted([[0, 1, 9]], [WHITE, BLUE]).tolist()
    [[[255, 255, 255], [0, 114, 178], [0, 114, 178]]]
    """
    palette = np.array(colors, np.uint8)
    found: UInt8Array = palette[np.clip(np.asarray(numbers).astype(np.int64), 0, len(colors) - 1)]
    return found


def shaded(values: ArrayLike, low: float, high: float, stops: Sequence[tuple[int, int, int]] = (WHITE, INK)) -> UInt8Array:
    """Return numbers as colours between stops that lie evenly from low to high, (H, W, 3)."""
    found = np.asarray(values, np.float64)
    place = np.clip((found - low) / (high - low), 0, 1) * (len(stops) - 1)
    first = np.minimum(place.astype(np.int64), len(stops) - 2)
    ends, share = np.array(stops, np.float64), (place - first)[..., None]
    mixed: UInt8Array = np.rint(ends[first] * (1 - share) + ends[first + 1] * share).astype(np.uint8)
    return mixed


def with_outlines(
    pixels: Array, shapes: Sequence[ArrayLike], k: int = 1, color: Any = INK, width: float = 1.6, closed: bool = True
) -> UInt8Array:
    """Return a picture with lines through points over it; the points are in pixels, and each is k pixels of the picture."""
    height, across = np.asarray(pixels).shape[:2]
    canvas = Canvas(across, height, "white")
    canvas.pixels[..., :3] = np.asarray(pixels)[..., :3]
    for points in shapes:
        canvas.polyline(np.asarray(points, np.float64) * k, color, closed=closed, antialias=True, width=width, join="round")
    drawn: UInt8Array = canvas.pixels[..., :3].copy()
    return drawn


def with_dots(pixels: Array, places: ArrayLike, k: int = 1, color: Any = INK, size: float = 4.0) -> UInt8Array:
    """Return a picture with round dots over it; the places are in pixels, and each is k pixels of the picture."""
    height, across = np.asarray(pixels).shape[:2]
    canvas = Canvas(across, height, "white")
    canvas.pixels[..., :3] = np.asarray(pixels)[..., :3]
    canvas.points(np.asarray(places, np.float64) * k, color, size=size, shape="disc", antialias=True)
    return canvas.pixels[..., :3].copy()


def beside(*pictures: Array, gap: int = 1) -> UInt8Array:
    """Return pictures of one height side by side, with a pale gap between them."""
    height = pictures[0].shape[0]
    bar = np.broadcast_to(np.array(PALE, np.uint8), (height, gap, 3))
    parts = [part for picture in pictures for part in (bar, np.asarray(picture)[..., :3])]
    return np.concatenate(parts[1:], axis=1).astype(np.uint8)


def stacked(*pictures: Array, gap: int = 1) -> UInt8Array:
    """Return pictures of one width one below the other, with a pale gap between them."""
    turned = beside(*[np.swapaxes(picture, 0, 1) for picture in pictures], gap=gap)
    return np.ascontiguousarray(np.swapaxes(turned, 0, 1))


# Charts


class Axis(NamedTuple):
    """What a chart shows in one direction."""

    title: str
    is_log: bool = False


def chart(
    curves: Sequence[tuple[str, ArrayLike, ArrayLike]], x: Axis, y: Axis, size: tuple[int, int] = (480, 300)
) -> UInt8Array:
    """Return curves over axes, (H, W, 3); on a logarithmic axis, what is not above 0 is left out.

    Parameters
    ----------
    curves : the name, x and y of each.
    x, y : the axes.
    size : (width, height) in pixels.
    """
    kept = [(name, *above_zero(xs, ys, x.is_log, y.is_log)) for name, xs, ys in curves]
    ranges = [rounded_range(np.concatenate([curve[k] for curve in kept]), axis.is_log) for k, axis in ((1, x), (2, y))]
    left, right, top, bottom = 64, size[0] - 26, 18 + 18 * len(kept), size[1] - 44
    canvas = Canvas(*size, "white")

    def place(values: Float64Array, axis: int) -> Float64Array:
        low, high = ranges[axis]
        share = (values - low) / (high - low)
        return left + share * (right - left) if axis == 0 else bottom - share * (bottom - top)

    # Lines at round numbers, then the curves over them.
    ticks = [steps_between(*ranges[k], axis.is_log) for k, axis in ((0, x), (1, y))]
    for at in place(np.array(ticks[0]), 0):
        canvas.lines([[(at, top), (at, bottom)]], PALE, antialias=True)
    for at in place(np.array(ticks[1]), 1):
        canvas.lines([[(left, at), (right, at)]], PALE, antialias=True)
    for number, (_, xs, ys) in enumerate(kept):
        points = np.stack([place(xs, 0), place(ys, 1)], axis=1)
        canvas.polyline(points, CURVES[number % len(CURVES)], antialias=True, width=2, join="round")
        canvas.points(points, CURVES[number % len(CURVES)], size=5, shape="disc", antialias=True)

    # Numbers, titles and names.
    image = Image.fromarray(canvas.pixels[..., :3].copy())
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(LETTERS)
    for tick, at in zip(ticks[0], place(np.array(ticks[0]), 0)):
        draw.text((at, bottom + 6), tick_text(tick, x.is_log), fill=INK, font=font, anchor="ma")
    for tick, at in zip(ticks[1], place(np.array(ticks[1]), 1)):
        draw.text((left - 8, at), tick_text(tick, y.is_log), fill=INK, font=font, anchor="rm")
    draw.text(((left + right) / 2, size[1] - 18), x.title, fill=INK, font=font, anchor="ma")
    draw.text((8, 4), y.title, fill=INK, font=font)
    for number, (name, _, _) in enumerate(kept):
        at = 22 + 18 * number
        draw.line([(right - 18, at), (right, at)], fill=CURVES[number % len(CURVES)], width=3)
        draw.text((right - 26, at), name, fill=INK, font=font, anchor="rm")
    return np.asarray(image)


def above_zero(xs: ArrayLike, ys: ArrayLike, x_log: bool, y_log: bool) -> tuple[Float64Array, Float64Array]:
    """Return the points that can be shown, as logarithms where that is asked for."""
    x, y = np.asarray(xs, np.float64), np.asarray(ys, np.float64)
    good = (x > 0 if x_log else np.isfinite(x)) & (y > 0 if y_log else np.isfinite(y))
    x, y = x[good], y[good]
    return (np.log10(x) if x_log else x), (np.log10(y) if y_log else y)


def rounded_range(values: Float64Array, is_log: bool) -> tuple[float, float]:
    """Return the ends of an axis that holds some values."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    if is_log:
        return math.floor(low), max(math.ceil(high), math.floor(low) + 1)
    low = min(low, 0.0)
    step = tick_step(low, high)
    return math.floor(low / step) * step, max(math.ceil(high / step) * step, low + step)


def tick_step(low: float, high: float) -> float:
    """Return a round number that goes about five times into a range."""
    raw = (high - low) / 5 or 1.0
    power = 10.0 ** math.floor(math.log10(raw))
    return power * next(k for k in (1, 2, 5, 10) if k * power >= raw * 0.999)


def steps_between(low: float, high: float, is_log: bool) -> list[float]:
    """Return where an axis has its numbers."""
    step = max(1, round((high - low) / 6)) if is_log else tick_step(low, high)
    first = low if is_log else math.ceil(low / step - 0.001) * step
    return [first + k * step for k in range(int((high - first) / step + 1.001))]


def tick_text(value: float, is_log: bool) -> str:
    """Return a number of an axis."""
    if is_log:
        return f"{10.0**value:g}" if -3 <= value <= 3 else f"1e{round(value)}"
    return f"{value:.6g}"


# Sheets


def compose(panels: Sequence[Panel]) -> UInt8Array:
    """Return panels in rows on one white sheet, each with its caption above it: (H, W, 3).

    >>> compose([Panel("one", np.zeros((8, 8, 3), np.uint8), 4), Panel("two", np.zeros((8, 8, 3), np.uint8), 4)]).shape[2]
    3
    """
    font = ImageFont.load_default(LETTERS)
    blocks = [block_of(shown, font) for shown in panels]
    rows: list[list[UInt8Array]] = [[]]
    for block in blocks:
        used = sum(other.shape[1] + MARGIN for other in rows[-1])
        if rows[-1] and used + block.shape[1] + 2 * MARGIN > SHEET_WIDTH:
            rows.append([])
        rows[-1].append(block)

    # Lay the rows out from the top left.
    width = max(sum(block.shape[1] + MARGIN for block in row) for row in rows) + MARGIN
    height = sum(max(block.shape[0] for block in row) + MARGIN for row in rows) + MARGIN
    sheet = np.full((height, width, 3), 255, np.uint8)
    y = MARGIN
    for row in rows:
        x = MARGIN
        for block in row:
            sheet[y : y + block.shape[0], x : x + block.shape[1]] = block
            x += block.shape[1] + MARGIN
        y += max(block.shape[0] for block in row) + MARGIN
    return sheet


def block_of(shown: Panel, font: Any) -> UInt8Array:
    """Return a panel enlarged, with its caption above it in as many lines as it needs."""
    picture = enlarged(shown.pixels, shown.scale)
    limit = max(picture.shape[1], 150)
    lines = [""]
    for word in shown.caption.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and font.getlength(longer) > limit:
            lines.append(word)
        else:
            lines[-1] = longer
    head = (LETTERS + 4) * len(lines) + 4
    width = max(picture.shape[1], math.ceil(max(font.getlength(line) for line in lines)))
    block = Image.new("RGB", (width, head + picture.shape[0]), WHITE)
    ImageDraw.Draw(block).multiline_text((0, 0), "\n".join(lines), fill=INK, font=font, spacing=4)
    block.paste(Image.fromarray(picture), (0, head))
    return np.asarray(block)
