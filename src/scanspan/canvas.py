"""Canvas: pixels that are painted in order. The 2-D face over the same setup, rule and traversals as everything else.

What comes later lies over what was there. Opaque colours replace, translucent ones are blended in linear light. Shapes own the
pixels whose centres they own, by the top-left rule, so neighbours neither overlap nor leave a gap.
"""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import in_layout
from scanspan.assets.buffers import check_corner_depths, check_screen_triangles, check_target, has_far_values
from scanspan.assets.codes import to_code, to_codes
from scanspan.assets.corner_colors import are_shaded, as_corner_colors, has_alpha, to_corner_codes
from scanspan.assets.lens import check_size
from scanspan.assets.polygon_lists import as_polygon, as_polygons
from scanspan.assets.rings import FILL_RULES, as_points
from scanspan.errors import InputError, LimitError
from scanspan.geometry.fixed_point import MAX_COORDINATE, snap_points
from scanspan.geometry.project import cull_triangles, screen_triangles
from scanspan.geometry.stroke import fan
from scanspan.raster.algorithms import run_kernel
from scanspan.raster.aperture import check_antialias, weigh
from scanspan.raster.area_edges import AREA_BITS
from scanspan.raster.flood import flood_kernel
from scanspan.raster.options import (
    OffscreenPoint,
    check_flag,
    check_integer,
    check_name,
    check_subpixel_bits,
    check_threads,
    sample_centers,
)
from scanspan.raster.segment import DDA, DIAMOND_EXIT, MIDPOINT, RUN_LENGTH, SYMMETRIC, WU
from scanspan.raster.stroke_options import check_extent, check_stroke
from scanspan.records import Float32Array, Float64Array, Int32Array, Sampling, UInt8Array
from scanspan.target.blend import pack_colors, pack_values
from scanspan.target.cover import paint_polygons
from scanspan.target.depth_test import paint_tested
from scanspan.target.few import OVERLAPS, paint_few, plan_triangles
from scanspan.target.fill import FILLS, fill_polygons, paint_runs
from scanspan.target.gouraud import paint_gouraud
from scanspan.target.image import MAX_PIXELS, png_bytes, write_image
from scanspan.target.paint import PAINTERS, SEGMENT_KERNELS, cover_kernel
from scanspan.target.strokes import LINE_BITS, paint_segments, pairs_kernel, snap_segments
from scanspan.target.stroking import cover_points, stroke_chain, stroke_segments
from scanspan.target.triangles import as_words, paint_flat

LINES = {
    "midpoint": MIDPOINT,
    "dda": DDA,
    "symmetric": SYMMETRIC,
    "diamond-exit": DIAMOND_EXIT,
    "run-length": RUN_LENGTH,
    "wu": WU,
}
BLENDS = ("linear", "srgb")


class Canvas:
    """An image to paint on.

    Parameters
    ----------
    width, height : pixels.
    background : a colour; see `parse_color`. White by default.
    blend : "linear", or "srgb" to blend the stored values, as most 2-D tools do.
    threads : by default one for each processor. The pixels are the same for any number.

    Attributes
    ----------
    pixels : (height, width, 4) uint8, sRGB with straight alpha; it may be read and written at any time.
    depth : (height, width) float32, what triangles with `depths` are tested against; the larger the nearer, -inf nothing.

    Raises
    ------
    InputError : for anything that cannot be used; the message quotes it.

    Examples
    --------
    >>> canvas = Canvas(4, 3, "black")
    >>> canvas.triangles([[(0, 0), (4, 0), (0, 3)]], "red")
    >>> canvas.pixels[..., 0].tolist()
    [[255, 255, 255, 0], [255, 255, 0, 0], [255, 0, 0, 0]]
    """

    def __init__(
        self, width: int, height: int, background: Any = "white", *, blend: str = "linear", threads: int | None = None
    ) -> None:
        size = check_size((width, height))
        if size[0] * size[1] > MAX_PIXELS:
            raise LimitError(f"a canvas of {size[0]} x {size[1]} pixels: the limit is {MAX_PIXELS} in all")
        self.pixels: UInt8Array = np.empty((size[1], size[0], 4), np.uint8)
        self.pixels.view(np.int32).fill(to_code(background).view(np.int32)[0])
        self._set_up(blend, threads)

    def _set_up(self, blend: str, threads: int | None, depth: Float32Array | None = None) -> None:
        """Check and keep how to paint."""
        check_name("blend", blend, BLENDS)
        self.blend, self.threads, self._depth = blend, check_threads(threads), depth

    @classmethod
    def from_array(
        cls, pixels: UInt8Array, depth: Float32Array | None = None, *, blend: str = "linear", threads: int | None = None
    ) -> Canvas:
        """Return a canvas that paints into an array in place.

        Parameters
        ----------
        pixels : (H, W, 4) uint8, C-contiguous and writable, sRGB with straight alpha.
        depth : (H, W) float32, the same, the larger the nearer: of a Visibility, or the negative of a Frame's distances.
        blend, threads : as for Canvas.
        """
        check_target("pixels", pixels, np.uint8, ("H", "W", 4))
        check_size((pixels.shape[1], pixels.shape[0]))
        if depth is not None:
            check_target("depth", depth, np.float32, pixels.shape[:2], pixels)
        canvas = cls.__new__(cls)
        canvas.pixels = pixels
        canvas._set_up(blend, threads, depth)
        return canvas

    @property
    def depth(self) -> Float32Array:
        """(height, width) float32, of what was painted with a depth; made when it is first asked for."""
        if self._depth is None:
            self._depth = np.full(self.pixels.shape[:2], -np.inf, np.float32)
        return self._depth

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.pixels.shape[1], self.pixels.shape[0]

    def _target(self, is_opaque: bool) -> tuple[str, NDArray[Any]]:
        """Return the kind of painting and the array that its kernels write."""
        return ("opaque", self.pixels.view(np.int32)[..., 0]) if is_opaque else (self.blend, self.pixels)

    def triangles(
        self, vertices: ArrayLike, colors: Any, *, depths: ArrayLike | None = None, algorithm: str = "half-space",
        rule: str | OffscreenPoint = "top-left", cull: str = "none", antialias: bool = False, overlap: str = "disjoint",
        subpixel_bits: int = 8, nonfinite: str = "error",
    ) -> None:  # fmt: skip
        """Paint triangles in order, each in one colour, or shaded between the colours of its corners.

        Parameters
        ----------
        vertices : (N, 3, 2) corners (x, y) in pixels, y down, within 2^24 pixels.
        colors : one colour for all; or (N, 3) or (N, 4), one for each; or (N, 3, 3) or (N, 3, 4), one for each corner. Integers
            0..255 or floats 0..1. Between corners the given values are interpolated, and rounded half up once.
        depths : (N, 3), one for each corner, the larger the nearer. A pixel is painted where the triangle is nearer than
            `depth` there, which is then its own; of equal depths the first stays. Colours must be opaque.
        algorithm : "half-space", "homogeneous", "edge-walk", "warnock" or "micropolygon"; a sweep does not keep the order, and
            goes together with depths alone. All paint the same pixels.
        rule, cull, subpixel_bits, nonfinite : as for `rasterize`.
        antialias : whether a pixel is blended by the share of it that is covered, exactly; corners are snapped to 1/65536 pixel
            then, the algorithm and the rule have no part in it, and each triangle has one colour.
        overlap : with antialias, "disjoint" or "over", as for `polygons`: by default triangles are taken for a mesh, which has
            no seams.
        """
        name, bits, sampling = plan_triangles(self.size, algorithm, overlap, rule, cull, subpixel_bits, depths is None)
        is_plain = name == "half-space" and antialias is False and nonfinite == "error" and depths is None
        if is_plain and paint_few(self.pixels, vertices, colors, sampling, self.threads):
            return
        corners = check_screen_triangles(vertices, nonfinite, keeps_float32=True)
        is_smooth, is_shaded = check_flag("antialias", antialias), are_shaded(colors)
        if depths is not None:
            self._paint_tested(corners, colors, depths, name, sampling, is_smooth, nonfinite)
            return
        if is_smooth and is_shaded:
            raise InputError("colors: one for each corner, and antialias = True: antialiased triangles have one colour each")
        if is_shaded:
            shades = as_corner_colors(colors, len(corners))
            is_opaque, is_linear = not has_alpha(shades), self.blend == "linear"
            paint_gouraud(self.pixels, corners, shades, name, sampling, is_opaque, is_linear, self.threads)
            return
        codes = to_codes(colors, len(corners))
        if is_smooth:
            corners = in_layout(corners, np.float64)
            kept = cull_triangles(corners, sampling.cull)
            codes = np.broadcast_to(codes, (len(corners), 4))[kept]
            points, starts, rings = as_polygons(corners[kept])
            self._paint_areas(points, starts, rings, "even-odd", codes, overlap)
            return
        kind, target = self._target(bool((codes[..., 3] == 255).all()))
        if name == "half-space" and kind == "opaque":
            paint_flat(target, corners, as_words(codes, len(corners)), sampling, self.threads)
            return
        screen = screen_triangles(in_layout(corners, np.float64), bits)
        screen = screen._replace(depth=np.repeat(np.broadcast_to(pack_colors(codes), len(corners)), 3).astype(np.float64))
        run_kernel(PAINTERS[name][kind], target, screen, sampling, self.threads)

    def _paint_tested(
        self, corners: NDArray[Any], colors: Any, depths: ArrayLike, algorithm: str, sampling: Sampling, is_smooth: bool,
        nonfinite: str,
    ) -> None:  # fmt: skip
        """Paint triangles where they are nearer than what is there."""
        count = len(corners)
        shades = as_corner_colors(colors, count) if are_shaded(colors) else to_corner_codes(to_codes(colors, count), count)
        if is_smooth or has_alpha(shades):
            what = "antialias = True" if is_smooth else "colors that let something through"
            raise InputError(f"depths: a pixel shows one triangle or none, which does not go together with {what}")
        found, kept = check_corner_depths(depths, count, nonfinite)
        if kept is not None:
            corners = np.where(kept[:, None, None], corners, 0.0)
        paint_tested(self.pixels, self.depth, corners, found, shades, algorithm, sampling, self.threads)

    def polygon(
        self, rings: Any, color: Any, *, fill_rule: str = "even-odd", algorithm: str = "scanline",
        antialias: bool | str = False, subpixel_bits: int = 8,
    ) -> None:  # fmt: skip
        """Paint one polygon: convex, concave, with holes, or crossing itself.

        Parameters
        ----------
        rings : one ring, (M, 2) points in pixels, or a list of rings; the closing point may be repeated. Or one polygon of
            shapely or GeoJSON, as `coverage` takes it, in pixels.
        color : any colour.
        fill_rule : "even-odd", "non-zero", "positive", "negative" or "abs-geq-two"; counter-clockwise as seen is positive.
        algorithm : "scanline", with an edge table and an active edge list; "parity", which counts edges at every sample of the
            box; "triangles", cut first and drawn by half-space; "flood", the outline and what it encloses. The first three
            paint the same pixels, but "triangles" may differ at samples within two sub-pixels of edges that cross;
            "flood" paints all pixels of its outline too.
        antialias : whether a pixel is blended by the share of it that is covered, exactly; the algorithm has no part in that. A
            pixel is its square, True or "box", or a softer aperture, "tent" or "gaussian"; see `coverage`.
        subpixel_bits : points are snapped to 1/2^s pixel; to 1/65536 where it is antialiased.
        """
        check_name("fill rule", fill_rule, FILL_RULES)
        check_name("algorithm", algorithm, FILLS)
        bits, code = check_subpixel_bits(subpixel_bits), to_code(color)
        points, starts = as_polygon(rings)
        aperture = check_antialias(antialias)
        if aperture and aperture != "box":
            weighed = weigh(points, starts, FILL_RULES.index(fill_rule), self.size, aperture)
            cover_kernel(self.pixels, weighed, int(pack_colors(code)), int(self.blend == "linear"))
            return
        if aperture:
            self._paint_areas(points, starts, np.array([0, len(starts) - 1], np.int32), fill_rule, code[None], "over")
            return
        xy = snap_points(points, bits)
        sampling = sample_centers(self.size, bits)
        kind, target = self._target(int(code[3]) == 255)
        value, rule = float(pack_colors(code)), FILL_RULES.index(fill_rule)
        FILLS[algorithm](kind, target, xy, starts, rule, value, sampling, self.threads)

    def polygons(
        self, polygons: Any, colors: Any, *, fill_rule: str = "even-odd", algorithm: str = "scanline", antialias: bool = False,
        overlap: str = "over", subpixel_bits: int = 8,
    ) -> None:  # fmt: skip
        """Paint many polygons in order, each in one colour.

        Parameters
        ----------
        polygons : a list of polygons, each as `polygon` takes it; or an array (N, M, 2), a ring of M points for each;
            or those of shapely, GeoPandas or GeoJSON, as `zones` takes them, in pixels.
        colors : one colour for all, or (N, 3) or (N, 4), one for each; integers 0..255 or floats 0..1.
        fill_rule, algorithm, antialias, subpixel_bits : as for `polygon`.
        overlap : what is done where several of them cover a pixel in part. "over": each is laid over those before it, and what
            lies below shows through where two share an edge. "disjoint": they are taken not to overlap; what they cover is
            added up and laid over the pixel once. So a map or a mesh has no seams, whatever lies below it: a tiling whose edges
            match has the pixels of the one shape that it tiles. Where such polygons overlap after all, their colours are
            averaged. It makes no difference to polygons that are not antialiased.

        Raises
        ------
        InputError : for anything that cannot be used; the message quotes it.

        Examples
        --------
        >>> canvas = Canvas(2, 1, "black")
        >>> halves = [[(0, 0), (0.5, 0), (0.5, 1), (0, 1)], [(0.5, 0), (2, 0), (2, 1), (0.5, 1)]]
        >>> canvas.polygons(halves, "white", antialias=True)
        >>> canvas.pixels[0, :, 0].tolist()
        [225, 255]
        >>> canvas.polygons(halves, "white", antialias=True, overlap="disjoint")
        >>> canvas.pixels[0, :, 0].tolist()
        [255, 255]
        """
        check_name("fill rule", fill_rule, FILL_RULES)
        check_name("algorithm", algorithm, FILLS)
        check_name("overlap", overlap, OVERLAPS)
        bits, rule = check_subpixel_bits(subpixel_bits), FILL_RULES.index(fill_rule)
        points, starts, rings = as_polygons(polygons)
        count = len(rings) - 1
        codes = np.broadcast_to(to_codes(colors, count), (count, 4))
        if check_flag("antialias", antialias):
            self._paint_areas(points, starts, rings, fill_rule, codes, overlap)
            return
        xy, values = snap_points(points, bits), pack_colors(codes)
        sampling = sample_centers(self.size, bits)
        kind, target = self._target(bool((codes[:, 3] == 255).all()))
        if algorithm != "scanline":
            for n in range(count):
                ends = starts[rings[n] : rings[n + 1] + 1]
                corners = xy[ends[0] : ends[-1]]
                FILLS[algorithm](kind, target, corners, ends - ends[0], rule, float(values[n]), sampling, self.threads)
        else:
            fill_polygons(kind, target, xy, starts, rings, rule, values, sampling, self.threads)

    def _paint_areas(
        self, points: Float64Array, starts: Int32Array, rings: Int32Array, fill_rule: str, codes: UInt8Array, overlap: str
    ) -> None:
        """Lay polygons over the pixels as far as each is covered."""
        xy, colors = snap_points(points, int(AREA_BITS)), pack_colors(codes).astype(np.int64)
        rule, is_linear = FILL_RULES.index(fill_rule), self.blend == "linear"
        paint_polygons(self.pixels, xy, starts, rings, rule, colors, is_linear, overlap == "disjoint", self.threads)

    def lines(
        self, segments: ArrayLike, colors: Any, *, algorithm: str = "midpoint", antialias: bool = False, width: float = 1.0,
        cap: str = "butt", dash: Any = None, dash_offset: float = 0.0,
    ) -> None:  # fmt: skip
        """Paint segments in order.

        Those of width 1 that are neither antialiased nor dashed nor capped go from pixel to pixel, by `algorithm`. All others
        are strokes, from point to point, and the algorithm has no part in them; pixel (0, 0) has its centre at (0.5, 0.5).

        Parameters
        ----------
        segments : (N, 2, 2) ends in pixels, within 2^24 pixels.
        colors : one colour for all, or (N, 3) or (N, 4).
        algorithm : "midpoint", "dda", "symmetric", "run-length" and "wu" go from the pixel of one end to that of the other,
            both included. On a tie midpoint does not step, dda rounds halves up, and symmetric draws the midpoint line from the
            end with the lower (y, x). Run-length paints what midpoint does, and is quicker for long, nearly level lines. Wu is
            antialiased: two pixels share the colour at each step. "diamond-exit" takes ends between pixels and leaves out the
            last pixel, so that lines that follow each other touch each pixel once.
        antialias : whether a pixel is blended by the share of it that the stroke covers, exactly.
        width : of the stroke in pixels.
        cap : "butt", "round" or "square", as in SVG.
        dash : None, or lengths (on, off, ...) in pixels, as in SVG.
        dash_offset : how far into the dashes a segment begins.
        """
        check_name("algorithm", algorithm, LINES)
        stroke, antialias = check_stroke(width, cap, dash=dash, dash_offset=dash_offset), check_flag("antialias", antialias)
        ends = as_points(segments, (2, 2), "segments")
        codes = to_codes(colors, len(ends))
        if antialias or not stroke.is_plain:
            if algorithm == "wu":
                raise InputError("algorithm = 'wu': its lines are as they are; leave out antialias, width, cap and dash")
            stroke_segments(self.pixels, ends, codes, stroke, antialias, self.blend, self.threads)
            return
        values, rule = pack_values(codes, len(ends)), LINES[algorithm]
        steps = snap_segments(ends, rule)
        if algorithm == "wu":
            paint_segments(self.pixels, steps, values, self.threads, pairs_kernel, int(self.blend == "linear"))
        else:
            kind, target = self._target(bool((codes[..., 3] == 255).all()))
            paint_segments(target, steps, values, self.threads, SEGMENT_KERNELS[kind], rule, LINE_BITS)

    def polyline(
        self, points: ArrayLike, color: Any, *, closed: bool = False, antialias: bool = False, width: float = 1.0,
        cap: str = "butt", join: str = "miter", miter_limit: float = 4.0, dash: Any = None, dash_offset: float = 0.0,
    ) -> None:  # fmt: skip
        """Paint a line through points. Where it crosses itself it is painted once.

        One of width 1 that is neither antialiased nor dashed nor capped is drawn by "diamond-exit", see `lines`, and touches no
        pixel of a corner twice.

        Parameters
        ----------
        points : (M, 2) in pixels, within 2^24 pixels; those that lie on the one before are left out.
        color : any colour.
        closed : whether its last point is joined to its first.
        antialias, width, cap, dash, dash_offset : as for `lines`; dashes go on round corners.
        join : "miter", "round" or "bevel", as in SVG.
        miter_limit : a miter that is longer than so many widths is cut to a bevel.
        """
        closed, antialias = check_flag("closed", closed), check_flag("antialias", antialias)
        stroke = check_stroke(width, cap, join, miter_limit, dash, dash_offset)
        chain, code = as_points(points, (2,), "points"), to_code(color)
        if antialias or not stroke.is_plain:
            stroke_chain(self.pixels, chain, closed, code, stroke, antialias, self.blend, self.threads)
            return
        if closed and len(chain):
            chain = np.concatenate([chain, chain[:1]])
        if len(chain) > 1:
            self.lines(np.stack([chain[:-1], chain[1:]], axis=1), code, algorithm="diamond-exit")

    def points(self, xy: ArrayLike, colors: Any, *, size: float = 1.0, shape: str = "square", antialias: bool = False) -> None:
        """Paint points.

        Parameters
        ----------
        xy : (N, 2) in pixels, within 2^24 pixels.
        colors : one colour for all, or (N, 3) or (N, 4).
        size : side or diameter in pixels; a square of size 1 is always one pixel, unless it is antialiased.
        shape : "square" or "disc"; a pixel is painted if its centre lies in it.
        antialias : whether a pixel is blended instead by the share of it that is covered, exactly.
        """
        check_name("shape", shape, ("square", "disc"))
        centres, extent = as_points(xy, (2,), "xy"), check_extent("size", size)
        codes = to_codes(colors, len(centres))
        if check_flag("antialias", antialias):
            cover_points(self.pixels, centres, codes, extent, shape, self.blend == "linear", self.threads)
            return

        # Leave out those so far away that their rims may lie beyond what is allowed; no image reaches there.
        half = extent / 2
        if has_far_values(centres.reshape(-1), MAX_COORDINATE - half):
            is_near = (np.abs(centres) <= MAX_COORDINATE - half).all(axis=1)
            centres, codes = centres[is_near], codes[is_near] if codes.ndim == 2 else codes

        # Make each a fan of triangles.
        triangles = fan(half, shape)
        corners = (centres[:, None, None] + triangles).reshape(-1, 3, 2)
        self.triangles(corners, codes if codes.ndim == 1 else np.repeat(codes, len(triangles), axis=0))

    def flood_fill(
        self, x: int, y: int, color: Any, *, connectivity: int = 4, tolerance: int = 0, border: Any = None
    ) -> dict[str, int]:
        """Fill from a seed all pixels that are joined to it and have its colour.

        Parameters
        ----------
        x, y : the seed, a pixel.
        color : any colour; it replaces what was there where it is opaque.
        connectivity : 4 neighbours share a side, 8 a side or a corner.
        tolerance : how far each of red, green, blue and alpha may differ from the seed's, 0 to 255.
        border : None, or a colour up to which is filled, whatever lies inside.

        Returns
        -------
        dict : pixels filled, pixels looked at, and spans. Looks are those of a fill that goes from pixel to pixel along
            spans; this one compares whole rows, and fills the same.
        """
        x, y = check_integer("x", x, 0, self.size[0] - 1), check_integer("y", y, 0, self.size[1] - 1)
        if not isinstance(connectivity, (int, np.integer)) or connectivity not in (4, 8):
            raise InputError(f"connectivity = {connectivity!r}: must be 4 or 8")
        limit, code = check_integer("tolerance", tolerance, 0, 255), to_code(color)
        words = self.pixels.view(np.int32)[..., 0]
        alike, counters = words[y, x] if border is None else to_code(border).view(np.int32)[0], np.zeros(3, np.int64)
        runs = flood_kernel(words, x, y, int(alike), limit, border is not None, connectivity == 8, counters)
        kind, target = self._target(int(code[3]) == 255)
        paint_runs(kind, target, runs, float(pack_colors(code)))
        return dict(zip(("filled", "looked_at", "spans"), counters.tolist(), strict=True))

    def save(self, path: str | PathLike[str]) -> None:
        """Write the pixels to a .png, .jpg, .ppm or .npy file."""
        write_image(path, self.pixels)

    def _repr_png_(self) -> bytes:
        """Show the canvas in a notebook."""
        return png_bytes(self.pixels)

    def __repr__(self) -> str:
        return f"Canvas({self.size[0]}, {self.size[1]})"
