"""The commands `scanspan lecture list` and `scanspan lecture run`: the slides' experiments, as numbers and pictures."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scanspan.errors import InputError
from scanspan.view import options
from scanspan.view.reporter import Reporter

if TYPE_CHECKING:
    from scanspan.lectures.experiments import Experiment, Result

ALL_SECONDS = 120  # the kernels of all experiments together

lecture = typer.Typer(rich_markup_mode="rich", context_settings={"help_option_names": ["-h", "--help"]})

Number = Annotated[int | None, typer.Option("--lecture", metavar="N", min=0, max=4, help="One lecture alone, 0 to 4.")]
Search = Annotated[str | None, typer.Option("--search", metavar="WORD", help="Those alone whose text has this word.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="An experiment's name; all for the report.")]
Output = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="PATH", help="The picture, .png .jpg .ppm .npy, or a folder to put it into."),
]


@lecture.callback(invoke_without_command=True)
def start(context: typer.Context) -> None:
    """Run what the slides of five lectures on rasterization say, show and ask."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help().rstrip())


@lecture.command("list")
def list_experiments(number: Number = None, search: Search = None) -> None:
    """List the experiments by lecture and slide.

    [bold]scanspan lecture list --lecture 2[/bold]
    """
    from scanspan.lectures.experiments import EXPERIMENTS
    from scanspan.lectures.report import LECTURES

    chosen = [one for one in EXPERIMENTS if (number is None or one.lecture == f"S{number}") and has_word(one, search)]
    if not chosen:
        raise InputError(f"--search = {search!r}: no experiment has it; there are {len(EXPERIMENTS)}")
    width = max(len(one.name) for one in chosen)
    for name, title in LECTURES.items():
        within = [one for one in chosen if one.lecture == name]
        if within:
            typer.echo(f"{name}  {title}")
            for one in within:
                typer.echo(f"  {one.name:<{width}}  {one.title}  [{one.slide}, {one.told_lines}]")
    typer.echo(f"{len(chosen)} experiments; scanspan lecture run NAME prints the numbers of one, -o out.png writes its picture")


def has_word(one: Experiment, word: str | None) -> bool:
    """Say whether an experiment's text has a word; without one, every text has it."""
    return word is None or word.lower() in " ".join((one.name, one.title, one.slide, one.idea)).lower()


@lecture.command("run")
def run_experiment(name: Name, output: Output = None, verbose: options.Verbose = False) -> None:
    """Run an experiment: print its numbers, and write its picture where -o says. Run all of them for a report.

    [bold]scanspan lecture run moving-slivers -o slivers.png[/bold]

    [bold]scanspan lecture run all -o out/[/bold]
    """
    from scanspan.cli import write_out

    with Reporter(verbose) as reporter:
        reporter.stage("starting")
        from scanspan.lectures.experiments import EXPERIMENTS, find_experiment

        if name == "all":
            from scanspan.jit import on_first_compile

            on_first_compile(lambda: reporter.note(f"compiling kernels for this machine, once (about {ALL_SECONDS} s)"))
        else:
            reporter.await_kernels()
            one, target = find_experiment(name), output_file(name, output)
            reporter.stage(f"running {name}")
            found = one.run()
            if target is not None:
                from scanspan.target.image import write_image

                write_image(target, found.picture)
    if name == "all":
        write_out(make_report(EXPERIMENTS, output_folder("out" if output is None else output)))
    else:
        write_out(describe(one, found) + (f"{target}\n" if target is not None else ""))


def describe(one: Experiment, found: Result) -> str:
    """Return what is printed of an experiment."""
    from scanspan.lectures.experiments.experiment import aligned

    source = one.find_source()
    head = f"{one.title}\n{one.lecture}, {one.slide!r}, {one.told_lines}\n\n{folded(one.idea)}\n\n"
    pictures = "".join(f"  {number}. {shown.caption}\n" for number, shown in enumerate(found.panels, start=1))
    done_by = source.code.split("\n")[source.line - source.first].strip()
    return f"{head}{aligned(found.numbers)}\n\npictures:\n{pictures}\n{source.file}:{source.line}\n    {done_by}\n"


def folded(text: str, width: int = 100) -> str:
    r"""Return a text in lines of some width.

    >>> folded("one two three", 8)
    'one two\nthree'
    """
    import textwrap

    return textwrap.fill(text, width)


def output_file(name: str, output: str | None) -> str | None:
    """Return the file for a picture, or None for none; a folder gets a file with the experiment's name."""
    if output is None:
        return None
    if output.endswith(("/", os.sep)) or os.path.isdir(output):
        return str(output_folder(output) / f"{name}.png")
    from scanspan.target.image import image_format
    from scanspan.view.shot import naming

    with naming("--output"):
        if image_format(output) == "npz":
            raise InputError(f"--output = {output!r}: a picture is no .npz; expected .png, .jpg, .ppm or .npy")
    if not Path(output).parent.is_dir():
        raise InputError(f"--output = {output!r}: the folder {str(Path(output).parent)!r} does not exist")
    return output


def output_folder(output: str) -> Path:
    """Return a folder to write to, made if it is not there."""
    folder = Path(output)
    if not output or "\0" in output or folder.is_file():
        raise InputError(f"--output = {output!r}: expected the name of a folder")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def make_report(experiments: Sequence[Experiment], folder: Path) -> str:
    """Run all experiments, write the page, and return what is printed."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from scanspan.lectures.report import write_page
    from scanspan.target.image import write_bytes

    columns: list[Any] = [TextColumn("{task.description:<28}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()]
    console = Console(stderr=True, highlight=False)
    with Progress(*columns, console=console, disable=not sys.stderr.isatty(), transient=True) as progress:
        task = progress.add_task("starting", total=len(experiments))
        page = write_page(experiments, lambda one, number: progress.update(task, description=one.name, completed=number))
        progress.update(task, description="done", completed=len(experiments))
    target = folder / "index.html"
    write_bytes(target, page.encode())
    return f"{len(experiments)} experiments\n{target}\n"
