"""Experiments on shapes: curves as polygons, polygons as triangles, and how many triangles a pixel can have.

Source: S0, lines 46-70 and 531-570; S4, lines 66-99; S2, lines 236-260.
"""

from __future__ import annotations

import numpy as np

from scanspan.canvas import Canvas
from scanspan.lectures import half_planes
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    BLUE,
    INK,
    RED,
    SKY,
    WHITE,
    Axis,
    Panel,
    chart,
    enlarged,
    gridded,
    painted,
    panel,
    shaded,
    with_dots,
    with_outlines,
)
from scanspan.lectures.experiments.rules import star
from scanspan.lectures.splats import NODE_BITS, averages, build_tree, cut, decode, encode
from scanspan.masks import coverage
from scanspan.pipeline import count, rasterize
from scanspan.raster.edge_walk import edge_walk
from scanspan.records import Array, Float64Array
from scanspan.tessellation import triangulate

# A hippo from the side: points of a closed curve, y down, in a picture of 120 x 80.
HIPPO = np.array(
    [
        (8, 38), (7, 30), (13, 25), (20, 24), (25, 19), (27, 12), (30, 9), (32, 14), (37, 15), (41, 10), (44, 14), (43, 19),
        (52, 15), (66, 11), (82, 11), (97, 16), (107, 26), (110, 36), (115, 41), (116, 48), (112, 44), (108, 43), (107, 54),
        (108, 66), (106, 70), (96, 70), (94, 60), (88, 56), (78, 58), (66, 58), (60, 58), (60, 68), (58, 71), (48, 71),
        (47, 62), (44, 53), (38, 49), (28, 50), (16, 49), (10, 45),
    ],
    np.float64,
)  # fmt: skip


def smooth_curve(points: Float64Array, steps: int) -> Float64Array:
    """Return a closed curve through points (E. Catmull and R. Rom 1974), with so many points for each."""
    before, after, beyond = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0), np.roll(points, -2, axis=0)
    t = (np.arange(steps) / steps)[:, None, None]
    curve = (
        2 * points + (after - before) * t + (2 * before - 5 * points + 4 * after - beyond) * t**2
        + (3 * points - before - 3 * after + beyond) * t**3
    ) / 2  # fmt: skip
    return np.asarray(curve.transpose(1, 0, 2).reshape(-1, 2))


def circle(n: int, radius: float, middle: float) -> Float64Array:
    """Return a regular polygon whose corners lie on a circle."""
    angle = (np.arange(n) + 0.5) * 2 * np.pi / n
    return np.stack([middle + radius * np.cos(angle), middle + radius * np.sin(angle)], axis=1)


def approximation() -> Result:
    """Approximate a circle and a hippo by polygons with more and more sides."""
    radius, middle, rows, panels = 30.0, 32.5, list[Row](), list[Panel]()
    for n in (3, 4, 6, 8, 12, 16, 24, 32, 64, 128):
        points = circle(n, radius, middle)
        deepest = radius - float(np.hypot(*((points + np.roll(points, -1, axis=0)) / 2 - middle).T).min())
        area = float(coverage(points, (66, 66), mode="area").sum())
        rows.append(
            (
                n,
                radius * (1 - np.cos(np.pi / n)),
                radius * np.pi**2 / (2 * n**2),
                deepest,
                100 * (1 - area / (np.pi * radius**2)),
            )
        )
        if n in (3, 6, 12, 24):
            canvas = Canvas(66, 66, "white")
            canvas.polygon(points, BLUE, antialias=True)
            panels.append(
                panel(f"{n} sides", with_outlines(enlarged(canvas.pixels, 2), [circle(200, radius, middle)], 2, RED, 1))
            )
    whole = smooth_curve(HIPPO, 16)
    for step in (64, 32, 16, 4):
        canvas = Canvas(120, 80, "white")
        canvas.polygon(whole[::step], (134, 124, 138), antialias=True)
        panels.append(panel(f"a hippo of {len(whole[::step])} sides", canvas.pixels, 2))
    shown = chart(
        [
            ("R (1 - cos pi/n)", [row[0] for row in rows], [row[1] for row in rows]),
            ("R pi^2 / 2 n^2", [row[0] for row in rows], [row[2] for row in rows]),
        ],
        Axis("sides", is_log=True),
        Axis("largest distance from a circle of radius 30, in pixels", is_log=True),
    )
    headings = ("sides", "R (1 - cos pi/n)", "R pi^2 / 2 n^2", "measured, px", "area missing, %")
    return Result(Table(headings, tuple(rows)), (*panels, panel("Twice the sides, a quarter of the error", shown)))


SHAPES: dict[str, list[tuple[float, float]]] = {
    "convex, 7 corners": [(12, 4), (26, 3), (36, 11), (37, 24), (27, 36), (12, 36), (4, 20)],
    "concave, 8 corners": [(4, 4), (20, 16), (36, 4), (30, 20), (36, 36), (20, 26), (4, 36), (10, 20)],
    "bow tie, 4 corners": [(4, 8), (36, 32), (36, 8), (4, 32)],
    "pentagram, 5 corners": [(float(x), float(y)) for x, y in star(5, 2, 18, 20.5)],
}


def triangulations() -> Result:
    """Cut four polygons into triangles, and compare the picture of the triangles with that of the polygon."""
    rows, panels, size = list[Row](), list[Panel](), (41, 41)
    for name, points in SHAPES.items():
        mesh = triangulate(points, "non-zero", subpixel_bits=8)
        places = np.asarray(mesh.positions)[:, :2]
        corners = places[mesh.triangles]
        made = len(places) - len(points)
        hits, whole = count(corners, size), coverage(points, size, fill_rule="non-zero")
        sides = corners[:, 1:] - corners[:, :1]
        area = float(np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]).sum()) / 2
        exact = float(coverage(points, size, mode="area", fill_rule="non-zero").sum())
        rows.append((name, len(corners), made, int((hits > 1).sum()), int(((hits > 0) != whole).sum()), area, exact))
        tones = shaded(np.arange(len(corners)) % 5, -1, 5, [WHITE, BLUE])
        canvas = Canvas(41 * 5, 41 * 5, "white")
        canvas.triangles(corners * 5, tones)
        shown = with_outlines(canvas.pixels, list(corners), 5, INK, 1.2)
        panels.append(
            panel(
                f"{name}: {len(corners)} triangles, {made} new points",
                with_dots(shown, places[len(points) :], 5, RED, 8) if made else shown,
            )
        )
    convex = np.array(SHAPES["convex, 7 corners"])
    fan = [(0, k, k + 1) for k in range(1, len(convex) - 1)]
    listed = half_planes.fan(len(convex))
    hits = count(convex[np.array(fan)], size)
    rows.append(
        ("fan of the convex one", len(fan), 0, int((hits > 1).sum()), int(((hits > 0) != coverage(convex, size)).sum()), "", "")
    )
    rows.append(("fan of the slide for n = 7, p0 to p7", len(listed), "", "", "", "", ""))
    picture = with_outlines(np.full((205, 205, 3), 255, np.uint8), list(convex[np.array(fan)]), 5, BLUE, 1.4)
    panels.append(panel("fan of the convex one: n - 2 triangles", picture))
    headings = (
        "polygon",
        "triangles",
        "new points",
        "pixels drawn twice",
        "other than the polygon's",
        "area of the triangles",
        "area of the polygon",
    )
    return Result(Table(headings, tuple(rows)), tuple(panels))


def runs(inside: Array) -> int:
    """Return the most runs of pixels on one scan line."""
    padded = np.pad(inside.astype(np.int8), ((0, 0), (1, 0)))
    return int((np.diff(padded, axis=1) == 1).sum(axis=1).max())


def convexity() -> Result:
    """Count the spans of triangles, and of a polygon that is not convex."""
    rng = np.random.default_rng(51)
    most = max(runs(count(corners[None], (64, 64), algorithm="edge-walk") > 0) for corners in rng.uniform(-10, 74, (500, 3, 2)))
    concave = np.array(SHAPES["concave, 8 corners"])
    turned = [runs(coverage((concave - 20) @ turn.T + 20.5, (41, 41))) for turn in rotations(36)]
    triangle = np.array([(4, 6), (37, 14), (15, 38)], np.float64)
    rows = (
        ("500 random triangles: spans on a scan line, at most", most), ("a concave polygon, at most", max(turned)),
        ("turned in 36 steps, at least", min(turned)),
    )  # fmt: skip
    panels = []
    for name, points in (("triangle: one span a scan line", triangle), ("concave: up to two", concave)):
        inside = coverage(points, (41, 41))
        first = np.diff(np.pad(inside.astype(np.int8), ((0, 0), (1, 0))), axis=1) == 1
        shown = painted(inside.astype(int) + (first & inside), [WHITE, SKY, RED])
        panels.append(panel(f"{name}; red begins a span", with_outlines(gridded(shown, 6), [points], 6)))
    return Result(Table(("", ""), rows), tuple(panels))


def rotations(steps: int) -> Float64Array:
    """Return matrices that turn the plane, (steps, 2, 2)."""
    angle = np.arange(steps) * 2 * np.pi / steps
    return np.stack(
        [np.stack([np.cos(angle), -np.sin(angle)], axis=1), np.stack([np.sin(angle), np.cos(angle)], axis=1)], axis=1
    )


def sphere(rings: int) -> tuple[Float64Array, Array]:
    """Return a bumpy ball of 4 rings^2 triangles, (V, 3) and (T, 3)."""
    u, v = np.meshgrid(np.arange(2 * rings + 1) * np.pi / rings, np.arange(rings + 1) * np.pi / rings, indexing="ij")
    radius = 1 + 0.08 * np.sin(5 * u) * np.sin(v) ** 2 + 0.05 * np.cos(9 * v)
    points = (radius[..., None] * np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], axis=2)).reshape(-1, 3)
    corner = (np.arange(2 * rings)[:, None] * (rings + 1) + np.arange(rings)).reshape(-1)
    a, b, c, d = corner, corner + 1, corner + rings + 1, corner + rings + 2
    return points, np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def five_primitives() -> Result:
    """Work the slide's sum, and measure models: how many triangles have a visible sample, how many there are for each pixel."""
    rows: list[Row] = [
        (
            "the slide: 10^8 primitives, 2 x 10^6 pixels, 10 % visible",
            100_000_000,
            2_000_000,
            10.0,
            100_000_000 * 0.1 / 2_000_000,
        )
    ]
    panels, size = [], (96, 96)
    for rings in (8, 32, 128, 512):
        points, triangles = sphere(rings)
        clip = np.concatenate([points * (0.8, 0.8, -0.8), np.ones((len(points), 1))], axis=1)
        seen = rasterize(clip, triangles, size)
        covered = int((seen.primitive >= 0).sum())
        facing = count(
            np.stack([(clip[:, 0] + 1) * 48, (1 - clip[:, 1]) * 48], axis=1)[triangles], size, cull="back", coverage="touched"
        )
        shown = len(np.unique(seen.primitive)) - 1
        rows.append(
            (
                f"a ball of {len(triangles):,} triangles",
                len(triangles),
                covered,
                100 * shown / len(triangles),
                float(facing[seen.primitive >= 0].mean()),
            )
        )
        panels.append(
            panel(
                f"{len(triangles):,} triangles: how many touch a pixel",
                shaded(np.log2(1 + facing), 0, 7, [WHITE, (253, 208, 162), (217, 72, 1), (70, 20, 10)]),
                2,
            )
        )
    headings = ("model", "triangles", "pixels", "visible in a sample, %", "primitives a pixel")
    return Result(Table(headings, tuple(rows)), tuple(panels))


SPLATS = ((130_712, 132), (259_975, 215), (1_017_149, 722), (14_835_967, 8308))


def knot(along: int, around: int) -> tuple[Float64Array, Float64Array]:
    """Return points on a tube that is knotted once, and the directions away from it, (along x around, 3) each."""
    u = np.arange(along) * 2 * np.pi / along
    middle = np.stack([(2 + np.cos(3 * u)) * np.cos(2 * u), (2 + np.cos(3 * u)) * np.sin(2 * u), np.sin(3 * u)], axis=1)
    tangent = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
    across = np.cross(tangent, (0.0, 0.0, 1.0))
    upward = np.cross(across, tangent)
    frame = [v / np.linalg.norm(v, axis=1)[:, None] for v in (across, upward)]
    v = (np.arange(around) * 2 * np.pi / around)[:, None, None]
    away = np.cos(v) * frame[0] + np.sin(v) * frame[1]
    return (middle + 0.55 * away).reshape(-1, 3), away.reshape(-1, 3)


def splats() -> Result:
    """Work out the rates of the slide's four pictures, and draw a tree of spheres, stored as differences, in four cuts."""
    rows: list[Row] = [
        (f"the slide: {number:,} splats in {ms:,} ms", number, ms, number / ms / 1000, "", "", "") for number, ms in SPLATS
    ]
    panels, scale, node_bits = [], 24.0, sum(NODE_BITS.values())
    points, away = knot(480, 48)
    tree = build_tree(points, 0.06)
    seen, normals = decode(encode(tree)), averages(tree, away)
    off = np.sqrt(((seen.centres - tree.centres) ** 2).sum(axis=1))
    light = normals @ (-0.5, 0.6, 0.62) / np.maximum(np.sqrt((normals**2).sum(axis=1)), 1e-9)
    tones = shaded(np.clip(light, 0, 1), 0, 1, [(60, 45, 35), (214, 190, 160), (252, 246, 236)])
    disc = circle(16, 1.0, 0.0)
    wedges = np.stack([np.zeros((16, 2)), disc, np.roll(disc, -1, axis=0)], axis=1)
    for threshold in (40, 20, 10, 1):
        found = cut(seen, scale, threshold)

        # Paint the splats as discs, from the farthest to the nearest.
        nodes = found.nodes[np.argsort(seen.centres[found.nodes, 2], kind="stable")]
        places = 112 + scale * seen.centres[nodes, :2] * (1, -1)
        discs = places[:, None, None] + scale * seen.radii[nodes, None, None, None] * wedges
        canvas = Canvas(224, 224, "white")
        canvas.triangles(discs.reshape(-1, 3, 2), np.repeat(tones[nodes], len(wedges), axis=0))
        widest = 2 * scale * float(seen.radii[nodes].max())
        rows.append(
            (
                f"a knot, down to {threshold} px", len(nodes), "", "", widest, scale * float(off[nodes].max()),
                found.visited * node_bits / 8192,
            )
        )  # fmt: skip
        panels.append(panel(f"{len(nodes):,} splats, up to {widest:.3g} px wide", canvas.pixels))
    headings = ("", "splats", "ms", "million a second", "widest, px", "off by, px", f"KiB at {node_bits} bits a node")
    return Result(Table(headings, tuple(rows)), tuple(panels))


EXPERIMENTS = (
    Experiment(
        "convexity", "S0", "46-52", "Triangles are always Convex",
        "One span a scan line",
        "However a triangle is turned, a scan line meets it in one span. A polygon that is not convex has several, and "
        "how many depends on how it is turned.",
        convexity, (8,), edge_walk, "write_span(write_sample",
    ),
    Experiment(
        "polygonal-approximation", "S0", "54-60", "Triangles can approximate arbitrary shapes",
        "More sides, a better fit",
        "A polygon of n sides misses its circle by R (1 - cos pi/n), which is close to R pi^2 / 2 n^2: twice the sides, a"
        " quarter of the error. Even hippos are made of polygons.",
        approximation, (9,), coverage, "return block.count() if mode == \"area\"",
    ),
    Experiment(
        "triangulations", "S0", "66-70", "Polygons can be Decomposed into Triangles",
        "Polygons cut into triangles",
        "A convex polygon is a fan of n - 2 triangles; the slide's p0 to pn are n + 1 corners. Every simple polygon can "
        "be cut, not 'usually'; one that crosses itself needs new points, one for a bow tie and five for a pentagram. No "
        "pixel is drawn twice.",
        triangulations, (10, 11, 12), triangulate, "cut = triangulate_rings(", slips=(7,),
    ),
    Experiment(
        "five-primitives-a-pixel", "S0", "531-543", "A Post-Triangle World?",
        "Five primitives for each pixel",
        "A hundred million primitives on two million pixels, a tenth of them visible: five for each pixel. A ball of a "
        "million triangles on 96 x 96 pixels has far more, and almost none of them owns a sample.",
        five_primitives, (120, 121), count, "run(algorithm, order",
    ),
    Experiment(
        "splats", "S0", "545-566", "Point-Cloud Rendering",
        "Points instead of triangles",
        "From the slide's four pictures follow rates of 0.99 to 1.79 million splats a second: the rate rises with the "
        "number, because small splats fill fewer pixels. Below, a knot of 23,040 points in four cuts through one tree; each "
        "sphere is stored in 13 bits against its parent, which makes it larger and moves it, but less the finer the cut.",
        splats, (122, 123), cut, "is_drawn =",
    ),
)  # fmt: skip
