"""Warming: compiling by two processes at once, for `scanspan warm` and for the first picture on a machine.

One process compiles one kernel at a time. So a second one compiles what shades while the first compiles what rasterizes, which
takes as long; each finds on disk what the other has made. The second one draws the same pictures, but where kernels would write
the nearest triangles it writes the first one everywhere, and where they would find the normals of one picture it takes one for
all: what is shaded then needs the same kernels. What it gives is not seen.
"""

from __future__ import annotations

import contextlib
import gc
import json
import pickle
import subprocess
import sys
from typing import Any

from scanspan.view import options
from scanspan.view.reporter import Reporter


class Helper:
    """A second process that compiles, once it is started; without a second processor there is none.

    Examples
    --------
    >>> with Helper() as helper:
    ...     helper.result()
    ([], 0.0)
    """

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Helper:
        """Begin without a process."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process; what it has finished is kept."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def start(self, work: Any) -> None:
        """Start it with a request of `scanspan render`, or with whether all kernels are to be warmed."""
        from scanspan.raster.options import check_threads

        if check_threads(None) < 2 or self.process is not None:
            return
        program = f"import gc; gc.set_threshold{gc.get_threshold()}; from scanspan.cli.warming import serve; serve()"
        command = [sys.executable, "-c", program]
        with contextlib.suppress(OSError):  # then there is one process, as before
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            if self.process.stdin is not None:
                self.process.stdin.write(pickle.dumps(work))
                self.process.stdin.close()
                self.process.stdin = None

    def result(self) -> tuple[list[str], float]:
        """Wait for its end, and return the names of the kernels that it has compiled, and how many seconds that took."""
        if self.process is None:
            return [], 0.0
        told, _ = self.process.communicate()
        self.process = None
        try:
            names, seconds = json.loads(told)
            return list(names), float(seconds)
        except (TypeError, ValueError):
            return [], 0.0


def warm(every: options.Every = False, verbose: options.Verbose = False) -> None:
    """Compile kernels now, so that every later start is quick, and tell where they are kept."""
    from scanspan.cli import write_out
    from scanspan.jit import compile_seconds
    from scanspan.view.metadata import describe_kernels

    with Reporter(verbose) as reporter, Helper() as helper:
        reporter.stage("compiling")
        reporter.await_kernels(lambda: helper.start(every))
        run_kernels(reporter, every)
        reporter.stage("waiting for the second process")
        elsewhere, elsewhere_seconds = helper.result()
        draw_scene()
        if every:
            reporter.stage("compiling what paints on a canvas")
            draw_clouds()
            draw_canvases()
    kept = describe_kernels(elsewhere)
    took = compile_seconds() + elsewhere_seconds
    write_out(f"{kept['kernels']} kernels ready, {kept['compiled']} of them compiled now, in {kept['folder']}\n")
    if kept["compiled"]:
        write_out(f"compiling took {took:.0f} s, {took / kept['compiled']:.1f} s a kernel\n")


def show_first_triangle(algorithm: str, order: str, kind: str, target: Any, triangles: Any, sampling: Any, threads: int) -> Any:
    """Write the first triangle everywhere, in the place of `raster.algorithms.run`; no kernel is needed for that."""
    import numpy as np

    from scanspan.raster.counters import COUNTERS

    if len(triangles.corners):
        half = np.float32(0.5).view(np.int32).astype(np.int64)
        target[...] = (half << 32) + 0xFFFFFFFF if kind == "keys" else (0.5, 0.0) if kind == "pairs" else 0
    return np.zeros(COUNTERS, np.int64)


def show_one_normal(positions: Any, triangles: Any, source: Any, crease_angle: float = 0.0) -> Any:
    """Give all corners one normal, in the place of `shade.normals.corner_normals`, whose kernels the first process compiles."""
    import numpy as np

    normals = np.zeros((len(triangles), 3, 3), np.float32)
    normals[..., 2] = 1.0
    return normals


def serve() -> None:
    """Be the second process: compile what shades, and tell which kernels that were."""
    from scanspan.jit import compile_seconds
    from scanspan.shade import surface
    from scanspan.target import visibility
    from scanspan.view.metadata import compiled_kernels

    work = pickle.load(sys.stdin.buffer)  # our own parent wrote it
    vars(visibility)["run"] = show_first_triangle
    if isinstance(work, bool):
        draw_scene()
        if work:
            draw_clouds()
            draw_canvases()
    else:
        from scanspan.cli.rendering import read_scene, render_view

        vars(surface)["corner_normals"] = show_one_normal
        with Reporter() as reporter:
            shot = work.shot._replace(direction=work.views[0]) if work.views else work.shot
            frame, _ = render_view(read_scene(work, reporter), work._replace(metadata=None), shot, reporter, (64, 48))
            assert frame.color is not None
    print(json.dumps([compiled_kernels(), compile_seconds()]))


def make_scene() -> tuple[Any, Any, Any]:
    """Return a scene that has it all, the box in it, and its corners.

    A mesh that crosses the near plane, with a texture and colours, a mirrored one, segments and translucent points, and lights.
    """
    import numpy as np

    import scanspan as ss

    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    values = {"uv": corners[:, :2] / 2 + 0.5, "color": corners / 2 + 0.5, "normal": corners}
    box = ss.Mesh.from_polygons(corners, faces, values)
    material = ss.Material(texture=ss.Texture(np.full((2, 2, 3), 200, np.uint8)))
    instances = [
        ss.Instance(box, material=material), ss.Instance(box, np.diag([-0.5, 0.5, 0.5, 1.0])),
        ss.Instance(ss.Segments(corners, [(0, 7), (1, 6)], [(255, 0, 0), (0, 0, 255)], 2.0)),
        ss.Instance(ss.Points(corners, (9, 9, 9, 9))),
    ]  # fmt: skip
    return ss.Scene(instances, lights=[ss.Light("spot", position=(2, 2, 2), direction=(-1, -1, -1))]), box, corners


def draw_scene() -> None:
    """Draw small pictures that between them need every kernel that shades."""
    import scanspan as ss

    scene, box, _ = make_scene()
    inside = ss.Camera.look_at((0.9, 0.8, 0.7), (-1, -1, -1), near=0.5, far=9.0)
    for shading, cull, blend in (("auto", "none", "linear"), ("smooth", "back", "srgb"), ("flat", "front", "linear")):
        lights = "studio" if shading == "flat" else "viewer"
        frame = ss.render(
            scene, inside, (24, 16), shading=shading, cull=cull, blend=blend, lights=lights, edges=True, samples=2
        )
        frame.fields(("color", "depth", "primitive", "object", "barycentric", "normal", "position", "uv"))
    ss.explain(frame, 12, 8)
    hole = ss.Polygons([[[(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)]]])
    ss.explain(ss.render(ss.Scene([box, hole]), inside, (24, 16), samples=1), 12, 8)


def run_kernels(reporter: Reporter, every: bool) -> None:
    """Draw small pictures that between them need the kernels of every algorithm, or those of half-space rasterization alone."""
    import numpy as np

    import scanspan as ss
    from scanspan.raster.algorithms import KERNELS, PIXEL_KERNELS

    _, box, corners = make_scene()
    clip = np.concatenate([corners, np.full((8, 1), 1.5)], axis=1)
    for algorithm, known in KERNELS.items():
        for order in known if every else list(known)[:1] if algorithm == "half-space" else ():
            reporter.stage(f"compiling {algorithm} in {order}")
            way = {"algorithm": algorithm, "order": order}
            for depth_bits in (32, 64):
                seen = ss.rasterize(clip, box.triangles, (8, 8), depth_bits=depth_bits, **way)  # type: ignore[arg-type]
                ss.interpolate(seen, corners)
                ss.interpolate(seen, corners.astype(np.uint8), dtype=np.uint8)
                ss.merge(seen, seen)
            ss.count([[(0, 0), (8, 0), (0, 8)]], (8, 8), algorithm=algorithm, order=order)
            if every:
                dict(seen.counters)
            for coverage in ("touched", "inside") if every and algorithm in PIXEL_KERNELS else ():
                seen = ss.rasterize(clip, box.triangles, (8, 8), coverage=coverage, **way)  # type: ignore[arg-type]
                dict(seen.counters)


def draw_clouds() -> None:
    """Draw small clouds, of whole numbers as surveys have them and of floats."""
    import numpy as np

    import scanspan as ss

    places = np.random.default_rng(0).integers(0, 99, (64, 3))
    few = [ss.PointCloud(integers=places), *(ss.PointCloud(places.astype(kind)) for kind in (np.float32, np.float64))]
    for cloud, shape in ((cloud, shape) for cloud in few for shape in ("disc", "gaussian")):
        ss.render(cloud, size=(24, 16), point_shape=shape, samples=1)
        ss.render(cloud, size=(24, 16), point_size=1, samples=1)


def draw_canvases() -> None:
    """Paint small pictures that between them need the kernels of a canvas, of coverage and of aggregation."""
    import numpy as np

    import scanspan as ss

    triangle, corners = np.array([[(1.0, 1.0), (7.0, 2.0), (3.0, 7.0)]]), np.zeros((1, 3, 4), np.uint8)
    star = [(4 + 3.5 * x, 4 + 3.5 * y) for x, y in ((0, -1), (0.6, 0.8), (-1, -0.3), (1, -0.3), (-0.6, 0.8))]
    for blend, alpha in (("linear", 255), ("linear", 90), ("srgb", 90)):
        canvas, color = ss.Canvas(8, 8, blend=blend), (200, 100, 50, alpha)
        corners[..., 3] = alpha
        for algorithm in ("half-space", "edge-walk", "warnock", "micropolygon"):
            canvas.triangles(triangle, color, algorithm=algorithm)
            canvas.triangles(triangle, corners, algorithm=algorithm)
            canvas.triangles(triangle, corners / 255.0, algorithm=algorithm)
            canvas.triangles(np.repeat(triangle, 65, axis=0), color, algorithm=algorithm)
            if alpha == 255:
                canvas.triangles(triangle, color, depths=[(1, 2, 3)], algorithm=algorithm)
        for algorithm in ("scanline", "parity", "triangles", "flood"):
            canvas.polygon(star, color, algorithm=algorithm)
        canvas.polygons([star, star], color, antialias=True, overlap="over")
        canvas.polygons([star, star], color, antialias=True, overlap="disjoint")
        canvas.polygon(star, color, antialias="tent")
        for algorithm in ("midpoint", "diamond-exit", "wu"):
            canvas.lines(triangle[:, :2], color, algorithm=algorithm)
        canvas.polyline(star, color, width=2.5, join="round", antialias=True)
        canvas.polyline(star, color, width=2.5, dash=(1, 2))
        canvas.points(star, color, size=3, shape="disc", antialias=True)
        canvas.flood_fill(0, 0, color, tolerance=3)
    for mode in ("center", "touched", "area"):
        ss.coverage(star, (8, 8), mode=mode)
        ss.zones([star, star], (8, 8), mode=mode, reduce="count")
    ss.triangulate(star)
    for shapes in (np.array(star), triangle[:, :2], triangle):
        for reduce in ("count", "mean", "max"):
            ss.aggregate(shapes, (8, 8), values=None if reduce == "count" else np.ones(len(shapes)), reduce=reduce)
