"""Pictures of point clouds: fields, sizes, shapes, colours, lighting, and what is said of options that cannot be used."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import scanspan as ss
from scanspan import clouds
from scanspan.assets.envelope import FEW, find_envelope
from scanspan.geometry import spacing
from scanspan.geometry.spacing import LONGEST, find_spacing
from scanspan.raster import splats
from scanspan.raster.splat_sums import DEEP, blend_splats
from scanspan.raster.write import EMPTY_KEY, unpack_depth
from scanspan.shade import cloud_colors
from scanspan.shade.eyedome import DISTANCES, HALF, WEIGHT, eye_dome
from scanspan.target.cloud_frame import CloudFrame

SIZE = (48, 32)
BLACK = {"background": "black", "eye_dome": False}


def ball(count=3000, seed=0, **columns):
    """Return a cloud on a sphere of radius 1."""
    places = np.random.default_rng(seed).normal(size=(count, 3))
    places /= np.linalg.norm(places, axis=1)[:, None]
    return ss.PointCloud(places, **columns)


def flat_camera(width=SIZE[0], height=SIZE[1]):
    """Return a camera for which x and y are pixels, y up, looking down."""
    return ss.Camera.orthographic((width / 2, height / 2, 50), (width / 2, height / 2, 0), height=height)


def test_a_frame_of_a_cloud_has_every_field():
    cloud = ball(normals=ball().positions * 3)
    frame = ss.render(cloud, "front", SIZE, samples=2)
    seen = frame.primitive >= 0
    assert isinstance(frame, CloudFrame)
    assert isinstance(frame, ss.Frame)
    assert 0.2 < seen.mean() < 0.9
    assert frame.coverage == seen.mean()
    assert frame.color.shape == (32, 48, 4)
    assert frame.color.dtype == np.uint8
    assert frame._repr_png_()[:4] == b"\x89PNG"
    assert np.array_equal(frame.position[seen], cloud.positions[frame.primitive[seen]])
    assert np.array_equal(frame.depth[seen], frame.camera.depth(frame.position[seen]).astype(np.float32))
    assert np.allclose(frame.normal[seen], frame.position[seen], atol=1e-6)
    assert np.isinf(frame.depth[~seen]).all()
    assert np.isnan(frame.position[~seen]).all()
    assert not frame.normal[~seen].any()
    assert (frame.object[seen] == 0).all()
    assert (frame.object[~seen] == -1).all()
    assert not frame.barycentric.any()
    assert np.isnan(frame.uv).all()
    assert frame.counters == {"points": 3000, "seen": len(np.unique(frame.primitive[seen]))}
    assert repr(frame) == f"CloudFrame(48 x 32, {frame.counters['seen']:,} points seen)"
    assert (frame.position[seen][:, 2] > 0).mean() > 0.9  # the far half is hidden, but where splats reach beyond the rim


def test_what_is_saved_is_the_picture_and_the_fields(tmp_path):
    frame = ss.render(ball(), "front", SIZE, samples=1)
    frame.save(tmp_path / "a.npz")
    kept = np.load(tmp_path / "a.npz")
    assert np.array_equal(kept["primitive"], frame.primitive)
    assert np.array_equal(kept["color"], frame.color)
    assert ss.render(ball(), "front", SIZE, samples=1, out=tmp_path / "a.npy") == tmp_path / "a.npy"
    assert np.array_equal(np.load(tmp_path / "a.npy"), frame.color)


@pytest.mark.parametrize("shape", ["square", "disc", "gaussian"])
def test_order_of_points_and_threads_change_nothing_but_numbers(shape, monkeypatch):
    monkeypatch.setattr(splats, "SHARED", 0)
    monkeypatch.setattr("scanspan.raster.splat_sums.SHARED", 0)
    monkeypatch.setattr(splats, "FLAT", 500)
    colors = np.random.default_rng(1).integers(0, 255, (3000, 3))
    cloud = ball(color=colors)
    first = ss.render(cloud, "iso", SIZE, point_shape=shape, threads=1, samples=2)
    shuffled = cloud.take(np.random.default_rng(2).permutation(3000))
    for other, threads in ((cloud, 3), (shuffled, 1), (shuffled, 5)):
        found = ss.render(other, "iso", SIZE, point_shape=shape, threads=threads, samples=2)
        assert np.array_equal(found.color, first.color)
        assert np.array_equal(found.position, first.position, equal_nan=True)


def test_instances_are_placed_and_numbered_through():
    one = ss.PointCloud([(1, 1, 0), (5, 1, 0)], color="red", size=3)
    move = np.eye(4)
    move[:3, 3] = 0, 10, 0
    scene = ss.Scene([one, ss.Instance(one, move), ss.PointCloud(np.zeros((0, 3)))])
    frame = ss.render(scene, flat_camera(), SIZE, samples=1, **BLACK)
    assert [int(frame.primitive[y, x]) for y, x in ((30, 1), (30, 5), (20, 1), (20, 5))] == [0, 1, 2, 3]
    assert np.unique(frame.object).tolist() == [-1, 0, 1]
    assert frame.position[20, 5].tolist() == [5, 11, 0]
    assert frame.color[30, 1].tolist() == [255, 0, 0, 255]


def test_sizes_are_pixels_the_clouds_own_or_follow_the_spacing():
    def covered(**options):
        """Return how many pixels one point in the middle of a pixel covers."""
        cloud = ss.PointCloud([(10.5, 10.5, 0)], color="white", size=options.pop("own", None))
        return int((ss.render(cloud, flat_camera(), SIZE, samples=1, **BLACK, **options).primitive == 0).sum())

    assert covered(point_size=1) == covered(point_size=0.25) == 1
    assert covered(point_size=3, point_shape="square") == 9
    assert covered(point_size=5) == 21
    assert covered(point_size=4096) == SIZE[0] * SIZE[1]
    assert covered(own=5) == 21
    assert covered(own=5, point_size=1) == 1

    grid = np.stack(np.meshgrid(np.arange(1, 47, 2.0), np.arange(1, 31, 2.0), [0.0]), axis=-1).reshape(-1, 3)
    for size in ("density", "spacing"):
        frame = ss.render(ss.PointCloud(grid), flat_camera(), SIZE, samples=1, point_size=size)
        assert (frame.primitive[3:-3, 3:-3] >= 0).all()
    assert (ss.render(ss.PointCloud(grid), flat_camera(), SIZE, samples=1, point_size=1).primitive >= 0).sum() == len(grid)


def test_a_surface_is_closed_however_its_points_lie_apart_from_any_direction():
    random = np.random.default_rng(3)
    places = random.random((20_000, 3)) * (8, 8, 0)
    places = places[random.random(len(places)) < 1 / (0.2 + places[:, 0])]  # eight times as many on one side
    cloud = ss.PointCloud(places)
    for direction in ((0, 0, 1), (1, 1, 2), (0.3, -1, 1)):
        frame = ss.render(ss.Scene(cloud, up="+Z"), ss.Camera.frame(ss.Scene(cloud, up="+Z"), direction, zoom=3), (160, 120))
        assert frame.coverage > 0.97


def test_splats_near_the_eye_do_not_fill_the_picture():
    size, near = (600, 600), ss.PointCloud([(0, 0, -0.1), (0, 0, -500), (400, 0, -500)])
    camera = ss.Camera.look_at((0, 0, 0), (0, 0, -1), near=0.01)
    for shape in ("disc", "gaussian"):
        frame = ss.render(near, camera, size, samples=1, point_shape=shape, point_size="spacing")
        wide = np.flatnonzero((frame.primitive == 0).any(axis=0))
        assert 254 <= wide[-1] - wide[0] <= 257


def test_spacing_follows_density_and_is_found_once():
    random = np.random.default_rng(4)
    places = np.concatenate([random.random((40_000, 3)) * (1, 1, 0), random.random((10_000, 3)) * (1, 1, 0) + (3, 0, 0)])
    cloud = ss.PointCloud(places, offset=(5e5, 5e6, 0))
    found = find_spacing(cloud)
    assert find_spacing(cloud) is found
    dense, sparse = (float(np.median(part) * found.typical) for part in (found.share[:40_000], found.share[40_000:]))
    assert 0.7 / 200 < dense < 2 / 200
    assert 0.7 / 100 < sparse < 2 / 100
    assert found.share.max() <= LONGEST


@pytest.mark.parametrize("places", [[(1, 2, 3)], [(1, 2, 3)] * 9, [(0, 0, 0), (1e150, 0, 0)], [(-1e150,) * 3, (1e150,) * 3],
                                    [(0, 0, 0), (1e-300, 0, 0)], [(k, 0, 0) for k in range(2000)]])  # fmt: skip
def test_spacing_of_odd_clouds_is_a_number(places):
    found = find_spacing(ss.PointCloud(np.array(places, float)))
    assert np.isfinite(found.typical)
    assert np.isfinite(found.share).all()
    assert len(found.share) == len(places)
    assert find_spacing(ss.PointCloud(np.zeros((0, 3)))).typical == 0.0


def test_large_clouds_are_counted_in_part(monkeypatch):
    cloud = ss.PointCloud(np.random.default_rng(5).random((60_000, 3)) * (1, 1, 0))
    whole = find_spacing(cloud).typical
    monkeypatch.setattr(spacing, "COUNTED", 6000)
    assert 0.5 < spacing.measure(cloud).typical / whole < 2


def test_the_envelope_holds_a_cloud_and_little_more():
    cloud = ball(FEW + 1, seed=6)
    around, places = find_envelope(cloud), cloud.positions
    assert len(around) < 100_000
    assert np.array_equal(find_envelope(cloud.take(slice(100))), places[:100])
    for axis in np.random.default_rng(7).normal(size=(20, 3)):
        reach, own = (around @ axis).max(), (places @ axis).max()
        assert own - 1e-12 <= reach <= own + 0.05 * np.abs(axis).sum()
    assert np.array_equal(around.min(axis=0), places.min(axis=0))
    assert np.array_equal(around.max(axis=0), places.max(axis=0))
    assert len(find_envelope(ss.PointCloud(np.zeros((FEW + 1, 3))))) >= 1


def test_points_are_coloured_by_what_is_asked_for():
    cloud = ss.PointCloud(
        [(k + 0.5, 0.5, k) for k in range(8)], color=[(k, 255 - k, 7) for k in range(8)], intensity=np.arange(8) * 100,
        classification=[2, 6, 2, 5, 200, 201, 203, 1], return_number=[1, 2, 3, 1, 2, 3, 1, 9],
    )  # fmt: skip

    def row(**options):
        """Return the colours of the eight points, as eight pixels."""
        return ss.render(ss.Scene(cloud, up="+Z"), flat_camera(), SIZE, samples=1, point_size=1, **BLACK, **options).color[
            31, :8
        ]

    assert np.array_equal(row()[:, :3], cloud.color)
    assert np.array_equal(row(color_by="rgb"), row())
    assert np.array_equal(row(color_by="class")[:, :3], cloud_colors.CLASS_TABLE[cloud.classification][:, :3])
    assert np.array_equal(row(color_by="return")[:, :3], cloud_colors.RETURN_TABLE[cloud.return_number][:, :3])
    grey = row(color_by="intensity")
    assert np.array_equal(grey[0, :3], cloud_colors.GREYS[0])
    assert np.array_equal(grey[7, :3], cloud_colors.GREYS[-1])
    assert (np.diff(grey[:, 0].astype(int)) > 0).all()
    high = row(color_by="elevation")
    assert np.array_equal(high[0, :3], cloud_colors.HEIGHTS[0])
    assert np.array_equal(high[7, :3], cloud_colors.HEIGHTS[-1])
    assert not np.array_equal(row(color_by="elevation", up="+X"), row(color_by="elevation", up="-X"))


def test_heights_are_those_in_the_world_and_one_scale_holds_for_all_instances():
    turn = np.array([(1, 0, 0, 0), (0, 0, -1, 2.5), (0, 1, 0, 0), (0, 0, 0, 1)], float)  # y becomes z
    cloud = ss.PointCloud([(0.5, 0, 0), (1.5, 10, 0), (2.5, 30, 0)])
    other = ss.PointCloud([(3.5, 2.5, 40)])
    scene = ss.Scene([ss.Instance(cloud, turn), other], up="+Z")
    row = ss.render(scene, flat_camera(), SIZE, samples=1, point_size=1, **BLACK).color[29, :4, :3]
    steps = [int(np.flatnonzero((color == cloud_colors.HEIGHTS).all(axis=1))[0]) for color in row]
    assert steps == [0, 64, 192, 255]


def test_a_cloud_without_colours_has_those_of_its_material():
    one = ss.Instance(ss.PointCloud([(0.5, 0.5, 0)]), material=ss.Material("", (0, 0.2, 1)))
    assert ss.render(one, flat_camera(), SIZE, samples=1, point_size=1, **BLACK).color[31, 0].tolist() == [0, 51, 255, 255]


def test_colours_may_be_translucent_and_the_background_is_kept():
    cloud = ss.PointCloud([(0.5, 0.5, 0)], color=[(255, 0, 0, 128)])
    see = {"point_size": 1, "samples": 1, "eye_dome": False}
    clear = ss.render(cloud, flat_camera(), SIZE, background="transparent", **see).color
    assert clear[31, 0].tolist() == [255, 0, 0, 128]
    assert not clear[:31].any()
    assert ss.render(cloud, flat_camera(), SIZE, background="white", **see).color[0, 0].tolist() == [255] * 4
    for shape in ("disc", "gaussian"):
        opaque = ss.PointCloud([(0.5, 0.5, 0)], color=[(10, 200, 30)])
        assert ss.render(opaque, flat_camera(), SIZE, point_shape=shape, **see).color[31, 0].tolist() == [10, 200, 30, 255]


def test_samples_smooth_the_rim_of_a_splat():
    cloud = ss.PointCloud([(20.3, 15.2, 0)], color="white")
    one, many = (ss.render(cloud, flat_camera(), SIZE, point_size=9, samples=n, **BLACK) for n in (1, 16))
    assert len(np.unique(one.color[..., 0])) == 2
    assert len(np.unique(many.color[..., 0])) > 5
    assert np.array_equal(one.primitive, many.primitive)


def test_srgb_blending_averages_codes():
    cloud = ss.PointCloud([(10.0, 10.0, 0)], color="white")
    options = {"point_size": 1, "point_shape": "square", "samples": 4, **BLACK}
    codes = {blend: ss.render(cloud, flat_camera(), SIZE, blend=blend, **options).color[..., 0] for blend in ("linear", "srgb")}
    assert 64 in codes["srgb"]
    assert 137 in codes["linear"]


def blend_oracle(places, light, radius, keys, size, matrix, towards):
    """Return the sums of `blend_splats`, one splat and pixel after the other."""
    sums = np.zeros((size[1], size[0], 5), object)
    nearest = keys[:-1].reshape(size[1], size[0])
    for place, own in zip(places, light, strict=True):
        raw = matrix @ [*place, 1.0]
        u, v, depth = raw[:3] / raw[3]
        step = towards[2] * radius
        moved = np.float32((depth + step * towards[0]) / (1 + step * towards[1]))
        for j, i in np.ndindex(size[1], size[0]):
            squared = (i + 0.5 - u) ** 2 + (j + 0.5 - v) ** 2
            if (squared <= radius**2 or (int(u), int(v)) == (i, j)) and moved >= unpack_depth.py_func(nearest[j, i]):
                weight = int(max(1 - squared / radius**2, 0.0) ** 2 * 1023) + 1
                sums[j, i] += [*(weight * int(c) for c in own), weight]
    return sums


@pytest.mark.parametrize("orthographic", [False, True])
def test_gaussian_splats_add_up_what_lies_close_behind_the_nearest(orthographic):
    random, size, radius = np.random.default_rng(8), (20, 16), 3.3
    places = random.normal(size=(40, 3)) * (1.5, 1.5, 0.3)
    places[20:, 2] -= 2  # a second layer that must not shine through
    light = random.integers(0, 65535, (40, 4)).astype(np.uint16)
    at = {"eye": (0, 0, 6), "target": (0, 0, 0)}
    camera = ss.Camera.orthographic(**at, height=6) if orthographic else ss.Camera.look_at(**at, fov=50)
    matrix, p = splats.pixel_matrix(camera.clip_matrix(size), size), camera.projection(size)
    per_unit = clouds.pixels_per_unit(camera, size)
    towards = np.array([(p[3, 2] - p[2, 2]) / 2, p[3, 2], DEEP / per_unit])
    blocks, one, keys = splats.cut_blocks(40), np.ones((1, 3)), splats.new_keys(size)
    radii = np.array([[radius, 0.0]])
    splats.draw_splats(keys, size, places, blocks, 0 * one, one, matrix[None], radii=radii)
    shared = (keys, size, places, blocks, 0 * one, one, matrix[None], light, towards)
    sums = blend_splats(*shared, radii=radii).reshape(16, 20, 5)
    assert np.array_equal(sums, blend_oracle(places, light, radius, keys, size, matrix, towards).astype(np.int64))
    assert ((sums[..., 4] > 0) == (keys[:-1].reshape(16, 20) != EMPTY_KEY)).all()
    assert sums.any()


def darkening(distance, per_pixel, is_parallel, reach, strength):
    """Return the factor of eye-dome lighting, in plain NumPy."""
    height, width = distance.shape
    out = np.ones_like(distance)
    for y, x in np.argwhere(np.isfinite(distance)):
        total = np.float32(0)
        scale = np.float32(1.0 / (per_pixel * (1.0 if is_parallel else float(distance[y, x]))))
        for k in range(DISTANCES * 9):
            step = reach << (k // 9)
            j, i = y + (k % 9 // 3 - 1) * step, x + (k % 3 - 1) * step
            if (j, i) != (y, x) and 0 <= j < height and 0 <= i < width and distance[j, i] < distance[y, x]:
                slope = min((distance[y, x] - distance[j, i]) * scale * np.float32(1.0 / step), np.float32(1e6))
                total += slope / (slope + HALF)
        out[y, x] = np.float32(1) / (np.float32(1) + np.float32(strength * WEIGHT / (8 * DISTANCES)) * total)
    return out


@pytest.mark.parametrize(
    ("is_parallel", "reach", "strength"), [(False, 1, 1.0), (True, 2, 0.5), (False, 8, 3.0), (True, 1, 0.0)]
)
def test_eye_dome_lighting_agrees_with_a_loop(is_parallel, reach, strength):
    random = np.random.default_rng(9)
    distance = (5 + random.random((13, 17)) * 3).astype(np.float32)
    distance[random.random(distance.shape) < 0.3] = np.inf
    distance[0, 0] = 1e30
    factor = np.zeros_like(distance)
    for start, end in ((0, 5), (5, 13)):
        eye_dome(distance, start, end, 0.01, is_parallel, reach, strength, factor)
    assert np.array_equal(factor, darkening(distance, 0.01, is_parallel, reach, strength))
    assert (factor > 0).all()
    assert (factor <= 1).all()


def test_edges_are_darker_with_eye_dome_lighting_and_flat_ground_is_not():
    ground = np.stack(np.meshgrid(np.arange(0.25, 48, 0.5), np.arange(0.25, 32, 0.5), [0.0]), axis=-1).reshape(-1, 3)
    ground[(np.abs(ground[:, :2] - (24, 16)) < 6).all(axis=1), 2] = 5  # a block on it
    cloud = ss.PointCloud(ground, color="white")
    light = {
        s: ss.render(cloud, flat_camera(), SIZE, samples=1, point_size=1, eye_dome=s).color[..., 0] for s in (0, 1, True, 3)
    }
    assert (light[0] == 255).all()
    assert np.array_equal(light[1], light[True])
    assert light[1][1, 1] == 255
    assert light[1][16, 24] == 255
    assert light[1][16, 16] < 240
    assert light[3][16, 16] < light[1][16, 16]


def test_clouds_far_from_the_origin_lose_nothing():
    near = ball(2000, color=np.random.default_rng(10).integers(0, 255, (2000, 3)))
    stored = np.rint(near.stored * 1e6).astype(np.int32)
    pictures = []
    for offset in ((0, 0, 0), (500_000, 4_900_000, 2_000)):
        cloud = ss.PointCloud(integers=stored, scale=1e-6, offset=offset, color=near.color)
        camera = ss.Camera.look_at(np.array((2.0, 1.0, 4.0)) + offset, offset, near=0.5)
        pictures.append(ss.render(cloud, camera, SIZE))
    assert np.array_equal(pictures[0].primitive, pictures[1].primitive)
    assert np.array_equal(pictures[0].color, pictures[1].color)


def test_a_camera_inside_or_beside_the_cloud_is_no_trouble():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for camera in (ss.Camera.look_at((0, 0, 0), (1, 0, 0)), ss.Camera.look_at((0, 0, 9), (0, 0, 20))):
            frame = ss.render(ball(), camera, SIZE)
            assert frame.color.shape == (32, 48, 4)
        assert frame.coverage == 0
        assert (frame.primitive == -1).all()
        for cloud in (ss.PointCloud(np.zeros((0, 3))), ss.PointCloud([(1, 2, 3)]), ss.PointCloud([(1, 2, 3)] * 5)):
            assert ss.render(cloud, size=SIZE).coverage == (0 if not len(cloud) else pytest.approx(0.001, abs=0.02))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"point_size": "big"}, "unknown point_size 'big'; the valid ones are: density, spacing"),
        ({"point_size": 0}, "point_size = 0: expected pixels above 0, up to 4096, or density or spacing"),
        ({"point_size": float("nan")}, "point_size = nan: expected pixels above 0"),
        ({"point_size": True}, "point_size = True: expected pixels above 0"),
        ({"point_shape": "round"}, "unknown point_shape 'round'; the valid ones are: square, disc, gaussian"),
        ({"color_by": "colour"}, "unknown color_by 'colour'"),
        ({"color_by": "rgb"}, "color: the cloud has none; it has nothing but positions"),
        ({"color_by": "class"}, "classification: the cloud has none"),
        ({"eye_dome": -1}, "eye_dome = -1: expected True, False or a strength from 0 to 100"),
        ({"eye_dome": "yes"}, "eye_dome = 'yes': expected True, False or a strength"),
    ],
)
def test_options_that_cannot_be_used_are_quoted(options, message):
    with pytest.raises(ss.InputError) as caught:
        ss.render(ball(), size=SIZE, **options)
    assert message in str(caught.value)


def test_too_many_points_or_pixels_are_refused(monkeypatch, tmp_path):
    with pytest.raises(ss.LimitError, match=r"size = \(48, 32\): 1536 pixels, the limit is max_pixels=99"):
        ss.render(ball(), size=SIZE, max_pixels=99, out=tmp_path / "a.npy")
    monkeypatch.setattr(clouds, "MAX_POINTS", 99)
    with pytest.raises(ss.LimitError, match="200 points: at most 99 can be numbered"):
        ss.render(ss.Scene([ball(100), ball(100)]), size=SIZE)


def test_options_of_clouds_are_refused_for_other_scenes():
    mesh = ss.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    for options in ({"point_size": 2}, {"point_shape": "disc"}, {"color_by": "rgb"}, {"eye_dome": False}):
        with pytest.raises(
            ss.InputError, match="point_size, point_shape, color_by and eye_dome are for scenes of point clouds"
        ):
            ss.render(ss.Scene([mesh, ball()]), size=SIZE, **options)
    assert type(ss.render(ss.Scene([mesh, ball(20)]), size=SIZE)) is ss.Frame
