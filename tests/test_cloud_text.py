"""Clouds in text, NPY and PLY: columns by name and by number, exact numbers, chunks, and every message."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanspan.assets.chunks import CloudChunks, join, open_chunks
from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats import read_xyz, text_numbers
from scanspan.assets.formats.text_numbers import read_rows
from scanspan.assets.load import load
from scanspan.errors import FormatError, InputError, LimitError, ScanspanError


def write(folder: Path, name: str, content: str | bytes | Any) -> Path:
    """Write text, bytes or an array into a file and return its path."""
    path = folder / name
    if isinstance(content, np.ndarray):
        np.save(path, content)
    else:
        path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return path


def cloud_of(path: Path, **options: Any) -> PointCloud:
    """Return the one cloud of a file."""
    geometry = load(path, **options).instances[0].geometry
    assert isinstance(geometry, PointCloud)
    return geometry


def listed(cloud: PointCloud) -> dict[str, Any]:
    """Return positions and columns as lists."""
    return {"xyz": cloud.positions.tolist()} | {name: values.tolist() for name, values in cloud.columns.items()}


# Numbers in text


@settings(max_examples=50)
@given(st.lists(st.one_of(st.floats(allow_nan=False).map(repr), st.decimals(-9999, 9999, places=3).map(str), st.from_regex(
    r"[+-]?([0-9]{1,20}\.?|[0-9]{0,9}\.[0-9]{1,25})([eE][+-]?[0-9]{1,3})?", fullmatch=True))))  # fmt: skip
def test_every_number_is_the_one_that_python_reads(words: list[str]) -> None:
    values, ends, odd = read_rows((" ".join(words) + "\n").encode())
    assert odd == []
    assert ends.tolist() == [len(words)]
    np.testing.assert_array_equal(values.view(np.uint64), np.array([float(word) for word in words], float).view(np.uint64))


@given(st.text("0123456789.+-eE_nafix#/ ,\t\n", max_size=40))
def test_what_is_no_number_is_found_and_the_kernel_is_the_same_as_plain_python(text: str) -> None:
    content = text.encode() + b"\n"
    values, ends, odd = read_rows(content)
    lines = [line.split("#")[0] for line in text.split("\n")]
    if "//" not in text and "#" not in text:
        words = [line.replace(",", " ").split() for line in lines]
        wrong = [(k, word) for k, line in enumerate(words) for word in line if not read_xyz.is_number(word)]
        assert odd == [(k, word.encode()) for k, word in wrong[:1]]
        if not wrong:
            assert ends.tolist() == np.cumsum([len(line) for line in words]).tolist()
    if not odd:
        room = len(content) // 2 + 1
        plain = np.empty(room), np.empty(len(lines), np.int64), np.empty((room, 3), np.int64)
        again = text_numbers.scan_rows.py_func(np.frombuffer(content, np.uint8), text_numbers.POWERS, *plain)
        assert again[:2] == (len(ends), len(values))
        exact = ~np.isin(np.arange(len(values)), plain[2][: again[2], 2])
        np.testing.assert_array_equal(plain[0][: len(values)][exact], values[exact])


# Text


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.xyz", "1 2 3\n4 5 6", {"xyz": [[1, 2, 3], [4, 5, 6]]}),
        ("a.xyz", "\n# made by hand\n1\t2,3 # first\r\n\r\n4;5;6\r\n", {"xyz": [[1, 2, 3], [4, 5, 6]]}),
        ("a.xyz", "1 2 3\r4 5 6\r", {"xyz": [[1, 2, 3], [4, 5, 6]]}),
        ("a.xyz", "1 2 3 77\n", {"xyz": [[1, 2, 3]], "intensity": [77]}),
        ("a.txt", "1 2 3 10 20 255\n", {"xyz": [[1, 2, 3]], "color": [[10, 20, 255]]}),
        ("a.txt", "1 2 3 0.2 0 1\n", {"xyz": [[1, 2, 3]], "color": [[51, 0, 255]]}),
        ("a.txt", "1 2 3 256 0 65535\n", {"xyz": [[1, 2, 3]], "color": [[1, 0, 255]]}),
        ("a.txt", "1 2 3 0.6 0 -0.8\n", {"xyz": [[1, 2, 3]], "normals": [np.float32([0.6, 0, -0.8]).tolist()]}),
        ("a.pts", "2\n1 2 3 -5 9 8 7\n4 5 6 2047 1 2 3\n",
         {"xyz": [[1, 2, 3], [4, 5, 6]], "intensity": [-5, 2047], "color": [[9, 8, 7], [1, 2, 3]]}),
        ("a.csv", 'X,Y,Z,Classification,"gps_time",Return Number,number_of_returns\n1,2,3,6,1e9,1,2\n',
         {"xyz": [[1, 2, 3]], "classification": [6], "return_number": [1], "number_of_returns": [2]}),
        ("a.csv", "\ufeff".encode().decode("latin-1") + "z,y,x,b,g,r,a\n1,2,3,4,5,6,7\n",
         {"xyz": [[3, 2, 1]], "color": [[6, 5, 4, 7]]}),
        ("a.txt", "//X Y Z Nx Ny Nz Scalar_Intensity\n1 2 3 0 0 2 500\n",
         {"xyz": [[1, 2, 3]], "normals": [[0, 0, 2]], "intensity": [500]}),
        ("a.xyz", "636001.76 848935.2 4918340.36400000001\n", {"xyz": [[636001.76, 848935.2, 4918340.364]]}),
        ("a.xyz", "1 2 3 9 8 7 0 0 1\n", {"xyz": [[1, 2, 3]], "color": [[9, 8, 7]], "normals": [[0, 0, 1]]}),
    ],
)  # fmt: skip
def test_columns_of_text(tmp_path: Path, name: str, text: str, expected: dict[str, Any]) -> None:
    path = write(tmp_path, name, text)
    assert listed(cloud_of(path)) == expected
    assert load(path).up == "+Z"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3\n4 5\n", "line 2: 2 numbers, expected 3"),
        ("# x\n1 2 3\n\n4 5 six\n", "line 4: expected a number, got 'six'"),
        ("x y z r g b\n1 2 3 4 5\n", "line 2: 5 numbers, expected 6"),
        ("hello world\n", "line 1: expected numbers or names of columns: expected columns x, y and z, got hello, world"),
        ("# nothing\n\n", "the file has no numbers"),
        ("1 2\n", "points from 0: 2 columns: expected 3, 4, 6, 7, 9 or 10, or a header that names them"),
        ("3\n1 2 3\n4 5 6\n", "the first line says 3 points, there are 2"),
        ("1\n1 2 3\n4 5 6\n", "the first line says 1 points, there are more"),
        ("1 2 nan\n", "points from 0: positions[0] = (1.0, 2.0, nan): a point is not finite"),
        ("x y z class\n1 2 3 2.5\n", "points from 0: classification[0] = 2.5: expected whole numbers"),
        (
            "x y z r g b\n1 2 3 -1 0 9\n",
            "points from 0: colour of point 0 = (-1.0, 0.0, 9.0): expected 0 to 255, as the first ones are",
        ),
        ("1 2 3\n\0\0\0", "expected lines of numbers, got bytes that are no text"),
        ("x y z\n", "the file has nothing to draw"),
    ],
)
def test_what_is_said_of_bad_text(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path, "a.txt", text)
    with pytest.raises(FormatError) as caught:
        load(path)
    assert str(caught.value) == f"{path}: {message}"


def test_lines_are_counted_through_all_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(read_xyz, "BLOCK", 100)
    rows = [f"{k} {k / 3!r} -1e-3 {k % 256} 0 255" for k in range(1000)]
    path = write(tmp_path, "a.xyz", "# head\n" + "\n".join(rows))
    cloud = cloud_of(path)
    assert cloud.positions.tolist() == [[k, k / 3, -1e-3] for k in range(1000)]
    assert [len(part) for part in open_chunks(path, 2)][:2] == [2, 1]
    rows[777] = "1 2 3 4 x"
    with pytest.raises(FormatError, match=r"a.xyz: line 779: expected a number, got 'x'"):
        load(write(tmp_path, "a.xyz", "# head\n" + "\n".join(rows)))
    with pytest.raises(LimitError, match=r"a.xyz: .* points are more than the limit of 10 \(max_points\)"):
        load(write(tmp_path, "a.xyz", "\n".join(rows[:500])), max_points=10)
    monkeypatch.setattr(read_xyz, "MAX_LINE", 300)
    with pytest.raises(FormatError, match=r"a.xyz: a line has more than 300 bytes: these are no lines of numbers"):
        load(write(tmp_path, "a.xyz", "1 2 3\n" + "1 " * 500))


def test_drop_leaves_points_out(tmp_path: Path) -> None:
    path = write(tmp_path, "a.xyz", "1 2 3\nnan 0 0\n4 5 6\n")
    assert listed(cloud_of(path, nonfinite="drop")) == {"xyz": [[1, 2, 3], [4, 5, 6]]}
    rows = np.array([(1, 2, 3), (0, np.inf, 0), (4, 5, 6)])
    assert len(cloud_of(write(tmp_path, "a.npy", rows), nonfinite="drop")) == 2


# NPY


def test_arrays_of_every_kind(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    places = rng.random((50, 3)) * 1e6
    for kind in ("<f8", ">f8", "<f4", "<f2"):
        cloud = cloud_of(write(tmp_path, "a.npy", (places / 1e3).astype(kind)))
        assert cloud.stored.dtype == (np.float64 if kind.endswith("8") else np.float32)
    for order in "CF":
        cloud = cloud_of(
            write(
                tmp_path,
                "a.npy",
                np.array(
                    np.hstack(
                        [
                            places,
                            places[:, :1] % 1,
                        ]
                    ),
                    order=order,
                ),
            )
        )
        np.testing.assert_array_equal(cloud.positions, places)
        np.testing.assert_array_equal(cloud.intensity, (places[:, 0] % 1).astype(np.float32))
    whole = rng.integers(-(2**31), 2**31, (50, 3)).astype(np.int32)
    np.testing.assert_array_equal(cloud_of(write(tmp_path, "a.npy", whole)).integers, whole)
    assert cloud_of(write(tmp_path, "a.npy", whole.astype(np.int64))).stored.dtype == np.float64


def test_structured_arrays(tmp_path: Path) -> None:
    kind = [
        ("y", "<f4"),
        ("x", ">f4"),
        ("z", "f4"),
        ("red", "u2"),
        ("green", "u2"),
        ("blue", "u2"),
        ("t", "f8"),
        ("class", "u1"),
    ]
    rows = np.zeros(4, kind)
    rows["x"], rows["red"], rows["blue"], rows["class"] = [1, 2, 3, 4], 65535, 256, [2, 2, 6, 6]
    cloud = cloud_of(write(tmp_path, "a.npy", rows))
    assert cloud.positions[:, 0].tolist() == [1, 2, 3, 4]
    assert cloud.columns["color"].tolist() == [[255, 0, 1]] * 4
    assert cloud.columns["classification"].tolist() == [2, 2, 6, 6]
    parts = list(open_chunks(tmp_path / "a.npy", 3))
    assert [len(part) for part in parts] == [3, 1]
    assert parts[1].columns["color"].tolist() == [[255, 0, 1]]


def test_what_is_said_of_bad_arrays(tmp_path: Path) -> None:
    def fault(content: Any) -> str:
        path = write(tmp_path, "a.npy", content)
        with pytest.raises(FormatError) as caught:
            load(path)
        return str(caught.value).removeprefix(f"{path}: ")

    stream = io.BytesIO()
    np.save(stream, np.zeros((9, 3)))
    good = stream.getvalue()
    assert fault(good[:-1]) == "an array of shape (9, 3) takes 216 bytes, there are 215"
    assert fault(good[:30]).startswith("the header of the array cannot be read")
    assert fault(b"nothing of numpy").startswith("the header of the array cannot be read")
    assert fault(good.replace(b"(9, 3)", b"(9, 9e")).startswith("the header of the array cannot be read")
    assert fault(np.zeros(3)).startswith("an array of shape (3,) and type float64: expected numbers in shape (N, 3)")
    assert fault(np.zeros((3, 3), bool)) == "an array of type bool: expected numbers"
    assert fault(np.zeros((3, 3), complex)) == "an array of type complex128: expected numbers"
    assert fault(np.array([[{}, 1, 2]], object)).startswith("an array of shape (1, 3) and type object")
    assert fault(np.zeros(3, [("x", "f8"), ("y", "f8"), ("z", "S3")])).endswith("expected fields of one number each")
    assert fault(np.zeros(3, [("x", "f8"), ("y", "f8")])) == "expected columns x, y and z, got x, y"
    assert fault(np.zeros((3, 5))) == "5 columns: expected 3, 4, 6, 7, 9 or 10, or a header that names them"
    assert fault(np.full((3, 3), np.inf)) == "positions[0] = (inf, inf, inf): a point is not finite"
    assert fault(np.zeros((0, 3))) == "the file has nothing to draw"
    huge = good.replace(b"(9, 3), }  ", b"(99999999999999999999, 3), }  "[:11])
    assert "array" in fault(huge) or "header" in fault(huge)


# PLY


HEAD = "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
MORE = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
MORE += "".join(f"property float {name}\n" for name in ("scalar_Intensity", "nx", "ny", "nz"))


def ply(form: str, faces: bool = False, nan: bool = False) -> bytes:
    """Return a PLY file of three points with all that is known of points."""
    tail = "element face 1\nproperty list uchar int vertex_indices\n" if faces else ""
    head = (HEAD.format(form) + MORE + tail + "end_header\n").encode()
    rows = [(k, k + 1.5, 2, 9, 8, k, 100.5 * k, np.nan if nan else 0, 0, 1) for k in range(3)]
    if form == "ascii":
        return head + "\n".join(" ".join(map(str, row)) for row in rows).encode() + (b"\n3 0 1 2\n" if faces else b"\n")
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3f3B4f", *row) for row in rows)
    return head + body + (struct.pack(f"{order}B3i", 3, 0, 1, 2) if faces else b"")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_as_a_cloud_and_in_chunks(tmp_path: Path, form: str) -> None:
    path = write(tmp_path, "a.ply", ply(form))
    cloud, chunks = cloud_of(path), open_chunks(path, 2)
    assert cloud.stored.dtype == np.float32
    assert listed(cloud) == {
        "xyz": [[k, k + 1.5, 2] for k in range(3)], "color": [[9, 8, k] for k in range(3)], "intensity": [0, 100.5, 201],
        "normals": [[0, 0, 1]] * 3,
    }  # fmt: skip
    parts = list(chunks)
    assert ([len(part) for part in parts], chunks.count, chunks.up) == ([2, 1], 3, "+Y")
    assert listed(join(chunks)) == listed(cloud)
    assert load(path).up == "+Y"

    # Of a mesh the chunks are the vertices, and a normal that is none counts as missing.
    write(tmp_path, "a.ply", ply(form, faces=True, nan=True))
    vertices = join(open_chunks(path))
    assert vertices.positions.tolist() == cloud.positions.tolist()
    assert "normals" not in vertices.columns
    if form != "ascii":
        write(tmp_path, "a.ply", ply(form)[:-1])
        with pytest.raises(FormatError, match=r"a.ply: expected 3 of element vertex, there is room for 2"):
            open_chunks(path)


# Chunks


def test_what_is_said_of_files_that_cannot_be_opened(tmp_path: Path) -> None:
    (tmp_path / "empty.xyz").touch()
    (tmp_path / "folder.npy").mkdir()
    for name, message in (
        ("a.las", "a.las: there is no such file"), ("empty.xyz", "empty.xyz: the file is empty"),
        ("folder.npy", "folder.npy: it is a folder, expected a file of points"),
    ):  # fmt: skip
        with pytest.raises(FormatError, match=message):
            open_chunks(tmp_path / name)
    with pytest.raises(InputError, match="unknown file type of a cloud 'obj'; the valid ones are: las, laz, ply, npy, xyz"):
        open_chunks("a.obj")
    with pytest.raises(InputError, match="chunk = 0: expected a whole number of points, 1 to 2\\^31"):
        open_chunks("a.xyz", 0)
    with pytest.raises(InputError, match="unknown value of nonfinite 'skip'"):
        open_chunks("a.xyz", nonfinite="skip")
    write(tmp_path, "b.dat", "1 2 3\n")
    assert len(join(open_chunks(tmp_path / "b.dat", file_type="xyz"))) == 1


def test_chunks_that_differ_do_not_make_a_cloud() -> None:
    def chunks(*parts: PointCloud) -> CloudChunks:
        return CloudChunks("a", None, None, "", "+Z", [], lambda: iter(parts))

    plain = PointCloud(integers=[(1, 2, 3)])
    assert len(join(chunks())) == 0
    assert join(chunks(plain, plain)).integers is not None
    with pytest.raises(InputError, match="a chunk of float64 knows nothing, the first of int32 nothing"):
        join(chunks(plain, PointCloud([(1, 2, 3)])))
    with pytest.raises(InputError, match="a chunk of int32 knows color, the first of int32 nothing"):
        join(chunks(plain, PointCloud(integers=[(1, 2, 3)], color="red")))
    with pytest.raises(InputError, match="a chunk has another scale or offset than the first"):
        join(chunks(plain, PointCloud(integers=[(1, 2, 3)], scale=2)))


@pytest.mark.parametrize("name", ["a.xyz", "a.npy", "a.ply"])
def test_no_damage_is_more_than_one_line(tmp_path: Path, name: str) -> None:
    stream = io.BytesIO()
    np.save(stream, np.arange(60.0).reshape(10, 6))
    contents = {"a.xyz": b"x y z i\n" + b"1.5 -2e3 3 4\n" * 9, "a.npy": stream.getvalue(), "a.ply": ply("binary_little_endian")}
    rng, good, refused = np.random.default_rng(3), contents[name], 0
    for turn in range(90):
        copy = bytearray(good)
        place = int(rng.integers(0, len(good)))
        if turn % 5:
            copy[place] = int(rng.integers(0, 256))
        else:
            copy = copy[:place]
        for attempt in (load, lambda path: join(open_chunks(path, 4))):
            said = refusal(attempt, write(tmp_path, name, bytes(copy)))
            assert "\n" not in said
            refused += bool(said)
    assert refused > 15


def refusal(attempt: Any, path: Path) -> str:
    """Return what is said of a file that cannot be read, "" for one that can."""
    try:
        attempt(path)
    except ScanspanError as error:
        return str(error)
    return ""
