"""Files of a model: the model itself, and what lies beside it, opened safely.

A model may name other files: materials, textures, buffers. They are opened only if they are regular files in the model's own
folder or below it, after all links have been followed; never an absolute path, a device, an address on a network. Sizes are
checked before anything is read.
"""

from __future__ import annotations

import io
import logging
import os
import posixpath
import re
import stat
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import unquote

from scanspan.errors import FormatError, LimitError

logger = logging.getLogger("scanspan")

ADDRESS = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]*:")
"""A name that begins like an address (http:) or with a drive letter (C:)."""


@dataclass(frozen=True)
class Limits:
    """What a reader may use up.

    Attributes
    ----------
    bytes : size of the file, and of all that is unpacked or opened beside it.
    triangles : over the whole model, after faces have been cut.
    texture_pixels : pixels of one texture.
    face_corners : corners of one face.
    points : of a cloud.
    """

    bytes: int
    triangles: int
    texture_pixels: int
    face_corners: int
    points: int = 100_000_000


class Folder(Protocol):
    """A place from which a model's other files are read."""

    def read(self, name: str, most: int) -> bytes:
        """Return a file's bytes; raise OSError, with a reason for a person to read, when it cannot or must not be read."""


def relative_name(name: str) -> str:
    """Return a name within a folder with forward slashes; raise PermissionError when it leads out of it."""
    path = name.strip().replace("\\", "/")
    if not path or "\0" in path or len(path) > 4096:
        raise PermissionError("the name is empty, too long or not text")
    if ADDRESS.match(path) or path.startswith("/"):
        raise PermissionError("only files in the model's folder are opened")
    path = posixpath.normpath(path)
    if path == ".." or path.startswith("../"):
        raise PermissionError("only files in the model's folder are opened")
    return path


class DiskFolder:
    """A folder on disk."""

    def __init__(self, root: Path) -> None:
        self.root = Path(os.path.realpath(root))

    def read(self, name: str, most: int) -> bytes:
        """Return a file's bytes, if it is a regular file inside the folder and holds at most `most`."""
        path = Path(os.path.realpath(self.root / relative_name(name)))
        if not path.is_relative_to(self.root):
            raise PermissionError("it is a link that leads out of the model's folder")
        return read_regular(path, most)


class ArchiveFolder:
    """A folder in a zip archive; `spend` is told of every byte that is unpacked."""

    def __init__(self, archive: zipfile.ZipFile, root: str, spend: Callable[[int], None]) -> None:
        self.archive = archive
        self.root = root
        self.spend = spend

    def read(self, name: str, most: int) -> bytes:
        """Return a member's bytes, if it exists and holds at most `most`."""
        member = posixpath.normpath(posixpath.join(self.root, relative_name(name)))
        try:
            size = self.archive.getinfo(member).file_size
            if size > most:
                raise OSError(f"it holds {size} bytes, the limit is {most}")
            self.spend(size)
            with self.archive.open(member) as stream:
                return stream.read(most)
        except KeyError:
            raise FileNotFoundError("it is not in the archive") from None
        except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, ValueError) as error:
            raise OSError(f"it cannot be unpacked: {error}") from None
        except Exception as error:
            if type(error).__module__ in ("zlib", "_lzma", "bz2", "lzma"):
                raise OSError(f"it cannot be unpacked: {error}") from None
            raise


def read_regular(path: Path, most: int) -> bytes:
    """Return the bytes of a regular file; raise OSError for anything else, without opening it."""
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError("it is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise OSError("it is not a regular file")
    if status.st_size > most:
        raise LimitError(f"{path}: {status.st_size} bytes are more than the limit of {most} (max_bytes)")
    with path.open("rb") as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        raise LimitError(f"{path}: more bytes than the limit of {most} (max_bytes)")
    return content


@dataclass
class ModelFile:
    """A model that is being read.

    Attributes
    ----------
    path : as the caller named it, for messages.
    content : all its bytes.
    folder : where other files are found.
    limits : what may be used up.
    nonfinite : "error" or "drop", as for Mesh.
    notes : what could not be done, one line each.
    cameras : those that the file has, as Camera objects. lights : likewise, as Light objects.
    """

    path: str
    content: bytes
    folder: Folder
    limits: Limits
    nonfinite: str
    notes: list[str] = field(default_factory=list)
    cameras: list[Any] = field(default_factory=list)
    lights: list[Any] = field(default_factory=list)

    @property
    def stem(self) -> str:
        """The file's name without folder and extension."""
        return Path(self.path.replace("\\", "/")).stem

    def error(self, problem: str, where: str = "") -> FormatError:
        """Return the error that this file cannot be read."""
        return FormatError(self.path, problem, where)

    def note(self, text: str) -> None:
        """Keep a remark for the user, once, and log it."""
        if text not in self.notes:
            self.notes.append(text)
            logger.warning("%s: %s", self.path, text)

    def beside(self, name: str, kind: str) -> bytes | None:
        """Return the bytes of a file that the model names, or None with a note why not."""
        shown = name if len(name) <= 80 else name[:77] + "..."
        try:
            try:
                return self.folder.read(name, self.limits.bytes)
            except FileNotFoundError:
                return self.folder.read(unquote(name), self.limits.bytes)
        except FileNotFoundError:
            self.note(f"{kind} {shown!r} was not found")
        except OSError as error:
            self.note(f"{kind} {shown!r} was not opened: {error.strerror or error}")
        except LimitError as error:
            self.note(f"{kind} {shown!r} was not opened: {error}")
        except ValueError:
            self.note(f"{kind} {shown!r} was not opened: it is not a name of a file")
        return None

    def check_triangles(self, count: int) -> None:
        """Raise when the model has more triangles than the limit."""
        if count > self.limits.triangles:
            raise LimitError(
                f"{self.path}: {count} triangles are more than the limit of {self.limits.triangles} (max_triangles)"
            )

    def check_points(self, count: int) -> None:
        """Raise when a cloud has more points than the limit."""
        if count > self.limits.points:
            raise LimitError(f"{self.path}: {count} points are more than the limit of {self.limits.points} (max_points)")

    def check_faces(self, corner_counts: list[int]) -> None:
        """Raise when faces have too many corners, one alone or all together."""
        most = max(corner_counts, default=0)
        if most > self.limits.face_corners:
            limit = self.limits.face_corners
            raise LimitError(f"{self.path}: a face with {most} corners is more than the limit of {limit} (max_face_corners)")
        self.check_triangles(sum(corner_counts) - 2 * len(corner_counts))


def open_zip(content: bytes, file: ModelFile) -> zipfile.ZipFile:
    """Return an archive, refused when it is broken, encrypted or unpacks to more than the limit."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OverflowError, EOFError) as error:
        raise file.error(f"not a zip archive that can be read: {error}") from None
    except OSError as error:
        raise file.error(f"not a zip archive that can be read: {error}") from None
    total = sum(member.file_size for member in members)
    if total > file.limits.bytes:
        raise LimitError(f"{file.path}: unpacks to {total} bytes, more than the limit of {file.limits.bytes} (max_bytes)")
    if any(member.flag_bits & 1 for member in members):
        raise file.error("the archive is encrypted")
    return archive
