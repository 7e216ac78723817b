"""The agreement part of `make verify` in small, and that it notices what it is there for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests import agreement, verify, zoo

RULES = zoo.OPTIONS["rule"]


def plant(monkeypatch, change):
    """Let one algorithm draw wrongly: `change` gets what it drew and its options, and returns something else."""
    draw, draw_each = agreement.draw, agreement.draw_each

    def faulty(clip, triangles, **options):
        return change(draw(clip, triangles, **options), options)

    def faulty_each(vertices, size, **options):
        return change(draw_each(vertices, size, **options), options)

    monkeypatch.setattr(agreement, "draw", faulty)
    monkeypatch.setattr(agreement, "draw_each", faulty_each)


def wrong_in(tasks, seed=3):
    return verify.run_agreement(seed, tasks)


def test_a_small_run_compares_every_way():
    tasks = agreement.plan(11, 2000)
    assert len(tasks) == agreement.FEWEST + agreement.FEWEST // 8 + agreement.FEWEST_ALONE
    tally = wrong_in(tasks, 11)
    assert tally.examples == []
    assert tally.wrong == 0
    rows = {name.rpartition("|")[2]: numbers for name, numbers in tally.rows.items()}
    for way in zoo.OTHERS:
        assert rows[f"{way['algorithm']} {way['order']}"][2] > 10_000
    for mode in agreement.MODES:
        for name in zoo.WHOLE_PIXELS:
            assert rows[f"{mode}, {name}"][2] > 1000
            assert rows[f"{mode}, {name} alone"][2] > 1000
    line = f"of 1,560 combinations of the zoo, {agreement.FEWEST // 8} random scenes, 2 batches alone, "
    assert line in agreement.summary(tasks, tally)
    assert agreement.summary(tasks, tally).endswith(" samples, 0 wrong")


def test_a_million_triangles_try_all_combinations():
    tasks = agreement.plan(1, 10**6)
    assert sorted(number for kind, number in tasks if kind == 0) == list(range(1560))
    assert sum(kind == 1 for kind, _ in tasks) == 97
    assert len(set(agreement.COMBINATIONS)) == 13 * 6 * 5 * 4
    assert agreement.plan(1, 10**5) != agreement.plan(2, 10**5)
    assert set(agreement.plan(1, 10**5)) < set(tasks)


def combination(name, rule=0, samples=1, bits=8):
    return 0, agreement.COMBINATIONS.index((zoo.SCENES.index(name), rule, samples, bits))


@pytest.mark.parametrize("way", [zoo.WAYS[3], zoo.WAYS[7], zoo.WAYS[10], zoo.WAYS[14], zoo.WAYS[20]], ids=str)
@pytest.mark.parametrize("field", ["primitive", "depth"])
def test_one_wrong_sample_in_one_way_is_noticed(monkeypatch, way, field):
    def change(found, options):
        if {name: options[name] for name in way} != way or isinstance(found, np.ndarray):
            return found
        wrong = getattr(found, field).copy()
        wrong[7, 9] = 77
        return replace(found, **{field: wrong})

    plant(monkeypatch, change)
    tasks = [combination("same", rule) for rule in range(len(RULES))]
    tally = wrong_in(tasks)
    assert tally.wrong == len(tasks)
    assert f"samples differ between {zoo.WAYS[0]} and {way}" in tally.examples[0]
    assert f"{len(tasks)} wrong" in agreement.summary(tasks, tally)


def test_a_wrong_rule_and_a_wrong_shape_are_noticed(monkeypatch):
    draw = agreement.draw

    def faulty(clip, triangles, **options):
        if options["algorithm"] == "warnock" and options["rule"] == "top-left":
            options["rule"] = "bottom-left"
        return draw(clip, triangles, **options)

    monkeypatch.setattr(agreement, "draw", faulty)
    assert wrong_in([combination("lattice")]).wrong > 10
    assert wrong_in([combination("lattice", 1)]).wrong == 0
    monkeypatch.setattr(agreement, "draw", lambda *args, **options: draw(
        *args, **{**options, "samples": 2 if options["algorithm"] == "span-list" else options["samples"]}
    ))  # fmt: skip
    assert wrong_in([combination("same")]).wrong == zoo.SIZE[0] * zoo.SIZE[1]


@pytest.mark.parametrize("algorithm", ["homogeneous", "warnock", "half-space"])
def test_wrong_whole_pixels_are_noticed(monkeypatch, algorithm):
    def change(found, options):
        if options["algorithm"] != algorithm or options.get("coverage") != "touched":
            return found
        if isinstance(found, np.ndarray):
            return 1 - found
        return replace(found, primitive=found.primitive + 1)

    plant(monkeypatch, change)
    alone, scene = wrong_in([(2, 0)]), wrong_in([(1, 0)])
    assert alone.wrong > 1000
    assert scene.wrong > 1000
    assert alone.rows[f"9|2|touched, {algorithm} alone"][4] == alone.wrong
    assert "coverage touched" in alone.examples[0]


def test_a_picture_without_clipping_that_is_shifted_is_noticed(monkeypatch):
    def change(found, options):
        if options["algorithm"] != "homogeneous":
            return found
        return replace(found, primitive=np.roll(found.primitive, 1, axis=1))

    plant(monkeypatch, change)
    tally = wrong_in([combination("soup")])
    assert tally.wrong > 5 * 50
    assert all(tally.rows[f"9|0|homogeneous {order}"][4] for order in ("rows", "hilbert"))
