"""Scenes that have broken rasterizers before, every way to draw one, and a choice of combinations that tries all pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

import scanspan as ss
from scanspan.raster import algorithms
from scanspan.samples import POSITIONS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Way = dict[str, str]

SIZE = (40, 30)
WHOLE_PIXELS = ("half-space", "homogeneous", "warnock")

# Every algorithm in every order that it knows; the first is what the others are compared with.
WAYS: list[Way] = [{"algorithm": name, "order": order} for name in ss.ALGORITHMS for order in algorithms.KERNELS[name]]
OTHERS = WAYS[1:]
PIXEL_WAYS = [way for way in WAYS if way["algorithm"] in WHOLE_PIXELS]
RULES: list[Any] = [
    "top-left", "bottom-left", "inclusive", "exclusive", ss.OffscreenPoint(-3.25, 7.5), ss.OffscreenPoint(1, 0, 0),
]  # fmt: skip
OPTIONS: dict[str, Sequence[Any]] = {
    "rule": RULES,
    "samples": (1, 2, 4, 8, 16),
    "subpixel_bits": (4, 8, 12, 16),
    "depth_bits": (32, 64),
    "cull": ("none", "back", "front"),
    "threads": (1, 3),
}

# Homogeneous rasterization may differ this far from an edge of a triangle that is cut, in pixels; so much on a coarse grid.
BAND = 1 / 128


def flat(points: Floats, rng: np.random.Generator) -> Floats:
    """Return points of the image with w = 1 and depths at random."""
    return np.c_[points, rng.uniform(-1, 1, len(points)), np.ones(len(points))]


def in_room(rng: np.random.Generator) -> tuple[Floats, Integers]:
    """Return a box seen from inside, with a few walls across it."""
    corners = np.array([(x, y, z) for x in (-2.0, 3) for y in (-1.5, 1) for z in (-4.0, 2)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    walls = rng.uniform((-2, -1.5, -4), (3, 1, 2), (24, 3))
    x, y, z = np.concatenate([corners, walls]).T
    clip = np.stack([x + 0.2 * y, y - 0.1 * x, -z - 0.1, -z], axis=1)
    return clip, np.array([*box, *(8 + np.arange(24)).reshape(-1, 3).tolist()])


def scene_zoo(rng: np.random.Generator) -> dict[str, tuple[Floats, Integers]]:
    """Return (clip coordinates, triangles) by name."""
    soup = rng.normal(size=(360, 4))
    whole = np.c_[rng.uniform(-1.2, 1.2, (360, 2)), rng.uniform(-1, 1, 360), np.ones(360)]
    tiny = np.repeat(rng.uniform(-1, 1, (400, 2)), 3, axis=0) + rng.uniform(-0.06, 0.06, (1200, 2))
    angle = np.sort(rng.uniform(0, 2 * np.pi, 24))
    rim = np.c_[np.cos(angle), np.sin(angle), rng.uniform(-0.5, 0.5, 24), np.ones(24)]
    fan = np.concatenate([[(1 / SIZE[0], 1 / SIZE[1], 0, 1)], rim])
    slivers = np.repeat(rng.uniform(-1, 1, (60, 2)), 3, axis=0) + rng.normal(size=(180, 2)) * (1e-3, 0.8)
    pixels = rng.integers((-1, -1), (21, 16), (300, 2)) * 2 + np.where(np.arange(300) % 6 < 3, 0.5, 0.0)[:, None]
    lattice = np.array((-1, 1)) + pixels * (2, -2) / SIZE
    far = rng.normal(size=(90, 2)) * 1e4
    cycle = [(-0.8, -0.6, 0.3), (0.8, -0.5, -0.3), (0.8, -0.3, -0.3), (0.7, -0.8, 0.3), (0.1, 0.8, -0.3), (-0.1, 0.8, -0.3),
             (0.1, 0.7, 0.3), (-0.9, -0.3, -0.3), (-0.8, -0.5, -0.3)]  # fmt: skip
    same = np.tile([(-0.9, -0.8, 0.1, 1), (0.8, -0.7, 0.4, 1), (0.1, 0.9, -0.3, 1)], (4, 1))
    deep = np.c_[rng.uniform(-1.2, 1.2, (180, 2)), rng.uniform(-0.99, 3, 180), np.ones(180)] * rng.uniform(0.1, 9, (180, 1))
    beyond = rng.normal(size=(60, 4)) * (1, 1, 0.3, 1)
    beyond[:, 3] = np.abs(beyond[:, 3]) * np.where(rng.random(60) < 0.4, 1e-9, 1.0) + 1e-12
    beyond[:, 2] = beyond[:, 3] * rng.uniform(-0.9, 1, 60)

    zoo = {
        "soup": soup, "whole": whole, "tiny": flat(tiny, rng), "slivers": flat(slivers, rng), "lattice": flat(lattice, rng),
        "far": flat(far, rng), "cycle": np.c_[cycle, np.ones(9)], "same": same, "nothing": np.empty((0, 4)), "deep": deep,
        "beyond": beyond,
    }  # fmt: skip
    scenes = {name: (clip, np.arange(len(clip)).reshape(-1, 3)) for name, clip in zoo.items()}
    scenes["fan"] = (fan, np.stack([np.zeros(24, int), 1 + np.arange(24), 1 + (np.arange(24) + 1) % 24], axis=1))
    scenes["room"] = in_room(rng)
    return scenes


SCENES = list(scene_zoo(np.random.default_rng(0)))


def random_scene(rng: np.random.Generator) -> tuple[Floats, Integers]:
    """Return a scene of a few dozen triangles: on the grid of samples or off it, in front of the eye or not, corners shared."""
    count = int(rng.integers(3, 90))
    spread = float(np.exp(rng.uniform(np.log(0.05), np.log(30))))
    clip = np.c_[rng.uniform(-1, 1, (count, 2)) + rng.normal(size=(count, 2)) * spread, rng.uniform(-1, 1.5, count),
                 np.ones(count)]  # fmt: skip
    if rng.random() < 0.4:
        clip[:, :2] = np.rint(clip[:, :2] * SIZE) / SIZE
    if rng.random() < 0.3:
        clip[:, 2] = np.rint(clip[:, 2] * 4) / 4
    if rng.random() < 0.5:
        clip *= rng.uniform(0.2, 5, (count, 1))
    if rng.random() < 0.4:
        clip[rng.random(count) < 0.3, 3] *= -1.0
    triangles = rng.integers(0, count, (int(rng.integers(1, 60)), 3))
    return clip, triangles


def covering_array(factors: Mapping[str, Sequence[Any]], seed: int = 1) -> list[dict[str, Any]]:
    """Return combinations such that every pair of choices of two factors occurs in one: greedily, with a seed.

    Each begins with the first pair that is still wanted, and takes of every other factor what adds most pairs that are.
    """
    random, names = np.random.default_rng(seed), list(factors)
    wanted = {
        ((p, i), (q, j))
        for p, q in combinations(range(len(names)), 2)
        for i in range(len(factors[names[p]]))
        for j in range(len(factors[names[q]]))
    }
    rows = []
    while wanted:
        chosen = dict(min(wanted))
        for p in random.permutation([p for p in range(len(names)) if p not in chosen]).tolist():
            gains = [sum(tuple(sorted(((p, i), other))) in wanted for other in chosen.items())
                     for i in range(len(factors[names[p]]))]  # fmt: skip
            chosen[p] = int(random.choice(np.flatnonzero(np.array(gains) == max(gains))))
        wanted -= set(combinations(sorted(chosen.items()), 2))
        rows.append({name: factors[name][chosen[p]] for p, name in enumerate(names)})
    return rows


def is_cut(clip: Floats, triangles: Integers, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Say of each triangle whether a corner lies behind the eye, in front of the near plane, or beyond 2^24 px."""
    x, y, z, w = clip.T
    with np.errstate(divide="ignore", invalid="ignore"):
        across, down = (x / w + 1) * size[0] / 2, (1 - y / w) * size[1] / 2
        kept = (w > 0) & (z >= -w) & (np.abs(across) <= 2.0**24) & (np.abs(down) <= 2.0**24)
    found: NDArray[np.bool_] = ~kept[triangles].all(axis=1)
    return found


def different(found: Any, expected: Any) -> int:
    """Return in how many samples two Visibilities differ."""
    return int(((found.primitive != expected.primitive) | (found.depth != expected.depth)).sum())


def screen_planes(clip: Floats, size: tuple[int, int]) -> Floats:
    """Return what is seen of a triangle as four half-planes a x + b y + c >= 0 of the screen, in pixels.

    They are its edges and the near plane, (4, 3), with (a, b) of length 1; float64 from exact numbers. A triangle whose plane
    goes through the eye is not seen: all four are then negative. The derivation is in reference.clipped_verdict.
    """
    x, y, z, w = ([Fraction(float(vertex[k])) for vertex in clip] for k in range(4))
    corners = [((x[k] + w[k]) * size[0] / 2, (w[k] - y[k]) * size[1] / 2, w[k]) for k in range(3)]
    lines = []
    for k in range(3):
        p, q = corners[(k + 1) % 3], corners[(k + 2) % 3]
        lines.append((p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]))
    volume = sum(part * other for part, other in zip(corners[0], lines[0], strict=True))
    if volume == 0:
        return np.tile([0.0, 0.0, -1e9], (4, 1))
    planes = [[value / volume for value in line] for line in lines]
    planes.append([sum((planes[k][c] * (z[k] + w[k]) for k in range(3)), Fraction(0)) for c in range(3)])
    lengths = [float(plane[0] ** 2 + plane[1] ** 2) ** 0.5 or 1.0 for plane in planes]
    units = [[float(value) / length for value in plane] for plane, length in zip(planes, lengths, strict=True)]
    return np.array(units)


def check_unclipped(
    clip: Floats, triangles: Integers, size: tuple[int, int], found: Any, expected: Any, samples: int, subpixel_bits: int
) -> tuple[int, list[str]]:
    """Compare drawing without clipping with drawing what is clipped, as the contract has it.

    A sample may show another triangle where one of the two is cut and the sample lies in the band about an edge of what is left
    of it. Where both show the same triangle its depth is the same, bit for bit.

    Returns
    -------
    The number of samples that show another triangle, and a line for every one that has no right to what it shows.
    """
    band = max(BAND, 2.0 / (1 << subpixel_bits))
    cut = np.r_[is_cut(clip, triangles, size), False]
    shape = (size[1], size[0], samples)
    (seen, other_seen), (depth, other_depth) = (
        [getattr(each, name).reshape(shape) for each in (expected, found)] for name in ("primitive", "depth")
    )
    planes: dict[int, Floats] = {}
    wrong, elsewhere = [], 0
    for y, x, s in np.argwhere((seen != other_seen) | (depth != other_depth)).tolist():
        numbers = (int(seen[y, x, s]), int(other_seen[y, x, s]))
        place = np.array([x + POSITIONS[samples][s][0] / 16, y + POSITIONS[samples][s][1] / 16, 1.0])
        is_near_edge = False
        for n in numbers if numbers[0] != numbers[1] else ():
            if n >= 0 and cut[n]:
                planes[n] = planes[n] if n in planes else screen_planes(clip[triangles[n]], size)
                is_near_edge |= bool(abs(float((planes[n] @ place).min())) <= band)
        elsewhere += numbers[0] != numbers[1]
        if not is_near_edge:
            wrong.append(f"pixel ({x}, {y}), sample {s}: {numbers[0]} at {depth[y, x, s]!r}, "
                         f"without clipping {numbers[1]} at {other_depth[y, x, s]!r}")  # fmt: skip
    return elsewhere, wrong
