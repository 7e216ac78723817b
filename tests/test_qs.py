"""The classic 48 bits a node: codes, enclosing, normals, cones, colours, round trips, and damage anywhere in a file."""

from __future__ import annotations

import struct
import zlib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from scanspan.assets.cloud import PointCloud
from scanspan.assets.load import load
from scanspan.assets.mesh import Mesh
from scanspan.assets.splats import qs, spheres
from scanspan.assets.splats.qs import HEADER, Splats, build_splats, decode_qs, encode_qs, read_qs, write_qs
from scanspan.errors import FormatError, InputError
from scanspan.records import Float64Array

ROUNDING = 1e-12


def ball(count: int = 2000, seed: int = 1) -> PointCloud:
    """Return points on a ball with normals and colours."""
    away = np.random.default_rng(seed).normal(size=(count, 3))
    away /= np.sqrt((away**2).sum(axis=1))[:, None]
    return PointCloud(away * 3 + (500_000, 4_900_000, 10), normals=away, color=(away + 1) / 2)


def clouds() -> dict[str, PointCloud]:
    """Return clouds of several shapes."""
    rng = np.random.default_rng(2)
    return {
        "ball": ball(),
        "body": PointCloud(rng.random((1500, 3), np.float32), normals=rng.normal(size=(1500, 3))),
        "uneven": PointCloud(rng.uniform(-1, 1, (1500, 3)) ** 9, color=rng.integers(0, 256, (1500, 3))),
        "the same": PointCloud(np.full((50, 3), 0.3)),
        "one": PointCloud([(1, 2, 3)], color="red", normals=[(0, 0, 5)]),
        "a line": PointCloud(rng.random((300, 1)) * (1, 0, 0)),
    }


CLOUDS = clouds()
BUILT = {name: build_splats(cloud) for name, cloud in CLOUDS.items()}


def test_there_are_7621_codes_by_exact_fractions() -> None:
    """|c| <= 1 + sqrt(3) r without a root: a <= sqrt(b) is a < 0 or a^2 <= b."""
    found = []
    for size in range(1, 14):
        r = Fraction(size, 13)
        for corner in np.ndindex(*[14 - size] * 3):
            square = sum((Fraction(size + 2 * k, 13) - 1) ** 2 for k in corner)
            excess = square - 1 - 3 * r * r
            if excess <= 0 or excess * excess <= 12 * r * r:
                found.append((size, *corner))
    assert len(found) == 7621
    np.testing.assert_array_equal(spheres.sphere_codes(), found)
    by_size = np.bincount(spheres.sphere_codes()[:, 0])[1:].tolist()
    assert by_size == [1617, 1648, 1331, 1000, 729, 512, 343, 216, 125, 64, 27, 8, 1]


@pytest.mark.parametrize("name", BUILT)
def test_decoded_spheres_enclose_what_they_stand_for(name: str) -> None:
    true, seen = BUILT[name].tree, decode_qs(encode_qs(BUILT[name])).tree
    np.testing.assert_array_equal(seen.children, true.children)
    slack = ROUNDING * (np.abs(true.centres).max() + true.radii[0])
    growth = seen.radii - true.radii
    off = seen.centres - true.centres
    assert (growth >= -slack).all()
    assert (np.abs(off).max(axis=1) <= growth + slack).all()
    assert (np.sqrt((off**2).sum(axis=1)) <= np.sqrt(3) * growth + slack).all()

    # Errors do not add up: each is bound by the parent's radius, however deep the node lies.
    above = seen.radii[np.maximum(true.parents, 0)]
    assert (growth[1:] <= above[1:] * (3 / 13) + slack).all()


@pytest.mark.parametrize("name", BUILT)
def test_every_point_is_a_leaf_and_parents_hold_their_children(name: str) -> None:
    tree, cloud = BUILT[name].tree, CLOUDS[name]
    leaves = tree.points[tree.children == 0]
    assert sorted(leaves.tolist()) == list(range(len(cloud)))
    np.testing.assert_array_equal(tree.centres[tree.children == 0], cloud.positions[leaves])
    parents = tree.parents[1:]
    reach = np.sqrt(((tree.centres[1:] - tree.centres[parents]) ** 2).sum(axis=1)) + tree.radii[1:]
    assert (reach <= tree.radii[parents]).all()
    assert set(tree.children.tolist()) <= {0, 2, 3, 4}


def test_the_split_is_the_same_as_plain_python() -> None:
    places = np.random.default_rng(3).integers(0, 6, (200, 3)).astype(float)
    arrays = [[np.arange(200), *(np.zeros(400, np.int64) for _ in range(4))] for _ in range(2)]
    counts = [spheres.split_points(places, *arrays[0]), spheres.split_points.py_func(places, *arrays[1])]
    assert counts[0] == counts[1]
    for k in (0, 2, 3, 4):
        np.testing.assert_array_equal(arrays[0][k][: counts[0]], arrays[1][k][: counts[0]])


@pytest.mark.parametrize("name", BUILT)
def test_what_is_written_again_is_the_same_file(name: str, tmp_path: Path) -> None:
    content = encode_qs(BUILT[name])
    assert len(content) == HEADER.size + 6 * len(BUILT[name].tree.radii)
    write_qs(tmp_path / "a.qs", BUILT[name])
    assert (tmp_path / "a.qs").read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["a.qs"]
    seen = read_qs(tmp_path / "a.qs")
    again = decode_qs(encode_qs(seen._replace(cones=seen.cones)))
    np.testing.assert_array_equal(again.colors, seen.colors)
    np.testing.assert_array_equal(again.normals, seen.normals)
    np.testing.assert_array_equal(again.tree.children, seen.tree.children)
    assert (seen.has_normals, seen.has_colors) == (CLOUDS[name].normals is not None, CLOUDS[name].color is not None)


def test_levels_are_coarse_pictures_of_the_whole() -> None:
    seen = decode_qs(encode_qs(BUILT["ball"]))
    sizes = [level.stop - level.start for level in seen.levels]
    assert sizes[0] == 1
    assert sum(sizes) == len(seen.tree.radii)
    largest = [float(seen.tree.radii[level].max()) for level in seen.levels]
    assert largest == sorted(largest, reverse=True)


# Normals, cones and colours


def leaves_below(splats: Splats) -> list[list[int]]:
    """Return the points below each node."""
    found: list[list[int]] = [[point] if point >= 0 else [] for point in splats.tree.points.tolist()]
    for node in range(len(found) - 1, 0, -1):
        found[splats.tree.parents[node]] += found[node]
    return found


def test_every_code_of_a_normal_is_its_own() -> None:
    table = qs.normal_codes()
    np.testing.assert_array_equal(qs.encode_normals(table), np.arange(16_224))
    assert np.abs((table.astype(float) ** 2).sum(axis=1) - 1).max() < 1e-6
    assert qs.encode_normals(np.zeros((1, 3))).tolist() == [qs.NO_NORMAL]


def test_normals_are_off_by_little() -> None:
    normals = np.random.default_rng(4).normal(size=(20_000, 3))
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    seen = qs.normal_codes()[qs.encode_normals(normals)]
    assert np.degrees(np.arccos(np.minimum((seen * normals).sum(axis=1), 1))).max() < 1.4


@pytest.mark.parametrize("name", ["ball", "body", "one"])
def test_cones_hold_all_normals_below(name: str) -> None:
    splats, normals = BUILT[name], CLOUDS[name].normals
    assert normals is not None
    unit = normals / np.sqrt((normals.astype(float) ** 2).sum(axis=1))[:, None]
    for seen in (splats, decode_qs(encode_qs(splats))):
        narrow = 0
        for node, below in enumerate(leaves_below(splats)):
            sine = float(seen.cones[node])
            if sine < 1:
                narrow += 1
                cosines = unit[below] @ seen.normals[node].astype(float)
                assert (cosines >= np.sqrt(1 - sine * sine) - 1e-6).all()
        assert narrow >= len(normals)


def test_colours_are_means_in_16_bits() -> None:
    splats, color = BUILT["ball"], CLOUDS["ball"].color
    assert color is not None
    for node, below in list(enumerate(leaves_below(splats)))[::37]:
        np.testing.assert_allclose(splats.colors[node], color[below].mean(axis=0), atol=0.51)
    every = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    seen = qs.from_565(qs.to_565(every)).astype(int)
    assert np.abs(seen - every).max(axis=0).tolist() == [4, 2, 4]
    assert seen[[0, 255]].tolist() == [[0] * 3, [255] * 3]


# Meshes


def test_vertices_of_a_mesh(shared_data: Path) -> None:
    mesh = load(shared_data / "meshes" / "suzanne.ply").instances[0].geometry
    assert isinstance(mesh, Mesh)
    splats = build_splats(mesh)
    assert (splats.tree.children == 0).sum() == len(np.unique(mesh.triangles))

    # Leaves reach their neighbours: the balls at the corners of a triangle meet along each side.
    radii = np.zeros(len(mesh.positions))
    leaf = splats.tree.children == 0
    radii[np.unique(mesh.triangles)[splats.tree.points[leaf]]] = splats.tree.radii[leaf]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        first, second = mesh.triangles[:, a], mesh.triangles[:, b]
        length = np.sqrt(((mesh.positions[first] - mesh.positions[second]) ** 2).sum(axis=1))
        assert (radii[first] + radii[second] >= length * (1 - 1e-9)).all()


def test_normals_of_a_mesh_without_any_point_outward() -> None:
    box = Mesh.from_polygons(
        [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)],
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
    )
    splats = build_splats(box)
    leaf = splats.tree.children == 0
    assert ((splats.tree.centres[leaf] - 0.5) * splats.normals[leaf] > 0).all()
    assert splats.has_normals


# Messages and damage


def test_what_cannot_be_built_or_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a tree of splats needs at least one point"):
        build_splats(PointCloud([]))
    for radius in (0, -1.0, float("nan"), True):
        with pytest.raises(InputError, match=f"radius = {radius!r}: expected a number above 0"):
            build_splats(ball(5), radius)
    with pytest.raises(InputError, match=r"points reach to 1e\+120: expected coordinates within 1e\+100"):
        build_splats(PointCloud([(1e120, 0, 0)]))
    with pytest.raises(InputError, match="geometry: expected a PointCloud or a Mesh, got str"):
        build_splats("dragon.ply")  # type: ignore[arg-type]
    with pytest.raises(FormatError, match=r"no/a.qs: it cannot be written: no such file or directory"):
        write_qs("no/a.qs", BUILT["one"])
    with pytest.raises(FormatError, match=r"b.qs: it cannot be read: no such file or directory"):
        read_qs(tmp_path / "b.qs")


def sealed(content: bytes) -> bytes:
    """Return a file with the checksums that its bytes have now."""
    head = content[:64] + struct.pack("<I", zlib.crc32(content[HEADER.size :]))
    return head + struct.pack("<I", zlib.crc32(head)) + content[HEADER.size :]


def changed(content: bytes, place: int, form: str, *values: float) -> bytes:
    """Return a file with numbers changed and its checksums made good, as damage alone would not do."""
    copy = bytearray(content)
    struct.pack_into(form, copy, place, *values)
    return sealed(bytes(copy))


def test_what_is_said_of_a_file_that_was_made_wrong() -> None:
    good = encode_qs(BUILT["ball"])
    count = (len(good) - HEADER.size) // 6
    (word,) = struct.unpack_from("<H", good, HEADER.size)
    leaves = struct.unpack_from("<Q", good, 24)[0]
    cases = {
        "expected the mark of a .qs file at the start, got b'PNG": b"PNG" + good[3:],
        "the file ends within its header, after 40 bytes": good[:40],
        "byte 0 on: the checksum of the header is wrong: the file is damaged": good[:30] + b"\1" + good[31:],
        f"byte {HEADER.size} on: the checksum of the nodes is wrong: the file is damaged": good[:-1] + b"\0",
        f"the header says {count} nodes of 6 bytes, there are {count * 6 - 1} bytes": good[:-1],
        "version 2, expected 1": changed(good, 8, "<I", 2),
        f"{count} nodes below a sphere at (nan,": changed(good, 32, "<d", float("nan")),
        "0 nodes below a sphere": changed(good, 16, "<Q", 0),
        "node 1 has sphere 8191, there are 7621": changed(good, HEADER.size + 6, "<H", 0xFFFF),
        f"the {count} nodes are no tree with {leaves} leaves": changed(good, HEADER.size, "<H", word & ~6),
        f"the {count} nodes are no tree with 5 leaves": changed(good, 24, "<Q", 5),
        "the marks of grandchildren do not fit the tree": changed(good, HEADER.size, "<H", word ^ 1),
    }
    for expected, content in cases.items():
        with pytest.raises(FormatError) as caught:
            decode_qs(content, "a.qs")
        assert str(caught.value).startswith(f"a.qs: {expected}")


def test_damage_of_any_byte_and_any_cut_is_found() -> None:
    good = encode_qs(build_splats(ball(40)))
    for place in range(len(good)):
        for content in (good[:place], good[:place] + bytes([good[place] ^ 64]) + good[place + 1 :], good + good[:1]):
            with pytest.raises(FormatError):
                decode_qs(content)


def test_nodes_that_anybody_makes_up_never_crash() -> None:
    rng, good = np.random.default_rng(5), encode_qs(build_splats(ball(40)))
    taken = 0
    for _ in range(300):
        copy = bytearray(good)
        for place in rng.integers(HEADER.size, len(good), 2):
            copy[place] = int(rng.integers(0, 256))
        try:
            seen = decode_qs(sealed(bytes(copy)))
        except FormatError:
            continue
        assert np.isfinite(seen.tree.centres).all()
        assert (seen.tree.radii > 0).all()
        taken += 1
    assert 50 < taken < 300


def positions_of(splats: Splats) -> Float64Array:
    """Return the centres of the leaves in the order of the points."""
    leaf = splats.tree.children == 0
    return splats.tree.centres[leaf][np.argsort(splats.tree.points[leaf])]


def test_the_error_of_positions_is_that_of_the_classic_format() -> None:
    splats = BUILT["ball"]
    seen = decode_qs(encode_qs(splats))
    off = np.sqrt(((seen.tree.centres - splats.tree.centres) ** 2).sum(axis=1))[splats.tree.children == 0]
    parents = seen.tree.radii[splats.tree.parents[splats.tree.children == 0]]
    assert 0.01 < (off / parents).mean() < 0.1
    assert positions_of(splats).tolist() == CLOUDS["ball"].positions.tolist()
