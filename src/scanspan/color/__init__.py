"""Colour models: what the three numbers of a colour mean, and how to get from one meaning to another.

Two kinds of numbers are called RGB, and most mistakes come from taking one for the other. Here they have different names:

- `rgb` is encoded: sRGB as files, screens and people have it, integers 0..255 or floats 0..1, by type and never by value.
- `linear` is light: floats, 1 is white, more is brighter; `srgb_to_linear` and `linear_to_srgb` lead from one to the other.

So are three kinds of "how bright":

- `luminance` of linear light is what a meter shows (Y of CIE XYZ, weights of Rec. 709);
- `luma_601` and `luma_709` weigh encoded values (Y of YIQ, of JPEG and of video), which is not the same number;
- `intensity` is the plain mean of the three channels (I of HSI), and neither of these is V of HSV, the largest channel.

Every conversion takes (..., 3) and returns (..., 3) float64, the same bits on every machine: nothing here calls a library's
power, sine or arc tangent. The inverse of a matrix is worked out, never typed in.

Source: each module names its own.
"""

from __future__ import annotations

from scanspan.color.brightness import intensity, luma_601, luma_709, luminance
from scanspan.color.cylinders import hsi_to_rgb, hsl_to_rgb, hsv_to_rgb, rgb_to_hsi, rgb_to_hsl, rgb_to_hsv
from scanspan.color.spaces import (
    D50,
    D65,
    NTSC_PRIMARIES,
    SRGB_PRIMARIES,
    A,
    C,
    E,
    lab_to_rgb,
    lab_to_xyz,
    linear_to_xyz,
    primaries_matrix,
    rgb_to_lab,
    rgb_to_xyz,
    white_xyz,
    xyz_to_lab,
    xyz_to_linear,
    xyz_to_rgb,
)
from scanspan.color.transfer import linear_to_srgb, srgb_to_linear, to_uint8
from scanspan.color.white_balance import adaptation_matrix, bradford, grey_world, shades_of_grey, von_kries, white_patch
from scanspan.color.yiq import YIQ_MATRICES, rgb_to_yiq, yiq_to_rgb

__all__ = [
    "D50",
    "D65",
    "NTSC_PRIMARIES",
    "SRGB_PRIMARIES",
    "YIQ_MATRICES",
    "A",
    "C",
    "E",
    "adaptation_matrix",
    "bradford",
    "grey_world",
    "hsi_to_rgb",
    "hsl_to_rgb",
    "hsv_to_rgb",
    "intensity",
    "lab_to_rgb",
    "lab_to_xyz",
    "linear_to_srgb",
    "linear_to_xyz",
    "luma_601",
    "luma_709",
    "luminance",
    "primaries_matrix",
    "rgb_to_hsi",
    "rgb_to_hsl",
    "rgb_to_hsv",
    "rgb_to_lab",
    "rgb_to_xyz",
    "rgb_to_yiq",
    "shades_of_grey",
    "srgb_to_linear",
    "to_uint8",
    "von_kries",
    "white_patch",
    "white_xyz",
    "xyz_to_lab",
    "xyz_to_linear",
    "xyz_to_rgb",
    "yiq_to_rgb",
]
