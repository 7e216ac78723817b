"""What the tests of maps share: oracles in rationals, outlines of countries, and planar subdivisions with holes and islands."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import tarfile
from fractions import Fraction
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Ring = list[tuple[int, int]]
Booleans = NDArray[np.bool_]

FILLED = {
    "even-odd": lambda crossings, winding: crossings % 2 == 1,
    "non-zero": lambda crossings, winding: winding != 0,
    "positive": lambda crossings, winding: winding > 0,
    "negative": lambda crossings, winding: winding < 0,
    "abs-geq-two": lambda crossings, winding: abs(winding) >= 2,
}
ATLAS = "world-atlas@2.0.2"


def slabs(rings: list[Ring], size: tuple[int, int], bits: int) -> tuple[list[Any], list[Fraction]]:
    """Return edges in pixels from their upper ends, with their turn, and all heights at which their order may change."""
    edges = []
    for ring in rings:
        for p, q in pairwise([*ring, *ring[:1]]):
            if p[1] != q[1]:
                upper, lower = sorted((p, q), key=lambda point: point[1])
                edges.append((*(Fraction(v, 1 << bits) for v in (*upper, *lower)), 1 if p is upper else -1))
    heights = {Fraction(j) for j in range(size[1] + 1)} | {y for e in edges for y in (e[1], e[3])}
    for x0, y0, x1, y1, _ in edges:
        if x0 != x1:
            heights |= {y0 + (i - x0) * (y1 - y0) / (x1 - x0) for i in range(size[0] + 1)}
    for e, f in combinations(edges, 2):
        lean, other = (e[2] - e[0]) / (e[3] - e[1]), (f[2] - f[0]) / (f[3] - f[1])
        if lean != other:
            heights.add((f[0] - other * f[1] - e[0] + lean * e[1]) / (lean - other))
    return edges, sorted(y for y in heights if 0 <= y <= size[1])


def touched(rings: list[Ring], size: tuple[int, int], fill_rule: str, bits: int) -> Booleans:
    """Return the open pixels that meet the open inside, in rationals: between two heights nothing changes its order.

    Parameters
    ----------
    rings : points in sub-pixels.
    """
    out = np.zeros(size[::-1], bool)
    edges, heights = slabs(rings, size, bits)
    for upper, lower in pairwise(heights):
        y, crossings, winding = (upper + lower) / 2, 0, 0
        met = sorted((x0 + (x1 - x0) * (y - y0) / (y1 - y0), turn) for x0, y0, x1, y1, turn in edges if y0 < y < y1)
        for (x, turn), (after, _) in pairwise(met):
            crossings, winding = crossings + 1, winding + turn
            start, end = max(x, Fraction(0)), min(after, Fraction(size[0]))
            if start < end and FILLED[fill_rule](crossings, winding):
                out[int(upper), int(start) : -int(-end // 1)] = True
    return out


def decode(topology: dict[str, Any], name: str) -> tuple[list[list[list[Any]]], list[str]]:
    """Return the polygons of an object of a TopoJSON topology, each all its rings, and their names.

    Arcs are shared by neighbours and decoded once, so their points are the same to the bit.
    """
    scale, shift = (np.array(topology["transform"][key]) for key in ("scale", "translate"))
    arcs = [np.cumsum(np.array(arc), axis=0) * scale + shift for arc in topology["arcs"]]

    def ring(numbers: list[int]) -> Any:
        """Join arcs; the complement of a number is the arc backwards."""
        parts = [arcs[number] if number >= 0 else arcs[~number][::-1] for number in numbers]
        return np.concatenate([part[:-1] for part in parts])

    polygons, names = [], []
    for geometry in topology["objects"][name]["geometries"]:
        parts = geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]
        polygons.append([ring(numbers) for part in parts for numbers in part])
        names.append(geometry["properties"]["name"])
    return polygons, names


def unroll(ring: NDArray[Any]) -> list[NDArray[Any]]:
    """Return a ring on the globe as rings on the map: one that crosses the date line is there on both sides of it.

    A ring round a pole is closed along the map's border. No point is moved but by whole turns.
    """
    steps = np.rint(np.diff(ring[:, 0], append=ring[:1, 0]) / 360)
    if not steps.any():
        return [ring]
    turns = -np.concatenate([[0], np.cumsum(steps)])
    turns -= np.median(turns)
    points, border = np.concatenate([ring, ring[:1]]), np.copysign(90.0, ring[:, 1].mean())
    if turns[0] != turns[-1]:
        points = np.concatenate([points, [(points[-1, 0], border), (points[0, 0], border)]])
        turns = np.concatenate([turns, turns[[-1, 0]]])
    return [np.c_[points[:, 0] + 360 * (turns + shift), points[:, 1]] for shift in (-1, 0, 1)]


def fetch_atlas(folder: Path, seconds: float = 30.0) -> dict[str, Any] | str:
    """Return the countries of npm's world-atlas, coarse, or a line that says why they cannot be had."""
    npm = shutil.which("npm")
    if npm is None:
        return "npm is not installed"
    command = [npm, "pack", ATLAS, "--silent", "--fetch-retries=0", f"--fetch-timeout={int(seconds * 1000)}"]
    try:
        ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return f"the registry did not answer within {seconds:g} s"
    packed = sorted(folder.glob("world-atlas-*.tgz"))
    if ended.returncode or not packed:
        return f"npm could not fetch {ATLAS}: {(ended.stderr or ended.stdout).strip()[-200:]}"
    with tarfile.open(packed[0]) as archive:
        member = archive.extractfile("package/countries-110m.json")
        if member is None:
            return f"{ATLAS} has no countries-110m.json"
        found: dict[str, Any] = json.load(io.TextIOWrapper(member, "utf-8"))
    return found


def join_triangles(triangles: NDArray[Any], owner: NDArray[Any]) -> list[list[list[int]]]:
    """Return the outline of each owner's triangles as rings of vertices: what is inside it is a border of nobody."""
    outlines = []
    for number in range(int(owner.max()) + 1):
        follows: dict[int, list[int]] = {}
        corners = triangles[owner == number]
        sides = {(int(t[k]), int(t[(k + 1) % 3])) for t in corners for k in range(3)}
        for a, b in sides:
            if (b, a) not in sides:
                follows.setdefault(a, []).append(b)
        rings = []
        while follows:
            ring = [next(iter(follows))]
            while ring[-1] in follows:
                ways = follows[ring[-1]]
                ring.append(ways.pop())
                if not ways:
                    del follows[ring[-2]]
            rings.append(ring[:-1])
        outlines.append(rings)
    return outlines


def subdivision(rng: np.random.Generator, points: int, regions: int, size: tuple[int, int]) -> list[list[Any]]:
    """Return a random planar subdivision that fills a rectangle: regions of triangles, with holes and islands."""
    inner = rng.uniform(0, 1, (points, 2)) * size
    corners = np.array([(0, 0), (1, 0), (0, 1), (1, 1)]) * np.array(size)
    vertices = np.concatenate([inner, corners])
    triangles = Delaunay(vertices).simplices
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    turned = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) < (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles[turned] = triangles[turned][:, ::-1]

    # Near ones together, and one in ten to anybody: islands, and holes in others.
    middle = (a + b + c) / 3
    seeds = rng.uniform(0, 1, (regions, 2)) * size
    owner = np.argmin(((middle[:, None] - seeds[None]) ** 2).sum(axis=2), axis=1)
    stray = rng.uniform(size=len(owner)) < 0.1
    owner[stray] = rng.integers(0, regions, int(stray.sum()))
    return [[vertices[ring] for ring in rings] for rings in join_triangles(triangles, owner)]
