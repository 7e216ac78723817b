"""LAS, LAZ and COPC: what laspy reads is what comes back, and damage of every kind is one clear line."""

from __future__ import annotations

import builtins
import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scanspan.assets.chunks import open_chunks
from scanspan.assets.cloud import PointCloud
from scanspan.assets.load import load
from scanspan.errors import FormatError, InputError, LimitError, ScanspanError

laspy = pytest.importorskip("laspy")

TABLE_AT = 8
"""The place of the chunk table stands in the first bytes of packed points."""


def saved(form: int = 3, packed: bool = False, count: int = 1000, deep: int = 0) -> bytes:
    """Return a LAS or LAZ file with some of everything; colours have 8 bits more from point `deep` on."""
    rng = np.random.default_rng(form)
    header = laspy.LasHeader(point_format=form, version="1.4")
    header.scales, header.offsets = np.array([0.01, 0.02, 0.001]), np.array([500_000.0, 4_900_000.0, -10.0])
    las = laspy.LasData(header)
    las.X, las.Y, las.Z = rng.integers(-(2**31), 2**31, (3, count), np.int32)
    las.intensity = rng.integers(0, 65536, count)
    las.classification = rng.integers(0, 20, count)
    las.return_number, las.number_of_returns = rng.integers(1, 4, count), rng.integers(3, 5, count)
    if "red" in las.point_format.dimension_names:
        for name in ("red", "green", "blue"):
            values = rng.integers(0, 256, count)
            values[deep:] *= 257 if deep < count else 1
            las[name] = values
    stream = io.BytesIO()
    las.write(stream, do_compress=packed)
    return stream.getvalue()


def write(folder: Path, content: bytes, name: str = "a.las") -> Path:
    """Write a file and return its path."""
    path = folder / name
    path.write_bytes(content)
    return path


def cloud_of(path: Path, **options: Any) -> PointCloud:
    """Return the one cloud of a file."""
    geometry = load(path, **options).instances[0].geometry
    assert isinstance(geometry, PointCloud)
    return geometry


def fault(folder: Path, content: bytes, name: str = "a.las") -> str:
    """Return what is said of a damaged file, without its name."""
    path = write(folder, content, name)
    with pytest.raises(FormatError) as caught:
        load(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("form", range(11))
def test_every_point_format_is_what_laspy_reads(tmp_path: Path, form: int, packed: bool) -> None:
    if packed and form in (4, 5, 9, 10):
        pytest.skip("waveforms are not packed by lazrs")
    path = write(tmp_path, saved(form, packed), "a.laz" if packed else "a.las")
    expected, scene = laspy.read(path), load(path)
    cloud = cloud_of(path)
    assert (scene.up, scene.notes) == ("+Z", ())
    np.testing.assert_array_equal(cloud.integers, np.stack([expected[name] for name in "XYZ"], axis=1))
    np.testing.assert_array_equal(cloud.positions, expected.xyz)
    for name in ("intensity", "classification", "return_number", "number_of_returns"):
        np.testing.assert_array_equal(getattr(cloud, name), expected[name])
    if "red" in expected.point_format.dimension_names:
        deep = np.stack([expected[name] for name in ("red", "green", "blue")], axis=1)
        np.testing.assert_array_equal(cloud.color, deep // 257)
    else:
        assert cloud.color is None


@pytest.mark.parametrize("deep", [0, 5, 999, 1000])
def test_colours_have_8_bits_only_where_none_has_more(tmp_path: Path, deep: int) -> None:
    cloud = cloud_of(write(tmp_path, saved(deep=deep)))
    expected = saved_colors(deep)
    np.testing.assert_array_equal(cloud.color, expected if deep == 1000 else expected >> 8)
    chunks = open_chunks(tmp_path / "a.las", 300)
    np.testing.assert_array_equal(np.concatenate([part.color for part in chunks if part.color is not None]), cloud.color)


def test_deep_colours_that_come_too_late_for_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, saved(deep=500))
    monkeypatch.setattr("scanspan.assets.formats.read_las.looks_shallow", lambda opened, places: True)
    chunks = open_chunks(path, 400)
    with pytest.raises(FormatError, match=r"a.las: colours of 16 bits come after others that have 8; load the file as a whole"):
        list(chunks)
    np.testing.assert_array_equal(cloud_of(path).color, saved_colors(500) >> 8)


def saved_colors(deep: int) -> Any:
    """Return the colours of a saved file as they are stored."""
    las = laspy.read(io.BytesIO(saved(deep=deep)))
    return np.stack([las[name] for name in ("red", "green", "blue")], axis=1).astype(np.int64)


def test_columns_that_are_0_throughout_are_left_out(tmp_path: Path) -> None:
    las = laspy.create(point_format=3, file_version="1.2")
    las.x = las.y = las.z = np.arange(5.0)
    las.write(tmp_path / "a.las")
    assert repr(cloud_of(tmp_path / "a.las")) == "PointCloud(5 points)"


def test_chunks_are_the_cloud_in_pieces(tmp_path: Path) -> None:
    for packed in (False, True):
        path = write(tmp_path, saved(7, packed, 12_345), "a.laz")
        chunks, cloud = open_chunks(path, 5000), cloud_of(path)
        for _ in range(2):
            parts = list(chunks)
            assert [len(part) for part in parts] == [5000, 5000, 2345]
            np.testing.assert_array_equal(np.concatenate([part.stored for part in parts]), cloud.stored)
        assert chunks.count == 12_345
        np.testing.assert_allclose(chunks.bounds, cloud.bounds, atol=1e-3)


def test_the_real_files(shared_data: Path) -> None:
    folder = shared_data / "points"
    autzen, star, simple = (cloud_of(folder / name) for name in ("autzen_trim.laz", "lone-star.copc.laz", "simple.las"))
    assert [len(cloud) for cloud in (autzen, star, simple)] == [110_000, 518_862, 1065]
    assert autzen.bounds.round(2).tolist() == [[636001.76, 848935.2, 406.26], [637179.22, 849497.9, 520.51]]
    assert autzen.crs.startswith('PROJCS["NAD_1983_HARN_Lambert_Conformal_Conic"')
    assert len(autzen.select(classification="ground")) == 26_107
    assert star.color is None
    assert star.classification is None
    assert star.scale.tolist() == [0.00025] * 3
    assert simple.color is not None
    assert simple.color.max() > 200


def test_an_epsg_code_among_geotiff_keys_is_the_crs(tmp_path: Path) -> None:
    for key, value, text, expected in ((3072, 26912, "UTM 12N|\0", "EPSG:26912"), (3072, 32767, "UTM 12N|\0", "UTM 12N")):
        las = laspy.create(point_format=3, file_version="1.2")
        las.x = las.y = las.z = np.arange(5.0)
        las.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", struct.pack("<8H", 1, 1, 0, 1, key, 0, 1, value)))
        las.vlrs.append(laspy.VLR("LASF_Projection", 34737, "", text.encode()))
        las.write(tmp_path / "a.las")
        assert cloud_of(tmp_path / "a.las").crs == expected


def test_limits(tmp_path: Path) -> None:
    path = write(tmp_path, saved())
    with pytest.raises(LimitError, match=r"a.las: 1000 points are more than the limit of 999 \(max_points\)"):
        load(path, max_points=999)
    assert len(cloud_of(path, max_points=1000)) == 1000


def test_a_missing_package_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, plain = write(tmp_path, saved()), builtins.__import__

    def refuse(name: str, *rest: Any, **more: Any) -> Any:
        if name == "laspy":
            raise ImportError(name)
        return plain(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", refuse)
    for attempt in (load, open_chunks):
        with pytest.raises(InputError) as told:
            attempt(path)
        expected = 'reading LAS, LAZ and COPC files needs laspy and lazrs: pip install "scanspan[points]"'
        assert str(told.value) == f"{path}: {expected}"


def changed(content: bytes, place: int, form: str, *values: Any) -> bytes:
    """Return a file with some numbers of its header changed."""
    copy = bytearray(content)
    struct.pack_into(form, copy, place, *values)
    return bytes(copy)


def test_what_is_said_of_a_damaged_header(tmp_path: Path) -> None:
    good = saved()
    start = struct.unpack_from("<I", good, 96)[0]
    cases = {
        "expected LASF at the start, got b'FOO": b"FOO" + good[3:],
        "the file ends within its header, after 200 bytes": good[:200],
        "version 2.0: LAS 1.0 to 1.4 can be read": changed(good, 24, "<BB", 2, 0),
        f"a header of 100 bytes and points at byte {start}, in a file of {len(good)}": changed(good, 94, "<H", 100),
        f"a header of 375 bytes and points at byte 4294967295, in a file of {len(good)}": changed(good, 96, "<I", 2**32 - 1),
        f"4294967295 variable length records do not fit before the points at byte {start}": changed(good, 100, "<I", 2**32 - 1),
        "point format 11 with 34 bytes a point: formats 0 to 10 can be read": changed(good, 104, "<B", 11),
        "point format 3 with 20 bytes a point: formats 0 to 10 can be read": changed(good, 105, "<H", 20),
        "the scale of coordinates is (0.0, 0.02, 0.001)": changed(good, 131, "<d", 0.0),
        "the offset of coordinates is (nan, 4900000.0, -10.0)": changed(good, 155, "<d", float("nan")),
        "the header says 1001 points, there is room for 1000": changed(good, 247, "<Q", 1001),
        "the header says 1000 points, there is room for 999": good[:-1],
    }
    for expected, content in cases.items():
        assert fault(tmp_path, content).startswith(expected)
    assert fault(tmp_path, changed(good, 247, "<Q", 0)) == "the file has nothing to draw"


def test_what_is_said_of_a_damaged_table_of_chunks(tmp_path: Path) -> None:
    good = saved(3, packed=True)
    start = struct.unpack_from("<I", good, 96)[0]
    table = struct.unpack_from("<q", good, start)[0]
    room = table - start - 8
    cases = {
        f"the table of packed chunks is at byte 3, in a file of {len(good)}": changed(good, start, "<q", 3),
        f"the table of packed chunks is at byte {table}, in a file of {table}: it may be cut short": good[:table],
        f"byte {table}: 4294967295 packed chunks do not fit in {room} bytes": changed(good, table + 4, "<I", 2**32 - 1),
        f"byte {table}: 0 packed chunks do not fit in {room} bytes": changed(good, table + 4, "<I", 0),
        "packed points have 34 bytes, the header says 38": changed(good, 105, "<H", 38),
        f"byte {table}: the table of packed chunks has": changed(good, 247, "<Q", 60_000),
    }
    for expected, content in cases.items():
        assert fault(tmp_path, content, "a.laz").startswith(expected)

    # A stream that could not go back has the place of the table at the very end.
    moved = changed(good, start, "<q", -1) + struct.pack("<q", table)
    np.testing.assert_array_equal(
        cloud_of(write(tmp_path, moved, "b.laz")).stored, cloud_of(write(tmp_path, good, "a.laz")).stored
    )


def test_points_outside_of_the_header_s_bounds_are_told(tmp_path: Path) -> None:
    path = write(tmp_path, changed(saved(), 179, "<d", 0.0))
    assert load(path).notes == ("points lie outside of the bounds in the header: one of the two is damaged",)


def refusal(path: Path) -> str:
    """Return what is said of a file that cannot be read, "" for one that can."""
    try:
        load(path, max_points=10_000)
    except ScanspanError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("packed", [False, True])
def test_no_damage_is_more_than_one_line(tmp_path: Path, packed: bool) -> None:
    good, rng = saved(7, packed, 300), np.random.default_rng(8)
    start = struct.unpack_from("<I", good, 96)[0]
    name, refused = "a.laz" if packed else "a.las", 0
    for turn in range(150):
        copy = bytearray(good)
        place = int(rng.integers(0, start + 16)) if turn % 3 else int(rng.integers(0, len(good)))
        if turn % 5 == 1:
            place = int(rng.integers(len(good) - 30, len(good)))
        if turn % 7 == 0:
            copy = copy[:place]
        else:
            copy[place] = int(rng.choice([0, 1, 127, 128, 255, rng.integers(0, 256)]))
        said = refusal(write(tmp_path, bytes(copy), name))
        assert "\n" not in said
        refused += bool(said)
    assert refused > 20
