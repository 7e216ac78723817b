"""Warming: small pictures that between them need the kernels, so that later starts find them compiled."""

from __future__ import annotations

from scanspan.view.reporter import Reporter


def run_kernels(reporter: Reporter, every: bool) -> None:
    """Draw small pictures that between them need every kernel, or those of half-space rasterization alone."""
    import numpy as np

    import scanspan as ss
    from scanspan.raster.algorithms import KERNELS, PIXEL_KERNELS

    # One scene has it all: a mesh that crosses the near plane, with a texture and colours, a mirrored one, segments and points.
    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    values = {"uv": corners[:, :2] / 2 + 0.5, "color": corners / 2 + 0.5, "normal": corners}
    box = ss.Mesh.from_polygons(corners, faces, values)
    material = ss.Material(texture=ss.Texture(np.full((2, 2, 3), 200, np.uint8)))
    instances = [
        ss.Instance(box, material=material), ss.Instance(box, np.diag([-0.5, 0.5, 0.5, 1.0])),
        ss.Instance(ss.Segments(corners, [(0, 7), (1, 6)], [(255, 0, 0), (0, 0, 255)], 2.0)), ss.Instance(ss.Points(corners)),
    ]  # fmt: skip
    scene = ss.Scene(instances)
    inside = ss.Camera.look_at((0.9, 0.8, 0.7), (-1, -1, -1), near=0.5, far=9.0)
    for shading, cull, blend in (("auto", "none", "linear"), ("smooth", "back", "srgb"), ("flat", "front", "linear")):
        frame = ss.render(scene, inside, (24, 16), shading=shading, cull=cull, blend=blend, edges=True, samples=2)
        frame.fields(("color", "depth", "primitive", "object", "barycentric", "normal", "position", "uv"))
    ss.explain(frame, 12, 8)
    hole = ss.Polygons([[[(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)]]])
    ss.explain(ss.render(ss.Scene([box, hole]), inside, (24, 16), samples=1), 12, 8)
    clip = np.concatenate([corners, np.full((8, 1), 1.5)], axis=1)
    for algorithm, known in KERNELS.items():
        for order in known if every else list(known)[:1] if algorithm == "half-space" else ():
            reporter.stage(f"compiling {algorithm} in {order}")
            way = {"algorithm": algorithm, "order": order}
            for depth_bits in (32, 64):
                seen = ss.rasterize(clip, box.triangles, (8, 8), depth_bits=depth_bits, **way)  # type: ignore[arg-type]
                ss.interpolate(seen, corners)
                ss.merge(seen, seen)
            ss.count([[(0, 0), (8, 0), (0, 8)]], (8, 8), algorithm=algorithm, order=order)
            if every:
                dict(seen.counters)
            for coverage in ("touched", "inside") if every and algorithm in PIXEL_KERNELS else ():
                seen = ss.rasterize(clip, box.triangles, (8, 8), coverage=coverage, **way)  # type: ignore[arg-type]
                dict(seen.counters)
