"""Missed: doorways that a viewpoint should have shown, and did not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agents.viewpoints.table import Bools, ViewpointTable
from dynslam_env.navigation.door_belief import DoorBelief
from slam.geometry import Array

DURATION = 120.0  # s for which a viewpoint is not expected to show what it did not show
NEAR = 1.0  # m, from that viewpoint to others that count as it
SAME_DOOR = 0.4  # m
ALLOWANCE = 0.5  # s, by which a look may be older than the drive to the viewpoint


class Missed:
    """Pairs of a place and a doorway that was not seen from it: an open leaf may hide it.

    Without this, an agent stays for ever at a viewpoint whose promise is not kept.
    """

    def __init__(self) -> None:
        self._rows = np.empty((0, 5))  # x, y of the place, x, y of the doorway, m; until, s

    def compare(
        self, place: Array, promised: Array, beliefs: Sequence[DoorBelief], now: float, since: float
    ) -> None:
        """Note what a look around at `place` (2,), m, did not show.

        promised  (k, 4) doorways that the table promised, as in `ViewpointTable.doors`
        beliefs   as they are after the look, in any order: more doorways may be known by then
        now       s; since: s, when the drive there began
        """
        unseen = [one.place[:2] for one in beliefs if one.age > now - since + ALLOWANCE]
        for door in np.reshape(unseen, (-1, 2)):
            if (np.hypot(*(promised[:, :2] - door).T) < SAME_DOOR).any():
                row = [[*place, *door, now + DURATION]]
                self._rows = np.concatenate([self._rows, row])
        self._rows = self._rows[self._rows[:, 4] > now]

    def among(self, table: ViewpointTable, now: float) -> Bools:
        """(v, d) whether a doorway was missed at or near a viewpoint, not long ago."""
        rows = self._rows[self._rows[:, 4] > now]
        places = _near(table.points, rows[:, :2], NEAR).astype(np.int64)
        doors = _near(table.doors[:, :2], rows[:, 2:4], SAME_DOOR).astype(np.int64)
        return places @ doors.T > 0


def _near(points: Array, others: Array, distance: float) -> Bools:
    """(n, m) whether points (n, 2) and others (m, 2) are no farther apart, m."""
    return np.hypot(*(points[:, None] - others[None]).transpose(2, 0, 1)) < distance
