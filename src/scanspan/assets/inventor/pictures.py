"""The picture of a Texture2: in the file, or in another one beside it."""

from __future__ import annotations

import numpy as np

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.pictures import decode_texture
from scanspan.assets.inventor.graph import Node
from scanspan.assets.inventor.state import State
from scanspan.assets.material import Texture
from scanspan.homogeneous import FloatArray
from scanspan.records import UInt8Array

WRAPS = {"REPEAT": "repeat", "CLAMP": "clamp"}


def texture_of(node: Node, state: State, file: ModelFile) -> Texture | None:
    """Return the texture of a Texture2, None where it has no picture or that cannot be had.

    With the models DECAL and BLEND the picture takes in the colour that lies under it, as it is in force where the texture is.
    """
    image = node.get("image")
    wrap = (WRAPS[node.get("wrapS")], WRAPS[node.get("wrapT")])
    pixels: UInt8Array | None = None
    if image is not None and image.size:
        height, width = image.shape[:2]
        if width * height > file.limits.texture_pixels:
            node.note(f"a texture of {width} x {height} is more than the limit (max_texture_pixels)")
            return None
        pixels = to_rgba(image)[::-1]
    elif name := node.get("filename").strip('"'):
        content = file.beside(name, "texture")
        found = None if content is None else decode_texture(content, file, name, "bilinear", wrap)
        pixels = None if found is None else found.image
    if pixels is None:
        return None
    channels = 3 if image is None or not image.size else image.shape[2]
    shown = lay_over(pixels, channels, node.get("model"), state.diffuse, node.get("blendColor"))
    return Texture(shown, "bilinear", wrap, max_pixels=file.limits.texture_pixels)


def to_rgba(image: UInt8Array) -> UInt8Array:
    """Return a picture of 1 to 4 channels, grey with or without alpha or colour with or without, as (h, w, 4)."""
    channels = image.shape[2]
    color = np.repeat(image[..., :1], 3, axis=2) if channels < 3 else image[..., :3]
    alpha = image[..., -1:] if channels in (2, 4) else np.full_like(image[..., :1], 255)
    return np.concatenate([color, alpha], axis=2)


def lay_over(pixels: UInt8Array, channels: int, model: str, diffuse: FloatArray, blend: FloatArray) -> UInt8Array:
    """Return a picture as its model lays it over a colour; MODULATE and REPLACE leave it as it is."""
    under = np.clip(np.nan_to_num(diffuse[0] if len(diffuse) else np.full(3, 0.8)), 0.0, 1.0) * 255.0
    if model == "DECAL" and channels in (2, 4):
        share = pixels[..., 3:] / 255.0
        mixed = pixels[..., :3] * share + under * (1.0 - share)
    elif model == "BLEND":
        share = pixels[..., :3] / 255.0
        mixed = np.clip(np.nan_to_num(blend), 0.0, 1.0) * 255.0 * share + under * (1.0 - share)
    else:
        return pixels
    alpha = np.full_like(pixels[..., :1], 255) if model == "DECAL" else pixels[..., 3:]
    return np.concatenate([np.rint(mixed).astype(np.uint8), alpha], axis=2)
