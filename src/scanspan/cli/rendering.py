"""From the words of `scanspan render` to its files: the scene is read, seen, and written, each of them whole or not at all."""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from scanspan import __version__
from scanspan.cli import splat as trees
from scanspan.cli.warming import Helper
from scanspan.errors import InputError, unknown_name
from scanspan.view.reporter import Reporter

if TYPE_CHECKING:
    from scanspan.assets.camera import Camera
    from scanspan.assets.scene import Scene
    from scanspan.records import UInt8Array
    from scanspan.target.frame import Frame
    from scanspan.view.shot import Shot

STOPPED = threading.Event()  # Ctrl-C was pressed; the imports of some libraries swallow what is raised in them


class Request(NamedTuple):
    """What `render` was asked for, as far as it can be checked before the model is read."""

    model: str
    output: str
    size: tuple[int, int]
    fields: list[str] | None  # of the frame, for .npz
    views: list[str]
    metadata: str | None
    up: str | None
    color: tuple[float, ...] | None
    shot: Shot
    look: dict[str, Any]  # for scanspan.render
    limits: dict[str, Any]  # for scanspan.load
    points: dict[str, Any]  # for PointCloud.select


def choose_output(model: str, output: str | None, aov: str | None, views: list[str], metadata: str | None) -> str:
    """Return where the picture goes; raise before any work is done when it cannot go there."""
    from scanspan.target.image import image_format
    from scanspan.view.shot import naming

    target = output if output is not None else (Path(model).stem or "picture") + (".png" if aov is None else ".npz")
    with naming("--output"):
        ending = "png" if target == "-" else image_format(target)
    if aov is not None and ending != "npz":
        raise InputError(f"--aov writes arrays: expected an --output that ends in .npz, got {target!r}")
    if views and ending == "npz":
        raise InputError(f"--views makes one picture: expected an --output that is none of arrays, got {target!r}")
    for option, path in (("--output", target), ("--json", metadata)):
        if path is None or (path == "-" and option == "--output"):
            continue
        if path in ("", "-") or "\0" in path or os.path.isdir(path):
            raise InputError(f"{option} = {path!r}: expected the name of a file")
        if not (Path(path).parent).is_dir():
            raise InputError(f"{option} = {path!r}: the folder {str(Path(path).parent)!r} does not exist")
        if os.path.exists(path) and os.path.exists(model) and os.path.samefile(path, model):
            raise InputError(f"{option} = {path!r}: is the model itself, which is not overwritten")
    if metadata is not None and os.path.realpath(metadata) == os.path.realpath(target):
        raise InputError(f"--json = {metadata!r}: is the --output too")
    return target


def run(request: Request, reporter: Reporter, helper: Helper) -> bytes | str:
    """Render what was asked for, write it, and return what goes to standard output."""
    if request.model.lower().endswith(trees.ENDING):
        return trees.draw_request(request, reporter)
    reporter.stage(f"reading {request.model}")
    scene = read_scene(request, reporter)
    check_interrupt()
    reporter.stage("starting the compiler")
    reporter.await_kernels(lambda: helper.start(request))
    from scanspan.jit import has_kernels

    if not has_kernels():
        helper.start(request)
    from scanspan.pipeline import MAX_PIXELS, check_pixels, render
    from scanspan.target.frame import FIELDS
    from scanspan.target.image import encode_image, image_format, write_bytes
    from scanspan.target.sink import ENDINGS
    from scanspan.view.metadata import to_json
    from scanspan.view.shot import make_camera

    # Write rows as they are finished where nothing else is asked for: such a picture may be larger than memory.
    check_fields(request.fields, FIELDS)
    if request.output.lower().endswith(ENDINGS) and not request.views and request.metadata is None:
        reporter.stage(f"rendering {request.model} into {request.output}")
        render(scene, make_camera(scene, request.shot, request.size), request.size, out=request.output, **request.look)
        return f"{request.output}\n"

    # Make the picture, or the arrays, and the numbers beside them.
    check_pixels(request.size, request.look.get("max_pixels", MAX_PIXELS))
    content: Any
    if request.views:
        content, records = render_views(scene, request, reporter)
    else:
        frame, record = render_view(scene, request, request.shot, reporter, request.size)
        records = [record]
        if frame.coverage == 0:
            reporter.note("nothing of the model is in the picture")
        is_arrays = request.output.lower().endswith(".npz")
        content = frame.fields(request.fields or FIELDS) if is_arrays else frame.color

    # Write both, each of them whole or not at all; the picture's path is the result.
    check_interrupt()
    reporter.stage(f"writing {request.output}")
    encoded = encode_image(content, "png" if request.output == "-" else image_format(request.output))
    if request.output != "-":
        write_bytes(request.output, encoded)
    if request.metadata is not None:
        write_bytes(request.metadata, to_json(records if request.views else records[0]).encode() + b"\n")
    reporter.detail("done")
    return encoded if request.output == "-" else f"{request.output}\n"


def check_fields(names: list[str] | None, known: Sequence[str]) -> None:
    """Raise for a name that is none of a frame's fields."""
    for name in names or ():
        if name not in known:
            raise InputError(f"--aov: {unknown_name('field', name, known)}")


def read_scene(request: Request, reporter: Reporter) -> Scene:
    """Return the scene of a request, in its colour and with its up; tell what the reader could not do."""
    from scanspan.assets.load import load
    from scanspan.assets.scene import Scene
    from scanspan.view.parts import choose_points, recolor

    scene = load(request.model, **request.limits)
    for note in scene.notes:
        reporter.note(f"note: {request.model}: {note}")
    reporter.detail(repr(scene))
    scene = choose_points(scene, request.points)
    if request.color is None and request.up is None:
        return scene
    instances = scene.instances if request.color is None else [recolor(one, request.color) for one in scene.instances]
    return Scene(instances, request.up or scene.up, scene.name, scene.notes, scene.cameras, scene.lights)


def render_view(
    scene: Scene, request: Request, shot: Shot, reporter: Reporter, size: tuple[int, int], camera: Camera | None = None
) -> tuple[Frame, dict[str, Any]]:
    """Return one rendered view, and what is known of it when that was asked for."""
    from scanspan.pipeline import render
    from scanspan.view.metadata import describe_frame
    from scanspan.view.shot import make_camera

    reporter.stage(f"rendering {request.model}" + (f", {shot.direction}" if request.views else ""))
    frame = render(scene, camera or make_camera(scene, shot, size), size, **request.look)
    reporter.detail(f"{frame.counters}, {100 * frame.coverage:.1f} % covered")
    if request.metadata is None:
        return frame, {}
    told = {name: request.look[name] for name in ("algorithm", "samples", "shading", "cull", "lights")}
    files = {"scanspan": __version__, "model": request.model, "output": request.output}
    return frame, files | describe_frame(frame) | {"options": told}


def render_views(scene: Scene, request: Request, reporter: Reporter) -> tuple[UInt8Array, list[dict[str, Any]]]:
    """Return the sheet of several views, and what is known of each."""
    from scanspan.view.metadata import centre_of
    from scanspan.view.sheet import compose, match_scales, plan
    from scanspan.view.shot import make_camera

    layout = plan(request.views, request.size)
    shots = [request.shot._replace(direction=name) for name in request.views]
    cameras = match_scales([make_camera(scene, shot, layout.cell, layout.margin) for shot in shots], centre_of(scene))
    pictures, records = [], []
    for shot, camera, (left, top) in zip(shots, cameras, layout.corners):
        frame, record = render_view(scene, request, shot, reporter, layout.cell, camera)
        pictures.append(frame.color)
        region = [left, top, left + layout.cell[0], top + layout.cell[1]]
        records.append({"name": shot.direction, "region": region} | record)
    transparent = request.look.get("background") == "transparent"
    return compose(pictures, request.views, layout, transparent=transparent), records


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given, so that the others keep the library's own defaults."""
    return {name: value for name, value in options.items() if value is not None}


def check_interrupt() -> None:
    """Raise a Ctrl-C that was swallowed."""
    if STOPPED.is_set():
        raise KeyboardInterrupt
