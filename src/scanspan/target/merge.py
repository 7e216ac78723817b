"""Merging: the nearer of two samples, then the lower number.

The merge is associative, commutative and idempotent, so any split of a scene over tiles, threads, files or machines gives the
same picture. It uses the comparison of the writers; there is no second one.
"""

from __future__ import annotations

from scanspan.jit import kernel
from scanspan.raster.write import is_nearer
from scanspan.records import Array


@kernel
def merge_kernel(depth: Array, primitive: Array, other_depth: Array, other_primitive: Array) -> None:
    """Put the nearer of each pair of samples into the first arrays.

    Shapes  four flat arrays of one length; depth -inf and primitive -1 where there is nothing.
    """
    for i in range(depth.shape[0]):
        if is_nearer(other_depth[i], other_primitive[i], depth[i], primitive[i]):
            depth[i] = other_depth[i]
            primitive[i] = other_primitive[i]
