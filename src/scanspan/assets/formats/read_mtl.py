"""MTL: the materials of an OBJ file, parsed by trimesh.

trimesh opens textures itself while it parses. It is given a stand-in for every picture, which keeps the name, so that the real
one is opened by our rules. Of the many values the diffuse colour, its texture and the opacity d are used; Tr is not, because
files disagree on which end of it is opaque.
"""

from __future__ import annotations

import base64
from typing import Any

from scanspan.assets.formats.files import ModelFile
from scanspan.assets.formats.pictures import decode_texture
from scanspan.assets.material import Material, Texture

STAND_IN = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==")
"""A PNG of one pixel."""

ONE_WORD = ("-blendu", "-blendv", "-boost", "-bm", "-cc", "-clamp", "-imfchan", "-texres")
OPTION_LENGTHS = dict.fromkeys(ONE_WORD, 1) | {"-mm": 2}
"""How many words follow an option of map_Kd; -o, -s and -t have one to three numbers."""


class _StandIn:
    """What trimesh asks for pictures."""

    def get(self, name: str) -> bytes:
        """Return a picture for any name."""
        return STAND_IN


def read_mtl(content: bytes, file: ModelFile, label: str) -> dict[str, Material]:
    """Return the materials in a library, by name; none, with a note, when it cannot be parsed."""
    from trimesh.exchange.obj import parse_mtl

    try:
        parsed = parse_mtl(content.decode("utf-8", "replace"), resolver=_StandIn())  # type: ignore[no-untyped-call]
    except Exception as error:
        file.note(f"material library {label!r} was not read ({type(error).__name__})")
        return {}
    textures: dict[str, Texture | None] = {}
    return {str(name): _material(str(name), values, textures, file) for name, values in parsed.items()}


def _material(name: str, values: dict[str, Any], textures: dict[str, Texture | None], file: ModelFile) -> Material:
    """Return one material from the values that trimesh found."""
    color = _numbers(values.get("diffuse"), 3)
    texture = None
    if values.get("image") is not None:
        text = str(values["image"].info.get("file_path", ""))
        if text not in textures:
            textures[text] = _texture(text, file)
        texture = textures[text]

    # Let a texture keep its own colours where the diffuse colour is black, which some exporters write.
    if color is None or (texture is not None and not any(color)):
        color = [1.0, 1.0, 1.0]
    (opacity,) = _numbers(values.get("d"), 1) or [1.0]
    if opacity == 0.0:
        file.note(f"material {name[:80]!r} has d 0, which would show nothing; it is drawn opaque")
        opacity = 1.0
    return Material(name, (color[0], color[1], color[2], opacity), texture)


def _numbers(value: Any, count: int) -> list[float] | None:
    """Return `count` numbers cut to 0..1, or None when there are not that many."""
    words = value if isinstance(value, list) else [value]
    try:
        numbers = [float(word) for word in words[:count]]
    except (TypeError, ValueError):
        return None
    if len(numbers) < count or any(number != number for number in numbers):
        return None
    return [min(1.0, max(0.0, number)) for number in numbers]


def _texture(text: str, file: ModelFile) -> Texture | None:
    """Return the texture that stands after map_Kd, behind its options."""
    words = text.split()
    wrap = "repeat"
    while words and words[0].startswith("-"):
        option = words.pop(0)
        if option == "-clamp" and words and words[0] == "on":
            wrap = "clamp"
        most = OPTION_LENGTHS.get(option, 3)
        while words and most and (option in OPTION_LENGTHS or _numbers(words[0], 1) is not None):
            words.pop(0)
            most -= 1
    name = text if not text.startswith("-") else " ".join(words)
    content = file.beside(name, "texture")
    return None if content is None else decode_texture(content, file, name, wrap=(wrap, wrap), has_alpha=False)
