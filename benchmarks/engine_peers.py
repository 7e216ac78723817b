"""Who is raced through an engine of its own: SDL's and Mesa's rasterizers, and Panda3D's.

All run on the processor. Mesa's llvmpipe, reached through moderngl and VTK, needs EGL and is told to use the caller's thread.
Uploading counts as converting, and reading back as drawing. Meshes are lit by a lamp at the eye.
"""

from __future__ import annotations

import ctypes
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.entry import Arrays, Entry, MissingError, Peer, first_colors, load
from benchmarks.scenes import FlatScene, MeshScene, Scene

SDL_BATCH = 150_000  # Vertices in one call of SDL, which copies them; three to a triangle.
BASE_COLOR = (0.8, 0.7, 0.6)  # of meshes

VERTEX_SHADER = """#version 330
uniform mat4 matrix; in vec3 position; in vec4 color; %s out vec4 shade;
void main() { gl_Position = matrix * vec4(position, 1.0); shade = color; }"""
FRAGMENT_SHADER = """#version 330
%s in vec4 shade; out vec4 pixel;
void main() { pixel = shade; }"""
LIT_VERTEX_SHADER = """#version 330
uniform mat4 matrix; uniform mat3 turn; in vec3 position; in vec3 normal; out vec3 facing;
void main() { gl_Position = matrix * vec4(position, 1.0); facing = turn * normal; }"""
LIT_FRAGMENT_SHADER = """#version 330
in vec3 facing; out vec4 pixel;
void main() { pixel = vec4(vec3(0.8, 0.7, 0.6) * max(normalize(facing).z, 0.0), 1.0); }"""


def corner_colors(scene: FlatScene) -> NDArray[np.uint8]:
    """Return a colour for each corner."""
    colors = scene.colors if scene.kind != "flat" else np.repeat(scene.colors, 3, axis=0)
    return np.ascontiguousarray(colors.reshape(-1, 4))


def vertex_normals(scene: MeshScene) -> NDArray[np.float32]:
    """Return unit normals at the vertices: the mean of the faces around, by their areas."""
    corners = scene.positions[scene.triangles].astype(np.float64)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros((len(scene.positions), 3))
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(scene.triangles[:, corner], face[:, axis], len(normals))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return (normals / np.maximum(lengths, 1e-30)).astype(np.float32)


def screen_matrix(size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the matrix from pixels, with the first row at the bottom, and depths of 0 to 1 to clip space."""
    matrix = np.diag([2 / size[0], 2 / size[1], 2, 1])
    matrix[:3, 3] = -1
    return matrix.astype(np.float32)


def sdl_entry(scene: FlatScene) -> Entry:
    """Return SDL's RenderGeometryRaw with its software renderer."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    sdl = load("sdl2", "pysdl2 and pysdl2-dll")
    width, height = scene.size
    picture = np.zeros((height, width, 4), dtype=np.uint8)
    surface = sdl.SDL_CreateRGBSurfaceWithFormatFrom(
        picture.ctypes.data, width, height, 32, 4 * width, sdl.SDL_PIXELFORMAT_RGBA32
    )
    renderer = sdl.SDL_CreateSoftwareRenderer(surface)
    floats, color = ctypes.POINTER(ctypes.c_float), ctypes.POINTER(sdl.SDL_Color)
    held: list[tuple[NDArray[Any], NDArray[Any]]] = []

    def convert() -> None:
        points, colors = np.ascontiguousarray(scene.vertices.reshape(-1, 2)), corner_colors(scene)
        held[:] = [(points[i : i + SDL_BATCH], colors[i : i + SDL_BATCH]) for i in range(0, len(points), SDL_BATCH)]

    def draw() -> Arrays:
        sdl.SDL_SetRenderDrawColor(renderer, 0, 0, 0, 0)
        sdl.SDL_RenderClear(renderer)
        for points, colors in held:
            place, paint = ctypes.cast(points.ctypes.data, floats), ctypes.cast(colors.ctypes.data, color)
            if sdl.SDL_RenderGeometryRaw(renderer, None, place, 8, paint, 4, None, 0, len(points), None, 0, 0):
                raise RuntimeError(sdl.SDL_GetError().decode())
            sdl.SDL_RenderFlush(renderer)
        return (picture,)

    return Entry(convert, draw, first_colors, "colors")


class _Mesa:
    """Mesa's OpenGL on llvmpipe, drawing into a colour and a depth buffer that are read back."""

    def __init__(self, size: tuple[int, int], with_depth: bool) -> None:
        os.environ["LP_NUM_THREADS"] = "0"
        self.gl = load("moderngl", "moderngl")
        try:
            self.context = self.gl.create_context(standalone=True, backend="egl")
        except Exception as error:  # A missing library shows in ways of its own for each system.
            raise MissingError(f"needs EGL and Mesa's drivers: libegl1 and libgl1-mesa-dri in Debian ({error})") from error
        self.color = np.empty((size[1], size[0], 4), dtype=np.uint8)
        self.depth = np.empty((size[1], size[0]), dtype=np.float32) if with_depth else None
        texture = self.context.texture(size, 4)
        self.buffer = self.context.framebuffer([texture], self.context.depth_texture(size) if with_depth else None)
        self.buffer.use()
        self.context.enable_only(self.gl.DEPTH_TEST if with_depth else self.gl.NOTHING)

    def draw(self, vertices: Any) -> Arrays:
        self.buffer.clear(0, 0, 0, 0, 1.0)
        vertices.render(self.gl.TRIANGLES)
        self.buffer.read_into(self.color, components=4, alignment=1)
        if self.depth is None:
            return (self.color,)
        self.buffer.read_into(self.depth, components=1, attachment=-1, dtype="f4", alignment=1)
        return self.color, self.depth


def mesa_entry(scene: Scene) -> Entry:
    """Return OpenGL on llvmpipe, through moderngl."""
    if isinstance(scene, MeshScene):
        return _mesa_mesh_entry(scene)
    depths = scene.depths
    mesa = _Mesa(scene.size, depths is not None)
    flat = "flat" if scene.kind == "flat" else ""
    program = mesa.context.program(vertex_shader=VERTEX_SHADER % flat, fragment_shader=FRAGMENT_SHADER % flat)
    program["matrix"].write(screen_matrix(scene.size).T.tobytes())
    places = mesa.context.buffer(reserve=scene.count * 36)
    colors = mesa.context.buffer(reserve=scene.count * 12)
    vertices = mesa.context.vertex_array(program, [(places, "3f", "position"), (colors, "4f1", "color")])

    def convert() -> None:
        positions = np.zeros((scene.count, 3, 3), dtype=np.float32)
        positions[..., :2] = scene.vertices
        if depths is not None:
            positions[..., 2] = depths
        places.write(positions)
        colors.write(corner_colors(scene))

    return Entry(convert, lambda: mesa.draw(vertices), first_colors, "colors")


def _mesa_mesh_entry(scene: MeshScene) -> Entry:
    mesa = _Mesa(scene.size, True)
    program = mesa.context.program(vertex_shader=LIT_VERTEX_SHADER, fragment_shader=LIT_FRAGMENT_SHADER)
    upright = np.diag([1.0, -1.0, 1.0, 1.0]) @ scene.matrix
    program["matrix"].write(upright.T.astype(np.float32).tobytes())
    program["turn"].write(scene.view[:3, :3].T.astype(np.float32).tobytes())
    held: list[Any] = []

    def convert() -> None:
        places, normals = mesa.context.buffer(scene.positions), mesa.context.buffer(vertex_normals(scene))
        corners = mesa.context.buffer(scene.triangles)
        held[:] = [mesa.context.vertex_array(program, [(places, "3f", "position"), (normals, "3f", "normal")], corners)]

    return Entry(convert, lambda: mesa.draw(held[0]), lambda arrays: arrays[1] < 1, "mask")


def _panda_window(core: Any, size: tuple[int, int]) -> tuple[Any, Any, Any]:
    """Return Panda3D's engine, a buffer of its software display, and the texture that is read back."""
    settings = "load-display p3tinydisplay\nwindow-type offscreen\naudio-library-name null\nsync-video 0\nnotify-level error"
    core.loadPrcFileData("", settings)
    engine = core.GraphicsEngine.get_global_ptr()
    pipe = core.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
    wanted = core.FrameBufferProperties()
    wanted.set_rgba_bits(8, 8, 8, 8)
    wanted.set_depth_bits(24)
    window = core.WindowProperties.size(*size)
    buffer = engine.make_output(pipe, "picture", 0, wanted, window, core.GraphicsPipe.BF_refuse_window)
    if not buffer:
        raise MissingError("this Panda3D opens no buffer of its software display, p3tinydisplay")
    texture = core.Texture()
    buffer.add_render_texture(texture, core.GraphicsOutput.RTM_copy_ram, core.GraphicsOutput.RTP_color)
    return engine, buffer, texture


def _panda_geometry(core: Any, layout: Any, vertices: NDArray[Any], triangles: NDArray[Any]) -> Any:
    """Return a node of Panda3D's graph that holds triangles."""
    table = core.GeomVertexData("mesh", layout, core.Geom.UH_static)
    table.unclean_set_num_rows(len(vertices))
    table.modify_array(0).modify_handle().copy_data_from(vertices.tobytes())
    faces = core.GeomTriangles(core.Geom.UH_static)
    faces.set_index_type(core.GeomEnums.NT_uint32)
    corners = faces.modify_vertices()
    corners.unclean_set_num_rows(triangles.size)
    corners.modify_handle().copy_data_from(triangles.astype(np.uint32).tobytes())
    geometry = core.Geom(table)
    geometry.add_primitive(faces)
    node = core.GeomNode("mesh")
    node.add_geom(geometry)
    return node


def panda_entry(scene: Scene) -> Entry:
    """Return Panda3D's software display."""
    core = load("panda3d.core", "panda3d")
    engine, buffer, texture = _panda_window(core, scene.size)
    width, height = scene.size
    root = core.NodePath("root")
    has_depth = isinstance(scene, MeshScene) or scene.depths is not None
    model = root.attach_new_node("model")
    model.set_two_sided(True)
    model.set_depth_test(has_depth)
    model.set_depth_write(has_depth)
    region = buffer.make_display_region()
    buffer.set_clear_color((0, 0, 0, 0))

    # Set up the camera: the scene's own for a mesh, else one that sees whole pixels.
    if isinstance(scene, MeshScene):
        lens = core.PerspectiveLens()
        lens.set_near_far(scene.near, scene.far)
        lens.set_fov(np.degrees(2 * np.arctan(np.tan(scene.fov / 2) * width / height)), np.degrees(scene.fov))
        pose = np.linalg.inv(scene.view).T.ravel().tolist()
        lamp, material = core.DirectionalLight("lamp"), core.Material()
        lamp.set_direction(core.LVector3f(0, 0, -1))
        material.set_diffuse((*BASE_COLOR, 1))
        model.set_material(material)
    else:
        lens, lamp = core.OrthographicLens(), None
        lens.set_film_size(width, height)
        lens.set_near_far(0.5, 3)
        pose = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, width / 2, -height / 2, 0, 1]
        model.set_attrib(core.ColorAttrib.make_vertex())
        smooth = core.ShadeModelAttrib.M_smooth if scene.kind != "flat" else core.ShadeModelAttrib.M_flat
        model.set_attrib(core.ShadeModelAttrib.make(smooth))
    lens.set_coordinate_system(core.CS_yup_right)
    camera = root.attach_new_node(core.Camera("camera", lens))
    camera.set_mat(core.LMatrix4f(*pose))
    region.set_camera(camera)
    if lamp is not None:
        model.set_light(camera.attach_new_node(lamp))

    def convert() -> None:
        model.get_children().detach()
        model.attach_new_node(_panda_mesh(core, scene) if isinstance(scene, MeshScene) else _panda_triangles(core, scene))

    def draw() -> Arrays:
        engine.render_frame()
        return (np.frombuffer(texture.get_ram_image(), np.uint8).reshape(height, width, -1)[::-1, :, 2::-1],)

    if isinstance(scene, MeshScene):
        return Entry(convert, draw, lambda arrays: arrays[0].any(axis=-1), "mask")
    return Entry(convert, draw, first_colors, "colors")


def _panda_mesh(core: Any, scene: MeshScene) -> Any:
    vertices = np.concatenate([scene.positions, vertex_normals(scene)], axis=1)
    return _panda_geometry(core, core.GeomVertexFormat.get_v3n3(), vertices, scene.triangles)


def _panda_triangles(core: Any, scene: FlatScene) -> Any:
    """Return triangles in front of the camera, as far away as they are deep."""
    vertices = np.zeros(3 * scene.count, dtype=[("position", np.float32, 3), ("color", np.uint8, 4)])
    vertices["position"][:, :2] = scene.vertices.reshape(-1, 2) * (1, -1)
    depths = scene.depths
    vertices["position"][:, 2] = -1 if depths is None else -1 - depths.ravel()
    vertices["color"] = corner_colors(scene)
    return _panda_geometry(core, core.GeomVertexFormat.get_v3c4(), vertices, np.arange(3 * scene.count))


PLANE = ("flat", "shaded")
PEERS = {
    "SDL RenderGeometry": Peer(sdl_entry, PLANE, "RGBA; whole pixels, pixels of shared edges left out or hit twice"),
    "Mesa llvmpipe": Peer(
        mesa_entry, (*PLANE, "deep", "mesh"), "RGBA, and float32 depth for those with depth; top-left, 8 sub-pixel bits"
    ),
    "Panda3D tinydisplay": Peer(panda_entry, (*PLANE, "deep", "mesh"), "RGB; whole pixels, depth cannot be read"),
}
