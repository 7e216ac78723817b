"""The world of a plot: a rectangle of it becomes the image, with y up; and what reaches too far is cut back.

Fixed point holds 2^24 pixels. Who looks closely at a small part of a plot has segments and triangles whose ends lie far beyond
that. They are cut back to a square around the image in float64, from the inner end towards the outer one; within the image they
are moved by far less than a sub-pixel, as long as their ends are within some 10^12 pixels. What lies within 2^24 pixels is
never touched, so neighbours keep their common edges to the bit.

Source: Liang and Barsky 1984 for segments; clip.py for triangles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.geometry.clip import to_screen
from scanspan.geometry.fixed_point import MAX_COORDINATE
from scanspan.records import BoolArray, Float64Array, Int64Array

REACH = float(MAX_COORDINATE >> 1)  # pixels; where segments that reach too far are cut off


class World(NamedTuple):
    """The rectangle that is seen, and the pixels in one of its units."""

    x_low: float
    y_low: float
    x_high: float
    y_high: float
    x_scale: float
    y_scale: float
    is_up: bool


def make_world(bounds: tuple[float, float, float, float], size: tuple[int, int], is_up: bool) -> World:
    """Return the World of a rectangle (x_low, y_low, x_high, y_high), checked, for an image of (width, height)."""
    x_low, y_low, x_high, y_high = bounds
    return World(x_low, y_low, x_high, y_high, size[0] / (x_high - x_low), size[1] / (y_high - y_low), is_up)


def to_pixels(world: World, points: Float64Array) -> Float64Array:
    """Return (..., 2) points of the world in pixels, y down; each rounded once or twice, and infinite where that overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        x = (points[..., 0] - world.x_low) * world.x_scale
        y = (world.y_high - points[..., 1] if world.is_up else points[..., 1] - world.y_low) * world.y_scale
    return np.stack([x, y], axis=-1)


def is_within_reach(pixels: Float64Array) -> BoolArray:
    """Say of (N, k, 2) corners whether fixed point can hold all of a row."""
    within: BoolArray = np.all(np.abs(pixels) <= MAX_COORDINATE, axis=(1, 2))
    return within


def cut_segments(ends: Float64Array) -> tuple[Float64Array, Int64Array]:
    """Return (M, 2, 2) segments within reach, and the number of each among the (N, 2, 2) given; the others are left out."""
    number = np.arange(len(ends))
    within = is_within_reach(ends)
    if within.all():
        return ends, number
    far = ends[~within]
    a, b = far[:, 0].copy(), far[:, 1].copy()
    meets = np.ones(len(far), bool)
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            # Cut those of which one end is beyond this side, from the other end on.
            a_beyond, b_beyond = sign * a[:, axis] > REACH, sign * b[:, axis] > REACH
            meets &= ~(a_beyond & b_beyond)
            inner, outer = np.where(a_beyond[:, None], b, a), np.where(a_beyond[:, None], a, b)
            with np.errstate(all="ignore"):  # of those that are not cut, whatever comes out is not used
                share = (sign * REACH - inner[:, axis]) / (outer[:, axis] - inner[:, axis])
                border = inner + share[:, None] * (outer - inner)
            border[:, axis] = sign * REACH
            a = np.where((a_beyond & ~b_beyond)[:, None], border, a)
            b = np.where((b_beyond & ~a_beyond)[:, None], border, b)

    # Put them back in their places.
    cut = ends.copy()
    cut[~within] = np.clip(np.stack([a, b], axis=1), -REACH, REACH)
    kept = within.copy()
    kept[~within] = meets
    return cut[kept], number[kept]


def cut_triangles(
    corners: Float64Array, values: Float64Array, size: tuple[int, int], subpixel_bits: int
) -> tuple[Float64Array, Float64Array]:
    """Return triangles within reach and the values of their corners; those out of reach are cut into pieces or left out.

    Parameters
    ----------
    corners : (N, 3, 2) in pixels.
    values : (N, 3).
    size : (width, height) of the image.
    subpixel_bits : s.
    """
    within = is_within_reach(corners)
    if within.all():
        return corners, values
    low, high = corners.min(axis=1), corners.max(axis=1)
    far = np.flatnonzero(~within & ((high >= 0.0) & (low <= np.array(size))).all(axis=1))

    # Snap the corners that are near before they go through other units, so that they stay on the grid.
    scale, half = float(1 << subpixel_bits), np.array(size) / 2
    points = corners[far].reshape(-1, 2)
    near = np.abs(points) <= MAX_COORDINATE
    points = np.where(near, np.rint(np.where(near, points, 0.0) * scale) / scale, points)
    clip = np.zeros((len(points), 4))
    clip[:, 0], clip[:, 1], clip[:, 3] = points[:, 0] / half[0] - 1.0, 1.0 - points[:, 1] / half[1], 1.0
    pieces = to_screen(clip, np.arange(len(points), dtype=np.int32).reshape(-1, 3), size, subpixel_bits)

    # Give their corners the values that the triangle has there.
    weights = np.concatenate([pieces.weights, np.eye(3)[None]])[pieces.piece]
    v = values[far][pieces.source]
    shared = v[:, :1] + (weights[:, :, 1] * (v[:, 1:2] - v[:, :1]) + weights[:, :, 2] * (v[:, 2:] - v[:, :1]))
    order = np.argsort(np.concatenate([np.flatnonzero(within), far[pieces.source]]), kind="stable")
    cut = np.concatenate([corners[within], pieces.xy[pieces.corners] / scale])
    return cut[order], np.concatenate([values[within], shared])[order]
