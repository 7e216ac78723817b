"""What the tests of the canvas share: pictures to look at, and plain oracles for fills and for blending.

A fill is a winding number for every sample, in Python's whole numbers; blending is Porter and Duff's "over" in float64. Nothing
is shared with what they check.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

import scanspan as ss

Pixels = NDArray[np.uint8]
Booleans = NDArray[np.bool_]

PAINTERS = ["half-space", "homogeneous", "edge-walk", "warnock", "micropolygon"]
FILL_RULES = ["even-odd", "non-zero", "positive", "negative", "abs-geq-two"]
FILLS = ["scanline", "parity"]
BLENDS = ["linear", "srgb"]
HALF_WHITE = (1.0, 1.0, 1.0, 0.5)
ONCE = {"linear": 188, "srgb": 128}  # the gray of half white that was laid over black once


def gray(canvas: ss.Canvas) -> Pixels:
    """Return the red of a canvas."""
    red: Pixels = canvas.pixels[..., 0]
    return red


def filled(rings: Any, size: tuple[int, int], **options: Any) -> Booleans:
    """Return the pixels of a polygon."""
    canvas = ss.Canvas(*size, "black")
    canvas.polygon(rings, "white", **options)
    assert set(np.unique(gray(canvas))) <= {0, 255}
    held: Booleans = gray(canvas) == 255
    return held


def windings(rings: list[Any], size: tuple[int, int], bits: int = 8) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return for each pixel's centre how many edges lie left of it or on it, and the winding number: the oracle.

    In Python's whole numbers. An edge belongs to the rows from its upper end, included, to its lower one.
    """
    half = 1 << (bits - 1)
    x = np.array([(i << bits) + half for i in range(size[0])], object)[None, :]
    y = np.array([(j << bits) + half for j in range(size[1])], object)[:, None]
    crossings, winding = np.zeros(size[::-1], int), np.zeros(size[::-1], int)
    for ring in rings:
        points = [(int(u), int(v)) for u, v in np.rint(np.asarray(ring, float) * 2.0**bits)]
        for (x0, y0), (x1, y1) in pairwise([*points, *points[:1]]):
            turn = 1 if y1 > y0 else -1
            (u_x, u_y), (l_x, l_y) = ((x0, y0), (x1, y1)) if turn > 0 else ((x1, y1), (x0, y0))
            met = ((u_y <= y) & (y < l_y) & ((x - u_x) * (l_y - u_y) >= (y - u_y) * (l_x - u_x))).astype(bool)
            crossings += met
            winding += turn * met
    return crossings, winding


def inside(rings: list[Any], size: tuple[int, int], fill_rule: str, bits: int = 8) -> Booleans:
    """Return the pixels that a fill rule holds. An edge that goes down, left of a place, winds round it counter-clockwise."""
    crossings, winding = windings(rings, size, bits)
    rules = {
        "even-odd": crossings % 2 == 1,
        "non-zero": winding != 0,
        "positive": winding > 0,
        "negative": winding < 0,
        "abs-geq-two": abs(winding) >= 2,
    }
    held: Booleans = rules[fill_rule]
    return held


def light(code: NDArray[Any]) -> NDArray[Any]:
    """Return linear light from sRGB, 0..1."""
    value: NDArray[Any] = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return value


def code_of(value: NDArray[Any]) -> NDArray[Any]:
    """Return sRGB from linear light, 0..1."""
    code: NDArray[Any] = np.where(value <= 0.0031308, value * 12.92, 1.055 * value ** (1 / 2.4) - 0.055)
    return code


def laid_over(color: Any, pixels: Pixels, blend: str) -> NDArray[Any]:
    """Return a colour over pixels, straight alpha, 0..255 and not rounded: the oracle."""
    over, under = np.asarray(color) / 255.0, pixels / 255.0
    alpha, behind = over[3], under[..., 3:] * (1 - over[3])
    total = alpha + behind
    first, second = (light(over[:3]), light(under[..., :3])) if blend == "linear" else (over[:3], under[..., :3])
    mixed = (first * alpha + second * behind) / np.where(total > 0, total, 1)
    mixed = np.where(total > 0, code_of(mixed) if blend == "linear" else mixed, under[..., :3])
    return np.concatenate([mixed, total], axis=-1) * 255.0


def random_triangles(rng: np.random.Generator, count: int, size: tuple[int, int]) -> NDArray[Any]:
    """Return triangles in and about an image, some on a lattice with samples on their edges, some without an area."""
    triangles = rng.uniform(-0.3, 1.3, (count, 3, 2)) * size
    triangles[::3] = np.rint(triangles[::3]) + 0.5
    triangles[::7, 2] = triangles[::7, 1]
    return triangles
