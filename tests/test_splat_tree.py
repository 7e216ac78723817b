"""Trees of splats: the order of points, what holds for every node, errors within bounds, the same tree from any pieces."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scanspan.assets.cloud import PointCloud
from scanspan.assets.mesh import Mesh
from scanspan.assets.splats import codec, merge, order
from scanspan.assets.splats.build import build_tree
from scanspan.assets.splats.job import build_file
from scanspan.assets.splats.tree import SplatTree
from scanspan.errors import InputError
from scanspan.records import Array
from tests.splatting import ball, check_points, check_tree, decoded, hard, numbered, parents

# Order


def slow_code(numbers: list[int], bits: range) -> int:
    """Return the Morton code of some bits of three numbers, by its definition."""
    code = 0
    for bit in reversed(bits):
        for number in numbers:
            code = code << 1 | (number >> bit & 1)
    return code


@pytest.mark.parametrize("shift", [0, 7, 21])
def test_codes_interleave_the_bits(shift: int) -> None:
    numbers = np.random.default_rng(shift).integers(0, 1 << 21 + shift, (200, 3))
    assert order.morton_codes(numbers, shift).tolist() == [slow_code(row, range(shift, shift + 21)) for row in numbers.tolist()]
    assert order.morton_rests(numbers, shift).tolist() == [slow_code(row, range(shift)) for row in numbers.tolist()]


@pytest.mark.parametrize("bits", [1, 5, 20, 40, 63])
def test_sorting_is_stable_and_right(bits: int) -> None:
    rng = np.random.default_rng(bits)
    codes = rng.integers(0, 1 << bits, 5000)
    codes[rng.integers(0, 5000, 1000)] = codes[7]
    found, keys = order.sorted_order(codes)
    assert np.array_equal(found, np.argsort(codes, kind="stable"))
    assert np.array_equal(keys, codes[found])


def test_sorting_nothing_and_one_code() -> None:
    for codes in (np.empty(0, np.int64), np.array([5]), np.full(100, 9)):
        found, keys = order.sorted_order(codes)
        assert found.tolist() == list(range(len(codes)))
        assert keys.tolist() == codes.tolist()


def test_points_of_one_code_are_sorted_by_the_rest() -> None:
    rng = np.random.default_rng(2)
    numbers = rng.integers(0, 1 << 20, (3000, 3))
    numbers[:1000] = (1 << 30) + rng.integers(0, 3, (1000, 3))
    found, codes, rests = order.order_points(numbers, 20)
    keys = list(zip(codes.tolist(), rests.tolist(), found.tolist()))
    assert keys == sorted(keys)


def test_a_cut_is_where_the_highest_bit_differs() -> None:
    codes = np.sort(np.random.default_rng(1).integers(0, 1 << 62, 3000))
    starts = np.zeros((1503, 2), np.int64)
    parts = order.cut_ranges(codes, np.empty(0, np.int64), 256, 1000, 0, starts)
    assert starts[0].tolist() == [0, 1000]
    assert starts[parts, 0] == 3000
    assert np.diff(starts[: parts + 1, 0]).max() <= 256
    for begin, level in starts[1:parts].tolist():
        assert level == 64 + int(codes[begin] ^ codes[begin - 1]).bit_length() - 1


def test_equal_points_are_halved() -> None:
    starts = np.zeros((600, 2), np.int64)
    parts = order.cut_ranges(np.zeros(1000, np.int64), np.empty(0, np.int64), 256, 1000, 0, starts)
    assert starts[:parts].tolist() == [[0, 1000], [250, -2], [500, -1], [750, -2]]


# Groups, normals and steps


def rows_of(levels: list[int]) -> Array:
    splats = np.zeros((len(levels), merge.COLUMNS))
    splats[:, merge.LEVEL] = levels
    return splats


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("apart", [0.0, 1.0, 100.0])
def test_groups_are_never_more_than_half_and_a_few(seed: int, apart: float) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 257))
    levels = rng.integers(0, int(rng.integers(1, 60)), count) if seed % 2 else np.arange(count)[:: -1 if seed % 4 else 1]
    starts, ends = np.zeros(258, np.int64), np.zeros(258, np.int64)
    splats = rows_of(levels.tolist())
    splats[:, merge.X], splats[:, merge.RADIUS] = np.cumsum(rng.random(count) ** 8) * apart, 1.0
    groups = merge.group_splats(splats, count, np.ones(3), starts, ends)
    sizes = np.diff(starts[: groups + 1])
    assert starts[0] == 0
    assert starts[groups] == count
    assert 1 <= sizes.min() <= sizes.max() <= merge.FULL_GROUP + 1
    assert groups <= max(1, count // 2 + (merge.SPARE if count <= merge.FEW else 0))


def test_a_group_does_not_span_a_gap() -> None:
    splats = rows_of([1, 1, 1, 9, 1, 1, 1, 1])
    splats[:, merge.X], splats[:, merge.RADIUS] = [0, 1, 2, 3, 500, 501, 502, 503], 1.0
    starts, ends = np.zeros(258, np.int64), np.zeros(258, np.int64)
    assert merge.group_splats(splats, 8, np.ones(3), starts, ends) == 2
    assert starts[:3].tolist() == [0, 4, 8]
    assert merge.group_splats(splats, 5, np.ones(3), starts, ends) == 2
    assert starts[:3].tolist() == [0, 4, 5]


@pytest.mark.parametrize("shape", ["powers", "pairs", "far apart", "one far"])
def test_points_that_lie_oddly_make_a_tree(shape: str) -> None:
    rng = np.random.default_rng(2)
    places = {
        "powers": np.exp2(rng.integers(-20, 20, (3000, 3)).astype(np.float64)),
        "pairs": np.repeat(rng.integers(0, 1 << 30, (1500, 3)).astype(np.float64), 2, axis=0) + rng.random((3000, 3)) * 1e-3,
        "far apart": np.repeat(rng.integers(0, 1 << 30, (300, 3)).astype(np.float64), 10, axis=0),
        "one far": np.concatenate([rng.random((2999, 3)), [[1e9, 0, 0]]]),
    }[shape]
    tree = build_tree(places)
    assert tree.point_count == 3000
    assert tree.splat_count <= 2 * 3000 + 2 * merge.SPARE * len(tree.nodes)
    assert tree.nodes["count"].max() <= 256


def test_normals_are_within_two_degrees() -> None:
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(100_000, 3))
    normals[:6] = np.vstack([np.eye(3), -np.eye(3)])
    normals[6:2006] = rng.choice([-1.0, 1.0], (2000, 3)) + rng.normal(size=(2000, 3)) * 0.01
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tree = build_tree({"positions": rng.random((len(normals), 3)), "normals": normals})
    found = np.empty((len(normals), 3))
    leaves = np.flatnonzero(tree.is_leaf)
    codec.decode_normals(tree.read_many(leaves).splats.normal, found)
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 1e-12

    # Each decoded normal is near one that was given, and the cones are widened by more than the largest angle.
    codes = np.array([codec.octahedral(*normal) << 2 for normal in normals[:20_000].tolist()])
    decoded_normals = np.empty((len(codes), 3))
    codec.decode_normals(codes, decoded_normals)
    angles = np.arccos(np.clip((decoded_normals * normals[:20_000]).sum(axis=1), -1, 1))
    assert math.radians(1.5) < angles.max() < math.asin(codec.NORMAL_SINE)


def test_lengths_are_rounded_up_a_little() -> None:
    for length in [0.0, 1e-90, 0.1, 1.0, 4095.0, 1e80, *np.random.default_rng(4).random(100).tolist()]:
        rounded = codec.round_up(length)
        assert length <= rounded <= length * (1 + 1 / 2048)
        assert (math.frexp(rounded)[0] * 4096).is_integer()


# Trees


@pytest.mark.parametrize("count", [1, 2, 3, 6, 7, 100, 256, 257, 1000, 20_000])
def test_trees_of_a_ball(count: int) -> None:
    cloud = ball(count)
    tree = build_tree(cloud)
    check_tree(tree, cloud)
    if count >= 20_000:
        assert 1.2 < tree.splat_count / count < 1.4


def test_a_tree_of_hard_points() -> None:
    cloud = hard()
    check_tree(build_tree(cloud), cloud)


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1.0, (5e5, 4e6, 100.0)), (1e-90, (0, 0, 0)), (1e90, (0, 0, 0)), (1e-3, (1e9, -1e9, 0)), (1e-12, (1.0, 1.0, 1.0))],
)
def test_trees_of_huge_and_tiny_clouds(scale: float, offset: tuple[float, ...]) -> None:
    cloud = ball(2000)
    cloud["positions"] = cloud["positions"] * scale + np.array(offset)
    tree = build_tree(cloud)
    assert tree.point_count == 2000
    number, places, radii, _ = decoded(tree, np.flatnonzero(tree.is_leaf))
    assert np.isfinite(places).all()
    assert np.isfinite(radii).all()
    # In units of the ball, so that nothing overflows where distances are measured.
    table = tree.nodes
    error = np.abs((places + tree.origin - offset) / scale)
    assert (error <= 7 + table["error"][number][:, None] / scale).all()
    bounds = tree.bounds
    assert (bounds[0] <= cloud["positions"].min(axis=0)).all()
    assert (bounds[1] >= cloud["positions"].max(axis=0)).all()
    assert (np.diff(bounds, axis=0) < 60 * scale + 1e-6 * max(map(abs, offset))).all()


def test_flat_and_straight_clouds() -> None:
    rng = np.random.default_rng(6)
    for factors in [(1, 1, 0), (1, 0, 0), (0, 0, 1)]:
        cloud = {"positions": rng.random((3000, 3)) * factors, "color": numbered(3000)}
        check_tree(build_tree(cloud), cloud)


def test_integers_come_back_where_the_step_allows() -> None:
    rng = np.random.default_rng(8)
    numbers = rng.integers(-(2**31), 2**31, (5000, 3))
    numbers[:, 2] = 17
    numbers[2500:] = rng.integers(1000, 4000, (2500, 3))
    cloud = PointCloud(integers=numbers, scale=(0.01, 0.01, 0.001), offset=(5e5, 4e6, 0.0), color=numbered(5000))
    tree = build_tree(cloud, exact=True)
    offset, scale, base = tree.lattice
    leaves = np.flatnonzero(tree.is_leaf & (tree.nodes["step"] == scale).all(axis=1))
    number, places, _, _ = decoded(tree, leaves)
    found = np.rint(places / scale).astype(np.int64) + base
    true = {tuple(row) for row in numbers.tolist()}
    assert len(found) >= 2000
    assert {tuple(row) for row in found.tolist()} <= true
    assert offset.tolist() == [5e5, 4e6, 0.0]
    assert tree.nodes["error"][number].max() < 1e-7
    check_points(tree, cloud.positions)


def test_errors_are_a_tenth_of_the_parents_radius_in_thirteenths() -> None:
    tree = build_tree(ball(20_000))
    table = tree.nodes
    parent = parents(tree)
    _, _, radii, _ = decoded(tree, np.arange(len(table)))
    mean = np.add.reduceat(radii, table["first_number"].astype(np.int64)) / table["count"]
    leaves = tree.is_leaf
    half = table["step"][leaves].max(axis=1) / 2
    assert half.mean() <= mean[parent[leaves]].mean() / 13 / 10
    assert (half <= 2 * mean[parent[leaves]] / 13 / 10).all()


def test_means_of_colours_are_those_of_light() -> None:
    rng = np.random.default_rng(9)
    color = np.where(rng.random((40_000, 1)) < 0.5, 0, 255) * np.ones(3, np.uint8)
    tree = build_tree({"positions": rng.random((40_000, 3)) * (1, 1, 0), "color": color.astype(np.uint8)})
    # Half the light of white is 188 in sRGB.
    assert abs(tree.read(0).color.mean() - 188) < 6


def test_a_mesh_is_closed_by_its_triangles() -> None:
    mesh = Mesh([(0, 0, 0), (4, 0, 0), (0, 3, 0), (0, 0, 30), (9, 9, 9)], [(0, 1, 2), (0, 2, 3)], nonfinite="error")
    tree = build_tree(mesh)
    number, places, radii, splats = decoded(tree, np.arange(1))
    assert tree.point_count == 4
    assert tree.has_normals
    far = math.sqrt(9 + 900) / 2
    expected = {(0, 0, 0): far, (4, 0, 0): 2.5, (0, 3, 0): far, (0, 0, 30): far}
    for place, radius in zip((places + tree.origin).tolist(), radii.tolist()):
        nearest = min(expected, key=lambda corner: math.dist(corner, place))
        assert math.dist(nearest, place) <= tree.nodes["error"][0]
        assert expected[nearest] <= radius <= expected[nearest] + far / 14
    assert len(number) == len(splats.normal) == 4


def test_radii_close_a_plane() -> None:
    rng = np.random.default_rng(10)
    points = rng.random((20_000, 3)) * (1, 1, 0)
    tree = build_tree(points)
    _, places, radii, _ = decoded(tree, np.flatnonzero(tree.is_leaf))
    places = places + tree.origin
    from scipy.spatial import cKDTree

    asked = (0.05 + 0.9 * rng.random((4000, 3))) * (1, 1, 0)
    distance, index = cKDTree(places).query(asked, 30)
    assert (distance > radii[index]).all(axis=1).mean() < 0.01
    assert radii.mean() < 1.5 / math.sqrt(20_000)


def test_normals_are_estimated_without_a_side() -> None:
    rng = np.random.default_rng(11)
    points = rng.random((3000, 3)) * (1, 1, 0) @ np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1]])
    tree = build_tree({"positions": points, "normals": np.ones((3000, 3))}, normals="estimate")
    found = np.empty((3000, 3))
    codec.decode_normals(tree.read_many(np.flatnonzero(tree.is_leaf)).splats.normal, found)
    expected = np.array([-1, 0, 1]) / math.sqrt(2)
    assert (found @ expected > 0.999).mean() > 0.99
    assert (tree.nodes["cone_sine"] > 1).all()
    line = build_tree({"positions": np.arange(9.0)[:, None] * np.ones(3)}, normals="estimate")
    assert len(line.read(0).normal) == 9


def test_normals_can_be_left_out() -> None:
    tree = build_tree(ball(300), normals="none")
    assert not tree.has_normals
    assert tree.read(0).normal.shape == (0,)


def test_no_points_make_a_tree_without_nodes(tmp_path: Path) -> None:
    for source in (np.empty((0, 3)), [], PointCloud(np.empty((0, 3))), iter([]), Mesh(np.empty((0, 3)), np.empty((0, 3), int))):
        for path in (None, tmp_path / "empty.scansplat"):
            tree = build_tree(source, path)
            assert len(tree.nodes) == tree.point_count == tree.level_count == 0
            assert tree.bounds.shape == (2, 3)
            assert len(tree.read_many([]).splats.radius) == 0


# The same tree from any pieces


def as_arrays(cloud: dict[str, Array]) -> Any:
    return cloud


def as_pieces(cloud: dict[str, Array]) -> Iterator[dict[str, Array]]:
    for first in range(0, len(cloud["positions"]), 777):
        yield {name: values[first : first + 777] for name, values in cloud.items()}


def as_clouds(cloud: dict[str, Array]) -> list[PointCloud]:
    return [PointCloud(**piece) for piece in as_pieces(cloud)]  # type: ignore[arg-type]


@pytest.mark.parametrize("pieces", [as_arrays, as_pieces, as_clouds])
@pytest.mark.parametrize("size", [100_000, 3000, 700])
def test_the_bytes_are_the_same_for_all_pieces_and_memories(tmp_path: Path, pieces: Callable[[Any], Any], size: int) -> None:
    cloud = hard(2000)
    options = {"normals": "given", "exact": False, "nonfinite": "error"}
    paths = tmp_path / "whole", tmp_path / "parts"
    build_file(paths[0], cloud, options, 1 << 30, False, lambda *told: None)
    tree = build_file(paths[1], pieces(cloud), options, size, False, lambda *told: None)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert tree.point_count == len(cloud["positions"])
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["parts", "whole"]


def test_a_tree_in_memory_is_that_of_the_file(tmp_path: Path) -> None:
    cloud = ball(5000)
    kept, stored = build_tree(cloud), build_tree(cloud, tmp_path / "ball.scansplat")
    assert np.array_equal(kept.nodes, stored.nodes)
    assert np.array_equal(kept.origin, stored.origin)
    nodes = np.arange(len(kept.nodes))
    for a, b in zip(kept.read_many(nodes).splats, stored.read_many(nodes).splats):
        assert np.array_equal(a, b)
    assert repr(kept) == repr(stored) == f"SplatTree(5,000 points, {len(kept.nodes)} nodes, {kept.level_count} levels)"


PLAIN = """
import sys
from pathlib import Path
from scanspan.assets.splats.build import build_tree
from tests.splatting import ball, hard
folder = Path(sys.argv[1])
build_tree(ball(700), folder / "ball")
build_tree(hard(100), folder / "hard", normals="estimate")
"""


def test_the_bytes_are_the_same_in_plain_python(tmp_path: Path) -> None:
    for name, changed in [("compiled", {}), ("plain", {"NUMBA_DISABLE_JIT": "1"})]:
        (tmp_path / name).mkdir()
        command = [sys.executable, "-W", "error", "-c", PLAIN, str(tmp_path / name)]
        subprocess.run(command, cwd=Path(__file__).parent.parent, env={**os.environ, **changed}, check=True)
    for file in ("ball", "hard"):
        assert (tmp_path / "compiled" / file).read_bytes() == (tmp_path / "plain" / file).read_bytes()


# Reading


@pytest.fixture(scope="module")
def small_tree() -> SplatTree:
    return build_tree(ball(2000))


def test_nodes_are_read_in_any_order_and_into_room_that_is_there(small_tree: SplatTree) -> None:
    nodes = np.random.default_rng(1).permutation(len(small_tree.nodes))
    room = small_tree.room(small_tree.splat_count + 10)
    blocks = small_tree.read_many(nodes, room)
    assert blocks.splats is room
    for k, node in enumerate(nodes.tolist()):
        for part, whole in zip(small_tree.read(node), blocks.splats):
            assert np.array_equal(part, whole[blocks.starts[k] : blocks.starts[k + 1]])


def test_nodes_that_are_not_there_are_refused(small_tree: SplatTree) -> None:
    last = len(small_tree.nodes) - 1
    with pytest.raises(InputError, match=f"expected nodes from 0 to {last}, got {last + 1}"):
        small_tree.read(last + 1)
    with pytest.raises(InputError, match=f"expected nodes from 0 to {last}, got -1"):
        small_tree.read_many([0, -1])
    with pytest.raises(InputError, match=r"expected room for \d+ splats, got room for 3"):
        small_tree.read_many([0], small_tree.room(3))
