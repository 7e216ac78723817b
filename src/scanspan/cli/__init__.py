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
from typing import Annotated

import typer
from typer.main import get_command

from scanspan import __version__
from scanspan.cli import splat as trees
from scanspan.cli import study
from scanspan.cli.draw import draw
from scanspan.cli.ivscan import ivscan
from scanspan.cli.lecture import lecture
from scanspan.cli.rendering import STOPPED, Request, choose_output, given, run
from scanspan.cli.warming import Helper, warm
from scanspan.errors import InputError, ScanspanError
from scanspan.view import options
from scanspan.view.reporter import Reporter, to_line

DEFAULT_SIZE = (1280, 960)
INTERRUPTED = 130  # the exit code of a process that Ctrl-C ended

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
    camera_index: options.CameraIndex = None,
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
    no_translucency: options.NoTranslucency = False,
    lights: options.Lights = "auto",
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

    place = (direction, position, focal_point)
    shot = words.parse_shot(*place, view_up, view_angle, zoom, azimuth, elevation, orthographic, camera_index)
    names = words.parse_views(views)
    words.check_index(shot, names)
    if names and any(place):
        raise InputError("--views chooses where the eye stands: leave out --camera-direction, -position and -focal-point")
    background = words.parse_background(no_background, background_color)
    look = {
        "background": background, "shading": shading, "crease_angle": crease_angle, "edges": edges, "line_width": line_width,
        "cull": cull, "textures": not no_textures, "translucency": not no_translucency, "lights": lights, "samples": samples,
        "algorithm": algorithm, "order": order, "threads": threads, "subpixel_bits": subpixel_bits, "max_pixels": max_pixels,
    } | parts.parse_points(point_size, point_shape, color_by, eye_dome)  # fmt: skip
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
app.add_typer(trees.splat, name="splat")


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
    STOPPED.clear()
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
        if STOPPED.is_set():
            return _end("interrupted", INTERRUPTED)
        if wants_trace:
            traceback.print_exc()
        hint = "" if wants_trace else "; --verbose shows where"
        return _end(f"error: a fault of scanspan: {type(error).__name__}: {error}{hint}", 3)


def _interrupt(*_: object) -> None:
    """Remember Ctrl-C, and raise it; the imports of some libraries swallow what is raised in them."""
    STOPPED.set()
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
