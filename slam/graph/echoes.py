"""The echoes of many keyframes, as the alignment of keyframes compares them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.interface import MapModel
from slam.kernel import kernel
from slam.maps.outline import LINE, outline
from slam.scan import Scan

CELL = 0.2  # m, of the squares in which tangents are averaged
DIRECTIONS = 24  # classes of tangents; an echo's own and the two beside it are averaged
MAX_CELLS = 1 << 24  # along each axis: makes one key of a square and a direction
GRAZED = 0.1  # h of a wall that most beams pass at a grazing angle


class Echoes(NamedTuple):
    """The echoes on lines of n keyframes, keyframe by keyframe, each in its robot's frame.

    begins    (n + 1,) of each keyframe, and the end of the last
    points    (echoes, 2) float32, m
    tangents  (echoes, 2) float32, unit vectors along the surface, which the sensor sees on its left
    bearings  (echoes,) float32, rad, from the sensor; ascending within a keyframe
    weights   (echoes,) float32, 0 to 1: whether the surface still stands
    sensors   (n, 2) m, the sensor on the robot
    """

    begins: np.ndarray
    points: np.ndarray
    tangents: np.ndarray
    bearings: np.ndarray
    weights: np.ndarray
    sensors: Array


def echoes_of(scans: Sequence[Scan], poses: Array, map_model: MapModel) -> Echoes:
    """The echoes of scans taken at `poses` (n, 3); a map drawn at these tells what still stands.

    The line through an echo follows the noise of that echo: a wall seen over 10 m would be told to
    lie ahead or behind by it. So tangents are means over the echoes of all keyframes in a square.
    """
    parts, sensors = [_lines(scan) for scan in scans], [scan.mount[:2] for scan in scans]
    begins = np.cumsum([0] + [len(part) for part in parts])
    points, tangents, bearings = np.split(np.concatenate(parts), (2, 4), axis=1)
    turns = poses * (0.0, 0.0, 1.0)
    world = _moved(begins, poses, points)
    means = _averaged(world - poses[0, :2], _moved(begins, turns, tangents))
    own = _moved(begins, -turns, means).astype(np.float32)
    h = map_model.cells.sample(world)[0]
    return Echoes(
        begins, points, own, np.ascontiguousarray(bearings[:, 0]),
        h * (np.float32(1.0 + GRAZED) / (h + np.float32(GRAZED))), np.array(sensors),
    )  # fmt: skip


def _lines(scan: Scan) -> np.ndarray:
    """(n, 5) float32 points, tangents and bearings of the echoes on lines, by ascending bearing."""
    points, tangents, kind = outline(scan.bare().points)
    chosen = kind == LINE
    points, tangents = points[chosen], tangents[chosen]
    x, y = (points - scan.mount[:2]).T
    left = tangents[:, 1] * x - tangents[:, 0] * y >= 0.0  # of the tangent is the sensor
    tangents = np.where(left[:, None], tangents, -tangents)
    bearings = np.arctan2(y, x)
    order = np.argsort(bearings, kind="stable")
    return np.column_stack([points, tangents, bearings])[order].astype(np.float32)


@kernel
def _moved(begins, poses, points):
    """(echoes, 2) the points, each moved by the pose (n, 3) of its keyframe."""
    moved = np.empty((len(points), 2))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]), np.sin(poses[n, 2])
        for k in range(begins[n], begins[n + 1]):
            moved[k, 0] = poses[n, 0] + c * points[k, 0] - s * points[k, 1]
            moved[k, 1] = poses[n, 1] + s * points[k, 0] + c * points[k, 1]
    return moved


def _averaged(points: Array, tangents: Array) -> Array:
    """(n, 2) the mean of the tangents (n, 2) of like direction in the square of each point."""
    cells = np.floor(points / CELL).astype(np.int64)
    key = (cells[:, 0] * MAX_CELLS + cells[:, 1]) * DIRECTIONS
    turns = np.arctan2(tangents[:, 1], tangents[:, 0]) / math.tau
    classes = np.rint(turns * DIRECTIONS).astype(np.int64) % DIRECTIONS
    keys, place = np.unique(key + classes, return_inverse=True)
    sums = np.zeros((len(keys), 2))
    np.add.at(sums, place, tangents)
    wide = sums.copy()
    for step in (-1, 1):
        beside = keys - keys % DIRECTIONS + (keys + step) % DIRECTIONS
        found = np.searchsorted(keys, beside) % max(len(keys), 1)
        wide += np.where((keys[found] == beside)[:, None], sums[found], 0.0)
    wide = wide[place]
    return wide / np.hypot(*wide.T)[:, None]
