"""Image files: an array of pixels to bytes, to a file that is whole or not there, and back.

The bytes are made first and written under a temporary name in the same folder, which then takes the place of the file in one
step: a full disk, an error or Ctrl-C leaves what was there before. Only what is no regular file, such as a pipe, is written
to directly.

PNG keeps the alpha. PPM and JPEG have none, so that their pixels are laid over white, in linear light. NPY holds the array of
pixels as it is, and NPZ any number of arrays by name.

Source: PNG third edition (W3C 2025); Netpbm, ppm(5).
"""

from __future__ import annotations

import io
import os
import secrets
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from scanspan.errors import FormatError, InputError, LimitError, unknown_name
from scanspan.homogeneous import quote
from scanspan.records import UInt8Array
from scanspan.shade.color import LINEAR_FROM_SRGB8, THRESHOLDS

FORMATS = ("png", "ppm", "jpg", "jpeg", "npy", "npz")

# A third of the time of Pillow's own choice for a rendered picture, and a tenth more bytes.
_PNG_LEVEL = 1
_JPEG_QUALITY = 92

# The most pixels that a file may claim to have: 2^28 take a gigabyte.
MAX_PIXELS = 2**28


def image_format(path: str | os.PathLike[str]) -> str:
    """Return the format that the ending of a file's name asks for.

    Raises
    ------
    InputError : when there is no such format.

    >>> image_format("picture.PNG")
    'png'
    """
    ending = Path(path).suffix
    if ending[1:].lower() not in FORMATS:
        raise unknown_name("image format", ending, (f".{name}" for name in FORMATS))
    return ending[1:].lower()


def write_image(path: str | os.PathLike[str], pixels: UInt8Array | Mapping[str, npt.ArrayLike]) -> None:
    """Write an image to a file; its ending chooses the format.

    Parameters
    ----------
    path : .png, .ppm, .jpg, .jpeg, .npy or .npz.
    pixels : (H, W, 3) or (H, W, 4) uint8, sRGB with straight alpha. For .npz also a mapping from names to arrays of any kind;
        pixels alone are stored there under the name ``color``.

    Raises
    ------
    InputError : when the ending is unknown, the pixels are no such array, or the file cannot be written; whatever was there
        before is still there.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_image(f"{folder}/red.png", np.full((2, 3, 3), (255, 0, 0), dtype=np.uint8))
    ...     read_image(f"{folder}/red.png")[0, 0].tolist()
    [255, 0, 0, 255]
    """
    target = _checked_path(path)
    write_bytes(target, encode_image(pixels, image_format(target)))


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write bytes to a file that afterwards is either whole or as it was before.

    Parameters
    ----------
    path : where to; a link is followed. A new file takes the place of an old one and keeps its permissions.
    content : what to write.

    Raises
    ------
    InputError : when the folder is missing, the path is a folder, or it cannot be written to.
    """
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Give a file to write to, which takes the place of the one at a path when all is written, and is removed otherwise.

    Errors are those of `write_bytes`.
    """
    target = _checked_path(path)
    try:
        real = Path(os.path.realpath(target))
        if real.is_dir():
            raise InputError(f"{target}: is a folder; expected the name of a file")
        if not real.parent.is_dir():
            raise InputError(f"{target}: the folder {quote(str(target.parent))} does not exist")
        mode = real.stat().st_mode if real.exists() else None
        if mode is not None and not os.access(real, os.W_OK):
            raise InputError(f"{target}: cannot be written: the file is read-only")
        if mode is not None and not stat.S_ISREG(mode):
            with real.open("wb") as file:
                yield file
        else:
            with _beside(real, mode) as file:
                yield file
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None


@contextmanager
def _beside(target: Path, mode: int | None) -> Iterator[BinaryIO]:
    """Give a file beside the target and put it in its place; remove it on any failure, Ctrl-C among them."""
    beside = target.with_name(f".scanspan-{secrets.token_hex(8)}.part")
    number = os.open(beside, os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with os.fdopen(number, "wb") as file:
            yield file
        if mode is not None:
            os.chmod(beside, stat.S_IMODE(mode))
        os.replace(beside, target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def encode_image(pixels: UInt8Array | Mapping[str, npt.ArrayLike], format: str) -> bytes:
    r"""Return an image as the bytes of a file.

    Parameters
    ----------
    pixels : as for `write_image`.
    format : "png", "ppm", "jpg", "jpeg", "npy" or "npz".

    Raises
    ------
    InputError : when the format is unknown or cannot hold the pixels.

    >>> encode_image(np.zeros((1, 2, 3), dtype=np.uint8), "ppm")
    b'P6\n2 1\n255\n\x00\x00\x00\x00\x00\x00'
    """
    if format not in FORMATS:
        raise unknown_name("image format", format, FORMATS)
    stream = io.BytesIO()
    if format == "npz":
        arrays = pixels if isinstance(pixels, Mapping) else {"color": _checked_pixels(pixels)}
        np.savez_compressed(stream, **_checked_arrays(arrays))  # type: ignore[arg-type]
        return stream.getvalue()
    if isinstance(pixels, Mapping):
        raise InputError(f"arrays by name ({quote(list(pixels))}) go into a .npz file, not into .{format}")
    array = _checked_pixels(pixels)
    if format == "npy":
        np.save(stream, array, allow_pickle=False)
    elif format == "ppm":
        opaque = over_white(array)
        stream.write(b"P6\n%d %d\n255\n" % (array.shape[1], array.shape[0]))
        stream.write(opaque.tobytes())
    elif format == "png":
        Image.fromarray(array).save(stream, format="PNG", compress_level=_PNG_LEVEL)
    else:
        if max(array.shape[:2]) > 65500:
            raise InputError(f"the image is {array.shape[1]} x {array.shape[0]} pixels: JPEG holds at most 65500 in a side")
        Image.fromarray(over_white(array)).save(stream, format="JPEG", quality=_JPEG_QUALITY, subsampling=0)
    return stream.getvalue()


def png_bytes(pixels: UInt8Array) -> bytes:
    """Return pixels, (H, W, 3) or (H, W, 4) uint8, as the bytes of a PNG file, as notebooks show them.

    >>> png_bytes(np.zeros((1, 1, 4), dtype=np.uint8))[1:4]
    b'PNG'
    """
    return encode_image(pixels, "png")


def over_white(pixels: UInt8Array) -> UInt8Array:
    """Return pixels laid over white in linear light, (H, W, 3) uint8; opaque ones stay exactly as they are.

    >>> over_white(np.array([[[0, 0, 0, 0], [9, 8, 7, 255]]], dtype=np.uint8))[0].tolist()
    [[255, 255, 255], [9, 8, 7]]
    """
    colors = pixels[..., :3]
    if pixels.shape[2] == 3 or bool((pixels[..., 3] == 255).all()):
        return np.ascontiguousarray(colors)
    alpha = pixels[..., 3:].astype(np.float32) / np.float32(255.0)
    light = LINEAR_FROM_SRGB8[colors] * alpha + (np.float32(1.0) - alpha)
    codes: UInt8Array = np.searchsorted(THRESHOLDS, light, side="right").astype(np.uint8)
    return codes


def read_image(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> UInt8Array:
    """Return the pixels of an image file.

    Parameters
    ----------
    path : PNG, PPM, JPEG or another file that Pillow reads; .npy, or .npz with an array named ``color``.
    max_pixels : the most pixels that the file may have.

    Returns
    -------
    (H, W, 4) uint8, sRGB with straight alpha.

    Raises
    ------
    FormatError : when the file is missing, is a folder, or cannot be read as an image.
    LimitError : when it has more than `max_pixels`.
    """
    source = _checked_path(path)
    if source.is_dir():
        raise FormatError(source, "is a folder; expected an image file")
    try:
        if source.suffix.lower() in (".npy", ".npz"):
            return _read_array(source, max_pixels)
        with source.open("rb") as file:
            return _read_picture(file, source, max_pixels)
    except OSError as error:
        raise FormatError(source, f"cannot be read: {error.strerror or error}") from None


def _read_picture(file: Any, source: Path, max_pixels: int) -> UInt8Array:
    """Return the pixels of an open file that Pillow reads."""
    limit = Image.MAX_IMAGE_PIXELS
    try:
        # Pillow's own limit warns and then raises; ours is checked before any pixel is decoded.
        Image.MAX_IMAGE_PIXELS = None
        with Image.open(file) as picture:
            width, height = picture.size
            if width * height > max_pixels:
                raise LimitError(f"{source}: {width} x {height} pixels are more than the limit of {max_pixels}; see max_pixels")
            if picture.mode in ("I;16", "I;16B", "I;16L", "I;16N"):
                grey = (np.asarray(picture.convert("I")) >> 8).astype(np.uint8)
                return np.ascontiguousarray(np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=-1))
            return np.array(picture.convert("RGBA"))
    except UnidentifiedImageError:
        raise FormatError(source, "is not an image that can be read") from None
    except (SyntaxError, ValueError, EOFError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise FormatError(source, f"is a damaged image: {quote(str(error))}") from None
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def _read_array(source: Path, max_pixels: int) -> UInt8Array:
    """Return the pixels of an .npy or .npz file."""
    try:
        with source.open("rb") as file:
            stored: Any = np.load(file, allow_pickle=False)
            array = stored["color"] if source.suffix.lower() == ".npz" else stored
    except KeyError:
        raise FormatError(source, "has no array named 'color'") from None
    except (ValueError, EOFError, NotImplementedError, MemoryError, OverflowError) as error:
        raise FormatError(source, f"is a damaged array file: {quote(str(error))}") from None
    except Exception as error:
        if isinstance(error, OSError):
            raise
        raise FormatError(source, f"is a damaged array file: {type(error).__name__}") from None
    try:
        pixels = _checked_pixels(array)
    except InputError as error:
        raise FormatError(source, str(error)) from None
    if pixels.shape[0] * pixels.shape[1] > max_pixels:
        raise LimitError(
            f"{source}: {pixels.shape[1]} x {pixels.shape[0]} pixels are more than the limit of {max_pixels}; see max_pixels"
        )
    if pixels.shape[2] == 4:
        return pixels
    return np.concatenate([pixels, np.full((*pixels.shape[:2], 1), 255, dtype=np.uint8)], axis=2)


def _checked_path(path: object) -> Path:
    """Return a path that the system can use, or raise an InputError."""
    if not isinstance(path, (str, os.PathLike)) or not isinstance(os.fspath(path), str):
        raise InputError(f"path = {quote(path)}: expected the name of a file")
    name = os.fspath(path)
    if not name or "\0" in name:
        raise InputError(f"path = {quote(name)}: expected the name of a file")
    return Path(name)


def _checked_pixels(pixels: object) -> UInt8Array:
    """Return pixels in one piece of memory, or raise an InputError."""
    array = np.asarray(pixels)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise InputError(f"pixels has shape {array.shape} and type {array.dtype}: expected (H, W, 3) or (H, W, 4) of uint8")
    return np.ascontiguousarray(array)


def _checked_arrays(arrays: Mapping[str, npt.ArrayLike]) -> dict[str, npt.NDArray[Any]]:
    """Return arrays by name that can be stored without pickling, or raise an InputError."""
    checked = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if not isinstance(name, str) or not name.isidentifier() or array.dtype.hasobject:
            raise InputError(f"arrays[{quote(name)}] of type {array.dtype}: expected a name and an array of numbers")
        checked[name] = array
    return checked
