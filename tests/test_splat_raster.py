"""Splats: the kernels against plain Python over all pixels, for every kind of coordinate, order and number of threads."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.raster import splats
from scanspan.raster.splats import MOST, PAD, cut_blocks, draw_splats, new_keys, pixel_matrix
from scanspan.raster.write import EMPTY_KEY, pack_key, unpack_depth, unpack_number

SIZE = (24, 17)
CAMERA = ss.Camera.look_at((0.3, 0.2, 4.0), (0, 0, 0), fov=50)
MATRIX = pixel_matrix(CAMERA.clip_matrix(SIZE), SIZE)


def draw(positions, *, size=SIZE, matrix=MATRIX, origin=(0, 0, 0), step=(1, 1, 1), radius=None, blocks=None, **options):
    """Return the keys (H, W) of splats, one map and radius for all of them."""
    blocks = cut_blocks(len(positions)) if blocks is None else blocks
    many = len(blocks)
    keys = new_keys(size)
    draw_splats(
        keys, size, np.ascontiguousarray(positions), blocks, np.tile(np.array(origin, float), (many, 1)),
        np.tile(np.array(step, float), (many, 1)), matrix[None],
        radii=None if radius is None else np.tile(np.array(radius, float), (many, 1)), **options,
    )  # fmt: skip
    return keys[:-PAD].reshape(size[1], size[0])


def expect(positions, *, matrix=MATRIX, size=SIZE, origin=(0, 0, 0), step=(1, 1, 1), radius=None, shares=None, shape="disc",
           most=MOST, has_far=False):  # fmt: skip
    """Return the same keys, worked out for one splat and one pixel after the other."""
    width, height = size
    keys = np.full((height, width), EMPTY_KEY)
    m = matrix * np.array([*step, 1.0])
    with np.errstate(all="ignore"):
        m[:, 3] = ((matrix[:, 0] * origin[0] + matrix[:, 1] * origin[1]) + matrix[:, 2] * origin[2]) + matrix[:, 3]
        for number, (x, y, z) in enumerate(np.asarray(positions).astype(np.float64)):
            raw = ((m[:, 0] * x + m[:, 1] * y) + m[:, 2] * z) + m[:, 3]
            inverse = 1.0 / raw[3]
            u, v, depth = raw[:3] * inverse
            if not (raw[3] > 0 and depth <= 1.0 and depth >= (0.0 if has_far else -1e38) and np.isfinite([u, v]).all()):
                continue
            key = int(pack_key.py_func(np.float64(depth), number))
            share = 1.0 if shares is None else float(shares[number])
            size_of = 0.5 if radius is None else min(max(radius[0] + radius[1] * share * inverse, 0.5), most)
            for j in range(height):
                for i in range(width):
                    dx, dy = i - (u - 0.5), j - (v - 0.5)
                    covered = i == np.floor(u) and j == np.floor(v)
                    if size_of > 0.5 and shape == "disc":
                        covered |= dx * dx <= size_of * size_of - dy * dy
                    elif size_of > 0.5:
                        covered |= -size_of < dx <= size_of and -size_of < dy <= size_of
                    if covered:
                        keys[j, i] = max(keys[j, i], key)
    return keys


def scatter(count, seed=0):
    """Return points about the view: most in it, some beside, some behind the eye."""
    return np.random.default_rng(seed).normal(size=(count, 3)) * (1.5, 1.5, 2.0)


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int32, np.uint16, np.uint8])
def test_points_of_every_type_agree_with_the_oracle(dtype):
    points, origin, step = scatter(300), (0, 0, 0), (1, 1, 1)
    if np.dtype(dtype).kind != "f":
        low = points.min(axis=0)
        top = min(np.iinfo(dtype).max, 1_000_000)
        step = np.ptp(points, axis=0) / top
        points, origin = np.rint((points - low) / step), low
    points = points.astype(dtype)
    found = draw(points, origin=origin, step=step)
    assert np.array_equal(found, expect(points, origin=origin, step=step))
    assert (found != EMPTY_KEY).sum() > 100


@pytest.mark.parametrize("shape", ["disc", "square"])
@pytest.mark.parametrize(
    "radius", [(0.3, 0), (0.7, 0), (1.0, 0), (1.49, 0), (2.2, 0), (6.0, 0), (0, 4.0), (0.5, 9.0), (90.0, 0)]
)
def test_splats_of_every_size_agree_with_the_oracle(shape, radius):
    points = scatter(60, seed=1)
    assert np.array_equal(draw(points, radius=radius, shape=shape), expect(points, radius=radius, shape=shape))


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_each_splat_may_have_its_share_of_the_radius(dtype):
    points = scatter(60, seed=2)
    shares = (np.random.default_rng(3).random(60) * 200).astype(dtype)
    radius = (0.2, 0.08)
    assert np.array_equal(draw(points, radius=radius, shares=shares), expect(points, radius=radius, shares=shares))


def test_radii_are_held_to_the_largest():
    points = scatter(40, seed=4)
    assert np.array_equal(draw(points, radius=(50.0, 0), most=2.0), draw(points, radius=(2.0, 0)))


def test_what_lies_beyond_the_far_plane_is_left_out_where_there_is_one():
    matrix = pixel_matrix(ss.Camera.look_at((0, 0, 4), (0, 0, 0), near=3.0, far=5.0).clip_matrix(SIZE), SIZE)
    points = [(0, 0, 1.5), (0.5, 0, 0), (-0.5, 0, -1.5)]
    seen = {far: sorted(np.unique(draw(points, matrix=matrix, has_far=far))[1:]) for far in (False, True)}
    assert [int(unpack_number.py_func(k)) for k in seen[True]] == [1]
    assert sorted(int(unpack_number.py_func(k)) for k in seen[False]) == [1, 2]
    assert np.array_equal(draw(points, matrix=matrix, has_far=True), expect(points, matrix=matrix, has_far=True))


@pytest.mark.parametrize("radius", [None, (1.2, 0), (0, 3.0)])
def test_bad_and_far_coordinates_are_dropped_and_nothing_wraps(radius):
    big = [0.0, 1.0, 1e-320, 1e9, 1e30, 1e200, np.finfo(float).max, np.inf, np.nan]
    values = [s * x for x in big for s in (1.0, -1.0)]
    points = np.array([(x, y, z) for x in values for y in (0.0, values[7], 1e300, np.nan) for z in values])
    assert np.array_equal(draw(points, radius=radius), expect(points, radius=radius))


def test_points_at_the_border_are_in_the_pixel_that_begins_there():
    width, height = SIZE
    camera = ss.Camera.orthographic((width / 2, height / 2, 5), (width / 2, height / 2, 0), height=height)
    matrix = pixel_matrix(camera.clip_matrix(SIZE), SIZE)
    inside = [(0, height, 0), (width - 1, 1, 0), (3, 7, 0), (0, 1, 0)]
    outside = [(width, 4, 0), (-1, 4, 0), (3, 0, 0), (3, height + 1, 0), (width, 0, 0)]
    found = draw(inside + outside, matrix=matrix)
    assert np.argwhere(found != EMPTY_KEY).tolist() == [[0, 0], [10, 3], [16, 0], [16, 23]]


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 3)])
@pytest.mark.parametrize("shape", ["disc", "square"])
def test_the_smallest_images(size, shape):
    matrix, points = pixel_matrix(CAMERA.clip_matrix(size), size), scatter(50, seed=5)
    for radius in (None, (0.8, 0), (1.3, 0), (4.0, 0)):
        options = {"matrix": matrix, "size": size, "radius": radius, "shape": shape}
        assert np.array_equal(draw(points, **options), expect(points, **options))


def test_nothing_is_written_for_no_splats():
    assert (draw(np.empty((0, 3))) == EMPTY_KEY).all()


@pytest.mark.parametrize("radius", [None, (0, 6.0)])
def test_any_order_of_blocks_and_any_number_of_threads_give_the_same_keys(radius, monkeypatch):
    monkeypatch.setattr(splats, "SHARED", 0)
    monkeypatch.setattr(splats, "BLOCKS", 3)
    points = np.round(scatter(5000, seed=6), 1)  # many at the same place, where the lower number wins
    starts = np.arange(0, 5000, 100)
    blocks = np.stack([starts, np.full(50, 100), starts, np.zeros(50, int)], axis=1)
    whole = draw(points, radius=radius)
    for seed, threads in enumerate((1, 2, 3, 7)):
        mixed = np.random.default_rng(seed).permutation(blocks)
        assert np.array_equal(draw(points, radius=radius, blocks=mixed, threads=threads), whole)


def test_numbers_and_rows_of_blocks_are_kept():
    points = np.array([(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0)], np.float32)
    blocks = np.array([[1, 2, 2**32 - 2, 0], [0, 1, 77, 0]])
    found = np.unique(draw(points, blocks=blocks))[1:]
    assert sorted(int(unpack_number.py_func(k)) for k in found) == [77, 2**32 - 2, 2**32 - 1]


def test_each_block_may_have_a_matrix_of_its_own():
    points, shift = scatter(20, seed=7), np.eye(4)
    shift[:3, 3] = 0.4, -0.2, 0.1
    matrices = np.stack([MATRIX, pixel_matrix(CAMERA.clip_matrix(SIZE) @ shift, SIZE)])
    blocks, keys = np.array([[0, 20, 0, 0], [0, 20, 20, 1]]), new_keys(SIZE)
    draw_splats(keys, SIZE, points, blocks, np.zeros((2, 3)), np.ones((2, 3)), matrices)
    later = expect(points, matrix=matrices[1])
    later[later != EMPTY_KEY] -= 20
    assert np.array_equal(keys[:-PAD].reshape(SIZE[1], SIZE[0]), np.maximum(expect(points), later))


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_point_on_a_face_has_the_depth_of_the_face(orthographic):
    place, size = {"eye": (0.3, 0.2, 4.0), "target": (0, 0, 0)}, (64, 48)
    camera = ss.Camera.orthographic(**place, height=3) if orthographic else ss.Camera.look_at(**place, fov=50)
    clip = camera.clip_matrix(size)

    def to_world(x, y, z):
        """Return the place in the world of places on the screen."""
        screen = np.column_stack([x / size[0] * 2 - 1, 1 - y / size[1] * 2, z, np.ones(len(x))])
        world = screen @ np.linalg.inv(clip).T
        return world[:, :3] / world[:, 3:]

    # Take a face whose corners need not be snapped.
    far = np.array([0.2, 0.6, 0.8]) if orthographic else np.array([0.995, 0.998, 0.9991])
    corners = to_world(np.array([3.25, 60.5, 20.0]), np.array([4.0, 11.75, 45.5]), far)
    seen = ss.rasterize(np.column_stack([corners, np.ones(3)]) @ clip.T, [(0, 1, 2)], size)
    rows, columns = np.nonzero(seen.primitive == 0)
    assert len(rows) > 900

    # Put a point on the face at each pixel's centre: where the ray through it meets the plane.
    near, beyond = (to_world(columns + 0.5, rows + 0.5, np.full(len(rows), z)) for z in (-1.0, 0.5))
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    share = ((corners[0] - near) @ normal) / ((beyond - near) @ normal)
    points = near + share[:, None] * (beyond - near)

    found = draw(points, size=size, matrix=pixel_matrix(clip, size))[rows, columns]
    depth = np.array([unpack_depth.py_func(key) for key in found])
    assert (np.array([unpack_number.py_func(key) for key in found]) == np.arange(len(rows))).all()
    assert np.abs(depth.view(np.int32).astype(int) - seen.depth[rows, columns].view(np.int32)).max() <= 1


def test_the_kernels_run_the_same_as_plain_python():
    points, radii = scatter(30, seed=8), np.array([[0.4, 3.0]])
    blocks, shares = cut_blocks(30), np.empty(0, np.uint8)
    shared = (SIZE[0], SIZE[1], -1e38, points.reshape(-1), blocks, np.zeros((1, 3)), np.ones((1, 3)), MATRIX[None])
    for kernel, rest in ((splats.write_points, ()), (splats.write_splats, (shares, radii, 9.0, True))):
        both = [new_keys(SIZE), new_keys(SIZE)]
        kernel(both[0], *shared, *splats.make_room(), *rest)
        with np.errstate(all="ignore"):
            kernel.py_func(both[1], *shared, *splats.make_room(), *rest)
        assert np.array_equal(*both)
