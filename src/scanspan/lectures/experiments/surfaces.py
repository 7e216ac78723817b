"""Experiments on scan lines and hidden surfaces: edges that come and go, spans, coherence, and the pictures of ivscan.

Source: S3, lines 110-384 and 660-690.
"""

from __future__ import annotations

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.material import Material
from scanspan.assets.mesh import Mesh
from scanspan.assets.scene import Instance, Scene
from scanspan.lectures import hidden_surfaces
from scanspan.lectures.experiments.experiment import Experiment, Result, Row, Table
from scanspan.lectures.experiments.figure import (
    GREY,
    INK,
    RED,
    SKY,
    WHITE,
    Panel,
    enlarged,
    gridded,
    painted,
    panel,
    with_outlines,
)
from scanspan.lectures.hidden_surfaces import Facet, shipped_polygons, sweep_up
from scanspan.lectures.ivscan import draw_view, magnify, replay_log, scan, write_log
from scanspan.lectures.raster import at_centres
from scanspan.pipeline import rasterize, render
from scanspan.raster.active_edges import insert_edges, sort_edges, step_edges
from scanspan.raster.setup import pixels_between
from scanspan.raster.span_list import list_spans
from scanspan.records import Array, Float64Array
from scanspan.target.visibility import Visibility

TONES = [WHITE, (86, 140, 200), (238, 170, 80), (110, 180, 120), (205, 110, 90), (160, 120, 190), (240, 210, 110)]
WAYS = ("scanline-eval", "scanline-zrow", "span-list")


def overlapping(count: int = 6) -> list[Facet]:
    """Return convex polygons (x, y, z, colour) that overlap, each level in depth, so that none passes through another."""
    facets: list[Facet] = []
    for k in range(count):
        angle = np.arange(5) * 2 * np.pi / 5 + 0.7 * k
        middle = (24 + 13 * np.cos(1.1 * k), 22 + 11 * np.sin(1.7 * k))
        x, y = np.rint((middle[0] + 11 * np.cos(angle)) * 16) / 16, np.rint((middle[1] + 9 * np.sin(angle)) * 16) / 16
        facets.append([(float(a), float(b), 0.8 - 0.3 * k, float(k)) for a, b in zip(x, y, strict=True)])
    return facets


def outlines_of(facets: list[Facet]) -> list[Float64Array]:
    """Return the outlines of polygons where pixels have their samples at whole coordinates."""
    return [at_centres([corner[:2] for corner in facet]) for facet in facets]


def to_clip(points: Float64Array, depth: Float64Array, size: tuple[int, int]) -> Float64Array:
    """Return places in pixels with depths from -1, near, to 1 as clip coordinates."""
    return np.stack([2 * points[:, 0] / size[0] - 1, 1 - 2 * points[:, 1] / size[1], depth, np.ones(len(points))], axis=1)


def triangles_of(facets: list[Facet], size: tuple[int, int]) -> tuple[Float64Array, Array]:
    """Return polygons as fans of triangles in clip coordinates."""
    clip = np.concatenate([to_clip(at_centres([c[:2] for c in f]), np.array([c[2] for c in f]), size) for f in facets])
    first = np.cumsum([0, *(len(facet) for facet in facets)])
    fans = [(first[n], first[n] + k, first[n] + k + 1) for n, facet in enumerate(facets) for k in range(1, len(facet) - 1)]
    return clip, np.array(fans)


def scan_lines() -> Result:
    """Sweep over polygons by the three ways of the slides, in the lecture's program and in the library."""
    facets, size, k = overlapping(), (48, 46), 5
    clip, triangles = triangles_of(facets, size)
    right = shipped_polygons(facets, size, "half-space")
    rows, seen = list[Row](), []
    for name, visibility in zip(WAYS, hidden_surfaces.VISIBILITIES, strict=True):
        found = rasterize(clip, triangles, size, algorithm=name, subpixel_bits=12)
        swept = sweep_up(facets, size, rule="canonical", visibility=visibility)
        counted = found.counters
        rows.append(
            (
                f"{visibility}: {name}",
                counted["spans"],
                counted["depth_tests"],
                counted["insertions"],
                counted["swaps"],
                int((shipped_polygons(facets, size, name) != right).sum()),
                int((swept.polygon != right).sum()),
                swept.left_over,
            )
        )
        seen.append(swept)
    shown = enlarged(painted(right + 1, TONES), k)
    active = np.array([[sum(e >= 0 for e in np.unique(row))] for row in right])
    bars = painted(np.arange(8)[None, :] < active, [WHITE, SKY])
    panels = (
        panel("what is visible", with_outlines(shown, outlines_of(facets), k, GREY, 1)),
        panel(
            "how many spans had each pixel",
            enlarged(painted(seen[0].hits, [WHITE, (222, 235, 247), (158, 202, 225), (49, 130, 189), INK]), k),
        ),
        panel("polygons that show on each scan line", enlarged(bars, k)),
    )
    headings = (
        "way to what is visible",
        "spans",
        "depths compared",
        "edges inserted",
        "swaps",
        "pixels other than by half-spaces",
        "pixels that the lecture's program shows otherwise",
        "edges left over",
    )
    return Result(Table(headings, tuple(rows)), panels)


def subtleties() -> Result:
    """Sweep over a kite with corners between samples, and over four panes, as printed and by the canonical rule."""
    kite, block = hidden_surfaces.demonstrate_buckets(), hidden_surfaces.demonstrate_buckets(hidden_surfaces.BLOCK)
    panes = hidden_surfaces.demonstrate_neighbours()
    canonical = sweep_up([hidden_surfaces.KITE], (30, 32), rule="canonical")
    rows = (
        ("kite: wrong pixels", kite.wrong_as_printed, kite.wrong_canonical),
        ("kite: edges on one scan line, at most", kite.most_edges, canonical.most_edges),
        ("block: wrong pixels", block.wrong_as_printed, block.wrong_canonical),
        ("block: rows", block.rows_as_printed, block.rows),
        ("four panes: drawn twice", panes.twice_as_printed, panes.twice_canonical),
        ("edges left over on a raster that ends too early", "", hidden_surfaces.demonstrate_left_over()),
        ("on one that is high enough", "", hidden_surfaces.demonstrate_left_over(32)),
    )
    panels, k, size = [], 9, (30, 32)
    for rule in hidden_surfaces.RULES:
        swept = sweep_up([hidden_surfaces.KITE], size, rule=rule)
        shown = np.where(swept.polygon >= 0, 1, 0) + 2 * (
            (swept.polygon >= 0) != (shipped_polygons([hidden_surfaces.KITE], size) >= 0)
        )
        picture = with_outlines(
            gridded(painted(shown, [WHITE, (198, 219, 239), (250, 205, 180), RED]), k), outlines_of([hidden_surfaces.KITE]), k
        )
        panels.append(panel(f"{rule}: too many in red, left out in pink", picture))
    return Result(Table(("", "as printed", "canonical"), rows), tuple(panels))


def kept_identity() -> Result:
    """Sweep over two triangles that pass through each other, with each way to find what is visible."""
    found = hidden_surfaces.demonstrate_identity()
    rows = (
        ("nearest span kept between events", found.active_span_list),
        ("every span evaluated", found.evaluate),
        ("depth buffer of one row", found.one_row_buffer),
        ("the library's span list, which finds crossings", found.shipped_span_list),
    )
    facets: list[Facet] = [[*facet[:3]] for facet in hidden_surfaces.CROSSING]
    size, k, panels = (32, 32), 7, []
    for name in ("active span list", "evaluate"):
        polygon = sweep_up(facets, size, rule="canonical", visibility=name).polygon
        panels.append(
            panel(f"by {name}", with_outlines(enlarged(painted(polygon + 1, TONES), k), outlines_of(facets), k, GREY))
        )
    return Result(Table(("pixels that show the wrong one of two", "pixels"), rows), tuple(panels))


def coherence_of(seen: Visibility) -> tuple[float, float, float]:
    """Return the mean run of one visible triangle, how often it changes in a row, and the share that the row below has too."""
    shown = seen.primitive
    changes = (np.diff(shown, axis=1) != 0).sum(axis=1)
    return shown.shape[1] / float((changes + 1).mean()), float(changes.mean()), float((shown[1:] == shown[:-1]).mean())


def tiles(count: int) -> Float64Array:
    """Return a square cut into count x count cells of two triangles each, in pixels, shaken a little."""
    rng = np.random.default_rng(41)
    x, y = np.meshgrid(np.linspace(0, 192, count + 1), np.linspace(0, 192, count + 1))
    points = np.stack([x, y], axis=2)
    points[1:-1, 1:-1] += rng.uniform(-0.25, 0.25, points[1:-1, 1:-1].shape) * (192 / count)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    return np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 2) for half in ((a, b, c), (a, c, d))])


def confetti(count: int, size: float) -> Float64Array:
    """Return small triangles strewn over the square."""
    rng = np.random.default_rng(42)
    return np.asarray(rng.uniform(0, 192, (count, 1, 2)) + rng.uniform(-size, size, (count, 3, 2)))


def spatial_coherence() -> Result:
    """Measure spatial coherence in scenes of large polygons, of small ones, and of confetti."""
    scenes = {
        "a few large polygons": tiles(3), "a mesh of 512 triangles": tiles(16), "a mesh of 18,432 triangles": tiles(96),
        "confetti of 4,000 triangles": confetti(4000, 3), "dust of 60,000 triangles": confetti(60000, 1.2),
    }  # fmt: skip
    rng, rows, panels, size = np.random.default_rng(43), list[Row](), list[Panel](), (192, 192)
    for name, corners in scenes.items():
        depth = np.repeat(rng.uniform(-0.9, 0.9, len(corners)), 3)
        clip = to_clip(corners.reshape(-1, 2), depth, size)
        seen = rasterize(clip, np.arange(len(clip)).reshape(-1, 3), size, algorithm="scanline-zrow")
        counted, (run, changes, kept) = seen.counters, coherence_of(seen)
        rows.append(
            (
                name, run, changes, 100 * kept, counted["insertions"] / size[1], counted["swaps"] / size[1],
                counted["depth_tests"] / max(1, int((seen.primitive >= 0).sum())),
            )
        )  # fmt: skip
        colors = np.concatenate([[WHITE], np.random.default_rng(44).integers(60, 240, (len(corners), 3))])
        panels.append(panel(name, colors[seen.primitive + 1], 1))
    headings = (
        "scene",
        "mean run, pixels",
        "changes in a row",
        "same as below, %",
        "edges inserted a row",
        "swaps a row",
        "depths compared a pixel",
    )
    return Result(Table(headings, tuple(rows)), tuple(panels))


def ivscan_views() -> Result:
    """Show the views of ivscan: input, pixels outlined, edges outlined, the calls to setPixel, the picture."""
    facets, size, k = overlapping(4), (50, 44), 6
    solids = [
        Instance(
            Mesh.from_polygons([(x, -y, -10 * z) for x, y, z, _ in facet], [range(len(facet))]),
            material=Material(base_color=(tone[0] / 255, tone[1] / 255, tone[2] / 255, 1.0)),
        )
        for facet, tone in zip(facets, TONES[1:], strict=False)
    ]
    camera = Camera.orthographic((25, -22, 50), (25, -22, 0), (0, 1, 0), height=size[1])
    session = scan(Scene(solids), size, camera=camera, zoom=k, algorithm="span-list")
    calls = session.calls
    drawn = render(session.frame.scene, camera, (size[0] * k, size[1] * k), background="white", edges=True)
    half = magnify(calls.replay(session.behind, len(calls.xy) // 2), k)
    views = {
        "input: polygons": drawn.color, "pixels outlined": draw_view(session, "pixels"),
        "edges outlined": draw_view(session, "edges"),
        "calls to setPixel in their order": draw_view(session, "calls"),
        "half of the calls": half, "resulting image": draw_view(session, "result"),
    }  # fmt: skip
    again = replay_log(write_log(session))
    rows = (
        ("calls to setPixel", len(calls.xy)),
        ("pixels of the picture that are set", int((session.frame.primitive >= 0).sum())),
        ("different pixels among the calls", len(np.unique(calls.xy, axis=0))),
        ("pixels that differ when the log is replayed", int((again != session.frame.color).any(axis=2).sum())),
    )
    return Result(Table(("", ""), rows), tuple(panel(name, view[..., :3], 1) for name, view in views.items()))


EXPERIMENTS = (
    Experiment(
        "scan-line-sweep", "S3", "110-280", "Scan-line Hidden Surface Algorithms",
        "One raster, edges that come and go",
        "An edge table, a list of active edges kept in order by x, and three ways to find the visible span: compare all "
        "at each pixel, keep a depth buffer of one row, or keep a list of active spans and no buffer at all. All three "
        "show the same; swaps are the edges that crossed.",
        scan_lines, (79, 81, 82, 83, 85, 86, 87, 88, 89, 91, 93, 94), insert_edges, "order[k + m + 1] = e",
    ),
    Experiment(
        "kept-identity", "S3", "236-264", "Raster Filling Without a Single Raster Buffer",
        "The nearest span is not kept",
        "Without a buffer the nearest span is found where one begins or ends, and kept in between. Where polygons pass "
        "through each other that is wrong until the next event; the crossing has to be an event too.",
        kept_identity, (90, 93), list_spans, "nearest = np.int64(find_nearest",
    ),
    Experiment(
        "four-subtleties", "S3", "282-311", "Scan Conversion Subtleties",
        "Four questions about corners between samples",
        "In which bucket does an edge begin, with which x, when is it removed, which pixels has a span? Read as printed, "
        "buckets round down and ends round up, so a polygon has rows too many, and three edges where it should have two. "
        "The rule: a sample row y is in if ymin <= y < ymax, a pixel x if x1 <= x < x2.",
        subtleties, (80, 84, 92, 95, 96), pixels_between, "first_sample(low", slips=(16,),
    ),
    Experiment(
        "spatial-coherence", "S3", "360-384", "Spatial Coherence",
        "How slowly the picture changes",
        "How long is a visible triangle seen along a row, and how much of a row does the row below see too? Large "
        "polygons change once in a while and cost a few edges a row; in dust every pixel is another triangle, and keeping"
        " lists pays no more.",
        spatial_coherence, (98,), step_edges, "crossing, rest = step_crossing(",
    ),
    Experiment(
        "ivscan-views", "S3", "660-690", "Assignment 4: ivscan",
        "The views of the assignment",
        "The input, its pixels and its edges outlined, the calls to setPixel in their order, and the picture. Each pixel "
        "is set once, and the log of calls replayed is the picture.",
        ivscan_views, (91, 118), sort_edges, "counters[SWAPS] +=",
    ),
)  # fmt: skip
