"""load(): every fault is one FormatError, limits hold, and nothing is opened outside the model's folder."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scanspan.assets.load import file_types, load
from scanspan.assets.scene import Instance
from scanspan.errors import FormatError, InputError, LimitError
from tests.models import (
    ITEM,
    OFF,
    POINTS,
    TEXT_STL,
    TRIANGLE_3MF,
    Write,
    archive,
    binary_stl,
    fault,
    glb,
    gltf,
    mf,
    picture,
    ply,
    writer,
)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into a folder of the test's own and return its path."""
    return writer(tmp_path)


def test_what_is_no_file(tmp_path: Path, write: Write) -> None:
    assert fault(tmp_path / "none.obj") == ": there is no such file"
    (tmp_path / "folder.stl").mkdir()
    assert fault(tmp_path / "folder.stl") == ": it is a folder, expected a model file"
    assert fault(tmp_path) == ": it is a folder, expected a model file"
    assert fault(write("empty.ply", b"")) == ": the file is empty"
    assert fault(write("a.xyzzy", b"x")).startswith(": unknown extension '.xyzzy'; the known ones are: obj, ply, ")
    assert fault(write("model", b"x")).startswith(": the name has no extension; give file_type; the known ones are: ")
    os.mkfifo(tmp_path / "pipe.obj")
    assert fault(tmp_path / "pipe.obj") == ": it is not a regular file"
    assert fault(tmp_path / ("x" * 300 + ".obj")) == ": file name too long"
    for name in ("a\0.obj", "a\0"):
        with pytest.raises(FormatError, match="it is not a name of a file"):
            load(name)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_an_unreadable_file(write: Write) -> None:
    path = write("a.obj", "v 0 0 0")
    path.chmod(0)
    assert fault(path) == ": permission denied"


@pytest.mark.parametrize(
    ("path", "options", "message"),
    [
        ("", {}, "path: expected the name of a file, got an empty one"),
        (b"a.obj", {}, "path: expected text or a path, got bytes"),
        (5, {}, "path: expected text or a path, got int"),
        (None, {}, "path: expected text or a path, got NoneType"),
        ("a.obj", {"file_type": "opj"}, "unknown file type 'opj'; did you mean 'obj'"),
        ("a.obj", {"file_type": 3}, "file_type: expected text such as 'stl', got 3"),
        ("a.obj", {"nonfinite": "keep"}, "unknown value of nonfinite 'keep'"),
        ("a.obj", {"max_bytes": 0}, "max_bytes = 0: expected a whole number above 0"),
        ("a.obj", {"max_triangles": 1.5}, "max_triangles = 1.5: expected a whole number above 0"),
        ("a.obj", {"max_texture_pixels": True}, "max_texture_pixels = True: expected a whole number above 0"),
        ("a.obj", {"max_face_corners": None}, "max_face_corners = None: expected a whole number above 0"),
    ],
)
def test_bad_arguments_are_quoted(path: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(path, **options)


def test_the_type_can_be_given_and_paths_may_be_text(write: Write) -> None:
    path = write("model", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")
    assert load(str(path), file_type=".OBJ").triangle_count == 1
    assert load(path, file_type="obj").name == "model"
    assert "zip" in file_types()


def test_limits(write: Write) -> None:
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
    path = write("a.obj", square)
    with pytest.raises(LimitError, match=r"a.obj: 42 bytes are more than the limit of 41 \(max_bytes\)"):
        load(path, max_bytes=41)
    with pytest.raises(LimitError, match=r"a.obj: 2 triangles are more than the limit of 1 \(max_triangles\)"):
        load(path, max_triangles=1)
    with pytest.raises(LimitError, match=r"a.obj: a face with 4 corners is more than the limit of 3 \(max_face_corners\)"):
        load(path, max_face_corners=3)
    assert load(path, max_bytes=42, max_triangles=2, max_face_corners=4).primitive_count == 1


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../secret.png", "only files in the model's folder are opened"),
        ("sub/../../secret.png", "only files in the model's folder are opened"),
        ("..\\secret.png", "only files in the model's folder are opened"),
        ("/dev/zero", "only files in the model's folder are opened"),
        ("C:\\secret.png", "only files in the model's folder are opened"),
        ("https://example.org/a.png", "only files in the model's folder are opened"),
        ("file:///etc/passwd", "only files in the model's folder are opened"),
        ("link.png", "it is a link that leads out of the model's folder"),
        ("pipe", "it is not a regular file"),
        ("folder", "it is a folder"),
        ("x" * 6000, "the name is empty, too long or not text"),
        ("x" * 300, "File name too long"),
        ("none.png", None),
    ],
)
def test_nothing_outside_the_folder_is_opened(tmp_path: Path, write: Write, name: str, reason: str | None) -> None:
    write("secret.png", picture())
    model = write("model/a.obj", f"mtllib m.mtl\n{POINTS}usemtl m\nf 1 2 3")
    write("model/m.mtl", f"newmtl m\nmap_Kd {name}\n")
    (tmp_path / "model/link.png").symlink_to(tmp_path / "secret.png")
    os.mkfifo(tmp_path / "model/pipe")
    (tmp_path / "model/folder").mkdir()
    scene = load(model)
    shown = repr(name if len(name) <= 80 else name[:77] + "...")
    assert scene.notes == ((f"texture {shown} was not opened: {reason}" if reason else f"texture {shown} was not found"),)
    assert scene.instances[0].material.texture is None
    assert scene.triangle_count == 1


@pytest.mark.parametrize("name", ["../m.mtl", "/etc/passwd", "http://localhost/m.mtl", "link.mtl"])
def test_a_material_library_outside_is_not_opened(tmp_path: Path, write: Write, name: str) -> None:
    write("m.mtl", "newmtl m\nKd 1 0 0\n")
    model = write("model/a.obj", f"mtllib {name}\n{POINTS}usemtl m\nf 1 2 3")
    (tmp_path / "model/link.mtl").symlink_to(tmp_path / "m.mtl")
    scene = load(model)
    assert scene.notes[0].startswith(f"material library {name!r} was not opened: ")
    assert scene.notes[1] == "material 'm' is not defined"


def test_a_link_inside_the_folder_is_followed(tmp_path: Path, write: Write) -> None:
    model = write("model/a.obj", f"mtllib m.mtl\n{POINTS}usemtl m\nf 1 2 3")
    write("model/m.mtl", "newmtl m\nmap_Kd sub/../link.png\n")
    write("model/sub/real.png", picture())
    (tmp_path / "model/link.png").symlink_to("sub/real.png")
    assert load(model).instances[0].material.texture is not None


def huge_png() -> bytes:
    """The beginning of a PNG that claims 60000 x 60000 pixels."""
    header = b"IHDR" + struct.pack(">II", 60_000, 60_000) + picture()[24:29]
    return picture()[:12] + header + struct.pack(">I", zlib.crc32(header)) + picture()[33:]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (huge_png(), "texture 'p.png' was not read: it has more pixels than the limit (max_texture_pixels)"),
        (picture(40, 30), "texture 'p.png' was not read: 40 x 30 is more than the limit of 1000 (max_texture_pixels)"),
        (b"not a picture", "texture 'p.png' was not read: it is not a picture that can be read"),
        (
            b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n",
            "texture 'p.png' was not read: it is not a picture",
        ),
        (picture(30, 30)[:-30], "texture 'p.png' was not read: "),
    ],
)
def test_pictures_that_cannot_be_used_are_noted(write: Write, content: bytes, message: str) -> None:
    write("p.png", content)
    write("m.mtl", "newmtl m\nmap_Kd p.png\n")
    scene = load(write("a.obj", f"mtllib m.mtl\n{POINTS}usemtl m\nf 1 2 3"), max_texture_pixels=1000)
    assert len(scene.notes) == 1
    assert scene.notes[0].startswith(message)


@pytest.mark.parametrize("content", [b"\xff\xfe\0", b"Kd 1 0 0\nmap_Kd x\n", b"newmtl\nnewmtl m\nKd a b\nname x y\n", b""])
def test_odd_material_libraries_do_no_harm(write: Write, content: bytes) -> None:
    write("m.mtl", content)
    assert load(write("a.obj", f"mtllib m.mtl\n{POINTS}usemtl m\nf 1 2 3")).triangle_count == 1


def test_zip_with_a_textured_model_in_a_folder(write: Write) -> None:
    obj = f"mtllib ./m.mtl\n{POINTS}usemtl m\nf 1 2 3"
    members: dict[str, bytes | str] = {
        "a/b.obj": obj,
        "a/m.mtl": "newmtl m\nmap_Kd ../p.png\n",
        "p.png": picture(),
        "__MACOSX/a/._b.obj": "x",
    }
    scene = load(write("a.zip", archive(members)))
    assert scene.notes == ("texture '../p.png' was not opened: only files in the model's folder are opened",)
    members["a/m.mtl"] = "newmtl m\nmap_Kd p.png\n"
    members["a/p.png"] = picture()
    scene = load(write("b.zip", archive(members)))
    assert scene.notes == ()
    assert scene.instances[0].material.texture is not None


def test_reading_one_member_many_times_counts_against_the_limit(write: Write) -> None:
    library = "".join(f"newmtl m{k}\nmap_Kd {'./' * k}p.png\n" for k in range(5))
    faces = "".join(f"usemtl m{k}\nf 1 2 3\n" for k in range(5))
    pixels = np.random.default_rng(0).integers(0, 256, (40, 40, 3), dtype=np.uint8)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="PNG")
    members: dict[str, bytes | str] = {"a.obj": f"mtllib m.mtl\n{POINTS}{faces}", "m.mtl": library, "p.png": stream.getvalue()}
    scene = load(write("a.zip", archive(members)), max_bytes=3 * len(stream.getvalue()))
    assert [i.material.texture is not None for i in scene.instances] == [True, True, False, False, False]
    assert "unpacks to more than the limit of" in scene.notes[0]


def test_bad_archives(write: Write) -> None:
    triangle = POINTS + "f 1 2 3"
    assert fault(write("a.zip", b"PK nothing")).startswith(": not a zip archive that can be read: ")
    assert fault(write("b.zip", archive({"readme.txt": "x"}))) == ": expected one model in the archive, there are 0"
    both = archive({"a.obj": triangle, "b.obj": triangle})
    assert fault(write("c.zip", both)) == ": expected one model in the archive, there are 2: a.obj, b.obj"
    assert fault(write("d.zip", archive({"a.obj": ""}))) == ": a.obj in the archive is empty"
    assert fault(write("e.zip", archive({"a.obj": "f 1 2 3"}))) == "/a.obj: line 1: vertex 1 does not exist, there are 0"
    good = archive({"a.obj": triangle + "\n# " + "x" * 99})
    damaged = good[:40] + bytes([good[40] ^ 0xFF]) + good[41:]
    assert fault(write("f.zip", damaged)).startswith(": a.obj: it cannot be unpacked: ")
    bomb = archive({"a.obj": b"#" * 10_000_000})
    assert len(bomb) < 20_000
    with pytest.raises(LimitError, match=r"unpacks to 10000000 bytes, more than the limit of 1000000 \(max_bytes\)"):
        load(write("g.zip", bomb), max_bytes=1_000_000)


REAL = {
    "ADIS16480.STL": (7436, 7436, 1, False),
    "CesiumMilkTruck.glb": (3624, 3624, 5, True),
    "Duck.glb": (4212, 4212, 1, True),
    "cow.obj": (5804, 5804, 1, False),
    "cycloidal.ply": (43368, 43368, 1, False),
    "featuretype.STL": (3476, 3476, 1, False),
    "fuze.zip": (1000, 1000, 1, True),
    "quadknot.obj": (2880, 1440, 1, False),
    "rocker-arm.obj": (20088, 20088, 1, False),
    "spot.obj": (5856, 5856, 1, False),
    "suzanne.ply": (968, 500, 1, False),
    "teapot.obj": (6320, 6320, 1, False),
    "torus.STL": (8700, 8700, 1, False),
}
"""Triangles, faces, instances, and whether there is a texture."""


@pytest.mark.parametrize("name", sorted(REAL))
def test_real_files_agree_with_trimesh(shared_data: Path, name: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    scene = load(shared_data / "meshes" / name)
    triangles, faces, instances, textured = REAL[name]
    assert (scene.triangle_count, scene.primitive_count, len(scene.instances)) == (triangles, faces, instances)
    assert any(i.material.texture is not None for i in scene.instances) == textured
    other = trimesh.load_scene(str(shared_data / "meshes" / name), process=False)
    assert scene.bounds == pytest.approx(other.bounds, abs=1e-12 * np.abs(other.bounds).max())


def test_reading_our_own_formats_needs_neither_trimesh_nor_numba(write: Write, repository: Path) -> None:
    path = write("a.obj", POINTS + "f 1 2 3")
    code = (
        "import sys; from scanspan.assets.load import load; load(sys.argv[1]);"
        "sys.exit(', '.join({'trimesh', 'numba', 'PIL'} & set(sys.modules)) or 0)"
    )
    environment = os.environ | {"PYTHONPATH": str(repository / "src")}
    checked = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, env=environment, check=False
    )
    assert checked.returncode == 0, checked.stderr


SEEDS: dict[str, bytes] = {
    "a.obj": (POINTS + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf -1//-1 -2//-1 -3//-1\n").encode(),
    "a.off": OFF.encode(),
    "a.stl": binary_stl(3),
    "b.stl": TEXT_STL.encode(),
    "a.ply": ply("ascii", [[0, 1, 2, 3], [0, 1, 2]]),
    "b.ply": ply("binary_little_endian", [[0, 1, 2, 3], [0, 1, 2]]),
    "c.ply": ply("binary_big_endian", [[0, 1, 2], [0, 1, 2]]),
    "a.glb": glb(*gltf()),
    "a.3mf": mf(f'<object id="1">{TRIANGLE_3MF}</object>', ITEM),
    "a.zip": archive({"a.obj": POINTS + "f 1 2 3"}),
}
WORDS = [
    b"-1",
    b"nan",
    b"1e400",
    b"99999999999999999999",
    b"2000000000",
    b"",
    b"abc",
    b"\0",
    b"1/2/3/4",
    b"{",
    b"9" * 5000,
    b"null",
]
NUMBERS = [b"\xff" * 4, b"\0" * 4, b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\xc0\x7f"]


def damage(content: bytes, rng: np.random.Generator) -> bytes:
    """Cut, overwrite, repeat or drop something."""
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(0, max(len(content), 1)))
        kind = rng.random()
        if kind < 0.2:
            content = content[:place]
        elif kind < 0.4:
            content = content[:place] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[place + 4 :]
        elif kind < 0.7:
            end = place
            while end < len(content) and chr(content[end]).isalnum():
                end += 1
            content = content[:place] + WORDS[int(rng.integers(len(WORDS)))] + content[end:]
        elif kind < 0.85:
            content = content[:place] + content[max(place - 40, 0) :]
        else:
            content = content[:place] + content[place + int(rng.integers(1, 40)) :]
    return content


@pytest.mark.parametrize("name", sorted(SEEDS))
def test_damaged_files_load_or_raise_one_line(write: Write, rng: np.random.Generator, name: str) -> None:
    assert load(write(name, SEEDS[name])).triangle_count
    refused = 0
    for _ in range(150):
        path = write(name, damage(SEEDS[name], rng))
        try:
            scene = load(path)
        except (FormatError, LimitError) as error:
            message = str(error)
            if "\n" in message or not message.startswith(str(path)):
                pytest.fail(f"expected one line that names the file, got {message!r}")
            refused += 1
        else:
            assert all(isinstance(instance, Instance) for instance in scene.instances)
            assert scene.primitive_count
    assert refused > 20
