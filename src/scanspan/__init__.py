"""scanspan: a rasterizer for Python. NumPy in, pixels out.

The stages, in the order of the folders: assets (what comes in), geometry (where it is), raster (which samples), shade (what
colour), target (where it lands). `pipeline` is the table of contents.

Names are looked up on first use, so that `import scanspan` costs nothing; numba is imported when a kernel is first needed.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scanspan import color as color
    from scanspan import homogeneous as homogeneous
    from scanspan import lectures as lectures
    from scanspan import splat as splat
    from scanspan.aggregates import aggregate as aggregate
    from scanspan.assets.camera import Camera as Camera
    from scanspan.assets.chunks import open_chunks as open_chunks
    from scanspan.assets.cloud import PointCloud as PointCloud
    from scanspan.assets.light import Light as Light
    from scanspan.assets.load import load as load
    from scanspan.assets.material import Material as Material
    from scanspan.assets.material import Texture as Texture
    from scanspan.assets.mesh import Mesh as Mesh
    from scanspan.assets.polygons import Polygons as Polygons
    from scanspan.assets.scene import Instance as Instance
    from scanspan.assets.scene import Scene as Scene
    from scanspan.assets.shapes import Points as Points
    from scanspan.assets.shapes import Segments as Segments
    from scanspan.canvas import Canvas as Canvas
    from scanspan.drawings import draw as draw
    from scanspan.errors import FormatError as FormatError
    from scanspan.errors import InputError as InputError
    from scanspan.errors import LimitError as LimitError
    from scanspan.errors import ScanspanError as ScanspanError
    from scanspan.geometry.dice import dice as dice
    from scanspan.masks import blocks as blocks
    from scanspan.masks import coverage as coverage
    from scanspan.masks import zones as zones
    from scanspan.pipeline import count as count
    from scanspan.pipeline import interpolate as interpolate
    from scanspan.pipeline import rasterize as rasterize
    from scanspan.pipeline import render as render
    from scanspan.raster.algorithms import ALGORITHMS as ALGORITHMS
    from scanspan.raster.algorithms import ORDERS as ORDERS
    from scanspan.raster.options import OffscreenPoint as OffscreenPoint
    from scanspan.shade.colormap import colorize as colorize
    from scanspan.target.frame import Frame as Frame
    from scanspan.target.save import save as save
    from scanspan.target.visibility import Visibility as Visibility
    from scanspan.target.visibility import merge as merge
    from scanspan.tessellation import triangulate as triangulate
    from scanspan.view.explain import explain as explain

__version__ = "0.1.0"

# Where each public name lives.
_HOMES = {
    "ALGORITHMS": "raster.algorithms",
    "Camera": "assets.camera",
    "Canvas": "canvas",
    "FormatError": "errors",
    "Frame": "target.frame",
    "InputError": "errors",
    "Instance": "assets.scene",
    "Light": "assets.light",
    "LimitError": "errors",
    "Material": "assets.material",
    "Mesh": "assets.mesh",
    "ORDERS": "raster.algorithms",
    "OffscreenPoint": "raster.options",
    "PointCloud": "assets.cloud",
    "Points": "assets.shapes",
    "Polygons": "assets.polygons",
    "Scene": "assets.scene",
    "ScanspanError": "errors",
    "Segments": "assets.shapes",
    "Texture": "assets.material",
    "Visibility": "target.visibility",
    "aggregate": "aggregates",
    "blocks": "masks",
    "colorize": "shade.colormap",
    "count": "pipeline",
    "coverage": "masks",
    "dice": "geometry.dice",
    "draw": "drawings",
    "explain": "view.explain",
    "interpolate": "pipeline",
    "load": "assets.load",
    "merge": "target.visibility",
    "open_chunks": "assets.chunks",
    "rasterize": "pipeline",
    "render": "pipeline",
    "save": "target.save",
    "triangulate": "tessellation",
    "zones": "masks",
}

# Modules that are public as a whole, such as `scanspan.color`.
_MODULES = ("color", "homogeneous", "lectures", "splat")

__all__ = [*_HOMES, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name in _MODULES:
        return importlib.import_module(f"scanspan.{name}")
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'scanspan' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"scanspan.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
