"""LAS, LAZ and COPC: what laser scanners and photogrammetry deliver.

Records are read by laspy and unpacked by lazrs, which are imported when first needed; COPC is LAZ with an index that is not
needed here. Coordinates stay the whole numbers that they are. What a damaged file could do to these libraries is checked
before (las_check.py). A file has no checksum: damage within its packed points is found where unpacking fails or points fall
outside of the header's bounds, which is told in a note.

Colours have 16 bits by the specification, but many files have 8 bits in them: where none is above 255 they are taken for that.

Source: the ASPRS LAS specification 1.4, revision 15; laspy 2.7 and lazrs 0.6, which read the records.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, BinaryIO

import numpy as np

from scanspan.assets.chunks import CHUNK, CloudChunks, join
from scanspan.assets.cloud import PointCloud
from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.las_check import check_chunk_table, check_header
from scanspan.assets.scene import Instance
from scanspan.errors import FormatError, ScanspanError

MISSING = 'reading LAS, LAZ and COPC files needs laspy and lazrs: pip install "scanspan[points]"'

PLACES = 16
"""Places of a file that are looked at to tell whether its colours have 8 bits or 16."""


@dataclass(frozen=True)
class Opened:
    """What is known before points are read: how to open the file anew, the checked header, and where packed chunks begin."""

    open: Callable[[], BinaryIO]
    path: str
    header: Any
    crs: str
    starts: tuple[int, ...]


class DeepColorsError(Exception):
    """Colours of 16 bits have come after others were taken for 8."""


def read_las(file: ModelFile) -> list[Instance]:
    """Return the one cloud of a LAS, LAZ or COPC file."""
    file.check_points(check_header(file.content[:375], len(file.content), file.path).points)
    opened = open_las(lambda: io.BytesIO(file.content), file.path, len(file.content))
    notes: list[str] = []
    try:
        cloud = join(chunks_of(opened, CHUNK, notes, shift=0 if looks_shallow(opened, 1) else 8))
    except DeepColorsError:
        notes.clear()
        cloud = join(chunks_of(opened, CHUNK, notes, shift=8))
    for note in notes:
        file.note(note)
    return [Instance(cloud, name=file.stem)]


def las_chunks(open_file: Callable[[], BinaryIO], path: str, size: int, chunk: int, nonfinite: str) -> CloudChunks:
    """Return the chunks of a LAS, LAZ or COPC file."""
    opened = open_las(open_file, path, size)
    chunks = chunks_of(opened, chunk, [], 0 if looks_shallow(opened, PLACES) else 8)

    def read() -> Iterator[PointCloud]:
        try:
            yield from chunks.read()
        except DeepColorsError:
            raise FormatError(path, "colours of 16 bits come after others that have 8; load the file as a whole") from None

    return replace(chunks, read=read)


def open_las(open_file: Callable[[], BinaryIO], path: str, size: int) -> Opened:
    """Return a file whose header, and whose table of packed chunks, has been checked."""
    laspy, lazrs = _import_readers(path)
    with open_file() as stream:
        head = check_header(stream.read(375), size, path)
        with telling(path):
            stream.seek(0)
            header = laspy.LasHeader.read_from(stream)
        if header.point_count != head.points:
            raise FormatError(path, f"the header says {header.point_count} points and {head.points}")
        starts: tuple[int, ...] = ()
        if head.is_packed:
            with telling(path):
                record = header.vlrs[header.vlrs.index("LasZipVlr")].record_data
                starts = check_chunk_table(stream, record, head, size, path, lazrs)
    return Opened(open_file, path, header, crs_of(header), starts)


def _import_readers(path: str) -> tuple[Any, Any]:
    """Return laspy and lazrs, or raise with the extra that brings them."""
    try:
        import laspy
        import lazrs
    except ImportError:
        raise FormatError(path, MISSING) from None
    logging.getLogger("laspy").addHandler(logging.NullHandler())
    return laspy, lazrs


@contextmanager
def telling(path: str) -> Iterator[None]:
    """Turn whatever a library raises over a damaged file into one of our errors; a panic of lazrs is a BaseException."""
    try:
        yield
    except (ScanspanError, DeepColorsError, KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:
        line = (str(error).splitlines() or [""])[0][:120]
        raise FormatError(path, f"the file is damaged ({type(error).__name__}: {line})") from None


def chunks_of(opened: Opened, chunk: int, notes: list[str], shift: int) -> CloudChunks:
    """Return the chunks of a file whose colours are shifted to the right by 0 or 8 bits."""
    header = opened.header
    bounds = np.array([header.mins, header.maxs], np.float64)

    def read() -> Iterator[PointCloud]:
        outside = 0
        for record in records_of(opened, chunk):
            part = cloud_of(record, opened, shift)
            yield part
            outside += int(np.any((part.bounds < bounds[0] - part.scale) | (part.bounds > bounds[1] + part.scale)))
        if outside:
            notes.append("points lie outside of the bounds in the header: one of the two is damaged")

    return CloudChunks(opened.path, header.point_count, bounds, opened.crs, "+Z", notes, read)


def records_of(opened: Opened, chunk: int, first: int = 0, count: int | None = None) -> Iterator[Any]:
    """Give the records of a file as laspy has them, so many at a time; of a few alone no whole chunk is unpacked."""
    laspy, _ = _import_readers(opened.path)
    wanted = laspy.DecompressionSelection
    fields = wanted.XY_RETURNS_CHANNEL | wanted.Z | wanted.INTENSITY | wanted.CLASSIFICATION | wanted.RGB
    left = opened.header.point_count - first if count is None else count
    if left <= 0:
        return
    with opened.open() as stream:
        with telling(opened.path):
            backend = None if count is None else laspy.LazBackend.Lazrs
            reader = laspy.LasReader(
                stream, closefd=False, laz_backend=backend, read_evlrs=False, decompression_selection=fields
            )
            if first:
                reader.seek(first)
        while left > 0:
            with telling(opened.path):
                record = reader.read_points(min(chunk, left))
            if len(record) != min(chunk, left):
                raise FormatError(opened.path, f"the file ends {left - len(record)} points before its end")
            left -= len(record)
            yield record


def looks_shallow(opened: Opened, places: int) -> bool:
    """Say whether no colour is above 255, as far as can be seen from some places spread over the file."""
    if "red" not in opened.header.point_format.dimension_names:
        return True
    # Packed points can be read from the beginning of a chunk only.
    count, share = opened.header.point_count, 65536 // places
    spread = np.unique(np.linspace(0, max(count - share, 0), places).astype(np.int64))
    if opened.starts:
        spread = np.unique(np.array(opened.starts)[np.linspace(0, len(opened.starts) - 1, places).astype(np.int64)])
    for first in spread.tolist():
        for record in records_of(opened, share, first, min(share, count - first)):
            if max(int(record[name].max()) for name in ("red", "green", "blue")) > 255:
                return False
    return True


def cloud_of(record: Any, opened: Opened, shift: int) -> PointCloud:
    """Return the points of a record of laspy."""
    with telling(opened.path):
        columns: dict[str, Any] = {
            name: np.array(record[name]) for name in ("intensity", "classification", "return_number", "number_of_returns")
        }
        if "red" in record.point_format.dimension_names:
            deep = np.stack([record[name] for name in ("red", "green", "blue")], axis=1)
            if shift == 0 and deep.max() > 255:
                raise DeepColorsError
            columns["color"] = (deep >> shift).astype(np.uint8)
        integers = np.stack([record.array[name] for name in "XYZ"], axis=1)

    # These arrays belong to nobody else, so the cloud may keep them.
    for array in (integers, *columns.values()):
        array.flags.writeable = False
    header = opened.header
    return PointCloud(integers=integers, scale=header.scales, offset=header.offsets, crs=opened.crs, **columns)


def crs_of(header: Any) -> str:
    """Return the coordinate reference system: its text, or the EPSG code or the citation among the GeoTIFF keys."""
    by_kind: dict[Any, Any] = {(str(vlr.user_id), int(vlr.record_id)): vlr for vlr in header.vlrs}
    well_known = by_kind.get(("LASF_Projection", 2112))
    if well_known is not None and getattr(well_known, "string", None):
        return str(well_known.string).strip("\0 \n")
    keys = {key.id: key for key in getattr(by_kind.get(("LASF_Projection", 34735)), "geo_keys", ())}
    for number in (3072, 2048):
        if number in keys and keys[number].tiff_tag_location == 0 and 0 < keys[number].value_offset < 32767:
            return f"EPSG:{keys[number].value_offset}"
    texts: Any = getattr(by_kind.get(("LASF_Projection", 34737)), "strings", ())
    return str(texts[0]).strip("\0| \n") if texts else ""
