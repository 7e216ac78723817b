"""load(): a file to a Scene, whatever its format.

A table says which reader takes which extension; a new format is one line there. STL, PLY, OBJ and OFF have readers of our own,
which keep faces whole and start at once; glTF and 3MF are parsed by trimesh, LAS and LAZ by laspy, imported when first needed.
Clouds that do not fit into memory are opened by `open_chunks` (chunks.py). Whatever goes wrong is one FormatError with the
file's name: a damaged file never crashes, hangs or fills the memory.
"""

from __future__ import annotations

import os
import posixpath
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from scanspan.assets.formats.files import ArchiveFolder, DiskFolder, Limits, ModelFile, open_zip, read_regular
from scanspan.assets.material import MAX_TEXTURE_PIXELS
from scanspan.assets.mesh import NONFINITE
from scanspan.assets.scene import Instance, Scene
from scanspan.errors import FormatError, InputError, LimitError, unknown_name

Reader = Callable[[ModelFile], list[Instance]]

READERS: dict[str, tuple[str, str, str]] = {
    "obj": ("read_obj", "read_obj", "+Y"),
    "ply": ("read_ply", "read_ply", "+Y"),
    "off": ("read_off", "read_off", "+Y"),
    "stl": ("read_stl", "read_stl", "+Z"),
    "gltf": ("read_gltf", "read_gltf", "+Y"),
    "glb": ("read_gltf", "read_gltf", "+Y"),
    "3mf": ("read_3mf", "read_3mf", "+Z"),
    "iv": ("read_iv", "read_iv", "+Y"),
    "las": ("read_las", "read_las", "+Z"),
    "laz": ("read_las", "read_las", "+Z"),
    "xyz": ("read_xyz", "read_xyz", "+Z"),
    "txt": ("read_xyz", "read_xyz", "+Z"),
    "csv": ("read_xyz", "read_xyz", "+Z"),
    "pts": ("read_xyz", "read_xyz", "+Z"),
    "npy": ("read_npy", "read_npy", "+Z"),
}
"""Extension to the reader's module in formats/, its function, and the direction that is up."""

PACKED = (".gz", ".asc")
"""Endings that may follow .iv: packed, and text beside a binary file of the same name."""

REMARKS = {"txt", "csv"}
"""Kinds that are no model where they lie in an archive, but tell about one."""

MAX_BYTES = 2**31
MAX_TRIANGLES = 100_000_000
MAX_POINTS = 100_000_000
MAX_FACE_CORNERS = 10_000
"""Cutting a face takes time that grows with the square of its corners; this many take seconds."""


def load(
    path: str | os.PathLike[str],
    *,
    file_type: str | None = None,
    nonfinite: str = "error",
    max_bytes: int = MAX_BYTES,
    max_triangles: int = MAX_TRIANGLES,
    max_texture_pixels: int = MAX_TEXTURE_PIXELS,
    max_face_corners: int = MAX_FACE_CORNERS,
    max_points: int = MAX_POINTS,
) -> Scene:
    """Read a model file.

    Parameters
    ----------
    path : an OBJ, PLY, STL, glTF, GLB, 3MF, OFF or Open Inventor (.iv) file, or a zip archive that holds one of them. Points
        are read from LAS, LAZ, COPC, XYZ, TXT, CSV, PTS, NPY and PLY files; a PLY without faces gives a PointCloud.
    file_type : the extension to go by, where the name has none or a wrong one.
    nonfinite : "error" raises for a vertex that is used and not finite; "drop" leaves out the faces that use it, and points.
    max_bytes : largest file, and most bytes unpacked from an archive or opened beside the file.
    max_triangles, max_texture_pixels, max_face_corners, max_points : largest model, texture, face and cloud.

    Returns
    -------
    Scene with at least one instance that draws something. `notes` tells what was left out, such as a texture that was not
    found; the logger "scanspan" has the same lines. Other files are opened only in the model's folder or below it.

    Raises
    ------
    FormatError : the file is missing, not a regular file, of an unknown kind, damaged or empty.
    LimitError : the file is larger than a limit.
    InputError : an option that cannot be used.
    """
    if nonfinite not in NONFINITE:
        raise unknown_name("value of nonfinite", nonfinite, NONFINITE)
    limits = Limits(
        as_limit(max_bytes, "max_bytes"),
        as_limit(max_triangles, "max_triangles"),
        as_limit(max_texture_pixels, "max_texture_pixels"),
        as_limit(max_face_corners, "max_face_corners"),
        as_limit(max_points, "max_points"),
    )
    return _to_scene(*open_model(path, file_type, limits, nonfinite))


def open_model(
    path: str | os.PathLike[str], file_type: str | None = None, limits: Limits | None = None, nonfinite: str = "error"
) -> tuple[str, ModelFile]:
    """Return the kind of a model file and the file itself, read but not yet parsed; of an archive, the one model in it."""
    limits = limits or Limits(MAX_BYTES, MAX_TRIANGLES, MAX_TEXTURE_PIXELS, MAX_FACE_CORNERS)
    name = as_path(path)
    kind = _kind_of(name, file_type)
    content = read_content(name, limits.bytes, "a model file")
    if not content:
        raise FormatError(name, "the file is empty")
    file = ModelFile(name, content, DiskFolder(Path(name).parent), limits, nonfinite)
    return _open_archive(file) if kind == "zip" else (kind, file)


def file_types() -> tuple[str, ...]:
    """Return the extensions that `load` knows.

    >>> "obj" in file_types()
    True
    """
    return (*READERS, "zip")


def as_limit(value: int, name: str) -> int:
    """Return a limit, a whole number above 0."""
    if isinstance(value, bool) or not isinstance(value, int) or value <= 0:
        raise InputError(f"{name} = {value!r}: expected a whole number above 0")
    return value


def as_path(path: str | os.PathLike[str]) -> str:
    """Return a path as text."""
    try:
        name = os.fspath(path)
    except TypeError:
        raise InputError(f"path: expected text or a path, got {type(path).__name__}") from None
    if not isinstance(name, str):
        raise InputError(f"path: expected text or a path, got {type(name).__name__}")
    if not name:
        raise InputError("path: expected the name of a file, got an empty one")
    return name


def _kind_of(name: str, file_type: str | None) -> str:
    """Return the lower-case extension to go by; raise when no reader has it."""
    if file_type is not None:
        if not isinstance(file_type, str):
            raise InputError(f"file_type: expected text such as 'stl', got {file_type!r}")
        kind = file_type.lower().removeprefix(".")
        if kind not in file_types():
            raise unknown_name("file type", file_type, file_types())
        return kind
    plain = name.lower()
    for ending in PACKED:
        plain = plain.removesuffix(ending) if plain.endswith(f".iv{ending}") else plain
    kind = os.path.splitext(plain)[1].removeprefix(".")
    if kind not in file_types():
        problem = f"unknown extension {'.' + kind!r}" if kind else "the name has no extension; give file_type"
        _stat(name)
        raise FormatError(name, f"{problem}; the known ones are: {', '.join(file_types())}")
    return kind


def _stat(name: str) -> None:
    """Raise for a file that is not there or is a folder, which says more than an unknown extension."""
    try:
        if os.path.isdir(name):
            raise FormatError(name, "it is a folder, expected a model file")
        os.stat(name)
    except ValueError as error:
        raise error if isinstance(error, FormatError) else FormatError(repr(name), "it is not a name of a file") from None
    except OSError as error:
        raise FormatError(name, _reason(error)) from None


def read_content(name: str, max_bytes: int, expected: str) -> bytes:
    """Return all bytes of a file; `expected` says in messages what it should have been."""
    try:
        return read_regular(Path(name), max_bytes)
    except IsADirectoryError:
        raise FormatError(name, f"it is a folder, expected {expected}") from None
    except OSError as error:
        raise FormatError(name, _reason(error)) from None
    except LimitError:
        raise
    except ValueError:
        raise FormatError(repr(name), "it is not a name of a file") from None


def _reason(error: OSError) -> str:
    """Return why a file cannot be opened, in few words."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file"
    return (error.strerror or str(error)).lower()


def _to_scene(kind: str, file: ModelFile) -> Scene:
    """Run the reader; turn whatever it raises into one of our errors, and refuse a model that draws nothing."""
    module, function, up = READERS[kind]
    reader: Reader = getattr(import_module(f"scanspan.assets.formats.{module}"), function)
    try:
        instances = reader(file)
        name = os.path.basename(file.path)
        scene = Scene(instances, up=up, name=name, notes=file.notes, cameras=file.cameras, lights=file.lights)
    except (FormatError, LimitError):
        raise
    except InputError as error:
        raise file.error(str(error)) from None
    except MemoryError:
        raise file.error("it needs more memory than there is") from None
    except RecursionError:
        raise file.error("it is nested too deeply") from None
    except Exception as error:
        # Libraries raise what they like over a damaged file: struct.error, zlib.error, KeyError, AssertionError, SyntaxError.
        raise file.error(f"the file is damaged ({type(error).__name__}: {_first_line(error)})") from error
    if not scene.primitive_count:
        raise file.error("the file has nothing to draw")
    return scene


def _first_line(error: BaseException) -> str:
    """Return the first line of a message, at most 120 characters."""
    lines = str(error).splitlines() or [""]
    return lines[0][:120]


def _open_archive(file: ModelFile) -> tuple[str, ModelFile]:
    """Return the one model in a zip archive and its kind."""
    archive = open_zip(file.content, file)
    members = [name for name in archive.namelist() if not name.startswith(("__MACOSX/", ".")) and not name.endswith("/")]
    models = [name for name in members if os.path.splitext(name)[1].lower().removeprefix(".") in READERS.keys() - REMARKS]
    if len(models) != 1:
        shown = ", ".join(sorted(models)[:5]) + (", ..." if len(models) > 5 else "")
        raise file.error(f"expected one model in the archive, there are {len(models)}{': ' + shown if models else ''}")

    # Count what is unpacked, so that reading a member many times cannot pass the limit either.
    left = file.limits.bytes

    def spend(size: int) -> None:
        nonlocal left
        left -= size
        if left < 0:
            raise LimitError(f"{file.path}: unpacks to more than the limit of {file.limits.bytes} bytes (max_bytes)")

    folder = ArchiveFolder(archive, posixpath.dirname(models[0]), spend)
    try:
        content = folder.read(posixpath.basename(models[0]), file.limits.bytes)
    except OSError as error:
        raise file.error(f"{models[0]}: {error}") from None
    if not content:
        raise file.error(f"{models[0]} in the archive is empty")
    inside = ModelFile(f"{file.path}/{models[0]}", content, folder, file.limits, file.nonfinite)
    return os.path.splitext(models[0])[1].lower().removeprefix("."), inside
