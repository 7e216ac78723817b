"""The kernels that encode linear light to 8-bit sRGB, one table look-up and one comparison a value.

Source: IEC 61966-2-1; the tables are made in color.py.
"""

from __future__ import annotations

import numpy as np

from scanspan.jit import bare_helper, kernel
from scanspan.records import Float32Array, UInt8Array


@bare_helper
def encode_value(light: float, thresholds: Float32Array, starts: UInt8Array) -> int:
    """Return the 8-bit code of one value of light.

    Shapes  thresholds: (256,) float32. starts: (4097,) uint8.
    Units   linear light, 0..1; what is outside is clamped, NaN gives 0.
    Needs   the tables of color.py; light a float32.
    Cost    two look-ups.
    """
    value = light if light > np.float32(0.0) else np.float32(0.0)
    value = value if value < np.float32(1.0) else np.float32(1.0)
    code = int(np.int64(starts[int(value * np.float32(4096.0))]))
    return code + int(value >= thresholds[code])


@kernel
def encode_values(light: Float32Array, thresholds: Float32Array, starts: UInt8Array, codes: UInt8Array) -> None:
    """Encode many values of light.

    Shapes  light: (n,) float32. thresholds: (256,). starts: (4097,). codes: (n,) uint8, written.
    Units   linear light, 0..1.
    Cost    O(n), about a nanosecond a value.
    """
    for i in range(len(light)):
        codes[i] = encode_value(light[i], thresholds, starts)
