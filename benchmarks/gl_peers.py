"""Who else is raced on triangles with depth: OpenGL in software, Mesa's llvmpipe, through moderngl."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import Arrays, Entry, MissingError, Peer, load
from benchmarks.scenes import MeshScene, Scene

VERTEX = """#version 330
uniform mat4 matrix; in vec4 place; in vec3 color; out vec3 shown;
void main() { gl_Position = matrix * place; shown = color; }"""
FRAGMENT = """#version 330
in vec3 shown; out vec4 result;
void main() { result = vec4(shown, 1.0); }"""


def llvmpipe_entry(scene: Scene) -> Entry:
    """Return a draw call of llvmpipe on the caller's thread, whose colours and depths are read back."""
    os.environ |= {"LP_NUM_THREADS": "0", "LIBGL_ALWAYS_SOFTWARE": "1", "EGL_PLATFORM": "surfaceless"}
    moderngl = load("moderngl", "moderngl 5, and Mesa's libEGL and libGL")
    try:
        context = moderngl.create_standalone_context(backend="egl")
    except Exception as error:
        raise MissingError(f"needs Mesa's libEGL and libGL ({error})") from error
    (width, height), matrix = scene.size, np.eye(4)
    colors, depths = context.renderbuffer(scene.size), context.depth_renderbuffer(scene.size)
    frame = context.framebuffer([colors], depths)
    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    context.enable(moderngl.DEPTH_TEST)
    frame.use()
    held: dict[str, NDArray[Any]] = {}
    if isinstance(scene, MeshScene):
        matrix = scene.matrix

    def convert() -> None:
        """Interleave places and colours."""
        if isinstance(scene, MeshScene):
            light = scene.positions - scene.positions.min(axis=0)
            places = np.column_stack([scene.positions, np.ones(len(scene.positions))])
            held["vertices"] = np.column_stack([places, light / light.max()]).astype(np.float32)
            held["indices"] = scene.triangles
            return
        assert scene.depths is not None
        places = scene.vertices * np.array([2 / width, -2 / height]) + (-1, 1)
        parts = [places, 2 * scene.depths[..., None] - 1, np.ones((scene.count, 3, 1)), scene.colors[..., :3] / 255]
        held["vertices"] = np.concatenate(parts, axis=-1).reshape(-1, 7).astype(np.float32)
        held["indices"] = np.arange(3 * scene.count, dtype=np.int32)

    def draw() -> Arrays:
        """Upload, draw and read back."""
        vertices, indices = context.buffer(held["vertices"].tobytes()), context.buffer(held["indices"].tobytes())
        drawn = context.vertex_array(program, [(vertices, "4f 3f", "place", "color")], indices)
        program["matrix"].write(np.ascontiguousarray(matrix.T, dtype=np.float32).tobytes())
        frame.clear(0, 0, 0, 0, depth=1.0)
        drawn.render()
        picture = np.frombuffer(frame.read(components=4), np.uint8).reshape(height, width, 4)
        depth = np.frombuffer(frame.read(components=1, attachment=-1, dtype="f4"), np.float32).reshape(height, width)
        for used in (drawn, vertices, indices):
            used.release()
        return picture, depth

    if isinstance(scene, MeshScene):
        return Entry(convert, draw, lambda arrays: arrays[1][::-1] < 1, "mask")
    return Entry(convert, draw, lambda arrays: arrays[0][::-1, :, :3], "colors")


PEERS = {
    "llvmpipe through moderngl": Peer(
        llvmpipe_entry, ("deep", "mesh"), "RGBA and float32 depth; top-left, 8 sub-pixel bits; rows from below"
    ),
}
