"""Compare what is covered with the exact oracle on random triangles: `python -m tests.verify --seed 1 --count 10000000`.

Every triangle is drawn alone into its own image of at most 64 x 64 pixels and compared in every pixel. Triangles come in
batches that share image size, rule, culling and sub-pixel bits. A batch is drawn from (seed, batch number) alone, so that a
counter-example is found again whatever the number of processes. Each batch also goes through `count` and `rasterize` as one
crowded scene, and a few of its samples through the rational oracle, which checks the exact oracle itself.

Then every algorithm draws scenes in every order (agreement.py), the more the more triangles are asked for.

The program prints what was compared, so that "0 wrong pixels" cannot come from comparing nothing; a difference makes it exit
with 1.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests import exact, reference

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]
CountEach = Callable[..., NDArray[Any]]

BATCH = 4096  # Triangles that share an image size and options.
FARTHEST = 1e7  # Pixels from the origin.
SIDES = (1, 3, 8, 8, 13, 16, 16, 16, 24, 32, 32, 48, 64)  # Widths and heights, drawn alike: 470 samples an image on average.
BITS = (4, 8, 8, 8, 12, 16)
SPANS = (0.1, 1.0, 4.0, 16.0, 64.0, 1e3, 1e5, FARTHEST)  # Bounds of the size classes of a triangle, in pixels.
SPAN_WEIGHTS = (3, 5, 5, 5, 4, 2, 2)
TIED = 0.13  # Share of triangles laid so that samples fall on their edges; some of these miss the image.
KEPT_EXAMPLES = 5
REFERENCE_SAMPLES = 12  # Samples of a batch that the rational oracle decides as well.


class Point:
    """An off-screen point for the oracles, when the library's own class is not at hand."""

    def __init__(self, x: float, y: float, w: float = 1) -> None:
        self.x, self.y, self.w = x, y, w

    def __repr__(self) -> str:
        return f"OffscreenPoint({self.x!r}, {self.y!r}, {self.w!r})"


@dataclass
class Batch:
    """Triangles in pixels that share an image size and options; `tied` marks those laid with samples on their edges."""

    vertices: Floats
    tied: Booleans
    size: tuple[int, int]
    rule: Any
    subpixel_bits: int
    cull: str

    def options(self) -> dict[str, Any]:
        """Return the options in the names of the public functions."""
        return {"rule": self.rule, "subpixel_bits": self.subpixel_bits, "cull": self.cull}


@dataclass
class Tally:
    """What was compared and what was wrong; tallies of several batches add up."""

    triangles: int = 0
    samples: int = 0
    wrong: int = 0
    rows: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    examples: list[str] = field(default_factory=list)

    def add(self, name: str, triangles: int, samples: int, covered: int, tied: int, wrong: int) -> None:
        """Add numbers to the row of the histogram that has this name."""
        row = np.array([triangles, samples, covered, tied, wrong], dtype=np.int64)
        self.rows[name] = self.rows.get(name, np.zeros_like(row)) + row

    def merge(self, other: Tally) -> None:
        """Add another tally to this one."""
        self.triangles += other.triangles
        self.samples += other.samples
        self.wrong += other.wrong
        for name, row in other.rows.items():
            self.add(name, *(int(number) for number in row))
        self.examples = (self.examples + other.examples)[:KEPT_EXAMPLES]

    def table(self) -> str:
        """Return the histogram as text, rows in order of kind and size."""
        lines = [f"{'':24}{'triangles':>14}{'samples':>18}{'covered':>16}{'on an edge':>14}{'wrong':>9}"]
        for name in sorted(self.rows):
            numbers = self.rows[name]
            columns = (f"{number:>{width},}" for number, width in zip(numbers, (14, 18, 16, 14, 9), strict=True))
            lines.append(f"{name.rpartition('|')[2]:24}" + "".join(columns))
        return "\n".join(lines)


def _random_rule(random: np.random.Generator) -> Any:
    """Return a rule: the default in six of ten batches, an off-screen point near, far, or at infinity in one of ten."""
    choice = random.random()
    for bound, rule in ((0.6, "top-left"), (0.74, "bottom-left"), (0.82, "inclusive"), (0.9, "exclusive")):
        if choice < bound:
            return rule
    kind = random.integers(3)
    if kind == 0:
        return Point(*(float(value) for value in random.integers(-80, 160, 2) / 2))
    if kind == 1:
        return Point(*(float(value) for value in random.integers(-(10**6), 10**6, 2)))
    return Point(*((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, -2.0))[random.integers(5)], 0.0)


def free_triangles(random: np.random.Generator, count: int, size: tuple[int, int], bits: int, span: Floats) -> Floats:
    """Return triangles of given spans in pixels about points near the image: round ones, needles, some without area."""
    anchor = random.uniform(-1.5, 1.5, (count, 1, 2)) + random.random((count, 1, 2)) * np.array(size)
    angle = random.random((count, 3)) * 2 * np.pi
    radius = span[:, None] * random.uniform(0.3, 1.0, (count, 3)) * 0.6
    vertices: Floats = anchor + radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    # Make needles: the third vertex comes within a few sub-pixels, or a pixel, of the line through the others.
    kind = random.integers(0, 10, count)
    along, aside = random.uniform(-0.2, 1.2, (count, 1)), random.normal(0, 1, (count, 2))
    aside *= np.where(random.random((count, 1)) < 0.5, 2.0**-bits, 0.5)
    on_line = vertices[:, 0] + along * (vertices[:, 1] - vertices[:, 0]) + aside
    vertices[:, 2] = np.where((kind < 2)[:, None], on_line, vertices[:, 2])

    # Level an edge, put a vertex at the anchor, take the area away, and put coordinates half-way between sub-pixels.
    axis = int(random.integers(2))
    vertices[kind == 2, 1, axis] = vertices[kind == 2, 0, axis]
    vertices[kind == 3, 0] = anchor[kind == 3, 0]
    flat = (kind == 4) & (random.random(count) < 0.1)
    vertices[flat, 1] = vertices[flat, 2]
    halfway = kind == 5
    vertices[halfway] = (np.floor(vertices[halfway] * 2.0**bits) + 0.5) / 2.0**bits
    return vertices


def tied_triangles(random: np.random.Generator, count: int, size: tuple[int, int], bits: int, span: Floats) -> Floats:
    """Return triangles with an edge laid exactly through a sample of the image, often through many, or with a vertex on one."""
    scale = 1 << bits
    sample = (np.floor(random.random((count, 2)) * np.array(size)) + 0.5) * scale
    reach = np.maximum(span * scale, 2.0)

    # Step from the sample in a direction of whole sub-pixels, or of whole pixels so that the edge meets more samples.
    angle, before, after = random.random(count) * 2 * np.pi, random.integers(0, 4, count), random.integers(1, 4, count)
    step = np.rint(np.stack([np.cos(angle), np.sin(angle)], axis=-1) * (reach / (before + after))[:, None])
    pixels = random.integers(-2, 3, (count, 2)) * float(scale)
    times = np.maximum(np.rint(reach / (before + after) / (3 * scale)), 1.0)
    step = np.where((random.random(count) < 0.6)[:, None], pixels * times[:, None], step)
    first, second = sample - before[:, None] * step, sample + after[:, None] * step

    # Put the third vertex aside, on another sample, or on the lattice of half pixels.
    third = sample + random.normal(0, 0.6, (count, 2)) * reach[:, None]
    third = np.where((random.random(count) < 0.5)[:, None], (np.floor(third / scale) + 0.5) * scale, np.rint(third))
    vertices = np.stack([first, second, third], axis=1) / scale
    lattice = random.random(count) < 0.25
    vertices[lattice] = np.rint(vertices[lattice] * 2) / 2
    turned = random.random(count) < 0.5
    vertices[turned] = vertices[turned][:, ::-1]
    return vertices


def make_batch(seed: int, number: int, count: int = BATCH) -> Batch:
    """Return one batch of random triangles; the same numbers give the same batch."""
    random = np.random.default_rng([seed, number])
    size = (int(random.choice(SIDES)), int(random.choice(SIDES)))
    bits = int(random.choice(BITS))
    weights = np.array(SPAN_WEIGHTS) / sum(SPAN_WEIGHTS)
    kind = random.choice(len(weights), count, p=weights)
    low, high = np.log(np.array(SPANS)[kind]), np.log(np.array(SPANS)[kind + 1])
    span = np.exp(low + random.random(count) * (high - low))
    tied = random.random(count) < TIED
    vertices = free_triangles(random, count, size, bits, span)
    vertices[tied] = tied_triangles(random, int(tied.sum()), size, bits, span[tied])
    cull = str(random.choice(["none", "none", "none", "back", "front"]))
    return Batch(np.clip(vertices, -FARTHEST, FARTHEST), tied, size, _random_rule(random), bits, cull)


def _example(batch: Batch, name: str, triangle: int, x: int, y: int, expected: object, got: object) -> str:
    vertices = batch.vertices[triangle].tolist()
    return f"{name}: {vertices}, size={batch.size}, {batch.options()}: pixel ({x}, {y}) is {got}, expected {expected}"


def _classes(batch: Batch) -> Iterator[tuple[str, Booleans]]:
    """Yield the rows of the histogram with the triangles that belong to each."""
    extent = (batch.vertices.max(axis=1) - batch.vertices.min(axis=1)).max(axis=1)
    place = np.searchsorted(np.array(SPANS), extent)
    for k in range(len(SPANS) + 1):
        low = f"{SPANS[k - 1]:g} to " if k else "below "
        name = f"{low}{SPANS[k]:g} px" if k < len(SPANS) else f"above {SPANS[-1]:g} px"
        yield f"0|{k}|size {name}", place == k
    everyone = np.ones(len(place), dtype=np.bool_)
    yield f"1|{batch.subpixel_bits:02}|{batch.subpixel_bits} bits", everyone
    yield "2|" + (batch.rule if isinstance(batch.rule, str) else "off-screen point"), everyone
    yield f"3|cull {batch.cull}", everyone
    yield "4|laid on samples", batch.tied
    yield "5|reaching 10^6 px", np.abs(batch.vertices).max(axis=(1, 2)) >= 1e6


def check_each(batch: Batch, count_each: CountEach, tally: Tally) -> Booleans:
    """Compare every triangle of a batch, drawn alone, and return what the oracle says."""
    expected = exact.coverage(batch.vertices, batch.size, **batch.options())
    got = np.asarray(count_each(batch.vertices, batch.size, **batch.options()))
    if got.shape != expected.shape:
        tally.wrong += expected.size
        tally.examples.append(f"count_each returned shape {got.shape}, expected {expected.shape}")
        return expected

    # Count what was covered, what lay on an edge (of those laid so), and what was wrong.
    differs = got != expected
    covered, wrong = expected.sum(axis=(1, 2)), differs.sum(axis=(1, 2))
    on_edge = np.zeros(len(expected), dtype=np.int64)
    on_edge[batch.tied] = exact.samples_on_edges(batch.vertices[batch.tied], batch.size, batch.subpixel_bits)
    area = batch.size[0] * batch.size[1]
    for name, members in _classes(batch):
        sums = (int(numbers[members].sum()) for numbers in (covered, on_edge, wrong))
        tally.add(name, int(members.sum()), int(members.sum()) * area, *sums)
    tally.add("6|with samples on edges", int((on_edge > 0).sum()), int((on_edge > 0).sum()) * area, 0, int(on_edge.sum()), 0)
    tally.triangles += len(expected)
    tally.samples += expected.size
    tally.wrong += int(wrong.sum())
    for k, y, x in np.argwhere(differs)[:KEPT_EXAMPLES]:
        tally.examples.append(_example(batch, "count_each", int(k), int(x), int(y), int(expected[k, y, x]), int(got[k, y, x])))
    return expected


def check_reference(batch: Batch, expected: Booleans, random: np.random.Generator, tally: Tally) -> None:
    """Compare the exact oracle with the rational one at some samples, half of them where coverage changes."""
    changes = np.argwhere(expected[:, :, 1:] != expected[:, :, :-1])
    for turn in range(REFERENCE_SAMPLES):
        k, y, x = (int(random.integers(0, length)) for length in expected.shape)
        if turn % 2 and len(changes):
            k, y, x = (int(value) for value in changes[random.integers(len(changes))])
        truth = reference.covers(batch.vertices[k].tolist(), x, y, batch.rule, batch.subpixel_bits, batch.cull)
        tally.add("7|against rationals", 0, 1, int(truth), 0, int(truth != expected[k, y, x]))
        if truth != expected[k, y, x]:
            tally.wrong += 1
            tally.examples.append(_example(batch, "exact oracle", k, x, y, truth, bool(expected[k, y, x])))


def check_scene(batch: Batch, expected: Booleans, tally: Tally) -> None:
    """Compare the public `count` with the sum of a batch, and `rasterize` with the nearest of its first hundred triangles."""
    import scanspan

    counts = np.asarray(scanspan.count(batch.vertices, batch.size, **batch.options()))
    _check_image(batch, "count", expected.sum(axis=0), counts, 0, tally)

    # Lay the triangles at depths of sixteenths, many of them equal; of equal ones the lower number is seen.
    vertices, (width, height) = batch.vertices[:100], batch.size
    depth = (np.arange(len(vertices)) * 7 % 16 + 1) / 32
    w = np.where(np.arange(len(vertices)) % 3 == 0, 2.0, 1.0)
    x, y = vertices[..., 0] * (2 / width) - 1, 1 - vertices[..., 1] * (2 / height)
    z = np.broadcast_to((1 - 2 * depth)[:, None], x.shape)
    clip = np.stack([x, y, z, np.ones_like(x)], axis=-1) * w[:, None, None]
    triangles = np.arange(3 * len(vertices)).reshape(-1, 3)
    visibility = scanspan.rasterize(clip.reshape(-1, 4), triangles, batch.size, **batch.options())

    # Go back to the screen as the contract has it, because dividing by w and the width rounds.
    back = np.stack([(clip[..., 0] / clip[..., 3] + 1) * width / 2, (1 - clip[..., 1] / clip[..., 3]) * height / 2], axis=-1)
    covered = exact.coverage(back, batch.size, **batch.options())
    order = np.argsort(-depth, kind="stable")
    first = covered[order].argmax(axis=0)
    primitive = np.where(covered.any(axis=0), order[first], -1)
    _check_image(batch, "primitive", primitive, np.asarray(visibility.primitive), -1, tally)
    seen = np.where(primitive >= 0, depth[primitive], -np.inf)
    _check_image(batch, "depth", seen, np.asarray(visibility.depth).astype(np.float64), -np.inf, tally)


def _check_image(batch: Batch, name: str, expected: NDArray[Any], got: NDArray[Any], nothing: float, tally: Tally) -> None:
    """Compare one image that shows a whole batch; `nothing` is the value where there is nothing."""
    wrong = np.argwhere(expected != got) if expected.shape == got.shape else np.zeros((expected.size, 2), dtype=np.int64)
    tally.add(f"8|{name} of a scene", 0, expected.size, int((expected != nothing).sum()), 0, len(wrong))
    tally.wrong += len(wrong)
    for y, x in wrong[:1]:
        shown = (expected[y, x], got[y, x]) if expected.shape == got.shape else (expected.shape, got.shape)
        place = f"size={batch.size}, {batch.options()}: pixel ({x}, {y})"
        tally.examples.append(f"{name} of a scene of {len(batch.vertices)}: {place} is {shown[1]}, expected {shown[0]}")


def library_count_each() -> CountEach:
    """Return the library's function that draws each triangle alone with the very kernel of `count`."""
    from scanspan import pipeline

    function: CountEach = pipeline.count_each
    return function


def library_batch(batch: Batch) -> Batch:
    """Return the batch with the library's own off-screen point in place of the oracles'."""
    if isinstance(batch.rule, Point):
        import scanspan

        batch.rule = scanspan.OffscreenPoint(batch.rule.x, batch.rule.y, batch.rule.w)
    return batch


def run_batch(seed: int, number: int, count: int, count_each: CountEach | None = None) -> Tally:
    """Compare one batch in every way; `count_each` stands in for the library's, when given."""
    tally = Tally()
    batch = library_batch(make_batch(seed, number, count))
    expected = check_each(batch, count_each or library_count_each(), tally)
    check_reference(batch, expected, np.random.default_rng([seed, number, 1]), tally)
    check_scene(batch, expected, tally)
    tally.examples = [f"seed {seed}, batch {number}: {text}" for text in tally.examples[:KEPT_EXAMPLES]]
    return tally


def run(seed: int, count: int, processes: int = 1, batch: int = BATCH, report: Callable[[int], None] | None = None) -> Tally:
    """Compare `count` triangles in batches and return the tally; `report` hears how many are done."""
    starts = range(0, count, batch)
    sizes = [min(batch, count - start) for start in starts]
    total = Tally()
    if processes <= 1:
        for number, size in enumerate(sizes):
            total.merge(run_batch(seed, number, size))
            if report:
                report(total.triangles)
        return total
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        for tally in pool.map(run_batch, [seed] * len(sizes), range(len(sizes)), sizes, chunksize=4):
            total.merge(tally)
            if report:
                report(total.triangles)
    return total


def run_agreement(seed: int, tasks: list[tuple[int, int]], processes: int = 1) -> Tally:
    """Compare all algorithms and orders with each other and with the oracle, and return the tally."""
    from tests import agreement

    total = Tally()
    if processes <= 1:
        for task in tasks:
            total.merge(agreement.run_task(seed, task))
        return total
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        for tally in pool.map(agreement.run_task, [seed] * len(tasks), tasks, chunksize=4):
            total.merge(tally)
    return total


def main(arguments: list[str] | None = None) -> int:
    """Run the comparison as a program; return 0 when no pixel is wrong."""
    description = "Compare random triangles with the exact oracle."
    parser = argparse.ArgumentParser(prog="python -m tests.verify", description=description)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200_000, help="number of triangles")
    parser.add_argument("--processes", type=int, default=min(2, os.cpu_count() or 1))
    options = parser.parse_args(arguments)
    if options.count < 1 or options.processes < 1 or options.seed < 0:
        parser.error("--count and --processes must be at least 1, and --seed at least 0")
    started = time.monotonic()

    def report(done: int) -> None:
        if sys.stderr.isatty():
            seconds = time.monotonic() - started
            print(f"\r{done:,} of {options.count:,} triangles, {seconds:.0f} s", end="", file=sys.stderr, flush=True)

    from tests import agreement

    tally = run(options.seed, options.count, options.processes, report=report)
    tasks = agreement.plan(options.seed, options.count)
    tally.merge(run_agreement(options.seed, tasks, options.processes))
    if sys.stderr.isatty():
        print(file=sys.stderr)
    print(tally.table())
    for text in tally.examples:
        print(f"counter-example: {text}")
    print(agreement.summary(tasks, tally))
    seconds = time.monotonic() - started
    print(f"seed {options.seed}: {tally.triangles:,} triangles, {tally.samples:,} samples, {seconds:.0f} s")
    print(f"{tally.wrong} wrong pixels")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
