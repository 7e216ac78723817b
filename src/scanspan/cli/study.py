"""Commands to study with: why a pixel shows what it shows, and what each algorithm makes of a model."""

from __future__ import annotations

import time
from typing import Annotated, Any

import typer

from scanspan.errors import InputError
from scanspan.view import options
from scanspan.view.reporter import Reporter

DEFAULT_SIZE = (1280, 960)

# What is printed of Visibility.counters, and its headings.
COLUMNS = (
    ("samples_tested", "samples tested"),
    ("edge_evaluations", "edge values"),
    ("spans", "spans"),
    ("depth_tests", "depth tests"),
    ("writes", "writes"),
    ("subdivisions", "subdivisions"),
    ("insertions", "insertions"),
    ("swaps", "swaps"),
)

Pixel = Annotated[str, typer.Option("--pixel", metavar="X,Y", help="The pixel to explain; x to the right, y down.")]
Repeats = Annotated[int, typer.Option("--repeats", metavar="N", min=1, max=1000, help="Runs of each, taken in turns.")]


def parse_pixel(text: str) -> tuple[int, int]:
    """Return the two whole numbers of a pixel."""
    try:
        x, y = (int(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"--pixel = {text!r}: expected X,Y, two whole numbers") from None
    return x, y


def explain(
    model: options.Model,
    pixel: Pixel,
    resolution: options.Resolution = None,
    size: options.Size = None,
    up: options.Up = None,
    direction: options.Direction = None,
    algorithm: options.Algorithm = "half-space",
    verbose: options.Verbose = False,
) -> None:
    """Say why a pixel of a default picture shows what it shows.

    Lists every triangle that came near, with the exact values of its three edges, its depth, and what decided.

    [bold]scanspan explain part.stl --pixel 640,480[/bold]
    """
    import scanspan as ss
    from scanspan.view import shot as words

    x, y = parse_pixel(pixel)
    extent = words.parse_size(resolution, size, DEFAULT_SIZE)
    shot = words.Shot(words.parse_direction(direction))
    with Reporter(verbose) as reporter:
        reporter.stage("reading")
        scene = ss.load(model)
        reporter.stage("rendering")
        axis = words.parse_axis(up)
        camera = words.make_camera(scene if axis is None else ss.Scene(scene, up=axis), shot, extent)
        frame = ss.render(scene, camera, extent, samples=1, algorithm=algorithm)
        printed = str(ss.explain(frame, x, y))
    typer.echo(printed)


def algorithms(
    model: options.Model,
    resolution: options.Resolution = None,
    size: options.Size = None,
    repeats: Repeats = 3,
    threads: options.Threads = None,
    verbose: options.Verbose = False,
) -> None:
    """Rasterize a model with every algorithm in every order, compare the results bit for bit, and print times and work.

    The work is what each has counted: samples tested, edge values evaluated, spans, depths compared, samples written,
    subdivisions, and insertions and swaps in its active edge list. Ends with exit code 1 if any result differs.

    [bold]scanspan algorithms part.stl --size 640x480[/bold]
    """
    import scanspan as ss
    from scanspan.geometry.assemble import assemble
    from scanspan.raster.algorithms import KERNELS
    from scanspan.view import shot as words

    extent = words.parse_size(resolution, size, DEFAULT_SIZE)
    ways = [{"algorithm": name, "order": order} for name, known in KERNELS.items() for order in known]
    with Reporter(verbose) as reporter:
        reporter.stage("reading")
        scene = ss.load(model)
        camera = ss.Camera.frame(scene, aspect=extent[0] / extent[1], fit="points")
        draw = assemble(scene, camera, extent)
        seen: list[Any] = []
        work: list[dict[str, int]] = []
        for way in ways:
            reporter.stage(f"{way['algorithm']} in {way['order']}")
            seen.append(ss.rasterize(draw.clip, draw.triangles, extent, threads=threads, **way))  # type: ignore[arg-type]

        # Take the times in turns, so that what else the machine does hits all alike.
        times: list[list[float]] = [[] for _ in ways]
        for number in range(repeats):
            reporter.stage(f"timing, round {number + 1} of {repeats}")
            for taken, way in zip(times, ways, strict=True):
                start = time.perf_counter()
                ss.rasterize(draw.clip, draw.triangles, extent, threads=threads, **way)  # type: ignore[arg-type]
                taken.append(time.perf_counter() - start)
        for way, found in zip(ways, seen, strict=True):
            reporter.stage(f"counting {way['algorithm']} in {way['order']}")
            work.append(dict(found.counters))
    medians = [sorted(taken)[len(taken) // 2] for taken in times]
    same = [bool((found.primitive == seen[0].primitive).all() and (found.depth == seen[0].depth).all()) for found in seen]
    covered = int((seen[0].primitive >= 0).sum())
    typer.echo(f"{len(draw.triangles):,} triangles, {extent[0]} x {extent[1]}, {covered:,} pixels covered")
    typer.echo(f"{'algorithm':<14}{'order':<12}{'median':>10}{'ratio':>8}  result")
    for way, median, is_same in zip(ways, medians, same, strict=True):
        verdict = "identical" if is_same else "DIFFERENT"
        typer.echo(f"{way['algorithm']:<14}{way['order']:<12}{median * 1e3:>7.1f} ms{median / medians[0]:>7.2f}x  {verdict}")
    typer.echo("")
    typer.echo(f"{'algorithm':<14}{'order':<12}" + "".join(f"{name:>16}" for _, name in COLUMNS).rstrip())
    for way, counted in zip(ways, work, strict=True):
        numbers = "".join(f"{counted[key]:>16,}" if counted[key] else f"{'-':>16}" for key, _ in COLUMNS)
        typer.echo(f"{way['algorithm']:<14}{way['order']:<12}{numbers}".rstrip())
    typer.echo("all identical" if all(same) else "not all are identical")
    if not all(same):
        raise typer.Exit(1)
