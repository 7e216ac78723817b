"""From samples to pixels: average, lay over the background, and encode as 8-bit sRGB.

The average is taken in linear light, where half a pixel of white over black is half the light, and so 188 and not 128. A
pixel in which nothing was drawn is the background to the bit, and a picture of one colour comes out as exactly that colour:
sums of equal values are off by an ulp of float32, and the nearest change of code is thousands of them away.

`blend="srgb"` averages and composites the sRGB values instead, as tools without linear blending do; the samples and the
background then hold sRGB values.

Source: T. Porter and T. Duff, Compositing Digital Images, 1984 (over).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scanspan.color.names import parse_color
from scanspan.color.transfer import STARTS, linear_from_srgb
from scanspan.errors import InputError, unknown_name
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Float32Array, UInt8Array
from scanspan.shade.color import THRESHOLDS
from scanspan.shade.srgb import encode_value

BLENDS = ("linear", "srgb")

# A sky of early morning behind clay: light enough that nothing merges into it, grey enough that no colour is tinted by it.
DEFAULT_BACKGROUND = ((242, 245, 249), (190, 200, 212))


def background(spec: Any, size: tuple[int, int], blend: str = "linear") -> Float32Array:
    """Return a background as an array that `resolve` lays the samples over.

    Parameters
    ----------
    spec : None for a soft vertical gradient, a colour as `parse_color` reads it ("transparent" among them), or a pair of
        colours (top, bottom) for a gradient.
    size : (width, height) in pixels.
    blend : "linear" or "srgb", as for `resolve`.

    Returns
    -------
    (1, 1, 4) or (height, 1, 4) float32 with straight alpha, linear light, or sRGB values where blend is "srgb".

    Raises
    ------
    InputError : when a colour is none.

    >>> background("white", (640, 480)).tolist()
    [[[1.0, 1.0, 1.0, 1.0]]]
    >>> background(None, (640, 480)).shape
    (480, 1, 4)
    """
    if blend not in BLENDS:
        raise unknown_name("blend", blend, BLENDS)
    if spec is None:
        spec = DEFAULT_BACKGROUND
    if not _is_pair(spec):
        return _to_blend(parse_color(spec), blend).reshape(1, 1, 4)

    # Step from the first row, the upper colour, to the last, the lower one, in even steps of sRGB, weighted by alpha.
    top, bottom = (parse_color(color) for color in spec)
    share = np.arange(size[1], dtype=np.float64)[:, None] / max(1, size[1] - 1)
    weights = np.concatenate([top[3] * (1.0 - share), bottom[3] * share], axis=1)
    alpha = weights[:, 0:1] + weights[:, 1:2]
    colors = (top[:3] * weights[:, 0:1] + bottom[:3] * weights[:, 1:2]) / np.where(alpha > 0.0, alpha, 1.0)
    rows = np.concatenate([colors, alpha], axis=1)
    return _to_blend(rows, blend).reshape(-1, 1, 4)


def _is_pair(spec: Any) -> bool:
    """Say whether a background is two colours rather than one."""
    return not isinstance(spec, str) and hasattr(spec, "__len__") and len(spec) == 2


def _to_blend(colors: np.ndarray[Any, np.dtype[np.float64]], blend: str) -> Float32Array:
    """Return sRGB colours in the values that are blended."""
    values = colors.copy()
    if blend == "linear":
        values[..., :3] = linear_from_srgb(colors[..., :3])
    return values.astype(np.float32)


def resolve(accumulated: Float32Array, samples: int, background: Float32Array, blend: str = "linear") -> UInt8Array:
    """Average the samples of each pixel, lay them over a background, and encode.

    Parameters
    ----------
    accumulated : (H, W, 4) float32, the sum over the samples of a pixel of premultiplied colour and alpha.
    samples : how many there are in each pixel.
    background : (H, W, 4), (H, 1, 4) or (1, 1, 4) float32 with straight alpha, as `background` makes it.
    blend : "linear" for linear light, or "srgb" where both arrays hold sRGB values.

    Returns
    -------
    (H, W, 4) uint8, sRGB with straight alpha.

    Raises
    ------
    InputError : when a shape does not fit, the samples are not at least one, or the blend is unknown.

    >>> half = np.full((1, 1, 4), 0.5, dtype=np.float32)
    >>> resolve(half, 1, np.array([[[0, 0, 0, 1]]], dtype=np.float32))[0, 0].tolist()
    [188, 188, 188, 255]
    """
    if blend not in BLENDS:
        raise unknown_name("blend", blend, BLENDS)
    values, behind = np.asarray(accumulated), np.asarray(background)
    if values.ndim != 3 or values.shape[2] != 4 or values.dtype.kind != "f":
        raise InputError(f"accumulated has shape {values.shape} and type {values.dtype}: expected floats of shape (H, W, 4)")
    height, width = values.shape[:2]
    fits = behind.ndim == 3 and behind.shape[0] in (1, height) and behind.shape[1] in (1, width) and behind.shape[2] == 4
    if not fits or behind.dtype.kind != "f":
        raise InputError(
            f"background has shape {behind.shape} and type {behind.dtype}: expected floats of ({height}, {width}, 4)"
        )
    if isinstance(samples, bool) or not isinstance(samples, (int, np.integer)) or samples < 1:
        raise InputError(f"samples = {samples!r}: expected a whole number above 0")
    pixels = np.empty((height, width, 4), dtype=np.uint8)
    values = np.require(values, dtype=np.float32, requirements=["C", "A", "W"])
    behind = np.require(behind, dtype=np.float32, requirements=["C", "A", "W"])
    share = np.float32(1.0 / float(samples))
    resolve_rows(values, share, behind, int(blend == "linear"), THRESHOLDS, STARTS, pixels)
    return pixels


@kernel
def resolve_rows(
    accumulated: Float32Array,
    share: np.float32,
    background: Float32Array,
    is_linear: int,
    thresholds: Float32Array,
    starts: UInt8Array,
    pixels: UInt8Array,
) -> None:
    """Resolve some rows of an image.

    Shapes  accumulated: (h, w, 4) float32, premultiplied sums. background: (h or 1, w or 1, 4) float32, straight alpha.
            thresholds: (256,), starts: (4097,), as in color.py. pixels: (h, w, 4) uint8, written.
    Units   share: float32, one over the number of samples. is_linear 1: linear light, to be encoded; 0: sRGB values.
    Needs   shapes that fit.
    Cost    O(pixels), two to three nanoseconds a channel.
    Source: Porter and Duff 1984.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    row_step = 1 if background.shape[0] > 1 else 0
    column_step = 1 if background.shape[1] > 1 else 0
    r0, r1, r2, r3 = 0, 0, 0, 0
    for y in range(accumulated.shape[0]):
        for x in range(accumulated.shape[1]):
            row, column = y * row_step, x * column_step
            b0, b1, b2, b3 = (
                background[row, column, 0], background[row, column, 1], background[row, column, 2], background[row, column, 3]
            )  # fmt: skip

            # Encode the background once a row where it is the same along the row.
            if x == 0 or column_step == 1:
                r0 = encode_channel(b0, is_linear, thresholds, starts)
                r1 = encode_channel(b1, is_linear, thresholds, starts)
                r2 = encode_channel(b2, is_linear, thresholds, starts)
                r3 = encode_channel(b3, 0, thresholds, starts)
            cover = accumulated[y, x, 3] * share
            if not cover > zero:
                pixels[y, x, 0], pixels[y, x, 1], pixels[y, x, 2], pixels[y, x, 3] = r0, r1, r2, r3
                continue

            # Lay the samples over it; divide by alpha only where that is not one.
            through = (one - cover if cover < one else zero) * b3
            alpha = cover + through
            scale = one / alpha if alpha < np.float32(0.99999) else one
            red = (accumulated[y, x, 0] * share + b0 * through) * scale
            green = (accumulated[y, x, 1] * share + b1 * through) * scale
            blue = (accumulated[y, x, 2] * share + b2 * through) * scale
            pixels[y, x, 0] = encode_channel(red, is_linear, thresholds, starts)
            pixels[y, x, 1] = encode_channel(green, is_linear, thresholds, starts)
            pixels[y, x, 2] = encode_channel(blue, is_linear, thresholds, starts)
            pixels[y, x, 3] = encode_channel(alpha, 0, thresholds, starts)


@helper_kernel
def encode_channel(value: float, is_linear: int, thresholds: Float32Array, starts: UInt8Array) -> int:
    """Return the 8-bit code of a value: linear light by the curve of sRGB, sRGB values and alpha by rounding.

    Units   value: float32, 0..1; what is outside is clamped, NaN gives 0.
    Needs   the tables of color.py.
    """
    if is_linear == 1:
        return encode_value(value, thresholds, starts)
    clamped = value if value > np.float32(0.0) else np.float32(0.0)
    clamped = clamped if clamped < np.float32(1.0) else np.float32(1.0)
    return int(clamped * np.float32(255.0) + np.float32(0.5))
