"""Masks: which pixels polygons cover, and how much of each. For maps, masks and plots."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scanspan.assets.lens import check_size
from scanspan.assets.rings import FILL_RULES, as_rings
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.geometry.fixed_point import snap_points
from scanspan.raster.algorithms import run_kernel
from scanspan.raster.aperture import APERTURES, weigh
from scanspan.raster.edge_walk import edge_walk_hits
from scanspan.raster.options import check_subpixel_bits, make_sampling
from scanspan.raster.trapezoids import flat_trapezoids
from scanspan.samples import sample_offsets
from scanspan.target.image import MAX_PIXELS

MODES = ("center", "area")


def coverage(
    rings: Any, size: tuple[int, int], *, mode: str = "center", fill_rule: str = "even-odd", subpixel_bits: int = 8,
    aperture: str = "box",
) -> NDArray[Any]:  # fmt: skip
    """Return which pixels a polygon covers, or how much of each.

    Parameters
    ----------
    rings : one ring, (M, 2) points in pixels, y down, or a list of rings; the closing point may be repeated.
    size : (width, height) of the image in pixels.
    mode : "center", whether the pixel's centre is inside, or "area", the share of the pixel that is, right to 2^-40. Polygons
        whose edges match end to end add up to exactly 1; so values are not held to 0..1, and may miss it by 2^-40.
    fill_rule : "even-odd", "non-zero", "positive", "negative" or "abs-geq-two"; counter-clockwise as seen is positive.
    subpixel_bits : points are snapped to 1/2^s pixel; for "area" to 1/65536.
    aperture : what "area" takes for a pixel. "box", its square. "tent", twice as wide and falling off linearly; as exact, and
        polygons that tile add up to exactly 1. "gaussian", with a standard deviation of half a pixel, cut off at three of them;
        the error is below 2^-11 at a border along an axis, and below 2^-6 whatever the shape.

    Returns
    -------
    (H, W) bool, or float64 for "area".

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> coverage([(0, 0), (2, 0), (2, 0.5), (0, 0.5)], (2, 1), mode="area")
    array([[0.5, 0.5]])
    """
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    if fill_rule not in FILL_RULES:
        raise unknown_name("fill rule", fill_rule, FILL_RULES)
    if not isinstance(aperture, str) or aperture not in APERTURES:
        raise unknown_name("aperture", aperture, APERTURES)
    if aperture != "box" and mode != "area":
        raise InputError(f"aperture = {aperture!r}: a pixel's centre has none; it goes with mode = 'area'")
    (width, height), rule = check_size(size), FILL_RULES.index(fill_rule)
    if width * height > MAX_PIXELS:
        raise LimitError(f"size = ({width}, {height}): the limit is {MAX_PIXELS} pixels in all")
    bits = check_subpixel_bits(subpixel_bits)
    points, starts = as_rings(rings)
    if mode == "area":
        return weigh(points, starts, rule, (width, height), aperture)
    sampling = make_sampling((width, height), sample_offsets(1, bits)[0], rule="top-left", cull="none", subpixel_bits=bits)
    hits = np.zeros((height, width), np.int32)
    run_kernel(edge_walk_hits, hits, flat_trapezoids(snap_points(points, bits), starts, rule, 0.0, sampling), sampling, 1)
    return hits > 0
