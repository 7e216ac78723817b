"""Who is raced on meshes through a library for pictures of them or for rays: VTK, Embree, and Open3D's use of Embree."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.engine_peers import BASE_COLOR, vertex_normals
from benchmarks.entry import Arrays, Entry, MissingError, Peer, load
from benchmarks.scenes import MeshScene


def _eye(scene: MeshScene) -> NDArray[np.float64]:
    return np.asarray(-scene.view[:3, :3].T @ scene.view[:3, 3])


def _rays(scene: MeshScene) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where rays through the centres of all pixels start and go, row by row."""
    width, height = scene.size
    tangent = np.tan(scene.fov / 2)
    x = (np.arange(width) + 0.5 - width / 2) / (height / 2) * tangent
    y = (height / 2 - np.arange(height) - 0.5) / (height / 2) * tangent
    seen = np.stack(np.broadcast_arrays(x[None], y[:, None], -1.0), axis=-1).reshape(-1, 3)
    directions = np.ascontiguousarray(seen @ scene.view[:3, :3], dtype=np.float32)
    return np.ascontiguousarray(np.broadcast_to(_eye(scene), directions.shape), dtype=np.float32), directions


def embree_entry(scene: MeshScene) -> Entry:
    """Return Embree: one ray for each pixel, and what it hits; building its tree counts as converting."""
    embree, triangles = load("embreex.rtcore_scene", "embreex"), load("embreex.mesh_construction", "embreex")
    width, height = scene.size
    rays = _rays(scene)
    held: list[Any] = []

    def convert() -> None:
        held[:] = [embree.EmbreeScene()]
        triangles.TriangleMesh(held[0], scene.positions[scene.triangles])
        held[0].run(rays[0][:1], rays[1][:1])

    def draw() -> Arrays:
        hit = held[0].run(*rays, output=True)
        return hit["primID"].reshape(height, width), hit["tfar"].reshape(height, width)

    return Entry(convert, draw, lambda arrays: arrays[0] >= 0, "mask")


def open3d_entry(scene: MeshScene) -> Entry:
    """Return Open3D's RaycastingScene."""
    open3d = load("open3d", "open3d")
    width, height = scene.size
    tensor = open3d.core.Tensor
    rays = tensor(np.concatenate(_rays(scene), axis=1).reshape(height, width, 6))
    held: list[Any] = []

    def convert() -> None:
        held[:] = [open3d.t.geometry.RaycastingScene(nthreads=1)]
        held[0].add_triangles(tensor(scene.positions), tensor(scene.triangles.astype(np.uint32)))
        held[0].cast_rays(rays[:1, :1], nthreads=1)

    def draw() -> Arrays:
        hit = held[0].cast_rays(rays, nthreads=1)
        return hit["primitive_ids"].numpy().view(np.int32), hit["t_hit"].numpy()

    return Entry(convert, draw, lambda arrays: arrays[0] >= 0, "mask")


def vtk_entry(scene: MeshScene) -> Entry:
    """Return VTK's render window, off the screen, with smooth shading and a lamp at the eye."""
    os.environ["LP_NUM_THREADS"] = "0"
    vtk, support = load("vtk", "vtk"), load("vtk.util.numpy_support", "vtk")
    width, height = scene.size
    window, renderer, mapper, actor = vtk.vtkRenderWindow(), vtk.vtkRenderer(), vtk.vtkPolyDataMapper(), vtk.vtkActor()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    actor.SetMapper(mapper)
    renderer.AddActor(actor)

    # Set up the material, and the camera with VTK's own lamp.
    look = actor.GetProperty()
    look.SetColor(*BASE_COLOR)
    look.SetInterpolationToPhong()
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*_eye(scene))
    camera.SetFocalPoint(*(_eye(scene) - scene.view[2, :3]))
    camera.SetViewUp(*scene.view[1, :3])
    camera.SetViewAngle(float(np.degrees(scene.fov)))
    camera.SetClippingRange(scene.near, scene.far)
    color, depth = vtk.vtkUnsignedCharArray(), vtk.vtkFloatArray()

    def convert() -> None:
        points, faces, mesh = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
        points.SetData(support.numpy_to_vtk(scene.positions, 1))
        faces.SetData(3, support.numpy_to_vtkIdTypeArray(scene.triangles.astype(np.int64).ravel(), 1))
        mesh.SetPoints(points)
        mesh.SetPolys(faces)
        mesh.GetPointData().SetNormals(support.numpy_to_vtk(vertex_normals(scene), 1))
        mapper.SetInputData(mesh)

    def draw() -> Arrays:
        renderer.Modified()
        window.Render()
        if window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, color) == 0:
            raise MissingError("this VTK opens no window off the screen")
        window.GetZbufferData(0, 0, width - 1, height - 1, depth)
        picture = support.vtk_to_numpy(color).reshape(height, width, 4)[::-1]
        return picture, support.vtk_to_numpy(depth).reshape(height, width)[::-1]

    return Entry(convert, draw, lambda arrays: arrays[1] < 1, "mask")


PEERS = {
    "VTK": Peer(vtk_entry, ("mesh",), "RGBA and float32 depth, through Mesa where there is no graphics card"),
    "Embree rays": Peer(embree_entry, ("mesh",), "number of the triangle and distance; no shading"),
    "Open3D rays": Peer(open3d_entry, ("mesh",), "number of the triangle and distance, by Embree; no shading"),
}
