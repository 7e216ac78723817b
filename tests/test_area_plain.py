"""Areas, meshes and shaded triangles: the same bits compiled and as plain Python, with every warning an error."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

SCENE = """
import hashlib, warnings
warnings.simplefilter("error")
import numpy as np
import scanspan as ss

rng, digest, size = np.random.default_rng(4), hashlib.sha256(), (9, 7)
shapes = [rng.uniform(-3, 12, (7, 2)), rng.integers(-2, 12, (6, 2)) * 1.0, rng.uniform(-1e6, 1e6, (4, 2))]
for shape in shapes:
    for aperture in ("box", "tent", "gaussian"):
        for rule in ("even-odd", "non-zero"):
            shown = size if aperture != "gaussian" else (3, 2)
            digest.update(ss.coverage(shape, shown, mode="area", aperture=aperture, fill_rule=rule).tobytes())
for blend in ("linear", "srgb"):
    canvas = ss.Canvas(*size, "teal", blend=blend, threads=1)
    canvas.polygon(shapes[0], (9, 200, 30, 100), antialias=True)
    canvas.polygon(shapes[1], "red", antialias="tent")
    canvas.polygons(shapes, [(200, 3, 9, 255), (1, 2, 3, 40), (90, 90, 90, 128)], antialias=True, overlap="disjoint")
    canvas.polygons(shapes, (3, 200, 90, 80))
    canvas.triangles(rng.uniform(-2, 11, (5, 3, 2)), rng.integers(0, 256, (5, 3, 4)).astype(np.uint8))
    canvas.triangles(rng.uniform(-2, 11, (5, 3, 2)), rng.uniform(0, 1, (5, 3, 3)))
    canvas.triangles(rng.uniform(-2, 11, (5, 3, 2)), rng.integers(0, 256, (5, 4)).astype(np.uint8), antialias=True, cull="back")
    digest.update(canvas.pixels.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow
def test_kernels_give_the_same_bits_uncompiled():
    digests = set()
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        ended = subprocess.run([sys.executable, "-c", SCENE], env=environment, capture_output=True, text=True, timeout=300)
        assert ended.returncode == 0, ended.stderr
        digests.add(ended.stdout)
    assert len(digests) == 1
