"""Blending: a colour laid over a pixel, in linear light or in sRGB values; and the writers that paint pixels.

A canvas is painted in order: what comes later lies over what was there, and nothing is hidden by depth. So a writer that paints
needs a colour where others need a depth, and gets it there: a colour packed into 32 bits is a whole number that a float64 holds
exactly, and the depth of a triangle whose corners are all equally deep is that depth in every sample. Setup, traversals and
trapezoids serve painting without knowing it.

Source: T. Porter and T. Duff, Compositing Digital Images, 1984 (over).
"""

from __future__ import annotations

import numpy as np

from scanspan.color.transfer import STARTS
from scanspan.jit import bare_helper
from scanspan.records import Float64Array, Int32Array, Int64Array, Integer, UInt8Array
from scanspan.shade.color import LINEAR_FROM_SRGB8, THRESHOLDS
from scanspan.shade.srgb import encode_value

LINEAR = np.ascontiguousarray(LINEAR_FROM_SRGB8, np.float32)
ALPHA = np.arange(256, dtype=np.float32) / np.float32(255.0)
ONE, ZERO = np.float32(1.0), np.float32(0.0)


@bare_helper
def blend_channel(over: Integer, under: Integer, share: np.float32, rest: np.float32, is_linear: int) -> int:
    """Return the 8-bit code of a channel, `share` of it the colour above and `rest` the one below.

    Units   over, under: codes; share, rest: float32 that add up to 1.
    """
    if is_linear == 1:
        return encode_value(LINEAR[over] * share + LINEAR[under] * rest, THRESHOLDS, STARTS)
    return int(np.float32(over) * share + np.float32(under) * rest + np.float32(0.5))


@bare_helper
def blend_over(row: UInt8Array, q: int, color: Integer, cover: np.float32, is_linear: int) -> None:
    """Lay a colour over pixel q of a row, as much of it as is covered.

    Shapes  row: (n, 4) uint8, sRGB with straight alpha; color: packed as by `pack_colors`.
    Units   cover: float32, 0..1.
    """
    alpha = ALPHA[color >> 24 & 255] * cover
    behind = ALPHA[np.int64(row[q, 3])] * (ONE - alpha)
    total = alpha + behind
    if total > ZERO:
        share = alpha if total == ONE else alpha / total
        for k in range(3):
            row[q, k] = blend_channel(color >> (8 * k) & 255, np.int64(row[q, k]), share, ONE - share, is_linear)
        row[q, 3] = int(total * np.float32(255.0) + np.float32(0.5))


@bare_helper
def blend_run(
    pixels: UInt8Array, words: Int32Array, start: Integer, end: Integer, color: Integer, cover: np.float32, is_linear: int
) -> None:
    """Lay a colour over a run of pixels of a row, as much of it as is covered of each: the bits that blend_over gives.

    Shapes  pixels: (n, 4) uint8, and words: (n,), the same.
    Units   cover: float32, 0..1, above 0.
    """
    alpha = ALPHA[color >> 24 & 255] * cover
    rest = ONE - alpha
    for x in range(start, end):
        under = np.int64(words[x])
        if under >> 24 == -1:
            # What lies below is opaque, and so is what comes of it: alpha and 1 - alpha add up to 1 in float32.
            red = blend_channel(color & 255, under & 255, alpha, rest, is_linear)
            green = blend_channel(color >> 8 & 255, under >> 8 & 255, alpha, rest, is_linear)
            blue = blend_channel(color >> 16 & 255, under >> 16 & 255, alpha, rest, is_linear)
            words[x] = np.int32((red | green << 8 | blue << 16) - (1 << 24))
        else:
            blend_over(pixels, x, color, cover, is_linear)


@bare_helper
def write_sample_paint(row: Int32Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Put an opaque colour, packed into the depth, into a row of pixels of 32 bits.

    A masked store: to select would read and write back what is not painted, at twice the time where triangles are small.
    """
    color = np.int64(depth)
    if inside:
        row[q] = np.int32(color - (color >> 31 << 32))


@bare_helper
def fetch_none(
    values: Int32Array, listed: Int64Array, start: Integer, count: Integer, floats: Float64Array, codes: UInt8Array
) -> None:
    """Fetch nothing for scan_flat: one value is at hand when it is asked for."""


@bare_helper
def set_up_none(floats: Float64Array, codes: UInt8Array, count: Integer, unit: float) -> None:
    """Set nothing up for scan_flat."""


@bare_helper
def one_word(values: Int32Array, n: Integer, floats: Float64Array, k: Integer) -> np.int32:
    """Return what scan_flat writes for a triangle of one value: the value."""
    word: np.int32 = values[n]
    return word


@bare_helper
def write_word(
    flat: Int32Array, at: Integer, inside: bool, word: np.int32, i: Integer, j: Integer, e1: Integer, e2: Integer
) -> None:
    """Put an opaque colour as it is stored, or a number, into an image of 32 bits; a masked store, as above."""
    if inside:
        flat[at] = word


@bare_helper
def write_sample_linear(row: UInt8Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Blend a colour, packed into the depth, into a row of pixels in linear light."""
    if inside:
        blend_over(row, q, np.int64(depth), ONE, 1)


@bare_helper
def write_sample_srgb(row: UInt8Array, q: int, inside: bool, depth: float, number: Integer) -> None:
    """Blend a colour, packed into the depth, into a row of pixels in sRGB values."""
    if inside:
        blend_over(row, q, np.int64(depth), ONE, 0)


def pack_values(codes: UInt8Array, count: int) -> Float64Array:
    """Return `count` packed colours of codes, (4,) for all or (count, 4)."""
    return np.full(count, pack_colors(codes)) if codes.ndim == 1 else pack_colors(codes)


def pack_colors(colors: UInt8Array) -> Float64Array:
    """Return (..., 4) uint8 colours as whole numbers of 32 bits, red lowest, in float64 as depths are."""
    packed: Float64Array = np.ascontiguousarray(colors).view("<u4")[..., 0].astype(np.float64)
    return packed
