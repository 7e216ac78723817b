"""Hidden surfaces by scan lines, as S3 has it: an edge table, an active edge list, and three ways to find what is visible.

The raster is swept upwards from row 0; rows are sampled at whole y, pixels at whole x. Two rules can be had. "as printed" is
what the slides say where they say something: an edge begins in the bucket [y, y + 1) of its lower end and with the x of that
end, is deleted where it ends in (y - 1, y], and a span has its pixels from ceiling to floor. "canonical" is the answer to the
four questions that S3 ends with: an edge is active for ymin <= y < ymax, begins with its x there, and a span has its pixels
from ceiling to ceiling less one.

Known faults of the first, with numbers in the functions at the end:

- The bucket is found by rounding down and the end by rounding up, so a polygon has a row too many below and above.
- At a corner where one edge follows another both are active: three edges where two are promised, and the pairs get mixed up.
- Neighbours draw their common boundary twice.
- The list is not empty at the end if a polygon reaches above the raster, so the sanity check cries wolf.
- "Maintain identity of span with minimum depth": an identity kept until the next span begins or ends misses polygons that
  pass through each other.

Polygons are convex. Level edges are left out, as the slides do first; under the canonical rule nothing is missing then.

Source: S3, lines 110-384.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from scanspan.errors import unknown_name
from scanspan.homogeneous import finite_array
from scanspan.lectures.raster import at_centres
from scanspan.pipeline import rasterize
from scanspan.records import Float64Array, Int32Array

RULES = ("as printed", "canonical")
VISIBILITIES = ("evaluate", "one-row buffer", "active span list")
Facet = Sequence[tuple[float, float, float, float]]  # corners of a convex polygon: x, y, z and a colour


@dataclass
class EdgeRec:
    """An edge of a polygon on the current scan line; S3, lines 134-146."""

    y_end: Fraction
    x: Fraction
    dx: Fraction
    color: Fraction
    dcolor: Fraction
    z: Fraction
    dz: Fraction
    polygon: int

    def step(self, rows: Fraction = Fraction(1)) -> None:
        """Go on by some rows."""
        self.x += self.dx * rows
        self.color += self.dcolor * rows
        self.z += self.dz * rows


class Span(NamedTuple):
    """What a polygon covers of a scan line."""

    left: EdgeRec
    right: EdgeRec
    first: int  # pixels
    last: int  # included

    def at(self, x: int) -> tuple[Fraction, Fraction]:
        """Return depth and colour at a pixel."""
        width = self.right.x - self.left.x
        share = (x - self.left.x) / width if width else Fraction(0)
        z = self.left.z + share * (self.right.z - self.left.z)
        return z, self.left.color + share * (self.right.color - self.left.color)


@dataclass
class Sweep:
    """A finished sweep."""

    polygon: Int32Array  # (H, W), -1 for none
    color: Float64Array  # (H, W)
    hits: Int32Array  # (H, W), how many spans had the pixel
    unmatched: int = 0  # edges that opened a polygon and had no partner
    most_edges: int = 0  # of one polygon on one scan line
    swaps: int = 0  # neighbours that changed places in the active edge list
    left_over: int = 0  # edges that were still active when all rows were done


def edge_table(facets: Sequence[Facet], height: int, rule: str) -> list[list[EdgeRec]]:
    """Return the edges by the row in which they begin, sorted by x; S3, lines 128-166."""
    table: list[list[EdgeRec]] = [[] for _ in range(height)]
    for number, facet in enumerate(facets):
        checked = finite_array(f"facets[{number}]", facet, (None, 4)).tolist()
        corners = [tuple(Fraction(value) for value in corner) for corner in checked]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            low, high = (a, b) if a[1] <= b[1] else (b, a)
            if low[1] == high[1]:
                continue
            dx, dz, dcolor = ((high[k] - low[k]) / (high[1] - low[1]) for k in (0, 2, 3))
            edge = EdgeRec(high[1], low[0], dx, low[3], dcolor, low[2], dz, number)

            # The bucket, and the values that the edge begins with. Rows below the raster are passed over.
            bucket = floor(low[1]) if rule == "as printed" else ceil(low[1])
            if rule == "canonical":
                edge.step(bucket - low[1])
            if bucket < 0:
                edge.step(Fraction(-bucket))
                bucket = 0
            ends = high[1] < bucket if rule == "as printed" else high[1] <= bucket
            if bucket < height and not ends:
                table[bucket].append(edge)
    for row in table:
        row.sort(key=lambda edge: edge.x)
    return table


def spans_of(active: list[EdgeRec], rule: str, sweep: Sweep) -> list[Span]:
    """Return the spans of a scan line by toggling each polygon's flag from left to right; S3, lines 198-206."""
    is_in: dict[int, bool] = {}
    spans = []
    for k, edge in enumerate(active):
        is_in[edge.polygon] = not is_in.get(edge.polygon, False)
        if not is_in[edge.polygon]:
            continue

        # Entering: the matching edge is the next one of the same polygon.
        partner = next((other for other in active[k + 1 :] if other.polygon == edge.polygon), None)
        if partner is None:
            sweep.unmatched += 1
            continue
        last = floor(partner.x) if rule == "as printed" else ceil(partner.x) - 1
        spans.append(Span(edge, partner, ceil(edge.x), last))
    return spans


def show_evaluated(spans: list[Span], y: int, sweep: Sweep) -> None:
    """Evaluate every active span at every pixel and take the nearest; S3, line 210."""
    for x in range(sweep.polygon.shape[1]):
        here = [(*span.at(x), span.left.polygon) for span in spans if span.first <= x <= span.last]
        if here:
            _, color, polygon = min(here, key=lambda found: (found[0], found[2]))
            sweep.polygon[y, x], sweep.color[y, x] = polygon, color


def show_buffered(spans: list[Span], y: int, sweep: Sweep) -> None:
    """Write each span into a depth buffer of one row; S3, line 212."""
    nearest: list[tuple[Fraction, int] | None] = [None] * sweep.polygon.shape[1]
    for span in spans:
        for x in range(max(span.first, 0), min(span.last, len(nearest) - 1) + 1):
            z, color = span.at(x)
            key, before = (z, span.left.polygon), nearest[x]
            if before is None or key < before:
                nearest[x] = key
                sweep.polygon[y, x], sweep.color[y, x] = span.left.polygon, color


def show_listed(spans: list[Span], y: int, sweep: Sweep) -> None:
    """Sweep along the row with a list of active spans, without any buffer; S3, lines 240-264.

    The nearest span is found where one begins or has ended, and kept in between, as the slide's words have it.
    """
    waiting, active, nearest = sorted(spans, key=lambda span: span.first), list[Span](), None
    for x in range(sweep.polygon.shape[1]):
        # Take in the spans that begin, drop those that are complete.
        kept = [span for span in active if span.last >= x]
        begun = [span for span in waiting if span.first <= x <= span.last]
        waiting = [span for span in waiting if span.first > x]
        if begun or len(kept) < len(active):
            active = kept + begun
            nearest = min(active, key=lambda span: (span.at(x)[0], span.left.polygon)) if active else None
        if nearest is not None:
            sweep.polygon[y, x], sweep.color[y, x] = nearest.left.polygon, nearest.at(x)[1]


SHOW = dict(zip(VISIBILITIES, (show_evaluated, show_buffered, show_listed), strict=True))


def sweep_up(
    facets: Sequence[Facet], size: tuple[int, int], *, rule: str = "as printed", visibility: str = "evaluate"
) -> Sweep:
    """Sweep over polygons from row 0 upwards; S3, lines 266-280.

    Parameters
    ----------
    facets : convex polygons, corners (x, y, z, colour); the lowest z is nearest.
    size : (width, height).
    rule : "as printed" or "canonical".
    visibility : "evaluate", "one-row buffer" or "active span list".

    Raises
    ------
    InputError : for corners that are not four finite numbers, and an unknown name.

    Examples
    --------
    >>> square = [(1, 1, 0, 9), (3, 1, 0, 9), (3, 3, 0, 9), (1, 3, 0, 9)]
    >>> sweep_up([square], (4, 4), rule="canonical").polygon.tolist()
    [[-1, -1, -1, -1], [-1, 0, 0, -1], [-1, 0, 0, -1], [-1, -1, -1, -1]]
    """
    if rule not in RULES:
        raise unknown_name("rule", rule, RULES)
    if visibility not in SHOW:
        raise unknown_name("visibility", visibility, VISIBILITIES)
    (width, height), active = size, list[EdgeRec]()
    sweep = Sweep(np.full((height, width), -1, np.int32), np.zeros((height, width)), np.zeros((height, width), np.int32))
    table = edge_table(facets, height, rule)
    for y in range(height):
        # Insert what begins, and count what each polygon has.
        active = sorted([*active, *table[y]], key=lambda edge: edge.x)
        counts = np.bincount([edge.polygon for edge in active], minlength=1)
        sweep.most_edges = max(sweep.most_edges, int(counts.max()))

        # Assign and output the row.
        spans = spans_of(active, rule, sweep)
        for span in spans:
            sweep.hits[y, max(span.first, 0) : max(span.last + 1, 0)] += 1
        SHOW[visibility](spans, y, sweep)

        # Delete what ends, step the others, sort.
        limit = y if rule == "as printed" else y + 1
        active = [edge for edge in active if edge.y_end > limit]
        for edge in active:
            edge.step()
        sweep.swaps += insertion_sort(active)
    sweep.left_over = len(active)
    return sweep


def insertion_sort(active: list[EdgeRec]) -> int:
    """Sort edges by x and return how many neighbours changed places: as many as edges have crossed."""
    swaps = 0
    for k in range(1, len(active)):
        m = k
        while m > 0 and active[m].x < active[m - 1].x:
            active[m], active[m - 1] = active[m - 1], active[m]
            m, swaps = m - 1, swaps + 1
    return swaps


def shipped_polygons(facets: Sequence[Facet], size: tuple[int, int], algorithm: str = "scanline-eval") -> Int32Array:
    """Return which polygon `scanspan.rasterize` shows at each pixel, -1 for none; z from -1 to 1."""
    width, height = size
    clip, triangles, owner = list[tuple[float, ...]](), list[tuple[int, ...]](), list[int]()
    for number, facet in enumerate(facets):
        first = len(clip)
        for (x, y), z in zip(at_centres([corner[:2] for corner in facet]), [corner[2] for corner in facet], strict=True):
            clip.append((2 * x / width - 1, 1 - 2 * y / height, z, 1.0))
        triangles += [(first, first + k, first + k + 1) for k in range(1, len(facet) - 1)]
        owner += [number] * (len(facet) - 2)
    seen = rasterize(clip, triangles, size, algorithm=algorithm, subpixel_bits=12).primitive
    return np.where(seen < 0, -1, np.asarray(owner, np.int32)[seen])


class WrongRows(NamedTuple):
    """A polygon with corners between samples."""

    wrong_as_printed: int  # pixels
    wrong_canonical: int
    rows_as_printed: int
    rows: int
    most_edges: int  # of the polygon on one scan line, as printed
    unmatched: int


KITE: Facet = ((12.3, 2.4, 0.0, 0.0), (25.6, 11.3, 0.0, 0.0), (14.2, 27.7, 0.0, 0.0), (3.1, 13.6, 0.0, 0.0))
BLOCK: Facet = ((5.0, 2.4, 0.0, 0.0), (20.0, 2.4, 0.0, 0.0), (20.0, 9.6, 0.0, 0.0), (5.0, 9.6, 0.0, 0.0))


def demonstrate_buckets(facet: Facet = KITE) -> WrongRows:
    """Sweep over one polygon by either rule."""
    size = (30, 32)
    right = shipped_polygons([facet], size)
    printed, canonical = (sweep_up([facet], size, rule=rule) for rule in RULES)
    rows = [int((found >= 0).any(axis=1).sum()) for found in (printed.polygon, right)]
    wrong = [int((found.polygon != right).sum()) for found in (printed, canonical)]
    return WrongRows(wrong[0], wrong[1], rows[0], rows[1], printed.most_edges, printed.unmatched)


class Neighbours(NamedTuple):
    """Four squares that share sides, on whole coordinates."""

    twice_as_printed: int  # pixels
    twice_canonical: int
    wrong_canonical: int  # against what rasterize shows


def demonstrate_neighbours() -> Neighbours:
    """Sweep over a window of four panes."""
    places, size = [(2, 2), (10, 2), (2, 10), (10, 10)], (22, 22)
    panes: list[Facet] = [[(x, y, 0, 0), (x + 8, y, 0, 0), (x + 8, y + 8, 0, 0), (x, y + 8, 0, 0)] for x, y in places]
    printed, canonical = (sweep_up(panes, size, rule=rule) for rule in RULES)
    wrong = int((canonical.polygon != shipped_polygons(panes, size)).sum())
    return Neighbours(int((printed.hits > 1).sum()), int((canonical.hits > 1).sum()), wrong)


class Identity(NamedTuple):
    """Pixels that show the wrong one of two polygons which pass through each other."""

    active_span_list: int  # the nearest kept between events
    evaluate: int
    one_row_buffer: int
    shipped_span_list: int  # against the shipped evaluation of every span


CROSSING: tuple[Facet, Facet] = (
    ((2, 2, -0.5, 0), (28, 3, 0.5, 0), (27, 28, 0.5, 0), (3, 27, -0.5, 0)),
    ((4, 1, 0.5, 1), (29, 5, -0.4, 1), (26, 29, -0.3, 1), (1, 25, 0.4, 1)),
)


def demonstrate_identity() -> Identity:
    """Sweep over two crossing polygons with each way to find what is visible."""
    size = (32, 32)
    facets = [[*facet[:3]] for facet in CROSSING]  # triangles, which are flat
    right = shipped_polygons(facets, size)
    found = {name: sweep_up(facets, size, rule="canonical", visibility=name).polygon for name in VISIBILITIES}
    wrong = {name: int((polygon != right).sum()) for name, polygon in found.items()}
    listed = int((shipped_polygons(facets, size, "span-list") != right).sum())
    return Identity(wrong["active span list"], wrong["evaluate"], wrong["one-row buffer"], listed)


def demonstrate_left_over(height: int = 20) -> int:
    """Return how many edges are still active after the last row of a raster that a polygon reaches beyond; 0 is promised.

    >>> demonstrate_left_over(), demonstrate_left_over(32)
    (2, 0)
    """
    return sweep_up([KITE], (30, height), rule="canonical").left_over
