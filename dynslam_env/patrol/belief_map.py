"""BeliefMap: a dynamic map that knows doors, and says how probably each is closed now."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.place_doors import PlaceDoors, SuspectedDoor
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
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
        for door in self.doors.known():
            inside = _in_doorway(door, points)
            if inside.any() and door.seen:
                found[inside] = self.doors.closed(door, time)
        return found

    def door_beliefs(self, time: float) -> list[DoorBelief]:
        """See `DynamicMap`."""
        return self.doors.beliefs(time)

    def beliefs(self, time: float) -> Beliefs:
        """See `DynamicMap`."""
        cells = super().beliefs(time)
        occupied, flips = cells.occupied.copy(), np.zeros_like(cells.flips)
        for door in self.doors.known():
            if door.seen:
                self._overlay(door, time, cells, occupied, flips)
        return cells._replace(occupied=occupied, flips=flips)

    def _overlay(
        self, door: SuspectedDoor, time: float, cells: Beliefs, occupied: Array, flips: Array
    ) -> None:
        """Write P(closed) and the flips of a door into the arrays (rows, cols) around it."""
        block, points = _around(door, cells.spec)
        shape = occupied[block].shape
        inside = _in_doorway(door, points).reshape(shape) & cells.observed[block]
        occupied[block][inside] = self.doors.closed(door, time)
        if door.filter.flips:
            swept = _swept(door, points).reshape(shape)
            flips[block][swept] = cells.flips[block][swept]


def _around(door: SuspectedDoor, spec: GridSpec) -> tuple[tuple[slice, slice], Array]:
    """The block of cells that a door may sweep, and the (n, 2) m centres of its cells."""
    reach = 1.5 * door.place[3] + SWEPT_MARGIN + DOORWAY_DEPTH + spec.resolution
    corners = spec.cells(door.place[:2] + np.array([[-reach, -reach], [reach, reach]]))
    (top, left), (bottom, right) = np.clip(corners, 0, np.array(spec.shape)).tolist()
    rows, cols = np.mgrid[top:bottom, left:right]
    points = spec.centres(np.column_stack([rows.ravel(), cols.ravel()]))
    return (slice(top, bottom), slice(left, right)), points


def _in_doorway(door: SuspectedDoor, points: Array) -> NDArray[np.bool_]:
    """(n,) whether points (n, 2), m, are between the jambs, within the depth of the wall."""
    x, y, direction, width = door.place
    along = (points - (x, y)) @ (np.cos(direction), np.sin(direction))
    across = (points - (x, y)) @ (-np.sin(direction), np.cos(direction))
    return (abs(along) <= width / 2) & (abs(across) <= DOORWAY_DEPTH)


def _swept(door: SuspectedDoor, points: Array) -> NDArray[np.bool_]:
    """(n,) whether points (n, 2), m, are where a leaf hung on either jamb may stand."""
    x, y, direction, width = door.place
    half = 0.5 * width * np.array([np.cos(direction), np.sin(direction)])
    away = [np.hypot(*(points - (x, y) - side * half).T) for side in (-1, 1)]
    return np.minimum(*away) <= width + SWEPT_MARGIN
