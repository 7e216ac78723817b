"""ivscan: a scene seen five ways, as the lecture shows it: the input, pixels outlined, edges outlined, the calls, the result.

A small picture is rendered with one sample a pixel, and a region of it is magnified so that single pixels are seen. The calls
are those of the algorithm that ships, recorded by `view.calls`; replaying their log gives the result to the bit.

Source: MIT 6.837, lecture 9 of 2002, the pictures of ivscan.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scanspan.assets.camera import Camera
from scanspan.assets.scene import Scene, primitive_count
from scanspan.errors import FormatError, InputError
from scanspan.pipeline import render
from scanspan.records import Array, Float64Array, UInt8Array
from scanspan.shade.colormap import colorize
from scanspan.target.frame import Frame
from scanspan.view.calls import Calls, Region, check_region, record_calls

VIEWS = {
    "input": "what the scene holds, and the region in the whole picture",
    "pixels": "every pixel of the result outlined, its sample marked",
    "edges": "the edges of the faces over the pixels, where they lie to 1/256 pixel",
    "calls": "every call to set a pixel, coloured by its turn; also as an animation and a log",
    "result": "the resulting image",
}
BACKGROUND = (255, 255, 255)
PAPER, INK, FAINT = (255, 255, 255), (20, 22, 28), (150, 156, 166)
EDGE_INK, REGION_INK, SAMPLE_INK = (200, 30, 30), (220, 40, 40), (20, 22, 28)
OVERSAMPLING = 3  # of the lines that are drawn over the pixels
MAX_SIDE = 4096  # of a view, pixels
MAX_FRAMES = 120  # of an animation
MAX_LINES = 400  # of the listing of the input
MILLISECONDS = 60  # a frame of an animation
LOG_HEADER = "scanspan setPixel log 1"


class Session(NamedTuple):
    """A scene scan-converted once.

    frame : the picture, one sample a pixel. region : of it that is magnified. zoom : pixels of a view for one of the picture.
    calls : in order. behind : (h, w, 4) uint8, the region before the first call.
    """

    frame: Frame
    region: Region
    zoom: int
    calls: Calls
    behind: UInt8Array


def scan(
    scene: Scene,
    size: tuple[int, int] = (96, 72),
    *,
    camera: Camera | str | None = None,
    region: Region | None = None,
    zoom: int | None = None,
    algorithm: str = "scanline-eval",
    order: str = "rows",
) -> Session:
    """Scan-convert a scene and record every call that sets a pixel.

    Parameters
    ----------
    scene : any scene.
    size : (width, height) of the picture in pixels.
    camera : as for `scanspan.render`.
    region : x_start, y_start, x_end, y_end of what is magnified; the whole picture when None.
    zoom : pixels of a view for one of the picture; as many as make some 960 across when None.
    algorithm, order : as for `scanspan.render`.

    Raises
    ------
    InputError : a region that reaches beyond the picture, a zoom that is no whole number from 1 on or makes a view of more than
        4096 pixels across, or as `scanspan.render`.

    Examples
    --------
    >>> import scanspan as ss
    >>> session = scan(ss.Scene(ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])), (8, 6))
    >>> bool((replay(session.calls, session.behind) == session.frame.color).all())
    True
    """
    frame = render(scene, camera, size, samples=1, background=BACKGROUND, translucency=False, algorithm=algorithm, order=order)
    window = check_region(region, frame.size)
    longest = max(window[2] - window[0], window[3] - window[1])
    if zoom is None:
        zoom = min(max(960 // longest, 1), 64)
    if isinstance(zoom, bool) or not isinstance(zoom, (int, np.integer)) or zoom < 1 or zoom * longest > MAX_SIDE:
        raise InputError(f"zoom = {zoom!r}: expected a whole number from 1 to {max(MAX_SIDE // longest, 1)}")
    calls = record_calls(frame, window)
    behind = np.full((window[3] - window[1], window[2] - window[0], 4), (*BACKGROUND, 255), np.uint8)
    return Session(frame, window, int(zoom), calls, behind)


def draw_view(session: Session, name: str, listing: Iterable[str] = ()) -> UInt8Array:
    """Return one of the VIEWS as a picture, (H, W, 4) uint8; `listing` are the lines that the input shows."""
    if name == "input":
        return draw_input(session, listing)
    if name == "calls":
        return draw_calls(session)
    picture = magnify(crop(session.frame.color, session.region), session.zoom)
    if name == "pixels":
        return outline_pixels(picture, session)
    if name == "edges":
        return outline_edges(fade(picture), session)
    if name == "result":
        return picture
    raise InputError(f"view = {name!r}: expected one of {', '.join(VIEWS)}")


def crop(picture: UInt8Array, region: Region) -> UInt8Array:
    """Return a part of a picture."""
    x_start, y_start, x_end, y_end = region
    return picture[y_start:y_end, x_start:x_end]


def magnify(picture: UInt8Array, zoom: int) -> UInt8Array:
    """Return a picture with each pixel as a square of zoom x zoom."""
    return np.ascontiguousarray(picture.repeat(zoom, axis=0).repeat(zoom, axis=1))


def fade(picture: UInt8Array) -> UInt8Array:
    """Return a picture half way to white."""
    faded = picture.copy()
    faded[..., :3] = 255 - (255 - picture[..., :3]) // 2
    return faded


def grid_lines(picture: UInt8Array, zoom: int) -> UInt8Array:
    """Return a picture with a line round each square of zoom x zoom, darker or lighter than what it parts."""
    if zoom < 4:
        return picture
    lined = picture.copy()
    for line in (np.s_[::zoom], np.s_[:, ::zoom]):
        colors = lined[line][..., :3].astype(np.int64)
        is_dark = colors.sum(axis=-1, keepdims=True) < 3 * 110
        lined[line][..., :3] = np.clip(np.where(is_dark, colors + 60, colors - 55), 0, 255)
    return lined


def outline_pixels(picture: UInt8Array, session: Session) -> UInt8Array:
    """Return the result with its pixels outlined and, where there is room, a dot at each sample that was set."""
    lined = grid_lines(picture, session.zoom)
    if session.zoom < 8:
        return lined
    half, radius = session.zoom // 2, max(session.zoom // 16, 1)
    x_start, y_start, _, _ = session.region
    for x, y in np.unique(session.calls.xy, axis=0).tolist():
        left, top = (x - x_start) * session.zoom + half, (y - y_start) * session.zoom + half
        square = lined[top - radius : top + radius, left - radius : left + radius]
        square[..., :3] = SAMPLE_INK if square[..., :3].mean() > 110 else PAPER
    return lined


def edge_lines(session: Session) -> tuple[Float64Array, Array]:
    """Return the edges of the faces that reach into the region, (E, 2, 2) in pixels of the picture, and whose face is seen."""
    frame = session.frame
    seen = np.unique(crop(frame.primitive, session.region))
    screen, draw = frame._screen, frame._draw
    scale = 1.0 / (1 << frame._options.subpixel_bits)
    corners = screen.xy[screen.corners] * scale
    hidden = screen.inner | draw.inner[screen.source]
    is_seen = np.isin(draw.primitive[screen.source], seen)
    ends, marks = [], []
    for k in range(3):
        shown = (hidden >> np.uint8(k) & 1 == 0) & (screen.inner & 8 == 0)
        ends.append(corners[shown][:, [(k + 1) % 3, (k + 2) % 3]])
        marks.append(is_seen[shown])
    if frame._polygons is not None:
        rings = frame._polygons
        owner = np.repeat(is_seen[rings.slot], np.diff(rings.polygon_rings))
        for (first, last), mark in zip(pairwise(rings.ring_starts.tolist()), owner.tolist()):
            ring = rings.xy[first:last] * scale
            ends.append(np.stack([ring, np.roll(ring, -1, axis=0)], axis=1))
            marks.append(np.full(len(ring), mark))
    lines = np.concatenate(ends)
    x_start, y_start, x_end, y_end = session.region
    low, high = lines.min(axis=1), lines.max(axis=1)
    near = (high >= (x_start, y_start)).all(axis=1) & (low <= (x_end, y_end)).all(axis=1)
    return np.asarray(lines[near]), np.concatenate(marks)[near]


def outline_edges(picture: UInt8Array, session: Session) -> UInt8Array:
    """Return pixels with the edges of the faces drawn over them: strong where the face is seen, faint where it is not."""
    lined = grid_lines(picture, session.zoom)
    scale = session.zoom * OVERSAMPLING
    height, width = lined.shape[:2]
    far = 4.0 * MAX_SIDE * OVERSAMPLING
    lines, is_seen = edge_lines(session)
    lines = ((lines - session.region[:2]) * scale).clip(-far, far)
    for some, ink, thickness in ((~is_seen, FAINT, OVERSAMPLING), (is_seen, EDGE_INK, max(OVERSAMPLING, scale // 12))):
        mask = Image.new("L", (width * OVERSAMPLING, height * OVERSAMPLING))
        pen = ImageDraw.Draw(mask)
        for line in lines[some].tolist():
            pen.line([tuple(end) for end in line], fill=255, width=thickness)
        share = np.asarray(mask.resize((width, height), Image.Resampling.BOX), np.float64)[..., None] / 255.0
        lined[..., :3] = np.rint(lined[..., :3] * (1.0 - share) + np.array(ink) * share)
    return lined


# The calls


def draw_calls(session: Session) -> UInt8Array:
    """Return the calls by their turn: early ones blue, late ones yellow, their numbers where there is room, grey where none."""
    calls, zoom = session.calls, session.zoom
    x_start, y_start, _, _ = session.region
    turns = np.full(session.behind.shape[:2], np.nan)
    xy = calls.xy - (x_start, y_start)
    turns[xy[:, 1], xy[:, 0]] = np.arange(len(xy))
    small = np.full((*turns.shape, 4), (236, 238, 241, 255), np.uint8)
    known = ~np.isnan(turns)
    if known.any():
        small[known] = colorize(np.where(known, turns, 0.0), limits=(0, max(len(xy) - 1, 1)))[known]
    picture = grid_lines(magnify(small, zoom), zoom)
    image = Image.fromarray(picture)
    pen = ImageDraw.Draw(image)

    # Join each call to the next one of the same row, which shows the spans; and number them.
    ends = (xy + 0.5) * zoom
    joined = np.flatnonzero((np.abs(np.diff(xy[:, 0])) == 1) & (np.diff(xy[:, 1]) == 0)).tolist()
    for number in joined if 8 <= zoom < 24 else []:
        pen.line([tuple(ends[number]), tuple(ends[number + 1])], fill=PAPER, width=1)
    if zoom >= 24 and len(xy):
        font = ImageFont.load_default(max(zoom / 3.2, 8))
        for x, y in np.argwhere(known.T).tolist():
            text = str(int(turns[y, x]) + 1)
            ink = INK if small[y, x, :3].astype(int).sum() > 330 else PAPER
            pen.text(((x + 0.5) * zoom, (y + 0.5) * zoom), text, fill=ink, font=font, anchor="mm")
    return np.asarray(image)


def animate(session: Session) -> bytes:
    """Return a GIF in which the picture appears call by call, in at most MAX_FRAMES steps; the last frame is the result."""
    calls, zoom = session.calls, min(session.zoom, max(480 // max(session.behind.shape[:2]), 1))
    total = len(calls.xy)
    steps = np.unique(np.linspace(0, total, min(MAX_FRAMES, total + 1)).astype(np.int64)).tolist()
    picture = session.behind.copy()
    frames, done = [], 0
    for count in steps:
        for (x, y), color in zip(calls.xy[done:count].tolist(), calls.color[done:count]):
            picture[y - session.region[1], x - session.region[0]] = color
        done = count
        frames.append(Image.fromarray(magnify(picture, zoom)[..., :3]).quantize(256, dither=Image.Dither.NONE))
    stream = io.BytesIO()
    waits = [MILLISECONDS] * (len(frames) - 1) + [2000]
    frames[0].save(stream, "GIF", save_all=True, append_images=frames[1:], duration=waits, loop=0)
    return stream.getvalue()


def write_log(session: Session) -> str:
    """Return the calls as text: a header, then a line `x y r g b a primitive depth` for each."""
    calls = session.calls
    width, height = calls.size
    lines = [
        LOG_HEADER,
        f"size {width} {height}",
        "region " + " ".join(map(str, calls.region)),
        "background " + " ".join(map(str, (*BACKGROUND, 255))),
        f"calls {len(calls.xy)}",
    ]
    for (x, y), color, primitive, depth in zip(
        calls.xy.tolist(), calls.color.tolist(), calls.primitive.tolist(), calls.depth.tolist()
    ):
        lines.append(f"{x} {y} {' '.join(map(str, color))} {primitive} {depth!r}")
    return "\n".join([*lines, ""])


def replay(calls: Calls, behind: Array) -> UInt8Array:
    """Return what the calls make of a background."""
    return calls.replay(behind)


def replay_log(text: str, name: str = "log") -> UInt8Array:
    """Return the picture of a region that a log makes, (h, w, 4) uint8.

    Raises
    ------
    FormatError : the text is no log, or a line of it is wrong.
    """
    lines = text.splitlines()
    if not lines or lines[0] != LOG_HEADER:
        raise FormatError(name, f"expected a log that begins with {LOG_HEADER!r}")
    found: dict[str, list[int]] = {}
    for number, (word, count) in enumerate((("size", 2), ("region", 4), ("background", 4), ("calls", 1)), 2):
        parts = lines[number - 1].split() if number <= len(lines) else []
        if len(parts) != count + 1 or parts[0] != word or not all(part.isdigit() for part in parts[1:]):
            raise FormatError(name, f"expected {word!r} and {count} whole numbers", f"line {number}")
        found[word] = [int(part) for part in parts[1:]]
    size = found["size"][0], found["size"][1]
    x_start, y_start, x_end, y_end = check_region(tuple(found["region"]), size)
    picture = np.full((y_end - y_start, x_end - x_start, 4), np.array(found["background"]).clip(0, 255), np.uint8)
    if len(lines) - 5 != found["calls"][0]:
        raise FormatError(name, f"expected {found['calls'][0]} calls, got {len(lines) - 5}", "line 5")
    for number, line in enumerate(lines[5:], 6):
        parts = line.split()
        values = [int(part) for part in parts[:6] if part.isdigit()]
        if len(parts) != 8 or len(values) != 6 or max(values[2:]) > 255:
            raise FormatError(name, "expected x y r g b a primitive depth", f"line {number}")
        if not (x_start <= values[0] < x_end and y_start <= values[1] < y_end):
            raise FormatError(name, f"pixel {values[0]}, {values[1]} lies outside of the region", f"line {number}")
        picture[values[1] - y_start, values[0] - x_start] = values[2:]
    return picture


# The input


def describe_scene(scene: Scene) -> list[str]:
    """Return a line for each instance of a scene: what it is and what it is made of."""
    lines = [repr(scene)]
    for number, instance in enumerate(scene.instances):
        color = instance.material.color_of(instance.has_colors)
        shade = "own colours" if instance.has_colors else "#" + "".join(f"{round(255 * value):02x}" for value in color[:3])
        count = primitive_count(instance.geometry)
        kind = type(instance.geometry).__name__
        lines.append(f"{number}  {instance.name or '-'}  {kind}, {count} primitive{'s' * (count != 1)}, {shade}")
    return lines


def draw_input(session: Session, listing: Iterable[str]) -> UInt8Array:
    """Return the listing of the input, and beside it the whole picture with the region framed."""
    width, height = session.frame.size
    zoom = max(min(720 // max(width, height), 24), 1)
    picture = Image.fromarray(magnify(session.frame.color, zoom)).convert("RGB")
    x_start, y_start, x_end, y_end = (value * zoom for value in session.region)
    ImageDraw.Draw(picture).rectangle((x_start, y_start, x_end - 1, y_end - 1), outline=REGION_INK, width=max(zoom // 3, 1))
    lines = list(listing) or describe_scene(session.frame.scene)
    font = ImageFont.load_default(12)
    rows = max((picture.height - 24) // 15, 12)
    shown = lines if len(lines) <= rows else [*lines[: rows - 1], f"... {len(lines) - rows + 1} more lines"]
    across = 420
    sheet = Image.new("RGB", (across + picture.width, max(picture.height, 24 + 15 * len(shown))), PAPER)
    pen = ImageDraw.Draw(sheet)
    for number, line in enumerate(shown):
        indent = len(line) - len(line.lstrip())
        text = line.strip()[:160]
        pen.text((12 + 7 * indent, 12 + 15 * number), text, fill=INK if indent < 4 else FAINT, font=font)
    sheet.paste(picture, (across, 0))
    return np.asarray(sheet.convert("RGBA"))


def as_listing(text: str) -> list[str]:
    """Return the first lines of a text, with long runs of numbers cut short."""
    lines: list[str] = []
    for line in text.splitlines():
        if len(lines) == MAX_LINES:
            break
        lines.append(line.expandtabs(2)[:200].rstrip())
    return lines


def is_exact(session: Session) -> bool:
    """Say whether the log, written and read again, makes the result to the bit."""
    return bool(np.array_equal(replay_log(write_log(session)), crop(session.frame.color, session.region)))


def describe_calls(session: Session) -> list[str]:
    """Return what there is to say of the calls, a line each."""
    found = summarise(session)
    width, height = session.frame.size
    return [
        f"picture: {width} x {height}, {session.frame._options.algorithm}, region {session.region}",
        f"calls: {found['calls']:,} set {found['pixels']:,} pixels, {found['set_again']:,} of them again; "
        f"{found['refused']:,} samples lay behind; {found['primitives']:,} primitives are seen",
        f"the log makes the result: {'yes, to the bit' if is_exact(session) else 'NO'}",
    ]


def summarise(session: Session) -> dict[str, Any]:
    """Return what there is to say of the calls in numbers."""
    calls = session.calls
    pixels = len(np.unique(calls.xy, axis=0))
    return {
        "calls": len(calls.xy),
        "pixels": pixels,
        "set_again": len(calls.xy) - pixels,
        "refused": calls.refused,
        "primitives": len(np.unique(calls.primitive)),
    }
