"""Files of splats: what is written is read, damage of every kind is told, and builds that were cut off go on."""

from __future__ import annotations

import struct
import subprocess
import sys
import threading
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scanspan.assets.mesh import Mesh
from scanspan.assets.splats import file as splat_file
from scanspan.assets.splats import pages
from scanspan.assets.splats.build import as_bytes, build_tree
from scanspan.assets.splats.file import FOOTER, FOOTER_SIZE, HEADER, HEADER_SIZE, read_tree
from scanspan.assets.splats.job import build_file
from scanspan.assets.splats.journal import Journal
from scanspan.errors import FormatError, InputError
from tests.splatting import ball, check_tree, hard

OPTIONS = {"normals": "given", "exact": False, "nonfinite": "error"}


def tell_nobody(stage: str, done: int, count: int) -> None:
    """Take no notice."""


@pytest.fixture(scope="module")
def ball_bytes(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("ball") / "ball.scansplat"
    build_tree(ball(3000), path)
    return path.read_bytes()


def read_all(path: Path) -> None:
    read_tree(path).verify()


# Pages


@pytest.mark.parametrize(("has_color", "has_normals"), [(True, True), (True, False), (False, True), (False, False)])
def test_pages_come_back(has_color: bool, has_normals: bool) -> None:
    rng = np.random.default_rng(1)
    splats = pages.make_splats(1000, has_color, has_normals)
    for array in splats:
        array[...] = rng.integers(0, np.iinfo(array.dtype).max, array.shape, endpoint=True)
    splats.positions[:4] = [[0, 65535, 0], [65535, 0, 32768], [0, 32767, 0], [32768, 0, 65535]]
    planes = np.empty((pages.plane_count(has_color, has_normals), 1000), np.uint8)
    pages.split_planes(splats, planes)
    content = pages.pack_bytes(planes, pages.zstandard().ZstdCompressor())
    found = np.empty_like(planes)
    assert pages.unpack_bytes(content, found, pages.zstandard().ZstdDecompressor()) == ""
    joined = pages.make_splats(1000, has_color, has_normals)
    pages.join_planes(found, joined)
    for a, b in zip(splats, joined):
        assert np.array_equal(a, b)


def test_planes_that_do_not_fit_are_told() -> None:
    decompressor = pages.zstandard().ZstdDecompressor()
    content = pages.pack_bytes(np.zeros((2, 50), np.uint8), pages.zstandard().ZstdCompressor())
    room = np.empty((2, 50), np.uint8)
    assert pages.unpack_bytes(content[:7], room, decompressor) == "expected 2 lengths of planes, got 7 bytes"
    assert "bytes in all" in pages.unpack_bytes(content + b"x", room, decompressor)
    assert pages.unpack_bytes(content, np.empty((2, 49), np.uint8), decompressor) == "expected 49 bytes in plane 0, got 50"
    wrong = content[:8] + b"\0" * (len(content) - 8)
    assert "plane 0 cannot be decompressed" in pages.unpack_bytes(wrong, room, decompressor)


def test_a_missing_package_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "zstandard", None)
    with pytest.raises(InputError, match=r'files of splats need zstandard; install it with: pip install "scanspan\[points\]"'):
        build_tree(ball(10), tmp_path / "ball.scansplat")
    assert list(tmp_path.iterdir()) == []


# Damage


def test_every_flipped_byte_is_found(ball_bytes: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.scansplat"
    rng = np.random.default_rng(2)
    ends = [*range(HEADER_SIZE + 4), *range(len(ball_bytes) - FOOTER_SIZE - 4, len(ball_bytes))]
    for place in [*ends, *rng.integers(0, len(ball_bytes), 150).tolist()]:
        damaged = bytearray(ball_bytes)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(FormatError, match=r"damaged\.scansplat: ") as caught:
            read_all(path)
        assert "\n" not in str(caught.value)


def test_the_place_of_damage_is_named(ball_bytes: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.scansplat"
    place, first, second, page_count, *_ = FOOTER.unpack(ball_bytes[-FOOTER.size :])
    end = len(ball_bytes) - 1
    expected = {
        3: r"byte 0: expected a file of splats, which starts with b'scanspan splats\\n', got b'sca",
        20: f"header, bytes 0 to {HEADER_SIZE - 1}: the checksum does not fit; the file was damaged",
        HEADER_SIZE: rf"page \d, bytes {HEADER_SIZE} to \d+: the checksum does not fit",
        place - 1: rf"page \d, bytes \d+ to {place - 1}: the checksum does not fit",
        place: f"table of pages, bytes {place} to {place + first - 1}: the checksum does not fit",
        place + first: f"table of nodes, bytes {place + first} to {place + first + second - 1}: the checksum does not fit",
        end - 30: f"footer, bytes {end + 1 - FOOTER_SIZE} to {end}: the checksum does not fit",
        end: f"byte {end + 1}: expected a footer at the end; the build was not finished",
    }
    assert page_count >= 3
    for byte, message in expected.items():
        damaged = bytearray(ball_bytes)
        damaged[byte] ^= 64
        path.write_bytes(damaged)
        with pytest.raises(FormatError, match=message):
            read_all(path)


def test_a_file_that_was_cut_off_anywhere_is_refused(ball_bytes: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.scansplat"
    sizes = np.random.default_rng(3).integers(0, len(ball_bytes), 60).tolist()
    for size in [0, 1, 16, HEADER_SIZE - 1, HEADER_SIZE, len(ball_bytes) - FOOTER_SIZE, len(ball_bytes) - 1, *sizes]:
        path.write_bytes(ball_bytes[:size])
        with pytest.raises(FormatError, match=r"the file is empty|expected a header|expected a footer"):
            read_tree(path)
    path.write_bytes(ball_bytes + b"more")
    with pytest.raises(FormatError, match="expected a footer"):
        read_tree(path)


def test_what_is_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="cannot be opened"):
        read_tree(tmp_path)
    with pytest.raises(FormatError, match=r"none\.scansplat: cannot be opened \(No such file"):
        read_tree(tmp_path / "none.scansplat")


def rewrite(content: bytes, change: Callable[[np.ndarray[Any, Any], np.ndarray[Any, Any]], None]) -> bytes:
    """Return a file whose tables were changed, with checksums that fit."""
    place, first, second, page_count, node_count, points, *_ = FOOTER.unpack(content[-FOOTER.size :])
    table, _ = splat_file.unpack_table(content[place : place + first], splat_file.PAGE_ROW, page_count)
    nodes, _ = splat_file.unpack_table(content[place + first : place + first + second], splat_file.STORED, node_count)
    change(table, nodes)
    return content[:place] + splat_file.pack_end(table, nodes, points, place)


@pytest.mark.parametrize(
    ("name", "row", "value", "message"),
    [
        ("children", 0, 0, "node 1 does not fit among"),
        ("children", 0, 9, "node .* (does not fit|has numbers)"),
        ("children", -1, 2, "does not fit among"),
        ("page", 3, 1000, "node 3 lies outside its page"),
        ("start", 5, 60000, "node 5 lies outside its page"),
        ("sphere", 2, np.nan, "node 2 has numbers that cannot be"),
        ("largest", 2, -1.0, "node 2 has numbers that cannot be"),
        ("error", 2, np.inf, "node 2 has numbers that cannot be"),
        ("step", 4, 0, "node 4 has numbers that cannot be"),
        ("axis", 4, 0, "node 4 has numbers that cannot be"),
        ("low", 1, 1 << 60, "node 1 has numbers that cannot be"),
        ("count", -1, 254, "points, the nodes have|lies outside its page"),
    ],
)
def test_tables_that_make_no_sense_are_refused(
    ball_bytes: bytes, tmp_path: Path, name: str, row: int, value: Any, message: str
) -> None:
    def change(table: Any, nodes: Any) -> None:
        nodes[name][row] = value

    path = tmp_path / "wrong.scansplat"
    path.write_bytes(rewrite(ball_bytes, change))
    with pytest.raises(FormatError, match=message):
        read_tree(path)


@pytest.mark.parametrize(("name", "value"), [("offset", 50), ("bytes", 10), ("splats", 1 << 20), ("splats", 0)])
def test_pages_that_make_no_sense_are_refused(ball_bytes: bytes, tmp_path: Path, name: str, value: int) -> None:
    def change(table: Any, nodes: Any) -> None:
        table[name][1] = value

    path = tmp_path / "wrong.scansplat"
    path.write_bytes(rewrite(ball_bytes, change))
    with pytest.raises(FormatError, match=r"without a gap|lies outside its page"):
        read_tree(path)


def test_other_versions_and_numbers_are_refused(ball_bytes: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.scansplat"
    fields = list(HEADER.unpack_from(ball_bytes))
    for index, value, message in [(1, 2, "expected version 1 of the format, got 2"), (3, np.nan, "finite"), (6, 0.0, "finite")]:
        changed = list(fields)
        changed[index] = value
        header = HEADER.pack(*changed)
        path.write_bytes(header + struct.pack("<I", zlib.crc32(header)) + ball_bytes[HEADER_SIZE:])
        with pytest.raises(FormatError, match=message):
            read_tree(path)


def test_pages_are_dropped_when_room_is_short_and_threads_may_share(ball_bytes: bytes, tmp_path: Path) -> None:
    path = tmp_path / "ball.scansplat"
    path.write_bytes(ball_bytes)
    tree, small = read_tree(path), read_tree(path, cache=1)
    nodes = np.random.default_rng(4).permutation(len(tree.nodes))
    expected = tree.read_many(nodes).splats
    found: list[bool] = []

    def read() -> None:
        splats = small.read_many(nodes).splats
        found.append(all(np.array_equal(a, b) for a, b in zip(splats, expected)))

    threads = [threading.Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [True] * 4


def test_a_file_can_be_built_anew_while_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "ball.scansplat"
    first = build_tree(ball(2000), path)
    second = build_tree(ball(500, seed=2), path)
    first.verify()
    second.verify()
    assert (first.point_count, second.point_count) == (2000, 500)


# Builds that are cut off


class Cut(Exception):  # noqa: N818
    """What stops a build."""


def stop_after(stage: str, calls: int) -> Callable[[str, int, int], None]:
    """Return what stops a build at a stage."""
    left = calls

    def heard(told: str, done: int, count: int) -> None:
        nonlocal left
        if told == stage:
            left -= 1
            if left < 0:
                raise Cut

    return heard


def test_a_build_goes_on_where_it_was_cut_off(tmp_path: Path) -> None:
    cloud = hard(2000)
    whole, path = tmp_path / "whole", tmp_path / "parts"
    build_file(whole, cloud, OPTIONS, 1 << 30, False, tell_nobody)
    for calls in (0, 1, 2, 6):
        with pytest.raises(Cut):
            build_file(path, cloud, OPTIONS, 700, calls == 2, stop_after("build", calls))
        with pytest.raises(FormatError, match=r"the build was not finished|expected a header"):
            read_tree(path)
    # More than the journal knows was written when the power went.
    with path.open("ab") as file:
        file.write(b"more")
    stages: list[str] = []
    tree = build_file(path, cloud, OPTIONS, 700, True, lambda stage, done, count: stages.append(stage))
    assert set(stages) == {"build"}
    assert path.read_bytes() == whole.read_bytes()
    check_tree(tree, cloud)
    assert not Journal(path).folder.exists()


@pytest.mark.parametrize("stage", ["read", "sort"])
def test_a_build_that_was_cut_off_early_begins_anew(tmp_path: Path, stage: str) -> None:
    path = tmp_path / "ball.scansplat"
    with pytest.raises(Cut):
        build_file(path, iter([ball(2000)]), OPTIONS, 700, False, stop_after(stage, 0))
    assert list(tmp_path.iterdir()) == []
    assert build_file(path, ball(2000), OPTIONS, 700, True, tell_nobody).point_count == 2000


KILLED = """
import sys, os, signal
from pathlib import Path
from scanspan.assets.splats.job import build_file
from tests.splatting import ball
seen = []
def heard(stage, done, count):
    if stage == "build" and done > 3000:
        os.kill(os.getpid(), signal.SIGKILL)
build_file(Path(sys.argv[1]), ball(8000), {"normals": "given", "exact": False, "nonfinite": "error"}, 1000, False, heard)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no such signal")
def test_a_build_goes_on_after_a_kill(tmp_path: Path) -> None:
    path = tmp_path / "ball.scansplat"
    ended = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=Path(__file__).parent.parent, capture_output=True)
    assert ended.returncode == -9
    with pytest.raises(FormatError, match="go on with resume=True"):
        read_tree(path)
    done: list[int] = []
    tree = build_file(path, ball(8000), OPTIONS, 1000, True, lambda stage, part, count: done.append(part))
    assert done[0] > 2000
    check_tree(tree, ball(8000))


def test_a_journal_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "ball.scansplat"

    def cut_off() -> None:
        with pytest.raises(Cut):
            build_file(path, ball(3000), OPTIONS, 700, False, stop_after("build", 3))

    cut_off()
    with pytest.raises(InputError, match="resume: this build was begun with exact False, got True"):
        build_file(path, ball(3000), {**OPTIONS, "exact": True}, 700, True, tell_nobody)
    content = path.read_bytes()
    path.write_bytes(content[:-1])
    with pytest.raises(FormatError, match=r"expected at least \d+ bytes to go on with, found \d+; build without resume"):
        build_file(path, ball(3000), OPTIONS, 700, True, tell_nobody)
    path.write_bytes(content)
    journal = Journal(path).path
    saved = journal.read_bytes()
    for damaged in (saved[: len(saved) // 2], saved[:400] + bytes(40) + saved[440:], b""):
        journal.write_bytes(damaged)
        with pytest.raises(FormatError, match="the journal of this build is damaged"):
            build_file(path, ball(3000), OPTIONS, 700, True, tell_nobody)
    assert build_file(path, ball(3000), OPTIONS, 700, False, tell_nobody).point_count == 3000


def test_a_folder_of_someone_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "ball.scansplat.build").mkdir()
    kept = tmp_path / "ball.scansplat.build" / "thesis.txt"
    kept.write_text("years of work")
    with pytest.raises(InputError, match=r"is needed to work in, but holds 'thesis\.txt'"):
        build_tree(ball(10), tmp_path / "ball.scansplat")
    assert kept.read_text() == "years of work"


# Sources and options


def test_points_that_cannot_be_used_are_quoted(tmp_path: Path) -> None:
    points = np.zeros((5, 3))
    points[3, 1] = np.nan
    with pytest.raises(InputError, match="nan"):
        build_tree(points)
    assert build_tree(points, nonfinite="drop").point_count == 4

    def broken() -> Iterator[Any]:
        yield points[:3]
        yield {"positions": points[:3], "color": np.zeros((3, 3), np.uint8)}

    with pytest.raises(InputError, match="piece 1 of the points has color, those before it have positions alone"):
        build_tree(broken())
    with pytest.raises(InputError, match="expected coordinates up to 1e"):
        build_tree(np.array([[1e120, 0, 0]]))
    with pytest.raises(InputError, match=r"expected points by names that PointCloud takes, or radius: .*colour"):
        build_tree({"positions": points[:3], "colour": 1})
    for radius in ([1, 2], [1, 2, -1], [1, 2, np.nan]):
        with pytest.raises(InputError, match="radius"):
            build_tree({"positions": points[:3], "radius": radius})
    with pytest.raises(InputError, match="expected points: a path, a PointCloud, a Mesh, an array or pieces of these, got 7"):
        build_tree(7)
    with pytest.raises(FormatError, match="there is no such file"):
        build_tree(str(tmp_path / "none.las"), tmp_path / "none.scansplat")
    assert list(tmp_path.iterdir()) == []


def test_options_that_cannot_be_used_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown value of normals 'auto'"):
        build_tree(ball(10), normals="auto")
    with pytest.raises(InputError, match="unknown value of nonfinite 'keep'"):
        build_tree(ball(10), nonfinite="keep")
    with pytest.raises(InputError, match="resume: expected a path"):
        build_tree(ball(10), resume=True)
    for wrong in (tmp_path, tmp_path / "none" / "ball.scansplat"):
        with pytest.raises(InputError, match="path: expected a file in a folder that exists"):
            build_tree(ball(10), wrong)
    for memory in ("much", "12 parsecs", None, "nan", "inf"):
        with pytest.raises(InputError, match='max_memory: expected bytes, or a text such as "512MB"'):
            build_tree(ball(10), max_memory=memory)  # type: ignore[arg-type]
    with pytest.raises(InputError, match='max_memory: expected at least "256MB", got 1000'):
        build_tree(ball(10), max_memory=1000)
    assert as_bytes("0.5 GiB") == as_bytes("512MB") == as_bytes(1 << 29)


def test_radii_and_a_mesh_and_a_file_of_points_can_be_given(tmp_path: Path) -> None:
    cloud = {"positions": np.eye(3), "radius": [1.0, 2.0, 3.0]}
    tree = build_tree(cloud, tmp_path / "three.scansplat")
    assert tree.nodes["splat_radius"][0] == pytest.approx(3.0, rel=0.03)
    mesh = Mesh(np.eye(3), [(0, 1, 2)], attributes={"color": np.full((3, 3), 0.5), "normal": np.ones((3, 3))})
    tree = build_tree(mesh)
    assert tree.read(0).color.tolist() == [[128] * 3] * 3
    path = tmp_path / "points.xyz"
    path.write_text("0 0 0\n1 0 0\n0 1 0\n")
    assert build_tree(path, tmp_path / "points.scansplat").point_count == 3


def test_progress_is_told(tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    build_file(tmp_path / "a", iter([ball(2000), ball(1000)]), OPTIONS, 700, False, lambda *entry: told.append(entry))
    assert [entry for entry in told if entry[0] == "read"] == [("read", 2000, 0), ("read", 3000, 0)]
    assert [entry for entry in told if entry[0] == "sort"][-1] == ("sort", 3000, 3000)
    build = [entry for entry in told if entry[0] == "build"]
    assert build[0] == ("build", 0, 3000)
    assert build[-1] == ("build", 3000, 3000)
    assert len(build) > 4
