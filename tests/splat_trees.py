"""Trees of splats made by hand, block by block, that know nothing of how the library builds its own."""

from __future__ import annotations

import numpy as np

from scanspan.records import Array, Float64Array

FIELDS = [
    ("center", "f8", (3,)), ("radius", "f8"), ("splat_radius", "f4"), ("cone_axis", "f4", (3,)), ("cone_sine", "f4"),
    ("first_child", "u4"), ("children", "u1"), ("level", "u1"), ("count", "u2"),
]  # fmt: skip


class HandTree:
    """A binary tree over points: a leaf has up to `size` of them, an inner node the mean of every four of its children's."""

    def __init__(self, points: Float64Array, normals: Float64Array | None = None, size: int = 16, radius: float = 0.02) -> None:
        self.rows: list[tuple[object, ...]] = []
        self.points: list[Float64Array] = []  # the splats of each node
        self.parent: list[int] = []
        self.leaf_points: list[Float64Array] = []  # all points below each node
        queue = [(np.arange(len(points)), -1, 0)]
        while queue:
            members, parent, level = queue.pop(0)
            node, own = len(self.rows), points[members]
            halves = []
            if len(members) > size:
                axis = int(np.argmax(np.ptp(own, axis=0)))
                order = members[np.argsort(own[:, axis], kind="stable")]
                halves = [order[: len(order) // 2], order[len(order) // 2 :]]
            step = max(1, -(-len(members) // size))
            groups = [own[np.argsort(own[:, 0], kind="stable")][i : i + step] for i in range(0, len(own), step)]
            splats = np.array([group.mean(axis=0) for group in groups])
            reach = max(float(np.linalg.norm(group - mean, axis=1).max()) for group, mean in zip(groups, splats)) + radius
            center = (own.min(axis=0) + own.max(axis=0)) / 2
            sphere = max(float(np.linalg.norm(np.concatenate([own, splats]) - center, axis=1).max()) + reach, 0.0)
            axis_mean, sine = np.array([0.0, 0.0, 1.0]), 2.0
            if normals is not None:
                mean = normals[members].sum(axis=0)
                axis_mean = mean / np.linalg.norm(mean)
                cosine = float((normals[members] * axis_mean).sum(axis=1).min())
                sine = float(np.sqrt(1 - cosine**2)) + 1e-6 if cosine > 0 else 2.0
            # Children come next in the queue, so their number is known: what stands there already, and waits.
            first = node + 1 + len(queue)
            self.rows.append((center, sphere, reach * 1.0001, axis_mean, sine, first, len(halves), level, len(splats)))
            self.points.append(splats)
            self.parent.append(parent)
            self.leaf_points.append(own)
            queue += [(half, node, level + 1) for half in halves]
        self.nodes: Array = np.array(self.rows, np.dtype(FIELDS))

    def leaves(self) -> set[int]:
        """Return the nodes without children."""
        return set(np.flatnonzero(self.nodes["children"] == 0).tolist())

    def path(self, node: int) -> list[int]:
        """Return a node and all above it."""
        found = [node]
        while self.parent[found[-1]] >= 0:
            found.append(self.parent[found[-1]])
        return found
