"""The command `scanspan draw`: an SVG file or a map in, a picture out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from scanspan.errors import InputError
from scanspan.view import options
from scanspan.view.reporter import Reporter

Drawing = Annotated[str, typer.Argument(metavar="FILE", help="SVG, GeoJSON, TopoJSON, or JSON with a list of rings.")]
Output = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help="The picture: .png .jpg .ppm .npy; - is a PNG on standard output."),
]
Resolution = Annotated[str | None, typer.Option(metavar="W,H", help="Width and height in pixels; by default the file's own.")]
Size = Annotated[str | None, typer.Option(metavar="WxH", help="The same as 1920x1080, or one number for a square.")]
Antialias = Annotated[
    bool, typer.Option("--antialias/--no-antialias", help="Blend pixels by the exact share of them that is covered.")
]
Background = Annotated[str, typer.Option("--background-color", metavar="COLOR", help="A CSS name or '#rrggbb'.")]
MaxBytes = Annotated[int, typer.Option(metavar="N", min=1, help="Refuse larger files.")]
Fill = Annotated[str | None, typer.Option(metavar="COLOR", help="Fill what is filled with this; none for nothing.")]
Stroke = Annotated[str | None, typer.Option(metavar="COLOR", help="Draw the lines in this; none for nothing.")]
StrokeWidth = Annotated[float | None, typer.Option(metavar="PX", min=0, help="The width of all lines in pixels.")]
Fit = Annotated[str, typer.Option("--fit", metavar="NAME", help="page, what the file says; or content, all that is in it.")]
FileType = Annotated[str | None, typer.Option("--file-type", metavar="TYPE", help="svg, geojson, topojson or json.")]


def draw(
    drawing: Drawing,
    output: Output = None,
    resolution: Resolution = None,
    size: Size = None,
    antialias: Antialias = True,
    background_color: Background = "white",
    no_background: options.NoBackground = False,
    fill: Fill = None,
    stroke: Stroke = None,
    stroke_width: StrokeWidth = None,
    fit: Fit = "page",
    file_type: FileType = None,
    max_bytes: MaxBytes = 1 << 28,
    verbose: options.Verbose = False,
) -> None:
    """Draw an SVG file or a map, and print the picture's path.

    [bold]scanspan draw logo.svg -o logo.png --size 512[/bold]

    [bold]scanspan draw countries.geojson -o world.png --size 1920x1080 --fill wheat --stroke black[/bold]
    """
    from scanspan.view.shot import parse_size

    extent = parse_size(resolution, size, (0, 0)) if resolution or size else None
    target = output or f"{Path(drawing).stem}.png"
    if target != "-" and os.path.exists(target) and os.path.exists(drawing) and os.path.samefile(target, drawing):
        raise InputError(f"--output = {target!r}: is the drawing itself, which is not overwritten")
    with Reporter(verbose) as reporter:
        reporter.stage(f"reading {drawing}")
        from scanspan.assets.drawing import load_drawing

        opened = load_drawing(drawing, file_type=file_type, max_bytes=max_bytes)
        for note in opened.notes:
            reporter.note(f"note: {drawing}: {note}")
        reporter.stage(f"drawing {len(opened.shapes)} shapes")
        reporter.await_kernels()
        import scanspan.drawings as faces
        from scanspan.target.image import encode_image, image_format, write_bytes

        kind = "png" if target == "-" else image_format(target)
        background = "transparent" if no_background else background_color
        canvas = faces.draw(
            opened, extent, background=background, antialias=antialias, fill=fill, stroke=stroke, stroke_width=stroke_width,
            fit=fit,
        )  # fmt: skip
        encoded = encode_image(canvas.pixels, kind)
        if target != "-":
            write_bytes(target, encoded)
    from scanspan.cli import write_out

    write_out(encoded if target == "-" else f"{target}\n")
