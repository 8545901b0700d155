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
AT_ONCE = 256  # keyframes whose echoes are looked up in the map together
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
    begins, points, tangents, bearings = _lines(scans)
    _average(begins, poses, points, tangents)
    weights = np.empty(len(points), np.float32)
    for first in range(0, len(poses), AT_ONCE):
        here = begins[first : first + AT_ONCE + 1]
        world = _moved(here, poses[first : first + AT_ONCE], points)
        h = map_model.cells.sample(world)[0]
        weights[here[0] : here[-1]] = h * (np.float32(1.0 + GRAZED) / (h + np.float32(GRAZED)))
    mounts = np.array([scan.mount[:2] for scan in scans])
    return Echoes(begins, points, tangents, bearings, weights, mounts)


def _lines(scans: Sequence[Scan]) -> tuple[np.ndarray, ...]:
    """`begins`, and points, tangents and bearings of the echoes on lines, as in `Echoes`. They are
    written to where they stay: a list of the parts would take as much memory once more."""
    most = sum(len(scan.ranges) for scan in scans)
    points, tangents = np.empty((most, 2), np.float32), np.empty((most, 2), np.float32)
    bearings, begins = np.empty(most, np.float32), np.zeros(len(scans) + 1, np.int64)
    for n, scan in enumerate(scans):
        on_lines = _lines_of(scan)
        here = slice(begins[n], begins[n] + len(on_lines))
        points[here], tangents[here] = on_lines[:, :2], on_lines[:, 2:4]
        bearings[here], begins[n + 1] = on_lines[:, 4], here.stop
    used = begins[-1]
    return begins, points[:used], tangents[:used], bearings[:used]


def _lines_of(scan: Scan) -> np.ndarray:
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
    """(k, 2) m, where the echoes of consecutive keyframes at `poses` (n, 3) lie in the world.

    begins  (n + 1,) theirs
    points  of all keyframes, each in its robot's frame
    """
    moved = np.empty((begins[-1] - begins[0], 2))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]), np.sin(poses[n, 2])
        for k in range(begins[n], begins[n + 1]):
            x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
            moved[k - begins[0], 0] = poses[n, 0] + c * x - s * y
            moved[k - begins[0], 1] = poses[n, 1] + s * x + c * y
    return moved


@kernel
def _keys(begins, poses, points, tangents):
    """(echoes,) of each echo its square and the direction of its tangent, as one number."""
    keys = np.empty(len(points), np.int64)
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]), np.sin(poses[n, 2])
        x0, y0 = poses[n, 0] - poses[0, 0], poses[n, 1] - poses[0, 1]
        for k in range(begins[n], begins[n + 1]):
            x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
            col = np.int64(np.floor((x0 + c * x - s * y) / CELL))
            row = np.int64(np.floor((y0 + s * x + c * y) / CELL))
            tx, ty = np.float64(tangents[k, 0]), np.float64(tangents[k, 1])
            turn = np.arctan2(s * tx + c * ty, c * tx - s * ty) / math.tau
            direction = np.int64(np.rint(turn * DIRECTIONS)) % DIRECTIONS
            keys[k] = (col * MAX_CELLS + row) * DIRECTIONS + direction
    return keys


def _average(begins: np.ndarray, poses: Array, points: np.ndarray, tangents: np.ndarray) -> None:
    """Replace the tangents of all echoes by the means of those of like direction in the square of
    each."""
    keys = _keys(begins, poses, points, tangents)
    known = np.unique(keys)
    places = _number(keys, known)
    sums = _sums(begins, poses[:, 2], tangents, places, len(known))
    wide = sums.copy()
    for step in (-1, 1):
        beside = known - known % DIRECTIONS + (known + step) % DIRECTIONS
        found = np.searchsorted(known, beside) % max(len(known), 1)
        wide += np.where((known[found] == beside)[:, None], sums[found], 0.0)
    _replace(begins, poses[:, 2], tangents, places, wide / np.hypot(*wide.T)[:, None])


@kernel
def _number(keys, known):
    """Replace each key by its number among the `known` ones, which ascend; returns them."""
    number = 0
    for k in range(len(keys)):
        if known[number] != keys[k]:  # echoes side by side are mostly in one square
            number = np.searchsorted(known, keys[k])
        keys[k] = number
    return keys


@kernel
def _sums(begins, headings, tangents, places, count):
    """(count, 2) the sums of the tangents, in the world, of the echoes at each of the `places`."""
    sums = np.zeros((count, 2))
    for n in range(len(headings)):
        c, s = np.cos(headings[n]), np.sin(headings[n])
        for k in range(begins[n], begins[n + 1]):
            x, y = np.float64(tangents[k, 0]), np.float64(tangents[k, 1])
            sums[places[k], 0] += c * x - s * y
            sums[places[k], 1] += s * x + c * y
    return sums


@kernel
def _replace(begins, headings, tangents, places, means):
    """Write the means (count, 2) at the `places`, in the frames of the robots, to the tangents."""
    for n in range(len(headings)):
        c, s = np.cos(headings[n]), np.sin(headings[n])
        for k in range(begins[n], begins[n + 1]):
            x, y = means[places[k], 0], means[places[k], 1]
            tangents[k, 0], tangents[k, 1] = c * x + s * y, c * y - s * x
