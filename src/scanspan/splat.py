"""Splats in a hierarchy: a tree of points is built once, and then as much of it is drawn as can be seen.

A tree is drawn block by block: the cut says which, culling and going down until an error in pixels is met (geometry/cut.py);
blocks are decoded once and kept; what is seen is shaded afterwards. The same tree, camera and error give the same picture to
the byte, for any number of threads, whatever is kept.

Refining draws the splats of that same cut in passes, each spread over the whole picture, into the same keys. A key only
comes nearer, so no pixel goes back to the background, nothing is drawn or read twice, and the last pass leaves the picture that
`render` makes (docs/decisions/0018-splats-on-the-screen.md says what else was tried).

Source: S. Rusinkiewicz and M. Levoy, QSplat (2000).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from os import PathLike
from typing import Any, NamedTuple

import numpy as np

from scanspan.assets.camera import Camera
from scanspan.assets.framing import parse_up
from scanspan.assets.material import Material
from scanspan.assets.splats import tree as stored
from scanspan.assets.splats.cache import MAX_BYTES, STRIDES, BlockCache
from scanspan.errors import InputError
from scanspan.geometry.cut import Cut, NodeColumns, SplatView, cut_tree, node_columns, splat_view
from scanspan.homogeneous import quote
from scanspan.pipeline import MAX_PIXELS, check_pixels
from scanspan.raster.options import check_integer, check_name, check_number, check_threads
from scanspan.records import Float32Array, Float64Array, Int64Array
from scanspan.shade.cloud_colors import limits_of
from scanspan.shade.color import linear_color
from scanspan.shade.light import default_lights
from scanspan.shade.splats import Look
from scanspan.target.resolve import background as make_background
from scanspan.target.splat_frame import Progress, SplatFrame
from scanspan.target.splat_picture import SplatPicture

LARGEST_ERROR = 1e6  # pixels
CULLS = ("none", "back")
LEAST_BUDGET = 256  # splats: those of the root are drawn at least
POINTS_TO_FRAME = 1 << 14  # splats at least, that tell a camera how far a tree reaches
PAGES_BYTES = 32 << 20  # of pages that are kept while their blocks are taken from them
MOST_COARSE = 1 << 17  # splats that fill what is missing when time is up
FEW_PAGES = 64  # of which none is worth waiting for less
BLOCKS_AT_ONCE = 1 << 10  # drawn between two looks at the clock


class Request(NamedTuple):
    """What is to be drawn, all checked."""

    camera: Camera
    size: tuple[int, int]
    error: float
    budget: int | None
    turns_away: bool  # whether blocks that face away from the eye are left out
    threads: int
    look: Look
    behind: Float32Array  # as target/resolve.py has it
    started: float


class SplatTree(stored.SplatTree):
    """A tree of splats that can be drawn; `build` and `open` make one.

    Attributes
    ----------
    nodes : (M,) structured, the table of nodes, root first.
    origin : (3,) float64, what places are relative to.
    has_color, has_normals : whether splats have these.
    up : the direction that is up, "+Z" unless it is set.
    """

    up = "+Z"
    _state: _State

    @classmethod
    def of(cls, tree: stored.SplatTree, max_bytes: int = MAX_BYTES) -> SplatTree:
        """Return a stored tree as one that can be drawn; at most `max_bytes` of its splats are kept decoded."""
        drawn = cls.__new__(cls)
        drawn.__dict__.update(tree.__dict__)
        drawn._state = _State(tree, max_bytes)
        return drawn

    @property
    def points(self) -> Float64Array:
        """(N, 3) some thousand places that tell how far it reaches, for `Camera.frame`."""
        return self._state.outline()

    def render(
        self, camera: Camera | str | None = None, size: tuple[int, int] = (1280, 960), *, error: float = 1.0,
        budget: int | None = None, cull: str = "none", background: Any = None, up: str | None = None,
        threads: int | None = None, max_pixels: int = MAX_PIXELS,
    ) -> SplatFrame:  # fmt: skip
        """Draw the tree.

        Parameters
        ----------
        camera : a Camera, or the name of a direction from which the tree fills the picture; None is "iso".
        size : (width, height) in pixels.
        error : pixels by which anything may lie beside where it is drawn; smaller draws more splats, 0 all that may be seen.
        budget : most splats to draw, 256 or more: the error is raised until they are no more. `frame.error` says what was met.
        cull : "back" leaves out blocks whose normals all point away from the eye, where a tree has normals that point outwards:
            half the work for closed surfaces, and wrong for others. "none" draws both sides.
        background, up, max_pixels : as for `scanspan.render`.
        threads : by default one for each processor. The picture is the same for any number.

        Raises
        ------
        InputError : for anything that cannot be used; the message quotes it.

        Examples
        --------
        >>> import numpy as np, scanspan as ss
        >>> tree = ss.splat.build(np.random.default_rng(1).random((1000, 3)))
        >>> frame = tree.render("front", (64, 48))
        >>> frame.color.shape, frame.splats
        ((48, 64, 4), 1000)
        """
        request = self._request(camera, size, error, budget, cull, background, up, threads, max_pixels)
        return self._state.render(request)

    def refine(
        self, camera: Camera | str | None = None, size: tuple[int, int] = (1280, 960), *, error: float = 1.0,
        deadline: float | None = None, budget: int | None = None, cull: str = "none", background: Any = None,
        up: str | None = None, threads: int | None = None, max_pixels: int = MAX_PIXELS,
    ) -> Iterator[SplatFrame]:  # fmt: skip
        """Draw the tree in passes, each of which makes the picture better; the last one is what `render` returns.

        A pixel that shows something is never background again; blocks are read and drawn once. `frame.error` says how near to
        something drawn everything is that could be seen, inf while parts are missing altogether; `frame.splats` and
        `frame.bytes_read` say what it took. Which splats come first depends on what has been read already.

        Parameters
        ----------
        deadline : seconds from now. When they are over, coarse splats fill what is missing, and that is the last frame.
        others : as for `render`.

        Raises
        ------
        InputError : for anything that cannot be used; the message quotes it.

        Examples
        --------
        >>> import numpy as np, scanspan as ss
        >>> tree = ss.splat.build(np.random.default_rng(1).random((20000, 3)))
        >>> frames = list(tree.refine("front", (64, 48)))
        >>> bool((frames[-1].color == tree.render("front", (64, 48)).color).all())
        True
        """
        seconds = None if deadline is None else check_number("deadline", deadline, 0, 1e9)
        request = self._request(camera, size, error, budget, cull, background, up, threads, max_pixels)
        return self._state.refine(request, seconds)

    def _request(
        self, camera: Any, size: Any, error: Any, budget: Any, cull: Any, background: Any, up: Any, threads: Any,
        max_pixels: int,
    ) -> Request:  # fmt: skip
        """Check what is to be drawn."""
        started = time.perf_counter()
        pixels = check_pixels(size, max_pixels)
        limit = check_number("error", error, 0, LARGEST_ERROR)
        most = None if budget is None else check_integer("budget", budget, LEAST_BUDGET, 2**62)
        check_name("cull", cull, CULLS)
        workers, behind = check_threads(threads), make_background(background, pixels)
        sky = parse_up(self.up if up is None else up)
        if not isinstance(camera, Camera):
            if camera is not None and not isinstance(camera, str):
                raise InputError(f"camera = {quote(camera)}: expected a Camera or the name of a direction")
            aspect = pixels[0] / pixels[1]
            camera = Camera.frame(self, "iso" if camera is None else camera, up=sky, aspect=aspect, fit="points")
        low, high = self._state.heights(sky)
        look = Look(linear_color(Material().color_of(False)), default_lights(camera.view, sky), sky, low, high)
        return Request(camera, pixels, limit, most, cull == "back", workers, look, behind, started)


class _State:
    """What is kept of a tree between two pictures: columns of the table of nodes, and decoded blocks."""

    def __init__(self, tree: stored.SplatTree, max_bytes: int) -> None:
        self.tree = tree
        self.cache = BlockCache(tree, max_bytes)
        self.columns: NodeColumns = node_columns(tree.nodes)
        self._outline: Float64Array | None = None

    def outline(self) -> Float64Array:
        """Return the splats of the coarsest level that has enough of them."""
        if self._outline is None:
            nodes, level = self.tree.nodes, 0
            while level + 1 < self.tree.level_count and self.columns.splats[nodes["level"] == level].sum() < POINTS_TO_FRAME:
                level += 1
            chosen = np.flatnonzero((nodes["level"] == level) | ((nodes["level"] < level) & (nodes["children"] == 0)))
            blocks = self.tree.read_many(chosen)
            each = np.repeat(chosen, np.diff(blocks.starts))
            self._outline = self.tree.origin + nodes["low"][each] + nodes["step"][each] * blocks.splats.positions
        return self._outline

    def heights(self, up: Float64Array) -> tuple[float, float]:
        """Return between which heights all but a few splats lie, in the tree's coordinates; (0, 1) where colours tell more."""
        if self.tree.has_color or self.tree.has_normals:
            return 0.0, 1.0
        x, y, z = (self.outline() - self.tree.origin).T
        return limits_of((x * up[0] + y * up[1]) + z * up[2])

    def cut(self, request: Request) -> tuple[SplatView, Cut]:
        """Return the blocks to draw."""
        view = splat_view(request.camera, request.size, self.tree.origin)
        return view, cut_tree(self.columns, view, request.error, request.budget, turns_away=request.turns_away)

    def render(self, request: Request) -> SplatFrame:
        """Draw the tree."""
        view, cut = self.cut(request)
        with self.cache.lock:
            before = self.cache.bytes_read
            picture = SplatPicture(self.cache, self.columns, request.camera, request.size, cut.nodes, view, request.threads)
            picture.draw(np.arange(len(cut.nodes)))
            return self._frame(picture, request, picture.keys, before, cut.error, True)

    def refine(self, request: Request, deadline: float | None) -> Iterator[SplatFrame]:
        """Draw the tree in passes; see SplatTree.refine."""
        view, cut = self.cut(request)
        count, before = len(cut.nodes), self.cache.bytes_read
        coarse = self._coarse_cut(request, view, cut) if deadline is not None else cut._replace(nodes=cut.nodes[:0])
        nodes = np.append(cut.nodes, coarse.nodes)
        picture = SplatPicture(self.cache, self.columns, request.camera, request.size, nodes, view, request.threads)
        plan, touched, bound = self._plan(cut), 0, float(np.inf)
        for number, (rows, first_pass, last_pass) in enumerate(plan):
            gap, is_last, touched = 0.0, number == len(plan) - 1, touched + (len(rows) if first_pass == 0 else 0)
            for first in range(0, len(rows), BLOCKS_AT_ONCE):
                part = rows[first : first + BLOCKS_AT_ONCE]
                with self.cache.lock:
                    picture.draw(part, first_pass, last_pass)
                    gap = gap if is_last else max(gap, picture.gap(part, last_pass))
                is_done = is_last and first + BLOCKS_AT_ONCE >= len(rows)
                if deadline is not None and time.perf_counter() - request.started >= deadline and not is_done:
                    with self.cache.lock:
                        picture.draw(np.arange(count, len(nodes)))
                        frame = self._frame(picture, request, picture.keys, before, coarse.error, False)
                    yield frame
                    return
            bound = cut.error if is_last else min(bound, gap + cut.error) if touched == count else bound
            with self.cache.lock:
                keys = picture.keys if is_last else picture.keys.copy()
                frame = self._frame(picture, request, keys, before, bound, is_last)
            yield frame

    def _plan(self, cut: Cut) -> list[tuple[Int64Array, int, int]]:
        """Return what each frame of a refinement adds: rows of the cut, and the first and last pass that is drawn of them.

        What has been read is drawn in passes through the splats of all blocks. What has not is read page by page, those first
        that are spread over the whole, so that the first frame need not wait for all of them.
        """
        rows, last = np.arange(len(cut.nodes)), len(STRIDES) - 1
        pages, place = np.unique(self.tree.nodes["page"][cut.nodes], return_inverse=True)
        if not len(rows):
            return [(rows, 0, last)]
        if len(pages) < FEW_PAGES or 2 * self.cache.missing(cut.nodes) <= cut.splats:
            return [(rows, number, number) for number in range(len(STRIDES))]
        first, second = place % STRIDES[1] == 0, place % STRIDES[2] == 0
        rest = rows[~second]
        return [(rows[first], 0, last), (rows[second & ~first], 0, last), (rest, 0, last - 1), (rest, last, last)]

    def _coarse_cut(self, request: Request, view: SplatView, cut: Cut) -> Cut:
        """Return blocks of a sixteenth as many splats or fewer, to fill what is missing when time is up."""
        budget = max(LEAST_BUDGET, min(cut.splats // 16, MOST_COARSE))
        return cut_tree(self.columns, view, cut.error, budget, turns_away=request.turns_away)

    def _frame(
        self, picture: SplatPicture, request: Request, keys: Int64Array, before: int, error: float, is_final: bool
    ) -> SplatFrame:
        """Return the picture as it is now."""
        color = picture.color(request.look, request.behind)
        seconds = time.perf_counter() - request.started
        progress = Progress(error, picture.splats, self.cache.bytes_read - before, seconds, is_final)
        return SplatFrame(color, keys, picture.nodes, self.cache, request.camera, request.size, progress)


def build(
    points: Any, path: str | PathLike[str] | None = None, *, normals: str = "given", exact: bool = False,
    max_memory: str | int = "512MB", resume: bool = False, nonfinite: str = "error",
    progress: Callable[[str, int, int], None] | None = None,
) -> SplatTree:  # fmt: skip
    """Build a tree of splats from points of any number, in bounded memory.

    Parameters
    ----------
    points : a path of a file of points, a PointCloud, an array (N, 3), a Mesh (its vertices), a dict of what PointCloud takes
        and "radius" (N,), or an iterator of pieces of these.
    path : the file to write; None keeps the tree in memory, however large it is.
    normals : "given" keeps those of the points; "none" leaves them out; "estimate" finds them from neighbours.
    exact : whether points keep the whole numbers that they have in their file, where those of a block fit in 16 bits; else they
        are rounded to a tenth of what the classic format rounds to.
    max_memory : bytes, or a text such as "512MB"; 256 MB at least.
    resume : go on with a build to the same path that was cut off.
    nonfinite : "error" raises for a point that is not finite, "drop" leaves it out.
    progress : called with what is being done, how many points are done, and how many there are, or 0 while that is not known.

    Raises
    ------
    InputError : points or options that cannot be used.
    FormatError : a file of points that cannot be read, or a build that cannot be gone on with.

    Examples
    --------
    >>> import numpy as np
    >>> build(np.random.default_rng(1).random((1000, 3)))
    SplatTree(1,000 points, ...)
    """
    from scanspan.assets.splats.build import build_tree

    place = None if path is None else os.fspath(path)
    return SplatTree.of(
        build_tree(
            points, place, normals=normals, exact=exact, max_memory=max_memory, resume=resume, nonfinite=nonfinite,
            progress=progress,
        )
    )  # fmt: skip


def open(path: str | PathLike[str], *, max_bytes: int = MAX_BYTES) -> SplatTree:
    """Open a file that `build` wrote; the table of nodes is read, splats when they are drawn.

    Parameters
    ----------
    path : the file.
    max_bytes : of decoded splats that are kept from one picture to the next.

    Raises
    ------
    FormatError : a file that is none, or damaged; it says where.
    """
    from scanspan.assets.splats.file import read_tree

    return SplatTree.of(read_tree(os.fspath(path), PAGES_BYTES), check_integer("max_bytes", max_bytes, 1, 2**62))
