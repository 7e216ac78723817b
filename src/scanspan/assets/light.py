"""Lights of a scene: what shines, from where, how brightly, and on which instances.

A light is kept in the world, as plain numbers; a scene has any number of them. What they do to a surface is in shade/lamps.py.

Source: Wernecke, The Inventor Mentor, chapter 4; the OpenGL 1.x specification, section "Lighting", whose numbers these are.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scanspan.assets.material import as_base_color
from scanspan.errors import InputError, unknown_name
from scanspan.homogeneous import finite_array, finite_number, quote, unit

KINDS = {
    "directional": "from far away, the same everywhere",
    "point": "from a place, to all sides",
    "spot": "from a place, within a cone",
    "ambient": "from all round, whatever way a surface turns",
}

MAX_DROP_OFF = 128  # exponents of OpenGL and Inventor end there
STRONGEST = 1e6  # of an intensity


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Light:
    """A light in the world.

    Parameters
    ----------
    kind : "directional", "point", "spot" or "ambient".
    color : (r, g, b), sRGB floats 0..1.
    intensity : factor of the colour's light, 0 or more.
    position : (3,) of a point or spot light.
    direction : (3,) in which a directional or a spot light shines, of any length.
    attenuation : (constant, linear, quadratic), 0 or more: at a distance d, a point or spot light is divided by
        constant + linear d + quadratic d^2; where all are 0, by 1.
    cutoff_angle : degrees between the axis and the rim of a spot light's cone, 0 to 180.
    drop_off : exponent of the cosine to the axis of a spot light, a whole number from 0 to 128; 0 is even light.
    instances : the numbers of the instances that it shines on; None for all.

    Raises
    ------
    InputError : an unknown kind, or a number that cannot be used.

    Examples
    --------
    >>> Light("point", position=(0, 2, 0), intensity=0.5)
    Light('point', intensity 0.5)
    """

    kind: str
    color: tuple[float, float, float]
    intensity: float
    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    attenuation: NDArray[np.float64]
    cutoff_angle: float
    drop_off: int
    instances: NDArray[np.int64] | None

    def __init__(
        self,
        kind: str,
        color: ArrayLike = (1.0, 1.0, 1.0),
        intensity: float = 1.0,
        *,
        position: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike = (0.0, 0.0, -1.0),
        attenuation: ArrayLike = (1.0, 0.0, 0.0),
        cutoff_angle: float = 45.0,
        drop_off: int = 0,
        instances: Iterable[int] | None = None,
    ) -> None:
        if not isinstance(kind, str) or kind not in KINDS:
            raise unknown_name("kind of light", kind, KINDS)
        shares = finite_array("attenuation", attenuation, (3,))
        if (shares < 0.0).any():
            raise InputError(f"attenuation = {tuple(shares.tolist())}: expected numbers from 0 on")
        if isinstance(drop_off, bool) or not isinstance(drop_off, (int, np.integer)) or not 0 <= drop_off <= MAX_DROP_OFF:
            raise InputError(f"drop_off = {drop_off!r}: expected a whole number from 0 to {MAX_DROP_OFF}")
        way = finite_array("direction", direction, (3,))
        if not way.any():
            raise InputError("direction = (0, 0, 0): expected a direction")
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "color", as_base_color(color, "color")[:3])
        object.__setattr__(self, "intensity", _within("intensity", intensity, STRONGEST))
        object.__setattr__(self, "position", finite_array("position", position, (3,)).copy())
        object.__setattr__(self, "direction", unit(way))
        object.__setattr__(self, "attenuation", shares.copy())
        object.__setattr__(self, "cutoff_angle", _within("cutoff_angle", cutoff_angle, 180.0))
        object.__setattr__(self, "drop_off", int(drop_off))
        object.__setattr__(self, "instances", None if instances is None else as_numbers(instances))

    def __repr__(self) -> str:
        return f"Light({self.kind!r}, intensity {self.intensity:g})"


def _within(name: str, value: float, highest: float) -> float:
    """Return a number from 0 to the highest."""
    number = finite_number(name, value)
    if not 0.0 <= number <= highest:
        raise InputError(f"{name} = {value!r}: expected a number from 0 to {highest:g}")
    return number


def as_numbers(instances: Iterable[int]) -> NDArray[np.int64]:
    """Return numbers of instances, (n,) int64, each once and in order."""
    try:
        numbers = np.asarray(instances if isinstance(instances, np.ndarray) else list(instances))
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if numbers.size and (numbers.ndim != 1 or numbers.dtype.kind not in "iu" or int(numbers.min()) < 0):
        raise InputError(f"instances = {quote(instances)}: expected whole numbers from 0 on")
    return np.unique(numbers.astype(np.int64))
