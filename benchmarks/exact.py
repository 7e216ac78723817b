"""What the pictures of the scenes have to be, from integers and NumPy alone, and how many pixels of a peer's differ.

A peer counts only for the output that it gives, so every picture is compared with the exact one. The rule is that of the
graphics interfaces: a pixel belongs to the shape that holds its centre, with the left and the upper border, and what is painted
later lies over what was there. Lines go through the pixels nearest to them; where two are equally near, either will do.

Nothing here is shared with scanspan. Crossings of edges and rows are found in whole numbers: corners are multiples of 1/256 px.
Areas are the mean of 64 rows within a pixel, each exact along the row, and are worked out for every eighth row of pixels.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.cloud_scenes import CloudScene, nearest_depths
from benchmarks.plane_scenes import FloodScene, LineScene, PointScene, PolygonScene, RingsScene
from benchmarks.scenes import GRID, FlatScene

Integers = NDArray[np.int64]
# Form of an output, as in Entry.gives: the pictures that are right; where there are several, a pixel of any of them is.
Answer = dict[str, list[NDArray[Any]]]

HALF = GRID // 2
SUBROWS = 64
EVERY = 8  # rows of pixels, of which one is compared where shares are
BLOCK = 1 << 22  # pixels or crossings at a time
BAND = 64  # rows that are compared at a time

# How far a value may be off, by the kind of a scene: of 255 for colours, of 1 for shares.
TOLERANCES = {"shaded": 2.0, "deep": 2.0, "smooth lines": 16.0, "smooth polygon": 8.0, "measure": 8.0,
              "cloud": 1e-7}  # fmt: skip


def _blocks(sizes: Integers) -> Iterator[slice]:
    """Give slices of items whose sizes add up to about a block."""
    parts = np.searchsorted(np.cumsum(sizes), np.arange(0, int(sizes.sum()) + BLOCK, BLOCK), side="left")
    bounds = np.unique(np.concatenate([[0], parts, [len(sizes)]]))
    for start, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        yield slice(start, end)


def _count_up(counts: Integers) -> tuple[Integers, Integers]:
    """Return for items that are repeated so many times the number of the item, and of the repetition."""
    item = np.repeat(np.arange(len(counts)), counts)
    return item, np.arange(len(item)) - np.repeat(np.cumsum(counts) - counts, counts)


def _crossings(starts: Integers, ends: Integers) -> tuple[Integers, Integers, Integers]:
    """Return where edges (E, 2) in sub-pixels cross rows of centres: edge, row, and the first column not left of the edge."""
    down = (starts[:, 1] < ends[:, 1])[:, None]
    upper, lower = np.where(down, starts, ends), np.where(down, ends, starts)
    first, after = -(-(upper[:, 1] - HALF) // GRID), -(-(lower[:, 1] - HALF) // GRID)
    edge, step = _count_up(after - first)
    row = first[edge] + step
    (x, y), height = upper[edge].T, (lower - upper)[edge, 1]
    run = (GRID * row + HALF - y) * (lower - upper)[edge, 0]
    return edge, row, -(-((x - HALF) * height + run) // (GRID * height))


def _sub_pixels(points: NDArray[Any]) -> Integers:
    return np.rint(np.asarray(points, np.float64) * GRID).astype(np.int64)


def _covered(vertices: NDArray[Any], size: tuple[int, int]) -> Iterator[tuple[Integers, Integers]]:
    """Give, some triangles at a time, the pixels that they hold and the triangles that hold them, in order."""
    (width, height), corners = size, _sub_pixels(vertices)
    box = np.ptp(corners, axis=1) // GRID + 1
    for part in _blocks(box.prod(axis=1)):
        chosen = corners[part]
        edge, row, column = _crossings(chosen.reshape(-1, 2), np.roll(chosen, -1, axis=1).reshape(-1, 2))

        # Bring the two crossings of a triangle with a row together; they are a span.
        order = np.argsort((edge // 3) * height + row, kind="stable")
        triangle, row, column = (edge[order] // 3)[::2], row[order][::2], np.clip(column[order], 0, width).reshape(-1, 2)
        left = column.min(axis=1)
        span, step = _count_up(column.max(axis=1) - left)
        yield (row * width + left)[span] + step, triangle[span] + part.start


def owners(vertices: NDArray[Any], size: tuple[int, int]) -> Integers:
    """Return the last triangle that holds each pixel, or -1."""
    owner = np.full(size[0] * size[1], -1, dtype=np.int64)
    for pixel, triangle in _covered(vertices, size):
        owner[pixel] = triangle
    return owner.reshape(size[::-1])


def nearest(vertices: NDArray[Any], depths: NDArray[Any], size: tuple[int, int]) -> Integers:
    """Return the triangle that is nearest at each pixel, or -1; of those equally near in float32, the first."""
    best, whole = np.full(size[0] * size[1], -1, dtype=np.int64), np.int64(1) << 32
    for pixel, triangle in _covered(vertices, size):
        centre = np.stack([pixel % size[0], pixel // size[0]], axis=1) + 0.5
        weights = _shares(vertices[triangle].astype(np.float64), centre)
        nearness = (1 - (weights * depths[triangle]).sum(axis=1)).astype(np.float32)
        np.maximum.at(best, pixel, nearness.view(np.int32) * whole + (whole - 1 - triangle))
    owner = np.where(best >= 0, whole - 1 - best % whole, -1)
    return owner.reshape(size[::-1])


def _shares(corners: NDArray[np.float64], centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shares of three corners at a point: the areas of the triangles on the other side of it."""
    sides = corners - centre[:, None]
    after, last = np.roll(sides, -1, axis=1), np.roll(sides, -2, axis=1)
    weights = after[..., 0] * last[..., 1] - after[..., 1] * last[..., 0]
    shares: NDArray[np.float64] = weights / weights.sum(axis=1, keepdims=True)
    return shares


def ring_edges(points: NDArray[Any], starts: Integers) -> tuple[Integers, Integers]:
    """Return the ends of the edges of rings, in sub-pixels."""
    begin = _sub_pixels(points)
    following = np.arange(1, len(begin) + 1)
    following[starts[1:] - 1] = starts[:-1]
    return begin, begin[following]


def _is_inside(winding: NDArray[Any], fill_rule: str) -> NDArray[np.bool_]:
    held: NDArray[np.bool_] = winding % 2 != 0 if fill_rule == "even-odd" else winding != 0
    return held


def inside(begin: Integers, end: Integers, size: tuple[int, int], fill_rule: str) -> NDArray[np.bool_]:
    """Return which pixels a polygon holds."""
    width, height = size
    edge, row, column = _crossings(begin, end)
    change = np.sign(end[:, 1] - begin[:, 1])[edge]
    places = row * (width + 1) + np.clip(column, 0, width)
    changes = np.bincount(places, change, (width + 1) * height).reshape(height, width + 1)
    return _is_inside(np.cumsum(changes, axis=1, dtype=np.float32)[:, :width].astype(np.int32), fill_rule)


def areas(begin: Integers, end: Integers, size: tuple[int, int], fill_rule: str | None) -> NDArray[np.float32]:
    """Return the share of each pixel that a polygon holds, or the sum over rings for no rule; NaN where it is not known."""
    width, height = size
    shares = np.full((height, width), np.nan, dtype=np.float32)
    for row in range(0, height, EVERY):
        y = (row + (np.arange(SUBROWS) + 0.5) / SUBROWS)[:, None] * GRID
        near = np.flatnonzero(
            (np.minimum(begin[:, 1], end[:, 1]) < (row + 1) * GRID) & (np.maximum(begin[:, 1], end[:, 1]) > row * GRID)
        )
        (x0, y0), (x1, y1) = begin[near].T, end[near].T
        line, number = np.nonzero((np.minimum(y0, y1) <= y) & (y < np.maximum(y0, y1)))
        x = (x0[number] + (y[line, 0] - y0[number]) * (x1 - x0)[number] / (y1 - y0)[number]) / GRID
        change = np.sign(y1 - y0)[number]

        # Windings of one line add up to none, so one sum serves all lines.
        if fill_rule is not None:
            order = np.lexsort((x, line))
            x, held = x[order], _is_inside(np.cumsum(change[order]), fill_rule).astype(np.int64)
            change = np.diff(held, prepend=0)
        column = np.floor(x).astype(np.int64)
        places = np.clip(np.concatenate([column, column + 1]), 0, width)
        rest = x - column
        changes = np.bincount(places, np.concatenate([change * (1 - rest), change * rest]), width + 1)
        shares[row] = np.abs(np.cumsum(changes)[:width]) / SUBROWS
    return shares


def _line_pixels(scene: LineScene, up: bool) -> tuple[NDArray[np.uint8], Integers]:
    """Return the picture of segments from pixel to pixel, and how many lie on each; `up` steps where two are equally near."""
    width, height = scene.size
    ends = np.floor(scene.segments).astype(np.int64)
    across = ends[:, 1] - ends[:, 0]
    steps, counts = np.abs(across).max(axis=1), np.zeros(width * height, dtype=np.int64)
    colors, picture = scene.colors[:, :3], np.zeros((width * height, 3), dtype=np.uint8)
    for part in _blocks(steps + 1):
        length = np.maximum(steps[part], 1)
        line, step = _count_up(steps[part] + 1)
        twice = 2 * step[:, None] * np.abs(across[part])[line]
        unit = length[line, None]
        moved = (twice + unit) // (2 * unit) if up else -(-(twice - unit) // (2 * unit))
        x, y = (ends[part, 0][line] + np.sign(across[part])[line] * moved).T
        pixel = y * width + x
        picture[pixel] = colors[part][line]
        counts += np.bincount(pixel, minlength=len(counts))
    return picture.reshape(height, width, 3), counts.reshape(height, width)


def _smooth_lines(scene: LineScene) -> NDArray[np.uint8]:
    """Return lines one pixel wide with square ends, blended by the share of a pixel that they cover, of 16 x 16 samples."""
    picture, fine = np.zeros((scene.size[1], scene.size[0], 3)), 16
    for (start, end), color in zip(scene.segments.astype(np.float64), scene.colors[:, :3], strict=True):
        low, high = np.floor(np.minimum(start, end)).astype(int) - 2, np.ceil(np.maximum(start, end)).astype(int) + 2
        x, y = (np.arange(low[k] * fine, high[k] * fine) / fine + 0.5 / fine for k in (0, 1))
        along = (end - start) / np.linalg.norm(end - start)
        right, below = x[None] - start[0], y[:, None] - start[1]
        far = right * along[0] + below * along[1]
        covered = (np.abs(right * along[1] - below * along[0]) <= 0.5) & (far >= 0) & (far <= np.linalg.norm(end - start))
        share = covered.reshape(len(y) // fine, fine, len(x) // fine, fine).mean(axis=(1, 3))[..., None]
        patch = picture[low[1] : high[1], low[0] : high[0]]
        patch[:] = patch * (1 - share) + color * share
    return np.rint(picture).astype(np.uint8)


def flooded(image: NDArray[np.uint8], seed: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the pixels that are joined to a seed by sides and have its value, by filling whole runs of rows and columns."""
    alike = image == image[seed[1], seed[0]]
    filled, before = np.zeros(image.shape, dtype=bool), 0
    filled[seed[1], seed[0]] = True
    runs = [np.cumsum(~side.ravel() | (np.arange(side.size) % side.shape[1] == 0)) for side in (alike, alike.T)]
    while (found := int(filled.sum())) > before:
        before = found
        for run in runs:
            reached = np.bincount(run, filled.ravel(), run[-1] + 1) > 0
            filled = (reached[run].reshape(filled.shape) & (alike if run is runs[0] else alike.T)).T
    return filled


def _painted(scene: FlatScene, owner: Integers) -> NDArray[np.uint8]:
    """Return the colours of triangles at the centres of the pixels that they own."""
    picture = np.zeros((*owner.shape, 3), dtype=np.uint8)
    row, column = np.nonzero(owner >= 0)
    number = owner[row, column]
    if scene.colors.ndim == 2:
        picture[row, column] = scene.colors[number, :3]
        return picture

    weights = _shares(scene.vertices.astype(np.float64)[number], np.stack([column, row], axis=1) + 0.5)
    colors = (weights[..., None] * scene.colors[number, :, :3]).sum(axis=1)
    picture[row, column] = np.rint(colors).astype(np.uint8)
    return picture


def _polygon_answer(scene: PolygonScene) -> Answer:
    edges = ring_edges(scene.ring, np.array([0, scene.count]))
    if scene.kind == "polygon":
        held = inside(*edges, scene.size, scene.fill_rule)
        return {"mask": [held], "colors": [np.repeat(held[..., None] * np.uint8(255), 3, axis=2)]}
    shares = areas(*edges, scene.size, scene.fill_rule)
    return {"areas": [shares], "colors": [np.repeat(255 * shares[..., None], 3, axis=2)]}


def _burnt(scene: RingsScene) -> Integers:
    """Return the last of many polygons that holds each pixel, counted from 1; 0 where there is none."""
    burnt = np.zeros(scene.size[::-1], dtype=np.int64)
    for number, ring in enumerate(scene.rings, 1):
        low, high = np.floor(ring.min(axis=0)).astype(int), np.ceil(ring.max(axis=0)).astype(int)
        edges = ring_edges(ring - low, np.array([0, len(ring)]))
        patch = burnt[low[1] : high[1], low[0] : high[0]]
        patch[inside(*edges, (int(high[0] - low[0]), int(high[1] - low[1])), "even-odd")] = number
    return burnt


def answer(scene: Any) -> Answer:
    """Return what is right for a scene, for every form that an output may have; nothing for meshes."""
    if isinstance(scene, FlatScene):
        deep = scene.depths
        owner = owners(scene.vertices, scene.size) if deep is None else nearest(scene.vertices, deep, scene.size)
        return {"colors": [_painted(scene, owner)]}
    if isinstance(scene, LineScene):
        if scene.kind == "smooth lines":
            return {"colors": [_smooth_lines(scene)]}
        pictures, counts = zip(*(_line_pixels(scene, up) for up in (False, True)), strict=True)
        return {"colors": list(pictures), "counts": list(counts), "mask": [found > 0 for found in counts]}
    if isinstance(scene, PolygonScene):
        return _polygon_answer(scene)
    if isinstance(scene, PointScene):
        width, height = scene.size
        number = scene.y.astype(np.int64) * width + scene.x.astype(np.int64)
        return {"counts": [np.bincount(number, minlength=width * height).reshape(height, width)]}
    if isinstance(scene, CloudScene):
        return {"depths": [nearest_depths(scene)]}
    if isinstance(scene, FloodScene):
        return {"mask": [flooded(scene.image, scene.seed)]}
    if isinstance(scene, RingsScene) and scene.kind == "burn":
        return {"ids": [_burnt(scene)]}
    if isinstance(scene, RingsScene) and scene.kind == "measure":
        return {"areas": [areas(*ring_edges(scene.points, scene.starts), scene.size, None)]}
    return {"triangles": [np.array(scene.area)]} if isinstance(scene, RingsScene) else {}


def judge(scene: Any, gives: str, result: NDArray[Any], right: Answer) -> tuple[int, int | None]:
    """Return how many pixels of an output are covered, and how many are wrong; None where that is not known.

    Of triangles, it is how many there are, and by how many pixels their area misses that of the polygon.
    """
    if gives == "triangles":
        a, b, c = np.asarray(result, np.float64).swapaxes(0, 1)
        sides = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        return len(result), round(abs(float(np.abs(sides).sum() / 2 - right[gives][0])))
    covered = int(result.any(axis=-1).sum() if gives == "colors" else (result > 0).sum())
    if gives not in right:
        return covered, None

    # A pixel is right if it is that of any of the right pictures; one that has not been worked out is left alone.
    allowed, wrong = TOLERANCES.get(scene.kind, 0.0) / (255 if gives == "areas" else 1), 0
    for row in range(0, len(result), BAND):
        band = np.ones(result[row : row + BAND].shape[:2], dtype=bool)
        for expected in right[gives]:
            off = np.abs(result[row : row + BAND] - expected[row : row + BAND].astype(np.float64)) > allowed
            band &= off.any(axis=-1) if gives == "colors" else off
        wrong += int(band.sum())
    return covered, wrong
