"""Textures: a plain model in float64 as oracle, the borders of every wrap mode, and coordinates that are no coordinates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from scanspan.shade import texture as module
from scanspan.shade.color import LINEAR_FROM_SRGB8
from scanspan.shade.texture import BILINEAR, CLAMP, MIRROR, NEAREST, REPEAT, sample_texture

Array = npt.NDArray[Any]
WRAPS = (REPEAT, CLAMP, MIRROR)


def sampled(
    texture: Array, uv: Any, filter_kind: int, wrap_u: int, wrap_v: int | None = None, kernel: Any = sample_texture
) -> Array:
    """Sample through the kernel."""
    places = np.array(uv, dtype=np.float64).reshape(-1, 2)
    out = np.full((len(places), 4), np.nan, dtype=np.float32)
    kernel(texture, places, filter_kind, wrap_u, wrap_u if wrap_v is None else wrap_v, LINEAR_FROM_SRGB8, out)
    return out


def texel(index: int, count: int, wrap: int) -> int:
    """Return the texel that an index of any size stands for."""
    if wrap == REPEAT:
        return index % count
    if wrap == CLAMP:
        return min(max(index, 0), count - 1)
    turned = index % (2 * count)
    return turned if turned < count else 2 * count - 1 - turned


def plain_model(texture: Array, u: float, v: float, filter_kind: int, wrap: int) -> Array:
    """Look up one place in float64: the picture bottom up, texels premultiplied."""
    light = np.concatenate([LINEAR_FROM_SRGB8[texture[::-1, :, :3]].astype(float), texture[::-1, :, 3:] / 255.0], axis=2)
    height, width = light.shape[:2]
    x, y = u * width, v * height
    if filter_kind == NEAREST:
        return light[texel(math.floor(y), height, wrap), texel(math.floor(x), width, wrap)]
    x, y = x - 0.5, y - 0.5
    total = np.zeros(4)
    for j in (0, 1):
        for i in (0, 1):
            weight = abs(1 - i - (x - math.floor(x))) * abs(1 - j - (y - math.floor(y)))
            color = light[texel(math.floor(y) + j, height, wrap), texel(math.floor(x) + i, width, wrap)]
            total += weight * np.append(color[:3] * color[3], color[3])
    return np.append(total[:3] / total[3] if total[3] > 0 else np.zeros(3), total[3])


@pytest.fixture
def picture(rng: np.random.Generator) -> Array:
    """Give a small picture of noise, not square, with alpha."""
    return rng.integers(0, 256, (5, 7, 4)).astype(np.uint8)


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("filter_kind", [BILINEAR, NEAREST])
def test_the_kernel_is_the_plain_model(picture: Array, filter_kind: int, wrap: int, rng: np.random.Generator) -> None:
    places = rng.uniform(-3, 4, (400, 2))
    expected = [plain_model(picture, u, v, filter_kind, wrap) for u, v in places]
    assert np.abs(sampled(picture, places, filter_kind, wrap) - expected).max() < 1e-5


def test_row_zero_is_the_top_and_v_points_up() -> None:
    corners = np.array([[[10, 0, 0, 255], [20, 0, 0, 255]], [[30, 0, 0, 255], [40, 0, 0, 255]]], dtype=np.uint8)
    found = sampled(corners, [(0.25, 0.75), (0.75, 0.75), (0.25, 0.25), (0.75, 0.25)], NEAREST, REPEAT)[:, 0]
    assert np.array_equal(found, LINEAR_FROM_SRGB8[[10, 20, 30, 40]])


@pytest.mark.parametrize("filter_kind", [BILINEAR, NEAREST])
@pytest.mark.parametrize("wrap", WRAPS)
def test_a_texel_s_centre_is_exactly_its_colour(picture: Array, filter_kind: int, wrap: int) -> None:
    opaque = np.concatenate([picture[:4, :4, :3], np.full((4, 4, 1), 255, dtype=np.uint8)], axis=2)
    rows, columns = np.mgrid[0:4, 0:4]
    places = np.stack([(columns + 0.5) / 4, 1 - (rows + 0.5) / 4], axis=-1)
    assert np.array_equal(sampled(opaque, places, filter_kind, wrap)[:, :3], LINEAR_FROM_SRGB8[opaque[..., :3]].reshape(-1, 3))


def test_one_colour_stays_exactly_that_colour(rng: np.random.Generator) -> None:
    plain = np.full((6, 9, 4), (12, 200, 77, 255), dtype=np.uint8)
    for wrap in WRAPS:
        found = sampled(plain, rng.uniform(-5, 5, (500, 2)), BILINEAR, wrap)
        assert (found == np.append(LINEAR_FROM_SRGB8[[12, 200, 77]], 1).astype(np.float32)).all()


@pytest.mark.parametrize(
    ("wrap", "u", "column"),
    [
        (REPEAT, 0.0, 0), (REPEAT, 1.0, 0), (REPEAT, -1e-20, 3), (REPEAT, np.nextafter(1, 0), 3), (REPEAT, 0.25, 1),
        (REPEAT, np.nextafter(0.25, 0), 0), (REPEAT, -0.25, 3), (REPEAT, 5.5, 2),
        (CLAMP, -7.0, 0), (CLAMP, 1.0, 3), (CLAMP, 9.0, 3), (CLAMP, np.inf, 3), (CLAMP, -np.inf, 0),
        (MIRROR, 1.0, 3), (MIRROR, 1.1, 3), (MIRROR, 1.9, 0), (MIRROR, 2.0, 0), (MIRROR, -0.1, 0), (MIRROR, -0.9, 3),
        (MIRROR, -1e-20, 0),
    ],
)  # fmt: skip
def test_borders(wrap: int, u: float, column: int) -> None:
    row = np.zeros((1, 4, 4), dtype=np.uint8)
    row[0, :, 0], row[0, :, 3] = [10, 20, 30, 40], 255
    assert sampled(row, [(u, 0.5)], NEAREST, wrap)[0, 0] == LINEAR_FROM_SRGB8[row[0, column, 0]]
    high = row.transpose(1, 0, 2)[::-1].copy()
    assert sampled(high, [(0.5, u)], NEAREST, wrap)[0, 0] == LINEAR_FROM_SRGB8[row[0, column, 0]]


def test_the_wrap_of_u_is_not_the_wrap_of_v(picture: Array) -> None:
    assert np.array_equal(
        sampled(picture, [(1.3, 1.3)], NEAREST, REPEAT, CLAMP), sampled(picture, [(0.3, 0.999)], NEAREST, REPEAT)
    )


@pytest.mark.parametrize("filter_kind", [BILINEAR, NEAREST])
@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 3), (2, 1)])
def test_no_coordinate_leads_out_of_the_picture(
    filter_kind: int, wrap: int, shape: tuple[int, int], rng: np.random.Generator
) -> None:
    small = rng.integers(1, 256, (*shape, 4)).astype(np.uint8)
    numbers = [0.0, -0.0, 1.0, -1.0, 1e300, -1e300, 2.0**53, 1 - 2.0**-53, -(2.0**-1074), np.nan, np.inf, -np.inf, 0.5]
    found = sampled(small, [(u, v) for u in numbers for v in numbers], filter_kind, wrap)
    assert np.isfinite(found).all()
    assert (found[:, 3] > 0).all()
    light = np.sort(LINEAR_FROM_SRGB8[small[..., :3]].reshape(-1, 3), axis=0)
    assert (found[:, :3] >= light[0] * 0.999).all()
    assert (found[:, :3] <= light[-1] * 1.001).all()


def test_nan_counts_as_zero(picture: Array) -> None:
    for wrap in WRAPS:
        places = [(np.nan, np.nan), (0, 0)]
        assert np.array_equal(*sampled(picture, places, NEAREST, wrap))


def test_what_is_transparent_does_not_colour_its_neighbour() -> None:
    edge = np.array([[[200, 100, 50, 255], [0, 255, 0, 0]]], dtype=np.uint8)
    found = sampled(edge, [(0.5, 0.5), (0.75, 0.5)], BILINEAR, CLAMP)
    assert np.allclose(found[0], [*LINEAR_FROM_SRGB8[[200, 100, 50]], 0.5], atol=1e-6)
    assert found[1].tolist() == [0, 0, 0, 0]


def test_float32_coordinates_are_taken_too(picture: Array) -> None:
    places = np.array([[0.25, 0.5], [0.75, 0.125]])
    out = np.empty((2, 4), dtype=np.float32)
    sample_texture(picture, places.astype(np.float32), BILINEAR, REPEAT, REPEAT, LINEAR_FROM_SRGB8, out)
    assert np.array_equal(out, sampled(picture, places, BILINEAR, REPEAT))


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("filter_kind", [BILINEAR, NEAREST])
def test_the_kernels_do_the_same_uncompiled(
    picture: Array, filter_kind: int, wrap: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = np.concatenate([rng.uniform(-3, 4, (40, 2)), [(0, 1), (1, 0)]])
    expected = sampled(picture, places, filter_kind, wrap)
    for name, function in vars(module).copy().items():
        if hasattr(function, "py_func"):
            monkeypatch.setattr(module, name, function.py_func)
    assert np.array_equal(sampled(picture, places, filter_kind, wrap, kernel=module.sample_texture), expected)
