"""Every edge rule, and every clipped triangle, against the rational oracle; and the faults that this suite has to notice.

The cases put as many samples as possible on edges and on vertices: corners on samples, on half pixels, on the sub-pixel grid,
with off-screen points in general position, on the lines of edges, on vertices, inside the triangle and at infinity.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import scanspan as ss
from scanspan.errors import InputError
from tests import reference

Floats = NDArray[np.float64]
Count = Callable[..., NDArray[Any]]

SIZE = (9, 8)
RULES = ["top-left", "bottom-left", "inclusive", "exclusive"]
POINTS = {
    "general": (-41.25, 13.0625, 1.0),
    "on-lattice-lines": (-0.5, -0.5, 1.0),
    "on-a-level-edge": (200.5, 3.5, 1.0),
    "on-an-upright-edge": (3.5, -90.0, 1.0),
    "on-a-vertex": (2.5, 2.5, 1.0),
    "inside-the-image": (4.25, 3.75, 1.0),
    "far": (-3_000_000.0, 1_000_000.0, 1.0),
    "homogeneous": (21.0, -9.0, 4.0),
    "right": (1.0, 0.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "down": (0.0, 1.0, 0.0),
    "up": (0.0, -1.0, 0.0),
    "diagonal": (1.0, 1.0, 0.0),
}


@cache
def cases(bits: int) -> Floats:
    """Return triangles whose edges and corners hold many samples, then free ones on and off the sub-pixel grid."""
    rng = np.random.default_rng(41)
    on_samples = rng.integers(0, 8, (24, 3, 2)) + 0.5
    on_halves = rng.integers(-4, 24, (24, 3, 2)) / 2
    on_samples[:12, 1, 1] = on_samples[:12, 0, 1]
    on_grid = np.rint(rng.uniform(-3, 12, (10, 3, 2)) * 2**bits) / 2**bits
    free = rng.uniform(-3, 12, (10, 3, 2))
    between = (np.floor(rng.uniform(0, 8, (6, 3, 2)) * 2**bits) + 0.5) / 2**bits
    large = rng.integers(-3, 4, (6, 3, 2)) * 10**6 + rng.integers(0, 16, (6, 3, 2)) / 2
    large[:, 0] = rng.integers(0, 16, (6, 2)) / 2
    vertices = np.concatenate([on_samples, on_halves, on_grid, free, between, large])
    vertices.flags.writeable = False
    return vertices


@cache
def expected(rule: Any, bits: int, cull: str = "none") -> NDArray[np.bool_]:
    """Return what the rational oracle says of every case in every pixel; points come as tuples, so that the answer is kept."""
    named = ss.OffscreenPoint(*rule) if isinstance(rule, tuple) else rule
    return np.array(
        [
            [[reference.covers(triangle, i, j, named, bits, cull) for i in range(SIZE[0])] for j in range(SIZE[1])]
            for triangle in cases(bits).tolist()
        ]
    )


def wrong_pixels(count: Count, rule: Any, bits: int = 8, cull: str = "none") -> int:
    """Count pixels in which triangles, each drawn alone by a given function, differ from the oracle."""
    named = ss.OffscreenPoint(*rule) if isinstance(rule, tuple) else rule
    truth = expected(rule, bits, cull)
    return sum(
        int((count(triangle[None], SIZE, rule=named, subpixel_bits=bits, cull=cull) != truth[k]).sum())
        for k, triangle in enumerate(cases(bits))
    )


@pytest.mark.parametrize("bits", [4, 8, 16])
@pytest.mark.parametrize("rule", RULES)
def test_named_rules_equal_the_oracle(rule: str, bits: int) -> None:
    assert wrong_pixels(ss.count, rule, bits) == 0


@pytest.mark.parametrize("name", POINTS)
def test_off_screen_points_equal_the_oracle(name: str) -> None:
    assert wrong_pixels(ss.count, POINTS[name]) == 0


@pytest.mark.parametrize("cull", ["back", "front"])
def test_culled_triangles_equal_the_oracle(cull: str) -> None:
    assert wrong_pixels(ss.count, "top-left", 8, cull) == 0
    assert wrong_pixels(ss.count, "inclusive", 8, cull) == 0


def test_the_rules_differ_on_the_cases() -> None:
    names: list[Any] = [*RULES, *POINTS.values()]
    pictures = {name: expected(name, 8) for name in names}
    for k, rule in enumerate(RULES):
        assert all((pictures[rule] != pictures[other]).sum() > 10 for other in RULES[:k])
        assert all((pictures[rule] != pictures[point]).any() for name, point in POINTS.items() if name != "right")
    assert np.array_equal(pictures["top-left"], pictures[POINTS["right"]])


def test_shadow_is_another_name_of_bottom_left() -> None:
    assert np.array_equal(ss.count(cases(8), SIZE, rule="shadow"), ss.count(cases(8), SIZE, rule="bottom-left"))


def test_degenerate_triangles_draw_nothing_under_any_rule() -> None:
    point, level = [[2.5, 2.5]] * 3, [[0.5, 2.5], [7.5, 2.5], [3.5, 2.5]]
    collapsing = [[1.5, 1.5], [5.5, 5.5], [3.5 + 1 / 1024, 3.5]]
    vertices = np.array([point, level, collapsing])
    rules: list[Any] = [*RULES, ss.OffscreenPoint(-3.0, 8.0)]
    for rule in rules:
        assert not ss.count(vertices, SIZE, rule=rule).any()


def test_unknown_rule_is_refused() -> None:
    with pytest.raises(InputError, match=r"^unknown rule 'topleft'; did you mean 'top-left'\? .*bottom-left, .*exclusive"):
        ss.count(cases(8), SIZE, rule="topleft")


# Planted faults: each is what a wrong library would draw, and the comparison must notice it.


def flipped(vertices: Floats, size: tuple[int, int], *, rule: Any, **options: Any) -> NDArray[Any]:
    """Draw with the other of the two rules."""
    return np.asarray(ss.count(vertices, size, rule="bottom-left" if rule == "top-left" else "top-left", **options))


def off_centre(vertices: Floats, size: tuple[int, int], **options: Any) -> NDArray[Any]:
    """Draw with the sample 1/512 px beside the centre, which is as good as shifting the vertices after they are snapped."""
    snapped = np.rint(vertices * 256) / 256
    return np.asarray(ss.count(snapped - 1 / 512, size, **{**options, "subpixel_bits": 9}))


def coarse(vertices: Floats, size: tuple[int, int], **options: Any) -> NDArray[Any]:
    """Draw with 4 sub-pixel bits."""
    return np.asarray(ss.count(vertices, size, **{**options, "subpixel_bits": 4}))


def unsnapped(vertices: Floats, size: tuple[int, int], **options: Any) -> NDArray[Any]:
    """Draw without the snapping, on a grid 256 times finer."""
    return np.asarray(ss.count(vertices, size, **{**options, "subpixel_bits": 16}))


def float32_edges(vertices: Floats, size: tuple[int, int], **options: Any) -> NDArray[Any]:
    """Draw with edge functions A x + B y + C in float32, top-left."""
    counts = np.zeros((size[1], size[0]), dtype=np.int32)
    x, y = np.meshgrid(*(np.arange(length, dtype=np.float32) + np.float32(0.5) for length in size))
    for a, b, c in np.rint(vertices * 256).astype(np.float32) / np.float32(256):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        corners = [(a, b), (b, c), (c, a)] if area > 0 else [(b, a), (c, b), (a, c)]
        inside = np.full(counts.shape, area != 0)
        for p, q in corners:
            right, down, constant = p[1] - q[1], q[0] - p[0], p[0] * q[1] - q[0] * p[1]
            value = right * x + down * y + constant
            inside &= (value > 0) | ((value == 0) & (right > 0 or (right == 0 and down > 0)))
        counts += inside
    return counts


@pytest.mark.parametrize("fault", [flipped, off_centre, coarse, unsnapped, float32_edges])
def test_planted_fault_is_noticed(fault: Count) -> None:
    assert wrong_pixels(ss.count, "top-left") == 0
    assert wrong_pixels(fault, "top-left") > 0


@pytest.mark.parametrize("rule", ["bottom-left", "inclusive", "exclusive", POINTS["general"]], ids=str)
def test_flipped_rule_is_noticed_under_every_rule(rule: Any) -> None:
    assert wrong_pixels(flipped, rule) > 10


# rasterize: what is seen, and triangles that cross the near plane.


def front_scene(rng: np.random.Generator, count: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return clip coordinates wholly in front, some on the near plane, some with corners on samples, some of equal depth."""
    w = 2.0 ** rng.integers(-1, 3, 3 * count)
    x = (rng.integers(-2, 2 * SIZE[0] + 3, 3 * count) / 2) * 2 / SIZE[0] - 1
    y = 1 - (rng.integers(-2, 2 * SIZE[1] + 3, 3 * count) / 2) * 2 / SIZE[1]
    z = np.where(rng.random(3 * count) < 0.4, rng.integers(-1, 2, 3 * count), rng.uniform(-1, 1.3, 3 * count))
    return np.column_stack([x * w, y * w, z * w, w]), np.arange(3 * count).reshape(-1, 3)


def wrong_visibility(visibility: Any, clip: Floats, triangles: NDArray[np.int64], **options: Any) -> list[str]:
    """Return what differs from the oracle: primitives, unless nearer than 2 ulp of float32, and depths by more than an ulp."""
    faults = []
    for j in range(SIZE[1]):
        for i in range(SIZE[0]):
            truth = reference.visible(clip.tolist(), triangles.tolist(), i, j, SIZE, **options)
            primitive, depth = int(visibility.primitive[j, i]), float(visibility.depth[j, i])
            if truth.primitive < 0:
                if primitive != -1 or depth != -np.inf:
                    faults.append(f"({i}, {j}): {primitive} at {depth}, expected nothing")
                continue
            ulp = float(np.spacing(np.float32(abs(truth.depth))))
            decided = truth.margin > 2 * ulp or truth.margin == 0
            if (decided and primitive != truth.primitive) or not abs(depth - float(truth.depth)) <= ulp:
                faults.append(f"({i}, {j}): {primitive} at {depth}, expected {truth.primitive} at {float(truth.depth)}")
    return faults


@pytest.mark.parametrize("rule", [*RULES, "point"])
def test_visible_primitive_and_depth_equal_the_oracle(rule: str) -> None:
    rng = np.random.default_rng(51)
    named: Any = ss.OffscreenPoint(*POINTS["general"]) if rule == "point" else rule
    for cull in ("none", "back"):
        clip, triangles = front_scene(rng, 12)
        visibility = ss.rasterize(clip, triangles, SIZE, rule=named, cull=cull)
        assert wrong_visibility(visibility, clip, triangles, rule=named, cull=cull) == []


def test_visibility_comparison_reports_planted_faults() -> None:
    clip, triangles = front_scene(np.random.default_rng(52), 12)
    assert wrong_visibility(ss.rasterize(clip, triangles, SIZE), clip, triangles) == []
    for fault in ({"rule": "bottom-left"}, {"cull": "front"}, {"subpixel_bits": 4}):
        if fault == {"subpixel_bits": 4}:
            clip = clip + np.random.default_rng(53).uniform(-0.05, 0.05, clip.shape) * [1, 1, 0, 0]
        assert wrong_visibility(ss.rasterize(clip, triangles, SIZE, **fault), clip, triangles) != []
    assert wrong_visibility(ss.rasterize(clip * [1, 1, 0.999, 1], triangles, SIZE), clip, triangles) != []
    assert wrong_visibility(ss.rasterize(clip, triangles[::-1].copy(), SIZE), clip, triangles) != []


def clipped_triangle(rng: np.random.Generator) -> Floats:
    """Return a triangle in clip space with one or two vertices behind the near plane or behind the eye."""
    while True:
        clip = rng.normal(0, 1.2, (3, 4))
        clip[:, 3] = rng.uniform(-1.5, 2.5, 3)
        clip[:, 2] = rng.uniform(-1.2, 1.5, 3)
        if 1 <= sum(reference.is_in_front(vertex) for vertex in clip) <= 2:
            return np.asarray(clip)


def outside_the_band(visibility: Any, clip: Floats, seen: dict[str, int]) -> list[str]:
    """Return pixels that a triangle must cover and does not, or covers and must not, and depths off by more than the band."""
    faults = []
    for j in range(SIZE[1]):
        for i in range(SIZE[0]):
            verdict = reference.clipped_verdict(clip.tolist(), i, j, SIZE)
            seen[verdict.coverage] += 1
            covered = int(visibility.primitive[j, i]) == 0
            if verdict.coverage != "may" and covered != (verdict.coverage == "must"):
                faults.append(f"{clip.tolist()} ({i}, {j}): {covered}, {verdict.coverage} be covered")
            allowed = 1e-6 + float(verdict.slope_squared) ** 0.5 / 64
            if covered and verdict.coverage == "must" and abs(float(visibility.depth[j, i]) - float(verdict.depth)) > allowed:
                faults.append(f"{clip.tolist()} ({i}, {j}): depth {visibility.depth[j, i]}, expected {float(verdict.depth)}")
    return faults


def test_clipped_triangles_stay_in_the_band() -> None:
    rng, seen = np.random.default_rng(61), {"must": 0, "may": 0, "never": 0}
    for _ in range(100):
        clip = clipped_triangle(rng)
        assert outside_the_band(ss.rasterize(clip, np.array([[0, 1, 2]]), SIZE), clip, seen) == []
    assert min(seen["must"], seen["never"]) > 500, seen


def test_band_comparison_reports_planted_faults() -> None:
    rng, seen = np.random.default_rng(62), {"must": 0, "may": 0, "never": 0}
    moved, nothing, nearer = 0, 0, 0
    for _ in range(20):
        clip = clipped_triangle(rng)
        shifted = clip + 0.06 * clip[:, 3:] * [1, 0, 0, 0]
        moved += len(outside_the_band(ss.rasterize(shifted, np.array([[0, 1, 2]]), SIZE), clip, seen))
        nothing += len(outside_the_band(ss.rasterize(clip, np.zeros((0, 3), dtype=np.int64), SIZE), clip, seen))
        closer = ss.rasterize(clip, np.array([[0, 1, 2]]), SIZE)
        closer.depth[...] += 0.5
        nearer += len(outside_the_band(closer, clip, seen))
    assert min(moved, nothing, nearer) > 10


def test_triangle_behind_the_near_plane_draws_nothing() -> None:
    whole = np.array([[-9.0, -9, -2, 1], [9, -9, -2, 1], [0, 9, -2, 1], [-1, -1, 0, -1], [1, -1, 0, -2], [0, 1, 0, -1]])
    visibility = ss.rasterize(whole, np.array([[0, 1, 2], [3, 4, 5]]), SIZE)
    assert (visibility.primitive == -1).all()
    assert (visibility.depth == -np.inf).all()
