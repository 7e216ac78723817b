"""Agreement in full, for `python -m tests.verify`: every algorithm in every order, by rule, samples and sub-pixel bits.

A combination is a scene of the zoo, a rule, a number of samples and a grid. It is drawn in all ways and every picture
compared with that of half-space, rows: bit for bit, but for homogeneous rasterization of triangles that are cut, which has the
tolerance of the contract; what shows another triangle within it is counted under "on an edge". Depth bits, culling and threads
are chosen for each at random. A million triangles try all combinations; fewer try a part that depends on the seed. One
random scene comes with every sixteen.

Then triangles drawn alone in all ways are compared with the exact oracle, by rule and where whole pixels decide, and scenes
where whole pixels decide are drawn in all ways that do so.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests import exact, verify, zoo
from tests.zoo import OPTIONS, PIXEL_WAYS, SIZE, WAYS, Floats, Integers, Way

CELL = 640  # Triangles of `--count` for each combination,
ALONE = 25_000  # and for each batch of triangles drawn alone.
FEWEST, FEWEST_ALONE = 32, 2
ALONE_TRIANGLES = 200
COMBINATIONS = [
    (scene, rule, samples, bits)
    for scene in range(len(zoo.SCENES))
    for rule in range(len(OPTIONS["rule"]))
    for samples in OPTIONS["samples"]
    for bits in OPTIONS["subpixel_bits"]
]
MODES = ("touched", "inside")


def plan(seed: int, count: int) -> list[tuple[int, int]]:
    """Return what to compare for so many triangles: pairs of a kind of task and its number, a combination's or any other."""
    cells = max(FEWEST, count // CELL)
    order = np.random.default_rng([seed, 2]).permutation(len(COMBINATIONS))[:cells].tolist()
    scenes = range(max(4, len(order) // 16, cells - len(order)))
    batches = range(max(FEWEST_ALONE, count // ALONE))
    return [(0, number) for number in order] + [(1, number) for number in scenes] + [(2, number) for number in batches]


def draw(clip: Floats, triangles: Integers, **options: Any) -> Any:
    """Return what the library makes of a scene; tests put a faulty one in its place."""
    import scanspan

    return scanspan.rasterize(clip, triangles, SIZE, **options)


def draw_each(vertices: Floats, size: tuple[int, int], **options: Any) -> Any:
    """Return what the library makes of triangles alone; tests put a faulty one in its place."""
    from scanspan import pipeline

    return pipeline.count_each(vertices, size, **options)


def check_ways(name: str, clip: Floats, triangles: Integers, options: dict[str, Any], ways: list[Way], tally: Any) -> None:
    """Draw a scene in all ways and compare each with the first."""
    expected = draw(clip, triangles, **ways[0], **options)
    shown = int((expected.primitive >= 0).sum())
    is_cut = bool(zoo.is_cut(clip, triangles, SIZE).any())
    coverage = options.get("coverage", "sample")
    for way in ways[1:]:
        found = draw(clip, triangles, **way, **options)
        elsewhere, kind = 0, f"9|0|{way['algorithm']} {way['order']}"
        if found.primitive.shape != expected.primitive.shape:
            wrong = expected.primitive.size
        elif is_cut and way["algorithm"] == "homogeneous" and coverage == "sample":
            samples, bits = options["samples"], options["subpixel_bits"]
            elsewhere, complaints = zoo.check_unclipped(clip, triangles, SIZE, found, expected, samples, bits)
            wrong = len(complaints)
        else:
            wrong = zoo.different(found, expected)
        if coverage != "sample":
            kind = f"9|1|{coverage}, {way['algorithm']}"
        tally.add(kind, len(triangles), expected.primitive.size, shown, elsewhere, wrong)
        tally.wrong += wrong
        if wrong:
            tally.examples.append(f"{name}: {options}: {wrong} samples differ between {ways[0]} and {way}")


def check_alone(seed: int, number: int, tally: Any) -> None:
    """Draw triangles alone in all ways and compare each with the exact oracle, and so whole pixels."""
    batch = verify.library_batch(verify.make_batch(seed, 1_000_000 + number, ALONE_TRIANGLES))
    options = {"subpixel_bits": batch.subpixel_bits, "cull": batch.cull}
    expected = {mode: exact.whole_pixels(batch.vertices, batch.size, mode, **options) for mode in MODES}
    expected["sample"] = exact.coverage(batch.vertices, batch.size, **batch.options())
    for mode, truth in expected.items():
        for way in WAYS if mode == "sample" else PIXEL_WAYS:
            found = np.asarray(draw_each(batch.vertices, batch.size, **way, coverage=mode, **batch.options()))
            wrong = int((found != truth).sum()) if found.shape == truth.shape else truth.size
            tally.add(f"9|2|{mode}, {way['algorithm']} alone", len(truth), truth.size, int(truth.sum()), 0, wrong)
            tally.wrong += wrong
            if wrong:
                tally.examples.append(
                    f"{way}, coverage {mode}, {batch.options()}, size={batch.size}: {wrong} samples are wrong"
                )


def run_task(seed: int, task: tuple[int, int]) -> Any:
    """Compare one combination of the zoo, one random scene or one batch of triangles alone; return the tally."""
    kind, number = task
    tally, random = verify.Tally(), np.random.default_rng([seed, 3, kind, number])
    options = {name: choices[random.integers(len(choices))] for name, choices in OPTIONS.items()}
    if kind == 2:
        check_alone(seed, number, tally)
    elif kind == 0:
        scene, rule, samples, bits = COMBINATIONS[number]
        name, places = zoo.SCENES[scene], zoo.scene_zoo(np.random.default_rng([seed, 4]))[zoo.SCENES[scene]]
        options |= {"rule": OPTIONS["rule"][rule], "samples": samples, "subpixel_bits": bits}
        check_ways(name, *places, options, WAYS, tally)
    else:
        name, places = f"random scene {number}", zoo.random_scene(random)
        check_ways(name, *places, options, WAYS, tally)
        whole = {name: options[name] for name in ("subpixel_bits", "depth_bits", "cull", "threads")}
        for mode in MODES:
            check_ways(name, *places, {**whole, "coverage": mode}, PIXEL_WAYS, tally)
    tally.examples = [f"seed {seed}: {text}" for text in tally.examples[: verify.KEPT_EXAMPLES]]
    return tally


def summary(tasks: list[tuple[int, int]], tally: Any) -> str:
    """Return in a line what was compared, and what was wrong."""
    numbers = [sum(kind == each for kind, _ in tasks) for each in range(3)]
    rows = [row for name, row in tally.rows.items() if name.startswith("9|")]
    samples, wrong = (sum(int(row[k]) for row in rows) for k in (1, 4))
    return (f"{len(WAYS)} ways to draw: {numbers[0]:,} of {len(COMBINATIONS):,} combinations of the zoo, {numbers[1]:,} random "
            f"scenes, {numbers[2]:,} batches alone, {samples:,} samples, {wrong} wrong")  # fmt: skip
