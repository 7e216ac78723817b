"""The status of a sweep: the edges that cross the sweep line, from left to right, in a balanced tree that is also a list.

A node is a place in the order, and an edge stands at it. Most events of a sweep end one edge and begin another at the same
place; they only put the new edge there and never touch the tree. Where places are made or given up the tree is rotated about:
it is a treap, a search tree by place and a heap by priorities drawn from a fixed sequence, so the same input gives the same
tree everywhere. The list, two links a node, finds neighbours at once. Depth: about 2 ln n, expected.

Source: Seidel and Aragon 1996, Randomized search trees.
"""

from __future__ import annotations

from scanspan.jit import helper_kernel
from scanspan.records import Int64Array, Integer

# Columns of links, (N + 1, 6), a row for each node. Row 0 is no node: its RIGHT is the root, and links of 0 lead nowhere.
LEFT, RIGHT, PARENT, BEFORE, AFTER, PRIORITY = range(6)
LINKS = 6

MULTIPLIER, INCREMENT, PRIORITY_MASK = 1103515245, 12345, (1 << 31) - 1  # the C standard's example generator


@helper_kernel
def hang(links: Int64Array, above: Integer, old: Integer, node: Integer) -> None:
    """Hang a node, or 0 for none, below another in the place of its child `old`."""
    if above == 0 or links[above, RIGHT] == old:
        links[above, RIGHT] = node
    else:
        links[above, LEFT] = node
    if node != 0:
        links[node, PARENT] = above


@helper_kernel
def rotate_up(links: Int64Array, node: Integer) -> None:
    """Put a node in the place of its parent, which becomes its child; the order stays."""
    parent = links[node, PARENT]
    above = links[parent, PARENT]
    if links[parent, LEFT] == node:
        inner = links[node, RIGHT]
        links[parent, LEFT], links[node, RIGHT] = inner, parent
    else:
        inner = links[node, LEFT]
        links[parent, RIGHT], links[node, LEFT] = inner, parent
    if inner != 0:
        links[inner, PARENT] = parent
    hang(links, above, parent, node)
    links[parent, PARENT] = node


@helper_kernel
def insert_after(links: Int64Array, place: Integer, node: Integer) -> None:
    """Insert a node behind another, or in front of all for 0.

    Needs   links[0, PRIORITY] holds the state of the sequence; links[0, AFTER] is the first node.
    """
    # Link it into the list.
    follower = links[place, AFTER]
    links[node, BEFORE], links[node, AFTER] = place, follower
    links[place, AFTER] = node
    if follower != 0:
        links[follower, BEFORE] = node

    # Hang it below its neighbour on one side or the other; one of the two places is free.
    links[node, LEFT] = links[node, RIGHT] = 0
    if place == 0 and links[0, RIGHT] == 0:
        links[0, RIGHT], links[node, PARENT] = node, 0
    elif place != 0 and links[place, RIGHT] == 0:
        links[place, RIGHT], links[node, PARENT] = node, place
    else:
        links[follower, LEFT], links[node, PARENT] = node, follower

    # Rotate it up to where its priority belongs.
    links[0, PRIORITY] = (links[0, PRIORITY] * MULTIPLIER + INCREMENT) & PRIORITY_MASK
    priority = links[0, PRIORITY]
    links[node, PRIORITY] = priority
    while links[node, PARENT] != 0 and links[links[node, PARENT], PRIORITY] < priority:
        rotate_up(links, node)


@helper_kernel
def take_out(links: Int64Array, node: Integer) -> None:
    """Take a node out."""
    before, after = links[node, BEFORE], links[node, AFTER]
    links[before, AFTER] = after
    if after != 0:
        links[after, BEFORE] = before

    # Let its children rise until there is at most one.
    while links[node, LEFT] != 0 and links[node, RIGHT] != 0:
        left, right = links[node, LEFT], links[node, RIGHT]
        rotate_up(links, left if links[left, PRIORITY] > links[right, PRIORITY] else right)
    child = links[node, LEFT] if links[node, LEFT] != 0 else links[node, RIGHT]
    hang(links, links[node, PARENT], node, child)
