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

from benchmarks.peers import FILL, OURS, PEERS


@dataclass
class Timings:
    """Seconds of every repetition of one peer on one scene; `absent` says why there are none."""

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)
    convert: list[float] = field(default_factory=list)
    covered: int = 0
    absent: str = ""


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


def scene_table(name: str, count: int, area: float, size: tuple[int, int], timings: dict[str, Timings]) -> str:
    """Return the table of a scene; a ratio above 1 in the column of scanspan's time says that scanspan is that much faster."""
    medians = {peer: statistics.median(times.cpu) for peer, times in timings.items() if times.cpu}
    lines = [
        f"### Scene {name}: {count:,} triangles, {area / count:,.1f} px each, {size[0]} x {size[1]}",
        "",
        "| peer | draw, CPU time | draw, wall | convert, CPU time | M triangles/s | Mpx/s | covered px "
        "| of scanspan's time | of memory fill | of scanspan's, converting too |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    whole = {peer: medians[peer] + statistics.median(timings[peer].convert) for peer in medians}
    for peer, times in timings.items():
        if times.absent:
            lines.append(f"| {peer} | not run: {times.absent} | | | | | | | | |")
            continue
        own = medians[peer]
        rates = ("", "") if peer == FILL else (f"{count / own / 1e6:.3g}", f"{area / own / 1e6:.4g}")
        cells = [
            median_and_range(times.cpu),
            median_and_range(times.wall),
            seconds(statistics.median(times.convert)),
            *rates,
            f"{times.covered:,}",
            ratio(own, medians[OURS]) if OURS in medians else "-",
            ratio(own, medians[FILL]) if FILL in medians else "-",
            ratio(whole[peer], whole[OURS]) if OURS in whole else "-",
        ]
        lines.append(f"| {peer} | " + " | ".join(cells) + " |")
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


def heading(repetitions: int, core: int | None, scale: float) -> str:
    """Return what a reader has to know to judge the tables: machine, versions, method."""
    packages = ", ".join(_version(package) for package in ("scanspan", "numpy", "numba", "opencv-python-headless"))
    pinned = f"pinned to core {core}" if core is not None else "not pinned"
    shrunk = "" if scale == 1 else f" Scenes have {scale:g} times their triangles."
    lines = [
        "## Benchmarks",
        "",
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, Python {sys.version.split()[0]}, {packages}.",
        f"One worker process a peer, {pinned}, one thread, {repetitions} repetitions in turns, median [lowest, highest].",
        "Drawing includes clearing and, for meshes, the transformation; converting is from the scene's arrays to the peer's.",
        'Ratios are of CPU time: 2.00 x "of scanspan\'s time" means that scanspan takes half as long.' + shrunk,
        "",
        *(f"- {peer}: {gives}." for peer, (_, gives) in PEERS.items()),
        "",
    ]
    return "\n".join(lines)
