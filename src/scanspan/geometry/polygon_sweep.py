"""Polygons to triangles in one sweep, which also finds out whether edges cross and what the fill rule holds.

The sweep goes down over the points of a planar graph. Its status is the edges that cross the sweep line (edge_tree.py), each
with the winding number right of it. Between two edges with the inside between them hangs a chain: the points above the sweep
line that are not yet cut off, from the upper end of the left edge to that of the right one. A chain turns inwards nowhere. A
point that comes next to it is joined to what it sees of it, and so triangles are cut off as soon as they can be:

regular  the edge goes on, the point becomes an end of its chain
split    a point inside: the chain is cut at the point that came last, which it always sees, and each half gets it as an end
merge    two chains meet in a point, and become one
end      both edges end, the whole chain is cut off

A point on a straight side takes part like any other, and no triangle without an area is made. Crossings cost nothing extra to
find: two edges that cross stand in the wrong order until one of them ends, with nothing between them, and then that end lies
on the wrong side of its neighbour. Every point is compared with its two neighbours, exactly; if all is right, nothing crosses.

Cost: O(n log n), and O(n) where few points begin or end a pair of edges. The triangles are those that the sweep meets: it
chooses no diagonals by their shape.

Source: Hertel and Mehlhorn 1983, Fast triangulation of simple polygons; Shamos and Hoey 1976 for the crossings.
"""

from __future__ import annotations

import numpy as np

from scanspan.geometry.edge_tree import AFTER, BEFORE, LEFT, LINKS, RIGHT, insert_after, take_out
from scanspan.geometry.fill_rule import is_filled
from scanspan.geometry.fixed_point import halves_sign, product_halves
from scanspan.geometry.planar_graph import turn_sign
from scanspan.jit import helper_kernel, kernel
from scanspan.records import Int32Array, Int64Array, Integer, UInt8Array

# What a sweep found: edges that are all borders of the inside; edges that are not; edges that cross, touch or overlap.
BORDERS, MIXED, CROSSED = range(3)

# Columns of status, a row for each node of the tree: the edge's value a (x - q_x) + b (y - q_y), which grows to the right; the
# point at which it ends; the winding number right of it, and whether that is inside; the chain there: its left end, its right
# end, and the point that came last. Row 0 is what lies left of everything.
A, B, Q_X, Q_Y, END, WINDING, INSIDE, HEAD, TAIL, LAST = range(10)
STATUS_COLUMNS = 10

# Columns of chains: a point, the links before and after it, and whether the way to the one after is a cut. Row 0 is no link;
# there stand how many rows are in use, and the first that was given back.
POINT, PREVIOUS, NEXT, IS_CUT = range(4)
CHAIN_COLUMNS = 4


@helper_kernel
def side_of(status: Int64Array, node: Integer, x: Integer, y: Integer) -> Integer:
    """Return 1 for a point right of the edge at a node, -1 for one left of it, 0 for one on it."""
    high, low = product_halves(status[node, A], status[node, B], x - status[node, Q_X], y - status[node, Q_Y])
    return halves_sign(high, low)


@helper_kernel
def make_link(chains: Int64Array, point: Integer, previous: Integer, after: Integer, is_cut: Integer) -> Integer:
    """Return a link of a chain, one that was given back or a fresh one."""
    link: Integer = chains[0, NEXT]
    if link != 0:
        chains[0, NEXT] = chains[link, NEXT]
    else:
        chains[0, POINT] += 1
        link = chains[0, POINT]
    chains[link, POINT], chains[link, PREVIOUS], chains[link, NEXT], chains[link, IS_CUT] = point, previous, after, is_cut
    return link


@helper_kernel
def free_link(chains: Int64Array, link: Integer) -> None:
    """Give a link back."""
    chains[link, NEXT] = chains[0, NEXT]
    chains[0, NEXT] = link


@helper_kernel
def write_triangle(
    triangles: Int32Array, inner: UInt8Array, count: Integer, p: Integer, q: Integer, r: Integer, marks: Integer
) -> Integer:
    """Write a triangle, counter-clockwise as seen; bit i of marks says that the edge opposite corner i is a cut."""
    triangles[count, 0], triangles[count, 1], triangles[count, 2] = p, q, r
    inner[count] = marks
    return count + 1


@helper_kernel
def sees_past(points: Int64Array, chains: Int64Array, end: Integer, following: Integer, v: Integer) -> Integer:
    """Return how the way from a point over the end of a chain to the link that follows turns: see turn_sign; 0 if none does."""
    return turn_sign(points, v, chains[end, POINT], chains[following, POINT] if following != 0 else v)


@helper_kernel
def join_right(
    points: Int64Array, chains: Int64Array, tail: Integer, v: Integer, is_cut: Integer, triangles: Int32Array,
    inner: UInt8Array, count: Integer,
) -> tuple[Integer, Integer]:  # fmt: skip
    """Join a point to the right end of a chain, and cut off what it sees; return its link and how many triangles there are.

    is_cut: whether the way from the end to the point is a cut and no edge.
    """
    while sees_past(points, chains, tail, chains[tail, PREVIOUS], v) < 0:
        before = chains[tail, PREVIOUS]
        marks = chains[before, IS_CUT] | 2 | is_cut << 2
        count = write_triangle(triangles, inner, count, v, chains[tail, POINT], chains[before, POINT], marks)
        free_link(chains, tail)
        tail, is_cut = before, np.int64(1)
    link = make_link(chains, v, tail, np.int64(0), np.int64(0))
    chains[tail, NEXT], chains[tail, IS_CUT] = link, is_cut
    return link, count


@helper_kernel
def join_left(
    points: Int64Array, chains: Int64Array, head: Integer, v: Integer, is_cut: Integer, triangles: Int32Array,
    inner: UInt8Array, count: Integer,
) -> tuple[Integer, Integer]:  # fmt: skip
    """Join a point to the left end of a chain, as join_right does to the right one."""
    while sees_past(points, chains, head, chains[head, NEXT], v) > 0:
        after = chains[head, NEXT]
        marks = is_cut | 2 | chains[head, IS_CUT] << 2
        count = write_triangle(triangles, inner, count, chains[after, POINT], chains[head, POINT], v, marks)
        free_link(chains, head)
        head, is_cut = after, np.int64(1)
    link = make_link(chains, v, np.int64(0), head, is_cut)
    chains[head, PREVIOUS] = link
    return link, count


@helper_kernel
def cut_off(chains: Int64Array, tail: Integer, v: Integer, triangles: Int32Array, inner: UInt8Array, count: Integer) -> Integer:
    """Cut off a whole chain, both of whose edges end at a point; return how many triangles there are.

    Its ends and the point are the only corners that turn outwards, so the point sees all of it.
    """
    is_cut = np.int64(0)
    while chains[tail, PREVIOUS] != 0:
        before = chains[tail, PREVIOUS]
        is_last = np.int64(0 if chains[before, PREVIOUS] == 0 else 1)
        marks = chains[before, IS_CUT] | is_last << 1 | is_cut << 2
        count = write_triangle(triangles, inner, count, v, chains[tail, POINT], chains[before, POINT], marks)
        free_link(chains, tail)
        tail, is_cut = before, np.int64(1)
    free_link(chains, tail)
    return count


@helper_kernel
def find_place(links: Int64Array, status: Int64Array, x: Integer, y: Integer) -> tuple[Integer, bool]:
    """Return the node left of a point, 0 for none, and whether the point lies on an edge."""
    node, left = links[0, RIGHT], np.int64(0)
    while node != 0:
        side = side_of(status, node, x, y)
        if side == 0:
            return left, True
        if side > 0:
            left, node = node, links[node, RIGHT]
        else:
            node = links[node, LEFT]
    return left, False


@helper_kernel
def find_ends(
    links: Int64Array, status: Int64Array, node: Integer, v: Integer, ending: Integer, x: Integer, y: Integer
) -> tuple[Integer, Integer, bool]:
    """Return the node left of the edges that end at a point, the last of them, and whether something is wrong.

    They must stand side by side, as many as there are, and the point between their neighbours.
    """
    last, found = node, np.int64(1)
    left = links[node, BEFORE]
    while left != 0 and status[left, END] == v:
        left = links[left, BEFORE]
        found += 1
    while links[last, AFTER] != 0 and status[links[last, AFTER], END] == v:
        last = links[last, AFTER]
        found += 1
    right = links[last, AFTER]
    is_wrong = found != ending or (left != 0 and side_of(status, left, x, y) <= 0)
    return left, last, bool(is_wrong or (right != 0 and side_of(status, right, x, y) >= 0))


@helper_kernel
def cut_between(
    links: Int64Array, status: Int64Array, chains: Int64Array, node: Integer, last: Integer, v: Integer, triangles: Int32Array,
    inner: UInt8Array, count: Integer,
) -> Integer:  # fmt: skip
    """Cut off the chains between edges that end at a point, from one node to another; return how many triangles there are."""
    while node != last:
        if status[node, INSIDE] != 0:
            count = cut_off(chains, status[node, TAIL], v, triangles, inner, count)
        node = links[node, AFTER]
    return count


@helper_kernel
def split_chain(status: Int64Array, chains: Int64Array, left: Integer) -> tuple[Integer, Integer, Integer]:
    """Split a chain at the point that came last, which ends up in both parts.

    Returns the right end of the left part, and both ends of the right part.
    """
    tail, right_end = status[left, LAST], status[left, TAIL]
    after = chains[tail, NEXT]
    head = make_link(chains, chains[tail, POINT], np.int64(0), after, chains[tail, IS_CUT])
    chains[tail, NEXT] = 0
    chains[after, PREVIOUS] = head if after != 0 else chains[after, PREVIOUS]
    return tail, head, right_end if after != 0 else head


@helper_kernel
def merge_chains(
    status: Int64Array, chains: Int64Array, left: Integer, end: Integer, start: Integer, right_end: Integer
) -> None:
    """Make one chain of two that end and start at the same point, at which no edge begins."""
    after = chains[start, NEXT]
    chains[end, NEXT], chains[end, IS_CUT] = after, chains[start, IS_CUT]
    chains[after, PREVIOUS] = end
    free_link(chains, start)
    status[left, TAIL], status[left, LAST] = right_end, end


@helper_kernel
def place_edge(
    points: Int64Array, status: Int64Array, node: Integer, v: Integer, w: Integer, winding: Integer, is_inside: bool
) -> None:
    """Let an edge from v to w stand at a node."""
    x, y = points[v, 0], points[v, 1]
    status[node, A], status[node, B] = points[w, 1] - y, x - points[w, 0]
    status[node, Q_X], status[node, Q_Y] = x, y
    status[node, END], status[node, WINDING], status[node, INSIDE] = w, winding, 1 if is_inside else 0


@helper_kernel
def hang_chain(
    status: Int64Array, chains: Int64Array, node: Integer, v: Integer, start: Integer, right_end: Integer, is_last: bool
) -> None:
    """Hang a chain between an edge that begins at a point and the next: a fresh one, or behind the last the one right of it."""
    link = start if is_last else make_link(chains, v, np.int64(0), np.int64(0), np.int64(0))
    status[node, HEAD], status[node, LAST] = link, link
    status[node, TAIL] = right_end if is_last else link


@kernel
def sweep_polygon(
    points: Int64Array, starts: Int64Array, lower: Int64Array, winding: Int64Array, fill_rule: int, is_border: UInt8Array,
    triangles: Int32Array, inner: UInt8Array,
) -> tuple[int, Integer]:  # fmt: skip
    """Sweep over a planar graph; return what was found and how many triangles.

    Shapes  points, starts, lower, winding: as of PlanarGraph; is_border: (E,), written: 1 where an edge has the inside on one
            side alone; triangles: (2 V, 3) and inner: (2 V,), written where BORDERS is returned: points of each, counter-
            clockwise as seen, and marks, bit i for an edge opposite corner i that is a cut.
    Needs   coordinates within 2^40; as many edges wind into a point as out of it.
    Cost    O(V log V). It ends at the first crossing that it meets.
    """
    edges, state = lower.shape[0], BORDERS
    nothing: Integer = np.int64(0)
    count = nodes = free = nothing
    ending, standing = np.zeros(points.shape[0], np.int64), np.zeros(points.shape[0], np.int64)
    for e in range(edges):
        ending[lower[e]] += 1
    links, status = np.empty((edges + 1, LINKS), np.int64), np.empty((edges + 1, STATUS_COLUMNS), np.int64)
    chains = np.empty((3 * points.shape[0] + edges + 1, CHAIN_COLUMNS), np.int64)
    links[0], status[0], chains[0] = 0, 0, 0
    for v in range(points.shape[0]):
        first, begin, ends = starts[v], starts[v + 1] - starts[v], ending[v]
        if begin + ends == 0:
            continue

        # Find where it lies in the status, and look out for crossings.
        x, y, last = points[v, 0], points[v, 1], nothing
        if ends > 0:
            left, last, is_wrong = find_ends(links, status, standing[v], v, ends, x, y)
        else:
            left, is_wrong = find_place(links, status, x, y)
        if is_wrong:
            return CROSSED, 0

        # Cut off triangles between edges that end, and join the point to the chains on both sides.
        end = start = right_end = nothing
        if state == BORDERS:
            tail, head, is_cut = status[left, TAIL], nothing, nothing
            if ends > 0:
                count = cut_between(links, status, chains, links[left, AFTER], last, v, triangles, inner, count)
                if status[last, INSIDE] != 0:
                    head, right_end = status[last, HEAD], status[last, TAIL]
            elif status[left, INSIDE] != 0:
                tail, head, right_end = split_chain(status, chains, left)
                is_cut += 1
            if status[left, INSIDE] != 0:
                end, count = join_right(points, chains, tail, v, is_cut, triangles, inner, count)
                status[left, TAIL] = status[left, LAST] = end
            if head != 0:
                start, count = join_left(points, chains, head, v, is_cut, triangles, inner, count)
            if begin == 0 and end != 0:
                merge_chains(status, chains, left, end, start, right_end)

        # Put the edges that begin in the places of those that end, and behind them.
        place, wound, is_inside = left, status[left, WINDING], status[left, INSIDE] != 0
        for k in range(begin):
            node = links[place, AFTER]
            if k >= ends:
                # Make a place.
                node = free
                if node != 0:
                    free = links[node, AFTER]
                else:
                    nodes += 1
                    node = nodes
                insert_after(links, place, node)
            was_inside = is_inside
            wound += winding[first + k]
            is_inside = is_filled(fill_rule, wound, wound)
            is_border[first + k] = was_inside != is_inside
            state = MIXED if was_inside == is_inside else state
            place_edge(points, status, node, v, lower[first + k], wound, is_inside)
            standing[lower[first + k]] = node
            if is_inside and state == BORDERS:
                hang_chain(status, chains, node, v, start, right_end, k == begin - 1)
            place = node

        # Give up the places that are left over.
        for _ in range(begin, ends):
            node = links[place, AFTER]
            take_out(links, node)
            links[node, AFTER] = free
            free = node
    return state, count
