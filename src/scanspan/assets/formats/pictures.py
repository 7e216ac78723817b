"""Pictures to textures, through Pillow, with the size checked before a pixel is unpacked.

Only formats that Pillow reads by itself are allowed: some others would start a program.
"""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING

import numpy as np

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.material import Texture

if TYPE_CHECKING:
    from PIL.Image import Image

FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF", "PPM", "SGI")


def decode_texture(
    content: bytes,
    file: ModelFile,
    label: str,
    filter: str = "bilinear",
    wrap: tuple[str, str] = ("repeat", "repeat"),
    *,
    has_alpha: bool = True,
) -> Texture | None:
    """Return the texture in a picture file's bytes, or None with a note why not; `has_alpha` says whether its alpha counts."""
    import PIL.Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            picture = PIL.Image.open(io.BytesIO(content), formats=FORMATS)
        except PIL.Image.DecompressionBombError:
            file.note(f"texture {label!r} was not read: it has more pixels than the limit (max_texture_pixels)")
            return None
        except Exception as error:
            file.note(f"texture {label!r} was not read: {_first_line(error) or 'no picture'}")
            return None
        return picture_to_texture(picture, file, label, filter, wrap, "RGBA" if has_alpha else "RGB")


def picture_to_texture(
    picture: Image,
    file: ModelFile,
    label: str,
    filter: str = "bilinear",
    wrap: tuple[str, str] = ("repeat", "repeat"),
    channels: str = "RGBA",
) -> Texture | None:
    """Return a texture from a picture that Pillow has opened and not yet unpacked, or None with a note why not."""
    width, height = picture.size
    if picture.format not in FORMATS:
        file.note(f"texture {label!r} was not read: {picture.format} is not a format for textures")
        return None
    if width * height > file.limits.texture_pixels:
        limit = file.limits.texture_pixels
        file.note(f"texture {label!r} was not read: {width} x {height} is more than the limit of {limit} (max_texture_pixels)")
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            pixels = np.array(picture.convert(channels))
        except Exception as error:
            file.note(f"texture {label!r} was not read: {_first_line(error)}")
            return None
    return Texture(pixels, filter, wrap, max_pixels=file.limits.texture_pixels)


def _first_line(error: Exception) -> str:
    """Return the first line of a message, without what Python says of the object in memory."""
    lines = str(error).splitlines()
    if not lines or "BytesIO" in lines[0]:
        return "it is not a picture that can be read"
    return lines[0]
