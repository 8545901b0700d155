"""Sights: when a robot that drives the ways of a viewpoint table sees which doorway."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.table import LOOK_TIME, WAY_STEP, ViewpointTable
from dynslam_env.navigation.costmap import OCCUPIED, Costmap
from dynslam_env.navigation.planner import Plan
from dynslam_env.patrol.door_looks import INNER_SHARE
from dynslam_env.patrol.echoes import MAX_DISTANCE, MIN_BEAMS
from slam.geometry import Array
from slam.kernel import kernel

SLICES = 8  # of a way's time
BEAM = math.radians(1.0)  # between two beams
FIELD = math.radians(90)  # on each side of the robot's heading
HIDDEN = 0.35  # m before a doorway's middle, where its own leaf and jambs do not count


def sights(costmap: Costmap, table: ViewpointTable, plans: Sequence[Plan]) -> NDArray[np.uint8]:
    """(v, v, d) bit k: a doorway is seen in the k-th of SLICES equal parts of a way's time.

    A doorway is seen where MIN_BEAMS beams reach it, ahead of the robot; and all around while the
    robot turns at the end of its way.
    """
    spec, points = costmap.spec, table.points
    cells, origin = spec.cells(points), np.array([spec.col0, spec.row0]) * spec.resolution
    found = np.zeros((len(points), len(points), len(table.doors)), np.uint8)
    for i, here in enumerate(plans):
        for j in np.flatnonzero(np.isfinite(table.between[i])):
            row, col = cells[j].tolist()
            poses = _poses(here.path((row, col))[::WAY_STEP], points[j])
            shares = _shares(poses, table.between[i, j])
            _see(poses, shares, table.doors, costmap.kinds, origin, spec.resolution, found[i, j])
    return found


def _poses(path: Array, end: Array) -> Array:
    """(n, 4) x, y, heading and half the field of view along a path (n, 2), m, and at its end."""
    points = np.concatenate([path, end[None]]) if len(path) else end[None]
    steps = np.diff(points, axis=0)
    moved = np.hypot(*steps.T) > 1e-6
    driven = np.concatenate([points[:-1][moved], np.arctan2(*steps[moved].T[::-1])[:, None],
                             np.full((int(moved.sum()), 1), FIELD)], axis=1)  # fmt: skip
    return np.concatenate([driven, [[*end, 0.0, math.pi]]])


def _shares(poses: Array, time: float) -> Array:
    """(n,) share of a way's time at each pose; the look around is at the end."""
    gone = np.concatenate([[0.0], np.hypot(*np.diff(poses[:, :2], axis=0).T).cumsum()])
    driving = max(1.0 - LOOK_TIME / time, 0.0)
    shares = driving * gone / max(gone[-1], 1e-6)
    shares[-1] = 1.0
    return shares


@kernel
def _see(poses, shares, doors, kinds, origin, cell, found):
    for p in range(len(poses)):
        for d in range(len(doors)):
            dx, dy = doors[d, 0] - poses[p, 0], doors[d, 1] - poses[p, 1]
            away = max(np.hypot(dx, dy), 1e-6)
            across = abs(dx * np.sin(doors[d, 2]) - dy * np.cos(doors[d, 2])) / away
            if away > MAX_DISTANCE or INNER_SHARE * doors[d, 3] * across < MIN_BEAMS * BEAM * away:
                continue
            off = np.arctan2(dy, dx) - poses[p, 2]
            if abs((off + np.pi) % (2 * np.pi) - np.pi) > poses[p, 3]:
                continue
            steps, clear = int(np.ceil(2 * away / cell)), True
            for s in range(int(steps * max(1.0 - HIDDEN / away, 0.0))):
                i = int(np.floor((poses[p, 1] + dy * s / steps - origin[1]) / cell))
                j = int(np.floor((poses[p, 0] + dx * s / steps - origin[0]) / cell))
                clear = 0 <= i < kinds.shape[0] and 0 <= j < kinds.shape[1]
                clear = clear and kinds[i, j] != OCCUPIED
                if not clear:
                    break
            if clear:
                found[d] |= np.uint8(1 << min(int(shares[p] * SLICES), SLICES - 1))
