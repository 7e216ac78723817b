"""Linear light, XYZ, Lab and white points: against exact decimals and published numbers."""

from __future__ import annotations

import ast
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanspan import color
from scanspan.color.transfer import HALF_WAY, codes_from_linear, cube_root

Array = npt.NDArray[Any]


# The curve, and roots


def exact_code(light: float) -> Decimal:
    """Return the sRGB value of light above the knee to forty digits."""
    with localcontext() as context:
        context.prec = 40
        return Decimal("1.055") * Decimal(light) ** (Decimal(5) / 12) - Decimal("0.055")


def test_encoding_is_exact_to_fifteen_digits() -> None:
    light = np.concatenate([np.geomspace(0.00314, 1.0, 300), [0.5, 0.2, 7.5, 1e30]])
    encoded = color.linear_to_srgb(light)
    assert max(abs(Decimal(float(e)) / exact_code(float(x)) - 1) for e, x in zip(encoded, light)) < Decimal("1e-15")
    assert color.linear_to_srgb([0.0, 1.0, 0.001]).tolist() == [0, 1, 0.001 * 12.92]
    assert np.array_equal(color.linear_to_srgb(-light), -encoded)


def test_every_code_comes_back() -> None:
    codes = np.arange(256, dtype=np.uint8)
    light = color.srgb_to_linear(codes)
    assert np.array_equal(light, color.srgb_to_linear(codes / 255))
    assert np.array_equal(light, color.srgb_to_linear(codes.astype(np.int64)))
    assert np.array_equal(color.to_uint8(color.linear_to_srgb(light)), codes)
    assert np.array_equal(codes_from_linear(light), codes)
    assert np.array_equal(codes_from_linear(HALF_WAY), codes[1:])
    assert np.array_equal(codes_from_linear(np.nextafter(HALF_WAY, 0.0)), codes[:-1])
    assert codes_from_linear(np.array([-1.0, 1.0, 7.0])).tolist() == [0, 255, 255]


@given(st.floats(0.0, 1.0))
@settings(max_examples=300, deadline=None)
def test_encoded_values_come_back_across_the_knee(value: float) -> None:
    for near in (value, float(np.nextafter(0.04045, 1.0)), float(np.nextafter(0.04045, 0.0))):
        assert abs(color.linear_to_srgb(color.srgb_to_linear(near)) - near) < 1e-15


def test_cube_roots_are_right_to_two_units_in_the_last_place() -> None:
    values = np.concatenate([np.geomspace(1e-300, 1e300, 2001), np.arange(1.0, 30.0), [5e-324]])
    roots = cube_root(values)
    with localcontext() as context:
        context.prec = 40
        exact = [Decimal(x) ** (Decimal(1) / 3) for x in values.tolist()]
        worst = max(abs(Decimal(r) - e) / Decimal(float(np.spacing(r))) for r, e in zip(roots.tolist(), exact))
    assert worst < 2
    assert cube_root([0.0, 8.0, 27.0]).tolist() == [0, 2, 3]


def test_nothing_calls_a_power_or_a_sine_of_a_library() -> None:
    calls = {
        "pow",
        "power",
        "float_power",
        "exp",
        "log",
        "sin",
        "cos",
        "tan",
        "arctan",
        "arctan2",
        "atan",
        "atan2",
        "acos",
        "cbrt",
    }
    for path in sorted(Path(color.__file__).parent.glob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        found = {
            node.func.attr for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        }
        powers = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)]
        assert not found & calls, path.name
        assert all("Decimal" in power for power in powers), path.name
        assert not any(isinstance(node, ast.MatMult) for node in ast.walk(tree)), path.name


# XYZ, Lab and whites


def test_white_points_are_those_of_the_cie() -> None:
    expected = {
        color.A: (1.09850, 1, 0.35585), color.C: (0.98074, 1, 1.18232), color.D50: (0.96422, 1, 0.82521),
        color.D65: (0.95047, 1, 1.08883), color.E: (1, 1, 1),
    }  # fmt: skip
    for white, xyz in expected.items():
        assert np.abs(color.white_xyz(white) - xyz).max() < 3e-4
    assert color.white_xyz((0.5, 0.25, 1.0)).tolist() == [2, 1, 4]


def test_matrices_are_the_published_ones() -> None:
    css = [
        [0.41239079926595934, 0.357584339383878, 0.1804807884018343],
        [0.21263900587151027, 0.715168678767756, 0.07219231536073371],
        [0.01933081871559182, 0.11919477979462598, 0.9505321522496607],
    ]
    assert np.abs(color.linear_to_xyz(np.eye(3)).T - css).max() < 1e-15
    lindbloom = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    assert np.abs(color.primaries_matrix(color.SRGB_PRIMARIES, (0.95047, 1, 1.08883)) - lindbloom).max() < 1e-7
    back = [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
    assert np.abs(color.xyz_to_linear(np.eye(3)).T - back).max() < 6e-4
    assert np.abs(color.xyz_to_linear(np.eye(3)).T - np.linalg.inv(css)).max() < 1e-14


def test_lab_has_the_published_values() -> None:
    codes = np.array([[255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [0, 0, 0]], dtype=np.uint8)
    expected = [[100, 0, 0], [53.24, 80.09, 67.20], [87.73, -86.18, 83.18], [32.30, 79.19, -107.86], [0, 0, 0]]
    assert np.abs(color.rgb_to_lab(codes) - expected).max() < 0.012
    assert np.abs(color.rgb_to_lab((1.0, 1.0, 1.0)) - [100, 0, 0]).max() < 1e-12
    assert np.array_equal(color.lab_to_xyz((50, 0, 0)), color.lab_to_xyz((50.0, 0.0, 0.0)))
    # The line and the cube root meet at (6/29)^3, L = 8.
    knee = (6 / 29) ** 3
    lightness = color.xyz_to_lab(np.array([[knee] * 3, [knee * (1 + 1e-12)] * 3]), color.E)[:, 0]
    assert np.abs(lightness - 8).max() < 1e-9


@pytest.mark.parametrize("name", ["xyz", "lab"])
def test_other_libraries_agree(name: str) -> None:
    skimage = pytest.importorskip("skimage.color")
    colors = np.random.default_rng(4).random((100, 3))
    theirs = {"xyz": skimage.rgb2xyz, "lab": skimage.rgb2lab}[name](colors)
    ours = {"xyz": color.rgb_to_xyz, "lab": color.rgb_to_lab}[name](colors)
    assert np.abs(ours - theirs).max() < {"xyz": 1e-3, "lab": 0.05}[name]


def test_colour_science_agrees() -> None:
    # Importing it changes how NumPy prints arrays.
    with np.printoptions():
        theirs = pytest.importorskip("colour")
    colors = np.random.default_rng(4).random((100, 3))
    assert np.abs(color.rgb_to_hsv(colors) - theirs.RGB_to_HSV(colors)).max() < 1e-12
    assert np.abs(color.rgb_to_xyz(colors) - theirs.sRGB_to_XYZ(colors)).max() < 1e-3
