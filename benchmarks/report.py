"""Turns timings into Markdown: medians with ranges, ratios to scanspan and to memory fill, and the machine they come from."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.registry import FILL, PEERS, is_ours

RIGHT = 1e-3  # A picture counts as right where at most this share of its pixels is wrong: edge rules differ in ties.
PACKAGES = (
    "scanspan", "numpy", "numba", "opencv-python-headless", "pillow", "skia-python", "blend2d-py", "rasterio", "datashader",
    "scipy", "mapbox-earcut", "shapely", "exactextract", "pysdl2-dll", "moderngl", "panda3d", "vtk", "embreex",
)  # fmt: skip


@dataclass
class Timings:
    """Seconds of every repetition of one peer on one scene; `absent` says why there are none."""

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)
    convert: list[float] = field(default_factory=list)
    covered: int = 0
    wrong: int | None = None
    gives: str = ""
    absent: str = ""

    @property
    def is_right(self) -> bool:
        """Whether it is known that the output is as it should be, but for a few ties."""
        return self.wrong is not None and self.wrong <= RIGHT * max(1, self.covered)


@dataclass
class About:
    """What a table has to say of its scene."""

    name: str
    count: int
    unit: str
    area: float
    size: tuple[int, int]
    kind: str


Race = tuple[About, dict[str, Timings]]


def seconds(value: float) -> str:
    """Return a time with three significant digits in a unit that fits.

    >>> seconds(1.5), seconds(0.0123), seconds(4.2e-6)
    ('1.5 s', '12.3 ms', '4.2 us')
    """
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value >= size or unit == "us":
            break
    return f"{value / size:.{3 if value / size < 1000 else 4}g} {unit}"


def median_and_range(values: Sequence[float]) -> str:
    """Return the median of repetitions with the lowest and the highest.

    >>> median_and_range([0.002, 0.001, 0.004])
    '2 ms [1 ms, 4 ms]'
    """
    return f"{seconds(statistics.median(values))} [{seconds(min(values))}, {seconds(max(values))}]"


def ratio(value: float, to: float) -> str:
    """Return how many times longer a time is than another.

    >>> ratio(3.0, 2.0)
    '1.50 x'
    """
    return f"{value / to:.2f} x" if to > 0 else "-"


def _base(gives: str, timings: dict[str, Timings], medians: dict[str, float]) -> str | None:
    """Return which of scanspan's ways a peer is compared with: the fastest that gives the same, or else the fastest."""
    ours = [peer for peer in medians if is_ours(peer)]
    return min(ours, key=lambda peer: (timings[peer].gives != gives, medians[peer]), default=None)


def _row(peer: str, about: About, timings: dict[str, Timings], medians: dict[str, float]) -> str:
    """Return the row of a peer."""
    times = timings[peer]
    if times.absent:
        return f"| {peer} | not run: {times.absent} |" + " |" * 10
    whole = {name: medians[name] + statistics.median(timings[name].convert) for name in medians}
    own, base = medians[peer], _base(times.gives, timings, medians)
    filled = peer == FILL
    cells = [
        times.gives,
        median_and_range(times.cpu),
        median_and_range(times.wall),
        seconds(statistics.median(times.convert)),
        "" if filled else f"{about.count / own / 1e6:.3g}",
        "" if filled or about.kind == "triangulation" else f"{about.area / own / 1e6:.4g}",
        "" if filled else f"{times.covered:,}",
        "" if filled else "-" if times.wrong is None else f"{times.wrong:,}",
        ratio(own, medians[base]) if base else "-",
        ratio(own, medians[FILL]) if FILL in medians else "-",
        ratio(whole[peer], whole[base]) if base else "-",
    ]
    return f"| {peer} | " + " | ".join(cells) + " |"


def scene_table(about: About, timings: dict[str, Timings]) -> str:
    """Return the table of a scene; a ratio above 1 in the column of scanspan's time says that scanspan is that much faster."""
    medians = {peer: statistics.median(times.cpu) for peer, times in timings.items() if times.cpu}
    each = (
        f", {about.area / about.count:,.1f} px each"
        if about.kind in ("flat", "shaded", "mesh", "lines", "smooth lines")
        else ""
    )
    covered = ("triangles", "px of area missed") if about.kind == "triangulation" else ("covered px", "wrong px")
    lines = [
        f"### Scene {about.name}: {about.count:,} {about.unit}{each}, {about.size[0]} x {about.size[1]}",
        "",
        f"| peer | gives | draw, CPU time | draw, wall | convert, CPU time | M {about.unit}/s | Mpx/s | {covered[0]} "
        f"| {covered[1]} | of scanspan's time | of memory fill | of scanspan's, converting too |",
        "|---" * 12 + "|",
        *(_row(peer, about, timings, medians) for peer in timings),
    ]
    return "\n".join(lines) + "\n"


def _nearest(peers: dict[str, Timings], ours: float) -> str:
    """Return the fastest of some peers, how it compares with scanspan's time, and how much of it is wrong."""
    if not peers:
        return "none"
    peer = min(peers, key=lambda name: statistics.median(peers[name].cpu))
    wrong = peers[peer].wrong
    told = "" if not wrong else f", {wrong:,} px wrong"
    return f"{peer}: {ratio(statistics.median(peers[peer].cpu), ours)}{told}"


def summary_table(races: list[Race]) -> str:
    """Return one table of all races: scanspan's time for each form of output, and how its fastest opponents compare."""
    lines = [
        "### Summary",
        "",
        "Above 1 x scanspan is ahead. The same output is the same form of it with at most one pixel in a thousand wrong.",
        "",
        "| scene | output | scanspan | draw, CPU time | wrong px | fastest with the same output | fastest with any output |",
        "|---" * 7 + "|",
    ]
    for about, timings in races:
        run = {peer: times for peer, times in timings.items() if times.cpu and peer != FILL}
        others = {peer: times for peer, times in run.items() if not is_ours(peer)}
        ours = {peer: times for peer, times in run.items() if is_ours(peer)}
        if not ours:
            lines.append(f"| {about.name} | | not run | | | | {len(others)} others were |")
        for gives in dict.fromkeys(times.gives for times in ours.values()):
            alike = {peer: times for peer, times in ours.items() if times.gives == gives}
            peer = min(alike, key=lambda name: statistics.median(alike[name].cpu))
            own, wrong = statistics.median(alike[peer].cpu), alike[peer].wrong
            same = {
                name: times
                for name, times in others.items()
                if times.gives == gives and (times.is_right or times.wrong is None)
            }
            told = [peer.removeprefix("scanspan "), seconds(own), "-" if wrong is None else f"{wrong:,}"]
            lines.append(
                f"| {about.name} | {gives} | " + " | ".join([*told, _nearest(same, own), _nearest(others, own)]) + " |"
            )
    return "\n".join(lines) + "\n"


def short_table(races: list[Race]) -> str:
    """Return a table for those in a hurry: each scene that a right opponent draws, with the first form of its output.

    The opponent is the fastest whose output is as right as ours; ratios above 1 x say that scanspan is ahead.
    """
    lines = ["| scene | what is drawn | scanspan | fastest that is right | ahead by |", "|---" * 5 + "|"]
    for about, timings in races:
        run = {peer: times for peer, times in timings.items() if times.cpu and peer != FILL}
        ours = {peer: times for peer, times in run.items() if is_ours(peer)}
        gives = next(iter(ours.values())).gives if ours else ""
        same = {
            peer: statistics.median(times.cpu)
            for peer, times in run.items()
            if peer not in ours and times.gives == gives and (times.is_right or times.wrong is None)
        }
        if not ours or not same:
            continue
        own = min(statistics.median(times.cpu) for times in ours.values() if times.gives == gives)
        peer = min(same, key=lambda name: same[name])
        each = f" of {about.area / about.count:,.0f} px" if about.kind in ("flat", "shaded", "deep", "mesh") else ""
        what = f"{about.count:,} {about.unit}{each}, as {gives}"
        lines.append(f"| {about.name} | {what} | {seconds(own)} | {peer}, {seconds(same[peer])} | {ratio(same[peer], own)} |")
    return "\n".join(lines) + "\n"


def start_table(timings: dict[str, Timings]) -> str:
    """Return the table of whole processes, from their start to their end."""
    lines = ["### Start: whole processes", "", "| what runs | wall | CPU time |", "|---|---|---|"]
    for name, times in timings.items():
        cells = (
            f"not run: {times.absent} | " if times.absent else f"{median_and_range(times.wall)} | {median_and_range(times.cpu)}"
        )
        lines.append(f"| {name} | {cells} |")
    return "\n".join(lines) + "\n"


def _version(package: str) -> str:
    try:
        return f"{package} {importlib.metadata.version(package)}"
    except importlib.metadata.PackageNotFoundError:
        return f"{package} absent"


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        for line in listing.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def heading(repetitions: int, core: int | None, scale: float, budget: float, kinds: set[str]) -> str:
    """Return what a reader has to know to judge the tables: machine, versions, method, and what each peer gives."""
    packages = ", ".join(_version(package) for package in PACKAGES)
    pinned = f"pinned to core {core}" if core is not None else "not pinned"
    shrunk = "" if scale == 1 else f" Scenes have {scale:g} times their triangles, lines, points or corners."
    chosen = {name: peer for name, peer in PEERS.items() if kinds.intersection(peer.kinds)}
    lines = [
        "## Benchmarks",
        "",
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, Python {sys.version.split()[0]}, {packages}.",
        f"One worker process a peer, {pinned}, one thread, {repetitions} repetitions in turns, fewer for those that have taken "
        f"{budget:g} s on a scene; median [lowest, highest].",
        "Drawing includes clearing and, for meshes, the transformation; converting is from the scene's arrays to the peer's.",
        'Ratios are of CPU time: 2.00 x "of scanspan\'s time" means that scanspan takes half as long. It is compared by the '
        "fastest of its ways that gives the same output, or else by the fastest." + shrunk,
        "Wrong are pixels that differ from the picture that whole numbers give (benchmarks/exact.py): by more than 2 of 255 "
        "where colours change across a triangle, 8 where polygons are smooth, 16 where lines are; smooth lines in 400 of them.",
        "",
        *(f"- {name}: {peer.note}." for name, peer in chosen.items()),
        "",
    ]
    return "\n".join(lines)
