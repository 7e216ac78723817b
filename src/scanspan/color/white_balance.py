"""White balance: pictures taken under coloured light, as if the light had been white.

Two kinds. Where nothing is known, the colour of the light is guessed from the picture: `grey_world` takes the mean of all
pixels for grey, `white_patch` the brightest of each channel for white, and `shades_of_grey` is what lies between, a Minkowski
mean. Each channel is then scaled, and the luminance of a grey under that light stays what it was. Where the light is known,
`von_kries` and `bradford` adapt as the eye does: XYZ is turned into the answers of three kinds of cones, each is scaled by the
ratio of the two whites, and turned back. Only the chromaticity of whites counts, not their brightness.

All of it is linear in light, so encoded pixels are decoded first and encoded again; scaling the codes would be wrong. Sums are
exact before they are rounded, so the order of the pixels does not matter. The price is up to a second for a million pixels.

Source: G. Buchsbaum 1980 (grey world); E. Land and J. McCann 1971 (white patch); G. Finlayson and E. Trezzi 2004 (shades of
grey); ICC.1:2010 Annex E (Bradford); B. Lindbloom, Chromatic Adaptation (the cones of Hunt, Pointer and Estevez).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal, localcontext
from itertools import chain

import numpy as np
import numpy.typing as npt

from scanspan.color.brightness import luminance
from scanspan.color.spaces import LINEAR_FROM_XYZ, XYZ_FROM_LINEAR, inverse, transform, white_xyz
from scanspan.color.transfer import LIGHT_OF_CODES, codes_from_linear, linear_from_srgb, srgb_from_linear
from scanspan.color.values import array_of, bounded_values, encoded_values, quote_first
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import finite_number, quote
from scanspan.records import Array, Float64Array

ENCODINGS = ("linear", "srgb")

_CONES = {
    "bradford": np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]),
    "von-kries": np.array([[0.40024, 0.70760, -0.08081], [-0.22630, 1.16532, 0.04570], [0.0, 0.0, 0.91822]]),
}

_CHANNELS = ("red", "green", "blue")

# A channel that holds less than this of the light of the strongest is taken as dark.
_DARK = 1e-12

# Values that are summed at a time.
_BLOCK = 65536


def grey_world(image: npt.ArrayLike, *, encoding: str | None = None) -> Array:
    """Balance a picture so that the mean of its light is grey.

    Parameters
    ----------
    image : (..., 3), mostly (H, W, 3): integers 0..255 are encoded sRGB; floats are linear light, unless `encoding` is "srgb".
    encoding : "linear" or "srgb", what floats are; None for "linear".

    Returns
    -------
    Of the same shape: uint8 for integers, float64 of the same encoding for floats. Linear light is not clamped at 1, sRGB is.
    A picture whose mean is grey comes back as it is, and so does a black one.

    Raises
    ------
    InputError : when the shape, type or encoding is another, a number is out of its range (light below 0 among them), or one or
        two channels are dark throughout.

    Source: G. Buchsbaum, A spatial processor model for object colour perception, 1980.

    >>> grey_world(np.array([[[200, 180, 120], [100, 90, 60]]], dtype=np.uint8)).tolist()
    [[[181, 181, 180], [90, 91, 93]]]
    """
    return _balanced(image, encoding, lambda channel: _minkowski_mean(channel, 1))


def white_patch(image: npt.ArrayLike, *, percentile: float = 100.0, encoding: str | None = None) -> Array:
    """Balance a picture so that the brightest values of its channels make a white.

    Parameters
    ----------
    image, encoding : as for `grey_world`.
    percentile : above 0 to 100: the share of pixels, in percent, that are at or below what is taken as white. 100 is the
        largest value, which one shining pixel decides; 99 is sturdier, and may push the brightest percent out of range.

    Returns
    -------
    As for `grey_world`. A picture whose channels have the same brightest values comes back as it is.

    Raises
    ------
    InputError : as for `grey_world`, and when the percentile is out of its range.

    Source: E. Land and J. McCann, Lightness and Retinex theory, 1971.

    >>> white_patch(np.array([[[1.0, 0.8, 0.5], [0.5, 0.4, 0.25]]])).round(3).tolist()
    [[[0.821, 0.821, 0.821], [0.41, 0.41, 0.41]]]
    """
    share = finite_number("percentile", percentile)
    if not 0.0 < share <= 100.0:
        raise InputError(f"percentile = {percentile}: expected a number above 0, at most 100")
    return _balanced(image, encoding, lambda channel: float(np.percentile(channel, share, method="inverted_cdf")))


def shades_of_grey(image: npt.ArrayLike, *, p: float = 6, encoding: str | None = None) -> Array:
    """Balance a picture so that the Minkowski mean of its light, (mean of x^p)^(1/p), is grey.

    Parameters
    ----------
    image, encoding : as for `grey_world`.
    p : a whole number from 1 to 1000, or infinity. 1 is `grey_world`, infinity is `white_patch`, and 6 is what its authors
        found best.

    Returns
    -------
    As for `grey_world`.

    Raises
    ------
    InputError : as for `grey_world`, and when p is another number.

    Source: G. Finlayson and E. Trezzi, Shades of gray and colour constancy, 2004.

    >>> shades_of_grey(np.array([[[0.6, 0.4, 0.2], [0.3, 0.2, 0.1]]])).round(3).tolist()
    [[[0.428, 0.428, 0.428], [0.214, 0.214, 0.214]]]
    """
    if isinstance(p, float) and p == math.inf:
        return white_patch(image, encoding=encoding)
    power = finite_number("p", p)
    if not (1.0 <= power <= 1000.0 and power.is_integer()):
        raise InputError(f"p = {p}: expected a whole number from 1 to 1000, or infinity")
    return _balanced(image, encoding, lambda channel: _minkowski_mean(channel, int(power)))


def von_kries(
    image: npt.ArrayLike, source_white: npt.ArrayLike, target_white: npt.ArrayLike, *, encoding: str | None = None
) -> Array:
    """Adapt a picture from one light to another in the cones of Hunt, Pointer and Estevez.

    Parameters
    ----------
    image, encoding : as for `grey_world`; linear light may be below 0.
    source_white, target_white : the white under the light of the picture, and what it shall become: (x, y) such as `D65`, or
        (X, Y, Z). To make a pixel grey, take ``rgb_to_xyz(pixel)`` as the source and `D65`, the white of sRGB, as the target.

    Returns
    -------
    As for `grey_world`; linear light is not clamped. With equal whites, the picture as it is, but for the rounding of sRGB
    floats.

    Raises
    ------
    InputError : when the shape, type or encoding is another, a number is out of its range, or a white is none.

    Source: J. von Kries 1902; B. Lindbloom, Chromatic Adaptation.

    >>> from scanspan.color import A, D65, rgb_to_xyz
    >>> card = np.array([[[200, 160, 100]]], dtype=np.uint8)
    >>> von_kries(card, rgb_to_xyz(card[0, 0]), D65).tolist()
    [[[166, 166, 166]]]
    """
    return _adapted(image, adaptation_matrix(source_white, target_white, "von-kries"), encoding)


def bradford(
    image: npt.ArrayLike, source_white: npt.ArrayLike, target_white: npt.ArrayLike, *, encoding: str | None = None
) -> Array:
    """Adapt a picture from one light to another by the Bradford transform, with sharpened cones.

    Parameters
    ----------
    image, encoding, source_white, target_white : as for `von_kries`.

    Returns
    -------
    As for `von_kries`.

    Raises
    ------
    InputError : as for `von_kries`.

    Source: ICC.1:2010 Annex E.

    >>> from scanspan.color import D50, D65
    >>> bradford(np.ones((1, 1, 3)), D65, D50).round(3).tolist()
    [[[1.176, 0.976, 0.722]]]
    """
    return _adapted(image, adaptation_matrix(source_white, target_white, "bradford"), encoding)


def adaptation_matrix(source_white: npt.ArrayLike, target_white: npt.ArrayLike, method: str = "bradford") -> Float64Array:
    """Return the matrix from XYZ under one light to the XYZ that looks the same under another.

    Parameters
    ----------
    source_white, target_white : (x, y) or (X, Y, Z); only the chromaticity counts.
    method : "bradford" or "von-kries".

    Returns
    -------
    (3, 3) float64, which leads from the source white to the target white; the identity when they are equal.

    Raises
    ------
    InputError : when a white is none, is no light that the cones can adapt to, or the method is unknown.

    >>> from scanspan.color import D50, D65
    >>> adaptation_matrix(D65, D50).round(4)
    array([[ 1.0479,  0.0229, -0.0502],
           [ 0.0296,  0.9904, -0.0171],
           [-0.0092,  0.0151,  0.7519]])
    """
    if not isinstance(method, str) or method not in _CONES:
        raise unknown_name("method", method, _CONES)
    cones = _CONES[method]
    answers = []
    for name, white in (("source_white", source_white), ("target_white", target_white)):
        answers.append(transform(cones, white_xyz(white, name)))
        if answers[-1].min() < 1e-3:
            raise InputError(f"{name} = {quote(white)}: too far from white to adapt to")
    ratio = answers[1] / answers[0]
    if (ratio == 1.0).all():
        return np.eye(3)
    return _product(inverse(cones), ratio[:, None] * cones)


def _product(a: Float64Array, b: Float64Array) -> Float64Array:
    """Return the product of two 3 x 3 matrices, which applies `b` first."""
    return transform(a, b.T).T


def _balanced(image: npt.ArrayLike, encoding: str | None, white_of: Callable[[Float64Array], float]) -> Array:
    """Return a picture whose channels are scaled so that a white that is found in each of them becomes grey."""
    light, kind = _decode(image, encoding)
    bad = light < 0.0
    if bad.any():
        raise InputError(f"{quote_first('image', light, bad)}: expected light of 0 or more")
    if not light.any():
        return _encode(light, kind)
    found = np.array([white_of(np.ascontiguousarray(light[..., k]).reshape(-1)) for k in range(3)])
    if not found.any():
        return _encode(light, kind)

    # Refuse to make light where there is none.
    dark = found <= _DARK * found.max()
    if dark.any():
        channel = _CHANNELS[int(np.argmax(dark))]
        raise InputError(f"image has no {channel} light to scale: expected some in every channel, or black")
    return _encode(light * (luminance(found) / found), kind)


def _minkowski_mean(channel: Float64Array, p: int) -> float:
    """Return (mean of x^p)^(1/p), of values of 0 or more, in any order of the values the same."""
    largest = float(channel.max())
    if largest == 0.0:
        return 0.0
    share = channel / largest
    power = np.ones_like(share)
    for digit in bin(p)[2:]:
        power = power * power * share if digit == "1" else power * power
    mean = math.fsum(chain.from_iterable(power[i : i + _BLOCK].tolist() for i in range(0, len(power), _BLOCK))) / len(power)

    # Take the root in decimals, which are the same on every machine.
    with localcontext() as context:
        context.prec = 40
        return largest * float(Decimal(mean) ** (1 / Decimal(p)))


def _adapted(image: npt.ArrayLike, adaptation: Float64Array, encoding: str | None) -> Array:
    """Return a picture whose light is adapted by a matrix of XYZ."""
    light, kind = _decode(image, encoding)
    if not np.array_equal(adaptation, np.eye(3)):
        light = transform(_product(LINEAR_FROM_XYZ, _product(adaptation, XYZ_FROM_LINEAR)), light)
    return _encode(light, kind)


def _decode(image: npt.ArrayLike, encoding: str | None) -> tuple[Float64Array, str]:
    """Return the light of a picture, (..., 3) float64, and what it was: "codes", "srgb" or "linear"."""
    if encoding is not None and (not isinstance(encoding, str) or encoding not in ENCODINGS):
        raise unknown_name("encoding", encoding, ENCODINGS)
    array = array_of("image", image)
    if array.dtype.kind == "f":
        if encoding == "srgb":
            return linear_from_srgb(encoded_values("image", array)), "srgb"
        return bounded_values("image", array), "linear"
    if encoding == "linear":
        raise InputError(f"image has type {array.dtype}, which is encoded sRGB: expected floats for encoding='linear'")
    encoded_values("image", array)
    return LIGHT_OF_CODES[array.astype(np.uint8)], "codes"


def _encode(light: Float64Array, kind: str) -> Array:
    """Return light as what the picture was."""
    if kind == "codes":
        return codes_from_linear(light)
    return np.clip(srgb_from_linear(light), 0.0, 1.0) if kind == "srgb" else light
