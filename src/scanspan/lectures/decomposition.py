"""Polygons as triangles: which can be cut, and when a corner has to be made; S0, lines 66-69, S4, line 99, S2, lines 236-260.

S0 and S4 say that a polygon can "usually" be cut into triangles, S2 that all can. Both leave something out. Every simple
polygon can be cut along diagonals, since it has two ears (Meisters 1975), and into two triangles fewer than it has corners. A
polygon that crosses itself can be cut too, but only at corners that it does not have: the crossings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanspan.records import Float64Array
from scanspan.tessellation import triangulate
from scanspan.triangulation import triangulate_polygon


class Decomposition(NamedTuple):
    """What it takes to cut polygons into triangles."""

    simple: int  # random simple polygons, concave as a rule
    cut_along_diagonals: int  # of these, with two triangles fewer than corners and their area
    made_by_bow_tie: int  # corners that a bow tie lacks
    made_by_pentagram: int  # corners that a pentagram lacks


def demonstrate_decomposition(count: int = 200) -> Decomposition:
    """Cut random stars of 4 to 23 corners by their ears, and a bow tie and a pentagram by a sweep.

    >>> demonstrate_decomposition(50)
    Decomposition(simple=50, cut_along_diagonals=50, made_by_bow_tie=1, made_by_pentagram=5)
    """
    rng = np.random.default_rng(6)
    cut = 0
    for k in range(count):
        points = random_star(rng, 4 + k % 20)
        triangles = points[triangulate_polygon(points)]
        fits = np.isclose(np.abs(twice_areas(triangles)).sum(), twice_areas(points[None])[0], rtol=1e-9)
        cut += int(len(triangles) == len(points) - 2 and bool(fits))
    turns = np.arange(5) * 4 * np.pi / 5
    pentagram = 50 + 40 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    bow_tie = np.array([(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)])
    made = [len(triangulate(ring, "non-zero").positions) - len(ring) for ring in (bow_tie, pentagram)]
    return Decomposition(count, cut, *made)


def random_star(rng: np.random.Generator, corners: int) -> Float64Array:
    """Return a simple polygon around the origin, (M, 2): corners at any distance, in order of their angles."""
    angles = (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) * (2 * np.pi / corners)
    star: Float64Array = rng.uniform(1, 10, (corners, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return star


def twice_areas(polygons: Float64Array) -> Float64Array:
    """Return twice the signed areas of polygons (N, M, 2)."""
    x, y = polygons[..., 0], polygons[..., 1]
    areas: Float64Array = (x * np.roll(y, -1, axis=-1) - np.roll(x, -1, axis=-1) * y).sum(axis=-1)
    return areas
