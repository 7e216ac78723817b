"""The race is fair only if what it holds right is right: the exact pictures, the count of wrong pixels, and the tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import cloud_build, exact, plane_scenes, registry, report
from benchmarks.entry import MissingError, load
from scipy import ndimage

import scanspan as ss
from tests.painting import inside

SIZE = (40, 30)
# How much of a scene is drawn, so that each takes a second at most.
SCALES = {
    "A": 0.001, "C": 0.01, "D": 0.001, "F": 0.01, "G": 0.01, "H": 0.01, "I": 0.02, "T": 1.0, "L": 0.002,
    "LA": 0.0005, "PS-center": 0.01,
    "PX-non-zero": 0.02, "PX-even-odd-area": 0.02, "Q2": 0.0001, "FF": 1.0, "TRI1k": 0.2, "TRI100k": 0.002, "MP-ids": 0.01,
    "MP-area": 0.01, "PC-morton": 0.002, "PC-random": 0.002,
}  # fmt: skip


def wild_ring(rng: np.random.Generator, corners: int = 9) -> Any:
    """Return a ring that crosses itself, on the grid of the scenes, often through centres of pixels."""
    return np.rint(rng.uniform(0, 1, (corners, 2)) * SIZE * 4) / 4 + rng.choice([0.0, 0.5, 1 / 256], (corners, 2))


@pytest.mark.parametrize("rule", ["even-odd", "non-zero"])
def test_the_exact_polygon_is_that_of_the_oracle(rule: str, rng: np.random.Generator) -> None:
    for _ in range(20):
        ring = wild_ring(rng)
        edges = exact.ring_edges(ring, np.array([0, len(ring)]))
        size = (SIZE[0] + 1, SIZE[1] + 1)
        assert np.array_equal(exact.inside(*edges, size, rule), inside([ring], size, rule))


def test_the_exact_triangles_are_painted_in_order(rng: np.random.Generator) -> None:
    triangles = np.stack([wild_ring(rng, 3) for _ in range(50)])
    size = (SIZE[0] + 1, SIZE[1] + 1)
    expected = np.full(size[::-1], -1)
    for number, triangle in enumerate(triangles):
        expected[inside([triangle], size, "even-odd")] = number
    assert np.array_equal(exact.owners(triangles, size), expected)


@pytest.mark.parametrize("rule", ["even-odd", "non-zero"])
def test_the_exact_areas_are_right_to_a_part_of_a_row(rule: str, rng: np.random.Generator) -> None:
    ring = wild_ring(rng)
    size = (SIZE[0] + 1, SIZE[1] + 1)
    found = exact.areas(*exact.ring_edges(ring, np.array([0, len(ring)])), size, rule)
    assert np.array_equal(np.isfinite(found[:, 0]), np.arange(size[1]) % exact.EVERY == 0)
    expected = ss.coverage(ring, size, mode="area", fill_rule=rule)
    assert np.nanmax(np.abs(found - expected)) < 4 / exact.SUBROWS


def test_a_flood_stops_where_scipy_says(rng: np.random.Generator) -> None:
    image = (rng.random((60, 50)) < 0.4).astype(np.uint8)
    image[7, 5] = 0
    labels, _ = ndimage.label(image == 0)
    assert np.array_equal(exact.flooded(image, (5, 7)), labels == labels[7, 5])


@pytest.mark.parametrize("name", SCALES)
def test_scanspan_is_right_on_the_scenes(name: str) -> None:
    """The one oracle that has no code in common with any of the tests."""
    scene = plane_scenes.checked_part(registry.make_scene(name, SCALES[name]))
    right = exact.answer(scene)
    raced = 0
    for peer in filter(registry.is_ours, registry.peers_of(scene.kind)):
        try:
            entry = registry.PEERS[peer].make(scene)
        except MissingError:
            continue
        entry.convert()
        result = entry.result(entry.draw())
        covered, wrong = exact.judge(scene, entry.gives, result, right)
        assert covered > 0
        if wrong is None:
            assert entry.gives == "Wu's lines"
            continue
        assert wrong == 0, peer
        raced += 1
        if entry.gives != "triangles":
            assert exact.judge(scene, entry.gives, planted(result), right)[1] == wrong + 1
    assert raced


def planted(result: Any) -> Any:
    """Return an output with one pixel that is wrong."""
    wrong = np.array(result)
    wrong[0, 0] = ~wrong[0, 0] if wrong.dtype == bool else wrong[0, 0] + 100
    return wrong


def test_triangles_are_judged_by_their_area() -> None:
    scene = plane_scenes.make("TRI1k", 0.2)
    half = np.array([[(0, 0), (10, 0), (0, 10)]])
    assert exact.judge(scene, "triangles", half, {"triangles": [np.array(100.0)]}) == (1, 50)


def test_what_has_not_been_worked_out_is_not_judged() -> None:
    assert exact.judge(registry.make_scene("T", 1.0), "one channel", np.ones((4, 4)), {}) == (16, None)


def test_every_scene_has_opponents_and_every_peer_a_scene() -> None:
    kinds = {registry.make_scene(name, 0.001).kind for name in registry.NAMES}
    for kind in kinds:
        peers = registry.peers_of(kind)
        assert any(map(registry.is_ours, peers))
        assert sum(not registry.is_ours(peer) and peer != registry.FILL for peer in peers) >= 1
        assert registry.FILL in peers or kind == "triangulation"
    for name, peer in registry.PEERS.items():
        assert peer.kinds, name
        assert kinds.issuperset(peer.kinds), name


def test_an_unknown_scene_is_named() -> None:
    with pytest.raises(ValueError, match="unknown scene 'Z'; the valid ones are A, B, C, "):
        registry.scene_names("A,Z")


def test_a_peer_that_is_absent_says_what_to_install() -> None:
    with pytest.raises(MissingError, match="needs some-package, which `make"):
        load("no_such_module", "some-package")


def timings(seconds: float, gives: str, **fields: Any) -> report.Timings:
    """Return timings of three repetitions."""
    return report.Timings([seconds, 2 * seconds, seconds / 2], [seconds] * 3, [0.001] * 3, gives=gives, **fields)


def test_tables_compare_like_with_like() -> None:
    about = report.About("X", 10, "things", math.pi, (4, 3), "polygon")
    raced = {
        "scanspan slow": timings(0.004, "mask", covered=2000, wrong=0),
        "scanspan fast": timings(0.001, "colors", covered=2000, wrong=0),
        "right": timings(0.008, "mask", covered=2000, wrong=2),
        "wrong": timings(0.002, "mask", covered=2000, wrong=3),
        "absent": report.Timings(absent="needs a package"),
        registry.FILL: timings(0.0005, "a constant"),
    }
    table = report.scene_table(about, raced)
    assert "| absent | not run: needs a package |" in table
    row = next(line for line in table.splitlines() if line.startswith("| right |"))
    assert [cell.strip() for cell in row.split("|")][2:] == [
        "mask", "8 ms [4 ms, 16 ms]", "8 ms [8 ms, 8 ms]", "1 ms", "0.00125", "0.0003927", "2,000", "2", "2.00 x", "16.00 x",
        "1.80 x", "",
    ]  # fmt: skip
    columns = {line.count("|") for line in table.splitlines() if line.startswith("|")}
    assert columns == {13}

    summary = report.summary_table([(about, raced), (about, {"absent": raced["absent"], "right": raced["right"]})])
    assert "| X | mask | slow | 4 ms | 0 | right: 2.00 x, 2 px wrong | wrong: 0.50 x, 3 px wrong |" in summary
    assert "| X | colors | fast | 1 ms | 0 | none | wrong: 2.00 x, 3 px wrong |" in summary
    assert "| X | | not run | | | | 1 others were |" in summary


def test_the_cloud_of_the_builds_comes_in_pieces(tmp_path: Path) -> None:
    pieces = list(cloud_build.pieces(600_000, ("color", "normals")))
    assert [len(piece["integers"]) for piece in pieces] == [cloud_build.PIECE, 600_000 - cloud_build.PIECE]
    assert all(piece[name].shape == piece["integers"].shape for piece in pieces for name in ("color", "normals"))
    assert abs(np.linalg.norm(pieces[0]["normals"], axis=1) - 1).max() < 1e-6
    measured = cloud_build.build(20_000, tmp_path / "cloud.scansplat", "512MB", ("color",), "given")
    assert measured["bytes a point"] < 9
    assert set(cloud_build.read(tmp_path / "cloud.scansplat", 5000)) == {
        "M splats/s from the file, CPU",
        "M splats/s from pages, CPU",
    }
