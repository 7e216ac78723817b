"""Image files: round trips, files that are whole or not there, and every error message."""

from __future__ import annotations

import io
import os
import re
import stat
import sys
import threading
import time
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from scanspan.errors import FormatError, InputError, LimitError
from scanspan.target import image as module
from scanspan.target.image import encode_image, image_format, over_white, png_bytes, read_image, write_bytes, write_image

Array = npt.NDArray[Any]

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="permissions, links and pipes as POSIX has them")


@pytest.fixture
def picture(rng: np.random.Generator) -> Array:
    """Give a small picture of noise with alpha."""
    return rng.integers(0, 256, (5, 7, 4)).astype(np.uint8)


def leftovers(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("ending", ["png", "PNG", "npy", "npz"])
def test_pixels_come_back_as_they_went(ending: str, picture: Array, tmp_path: Path) -> None:
    path = tmp_path / f"a picture.{ending}"
    write_image(path, picture)
    assert np.array_equal(read_image(path), picture)
    write_image(str(path), picture[..., :3])
    assert np.array_equal(read_image(path), np.concatenate([picture[..., :3], np.full((5, 7, 1), 255, np.uint8)], axis=2))
    assert leftovers(tmp_path) == [path.name]


@pytest.mark.parametrize("channels", [3, 4])
def test_png_is_read_by_others_as_it_was_written(channels: int, picture: Array) -> None:
    with Image.open(io.BytesIO(png_bytes(picture[..., :channels]))) as opened:
        assert opened.mode == ("RGB" if channels == 3 else "RGBA")
        assert np.array_equal(np.asarray(opened), picture[..., :channels])


def test_ppm_is_plain_bytes_over_white(picture: Array, tmp_path: Path) -> None:
    content = encode_image(picture, "ppm")
    assert content[:11] == b"P6\n7 5\n255\n"
    assert content[11:] == over_white(picture).tobytes()
    write_image(tmp_path / "a.ppm", picture)
    assert np.array_equal(read_image(tmp_path / "a.ppm")[..., :3], over_white(picture))


def test_over_white_blends_light() -> None:
    pixels = np.array([[[0, 0, 0, 128], [10, 20, 30, 255], [1, 2, 3, 0]]], dtype=np.uint8)
    assert over_white(pixels)[0].tolist() == [[187, 187, 187], [10, 20, 30], [255, 255, 255]]


@pytest.mark.parametrize("ending", ["jpg", "jpeg"])
def test_jpeg_is_close(ending: str, tmp_path: Path) -> None:
    plain = np.full((16, 16, 4), (200, 100, 50, 255), dtype=np.uint8)
    write_image(tmp_path / f"a.{ending}", plain)
    assert np.abs(read_image(tmp_path / f"a.{ending}").astype(int) - plain).max() <= 3


def test_npz_holds_arrays_by_name(picture: Array, tmp_path: Path) -> None:
    depth = np.array([[0.5, 1, np.inf], [np.nan, 2, 3]], dtype=np.float32)
    write_image(tmp_path / "a.npz", {"color": picture, "depth": depth})
    with np.load(tmp_path / "a.npz") as stored:
        assert stored["depth"].dtype == np.float32
        assert np.array_equal(stored["depth"], depth, equal_nan=True)
    assert np.array_equal(read_image(tmp_path / "a.npz"), picture)


@pytest.mark.parametrize("layout", ["reversed", "strided", "fortran", "read-only"])
def test_any_layout_of_the_pixels_will_do(layout: str, picture: Array) -> None:
    if layout == "reversed":
        pixels = picture[::-1, ::-1]
    elif layout == "strided":
        pixels = np.repeat(picture, 2, axis=1)[:, ::2]
    elif layout == "fortran":
        pixels = np.asfortranarray(picture)
    else:
        pixels = picture.copy()
        pixels.setflags(write=False)
    for name in ("png", "ppm", "npy"):
        assert encode_image(pixels, name) == encode_image(np.ascontiguousarray(pixels), name)


def test_other_modes_are_read_too(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0, 128, 255]], dtype=np.uint8)).save(tmp_path / "grey.png")
    assert read_image(tmp_path / "grey.png")[0].tolist() == [[0, 0, 0, 255], [128, 128, 128, 255], [255, 255, 255, 255]]
    Image.fromarray(np.array([[0, 0x8000, 0xFFFF]], dtype=np.uint16)).save(tmp_path / "deep.png")
    assert read_image(tmp_path / "deep.png")[0, :, 0].tolist() == [0, 128, 255]


# Files that are whole or not there


class Stop(KeyboardInterrupt):
    """Ctrl-C, told apart from a real one."""


@pytest.mark.parametrize("failure", [Stop, MemoryError])
@pytest.mark.parametrize("before", [None, b"what was there"])
@pytest.mark.parametrize("where", ["replace", "fdopen"])
def test_nothing_is_lost_when_writing_fails(
    failure: type[BaseException],
    before: bytes | None,
    where: str,
    picture: Array,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "a.png"
    if before is not None:
        path.write_bytes(before)

    def fail(first: Any, *_: object) -> None:
        if where == "fdopen":
            os.close(first)
        raise failure

    monkeypatch.setattr(module.os, where, fail)
    with pytest.raises(failure):
        write_image(path, picture)
    monkeypatch.undo()
    assert leftovers(tmp_path) == ([] if before is None else ["a.png"])
    assert before is None or path.read_bytes() == before


def test_a_full_disk_is_one_line(picture: Array, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "replace", fail)
    path = tmp_path / "a.png"
    with pytest.raises(InputError, match=f"^{re.escape(str(path))}: cannot be written: No space left on device$"):
        write_image(path, picture)
    assert leftovers(tmp_path) == []


def test_pixels_that_are_none_leave_the_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"what was there")
    with pytest.raises(InputError):
        write_image(path, np.zeros((2, 2)))
    assert path.read_bytes() == b"what was there"


@posix_only
def test_a_new_file_has_the_usual_permissions_and_an_old_one_keeps_its_own(picture: Array, tmp_path: Path) -> None:
    path, plain = tmp_path / "a.png", tmp_path / "plain"
    plain.write_bytes(b"")
    write_image(path, picture)
    assert path.stat().st_mode == plain.stat().st_mode
    path.chmod(0o640)
    write_image(path, picture)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


@posix_only
def test_a_link_is_followed(picture: Array, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "a.png").symlink_to(tmp_path / "there" / "b.png")
    write_image(tmp_path / "a.png", picture)
    assert (tmp_path / "a.png").is_symlink()
    assert np.array_equal(read_image(tmp_path / "there" / "b.png"), picture)


@posix_only
def test_a_pipe_is_written_to_and_stays_a_pipe(picture: Array, tmp_path: Path) -> None:
    path = tmp_path / "pipe.png"
    os.mkfifo(path)
    heard: list[bytes] = []
    listener = threading.Thread(target=lambda: heard.append(path.read_bytes()))
    listener.start()
    write_image(path, picture)
    listener.join(timeout=10)
    assert heard == [png_bytes(picture)]
    assert stat.S_ISFIFO(path.stat().st_mode)


def test_bytes_of_any_kind_are_written(tmp_path: Path) -> None:
    write_bytes(tmp_path / "meta.json", b"{}")
    assert (tmp_path / "meta.json").read_bytes() == b"{}"


def test_a_picture_of_full_size_is_encoded_in_no_time() -> None:
    y, x = np.mgrid[0:1080, 0:1920]
    pixels = np.stack([200 - y // 20, 205 - y // 20, 210 - y // 20, np.full_like(x, 255)], axis=-1).astype(np.uint8)
    ball = (x - 960) ** 2 + (y - 540) ** 2 < 400**2
    pixels[ball, 0] = (x[ball] + y[ball]) // 12
    start = time.perf_counter()
    png_bytes(pixels)
    # Measured at 0.06 s; ten times that, for a machine that is busy.
    assert time.perf_counter() - start < 0.6


# Errors


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("a.gif", "unknown image format '.gif'; the valid ones are: .png, .ppm, .jpg, .jpeg, .npy, .npz"),
        ("a.pgn", "unknown image format '.pgn'; did you mean '.png'? The valid ones are: .png, .ppm, .jpg, .jpeg, .npy, .npz"),
        ("a", "unknown image format ''; the valid ones are: .png, .ppm, .jpg, .jpeg, .npy, .npz"),
        (".png", "unknown image format ''; the valid ones are: .png, .ppm, .jpg, .jpeg, .npy, .npz"),
        ("", "path = '': expected the name of a file"),
        ("a\0.png", "path = 'a\\x00.png': expected the name of a file"),
        (None, "path = None: expected the name of a file"),
        (b"a.png", "path = b'a.png': expected the name of a file"),
        (7, "path = 7: expected the name of a file"),
    ],
)
def test_bad_names(path: Any, message: str, picture: Array) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        write_image(path, picture)


def test_image_format_goes_by_the_ending() -> None:
    assert [image_format(f"a.b.{name}") for name in ("png", "JPG", "npz")] == ["png", "jpg", "npz"]


def test_places_that_cannot_be_written_to(picture: Array, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_bytes(b"")
    nowhere, inside = tmp_path / "no" / "a.png", tmp_path / "file" / "a.png"
    for path, message in (
        (tmp_path / "folder.png", "is a folder; expected the name of a file"),
        (nowhere, f"the folder {str(nowhere.parent)!r} does not exist"),
        (inside, f"the folder {str(inside.parent)!r} does not exist"),
    ):
        with pytest.raises(InputError, match=f"^{re.escape(f'{path}: {message}')}$"):
            write_image(path, picture)
    assert leftovers(tmp_path) == ["file", "folder.png"]


@posix_only
def test_a_read_only_file_and_a_read_only_folder_are_left_alone(picture: Array, tmp_path: Path) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    path = tmp_path / "a.png"
    path.write_bytes(b"kept")
    path.chmod(0o444)
    with pytest.raises(InputError, match=r"a\.png: cannot be written: the file is read-only$"):
        write_image(path, picture)
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match=r"b\.png: cannot be written: Permission denied$"):
        write_image(tmp_path / "b.png", picture)
    tmp_path.chmod(0o755)
    assert path.read_bytes() == b"kept"


def test_a_read_only_file_is_told(picture: Array, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"kept")
    monkeypatch.setattr(module.os, "access", lambda *_: False)
    with pytest.raises(InputError, match=f"^{re.escape(str(path))}: cannot be written: the file is read-only$"):
        write_image(path, picture)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: encode_image(p, "gif"), "unknown image format 'gif'; the valid ones are: png, ppm, jpg, jpeg, npy, npz"),
        (lambda p: encode_image(p.astype(float), "png"),
         "pixels has shape (5, 7, 4) and type float64: expected (H, W, 3) or (H, W, 4) of uint8"),
        (lambda p: encode_image(p[0], "npy"),
         "pixels has shape (7, 4) and type uint8: expected (H, W, 3) or (H, W, 4) of uint8"),
        (lambda p: encode_image(p[..., :2], "ppm"),
         "pixels has shape (5, 7, 2) and type uint8: expected (H, W, 3) or (H, W, 4) of uint8"),
        (lambda p: encode_image(p[:0], "png"),
         "pixels has shape (0, 7, 4) and type uint8: expected (H, W, 3) or (H, W, 4) of uint8"),
        (lambda p: encode_image({"depth": p}, "png"), "arrays by name (['depth']) go into a .npz file, not into .png"),
        (lambda p: encode_image({"a": np.array([None])}, "npz"),
         "arrays['a'] of type object: expected a name and an array of numbers"),
        (lambda p: encode_image({"a/b": p}, "npz"), "arrays['a/b'] of type uint8: expected a name and an array of numbers"),
        (lambda p: encode_image(np.zeros((1, 65501, 3), np.uint8), "jpg"),
         "the image is 65501 x 1 pixels: JPEG holds at most 65500 in a side"),
    ],
)  # fmt: skip
def test_messages(make: Any, message: str, picture: Array) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        make(picture)


def damaged(name: str, picture: Array) -> bytes:
    """Return the content of a file that cannot be read."""
    return {
        "missing.png": b"",
        "text.png": b"this is no picture",
        "empty.png": b"",
        "cut.png": png_bytes(picture)[:60],
        "cut.npy": encode_image(picture, "npy")[:150],
        "text.npy": b"this is no array",
        "empty.npz": b"",
        "cut.npz": encode_image({"color": picture}, "npz")[:100],
        "depth.npz": encode_image({"depth": picture}, "npz"),
        "floats.npz": encode_image({"color": np.zeros((2, 2, 4))}, "npz"),
    }[name]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("text.png", "is not an image that can be read$"),
        ("empty.png", "is not an image that can be read$"),
        ("cut.png", "(is a damaged image|cannot be read): "),
        ("cut.npy", "is a damaged array file: "),
        ("text.npy", "is a damaged array file: "),
        ("empty.npz", "is a damaged array file: "),
        ("cut.npz", "is a damaged array file: "),
        ("depth.npz", "has no array named 'color'$"),
        ("floats.npz", r"pixels has shape \(2, 2, 4\) and type float64: expected \(H, W, 3\) or \(H, W, 4\) of uint8$"),
    ],
)
def test_damaged_files_are_told_in_one_line(name: str, message: str, picture: Array, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(damaged(name, picture))
    with pytest.raises(FormatError, match=f"^{re.escape(str(path))}: {message}") as caught:
        read_image(path)
    assert "\n" not in str(caught.value)


def test_every_cut_and_every_flipped_byte_of_a_file_is_an_error_of_ours_or_a_picture(picture: Array, tmp_path: Path) -> None:
    for ending in ("png", "npy", "npz", "ppm", "jpg"):
        whole = encode_image(picture, ending)
        path = tmp_path / f"a.{ending}"
        for k in range(0, len(whole), 3):
            for content in (whole[:k], whole[:k] + bytes([whole[k] ^ 0xA5]) + whole[k + 1 :]):
                path.write_bytes(content)
                try:
                    outcome = str(read_image(path, max_pixels=10_000).dtype)
                except (FormatError, LimitError) as error:
                    outcome = str(error)
                assert outcome == "uint8" or outcome.startswith(f"{path}: ")


def test_a_missing_file_a_folder_and_too_many_pixels(picture: Array, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"no\.png: cannot be read: No such file or directory$"):
        read_image(tmp_path / "no.png")
    with pytest.raises(FormatError, match=r"is a folder; expected an image file$"):
        read_image(tmp_path)
    for name in ("a.png", "a.npy"):
        write_image(tmp_path / name, picture)
        message = f"{tmp_path / name}: 7 x 5 pixels are more than the limit of 34; see max_pixels"
        with pytest.raises(LimitError, match=f"^{re.escape(message)}$"):
            read_image(tmp_path / name, max_pixels=34)


def test_a_picture_that_claims_to_be_enormous_is_not_decoded(tmp_path: Path) -> None:
    content = bytearray(png_bytes(np.zeros((1, 1, 3), dtype=np.uint8)))
    content[16:24] = (60_000).to_bytes(4, "big") * 2
    path = tmp_path / "a.png"
    content[29:33] = zlib.crc32(content[12:29]).to_bytes(4, "big")
    path.write_bytes(content)
    with pytest.raises(LimitError, match=r"60000 x 60000 pixels are more than the limit of 268435456; see max_pixels$"):
        read_image(path)
    assert Image.MAX_IMAGE_PIXELS is not None
