"""The commands `scanspan splat build`, `render` and `info`: points in, a tree of splats; a tree in, a picture out."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from scanspan.errors import InputError
from scanspan.view import options
from scanspan.view.reporter import Reporter, to_line

if TYPE_CHECKING:
    from scanspan.cli.rendering import Request
    from scanspan.splat import SplatTree
    from scanspan.target.splat_frame import SplatFrame
    from scanspan.view.shot import Shot

ENDING = ".scansplat"
DEFAULT_SIZE = (1280, 960)

# What `scanspan render` has for scenes and a tree of splats cannot have, as it is where nothing was said.
USUAL = {
    "shading": "auto", "crease_angle": 40.0, "edges": False, "line_width": 1.0, "samples": 4, "algorithm": "half-space",
    "order": "rows", "subpixel_bits": 8, "textures": True,
}  # fmt: skip

splat = typer.Typer(rich_markup_mode="rich", context_settings={"help_option_names": ["-h", "--help"]})

Points = Annotated[str, typer.Argument(metavar="POINTS", help="LAS, LAZ, COPC, PLY, XYZ, PTS, CSV, NPY, or a mesh.")]
TreeFile = Annotated[str, typer.Argument(metavar="TREE", help=f"A file that ends in {ENDING}.")]
TreeOutput = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help=f"The tree; by default the name of the points with {ENDING}."),
]
Picture = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="FILE", help="The picture: .png .jpg .ppm .npy, or .npz; - is a PNG on standard output."
    ),
]  # fmt: skip
Error = Annotated[float, typer.Option(metavar="PIXELS", help="How far anything may lie from where it is drawn.")]
Budget = Annotated[int | None, typer.Option(metavar="N", help="Draw no more splats than that, 256 or more.")]
Deadline = Annotated[float | None, typer.Option(metavar="SECONDS", help="Take what is drawn when this time is over.")]
Backs = Annotated[str, typer.Option(metavar="NAME", help="none, or back: leave out what faces away; for closed surfaces.")]
Normals = Annotated[str, typer.Option(metavar="NAME", help="given, none, or estimate: find them from neighbours.")]
Exact = Annotated[bool, typer.Option("--exact", help="Keep the whole numbers of the file; a larger tree.")]
Memory = Annotated[str, typer.Option(metavar="SIZE", help="Memory to take, such as 512MB; 256MB at least.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with a build that was cut off.")]
AsJson = Annotated[bool, typer.Option("--json", help="As JSON.")]


class TreeLook(NamedTuple):
    """How a tree is to be drawn."""

    error: float = 1.0
    budget: int | None = None
    deadline: float | None = None
    cull: str = "none"
    background: Any = None
    threads: int | None = None
    max_pixels: int | None = None


@splat.callback(invoke_without_command=True)
def start(context: typer.Context) -> None:
    """Build trees of splats from points of any number, and draw as much of them as can be seen."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help().rstrip())


@splat.command()
def build(
    points: Points,
    output: TreeOutput = None,
    normals: Normals = "given",
    exact: Exact = False,
    max_memory: Memory = "512MB",
    resume: Resume = False,
    nonfinite: options.Nonfinite = "error",
    verbose: options.Verbose = False,
) -> None:
    """Build a tree of splats, and print its path.

    [bold]scanspan splat build survey.laz[/bold]

    [bold]scanspan splat build statue.ply -o statue.scansplat --normals estimate --max-memory 1GB[/bold]
    """
    target = output or f"{Path(points).stem}{ENDING}"
    if os.path.exists(target) and os.path.exists(points) and os.path.samefile(target, points):
        raise InputError(f"--output = {target!r}: is the file of points itself, which is not overwritten")
    with Reporter(verbose) as reporter:
        reporter.await_kernels()
        import scanspan.splat as face

        with Bar(reporter) as bar:
            tree = face.build(
                points, target, normals=normals, exact=exact, max_memory=max_memory, resume=resume, nonfinite=nonfinite,
                progress=bar.show,
            )  # fmt: skip
        count = max(tree.point_count, 1)
        reporter.detail(f"{tree!r}, {os.path.getsize(target) / count:.2f} bytes a point")
    write_out(f"{target}\n")


class Bar:
    """A bar on a terminal that shows how far a build has come, and nothing where nobody is watching."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter
        self._shown: Any = None
        self._stage, self._task = "", None

    def __enter__(self) -> Bar:
        """Start a bar where somebody can see it; the spinner makes room."""
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._reporter.__exit__()
            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("points"))
            self._shown = Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True))
            self._shown.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take the bar away."""
        if self._shown is not None:
            self._shown.stop()
            self._shown = None

    def show(self, stage: str, done: int, count: int) -> None:
        """Show how many points are done, of how many if that is known."""
        from scanspan.cli.rendering import check_interrupt

        check_interrupt()
        if stage != self._stage:
            self._reporter.detail(stage)
        if self._shown is not None:
            if stage != self._stage:
                if self._task is not None:
                    self._shown.remove_task(self._task)
                self._task = self._shown.add_task(to_line(stage), total=count or None)
            self._shown.update(self._task, completed=done, total=count or None)
        self._stage = stage


@splat.command()
def render(
    tree: TreeFile,
    output: Picture = None,
    resolution: options.Resolution = None,
    size: options.Size = None,
    error: Error = 1.0,
    budget: Budget = None,
    deadline: Deadline = None,
    cull: Backs = "none",
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
    threads: options.Threads = None,
    max_pixels: options.MaxPixels = None,
    verbose: options.Verbose = False,
) -> None:
    """Draw a tree of splats, and print the picture's path.

    [bold]scanspan splat render survey.scansplat -o survey.png --size 1920x1080[/bold]

    [bold]scanspan splat render statue.scansplat -o coarse.png --error 8 --camera-direction front[/bold]
    """
    from scanspan.view import shot as words

    shot = words.parse_shot(
        direction, position, focal_point, view_up, view_angle, zoom, azimuth, elevation, orthographic
    )  # fmt: skip
    background = words.parse_background(no_background, background_color)
    look = TreeLook(error, budget, deadline, cull, background, threads, max_pixels)
    extent, axis = words.parse_size(resolution, size, DEFAULT_SIZE), words.parse_axis(up)
    with Reporter(verbose) as reporter:
        printed = draw_tree(tree, output, extent, shot, axis, look, reporter)
    write_out(printed)


def draw_tree(
    path: str, output: str | None, size: tuple[int, int], shot: Shot, up: str | None, look: TreeLook, reporter: Reporter,
    fields: list[str] | None = None,
) -> bytes | str:  # fmt: skip
    """Draw a tree, write the picture, and return what goes to standard output."""
    from scanspan.cli.rendering import check_fields, choose_output
    from scanspan.target.frame import FIELDS
    from scanspan.target.image import encode_image, image_format, write_bytes

    target = choose_output(path, output, None, [], None)
    check_fields(fields, FIELDS)
    reporter.stage(f"reading {path}")
    tree = open_tree(path, up)
    reporter.detail(repr(tree))
    reporter.await_kernels()
    reporter.stage(f"rendering {path}")
    frame = draw_shot(tree, shot, size, look)
    reporter.detail(f"{frame.splats} splats, error {frame.error:.3g} px, {frame.bytes_read} bytes of splats read")
    if frame.coverage == 0:
        reporter.note("nothing of the model is in the picture")

    # Write it whole or not at all.
    is_arrays = target.lower().endswith(".npz")
    content: Any = frame.fields(fields or FIELDS) if is_arrays else frame.color
    encoded = encode_image(content, "png" if target == "-" else image_format(target))
    if target == "-":
        return encoded
    write_bytes(target, encoded)
    return f"{target}\n"


def draw_request(request: Request, reporter: Reporter) -> bytes | str:
    """Draw a tree that `scanspan render` was asked for, and say which of its options a tree cannot have."""
    odd = [name for name, value in USUAL.items() if request.look.get(name, value) != value]
    odd += [name for name in ("point_size", "point_shape", "color_by", "eye_dome") if name in request.look]
    odd += [name for name, value in (("views", request.views), ("json", request.metadata), ("color", request.color)) if value]
    odd += list(request.points)
    if odd:
        raise InputError(f"--{odd[0].replace('_', '-').replace('textures', 'no-textures')} does not go with a tree of splats")
    shared = {name: request.look[name] for name in ("cull", "background", "threads", "max_pixels") if name in request.look}
    return draw_tree(
        request.model, request.output, request.size, request.shot, request.up, TreeLook(**shared), reporter, request.fields
    )


def open_tree(path: str, up: str | None) -> SplatTree:
    """Return the tree of a file, with its up."""
    import scanspan.splat as face

    tree = face.open(path)
    tree.up = tree.up if up is None else up
    return tree


def draw_shot(tree: SplatTree, shot: Shot, size: tuple[int, int], look: TreeLook) -> SplatFrame:
    """Return the picture of a tree."""
    from scanspan.view.shot import make_camera

    scene: Any = tree  # a tree has the bounds, points and up that a camera asks a scene for
    camera = make_camera(scene, shot, size)
    asked: dict[str, Any] = {"error": look.error, "budget": look.budget, "cull": look.cull, "background": look.background}
    asked |= {"threads": look.threads} | ({} if look.max_pixels is None else {"max_pixels": look.max_pixels})
    if look.deadline is None:
        return tree.render(camera, size, **asked)
    return list(tree.refine(camera, size, deadline=look.deadline, **asked))[-1]


@splat.command()
def info(tree: TreeFile, as_json: AsJson = False) -> None:
    """Tell what is in a tree of splats.

    [bold]scanspan splat info survey.scansplat[/bold]
    """
    from scanspan.view.metadata import to_json, to_text

    record = describe_tree(tree)
    write_out((to_json(record) if as_json else to_text(record)) + "\n")


def describe_tree(path: str) -> dict[str, Any]:
    """Return what is known of a file of splats."""
    import numpy as np

    opened = open_tree(path, None)
    nodes, count = opened.nodes, opened.point_count
    leaves = nodes[opened.is_leaf]
    low, high = opened.bounds
    size = os.path.getsize(path)
    return {
        "file": path,
        "format": ENDING.removeprefix("."),
        "bytes": size,
        "bytes_per_point": round(size / count, 3) if count else None,
        "points": count,
        "splats": opened.splat_count,
        "nodes": len(nodes),
        "levels": opened.level_count,
        "color": opened.has_color,
        "normals": opened.has_normals,
        "up": opened.up,
        "bounds": [low.tolist(), high.tolist()],
        "extent": (high - low).tolist(),
        "largest_error": float(leaves["error"].max()) if count else 0.0,
        "typical_radius": float(np.median(leaves["splat_radius"])) if count else 0.0,
    }


def write_out(content: bytes | str) -> None:
    """Write to standard output."""
    from scanspan import cli

    cli.write_out(content)
