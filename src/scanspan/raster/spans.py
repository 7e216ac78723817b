"""Polygons to spans: the pixels of many polygons, row by row, each with the number of its polygon.

What a map needs is not a colour but who covers a pixel, and how often. Spans say that without a picture, in memory that grows
with the outlines and not with what they hold: one sweep serves masks, numbers, counts and sums alike.

They are found by crossings.py: top-left, exact, each centre once.

Source: the lectures' scan-line polygon fill.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel, inline_kernel, kernel
from scanspan.raster.crossings import scan_polygons
from scanspan.raster.polygon import CAPACITY
from scanspan.records import BoolArray, Float64Array, Int32Array, Int64Array, Integer, Sampling

# Columns of spans: the polygon, the row, the first pixel and the one after the last.
OWNER, ROW, X_START, X_END = range(4)
SPAN_COLUMNS = 4


@helper_kernel
def grow_spans(spans: Int32Array) -> Int32Array:
    """Return a copy with room for twice as many."""
    count = spans.shape[0]
    larger = np.empty((2 * count, SPAN_COLUMNS), np.int32)
    for n in range(count):
        for k in range(SPAN_COLUMNS):
            larger[n, k] = spans[n, k]
    return larger


@helper_kernel
def push_span(
    spans: Int32Array, total: Integer, owner: Integer, y: Integer, x_start: Integer, x_end: Integer
) -> tuple[Int32Array, Integer]:
    """Push a span and return the spans and how many there are."""
    if total == spans.shape[0]:
        spans = grow_spans(spans)
    spans[total, OWNER], spans[total, ROW], spans[total, X_START], spans[total, X_END] = owner, y, x_start, x_end
    return spans, total + 1


@helper_kernel
def keep_span(
    spans: Int32Array, total: Integer, owner: Integer, y: Integer, x_start: Integer, x_end: Integer, sampling: Sampling
) -> tuple[Int32Array, Integer]:
    """Keep a span."""
    return push_span(spans, total, owner, y, x_start, x_end)


@kernel
def cut_spans(
    xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int, sampling: Sampling
) -> Int32Array:
    """Return the spans of the samples that polygons hold, (N, SPAN_COLUMNS), by polygon and row; no two of one overlap.

    Shapes  as for scan_polygons.
    """
    room = np.empty((CAPACITY, SPAN_COLUMNS), np.int32)
    owners = np.arange(polygon_rings.shape[0] - 1)
    spans, total = scan_polygons(keep_span, room, owners, xy, ring_starts, polygon_rings, fill_rule, sampling)
    kept: Int32Array = spans[:total].copy()
    return kept


@inline_kernel
def mark_span(
    target: BoolArray, total: Integer, owner: Integer, y: Integer, x_start: Integer, x_end: Integer, sampling: Sampling
) -> tuple[BoolArray, Integer]:
    """Mark the samples of a span; target: (h, w), the rectangle of the sampling."""
    row = target[y - sampling.y_start, x_start - sampling.x_start : x_end - sampling.x_start]
    for q in range(row.shape[0]):
        row[q] = True
    return target, total


@inline_kernel
def count_span(
    target: Int32Array, total: Integer, owner: Integer, y: Integer, x_start: Integer, x_end: Integer, sampling: Sampling
) -> tuple[Int32Array, Integer]:
    """Count a polygon at the samples of a span; target: (h, w), the rectangle of the sampling."""
    row = target[y - sampling.y_start, x_start - sampling.x_start : x_end - sampling.x_start]
    for q in range(row.shape[0]):
        row[q] += np.int32(1)
    return target, total


@inline_kernel
def rank_span(
    target: Int32Array, total: Integer, owner: Integer, y: Integer, x_start: Integer, x_end: Integer, sampling: Sampling
) -> tuple[Int32Array, Integer]:
    """Keep the highest rank at the samples of a span; the owner is a rank."""
    row = target[y - sampling.y_start, x_start - sampling.x_start : x_end - sampling.x_start]
    rank = np.int32(owner)
    for q in range(row.shape[0]):
        row[q] = max(row[q], rank)
    return target, total


@kernel
def mark_inside(
    target: BoolArray, rank: Int64Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Mark each sample that a polygon holds.

    Shapes  target: (h, w), the rectangle of the sampling; rank: (P,), of no account; the others as for scan_polygons.
    """
    scan_polygons(mark_span, target, rank, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def count_inside(
    target: Int32Array, rank: Int64Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Count the polygons that hold each sample: what count_spans makes of cut_spans, with no spans in between.

    Shapes  as for mark_inside.
    """
    scan_polygons(count_span, target, rank, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def rank_inside(
    target: Int32Array, rank: Int64Array, xy: Int64Array, ring_starts: Int32Array, polygon_rings: Int32Array, fill_rule: int,
    sampling: Sampling,
) -> None:  # fmt: skip
    """Keep at each sample the highest rank of the polygons that hold it; shapes as for mark_inside."""
    scan_polygons(rank_span, target, rank, xy, ring_starts, polygon_rings, fill_rule, sampling)


@kernel
def rank_spans(target: Int32Array, spans: Int32Array, rank: Int32Array, x_start: int, y_start: int) -> None:
    """Keep in each pixel the highest rank of the polygons there.

    Shapes  target: (h, w), the block from (x_start, y_start) on, which holds all spans; rank: (P,), by owner.
    """
    for n in range(spans.shape[0]):
        own, row = rank[spans[n, OWNER]], target[spans[n, ROW] - y_start]
        for x in range(spans[n, X_START] - x_start, spans[n, X_END] - x_start):
            row[x] = max(row[x], own)


@kernel
def count_spans(target: Int32Array, spans: Int32Array, x_start: int, y_start: int) -> None:
    """Count the polygons at each pixel; shapes as for rank_spans."""
    for n in range(spans.shape[0]):
        row = target[spans[n, ROW] - y_start]
        for x in range(spans[n, X_START] - x_start, spans[n, X_END] - x_start):
            row[x] += np.int32(1)


@kernel
def sum_spans(target: Float64Array, spans: Int32Array, values: Float64Array, x_start: int, y_start: int) -> None:
    """Add up the values of the polygons at each pixel, in their order; values: (P,), else shapes as for rank_spans."""
    for n in range(spans.shape[0]):
        value, row = values[spans[n, OWNER]], target[spans[n, ROW] - y_start]
        for x in range(spans[n, X_START] - x_start, spans[n, X_END] - x_start):
            row[x] += value
