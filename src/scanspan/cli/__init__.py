"""The command `scanspan`: a model file in, a picture out.

The result goes to standard output as one line; everything else goes to standard error. What is slow to import is imported
inside the commands, so that `--help` answers at once.

Exit codes: 0 done, 2 bad input or usage, 3 an error of ours, 130 interrupted; 1 is kept for pictures that were compared and
differ.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from typer.main import get_command

from scanspan import __version__
from scanspan.cli import study
from scanspan.cli.draw import draw
from scanspan.cli.ivscan import ivscan
from scanspan.cli.lecture import lecture
from scanspan.cli.warming import Helper, warm
from scanspan.errors import InputError, ScanspanError, unknown_name
from scanspan.view import options
from scanspan.view.reporter import Reporter, to_line

if TYPE_CHECKING:
    from scanspan.assets.camera import Camera
    from scanspan.assets.scene import Scene
    from scanspan.records import UInt8Array
    from scanspan.target.frame import Frame
    from scanspan.view.shot import Shot

DEFAULT_SIZE = (1280, 960)
INTERRUPTED = 130  # the exit code of a process that Ctrl-C ended
_INTERRUPTED = threading.Event()

# Arguments of the library that its messages name, where they are options here; not within a file's name.
_OPTIONS = re.compile(
    r"(?<![\w./\\-])(?:max_pixels|max_bytes|max_triangles|max_texture_pixels|max_face_corners|max_points|crease_angle|line_width|point_size|point_shape|color_by|eye_dome|subpixel_bits)(?![\w./\\-])"
    r"|^(?:samples|threads)(?= =)"
)

app = typer.Typer(
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


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


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False
) -> None:
    """Turn 3-D models into pictures: exactly, on the CPU, with no window and no OpenGL.

    Example: [bold]scanspan render model.glb -o picture.png[/bold]
    """
    if version:
        write_out(f"scanspan {__version__}\n")
        raise typer.Exit()
    if context.invoked_subcommand is None:
        write_out(context.get_help().rstrip() + "\n")


@app.command()
def render(
    model: options.Model,
    output: options.Output = None,
    resolution: options.Resolution = None,
    size: options.Size = None,
    views: options.Views = None,
    aov: options.Aov = None,
    metadata: options.Metadata = None,
    up: options.Up = None,
    direction: options.Direction = None,
    position: options.Position = None,
    focal_point: options.FocalPoint = None,
    view_up: options.ViewUp = None,
    view_angle: options.ViewAngle = 30.0,
    zoom: options.Zoom = 1.0,
    azimuth: options.Azimuth = 0.0,
    elevation: options.Elevation = 0.0,
    orthographic: options.Orthographic = False,
    no_background: options.NoBackground = False,
    background_color: options.BackgroundColor = None,
    color: options.Color = None,
    shading: options.Shading = "auto",
    crease_angle: options.CreaseAngle = 40.0,
    edges: options.Edges = False,
    line_width: options.LineWidth = 1.0,
    cull: options.Cull = "none",
    no_textures: options.NoTextures = False,
    point_size: options.PointSize = None,
    point_shape: options.PointShape = None,
    color_by: options.ColorBy = None,
    eye_dome: options.EyeDome = None,
    bounds: options.Bounds = None,
    classification: options.Classification = None,
    returns: options.Returns = None,
    samples: options.Samples = 4,
    algorithm: options.Algorithm = "half-space",
    order: options.Order = "rows",
    subpixel_bits: options.SubpixelBits = 8,
    threads: options.Threads = None,
    max_pixels: options.MaxPixels = None,
    max_bytes: options.MaxBytes = None,
    max_triangles: options.MaxTriangles = None,
    max_texture_pixels: options.MaxTexturePixels = None,
    max_face_corners: options.MaxFaceCorners = None,
    max_points: options.MaxPoints = None,
    nonfinite: options.Nonfinite = "error",
    file_type: options.FileType = None,
    verbose: options.Verbose = False,
) -> None:
    """Render a model to a picture, and print the picture's path.

    Without options the picture is well framed, lit and smooth, 1280 x 960.

    [bold]scanspan render chair.glb -o chair.png --size 1920x1080[/bold]

    [bold]scanspan render part.stl --views iso,front,right,top -o sheet.png[/bold]

    [bold]scanspan render part.stl --aov depth,primitive -o arrays.npz --json camera.json[/bold]
    """
    from scanspan.view import parts
    from scanspan.view import shot as words

    shot = words.parse_shot(
        direction, position, focal_point, view_up, view_angle, zoom, azimuth, elevation, orthographic
    )  # fmt: skip
    names = words.parse_views(views)
    if names and (direction or position or focal_point):
        raise InputError("--views chooses where the eye stands: leave out --camera-direction, -position and -focal-point")
    if no_background and background_color is not None:
        raise InputError("--no-background and --background-color do not go together")
    look = {
        "background": "transparent" if no_background else words.parse_shade("--background-color", background_color),
        "shading": shading, "crease_angle": crease_angle, "edges": edges, "line_width": line_width, "cull": cull,
        "textures": not no_textures, "samples": samples, "algorithm": algorithm, "order": order, "threads": threads,
        "subpixel_bits": subpixel_bits, "max_pixels": max_pixels, "point_shape": point_shape,
        "point_size": parts.parse_point_size(point_size), "color_by": color_by, "eye_dome": eye_dome,
    }  # fmt: skip
    limits = {
        "max_bytes": max_bytes, "max_triangles": max_triangles, "max_texture_pixels": max_texture_pixels,
        "max_face_corners": max_face_corners, "max_points": max_points, "nonfinite": nonfinite, "file_type": file_type,
    }  # fmt: skip
    request = Request(
        model, choose_output(model, output, aov, names, metadata), words.parse_size(resolution, size, DEFAULT_SIZE),
        None if aov is None else [name.strip() for name in aov.split(",")], names, metadata, words.parse_axis(up),
        words.parse_shade("--color", color), shot, given(look), given(limits),
        given(parts.parse_choice(bounds, classification, returns)),
    )  # fmt: skip
    with Reporter(verbose) as reporter, Helper() as helper:
        printed = run(request, reporter, helper)
    write_out(printed)


app.command()(study.explain)
app.command()(study.algorithms)
app.command()(draw)
app.add_typer(lecture, name="lecture")
app.command()(ivscan)


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
    reporter.stage(f"reading {request.model}")
    scene = read_scene(request, reporter)
    check_interrupt()
    reporter.stage("starting the compiler")
    reporter.await_kernels(lambda: helper.start(request))
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
    return Scene(instances, request.up or scene.up, scene.name, scene.notes, scene.cameras)


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
    told = {name: request.look[name] for name in ("algorithm", "samples", "shading", "cull")}
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


@app.command()
def info(
    file: Annotated[str | None, typer.Argument(metavar="[FILE]", help="A model file.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
    nonfinite: options.Nonfinite = "error",
    file_type: options.FileType = None,
) -> None:
    """Tell what is in a model file; without one, tell about this machine."""
    from scanspan.view.metadata import describe_machine, describe_model, to_json, to_text

    if file is None:
        record = {"scanspan": __version__} | describe_machine()
    else:
        from scanspan.assets.load import load

        record = describe_model(file, load(file, **given({"nonfinite": nonfinite, "file_type": file_type})))
    write_out((to_json(record) if as_json else to_text(record)) + "\n")


app.command()(warm)


def write_out(content: bytes | str) -> None:
    """Write to standard output, and see it through; there may be none, in a daemon."""
    if sys.stdout is None:
        return
    sys.stdout.buffer.write(content if isinstance(content, bytes) else os.fsencode(content))
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; every error is one line on standard error."""
    # Notes of the reader come with the scene; what it logs would say them twice.
    logging.getLogger("scanspan").addHandler(logging.NullHandler())
    words = list(sys.argv[1:] if arguments is None else arguments)
    _INTERRUPTED.clear()
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _interrupt)
    wants_trace = "--verbose" in words or os.environ.get("SCANSPAN_DEBUG", "") not in ("", "0")
    try:
        code = get_command(app).main(args=words, prog_name="scanspan", standalone_mode=False)
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        return code if isinstance(code, int) else 0
    except (KeyboardInterrupt, typer.Abort):
        return _end("interrupted", INTERRUPTED)
    except (BrokenPipeError, SystemExit):
        # The reader has had enough, which typer makes an exit. Give the interpreter a place to flush to when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except typer.TyperException as error:
        return _end(f"error: {_plain(error.format_message())}", 2)
    except ScanspanError as error:
        return _end(f"error: {_OPTIONS.sub(_to_option, str(error))}", 2)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else "a file or standard output: "
        return _end(f"error: {place}{(error.strerror or str(error)).lower()}", 2)
    except MemoryError:
        return _end("error: this needs more memory than there is", 2)
    except Exception as error:
        if _INTERRUPTED.is_set():
            return _end("interrupted", INTERRUPTED)
        if wants_trace:
            traceback.print_exc()
        hint = "" if wants_trace else "; --verbose shows where"
        return _end(f"error: a fault of scanspan: {type(error).__name__}: {error}{hint}", 3)


def _interrupt(*_: object) -> None:
    """Remember Ctrl-C, and raise it; the imports of some libraries swallow what is raised in them."""
    _INTERRUPTED.set()
    raise KeyboardInterrupt


def check_interrupt() -> None:
    """Raise a Ctrl-C that was swallowed."""
    if _INTERRUPTED.is_set():
        raise KeyboardInterrupt


def _to_option(name: re.Match[str]) -> str:
    """Return the option that sets an argument of the library."""
    return f"--{name[0].replace('_', '-')}"


def _plain(message: str) -> str:
    """Return a message of typer without the full stop that the others do not have."""
    return message.strip().removesuffix(".")


def _end(message: str, code: int) -> int:
    """Write the last line, and return the exit code."""
    with contextlib.suppress(OSError):
        print(f"scanspan: {to_line(message)}", file=sys.stderr, flush=True)
    return code
