"""The lectures' scan-line algorithm: equal to the library's under the canonical rule, and each fault of the printed one."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from scanspan.errors import InputError
from scanspan.lectures import hidden_surfaces as surfaces
from scanspan.lectures.hidden_surfaces import Facet


def random_facets(rng: np.random.Generator, count: int) -> list[Facet]:
    """Return triangles that may reach beyond a raster of 32 x 28, with depths of their own."""
    corners = np.round(np.concatenate([rng.uniform(-6, 38, (count, 3, 2)), rng.uniform(-0.9, 0.9, (count, 3, 2))], axis=2), 2)
    return [[(x, y, z, color) for x, y, z, color in facet] for facet in (np.rint(corners * 64) / 64).tolist()]


@pytest.mark.parametrize("visibility", ["evaluate", "one-row buffer"])
def test_the_canonical_rule_shows_what_rasterize_shows(visibility: str, rng: np.random.Generator) -> None:
    for _ in range(6):
        facets = random_facets(rng, 6)
        found = surfaces.sweep_up(facets, (32, 28), rule="canonical", visibility=visibility)
        assert np.array_equal(found.polygon, surfaces.shipped_polygons(facets, (32, 28)))
        assert (found.unmatched, found.most_edges) == (0, 2)


def test_all_three_ways_agree_on_polygons_that_do_not_cross(rng: np.random.Generator) -> None:
    facets = [[(x, y, -0.1 * k, color) for x, y, _, color in facet] for k, facet in enumerate(random_facets(rng, 6))]
    shown = [surfaces.sweep_up(facets, (32, 28), rule="canonical", visibility=name) for name in surfaces.VISIBILITIES]
    for other in shown[1:]:
        assert np.array_equal(shown[0].polygon, other.polygon)
        assert np.array_equal(shown[0].color, other.color)


def test_colours_are_those_of_the_plane() -> None:
    facet = [(x, y, 0.0, 3 * x + 5 * y) for x, y in ((2.25, 1.5), (29.0, 7.75), (11.5, 26.25))]
    found = surfaces.sweep_up([facet], (32, 28), rule="canonical")
    exact = np.add.outer(5.0 * np.arange(28), 3.0 * np.arange(32))
    assert np.array_equal(found.color[found.polygon == 0], exact[found.polygon == 0])
    assert (found.polygon == 0).sum() > 200


def test_swaps_are_the_edges_that_cross() -> None:
    facets: list[Facet] = [[(0, 0, 0, 0), (2, 0, 0, 0), (22, 20, 0, 0)], [(22, 0, 0, 0), (24, 0, 0, 0), (4, 20, 0, 0)]]
    assert surfaces.sweep_up(facets, (30, 20), rule="canonical").swaps == 4
    assert surfaces.sweep_up(facets[:1], (30, 20), rule="canonical").swaps == 0


def test_insertion_sort_counts_inversions(rng: np.random.Generator) -> None:
    order = rng.permutation(12).tolist()
    edges = [surfaces.EdgeRec(*[Fraction(0)] * 7, polygon=0) for _ in order]
    for edge, x in zip(edges, order, strict=True):
        edge.x = Fraction(x)
    inversions = sum(order[i] > order[k] for k in range(12) for i in range(k))
    assert surfaces.insertion_sort(edges) == inversions
    assert [int(edge.x) for edge in edges] == list(range(12))


def test_buckets_round_down_and_ends_round_up() -> None:
    block = surfaces.demonstrate_buckets(surfaces.BLOCK)
    assert (block.rows_as_printed, block.rows, block.wrong_as_printed, block.wrong_canonical) == (9, 7, 39, 0)


def test_three_edges_where_two_are_promised() -> None:
    kite = surfaces.demonstrate_buckets()
    assert (kite.most_edges, kite.unmatched, kite.wrong_as_printed, kite.wrong_canonical) == (3, 4, 61, 0)


def test_neighbours_draw_their_boundary_twice() -> None:
    assert surfaces.demonstrate_neighbours() == surfaces.Neighbours(33, 0, 0)


def test_a_kept_identity_misses_crossings() -> None:
    found = surfaces.demonstrate_identity()
    assert found == surfaces.Identity(active_span_list=138, evaluate=0, one_row_buffer=0, shipped_span_list=0)


def test_the_list_is_empty_only_if_the_sweep_goes_on() -> None:
    assert (surfaces.demonstrate_left_over(20), surfaces.demonstrate_left_over(32)) == (2, 0)


def test_what_a_sweep_refuses() -> None:
    with pytest.raises(InputError, match=r"^facets\[0\]"):
        surfaces.sweep_up([[(0, 0, float("inf"), 0), (1, 0, 0, 0), (0, 1, 0, 0)]], (4, 4))
    with pytest.raises(InputError, match=r"^unknown rule 'printed'"):
        surfaces.sweep_up([], (4, 4), rule="printed")
    with pytest.raises(InputError, match=r"^unknown visibility 'z-buffer'"):
        surfaces.sweep_up([], (4, 4), visibility="z-buffer")
