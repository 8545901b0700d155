"""Poses that are wrong within the map, whatever the error of the map itself.

A pose is compared with the first earlier one at about the same place: it drew what the later one
sees. An error that both share does no harm, such as the drift of a map without loops, and no scan
tells of it. A map that was corrected, as where a loop closes, has the earlier one elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array, between

LOST_DISTANCE = 0.3  # m, LOST_TURN in rad: a pose farther off is wrong
LOST_TURN = math.radians(10.0)
NEAR = 1.5  # m, between true positions at which much the same is seen
CELL = 0.5  # m, of the grid in which the first pose is looked up
Bools = np.ndarray


def wrong_within_map(
    poses: Array, truth: Array, drawn: Bools, revisions: Sequence[Array] = ()
) -> Bools:
    """(n,) whether each pose is off by more than LOST_DISTANCE or LOST_TURN, in relation to the
    first pose within NEAR that was `drawn`; where there is none, to the last that was.

    poses, truth  (n, 3) online estimates and true poses
    drawn         (n,) whether the scan may be part of the map: the SLAM was not lost
    revisions     (k, 3) arrays: poses of the first k scans in the map from the k-th on, where the
                  SLAM moved them
    """
    reference = _references(truth[:, :2], drawn)
    drawn_at = poses[reference]
    for revised in revisions:
        moved = (reference < len(revised)) & (np.arange(len(poses)) >= len(revised) - 1)
        drawn_at[moved] = revised[reference[moved]]
    true, found = between(truth[reference], truth), between(drawn_at, poses)
    error = between(true, found)
    far = np.hypot(error[:, 0], error[:, 1]) > LOST_DISTANCE
    return far | (np.abs(error[:, 2]) > LOST_TURN)


def _references(positions: Array, drawn: Bools) -> np.ndarray:
    """(n,) index of the pose with which each one is compared."""
    cells = np.floor(positions / CELL).astype(np.int64)
    reach = range(-math.ceil(NEAR / CELL), math.ceil(NEAR / CELL) + 1)
    offsets = [(i, j) for i in reach for j in reach if math.hypot(i, j) * CELL <= NEAR]
    first: dict[tuple[int, int], int] = {}
    result, last = np.zeros(len(positions), np.int64), 0
    for k, (i, j) in enumerate(cells.tolist()):
        near = [first[i + di, j + dj] for di, dj in offsets if (i + di, j + dj) in first]
        result[k] = min(near, default=last)
        if drawn[k]:
            first.setdefault((i, j), k)
            last = k
    return result
