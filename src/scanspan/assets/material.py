"""Material and texture: the colour of a surface before light falls on it.

Colours are sRGB with straight alpha, as they stand in picture files and style sheets. Row 0 of a texture is the top of the
picture; texture coordinates have their origin bottom-left, so (0, 1) is the picture's top-left corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.arrays import as_array, in_layout
from scanspan.errors import InputError, LimitError, unknown_name
from scanspan.homogeneous import finite_number

FILTERS = ("bilinear", "nearest")
WRAPS = ("repeat", "clamp", "mirror")

# What is shown where nothing is said: warm against the cool background, and light enough to keep its shading.
CLAY = (0.90, 0.80, 0.66, 1.0)
WHITE = (1.0, 1.0, 1.0, 1.0)

MAX_TEXTURE_PIXELS = 2**26
"""Pixels of a texture: 8192 x 8192, which take 256 MiB."""


def linear_to_srgb(values: ArrayLike) -> NDArray[np.float64]:
    """Encode linear light 0..1 as sRGB 0..1; values outside are cut off. Source: IEC 61966-2-1.

    Twelve decimals are kept, so that powers which differ in the last bit from machine to machine give the same colour.

    >>> linear_to_srgb([0.0, 0.5, 1.0]).round(4).tolist()
    [0.0, 0.7354, 1.0]
    """
    light = np.clip(np.asarray(values, dtype=np.float64), 0.0, 1.0)
    curve = 1.055 * np.maximum(light, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.asarray(np.round(np.where(light <= 0.0031308, 12.92 * light, curve), 12), dtype=np.float64)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Texture:
    """A picture that colours a surface.

    Parameters
    ----------
    image : (h, w), (h, w, 3) or (h, w, 4), integers 0..255 or floats 0..1, sRGB, straight alpha; kept as (h, w, 4) uint8.
    filter : "bilinear" or "nearest".
    wrap : what happens outside 0..1 along u and along v: "repeat", "clamp" or "mirror", one name for both or two.
    max_pixels : largest number of pixels.

    Raises
    ------
    InputError : a shape, a type, a value or a name that cannot be used.
    LimitError : more pixels than `max_pixels`.

    Examples
    --------
    >>> Texture([[0, 255], [255, 0]], filter="nearest")
    Texture(2 x 2, nearest, repeat)
    """

    image: NDArray[np.uint8]
    filter: str
    wrap: tuple[str, str]

    def __init__(
        self,
        image: ArrayLike,
        filter: str = "bilinear",
        wrap: str | Sequence[str] = "repeat",
        *,
        max_pixels: int = MAX_TEXTURE_PIXELS,
    ) -> None:
        if filter not in FILTERS:
            raise unknown_name("texture filter", filter, FILTERS)
        pair = (wrap, wrap) if isinstance(wrap, str) else tuple(wrap)
        if len(pair) != 2:
            raise InputError(f"wrap: expected one name or two, for u and v, got {wrap!r}")
        for name in pair:
            if name not in WRAPS:
                raise unknown_name("texture wrap", name, WRAPS)
        object.__setattr__(self, "image", _as_image(image, max_pixels))
        object.__setattr__(self, "filter", filter)
        object.__setattr__(self, "wrap", (pair[0], pair[1]))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.image.shape[1], self.image.shape[0]

    @cached_property
    def is_opaque(self) -> bool:
        """Whether no pixel has an alpha below 1."""
        return bool((self.image[..., 3] == 255).all())

    def __repr__(self) -> str:
        wraps = self.wrap[0] if self.wrap[0] == self.wrap[1] else f"{self.wrap[0]}/{self.wrap[1]}"
        return f"Texture({self.size[0]} x {self.size[1]}, {self.filter}, {wraps})"


def _as_image(image: ArrayLike, max_pixels: int) -> NDArray[np.uint8]:
    """Return a picture as (h, w, 4) uint8."""
    pixels = as_array(image, "image")
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or 0 in pixels.shape:
        raise InputError(f"image: expected shape (h, w), (h, w, 3) or (h, w, 4), none of them 0, got {pixels.shape}")
    height, width = pixels.shape[:2]
    if height * width > max_pixels:
        raise LimitError(f"image: {width} x {height} pixels are more than the limit of {max_pixels} (max_pixels)")

    # Bring floats 0..1 and integers 0..255 to bytes.
    highest = 1 if pixels.dtype.kind == "f" else 255
    if pixels.dtype.kind == "b" or (pixels.dtype != np.uint8 and not ((pixels >= 0) & (pixels <= highest)).all()):
        raise InputError("image: expected integers 0..255 or floats 0..1")
    if pixels.dtype.kind == "f":
        pixels = np.rint(pixels * 255.0)
    if pixels.shape[2] == 3:
        pixels = np.concatenate([pixels, np.full((height, width, 1), 255, dtype=pixels.dtype)], axis=2)
    checked: NDArray[np.uint8] = in_layout(pixels, np.uint8)
    return checked


@dataclass(frozen=True, eq=False)
class Material:
    """The base colour of a surface.

    Parameters
    ----------
    name : any text.
    base_color : (r, g, b) or (r, g, b, a), sRGB floats 0..1, straight alpha. It multiplies the texture and the mesh's own
        colours. None, where nothing is said: white with a texture or colours, else the colour of clay.
    texture : a picture looked up at the mesh's "uv".
    double_sided : False where the file says that only the front is to be seen.
    emissive_color : (r, g, b), sRGB floats 0..1, that the surface adds to the light it sends back; None for none.
    is_lit : False for a surface that shows its base colour whatever the light.
    ambient_color : (r, g, b), sRGB floats 0..1: what it sends back of a scene's ambient light; None for the base colour.
    specular_color : (r, g, b), sRGB floats 0..1, of its highlight under a scene's own lights; None for none.
    shininess : 0..1, how narrow that highlight is; 128 times as much is its exponent, rounded.

    Raises
    ------
    InputError : a colour that is not three or four numbers 0..1, or a texture that is not a Texture.

    Examples
    --------
    >>> Material("brass", (0.8, 0.6, 0.2)).base_color
    (0.8, 0.6, 0.2, 1.0)
    """

    name: str = ""
    base_color: tuple[float, float, float, float] | None = None
    texture: Texture | None = None
    double_sided: bool = True
    emissive_color: tuple[float, float, float] | None = None
    is_lit: bool = True
    ambient_color: tuple[float, float, float] | None = None
    specular_color: tuple[float, float, float] | None = None
    shininess: float = 0.2

    def __post_init__(self) -> None:
        if self.base_color is not None:
            object.__setattr__(self, "base_color", as_base_color(self.base_color))
        if self.texture is not None and not isinstance(self.texture, Texture):
            raise InputError(f"texture: expected a Texture or None, got {type(self.texture).__name__}")
        if not isinstance(self.name, str):
            raise InputError(f"name: expected text, got {self.name!r}")
        for name in ("emissive_color", "ambient_color", "specular_color"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, as_base_color(getattr(self, name), name)[:3])
        shininess = finite_number("shininess", self.shininess)
        if not 0.0 <= shininess <= 1.0:
            raise InputError(f"shininess = {self.shininess!r}: expected a number 0..1")
        object.__setattr__(self, "shininess", shininess)
        object.__setattr__(self, "double_sided", bool(self.double_sided))
        object.__setattr__(self, "is_lit", bool(self.is_lit))

    def color_of(self, has_colors: bool) -> tuple[float, float, float, float]:
        """Return the base colour that is shown on a geometry that has colours of its own, or has none."""
        if self.base_color is not None:
            return self.base_color
        return WHITE if has_colors or self.texture is not None else CLAY


def as_base_color(value: ArrayLike, name: str = "base_color") -> tuple[float, float, float, float]:
    """Return a base colour as four floats 0..1."""
    values = as_array(value, name)
    if values.shape not in ((3,), (4,)) or values.dtype.kind == "b":
        raise InputError(f"{name}: expected three or four floats 0..1, got {str(value)[:60]}")
    numbers = [float(number) for number in values.tolist()]
    if not all(0.0 <= number <= 1.0 for number in numbers):
        raise InputError(f"{name} = {tuple(numbers)}: expected floats 0..1")
    return numbers[0], numbers[1], numbers[2], numbers[3] if len(numbers) == 4 else 1.0
