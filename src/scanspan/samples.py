"""Sample positions: where inside a pixel coverage is decided.

One sample lies at the centre; 2, 4, 8 and 16 lie at the standard positions of Direct3D and Vulkan, of which 4, 8 and 16 have
one sample in every row and column of their grid. They are given in sixteenths of a pixel from its top-left corner, so with at
least four sub-pixel bits each is a whole number of sub-pixels.

Source: Vulkan specification, standard sample locations.
"""

from __future__ import annotations

import numpy as np

from scanspan.errors import InputError
from scanspan.records import Int64Array

POSITIONS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((8, 8),),
    2: ((12, 12), (4, 4)),
    4: ((6, 2), (14, 6), (2, 10), (10, 14)),
    8: ((9, 5), (7, 11), (13, 9), (5, 3), (3, 13), (1, 7), (11, 15), (15, 1)),
    16: (
        (9, 9), (7, 5), (5, 10), (12, 7), (3, 6), (10, 13), (13, 11), (11, 3),
        (6, 14), (8, 1), (4, 2), (2, 12), (0, 8), (15, 4), (14, 15), (1, 0),
    ),
}  # fmt: skip


def sample_offsets(samples: int, subpixel_bits: int) -> Int64Array:
    """Return the (S, 2) sample positions (x, y) in sub-pixels from a pixel's top-left corner.

    Raises
    ------
    InputError : if `samples` is not 1, 2, 4, 8 or 16.

    Examples
    --------
    >>> sample_offsets(1, 8)
    array([[128, 128]])
    """
    whole = isinstance(samples, (int, np.integer)) and not isinstance(samples, bool)
    if not whole or samples not in POSITIONS:
        raise InputError(f"samples = {samples!r}: must be one of {', '.join(map(str, POSITIONS))}")
    return np.array(POSITIONS[int(samples)], np.int64) << (subpixel_bits - 4)
