"""All scenes and all peers by name, in the order of the tables."""

from __future__ import annotations

from typing import Any

from benchmarks import (
    cloud_peers,
    cloud_scenes,
    engine_peers,
    line_peers,
    map_peers,
    mesh_peers,
    painters,
    peers,
    plane_scenes,
    polygon_peers,
    scenes,
)

PEERS = {
    **peers.PEERS,
    **painters.PEERS,
    **engine_peers.PEERS,
    **mesh_peers.PEERS,
    **line_peers.PEERS,
    **polygon_peers.PEERS,
    **map_peers.PEERS,
    **cloud_peers.PEERS,
    **peers.FILLS,
}
FILL = peers.FILL

START = "start"  # Not a scene, but whole processes.
NAMES = [*scenes.NAMES, *plane_scenes.NAMES, *cloud_scenes.NAMES]
# Names that stand for several scenes.
GROUPS = {group: [name for name in NAMES if name.startswith(group)] for group in ("M", "PS", "PX", "TRI", "MP", "PC")}
GROUPS["M"] = [*scenes.KNOTS, *scenes.MODELS]
ALL = ["A", "B", "C", "D", "E", "F", "G", "H", "I", "M", "T", "L", "LA", "PS", "PX", "Q2", "FF", "TRI", "MP", "PC", START]


def make_scene(name: str, scale: float) -> Any:
    """Return the scene of a name in `NAMES`."""
    homes = (scenes, plane_scenes, cloud_scenes)
    return next(home for home in homes if name in home.NAMES).make(name, scale)


def scene_names(chosen: str) -> list[str]:
    """Return the scenes that names between commas stand for, in the order asked for.

    >>> scene_names("T,PS,start")
    ['T', 'PS-center', 'PS-area', 'start']
    """
    names = [name for part in chosen.split(",") for name in GROUPS.get(part, [part])]
    for name in names:
        if name not in (*NAMES, START):
            raise ValueError(f"unknown scene {name!r}; the valid ones are {', '.join(ALL)}, and {', '.join(NAMES)}")
    return names


def peers_of(kind: str) -> list[str]:
    """Return the names of the peers that can be raced on scenes of a kind."""
    return [name for name, peer in PEERS.items() if kind in peer.kinds]


def is_ours(peer: str) -> bool:
    """Say whether a peer is scanspan itself."""
    return peer.startswith("scanspan ")
