"""The command `scanspan ivscan`: a scene in, five views of how it is scan-converted out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from scanspan.errors import InputError, unknown_name
from scanspan.view import options
from scanspan.view.reporter import Reporter

Scene = Annotated[str, typer.Argument(metavar="SCENE", help="An Open Inventor scene, .iv, or any model that `render` reads.")]
Folder = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="FOLDER", help="Where the views go; made if it is not there. By default the scene's name."
    ),
]  # fmt: skip
View = Annotated[
    str | None, typer.Option("--view", metavar="NAME", help="One view: input, pixels, edges, calls or result; by default all.")
]
Size = Annotated[str | None, typer.Option(metavar="WxH", help="Width and height of the picture in pixels; 96x72 by default.")]
Region = Annotated[
    str | None, typer.Option("--region", metavar="X0,Y0,X1,Y1", help="The pixels to magnify; by default all of them.")
]
Zoom = Annotated[int | None, typer.Option("--zoom", metavar="N", min=1, help="Pixels of a view for one of the picture.")]
Algorithm = Annotated[str, typer.Option(metavar="NAME", help="Whose calls are shown; `scanspan algorithms` compares them.")]
Order = Annotated[str, typer.Option(metavar="NAME", help="rows, serpentine, tiles, morton or hilbert, where it knows them.")]

DEFAULT_SIZE = (96, 72)


def parse_region(text: str | None) -> tuple[int, int, int, int] | None:
    """Return four whole numbers from "X0,Y0,X1,Y1", None from None.

    >>> parse_region("8,4,24,20")
    (8, 4, 24, 20)
    """
    if text is None:
        return None
    try:
        x_start, y_start, x_end, y_end = (int(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"--region = {text!r}: expected X0,Y0,X1,Y1, four whole numbers") from None
    return x_start, y_start, x_end, y_end


def ivscan(
    scene: Scene,
    output: Folder = None,
    view: View = None,
    size: Size = None,
    region: Region = None,
    zoom: Zoom = None,
    camera_index: options.CameraIndex = None,
    direction: options.Direction = None,
    up: options.Up = None,
    algorithm: Algorithm = "scanline-eval",
    order: Order = "rows",
    file_type: options.FileType = None,
    verbose: options.Verbose = False,
) -> None:
    """Show how a scene is scan-converted, five ways: the input, pixels outlined, edges outlined, the calls, the result.

    Writes input.png, pixels.png, edges.png, calls.png, calls.gif, calls.txt, result.png and report.txt, and prints the folder.

    [bold]scanspan ivscan chair.iv -o out[/bold]

    [bold]scanspan ivscan chair.iv -o out --view calls --size 320x240 --region 150,100,190,130[/bold]
    """
    from scanspan.lectures.ivscan import VIEWS
    from scanspan.view import shot as words

    extent = words.parse_size(None, size, DEFAULT_SIZE)
    window = parse_region(region)
    shot = words.Shot(words.parse_direction(direction), camera_index=camera_index)
    words.check_index(shot)
    if view is not None and view not in VIEWS:
        raise InputError(f"--view: {unknown_name('view', view, VIEWS)}")
    folder = Path(output if output is not None else Path(scene).name.split(".")[0] or "ivscan")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--output = {str(folder)!r}: is a file, expected a folder")
    with Reporter(verbose) as reporter:
        reporter.stage(f"reading {scene}")
        import scanspan as ss
        from scanspan.lectures import ivscan as program

        model = ss.load(scene, file_type=file_type)
        for note in model.notes:
            reporter.note(f"note: {scene}: {note}")
        axis = words.parse_axis(up)
        if axis is not None:
            model = ss.Scene(model.instances, axis, model.name, model.notes, model.cameras, model.lights)
        reporter.stage("recording the calls")
        reporter.await_kernels()
        session = program.scan(
            model, extent, camera=words.make_camera(model, shot, extent), region=window, zoom=zoom, algorithm=algorithm,
            order=order,
        )  # fmt: skip
        write_views(session, folder, [view] if view else list(VIEWS), scene, file_type, reporter)
    from scanspan.cli import write_out

    write_out(f"{folder}\n")


def write_views(session: object, folder: Path, names: list[str], scene: str, file_type: str | None, reporter: Reporter) -> None:
    """Write views into a folder, and what goes with the calls."""
    from scanspan.assets.inventor.report import listing_of, report_of
    from scanspan.lectures import ivscan as program
    from scanspan.target.image import encode_image, write_bytes

    assert isinstance(session, program.Session)
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise InputError(f"--output = {str(folder)!r}: {(error.strerror or str(error)).lower()}") from None
    for name in names:
        reporter.stage(f"drawing {name}")
        listing = listing_of(scene, file_type) if name == "input" else []
        write_bytes(folder / f"{name}.png", encode_image(program.draw_view(session, name, listing), "png"))
    if "calls" in names:
        write_bytes(folder / "calls.gif", program.animate(session))
        write_bytes(folder / "calls.txt", program.write_log(session).encode())
    if len(names) > 1:
        lines = [*report_of(scene, file_type), *program.describe_calls(session)]
        write_bytes(folder / "report.txt", "\n".join([*lines, ""]).encode())
