"""Three ways to ask which pixels a shape is, and how the answer depends on the grid; S0, lines 16-25, and S2, lines 93-97.

S0 names three criteria: how near the shape is to the sample, how much of the pixel it covers, and whether the sample lies
inside. They give three pictures of one shape, of which only the second has its area to the last digit; the third comes nearer
to it the finer the grid is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.canvas import Canvas
from scanspan.masks import coverage

SHAPE = np.array([(1.0, 2.0), (14.0, 4.0), (6.0, 13.0)])  # in a square of 16 x 16
AREA = 66.5


class Criteria(NamedTuple):
    """What three criteria make of one triangle on 16 x 16 pixels."""

    near: int  # pixels of its outline, in lines as thin as they can be
    covered: float  # the sum of what it covers of each pixel
    inside: int  # pixels whose centres are in it
    area: float


def demonstrate_criteria() -> Criteria:
    """Draw a triangle as thin lines, by area and by centres.

    >>> demonstrate_criteria()
    Criteria(near=32, covered=66.5, inside=67, area=66.5)
    """
    canvas = Canvas(16, 16, background="black")
    canvas.polyline(SHAPE, "white", closed=True)
    near = int((canvas.pixels[..., 0] > 0).sum())
    return Criteria(near, round(covered_area(1, "area"), 9), int(covered_area(1, "center")), AREA)


class Scale(NamedTuple):
    """One triangle on finer and finer grids."""

    factors: tuple[int, ...]  # pixels to a side of what was one
    pixels: tuple[int, ...]  # whose centres are inside
    areas: tuple[float, ...]  # the same in units of the first grid
    area: float


def demonstrate_scale() -> Scale:
    """Draw a triangle at 1, 2, 4 to 64 times the size: the pixels, each as small as it then is, come to have its area.

    >>> demonstrate_scale().pixels[:3]
    (67, 267, 1066)
    """
    factors = tuple(2**k for k in range(7))
    pixels = tuple(int(covered_area(factor, "center")) for factor in factors)
    return Scale(factors, pixels, tuple(count / factor**2 for count, factor in zip(pixels, factors, strict=True)), AREA)


def covered_area(factor: int, mode: str) -> float:
    """Return how many pixels the triangle has, `factor` times its size."""
    return float(coverage([SHAPE * factor], (16 * factor, 16 * factor), mode=mode).sum())
