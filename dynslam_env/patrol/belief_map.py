"""BeliefMap: a dynamic map that knows doors, and says how probably each is closed now."""

from __future__ import annotations

import numpy as np

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.place_doors import PlaceDoors, SuspectedDoor
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.log_odds import Evidence
from slam.scan import Scan

FOLLOWING = Evidence(hit=3.0, free=-3.0, prior=0.5)  # a cell follows an opening within two scans
DOORWAY_DEPTH = 0.3  # m from a wall's middle line, in which the leaf of a doorway stands
SWEPT_MARGIN = 0.15  # m, beyond a leaf's width from the jambs


class BeliefMap(DynamicMap):
    """A `DynamicMap` whose doors are objects (`PlaceDoors`), to be used as the patrol's `memory`.

    Cells follow what is seen within two scans. Cells of a suspected doorway are occupied with the
    probability that its leaf is closed, which drifts by the laws that the doors of the place share.
    Only changes of a door's confirmed state count as flips: cells away from doors have none.

    doors  the suspected doors
    """

    def __init__(self) -> None:
        super().__init__(FOLLOWING)
        self.doors = PlaceDoors()

    def look(self, scan: Scan, pose: Pose2) -> float:
        """See `DynamicMap`."""
        self.doors.look(scan, pose)
        return super().look(scan, pose)

    def occupied(self, points: Array, time: float) -> Array:
        """(n,) P(occupied at `time`) at points (n, 2), m, of places where a leaf may stand: in a
        known doorway P(its leaf is closed), elsewhere that of a new door; NaN where never
        observed."""
        seen, ages = super().occupied(points, time), self.age(points, time)
        found = self.doors.drifted(seen, ages, time)
        doors = [door for door in self.doors.known() if door.seen]
        inside = _doorways(points, _places(doors))
        for k in np.flatnonzero(np.bincount(inside[inside >= 0])):
            found[inside == k] = self.doors.closed(doors[k], time)
        return found

    def door_beliefs(self, time: float) -> list[DoorBelief]:
        """See `DynamicMap`."""
        return self.doors.beliefs(time)

    def beliefs(self, time: float) -> Beliefs:
        """See `DynamicMap`."""
        cells = super().beliefs(time)
        occupied, flips = cells.occupied.copy(), np.zeros_like(cells.flips)
        doors = [door for door in self.doors.known() if door.seen]
        closed = np.array([self.doors.closed(door, time) for door in doors])
        flipped = np.array([door.filter.flips > 0 for door in doors], dtype=np.bool_)
        _overlay(_places(doors), closed, flipped, cells, occupied, flips)
        return cells._replace(occupied=occupied, flips=flips)


def _places(doors: list[SuspectedDoor]) -> Array:
    """(d, 4) of each door, as `SuspectedDoor.place`."""
    return np.array([door.place for door in doors]).reshape(-1, 4)


@kernel
def _overlay(places, closed, flipped, cells: Beliefs, occupied, flips):
    """Write P(closed) (d,) of doors, and the flips of those that `flipped` (d,), into the arrays
    (rows, cols) around them."""
    spec, cell = cells.spec, cells.spec.resolution
    for d in range(len(places)):
        reach = 1.5 * places[d, 3] + SWEPT_MARGIN + DOORWAY_DEPTH + cell
        top = int(np.floor((places[d, 1] - reach) / cell)) - spec.row0
        left = int(np.floor((places[d, 0] - reach) / cell)) - spec.col0
        bottom = int(np.floor((places[d, 1] + reach) / cell)) - spec.row0
        right = int(np.floor((places[d, 0] + reach) / cell)) - spec.col0
        for row in range(max(top, 0), min(bottom, spec.rows)):
            for col in range(max(left, 0), min(right, spec.cols)):
                x, y = (spec.col0 + col + 0.5) * cell, (spec.row0 + row + 0.5) * cell
                if cells.observed[row, col] and _in_doorway(places[d], x, y):
                    occupied[row, col] = closed[d]
                if flipped[d] and _swept(places[d], x, y):
                    flips[row, col] = cells.flips[row, col]


@kernel
def _doorways(points, places):
    """(n,) the last doorway of `places` (d, 4) in which each of the points (n, 2), m, is; or -1."""
    found = np.full(len(points), -1)
    for k in range(len(points)):
        for d in range(len(places)):
            if _in_doorway(places[d], points[k, 0], points[k, 1]):
                found[k] = d
    return found


@kernel
def _in_doorway(place, x, y):
    """Whether a point, m, is between the jambs, within the depth of the wall."""
    dx, dy, ux, uy = x - place[0], y - place[1], np.cos(place[2]), np.sin(place[2])
    along, across = dx * ux + dy * uy, dy * ux - dx * uy
    return abs(along) <= place[3] / 2 and abs(across) <= DOORWAY_DEPTH


@kernel
def _swept(place, x, y):
    """Whether a point, m, is where a leaf hung on either jamb may stand."""
    half, nearest = 0.5 * place[3], np.inf
    for side in (-1.0, 1.0):
        dx = x - place[0] - side * half * np.cos(place[2])
        dy = y - place[1] - side * half * np.sin(place[2])
        nearest = min(nearest, np.hypot(dx, dy))
    return nearest <= place[3] + SWEPT_MARGIN
