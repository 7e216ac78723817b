"""Dashes: which parts of lines a pattern of lengths leaves, for many lines at once.

Source: SVG 2, stroke-dasharray and stroke-dashoffset: a pattern of an odd number of lengths is gone through twice, one that
adds up to 0 leaves the line whole, and dashes of no length are dots where the cap is round or square.
"""

from __future__ import annotations

import numpy as np

from scanspan.errors import LimitError
from scanspan.records import Float64Array, Int64Array

MOST = 1 << 22  # dashes of one call
TINY = 2.0**-1000  # in the place of a length of 0


def dash_spans(lengths: Float64Array, pattern: Float64Array, offset: float) -> tuple[Int64Array, Float64Array, Float64Array]:
    """Return the dashes of lines: the line of each, (K,), and where along it, in pixels, it begins and ends.

    Parameters
    ----------
    lengths : (N,) of the lines, in pixels.
    pattern : on, off, ... in pixels; not negative, and not all 0.
    offset : how far into the pattern each line begins.

    Raises
    ------
    LimitError : for more than 2^22 dashes.
    """
    if len(pattern) % 2:
        pattern = np.concatenate([pattern, pattern])
    ends = np.cumsum(pattern)
    period, on = float(ends[-1]), ends[::2] - pattern[::2]
    begin = offset - np.floor(offset / period) * period
    repeats = np.ceil((lengths + begin) / period)
    if repeats.sum() * len(on) > MOST:
        raise LimitError(f"dash: {repeats.sum() * len(on):.0f} dashes: the limit is {MOST} in all")

    # Lay the whole pattern along each line as often as it goes, and cut off what is beyond the ends.
    counts = repeats.astype(np.int64)
    owner = np.repeat(np.arange(len(lengths)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    base = (number * period - begin)[:, None]
    starts, stops = (base + on).reshape(-1), (base + ends[::2]).reshape(-1)
    owner = np.repeat(owner, len(on))
    kept = (stops >= 0) & (starts < lengths[owner]) & ((stops > 0) | (starts == stops))
    owner, starts, stops = owner[kept], starts[kept], stops[kept]
    return owner, np.maximum(starts, 0.0), np.minimum(stops, lengths[owner])


def dash_segments(ends: Float64Array, pattern: Float64Array, offset: float) -> tuple[Float64Array, Float64Array, Int64Array]:
    """Return the dashes of segments, (N, 2, 2), as segments, (K, 2, 2), with the vector and the number of each one's own."""
    along = ends[:, 1] - ends[:, 0]
    lengths = np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1])
    owner, starts, stops = dash_spans(lengths, pattern, offset)
    share = np.stack([starts, stops], axis=1) / np.maximum(lengths, TINY)[owner][:, None]
    return ends[owner, :1] + share[:, :, None] * along[owner, None], along[owner], owner


def dash_chain(
    points: Float64Array, pattern: Float64Array, offset: float
) -> tuple[Float64Array, Float64Array, list[Float64Array]]:
    """Return the dashes of a chain, (M, 2) without repeats: those within a segment as dash_segments does, others as chains."""
    along = np.diff(points, axis=0)
    lengths = np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1])
    places = np.concatenate([[0.0], np.cumsum(lengths)])
    _, starts, stops = dash_spans(places[-1:], pattern, offset)
    first = np.clip(np.searchsorted(places, starts, "right") - 1, 0, len(along) - 1)
    last = np.clip(np.searchsorted(places, stops, "left") - 1, first, len(along) - 1)

    def at(segment: Int64Array, place: Float64Array) -> Float64Array:
        """Return the points at places along the chain."""
        share: Float64Array = (place - places[segment]) / lengths[segment]
        return points[segment] + share[:, None] * along[segment]

    begins, ends, is_straight = at(first, starts), at(last, stops), first == last
    chains = [
        np.concatenate([begins[k : k + 1], points[first[k] + 1 : last[k] + 1], ends[k : k + 1]])
        for k in np.flatnonzero(~is_straight)
    ]
    return np.stack([begins, ends], axis=1)[is_straight], along[first[is_straight]], chains
