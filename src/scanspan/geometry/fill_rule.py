"""Fill rules: whether a place is inside a polygon, from how its rings wind round it. The one home of the five rules.

Source: the OpenGL Utility Library's five winding rules; a ring that is counter-clockwise as seen winds by 1.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import helper_kernel
from scanspan.records import Integer

EVEN_ODD, NON_ZERO, POSITIVE, NEGATIVE, ABS_GEQ_TWO = range(5)


@helper_kernel
def is_filled(fill_rule: int, crossings: Integer, winding: Integer) -> bool:
    """Say whether a place is inside by the edges passed on the way to it: how many, and how many more go down than up."""
    if fill_rule == EVEN_ODD:
        return bool(crossings & 1 != 0)
    if fill_rule == NON_ZERO:
        return bool(winding != 0)
    if fill_rule == POSITIVE:
        return bool(winding > 0)
    if fill_rule == NEGATIVE:
        return bool(winding < 0)
    return bool(max(winding, -winding) >= 2)


@helper_kernel
def winding_limits(fill_rule: int) -> tuple[np.int32, np.int32, np.int32]:
    """Return (mask, below, above) of a rule: inside is where winding & mask is less than `below` or greater than `above`.

    So many places can be asked at once, without a branch. The winding is odd where the number of edges passed is.
    """
    every, never = np.int32(-1), np.int32((1 << 31) - 1)
    if fill_rule == EVEN_ODD:
        return np.int32(1), np.int32(0), np.int32(0)
    if fill_rule == NON_ZERO:
        return every, np.int32(0), np.int32(0)
    if fill_rule == POSITIVE:
        return every, np.int32(-never - 1), np.int32(0)
    if fill_rule == NEGATIVE:
        return every, np.int32(0), never
    return every, np.int32(-1), np.int32(1)
