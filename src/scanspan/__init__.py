"""scanspan: a rasterizer for Python. NumPy in, pixels out.

The stages, in the order of the folders: assets (what comes in), geometry (where it is), raster (which samples), shade (what colour),
target (where it lands). `pipeline` is the table of contents.

Names are looked up on first use, so that `import scanspan` costs nothing; numba is imported when a kernel is first needed.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scanspan.pipeline import count as count
    from scanspan.pipeline import interpolate as interpolate
    from scanspan.pipeline import rasterize as rasterize
    from scanspan.raster.options import OffscreenPoint as OffscreenPoint

__version__ = "0.1.0"

# Where each public name lives.
_HOMES = {
    "OffscreenPoint": "raster.options",
    "count": "pipeline",
    "interpolate": "pipeline",
    "rasterize": "pipeline",
}

__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'scanspan' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"scanspan.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
