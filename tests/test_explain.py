"""Explain: equal to the picture at every pixel, with the right reasons."""

from __future__ import annotations

import numpy as np
import pytest

import scanspan as ss
from scanspan.view.explain import VERDICTS

SIZE = (16, 12)


def check_every_pixel(seen):
    """Compare the explanation of every pixel with the picture; return the verdicts that occurred."""
    found = set()
    for y in range(SIZE[1]):
        for x in range(SIZE[0]):
            explanation = ss.explain(seen, x, y)
            assert explanation.primitive == seen.primitive[y, x], (x, y)
            found.update(d.verdict for d in explanation.decisions)
            covering = [d for d in explanation.decisions if d.depth is not None]
            if covering and isinstance(seen.depth, np.ndarray) and not isinstance(seen, type(None)):
                assert max(d.depth for d in covering) == covering[0].depth
    return found


@pytest.mark.parametrize(
    "options",
    [{}, {"cull": "back"}, {"rule": "inclusive"}, {"rule": "exclusive"}, {"rule": "bottom-left"}, {"depth_bits": 64},
     {"subpixel_bits": 16}, {"rule": ss.OffscreenPoint(-3, 5)}, {"subpixel_bits": 4}],
    ids=str,
)  # fmt: skip
def test_explanations_equal_the_picture(rng, options):
    clip = np.rint(rng.normal(size=(60, 4)) * 8) / 8
    clip[:, 3] += 0.5
    seen = ss.rasterize(clip, np.arange(60).reshape(-1, 3), SIZE, **options)
    found = check_every_pixel(seen)
    assert {"visible", "hidden", "outside"} <= found <= set(VERDICTS)


def test_explanations_of_a_frame_name_faces():
    cube = ss.Mesh.from_polygons(
        [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)],
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
    )
    assert check_every_pixel(ss.render(cube, size=SIZE)) >= {"visible", "hidden", "outside"}


def test_a_wrong_explanation_is_noticed(rng):
    clip = rng.normal(size=(60, 4))
    seen = ss.rasterize(clip, np.arange(60).reshape(-1, 3), SIZE)
    seen.primitive[5, 5] += 1
    with pytest.raises(AssertionError):
        check_every_pixel(seen)


def test_each_verdict_has_its_case():
    clip = [(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)]

    def verdict(triangles, x, y, vertices=clip, **options):
        return ss.explain(ss.rasterize(vertices, triangles, (4, 4), **options), x, y).decisions[0]

    assert verdict([(0, 1, 2)], 0, 3).verdict == "visible"
    assert verdict([(0, 1, 2)], 0, 3).reason == "it alone covers the sample"
    assert verdict([(0, 1, 2)], 1, 1).verdict == "excluded edge"
    assert verdict([(0, 1, 2)], 1, 1).edge_values.count(0) == 1
    assert verdict([(0, 1, 2)], 2, 1).verdict == "outside"
    assert verdict([(0, 1, 2)], 0, 3, cull="front").verdict == "culled"
    assert "front face" in verdict([(0, 1, 2)], 0, 3, cull="front").reason
    assert verdict([(0, 1, 1)], 2, 3).verdict == "degenerate"
    behind = [(-1, -1, -2, 1), (1, -1, -2, 1), (-1, 1, -2, 1)]
    assert verdict([(0, 1, 2)], 0, 3, behind).verdict == "clipped"
    twice = ss.explain(ss.rasterize(clip, [(0, 1, 2), (0, 1, 2)], (4, 4)), 0, 3)
    assert [d.verdict for d in twice.decisions] == ["visible", "hidden"]
    assert twice.decisions[1].reason == "primitive 0 has the same depth and the lower number"
    assert str(twice).splitlines()[0] == "pixel (0, 3) shows primitive 0; 2 triangles came near"
    assert str(ss.explain(ss.rasterize(clip, [], (4, 4)), 0, 0)) == "pixel (0, 0) shows nothing; 0 triangles came near"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((None, 0, 0), "^frame: expected what render or rasterize returned, got NoneType$"),
        (("seen", 4, 0), "^x = 4: must be a whole number from 0 to 3$"),
        (("seen", 0, -1), "^y = -1: must be a whole number from 0 to 3$"),
        (("seen", 0.5, 0), "^x = 0.5: must be a whole number from 0 to 3$"),
    ],
)
def test_what_cannot_be_used_is_quoted(arguments, message):
    seen = ss.rasterize([(-1, -1, 0, 1), (1, -1, 0, 1), (-1, 1, 0, 1)], [(0, 1, 2)], (4, 4))
    frame, x, y = arguments
    with pytest.raises(ss.InputError, match=message):
        ss.explain(seen if frame == "seen" else frame, x, y)
