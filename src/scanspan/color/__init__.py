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

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scanspan.color.brightness import intensity as intensity
    from scanspan.color.brightness import luma_601 as luma_601
    from scanspan.color.brightness import luma_709 as luma_709
    from scanspan.color.brightness import luminance as luminance
    from scanspan.color.cylinders import hsi_to_rgb as hsi_to_rgb
    from scanspan.color.cylinders import hsl_to_rgb as hsl_to_rgb
    from scanspan.color.cylinders import hsv_to_rgb as hsv_to_rgb
    from scanspan.color.cylinders import rgb_to_hsi as rgb_to_hsi
    from scanspan.color.cylinders import rgb_to_hsl as rgb_to_hsl
    from scanspan.color.cylinders import rgb_to_hsv as rgb_to_hsv
    from scanspan.color.spaces import D50 as D50
    from scanspan.color.spaces import D65 as D65
    from scanspan.color.spaces import NTSC_PRIMARIES as NTSC_PRIMARIES
    from scanspan.color.spaces import SRGB_PRIMARIES as SRGB_PRIMARIES
    from scanspan.color.spaces import A as A
    from scanspan.color.spaces import C as C
    from scanspan.color.spaces import E as E
    from scanspan.color.spaces import lab_to_rgb as lab_to_rgb
    from scanspan.color.spaces import lab_to_xyz as lab_to_xyz
    from scanspan.color.spaces import linear_to_xyz as linear_to_xyz
    from scanspan.color.spaces import primaries_matrix as primaries_matrix
    from scanspan.color.spaces import rgb_to_lab as rgb_to_lab
    from scanspan.color.spaces import rgb_to_xyz as rgb_to_xyz
    from scanspan.color.spaces import white_xyz as white_xyz
    from scanspan.color.spaces import xyz_to_lab as xyz_to_lab
    from scanspan.color.spaces import xyz_to_linear as xyz_to_linear
    from scanspan.color.spaces import xyz_to_rgb as xyz_to_rgb
    from scanspan.color.transfer import linear_to_srgb as linear_to_srgb
    from scanspan.color.transfer import srgb_to_linear as srgb_to_linear
    from scanspan.color.transfer import to_uint8 as to_uint8
    from scanspan.color.white_balance import adaptation_matrix as adaptation_matrix
    from scanspan.color.white_balance import bradford as bradford
    from scanspan.color.white_balance import grey_world as grey_world
    from scanspan.color.white_balance import shades_of_grey as shades_of_grey
    from scanspan.color.white_balance import von_kries as von_kries
    from scanspan.color.white_balance import white_patch as white_patch
    from scanspan.color.yiq import YIQ_MATRICES as YIQ_MATRICES
    from scanspan.color.yiq import rgb_to_yiq as rgb_to_yiq
    from scanspan.color.yiq import yiq_to_rgb as yiq_to_rgb

# Where each name lives. They are looked up on first use: to read the name of a colour takes none of the models.
_HOMES = {
    "A": "spaces",
    "C": "spaces",
    "D50": "spaces",
    "D65": "spaces",
    "E": "spaces",
    "NTSC_PRIMARIES": "spaces",
    "SRGB_PRIMARIES": "spaces",
    "YIQ_MATRICES": "yiq",
    "adaptation_matrix": "white_balance",
    "bradford": "white_balance",
    "grey_world": "white_balance",
    "hsi_to_rgb": "cylinders",
    "hsl_to_rgb": "cylinders",
    "hsv_to_rgb": "cylinders",
    "intensity": "brightness",
    "lab_to_rgb": "spaces",
    "lab_to_xyz": "spaces",
    "linear_to_srgb": "transfer",
    "linear_to_xyz": "spaces",
    "luma_601": "brightness",
    "luma_709": "brightness",
    "luminance": "brightness",
    "primaries_matrix": "spaces",
    "rgb_to_hsi": "cylinders",
    "rgb_to_hsl": "cylinders",
    "rgb_to_hsv": "cylinders",
    "rgb_to_lab": "spaces",
    "rgb_to_xyz": "spaces",
    "rgb_to_yiq": "yiq",
    "shades_of_grey": "white_balance",
    "srgb_to_linear": "transfer",
    "to_uint8": "transfer",
    "von_kries": "white_balance",
    "white_patch": "white_balance",
    "white_xyz": "spaces",
    "xyz_to_lab": "spaces",
    "xyz_to_linear": "spaces",
    "xyz_to_rgb": "spaces",
    "yiq_to_rgb": "yiq",
}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a name when it is first asked for."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'scanspan.color' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"scanspan.color.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
