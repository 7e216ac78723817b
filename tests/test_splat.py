"""Drawing trees of splats: what is seen, whatever was kept or culled, and refining that only makes better."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scanspan as ss
from scanspan.assets.splats.cache import ORDERS, STRIDES, pass_ends
from scanspan.records import Array, BoolArray, Float64Array

SIZE = (320, 240)
POINTS = Path(__file__).resolve().parent.parent.parent.parent / "shared" / "points"


def bumpy_ball(count: int, seed: int = 8) -> tuple[Float64Array, Float64Array]:
    """Return points on a ball with bumps, and the directions from its middle."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    unit = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    return unit * (1 + 0.05 * np.sin(9 * unit[:, :1]) * np.sin(11 * unit[:, 1:2])), unit


PLACES, DIRECTIONS = bumpy_ball(60_000)
BALL = ss.splat.build({"positions": PLACES, "color": np.uint8(np.abs(DIRECTIONS) * 255), "normals": DIRECTIONS})
PLAIN = ss.splat.build(PLACES)
COLORED = ss.splat.build({"positions": PLACES, "color": np.uint8(np.abs(DIRECTIONS) * 255)})
TREES = {"lit": BALL, "by height": PLAIN, "coloured": COLORED}
CLOSE = ss.Camera.look_at((0.3, 1.6, 0.4), (0, 0, 0.2), up=(0, 0, 1), fov=60)
INSIDE = ss.Camera.look_at((0, 0, 0.2), (1, 0.2, 0), up=(0, 0, 1), fov=90)
PARALLEL = ss.Camera.orthographic((2, 3, 1), (0, 0, 0), up=(0, 0, 1), height=1.2)
CAMERAS: dict[str, Any] = {"iso": "iso", "close": CLOSE, "inside": INSIDE, "parallel": PARALLEL}


def covered(frame: ss.Frame) -> BoolArray:
    """Return (H, W), whether a pixel shows something."""
    return np.asarray(frame.object >= 0)


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("camera", CAMERAS)
def test_frames_of_a_refinement_only_get_better(name: str, camera: str) -> None:
    tree = TREES[name]
    last = tree.render(CAMERAS[camera], SIZE)
    frames = list(tree.refine(CAMERAS[camera], SIZE))
    assert len(frames) == len(STRIDES)
    assert np.array_equal(frames[-1].color, last.color)
    assert frames[-1].error == last.error <= 1.0
    assert frames[-1].splats == last.splats
    differences = [float(np.abs(frame.color.astype(np.int64) - last.color).mean()) for frame in frames]
    assert differences == sorted(differences, reverse=True)
    assert differences[0] > differences[1] > 0.0
    for before, after in pairwise(frames):
        assert not (covered(before) & ~covered(after)).any()
        assert before.splats < after.splats
        assert before.error >= after.error
    assert [frame.is_final for frame in frames] == [False, False, False, True]


@pytest.mark.parametrize("file", ["lone-star.copc.laz", "autzen_trim.laz"])
@pytest.mark.parametrize("direction", ["iso", "front", "top"])
def test_real_clouds_only_get_better(file: str, direction: str, shared_data: Path) -> None:
    tree = real_tree(shared_data / "points" / file)
    last = tree.render(direction, SIZE)
    frames = list(tree.refine(direction, SIZE))
    differences = [float(np.abs(frame.color.astype(np.int64) - last.color).mean()) for frame in frames]
    assert differences == sorted(differences, reverse=True)
    assert differences[-1] == 0.0
    for before, after in pairwise(frames):
        assert not (covered(before) & ~covered(after)).any()
    assert 0.02 < last.coverage < 0.7


@pytest.mark.parametrize("direction", ["iso", "front", "top"])
def test_a_mesh_becomes_a_tree_that_only_gets_better(direction: str, shared_data: Path) -> None:
    path = shared_data / "meshes" / "rocker-arm.obj"
    if not path.exists():
        pytest.skip(f"{path.name} is not here")
    tree = ss.splat.build(ss.load(path).instances[0].geometry)
    assert tree.has_normals
    frames = list(tree.refine(direction, SIZE, up="+Y"))
    differences = [float(np.abs(frame.color.astype(np.int64) - frames[-1].color).mean()) for frame in frames]
    assert differences == sorted(differences, reverse=True)
    for before, after in pairwise(frames):
        assert not (covered(before) & ~covered(after)).any()

    # It looks like the mesh: covered where that is, and a rim of some pixels.
    mesh = ss.render(ss.load(path), frames[-1].camera, SIZE)
    assert (covered(mesh) & ~covered(frames[-1])).mean() < 0.001
    assert frames[-1].coverage < 1.25 * mesh.coverage


REAL: dict[Path, ss.splat.SplatTree] = {}


def real_tree(path: Path) -> ss.splat.SplatTree:
    """Return the tree of a file, built once."""
    pytest.importorskip("laspy")
    if not path.exists():
        pytest.skip(f"{path.name} is not here")
    if path not in REAL:
        REAL[path] = ss.splat.build(path)
    return REAL[path]


@pytest.mark.parametrize("camera", CAMERAS)
def test_culling_changes_no_pixel(camera: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from scanspan import splat
    from scanspan.geometry import cut

    frame = PLAIN.render(CAMERAS[camera], SIZE, error=3)
    whole = cut.cut_tree

    def uncut(nodes: Any, view: Any, error: float, budget: Any = None, **_: Any) -> Any:
        return whole(nodes, view, error, budget, culls=False, turns_away=False)

    monkeypatch.setattr(splat, "cut_tree", uncut)
    again = PLAIN.render(CAMERAS[camera], SIZE, error=3)
    assert again.splats > frame.splats or camera in ("iso",)
    assert np.array_equal(again.color, frame.color)
    assert np.array_equal(again.primitive, frame.primitive)


def test_what_faces_away_hides_behind_a_closed_surface() -> None:
    frame, whole = (BALL.render("iso", SIZE, cull=cull) for cull in ("back", "none"))
    assert frame.splats < 0.7 * whole.splats
    assert (covered(frame) != covered(whole)).mean() < 0.003
    assert (frame.color != whole.color).any(axis=2).mean() < 0.006

    # From within, nothing but backs is seen.
    assert BALL.render(INSIDE, SIZE, cull="none").coverage > 0.99
    assert BALL.render(INSIDE, SIZE, cull="back").coverage < 0.2


def test_a_smaller_error_draws_more_and_is_met() -> None:
    frames = [BALL.render("iso", SIZE, error=error) for error in (0, 1, 4, 16, 64)]
    counts = [frame.splats for frame in frames]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 5 * counts[-1]
    for frame, error in zip(frames, (0, 1, 4, 16, 64)):
        assert frame.error <= error
    near = np.abs(frames[2].color.astype(np.int64) - frames[0].color).mean()
    far = np.abs(frames[4].color.astype(np.int64) - frames[0].color).mean()
    assert near < far


@pytest.mark.parametrize("camera", CAMERAS)
def test_threads_change_nothing(camera: str) -> None:
    one, three = (BALL.render(CAMERAS[camera], SIZE, threads=threads) for threads in (1, 3))
    assert np.array_equal(one.color, three.color)
    assert np.array_equal(one.primitive, three.primitive)


def test_what_is_kept_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "ball.scansplat"
    built = ss.splat.build({"positions": PLACES, "normals": DIRECTIONS}, path)
    roomy, narrow = ss.splat.open(path), ss.splat.open(path, max_bytes=100_000)
    expected = built.render("iso", SIZE)
    for tree in (roomy, narrow):
        for _ in range(2):
            frame = tree.render("iso", SIZE)
            assert np.array_equal(frame.color, expected.color)
            assert np.array_equal(frame.position, expected.position, equal_nan=True)
            frames = list(tree.refine("iso", SIZE))
            assert np.array_equal(frames[-1].color, expected.color)
    assert roomy.render("iso", SIZE).bytes_read == 0
    assert narrow.render("iso", SIZE).bytes_read > 0
    assert roomy._state.cache.splats.radius.size <= built.splat_count


def test_what_was_not_read_yet_comes_page_by_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from scanspan import splat

    monkeypatch.setattr(splat, "FEW_PAGES", 4)
    ss.splat.build({"positions": PLACES, "normals": DIRECTIONS}, tmp_path / "ball.scansplat")
    tree = ss.splat.open(tmp_path / "ball.scansplat")
    frames = list(tree.refine("iso", SIZE))
    last = tree.render("iso", SIZE)
    assert np.array_equal(frames[-1].color, last.color)
    read = [frame.bytes_read for frame in frames]
    assert 0 < read[0] < read[1] < read[2] == read[3]
    assert read[0] < read[3] / 5
    assert last.bytes_read == 0
    differences = [float(np.abs(frame.color.astype(np.int64) - last.color).mean()) for frame in frames]
    assert differences == sorted(differences, reverse=True)
    for before, after in pairwise(frames):
        assert not (covered(before) & ~covered(after)).any()
        assert before.error >= after.error
    assert frames[0].error == np.inf > frames[2].error

    # Now that all is there, it comes in passes.
    assert [frame.bytes_read for frame in tree.refine("iso", SIZE)] == [0, 0, 0, 0]


def test_a_surface_has_no_holes() -> None:
    from scipy import ndimage

    for error in (0.5, 4, 32):
        shown = covered(BALL.render("iso", (640, 480), error=error))
        holes = ndimage.binary_fill_holes(shown) & ~shown
        assert holes.sum() <= 0.0001 * shown.sum()


def test_fields_tell_of_the_splat_that_is_seen() -> None:
    frame = BALL.render("front", SIZE)
    seen = covered(frame)
    assert 0.2 < seen.mean() == pytest.approx(frame.coverage)
    radius = np.linalg.norm(frame.position[seen], axis=1)
    assert 0.9 < radius.min() < radius.max() < 1.1
    assert np.abs(np.linalg.norm(frame.normal[seen], axis=1) - 1).max() < 1e-5
    assert ((frame.normal[seen] * frame.position[seen]).sum(axis=1) > 0.8).all()
    assert np.allclose(frame.depth[seen], frame.camera.depth(frame.position[seen]), rtol=1e-6)
    assert np.isinf(frame.depth[~seen]).all()
    assert np.isnan(frame.position[~seen]).all()
    assert (frame.normal[~seen] == 0).all()
    assert (frame.barycentric == 0).all()
    assert np.isnan(frame.uv).all()
    assert frame.primitive.dtype == np.int32
    assert (frame.primitive[~seen] == -1).all()
    assert "splats drawn, error 0 px" in repr(frame)

    # The number leads back to the splat: count over the nodes, in order.
    number = int(frame.primitive[seen][7])
    node = int(np.searchsorted(BALL.nodes["first_number"], number, side="right")) - 1
    block, row = BALL.read(node), number - int(BALL.nodes["first_number"][node])
    place = BALL.origin + BALL.nodes["low"][node] + BALL.nodes["step"][node] * block.positions[row]
    assert np.array_equal(place, frame.position[seen][7])


def test_a_deadline_ends_with_a_whole_picture() -> None:
    whole = BALL.render("iso", SIZE)
    (frame,) = BALL.refine("iso", SIZE, deadline=0)
    assert not frame.is_final
    assert frame.error > 1.0
    assert (covered(whole) & ~covered(frame)).mean() < 0.001
    frames = list(BALL.refine("iso", SIZE, deadline=1e6))
    assert np.array_equal(frames[-1].color, whole.color)


def test_a_budget_holds() -> None:
    full = BALL.render("iso", SIZE)
    for budget in (256, 3000, full.splats):
        frame = BALL.render("iso", SIZE, budget=budget)
        assert frame.splats <= budget
        assert frame.error >= full.error
        frames = list(BALL.refine("iso", SIZE, budget=budget))
        assert np.array_equal(frames[-1].color, frame.color)
    assert full.splats == BALL.render("iso", SIZE, budget=full.splats).splats


@pytest.mark.parametrize(
    "places", [np.empty((0, 3)), [[1.0, 2.0, 3.0]], np.ones((1000, 3)), [[5e5, 4e6, 0], [5e5 + 1e-3, 4e6, 0]]]
)
def test_few_points_are_drawn(places: Any) -> None:
    tree = ss.splat.build(places)
    for camera in (None, "top", CLOSE):
        frame = tree.render(camera, (40, 30))
        frames = list(tree.refine(camera, (40, 30)))
        assert np.array_equal(frames[-1].color, frame.color)
        assert len(list(tree.refine(camera, (40, 30), deadline=0))) == 1
        assert (frame.coverage > 0) == (len(places) > 0 and camera is not CLOSE) or camera is CLOSE
        assert frame.position.shape == (30, 40, 3)


def test_a_far_origin_keeps_the_picture() -> None:
    origin = np.array([5e5, 4.6e6, 300.0])
    here, there = ss.splat.build(np.round(PLACES, 3)), ss.splat.build(np.round(PLACES, 3) + origin)
    eye = np.array([2.0, 2, 1])
    near = ss.Camera.look_at(eye, (0, 0, 0), up=(0, 0, 1))
    far = ss.Camera.look_at(eye + origin, origin, up=(0, 0, 1))
    a, b = here.render(near, SIZE), there.render(far, SIZE)
    assert (a.color != b.color).any(axis=2).mean() < 0.02


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3000))
def test_scattered_points_never_return_to_the_background(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    colors = random.integers(0, 256, (count, 3), np.uint8)
    tree = ss.splat.build({"positions": random.normal(size=(count, 3)), "color": colors})
    frames = list(tree.refine("iso", (64, 48)))
    for before, after in pairwise(frames):
        assert not (covered(before) & ~covered(after)).any()
    assert np.array_equal(frames[-1].color, tree.render("iso", (64, 48)).color)


def test_passes_part_every_block() -> None:
    for count in (0, 1, 3, 64, 65, 255, 256):
        order: Array = ORDERS[count, :count]
        assert sorted(order.tolist()) == list(range(count))
        ends = [int(pass_ends(np.array([count]), number)[0]) for number in range(len(STRIDES))]
        for stride, end in zip(STRIDES, ends):
            assert sorted(order[:end].tolist()) == list(range(0, count, stride))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"error": -1}, "error = -1: must be a number from 0 to 1000000.0"),
        ({"error": "small"}, "error = 'small': must be a number from 0 to 1000000.0"),
        ({"budget": 255}, "budget = 255: must be a whole number from 256 to 4611686018427387904"),
        ({"cull": "front"}, "unknown cull 'front'"),
        ({"threads": 0}, "threads = 0"),
        ({"camera": 3}, "camera = 3: expected a Camera or the name of a direction"),
        ({"camera": "above"}, "unknown direction 'above'"),
        ({"size": (0, 5)}, "size = (0, 5)"),
        ({"size": (1 << 15, 1 << 14)}, "the limit is max_pixels="),
        ({"up": "north"}, "unknown up axis 'north'"),
        ({"background": "nocolor"}, "nocolor"),
    ],
)
def test_what_cannot_be_drawn_is_said(options: dict[str, Any], message: str) -> None:
    for draw in (BALL.render, BALL.refine):
        with pytest.raises(ss.InputError) as caught:
            draw(**({"size": SIZE} | options))
        assert message in str(caught.value)


def test_a_deadline_that_is_none_is_said() -> None:
    with pytest.raises(ss.InputError, match="deadline = -1: must be a number from 0 to"):
        BALL.refine("iso", SIZE, deadline=-1)


def test_max_bytes_is_checked(tmp_path: Path) -> None:
    ss.splat.build(PLACES[:10], tmp_path / "few.scansplat")
    with pytest.raises(ss.InputError, match="max_bytes = 0: must be a whole number from 1"):
        ss.splat.open(tmp_path / "few.scansplat", max_bytes=0)


@pytest.mark.parametrize("name", ["normals", "colour", "neither"])
def test_compiled_and_plain_pictures_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from scanspan.assets.splats import cache
    from scanspan.geometry import cut
    from scanspan.shade import splats as shade
    from scanspan.target import splat_picture

    points: dict[str, Any] = {"positions": PLACES[:400]}
    points |= {"normals": DIRECTIONS[:400]} if name == "normals" else {}
    points |= {"color": np.uint8(np.abs(DIRECTIONS[:400]) * 255)} if name == "colour" else {}
    expected = list(ss.splat.build(points).refine("iso", (32, 24)))
    kernels = {
        cache: ("put_in_passes",), cut: ("write_stretch",), splat_picture: ("mark_seen", "paint_keys", "darken_pixels"),
        shade: ("gather_splats", "encode_splats", "color_heights"),
    }  # fmt: skip
    for module, names in kernels.items():
        for kernel in names:
            monkeypatch.setattr(module, kernel, getattr(module, kernel).py_func)
    monkeypatch.setattr(splat_picture, "largest_gap", cut.largest_gap.py_func)  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        plain = list(ss.splat.build(points).refine("iso", (32, 24)))
    for one, other in zip(expected, plain, strict=True):
        assert np.array_equal(one.color, other.color)
        assert one.error == other.error
