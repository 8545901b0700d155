"""Doors of a mapped place: the gaps of `doors.geojson` as hinged leaves."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from dynslam_env.worlds.clearance import sweep
from dynslam_env.worlds.layout import LATCH_GAP, Door
from slam.bounds import MAX_COORDINATE, bounded
from slam.geometry import Array
from slam.io.files import AnyPath
from slam.io.small_text import parse_text

THICKNESS = 0.04  # m, of a leaf
SHORTEST = 0.3  # m, of a leaf
MOSTLY = 0.5  # share of the time
MAX_BYTES = 1 << 24  # of a file of doors; one takes 1 kB


def read_gaps(path: AnyPath, least_probability: float) -> list[Array]:
    """(2, 2) ends of each gap of at least this probability, m, of a file of `dynslam map`, but of
    doors that stood closed and did not move: the map has a wall there.

    Raises InputError for another file.
    """
    found = parse_text(path, "a file of doors that `dynslam map` wrote", _gaps, MAX_BYTES)
    return [ends for ends, probability in found if probability >= least_probability]


def _gaps(text: str) -> list[tuple[Array, float]]:
    """Ends of each gap, m, and its probability, but of doors that stood closed."""
    features = json.loads(text)["features"]
    found = [one for one in features if not _stood_closed(one["properties"])]
    return [(_ends(one), float(one["properties"]["probability"])) for one in found]


def _stood_closed(properties: dict[str, Any]) -> bool:
    """Whether a door was not seen to move, and mostly closed; one added by hand was not."""
    return properties.get("flips") == 0 and properties.get("open_share", 1.0) < MOSTLY


def _ends(feature: dict[str, Any]) -> Array:
    """Middles of the short sides of the rectangle a, b, c, d, a."""
    ring = np.array(feature["geometry"]["coordinates"][0], dtype=np.float64)
    if ring.shape != (5, 2) or not bounded(ring, MAX_COORDINATE):
        raise ValueError("a polygon that is no rectangle on earth")
    ends = np.array([ring[0] + ring[3], ring[1] + ring[2]]) / 2
    if np.hypot(*(ends[1] - ends[0])) < SHORTEST:
        raise ValueError(f"a door narrower than {SHORTEST:g} m")
    return ends


def hung(gap: Array, walls: Array) -> Door:
    """The leaf that closes a gap, hinged at that end and opening to that side where the walls
    (w, 4), m, are least in its way. The map tells neither.
    """
    return min(_leaves(gap), key=lambda door: _in_the_way(door, walls))


def _leaves(gap: Array) -> Iterator[Door]:
    """The four leaves that close a gap."""
    for hinge, tip in (gap, gap[::-1]):
        along = tip - hinge
        width, closed = float(np.hypot(*along)), math.atan2(along[1], along[0])
        for swing in (1, -1):
            across = swing * THICKNESS / 2 * np.array([-along[1], along[0]]) / width
            x, y = (hinge + across).tolist()
            yield Door((x, y), closed, swing, width - LATCH_GAP, THICKNESS)


def _in_the_way(door: Door, walls: Array) -> float:
    """Length in m of walls with their middle in the area that the leaf sweeps."""
    middles = (walls[:, :2] + walls[:, 2:]) / 2
    near = np.hypot(*(middles - door.hinge).T) < door.width
    lengths = np.hypot(*(walls[near, 2:] - walls[near, :2]).T)
    return float(lengths[swept(door, middles[near])].sum())


def swept(door: Door, points: Array) -> np.ndarray:
    """Which of the points (n, 2), m, are in the area that the leaf sweeps, closed to open."""
    outline = sweep(door)
    x, y = points[:, :1], points[:, 1:]
    x1, y1, x2, y2 = outline.T
    above = (y1 > y) != (y2 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossed = above & (x < x1 + (y - y1) / (y2 - y1) * (x2 - x1))
    return crossed.sum(axis=1) % 2 == 1
