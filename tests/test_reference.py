"""The rational oracle against answers known by hand, the exact one against the rational one, and `make verify` in small."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests import exact, reference, verify

Vertices = list[tuple[float, float]]
RULES: list[Any] = [
    "top-left",
    "bottom-left",
    "inclusive",
    "exclusive",
    verify.Point(-3.5, 0.5),
    verify.Point(2.5, 2.5),
    verify.Point(7.0, -9.0, 2.0),
    verify.Point(1.0, 0.0, 0.0),
    verify.Point(0.0, -1.0, 0.0),
]

# The lower left half of a square whose corners are samples.
HALF_SQUARE: Vertices = [(0.5, 0.5), (4.5, 4.5), (0.5, 4.5)]


def owned(vertices: Vertices, rule: Any, side: int = 6) -> set[tuple[int, int]]:
    """Return the pixels of a small image that the rational oracle gives to a triangle."""
    return {(i, j) for j in range(side) for i in range(side) if reference.covers(vertices, i, j, rule)}


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("inclusive", {(i, j) for j in range(5) for i in range(j + 1)}),
        ("exclusive", {(i, j) for j in range(4) for i in range(1, j)}),
        # Its left edge is a left edge; the diagonal faces right; the level edge lies at the bottom.
        ("top-left", {(i, j) for j in range(4) for i in range(j)}),
        ("bottom-left", {(i, j) for j in range(1, 5) for i in range(j)}),
        # From far left the inside of the diagonal and of the level edge is on the point's side, that of the left edge is not.
        (verify.Point(-1000.0, 2.25), {(i, j) for j in range(5) for i in range(1, j + 1)}),
    ],
    ids=str,
)
def test_half_square_by_hand(rule: Any, expected: set[tuple[int, int]]) -> None:
    assert owned(HALF_SQUARE, rule) == expected
    assert owned(HALF_SQUARE[::-1], rule) == expected


def test_rules_are_mirror_images_and_nested() -> None:
    rng = np.random.default_rng(5)
    for _ in range(40):
        vertices = [(float(x) / 2, float(y) / 2) for x, y in rng.integers(0, 12, (3, 2))]
        mirrored = [(x, 6 - y) for x, y in vertices]
        top_left = owned(vertices, "top-left")
        assert owned(mirrored, "bottom-left") == {(i, 5 - j) for i, j in top_left}
        assert owned(vertices, verify.Point(1.0, 0.0, 0.0)) == top_left
        assert owned(vertices, "exclusive") <= top_left <= owned(vertices, "inclusive")


def test_homogeneous_point_is_the_point_it_stands_for() -> None:
    assert owned(HALF_SQUARE, verify.Point(20.0, 3.0, 2.0)) == owned(HALF_SQUARE, verify.Point(10.0, 1.5, 1.0))


def test_snapping_rounds_halves_to_even() -> None:
    assert reference.snap((0.5 / 256, 1.5 / 256), 8) == (Fraction(0), Fraction(2, 256))
    assert reference.snap((-0.5 / 16, -1.5 / 16), 4) == (Fraction(0), Fraction(-2, 16))
    points = np.array([[[0.5 / 256, 1.5 / 256], [2.5 / 256, -0.5 / 256], [-1.5 / 256, 7.0]]])
    assert exact.snap(points, 8).tolist() == [[[0, 2], [2, 0], [-2, 1792]]]


def test_front_is_counter_clockwise_as_seen() -> None:
    # Down the left side, along the bottom, and back: counter-clockwise on a screen with y down.
    front = [(Fraction(0), Fraction(0)), (Fraction(0), Fraction(4)), (Fraction(4), Fraction(4))]
    assert [reference.is_culled(front, cull) for cull in ("none", "back", "front")] == [False, False, True]
    assert [reference.is_culled(front[::-1], cull) for cull in ("none", "back", "front")] == [False, True, False]


def test_visible_takes_the_nearer_and_then_the_lower_number() -> None:
    square = [(-1.0, -1.0), (-1.0, 3.0), (3.0, -1.0)]
    clip = [(x, y, z, 1.0) for z in (0.5, -0.25, -0.25, 0.75) for x, y in square]
    triangles = [(0, 1, 2), (3, 4, 5), (6, 7, 8), (9, 10, 11)]
    assert reference.visible(clip, triangles, 1, 1, (4, 4)) == reference.Hit(1, Fraction(5, 8), Fraction(0))
    assert reference.visible(clip, triangles[2:], 1, 1, (4, 4)) == reference.Hit(0, Fraction(5, 8), Fraction(1, 2))
    assert reference.visible(clip, [], 1, 1, (4, 4)).primitive == -1


def test_depth_is_linear_on_the_screen() -> None:
    # Depth is 1 at the left side and 0 at the right one, in perspective: w differs, the plane over the screen does not care.
    clip = [(-1.0, -1.0, -1.0, 1.0), (-2.0, 2.0, -2.0, 2.0), (3.0, -3.0, 3.0, 3.0)]
    assert reference.depth_at(clip, (Fraction(1), Fraction(3)), (4, 4)) == Fraction(3, 4)


def _clipped_polygon(clip: list[list[Fraction]]) -> list[list[Fraction]]:
    """Clip a triangle to z >= -w by going round it: another way than the oracle's."""
    kept = []
    for k in range(3):
        a, b = clip[k], clip[(k + 1) % 3]
        height_a, height_b = a[2] + a[3], b[2] + b[3]
        if height_a >= 0:
            kept.append(a)
        if (height_a < 0) != (height_b < 0):
            t = height_a / (height_a - height_b)
            kept.append([p + t * (q - p) for p, q in zip(a, b, strict=True)])
    return kept


def test_clipped_verdict_agrees_with_clipping() -> None:
    rng, size, seen = np.random.default_rng(11), (6, 6), {"must": 0, "never": 0, "may": 0}
    for _ in range(150):
        clip = rng.normal(0, 1, (3, 4))
        clip[:, 2] = rng.normal(0.3, 0.7, 3)
        clip[:, 3] = np.where(rng.random(3) < 0.3, -1, 1) * rng.uniform(0.3, 2, 3)
        polygon = _clipped_polygon([[Fraction(float(value)) for value in vertex] for vertex in clip])
        if any(vertex[3] <= 0 for vertex in polygon):
            continue
        outline = [((x / w + 1) * size[0] / 2, (1 - y / w) * size[1] / 2) for x, y, _, w in polygon]
        fan = [(outline[0], outline[k], outline[k + 1]) for k in range(1, len(outline) - 1)]
        for j in range(size[1]):
            for i in range(size[0]):
                verdict = reference.clipped_verdict(clip.tolist(), i, j, size).coverage
                inside = any(reference.coverage(part, reference.sample_position(i, j), "inclusive") for part in fan)
                seen[verdict] += 1
                assert verdict == "may" or (verdict == "must") == inside, (clip.tolist(), i, j)
    assert min(seen["must"], seen["never"]) > 100, seen


def test_clipped_verdict_gives_the_depth_of_the_whole_triangle() -> None:
    clip = [(-1.0, -1.0, -1.0, 1.0), (-2.0, 2.0, -2.0, 2.0), (3.0, -3.0, 3.0, 3.0)]
    verdict = reference.clipped_verdict(clip, 1, 2, (4, 4))
    assert verdict == reference.Verdict("must", Fraction(5, 8), Fraction(1, 16))
    assert reference.clipped_verdict([*clip[:2], clip[0]], 1, 1, (4, 4)).coverage == "never"


def different_samples(
    vertices: NDArray[np.float64], rule: Any, bits: int, cull: str = "none", side: int = 4, coverage: Any = exact.coverage
) -> int:
    """Count samples at which a coverage function differs from the rational oracle."""
    got = coverage(vertices, (side, side), rule=rule, subpixel_bits=bits, cull=cull)
    return sum(
        bool(got[k, j, i]) != reference.covers(triangle, i, j, rule, bits, cull)
        for k, triangle in enumerate(vertices.tolist())
        for j in range(side)
        for i in range(side)
    )


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("bits", [4, 8, 12, 16])
def test_exact_equals_reference(rule: Any, bits: int) -> None:
    rng = np.random.default_rng([bits, RULES.index(rule)])
    span = np.exp(rng.uniform(np.log(0.1), np.log(1e7), 24))
    free = verify.free_triangles(rng, 24, (4, 4), bits, span)
    tied = verify.tied_triangles(rng, 24, (4, 4), bits, span)
    lattice = rng.integers(0, 9, (16, 3, 2)) / 2
    vertices = np.clip(np.concatenate([free, tied, lattice]), -1e7, 1e7)
    assert different_samples(vertices, rule, bits) == 0
    assert different_samples(vertices[::8], rule, bits, "back") == 0
    assert different_samples(vertices[::8], rule, bits, "front") == 0


def test_exact_at_the_limit_of_its_bits() -> None:
    far = float(2**24)
    step = 2.0**-16
    vertices = np.array(
        [
            [[-far, -far], [far, far], [-far, far]],
            [[-far, -far], [far, far], [far, -far]],
            [[-far, -far], [far, far - step], [far, far]],
            [[-far, far], [far, -far], [far - step, -far]],
            [[-far + 4.5, far + 0.5 - 2.0], [far, -far], [1.0, far]],
        ]
    )
    for rule in RULES:
        assert different_samples(vertices, rule, 16) == 0


def test_products_in_halves_are_exact() -> None:
    rng = np.random.default_rng(3)
    a = np.concatenate([rng.integers(-(2**41), 2**41, 500), np.array([-(2**41), 2**41, 0, -1])])
    u = np.concatenate([rng.integers(-(2**41), 2**41, 500), np.array([-(2**41), -(2**41), 5, 2**41])])
    high, low = exact._product(a, u)
    assert [int(h) * 2**21 + int(k) for h, k in zip(high, low, strict=True)] == [
        int(p) * int(q) for p, q in zip(a, u, strict=True)
    ]
    assert low.min() >= 0
    assert low.max() < 2**21


def _float_coverage(vertices: NDArray[np.float64], size: tuple[int, int], **options: Any) -> NDArray[np.bool_]:
    """Decide coverage with float64 edge values: the fault that exact integers are there to avoid."""
    scale = 2.0 ** options["subpixel_bits"]
    p = np.rint(vertices * scale)
    x, y = (np.arange(size[0]) + 0.5) * scale, (np.arange(size[1]) + 0.5) * scale
    q = np.roll(p, -1, axis=1)
    a, b, c = p[..., 1] - q[..., 1], q[..., 0] - p[..., 0], p[..., 0] * q[..., 1] - q[..., 0] * p[..., 1]
    value = a[..., None, None] * x + b[..., None, None] * y[:, None] + c[..., None, None]
    inside: NDArray[np.bool_] = (value > 0).all(axis=1) | (value < 0).all(axis=1)
    return inside


def test_comparison_reports_planted_faults() -> None:
    rng = np.random.default_rng(8)
    vertices = verify.tied_triangles(rng, 60, (5, 5), 8, np.exp(rng.uniform(0, np.log(1e7), 60)))

    def with_options(**changed: Any) -> Any:
        return lambda vertices, size, **options: exact.coverage(vertices, size, **{**options, **changed})

    far = verify.tied_triangles(rng, 300, (4, 4), 16, np.exp(rng.uniform(np.log(1e5), np.log(1e7), 300)))
    assert different_samples(far, "exclusive", 16) == 0
    assert different_samples(far, "exclusive", 16, coverage=_float_coverage) > 0
    assert different_samples(vertices, "top-left", 8, coverage=with_options(rule="bottom-left")) > 0
    assert different_samples(vertices, "top-left", 8, coverage=with_options(subpixel_bits=4)) > 0
    assert different_samples(vertices, "top-left", 8, coverage=lambda v, s, **o: exact.coverage(v + 1 / 256, s, **o)) > 0
    assert different_samples(vertices, verify.Point(-9.5, 3.5), 8, coverage=with_options(rule=verify.Point(9.5, 3.5))) > 0


def test_samples_on_edges() -> None:
    vertices = np.array([HALF_SQUARE, [(0.75, 0.5), (4.75, 4.5), (0.75, 4.5)], [(0.5, 0.5), (2.5, 2.5), (4.5, 4.5)]])
    assert exact.samples_on_edges(vertices, (6, 6)).tolist() == [12, 4, 0]


def test_verify_small_run() -> None:
    tally = verify.run(seed=20261121, count=20_000, batch=500)
    assert tally.examples == []
    assert tally.wrong == 0
    assert tally.triangles == 20_000

    # See that the run compared what it promises: each size, each grid, each rule, ties, and far vertices.
    rows = {name.rpartition("|")[2]: numbers for name, numbers in tally.rows.items()}
    assert rows["with samples on edges"][0] >= 2000
    assert rows["reaching 10^6 px"][0] >= 200
    assert all(rows[f"{bits} bits"][2] > 1000 for bits in (4, 8, 12, 16))
    assert all(rows[rule][2] > 1000 for rule in ("top-left", "bottom-left", "inclusive", "exclusive", "off-screen point"))
    assert rows["against rationals"][1] == 40 * verify.REFERENCE_SAMPLES
    assert rows["primitive of a scene"][2] > 1000


def test_verify_batches_repeat_and_differ() -> None:
    first, again, other = verify.make_batch(4, 7, 50), verify.make_batch(4, 7, 50), verify.make_batch(4, 8, 50)
    assert np.array_equal(first.vertices, again.vertices)
    assert first.size == again.size
    assert not np.array_equal(first.vertices, other.vertices)


@pytest.mark.parametrize("fault", ["rule", "shift", "bits", "one pixel", "shape"])
def test_verify_catches_planted_faults(fault: str) -> None:
    def faulty(vertices: NDArray[np.float64], size: tuple[int, int], **options: Any) -> NDArray[np.bool_]:
        if fault == "rule":
            options["rule"] = "bottom-left" if options["rule"] == "top-left" else "top-left"
        if fault == "bits":
            options["subpixel_bits"] = 5
        covered = exact.coverage(vertices + (1 / 512 if fault == "shift" else 0), size, **options)
        if fault == "one pixel":
            covered[0, 0, 0] ^= True
        return covered[:-1] if fault == "shape" else covered

    tally = verify.Tally()
    for number in range(3):
        verify.check_each(verify.make_batch(2, number, 300), faulty, tally)
    assert tally.wrong >= 3
    assert "expected" in tally.examples[0]
    if fault == "one pixel":
        assert tally.wrong == 3
        assert "count_each: [[" in tally.examples[0]
        assert "pixel (0, 0) is" in tally.examples[0]


def test_verify_catches_a_wrong_oracle_and_a_wrong_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    batch, tally = verify.make_batch(2, 1, 40), verify.Tally()
    verify.check_reference(
        batch, ~exact.coverage(batch.vertices, batch.size, **batch.options()), np.random.default_rng(1), tally
    )
    assert tally.wrong == verify.REFERENCE_SAMPLES
    assert "exact oracle" in tally.examples[0]

    tally = verify.Tally()
    verify._check_image(batch, "count", np.zeros((2, 2)), np.array([[0, 0], [0, 1]]), 0, tally)
    verify._check_image(batch, "count", np.zeros((2, 2)), np.zeros((2, 3)), 0, tally)
    assert tally.wrong == 5
    assert "pixel (1, 1) is 1, expected 0" in tally.examples[0].replace(".0", "")


def test_verify_program(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify.main(["--seed", "3", "--count", "300", "--processes", "1"]) == 0
    printed = capsys.readouterr().out
    assert printed.endswith("\n0 wrong pixels\n")
    assert "300 triangles" in printed

    def all_covered(vertices: NDArray[np.float64], size: tuple[int, int], **_: Any) -> NDArray[np.bool_]:
        return np.ones((len(vertices), size[1], size[0]), dtype=np.bool_)

    monkeypatch.setattr(verify, "library_count_each", lambda: all_covered)
    assert verify.main(["--seed", "3", "--count", "300", "--processes", "1"]) == 1
    printed = capsys.readouterr().out
    assert "counter-example: seed 3, batch 0: count_each: [[" in printed

    with pytest.raises(SystemExit) as stopped:
        verify.main(["--count", "0"])
    assert stopped.value.code == 2
    assert "--count and --processes must be at least 1" in capsys.readouterr().err
